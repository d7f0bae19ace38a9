"""Mechanisms: chains and linkages, laws, ends of a stroke, a family of one's own."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from math import pi, tau
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy
from mpmath import mp
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize_scalar

import flywheel
from bondgraph.recording import Recorder
from flywheel import Scene, SceneError, reference
from flywheel.mechanisms import KINDS, register
from flywheel.mechanisms.families import Family, build, ends_of
from flywheel.mechanisms.linkage import linkage_of
from flywheel.mechanisms.linkages.positions import solve
from flywheel.numerics.expressions import Expression, parse
from flywheel.numerics.intervals import NAMESPACE, Interval
from flywheel.reading.scenes import build_scene
from flywheel.scene.linkage import Lift, Linkage
from flywheel.scene.scene import Body, Mechanism, Output, PointPort, Table
from tests.limits import sample
from tests.linkages.linkages import CASES, SINE, cam_rocker, geared_five_bar, six_bar, slider_crank
from tests.mechanisms import swinging_cylinder
from tests.mechanisms.chains import STRAIGHT, exactly, four_bar, places, shaper, slider, walked, yoke

# Every family's chain against positions that are derived and differentiated without it, at 30 digits.


CHAINS = {
    "yoke up": yoke(pi / 2),
    "slider": slider(0.1, 0.3),
    "slider, straight rod": slider(0.1, 0.3, 0.02, STRAIGHT),
    "slider, rod's mass at the pin": slider(0.1, 0.3, -0.1, Body(3.0, 0.2)),
    "slider, offset up, near lock": slider(0.5, 1.0, 0.499999),
    "slider, offset down, near lock": slider(0.9, 1.0, -0.0999),
    "crank-rocker": four_bar(4.0, 1.0, 3.0, 3.5),
    "crank-rocker, crossed": four_bar(4.0, 1.0, 3.0, 3.5, "crossed"),
    "crank-rocker near 180": four_bar(4.0, 1.0, 2.000001, 3.0),
    "crank-rocker near 0, crossed": four_bar(4.0, 1.0, 5.999999, 3.0, "crossed"),
    "drag-link": four_bar(1.0, 2.0, 2.5, 2.2),
    "drag-link, crossed": four_bar(1.0, 2.0, 2.5, 2.2, "crossed"),
    "drag-link near 0": four_bar(1.0, 2.0, 1.000001, 2.0),
    "shaper": shaper(0.1, 0.4),
    "whitworth": shaper(0.4, 0.1),
    "shaper near lock": shaper(0.4, 0.400001),
    "whitworth near lock": shaper(0.400001, 0.4),
}
chains = pytest.mark.parametrize("mechanism", CHAINS.values(), ids=CHAINS.keys())
CLEAR = {name: mechanism for name, mechanism in CHAINS.items() if "near" not in name}
clear = pytest.mark.parametrize("mechanism", CLEAR.values(), ids=CLEAR.keys())

# a yoke, and of the others the hard ones: close to a lock, or on both sides of a dead centre
HARD = [
    name for name in CHAINS if "near" in name or name in ("yoke up", "slider, straight rod", "drag-link, crossed", "shaper")
]


@pytest.fixture(autouse=True)
def _thirty_digits() -> Any:
    with mp.workdps(40):
        yield


def hard_angles(breakpoints: tuple[float, ...]) -> np.ndarray:
    """Dead centres, locks and breakpoints, on them and beside them, and angles of several turns."""
    centres = np.array([0.0, pi / 2, pi, -pi / 2, *breakpoints])
    beside = [centres + step for step in (0.0, 1e-12, -1e-7)]
    return np.concatenate([*beside, np.linspace(-9.0, 11.0, 7)])


def component(exact: dict[str, Any], name: str) -> Any:
    """Displacement along a velocity: a coordinate, or an angle; None for a tangential speed."""
    place, _, axis = name.rpartition(".")
    place = "rocker_pin" if place == "rocker.pin" else place
    if axis in ("x", "y"):
        return None if place not in exact else (exact[place].real if axis == "x" else exact[place].imag)
    return exact.get(name) if name != "crank.pin" and not name.endswith(".com") else None


@pytest.mark.parametrize("mechanism", sample([pytest.param(m, id=name) for name, m in CLEAR.items()], 2))
def test_motion_energy_and_weight_are_those_of_the_bodies(mechanism: Mechanism) -> None:
    mechanism = exactly(mechanism)
    family, pull = build(mechanism), mp.mpc(0.6, -9.7)
    rides = {"scotch-yoke": {"block": "crank"}, "crank-shaper": {"block": "rocker"}}.get(mechanism.type, {})
    turns_with = {body: body for body in ("crank", "rod", "coupler", "rocker")} | rides
    along = {"yoke": mp.expj(mechanism.geometry.get("yoke.direction", 0)), "ram": 1j}
    for psi in map(mp.mpf, (0.3, 3.1417)):
        gains = walked(family, psi, mp)
        for name, (gain, slope) in gains.items():
            if component(places(mechanism, psi), name) is None:
                continue
            expected = mp.taylor(lambda at, name=name: component(places(mechanism, at), name), psi, 2)
            assert abs(gain - expected[1]) <= 1e-18 * (1 + abs(expected[1])), name
            assert abs(slope - 2 * expected[2]) <= 1e-14 * (1 + abs(expected[2])), name
        energy = mp.mpf(0)
        for name, body in mechanism.bodies.items():
            spot = f"{name}.com" if f"{name}.com" in places(mechanism, psi) else name
            speed = mp.diff(lambda at, spot=spot: places(mechanism, at)[spot], psi)
            spin = mp.diff(lambda at, name=name: places(mechanism, at).get(turns_with.get(name, ""), 0), psi)
            energy += body.mass * abs(speed) ** 2 + body.inertia * spin**2
            velocity = speed if isinstance(places(mechanism, psi)[spot], mp.mpc) else speed * along.get(name, 1)
            own = [weight for weight in family.weights if weight.body == name]
            result = sum(w.mass * (mp.conj(pull) * mp.expj(w.direction)).real * gains[w.velocity][0] for w in own)
            assert abs(result - body.mass * (mp.conj(pull) * velocity).real) <= 1e-14 * body.mass
        assert abs(sum(mass.value * gains[mass.velocity][0] ** 2 for mass in family.masses) - energy) <= 1e-18 * energy


@pytest.mark.parametrize("mechanism", [pytest.param(CHAINS[name], id=name) for name in HARD])
def test_floats_keep_their_digits(mechanism: Mechanism) -> None:
    family = build(mechanism)
    angles = hard_angles(family.breakpoints[:: max(len(family.breakpoints) // 6, 1)])
    result, true = walked(family, angles), build(exactly(mechanism))
    scale = {v.name: 1.0 if v.rotating else float(mechanism.geometry["crank.length"]) for v in family.velocities}
    for i, psi in enumerate(angles):
        exact = walked(true, mp.mpf(psi), mp)
        for name, unit in scale.items():
            for k in (0, 1):
                value = np.broadcast_to(result[name][k], angles.shape)[i]
                assert abs(value - exact[name][k]) <= 1e-12 * max(abs(exact[name][k]), unit), (name, k, psi)


@chains
def test_ports_are_continuous_and_return_as_they_say_and_bounds_hold_over_whole_cells(mechanism: Mechanism) -> None:
    family = build(mechanism)
    psi = np.unique(np.concatenate([np.linspace(-tau, 2 * tau, 4001), hard_angles(family.breakpoints)]))
    steepest = {name: np.max(np.abs(gain)) for name, (gain, _) in walked(family, psi).items()}
    position, start = family.position(psi, np), family.position(np.array([0.0, tau]), np)
    edges = np.unique([*np.linspace(0.0, tau, 41), *family.breakpoints])
    lo, hi = edges[:-1], edges[1:]
    cells, sampled = family.position(Interval(lo, hi), NAMESPACE), lo + np.linspace(0.0, 1.0, 9)[:, None] * (hi - lo)
    for port in family.ports.values():
        path, (first, last) = port.position(position), port.position(start)
        assert np.all(np.abs(np.diff(path)) <= 1.5 * steepest[port.velocity] * np.diff(psi) + 1e-9)
        assert -pi < first <= pi
        assert last - first == pytest.approx(0.0 if port.returns else tau, abs=1e-12)
        bounds, values = port.position(cells), port.position(family.position(sampled, np))
        assert np.all((bounds.lo <= values + 1e-12) & (values - 1e-12 <= bounds.hi))
        assert np.all(bounds.hi - bounds.lo < 7.0)


@pytest.mark.parametrize("name", ["yoke up", "slider, straight rod", "crank-rocker, crossed", "shaper"])
def test_symbols_pass_through(name: str) -> None:
    family, psi = build(CHAINS[name]), sympy.Symbol("psi", real=True)
    for port in family.ports.values():
        if port.velocity == "ram":
            continue  # its ratio is the rocker's, not the crank's
        position = family.position(psi, sympy)
        gain = getattr(position, f"{port.velocity}_rate")
        difference = sympy.diff(port.position(position), psi) - gain
        assert abs(difference.subs(psi, 0.8).evalf()) < 1e-12


def test_bodies_without_mass_leave_no_trace() -> None:
    family = build(Mechanism("slider-crank", "m", geometry={"crank.length": 0.1, "rod.length": 0.3}))
    assert family.masses == family.weights == ()
    names = [v.name for v in family.velocities if v.name.startswith("crank")]
    assert names == ["crank.pin", "crank.pin.x", "crank.pin.y"]


def test_an_unknown_type_is_refused_with_its_place() -> None:
    with pytest.raises(ValueError, match=r"mechanism\[2\].type: found 'gearbox'"):
        build(Mechanism("gearbox", "m", path="mechanism[2]"))


# The ends of a port's stroke: in closed form, by search on a fine grid, along a stroke, with kinks.


STARTERS = Path(flywheel.__file__).parent / "starters"


def stroke(mechanism: Mechanism, port: str, parameters: Any = None) -> tuple[float, float]:
    ends = ends_of(mechanism, port, parameters or {})
    return ends.low, ends.high


def test_the_ends_of_a_port_are_those_of_its_lengths_and_not_of_masses() -> None:
    light = crank("slider-crank", crank_length=0.1, rod_length=0.4)
    heavy = replace(light, bodies={"slider": Body(mass=7.0)})
    longer = replace(light, geometry={**light.geometry, "crank.length": 0.15})
    assert ends_of(heavy, "slider") is ends_of(light, "slider")
    assert stroke(longer, "slider") == pytest.approx((0.25, 0.55))


def crank(kind: str, **lengths: float) -> Mechanism:
    geometry = {"slider.offset": 0.0, "yoke.direction": 0.0}
    geometry |= {name.replace("_", "."): value for name, value in lengths.items()}
    return Mechanism(kind, "m", geometry=geometry)


def searched(mechanism: Mechanism, port: str, sign: int, span: float, first: float = 0.0) -> float:
    """Greatest (sign 1) or least displacement by a grid, then by Brent's method."""
    family = build(mechanism)

    def goal(psi: Any) -> Any:
        return -sign * family.ports[port].position(family.position(psi, np))

    grid = first + np.linspace(0.0, span, 4001)
    best = grid[np.argmin(goal(grid))]
    step = span / 2000
    result = minimize_scalar(
        goal, bounds=(max(best - step, first), min(best + step, first + span)), options={"xatol": 1e-12}
    )
    return -sign * min(float(result.fun), float(goal(best)))


