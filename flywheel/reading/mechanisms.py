"""Mechanisms of a scene: their tables, turns in a cycle or stroke, the laws of `law`, and their ports.

Linkages: bodies with their points, joints, couplings, driver, assembly and ports.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from flywheel.mechanisms import KINDS
from flywheel.mechanisms.families import Kind, build, stroke_ranges
from flywheel.numerics.faults import Fault, SceneError, coordinate_text, quote, show, suggestion
from flywheel.numerics.units import QuantityError, parse_range, plain_number
from flywheel.reading.fields import (
    Faults,
    Fields,
    Item,
    Place,
    Places,
    Setting,
    as_table,
    check_name,
    child,
    default_period,
    items,
    read_fields,
    read_item,
    read_quantity,
    whole,
)
from flywheel.reading.schema import (
    COUPLING,
    COUPLING_KEYS,
    COUPLING_ONE_OF,
    FRAME_BODY,
    JOINT,
    JOINT_KEYS,
    LINK,
    MECHANISM,
    MOST_BODIES,
    MOST_JOINTS,
    MOST_MECHANISMS,
    MOST_POINTS,
    MOST_TURNS,
    OUTPUT,
    POINT_PORT,
    SECTIONS,
    SIDE,
    STROKE_EXCLUDE,
    TURN,
    keys_for,
)
from flywheel.reading.tables import fitted, read_law, repeats
from flywheel.scene.linkage import (
    CAM,
    FIXED,
    FRAME,
    GEAR,
    PIN,
    ROLLING,
    SLIDE,
    SLOT,
    Coupling,
    Driver,
    Joint,
    Lift,
    Link,
    Linkage,
    Point,
    Side,
    common_body,
    offered,
    shadowing,
    straight,
)
from flywheel.scene.scene import Body, Key, Mechanism, Output, PointPort, Stroke, Table

ORIGIN = "origin"
"""The point of every body where its own frame begins."""

_COORDINATE = Key("coordinate", "length", "of a point")
_SAMPLE = 'a point such as "crank.B"'

Bodies = Mapping[str, Link]
"""Bodies by name, the frame among them; empty while their own reading failed."""


def read_bodies(raw: object, path: str, faults: Faults) -> Bodies:
    """Every body, the frame first; one with faults is included, so that it can be named."""
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
        faults.add(path, "no moving body", f"at least one in addition to {FRAME}")
    return {FRAME: Link(FRAME, (Point(ORIGIN),))} | bodies


def _body(name: str, raw: object, path: str, faults: Faults) -> Link:
    """One body: its mass and inertia, and its points, the origin first; a point with a faulty place keeps its name."""
    check_name(name, path, faults)
    table = as_table(raw, path, faults)
    if table is None:
        return Link(name, (Point(ORIGIN),))
    fields = read_fields(table, (FRAME_BODY if name == FRAME else LINK).keys, path, faults)
    own_points, places = as_table(table.get("points", {}), f"{path}.points", faults), {ORIGIN: (0.0, 0.0)}
    if own_points is not None and len(own_points) > MOST_POINTS:
        faults.add(f"{path}.points", f"{len(own_points)} points", f"at most {MOST_POINTS}")
        own_points = None
    for point, pair in (own_points or {}).items():
        where = child(f"{path}.points", point)
        check_name(point, where, faults)
        place = read_pair(pair, where, faults)
        if point == ORIGIN and place not in (None, (0.0, 0.0)):
            advice = "origin is where the body's own frame begins"
            faults.add(where, "a point called origin elsewhere", "another name", advice)
        places[point] = place or (0.0, 0.0)
    points = tuple(Point(point, *place) for point, place in places.items())
    if name == FRAME:
        return Link(name, points)
    com = read_pair(table["com"], f"{path}.com", faults) if "com" in table else (0.0, 0.0)
    return Link(name, points, fields["mass"] or 0.0, fields["inertia"] or 0.0, com or (0.0, 0.0), fields["guess"])


def read_pair(raw: object, path: str, faults: Faults) -> tuple[float, float] | None:
    """[x, y] in m; None after noting a fault."""
    pair = items(raw)
    if pair is None or len(pair) != 2:
        faults.add(path, show(raw) if pair is None else f"a list of {len(pair)}", "a list [x, y] of two lengths")
        return None
    x, y = (read_quantity(value, "length", _COORDINATE, f"{path}[{i}]", faults) for i, value in enumerate(pair))
    return None if x is None or y is None else (x, y)


def find_point(text: object, path: str, bodies: Bodies, faults: Faults) -> tuple[str, Point] | None:
    """The body and the point that `body.point` names; None after noting a fault, or if no body is known."""
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
        faults.add(path, f"point {quote(text)}", f"a point of {body}", suggestion(text, names))
    else:
        return body, bodies[body].point(name)
    return None


def listed(raw: object, path: str, most: int, faults: Faults) -> list[tuple[str, Mapping[str, Any]]]:
    """The tables of an array of tables, each with its path."""
    listed_items = items(raw)
    if listed_items is None:
        faults.add(path, show(raw), "an array of tables", f"write [[mechanism.{path.rpartition('.')[2]}]] for each")
        return []
    if len(listed_items) > most:
        faults.add(path, f"{len(listed_items)} tables", f"at most {most}")
        return []
    tables = [(f"{path}[{i}]", as_table(item, f"{path}[{i}]", faults)) for i, item in enumerate(listed_items)]
    return [(where, table) for where, table in tables if table is not None]


# Joints

_NOWHERE = ("", Point(ORIGIN))


class Joints(NamedTuple):
    """Joints by name, also those with faults: an unknown body or kind is "".

    `paths` has the place of each; `complete` is False if a joint has no name.
    """

    named: Mapping[str, Joint]
    paths: Mapping[str, str]
    complete: bool

    def find(self, name: object, path: str, faults: Faults) -> Joint | None:
        """The joint that a text names; None after noting a fault."""
        if not isinstance(name, str):
            faults.add(path, show(name), 'the name of a joint, such as "O"')
        elif name in self.named:
            return self.named[name]
        elif self.complete:
            faults.unknown(path, name, self.named, "joint")
        return None


def read_joints(raw: object, path: str, bodies: Bodies, faults: Faults) -> Joints:
    """Every joint; two of one name are a fault."""
    named: dict[str, Joint] = {}
    paths: dict[str, str] = {}
    tables = items(raw)
    if tables == []:
        faults.add(path, "no joint", "one at least")
    joints = [(where, _joint(table, where, bodies, faults)) for where, table in listed(raw, path, MOST_JOINTS, faults)]
    for where, joint in joints:
        if joint is not None and joint.name in named:
            faults.add(f"{where}.name", quote(joint.name), "a unique name", f"{paths[joint.name]} has this name already")
        elif joint is not None:
            named[joint.name], paths[joint.name] = joint, where
    read = sum(joint is not None for _, joint in joints)
    return Joints(named, paths, 0 < read == len(tables or ()))


def _joint(raw: Mapping[str, Any], path: str, bodies: Bodies, faults: Faults) -> Joint | None:
    """One joint; None if it has no name."""
    kind = raw.get("type")
    kind = kind if isinstance(kind, str) and kind in JOINT_KEYS else ""
    raw = without_misplaced(raw, kind, JOINT_KEYS, path, faults)
    fields = read_fields(raw, keys_for(JOINT, JOINT_KEYS.get(kind)), path, faults)
    name = fields["name"]
    between, expected = f"{path}.between", 'a list of two points, such as ["frame.O", "crank.O"]'
    pair = read_two(raw["between"], between, expected, faults) if "between" in raw else ()
    ends = [find_point(text, f"{between}[{i}]", bodies, faults) or _NOWHERE for i, text in enumerate(pair)]
    first, second = ends or (_NOWHERE, _NOWHERE)
    if first[0] and first[0] == second[0]:
        faults.add(between, f"{quote(first[0])} twice", "two different bodies")
    if kind == PIN and fields["friction"] and fields["radius"] == 0.0:
        faults.add(f"{path}.radius", "nothing", "a radius above 0", "friction turns a pin by its radius")
    if name is None:
        return None
    values = {key: fields[key] for key in JOINT_KEYS.get(kind, ()) if fields[key] is not None}
    return Joint(name, kind, first[0], second[0], first[1], second[1], **values)


def without_misplaced(
    raw: Mapping[str, Any], kind: str, by_kind: Mapping[str, tuple[str, ...]], path: str, faults: Faults
) -> Mapping[str, Any]:
    """The table without keys that belong to joints (or couplings) of other types, after noting each of them."""
    kept = {}
    for name, value in raw.items():
        owners = ", ".join(other for other, keys in by_kind.items() if name in keys)
        if kind in by_kind and owners and name not in by_kind[kind]:
            keys = ", ".join(("name", "type", "between", *by_kind[kind]))
            faults.add(child(path, name), f"{name}, which belongs to {owners}", f"keys of a {kind}: {keys}")
        else:
            kept[name] = value
    return kept


def read_two(raw: object, path: str, expected: str, faults: Faults) -> Sequence[object]:
    """The two items of a list; none after noting a fault."""
    pair = items(raw)
    if pair is not None and len(pair) == 2:
        return pair
    faults.add(path, show(raw) if pair is None else f"a list of {len(pair)}", expected)
    return ()


# Couplings

_MOST_TEETH = 10**6
_STEEPEST = math.radians(89.0)  # pressure angle: beyond it hardly any of a tooth's force would drive
_Pair = tuple[Joint, Joint, str]
"""Two joints, and the body that carries both."""

_TAKES = {GEAR: ((PIN,), (PIN,)), ROLLING: ((PIN,), (SLIDE,)), CAM: ((PIN,), (SLIDE, PIN))}
"""Kinds of the first and of the second joint that a coupling takes."""
_NOT_TAKEN = {FIXED: "a fixed joint has no coordinate", SLOT: "a pin in a slot has two motions, not one"}


def read_couplings(raw: object, path: str, bodies: Bodies, joints: Joints, setting: Setting) -> tuple[Coupling, ...]:
    """Every coupling without faults; each has a unique name, different from those of joints."""
    taken = dict.fromkeys(joints.named, "a joint")
    good = []
    for where, table in listed(raw, path, MOST_JOINTS, setting.faults):
        coupling = _coupling(table, where, bodies, joints, setting)
        if coupling is None:
            continue
        if coupling.name in taken:
            advice = f"{taken[coupling.name]} has this name already"
            setting.faults.add(f"{where}.name", quote(coupling.name), "a unique name", advice)
        taken[coupling.name] = "another coupling"
        good.append(coupling)
    return tuple(good)


def _coupling(raw: Mapping[str, Any], path: str, bodies: Bodies, joints: Joints, setting: Setting) -> Coupling | None:
    """One coupling; None after noting faults."""
    faults = setting.faults
    before = len(faults)
    kind = raw.get("type")
    kind = kind if isinstance(kind, str) and kind in COUPLING_KEYS else ""
    raw = without_misplaced(raw, kind, COUPLING_KEYS, path, faults)
    section = COUPLING._replace(keys=keys_for(COUPLING, COUPLING_KEYS.get(kind)), one_of=COUPLING_ONE_OF.get(kind, ()))
    item = read_item(raw, section, path, faults, rotating=kind == GEAR if kind else None)
    pair = _pair(raw["between"], kind, f"{path}.between", joints, faults) if "between" in raw else None
    if pair is None:
        return None
    first, second, _ = pair
    values = _cam(item, pair, bodies, setting) if kind == CAM else _geared(item, pair)
    if len(faults) > before:
        return None
    return Coupling(item.fields["name"] or f"{first.name}-{second.name}", kind, first.name, second.name, **values)


def _pair(raw: object, kind: str, path: str, joints: Joints, faults: Faults) -> _Pair | None:
    """The two joints that a coupling joins, of kinds that fit, and the body that carries both."""
    names = read_two(raw, path, 'a list of two joints, such as ["O", "P"]', faults)
    joints_of_pair = [
        joint for i, name in enumerate(names) if (joint := joints.find(name, f"{path}[{i}]", faults)) is not None
    ]
    if len(joints_of_pair) != 2 or not kind or not all(joint.kind for joint in joints_of_pair):
        return None
    first, second = joints_of_pair
    if first.name == second.name:
        faults.add(path, f"{quote(first.name)} twice", "two different joints")
        return None
    wrong = [i for i, joint in enumerate(joints_of_pair) if joint.kind not in _TAKES[kind][i]]
    for i in wrong:
        taken, other = " or a ".join(_TAKES[kind][i]), joints_of_pair[i]
        faults.add(
            f"{path}[{i}]", f"{quote(other.name)}, a {other.kind} joint", f"a {taken}", _NOT_TAKEN.get(other.kind, "")
        )
    if wrong or "" in (*first[2:4], *second[2:4]):
        return None
    common = common_body(first, second)
    if not common:
        bodies = (f"{quote(joint.name)} of {joint.first} and {joint.second}" for joint in joints_of_pair)
        faults.add(path, " with ".join(bodies), "two joints of one body, which carries both")
        return None
    return first, second, common


def _geared(item: Item, pair: _Pair) -> dict[str, Any]:
    """Ratio (a signed radius for a wheel that rolls), phase and pressure angle of a gear pair, or of a wheel on a slide."""
    rolls = pair[1].kind == SLIDE
    if rolls and "ratio" not in item.raw:
        item.add("ratio", "nothing", 'a length such as "100 mm": the slide per rad of the pin')
    if "internal" in item.raw and "teeth" not in item.raw:
        advice = "the sign of the ratio says which (see flywheel reference linkage)"
        item.add("internal", "internal together with a ratio", "none", advice)
    ratio = None if "teeth" in item.raw else item.fields["ratio"]
    if "teeth" in item.raw:  # -z1/z2, or z1/z2 where one wheel has its teeth inside
        internal, where = bool(item.fields["internal"]), f"{item.path}.teeth"
        counts = read_two(item.raw["teeth"], where, "a list of two numbers of teeth, such as [20, 40]", item.faults)
        plain = [plain_number(raw) for raw in counts]
        teeth = [n if n and n.is_integer() and 1 <= n <= _MOST_TEETH else None for n in plain]
        for i, raw in enumerate(counts):
            if teeth[i] is None:
                item.faults.add(f"{where}[{i}]", show(raw), f"a whole number from 1 to {_MOST_TEETH}")
        one, two = teeth or (None, None)
        if one is not None and two is not None:
            if internal and one == two:
                item.add("teeth", "as many on both wheels of an internal pair", "more on the outer one")
            # A pin counts the angle of its second body against its first. Where one pin has the carrier as its first body
            # and the other as its second, their angles count opposite ways, and the ratio changes its sign.
            first, second, carrier = pair
            alike = (first.first == carrier) == (second.first == carrier)
            ratio = (1 if internal == alike else -1) * one / two
    if ratio == 0.0:
        item.add("ratio", show(item.raw["ratio"]), "a ratio other than 0")
    angle = item.fields["pressure_angle"] or 0.0
    if not 0.0 <= angle <= _STEEPEST:
        item.add("pressure_angle", show(item.raw["pressure_angle"]), "an angle from 0 to 89 deg")
    return {"ratio": ratio, "phase": item.fields["phase"], "pressure_angle": angle}


def _cam(item: Item, pair: _Pair, bodies: Bodies, setting: Setting) -> dict[str, Any]:
    """Lift law, point of contact and friction of a cam."""
    _, second, carrier = pair
    text, contact = item.fields["contact"], None
    point = None if text is None else find_point(text, f"{item.path}.contact", bodies, item.faults)
    if point is not None:
        follower = second.second if second.first == carrier else second.first
        if point[0] != follower:
            item.add("contact", quote(text), f"a point of the follower, {follower}")
        contact = point[0], point[1].name
    lift, key, before = None, item.one("lift", "table"), len(item.faults)
    path, rotating = f"{item.path}.{key}", second.kind == PIN
    law = read_law(item.raw[key], "theta" if rotating else "x", path, setting) if key else None
    if law is not None and all(abs(value) < math.inf for value in setting.parameters.values()):
        output = fitted(Output(key, rotating, law, 1.0), TURN, item.path, item.faults)
        if len(item.faults) == before:  # it repeats with every turn, and is smooth and back where it was
            from flywheel.mechanisms.law import followed  # only scenes with a cam need it

            try:
                lift = Lift(followed(output, TURN, setting.parameters, item.path), TURN)
            except SceneError as error:
                item.faults.extend(fault._replace(path=path) for fault in error.faults)
    return {"lift": lift, "contact": contact, "friction": item.fields["friction"]}


Drawn = tuple[dict[str, bool], Linkage, tuple[PointPort, ...], bool]
"""A linkage as far as it could be read: whether each port rotates, which is known even if it has faults; the linkage, its
points, and False if a joint could not be read, so that there may be more ports than these."""


def read_linkage(raw: Mapping[str, Any], fields: Fields, path: str, setting: Setting, *, several: bool = False) -> Drawn:
    """The linkage in a mechanism's table, whose keys are in `fields`; faults are noted in the setting.

    several: true if any pins and slides may drive, as many as there are degrees of freedom.
    """
    faults = setting.faults
    bodies = read_bodies(raw["bodies"], f"{path}.bodies", faults) if "bodies" in raw else {}
    joints = read_joints(raw["joints"], f"{path}.joints", bodies, faults) if "joints" in raw else Joints({}, {}, False)
    driver, further = None, tuple[Driver, ...]()
    if several:
        first, *others = _drivers(raw, path, joints, faults) or (Driver(""),)
        name, start, further = first.joint, first.start, tuple(others)
    else:
        driver = _driver(fields["driver"], f"{path}.driver", joints, setting)
        name = fields["driver"] if isinstance(fields["driver"], str) else ""
        start = 0.0 if driver is None else _start(raw.get("start", 0.0), driver, f"{path}.start", faults)
    linkage = Linkage(
        ground=bodies.get(FRAME, Link(FRAME)),
        links=tuple(body for name, body in bodies.items() if name != FRAME),
        joints=tuple(joints.named.values()),
        driver=name,
        couplings=read_couplings(raw.get("couplings", ()), f"{path}.couplings", bodies, joints, setting),
        sides=tuple(_sides(raw.get("assembly", ()), f"{path}.assembly", bodies, faults)),
        start=start,
        path=path,
        further=further,
    )
    points = _port_points(raw.get("ports", {}), f"{path}.ports", bodies, faults)
    named = {body for joint in joints.named.values() for body in (joint.first, joint.second)}
    for body in bodies if joints.complete and "" not in named else ():  # said only where every joint names its bodies
        if body not in named:
            faults.add(
                child(f"{path}.bodies", body), "a body without joints", "at least one joint that names one of its points"
            )
    _check_names(linkage, points, driver, joints, faults)
    good = tuple(port for port in points.values() if port is not None)
    kinds = [joint.get("type") if isinstance(joint, Mapping) else None for joint in items(raw.get("joints")) or [None]]
    slides = sum(isinstance(kind, str) and kind in (SLIDE, SLOT) for kind in kinds)  # each of which is a port
    plain = all(isinstance(kind, str) and kind in JOINT_KEYS for kind in kinds)
    complete = plain and slides == sum(joint.kind in (SLIDE, SLOT) for joint in joints.named.values())
    return offered(linkage, points), linkage, good, bool(bodies) and complete


def _start(raw: object, driver: Joint, path: str, faults: Faults) -> float:
    """Driver's coordinate at which guesses and sides hold, m or rad; 0 after noting a fault."""
    key = Key("start", "length" if driver.kind == SLIDE else "angle", "of the driver")
    return read_quantity(raw, key.kind, key, path, faults) or 0.0


