"""Any linkage as a chain: crank -> every unknown angle and displacement -> the centres of mass, by arms.

Over a whole stretch of the driver, variables, influence coefficients and slopes have proven bounds. The argument is that of
the continuation (`linkages.positions`), about the middle of each stretch: where the followed assembly is the only one near
the tangent, its variables stay in a ball about that, and the Jacobian's variation bounds the rest. Stretches that are too
wide for the proof get bounds without end, so that they are cut. Rounding is covered by a flat share of 1e-12, not proven.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import cached_property, lru_cache, partial, reduce
from math import cos, sin, tau
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.numerics import root
from bondgraph.recording import Complex, Program, Recorded, Recorder
from flywheel.mechanisms import KINDS, families
from flywheel.mechanisms.families import Family, Kind, Mass, Port, Ratio, Term, Velocity, Weight
from flywheel.mechanisms.linkages.assembly import LEAVE
from flywheel.mechanisms.linkages.equations import WINDOW, Equations, Form, Loops, Track, cis, inverse, loops, vector
from flywheel.mechanisms.linkages.positions import Solution, solve
from flywheel.numerics.faults import Fault, SceneError
from flywheel.numerics.intervals import Interval
from flywheel.numerics.jets import cos as cosine_of
from flywheel.numerics.jets import is_recorded, mapped, present, presents, recorded_in
from flywheel.scene.linkage import PIN, SLIDE, SLOT, Joint, Link, Linkage, Point, Side
from flywheel.scene.scene import Key, Mechanism

Array = NDArray[np.float64]


# -- named mechanisms --------------------------------------------------------------------------------------------------


def linkage_of(mechanism: Mechanism) -> Linkage:
    """A named mechanism as a linkage, driven by the same coordinate: its crank's angle (rad) or its block's slide (m).

    Bodies, centres of mass and assembly are the same, with every joint spelled out. A joint bears the name of its point in
    both bodies; its first body is the one nearer to the driver, or the frame.

    | type | bodies | joints, the driver first |
    | --- | --- | --- |
    | scotch-yoke | crank, block, yoke | pivot, crank_pin, slot (slide), guide (slide) |
    | slider-crank | crank, rod, slider | pivot, crank_pin, slider_pin, guide (slide) |
    | four-bar | crank, coupler, rocker | pivot, crank_pin, rocker_pin, rocker_pivot |
    | crank-shaper | crank, block, rocker, rocker_pin, ram | pivot, crank_pin, rocker_slot (slide), rocker_pivot, end_pin, ram_slot (slide), guide (slide) |
    | toggle-clamp | block, coupler, bell_crank, rod, platen | block_guide (slide), block_pin, coupler_pin, pivot, rod_pin, platen_pin, platen_guide (slide) |

    A body's own x axis is the line whose angle the mechanism's port gives; that of a body without one is +x of the frame,
    and of the shaper's block the rocker's line. The frame's origin is the crank's pivot, or the rocker's in a shaper.

    Args:
        mechanism: of any type but `law`; that of a mechanism of type `linkage` is returned unchanged.

    Raises:
        SceneError: for a law, which has no bodies to join; for lengths with which the mechanism locks.

    >>> lengths = {"crank.length": 0.1, "rod.length": 0.3}
    >>> linkage = linkage_of(Mechanism("slider-crank", "press", geometry=lengths))
    >>> linkage.names, linkage.driver
    (('frame', 'crank', 'rod', 'slider'), 'pivot')
    >>> [joint.name for joint in linkage.joints]
    ['pivot', 'crank_pin', 'slider_pin', 'guide']

    """  # noqa: E501
    if mechanism.linkage is not None:
        return mechanism.linkage
    skeleton = KINDS[mechanism.type].skeleton if mechanism.type in KINDS else None
    if skeleton is None:
        advice = "write it as a linkage to have joints"
        jointed = [name for name, kind in KINDS.items() if kind.skeleton is not None]
        defect, expected = f"a mechanism of type {mechanism.type}", "one of " + ", ".join(jointed)
        raise SceneError([Fault(f"{mechanism.path}.type", defect, expected, advice)])
    start = mechanism.stroke[0] if mechanism.stroke is not None else 0.0
    members, joints, sides = skeleton(mechanism, families.build(mechanism).position(np.float64(start), np))

    def link(name: str, member: families.Member) -> Link:
        body = families.body(mechanism, name)
        towards = body.com_angle + member.tilt
        com = float(body.com * cos(towards)), float(body.com * sin(towards))
        points = tuple(Point(at, float(x), float(y)) for at, (x, y) in member.joints.items())
        angle = None if member.angle is None else float(member.angle)
        return Link(name, points, float(body.mass), float(body.inertia), com, angle)

    links = {name: link(name, member) for name, member in members.items()}

    def joint(pair: families.Pin | families.Slide) -> Joint:
        ends = links[pair.first].point(pair.name), links[pair.second].point(pair.name)
        if isinstance(pair, families.Pin):
            return Joint(pair.name, PIN, pair.first, pair.second, *ends)
        at = None if pair.at is None else float(pair.at)
        return Joint(pair.name, SLIDE, pair.first, pair.second, *ends, float(pair.direction), guess=at)

    ground, *moving = links.values()
    return Linkage(
        ground=ground,
        links=tuple(moving),
        joints=tuple(map(joint, joints)),
        driver=joints[0].name,
        sides=tuple(Side(*side) for side in sides),
        start=float(start),
        path=mechanism.path,
    )


# -- a period and what is gained in it ---------------------------------------------------------------------------------

_TURNS_TRIED = 12
_SAME_LOCK = 1e-6  # rad


class Cyclic(NamedTuple):
    """A linkage followed over its period (rad; None on a stroke), and the gain of each variable in it.

    `unknowns` are its own where lengths are recorded; None if all are plain.
    """

    solution: Solution
    period: float | None
    winding: Array
    unknowns: LinkageUnknowns | None = None

    @property
    def loops(self) -> Loops:
        """The loops from which the places of bodies follow."""
        return self.solution.equations.loops if self.unknowns is None else self.unknowns.loops


def followed(mechanism: Mechanism) -> Cyclic:
    """The linkage over its stroke, or over the least number of turns after which it returns."""
    linkage = mechanism.linkage
    if linkage is None:
        raise ValueError("a mechanism of type linkage needs its linkage")
    if recorded_in(linkage):
        plain, lengths = followed(replace(mechanism, linkage=mapped(linkage, present))), recorded_in(_unweighed(linkage))
        if lengths and not lengths[0].recorder.exact:
            raise TypeError("lengths of a linkage")
        return plain._replace(unknowns=LinkageUnknowns(_unweighed(linkage), lengths, plain)) if lengths else plain
    if mechanism.stroke is not None:
        try:
            solution = solve(linkage, *mechanism.stroke)
        except SceneError as error:
            raise _with_both_locks(linkage, error, mechanism.stroke) from None
        return Cyclic(solution, None, np.zeros(len(solution.equations.loops.names)))

    def over(turns: int) -> Cyclic | None:
        """The linkage over that many turns, if every variable has then gained whole turns or nothing."""
        solution = solve(linkage, 0.0, turns * tau)
        return None if solution.winding is None else Cyclic(solution, turns * tau, solution.winding)

    most = max(round(mechanism.travel / tau), 1)
    try:
        cycle = over(1)
    except SceneError as error:
        raise _with_both_locks(linkage, error, (0.0, tau)) from None
    if cycle := cycle or (over(most) if most > 1 else None):
        return cycle
    defect = f"a linkage that does not return after {most} turn{'s' if most > 1 else ''} of its driver"
    returns = next((turns for turns in range(1, _TURNS_TRIED + 1) if over(turns)), None)
    advice = (
        f"it returns after {returns}: set regime.cycle" if returns else f"it does not return within {_TURNS_TRIED} turns"
    )
    raise SceneError([Fault(mechanism.path, defect, "a cycle after which it returns", advice)])


def _unweighed(linkage: Linkage) -> Linkage:
    """A linkage without masses, guesses and sides of its assembly, on which no equation depends."""
    links = (link._replace(guess=None) for link in linkage.unweighed().links)
    joints = (joint._replace(guess=None, friction=0.0, radius=0.0, length=0.0) for joint in linkage.joints)
    return replace(linkage, links=tuple(links), joints=tuple(joints), sides=(), start=0.0)


class LinkageUnknowns:
    """The unknowns of a linkage as functions of its driver's coordinate and of recorded numbers, by its loops' equations.

    Called with a coordinate, in floats or intervals, it returns the values of all unknowns (rad, or m) at the present
    numbers, then their first and then their second derivatives. For other numbers `equations` are to be solved.

    Raises TypeError for a cam, and where redundant joints leave more equations than unknowns.
    """

    def __init__(self, linkage: Linkage, numbers: list[Any], plain: Cyclic) -> None:
        self.numbers, self.recorder = numbers, numbers[0].recorder
        self._linkage, self._plain = linkage, plain
        self.loops = loops(linkage, unit=1.0)
        self.count = self.loops.unknowns
        if any(relation.lift is not None for relation in self.loops.relations):
            raise TypeError("a cam")
        if self.count != self.loops.equations:
            raise TypeError("redundant joints of a linkage")

    def __call__(self, psi: Any, *_: Any) -> list[Any]:  # noqa: D102  # said above
        position = LinkagePosition(self._plain, psi, np, 0.5 * (self._plain.period or 0.0))  # psi lies in the first turn
        return [row for rows in zip(*position.variables[1:], strict=True) for row in rows]

    def recorded(self, psi: Any) -> list[Recorded]:
        """The same at the recorded numbers, as a call on their record."""
        values = None if present(psi) is None else self(present(psi))
        results: list[Recorded] = self.recorder.call(self, [psi, *self.numbers], 3 * self.count, values)
        return results

    @cached_property
    def equations(self) -> Program:
        """Left sides, then their derivatives by the unknowns, from all unknowns, the driver's coordinate and the numbers."""
        recorder = Recorder()
        unknowns, psi = [recorder.input(name) for name in self.loops.names[1:]], recorder.input(self.loops.names[0])
        own = {number.number: recorder.input(str(k), number.value) for k, number in enumerate(self.numbers)}
        equations = Equations(loops(mapped(self._linkage, lambda number: own[number.number]), unit=1.0))
        z = np.array([[psi, *unknowns]], dtype=object)
        bases = equations.bases(z)
        return recorder.program([*equations.residual(z, bases)[0], *equations.jacobian(z, bases)[0, :, 1:].ravel()])


