"""Following an assembly along the driver's coordinate by steps that are proven not to leave it.

From a position z0 with Jacobian J0 (by the unknowns) and its inverse A, the tangent predicts u(t) = u0 + g t. Bounds H
of the second derivatives say how far residual and Jacobian can go from there, where F is zero to rounding:

    beta = max |A| t² H[d, d]/2,   kappa = max |A| H[t d + r, 1],   d = (1, |g|).

Where kappa <= 1/2 and beta <= (1 - kappa) r, Newton's map contracts the ball of radius r about u(t) into itself for every
t of the step: exactly one assembly lies there, and it is the one that was followed (Kantorovich). The step is the longest
for which this holds. It shrinks where the linkage comes near to a lock or a branch, and there the true lock is looked for.

Source: L. V. Kantorovich, G. P. Akilov, Functional Analysis, Pergamon 1982, chapter XVIII; for paths: C. Beltrán, A. Leykin,
Certified numerical homotopy tracking, Experimental Mathematics 21 (2012) 69-83.

A linkage followed over a range of its driver: poses and influence coefficients at any positions asked for.

The followed nodes carry value, rate and slope; between them a quintic through both ends predicts so well that one or
two Newton steps, for all positions at once, settle on rounding.
"""

from __future__ import annotations

from functools import lru_cache
from math import sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.mechanisms.linkages.assembly import assembled, start
from flywheel.mechanisms.linkages.equations import (
    SETTLED,
    Equations,
    Mobility,
    Settled,
    correction,
    inverse,
    loops,
    mobility,
    settle,
)
from flywheel.mechanisms.linkages.poses import WINDOW, Poses, Track, check
from flywheel.mechanisms.linkages.singular import met, place
from flywheel.numerics.arguments import array, known, number_faults, refuse
from flywheel.numerics.faults import Fault, SceneError
from flywheel.scene.linkage import Linkage

Array = NDArray[np.float64]

_MOST_STEPS = 100_000
_NEAR = 1e-5  # rad, or units: steps below it make us look for a lock
_LEAST = 1e-12
_NOTHING = 1e-13  # rad, or units: no step is worth while
_SHORT = 0.02
_SHARED = 0.3  # units (or shares of it): how far a displacement may move in a step
_CONTRACTION = 0.25
_RESIDUAL = 1e-9


class Trace(NamedTuple):
    """Positions followed, (nodes, variables), in ascending order of the driver z[:, 0], with two derivatives by it."""

    z: Array
    rate: Array
    slope: Array


class Tangent(NamedTuple):
    """What is known at one position: inverse Jacobian, rates (1, g), slopes (0, g').

    `step` is the longest certified step: over it, nothing but the followed assembly lies within `radius` (of every
    variable) of the tangent.
    """

    inverse: Array
    rate: Array
    slope: Array
    step: float
    radius: Array


def follow(equations: Equations, z: Array, low: float, high: float) -> Trace:
    """The assembly at z followed to both ends of the driver's range (scaled).

    Raises:
        SceneError: where the linkage locks or branches on the way, naming the position and what meets there.

    """
    upward = _followed(equations, z, high, 1.0)
    downward = _followed(equations, z, low, -1.0)[1:]
    nodes = [*reversed(downward), *upward]
    trace = Trace(*(np.array([node[k] for node in nodes]) for k in range(3)))
    for part in trace:
        part.flags.writeable = False
    _check_redundant(equations, trace)
    return trace


