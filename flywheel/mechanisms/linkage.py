"""Linkage of any make as a chain: crank -> every unknown angle and displacement -> the centres of mass, by arms.

Over a whole stretch of the driver, variables, influence coefficients and slopes have proven bounds. The argument is that of
the continuation (`linkages.positions`), about the middle of each stretch: where the followed assembly is the only one near
the tangent, its variables stay in a ball about that, and the Jacobian's variation bounds the rest. Stretches that are too
wide for the proof get bounds without end, so that they are cut. Rounding is covered by a flat share of 1e-12, not proven.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cached_property, partial
from math import tau
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.mechanisms.families import Family, Kind, Mass, Port, Ratio, Term, Velocity, Weight
from flywheel.mechanisms.linkages.equations import WINDOW, Form, Loops, inverse
from flywheel.mechanisms.linkages.positions import Solution, solve
from flywheel.numerics.faults import Fault, SceneError
from flywheel.numerics.intervals import Interval
from flywheel.scene.keys import Key
from flywheel.scene.linkage import SLIDE, SLOT, Linkage
from flywheel.scene.scene import Mechanism

Array = NDArray[np.float64]

_SHARED = 0.3  # units: how far a displacement may go within a stretch that can be proven
_ROUNDING = 1e-12


class Enclosure(NamedTuple):
    """Middle and reach to both sides of all (scaled) variables, rates and slopes, each of shape (n, variables)."""

    z: Array
    z_reach: Array
    rate: Array
    rate_reach: Array
    slope: Array
    slope_reach: Array


def enclosed(solution: Solution, low: Array, high: Array) -> Enclosure:
    """Bounds over stretches [low, high] of the driver's coordinate (rad or m), shape (n,)."""
    scale = solution.scale
    middle, half = 0.5 * (low + high), 0.5 * np.abs(high - low) / scale
    z, rate, slope = solution.movement(middle)
    equations = solution.equations
    if z.shape[1] == 1:
        nothing = np.zeros_like(z)
        return Enclosure(z, half[:, None] + nothing, rate, nothing, slope, nothing)
    bases = equations.bases(z)
    size = np.abs(inverse(equations.jacobian(z, bases)[:, :, 1:]))
    reach = np.abs(bases.whole) + _SHARED * equations.sliding
    ball = np.ones_like(z)
    ball[:, 0] = 0.0

    def bound(*steps: Array) -> Array:
        """Largest effect on an unknown of the equations' change along the steps, shape (n,)."""
        return np.asarray(np.einsum("nij,nj->ni", size, equations.bound(z, reach, *steps)).max(axis=1))

    t, d = half[:, None], np.abs(rate)
    radius, shrink = _ball(half, bound(d, ball), bound(ball, ball), bound(d, d))
    moved = t * d + np.where(ball > 0.0, radius[:, None], 0.0)
    proven = (moved[:, 1:].max(axis=1) <= _SHARED) & (equations.turned(moved) <= WINDOW)
    proven &= half <= _SHARED if solution.linkage.sliding else True
    moved = np.where(proven[:, None], moved, 0.0)
    drift = np.where(proven, bound(moved, d) / shrink, 0.0)[:, None] * ball
    again = np.zeros_like(z)
    again[:, 1:] = np.abs(slope[:, 1:])
    bend = bound(moved, d, d) + 2 * bound(drift, d) + bound(drift, drift) + bound(moved, again)
    moved[:, 0] = half
    reaches = [moved, drift, (bend / shrink)[:, None] * ball]
    for values, widths in zip((z, rate, slope), reaches, strict=True):
        widths[~proven, 1:] = np.inf
        widths += _ROUNDING * (1.0 + np.abs(values))
    return Enclosure(z, moved, rate, drift, slope, reaches[2])


def _ball(t: Array, along: Array, across: Array, bent: Array) -> tuple[Array, Array]:
    """Radius about the tangent that Newton's map keeps, and 1 - kappa; NaN radius made infinite where there is none."""
    room = 1.0 - t * along
    beta = 0.5 * t**2 * bent + _ROUNDING
    square = room**2 - 4.0 * across * beta
    good = (room > 0.0) & (square > 0.0)
    radius = np.where(good, 2.0 * beta / (room + np.sqrt(np.where(good, square, 1.0))), np.inf)
    shrink = np.where(good, room - np.where(good, radius, 0.0) * across, 1.0)
    return np.where(shrink > 0.0, radius, np.inf), np.where(shrink > 0.0, shrink, 1.0)