def _with_both_locks(linkage: Linkage, error: SceneError, ends: tuple[float, float]) -> SceneError:
    """The lock that a motion between two ends meets with the one on the other side of its start, if there is one.

    On the other side a turn is followed, or where the driver slides the rest of the motion.
    """
    (fault, *more) = error.faults
    if more or not fault.locks:
        return error
    lock, start = fault.locks[0], linkage.start
    before = min(ends[0], start) if linkage.sliding else start - tau
    beyond = max(ends[1], start) if linkage.sliding else start + tau
    try:
        solve(linkage, *((before, start) if lock > start else (start, beyond)))
        other = None
    except SceneError as refused:
        other = refused.faults[0]
    what, places = fault.defect.rpartition(" at ")[0], [lock]
    if other is not None and other.locks and other.defect.rpartition(" at ")[0] == what:
        apart = other.locks[0] - lock
        if abs(apart if linkage.sliding else np.sin(0.5 * apart)) > _SAME_LOCK:
            places = sorted((lock, other.locks[0]))
    if len(places) == 2:
        first, second = (f"{at if linkage.sliding else np.degrees(at):.9g}" for at in places)
        defect = f"{what} at {first} and {second} {'m' if linkage.sliding else 'deg'}"
        return SceneError([fault._replace(defect=defect, advice=f"{fault.advice}; a [stroke] may lie between the two")])
    if ends == (0.0, tau) or LEAVE in fault.advice:
        return error
    mend = "let [stroke] end before it" if lock > start else "let [stroke] begin after it"
    return SceneError([fault._replace(advice=f"{fault.advice}; {mend}")])