def test_ends_of_an_offset_slider_crank_in_closed_form():
    r, rod, e = 0.1, 0.4, 0.05
    low, high = stroke(crank("slider-crank", crank_length=r, rod_length=rod, slider_offset=e), "slider")
    assert high == pytest.approx(np.sqrt((rod + r) ** 2 - e**2), rel=1e-15)
    assert low == pytest.approx(np.sqrt((rod - r) ** 2 - e**2), rel=1e-15)


@pytest.mark.parametrize(
    ("mechanism", "port"),
    [
        (crank("scotch-yoke", crank_length=0.1, yoke_direction=0.3), "yoke"),
        (crank("slider-crank", crank_length=0.1, rod_length=0.4, slider_offset=-0.07), "rod"),
        (crank("four-bar", ground_length=4.0, crank_length=1.0, coupler_length=2.01, rocker_length=3.0), "rocker"),
        (crank("four-bar", ground_length=4.0, crank_length=1.0, coupler_length=2.5, rocker_length=3.0), "coupler"),
        (crank("crank-shaper", crank_length=0.1, frame_length=0.3, rocker_length=0.6), "ram"),
        (crank("crank-shaper", crank_length=0.1, frame_length=0.101, rocker_length=0.6), "rocker"),
    ],
    ids=lambda item: getattr(item, "type", item),
)
def test_ends_as_a_search_finds_them(mechanism, port):
    result = stroke(mechanism, port)
    expected = [searched(mechanism, port, sign, 2 * np.pi) for sign in (-1, 1)]
    assert result == pytest.approx(expected, rel=1e-13, abs=1e-13)
    assert result[0] <= expected[0] + 1e-15
    assert result[1] >= expected[1] - 1e-15