# -- variables ---------------------------------------------------------------------------------------------------------


_KEPT = 4


class Kept(NamedTuple):
    """A variable at psi: its value and its derivatives by psi, as arrays or intervals."""

    value: Any
    rate: Any
    slope: Any


class Angle(NamedTuple):
    """An angle (rad) as a sum of variables, by number and weight, and a constant."""

    terms: tuple[tuple[int, float], ...]
    constant: float


def angle_of(weights: Array, constant: float) -> Angle:
    """The angle of a form's weights over all variables."""
    return Angle(tuple((int(k), float(weights[k])) for k in np.flatnonzero(weights)), constant)


class LinkagePosition:
    """All variables of a linkage at the driver's coordinate psi, found together when the first is read.

    psi is reduced to one period by the turn that the anchor lies in; `winding` is what each variable gains in a period.
    With intervals every variable is a proven enclosure.
    """

    def __init__(
        self, solution: Solution, period: float | None, winding: Array, psi: Any, ns: Any, anchor: Any = None
    ) -> None:
        self.solution, self.psi, self.ns = solution, psi, ns
        self.winding = winding
        middle = psi if anchor is None else anchor
        self.turns = 0.0 if period is None else np.floor(np.asarray(middle, dtype=float) / period)
        self.local = psi - self.turns * period if period is not None else psi

    @cached_property
    def _all(self) -> tuple[Kept, ...]:
        if isinstance(self.local, Interval):
            return self._enclosed(self.local)
        q = np.asarray(self.local, dtype=float)
        movement = self.solution.movement(np.atleast_1d(q).ravel())
        return self._unscaled([_shaped(part, q.shape) for part in movement])

    def _enclosed(self, cell: Interval) -> tuple[Kept, ...]:
        low, high = np.broadcast_arrays(np.asarray(cell.lo, dtype=float), np.asarray(cell.hi, dtype=float))
        found = enclosed(self.solution, np.atleast_1d(low).ravel(), np.atleast_1d(high).ravel())
        parts = []
        for middle, reach in zip(found[::2], found[1::2], strict=True):
            with np.errstate(all="ignore"):
                ends = [_shaped(middle + sign * reach, low.shape) for sign in (-1.0, 1.0)]
            parts.append([Interval(a, b) for a, b in zip(*ends, strict=True)])
        return self._unscaled(parts)

    def _unscaled(self, parts: list[Any]) -> tuple[Kept, ...]:
        """In rad and m, derivatives by psi."""
        unit, by = self.solution.unit, self.solution.scale
        sizes = [unit if sliding else 1.0 for sliding in are_slides(self.solution)]
        return tuple(
            Kept(parts[0][k] * size, parts[1][k] * (size / by), parts[2][k] * (size / by**2)) for k, size in enumerate(sizes)
        )

    def kept(self, variable: int) -> Kept:
        """A variable with its rate and slope; its value with what it gained in the turns before."""
        found = self._all[variable]
        gain = self.winding[variable]
        return found if gain == 0.0 else found._replace(value=found.value + gain * self.turns)

    def angle(self, angle: Angle) -> Any:
        """An angle that is a form of the variables (rad)."""
        total: Any = angle.constant
        for variable, weight in angle.terms:
            total = total + weight * self.kept(variable).value
        return total

    def turning(self, angle: Angle) -> Any:
        """The rate of such an angle."""
        total: Any = 0.0
        for variable, weight in angle.terms:
            total = total + weight * self.kept(variable).rate
        return total


