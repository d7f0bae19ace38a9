"""From a scene to its machine: loads as laws of position, the bond graph, and the angles between which everything is smooth.

What breaks and what is steep comes from proven bounds (intervals) of positions, influence coefficients and expressions,
walked through the same bond graph; nothing is sampled. Only scenes with expressions, or loads that act one way, pay for it.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import cache, cached_property, partial
from itertools import count
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.builder import Builder
from bondgraph.elements import C, Here, I, Law, Modulus, Motion, R, Se, Sf
from bondgraph.graph import BondGraph
from bondgraph.records import NamedTuple
from bondgraph.reduction import Reduced, Reduction
from flywheel.mechanisms import families
from flywheel.mechanisms.families import Port, Ratio
from flywheel.numerics import cells, notebook
from flywheel.numerics.cells import Cells, middles
from flywheel.numerics.expressions import Expression, shown, units_of_name
from flywheel.numerics.faults import Fault, SceneError
from flywheel.numerics.functions import cos, sin
from flywheel.numerics.intervals import NAMESPACE as INTERVALS
from flywheel.numerics.intervals import Interval
from flywheel.numerics.jets import Jet, jet_namespace
from flywheel.numerics.switching import (
    CELL_CAP,
    Enclosures,
    SwitchingError,
    Values,
    breakpoints,
    resolved,
    roots_in_pieces,
)
from flywheel.numerics.units import DIMENSIONS, Unit, parse_unit
from flywheel.scene.scene import TURN, Load, Mechanism, Scene, Spring, Table

if TYPE_CHECKING:
    from flywheel.machine.traced import TracedMachine

__all__ = ["FLYWHEEL", "FRICTION", "Machine", "Stage", "merged"]

Array = NDArray[np.float64]

FLYWHEEL = "the flywheel"  # whose part its inertia is
FRICTION = "friction in joints"  # whose part its moment is
SPEED = "speed of the driver"  # whose part its source is
_POSITION = frozenset({"phi", "x", "v"})  # names by which a law reads where its place is, or which way it goes
_MOTOR = "drive.motor"  # the name of its graph as a part

WIDEST = TURN / 4  # of a cell, in the angle of the fastest mechanism: 21 nodes then resolve plain sines to rounding
_SELDOM = 5  # walks: they take as long as a record
_CLOSEST = 1e-7  # of a cycle, between two restarts of the time stepping that are no breakpoints
_LOOKED_AT = np.linspace(0.01, 0.99, 33)  # of a cycle or stroke, where moments and inertias tell a speed
_MOST_SOLVED = 4_000  # cells in which a linkage's dead centres are looked for; a stroke without a dwell takes 32


# -- loads, springs, tables and friction in joints as laws of position -----------------------------------------------------


class Place(NamedTuple):
    """Where an effort acts: its 1-junction, its displacement, and the angle that its windows and `phi` see.

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
        return self.signs[np.searchsorted(self.dead_centres, phi)]


class Pieces:
    """A table as polynomials between its knots: values see the piece that their anchor lies in."""

    def __init__(self, table: Table) -> None:
        starts, polynomials = [], []  # of every run without jumps: left ends and coefficients, highest power first
        jumps = np.flatnonzero(np.diff(table.angle) == 0.0) + 1
        for angle, value in zip(np.split(table.angle, jumps), np.split(table.value, jumps), strict=True):
            if angle.size == 1:
                continue
            starts.append(angle[:-1])
            if table.interpolation == "pchip" and angle.size > 2:
                from scipy.interpolate import PchipInterpolator  # only scenes with such a table pay for it

                polynomials.append(np.asarray(PchipInterpolator(angle, value).c))
            else:
                flat = table.interpolation == "step"
                slopes = np.zeros(angle.size - 1) if flat else np.diff(value) / np.diff(angle)
                polynomials.append(np.stack((slopes, value[:-1])))
        most = max(map(len, polynomials))
        self.first = float(table.angle[0])
        self.knots = table.angle[np.diff(table.angle, prepend=-np.inf) > 0.0]
        self._start = np.concatenate(starts)
        self._series = np.concatenate([np.pad(rows, ((most - len(rows), 0), (0, 0))) for rows in polynomials], axis=1)

    def __call__(self, angle: Any, anchor: Any) -> Any:
        """Value at angles, each in the piece of its anchor."""
        piece = np.maximum(np.searchsorted(self._start, anchor, side="right") - 1, 0)
        step = angle - self._start[piece]
        total: Any = 0.0
        for series in self._series:
            total = total * step + series[piece]
        return total


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
        self.path = load.path if load.drag else f"{load.path}.{key}"
        self._parameters = parameters
        self._law = Pieces(load.law) if isinstance(load.law, Table) else load.law
        self._always = load.start is None and load.sense == 0
        self._unknown: str | None = None
        if isinstance(load.law, Expression) and unknown is not None and unknown in load.law.names:
            if load.law.degree(unknown) is None:
                found = f'"{load.law.shown}", which is not linear in the balance {unknown}'
                advice = "give it a value, and balance another quantity"
                raise SceneError([Fault(self.path, found, f"{unknown} as a factor or a term", advice)])
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
        if isinstance(law, (float, Real)):
            return law, 0.0
        if isinstance(law, Pieces):
            return law(*self._angles(here, anchor, law.first)), 0.0
        angle, middle = self._angles(here, anchor) if "phi" in law.names else (0.0, 0.0)
        values, there = self._values(law, here, angle, anchor), self._values(law, anchor, middle, anchor)
        ns = _jets() if isinstance(here.speed, Jet) else here.ns  # where slopes by speed are wanted
        if self._unknown is None:
            return law.evaluate(values, ns, there), 0.0
        return law.coefficients(values, self._unknown, ns, there)

    def _values(self, law: Expression, here: Here, angle: Any, anchor: Here) -> dict[str, Any]:
        values: dict[str, Any] = dict(self._parameters)
        values["phi"] = angle
        values["omega"], values["t"] = here.flow if self.place.shaft else here.speed, here.time
        if "x" in law.names:
            values["x"] = self.place.displacement(here)
        if self.uses_speed:
            values["v"] = here.flow
        elif "v" in law.names and self.senses is not None:
            values["v"] = self.senses.at(anchor.q / self.place.rate)
        return values

    def speed_switches(self, here: Here, anchor: Here) -> list[Any]:
        """What decides the branches of the law by its sign, as far as it depends on speed or time; `here` is moving.

        Where v itself changes its sign is known beforehand, but for a machine that turns back; where time alone decides is
        known beforehand too: stepping starts afresh there.
        """
        law = self._law
        if not isinstance(law, Expression):
            return []
        angle, middle = self._angles(here, anchor)
        values, there = self._values(law, here, angle, anchor), self._values(law, anchor, middle, anchor)
        found = []
        for part in moving_switches(law):
            if part.names == {"v"} and part.tree.op in ("name", "neg"):
                found.append(here.speed)
            elif not self.is_timed(part):
                found.append(part.evaluate(values, np, there))
        return found

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
        return 0.0 if self.load.once else self.load.every * np.floor((angle - first) / self.load.every)

    def _gated(self, effort: Any, anchor: Here) -> Any:
        if self._always:
            return effort
        active = self.active(anchor)
        if isinstance(active, bool):  # one piece alone
            return effort if active else 0.0
        return (_jets() if isinstance(effort, Jet) else np).where(active, effort, 0.0)

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
            # a window that ends before it begins wraps around the cycle's end
            active = after & before if load.start < load.end else after | before
        if load.sense and self.senses is not None:
            active = active & (self.senses.at(anchor.q / self.place.rate) == load.sense)
        return active

    def crank_breakpoints(self, cycle: float) -> Iterator[float]:
        """Crank angles (rad) where the load breaks: ends of its period and window, its table's knots, its dead centres."""
        found = [0.0] if isinstance(self._law, Pieces | Expression) and not self.load.once else []
        if self.load.start is not None and self.load.end is not None:
            found += [self.load.start, self.load.end]
        local = np.concatenate((found, self._law.knots if isinstance(self._law, Pieces) else ()))
        yield from local - self.place.phase if self.load.once else crank_angles(local, self.load.every, self.place, cycle)
        if self.senses is not None:
            yield from self.senses.dead_centres


