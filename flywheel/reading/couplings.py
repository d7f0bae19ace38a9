"""Couplings of a linkage: gear pairs, rolling pairs and cams, each between the coordinates of two joints."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from flywheel.advice import quote, show
from flywheel.faults import SceneError
from flywheel.linkage.description import (
    CAM,
    FIXED,
    GEAR,
    PIN,
    ROLLING,
    SLIDE,
    SLOT,
    Coupling,
    Joint,
    Lift,
    common_body,
)
from flywheel.reading.bodies import Bodies, find_point, listed
from flywheel.reading.fields import Faults, Fields, exactly_one, read_fields, read_quantity
from flywheel.reading.joints import Joints, read_two, without_misplaced
from flywheel.reading.places import Setting
from flywheel.reading.positions import fitted, read_law
from flywheel.reading.schema import TURN
from flywheel.reading.schema_linkage import COUPLING, COUPLING_KEYS, MOST_JOINTS, keys_for
from flywheel.scene import Output
from flywheel.units import plain_number

_MOST_TEETH = 10**6
_STEEPEST = math.radians(89.0)  # pressure angle: beyond it hardly any of a tooth's force would drive
_KEYS = {key.name: key for key in COUPLING.keys}

_TAKES = {GEAR: ((PIN,), (PIN,)), ROLLING: ((PIN,), (SLIDE,)), CAM: ((PIN,), (SLIDE, PIN))}
"""Kinds of the first and of the second joint that a coupling takes."""
_NOT_TAKEN = {FIXED: "a fixed joint has no coordinate", SLOT: "a pin in a slot has two motions, not one"}


class _Item(NamedTuple):
    """One coupling's table on its way: its keys as read, its two joints, and the body that carries both."""

    raw: Mapping[str, Any]
    fields: Fields
    first: Joint
    second: Joint
    carrier: str
    path: str
    bodies: Bodies
    setting: Setting

    @property
    def faults(self) -> Faults:
        return self.setting.faults

    def quantity(self, key: str, dimension: str) -> float | None:
        """A quantity whose dimension hangs on the type of the coupling; None where there is none, or a faulty one."""
        if key not in self.raw:
            return 0.0 if key == "phase" else None
        return read_quantity(self.raw[key], dimension, _KEYS[key], f"{self.path}.{key}", self.faults)


def read_couplings(raw: object, path: str, bodies: Bodies, joints: Joints, setting: Setting) -> tuple[Coupling, ...]:
    """Every coupling that is free of faults; each has a name of its own, which no joint bears."""
    taken = dict.fromkeys(joints.named, "a joint")
    good = []
    for where, table in listed(raw, path, MOST_JOINTS, setting.faults):
        coupling = _coupling(table, where, bodies, joints, setting)
        if coupling is None:
            continue
        if coupling.name in taken:
            advice = f"{taken[coupling.name]} bears this one"
            setting.faults.add(f"{where}.name", quote(coupling.name), "a name of its own", advice)
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
    fields = read_fields(raw, keys_for(COUPLING, COUPLING_KEYS.get(kind)), path, faults)
    pair = _pair(raw["between"], kind, f"{path}.between", joints, faults) if "between" in raw else None
    if pair is None:
        return None
    first, second, carrier = pair
    values = _READERS[kind](_Item(raw, fields, first, second, carrier, path, bodies, setting))
    if len(faults) > before:
        return None
    return Coupling(fields["name"] or f"{first.name}-{second.name}", kind, first.name, second.name, **values)


def _pair(raw: object, kind: str, path: str, joints: Joints, faults: Faults) -> tuple[Joint, Joint, str] | None:
    """The two joints that a coupling joins, of kinds that fit, and the body that carries both."""
    names = read_two(raw, path, 'a list of two joints, such as ["O", "P"]', faults)
    found = [joint for i, name in enumerate(names) if (joint := joints.find(name, f"{path}[{i}]", faults)) is not None]
    if len(found) != 2 or not kind or not all(joint.kind for joint in found):
        return None
    first, second = found
    if first.name == second.name:
        faults.add(path, f"{quote(first.name)} twice", "two different joints")
        return None
    if not _fit(kind, found, path, faults) or "" in (*first[2:4], *second[2:4]):
        return None
    common = common_body(first, second)
    if not common:
        bodies = (f"{quote(joint.name)} of {joint.first} and {joint.second}" for joint in found)
        faults.add(path, " with ".join(bodies), "two joints of one body, which carries both")
        return None
    return first, second, common


def _fit(kind: str, pair: list[Joint], path: str, faults: Faults) -> bool:
    """Whether both joints are of kinds that the coupling takes."""
    wrong = [i for i, joint in enumerate(pair) if joint.kind not in _TAKES[kind][i]]
    for i in wrong:
        found = f"{quote(pair[i].name)}, a {pair[i].kind} joint"
        faults.add(f"{path}[{i}]", found, f"a {' or a '.join(_TAKES[kind][i])}", _NOT_TAKEN.get(pair[i].kind, ""))
    return not wrong


# -- gears and what rolls ------------------------------------------------------------------------------------------------


