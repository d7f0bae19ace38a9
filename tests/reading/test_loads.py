"""Loads, springs and inertias: where they act, when, and what is refused."""

import math

import pytest

from flywheel.numerics.expressions import Expression
from flywheel.numerics.faults import SceneError
from flywheel.reading.scenes import parse_scene
from flywheel.scene.scene import Damper, Inertia, Load, Scene, Spring

TURN = 2 * math.pi
PRESS = """
[mechanism]
type = "slider-crank"
name = "press"
crank.length = 0.1
rod.length = 0.4
[regime]
speed = "300 rpm"
[flywheel]
irregularity = 0.02
"""


def scene_with(text: str, base: str = PRESS, **kwargs) -> Scene:
    return parse_scene(base + text, **kwargs)


def load_with(keys: str, base: str = PRESS) -> Load:
    (load,) = scene_with(f"\n[[load]]\n{keys}", base).loads
    return load


def fault_of(text: str, base: str = PRESS) -> dict[str, str]:
    with pytest.raises(SceneError) as caught:
        parse_scene(base + text)
    return {fault.path: str(fault) for fault in caught.value.faults}


def load_fault(keys: str, base: str = PRESS) -> dict[str, str]:
    return fault_of(f"\n[[load]]\n{keys}", base)


@pytest.mark.parametrize("on", ["slider", "press.slider"])
def test_places_get_their_full_name(on):
    assert load_with(f"on = '{on}'\nforce = 3") == Load("press.slider", 3.0, TURN, path="load[0]")


@pytest.mark.parametrize("value", ["-5 kN", "-5000", "-5e3 N", "-5000 N "])
def test_a_text_that_is_a_quantity_is_one(value):
    assert load_with(f"on = 'slider'\nforce = '{value}'").law == -5000.0


@pytest.mark.parametrize(
    "text", ["-5e3*sin(phi)", "5 if phi < pi else 0", "5*(x > 0)", "3 - 2", "5 / 2", "-300*sign(v)", "2*(v < 0)", "5."]
)
def test_any_other_text_is_an_expression(text):
    law = load_with(f"on = 'slider'\nforce = '{text}'").law
    assert isinstance(law, Expression) or law == 5.0


@pytest.mark.parametrize(
    ("keys", "path", "hint"),
    [
        ("on = 'slider'\nforce = '5 kN*sin(phi)'", "load[0].force", "without units"),
        ("on = 'slider'\nforce = '5 kg'", "load[0].force", "kgf"),
        ("on = 'slider'\nforce = '5 N m'", "load[0].force", "torque"),
        ("on = 'slider'\nforce = '1,5 kN'", "load[0].force", "write 1.5"),
        ("on = 'slider'\nforce = 'fi'", "load[0].force", "phi"),
        ("on = 'slider'\nforce = 'Omega'", "load[0].force", "omega"),
        ("on = 'slider'\nforce = '__import__(\"os\")'", "load[0].force", ""),
        ("on = 'slider'\nforce = true", "load[0].force", ""),
        ("on = 'slider'\nforce = nan", "load[0].force", "finite"),
        ("on = 'slider'\ntorque = 3", "load[0].torque", "translates"),
        ("on = 'rod'\nforce = 3", "load[0].force", "rotates"),
        ("on = 'crank'\nforce = 3", "load[0].force", "rotates"),
        ("on = 'press'\nforce = 3", "load[0].on", "press.rod"),
        ("on = 3\nforce = 3", "load[0].on", ""),
        ("force = 3", "load[0].on", "nothing"),
        ("on = 'slider'", "load[0]", "exactly one"),
        ("on = 'slider'\nforce = 3\ntable = {}", "load[0]", "exactly one"),
        ("on = 'slider'\nforce = 3\nfrom = 1", "load[0].to", "nothing"),
        ("on = 'slider'\nforce = 3\nto = 1", "load[0].from", "nothing"),
        ("on = 'slider'\nforce = 3\nfrom = 1\nto = 1", "load[0].to", "begins"),
        ("on = 'slider'\nforce = 3\nfrom = '-90 deg'\nto = '270 deg'\nevery = '180 deg'", "load[0].to", "180"),
        ("on = 'slider'\nforce = 3\nfrom = 0\nto = 7", "load[0].to", 'write "7 deg"'),
        ("on = 'slider'\nforce = 3\nfrom = '-180 deg'\nto = '270 deg'", "load[0].to", "450 deg"),
        ("on = 'slider'\nforce = 3\nfrom = '30 deg'\nto = '-330 deg'", "load[0].to", "begins"),
        ("on = 'slider'\nforce = 3\nwhile = 'v >= 0'", "load[0].while", '"v > 0"'),
        ("on = 'slider'\nforce = 3\nwhile = 1", "load[0].while", ""),
        ("on = 'slider'\nforce = 3\nevery = '100 deg'", "load[0].every", "divides"),
        ("on = 'slider'\nforce = 3\nevery = '720 deg'", "load[0].every", "divides"),
        ("on = 'slider'\nforce = 3\nevery = 0", "load[0].every", "above 0"),
        ("on = 'slider'\nforce = 3\nevery = 1e-9", "load[0].every", "1000 times"),
        ("on = 'slider'\nforce = 3\nuntil = 3", "load[0].until", "known key"),
    ],
)
def test_faulty_loads(keys, path, hint):
    assert hint in load_fault(keys)[path]