# -- proven bounds over stretches --------------------------------------------------------------------------------------

_SHARED = 0.3  # units: greatest displacement within a stretch that can be proven
_BOUND_ROUNDING = 1e-12


def enclosed(solution: Solution, low: Array, high: Array) -> tuple[tuple[Array, Array], ...]:
    """Bounds over stretches [low, high] of the driver's coordinate (rad or m), shape (n,).

    Returns the middle and the reach to both sides of all (scaled) variables, of their rates, and of their slopes, each of
    shape (n, variables).
    """
    middle, half = 0.5 * (low + high), 0.5 * np.abs(high - low) / solution.scale
    z, rate, slope = solution.movement(middle)
    equations = solution.equations
    if z.shape[1] == 1:
        nothing = np.zeros_like(z)
        return (z, half[:, None] + nothing), (rate, nothing), (slope, nothing)
    bases = equations.bases(z)
    size = np.abs(inverse(equations.jacobian(z, bases)[:, :, 1:]))
    reach = np.abs(bases.whole) + _SHARED * equations.sliding
    ball = np.ones_like(z)
    ball[:, 0] = 0.0

    def bound(*steps: Array) -> Array:
        """Largest effect on an unknown of the equations' change along the steps, shape (n,)."""
        return np.asarray(np.einsum("nij,nj->ni", size, equations.bound(z, reach, *steps)).max(axis=1))

    # the radius about the tangent that Newton's map keeps, and 1 - kappa
    d, across = np.abs(rate), bound(ball, ball)
    room, beta = 1.0 - half * bound(d, ball), 0.5 * half**2 * bound(d, d) + _BOUND_ROUNDING
    square = room**2 - 4.0 * across * beta
    good = (room > 0.0) & (square > 0.0)
    radius = np.where(good, 2.0 * beta / (room + np.sqrt(np.where(good, square, 1.0))), 0.0)
    shrink = np.where(good, room - radius * across, 1.0)
    good &= shrink > 0.0
    shrink = np.where(good, shrink, 1.0)

    moved = half[:, None] * d + np.where(ball > 0.0, np.where(good, radius, np.inf)[:, None], 0.0)
    proven = (moved[:, 1:].max(axis=1) <= _SHARED) & (equations.turned(moved) <= WINDOW)
    proven &= half <= _SHARED if solution.linkage.sliding else True
    moved = np.where(proven[:, None], moved, 0.0)
    drift = np.where(proven, bound(moved, d) / shrink, 0.0)[:, None] * ball
    again = np.abs(slope) * ball
    bend = bound(moved, d, d) + 2 * bound(drift, d) + bound(drift, drift) + bound(moved, again)
    moved[:, 0] = half
    pairs = (z, moved), (rate, drift), (slope, (bend / shrink)[:, None] * ball)
    for values, widths in pairs:
        widths[~proven, 1:] = np.inf
        widths += _BOUND_ROUNDING * (1.0 + np.abs(values))
    return pairs


