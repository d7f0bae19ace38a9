"""The drive's motor, `[drive] motor = {type = ..., ...}`: read by the keys of its type, and built."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

from flywheel.components.motors import (
    DC,
    Constant,
    Curve,
    Engine,
    Induction,
    Line,
    Motor,
    Point,
    dc_from_plate,
    line_from_no_load,
    line_through,
)
from flywheel.numerics.faults import SceneError
from flywheel.numerics.units import LARGEST, QuantityError, Unit, convert
from flywheel.reading.fields import Fields, Item, Setting, as_table, exactly_one, read_item, read_typed, read_unit
from flywheel.reading.schema import CURVE, LINES, MOTOR_TYPE, MOTORS
from flywheel.reading.tables import given_columns

Made = TypeVar("Made", bound=Motor)


def read_motor(raw: object, path: str, setting: Setting) -> Motor | None:
    """The motor of a table; None after noting faults.

    Whatever a motor itself finds wrong with its values stands at the path of their keys.
    """
    before = len(setting.faults)
    item = read_typed(raw, MOTOR_TYPE, MOTORS, path, setting.faults)
    if item is None or len(setting.faults) > before:
        return None
    return _motor(_READERS[item.section.name], item, setting.folder)


def _motor(reader: Callable[[Item, Path | None], Made | None], item: Item, folder: Path | None) -> Made | None:
    """A motor, with its own faults put where the scene has the values."""
    try:
        return reader(item, folder)
    except SceneError as error:
        item.faults.extend(fault._replace(path=f"{item.path}.{fault.path}") for fault in error.faults)
        return None


def _constant(item: Item, _: Path | None) -> Motor:
    return Constant(value=item.fields["torque"], inertia=item.fields["inertia"])


def _line(item: Item, _: Path | None) -> Motor | None:
    """A line by its start and slope, by both of its ends, or by no-load speed and a rated point."""
    fields, inertia = item.fields, item.fields["inertia"]
    given = set(item.given("starting_torque", "slope", "no_load_speed", "speed", "torque", "power"))
    if given not in map(set, LINES):
        expected = (
            "; or ".join(" and ".join(names) for names in LINES[:2]) + "; or no_load_speed and speed and torque or power"
        )
        item.faults.add(item.path, " and ".join(sorted(given)) or "no values", expected)
        return None
    if "slope" in given:
        return Line(at_rest=fields["starting_torque"], fall=fields["slope"], inertia=inertia)
    if "speed" in given:
        return line_through(fields["no_load_speed"], _rated(fields), inertia)
    return line_from_no_load(fields["no_load_speed"], fields["starting_torque"], inertia)


def _rated(fields: Fields) -> Point:
    """The rated point, by torque or power."""
    speed, torque = fields["speed"], fields.get("torque")
    return Point(speed, fields["power"] / speed if torque is None else torque)


def _table(item: Item, folder: Path | None) -> Curve | None:
    """A curve by its rows, in the scene itself or in a file."""
    before = len(item.faults)
    columns = given_columns(item, ("speed", "torque"), "no rows", folder)
    units = [read_unit(item, f"{name}_unit", name) for name in ("speed", "torque")]
    if columns is None or len(item.faults) > before:
        return None
    speeds, torques = (
        _converted(item, column, unit or Unit(), name)
        for column, unit, name in zip(columns, units, ("speed", "torque"), strict=True)
    )
    if len(item.faults) > before:
        return None
    return Curve(speeds=speeds, torques=torques, interpolation=item.fields["interpolation"], inertia=item.fields["inertia"])


def _converted(item: Item, column: Sequence[float | str], unit: Unit, name: str) -> tuple[float, ...]:
    """A column in SI, each number rounded once; what of it could be read, after noting a fault."""
    try:
        found = tuple(convert(number, unit) for number in column)
    except QuantityError as error:
        item.add(name, error.found, error.expected)
        return ()
    if max(map(abs, found), default=0.0) > LARGEST:
        item.add(name, "a number beyond all measure", f"at most {LARGEST:g} in SI")
    return found


_PLATE = ("power", "speed", "current", "efficiency", "armature_share")
_CONSTANTS = ("resistance", "constant", "friction")


def _dc(item: Item, _: Path | None) -> Motor | None:
    """A DC motor by its constants, or by its name plate."""
    fields, plate, own = item.fields, item.given(*_PLATE), item.given(*_CONSTANTS)
    shared = {"inductance": fields["inductance"], "inertia": fields["inertia"]}
    if bool(plate) == bool(own):
        expected = "either resistance and constant, or power, speed and current (or efficiency)"
        item.faults.add(item.path, " and ".join((*own, *plate)) or "a voltage alone", expected)
        return None
    there = [item.needs(name) for name in (("resistance", "constant") if own else ("power", "speed"))]
    if not all(there):
        return None
    if own:
        return DC(**{name: fields[name] for name in ("voltage", *_CONSTANTS)}, **shared)
    pair = ("current", "efficiency")
    if not exactly_one(item.given(*pair), pair, item.path, item.faults):
        return None
    current = fields["current"] or fields["power"] / (fields["efficiency"] * fields["voltage"])
    return dc_from_plate(fields["voltage"], _rated(fields), current, fields["armature_share"], **shared)


def _induction(item: Item, _: Path | None) -> Motor:
    """An induction motor; of a bare speed the fault tells that it is in rad/s, although name plates have rpm."""
    names, bare = ("power", "speed", "frequency", "breakdown_ratio", "inertia"), item.raw["speed"]
    try:
        return Induction(poles=int(item.number("poles")), **{name: item.fields[name] for name in names})
    except SceneError as error:
        if isinstance(bare, str):
            raise
        advice = f'a bare number is in rad/s: write "{bare:g} rpm"'
        found = (fault._replace(advice=advice) if fault.path == "speed" else fault for fault in error.faults)
        raise SceneError(found) from None


def _engine(item: Item, folder: Path | None) -> Motor | None:
    """An engine by its rated point, or by its curve of full load."""
    full_load = _full_load(item, folder) if "full_load" in item.raw else _rated(item.fields).torque
    names = ("speed", "droop", "idle", "braking_torque", "inertia")
    return None if full_load is None else Engine(full_load=full_load, **{name: item.fields[name] for name in names})


def _full_load(item: Item, folder: Path | None) -> Curve | None:
    """The curve of full load; None after noting faults."""
    path, before = f"{item.path}.full_load", len(item.faults)
    table = as_table(item.raw["full_load"], path, item.faults)
    if table is None:
        return None
    curve = read_item(table, CURVE, path, item.faults)
    curve.fields["inertia"] = 0.0
    return _motor(_table, curve, folder) if len(item.faults) == before else None


_READERS: dict[str, Callable[[Item, Path | None], Motor | None]] = {
    "constant": _constant,
    "line": _line,
    "table": _table,
    "dc": _dc,
    "induction": _induction,
    "engine": _engine,
}
