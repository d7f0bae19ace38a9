"""I* body by body and M* load by load: each share as a formula, with its numbers, and its sum over the cycle."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from bondgraph.elements import Here
from bondgraph.numerics import root
from flywheel.components.load_models import model_of
from flywheel.language import message
from flywheel.language import number as localized
from flywheel.language import text as _
from flywheel.machine.loads import LoadLaw, TableCurve
from flywheel.machine.machine import FRICTION, Machine
from flywheel.mechanisms.families import ONE
from flywheel.numerics import cells
from flywheel.numerics.cells import Array
from flywheel.numerics.expressions import Expression
from flywheel.regime import constant_speed
from flywheel.regime.joint_friction import machine_of
from flywheel.regime.state import reduce
from flywheel.report import formulas
from flywheel.report.document import Cell, Figure, Note, Part, Section, Step, Table
from flywheel.report.formulas import Quantity, index
from flywheel.report.positions import Sheet, branch_of, renamed, sheet, unit_text
from flywheel.scene.scene import Mechanism, Scene, Spring
from flywheel.scene.scene import Table as Rows
from flywheel.tables.rows import largest_parts
from flywheel.tables.scene import load_number, part_name

_NO_SHARE = 1e-3  # of the largest: a smaller share is not shown at an angle
_MOST_COLUMNS = 6
_MOST_TERMS = 12
_LONGEST = 160  # characters of an expression that is shown


class OnePort(NamedTuple):
    """A one-port of the machine's graph: its law, its junction, and the part that it belongs to."""

    name: str
    kind: str
    law: Any
    junction: str
    part: str


class StepsAt:
    """A machine at the position of all steps, with the steps of its mechanisms there.

    `phi` is the coordinate of the driver (rad, or m if it slides); `speed` (rad/s) is that at which loads that depend on it
    are taken, None if no load depends on speed; `balance` the value of the scene's unknown.
    """

    def __init__(self, source: Machine | Scene, phi: float | None = None) -> None:
        self.machine = machine_of(source)
        self.scene = scene = self.machine.scene
        self.sliding = scene.reduction_element == "slide"
        stroke = scene.stroke
        self.speed, self.balance = constant_speed.operating_point(self.machine, None if stroke is None else stroke.speed)
        self.phi = self._telling() if phi is None else phi
        self.state = reduce(self.machine, [self.phi], balance=self.balance, speed=self.speed)
        self.symbol = "phi" if not self.sliding else "x"

    @cached_property
    def groups(self) -> list[list[Mechanism]]:
        """Mechanisms that differ only in name, shaft and phase: the first of each group is explained."""
        groups: dict[Any, list[Mechanism]] = {}
        for mechanism in self.scene.mechanisms:
            alike = (mechanism.type, str(mechanism.geometry), mechanism.assembly, str(mechanism.bodies))
            key = alike if mechanism.linkage is None and not mechanism.outputs else mechanism.name
            groups.setdefault(key, []).append(mechanism)
        return list(groups.values())

    @cached_property
    def sheets(self) -> dict[str, Sheet]:
        """The steps of the mechanisms that are explained, by their names."""
        return {group[0].name: sheet(self.machine, group[0], self.phi) for group in self.groups}

    @cached_property
    def elements(self) -> list[OnePort]:
        """Elements that store, drive or resist, from the machine's bond graph."""
        graph, elements = self.machine.graph, []
        for element in graph.elements.values():
            if element.kind in ("I", "Se", "C", "R") and element.law:
                junction = graph.bond_of(element.name).other(element.name)
                elements.append(OnePort(element.name, element.kind, element.law, junction, element.part or element.name))
        return elements

    def explained(self, junction: str) -> bool:
        """Tests whether a junction belongs to a shaft, or to a mechanism that is explained."""
        owner = junction.partition(".")[0]
        return owner in self.sheets or junction in self.scene.shafts or junction == self.scene.reduction_element

    def gain(self, junction: str) -> tuple[str, tuple[Quantity, ...]]:
        """The influence coefficient of a junction as a formula, with the numbers of its symbols."""
        if junction == self.scene.reduction_element:
            return "1", ()
        if junction in self.scene.shafts:
            symbol = f"i_{index(junction)}"
            return symbol, (Quantity(symbol, self.scene.shafts[junction]),)
        owner, _dot, velocity = junction.partition(".")
        made = self.sheets.get(owner)
        if made is not None and velocity in made.gains:
            value = made.values[made.gains[velocity]]
            return (value.symbol, (value,)) if made.rate == 1.0 else (f"i*{value.symbol}", (made.values["i"], value))
        symbol = f"g_{index(junction)}"
        return symbol, (Quantity(symbol, float(self.state.gains[junction][0]), self.unit_of(junction)),)

    def slope(self, junction: str) -> tuple[str, tuple[Quantity, ...]]:
        """The derivative of an influence coefficient, likewise; "0" of a shaft."""
        if junction in self.scene.shafts or junction == self.scene.reduction_element:
            return "0", ()
        owner, _dot, velocity = junction.partition(".")
        made = self.sheets.get(owner)
        if made is not None and velocity in made.gains and not np.any(self.state.gain_slopes[junction]):
            return "0", ()
        if made is not None and velocity in made.slopes:
            value = made.values[made.slopes[velocity]]
            return (value.symbol, (value,)) if made.rate == 1.0 else (f"i**2*{value.symbol}", (made.values["i"], value))
        symbol = f"g_prime_{index(junction)}"
        value = Quantity(symbol, float(self.state.gain_slopes[junction][0]), self.unit_of(junction, 1))
        return symbol, (value,)

    def translates(self, junction: str) -> bool:
        """Tests whether the motion of a junction is along a line."""
        element = self.machine.kinematics.graph.elements.get(junction)
        return element is None or element.domain == "translation"

    def unit_of(self, junction: str, order: int = 0) -> str:
        """The unit of an influence coefficient, or of its derivative."""
        if not self.sliding:
            return "m" if self.translates(junction) else ONE
        return (("", "1/m"), ("1/m", "1/m²"))[order][not self.translates(junction)]

    def tabulated(self, junction: str) -> bool:
        """Tests whether the coefficient of a junction is in the table of coefficients by the graph."""
        return self.gain(junction)[0].startswith("g_")

    def _telling(self) -> float:
        """The position for the steps: where most loads act and most bodies move, at a round number."""
        scene, machine = self.scene, self.machine
        if scene.stroke is not None:
            places = scene.stroke.start + scene.stroke.span * np.arange(1, 20) / 20
        else:
            degrees = np.arange(5.0, np.degrees(scene.cycle), 5.0)
            near = np.abs(np.degrees(machine.breakpoints)[:, None] - degrees).min(axis=0) > 1e-6
            places = np.radians(degrees[near])
            edges = np.degrees(machine.breakpoints)
            narrow = [
                round(float(m), 1) for m, w in zip(0.5 * (edges[1:] + edges[:-1]), np.diff(edges), strict=True) if w > 0.5
            ]
            places = np.unique(np.concatenate((places, np.radians(narrow)))) if narrow else places
        state = reduce(machine, places, balance=self.balance, speed=self.speed)
        score = np.zeros(places.size)
        series = ((state.moment_parts, 1.0), (state.inertia_parts, 1.0), (state.gains, 0.25), (state.gain_slopes, 0.25))
        for parts, weight in series:
            for values in parts.values():
                score += weight * (np.abs(values) > _NO_SHARE * max(float(np.abs(values).max()), 1e-300))
        degrees = np.degrees(places)
        for every, bonus in ((30.0, 0.1), (15.0, 0.1), (5.0, 0.1)):
            score += bonus * (np.abs(degrees / every - np.round(degrees / every)) < 1e-9) if scene.stroke is None else 0.0
        size = np.abs(state.moment - state.moment_parts.get("drive", 0.0))
        return float(places[int(np.argmax(score + 0.05 * size / max(float(size.max()), 1e-300)))])


