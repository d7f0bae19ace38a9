"""Gas on a piston: its force from a pressure, indicator diagrams, reciprocating compressors."""

from __future__ import annotations

from math import log, pi
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.numerics.expressions import Expression, Node, between, compiled, numeral, variable

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
    wide = np.flatnonzero(np.diff(x) > 0)

    def rows(column: Array) -> Node:
        """Straight lines between the rows of a column, of the name x."""
        force = gas_force(column, space, atmosphere)[order]
        lines = []
        for k in wide:
            way = Node("sum", (variable("x"), numeral(x[k])), signs=("+", "-"))
            slope = (force[k + 1] - force[k]) / (x[k + 1] - x[k])
            rise = Node("product", (numeral(slope), way), signs=("*", "*"))
            lines.append(Node("sum", (numeral(force[k]), rise), signs=("+", "+")) if slope else numeral(force[k]))
        return between(variable("x"), x[wide[1:]].tolist(), lines)

    away = compiled(f"v {'<' if space.sense > 0 else '>'} 0").tree
    return Expression(f"indicator diagram of {x.size} rows", Node("if", (away, rows(diagram.out), rows(diagram.back))))


class Compression(NamedTuple):
    """A compressor's cycle: absolute pressures (Pa), clearance as a share of the swept volume, exponents of p V^n.

    `exponent` n is that of compression, `expansion` m that of the gas left in the clearance.
    """

    suction: float
    discharge: float
    clearance: float
    exponent: float
    expansion: float

    @property
    def ratio(self) -> float:
        """Ratio of the pressures, r."""
        return self.discharge / self.suction

    @property
    def delivery_begins(self) -> float:
        """Share of the stroke from the cover at which the delivery valve opens: (1 + c) r^(-1/n) - c."""
        return float((1.0 + self.clearance) * self.ratio ** (-1.0 / self.exponent) - self.clearance)

    @property
    def suction_begins(self) -> float:
        """Share of the stroke from the cover at which the suction valve opens: c (r^(1/m) - 1)."""
        return float(self.clearance * (self.ratio ** (1.0 / self.expansion) - 1.0))


def volumetric_efficiency(cycle: Compression) -> float:
    """Share of the swept volume that is drawn in, at suction conditions: 1 + c - c r^(1/m).

    Args:
        cycle: pressures, clearance c, exponents.

    Valid without losses in the valves and without heating of the gas drawn in. Where it is 0 or less, the compressor
    delivers nothing.

    Source: T. D. Eastop and A. McConkey, Applied Thermodynamics for Engineering Technologists, chapter 12.

    >>> round(volumetric_efficiency(Compression(1e5, 7e5, 0.05, 1.3, 1.3)), 6)
    0.826619

    """
    return 1.0 - cycle.suction_begins


def compressor_work(cycle: Compression, swept: float) -> float:
    """Work that a gas space takes in a double stroke: compression and delivery less what the clearance gives back, J.

    W = n/(n-1) p_s V_1 (r^((n-1)/n) - 1) - m/(m-1) p_s V_4 (r^((m-1)/m) - 1), with V_1 = V (1 + c), V_4 = V c r^(1/m);
    with one exponent n/(n-1) p_s (V_1 - V_4) (r^((n-1)/n) - 1). An exponent of 1 has the logarithm of r instead.

    Args:
        cycle: pressures, clearance, exponents.
        swept: V = A S, m³.

    Valid for an ideal gas without losses in the valves.

    Source: Eastop and McConkey, chapter 12.

    >>> round(compressor_work(Compression(1e5, 7e5, 0.05, 1.3, 1.3), 1e-3), 4)
    203.0405

    """

    def head(exponent: float) -> float:
        """n/(n-1) (r^((n-1)/n) - 1), which tends to log r for n = 1."""
        if exponent == 1.0:
            return log(cycle.ratio)
        power = (exponent - 1.0) / exponent
        return float(np.expm1(power * log(cycle.ratio)) / power)

    drawn = (1.0 + cycle.clearance) * swept
    left = cycle.clearance * cycle.ratio ** (1.0 / cycle.expansion) * swept
    return float(cycle.suction * (drawn * head(cycle.exponent) - left * head(cycle.expansion)))


