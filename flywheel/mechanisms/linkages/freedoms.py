"""Positions of a linkage with g drivers: closed loops, influence coefficients of all bodies and their derivatives.

Each driver's coordinate (rad of a pin, m of a slide) has a relation that fixes it. On a straight way between two of their
positions these relations move with the share of the way, which then is the linkage's one driver: so assembly, proven steps,
locks and branches are those of one degree of freedom. The centre of mass of every body has g influence coefficients g_i =
dr/dq_i and their derivatives g_ij, from the equations differentiated once and twice; g_ij by polarisation, from the second
derivatives along q_i, q_j and q_i + q_j.

>>> import numpy as np
>>> from flywheel.scene.linkage import Driver, Joint, Link, Linkage, Point
>>> o, tip = Point("o"), Point("tip", 1.0)
>>> bars = Link("upper", (o, tip)), Link("lower", (o, tip))
>>> pins = Joint("shoulder", "pin", "frame", "upper", o, o), Joint("elbow", "pin", "upper", "lower", tip, o)
>>> arm = Linkage(Link("frame", (o,)), bars, pins, "shoulder", further=(Driver("elbow"),))
>>> positions(arm, [0.0, np.pi / 2]).by("elbow").point("lower", tip).rate[:, 0].round(12).tolist()
[-1.0, 0.0]
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import lru_cache
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.mechanisms.linkages.assembly import assembled, gruebler, loose_everywhere, standing
from flywheel.mechanisms.linkages.equations import (
    SETTLED,
    Equations,
    Loops,
    Poses,
    check,
    driver_scales,
    inverse,
    loops,
    on_way,
)
from flywheel.mechanisms.linkages.positions import follow
from flywheel.numerics.faults import Fault, SceneError, array, entry
from flywheel.scene.linkage import Linkage

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


# -- assembly and the way from one position to the next ------------------------------------------------------------------

_RANK = 1e-9  # of the greatest singular value


class Assembly(NamedTuple):
    """A linkage where its guesses and sides hold.

    loops: with a relation for every driver, the last ones; `slides` (bases, variables): 1 if a basis function is
    stretched. The drivers' scaled coordinates are weights · z + offsets, (g,), in units of scales (m or rad). z: the
    variables at the start, (variables,). Of all bodies, the frame first: angles as turns · z + constants, mass (kg),
    inertia (kg m²), coms (m) in the body's own frame.
    """

    loops: Loops
    slides: Array
    z: Array
    weights: Array
    offsets: Array
    scales: Array
    turns: Array
    constants: Array
    mass: Array
    inertia: Array
    coms: Complex

    @property
    def linkage(self) -> Linkage:
        """The linkage."""
        return self.loops.linkage

    @property
    def freedoms(self) -> int:
        """Number of drivers."""
        return self.scales.size

    def drivers(self, z: Array) -> Array:
        """Scaled coordinates of the drivers at z (variables,), shape (g,)."""
        return np.asarray(self.weights @ z + self.offsets)


@lru_cache(maxsize=32)
def assembly(linkage: Linkage) -> Assembly:
    """A linkage assembled where its drivers start, by guesses and sides.

    Raises:
        SceneError: if the description or the assembly is at fault; for more or fewer drivers than degrees of freedom; for
            drivers that depend on each other.

    """
    equations = Equations(loops(linkage, several=True))
    count = len(linkage.drivers)
    names = [driver.joint for driver in linkage.drivers]
    drivers = f"{count} driver{'s' if count > 1 else ''} ({', '.join(names)})"

    def wrong(freedom: int, what: str = "") -> SceneError:
        defect = f"{drivers} of a linkage of {freedom} degrees of freedom (Gruebler {gruebler(linkage)}){what}"
        advice = "drive as many pins or slides as there are degrees of freedom"
        return SceneError(
            [Fault(f"{linkage.path}.driver", defect, f"{freedom} driver{'s' if freedom != 1 else ''}", advice)]
        )

    def freedom(z: Array) -> int:
        closures = equations.jacobian(z[None], equations.bases(z[None]))[0, :-count, 1:]
        return int(equations.loops.unknowns - (np.linalg.matrix_rank(closures, rtol=_RANK) if closures.size else 0))

    anywhere = np.concatenate(([0.0], 1.0 + 0.7 * np.sin(np.arange(1.0, equations.loops.unknowns + 1.0))))
    if loose_everywhere(equations):
        generic = freedom(anywhere)
        if generic > count:
            raise wrong(generic, ", which may move with the drivers held")
        defect, advice = f"{drivers} that depend on each other: the linkage may move with them held", "drive another"
        raise SceneError([Fault(f"{linkage.path}.driver", defect, "drivers that determine the position", advice)])
    try:
        z = assembled(equations)
    except SceneError:
        if freedom(anywhere) < count:
            raise wrong(freedom(anywhere)) from None
        raise
    if freedom(z) != count:
        raise wrong(freedom(z))
    forms = [relation.second for relation in equations.loops.relations[-count:]]
    bodies = (linkage.ground._replace(mass=0.0, inertia=0.0), *linkage.links)
    return Assembly(
        equations.loops,
        slides=np.eye(z.size)[equations.slide] * equations.sliding[:, None],
        z=z,
        weights=np.array([form.weights for form in forms]),
        offsets=np.array([form.constant for form in forms]),
        scales=driver_scales(equations.loops),
        turns=np.array([form.weights for form in equations.loops.angles]),
        constants=np.array([form.constant for form in equations.loops.angles]),
        mass=np.array([body.mass for body in bodies]),
        inertia=np.array([body.inertia for body in bodies]),
        coms=np.array([complex(*body.com) for body in bodies]),
    )


def end_of_way(assembly: Assembly, z: Array, q: Array) -> Array:
    """The variables at scaled coordinates q (g,) at the end of the straight way from z (variables,), proven step by step.

    Raises:
        SceneError: if the linkage locks or branches on the way, with the positions of all drivers there.

    """
    low = assembly.drivers(z)
    if np.array_equal(low, q):
        return z
    equations = Equations(on_way(assembly.loops, low, q))
    end = follow(equations, np.concatenate(([0.0], z[1:])), 0.0, 1.0).value[-1]
    return np.concatenate(([0.0], end[1:]))


def lock_fault(assembly: Assembly, q: Array) -> Fault:
    """Fault of a linkage too near to a lock or a branch, with its drivers at scaled coordinates q."""
    at = standing(Equations(on_way(assembly.loops, q, q)), 0.0)
    defect = f"a linkage that locks or branches with the {at}, or comes too close to that to decide"
    return Fault(assembly.linkage.path, defect, "one assembly all along the motion", "end before it, or change a length")


class Local(NamedTuple):
    """The equations of loops and couplings, then of the drivers, at one position z (variables,).

    whole, bare: basis functions with and without their displacements, (bases,); slopes: their derivatives by all
    variables, (bases, variables); laws: of every coupling, with two derivatives, (3,). gaps: residuals of loops and
    couplings. jacobian: of all equations by the unknowns.
    """

    z: Array
    whole: Complex
    bare: Complex
    slopes: Complex
    laws: list[Array]
    gaps: Array
    jacobian: Array

    @property
    def square(self) -> bool:
        """True if there are no redundant constraints."""
        return bool(self.jacobian.shape[0] == self.jacobian.shape[1])


def local(assembly: Assembly, z: Array) -> Local:
    """The equations at z: those of `Equations`, of one position alone and so without its axis of positions."""
    own = assembly.loops
    bare = np.exp(1j * (own.turns @ z))
    stretched = assembly.slides.any()
    whole = bare * np.where(own.slides >= 0, z[own.slides], 1.0) if stretched else bare
    slopes = 1j * whole[:, None] * own.turns
    if stretched:
        slopes += bare[:, None] * assembly.slides
    couplings = own.relations[: -assembly.freedoms]
    laws = [np.concatenate(pair.law(z[None])) for pair in couplings]
    gap, rows = own.closures @ whole, own.closures @ slopes
    second = [float(pair.second.at(z)) - law[0] - pair.phase for pair, law in zip(couplings, laws, strict=True)]
    ties = [pair.second.weights - law[1] * pair.first.weights for pair, law in zip(couplings, laws, strict=True)]
    gaps = np.concatenate((gap.real, gap.imag, second))
    jacobian = np.concatenate((rows.real, rows.imag, *(tie[None] for tie in ties), assembly.weights))[:, 1:]
    return Local(z, whole, bare, slopes, laws, gaps, jacobian)


class LinkageStation(NamedTuple):
    """A position: its equations, their Jacobian's inverse, and the sign of its determinant (0: redundant constraints)."""

    local: Local
    inverse: Array
    sense: float