# -- tables over the cycle -----------------------------------------------------------------------------------------------


def grid(at: StepsAt) -> Array:
    """Positions of the tables: every 30 degrees (more in longer cycles), or tenths of a stroke."""
    if at.scene.stroke is not None:
        return at.scene.stroke.start + at.scene.stroke.span * np.arange(11) / 10
    step = 30.0 if at.scene.cycle < 7.0 else 60.0 if at.scene.cycle < 13.0 else np.degrees(at.scene.cycle) / 12
    return np.radians(np.arange(0.0, np.degrees(at.scene.cycle) - 1e-9, step))


def position_cell(at: StepsAt, phi: float) -> str:
    """A position as the first cell of a row."""
    value = 1000.0 * phi if at.sliding else np.degrees(phi)
    return localized(f"{value:.6g}").replace("-", "−")


def head_of(at: StepsAt) -> str:
    """The head of the first column."""
    return "x, mm" if at.sliding else "φ, °"


def where_text(at: StepsAt, phi: float) -> str:
    """A position of the driver in words."""
    number = localized(f"{phi * 1000 if at.sliding else np.degrees(phi):.6g}").replace("-", "−")
    return f"x = {number} mm" if at.sliding else f"φ = {number}°"


def unit_head(symbol: str, unit: str) -> str:
    """The head of a column, with its unit where it has one."""
    return f"{symbol}, {unit}" if unit else symbol


def cell(column: Array, k: int) -> Quantity:
    """A number of a table; 0 if it is only rounding compared with the others."""
    value, size = float(column[k]), float(np.abs(column).max())
    return Quantity("", 0.0 if abs(value) <= 1e-12 * size else value, digits=5)


def rows_of(at: StepsAt, phi: Array, columns: Sequence[Array]) -> tuple[tuple[Cell, ...], ...]:
    """The rows of a table over the driver's coordinate."""
    return tuple((position_cell(at, float(q)), *(cell(column, k) for column in columns)) for k, q in enumerate(phi))


def split(items: Sequence[Any], most: int) -> Iterator[Sequence[Any]]:
    """Splits items into groups of a size."""
    for k in range(0, len(items), most):
        yield items[k : k + most]


# -- reduced inertia ---------------------------------------------------------------------------------------------------


