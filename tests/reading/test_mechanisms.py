"""Mechanisms: geometry and bodies by their path, turns in a cycle, laws and their periods."""

import math

import numpy as np
import pytest

from flywheel.mechanisms import KINDS
from flywheel.numerics.expressions import Expression
from flywheel.numerics.faults import SceneError
from flywheel.reading.scenes import parse_scene
from flywheel.scene.scene import Body, Mechanism, Table

TURN = 2 * math.pi
REST = "\n[regime]\nspeed = 1\n{regime}\n[flywheel]\ninertia = 1\n"
GOOD = {
    "scotch-yoke": "crank.length = 0.1",
    "slider-crank": "crank.length = 0.1\nrod.length = 0.4",
    "four-bar": "ground.length = 0.4\ncrank.length = 0.1\ncoupler.length = 0.35\nrocker.length = 0.3",
    "crank-shaper": "crank.length = 0.1\nframe.length = 0.3\nrocker.length = 0.6",
    "law": "outputs.ram = {x = '0.1*cos(phi)', mass = 3}",
}


def mechanisms(text: str, regime: str = "") -> tuple[Mechanism, ...]:
    return parse_scene(text + REST.format(regime=regime)).mechanisms


def mechanism(text: str, regime: str = "") -> Mechanism:
    (found,) = mechanisms("[mechanism]\n" + text, regime)
    return found


def faults(text: str, regime: str = "") -> dict[str, str]:
    with pytest.raises(SceneError) as caught:
        mechanisms(text, regime)
    return {fault.path: str(fault) for fault in caught.value.faults}


@pytest.mark.parametrize("kind", GOOD)
def test_bodies_and_geometry_have_defaults(kind):
    found = mechanism(f"type = '{kind}'\n{GOOD[kind]}")
    assert (found.name, found.shaft, found.phase, found.path) == (kind, "crank", 0.0, "mechanism")
    assert set(found.bodies) == {part.name for part in KINDS[kind].parts if part.body}
    assert all(body == Body() for body in found.bodies.values())
    assert set(found.geometry) == {f"{part.name}.{key.name}" for part in KINDS[kind].parts for key in part.geometry}


def test_everything_about_a_slider_crank():
    found = mechanism("""
type = "slider-crank"
name = "press"
phase = "30 deg"
crank = {length = "100 mm", mass = 3, inertia = 0.02, com = "1 cm", com_angle = "180 deg"}
rod = {length = "0.4 m", mass = 4, inertia = 0.1, com = 0.15}
slider = {mass = "20 kg", offset = "-20 mm"}
""")
    assert found.geometry == {"crank.length": 0.1, "rod.length": 0.4, "slider.offset": -0.02}
    assert found.bodies == {"crank": Body(3.0, 0.02, 0.01, math.pi), "rod": Body(4.0, 0.1, 0.15), "slider": Body(20.0)}
    assert (found.name, found.phase) == ("press", pytest.approx(math.pi / 6, rel=1e-15))


def test_four_bar_assembly_and_yoke_direction():
    assert mechanism(f"type = 'four-bar'\nassembly = 'crossed'\n{GOOD['four-bar']}").assembly == "crossed"
    assert mechanism("type = 'scotch-yoke'\ncrank.length = 1\nyoke.direction = '90 deg'").geometry == {
        "crank.length": 1.0,
        "yoke.direction": math.pi / 2,
    }


@pytest.mark.parametrize(
    ("text", "path"),
    [
        ("type = 'slider-crank'\ncrank.length = 0.1", "mechanism.rod.length"),
        ("type = 'slider-crank'\ncrank.length = 0\nrod.length = 1", "mechanism.crank.length"),
        ("type = 'slider-crank'\ncrank = 1\nrod.length = 1", "mechanism.crank"),
        ("type = 'slider-crank'\ncrank.length = 0.5\nrod.length = 0.4", "mechanism.rod.length"),
        ("type = 'four-bar'\n" + GOOD["four-bar"].replace("0.1", "1e300"), "mechanism.crank.length"),
        (f"type = 'slider-crank'\nslider.inertia = 1\n{GOOD['slider-crank']}", "mechanism.slider.inertia"),
        (f"type = 'slider-crank'\nground.length = 1\n{GOOD['slider-crank']}", "mechanism.ground"),
        (f"type = 'slider-crank'\nassembly = 'open'\n{GOOD['slider-crank']}", "mechanism.assembly"),
        (f"type = 'slider-crank'\nname = 'a.b'\n{GOOD['slider-crank']}", "mechanism.name"),
        (f"type = 'slider-crank'\nname = 'crank'\n{GOOD['slider-crank']}", "mechanism.name"),
        (f"type = 'four-bar'\nassembly = 'upside'\n{GOOD['four-bar']}", "mechanism.assembly"),
        (f"type = 'four-bar'\nground.mass = 1\n{GOOD['four-bar']}", "mechanism.ground.mass"),
        (f"type = 'crank-shaper'\nblock.com = 1\n{GOOD['crank-shaper']}", "mechanism.block.com"),
    ],
)
def test_faulty_mechanisms(text, path):
    assert path in faults("[mechanism]\n" + text)


