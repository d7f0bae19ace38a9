"""Positions of a linkage over a range of its driver: one assembly followed by steps that are proven not to leave it.

From a position z0 with Jacobian J0 (by the unknowns) and its inverse A, the tangent predicts u(t) = u0 + g t. Bounds H
of the second derivatives say how far residual and Jacobian can go from there, where F is zero to rounding:

    beta = max |A| t² H[d, d]/2,   kappa = max |A| H[t d + r, 1],   d = (1, |g|).

Where kappa <= 1/2 and beta <= (1 - kappa) r, Newton's map contracts the ball of radius r about u(t) into itself for every
t of the step: exactly one assembly lies there, and it is the one that was followed (Kantorovich). The step is the longest
for which this holds. It shrinks where the linkage comes near to a lock or a branch, and there the true lock is searched for.

The nodes carry value, rate and slope; between them a quintic through both ends predicts so well that one or two Newton
steps, for all positions at once, settle on rounding.

Source: L. V. Kantorovich, G. P. Akilov, Functional Analysis, Pergamon 1982, chapter XVIII; for paths: C. Beltrán, A. Leykin,
Certified numerical homotopy tracking, Experimental Mathematics 21 (2012) 69-83.
"""

from __future__ import annotations

from copy import copy
from functools import cached_property, lru_cache
from math import sqrt, tau
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.recording import NAMESPACE, Recorded
from flywheel.mechanisms.linkages.assembly import Mobility, assembled, mobility, place, singular_fault, standing
from flywheel.mechanisms.linkages.equations import (
    SETTLED,
    WINDOW,
    Equations,
    Poses,
    Track,
    check,
    correction,
    inverse,
    loops,
    settle,
    solved,
)
from flywheel.numerics.faults import Fault, SceneError, array, entry, number_faults, refuse
from flywheel.scene.linkage import Linkage

__all__ = ["Solution", "Tangent", "follow", "placed", "solve", "solve_over", "tangent"]

Array = NDArray[np.float64]


def placed(equations: Equations, movement: Track) -> tuple[Array, Array, Array]:
    """x, y (m) of the origins and angles (rad) of all bodies with two derivatives along a movement, (bodies, 3, n) each."""
    loops, (z, rate, slope) = equations.loops, movement
    places = equations.origins(equations.bases(z), rate, slope)
    turns = np.array([form.weights for form in loops.angles])
    constants = np.array([form.constant for form in loops.angles])
    angles = (z @ turns.T + constants, rate @ turns.T, slope @ turns.T)
    first, second, third = (
        np.stack((origin.real.T * loops.unit, origin.imag.T * loops.unit, angle.T), axis=1)
        for origin, angle in zip(places, angles, strict=True)
    )
    return first, second, third


# -- continuation ------------------------------------------------------------------------------------------------------

_MOST_STEPS = 100_000
_NEAR = 1e-5  # rad, or units: smaller steps start a search for a lock
_LEAST = 1e-12
_NOTHING = 1e-13  # rad, or units: least step
_SHORT = 0.02
_SHARED = 0.3  # units (or shares of it): greatest displacement in a step
_CONTRACTION = 0.25
_RESIDUAL = 1e-9


class Tangent(NamedTuple):
    """Rates (1, g) and slopes (0, g') at one position.

    `step` is the longest certified step: over it, nothing but the followed assembly lies within `radius` (of every
    variable) of the tangent.
    """

    rate: Array
    slope: Array
    step: float
    radius: Array


