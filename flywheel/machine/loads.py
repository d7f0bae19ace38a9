"""Loads, springs, tables and friction in joints as laws of position for the bond graph, and the angles where they break."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import cache, cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.elements import Here
from flywheel.numerics import cells
from flywheel.numerics.cells import Cells
from flywheel.numerics.expressions import Expression, shown, units_of_name
from flywheel.numerics.faults import Fault, SceneError
from flywheel.numerics.jets import Jet, jet_namespace
from flywheel.numerics.units import DIMENSIONS, Unit, parse_unit
from flywheel.scene.scene import Law, Load, Scene, Spring, Table

Array = NDArray[np.float64]
Position = Callable[[Here], Any]


class Place(NamedTuple):
    """Where an effort acts: its 1-junction, its displacement, and the angle that its windows and `phi` see.

    angle = rate * phi + phase, phi being the crank's. `shaft`: it is a shaft, whose own speed loads on it see.
    """

    junction: str
    displacement: Position
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
        return self.signs[np.searchsorted(self.dead_centres, phi)]


class Pieces:
    """A table as polynomials between its knots: values see the piece that their anchor lies in."""

    def __init__(self, table: Table) -> None:
        jumps = np.flatnonzero(np.diff(table.angle) == 0.0) + 1
        runs = zip(np.split(table.angle, jumps), np.split(table.value, jumps), strict=True)
        pieces = [_polynomials(angle, value, table.interpolation) for angle, value in runs if angle.size > 1]
        self.first = float(table.angle[0])
        self.knots = table.angle[np.diff(table.angle, prepend=-np.inf) > 0.0]
        self._start = np.concatenate([start for start, _ in pieces])
        most = max(len(series) for _, series in pieces)
        padded = [np.pad(series, ((most - len(series), 0), (0, 0))) for _, series in pieces]
        self._series = np.concatenate(padded, axis=1)

    def __call__(self, angle: Any, anchor: Any) -> Any:
        """Value at angles, each in the piece of its anchor."""
        piece = np.maximum(np.searchsorted(self._start, anchor, side="right") - 1, 0)
        step = angle - self._start[piece]
        total: Any = 0.0
        for series in self._series:
            total = total * step + series[piece]
        return total


def _polynomials(angle: Array, value: Array, interpolation: str) -> tuple[Array, Array]:
    """Left ends and coefficients (highest power first) of one run without jumps."""
    if interpolation == "pchip" and angle.size > 2:
        from scipy.interpolate import PchipInterpolator  # only scenes with such a table pay for it

        return angle[:-1], np.asarray(PchipInterpolator(angle, value).c)
    flat = np.zeros(angle.size - 1)
    if interpolation == "step":
        return angle[:-1], np.stack((flat, value[:-1]))
    return angle[:-1], np.stack((np.diff(value) / np.diff(angle), value[:-1]))


class Effort:
    """The law of one load: its value where it is active, 0 elsewhere; `unknown` names the scene's balance, if any."""

    def __init__(
        self,
        load: Load,
        place: Place,
        parameters: Mapping[str, float],
        unknown: str | None = None,
        senses: Senses | Callable[[], Senses] | None = None,
    ) -> None:
        self.load, self.place, self._given_senses = load, place, senses
        key = "table" if isinstance(load.law, Table) else "torque" if place.rotating else "force"
        if load.model:
            key = "motor" if load.path == "drive" else "model"
        self.path = f"{load.path}.{key}"
        self.every = load.every
        self._parameters = parameters
        self._law: Law | Pieces | None = Pieces(load.law) if isinstance(load.law, Table) else load.law
        self._always = load.start is None and load.sense == 0
        self._unknown: str | None = None
        if isinstance(load.law, Expression) and unknown is not None and unknown in load.law.names:
            if load.law.degree(unknown) is None:
                raise SceneError([_not_linear(self.path, load.law, unknown)])
            self._unknown = unknown
        self.depends_on_unknown = load.law is None or self._unknown is not None
        self.uses_speed = isinstance(load.law, Expression) and load.law.uses_speed
        self.uses_time = isinstance(load.law, Expression) and load.law.uses_time

    @cached_property
    def senses(self) -> Senses | None:
        """When its place moves forwards and when backwards; None where the load does not depend on that."""
        if not self.load.sense and "v" not in getattr(self._law, "names", ()):
            return None
        return self._given_senses() if callable(self._given_senses) else self._given_senses

    @property
    def sees(self) -> tuple[str, ...]:
        """What of `Here` the law depends on beside position: speed (of the driving shaft), flow (its own), time."""
        names = self._law.names if isinstance(self._law, Expression) else frozenset[str]()
        own = ("v" in names and self.uses_speed) or ("omega" in names and self.place.shaft)
        found = {"speed": "omega" in names and not self.place.shaft, "flow": own, "time": "t" in names}
        return tuple(name for name, seen in found.items() if seen)

    @property
    def constants(self) -> Mapping[str, float]:
        """The parameters, with 1 for the unknown."""
        return {**self._parameters, self._unknown: 1.0} if self._unknown else self._parameters

    def __call__(self, here: Here, anchor: Here) -> Any:
        """Effort without the unknown's share."""
        return self._gated(self._coefficients(here, anchor)[0], anchor)

    def per_unknown(self, here: Here, anchor: Here) -> Any:
        """Effort per unit of the unknown."""
        return self._gated(self._coefficients(here, anchor)[1], anchor)

    def _coefficients(self, here: Here, anchor: Here) -> tuple[Any, Any]:
        law = self._law
        if law is None:
            return 0.0, 1.0
        if isinstance(law, float | int):
            return law, 0.0
        if isinstance(law, Pieces):
            return law(*self._angles(here, anchor, law.first)), 0.0
        angle, middle = self._angles(here, anchor)
        assert isinstance(law, Expression)
        values = self._values(law, here, angle, anchor)
        middles = self._values(law, anchor, middle, anchor)
        ns = _namespace(here)
        if self._unknown is None:
            return law.evaluate(values, ns, middles), 0.0
        return law.coefficients(values, self._unknown, ns, middles)

    def _values(self, law: Expression, here: Here, angle: Any, anchor: Here) -> dict[str, Any]:
        values: dict[str, Any] = dict(self._parameters)
        values["phi"] = angle
        values["omega"], values["t"] = here.flow if self.place.shaft else here.speed, here.time
        if "x" in law.names:
            values["x"] = self.place.displacement(here)
        if self.uses_speed:
            values["v"] = here.flow
        elif "v" in law.names and self.senses is not None:
            values["v"] = self.senses.at(self._crank_angle(anchor))
        return values

    def speed_switches(self, here: Here, anchor: Here) -> list[Any]:
        """What decides the branches of the law by its sign, as far as it depends on speed or time; `here` is moving."""
        law = self._law
        if not isinstance(law, Expression):
            return []
        angle, middle = self._angles(here, anchor)
        values, middles = self._values(law, here, angle, anchor), self._values(law, anchor, middle, anchor)
        # where v itself changes its sign is known beforehand, but for a machine that turns back
        # where time alone decides is known beforehand too: stepping starts afresh there
        parts = [part for part in moving_switches(law) if not self.is_timed(part)]
        return [here.speed if _is_velocity(part) else part.evaluate(values, np, middles) for part in parts]

    def is_timed(self, part: Expression) -> bool:
        """Whether a part of the law depends on time and on nothing else."""
        return "t" in part.names and part.names <= {"t", *self.constants}

    def _angles(self, here: Here, anchor: Here, first: float = 0.0) -> tuple[Any, Any]:
        """The load's angle, reduced to [first, first + every) by the turn that the anchor is in, here and at it."""
        middle = anchor.q + self.place.phase
        turns = self.turns(middle, first)
        return here.q + self.place.phase - turns, middle - turns

    def turns(self, angle: Any, first: float = 0.0) -> Any:
        """What reduces an angle to [first, first + every); nothing on a stroke."""
        return 0.0 if self.load.once else self.every * np.floor((angle - first) / self.every)

    def _crank_angle(self, anchor: Here) -> Any:
        return anchor.q / self.place.rate

    def _gated(self, effort: Any, anchor: Here) -> Any:
        if self._always:
            return effort
        return (_jets() if isinstance(effort, Jet) else np).where(self.active(anchor), effort, 0.0)

    @property
    def acts(self) -> Callable[[Here], Any] | None:
        """What tells whether the load acts in the piece of an anchor; None where it acts always."""
        return None if self._always else self.active

    def active(self, anchor: Here) -> Any:
        """Whether the load acts in the pieces of these anchors."""
        load, active = self.load, True
        if load.start is not None and load.end is not None:
            middle = self._angles(anchor, anchor)[1]
            after, before = middle >= load.start, middle < load.end
            active = after & before if load.start < load.end else after | before
        if load.sense and self.senses is not None:
            active = active & (self.senses.at(self._crank_angle(anchor)) == load.sense)
        return active

    def active_at(self, phi: Any) -> Any:
        """Whether the load acts at crank angles phi, none of them a breakpoint."""
        return self.active(Here(self.place.rate * phi, None, np))

    def local_breakpoints(self) -> Array:
        """Angles in [0, every) where the load breaks by itself: its period's ends, its window, its table's knots."""
        found = [0.0] if isinstance(self._law, Pieces | Expression) and not self.load.once else []
        if self.load.start is not None and self.load.end is not None:
            found += [self.load.start, self.load.end]
        return np.concatenate((found, self._law.knots if isinstance(self._law, Pieces) else ()))


