"""The elements of a bond graph with their laws, and the energy domains with their quantities and units.

One-ports: Se and Sf (sources), I, C, R. Two-ports: TF (f_out = T f_in, e_in = T e_out) and GY (e_out = G f_in,
e_in = G f_out). Junctions: 1 (common flow) and 0 (common effort). A law or a modulus that depends on displacements, time or
signals makes the element modulated (MSe, MTF...). Laws are plain numbers, Python functions or SymPy expressions of named
quantities (`bondgraph.laws.Function`), or, where a mechanism gives the positions, a `Modulus` or `Law` of its motion.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from bondgraph.laws import OWN, TIME, Function, GraphError, function, is_symbolic, law_of


class Quantity(NamedTuple):
    """The name of a physical quantity and its SI unit."""

    name: str
    unit: str


class Domain(NamedTuple):
    """An energy domain: effort times flow is power; momentum and displacement are their integrals over time.

    Except in `heat`, whose pseudo bonds carry temperature and heat flow: the power audit leaves them out.

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
heat: temperature [K], heat flow [W], - [-], heat [J]
chemical: chemical potential [J/mol], molar flow [mol/s], - [-], amount of substance [mol]
"""

HEAT = "heat"
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
    it is None if the effort acts everywhere.
    """

    effort: Callable[[Here, Here], Any]
    motion: Motion
    per_unknown: Callable[[Here, Here], Any] | None = None
    moving: bool = False
    sees: tuple[str, ...] = ("speed", "flow", "time")
    acts: Callable[[Here], Any] | None = None


class Field(NamedTuple):
    """What several ports share: a matrix (rows of numbers or expressions), or an energy. `Builder.field` takes it."""

    matrix: Any = None
    energy: Function | None = None


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
    law: float | Function | Law | Modulus | Field | None = None
    domain: str = ""
    part: str = ""

    @property
    def symbol(self) -> str:
        """The kind as it is drawn: MSe, MTF... where the law is no plain number (parameters count as modulation here)."""
        modulated = self.kind in SOURCES | TWO_PORTS and not isinstance(self.law, int | float | None)
        return f"M{self.kind}" if modulated else self.kind


def One(name: str, domain: str = "", when: Any = None) -> Element:
    """A 1-junction: one flow, efforts sum to zero. With `when`, switched: while that does not hold, its flow is 0."""
    return Element("1", name, None if when is None else _margin(f"1:{name}", when), domain)


def Zero(name: str, domain: str = "", when: Any = None) -> Element:
    """A 0-junction: one effort, flows sum to zero. With `when`, switched: while that does not hold, its effort is 0.

    >>> Zero("clutch", when=lambda t, f_motor: (t > 1.0) & (f_motor < 5.0)).law.symbolic()
    Min(5 - f_motor, t - 1)
    """
    return Element("0", name, None if when is None else _margin(f"0:{name}", when), domain)


def _margin(where: str, when: Any) -> Function:
    """A condition as a number that is above 0 if it holds: of a > b, a - b; of several, the least or the greatest."""
    import sympy  # type: ignore[import-untyped]
    from sympy.core.relational import Relational  # type: ignore[import-untyped]

    def number(given: Any) -> Any:
        if isinstance(given, sympy.Or | sympy.And | sympy.Not):
            parts = [number(part) for part in given.args]
            return (
                -parts[0]
                if isinstance(given, sympy.Not)
                else (sympy.Max if isinstance(given, sympy.Or) else sympy.Min)(*parts)
            )
        if isinstance(given, Relational) and given.rel_op in ("<", "<=", ">", ">="):
            return given.gts - given.lts
        if isinstance(given, sympy.Expr) and given.free_symbols:
            return given
        raise GraphError(f"{where}: found when = {given}, expected a condition of named quantities, such as t > 1")

    try:
        law = function(when)
        return function(number(law.symbolic()))
    except GraphError as error:
        why = str(error)
        raise GraphError(why if why.startswith(where) else f"{where}: its condition {why}") from error


def Se(name: str, effort: Any, domain: str = "", part: str = "") -> Element:
    """A source of effort: a number, or a function of displacements, time and signals (MSe)."""
    return Element("Se", name, law_of(effort), domain, part)


def Sf(name: str, flow: Any, domain: str = "", part: str = "") -> Element:
    """A source of flow: a number, or a function of displacements, time and signals (MSf)."""
    return Element("Sf", name, law_of(flow), domain, part)


def I(name: str, inertia: Any = None, domain: str = "", part: str = "", *, energy: Any = None) -> Element:  # noqa: E743
    """An inertia: p = I f, with a number, an expression of parameters, or any f(p) with a function of p.

    A matrix, or an energy of several momenta (and displacements), is a field: `Builder.field`.

    >>> I("coils", [[2.0, 1.0], [1.0, 3.0]]).law.matrix
    [[2.0, 1.0], [1.0, 3.0]]
    """
    return Element("I", name, _shared(f"I:{name}", inertia, energy), domain, part)