def inertia(at: StepsAt, extremes: tuple[Part, ...] | None = None) -> Section:
    """I* body by body at one position, its slope, and both over the cycle, with its extremes there."""
    star, what = ("m_star", _("Reduced mass m*")) if at.sliding else ("I_star", _("Reduced inertia I*"))
    unit = "kg" if at.sliding else "kg m²"
    per = "kg/m" if at.sliding else "kg m²"
    law = _("Kinetic energy is the same: ½ I* ω² is the sum of ½ m v² and ½ J ω² of every body, and each velocity is g ω.")
    parts: list[Part] = [Note(law)]
    stores = [element for element in at.elements if element.kind == "I"]
    bodies: dict[str, list[OnePort]] = {}
    for element in stores:
        bodies.setdefault(element.part, []).append(element)
    if not bodies:
        nothing = _("Only the flywheel of this machine has mass or inertia: I* is 0.")
        return Section(what, (Note(nothing), *(extremes or ())))
    if at.scene.inertias:
        masses = tuple((item.on, _added_mass(at, item.on, item.path, item.value)) for item in at.scene.inertias)
        parts.append(Table(_("Masses and inertias fixed to places"), (_("on"), _("value")), masses))
    shares, slopes = [], []
    for part, mine in bodies.items():
        share = Quantity(f"{star}_{_short(at, part)}", float(at.state.inertia_parts[part][0]), unit)
        # contribution of a body to dI*/dphi: 2 sum m g g'
        gains, gain_slopes = at.state.gains, at.state.gain_slopes
        slope = Quantity(
            f"{star}_prime_{_short(at, part)}",
            2.0 * sum(float(e.law) * float(gains[e.junction][0]) * float(gain_slopes[e.junction][0]) for e in mine),
            per,
        )
        shares.append(share)
        slopes.append(slope)
        if all(at.explained(element.junction) for element in mine):
            parts += _body(at, part, mine, share, slope)
    parts += list(_listed(at, star, shares, slopes, bodies))
    total = Quantity(star, float(at.state.inertia[0]), unit)
    parts.append(_sum(_("All bodies together"), total, shares))
    parts.append(_sum(_("Its slope"), Quantity(f"{star}_prime", float(at.state.slope[0]), per), slopes))
    parts += list(_inertia_over_cycle(at, list(bodies), star, unit, per, extremes))
    return Section(what, tuple(parts))


def _added_mass(at: StepsAt, on: str, path: str, value: float) -> Quantity:
    """A mass or inertia that the scene fixes on a place."""
    line = not at.machine.places[on].rotating
    return Quantity(f"{'m' if line else 'J'}_{index(path)}", value, "kg" if line else "kg m²")


def _short(at: StepsAt, part: str) -> str:
    """A part's name as an index: without its mechanism's if there is only one."""
    owner, _dot, body = part.partition(".")
    if part.startswith("inertia on "):
        return index(part_name(at.scene, part))
    only = len(at.scene.mechanisms) == 1 and at.scene.mechanisms[0].name == owner
    return index(body if only and body else part)


def _body(at: StepsAt, part: str, mine: Sequence[OnePort], share: Quantity, slope: Quantity) -> Iterator[Part]:
    """One body: m g_x² + m g_y² + J g_theta², and the slope of that."""
    terms, bent = [], []
    numbers: dict[str, Quantity] = {}
    more: dict[str, Quantity] = {}
    for element in mine:
        line = at.translates(element.junction)
        owner, _dot, body = element.part.partition(".")
        name = index(body) if body and owner in at.sheets else index(element.name)
        mass = Quantity(f"{'m' if line else 'J'}_{name}", float(element.law), "kg" if line else "kg m²")
        gain, of_gain = at.gain(element.junction)
        second, of_slope = at.slope(element.junction)
        numbers |= {mass.symbol: mass} | {n.symbol: n for n in of_gain}
        factor = f"({gain})**2" if "*" in gain else f"{gain}**2"
        terms.append(mass.symbol if gain == "1" else f"{mass.symbol}*{factor}")
        if second != "0" and float(at.state.gain_slopes[element.junction][0]):
            bent.append("*".join(("2", mass.symbol, *(() if gain == "1" else (gain,)), second)))
            more |= {mass.symbol: mass} | {n.symbol: n for n in (*of_gain, *of_slope)}
    text = f"{share.symbol} = {' + '.join(terms)}"
    yield _checked(Step(_("Share of {body}", body=part_name(at.scene, part)), text, tuple(numbers.values()), share))
    if bent and slope.value:
        text = f"{slope.symbol} = {' + '.join(bent)}"
        yield _checked(Step(_("and its slope"), text, tuple(more.values()), slope))


def _checked(step: Step) -> Step:
    """A step; one whose numbers are 0 within rounding has a note in place of its substitution."""
    result = step.result
    size = max((abs(number.value) for number in step.numbers), default=1.0)
    if result is not None and 0.0 < abs(result.value) <= 1e-12 * size:
        note = _("It is 0 within rounding.")
        return Step(step.what, step.formula, (), result._replace(value=0.0), note=note)
    return step


def _sum(what: str, total: Quantity, shares: Sequence[Quantity]) -> Step:
    """A sum of shares, written out if they are few."""
    some = [share for share in shares if share.value]
    if len(some) > _MOST_TERMS or not some:
        return Step(
            what, f"{total.symbol} = total({total.symbol}_k, k)", result=total, how=_("The sum of the table's column.")
        )
    text = f"{total.symbol} = " + " + ".join(share.symbol for share in some)
    size = max(abs(share.value) for share in some)
    if abs(total.value) <= 1e-12 * size:
        return Step(what, text, result=total._replace(value=0.0), note=_("It is 0 within rounding."))
    return Step(what, text, tuple(some), total)


def _listed(
    at: StepsAt, star: str, shares: list[Quantity], slopes: list[Quantity], bodies: Mapping[str, Any]
) -> Iterator[Part]:
    """All bodies in a table, if some are explained by equal ones, or if they are many."""
    if len(at.scene.mechanisms) < 2 and len(shares) <= _MOST_TERMS:
        return
    symbol = "m*" if at.sliding else "I*"
    rows = tuple(
        (part_name(at.scene, name), share, slope) for name, share, slope in zip(bodies, shares, slopes, strict=True)
    )
    head = (_("body"), f"{symbol}, {shares[0].unit}", f"d{symbol}/d{'x' if at.sliding else 'φ'}, {slopes[0].unit}")
    yield Table(_("Every body at {where}", where=where_text(at, at.phi)), head, rows)


