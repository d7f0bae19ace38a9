"""Answers in text: summary, explanation, what is left out."""

from __future__ import annotations

import re
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner

import flywheel
from flywheel.cli import main
from flywheel.language import use
from flywheel.reading.scenes import build_scene, parse_scene, read_scene
from flywheel.starters import kinds, starter
from flywheel.tables import sizing as scene_report
from flywheel.tables import summary
from flywheel.tables.explanation import explanation
from flywheel.tables.rows import US, five_digits
from flywheel.tables.scene import parts, scene_rows
from flywheel.tables.sizing import candidates, text
from tests import regimes, scenes
from tests.limits import sample
from tests.references.test_references import FOLDER

# The summary: it fits every machine, shows what the sizing found, and hides no warning.


ROOT = Path(__file__).parents[2]
YOKE = {
    "title": "Yoke",
    "mechanism": {"type": "scotch-yoke", "crank": {"length": 0.5}, "yoke": {"mass": 20}},
    "load": [{"on": "yoke", "force": 1000.0, "from": 0, "to": "180 deg"}],
    "drive": {"torque": "balance"},
    "regime": {"speed": "60 rpm"},
    "flywheel": {"irregularity": 0.04},
}
SCENES = sorted([*ROOT.glob("examples/*/*.toml"), *ROOT.glob("flywheel/starters/*.toml")])
TEXTS = {path: path.read_text() for path in SCENES}
SIZED = [
    path for path, text in TEXTS.items() if "[flywheel]" in text and "[stroke]" not in text and "[single_stroke]" not in text
]


def sized(speed="60 rpm", eps=0.04, **more):
    scene = YOKE | {"regime": {"speed": speed}, "flywheel": {"irregularity": eps}} | more
    return flywheel.size(flywheel.load(scene), simulate=False)


def block(sizing, name, units="si"):
    return next(result for result in summary.summary(sizing, units) if result.name == name)


def test_the_flywheels_stand_beside_one_another_with_what_each_gives():
    sizing = sized()
    exact, areas, torque = block(sizing, "flywheel").table
    assert exact == ("exact (Wittenbauer)", "353.52", "1414.1", "", "0.040000")
    assert areas[1:] == ("348.99", "1396.0", "-1.28 %", "0.040518")
    assert torque[3] == "+0.2 %"
    assert float(exact[1]) == pytest.approx(sizing.flywheel.exact, rel=1e-4)


@pytest.mark.parametrize(
    ("speed", "eps", "says"),
    [
        ("60 rpm", 0.04, "Areas 1.28 % too small (unsafe), inertia torque 0.2 % too large (safe)."),
        ("100 rad/s", 0.04, "Areas 44 times too small (DANGER), inertia torque 4.08 % too large (safe)."),
    ],
)
def test_a_shortcut_that_is_too_small_is_the_dangerous_side(speed, eps, says):
    assert block(sized(speed, eps), "flywheel").sentences == (says,)


def test_no_flywheel_is_asked_of_a_machine_whose_own_inertia_suffices():
    heavy = sized(inertia=[{"on": "crank", "value": 400.0}])
    (output,) = block(heavy, "flywheel").sentences
    assert output == "No flywheel is needed: the machine's own inertia suffices and gives 0.035360."


def test_what_is_not_confirmed_or_not_reached_is_said():
    assert block(sized(), "run").sentences == ("NOT confirmed at accuracy normal: audit adds a second method.",)
    message = "rtol 1e-09 not reached: the exact inertia is good to 0.003 (estimated, relative)"
    off = replace(sized(), error=sized().error._replace(exact=3e-3), messages=(message,))
    text = " ".join(summary.text(off).split())
    assert "The required accuracy was NOT reached: the error of a figure may be up to 0.3 %." in text
    assert f"Note: {message}" in text
    assert "353.5 ± 1.1" in text or "354 ± 1" in text