def station(assembly: Assembly, z: Array) -> LinkageStation:
    """The position z; LinAlgError where its equations are singular."""
    here = local(assembly, z)
    return LinkageStation(here, inverse(here.jacobian), float(np.linalg.slogdet(here.jacobian)[0]) if here.square else 0.0)


_FARTHEST = 1e5  # rad or units the unknowns move by one of a driver: beyond it rounding, squared, spoils accelerations
_CONTRACTION = 0.25  # of each correction to the one before, and of the first to the step itself
_MOST_CORRECTIONS = 8


class Follower:
    """Positions that follow the drivers from the last one, by tangent and Newton's method, closed to rounding.

    Every correction must be at most a quarter of the one before, and the Jacobian's determinant keep its sign; if that
    fails, proven steps follow the way and report the lock or branch that they reach.
    """

    def __init__(self, assembly: Assembly, z: Array) -> None:
        self.assembly = assembly
        self.station = station(assembly, z)

    def at(self, q: Array) -> LinkageStation:
        """The position at scaled coordinates q, (g,)."""
        position = self._corrected(q)
        if position is None or position.sense != self.station.sense:
            position = station(self.assembly, end_of_way(self.assembly, self.station.local.z, q))
        if np.abs(position.inverse).max() > _FARTHEST:
            raise SceneError([lock_fault(self.assembly, q)])
        self.station = position
        return position

    def _corrected(self, q: Array) -> LinkageStation | None:
        """The position at q from the tangent at the last one; None if corrections do not shrink fast enough."""
        own, last = self.assembly, self.station
        rates = np.zeros((1, last.local.z.size))
        rates[0, 1:] = last.inverse[:, -own.freedoms :] @ (q - own.drivers(last.local.z))
        z, size = last.local.z + rates[0] + 0.5 * curvature(own, last, rates)[1][0], float(np.abs(rates).max())
        for _ in range(_MOST_CORRECTIONS):
            here = local(own, z)
            gap = np.concatenate((here.gaps, own.drivers(z) - q))
            try:
                change = np.linalg.solve(here.jacobian, -gap) if here.square else -(np.linalg.pinv(here.jacobian) @ gap)
            except np.linalg.LinAlgError:
                return None
            moved = float(np.abs(change).max())
            if not moved <= max(_CONTRACTION * size, SETTLED):
                return None
            z, size = z.copy(), moved
            z[1:] += change
            if moved <= SETTLED:
                return station(own, z)
        return None


