"""Bond graphs: ports, power, and the reduction of a one-degree-of-freedom machine to its crank.

Convention, stated once and printed with every graph: through a transformer f_out = T f_in and e_in = T e_out.
The half arrow of a bond points where its power e f counts as positive.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bondgraph.builder import Builder, Part
    from bondgraph.causal.assignment import Causality, causality
    from bondgraph.causal.table import Table, table
    from bondgraph.domains import DOMAINS, Domain
    from bondgraph.drawing.picture import draw
    from bondgraph.elements import GY, TF, C, Displacement, Element, I, Law, Modulus, Motion, One, R, Se, Sf, Zero
    from bondgraph.faults import GraphError
    from bondgraph.graph import Bond, BondGraph
    from bondgraph.laws import Function, function
    from bondgraph.motion.audit import Audit
    from bondgraph.motion.dynamics import Dynamics
    from bondgraph.motion.simulation import Run, simulate
    from bondgraph.reduction import Reduced, Reduction, reduce
    from bondgraph.simplifying.procedure import Procedure, procedure
    from bondgraph.simplifying.rules import (
        Action,
        Simplified,
        absorb_junctions,
        drop_dangling,
        drop_two_bond_junctions,
        drop_zero_sources,
        drop_zero_velocity,
        merge_double_differences,
        merge_equal_junctions,
        simplify,
    )
    from bondgraph.storing.storage import as_data, from_data, load, save
    from bondgraph.symbolic.equations import MotionEquation, StateEquations, motion_equation, state_equations
    from bondgraph.symbolic.generic import generic, generic_equation

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
    "Causality": "causal.assignment",
    "causality": "causal.assignment",
    "Table": "causal.table",
    "table": "causal.table",
    "Action": "simplifying.rules",
    "Simplified": "simplifying.rules",
    "absorb_junctions": "simplifying.rules",
    "drop_dangling": "simplifying.rules",
    "drop_two_bond_junctions": "simplifying.rules",
    "drop_zero_sources": "simplifying.rules",
    "drop_zero_velocity": "simplifying.rules",
    "merge_double_differences": "simplifying.rules",
    "merge_equal_junctions": "simplifying.rules",
    "simplify": "simplifying.rules",
    "Procedure": "simplifying.procedure",
    "procedure": "simplifying.procedure",
    "MotionEquation": "symbolic.equations",
    "StateEquations": "symbolic.equations",
    "motion_equation": "symbolic.equations",
    "state_equations": "symbolic.equations",
    "generic": "symbolic.generic",
    "generic_equation": "symbolic.generic",
    "Audit": "motion.audit",
    "Dynamics": "motion.dynamics",
    "Run": "motion.simulation",
    "simulate": "motion.simulation",
    "as_data": "storing.storage",
    "from_data": "storing.storage",
    "load": "storing.storage",
    "save": "storing.storage",
    "draw": "drawing.picture",
}

__all__ = [
    "DOMAINS",
    "GY",
    "TF",
    "Action",
    "Audit",
    "Bond",
    "BondGraph",
    "Builder",
    "C",
    "Causality",
    "Displacement",
    "Domain",
    "Dynamics",
    "Element",
    "Function",
    "GraphError",
    "I",
    "Law",
    "Modulus",
    "Motion",
    "MotionEquation",
    "One",
    "Part",
    "Procedure",
    "R",
    "Reduced",
    "Reduction",
    "Run",
    "Se",
    "Sf",
    "Simplified",
    "StateEquations",
    "Table",
    "Zero",
    "absorb_junctions",
    "as_data",
    "causality",
    "draw",
    "drop_dangling",
    "drop_two_bond_junctions",
    "drop_zero_sources",
    "drop_zero_velocity",
    "from_data",
    "function",
    "generic",
    "generic_equation",
    "load",
    "merge_double_differences",
    "merge_equal_junctions",
    "motion_equation",
    "procedure",
    "reduce",
    "save",
    "simplify",
    "simulate",
    "state_equations",
    "table",
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
