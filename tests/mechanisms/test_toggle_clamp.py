"""The toggle clamp, and mechanisms that lock."""

from __future__ import annotations

from itertools import pairwise
from math import acosh, hypot, inf, pi, sqrt, tau
from typing import Any

import numpy as np
import pytest
import sympy
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from mpmath import mp

from flywheel import Fault, SceneError
from flywheel.mechanisms.families import build, graded, within_turn
from flywheel.mechanisms.linkage import linkage_of
from flywheel.numerics.intervals import NAMESPACE, Interval
from flywheel.scene.scene import Body, Mechanism
from tests.mechanisms.chains import CLAMP, clamp, exactly, walked

# The toggle clamp against its source's read-out, and against its loop equations solved and differentiated at 40 digits.


CLAMPS = {
    "source": clamp(),
    "crossed": clamp(assembly="crossed"),
    "behind": clamp(assembly="open-behind"),
    "crossed, behind": clamp(assembly="crossed-behind"),
    "short rod": clamp(rod=0.1, angle=0.4, stroke=(0.05, 0.2)),
    "long coupler, turned": clamp(0.1, 0.05, 0.2, 0.3, 0.31, -2.0, (-0.12, -0.2)),
    "arms alike": clamp(0.14, 0.12, 0.12, 0.2, 0.2, 0.3, (-0.03, 0.18)),
    "straight": clamp(angle=0.0),
    "one way below": clamp(0.1, 0.3, 0.15, 0.22, 0.26, 0.5, (-0.4, -0.13)),
}
clamps = pytest.mark.parametrize("mechanism", CLAMPS.values(), ids=CLAMPS.keys())


@clamps
def test_its_linkage_begins_with_the_stroke(mechanism: Mechanism) -> None:
    assert mechanism.stroke is not None
    assert linkage_of(mechanism).start == mechanism.stroke[0]


@pytest.fixture(autouse=True)
def _forty_digits() -> Any:
    with mp.workdps(40):
        yield


class Loops:
    """Both loop equations at one displacement: positions x = (theta2, theta3, theta6, s), x' and x'' by the Jacobian."""

    def __init__(self, mechanism: Mechanism, psi: Any, near: list[float]) -> None:
        geometry = exactly(mechanism).geometry
        a1, a2, a3, a5, a6 = (geometry[name] for name in CLAMP)
        alpha = geometry["bell_crank.angle"]

        def gaps(t2: Any, t3: Any, t6: Any, s: Any) -> list[Any]:
            first = a2 * mp.expj(t2) + a3 * mp.expj(t3) - a1 * mp.mpc(0, 1) + psi
            second = a5 * mp.expj(t2 + alpha + mp.pi) + a6 * mp.expj(t6) - s
            return [first.real, first.imag, second.real, second.imag]

        self.x = t2, t3, t6, _ = list(mp.findroot(gaps, near, tol=mp.mpf(10) ** -70))
        self.lengths, self.clamp = (a1, a2, a3, a5, a6), t2 + alpha + mp.pi
        u2, u3, u5, u6 = (mp.expj(angle) for angle in (t2, t3, self.clamp, t6))
        columns = [(1j * a2 * u2, 1j * a5 * u5), (1j * a3 * u3, 0), (0, 1j * a6 * u6), (0, -1)]
        jacobian = mp.matrix(4, 4)
        for k, column in enumerate(columns):
            for j, entry in enumerate(map(mp.mpc, column)):
                jacobian[2 * j, k], jacobian[2 * j + 1, k] = entry.real, entry.imag
        self.rate = r2, r3, r6, _ = list(mp.lu_solve(jacobian, mp.matrix([-1, 0, 0, 0])))
        first, second = a2 * u2 * r2**2 + a3 * u3 * r3**2, a5 * u5 * r2**2 + a6 * u6 * r6**2
        self.slope = list(mp.lu_solve(jacobian, mp.matrix([first.real, first.imag, second.real, second.imag])))

    def centres(self, bodies: dict[str, Body]) -> dict[str, tuple[Any, Any]]:
        """Velocity of each centre of mass over that of the block, and angular velocity."""
        (_, a2, _, a5, _), (t2, t3, t6, _), (r2, r3, r6, rs) = self.lengths, self.x, self.rate

        def along(angle: Any, body: Body) -> Any:
            return 1j * body.com * mp.expj(angle + body.com_angle)

        pin, far = 1j * a2 * mp.expj(t2) * r2, 1j * a5 * mp.expj(self.clamp) * r2
        return {
            "block": (mp.mpc(-1), 0),
            "bell_crank": (along(self.clamp, bodies["bell_crank"]) * r2, r2),
            "coupler": (pin + along(t3, bodies["coupler"]) * r3, r3),
            "rod": (far + along(t6, bodies["rod"]) * r6, r6),
            "platen": (mp.mpc(rs), 0),
        }


