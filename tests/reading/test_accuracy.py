import pytest

import flywheel
from flywheel.scene import accuracy
from tests import regimes, scenes

AREAS = {"areas": {"values": [100, -100], "scale": "1 J"}, "regime": {"speed": "60 rpm"}, "flywheel": {"irregularity": 0.02}}


def scene(**changes):
    return flywheel.load(scenes.yoke(**changes))


def test_the_levels_and_what_simulate_means():
    assert accuracy.LEVELS == ("fast", "normal", "confirm", "audit")
    assert accuracy.level() == accuracy.level(simulate=True) == accuracy.level("audit", True) == "audit"
    assert accuracy.level(simulate=False) == accuracy.level("normal", False) == "normal"
    assert [accuracy.level(name) for name in accuracy.LEVELS] == ["normal", *accuracy.LEVELS[1:]]


@pytest.mark.parametrize(("name", "simulate"), [("audit", False), ("confirm", False), ("fast", True), ("normal", True)])
def test_contradictions_are_refused(name, simulate):
    with pytest.raises(ValueError, match="contradicts"):
        flywheel.size(scene(), accuracy=name, simulate=simulate)


@pytest.mark.parametrize("name", ["Fast", "", "exact"])
def test_another_name_is_refused_with_the_four(name):
    with pytest.raises(ValueError, match="expected one of fast, normal, confirm, audit"):
        flywheel.size(scene(), accuracy=name)


def test_the_default_is_an_audit():
    sizing = flywheel.size(scene())
    assert (sizing.accuracy, sizing.simulation.route, sizing.left_out) == ("audit", "time", ())


def test_what_each_level_leaves_out():
    found = {level: flywheel.size(scene(), accuracy=level).as_dict() for level in accuracy.LEVELS}
    assert [found[level]["accuracy"] for level in accuracy.LEVELS] == ["normal", "normal", "confirm", "audit"]
    assert [len(found[level]["left_out"]) for level in accuracy.LEVELS] == [1, 1, 1, 0]
    assert "confirmation" in found["normal"]["left_out"][0]
    assert "time simulation" in found["confirm"]["left_out"][0]


def test_the_exact_figures_are_the_same_from_normal_on():
    found = [flywheel.size(scene(), accuracy=level).flywheel for level in accuracy.LEVELS]
    assert found[0] == found[1] == found[2] == found[3]
    assert flywheel.size(scene(), simulate=False).flywheel == found[0]


def test_a_diagram_of_areas_is_worked_out_whole_at_every_level():
    for given in ({}, {"flywheel": {"inertia": 50}}):
        found = [flywheel.size(flywheel.load(AREAS | given), accuracy=level) for level in accuracy.LEVELS]
        assert [sizing.left_out for sizing in found] == [()] * 4
        assert all(sizing.flywheel == found[0].flywheel for sizing in found)
        assert all(sizing.simulation == found[0].simulation for sizing in found)


def test_what_could_not_be_confirmed_counts_as_left_out(monkeypatch):
    monkeypatch.setattr("flywheel.sizing.confirmation._MOST", 100)
    monkeypatch.setattr("flywheel.sizing.confirmation._MOST_WORK", 10)
    for level in ("confirm", "audit"):
        sizing = flywheel.size(scene(), accuracy=level)
        assert sizing.simulation.route == "quadrature"
        assert "confirmation" in sizing.left_out[0]
        assert any("not confirmed" in message for message in sizing.messages)


@pytest.mark.parametrize("level", accuracy.LEVELS)
def test_every_level_raises_what_is_wrong_with_the_machine(level):
    with pytest.raises(flywheel.SceneError, match="net work"):
        flywheel.size(scene(drive={"torque": "1 N m"}), accuracy=level)
    with pytest.raises(flywheel.SceneError, match="cannot carry the mean load"):
        flywheel.size(flywheel.load(regimes.BAD["starved"].scene | {"regime": {}}), accuracy=level)
