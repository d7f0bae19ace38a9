"""From a scene to its machine: the bond graph of its transmissions, and the angles between which everything is smooth."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cache, cached_property, partial
from itertools import count
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.builder import Builder, Part
from bondgraph.elements import C, Here, I, Law, Modulus, Motion, R, Se
from bondgraph.graph import BondGraph
from bondgraph.reduction import Reduced, Reduction
from flywheel.components.motors import DC, Motor
from flywheel.machine.loads import Effort, FrictionCurve, Place, Senses, crank_angles, spring_effort
from flywheel.mechanisms import families
from flywheel.mechanisms.families import Family, Port, Ratio
from flywheel.numerics.cells import middles
from flywheel.numerics.expressions import Expression
from flywheel.numerics.faults import Fault, SceneError
from flywheel.scene.scene import TURN, Compliance, Inertia, Mechanism, Scene

__all__ = ["FLYWHEEL", "FRICTION", "Machine", "Stage", "merged"]

Array = NDArray[np.float64]

FLYWHEEL = "the flywheel"  # whose part its inertia is
FRICTION = "friction in joints"  # whose part its moment is
_MOTOR = "drive.motor"  # the name of its graph as a part

_WIDEST = TURN / 4  # of a cell, in the angle of the fastest mechanism: 17 nodes then resolve plain sines to rounding
_CLOSEST = 1e-7  # of a cycle, between two restarts of the time stepping that are no breakpoints


class Stage(NamedTuple):
    """What hangs on the crank through one mesh of an efficiency (1: on the crank itself), reduced to the crank."""

    shaft: str
    efficiency: float
    carries_flywheel: bool
    drives: bool
    reduction: Reduction


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
        self._motions = {m.name: _motion(self._families[m.name], m) for m in scene.mechanisms}
        self._crank_motion = Motion(scene.reduction_element)
        self.places = dict(self._shaft_places()) | dict(self._port_places())
        self.efforts = tuple(self._efforts())
        self.graph = self._graph()

    def __reduce__(self) -> tuple[Any, ...]:
        return Machine, (self.scene, self.friction)

    def reduce(self, phi: Any, anchor: Any = None) -> Reduced:
        """I*, dI*/dphi, M* at crank angles phi (rad) in [0, cycle], straight from the bond graph.

        `anchor` (same shape, or broadcastable) is an angle inside the smooth piece that each phi belongs to.
        """
        return self.reduction(phi, self.anchors(phi) if anchor is None else anchor)

    def anchors(self, phi: Any) -> Any:
        """The middle of the smooth piece that each angle lies in (at a breakpoint: the piece that begins there)."""
        return middles(self.breakpoints, phi)

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
    def rigid(self) -> Reduction:
        """The machine with every shaft held rigid, from which the angles come where loads and ratios break."""
        graph = self._graph(rigid=True) if self.scene.compliances else self.graph
        return Reduction(graph, self.scene.reduction_element)

    @cached_property
    def stages(self) -> tuple[Stage, ...]:
        """The crank with all that hangs on it without loss, then every shaft whose mesh with it has losses."""
        scene, whole = self.scene, self.reduction
        drive = None if scene.drive is None else scene.drive.on
        lossy = [name for name, efficiency in scene.efficiencies.items() if efficiency < 1.0]
        found = []
        for shaft in ("crank", *lossy):
            mine = {name for name in self.graph.elements if self._mesh_of(name, lossy) == shaft}
            reduction = whole if not lossy else Reduction(self.graph, scene.reduction_element, only=mine)
            meant = [name if name in lossy else "crank" for name in (scene.flywheel_on, drive or "")]
            found.append(Stage(shaft, scene.efficiencies.get(shaft, 1.0), meant[0] == shaft, meant[1] == shaft, reduction))
        return tuple(found)

    def _mesh_of(self, element: str, lossy: Sequence[str]) -> str:
        """The shaft with losses through whose mesh an element hangs on the crank; the crank where there is none."""
        graph = self.graph
        if graph.elements[element].kind in ("0", "1", "TF", "GY"):
            return ""
        bond = graph.bond_of(element)
        junction = bond.tail if bond.head == element else bond.head
        name = junction.partition(".")[0]
        shafts = {mechanism.name: mechanism.shaft for mechanism in self.scene.mechanisms}
        shaft = junction if junction in self.scene.shafts else shafts.get(name, name)
        return shaft if shaft in lossy else "crank"

    def with_values(self, balance: float, flywheel: float) -> BondGraph:
        """The graph with a value (SI) for the scene's unknown, a flywheel (kg m²) on its shaft, and its motor's circuit."""
        return self._graph(balance=balance, flywheel=flywheel, circuit=True)

    def where(self, phi: float) -> str:
        """A position of the machine in words: `crank angle 30 deg`, or `slide position 0.19 m`."""
        at = phi + self.scene.origin
        return f"slide position {at:.6g} m" if self._domain == "translation" else f"crank angle {np.degrees(at):.6g} deg"

    def undefined(self, path: str, phi: float, anchor: float, speed: float | None = None, time: float = 0.0) -> str:
        """What leaves the expression of a load, by its path, without a finite value at a position, in words; or nothing."""
        effort = next((effort for effort in self.efforts if effort.path == path), None)
        return "" if effort is None else str(_features().undefined(self, effort, phi, anchor, speed, time))

    @cached_property
    def depends_on_speed(self) -> bool:
        """Whether a load, the drive or a damper depends on speed."""
        return bool(self.scene.dampers) or any(effort.uses_speed for effort in self.efforts)

    @cached_property
    def depends_on_time(self) -> bool:
        """Whether a load or the drive depends on time."""
        return any(effort.uses_time for effort in self.efforts)

    @property
    def typical_speed(self) -> float:
        """A speed of the crank (rad/s) about which the machine runs: the one asked for, or its motor's without load."""
        scene = self.scene
        if scene.stroke is not None:
            return abs(scene.stroke.speed) or 1.0
        if scene.speed is None and scene.motor is not None and scene.drive is not None:
            return (scene.motor.no_load_speed or 1.0) / scene.shafts[scene.drive.on]
        return scene.speed or 1.0

    @cached_property
    def sets_its_speed(self) -> bool:
        """Whether the moment depends on more than position, so that the motion itself must be found: speeds, losses."""
        return self.depends_on_speed or len(self.stages) > 1

    @property
    def omitted(self) -> tuple[str, ...]:
        """Velocities that the model leaves out because nothing hangs on them and nothing is reached through them."""
        chains = self._families.items()
        inner = [f"{name}.{velocity.name}" for name, family in chains for velocity in family.velocities]
        return tuple(name for name in (*self.scene.shafts, *inner) if name not in self.graph.elements)

    @cached_property
    def kinematics(self) -> Reduction:
        """The chain without loads, with every shaft and port: also those that the model leaves out as not needed."""
        return Reduction(self._graph(bare=True, rigid=True), self.scene.reduction_element)

    @cached_property
    def breakpoints(self) -> Array:
        """Crank angles (rad) from 0 to the cycle between which every load and ratio is smooth."""
        known = self._unswitched
        return merged([*known, *(angle for _, angle in self._switch_angles(known))], self.scene.cycle)

    @cached_property
    def landmarks(self) -> Array:
        """The breakpoints, and the edges that close in on narrow features of expressions."""
        edges = self.breakpoints
        for effort in self.efforts:
            if isinstance(effort.load.law, Expression):
                edges = _features().narrowed(self, effort, edges)
        return edges

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
        fastest = max([self.scene.shafts[m.shaft] for m in self.scene.mechanisms], default=0.0)
        counts = np.ceil(np.diff(self.landmarks) * fastest / _WIDEST * (1 - 1e-12)).astype(int).clip(1)
        start, steps = np.repeat(self.landmarks[:-1], counts), np.repeat(np.diff(self.landmarks) / counts, counts)
        first = np.repeat(np.cumsum(counts) - counts, counts)
        return np.append(start + (np.arange(start.size) - first) * steps, self.landmarks[-1])

    # -- the graph ---------------------------------------------------------------------------------------------------

    def _graph(
        self,
        *,
        bare: bool = False,
        rigid: bool = False,
        balance: float = 0.0,
        flywheel: float = 0.0,
        circuit: bool = False,
    ) -> BondGraph:
        """The graph; `bare`: every shaft and port, without loads. `rigid`: no shaft twists. `circuit`: of the motor too."""
        element = self.scene.reduction_element
        builder = Builder().one(element, self._domain, displacement="x" if element == "slide" else "phi")
        scene = self.scene
        acting: Iterable[Any] = (*(effort.load for effort in self.efforts), *scene.springs, *scene.dampers, *scene.inertias)
        occupied = {*(item.on for item in acting), *([scene.flywheel_on] * bool(flywheel))}
        needed = self._needed(self.places if bare else occupied)
        for name, ratio in self.scene.shafts.items():
            if name != element and name in needed:
                self._hang_shaft(builder, name, ratio, None if rigid else self.scene.compliances.get(name))
        for mechanism in self.scene.mechanisms:
            self._hang(builder, mechanism, needed)
        for item in self.scene.inertias:
            self._check_inertia(item)
            builder.port(self.places[item.on].junction, I(item.path, item.value, part=f"inertia on {item.on}"))
        if flywheel:
            builder.port(self.scene.flywheel_on, I(_free(builder, "flywheel"), flywheel, part=FLYWHEEL))
        if not bare:
            self._load(builder, balance, circuit)
        if len(builder) == 1:
            builder.port(element, I("nothing", 0.0))
        return builder.build(loose=bare)

    @property
    def _domain(self) -> str:
        """The energy domain of the reduction element."""
        return "translation" if self.scene.reduction_element == "slide" else "rotation"

    def _hang_shaft(self, builder: Builder, name: str, ratio: float, compliance: Compliance | None) -> None:
        if compliance is None:
            builder.sum(name, [("crank", ratio)], "rotation").displacement(f"phi_{name}", name)
            return
        twisting = [C(f"{name}.compliance", stiffness=compliance.stiffness, part=f"twist of {name}")]
        if compliance.damping:
            twisting.append(R(f"{name}.damping", compliance.damping, part=f"twist of {name}"))
        builder.sum(f"{name}.gear", [("crank", ratio)], "rotation")
        builder.one(name, "rotation", displacement=f"phi_{name}")
        builder.between(f"{name}.gear", name, *twisting, name=f"{name}.twist")

    def _hang(self, builder: Builder, mechanism: Mechanism, needed: set[str]) -> None:
        family, name = self._families[mechanism.name], mechanism.name
        for velocity in family.velocities:
            target = f"{name}.{velocity.name}"
            if target in needed:
                terms = [(_junction(mechanism, term.source), self._modulus(name, term.ratio)) for term in velocity.terms]
                builder.sum(target, terms, "rotation" if velocity.rotating else "translation")
        rotating = {"crank": self._domain == "rotation"} | {
            velocity.name: velocity.rotating for velocity in family.velocities
        }
        for mass in family.masses:
            what = f"{name}.{mass.velocity}.{'J' if rotating[mass.velocity] else 'm'}_{mass.body}"
            element = I(_free(builder, what), mass.value, part=f"{name}.{mass.body}")
            builder.port(_junction(mechanism, mass.velocity), element)
        for place, force, body in self._weights(family):
            what = _free(builder, f"{name}.{place}.G_{body}")
            builder.port(_junction(mechanism, place), Se(what, force, part=f"weight of {name}.{body}"))

    def _check_inertia(self, item: Inertia) -> None:
        mechanism, _, port = item.on.partition(".")
        kinks = self._families[mechanism].ports[port].kinks if port else ()
        if kinks:
            found = f"{item.on}, whose velocity jumps at {np.degrees(kinks[0]):.6g} deg of its mechanism"
            raise SceneError([Fault(f"{item.path}.on", found, "a port with a continuous velocity", "smooth its law")])

    def _weights(self, family: Family) -> Iterator[tuple[str, float, str]]:
        if self.scene.gravity is None:
            return
        gx, gy = self.scene.gravity
        for weight in family.weights:
            force = weight.mass * (gx * np.cos(weight.direction) + gy * np.sin(weight.direction))
            if abs(force) > 1e-15 * weight.mass * (abs(gx) + abs(gy)):
                yield weight.velocity, float(force), weight.body

    def _load(self, builder: Builder, balance: float, circuit: bool) -> None:
        motor = _rotorless(self.scene.motor) if circuit else None
        for effort in self.efforts:
            if motor is not None and effort.load is self.scene.drive:
                builder.include(_MOTOR, motor).bond(f"{_MOTOR}.rotor", effort.place.junction)
                continue
            motion = self.motion_of(effort.load.on)
            moving = effort.uses_speed or effort.uses_time
            per_unknown = effort.per_unknown if effort.depends_on_unknown else None
            law = Law(effort, motion, per_unknown, moving, effort.sees, effort.acts)
            if balance and effort.depends_on_unknown:
                law = law._replace(effort=_with_unknown(effort, balance), per_unknown=None)
            part = "drive" if effort.load.path == "drive" else f"{effort.load.path} on {effort.load.on}"
            builder.port(effort.place.junction, Se(effort.path, law, part=part))
        if self.friction is not None:
            law = Law(self.friction, self._crank_motion)
            builder.port(self.scene.reduction_element, Se(FRICTION, law, part=FRICTION))
        for spring in self.scene.springs:
            place = self.places[spring.on]
            law = Law(spring_effort(spring, place), self.motion_of(spring.on))
            builder.port(place.junction, C(spring.path, law, part=f"{spring.path} on {spring.on}"))
        for damper in self.scene.dampers:
            part = f"{damper.path} on {damper.on}"
            builder.port(self.places[damper.on].junction, R(damper.path, damper.coefficient, part=part))

    def _modulus(self, name: str, ratio: float | Ratio) -> float | Modulus:
        return Modulus(ratio.value, ratio.slope, self._motions[name]) if isinstance(ratio, Ratio) else ratio

    def _needed(self, places: Iterable[str]) -> set[str]:
        """Junctions at these places, those that carry something, and those that lead to them."""
        carrying = {self.places[place].junction for place in places}
        parents: dict[str, tuple[str, ...]] = {}
        for mechanism in self.scene.mechanisms:
            family = self._families[mechanism.name]
            parents |= {
                f"{mechanism.name}.{v.name}": tuple(_junction(mechanism, t.source) for t in v.terms)
                for v in family.velocities
            }
            carrying |= {_junction(mechanism, mass.velocity) for mass in family.masses}
            carrying |= {_junction(mechanism, velocity) for velocity, _, _ in self._weights(family)}
        todo = list(carrying)
        while todo:
            fresh = [p for p in parents.get(todo.pop(), ()) if p not in carrying]
            carrying.update(fresh)
            todo += fresh
        return carrying

    # -- places ------------------------------------------------------------------------------------------------------

    def _shaft_places(self) -> Iterator[tuple[str, Place]]:
        for name, ratio in self.scene.shafts.items():
            turned = _turned(ratio, self.scene.origin)
            yield name, Place(name, turned, 1.0, self.scene.origin, self._domain == "rotation", shaft=True)

    def _port_places(self) -> Iterator[tuple[str, Place]]:
        for mechanism in self.scene.mechanisms:
            rate = self.scene.shafts[mechanism.shaft]
            family = self._families[mechanism.name]
            for name, port in family.ports.items():
                junction = f"{mechanism.name}.{port.velocity}"
                rotating = next(v.rotating for v in family.velocities if v.name == port.velocity)
                place = Place(junction, _displaced(port.position), rate, mechanism.phase, rotating)
                yield f"{mechanism.name}.{name}", place

    def motion_of(self, place: str) -> Motion:
        """Where the laws at a place take their positions from."""
        return self._motions.get(place.partition(".")[0], self._crank_motion) if "." in place else self._crank_motion

    def _efforts(self) -> Iterator[Effort]:
        scene, senses = self.scene, cache(self._senses)
        for load in (*scene.loads, *([] if scene.drive is None else [scene.drive])):
            yield Effort(load, self.places[load.on], scene.parameters, scene.unknown, partial(senses, load.on))

    # -- breakpoints -------------------------------------------------------------------------------------------------

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

    def _mechanism_breakpoints(self) -> Iterator[tuple[str, float]]:
        for mechanism in self.scene.mechanisms:
            place = Place("", _turned(1.0), self.scene.shafts[mechanism.shaft], mechanism.phase)
            for angle in self._families[mechanism.name].breakpoints:
                if mechanism.stroke is not None:
                    yield mechanism.name, angle - mechanism.phase
                else:
                    for found in crank_angles(angle, mechanism.period, place, self.scene.cycle):
                        yield mechanism.name, found

    def _own_breakpoints(self) -> Iterator[tuple[str, float]]:
        yield from self._mechanism_breakpoints()
        if self.friction is not None:
            yield from ((FRICTION, angle) for angle in self.friction.breakpoints)
        for effort in self.efforts:
            local, place = effort.local_breakpoints(), effort.place
            once = effort.load.once
            own = local - place.phase if once else crank_angles(local, effort.every, place, self.scene.cycle)
            yield from ((effort.path, angle) for angle in own)
            if effort.senses is not None:
                yield from ((effort.path, angle) for angle in effort.senses.dead_centres)

    @cached_property
    def _unswitched(self) -> Array:
        """The breakpoints but for the angles at which expressions switch."""
        return merged([0.0, self.scene.cycle, *(angle for _, angle in self._own_breakpoints())], self.scene.cycle)

    def _switch_angles(self, known: Array) -> Iterator[tuple[str, float]]:
        for effort in self.efforts:
            if isinstance(effort.load.law, Expression):
                yield from ((effort.path, angle) for angle in _features().switch_angles(self, effort, known))

    def _senses(self, place: str) -> Senses:
        """When a place moves forwards and when backwards, by a closed form, or by the roots of its influence coefficient."""
        name, _, port = place.partition(".")
        known = self._families[name].ports[port] if port else None
        if self.scene.stroke is None and known is not None and known.dead_centres:
            return _alternating(self._families[name], known, self.places[place], self.scene.cycle)
        features = _features()
        from flywheel.numerics.intervals import SwitchingError

        own = (angle for _, angle in self._mechanism_breakpoints())
        smooth = merged([0.0, self.scene.cycle, *own], self.scene.cycle)
        try:
            solved = any(mechanism.linkage is not None for mechanism in self.scene.mechanisms)
            dead_centres = features.dead_centres(self.kinematics, self.places[place].junction, smooth, solved=solved)
        except SwitchingError:
            path = next(effort.load.path for effort in self.efforts if effort.load.on == place)
            found = f"{place}, whose velocity changes sign too often to follow, as if it stood still"
            raise SceneError([Fault(path, found, "a place that moves", "leave `while` and v out there")]) from None
        edges = np.concatenate(([0.0], dead_centres, [self.scene.cycle]))
        halfway = 0.5 * (edges[1:] + edges[:-1])
        gain = self.kinematics.flows(halfway, halfway).gain[self.kinematics.variable[self.places[place].junction]]
        return Senses(dead_centres, np.broadcast_to(np.sign(gain), halfway.shape))


