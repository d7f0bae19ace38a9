"""Motors: torque against speed, current and heat of each kind; uses `numerics` and `language` alone."""

from flywheel.components.motors.curves import Constant, Curve, Engine, Hydraulic, Line, line_from_no_load, line_through
from flywheel.components.motors.direct_current import DC, Servo, dc_from_plate
from flywheel.components.motors.induction import Induction, Plate
from flywheel.components.motors.inverter import InverterInduction
from flywheel.components.motors.motor import Connection, Inverter, Motor, Point, Start, Switch
from flywheel.components.motors.starting import (
    Started,
    field_steps,
    resistance_steps,
    soft_start,
    star_delta,
    transformer,
)
from flywheel.components.motors.synchronous import Synchronous
from flywheel.components.motors.thermal import Thermal, thermal
from flywheel.components.motors.two_axis import EquivalentCircuit, Impedances, TwoAxisInduction

__all__ = [
    "DC", "Connection", "Constant", "Curve", "Engine", "EquivalentCircuit", "Hydraulic", "Impedances", "Induction",
    "Inverter", "InverterInduction", "Line", "Motor", "Plate", "Point", "Servo", "Start", "Started", "Switch",
    "Synchronous", "Thermal", "TwoAxisInduction", "dc_from_plate", "field_steps", "line_from_no_load", "line_through",
    "resistance_steps", "soft_start", "star_delta", "thermal", "transformer",
]  # fmt: skip