# -- variables, angles and arms ----------------------------------------------------------------------------------------

_KEPT = 4


class LinkagePosition:
    """All variables of a linkage at the driver's coordinate psi, computed together when the first is read.

    psi is reduced to one period by the turn that the anchor lies in. With intervals every variable is a proven enclosure.
    """

    def __init__(self, cycle: Cyclic, psi: Any, ns: Any, anchor: Any = None) -> None:
        self.psi, self.ns = psi, ns
        self._cycle = cycle
        of_any = isinstance(anchor, Recorded) and anchor.value is None  # piece
        self._middle = anchor if of_any else presents(psi if anchor is None else anchor)
        self._turns = 0.0 if cycle.period is None else (ns if of_any else np).floor(self._middle / cycle.period)

    @cached_property
    def variables(self) -> tuple[Track, ...]:
        """All of them, within the first period."""
        solution, period, _, unknowns = self._cycle
        psi = self.psi if period is None else self.psi - self._turns * period
        if unknowns is not None:
            if isinstance(psi, np.ndarray):
                table = np.array([unknowns.recorded(each) for each in psi.flat], dtype=object).T.reshape(-1, *psi.shape)
            else:
                table = np.array(unknowns.recorded(psi), dtype=object)
            ratios: Any = 1.0, 0.0
            return (Track(psi, *ratios), *(Track(*table[k :: unknowns.count]) for k in range(unknowns.count)))
        parts: list[Any]
        if isinstance(psi, Interval):
            low, high = np.broadcast_arrays(np.asarray(psi.lo, dtype=float), np.asarray(psi.hi, dtype=float))
            shape, parts = low.shape, []
            for middle, reach in enclosed(solution, np.atleast_1d(low).ravel(), np.atleast_1d(high).ravel()):
                with np.errstate(all="ignore"):
                    ends = [(middle + sign * reach).T.reshape(-1, *shape) for sign in (-1.0, 1.0)]
                parts.append([Interval(a, b) for a, b in zip(*ends, strict=True)])
        elif isinstance(psi, Recorded):
            parts = [part[0] for part in solution.recorded(psi, self._middle - self._turns * (period or 0.0))]
        else:
            q = np.asarray(psi, dtype=float)
            parts = [part.T.reshape(-1, *q.shape) for part in solution.movement(np.atleast_1d(q).ravel())]
        by = solution.scale
        slides = solution.linkage.sliding, *(name.startswith("slide") for name in solution.equations.loops.names[1:])
        sizes = [solution.unit if sliding else 1.0 for sliding in slides]
        return tuple(
            Track(parts[0][k] * size, parts[1][k] * (size / by), parts[2][k] * (size / by**2))
            for k, size in enumerate(sizes)
        )

    def variable(self, number: int) -> Track:
        """A variable with its rate and slope; its value with the gain of the turns before."""
        variable, gain = self.variables[number], self._cycle.winding[number]
        return variable if gain == 0.0 else variable._replace(value=variable.value + gain * self._turns)


