"""Mechanisms and tables read."""

import math
import os

import numpy as np
import pytest

from flywheel import SceneError
from flywheel.mechanisms import KINDS
from flywheel.numerics.expressions import Expression
from flywheel.reading.scenes import parse_scene
from flywheel.scene.scene import Body, Load, Mechanism, Table

# Mechanisms: geometry and bodies by their path, turns in a cycle, laws and their periods.


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
    (result,) = mechanisms("[mechanism]\n" + text, regime)
    return result


def faults(text: str, regime: str = "") -> dict[str, str]:
    with pytest.raises(SceneError) as caught:
        mechanisms(text, regime)
    return {fault.path: str(fault) for fault in caught.value.faults}


@pytest.mark.parametrize("kind", GOOD)
def test_bodies_and_geometry_have_defaults(kind):
    result = mechanism(f"type = '{kind}'\n{GOOD[kind]}")
    assert (result.name, result.shaft, result.phase, result.path) == (kind, "crank", 0.0, "mechanism")
    assert set(result.bodies) == {part.name for part in KINDS[kind].parts if part.body}
    assert all(body == Body() for body in result.bodies.values())
    assert set(result.geometry) == {f"{part.name}.{key.name}" for part in KINDS[kind].parts for key in part.geometry}


@pytest.mark.parametrize(
    ("kind", "key", "word", "advice"),
    [
        ("four-bar", "ground", "fixed", "did you mean ground?"),
        ("four-bar", "ground", "bed", "did you mean ground?"),
        ("crank-shaper", "frame", "base", "did you mean frame?"),
        ("four-bar", "coupler", "connecting_rod", "did you mean coupler?"),
        ("four-bar", "rocker", "follower", "did you mean rocker?"),
        ("four-bar", "rocker", "lever", "did you mean rocker?"),
        ("four-bar", "rocker", "output", "did you mean rocker?"),
        ("slider-crank", "rod", "conrod", "did you mean rod?"),
        ("slider-crank", "rod", "link", "did you mean rod?"),
        ("slider-crank", "rod", "pitman", "did you mean rod?"),
        ("slider-crank", "crank", "stroke", "the stroke of an in-line mechanism is twice crank.length"),
        ("slider-crank", "crank", "throw", "did you mean crank.length?"),
        ("slider-crank", "crank", "crankshaft", "did you mean crank?"),
        ("slider-crank", "rod", "biela", "did you mean rod?"),
        ("slider-crank", "crank", "carrera", "the stroke of an in-line mechanism is twice crank.length"),
        ("scotch-yoke", "crank", "stroke", "the stroke of an in-line mechanism is twice crank.length"),
    ],
)
def test_other_words_of_the_trade_lead_to_the_key(kind, key, word, advice):
    text = f"[mechanism]\ntype = '{kind}'\n{GOOD[kind].replace(f'{key}.', f'{word}.')}"
    result = faults(text)
    assert list(result) == [f"mechanism.{word}"]  # and no line for the key that is missing
    assert advice in result[f"mechanism.{word}"]


@pytest.mark.parametrize(
    ("line", "path", "advice"),
    [
        ("crank.stroke = 0.2", "mechanism.crank.stroke", "the stroke of an in-line mechanism is twice crank.length"),
        ("crank.throw = 0.1", "mechanism.crank.throw", "did you mean length?"),
        ("crank.radius = 0.1", "mechanism.crank.radius", "did you mean length?"),
        ("slider.stroke = 0.2", "mechanism.slider.stroke", "the stroke of an in-line mechanism is twice crank.length"),
        ("plunger.mass = 2", "mechanism.plunger", "did you mean slider?"),
        ("rocker.length = 2", "mechanism.rocker", "rocker belongs to type four-bar or crank-shaper"),
        ("[[inertia]]\non = 'crank'\ninertia = 2", "inertia[0].inertia", "did you mean value?"),
        ("[[load]]\non = 'piston'\nforce = -1", "load[0].on", 'did you mean "slider-crank.slider"?'),
        ("[[load]]\non = 'crank'\nmoment = -1", "load[0].moment", "did you mean torque?"),
        ("[drive]\ntype = 'induction'", "drive.type", "type is a key of [drive.motor]"),
    ],
)
def test_a_word_of_the_trade_in_a_table_leads_to_its_key(line, path, advice):
    text = f"[mechanism]\ntype = 'slider-crank'\n{GOOD['slider-crank']}\n{line}"
    assert faults(text)[path].endswith(f"; {advice}")


