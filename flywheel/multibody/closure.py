"""Poses of a linkage at a given driver's coordinate, and their influence coefficients, from the closure equations alone."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.faults import Fault
from flywheel.multibody.model import Model, State

Array = NDArray[np.float64]

_CLOSED = 1e-9  # of the scale: after a correction this small the next one, its square, is below rounding
_CONTRACTION = 0.25  # of each correction to the one before, and of the first to the step itself
_MOST_CORRECTIONS = 8
_SMALLEST = 1e-7  # of the scale: a step of the driver below it that still fails has met a lock

LEAST_MARGIN = 5e-5  # below it rounding, divided by its square, spoils accelerations: a lock or a branch is met
_STUCK = 1e-2  # g times the margin: at a lock g grows as the margin shrinks, at a branch it does not


class UnreachableError(ValueError):
    """A state that no motion of the linkage reaches; `fault` says why."""

    def __init__(self, fault: Fault) -> None:
        self.fault = fault
        super().__init__(str(fault))


def solved(model: Model, matrix: Array, right: Array) -> Array:
    """Solution of a linear system; by least squares where redundant closures make it consistent but singular."""
    try:
        if model.redundant:
            return np.asarray(np.linalg.lstsq(matrix, right, rcond=1e-12)[0])
        return np.asarray(np.linalg.solve(matrix, right))
    except np.linalg.LinAlgError:
        found = "a position where joints or masses leave the motion open"
        raise UnreachableError(Fault(model.linkage.path, found, "a motion that is determined", "end before it")) from None


class Closure:
    """Poses that follow the driver's coordinate from a known pose, by tangent and Newton's method.

    It starts each time from the pose found last; what it finds is exact to rounding and does not depend on that, as long
    as the way there is one assembly's. Steps are halved until every correction is at most a quarter of the one before, and
    doubled after.
    """

    def __init__(self, model: Model, x: Array) -> None:
        self.model, self.x = model, x
        self.unit = model.length if model.linkage.sliding else 1.0
        state = model.state(x, np.zeros_like(x))
        self.q, self.g = state.q, influence(model, state)
        self.sense = margin(model, state.jacobian, state.along).sense

    def at(self, q: float) -> tuple[Array, Array]:
        """Coordinates x at the driver's coordinate q, and their influence coefficients g = dx/dq.

        Raises:
            UnreachableError: where the linkage locks or branches before q.

        """
        least = _SMALLEST * self.unit
        step = q - self.q
        while self.q != q:
            ahead = q if abs(step) >= abs(q - self.q) else self.q + step
            x = self._corrected(ahead)
            if x is not None:
                self._accept(ahead, x)
                step *= 2.0
            elif abs(step) < least:
                raise UnreachableError(locked(self.model, self.q))
            else:
                step *= 0.5
        return self.x, self.g

    def _accept(self, q: float, x: Array) -> None:
        """Take over a pose, unless a lock or a branch is met there or lies on the way."""
        state = self.model.state(x, np.zeros_like(x))
        found = margin(self.model, state.jacobian, state.along)
        if found.sense != self.sense:
            raise UnreachableError(branched(self.model, self.q))
        g = influence(self.model, state)
        if found.least < LEAST_MARGIN:
            stuck = _size(self.model, g) * self.unit * found.least > _STUCK
            raise UnreachableError(locked(self.model, q) if stuck else branched(self.model, q))
        self.q, self.x, self.g = q, x, g

    def _corrected(self, q: float) -> Array | None:
        """The pose at q from the tangent at the last one; None if corrections do not shrink fast enough."""
        model, rest = self.model, np.zeros_like(self.x)
        ahead = self.g * (q - self.q)
        x, last = self.x + ahead, _size(model, ahead)
        for _ in range(_MOST_CORRECTIONS):
            state = model.state(x, rest)
            try:
                correction = solved(model, _rows(state), np.append(-state.value, q - state.q))
            except UnreachableError:
                return None
            size = _size(model, correction)
            if size > max(_CONTRACTION * last, _CLOSED):
                return None
            x, last = x + correction, size
            if size <= _CLOSED:
                return np.asarray(x)
        return None


def influence(model: Model, state: State) -> Array:
    """G = dx/dq of every coordinate: Phi_x g = 0, q_x g = 1."""
    return solved(model, _rows(state), np.append(np.zeros_like(state.value), 1.0))


class Margin(NamedTuple):
    """How far the closures are from a lock or branch: smallest singular value of their Jacobian over one more row.

    Rows are scaled to length 1. `sense`: sign of the determinant, which turns where assemblies meet; 0 where redundant
    closures leave no square matrix.
    """

    sense: float
    least: float


def margin(model: Model, jacobian: Array, row: Array) -> Margin:
    """The margin of the closures' Jacobian over a row that goes along the motion."""
    rows = np.vstack((jacobian, row)) * model.scale
    rows /= np.linalg.norm(rows, axis=1, keepdims=True)
    sense = 0.0 if model.redundant else float(np.linalg.slogdet(rows)[0])
    return Margin(sense, float(np.linalg.svd(rows, compute_uv=False)[-1]))


def bending(model: Model, state: State) -> Array:
    """d²x/dt² at zero acceleration of the driver, for the state's velocities; with v = g it is g' = d²x/dq²."""
    return solved(model, _rows(state), np.append(state.gamma, -state.bend))


def where(model: Model, q: float) -> str:
    """A driver's coordinate with its unit, for messages."""
    return f"{q:.9g} m" if model.linkage.sliding else f"{np.degrees(q):.9g} deg"


def locked(model: Model, q: float) -> Fault:
    """What is said where a linkage cannot follow its driver."""
    return Fault(f"{model.linkage.path}.driver", f"a lock at {where(model, q)}", "a motion that the joints allow")


def branched(model: Model, q: float) -> Fault:
    """What is said where assemblies meet, so that it is open in which one the motion goes on."""
    found = f"assemblies that meet at or just past {where(model, q)}"
    return Fault(model.linkage.path, found, "a motion within one assembly", "change a length, or end before")


def _rows(state: State) -> Array:
    return np.vstack((state.jacobian, state.along))


def _size(model: Model, change: Array) -> float:
    return float(np.abs(change / model.scale).max())