def _alternating(family: Family, port: Port, place: Place, cycle: float) -> Senses:
    """The senses of a port of known dead centres: between two of them it goes from its place at one to the next."""
    known = np.array(port.dead_centres)
    at = port.position(family.position(known, np))
    signs = np.sign(np.roll(at, -1) - at)  # from every dead centre to the next
    dead_centres = np.sort(crank_angles(known, TURN, place, cycle))
    edges = np.concatenate(([0.0], dead_centres, [cycle]))
    psi = (place.rate * 0.5 * (edges[1:] + edges[:-1]) + place.phase) % TURN
    return Senses(dead_centres, signs[np.searchsorted(known, psi) - 1])


def _features() -> ModuleType:
    """What finds the features of expressions: only scenes with expressions pay for intervals."""
    from flywheel.machine import features

    return features


def merged(angles: Iterable[float], cycle: float) -> Array:
    """Ascending angles without those that only rounding tells apart; 0 and the cycle stay exact."""
    ascending = np.sort(np.asarray(list(angles), dtype=float))  # np.unique would import numpy.ma
    near = 8 * np.finfo(float).eps * cycle
    inner = ascending[(ascending > near) & (ascending < cycle - near)]
    apart = np.diff(inner, prepend=-1.0) > near
    return np.concatenate(([0.0], inner[apart], [cycle]))