class Fields(NamedTuple):
    """Velocity fields of all bodies (the frame first) at one position, one for each of k directions of the drivers.

    As complex numbers: places (m) of the origins of the bodies' frames, `arms` from there to the centres of mass (bodies,);
    `angles` (rad). `velocities` of the centres and `spins` at rates of the drivers along each direction, (k, bodies);
    `accelerations` and `turnings` at those rates, held constant: the second derivatives along the direction.
    """

    origins: Complex
    arms: Complex
    angles: Array
    velocities: Complex
    spins: Array
    accelerations: Complex
    turnings: Array


def curvature(assembly: Assembly, position: LinkageStation, rates: Array) -> tuple[Complex, Array]:
    """Second derivatives along rates of all variables (k, variables) that the drivers keep: basis functions, variables."""
    own, here, count = assembly.loops, position.local, assembly.freedoms
    turning = rates @ own.turns.T
    bent = -(turning**2) * here.whole + 2j * turning * (rates @ assembly.slides.T) * here.bare
    gap = bent @ own.closures.T
    pairs = zip(own.relations[:-count], here.laws, strict=True)
    couplings = [-law[2] * (rates @ pair.first.weights) ** 2 for pair, law in pairs]
    second = np.concatenate((gap.real, gap.imag, *(column[:, None] for column in couplings)), axis=1)
    slopes = np.zeros_like(rates)
    slopes[:, 1:] = -second @ position.inverse[:, :-count].T
    return bent + slopes @ here.slopes.T, slopes