def _followed(equations: Equations, z: Array, end: float, sense: float) -> list[tuple[Array, Array, Array]]:
    """Nodes from z to the end of the driver's range."""
    settled = settle(equations, z[None]).z[0]
    if not np.abs(settled - z).max() < _NEAR:
        raise SceneError([_stuck(equations, z)])
    z = settled
    here, watched = tangent(equations, z), _NEAR
    nodes = [(z, here.rate, here.slope)]
    for _ in range(_MOST_STEPS):
        left = (end - float(z[0])) * sense
        if left <= _NOTHING:
            return nodes
        if here.step < min(watched, left):
            _check_lock(equations, z, here, sense, end)
            watched = 0.25 * here.step
        step = min(here.step, left)
        ahead = z + here.rate * (step * sense) + 0.5 * here.slope * step**2
        ahead[0] = end if step == left else ahead[0]
        found = settle(equations, ahead[None])
        strayed = np.abs(found.z[0] - z - here.rate * (step * sense))[1:]
        if not (found.last[0] < _RESIDUAL and (strayed <= here.radius[1:] + _RESIDUAL).all()):
            raise SceneError([_stuck(equations, z)])
        z = found.z[0]
        here = tangent(equations, z)
        nodes.append((z, here.rate, here.slope))
    raise SceneError([_stuck(equations, z)])


def tangent(equations: Equations, z: Array) -> Tangent:
    """Influence coefficients at one position, and how far along them the assembly is certified."""
    table = z[None]
    bases = equations.bases(table)
    jacobian = equations.jacobian(table, bases)[0]
    try:
        inverted = inverse(jacobian[:, 1:])
    except np.linalg.LinAlgError:
        raise SceneError([_stuck(equations, z)]) from None
    rate = np.concatenate(([1.0], -inverted @ jacobian[:, 0]))
    slope = np.concatenate(([0.0], -inverted @ equations.bending(table, bases, rate[None])[0]))
    return Tangent(inverted, rate, slope, *_certified(equations, z, inverted, rate))


def _certified(equations: Equations, z: Array, inverse: Array, rate: Array) -> tuple[float, Array]:
    """The longest step of the driver within which the followed assembly is the only one near the tangent, and how near.

    Displacements count in units; where one is small, as that of a pin which passes close to its slot's pivot, counting
    them in their own size may prove more.
    """
    if not inverse.size:
        return np.inf, np.full(z.size, np.inf)
    sliding = np.isin(np.arange(z.size), equations.loops.slides)
    best = _proven(equations, z, inverse, rate, np.ones(z.size))
    if best[0] < _SHORT and sliding[1:].any():
        own = np.where(sliding, np.minimum(np.abs(z), 1.0), 1.0)
        if (own > 0.0).all():
            best = max(best, _proven(equations, z, inverse, rate, own), key=lambda proof: proof[0])
    return best


def _proven(equations: Equations, z: Array, inverse: Array, rate: Array, sizes: Array) -> tuple[float, Array]:
    """Step and radii with every variable's distance counted in its own size, shape (variables,)."""
    table = z[None]
    size = np.abs(inverse) / sizes[1:, None]
    room = np.where(equations.sliding, _SHARED * sizes[equations.slide], 0.0)
    reach = np.abs(equations.bases(table).whole) + room  # of a displacement within the ball
    d = np.abs(rate)[None]
    ball = sizes[None].copy()
    ball[0, 0] = 0.0
    bent, along, across = (
        float((size @ equations.bound(table, reach, *steps)[0]).max()) for steps in ((d, d), (d, ball), (ball, ball))
    )
    radius = _CONTRACTION / max(across, 2 * _CONTRACTION / _SHARED)
    displaced = equations.loops.slides[equations.sliding]  # angles may move as far as they like
    moved = float((d[0, displaced] / sizes[displaced]).max(initial=0.0))
    radius = min(radius, 0.5 * WINDOW / max(float(equations.turned(ball)[0]), 1e-300))
    turned = float(equations.turned(d)[0])
    limits = ((_CONTRACTION, along), (sqrt(radius), sqrt(bent)), (_SHARED - radius, moved), (0.5 * WINDOW, turned))
    step = min(limit / rising if rising > 0.0 else np.inf for limit, rising in limits)
    return step, radius * sizes


def _check_lock(equations: Equations, z: Array, here: Tangent, sense: float, end: float) -> None:
    """Raise where the followed assembly meets another one just ahead: there the Jacobian is singular."""
    close = min(max(1e3 * here.step, 1e-9), abs(end - float(z[0])) + 1e-12)
    low, high = sorted((float(z[0]) - 1e-9 * sense, float(z[0]) + close * sense))
    if fault := met(equations, z, low, high, here.rate):
        raise SceneError([fault])
    if here.step < _LEAST:
        raise SceneError([_stuck(equations, z)])


