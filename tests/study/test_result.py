"""What is concluded from a comparison, in all cases."""

import json

import pytest

from tests.study.made import compared, row, whole

GRID = row("plain grid", "36 angles", 1e-7, 1e-4)
EXACT = row("exact, closed form", "rtol 1e-06", 3e-16, 6e-4, promised=1e-6)
LOOSE = row("exact, closed form", "rtol 0.001", 3e-16, 5e-4, promised=1e-3)
LEFT = row("whole bond graph", "rtol 1e-06", None)


def test_nothing_keeps_it():
    found = compared(row("plain grid", "36 angles", 0.1))
    assert found.sentence == "No method that was run keeps the relative error of 1e-06 on this scene."


def test_the_cheapest_promises_it():
    found = compared(GRID, EXACT, cheapest=EXACT.name, cheapest_promised=EXACT.name)
    assert found.sentence.startswith(
        "Cheapest that keeps a relative error of 1e-06 on this scene: exact, closed form, rtol 1e-06"
    )
    assert "0.6 ms" in found.sentence
    assert "does not know" not in found.sentence


@pytest.mark.parametrize("best", [GRID, LOOSE])
def test_the_cheapest_does_not_know_it(best):
    found = compared(best, EXACT, cheapest=best.name, cheapest_promised=EXACT.name)
    assert "the cheapest that promises it is exact, closed form, rtol 1e-06" in found.sentence


def test_none_that_promises_it_was_run():
    found = compared(GRID, LEFT, cheapest=GRID.name)
    assert found.sentence.endswith("none that does was run to its end.")


def test_those_that_are_level_are_named():
    found = compared(LOOSE, EXACT, cheapest=EXACT.name, level=(LOOSE.name,), cheapest_promised=EXACT.name)
    assert "level with it within the noise: exact, closed form, rtol 0.001." in found.sentence


@pytest.mark.parametrize(
    ("rows", "interrupted", "complete"),
    [
        ((GRID, EXACT), False, True),
        ((GRID, row("whole bond graph", "", None, outcome="no answer")), False, True),
        ((GRID, row("whole bond graph", "", None, outcome="out of time")), False, False),
        ((GRID, LEFT), False, False),
        ((GRID, EXACT), True, False),
    ],
)
def test_what_is_whole(rows, interrupted, complete):
    assert compared(*rows, interrupted=interrupted).complete is complete


def test_rows_are_found_by_name():
    assert compared(GRID, EXACT).row(EXACT.name) is EXACT


def test_data_are_plain():
    found = whole()
    data = json.loads(json.dumps(found.as_dict()))
    assert [entry["name"] for entry in data["rows"]] == [own.name for own in found.rows]
    assert data["sentence"] == found.sentence
    assert data["reference"]["value"] == 2.0
