"""The loop equations in numbers: residual, Jacobian, second derivatives along a motion, and bounds on how they vary.

Everything is evaluated for n positions at once: z has shape (n, variables), residuals (n, equations).
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.linkage import lifts
from flywheel.linkage.loops import Form, Loops, Relation

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

Lifted = tuple[Array, Array, Array] | None

_SMALL = 400  # numbers: a smaller matrix is multiplied faster without BLAS


class Bases(NamedTuple):
    """The basis functions at n positions: `whole` with the displacement in front, `bare` without, shape (n, bases).

    `lifts` holds for every coupling what its law gives there: lift, slope, second derivative, (n,) each; None for a ratio.
    """

    whole: Complex
    bare: Complex
    lifts: tuple[tuple[Array, Array, Array] | None, ...] = ()


class Equations:
    """The equations of `Loops`: two for every closure (real and imaginary part), then one for every coupling."""

    def __init__(self, loops: Loops) -> None:
        self.loops = loops
        self.sliding = loops.slides >= 0
        self.slide = np.where(self.sliding, loops.slides, 0)
        self._plan()

    def _plan(self) -> None:
        """Matrices that give the Jacobian of the closures straight from the basis functions."""
        loops = self.loops
        closures, bases = loops.closures.shape
        variables = len(loops.names)
        held = np.zeros((bases, variables))
        held[self.sliding, loops.slides[self.sliding]] = 1.0
        shape = bases, closures * variables
        self._turned = (1j * loops.closures[:, :, None] * loops.turns[None]).transpose(1, 0, 2).reshape(shape)
        self._moved = (loops.closures[:, :, None] * held[None]).transpose(1, 0, 2).reshape(shape)
        self._any_moved = bool(np.any(self._moved))
        self._shape = (closures, variables)

    def bases(self, z: Array) -> Bases:
        """Basis functions at positions z."""
        bare = np.exp(1j * (z @ self.loops.turns.T))
        lifts = tuple(_law(r, _at(r.first, z)) if r.lift else None for r in self.loops.relations)
        whole = bare * np.where(self.sliding, z[:, self.slide], 1.0) if self.sliding.any() else bare
        return Bases(whole, bare, lifts)

    def residual(self, z: Array, bases: Bases) -> Array:
        """Left sides of all equations."""
        gaps = bases.whole @ self.loops.closures.T
        columns = [gaps.real, gaps.imag] if gaps.shape[1] else []
        columns += [_relation(*pair, z)[:, None] for pair in self._couplings(bases)]
        return self._ordered(np.concatenate(columns, axis=1)) if columns else np.zeros((len(z), 0))

    def _couplings(self, bases: Bases) -> Iterator[tuple[Relation, Lifted]]:
        return zip(self.loops.relations, bases.lifts, strict=True)

    def _ordered(self, table: Array) -> Array:
        """Real and imaginary parts of each closure side by side."""
        return table[:, self._order]

    @cached_property
    def _order(self) -> NDArray[np.intp]:
        closures = self._shape[0]
        pairs = np.stack((np.arange(closures), closures + np.arange(closures)), axis=1).ravel()
        return np.concatenate((pairs, np.arange(2 * closures, self.loops.equations)))

    def jacobian(self, z: Array, bases: Bases) -> Array:
        """Derivatives of all equations by all variables, shape (n, equations, variables)."""
        flat = _product(bases.whole, self._turned)
        if self._any_moved:
            flat = flat + _product(bases.bare, self._moved)
        closures, variables = self._shape
        found = flat.reshape(len(z), closures, variables)
        parts = np.stack((found.real, found.imag), axis=2).reshape(len(z), 2 * closures, variables)
        if not self.loops.relations:
            return parts
        lines = [_relation_rates(*pair, z)[:, None, :] for pair in self._couplings(bases)]
        return np.concatenate([parts, *lines], axis=1)

    def bending(self, z: Array, bases: Bases, rate: Array) -> Array:
        """Second derivative of all equations along a motion with constant rates, d² F/dt² with z'' = 0."""
        second = _second(bases, rate @ self.loops.turns.T, self._pace(rate))
        gaps = second @ self.loops.closures.T
        columns = [gaps.real, gaps.imag] if gaps.shape[1] else []
        columns += [_relation_bending(*pair, rate)[:, None] for pair in self._couplings(bases)]
        return self._ordered(np.concatenate(columns, axis=1)) if columns else np.zeros((len(z), 0))

    def _pace(self, rate: Array) -> Array | float:
        return np.where(self.sliding, rate[:, self.slide], 0.0) if self.sliding.any() else 0.0

    def origins(self, bases: Bases, rate: Array, slope: Array) -> tuple[Complex, Complex, Complex]:
        """Bodies' origins (units) as complex numbers with first and second derivative, each of shape (n, bodies)."""
        turning, pace = rate @ self.loops.turns.T, self._pace(rate)
        first = 1j * turning * bases.whole + pace * bases.bare
        second = _second(bases, turning, pace) + 1j * (slope @ self.loops.turns.T) * bases.whole
        second = second + self._pace(slope) * bases.bare
        places = self.loops.origins.T
        return _product(bases.whole, places), _product(first, places), _product(second, places)

    # -- bounds ------------------------------------------------------------------------------------------------------

    @cached_property
    def _moduli(self) -> Array:
        """Absolute coefficients of every equation's basis functions: a closure's two parts share one."""
        return np.repeat(np.abs(self.loops.closures), 2, axis=0)

    def turned(self, step: Array) -> Array:
        """How far (rad) the cams turn in a step of z (absolute values), the farthest of them, shape (n,)."""
        turns = [step @ np.abs(r.first.weights) for r in self.loops.relations if r.lift is not None]
        return np.max(turns, axis=0) if turns else np.zeros(len(step))

    def bound(self, z: Array, reach: Array, *steps: Array) -> Array:
        """Bound of the second (third) derivative of every equation near z, contracted with two (three) steps of z.

        reach: largest |displacement| of each basis function there, (n, bases); steps: absolute values, (n, variables).
        It holds as far from z as cams do not turn farther than `lifts.WINDOW`.
        """
        turned = [step @ np.abs(self.loops.turns).T for step in steps]
        held = [np.where(self.sliding, step[:, self.slide], 0.0) for step in steps]
        total = reach * np.prod(turned, axis=0)
        for k in range(len(steps)):
            total = total + held[k] * np.prod([t for j, t in enumerate(turned) if j != k], axis=0)
        found = total @ self._moduli.T
        if not self.loops.relations:
            return np.asarray(found)
        extra = []
        for relation in self.loops.relations:
            along = [step @ np.abs(relation.first.weights) for step in steps]
            extra.append(_law_bound(relation, z, len(steps)) * np.prod(along, axis=0))
        return np.concatenate((found, np.stack(extra, axis=1)), axis=1)


