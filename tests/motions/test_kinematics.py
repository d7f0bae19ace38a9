"""Kinematics of a machine: positions, velocities, instant centres."""

from __future__ import annotations

import json
import tomllib
from functools import cache, partial
from pathlib import Path
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from click.testing import CliRunner

import flywheel
from flywheel import SceneError
from flywheel.cli import main
from flywheel.machine.reactions import solution_of
from flywheel.motions.driver import scene_moved
from flywheel.tables.motions import velocities_data as data
from flywheel.tables.motions import velocities_table as table
from flywheel.tables.motions import velocities_text as text
from flywheel.tables.rows import encoded
from tests.limits import sample

# The motion of everything: against positions to 30 digits and their derivatives, closed forms in time, and at its edges.


EXAMPLES = Path(__file__).parents[2] / "examples"
CRANK = {"type": "slider-crank", "crank": {"length": 1.0, "mass": 1}, "rod": {"length": 2.0, "mass": 1, "com": 1.0}}
ALONE: dict[str, Any] = {"mechanism": CRANK}


def holds(curve: Any, k: int, true: Any, *, loose: float = 1e4) -> None:
    """Position, velocity and acceleration at a place are the true ones within their estimates, which are not absurd."""
    for value, error, exact in zip(curve[3:6], curve.errors, true, strict=True):
        for v, e, x in zip(
            np.atleast_2d(value)[:, k],
            np.atleast_2d(error)[:, k],
            exact if isinstance(exact, tuple) else (exact,),
            strict=True,
        ):
            assert abs(mp.mpf(float(v)) - x) <= e
            assert e <= loose * 2.3e-16 * max(abs(float(x)), 1.0)


def derivatives(position: Any, q: float) -> tuple[Any, Any, Any]:
    at = mp.mpf(q)
    with mp.workdps(40):
        return position(at), mp.diff(position, at), mp.diff(position, at, 2)


def angle(y: Any, x: Any, near: float) -> Any:
    """The angle of a vector in the turn nearest to a value."""
    result = mp.atan2(y, x)
    return result + 2 * mp.pi * mp.nint((near - result) / (2 * mp.pi))


def slider(r: float, rod: float, e: float, q: Any) -> Any:
    r, rod, e = map(mp.mpf, (r, rod, e))
    return r * mp.cos(q) + mp.sqrt(rod**2 - (r * mp.sin(q) - e) ** 2)


@pytest.mark.parametrize("offset", sample([0.3, 0.0], 2))
def test_a_slider_crank_is_true_to_thirty_digits(offset):
    scene = flywheel.load({"mechanism": {**CRANK, "slider": {"offset": offset}}})
    q = [0.0, 0.7, np.pi, 4.9, 40.3]
    motion = flywheel.motion(scene, at=q)
    x = partial(slider, 1.0, 2.0, offset)

    def half_way(p: Any) -> Any:
        return (mp.sin(p) + mp.mpf(offset)) / 2

    for k, at in enumerate(q):
        holds(motion["slider"], k, derivatives(x, at))
        pairs = zip(derivatives(lambda p: (mp.cos(p) + x(p)) / 2, at), derivatives(half_way, at), strict=True)
        holds(motion["rod.com"], k, tuple(pairs))
        holds(motion["crank_pin.angle"], k, derivatives(lambda p: mp.asin((mp.mpf(offset) - mp.sin(p)) / 2) - p, at))


@pytest.mark.parametrize("assembly", sample(["crossed", "open"], 2))
def test_a_four_bar_is_true_to_thirty_digits_in_both_assemblies(assembly):
    lengths = {"ground": 0.4, "crank": 0.1, "coupler": 0.35, "rocker": 0.3}
    bars = {"type": "four-bar", "assembly": assembly, **{name: {"length": value} for name, value in lengths.items()}}
    q = [0.3, 2.0, 5.1]
    motion = flywheel.motion(flywheel.load({"mechanism": bars}), at=q)
    d, r, c, b = map(mp.mpf, lengths.values())

    def pin(q: Any) -> tuple[Any, Any]:
        """The coupler's far pin, left of the line from the crank pin to the rocker's pivot where it is open."""
        x, y = r * mp.cos(q), r * mp.sin(q)
        ex, ey = d - x, -y
        s = mp.sqrt(ex**2 + ey**2)
        along = (s**2 + c**2 - b**2) / (2 * s)
        aside = mp.sqrt(c**2 - along**2) * (1 if assembly == "open" else -1)
        return x + (along * ex - aside * ey) / s, y + (along * ey + aside * ex) / s

    def rocker(p: Any, near: float) -> Any:
        return angle(pin(p)[1], pin(p)[0] - d, near)

    def coupler(p: Any, near: float) -> Any:
        return angle(pin(p)[1] - r * mp.sin(p), pin(p)[0] - r * mp.cos(p), near)

    for k, at in enumerate(q):
        for name, formula in (("rocker", rocker), ("coupler", coupler)):
            holds(motion[name], k, derivatives(partial(formula, near=float(motion[name].position[k])), at))