def _inertia_over_cycle(
    at: StepsAt, bodies: Sequence[str], star: str, unit: str, per: str, extremes: tuple[Part, ...] | None
) -> Iterator[Part]:
    phi = grid(at)
    state = reduce(at.machine, phi, balance=at.balance, speed=at.speed)
    symbol, by = ("m*", "x") if at.sliding else ("I*", "φ")
    parts = {part_name(at.scene, name): state.inertia_parts[name] for name in bodies}
    columns = largest_parts({name: part for name, part in parts.items() if np.any(part)}, _("others"), _MOST_COLUMNS - 2)
    head = (head_of(at), *columns, f"{symbol}, {unit}", f"d{symbol}/d{by}, {per}")
    values = (*columns.values(), state.inertia, state.slope)
    rows = rows_of(at, phi, list(values))
    title = _("Along the stroke") if at.scene.stroke is not None else _("Over the cycle")
    yield Table(f"{title}: {symbol}, {unit}", head, rows)
    fine = _fine(at)
    every = reduce(at.machine, fine, balance=at.balance, speed=at.speed)
    least, most = float(every.inertia.min()), float(every.inertia.max())
    if at.scene.stroke is None:
        places = [_turning_point(at, fine, int(k)) for k in (every.inertia.argmin(), every.inertia.argmax())]
        least, most = map(float, reduce(at.machine, places, balance=at.balance, speed=at.speed).inertia)
        where = [where_text(at, q) for q in places]
        constant = most - least <= 1e-12 * most
        note = (
            _("I* is the same at every angle.")
            if constant
            else _("Least at {low}, greatest at {high}.", low=where[0], high=where[1])
        )
        if extremes is None:
            mesh = cells.cells(at.machine.mesh)
            along = at.machine.reduce(mesh.phi, mesh.anchor).inertia + 0.0 * mesh.phi
            mean = float(cells.integral(along, mesh.half).sum() / at.scene.cycle)
            rows = (
                (_("least"), Quantity("I_min", least, unit, 5)),
                (_("mean over the angle"), Quantity("I_mean", mean, unit, 5)),
                (_("greatest"), Quantity("I_max", most, unit, 5)),
            )
            yield Table(_("I* over the cycle"), ("", unit_head("I*", unit)), rows)
        yield Note(note)
    if extremes is not None:
        yield from extremes
        return
    from flywheel.pictures import dimensions

    picture = dimensions.shares(
        at.machine,
        fine,
        every.inertia,
        {part_name(at.scene, k): v for k, v in every.inertia_parts.items()},
        f"{symbol}, {unit}",
        at.sliding,
    )
    yield Figure(picture, _("{symbol} by body", symbol=symbol), _("Every body's share, and their sum in black."))


def _turning_point(at: StepsAt, fine: Array, k: int) -> float:
    """Angle at which I* is least or greatest, near one of close positions: the root of its slope, if it is smooth there."""
    low, high = float(fine[max(k - 1, 0)]), float(fine[min(k + 1, fine.size - 1)])

    def slope(q: float) -> float:
        return float(reduce(at.machine, [q], balance=at.balance, speed=at.speed).slope[0])

    smooth = k not in (0, fine.size - 1) and slope(low) * slope(high) < 0.0
    return root(slope, low, high) if smooth else float(fine[k])


