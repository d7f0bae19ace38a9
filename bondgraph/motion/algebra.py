"""Arithmetic that a walk over a graph needs: small linear systems and Newton's iteration over every kind of number.

Linear systems are solved over whatever a graph is evaluated in: floats, arrays, SymPy expressions, recorded numbers (of
which a solution stays one call). `settle` finds the flows that no inertia weighs where resistors follow laws that are no
straight lines, one state at a time or many at once.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from bondgraph.elements import SINGULAR, GraphError, exact, is_symbolic
from bondgraph.numerics import components

Rows = Sequence[Sequence[Any]]


def solve(matrix: Rows, right: Rows) -> list[list[Any]]:
    """X of A X = B, both given by rows; GraphError where A is singular, which is where a mechanism locks or branches.

    >>> solve([[2.0, 0.0], [1.0, 4.0]], [[2.0], [9.0]])
    [[1.0], [2.0]]
    """
    entries, size, columns = [entry for row in (*matrix, *right) for entry in row], len(matrix), len(right[0])
    recorder = next((entry.recorder for entry in entries if hasattr(entry, "recorder")), None)
    if recorder is not None:  # one call on the entries

        def flat(*values: Any) -> tuple[Any, ...]:
            a = [values[i * size : (i + 1) * size] for i in range(size)]
            b = [values[i : i + columns] for i in range(size * size, len(values), columns)]
            return tuple(entry for row in _plain(a, b) for entry in row)

        results = recorder.call(flat, entries, size * columns)
        return [results[i * columns : (i + 1) * columns] for i in range(size)]
    if any(is_symbolic(entry) for entry in entries):
        return _symbolic(matrix, right)
    if not any(isinstance(entry, np.ndarray) for entry in entries):
        return _plain(matrix, right)
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
    return [[solution[..., i, j] for j in range(columns)] for i in range(size)]


def eliminated(
    rows: Sequence[Mapping[int, Any]], right: Sequence[Mapping[int, Any]], step: Callable[[Any], Any] = lambda entry: entry
) -> dict[int, dict[int, Any]]:
    """X of A X = B over any field, the rows of A, B and X by their entries that are not 0.

    Numbers serve as pivots first, and what has the fewest neighbours. `step` is applied to every intermediate result.

    >>> from fractions import Fraction
    >>> eliminated([{0: Fraction(2), 1: Fraction(1)}, {1: Fraction(4)}], [{7: Fraction(3)}, {}])
    {1: {}, 0: {7: Fraction(3, 2)}}
    """
    table, order, left = (
        [(dict(row), dict(right_side)) for row, right_side in zip(rows, right, strict=True)],
        [],
        set(range(len(rows))),
    )

    def subtract(row: dict[int, Any], factor: Any, other: Mapping[int, Any]) -> None:
        for v, a in other.items():
            row[v] = step(row[v] - factor * a if v in row else -factor * a)
            if row[v] == 0:
                del row[v]

    while left:
        beside = Counter(v for k in left for v in table[k][0])
        fills = [((len(table[k][0]) - 1) * (beside[v] - 1), k, v) for k in left for v in table[k][0]]
        can = [
            (fill, bool(getattr(table[k][0][v], "free_symbols", ())), k, v) for fill, k, v in fills if table[k][0][v] != 0
        ]
        if not can:
            raise GraphError(SINGULAR)
        *_, own, pivot = min(can)
        left.remove(own)
        entry = table[own][0].pop(pivot)
        order.append((own, pivot, entry))
        for k in (k for k in left if pivot in table[k][0]):
            factor = step(table[k][0].pop(pivot) / entry)
            for row, other in zip(table[k], table[own], strict=True):
                subtract(row, factor, other)
    columns: dict[int, dict[int, Any]] = {}
    for own, pivot, entry in reversed(order):
        row, right_side = table[own]
        for v, a in row.items():
            subtract(right_side, a, columns[v])
        columns[pivot] = {c: step(b / entry) for c, b in right_side.items()}
    return columns


def solve_symmetric(lower: Rows, right: Sequence[Any]) -> list[Any]:
    """X of A x = b for a symmetric, positive definite A given by its lower triangle (by L D L^T, no pivoting needed).

    >>> solve_symmetric([[2.0], [1.0, 4.0]], [4.0, 9.0])
    [1.0, 2.0]
    """
    size = len(right)
    if any(is_symbolic(entry) for row in (*lower, right) for entry in row):
        import sympy  # type: ignore[import-untyped]

        rows = [[exact(sympy.sympify(value, strict=True)) for value in row] for row in (*lower, right)]
        whole = [[rows[max(i, j)][min(i, j)] for j in range(size)] for i in range(size)]
        try:
            return [row[0] for row in _symbolic(whole, [[value] for value in rows[-1]])]
        except GraphError as error:
            raise GraphError(WEIGHTLESS) from error
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
    "the effective inertia vanishes or is negative at one of the positions (a dead centre without inertia on "
    "the other side?): the acceleration is not determined"
)


def _adjugate(matrix: Any) -> tuple[Any, Any]:
    """The adjugate and the determinant; of exact entries by Cayley and Hamilton's theorem: no step divides."""
    import sympy
    from sympy.polys.matrices import DomainMatrix  # type: ignore[import-untyped]

    size = matrix.rows
    if size == 1:
        return sympy.eye(1), matrix[0, 0]
    if matrix.has(sympy.Float):  # fractions of polynomials with floats have no divisors that can be relied on
        return matrix.adjugate("berkowitz"), matrix.det("berkowitz")
    domain_matrix = DomainMatrix.from_Matrix(matrix)
    unit = DomainMatrix.eye(size, domain_matrix.domain)
    *inner, last = domain_matrix.charpoly()[1:]
    product = unit
    for coefficient in inner:
        product = domain_matrix * product + coefficient * unit
    sign = 1 if size % 2 else -1
    return sign * product.to_Matrix(), -sign * domain_matrix.domain.to_sympy(last)