def _drivers(raw: Mapping[str, Any], path: str, joints: Joints, faults: Faults) -> tuple[Driver, ...]:
    """The pins and slides that drive, by a name or a list of names, and their starts; none after noting faults."""
    before, names, starts = len(faults), raw.get("driver"), raw.get("start", 0.0)
    names = [names] if isinstance(names, str) else items(names)
    if not names:
        if "driver" in raw:
            faults.add(f"{path}.driver", show(raw["driver"]), 'names of pins or slides, such as ["O", "D"]')
        return ()
    tables = items(starts) if items(starts) is not None else [starts] * (len(names) if starts == 0.0 else 1)
    if tables is None or len(tables) != len(names):
        faults.add(f"{path}.start", show(starts), f"a list of {len(names)}, one for each driver")
        return ()
    drivers: list[Driver] = []
    for k, (name, start) in enumerate(zip(names, tables, strict=True)):
        at = f"[{k}]" if len(names) > 1 else ""
        joint = joints.find(name, f"{path}.driver{at}", faults)
        if joint is None or not joint.kind:
            continue
        if joint.kind not in (PIN, SLIDE):
            faults.add(f"{path}.driver{at}", f"{quote(joint.name)}, a {joint.kind} joint", "a pin or a slide")
        elif joint.name in [driver.joint for driver in drivers]:
            faults.add(f"{path}.driver{at}", f"{quote(joint.name)} twice", "another joint")
        else:
            drivers.append(Driver(joint.name, _start(start, joint, f"{path}.start{at}", faults)))
    return tuple(drivers) if len(faults) == before else ()