@pytest.mark.parametrize(
    ("text", "speed", "time"),
    [("v*3", True, False), ("-omega*abs(omega)", True, False), ("t", False, True), ("v*sin(t)", True, True)]
    + [(text, False, False) for text in ("sign(v)", "3*(v > 0)", "2 if v < 0 else 1", "x*sin(phi)")],
)
def test_only_the_sign_of_a_velocity_follows_from_the_position(text, speed, time):
    law = load_with(f"on = 'slider'\nforce = '{text}'").law
    assert isinstance(law, Expression)
    assert (law.uses_speed, law.uses_time) == (speed, time)


def test_the_second_load_has_its_own_index():
    keys = "on = 'slider'\nforce = 3\n[[load]]\non = 'slider'\nforce = 3\nfrom = 'ten'\nto = 1"
    assert list(load_fault(keys)) == ["load[1].from"]


@pytest.mark.parametrize(
    ("window", "expected"),
    [
        ("from = '30 deg'\nto = '120 deg'", (30, 120)),
        ("from = '300 deg'\nto = '60 deg'", (300, 60)),
        ("from = '-60 deg'\nto = '60 deg'", (300, 60)),
        ("from = '360 deg'\nto = '60 deg'", (0, 60)),
        ("from = '300 deg'\nto = 0", (300, 360)),
        ("from = '270 deg'\nto = '-180 deg'", (270, 180)),
        ("from = '30 deg'\nto = '60 deg'\nevery = '120 deg'", (30, 60)),
        ("from = '90 deg'\nto = '90.01 deg'", (90, 90.01)),
    ],
)
def test_windows_are_brought_into_one_period(window, expected):
    load = load_with(f"on = 'slider'\nforce = 3\n{window}")
    assert (math.degrees(load.start), math.degrees(load.end)) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    "window",
    ["", "from = 0\nto = '360 deg'", "from = '-180 deg'\nto = '180 deg'", "from = 0\nto = '90 deg'\nevery = '90 deg'"],
)
def test_a_window_of_a_whole_period_is_always(window):
    load = load_with(f"on = 'slider'\nforce = 3\n{window}")
    assert (load.start, load.end) == (None, None)


@pytest.mark.parametrize(("text", "sense"), [("v > 0", 1), ("v<0", -1), (" v  >0 ", 1)])
def test_while(text, sense):
    assert load_with(f"on = 'slider'\nforce = 3\nwhile = '{text}'").sense == sense


def test_every_is_put_exactly_onto_a_fraction_of_the_travel():
    assert load_with("on = 'slider'\nforce = 3\nevery = 2.0943951024").every == TURN / 3


SHAFT = """
[shafts]
side.ratio = {ratio}
[mechanism]
type = "scotch-yoke"
shaft = "side"
crank.length = 0.1
[regime]
speed = 1
cycle = "{cycle} deg"
[flywheel]
inertia = 1
"""


@pytest.mark.parametrize(
    ("ratio", "cycle", "every"),
    [(1, 720, 720), (2, 360, 360), (3, 720, 720), (0.5, 720, 360), (0.25, 1440, 360), (0.3333333333, 1080, 360)],
)
def test_the_default_period_on_a_port(ratio, cycle, every):
    load = load_with("on = 'yoke'\nforce = 3", SHAFT.format(ratio=ratio, cycle=cycle))
    assert math.degrees(load.every) == pytest.approx(every, rel=1e-14)


def test_a_ratio_that_fits_neither_way_needs_its_own_period():
    base = SHAFT.format(ratio=1.5, cycle=720)
    assert "divides the 1080 deg" in load_fault("on = 'yoke'\nforce = 3", base)["load[0].every"]
    assert load_with("on = 'yoke'\nforce = 3\nevery = '1080 deg'", base).every == 3 * TURN
    assert load_with("on = 'side'\ntorque = 3", base).every == 2 * TURN


def test_several_mechanisms_and_bare_names():
    base = """
[[mechanism]]
type = "slider-crank"
name = "left"
crank.length = 0.1
rod.length = 0.4
[[mechanism]]
type = "slider-crank"
name = "right"
phase = "180 deg"
crank.length = 0.1
rod.length = 0.4
[[mechanism]]
type = "scotch-yoke"
name = "pump"
crank.length = 0.1
[regime]
speed = 1
[flywheel]
inertia = 1
"""
    assert load_with("on = 'yoke'\nforce = 3", base).on == "pump.yoke"
    assert load_with("on = 'right.slider'\nforce = 3", base).on == "right.slider"
    message = load_fault("on = 'slider'\nforce = 3", base)["load[0].on"]
    assert "left.slider" in message
    assert "right.slider" in message