_MOST_TIDIED, _MOST_CANCELLED = 200, 40  # operations of an expression for which shorter forms are searched for
_MOST_EXACT = 1000  # the same where its numbers are exact


def readable(expression: Any) -> Any:
    """An expression in the shortest of its forms: as it is, as one fraction, with common factors out.

    >>> import sympy
    >>> a, b, c = sympy.symbols("a b c")
    >>> readable(a / b - a * c / (b * (b + c)))
    a/(b + c)
    """
    import sympy

    least = sympy.count_ops(expression)
    divided = any(power.base.is_Add and power.exp.is_negative for power in expression.atoms(sympy.Pow))
    most = _MOST_CANCELLED if expression.has(sympy.Float) else _MOST_EXACT
    if least > max(most, _MOST_TIDIED) or not divided:  # a sum of products is left as it is
        return expression
    forms = [expression]
    if least <= _MOST_TIDIED:
        forms.append(sympy.factor_terms(sympy.together(expression)))
    if least <= most and expression.is_rational_function():
        forms.append(sympy.factor_terms(sympy.cancel(expression)))
    return min(forms, key=sympy.count_ops)


def total(terms: Iterable[Any]) -> Any:
    """The sum of terms, left to right, of whatever kind they are."""
    sum_of_terms: Any = 0.0
    for term in terms:
        sum_of_terms = sum_of_terms + term
    return sum_of_terms


def _less(value: Any, products: Any) -> Any:
    for a, b in products:
        value = value - a * b
    return value


def _plain(matrix: Rows, right: Rows) -> list[list[float]]:
    """Solves a system of floats alone."""
    if len(matrix) == 1:
        if matrix[0][0] == 0.0:
            raise GraphError(SINGULAR)
        return [[entry / matrix[0][0] for entry in right[0]]]
    try:
        solution: list[list[float]] = np.linalg.solve(np.array(matrix), np.array(right)).tolist()
    except np.linalg.LinAlgError as error:
        raise GraphError(SINGULAR) from error
    return solution


def _symbolic(matrix: Rows, right: Rows) -> list[list[Any]]:
    """Solves a system of SymPy expressions: numbers serve as pivots, the rest follows by Cramer's rule, block by block.

    A pivot that is no number may vanish at a position where the system as a whole does not.
    """
    import sympy

    size = len(matrix)
    rows: list[list[Any]] = [[*row, *right_side] for row, right_side in zip(matrix, right, strict=True)]
    taken: list[tuple[int, int]] = []
    left, open_ = list(range(size)), list(range(size))  # rows and columns without a pivot
    while True:  # the next pivot is a number, not zero, with the fewest entries beside it
        filled = {(i, j) for i in left for j in open_ if not _zero(rows[i][j])}
        numbers = [(i, j) for i, j in sorted(filled) if not getattr(rows[i][j], "free_symbols", None)]
        if not numbers:
            break
        row, column = min(numbers, key=lambda at, filled=filled: sum(at[0] == i or at[1] == j for i, j in filled))  # type: ignore[misc]
        taken.append((row, column))
        left.remove(row)
        open_.remove(column)
        for k in left:
            if not _zero(rows[k][column]):
                factor = rows[k][column] / rows[row][column]
                rows[k] = [a if _zero(b) else a - factor * b for a, b in zip(rows[k], rows[row], strict=True)]
    solution: dict[int, list[Any]] = {}
    for places in components(
        {j: {k for i in left if not _zero(rows[i][j]) for k in open_ if not _zero(rows[i][k])} for j in open_}
    ):
        block = [i for i in left if any(not _zero(rows[i][j]) for j in places)]
        if len(block) != len(places):
            raise GraphError(SINGULAR)
        adjugate, determinant = _adjugate(sympy.Matrix([[rows[i][j] for j in places] for i in block]))
        if determinant.is_zero:
            raise GraphError(SINGULAR)
        columns = sympy.Matrix([rows[i][size:] for i in block])
        solution |= {j: list((adjugate.row(n) * columns) / determinant) for n, j in enumerate(places)}
    for row, column in reversed(taken):
        products = [(rows[row][k], solution[k]) for k in solution if not _zero(rows[row][k])]
        solution[column] = [
            (value - sum(factor * other[n] for factor, other in products)) / rows[row][column]
            for n, value in enumerate(rows[row][size:])
        ]
    return [solution[k] for k in range(size)]