@cache
def _jets() -> Any:
    return jet_namespace(np)


def balance_unit(efforts: Iterable[Effort], scene: Scene) -> str | None:
    """The unit of the scene's unknown; None without one, or where the expressions that hold it leave it open."""
    name = scene.unknown
    if name is None or name == "drive":
        return name and DIMENSIONS["force" if scene.reduction_element == "slide" else "torque"].si
    found: set[Unit | None] = set()
    for effort in efforts:
        law, rotating = effort.load.law, effort.place.rotating
        if isinstance(law, Expression) and name in law.names:
            texts = {"phi": "rad", "omega": "rad/s", "t": "s"}
            texts |= {"x": "rad", "v": "rad/s"} if rotating else {"x": "m", "v": "m/s"}
            known = {**{variable: parse_unit(text, None) for variable, text in texts.items()}, **scene.units}
            found.update(units_of_name(law.tree, name, parse_unit("N m" if rotating else "N", None), known))
    return shown(found.pop()) if len(found) == 1 else None


def moving_switches(law: Expression) -> tuple[Expression, ...]:
    """The switches of a law that depend on speed or time, so that position alone does not tell where they lie."""
    return tuple(part for part in law.switches() if part.uses_speed or part.uses_time)


class FrictionCurve:
    """The moment (N m, or N) of friction in joints on the reduction element, on its coordinate from 0 to the cycle.

    It is not smooth at `breakpoints`. `error` (J) bounds what its fit adds to the work of the cycle. `speed` is the constant
    one (rad/s) that it was found at; None of one that was found along a motion with speeds of its own.
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
        """Integral of the difference to another curve over the cycle, whatever its sign (J)."""
        here = Here(self.mesh.phi, None, np)
        return float(cells.integral(np.abs(self(here, here) - other(here, here)), self.mesh.half).sum())


def spring_effort(spring: Spring, place: Place) -> Callable[[Here, Here], Any]:
    """Effort that a spring takes up, k (x - rest): the half arrow enters it, so it acts with the opposite sign."""

    def effort(here: Here, anchor: Here) -> Any:
        return spring.stiffness * (place.displacement(here) - spring.rest)

    return effort


def crank_angles(local: float | Array, every: float, place: Place, cycle: float) -> Array:
    """Every crank angle in [0, cycle) at which a place's angle, reduced modulo `every`, passes one of `local`."""
    column = np.array(local, ndmin=1)[:, None]
    first = np.ceil((place.phase - column) / every - 1e-12)
    turns = first + np.arange(int(place.rate * cycle / every + 2))
    angles = (column + turns * every - place.phase) / place.rate
    found: Array = angles[(angles >= 0.0) & (angles < cycle)]
    return found


# -- the machine -----------------------------------------------------------------------------------------------------------


class Stage(NamedTuple):
    """What hangs on a mesh of an efficiency without further loss (1: on the crank itself), reduced to the crank.

    `near` is the place, among the machine's stages, of the one that it meshes with, which stands before it.
    """

    shaft: str
    near: int
    efficiency: float
    carries_flywheel: bool
    drives: bool
    reduction: Reduction


class Anchor(NamedTuple):
    """Where branches are decided: a position (rad), a crank speed (rad/s) and a time (s) inside a smooth stretch of motion.

    Without a speed and a time those that depend on them are decided at every instant itself.
    `factors` are those of the meshes there (see `Instant`); None where they are to be found at every instant. `sides` are
    signs of what rough joints do there, (..., 3 actions): of their rates, against which friction acts, and of the forces
    that it follows, then directions (rad) of those in pins that keep to a line (else NaN); None where they are to be found
    at every instant. A speed of 0 is that of a machine that rests: rough joints then hold it.
    """

    phi: Any
    omega: Any
    time: Any
    factors: tuple[Any, ...] | None = None
    sides: Array | None = None


