"""Bodies of a linkage with their points, and the points that joints, sides and ports name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flywheel.advice import mean, quote, show
from flywheel.linkage.description import FRAME, Link, Point
from flywheel.reading.fields import Faults, as_table, child, is_name, items, read_fields, read_quantity
from flywheel.reading.schema import Key
from flywheel.reading.schema_linkage import FRAME_BODY, LINK, MOST_BODIES, MOST_POINTS

ORIGIN = "origin"
"""The point of every body where its own frame begins."""

_COORDINATE = Key("coordinate", "length", "of a point")
_SAMPLE = 'a point such as "crank.B"'

Bodies = Mapping[str, Link]
"""Bodies by name, the frame among them; empty while their own reading failed."""


def read_bodies(raw: object, path: str, faults: Faults) -> Bodies:
    """Every body, the frame first; one with faults is there as well, so that it can be named."""
    tables = as_table(raw, path, faults)
    if tables is None:
        return {}
    if len(tables) > MOST_BODIES:
        faults.add(path, f"{len(tables)} bodies", f"at most {MOST_BODIES}")
        return {}
    bodies = {name: _body(name, table, child(path, name), faults) for name, table in tables.items()}
    others = [name for name in ("ground", "base", "fixed") if name in bodies and FRAME not in bodies]
    for name in others:
        faults.add(child(path, FRAME), "nothing", "the fixed body's points", f"the fixed body is called frame, not {name}")
    if not bodies.keys() - {FRAME}:
        faults.add(path, "no moving body", f"one at least beside {FRAME}")
    return {FRAME: Link(FRAME, (Point(ORIGIN),))} | bodies


def _body(name: str, raw: object, path: str, faults: Faults) -> Link:
    """One body: what it weighs, and its points."""
    if not is_name(name):
        faults.add(path, quote(name), "a letter, then letters, digits, _ or -")
    table = as_table(raw, path, faults)
    if table is None:
        return Link(name, (Point(ORIGIN),))
    fields = read_fields(table, (FRAME_BODY if name == FRAME else LINK).keys, path, faults)
    points = _points(table.get("points", {}), f"{path}.points", faults)
    if name == FRAME:
        return Link(name, points)
    com = read_pair(table["com"], f"{path}.com", faults) if "com" in table else (0.0, 0.0)
    return Link(name, points, fields["mass"] or 0.0, fields["inertia"] or 0.0, com or (0.0, 0.0), fields["guess"])


def _points(raw: object, path: str, faults: Faults) -> tuple[Point, ...]:
    """The points of a body, its origin first; one whose place is at fault can still be named."""
    table = as_table(raw, path, faults)
    if table is not None and len(table) > MOST_POINTS:
        faults.add(path, f"{len(table)} points", f"at most {MOST_POINTS}")
        table = None
    places = {name: _point(name, place, child(path, name), faults) for name, place in (table or {}).items()}
    return tuple(Point(name, *place) for name, place in ({ORIGIN: (0.0, 0.0)} | places).items())


def _point(name: str, raw: object, path: str, faults: Faults) -> tuple[float, float]:
    """The place of one point."""
    if not is_name(name):
        faults.add(path, quote(name), "a letter, then letters, digits, _ or -")
    place = read_pair(raw, path, faults)
    if name == ORIGIN and place not in (None, (0.0, 0.0)):
        faults.add(path, "a point called origin elsewhere", "another name", "origin is where the body's own frame begins")
    return place or (0.0, 0.0)


def read_pair(raw: object, path: str, faults: Faults) -> tuple[float, float] | None:
    """[x, y] in m; None after noting a fault."""
    found = items(raw)
    if found is None or len(found) != 2:
        faults.add(path, show(raw) if found is None else f"a list of {len(found)}", "a list [x, y] of two lengths")
        return None
    x, y = (read_quantity(value, "length", _COORDINATE, f"{path}[{i}]", faults) for i, value in enumerate(found))
    return None if x is None or y is None else (x, y)


def find_point(text: object, path: str, bodies: Bodies, faults: Faults) -> tuple[str, Point] | None:
    """The body and the point that `body.point` names; None after noting a fault, or where no body is known."""
    if not bodies:
        return None
    if not isinstance(text, str):
        faults.add(path, show(text), _SAMPLE)
        return None
    body, dot, name = text.partition(".")
    if body not in bodies:
        faults.unknown(path, body, bodies, "body")
    elif not dot:
        faults.add(path, f"{quote(text)}, a body", _SAMPLE, f"write {quote(f'{body}.{ORIGIN}')}, or another of its points")
    elif not any(point.name == name for point in bodies[body].points):
        names = [f"{body}.{point.name}" for point in bodies[body].points]
        faults.add(path, f"point {quote(text)}", f"a point of {body}", mean(text, names))
    else:
        return body, bodies[body].point(name)
    return None


def listed(raw: object, path: str, most: int, faults: Faults) -> list[tuple[str, Mapping[str, Any]]]:
    """The tables of an array of tables, each with its path."""
    found = items(raw)
    if found is None:
        faults.add(path, show(raw), "an array of tables", f"write [[mechanism.{path.rpartition('.')[2]}]] for each")
        return []
    if len(found) > most:
        faults.add(path, f"{len(found)} tables", f"at most {most}")
        return []
    tables = [(f"{path}[{i}]", as_table(item, f"{path}[{i}]", faults)) for i, item in enumerate(found)]
    return [(where, table) for where, table in tables if table is not None]
