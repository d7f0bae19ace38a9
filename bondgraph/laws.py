"""The laws of elements: functions of named quantities with exact slopes and a symbolic form, and the one kind of error.

A `Function` holds either a Python function written with numpy's functions, or a SymPy expression. Its arguments are named:
displacements, signals and parameters that the graph declares, the time `t`, and for a resistor its own flow `f`, for a
compliance its own displacement `q`. Slopes come from dual numbers (`Dual`) or from SymPy, never from differences; a formula
in numpy's functions writes itself down when it is called on a `Traced`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np


class GraphError(ValueError):
    """A graph that is not well formed, or that cannot be treated as asked; says which elements and bonds are concerned."""


def refuse(faults: Iterable[str]) -> None:
    """Raise a GraphError that lists all faults, a line each; nothing happens if there are none."""
    lines = list(faults)
    if lines:
        raise GraphError("\n".join(lines))


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


TIME = "t"
OWN_FLOW = "f"
OWN_EFFORT = "e"
OWN_DISPLACEMENT = "q"
OWN_MOMENTUM = "p"
OWN = {"R": OWN_FLOW, "C": OWN_DISPLACEMENT, "I": OWN_MOMENTUM}  # what a law of this kind calls its own
_ALWAYS_OWN = (OWN_FLOW, OWN_DISPLACEMENT)


def own_name(kind: str, names: Iterable[str], declared: Iterable[str]) -> str | None:
    """The name of the element's own quantity in a law of these names; a resistor's is its flow f, or its effort e.

    f and q are the element's own whatever the graph declares, e and p where it declares nothing of that name.

    >>> own_name("R", ("f", "theta"), ()), own_name("R", ("e",), ()), own_name("R", ("e",), ("e",))
    ('f', 'e', None)
    """
    names, declared = set(names), set(declared)
    may = (OWN_FLOW, OWN_EFFORT) if kind == "R" else (OWN[kind],) if kind in OWN else ()
    return next((n for n in may if n in names and (n in _ALWAYS_OWN or n not in declared)), None)


@dataclass(frozen=True, eq=False)
class Function:
    """A law given as a function: of what (`of`, names in the graph), and how.

    Args:
        given: a Python function written with numpy's functions, or a SymPy expression.
        arguments: the names as `given` has them: its parameters, or the free symbols of the expression.
        of: the names in the graph that they stand for, in the same order.

    >>> import numpy as np
    >>> square = function(lambda theta: np.sin(theta) ** 2)
    >>> square.of
    ('theta',)
    >>> square.partials(0.5) == (np.sin(0.5) ** 2, (2 * np.sin(0.5) * np.cos(0.5),))
    True
    >>> square.symbolic()
    sin(theta)**2

    """

    given: Any
    arguments: tuple[str, ...]
    of: tuple[str, ...]

    def renamed(self, names: Mapping[str, str]) -> Function:
        """The same function of quantities with other names in the graph."""
        return replace(self, of=tuple(names.get(name, name) for name in self.of))

    @property
    def is_expression(self) -> bool:
        """True if it was given as a SymPy expression."""
        return is_symbolic(self.given)

    @cached_property
    def is_affine(self) -> bool:
        """True of a SymPy expression that is a straight line in all its arguments; Python functions are not asked."""
        if not self.is_expression:
            return False
        slopes = [self.given.diff(symbol) for symbol in self.given.free_symbols]
        return not any(slope.has(*self.given.free_symbols) for slope in slopes)

    def __call__(self, *values: Any) -> Any:
        """The value at the arguments' values: numbers, arrays, dual numbers."""
        if not self.is_expression:
            return real(self.given(*values))
        plain = all(isinstance(value, float | int) for value in values)
        return self._compiled["value", plain](*values)

    def partials(self, *values: Any) -> tuple[Any, tuple[Any, ...]]:
        """The value and its derivative with respect to each argument."""
        if self.is_expression:
            plain = all(isinstance(value, float | int) for value in values)
            value, *slopes = self._compiled["partials", plain](*values)
            return value, tuple(slopes)
        value, slopes = None, []
        for k in range(len(values)):
            seeded = [Dual(v, 1.0) if j == k else v for j, v in enumerate(values)]
            try:
                dual = self.given(*seeded)
            except TypeError as error:
                raise GraphError(
                    f"the slope of a law of {', '.join(self.of)} is needed, but cannot be determined: {error}"
                ) from error
            slopes.append(real(dual.slope) if isinstance(dual, Dual) else 0.0)
            value = real(dual.value if isinstance(dual, Dual) else dual)
        return (self.given() if value is None else value), tuple(slopes)

    def symbolic(self, symbols: Mapping[str, Any] | None = None) -> Any:
        """The SymPy expression, in `symbols` by the graph's names (plain symbols of these names if none is given).

        Raises:
            GraphError: if it cannot be followed symbolically (it branches, or calls other than numpy's functions).

        """
        import sympy

        symbols = symbols or {}
        values = [symbols.get(name, sympy.Symbol(name)) for name in self.of]
        if self.is_expression:
            by_name = dict(zip(self.arguments, values, strict=True))
            return self.given.xreplace({s: by_name[s.name] for s in self.given.free_symbols})
        try:
            traced = self.given(*(Traced(sympy.sympify(value, strict=True)) for value in values))
            return sympy.sympify(untraced(traced), strict=True)  # strict: text is refused, never evaluated
        except (TypeError, AttributeError, sympy.SympifyError) as error:
            raise GraphError(f"cannot be written as a formula ({error}): give it as a SymPy expression") from error

    @cached_property
    def _compiled(self) -> Mapping[tuple[str, bool], Callable[..., Any]]:
        import sympy

        order = [sympy.Dummy(real=True) for _ in self.arguments]  # as plain symbols, |x| and sign(x) have no real slope
        by_name = dict(zip(self.arguments, order, strict=True))
        given = self.given.xreplace({s: by_name[s.name] for s in self.given.free_symbols})
        slopes = [sympy.diff(given, symbol).replace(sympy.DiracDelta, lambda *at: sympy.S.Zero) for symbol in order]
        whole = [full_digits(expression) for expression in (given, *slopes)]
        try:
            return {
                (kind, plain): sympy.lambdify(order, what, modules="math" if plain else "numpy", cse=True)
                for kind, what in (("value", whole[0]), ("partials", whole))
                for plain in (True, False)
            }
        except KeyError as error:  # SymPy's way to say that it has no code for an infinity
            raise GraphError(f"the law {str(self.given)[:80]} has no finite value: it holds {error.args[0]}") from error