def _driver(name: object, path: str, joints: Joints, setting: Setting) -> Joint | None:
    """The joint that drives: a pin with the frame as its first body, or a slide, if there is a stroke."""
    faults = setting.faults
    joint = None if name is None else joints.find(name, path, faults)
    if joint is None or not joint.kind:
        return None
    defect = f"{quote(joint.name)}, a {joint.kind} joint"
    if joint.kind not in (PIN, SLIDE):
        faults.add(path, defect, "a pin or a slide")
    elif joint.kind == PIN and joint.second == FRAME:
        advice = "write the point of the frame first: the angle is that of the second body against the first"
        faults.add(
            path, f"{quote(joint.name)}, whose second body is the frame", "a pin with the frame as its first body", advice
        )
    elif joint.kind == PIN and joint.first not in ("", FRAME):
        faults.add(path, f"{quote(joint.name)}, a pin of {joint.first} and {joint.second}", "a pin of the frame, or a slide")
    elif joint.kind == SLIDE and joint.guess is not None:
        faults.add(path, f"{quote(joint.name)}, which has a guess", "a driver without one", "it stands at start")
    elif joint.kind == SLIDE and setting.stroke is None:
        advice = "a driver that slides needs [stroke], and a scene of its own"
        faults.add(path, f"{defect}, without [stroke]", "a pin of the frame", advice)
    else:
        return joint
    return None