PORTS = ("bell_crank", "coupler", "rod", "platen")


def solved(mechanism: Mechanism, psi: float) -> Loops:
    family = build(mechanism)
    position = family.position(psi, np)
    return Loops(mechanism, mp.mpf(psi), [float(family.ports[name].position(position)) for name in PORTS])


def standstill(mechanism: Mechanism, low: float, high: float) -> float:
    """Position at which the platen is at rest though the block moves, by bisection."""
    family = build(mechanism)
    sense = walked(family, low)["platen"][0]
    while (middle := 0.5 * (low + high)) not in (low, high):
        low, high = (middle, high) if walked(family, middle)["platen"][0] * sense > 0 else (low, middle)
    return low


def test_the_read_out_of_the_source_at_full_stretch() -> None:
    family, speed = build(CLAMPS["source"]), 0.3289474
    position, gains = family.position(0.19, np), walked(family, 0.19)
    assert [family.ports[name].position(position) for name in PORTS] == pytest.approx([2.83967, 1.89156, 0, 0.48], abs=6e-5)
    assert position.clamp == pytest.approx(6.2833, abs=5e-5)
    speeds = [gains[name][0] * speed for name in PORTS]
    assert speeds == pytest.approx([-0.7616, 4.0698, 0.6445, 0.02179e-3], rel=8e-5, abs=5e-9)
    accelerations = [gains[name][1] * speed**2 for name in PORTS]
    assert accelerations == pytest.approx([-11.972, 13.152, 10.130, -235.27e-3], rel=4e-5)


def test_the_read_out_of_the_source_contradicts_itself_in_theta2_and_theta5() -> None:
    """Printed theta2 = 2.836 and theta5 = 6.264; with the printed theta6 = 0 and s = 480 mm the arm stands at 2 pi."""
    position = build(CLAMPS["source"]).position(0.19, np)
    assert abs(position.bell_crank - 2.836) > 3e-3
    assert abs(position.clamp - 6.264) > 0.019
    off = build(clamp(angle=0.286)).position(0.19, np)
    assert off.clamp == pytest.approx(6.264, abs=4e-3)
    assert abs(off.rod) > 0.01


@clamps
def test_floats_agree_with_the_loop_equations_and_the_bodies(mechanism: Mechanism) -> None:
    family, pull = build(mechanism), 0.6 - 9.7j
    for psi in np.linspace(*mechanism.stroke, 4):
        true, position, gains = solved(mechanism, psi), family.position(psi, np), walked(family, psi)
        for k, name in enumerate(PORTS):
            value = family.ports[name].position(position)
            assert abs(value - true.x[k]) <= 1e-12, name
            for result, exact in zip(gains[name], (true.rate[k], true.slope[k]), strict=True):
                assert abs(result - exact) <= 1e-12 * max(1, abs(exact)), name
        assert gains["block"] == (1.0, 0.0)
        assert family.ports["block"].position(position) == psi
        centres, energy = true.centres(exactly(mechanism).bodies), mp.mpf(0)
        for name, body in mechanism.bodies.items():
            speed, spin = centres[name]
            energy += body.mass * abs(speed) ** 2 + body.inertia * spin**2
            own = [weight for weight in family.weights if weight.body == name]
            result = sum(w.mass * (pull.conjugate() * np.exp(1j * w.direction)).real * gains[w.velocity][0] for w in own)
            expected = body.mass * (mp.conj(mp.mpc(pull)) * speed).real
            assert result == pytest.approx(float(expected), rel=1e-12, abs=1e-12)
        assert sum(m.value * gains[m.velocity][0] ** 2 for m in family.masses) == pytest.approx(float(energy), rel=1e-13)