def balance_unit(efforts: Iterable[Effort], scene: Scene) -> str | None:
    """The unit of the scene's unknown; None without one, or where the expressions that hold it leave it open."""
    name = scene.unknown
    if name is None or name == "drive":
        return name and DIMENSIONS["force" if scene.reduction_element == "slide" else "torque"].si
    found: set[Unit | None] = set()
    for effort in efforts:
        law, rotating = effort.load.law, effort.place.rotating
        if isinstance(law, Expression) and name in law.names:
            known = {**_units(rotating), **scene.units}
            found.update(units_of_name(law.tree, name, parse_unit("N m" if rotating else "N", None), known))
    return shown(found.pop()) if len(found) == 1 else None


def _units(rotating: bool) -> dict[str, Unit]:
    """The units of the variables of a law on a place."""
    texts = {"phi": "rad", "omega": "rad/s", "t": "s", "x": "m", "v": "m/s"}
    texts |= {"x": "rad", "v": "rad/s"} if rotating else {}
    return {name: parse_unit(text, None) for name, text in texts.items()}


def moving_switches(law: Expression) -> tuple[Expression, ...]:
    """The switches of a law that depend on speed or time, so that position alone does not tell where they lie."""
    return tuple(part for part in law.switches() if part.uses_speed or part.uses_time)


