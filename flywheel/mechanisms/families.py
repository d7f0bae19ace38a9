"""Families of mechanisms: tables, ports, chains of local ratios, locks and joints of each.

A family is one file with a `Kind`, and one line of `flywheel.mechanisms.KINDS` (or `flywheel.mechanisms.register(kind)`).
Its formulas are written once against a namespace `ns` (numpy, mpmath, sympy, or the project's intervals):
`Family.position(psi, ns)` computes the geometry for one angle or an array; everything else uses it. After the
records come parts that chains share, limits where a crank locks, and the ends of a port's stroke.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import chain, pairwise
from math import ceil, degrees, floor, inf, pi, tau
from operator import attrgetter
from types import MappingProxyType
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from bondgraph.recording import NAMESPACE
from flywheel.language import text as _
from flywheel.mechanisms import KINDS
from flywheel.numerics.cells import ROUNDING
from flywheel.numerics.faults import Fault, SceneError
from flywheel.numerics.intervals import NAMESPACE as INTERVALS
from flywheel.numerics.intervals import Interval
from flywheel.numerics.jets import acos, acosh, cos, is_recorded, mapped, present, recorded_in, sin, sqrt
from flywheel.numerics.switching import SwitchingError, followed, roots, solved
from flywheel.scene.scene import BODY, Body, Key, Mechanism, length

Array = NDArray[np.float64]


class Ratio(NamedTuple):
    """A local transmission ratio T(psi) and its slope dT/dpsi, both read from a position."""

    value: Callable[[Any], Any]
    slope: Callable[[Any], Any]


class Term(NamedTuple):
    """One transformer: its source velocity (`crank` is the mechanism's own shaft) and its ratio."""

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

    `returns` is False if the displacement gains a constant each turn, so that no spring can act on it. At `kinks`
    (rad of psi in [0, period)) the velocity jumps, so that it can have no inertia. `dead_centres` are all the angles
    (rad of psi in [0, 2 pi), ascending) at which the velocity changes its sign, where a closed form gives them.
    """

    velocity: str
    position: Callable[[Any], Any]
    returns: bool = True
    kinks: tuple[float, ...] = ()
    dead_centres: tuple[float, ...] = ()


class Family(NamedTuple):
    """One mechanism of a family, for a shaft.

    `position(psi, ns, anchor=None)` gives the positions at the mechanism's own crank angle psi (rad). `anchor` is
    the angle in the middle of the smooth piece that psi lies in, where a law decides its branches (the other
    families ignore it). `breakpoints` are the angles in [0, period) where a cell must end, for smoothness or
    resolution; `switches` are those at which a law switches. The period is a turn, or that of the mechanism's laws.
    """

    velocities: tuple[Velocity, ...]
    masses: tuple[Mass, ...]
    weights: tuple[Weight, ...]
    ports: Mapping[str, Port]
    position: Callable[..., Any]
    breakpoints: tuple[float, ...] = ()
    switches: tuple[float, ...] = ()


class Part(NamedTuple):
    """A table of a mechanism: its geometry, then its masses; `alias` is another name of it."""

    name: str
    about: str
    geometry: tuple[Key, ...] = ()
    body: tuple[Key, ...] = ()
    alias: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        """The name of the part, then its alias."""
        return (self.name, self.alias) if self.alias else (self.name,)

    def name_in(self, table: Container[str]) -> str:
        """The name of the part in a mechanism's table: the alias where the table has the alias alone.

        >>> Part("ground", "the frame", alias="frame").name_in({"type", "frame"})
        'frame'
        """
        return self.alias if self.alias and self.alias in table and self.name not in table else self.name

    @property
    def keys(self) -> tuple[Key, ...]:
        """Every key of the table."""
        return self.geometry + self.body


class Displacement(NamedTuple):
    """A port in words: its name, true if it rotates, and its displacement."""

    name: str
    rotating: bool
    about: str


class Member(NamedTuple):
    """A body of a skeleton: its joints' places in its own frame (m), its angle if known (rad).

    Its centre of mass counts from a line that lies `tilt` (rad) from its own x axis.
    """

    joints: Mapping[str, tuple[float, float]]
    angle: Any = None
    tilt: float = 0.0


class Pin(NamedTuple):
    """A pin between two members."""

    name: str
    first: str
    second: str


class Slide(NamedTuple):
    """A slide of the second member along a line of the first, `direction` (rad) in its frame; its coordinate is `at` (m)."""

    name: str
    first: str
    second: str
    direction: float = 0.0
    at: Any = None


_Corner = tuple[str, str]
Skeleton = tuple[dict[str, Member], tuple[Pin | Slide, ...], tuple[tuple[_Corner, _Corner, _Corner, int], ...]]
"""Members, joints and sides of a mechanism, from which reactions, friction, bodies in motion and pictures are computed.

The first member is the frame, the first joint drives. A joint has the name of its place in both members. Each side is a
point (member, place), then two more on a line, and +1 if the first lies left of it, -1 if it lies right.
"""


ONE = ""
"""The unit of a ratio."""

Arm = tuple[str, str, str, str]
"""Symbols of a line that turns: its length, its angle, the rate of that and its slope."""


class Derivation(Protocol):
    """Positions of a mechanism as books derive them, step by step, at one position: written by a family, kept by a report.

    Formulas are texts of symbols; a prime is the derivative by the mechanism's own coordinate, whose symbol is `driver`.
    """

    mechanism: Mechanism
    position: Any
    driver: str

    def equations(self, *equations: str) -> None:
        """Adds loop equations, which the next steps solve."""

    def part(self, title: str) -> None:
        """Begins a part of the steps."""

    def find(self, of: str, formula: str, unit: str, what: str = "", values: Any = None) -> float:
        """A step, with the library's own value where it has one."""

    def angle(self, of: str, formula: str, what: str, value: float) -> float:
        """An angle that a formula gives up to whole turns."""

    def moves(self, **symbols: str) -> None:
        """Symbols of the displacements of ports, by their names."""

    def pivoted(self, name: str, line: str, velocity: str) -> None:
        """Centre of mass of a body on a fixed pivot, on a line of that body."""

    def floating(self, name: str, line: str, carrier: Arm) -> None:
        """Centre of mass of a body whose first pin stands at the end of an arm."""

    def pinned(self, name: str, title: str, arm: Arm, velocity: str) -> None:
        """A mass at the end of an arm."""


class Kind(NamedTuple):
    """A family of mechanisms with all its data.

    name: the `type` in scenes. about: one line for the reference.
    family: the mechanism as a chain, from its record and the scene's parameters (SI).
    parts, keys: its tables, and its own keys in addition to those of every mechanism; lengths and angles reach
        `Mechanism.geometry` as "PART.KEY", masses reach `Mechanism.bodies`.
    ports: the displacements that loads, springs and inertia may act on.
    locks: the faults of lengths with which it cannot turn, or go through its stroke.
    skeleton: its members and joints, from its record and its position where it starts; without one there is no picture, no
        reaction and no friction. guides: the slide along which a port moves; other ports are members that turn.
    driver: "turns" in cycles, or from one end of a stroke to the other; "slides" along a stroke; or "either".
    lock_angles: the angles in a turn at which a crank that cannot turn fully locks.
    symbols: of its lengths and angles in formulas and dimension lines, by their keys. heights: those measured from
        the x axis.
    derivation: its loop equations, their solution and two derivatives for the report, in its symbols.
    main: motions or joints to show first; its ports in their order if none is named.
    nouns: usual names of its bodies in addition to those of its tables, which pictures translate.
    smooth: true if a mechanism moves without jumps of acceleration within its period.
    starter: a scene to begin with as TOML, of a family that has no file among `flywheel.starters`.
    """

    name: str
    about: str
    family: Callable[[Mechanism, Mapping[str, float]], Family]
    parts: tuple[Part, ...] = ()
    keys: tuple[Key, ...] = ()
    ports: tuple[Displacement, ...] = ()
    locks: Callable[[Mechanism], list[Fault]] | None = None
    skeleton: Callable[[Mechanism, Any], Skeleton] | None = None
    guides: Mapping[str, str] = MappingProxyType({})
    driver: str = "turns"
    lock_angles: Callable[[Mechanism], list[float]] | None = None
    symbols: Mapping[str, str] = MappingProxyType({})
    heights: tuple[str, ...] = ()
    derivation: Callable[[Derivation], None] | None = None
    main: tuple[str, ...] = ()
    nouns: tuple[str, ...] = ()
    smooth: Callable[[Mechanism], bool] = lambda _: True
    starter: str = ""

    @property
    def all_nouns(self) -> tuple[str, ...]:
        """Names of its bodies that pictures translate."""
        return (*self.nouns, *(part.name for part in self.parts))

    @property
    def default_curves(self) -> tuple[str, ...]:
        """Names of motions or joints, one of which is shown by default."""
        return self.main or tuple(self.guides.get(port.name, port.name) for port in self.ports)


def has_joints(mechanism: Mechanism) -> bool:
    """Tests whether the members and joints of a mechanism are known, so that it has reactions and a picture."""
    return mechanism.linkage is not None or KINDS[mechanism.type].skeleton is not None


def build(mechanism: Mechanism, parameters: Mapping[str, float] = MappingProxyType({})) -> Family:
    """The mechanism as a chain of velocities with positions; `parameters` (SI) are in scope of a law's expressions.

    Raises `SceneError` for a mechanism that cannot turn: each fault names the length's path and the angles of the crank
    where it locks. On a stroke it must not lock between its ends.
    """
    if mechanism.type not in KINDS:
        raise SceneError([Fault(f"{mechanism.path}.type", repr(mechanism.type), "one of " + ", ".join(KINDS))])
    kind = KINDS[mechanism.type]
    partly = mechanism.stroke is not None and kind.lock_angles is not None
    if kind.locks is not None and not partly and (faults := kind.locks(mechanism)):
        raise SceneError(faults)
    family = kind.family(mechanism, parameters)
    if mechanism.stroke is None or kind.driver != "turns":
        return family
    if kind.lock_angles is not None and kind.locks is not None and kind.locks(mechanism):
        _check_stroke(mechanism, family, within_turn(kind.lock_angles(mechanism)))
    edges, switches = (tuple(_unrolled(angles, *mechanism.stroke)) for angles in (family.breakpoints, family.switches))
    return family._replace(breakpoints=edges, switches=switches)


def _unrolled(angles: Iterable[float], low: float, high: float) -> list[float]:
    """Angles of a turn (rad), on every turn between two ends, ascending."""
    turns = range(floor(low / tau), ceil(high / tau) + 1)
    return sorted(at for angle in angles for turn in turns if low < (at := angle + turn * tau) < high)


def _check_stroke(mechanism: Mechanism, family: Family, locks: Sequence[float]) -> None:
    """Refuses a stroke on which the mechanism locks, or cannot be assembled."""
    assert mechanism.stroke is not None
    low, high = mechanism.stroke
    met = _unrolled(locks, low - TOUCH, high + TOUCH)
    if not met and _closes(family, 0.5 * (low + high)):
        return
    where = f"the crank locks at {degrees(met[0]):.6g} deg" if met else "the bars do not meet"
    moves = _moves(family, locks)
    expected = f"a stroke within {moves}" if moves else "lengths that meet"
    defect = f"{degrees(low):.6g} to {degrees(high):.6g} deg, where {where}"
    raise SceneError([Fault("stroke", defect, expected, locks=tuple(met))])


def _closes(family: Family, psi: float) -> bool:
    """Tests whether the mechanism can be assembled at a crank angle (rad)."""
    with np.errstate(invalid="ignore"):
        position = family.position(np.float64(psi), np)
        return all(bool(np.isfinite(port.position(position))) for port in family.ports.values())


def _moves(family: Family, locks: Sequence[float]) -> str:
    """Ranges between the locks of a turn (rad, ascending) over which the crank moves, in words."""
    ends = [*locks, *(angle + tau for angle in locks[:1])]
    moves = [(a, b) for a, b in pairwise(ends) if _closes(family, 0.5 * (a + b))]
    listed = [f"{degrees(a - tau * (b > tau)):.6g} to {degrees(b - tau * (b > tau)):.6g} deg" for a, b in moves]
    return " or ".join(listed)


def stroke_ranges(mechanism: Mechanism, parameters: Mapping[str, float] = MappingProxyType({})) -> str:
    """Ranges in which a crank that cannot turn fully may have a stroke, in words; empty if there is none."""
    kind = KINDS[mechanism.type]
    if kind.lock_angles is None:
        return ""
    partly = replace(mechanism, stroke=(0.0, tau))
    return _moves(kind.family(partly, parameters), within_turn(kind.lock_angles(mechanism)))


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


def sine(name: str) -> cached_property[Any]:
    """Sine of a position's angle of that name, computed when first read."""
    return cached_property(lambda position: position.ns.sin(getattr(position, name)))


def cosine(name: str) -> cached_property[Any]:
    """Cosine of a position's angle of that name, computed when first read."""
    return cached_property(lambda position: position.ns.cos(getattr(position, name)))


# -- parts that chains share -------------------------------------------------------------------------------------------


class BodyLine(NamedTuple):
    """A line fixed in a turning body: its angle, that angle's sine, cosine and rate d(angle)/dpsi."""

    velocity: str
    angle: Callable[[Any], Any]
    sine: Callable[[Any], Any]
    cosine: Callable[[Any], Any]
    rate: Callable[[Any], Any]


class Parts(NamedTuple):
    """A stretch of a mechanism's chain."""

    velocities: tuple[Velocity, ...] = ()
    masses: tuple[Mass, ...] = ()
    weights: tuple[Weight, ...] = ()


HERE = (0.0, 0.0)
CRANK_PART = Part("crank", "turns about a fixed pivot; its first pin is the pivot", (length("pivot to crank pin"),), BODY)
CRANK = BodyLine("crank", attrgetter("psi"), attrgetter("sin"), attrgetter("cos"), lambda _: 1.0)


def block_on_pin(made: Derivation, radius: str) -> None:
    """The derivation of a block on the crank's pin."""
    made.pinned("block", _("Block on the crank's pin"), (radius, made.driver, "1", "0"), "crank.pin")


def line(name: str) -> BodyLine:
    """Line of a body whose position has the attributes NAME, NAME_sin, NAME_cos and NAME_rate."""
    return BodyLine(name, *map(attrgetter, (name, f"{name}_sin", f"{name}_cos", f"{name}_rate")))


def joined(*parts: Parts) -> Parts:
    """One chain from several stretches, in their order."""
    velocities, masses, weights = zip(*parts, strict=True)
    return Parts(*(tuple(chain(*column)) for column in (velocities, masses, weights)))


def driven(name: str, rotating: bool, source: str = "crank") -> Velocity:
    """Velocity by one transformer from `source`, its ratio the position's NAME_rate and the slope NAME_slope."""
    ratio = Ratio(attrgetter(f"{name}_rate"), attrgetter(f"{name}_slope"))
    return Velocity(name, rotating, (Term(source, ratio),))


def carried(velocity: str, value: float, body: str) -> tuple[Mass, ...]:
    """Mass or inertia on a velocity; empty if it is zero."""
    return () if value == 0 else (Mass(velocity, value, body),)


def body(mechanism: Mechanism, name: str) -> Body:
    """A part's body; one without mass if the mechanism has none."""
    return mechanism.bodies.get(name, Body())


def sliding(mechanism: Mechanism, name: str, direction: float, source: str = "crank") -> Parts:
    """Body that slides along a fixed direction (rad), and has mass (kg) and weight there."""
    mass = body(mechanism, name).mass
    weight = () if mass == 0 else (Weight(name, mass, direction, name),)
    return Parts((driven(name, False, source),), carried(name, mass, name), weight)


WeightForce = tuple[Weight, float, float]
"""A weight, its force F (N) along its path, and how much rounding in units of its directions changes that (N)."""


def forces_along(weights: Iterable[Weight], gravity: tuple[float, float] | None) -> Iterator[WeightForce]:
    """The weights that have a force along their paths.

    F = m (gx cos a + gy sin a) changes by m |gx sin a - gy cos a| for each radian of either direction. That of the path is
    off by |a| units at most, that of gravity by pi, and none along an axis.

    >>> [(_, force, rounded)] = forces_along([Weight("slider", 2.0, 3.0, "slider")], (0.0, -10.0))
    >>> round(force, 3), round(rounded, 3)
    (-2.822, 59.4)

    """
    if gravity is None:
        return
    gx, gy = gravity
    along_axis = any(not is_recorded(part) and part == 0.0 for part in gravity)
    for weight in weights:
        if weight.direction == 0.5 * pi:  # the cosine of this float is not 0
            force, across, angle = weight.mass * gy, gx, 0.0
        elif not is_recorded(weight.direction) and weight.direction == 0.0:
            force, across, angle = weight.mass * gx, gy, 0.0
        else:
            cosine, sine, angle = cos(weight.direction), sin(weight.direction), abs(weight.direction)
            force, across = weight.mass * (gx * cosine + gy * sine), gx * sine - gy * cosine
        if abs(force) > 1e-15 * weight.mass * (abs(gx) + abs(gy)):
            yield weight, force, weight.mass * abs(across) * (angle if along_axis else angle + pi)


def by_directions(forces: Iterable[WeightForce], passed: Iterable[float]) -> float:
    """Factor c of the error c sqrt(I*) that M* has by rounded directions of weights and paths, sqrt(kg) m/s².

    Forces of masses m that are off by d change M* by d g with the velocities g for each rad/s of the crank, in all by no
    more than sqrt(sum d²/m) sqrt(sum m g²), and I* is at least the second sum. Meshes that pass a share of the power divide
    it by that at most.
    """
    squares: Any = sum(rounded * rounded / weight.mass for weight, _, rounded in forces)
    error = ROUNDING * sqrt(squares)
    for share in passed:
        error /= share
    return error


def arm(line: BodyLine, length: float, tilt: float = 0.0) -> tuple[Term, Term]:
    """Velocity along x and along y of the end of an arm, relative to its start, from the arm's angular velocity.

    The arm has `length` (m) and lies `tilt` (rad) counter-clockwise from the line: end = length (cos a, sin a) with
    a = angle + tilt, so T_x = -length sin a and T_y = length cos a; slopes follow by da/dpsi = rate.
    """
    sine, cosine = line.sine, line.cosine
    if tilt != 0:
        sine, cosine = (lambda p: p.ns.sin(line.angle(p) + tilt)), (lambda p: p.ns.cos(line.angle(p) + tilt))
    along_x = Ratio(lambda p: -length * sine(p), lambda p: -length * cosine(p) * line.rate(p))
    along_y = Ratio(lambda p: length * cosine(p), lambda p: -length * sine(p) * line.rate(p))
    return Term(line.velocity, along_x), Term(line.velocity, along_y)


def point(line: BodyLine, name: str, radius: float, mass: float, body: str, tilt: float = 0.0) -> Parts:
    """Point of a body on a fixed pivot: NAME is its tangential speed; NAME.x and NAME.y are its components."""
    if radius == 0:
        return Parts()
    along_x, along_y = arm(line, radius, tilt)
    velocities = (
        Velocity(name, False, (Term(line.velocity, radius),)),
        Velocity(f"{name}.x", False, (along_x,)),
        Velocity(f"{name}.y", False, (along_y,)),
    )
    return Parts(velocities, carried(name, mass, body), _weights(name, mass, body))


def pivoted(line: BodyLine, mechanism: Mechanism, name: str) -> Parts:
    """Body on a fixed pivot: inertia on its rotation, mass on the tangential speed of its centre of mass."""
    part = body(mechanism, name)
    inertia = Parts(masses=carried(line.velocity, part.inertia, name))
    return joined(inertia, point(line, f"{name}.com", part.com, part.mass, name, part.com_angle))


def floating(line: BodyLine, mechanism: Mechanism, name: str, offset: float, carrier: BodyLine = CRANK) -> Parts:
    """Body whose first pin is the end of a carrier's arm, `offset` (m) from the carrier's fixed pivot.

    The velocity of its centre of mass is that of the pin, plus that of its rotation about it.
    """
    part, at = body(mechanism, name), f"{name}.com"
    own = [] if part.com == 0 else [arm(line, part.com, part.com_angle)]
    along_x, along_y = zip(arm(carrier, offset), *own, strict=True)
    velocities = Velocity(f"{at}.x", False, along_x), Velocity(f"{at}.y", False, along_y)
    masses = tuple(chain(*(carried(v.name, part.mass, name) for v in velocities)))
    return Parts(velocities, carried(line.velocity, part.inertia, name) + masses, _weights(at, part.mass, name))


def _weights(name: str, mass: float, body: str) -> tuple[Weight, ...]:
    if mass == 0:
        return ()
    return Weight(f"{name}.x", mass, 0.0, body), Weight(f"{name}.y", mass, pi / 2, body)


# -- limits: where a crank locks, and where it comes so near to it that cells must be short --------------------------------


TOUCH = 1e-12  # lengths that differ by less than this share are equal: "0.1 m" and "100 mm" must be
GROWTH = 2.5  # each cell then reaches 1.5 times its distance from the singularity


def exceeds(a: float, b: float) -> bool:
    """Tests whether length a is greater than length b by more than rounding."""
    return bool(a - b > TOUCH * max(abs(a), abs(b)))


def graded(centre: float, distance: float, reach: float = 1.0) -> list[float]:
    """Breakpoints about a complex singularity at `distance` (rad) above the real angle `centre` (rad).

    They are at the centre and at distance, 2.5 distance, 6.25 distance... to both sides within `reach` (rad), so that
    a polynomial of order 16 follows 1/z on every cell to about 1e-10. None if the singularity is beyond reach/2.

    >>> graded(3.0, 0.25)
    [2.375, 2.75, 3.0, 3.25, 3.625]
    >>> graded(3.0, 0.6)
    []
    """
    if distance > reach / 2:
        return []
    steps = []
    while 0 < distance < reach:
        steps.append(distance)
        distance *= GROWTH
    return [*(centre - s for s in reversed(steps)), centre, *(centre + s for s in steps)]


def within_turn(angles: Iterable[float]) -> tuple[float, ...]:
    """The angles (rad) brought into [0, 2 pi), ascending, each once."""
    return tuple(sorted({angle % tau % tau for angle in angles}))


def above_one(value: float) -> float:
    """Distance (rad) from the real axis to where the sine or cosine of an angle takes `value` >= 1."""
    return acosh(max(value, 1.0)) if value < inf else inf


def where_cosine(value: float) -> list[float]:
    """Angles (rad) in a turn whose cosine is `value`: two, one or none; an extreme missed by rounding counts."""
    if abs(value) > 1 + 4 * TOUCH:
        return []
    half = acos(min(1.0, max(-1.0, value)))
    return [half] if abs(value) >= 1 - TOUCH else [half, tau - half]


def where_sine(value: float) -> list[float]:
    """Angles (rad) in a turn whose sine is `value`, likewise."""
    return [pi / 2 - angle for angle in where_cosine(value)]


def lock_fault(path: str, length: float, expected: str, angles: Iterable[float]) -> Fault:
    """The fault of a length (m) for which the crank cannot turn, naming the angles (rad) where it locks."""
    locks = within_turn(angles)
    listed = [f"{degrees(angle):.6g}" for angle in locks]
    several = " and ".join(filter(None, (", ".join(listed[:-1]), *listed[-1:])))
    where = f"the crank locks at {several} deg" if listed else "it closes at no crank angle"
    return Fault(path, f"{float(length):.9g} m", expected, where, locks=locks)


# -- ends of a port's stroke ---------------------------------------------------------------------------------------------

_FLAT = 1e-12  # of a stroke: rounding


class Ends(NamedTuple):
    """A port's stroke: every place where it may reverse, as coordinate psi of its mechanism and displacement x.

    Between neighbours it moves in one direction. psi is the mechanism's own crank angle (rad; m where the driver slides), x
    is in m or rad. `period` (rad) is that after which the rows repeat, None on a one-way stroke; `displacement` gives x at
    any psi.
    """

    psi: Array
    x: Array
    period: float | None
    displacement: Callable[[Array], Array]

    @property
    def low(self) -> float:
        """The least displacement."""
        low: float = min(self.x.tolist())
        return low

    @property
    def high(self) -> float:
        """The greatest displacement."""
        high: float = max(self.x.tolist())
        return high

    def before(self, high: bool, angle: float) -> float | None:
        """Distance (m or rad) that the port covers on the last `angle` (rad of psi) before its high or its low end.

        None if it does not move towards that end throughout. An end that is reached several times counts at its
        first passage.

        >>> yoke = Mechanism("scotch-yoke", "yoke", geometry={"crank.length": 0.1})
        >>> round(ends_of(yoke, "yoke").before(True, np.pi / 3), 12)
        0.05
        """
        psi, x = self.psi, self.x
        last = psi.tolist()[np.argmax(x) if high else np.argmin(x)]
        first = last - angle
        if self.period is not None:
            psi, x = np.concatenate((psi[:-1] - self.period, psi)), np.concatenate((x[:-1], x))
        if first < psi[0]:
            return None
        passed = x[(psi > first) & (psi <= last)]
        way = np.diff([*self.displacement(np.array([first])), *passed]) * (1.0 if high else -1.0)
        return sum(way.tolist()) if (way >= -_FLAT * (self.high - self.low)).all() else None


_MOST_PORTS = 64  # whose ends are kept
_ends: dict[bytes, Ends] = {}  # of ports, by what they depend on


def ends_of(mechanism: Mechanism, port: str, parameters: Mapping[str, float] = MappingProxyType({})) -> Ends:
    """Every place where a port may reverse on the mechanism's travel: roots of dx/dpsi = 0 by interval bounds, and kinks.

    With recorded lengths the roots are those of their present values, each followed by Newton's method.

    Args:
        mechanism: with lengths for which it turns.
        port: name of one of its ports.
        parameters: SI values of names in a law's expressions.

    Raises:
        SceneError: for a mechanism that locks, or a port that stands still too long to be followed.

    >>> crank = Mechanism("slider-crank", "press", geometry={"crank.length": 0.1, "rod.length": 0.4})
    >>> ends = ends_of(crank, "slider")
    >>> round(ends.low, 12), round(ends.high, 12)
    (0.3, 0.5)

    """
    depends = mechanism.unweighed(), dict(parameters)
    if recorded := recorded_in(depends):
        return _reversals(mechanism, port, parameters, recorded)
    key = pickle.dumps((port, *depends))  # mechanisms themselves have no hash
    ends = _ends[key] if key in _ends else _reversals(mechanism, port, parameters, [])
    _ends[key] = ends
    for oldest in list(_ends)[:-_MOST_PORTS]:
        _ends.pop(oldest, None)
    return ends


def _reversals(mechanism: Mechanism, port: str, parameters: Mapping[str, float], recorded: list[Any]) -> Ends:
    family = plain = build(mechanism, parameters)
    velocity = family.ports[port].velocity
    if recorded:
        plain = build(*mapped((mechanism, parameters), present))
    if mechanism.stroke is not None:
        (first, last), period, breaks = mechanism.stroke, None, set(family.breakpoints)
    else:
        first, last = 0.0, mechanism.travel if mechanism.linkage is not None else mechanism.period
        period, turns = last, range(max(round(last / mechanism.period), 1))
        breaks = {edge + turn * mechanism.period for edge in family.breakpoints for turn in turns}
    edges = sorted({first, last, *(edge for edge in breaks if first < edge < last)})

    def stops(a: float, b: float) -> list[float]:
        """Roots of the velocity ratio inside one smooth piece."""
        anchor = 0.5 * (a + b)

        def enclose(lo: Array, hi: Array) -> tuple[Any, Any]:
            return _flow(plain, velocity, plain.position(Interval(lo, hi), INTERVALS, anchor + 0 * lo))

        def value(psi: Array) -> Any:
            return _flow(plain, velocity, plain.position(psi, np, anchor + 0 * psi))[0] + 0 * psi

        return roots(enclose, value, a, b)

    def now_at(anchor: float, root: float) -> Any:
        """The root with recorded lengths."""
        recorder = recorded[0].recorder

        def flow(psi: Any) -> tuple[Any, Any]:
            return _flow(family, velocity, family.position(psi, NAMESPACE, anchor))

        return solved(recorder, flow, root) if recorder.exact else followed(flow, root, last - first)

    def displacement(psi: Array) -> Array:
        position = family.ports[port].position
        if recorded:
            return np.array([position(family.position(each, NAMESPACE)) for each in psi.tolist()], dtype=object)
        return np.broadcast_to(np.asarray(position(family.position(psi, np)), dtype=float), psi.shape)

    try:
        inner = [(0.5 * (a + b), root) for a, b in pairwise(map(present, edges)) for root in stops(a, b)]
    except SwitchingError:
        defect = f"{mechanism.name}.{port}, whose velocity changes sign too often to follow, as if it stood still"
        raise SceneError([Fault(mechanism.path, defect, "a port that moves")]) from None
    psi = np.array(sorted({*edges, *(now_at(*each) if recorded else each[1] for each in inner)}))
    return Ends(psi, displacement(psi), period, displacement)


def _flow(family: Family, velocity: str, position: Any) -> tuple[Any, Any]:
    """Ratio of a velocity to the crank's, and its slope by psi: the product of the chain of transformers."""
    if velocity == "crank":
        return 1.0, 0.0
    gain: Any = 0.0
    slope: Any = 0.0
    for term in next(item for item in family.velocities if item.name == velocity).terms:
        of, bend = _flow(family, term.source, position)
        ratio = term.ratio
        value, change = (ratio.value(position), ratio.slope(position)) if isinstance(ratio, Ratio) else (ratio, 0.0)
        gain, slope = gain + of * value, slope + bend * value + of * change
    return gain, slope
