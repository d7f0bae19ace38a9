"""The one-way stroke of a scene, `[stroke]`, and what must stand, or not stand, beside it."""

from __future__ import annotations

import math
from collections.abc import Container, Iterable, Mapping
from dataclasses import replace
from typing import Any

from flywheel.advice import show, told
from flywheel.reading.fields import Faults, as_table, child, items, read_fields, read_quantity
from flywheel.reading.places import Setting
from flywheel.reading.schema import KINDS, MOST_TURNS, SECTIONS, STROKE_EXCLUDE, STROKE_TYPES, TURN
from flywheel.scene import Mechanism, Stroke
from flywheel.units import QuantityError, parse_quantity

_SHORTEST = 1e-9  # of a stroke, as a share of the coordinates at its ends
_TOGGLE = "toggle-clamp"


def read_stroke(raw: Mapping[str, Any], faults: Faults) -> Stroke | None:
    """The stroke of a scene whose driver goes one way; None where it turns in cycles.

    Its numbers are NaN where they could not be read, so that the rest can be read against it all the same.
    """
    slides = driver_slides(raw)
    if "stroke" not in raw:
        if not slides:
            return None
        advice = "the mechanism's driver slides, so that there is no cycle: leave out [regime] and [flywheel]"
        faults.add("stroke", "nothing", "a table with from, to and speed", advice)
        return _unread(sliding=True)
    _check_beside(raw, faults)
    table = as_table(raw["stroke"], "stroke", faults)
    if table is None:
        return _unread(sliding=slides is not False)
    return _read(table, _has_length(table) if slides is None else slides, faults)


def driver_slides(raw: Mapping[str, Any]) -> bool | None:
    """Whether the scene's mechanism is driven by something that slides; None where that cannot be told.

    >>> driver_slides({"mechanism": {"type": "toggle-clamp"}}), driver_slides({"mechanism": {"type": "four-bar"}})
    (True, False)
    """
    tables = _mechanisms(raw)
    table = tables[0] if len(tables) == 1 else None
    if not isinstance(table, Mapping) or not isinstance(table.get("type"), str | None):
        return None
    if table.get("type") != "linkage":
        return table.get("type") == _TOGGLE
    joints = [joint for joint in items(table.get("joints")) or [] if isinstance(joint, Mapping)]
    kinds = [joint.get("type") for joint in joints if _same(joint.get("name"), table.get("driver"))]
    return kinds[0] == "slide" if kinds and isinstance(kinds[0], str) and kinds[0] in ("slide", "pin") else None


def _same(name: Any, other: Any) -> bool:
    """Whether both are the same text: from Python a scene may hold anything, NumPy's arrays too."""
    return isinstance(name, str) and isinstance(other, str) and name == other


def _mechanisms(raw: Mapping[str, Any]) -> list[Any]:
    mechanism = raw.get("mechanism")
    return [mechanism] if isinstance(mechanism, Mapping) else items(mechanism) or []


def _has_length(table: Mapping[str, Any]) -> bool:
    """Whether a stroke's ends are lengths, where the mechanism does not tell."""
    try:
        parse_quantity(table.get("to"), "angle")
    except QuantityError:
        return True
    return False


def _unread(sliding: bool) -> Stroke:
    return Stroke(math.nan, math.nan, math.nan, math.nan, sliding)


def _read(table: Mapping[str, Any], sliding: bool, faults: Faults) -> Stroke:
    keys = SECTIONS["stroke"].keys
    fields = read_fields(table, keys, "stroke", faults)
    values = []
    for key in keys:
        dimension, value = key.kind.split(" | ")[not sliding], fields[key.name]
        number = None if value is None else read_quantity(value, dimension, key, f"stroke.{key.name}", faults)
        values.append(math.nan if number is None else number)
    stroke = Stroke(values[0], values[1], values[2], values[3], sliding)
    is_read = not any(map(math.isnan, values)) and _is_stroke(stroke.start, stroke.end, sliding, faults)
    return stroke if is_read else _unread(sliding)


def _is_stroke(start: float, end: float, sliding: bool, faults: Faults) -> bool:
    """Whether the end lies beyond the beginning, and not out of reach."""
    if end - start <= _SHORTEST * max(abs(start), abs(end)):
        found, ends = told(end, sliding), f"more than from, which is {told(start, sliding)}"
        faults.add("stroke.to", found, ends, "a return stroke has the same ends and a negative speed")
        return False
    if not sliding and end - start > MOST_TURNS * TURN:
        faults.add("stroke.to", f"{(end - start) / TURN:.6g} turns", f"at most {MOST_TURNS}")
        return False
    return True


def _check_beside(raw: Mapping[str, Any], faults: Faults) -> None:
    """A stroke has no cycle, and belongs to one mechanism."""
    for name in STROKE_EXCLUDE:
        if name in raw:
            faults.add(name, f"{name} beside [stroke]", "none", "a one-way stroke has no cycle, and so no flywheel")
    tables = _mechanisms(raw)
    if "mechanism" not in raw or (len(tables) != 1 and isinstance(raw["mechanism"], (list, tuple))):
        found = f"{len(tables)} mechanisms" if tables else "nothing"
        faults.add("mechanism", found, "one mechanism, whose driver makes the stroke")
    elif tables and isinstance(tables[0], Mapping):
        _check_mechanism(tables[0], "mechanism" if isinstance(raw["mechanism"], Mapping) else "mechanism[0]", faults)


def _check_mechanism(table: Mapping[str, Any], path: str, faults: Faults) -> None:
    kind = table.get("type")
    if isinstance(kind, str) and kind in KINDS and kind not in STROKE_TYPES:
        expected = " or ".join(f'"{name}"' for name in STROKE_TYPES)
        advice = "for a crank that turns in cycles give [regime] and [flywheel] instead of [stroke]"
        faults.add(f"{path}.type", f"{show(kind)} beside [stroke]", expected, advice)
    for name in ("phase", "shaft"):
        if name in table:
            advice = "the stroke is that of the mechanism's own driver"
            faults.add(child(path, name), f"{name} beside [stroke]", "none", advice)


def check_shafts(shafts: Iterable[str], twisting: Container[str], sliding: bool, faults: Faults) -> None:
    """Nothing is geared to a slide, and no shaft twists along a stroke."""
    for name in shafts:
        if sliding:
            faults.add(child("shafts", name), "a shaft beside a driver that slides", "none", "nothing can be geared to it")
        elif name in twisting:
            faults.add(child("shafts", name), "a compliant shaft beside [stroke]", "a rigid one", "leave stiffness out")


def check_known(unknowns: list[str], stroke: Stroke, faults: Faults) -> None:
    """Nothing can be balanced where there is no cycle."""
    advice = "a one-way stroke has no cycle to balance; flywheel reduce gives the driving action that it needs"
    for name in unknowns:
        drive = "drive.force" if stroke.sliding else "drive.torque"
        faults.add(drive if name == "drive" else child("parameters", name), '"balance"', "a value", advice)


def on_stroke(mechanism: Mechanism, setting: Setting) -> Mechanism | None:
    """The mechanism with its driver's stroke, where its coordinate begins; None where the stroke could not be read."""
    stroke = setting.stroke
    if stroke is None:
        return mechanism
    if setting.cycle is None:
        return None
    return replace(
        mechanism,
        shaft=stroke.element,
        phase=stroke.start,
        period=stroke.span if stroke.sliding else TURN,
        travel=stroke.span,
        stroke=(stroke.start, stroke.end),
    )