class Machine:
    """A machine of one degree of freedom: its scene, its bond graph, and the crank angles that it breaks at.

    Its coordinate runs from 0 to the cycle. On a stroke it is the driver's way from where the stroke begins, so that the
    scene's `origin` added to it gives the driver's own coordinate, and the reduction element `slide` stands for the crank
    where that driver slides: I* is then a mass m* (kg), M* a force F* (N), and angles are lengths (m).

    `graph` is the physical chain of transformers from the crank; `reduction` walks it. `omitted` lists what the scene
    names but the machine does not need (bodies without mass that nothing hangs on, shafts that carry nothing).

    `friction` is the moment of friction in the joints, where it is known: it follows from the forces in a regime, so that
    `flywheel.regime.joint_friction` finds it and gives the machine that has it. A machine is pickled as its scene and that
    moment.

    >>> import flywheel, pickle
    >>> rotor = {"inertia": [{"on": "crank", "value": 2}], "regime": {"speed": 10}, "flywheel": {"inertia": 1}}
    >>> machine = flywheel.Machine(flywheel.load(rotor))
    >>> float(pickle.loads(pickle.dumps(machine)).reduce(0.0).inertia)
    2.0
    """

    def __init__(self, scene: Scene, friction: FrictionCurve | None = None) -> None:
        if not isinstance(scene, Scene):
            raise TypeError(f"expected a Scene (flywheel.load makes one), found {type(scene).__name__}")
        self.scene, self.friction = scene, friction
        self._families = {m.name: families.build(m, scene.parameters) for m in scene.mechanisms}
        self._motions = {m.name: self._motion(m) for m in scene.mechanisms}
        self._crank_motion = Motion(scene.reduction_element)
        self.places = dict(self._places())
        senses = cache(self._senses)
        loads = (*scene.loads, *([] if scene.drive is None else [scene.drive]))
        self.efforts = tuple(
            Effort(load, self.places[load.on], scene.parameters, scene.unknown, partial(senses, load.on)) for load in loads
        )
        self.graph = self._graph()
        self._walks = 0
        self.on_meshes: dict[bytes, Any] = {}  # what `dynamics.moments_on` keeps

    def __reduce__(self) -> tuple[Any, ...]:
        return Machine, (self.scene, self.friction)

    def __repr__(self) -> str:
        """What moves, instead of an address."""
        kinds = dict.fromkeys(m.type for m in self.scene.mechanisms) or ("rotor",)
        title = notebook.quoted(self.scene.title)
        return f"Machine({title}{', '.join(kinds)}, {len(self.graph.bonds)} bonds, shafts {', '.join(self.scene.shafts)})"

    def _repr_html_(self) -> str | None:
        """What a notebook shows."""
        return notebook.html(self)

    def reduce(self, phi: Any, anchor: Any = None) -> Reduced:
        """I*, dI*/dphi, M* at crank angles phi (rad) in [0, cycle], straight from the bond graph.

        `anchor` (same shape, or broadcastable) is an angle inside the smooth piece that each phi belongs to.
        """
        return self.reduction(phi, self.anchors(phi) if anchor is None else anchor)

    def reduce_cells(self, phi: Array, anchor: Array) -> Reduced:
        """The same for cells of any pieces: recorded once that is asked for so often that a record pays."""
        self._walks += 1
        recorded = self.traced.over_cycle if self._walks > _SELDOM else None
        return self.reduction(phi, anchor) if recorded is None else recorded(phi, anchor)

    def anchors(self, phi: Any) -> Any:
        """The middle of the smooth piece that each angle lies in (at a breakpoint: the piece that begins there)."""
        return middles(self.breakpoints, phi)

    @cached_property
    def switches_at_speeds(self) -> bool:
        """Whether some branch of a load depends on speed or time."""
        laws = [effort.load.law for effort in self.efforts if effort.uses_speed or effort.uses_time]
        return any(isinstance(law, Expression) and moving_switches(law) for law in laws)

    @cached_property
    def reduction(self) -> Reduction:
        """The graph compiled for the crank's angle; a SceneError where shafts twist, so that one angle is not enough."""
        if not self.scene.compliances:
            return self.rigid
        found = "a compliant shaft, which makes the motion one of several angles"
        expected = "rigid shafts, to reduce everything to the crank's angle"
        advice = "leave stiffness out to size with a rigid shaft, then follow the compliant machine with flywheel.simulate"
        raise SceneError([Fault(f"shafts.{name}.stiffness", found, expected, advice) for name in self.scene.compliances])

    @cached_property
    def traced(self) -> TracedMachine:
        """The walk of its reduction as recorded programs, piece by piece."""
        from flywheel.machine.traced import TracedMachine  # it rests on the equation of motion, which rests on machines

        return TracedMachine(self)

    @cached_property
    def rigid(self) -> Reduction:
        """The machine with every shaft held rigid, from which the angles come where loads and ratios break."""
        graph = self._graph(rigid=True) if self.scene.compliances else self.graph
        return Reduction(graph, self.scene.reduction_element)

    @cached_property
    def kinematics(self) -> Reduction:
        """The chain without loads, with every shaft and port: also those that the model leaves out as not needed."""
        return Reduction(self._graph(bare=True, rigid=True), self.scene.reduction_element)

    @cached_property
    def stages(self) -> tuple[Stage, ...]:
        """The crank with all that hangs on it without loss, then every shaft whose mesh has losses, nearer ones first."""
        scene, graph = self.scene, self.graph
        lossy = [name for name in scene.shafts if scene.efficiencies.get(name, 1.0) < 1.0]
        mine: dict[str, set[str]] = {shaft: set() for shaft in ("crank", *lossy)}
        for shaft, names in self.one_ports.items() if lossy else ():
            mine[self.stage_of(shaft)] |= names
        flywheel = self.stage_of(scene.flywheel_on)
        drive = self.stage_of(scene.drive.on) if scene.drive is not None else "crank"
        whole, order = self.reduction, ["crank", *lossy]
        return tuple(
            Stage(
                shaft=shaft,
                near=order.index(self.stage_of(scene.near(shaft))),
                efficiency=scene.efficiencies.get(shaft, 1.0),
                carries_flywheel=flywheel == shaft,
                drives=drive == shaft,
                reduction=Reduction(graph, scene.reduction_element, only=names) if lossy else whole,
            )
            for shaft, names in mine.items()
        )

    def stage_of(self, shaft: str) -> str:
        """The shaft of the stage that a shaft belongs to: the next inwards whose mesh has losses, or the crank."""
        scene = self.scene
        on_way = scene.inwards(shaft) if scene.efficiencies and shaft in scene.shafts else ()
        return next((name for name in on_way if scene.efficiencies.get(name, 1.0) < 1.0), "crank")

    @cached_property
    def one_ports(self) -> dict[str, set[str]]:
        """The names of the graph's inertias, sources, springs and dampers by the shaft that they hang on."""
        shafts = {mechanism.name: mechanism.shaft for mechanism in self.scene.mechanisms}
        found: dict[str, set[str]] = {}
        for name, element in self.graph.elements.items():
            if element.kind not in ("0", "1", "TF", "GY"):
                bond = self.graph.bond_of(name)
                junction = bond.tail if bond.head == name else bond.head
                owner = junction.partition(".")[0]
                found.setdefault(junction if junction in self.scene.shafts else shafts.get(owner, owner), set()).add(name)
        return found

    def with_values(self, balance: float, flywheel: float, *, moved: bool = False) -> BondGraph:
        """The graph with a value (SI) for the scene's unknown, a flywheel (kg m²) on its shaft, and its motor's circuit.

        moved: a source of flow moves the driver, at unit speed, and with it every shaft and port: causality of what has no
        inertia then follows from that.
        """
        return self._graph(balance=balance, flywheel=flywheel, circuit=True, moved=moved)

    def where(self, phi: float) -> str:
        """A position of the machine in words: `crank angle 30 deg`, or `slide position 0.19 m`."""
        at = phi + self.scene.origin
        return f"slide position {at:.6g} m" if self._domain == "translation" else f"crank angle {np.degrees(at):.6g} deg"

    @property
    def keeps_step(self) -> bool:
        """Whether a synchronous motor holds the mean speed, whatever the load."""
        motor = self.scene.motor
        return motor is not None and motor.circuit is not None and motor.circuit.only_speed is not None

    @cached_property
    def depends_on_speed(self) -> bool:
        """Whether a load, the drive or a damper depends on speed."""
        return self.scene.depends_on_speed

    @cached_property
    def depends_on_time(self) -> bool:
        """Whether a load or the drive depends on time."""
        return any(effort.uses_time for effort in self.efforts)

    @property
    def typical_speed(self) -> float:
        """A speed (rad/s, m/s) about which the machine runs: the one asked for, that of its idle motor, or by its loads."""
        scene = self.scene
        if scene.stroke is not None:
            return abs(scene.stroke.speed or 0.0) or self._speed_by_loads
        if scene.speed is None and scene.motor is not None and scene.drive is not None:
            return (scene.motor.no_load_speed or 1.0) / scene.shafts[scene.drive.on]
        return scene.speed or self._speed_by_loads

    @cached_property
    def _speed_by_loads(self) -> float:
        """The speed that the greatest moment gives the greatest inertia over a cycle or stroke, sqrt(2 M* phi/I*).

        1 where loads depend on speed, for which a speed is looked for about that, or where there is no such moment.
        """
        if self.scene.depends_on_speed or self.scene.unknown is not None:
            return 1.0
        phi = self.scene.cycle * _LOOKED_AT
        with np.errstate(all="ignore"):
            moment = sum(self.reduction.moments(phi, phi, 0.0, speed=0.0).values()) + 0.0 * phi
            square = 2.0 * np.abs(moment).max() * self.scene.cycle / np.max(self.reduction(phi, phi).inertia)
        return float(np.sqrt(square)) if 0.0 < square < np.inf else 1.0

    @cached_property
    def sets_its_speed(self) -> bool:
        """Whether the moment depends on more than position, so that the motion itself must be found: speeds, losses."""
        return self.depends_on_speed or len(self.stages) > 1

    def family(self, mechanism: Mechanism) -> families.Family:
        """One of its mechanisms as a chain of velocities, with its masses, weights, ports and positions."""
        return self._families[mechanism.name]

    @property
    def omitted(self) -> tuple[str, ...]:
        """Velocities that the model leaves out because nothing hangs on them and nothing is reached through them."""
        chains = self._families.items()
        inner = [f"{name}.{velocity.name}" for name, family in chains for velocity in family.velocities]
        return tuple(name for name in (*self.scene.shafts, *inner) if name not in self.graph.elements)

    @property
    def pivoted(self) -> dict[str, tuple[str, float]]:
        """Points of bodies on a fixed pivot, whose velocity is their tangential speed: what turns them, and radius (m)."""
        found = {}
        for mechanism in self.scene.mechanisms:
            velocities = {velocity.name: velocity for velocity in self._families[mechanism.name].velocities}
            for name, velocity in velocities.items():
                source, ratio = velocity.terms[0]
                if f"{name}.x" in velocities and isinstance(ratio, (float, Real)):
                    turning = mechanism.shaft if source == "crank" else f"{mechanism.name}.{source}"
                    found[f"{mechanism.name}.{name}"] = (turning, float(ratio))
        return found

    # -- breakpoints -------------------------------------------------------------------------------------------------

    @cached_property
    def breakpoints(self) -> Array:
        """Crank angles (rad) from 0 to the cycle between which every load and ratio is smooth."""
        known = self._unswitched
        return merged([*known, *(angle for _, angle in self._switch_angles(known))], self.scene.cycle)

    @cached_property
    def landmarks(self) -> Array:
        """The breakpoints, and the edges that close in on narrow features of expressions.

        Cells are added wherever a load's expression is too steep for the cell that it lies in; what depends on speed is
        taken at the machine's typical one. An expression that is infinite at the end of a cell is refused; one that is only
        not defined there is another matter.
        """
        edges = self.breakpoints
        for effort in self.efforts:
            law, lo, hi = effort.load.law, edges[:-1], edges[1:]
            if not isinstance(law, Expression) or not (_POSITION & law.names or self._infinite(effort)):
                continue
            middle = 0.5 * (lo + hi)
            active = np.broadcast_to(effort.active(Here(effort.place.rate * middle, None, np)), lo.shape)
            if not active.any():
                continue
            enclosures, values = self._environment(effort)
            lo, hi, middle = lo[active], hi[active], middle[active]
            try:
                for ends in (lo, hi):
                    with np.errstate(all="ignore"):
                        found = law.evaluate(values(ends, middle), np, values(middle, middle)) + 0.0 * ends
                    if (np.abs(found) == np.inf).any():
                        at = int((np.abs(found) == np.inf).argmax())
                        reason = self.undefined(effort.path, ends[at], middle[at])
                        where = "phi = {near}" if effort.load.once else f"crank angle {np.degrees(ends[at]):.6g} deg"
                        raise SwitchingError(f"a value that is not finite at {where} ({reason})", float(ends[at]))
                splits = resolved(law, lo, hi, enclosures, values)
            except SwitchingError as error:
                raise _unresolved(effort, error) from None
            edges = np.array(sorted({*edges.tolist(), *splits.tolist()}))
        return edges

    @property
    def breaks(self) -> bytes:
        """What breakpoints and landmarks follow from, as bytes: machines for which these are alike have the same."""
        scene = self.scene
        parts: list[Any] = [scene.mechanisms, scene.shafts, scene.reduction_element, scene.cycle, scene.origin, scene.stroke]
        for effort in self.efforts:
            law = effort.load.law
            if not isinstance(law, Expression):
                parts.append(effort.load)
            elif not _POSITION & law.names:
                parts += [effort.load._replace(law=None, model=""), self._infinite(effort)]
            else:
                used = sorted((name, value) for name, value in effort.constants.items() if name in law.names)
                speed = self.typical_speed if effort.uses_speed else None
                parts += [effort.load._replace(law=None, model=""), law.tree, used, speed]
        return pickle.dumps(parts)

    def _infinite(self, effort: Effort) -> bool:
        """Whether a law that reads no position is infinite at the machine's typical speed."""
        names = self._names(effort)(0.0, 0.0, np)
        with np.errstate(all="ignore"):
            return bool(np.isinf(effort.load.law.evaluate(names, np, names)).any())  # type: ignore[union-attr]

    @cached_property
    def restarts(self) -> Array:
        """Where time stepping starts afresh: the landmarks, but for those so close that time could not tell them apart."""
        gaps = np.diff(self.landmarks)
        wide = gaps > _CLOSEST * self.scene.cycle
        apart = np.concatenate(([True], wide)) & np.concatenate((wide, [True]))
        return self.landmarks[apart | np.isin(self.landmarks, self.breakpoints)]

    @cached_property
    def mesh(self) -> Array:
        """Edges of the first cells: the landmarks, with wide stretches cut evenly."""
        counts = np.ceil(np.diff(self.landmarks) * self.fastest / WIDEST * (1 - 1e-12)).astype(int).clip(1)
        start, steps = np.repeat(self.landmarks[:-1], counts), np.repeat(np.diff(self.landmarks) / counts, counts)
        first = np.repeat(np.cumsum(counts) - counts, counts)
        return np.append(start + (np.arange(start.size) - first) * steps, self.landmarks[-1])

    @property
    def fastest(self) -> float:
        """Speed of the fastest mechanism's crank over that of the reduction element, 0 without a mechanism."""
        return max([self.scene.shafts[m.shaft] for m in self.scene.mechanisms], default=0.0)

    @property
    def broken_by(self) -> dict[str, int]:
        """How many breakpoints inside the cycle each mechanism, load or other thing makes, by its name or path."""
        known = self.breakpoints[1:-1]
        near = 1e-9 * self.scene.cycle
        found: dict[str, set[int]] = {}
        for name, angle in (*self._own_breakpoints(), *self._switch_angles(self._unswitched)):
            hit = np.flatnonzero(np.abs(known - angle) <= near)
            found.setdefault(name, set()).update(hit.tolist())
        return {name: len(places) for name, places in found.items() if places}

    @cached_property
    def _unswitched(self) -> Array:
        """The breakpoints but for the angles at which expressions switch."""
        return merged([0.0, self.scene.cycle, *(angle for _, angle in self._own_breakpoints())], self.scene.cycle)

    def corners_of(self, mechanism: Mechanism) -> tuple[float, ...]:
        """Positions of a mechanism's own driver (rad or m) at which it is not smooth, or near to a lock."""
        return tuple(self._families[mechanism.name].breakpoints)

    @property
    def resists(self) -> bool:
        """Whether joints rub whose friction follows the actual motion: it is not given as a moment of position."""
        return self.scene.rubs and self.friction is None

    def _own_breakpoints(self) -> Iterator[tuple[str, float]]:
        yield from self._mechanism_breakpoints()
        if self.friction is not None:
            yield from ((FRICTION, angle) for angle in self.friction.breakpoints)
        for effort in self.efforts:
            yield from ((effort.path, angle) for angle in effort.crank_breakpoints(self.scene.cycle))

    def _mechanism_breakpoints(self) -> Iterator[tuple[str, float]]:
        for mechanism in self.scene.mechanisms:
            place = Place("", _turned(1.0), self.scene.shafts[mechanism.shaft], mechanism.phase)
            for angle in self._families[mechanism.name].breakpoints:
                if mechanism.stroke is not None:
                    yield mechanism.name, angle - mechanism.phase
                else:
                    for found in crank_angles(angle, mechanism.period, place, self.scene.cycle):
                        yield mechanism.name, found

    def _switch_angles(self, known: Array) -> Iterator[tuple[str, float]]:
        """Crank angles at which a branch of a load's expression changes, beside those known already."""
        for effort in self.efforts:
            law = effort.load.law
            if isinstance(law, Expression) and (law.switches() or law.branch_points()):
                try:
                    found = breakpoints(law, 0.0, float(known[-1]), *self._environment(effort), known)
                except SwitchingError as error:
                    raise _unresolved(effort, error) from None
                yield from ((effort.path, angle) for angle in found)

    def _senses(self, place: str) -> Senses:
        """When a place moves forwards and when backwards, by a closed form, or by the roots of its influence coefficient.

        Between two dead centres of a closed form the port goes from its place at one to that at the next.
        """
        name, _, port = place.partition(".")
        cycle, at = self.scene.cycle, self.places[place]
        known: Port | None = self._families[name].ports[port] if port else None
        if self.scene.stroke is None and known is not None and known.dead_centres:
            local = np.array(known.dead_centres)
            position = np.array([known.position(self._families[name].position(psi, np)) for psi in known.dead_centres])
            signs = np.sign(np.roll(position, -1) - position)
            found = np.sort(crank_angles(local, TURN, at, cycle))
            edges = np.concatenate(([0.0], found, [cycle]))
            psi = (at.rate * 0.5 * (edges[1:] + edges[:-1]) + at.phase) % TURN
            return Senses(found, signs[np.searchsorted(local, psi) - 1])
        own = (angle for _, angle in self._mechanism_breakpoints())
        try:
            found = self._dead_centres(place, merged([0.0, cycle, *own], cycle))
        except SwitchingError:
            path = next(effort.load.path for effort in self.efforts if effort.load.on == place)
            what = f"{place}, whose velocity changes sign too often to follow, as if it stood still"
            raise SceneError([Fault(path, what, "a place that moves", "leave `while` and v out there")]) from None
        edges = np.concatenate(([0.0], found, [cycle]))
        halfway = 0.5 * (edges[1:] + edges[:-1])
        gain = self.kinematics.flows(halfway, halfway).gain[self.kinematics.variable[at.junction]]
        return Senses(found, np.broadcast_to(np.sign(gain), halfway.shape))

    def _dead_centres(self, place: str, smooth: Array) -> Array:
        """Crank angles between smooth pieces' edges at which a place turns back, where no closed form gives them."""
        solved = any(mechanism.linkage is not None for mechanism in self.scene.mechanisms)
        return dead_centres(self.kinematics, self.places[place].junction, smooth, solved=solved)

    def undefined(self, path: str, phi: float, anchor: float, speed: float | None = None, time: float = 0.0) -> str:
        """What leaves the expression of a load, by its path, without a finite value at a position, in words; or nothing.

        At a crank angle (rad) in the piece of an anchor, a speed (rad/s; None: the typical one) and a time (s).
        """
        effort = next((effort for effort in self.efforts if effort.path == path), None)
        if effort is None or not isinstance(effort.load.law, Expression):
            return ""
        with np.errstate(all="ignore"):
            values = self._environment(effort, speed)[1]
            here, middle = np.asarray(phi), np.asarray(anchor)
            return effort.load.law.undefined({**values(here, middle), "t": time}, {**values(middle, middle), "t": time})

    def _environment(self, effort: Effort, speed: float | None = None) -> tuple[Enclosures, Values]:
        """What the names of a load's expression stand for: jets of intervals over cells of phi, and plain values."""
        names = self._names(effort, speed)

        def enclosures(lo: Array, hi: Array, anchor: Array) -> Mapping[str, Any]:
            return names(Interval(lo, hi), anchor, INTERVALS)

        def values(phi: Array, anchor: Array) -> Mapping[str, Any]:
            return names(phi, anchor, np)

        return enclosures, values

    def _names(self, effort: Effort, speed: float | None = None) -> Callable[[Any, Any, Any], Mapping[str, Any]]:
        """What the names of a load's expression stand for at crank angles, given their anchors and a namespace.

        They are jets by the crank's angle, but plain values in numpy's. Which turn of the load's angle they lie in is the
        anchor's to say, as at the end of a turn rounding could not. The crank's `speed` (rad/s) is the machine's typical one
        where none is given.
        """
        place, names = effort.place, effort.load.law.names  # type: ignore[union-attr]
        reduction, motion = self.rigid, self.motion_of(effort.load.on)
        crank_speed = self.typical_speed if speed is None else speed
        variable = reduction.variable[place.junction]
        gains = reduction.flows(0.0, 0.0).gain
        rate = gains[reduction.variable[motion.of]]
        own_speed = crank_speed * (gains[variable] if place.shaft else rate)

        def environment(phi: Any, anchor: Any, ns: Any) -> Mapping[str, Any]:
            bounds = ns is not np
            angle = place.rate * phi + (place.phase - effort.turns(place.rate * anchor + place.phase))
            found = {**effort.constants, "omega": own_speed, "t": 0.0, "phi": Jet(angle, place.rate) if bounds else angle}
            if "v" in names and effort.senses is not None:
                found["v"] = effort.senses.at(anchor)
            needs_gain = effort.uses_speed or ("x" in names and bounds)
            gain: Any = reduction.flows(phi, anchor, ns).gain[variable] if needs_gain else 0.0
            if effort.uses_speed:
                found["v"] = crank_speed * gain
            if "x" in names:
                x = place.displacement(Here(rate * phi, motion.position(rate * phi, ns, rate * anchor), ns))
                found["x"] = Jet(x, gain) if bounds else x
            return found

        return environment

    # -- the graph ---------------------------------------------------------------------------------------------------

    @property
    def _domain(self) -> str:
        """The energy domain of the reduction element."""
        return "translation" if self.scene.reduction_element == "slide" else "rotation"

    def _graph(
        self,
        *,
        bare: bool = False,
        rigid: bool = False,
        balance: float = 0.0,
        flywheel: float = 0.0,
        circuit: bool = False,
        moved: bool = False,
    ) -> BondGraph:
        """The graph; `bare`: every shaft and port, without loads. `rigid`: no shaft twists. `circuit`: of the motor too.

        moved: with a source of flow on the driver.
        """
        scene, element = self.scene, self.scene.reduction_element
        builder = Builder().one(element, self._domain, displacement="x" if element == "slide" else "phi")
        acting: Iterable[Any] = (*(effort.load for effort in self.efforts), *scene.springs, *scene.dampers, *scene.inertias)
        occupied = {*(item.on for item in acting), *([scene.flywheel_on] * bool(flywheel))}
        needed = self._needed(self.places if bare or moved else occupied)
        for name, speed in scene.shafts.items():
            if name == element or name not in needed:
                continue
            on = scene.near(name)
            ratio = speed / scene.shafts[on]
            compliance = None if rigid else scene.compliances.get(name)
            if compliance is None:
                builder.sum(name, [(on, ratio)], "rotation").displacement(f"phi_{name}", name)
                continue
            twisting = [C(f"{name}.compliance", stiffness=compliance.stiffness, part=f"twist of {name}")]
            if compliance.damping:
                twisting.append(R(f"{name}.damping", compliance.damping, part=f"twist of {name}"))
            builder.sum(f"{name}.gear", [(on, ratio)], "rotation")
            builder.one(name, "rotation", displacement=f"phi_{name}")
            builder.between(f"{name}.gear", name, *twisting, name=f"{name}.twist")
        for mechanism in scene.mechanisms:
            self._hang(builder, mechanism, needed)
        for item in scene.inertias:
            name, _, port = item.on.partition(".")
            kinks = self._families[name].ports[port].kinks if port else ()
            if kinks:
                found = f"{item.on}, whose velocity jumps at {np.degrees(kinks[0]):.6g} deg of its mechanism"
                raise SceneError([Fault(f"{item.path}.on", found, "a port with a continuous velocity", "smooth its law")])
            builder.port(self.places[item.on].junction, I(item.path, item.value, part=f"inertia on {item.on}"))
        if flywheel:
            builder.port(scene.flywheel_on, I(_free(builder, "flywheel"), flywheel, part=FLYWHEEL))
        if moved:
            builder.port(element, Sf(_free(builder, "speed"), 1.0, part=SPEED))
        if not bare:
            self._load(builder, balance, circuit)
        if len(builder) == 1:
            builder.port(element, I("nothing", 0.0))
        return builder.build(loose=bare or moved)

    def _needed(self, places: Iterable[str]) -> set[str]:
        """Junctions at these places, those that carry something, and those that lead to them."""
        carrying = {self.places[place].junction for place in places}
        parents: dict[str, tuple[str, ...]] = {name: (self.scene.near(name),) for name in self.scene.transmissions}
        for mechanism in self.scene.mechanisms:
            family = self._families[mechanism.name]
            for v in family.velocities:
                parents[f"{mechanism.name}.{v.name}"] = tuple(_junction(mechanism, term.source) for term in v.terms)
            carrying |= {_junction(mechanism, mass.velocity) for mass in family.masses}
            carrying |= {_junction(mechanism, velocity) for velocity, _, _ in self._weights(mechanism)}
        todo = list(carrying)
        while todo:
            fresh = [p for p in parents.get(todo.pop(), ()) if p not in carrying]
            carrying.update(fresh)
            todo += fresh
        return carrying

    def _hang(self, builder: Builder, mechanism: Mechanism, needed: set[str]) -> None:
        """A mechanism's velocities as far as they are needed, its masses and their weights."""
        family, name, motion = self._families[mechanism.name], mechanism.name, self._motions[mechanism.name]
        rotating = {"crank": self._domain == "rotation"}
        for velocity in family.velocities:
            rotating[velocity.name] = velocity.rotating
            if f"{name}.{velocity.name}" in needed:
                terms: list[tuple[str, float | Modulus]] = []
                for source, ratio in velocity.terms:
                    modulus = Modulus(ratio.value, ratio.slope, motion) if isinstance(ratio, Ratio) else ratio
                    terms.append((_junction(mechanism, source), modulus))
                builder.sum(f"{name}.{velocity.name}", terms, "rotation" if velocity.rotating else "translation")
        for mass in family.masses:
            what = f"{name}.{mass.velocity}.{'J' if rotating[mass.velocity] else 'm'}_{mass.body}"
            element = I(_free(builder, what), mass.value, part=f"{name}.{mass.body}")
            builder.port(_junction(mechanism, mass.velocity), element)
        for place, force, body in self._weights(mechanism):
            what = _free(builder, f"{name}.{place}.G_{body}")
            builder.port(_junction(mechanism, place), Se(what, force, part=f"weight of {name}.{body}"))

    def _weights(self, mechanism: Mechanism) -> Iterator[tuple[str, float, str]]:
        """Velocity, force (N) along it and body of every weight."""
        gx, gy = self.scene.gravity or (0.0, 0.0)
        for weight in self._families[mechanism.name].weights if self.scene.gravity is not None else ():
            force = weight.mass * (gx * cos(weight.direction) + gy * sin(weight.direction))
            if abs(force) > 1e-15 * weight.mass * (abs(gx) + abs(gy)):
                yield weight.velocity, force, weight.body

    def _load(self, builder: Builder, balance: float, circuit: bool) -> None:
        """Loads, drive, friction, springs and dampers; the motor's own graph, where it has one, in place of its law."""
        scene = self.scene
        for effort in self.efforts:
            if circuit and effort.load is scene.drive and scene.motor is not None:
                from flywheel.components.motors import DC, Synchronous  # only machines with a motor pay for it

                if isinstance(scene.motor, DC | Synchronous):
                    rotorless = replace(scene.motor, inertia=0.0)  # the rotor is an inertia of the scene
                    builder.include(_MOTOR, rotorless.graph()).bond(f"{_MOTOR}.rotor", effort.place.junction)
                    continue
            moving = effort.uses_speed or effort.uses_time
            per_unknown = effort.per_unknown if effort.depends_on_unknown else None
            law = Law(effort, self.motion_of(effort.load.on), per_unknown, moving, effort.sees, effort.acts)
            if balance and effort.depends_on_unknown:
                law = law._replace(effort=partial(_with_unknown, effort, balance), per_unknown=None)
            part = f"{effort.load.path} on {effort.load.on}"
            if effort.load.path == "drive" or effort.load.drag:
                part = effort.load.path
            builder.port(effort.place.junction, Se(effort.path, law, part=part))
        if self.friction is not None:
            law = Law(self.friction, self._crank_motion)
            builder.port(scene.reduction_element, Se(FRICTION, law, part=FRICTION))
        for spring in scene.springs:
            place = self.places[spring.on]
            law = Law(spring_effort(spring, place), self.motion_of(spring.on))
            builder.port(place.junction, C(spring.path, law, part=f"{spring.path} on {spring.on}"))
        for damper in scene.dampers:
            part = f"{damper.path} on {damper.on}"
            builder.port(self.places[damper.on].junction, R(damper.path, damper.coefficient, part=part))

    # -- places ------------------------------------------------------------------------------------------------------

    def _places(self) -> Iterator[tuple[str, Place]]:
        """Every shaft and every port of a mechanism, by name."""
        origin = self.scene.origin
        for name, ratio in self.scene.shafts.items():
            yield name, Place(name, _turned(ratio, origin), 1.0, origin, self._domain == "rotation", shaft=True)
        for mechanism in self.scene.mechanisms:
            family, rate = self._families[mechanism.name], self.scene.shafts[mechanism.shaft]
            rotating = {velocity.name: velocity.rotating for velocity in family.velocities}
            for name, port in family.ports.items():
                junction = f"{mechanism.name}.{port.velocity}"
                place = Place(junction, _displaced(port.position), rate, mechanism.phase, rotating[port.velocity])
                yield f"{mechanism.name}.{name}", place

    def motion_of(self, place: str) -> Motion:
        """Where the laws at a place take their positions from."""
        return self._motions.get(place.partition(".")[0], self._crank_motion) if "." in place else self._crank_motion

    def _motion(self, mechanism: Mechanism) -> Motion:
        family, phase, stroke = self._families[mechanism.name], mechanism.phase, mechanism.stroke

        def position(q: Any, ns: Any, q_anchor: Any) -> Any:
            return family.position(q + phase, ns, q_anchor + phase)

        def along_stroke(q: Any, ns: Any, q_anchor: Any) -> Any:
            """Rounding, and a time step that finds the stroke's end, must not leave it: there may be no position there."""
            psi = np.clip(q + phase, *stroke) if ns is np and stroke is not None else q + phase
            return family.position(psi, ns, q_anchor + phase)

        return Motion(mechanism.shaft, position if stroke is None else along_stroke)