@pytest.mark.parametrize("word", ["crank-slider", "biela-manivela"])
def test_another_name_of_a_type_leads_to_it(word):
    assert faults(f"[mechanism]\ntype = '{word}'\n")["mechanism.type"].endswith('; did you mean "slider-crank"?')


@pytest.mark.parametrize(
    ("table", "path", "advice"),
    [
        ("crank.lenght = 0.1\nrod.length = 0.4", "mechanism.crank.lenght", 'did you mean "length"?'),
        ("crank_radius = 0.1\nrod.length = 0.4", "mechanism.crank_radius", "did you mean crank.length?"),
        ("crank.stroke = 0.2\nrod.length = 0.4", "mechanism.crank.stroke", "twice crank.length"),
        ("rod.length = 0.4\nslider.stroke = 0.2", "mechanism.slider.stroke", "twice crank.length"),
        ("crank.length = 0.1\nrod = '0.4 m'", "mechanism.rod", 'write rod.length = "0.4 m"'),
        ("crank.length = 0.1\nrod.length = 0.4\n[[load]]\non = 'crank'\ntorqe = 3", "load[0].torqe", 'mean "torque"?'),
        ("crank.length = 0.1\nrod.length = 0.4\n[[inertia]]\non = 'crank'\ninertia = 3", "inertia[0].inertia", "value?"),
    ],
)
def test_a_key_under_another_name_gives_one_line(table, path, advice):
    result = faults(f"[mechanism]\ntype = 'slider-crank'\n{table}")
    assert list(result) == [path]
    assert result[path].split("; ")[1].endswith(advice)


@pytest.mark.parametrize(("kind", "own", "alias"), [("four-bar", "ground", "frame"), ("crank-shaper", "frame", "ground")])
def test_frame_and_ground_are_the_same(kind, own, alias):
    text = f"type = '{kind}'\n{GOOD[kind]}"
    renamed = text.replace(f"{own}.", f"{alias}.")
    assert renamed != text
    assert mechanism(renamed) == mechanism(text)
    both = faults(f"[mechanism]\n{text}\n{alias}.length = 0.4")
    assert list(both) == [f"mechanism.{alias}"]
    expected = f": found {alias} together with {own}, which is the same, expected one of the two; leave {alias} out"
    assert both[f"mechanism.{alias}"].endswith(expected)


def test_a_length_that_locks_is_named_as_it_is_written():
    text = "[mechanism]\ntype = 'crank-shaper'\ncrank.length = 0.1\nground.length = 0.1\nrocker.length = 0.6"
    assert "(line 4)" in faults(text)["mechanism.ground.length"]
    bars = (
        "[mechanism]\ntype = 'four-bar'\ncrank.length = 0.1\nframe.length = 0.1\ncoupler.length = 0.3\nrocker.length = 0.3"
    )
    assert "expected a length other than frame.length = 0.1 m" in faults(bars)["mechanism.crank.length"]


def test_a_four_bar_that_closes_nowhere_has_no_stroke_to_move_on():
    text = f"[mechanism]\ntype = 'four-bar'\n{GOOD['four-bar']}".replace("0.4", "4")
    assert faults(text)["mechanism.coupler.length"].endswith("; it closes at no crank angle")