def test_a_shaper_is_true_to_thirty_digits():
    shaper = {"type": "crank-shaper", "crank": {"length": 0.1}, "frame": {"length": 0.25}, "rocker": {"length": 0.5}}
    q = [0.4, 3.0, 5.5]
    motion = flywheel.motion(flywheel.load({"mechanism": shaper}), at=q)
    r, d = mp.mpf(0.1), mp.mpf(0.25)

    def rocker(p: Any) -> Any:
        return mp.atan2(r * mp.sin(p), d + r * mp.cos(p))

    for k, at in enumerate(q):
        holds(motion["rocker"], k, derivatives(rocker, at))
        holds(motion["ram"], k, derivatives(lambda p: mp.mpf(0.5) * mp.sin(rocker(p)), at))


@pytest.mark.slow
def test_a_cam_lifts_its_follower_as_its_law_says():
    frame = {"points": {"shaft": [0, 0], "guide": [0, 0]}}
    bodies = {"frame": frame, "cam": {"mass": 1}, "follower": {"mass": 1}}
    joints = [
        {"name": "shaft", "type": "pin", "between": ["frame.shaft", "cam.origin"]},
        {"name": "guide", "type": "slide", "between": ["frame.guide", "follower.origin"], "direction": "90 deg"},
    ]
    lift = {"type": "cam", "name": "lift", "between": ["shaft", "guide"], "lift": "0.1 + 0.02*sin(phi)**3"}
    scene = flywheel.load(
        {"mechanism": {"type": "linkage", "driver": "shaft", "bodies": bodies, "joints": joints, "couplings": [lift]}}
    )
    motion = flywheel.motion(scene, at=[1.0, 4.0])
    for k, at in enumerate((1.0, 4.0)):
        holds(motion["follower"], k, derivatives(lambda p: mp.mpf(0.1) + mp.mpf(0.02) * mp.sin(p) ** 3, at))


# -- any linkage, in absolute coordinates to 40 digits -----------------------------------------------------------------


def closure(linkage: Any, z: list[Any], q: Any) -> tuple[Any, Any]:
    """Residuals of joints, couplings and driver in x, y, angle of every moving body, and their Jacobian."""

    def row(terms: Any) -> tuple[Any, dict[int, Any]]:
        total, slopes = mp.mpf(0), dict[int, Any]()
        for weight, (value, grads) in terms:
            total += weight * value
            for k, g in grads.items():
                slopes[k] = slopes.get(k, 0) + weight * g
        return total, slopes

    def turn(body: str) -> Any:
        k = 3 * linkage.names.index(body) - 3
        return (mp.mpf(0), {}) if k < 0 else (z[k + 2], {k + 2: 1})

    def point(body: str, at: Any) -> Any:
        k, (theta, _) = 3 * linkage.names.index(body) - 3, turn(body)
        c, s, a, b = mp.cos(theta), mp.sin(theta), mp.mpf(at.x), mp.mpf(at.y)
        x, y = a * c - b * s, a * s + b * c
        return ((x, {}), (y, {})) if k < 0 else ((z[k] + x, {k: 1, k + 2: -y}), (z[k + 1] + y, {k + 1: 1, k + 2: x}))

    def times(u: Any, v: Any) -> Any:
        return u[0] * v[0], {k: u[1].get(k, 0) * v[0] + v[1].get(k, 0) * u[0] for k in {*u[1], *v[1]}}

    def gap(joint: Any) -> Any:
        ends = point(joint.first, joint.first_at), point(joint.second, joint.second_at)
        return tuple(row(((1, b), (-1, a))) for a, b in zip(*ends, strict=True))

    def coordinate(joint: Any) -> Any:
        """A pin's angle; of a slide the way along its guide, and across it."""
        if joint.kind == "pin":
            return (row(((1, turn(joint.second)), (-1, turn(joint.first)))),)
        theta, grads = turn(joint.first)
        c, s = mp.cos(theta + mp.mpf(joint.direction)), mp.sin(theta + mp.mpf(joint.direction))
        along, across = (c, {k: -s * g for k, g in grads.items()}), (s, {k: c * g for k, g in grads.items()})
        x, y = gap(joint)
        return row(((1, times(along, x)), (1, times(across, y)))), row(((-1, times(across, x)), (1, times(along, y))))

    rows = []
    for joint in linkage.joints:
        rows += list(gap(joint)) if joint.kind in ("pin", "fixed") else [coordinate(joint)[1]]
        if joint.kind in ("slide", "fixed"):
            rows.append(row(((1, turn(joint.second)), (-1, turn(joint.first)), (-1, (mp.mpf(joint.angle), {})))))
        if joint.name == linkage.driver:
            rows.append(row(((1, coordinate(joint)[0]), (-1, (q, {})))))
    for pair in linkage.couplings:
        first, second = (coordinate(linkage.joint(name))[0] for name in (pair.first, pair.second))
        rows.append(row(((1, second), (-mp.mpf(pair.ratio), first), (-1, (mp.mpf(pair.phase), {})))))
    jacobian = mp.matrix(len(rows), len(z))
    for i, (_, slopes) in enumerate(rows):
        for k, g in slopes.items():
            jacobian[i, k] += g
    return mp.matrix([value for value, _ in rows]), jacobian