@pytest.mark.parametrize("port", ["platen", "bell_crank", "coupler"])
def test_ends_along_a_stroke(port):
    scene = build_scene(tomllib.loads((STARTERS / "toggle-clamp.toml").read_text(encoding="utf-8")))
    mechanism = scene.mechanisms[0]
    first, last = mechanism.stroke
    result = stroke(mechanism, port)
    expected = [searched(mechanism, port, sign, last - first, first) for sign in (-1, 1)]
    assert result == pytest.approx(expected, rel=1e-12)
    assert ends_of(mechanism, port).before(True, 10.0) is None


def law(x: str) -> Mechanism:
    scene = {"mechanism": {"type": "law", "outputs": {"ram": {"x": x}}}, "regime": {"speed": 1}, "flywheel": {"inertia": 1}}
    return build_scene(scene | {"parameters": {"s": 0.2}}).mechanisms[0]


@pytest.mark.parametrize(
    ("x", "wanted"),
    [
        ("s*(phi/2 if phi < 2 else (2*pi - phi)/(2*pi - 2))", (0.0, 0.2)),
        ("0.3*max(sin(phi), 0)", (0.0, 0.3)),
        ("s*sin(phi) + 0.05*cos(3*phi)", None),
        ("s*abs(sin(phi))", (0.0, 0.2)),
    ],
)
def test_ends_of_laws(x, wanted):
    mechanism = law(x)
    result = stroke(mechanism, "ram", {"s": 0.2})
    phi = np.linspace(0, 2 * np.pi, 200_001)
    if wanted is None:
        values = 0.2 * np.sin(phi) + 0.05 * np.cos(3 * phi)
        wanted = values.min(), values.max()
    assert result == pytest.approx(wanted, abs=1e-9)


def linkage() -> dict[str, Any]:
    return tomllib.loads((STARTERS / "linkage.toml").read_text(encoding="utf-8"))


def test_ends_of_a_linkage_as_a_search_finds_them():
    mechanism = build_scene(linkage()).mechanisms[0]
    family = build(mechanism)
    for port, made in family.ports.items():
        if not made.returns:
            continue
        expected = [searched(mechanism, port, sign, mechanism.travel) for sign in (-1, 1)]
        assert stroke(mechanism, port) == pytest.approx(expected, rel=1e-12, abs=1e-13)


