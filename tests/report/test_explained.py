import flywheel
from flywheel.report.explanation import text
from tests import scenes


def test_the_blocks_of_an_explanation():
    told = text(flywheel.explain(flywheel.load(scenes.yoke()), accuracy="normal"))
    titles = [line for line in told.splitlines() if line and not line.startswith(" ")]
    assert titles == [
        "How it was worked out (normal)",
        "What the torques depend on",
        "Not modelled, as this scene or this level does not need it",
        "What takes more than a smooth machine would",
        "Libraries",
        "What each level of accuracy costs, loading of libraries left out (foretold times are rough)",
    ]
    assert max(map(len, told.splitlines())) <= 100
    assert told.endswith("\n")


def test_empty_blocks_are_left_out():
    areas = {"areas": {"values": [100, -100], "scale": "1 J"}, "regime": {"speed": "60 rpm"}}
    told = text(flywheel.explain(flywheel.load(areas | {"flywheel": {"irregularity": 0.02}})))
    assert "What takes more" not in told


def test_each_level_is_a_row_and_one_is_measured():
    rows = text(flywheel.explain(flywheel.load(scenes.rotor()), accuracy="confirm", rtol=1e-4)).splitlines()[-3:]
    assert [row.split()[0] for row in rows] == ["normal", "confirm", "audit"]
    assert [row.split()[-1] for row in rows] == ["foretold", "measured", "foretold"]
    assert rows[1].split()[2] == "1"
