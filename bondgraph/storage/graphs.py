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
the names in the graph that it is a function of, and a tree of lists (`bondgraph.storage.expressions`). Laws given as Python
functions are saved as the formulas that they write down; those that write none down cannot be saved, nor can laws that
a mechanism's motion gives the positions for.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from bondgraph.elements import Displacement, Element, Law, Modulus
from bondgraph.graph import Bond, BondGraph, as_graph
from bondgraph.laws import Function, GraphError, refuse
from bondgraph.storage.expressions import Check, as_tree, from_tree, names_in, number_faults, shown, tree_faults
from bondgraph.storage.files import replacement

FORMAT = "bondgraph"
VERSION = 1
MAX_ITEMS = 10_000  # elements, bonds, ...


def save(graph: BondGraph, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write a graph to a JSON file: all of it or nothing.

    Args:
        graph: what to save.
        path: the file; its folder must exist.
        overwrite: whether a file that is already there may be replaced.

    Raises:
        GraphError: the file is there already, cannot be written, or a law cannot be saved.

    """
    rows = {
        key: "[\n  " + ",\n  ".join(json.dumps(row, allow_nan=False) for row in value) + "\n ]"
        if value and isinstance(value, list)
        else json.dumps(value, allow_nan=False)
        for key, value in as_data(graph).items()
    }
    path, text = Path(path), "{\n" + ",\n".join(f" {json.dumps(key)}: {row}" for key, row in rows.items()) + "\n}\n"
    if os.path.lexists(path) and not overwrite:
        raise GraphError(f"{path}: is there already; choose another name, or save(..., overwrite=True)")
    try:
        with replacement(path, "text") as fresh:
            fresh.write_text(text, encoding="ascii")
    except OSError as error:
        raise GraphError(f"{path}: cannot be written ({error.strerror})") from error


def load(path: str | os.PathLike[str]) -> BondGraph:
    """Read a graph from a JSON file that `save` wrote, or somebody's hand.

    Raises:
        GraphError: the file cannot be read or is no graph; every fault with its place, a line each.

    """
    twice: list[str] = []

    def pairs(items: list[tuple[str, Any]]) -> dict[str, Any]:
        keys = [key for key, _ in items]
        twice.extend(f"found key {shown(key)} twice in one object" for key in _repeated(keys))
        return dict(items)

    try:
        data = json.loads(Path(path).read_text("utf-8"), object_pairs_hook=pairs)
    except OSError as error:
        raise GraphError(f"{path}: cannot be read ({error.strerror})") from error
    except (ValueError, RecursionError) as error:
        raise GraphError(f"{path}: is no JSON that a graph could be read from ({error})") from error
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
            elements.append(_element_data(element))
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


# -- writing ------------------------------------------------------------------------------------------------------------


def _element_data(element: Element) -> dict[str, Any]:
    data = {"kind": element.kind, "name": element.name, "domain": element.domain, "part": element.part}
    law = {} if element.law is None else {"law": _law_data(element.law)}
    return {key: text for key, text in data.items() if text} | law


def _law_data(law: Any) -> Any:
    if isinstance(law, Modulus | Law):
        raise GraphError("is taken from a mechanism's motion; give it as a function of a declared displacement to save it")
    if not isinstance(law, Function):
        return float(law)
    return {"of": list(dict.fromkeys(law.of)), "expression": as_tree(law.symbolic())}


# -- building, from data without faults ---------------------------------------------------------------------------------


def _graph(data: Mapping[str, Any]) -> BondGraph:
    elements = [_element(item) for item in data["elements"]]
    displacements = [Displacement(d["name"], d["of"], float(d["initial"])) for d in data.get("displacements", ())]
    return BondGraph(
        {element.name: element for element in elements},
        tuple(Bond(*bond) for bond in data["bonds"]),
        {displacement.name: displacement for displacement in displacements},
        tuple(data.get("signals", ())),
        {name: None if value is None else float(value) for name, value in data.get("parameters", {}).items()},
    )


def _element(data: Mapping[str, Any]) -> Element:
    law = data.get("law")
    if isinstance(law, dict):
        names = tuple(law["of"])
        law = Function(from_tree(law["expression"]), names, names)
    elif law is not None:
        law = float(law)
    return Element(data["kind"], data["name"], law, data.get("domain", ""), data.get("part", ""))


# -- checking -----------------------------------------------------------------------------------------------------------


def _faults(data: Any) -> Iterator[str]:
    optional = {"displacements": _each(_displacement), "signals": _each(_name), "parameters": _parameters}
    required = {"format": _is(FORMAT), "version": _is(VERSION), "elements": _each(_element_faults), "bonds": _each(_bond)}
    yield from _record(data, "", required, optional)
    for table in ("elements", "displacements") if isinstance(data, dict) else ():
        items = data.get(table)
        names = [item.get("name") for item in items if isinstance(item, dict)] if isinstance(items, list) else []
        for name in _repeated([name for name in names if isinstance(name, str)]):
            yield f"{table}: found two named {shown(name)}, expected every name once"


def _repeated(names: Sequence[str]) -> list[str]:
    return [name for name, count in Counter(names).items() if count > 1]


def _record(value: Any, place: str, required: Mapping[str, Check], optional: Mapping[str, Check]) -> Iterator[str]:
    known = {**required, **optional}
    where = f"{place}: " if place else ""
    if not isinstance(value, dict):
        yield f"{where}found {shown(value)}, expected an object with {', '.join(required)}"
        return
    for key in value:
        if key not in known:
            yield f"{where}found unknown key {shown(key)}, expected {', '.join(known)}"
    for key, check in known.items():
        if key in value:
            yield from check(value[key], f"{place}.{key}" if place else key)
        elif key in required:
            yield f"{where}found no {key!r}, expected one"


def _each(check: Check) -> Check:
    def all_of(value: Any, place: str) -> Iterator[str]:
        if not isinstance(value, list) or len(value) > MAX_ITEMS:
            yield f"{place}: found {shown(value)}, expected a list of at most {MAX_ITEMS}"
            return
        for k, item in enumerate(value):
            yield from check(item, f"{place}[{k}]")

    return all_of


def _is(expected: Any) -> Check:
    def same(value: Any, place: str) -> Iterator[str]:
        if type(value) is not type(expected) or value != expected:
            yield f"{place}: found {shown(value)}, expected {expected!r}"

    return same


def _name(value: Any, place: str) -> Iterator[str]:
    if not isinstance(value, str) or not value:
        yield f"{place}: found {shown(value)}, expected a name"


def _any_text(value: Any, place: str) -> Iterator[str]:
    if not isinstance(value, str):
        yield f"{place}: found {shown(value)}, expected text"


def _bond(value: Any, place: str) -> Iterator[str]:
    if not isinstance(value, list) or len(value) != 3:
        yield f"{place}: found {shown(value)}, expected [number, tail, head]"
        return
    if type(value[0]) is not int or not 0 < value[0] < 2**31:
        yield f"{place}[0]: found {shown(value[0])}, expected a whole number from 1"
    yield from _name(value[1], f"{place}[1]")
    yield from _name(value[2], f"{place}[2]")


def _displacement(value: Any, place: str) -> Iterator[str]:
    yield from _record(value, place, {"name": _name, "of": _name, "initial": number_faults}, {})


def _parameters(value: Any, place: str) -> Iterator[str]:
    if not isinstance(value, dict) or len(value) > MAX_ITEMS:
        yield f"{place}: found {shown(value)}, expected an object of at most {MAX_ITEMS} numbers by name"
        return
    for name, number in value.items():
        yield from _name(name, place)
        if number is not None:
            yield from number_faults(number, f"{place}.{shown(name)}")


def _element_faults(value: Any, place: str) -> Iterator[str]:
    yield from _record(value, place, {"kind": _name, "name": _name}, {"domain": _any_text, "part": _any_text, "law": _law})


def _law(value: Any, place: str) -> Iterator[str]:
    if not isinstance(value, dict):
        if list(number_faults(value, place)):
            yield f"{place}: found {shown(value)}, expected a finite number or an expression"
        return
    faults = list(_record(value, place, {"of": _each(_name), "expression": tree_faults}, {}))
    yield from faults
    if not faults:
        for name in sorted(names_in(value["expression"]) - set(value["of"])):
            yield f"{place}.of: found no {shown(name)}, which the expression depends on"
        for name in _repeated(value["of"]):
            yield f"{place}.of: found {shown(name)} twice, expected it once"
