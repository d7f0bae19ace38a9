"""The slider-crank in closed form and as a graph: what methods are compared on.

Lengths run along x from the crank's pivot to the slider, so that the slider starts at x = r + l and first moves inwards.
The closed forms do not use the graph, so that each checks the other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from bondgraph.builder import Builder
from bondgraph.elements import I
from bondgraph.faults import GraphError, refuse, size_faults


@dataclass(frozen=True)
class SliderCrank:
    """A crank (a thin bar about its end), a uniform rod and a slider on a line through the pivot.

    Args:
        radius: of the crank, r, m.
        length: of the rod, l > r, m.
        crank: mass of the crank, kg; its inertia is m r²/3.
        rod: mass of the rod, kg; its inertia about its own centre is m l²/12. 0 leaves it out.
        slider: mass of the slider, kg.

    Raises:
        GraphError: if the crank cannot turn all round, or a mass is not above 0 (the rod's: below 0).

    """

    radius: float = 1.0
    length: float = 2.0
    crank: float = 1.0
    rod: float = 1.0
    slider: float = 1.0

    def __post_init__(self) -> None:
        faults = size_faults((name, value) for name, value in vars(self).items() if (name, value) != ("rod", 0))
        if not self.radius < self.length:
            faults.append(f"radius {self.radius} m, length {self.length} m: the rod must be longer than the crank to turn")
        refuse(faults)

    @property
    def ratio(self) -> float:
        """Lambda = r/l."""
        return self.radius / self.length

    @property
    def crank_inertia(self) -> float:
        """Of the crank about its pivot, m r²/3, kg m²."""
        return self.crank * self.radius**2 / 3

    def along(self, share: float, theta: Any, ns: Any = np) -> tuple[Any, Any, Any]:
        """Of a point on the rod (`share` 1: the slider): x = r cos theta + share l cos beta, dx/dtheta and d²x/dtheta²."""
        u, c, ratio, r = ns.sin(theta), ns.cos(theta), self.ratio, self.radius
        w = ns.sqrt(1.0 - (ratio * u) ** 2)  # cos beta
        bend = ratio * (c * c - u * u) / w + ratio**3 * (u * c) ** 2 / w**3
        return r * c + share * self.length * w, -r * (u + share * ratio * u * c / w), -r * (c + share * bend)

    def swing(self, theta: Any, ns: Any = np) -> tuple[Any, Any]:
        """The rod's angular velocity per crank's, dbeta/dtheta = lambda cos theta/cos beta, and its slope."""
        u, c, ratio = ns.sin(theta), ns.cos(theta), self.ratio
        w = ns.sqrt(1.0 - (ratio * u) ** 2)
        return ratio * c / w, -ratio * (1.0 - ratio**2) * u / w**3

    def builder(self, theta: float = 0.0) -> Builder:
        """The graph without loads: 1-junctions "crank" (displacement theta) and "slider" (displacement x), a MTF between.

        The inertias are "J", "m" and, of a rod with mass, "J_rod", "m_x", "m_y", each behind a MTF from the crank.
        """
        b = Builder().one("crank", "rotation", displacement="theta", initial=theta)
        b.one("slider", "translation", displacement="x", initial=float(self.along(1.0, theta)[0]))
        b.on("crank", I("J", self.crank_inertia)).on("slider", I("m", self.slider))
        b.transform("crank", "slider", lambda theta: self.along(1.0, theta)[1])
        if not self.rod:
            return b
        b.one("rod", "rotation").one("rod x", "translation").one("rod y", "translation")
        b.on("rod", I("J_rod", self.rod * self.length**2 / 12)).on("rod x", I("m_x", self.rod)).on(
            "rod y", I("m_y", self.rod)
        )
        b.transform("crank", "rod", lambda theta: self.swing(theta)[0])
        b.transform("crank", "rod x", lambda theta: self.along(0.5, theta)[1])
        return b.transform("crank", "rod y", lambda theta: 0.5 * self.radius * np.cos(theta))


class Imposed(NamedTuple):
    """A motion of the crank that is given: its angle (rad), its rate and the rate of that, as functions of t (s)."""

    name: str
    theta: Callable[[Any], Any]
    omega: Callable[[Any], Any]
    alpha: Callable[[Any], Any]


HARMONIC = Imposed("theta = sin t", lambda t: np.sin(t), lambda t: np.cos(t), lambda t: -np.sin(t))
STEADY = Imposed("theta = 5 t", lambda t: 5.0 * t, lambda t: 5.0 + 0.0 * t, lambda t: 0.0 * t)


class Slider(NamedTuple):
    """The slider's position (m), velocity (m/s) and acceleration (m/s²)."""

    position: Any
    velocity: Any
    acceleration: Any


def triangle(machine: SliderCrank, theta: Any, omega: Any, alpha: Any) -> Slider:
    """The slider by the triangle of crank, rod and line.

    x = r cos theta + sqrt(l² - r² sin² theta), v = -r omega (lambda sin 2theta/(2 w) + sin theta) and, with
    w = sqrt(1 - lambda² sin² theta), a = alpha dx/dtheta - r omega² (lambda cos 2theta/w + (lambda³/4) sin² 2theta/w³
    + cos theta), dx/dtheta = v/omega. The middle term is also found printed as (lambda²/2) sin 2theta/w³, which is wrong:
    it gives 1.44554 where 1.38288 is true.

    >>> float(round(-triangle(SliderCrank(), 0.3, 1.0, 0.0).acceleration, 5))
    1.38288
    """
    x, slope, bend = machine.along(1.0, theta)
    return Slider(x, slope * omega, slope * alpha + bend * omega**2)


class Inertia(NamedTuple):
    """The machine's inertia seen from the crank, J(theta) in kg m², and dJ/dtheta."""

    value: Any
    slope: Any

    def torque(self, omega: Any, alpha: Any) -> Any:
        """The torque (N m) of a motion without loads, by Lagrange: J alpha + ½ (dJ/dtheta) omega²."""
        return self.value * alpha + 0.5 * self.slope * omega**2

    def alpha(self, omega: Any) -> Any:
        """The acceleration of the crank (rad/s²) where nothing drives it: -½ (dJ/dtheta) omega²/J."""
        return -0.5 * self.slope * omega**2 / self.value


def exact_inertia(machine: SliderCrank, theta: Any) -> Inertia:
    """J = J_crank + (m l²/12) (dbeta/dtheta)² + m (x_G'² + y_G'²) + m_slider x'², primes by theta: no term left out.

    >>> inertia = exact_inertia(SliderCrank(), 0.0)  # 1/3 of the crank, 1/12 + 1/4 of the rod
    >>> round(float(inertia.value), 12), float(inertia.slope)
    (0.666666666667, 0.0)
    """
    swing, swing_slope = machine.swing(theta)
    _, along, along_slope = machine.along(1.0, theta)
    _, middle, middle_slope = machine.along(0.5, theta)
    across, across_slope = 0.5 * machine.radius * np.cos(theta), -0.5 * machine.radius * np.sin(theta)
    own = machine.rod * machine.length**2 / 12
    value = own * swing**2 + machine.rod * (middle**2 + across**2) + machine.slider * along**2
    slope = own * swing * swing_slope + machine.rod * (middle * middle_slope + across * across_slope)
    return Inertia(machine.crank_inertia + value, 2.0 * (slope + machine.slider * along * along_slope))


def small_ratio_inertia(machine: SliderCrank, theta: Any, *, about: str = "centre") -> Inertia:
    """J with only the lowest powers of lambda: J_crank + (m_slider + m) r² sin² theta + (J_rod + m l²/4) lambda² cos² theta.

    The slider's swing from the rod's angle is left out (x = r cos theta + l), which costs terms of the order lambda.

    Args:
        machine: the slider-crank.
        theta: angle of the crank, rad.
        about: "centre" takes J_rod = m l²/12. "end" takes m l²/3 there, a slip found in print: the inertia about the end
            already holds the m l²/4 that the formula adds.

    Raises:
        GraphError: if `about` is neither.

    """
    if about not in ("centre", "end"):
        raise GraphError(f"about: found {about!r}, expected 'centre' or 'end'")
    rod = machine.rod * machine.length**2 * ((1 / 12 if about == "centre" else 1 / 3) + 1 / 4) * machine.ratio**2
    sliding = (machine.slider + machine.rod) * machine.radius**2
    u, c = np.sin(theta), np.cos(theta)
    return Inertia(machine.crank_inertia + sliding * u * u + rod * c * c, 2.0 * (sliding - rod) * u * c)