def full_digits(expression: Any) -> Any:
    """The expression with floats that are printed at 17 digits: compiled at SymPy's own 15, they are other numbers."""
    import sympy

    return expression.xreplace({x: sympy.Float(repr(float(x)), 17) for x in expression.atoms(sympy.Float)})


def exact(expression: Any) -> Any:
    """The expression with integers for floats that are whole, and fractions for halves.

    >>> import sympy
    >>> exact(1.0 * sympy.Symbol("x") ** 0.5 + 2.0)
    sqrt(x) + 2
    """
    import sympy

    done: dict[Any, Any] = {}  # what an expression shares with itself is visited once: it may be shared a million times

    def made_exact(part: Any) -> Any:
        if part not in done:
            if isinstance(part, sympy.Float):
                done[part] = sympy.Rational(int(2 * part), 2) if float(2 * part).is_integer() else part
            else:
                inner = [made_exact(argument) for argument in part.args]
                same = all(new is old for new, old in zip(inner, part.args, strict=True))
                done[part] = part if same else part.func(*inner)
        return done[part]

    return made_exact(expression)


def is_symbolic(given: Any) -> bool:
    """True for a SymPy expression; SymPy is not imported to find out."""
    return hasattr(given, "free_symbols") and hasattr(given, "xreplace")


def function(given: Any) -> Function:
    """A `Function` of the names that a Python function's parameters, or an expression's symbols, have.

    Parameters with a default value are constants of the function and stay out.
    """
    if isinstance(given, Function):
        return given
    if is_symbolic(given):
        names = tuple(sorted(symbol.name for symbol in given.free_symbols))
        twice = [name for name in set(names) if names.count(name) > 1]
        if twice:
            raise GraphError(f"two symbols of the expression are named {twice[0]!r}, with different assumptions")
        return Function(given, names, names)
    if not callable(given):
        raise GraphError(f"found {given!r}, expected a number, a function of named quantities or a SymPy expression")
    parameters = inspect.signature(given).parameters.values()
    spread = [p.name for p in parameters if p.kind in (p.VAR_POSITIONAL, p.VAR_KEYWORD)]
    if spread:
        raise GraphError(
            f"a law's parameters name what it depends on: found *{spread[0]}, expected names such as theta or t"
        )
    names = tuple(p.name for p in parameters if p.default is p.empty)
    return Function(given, names, names)


def law_of(given: Any) -> Any:
    """A number as a float, anything else that is callable or symbolic as a `Function`; ready-made laws as they are."""
    if given is None or isinstance(given, float):
        return given
    if isinstance(given, int | np.floating | np.integer):
        return float(given)
    if getattr(given, "is_recorded", False) is True:
        return given
    if is_symbolic(given) and not given.free_symbols:
        try:
            return float(given)
        except TypeError as error:
            raise GraphError(f"found {given}, expected a real number") from error
    return function(given) if is_symbolic(given) or callable(given) else given
