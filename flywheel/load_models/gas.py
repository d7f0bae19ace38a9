"""Gas on a piston: its force from a pressure, and an indicator diagram against the way of the piston."""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.formulas.building import between, compiled, numeral, variable
from flywheel.formulas.expressions import Expression
from flywheel.formulas.trees import Node

Array = NDArray[np.float64]

ATMOSPHERE = 101325.0
"""Standard atmosphere, Pa."""


class Space(NamedTuple):
    """A gas space in front of a piston: the area (m²) that gas presses on, and the ends of the stroke (m).

    `near` is the port's displacement where the piston stands closest to this space's cover, `far` where it stands away.
    """

    area: float
    near: float
    far: float

    @property
    def stroke(self) -> float:
        """Way of the piston, m."""
        return abs(self.far - self.near)

    @property
    def sense(self) -> int:
        """1 where the cover lies at the greatest displacement, -1 where at the least: gas pushes the other way."""
        return 1 if self.near > self.far else -1


class Indicator(NamedTuple):
    """An indicator diagram: pressures (Pa) against the share of the stroke, 0 at the cover, that ascends from 0 to 1.

    `out` holds while the piston moves away from the cover, `back` while it returns. Two equal shares are a jump.
    """

    share: Array
    out: Array
    back: Array


def piston_area(bore: float, rod: float = 0.0) -> float:
    """Area that gas presses on: A = pi (D² - d²)/4, in m².

    Args:
        bore: D of the cylinder, m.
        rod: d of a rod that passes through this gas space, m.

    Source: Khurmi & Gupta, Theory of Machines, chapter 15 (piston effort, double-acting engines).

    >>> round(piston_area(0.3), 6), round(piston_area(0.3, 0.05), 6)
    (0.070686, 0.068722)

    """
    return pi * (bore - rod) * (bore + rod) / 4


def gas_force(pressure: ArrayLike, space: Space, atmosphere: float = ATMOSPHERE) -> Array:
    """Force of gas on a port: F = -+ (p - p_0) A, away from the cover while p is above p_0.

    Two spaces of a double-acting cylinder, each taken so, add up to p_2 (A - a) - p_1 A + p_0 a, the atmosphere's share on
    the rod included.

    Args:
        pressure: p, absolute, Pa, any shape; above the atmosphere where `atmosphere` is 0.
        space: A, and the end at which the cover lies.
        atmosphere: p_0 behind the piston, Pa.

    Source: Khurmi & Gupta, chapter 15.

    >>> gas_force([3e5, 1e5], Space(0.01, 0.5, 0.3), 1e5).tolist()
    [-2000.0, 0.0]

    """
    return -space.sense * (np.asarray(pressure, dtype=float) - atmosphere) * space.area + 0.0


def indicated_pressure(share: ArrayLike, outward: ArrayLike, diagram: Indicator) -> Array:
    """Pressure of an indicator diagram, straight between its rows.

    Args:
        share: of the stroke, from the cover, 0 to 1, any shape.
        outward: whether the piston moves away from the cover, same shape.
        diagram: its rows.

    >>> loop = Indicator(np.array([0.0, 1.0]), np.array([4e5, 2e5]), np.array([3e5, 1e5]))
    >>> indicated_pressure([0.5, 0.5], [True, False], loop).tolist()
    [300000.0, 200000.0]

    """
    at = np.asarray(share, dtype=float)
    out, back = (np.interp(at, diagram.share, column) for column in (diagram.out, diagram.back))
    return np.asarray(np.where(outward, out, back))


def indicated_work(diagram: Indicator, area: float, stroke: float) -> float:
    """Work of the gas on the piston in a double stroke: W = A S times the integral of (p_out - p_back) over the share, in J.

    Args:
        diagram: its rows.
        area: A, m².
        stroke: S, m.

    Source: Khurmi & Gupta, chapter 15 (mean effective pressure).

    >>> loop = Indicator(np.array([0.0, 1.0]), np.array([4e5, 2e5]), np.array([3e5, 1e5]))
    >>> indicated_work(loop, 0.01, 0.2)
    200.0

    """
    return float(np.trapezoid(diagram.out - diagram.back, diagram.share)) * area * stroke


def indicator_law(diagram: Indicator, space: Space, atmosphere: float = ATMOSPHERE) -> Expression:
    """Force on a port from an indicator diagram, as an expression of x and the sense of v: `gas_force` row by row.

    Args:
        diagram: its rows, absolute pressures.
        space: area, ends of the stroke.
        atmosphere: behind the piston, Pa; 0 for pressures above it.

    """
    order = slice(None, None, -space.sense)
    x = (space.near + (space.far - space.near) * diagram.share)[order]
    out, back = (_rows(x, gas_force(column, space, atmosphere)[order]) for column in (diagram.out, diagram.back))
    away = compiled(f"v {'<' if space.sense > 0 else '>'} 0").tree
    text = f"indicator diagram of {x.size} rows"
    return Expression(text, Node("if", (away, out, back)))


def _rows(x: Array, force: Array) -> Node:
    """Straight lines between rows."""
    wide = np.flatnonzero(np.diff(x) > 0)
    lines = [_line(x[k], force[k], (force[k + 1] - force[k]) / (x[k + 1] - x[k])) for k in wide]
    return between(variable("x"), x[wide[1:]].tolist(), lines)


def _line(x: float, force: float, slope: float) -> Node:
    """A straight line through (x, force), of the name x."""
    if slope == 0.0:
        return numeral(force)
    way = Node("sum", (variable("x"), numeral(x)), signs=("+", "-"))
    return Node("sum", (numeral(force), Node("product", (numeral(slope), way), signs=("*", "*"))), signs=("+", "+"))