def _check_redundant(equations: Equations, trace: Trace) -> None:
    """All equations must hold all along where there are more of them than unknowns; else the linkage is held too often."""
    loops = equations.loops
    if loops.unknowns == loops.equations:
        return
    gaps = np.abs(equations.residual(trace.z, equations.bases(trace.z))).max(axis=0)
    wrong = int(np.argmax(gaps))
    if gaps[wrong] > _RESIDUAL:
        names = loops.paths[wrong // 2] if wrong < 2 * len(loops.closures) else ()
        found = f"joints that hold it too often: the loop {' - '.join(names)} opens by {gaps[wrong] * loops.unit:.3g} m"
        raise SceneError([Fault(f"{loops.linkage.path}.joints", found, "1 degree of freedom", "take a joint of it away")])


def _stuck(equations: Equations, z: Array) -> Fault:
    """Where no step can be certified any more."""
    where = f"driver {equations.loops.linkage.driver} at {place(equations, float(z[0]))}"
    found = f"a linkage that locks or branches with the {where}, or comes too near to it to tell"
    return Fault(equations.loops.linkage.path, found, "one assembly over the whole range of the driver", "change a length")


# -- solution ----------------------------------------------------------------------------------------------------------


_REFINEMENTS = 3
_BEYOND = 1e-9  # of the range: how far outside it a position may be asked for


class Movement(NamedTuple):
    """All variables (scaled) at n positions with their derivatives by the driver's scaled coordinate, (n, variables)."""

    z: Array
    rate: Array
    slope: Array


class Solution:
    """A linkage over the range [low, high] of its driver's coordinate (rad, or m where it slides)."""

    def __init__(self, equations: Equations, trace: Trace, low: float, high: float) -> None:
        self.equations = equations
        self.trace = trace
        self._nodes = trace
        self.low, self.high = low, high
        self.linkage = equations.loops.linkage
        self.unit = equations.loops.unit
        self.scale = self.unit if self.linkage.sliding else 1.0
        self._refine()

    def poses(self, q: ArrayLike) -> Poses:
        """Poses of all bodies at driver coordinates q (rad or m), any shape: taken as one row.

        Raises:
            SceneError: for positions outside the range that was followed, or that are no numbers.

        """
        wanted = array("q", q).flatten()
        self._check(wanted)
        return self.poses_of(wanted, self.movement(wanted))

    def movement(self, q: Array) -> Movement:
        """All variables at coordinates q, a little outside the range too, by Newton from the quintic."""
        z = self._predicted(q / self.scale)
        if not z.shape[1] > 1:
            return Movement(z, np.ones_like(z), np.zeros_like(z))
        equations = self.equations
        found = settle(equations, z)
        self._check_settled(found, q)
        settled = found.z
        bases = equations.bases(settled)
        jacobian = equations.jacobian(settled, bases)
        inverted = inverse(jacobian[:, :, 1:])
        rate = np.ones_like(z)
        rate[:, 1:] = -(inverted @ jacobian[:, :, :1])[..., 0]
        slope = np.zeros_like(z)
        slope[:, 1:] = -(inverted @ equations.bending(settled, bases, rate)[:, :, None])[..., 0]
        return Movement(settled, rate, slope)

    def poses_of(self, q: Array, movement: Movement) -> Poses:
        """Poses from all variables."""
        loops, (z, rate, slope) = self.equations.loops, movement
        places = self.equations.origins(self.equations.bases(z), rate, slope)
        turns = np.array([form.weights for form in loops.angles])
        constants = np.array([form.constant for form in loops.angles])
        angles = (z @ turns.T + constants, rate @ turns.T, slope @ turns.T)
        found = []
        for order, (origin, angle) in enumerate(zip(places, angles, strict=True)):
            shape = np.stack((origin.real.T * self.unit, origin.imag.T * self.unit, angle.T), axis=1)
            found.append(shape / self.scale**order)
        return Poses(self.linkage, q, *found)

    def coordinate(self, joint: str, poses: Poses) -> Track:
        """A joint's coordinate: a pin's angle of second less first (rad), a slide's displacement along its guide (m)."""
        given = known("joint", joint, {joint.name: joint for joint in self.linkage.joints})
        first, second = poses.angle(given.first), poses.angle(given.second)
        if given.kind == "pin":
            return Track(*(b - a for a, b in zip(first, second, strict=True)))
        return _along(poses, joint)

    @property
    def mobility(self) -> Mobility:
        """Degrees of freedom where the driver starts, and redundant constraints."""
        z = self.trace.z[:1]
        return mobility(self.equations.loops, self.equations.jacobian(z, self.equations.bases(z))[0])

    def _refine(self) -> None:
        """Nodes between the followed ones, until the quintic predicts so well that one Newton step is the last."""
        for _ in range(_REFINEMENTS):
            nodes = self._nodes
            if len(nodes.z) < 2 or nodes.z.shape[1] == 1:
                return
            middles = 0.5 * (nodes.z[1:, 0] + nodes.z[:-1, 0])
            if np.abs(correction(self.equations, self._predicted(middles))).max() < SETTLED:
                return
            between = self.movement(middles * self.scale)
            order = np.argsort(np.concatenate((nodes.z[:, 0], middles)), kind="stable")
            parts = zip(nodes, between, strict=True)
            self._nodes = Trace(*(np.concatenate(pair)[order] for pair in parts))

    def _check_settled(self, found: Settled, q: Array) -> None:
        """Every position asked for must have been reached, and close all loops."""
        lost = ~(found.last < SETTLED)
        loops = self.equations.loops
        if loops.equations > loops.unknowns:
            gaps = self.equations.residual(found.z, self.equations.bases(found.z))
            lost |= ~(np.abs(gaps).max(axis=1) < SETTLED)
        if lost.any():
            what = (
                f"a position that Newton's iteration does not reach, {place(self.equations, float(q[lost][0] / self.scale))}"
            )
            raise SceneError([Fault(self.linkage.path, what, "one within the range that was followed")])

    def _check(self, q: Array) -> None:
        room = _BEYOND * (self.high - self.low) + 1e-15
        outside = ~((q >= self.low - room) & (q <= self.high + room))
        if outside.any():
            found = f"a position of the driver of {place(self.equations, float(q[outside][0] / self.scale))}"
            ends = (place(self.equations, end / self.scale) for end in (self.low, self.high))
            raise SceneError([Fault(self.linkage.path, found, f"one from {' to '.join(ends)}, which was followed")])

    def _predicted(self, x: Array) -> Array:
        """Variables at scaled coordinates x by the quintic through value, rate and slope of the nodes on both sides."""
        trace = self._nodes
        if len(trace.z) == 1:
            step = (x - trace.z[0, 0])[:, None]
            return np.asarray(trace.z[0] + trace.rate[0] * step)
        k = np.clip(np.searchsorted(trace.z[:, 0], x, side="right") - 1, 0, len(trace.z) - 2)
        width = (trace.z[k + 1, 0] - trace.z[k, 0])[:, None]
        s = np.clip((x - trace.z[k, 0])[:, None] / width, 0.0, 1.0)
        z = _quintic(s, width, trace, k)
        z[:, 0] = x
        return z


def _quintic(s: Array, width: Array, trace: Trace, k: NDArray[np.intp]) -> Array:
    """Hermite's quintic at the share s of the step after node k."""
    a, b = trace.z[k], trace.z[k + 1]
    first, last = width * trace.rate[k], width * trace.rate[k + 1]
    bent, bending = 0.5 * width**2 * trace.slope[k], 0.5 * width**2 * trace.slope[k + 1]
    gap = b - a - first - bent
    tilt = last - first - 2 * bent
    curl = bending - bent
    c3 = 10 * gap - 4 * tilt + curl
    c4 = -15 * gap + 7 * tilt - 2 * curl
    c5 = 6 * gap - 3 * tilt + curl
    return np.asarray(a + s * (first + s * (bent + s * (c3 + s * (c4 + s * c5)))))


def _along(poses: Poses, joint: str) -> Track:
    """Displacement along a guide, from the poses of its two bodies."""
    given = poses.linkage.joint(joint)
    guide, moved = poses.point(given.first, given.first_at), poses.point(given.second, given.second_at)
    turn = poses.angle(given.first)
    angle = turn.value + given.direction
    along = np.stack((np.cos(angle), np.sin(angle)))
    across = np.stack((-along[1], along[0]))
    gap, speed, bend = (b - a for a, b in zip(guide, moved, strict=True))
    value = (gap * along).sum(axis=0)
    rate = (speed * along).sum(axis=0) + turn.rate * (gap * across).sum(axis=0)
    slope = (
        (bend * along).sum(axis=0)
        + 2 * turn.rate * (speed * across).sum(axis=0)
        + turn.slope * (gap * across).sum(axis=0)
        - turn.rate**2 * value
    )
    return Track(value, rate, slope)


def solve(linkage: Linkage, low: float, high: float) -> Solution:
    """Follow a linkage over the range [low, high] of its driver's coordinate, rad, or m where it slides.

    Args:
        linkage: bodies, joints, couplings and driver.
        low: where the range begins; the linkage is assembled at `linkage.start` and followed from there to both ends.
        high: where it ends, above `low`.

    Raises:
        SceneError: where the description, degrees of freedom, assembly or the range are at fault: a lock or branch names
            its position.

    >>> import numpy as np
    >>> from flywheel.scene.linkage import Joint, Link, Linkage, Point
    >>> o, tip = Point("o"), Point("tip", 0.1)
    >>> crank, rod, slider = Link("crank", (o, tip)), Link("rod", (o, Point("end", 0.3)), guess=0.0), Link("slider", (o,))
    >>> joints = (Joint("pivot", "pin", "frame", "crank", o, o), Joint("pin", "pin", "crank", "rod", tip, o),
    ...           Joint("end", "pin", "rod", "slider", rod.points[1], o), Joint("guide", "slide", "frame", "slider", o, o))
    >>> machine = solve(Linkage(Link("frame", (o,)), (crank, rod, slider), joints, "pivot"), 0.0, 2 * np.pi)
    >>> poses = machine.poses([0.0, np.pi / 2])
    >>> machine.coordinate("guide", poses).value.round(12).tolist()
    [0.4, 0.282842712475]

    """
    refuse([*number_faults("low", low), *number_faults("high", high)])
    if not high > low:
        raise SceneError([Fault("high", f"{high:g}", f"a number above low, {low:g}")])
    check(linkage)
    return _continued(linkage, float(low), float(high))


def solve_over(linkage: Linkage, q: ArrayLike) -> Solution:
    """Follow a linkage over the least range that holds driver's coordinates q, which may be a single one.

    Args:
        linkage: bodies, joints, couplings and driver.
        q: driver's coordinates, rad, or m where it slides, any shape.

    Raises:
        SceneError: as `solve`, and where there is no position.

    """
    wanted = array("q", q)
    if not wanted.size:
        raise SceneError([Fault("q", "no position", "finite numbers")])
    check(linkage)
    return _continued(linkage, float(wanted.min()), float(wanted.max()))


@lru_cache(maxsize=32)
def _continued(linkage: Linkage, low: float, high: float) -> Solution:
    equations = Equations(loops(linkage))
    z = assembled(equations)
    scale = equations.loops.unit if linkage.sliding else 1.0
    reach = low / scale, high / scale, start(equations.loops)
    return Solution(equations, follow(equations, z, min(reach), max(reach)), low, high)


def newton_steps(solution: Solution, q: Any, away: float) -> tuple[float, ...]:
    """Largest step of each Newton iteration from positions put `away` (rad, units) off: it squares from one to the next."""
    z = solution.movement(np.atleast_1d(np.asarray(q, dtype=float))).z
    z[:, 1:] += away
    return settle(solution.equations, z).steps