def test_the_way_before_an_end():
    r, rod, angle = 0.1, 0.4, 0.7
    ends = ends_of(crank("slider-crank", crank_length=r, rod_length=rod), "slider")
    x = r * np.cos(angle) + np.sqrt(rod**2 - (r * np.sin(angle)) ** 2)
    assert ends.before(True, angle) == pytest.approx(r + rod - x, rel=1e-13)
    back = -r * np.cos(angle) + np.sqrt(rod**2 - (r * np.sin(angle)) ** 2)
    assert ends.before(False, angle) == pytest.approx(back - (rod - r), rel=1e-13)
    assert ends.before(True, np.pi) == pytest.approx(2 * r, rel=1e-13)
    assert ends.before(True, np.pi + 0.01) is None
    assert ends.before(True, 40.0) is None


def test_a_mechanism_that_locks_is_refused():
    with pytest.raises(SceneError, match="rod"):
        stroke(crank("slider-crank", crank_length=0.4, rod_length=0.1), "slider")


# Laws: derivatives of what is written, turns and pieces kept apart, and everything refused that cannot move a mass.


def law_mechanism(
    text: str | Table, rotating: bool = False, inertia: float = 2.0, period: float = tau, **parameters: float
) -> Family:
    followed: Expression | Table = parse(text, frozenset(parameters)) if isinstance(text, str) else text
    outputs = (Output("arm", rotating, followed, inertia),)
    return build(Mechanism("law", "m", outputs=outputs, period=period), parameters)


def displacement(family: Family, psi: Any, anchor: Any = None) -> Any:
    return family.ports["arm"].position(family.position(psi, np, anchor))


SMOOTH = [
    ("0.1*cos(phi)", lambda p: 0.1 * mp.cos(p), {}),
    ("R*(1 - cos(phi)) + R**2/L*cos(2*phi)", lambda p: 1 - mp.cos(p) + mp.cos(2 * p) / 4, {"R": 1.0, "L": 4.0}),
    ("exp(sin(phi)**3)", lambda p: mp.exp(mp.sin(p) ** 3), {}),
    ("atan2(sin(phi), 2 + cos(phi))", lambda p: mp.atan2(mp.sin(p), 2 + mp.cos(p)), {}),
    ("sqrt(4 - sin(phi)**2) + cos(phi)", lambda p: mp.sqrt(4 - mp.sin(p) ** 2) + mp.cos(p), {}),
    ("max(0, sin(phi))**3", lambda p: max(mp.mpf(0), mp.sin(p)) ** 3, {}),
]


@pytest.mark.parametrize(("text", "truth", "parameters"), SMOOTH, ids=[text for text, _, _ in SMOOTH])
def test_gain_and_slope_are_derivatives(text: str, truth: Any, parameters: dict[str, float]) -> None:
    family = law_mechanism(text, **parameters)
    psi = np.linspace(-7.0, 14.0, 43)
    gain, slope = walked(family, psi)["arm"]
    with mp.workdps(40):
        for i, angle in enumerate(psi):
            value, first, second = mp.taylor(truth, mp.mpf(angle), 2)
            assert displacement(family, psi)[i] == pytest.approx(float(value), abs=1e-13)
            assert gain[i] == pytest.approx(float(first), abs=1e-13)
            assert slope[i] == pytest.approx(float(2 * second), abs=1e-12)


def test_masses_sit_straight_on_the_crank() -> None:
    family = law_mechanism("cos(phi)")
    assert [(m.velocity, m.value, m.body) for m in family.masses] == [("arm", 2.0, "arm")]
    assert family.weights == ()
    assert law_mechanism("cos(phi)", inertia=0.0).masses == ()
    assert [term.source for term in family.velocities[0].terms] == ["crank"]


def test_a_theta_gains_the_same_each_period() -> None:
    family = law_mechanism("2*phi + 0.1*sin(phi)", rotating=True)
    assert not family.ports["arm"].returns
    psi = np.linspace(-20.0, 20.0, 81)
    assert displacement(family, psi) == pytest.approx(2 * psi + 0.1 * np.sin(psi), abs=1e-12)
    assert walked(family, psi)["arm"][0] == pytest.approx(2 + 0.1 * np.cos(psi), abs=1e-13)


def test_an_oscillating_theta_returns() -> None:
    assert law_mechanism("0.3*sin(phi)", rotating=True).ports["arm"].returns


def test_a_piece_is_followed_to_its_ends_by_its_own_formula() -> None:
    family = law_mechanism("abs(sin(phi))", inertia=0.0)
    assert family.ports["arm"].kinks == (0.0, pi)
    ends = np.array([[0.0, pi], [pi, tau], [tau, 3 * pi]])
    anchor = ends.mean(axis=1, keepdims=True)
    jet = family.position(ends, np, anchor).jet("arm")
    assert jet.first == pytest.approx(np.array([[1.0, -1.0]] * 3), abs=1e-14)


def test_the_period_may_be_two_turns() -> None:
    family = law_mechanism("0.01*max(0, sin(phi/2))**4", period=2 * tau)
    assert displacement(family, np.array([pi, 3 * pi, 5 * pi])) == pytest.approx([0.01, 0.0, 0.01])
    assert max(family.breakpoints) < 2 * tau