@pytest.mark.parametrize("between", [(0.12, 0.155), (0.185, 0.195)])
def test_digits_stay_where_the_toggle_stretches(between: tuple[float, float]) -> None:
    mechanism = clamp(stroke=(-0.06, 0.2))
    centre, family = standstill(mechanism, *between), build(mechanism)
    assert family.position(centre, np).platen == pytest.approx(0.48, abs=1e-15)
    assert abs(walked(family, centre)["platen"][0]) < 1e-15
    for psi in (centre, centre - 1e-12, centre + 1e-9, centre - 1e-6, centre + 1e-5):
        gain, slope = walked(family, psi)["platen"]
        true = solved(mechanism, psi)
        assert abs(gain - true.rate[3]) <= 1e-15
        assert abs(slope - true.slope[3]) <= 1e-12 * abs(true.slope[3])


def test_the_platen_stands_still_too_where_the_bell_crank_turns_back() -> None:
    mechanism = CLAMPS["source"]
    centre = standstill(mechanism, 0.157, 0.18)
    assert build(mechanism).position(centre, np).coupler == pytest.approx(pi / 2, abs=1e-14)
    assert centre == pytest.approx(sqrt(0.16763**2 - (0.14 - 0.095) ** 2), abs=1e-15)


def test_digits_stay_at_full_stretch_of_a_straight_clamp_and_a_rod_alike() -> None:
    mechanism = clamp(0.14, 0.12, 0.12, 0.2, 0.2, 0.0, (0.0, 0.19))
    family = build(mechanism)
    for psi in (0.05, 0.13, 0.19):
        true, gains = solved(mechanism, psi), walked(family, psi)
        assert gains["platen"][0] == pytest.approx(float(true.rate[3]), rel=1e-13)


@clamps
def test_each_assembly_keeps_its_sides_and_bounds_hold_over_whole_cells(mechanism: Mechanism) -> None:
    family, (start, end) = build(mechanism), sorted(mechanism.stroke)
    psi = np.linspace(*mechanism.stroke, 400)
    position = family.position(psi, np)
    block = -psi + 1j * mechanism.geometry["frame.height"]
    pin = mechanism.geometry["bell_crank.drive_length"] * np.exp(1j * position.bell_crank)
    left = (block.conjugate() * pin).imag
    assert np.all(left < 0 if mechanism.assembly.startswith("crossed") else left > 0)
    ahead = np.cos(position.rod)
    assert np.all(ahead < 0 if mechanism.assembly.endswith("behind") else ahead > 0)
    for name in PORTS:
        assert np.max(np.abs(np.diff(family.ports[name].position(position)))) < 0.2
    assert all(start < psi < end for psi in family.breakpoints)
    edges = np.unique([*np.linspace(start, end, 81), *family.breakpoints])
    lo, hi = edges[:-1], edges[1:]
    bounded = family.position(Interval(lo, hi), NAMESPACE)
    sampled = family.position(lo + np.linspace(0.0, 1.0, 9)[:, None] * (hi - lo), np)
    for port in family.ports.values():
        bounds, values = port.position(bounded), port.position(sampled)
        assert np.all((bounds.lo <= values + 1e-12) & (values - 1e-12 <= bounds.hi))
        assert np.all(bounds.hi - bounds.lo < 7.0)