def test_a_flywheel_that_keeps_the_limit_where_lighter_ones_are_unknown_is_an_upper_bound():
    known = sized()
    bound = replace(known, error=known.error._replace(exact=1.0), run=known.run._replace(irregularity=0.03))
    result = block(bound, "flywheel")
    assert result.table[0][1:3] == ("≤ 353.52", "≤ 1414.1")
    assert result.sentences == ("This flywheel keeps the irregularity. Whether a lighter one does is unknown.",)
    assert block(replace(known, error=bound.error), "flywheel").table[0][1:3] == ("?", "?")
    assert "≤ 353.521" in scene_report.text(bound)
    assert "too small" not in scene_report.text(bound)


def test_power_has_the_same_sign_in_every_unit():
    braking = block(sized(load=[{"on": "yoke", "force": -1000.0, "from": 0, "to": "180 deg"}]), "drive")
    row = next(row for row in braking.rows if row.label == "mean power")
    assert row.value.startswith("-")
    assert row.note.startswith("= -1.3")


def test_units_of_the_united_states_are_those_of_the_same_figures():
    sizing = sized()
    result = block(sizing, "flywheel", "us")
    assert result.header[1] == "WR², lb ft²"
    assert float(result.table[0][1]) == pytest.approx(sizing.flywheel.exact / (0.45359237 * 0.3048**2), rel=1e-4)
    text = summary.text(sizing, "us")
    assert not re.search(r"\d (mm|kg|N m|kW|MPa|J)\b", text)
    torque = sizing.balance.value / (4.4482216152605 * 0.3048)
    assert f"{torque:.5g} lbf ft" in text


@pytest.mark.parametrize(
    ("value", "error", "shown"),
    [
        (344.8448, 0.0, "344.84"),
        (0.15, 1e-14, "0.15000"),
        (114367.2, 1e-3, "114370"),
        (1234.5678, 20.0, "1230 ± 20"),
        (1e-16, 1e-15, "0"),
        (float("nan"), 0.0, "?"),
    ],
)
def test_a_figure_has_the_digits_that_its_error_leaves(value, error, shown):
    assert five_digits(value, error) == shown


def test_a_quantity_that_was_typed_keeps_its_digits():
    assert str(US.read(0.0254 * 12, "length")) == "12 in"


def test_spanish_has_its_words_and_its_decimal_mark():
    with use("es"):
        text = summary.text(sized())
    assert "353,52" in text
    assert "Volante en la manivela para irregularidad 0,04 (±2 %)" in text
    assert not re.search(r"\d\.\d", text)


def test_weight_is_told_where_it_acts():
    assert ("gravity", "9.80665 m/s² at -90 deg, on every body with mass", "", "") in block(
        sized(gravity={}), "machine"
    ).rows
    assert not any(row.label == "gravity" for row in block(sized(), "machine").rows)


def test_a_long_machine_is_counted_and_not_cut():
    loads = [{"on": "crank", "torque": -float(k + 1), "from": k, "to": k + 1} for k in range(5)]
    text = summary.text(sized(load=[*YOKE["load"], *loads], inertia=[{"on": "crank", "value": 0.1}] * 9))
    assert len(text.splitlines()) <= 24
    assert re.search(r"and .*6 × load, drive: see --full", text)


def test_the_data_are_plain():
    result = [part.as_dict() for part in summary.summary(sized())]
    assert result[2]["table"][0][0] == "exact (Wittenbauer)"
    assert result[1]["rows"][0] == {
        "label": "mechanism",
        "value": "scotch-yoke: crank 500 mm; yoke 20 kg",
        "unit": "",
        "note": "",
    }


@pytest.fixture
def scene(tmp_path):
    path = tmp_path / "rotor.toml"
    path.write_text(
        '[[load]]\non = "crank"\ntorque = "-100 N m"\nfrom = 0\nto = "180 deg"\n[drive]\ntorque = "balance"\n'
        '[regime]\nspeed = "300 rpm"\n[flywheel]\nirregularity = 0.01\n'
    )
    return path


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ((), "exact (Wittenbauer)          15.915      63.662"),
        (("--units", "us"), "377.68"),
        (("--language", "es"), "15,915"),
        (("--full",), "exact (Wittenbauer)     15.91549431"),
        (("--explain",), "Method of solution"),
    ],
)
def test_the_command_prints_the_page_and_what_else_is_asked(scene, options, says):
    result = CliRunner().invoke(main, ["size", str(scene), "--no-simulate", *options])
    assert result.exit_code == 0
    assert says in result.stdout


