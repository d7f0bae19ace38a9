"""Loads, springs, tables and friction in joints as laws of position, speed and time."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from copy import copy
from functools import cache, cached_property, reduce
from numbers import Real
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.elements import Here
from bondgraph.recording import Recorded
from flywheel.numerics import cells
from flywheel.numerics.cells import Cells, table_pieces
from flywheel.numerics.expressions import ONE, Expression, Node, numeral, unit_text, units_of_name, walk
from flywheel.numerics.faults import Fault, SceneError
from flywheel.numerics.jets import Jet, is_recorded, jet_namespace
from flywheel.numerics.units import DIMENSIONS, Unit, parse_unit
from flywheel.scene.scene import Load, Scene, Spring, Table

Array = NDArray[np.float64]


POSITION = frozenset({"phi", "x", "v"})
"""Names by which a law reads where its place is, or which way it goes."""


class EffortPlace(NamedTuple):
    """Place at which an effort acts: its 1-junction, its displacement, and the angle for its windows and `phi`.

    angle = rate * phi + phase, phi being the crank's. `shaft`: it is a shaft, whose own speed loads on it see.
    """

    junction: str
    displacement: Callable[[Here], Any]
    rate: float = 1.0
    phase: float = 0.0
    rotating: bool = True
    shaft: bool = False


class Senses(NamedTuple):
    """The sign of a place's velocity at positive crank speed, constant between its dead centres (crank angles)."""

    dead_centres: Array
    signs: Array

    def at(self, phi: Any) -> Any:
        """The sign at crank angles phi."""
        if isinstance(phi, Recorded) and phi.value is None and self.dead_centres.dtype != object:  # of any piece
            return phi.recorder.tabulated(phi, self.dead_centres.tolist(), [self.signs.tolist()])[0]
        return self.signs[np.searchsorted(self.dead_centres, phi)]


class TableCurve:
    """A table as polynomials between its knots: a value is that of the piece of its anchor."""

    def __init__(self, table: Table) -> None:
        self.first = float(table.angle[0])
        self.knots = table.angle[np.diff(table.angle, prepend=-np.inf) > 0.0]
        self._start, self._series = table_pieces(table.angle, table.value, table.interpolation)

    def __call__(self, angle: Any, anchor: Any) -> Any:
        """Value at angles, each in the piece of its anchor."""
        if isinstance(anchor, Recorded) and anchor.value is None:  # of any piece
            start, *rows = anchor.recorder.tabulated(
                anchor, self._start[1:].tolist(), [column.tolist() for column in (self._start, *self._series)]
            )
            return reduce(lambda total, row: total * (angle - start) + row, rows, 0.0)
        piece = np.maximum(np.searchsorted(self._start, anchor, side="right") - 1, 0)
        step = angle - self._start[piece]
        total: Any = 0.0
        for series in self._series:
            total = total * step + series[piece]
        return total


