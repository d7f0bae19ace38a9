"""Expressions: a text becomes a checked tree that can be evaluated, taken apart and asked where it switches.

The text is read through Python's own `ast`, of which only arithmetic, comparisons, logic, conditional expressions and a
list of functions are let through. Nothing of it is ever executed; size, depth and exponents are capped.
"""

from __future__ import annotations

import ast
import math
import re
import sys
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from flywheel.advice import LONGEST_SHOWN
from flywheel.formulas import trees
from flywheel.formulas.trees import At, Node

VARIABLES = ("phi", "omega", "t", "x", "v")
FUNCTIONS = (*trees.SMOOTH, "atan2", "abs", "min", "max", "sign")
RESERVED = frozenset((*VARIABLES, "pi", *FUNCTIONS))

LENGTH_CAP = 2000
NODE_CAP = 500
DEPTH_CAP = 60
EXPONENT_CAP = 64

_FOREIGN = re.compile(r"[^\w \t+\-*/()<>=!,.]")
_SYNTAX = "numbers, names, + - * / **, comparisons, and or not, a if c else b, and functions such as sin(phi)"


class ExpressionError(ValueError):
    """Why a text is not an expression: what was `found` (and at which column), what was `expected`, some `advice`."""

    def __init__(self, found: str, expected: str = _SYNTAX, advice: str = "") -> None:
        self.found, self.expected, self.advice = found, expected, advice
        tail = f"; {advice}" if advice else ""
        super().__init__(f"found {found}, expected {expected}{tail}")


