"""The functions that formulas are written against, by their numpy names, over mpmath's and SymPy's numbers.

numpy itself is such a namespace; intervals and jets have theirs (`flywheel.formulas.intervals`, `flywheel.formulas.jets`).
"""

from __future__ import annotations

import operator
from types import SimpleNamespace
from typing import Any

_SHARED = ("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sqrt", "exp", "log", "sign")


def mpmath_namespace() -> SimpleNamespace:
    """Functions over mpmath's numbers, at the precision that is set when they are called.

    >>> print(mpmath_namespace().atan2(1, -1))
    2.35619449019234
    """
    from mpmath import mp  # type: ignore[import-untyped]

    return SimpleNamespace(
        **{name: getattr(mp, name) for name in _SHARED},
        pi=mp.pi,
        abs=abs,
        minimum=min,
        maximum=max,
        where=lambda test, yes, no: yes if test else no,
        divide=lambda a, b: mp.mpf(a) / b,
        power=lambda base, exponent: mp.mpf(base) ** exponent,
        less=operator.lt,
        less_equal=operator.le,
        greater=operator.gt,
        greater_equal=operator.ge,
        equal=operator.eq,
        not_equal=operator.ne,
        logical_and=lambda a, b: a and b,
        logical_or=lambda a, b: a or b,
        logical_not=operator.not_,
    )


def sympy_namespace() -> SimpleNamespace:
    """Functions over SymPy's expressions; a choice becomes a Piecewise, an integral exponent an integer.

    >>> import sympy
    >>> sympy_namespace().power(sympy.Symbol("phi"), 2.0)
    phi**2
    """
    import sympy  # type: ignore[import-untyped]

    def power(base: Any, exponent: Any) -> Any:
        whole = isinstance(exponent, float) and exponent.is_integer()
        return sympy.Pow(base, int(exponent) if whole else exponent)

    return SimpleNamespace(
        **{name: getattr(sympy, name) for name in _SHARED},
        pi=sympy.pi,
        abs=sympy.Abs,
        minimum=sympy.Min,
        maximum=sympy.Max,
        where=lambda test, yes, no: sympy.Piecewise((yes, test), (no, True)),
        divide=lambda a, b: sympy.sympify(a) / b,
        power=power,
        less=sympy.Lt,
        less_equal=sympy.Le,
        greater=sympy.Gt,
        greater_equal=sympy.Ge,
        equal=sympy.Eq,
        not_equal=sympy.Ne,
        logical_and=sympy.And,
        logical_or=sympy.Or,
        logical_not=sympy.Not,
    )
