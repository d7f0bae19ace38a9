"""A linkage followed over a range of its driver: poses and influence coefficients at any positions asked for.

The followed nodes carry value, rate and slope; between them a quintic through both ends predicts so well that one or
two Newton steps, for all positions at once, settle on rounding.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.arguments import array, known, number_faults, refuse
from flywheel.faults import Fault, SceneError
from flywheel.linkage.assembly import assembled, start
from flywheel.linkage.checks import check
from flywheel.linkage.continuation import Trace, follow
from flywheel.linkage.description import Linkage
from flywheel.linkage.equations import Equations
from flywheel.linkage.loops import loops
from flywheel.linkage.mobility import Mobility, mobility
from flywheel.linkage.newton import SETTLED, Settled, correction, inverse, settle
from flywheel.linkage.poses import Poses, Track
from flywheel.linkage.singular import place

Array = NDArray[np.float64]

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
    >>> from flywheel.linkage.description import Joint, Link, Linkage, Point
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
    return _followed(linkage, float(low), float(high))


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
    return _followed(linkage, float(wanted.min()), float(wanted.max()))


@lru_cache(maxsize=32)
def _followed(linkage: Linkage, low: float, high: float) -> Solution:
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