@pytest.mark.parametrize(
    "mechanism",
    [
        CLAMPS["short rod"],
        clamp(stroke=(-0.222, 0.2222)),
        clamp(0.1, 0.3, 0.2001, 0.22, 0.26, 0.5, (-0.2, 0.2)),
        clamp(rod=0.2201, angle=-1.0),
    ],
)
def test_cells_follow_the_motion(mechanism: Mechanism) -> None:
    """A polynomial of order 16 on the worst cell, by the ends of the stroke, the breakpoints, and a few more."""
    family, (start, end) = build(mechanism), sorted(mechanism.stroke)
    edges = np.unique([*np.linspace(start, end, 5), *family.breakpoints])
    nodes, probes = np.cos(pi * (np.arange(17) + 0.5) / 17), np.linspace(-1.0, 1.0, 40)
    for low, high in pairwise(edges):
        sampled, request = (walked(family, 0.5 * (low + high + (high - low) * at)) for at in (nodes, probes))
        for name in PORTS:
            fit = np.polynomial.chebyshev.chebfit(nodes, sampled[name][0], 16)
            gap = np.polynomial.chebyshev.chebval(probes, fit) - request[name][0]
            assert np.max(np.abs(gap)) <= 1e-7 * np.max(np.abs(request[name][0])), (name, low, high)


def test_cells_shorten_where_the_rod_nearly_stands_across() -> None:
    family = build(clamp(rod=0.2201, angle=-1.0))
    upright = [psi for psi in family.breakpoints if abs(abs(family.position(psi, np).clamp_sin) - 1) < 1e-12]
    assert len(upright) == 1
    shortest = acosh(0.2201 / 0.22) / abs(walked(family, upright[0])["bell_crank"][0])
    gaps = sorted(abs(psi - upright[0]) for psi in family.breakpoints)
    assert gaps[1:3] == pytest.approx([shortest, shortest], rel=1e-9)


def test_symbols_pass_through() -> None:
    family, psi = build(CLAMPS["source"]), sympy.Symbol("psi", real=True)
    position = family.position(psi, sympy)
    for name, rate in (("bell_crank", position.bell_crank_rate), ("rod", position.rod_turn)):
        difference = sympy.diff(family.ports[name].position(position), psi) - rate
        assert abs(difference.subs(psi, 0.07).evalf()) < 1e-12


# --- locks ----------------------------------------------------------------------------------------------------------


def fault(**lengths: Any) -> Fault:
    with pytest.raises(SceneError) as refused:
        build(clamp(**lengths))
    (only,) = refused.value.faults
    return only


def test_a_block_out_of_reach_is_refused_with_its_displacement() -> None:
    reach = sqrt((0.16763 + 0.095) ** 2 - 0.14**2)
    result = fault(stroke=(-0.06, 0.23))
    assert result.path == "mechanism.coupler.length"
    assert result.defect == "0.095 m"
    assert result.advice == f"the clamp locks where its block is at {reach:.6g} m"
    least, most = (float(word) for word in result.expected.split() if word[0].isdigit())
    assert least == pytest.approx(hypot(0.14, 0.23) - 0.16763, abs=1e-9)
    assert most == pytest.approx(0.16763 + 0.14, abs=1e-9)
    build(clamp(coupler=least + 1e-6, stroke=(-0.06, 0.23)))
    build(clamp(coupler=most - 1e-6, stroke=(-0.06, 0.23)))
    assert f"{-reach:.6g} and {reach:.6g} m" in fault(stroke=(-0.3, 0.3)).advice


def test_a_stroke_that_ends_where_the_clamp_stretches_is_refused() -> None:
    lengths = {"height": 0.3, "drive": 0.3, "coupler": 0.2}
    assert "locks where its block is at 0.4 m" in fault(stroke=(0.1, 0.4), **lengths).advice
    build(clamp(stroke=(0.1, 0.4 - 1e-6), **lengths))


