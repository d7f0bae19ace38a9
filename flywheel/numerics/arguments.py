"""Checks of arguments of the library: finite numbers, arrays of them, known names, objects of the right type."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from flywheel.numerics.faults import Fault, SceneError, show, suggestion
from flywheel.numerics.jets import is_recorded

Array = NDArray[np.float64]
T = TypeVar("T")

ANY, NOT_NEGATIVE, POSITIVE = "a finite number", "a finite number, 0 or above", "a finite number above 0"

_NUMBERS = (float, int, np.floating, np.integer)
_GREATEST = sys.float_info.max


def fits(value: Any, expected: str = ANY) -> bool:
    """Tests whether a value is a finite number; with `NOT_NEGATIVE` or `POSITIVE`, one of that sign.

    >>> fits(0), fits(float("nan")), fits("1"), fits(True), fits(0.0, POSITIVE), fits(0.0, NOT_NEGATIVE)
    (True, False, False, False, False, True)
    """
    if is_recorded(value):
        return bool(abs(value) <= _GREATEST and (expected == ANY or value > 0 or (expected == NOT_NEGATIVE and value == 0)))
    if not _numeric(value):
        return False
    number = value if isinstance(value, int) else float(value)
    return abs(number) <= _GREATEST and (expected == ANY or number > 0 or (expected == NOT_NEGATIVE and number == 0))


def number_faults(path: str, value: object, expected: str = ANY, unit: str = "") -> list[Fault]:
    """The fault of a value that is not such a number; empty if it is."""
    if fits(value, expected):
        return []
    return [Fault(path, f"{brief(value)} {unit}" if unit and _numeric(value) else brief(value), expected)]


def refuse(faults: list[Fault]) -> None:
    """Raises SceneError with all faults, if there are any."""
    if faults:
        raise SceneError(faults)


def require(path: str, value: object, kind: type | tuple[type, ...], expected: str) -> None:
    """Raises SceneError if a value is not of a type.

    >>> require("arm", 2.5, str, "a name")
    Traceback (most recent call last):
    flywheel.numerics.faults.SceneError: arm: found 2.5, expected a name
    """
    if not isinstance(value, kind):
        raise SceneError([Fault(path, brief(value), expected)])


def entry(path: str, name: object, valid: Mapping[str, T]) -> T:
    """The value of a name; SceneError for an unknown name."""
    faults = name_faults(path, name, valid)
    refuse(faults)
    return valid[str(name)]


def name_faults(path: str, name: object, valid: Mapping[str, object]) -> list[Fault]:
    """The fault of a name that is not valid, with the nearest one that is.

    >>> print(*name_faults("driver", "pivt", {"pivot": 1, "guide": 2}))
    driver: found "pivt", expected one of pivot, guide; did you mean "pivot"?
    """
    if isinstance(name, str) and name in valid:
        return []
    advice = suggestion(name, valid) if isinstance(name, str) else ""
    return [Fault(path, brief(name), f"one of {', '.join(valid) or 'none'}", "" if advice.startswith("valid") else advice)]


def array(path: str, value: object) -> Array:
    """Finite numbers of any shape as an array; SceneError for anything else, texts of digits included.

    >>> array("q", "20")
    Traceback (most recent call last):
    flywheel.numerics.faults.SceneError: q: found "20", expected finite numbers
    """
    values = _converted(value)
    if values is None:
        raise SceneError([Fault(path, brief(value), "finite numbers")])
    if not np.isfinite(values).all():
        what = "a value that is not finite" if values.ndim else brief(float(values))
        raise SceneError([Fault(path, what, "finite numbers")])
    return values


def vector(path: str, value: object, unit: str) -> tuple[float, float]:
    """Two components, along x and y.

    >>> vector("gravity", 9.81, "m/s²")
    Traceback (most recent call last):
    flywheel.numerics.faults.SceneError: gravity: found 9.81, expected two numbers, along x and y, in m/s²
    """
    components = array(path, value)
    if components.shape != (2,):
        what = f"an array of shape {components.shape}" if components.ndim else brief(value)
        raise SceneError([Fault(path, what, f"two numbers, along x and y, in {unit}")])
    return float(components[0]), float(components[1])


def brief(value: object) -> str:
    """A wrong value in words: a sequence by its type's name."""
    return f"a value of type {type(value).__name__}" if isinstance(value, (list, tuple)) else show(value)


def _numeric(value: object) -> bool:
    return isinstance(value, _NUMBERS) and not isinstance(value, bool)


def _converted(value: object) -> Array | None:
    """Numbers as an array, those of other libraries too; None for texts, truth values, ragged lists and objects."""
    if value is None:
        return None
    try:
        values = np.asarray(value)
        return np.asarray(values, dtype=float) if values.dtype.kind in "fiuO" else None
    except (TypeError, ValueError):
        return None
