"""Linkages of scenes: bodies, joints, couplings, driver, assembly, ports, and every fault in them."""

from __future__ import annotations

import copy
import math
import random
import re
import tomllib
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import flywheel
from flywheel import Scene, SceneError
from flywheel.reading.fields import Faults, Setting
from flywheel.reading.mechanisms import Joints, read_bodies, read_couplings, read_joints
from flywheel.reading.scenes import build_scene
from flywheel.reference import text as topic
from flywheel.scene.linkage import Coupling, Driver, Joint, Link, Linkage, Point, Side
from flywheel.scene.scene import PointPort
from tests.reading.test_toml_text import check, mutate

REST = """
[drive]
torque = "balance"
[regime]
speed = "120 rpm"
[flywheel]
irregularity = 0.04
"""
FOUR_BAR = f"""
[mechanism]
type = "linkage"
driver = "O"
start = "10 deg"
assembly = [{{ point = "coupler.C", side = "left", from = "crank.B", to = "frame.D" }}]
joints = [
  {{ name = "O", type = "pin", between = ["frame.O", "crank.origin"] }},
  {{ name = "B", type = "pin", between = ["crank.B", "coupler.B"], friction = 0.1, radius = "10 mm" }},
  {{ name = "C", type = "pin", between = ["coupler.C", "rocker.C"] }},
  {{ name = "D", type = "pin", between = ["frame.D", "rocker.origin"] }},
]
ports.tip = {{ point = "rocker.E", direction = "90 deg" }}
[mechanism.bodies]
frame.points = {{ O = [0, 0], D = ["0.4 m", 0] }}
crank = {{ points = {{ B = ["100 mm", 0] }}, mass = "2 kg", inertia = "0.01 kg m^2", com = ["5 cm", 0.01] }}
coupler = {{ points = {{ B = [0, 0], C = [0.35, 0] }}, mass = 3, guess = "60 deg" }}
rocker = {{ points = {{ C = [0.3, 0], E = [0.2, 0.1] }}, inertia = 0.1 }}
[[load]]
on = "rocker"
torque = -60
while = "v > 0"
{REST}"""

SLIDER = f"""
[mechanism]
type = "linkage"
driver = "O"
joints = [
  {{ name = "O", type = "pin", between = ["frame.O", "crank.origin"] }},
  {{ name = "B", type = "pin", between = ["crank.B", "rod.B"] }},
  {{ name = "C", type = "pin", between = ["rod.C", "ram.origin"] }},
  {{ name = "ram", type = "slide", between = ["frame.S", "ram.origin"], direction = 0, \
angle = "5 deg", guess = "0.5 m", friction = 0.05, length = "60 mm" }},
]
[mechanism.bodies]
frame.points = {{ O = [0, 0], S = [0, "-20 mm"] }}
crank = {{ points = {{ B = [0.1, 0] }} }}
rod = {{ points = {{ B = [0, 0], C = [0.4, 0] }} }}
ram = {{ mass = 3 }}
[[load]]
on = "ram"
force = -100
while = "v > 0"
{REST}"""

GEARED = f"""
[mechanism]
type = "linkage"
driver = "O"
joints = [
  {{ name = "O", type = "pin", between = ["frame.O", "crank.origin"] }},
  {{ name = "P", type = "pin", between = ["frame.D", "wheel.origin"] }},
  {{ name = "guide", type = "slide", between = ["frame.S", "rack.origin"] }},
]
couplings = [
  {{ type = "gear", between = ["O", "P"], ratio = -2, phase = "30 deg", pressure_angle = "20 deg" }},
  {{ type = "cam", between = ["P", "guide"], lift = "0.2 + 0.01*cos(phi)", contact = "rack.R", friction = 0.1 }},
]
[mechanism.bodies]
frame.points = {{ O = [0, 0], D = [0.3, 0], S = [0, 0.2] }}
crank = {{ points = {{ B = [0.1, 0] }} }}
wheel = {{ points = {{ E = [0.05, 0] }} }}
rack = {{ points = {{ R = [0, 0.02] }} }}
[[load]]
on = "guide"
force = -100
while = "v > 0"
{REST}"""


@pytest.fixture(autouse=True)
def _unbuilt(monkeypatch: pytest.MonkeyPatch) -> None:
    """Scenes are read here, not followed through their cycle."""
    monkeypatch.setattr("flywheel.reading.mechanisms.build", lambda mechanism, parameters: SimpleNamespace(ports={}))


