"""Formulas and tables, as written in books."""

from __future__ import annotations

import ast
import itertools
import operator
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tests.oracle.numbers import KIND, SMOOTH, Jet, Real, chain, chosen, jet, real, reals, unit

# Expressions of a scene on many angles at once; what decides their branches is looked up at an anchor of each panel.


class Both(NamedTuple):
    """A jet at the nodes, and the value at the anchors (or, of a comparison, its truth there)."""

    here: Any
    anchor: Any


Env = Mapping[str, Both]
ARITHMETIC = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv, ast.Pow: operator.pow,
}  # fmt: skip
COMPARE = {ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge}


def parse(text: str) -> ast.expr:
    """The tree of an expression, its decimal numbers as they are written."""
    tree = ast.parse(text.strip(), mode="eval").body
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant):
            node.value = Real(ast.get_source_segment(text.strip(), node))  # type: ignore[assignment]
    return tree


def evaluate(node: ast.expr, env: Env) -> Both:
    """An expression at nodes and anchors."""
    match node:
        case ast.Constant():
            return Both(jet(node.value), node.value)
        case ast.Name():
            return env[node.id]
        case ast.UnaryOp():
            inner = evaluate(node.operand, env)
            if isinstance(node.op, ast.Not):
                return Both(None, ~np.asarray(inner.anchor))
            return Both(-inner.here, -inner.anchor)
        case ast.BinOp():
            a, b, act = evaluate(node.left, env), evaluate(node.right, env), ARITHMETIC[type(node.op)]
            return Both(act(a.here, b.here), act(a.anchor, b.anchor))
        case ast.BoolOp():
            truths = [evaluate(value, env).anchor for value in node.values]
            act = np.logical_and if isinstance(node.op, ast.And) else np.logical_or
            return Both(None, act.reduce(np.broadcast_arrays(*truths)))
        case ast.Compare():
            sides = [evaluate(side, env).anchor for side in (node.left, *node.comparators)]
            truths = [COMPARE[type(op)](sides[i], sides[i + 1]) for i, op in enumerate(node.ops)]
            return Both(None, np.logical_and.reduce(np.broadcast_arrays(*truths)))
        case ast.IfExp():
            return _either(evaluate(node.test, env).anchor, evaluate(node.body, env), evaluate(node.orelse, env))
        case ast.Call(func=ast.Name(id=name)):
            return _called(name, [evaluate(a, env) for a in node.args])
    raise ValueError(ast.dump(node))


def _either(which: Any, yes: Both, no: Both) -> Both:
    return Both(chosen(which, yes.here, no.here), np.where(which, yes.anchor, no.anchor))


def _called(name: str, found: list[Both]) -> Both:
    first = found[0]
    if name == "abs":
        return _either(first.anchor >= 0, first, Both(-first.here, -first.anchor))
    if name == "sign":
        sign = np.sign(first.anchor)
        return Both(jet(sign), sign)
    if name in ("min", "max"):
        for other in found[1:]:
            first = _either((other.anchor < first.anchor) == (name == "min"), other, first)
        return first
    here, there = SMOOTH[name](*(f.here for f in found)), SMOOTH[name](*(Jet(f.anchor) for f in found))
    return Both(here, there.value)


def switches(tree: ast.expr) -> Iterator[ast.expr]:
    """Expressions whose sign changes are where the whole may jump or bend."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            yield from (ast.BinOp(a, ast.Sub(), b) for a, b in itertools.pairwise(sides))
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            if node.func.id in ("abs", "sign"):
                yield node.args[0]
            elif node.func.id in ("min", "max"):
                yield from (ast.BinOp(a, ast.Sub(), b) for i, a in enumerate(node.args) for b in node.args[i + 1 :])


def names(tree: ast.expr) -> set[str]:
    """The names that an expression uses."""
    return {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}


# Tables of numbers against angle: linear, step, monotone cubic, periodic cubic spline.


class Cubics(NamedTuple):
    """Cubic pieces in (angle - start), `coefficients` (4, pieces) from the constant up, up to `ends`."""

    starts: Any
    ends: Any
    coefficients: Any

    def at(self, angle: Jet, anchor: Any) -> Jet:
        """Values at angles, the piece being that of an anchor."""
        k = np.clip(np.searchsorted(self.ends, anchor, side="right"), 0, self.ends.size - 1)
        d = angle.value - self.starts[k]
        c = [row[k] for row in self.coefficients]
        value = c[0] + d * (c[1] + d * (c[2] + d * c[3]))
        return chain(angle, value, c[1] + d * (2 * c[2] + 3 * d * c[3]), 2 * c[2] + 6 * d * c[3])


def columns(table: dict[str, Any], folder: Path) -> tuple[Any, Any]:
    """Angles (rad) and values (SI) of a table written in the scene or in a CSV file."""
    angle, value = table.get("angle"), table.get("value")
    if "file" in table:
        rows = [line.split(",") for line in (folder / table["file"]).read_text().splitlines() if line.strip()]
        column = table.get("column", 2)
        if isinstance(column, str):
            column = [name.strip() for name in rows[0]].index(column) + 1
        rows = [row for row in rows if row[0].strip()[-1] in "0123456789."]
        angle, value = [row[0].strip() for row in rows], [row[int(column) - 1].strip() for row in rows]
    by, per = unit(table.get("angle_unit", "rad")), unit(table.get("value_unit", ""))
    return np.array([real(a) * by for a in angle]), np.array([real(v) * per for v in value])


def pieces(table: dict[str, Any], folder: Path) -> Cubics:
    """The pieces of a load's table; two equal angles are a jump, on either side of which it starts afresh."""
    angle, value = columns(table, folder)
    kind = {"linear": linear, "step": step, "pchip": pchip}[table.get("interpolation", "linear")]
    jumps = [0, *(np.flatnonzero(np.diff(angle) == 0) + 1), angle.size]
    runs = [kind(angle[a:b], value[a:b]) for a, b in itertools.pairwise(jumps)]
    return Cubics(*(np.concatenate(parts, axis=-1) for parts in zip(*runs, strict=True)))


