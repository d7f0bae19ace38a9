"""The direct problem without idle tables: a mechanism and what drives it, from rest to an angle, a speed or a time."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

import flywheel
from flywheel.numerics.faults import SceneError
from tests.limits import sample

YOKE = {
    "mechanism": {
        "type": "scotch-yoke",
        "crank": {"length": 0.5, "inertia": 2},
        "block": {"mass": 3},
        "yoke": {"mass": 20},
    },
    "drive": {"torque": "100 N m"},
}
SHAPER = {
    "mechanism": {
        "type": "crank-shaper",
        "crank": {"length": 0.1, "inertia": 2},
        "frame": {"length": 0.25},
        "rocker": {"length": 0.6, "inertia": 3},
        "block": {"mass": 2, "inertia": 0.01},
        "rocker_pin": {"mass": 1},
        "ram": {"mass": 50},
    },
    "drive": {"torque": "100 N m"},
}
BARS = {
    "type": "four-bar",
    "ground": {"length": 0.2},
    "crank": {"length": 0.15, "inertia": 0.01},
    "coupler": {"length": 0.1},
    "rocker": {"length": 0.12},
}


def inertia_of_yoke(phi):
    return 2 + 3 * 0.25 + 20 * 0.25 * np.sin(phi) ** 2


def inertia_of_shaper(phi):
    r, d, arm = 0.1, 0.25, 0.6
    g = r * (r + d * np.cos(phi)) / (r * r + d * d + 2 * r * d * np.cos(phi))
    rocker = np.arctan2(r * np.sin(phi), d + r * np.cos(phi))
    return 2 + 2 * r**2 + g**2 * (3 + 0.01 + 1 * arm**2 + 50 * (arm * np.cos(rocker)) ** 2)


@pytest.mark.parametrize(
    ("scene", "inertia"), sample([(SHAPER, inertia_of_shaper), (YOKE, inertia_of_yoke)], 2), ids=["shaper", "yoke"]
)
def test_a_constant_torque_from_rest(scene, inertia):
    """The energy theorem in closed form: omega² = 2 T phi/I*(phi), t = integral of dphi/omega, with phi = u²."""
    run = flywheel.transient(flywheel.load(scene), end="0.75 turns")
    assert (run.reason, run.inertia, run.regime_speed, run.messages) == ("way", 0.0, None, ())
    phi = 1.5 * np.pi
    assert run.phi == pytest.approx(phi, rel=1e-9)
    assert run.omega == pytest.approx(np.sqrt(200 * phi / inertia(phi)), rel=1e-9)
    time, _ = quad(lambda u: 2 * np.sqrt(inertia(u * u) / 200), 0, np.sqrt(phi), epsabs=0, epsrel=1e-12, limit=200)
    assert run.time == pytest.approx(time, rel=1e-9)
    assert run.energy.kinetic_gained == pytest.approx(100 * phi, rel=1e-9)


def test_until_an_angle_a_speed_and_a_time():
    scene = flywheel.load(YOKE)
    assert flywheel.transient(scene, end="40 deg", rtol=1e-6).phi == pytest.approx(np.pi / 4.5, rel=1e-6)
    assert flywheel.transient(scene, end="3 rad/s", rtol=1e-6).omega == pytest.approx(3.0, rel=1e-6)
    assert flywheel.transient(scene, end="0.1 s", rtol=1e-6).time == 0.1


@pytest.mark.parametrize("torque", [1e-9, 1e9])
def test_the_way_is_reached_however_weak_or_strong_the_torque(torque):
    run = flywheel.transient(flywheel.load(YOKE | {"drive": {"torque": torque}}), end="90 deg", rtol=1e-6)
    assert run.reason == "way"
    assert run.omega == pytest.approx(np.sqrt(np.pi * torque / inertia_of_yoke(np.pi / 2)), rel=1e-6)


def test_an_end_must_be_said_where_nothing_fixes_a_speed():
    with pytest.raises(SceneError, match=r"until: found a regime, to which nothing holds this machine.*--until \"2 turns\""):
        flywheel.transient(flywheel.load(YOKE))
    with pytest.raises(SceneError, match=r"neither regime\.speed nor a torque that depends on speed"):
        flywheel.transient(flywheel.load(YOKE), end="95 %")


def test_torques_that_depend_on_speed_have_a_regime_without_a_flywheel():
    rotor = {"inertia": [{"on": "crank", "value": 2}], "drive": {"torque": "100 - 20*omega"}}
    run = flywheel.transient(flywheel.load(rotor))
    assert (run.reason, run.inertia) == ("regime", 0.0)
    assert run.regime_speed == pytest.approx(5.0, rel=1e-9)


@pytest.mark.parametrize(
    ("end", "told"),
    [
        ("5 s", "; it did not come to 5 s"),
        ("90 deg", "; it did not come to 1.5708 rad (0.25 turns) on"),
        ("900 rpm", "; it did not come to 94.2478 rad/s"),
    ],
)
def test_a_stroke_that_ends_before_is_not_told_as_whole(end, told):
    scene = flywheel.load({"mechanism": BARS, "drive": {"torque": 1}, "stroke": {"from": "30 deg", "to": "60 deg"}})
    run = flywheel.transient(scene, end=end)
    assert run.reason == "stroke"
    assert run.ended.endswith(told)
    assert run.omega == pytest.approx(np.sqrt(2 * np.pi / 6 / 0.01), rel=1e-9)


def test_a_machine_that_stops_before_is_told():
    run = flywheel.transient(flywheel.load(YOKE | {"drive": {"torque": "20 - 40*phi"}}), end="30 s", rtol=1e-7)
    assert run.reason in ("stop", "stall")
    assert run.phi == pytest.approx(1.0, rel=1e-6)
    assert run.ended.endswith("it did not come to 30 s")


def test_ways_and_speeds_are_those_of_the_driver():
    with pytest.raises(SceneError, match=r"until: found a way of a driver that slides, where it turns.*90 deg"):
        flywheel.transient(flywheel.load(YOKE), end="50 mm")
    with pytest.raises(SceneError, match=r"until: found a speed of a driver that slides, where it turns.*200 rpm"):
        flywheel.transient(flywheel.load(YOKE), end="0.3 m/s")
    bodies = {"frame": {"points": {"O": [0, 0]}}, "ram": {"mass": 2.0}}
    guide = {"name": "O", "type": "slide", "between": ["frame.O", "ram.origin"]}
    ram = {"type": "linkage", "driver": "O", "bodies": bodies, "joints": [guide]}
    scene = flywheel.load({"mechanism": ram, "drive": {"force": 4}, "stroke": {"from": 0, "to": 0.1}})
    run = flywheel.transient(scene, end="50 mm")
    assert (run.reason, run.phi) == ("way", pytest.approx(0.05, rel=1e-9))
    assert run.omega == pytest.approx(np.sqrt(2 * 4 * 0.05 / 2), rel=1e-9)
    with pytest.raises(SceneError, match="a way of a driver that turns, where it slides"):
        flywheel.transient(scene, end="90 deg")


def test_what_has_no_inertia_asks_for_it():
    light = {"mechanism": {"type": "scotch-yoke", "crank": {"length": 0.5}, "yoke": {"mass": 20}}, "drive": {"torque": 1}}
    with pytest.raises(SceneError, match=r"inertia: found I\* = .* add \[\[inertia\]\]"):
        flywheel.transient(flywheel.load(light), end="1 s")