class LoadLaw:
    """The law of one load: its value where it is active, 0 elsewhere; `unknown` names the scene's balance, if any.

    `direction` is the crank's: with -1 `while` and drag reverse, and so does v if a law reads its sign alone.
    """

    direction = 1.0

    def __init__(
        self,
        load: Load,
        place: EffortPlace,
        parameters: Mapping[str, float],
        unknown: str | None = None,
        senses: Senses | Callable[[], Senses] | None = None,
    ) -> None:
        self.load, self.place, self._senses = load, place, senses
        key = "table" if isinstance(load.law, Table) else "torque" if place.rotating else "force"
        if load.model:
            key = "motor" if load.path == "drive" else "model"
        self.path = load.path if load.drag else f"{load.path}.{key}"
        self._parameters = parameters
        self._law = TableCurve(load.law) if isinstance(load.law, Table) else load.law
        self.always = load.start is None and load.sense == 0
        self._unknown: str | None = None
        if isinstance(load.law, Expression) and unknown is not None and unknown in load.law.names:
            if load.law.degree(unknown) is None:
                defect = f'"{load.law.excerpt}", which is not linear in the balance {unknown}'
                advice = "give it a value, and balance another quantity"
                raise SceneError([Fault(self.path, defect, f"{unknown} as a factor or a term", advice)])
            self._unknown = unknown
        self.depends_on_unknown = load.law is None or self._unknown is not None
        self.uses_speed = isinstance(load.law, Expression) and load.law.uses_speed
        self.uses_time = isinstance(load.law, Expression) and load.law.uses_time

    @property
    def reads_position(self) -> bool:
        """Tests whether its expression reads where its place is, or which way it goes: v of a shaft is its speed alone."""
        names: frozenset[str] = getattr(self._law, "names", frozenset())
        return bool(POSITION & (names - {"v"} if self.place.shaft and self.uses_speed else names))

    @cached_property
    def senses(self) -> Senses | None:
        """Ranges in which its place moves forwards and backwards; None if the load does not depend on that."""
        if not self.load.sense and "v" not in getattr(self._law, "names", ()):
            return None
        return self._senses() if callable(self._senses) else self._senses

    @cached_property
    def reverses(self) -> bool:
        """Tests whether position and the crank's direction alone decide a branch of it: `while`, sign(v), drag."""
        law = self.load.law
        return self.load.drag or bool(self.load.sense) or (isinstance(law, Expression) and law.switches_on_velocity)

    @cached_property
    def is_dry(self) -> bool:
        """Tests whether it may jump where the machine comes to rest, as dry friction does: a branch changes at speed 0."""
        law = self.load.law
        if self.reverses or not isinstance(law, Expression):
            return self.reverses
        still = {**self.constants, "v": 0.0, "omega": 0.0}
        return any(
            part.uses_speed and (not part.names <= still.keys() or part.evaluate(still, np) == 0.0)
            for part in moving_switches(law)
        )

    def backwards(self) -> LoadLaw:
        """The law for a crank that turns backwards."""
        effort = copy(self)
        effort.direction = -1.0
        return effort

    @property
    def dependencies(self) -> tuple[str, ...]:
        """The variables of `Here` beside position in the law: speed (of the driving shaft), flow (its own), time."""
        names = self._law.names if isinstance(self._law, Expression) else frozenset[str]()
        own = ("v" in names and self.uses_speed) or ("omega" in names and self.place.shaft)
        dependencies = {"speed": "omega" in names and not self.place.shaft, "flow": own, "time": "t" in names}
        return tuple(name for name, seen in dependencies.items() if seen)

    @property
    def constants(self) -> Mapping[str, float]:
        """The parameters, with 1 for the unknown."""
        return {**self._parameters, self._unknown: 1.0} if self._unknown else self._parameters

    def __call__(self, here: Here, anchor: Here) -> Any:
        """Effort without the unknown's share."""
        return self._acting(here, anchor, 0)

    def per_unknown(self, here: Here, anchor: Here) -> Any:
        """Effort per unit of the unknown."""
        return self._acting(here, anchor, 1)

    def _acting(self, here: Here, anchor: Here, part: int) -> Any:
        """Effort without the unknown's share (part 0), or per unit of it (1), where the load acts; 0 elsewhere."""
        law = self._law
        if law is None:
            effort: Any = float(part)
        elif isinstance(law, (float, Real)):
            effort = 0.0 if part else self.direction * law if self.load.drag else law
        elif isinstance(law, TableCurve):
            effort = 0.0 if part else law(*self._angles(here, anchor, law.first))
        elif part and self._unknown is None:
            effort = 0.0
        else:
            angle, middle = self._angles(here, anchor) if "phi" in law.names else (0.0, 0.0)
            values, there = self._values(law, here, angle, anchor), self._values(law, anchor, middle, anchor)
            ns = _jets() if isinstance(here.speed, Jet) else here.ns  # where slopes by speed are wanted
            if self._unknown is None:
                effort = law.evaluate(values, ns, there)
            else:
                effort = law.coefficients(values, self._unknown, ns, there)[part]
        if self.always:
            return effort
        active = self.active(anchor)
        if isinstance(active, bool):  # one piece alone
            return effort if active else 0.0
        return (_jets() if isinstance(effort, Jet) else np).where(active, effort, 0.0)

    def _values(self, law: Expression, here: Here, angle: Any, anchor: Here) -> dict[str, Any]:
        values: dict[str, Any] = dict(self._parameters)
        values["phi"] = angle
        values["omega"], values["t"] = here.flow if self.place.shaft else here.speed, here.time
        if "x" in law.names:
            values["x"] = self.place.displacement(here)
        if self.uses_speed:
            values["v"] = here.flow
        elif "v" in law.names and self.senses is not None:
            values["v"] = self.direction * self.senses.at(anchor.q / self.place.rate)
        return values

    def speed_switches(self, here: Here, anchor: Here) -> list[Any]:
        """Values whose signs decide the branches of the law, as far as they depend on speed or time; `here` is moving.

        Sign changes of v or omega alone are known beforehand, except for a machine that comes to rest, which is
        watched separately; switches by time alone are known beforehand too: stepping restarts there.
        """
        law = self._law
        if not isinstance(law, Expression):
            return []
        angle, middle = self._angles(here, anchor)
        values, there = self._values(law, here, angle, anchor), self._values(law, anchor, middle, anchor)
        switches = []
        for part in moving_switches(law):
            alone = len(part.names) == 1 and part.names <= {"v", "omega"} and part.tree.op in ("name", "neg")
            if not alone and not self.is_timed(part):
                switches.append(part.evaluate(values, np, there))
        return switches

    def is_timed(self, part: Expression) -> bool:
        """Tests whether a part of the law depends on time and on nothing else."""
        return "t" in part.names and part.names <= {"t", *self.constants}

    def _angles(self, here: Here, anchor: Here, first: float = 0.0) -> tuple[Any, Any]:
        """The load's angle, reduced to [first, first + every) by the turn that the anchor is in, here and at it."""
        middle = anchor.q + self.place.phase
        turns = self.turns(middle, first)
        return here.q + self.place.phase - turns, middle - turns

    def turns(self, angle: Any, first: float = 0.0) -> Any:
        """A function that reduces an angle to [first, first + every), or changes nothing on a stroke."""
        return 0.0 if self.load.once else self.load.every * np.floor((angle - first) / self.load.every)

    def active(self, anchor: Here) -> Any:
        """Tests whether the load acts in the pieces of these anchors."""
        load, active = self.load, True
        if load.start is not None and load.end is not None:
            middle = self._angles(anchor, anchor)[1]
            after, before = middle >= load.start, middle < load.end
            # a window that ends before it begins wraps around the cycle's end
            active = after & before if load.start < load.end else after | before
        if load.sense and self.senses is not None:
            along = self.direction * self.senses.at(anchor.q / self.place.rate) == load.sense
            active = along if active is True else active & along
        return active

    def crank_breakpoints(self, cycle: float, *, switching: bool = False) -> Iterator[float]:
        """Crank angles (rad) where the load is not smooth: ends of period and window, knots of its table, dead centres.

        switching: without ends of a period at which the law does not restart.
        """
        anew = isinstance(self._law, TableCurve) or "phi" in getattr(self._law, "names", ())
        repeats = anew if switching else isinstance(self._law, TableCurve | Expression)
        angles = [0.0] if repeats and not self.load.once else []
        if self.load.start is not None and self.load.end is not None:
            angles += [self.load.start, self.load.end]
        local = np.concatenate((angles, self._law.knots if isinstance(self._law, TableCurve) else ()))
        yield from local - self.place.phase if self.load.once else crank_angles(local, self.load.every, self.place, cycle)
        if self.senses is not None:
            yield from self.senses.dead_centres