def table(text: str) -> dict[str, Any]:
    return tomllib.loads(text)


def scene(text: str) -> Scene:
    return build_scene(table(text))


def linkage(text: str) -> Linkage:
    result = scene(text).mechanisms[0].linkage
    assert result is not None
    return result


def changed(text: str, path: str, value: Any) -> dict[str, Any]:
    """The scene with one thing put somewhere else; `...` takes it away."""
    tree = copy.deepcopy(table(text))
    at: Any = tree["mechanism"]
    *way, last = (int(key) if key.isdigit() else key for key in path.split("/"))
    for key in way:
        at = at.setdefault(key, {}) if isinstance(at, dict) else at[key]
    if value is ...:
        del at[last]
    elif isinstance(at, list) and last == len(at):
        at.append(value)
    else:
        at[last] = value
    return tree


def faults(tree: dict[str, Any]) -> dict[str, str]:
    with pytest.raises(SceneError) as caught:
        build_scene(tree)
    lines = [(fault.path, str(fault)) for fault in caught.value.faults]
    assert not any("\n" in line for _, line in lines)
    return {path: " | ".join(line for other, line in lines if other == path) for path, _ in lines}


def test_bodies():
    result = linkage(FOUR_BAR)
    assert result.names == ("frame", "crank", "coupler", "rocker")
    assert result.ground == Link("frame", (Point("origin"), Point("O"), Point("D", 0.4)))
    crank = (Point("origin"), Point("B", 0.1))
    assert result.link("crank") == Link("crank", crank, 2.0, 0.01, (0.05, 0.01))
    assert result.link("coupler").guess == pytest.approx(math.pi / 3, rel=1e-15)
    assert result.link("rocker").com == (0.0, 0.0)


def test_joints_driver_and_assembly():
    result = linkage(FOUR_BAR)
    assert result.joint("B") == Joint("B", "pin", "crank", "coupler", Point("B", 0.1), Point("B"), friction=0.1, radius=0.01)
    assert (result.driver, result.path, result.sliding) == ("O", "mechanism", False)
    assert result.start == pytest.approx(math.pi / 18, rel=1e-15)
    assert result.sides == (Side(("coupler", "C"), ("crank", "B"), ("frame", "D"), 1),)
    assert scene(FOUR_BAR).mechanisms[0].points == (PointPort("tip", "rocker", "E", math.pi / 2),)


def test_a_slide_with_everything():
    guide = linkage(SLIDER).joint("ram")
    assert guide[:4] == ("ram", "slide", "frame", "ram")
    assert guide.first_at == Point("S", 0.0, -0.02)
    assert (guide.direction, guide.guess, guide.friction, guide.length) == (0.0, 0.5, 0.05, 0.06)
    assert guide.angle == pytest.approx(math.pi / 36, rel=1e-15)


@pytest.mark.parametrize("kind", ["pin-in-slot", "fixed"])
def test_the_other_joints(kind):
    result = linkage_of(changed(SLIDER, "joints/2", {"name": "C", "type": kind, "between": ["rod.C", "ram.origin"]}))
    assert result.joint("C").kind == kind


def linkage_of(tree: dict[str, Any]) -> Linkage:
    result = build_scene(tree).mechanisms[0].linkage
    assert result is not None
    return result


@pytest.mark.parametrize(
    ("text", "on", "key"),
    [
        (FOUR_BAR, "coupler", "torque"),
        (FOUR_BAR, "rocker", "torque"),
        (FOUR_BAR, "tip", "force"),
        (SLIDER, "rod", "torque"),
        (SLIDER, "ram", "force"),
        (GEARED, "wheel", "torque"),
        (GEARED, "guide", "force"),
    ],
)
def test_where_loads_act(text, on, key):
    tree = table(text)
    tree["load"][0] = {"on": on, key: -3}
    assert build_scene(tree).loads[0].on == f"linkage.{on}"


def test_a_load_on_the_crank_acts_on_the_shaft_which_has_no_other_name():
    tree = table(FOUR_BAR)
    tree["load"][0] = {"on": "crank", "torque": "-3 N m"}
    assert build_scene(tree).loads[0].on == "crank"
    tree = table(FOUR_BAR.replace("crank", "arm"))
    tree["load"][0] = {"on": "arm", "torque": "-3 N m"}
    assert set(faults(tree)) == {"load[0].on"}