@pytest.mark.parametrize(
    ("law", "advice"),
    [
        ("if(v > 0, 1, 2)", "write 1 if v > 0 else 2"),
        ("where(v > 0, 1, 2)", "write 1 if v > 0 else 2"),
        ("if v > 0 then 1 else 2", "write 1 if v > 0 else 2"),
        ("v > 0 ? 1 : 2", "write 1 if v > 0 else 2"),
        ("v > 0 and -1 or 1", "write -1 if v > 0 else 1"),
        ("3*(v > 0 and 2)", "a condition is written a if c else b"),
        ("1 if (v > 0, 2)", "a condition is written a if c else b"),
        ("1 if v > 0", "a condition is written a if c else b"),
        ("2*π", "write pi"),
        ("sin(φ)", "write phi"),
        ("sgn(v)", "write sign(...)"),
        ("arctg(v)", "write atan(...)"),
        ("si(v > 0; -1; 1)", "write -1 if v > 0 else 1"),
        ("v^2", "a power is written **"),
        ("v²", "a power is written **"),
        ("3·phi", "a product is written *"),
        ("3×phi", "a product is written *"),
        ("3 sin(phi)", "a product is written *: 3*sin"),
        ("3phi", "a product is written *: 3*phi"),
        ("2(phi + 1)", "a product is written *: 2*("),
        ("|v|", "write abs(v)"),
        ("ln(2 + phi)", "log is the natural logarithm"),
        ("log10(2 + phi)", "write log(...)/log(10)"),
        ("v > 0 && phi < 1", "write and"),
        ("v > 0 || phi < 1", "write or"),
        ("sin phi", "write sin(phi)"),
        ("sin²(phi)", "write sin(phi)**2"),
        ("v = 0", "a comparison for equality is written =="),
        ("min(1; 2)", "arguments are separated by commas"),
        ("sin(30°)", "angles in an expression are in rad: write 30*pi/180"),
    ],
)
def test_a_law_in_another_notation_is_shown_as_it_is_written_here(law, advice):
    text = f"[mechanism]\ntype = 'slider-crank'\n{GOOD['slider-crank']}\n[[load]]\non = 'slider'\nforce = '{law}'"
    assert faults(text)["load[0].force"].endswith(advice)


def test_everything_about_a_slider_crank():
    result = mechanism("""
type = "slider-crank"
name = "press"
phase = "30 deg"
crank = {length = "100 mm", mass = 3, inertia = 0.02, com = "1 cm", com_angle = "180 deg"}
rod = {length = "0.4 m", mass = 4, inertia = 0.1, com = 0.15}
slider = {mass = "20 kg", offset = "-20 mm"}
""")
    assert result.geometry == {"crank.length": 0.1, "rod.length": 0.4, "slider.offset": -0.02}
    assert result.bodies == {"crank": Body(3.0, 0.02, 0.01, math.pi), "rod": Body(4.0, 0.1, 0.15), "slider": Body(20.0)}
    assert (result.name, result.phase) == ("press", pytest.approx(math.pi / 6, rel=1e-15))


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
    result = law(
        "outputs.ram = {x = '0.1*cos(phi)', mass = 3}\noutputs.arm = {theta = '0.2*sin(phi)', inertia = '2 kg m^2'}"
    )
    ram, arm = result.outputs
    assert isinstance(ram.law, Expression)
    assert (ram.name, ram.rotating, ram.inertia) == ("ram", False, 3.0)
    assert (arm.name, arm.rotating, arm.inertia) == ("arm", True, 2.0)
    assert result.period == TURN


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
    result = faults(f"{text}\n[mechanism]\ntype = 'law'\noutputs.ram = {{x = 'R*cos(phi)'}}")
    assert "geometry" in result["mechanism.outputs.ram.x"]


TABLE = "{{angle = [0, 90, 180, 270, {end}], value = [1, 0, -1, 0, {last}], angle_unit = 'deg', {more}}}"


def table(end: object = 360, last: object = 1, more: str = "value_unit = 'mm'") -> str:
    return "outputs.ram = {x = " + TABLE.format(end=end, last=last, more=more) + "}"


def test_a_table_is_a_periodic_spline_with_its_ends_in_place():
    result = law(table(end=360.0000000001, last=1.0000000001)).outputs[0].law
    assert isinstance(result, Table)
    assert result.interpolation == "spline"
    assert result.angle[-1] == TURN
    assert result.value.tolist() == [0.001, 0.0, -0.001, 0.0, 0.001]


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
    result = law(spread).outputs[0].law
    assert np.degrees(result.angle) == pytest.approx([0, 45, 90, 135, 180, 225, 270, 315, 360])
    assert result.value.tolist() == [0.001, 0.0, -0.001, 0.0, 0.001, 0.0, -0.001, 0.0, 0.001]


def test_a_table_that_gains_goes_on_gaining():
    text = (
        "outputs.arm = {theta = {angle = [0, 60, 120, 180], value = [0, 80, 100, 180],"
        " angle_unit = 'deg', value_unit = 'deg'}, inertia = 1}"
    )
    result = law(text).outputs[0].law
    assert np.degrees(result.value) == pytest.approx([0, 80, 100, 180, 260, 280, 360])


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


# Tables of numbers against angle, written in the scene or in a CSV file.