def C(name: str, law: Any = None, domain: str = "", part: str = "", *, stiffness: Any = None, energy: Any = None) -> Element:
    """A compliance: e = q/C with `law` = C a number, any e(q) with a function of q, or linear by its stiffness 1/C.

    A matrix, or an energy of several displacements, is a field: `Builder.field`.

    >>> C("spring", 0.125).law == C("spring", stiffness=8.0).law == 0.125
    True
    """
    if stiffness is None:
        return Element("C", name, _shared(f"C:{name}", law, energy), domain, part)
    if law is not None or energy is not None:
        raise GraphError(
            f"C:{name}: found a {'compliance' if energy is None else 'energy'} and a stiffness, expected one of them"
        )
    if not stiffness:
        raise GraphError(f"C:{name}: found stiffness 0, expected a number other than 0; leave a spring of no stiffness out")
    return Element("C", name, law_of(1.0 / stiffness), domain, part)


def R(name: str, law: Any, domain: str = "", part: str = "") -> Element:
    """A resistor: e = R f with a number, any e(f) with a function of its own flow f (and of displacements, time...).

    A matrix is a field: `Builder.field`.
    """
    return Element("R", name, _shared(f"R:{name}", law, None), domain, part)


def RS(name: str, law: Any, domain: str = "", part: str = "") -> Element:
    """A resistor with a thermal port: what it dissipates heats the body that it has its second bond to.

    Hung on a junction as R is, and bonded to the 0-junction of a body: `b.on("shaft", RS("rub", 0.5)).bond("rub", "body")`.
    In the graph it is the resistor, and a source of the entropy flow e f/T, so that its power comes back as heat; in the
    domain `heat` a source of the heat flow e f.
    """
    return Element("RS", name, law_of(law), domain, part)


def TF(name: str, ratio: Any) -> Element:
    """A transformer: f_out = T f_in, e_in = T e_out; with a function or a `Modulus`, a modulated one (MTF)."""
    return Element("TF", name, law_of(ratio))


def GY(name: str, ratio: Any) -> Element:
    """A gyrator: e_out = G f_in, e_in = G f_out; with a function, a modulated one (MGY)."""
    return Element("GY", name, law_of(ratio))


def renamed(element: Element, elements: Mapping[str, str], displacements: Mapping[str, str]) -> Any:
    """Gives an element's law with other names of elements and displacements, old -> new."""
    law = element.law
    if isinstance(law, Function):
        fixed = (TIME, OWN.get(element.kind))
        read = {f"{letter}_{old}": f"{letter}_{new}" for old, new in elements.items() for letter in "fepq"}
        return law.renamed({old: new for old, new in {**read, **displacements}.items() if old not in fixed})
    if isinstance(law, Modulus | Law):
        return law._replace(motion=law.motion._replace(of=elements.get(law.motion.of, law.motion.of)))
    return law


# -- fields: several ports of one energy, or of one matrix ---------------------------------------------------------------

_OF_STATE = re.compile(r"([pqx])(_.*|[0-9]*)")  # an argument that says itself whether it is a momentum or a displacement

_SAME, _SINGULAR = 1e-12, 1e15  # of a matrix's greatest entry: what rounding leaves; its condition


def _shared(where: str, law: Any, energy: Any) -> Any:
    """A law, or the field that a matrix or an energy is."""
    if energy is not None:
        if law is not None:
            raise GraphError(f"{where}: found a law and an energy, expected one of them")
        return Field(energy=function(energy))
    rows = type(law) in (list, tuple) and any(isinstance(row, list | tuple | np.ndarray) for row in law)
    return Field(law) if rows or len(getattr(law, "shape", ())) == 2 else law_of(law)


