"""`[stroke]` in a scene: what it becomes, and every fault in it and beside it."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import flywheel
from flywheel.reading.mechanisms import driver_slides
from flywheel.reading.scenes import load
from tests import scenes

CLAMP = {
    "type": "toggle-clamp",
    "frame": {"height": 0.14},
    "bell_crank": {"drive_length": 0.16763, "clamp_length": 0.22, "angle": 0.30199},
    "coupler": {"length": 0.095},
    "rod": {"length": 0.26},
    "platen": {"mass": 298},
}
STROKE = {"from": "-60 mm", "to": "190 mm", "speed": "0.3 m/s"}
SLIDE = {"name": "joint", "type": "slide", "between": ["frame.O", "body.P"]}
PIN = {"name": "joint", "type": "pin", "between": ["frame.O", "body.P"]}


def scene(**changes):
    return {"mechanism": CLAMP, "stroke": STROKE} | changes


def linkage(joint):
    """A body on a joint of the frame, both points away from the origins."""
    bodies = {"frame": {"points": {"O": [0.1, 0]}}, "body": {"mass": 2.0, "inertia": 0.1, "points": {"P": [0.2, 0]}}}
    return {"type": "linkage", "driver": "joint", "bodies": bodies, "joints": [joint]}


def faults(raw):
    with pytest.raises(flywheel.SceneError) as error:
        load(raw)
    return [str(fault) for fault in error.value.faults]


# -- what it becomes -------------------------------------------------------------------------------------------------


ODD = np.array([1.0, 2.0])  # in a scene from Python; its comparisons are not true or false


@pytest.mark.parametrize(
    ("change", "path", "expected"),
    [
        ({"joints": [SLIDE | {"type": ODD}]}, "mechanism.joints[0].type", 'one of "pin", "slide"'),
        ({"joints": [SLIDE | {"name": ODD}]}, "mechanism.joints[0].name", "a text"),
        ({"driver": ODD}, "mechanism.driver", "a text"),
        ({"type": ODD}, "mechanism.type", "one of scotch-yoke"),
    ],
)
def test_an_array_instead_of_a_text_is_a_fault(change, path, expected):
    (fault,) = faults({"mechanism": linkage(SLIDE) | change, "stroke": STROKE})
    assert fault.startswith(f"{path}: found a value of type ndarray, expected {expected}")


def test_a_stroke_stands_for_regime_and_flywheel():
    found = load(scene())
    assert found.stroke == (-0.06, 0.19, 0.3, 0.0, True)
    assert (found.reduction_element, found.shafts, found.flywheel_on) == ("slide", {"slide": 1.0}, "slide")
    assert (found.speed, found.irregularity, found.inertia, found.unknown) == (0.3, None, None, None)
    assert_allclose(found.cycle, 0.25)
    (mechanism,) = found.mechanisms
    assert (mechanism.shaft, mechanism.phase, mechanism.stroke) == ("slide", -0.06, (-0.06, 0.19))


def test_a_driver_that_turns_has_angles():
    stroke = {"from": "-30 deg", "to": "60 deg", "speed": "10 rpm", "acceleration": "2 rad/s^2"}
    found = load({"mechanism": [linkage(PIN)], "stroke": stroke})
    assert_allclose(found.stroke[:4], (-np.pi / 6, np.pi / 3, np.pi / 3, 2))
    assert (found.reduction_element, found.mechanisms[0].shaft) == ("crank", "crank")


def test_the_drive_pushes_a_slide_and_turns_a_crank():
    pushed = load(scene(drive={"force": "2 kN"}))
    turned = load({"mechanism": linkage(PIN), "drive": {"torque": 3}, "stroke": {"from": 0, "to": 1, "speed": 1}})
    assert (pushed.drive.on, pushed.drive.law, pushed.drive.once) == ("slide", 2000.0, True)
    assert (turned.drive.on, turned.drive.law) == ("crank", 3.0)


def test_a_window_of_the_whole_stroke_is_always():
    loads = [{"on": "platen", "force": 1, "from": "-60 mm", "to": "190 mm"}]
    (whole,) = load(scene(load=loads)).loads
    (part,) = load(scene(load=[loads[0] | {"to": "100 mm"}])).loads
    assert (whole.start, whole.end) == (None, None)
    assert (part.start, part.end) == (-0.06, 0.1)


@pytest.mark.parametrize(
    ("mechanism", "slides"),
    [
        (CLAMP, True),
        ([CLAMP], True),
        ([CLAMP, CLAMP], None),
        (linkage(SLIDE), True),
        (linkage(PIN), False),
        (linkage(SLIDE) | {"driver": "other"}, None),
        (linkage(SLIDE | {"type": "fixed"}), None),
        ({"type": "four-bar"}, False),
        (None, None),
        ([3], None),
    ],
)
def test_whether_the_driver_slides(mechanism, slides):
    assert driver_slides({"mechanism": mechanism}) is slides


# -- faults ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "start"),
    [
        (
            {"from": None},
            'stroke.from: found nothing, expected a length such as "250 mm" or a bare number in m, or an angle such as',
        ),
        ({"to": "30 deg"}, 'stroke.to: found "30 deg", expected a length'),
        ({"to": "-60 mm"}, "stroke.to: found -0.06 m, expected more than from, which is -0.06 m; a return stroke"),
        ({"to": "-90 mm"}, "stroke.to: found -0.09 m, expected more than from"),
        ({"speed": "3 rpm"}, 'stroke.speed: found "3 rpm", expected a velocity'),
        ({"speed": -1j}, "stroke.speed: found a value of type complex"),
        ({"acceleration": "3 m/s"}, 'stroke.acceleration: found "3 m/s", expected an acceleration'),
        (
            {"accelration": 1},
            'stroke.accelration: found key "accelration", expected a known key; did you mean "acceleration"',
        ),
        ({"to": float("nan")}, "stroke.to: found nan"),
    ],
)
def test_a_stroke_that_cannot_be_read(changes, start):
    stroke = {key: value for key, value in (STROKE | changes).items() if value is not None}
    (line,) = faults(scene(stroke=stroke))
    assert line.startswith(start)


@pytest.mark.parametrize(
    ("changes", "start"),
    [
        ({"regime": {"speed": 1}}, "regime: found regime beside [stroke], expected none; a one-way stroke has no cycle"),
        ({"flywheel": {"inertia": 1}}, "flywheel: found flywheel beside [stroke]"),
        ({"stroke": 3}, "stroke: found 3, expected a table"),
        (
            {"mechanism": [CLAMP | {"name": "a"}, CLAMP | {"name": "b"}]},
            "mechanism: found 2 mechanisms, expected one mechanism",
        ),
        ({"mechanism": CLAMP | {"phase": "10 deg"}}, "mechanism.phase: found phase beside [stroke]"),
        ({"shafts": {"motor": {"ratio": 2}}}, "shafts.motor: found a shaft beside a driver that slides"),
        ({"drive": {"torque": 3}}, 'drive.torque: found a torque on "slide", which slides, expected a force'),
        ({"drive": {}}, "drive.force: found nothing, expected a quantity or an expression in N"),
        ({"drive": {"force": "balance"}}, 'drive.force: found "balance", expected a value; a one-way stroke has no cycle'),
        ({"drive": {"on": "crank", "force": 1}}, 'drive.on: found "crank", expected a shaft'),
        ({"load": [{"on": "slide", "torque": 1}]}, 'load[0].torque: found a torque on "slide", which translates'),
        ({"load": [{"on": "slide", "force": 1, "every": 0.1}]}, "load[0].every: found every beside [stroke]"),
        (
            {"load": [{"on": "slide", "force": 1, "from": "0 deg", "to": 0.1}]},
            'load[0].from: found "0 deg", expected a length',
        ),
        (
            {"load": [{"on": "slide", "force": 1, "from": 0, "to": 0.2}]},
            "load[0].to: found 0.2 m, expected a place from -0.06",
        ),
        ({"load": [{"on": "slide", "force": 1, "from": 0.1, "to": 0}]}, "load[0].to: found 0 m, expected a place behind"),
        ({"load": [{"on": "slide", "force": 1, "from": 0}]}, "load[0].to: found nothing"),
        (
            {"load": [{"on": "slide", "table": {"angle": [0, 0.1], "value": [1, 2]}}]},
            "load[0].table: found values from 0 to 0.1, expected values from -0.06 to 0.19",
        ),
        (
            {"load": [{"on": "slide", "table": {"angle": [0, 1], "angle_unit": "deg", "value": [1, 2]}}]},
            'load[0].table.angle_unit: found "deg"',
        ),
    ],
)
def test_what_cannot_stand_beside_a_stroke(changes, start):
    (line,) = faults(scene(**changes))
    assert line.startswith(start)


def test_a_law_has_no_stroke():
    law = {"type": "law", "outputs": {"ram": {"x": "sin(phi)"}}}
    (line,) = faults({"mechanism": law, "stroke": {"from": 0, "to": 1, "speed": 1}})
    assert line.startswith('mechanism.type: found "law" beside [stroke], expected "scotch-yoke" or "slider-crank" or ')


BODY = {"mass": 1.3, "inertia": 0.02, "com": 0.05, "com_angle": 0.3}
BARS = {
    "type": "four-bar",
    "ground": {"length": 0.2},
    "coupler": {"length": 0.1, **BODY},
    "rocker": {"length": 0.12, **BODY},
}
SLIDER = {"type": "slider-crank", "rod": {"length": 0.2, **BODY}, "slider": {"mass": 2.0, "offset": 0.05}}
SHAPER = {"type": "crank-shaper", "frame": {"length": 0.2}, "rocker": {"length": 0.5, **BODY}, "ram": {"mass": 3}}


@pytest.mark.parametrize(
    ("mechanism", "start", "end"),
    [
        (SLIDER | {"crank": {"length": 0.3, **BODY}}, -25, 30),
        (SLIDER | {"crank": {"length": 0.3, **BODY}}, 360 + 180, 360 + 200),
        (BARS | {"crank": {"length": 0.15, **BODY}}, -70, 70),
        (BARS | {"crank": {"length": 0.15, **BODY}, "assembly": "crossed"}, 300, 420),
        (SHAPER | {"crank": {"length": 0.2, **BODY}}, 190, 530),
        (SHAPER | {"crank": {"length": 0.1, **BODY}}, -100, 500),
    ],
)
def test_named_mechanisms_move_between_the_angles_where_they_lock(mechanism, start, end):
    """Virtual power of the closed form against d'Alembert on the positions that Newton finds: T = ½ dI*/dphi omega² - M*."""
    scene = load({"mechanism": mechanism, "stroke": {"from": f"{start} deg", "to": f"{end} deg"}, "gravity": {}})
    q = np.radians(np.linspace(start + 0.01, end - 0.01, 9))
    reduced = flywheel.reduce(scene, q)
    (found,) = flywheel.joint_forces(scene, q, speed=3.0).mechanisms.values()
    wanted = 4.5 * reduced.slope - reduced.moment
    np.testing.assert_allclose(found.action, wanted, rtol=0, atol=1e-12 * np.abs(wanted).max())


