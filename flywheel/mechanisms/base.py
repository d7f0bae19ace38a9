"""What a family of mechanisms tells the machine: positions, and the chain of local ratios with their slopes.

A family is written once against a namespace `ns` (numpy, mpmath, sympy, or the project's intervals), so no formula
exists twice. `Family.position(psi, ns)` does the geometry for one angle or an array; everything else picks from it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any, NamedTuple


class Ratio(NamedTuple):
    """A local transmission ratio T(psi) and its slope dT/dpsi, both read from a position."""

    value: Callable[[Any], Any]
    slope: Callable[[Any], Any]


class Term(NamedTuple):
    """One transformer: the velocity it starts from (`crank` is the mechanism's own shaft) and its ratio."""

    source: str
    ratio: float | Ratio


class Velocity(NamedTuple):
    """A velocity of the mechanism, one 1-junction: the sum of its terms (one term: a plain transformer)."""

    name: str
    rotating: bool
    terms: tuple[Term, ...]


class Mass(NamedTuple):
    """A mass (kg) on a translating velocity or an inertia (kg m²) on a rotating one; `body` names whose it is."""

    velocity: str
    value: float
    body: str


class Weight(NamedTuple):
    """A body's mass (kg) that gravity pulls along a velocity of fixed `direction` (rad from +x)."""

    velocity: str
    mass: float
    direction: float
    body: str


class Port(NamedTuple):
    """A place for loads, springs and added inertia: a velocity, and the displacement that is its integral.

    `returns` is False where the displacement gains a constant each turn, so that no spring can hang on it. At `kinks`
    (rad of psi in [0, period)) the velocity jumps, so that no inertia can sit on it. `dead_centres` are all the angles
    (rad of psi in [0, 2 pi), ascending) at which the velocity changes its sign, where a closed form gives them.
    """

    velocity: str
    position: Callable[[Any], Any]
    returns: bool = True
    kinks: tuple[float, ...] = ()
    dead_centres: tuple[float, ...] = ()


class Family(NamedTuple):
    """One mechanism of a family, ready to be hung on a shaft.

    `position(psi, ns, anchor=None)` gives the positions at the mechanism's own crank angle psi (rad). `anchor` is
    the angle in the middle of the smooth piece that psi lies in, where a law decides its branches (the other
    families ignore it). `breakpoints` are the angles in [0, period) where a cell must end, for smoothness or
    resolution; the period is a turn, or that of the mechanism's laws.
    """

    velocities: tuple[Velocity, ...]
    masses: tuple[Mass, ...]
    weights: tuple[Weight, ...]
    ports: Mapping[str, Port]
    position: Callable[..., Any]
    breakpoints: tuple[float, ...] = ()


class Position:
    """Positions at crank angle psi, lazily: an attribute is computed when first read, then kept."""

    def __init__(self, psi: Any, ns: Any) -> None:
        self.psi = psi
        self.ns = ns

    @cached_property
    def sin(self) -> Any:
        """Sine of the crank angle."""
        return self.ns.sin(self.psi)

    @cached_property
    def cos(self) -> Any:
        """Cosine of the crank angle."""
        return self.ns.cos(self.psi)

    @cached_property
    def half_sin(self) -> Any:
        """Sine of half the crank angle: 1 - cos psi = 2 half_sin² keeps its digits near psi = 0."""
        return self.ns.sin(self.psi * 0.5)

    @cached_property
    def half_cos(self) -> Any:
        """Cosine of half the crank angle: 1 + cos psi = 2 half_cos² keeps its digits near psi = pi."""
        return self.ns.cos(self.psi * 0.5)
