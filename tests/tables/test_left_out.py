import pytest

import flywheel
from flywheel.tables.sizing import text
from tests import scenes


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
    told = report(scenes.rotor(), level)
    assert told.endswith(last)
    assert f"({level})" in told


def test_a_diagram_of_areas_is_whole_at_every_level():
    areas = {"areas": {"values": [100, -100], "scale": "1 J"}, "regime": {"speed": "60 rpm"}}
    told = {report(areas | {"flywheel": {"irregularity": 0.02}}, level) for level in ("normal", "audit")}
    assert len(told) == 1
    assert told.pop().endswith("worked out whole at every level of accuracy.")


def test_the_collocation_is_named():
    assert "Confirmed by periodic collocation, on cells of its own" in report(scenes.rotor(), "confirm")