def test_gear_and_cam():
    gear, cam = linkage(GEARED).couplings
    assert gear == Coupling("O-P", "gear", "O", "P", -2.0, gear.phase, pressure_angle=math.pi / 9)
    assert gear.phase == pytest.approx(math.pi / 6, rel=1e-15)
    assert cam[:4] == ("P-guide", "cam", "P", "guide")
    assert (cam.contact, cam.friction) == (("rack", "R"), 0.1)
    assert cam.lift is not None
    assert cam.lift.period == 2 * math.pi
    jet = cam.lift.curve.jet(np.array([0.5]), np.array([0.5]), np)
    expected = 0.2 + 0.01 * math.cos(0.5), -0.01 * math.sin(0.5), -0.01 * math.cos(0.5)
    assert [float(part[0]) for part in (jet.value, jet.first, jet.second)] == pytest.approx(expected, rel=1e-14)


def test_a_lift_sees_parameters():
    tree = changed(GEARED, "couplings/1/lift", "0.2 + h*cos(phi)")
    tree["parameters"] = {"h": "10 mm"}
    lift = linkage_of(tree).couplings[1].lift
    assert lift is not None
    assert lift.curve.jet(0.0, 0.0, np).value == pytest.approx(0.21, rel=1e-15)


def test_a_lift_by_table_is_laid_end_to_end():
    lift = {"angle": [0, 45, 90, 135, 180], "value": [0, 3, 6, 3, 0], "angle_unit": "deg", "value_unit": "mm"}
    tree = changed(GEARED, "couplings/1/table", lift)
    del tree["mechanism"]["couplings"][1]["lift"]
    result = linkage_of(tree).couplings[1].lift
    assert result is not None
    angle = np.radians([45.0, 225.0, 90.0, 270.0])
    assert result.curve.jet(angle, angle, np).value == pytest.approx([0.003, 0.003, 0.006, 0.006], rel=1e-12)


def test_a_swinging_follower_has_a_lift_in_rad():
    tree = changed(GEARED, "couplings/1", {"type": "cam", "between": ["O", "P"], "lift": "0.2*sin(phi)"})
    del tree["mechanism"]["couplings"][0]
    assert linkage_of(tree).couplings[0].lift is not None


@pytest.mark.parametrize(
    ("ends", "internal", "ratio"),
    [
        (["frame.D", "wheel.origin"], None, -0.5),
        (["frame.D", "wheel.origin"], True, 0.5),
        (["wheel.origin", "frame.D"], False, 0.5),
        (["wheel.origin", "frame.D"], True, -0.5),
    ],
)
def test_teeth_make_the_ratio_whichever_way_the_pins_count(ends, internal, ratio):
    gear = {"type": "gear", "between": ["O", "P"], "teeth": [20, 40], "name": "pair"}
    tree = changed(GEARED, "couplings/0", gear if internal is None else gear | {"internal": internal})
    tree["mechanism"]["joints"][1]["between"] = ends
    result = linkage_of(tree).couplings[0]
    assert (result.name, result.ratio, result.phase) == ("pair", ratio, 0.0)


def test_a_rolling_pair():
    rolling = {"type": "rolling", "between": ["P", "guide"], "ratio": "-50 mm", "phase": "0.1 m"}
    result = linkage_of(changed(GEARED, "couplings/1", rolling)).couplings[1]
    assert result == Coupling("P-guide", "rolling", "P", "guide", -0.05, 0.1)


def on_a_stroke(**changes: Any) -> dict[str, Any]:
    """The slider-crank driven by its ram."""
    tree = table(SLIDER.replace("crank", "arm"))
    tree["mechanism"] |= {"driver": "ram", "start": "400 mm"}
    del tree["mechanism"]["joints"][3]["guess"], tree["regime"], tree["flywheel"], tree["drive"], tree["load"]
    tree["stroke"] = {"from": "0.35 m", "to": "0.45 m", "speed": "0.2 m/s"}
    return tree | changes


def test_a_driver_that_slides():
    (mechanism,) = build_scene(on_a_stroke()).mechanisms
    assert mechanism.linkage is not None
    assert mechanism.linkage.sliding
    assert mechanism.linkage.start == 0.4
    assert mechanism.stroke == (0.35, 0.45)