def _sides(raw: object, path: str, bodies: Bodies, faults: Faults) -> Iterator[Side]:
    """Every choice of assembly that is free of faults."""
    for where, table in listed(raw, path, MOST_BODIES, faults):
        fields = read_fields(table, SIDE.keys, where, faults)
        named = [(key, fields[key]) for key in ("point", "from", "to") if fields[key] is not None]
        points = [find_point(text, f"{where}.{key}", bodies, faults) for key, text in named]
        ends = [(at[0], at[1].name) for at in points if at is not None]
        if len(ends) == 3 and len(set(ends)) < 3:
            faults.add(where, "one point twice", "three different points")
        if len(ends) == 3:
            yield Side(ends[0], ends[1], ends[2], -1 if fields["side"] == "right" else 1)


def _port_points(raw: object, path: str, bodies: Bodies, faults: Faults) -> dict[str, PointPort | None]:
    """The ports at points of moving bodies, each with its positive direction, by name; None for one with faults."""
    tables = as_table(raw, path, faults)
    if tables is not None and len(tables) > MOST_BODIES:
        faults.add(path, f"{len(tables)} ports", f"at most {MOST_BODIES}")
        return {}
    ports: dict[str, PointPort | None] = {}
    for name, pair in (tables or {}).items():
        where = child(path, name)
        check_name(name, where, faults)
        ports[name], table = None, as_table(pair, where, faults)
        if table is None:
            continue
        fields = read_fields(table, POINT_PORT.keys, where, faults)
        text, direction = fields["point"], fields["direction"]
        place = None if text is None else find_point(text, f"{where}.point", bodies, faults)
        if place is not None and place[0] == FRAME:
            faults.add(f"{where}.point", quote(text), "a point of a moving body", "the frame stands still")
        if place is not None and direction is not None:
            ports[name] = PointPort(name, place[0], place[1].name, direction)
    return ports