def cylinder_pressure(share: ArrayLike, outward: ArrayLike, cycle: Compression) -> Array:
    """Absolute pressure over a double stroke, Pa.

    Towards the cover p = p_s ((1 + c)/(c + s))^n until it reaches p_d; away from it p = p_d (c/(c + s))^m until it falls to
    p_s.

    Args:
        share: s of the stroke, from the cover, 0 to 1, any shape.
        outward: whether the piston moves away from the cover, same shape.
        cycle: pressures, clearance c, exponents.

    Valid without losses in the valves, which open and close at once.

    Source: Eastop and McConkey, chapter 12.

    >>> cycle = Compression(1e5, 4e5, 0.25, 2.0, 2.0)
    >>> cylinder_pressure([0.0, 0.25, 0.375, 1.0, 1.0], [True, True, False, False, True], cycle).tolist()
    [400000.0, 100000.0, 400000.0, 100000.0, 100000.0]

    """
    s, c = np.asarray(share, dtype=float), cycle.clearance
    with np.errstate(divide="ignore", invalid="ignore"):
        rising = np.minimum(cycle.suction * ((1.0 + c) / (c + s)) ** cycle.exponent, cycle.discharge)
        falling = np.maximum(cycle.discharge * (c / (c + s)) ** cycle.expansion, cycle.suction)
    return np.where(outward, falling if c else cycle.suction, rising)


def compressor_law(cycle: Compression, spaces: tuple[Space, ...], atmosphere: float = ATMOSPHERE) -> Expression:
    """Force of a compressor's gas on its port, as an expression of x and the sense of v: the sum over its gas spaces.

    Each space has its `gas_force` by `cylinder_pressure`; a double-acting cylinder has two spaces.

    Args:
        cycle: pressures, clearance, exponents.
        spaces: areas and ends of the stroke.
        atmosphere: p_0 behind each piston face, Pa.

    >>> cycle = Compression(1e5, 4e5, 0.25, 2.0, 2.0)
    >>> law = compressor_law(cycle, (Space(0.01, 0.2, 0.0),), 1e5)
    >>> float(law.evaluate({"x": 0.2, "v": 1.0}, np)), law.uses_speed
    (-3000.0, False)

    """
    parts = [_space_law(cycle, space, atmosphere) for space in spaces]
    if len(parts) == 1:
        return parts[0]
    tree = Node("sum", tuple(part.tree for part in parts), signs=("+",) * len(parts))
    return Expression(" + ".join(f"({part.text})" for part in parts), tree)


def _space_law(cycle: Compression, space: Space, atmosphere: float) -> Expression:
    """Force of one gas space; its volumes are lengths of cylinder from a head at `head`."""
    towards, inside = (">", "head - x") if space.sense > 0 else ("<", "x - head")
    inside = inside.replace("head", "{head}")
    rising = f"{{pd}} if x {towards} {{opens}} else {{ps}}*({{whole}}/({inside}))**{{n}}"
    falling = f"{{ps}} if x {'<' if space.sense > 0 else '>'} {{draws}} else {{pd}}*({{least}}/({inside}))**{{m}}"
    falling = falling if cycle.clearance else "{ps}"
    stroke, c = space.stroke, cycle.clearance
    at = {
        name: space.near - space.sense * stroke * share
        for name, share in {"head": -cycle.clearance, "opens": cycle.delivery_begins, "draws": cycle.suction_begins}.items()
    }
    return compiled(
        f"{{force}}*((({rising}) if v {towards} 0 else ({falling})) - {{p0}})",
        force=-space.sense * space.area,
        ps=cycle.suction,
        pd=cycle.discharge,
        p0=atmosphere,
        n=cycle.exponent,
        m=cycle.expansion,
        whole=(1.0 + c) * stroke,
        least=c * stroke,
        **at,
    )