class Positions:
    """Positions of a linkage at any psi. The last few single ones are kept: every modulus of a graph asks for them again."""

    def __init__(self, solution: Solution, period: float | None, winding: Array) -> None:
        self._of = solution, period, winding
        self._last: dict[tuple[float, float | None], LinkagePosition] = {}

    def __call__(self, psi: Any, ns: Any, anchor: Any = None) -> LinkagePosition:
        """The position at psi; `anchor` lies in the turn that psi belongs to."""
        if not (isinstance(psi, float) and isinstance(anchor, float | None)):
            return LinkagePosition(*self._of, psi, ns, anchor)
        key = psi, anchor
        found = self._last.get(key)
        if found is None:
            if len(self._last) >= _KEPT:
                del self._last[next(iter(self._last))]
            found = self._last[key] = LinkagePosition(*self._of, psi, ns, anchor)
        return found


def _shaped(table: Array, shape: tuple[int, ...]) -> Array:
    """A row for every variable, each of the shape that was asked for."""
    return table.T.reshape(table.shape[1], *shape)


def are_slides(solution: Solution) -> list[bool]:
    """Which variables are displacements."""
    names = solution.equations.loops.names
    return [solution.linkage.sliding, *(name.startswith("slide") for name in names[1:])]


class Arm(NamedTuple):
    """One term of a place: `length` (m, or 1 in front of a displacement) along `angle`, times variable `slide`."""

    length: float
    angle: Angle
    slide: int


def _stretch(p: LinkagePosition, arm: Arm) -> tuple[Any, Any]:
    """Length of an arm, and its rate."""
    if arm.slide < 0:
        return arm.length, 0.0
    kept = p.kept(arm.slide)
    return arm.length * kept.value, arm.length * kept.rate


def swing(p: LinkagePosition, arm: Arm, angle: Angle) -> Any:
    """Rate of an arm's end along an axis by the arm's turning: -L sin(angle)."""
    return -_stretch(p, arm)[0] * p.ns.sin(p.angle(angle))


def swing_slope(p: LinkagePosition, arm: Arm, angle: Angle) -> Any:
    """Slope of that by psi."""
    length, rate = _stretch(p, arm)
    at = p.angle(angle)
    return -(rate * p.ns.sin(at)) - length * p.ns.cos(at) * p.turning(angle)


def push(p: LinkagePosition, arm: Arm, angle: Angle) -> Any:
    """Rate of an arm's end along an axis by its displacement: cos(angle)."""
    return arm.length * p.ns.cos(p.angle(angle))


def push_slope(p: LinkagePosition, arm: Arm, angle: Angle) -> Any:
    """Slope of that by psi."""
    return -arm.length * p.ns.sin(p.angle(angle)) * p.turning(angle)


def place(p: LinkagePosition, arms: list[Arm], direction: float) -> Any:
    """Where a sum of arms ends, along a direction (rad)."""
    total: Any = 0.0
    for arm in arms:
        angle = arm.angle._replace(constant=arm.angle.constant - direction)
        total = total + _stretch(p, arm)[0] * p.ns.cos(p.angle(angle))
    return total


# -- linkage -----------------------------------------------------------------------------------------------------------


_CLOSES = 1e-9
_TURNS_TRIED = 12
_TINY = 1e-15
_STEPS_A_CELL = 8.0
_NOT_CRANK = "a body called crank that does not turn with the driver"


def family(mechanism: Mechanism, _: Mapping[str, float]) -> Family:
    """Chain of a linkage: each unknown straight from the crank, centres of mass and ports by arms from these.

    Raises:
        SceneError: where the linkage cannot be assembled, locks or branches, or does not return after the cycle.

    """
    solution, period, winding = followed(mechanism)
    chain = _Chain(mechanism, solution, winding)
    return Family(
        velocities=tuple(chain.velocities.values()),
        masses=tuple(chain.masses),
        weights=tuple(chain.weights),
        ports=chain.ports,
        position=Positions(solution, period, winding),
        breakpoints=_breakpoints(solution, period),
    )


class Cyclic(NamedTuple):
    """A linkage followed over its period (rad; None on a stroke), and what each variable gains in it."""

    solution: Solution
    period: float | None
    winding: Array