def ports_of(
    element: Any, junctions: Sequence[str], named: Mapping[str, str], parameters: Iterable[str]
) -> Iterator[tuple[str, Element]]:
    """Yields the one-ports of a field, NAME_PORT each, whose laws read one another's states (of a resistor: flows).

    e = C^-1 q, f = I^-1 p, e = R f with a matrix; with an energy, its derivative by each port's own state.

    Args:
        element: the field.
        junctions: those of its ports in order.
        named: more of them by name; of an energy, by its argument.
        parameters: names that an energy may hold besides.

    Raises:
        GraphError: if the matrix or the energy is none of a field with these ports.

    """
    import sympy

    if not isinstance(element, Element):
        raise GraphError(f"found {element!r}, expected an element, such as I('coils', [[2.0, 1.0], [1.0, 3.0]])")
    where, field = f"{element.kind}:{element.name}", element.law
    if not isinstance(field, Field):
        raise GraphError(f"{where}: found {field!r}, expected a matrix, or energy=...; attach a one-port by on(...)")
    arguments = [n for n in field.energy.of if n not in parameters] if field.energy is not None else []
    known = arguments or list(map(str, range(1, 1 + len(junctions))))
    known += [n for n in named if n not in arguments]
    ports = {**dict(zip(known, junctions, strict=False)), **named}
    if len(junctions) > len(known) or set(known[: len(junctions)]) & set(named):
        raise GraphError(
            f"{where}: found {len(junctions) + len(named)} junctions for {len(known)} ports ({', '.join(known)})"
        )
    kinds = dict.fromkeys(ports, element.kind)
    if field.energy is not None:
        _check_arguments(where, field.energy, list(ports), parameters)
        for port in ports:
            told = _OF_STATE.fullmatch(port)
            kinds[port] = ("I" if told[1] == "p" else "C") if told else element.kind
    own = {port: OWN[kind] for port, kind in kinds.items()}
    names = {port: f"{own[port]}_{element.name}_{port}" for port in ports}
    symbols = {port: sympy.Symbol(name, real=True) for port, name in names.items()}
    if field.energy is not None:
        try:
            energy = field.energy.symbolic(symbols)
        except GraphError as error:
            raise GraphError(f"{where}: its energy {error}") from error
        laws = [energy.diff(symbol) for symbol in symbols.values()]
        for port in (p for p, law in zip(ports, laws, strict=True) if law == 0):
            raise GraphError(f"{where}: its energy is no function of the port {port!r}")
    else:
        laws = [
            sum(k * x for k, x in zip(row, symbols.values(), strict=True))
            for row in _rows(where, element.kind, field.matrix, len(ports))
        ]
    for port, law in zip(ports, laws, strict=True):
        mine = symbols[port]
        read = sorted({s.name for s in law.free_symbols} - {mine.name})
        given = law.xreplace({s: sympy.Symbol(own[port] if s == mine else s.name) for s in law.free_symbols})
        of, name = (own[port], *read), f"{element.name}_{port}"
        alone = field.energy is None and not {*read}.difference(parameters)  # a port that no other acts on is a plain one
        k = list(ports).index(port)
        rule = law_of(np.asarray(field.matrix, dtype=object)[k, k]) if alone else Function(given, of, of)
        yield ports[port], Element(kinds[port], name, rule, element.domain, element.part)


def _check_arguments(where: str, energy: Function, ports: Sequence[str], parameters: Iterable[str]) -> None:
    known = ", ".join(ports) or "none"
    for name in (n for n in energy.of if n not in {*ports, *parameters}):
        raise GraphError(
            f"{where}: its energy depends on {name!r}, which is neither one of its ports ({known}) "
            "nor a parameter declared before"
        )
    for port in (p for p in ports if p not in energy.of):
        raise GraphError(
            f"{where}: its energy is no function of the port {port!r}; it is one of {', '.join(energy.of) or 'nothing'}"
        )


def _rows(where: str, kind: str, given: Any, ports: int) -> list[list[Any]]:
    """The rows by which efforts (of an inertia: flows) follow from the ports' states (of a resistor: flows)."""
    import sympy

    lines = given.tolist() if hasattr(given, "tolist") else list(given)
    rows = [list(row) if isinstance(row, list | tuple | np.ndarray) else [row] for row in lines]
    size = len(rows)
    if any(len(row) != size for row in rows):
        raise GraphError(
            f"{where}: found rows of {', '.join(str(len(row)) for row in rows)} entries, expected a square matrix"
        )
    if size != ports:
        raise GraphError(f"{where}: found {ports} ports for a matrix of {size} rows, expected {size}")
    numbers = not any(is_symbolic(entry) and entry.free_symbols for row in rows for entry in row)
    if numbers:
        try:
            rows = np.array(rows, dtype=float).tolist()
        except (TypeError, ValueError) as error:
            raise GraphError(f"{where}: found a matrix with entries that are no numbers or expressions ({error})") from error
        if not np.all(np.isfinite(rows)):
            raise GraphError(f"{where}: found a matrix with entries that are not finite, expected finite numbers")
    if kind != "R":
        for i in range(size):
            for j in range(i):
                given, other = rows[i][j], rows[j][i]
                if given != other and not (numbers and abs(given - other) <= _SAME * np.abs(rows).max()):
                    raise GraphError(
                        f"{where}: found {given} in row {i + 1}, column {j + 1} of its matrix and {other} in row {j + 1}, "
                        f"column {i + 1}, expected the same: no energy has such a matrix"
                    )
    elif numbers:
        least = float(np.linalg.eigvalsh(np.array(rows) + np.array(rows).T)[0]) / 2.0
        if least < -_SAME * float(np.abs(rows).max()):
            raise GraphError(f"{where}: its matrix has the eigenvalue {least:.6g} in its symmetric part: it generates power")
    if not numbers:
        whole = sympy.Matrix(rows)
        return list((whole if kind == "R" else whole.inv("ADJ").applyfunc(sympy.factor)).tolist())
    if kind != "R":
        if not np.linalg.cond(rows) < _SINGULAR:
            raise GraphError(
                f"{where}: its matrix is singular: one port follows the others; give one port fewer, and a transformer to it"
            )
        inverse = np.linalg.inv(rows)
        rows = (0.5 * (inverse + inverse.T)).tolist()
    return [[sympy.Float(repr(entry), 17) if entry else sympy.S.Zero for entry in row] for row in rows]
