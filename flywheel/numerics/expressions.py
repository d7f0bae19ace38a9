"""Expressions: a text becomes a checked tree that can be evaluated, taken apart and searched for its switches.

The text is read through Python's own `ast`, of which only arithmetic, comparisons, logic, conditional expressions and a list
of functions are accepted. No part of the text is ever executed; size, depth and exponents are limited.

A tree is evaluated against a namespace that gives the functions by their numpy names, so numpy itself serves, and so do
intervals, jets, and mpmath through a small adapter: sin cos tan asin acos atan atan2 sqrt exp log abs sign minimum
maximum where divide power less less_equal greater greater_equal equal not_equal logical_and logical_or logical_not, pi.
"""

from __future__ import annotations

import ast
import math
import operator
import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from typing import Any, NamedTuple

import numpy as np

from flywheel.numerics.faults import LONGEST_TEXT, nearest
from flywheel.numerics.intervals import NAMESPACE, plain, scaled_namespace
from flywheel.numerics.jets import present
from flywheel.numerics.units import CONDITION, DIMENSIONS, PRODUCT, Unit, written_here

SMOOTH = ("sin", "cos", "tan", "asin", "acos", "atan", "sqrt", "exp", "log")
COMPARISONS = {
    "<": "less",
    "<=": "less_equal",
    ">": "greater",
    ">=": "greater_equal",
    "==": "equal",
    "!=": "not_equal",
}
BOOLEAN = frozenset({"compare", "and", "or", "not", "here"})


class Node(NamedTuple):
    """One node of a tree.

    `op` is `number`, `name`, `pi`, `sum`, `product`, `**`, `neg`, `compare`, `and`, `or`, `not`, `if` (test, yes, no)
    or a function's name. Sums, products and comparison chains keep all their members side by side, so that a long
    series is not a deep tree; `signs` then holds one operator per member (`+ -`, `* /`) or between neighbours (`< <=`).
    """

    op: str
    args: tuple[Node, ...] = ()
    number: float = 0.0
    name: str = ""
    signs: tuple[str, ...] = ()


class At(NamedTuple):
    """Point of evaluation of a tree: values by name, the namespace, and the point that decides switches, if different."""

    values: Mapping[str, Any]
    ns: Any
    anchor: At | None = None


ONE = Node("number", number=1.0)


def walk(node: Node) -> Iterator[Node]:
    """Every node of a tree, the inner ones before those that contain them."""
    for arg in node.args:
        yield from walk(arg)
    yield node


def depends(node: Node, name: str) -> bool:
    """Tests whether a name occurs in a tree."""
    return node.name == name or any(depends(arg, name) for arg in node.args)


def renamed(node: Node, old: str, new: str) -> Node:
    """The tree with another name for a variable: bounds over `phi` then serve laws of `t`."""
    name = new if node.name == old else node.name
    return node._replace(name=name, args=tuple(renamed(arg, old, new) for arg in node.args))


def value(node: Node, at: At) -> Any:
    """Value of a tree as a number; a truth value counts as 1 or 0."""
    return _RULES[node.op](node, at)


def truth(node: Node, at: At) -> Any:
    """Truth value of a tree where its switches are decided: at the anchor, but for `here`; of a number, that it is not 0."""
    place, ns = at if at.anchor is None else at.anchor, at.ns
    if node.op == "compare":
        members = [value(arg, place) for arg in node.args]
        pairs = zip(node.signs, members, members[1:], strict=False)
        return reduce(ns.logical_and, (getattr(ns, COMPARISONS[sign])(left, right) for sign, left, right in pairs))
    if node.op in ("and", "or"):
        return reduce(ns.logical_and if node.op == "and" else ns.logical_or, [truth(arg, at) for arg in node.args])
    if node.op == "not":
        return ns.logical_not(truth(node.args[0], at))
    if node.op == "here":
        return truth(node.args[0], At(at.values, ns, at))
    return ns.not_equal(value(node, place), 0.0)


def _sum(node: Node, at: At) -> Any:
    total = value(node.args[0], at)
    for sign, arg in zip(node.signs[1:], node.args[1:], strict=True):
        term = value(arg, at)
        total = total + term if sign == "+" else total - term
    return total


def _product(node: Node, at: At) -> Any:
    total = value(node.args[0], at)
    for sign, arg in zip(node.signs[1:], node.args[1:], strict=True):
        factor = value(arg, at)
        total = total * factor if sign == "*" else at.ns.divide(total, factor)
    return total


def _power(node: Node, at: At) -> Any:
    base, exponent = node.args
    if grows(node) and hasattr(at.ns, "exponential"):
        return _exponential(Node("product", (exponent, Node("log", (base,))), signs=("*", "*")), at)
    return at.ns.power(value(base, at), value(exponent, at))


def grows(node: Node) -> bool:
    """Tests whether a node is an exponential: exp, or a positive number to a power that varies."""
    if node.op != "**":
        return node.op == "exp"
    base, exponent = node.args
    return exponent.op != "number" and base.op == "number" and base.number > 0.0