def fields(assembly: Assembly, position: LinkageStation, directions: Array) -> Fields:
    """Velocity fields at a position, for directions (k, g) in rad and m."""
    own, here, count = assembly.loops, position.local, assembly.freedoms
    rates = np.zeros((len(directions), here.z.size))
    rates[:, 1:] = (directions / assembly.scales) @ position.inverse[:, -count:].T
    bent, slopes = curvature(assembly, position, rates)
    speed = own.unit * (rates @ here.slopes.T) @ own.origins.T
    bend = own.unit * bent @ own.origins.T
    angles = assembly.turns @ here.z + assembly.constants
    arms = assembly.coms * np.exp(1j * angles)
    spins, turnings = rates @ assembly.turns.T, slopes @ assembly.turns.T
    velocities, accelerations = speed + 1j * spins * arms, bend + (1j * turnings - spins**2) * arms
    return Fields(own.unit * (own.origins @ here.whole), arms, angles, velocities, spins, accelerations, turnings)


def inner_products(assembly: Assembly, v: Complex, spins: Array, a: Complex, turnings: Array) -> Array:
    """The sums of m v_i · a_j + J omega_i alpha_j over all bodies, shape (i, j)."""
    return np.asarray(((v.conj() * assembly.mass) @ a.T).real + (spins * assembly.inertia) @ turnings.T)


class Positions(NamedTuple):
    """All bodies of a linkage at n positions of its g drivers.

    q: the drivers' coordinates (rad or m), (g, n). value: x, y (m) of the origin of every body's own frame and its angle
    (rad), (bodies, 3, n), the frame first; rate: their influence coefficients by each driver, (g, bodies, 3, n); slope:
    the derivatives of these by each driver, (g, g, bodies, 3, n).
    """

    linkage: Linkage
    q: Array
    value: Array
    rate: Array
    slope: Array

    def by(self, driver: str) -> Poses:
        """Poses whose rate and slope are derivatives by one driver's coordinate, all others held."""
        names = {name: k for k, (name, _) in enumerate(self.linkage.drivers)}
        k = entry("driver", driver, names)
        return Poses(self.linkage, self.q[k], self.value, self.rate[k], self.slope[k, k])

    def motion(self, qdot: ArrayLike, qddot: ArrayLike = 0.0, t: ArrayLike | None = None) -> Poses:
        """Poses whose rate is velocity and whose slope is acceleration, for rates and accelerations of the drivers.

        qdot, qddot: (g, n), or a shape that broadcasts to it; t: the poses' `q`, (n,); their number if None.
        """
        first, second = (row_table(name, part, self.q) for name, part in (("qdot", qdot), ("qddot", qddot)))
        rate = np.einsum("jbin,jn->bin", self.rate, first)
        slope = np.einsum("jkbin,jn,kn->bin", self.slope, first, first) + np.einsum("jbin,jn->bin", self.rate, second)
        count = self.q.shape[1]
        times = np.arange(float(count)) if t is None else array("t", t)
        if times.shape not in ((), (count,)):
            raise SceneError([Fault("t", f"an array of shape {times.shape}", f"a number, or shape ({count},)")])
        return Poses(self.linkage, np.full(count, times), self.value, rate, slope)