@dataclass(frozen=True)
class Expression:
    """A checked expression; its value is SI.

    >>> press = parse("1e3*max(sin(phi), 0) + preload", frozenset({"preload"}))
    >>> round(float(press.evaluate({"phi": np.pi / 6, "preload": 20.0}, np)), 9)
    520.0
    >>> sorted(press.names), press.uses_speed, press.degree("preload"), [s.text for s in press.switches()]
    (['phi', 'preload'], False, 1, ['sin(phi)'])
    """

    text: str
    tree: Node

    @property
    def shown(self) -> str:
        """The text, cut where it runs on: for faults, which are single lines."""
        return self.text if len(self.text) <= LONGEST_SHOWN else f"{self.text[: LONGEST_SHOWN - 1]}…"

    @cached_property
    def names(self) -> frozenset[str]:
        """The variables and parameters that occur (pi is a number)."""
        return frozenset(node.name for node in trees.walk(self.tree) if node.op == "name")

    @cached_property
    def uses_speed(self) -> bool:
        """Whether it depends on `omega`, or on `v` other than through its sign."""
        return trees.uses_speed(self.tree)

    @property
    def uses_time(self) -> bool:
        """Whether it depends on `t`."""
        return "t" in self.names

    @cached_property
    def switches_on_velocity(self) -> bool:
        """Whether it holds `sign(v)` or a comparison of `v` with 0; `v` may then be given as its sign."""
        return any(trees.sign_only(node) for node in trees.walk(self.tree))

    def evaluate(self, values: Mapping[str, Any], ns: Any, anchor: Mapping[str, Any] | None = None) -> Any:
        """Value in a namespace (numpy itself, or one of its likes); infinite or NaN where undefined.

        Comparisons, abs, sign, min, max, conditions and the cut of atan2 are decided at `anchor` where one is given:
        the middle of a smooth piece, broadcastable with `values`. A piece then never sees its neighbour's branch.

        >>> ramp = parse("abs(phi - 1)")
        >>> ramp.evaluate({"phi": np.array([0.0, 0.75, 1.5])}, np, {"phi": 0.5}).tolist()
        [1.0, 0.25, -0.5]
        """
        return self._in_range(lambda at: trees.value(self.tree, at), values, ns, anchor)

    def _in_range(self, found: Callable[[At], Any], values: Mapping[str, Any], ns: Any, anchor: Any) -> Any:
        """What is found at a place; with exponentials kept apart where plain floats overflow, and in intervals always."""
        base = getattr(ns, "over", ns)
        bounds = sys.modules.get("flywheel.formulas.intervals")
        with np.errstate(all="ignore"):
            if not self._grows or not (base is np or (bounds and base is bounds.NAMESPACE)):
                return found(_at(values, ns, anchor))
            if base is np:
                try:
                    with np.errstate(over="raise"):
                        return found(_at(values, ns, anchor))
                except FloatingPointError:
                    pass
            from flywheel.formulas.scaled import plain, scaled_namespace  # only what overflows pays for it

            kept = found(_at(values, scaled_namespace(ns), anchor))
            return tuple(map(plain, kept)) if isinstance(kept, tuple) else plain(kept)

    @cached_property
    def _grows(self) -> bool:
        return any(trees.grows(node) for node in trees.walk(self.tree))

    def degree(self, name: str) -> int | None:
        """Degree in a parameter as far as the structure shows it: 0, 1, or None where it is not evidently linear."""
        return trees.degree(self.tree, name)

    def coefficients(
        self, values: Mapping[str, Any], name: str, ns: Any, anchor: Mapping[str, Any] | None = None
    ) -> tuple[Any, Any]:
        """The pair (c0, c1) with value = c0 + c1 name; `values` need not hold the name.

        Raises ValueError where the expression is not evidently linear in it.

        >>> c0, c1 = parse("4*(T - 3*phi)/2", frozenset({"T"})).coefficients({"phi": 1.0}, "T", np)
        >>> float(c0), float(c1)
        (-6.0, 2.0)
        """
        if self.degree(name) is None:
            raise ValueError(f"{self.text!r} is not linear in {name}")
        pair: tuple[Any, Any] = self._in_range(lambda at: trees.linear(self.tree, name, at), values, ns, anchor)
        return pair

    def undefined(self, values: Mapping[str, Any], anchor: Mapping[str, Any] | None = None) -> str:
        """What leaves it without a finite value at a place, in words and as it was written; nothing where it has one.

        It is the first part whose operands are finite and whose value is not. What leaves the floating-point range is told
        only where nothing else is wrong: exponentials may overflow and cancel.

        >>> parse("3*log(phi-3)").undefined({"phi": 1.0})
        'log(phi-3): the logarithm of -2, which is negative'
        >>> parse("1/(phi-1) + exp(900)").undefined({"phi": 1.0})
        '1/(phi-1): a division by phi-1, which is 0'
        >>> parse("exp(300*phi)").undefined({"phi": 3.0})
        'exp(300*phi): beyond the floating-point range of 1.8e308, as 300*phi = 900'
        """

        def at(node: Node) -> float:
            return float(Expression("", node).evaluate(values, np, anchor))

        nodes = trees.undefined(self.tree, at)
        reasons = [(node, trees.reason(node, [at(arg) for arg in node.args], self.part)) for node in nodes]
        reasons.sort(key=lambda one: one[1].startswith(trees.BEYOND))
        return f"{self.part(reasons[0][0])}: {reasons[0][1]}" if reasons else ""

    def part(self, node: Node) -> str:
        """A part of the tree as it was written, where it stands in the text as one."""
        reader = _Reader(self.text.strip(" \t"), self.names, 0)
        reader.read(_python_tree(reader.source.decode(), 0).body, 1)
        text = reader.texts.get(node) or trees.written(node)
        return text if len(text) <= LONGEST_SHOWN else f"{text[: LONGEST_SHOWN - 1]}…"

    def switches(self) -> tuple[Expression, ...]:
        """The sub-expressions whose change of sign decides a branch, inner ones first; those on `v` are left out."""
        return _distinct(tree for node in trees.walk(self.tree) for tree in trees.deciders(node))

    def branch_points(self) -> tuple[Expression, ...]:
        """The sub-expressions at whose zeros a root, asin or acos has a branch point, inner ones first."""
        return _distinct(tree for node in trees.walk(self.tree) for tree in trees.branch_arguments(node))


def _at(values: Mapping[str, Any], ns: Any, anchor: Mapping[str, Any] | None) -> At:
    return At(values, ns, None if anchor is None else At(anchor, ns))


def _distinct(nodes: Any) -> tuple[Expression, ...]:
    varying = (node for node in dict.fromkeys(nodes) if any(inner.op == "name" for inner in trees.walk(node)))
    return tuple(Expression(trees.written(node), node) for node in varying)


def parse(text: str, names: frozenset[str] = frozenset()) -> Expression:
    """Read an expression that may use phi, omega, t, x, v, pi and the given parameter names.

    Raises ExpressionError, whose message is one line.

    >>> parse("300 * sin(phi")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    flywheel.formulas.expressions.ExpressionError: found a text ...
    """
    _check_text(text)
    body = text.strip(" \t")
    indent = len(text) - len(text.lstrip(" \t"))
    return Expression(text, _Reader(body, names, indent).read(_python_tree(body, indent).body, 1))


