"""Newton's iteration for flows that no inertia weighs, where resistors follow laws that are no straight lines.

One state at a time or many at once: steps are shortened, each state by itself, until the imbalance of efforts shrinks.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from bondgraph.faults import GraphError
from bondgraph.motion.linear import solve

Balance = tuple[list[Any], list[list[Any]]]  # residuals, and their slopes by rows
Equations = Callable[[list[Any]], Balance]

_STARTS = (1e-3, 1.0)  # not 0, where laws like f |f| have no slope and those like a root have a vertical one
_MOST = 200  # iterations, and a quarter as many halvings of a step
_SMALL, _ROUNDING = 1e-11, 1e-7  # of a flow: a step that leaves no error behind, one that rounding may make
_NOTHING = 1e-30


def settle(
    equations: Equations, size: int, shape: tuple[int, ...], where: str, near: Sequence[float] | None = None
) -> list[Any]:
    """The flows at which all residuals vanish, sought from `near` on if it is given.

    Raises:
        GraphError: where none are found, with `where` to say which flows these are.

    >>> settle(lambda u: ([u[0] * abs(u[0]) - 4.0], [[2.0 * abs(u[0])]]), 1, (), "pipe")
    [2.0]

    """
    starts = [[start * (1.0 + 0.1 * k) for k in range(size)] for start in _STARTS]
    for start in ([] if near is None else [list(near)]) + starts:
        found = _iterated(equations, [np.full(shape, value) for value in start] if shape else start)
        if found is not None:
            settled = [np.where(np.abs(value) > 10.0 * _NOTHING, value, 0.0) for value in found]
            return settled if shape else [float(value) for value in settled]
    raise GraphError(f"no flow of {where}, which no inertia weighs, solves the resistors' laws")


def _iterated(equations: Equations, flows: list[Any]) -> list[Any] | None:
    balance, before = _evaluated(equations, flows), np.inf
    for _ in range(_MOST):
        residual, slopes = balance
        try:
            step = [row[0] for row in solve(slopes, [[-r] for r in residual])]
        except GraphError:
            return None
        length, reach = _norm(step), _norm([f + s for f, s in zip(flows, step, strict=True)])
        if not np.all(np.isfinite(length)):
            return None
        done = (length <= _SMALL * reach + _NOTHING) | ((length <= _ROUNDING * reach) & (length >= 0.5 * before))
        if np.all(done):
            return [f + s for f, s in zip(flows, step, strict=True)]
        flows, balance = _shortened(equations, flows, step, _norm(residual), done)
        before = length
    return None


def _shortened(
    equations: Equations, flows: list[Any], step: Sequence[Any], before: Any, done: Any
) -> tuple[list[Any], Balance]:
    """The flows a step on, shortened where the residual would grow, with their residuals and slopes."""
    part: Any = 1.0
    for _ in range(_MOST // 4):
        trial = [f + part * s for f, s in zip(flows, step, strict=True)]
        balance = _evaluated(equations, trial)
        worse = ~((_norm(balance[0]) < before) | done)
        if not np.any(worse):
            break
        part = np.where(worse, 0.5 * part, part) if np.ndim(worse) else 0.5 * part
    return trial, balance


def _evaluated(equations: Equations, flows: list[Any]) -> Balance:
    """Residuals and slopes; not a number where a law is not defined, so that the step gets shorter."""
    try:
        with np.errstate(all="ignore"):
            return equations(flows)
    except (ValueError, ArithmeticError):
        bad = flows[0] * np.nan
        return [bad for _ in flows], [[bad for _ in flows] for _ in flows]


def _norm(values: Sequence[Any]) -> Any:
    """The length of a vector of flows, each state's by itself; of one flow, its size."""
    if len(values) == 1:
        return np.abs(values[0])
    with np.errstate(all="ignore"):
        return np.sqrt(sum(value * value for value in values))
