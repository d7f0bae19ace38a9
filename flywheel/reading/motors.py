"""The drive's motor, `[drive] motor = {type = ..., ...}`: read by the keys of its type, and built."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from flywheel.components.motors import Motor, Point
from flywheel.numerics.faults import Fault, SceneError, show
from flywheel.numerics.units import LARGEST, QuantityError, Unit, convert, parse_unit
from flywheel.reading.fields import Faults, Fields, Setting, as_table, exactly_one, expectation, read_fields, read_typed
from flywheel.reading.schema import CURVE, MOTOR_TYPE, MOTORS
from flywheel.reading.tables import listed_numbers

if TYPE_CHECKING:
    from flywheel.components.motors import Curve

Made = TypeVar("Made", bound=Motor)


class Item(NamedTuple):
    """What a motor is read from: the table as written, its checked values, where it stands, and where files lie."""

    raw: Mapping[str, Any]
    fields: Fields
    path: str
    folder: Path | None
    faults: Faults

    def given(self, *names: str) -> list[str]:
        """Those of some keys that are there."""
        return [name for name in names if name in self.raw]


def read_motor(raw: object, path: str, setting: Setting) -> Motor | None:
    """The motor of a table; None after noting faults.

    Whatever a motor itself finds wrong with its values stands at the path of their keys.
    """
    faults = setting.faults
    before = len(faults)
    typed = read_typed(raw, MOTOR_TYPE, MOTORS, path, faults)
    if typed is None or len(faults) > before:
        return None
    kind, table, fields = typed
    return _built(_READERS[kind], Item(table, fields, path, setting.folder, faults))


def _built(build: Callable[[Item], Made | None], item: Item) -> Made | None:
    """A motor, with its own faults put where the scene has the values."""
    try:
        return build(item)
    except SceneError as error:
        item.faults.extend(fault._replace(path=f"{item.path}.{fault.path}") for fault in error.faults)
        return None


def _constant(item: Item) -> Motor:
    from flywheel.components.motors import Constant

    return Constant(value=item.fields["torque"], inertia=item.fields["inertia"])


_LINES = (("starting_torque", "slope"), ("no_load_speed", "starting_torque"), ("no_load_speed", "speed", "torque or power"))


def _line(item: Item) -> Motor | None:
    """A line by its start and slope, by both of its ends, or by no-load speed and a rated point."""
    from flywheel.components.motors import Line, line_from_no_load, line_through

    fields, inertia = item.fields, item.fields["inertia"]
    given = set(item.given("starting_torque", "slope", "no_load_speed", "speed", "torque", "power"))
    if given == set(_LINES[0]):
        return Line(at_rest=fields["starting_torque"], fall=fields["slope"], inertia=inertia)
    if given == set(_LINES[1]):
        return line_from_no_load(fields["no_load_speed"], fields["starting_torque"], inertia)
    if given in ({"no_load_speed", "speed", "torque"}, {"no_load_speed", "speed", "power"}):
        return line_through(fields["no_load_speed"], _rated(fields), inertia)
    expected = "; or ".join(" and ".join(names) for names in _LINES)
    item.faults.add(item.path, " and ".join(sorted(given)) or "no values", expected)
    return None


def _rated(fields: Fields) -> Point:
    """The rated point, by torque or power."""
    speed, torque = fields["speed"], fields.get("torque")
    return Point(speed, fields["power"] / speed if torque is None else torque)


def _table(item: Item) -> Curve | None:
    from flywheel.components.motors import Curve

    rows = _rows(item)
    if rows is None:
        return None
    return Curve(speeds=rows[0], torques=rows[1], interpolation=item.fields["interpolation"], inertia=item.fields["inertia"])


def _rows(item: Item) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
    """Speeds and torques in SI; None after noting a fault."""
    before = len(item.faults)
    columns = _columns(item)
    units = [_unit(item, f"{name}_unit", name) for name in ("speed", "torque")]
    if columns is None or len(item.faults) > before:
        return None
    speeds, torques = (
        _converted(item, column, unit, name) for column, unit, name in zip(columns, units, ("speed", "torque"), strict=True)
    )
    return (speeds, torques) if len(item.faults) == before else None


def _columns(item: Item) -> Sequence[Sequence[float | str]] | None:
    """Speeds and torques as numbers or decimal texts, from the scene itself or from a file."""
    inline = item.given("speed", "torque")
    if "file" in item.raw and not inline:
        from flywheel.reading.tables import read_columns  # only scenes with a file pay for its reader

        return read_columns(item.raw["file"], item.raw.get("column"), item.folder, item.path, item.faults)
    if "file" in item.raw or "column" in item.raw or len(inline) != 2:
        found = " and ".join(item.given("file", "column", "speed", "torque")) or "no rows"
        item.faults.add(item.path, found, "either file (and column), or speed and torque")
        return None
    columns = [listed_numbers(item.raw[name], f"{item.path}.{name}", item.faults) for name in inline]
    return None if None in columns else [column for column in columns if column is not None]


def _unit(item: Item, key: str, dimension: str) -> Unit:
    """The unit of a column; SI after noting a fault."""
    text, path = item.fields[key], f"{item.path}.{key}"
    if not isinstance(text, str):
        item.faults.add(path, show(text), "a text that names a unit")
        return Unit()
    try:
        return parse_unit(text, dimension)
    except QuantityError as error:
        item.faults.add(path, error.found, error.expected, error.advice)
        return Unit()


def _converted(item: Item, column: Sequence[float | str], unit: Unit, name: str) -> tuple[float, ...]:
    """A column in SI, each number rounded once; what of it could be read, after noting a fault."""
    path = f"{item.path}.{name}"
    try:
        found = tuple(convert(number, unit) for number in column)
    except QuantityError as error:
        item.faults.add(path, error.found, error.expected)
        return ()
    if max(map(abs, found), default=0.0) > LARGEST:
        item.faults.add(path, "a number beyond all measure", f"at most {LARGEST:g} in SI")
    return found


_PLATE = ("power", "speed", "current", "efficiency", "armature_share")
_CONSTANTS = ("resistance", "constant", "friction")


def _dc(item: Item) -> Motor | None:
    """A DC motor by its constants, or by its name plate."""
    from flywheel.components.motors import DC, dc_from_plate

    fields, faults, plate, own = item.fields, item.faults, item.given(*_PLATE), item.given(*_CONSTANTS)
    shared = {"inductance": fields["inductance"], "inertia": fields["inertia"]}
    if bool(plate) == bool(own):
        expected = "either resistance and constant, or power, speed and current (or efficiency)"
        faults.add(item.path, " and ".join((*own, *plate)) or "a voltage alone", expected)
    elif own and not _missing(item, ("resistance", "constant")):
        return DC(**{name: fields[name] for name in ("voltage", *_CONSTANTS)}, **shared)
    elif plate and not _missing(item, ("power", "speed")):
        pair = ("current", "efficiency")
        if exactly_one(item.given(*pair), pair, item.path, faults):
            current = fields["current"] or fields["power"] / (fields["efficiency"] * fields["voltage"])
            return dc_from_plate(fields["voltage"], _rated(fields), current, fields["armature_share"], **shared)
    return None


def _missing(item: Item, names: Sequence[str]) -> list[str]:
    """Those of some keys that are not there, each a fault."""
    missing = [name for name in names if name not in item.raw]
    for key in MOTORS[item.raw["type"]].keys:
        if key.name in missing:
            item.faults.add(f"{item.path}.{key.name}", "nothing", expectation(key))
    return missing


def _induction(item: Item) -> Motor:
    from flywheel.components.motors import Induction

    names = ("power", "speed", "frequency", "breakdown_ratio", "inertia")
    poles: float = item.fields["poles"]
    try:
        return Induction(poles=int(poles), **{name: item.fields[name] for name in names})
    except SceneError as error:
        raise SceneError([_with_unit(fault, item.raw["speed"]) for fault in error.faults]) from None


def _with_unit(fault: Fault, speed: object) -> Fault:
    """A fault of a bare speed, which is in rad/s although name plates have rpm."""
    if fault.path != "speed" or isinstance(speed, str):
        return fault
    return fault._replace(advice=f'a bare number is in rad/s: write "{speed:g} rpm"')


_FULL_LOADS = ("torque", "power", "full_load")


def _engine(item: Item) -> Motor | None:
    """An engine by its rated point, or by its curve of full load."""
    from flywheel.components.motors import Engine

    if not exactly_one(item.given(*_FULL_LOADS), _FULL_LOADS, item.path, item.faults):
        return None
    full_load = _full_load(item) if "full_load" in item.raw else _rated(item.fields).torque
    names = ("speed", "droop", "idle", "braking_torque", "inertia")
    return None if full_load is None else Engine(full_load=full_load, **{name: item.fields[name] for name in names})


def _full_load(item: Item) -> Curve | None:
    """The curve of full load; None after noting faults."""
    path, before = f"{item.path}.full_load", len(item.faults)
    table = as_table(item.raw["full_load"], path, item.faults)
    if table is None:
        return None
    fields = read_fields(table, CURVE.keys, path, item.faults)
    own = Item(table, {**fields, "inertia": 0.0}, path, item.folder, item.faults)
    return _built(_table, own) if len(item.faults) == before else None


_READERS: dict[str, Callable[[Item], Motor | None]] = {
    "constant": _constant,
    "line": _line,
    "table": _table,
    "dc": _dc,
    "induction": _induction,
    "engine": _engine,
}
