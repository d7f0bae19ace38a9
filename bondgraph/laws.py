"""Laws and moduli as functions of named quantities, with exact slopes and a symbolic form.

A `Function` holds either a Python function written with numpy's functions, or a SymPy expression. Its arguments are named:
displacements, signals and parameters that the graph declares, the time `t`, and for a resistor its own flow `f`, for a
compliance its own displacement `q`. Slopes come from dual numbers or from SymPy, never from differences.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from bondgraph.faults import GraphError
from bondgraph.operands import Dual, Traced, real, untraced

TIME = "t"
OWN_FLOW = "f"
OWN_DISPLACEMENT = "q"
OWN = {"R": OWN_FLOW, "C": OWN_DISPLACEMENT}  # what a law of this kind calls its own, whatever the graph declares


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
        """Whether it was given as a SymPy expression."""
        return is_symbolic(self.given)

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
                found = self.given(*seeded)
            except TypeError as error:
                raise GraphError(
                    f"the slope of a law of {', '.join(self.of)} is needed, but cannot be had: {error}"
                ) from error
            slopes.append(real(found.slope) if isinstance(found, Dual) else 0.0)
            value = real(found.value if isinstance(found, Dual) else found)
        return (self.given() if value is None else value), tuple(slopes)

    def symbolic(self, symbols: Mapping[str, Any] | None = None) -> Any:
        """The SymPy expression, in `symbols` by the graph's names (plain symbols of these names where none is given).

        Raises:
            GraphError: if it cannot be followed symbolically (it branches, or calls other than numpy's functions).

        """
        import sympy  # type: ignore[import-untyped]

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


def is_symbolic(given: Any) -> bool:
    """Whether something is a SymPy expression, found out without importing SymPy."""
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
    if is_symbolic(given):
        return function(given) if given.free_symbols else _number(given)
    return function(given) if callable(given) else given


def _number(given: Any) -> float:
    """A SymPy expression without symbols as a float."""
    try:
        return float(given)
    except TypeError as error:
        raise GraphError(f"found {given}, expected a real number") from error
