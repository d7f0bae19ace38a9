"""Expressions as trees of nested lists: data that JSON can hold, and that nothing has to evaluate.

A tree is a number, `["name", text]`, `["ratio", p, q]`, `["piecewise", value, condition, value, condition, ...]` or
`[operation, argument, ...]` with one of `OPERATIONS`. Integers, ratios and pi stay exact, floats keep every bit. Whatever a
tree holds, reading it ends soon: depth, size and powers are limited, and SymPy builds it without simplifying.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from itertools import cycle, islice
from typing import Any, NamedTuple

from bondgraph.laws import GraphError

MAX_DEPTH = 100
MAX_NODES = 10_000
MAX_BITS = 1023  # of an exact number: the range of floats
MAX_POWER_BITS = 100_000  # that exact numbers could grow to if a power were multiplied out

Check = Callable[[Any, str], Iterator[str]]  # (value, its place) -> faults

_MANY = MAX_NODES
_VALUE, _CONDITION = "value", "condition"
_PLAIN = "value without a piecewise"  # inside conditions: SymPy multiplies choices out there


class Operation(NamedTuple):
    """An operation of expression trees: its name in SymPy, how many arguments it takes, of which sort, and what it gives."""

    sympy: str
    least: int = 1
    most: int = 1
    takes: str = _VALUE
    gives: str = _VALUE


OPERATIONS: Mapping[str, Operation] = {
    "pi": Operation("pi", 0, 0),
    "e": Operation("E", 0, 0),
    "add": Operation("Add", 2, _MANY),
    "mul": Operation("Mul", 2, _MANY),
    "power": Operation("Pow", 2, 2),
    **{name: Operation(name) for name in ("sin", "cos", "tan", "asin", "acos", "atan", "exp", "log", "sign")},
    **{name: Operation(name) for name in ("sinh", "cosh", "tanh", "asinh", "acosh", "atanh")},
    "atan2": Operation("atan2", 2, 2),
    "abs": Operation("Abs"),
    "heaviside": Operation("Heaviside", 1, 2),
    "max": Operation("Max", 2, _MANY),
    "min": Operation("Min", 2, _MANY),
    "less": Operation("Lt", 2, 2, _PLAIN, _CONDITION),
    "less_equal": Operation("Le", 2, 2, _PLAIN, _CONDITION),
    "greater": Operation("Gt", 2, 2, _PLAIN, _CONDITION),
    "greater_equal": Operation("Ge", 2, 2, _PLAIN, _CONDITION),
    "equal": Operation("Eq", 2, 2, _PLAIN, _CONDITION),
    "not_equal": Operation("Ne", 2, 2, _PLAIN, _CONDITION),
    "and": Operation("And", 2, _MANY, _CONDITION, _CONDITION),
    "or": Operation("Or", 2, _MANY, _CONDITION, _CONDITION),
    "not": Operation("Not", 1, 1, _CONDITION, _CONDITION),
    "true": Operation("true", 0, 0, gives=_CONDITION),
    "false": Operation("false", 0, 0, gives=_CONDITION),
}


def as_tree(expression: Any) -> Any:
    """The tree of a SymPy expression.

    Raises:
        GraphError: it holds something that is none of `OPERATIONS`, or is too large.

    >>> import sympy
    >>> as_tree(sympy.sin(sympy.Symbol("theta")) / 2)
    ['mul', ['ratio', 1, 2], ['sin', ['name', 'theta']]]

    """
    import sympy  # type: ignore[import-untyped]

    try:
        large = next(islice(sympy.preorder_traversal(expression), MAX_NODES, None), None) is not None
        tree = None if large else _tree(expression)
    except RecursionError:
        large = True
    faults = [f"found {_LIMITS}"] if large else list(tree_faults(tree, "its formula"))
    if faults:
        raise GraphError(f"cannot be saved: {'; '.join(faults)}")
    return tree


def from_tree(tree: Any) -> Any:
    """The SymPy expression of a tree that `tree_faults` finds nothing wrong with.

    >>> from_tree(["mul", ["ratio", 1, 2], ["sin", ["name", "theta"]]])
    sin(theta)/2
    """
    import sympy

    if not isinstance(tree, list):
        return sympy.Integer(tree) if isinstance(tree, int) else sympy.Float(tree)
    operation, *arguments = tree
    if operation == "name":
        return sympy.Symbol(arguments[0])
    if operation == "ratio":
        return sympy.Rational(*arguments)
    values = [from_tree(argument) for argument in arguments]
    if operation == "piecewise":
        return sympy.Piecewise(*zip(values[::2], values[1::2], strict=True), evaluate=False)
    made = getattr(sympy, OPERATIONS[operation].sympy)
    return made(*values, evaluate=False) if OPERATIONS[operation].most else made


def _tree(expression: Any) -> Any:
    import sympy

    if isinstance(expression, sympy.Symbol):
        return ["name", expression.name]
    if isinstance(expression, sympy.Integer):
        return int(expression)
    if isinstance(expression, sympy.Rational):
        return ["ratio", int(expression.p), int(expression.q)]
    if isinstance(expression, sympy.Float):
        if not float(expression) and expression:
            raise GraphError(f"cannot be saved: found {expression}, expected a number that a double holds")
        return float(expression)
    if isinstance(expression, sympy.Piecewise):
        return ["piecewise", *(_tree(item) for pair in expression.args for item in pair.args)]
    known = isinstance(expression, sympy.Basic)
    operation = _by_sympy().get(expression.func if expression.args else expression) if known else None
    if operation is None:
        raise GraphError(f"cannot be saved: found {type(expression).__name__}, expected one of {', '.join(OPERATIONS)}")
    return [operation, *(_tree(argument) for argument in expression.args)]


@cache
def _by_sympy() -> Mapping[Any, str]:
    """SymPy's class, or constant, -> operation."""
    import sympy

    return {getattr(sympy, operation.sympy): name for name, operation in OPERATIONS.items()}