@pytest.mark.parametrize(
    ("language", "model", "words"),
    [
        ("en", {"type": "constant", "torque": "150 N m"}, "constant: 110.6 lbf ft against the motion"),
        ("es", {"type": "constant", "torque": "1.5 N m"}, "constant: 1,106 lbf ft contra el movimiento"),
        ("es", {"type": "fan", "torque": "150 N m", "speed": "60 rpm"}, "fan: 110,6 lbf ft a 60 rpm"),
        ("es", {"type": "press", "energy": "2 kJ"}, "prensa: 1475 ft lbf, constant, en la ventana de la carga"),
        ("es", {"type": "losses", "proportional": "2 N m s"}, "losses: proportional 2 N m s"),
    ],
)
def test_the_text_of_a_load_model_has_the_units_in_use(language, model, words):
    window = {"from": "30 deg", "to": "60 deg"} if model["type"] == "press" else {}
    load = [{"on": "crank", "torque": "-90 N m"}, {"on": "crank", "model": model, **window}]
    scene = flywheel.load({"inertia": [{"on": "crank", "value": 2.0}], "load": load, "drive": {"torque": "balance"}})
    with use(language):
        assert words in " ".join(line.text for line in parts(scene, US))


@pytest.mark.parametrize("options", [("--full", "--units", "us"), ("--json", "--language", "es"), ("--json", "--full")])
def test_what_contradicts_is_a_usage_error(scene, options):
    assert CliRunner().invoke(main, ["size", str(scene), *options]).exit_code == 2


@pytest.mark.slow
@pytest.mark.parametrize("path", SIZED, ids=lambda path: path.stem)
def test_every_example_and_starter_fits_on_its_page(path):
    sizing = flywheel.size(flywheel.load(path), simulate=False)
    for units in ("si", "us"):
        for language in ("en", "es"):
            with use(language):
                lines = summary.text(sizing, units).splitlines()
            assert len(lines) <= 26
            assert max(map(len, lines)) <= 80
            parted = re.compile(r"\d\n +(kg|mm|N|kN|W|kW|J|rpm|deg|in|lb|hp|%)(?!\w)|(kg|lb)\n +(m²|ft²)")
            assert not parted.search("\n".join(lines))  # a number and its unit


# The explanation of a sizing, statement by statement, against the scene and the run.


EXAMPLES = Path(flywheel.__file__).parents[1] / "examples"


def explain(scene, accuracy="normal", rtol=None):
    return flywheel.explain(flywheel.load(scene), rtol, accuracy=accuracy)


def said(explanation, part):
    return any(part in row for row in (*explanation.not_modelled, *explanation.forced, *explanation.because))


def test_loads_of_position_are_named_with_the_closed_form():
    result = explain(scenes.press(spring=[{"on": "press.slider", "stiffness": 100, "rest": "0.3 m"}]))
    assert "Wittenbauer's closed form" in result.formulation
    assert "6 cells of 21 nodes" in result.formulation
    assert result.because == ("on position alone: load[0].force, drive.torque (balance), spring[0], gravity",)
    assert not said(result, "springs")
    assert said(result, "dampers")
    assert said(result, "2 breakpoints inside the cycle, from load[0].force 2")
    assert said(result, "6 cells at first, which sufficed")


def test_a_damper_and_a_law_of_speed_ask_for_collocation():
    result = explain(regimes.scene("pump", irregularity=0.05))
    assert "periodic collocation" in result.formulation
    assert f"{result.sizing.cyclic.steps} Newton steps" in result.formulation
    assert result.because[0] == "on speed: load[1].torque, damper[0]"
    assert result.because[1] == "on position alone: load[0].force, drive.torque (balance)"
    assert not said(result, "Newton's method for the motion")


