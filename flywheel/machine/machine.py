"""From a scene to its machine: loads as laws of position, the bond graph, and the angles between which everything is smooth.

Breakpoints and steep places come from proven bounds (intervals) of positions, influence coefficients and expressions,
computed through the same bond graph; nothing is sampled. Only scenes with expressions, or loads that act in one direction,
need it.
"""

from __future__ import annotations

import hashlib
import pickle
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import cache, cached_property, partial
from itertools import chain, count
from numbers import Real
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from bondgraph.elements import C, Here, I, Law, Modulus, Motion, R, Se, Sf
from bondgraph.graph import BondGraph, Builder
from bondgraph.numerics import uncounted
from bondgraph.reduction import Reduced, Reduction
from flywheel.language import text as _
from flywheel.machine.loads import EffortPlace, FrictionCurve, LoadLaw, Senses, crank_angles, moving_switches, spring_effort
from flywheel.mechanisms import families
from flywheel.mechanisms.families import Port, Ratio
from flywheel.numerics import notebook
from flywheel.numerics.cells import merged, middles
from flywheel.numerics.expressions import BOOLEAN, Expression, walk
from flywheel.numerics.faults import Fault, SceneError
from flywheel.numerics.intervals import NAMESPACE as INTERVALS
from flywheel.numerics.intervals import Interval
from flywheel.numerics.jets import Jet
from flywheel.numerics.switching import (
    CELL_CAP,
    Enclosures,
    SwitchingError,
    Values,
    branching,
    breakpoints,
    resolved,
    roots_in_pieces,
)
from flywheel.scene.scene import TURN, Mechanism, Scene, Table

if TYPE_CHECKING:
    from flywheel.components.motors.motor import Circuit

__all__ = ["FLYWHEEL", "FRICTION", "Machine", "MeshStage"]

Array = NDArray[np.float64]
Angles = TypeVar("Angles")

DRIVE = "drive."  # how the names of the drive's elements begin
FLYWHEEL = "the flywheel"  # whose part its inertia is
FRICTION = "friction in joints"  # whose part its moment is
SPEED = "speed of the driver"  # whose part its source is
_MOTOR = "drive.motor"  # the name of its graph as a part

WIDEST = TURN / 4  # of a cell, in the angle of the fastest mechanism: 21 nodes then resolve plain sines to rounding
_END = 1e-12  # of a cycle: tolerance of an angle at its ends
_CLOSEST = 1e-7  # of a cycle, between two restarts of the time stepping that are no breakpoints
_LOOKED_AT = np.linspace(0.01, 0.99, 33)  # of a cycle or stroke, where moments and inertias tell a speed
_INWARDS = 1e-9  # of the way to the middle of a piece: a place close to an angle, in its piece
_KEPT_MACHINES = 128  # and mechanisms, of which the angles are kept at which they break
_MOST_SOLVED = 4_000  # cells in which a linkage's dead centres are searched for; a stroke without a dwell takes 32

_marks: dict[bytes, dict[str, Any]] = {}  # breakpoints, landmarks and senses of the last machines, by their `breaks`


class MeshStage(NamedTuple):
    """Part of the machine behind a mesh of an efficiency without further loss (1: the crank itself), reduced to the crank.

    `near` is the place, among the machine's stages, of the one with which it meshes, which precedes it.
    """

    shaft: str
    near: int
    efficiency: float
    carries_flywheel: bool
    drives: bool
    reduction: Reduction


class Anchor(NamedTuple):
    """Point at which branches are decided: a position (rad), a crank speed (rad/s) and a time (s) in a smooth stretch.

    Without a speed and a time those that depend on them are decided at every instant itself.
    `factors` are those of the meshes there (see `Instant`); None if they are to be computed at every instant. `sides` are
    signs in rough joints there, (..., 3 actions): of their rates, against which friction acts, and of the forces
    that it follows, then directions (rad) of those in pins that keep to a line (else NaN); None if they are to be computed
    at every instant. `direction` is that of the motion: 1, -1, or 0 for a machine held at rest by dry laws; None where it is
    the sign of the speed at every instant.
    """

    phi: Any
    omega: Any
    time: Any
    factors: tuple[Any, ...] | None = None
    sides: Array | None = None
    direction: Any = None

    def sense(self, omega: Any) -> Any:
        """The direction of the motion at crank speeds."""
        if self.direction is not None:
            return self.direction
        return np.sign(omega if self.omega is None else self.omega)


