"""Arm of two links: inertia matrix, energy, driving torques, reactions, motion; Lagrange's equations of open arms."""

from flywheel.components.robot_arm import *  # noqa: F403  # what is listed there
from flywheel.components.robot_arm import __all__ as __all__
