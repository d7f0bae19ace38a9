"""Small linear systems over whatever a graph is evaluated in: floats, arrays, SymPy expressions, recordings."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from bondgraph.faults import GraphError
from bondgraph.laws import is_symbolic
from bondgraph.motion.recording import Node, recorded
from bondgraph.structure import SINGULAR

Rows = Sequence[Sequence[Any]]


def solve(matrix: Rows, right: Rows) -> list[list[Any]]:
    """X of A X = B, both given by rows; GraphError where A is singular, which is where a mechanism locks or branches.

    >>> solve([[2.0, 0.0], [1.0, 4.0]], [[2.0], [9.0]])
    [[1.0], [2.0]]
    """
    entries = [entry for row in (*matrix, *right) for entry in row]
    if any(isinstance(entry, Node) for entry in entries):
        return recorded(_plain, matrix, right)
    if any(is_symbolic(entry) for entry in entries):
        return _symbolic(matrix, right)
    size, columns = len(matrix), len(right[0])
    if size == 1 and not any(isinstance(entry, np.ndarray) for entry in entries):
        return [[_quotient(entry, matrix[0][0]) for entry in right[0]]]
    shape = np.broadcast_shapes(*(np.shape(entry) for entry in entries))
    a, b = np.empty((*shape, size, size)), np.empty((*shape, size, columns))
    for i in range(size):
        for j in range(size):
            a[..., i, j] = matrix[i][j]
        for j in range(columns):
            b[..., i, j] = right[i][j]
    try:
        solution = np.linalg.solve(a, b)
    except np.linalg.LinAlgError as error:
        raise GraphError(SINGULAR) from error
    if not shape:
        return [[float(value) for value in row] for row in solution]
    return [[solution[..., i, j] for j in range(columns)] for i in range(size)]


def solve_symmetric(lower: Rows, right: Sequence[Any]) -> list[Any]:
    """X of A x = b for a symmetric, positive definite A given by its lower triangle (by L D L^T, no pivoting needed).

    >>> solve_symmetric([[2.0], [1.0, 4.0]], [4.0, 9.0])
    [1.0, 2.0]
    """
    size = len(right)
    factor: list[list[Any]] = [[0.0] * size for _ in range(size)]
    pivots: list[Any] = []
    x: list[Any] = []
    for i in range(size):
        for j in range(i):
            inner = _less(lower[i][j], ((factor[i][k] * pivots[k], factor[j][k]) for k in range(j)))
            factor[i][j] = inner / pivots[j]
        pivots.append(_less(lower[i][i], ((factor[i][k] * factor[i][k], pivots[k]) for k in range(i))))
        if isinstance(pivots[i], float) and not pivots[i] > 0.0:
            raise GraphError(WEIGHTLESS)
        x.append(_less(right[i], ((factor[i][k], x[k]) for k in range(i))))
    x = [value / pivot for value, pivot in zip(x, pivots, strict=True)]
    for i in reversed(range(size)):
        x[i] = _less(x[i], ((factor[k][i], x[k]) for k in range(i + 1, size)))
    return x


WEIGHTLESS = (
    "the inertia that the motion sees vanishes or is negative at one of the positions (a dead centre without inertia on "
    "the other side?): the acceleration is not determined"
)


def total(terms: Iterable[Any]) -> Any:
    """The sum of terms, left to right, of whatever kind they are."""
    found: Any = 0.0
    for term in terms:
        found = found + term
    return found


def _less(value: Any, products: Any) -> Any:
    for a, b in products:
        value = value - a * b
    return value


def _quotient(value: Any, divisor: Any) -> Any:
    if divisor == 0.0:
        raise GraphError(SINGULAR)
    return value / divisor


def _plain(matrix: Rows, right: Rows) -> list[list[float]]:
    """Of floats alone, as recordings call it."""
    if len(matrix) == 1:
        return [[_quotient(entry, matrix[0][0]) for entry in right[0]]]
    try:
        solution: list[list[float]] = np.linalg.solve(np.array(matrix), np.array(right)).tolist()
    except np.linalg.LinAlgError as error:
        raise GraphError(SINGULAR) from error
    return solution


def _symbolic(matrix: Rows, right: Rows) -> list[list[Any]]:
    """Of SymPy expressions: numbers serve as pivots, and what these leave follows by Cramer's rule.

    A pivot that is no number may vanish at a position where the system as a whole does not.
    """
    size = len(matrix)
    rows = [[*row, *given] for row, given in zip(matrix, right, strict=True)]
    taken: list[tuple[int, int]] = []
    while (pivot := _next_pivot(rows, size, taken)) is not None:
        taken.append(pivot)
        for k in range(size):
            if k not in {row for row, _ in taken}:
                rows[k] = _eliminated(rows[k], rows[pivot[0]], pivot[1])
    left = [k for k in range(size) if k not in {row for row, _ in taken}]
    open_ = [k for k in range(size) if k not in {column for _, column in taken}]
    solution = dict(zip(open_, _cramer([rows[k] for k in left], open_, size), strict=True))
    for row, column in reversed(taken):
        known = [(rows[row][k], solution[k]) for k in solution if not _zero(rows[row][k])]
        solution[column] = [
            (value - sum(factor * found[n] for factor, found in known)) / rows[row][column]
            for n, value in enumerate(rows[row][size:])
        ]
    return [solution[k] for k in range(size)]


def _next_pivot(rows: Rows, size: int, taken: Sequence[tuple[int, int]]) -> tuple[int, int] | None:
    """The place of a number, not zero, in a row and a column that are free, with the fewest entries beside it."""
    free_rows = [k for k in range(size) if k not in {row for row, _ in taken}]
    free_columns = [k for k in range(size) if k not in {column for _, column in taken}]
    filled = {(i, j) for i in free_rows for j in free_columns if not _zero(rows[i][j])}
    numbers = [(i, j) for i, j in sorted(filled) if not getattr(rows[i][j], "free_symbols", None)]
    return min(numbers, key=lambda at: sum(at[0] == i or at[1] == j for i, j in filled), default=None)


def _eliminated(row: Sequence[Any], pivot: Sequence[Any], column: int) -> list[Any]:
    if _zero(row[column]):
        return list(row)
    factor = row[column] / pivot[column]
    return [a if _zero(b) else a - factor * b for a, b in zip(row, pivot, strict=True)]


def _cramer(rows: Rows, columns: Sequence[int], size: int) -> list[list[Any]]:
    import sympy  # type: ignore[import-untyped]

    if not rows:
        return []
    square = sympy.Matrix([[row[k] for k in columns] for row in rows])
    determinant = square.det("berkowitz")
    if determinant.is_zero:
        raise GraphError(SINGULAR)
    found = square.adjugate("berkowitz") * sympy.Matrix([row[size:] for row in rows]) / determinant
    return [list(found.row(k)) for k in range(found.rows)]


def _zero(entry: Any) -> bool:
    return not getattr(entry, "free_symbols", None) and not entry