def test_a_driver_that_slides_needs_a_stroke_of_its_own():
    tree = on_a_stroke()
    del tree["stroke"]
    assert "from and to" in faults(tree)["stroke"]
    both = table(SLIDER)
    both["mechanism"] = [tree["mechanism"] | {"name": "a"}, table(FOUR_BAR)["mechanism"] | {"name": "b"}]
    result = faults(both)
    assert "[stroke]" in result["mechanism[0].driver"]


@pytest.mark.parametrize(
    ("path", "value", "where", "hint"),
    [
        ("driver", ..., "driver", "nothing"),
        ("driver", "Q", "driver", "joint"),
        ("driver", "o", "driver", 'did you mean "O"?'),
        ("driver", "B", "driver", "a pin of the frame"),
        ("start", "1 m", "start", "angle"),
        ("start", math.nan, "start", "finite"),
        ("bodies", ..., "bodies", "nothing"),
        ("bodies", 3, "bodies", "a table"),
        ("bodies", {}, "bodies", "no moving body"),
        ("bodies", {f"b{i}": {} for i in range(51)}, "bodies", "at most 50"),
        ("bodies/crank", 3, "bodies.crank", "a table"),
        ("bodies/crank/mas", 3, "bodies.crank.mas", 'did you mean "mass"?'),
        ("bodies/crank/mass", -3, "bodies.crank.mass", "at least 0"),
        ("bodies/crank/mass", math.inf, "bodies.crank.mass", "finite"),
        ("bodies/crank/com", 3, "bodies.crank.com", "[x, y]"),
        ("bodies/crank/com", [1, 2, 3], "bodies.crank.com", "a list of 3"),
        ("bodies/crank/com", [1, "2 kg"], "bodies.crank.com[1]", "length"),
        ("bodies/crank/points", [1, 2], "bodies.crank.points", "a table"),
        ("bodies/crank/points/B", [1, math.nan], "bodies.crank.points.B[1]", "finite"),
        ("bodies/crank/points/B", [True, 0], "bodies.crank.points.B[0]", "length"),
        ("bodies/crank/points/a.b", [0, 0], 'bodies.crank.points."a.b"', "letters"),
        ("bodies/crank/points/origin", [0, 1], "bodies.crank.points.origin", "another name"),
        ("bodies/crank/points", {f"p{i}": [0, 0] for i in range(101)}, "bodies.crank.points", "at most 100"),
        ("bodies/frame/mass", 3, "bodies.frame.mass", "known key"),
        ("bodies/a.b", {}, 'bodies."a.b"', "letters"),
        ("bodies/lever", {}, "bodies.lever", "without joints"),
        ("joints", ..., "joints", "nothing"),
        ("joints", [], "joints", "no joint"),
        ("joints", {"name": "O"}, "joints", "[[mechanism.joints]]"),
        ("joints", [{}] * 101, "joints", "at most 100"),
        ("joints/0", 3, "joints[0]", "a table"),
        ("joints/0/name", ..., "joints[0].name", "nothing"),
        ("joints/0/name", "a.b", "joints[0].name", "letters"),
        ("joints/1/name", "O", "joints[1].name", "joints[0] has this name already"),
        ("joints/1/type", "pins", "joints[1].type", 'did you mean "pin"?'),
        ("joints/1/type", ..., "joints[1].type", "one of"),
        ("joints/1/direction", 0, "joints[1].direction", "keys of a pin: name, type, between, friction, radius"),
        ("joints/1/friction", -0.1, "joints[1].friction", "at least 0"),
        ("joints/1/radius", ..., "joints[1].radius", "a radius above 0"),
        ("joints/1/between", ..., "joints[1].between", "two points"),
        ("joints/1/between", "crank.B", "joints[1].between", "two points"),
        ("joints/1/between", ["crank.B"], "joints[1].between", "a list of 1"),
        ("joints/1/between", ["crank.B", 3], "joints[1].between[1]", "a point"),
        ("joints/1/between", ["crnk.B", "coupler.B"], "joints[1].between[0]", 'did you mean "crank"?'),
        ("joints/1/between", ["crank.b", "coupler.B"], "joints[1].between[0]", 'did you mean "crank.B"?'),
        ("joints/1/between", ["crank", "coupler.B"], "joints[1].between[0]", "crank.origin"),
        ("joints/1/between", ["crank.B", "crank.origin"], "joints[1].between", "two different bodies"),
        ("joints/0/between", ["crank.origin", "frame.O"], "driver", "write the point of the frame first"),
        ("assembly", 3, "assembly", "array of tables"),
        ("assembly/0/side", "up", "assembly[0].side", "left"),
        ("assembly/0/side", ..., "assembly[0].side", "nothing"),
        ("assembly/0/point", "coupler.Q", "assembly[0].point", "a point of coupler"),
        ("assembly/0/point", "crank.B", "assembly[0]", "three different points"),
        ("ports", 3, "ports", "a table"),
        ("ports", {f"p{i}": {} for i in range(51)}, "ports", "at most 50"),
        ("ports/tip", 3, "ports.tip", "a table"),
        ("ports/tip/point", ..., "ports.tip.point", "nothing"),
        ("ports/tip/point", "rocker.Q", "ports.tip.point", "a point of rocker"),
        ("ports/tip/point", "frame.D", "ports.tip.point", "stands still"),
        ("ports/tip/direction", "3 m", "ports.tip.direction", "angle"),
        ("ports/a.b", {"point": "rocker.E"}, 'ports."a.b"', "letters"),
        ("ports/rocker", {"point": "rocker.E"}, "ports.rocker", "a body has this name already"),
        ("ports/crank", {"point": "rocker.E"}, "ports.crank", "a unique name"),
        ("couplings", 3, "couplings", "array of tables"),
        ("couplings", None, "couplings", "array of tables"),
        ("bodies", None, "bodies", "a table"),
        ("bodies/crank/points", None, "bodies.crank.points", "a table"),
        ("joints/1/between", None, "joints[1].between", "two points"),
        ("joints/1/between", ["crank.B", None], "joints[1].between[1]", "a point"),
        ("ports/tip/point", None, "ports.tip.point", "a text"),
        ("start", None, "start", "angle"),
    ],
)
def test_faults(path, value, where, hint):
    assert hint in faults(changed(FOUR_BAR, path, value))[f"mechanism.{where}"]