def test_arms_that_fold_within_the_stroke_are_refused() -> None:
    fold = sqrt(0.15**2 - 0.1**2)
    result = fault(height=0.1, drive=0.3, coupler=0.15, stroke=(-0.2, 0.2))
    assert result.path == "mechanism.coupler.length"
    assert result.expected == "between 0.2 and 0.4 m"
    build(clamp(height=0.1, drive=0.3, coupler=0.2 + 1e-6, stroke=(-0.2, 0.2)))
    assert f"{-fold:.6g} and {fold:.6g} m" in result.advice
    assert "at 0 m" in fault(height=0.1, drive=0.25, coupler=0.15, stroke=(-0.2, 0.2)).advice.replace("-0", "0")
    assert "closes nowhere" in fault(height=0.1, drive=0.3, coupler=0.15, stroke=(-0.05, 0.05)).advice


def test_a_drive_arm_too_short_for_the_stroke_is_refused() -> None:
    result = fault(height=0.1, drive=0.03, coupler=0.12, stroke=(0.0, 0.2))
    assert result.path == "mechanism.bell_crank.drive_length"
    assert float(result.expected.split()[2]) == pytest.approx((hypot(0.1, 0.2) - 0.1) / 2)


def test_a_rod_that_stands_across_is_refused_with_the_displacement() -> None:
    result = fault(rod=0.1, angle=0.4, stroke=(-0.06, 0.19))
    assert result.path == "mechanism.rod.length"
    assert "longer than bell_crank.clamp_length = 0.22 m" in result.expected
    (place,) = (float(word) for word in result.advice.split() if word[0] in "-0123456789")
    family = build(clamp(angle=0.4))
    assert abs(family.position(place, np).height) == pytest.approx(0.1, rel=1e-5)
    build(clamp(rod=0.1, angle=0.4, stroke=(place + 1e-5, 0.19)))
    assert "closes nowhere" in fault(rod=0.1, angle=0.4, stroke=(-0.06, place - 1e-5)).advice


def test_without_a_stroke_it_is_refused() -> None:
    assert fault(stroke=None)[:4] == (
        "mechanism.type",
        "a toggle-clamp without a stroke",
        "the stroke of its block",
        "its block goes one way: add [stroke] with from, to and speed",
    )


LENGTH = st.integers(1, 12).map(lambda n: n / 4)
PLACE = st.integers(-12, 12).map(lambda n: n / 4)


@given(st.tuples(LENGTH, LENGTH, LENGTH, LENGTH, LENGTH), st.integers(-6, 6), st.tuples(PLACE, PLACE), st.booleans())
@settings(derandomize=True, max_examples=40, deadline=None)
def test_a_clamp_is_refused_exactly_when_a_loop_flattens(
    lengths: tuple[float, ...], eighths: int, stroke: tuple[float, float], crossed: bool
) -> None:
    assume(stroke[0] < stroke[1])
    mechanism = clamp(*lengths, eighths * pi / 8 + 0.1, stroke, "crossed" if crossed else "open")
    flat, upright = slack(mechanism, np.linspace(*stroke, 1001))
    assume(abs(flat) > 1e-6 or flat in (0.0, -inf))
    assume(abs(upright) > 1e-6)
    if flat <= 0 or upright < 0:
        with pytest.raises(SceneError):
            build(mechanism)
    else:
        position = build(mechanism).position(np.linspace(*stroke, 50), np)
        assert np.all(np.isfinite(position.platen))


def slack(mechanism: Mechanism, psi: np.ndarray) -> tuple[float, float]:
    """Least distance of the arms from one line, and of the rod from standing across: by the cosine rule."""
    a1, a2, a3, a5, a6 = (mechanism.geometry[name] for name in CLAMP)
    reach = np.hypot(a1, psi)
    reach = np.append(reach, a1) if psi[0] < 0 < psi[-1] else reach
    flat = float(min((a2 + a3 - reach).min(), (reach - abs(a2 - a3)).min()))
    if flat <= 1e-9:
        return min(flat, 0.0), inf
    reach = np.hypot(a1, psi)
    corner = np.arccos((reach**2 + a2**2 - a3**2) / (2 * reach * a2))
    theta2 = np.arctan2(a1, -psi) + (-corner if mechanism.assembly == "crossed" else corner)
    return flat, a6 - a5 * float(np.abs(np.sin(theta2 + mechanism.geometry["bell_crank.angle"])).max())


