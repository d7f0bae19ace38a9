"""Reciprocating compressors: pressure over a double stroke, work and volumetric efficiency, force on the piston."""

from __future__ import annotations

from math import log
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.formulas.building import compiled
from flywheel.formulas.expressions import Expression
from flywheel.formulas.trees import Node
from flywheel.load_models.gas import ATMOSPHERE, Space

Array = NDArray[np.float64]


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
    drawn = (1.0 + cycle.clearance) * swept
    left = cycle.clearance * cycle.ratio ** (1.0 / cycle.expansion) * swept
    return float(cycle.suction * (drawn * _head(cycle.ratio, cycle.exponent) - left * _head(cycle.ratio, cycle.expansion)))


def _head(ratio: float, exponent: float) -> float:
    """n/(n-1) (r^((n-1)/n) - 1), which tends to log r for n = 1."""
    if exponent == 1.0:
        return log(ratio)
    power = (exponent - 1.0) / exponent
    return float(np.expm1(power * log(ratio)) / power)


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
    at = {name: space.near - space.sense * stroke * share for name, share in _shares(cycle).items()}
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


def _shares(cycle: Compression) -> dict[str, float]:
    """Places in shares of the stroke from the cover: the cover itself, where delivery begins, where suction begins."""
    return {"head": -cycle.clearance, "opens": cycle.delivery_begins, "draws": cycle.suction_begins}
