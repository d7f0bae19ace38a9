"""Reactions with actions that follow their own size (friction, inclined teeth), by Newton's iteration for all positions.

Without them the reactions are x0; unit passive actions add a response G, so that

    x = x0 + G (f * s(x)),   s_j(x) = |B_j x|

with s_j the size of the reaction that passive action j follows, f_j its factor. s is homogeneous of degree one,
s = s'(x) x, so that Newton's step needs the sizes y = s alone: (1 - s' G f) y = s' x0.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_LIMIT = 30
_CLOSE = 1e-12  # share of the largest size left over where the iteration stops
_TOLERATED = 1e-11  # and where it still counts as converged: rounding
_STAGES = np.linspace(0.1, 1.0, 10)  # in which friction is raised where Newton's iteration alone fails


class Settled(NamedTuple):
    """Sizes that passive actions follow, shape (n, passives), and how the iteration went.

    iterations: Newton steps of the slowest position; gap: what is left of s(x) - y, as a share of the largest size, (n,);
    converged: False where no solution grows out of the one without friction, (n,): the mechanism locks itself.
    """

    sizes: Array
    iterations: int
    gap: Array
    converged: Flags


def settle(free: Array, response: Array, factor: Array, forms: Array) -> Settled:
    """Sizes y with x = free + response (factor y) and y = |forms x|.

    Args:
        free: reactions without passive actions, (n, m).
        response: what a unit of each passive action adds to them, (n, m, p).
        factor: of each passive action, (n, p).
        forms: the linear forms whose root of squares is the size, (p, 2, m).

    A solution is taken only where det(1 - s' G f) > 0, as on the branch that starts at 1 without friction: past its root
    friction would have to push.

    A shoe of 0.1 m, tilted by a load of 10 N that is out of line by 0.02 m, with mu = 0.2: F = 10 + 2 mu F 0.02/0.1.

    >>> found = settle(np.array([[10.0]]), np.ones((1, 1, 1)), np.array([[0.08]]), np.array([[[1.0], [0.0]]]))
    >>> found.sizes.round(9).tolist(), found.converged.tolist()
    ([[10.869565217]], [True])

    """
    count, passives = factor.shape
    settled = Settled(np.zeros((count, passives)), 0, np.zeros(count), np.ones(count, dtype=bool))
    if not passives:
        return settled
    found = _newton(free, response * factor[:, None, :], forms, _sizes(free, forms))
    wrong = ~found.converged
    if not wrong.any():
        return found
    start, steps = _sizes(free[wrong], forms), found.iterations
    for share in _STAGES:
        again = _newton(free[wrong], response[wrong] * (share * factor[wrong])[:, None, :], forms, start)
        start, steps = np.where(again.converged[:, None], again.sizes, start), steps + again.iterations
    for whole, part in zip(
        (found.sizes, found.gap, found.converged), (again.sizes, again.gap, again.converged), strict=True
    ):
        whole[wrong] = part
    return found._replace(iterations=steps)


def _newton(free: Array, pull: Array, forms: Array, start: Array) -> Settled:
    """Newton's iteration from sizes `start`, `pull` being response times factor."""
    sizes, steps = start, 0
    gap, determinant = np.full(len(free), np.inf), np.ones(len(free))
    while steps < _LIMIT and np.any(gap > _CLOSE):
        steps += 1
        x = free + np.einsum("nmp,np->nm", pull, sizes)
        slopes = _slopes(x, forms)
        matrix = np.eye(sizes.shape[1]) - slopes @ pull
        determinant = np.linalg.det(matrix)
        singular = np.abs(determinant) < 1e-14
        matrix[singular] = np.eye(sizes.shape[1])
        sizes = np.linalg.solve(matrix, np.einsum("npm,nm->np", slopes, free)[..., None])[..., 0]
        gap = _gap(free, pull, forms, sizes)
    return Settled(sizes, steps, gap, (gap <= _TOLERATED) & (determinant > 1e-14))


def _gap(free: Array, pull: Array, forms: Array, sizes: Array) -> Array:
    x = free + np.einsum("nmp,np->nm", pull, sizes)
    scale = np.maximum(np.abs(sizes).max(axis=1), _sizes(free, forms).max(axis=1))
    gap = np.abs(_sizes(x, forms) - sizes).max(axis=1)
    return np.asarray(np.divide(gap, scale, out=np.zeros_like(gap), where=scale > 0))


def _sizes(x: Array, forms: Array) -> Array:
    """|B_j x|, shape (n, p)."""
    return np.asarray(np.hypot(*np.einsum("pkm,nm->knp", forms, x)))


def _slopes(x: Array, forms: Array) -> Array:
    """Derivatives of the sizes by x, shape (n, p, m); 0 where a size is 0."""
    parts = np.einsum("pkm,nm->npk", forms, x)
    size = np.linalg.norm(parts, axis=2, keepdims=True)
    unit = np.divide(parts, size, out=np.zeros_like(parts), where=size > 0)
    return np.asarray(np.einsum("npk,pkm->npm", unit, forms))