def _check_names(linkage: Linkage, points: Iterable[str], driver: Joint | None, joints: Joints, faults: Faults) -> None:
    """Checks the names of ports (bodies that can turn, slides and slots, points): unique, and not that of the driver."""
    path = linkage.path
    seen: dict[str, str] = {}
    still = straight(linkage.joints)
    named = [(child(f"{path}.bodies", link.name), link.name, "a body") for link in linkage.links if link.name not in still]
    named += [
        (f"{joints.paths[joint.name]}.name", joint.name, f"a {joint.kind}")
        for joint in linkage.joints
        if joint.kind in (SLIDE, SLOT)
    ]
    named += [(child(f"{path}.ports", name), name, "a port") for name in points]
    for where, name, what in named:
        if name in seen:
            faults.add(where, quote(name), "a unique name", f"{seen[name]} has this name already")
        seen.setdefault(name, what)
    if driver is None or "" in (driver.first, driver.second):
        return  # the body that it turns is no port, but which one that is cannot be coordinate_text
    for name in shadowing(offered(linkage, points), driver.kind == SLIDE):
        where = next(where for where, other, _ in named if other == name)
        faults.add(where, quote(name), "another name", "the driver is called so where loads act; rename the body or joint")


_SHORTEST = 1e-9  # of a stroke, as a share of the coordinates at its ends


