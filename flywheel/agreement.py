"""What a confirmation finds, and how far it agrees with what it confirms: that is the error reported."""

from __future__ import annotations

from typing import NamedTuple

from flywheel import steady
from flywheel.piecewise import ROUNDING
from flywheel.regime import Cycle
from flywheel.results import Confirmation, Sizing
from flywheel.steady import Run


class Found(NamedTuple):
    """One steady cycle as a route of its own finds it: rad/s and s; `closure` is omega(T)/omega(0) - 1."""

    irregularity: float
    speed_max: float
    speed_min: float
    period: float
    closure: float


def disagreement(found: Found, cycle: Cycle, speed: float, run: Run, rtol: float) -> tuple[float, float]:
    """Largest relative difference between the figures found and those of a run over a cycle, and the run's own doubt.

    First that of all figures, then that of the period alone.

    Args:
        found: by the confirming route.
        cycle: that the run belongs to.
        speed: mean of extremes of the run, rad/s.
        run: the motion that is confirmed.
        rtol: relative error allowed in the run's period.

    """
    period, period_doubt = steady.period(cycle, speed, run, rtol)
    speed_doubt = run.error * run.irregularity * speed / run.speed_min
    pairs = [
        (found.irregularity, run.irregularity, run.error),
        (found.speed_max, run.speed_max, speed_doubt),
        (found.speed_min, run.speed_min, speed_doubt),
        (found.period, period, period_doubt),
    ]
    apart = [8 * ROUNDING + abs(a / b - 1) + doubt for a, b, doubt in pairs if b > 0.0]
    return max(apart), apart[-1]


def confirmation(sizing: Sizing, found: Found, approximate: float | None, route: str) -> Confirmation:
    """What a sizing reports of its confirmation; `approximate` is the irregularity with the approximate flywheel."""
    return Confirmation(
        irregularity=found.irregularity,
        irregularity_approximate=approximate,
        speed_max=found.speed_max,
        speed_min=found.speed_min,
        speed_time_mean=sizing.scene.cycle / found.period,
        period=found.period,
        closure=found.closure,
        route=route,
    )
