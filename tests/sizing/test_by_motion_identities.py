"""Sizing along the machine's own motion: what other units, other words and other origins leave as it is; laws that bend."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import flywheel
from tests import regimes, scenes


def sized(scene, rtol=1e-9, simulate=False):
    return flywheel.size(flywheel.load(scene), rtol, simulate=simulate)


@pytest.mark.parametrize("make", [scenes.yoke, scenes.shaper])
@pytest.mark.parametrize("given_", [{"irregularity": 0.05}, {"inertia": 70}])
def test_slopes_of_zero_give_what_positions_alone_do(make, given_):
    """A damper that takes nothing sends the machine through the collocation: every figure stays."""
    scene = make(flywheel=given_)
    plain = sized(scene)
    moving = sized(scene | {"damper": [{"on": "crank", "coefficient": 0}]})
    assert plain.cyclic is None
    assert moving.cyclic.damping == 0.0
    for part in ("flywheel", "reduced_inertia"):
        pairs = zip(getattr(plain, part), getattr(moving, part), strict=True)
        assert all(a == pytest.approx(b, rel=1e-9) for a, b in pairs if isinstance(a, float) and isinstance(b, float))
    names = ("speed", "power", "accumulated_max", "accumulated_min", "angle_speed_max", "angle_speed_min")
    for name in names:
        assert getattr(moving, name) == pytest.approx(getattr(plain, name), rel=1e-11, abs=1e-9)
    assert moving.balance.value == pytest.approx(plain.balance.value, rel=1e-12)
    assert moving.run.irregularity == pytest.approx(plain.run.irregularity, rel=1e-11)
    assert [round(a.start, 9) for a in moving.areas] == [round(a.start, 9) for a in plain.areas]


DRAGS = {
    "damper": {"damper": [{"on": "yoke", "coefficient": 150}]},
    "v": {"load": [{"on": "yoke", "force": "-150*v"}]},
    "two": {"load": [{"on": "yoke", "force": "-50*v"}], "damper": [{"on": "yoke", "coefficient": 100}]},
    "omega": {"load": [{"on": "yoke", "force": "150*0.3*sin(phi)*omega"}]},
    "crank": {"load": [{"on": "crank", "torque": "-150*(0.3*sin(phi))**2*omega"}]},
    "shaft": {
        "shafts": {"fast": {"ratio": 4}},
        "load": [{"on": "fast", "torque": "-150*(0.3*sin(phi))**2*omega/16"}],
    },
}


@pytest.mark.parametrize("kind", ["v", "omega", "shaft"])
def test_one_drag_written_in_several_ways(kind):
    base = {key: regimes.YOKE[key] for key in ("mechanism", "drive")} | {"flywheel": {"irregularity": 0.05}}
    true, found = sized(base | DRAGS["damper"]), sized(base | DRAGS[kind])
    assert found.flywheel.exact == pytest.approx(true.flywheel.exact, rel=1e-12)
    assert found.flywheel.approximate == pytest.approx(true.flywheel.approximate, rel=1e-12)
    assert (found.speed, found.power) == pytest.approx((true.speed, true.power), rel=1e-12)
    assert found.cyclic.multiplier == pytest.approx(true.cyclic.multiplier, rel=1e-10)


@pytest.mark.slow
@settings(max_examples=6, deadline=None)
@given(st.floats(0.05, 20), st.floats(0.1, 10))
def test_units_of_mass_and_time_may_be_others(mass, time):
    """Masses times m and times over s: torques grow by m s², slopes by m s, inertia by m, speeds by s."""

    def press(m, s):
        return {
            "mechanism": {
                "type": "slider-crank",
                "crank": {"length": 0.1, "inertia": 0.2 * m},
                "rod": {"length": 0.5, "mass": 10 * m, "inertia": 0.3 * m, "com": 0.2},
                "slider": {"mass": 50 * m},
            },
            "gravity": {"g": 9.81 * s**2},
            "load": [
                {"on": "slider", "force": -2e3 * m * s**2, "from": "300 deg", "to": "345 deg"},
                {"on": "slider", "force": f"-{40 * m!r}*v*abs(v)"},
            ],
            "damper": [{"on": "slider", "coefficient": 100 * m * s}],
            "drive": {"torque": f"{60 * m * s**2!r} - {4 * m * s!r}*omega"},
            "flywheel": {"irregularity": 0.05},
        }

    one, other = sized(press(1, 1)), sized(press(mass, time))
    assert other.flywheel.exact == pytest.approx(mass * one.flywheel.exact, rel=1e-9)
    assert other.speed == pytest.approx(time * one.speed, rel=1e-9)
    assert other.power == pytest.approx(mass * time**3 * one.power, rel=1e-9)
    assert other.cyclic.multiplier == pytest.approx(one.cyclic.multiplier, rel=1e-8)


@pytest.mark.slow
@settings(max_examples=6, deadline=None)
@given(st.floats(1, 359))
def test_the_crank_may_count_its_angle_from_anywhere(degrees):
    scene = regimes.scene("four-bar", irregularity=0.02)
    turned = scene | {"mechanism": scene["mechanism"] | {"phase": f"{degrees} deg"}}
    one, other = sized(scene), sized(turned)
    assert other.flywheel.exact == pytest.approx(one.flywheel.exact, rel=1e-9)
    assert other.speed == pytest.approx(one.speed, rel=1e-10)
    gap = other.angle_speed_max + np.radians(degrees) - one.angle_speed_max
    assert abs(np.sin(gap / 2)) < 1e-6


# -- laws that bend where the motion says, against fine steps in the angle -----------------------------------------------


BENT = {
    "governed": ("min(120, max(0, 60*(9 - omega)))", "-30 - 150*(phi > 1)*(phi < 2)"),
    "two slopes": ("90 - 6*omega if omega < 9 else 36 - 18*(omega - 9)", "-60*(1 + sin(phi))*0.5"),
    "relief": ("100 - 6*omega", "-min(80, 2*omega*abs(omega))*(sin(phi) > 0)"),
    "threshold": ("100 - 6*omega", "-8*max(0, abs(v) - 7)*sign(v) - 20*(cos(phi) > 0)"),
    "nested": ("80 - 4*omega", "-(5*omega if omega > 8.5 else 42.5) - 40*(sin(phi) > 0.5)"),
}


def bent(drive, load, inertia):
    scene = {"load": [{"on": "crank", "torque": load}], "drive": {"torque": drive}, "flywheel": {"inertia": inertia}}
    names = {"sin": np.sin, "cos": np.cos, "min": min, "max": max, "abs": abs, "sign": np.sign}
    law = compile(f"({drive}) + ({load})", "law", "eval")

    def rate(phi, state):
        return [eval(law, names | {"phi": phi, "omega": state[0], "v": state[0]}) / inertia / state[0]]

    return scene, rate


@pytest.mark.parametrize("name", BENT)
def test_laws_that_bend_at_a_speed(name):
    scene, rate = bent(*BENT[name], 3.0)
    result = sized(scene)
    start = np.sqrt(result.speed**2 + 2 * result.run.offset / 3.0)
    edges = result.cycle.mesh.edges.tolist()
    state = [start]
    for low, high in pairwise(edges):
        inset = 1e-13 * (high - low)
        found = solve_ivp(
            lambda phi, state, ends=(low + inset, high - inset): rate(min(max(phi, ends[0]), ends[1]), state),
            (low, high),
            state,
            method="DOP853",
            rtol=1e-12,
            atol=1e-13,
            dense_output=True,
        )
        speeds = found.sol(np.linspace(low, high, 9))[0]
        assert speeds.max() <= result.run.speed_max * (1 + 1e-9)
        assert speeds.min() >= result.run.speed_min * (1 - 1e-9)
        state = [found.y[0, -1]]
    assert state[0] == pytest.approx(start, rel=1e-9)
    assert result.reached


def past(threshold):
    """A yoke with drag past a velocity alone: where that is depends on the motion."""
    return {
        "mechanism": {"type": "scotch-yoke", "crank": {"length": 0.3, "inertia": 0.5}, "yoke": {"mass": 20}},
        "load": [{"on": "yoke", "force": f"-400*max(0, abs(v) - {threshold})*sign(v)"}],
        "drive": {"torque": "160 - 12*omega"},
        "flywheel": {"inertia": 10},
    }


def test_a_switch_at_a_velocity_lies_where_the_motion_reaches_it():
    result = sized(past(1.2))
    cuts = result.cycle.mesh.edges
    start = np.sqrt(result.speed**2 + 2 * result.run.offset / (10 + result.cycle.inertia_at_start))

    def rate(phi, state):
        gain, bend = -0.3 * np.sin(phi), -0.3 * np.cos(phi)
        velocity = gain * state[0]
        force = -400 * max(0.0, abs(velocity) - 1.2) * np.sign(velocity)
        inertia = 10.5 + 20 * gain**2
        moment = 160 - 12 * state[0] + force * gain - 20 * gain * bend * state[0] ** 2
        return [moment / inertia / state[0]]

    reached = lambda phi, state: abs(0.3 * np.sin(phi) * state[0]) - 1.2  # noqa: E731
    found = solve_ivp(rate, (0, 2 * np.pi), [start], method="DOP853", rtol=1e-10, atol=1e-11, events=reached, max_step=0.05)
    assert found.y[0, -1] == pytest.approx(start, rel=1e-8)
    assert found.t_events[0].size == 4
    for angle in found.t_events[0]:
        assert np.abs(cuts - angle).min() < 1e-8


def test_a_strong_governor_is_followed_through_its_corners():
    """Cells that do not end at the corners yet cannot agree on a branch each: every node decides for itself at first."""
    scene, _ = bent("min(120, max(0, 60*(9 - omega)))", "-30 - 150*(phi > 1)*(phi < 2)", 3.0)
    assert sized(scene).run.irregularity == pytest.approx(0.557283304543, rel=1e-9)
    scene["flywheel"] = {"irregularity": 0.557283304543137}
    assert sized(scene).flywheel.exact == pytest.approx(3.0, rel=1e-8)