SCENE = """
[[load]]
on = "crank"
{keys}
table = {{{table}}}
[regime]
speed = 1
{regime}
[flywheel]
inertia = 1
"""


def load(table: str, keys: str = "", folder=None, regime: str = "") -> Load:
    (result,) = parse_scene(SCENE.format(table=table, keys=keys, regime=regime), folder=folder).loads
    return result


def degrees(table: str, keys: str = "", **kwargs) -> list[float]:
    return np.degrees(load(table + ", angle_unit = 'deg'", keys, **kwargs).law.angle).round(9).tolist()


def table_faults(table: str, keys: str = "", folder=None) -> dict[str, str]:
    with pytest.raises(SceneError) as caught:
        load(table, keys, folder)
    return {fault.path.removeprefix("load[0]."): str(fault) for fault in caught.value.faults}


def test_units_apply_to_angles_and_values():
    result = load("angle = [0, 90, 90, 360], value = [1, 2, 3, 4], angle_unit = 'deg', value_unit = 'kNm'").law
    assert result.angle.tolist() == [0.0, math.pi / 2, math.pi / 2, TURN]
    assert result.value.tolist() == [1000.0, 2000.0, 3000.0, 4000.0]
    assert result.interpolation == "linear"


@pytest.mark.parametrize("kind", ["linear", "pchip", "step"])
def test_interpolation(kind):
    result = load(f"angle = [0, {TURN}], value = [1, 2], interpolation = '{kind}'").law
    assert result.interpolation == kind


@pytest.mark.parametrize(
    ("table", "path", "hint"),
    [
        ("", "table", "neither"),
        ("angle = [0, 1]", "table", "angle"),
        ("value = [0, 1]", "table", "value"),
        ("angle = [0, 1], value = [0, 1], column = 2", "table", "column"),
        ("angle = [0, 1], value = [0, 1], file = 'a.csv'", "table", "file"),
        ("angle = 3, value = [1]", "table.angle", "a list of numbers"),
        ("angle = [0, 1], value = [1, 'a']", "table.value[1]", "number"),
        ("angle = [0, true], value = [1, 1]", "table.angle[1]", "true"),
        ("angle = [0, inf], value = [1, 1]", "table.angle[1]", "finite"),
        ("angle = [0, 1, 2], value = [1, 1]", "table", "3 angles and 2 values"),
        ("angle = [0], value = [1]", "table", "at least 2"),
        ("angle = [], value = []", "table", "at least 2"),
        ("angle = [0, 2, 1], value = [1, 2, 3]", "table", "row 3"),
        ("angle = [0, 1, 1, 1, 2], value = [1, 2, 3, 4, 5]", "table", "three equal"),
        ("angle = [0, 0, 1], value = [1, 2, 3]", "table", "first row"),
        ("angle = [0, 1, 1], value = [1, 2, 3]", "table", "last row"),
        ("angle = [0, 1], value = [1, 2]", "table", "360 deg"),
        ("angle = [0, 7], value = [1, 2]", "table", "360 deg"),
        ("angle = [0, 360], value = [1, 2], angle_unit = 'mm'", "table.angle_unit", "angle"),
        ("angle = [0, 360], value = [1, 2], angle_unit = 3", "table.angle_unit", "unit"),
        ("angle = [0, 360], value = [1, 2], value_unit = 'kN'", "table.value_unit", "torque"),
        ("angle = [0, 360], value = [1, 2], interpolation = 'cubic'", "table.interpolation", "pchip"),
        ("angles = [0, 360], value = [1, 2]", "table.angles", '"angle"'),
        ("file = 'a.csv'", "table.file", "folder"),
        ("angle = [7, 13.283185307179586], value = [1, 2]", "table", "first angle"),
    ],
)
def test_faulty_tables(table, path, hint):
    assert hint in table_faults(table)[path]


@pytest.mark.parametrize("raw", ["3", "[]", "'gas.csv'"])
def test_a_table_is_a_table(raw):
    text = SCENE.replace("{{{table}}}", raw).format(keys="", regime="")
    with pytest.raises(SceneError, match=r"load\[0\]\.table .* expected a table"):
        parse_scene(text)


def test_nearly_a_period_becomes_one_exactly():
    assert load("angle = [0, 6.283185307], value = [1, 2]").law.angle[-1] == TURN
    result = load("angle = [-180, 180], value = [1, 2], angle_unit = 'deg'").law
    assert result.angle.tolist() == [-math.pi, math.pi]


