"""The machine as it was read, and remarks on what in it is out of proportion."""

from pathlib import Path

import pytest
from click.testing import CliRunner

import flywheel
from flywheel.cli import main
from flywheel.reading.scenes import build_scene, parse_scene, read_scene
from flywheel.starters import kinds, starter
from flywheel.tables import sizing as report
from flywheel.tables.scene import scene_rows
from tests.limits import sample

ROOT = Path(__file__).parents[2]
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
        "The machine as it was read",
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
    (remark,) = report.remarks(flywheel.size(press(force='"40 kN"'), accuracy="normal"))
    assert (remark.path, "it brakes" in remark.found, "signs of the loads" in remark.advice) == ("drive", True, True)
    assert report.remarks(flywheel.size(press(), accuracy="normal")) == ()


def test_a_rim_that_would_burst():
    wheel = 'irregularity = 0.04\nshape = "disc"\nmaterial = "alloy steel"\nouter_radius = "5 m"\n'
    text = PRESS.format(**GOOD | {"speed": '"900 rpm"'}).replace("irregularity = 0.04\n", wheel)
    found = report.remarks(flywheel.size(parse_scene(text), accuracy="normal"))
    assert [remark.path for remark in found] == ["flywheel"]
    assert "its rim runs at 48" in found[0].found


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
    assert page.stdout.startswith("The machine as it was read")
    assert page.stderr == ""
    for result in (data, points):
        assert f"{file}: remark: {remark}" in result.stderr
        assert "remark" not in result.stdout
