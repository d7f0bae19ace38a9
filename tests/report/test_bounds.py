import re

import pytest

import flywheel
from flywheel.report.report import headline, text
from tests import regimes, scenes
from tests.references.test_references import FOLDER


def report(scene, level="fast", **options):
    return " ".join(text(flywheel.size(flywheel.load(scene), accuracy=level, **options)).split())


def test_a_sizing_tells_its_bounds_and_their_width():
    told = report(scenes.yoke())
    low, high = map(float, re.search(r"between ([\d.]+) and ([\d.]+),", told).groups())
    assert low <= 353.521427322 <= high
    assert "do not suffice" not in told
    assert "accumulated areas 348.98939" in told


def test_printed_bounds_are_rounded_outwards():
    for name in ("yoke-60rpm", "press", "rotor-window"):
        sizing = flywheel.size(flywheel.load(FOLDER / "scenes" / f"{name}.toml"), accuracy="fast")
        low, high = map(float, re.search(r"between ([\d.]+) and ([\d.]+),", " ".join(text(sizing).split())).groups())
        assert low <= sizing.bounds.least <= sizing.bounds.greatest <= high


def test_a_wide_bracket_says_what_to_run():
    told = report(FOLDER / "scenes" / "press-fast.toml")
    assert "The areas do not suffice here: --accuracy normal works out the exact figure." in told


def test_an_analysis_has_its_irregularity_by_the_areas():
    told = report(scenes.yoke(flywheel={"inertia": 300}))
    assert "irregularity by the areas" in told
    assert "Proven: the exact irregularity lies between" in told
    slow = report(scenes.yoke(regime={"speed": "60 rpm"}, flywheel={"inertia": 6}))
    assert "does not exclude that the machine stops" in slow


def test_what_is_decided_is_said():
    heavy = scenes.rotor(inertia=[{"on": "crank", "value": 5000}])
    assert "Proven: no flywheel is needed" in report(heavy)
    light = scenes.yoke(load=[], inertia=[{"on": "crank", "value": 22}], flywheel={"irregularity": 0.1})
    assert flywheel.size(flywheel.load(light), accuracy="fast").flywheel.needed is None
    assert "leaves open whether a flywheel is needed" in report(light)


def test_torques_that_depend_on_speed_are_not_proven():
    told = report(regimes.scene("pump", irregularity=0.05))
    assert "Proven" not in told
    assert "nothing is proven" in told


@pytest.mark.parametrize(
    ("level", "last"),
    [
        ("fast", "--accuracy normal works out the exact figures."),
        ("normal", "--accuracy confirm or audit confirms them."),
        ("confirm", "--accuracy audit steps the motion in time."),
        ("audit", "Nothing was left out at this level of accuracy (audit)."),
    ],
)
def test_the_last_line_tells_what_was_left_out(level, last):
    told = report(scenes.rotor(), level)
    assert told.endswith(last)
    assert f"({level})" in told


def test_a_diagram_of_areas_is_whole_at_every_level():
    areas = {"areas": {"values": [100, -100], "scale": "1 J"}, "regime": {"speed": "60 rpm"}}
    told = {report(areas | {"flywheel": {"irregularity": 0.02}}, level) for level in ("fast", "audit")}
    assert len(told) == 1
    assert told.pop().endswith("worked out whole at every level of accuracy.")


def test_the_collocation_is_named():
    assert "Confirmed by periodic collocation, on cells of its own" in report(scenes.rotor(), "confirm")


def test_headlines_say_that_a_figure_is_by_the_areas():
    sized, given = (
        flywheel.size(flywheel.load(scenes.yoke(flywheel=wheel)), accuracy="fast")
        for wheel in ({"irregularity": 0.04}, {"inertia": 300})
    )
    assert "flywheel by the areas 348.989 kg m²" in headline(sized)
    assert headline(given).endswith("by the areas")