def names_in(tree: Any) -> set[str]:
    """The names that a tree without faults depends on."""
    if not isinstance(tree, list):
        return set()
    return {tree[1]} if tree[0] == "name" else set[str]().union(*map(names_in, tree[1:]))


def tree_faults(tree: Any, place: str) -> Iterator[str]:
    r"""Everything that is wrong with a tree, a line each with its place; a tree that is too large is not read to its end.

    >>> print(*tree_faults(["add", ["sin"], "theta"], "law"), sep="\n")
    law[1]: found sin of 0 arguments, expected 1
    law[2]: found 'theta', expected a finite number or [operation, argument, ...]
    """
    todo: list[tuple[Any, str, str, int]] = [(tree, _VALUE, place, 1)]
    count, sound = 0, True
    while todo:
        node, sort, where, depth = todo.pop()
        count += 1
        if depth > MAX_DEPTH or count > MAX_NODES:
            yield f"{place}: found {_LIMITS}"
            return
        faults = list(_node_faults(node, sort, where))
        yield from faults
        sound = sound and not faults
        if isinstance(node, list) and not faults:
            below = zip(range(1, len(node)), node[1:], _sorts(node, sort), strict=False)
            todo.extend(reversed([(child, of, f"{where}[{k}]", depth + 1) for k, child, of in below]))
    if sound and _bits(tree) == math.inf:
        yield f"{place}: found a power of exact numbers with more than {MAX_POWER_BITS} bits, expected a smaller one"


_LIMITS = f"more than {MAX_NODES} operations or {MAX_DEPTH} levels, expected a smaller tree"


def _sorts(node: Sequence[Any], sort: str) -> Iterator[str]:
    """What a node's arguments have to be."""
    if node[0] in ("name", "ratio"):
        return iter(())
    if node[0] == "piecewise":
        return cycle((_VALUE, _CONDITION))
    takes = OPERATIONS[node[0]].takes
    return cycle((_PLAIN if (sort, takes) == (_PLAIN, _VALUE) else takes,))