SHORT = {"angle": [0, 50, 90, 150, 170], "value": [0, 3, 6, 3, 0], "angle_unit": "deg", "value_unit": "mm"}


@pytest.mark.parametrize(
    ("path", "value", "where", "hint"),
    [
        ("couplings/0/type", "geer", "couplings[0].type", 'did you mean "gear"?'),
        ("couplings/0/between", ["O", "Q"], "couplings[0].between[1]", "joint"),
        ("couplings/0/between", ["O"], "couplings[0].between", "two joints"),
        ("couplings/0/between", ["O", 3], "couplings[0].between[1]", "name of a joint"),
        ("couplings/0/between", ["O", "O"], "couplings[0].between", "two different joints"),
        ("couplings/0/between", ["O", "guide"], "couplings[0].between[1]", "a pin"),
        ("joints/2/type", "fixed", "couplings[1].between[1]", "has no coordinate"),
        ("joints/2/type", "pin-in-slot", "couplings[1].between[1]", "two motions"),
        ("joints/1/between", ["rack.R", "wheel.origin"], "couplings[0].between", "carries both"),
        ("couplings/0/ratio", 0, "couplings[0].ratio", "other than 0"),
        ("couplings/0/ratio", ..., "couplings[0]", "exactly one of ratio, teeth"),
        ("couplings/0/ratio", "3 m", "couplings[0].ratio", "unit of length"),
        ("couplings/0/teeth", [20, 40], "couplings[0]", "exactly one of ratio, teeth"),
        ("couplings/0/internal", True, "couplings[0].internal", "together with a ratio"),
        ("couplings/0/pressure_angle", "90 deg", "couplings[0].pressure_angle", "0 to 89 deg"),
        ("couplings/0/pressure_angle", "-3 deg", "couplings[0].pressure_angle", "0 to 89 deg"),
        ("couplings/0/lift", "phi", "couplings[0].lift", "keys of a gear"),
        ("couplings/0/name", "O", "couplings[0].name", "a joint has this name already"),
        ("couplings/1/name", "O-P", "couplings[1].name", "another coupling has this name already"),
        ("couplings/1/contact", "wheel.E", "couplings[1].contact", "a point of the follower, rack"),
        ("couplings/1/contact", "rack.Q", "couplings[1].contact", "a point of rack"),
        ("couplings/1/friction", -1, "couplings[1].friction", "at least 0"),
        ("couplings/1/lift", ..., "couplings[1]", "exactly one of lift, table"),
        ("couplings/1/lift", "3 mm", "couplings[1].lift", "an expression of phi"),
        ("couplings/1/lift", "x", "couplings[1].lift", "phi and parameters"),
        ("couplings/1/lift", "0.01*phi", "couplings[1].lift", "comes back"),
        ("couplings/1/lift", "0.01 if phi < 2 else 0", "couplings[1].lift", "does not jump"),
        ("couplings/1/lift", "0.01*abs(sin(phi))", "couplings[1].lift", "round the corner"),
        ("couplings/1/lift", "sqrt(cos(phi))", "couplings[1].lift", "not finite"),
        ("couplings/0", {"type": "cam", "between": ["O", "P"], "lift": "0.2*phi"}, "couplings[0].lift", "gains a constant"),
        ("couplings/1", {"type": "cam", "between": ["P", "guide"], "table": SHORT}, "couplings[1].table", "360 deg"),
    ],
)
def test_faults_of_couplings(path, value, where, hint):
    assert hint in faults(changed(GEARED, path, value))[f"mechanism.{where}"]