def _exponential(exponent: Node, at: At) -> Any:
    """Evaluates exp by its exponent's terms where exponents are kept apart: exp(a), exp(-a), exp(2*a) share one."""
    if not hasattr(at.ns, "exponential"):
        return at.ns.exp(value(exponent, at))
    return at.ns.exponential([(part, c, value(part, at)) for c, part in terms(exponent)], lambda: value(exponent, at))


def terms(node: Node) -> list[tuple[float, Node]]:
    """A tree as a sum of trees with numeric factors; the purely numeric part is the factor of the tree 1."""
    if not any(inner.op == "name" for inner in walk(node)):
        with np.errstate(all="ignore"):
            return [(float(value(node, At({}, np))), ONE)]
    if node.op == "neg":
        return [(-c, part) for c, part in terms(node.args[0])]
    if node.op == "sum":
        parts = zip(node.signs, node.args, strict=True)
        return [(-c if sign == "-" else c, part) for sign, arg in parts for c, part in terms(arg)]
    if node.op != "product":
        return [(1.0, node)]
    factor, left = 1.0, []
    for sign, arg in zip(node.signs, node.args, strict=True):
        ((c, part), *more) = terms(arg) if arg.op != "sum" else [(1.0, arg)]
        if more or (part != ONE and sign == "/"):
            c, part = 1.0, arg
        factor = factor * c if sign == "*" else factor / c
        left += [] if part == ONE else [(sign, part)]
    if len(left) == 1 and left[0][0] == "*":
        return [(factor, left[0][1])]
    return [(factor, Node("product", (ONE, *(part for _, part in left)), signs=("*", *(sign for sign, _ in left))))]


def _choice(node: Node, at: At) -> Any:
    test, yes, no = node.args
    chosen = truth(test, at)
    if isinstance(chosen, bool) or getattr(chosen, "shape", None) == ():  # one place: the other branch is not needed
        return value(yes if chosen else no, at)
    if isinstance(chosen, np.ndarray) and chosen.dtype == bool and chosen.size and chosen.all() == chosen.any():
        return value(yes if chosen.all() else no, at)  # all places take one branch
    return at.ns.where(chosen, value(yes, at), value(no, at))


def _abs(node: Node, at: At) -> Any:
    inner = value(node.args[0], at)
    return at.ns.abs(inner) if at.anchor is None else _sign(node, at) * inner


def _sign(node: Node, at: At) -> Any:
    return at.ns.sign(value(node.args[0], at if at.anchor is None else at.anchor))


def _extreme(node: Node, at: At) -> Any:
    left, right = (value(arg, at) for arg in node.args)
    lower = node.op == "min"
    if at.anchor is None:
        return at.ns.minimum(left, right) if lower else at.ns.maximum(left, right)
    at_left, at_right = (value(arg, at.anchor) for arg in node.args)
    chosen = at.ns.less_equal(at_left, at_right) if lower else at.ns.greater_equal(at_left, at_right)
    return at.ns.where(chosen, left, right)


def _atan2(node: Node, at: At) -> Any:
    y, x = (value(arg, at) for arg in node.args)
    ns, angle = at.ns, at.ns.atan2(y, x)
    if at.anchor is None:
        return angle
    # Left of the origin the cut is replaced by the continuation from the anchor's side: s (pi/2 - atan2(x, s y)).
    side = ns.where(ns.less(value(node.args[0], at.anchor), 0.0), -1.0, 1.0)
    return ns.where(ns.less(x, 0.0), side * (ns.pi / 2 - ns.atan2(x, side * y)), angle)


_RULES: dict[str, Callable[[Node, At], Any]] = {
    "number": lambda node, at: node.number,
    "name": lambda node, at: at.values[node.name],
    "pi": lambda node, at: at.ns.pi,
    "neg": lambda node, at: -value(node.args[0], at),
    "sum": _sum,
    "product": _product,
    "**": _power,
    "if": _choice,
    "abs": _abs,
    "sign": _sign,
    "min": _extreme,
    "max": _extreme,
    "atan2": _atan2,
    **dict.fromkeys(SMOOTH, lambda node, at: getattr(at.ns, node.op)(value(node.args[0], at))),
    "exp": lambda node, at: _exponential(node.args[0], at),
    **dict.fromkeys(BOOLEAN, lambda node, at: at.ns.where(truth(node, at), 1.0, 0.0)),
}


BEYOND = "beyond the floating-point range of 1.8e308"
_VALID = {
    "log": ("the logarithm", "negative"),
    "sqrt": ("the square root", "negative"),
    "asin": ("the arcsine", "outside -1 to 1"),
    "acos": ("the arccosine", "outside -1 to 1"),
}


def _undefined(node: Node, at: Callable[[Node], float]) -> list[Node]:
    """The parts of a tree that have finite operands and no finite value, where the whole has none; `at` gives values."""
    if math.isfinite(at(node)):
        return []
    args = node.args
    if node.op == "if":
        args = (args[2 if at(Node("not", args[:1])) else 1],)
    return [part for arg in args for part in _undefined(arg, at)] or [node]