def absolute(linkage: Any, start: list[float], q: float, step: float) -> tuple[list[Any], list[Any], list[Any]]:
    """x, y, angle of every moving body at a driver's coordinate with two derivatives, by differences of fourth order."""

    def settled(z: list[Any], q: Any) -> list[Any]:
        for _ in range(9):
            residual, jacobian = closure(linkage, z, q)
            move = mp.lu_solve(jacobian, -residual)
            z = [a + b for a, b in zip(z, move, strict=True)]
            if max(map(abs, move)) < mp.mpf(10) ** -32:
                break
        return z

    with mp.workdps(40):
        h, q = mp.mpf(step), mp.mpf(q)
        here = settled([mp.mpf(x) for x in start], q)
        a, b, c, d = (settled(here, q + k * h) for k in (1, -1, 2, -2))
        first = [(8 * (u - v) - (w - x)) / (12 * h) for u, v, w, x in zip(a, b, c, d, strict=True)]
        second = [(16 * (u + v) - (w + x) - 30 * y) / (12 * h**2) for u, v, w, x, y in zip(a, b, c, d, here, strict=True)]
    return here, first, second


def check_by_absolute_coordinates(file: str, at: list[float]) -> None:
    scene = flywheel.load(EXAMPLES / file)
    (mechanism,) = scene.mechanisms
    solution, period = solution_of(mechanism)
    linkage, result = solution.linkage, flywheel.motion(scene, at=at)
    own = [q - scene.origin + mechanism.phase for q in at]
    poses = solution.poses([q if period is None else q % period for q in own])
    for k, q in enumerate(own):
        z, g, bend = absolute(linkage, poses.value[1:, :, k].ravel().tolist(), q if period is None else q % period, 1e-6)
        for n, link in enumerate(linkage.links):
            (x, y, theta), (vx, vy, w), (ax, ay, turning) = (part[3 * n : 3 * n + 3] for part in (z, g, bend))
            if link.name in result.curves and result[link.name].kind == "angle":
                turns = round((float(result[link.name].position[k]) - float(theta)) / (2 * np.pi))
                holds(result[link.name], k, (theta + 2 * mp.pi * turns, w, turning), loose=1e6)
            if f"{link.name}.com" in result.curves:
                a, b = map(mp.mpf, link.com)
                u, v = a * mp.cos(theta) - b * mp.sin(theta), a * mp.sin(theta) + b * mp.cos(theta)
                true = (x + u, y + v), (vx - w * v, vy + w * u), (ax - turning * v - w**2 * u, ay + turning * u - w**2 * v)
                holds(result[f"{link.name}.com"], k, true, loose=1e6)


def test_a_linkage_with_gears_is_true_to_thirty_digits():
    check_by_absolute_coordinates("linkages/geared_five_bar.toml", [2.3])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file", "at"),
    [
        ("linkages/whitworth.toml", [2.3]),
        ("linkages/six_bar.toml", [4.4]),
        ("linkages/toggle_press.toml", [1.1, 5.0]),
        ("machines/injection_clamp.toml", [0.19, 0.16, -0.05]),
        ("machines/shaper.toml", [0.5, 3.7]),
    ],
)
def test_more_linkages_are_true_to_thirty_digits(file, at):
    check_by_absolute_coordinates(file, at)


def test_the_clamp_at_its_dead_centre_has_the_figures_of_its_source():
    motion = flywheel.motion(flywheel.load(EXAMPLES / "machines/injection_clamp.toml"), at=[0.19], speed="scene")
    printed = {
        "bell_crank": (2.83967, -0.76165, -11.972),
        "coupler": (1.89156, 4.06981, 13.152),
        "rod": (0.0, 0.64447, 10.130),
    }
    for name, figures in printed.items():
        for value, figure in zip(motion[name][3:6], figures, strict=True):
            assert float(value[0]) == pytest.approx(figure, rel=5e-5, abs=1e-4)
    assert float(motion["platen"].velocity[0]) == pytest.approx(2.179e-5, rel=1e-3)
    assert float(motion["platen"].acceleration[0]) == pytest.approx(-0.23527, rel=1e-4)
    assert float(abs(motion["bell_crank.com"].normal[0])) == pytest.approx(0.11 * 0.76165**2, rel=1e-4)
    assert float(abs(motion["bell_crank.com"].tangential[0])) == pytest.approx(1.3169, rel=1e-4)