def followed(mechanism: Mechanism) -> Cyclic:
    """The linkage over its stroke, or over the least number of turns after which it returns."""
    linkage = mechanism.linkage
    if linkage is None:
        raise ValueError("a mechanism of type linkage needs its linkage")
    if mechanism.stroke is not None:
        solution = solve(linkage, *mechanism.stroke)
        return Cyclic(solution, None, np.zeros(len(solution.equations.loops.names)))
    most = max(round(mechanism.travel / tau), 1)
    for turns in sorted({1, most}):
        solution = solve(linkage, 0.0, turns * tau)
        winding = _winding(solution, turns * tau)
        if winding is not None:
            return Cyclic(solution, turns * tau, winding)
    raise SceneError([_open_fault(mechanism, linkage, most)])


def _winding(solution: Solution, period: float) -> Array | None:
    """What each variable gains in the period: whole turns; None where the linkage does not return."""
    ends = solution.movement(np.array([0.0, period])).z
    gain = ends[1] - ends[0]
    whole = np.where(are_slides(solution), 0.0, tau * np.round(gain / tau))
    return whole if np.abs(gain - whole).max() < _CLOSES else None


def _open_fault(mechanism: Mechanism, linkage: Linkage, most: int) -> Fault:
    found = f"a linkage that does not return after {most} turn{'s' if most > 1 else ''} of its driver"
    for turns in range(1, _TURNS_TRIED + 1):
        if _winding(solve(linkage, 0.0, turns * tau), turns * tau) is not None:
            return Fault(mechanism.path, found, "a cycle after which it does", f"it returns after {turns}: set regime.cycle")
    return Fault(mechanism.path, found, "a cycle after which it does", f"nor does it within {_TURNS_TRIED} turns")


