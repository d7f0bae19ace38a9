"""What all methods are asked for, and how errors are relative."""

import pytest

import flywheel
from flywheel.machine.machine import Machine
from flywheel.study.reference import Question, answer
from tests.scenes import shaper, yoke


def asked_and_sizing(scene):
    machine = Machine(flywheel.load(scene))
    sizing = flywheel.size(machine, simulate=False)
    return Question.of(sizing), sizing


def test_a_sizing_asks_for_the_exact_flywheel():
    asked, sizing = asked_and_sizing(yoke())
    assert (asked.figure, asked.unit) == ("exact flywheel", "kg m²")
    assert answer(sizing) == sizing.flywheel.exact
    assert asked.scale == pytest.approx(sizing.energy_fluctuation / (0.04 * sizing.speed**2), rel=1e-12)


def test_an_analysis_asks_for_the_irregularity():
    asked, sizing = asked_and_sizing(yoke(flywheel={"inertia": 300}))
    assert (asked.figure, asked.unit, asked.scale) == ("irregularity", "", 0.0)
    assert answer(sizing) == pytest.approx(sizing.run.irregularity, rel=1e-12)


def test_errors_of_a_flywheel_near_nothing_are_relative_to_the_scale():
    asked, _ = asked_and_sizing(yoke())
    assert asked.error(1.01 * asked.scale, asked.scale) == pytest.approx(0.01)
    assert asked.error(0.01 * asked.scale, 0.0) == pytest.approx(0.01)
    assert asked.error(1.02 * 3 * asked.scale, 3 * asked.scale) == pytest.approx(0.02)


def test_inertia_on_a_shaft_goes_to_the_crank_by_the_square_of_its_ratio():
    asked, _ = asked_and_sizing(shaper(flywheel={"irregularity": 0.1, "on": "bull"}))
    assert asked.crank == 0.25
