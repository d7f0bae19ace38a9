"""A comparison as text: question, reference, table, what is missing, what follows."""

import pytest

from flywheel.study.tradeoff import ordered
from flywheel.tables.rows import plain
from flywheel.tables.tradeoffs import error, text, unfinished
from tests.study.made import compared, row, whole


def lines_of(found):
    return text(found).splitlines()


def line(found, start):
    return next(each for each in lines_of(found) if each.strip().startswith(start))


def test_the_question_and_its_reference_come_first():
    told = lines_of(whole())
    assert told[:3] == [
        "Rotor",
        "Accuracy against time: the exact flywheel, to a relative error of 1e-06",
        "  reference  2 kg m², itself in doubt by 1.0e-14 (relative)",
    ]
    assert "Second route: the closed form is 1e-15 apart" in text(whole())
    assert "Errors are relative to 2.5 kg m²" in text(whole())


def test_an_analysis_has_no_unit_and_no_scale():
    told = text(compared(figure="irregularity", unit="", scale=0.0, title=None))
    assert told.startswith("Accuracy against time: the irregularity")
    assert "  reference  2, itself" in told
    assert "Errors are relative" not in told


def test_a_line_of_the_table_has_all_that_was_measured():
    assert line(whole(), "36 steps, restarted").split()[3:] == ["4.0e-07", "yes", "400", "625", "100", "7"]
    assert line(whole(), "accumulated areas").split()[2:] == ["2.0e-02", "no", "0.6", "0.94", "100", "7"]


def test_errors_below_the_doubt_are_told_as_that():
    assert line(whole(), "rtol 1e-06").split()[2:4] == ["<", "1.0e-14"]
    assert error(whole(), row("a", error=0.0)) == "< 1.0e-14"
    assert error(whole(), row("a", error=1.1e-14)) == "1.1e-14"


def test_the_cheapest_and_its_equals_are_marked():
    found = whole()
    assert line(found, "rtol 1e-06").endswith("cheapest")
    assert line(found, "rtol 0.001").endswith("level")
    assert not line(found, "36 angles").endswith(("cheapest", "level", "promised"))
    promised = compared(*found.rows, cheapest=found.rows[0].name, cheapest_promised=found.cheapest)
    assert line(promised, "rtol 1e-06").endswith("promised")


def test_without_a_cheapest_there_is_no_ratio():
    found = compared(row("plain grid", "36 angles", 0.1))
    header = next(each for each in lines_of(found) if "time, ms" in each)
    assert "ratio" not in header
    assert header.split() == ["error", "keeps", "time,", "ms", "positions", "runs"]
    assert line(found, "36 angles").split()[2:] == ["1.0e-01", "no", "1", "100", "7"]


def test_families_stand_together_in_order():
    told = [each.strip() for each in lines_of(whole())]
    heads = [own for own in told if own in {entry.family for entry in whole().rows}]
    assert heads == ["plain grid", "exact, closed form", "time stepping, Euler", "time stepping, RK4"]
    fixed = [own.name for own in ordered(whole().rows) if "RK4" in own.name]
    assert fixed == ["time stepping, RK4, 36 steps, restarted", "time stepping, RK4, 36 steps"]
    assert [own.family for own in ordered([row("unheard of"), row("collocation")])] == ["collocation", "unheard of"]


def test_those_without_an_answer_are_told_with_the_reason():
    told = lines_of(whole())
    assert "  not run (the budget was spent): time stepping, Euler, without restart" in told
    assert "  no answer (the machine stops): Lagrange's multipliers" in told
    assert "  not for this scene: whole bond graph: it takes no springs" in told


def test_one_reason_is_told_once():
    rows = [row("time stepping, RK4", f"{n} steps{r}", None) for n in (36, 360) for r in ("", ", restarted")]
    rows += [row("time stepping, RK45", f"rtol {rtol:g}, restarted", None) for rtol in (1e-6, 1e-9)]
    rows += [row("time stepping, RK45", "rtol 1e-06")]
    rows += [row("plain grid", f"{n} angles", None if n == 36 else 0.1) for n in (36, 360)]
    told = text(compared(*rows))
    assert told.count("not run") == 1
    assert "not run: plain grid (36 angles); time stepping, RK4; time stepping, RK45, restarted\n" in told


def test_what_methods_leave_out_is_told_once():
    told = lines_of(whole())
    assert "  accumulated areas: that I* varies over the cycle" in told
    assert "  plain grid: angles between" in told
    assert "  time stepping, Euler, RK4, without restart: jumps within steps" in told


@pytest.mark.parametrize("changes", [{}, {"interrupted": True}])
def test_a_table_that_is_not_whole_says_so_in_its_last_line(changes):
    found = compared(row("plain grid", "36 angles"), row("collocation", "", None), budget=30.0, **changes)
    wanted = {
        False: "NOT WHOLE: 1 of 2 methods were run to their end within 30 s; --budget 60 runs more.",
        True: "NOT WHOLE: interrupted; 1 of 2 methods were run to their end.",
    }[found.interrupted]
    assert lines_of(found)[-1] == wanted
    assert unfinished(found) == [wanted]


def test_nothing_finished_is_a_text_too():
    told = text(compared(row("plain grid", "36 angles", None), interrupted=True))
    assert "No method that was run keeps" in told
    assert "time, ms" not in told


def test_the_width_is_kept():
    wide = whole()
    slow = tuple(own if own.seconds is None else own._replace(seconds=37.123456 * own.seconds / 1e-3) for own in wide.rows)
    assert max(map(len, lines_of(compared(*slow, cheapest=wide.cheapest, cheapest_promised=slow[3].name)))) <= 100


@pytest.mark.parametrize(
    ("value", "decimals", "told"),
    [
        (0.0123456, 3, "0.012"),
        (0.123456, 3, "0.123"),
        (12.3456, 3, "12.3"),
        (123456.0, 3, "123000"),
        (1.0, 2, "1"),
        (3e-5, 2, "0.00003"),
    ],
)
def test_numbers_without_exponents(value, decimals, told):
    assert plain(value, decimals) == told
