"""Irregularities from 1e-14 to 1.99 and speeds from 1e-6 to 1e6 rad/s, for every mechanism, against 30 digits."""

from __future__ import annotations

import pytest

import flywheel
from tests.limits import sample

from .machines import MACHINES, Scene, running
from .measured import Row, measured, names, refusal, row

SWEEPS = names("sweep")
BEYOND = (0.0, -1e-14, 2.0, 2.5)


def results() -> list[Row]:
    """One row per mechanism."""
    span = "eps 1e-14..1.99, speed 1e-6..1e6 rad/s"
    refused = [Row("irregularity", f"{eps:g}", None, None, refusal(even(eps))) for eps in BEYOND]
    return [*(row(name.replace("sweep ", ""), span, measured(name)) for name in SWEEPS), *refused]


def even(eps: float) -> Scene:
    """A scotch yoke for an irregularity."""
    return running(MACHINES["scotch-yoke"](), 6.0, eps)


@pytest.mark.parametrize("name", sample(SWEEPS, 6))
def test_every_figure_is_known_to_its_estimate_and_to_rtol(name: str) -> None:
    assert [item for item in measured(name) if not item.honest] == []
    assert [item for item in measured(name) if not item.kept] == []


@pytest.mark.slow
def test_nothing_in_the_range_is_worse_than_rtol() -> None:
    assert max(found.error or 0.0 for found in results()) < 1e-9
    exact = [item for name in SWEEPS for item in measured(name) if item.figure == "exact" and item.rtol <= 1e-9]
    assert max(item.estimate for item in exact) < 5e-8


@pytest.mark.parametrize("eps", BEYOND)
def test_an_irregularity_beyond_the_range_is_refused(eps: float) -> None:
    assert refusal(even(eps)).startswith("flywheel.irregularity: found ")


@pytest.mark.parametrize("speed", [0.0, -1.0])
def test_a_speed_that_is_none_is_refused(speed: float) -> None:
    assert refusal(running(MACHINES["scotch-yoke"](), speed)).startswith("regime.speed: found ")


@pytest.mark.parametrize(
    ("name", "eps", "speed"),
    sample([("scotch-yoke", 1e-9, 6.0), ("rotor", 1.99, 10.0), ("slider-crank", 0.05, 1e6), ("scotch-yoke", 0.05, 1e-6)], 4),
)
def test_the_time_stepping_agrees_within_what_it_states(name: str, eps: float, speed: float) -> None:
    found = flywheel.size(flywheel.load(running(MACHINES[name](), speed, eps)))
    assert found.simulation is not None
    assert found.error.simulation is not None
    gap = abs(found.simulation.irregularity / eps - 1)
    assert gap <= found.error.simulation + found.error.exact