def _product(table: Complex, matrix: Complex) -> Complex:
    """The product of a long table and a small matrix: BLAS would spend its time on starting threads."""
    if matrix.size > _SMALL:
        return np.asarray(table @ matrix)
    return np.asarray(np.einsum("nk,km->nm", table, matrix))


def _second(bases: Bases, turning: Array, pace: Array | float) -> Complex:
    """Second derivative of the basis functions at constant rates."""
    return -(turning**2) * bases.whole + 2j * turning * pace * bases.bare


def _at(form: Form, z: Array) -> Array:
    return np.asarray(z @ form.weights + form.constant)


def _law(relation: Relation, angle: Array) -> tuple[Array, Array, Array]:
    """A cam's lift with two derivatives, in scaled units."""
    assert relation.lift is not None
    value, first, second = lifts.at(relation.lift, angle)
    return relation.scale * value, relation.scale * first, relation.scale * second


def _law_bound(relation: Relation, z: Array, order: int) -> Array | float:
    if relation.lift is None:
        return 0.0
    return abs(relation.scale) * lifts.bounds(relation.lift).near(_at(relation.first, z), order)


def _relation(relation: Relation, lifted: Lifted, z: Array) -> Array:
    target = relation.ratio * _at(relation.first, z) if lifted is None else lifted[0]
    return np.asarray(_at(relation.second, z) - target - relation.phase)


def _relation_rates(relation: Relation, lifted: Lifted, z: Array) -> Array:
    if lifted is None:
        line = relation.second.weights - relation.ratio * relation.first.weights
        return np.broadcast_to(line, (len(z), line.size))
    return np.asarray(relation.second.weights - lifted[1][:, None] * relation.first.weights)


def _relation_bending(relation: Relation, lifted: Lifted, rate: Array) -> Array:
    if lifted is None:
        return np.zeros(len(rate))
    return np.asarray(-lifted[2] * (rate @ relation.first.weights) ** 2)