# -- in time -----------------------------------------------------------------------------------------------------------


def test_laws_of_time_hold_with_their_derivatives():
    scene = flywheel.load(ALONE)
    for written, law in (
        ("sin(t)", mp.sin),
        ("(t - sin(t))/2 + 0.3*exp(-t)", lambda t: (t - mp.sin(t)) / 2 + mp.mpf("0.3") * mp.exp(-t)),
    ):
        motion = flywheel.motion(scene, law=written, until=9.0, points=7)
        for k, t in enumerate(motion.t):
            holds(motion["slider"], k, derivatives(lambda t, law=law: slider(1.0, 2.0, 0.0, law(t)), float(t)))
    assert motion.over == "time"


def test_every_form_of_a_law_moves_alike(tmp_path):
    scene, t = flywheel.load(ALONE), np.linspace(0.0, 2.0, 401)
    at = np.linspace(0.0, 2.0, 9)
    table = tmp_path / "law.csv"
    table.write_text("t [ms],phi [deg]\n" + "".join(f"{1e3 * x!r},{float(np.degrees(np.sin(x)))!r}\n" for x in t.tolist()))
    wanted = flywheel.motion(scene, law="sin(t)", until=2.0, at=at)["slider"]
    for law in ((t, np.sin(t)), str(table), lambda t: (np.sin(t), np.cos(t), -np.sin(t))):
        motion = flywheel.motion(scene, law=law, until=2.0, at=at)["slider"]
        for mine, other, close in zip(motion[3:6], wanted[3:6], (1e-10, 1e-7, 1e-4), strict=True):
            assert np.abs(mine - other).max() < close


@pytest.mark.parametrize("header", ["t,phi [deg]", "t [s];phi (deg)", "t [ms],phi"])
def test_each_column_of_a_law_has_its_own_unit(tmp_path, header):
    """Without brackets a column is in SI, whatever the other one has."""
    separator, milli, degrees = header[header.index("phi") - 1], "ms" in header, "deg" in header
    rows = [(t * (1e3 if milli else 1.0), 0.1 * t * t * (180 / np.pi if degrees else 1.0)) for t in (0.0, 0.5, 1.0, 2.0)]
    (tmp_path / "law.csv").write_text("\n".join([header, *(f"{t!r}{separator}{float(q)!r}" for t, q in rows)]))
    motion = flywheel.motion(flywheel.load(ALONE), law=str(tmp_path / "law.csv"), of=["crank"], at=[1.5])["crank"]
    assert motion.position == pytest.approx([0.225], rel=1e-12)


@pytest.mark.parametrize("call", ["motion", "joint_forces", "size", "tradeoff", "simulate"])
def test_a_file_name_is_no_scene(call):
    with pytest.raises(TypeError, match=r"flywheel\.load makes one"):
        getattr(flywheel, call)("press.toml", *((0.0, 1.0, 2.0) if call == "simulate" else ()))


def test_a_start_by_a_cycloid_tells_where_it_goes_over():
    rise = "(t - sin(t))*(t < 2*pi) + 2*pi*(t >= 2*pi)"
    motion = flywheel.motion(flywheel.load(ALONE), law=rise, until=8.0)
    assert motion.messages == ()
    assert motion.breakpoints.size == 0  # it stops without a jump of its acceleration
    motion = flywheel.motion(flywheel.load(ALONE), law="t**2*(t < 1) + (2*t - 1)*(t >= 1)", until=2.0)
    assert motion.breakpoints == pytest.approx([1.0], abs=1e-13)
    assert abs(motion.breakpoints[0] - 1.0) <= motion.breakpoint_errors[0]
    motion = flywheel.motion(flywheel.load(ALONE), law="abs(t - 1)", until=2.0)
    assert "speed jumps at t = 1 s" in motion.messages[0]


def test_a_constant_speed_is_the_influence_coefficients_scaled():
    scene = flywheel.load(ALONE)
    unit, turning = flywheel.motion(scene, points=5), flywheel.motion(scene, speed=-5.0, points=5)
    for name in ("rod", "slider", "rod.com", "crank_pin.angle"):
        assert np.allclose(turning[name].velocity, -5.0 * unit[name].velocity)
        assert np.allclose(turning[name].acceleration, 25.0 * unit[name].acceleration)
    over_time = flywheel.motion(scene, speed=5.0, over="time", points=5)
    assert np.allclose(over_time.q, 5.0 * over_time.t)


