"""State of a machine at any position: m* and F* or I* and M*, also along a motion."""

from flywheel.regime.state import MachineState, Passage, along, reduce

__all__ = ["MachineState", "Passage", "along", "reduce"]
