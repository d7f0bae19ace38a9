"""Jumps, kinks and window ends that all but coincide, tables with repeated angles; against 30 digits, or refused."""

from __future__ import annotations

from math import tau

import pytest

import flywheel
from tests.limits import sample

from .cases import turning
from .measured import Row, measured, names, refusal, row

CASES = names("coincidence", "table")
FAULTY = {
    "three equal angles": ([0, 1, 1, 1, tau], "load[0].table: found three equal angles from row 2, expected two at most"),
    "a jump at the first row": ([0, 0, 1, tau], "load[0].table: found a jump at the first row"),
    "a jump at the last row": ([0, 1, tau, tau], "load[0].table: found a jump at the last row"),
    "an angle that goes back": ([0, 2, 1, tau], "load[0].table: found an angle in row 3 that is less"),
    "less than a turn": ([0, 1, 2, 6.28], "load[0].table: found angles from 0 deg to "),
}


def table(angle: list[float], way: str = "linear") -> dict[str, object]:
    """A torque by a table."""
    value = [100.0 * (-1) ** i for i in range(len(angle))]
    return {"table": {"angle": angle, "value": value, "interpolation": way}}


def results() -> list[Row]:
    """One row for each kind, and the words of every refusal."""
    near, read = ([item for name in names(group) for item in measured(name)] for group in ("coincidence", "table"))
    said = [Row("table", key, None, None, refusal(turning([table(angle)]))) for key, (angle, _) in FAULTY.items()]
    return [
        row("kink, jump, window end beside another breakpoint or the seam", "0, 1e-15..1e-9 rad apart", near),
        row("tables with repeated angles", "inside, at the seam, 1e-9 rad apart; linear, step, pchip", read),
        *said,
    ]


@pytest.mark.parametrize("name", sample(CASES, 5))
def test_every_figure_is_known_to_its_estimate_and_to_rtol(name: str) -> None:
    assert [item for item in measured(name) if not item.honest] == []
    assert [item for item in measured(name) if not item.kept] == []


@pytest.mark.parametrize("way", ["linear", "step", "pchip"])
@pytest.mark.parametrize("name", FAULTY)
def test_a_table_out_of_order_is_refused_with_its_row(name: str, way: str) -> None:
    angle, said = FAULTY[name]
    assert refusal(turning([table(angle, way)])).startswith(said)


@pytest.mark.parametrize("torque", ["100*sin(phi)*(1 - cos(phi))", "100*abs(sin(phi)) - 200/pi", "100*sign(sin(2*phi))"])
def test_zeros_of_the_moment_on_breakpoints_make_no_areas_of_their_own(torque: str) -> None:
    found = flywheel.size(flywheel.load(turning([{"torque": torque}])), simulate=False)
    expected = {"100*sin(phi)*(1 - cos(phi))": 2, "100*abs(sin(phi)) - 200/pi": 5, "100*sign(sin(2*phi))": 4}[torque]
    assert len(found.areas) == expected
    assert all(abs(area.work) > 1.0 for area in found.areas)
