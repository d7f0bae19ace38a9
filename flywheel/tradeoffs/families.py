"""Names of methods: their families, in the order in which they are told, and the mark of those that restart at breaks."""

from __future__ import annotations

RESTARTED = ", restarted"
AREAS = "accumulated areas"
INERTIA_TORQUE = "inertia torque at constant speed"
GRID = "plain grid"
CLOSED_FORM = "exact, closed form"
ALONG_THE_MOTION = "exact, collocation"
COLLOCATION = "collocation"
BOND_GRAPH = "whole bond graph"
MULTIPLIERS = "Lagrange's multipliers"


def stepping(kind: str) -> str:
    """The family of a stepper.

    >>> stepping("RK4")
    'time stepping, RK4'
    """
    return f"time stepping, {kind}"


FAMILIES = (
    *(AREAS, INERTIA_TORQUE, GRID, CLOSED_FORM, ALONG_THE_MOTION, COLLOCATION),
    *map(stepping, ("Euler", "RK4", "RK45", "DOP853", "LSODA")),
    *(BOND_GRAPH, MULTIPLIERS),
)
"""Families in the order in which they are told; any other comes after them."""