def test_at_a_negative_speed_time_runs_forward():
    scene = flywheel.load(ALONE)
    over_driver = flywheel.motion(scene, speed=-5.0, points=5)
    assert np.allclose(over_driver.t, (2 * np.pi - over_driver.q) / 5.0)
    over_time = flywheel.motion(scene, speed=-5.0, over="time", points=5)
    assert np.allclose(over_time.q, -5.0 * over_time.t)
    slider, same = (result["slider"].position for result in (over_driver, over_time))
    assert np.allclose(slider[::-1], same)


def test_a_speed_is_told_in_the_unit_in_which_it_is_round():
    scene = flywheel.load(ALONE)
    words = [flywheel.motion(scene, speed=speed, points=3).condition for speed in (4 * np.pi, 5.0, -np.pi)]
    assert words == ["at 120 rpm", "at 5 rad/s", "at -30 rpm"]


def test_a_transient_moves_everything_within_its_own_error():
    rotor = {"mechanism": {"type": "scotch-yoke", "crank": {"length": 0.5}}, "drive": {"torque": 6}}
    scene = flywheel.load({**rotor, "inertia": [{"on": "crank", "value": 2}]})
    run = flywheel.transient(scene, end=3.0)
    motion = flywheel.motion(scene, transient=run, points=7)
    for k, t in enumerate(motion.t):  # phi = 1.5 t²
        holds(motion["yoke"], k, derivatives(lambda t: mp.mpf(0.5) * mp.cos(mp.mpf(1.5) * t**2), float(t)), loose=1e10)
    curve, rate = motion["yoke"], np.abs(motion.rate[1:])
    assert (curve.errors[2][1:] >= 2 * np.abs(curve.parts[1][1:]) / rate * motion.errors["rate"][1:]).all()
    over = flywheel.motion(scene, transient=run, over="driver", at=[1.0, 6.0])
    assert over.t == pytest.approx(np.sqrt(np.array([1.0, 6.0]) / 1.5), abs=1e-9)


@pytest.mark.slow
def test_the_steady_regime_over_time_is_the_derivative_of_itself():
    press = {
        "mechanism": {**CRANK, "name": "press"},
        "load": [{"on": "slider", "force": "-100*(phi < 2)"}],
        "drive": {"torque": "balance"},
    }
    scene = flywheel.load({**press, "regime": {"speed": 10}, "flywheel": {"inertia": 30}})
    motion = flywheel.motion(scene, regime=True, over="time", points=1001)
    assert motion.t[-1] == pytest.approx(flywheel.size(scene).simulation.period, rel=1e-9)
    assert motion.q[-1] == pytest.approx(2 * np.pi, abs=1e-9)
    assert float(np.interp(motion.breakpoints[0], motion.t, motion.q)) == pytest.approx(2.0, abs=1e-6)
    for name in ("slider", "rod", "crank"):
        curve, smooth = motion[name], np.abs(motion.t[1:-1] - motion.breakpoints[0]) > 5e-3
        for one, next_one in ((curve.position, curve.velocity), (curve.velocity, curve.acceleration)):
            slope = (one[2:] - one[:-2]) / (motion.t[2:] - motion.t[:-2])
            assert np.abs(slope - next_one[1:-1])[smooth].max() < 3e-4 * np.abs(next_one).max()


# -- extremes, dead centres, names -------------------------------------------------------------------------------------


@pytest.mark.parametrize("longer", [1e-9, 1e-6, 1e-3])
def test_errors_grow_towards_a_lock(longer):
    """With a rod hardly longer than its crank a rounded angle near a quarter turn moves the slider far more."""
    rod = 1.0 + longer
    scene = {"mechanism": CRANK | {"rod": {"length": rod}}}
    angles = np.array([1.5, 1.57, 1.5707, 1.570796, 1.58, 4.7, 4.7124])
    curve = flywheel.motion(flywheel.load(scene), of=["guide"], at=angles).curves["guide"]
    for k, q in enumerate(angles):
        holds(curve, k, derivatives(partial(slider, 1.0, rod, 0.0), float(q)), loose=np.inf)


def test_extremes_and_dead_centres_are_within_their_errors():
    x = partial(slider, 1.0, 2.0, 0.0)
    motion = flywheel.motion(flywheel.load(ALONE), points=5)  # however few positions are listed
    for extreme in motion.extremes["guide"]:
        order = ("position", "velocity", "acceleration").index(extreme.quantity)
        with mp.workdps(30):
            at = mp.findroot(lambda p, order=order: mp.diff(x, p, order + 1), extreme.at)
            assert abs(at - extreme.at) <= extreme.at_error < 1e-7
            assert abs(mp.diff(x, at, order) - extreme.value) <= extreme.error < 1e-12
    assert motion.dead_centres["guide"] == pytest.approx([0.0, np.pi], abs=1e-12)
    assert motion.dead_centres["slider_pin"] == pytest.approx([0.0, np.pi], abs=1e-12)
    assert not motion.dead_centres["crank_pin"].size
    law = flywheel.motion(flywheel.load(ALONE), law="sin(t)", until=5.0)
    assert (
        np.abs(law.dead_centres["guide"] - np.array([0.5, 1.0, 1.5]) * np.pi).max()
        <= law.dead_centre_errors["guide"].max()
        < 1e-10
    )