def _zero(entry: Any) -> bool:
    return not getattr(entry, "free_symbols", None) and not entry


Balance = tuple[list[Any], list[list[Any]]]  # residuals, and their slopes by rows
Equations = Callable[[list[Any]], Balance]

# not 0, where laws like f |f| have no slope and those like a root have a vertical one
SOUGHT = (1e-3, 1.0, -1e-3, -1.0, 1e3, -1e3)
_MOST = 200  # iterations, and a quarter as many halvings of a step
_MOST_IDLE, _IDLE = 6, 1e-6  # iterations in turn that lessen the residual by no more than this share: none will
_SMALL, _ROUNDING = 1e-11, 1e-7  # of a flow: a step that leaves no error behind, one that rounding may make
_NOTHING = 1e-30


def settle(
    equations: Equations, size: int, shape: tuple[int, ...], where: str, near: Sequence[float] | None = None
) -> list[Any]:
    """The flows at which all residuals vanish, sought from `near` on if it is given, so that the branch stays the same.

    Raises:
        GraphError: if none are found, with `where` to say which flows these are.

    >>> settle(lambda u: ([u[0] * abs(u[0]) - 4.0], [[2.0 * abs(u[0])]]), 1, (), "pipe")
    [2.0]

    """
    some = SOUGHT if near is None else SOUGHT[:2]
    starts = [[start * (1.0 + 0.1 * k) for k in range(size)] for start in some]
    for start in ([] if near is None else [list(near)]) + starts:
        solution = _iterated(equations, [np.full(shape, value) for value in start] if shape else start)
        if solution is not None:
            settled = [np.where(np.abs(value) > 10.0 * _NOTHING, value, 0.0) for value in solution]
            return settled if shape else [float(value) for value in settled]
    tried = ", ".join(f"{start:g}" for start in (*([] if near is None else near[:1]), *some))
    raise GraphError(f"no value solves the law of {where}: sought from {tried} on")


def solutions(equations: Equations, size: int) -> list[list[float]]:
    """All that `settle` finds from starts of either sign, each once.

    >>> len(solutions(lambda u: ([u[0] ** 3 - 3.0 * u[0] - 1.0], [[3.0 * u[0] ** 2 - 3.0]]), 1))
    3
    """
    roots: list[list[float]] = []
    for start in SOUGHT:
        one = _iterated(equations, [start * (1.0 + 0.1 * k) for k in range(size)])
        if one is not None and not any(np.allclose(one, other, rtol=_ROUNDING, atol=_SMALL) for other in roots):
            roots.append([float(value) for value in one])
    return roots


def _iterated(equations: Equations, flows: list[Any]) -> list[Any] | None:
    balance, before, idle = _evaluated(equations, flows), np.inf, np.int64(0)
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
        part: Any = 1.0  # of the step: shortened where the residual would grow
        for _ in range(_MOST // 4):
            trial = [f + part * s for f, s in zip(flows, step, strict=True)]
            balance = _evaluated(equations, trial)
            worse = ~((_norm(balance[0]) < _norm(residual)) | done)
            if not np.any(worse):
                break
            part = np.where(worse, 0.5 * part, part) if np.ndim(worse) else 0.5 * part
        still = ~(_norm(balance[0]) < (1.0 - _IDLE) * _norm(residual)) & (length > _ROUNDING * reach)
        idle = (idle + 1) * still
        if np.any(idle > _MOST_IDLE):  # each state by itself: there is no solution near
            return None
        flows, before = trial, length
    return None


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
