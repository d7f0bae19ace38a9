"""Expressions of a scene on many angles at once; what decides their branches is looked up at an anchor of each panel."""

from __future__ import annotations

import ast
import itertools
import operator
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from .numbers import SMOOTH, Jet, Real, chosen, jet


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