def _reason(node: Node, operands: Sequence[float], text: Callable[[Node], str]) -> str:
    """Reason why a node has no finite value for finite operands, in words; `text` writes its parts."""
    if node.op in _VALID:
        what, outside = _VALID[node.op]
        short = f"{operands[0]:.6g}"
        divisor = repr(operands[0]) if short.lstrip("-") == "1" and float(short) != operands[0] else short  # just beside 1
        return f"{what} of {divisor}" + (f", which is {outside}" if operands[0] else "")
    for sign, arg, operand in zip(node.signs, node.args, operands, strict=False):
        if node.op == "product" and sign == "/" and operand == 0.0:
            return "a division by 0" if _is_zero(arg) else f"a division by {text(arg)}, which is 0"
    if node.op == "**" and operands[0] <= 0.0:
        base = f"{operands[0]:.6g}, which is negative" if operands[0] else f"{text(node.args[0])}, which is 0"
        return f"{base}, to the power of {operands[1]:.6g}"
    if node.op in ("exp", "**"):
        return f"{BEYOND}, as {text(node.args[-1])} = {operands[-1]:.6g}"
    return BEYOND if node.args else "a value that is not finite"


def _degree(node: Node, name: str) -> int | None:
    """Structural degree of a tree in a name: 0 (absent), 1 (linear), or None if linearity is not evident.

    Not evident: a product of two factors that hold it, a denominator, an exponent, a function's argument, a test.
    """
    if not depends(node, name):
        return 0
    if node.op == "name":
        return 1
    if node.op == "product":
        holders = [(sign, arg) for sign, arg in zip(node.signs, node.args, strict=True) if depends(arg, name)]
        return _degree(holders[0][1], name) if len(holders) == 1 and holders[0][0] == "*" else None
    if node.op not in ("sum", "neg", "if") or (node.op == "if" and depends(node.args[0], name)):
        return None
    return None if None in [_degree(arg, name) for arg in node.args] else 1


def _linear(node: Node, name: str, at: At) -> tuple[Any, Any]:
    """The two coefficients of a tree of degree 0 or 1: value = c0 + c1 name, without differencing."""
    if not depends(node, name):
        return value(node, at), 0.0
    if node.op == "name":
        return 0.0, 1.0
    if node.op == "if":
        test, yes, no = truth(node.args[0], at), *(_linear(arg, name, at) for arg in node.args[1:])
        return at.ns.where(test, yes[0], no[0]), at.ns.where(test, yes[1], no[1])
    if node.op == "neg":
        c0, c1 = _linear(node.args[0], name, at)
        return -c0, -c1
    constant, slope = (1.0, 1.0) if node.op == "product" else (0.0, 0.0)
    for sign, arg in zip(node.signs, node.args, strict=True):
        if node.op == "sum":
            c0, c1 = _linear(arg, name, at)
            constant, slope = (constant + c0, slope + c1) if sign == "+" else (constant - c0, slope - c1)
        elif depends(arg, name):
            c0, c1 = _linear(arg, name, at)
            constant, slope = constant * c0, slope * c1
        else:
            factor = value(arg, at)
            change = at.ns.divide if sign == "/" else operator.mul
            constant, slope = change(constant, factor), change(slope, factor)
    return constant, slope


def _difference(left: Node, right: Node) -> Node:
    """The tree left - right, or the one that is not the number zero (its sign changes in the same places)."""
    if _is_zero(right):
        return left
    return right if _is_zero(left) else Node("sum", (left, right), signs=("+", "-"))


def _is_zero(node: Node) -> bool:
    return node.op == "number" and node.number == 0.0


def _is_velocity(node: Node) -> bool:
    return node.name == "v" or (node.op == "neg" and node.args[0].name == "v")


def _sign_only(node: Node) -> frozenset[int]:
    """The members of a node that are v or -v and have an effect only through their sign."""
    if node.op == "sign":
        return frozenset(i for i, arg in enumerate(node.args) if _is_velocity(arg))
    if node.op != "compare":
        return frozenset()
    beside = [(*node.args[max(i - 1, 0) : i], *node.args[i + 1 : i + 2]) for i in range(len(node.args))]
    return frozenset(i for i, arg in enumerate(node.args) if _is_velocity(arg) and all(map(_is_zero, beside[i])))


def _uses_speed(node: Node) -> bool:
    if node.name in ("omega", "v"):
        return True
    hidden = _sign_only(node) if node.op in ("sign", "compare") else ()
    return any(_uses_speed(arg) for i, arg in enumerate(node.args) if i not in hidden)


