"""Energy of a cycle: mean power, kilowatt hours, kilocalories."""

from flywheel.components.energy import HOUR, KILOCALORIE, KILOWATT_HOUR, Energy, kilocalories, kilowatt_hours, of_cycle

__all__ = ["HOUR", "KILOCALORIE", "KILOWATT_HOUR", "Energy", "kilocalories", "kilowatt_hours", "of_cycle"]
