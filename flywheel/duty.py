"""Duty of several phases: load of the motor by each cycle, mean and root mean square over stretches."""

from flywheel.sizing.duty import Stretch, mean, root_mean_square
from flywheel.sizing.results import Duty, PhaseLoad

__all__ = ["Duty", "PhaseLoad", "Stretch", "mean", "root_mean_square"]