def _deciders(node: Node) -> list[Node]:
    """The trees whose sign decides this node itself: differences of compared sides, arguments of abs and sign."""
    if node.op == "compare":
        velocity = _sign_only(node)
        pairs = [(i, i + 1) for i in range(len(node.signs)) if not velocity & {i, i + 1}]
        return [_difference(node.args[i], node.args[j]) for i, j in pairs]
    if node.op in ("min", "max"):
        return [_difference(*node.args)]
    if node.op in ("abs", "atan2"):
        return [node.args[0]]
    return [node.args[0]] if node.op == "sign" and not _sign_only(node) else []


def _branch_arguments(node: Node) -> list[Node]:
    """The trees at whose zeros this node has a branch point: a root's radicand, 1 - u and 1 + u of asin and acos."""
    if node.op == "sqrt":
        return [node.args[0]]
    if node.op in ("asin", "acos"):
        return [Node("sum", (ONE, node.args[0]), signs=("+", sign)) for sign in "-+"]
    if node.op == "**" and not (node.args[1].op == "number" and node.args[1].number.is_integer()):
        return [node.args[0]]
    return []


def written(node: Node) -> str:
    """A tree as text, bracketed wherever that could matter."""
    if node.op in ("number", "name", "pi"):
        return node.name or (f"{node.number:.15g}" if node.op == "number" else "pi")
    parts = [_bracketed(arg) for arg in node.args]
    if node.op in ("sum", "product", "compare"):
        signs = node.signs if node.op == "compare" else node.signs[1:]
        return parts[0] + "".join(f" {sign} {part}" for sign, part in zip(signs, parts[1:], strict=True))
    if node.op == "if":
        return f"{parts[1]} if {parts[0]} else {parts[2]}"
    if node.op in ("and", "or", "**"):
        return f" {node.op} ".join(parts)
    if node.op in ("neg", "not"):
        return ("-" if node.op == "neg" else "not ") + parts[0]
    return f"{node.op}({', '.join(map(written, node.args))})"


def _bracketed(node: Node) -> str:
    text = written(node)
    plain = node.op in ("name", "pi", *SMOOTH, "abs", "sign", "min", "max", "atan2")
    return text if plain or (node.op == "number" and node.number >= 0) else f"({text})"


VARIABLES = ("phi", "omega", "t", "x", "v")
FUNCTIONS = (*SMOOTH, "atan2", "abs", "min", "max", "sign")
RESERVED = frozenset((*VARIABLES, "pi", *FUNCTIONS))

LENGTH_CAP = 2000
NODE_CAP = 500
DEPTH_CAP = 60
EXPONENT_CAP = 64

_FOREIGN = re.compile(r"[^\w \t+\-*/()<>=!,.]")
_SYNTAX = "numbers, names, + - * / **, comparisons, and or not, a if c else b, and functions such as sin(phi)"