def test_a_narrow_bump_ends_cells_around_itself() -> None:
    breaks = np.array(law_mechanism("exp(-((phi - 2)/1e-4)**2)").breakpoints)
    assert np.sum(np.abs(breaks - 2) < 3e-4) >= 4


@pytest.mark.parametrize(
    ("text", "rotating", "found"),
    [
        ("phi", False, r"outputs.arm.x: found 0 m at 0 deg and 6.28318531 m at 360 deg"),
        ("sign(sin(phi))", False, r"arm.x: found a jump of -2 m at 180 deg"),
        ("phi + (phi > 3)", True, r"arm.theta: found a jump of 1 rad at 171.887 deg"),
        ("abs(sin(phi))", False, r"found a slope that jumps from -1 to 1 at 0 deg, expected a smooth .* carries mass"),
        ("phi**2", True, r"found a slope that jumps from 12.5664 to 0 at 0 deg"),
        ("max(0, sin(phi))", False, r"a slope that jumps from -1 to 0 at 180 deg|from 0 to 1 at 0 deg"),
        ("1/(phi - 3)", False, r"not finite near phi = 3"),
        ("sqrt(sin(phi))", False, r"found a position that is not finite"),
        ("(phi - pi)**2*phi**0.5", True, r"found a slope that is not finite at 0 deg"),
        ("cos(phi) + x", False, r"found an expression of x, expected phi and parameters"),
        ("omega*t*v", False, r"found an expression of omega, t, v"),
    ],
)
def test_what_cannot_move_a_mass_is_refused(text: str, rotating: bool, found: str) -> None:
    with pytest.raises(SceneError, match=found):
        law_mechanism(text, rotating)


def test_a_corner_without_mass_is_allowed_and_known() -> None:
    family = law_mechanism("max(0, sin(phi))", inertia=0.0)
    assert family.ports["arm"].kinks == pytest.approx([0.0, pi])
    assert law_mechanism("max(0, sin(phi))**2").ports["arm"].kinks == ()


def test_rounding_is_no_jump() -> None:
    law_mechanism("1000 + 1e-6*sin(phi)")
    law_mechanism("sin(12*phi + 0.3) + 1e-3*cos(7*phi)")


def test_the_faults_of_all_outputs_come_at_once() -> None:
    texts = {"a": "phi", "b": "cos(phi)", "crank": "sin(phi)", "c": "balance"}
    outputs = tuple(Output(k, False, parse(text, frozenset({"balance"})), 1.0) for k, text in texts.items())
    with pytest.raises(SceneError) as refused:
        build(Mechanism("law", "m", outputs=outputs, path="mechanism[1]"), {})
    paths = [fault.path for fault in refused.value.faults]
    assert paths == [f"mechanism[1].outputs.{end}" for end in ("a.x", "crank", "c.x")]


def table(start: float, gain: float, rows: int = 13) -> Table:
    angle = start + np.linspace(0.0, tau, rows) ** 1.5 / tau**0.5
    value = 0.2 * np.sin(2 * angle + 1) + gain * (angle - start) / tau
    value[-1] = value[0] + gain
    angle[-1] = start + tau
    return Table(angle, value, "spline")


@pytest.mark.parametrize("start", [0.0, -1.0, 0.7, tau])
@pytest.mark.parametrize("gain", [0.0, tau])
def test_a_table_is_the_periodic_spline_from_wherever_it_starts(start: float, gain: float) -> None:
    inputs = table(start, gain)
    flat = inputs.value - gain * (inputs.angle - start) / tau
    flat[-1] = flat[0]
    spline = CubicSpline(inputs.angle, flat, bc_type="periodic")
    family = law_mechanism(inputs, rotating=gain != 0)
    psi = np.linspace(-9.0, 16.0, 401)
    first, second = walked(family, psi)["arm"]
    assert displacement(family, psi) == pytest.approx(spline(psi) + gain * (psi - start) / tau, abs=1e-12)
    assert first == pytest.approx(spline(psi, 1) + gain / tau, abs=1e-12)
    assert second == pytest.approx(spline(psi, 2), abs=1e-11)
    assert family.breakpoints == pytest.approx(np.unique(np.round([0.0, *(inputs.angle[:-1] % tau)], 12)))
    assert family.ports["arm"].returns is (gain == 0)


def test_a_table_that_does_not_come_back_is_refused() -> None:
    with pytest.raises(SceneError, match=r"found 0.168294197 m at 0 deg and 1.1682942 m"):
        law_mechanism(table(0.0, 1.0))


@pytest.mark.parametrize("text", ["exp(sin(phi)) + abs(phi - 3)*0", "0.1*cos(phi)**3", table(0.4, 0.0)], ids=str)
def test_bounds_hold_over_whole_pieces(text: str | Table) -> None:
    family = law_mechanism(text, inertia=0.0)
    edges = np.array([*family.breakpoints, tau]) + tau
    lo, hi = edges[:-1], edges[1:]
    anchor = 0.5 * (lo + hi)
    bounds = family.ports["arm"].position(family.position(Interval(lo, hi), NAMESPACE, anchor))
    inside = lo + np.linspace(0.0, 1.0, 33)[:, None] * (hi - lo)
    values = displacement(family, inside, anchor)
    assert np.all((bounds.lo <= values) & (values <= bounds.hi))
    assert np.all(bounds.width < 10.0)


