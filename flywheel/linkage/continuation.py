"""Following an assembly along the driver's coordinate by steps that are proven not to leave it.

From a position z0 with Jacobian J0 (by the unknowns) and its inverse A, the tangent predicts u(t) = u0 + g t. Bounds H
of the second derivatives say how far residual and Jacobian can go from there, where F is zero to rounding:

    beta = max |A| t² H[d, d]/2,   kappa = max |A| H[t d + r, 1],   d = (1, |g|).

Where kappa <= 1/2 and beta <= (1 - kappa) r, Newton's map contracts the ball of radius r about u(t) into itself for every
t of the step: exactly one assembly lies there, and it is the one that was followed (Kantorovich). The step is the longest
for which this holds. It shrinks where the linkage comes near to a lock or a branch, and there the true lock is looked for.

Source: L. V. Kantorovich, G. P. Akilov, Functional Analysis, Pergamon 1982, chapter XVIII; for paths: C. Beltrán, A. Leykin,
Certified numerical homotopy tracking, Experimental Mathematics 21 (2012) 69-83.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.faults import Fault, SceneError
from flywheel.linkage.equations import Equations
from flywheel.linkage.lifts import WINDOW
from flywheel.linkage.newton import inverse, settle
from flywheel.linkage.singular import met, place

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
