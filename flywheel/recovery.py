"""Recovery of a flywheel between two strokes by its motor."""

from flywheel.components.press_work import (
    inertia_on_line,
    recovery_time,
    recovery_time_of_induction,
    recovery_time_on_line,
    steady_on_line,
)

__all__ = ["inertia_on_line", "recovery_time", "recovery_time_of_induction", "recovery_time_on_line", "steady_on_line"]
