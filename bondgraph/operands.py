"""What numpy's functions and Python's operators can be called on besides numbers: dual numbers, and formulas to be.

A `Dual` carries its derivative along, so that slopes are exact; a `Traced` writes a formula down, so that a law that is
written with numpy's functions has a symbolic form.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np


def real(value: Any) -> Any:
    """A numpy scalar as a float: plain floats are several times faster."""
    if isinstance(value, np.ndarray) and value.ndim == 0:  # what numpy.where makes of plain numbers
        value = value.item()
    return float(value) if isinstance(value, np.floating | int) else value


class Operand:
    """Arithmetic by one method, `_apply(ufunc name, operands)`, for numpy's functions and Python's operators alike."""

    def _apply(self, name: str, operands: tuple[Any, ...]) -> Any:
        raise NotImplementedError

    def __array_ufunc__(self, ufunc: Any, method: str, *operands: Any, **kwargs: Any) -> Any:
        if method != "__call__" or kwargs:
            raise TypeError(f"numpy.{ufunc.__name__}.{method} is not known here")
        return self._apply(ufunc.__name__, operands)

    def __array_function__(self, function: Any, types: Any, operands: Any, kwargs: Any) -> Any:
        return self._apply(function.__name__, operands)

    def __float__(self) -> float:
        raise TypeError("math's functions take plain floats only: write the law with numpy's, or as a SymPy expression")

    def __add__(self, other: Any) -> Any:
        return self._apply("add", (self, other))

    def __radd__(self, other: Any) -> Any:
        return self._apply("add", (other, self))

    def __sub__(self, other: Any) -> Any:
        return self._apply("subtract", (self, other))

    def __rsub__(self, other: Any) -> Any:
        return self._apply("subtract", (other, self))

    def __mul__(self, other: Any) -> Any:
        return self._apply("multiply", (self, other))

    def __rmul__(self, other: Any) -> Any:
        return self._apply("multiply", (other, self))

    def __truediv__(self, other: Any) -> Any:
        return self._apply("divide", (self, other))

    def __rtruediv__(self, other: Any) -> Any:
        return self._apply("divide", (other, self))

    def __pow__(self, other: Any) -> Any:
        return self._apply("power", (self, other))

    def __rpow__(self, other: Any) -> Any:
        return self._apply("power", (other, self))

    def __and__(self, other: Any) -> Any:
        return self._apply("logical_and", (self, other))

    def __or__(self, other: Any) -> Any:
        return self._apply("logical_or", (self, other))

    def __invert__(self) -> Any:
        return self._apply("logical_not", (self,))

    def __neg__(self) -> Any:
        return self._apply("negative", (self,))

    def __pos__(self) -> Any:
        return self

    def __abs__(self) -> Any:
        return self._apply("absolute", (self,))

    def __eq__(self, other: object) -> Any:
        return self._apply("equal", (self, other))

    def __ne__(self, other: object) -> Any:
        return self._apply("not_equal", (self, other))

    __hash__ = None  # type: ignore[assignment]  # equal means equal values, which change

    def __lt__(self, other: Any) -> Any:
        return self._apply("less", (self, other))

    def __le__(self, other: Any) -> Any:
        return self._apply("less_equal", (self, other))

    def __gt__(self, other: Any) -> Any:
        return self._apply("greater", (self, other))

    def __ge__(self, other: Any) -> Any:
        return self._apply("greater_equal", (self, other))


class Dual(Operand):
    """A value and its derivative: what is computed with it carries the derivative along, exactly.

    >>> x = Dual(2.0, 1.0)
    >>> y = x**3 - 1 / x
    >>> y.value, y.slope
    (7.5, 12.25)
    """

    __slots__ = ("slope", "value")

    def __init__(self, value: Any, slope: Any) -> None:
        self.value, self.slope = value, slope

    def _apply(self, name: str, operands: tuple[Any, ...]) -> Any:
        values = [o.value if isinstance(o, Dual) else o for o in operands]
        if name in _COMPARISONS:
            return getattr(np, name)(*values)
        if name == "where":
            slopes = [o.slope if isinstance(o, Dual) else 0.0 for o in operands[1:]]
            return Dual(real(np.where(*values)), real(np.where(values[0], *slopes)))
        if name not in _PARTIALS:
            raise TypeError(f"numpy.{name} has no derivative here")
        result = real(getattr(np, name)(*values)) if name not in _OPERATORS else _OPERATORS[name](*values)
        slope: Any = 0.0
        for k, operand in enumerate(operands):
            if isinstance(operand, Dual):
                slope = slope + _PARTIALS[name][k](result, *values) * operand.slope
        return Dual(result, slope)


_COMPARISONS = ("less", "less_equal", "greater", "greater_equal", "equal", "not_equal")

_OPERATORS: dict[str, Callable[..., Any]] = {
    "add": lambda a, b: a + b,
    "subtract": lambda a, b: a - b,
    "multiply": lambda a, b: a * b,
    "divide": lambda a, b: a / b,
    "power": lambda a, b: a**b,
    "negative": lambda a: -a,
}

_PARTIALS: dict[str, tuple[Callable[..., Any], ...]] = {  # of each argument: (result, *values) -> partial derivative
    "add": (lambda r, a, b: 1.0, lambda r, a, b: 1.0),
    "subtract": (lambda r, a, b: 1.0, lambda r, a, b: -1.0),
    "multiply": (lambda r, a, b: b, lambda r, a, b: a),
    "divide": (lambda r, a, b: 1.0 / b, lambda r, a, b: -r / b),
    "power": (lambda r, a, b: b * a ** (b - 1) if np.any(b) else 0.0, lambda r, a, b: r * np.log(a)),
    "negative": (lambda r, a: -1.0,),
    "absolute": (lambda r, a: np.sign(a),),
    "sign": (lambda r, a: 0.0,),
    "square": (lambda r, a: 2.0 * a,),
    "sqrt": (lambda r, a: 0.5 / r,),
    "sin": (lambda r, a: np.cos(a),),
    "cos": (lambda r, a: -np.sin(a),),
    "tan": (lambda r, a: 1.0 + r * r,),
    "arcsin": (lambda r, a: 1.0 / np.sqrt((1.0 - a) * (1.0 + a)),),
    "arccos": (lambda r, a: -1.0 / np.sqrt((1.0 - a) * (1.0 + a)),),
    "arctan": (lambda r, a: 1.0 / (1.0 + a * a),),
    "arctan2": (lambda r, y, x: x / (x * x + y * y), lambda r, y, x: -y / (x * x + y * y)),
    "hypot": (lambda r, a, b: a / r, lambda r, a, b: b / r),
    "exp": (lambda r, a: r,),
    "log": (lambda r, a: 1.0 / a,),
    "sinh": (lambda r, a: np.cosh(a),),
    "cosh": (lambda r, a: np.sinh(a),),
    "tanh": (lambda r, a: 1.0 - r * r,),
    "maximum": (lambda r, a, b: np.where(a >= b, 1.0, 0.0), lambda r, a, b: np.where(a >= b, 0.0, 1.0)),
    "minimum": (lambda r, a, b: np.where(a <= b, 1.0, 0.0), lambda r, a, b: np.where(a <= b, 0.0, 1.0)),
}


class Traced(Operand):
    """A SymPy expression that numpy's functions can be called on, so that a numpy formula writes itself down."""

    __slots__ = ("expression",)

    def __init__(self, expression: Any) -> None:
        self.expression = expression

    def _apply(self, name: str, operands: tuple[Any, ...]) -> Any:
        import sympy  # type: ignore[import-untyped]

        values = [untraced(operand) for operand in operands]
        if name == "where":
            return Traced(sympy.Piecewise((values[1], values[0]), (values[2], True)))
        if name in _OPERATORS or name in _COMPOUND:
            return Traced((_OPERATORS | _COMPOUND)[name](*values))
        if name not in _SYMPY_NAMES:
            raise TypeError(f"numpy.{name} has no symbolic form here")
        return Traced(getattr(sympy, _SYMPY_NAMES[name])(*values))

    def __bool__(self) -> bool:
        raise TypeError("it branches on its argument; numpy.where can be followed")


_COMPOUND: dict[str, Callable[..., Any]] = {
    "square": lambda a: a**2,
    "hypot": lambda a, b: (a**2 + b**2) ** 0.5,
}

_SYMPY_NAMES = {
    **{name: name for name in ("sqrt", "sin", "cos", "tan", "exp", "log", "sinh", "cosh", "tanh", "sign")},
    "arcsin": "asin",
    "arccos": "acos",
    "arctan": "atan",
    "arctan2": "atan2",
    "absolute": "Abs",
    "less": "Lt",
    "less_equal": "Le",
    "greater": "Gt",
    "greater_equal": "Ge",
    "equal": "Eq",
    "not_equal": "Ne",
    "logical_and": "And",
    "logical_or": "Or",
    "logical_not": "Not",
    "maximum": "Max",
    "minimum": "Min",
}


def untraced(value: Any) -> Any:
    """A traced expression as SymPy's; a float that is a whole number as an integer, so that formulas stay readable."""
    if isinstance(value, Traced):
        return value.expression
    if isinstance(value, float | np.floating) and float(value).is_integer():
        return int(value)
    return value
