"""Bond graphs: ports, power, and the reduction of a one-degree-of-freedom machine to its crank.

Convention, stated once and printed with every graph: through a transformer f_out = T f_in and e_in = T e_out.
The half arrow of a bond points where its power e f counts as positive.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bondgraph.drawing import draw, svg
    from bondgraph.elements import (
        DOMAINS,
        GY,
        RS,
        TF,
        C,
        Displacement,
        Domain,
        Element,
        Function,
        GraphError,
        I,
        Law,
        Modulus,
        Motion,
        One,
        R,
        Se,
        Sf,
        Zero,
        function,
    )
    from bondgraph.equations import (
        MotionEquation,
        StateEquations,
        generic,
        generic_equation,
        motion_equation,
        state_equations,
        to_modelica,
    )
    from bondgraph.graph import Bond, BondGraph, Builder, Part
    from bondgraph.linear import Linear, Mode, Reach, equilibrium, linearize, reach
    from bondgraph.motion.dynamics import Dynamics
    from bondgraph.motion.run import Audit, Event, Run
    from bondgraph.motion.simulation import simulate
    from bondgraph.motion.switching import mode
    from bondgraph.reduction import Reduced, Reduction, reduce
    from bondgraph.rules import (
        Action,
        Procedure,
        Simplified,
        absorb_junctions,
        drop_dangling,
        drop_two_bond_junctions,
        drop_zero_sources,
        drop_zero_velocity,
        merge_double_differences,
        merge_equal_junctions,
        procedure,
        simplify,
    )
    from bondgraph.storage import as_data, from_data, load, save
    from bondgraph.strokes import Causality, Path, Table, causality, table, zero_order_paths
    from bondgraph.words import WordGraph

_NAMES = {
    "elements": (
        "DOMAINS Domain C Displacement Element Function GY GraphError I Law Modulus Motion One R RS Se Sf TF Zero function"
    ),
    "graph": "Bond BondGraph Builder Part",
    "reduction": "Reduced Reduction reduce",
    "strokes": "Causality Path Table causality table zero_order_paths",
    "rules": (
        "Action Procedure Simplified absorb_junctions drop_dangling drop_two_bond_junctions drop_zero_sources "
        "drop_zero_velocity merge_double_differences merge_equal_junctions procedure simplify"
    ),
    "equations": "MotionEquation StateEquations motion_equation state_equations generic generic_equation to_modelica",
    "linear": "Linear Mode Reach equilibrium linearize reach",
    "motion.run": "Audit Event Run",
    "motion.simulation": "simulate",
    "motion.switching": "mode",
    "motion.dynamics": "Dynamics",
    "storage": "as_data from_data load save",
    "words": "WordGraph",
    "drawing": "draw svg",
}
_HOMES = {name: module for module, names in _NAMES.items() for name in names.split()}

__all__ = [
    "DOMAINS", "GY", "RS", "TF", "Action", "Audit", "Bond", "BondGraph", "Builder", "C", "Causality", "Displacement",
    "Domain", "Dynamics", "Element", "Event", "Function", "GraphError", "I", "Law", "Linear", "Mode", "Modulus", "Motion",
    "MotionEquation", "One", "Part", "Path", "Procedure", "R", "Reach", "Reduced", "Reduction", "Run", "Se", "Sf",
    "Simplified", "StateEquations", "Table", "WordGraph", "Zero", "absorb_junctions", "as_data", "causality", "draw",
    "drop_dangling", "drop_two_bond_junctions", "drop_zero_sources", "drop_zero_velocity", "equilibrium", "from_data",
    "function", "generic", "generic_equation", "linearize", "load", "merge_double_differences", "merge_equal_junctions",
    "mode", "motion_equation", "procedure", "reach", "reduce", "save", "simplify", "simulate", "state_equations", "svg",
    "table", "to_modelica", "zero_order_paths",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    """Imports a public name from its module on first use (PEP 562), so that importing the package costs nothing."""
    if name not in _HOMES:
        raise AttributeError(f"module 'bondgraph' has no attribute {name!r}")
    value = getattr(import_module(f"bondgraph.{_HOMES[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
