"""Newton's and Euler's equations of every body as one linear system a position: sum F = m a_G, sum M_G = J alpha.

Unknowns are the components of all reactions and the driving actions. There are three equations a moving body; a mechanism
whose driver moves it without locking makes them independent, so that forces can always be found, however many components
there are. With more unknowns than equations (redundant constraints) those that the equations leave open are named.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.faults import Fault, SceneError
from flywheel.linkage.components import COUPLE, Component, Passive, Unknowns
from flywheel.linkage.friction import Settled, settle
from flywheel.linkage.newton import solved
from flywheel.linkage.poses import Poses
from flywheel.linkage.wrenches import centres

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

OPEN = 1e-7
"""Share of the null space from which a component counts as open."""

_LOCKED = 1e-13  # of the largest singular value: below it the equations depend on one another


class Balance(NamedTuple):
    """Components in the order of the unknowns, (components, n): NaN where friction locks, one of many values where open.

    amounts: what the passive actions come to, (passives, n); others: wrenches of all that is no reaction, passive actions
    included, (bodies, 3, n); loose: which components are open, (components, n); open: an orthonormal basis of what can be
    added to the components without a load, (n, components, redundant); residual: of the equations as a share of
    the largest load, (n,).
    """

    values: Array
    amounts: Array
    others: Array
    loose: Flags
    open: Array
    settled: Settled
    residual: Array


class Scales(NamedTuple):
    """Equations of moments are divided by a length and unknown couples multiplied by it, so that all are forces."""

    rows: Array
    columns: Array


def solve(poses: Poses, unknowns: Unknowns, loads: Array) -> Balance:
    """All reactions and driving actions under `loads`, wrenches (bodies, 3, n) with the inertia forces among them."""
    middle = centres(poses).value
    matrix = _columns(unknowns.components, middle)
    passive = _columns(unknowns.passives, middle)
    right = loads[1:].reshape(-1, poses.q.size).T
    _check(poses, unknowns, matrix)
    scales = _scales(unknowns.components, matrix)
    scaled = matrix * scales.columns / scales.rows[:, None]
    wanted = -np.concatenate((right[..., None], passive), axis=2) / scales.rows[:, None]
    response, space = _respond(scaled, wanted)
    loose = np.linalg.norm(space, axis=2) > OPEN
    _check_locked(poses, response)
    response = response * scales.columns[:, None]
    settled = _settled(poses, unknowns, response, loose)
    amounts = _factors(unknowns.passives, poses.q.size) * settled.sizes
    values = response[..., 0] + np.einsum("nmp,np->nm", response[..., 1:], amounts)
    whole = right + np.einsum("nrp,np->nr", passive, amounts)
    gap = (np.einsum("nrm,nm->nr", matrix, values) + whole) / scales.rows
    residual = _relative(np.abs(gap).max(axis=1), np.abs(whole / scales.rows).max(axis=1))
    others = np.concatenate((np.zeros((1, *loads.shape[1:])), whole.T.reshape(-1, 3, poses.q.size)))
    values = np.where(settled.converged[:, None], values, np.nan)
    return Balance(values.T, amounts.T, others, loose.T, space, settled, residual)


def _columns(parts: tuple[Component, ...] | tuple[Passive, ...], middle: Array) -> Array:
    """Wrenches of unit actions on the moving bodies, shape (n, 3 bodies, parts)."""
    found = [part.pair.on_bodies(middle)[1:].reshape(-1, middle.shape[2]) for part in parts]
    empty = np.zeros((middle.shape[2], 3 * (len(middle) - 1), 0))
    return np.stack(found).transpose(2, 1, 0) if found else empty


def _factors(passives: tuple[Passive, ...], count: int) -> Array:
    return np.stack([passive.factor for passive in passives], axis=1) if passives else np.zeros((count, 0))


def _scales(components: tuple[Component, ...], matrix: Array) -> Scales:
    couples = np.array([component.unit == COUPLE for component in components])
    arms = np.abs(matrix[:, 2::3][:, :, ~couples])
    length = float(arms.max(initial=0.0)) or 1.0
    rows = np.ones(matrix.shape[1])
    rows[2::3] = length
    return Scales(rows, np.where(couples, length, 1.0))


def _check(poses: Poses, unknowns: Unknowns, matrix: Array) -> None:
    rows, columns = matrix.shape[1:]
    if columns < rows:
        found = f"{rows - columns} freedom(s) that nothing drives"
        raise SceneError([Fault(poses.linkage.path, found, "as many driven joints as degrees of freedom")])


def _check_locked(poses: Poses, response: Array) -> None:
    wrong = ~np.isfinite(response).all(axis=(1, 2))
    if wrong.any():
        at = f"{float(poses.q[np.argmax(wrong)]):.9g} {'m' if poses.linkage.sliding else 'rad'}"
        found = f"forces without limit where {poses.linkage.driver} stands at {at}"
        raise SceneError([Fault(poses.linkage.path, found, "a position where the driver moves everything")])


def _respond(matrix: Array, right: Array) -> tuple[Array, Array]:
    """Unknowns for each right side, of least norm where some are open, and the matrix's null space, (n, m, m - rows)."""
    rows, columns = matrix.shape[1:]
    if rows == columns:
        return solved(matrix, right), np.zeros((len(matrix), columns, 0))
    u, s, vh = np.linalg.svd(matrix)
    s = np.where(s > _LOCKED * s[:, :1], s, np.nan)
    found = vh[:, :rows].transpose(0, 2, 1) @ ((u.transpose(0, 2, 1) @ right) / s[..., None])
    return found, vh[:, rows:].transpose(0, 2, 1)


def _settled(poses: Poses, unknowns: Unknowns, response: Array, loose: Flags) -> Settled:
    """Sizes that the passive actions follow; SceneError where friction follows a component that is open."""
    index = {(c.joint, c.name): k for k, c in enumerate(unknowns.components)}
    forms = np.zeros((len(unknowns.passives), 2, len(unknowns.components)))
    faults = []
    for j, passive in enumerate(unknowns.passives):
        for k, form in enumerate(passive.forms):
            for name, weight in form.items():
                at = index[passive.joint, name]
                forms[j, k, at] = weight
                if loose[:, at].any() and np.any(passive.factor):
                    faults.append(_loose_fault(poses, passive, name))
    if faults:
        raise SceneError(dict.fromkeys(faults))
    return settle(response[..., 0], response[..., 1:], _factors(unknowns.passives, poses.q.size), forms)


def _loose_fault(poses: Poses, passive: Passive, name: str) -> Fault:
    return Fault(
        f"{poses.linkage.path}.{passive.joint}",
        f"{passive.name} that follows the {name}, which redundant constraints leave open",
        "a force that the equations determine",
        "take the friction away, or the constraint that is one too many",
    )


def _relative(part: Array, whole: Array) -> Array:
    return np.divide(part, whole, out=np.zeros_like(part), where=whole > 0)