GEAR, ROLLING = {"type": "gear", "between": ["O", "P"]}, {"type": "rolling", "between": ["P", "guide"]}


@pytest.mark.parametrize(
    ("pair", "where", "hint"),
    [
        (GEAR | {"teeth": 20}, "teeth", "two numbers of teeth"),
        (GEAR | {"teeth": [20, 40.5]}, "teeth[1]", "a whole number"),
        (GEAR | {"teeth": [0, 40]}, "teeth[0]", "a whole number"),
        (GEAR | {"teeth": [40, 40], "internal": True}, "teeth", "more on the outer one"),
        (GEAR | {"teeth": [20, 40], "internal": "yes"}, "internal", "true or false"),
        (ROLLING, "ratio", "per rad"),
        (ROLLING | {"ratio": 0}, "ratio", "other than 0"),
        (ROLLING | {"ratio": "3 deg"}, "ratio", "length"),
        (ROLLING | {"ratio": 0.1, "phase": "3 deg"}, "phase", "length"),
        (ROLLING | {"ratio": 0.1, "teeth": [3, 4]}, "teeth", "keys of a rolling"),
        (ROLLING | {"ratio": 0.1, "between": ["guide", "P"]}, "between[0]", "a pin"),
    ],
)
def test_faults_of_gears_and_rolling_pairs(pair, where, hint):
    place = 0 if pair["type"] == "gear" else 1
    result = faults(changed(GEARED, f"couplings/{place}", pair))
    assert hint in result[f"mechanism.couplings[{place}].{where}"]


@pytest.mark.parametrize(
    ("path", "value", "expected"),
    [
        ("joints/2/type", "slider", {"mechanism.joints[2].type"}),
        ("joints/2", 5, {"mechanism.joints[2]"}),
        ("joints", {"O": {}}, {"mechanism.joints"}),
        ("joints", [], {"mechanism.joints"}),
        ("bodies/rack", {"mas": 1}, {"mechanism.bodies.rack.mas", "mechanism.couplings[1].contact"}),
    ],
)
def test_a_load_on_a_joint_with_a_fault_is_no_fault(path, value, expected):
    assert set(faults(changed(GEARED, path, value))) == expected


def test_loads_are_held_against_the_bodies_and_joints_that_are_known():
    assert set(faults(changed(FOUR_BAR, "bodies", []))) == {"mechanism.bodies"}
    tree = table(GEARED) | {"load": [{"on": "gide", "force": 1}]}
    assert 'did you mean "linkage.guide"' in faults(tree)["load[0].on"]
    ends = {f"mechanism.joints[{i}].between[0]" for i in range(3)}
    assert set(faults(changed(GEARED, "bodies/frame", ...))) == ends


def test_a_slide_may_be_called_as_its_body_if_that_cannot_turn():
    assert scene(SLIDER).loads[0].on == "linkage.ram"
    tree = changed(SLIDER, "joints/3/type", "pin-in-slot")
    for key in ("angle", "length"):
        del tree["mechanism"]["joints"][3][key]
    assert "a body has this name already" in faults(tree)["mechanism.joints[3].name"]


