"""The checked tree of an expression, and what can be asked of it: values, linearity, the places where it switches.

A tree is evaluated against a namespace that gives the functions by their numpy names, so numpy itself serves, and so do
intervals, jets, mpmath and SymPy through small adapters: sin cos tan asin acos atan atan2 sqrt exp log abs sign minimum
maximum where divide power less less_equal greater greater_equal equal not_equal logical_and logical_or logical_not, pi.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import reduce
from typing import Any, NamedTuple

SMOOTH = ("sin", "cos", "tan", "asin", "acos", "atan", "sqrt", "exp", "log")
COMPARISONS = {
    "<": "less",
    "<=": "less_equal",
    ">": "greater",
    ">=": "greater_equal",
    "==": "equal",
    "!=": "not_equal",
}
BOOLEAN = frozenset({"compare", "and", "or", "not"})


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
    """Where a tree is evaluated: values by name, the namespace, and where switches are decided, if elsewhere."""

    values: Mapping[str, Any]
    ns: Any
    anchor: At | None = None


def walk(node: Node) -> Iterator[Node]:
    """Every node of a tree, the inner ones before those that hold them."""
    for arg in node.args:
        yield from walk(arg)
    yield node


def depends(node: Node, name: str) -> bool:
    """Whether a name occurs in a tree."""
    return node.name == name or any(depends(arg, name) for arg in node.args)


# --- values ----------------------------------------------------------------------------------------------------------


def value(node: Node, at: At) -> Any:
    """Value of a tree as a number; a truth value counts 1 or 0."""
    return _RULES[node.op](node, at)


def truth(node: Node, at: At) -> Any:
    """Truth value of a tree where its switches are decided; a number is true when it is not zero."""
    place = at if at.anchor is None else at.anchor
    return _truth(node, place)


def _truth(node: Node, at: At) -> Any:
    ns = at.ns
    if node.op == "compare":
        return _chain(node, at)
    if node.op in ("and", "or"):
        combine = ns.logical_and if node.op == "and" else ns.logical_or
        return reduce(combine, [_truth(arg, at) for arg in node.args])
    if node.op == "not":
        return ns.logical_not(_truth(node.args[0], at))
    return ns.not_equal(value(node, at), 0.0)


def _chain(node: Node, at: At) -> Any:
    members = [value(arg, at) for arg in node.args]
    links = [
        getattr(at.ns, COMPARISONS[sign])(left, right)
        for sign, left, right in zip(node.signs, members, members[1:], strict=False)
    ]
    return reduce(at.ns.logical_and, links)


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
        return at.ns.exponential(Node("product", (exponent, Node("log", (base,))), signs=("*", "*")), at)
    return at.ns.power(value(base, at), value(exponent, at))


def grows(node: Node) -> bool:
    """Whether a node is an exponential: exp, or a positive number to a power that varies."""
    if node.op != "**":
        return node.op == "exp"
    base, exponent = node.args
    return exponent.op != "number" and base.op == "number" and base.number > 0.0


def _smooth(node: Node, at: At) -> Any:
    return getattr(at.ns, node.op)(value(node.args[0], at))


def _exponential(node: Node, at: At) -> Any:
    """Of a namespace that keeps exponents apart, by its own rule, which is told the exponent's tree."""
    own = getattr(at.ns, "exponential", None)
    return at.ns.exp(value(node.args[0], at)) if own is None else own(node.args[0], at)


def _indicator(node: Node, at: At) -> Any:
    return at.ns.where(truth(node, at), 1.0, 0.0)


def _choice(node: Node, at: At) -> Any:
    test, yes, no = node.args
    chosen = truth(test, at)
    if isinstance(chosen, bool) or getattr(chosen, "shape", None) == ():  # one place: the other branch is not needed
        return value(yes if chosen else no, at)
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
    **dict.fromkeys(SMOOTH, _smooth),
    "exp": _exponential,
    **dict.fromkeys(BOOLEAN, _indicator),
}


# --- values that are not finite --------------------------------------------------------------------------------------

BEYOND = "beyond the floating-point range of 1.8e308"
_VALID = {
    "log": ("the logarithm", "negative"),
    "sqrt": ("the square root", "negative"),
    "asin": ("the arcsine", "outside -1 to 1"),
    "acos": ("the arccosine", "outside -1 to 1"),
}


def undefined(node: Node, at: Callable[[Node], float]) -> Iterator[Node]:
    """The parts of a tree that have finite operands and no finite value, where the whole has none; `at` gives values."""
    if math.isfinite(at(node)):
        return
    args = node.args
    if node.op == "if":
        args = (args[2 if at(Node("not", args[:1])) else 1],)
    inner = [part for arg in args for part in undefined(arg, at)]
    yield from inner or [node]


def reason(node: Node, operands: Sequence[float], text: Callable[[Node], str]) -> str:
    """Why a node has no finite value for finite operands, in words; `text` writes its parts."""
    if node.op in _VALID:
        what, outside = _VALID[node.op]
        return f"{what} of {_told(operands[0])}" + (f", which is {outside}" if operands[0] else "")
    for sign, arg, operand in zip(node.signs, node.args, operands, strict=False):
        if node.op == "product" and sign == "/" and operand == 0.0:
            return "a division by 0" if is_zero(arg) else f"a division by {text(arg)}, which is 0"
    if node.op == "**" and operands[0] <= 0.0:
        power = f"to the power of {operands[1]:.6g}"
        return (
            f"{operands[0]:.6g}, which is negative, {power}" if operands[0] else f"{text(node.args[0])}, which is 0, {power}"
        )
    if node.op in ("exp", "**"):
        return f"{BEYOND}, as {text(node.args[-1])} = {operands[-1]:.6g}"
    return BEYOND if node.args else "a value that is not finite"