# Mechanisms that cannot turn are refused with the angles where they lock; near a lock cells are short.


def lock_fault(kind: str, **lengths: float) -> Fault:
    geometry = {("slider.offset" if key == "offset" else f"{key}.length"): value for key, value in lengths.items()}
    with pytest.raises(SceneError) as refused:
        build(Mechanism(kind, "m", geometry=geometry))
    (only,) = refused.value.faults
    return only


def test_a_rod_shorter_than_the_crank_locks_four_times() -> None:
    result = lock_fault("slider-crank", crank=0.5, rod=0.25)
    assert result.path == "mechanism.rod.length"
    assert result.defect == "0.25 m"
    assert result.expected == "a rod longer than crank + |offset| = 0.5 m"
    assert result.advice == "the crank locks at 30, 150, 210 and 330 deg"


@pytest.mark.parametrize(
    ("offset", "rod", "where"),
    [
        (0.0, 0.5, "90 and 270 deg"),
        (0.1, 0.6, "270 deg"),
        (-0.1, 0.6, "90 deg"),
        (0.25, 0.5, "210 and 330 deg"),
        (2.0, 0.5, "at no crank angle"),
    ],
)
def test_an_offset_locks_on_its_far_side(offset: float, rod: float, where: str) -> None:
    assert lock_fault("slider-crank", crank=0.5, rod=rod, offset=offset).advice.endswith(where)


def test_lengths_equal_but_for_rounding_lock() -> None:
    assert 0.1 + 0.2 != 0.3
    assert "locks at 270" in lock_fault("slider-crank", crank=0.1, offset=0.2, rod=0.1 + 0.2).advice
    assert lock_fault("crank-shaper", crank=0.1 + 0.2, frame=0.3, rocker=1.0).path == "mechanism.frame.length"


def test_a_shaper_with_crank_as_long_as_its_frame_locks_at_180() -> None:
    result = lock_fault("crank-shaper", crank=0.3, frame=0.3, rocker=1.0)
    assert result[:4] == (
        "mechanism.frame.length",
        "0.3 m",
        "a length other than crank.length = 0.3 m",
        "the crank locks at 180 deg",
    )


@pytest.mark.parametrize(
    ("lengths", "path", "where"),
    [
        ((4.0, 2.0, 2.0, 3.0), "coupler", "locks at 108.21 and 251.79"),  # cos = (20 - 25)/16
        ((4.0, 1.0, 2.0, 3.0), "coupler", "locks at 180"),  # change point
        ((4.0, 2.0, 4.0, 2.0), "rocker", "locks at 0 and 180"),  # parallelogram
        ((3.0, 3.0, 2.0, 2.5), "crank", "locks"),
        ((4.0, 2.0, 9.0, 1.0), "rocker", "closes at no crank angle"),
        ((4.0, 2.0, 9.0, 3.0), "coupler", "locks at 180"),
    ],
)
def test_a_four_bar_names_the_bar_to_change(lengths: tuple[float, ...], path: str, where: str) -> None:
    result = lock_fault("four-bar", **dict(zip(("ground", "crank", "coupler", "rocker"), lengths, strict=True)))
    assert result.path == f"mechanism.{path}.length"
    assert where in result.advice


LOCK_LENGTH = st.integers(1, 24).map(lambda n: n / 4)


@given(LOCK_LENGTH, LOCK_LENGTH, LOCK_LENGTH, LOCK_LENGTH)
@settings(derandomize=True, max_examples=15, deadline=None)
def test_a_four_bar_is_refused_exactly_when_its_triangle_flattens(d: float, r: float, c: float, rocker: float) -> None:
    diagonal = np.abs(r * np.exp(1j * np.linspace(0.0, pi, 181)) - d)  # lengths in quarters: flat only at the ends
    slack = np.minimum(c + rocker - diagonal, diagonal - abs(c - rocker))
    bars = zip(("ground", "crank", "coupler", "rocker"), (d, r, c, rocker), strict=True)
    mechanism = Mechanism("four-bar", "m", geometry={f"{bar}.length": length for bar, length in bars})
    if slack.min() < 1e-9:
        with pytest.raises(SceneError):
            build(mechanism)
    else:
        position = build(mechanism).position(np.linspace(0.0, 7.0, 50), np)
        pin = r * np.exp(1j * position.psi)
        assert pin + c * np.exp(1j * position.coupler) == pytest.approx(d + rocker * np.exp(1j * position.rocker))


