"""Texts of a scene as numbers: quantities with units, and expressions with their switches frozen at one angle."""

from __future__ import annotations

import ast
import itertools
import operator
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from mpmath import mp  # type: ignore[import-untyped]

from . import jets

POUND_FORCE = "4.4482216152605"
UNITS = {
    "m": "1", "mm": "0.001", "cm": "0.01", "in": "0.0254", "ft": "0.3048", "kg": "1", "g": "0.001", "t": "1000",
    "lb": "0.45359237", "N": "1", "kN": "1000", "MN": "1000000", "lbf": POUND_FORCE, "kgf": "9.80665", "Nm": "1",
    "kNm": "1000", "rad": "1", "s": "1", "ms": "0.001", "min": "60", "h": "3600", "Pa": "1", "kPa": "1000",
    "MPa": "1000000", "bar": "100000", "J": "1", "kJ": "1000", "W": "1", "kW": "1000", "%": "0.01",
}  # fmt: skip
NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*)")


def unit(text: str) -> Any:
    """The SI factor of a unit: a space or · multiplies, what stands after / divides, ^2 and ² are powers."""
    above, _, below = text.partition("/")
    return product(above) / product(below)


def product(text: str) -> Any:
    """The SI factor of a product of units; 1 of an empty one."""
    return mp.fprod(power(word) for word in text.replace("·", " ").split() if word != "1")


def power(word: str) -> Any:
    """The SI factor of one unit with its power; KeyError where it is unknown."""
    name, _, exponent = word.replace("²", "^2").partition("^")
    turns = {"deg": mp.pi / 180, "°": mp.pi / 180, "rev": 2 * mp.pi, "rpm": mp.pi / 30}
    factor = turns[name] if name in turns else mp.mpf(UNITS[name])
    return factor ** int(exponent or 1)


def quantity(raw: Any) -> Any:
    """A bare number or a text of number and unit, in SI; ValueError of any other text."""
    if not isinstance(raw, str):
        return mp.mpf(raw)
    match = NUMBER.fullmatch(raw)
    if match is None:
        raise ValueError(raw)
    try:
        return mp.mpf(match[1]) * unit(match[2])
    except KeyError as unknown:
        raise ValueError(raw) from unknown


# --- expressions ------------------------------------------------------------------------------------------------

Env = Mapping[str, Any]
ARITHMETIC = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv, ast.Pow: operator.pow,
}  # fmt: skip
COMPARE = {
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge, ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}  # fmt: skip
SMOOTH = {f.__name__: f for f in (jets.sin, jets.cos, jets.tan, jets.asin, jets.acos, jets.atan, jets.atan2, jets.sqrt)}
SMOOTH |= {"exp": jets.exp, "log": jets.log}


def parse(text: str) -> ast.expr:
    """The tree of an expression, its decimal numbers read to the full precision of the text."""
    source = text.strip()
    tree = ast.parse(source, mode="eval").body
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant):
            node.value = mp.mpf(ast.get_source_segment(source, node))
    return tree


def evaluate(node: ast.expr, env: Env) -> Any:
    """The value (a jet, or a truth value) of an expression; `env` gives each name a number or a jet."""
    match node:
        case ast.Constant():
            return jets.jet(node.value)
        case ast.Name():
            return jets.jet(env[node.id])
        case ast.UnaryOp(op=ast.Not()):
            return not evaluate(node.operand, env)
        case ast.UnaryOp():
            return -evaluate(node.operand, env) if isinstance(node.op, ast.USub) else evaluate(node.operand, env)
        case ast.BinOp():
            return ARITHMETIC[type(node.op)](evaluate(node.left, env), evaluate(node.right, env))
        case ast.BoolOp():
            truths = [evaluate(value, env) for value in node.values]
            return all(truths) if isinstance(node.op, ast.And) else any(truths)
        case ast.Compare():
            sides = [evaluate(side, env).value for side in (node.left, *node.comparators)]
            return all(COMPARE[type(op)](sides[i], sides[i + 1]) for i, op in enumerate(node.ops))
        case ast.Call(func=ast.Name(id=name)) if name in SMOOTH:
            return SMOOTH[name](*(evaluate(a, env) for a in node.args))
    raise ValueError(ast.dump(node))


class Freeze(ast.NodeTransformer):
    """Takes every decision of an expression at one angle, so that what is left is smooth around it."""

    def __init__(self, env: Env) -> None:
        self.env = env

    def visit_IfExp(self, node: ast.IfExp) -> ast.AST:
        test = self.visit(node.test)
        return self.visit(node.body if evaluate(test, self.env) else node.orelse)  # type: ignore[no-any-return]

    def visit_Call(self, node: ast.Call) -> ast.AST:
        name = node.func.id if isinstance(node.func, ast.Name) else ""
        arguments: list[ast.expr] = [self.visit(a) for a in node.args]
        values = [evaluate(a, self.env).value for a in arguments]
        if name in ("min", "max"):
            return arguments[values.index(min(values) if name == "min" else max(values))]
        if name == "abs":
            return arguments[0] if values[0] >= 0 else ast.UnaryOp(ast.USub(), arguments[0])
        if name == "sign":
            return ast.Constant(mp.sign(values[0]))
        return ast.Call(node.func, arguments, [])


def frozen(tree: ast.expr, env: Env) -> Callable[[Env], Any]:
    """The smooth expression that holds around the angle at which `env` was taken, as a function of another `env`."""
    import copy

    smooth = Freeze(env).visit(copy.deepcopy(tree))
    return lambda at: evaluate(smooth, at)


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


def signed(tree: ast.expr, env: Env) -> Any:
    """The value of a switch at one angle, whatever decisions stand inside it."""
    return frozen(tree, env)(env).value


def names(tree: ast.expr) -> set[str]:
    """The names that an expression uses."""
    return {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
