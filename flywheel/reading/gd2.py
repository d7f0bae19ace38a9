"""GD², the old measure of a flywheel: mass times the square of the diameter of gyration, or weight times that square."""

from __future__ import annotations

import re

from flywheel.advice import show
from flywheel.reading.fields import Faults
from flywheel.reading.schema import GD2
from flywheel.units import QuantityError, parse_quantity, split_quantity

_STANDARD = 9.80665
_FORCES = re.compile(r"N|kgf|lbf")
_EXPECTED = 'a GD² such as "48 kg m^2" or "48 kgf m^2", or a bare number in kg m^2'


def read_gd2(value: object, path: str, faults: Faults) -> float | None:
    """The inertia (kg m²) of a GD²: J = GD²/4 of a mass times a square, GD²/(4 g) of a weight times a square.

    The two forms have the same number in kg m² and in kgf m², g being the 9.80665 m/s² of the kilogram-force.
    None after noting a fault.

    Source: technical system of units; G was the weight, D twice the radius of gyration.

    >>> read_gd2("48 kg m^2", "flywheel.gd2", Faults()), read_gd2("48 kgf m^2", "flywheel.gd2", Faults())
    (12.0, 12.0)
    """
    try:
        found = _mass_form(value)
    except QuantityError as error:
        faults.add(path, error.found, _EXPECTED, error.advice)
        return None
    if found not in GD2.range:
        faults.add(path, show(value), f"a value {GD2.range} kg m^2")
        return None
    return found / 4.0


def _mass_form(value: object) -> float:
    """GD² in kg m², of a text in either form or of a bare number."""
    parts = split_quantity(value) if isinstance(value, str) else None
    if parts is None or not _FORCES.search(parts[1]) or "s" in parts[1]:
        return parse_quantity(value, "inertia")
    return parse_quantity(value, "moment of weight") / _STANDARD