def test_a_table_repeats_with_every():
    assert degrees("angle = [0, 90, 180], value = [1, 2, 3]", "every = '180 deg'") == [0.0, 90.0, 180.0]


@pytest.mark.parametrize(
    ("angles", "window"),
    [
        ("[30, 50]", "from = '30 deg'\nto = '50 deg'"),
        ("[20, 60]", "from = '30 deg'\nto = '50 deg'"),
        ("[-30, 30]", "from = '340 deg'\nto = '20 deg'"),
        ("[330, 390]", "from = '340 deg'\nto = '20 deg'"),
        ("[-30, 30]", "from = '330 deg'\nto = '30 deg'"),
        ("[0, 360]", "from = '330 deg'\nto = '30 deg'"),
        ("[-90, -30]", "from = '280 deg'\nto = '330 deg'"),
        ("[320, 360]", "from = '330 deg'\nto = 0"),
    ],
)
def test_a_table_may_cover_just_its_window(angles, window):
    assert len(degrees(f"angle = {angles}, value = [1, 2]", window)) == 2


@pytest.mark.parametrize(
    ("angles", "window"),
    [
        ("[31, 50]", "from = '30 deg'\nto = '50 deg'"),
        ("[30, 49]", "from = '30 deg'\nto = '50 deg'"),
        ("[0, 20]", "from = '340 deg'\nto = '20 deg'"),
        ("[0, 400]", "from = '340 deg'\nto = '20 deg'"),
        ("[30, 50]", "from = '50 deg'\nto = '30 deg'"),
    ],
)
def test_a_table_short_of_its_window_is_refused(angles, window):
    assert "window" in table_faults(f"angle = {angles}, value = [1, 2], angle_unit = 'deg'", window)["table"]


def test_ends_within_rounding_of_the_window_are_put_onto_it():
    result = load("angle = [0.5235987756, 0.8726646260], value = [1, 2]", "from = '30 deg'\nto = '50 deg'")
    assert result.law.angle.tolist() == [result.start, result.end]


# -- CSV ---------------------------------------------------------------------------------------------------------------


def csv(tmp_path, text, more="", keys="", encoding="utf-8"):
    (tmp_path / "t.csv").write_bytes(text if isinstance(text, bytes) else text.encode(encoding))
    return load(f"file = 't.csv', angle_unit = 'deg'{more}", keys, tmp_path).law


def csv_faults(tmp_path, text, more=""):
    with pytest.raises(SceneError) as caught:
        csv(tmp_path, text, more)
    return {fault.path.removeprefix("load[0].table."): str(fault) for fault in caught.value.faults}


@pytest.mark.parametrize(
    "text",
    [
        "0,1\n180,2\n360,3\n",
        "0;1\n180;2\n360;3",
        "0\t1\r\n180\t2\r\n360\t3\r\n",
        "0 1\n180   2\n 360 3 ",
        "angle,moment\n0,1\n180,2\n360,3\n",
        "# measured\n\nangle; moment; speed\n0;1;9\n# in between\n180;2;9\n360;3;9\n",
        '"angle, deg","moment, N m"\n0,1\n180,2\n360,3\n',
        "+0.,1e0\n1.8e2,2\n360.0,.3e1",
        "\ufeff0,1\n180,2\n360,3\n",
    ],
)
def test_separators_headers_and_comments(tmp_path, text):
    result = csv(tmp_path, text)
    assert result.angle.tolist() == [0.0, math.pi, TURN]
    assert result.value.tolist() == [1.0, 2.0, 3.0]


@pytest.mark.parametrize("column", ["3", "'force'"])
def test_columns_by_number_and_by_name(tmp_path, column):
    result = csv(tmp_path, "angle,moment,force\n0,1,7\n360,2,8\n", f", column = {column}")
    assert result.value.tolist() == [7.0, 8.0]


def test_a_csv_and_the_scene_agree_to_the_last_bit(tmp_path):
    rows = [(i * 0.1, i * 0.3) for i in range(3601)]
    text = "\n".join(f"{angle!r},{value!r}" for angle, value in rows)
    listed = ", ".join(f"{name} = {[row[i] for row in rows]}" for i, name in enumerate(("angle", "value")))
    inline = load(listed + ", angle_unit = 'deg', value_unit = 'kNm'").law
    assert np.array_equal(csv(tmp_path, text, ", value_unit = 'kNm'").angle, inline.angle)
    assert np.array_equal(csv(tmp_path, text, ", value_unit = 'kNm'").value, inline.value)
    assert math.radians(90) in inline.angle