def _gear(item: _Item) -> dict[str, Any]:
    """Ratio, phase and pressure angle of a gear pair."""
    exactly_one([key for key in ("ratio", "teeth") if key in item.raw], ("ratio", "teeth"), item.path, item.faults)
    if "internal" in item.raw and "teeth" not in item.raw:
        advice = "the sign of the ratio says which (see flywheel reference linkage)"
        item.faults.add(f"{item.path}.internal", "internal beside a ratio", "none", advice)
    ratio = _toothed(item) if "teeth" in item.raw else _ratio(item, "number")
    return {"ratio": ratio, "phase": item.quantity("phase", "angle"), "pressure_angle": _pressure_angle(item)}


def _rolling(item: _Item) -> dict[str, Any]:
    """Radius with its sign, phase and pressure angle of what rolls along a slide."""
    if "ratio" not in item.raw:
        item.faults.add(f"{item.path}.ratio", "nothing", 'a length such as "100 mm": the slide per rad of the pin')
    ratio = _ratio(item, "length")
    return {"ratio": ratio, "phase": item.quantity("phase", "length"), "pressure_angle": _pressure_angle(item)}


def _ratio(item: _Item, dimension: str) -> float | None:
    """A ratio other than 0."""
    ratio = item.quantity("ratio", dimension)
    if ratio == 0.0:
        item.faults.add(f"{item.path}.ratio", show(item.raw["ratio"]), "a ratio other than 0")
    return ratio


def _toothed(item: _Item) -> float | None:
    """The ratio of two wheels: -z1/z2, or z1/z2 where one has its teeth inside.

    A pin counts the angle of its second body against its first. Where one pin has the carrier as its first body and the
    other as its second, their angles count opposite ways, and the ratio changes its sign.
    """
    path, faults = item.path, item.faults
    internal = item.raw.get("internal", False)
    if not isinstance(internal, bool):
        faults.add(f"{path}.internal", show(internal), "true or false")
    pair = read_two(item.raw["teeth"], f"{path}.teeth", "a list of two numbers of teeth, such as [20, 40]", faults)
    one, two = [_count(count, f"{path}.teeth[{i}]", faults) for i, count in enumerate(pair)] or (None, None)
    if one is None or two is None:
        return None
    if internal is True and one == two:
        faults.add(f"{path}.teeth", "as many on both wheels of an internal pair", "more on the outer one")
    alike = (item.first.first == item.carrier) == (item.second.first == item.carrier)
    return (1 if internal == alike else -1) * one / two


def _count(raw: object, path: str, faults: Faults) -> float | None:
    """A number of teeth; None after noting a fault."""
    count = plain_number(raw)
    if count is not None and count.is_integer() and 1 <= count <= _MOST_TEETH:
        return count
    faults.add(path, show(raw), f"a whole number from 1 to {_MOST_TEETH}")
    return None


def _pressure_angle(item: _Item) -> float:
    """Pressure angle of the teeth, well short of a right angle."""
    angle: float = item.fields["pressure_angle"] or 0.0
    if not 0.0 <= angle <= _STEEPEST:
        item.faults.add(f"{item.path}.pressure_angle", show(item.raw["pressure_angle"]), "an angle from 0 to 89 deg")
    return angle


# -- cams ----------------------------------------------------------------------------------------------------------------


def _cam(item: _Item) -> dict[str, Any]:
    """Lift law, point of contact and friction of a cam."""
    return {"lift": _lift(item), "contact": _contact(item), "friction": item.fields["friction"]}


def _contact(item: _Item) -> tuple[str, str] | None:
    """Body and point through which the cam pushes: a point of the follower."""
    text = item.fields["contact"]
    found = None if text is None else find_point(text, f"{item.path}.contact", item.bodies, item.faults)
    if found is None:
        return None
    follower = item.second.second if item.second.first == item.carrier else item.second.first
    if found[0] != follower:
        item.faults.add(f"{item.path}.contact", quote(text), f"a point of the follower, {follower}")
    return found[0], found[1].name


def _lift(item: _Item) -> Lift | None:
    """The lift law over a turn of the cam: smooth, and back where it was."""
    path, setting, rotating = item.path, item.setting, item.second.kind == PIN
    given = [key for key in ("lift", "table") if key in item.raw]
    if not exactly_one(given, ("lift", "table"), path, item.faults):
        return None
    before = len(item.faults)
    law = read_law(item.raw[given[0]], "theta" if rotating else "x", f"{path}.{given[0]}", setting)
    if law is None or any(map(math.isnan, setting.parameters.values())):
        return None
    output = fitted(Output(given[0], rotating, law, 1.0), TURN, path, item.faults)
    if len(item.faults) > before:
        return None
    from flywheel.mechanisms.law import followed  # only scenes with a cam pay for it

    try:
        return Lift(followed(output, TURN, setting.parameters, path), TURN)
    except SceneError as error:
        item.faults.extend(fault._replace(path=f"{path}.{given[0]}") for fault in error.faults)
        return None


_READERS = {GEAR: _gear, ROLLING: _rolling, CAM: _cam}
