"""Ordinary differential equations at any precision: the modified midpoint rule, extrapolated in the square of its step.

Gragg, Bulirsch and Stoer (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.9).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from mpmath import mp  # type: ignore[import-untyped]

COLUMNS = 11  # order 22
TOLERANCE = mp.mpf("1e-21")
State = list[Any]
Field = Callable[[Any, State], State]


class Step(NamedTuple):
    """The state at the end of a step, and an estimate of its error relative to the state."""

    state: State
    error: Any


def midpoint(field: Field, x: Any, start: State, slope: State, h: Any, n: int) -> State:
    """The state after n modified-midpoint steps; its error is a series in h²."""
    small = h / n
    before, now = start, [a + small * d for a, d in zip(start, slope, strict=True)]
    for m in range(1, n):
        slopes = field(x + m * small, now)
        before, now = now, [a + 2 * small * d for a, d in zip(before, slopes, strict=True)]
    return now


def step(field: Field, x: Any, start: State, h: Any) -> Step:
    """One extrapolated step."""
    slope = field(x, start)
    rows: list[State] = []
    error = mp.inf
    for j in range(1, COLUMNS + 1):
        row = [midpoint(field, x, start, slope, h, 2 * j)]
        for k in range(1, j):
            share = (mp.mpf(j) / (j - k)) ** 2 - 1
            row.append([b + (b - a) / share for a, b in zip(rows[k - 1], row[k - 1], strict=True)])
        if j > 1:
            error = max(
                abs(a - b) / (abs(a) + abs(b - c) + mp.mpf("1e-9")) for a, b, c in zip(row[-1], row[-2], start, strict=True)
            )
            if error < TOLERANCE:
                return Step(row[-1], error)
        rows = row
    return Step(rows[-1], error)


def advanced(field: Field, x: Any, start: State, h: Any, depth: int = 0) -> State:
    """The state after h, the step halved until its error vanishes."""
    whole = step(field, x, start, h)
    if whole.error < TOLERANCE:
        return whole.state
    if depth > 7:
        raise ArithmeticError(f"no convergence at {mp.nstr(x, 8)}")
    half = advanced(field, x, start, h / 2, depth + 1)
    return advanced(field, x + h / 2, half, h / 2, depth + 1)


def root(function: Callable[[Any], Any], a: Any, b: Any, fa: Any, fb: Any) -> Any:
    """The zero between a and b where the function has opposite signs: the secant, bisecting where it leaves."""
    x, fx, y, fy = a, fa, b, fb
    fine = mp.mpf("1e-22")
    for _ in range(200):
        c = y - fy * (y - x) / (fy - fx) if fy != fx else (a + b) / 2
        if not min(a, b) < c < max(a, b):
            c = (a + b) / 2
        fc = function(c)
        x, fx, y, fy = y, fy, c, fc
        a, fa, b = (c, fc, b) if fa * fc > 0 else (a, fa, c)
        if fc == 0 or abs(y - x) < fine * (1 + abs(y)):
            break
    return y


def newton(residual: Callable[[State], State], start: State, *, turns: int = 40) -> State:
    """The root of a small system by Newton's method, its matrix by differences; the step halved where there is no motion."""
    u, r = start, residual(start)
    for _ in range(turns):
        h = [mp.mpf("1e-14") * (abs(x) or 1) for x in u]
        columns = [residual([x + (h[j] if i == j else 0) for i, x in enumerate(u)]) for j in range(len(u))]
        matrix = mp.matrix([[(columns[j][i] - r[i]) / h[j] for j in range(len(u))] for i in range(len(u))])
        change = mp.lu_solve(matrix, mp.matrix([-x for x in r]))
        u, r, share = damped(residual, u, list(change), max(map(abs, r)))
        if share == 1 and max(abs(c) / (abs(x) or 1) for c, x in zip(change, u, strict=True)) < mp.mpf("1e-18"):
            return u
    raise ArithmeticError(f"Newton: {[mp.nstr(x, 8) for x in u]} leaves {[mp.nstr(x, 3) for x in r]}")


def damped(residual: Callable[[State], State], u: State, change: State, worst: Any) -> tuple[State, State, Any]:
    """The point after the greatest halved step at which the residual exists and does not grow fourfold."""
    share = mp.one
    while share > mp.mpf("1e-4"):
        try:
            point = [x + share * c for x, c in zip(u, change, strict=True)]
            r = residual(point)
            if max(map(abs, r)) < 4 * worst + mp.mpf("1e-20"):
                return point, r, share
        except (ArithmeticError, ValueError, TypeError):
            pass
        share /= 2
    raise ArithmeticError("Newton: no way down")
