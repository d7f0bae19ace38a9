"""Functions of one number at a time: Python's own for floats, which are fast; numpy's for numbers that record themselves.

`is_recorded` knows these, `present` gives the value that they have now.

>>> sqrt(2.0) == math.sqrt(2.0), type(atan2(1.0, 2.0))
(True, <class 'float'>)
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeGuard

import numpy as np


def is_recorded(value: object) -> TypeGuard[float]:
    """Tests whether a value is a number on a tape (`bondgraph.recording`), which stands for those of many designs."""
    return getattr(value, "is_recorded", False) is True


def present(value: Any) -> Any:
    """The present value of a recorded number; anything else unchanged.

    What depends on it is not on record: only a choice that guards elsewhere hold, such as that of a piece by its anchor.
    """
    return value.value if is_recorded(value) else value  # type: ignore[attr-defined]


def _of_any_number(plain: Callable[..., float], ufunc: Callable[..., Any]) -> Callable[..., float]:
    """The function of `math`; what has no float goes to that of numpy, which asks the number itself."""

    def function(*numbers: Any) -> float:
        try:
            return plain(*numbers)
        except TypeError:
            recorded: float = ufunc(*numbers)
            return recorded

    return function


sqrt = _of_any_number(math.sqrt, np.sqrt)
sin = _of_any_number(math.sin, np.sin)
cos = _of_any_number(math.cos, np.cos)
acos = _of_any_number(math.acos, np.arccos)
acosh = _of_any_number(math.acosh, np.arccosh)
asin = _of_any_number(math.asin, np.arcsin)
atan2 = _of_any_number(math.atan2, np.arctan2)
exp = _of_any_number(math.exp, np.exp)
expm1 = _of_any_number(math.expm1, np.expm1)
hypot = _of_any_number(math.hypot, np.hypot)
log = _of_any_number(math.log, np.log)
degrees = _of_any_number(math.degrees, np.degrees)
