"""Newton-Raphson on the loop equations, all positions at once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.linkage.equations import Equations

Array = NDArray[np.float64]

_MOST = 12
SETTLED = 1e-9  # a step below this leaves an error of its square: nothing


class Settled(NamedTuple):
    """What Newton's iteration came to: positions, their last step, and the largest step of each iteration."""

    z: Array
    last: Array
    steps: tuple[float, ...]


def settle(equations: Equations, z: Array) -> Settled:
    """Positions z (n, variables) corrected at the driver's given coordinate until a step is lost in its own square.

    A step below 1e-9 (rad, or units of length) is the last one: convergence is quadratic. Positions that do not converge
    have a `last` step that is larger; it is NaN where the Jacobian is singular.
    """
    z = z.copy()
    steps: list[float] = []
    last = np.full(len(z), np.inf)
    for _ in range(_MOST):
        move = correction(equations, z)
        z[:, 1:] += move
        last = np.abs(move).max(axis=1, initial=0.0)
        steps.append(float(np.nanmax(last, initial=0.0)))
        if not (last > SETTLED).any():
            break
    return Settled(z, last, tuple(steps))


def correction(equations: Equations, z: Array) -> Array:
    """One Newton step of the unknowns, shape (n, unknowns)."""
    bases = equations.bases(z)
    gap, jacobian = equations.residual(z, bases), equations.jacobian(z, bases)[:, :, 1:]
    if jacobian.shape[1] == jacobian.shape[2]:
        return solved(jacobian, -gap)
    return np.asarray(-(inverse(jacobian) @ gap[..., None])[..., 0])


def inverse(matrix: Array) -> Array:
    """Inverses of n matrices (n, rows, columns): where redundant constraints add rows, those of least squares.

    Raises LinAlgError for a square matrix that is singular.
    """
    if matrix.shape[-2] == matrix.shape[-1]:
        return np.asarray(np.linalg.inv(matrix))
    return np.asarray(np.linalg.pinv(matrix))


def solved(matrix: Array, right: Array) -> Array:
    """Solutions of n systems, (n, m, m) and (n, m) or (n, m, k); NaN for those that are singular."""
    vector = right.ndim == 2
    columns = right[..., None] if vector else right
    try:
        found = np.linalg.solve(matrix, columns)
    except np.linalg.LinAlgError:
        regular = np.linalg.slogdet(matrix)[0] != 0.0
        found = np.full(columns.shape, np.nan)
        found[regular] = np.linalg.solve(matrix[regular], columns[regular])
    return np.asarray(found[..., 0] if vector else found)