def positions_of(cycle: Cyclic) -> Callable[..., LinkagePosition]:
    """Positions of a linkage at any psi; an anchor lies in the turn that psi belongs to.

    The last few single ones are kept: every modulus of a graph needs them again.
    """
    single = lru_cache(maxsize=_KEPT)(lambda psi, anchor: LinkagePosition(cycle, psi, np, anchor))

    def position(psi: Any, ns: Any, anchor: Any = None) -> LinkagePosition:
        one = isinstance(psi, float) and isinstance(anchor, float | None)
        return single(psi, anchor) if one else LinkagePosition(cycle, psi, ns, anchor)

    return position


class Angle(NamedTuple):
    """An angle (rad) as a sum of variables, by number and weight, and a constant."""

    terms: tuple[tuple[int, float], ...]
    constant: float

    def value(self, p: LinkagePosition) -> Any:
        """The angle (rad)."""
        total: Any = self.constant
        for number, weight in self.terms:
            total = total + weight * p.variable(number).value
        return total

    def rate(self, p: LinkagePosition) -> Any:
        """The rate by psi."""
        total: Any = 0.0
        for number, weight in self.terms:
            total = total + weight * p.variable(number).rate
        return total


class Arm(NamedTuple):
    """One term of a place: `length` (m, or 1 in front of a displacement) along `angle`, times variable `slide` if >= 0."""

    length: float
    angle: Angle
    slide: int

    def _stretch(self, p: LinkagePosition) -> tuple[Any, Any]:
        """The arm's length, and its rate."""
        if self.slide < 0:
            return self.length, 0.0
        variable = p.variable(self.slide)
        return self.length * variable.value, self.length * variable.rate

    def along(self, p: LinkagePosition) -> Any:
        """Coordinate of the arm's end along the line from which its angle is measured: L cos(angle)."""
        return self._stretch(p)[0] * p.ns.cos(self.angle.value(p))

    def by_turning(self, p: LinkagePosition) -> Any:
        """Rate of that by the arm's turning: -L sin(angle)."""
        return -self._stretch(p)[0] * p.ns.sin(self.angle.value(p))

    def by_turning_slope(self, p: LinkagePosition) -> Any:
        """Slope of that by psi."""
        (length, rate), angle = self._stretch(p), self.angle.value(p)
        return -(rate * p.ns.sin(angle)) - length * p.ns.cos(angle) * self.angle.rate(p)

    def by_sliding(self, p: LinkagePosition) -> Any:
        """Rate of the end by the arm's displacement: cos(angle)."""
        return self.length * p.ns.cos(self.angle.value(p))

    def by_sliding_slope(self, p: LinkagePosition) -> Any:
        """Slope of that by psi."""
        return -self.length * p.ns.sin(self.angle.value(p)) * self.angle.rate(p)


