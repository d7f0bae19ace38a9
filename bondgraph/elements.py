"""The elements of a bond graph with their laws, and the energy domains with their quantities and units.

One-ports: Se and Sf (sources), I, C, R. Two-ports: TF (f_out = T f_in, e_in = T e_out) and GY (e_out = G f_in,
e_in = G f_out). Junctions: 1 (common flow) and 0 (common effort). A law or a modulus that depends on displacements, time or
signals makes the element modulated (MSe, MTF...). Laws are plain numbers, Python functions or SymPy expressions of named
quantities (`bondgraph.laws.Function`), or, where a mechanism gives the positions, a `Modulus` or `Law` of its motion.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, NamedTuple

from bondgraph.laws import Function, GraphError, law_of


class Quantity(NamedTuple):
    """The name of a physical quantity and its SI unit."""

    name: str
    unit: str


class Domain(NamedTuple):
    """An energy domain: effort times flow is power; momentum and displacement are their integrals over time.

    >>> DOMAINS["hydraulic"].effort, DOMAINS["hydraulic"].displacement.unit
    (Quantity(name='pressure', unit='Pa'), 'm^3')
    """

    name: str
    effort: Quantity
    flow: Quantity
    momentum: Quantity
    displacement: Quantity


_QUANTITIES = """
translation: force [N], velocity [m/s], momentum [N s], displacement [m]
rotation: torque [N m], angular velocity [rad/s], angular momentum [N m s], angle [rad]
electric: voltage [V], current [A], flux linkage [V s], charge [C]
magnetic: magnetomotive force [A], flux rate [Wb/s], - [-], magnetic flux [Wb]
hydraulic: pressure [Pa], volume flow [m^3/s], pressure momentum [Pa s], volume [m^3]
thermal: temperature [K], entropy flow [W/K], - [-], entropy [J/K]
chemical: chemical potential [J/mol], molar flow [mol/s], - [-], amount of substance [mol]
"""

DOMAINS: dict[str, Domain] = {
    name: Domain(name, *(Quantity(*pair) for pair in re.findall(r"([^,[]+) \[([^]]+)\],? ?", quantities)))
    for name, quantities in (line.split(": ") for line in _QUANTITIES.strip().splitlines())
}


class Motion(NamedTuple):
    """The source of the positions of a modulus or law: the velocity graph cannot give them.

    `position(q, ns, q_anchor)` is called with the displacement q of the 1-junction named `of`, the namespace of
    functions that fits q (numpy, mpmath, sympy...) and the displacement in the middle of the smooth piece that q lies
    in, and returns whatever the laws that share this motion pick from.
    """

    of: str
    position: Callable[[Any, Any, Any], Any] = lambda q, ns, q_anchor: q


class Here(NamedTuple):
    """The arguments of a source's law at a set of positions: the displacement q, the motion's position, the namespace.

    A law that is `moving` also sees the flow dq/dt of the motion's 1-junction (`speed`), that of its own (`flow`), and the
    time.
    """

    q: Any
    position: Any
    ns: Any
    speed: Any = None
    flow: Any = None
    time: Any = None


class Modulus(NamedTuple):
    """A transformer's ratio T(q) and its slope dT/dq, both picked from the motion's position."""

    value: Callable[[Any], Any]
    slope: Callable[[Any], Any]
    motion: Motion


class Law(NamedTuple):
    """An effort that depends on position: `effort(here, anchor)`.

    `anchor` is the same as `here` in the middle of the smooth piece: every switch (a window's end, a comparison) is
    decided there, so that a piece never sees its neighbour's branch. `per_unknown` is the factor of the one unknown
    parameter that a balance solves for: the whole effort is effort + unknown * per_unknown. `moving`: it depends on speed
    or time too, on those of `Here` that `sees` names. `acts(anchor)` is false in pieces where the effort is 0 throughout;
    it is None where the effort acts everywhere.
    """

    effort: Callable[[Here, Here], Any]
    motion: Motion
    per_unknown: Callable[[Here, Here], Any] | None = None
    moving: bool = False
    sees: tuple[str, ...] = ("speed", "flow", "time")
    acts: Callable[[Here], Any] | None = None


class Displacement(NamedTuple):
    """A declared displacement: the integral of the flow of the 1-junction `of`, with its value at the start."""

    name: str
    of: str
    initial: float = 0.0


ONE_PORTS = frozenset({"Se", "Sf", "I", "C", "R"})
TWO_PORTS = frozenset({"TF", "GY"})
JUNCTIONS = frozenset({"0", "1"})
SOURCES = frozenset({"Se", "Sf"})
STORES = frozenset({"I", "C"})


class Element(NamedTuple):
    """A named element: its kind, its law (None for junctions), its energy domain, and whose part it is.

    A one-port without a domain of its own takes that of its junction.
    """

    kind: str
    name: str
    law: float | Function | Law | Modulus | None = None
    domain: str = ""
    part: str = ""

    @property
    def symbol(self) -> str:
        """The kind as it is drawn: MSe, MTF... where the law is no plain number (parameters count as modulation here)."""
        modulated = self.kind in SOURCES | TWO_PORTS and not isinstance(self.law, int | float | None)
        return f"M{self.kind}" if modulated else self.kind


def One(name: str, domain: str = "") -> Element:
    """A 1-junction: one flow, efforts sum to zero."""
    return Element("1", name, None, domain)


def Zero(name: str, domain: str = "") -> Element:
    """A 0-junction: one effort, flows sum to zero."""
    return Element("0", name, None, domain)


def Se(name: str, effort: Any, domain: str = "", part: str = "") -> Element:
    """A source of effort: a number, or a function of displacements, time and signals (MSe)."""
    return Element("Se", name, law_of(effort), domain, part)


def Sf(name: str, flow: Any, domain: str = "", part: str = "") -> Element:
    """A source of flow: a number, or a function of displacements, time and signals (MSf)."""
    return Element("Sf", name, law_of(flow), domain, part)


def I(name: str, inertia: Any, domain: str = "", part: str = "") -> Element:  # noqa: E743
    """An inertia: p = I f. Its value is a number, or an expression of parameters."""
    return Element("I", name, law_of(inertia), domain, part)


def C(name: str, law: Any = None, domain: str = "", part: str = "", *, stiffness: Any = None) -> Element:
    """A compliance: e = q/C with `law` = C a number, any e(q) with a function of q, or linear by its stiffness 1/C.

    >>> C("spring", 0.125).law == C("spring", stiffness=8.0).law == 0.125
    True
    """
    if stiffness is None:
        return Element("C", name, law_of(law), domain, part)
    if law is not None:
        raise GraphError(f"C:{name}: found a compliance and a stiffness, expected one of them")
    if not stiffness:
        raise GraphError(f"C:{name}: found stiffness 0, expected another number; a spring that is not there is left out")
    return Element("C", name, law_of(1.0 / stiffness), domain, part)


def R(name: str, law: Any, domain: str = "", part: str = "") -> Element:
    """A resistor: e = R f with a number, any e(f) with a function of its own flow f (and of displacements, time...)."""
    return Element("R", name, law_of(law), domain, part)


def RS(name: str, law: Any, domain: str = "", part: str = "") -> Element:
    """A resistor with a thermal port: what it dissipates heats the body that it has its second bond to.

    Hung on a junction as R is, and bonded to the 0-junction of a body: `b.on("shaft", RS("rub", 0.5)).bond("rub", "body")`.
    In the graph it is the resistor, and a source of the entropy flow e f/T, so that its power comes back as heat.
    """
    return Element("RS", name, law_of(law), domain, part)


def TF(name: str, ratio: Any) -> Element:
    """A transformer: f_out = T f_in, e_in = T e_out; with a function or a `Modulus`, a modulated one (MTF)."""
    return Element("TF", name, law_of(ratio))


def GY(name: str, ratio: Any) -> Element:
    """A gyrator: e_out = G f_in, e_in = G f_out; with a function, a modulated one (MGY)."""
    return Element("GY", name, law_of(ratio))