def scene_of(given: Machine | Scene) -> Scene:
    """The scene of a machine, or the one given; a TypeError for anything else."""
    scene = given.scene if isinstance(given, Machine) else given
    if not isinstance(scene, Scene):
        raise TypeError(f"expected a Machine or a Scene (flywheel.load makes one), found {type(given).__name__}")
    return scene


def dead_centres(reduction: Reduction, junction: str, edges: Array, *, solved: bool = False) -> Array:
    """Crank angles at which the velocity of a 1-junction changes sign, between edges inside which it is smooth.

    They are the roots of its influence coefficient. `solved`: the positions are those of a linkage, whose bounds take a
    thousand times as long as a formula's.
    """
    variable = reduction.variable[junction]

    def enclose(lo: Array, hi: Array, anchor: Array) -> tuple[Any, Any]:
        flows = reduction.flows(Interval(lo, hi), anchor, INTERVALS)
        return flows.gain[variable], flows.slope[variable]

    def value(phi: Array, anchor: Array) -> Any:
        return reduction.flows(phi, anchor).gain[variable]

    return roots_in_pieces(enclose, value, edges, _MOST_SOLVED if solved else CELL_CAP)[1:-1]


def merged(angles: Iterable[float], cycle: float) -> Array:
    """Ascending angles without those that only rounding tells apart; 0 and the cycle stay exact."""
    ascending = np.sort(np.array(list(angles)))  # np.unique would import numpy.ma
    near = 8 * np.finfo(float).eps * cycle
    inner = ascending[(ascending > near) & (ascending < cycle - near)]
    apart = np.diff(inner, prepend=-1.0) > near
    return np.concatenate(([0.0], inner[apart], [cycle]))


def _unresolved(effort: Effort, error: SwitchingError) -> SceneError:
    """What keeps an expression from being resolved over the cycle, or the stroke."""
    span, origin = ("stroke", effort.place.phase) if effort.load.once else ("cycle", 0.0)
    found = str(SwitchingError(error.text, error.near + origin))
    return SceneError([Fault(effort.path, found, f"an expression that can be followed over the {span}")])


def _free(builder: Builder, name: str) -> str:
    """The name, or with a number behind it where a body has more of a kind at one place."""
    numbered = (f"{name}_{k}" for k in count(2))
    return name if name not in builder else next(other for other in numbered if other not in builder)


def _with_unknown(effort: Effort, value: float, here: Here, anchor: Here) -> Any:
    return effort(here, anchor) + value * effort.per_unknown(here, anchor)


def _junction(mechanism: Mechanism, velocity: str) -> str:
    return mechanism.shaft if velocity == "crank" else f"{mechanism.name}.{velocity}"


def _turned(ratio: float, origin: float = 0.0) -> Callable[[Here], Any]:
    return lambda here: ratio * (here.q + origin) if origin else ratio * here.q


def _displaced(position: Callable[[Any], Any]) -> Callable[[Here], Any]:
    return lambda here: position(here.position)
