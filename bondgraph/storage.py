"""Saving and loading graphs as plain JSON data, in which no text is ever evaluated.

    {"format": "bondgraph", "version": 1,
     "elements": [{"kind": "1", "name": "crank", "domain": "rotation"},
                  {"kind": "TF", "name": "T", "law": {"of": ["theta"], "expression": ["sin", ["name", "theta"]]}},
                  {"kind": "I", "name": "J", "part": "rotor", "law": 2.0}, ...],
     "bonds": [[1, "crank", "J"], ...],                                  number, tail, head
     "displacements": [{"name": "theta", "of": "crank", "initial": 0.0}],
     "signals": ["F"],
     "parameters": {"k": 3.0, "open": null}}

An element's `domain`, `part` and `law` and the last three tables may be left out. A law is a number, or an expression:
the names in the graph that it is a function of, and a tree of lists. Laws given as Python functions are saved as the
formulas that they write down; those that write none down cannot be saved, nor can laws that a mechanism's motion gives the
positions for.

A tree is a number, `["name", text]`, `["ratio", p, q]`, `["piecewise", value, condition, value, condition, ...]` or
`[operation, argument, ...]` with one of `OPERATIONS`. Integers, ratios and pi stay exact, floats keep every bit. Whatever a
tree holds, reading it ends soon: depth, size and powers are limited, and SymPy builds it without simplifying.
"""

from __future__ import annotations

import json
import math
import os
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from itertools import cycle, islice
from pathlib import Path
from typing import Any, NamedTuple

from bondgraph.elements import Displacement, Element, Function, GraphError, Law, Modulus, refuse
from bondgraph.files import replacement
from bondgraph.graph import Bond, BondGraph, as_graph

FORMAT = "bondgraph"
VERSION = 1
MAX_ITEMS = 10_000  # elements, bonds, ...
MAX_DEPTH = 100
MAX_NODES = 10_000
MAX_BITS = 1023  # of an exact number: the range of floats
MAX_POWER_BITS = 100_000  # that exact numbers could grow to if a power were multiplied out

Check = Callable[[Any, str], Iterator[str]]  # (value, its place) -> faults

_LIST_LENGTH = MAX_NODES
_VALUE, _CONDITION = "value", "condition"
_PLAIN = "value without a piecewise"  # inside conditions: SymPy multiplies choices out there


class Operation(NamedTuple):
    """An operation of expression trees: its name in SymPy, number and type of its arguments, and type of its result."""

    sympy: str
    least: int = 1
    most: int = 1
    takes: str = _VALUE
    gives: str = _VALUE


OPERATIONS: Mapping[str, Operation] = {
    "pi": Operation("pi", 0, 0),
    "e": Operation("E", 0, 0),
    "add": Operation("Add", 2, _LIST_LENGTH),
    "mul": Operation("Mul", 2, _LIST_LENGTH),
    "power": Operation("Pow", 2, 2),
    **{name: Operation(name) for name in ("sin", "cos", "tan", "asin", "acos", "atan", "exp", "log", "sign")},
    **{name: Operation(name) for name in ("sinh", "cosh", "tanh", "asinh", "acosh", "atanh")},
    "atan2": Operation("atan2", 2, 2),
    "abs": Operation("Abs"),
    "heaviside": Operation("Heaviside", 1, 2),
    "max": Operation("Max", 2, _LIST_LENGTH),
    "min": Operation("Min", 2, _LIST_LENGTH),
    "less": Operation("Lt", 2, 2, _PLAIN, _CONDITION),
    "less_equal": Operation("Le", 2, 2, _PLAIN, _CONDITION),
    "greater": Operation("Gt", 2, 2, _PLAIN, _CONDITION),
    "greater_equal": Operation("Ge", 2, 2, _PLAIN, _CONDITION),
    "equal": Operation("Eq", 2, 2, _PLAIN, _CONDITION),
    "not_equal": Operation("Ne", 2, 2, _PLAIN, _CONDITION),
    "and": Operation("And", 2, _LIST_LENGTH, _CONDITION, _CONDITION),
    "or": Operation("Or", 2, _LIST_LENGTH, _CONDITION, _CONDITION),
    "not": Operation("Not", 1, 1, _CONDITION, _CONDITION),
    "true": Operation("true", 0, 0, gives=_CONDITION),
    "false": Operation("false", 0, 0, gives=_CONDITION),
}