class _Chain:
    """Velocities, masses, weights and ports of a linkage."""

    def __init__(self, mechanism: Mechanism, solution: Solution, winding: Array) -> None:
        self.mechanism, self.linkage = mechanism, solution.linkage
        self.loops: Loops = solution.equations.loops
        self.winding = winding
        self.velocities: dict[str, Velocity] = {}
        self.masses: list[Mass] = []
        self.weights: list[Weight] = []
        self.ports: dict[str, Port] = {}
        self.forms = dict(zip(self.linkage.names, self.loops.angles, strict=True))
        self.sources = ["crank", *(self._unknown(k) for k in range(1, len(self.loops.names)))]
        self._turn_bodies()
        self._slide_joints()
        for body in self.linkage.names[1:]:
            self._weigh(body)
        for port in mechanism.points:
            self._point(port.name, port.body, port.point, port.direction)

    def _unknown(self, variable: int) -> str:
        """The velocity of an unknown: a body's rotation, or a slide, straight from the crank."""
        kind, _, name = self.loops.names[variable].partition(" of ")
        if name == "crank":
            raise SceneError([Fault(f"{self.mechanism.path}.bodies.crank", _NOT_CRANK, "another name for it")])
        ratio = Ratio(lambda p: p.kept(variable).rate, lambda p: p.kept(variable).slope)
        self.velocities[name] = Velocity(name, kind == "angle", (Term("crank", ratio),))
        return name

    def _rotation(self, form: Form) -> tuple[Term, ...]:
        """The angular velocity of an angle, from those of the variables."""
        return tuple(Term(self.sources[k], float(form.weights[k])) for k in np.flatnonzero(form.weights))

    def _turn_bodies(self) -> None:
        for body in self.linkage.names[1:]:
            form, link = self.forms[body], self.linkage.link(body)
            terms = self._rotation(form)
            if not terms:
                continue
            at = self._turn(body, terms)
            if link.inertia:
                self.masses.append(Mass(at, link.inertia, body))
            if at != "crank":
                self.ports[body] = Port(at, partial(_angle, angle=angle_of(*form)), not bool(form.weights @ self.winding))

    def _turn(self, body: str, terms: tuple[Term, ...]) -> str:
        """The junction of a body's rotation; that of the driver, where it is called `crank`, is the shaft itself."""
        if body == "crank":
            if terms != (Term("crank", 1.0),) or self.linkage.sliding:
                raise SceneError([Fault(f"{self.mechanism.path}.bodies.crank", _NOT_CRANK, "another name for it")])
            return "crank"
        if body not in self.velocities:
            self.velocities[body] = Velocity(body, True, terms)
        return body

    def _slide_joints(self) -> None:
        for joint in self.linkage.joints:
            if joint.kind not in (SLIDE, SLOT):
                continue
            if joint.name == self.linkage.driver:
                self.velocities[joint.name] = Velocity(joint.name, False, (Term("crank", 1.0),))
                self.ports[joint.name] = Port(joint.name, lambda p: p.psi)
            else:
                variable = self.loops.names.index(f"slide of {joint.name}")
                self.ports[joint.name] = Port(joint.name, partial(_displacement, variable=variable))

    def _arms(self, body: str, x: float, y: float) -> list[Arm]:
        """Place of a point of a body as a sum of arms, those that turn together put into one."""
        loops, k = self.loops, self.linkage.names.index(body)
        form = self.forms[body]
        own = complex(x, y) / loops.unit * complex(np.exp(1j * form.constant))
        places: dict[tuple[tuple[float, ...], int], complex] = {}
        chain = [*zip(loops.origins[k], loops.turns, loops.slides, strict=True), (own, form.weights, -1)]
        for coefficient, turns, slide in chain:
            key = tuple(turns.tolist()), int(slide)
            places[key] = places.get(key, 0.0) + complex(coefficient)
        return [self._arm(np.array(turns), slide, value) for (turns, slide), value in places.items() if abs(value) > _TINY]

    def _arm(self, turns: Array, slide: int, coefficient: complex) -> Arm:
        length = abs(coefficient) * (self.loops.unit if slide < 0 else 1.0)
        return Arm(length, angle_of(turns, float(np.angle(coefficient))), slide)

    def _speed(self, name: str, arms: list[Arm], direction: float) -> bool:
        """Velocity of a place along a direction; False where it has none."""
        terms: dict[str, float | Ratio] = {}
        for arm in arms:
            for source, ratio in self._terms(arm, direction):
                terms[source] = _plus(terms[source], ratio) if source in terms else ratio
        if terms:
            self.velocities[name] = Velocity(name, False, tuple(Term(source, ratio) for source, ratio in terms.items()))
        return bool(terms)

    def _terms(self, arm: Arm, direction: float) -> Iterator[Term]:
        """What an arm adds: -S L sin(a) times its turning, and cos(a) times the displacement's rate."""
        angle = arm.angle._replace(constant=arm.angle.constant - direction)
        if angle.terms:
            ratio = Ratio(partial(swing, arm=arm, angle=angle), partial(swing_slope, arm=arm, angle=angle))
            yield from (Term(self.sources[k], _times(ratio, weight)) for k, weight in angle.terms)
        if arm.slide >= 0 and angle.terms:
            pushed = Ratio(partial(push, arm=arm, angle=angle), partial(push_slope, arm=arm, angle=angle))
            yield Term(self.sources[arm.slide], pushed)
        elif arm.slide >= 0 and abs(share := arm.length * _cosine(angle.constant)) > _TINY:
            yield Term(self.sources[arm.slide], share)

    def _weigh(self, body: str) -> None:
        """Mass and weight on the two velocities of a body's centre of mass."""
        link = self.linkage.link(body)
        if not link.mass:
            return
        arms = self._arms(body, *link.com)
        for axis, direction in (("x", 0.0), ("y", np.pi / 2)):
            name = f"{body}.com.{axis}"
            if self._speed(name, arms, direction):
                self.masses.append(Mass(name, link.mass, body))
                self.weights.append(Weight(name, link.mass, direction, body))

    def _point(self, name: str, body: str, point: str, direction: float) -> None:
        at = self.linkage.link(body).point(point)
        arms = self._arms(body, at.x, at.y)
        if not self._speed(name, arms, direction):
            found = f"{body}.{point}, which does not move along {np.degrees(direction):.6g} deg"
            raise SceneError([Fault(f"{self.mechanism.path}.ports.{name}", found, "a point that moves along its direction")])
        self.ports[name] = Port(name, partial(place, arms=arms, direction=direction))


def _times(ratio: Ratio, factor: float) -> Ratio:
    if factor == 1.0:
        return ratio
    return Ratio(lambda p: factor * ratio.value(p), lambda p: factor * ratio.slope(p))