def read_stroke(raw: Mapping[str, Any], faults: Faults) -> Stroke | None:
    """The stroke of a scene whose driver moves one way; None if it turns in cycles.

    Its numbers are NaN if they could not be read, so that the rest can still be checked.
    """
    slides = driver_slides(raw)
    unread = Stroke(math.nan, math.nan, None, math.nan, slides is not False)
    if "stroke" not in raw:
        if not slides:
            return None
        beside = " and ".join(f"[{name}]" for name in ("regime", "flywheel") if name in raw)
        advice = "the mechanism's driver slides, so that there is no cycle" + (f": leave out {beside}" if beside else "")
        faults.add("stroke", "nothing", "a table with from and to, between which the driver moves", advice)
        return unread
    for name in STROKE_EXCLUDE:
        if name in raw:
            faults.add(name, f"{name} together with [stroke]", "none", "a one-way stroke has no cycle, and so no flywheel")
    mechanism = raw.get("mechanism")
    tables = [mechanism] if isinstance(mechanism, Mapping) else items(mechanism) or []
    if "mechanism" not in raw or (len(tables) != 1 and isinstance(mechanism, (list, tuple))):
        defect = f"{len(tables)} mechanisms" if tables else "nothing"
        faults.add("mechanism", defect, "one mechanism, whose driver makes the stroke")
    elif tables and isinstance(tables[0], Mapping):
        path, kind = "mechanism" if isinstance(mechanism, Mapping) else "mechanism[0]", tables[0].get("type")
        if isinstance(kind, str) and kind in KINDS and not _goes_one_way(KINDS[kind]):
            expected = " or ".join(f'"{name}"' for name, kind in KINDS.items() if _goes_one_way(kind))
            advice = "for a crank that turns in cycles leave out [stroke]"
            faults.add(f"{path}.type", f"{show(kind)} together with [stroke]", expected, advice)
        for name in ("phase", "shaft"):
            if name in tables[0]:
                advice = "the stroke is that of the mechanism's own driver"
                faults.add(f"{path}.{name}", f"{name} together with [stroke]", "none", advice)
    table = as_table(raw["stroke"], "stroke", faults)
    if table is None:
        return unread
    if slides is None:  # the mechanism does not give it, but perhaps the stroke's own unit
        try:
            parse_range(table.get("to"), "angle")
            slides = False
        except QuantityError:
            slides = True
    fields = read_fields(table, SECTIONS["stroke"].keys, "stroke", faults, rotating=not slides)
    start, end, speed, acceleration = fields.values()
    if None in (start, end, acceleration) or (speed is None and "speed" in table):
        return unread._replace(sliding=slides)
    if end - start <= _SHORTEST * max(abs(start), abs(end)):
        defect, ends = coordinate_text(end, slides), f"more than from, which is {coordinate_text(start, slides)}"
        faults.add("stroke.to", defect, ends, "a return stroke has the same ends and a negative speed")
    elif not slides and end - start > MOST_TURNS * TURN:
        faults.add("stroke.to", f"{(end - start) / TURN:.6g} turns", f"at most {MOST_TURNS}")
    else:
        return Stroke(start, end, speed, acceleration, slides)
    return unread._replace(sliding=slides)


def _goes_one_way(kind: Kind) -> bool:
    """Tests whether a mechanism may have a stroke: all may except laws, whose outputs are written for whole turns."""
    return kind.driver != "turns" or kind.skeleton is not None


def driver_slides(raw: Mapping[str, Any]) -> bool | None:
    """Tests whether the driver of the scene's mechanism slides; None if that cannot be decided.

    >>> driver_slides({"mechanism": {"type": "toggle-clamp"}}), driver_slides({"mechanism": {"type": "four-bar"}})
    (True, False)
    """
    mechanism = raw.get("mechanism")
    tables = [mechanism] if isinstance(mechanism, Mapping) else items(mechanism) or []
    table = tables[0] if len(tables) == 1 else None
    kind = table.get("type", "") if isinstance(table, Mapping) else None
    if not isinstance(table, Mapping) or not isinstance(kind, str):
        return None
    driver = KINDS[kind].driver if kind in KINDS else "turns"
    if driver != "either":
        return driver == "slides"
    joints = [joint for joint in items(table.get("joints")) or [] if isinstance(joint, Mapping)]
    name = table.get("driver")  # from Python a scene may hold anything, NumPy's arrays too
    named = [joint for joint in joints if isinstance(name, str) and isinstance(joint.get("name"), str)]
    kinds = [joint.get("type") for joint in named if joint["name"] == name]
    return kinds[0] == "slide" if kinds and isinstance(kinds[0], str) and kinds[0] in ("slide", "pin") else None


class ReadMechanism(NamedTuple):
    """One mechanism as far as it could be read: `mechanism` is None if it has faults.

    `complete` is False if it may have more ports than could be read.
    """

    name: str
    rotating: Mapping[str, bool]
    travel: float | None
    mechanism: Mechanism | None
    complete: bool = True