def test_losses_and_currents_are_named_by_their_paths():
    assert "shafts.motor.efficiency" in explain(regimes.scene("geared-loss", inertia=0.05)).because[1]
    result = explain(regimes.scene("dc-inductance", inertia=0.1))
    assert result.because[-1] == "on a current of its own: drive.motor.inductance"
    assert not said(result, "current as a state of its own")
    plain = dict(regimes.DC["drive"]["motor"])
    del plain["inductance"]
    quick = regimes.scene("dc-inductance", inertia=0.1) | {"drive": {"on": "motor", "motor": plain}}
    assert said(explain(quick), "what delays the motor's torque, such as its current: it follows the speed at once")


@pytest.mark.slow
def test_laws_that_switch_at_a_speed_are_named():
    assert said(explain(regimes.scene("governor", inertia=0.5)), "switch at a speed, where the motion itself divides")


def test_bodies_without_mass_are_named_and_are_not_in_the_graph():
    result = explain(scenes.yoke())
    assert said(result, "bodies without mass or inertia: scotch-yoke.crank, scotch-yoke.block")
    heavy = explain(
        scenes.yoke(
            mechanism={
                "type": "scotch-yoke",
                "crank": {"length": 0.5, "inertia": 1},
                "yoke": {"mass": 20},
                "block": {"mass": 1},
            }
        )
    )
    assert not said(heavy, "bodies without")
    parts = {element.part for element in result.sizing.machine.graph.elements.values() if element.kind == "I"}
    assert parts == {"scotch-yoke.yoke"}


def test_a_constant_inertia_makes_the_areas_exact_and_that_is_said():
    result = explain(scenes.rotor(inertia=[{"on": "crank", "value": 2}]))
    assert said(result, "a varying inertia: I* is 2 kg m²")
    assert said(result, "it vanishes with a constant I*")
    wheel = result.sizing.flywheel
    assert wheel.exact == pytest.approx(wheel.approximate, rel=1e-12)
    assert not said(explain(scenes.press()), "a varying inertia")
    assert said(explain(scenes.rotor()), "it has none")


def test_halved_cells_are_told_with_the_narrowest():
    result = explain(FOLDER / "scenes" / "shaper-near-change.toml", rtol=1e-12)
    edges = result.sizing.cycle.mesh.edges
    first = result.sizing.machine.mesh.size
    assert edges.size > first
    assert said(result, f"{first - 1} cells at first, {edges.size - first} more")
    assert said(result, "the narrowest cell goes from")


def test_breakpoints_are_told_by_where_they_come_from():
    assert said(explain(scenes.shaper()), "2 breakpoints inside the cycle, from load[0].force 2")  # its ram turns back
    result = explain(FOLDER / "scenes" / "near-lock-offset.toml")
    machine = result.sizing.machine
    inside = machine.breakpoints.size - 2
    assert machine.broken_by["slider-crank"] == 7  # where the rod nearly stands across
    assert all(0 < count <= inside for count in machine.broken_by.values())
    assert sum(machine.broken_by.values()) >= inside
    assert said(result, f"{inside} breakpoints inside the cycle, from slider-crank 7, load[0].force")


@pytest.mark.parametrize(
    ("level", "part"),
    [("normal", "not found a second time"), ("confirm", "other cells"), ("audit", "stepped in time")],
)
def test_each_level_tells_its_own_motion(level, part):
    result = explain(scenes.yoke(), level, 1e-4)
    assert part in result.motion
    assert said(result, "time stepping") == (level != "audit")
    simulation = result.sizing.cost.stages["simulation"].evaluations
    assert (f"with {simulation} evaluations" in result.motion) == (level in ("confirm", "audit"))


@pytest.mark.parametrize("level", ["confirm", "audit"])
def test_both_cycles_of_a_sizing_are_told(level):
    both = "one cycle with the exact flywheel and one with the approximate one, with"
    assert both in explain(scenes.yoke(), level, 1e-4).motion
    wheel = {"inertia": 400}
    assert "one cycle, with" in explain(scenes.yoke(flywheel=wheel), level, 1e-4).motion