# -- chain -------------------------------------------------------------------------------------------------------------

_COSINE_ROUNDING = 1e-15
_STEPS_A_CELL = 8.0


def family(mechanism: Mechanism, _: Mapping[str, float]) -> Family:
    """Chain of a linkage: each unknown straight from the crank, centres of mass and ports by arms from these.

    Raises:
        SceneError: if the linkage cannot be assembled, locks or branches, or does not return after the cycle.

    """
    cycle = followed(mechanism)
    linkage, loops = mechanism.linkage or cycle.solution.linkage, cycle.loops
    weighed = {link.name: link for link in linkage.links}
    forms = dict(zip(linkage.names, loops.angles, strict=True))
    velocities: dict[str, Velocity] = {}
    masses: list[Mass] = []
    weights: list[Weight] = []
    ports: dict[str, Port] = {}

    def require_shaft(holds: bool) -> None:
        if not holds:
            defect, expected = "a body called crank that does not turn with the driver", "another name for it"
            raise SceneError([Fault(f"{mechanism.path}.bodies.crank", defect, expected)])

    sources = ["crank"]  # the velocity of each variable: every unknown straight from the crank
    for number, name in enumerate(loops.names[1:], start=1):
        what, body = name.split(" of ", 1)
        require_shaft(body != "crank")
        velocities[body] = Velocity(body, what == "angle", (Term("crank", _variable_ratio(number)),))
        sources.append(body)

    for body in linkage.names[1:]:  # a body's rotation; that of the driver, where it is called `crank`, is the shaft itself
        form, inertia = forms[body], weighed[body].inertia
        terms = tuple(Term(sources[k], float(form.weights[k])) for k in np.flatnonzero(form.weights))
        if not terms:
            continue
        if body == "crank":
            require_shaft(terms == (Term("crank", 1.0),) and not linkage.sliding)
        else:
            velocities.setdefault(body, Velocity(body, True, terms))
            ports[body] = Port(body, _angle(form).value, not bool(form.weights @ cycle.winding))
        if inertia:
            masses.append(Mass(body, inertia, body))

    for joint in linkage.joints:
        if joint.kind not in (SLIDE, SLOT):
            continue
        number = 0 if joint.name == linkage.driver else loops.names.index(f"slide of {joint.name}")
        if number == 0:
            velocities[joint.name] = Velocity(joint.name, False, (Term("crank", 1.0),))
        ports[joint.name] = Port(joint.name, partial(_displacement, number=number))

    def arms(body: str, x: float, y: float) -> list[Arm]:
        """Place of a point of a body as a sum of arms, those that turn together put into one."""
        own = vector(x / loops.unit, y / loops.unit) * cis(forms[body].constant)
        origin = loops.origins[linkage.names.index(body)]
        places: dict[tuple[tuple[float, ...], int], Any] = {}
        for coefficient, turns, slide in [
            *zip(origin, loops.turns, loops.slides, strict=True),
            (own, forms[body].weights, -1),
        ]:
            key = tuple(turns.tolist()), int(slide)
            places[key] = places.get(key, 0.0) + coefficient
        return [
            Arm(length * (loops.unit if slide < 0 else 1.0), _angle(Form(np.array(turns), angle)), slide)
            for (turns, slide), at in places.items()
            for length, angle in _polar(at)
        ]

    def move(name: str, seen: list[Arm]) -> bool:
        """Velocity of a place along the line that its arms' angles count from; False if it has none."""
        ratios: dict[str, list[float | Ratio]] = {}
        for arm in seen:
            for k, weight in arm.angle.terms:  # -L sin(a) times its turning, and cos(a) times the displacement's rate
                ratios.setdefault(sources[k], []).append(_times(Ratio(arm.by_turning, arm.by_turning_slope), weight))
            if arm.slide >= 0 and arm.angle.terms:
                ratios.setdefault(sources[arm.slide], []).append(Ratio(arm.by_sliding, arm.by_sliding_slope))
            elif arm.slide >= 0 and not _negligible(cosine := cosine_of(arm.angle.constant)):
                ratios.setdefault(sources[arm.slide], []).append(arm.length * cosine)
        if ratios:
            terms = tuple(Term(source, reduce(_plus, parts)) for source, parts in ratios.items())
            velocities[name] = Velocity(name, False, terms)
        return bool(ratios)

    for body in linkage.names[1:]:
        link, mass = linkage.link(body), weighed[body].mass
        for axis, direction in (("x", 0.0), ("y", np.pi / 2)) if mass else ():
            name = f"{body}.com.{axis}"
            if move(name, _seen(arms(body, *link.com), direction)):
                masses.append(Mass(name, mass, body))
                weights.append(Weight(name, mass, direction, body))
    for port in mechanism.points:
        at = linkage.link(port.body).point(port.point)
        seen = _seen(arms(port.body, at.x, at.y), port.direction)
        if not move(port.name, seen):
            defect = f"{port.body}.{port.point}, which does not move along {np.degrees(port.direction):.6g} deg"
            expected = "a point that moves along its direction"
            raise SceneError([Fault(f"{mechanism.path}.ports.{port.name}", defect, expected)])
        ports[port.name] = Port(port.name, partial(_place, arms=seen))
    switches = _switches(cycle)
    return Family(
        velocities=tuple(velocities.values()),
        masses=tuple(masses),
        weights=tuple(weights),
        ports=ports,
        position=positions_of(cycle),
        breakpoints=tuple(sorted({*_near_locks(cycle), *switches})),
        switches=switches,
    )