def read_mechanisms(raw: object, setting: Setting) -> tuple[tuple[Mechanism, ...], Places]:
    """Every mechanism of the scene, and every place of the machine, as far as they are free of faults."""
    faults, once = setting.faults, setting.stroke is not None
    if isinstance(raw, (list, tuple)) and len(raw) > MOST_MECHANISMS:
        faults.add("mechanism", f"{len(raw)} mechanisms", f"at most {MOST_MECHANISMS}")
        raw = None
    numbered = enumerate(raw) if isinstance(raw, (list, tuple)) else () if raw is None else ((None, raw),)
    paths = [("mechanism" if i is None else f"mechanism[{i}]", item) for i, item in numbered]
    tables = [(path, table) for path, item in paths if (table := as_table(item, path, faults)) is not None]
    types = [table.get("type") for _, table in tables]
    all_mechanisms = [_mechanism(table, path, types.count(table.get("type")) == 1, setting) for path, table in tables]
    seen: set[str] = set()
    for (path, _), item in zip(tables, all_mechanisms, strict=True):
        if item is None:
            continue
        if item.name in setting.shafts or (item.name in seen and f"{path}.name" not in {fault.path for fault in faults}):
            other = "a shaft" if item.name in setting.shafts else "another mechanism"
            faults.add(f"{path}.name", quote(item.name), "a unique name", f"{other} has this name already")
        seen.add(item.name)
    ports: dict[str, Place] = {}
    finite = all(abs(value) < math.inf for value in setting.parameters.values())
    for (_, table), item in zip(tables, all_mechanisms, strict=True):
        if item is None:
            continue
        returns: dict[str, bool] = {}
        if item.mechanism is not None and finite:
            try:
                family = build(item.mechanism, setting.parameters)
                returns = {name: port.returns or once for name, port in family.ports.items()}
            except SceneError as error:  # it locks
                kind, alone = KINDS[item.mechanism.type], not once and len(all_mechanisms) == 1
                moves = stroke_ranges(item.mechanism, setting.parameters) if alone else ""
                for fault in error.faults:
                    advice = fault.advice
                    if moves and fault.locks:
                        advice = f"{advice}; a [stroke] may lie within {moves}"
                    faults.append(_as_written(fault, kind, table)._replace(advice=advice))
            except ArithmeticError:
                advice = "lengths whose squares can be computed"
                faults.add(item.mechanism.path, "lengths that differ too much in size", advice)
        for port, rotating in item.rotating.items():
            name = f"{item.name}.{port}"
            ports[name] = Place(name, rotating, item.travel, returns.get(port, True))
    shafts = {name: Place(name, not setting.sliding, setting.cycle, once) for name in setting.shafts}
    complete = all(item is not None and item.complete for item in all_mechanisms)
    read = tuple(item.mechanism for item in all_mechanisms if item is not None and item.mechanism is not None)
    return read, Places(shafts, ports, complete, read)


def _mechanism(raw: Mapping[str, Any], path: str, alone: bool, setting: Setting) -> ReadMechanism | None:
    """One mechanism; None if not even its ports are known."""
    faults, stroke = setting.faults, setting.stroke
    before = len(faults)
    kind = KINDS.get(raw["type"]) if isinstance(raw.get("type"), str) else None
    if kind is None:  # the keys of a type make no sense without it
        if isinstance(raw.get("type"), str):
            faults.unknown(f"{path}.type", raw["type"], KINDS, "type")
        else:
            faults.add(f"{path}.type", show(raw.get("type")), "one of " + ", ".join(KINDS))
        common = [key for key in MECHANISM.keys if key.name != "type"]
        fields = read_fields({key.name: raw[key.name] for key in common if key.name in raw}, common, path, faults)
        _travel(fields["shaft"], f"{path}.shaft", setting)
        return None
    names = items(raw.get("driver")) if kind.name == "linkage" else None
    if names is not None and all(isinstance(driver, str) for driver in names):
        defect = f"{len(names)} drivers ({', '.join(map(str, names))})" if len(names) != 1 else "a list of one driver"
        advice = "several are read by flywheel.load_linkage (see flywheel reference freedoms)"
        faults.add(f"{path}.driver", defect, "the name of one, of one degree of freedom", advice)
        return None
    parts = tuple(Key(part.name_in(raw), "part", part.about) for part in kind.parts)
    twins = [part for part in kind.parts if part.alias and part.alias in raw and part.name in raw]
    for part in twins:
        defect = f"{part.alias} together with {part.name}, which is the same"
        faults.add(f"{path}.{part.alias}", defect, "one of the two", f"leave {part.alias} out")
    raw = {key: value for key, value in raw.items() if key not in {part.alias for part in twins}}
    fields = read_fields(raw, (*MECHANISM.keys, *kind.keys, *parts), path, faults)
    name = fields["name"] or kind.name
    if not alone and "name" not in raw:
        faults.add(f"{path}.name", "nothing", "a name, as there are several of this type")
    travel = _travel(fields["shaft"], f"{path}.shaft", setting)
    period = None
    if kind.name == "law" and travel is not None and setting.cycle is not None:
        period = default_period(travel, setting.cycle)
        if period is None:
            defect = f"a law that turns {np.degrees(travel):.10g} deg in a cycle of {np.degrees(setting.cycle):.10g} deg"
            faults.add(f"{path}.shaft", defect, "that one of the two divides the other", "change regime.cycle")
    geometry: dict[str, float] = {}
    bodies: dict[str, Body] = {}
    for part in kind.parts:
        where = f"{path}.{part.name_in(raw)}"
        part_table = raw.get(part.name_in(raw), {})
        if isinstance(part_table, (str, int, float)) and any(key.name == "length" for key in part.keys):
            faults.add(where, show(part_table), "a table", f"write {part.name_in(raw)}.length = {show(part_table)}")
        elif (table := as_table(part_table, where, faults)) is not None:
            values = read_fields(table, part.keys, where, faults)
            geometry |= {f"{part.name}.{key.name}": values[key.name] for key in part.geometry}
            if part.body:
                bodies[part.name] = Body(**{key.name: values[key.name] for key in part.body})
    own: dict[str, Any] = {}
    rotating, complete = {port.name: port.rotating for port in kind.ports}, True
    if kind.name == "linkage":
        ports, linkage, points, complete = read_linkage(raw, fields, path, setting)
        own = {"linkage": linkage, "points": points}
        rotating |= ports
    elif kind.name == "law":
        outputs, period = _outputs(raw, period, travel, path, setting)
        part_table = raw["outputs"] if isinstance(raw.get("outputs"), Mapping) else {}
        own = {"outputs": outputs, "period": period}
        rotating |= {str(name): isinstance(of, Mapping) and "theta" in _positioned(of) for name, of in part_table.items()}
    else:
        own = {"assembly": fields.get("assembly", "open")}
    if len(faults) > before or own.get("period", TURN) is None or (stroke is not None and setting.cycle is None):
        return ReadMechanism(name, rotating, travel, None, complete)
    phase = fields["phase"]
    if kind.name != "law" and travel is not None and abs(phase) > travel:  # beside it every angle is rounded as it is
        within = math.atan2(math.sin(phase), math.cos(phase))
        phase = within + round((phase - within) / TURN) % round(travel / TURN) * TURN
    at = {"shaft": fields["shaft"], "phase": phase, "travel": TURN if travel is None else travel}
    if stroke is not None:  # the driver's coordinate begins where its stroke does
        at = {"shaft": stroke.element, "phase": stroke.start, "travel": stroke.span, "stroke": (stroke.start, stroke.end)}
        own["period"] = stroke.span if stroke.sliding else TURN
    mechanism = Mechanism(type=kind.name, name=name, geometry=geometry, bodies=bodies, path=path, **at, **own)
    return ReadMechanism(name, rotating, travel, mechanism, complete)