def test_mechanisms_of_different_types_may_go_by_their_types():
    text = "[[mechanism]]\ntype = 'scotch-yoke'\ncrank.length = 1\n[[mechanism]]\ntype = 'slider-crank'\n"
    assert [m.name for m in mechanisms(text + "crank.length = 1\nrod.length = 3\n")] == ["scotch-yoke", "slider-crank"]


TABLE = "{angle = [0, 90, 180, 270, 360], value = [0, 6, 12, 6, 0], angle_unit = 'deg', value_unit = '%s'}"


@pytest.mark.parametrize(
    ("output", "rotating"),
    [
        (f"x = {TABLE % 'mm'}", False),
        (f"x.table = {TABLE % 'mm'}", False),
        (f"table = {TABLE % 'mm'}\nmass = 2", False),
        (f"table = {TABLE % 'deg'}", True),
        (f"table = {TABLE % 'rad'}\ninertia = 2", True),
    ],
)
def test_a_laws_table_may_be_written_in_three_places(output, rotating):
    (law,) = mechanisms("[mechanism]\ntype = 'law'\n[mechanism.outputs.cam]\n" + output)
    assert law.outputs[0].rotating is rotating


def test_several_mechanisms_need_names_of_their_own():
    two = "[[mechanism]]\ntype = 'scotch-yoke'\n{a}\ncrank.length = 1\n" * 2
    assert set(faults(two.format(a=""))) == {"mechanism[0].name", "mechanism[1].name"}
    assert set(faults(two.format(a="name = 'one'"))) == {"mechanism[1].name"}
    text = two.replace("{a}", "name = 'one'", 1).format(a="name = 'two'")
    assert [(m.name, m.path) for m in mechanisms(text)] == [("one", "mechanism[0]"), ("two", "mechanism[1]")]
    lone = mechanisms("[[mechanism]]\ntype = 'scotch-yoke'\ncrank.length = 1")
    assert [(m.name, m.path) for m in lone] == [("scotch-yoke", "mechanism[0]")]


@pytest.mark.parametrize(("ratio", "cycle"), [(1, 180), (1.5, 360), (0.5, 360), (1, 359.9999), (1e6, 360)])
def test_the_cycle_is_a_whole_number_of_turns(ratio, cycle):
    text = f"[shafts]\nside.ratio = {ratio}\n[mechanism]\ntype = 'scotch-yoke'\nshaft = 'side'\ncrank.length = 1"
    assert "mechanism.shaft" in faults(text, f"cycle = '{cycle} deg'")


def test_a_ratio_of_ten_digits_makes_whole_turns_exactly():
    text = "[shafts]\nside.ratio = 0.3333333333\n[mechanism]\ntype = 'scotch-yoke'\nshaft = 'side'\ncrank.length = 1"
    scene = parse_scene(text + REST.format(regime="cycle = '1080 deg'"))
    assert scene.shafts["side"] == 1 / 3


# -- laws --------------------------------------------------------------------------------------------------------------


def law_text(outputs: str, shaft: str) -> str:
    own = "shaft = 'side'" if shaft else ""
    return f"{shaft}\n[mechanism]\ntype = 'law'\n{own}\n{outputs}"


def law(outputs: str, regime: str = "", shaft: str = "") -> Mechanism:
    return mechanisms(law_text(outputs, shaft), regime)[0]


def law_faults(outputs: str, regime: str = "", shaft: str = "") -> dict[str, str]:
    return faults(law_text(outputs, shaft), regime)


def test_outputs_by_expression():
    found = law("outputs.ram = {x = '0.1*cos(phi)', mass = 3}\noutputs.arm = {theta = '0.2*sin(phi)', inertia = '2 kg m^2'}")
    ram, arm = found.outputs
    assert isinstance(ram.law, Expression)
    assert (ram.name, ram.rotating, ram.inertia) == ("ram", False, 3.0)
    assert (arm.name, arm.rotating, arm.inertia) == ("arm", True, 2.0)
    assert found.period == TURN