# Linkages as chains: the same gains as their poses have, the same machines as the named types, turns and strokes.


PSI = np.array([0.2, 1.3, 2.9, 4.4, 6.0])


def heavy(linkage: Linkage) -> Linkage:
    """The linkage with masses, inertias and centres of mass off every line."""
    links = tuple(
        link._replace(mass=1.0 + k, inertia=0.01 * (k + 1), com=(0.03 * k - 0.02, 0.01 + 0.02 * k))
        for k, link in enumerate(linkage.links)
    )
    return replace(linkage, links=links)


def made(linkage: Linkage, **changes: Any) -> Mechanism:
    return Mechanism("linkage", "m", linkage=linkage, **changes)


def block_on_a_rocker() -> Linkage:
    """A shaper whose block is placed along the rocker that it slides on, not by the crank's pin."""
    linkage = linkage_of(shaper(0.1, 0.4))
    return replace(linkage, joints=tuple(sorted(linkage.joints, key=lambda joint: joint.name == "pivot")))


ALL = {name: linkage for name, (linkage, _) in CASES.items()} | {"+": block_on_a_rocker()}


@pytest.mark.parametrize("linkage", sample([pytest.param(linkage, id=name) for name, linkage in ALL.items()], 2))
def test_gains_inertia_and_ports_are_those_of_the_poses(linkage: Linkage) -> None:
    linkage = heavy(linkage)
    family = build(made(linkage))
    gains = {name: (gain + 0 * PSI, slope + 0 * PSI) for name, (gain, slope) in walked(family, PSI).items()}
    poses = solve(linkage, 0.0, tau).poses(PSI)
    inertia = np.zeros_like(PSI)
    for link in linkage.links:
        angle, centre = poses.angle(link.name), poses.centre(link.name)
        inertia += link.mass * (centre.rate**2).sum(axis=0) + link.inertia * angle.rate**2
        if link.name in gains and link.name != "crank":
            np.testing.assert_allclose(gains[link.name][0], angle.rate, atol=1e-12)
            np.testing.assert_allclose(gains[link.name][1], angle.slope, atol=1e-11)
        for axis, name in enumerate("xy"):
            rate, slope = gains.get(f"{link.name}.com.{name}", (0.0 * PSI, 0.0 * PSI))
            np.testing.assert_allclose(rate, centre.rate[axis], atol=1e-12)
            np.testing.assert_allclose(slope, centre.slope[axis], atol=1e-11)
    result = sum(mass.value * gains[mass.velocity][0] ** 2 for mass in family.masses)
    np.testing.assert_allclose(result, inertia, rtol=1e-13)
    for port in family.ports.values():
        low, high = (port.position(family.position(PSI + h, np, PSI)) for h in (-1e-4, 1e-4))
        np.testing.assert_allclose((high - low) / 2e-4, gains[port.velocity][0], atol=2e-6)


def test_port_at_a_point_along_a_direction() -> None:
    linkage = six_bar()
    family = build(made(linkage, points=(PointPort("tool", "rocker", "F", 0.7),)))
    poses = solve(linkage, 0.0, tau).poses(PSI).point("rocker", linkage.link("rocker").point("F"))
    along = np.array([np.cos(0.7), np.sin(0.7)])
    port = family.ports["tool"]
    np.testing.assert_allclose(port.position(family.position(PSI, np)), along @ poses.value, atol=1e-14)
    np.testing.assert_allclose(walked(family, PSI)["tool"][0], along @ poses.rate, atol=1e-13)


def test_a_point_that_does_not_move_is_no_port() -> None:
    with pytest.raises(SceneError, match=r"ports\.tool: found slider\.O, which does not move along 90 deg"):
        build(made(slider_crank(), points=(PointPort("tool", "slider", "O", pi / 2),)))


def test_intervals_hold_the_positions() -> None:
    family = build(made(six_bar()))
    low = np.linspace(0.0, 6.2, 30)
    cells = family.position(Interval(low, low + 0.03), NAMESPACE, low + 0.015)
    for name, port in family.ports.items():
        bounds = port.position(cells)
        for share in (0.0, 0.4, 1.0):
            value = port.position(family.position(low + 0.03 * share, np))
            assert np.all(bounds.contains(value)), name


def test_angles_gain_a_turn_each_turn() -> None:
    family = build(made(geared_five_bar(-2.0)))
    second = family.ports["second"]
    ends = [float(second.position(family.position(np.array(q), np))) for q in (0.5, 0.5 + tau)]
    assert ends[1] - ends[0] == pytest.approx(-2 * tau)
    assert not second.returns
    assert family.ports["left"].returns


def test_the_last_single_positions_are_kept_and_arrays_are_not() -> None:
    at = build(made(geared_five_bar(-2.0))).position
    first, other = at(0.3, np, 0.5), at(0.4, np, 0.5)
    assert at(0.3, np, 0.5) is first
    assert at(0.4, np, 0.5) is other
    assert at(0.3, np, 7.0) is not first
    for k in range(4):
        at(1.0 + k, np, 0.5)
    assert at(0.3, np, 0.5) is not first
    table = np.array([0.3])
    assert at(table, np) is not at(table, np)