def _as_written(fault: Fault, kind: Kind, raw: Mapping[str, Any]) -> Fault:
    """A fault of a mechanism's lengths with the names that its table has for its parts."""
    for part in kind.parts:
        name = part.name_in(raw)
        path = fault.path.replace(f".{part.name}.", f".{name}.")
        fault = fault._replace(path=path, expected=fault.expected.replace(f"{part.name}.", f"{name}."))
    return fault


def _travel(shaft: object, path: str, setting: Setting) -> float | None:
    """Angle (rad) through which the mechanism's own crank turns in a cycle: a whole number of turns, else a fault."""
    if not isinstance(shaft, str) or setting.cycle is None or setting.stroke is not None:
        return setting.cycle if isinstance(shaft, str) else None
    if shaft not in setting.shafts:
        setting.faults.add(path, quote(shaft), "a shaft", suggestion(shaft, setting.shafts))
        return None
    turns = setting.shafts[shaft] * setting.cycle / TURN
    count = whole(turns)
    if count is None or count > MOST_TURNS:
        defect = f"{turns:.10g} turns of {quote(shaft)} in the cycle of {np.degrees(setting.cycle):.10g} deg"
        expected = f"a whole number of them, at most {MOST_TURNS}"
        degrees = whole(setting.cycle / 90) if setting.cycle > TURN else None
        advice = f'write regime.cycle = "{90 * degrees} deg"' if degrees else "change regime.cycle or the shaft's ratio"
        setting.faults.add(path, defect, expected, advice)
        return None
    crank = whole(setting.cycle / TURN)
    setting.shafts[shaft] = count / crank if crank else count * TURN / setting.cycle  # it may be given with fewer digits
    return count * TURN


def _outputs(
    raw: Mapping[str, Any], period: float | None, travel: float | None, path: str, setting: Setting
) -> tuple[tuple[Output, ...], float | None]:
    """The outputs of a law and the angle after which all of them repeat."""
    faults = setting.faults
    path = child(path, "outputs")
    tables = as_table(raw.get("outputs", {}), path, faults) or {}
    if not tables and isinstance(raw.get("outputs"), Mapping):
        faults.add(path, "no output", "one table at least, such as [mechanism.outputs.ram]")
    if len(tables) > MOST_MECHANISMS:
        faults.add(path, f"{len(tables)} outputs", f"at most {MOST_MECHANISMS}")
        return (), None
    outputs = [_output(name, table, child(path, name), setting) for name, table in tables.items()]
    good = [output for output in outputs if output is not None]
    if period is None or travel is None:
        return tuple(good), None
    if all(isinstance(output.law, Table) for output in good) and any(repeats(o, period) is None for o in good):
        period = travel  # nothing here sees phi, so that the whole travel may be the period
    return tuple(fitted(output, period, path, faults) for output in good), period


def _output(name: str, raw: object, path: str, setting: Setting) -> Output | None:
    """One output: a position, with mass or inertia."""
    faults = setting.faults
    before = len(faults)
    check_name(name, path, faults)
    table = as_table(raw, path, faults)
    if table is None:
        return None
    table = _positioned(table)
    item = read_item(table, OUTPUT, path, faults)
    if not item.one("x", "theta"):
        return None
    key, own, other = ("x", "mass", "inertia") if "x" in table else ("theta", "inertia", "mass")
    if other in table:
        faults.add(f"{path}.{other}", f"{other} of an output with {key}", own)
    law = read_law(table[key], key, f"{path}.{key}", setting)
    if law is None or len(faults) > before:
        return None
    return Output(name, key == "theta", law, item.fields[own])


def _positioned(output: Mapping[str, Any]) -> Mapping[str, Any]:
    """An output whose position stands under `table`, as one with a table for its `x`, or its `theta` if that rotates."""
    if "table" not in output or "x" in output or "theta" in output:
        return output
    table = output["table"]
    unit = table.get("value_unit") if isinstance(table, Mapping) else None
    key = "theta" if "inertia" in output or unit in ("deg", "rad", "°", "rev") else "x"
    return {key: table, **{name: value for name, value in output.items() if name != "table"}}
