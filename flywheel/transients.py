"""Motions in time: run-up, run-down, load steps, stalls, with energy, heat and peaks."""

from flywheel.motions.motion import Energy, Peak, Peaks, Samples, Transient, sampled, time_along
from flywheel.motions.simulation import Regime
from flywheel.motions.transients import run_down, run_up, transient

__all__ = [
    "Energy", "Peak", "Peaks", "Regime", "Samples", "Transient", "run_down", "run_up", "sampled", "time_along",
    "transient",
]  # fmt: skip
