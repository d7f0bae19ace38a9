"""Shafts geared to one another, with losses in their meshes."""

from flywheel.components.gear_trains import Mesh, Running, Shaft, Stage, geared_acceleration, geared_torque, with_rope

__all__ = ["Mesh", "Running", "Shaft", "Stage", "geared_acceleration", "geared_torque", "with_rope"]