def positions(linkage: Linkage, q: ArrayLike) -> Positions:
    """Positions of all bodies with influence coefficients and their derivatives, at coordinates q of the drivers.

    The linkage is followed along the straight way from where it is assembled to the first position, and on to each.

    Args:
        linkage: bodies, joints, couplings and drivers.
        q: rad of a pin, m of a slide, shape (g,) or (g, n).

    Raises:
        SceneError: if the linkage is not valid; for more or fewer drivers than degrees of freedom, or drivers that depend on
            each other; where it locks or branches on the way, with the positions of all drivers.

    """
    start, coordinates, _ = driver_rows(linkage, q)
    directions, polarised = pair_directions(start.freedoms)
    parts = []
    for position in stations(start, coordinates):
        motion = fields(start, position, directions)
        speeds = motion.velocities - 1j * motion.spins * motion.arms
        bends = motion.accelerations - (1j * motion.turnings - motion.spins**2) * motion.arms
        value, rate = pose_array(motion.origins, motion.angles), pose_array(speeds, motion.spins)[: start.freedoms]
        parts.append((value, rate, polarised(pose_array(bends, motion.turnings))))
    value, rate, slope = (np.stack(part, axis=-1) for part in zip(*parts, strict=True))
    return Positions(linkage, coordinates, value, rate, slope)


def pair_directions(count: int) -> tuple[Array, Callable[[Any], Any]]:
    """Directions e_i, then e_i + e_j, and the function from a quadratic form on them to the symmetric form on pairs."""
    unit, pairs = np.eye(count), list(combinations(range(count), 2))
    directions = np.array([*unit, *(unit[i] + unit[j] for i, j in pairs)])

    def polarised(each: Any) -> Any:
        form = np.empty((count, count, *each.shape[1:]), dtype=each.dtype)
        for i in range(count):
            form[i, i] = each[i]
        for k, (i, j) in enumerate(pairs, count):
            form[i, j] = form[j, i] = 0.5 * (each[k] - each[i] - each[j])
        return form

    return directions, polarised


def pose_array(points: Complex, angles: Array) -> Array:
    """x, y and angle in the last axis."""
    return np.stack((points.real, points.imag, angles), axis=-1)


def stations(start: Assembly, coordinates: Array) -> Iterator[LinkageStation]:
    """The equations at coordinates (g, n), one after the other."""
    z = start.z
    for column in coordinates.T:
        z = end_of_way(start, z, column / start.scales)
        yield station(start, z)


def driver_rows(linkage: Linkage, q: ArrayLike, **others: ArrayLike) -> tuple[Assembly, Array, dict[str, Array]]:
    """The assembly, coordinates as (g, n), and further rows of the same shape."""
    check(linkage)
    start = assembly(linkage)
    coordinates = array("q", q)
    if coordinates.ndim == 0 or len(coordinates) != start.freedoms or not coordinates.size or coordinates.ndim > 2:
        names = ", ".join(driver.joint for driver in linkage.drivers)
        raise SceneError([Fault("q", f"an array of shape {coordinates.shape}", f"a row for each of the drivers: {names}")])
    table = coordinates.reshape(start.freedoms, -1)
    return start, table, {name: row_table(name, values, table) for name, values in others.items()}


def row_table(name: str, values: ArrayLike, q: Array) -> Array:
    """Values for every driver and position: a number, (g,) or (g, n)."""
    rows = array(name, values)
    rows = rows[:, None] if rows.ndim == 1 else rows
    if rows.ndim > 2 or (rows.ndim == 2 and (len(rows) != len(q) or rows.shape[1] not in (1, q.shape[1]))):
        raise SceneError([Fault(name, f"an array of shape {np.shape(values)}", f"a number, or shape {q.shape}")])
    return np.array(np.broadcast_to(rows, q.shape))


def shaped_as(values: Array, q: ArrayLike) -> Array:
    """Drops the axis of positions for a single position."""
    return values if np.ndim(q) > 1 else values[..., 0]