@pytest.mark.parametrize(
    ("mechanism", "start", "end", "told"),
    [
        (BARS, 20, 100, "20 to 100 deg, where the crank locks at 76.4084 deg, expected a stroke within -76.4084 to 76.4084"),
        (BARS, 100, 200, "100 to 200 deg, where the bars do not meet, expected a stroke within -76.4084 to 76.4084 deg"),
        (
            SHAPER | {"crank": {"length": 0.2}},
            0,
            200,
            "where the crank locks at 180 deg, expected a stroke within -180 to 180",
        ),
    ],
)
def test_a_stroke_beyond_a_lock_is_told_how_far_it_may_go(mechanism, start, end, told):
    crank = {"crank": {"length": 0.15}}
    (line,) = faults({"mechanism": crank | mechanism, "stroke": {"from": f"{start} deg", "to": f"{end} deg"}})
    assert line.startswith("stroke: found ")
    assert told in line


def test_a_crank_that_cannot_turn_is_told_of_strokes():
    (line,) = faults({"mechanism": BARS | {"crank": {"length": 0.15}}})
    assert line.startswith("mechanism.rocker.length: found 0.12 m")
    assert "locks at 76.4084 and 283.592 deg; between them it moves, with [stroke] from and to" in line


@pytest.mark.parametrize("mechanism", [CLAMP, linkage(SLIDE)])
def test_a_driver_that_slides_needs_a_stroke(mechanism):
    (line,) = faults({"mechanism": mechanism, "regime": {"speed": 1}, "flywheel": {"inertia": 1}})
    assert line.startswith("stroke: found nothing, expected a table with from and to, between which")


