"""A `linkage` of a scene: bodies, joints, couplings, driver, assembly and ports, or every fault in them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

from flywheel.advice import quote
from flywheel.linkage.description import FIXED, FRAME, PIN, SLIDE, SLOT, Joint, Link, Linkage, Side
from flywheel.linkage.ports import offered, shadowing, straight
from flywheel.reading.bodies import Bodies, find_point, listed, read_bodies
from flywheel.reading.couplings import read_couplings
from flywheel.reading.fields import Faults, Fields, as_table, child, is_name, items, read_fields, read_quantity
from flywheel.reading.joints import Joints, read_joints
from flywheel.reading.places import Setting
from flywheel.reading.schema import Key
from flywheel.reading.schema_linkage import MOST_BODIES, POINT_PORT, SIDE
from flywheel.scene import PointPort


class Drawn(NamedTuple):
    """A linkage as far as it could be read: which of its ports rotate is known even where it has faults.

    `complete` is False where a joint could not be read, so that there may be more ports than these.
    """

    ports: dict[str, bool]
    linkage: Linkage
    points: tuple[PointPort, ...] = ()
    complete: bool = True


def read_linkage(raw: Mapping[str, Any], fields: Fields, path: str, setting: Setting) -> Drawn:
    """The linkage in a mechanism's table, whose keys are in `fields`; faults are noted in the setting."""
    faults = setting.faults
    bodies = read_bodies(raw["bodies"], f"{path}.bodies", faults) if "bodies" in raw else {}
    joints = read_joints(raw["joints"], f"{path}.joints", bodies, faults) if "joints" in raw else Joints({}, {}, False)
    driver = _driver(fields["driver"], f"{path}.driver", joints, setting)
    linkage = Linkage(
        ground=bodies.get(FRAME, Link(FRAME)),
        links=tuple(body for name, body in bodies.items() if name != FRAME),
        joints=tuple(joints.named.values()),
        driver=fields["driver"] if isinstance(fields["driver"], str) else "",
        couplings=read_couplings(raw.get("couplings", ()), f"{path}.couplings", bodies, joints, setting),
        sides=tuple(_sides(raw.get("assembly", ()), f"{path}.assembly", bodies, faults)),
        start=_start(fields["start"], driver, f"{path}.start", faults),
        path=path,
    )
    points = _points(raw.get("ports", {}), f"{path}.ports", bodies, faults)
    _check_joined(bodies, joints, path, faults)
    _check_names(linkage, points, driver, joints, faults)
    good = tuple(port for port in points.values() if port is not None)
    return Drawn(offered(linkage, points), linkage, good, bool(bodies) and _are_all(raw.get("joints"), joints))


def _are_all(raw: object, joints: Joints) -> bool:
    """Whether no slide or slot, each of which is a port, hides among joints that could not be read."""
    given = items(raw) or [None]
    kinds = [joint.get("type") if isinstance(joint, Mapping) else None for joint in given]
    ports = sum(isinstance(kind, str) and kind in (SLIDE, SLOT) for kind in kinds)
    others = sum(isinstance(kind, str) and kind in (PIN, FIXED) for kind in kinds)
    return ports + others == len(given) and ports == sum(joint.kind in (SLIDE, SLOT) for joint in joints.named.values())


def _driver(name: object, path: str, joints: Joints, setting: Setting) -> Joint | None:
    """The joint that drives: a pin of the frame, which is its first body, or a slide, where there is a stroke."""
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


def _start(raw: object, driver: Joint | None, path: str, faults: Faults) -> float:
    """The driver's coordinate at which guesses and sides hold."""
    if driver is None:
        return 0.0
    dimension = "length" if driver.kind == SLIDE else "angle"
    return read_quantity(raw, dimension, Key("start", dimension, "of the driver"), path, faults) or 0.0


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


def _points(raw: object, path: str, bodies: Bodies, faults: Faults) -> dict[str, PointPort | None]:
    """The ports at points of bodies, by name; None for one with faults."""
    tables = as_table(raw, path, faults)
    if tables is not None and len(tables) > MOST_BODIES:
        faults.add(path, f"{len(tables)} ports", f"at most {MOST_BODIES}")
        return {}
    return {name: _point(name, table, child(path, name), bodies, faults) for name, table in (tables or {}).items()}


def _point(name: str, raw: object, path: str, bodies: Bodies, faults: Faults) -> PointPort | None:
    """One port: a point of a moving body, and the direction that counts as positive."""
    if not is_name(name):
        faults.add(path, quote(name), "a letter, then letters, digits, _ or -")
    table = as_table(raw, path, faults)
    if table is None:
        return None
    fields = read_fields(table, POINT_PORT.keys, path, faults)
    text = fields["point"]
    found = None if text is None else find_point(text, f"{path}.point", bodies, faults)
    if found is not None and found[0] == FRAME:
        faults.add(f"{path}.point", quote(text), "a point of a moving body", "the frame stands still")
    if found is None or fields["direction"] is None:
        return None
    return PointPort(name, found[0], found[1].name, fields["direction"])


def _check_joined(bodies: Bodies, joints: Joints, path: str, faults: Faults) -> None:
    """Every body is named by a joint; said only where every joint names its bodies."""
    named = {body for joint in joints.named.values() for body in (joint.first, joint.second)}
    if not joints.complete or "" in named:
        return
    for body in bodies:
        if body not in named:
            faults.add(child(f"{path}.bodies", body), "a body without joints", "a joint at least that names a point of it")


def _check_names(linkage: Linkage, points: Iterable[str], driver: Joint | None, joints: Joints, faults: Faults) -> None:
    """Ports have names of their own: bodies that can turn, slides and slots, points; none is called as the driver is."""
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
            faults.add(where, quote(name), "a name of its own", f"{seen[name]} bears this one")
        seen.setdefault(name, what)
    if driver is None or "" in (driver.first, driver.second):
        return  # the body that it turns is no port, but which one that is cannot be told
    for name in shadowing(offered(linkage, points), driver.kind == SLIDE):
        where = next(where for where, other, _ in named if other == name)
        faults.add(where, quote(name), "another name", "the driver is called so where loads act; rename the body or joint")