def _check_text(text: str) -> None:
    """Refuse what Python's parser should not even see."""
    if not text.strip(" \t"):
        raise ExpressionError("an empty text")
    if len(text) > LENGTH_CAP:
        raise ExpressionError(f"a text of {len(text)} characters", f"at most {LENGTH_CAP}")
    if foreign := _FOREIGN.search(text):
        advice = "a power is written **" if foreign[0] == "^" else ""
        raise ExpressionError(f"the character {foreign[0]!a} at column {foreign.start() + 1}", advice=advice)
    depth = 0
    for column, character in enumerate(text, 1):
        depth += (character == "(") - (character == ")")
        if depth > DEPTH_CAP:
            raise ExpressionError(f"brackets nested deeper than {DEPTH_CAP} at column {column}", "a flatter text")


def _python_tree(body: str, indent: int) -> ast.Expression:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return ast.parse(body, mode="eval")
    except SyntaxError as error:
        place = f" (column {error.offset + indent})" if error.offset else ""
        raise ExpressionError(f"a text that cannot be read{place}: {str(error.msg)[:100]}") from None
    except (ValueError, RecursionError, MemoryError, OverflowError):
        raise ExpressionError("a text too large or too deeply nested", "a shorter one") from None


class _Reader:
    """Turns Python's tree of one text into ours, and refuses every node that is not on the list."""

    def __init__(self, text: str, names: frozenset[str], indent: int) -> None:
        self.source = text.encode()  # ast counts columns in UTF-8 bytes
        self.names = names
        self.indent = indent
        self.count = 0
        self.texts: dict[Node, str] = {}

    def read(self, node: ast.expr, depth: int) -> Node:
        self.count += 1
        if self.count > NODE_CAP:
            raise ExpressionError(f"more than {NODE_CAP} numbers, names and operations", "a shorter text")
        if depth > DEPTH_CAP:
            raise ExpressionError(f"operations nested deeper than {DEPTH_CAP}{self.place(node)}", "a flatter text")
        rule = _READERS.get(type(node))
        if rule is None:
            raise ExpressionError(f"{self.quoted(node)}{self.place(node)}")
        found = rule(self, node, depth + 1)
        self.texts.setdefault(found, self.written(node))
        return found

    def written(self, node: ast.expr) -> str:
        return self.source[node.col_offset : node.end_col_offset].decode()

    def quoted(self, node: ast.expr) -> str:
        text = self.written(node)
        return repr(text if len(text) <= 40 else text[:37] + "...")

    def place(self, node: ast.expr) -> str:
        return f" at column {len(self.source[: node.col_offset].decode()) + 1 + self.indent}"

    def number(self, node: ast.Constant, depth: int) -> Node:
        if type(node.value) not in (int, float):
            advice = "write 1 or 0" if isinstance(node.value, bool) else ""
            raise ExpressionError(f"{self.quoted(node)}{self.place(node)}", "a real number", advice)
        try:
            number = float(node.value)  # type: ignore[arg-type]
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise ExpressionError(f"the number {self.quoted(node)}{self.place(node)}", "a number below 1.8e308")
        return Node("number", number=number)

    def name(self, node: ast.Name, depth: int) -> Node:
        # The name as written: Python would take a full-width 'phi' for the plain one.
        name = self.written(node)
        if name == "pi":
            return Node("pi")
        if name in VARIABLES or name in self.names - RESERVED:
            return Node("name", name=name)
        if name in FUNCTIONS:
            raise ExpressionError(f"the function {name!r}{self.place(node)} without brackets", f"{name}(...)")
        known = (*VARIABLES, "pi", *sorted(self.names - RESERVED))
        found = f"the unknown name {self.quoted(node)}{self.place(node)}"
        raise ExpressionError(found, "one of " + ", ".join(known), _nearest(name, known))

    def binary(self, node: ast.BinOp, depth: int) -> Node:
        if isinstance(node.op, ast.Pow):
            return self.power(node, depth)
        for kind, signs in _SPINES.items():
            if type(node.op) in signs:
                return self.spine(node, kind, signs, depth)
        advice = "a power is written **" if isinstance(node.op, ast.BitXor) else ""
        raise ExpressionError(f"the operation {self.quoted(node)}{self.place(node)}", "+ - * / **", advice)

    def spine(self, node: ast.expr, kind: str, signs: Mapping[type, str], depth: int) -> Node:
        """A sum or product with all its members side by side, however long."""
        members: list[tuple[str, Node]] = []
        while isinstance(node, ast.BinOp) and type(node.op) in signs:
            members.append((signs[type(node.op)], self.read(node.right, depth)))
            node = node.left
        members.append(("+" if kind == "sum" else "*", self.read(node, depth)))
        members.reverse()
        return Node(kind, tuple(arg for _, arg in members), signs=tuple(sign for sign, _ in members))

    def power(self, node: ast.BinOp, depth: int) -> Node:
        base, exponent = self.read(node.left, depth), self.read(node.right, depth)
        if not any(inner.op == "name" for inner in trees.walk(exponent)):
            with np.errstate(all="ignore"):
                number = float(trees.value(exponent, At({}, np)))
            if not abs(number) <= EXPONENT_CAP:
                found = f"the exponent {self.quoted(node.right)}{self.place(node.right)}"
                raise ExpressionError(found, f"one between -{EXPONENT_CAP} and {EXPONENT_CAP}")
            exponent = Node("number", number=number)
        return Node("**", (base, exponent))

    def unary(self, node: ast.UnaryOp, depth: int) -> Node:
        if isinstance(node.op, ast.Invert):
            raise ExpressionError(f"the operation {self.quoted(node)}{self.place(node)}")
        operand = self.read(node.operand, depth)
        if isinstance(node.op, ast.Not):
            return Node("not", (operand,))
        if isinstance(node.op, ast.UAdd):
            return operand
        return Node("number", number=-operand.number) if operand.op == "number" else Node("neg", (operand,))

    def compare(self, node: ast.Compare, depth: int) -> Node:
        signs = tuple(_COMPARE.get(type(op), "") for op in node.ops)
        if "" in signs:
            found = f"the comparison {self.quoted(node)}{self.place(node)}"
            raise ExpressionError(found, "one of < <= > >= == !=")
        members = tuple(self.read(arg, depth) for arg in (node.left, *node.comparators))
        return Node("compare", members, signs=signs)

    def logic(self, node: ast.BoolOp, depth: int) -> Node:
        op = "and" if isinstance(node.op, ast.And) else "or"
        return Node(op, tuple(self.read(arg, depth) for arg in node.values))

    def choice(self, node: ast.IfExp, depth: int) -> Node:
        return Node("if", tuple(self.read(arg, depth) for arg in (node.test, node.body, node.orelse)))

    def call(self, node: ast.Call, depth: int) -> Node:
        name = self.written(node.func)
        if not isinstance(node.func, ast.Name) or name not in FUNCTIONS:
            raise ExpressionError(
                f"a call of {self.quoted(node.func)}{self.place(node)}",
                "one of " + ", ".join(FUNCTIONS),
                _nearest(name, FUNCTIONS),
            )
        self.check_arguments(node, name)
        args = tuple(self.read(arg, depth) for arg in node.args)
        return _paired(name, args) if name in ("min", "max") else Node(name, args)

    def check_arguments(self, node: ast.Call, name: str) -> None:
        if node.keywords:
            raise ExpressionError(f"a keyword in {self.quoted(node)}{self.place(node)}", "plain arguments")
        wanted = {"atan2": 2, "min": None, "max": None}.get(name, 1)
        count = len(node.args)
        if count != wanted and (wanted is not None or count < 2):
            allowed = {1: "one", 2: "two (y, x)", None: "two or more"}[wanted]
            plural = "" if count == 1 else "s"
            raise ExpressionError(f"{count} argument{plural} of {name}{self.place(node)}", allowed)


def _paired(name: str, args: tuple[Node, ...]) -> Node:
    """Minimum or maximum of many as a balanced tree of pairs, each of which is one switch."""
    if len(args) == 1:
        return args[0]
    middle = len(args) // 2
    return Node(name, (_paired(name, args[:middle]), _paired(name, args[middle:])))


def _nearest(name: str, known: tuple[str, ...]) -> str:
    from difflib import get_close_matches

    close = get_close_matches(name[:40], known, 1)
    return f"did you mean {close[0]!r}?" if close else ""


_SPINES: dict[str, dict[type, str]] = {"sum": {ast.Add: "+", ast.Sub: "-"}, "product": {ast.Mult: "*", ast.Div: "/"}}
_COMPARE: dict[type, str] = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
}
_READERS: dict[type, Callable[[_Reader, Any, int], Node]] = {
    ast.Constant: _Reader.number,
    ast.Name: _Reader.name,
    ast.BinOp: _Reader.binary,
    ast.UnaryOp: _Reader.unary,
    ast.Compare: _Reader.compare,
    ast.BoolOp: _Reader.logic,
    ast.IfExp: _Reader.choice,
    ast.Call: _Reader.call,
}
