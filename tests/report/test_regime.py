"""The steps of the regime: every number comes from an earlier one, and every substitution gives the result shown."""

from dataclasses import replace

import pytest

from flywheel.report import regime
from flywheel.report.document import Note, steps, unreproduced, untraced
from tests.report.scenes import printed, sized, steps_of

SCENES = (
    *("exams/p103_1", "exams/march_2012", "exams/p107_2", "machines/press", "machines/press_given", "machines/diagram"),
    *("machines/punch", "machines/engine", "regimes/section_c"),
)


def results(document):
    return {step.result.symbol: step.result.value for step in steps(document.parts) if step.result is not None}


@pytest.mark.parametrize("name", SCENES)
def test_every_number_is_found_above_and_every_substitution_comes_out(name):
    document = steps_of(sized(f"{name}.toml"))
    assert untraced(document) == []
    assert unreproduced(document) == []


def test_the_results_are_those_of_the_sizing():
    sizing = sized("machines/press.toml")
    found = results(steps_of(sizing))
    assert found["J"] == sizing.flywheel.exact
    assert found["J_areas"] == sizing.flywheel.approximate
    assert found["J_torque"] == sizing.flywheel.inertia_torque
    assert found["M_d"] == sizing.balance.value
    assert found["DeltaW"] == sizing.energy_fluctuation
    assert found["MN"] / (0.15 * sizing.speed**2) == pytest.approx(sizing.flywheel.exact, rel=1e-12)


def test_a_flywheel_on_another_shaft_stands_there_too():
    sizing = sized("exams/march_2012.toml")
    found = results(steps_of(sizing))
    assert found["J_f"] == sizing.flywheel.exact
    assert found["J"] == pytest.approx(100 * sizing.flywheel.exact, rel=1e-12)


def test_messages_and_what_is_left_out_reach_the_reader():
    sizing = sized("machines/press.toml")
    told = regime.accuracy(regime.Known(replace(sizing, messages=("doubtful",))), ["too light"])
    notes = {(part.kind, part.text) for part in told.parts if isinstance(part, Note)}
    assert {("remark", "Remark: doubtful"), ("remark", "Remark: too light")} <= notes
    assert any(kind == "left out" and "a confirmation" in text for kind, text in notes)


@pytest.mark.parametrize("name", ["p103_1", "may_2014", "march_2010"])
def test_the_printed_answers_stand_beside_ours(name):
    table = printed(name).parts[0]
    verdicts = {row[-1] for row in table.rows}
    assert verdicts <= {"agrees", "misprint [1]", "misprint [2]"}
    assert ("misprint [1]" in verdicts) == (name != "p103_1")