def follow(equations: Equations, z: Array, low: float, high: float) -> Track:
    """The assembly at z followed to both ends of the driver's range (scaled): nodes in ascending order of the driver.

    Raises:
        SceneError: if the linkage locks or branches on the way, naming the position and the assemblies there; where
        redundant
            joints overconstrain it.

    """
    loops = equations.loops
    upward = _nodes(equations, z, high, 1.0)
    nodes = [*reversed(_nodes(equations, z, low, -1.0)[1:]), *upward]
    trace = Track(*(np.array(part) for part in zip(*nodes, strict=True)))
    for part in trace:
        part.flags.writeable = False
    if loops.unknowns == loops.equations:
        return trace
    gaps = np.abs(equations.residual(trace.value, equations.bases(trace.value))).max(axis=0)
    wrong = int(np.argmax(gaps))
    if gaps[wrong] > _RESIDUAL:
        names = loops.paths[wrong // 2] if wrong < 2 * len(loops.closures) else ()
        loop, gap = " - ".join(names), gaps[wrong] * loops.unit
        defect = f"redundant joints that contradict each other: the loop {loop} opens by {gap:.3g} m"
        raise SceneError([Fault(f"{loops.linkage.path}.joints", defect, "1 degree of freedom", "take a joint of it away")])
    return trace


def _nodes(equations: Equations, z: Array, end: float, sense: float) -> list[tuple[Array, Array, Array]]:
    """Positions, rates and slopes from z to one end of the driver's range."""
    settled = settle(equations, z[None])[0][0]
    if not np.abs(settled - z).max() < _NEAR:
        raise SceneError([_lost(equations, z)])
    z, here, watched = settled, tangent(equations, settled), _NEAR
    nodes = [(z, here.rate, here.slope)]
    for _ in range(_MOST_STEPS):
        left = (end - float(z[0])) * sense
        if left <= _NOTHING:
            return nodes
        if here.step < min(watched, left):  # another assembly may be met just ahead
            close = min(max(1e3 * here.step, 1e-9), left + 1e-12)
            low, high = sorted((float(z[0]) - 1e-9 * sense, float(z[0]) + close * sense))
            if fault := singular_fault(equations, z, low, high, here.rate):
                raise SceneError([fault])
            if here.step < _LEAST:
                raise SceneError([_lost(equations, z)])
            watched = 0.25 * here.step
        step = min(here.step, left)
        moved = here.rate * (step * sense)
        ahead = z + moved + 0.5 * here.slope * step**2
        ahead[0] = end if step == left else ahead[0]
        (node,), (last,) = settle(equations, ahead[None])
        strayed = np.abs(node - z - moved)[1:]
        if not (last < _RESIDUAL and (strayed <= here.radius[1:] + _RESIDUAL).all()):
            raise SceneError([_lost(equations, z)])
        z, here = node, tangent(equations, node)
        nodes.append((z, here.rate, here.slope))
    raise SceneError([_lost(equations, z)])


def tangent(equations: Equations, z: Array) -> Tangent:
    """Influence coefficients at one position, and how far along them the assembly is certified.

    Displacements count in units; where one is small, as that of a pin which passes close to its slot's pivot, scaling each
    by its own size may certify a longer step.
    """
    bases = equations.bases(z[None])
    jacobian = equations.jacobian(z[None], bases)[0]
    try:
        inverted = inverse(jacobian[:, 1:])
    except np.linalg.LinAlgError:
        raise SceneError([_lost(equations, z)]) from None
    rate = np.concatenate(([1.0], -inverted @ jacobian[:, 0]))
    slope = np.concatenate(([0.0], -inverted @ equations.bending(bases, rate[None])[0]))
    if not inverted.size:
        return Tangent(rate, slope, np.inf, np.full(z.size, np.inf))
    step, radius = _certified(equations, z, inverted, rate, np.ones(z.size))
    if step >= _SHORT:
        return Tangent(rate, slope, step, radius)
    sliding = np.isin(np.arange(z.size), equations.loops.slides)
    own = np.where(sliding, np.minimum(np.abs(z), 1.0), 1.0)
    if sliding[1:].any() and (own > 0.0).all():
        other = _certified(equations, z, inverted, rate, own)
        step, radius = other if other[0] > step else (step, radius)
    return Tangent(rate, slope, step, radius)


def _certified(equations: Equations, z: Array, inverse: Array, rate: Array, sizes: Array) -> tuple[float, Array]:
    """Longest certified step and its radii with every variable scaled by its own size, shape (variables,)."""
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


_LESS_FAR = "change a length, or let the driver go less far: [stroke] from and to"


def _lost(equations: Equations, z: Array) -> Fault:
    """Fault of a position beyond which no step can be certified."""
    where = standing(equations, float(z[0]))
    defect = f"a linkage that locks or branches with the {where}, or comes too close to that to decide"
    return Fault(equations.loops.linkage.path, defect, "one assembly over the whole range of the driver", _LESS_FAR)


# -- solution ----------------------------------------------------------------------------------------------------------

_REFINEMENTS = 3
_MOST_RECORDED = 3  # Newton steps in what is recorded
_BEYOND = 1e-9  # of the range: tolerance of a position outside it
_RETURNS = 1e-9  # rad, or units: tolerance of a linkage that returns


class Solution:
    """A linkage over the range [low, high] of its driver's coordinate (rad, or m where it slides).

    `winding` is the gain of each variable over the range (rad) if that is whole turns after which the linkage returns; its
    positions are then known at any coordinate. None if it does not return. `kept` is what other modules evaluate of its
    positions, and keep with them, whatever its bodies weigh.
    """

    def __init__(self, equations: Equations, trace: Track, low: float, high: float) -> None:
        self.equations = equations
        self.trace = trace
        self.low, self.high = low, high
        self.linkage = equations.loops.linkage
        self.unit = equations.loops.unit
        self.scale = self.unit if self.linkage.sliding else 1.0
        self._nodes = trace
        self.winding: Array | None = None
        self._refine()
        # gain of every variable over the range; None if that is no whole number of turns after which all return
        turns = (self.high - self.low) / tau
        if self.linkage.sliding or turns < 0.5 or abs(turns - round(turns)) > _RETURNS:
            self.winding = None
        else:
            ends = self.movement(np.array([self.low, self.high])).value
            gain, slides = ends[1] - ends[0], [name.startswith("slide") for name in self.equations.loops.names]
            whole = np.where(slides, 0.0, tau * np.round(gain / tau))
            self.winding = whole if np.abs(gain - whole).max() < _RETURNS else None
        self.kept: dict[Any, Any] = {}

    def weighed(self, linkage: Linkage) -> Solution:
        """The positions of a linkage that has other masses alone."""
        solution = copy(self)
        solution.linkage = linkage
        return solution

    def _refine(self) -> None:
        """Nodes between, until the quintic predicts so well that one Newton step is the last."""
        for _ in range(_REFINEMENTS):
            driver = self._nodes.value[:, 0]
            middles = 0.5 * (driver[1:] + driver[:-1])
            if not middles.size or self.trace.value.shape[1] == 1:
                return
            if np.abs(correction(self.equations, self._predicted(middles))).max() < SETTLED:
                return
            between = self.movement(middles * self.scale)
            order = np.argsort(np.concatenate((driver, middles)), kind="stable")
            self._nodes = Track(*(np.concatenate(pair)[order] for pair in zip(self._nodes, between, strict=True)))
            del self._quintics

    def poses(self, q: ArrayLike) -> Poses:
        """Poses of all bodies at driver coordinates q (rad or m), any shape: taken as one row.

        Raises:
            SceneError: for positions outside the range that was followed, or that are no numbers.

        """
        coordinates = array("q", q).flatten()
        room = _BEYOND * (self.high - self.low) + 1e-15
        outside = ~((coordinates >= self.low - room) & (coordinates <= self.high + room))
        if outside.any():
            at, *ends = (
                place(self.equations, x / self.scale) for x in (float(coordinates[outside][0]), self.low, self.high)
            )
            defect, expected = f"a position of the driver of {at}", f"one from {' to '.join(ends)}, which was followed"
            raise SceneError([Fault(self.linkage.path, defect, expected)])
        value, rate, slope = placed(self.equations, self.movement(coordinates))
        return Poses(self.linkage, coordinates, value, rate / self.scale, slope / self.scale**2)

    def movement(self, q: Array) -> Track:
        """All variables at coordinates q, a little outside the range too, by Newton from the quintic."""
        z, equations = self._predicted(q / self.scale), self.equations
        if not z.shape[1] > 1:
            return Track(z, np.ones_like(z), np.zeros_like(z))
        z, last = settle(equations, z)
        bases = equations.bases(z)
        lost = ~(last < SETTLED)
        if equations.loops.equations > equations.loops.unknowns:
            lost |= ~(np.abs(equations.residual(z, bases)).max(axis=1) < SETTLED)
        if lost.any():
            at = place(equations, float(q[lost][0] / self.scale))
            defect = f"a position that Newton's iteration does not reach, {at}"
            raise SceneError([Fault(self.linkage.path, defect, "one within the range that was followed")])
        jacobian = equations.jacobian(z, bases)
        inverted = inverse(jacobian[:, :, 1:])
        rate = np.ones_like(z)
        rate[:, 1:] = -(inverted @ jacobian[:, :, :1])[..., 0]
        slope = np.zeros_like(z)
        slope[:, 1:] = -(inverted @ equations.bending(bases, rate)[:, :, None])[..., 0]
        return Track(z, rate, slope)

    def recorded(self, q: Recorded, anchor: Any) -> Track:
        """All variables at one recorded coordinate, as by `movement`, with a sufficient number of Newton steps.

        Cams follow the formula that holds at the anchor, which may be recorded too.

        Raises TypeError if no number is known to be sufficient.
        """
        equations, nothing, at = self.equations, np.zeros((1, 1)), None

        def settled(coordinate: Any) -> Array:
            z = self._predicted(np.array([coordinate / self.scale]))
            for _ in range(self.steps if z.shape[1] > 1 else 0):
                z = np.concatenate((z[:, :1], z[:, 1:] + correction(equations, z, at)), axis=1)
            return z

        if any(relation.lift is not None for relation in equations.loops.relations):
            at = settled(anchor) if isinstance(anchor, Recorded) else self.movement(np.array([float(anchor)])).value
        z = settled(q)
        if not z.shape[1] > 1:
            return Track(z, 1.0 + nothing, nothing)
        bases = equations.bases(z, at)
        jacobian = equations.jacobian(z, bases)
        rate = np.concatenate((1.0 + nothing, -solved(jacobian[:, :, 1:], jacobian[:, :, 0])), axis=1)
        slope = np.concatenate((nothing, -solved(jacobian[:, :, 1:], equations.bending(bases, rate))), axis=1)
        return Track(z, rate, slope)

    @cached_property
    def steps(self) -> int:
        """Newton steps until the next one would be rounding, wherever the quintic predicts worst."""
        driver, sizes = self._nodes.value[:, 0], list[float]()
        z = self._predicted(0.5 * (driver[1:] + driver[:-1]))
        for _ in range(_MOST_RECORDED):
            move = correction(self.equations, z)
            z[:, 1:] += move
            sizes.append(float(np.abs(move).max(initial=0.0)))
            if sizes[-1] < SETTLED:
                return len(sizes)
        raise TypeError(f"a linkage whose positions are not settled after {len(sizes)} steps of Newton's iteration")

    @cached_property
    def _quintics(self) -> Array:
        """Start and width of every stretch between nodes, then six coefficients of all variables there, (stretches, ...)."""
        trace = self._nodes
        width = np.diff(trace.value[:, :1], axis=0)
        first, last = width * trace.rate[:-1], width * trace.rate[1:]
        bent, bending = 0.5 * width**2 * trace.slope[:-1], 0.5 * width**2 * trace.slope[1:]
        gap = trace.value[1:] - trace.value[:-1] - first - bent
        tilt = last - first - 2 * bent
        curl = bending - bent
        c3 = 10 * gap - 4 * tilt + curl
        c4 = -15 * gap + 7 * tilt - 2 * curl
        c5 = 6 * gap - 3 * tilt + curl
        return np.concatenate((trace.value[:-1, :1], width, trace.value[:-1], first, bent, c3, c4, c5), axis=1)

    @cached_property
    def _columns(self) -> list[tuple[float, ...]]:
        """The columns of these quintics, as recordings take them."""
        return [tuple(column) for column in self._quintics.T.tolist()]

    def _predicted(self, x: Array) -> Array:
        """Variables at scaled coordinates x by Hermite's quintic through the nodes on both sides; also at a recorded one.

        Beyond the range by the turn that x itself lies in, where the linkage returns after it.
        """
        trace = self._nodes
        if len(trace.value) == 1:
            return np.asarray(trace.value[0] + trace.rate[0] * (x - trace.value[0, 0])[:, None])
        inner, recorder = trace.value[1:-1, 0], getattr(x[0], "recorder", None) if x.size else None
        ns, within, turns = np if recorder is None else NAMESPACE, x, None
        if self.winding is not None:
            turns = ns.floor((x - self.low) / (self.high - self.low))
            within = x - turns * (self.high - self.low)
        if recorder is None:
            table = self._quintics[np.searchsorted(inner, within, side="right")]
        else:
            table = np.array([recorder.tabulated(within[0], inner.tolist(), self._columns)], dtype=object)
        start, width = table[:, :1], table[:, 1:2]
        series = np.split(table[:, 2:], 6, axis=1)
        s = ns.clip((within[:, None] - start) / width, 0.0, 1.0)
        z = np.asarray(series[0] + s * (series[1] + s * (series[2] + s * (series[3] + s * (series[4] + s * series[5])))))
        if turns is not None:
            z = z + np.asarray(turns)[:, None] * self.winding
        z[:, 0] = x
        return z

    def coordinate(self, joint: str, poses: Poses) -> Track:
        """A joint's coordinate: a pin's angle of second less first (rad), a slide's displacement along its guide (m)."""
        one = entry("joint", joint, {joint.name: joint for joint in self.linkage.joints})
        turn = poses.angle(one.first)
        if one.kind == "pin":
            return Track(*(b - a for a, b in zip(turn, poses.angle(one.second), strict=True)))
        guide, moved = poses.point(one.first, one.first_at), poses.point(one.second, one.second_at)
        angle = turn.value + one.direction
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

    @property
    def mobility(self) -> Mobility:
        """Degrees of freedom where the driver starts, and redundant constraints."""
        z = self.trace.value[:1]
        return mobility(self.equations.loops, self.equations.jacobian(z, self.equations.bases(z))[0])


def solve(linkage: Linkage, low: float, high: float) -> Solution:
    """Follows a linkage over the range [low, high] of its driver's coordinate, rad, or m where it slides.

    Args:
        linkage: bodies, joints, couplings and driver.
        low: where the range begins; the linkage is assembled at `linkage.start` and followed from there to both ends.
        high: where it ends, above `low`.

    Raises:
        SceneError: if the description, degrees of freedom, assembly or the range are at fault: a lock or branch names
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
    return _continued(linkage.unweighed(), float(low), float(high)).weighed(linkage)


def solve_over(linkage: Linkage, q: ArrayLike) -> Solution:
    """Follows a linkage over the least range that holds driver's coordinates q, which may be a single one.

    Args:
        linkage: bodies, joints, couplings and driver.
        q: driver's coordinates, rad, or m where it slides, any shape.

    Raises:
        SceneError: as `solve`, and if there is no position.

    """
    coordinates = array("q", q)
    if not coordinates.size:
        raise SceneError([Fault("q", "no position", "finite numbers")])
    check(linkage)
    return _continued(linkage.unweighed(), float(coordinates.min()), float(coordinates.max())).weighed(linkage)


@lru_cache(maxsize=32)
def _continued(linkage: Linkage, low: float, high: float) -> Solution:
    equations = Equations(loops(linkage))
    if linkage.neighbour is not None:  # Newton's iteration starts where that is at each position
        return Solution(equations, _continued(linkage.neighbour, low, high).trace, low, high)
    scale = equations.loops.unit if linkage.sliding else 1.0
    reach = low / scale, high / scale, equations.loops.start
    return Solution(equations, follow(equations, assembled(equations), min(reach), max(reach)), low, high)