def test_the_motion_of_an_analysis_is_the_one_that_gave_its_figures():
    assert "closed form" in explain(scenes.yoke(flywheel={"inertia": 400})).motion
    result = explain(regimes.scene("pump", inertia=5))
    assert result.sizing.simulation.route == "quadrature"
    assert result.motion.startswith("that of the collocation on the cells of the figures")


@pytest.mark.slow
def test_implicit_steps_are_told():
    """A linkage whose laws are known in plain numbers is stepped like any other machine; friction in a joint is none."""
    scene = tomllib.loads((EXAMPLES / "linkages" / "six_bar.toml").read_text())
    for other in (scene, scenes.yoke()):
        assert "implicitly" not in explain(other, "audit", 1e-4).motion
    scene["mechanism"]["joints"][1] |= {"friction": 0.05, "radius": 0.02}
    assert explain(scene, "audit", 1e-4).motion.startswith("stepped in time, implicitly, as a linkage")


def test_the_cost_is_told_as_measured():
    result = explain(scenes.yoke(), "confirm", 1e-4)
    cost, text = result.sizing.cost, result.text()
    assert result.as_dict()["cost"] == cost.as_dict()
    output = [line.split() for line in text[text.index("Cost, without") :].splitlines()]
    assert ["the", "whole", str(cost.evaluations)] in [row[:3] for row in output]
    assert [row[:2] for row in output[3:5]] == [[name, str(stage.evaluations)] for name, stage in cost.stages.items()]
    assert "flywheel tradeoff measures" in text


def test_a_diagram_of_areas_has_little_to_explain():
    areas = {"areas": {"values": [100, -100], "scale": "1 J"}, "regime": {"speed": "60 rpm"}}
    result = explain(areas | {"flywheel": {"irregularity": 0.02}})
    assert "diagram" in result.formulation
    assert result.because == ("the scene gives the areas themselves: areas.values",)
    assert result.forced == ()
    assert result.sizing.cost.evaluations == 0
    assert "Additional work" not in result.text()


def test_the_blocks_of_an_explanation():
    output = explain(scenes.yoke()).text()
    titles = [line for line in output.splitlines() if line and not line.startswith(" ")]
    assert titles == [
        "Method of solution (normal)",
        "What the torques depend on",
        "Not modelled, as this scene or this level does not need it",
        "Additional work beyond that of a smooth machine",
        "Cost, without the loading of libraries",
    ]
    assert output.endswith("\n")


def test_an_explanation_of_a_sizing_at_hand_runs_nothing_again():
    sizing = flywheel.size(flywheel.load(scenes.yoke()), accuracy="normal")
    assert explanation(sizing).sizing is sizing


def report(scene, level="normal", **options):
    return " ".join(text(flywheel.size(flywheel.load(scene), accuracy=level, **options)).split())


@pytest.mark.parametrize(
    ("level", "last"),
    [
        ("normal", "--accuracy confirm or audit confirms them."),
        ("confirm", "--accuracy audit steps the motion in time."),
        ("audit", "Nothing was left out at this level of accuracy (audit)."),
    ],
)
def test_the_last_line_tells_what_was_left_out(level, last):
    output = report(scenes.rotor(), level)
    assert output.endswith(last)
    assert f"({level})" in output


def test_a_diagram_of_areas_is_whole_at_every_level():
    areas = {"areas": {"values": [100, -100], "scale": "1 J"}, "regime": {"speed": "60 rpm"}}
    output = {report(areas | {"flywheel": {"irregularity": 0.02}}, level) for level in ("normal", "audit")}
    assert len(output) == 1
    assert output.pop().endswith("solved completely at every level of accuracy.")


def test_the_collocation_is_named():
    assert "Confirmed by periodic collocation, on separate cells" in report(scenes.rotor(), "confirm")