@pytest.mark.parametrize(
    ("text", "more", "path", "hint"),
    [
        ("0;1,5\n360;2,5\n", "", "file", "write 1.5, not 1,5"),
        ("0,0 1,5\n360,0 2,5\n", "", "file", "write 1.5, not 1,5"),
        ("0,1\n180\n360,3\n", "", "file", "line 2"),
        ("0,1\n180,2,3\n360,3\n", "", "file", "line 2"),
        ("0,1\n180,two\n360,3\n", "", "file", "line 2"),
        ("0,1\n180,nan\n360,3\n", "", "file", '"nan"'),
        ("0,1\n180,1_0\n360,3\n", "", "file", '"1_0"'),
        ("O,1\n360,3\n", "", "file", "line 1"),
        ("", "", "file", "no rows"),
        ("# nothing\n", "", "file", "no rows"),
        ("angle,moment\n", "", "file", "no rows"),
        ("0\n360\n", "", "column", "a single column"),
        ("0,1\n360,2\n", ", column = 1", "column", "from 2 to 2"),
        ("0,1\n360,2\n", ", column = 3", "column", "from 2 to 2"),
        ("0,1\n360,2\n", ", column = true", "column", "true"),
        ("0,1\n360,2\n", ", column = 'moment'", "column", "no header"),
        ("angle,moment\n0,1\n360,2\n", ", column = 'momemt'", "column", '"moment"'),
        ("angle,m,m\n0,1,2\n360,2,3\n", ", column = 'm'", "column", "one column"),
        ("angle,m\n0,1\n360,2\n", ", column = 'angle'", "column", "one column"),
        (b"0,1\n360,\xff\n", "", "file", "UTF-8"),
        ("0,1\n360,1\n".encode("utf-16"), "", "file", "UTF-16"),
        ("0,1\n360,1\n".encode("utf-16-le"), "", "file", "UTF-16"),
        ("0,1\n360,1e999\n", "", "value", "floating-point range"),
    ],
)
def test_faulty_files(tmp_path, text, more, path, hint):
    assert hint in csv_faults(tmp_path, text, more)[path]


def test_only_the_first_faulty_rows_are_spelt_out(tmp_path):
    (tmp_path / "t.csv").write_text("0,1\n" + "1,x\n" * 100)
    with pytest.raises(SceneError) as caught:
        load("file = 't.csv'", folder=tmp_path)
    assert len(caught.value.faults) == 6
    assert "95 more rows" in str(caught.value)


@pytest.mark.parametrize("name", ["../t.csv", "/etc/passwd", "/dev/zero", "sub/../../t.csv", "out.csv"])
def test_files_outside_the_folder_are_never_opened(tmp_path, name):
    (tmp_path / "t.csv").write_text("0,1\n360,2\n")
    inner = tmp_path / "inner"
    inner.mkdir()
    os.symlink(tmp_path / "t.csv", inner / "out.csv")
    assert "own folder" in table_faults(f"file = '{name}'", folder=inner)["table.file"]


def test_folders_devices_and_missing_files(tmp_path):
    (tmp_path / "gas.csv").write_text("0,1\n360,2\n")
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "in.csv").write_text("0,1\n360,2\n")
    os.mkfifo(tmp_path / "pipe.csv")
    assert 'did you mean "gas.csv"' in table_faults("file = 'gaz.csv'", folder=tmp_path)["table.file"]
    for name in ("sub", "pipe.csv", ".", "", "a\\u0000b", "x" * 5000):
        assert "table.file" in table_faults(f'file = "{name}"', folder=tmp_path)
    assert load("file = 'sub/in.csv', angle_unit = 'deg'", folder=tmp_path).law.angle.size == 2


def test_a_file_of_more_than_32_mib_is_refused(tmp_path):
    with (tmp_path / "large.csv").open("wb") as stream:
        stream.truncate(32 * 2**20 + 1)
    assert "32 MiB" in table_faults("file = 'large.csv'", folder=tmp_path)["table.file"]
