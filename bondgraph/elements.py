"""The elements of a bond graph and their laws.

One-ports: Se and Sf (sources), I, C, R. Two-ports: TF (f_out = T f_in, e_in = T e_out) and GY (e_out = G f_in,
e_in = G f_out). Junctions: 1 (common flow) and 0 (common effort). A law or a modulus that is no plain number makes
the element modulated (MSe, MTF...): it then depends on the displacement of a named 1-junction.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple


class GraphError(ValueError):
    """A graph that is not well formed, or that cannot be reduced as asked; says which elements are concerned."""


class Motion(NamedTuple):
    """Where a modulus or law takes its positions from: the velocity graph cannot give them.

    `position(q, ns, q_anchor)` is called with the displacement q of the 1-junction named `of`, the namespace of
    functions that fits q (numpy, mpmath, sympy...) and the displacement in the middle of the smooth piece that q lies
    in, and returns whatever the laws that share this motion pick from.
    """

    of: str
    position: Callable[[Any, Any, Any], Any] = lambda q, ns, q_anchor: q


class Here(NamedTuple):
    """What a source's law sees at a set of positions: the displacement q, the motion's position, the namespace."""

    q: Any
    position: Any
    ns: Any


class Modulus(NamedTuple):
    """A transformer's ratio T(q) and its slope dT/dq, both picked from the motion's position."""

    value: Callable[[Any], Any]
    slope: Callable[[Any], Any]
    motion: Motion


class Law(NamedTuple):
    """An effort that depends on position: `effort(here, anchor)`.

    `anchor` is the same as `here` in the middle of the smooth piece: every switch (a window's end, a comparison) is
    decided there, so that a piece never sees its neighbour's branch. `per_unknown` is the factor of the one unknown
    parameter that a balance solves for: the whole effort is effort + unknown * per_unknown.
    """

    effort: Callable[[Here, Here], Any]
    motion: Motion
    per_unknown: Callable[[Here, Here], Any] | None = None


ONE_PORTS = frozenset({"Se", "Sf", "I", "C", "R"})
TWO_PORTS = frozenset({"TF", "GY"})
JUNCTIONS = frozenset({"0", "1"})


class Element(NamedTuple):
    """A named element: its kind, its law (number, Law or Modulus; None for junctions), and whose part it is."""

    kind: str
    name: str
    law: float | Law | Modulus | None = None
    domain: str = "rotation"
    part: str = ""

    @property
    def symbol(self) -> str:
        """The kind as it is drawn: MSe, MTF... where the law is no plain number."""
        modulated = self.kind not in JUNCTIONS and not isinstance(self.law, int | float)
        return f"M{self.kind}" if modulated else self.kind


def One(name: str, domain: str = "rotation") -> Element:
    """A 1-junction: one flow, efforts sum to zero."""
    return Element("1", name, None, domain)


def Zero(name: str, domain: str = "rotation") -> Element:
    """A 0-junction: one effort, flows sum to zero."""
    return Element("0", name, None, domain)


def Se(name: str, effort: float | Law, part: str = "") -> Element:
    """A source of effort; with a `Law`, a modulated one (MSe)."""
    return Element("Se", name, effort, part=part)


def Sf(name: str, flow: float, part: str = "") -> Element:
    """A source of flow."""
    return Element("Sf", name, flow, part=part)


def I(name: str, inertia: float, part: str = "") -> Element:  # noqa: E743
    """An inertia: p = I f."""
    return Element("I", name, inertia, part=part)


def C(name: str, law: Law, part: str = "") -> Element:
    """A compliance, given by the effort that it takes at each displacement (e = q/C, or any law of position)."""
    return Element("C", name, law, part=part)


def R(name: str, resistance: float, part: str = "") -> Element:
    """A resistor: e = R f."""
    return Element("R", name, resistance, part=part)


def TF(name: str, ratio: float | Modulus) -> Element:
    """A transformer: f_out = T f_in, e_in = T e_out; with a `Modulus`, a modulated one (MTF)."""
    return Element("TF", name, ratio)


def GY(name: str, ratio: float) -> Element:
    """A gyrator: e_out = G f_in, e_in = G f_out."""
    return Element("GY", name, ratio)
