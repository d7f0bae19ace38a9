"""Bond graphs: ports, power, and the reduction of a one-degree-of-freedom machine to its crank.

Convention, stated once and printed with every graph: through a transformer f_out = T f_in and e_in = T e_out.
The half arrow of a bond points where its power e f counts as positive.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bondgraph.builder import Builder, Part
    from bondgraph.causal.strokes import Causality, causality
    from bondgraph.causal.table import Table, table
    from bondgraph.drawing.picture import draw
    from bondgraph.elements import (
        DOMAINS,
        GY,
        TF,
        C,
        Displacement,
        Domain,
        Element,
        I,
        Law,
        Modulus,
        Motion,
        One,
        R,
        Se,
        Sf,
        Zero,
    )
    from bondgraph.equations.equations import (
        MotionEquation,
        StateEquations,
        generic,
        generic_equation,
        motion_equation,
        state_equations,
    )
    from bondgraph.graph import Bond, BondGraph
    from bondgraph.laws import Function, GraphError, function
    from bondgraph.motion.dynamics import Dynamics
    from bondgraph.motion.simulation import Audit, Run, simulate
    from bondgraph.reduction import Reduced, Reduction, reduce
    from bondgraph.simplification.procedure import Procedure, procedure
    from bondgraph.simplification.rules import (
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
    from bondgraph.storage.graphs import as_data, from_data, load, save

_HOMES = {
    "DOMAINS": "elements",
    "Domain": "elements",
    "GraphError": "laws",
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
    "Causality": "causal.strokes",
    "causality": "causal.strokes",
    "Table": "causal.table",
    "table": "causal.table",
    "Action": "simplification.rules",
    "Simplified": "simplification.rules",
    "absorb_junctions": "simplification.rules",
    "drop_dangling": "simplification.rules",
    "drop_two_bond_junctions": "simplification.rules",
    "drop_zero_sources": "simplification.rules",
    "drop_zero_velocity": "simplification.rules",
    "merge_double_differences": "simplification.rules",
    "merge_equal_junctions": "simplification.rules",
    "simplify": "simplification.rules",
    "Procedure": "simplification.procedure",
    "procedure": "simplification.procedure",
    "MotionEquation": "equations.equations",
    "StateEquations": "equations.equations",
    "motion_equation": "equations.equations",
    "state_equations": "equations.equations",
    "generic": "equations.equations",
    "generic_equation": "equations.equations",
    "Audit": "motion.simulation",
    "Dynamics": "motion.dynamics",
    "Run": "motion.simulation",
    "simulate": "motion.simulation",
    "as_data": "storage.graphs",
    "from_data": "storage.graphs",
    "load": "storage.graphs",
    "save": "storage.graphs",
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