def save(graph: BondGraph, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Writes a graph to a JSON file, completely or not at all.

    Args:
        graph: the graph.
        path: the file; its folder must exist.
        overwrite: True allows the replacement of an existing file.

    Raises:
        GraphError: the file is there already, cannot be written, or a law cannot be saved.

    >>> import tempfile
    >>> from bondgraph import Builder, I, Se
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save(Builder().one("shaft").on("shaft", Se("M", 3.0), I("J", 2.0)).build(), f"{folder}/graph.json")
    ...     load(f"{folder}/graph.json")
    BondGraph(3 elements, 2 bonds)

    """
    rows = {
        key: "[\n  " + ",\n  ".join(json.dumps(row, allow_nan=False) for row in value) + "\n ]"
        if value and isinstance(value, list)
        else json.dumps(value, allow_nan=False)
        for key, value in as_data(graph).items()
    }
    path, text = Path(path), "{\n" + ",\n".join(f" {json.dumps(key)}: {row}" for key, row in rows.items()) + "\n}\n"
    if os.path.lexists(path) and not overwrite:
        raise GraphError(f"{path}: exists already; choose another name, or save(..., overwrite=True)")
    try:
        with replacement(path, "text") as fresh:
            fresh.write_text(text, encoding="ascii")
    except OSError as error:
        raise GraphError(f"{path}: cannot be written ({error.strerror})") from error


def load(path: str | os.PathLike[str]) -> BondGraph:
    """Reads a graph from a JSON file, written by `save` or by hand.

    Raises:
        GraphError: the file cannot be read or is no graph; every fault with its place, a line each.

    """
    twice: list[str] = []

    def pairs(items: list[tuple[str, Any]]) -> dict[str, Any]:
        keys = [key for key, _ in items]
        twice.extend(f"found key {brief(key)} twice in one object" for key in _repeated(keys))
        return dict(items)

    try:
        data = json.loads(Path(path).read_text("utf-8"), object_pairs_hook=pairs)
    except OSError as error:
        raise GraphError(f"{path}: cannot be read ({error.strerror})") from error
    except (ValueError, RecursionError) as error:
        raise GraphError(f"{path}: is not the JSON of a graph ({error})") from error
    refuse(f"{path}: {fault}" for fault in [*twice, *_faults(data)])
    return _graph(data)


def as_data(graph: BondGraph) -> dict[str, Any]:
    """A graph as plain data: lists, objects, text and numbers that JSON can hold.

    Raises:
        GraphError: a law cannot be written as a formula; every such element, a line each.

    >>> from bondgraph import Builder, I, Se
    >>> data = as_data(Builder().one("shaft", displacement="a").on("shaft", Se("M", lambda a: 3.0 * a), I("J", 2.0)).build())
    >>> data["elements"][1]
    {'kind': 'Se', 'name': 'M', 'law': {'of': ['a'], 'expression': ['mul', 3, ['name', 'a']]}}
    >>> print(from_data(data))
    bond graph: 3 elements, 2 bonds (f_out = T f_in, e_in = T e_out)
       1  MSe:M -> 1:shaft
       2  1:shaft -> I:J = 2

    """
    graph = as_graph(graph)
    elements: list[dict[str, Any]] = []
    faults: list[str] = []
    for element in graph.elements.values():
        try:
            named = {"kind": element.kind, "name": element.name, "domain": element.domain, "part": element.part}
            law = {} if element.law is None else {"law": _law_data(element.law)}
            elements.append({key: text for key, text in named.items() if text} | law)
        except GraphError as error:
            faults.append(f"{graph.title(element.name)}: {error}")
    data = {
        "format": FORMAT,
        "version": VERSION,
        "elements": elements,
        "bonds": [list(bond) for bond in graph.bonds],
        "displacements": [d._replace(initial=float(d.initial))._asdict() for d in graph.displacements.values()],
        "signals": list(graph.signals),
        "parameters": {name: None if value is None else float(value) for name, value in graph.parameters.items()},
    }
    refuse([*faults, *_faults(data)])  # these are what could not be loaded again
    return data


def from_data(data: Any) -> BondGraph:
    """The graph that plain data describes.

    Raises:
        GraphError: the data are no graph; every fault with its place, a line each.

    """
    refuse(_faults(data))
    return _graph(data)


def _law_data(law: Any) -> Any:
    if isinstance(law, Modulus | Law):
        raise GraphError("is taken from a mechanism's motion; give it as a function of a declared displacement to save it")
    if not isinstance(law, Function):
        return float(law)
    return {"of": list(dict.fromkeys(law.of)), "expression": as_tree(law.symbolic())}


def _graph(data: Mapping[str, Any]) -> BondGraph:
    """The graph of data without faults."""
    elements = []
    for item in data["elements"]:
        law = item.get("law")
        if isinstance(law, dict):
            names = tuple(law["of"])
            law = Function(from_tree(law["expression"]), names, names)
        elif law is not None:
            law = float(law)
        elements.append(Element(item["kind"], item["name"], law, item.get("domain", ""), item.get("part", "")))
    displacements = [Displacement(d["name"], d["of"], float(d["initial"])) for d in data.get("displacements", ())]
    return BondGraph(
        {element.name: element for element in elements},
        tuple(Bond(*bond) for bond in data["bonds"]),
        {displacement.name: displacement for displacement in displacements},
        tuple(data.get("signals", ())),
        {name: None if value is None else float(value) for name, value in data.get("parameters", {}).items()},
    )


def _faults(data: Any) -> Iterator[str]:
    element = _record({"kind": _name, "name": _name}, {"domain": _any_text, "part": _any_text, "law": _law})
    displacement = _record({"name": _name, "of": _name, "initial": number_faults})
    optional = {"displacements": _each(displacement), "signals": _each(_name), "parameters": _parameters}
    required = {"format": _same(FORMAT), "version": _same(VERSION), "elements": _each(element), "bonds": _each(_bond)}
    yield from _record(required, optional)(data, "")
    for table in ("elements", "displacements") if isinstance(data, dict) else ():
        items = data.get(table)
        names = [item.get("name") for item in items if isinstance(item, dict)] if isinstance(items, list) else []
        for name in _repeated([name for name in names if isinstance(name, str)]):
            yield f"{table}: found two named {brief(name)}, expected every name once"


def _repeated(names: Sequence[str]) -> list[str]:
    return [name for name, count in Counter(names).items() if count > 1]


def _record(required: Mapping[str, Check], optional: Mapping[str, Check] | None = None) -> Check:
    names = {**required, **(optional or {})}

    def fields(value: Any, place: str) -> Iterator[str]:
        where = f"{place}: " if place else ""
        if not isinstance(value, dict):
            yield f"{where}found {brief(value)}, expected an object with {', '.join(required)}"
            return
        for key in value:
            if key not in names:
                yield f"{where}found unknown key {brief(key)}, expected {', '.join(names)}"
        for key, check in names.items():
            if key in value:
                yield from check(value[key], f"{place}.{key}" if place else key)
            elif key in required:
                yield f"{where}found no {key!r}, expected one"

    return fields


def _each(check: Check) -> Check:
    def all_of(value: Any, place: str) -> Iterator[str]:
        if not isinstance(value, list) or len(value) > MAX_ITEMS:
            yield f"{place}: found {brief(value)}, expected a list of at most {MAX_ITEMS}"
            return
        for k, item in enumerate(value):
            yield from check(item, f"{place}[{k}]")

    return all_of


def _expects(expected: str, test: Callable[[Any], Any]) -> Check:
    def fitting(value: Any, place: str) -> Iterator[str]:
        if not test(value):
            yield f"{place}: found {brief(value)}, expected {expected}"

    return fitting


def _same(expected: Any) -> Check:
    return _expects(repr(expected), lambda value: type(value) is type(expected) and value == expected)


def _is_number(value: Any) -> bool:
    """True of a number in the range of floats."""
    exact = isinstance(value, int) and not isinstance(value, bool) and value.bit_length() <= MAX_BITS
    return exact or (isinstance(value, float) and math.isfinite(value))


number_faults = _expects("a finite number", _is_number)
_name = _expects("a name", lambda value: isinstance(value, str) and value)
_any_text = _expects("text", lambda value: isinstance(value, str))


def _bond(value: Any, place: str) -> Iterator[str]:
    if not isinstance(value, list) or len(value) != 3:
        yield f"{place}: found {brief(value)}, expected [number, tail, head]"
        return
    if type(value[0]) is not int or not 0 < value[0] < 2**31:
        yield f"{place}[0]: found {brief(value[0])}, expected a whole number from 1"
    yield from _name(value[1], f"{place}[1]")
    yield from _name(value[2], f"{place}[2]")


def _parameters(value: Any, place: str) -> Iterator[str]:
    if not isinstance(value, dict) or len(value) > MAX_ITEMS:
        yield f"{place}: found {brief(value)}, expected an object of at most {MAX_ITEMS} numbers by name"
        return
    for name, number in value.items():
        yield from _name(name, place)
        if number is not None:
            yield from number_faults(number, f"{place}.{brief(name)}")


def _law(value: Any, place: str) -> Iterator[str]:
    if not isinstance(value, dict):
        yield from _expects("a finite number or an expression", _is_number)(value, place)
        return
    faults = list(_record({"of": _each(_name), "expression": tree_faults})(value, place))
    yield from faults
    if not faults:
        for name in sorted(names_in(value["expression"]) - set(value["of"])):
            yield f"{place}.of: found no {brief(name)}, which the expression depends on"
        for name in _repeated(value["of"]):
            yield f"{place}.of: found {brief(name)} twice, expected it once"


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
    is_expression = isinstance(expression, sympy.Basic)
    operation = _by_sympy().get(expression.func if expression.args else expression) if is_expression else None
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
    r"""All faults of a tree, a line each with its place; a tree that is too large is not read to its end.

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
        if isinstance(node, list) and not faults and node[0] not in _LEAVES:
            takes = OPERATIONS[node[0]].takes if node[0] != "piecewise" else ""
            takes = _PLAIN if (sort, takes) == (_PLAIN, _VALUE) else takes
            sorts = cycle((takes,) if takes else (_VALUE, _CONDITION))
            below = zip(range(1, len(node)), node[1:], sorts, strict=False)
            todo.extend(reversed([(child, of, f"{where}[{k}]", depth + 1) for k, child, of in below]))
    if sound and _bits(tree) == math.inf:
        yield f"{place}: found a power of exact numbers with more than {MAX_POWER_BITS} bits, expected a smaller one"


_LIMITS = f"more than {MAX_NODES} operations or {MAX_DEPTH} levels, expected a smaller tree"


def _node_faults(node: Any, sort: str, place: str) -> Iterator[str]:
    """The faults of one node, its arguments left aside."""
    head = node[0] if isinstance(node, list) and node else None
    if not isinstance(node, list):
        if sort == _CONDITION or not _is_number(node):
            expected = "a condition" if sort == _CONDITION else "a finite number or [operation, argument, ...]"
            yield f"{place}: found {brief(node)}, expected {expected}"
    elif not isinstance(head, str) or head not in {*_LEAVES, "piecewise", *OPERATIONS}:
        expected = ", ".join([*_LEAVES, "piecewise", *OPERATIONS])
        yield f"{place}: found {brief(head) if node else 'nothing'}, expected an operation: {expected}"
    elif head in _LEAVES:
        if head == "name":
            holds = len(node) == 2 and isinstance(node[1], str) and node[1] != ""
        else:
            whole = all(isinstance(n, int) and _is_number(n) for n in node[1:])
            holds = whole and len(node) == 3 and node[2] > 0
        if sort == _CONDITION or not holds:
            yield f"{place}: found {brief(node)}, expected {'a condition' if sort == _CONDITION else _LEAVES[head]}"
    elif head == "piecewise":
        if len(node) < 3 or len(node) % 2 == 0:
            yield f"{place}: found piecewise of {len(node) - 1} arguments, expected pairs of value and condition"
        if sort != _VALUE:
            yield f"{place}: found piecewise, expected a {sort}"
    else:
        operation = OPERATIONS[head]
        if not operation.least <= len(node) - 1 <= operation.most:
            count = f"{operation.least}" if operation.least == operation.most else f"{operation.least} to {operation.most}"
            yield f"{place}: found {head} of {len(node) - 1} arguments, expected {count}"
        if (operation.gives == _CONDITION) != (sort == _CONDITION):
            yield f"{place}: found {head}, which is a {operation.gives}, expected a {sort}"


_LEAVES = {"name": "[name, text]", "ratio": "[ratio, whole number, whole number above 0]"}


def _bits(tree: Any) -> float:
    """An upper bound of the bits of a tree's exact numbers; infinite where a power is beyond the limit."""
    if not isinstance(tree, list):
        return float(tree.bit_length()) if isinstance(tree, int) else 1.0
    if tree[0] == "name":
        return 1
    if tree[0] != "power":
        return sum(map(_bits, tree[1:]))
    exponent, size = tree[2], 1.0  # at most how large the exact number in the exponent could be
    if isinstance(exponent, int):
        size = float(min(abs(exponent), MAX_POWER_BITS + 1))
    elif isinstance(exponent, list):
        ratio = exponent[0] == "ratio"
        size = (
            float(min(abs(exponent[1]) // exponent[2] + 1, MAX_POWER_BITS + 1)) if ratio else 2 ** min(_bits(exponent), 64.0)
        )
    bits = _bits(tree[1]) * max(1.0, size)
    return bits if bits <= MAX_POWER_BITS else math.inf


def brief(value: Any) -> str:
    """A wrong value, short enough for an error's line."""
    if isinstance(value, dict | list):
        return f"{'an object' if isinstance(value, dict) else 'a list'} of {len(value)}"
    if isinstance(value, int) and value.bit_length() > MAX_BITS:
        return "a huge number"
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