def _negligible(number: Any) -> bool:
    """Tests whether a plain number is 0 but for rounding."""
    return not is_recorded(number) and abs(number) < _COSINE_ROUNDING


def _polar(at: Any) -> list[tuple[Any, float]]:
    """Lengths and angles whose sum is a complex number: of one with recorded parts these parts, so that it has no angle."""
    pairs = [(at.real, 0.0), (at.imag, 0.5 * np.pi)] if isinstance(at, Complex) else [(abs(at), float(np.angle(at)))]
    return [(length, angle) for length, angle in pairs if not _negligible(length)]


def _angle(form: Form) -> Angle:
    return Angle(tuple((int(k), float(form.weights[k])) for k in np.flatnonzero(form.weights)), form.constant)


def _seen(arms: list[Arm], direction: float) -> list[Arm]:
    """Arms whose angles count from a direction (rad)."""
    return [arm._replace(angle=arm.angle._replace(constant=arm.angle.constant - direction)) for arm in arms]


def _place(p: LinkagePosition, arms: list[Arm]) -> Any:
    """End point of a chain of arms, along the line from which their angles are measured."""
    total: Any = 0.0
    for arm in arms:
        total = total + arm.along(p)
    return total


def _displacement(p: LinkagePosition, number: int) -> Any:
    return p.psi if number == 0 else p.variable(number).value