@pytest.mark.parametrize("end", sample([0.154, 0.172, 0.19], 3))
def test_no_sample_lies_beyond_an_extreme_at_the_end_of_a_stroke(end):
    raw = tomllib.loads((EXAMPLES / "machines" / "injection_clamp.toml").read_text(encoding="utf-8"))
    raw["stroke"]["to"] = end
    motion = flywheel.motion(flywheel.load(raw), speed="scene", of=("rod", "bell_crank", "coupler"), points=101)
    for name, curve in motion.curves.items():
        for extreme in motion.extremes[name]:
            sampled = getattr(curve, extreme.quantity)
            furthest = sampled.min() if extreme.which == "least" else sampled.max()
            assert furthest == pytest.approx(extreme.value, abs=5e-3 * np.ptp(sampled))


@pytest.mark.slow
def test_several_mechanisms_turn_on_their_own_shafts():
    mechanisms = [{**CRANK, "name": "one"}, {**CRANK, "name": "two", "shaft": "fast", "phase": "90 deg"}]
    outputs = {"pusher": {"x": "0.1*cos(2*phi)"}}
    scene = flywheel.load(
        {"mechanism": [*mechanisms, {"type": "law", "name": "law", "outputs": outputs}], "shafts": {"fast": {"ratio": 2}}}
    )
    motion = flywheel.motion(scene, at=[0.4])
    assert {"crank", "fast", "one.rod", "two.rod.com", "law.pusher"} <= motion.curves.keys()
    holds(motion["two.slider"], 0, derivatives(lambda p: slider(1.0, 2.0, 0.0, 2 * p + mp.mpf(np.pi / 2)), 0.4))
    holds(motion["pusher"], 0, derivatives(lambda p: mp.mpf(0.1) * mp.cos(2 * p), 0.4))
    holds(motion["fast"], 0, (2 * mp.mpf(0.4), mp.mpf(2), mp.mpf(0)))


def test_shafts_alone_and_names():
    rotor = flywheel.motion(
        flywheel.load({"shafts": {"motor": {"ratio": 3}}, "inertia": [{"on": "motor", "value": 1}]}), points=3
    )
    assert rotor["motor"].position[-1] == pytest.approx(6 * np.pi)
    twisting = {"shafts": {"motor": {"ratio": 3, "stiffness": 1e3}}, "inertia": [{"on": "motor", "value": 1}]}
    assert flywheel.motion(flywheel.load(twisting), points=3).messages == ("taken as rigid: motor, which twists",)
    motion = flywheel.motion(flywheel.load(ALONE), of=["slider", "slider-crank.rod"], points=3)
    assert list(motion.curves) == ["guide", "rod"]
    assert motion["slider"] is motion["guide"]


@cache
def alone() -> Any:
    return flywheel.load(ALONE)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"of": ["sldier"]}, 'did you mean "slider"'),
        ({"over": "time"}, "time without a motion in time"),
        ({"over": "tme"}, '"driver" or "time"'),
        ({"at": []}, "no position"),
        ({"at": [np.nan]}, "finite"),
        ({"points": 0}, "points"),
        ({"speed": 0}, "not 0"),
        ({"speed": "scene"}, "without a speed"),
        ({"speed": 1.0, "regime": True}, "one motion"),
        ({"until": 2.0}, "none without a law"),
        ({"law": "sin(t)"}, "how long it lasts"),
        ({"law": "tan(t)", "until": 2.0}, "1.5708"),
        ({"law": "sqrt(t)", "until": 2.0}, "rate is not finite at t = 0 s"),
        ({"law": "1.0*(t > 1)", "until": 2.0}, "jumps by 1 rad at t = 1 s"),
        ({"law": "sin(phi)", "until": 2.0}, "an expression of phi"),
        ({"law": "5 rad/s", "until": 2.0}, "give it as speed"),
        ({"law": "t", "until": 1.0, "at": [3.0]}, "0 s to 1 s"),
        ({"law": "t", "until": 1.0, "over": "driver", "at": [3.0]}, "does not pass"),
        ({"law": "none.csv"}, "no file"),
        ({"law": ([0, 1, 1, 2], [0, 1, 2, 3])}, "ascend"),
        ({"law": lambda t: (np.sin(t), 1.0, 0.0), "until": 3.0}, "not the rate"),
        ({"law": lambda t: np.sin(t), "until": 3.0}, "gives one value"),
    ],
)
def test_what_cannot_move_so_is_one_line(options, message):
    with pytest.raises(SceneError) as error:
        flywheel.motion(alone(), **options)
    (fault,) = error.value.faults
    assert message in str(fault)
    assert "\n" not in str(fault)