def test_psi_is_brought_into_the_anchor_s_turn() -> None:
    family = build(made(geared_five_bar(-2.0)))
    near, far = (family.position(q, np, anchor) for q, anchor in ((0.3, 0.5), (0.3 + 3 * tau, 0.5 + 3 * tau)))
    left, second = family.ports["left"], family.ports["second"]
    assert abs(float(left.position(near)) - float(left.position(far))) < 1e-13
    assert abs(float(second.position(near)) - 6 * tau - float(second.position(far))) < 1e-12


def test_a_ratio_that_needs_two_turns() -> None:
    half = geared_five_bar(0.5, 0.7)
    family = build(made(half, travel=2 * tau))
    left = family.ports["left"]
    values = [float(left.position(family.position(np.array(q), np))) for q in (0.5, 0.5 + tau, 0.5 + 2 * tau)]
    assert values[2] == pytest.approx(values[0], abs=1e-12)
    assert abs(values[1] - values[0]) > 1e-3
    with pytest.raises(SceneError, match=r"does not return after 1 turn .* it returns after 2: set regime\.cycle"):
        build(made(half))


@pytest.mark.parametrize("recorded", [False, True])
def test_a_linkage_stands_turns_later_as_before_and_what_goes_round_has_gained_its_turns(recorded: bool) -> None:
    family = build(made(geared_five_bar()))

    def places(psi: float) -> list[float]:
        if not recorded:
            return [float(port.position(family.position(np.array(psi), np))) for port in family.ports.values()]
        recorder = Recorder()
        position = family.position(recorder.input("psi"), np, psi)
        return list(recorder.program([port.position(position) for port in family.ports.values()]).function("numpy")(psi))

    here = places(0.7)
    for turns in (-2, 3):
        gains = (np.array(places(0.7 + turns * tau)) - here) / (turns * tau)
        assert gains == pytest.approx([0.0 if port.returns else -2.0 for port in family.ports.values()], abs=1e-12)


def test_a_body_called_crank_must_turn_with_the_driver() -> None:
    base = slider_crank()
    names = {"crank": "arm", "rod": "crank"}
    links = tuple(link._replace(name=names.get(link.name, link.name)) for link in base.links)
    joints = tuple(j._replace(first=names.get(j.first, j.first), second=names.get(j.second, j.second)) for j in base.joints)
    with pytest.raises(SceneError, match=r"bodies\.crank: found a body called crank that does not turn with the driver"):
        build(made(replace(base, links=links, joints=joints)))


def test_cells_shorten_close_to_a_lock() -> None:
    wide, near = (build(made(slider_crank(0.1, length, 0.0))) for length in (0.3, 0.100001))
    assert len(near.breakpoints) > 10 > len(wide.breakpoints)
    assert min(abs(angle - pi / 2) for angle in near.breakpoints) < 0.01


def test_cam_breaks_where_its_lift_does() -> None:
    class Broken:
        breakpoints = (0.0, 2.0)
        jet = SINE.curve.jet

    base = cam_rocker()
    lift = base.couplings[0]._replace(lift=Lift(Broken(), SINE.period))
    family = build(made(replace(base, couplings=(lift,))))
    assert min(abs(angle - 2.0) for angle in family.breakpoints) < 1e-12


def test_a_sliding_driver() -> None:
    base = heavy(slider_crank(0.1, 0.3, 0.0))
    crank, rod, slider = base.links
    pushed = replace(base, links=(crank._replace(name="arm", guess=0.5), rod, slider), driver="guide", start=0.35)
    joints = tuple(
        j._replace(first=j.first.replace("crank", "arm"), second=j.second.replace("crank", "arm")) for j in pushed.joints
    )
    pushed = replace(pushed, joints=joints)
    family = build(made(pushed, stroke=(0.25, 0.39)))
    x = np.array([0.26, 0.3, 0.38])
    gains = walked(family, x)
    turned = walked(build(made(base)), solve(pushed, 0.25, 0.39).poses(x).angle("arm").value)
    np.testing.assert_allclose(gains["arm"][0], 1 / turned["guide"][0], rtol=1e-11)
    np.testing.assert_allclose(gains["arm"][1], -turned["guide"][1] / turned["guide"][0] ** 3, rtol=1e-10)
    assert gains["guide"] == (1.0, 0.0)
    assert family.ports["guide"].position(family.position(x, np)).tolist() == x.tolist()


def test_sizes_like_the_named_type() -> None:
    rod = {"length": 0.3, "mass": 2.0, "inertia": 0.01, "com": 0.05, "com_angle": 0.3}
    lengths = {"crank": {"length": 0.1}, "rod": rod, "slider": {"offset": 0.02}}
    named = flywheel.load(
        {
            "mechanism": {"type": "slider-crank", "name": "m", **lengths},
            "gravity": {},
            "load": [{"on": "m.slider", "force": "-40 * sign(v)"}],
            "drive": {"torque": "balance"},
            "regime": {"speed": 20},
            "flywheel": {"irregularity": 0.02},
        }
    )
    linkage = linkage_of(named.mechanisms[0])
    loads = tuple(load._replace(on="m.guide") for load in named.loads)
    built: Scene = replace(named, mechanisms=(made(linkage),), loads=loads)
    first, second = (flywheel.size(scene, simulate=False) for scene in (named, built))
    assert second.flywheel.exact == pytest.approx(first.flywheel.exact, rel=1e-11)
    assert second.balance.value == pytest.approx(first.balance.value, rel=1e-11)