def test_only_the_driven_body_may_be_called_crank():
    swapped = FOUR_BAR.replace("crank", "arm").replace("rocker", "crank")
    result = faults(table(swapped))
    assert "another name" in result["mechanism.bodies.crank"]


def test_a_driver_has_no_guess():
    tree = on_a_stroke()
    tree["mechanism"]["joints"][3]["guess"] = 0.4
    assert "it stands at start" in faults(tree)["mechanism.driver"]


def test_a_driver_is_a_pin_or_a_slide():
    tree = changed(SLIDER, "joints/3/type", "pin-in-slot")
    for key in ("angle", "length"):
        del tree["mechanism"]["joints"][3][key]
    tree["mechanism"]["joints"][3]["name"] = "slot"
    tree["mechanism"]["driver"] = "slot"
    tree["load"] = []
    assert "a pin or a slide" in faults(tree)["mechanism.driver"]


def test_everything_at_once_and_nothing_that_only_follows():
    tree = changed(FOUR_BAR, "joints/1/between", ["crank.Q", "lever.B"])
    joints = tree["mechanism"]["joints"]
    del joints[0]["name"]
    joints[2]["friction"] = 0.1
    tree["mechanism"]["bodies"]["rocker"]["mas"] = 3
    tree["load"][0]["on"] = "rockr"
    assert set(faults(tree)) == {
        "mechanism.joints[0].name",
        "mechanism.joints[1].between[0]",
        "mechanism.joints[1].between[1]",
        "mechanism.joints[2].radius",
        "mechanism.bodies.rocker.mas",
        "load[0].on",
    }


def test_an_array_of_linkages():
    tree = table(FOUR_BAR)
    other = table(SLIDER)["mechanism"] | {"name": "pump"}
    tree["mechanism"] = [tree["mechanism"] | {"name": "press"}, other]
    del other["joints"][2]["name"]
    assert set(faults(tree)) == {"mechanism[1].joints[2].name"}


def test_numpy_arrays_will_do_for_points():
    tree = changed(FOUR_BAR, "bodies/crank/points/B", np.array([0.1, 0.0]))
    assert linkage_of(tree).link("crank").points[1] == Point("B", 0.1)


BLOCKS = re.findall(r"```(\w*)\n(.*?)```", topic("linkage"), re.DOTALL)
FRAGMENTS = [tomllib.loads(block) for kind, block in BLOCKS if not kind]


def test_the_reference_has_an_example_of_every_joint_and_coupling():
    tables = [fragment.get("mechanism", {}) for fragment in FRAGMENTS]
    assert {joint["type"] for item in tables for joint in item.get("joints", [])} == {"pin", "slide", "pin-in-slot", "fixed"}
    assert {pair["type"] for item in tables for pair in item.get("couplings", [])} == {"gear", "rolling", "cam"}
    assert {key for item in tables for key in item} == {"bodies", "joints", "couplings", "ports"}


@pytest.mark.parametrize("fragment", [item["mechanism"] for item in FRAGMENTS if "mechanism" in item])
def test_examples_of_the_reference_are_free_of_faults(fragment):
    faults = Faults()
    points = [point for joint in fragment.get("joints", []) for point in joint["between"]] + ["ram.roller", "lever.end"]
    bodies: dict[str, Any] = {}
    for body, _, name in (point.partition(".") for point in points):
        bodies.setdefault(body, {}).setdefault("points", {})[name] = [0, 0]
    reference = read_bodies(bodies | fragment.get("bodies", {}), "bodies", faults)
    if "joints" in fragment:
        read_joints(fragment["joints"], "joints", reference, faults)
    kinds = {"O": "pin", "P": "pin", "Q": "pin", "lever": "pin", "pinion": "pin", "ram": "slide", "rack": "slide"}
    named = {name: Joint(name, kind, "frame", name, Point("O"), Point("O")) for name, kind in kinds.items()}
    setting = Setting(1.0, {"crank": 1.0}, {}, frozenset(), None, faults)
    couplings = read_couplings(fragment.get("couplings", ()), "couplings", reference, Joints(named, {}, True), setting)
    assert [str(fault) for fault in faults] == []
    assert len(couplings) == len(fragment.get("couplings", []))


@pytest.mark.parametrize("text", [FOUR_BAR, SLIDER, GEARED], ids=["four_bar", "slider", "geared"])
def test_mutated_linkages_are_read_or_refused_with_faults(text):
    rng = random.Random(4)
    for number in range(40):
        tree = table(text)
        for _ in range(rng.choice((1, 1, 2, 4))):
            mutate(tree, rng)
        check(build_scene, tree, number)