def test_a_law_that_leaves_the_stroke_is_told_with_its_first_instant():
    scene = flywheel.load(EXAMPLES / "machines/injection_clamp.toml")
    with pytest.raises(SceneError, match=r"out of its stroke at t = 0\.76 s, above 0\.19 m"):
        flywheel.motion(scene, law="0.25*t", until=3.0)
    with pytest.raises(SceneError, match=r"at t = 0\.5 s, below -0\.06 m"):  # a short excursion between two that stay
        flywheel.motion(scene, law="-0.06 + 0.2*(t - 0.5)*(t - 0.5001)", until=0.55)
    touching = flywheel.motion(scene, law="-0.06 + 0.25*sin(t)**2", until=3.0, of=["platen"])
    assert touching.q.max() <= 0.19


@pytest.mark.parametrize("type_", sample(["linkage", "four-bar"], 2))
def test_a_law_that_locks_is_told_with_place_and_instant(tmp_path, type_):
    lengths = {"ground": 1.0, "crank": 0.8, "coupler": 0.5, "rocker": 0.6}
    named = 'type = "four-bar"\n' + "".join(f"{name}.length = {value}\n" for name, value in lengths.items())
    path = tmp_path / "bars.toml"
    path.write_text("[mechanism]\n" + (named if type_ == "four-bar" else LOCKING), encoding="utf-8")
    lock = np.arccos((0.8**2 + 1.0 - 1.1**2) / (2 * 0.8))
    laws = [("t", lock), ("-2*t", lock / 2), ("1.5*sin(t)", np.arcsin(lock / 1.5))]
    for law, t in laws if type_ == "four-bar" else laws[1:2]:
        with pytest.raises(SceneError, match=rf"into a lock at t = {t:.9g} s, (above|below) -?74\.41010189 deg"):
            scene_moved(path, law, 3.0)
    scene = scene_moved(path, "0.3*sin(t)", 3.0)
    motion = flywheel.motion(scene, law="0.3*sin(t)", until=3.0, points=5)
    assert motion["crank"].position == pytest.approx(0.3 * np.sin(motion.t))


LOCKING = """
type = "linkage"
driver = "A"
bodies.frame.points = {A = [0, 0], D = [1, 0]}
bodies.crank.points = {A = [0, 0], B = [0.8, 0]}
bodies.coupler.points = {B = [0, 0], C = [0.5, 0]}
bodies.rocker.points = {D = [0, 0], C = [0.6, 0]}
joints = [
    {name = "A", type = "pin", between = ["frame.A", "crank.A"]},
    {name = "B", type = "pin", between = ["crank.B", "coupler.B"]},
    {name = "C", type = "pin", between = ["coupler.C", "rocker.C"]},
    {name = "D", type = "pin", between = ["frame.D", "rocker.D"]},
]
assembly = [{point = "coupler.C", from = "crank.B", to = "frame.D", side = "left"}]
"""


@pytest.mark.parametrize("given", sample([{"speed": 10.0, "over": "time"}, {}, {"speed": 10.0}], 3))
def test_a_jump_leaves_extremes_and_breakpoints_their_digits(given):
    """At the jump itself either side may be meant, in time above all; what is beside it is known."""
    law = {"type": "law", "outputs": {"follower": {"x": "0.01*(1 - cos(2*phi)) if phi < pi else 0"}}}
    motion = flywheel.motion(flywheel.load({"mechanism": law}), of=["follower"], points=9, **given)
    scale = 100.0 if given else 1.0
    least, greatest = (extreme for extreme in motion.extremes["follower"] if extreme.quantity == "acceleration")
    assert (least.value, greatest.value) == pytest.approx((-0.04 * scale, 0.04 * scale), rel=1e-12)
    assert least.error + greatest.error < 1e-9 * scale
    assert motion.breakpoints == pytest.approx([np.pi / (10.0 if given.get("over") else 1.0)])


# Instant centres of scenes: through shafts and strokes, with errors; velocities by them; as text, columns and data.


PRESS = {"type": "slider-crank", "crank": {"length": 0.1}, "rod": {"length": 0.3}, "slider": {"offset": 0.02}}
GEARED = {"shafts": {"pinion": {"ratio": 2}}, "mechanism": PRESS | {"shaft": "pinion", "phase": 0.4}}


@pytest.fixture(scope="module")
def scene():
    return flywheel.load(GEARED)