def _node_faults(node: Any, sort: str, place: str) -> Iterator[str]:
    """What is wrong with one node, its arguments left aside."""
    if not isinstance(node, list):
        if sort == _CONDITION or list(number_faults(node, place)):
            expected = "a condition" if sort == _CONDITION else "a finite number or [operation, argument, ...]"
            yield f"{place}: found {shown(node)}, expected {expected}"
    elif not node or not isinstance(node[0], str) or node[0] not in {*_LEAVES, "piecewise", *OPERATIONS}:
        expected = ", ".join([*_LEAVES, "piecewise", *OPERATIONS])
        yield f"{place}: found {shown(node[0]) if node else 'nothing'}, expected an operation: {expected}"
    elif node[0] in _LEAVES:
        holds, expected = _LEAVES[node[0]]
        if sort == _CONDITION or not holds(node[1:]):
            yield f"{place}: found {shown(node)}, expected {'a condition' if sort == _CONDITION else expected}"
    elif node[0] == "piecewise":
        if len(node) < 3 or len(node) % 2 == 0:
            yield f"{place}: found piecewise of {len(node) - 1} arguments, expected pairs of value and condition"
        if sort != _VALUE:
            yield f"{place}: found piecewise, expected a {sort}"
    else:
        operation = OPERATIONS[node[0]]
        if not operation.least <= len(node) - 1 <= operation.most:
            count = f"{operation.least}" if operation.least == operation.most else f"{operation.least} to {operation.most}"
            yield f"{place}: found {node[0]} of {len(node) - 1} arguments, expected {count}"
        if (operation.gives == _CONDITION) != (sort == _CONDITION):
            yield f"{place}: found {node[0]}, which is a {operation.gives}, expected a {sort}"


def _is_name(arguments: Sequence[Any]) -> bool:
    return len(arguments) == 1 and isinstance(arguments[0], str) and arguments[0] != ""


def _is_ratio(arguments: Sequence[Any]) -> bool:
    whole = all(isinstance(n, int) and not list(number_faults(n, "")) for n in arguments)
    return whole and len(arguments) == 2 and arguments[1] > 0


_LEAVES: Mapping[str, tuple[Callable[[Sequence[Any]], bool], str]] = {
    "name": (_is_name, "[name, text]"),
    "ratio": (_is_ratio, "[ratio, whole number, whole number above 0]"),
}


def _bits(tree: Any) -> float:
    """At most how many bits the exact numbers of a tree could grow to; infinite where a power is beyond the limit."""
    if not isinstance(tree, list):
        return float(tree.bit_length()) if isinstance(tree, int) else 1.0
    if tree[0] == "name":
        return 1
    if tree[0] != "power":
        return sum(map(_bits, tree[1:]))
    bits = _bits(tree[1]) * max(1.0, _size(tree[2]))
    return bits if bits <= MAX_POWER_BITS else math.inf


def _size(exponent: Any) -> float:
    """At most how large the exact number in an exponent could be."""
    if isinstance(exponent, float):
        return 1.0
    if isinstance(exponent, int):
        return float(min(abs(exponent), MAX_POWER_BITS + 1))
    if exponent[0] == "ratio":
        return float(min(abs(exponent[1]) // exponent[2] + 1, MAX_POWER_BITS + 1))
    return math.exp2(min(_bits(exponent), 64.0))


def number_faults(value: Any, place: str) -> Iterator[str]:
    """A line where something is no number, or none in the range of floats."""
    exact = isinstance(value, int) and not isinstance(value, bool) and value.bit_length() <= MAX_BITS
    if not exact and not (isinstance(value, float) and math.isfinite(value)):
        yield f"{place}: found {shown(value)}, expected a finite number"


def shown(value: Any) -> str:
    """A found value, short enough for an error's line."""
    if isinstance(value, dict | list):
        return f"{'an object' if isinstance(value, dict) else 'a list'} of {len(value)}"
    if isinstance(value, int) and value.bit_length() > MAX_BITS:
        return "a huge number"
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
