"""The generic graph of two flows tied by one ratio, f_B = T(q) f_A, each with its source, inertia, resistor and spring.

Any mechanism of one degree of freedom that has two velocities of interest is a case of it: leave out what is not there.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

from bondgraph.builder import Builder
from bondgraph.elements import C, Element, I, R, Se
from bondgraph.faults import GraphError
from bondgraph.graph import BondGraph
from bondgraph.laws import OWN_DISPLACEMENT, OWN_FLOW, TIME, Function, law_of
from bondgraph.symbolic.equations import MotionEquation, motion_equation

_MAKERS: dict[str, Callable[..., Element]] = {"Se": Se, "I": I, "B": R, "C": C}
_JUNCTIONS = {"1": "A", "2": "B"}
_ELEMENTS = tuple(f"{kind}{side}" for side in _JUNCTIONS for kind in _MAKERS)


def generic(ratio: Any, *, displacement: str | None = None, without: Collection[str] = (), **values: Any) -> BondGraph:
    """The graph of two flows f_A and f_B = T f_A: 1:A with Se1, I1, B1 (an R), C1 and 1:B with Se2, I2, B2, C2.

    Both sources drive: their power counts as positive into the machine, so a load is a negative effort.

    Args:
        ratio: T, a number, a function written with numpy's functions, or a SymPy expression.
        displacement: which quantity of the ratio is the integral of f_A; may be left out where there is one only.
        without: elements that are not there.
        values: by element, its law (source: effort; I: inertia; B: resistance; C: compliance, 1/k); by any other quantity
            of the laws, the parameter's value. What is not given stays an open parameter of its own name.

    Raises:
        GraphError: for a name that is none of these, or where the displacement cannot be told.

    >>> import numpy as np
    >>> graph = generic(lambda theta: 0.1 * np.sin(theta), without=("C1", "C2", "B1"), I1=2.0, Se1=10.0)
    >>> graph.symbol("T"), list(graph.parameters)
    ('MTF', ['Se2', 'I2', 'B2'])

    """
    laws = {name: law_of(value) for name, value in values.items()}
    tie = law_of(ratio)
    q = displacement or _displacement(tie, values)
    there = [name for name in _ELEMENTS if name not in without]
    named = {n for law in (tie, *(laws.get(name) for name in there)) for n in getattr(law, "of", ())}
    quantities = sorted(named - {q, TIME, OWN_FLOW, OWN_DISPLACEMENT, *there})
    _refuse_unknown({*values, *without}, quantities)
    b = Builder().one("A", displacement=q).one("B")
    b = b.parameter(**{name: values.get(name) for name in quantities}).parameter(**{n: None for n in there if n not in laws})
    for name in there:
        law = laws[name] if name in laws else Function(_symbol(name), (name,), (name,))
        b.on(_JUNCTIONS[name[-1]], _MAKERS[name[:-1]](name, law))
    return b.transform("A", "B", tie, name="T").build()


def generic_equation(ratio: Any, *, opaque: bool = False, **given: Any) -> MotionEquation:
    """The equation of motion of `generic(ratio, **given)`, seen from side A, where nothing is divided by T.

        (I1 + T^2 I2) f_A' + I2 T T' f_A^2 = Se1 + T Se2 - (B1 + T^2 B2) f_A - q_C1/C1 - T q_C2/C2

    Divided by T where T != 0, this is the form that is solved for side B,

        f_B' = [Se2 - B2 f_B - q_B/C2 + (Se1 - I1 f_A' - B1 f_A - q_A/C1)/T] / I2.

    It is also published with a minus in front of the last bracket (a thesis of 2023, its eq. 84): there both half arrows
    point into the transformer, which then takes the power e_5 f_A + e_6 f_B = 2 e_5 f_A, so that I2 would make the machine
    lighter. A transformer passes power on: the sign is plus.

    Args:
        ratio: as for `generic`.
        opaque: leave T a function T(q).
        given: as for `generic`.

    >>> generic_equation(2.0, without=("B1", "B2", "C1", "C2")).inertia
    I1 + I2*T**2

    """
    return motion_equation(generic(ratio, **given), opaque=opaque)


def _displacement(tie: Any, values: dict[str, Any]) -> str:
    free = [n for n in getattr(tie, "of", ()) if n != TIME and n not in values]
    if len(free) > 1:
        raise GraphError(f"the ratio depends on {', '.join(free)}: say which is the displacement, displacement={free[0]!r}")
    return free[0] if free else "phi"


def _refuse_unknown(names: set[str], quantities: list[str]) -> None:
    unknown = sorted(names - {*_ELEMENTS, *quantities})
    if unknown:
        raise GraphError(f"no element or quantity {unknown[0]!r}: expected {', '.join([*_ELEMENTS, *quantities])}")


def _symbol(name: str) -> Any:
    import sympy  # type: ignore[import-untyped]

    return sympy.Symbol(name)
