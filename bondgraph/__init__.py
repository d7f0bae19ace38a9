"""Bond graphs: ports, power, and the reduction of a one-degree-of-freedom machine to its crank.

Convention, stated once and printed with every graph: through a transformer f_out = T f_in and e_in = T e_out.
The half arrow of a bond points where its power e f counts as positive.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bondgraph.builder import Builder, Part
    from bondgraph.domains import DOMAINS, Domain
    from bondgraph.elements import GY, TF, C, Displacement, Element, I, Law, Modulus, Motion, One, R, Se, Sf, Zero
    from bondgraph.faults import GraphError
    from bondgraph.graph import Bond, BondGraph
    from bondgraph.laws import Function, function
    from bondgraph.reduction import Reduced, Reduction, reduce
    from bondgraph.simulation import Run, simulate

_HOMES = {
    "DOMAINS": "domains",
    "Domain": "domains",
    "GraphError": "faults",
    "C": "elements",
    "Displacement": "elements",
    "Element": "elements",
    "GY": "elements",
    "I": "elements",
    "Law": "elements",
    "Modulus": "elements",
    "Motion": "elements",
    "One": "elements",
    "R": "elements",
    "Se": "elements",
    "Sf": "elements",
    "TF": "elements",
    "Zero": "elements",
    "Function": "laws",
    "function": "laws",
    "Bond": "graph",
    "BondGraph": "graph",
    "Builder": "builder",
    "Part": "builder",
    "Reduced": "reduction",
    "Reduction": "reduction",
    "reduce": "reduction",
    "Run": "simulation",
    "simulate": "simulation",
}

__all__ = [
    "DOMAINS",
    "GY",
    "TF",
    "Bond",
    "BondGraph",
    "Builder",
    "C",
    "Displacement",
    "Domain",
    "Element",
    "Function",
    "GraphError",
    "I",
    "Law",
    "Modulus",
    "Motion",
    "One",
    "Part",
    "R",
    "Reduced",
    "Reduction",
    "Run",
    "Se",
    "Sf",
    "Zero",
    "function",
    "reduce",
    "simulate",
]


def __getattr__(name: str) -> Any:
    """Import a public name from its module on first use (PEP 562), so that importing the package costs nothing."""
    if name not in _HOMES:
        raise AttributeError(f"module 'bondgraph' has no attribute {name!r}")
    value = getattr(import_module(f"bondgraph.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