@pytest.mark.parametrize(
    ("outputs", "path"),
    [
        ("", "mechanism.outputs"),
        ("outputs = 3", "mechanism.outputs"),
        ("outputs = {}", "mechanism.outputs"),
        ("outputs.ram = 3", "mechanism.outputs.ram"),
        ("outputs.ram = {}", "mechanism.outputs.ram"),
        ("outputs.ram = {x = 'phi*0', theta = 'phi'}", "mechanism.outputs.ram"),
        ("outputs.ram = {x = 3}", "mechanism.outputs.ram.x"),
        ("outputs.ram = {x = '3 mm'}", "mechanism.outputs.ram.x"),
        ("outputs.ram = {x = 'v'}", "mechanism.outputs.ram.x"),
        ("outputs.ram = {x = 'omega*phi'}", "mechanism.outputs.ram.x"),
        ("outputs.ram = {x = 'sin(fi)'}", "mechanism.outputs.ram.x"),
        ("outputs.ram = {x = 'sin(phi)', inertia = 1}", "mechanism.outputs.ram.inertia"),
        ("outputs.ram = {theta = 'sin(phi)', mass = 1}", "mechanism.outputs.ram.mass"),
        ("outputs.ram = {x = 'sin(phi)', mass = -1}", "mechanism.outputs.ram.mass"),
        ("outputs.ram = {x = 'sin(phi)', wieght = 1}", "mechanism.outputs.ram.wieght"),
        ("outputs.'a b' = {x = 'sin(phi)'}", 'mechanism.outputs."a b"'),
        ("outputs.ram = {x = 'phi', mass = 1}", "mechanism.outputs.ram.x"),
        ("outputs.ram = {x = {angle = [0, 1, 2], value = [0, 1, 0]}}", "mechanism.outputs.ram.x"),
    ],
)
def test_faulty_outputs(outputs, path):
    assert path in law_faults(outputs)


def test_a_balance_cannot_shape_a_law():
    text = "parameters.R = 'balance'\n[[load]]\non = 'crank'\ntorque = 'R'"
    found = faults(f"{text}\n[mechanism]\ntype = 'law'\noutputs.ram = {{x = 'R*cos(phi)'}}")
    assert "geometry" in found["mechanism.outputs.ram.x"]


TABLE = "{{angle = [0, 90, 180, 270, {end}], value = [1, 0, -1, 0, {last}], angle_unit = 'deg', {more}}}"


def table(end: object = 360, last: object = 1, more: str = "value_unit = 'mm'") -> str:
    return "outputs.ram = {x = " + TABLE.format(end=end, last=last, more=more) + "}"


def test_a_table_is_a_periodic_spline_with_its_ends_in_place():
    found = law(table(end=360.0000000001, last=1.0000000001)).outputs[0].law
    assert isinstance(found, Table)
    assert found.interpolation == "spline"
    assert found.angle[-1] == TURN
    assert found.value.tolist() == [0.001, 0.0, -0.001, 0.0, 0.001]


@pytest.mark.parametrize(
    ("outputs", "path", "hint"),
    [
        (table(end=350), "mechanism.outputs.ram", "360 deg"),
        (table(last=0.9), "mechanism.outputs.ram.x", "same position"),
        (table(more="interpolation = 'linear'"), "mechanism.outputs.ram.x.interpolation", "inertia would jump"),
        (table(more="interpolation = 'step'"), "mechanism.outputs.ram.x.interpolation", "inertia would jump"),
        (table().replace("180", "90"), "mechanism.outputs.ram.x", "jump"),
        (table(more="value_unit = 'deg'"), "mechanism.outputs.ram.x.value_unit", "length"),
    ],
)
def test_faulty_tables_of_laws(outputs, path, hint):
    assert hint in law_faults(outputs)[path]


def test_a_short_table_repeats_until_the_period_is_full():
    spread = table().replace("90", "45").replace("180", "90").replace("270", "135").replace("360", "180")
    found = law(spread).outputs[0].law
    assert np.degrees(found.angle) == pytest.approx([0, 45, 90, 135, 180, 225, 270, 315, 360])
    assert found.value.tolist() == [0.001, 0.0, -0.001, 0.0, 0.001, 0.0, -0.001, 0.0, 0.001]


def test_a_table_that_gains_goes_on_gaining():
    text = (
        "outputs.arm = {theta = {angle = [0, 60, 120, 180], value = [0, 80, 100, 180],"
        " angle_unit = 'deg', value_unit = 'deg'}, inertia = 1}"
    )
    found = law(text).outputs[0].law
    assert np.degrees(found.value) == pytest.approx([0, 80, 100, 180, 260, 280, 360])


def test_the_period_of_a_law():
    shaft = "[shafts]\nside.ratio = {}"
    assert law("outputs.a = {x = 'sin(phi/2)'}", "cycle = '720 deg'").period == 2 * TURN
    assert law(table(), "cycle = '720 deg'", shaft.format(0.5)).period == TURN
    assert law(table(), "", shaft.format(2)).period == TURN
    wide = table().replace("90", "180").replace("180, 180", "180, 360").replace("270", "540").replace("360]", "720]")
    wide = "outputs.ram = {x = {angle = [0, 180, 360, 540, 720], value = [1, 0, -1, 0, 1], angle_unit = 'deg'}}"
    assert law(wide, "", shaft.format(2)).period == 2 * TURN
    assert "mechanism.shaft" in law_faults("outputs.a = {x = 'sin(phi)'}", "cycle = '720 deg'", shaft.format(1.5))


def test_interpolation_spline_may_be_named():
    assert law(table(more="interpolation = 'spline'")).outputs[0].law.interpolation == "spline"