class Machine:
    """A machine of one degree of freedom: its scene, its bond graph, and its breakpoints (crank angles).

    Its coordinate runs from 0 to the cycle. On a stroke it is the driver's travel from the start of the stroke, so that the
    scene's `origin` added to it gives the driver's own coordinate, and the reduction element `slide` stands for the crank
    where that driver slides: I* is then a mass m* (kg), M* a force F* (N), and angles are lengths (m).

    `graph` is the physical chain of transformers from the crank; `reduction` evaluates it. `omitted` lists parts that the
    scene names but the machine does not need (bodies without mass and loads, shafts without load).

    `friction` is the moment of friction in the joints, if it is known: it follows from the forces in a regime, so that
    `flywheel.regime.joint_friction` computes it and gives the machine with it. A machine is pickled as its scene and that
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
        self._motions = {m.name: Motion(m.shaft, partial(self._position, m)) for m in scene.mechanisms}
        self._crank_motion = Motion(scene.reduction_element)
        self._domain = "translation" if scene.reduction_element == "slide" else "rotation"
        self.places = dict(self._places())
        senses = cache(lambda place: self._mark(place, partial(self._senses, place), of_loads=False))
        loads = (*scene.loads, *([] if scene.drive is None else [scene.drive]))
        self.efforts = tuple(
            LoadLaw(load, self.places[load.on], scene.parameters, scene.unknown, partial(senses, load.on)) for load in loads
        )
        self.graph = self._graph()
        self.kept: dict[str, Any] = {}  # what other modules evaluate of it, and keep with it

    def __reduce__(self) -> tuple[Any, ...]:
        return Machine, (self.scene, self.friction)

    def with_requirements(self, scene: Scene) -> Machine:
        """The same machine, with all that is known of it, for a scene that differs in its requirements alone."""
        vars(machine := Machine.__new__(Machine)).update(vars(self), scene=scene)
        return machine

    def __repr__(self) -> str:
        """Names the mechanisms, bonds and shafts instead of an address."""
        kinds = dict.fromkeys(m.type for m in self.scene.mechanisms) or ("rotor",)
        title = notebook.quoted(self.scene.title)
        return f"Machine({title}{', '.join(kinds)}, {len(self.graph.bonds)} bonds, shafts {', '.join(self.scene.shafts)})"

    _repr_html_ = notebook.html

    def reduce(self, phi: Any, anchor: Any = None) -> Reduced:
        """I*, dI*/dphi, M* at crank angles phi (rad) in [0, cycle], straight from the bond graph.

        `anchor` (same shape, or broadcastable) is an angle inside the smooth piece that each phi belongs to.
        """
        return self.reduction(phi, self.anchors(phi) if anchor is None else anchor)

    def anchors(self, phi: Any) -> Any:
        """The middle of each angle's smooth piece (at a breakpoint: of the next); beside the angle if speeds switch laws."""
        middle = middles(self.breakpoints, phi)
        return phi + _INWARDS * (middle - phi) if self.switches_at_speeds else middle

    @cached_property
    def is_dry(self) -> bool:
        """Tests whether friction may hold it at rest: laws that jump with the direction, lossy meshes, rough joints."""
        return self.has_joint_friction or len(self.stages) > 1 or any(effort.is_dry for effort in self.efforts)

    @cached_property
    def backwards(self) -> Machine:
        """The same machine with its laws for a crank that turns backwards; itself if none differs."""
        if not any(effort.reverses for effort in self.efforts):
            return self
        machine = Machine(self.scene, self.friction)
        machine.__dict__["backwards"] = self
        machine.efforts = tuple(effort.backwards() for effort in self.efforts)
        machine.graph = machine._graph()
        return machine

    @property
    def switches_at_speeds(self) -> bool:
        """Tests whether some branch of a load depends on speed or time."""
        return any(self.switching)

    @cached_property
    def jumps_at_speeds(self) -> bool:
        """Tests whether a load may jump at a speed, by a condition or a sign; a motor only has another slope."""
        laws = [effort.load.law for effort in self.efforts if effort.path != "drive.motor"]
        nodes = [node for law in laws if isinstance(law, Expression) for node in walk(law.tree)]
        tests = [node.args[0] if node.op == "if" else node for node in nodes if node.op in ("if", "sign", *BOOLEAN)]
        return any(Expression("", test).uses_speed for test in tests)

    @cached_property
    def switching(self) -> tuple[dict[str, LoadLaw], ...]:
        """The loads of every stage of which some branch depends on speed or time, by their paths."""
        laws = {effort.path: effort.load.law for effort in self.efforts if effort.uses_speed or effort.uses_time}
        paths = [path for path, law in laws.items() if isinstance(law, Expression) and moving_switches(law)]
        efforts = {effort.path: effort for effort in self.efforts if effort.path in paths}
        return tuple({p: efforts[p] for p in stage.reduction.moving if p in efforts} for stage in self.stages)

    @cached_property
    def reduction(self) -> Reduction:
        """The graph compiled for the crank's angle; a SceneError if shafts twist, so that one angle is not enough."""
        if not self.scene.compliances:
            return self.rigid
        defect = "a compliant shaft, with which the motion has several angles"
        expected = "rigid shafts, to reduce everything to the crank's angle"
        advice = "leave stiffness out to size with a rigid shaft, then follow the compliant machine with flywheel.simulate"
        raise SceneError([Fault(f"shafts.{name}.stiffness", defect, expected, advice) for name in self.scene.compliances])

    @cached_property
    def rigid(self) -> Reduction:
        """The machine with rigid shafts, which gives the angles at which loads and ratios break."""
        graph = self._graph(rigid=True) if self.scene.compliances else self.graph
        return Reduction(graph, self.scene.reduction_element)

    @cached_property
    def kinematics(self) -> Reduction:
        """The chain without loads, with every shaft and port, also those that the model leaves out."""
        return Reduction(self._graph(bare=True, rigid=True), self.scene.reduction_element)

    @cached_property
    def stages(self) -> tuple[MeshStage, ...]:
        """The crank and the shafts connected to it without loss, then every shaft whose mesh has losses, nearer first."""
        scene = self.scene
        lossy = [name for name in scene.shafts if scene.efficiencies.get(name, 1.0) < 1.0]
        if not lossy:
            return (MeshStage("crank", 0, 1.0, True, True, self.reduction),)
        mine: dict[str, set[str]] = {shaft: set() for shaft in ("crank", *lossy)}
        for shaft, names in self.one_ports.items():
            mine[self.stage_of(shaft)] |= names
        flywheel = self.stage_of(scene.flywheel_on)
        drive = self.stage_of(scene.drive.on) if scene.drive is not None else "crank"
        return tuple(
            MeshStage(
                shaft=shaft,
                near=list(mine).index(self.stage_of(scene.near(shaft))),
                efficiency=scene.efficiencies.get(shaft, 1.0),
                carries_flywheel=flywheel == shaft,
                drives=drive == shaft,
                reduction=self.reduction.part(names),
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
        """The names of the graph's inertias, sources, springs and dampers by their shaft."""
        shafts = {mechanism.name: mechanism.shaft for mechanism in self.scene.mechanisms}
        by_shaft: dict[str, set[str]] = {}
        for name, element in self.graph.elements.items():
            if element.kind not in ("0", "1", "TF", "GY"):
                junction = self.graph.bond_of(name).other(name)
                owner = junction.partition(".")[0]
                by_shaft.setdefault(junction if junction in self.scene.shafts else shafts.get(owner, owner), set()).add(name)
        return by_shaft

    def with_values(self, balance: float, flywheel: float, *, moved: bool = False) -> BondGraph:
        """The graph with a value (SI) for the scene's unknown, a flywheel (kg m²) on its shaft, and its motor's circuit.

        moved: a source of flow moves the driver, at unit speed, and with it every shaft and port: causality of parts without
        inertia then follows from that.
        """
        return self._graph(balance=balance, flywheel=flywheel, circuit=True, moved=moved)

    def where(self, phi: float) -> str:
        """A position of the machine in words: `crank angle 30 deg`, or `slide position 0.19 m`."""
        at = phi + self.scene.origin
        return f"slide position {at:.6g} m" if self._domain == "translation" else f"crank angle {np.degrees(at):.6g} deg"

    @property
    def keeps_step(self) -> bool:
        """Tests whether a synchronous motor holds the mean speed, whatever the load."""
        motor = self.scene.motor
        return motor is not None and motor.circuit is not None and motor.circuit.only_speed is not None

    @cached_property
    def depends_on_speed(self) -> bool:
        """Tests whether a load, the drive or a damper depends on speed."""
        return self.scene.depends_on_speed

    @cached_property
    def depends_on_time(self) -> bool:
        """Tests whether a load or the drive depends on time."""
        return any(effort.uses_time for effort in self.efforts)

    @property
    def typical_speed(self) -> float:
        """A speed (rad/s, m/s) about which the machine runs: the required one, that of its idle motor, or by its loads."""
        scene = self.scene
        if scene.stroke is not None:
            return abs(scene.stroke.speed or 0.0) or self._speed_by_loads
        if scene.speed is None and scene.motor is not None and scene.drive is not None:
            return (scene.motor.no_load_speed or 1.0) / scene.shafts[scene.drive.on]
        return scene.speed or self._speed_by_loads

    @property
    def motor_speeds(self) -> list[Any]:
        """Characteristic speeds of the motor (rad/s, of the crank): without load, ends of its running branch, rated."""
        motor, drive = self.scene.motor, self.scene.drive
        if motor is None or drive is None:
            return []
        speeds = [motor.no_load_speed, *(motor.stable or ()), *([motor.rated.speed] if motor.rated else ())]
        return [w / self.scene.shafts[drive.on] for w in speeds if w is not None and 0.0 < w < np.inf]

    @cached_property
    def _speed_by_loads(self) -> float:
        """The speed that the greatest moment gives the greatest inertia over a cycle or stroke, sqrt(2 M* phi/I*).

        1 if loads depend on speed, for which a speed is searched for about that, or if there is no such moment.
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
        """Tests whether the moment depends on more than position, so that the motion must be solved for: speeds, losses."""
        return self.scene.depends_on_speed or len(self.stages) > 1

    def family(self, mechanism: Mechanism) -> families.Family:
        """One of its mechanisms as a chain of velocities, with its masses, weights, ports and positions."""
        return self._families[mechanism.name]

    @property
    def omitted(self) -> tuple[str, ...]:
        """Velocities that the model leaves out because no element and no other velocity depends on them."""
        chains = self._families.items()
        inner = [f"{name}.{velocity.name}" for name, family in chains for velocity in family.velocities]
        return tuple(name for name in (*self.scene.shafts, *inner) if name not in self.graph.elements)

    @property
    def pivoted(self) -> dict[str, tuple[str, float]]:
        """Points of bodies on a fixed pivot, whose velocity is their tangential speed: the turning body, and radius (m)."""
        pivots = {}
        for mechanism in self.scene.mechanisms:
            velocities = {velocity.name: velocity for velocity in self._families[mechanism.name].velocities}
            for name, velocity in velocities.items():
                source, ratio = velocity.terms[0]
                if f"{name}.x" in velocities and isinstance(ratio, (float, Real)):
                    turning = mechanism.shaft if source == "crank" else f"{mechanism.name}.{source}"
                    pivots[f"{mechanism.name}.{name}"] = (turning, float(ratio))
        return pivots

    # -- breakpoints -------------------------------------------------------------------------------------------------

    @cached_property
    def breakpoints(self) -> Array:
        """Crank angles (rad) from 0 to the cycle between which every load and ratio is smooth."""
        return self._mark("breakpoints", lambda: self._with_switches(self._unswitched))

    @cached_property
    def switches(self) -> Array:
        """The breakpoints at which a law switches, with 0 and the cycle; at the others a cell ends only for resolution."""
        own = (0.0, self.scene.cycle, *(angle for _, angle in self._own_breakpoints(switching=True)))
        return self._mark("switches", lambda: self._with_switches((*own, *self.breakpoints[self._branching])))

    def _with_switches(self, edges: Iterable[float]) -> Array:
        return merged([*edges, *(angle for _, angle in self._switch_angles(self._unswitched))], self.scene.cycle)

    @cached_property
    def switches_at_ends(self) -> bool:
        """True if a law switches at the beginning of the cycle, and so at its end."""
        near, cycle = _END * self.scene.cycle, self.scene.cycle
        at_ends = any(not near < angle < cycle - near for _, angle in self._own_breakpoints(switching=True))
        return self.scene.stroke is None and bool(at_ends or self._branching[0])

    @cached_property
    def _branching(self) -> NDArray[np.bool_]:
        """Tests at which breakpoints a branch of a load's expression changes, also where a cell ends for resolution."""
        edges, changes = self.breakpoints, np.zeros(self.breakpoints.size, dtype=bool)
        for effort in self.efforts:
            if isinstance(effort.load.law, Expression):
                changes |= branching(effort.load.law, edges, self._environment(effort)[1])
        return changes

    @cached_property
    def landmarks(self) -> Array:
        """The breakpoints, and edges around narrow features of expressions.

        Cells are added wherever a load's expression is too steep for the cell that it lies in; laws that depend on speed are
        taken at the machine's typical one. An expression that is infinite at the end of a cell is refused; one that is not
        defined there is not.
        """
        return self._mark("landmarks", self._all_landmarks)

    def _all_landmarks(self) -> Array:
        edges = self.breakpoints
        for effort in self.efforts:
            law, lo, hi = effort.load.law, edges[:-1], edges[1:]
            if not isinstance(law, Expression) or not (effort.reads_position or self._infinite(effort)):
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
                        values_there = law.evaluate(values(ends, middle), np, values(middle, middle)) + 0.0 * ends
                    if (np.abs(values_there) == np.inf).any():
                        at = int((np.abs(values_there) == np.inf).argmax())
                        reason = self.undefined(effort.path, ends[at], middle[at])
                        where = "phi = {near}" if effort.load.once else f"crank angle {np.degrees(ends[at]):.6g} deg"
                        raise SwitchingError(f"a value that is not finite at {where} ({reason})", float(ends[at]))
                splits = resolved(law, lo, hi, enclosures, values)
            except SwitchingError as error:
                raise _unresolved(effort, error) from None
            edges = np.array(sorted({*edges.tolist(), *splits.tolist()}))
        return edges

    def _mark(self, name: str, solved: Callable[[], Angles], *, of_loads: bool = True) -> Angles:
        """Angles of the machine, from an earlier one that breaks alike: most numbers leave them as they are."""
        marks = _marks.setdefault(self.breaks if of_loads else self._geometry, {})
        if name not in marks:
            with uncounted():
                marks[name] = solved()
        for oldest in list(_marks)[:-_KEPT_MACHINES]:
            _marks.pop(oldest, None)
        angles: Angles = marks[name]
        return angles

    @cached_property
    def _geometry(self) -> bytes:
        """A digest of what decides where places reverse: mechanisms without masses, their shafts, what their laws read."""
        scene = self.scene
        mechanisms = [mechanism.unweighed() for mechanism in scene.mechanisms]
        shafts = [scene.shafts[mechanism.shaft] for mechanism in mechanisms]
        parts: list[Any] = [mechanisms, shafts, scene.reduction_element, scene.cycle, scene.origin, scene.stroke]
        laws = [output.law for mechanism in scene.mechanisms for output in mechanism.outputs]
        named = frozenset[str]().union(*(law.names for law in laws if isinstance(law, Expression)))
        parts += sorted((name, value) for name, value in scene.parameters.items() if name in named)
        return hashlib.sha256(pickle.dumps(parts)).digest()

    @cached_property
    def breaks(self) -> bytes:
        """A digest of what decides breakpoints and landmarks: machines with equal ones have equal ones."""
        parts: list[Any] = [self._geometry, self.friction]
        for effort in self.efforts:
            law, place, load = effort.load.law, effort.place, effort.load
            free = effort.always and isinstance(law, Expression) and not effort.reads_position
            load = load if isinstance(law, Table) else load._replace(law=None, model="", quantities=(), factor=1.0)
            parts += [load._replace(every=0.0), 0.0 if free else load.every, 0.0 if free else place.rate]
            parts += [place.rate / load.every, place.phase / load.every]  # a period may break all the same
            if isinstance(law, Expression) and effort.reads_position:
                used = sorted((name, value) for name, value in effort.constants.items() if name in law.names)
                parts += [law.tree, used, self.typical_speed if effort.uses_speed else None]
            elif isinstance(law, Expression):
                parts.append(self._infinite(effort))
        return hashlib.sha256(pickle.dumps(parts)).digest()

    def _infinite(self, effort: LoadLaw) -> bool:
        """Tests whether a law that reads no position is infinite at the machine's typical speed."""
        names = self._names(effort)(0.0, 0.0, np)
        with np.errstate(all="ignore"):
            return bool(np.isinf(effort.load.law.evaluate(names, np, names)).any())  # type: ignore[union-attr]

    @cached_property
    def restarts(self) -> Array:
        """Angles at which time stepping restarts: the landmarks without those too close to be distinct in time."""
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
        """The number of breakpoints inside the cycle from each mechanism, load or other source, by its name or path."""
        breakpoints = self.breakpoints[1:-1]
        near = 1e-9 * self.scene.cycle
        causes: dict[str, set[int]] = {}
        for name, angle in (*self._own_breakpoints(), *self._switch_angles(self._unswitched)):
            hit = np.flatnonzero(np.abs(breakpoints - angle) <= near)
            causes.setdefault(name, set()).update(hit.tolist())
        return {name: len(places) for name, places in causes.items() if places}

    @cached_property
    def _unswitched(self) -> Array:
        """The breakpoints except for the angles at which expressions switch."""
        return merged([0.0, self.scene.cycle, *(angle for _, angle in self._own_breakpoints())], self.scene.cycle)

    def corners_of(self, mechanism: Mechanism) -> tuple[float, ...]:
        """Positions of a mechanism's own driver (rad or m) at which it is not smooth, or near a lock."""
        return tuple(self._families[mechanism.name].breakpoints)

    @property
    def has_joint_friction(self) -> bool:
        """Tests whether joints rub whose friction follows the actual motion: it is not given as a moment of position."""
        return self.scene.rubs and self.friction is None

    def _own_breakpoints(self, *, switching: bool = False) -> Iterator[tuple[str, float]]:
        """Yields sources and their breakpoints; with `switching` those alone at which a law switches."""
        yield from self._mechanism_breakpoints(switching=switching)
        if self.friction is not None:
            yield from ((FRICTION, angle) for angle in self.friction.breakpoints)
        for effort in self.efforts:
            yield from ((effort.path, angle) for angle in effort.crank_breakpoints(self.scene.cycle, switching=switching))

    def _mechanism_breakpoints(self, *, switching: bool = False) -> Iterator[tuple[str, float]]:
        """Yields names of mechanisms and their breakpoints; with `switching` those alone at which a law switches."""
        for mechanism in self.scene.mechanisms:
            place = EffortPlace("", _turned(1.0), self.scene.shafts[mechanism.shaft], mechanism.phase)
            family = self._families[mechanism.name]
            for angle in family.switches if switching else family.breakpoints:
                if mechanism.stroke is not None:
                    yield mechanism.name, angle - mechanism.phase
                else:
                    for position in crank_angles(angle, mechanism.period, place, self.scene.cycle):
                        yield mechanism.name, position

    def _switch_angles(self, edges: Array) -> Iterator[tuple[str, float]]:
        """Crank angles at which a branch of a load's expression changes, beside those known already."""
        for effort in self.efforts:
            law = effort.load.law
            if isinstance(law, Expression) and (law.switches() or law.branch_points()):
                try:
                    angles = breakpoints(law, 0.0, float(edges[-1]), *self._environment(effort), edges)
                except SwitchingError as error:
                    raise _unresolved(effort, error) from None
                yield from ((effort.path, angle) for angle in angles)

    def _senses(self, place: str) -> Senses:
        """Ranges in which a place moves forwards and backwards, in closed form or by roots of its influence coefficient.

        Between two dead centres of a closed form the port goes from its place at one to that at the next.
        """
        name, _, port = place.partition(".")
        cycle, at = self.scene.cycle, self.places[place]
        own_port: Port | None = self._families[name].ports[port] if port else None
        if self.scene.stroke is None and own_port is not None and own_port.dead_centres:
            local = np.array(own_port.dead_centres)
            position = np.array([own_port.position(self._families[name].position(psi, np)) for psi in own_port.dead_centres])
            signs = np.sign(np.roll(position, -1) - position)
            angles = np.sort(crank_angles(local, TURN, at, cycle))
            edges = np.concatenate(([0.0], angles, [cycle]))
            psi = (at.rate * 0.5 * (edges[1:] + edges[:-1]) + at.phase) % TURN
            return Senses(angles, signs[np.searchsorted(local, psi) - 1])
        own = (angle for _, angle in self._mechanism_breakpoints())
        try:
            angles = self._dead_centres(place, merged([0.0, cycle, *own], cycle))
        except SwitchingError:
            path = next(effort.load.path for effort in self.efforts if effort.load.on == place)
            what = f"{place}, whose velocity changes sign too often to follow, as if it stood still"
            raise SceneError([Fault(path, what, "a place that moves", "leave `while` and v out there")]) from None
        edges = np.concatenate(([0.0], angles, [cycle]))
        halfway = 0.5 * (edges[1:] + edges[:-1])
        gain = self.kinematics.flows(halfway, halfway).gain[self.kinematics.variable[at.junction]]
        return Senses(angles, np.broadcast_to(np.sign(gain), halfway.shape))

    def _dead_centres(self, place: str, smooth: Array) -> Array:
        """Crank angles between smooth pieces' edges at which a place reverses, where no closed form gives them."""
        solved = any(mechanism.linkage is not None for mechanism in self.scene.mechanisms)
        return dead_centres(self.kinematics, self.places[place].junction, smooth, solved=solved)

    def undefined(self, path: str, phi: float, anchor: float, speed: float | None = None, time: float = 0.0) -> str:
        """The term that is not finite in the expression of a load, by its path, at a position, in words; or an empty text.

        At a crank angle (rad) in the piece of an anchor, a speed (rad/s; None: the typical one) and a time (s).
        """
        effort = next((effort for effort in self.efforts if effort.path == path), None)
        if effort is None or not isinstance(effort.load.law, Expression):
            return ""
        with np.errstate(all="ignore"):
            values = self._environment(effort, speed)[1]
            here, middle = np.asarray(phi), np.asarray(anchor)
            return effort.load.law.undefined({**values(here, middle), "t": time}, {**values(middle, middle), "t": time})

    def _environment(self, effort: LoadLaw, speed: float | None = None) -> tuple[Enclosures, Values]:
        """Values of the names in a load's expression: jets of intervals over cells of phi, and plain values."""
        names = self._names(effort, speed)
        return (
            lambda lo, hi, anchor: names(Interval(lo, hi), anchor, INTERVALS),
            lambda phi, anchor: names(phi, anchor, np),
        )

    def _names(self, effort: LoadLaw, speed: float | None = None) -> Callable[[Any, Any, Any], Mapping[str, Any]]:
        """A function from crank angles, their anchors and a namespace to the values of the names in a load's expression.

        They are jets by the crank's angle, but plain values in numpy's. The anchor decides the turn of the load's angle,
        because rounding could not at the end of a turn. The crank's `speed` (rad/s) is the machine's typical one
        if none is given.
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
            symbols = {**effort.constants, "omega": own_speed, "t": 0.0, "phi": Jet(angle, place.rate) if bounds else angle}
            if "v" in names and effort.senses is not None:
                symbols["v"] = effort.senses.at(anchor)
            needs_gain = effort.uses_speed or ("x" in names and bounds)
            gain: Any = reduction.flows(phi, anchor, ns).gain[variable] if needs_gain else 0.0
            if effort.uses_speed:
                symbols["v"] = crank_speed * gain
            if "x" in names:
                x = place.displacement(Here(rate * phi, motion.position(rate * phi, ns, rate * anchor), ns))
                symbols["x"] = Jet(x, gain) if bounds else x
            return symbols

        return environment

    # -- the graph ---------------------------------------------------------------------------------------------------

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
        for mechanism in scene.mechanisms:  # its velocities, as far as they are needed, its masses and their weights
            family, name, motion = self._families[mechanism.name], mechanism.name, self._motions[mechanism.name]
            rotating = {"crank": self._domain == "rotation"}
            for velocity in family.velocities:
                rotating[velocity.name] = velocity.rotating
                if f"{name}.{velocity.name}" in needed:
                    terms: list[tuple[str, float | Modulus]] = []
                    for source, gain in velocity.terms:
                        modulus = Modulus(gain.value, gain.slope, motion) if isinstance(gain, Ratio) else gain
                        terms.append((_junction(mechanism, source), modulus))
                    builder.sum(f"{name}.{velocity.name}", terms, "rotation" if velocity.rotating else "translation")
            for mass in family.masses:
                what = f"{name}.{mass.velocity}.{'J' if rotating[mass.velocity] else 'm'}_{mass.body}"
                inertia = I(_free(builder, what), mass.value, part=f"{name}.{mass.body}")
                builder.port(_junction(mechanism, mass.velocity), inertia)
            for weight, force, _rounded in self._weights[name]:
                what = _free(builder, f"{name}.{weight.velocity}.G_{weight.body}")
                builder.port(_junction(mechanism, weight.velocity), Se(what, force, part=f"weight of {name}.{weight.body}"))
        for item in scene.inertias:
            name, _, port = item.on.partition(".")
            kinks = self._families[name].ports[port].kinks if port else ()
            if kinks:
                defect = f"{item.on}, whose velocity jumps at {np.degrees(kinks[0]):.6g} deg of its mechanism"
                raise SceneError([Fault(f"{item.path}.on", defect, "a port with a continuous velocity", "smooth its law")])
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
        """Junctions at these places, those with elements, and those on the way to them."""
        carrying = {self.places[place].junction for place in places}
        parents: dict[str, tuple[str, ...]] = {name: (self.scene.near(name),) for name in self.scene.transmissions}
        for mechanism in self.scene.mechanisms:
            family = self._families[mechanism.name]
            for v in family.velocities:
                parents[f"{mechanism.name}.{v.name}"] = tuple(_junction(mechanism, term.source) for term in v.terms)
            carrying |= {_junction(mechanism, mass.velocity) for mass in family.masses}
            carrying |= {_junction(mechanism, weight.velocity) for weight, _, _ in self._weights[mechanism.name]}
        todo = list(carrying)
        while todo:
            fresh = [p for p in parents.get(todo.pop(), ()) if p not in carrying]
            carrying.update(fresh)
            todo += fresh
        return carrying

    @cached_property
    def _weights(self) -> dict[str, list[families.WeightForce]]:
        """The weights of each mechanism that do work, with their forces."""
        return {name: list(families.forces_along(f.weights, self.scene.gravity)) for name, f in self._families.items()}

    @cached_property
    def by_directions(self) -> float:
        """Error of M* by rounded directions of weights and their paths over sqrt(I*), sqrt(kg) m/s²."""
        forces = [*chain.from_iterable(self._weights.values())]
        return families.by_directions(forces, self.scene.efficiencies.values()) if forces else 0.0

    def _load(self, builder: Builder, balance: float, circuit: bool) -> None:
        """Loads, drive, friction, springs and dampers; the motor's own graph, if it has one, in place of its law."""
        scene = self.scene
        for effort in self.efforts:
            if circuit and effort.load is scene.drive and scene.motor is not None:
                own = replace(scene.motor, inertia=0.0).graph()  # the rotor is an inertia of the scene
                if own is not None:
                    builder.include(_MOTOR, own).bond(f"{_MOTOR}.rotor", effort.place.junction)
                    continue
            moving = effort.uses_speed or effort.uses_time
            per_unknown = effort.per_unknown if effort.depends_on_unknown else None
            acts = None if effort.always else effort.active
            law = Law(effort, self.motion_of(effort.load.on), per_unknown, moving, effort.dependencies, acts)
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

    def _places(self) -> Iterator[tuple[str, EffortPlace]]:
        """Every shaft and every port of a mechanism, by name."""
        origin = self.scene.origin
        for name, ratio in self.scene.shafts.items():
            yield name, EffortPlace(name, _turned(ratio, origin), 1.0, origin, self._domain == "rotation", shaft=True)
        for mechanism in self.scene.mechanisms:
            family, rate = self._families[mechanism.name], self.scene.shafts[mechanism.shaft]
            rotating = {velocity.name: velocity.rotating for velocity in family.velocities}
            for name, port in family.ports.items():
                junction = f"{mechanism.name}.{port.velocity}"
                displacement = partial(lambda position, here: position(here.position), port.position)
                place = EffortPlace(junction, displacement, rate, mechanism.phase, rotating[port.velocity])
                yield f"{mechanism.name}.{name}", place

    def motion_of(self, place: str) -> Motion:
        """The motion from which the laws at a place take their positions."""
        return self._motions.get(place.partition(".")[0], self._crank_motion) if "." in place else self._crank_motion

    def _position(self, mechanism: Mechanism, q: Any, ns: Any, q_anchor: Any) -> Any:
        """The position of a mechanism where its shaft has turned by q (rad or m) from the start."""
        phase, stroke = mechanism.phase, mechanism.stroke
        # limited to the stroke: beyond it, by rounding or a time step, there may be no position
        psi = np.clip(q + phase, *stroke) if stroke is not None and ns is np else q + phase
        return self._families[mechanism.name].position(psi, ns, q_anchor + phase)


def circuit_of(scene: Scene) -> Circuit | None:
    """The circuit of the drive's motor, if it has states."""
    return None if scene.motor is None else scene.motor.circuit


def scene_of(source: Machine | Scene) -> Scene:
    """The scene of a machine, or the one given; a TypeError for anything else."""
    scene = source.scene if isinstance(source, Machine) else source
    if not isinstance(scene, Scene):
        raise TypeError(f"expected a Machine or a Scene (flywheel.load makes one), found {type(source).__name__}")
    return scene


def dead_centres(reduction: Reduction, junction: str, edges: Array, *, solved: bool = False) -> Array:
    """Crank angles at which the velocity of a 1-junction changes sign, between edges inside which it is smooth.

    They are the roots of its influence coefficient, and the edges at which it jumps from one sign to another. `solved`: the
    positions are those of a linkage, whose bounds take a thousand times as long as a formula's.
    """
    variable = reduction.variable[junction]

    def enclose(lo: Array, hi: Array, anchor: Array) -> tuple[Any, Any]:
        flows = reduction.flows(Interval(lo, hi), anchor, INTERVALS)
        return flows.gain[variable], flows.slope[variable]

    def value(phi: Array, anchor: Array) -> Any:
        return reduction.flows(phi, anchor).gain[variable]

    roots = roots_in_pieces(enclose, value, edges, _MOST_SOLVED if solved else CELL_CAP)
    middle = 0.5 * (roots[1:] + roots[:-1])
    signs = np.broadcast_to(np.sign(value(middle, middle)), middle.shape)
    return np.asarray(roots[1:-1][signs[1:] != signs[:-1]])


def _unresolved(effort: LoadLaw, error: SwitchingError) -> SceneError:
    """The error of an expression that cannot be resolved over the cycle, or the stroke."""
    span, origin = ("stroke", effort.place.phase) if effort.load.once else ("cycle", 0.0)
    defect = str(SwitchingError(error.text, error.near + origin))
    return SceneError([Fault(effort.path, defect, f"an expression that can be followed over the {span}")])


def _free(builder: Builder, name: str) -> str:
    """The name, with a number after it if a body has several of a kind at one place."""
    numbered = (f"{name}_{k}" for k in count(2))
    return name if name not in builder else next(other for other in numbered if other not in builder)


def _with_unknown(effort: LoadLaw, value: float, here: Here, anchor: Here) -> Any:
    return effort(here, anchor) + value * effort.per_unknown(here, anchor)


def _junction(mechanism: Mechanism, velocity: str) -> str:
    return mechanism.shaft if velocity == "crank" else f"{mechanism.name}.{velocity}"


def _turned(ratio: float, origin: float = 0.0) -> Callable[[Here], Any]:
    return lambda here: ratio * (here.q + origin) if origin else ratio * here.q


def graph_with_flywheel(machine: Machine) -> tuple[BondGraph, tuple[str, ...]]:
    """The graph of a machine with its flywheel, a parameter if it is to be sized; and the omissions."""
    loaded = machine.scene
    sized = loaded.irregularity is not None or bool(loaded.limits)
    heavy = [e for e in machine.graph.elements.values() if e.kind == "I"]
    moved = not loaded.has_flywheel and all(element.law == 0.0 for element in heavy)
    graph = machine.graph
    if loaded.stroke is None or moved:  # a flywheel that sizing finds is a parameter without a value
        graph = machine.with_values(0.0, 1.0 if sized else loaded.inertia or 0.0, moved=moved)
        if sized:
            name = next(element.name for element in graph.elements.values() if element.part == FLYWHEEL)
            wheel = I(name, lambda J_flywheel: J_flywheel, part=FLYWHEEL)
            graph = replace(graph, elements={**graph.elements, name: wheel}, parameters={"J_flywheel": None})
    left_out = tuple(
        f"shafts.{name}: losses in its mesh (efficiency {efficiency:g}) are no element of the graph"
        for name, efficiency in loaded.efficiencies.items()
        if efficiency < 1.0
    )
    if moved:
        left_out += ("nothing has inertia: a source of flow moves the driver at unit speed",)
    return graph, left_out


def explanations() -> dict[str, str]:
    """The words that explain the picture of a bond graph, in the language in use, by the English ones."""
    return {
        "translation": _("translation"),
        "rotation": _("rotation"),
        "electric": _("electric"),
        "hydraulic": _("hydraulic"),
        "store in derivative causality": _("store in derivative causality"),
        "signal, without power": _("signal, without power"),
        "transformer": _("transformer"),
        "gyrator": _("gyrator"),
    }