class ExpressionError(ValueError):
    """Reason why a text is not an expression: the text `defect` (and its column), the `expected` one, and `advice`."""

    def __init__(self, defect: str, expected: str = _SYNTAX, advice: str = "") -> None:
        self.defect, self.expected, self.advice = defect, expected, advice
        super().__init__(f"found {defect}, expected {expected}" + (f"; {advice}" if advice else ""))


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

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled without what has been evaluated of it: equal expressions have equal digests."""
        return Expression, (self.text, self.tree)

    @property
    def excerpt(self) -> str:
        """The text, shortened for faults, which are single lines."""
        return self.text if len(self.text) <= LONGEST_TEXT else f"{self.text[: LONGEST_TEXT - 1]}…"

    @cached_property
    def names(self) -> frozenset[str]:
        """The variables and parameters that occur (pi is a number)."""
        return frozenset(node.name for node in walk(self.tree) if node.op == "name")

    @cached_property
    def uses_speed(self) -> bool:
        """Tests whether it depends on `omega`, or on `v` other than through its sign."""
        return _uses_speed(self.tree)

    @property
    def uses_time(self) -> bool:
        """Tests whether it depends on `t`."""
        return "t" in self.names

    @cached_property
    def switches_on_velocity(self) -> bool:
        """Tests whether it contains `sign(v)` or a comparison of `v` with 0; `v` may then be given as its sign."""
        return any(_sign_only(node) for node in walk(self.tree))

    def evaluate(self, values: Mapping[str, Any], ns: Any, anchor: Mapping[str, Any] | None = None) -> Any:
        """Value in a namespace (numpy itself, or one of its likes); infinite or NaN if undefined.

        Comparisons, abs, sign, min, max, conditions and the cut of atan2 are decided at `anchor` where one is given:
        the middle of a smooth piece, broadcastable with `values`. A piece then never takes its neighbour's branch.

        >>> ramp = parse("abs(phi - 1)")
        >>> ramp.evaluate({"phi": np.array([0.0, 0.75, 1.5])}, np, {"phi": 0.5}).tolist()
        [1.0, 0.25, -0.5]
        """
        return self._in_range(lambda at: value(self.tree, at), values, ns, anchor)

    def _in_range(self, evaluate: Callable[[At], Any], values: Mapping[str, Any], ns: Any, anchor: Any) -> Any:
        """The value at a place; exponentials are kept separate where plain floats overflow, and always in intervals."""
        at = At(values, ns, None if anchor is None else At(anchor, ns))
        with np.errstate(all="ignore"):
            if not self._grows:
                return evaluate(at)
            base = getattr(ns, "over", ns)
            if base is np:
                try:
                    with np.errstate(over="raise"):
                        return evaluate(at)
                except FloatingPointError:
                    pass
            elif base is not NAMESPACE:
                return evaluate(at)
            apart = scaled_namespace(ns)
            kept = evaluate(At(values, apart, None if anchor is None else At(anchor, apart)))
            return tuple(map(plain, kept)) if isinstance(kept, tuple) else plain(kept)

    _grows = cached_property(lambda self: any(grows(node) for node in walk(self.tree)))

    def degree(self, name: str) -> int | None:
        """Degree in a parameter as far as the structure shows it: 0, 1, or None if it is not evidently linear."""
        return _degree(self.tree, name)

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
        pair: tuple[Any, Any] = self._in_range(lambda at: _linear(self.tree, name, at), values, ns, anchor)
        return pair

    def undefined(self, values: Mapping[str, Any], anchor: Mapping[str, Any] | None = None) -> str:
        """The term that is not finite at a place, in words and as it was written; an empty text if there is none.

        It is the first part whose operands are finite and whose value is not. Values beyond the floating-point range are
        reported only without other faults: exponentials may overflow and cancel.

        >>> parse("3*log(phi-3)").undefined({"phi": 1.0})
        'log(phi-3): the logarithm of -2, which is negative'
        >>> parse("1/(phi-1) + exp(900)").undefined({"phi": 1.0})
        '1/(phi-1): a division by phi-1, which is 0'
        >>> parse("exp(300*phi)").undefined({"phi": 3.0})
        'exp(300*phi): beyond the floating-point range of 1.8e308, as 300*phi = 900'
        """

        def at(node: Node) -> float:
            return float(Expression("", node).evaluate(values, np, anchor))

        nodes = _undefined(self.tree, at)
        reasons = [(node, _reason(node, [at(arg) for arg in node.args], self.part)) for node in nodes]
        reasons.sort(key=lambda one: one[1].startswith(BEYOND))
        return f"{self.part(reasons[0][0])}: {reasons[0][1]}" if reasons else ""

    def part(self, node: Node) -> str:
        """A part of the tree as it was written, where it stands in the text as one."""
        body = self.text.strip(" \t")
        reader = _ExpressionReader(body, self.names, 0)
        reader.read(_python_tree(body, 0, self.names).body, 1)
        text = reader.texts.get(node) or written(node)
        return text if len(text) <= LONGEST_TEXT else f"{text[: LONGEST_TEXT - 1]}…"

    def switches(self) -> tuple[Expression, ...]:
        """The sub-expressions whose change of sign decides a branch, inner ones first; those on `v` are left out."""
        return self._switches

    @cached_property
    def _switches(self) -> tuple[Expression, ...]:
        return _distinct(tree for node in walk(self.tree) for tree in _deciders(node))

    def branch_points(self) -> tuple[Expression, ...]:
        """The sub-expressions at whose zeros a root, asin or acos has a branch point, inner ones first."""
        return _distinct(tree for node in walk(self.tree) for tree in _branch_arguments(node))


def _distinct(nodes: Iterable[Node]) -> tuple[Expression, ...]:
    varying = (node for node in dict.fromkeys(nodes) if any(inner.op == "name" for inner in walk(node)))
    return tuple(Expression(written(node), node) for node in varying)


def parse(text: str, names: frozenset[str] = frozenset()) -> Expression:
    """Reads an expression that may use phi, omega, t, x, v, pi and the given parameter names.

    Raises ExpressionError, whose message is one line.

    >>> parse("300 * sin(phi")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    flywheel.numerics.expressions.ExpressionError: found a text ...
    """
    # what Python's parser should not even see
    if not text.strip(" \t"):
        raise ExpressionError("an empty text")
    if len(text) > LENGTH_CAP:
        raise ExpressionError(f"a text of {len(text)} characters", f"at most {LENGTH_CAP}")
    if foreign := _FOREIGN.search(text):
        advice = written_here(text, RESERVED | names)
        raise ExpressionError(f"the character {foreign[0]!r} at column {foreign.start() + 1}", advice=advice)
    depth = 0
    for column, character in enumerate(text, 1):
        depth += (character == "(") - (character == ")")
        if depth > DEPTH_CAP:
            raise ExpressionError(f"brackets nested deeper than {DEPTH_CAP} at column {column}", "less nesting")
    body = text.strip(" \t")
    indent = len(text) - len(text.lstrip(" \t"))
    return Expression(text, _ExpressionReader(body, names, indent).read(_python_tree(body, indent, names).body, 1))


def _python_tree(body: str, indent: int, names: frozenset[str]) -> ast.Expression:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return ast.parse(body, mode="eval")
    except SyntaxError as error:
        place = f" (column {error.offset + indent})" if error.offset else ""
        advice = written_here(body, RESERVED | names)
        raise ExpressionError(f"a text that cannot be read{place}: {str(error.msg)[:100]}", advice=advice) from None
    except (ValueError, RecursionError, MemoryError, OverflowError):
        raise ExpressionError("a text too large or too deeply nested", "a shorter one") from None


class _ExpressionReader:
    """Turns Python's tree of one text into ours, and refuses every node that is not on the list; `texts` are its parts'."""

    def __init__(self, text: str, names: frozenset[str], indent: int) -> None:
        self.source = text.encode()  # ast counts columns in UTF-8 bytes
        self.names = names
        self.indent = indent
        self.count = 0
        self.texts: dict[Node, str] = {}

    def read(self, node: ast.expr, depth: int) -> Node:
        """The tree of a node; ExpressionError for one that is not allowed, too deep, or beyond the greatest number."""
        self.count += 1
        if self.count > NODE_CAP:
            raise ExpressionError(f"more than {NODE_CAP} numbers, names and operations", "a shorter text")
        if depth > DEPTH_CAP:
            raise ExpressionError(f"operations nested deeper than {DEPTH_CAP}{self._place(node)}", "less nesting")
        rule = _READERS.get(type(node))
        if rule is None:
            raise ExpressionError(self._excerpt(node), advice=written_here(self._text(node), ()))
        value = rule(self, node, depth + 1)
        self.texts.setdefault(value, self._text(node))
        return value

    def _text(self, node: ast.expr) -> str:
        return self.source[node.col_offset : node.end_col_offset].decode()

    def _place(self, node: ast.expr) -> str:
        return f" at column {len(self.source[: node.col_offset].decode()) + 1 + self.indent}"

    def _excerpt(self, node: ast.expr, at: ast.expr | None = None) -> str:
        """A node as it was written, and the column where it (or another) begins."""
        text = self._text(node)
        return repr(text if len(text) <= 40 else text[:37] + "...") + self._place(at or node)

    def _number(self, node: ast.Constant, depth: int) -> Node:
        if type(node.value) not in (int, float):
            advice = "write 1 or 0" if isinstance(node.value, bool) else ""
            raise ExpressionError(self._excerpt(node), "a real number", advice)
        try:
            number = float(node.value)  # type: ignore[arg-type]
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise ExpressionError(f"the number {self._excerpt(node)}", "a number below 1.8e308")
        return Node("number", number=number)

    def _name(self, node: ast.Name, depth: int) -> Node:
        name = self._text(node)  # as written: Python would take a full-width 'phi' for the plain one
        if name == "pi":
            return Node("pi")
        if name in VARIABLES or name in self.names - RESERVED:
            return Node("name", name=name)
        if name in FUNCTIONS:
            raise ExpressionError(f"the function {name!r}{self._place(node)} without brackets", f"{name}(...)")
        names = (*VARIABLES, "pi", *sorted(self.names - RESERVED))
        raise ExpressionError(
            f"the unknown name {self._excerpt(node)}",
            "one of " + ", ".join(names),
            written_here(name, ()) or _nearest(name, names),
        )

    def _binary(self, node: ast.BinOp, depth: int) -> Node:
        """A power; a sum or product with all its members side by side, however long."""
        if isinstance(node.op, ast.Pow):
            return self._power(node, depth)
        kind, signs = next(((kind, signs) for kind, signs in _SPINES.items() if type(node.op) in signs), ("", {}))
        if not kind:
            raise ExpressionError(f"the operation {self._excerpt(node)}", "+ - * / **")
        members: list[tuple[str, Node]] = []
        inner: ast.expr = node
        while isinstance(inner, ast.BinOp) and type(inner.op) in signs:
            members.append((signs[type(inner.op)], self.read(inner.right, depth)))
            inner = inner.left
        members.append(("+" if kind == "sum" else "*", self.read(inner, depth)))
        senses, args = zip(*reversed(members), strict=True)
        return Node(kind, args, signs=senses)

    def _power(self, node: ast.BinOp, depth: int) -> Node:
        base, exponent = self.read(node.left, depth), self.read(node.right, depth)
        if not any(inner.op == "name" for inner in walk(exponent)):
            with np.errstate(all="ignore"):
                number = float(value(exponent, At({}, np)))
            if not abs(number) <= EXPONENT_CAP:
                expected = f"one between -{EXPONENT_CAP} and {EXPONENT_CAP}"
                raise ExpressionError(f"the exponent {self._excerpt(node.right)}", expected)
            exponent = Node("number", number=number)
        return Node("**", (base, exponent))

    def _unary(self, node: ast.UnaryOp, depth: int) -> Node:
        operand = self.read(node.operand, depth)
        if isinstance(node.op, ast.Not):
            return Node("not", (operand,))
        if isinstance(node.op, ast.UAdd):
            return operand
        return Node("number", number=-operand.number) if operand.op == "number" else Node("neg", (operand,))

    def _compare(self, node: ast.Compare, depth: int) -> Node:
        signs = tuple(_COMPARE.get(type(op), "") for op in node.ops)
        if "" in signs:
            raise ExpressionError(f"the comparison {self._excerpt(node)}", "one of < <= > >= == !=")
        return Node("compare", tuple(self.read(arg, depth) for arg in (node.left, *node.comparators)), signs=signs)

    def _logic(self, node: ast.BoolOp, depth: int) -> Node:
        op = "and" if isinstance(node.op, ast.And) else "or"
        args = tuple(self.read(arg, depth) for arg in node.values)
        if number := next((at for at, arg in zip(node.values, args, strict=True) if not _is_truth(arg)), None):
            advice = written_here(self.source.decode(), ()) or CONDITION
            raise ExpressionError(f"the number {self._excerpt(number)}", f"a comparison on either side of {op}", advice)
        return Node(op, args)

    def _choice(self, node: ast.IfExp, depth: int) -> Node:
        return Node("if", tuple(self.read(arg, depth) for arg in (node.test, node.body, node.orelse)))

    def _call(self, node: ast.Call, depth: int) -> Node:
        name = self._text(node.func)
        if not isinstance(node.func, ast.Name) or name not in FUNCTIONS:
            expected = "one of " + ", ".join(FUNCTIONS)
            names = self.names | RESERVED
            advice = PRODUCT if name in names else written_here(self._text(node), names) or _nearest(name, FUNCTIONS)
            raise ExpressionError(f"a call to {self._excerpt(node.func, node)}", expected, advice)
        if node.keywords:
            raise ExpressionError(f"a keyword in {self._excerpt(node)}", "plain arguments")
        count, arity = len(node.args), {"atan2": 2, "min": None, "max": None}.get(name, 1)
        if count != arity and (arity is not None or count < 2):
            allowed = {1: "one", 2: "two (y, x)", None: "two or more"}[arity]
            plural = "" if count == 1 else "s"
            raise ExpressionError(f"{count} argument{plural} of {name}{self._place(node)}", allowed)
        args = tuple(self.read(arg, depth) for arg in node.args)
        return _paired(name, args) if name in ("min", "max") else Node(name, args)


def _is_truth(node: Node) -> bool:
    """Tests whether a tree is true or false: a comparison, or a combination of comparisons."""
    return node.op in BOOLEAN or (node.op == "if" and all(map(_is_truth, node.args[1:])))


def _paired(name: str, args: tuple[Node, ...]) -> Node:
    """Minimum or maximum of many as a balanced tree of pairs, each of which is one switch."""
    if len(args) == 1:
        return args[0]
    middle = len(args) // 2
    return Node(name, (_paired(name, args[:middle]), _paired(name, args[middle:])))


def _nearest(name: str, names: tuple[str, ...]) -> str:
    near = nearest(name[:40], names)
    return f"did you mean {near!r}?" if near else ""


_SPINES: dict[str, dict[type, str]] = {"sum": {ast.Add: "+", ast.Sub: "-"}, "product": {ast.Mult: "*", ast.Div: "/"}}
_COMPARE = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}
_READERS: dict[type, Callable[[_ExpressionReader, Any, int], Node]] = {
    ast.Constant: _ExpressionReader._number,
    ast.Name: _ExpressionReader._name,
    ast.BinOp: _ExpressionReader._binary,
    ast.UnaryOp: _ExpressionReader._unary,
    ast.Compare: _ExpressionReader._compare,
    ast.BoolOp: _ExpressionReader._logic,
    ast.IfExp: _ExpressionReader._choice,
    ast.Call: _ExpressionReader._call,
}


def expression_of(number: float) -> str:
    """A number as an expression holds it, to the last digit; a negative one in brackets.

    >>> expression_of(0.1), expression_of(-2)
    ('0.1', '(-2.0)')
    """
    text = repr(float(present(number)))
    return f"({text})" if text.startswith("-") else text


def compiled(template: str, **parts: float | Expression) -> Expression:
    """The expression that a template becomes when its names in braces are replaced by numbers or by other expressions.

    These are inserted as trees: the result may be longer and deeper than a text that is read.

    >>> compiled("-{k}*omega*abs(omega)", k=0.1).text
    '-0.1*omega*abs(omega)'
    >>> compiled("{law} if omega > 2 else 0", law=compiled("{k}*omega", k=3)).evaluate({"omega": 4.0}, np)
    12.0
    """
    trees = {f"part_{name}": part.tree if isinstance(part, Expression) else _finite(part) for name, part in parts.items()}
    tree = parse(template.format(**{name: f"part_{name}" for name in parts}), frozenset(trees)).tree
    texts = {name: f"({part.text})" if isinstance(part, Expression) else expression_of(part) for name, part in parts.items()}
    return Expression(template.format(**texts), composed(tree, trees))


def _finite(number: float) -> Node:
    if not math.isfinite(present(number)):
        raise ExpressionError(f"the number {float(present(number))}", "a number below 1.8e308")
    return numeral(number)


def composed(node: Node, parts: Mapping[str, Node]) -> Node:
    """A tree with parts in place of names."""
    if node.op == "name":
        return parts.get(node.name, node)
    args = tuple(composed(arg, parts) for arg in node.args)
    if node.op == "neg" and args[0].op == "number":
        return numeral(-args[0].number)
    return node._replace(args=args)


def numeral(number: float) -> Node:
    """A number as a tree; a recorded one stays recorded."""
    return Node("number", number=float(number) if present(number) is number else number)


def variable(name: str) -> Node:
    """A variable as a tree."""
    return Node("name", name=name)


def between(of: Node, knots: Sequence[float], leaves: Sequence[Node]) -> Node:
    """The leaf between whose knots a variable lies, by bisection; there is one leaf more than knots.

    >>> law = Expression("steps", between(variable("x"), [1.0, 2.0], [numeral(10), numeral(20), numeral(30)]))
    >>> [law.evaluate({"x": x}, np) for x in (0.0, 1.0, 5.0)]
    [10.0, 20.0, 30.0]
    """
    if not knots:
        return leaves[0]
    middle = len(knots) // 2
    test = Node("compare", (of, numeral(knots[middle])), signs=("<",))
    below = between(of, knots[:middle], leaves[: middle + 1])
    return Node("if", (test, below, between(of, knots[middle + 1 :], leaves[middle + 1 :])))


_PURE = Unit()
_KEEPING = frozenset({"neg", "abs", "sum", "min", "max", "if"})  # have the unit of what they are made of


def unit_of(node: Node, units: Mapping[str, Unit]) -> Unit | None:
    """The unit of an expression; None if names of unknown units, or sums of different ones, leave it undetermined.

    >>> from flywheel.numerics.units import parse_unit
    >>> unit_text(unit_of(parse("2*v**2/x").tree, {"v": parse_unit("m/s", None), "x": parse_unit("m", None)}))
    'm/s^2'
    """
    if node.op == "name":
        return units.get(node.name)
    if node.op in _KEEPING:
        units_of = {unit_of(arg, units) for arg in node.args[node.op == "if" :]}
        return units_of.pop() if len(units_of) == 1 else None
    if node.op == "product":
        return _unit_of_product(zip(node.signs, node.args, strict=True), units)
    if node.op == "**":
        base, exponent = unit_of(node.args[0], units), node.args[1]
        whole = exponent.op == "number" and exponent.number == int(exponent.number)
        return base if base == _PURE else base ** int(exponent.number) if base is not None and whole else None
    return _PURE if node.op != "sqrt" or unit_of(node.args[0], units) == _PURE else None


def _unit_of_product(factors: Iterable[tuple[str, Node]], units: Mapping[str, Unit]) -> Unit | None:
    total = _PURE
    for sign, arg in factors:
        unit = unit_of(arg, units)
        if unit is None:
            return None
        total = total * (unit**-1 if sign == "/" else unit)
    return total


def units_of_name(node: Node, name: str, unit: Unit, units: Mapping[str, Unit]) -> Iterator[Unit | None]:
    """The unit of a name everywhere in an expression that has a unit itself; None if that is undetermined.

    >>> from flywheel.numerics.units import parse_unit
    >>> law, speed = parse("-k*omega", frozenset({"k"})).tree, {"omega": parse_unit("rad/s", None)}
    >>> [unit_text(unit) for unit in units_of_name(law, "k", parse_unit("N m", None), speed)]
    ['N m s/rad']
    """
    if node.op == "name" and node.name == name:
        yield unit
    elif node.op in _KEEPING:
        for arg in node.args[node.op == "if" :]:
            yield from units_of_name(arg, name, unit, units)
    elif node.op == "product":
        factors = list(zip(node.signs, node.args, strict=True))
        for k, (sign, arg) in enumerate(factors):
            if depends(arg, name):
                others = _unit_of_product(factors[:k] + factors[k + 1 :], units)
                if others is None or sign == "/":
                    yield None
                else:
                    yield from units_of_name(arg, name, unit * others**-1, units)
    elif depends(node, name):
        yield None


def unit_text(unit: Unit | None) -> str | None:
    """A unit in SI as text: by its usual name, else by powers of N (or kg), m, s, A and rad."""
    if unit is None:
        return None
    for dimension in DIMENSIONS.values():
        if unit.powers == dimension.powers and unit.angle == dimension.angles[-1]:
            return dimension.si or "1"
    length, mass, time, angle, current, kelvin = unit[2:]
    force = max(mass, 0)
    powers = {"N": force, "kg": mass - force, "m": length - force, "s": time + 2 * force, "A": current, "K": kelvin}
    powers["rad"] = angle
    over = " ".join(name if power == 1 else f"{name}^{power}" for name, power in powers.items() if power > 0)
    under = " ".join(name if power == -1 else f"{name}^{-power}" for name, power in powers.items() if power < 0)
    return f"{over or '1'}/{under}" if under else over