def _fine(at: StepsAt) -> Array:
    """Close positions, including those of the machine's breakpoints."""
    marks = at.machine.landmarks
    count = max(1440 // max(len(marks) - 1, 1), 8)
    inner = marks[:-1, None] + np.diff(marks)[:, None] * (np.arange(count) / count)
    grid = np.unique(np.concatenate((inner.ravel(), np.linspace(0.0, at.scene.cycle, 1441)[:-1])))
    return grid + at.scene.origin


# -- reduced moment ----------------------------------------------------------------------------------------------------


def moment(at: StepsAt, drawn: bool = True) -> Section:
    """M* load by load at one position, driving and resisting loads, and both over the cycle, with a picture."""
    star, what = ("F_star", _("Reduced force F*")) if at.sliding else ("M_star", _("Reduced moment M*"))
    unit = "N" if at.sliding else "N m"
    law = _(
        "Power is the same: M* ω is the sum of F v and T ω of every load, and each velocity is g ω: so M* = Σ F g + Σ T g."
    )
    parts: list[Part] = [Note(law), *_conditions(at)]
    sources: dict[str, list[OnePort]] = {}
    for element in at.elements:
        if element.kind != "I":
            sources.setdefault(element.part, []).append(element)
    if not sources:
        return Section(what, (Note(_("No load acts on this machine: M* is 0.")),))
    shares = []
    for part, mine in sources.items():
        n = load_number(at.scene, part)
        value = float(at.state.moment_parts[part][0])
        share = Quantity(f"{star}_{_name_of(at, part, n)}", value, unit)
        shares.append(share)
        if all(at.explained(element.junction) for element in mine):
            parts += list(_load(at, part, mine, share, n))
    if len(at.scene.mechanisms) > 1 or len(shares) > _MOST_TERMS:
        rows = tuple((part_name(at.scene, part), share) for part, share in zip(sources, shares, strict=True))
        parts.append(
            Table(
                _("Every load at {where}", where=where_text(at, at.phi)), (_("load"), unit_head(symbol_of(at), unit)), rows
            )
        )
    parts.append(_sum(_("All together"), Quantity(star, float(at.state.moment[0]), unit), shares))
    parts += list(_moment_over_cycle(at, list(sources), unit, drawn))
    return Section(what, tuple(parts))


def symbol_of(at: StepsAt) -> str:
    """The reduced moment's or force's symbol."""
    return "F*" if at.sliding else "M*"


def _conditions(at: StepsAt) -> Iterator[Part]:
    """Notes on the speed and time at which loads are taken, and on omissions."""
    if at.machine.depends_on_speed and at.speed is not None:
        unit = "m/s" if at.sliding else "rad/s"
        what = _(
            "Torques that depend on speed are those at a constant speed here; the exact figures follow the motion itself"
        )
        yield Step(what, result=Quantity("v" if at.sliding else "omega", at.speed, unit))
    if at.machine.depends_on_time:
        yield Note(_("Loads that depend on time are those at t = 0."), "remark")
    lossy = ", ".join(name for name, efficiency in at.scene.efficiencies.items() if efficiency < 1.0)
    if lossy:
        title = _(
            "The losses in the meshes of {shafts} depend on accelerations. M* here excludes them; crossings, areas "
            "and exact figures include them.",
            shafts=lossy,
        )
        yield Note(title, "remark")


def _name_of(at: StepsAt, part: str, n: int) -> str:
    """The index of a source: G and the body of a weight, d of the drive, its number of another one."""
    if part == "drive":
        return "d"
    if (drag := next((load.on for load in at.scene.loads if load.drag and load.path == part), None)) is not None:
        return f"f_{index(drag)}"
    if part.startswith("weight of "):
        return f"G_{_short(at, part.removeprefix('weight of '))}"
    return "f" if part == FRICTION else str(n)


def _load(at: StepsAt, part: str, mine: Sequence[OnePort], share: Quantity, n: int) -> Iterator[Part]:
    """One source, by its kind."""
    if part.startswith("weight of "):
        yield _weight(at, part, mine, share)
        return
    if part == FRICTION:
        how = _(
            "Friction in joints follows from the joint forces at this position by kinetostatics: μ times the normal force, "
            "against the motion of each joint, by virtual power."
        )
        yield Step(_("Friction in the joints"), result=share, how=how)
        return
    spring = next((s for s in at.scene.springs if part == f"{s.path} on {s.on}"), None)
    damper = next((d for d in at.scene.dampers if part == f"{d.path} on {d.on}"), None)
    if spring is not None:
        yield from _spring(at, spring, mine[0], share, n)
    elif damper is not None:
        yield from _damper(at, damper.coefficient, part, mine[0], share, n)
    else:
        effort = next(
            e
            for e in at.machine.efforts
            if e.path in (mine[0].name, f"{part}.torque", f"{part}.motor") or e.path == mine[0].name
        )
        yield from _effort(at, effort, part, mine[0], share, n)


def _weight(at: StepsAt, part: str, mine: Sequence[OnePort], share: Quantity) -> Step:
    """A weight: the mass times gravity along each velocity of its centre of mass."""
    body = part.removeprefix("weight of ")
    owner, _dot, name = body.partition(".")
    weights = at.machine.family(next(m for m in at.scene.mechanisms if m.name == owner)).weights
    symbol = Quantity(f"m_{index(name)}", next(w.mass for w in weights if w.body == name), "kg")
    gx, gy = at.scene.gravity or (0.0, 0.0)
    terms, numbers = [], {symbol.symbol: symbol}
    for element in mine:
        gain, of_gain = at.gain(element.junction)
        velocity = element.junction.partition(".")[2]  # that the weight pulls along
        direction = next(w.direction for w in weights if w.velocity == velocity)
        cosines = (float(np.cos(direction)), "g_x", gx), (float(np.sin(direction)), "g_y", gy)
        pulls = []
        numbers |= {n.symbol: n for n in of_gain}
        for cosine, g, value in cosines:
            if abs(cosine) > 1e-12 and value:
                plain = "(-1)*" if abs(cosine + 1.0) < 1e-12 else f"({cosine:.12g})*"
                pulls.append(g if abs(cosine - 1.0) < 1e-12 else plain + g)
                numbers[g] = Quantity(g, value, "m/s²")
        pull = pulls[0] if len(pulls) == 1 else f"({' + '.join(pulls)})"
        terms.append(f"{symbol.symbol}*{pull}" + ("" if gain == "1" else f"*{gain}"))
    what = _("Weight of {body}: it does work where its centre of mass rises or falls", body=body)
    return _checked(Step(what, f"{share.symbol} = {' + '.join(terms)}", tuple(numbers.values()), share))


def _work_step(at: StepsAt, effort: Quantity, junction: str, share: Quantity) -> Step:
    """A force or torque times the influence coefficient of its place."""
    gain, numbers = at.gain(junction)
    text = f"{share.symbol} = {effort.symbol}" + ("" if gain == "1" else f"*{gain}")
    what = (
        _("Reduced: times the influence coefficient of {place}", place=junction)
        if gain != "1"
        else _("It acts on the driver itself")
    )
    return _checked(Step(what, text, (effort, *numbers), share))


def _letter(at: StepsAt, junction: str, n: int | str) -> Quantity:
    line = at.translates(junction)
    return Quantity(f"{'F' if line else 'T'}_{n}", 0.0, "N" if line else "N m")


def _displacement(at: StepsAt, on: str) -> Quantity:
    """Displacement of a place: the coordinate of its sheet, or the library's own number."""
    owner, _dot, port = on.partition(".")
    made = at.sheets.get(owner)
    line = not at.machine.places[on].rotating
    if made is not None and port in made.coordinates:
        value = made.values[made.coordinates[port]]
        return value if line else value._replace(unit="rad")
    here, _anchor = _here(at, on)
    return Quantity(
        f"x_{index(on)}" if line else f"theta_{index(on)}",
        float(at.machine.places[on].displacement(here)),
        "m" if line else "rad",
    )


def _here(at: StepsAt, on: str) -> tuple[Here, Here]:
    """Arguments of a load's law at the position, and in the middle of its smooth piece."""
    machine, own = at.machine, np.float64(at.phi - at.scene.origin)
    anchor = np.float64(np.ravel(machine.anchors(np.array([float(own)])))[0])
    place, motion = machine.places[on], machine.motion_of(on)
    speed = 0.0 if at.speed is None else at.speed
    gain = float(at.state.gains[place.junction][0]) if place.junction in at.state.gains else 1.0
    terms = []
    for q in (own, anchor):
        turned = place.rate * q
        rate = place.rate if "." in on else 1.0
        terms.append(Here(turned, motion.position(turned, np, place.rate * anchor), np, rate * speed, gain * speed, 0.0))
    return terms[0], terms[1]


def _spring(at: StepsAt, spring: Spring, element: OnePort, share: Quantity, n: int) -> Iterator[Part]:
    """F = -k (x - x0)."""
    where, line = _displacement(at, spring.on), at.translates(element.junction)
    k = Quantity(f"k_{n}", spring.stiffness, "N/m" if line else "N m/rad")
    rest = Quantity(f"x_0_{n}" if line else f"theta_0_{n}", spring.rest, "m" if line else "rad")
    force = _letter(at, element.junction, n)._replace(value=-spring.stiffness * (where.value - spring.rest))
    rows = ((_("stiffness"), k), (_("place at rest"), rest), (_("place"), where))
    yield Table(_("Spring {n} on {place}", n=n, place=spring.on), (_("quantity"), _("value")), rows)
    text = f"{force.symbol} = -({k.symbol}*({where.symbol} - {rest.symbol}))"
    yield _checked(Step(_("Force of the spring, against its stretch"), text, (k, where, rest), force))
    yield _work_step(at, force, element.junction, share)


def _damper(at: StepsAt, coefficient: float, part: str, element: OnePort, share: Quantity, n: int) -> Iterator[Part]:
    """M* = -c g² omega."""
    gain, numbers = at.gain(element.junction)
    line = at.translates(element.junction)
    c = Quantity(f"c_{n}", coefficient, "N s/m" if line else "N m s")
    omega = Quantity("v" if at.sliding else "omega", at.speed or 0.0, "m/s" if at.sliding else "rad/s")
    yield Step(_("Coefficient of {part}", part=part_name(at.scene, part)), result=c)
    text = f"{share.symbol} = -({c.symbol}*({gain})**2*{omega.symbol})"
    yield _checked(Step(_("Its force is −c v, and v = g ω"), text, (c, *numbers, omega), share))


# -- loads and the drive -----------------------------------------------------------------------------------------------


def _effort(at: StepsAt, effort: LoadLaw, part: str, element: OnePort, share: Quantity, n: int) -> Iterator[Part]:
    """A load or the drive: its window, its law with the numbers, and its share of M*."""
    here, anchor = _here(at, effort.load.on)
    with np.errstate(all="ignore"):
        value = float(effort(here, anchor)) + (
            at.balance * float(effort.per_unknown(here, anchor)) if effort.depends_on_unknown else 0.0
        )
    drive = effort.load.path == "drive"
    title = _("Drive on {place}") if drive else _("Drag on {place}") if effort.load.drag else _("Load {n}, on {place}")
    name = title.format(n=n, place=effort.load.on)
    force = _letter(at, element.junction, "d" if drive else n)._replace(value=value)
    # window of a load, and its sense, in words
    load, rows = effort.load, []
    if load.start is not None and load.end is not None:
        low, high = (position_cell(at, q) for q in (load.start, load.end))
        unit = " mm" if at.sliding else "°"
        made = at.sheets.get(load.on.partition(".")[0])
        own = load.on in at.scene.shafts or (made is not None and made.driver == "phi")
        symbol = "x" if at.sliding else "φ" if own else _("the angle of its mechanism")
        rows.append(_("It acts from {low} to {high} of {symbol}.", low=low + unit, high=high + unit, symbol=symbol))
    if load.sense:
        rows.append(_("It acts while v > 0.") if load.sense > 0 else _("It acts while v < 0."))
    acts = " ".join(filter(None, (_model(at, effort), " ".join(rows))))
    if not bool(np.all(effort.active(anchor))):
        yield Step(name, result=force._replace(value=0.0), note=f"{acts} {_('Here it does not act.')}")
    else:
        yield from _law(at, effort, name, force, acts)
    yield _work_step(at, force, element.junction, share)


def _model(at: StepsAt, effort: LoadLaw) -> str:
    """Description of a load of a known kind, or a motor, and the formula for its numbers from the scene."""
    load = effort.load
    if not load.model:
        return ""
    model = message(load.model)
    words = _("Motor: {model}.", model=model) if load.path == "drive" else _("Load model {model}.", model=model)
    kind = at.scene.motor if load.path == "drive" else model_of(load.model)
    return " ".join(filter(None, (words, "" if kind is None else message(kind.formula))))


def _law(at: StepsAt, effort: LoadLaw, name: str, force: Quantity, acts: str) -> Iterator[Part]:
    """The law of a load that acts, evaluated at the position."""
    law = effort.load.law
    if law is None:
        how = _("The balance, for which the net work of the cycle is 0; see the balance of the cycle.")
        yield Step(name, result=force, how=how, note=acts)
    elif isinstance(law, float | int):
        sense = _("It acts against the positive sense of its place.") if force.value < 0 else ""
        yield Step(f"{name}, {_('as given')}", result=force, note=f"{acts} {sense}".strip())
    elif isinstance(law, Rows):
        yield from _table(at, effort, law, name, force, acts)
    else:
        yield from _expression(at, effort, law, name, force, acts)


def _table(at: StepsAt, effort: LoadLaw, law: Rows, name: str, force: Quantity, acts: str) -> Iterator[Part]:
    """Interpolation between two rows of a table, linear if the table is."""
    here, anchor = _here(at, effort.load.on)
    pieces = TableCurve(law)
    middle = float(anchor.q) + effort.place.phase
    angle = float(here.q) + effort.place.phase - float(effort.turns(middle, pieces.first))
    k = int(np.clip(np.searchsorted(law.angle, angle, side="right") - 1, 0, law.angle.size - 2))
    if law.interpolation != "linear" or law.angle[k + 1] == law.angle[k]:
        how = _("From its table of {n} rows, by {how}.", n=law.angle.size, how=law.interpolation)
        yield Step(name, result=force, how=how, note=acts)
        return
    n = force.symbol.partition("_")[2]
    unit = "m" if at.sliding else "°"
    psi = Quantity(f"psi_{n}", angle, unit)
    (a, fa), (b, fb) = (
        (
            Quantity(f"psi_{mark}_{n}", float(law.angle[j]), unit, 8),
            Quantity(f"{force.symbol}_{mark}", float(law.value[j]), force.unit, 8),
        )
        for mark, j in (("a", k), ("b", k + 1))
    )
    rows = ((_("row before"), a, fa), (_("row after"), b, fb), (_("here"), psi, ""))
    head = (_("row"), _("angle in the table"), _("value"))
    yield Table(_("{name}: its table has {n} rows, straight between them", name=name, n=law.angle.size), head, rows)
    text = (
        f"{force.symbol} = {fa.symbol} + ({fb.symbol} - {fa.symbol})*({psi.symbol} - {a.symbol})/({b.symbol} - {a.symbol})"
    )
    yield _checked(Step(name, text, (fa, fb, psi, a, b), force, note=acts))


def _expression(at: StepsAt, effort: LoadLaw, law: Expression, name: str, force: Quantity, acts: str) -> Iterator[Part]:
    """The expression of a load: as written, then the branch that applies here, with its numbers."""
    names, preparation = _names(at, effort, law)
    text, values = law.text.replace("\\\n", " ").strip(), {symbol: value.value for symbol, value in names.items()}
    try:
        tree = ast.parse(text, mode="eval").body
        branch = ast.unparse(renamed(branch_of(tree, values), names))
        whole = ast.unparse(renamed(ast.parse(text, mode="eval").body, names))
        value = formulas.value(f"{force.symbol} = {branch}", {value.symbol: value.value for value in names.values()})
    except (SyntaxError, ValueError, ArithmeticError, KeyError):
        branch = ""
    if not branch or abs(value - force.value) > 1e-9 * max(abs(value), abs(force.value)):
        shortened = text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"
        yield Step(name, result=force, how=_("By its expression: {text}", text=message(shortened)), note=acts)
        return
    yield from preparation
    used = formulas.symbols(f"{force.symbol} = {branch}")
    numbers = tuple(value for value in names.values() if value.symbol in used)
    if whole != branch and len(whole) <= _LONGEST:
        yield Step(_("{name}, as written", name=name), f"{force.symbol} = {whole}")
    note = " ".join(filter(None, (acts, _("The formula shows the branch that applies here.") if whole != branch else "")))
    yield _checked(Step(name, f"{force.symbol} = {branch}", numbers, force, note=note))


def _names(at: StepsAt, effort: LoadLaw, law: Expression) -> tuple[dict[str, Quantity], list[Part]]:
    """Values of the names of an expression here, and the steps for those not yet known."""
    here, anchor = _here(at, effort.load.on)
    place_of = effort.place
    steps: list[Part] = []
    quantities: dict[str, Quantity] = {}
    for name, value in at.scene.parameters.items():
        quantities[name] = Quantity(name, value, unit_text(at.scene.units.get(name)))
    if at.scene.unknown not in (None, "drive"):
        quantities[str(at.scene.unknown)] = Quantity(str(at.scene.unknown), at.balance)
    n = "d" if effort.load.path == "drive" else effort.load.path.strip("load[]")
    if "phi" in law.names:
        middle = float(anchor.q) + place_of.phase
        angle = float(here.q) + place_of.phase - float(effort.turns(middle))
        same = abs(angle - at.phi) < 1e-12 and not at.sliding
        quantities["phi"] = Quantity("phi" if same else f"phi_{n}", angle, "rad" if not same else "°")
        if not same:
            steps.append(Step(_("Its angle"), result=quantities["phi"]))
    if "omega" in law.names:
        ratio = place_of.rate if not place_of.shaft else at.scene.shafts.get(effort.load.on, 1.0)
        speed = (at.speed or 0.0) * ratio
        quantities["omega"] = Quantity(f"omega_{n}", speed, "rad/s")
        steps.append(Step(_("The speed of its shaft"), result=quantities["omega"]))
    if "t" in law.names:
        quantities["t"] = Quantity("t", 0.0, "s")
        steps.append(Step(_("Time"), result=quantities["t"]))
    if "x" in law.names:
        quantities["x"] = _displacement(at, effort.load.on)
    if "v" in law.names:
        _gain, numbers = at.gain(place_of.junction)
        gain = float(at.state.gains[place_of.junction][0]) if place_of.junction in at.state.gains else 1.0
        unit = "m/s" if not place_of.rotating else "rad/s"
        if effort.uses_speed:
            quantities["v"] = Quantity(f"v_{n}", gain * (at.speed or 0.0), unit)
            steps.append(Step(_("The velocity of its place, g times the speed of the driver"), result=quantities["v"]))
        else:  # its sign alone matters, and the driver moves forwards
            quantities["v"] = numbers[-1] if numbers else Quantity("v", gain, unit)
            if not numbers:
                steps.append(
                    Step(_("The driver moves forwards; only the sign of its velocity matters"), result=quantities["v"])
                )
    return quantities, steps


def driving(at: StepsAt) -> list[str]:
    """The loads with positive work in a cycle (or along a stroke): their sum is M_m*, that of the others M_r*."""
    mesh = cells.cells(at.machine.mesh)
    moving = at.speed if at.machine.depends_on_speed or at.machine.depends_on_time else None
    terms = []
    for part, values in at.machine.reduction.moments(mesh.phi, mesh.anchor, at.balance, speed=moving).items():
        there = values + 0.0 * mesh.phi
        net, size = (float(cells.integral(some, mesh.half).sum()) for some in (there, np.abs(there)))
        if net > _NO_SHARE * size:
            terms.append(part)
    return terms


def _sides(at: StepsAt, phi: Array) -> tuple[Array, Array, dict[str, Array]]:
    """Positions, those of switches twice, once for each side; the middles of their pieces; M* by part."""
    own = phi - at.scene.origin
    edges = at.machine.breakpoints
    inner = edges[1:-1]
    middles = 0.5 * (edges[1:] + edges[:-1])
    q, anchors = [], []
    near = 1e-9 * at.scene.cycle
    for value in np.unique(np.concatenate((own, inner))):
        at_edge = np.flatnonzero(np.abs(edges - value) <= near)
        piece = int(np.clip(np.searchsorted(edges, value, side="right") - 1, 0, middles.size - 1))
        if at_edge.size and 0 < at_edge[0] < edges.size - 1:
            q += [float(edges[at_edge[0]])] * 2
            anchors += [float(middles[at_edge[0] - 1]), float(middles[at_edge[0]])]
        else:
            q.append(float(value))
            anchors.append(float(middles[piece]))
    moving = at.speed if at.machine.depends_on_speed or at.machine.depends_on_time else None
    angles, middle = np.array(q), np.array(anchors)
    parts = at.machine.reduction.moments(angles, middle, at.balance, speed=moving)
    return angles + at.scene.origin, middle, {name: part + 0.0 * angles for name, part in parts.items()}


def _moment_over_cycle(at: StepsAt, sources: Sequence[str], unit: str, drawn: bool) -> Iterator[Part]:
    symbol = symbol_of(at)
    letter = symbol[0]
    drives = driving(at)
    end = [] if at.scene.stroke is not None else [at.scene.cycle]
    phi, _middle, parts = _sides(at, np.concatenate((grid(at), end)))
    nothing = np.zeros(phi.size)
    drive = sum((parts[name] for name in drives), nothing)
    resists = sum((part for name, part in parts.items() if name not in drives), nothing)
    keep = _changes(phi, [*parts.values()], np.append(grid(at), at.scene.cycle if at.scene.stroke is None else np.nan))
    columns = {f"{letter}ₘ*, {unit}": drive, f"{letter}ᵣ*, {unit}": resists, f"{symbol}, {unit}": drive + resists}
    rows: list[tuple[Cell, ...]] = []
    for k in np.flatnonzero(keep):
        before, behind = k and keep[k - 1] and phi[k - 1] == phi[k], k + 1 < phi.size and phi[k + 1] == phi[k]
        mark = " −" if behind else " +" if before else ""
        rows.append((position_cell(at, float(phi[k])) + mark, *(cell(column, int(k)) for column in columns.values())))
    listed = ", ".join(part_name(at.scene, part) for part in drives) or _("nothing")
    title = _(
        "Loads with positive work per cycle count as driving, {letter}ₘ*: {drives}. All others are {letter}ᵣ*, including "
        "weights and springs.",
        letter=letter,
        drives=listed,
    )
    yield Note(title)
    caption = _("{symbol} over the cycle; where it jumps both sides: − before, + behind", symbol=symbol)
    yield Table(caption, (head_of(at), *columns), tuple(rows))
    if not drawn:
        return
    fine = _fine(at)
    every, _anchors, by_part = _sides(at, fine)
    from flywheel.pictures import dimensions

    total = sum(by_part.values(), np.zeros(every.size))
    picture = dimensions.shares(
        at.machine,
        every,
        total,
        {part_name(at.scene, name): by_part[name] for name in sources if name in by_part},
        f"{symbol}, {unit}",
        at.sliding,
    )
    yield Figure(
        picture, _("{symbol} by load", symbol=symbol), _("Every load's share, and their sum in black; jumps are jumps.")
    )


def _changes(phi: Array, parts: Sequence[Array], angles: Array) -> Array:
    """Mask of the rows to show: the requested ones, and both sides of every jump."""
    sizes = [float(np.abs(part).max()) for part in parts]

    def jumps(k: int) -> bool:
        return bool(phi[k] == phi[k + 1]) and any(abs(p[k + 1] - p[k]) > 1e-9 * s for p, s in zip(parts, sizes, strict=True))

    jump = [jumps(k) for k in range(phi.size - 1)]
    keep = np.zeros(phi.size, dtype=bool)
    for k in range(phi.size):
        before, behind = k > 0 and jump[k - 1], k < phi.size - 1 and jump[k]
        last = k == phi.size - 1 or phi[k + 1] != phi[k]
        near = bool((np.abs(angles - phi[k]) <= 1e-9 * max(abs(float(phi[k])), 1.0)).any())
        keep[k] = before or behind or (near and last)
    return keep