def test_every_family_has_positions_at_single_angles() -> None:
    family: Family = build(made(six_bar()))
    alone = family.ports["output"].position(family.position(1.0, np))
    assert np.shape(alone) == ()
    assert float(alone) == float(family.ports["output"].position(family.position(np.array([1.0]), np))[0])


def test_redundant_constraints_are_told_with_the_sizing() -> None:
    bodies = {
        "crank": {"points": {"A": [0.1, 0]}, "inertia": 0.1},
        "rod": {"points": {"B": [0.3, 0]}, "mass": 1.0, "guess": 0.0},
        "ram": {"mass": 4.0},
    }
    joints = [
        {"name": "O", "type": "pin", "between": ["frame.origin", "crank.origin"]},
        {"name": "A", "type": "pin", "between": ["crank.A", "rod.origin"]},
        {"name": "B", "type": "pin", "between": ["rod.B", "ram.origin"]},
        {"name": "ram", "type": "slide", "between": ["frame.origin", "ram.origin"]},
        {"name": "rail", "type": "slide", "between": ["frame.origin", "ram.origin"]},
    ]
    mechanism = {"type": "linkage", "driver": "O", "bodies": bodies, "joints": joints}
    scene = flywheel.load({"mechanism": mechanism, "regime": {"speed": 20}, "flywheel": {"irregularity": 0.1}})
    messages = flywheel.size(scene, simulate=False).messages
    assert any("linkage has redundant constraints (Gruebler counts -1, not 1)" in m and "rail" in m for m in messages)


# A family of mechanisms is one file: `swinging_cylinder.py`, registered, does all that those of the toolkit do.


SCENE = """
[mechanism]
type = "swinging-cylinder"
crank = {length = "60 mm", mass = "3 kg", inertia = "0.002 kg m^2", com = "20 mm"}
frame.length = "250 mm"
cylinder = {inertia = "0.05 kg m^2"}

[[load]]
on = "swinging-cylinder.rod"
force = "4 kN"
from = 0
to = "180 deg"

[drive]
torque = "balance"

[regime]
speed = "240 rpm"

[flywheel]
irregularity = "2 %"
"""


@pytest.fixture(autouse=True)
def registered(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setattr(KINDS, "homes", dict(KINDS.homes))
    register(swinging_cylinder.KIND)
    return


def scene(tmp_path: Path, text: str = SCENE) -> flywheel.Scene:
    path = tmp_path / "engine.toml"
    path.write_text(text, encoding="utf-8")
    return flywheel.load(path)


def test_it_is_sized_from_a_file(tmp_path: Path) -> None:
    result = flywheel.size(scene(tmp_path))
    assert result.balance.value == pytest.approx(-4000 * 0.12 / (2 * math.pi), rel=1e-12)


def test_its_reduction_follows_its_geometry(tmp_path: Path) -> None:
    phi = np.linspace(0.1, 6.2, 7)
    state = flywheel.reduce(scene(tmp_path), phi)
    swing = 0.06 * (0.06 - 0.25 * np.cos(phi)) / (0.06**2 + 0.25**2 - 2 * 0.06 * 0.25 * np.cos(phi))
    assert state.inertia == pytest.approx(0.002 + 3 * 0.02**2 + 0.05 * swing**2, rel=1e-13)


def test_it_has_reactions_and_a_picture(tmp_path: Path) -> None:
    forces = flywheel.joint_forces(scene(tmp_path), [math.pi / 2]).mechanisms["swinging-cylinder"]
    assert {"pivot", "pin", "trunnion", "bore"} <= set(forces.forces)
    assert flywheel.draw(scene(tmp_path)).axes


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("frame.length", "frame.lenght", 'did you mean "length"?'),
        ('"250 mm"', '"-1 mm"', "above 0"),
        ('"250 mm"', '"50 mm"', "the crank locks at 0 deg"),
        ("swinging-cylinder.rod", "swinging-cylinder.bar", "rod"),
        ('type = "swinging-cylinder"', 'type = "swinging-cylindre"', 'did you mean "swinging-cylinder"?'),
    ],
)
def test_its_faults_are_told(tmp_path: Path, old: str, new: str, message: str) -> None:
    with pytest.raises(flywheel.SceneError) as caught:
        scene(tmp_path, SCENE.replace(old, new))
    assert any(message in str(fault) for fault in caught.value.faults)


def test_its_page_is_in_the_reference() -> None:
    page = reference.text("swinging-cylinder")
    assert "`frame.length` | length above 0, required" in page
    assert "mass at least 0, default 0.0" in page
    assert "s = sqrt(r^2 + d^2 - 2 r d cos phi)" in page
    assert "swinging-cylinder" in reference.topics()


def test_a_name_is_taken_once() -> None:
    with pytest.raises(ValueError, match="called 'four-bar' already"):
        register(swinging_cylinder.KIND._replace(name="four-bar"))