def _free(builder: Builder, name: str) -> str:
    """The name, or with a number behind it where a body has more of a kind at one place."""
    numbered = (f"{name}_{k}" for k in count(2))
    return name if name not in builder else next(other for other in numbered if other not in builder)


def _rotorless(motor: Motor | None) -> Part | None:
    """A motor's own bond graph, where it has one, without its rotor: that is an inertia of the scene."""
    return replace(motor, inertia=0.0).graph() if isinstance(motor, DC) else None


def _with_unknown(effort: Effort, value: float) -> Callable[[Here, Here], Any]:
    def whole(here: Here, anchor: Here) -> Any:
        return effort(here, anchor) + value * effort.per_unknown(here, anchor)

    return whole


def _motion(family: Family, mechanism: Mechanism) -> Motion:
    phase, stroke = mechanism.phase, mechanism.stroke

    def position(q: Any, ns: Any, q_anchor: Any) -> Any:
        return family.position(q + phase, ns, q_anchor + phase)

    def along_stroke(q: Any, ns: Any, q_anchor: Any) -> Any:
        """Rounding, and a time step that finds the stroke's end, must not leave it: there may be no position there."""
        psi = np.clip(q + phase, *stroke) if ns is np and stroke is not None else q + phase
        return family.position(psi, ns, q_anchor + phase)

    return Motion(mechanism.shaft, position if stroke is None else along_stroke)


def _junction(mechanism: Mechanism, velocity: str) -> str:
    return mechanism.shaft if velocity == "crank" else f"{mechanism.name}.{velocity}"


def _turned(ratio: float, origin: float = 0.0) -> Any:
    def displacement(here: Here) -> Any:
        return ratio * (here.q + origin) if origin else ratio * here.q

    return displacement


def _displaced(position: Any) -> Any:
    def displacement(here: Here) -> Any:
        return position(here.position)

    return displacement