def _told(number: float) -> str:
    """A number with six digits, or all where those are just 1."""
    short = f"{number:.6g}"
    return short if short.lstrip("-") != "1" or float(short) == number else repr(number)


# --- linearity -------------------------------------------------------------------------------------------------------


def degree(node: Node, name: str) -> int | None:
    """Structural degree of a tree in a name: 0 (absent), 1 (linear), or None where linearity is not evident.

    Not evident: a product of two factors that hold it, a denominator, an exponent, a function's argument, a test.
    """
    if not depends(node, name):
        return 0
    if node.op == "name":
        return 1
    if node.op == "if" and depends(node.args[0], name):
        return None
    if node.op == "product":
        return _product_degree(node, name)
    if node.op in ("sum", "neg", "if"):
        found = [degree(arg, name) for arg in node.args]
        return None if None in found else 1
    return None


def _product_degree(node: Node, name: str) -> int | None:
    holders = [i for i, arg in enumerate(node.args) if depends(arg, name)]
    if len(holders) > 1 or node.signs[holders[0]] == "/":
        return None
    return degree(node.args[holders[0]], name)


def linear(node: Node, name: str, at: At) -> tuple[Any, Any]:
    """The two coefficients of a tree of degree 0 or 1: value = c0 + c1 name, without differencing."""
    if not depends(node, name):
        return value(node, at), 0.0
    if node.op == "name":
        return 0.0, 1.0
    if node.op == "product":
        return _linear_product(node, name, at)
    pairs = [linear(arg, name, at) for arg in node.args if node.op != "if" or arg is not node.args[0]]
    if node.op == "neg":
        return -pairs[0][0], -pairs[0][1]
    if node.op == "if":
        test = truth(node.args[0], at)
        return at.ns.where(test, pairs[0][0], pairs[1][0]), at.ns.where(test, pairs[0][1], pairs[1][1])
    parts = zip(node.signs, pairs, strict=True)
    return reduce(lambda sofar, part: _add_pair(sofar, *part), parts, (0.0, 0.0))


def _add_pair(sofar: tuple[Any, Any], sign: str, pair: tuple[Any, Any]) -> tuple[Any, Any]:
    if sign == "+":
        return sofar[0] + pair[0], sofar[1] + pair[1]
    return sofar[0] - pair[0], sofar[1] - pair[1]


def _linear_product(node: Node, name: str, at: At) -> tuple[Any, Any]:
    constant, slope = 1.0, 1.0
    for sign, arg in zip(node.signs, node.args, strict=True):
        if depends(arg, name):
            pair = linear(arg, name, at)
            constant, slope = constant * pair[0], slope * pair[1]
        else:
            factor = value(arg, at)
            change = at.ns.divide if sign == "/" else lambda a, b: a * b
            constant, slope = change(constant, factor), change(slope, factor)
    return constant, slope


# --- switches --------------------------------------------------------------------------------------------------------


def difference(left: Node, right: Node) -> Node:
    """The tree left - right, or the one that is not the number zero (its sign changes in the same places)."""
    if is_zero(right):
        return left
    return right if is_zero(left) else Node("sum", (left, right), signs=("+", "-"))


def is_zero(node: Node) -> bool:
    """Whether a tree is the constant 0."""
    return node.op == "number" and node.number == 0.0


def _is_velocity(node: Node) -> bool:
    return node.name == "v" or (node.op == "neg" and node.args[0].name == "v")


def sign_only(node: Node) -> frozenset[int]:
    """The members of a node that are v or -v and matter through their sign alone."""
    if node.op == "sign":
        return frozenset(i for i, arg in enumerate(node.args) if _is_velocity(arg))
    if node.op != "compare":
        return frozenset()
    last = len(node.args) - 1
    beside = {i: [node.args[j] for j in (i - 1, i + 1) if 0 <= j <= last] for i in range(last + 1)}
    return frozenset(i for i, arg in enumerate(node.args) if _is_velocity(arg) and all(map(is_zero, beside[i])))


def uses_speed(node: Node) -> bool:
    """Whether a tree depends on omega, or on v other than through its sign."""
    if node.name in ("omega", "v"):
        return True
    hidden = sign_only(node)
    return any(uses_speed(arg) for i, arg in enumerate(node.args) if i not in hidden)


def deciders(node: Node) -> list[Node]:
    """The trees whose sign decides this node itself: differences of compared sides, arguments of abs and sign."""
    if node.op == "compare":
        velocity = sign_only(node)
        pairs = [(i, i + 1) for i in range(len(node.signs)) if not velocity & {i, i + 1}]
        return [difference(node.args[i], node.args[j]) for i, j in pairs]
    if node.op in ("min", "max"):
        return [difference(*node.args)]
    if node.op in ("abs", "atan2"):
        return [node.args[0]]
    return [node.args[0]] if node.op == "sign" and not sign_only(node) else []


def branch_arguments(node: Node) -> list[Node]:
    """The trees at whose zeros this node has a branch point: a root's radicand, 1 - u and 1 + u of asin and acos."""
    if node.op == "sqrt":
        return [node.args[0]]
    if node.op in ("asin", "acos"):
        one = Node("number", number=1.0)
        return [Node("sum", (one, node.args[0]), signs=("+", sign)) for sign in "-+"]
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