@given(LOCK_LENGTH, LOCK_LENGTH, LOCK_LENGTH, LOCK_LENGTH)
@settings(derandomize=True, max_examples=40, deadline=None)
def test_the_coupler_asked_for_turns(d: float, r: float, c: float, rocker: float) -> None:
    geometry = {"ground.length": d, "crank.length": r, "coupler.length": c, "rocker.length": rocker}
    try:
        build(Mechanism("four-bar", "m", geometry=geometry))
    except SceneError as refused:
        (only,) = refused.faults
        if only.path == "mechanism.coupler.length":
            words = only.expected.split()
            geometry["coupler.length"] = (float(words[1]) + float(words[3])) / 2
            build(Mechanism("four-bar", "m", geometry=geometry))


@pytest.mark.parametrize("distance", [0.4, 0.1, 1e-3, 1e-6])
def test_graded_cells_follow_a_pole_to_1e_8(distance: float) -> None:
    edges = np.array([-1.0, *graded(0.0, distance, reach=1.0), 1.0])
    nodes = np.cos((2 * np.arange(17) + 1) * pi / 34)
    for a, b in pairwise(edges):
        half, middle = (b - a) / 2, (a + b) / 2
        fitted = np.polynomial.chebyshev.chebfit(nodes, distance / (middle + half * nodes - 1j * distance), 16)
        probe = np.linspace(-1.0, 1.0, 101)
        error = np.polynomial.chebyshev.chebval(probe, fitted) - distance / (middle + half * probe - 1j * distance)
        assert np.max(np.abs(error)) < 1e-8


def test_far_singularities_need_no_breakpoint() -> None:
    assert graded(0.0, 0.7) == []
    assert build(Mechanism("slider-crank", "m", geometry={"crank.length": 0.25, "rod.length": 1.0})).breakpoints == ()


@pytest.mark.parametrize(
    ("kind", "geometry", "centres"),
    [
        ("slider-crank", {"crank.length": 0.95, "rod.length": 1.0}, [pi / 2, 3 * pi / 2]),
        ("slider-crank", {"crank.length": 0.5, "rod.length": 1.0, "slider.offset": 0.49}, [3 * pi / 2]),
        ("slider-crank", {"crank.length": 0.5, "rod.length": 1.0, "slider.offset": -0.49}, [pi / 2]),
        ("crank-shaper", {"crank.length": 0.5, "frame.length": 0.51, "rocker.length": 1.0}, [pi]),
        (
            "four-bar",
            {"ground.length": 4.0, "crank.length": 1.0, "coupler.length": 2.01, "rocker.length": 3.0},
            [pi],
        ),
        (
            "four-bar",
            {"ground.length": 4.0, "crank.length": 1.0, "coupler.length": 5.99, "rocker.length": 3.0},
            [0.0],
        ),
    ],
)
def test_breakpoints_stand_about_the_near_lock(kind: str, geometry: dict[str, float], centres: list[float]) -> None:
    result = np.array(build(Mechanism(kind, "m", geometry=geometry)).breakpoints)
    assert np.all((result >= 0.0) & (result < tau) & (np.diff(result, append=7.0) > 0.0))
    assert {c for c in (0.0, pi / 2, pi, 3 * pi / 2) if np.any(np.isclose(result, c))} == set(centres)
    assert all(min(abs((angle - c + pi) % tau - pi) for c in centres) < 1.0 for angle in result)


def test_a_hair_below_zero_stays_within_the_turn() -> None:
    assert within_turn([-1e-20]) == (0.0,)
