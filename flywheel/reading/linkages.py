"""Linkages of a scene: bodies with their points, joints, couplings, driver, assembly and ports, or every fault in them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from flywheel.numerics.faults import SceneError, quote, show, suggestion
from flywheel.numerics.units import plain_number
from flywheel.reading.fields import (
    Faults,
    Fields,
    Item,
    Setting,
    as_table,
    check_name,
    child,
    items,
    read_fields,
    read_item,
    read_quantity,
)
from flywheel.reading.schema import (
    COUPLING,
    COUPLING_KEYS,
    COUPLING_ONE_OF,
    FRAME_BODY,
    JOINT,
    JOINT_KEYS,
    LINK,
    MOST_BODIES,
    MOST_JOINTS,
    MOST_POINTS,
    POINT_PORT,
    SIDE,
    TURN,
    keys_for,
)
from flywheel.reading.tables import fitted, read_law
from flywheel.scene.keys import Key
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
from flywheel.scene.scene import Output, PointPort

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
        faults.add(path, "no moving body", f"at least one in addition to {FRAME}")
    return {FRAME: Link(FRAME, (Point(ORIGIN),))} | bodies


def _body(name: str, raw: object, path: str, faults: Faults) -> Link:
    """One body: its mass and inertia, and its points, the origin first; a point with a faulty place keeps its name."""
    check_name(name, path, faults)
    table = as_table(raw, path, faults)
    if table is None:
        return Link(name, (Point(ORIGIN),))
    fields = read_fields(table, (FRAME_BODY if name == FRAME else LINK).keys, path, faults)
    given, places = as_table(table.get("points", {}), f"{path}.points", faults), {ORIGIN: (0.0, 0.0)}
    if given is not None and len(given) > MOST_POINTS:
        faults.add(f"{path}.points", f"{len(given)} points", f"at most {MOST_POINTS}")
        given = None
    for point, pair in (given or {}).items():
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
    found = items(raw)
    if found is None or len(found) != 2:
        faults.add(path, show(raw) if found is None else f"a list of {len(found)}", "a list [x, y] of two lengths")
        return None
    x, y = (read_quantity(value, "length", _COORDINATE, f"{path}[{i}]", faults) for i, value in enumerate(found))
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
    found = items(raw)
    if found is None:
        faults.add(path, show(raw), "an array of tables", f"write [[mechanism.{path.rpartition('.')[2]}]] for each")
        return []
    if len(found) > most:
        faults.add(path, f"{len(found)} tables", f"at most {most}")
        return []
    tables = [(f"{path}[{i}]", as_table(item, f"{path}[{i}]", faults)) for i, item in enumerate(found)]
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
    given = items(raw)
    if given == []:
        faults.add(path, "no joint", "one at least")
    found = [(where, _joint(table, where, bodies, faults)) for where, table in listed(raw, path, MOST_JOINTS, faults)]
    for where, joint in found:
        if joint is not None and joint.name in named:
            faults.add(f"{where}.name", quote(joint.name), "a unique name", f"{paths[joint.name]} has this name already")
        elif joint is not None:
            named[joint.name], paths[joint.name] = joint, where
    read = sum(joint is not None for _, joint in found)
    return Joints(named, paths, 0 < read == len(given or ()))


def _joint(raw: Mapping[str, Any], path: str, bodies: Bodies, faults: Faults) -> Joint | None:
    """One joint; None if it has no name."""
    kind = raw.get("type")
    kind = kind if isinstance(kind, str) and kind in JOINT_KEYS else ""
    raw = without_misplaced(raw, kind, JOINT_KEYS, path, faults)
    fields = read_fields(raw, keys_for(JOINT, JOINT_KEYS.get(kind)), path, faults)
    name = fields["name"]
    between, wanted = f"{path}.between", 'a list of two points, such as ["frame.O", "crank.O"]'
    pair = read_two(raw["between"], between, wanted, faults) if "between" in raw else ()
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


def read_two(raw: object, path: str, wanted: str, faults: Faults) -> Sequence[object]:
    """The two items of a list; none after noting a fault."""
    found = items(raw)
    if found is not None and len(found) == 2:
        return found
    faults.add(path, show(raw) if found is None else f"a list of {len(found)}", wanted)
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
    found = [joint for i, name in enumerate(names) if (joint := joints.find(name, f"{path}[{i}]", faults)) is not None]
    if len(found) != 2 or not kind or not all(joint.kind for joint in found):
        return None
    first, second = found
    if first.name == second.name:
        faults.add(path, f"{quote(first.name)} twice", "two different joints")
        return None
    wrong = [i for i, joint in enumerate(found) if joint.kind not in _TAKES[kind][i]]
    for i in wrong:
        taken, other = " or a ".join(_TAKES[kind][i]), found[i]
        faults.add(
            f"{path}[{i}]", f"{quote(other.name)}, a {other.kind} joint", f"a {taken}", _NOT_TAKEN.get(other.kind, "")
        )
    if wrong or "" in (*first[2:4], *second[2:4]):
        return None
    common = common_body(first, second)
    if not common:
        bodies = (f"{quote(joint.name)} of {joint.first} and {joint.second}" for joint in found)
        faults.add(path, " with ".join(bodies), "two joints of one body, which carries both")
        return None
    return first, second, common


def _geared(item: Item, pair: _Pair) -> dict[str, Any]:
    """Ratio (of what rolls a radius with its sign), phase and pressure angle of a gear pair, or of what rolls on a slide."""
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
    found = None if text is None else find_point(text, f"{item.path}.contact", bodies, item.faults)
    if found is not None:
        follower = second.second if second.first == carrier else second.first
        if found[0] != follower:
            item.add("contact", quote(text), f"a point of the follower, {follower}")
        contact = found[0], found[1].name
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


class Drawn(NamedTuple):
    """A linkage as far as it could be read: its rotating ports are known even if it has faults.

    `complete` is False if a joint could not be read, so that there may be more ports than these.
    """

    ports: dict[str, bool]
    linkage: Linkage
    points: tuple[PointPort, ...] = ()
    complete: bool = True


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
    told = all(isinstance(kind, str) and kind in JOINT_KEYS for kind in kinds)
    complete = told and slides == sum(joint.kind in (SLIDE, SLOT) for joint in joints.named.values())
    return Drawn(offered(linkage, points), linkage, good, bool(bodies) and complete)


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
    given = items(starts) if items(starts) is not None else [starts] * (len(names) if starts == 0.0 else 1)
    if given is None or len(given) != len(names):
        faults.add(f"{path}.start", show(starts), f"a list of {len(names)}, one for each driver")
        return ()
    found: list[Driver] = []
    for k, (name, start) in enumerate(zip(names, given, strict=True)):
        at = f"[{k}]" if len(names) > 1 else ""
        joint = joints.find(name, f"{path}.driver{at}", faults)
        if joint is None or not joint.kind:
            continue
        if joint.kind not in (PIN, SLIDE):
            faults.add(f"{path}.driver{at}", f"{quote(joint.name)}, a {joint.kind} joint", "a pin or a slide")
        elif joint.name in [driver.joint for driver in found]:
            faults.add(f"{path}.driver{at}", f"{quote(joint.name)} twice", "another joint")
        else:
            found.append(Driver(joint.name, _start(start, joint, f"{path}.start{at}", faults)))
    return tuple(found) if len(faults) == before else ()


def _driver(name: object, path: str, joints: Joints, setting: Setting) -> Joint | None:
    """The joint that drives: a pin with the frame as its first body, or a slide, if there is a stroke."""
    faults = setting.faults
    joint = None if name is None else joints.find(name, path, faults)
    if joint is None or not joint.kind:
        return None
    found = f"{quote(joint.name)}, a {joint.kind} joint"
    if joint.kind not in (PIN, SLIDE):
        faults.add(path, found, "a pin or a slide")
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
        faults.add(path, f"{found}, without [stroke]", "a pin of the frame", advice)
    else:
        return joint
    return None


def _sides(raw: object, path: str, bodies: Bodies, faults: Faults) -> Iterator[Side]:
    """Every choice of assembly that is free of faults."""
    for where, table in listed(raw, path, MOST_BODIES, faults):
        fields = read_fields(table, SIDE.keys, where, faults)
        named = [(key, fields[key]) for key in ("point", "from", "to") if fields[key] is not None]
        found = [find_point(text, f"{where}.{key}", bodies, faults) for key, text in named]
        ends = [(at[0], at[1].name) for at in found if at is not None]
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
    for name, given in (tables or {}).items():
        where = child(path, name)
        check_name(name, where, faults)
        ports[name], table = None, as_table(given, where, faults)
        if table is None:
            continue
        fields = read_fields(table, POINT_PORT.keys, where, faults)
        text, direction = fields["point"], fields["direction"]
        found = None if text is None else find_point(text, f"{where}.point", bodies, faults)
        if found is not None and found[0] == FRAME:
            faults.add(f"{where}.point", quote(text), "a point of a moving body", "the frame stands still")
        if found is not None and direction is not None:
            ports[name] = PointPort(name, found[0], found[1].name, direction)
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
        return  # the body that it turns is no port, but which one that is cannot be told
    for name in shadowing(offered(linkage, points), driver.kind == SLIDE):
        where = next(where for where, other, _ in named if other == name)
        faults.add(where, quote(name), "another name", "the driver is called so where loads act; rename the body or joint")
