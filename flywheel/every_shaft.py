"""The same flywheel on every shaft of a train, and GD²."""

from flywheel.components.gear_trains import OnShaft, gd2, on_every_shaft

__all__ = ["OnShaft", "gd2", "on_every_shaft"]