def test_a_fixed_body_of_another_name() -> None:
    faults = Faults()
    read_bodies({"ground": {"points": {"O": [0, 0]}}, "crank": {}}, "mechanism.bodies", faults)
    assert str(faults[0]).startswith("mechanism.bodies.frame: found nothing, expected the fixed body's points")


# Linkages of several drivers

TWO_MOTORS = """
title = "Five-bar with two motors"
parameters = { arm = "250 mm" }
[mechanism]
type = "linkage"
driver = ["left", "right"]
start = ["115 deg", "65 deg"]
assembly = [{ point = "left_rod.E", side = "left", from = "one.E", to = "two.E" }]
joints = [
  { name = "left", type = "pin", between = ["frame.O", "one.origin"] },
  { name = "right", type = "pin", between = ["frame.D", "two.origin"] },
  { name = "A", type = "pin", between = ["one.E", "left_rod.origin"] },
  { name = "B", type = "pin", between = ["two.E", "right_rod.origin"] },
  { name = "P", type = "pin", between = ["left_rod.E", "right_rod.E"] },
]
[mechanism.bodies]
frame.points = { O = [0, 0], D = ["0.3 m", 0] }
one = { points = { E = [0.25, 0] }, mass = 1 }
two = { points = { E = [0.25, 0] }, mass = 1 }
left_rod = { points = { E = [0.4, 0] }, mass = 1 }
right_rod = { points = { E = [0.4, 0] }, mass = 1 }
"""


def test_several_drivers_are_read_from_text_file_and_mapping(tmp_path):
    file = tmp_path / "five_bar.toml"
    file.write_text(TWO_MOTORS, encoding="utf-8")
    read = [flywheel.load_linkage(source) for source in (TWO_MOTORS, file, str(file), tomllib.loads(TWO_MOTORS))]
    assert read[0] == read[1] == read[2] == read[3]
    assert read[0].drivers == (Driver("left", math.radians(115)), Driver("right", math.radians(65)))
    place = flywheel.freedoms.positions(read[0], [math.radians(115), math.radians(65)])
    assert place.by("left").point("left_rod", (0.4, 0.0)).value[1, 0] > 0.3


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ('["left", "right"]', '["left", "rigt"]', 'mechanism.driver[1] (line 6): found joint "rigt"'),
        ('["left", "right"]', '["left", "left"]', 'driver[1] (line 6): found "left" twice, expected another joint'),
        ('["left", "right"]', "[]", "driver (line 6): found a list, expected names of pins or slides"),
        ('["left", "right"]', '["left"]', "start (line 7): found a list, expected a list of 1"),
        ('"65 deg"', '"65 mm"', "start[1] (line 7): found "),
        ('title = "Five-bar with two motors"', "gravity = {}", "expected none; the calls of flywheel.freedoms take gravity"),
        ('title = "Five-bar with two motors"', "gravty = {}", 'gravty (line 2): found key "gravty"'),
        ('type = "linkage"', 'type = "four-bar"', "expected linkage"),
        ('"250 mm"', '"balance"', "parameters.arm"),
    ],
)
def test_faults_of_several_drivers_are_told_in_a_line_each(old, new, text):
    assert old in TWO_MOTORS
    with pytest.raises(SceneError) as refused:
        flywheel.load_linkage(TWO_MOTORS.replace(old, new))
    assert text in str(refused.value)
    assert str(refused.value).count("\n") <= 0 + ("rigt" in new)


def test_scenes_have_one_driver():
    with pytest.raises(SceneError) as refused:
        flywheel.load(TWO_MOTORS)
    text = "mechanism.driver (line 6): found 2 drivers (left, right), expected the name of one, of one degree of freedom"
    assert str(refused.value).startswith(text)
    assert "\n" not in str(refused.value)


@pytest.mark.slow
def test_the_page_on_freedoms_runs_as_it_stands(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "five_bar.toml").write_text(TWO_MOTORS, encoding="utf-8")
    names: dict[str, Any] = {}
    for block in re.findall(r"```python\n(.*?)```", topic("freedoms"), re.DOTALL):
        exec(compile(block, "freedoms", "exec"), names)
    assert names["run"].error < 1e-9