# What a sizing means: the irregularity that each flywheel gives.


def test_a_machine_without_inertia_has_the_irregularity_that_its_torques_leave():
    """100 - 2 omega drives it, 30 N m load it over half a turn: it runs between 35 and 50 rad/s; a wheel evens it."""
    scene = {
        "load": [{"on": "crank", "torque": -30.0, "from": 0.0, "to": "180 deg"}],
        "damper": [{"on": "crank", "coefficient": 2.0}],
        "drive": {"torque": 100.0},
    }
    sizing = flywheel.size(flywheel.load(scene | {"flywheel": {"irregularity": 1.5}}), simulate=False)
    exact, areas, _ = candidates(sizing)
    assert exact.inertia == 0.0
    assert exact.gives[0] == pytest.approx(15.0 / 42.5, rel=1e-9)
    given = flywheel.size(flywheel.load(scene | {"flywheel": {"inertia": areas.inertia}}), simulate=False)
    assert areas.gives[0] == pytest.approx(given.simulation.irregularity, rel=1e-9)
    assert areas.gives[0] < exact.gives[0]


# Input summary, and remarks on what in it is out of proportion.


PRESS = """
[mechanism]
type = "slider-crank"
crank.length = {crank}
rod = {{length = {rod}, mass = {mass}, inertia = {inertia}}}
[[load]]
on = "slider"
force = {force}
from = "340 deg"
to = "360 deg"
[drive]
torque = "balance"
[regime]
speed = {speed}
cycle = {cycle}
[flywheel]
irregularity = {irregularity}
"""
GOOD = {"crank": '"80 mm"', "rod": '"480 mm"', "mass": '"12 kg"', "inertia": '"0.3 kg m^2"', "force": '"-40 kN"'}
GOOD |= {"speed": '"60 rpm"', "cycle": '"360 deg"', "irregularity": "0.04"}


def press(**given):
    return parse_scene(PRESS.format(**GOOD | given))


def remarks(**given) -> dict[str, str]:
    return {remark.path: str(remark) for remark in press(**given).remarks}


def test_the_machine_as_it_was_read():
    assert scene_rows(press(crank="0.08", speed="60")) == [
        "Input summary",
        "  mechanism  slider-crank: crank 80 mm; rod 480 mm, 12 kg, 0.3 kg m²",
        "  load       on slider-crank.slider: -40 kN from 340 deg to 360 deg",
        "  drive      on crank: balance, a constant torque",
        "  runs       crank at 573 rpm, flywheel on crank for irregularity 0.04",
    ]


def test_metres_and_radians_a_second_show_at_once():
    text = "\n".join(scene_rows(press(crank="80", rod="480", speed="60", force='"-40.000 N"')))
    assert "crank 80 m" in text
    assert "573 rpm" in text
    assert "-40 N" in text


@pytest.mark.parametrize(
    ("given", "path", "words"),
    [
        ({"force": '"-40.000 N"'}, "load[0].force", '(the 1st [[load]], line 8): "-40.000 N" is -40 N; write "-40000 N"'),
        ({"mass": '"120.000 g"'}, "mechanism.rod.mass", 'write "120000 g"'),
        ({"crank": "80", "rod": "480"}, "mechanism.crank.length", '(line 4): 80 m; write "80 mm"'),
        ({"crank": "80", "rod": "480"}, "mechanism.rod.length", '480 m; write "480 mm"'),
        ({"speed": "60"}, "regime.speed", '573 rpm; write "60 rpm"'),
        ({"speed": "1500"}, "regime.speed", 'write "1500 rpm"'),
        ({"speed": '"200000 rpm"'}, "regime.speed", "2e+05 rpm; check its unit"),
        ({"speed": '"60000 rpm"'}, "mechanism.crank.length", "the crank pin runs at 502.7 m/s"),
        ({"irregularity": "0.9"}, "flywheel.irregularity", '±45 %; write "0.9 %"'),
        ({"mass": "1e5"}, "mechanism.rod.mass", "100000 kg on 0.48 m between its pins"),
        ({"inertia": '"3000 kg m^2"'}, "mechanism.rod.inertia", "at 15.81 m from the centre of 0.48 m"),
    ],
)
def test_remarks(given, path, words):
    assert words in remarks(**given)[path]


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"force": '"-40.500 N"'},
        {"force": '"-40.00 N"'},
        {"force": '"-4000.000 N"'},
        {"force": '"-0.000 N"'},
        {"speed": "6.283"},
        {"speed": "20.94"},
        {"irregularity": "0.2"},
        {"crank": '"2 m"', "rod": '"8 m"', "mass": '"12 t"', "speed": '"100 rpm"'},
    ],
)
def test_no_remarks_on_what_is_in_proportion(given):
    assert remarks(**given) == {}