def _variable_ratio(number: int) -> Ratio:
    return Ratio(lambda p: p.variable(number).rate, lambda p: p.variable(number).slope)


def _times(ratio: Ratio, factor: float) -> Ratio:
    if factor == 1.0:
        return ratio
    return Ratio(lambda p: factor * ratio.value(p), lambda p: factor * ratio.slope(p))


def _plus(first: float | Ratio, second: float | Ratio) -> float | Ratio:
    """Two ratios from one source in one."""
    if not isinstance(first, Ratio) and not isinstance(second, Ratio):
        return first + second
    a, b = (ratio if isinstance(ratio, Ratio) else _constant(ratio) for ratio in (first, second))
    return Ratio(lambda p: a.value(p) + b.value(p), lambda p: a.slope(p) + b.slope(p))


def _constant(ratio: float) -> Ratio:
    return Ratio(lambda _: ratio, lambda _: 0.0)


def _near_locks(cycle: Cyclic) -> Iterator[float]:
    """Yields coordinates of the driver where cells must end because a lock is near.

    The steps of the continuation shrink as the distance from a lock does: no cell is wider than some of them.
    """
    nodes = cycle.solution.trace.value[:, 0] * cycle.solution.scale
    steps, first = np.diff(nodes), 0
    for k in range(1, len(steps)):
        if nodes[k + 1] - nodes[first] > _STEPS_A_CELL * steps[first : k + 1].min():
            yield float(nodes[k])
            first = k


def _switches(cycle: Cyclic) -> tuple[float, ...]:
    """Coordinates of the driver at which a cam passes a breakpoint of its lift."""
    solution, period = cycle.solution, cycle.period
    places: set[float] = set(solution.kept.get(period, ()))
    if places:
        return tuple(sorted(places))
    for relation in solution.equations.loops.relations:
        lift = relation.lift
        if lift is None:
            continue
        for angle in lift.curve.breakpoints:
            passed = _passages(cycle, relation.first, angle, lift.period)
            places.update(passed if period is None else (q % period for q in passed))
    solution.kept[period] = places
    return tuple(sorted(places))


def _passages(cycle: Cyclic, form: Form, angle: float, every: float) -> Iterator[float]:
    """Coordinates of the driver at which a form passes an angle, on any turn."""
    solution, period = cycle.solution, cycle.period
    low, high = (solution.low, solution.high) if period is None else (0.0, period)
    nodes = np.unique(np.concatenate((solution.trace.value[:, 0] * solution.scale, np.linspace(low, high, 181))))
    nodes = nodes[(nodes >= low) & (nodes <= high)]

    def phase(q: Array) -> Array:
        return np.asarray((form.at(solution.movement(q).value) - angle) / every)

    def gap(q: float, whole: int) -> float:
        return float(phase(np.array([q]))[0]) - whole

    values = phase(nodes)
    for k in range(nodes.size - 1):
        first, last = sorted((values[k], values[k + 1]))
        a, b = float(nodes[k]), float(nodes[k + 1])
        for whole in range(int(np.ceil(first)), int(np.floor(last)) + 1):
            yield a if gap(a, whole) * gap(b, whole) > 0.0 else root(lambda q: gap(q, whole), a, b)  # noqa: B023


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
    main=("guide", "slider", "ram", "platen", "yoke", "rocker"),
    smooth=lambda mechanism: mechanism.linkage is None or all(pair.lift is None for pair in mechanism.linkage.couplings),
)
