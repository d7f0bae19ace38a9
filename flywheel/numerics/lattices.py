"""Quasi-random points: lattices of Korobov, each shifted at random, so that several of them tell the error of a mean.

    x_k = frac(k (1, a, a², ...)/n + shift),   k = 0 ... n - 1

with the a that makes the worst mean of smooth periodic functions best (the figure P2 of the lattice).

Source: I. Sloan, S. Joe, Lattice Methods for Multiple Integration (1994), 4 and 5.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def points(count: int, variables: int, seed: list[int]) -> Array:
    """Points evenly within the unit cube, shape (variables, count).

    >>> found = points(64, 3, [0])
    >>> found.shape, bool(abs(found.mean() - 0.5) < 0.01), bool((0.0 <= found).all() and (found < 1.0).all())
    ((3, 64), True, True)
    """
    shift = np.random.default_rng(seed).random((variables, 1))
    return np.asarray((_generator(count, variables)[:, None] * np.arange(count) / count + shift) % 1.0)


@lru_cache(maxsize=16)
def _generator(count: int, variables: int) -> NDArray[np.int64]:
    """The powers of the best multiplier, modulo the count of points: one search for lattices that differ in their shift."""
    k, best, least = np.arange(count), np.ones(variables, dtype=np.int64), np.inf
    for a in range(1, max(count // 2, 2), 2):
        powers = np.array([pow(a, j, count) for j in range(variables)], dtype=np.int64)
        x = powers[:, None] * k % count / count
        worst = float(np.prod(1.0 + 2 * np.pi**2 * (x * x - x + 1 / 6), axis=0).mean())
        if worst < least:
            best, least = powers, worst
    return best