@cache
def _jets() -> Any:
    return jet_namespace(np)


def balance_unit(efforts: Iterable[LoadLaw], scene: Scene) -> str | None:
    """The unit of the scene's unknown; None without one, or where the expressions that hold it leave it open."""
    name = scene.unknown
    if name is None or name == "drive":
        return name and DIMENSIONS["force" if scene.reduction_element == "slide" else "torque"].si
    units: set[Unit | None] = set()
    for effort in efforts:
        law, rotating = effort.load.law, effort.place.rotating
        if isinstance(law, Expression) and name in law.names:
            texts = {"phi": "rad", "omega": "rad/s", "t": "s"}
            texts |= {"x": "rad", "v": "rad/s"} if rotating else {"x": "m", "v": "m/s"}
            symbols = {**{variable: parse_unit(text, None) for variable, text in texts.items()}, **scene.units}
            units.update(units_of_name(law.tree, name, parse_unit("N m" if rotating else "N", None), symbols))
    return unit_text(units.pop()) if len(units) == 1 else None


def moving_switches(law: Expression) -> tuple[Expression, ...]:
    """The switches of a law that depend on speed or time, so that position alone does not determine where they lie."""
    return tuple(part for part in law.switches() if part.uses_speed or part.uses_time)


def decided_here(node: Node) -> Node:
    """The tree of a law in which a branch that speed and position decide together is decided where it is evaluated.

    By the sign of v alone it stays decided at the anchor.

    Raises:
        TypeError: for atan2 of a velocity, whose cut has no branches to choose from.

    """
    node = node._replace(args=tuple(map(decided_here, node.args)))
    names = {inner.name for inner in walk(node) if inner.name}
    if node.op not in ("compare", "abs", "sign", "min", "max", "atan2") or not names & {"omega", "v"} or names == {"omega"}:
        return node
    zero, one = numeral(0.0), ONE
    sides = node.args if node.op in ("compare", "min", "max") else (node.args[0], zero)
    if len(sides) == 2 and any(_is_multiple(side) and _is_nothing(other) for side, other in (sides, sides[::-1])):
        return node  # by the sign of v alone

    def when(sign: str, yes: Node, no: Node) -> Node:
        test = Node("compare", sides, signs=(sign,))
        return Node("if", (Node("here", (test,)), yes, no))

    if node.op == "atan2":
        raise TypeError("the angle of a velocity, by atan2")
    if node.op == "compare":
        return Node("here", (node,))
    if node.op == "abs":
        return when(">", sides[0], Node("neg", sides[:1]))
    if node.op == "sign":
        return when(">", one, when("<", Node("neg", (one,)), zero))
    return when("<=" if node.op == "min" else ">=", *sides)


