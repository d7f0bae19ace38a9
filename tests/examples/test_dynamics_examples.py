"""The comparison of routes runs and every route agrees with the equation written by hand."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "examples" / "dynamics"


@pytest.mark.slow
def test_three_routes_agree(capsys):
    runpy.run_path(str(FOLDER / "three_routes.py"), run_name="__main__")
    printed = capsys.readouterr().out
    assert "20.27035683" in printed
    rows = [line.split() for line in printed.splitlines() if line.endswith("agrees")]
    assert [row[0] for row in rows] == ["reduced", "newton", "multipliers", "energy"]
    assert "DISAGREES" not in printed
    assert max(float(row[2]) for row in rows) < 1e-15
