"""The page of answers: it fits every machine, shows what the sizing found, and hides no warning."""

import re
from dataclasses import replace
from pathlib import Path

import pytest
from click.testing import CliRunner

import flywheel
from flywheel.cli import main
from flywheel.language import use
from flywheel.tables import answers
from flywheel.tables.trade_units import US, five_digits

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
SIZED = [path for path in SCENES if "[flywheel]" in path.read_text() and "[stroke]" not in path.read_text()]


def sized(speed="60 rpm", eps=0.04, **more):
    scene = YOKE | {"regime": {"speed": speed}, "flywheel": {"irregularity": eps}} | more
    return flywheel.size(flywheel.load(scene), simulate=False)


def block(sizing, name, units="si"):
    return next(found for found in answers.answers(sizing, units) if found.name == name)


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
    (told,) = block(heavy, "flywheel").sentences
    assert told == "No flywheel is needed: the machine's own inertia suffices and gives 0.035360."


def test_what_is_not_confirmed_or_not_reached_is_said():
    assert block(sized(), "run").sentences == ("NOT confirmed at accuracy normal: audit takes a second route.",)
    message = "rtol 1e-09 not reached: the exact inertia is good to 0.003 (estimated, relative)"
    off = replace(sized(), error=sized().error._replace(exact=3e-3), messages=(message,))
    text = " ".join(answers.text(off).split())
    assert "The accuracy asked for was NOT reached: a figure may be off by 0.3 %." in text
    assert f"Note: {message}" in text
    assert "353.5 ± 1.1" in text or "354 ± 1" in text


def test_units_of_the_united_states_are_those_of_the_same_figures():
    sizing = sized()
    found = block(sizing, "flywheel", "us")
    assert found.header[1] == "WR², lb ft²"
    assert float(found.table[0][1]) == pytest.approx(sizing.flywheel.exact / (0.45359237 * 0.3048**2), rel=1e-4)
    text = answers.text(sizing, "us")
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
        text = answers.text(sized())
    assert "353,52" in text
    assert "Volante en la manivela para irregularidad 0,04 (±2 %)" in text
    assert not re.search(r"\d\.\d", text)


def test_weight_is_told_where_it_acts():
    assert ("gravity", "9.80665 m/s² at -90 deg, on all that has a mass", "", "") in block(sized(gravity={}), "machine").rows
    assert not any(row.label == "gravity" for row in block(sized(), "machine").rows)


def test_a_long_machine_is_counted_and_not_cut():
    loads = [{"on": "crank", "torque": -float(k + 1), "from": k, "to": k + 1} for k in range(5)]
    text = answers.text(sized(load=[*YOKE["load"], *loads], inertia=[{"on": "crank", "value": 0.1}] * 9))
    assert len(text.splitlines()) <= 24
    assert re.search(r"and .*6 × load, drive: see --full", text)


def test_the_data_are_plain():
    found = [part.as_dict() for part in answers.answers(sized())]
    assert found[2]["table"][0][0] == "exact (Wittenbauer)"
    assert found[1]["rows"][0] == {
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
        (("--explain",), "How it was worked out"),
    ],
)
def test_the_command_prints_the_page_and_what_else_is_asked(scene, options, says):
    found = CliRunner().invoke(main, ["size", str(scene), "--no-simulate", *options])
    assert found.exit_code == 0
    assert says in found.stdout


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
                lines = answers.text(sizing, units).splitlines()
            assert len(lines) <= 26
            assert max(map(len, lines)) <= 80
            parted = re.compile(r"\d\n +(kg|mm|N|kN|W|kW|J|rpm|deg|in|lb|hp|%)(?!\w)|(kg|lb)\n +(m²|ft²)")
            assert not parted.search("\n".join(lines))  # a number and its unit