TURNING = {"mechanism": linkage(PIN), "stroke": {"from": 0, "to": 1, "speed": 1}}
TWISTING = {"shafts": {"motor": {"ratio": 2, "stiffness": 100}}}
FAR = {"from": 0, "to": "2000 rev", "speed": 1}
BALANCE = {"parameters": {"F": "balance"}, "load": [{"on": "slide", "force": "F"}]}


@pytest.mark.parametrize(
    ("raw", "start"),
    [
        (scene(**BALANCE), 'parameters.F: found "balance", expected a value'),
        (TURNING | TWISTING, "shafts.motor: found a compliant shaft beside [stroke]"),
        (scenes.rotor(drive={"force": 3}), 'drive.force: found a force on "crank", which turns, expected a torque'),
        (
            TURNING | {"stroke": {"from": 0, "to": "2000 rev", "speed": 1}},
            "stroke.to: found 2000 turns, expected at most 1000",
        ),
        ({"stroke": STROKE}, "mechanism: found nothing, expected one mechanism"),
        ({"areas": {"values": [1, -1]}, "stroke": STROKE}, "areas: found areas beside [stroke]"),
    ],
)
def test_what_does_not_go_with_a_stroke(raw, start):
    lines = faults(raw)
    assert any(line.startswith(start) for line in lines)
    assert len(lines) == 1 or "mechanism" not in raw


def test_every_fault_is_reported_at_once():
    lines = faults(scene(stroke={"from": 0}, regime={}, load=[{"on": "plate", "force": 1}], gravity={"h": 1}))
    paths = {line.partition(":")[0] for line in lines}
    assert paths == {"stroke.to", "regime", "load[0].on", "gravity.h"}