def step(x: Any, y: Any) -> Cubics:
    """Each value holds from its angle to the next one."""
    flat = np.zeros(x.size - 1, dtype=KIND)
    return Cubics(x[:-1], x[1:], np.stack((y[:-1], flat, flat, flat)))


def linear(x: Any, y: Any) -> Cubics:
    """Straight lines between neighbours."""
    flat = np.zeros(x.size - 1, dtype=KIND)
    return Cubics(x[:-1], x[1:], np.stack((y[:-1], np.diff(y) / np.diff(x), flat, flat)))


def hermite(x: Any, y: Any, slope: Any) -> Cubics:
    """Cubics with the given values and slopes at the ends."""
    h, chord = np.diff(x), np.diff(y) / np.diff(x)
    square = (3 * chord - 2 * slope[:-1] - slope[1:]) / h
    cube = (slope[:-1] + slope[1:] - 2 * chord) / h**2
    return Cubics(x[:-1], x[1:], np.stack((y[:-1], slope[:-1], square, cube)))


def pchip(x: Any, y: Any) -> Cubics:
    """The monotone cubic of Fritsch and Butland, with limited three-point slopes at the ends."""
    if x.size == 2:
        return linear(x, y)
    h, chord = np.diff(x), np.diff(y) / np.diff(x)
    slope = np.zeros_like(y)
    for i in range(1, x.size - 1):
        if chord[i - 1] * chord[i] > 0:
            a, b = 2 * h[i] + h[i - 1], h[i] + 2 * h[i - 1]
            slope[i] = (a + b) / (a / chord[i - 1] + b / chord[i])
    slope[0] = end_slope(h[0], h[1], chord[0], chord[1])
    slope[-1] = end_slope(h[-1], h[-2], chord[-1], chord[-2])
    return hermite(x, y, slope)


def end_slope(h: Any, k: Any, near: Any, far: Any) -> Any:
    """The one-sided slope at an end, held within what keeps the curve monotone."""
    slope = ((2 * h + k) * near - h * far) / (h + k)
    if slope * near <= 0:
        return Real(0)
    return 3 * near if near * far <= 0 and abs(slope) > 3 * abs(near) else slope


def spline(table: dict[str, Any], folder: Path) -> Cubics:
    """The C² cubic through the points whose slope and curvature agree at the two ends; the values may gain."""
    x, y = columns(table, folder)
    n, h, chord = x.size - 1, np.diff(x), np.diff(y) / np.diff(x)
    matrix, right = np.zeros((n, n), dtype=KIND), np.zeros(n, dtype=KIND)
    for i in range(n):
        before, after = h[i - 1], h[i]
        matrix[i, (i - 1) % n] += after
        matrix[i, i] += 2 * (before + after)
        matrix[i, (i + 1) % n] += before
        right[i] = 3 * (after * chord[i - 1] + before * chord[i])
    slope = solved(matrix, right)
    return hermite(x, y, np.append(slope, slope[0]))


def solved(matrix: Any, right: Any) -> Any:
    """The solution of a linear system: that in double, refined by its residuals."""
    rough = matrix.astype(float)
    result = reals(np.linalg.solve(rough, right.astype(float)))
    for _ in range(4):
        result += np.linalg.solve(rough, (right - matrix @ result).astype(float))
    return result