def test_a_cycle_in_radians_that_was_meant_in_degrees():
    scene = build_scene({"regime": {"speed": 1, "cycle": 720}, "flywheel": {"inertia": 1}})
    assert [str(remark) for remark in scene.remarks] == [
        'regime.cycle: 720 without a unit is in rad, 114.6 turns; write "720 deg" if degrees are meant'
    ]


def test_a_load_with_the_wrong_sign_makes_the_drive_brake():
    (remark,) = scene_report.remarks(flywheel.size(press(force='"40 kN"'), accuracy="normal"))
    assert (remark.path, "it brakes" in remark.defect, "signs of the loads" in remark.advice) == ("drive", True, True)
    assert scene_report.remarks(flywheel.size(press(), accuracy="normal")) == ()


def test_a_rim_that_would_burst():
    wheel = 'irregularity = 0.04\nshape = "disc"\nmaterial = "alloy steel"\nouter_radius = "5 m"\n'
    text = PRESS.format(**GOOD | {"speed": '"900 rpm"'}).replace("irregularity = 0.04\n", wheel)
    result = scene_report.remarks(flywheel.size(parse_scene(text), accuracy="normal"))
    assert [remark.path for remark in result] == ["flywheel"]
    assert "its rim runs at 48" in result[0].defect


@pytest.mark.parametrize("path", sample(sorted(ROOT.glob("examples/**/*.toml")), 3), ids=lambda path: path.stem)
def test_no_remarks_on_the_examples(path):
    scene = read_scene(path)
    assert scene.remarks == ()
    assert all(len(line) <= 100 for line in scene_rows(scene))


@pytest.mark.parametrize("kind", kinds())
def test_no_remarks_on_the_starters(kind):
    scene = parse_scene(starter(kind))
    assert scene.remarks == ()
    assert len(scene_rows(scene)) >= 2


def test_remarks_stand_on_the_page_and_beside_data_on_standard_error(tmp_path):
    file = tmp_path / "press.toml"
    file.write_text(PRESS.format(**GOOD | {"force": '"-40.000 N"'}))
    page, data, points = (
        CliRunner().invoke(main, [*command, str(file)])
        for command in (("size", "--accuracy", "normal"), ("size", "--accuracy", "normal", "--json"), ("reduce",))
    )
    remark = 'load[0].force (the 1st [[load]], line 8): "-40.000 N" is -40 N'
    assert remark in page.stdout
    assert page.stdout.startswith("Input summary")
    assert page.stderr == ""
    for result in (data, points):
        assert f"{file}: remark: {remark}" in result.stderr
        assert "remark" not in result.stdout


def test_quantities_of_a_load_are_converted_in_the_order_of_its_sentence():
    losses = {"on": "yoke", "model": {"type": "losses", "constant": "25 N", "proportional": 5.0}}
    document = YOKE | {"load": [*YOKE["load"], losses]}
    rows = {lang: " ".join(map(str, _rows_in(lang, document))) for lang in ("en", "es")}
    assert "losses: constant 5.62 lbf, proportional 5" in rows["en"]
    assert "losses: constant 5,62 lbf, proportional 5" in rows["es"]


def _rows_in(lang, document):
    with use(lang):
        return list(parts(flywheel.load(document), US))
