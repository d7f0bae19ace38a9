"""Functions of expressions over mpmath's numbers."""

import operator
from types import SimpleNamespace

from mpmath import mp

SHARED = ("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sqrt", "exp", "log", "sign")


def mpmath_namespace() -> SimpleNamespace:
    """Functions over mpmath's numbers, at the precision that is set when they are called."""
    return SimpleNamespace(
        **{name: getattr(mp, name) for name in SHARED},
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
