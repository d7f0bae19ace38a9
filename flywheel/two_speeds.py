"""A flywheel between two speeds: energy given, inertia, irregularity."""

from flywheel.components.press_work import Speeds, energy_given, extreme_speeds, inertia_between, inertia_for, speed_after

__all__ = ["Speeds", "energy_given", "extreme_speeds", "inertia_between", "inertia_for", "speed_after"]