def _is_nothing(node: Node) -> bool:
    return node.op == "number" and not is_recorded(node.number) and node.number == 0.0


def _is_multiple(node: Node) -> bool:
    """Tests whether a tree is v times numbers: its sign is that of v, or the opposite one."""
    varying = [arg for arg in node.args if arg.op != "number"]
    return node.name == "v" or (node.op in ("neg", "product") and len(varying) == 1 and _is_multiple(varying[0]))


class FrictionCurve:
    """The moment (N m, or N) of friction in joints on the reduction element, on its coordinate from 0 to the cycle.

    It is not smooth at `breakpoints`. `error` (J) bounds the error of its fit in the work of the cycle. `speed` is the
    constant one (rad/s) at which it was computed; None along a motion of varying speed.
    """

    def __init__(self, mesh: Cells, values: Array, corners: Array, speed: float | None = None) -> None:
        self.mesh, self.series, self.speed = mesh, cells.fit(values), speed
        self.breakpoints = tuple(corners.tolist())
        self.error = float((cells.tails(self.series) * 2 * mesh.half[:, 0]).sum())

    def __call__(self, here: Here, anchor: Here) -> Any:
        """The moment at positions `here.q`."""
        cell, t = cells.located(self.mesh, np.asarray(here.q, dtype=float))
        return cells.value(self.series[cell], t)

    def apart(self, other: FrictionCurve) -> float:
        """Integral of the absolute difference from another curve over the cycle, J."""
        here = Here(self.mesh.phi, None, np)
        return float(cells.integral(np.abs(self(here, here) - other(here, here)), self.mesh.half).sum())


def spring_effort(spring: Spring, place: EffortPlace) -> Callable[[Here, Here], Any]:
    """Effort of a spring, k (x - rest): the half arrow enters it, so it acts with the opposite sign."""

    def effort(here: Here, anchor: Here) -> Any:
        return spring.stiffness * (place.displacement(here) - spring.rest)

    return effort


def crank_angles(local: float | Array, every: float, place: EffortPlace, cycle: float) -> Array:
    """Every crank angle in [0, cycle) at which a place's angle, reduced modulo `every`, passes one of `local`."""
    column = np.array(local, ndmin=1)[:, None]
    first = np.ceil((place.phase - column) / every - 1e-12)
    turns = first + np.arange(int(place.rate * cycle / every + 2))
    angles = (column + turns * every - place.phase) / place.rate
    inside: Array = angles[(angles >= 0.0) & (angles < cycle)]
    return inside


def at_speeds(still: Any, moving: Iterable[tuple[Any, Any]], omega: Any, unknown: Any) -> tuple[Any, Any, Any, Any]:
    """M* of a part at crank speeds (rad/s), its slopes by the speed and by the unknown, and the sum of |contributions|.

    Args:
        still: the share that depends on position alone, with `moment`, `per_unknown`, `exchanged` and `resistance` of
        `Reduced`.
        moving: moments that depend on speed with their factors of the unknown, as jets by the speed where they do.
        omega: speeds: numbers, arrays, or recorded ones.
        unknown: value of the scene's unknown.

    """
    of_unknown = unknown * still.per_unknown
    moment, by_speed, by_unknown = still.moment + of_unknown - still.resistance * omega, -still.resistance, still.per_unknown
    exchanged = still.exchanged + abs(of_unknown) + still.resistance * omega
    for effort, factor in moving:
        value, slope = _with_slope(effort)
        factor_value, factor_slope = _with_slope(factor)
        value = value + unknown * factor_value
        moment, by_speed = moment + value, by_speed + slope + unknown * factor_slope
        by_unknown, exchanged = by_unknown + factor_value, exchanged + abs(value)
    return moment, by_speed, by_unknown, exchanged


def _with_slope(value: Any) -> tuple[Any, Any]:
    """Value and slope of a jet, or of a number that does not depend on speed."""
    return (value.value, value.first) if isinstance(value, Jet) else (value, 0.0)