def _is_velocity(part: Expression) -> bool:
    return part.names == {"v"} and part.tree.op in ("name", "neg")


@cache
def _jets() -> Any:
    return jet_namespace(np)


def _namespace(here: Here) -> Any:
    """The namespace of a law's arguments: that of jets where it is asked for slopes by speed."""
    return _jets() if isinstance(here.speed, Jet) else here.ns


def _not_linear(path: str, law: Expression, unknown: str) -> Fault:
    found = f'"{law.shown}", which is not linear in the balance {unknown}'
    return Fault(path, found, f"{unknown} as a factor or a term", "give it a value, and balance another quantity")


class FrictionCurve:
    """The moment (N m, or N) of friction in joints on the reduction element, on its coordinate from 0 to the cycle.

    It is not smooth at `breakpoints`. `error` (J) bounds what its fit adds to the work of the cycle.
    """

    def __init__(self, mesh: Cells, values: Array, corners: Array) -> None:
        self.mesh, self.series = mesh, cells.fit(values)
        self.breakpoints = tuple(corners.tolist())
        self.error = float((cells.tails(self.series) * 2 * mesh.half[:, 0]).sum())

    def __call__(self, here: Here, anchor: Here) -> Any:
        """The moment at positions `here.q`."""
        cell, t = cells.located(self.mesh, np.asarray(here.q, dtype=float))
        return cells.value(self.series[cell], t)


def spring_effort(spring: Spring, place: Place) -> Callable[[Here, Here], Any]:
    """Effort that a spring takes up, k (x - rest): the half arrow enters it, so it acts with the opposite sign."""

    def effort(here: Here, anchor: Here) -> Any:
        return spring.stiffness * (place.displacement(here) - spring.rest)

    return effort


def crank_angles(local: float | Array, every: float, place: Place, cycle: float) -> Array:
    """Every crank angle in [0, cycle) at which a place's angle, reduced modulo `every`, passes one of `local`."""
    column = np.reshape(local, (-1, 1))
    first = np.ceil((place.phase - column) / every - 1e-12)
    count = int(place.rate * cycle / every + 2)
    angles = (column + (first + np.arange(count)) * every - place.phase) / place.rate
    found: Array = angles[(angles >= 0.0) & (angles < cycle)]
    return found
