"""Joints of a linkage: between which points, of what kind, and what they are called."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from flywheel.advice import quote, show
from flywheel.linkage.description import PIN, Joint, Point
from flywheel.reading.bodies import ORIGIN, Bodies, find_point, listed
from flywheel.reading.fields import Faults, child, items, read_fields
from flywheel.reading.schema_linkage import JOINT, JOINT_KEYS, MOST_JOINTS, keys_for, misplaced

_NOWHERE = ("", Point(ORIGIN))


class Joints(NamedTuple):
    """Joints by name, those with faults among them: a body that is not known is called "", and so is a kind.

    `paths` tells where each stands; `complete` is False where a joint without a name hides.
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
            faults.add(f"{where}.name", quote(joint.name), "a name of its own", f"{paths[joint.name]} bears this one")
        elif joint is not None:
            named[joint.name], paths[joint.name] = joint, where
    read = sum(joint is not None for _, joint in found)
    return Joints(named, paths, 0 < read == len(given or ()))


def _joint(raw: Mapping[str, Any], path: str, bodies: Bodies, faults: Faults) -> Joint | None:
    """One joint; None where it has no name."""
    kind = raw.get("type")
    kind = kind if isinstance(kind, str) and kind in JOINT_KEYS else ""
    raw = without_misplaced(raw, kind, JOINT_KEYS, path, faults)
    fields = read_fields(raw, keys_for(JOINT, JOINT_KEYS.get(kind)), path, faults)
    name = fields["name"]
    first, second = _ends(raw, f"{path}.between", bodies, faults)
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
    wrong = misplaced(raw, kind, by_kind)
    for name, types in wrong.items():
        keys = ", ".join(("name", "type", "between", *by_kind[kind]))
        faults.add(child(path, name), f"{name}, which belongs to {types}", f"keys of a {kind}: {keys}")
    return {name: value for name, value in raw.items() if name not in wrong}


def _ends(raw: Mapping[str, Any], path: str, bodies: Bodies, faults: Faults) -> list[tuple[str, Point]]:
    """Body and point of both ends of a joint."""
    wanted = 'a list of two points, such as ["frame.O", "crank.O"]'
    pair = read_two(raw["between"], path, wanted, faults) if "between" in raw else ()
    ends = [find_point(text, f"{path}[{i}]", bodies, faults) or _NOWHERE for i, text in enumerate(pair)]
    if ends and ends[0][0] and ends[0][0] == ends[1][0]:
        faults.add(path, f"{quote(ends[0][0])} twice", "two different bodies")
    return ends or [_NOWHERE, _NOWHERE]


def read_two(raw: object, path: str, wanted: str, faults: Faults) -> Sequence[object]:
    """The two items of a list; none after noting a fault."""
    found = items(raw)
    if found is not None and len(found) == 2:
        return found
    faults.add(path, show(raw) if found is None else f"a list of {len(found)}", wanted)
    return ()