def exact(phi):
    """Centre of the rod (m) and velocity of the slider by the crank's angle, at 30 digits."""
    with mp.workdps(30):
        psi, r, e = mp.mpf(2.0 * phi + 0.4), mp.mpf("0.1"), mp.mpf("0.02")
        reach = mp.sqrt(mp.mpf("0.09") - (r * mp.sin(psi) - e) ** 2)
        x = r * mp.cos(psi) + reach
        rate = -r * mp.sin(psi) - (r * mp.sin(psi) - e) * r * mp.cos(psi) / reach
        return x, x * mp.tan(psi), 2 * rate


def test_they_are_found_behind_a_gear_with_errors_that_hold(scene):
    """Also close to where the rod's centre is at infinity."""
    q = np.append(np.linspace(0.05, 6.2, 7), (np.pi / 2 - 0.4) / 2 + np.array([1e-3, 1e-6, 1e-9]))
    result = flywheel.instant_centres(scene, q, speed=3.0).mechanisms["slider-crank"]
    rod = result.centres["frame", "rod"]
    slider = next(point for point in result.velocities if point.name == "slider.guide")
    for k, phi in enumerate(q.tolist()):
        x, y, rate = exact(phi)
        off = float(mp.hypot(x - mp.mpf(float(rod.place[0, k])), y - mp.mpf(float(rod.place[1, k]))))
        assert off <= rod.error[k] < 1e-12 * (1 + float(y) ** 2 / 0.01)
        assert abs(slider.by_centre[0, k] - float(3 * rate)) <= slider.error[k] < 1e-12
    for point in result.velocities:
        assert (np.abs(point.by_centre - point.by_coefficients) <= point.error).all()


def test_the_text_lists_centres_and_velocities(scene):
    page = text(flywheel.instant_centres(scene, [0.5]))
    assert page.startswith("slider-crank: instant centres at phi = 28.6478897565 deg\n")
    assert "frame - slider  at infinity  along 90" in page
    assert "m/rad" in page
    assert "rod.slider_pin" in page


def test_columns_and_data_hold_the_same(scene):
    centres = flywheel.instant_centres(scene, [0.5, 1.0])
    columns = dict(table(centres))
    output = json.loads(encoded(data(centres)))["slider-crank"]
    rod = next(centre for centre in output["centres"] if centre["bodies"] == ["frame", "rod"])
    assert rod["x"] == columns["P(frame rod) x [m]"].tolist()
    assert rod["direction"] == [None, None]
    slider = next(centre for centre in output["centres"] if centre["bodies"] == ["frame", "slider"])
    assert (slider["kind"], slider["x"], slider["permanent"]) == (["at infinity"] * 2, [None, None], True)
    assert slider["direction"] == pytest.approx([np.pi / 2] * 2)
    pins = [point for point in output["velocities"] if point["point"] == "rod.slider_pin"]
    assert pins[0]["by_centre"]["x"] == columns["rod.slider_pin velocity by centre x [m]"].tolist()


def test_what_has_no_bodies_has_no_centres(scene):
    law = {"mechanism": {"type": "law", "outputs": {"ram": {"x": "0.1*cos(phi)"}}}}
    with pytest.raises(SceneError, match="mechanism: found law, expected a mechanism with bodies"):
        flywheel.instant_centres(flywheel.load(law), [0.0])
    with pytest.raises(SceneError, match="one, or 1 as there are positions"):
        flywheel.instant_centres(scene, [0.0], speed=[1.0, 2.0])
    with pytest.raises(SceneError, match="finite"):
        flywheel.instant_centres(scene, [float("nan")])


@pytest.mark.slow
def test_the_command_lists_and_draws_them(tmp_path):
    scene = tmp_path / "press.toml"
    scene.write_text('mechanism = {type = "slider-crank", crank = {length = 0.1}, rod = {length = 0.3}}\n')
    run = CliRunner().invoke
    command = ["motion", str(scene), "--instant-centres", "--of", "rod", "--at", "30 deg", "--speed", "60 rpm"]
    page = run(main, [*command, "--plot", str(tmp_path / "a.png")])
    assert page.exit_code == 0, page.output
    assert "slider-crank: instant centres at phi = 30 deg" in page.stdout
    assert "velocities by them, and by influence coefficients, m/s" in page.stdout
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    output = json.loads(run(main, [*command, "--json"]).stdout)["instant_centres"]["slider-crank"]
    slider = next(point for point in output["velocities"] if point["point"] == "slider.guide")
    reach = np.sqrt(0.09 - 0.0025)
    assert slider["by_centre"]["x"] == pytest.approx([-2 * np.pi * 0.05 * (1 + 0.1 * np.cos(np.pi / 6) / reach)])
    assert run(main, [*command, "--csv"]).stdout.splitlines()[0].count("P(frame rod)") == 5
    few = run(main, ["motion", str(scene), "--instant-centres", "--of", "rod"]).stdout
    assert [line.rpartition("phi = ")[2] for line in few.splitlines() if "instant centres at" in line] == [
        *("0 deg", "90 deg", "180 deg", "270 deg"),
    ]