def test_a_name_that_is_a_shaft_and_a_port_is_ambiguous():
    assert "press.rod" in load_fault("on = 'rod'\ntorque = 3\n[shafts]\nrod.ratio = 2")["load[0].on"]


def test_a_mechanism_of_unknown_type_hides_its_ports():
    base = PRESS.replace("slider-crank", "slidercrank")
    found = load_fault("on = 'slider'\nforce = 3", base)
    assert list(found) == ["mechanism.type"]
    assert '"slider-crank"' in found["mechanism.type"]


def test_dampers_take_the_dimension_of_their_place():
    scene = scene_with("""
[[damper]]
on = "slider"
coefficient = "3 kN s/m"
[[damper]]
on = "crank"
coefficient = "2 N m s/rad"
[[damper]]
on = "rod"
coefficient = 0
""")
    assert scene.dampers == (
        Damper("press.slider", 3000.0, "damper[0]"),
        Damper("crank", 2.0, "damper[1]"),
        Damper("press.rod", 0.0, "damper[2]"),
    )


@pytest.mark.parametrize(
    ("keys", "path", "hint"),
    [
        ("coefficient = 3", "damper[0].on", "nothing"),
        ("on = 'slider'", "damper[0].coefficient", "nothing"),
        ("on = 'slider'\ncoefficient = -3", "damper[0].coefficient", "at least 0"),
        ("on = 'slider'\ncoefficient = '3 N m s'", "damper[0].coefficient", "N s/m"),
        ("on = 'crank'\ncoefficient = '3 N s/m'", "damper[0].coefficient", "N m s"),
        ("on = 'slider'\ncoefficient = 'v'", "damper[0].coefficient", ""),
        ("on = 'slider'\ncoefficient = 3\nrest = 1", "damper[0].rest", "known key"),
    ],
)
def test_faulty_dampers(keys, path, hint):
    assert hint in fault_of(f"\n[[damper]]\n{keys}")[path]


def test_inertias_and_springs_take_the_dimension_of_their_place():
    scene = scene_with("""
[[inertia]]
on = "slider"
value = "5 kg"
[[inertia]]
on = "crank"
value = "5 kg m^2"
[[spring]]
on = "slider"
stiffness = "2 kN/m"
rest = "300 mm"
[[spring]]
on = "rod"
stiffness = "2 N m/rad"
rest = "-5 deg"
""")
    assert scene.inertias == (Inertia("press.slider", 5.0, "inertia[0]"), Inertia("crank", 5.0, "inertia[1]"))
    assert scene.springs == (
        Spring("press.slider", 2000.0, 0.3, "spring[0]"),
        Spring("press.rod", 2.0, -math.pi / 36, "spring[1]"),
    )


@pytest.mark.parametrize(
    ("text", "path"),
    [
        ("[[inertia]]\non = 'slider'\nvalue = '5 kg m^2'", "inertia[0].value"),
        ("[[inertia]]\non = 'slider'\nvalue = -5", "inertia[0].value"),
        ("[[inertia]]\non = 'slider'", "inertia[0].value"),
        ("[[inertia]]\nvalue = 3", "inertia[0].on"),
        ("[[spring]]\non = 'slider'\nstiffness = '5 N m/rad'", "spring[0].stiffness"),
        ("[[spring]]\non = 'slider'\nstiffness = 5\nrest = '5 deg'", "spring[0].rest"),
        ("[[spring]]\non = 'crank'\nstiffness = 5", "spring[0].on"),
        ("[[spring]]\non = 'slider'", "spring[0].stiffness"),
    ],
)
def test_faulty_inertias_and_springs(text, path):
    assert path in fault_of("\n" + text)


@pytest.mark.parametrize(
    "mechanism",
    [
        "type = 'crank-shaper'\ncrank.length = 0.5\nframe.length = 0.3\nrocker.length = 1",
        "type = 'four-bar'\nground.length = 0.1\ncrank.length = 0.3\ncoupler.length = 0.3\nrocker.length = 0.3",
        "type = 'law'\noutputs.rocker = {theta = 'phi + 0.1*sin(phi)', inertia = 1}",
    ],
)
def test_no_spring_on_a_port_that_does_not_return(mechanism):
    base = f"[mechanism]\n{mechanism}\n[regime]\nspeed = 1\n[flywheel]\ninertia = 1\n"
    assert "comes back" in fault_of("[[spring]]\non = 'rocker'\nstiffness = 5", base)["spring[0].on"]


def test_a_drive_may_be_a_quantity_or_an_expression():
    assert scene_with("[drive]\ntorque = '50 N m'").drive == Load("crank", 50.0, TURN, path="drive")
    assert isinstance(scene_with("[drive]\ntorque = '50*sin(phi)**2'").drive.law, Expression)