def _plus(first: float | Ratio, second: float | Ratio) -> float | Ratio:
    """Two ratios from one source in one."""
    if not isinstance(first, Ratio) and not isinstance(second, Ratio):
        return first + second
    a, b = _as_ratio(first), _as_ratio(second)
    return Ratio(lambda p: a.value(p) + b.value(p), lambda p: a.slope(p) + b.slope(p))


def _as_ratio(ratio: float | Ratio) -> Ratio:
    return ratio if isinstance(ratio, Ratio) else Ratio(lambda _: ratio, lambda _: 0.0)


def _cosine(angle: float) -> float:
    """Cosine, 0 where rounding alone keeps it from that."""
    value = float(np.cos(angle))
    return 0.0 if abs(value) < 1e-15 else value


def _angle(p: LinkagePosition, angle: Angle) -> Any:
    return p.angle(angle)


def _displacement(p: LinkagePosition, variable: int) -> Any:
    return p.kept(variable).value


def _breakpoints(solution: Solution, period: float | None) -> tuple[float, ...]:
    """Where cells must end: where a lock is near, and at the breakpoints of a cam's lift wherever the cam passes them."""
    found = set(_graded(solution.trace.z[:, 0] * solution.scale))
    high = solution.high if period is None else period
    low = solution.low if period is None else 0.0
    for relation in solution.equations.loops.relations:
        if relation.lift is not None:
            for angle in relation.lift.curve.breakpoints:
                passed = _passages(solution, relation.first, angle, relation.lift.period, low, high)
                found.update(passed if period is None else (q % period for q in passed))
    return tuple(sorted(found))


def _graded(nodes: Array) -> Iterator[float]:
    """Edges of cells no wider than some steps of the continuation: its steps shrink as the distance from a lock does."""
    steps = np.diff(nodes)
    first = 0
    for k in range(1, len(steps)):
        if nodes[k + 1] - nodes[first] > _STEPS_A_CELL * steps[first : k + 1].min():
            yield float(nodes[k])
            first = k


def _passages(solution: Solution, form: Form, angle: float, every: float, low: float, high: float) -> Iterator[float]:
    """Coordinates of the driver from low to high at which a form passes an angle, whatever the turn."""
    nodes = np.unique(np.concatenate((solution.trace.z[:, 0] * solution.scale, np.linspace(low, high, 181))))
    nodes = nodes[(nodes >= low) & (nodes <= high)]

    def phase(q: Array) -> Array:
        return np.asarray((solution.movement(q).z @ form.weights + form.constant - angle) / every)

    values = phase(nodes)
    for k in range(nodes.size - 1):
        first, last = sorted((values[k], values[k + 1]))
        for whole in range(int(np.ceil(first)), int(np.floor(last)) + 1):
            yield _root(phase, float(whole), float(nodes[k]), float(nodes[k + 1]))


def _root(phase: Callable[[Array], Array], whole: float, a: float, b: float) -> float:
    """Where the phase passes a whole number between a and b."""
    from scipy.optimize import brentq  # only cams with pieces pay for it

    def function(q: float) -> float:
        return float(phase(np.array([q]))[0]) - whole

    low, high = function(a), function(b)
    return a if low == 0.0 or low * high > 0.0 else b if high == 0.0 else float(brentq(function, a, b, xtol=1e-15))


KIND = Kind(
    "linkage",
    "bodies, joints and couplings of any plane linkage",
    family,
    keys=(
        Key("driver", "text", "name of the pin or slide that drives", required=True, missing='give a joint, such as "O"'),
        Key("start", "angle | length", "the driver's coordinate at which guesses and assembly hold", 0.0),
        Key("assembly", "list", "an array of tables: sides on which points lie where the driver stands at start"),
        Key("bodies", "tables", "one table per body; `frame` is the fixed one", required=True),
        Key("joints", "list", "an array [[mechanism.joints]], one table per joint", required=True),
        Key("couplings", "list", "an array [[mechanism.couplings]]: gear and rolling pairs, cams"),
        Key("ports", "tables", "ports at points of bodies"),
    ),
    driver="either",
)
