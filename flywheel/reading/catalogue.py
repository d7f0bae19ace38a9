"""A table of motors: from a CSV file to the motors of its rows, or to every fault in it with its line and column.

The columns are the keys of `[drive.motor]`, an induction motor where no column `type` says otherwise, with the unit in the
header or in every cell; in addition `name`, `price`, `currency` and `synchronous_speed`. Other columns are ignored. If a
key means another quantity in another type (`starting_torque`: N m of a line, a share of an induction motor's rated torque),
the row's type decides.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from flywheel.components.motors import Motor
from flywheel.numerics.faults import Fault, SceneError, nearest, quote
from flywheel.numerics.units import DIMENSIONS, QuantityError, parse_quantity, parse_unit
from flywheel.reading.fields import Faults, Setting
from flywheel.reading.motors import MOTORS, read_motor
from flywheel.reading.schema import TURN
from flywheel.reading.tables import is_utf16, lines_of, torn_number
from flywheel.scene.scene import Key

LARGEST = 4 * 2**20
MOST_MOTORS = 10_000
_OWN = ("name", "price", "currency", "synchronous_speed")
_HEAD = re.compile(r"(?P<name>[^(\[]*?)\s*(?:[(\[](?P<unit>[^)\]]*)[)\]])?\s*")
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_PRICE = re.compile(rf"\s*(?P<before>[^\d\s.+-]*)\s*(?P<number>{_NUMBER.pattern})\s*(?P<after>[^\d\s.+-]*)\s*")
_MAINS = (50.0, 60.0)
_SAME_SPEED = 1e-6  # share within which a synchronous speed is one of the mains'
_ROWS_OF_THEIR_OWN = ("table",)
_REPORTED = 20


class CatalogueMotor(NamedTuple):
    """A row: the motor's name, its `[drive.motor]`, its type, its price with currency, its line."""

    name: str
    table: Mapping[str, Any]
    motor: Motor
    price: float | None = None
    currency: str = ""
    line: int = 0


class Catalogue(NamedTuple):
    """The motors of a table in their order, its unused columns, the faults of rows left out, its file."""

    motors: tuple[CatalogueMotor, ...]
    unused: tuple[str, ...] = ()
    faults: tuple[Fault, ...] = ()
    file: str = ""


class _MotorColumn(NamedTuple):
    """A column: its name, its unit, and its key for each motor's type; none if it is unused."""

    name: str
    unit: str
    keys: Mapping[str, Key]

    def kinds(self, motor: str) -> tuple[str, ...]:
        """Kinds of value that the cells may have for a motor's type; those of other types if the type has no such key."""
        key_lists = [self.keys[motor]] if motor in self.keys else self.keys.values()
        return tuple(dict.fromkeys(key.kind for key in key_lists)) or ("speed",)


def read_catalogue(path: str | Path, *, skip_faulty: bool = False) -> Catalogue:
    """The motors of a CSV file.

    Args:
        path: of the file; its first line names the columns, separators are commas, semicolons or tabs.
        skip_faulty: true to leave faulty rows out, instead of refusing the whole table.

    Raises:
        SceneError: with every fault, each with line and column; always if the header is at fault.

    """
    file = Path(path)
    return parse_catalogue(_text(file), file.name, skip_faulty=skip_faulty)


def _text(file: Path) -> str:
    """The text of the file; a fault if it is empty."""
    advice, expected = 'save it as "CSV UTF-8"', "a table of motors as CSV in UTF-8"
    try:
        with file.open("rb") as stream:
            content = stream.read(LARGEST + 1)
        if len(content) > LARGEST:
            what = f"a file of more than {LARGEST >> 20} MiB"
        elif is_utf16(content):
            what = "a text in UTF-16"
        else:
            return content.decode("utf-8-sig")
    except FileNotFoundError:
        near = nearest(file.name, [other.name for other in file.parent.glob("*.csv")]) if file.parent.is_dir() else None
        what, advice = "no such file", f"did you mean {quote(near)}?" if near else ""
    except UnicodeDecodeError:
        what = "a file that is not UTF-8"
    except (OSError, ValueError) as error:
        what, advice = f"a file that cannot be read ({getattr(error, 'strerror', None) or 'its name'})", ""
    raise SceneError([Fault(file.name, what, expected, advice)])


def parse_catalogue(text: str, file: str = "catalogue", *, skip_faulty: bool = False) -> Catalogue:
    r"""The motors in the text of a CSV file, as `read_catalogue` gives them.

    >>> head = "name,power (kW),speed (rpm),poles,frequency (Hz),breakdown_ratio,price (EUR)"
    >>> catalogue = parse_catalogue(head + "\nA,1.5,1420,4,50,2.8,210\nB,2.2,1430,4,50,3,260")
    >>> [(motor.name, motor.motor.power, motor.price, motor.currency) for motor in catalogue.motors]
    [('A', 1500.0, 210.0, 'EUR'), ('B', 2200.0, 260.0, 'EUR')]
    """
    lines = lines_of(text)
    if len(lines) < 2:
        defect = "a header alone" if lines else "nothing"
        raise SceneError([Fault(file, defect, "a header and a row for each motor")])
    if len(lines) > MOST_MOTORS + 1:
        raise SceneError([Fault(file, f"{len(lines) - 1} motors", f"at most {MOST_MOTORS}")])
    (head, names), *rows = lines
    faults: list[Fault] = []
    columns = _columns(names, f"{file} line {head}", faults)
    if faults:
        raise SceneError(faults)
    motors, wrong = list[CatalogueMotor](), list[Fault]()
    for line, fields in rows:
        own: list[Fault] = []
        motor = _row(line, fields, columns, f"{file} line {line}", own)
        if motor is not None and any(motor.name == other.name for other in motors):
            first = next(other.line for other in motors if other.name == motor.name)
            own.append(Fault(f"{file} line {line}, name", quote(motor.name), "a unique name", f"line {first} has it"))
        if motor is not None and not own:
            motors.append(motor)
        wrong += own
    currencies = sorted({motor.currency for motor in motors if motor.price is not None})
    if len(currencies) > 1:
        defect = " and ".join(quote(each) if each else "none" for each in currencies)
        wrong.append(Fault(f"{file}, currency", defect, "one currency, as prices are compared", "convert them to one"))
    if wrong and (not skip_faulty or not motors or len(currencies) > 1):
        more = len(wrong) - _REPORTED
        rest = [Fault(file, f"{more} more faults like these", "a table without gaps")] if more > 0 else []
        raise SceneError([*wrong[:_REPORTED], *rest])
    unused = tuple(column.name for column in columns if not column.keys and column.name not in _OWN)
    return Catalogue(tuple(motors), unused, tuple(wrong), file)


# -- the header --------------------------------------------------------------------------------------------------------


def _columns(fields: Sequence[str], where: str, faults: list[Fault]) -> list[_MotorColumn]:
    """The columns of a header: their names as keys are written, and their units."""
    typed = any(_plain(field) == "type" for field in fields)
    types = [name for name in MOTORS if name not in _ROWS_OF_THEIR_OWN] if typed else ["induction"]
    by_name: dict[str, dict[str, Key]] = {}
    for motor in types:
        for key in MOTORS[motor].keys:
            if key.kind in DIMENSIONS or (key.kind == "choice" and (key.name != "type" or typed)):
                by_name.setdefault(key.name, {})[motor] = key
    columns: list[_MotorColumn] = []
    absent = [name for name in (*by_name, *_OWN) if name not in map(_plain, fields)]
    for field in fields:
        match = _HEAD.fullmatch(field)
        name, unit = (_plain(match["name"]), match["unit"] or "") if match else (_plain(field), "")
        keys = by_name.get(name, {})
        path = f"{where}, column {quote(field)}"
        if not name:
            faults.append(Fault(path, "no name", "the name of a column"))
        elif name in (column.name for column in columns):
            faults.append(Fault(path, f"a second column {name}", "one"))
        elif not keys and name not in _OWN and (near := nearest(name, absent)):
            faults.append(Fault(path, "an unknown column", "a known one", f'did you mean "{near}"?'))
        elif unit:
            faults += _unit_faults(unit, {key.kind for key in keys.values() if key.kind in DIMENSIONS}, path)
        columns.append(_MotorColumn(name, unit, keys))
    names = [column.name for column in columns]
    needed = ["name", *([] if typed else ["power", "speed", "breakdown_ratio"])]
    faults += [Fault(where, f"no column {name}", _expected(name, by_name)) for name in needed if name not in names]
    if not typed and "synchronous_speed" not in names:
        missing = [name for name in ("poles", "frequency") if name not in names]
        if missing:
            defect = f"no column {' and none '.join(missing)}"
            faults.append(Fault(where, defect, "poles and frequency, or synchronous_speed"))
    return columns


def _unit_faults(unit: str, kinds: Iterable[str], path: str) -> list[Fault]:
    """Faults of a column's unit that belongs to none of the quantities the column may hold."""
    faults = []
    for kind in kinds:
        try:
            parse_unit(unit, kind)
        except QuantityError as error:
            faults.append(Fault(path, error.defect, error.expected, error.advice))
        else:
            return []
    return faults[:1]


def _expected(name: str, keys: Mapping[str, Mapping[str, Key]]) -> str:
    key = next(iter(keys.get(name, {}).values()), None)
    if key is None or key.kind not in DIMENSIONS or not DIMENSIONS[key.kind].si:
        return f'"{name}" in the header'
    return f'"{name}" in the header, with its unit such as "{name} ({DIMENSIONS[key.kind].example.split(maxsplit=1)[-1]})"'


def _plain(field: str) -> str:
    """A column's name as a key: small letters, _ between words, no unit."""
    return re.sub(r"[\s\-]+", "_", field.partition("(")[0].partition("[")[0].strip().lower())


# -- the rows ----------------------------------------------------------------------------------------------------------


def _row(
    number: int, cells: Sequence[str], columns: Sequence[_MotorColumn], where: str, faults: list[Fault]
) -> CatalogueMotor | None:
    """The motor of a row; None after noting its faults."""
    if len(cells) != len(columns):
        torn = torn_number(cells)
        advice = "write 1.5, not 1,5, or put a semicolon between columns" if torn or len(cells) > len(columns) else ""
        faults.append(Fault(where, f"{len(cells)} cells", f"{len(columns)}, as the header has columns", advice))
        return None
    by_column = {column.name: cell for column, cell in zip(columns, cells, strict=True)}
    name = by_column.get("name", "").strip()
    if not name:
        faults.append(Fault(f"{where}, name", "an empty cell", "the motor's name"))
    at = {column.name: f"{where}, {column.name}" for column in columns}
    table: dict[str, Any] = {"type": by_column.get("type", "").strip() or "induction"}
    if table["type"] in _ROWS_OF_THEIR_OWN:
        advice = 'give two points of it as a line, or size the scene with [drive] motor = {type = "table", ...}'
        faults.append(Fault(at["type"], quote(table["type"]), "a motor whose data have a cell each", advice))
        return None
    for column, cell in zip(columns, cells, strict=True):
        if (column.keys and column.name != "type") or column.name == "synchronous_speed":
            value = _cell(cell, column, table["type"], at[column.name], faults)
            if value is not None:
                table[column.name] = value
    before = len(faults)
    if "synchronous_speed" in table:
        _field(table, at["synchronous_speed"], faults)
    price, currency = _price(by_column, columns, at, faults)
    noted = Faults()
    motor = None if len(faults) > before else read_motor(table, "motor", Setting(TURN, {}, {}, frozenset(), None, noted))
    paths = {fault.path for fault in faults}
    for fault in noted:
        key = fault.path.removeprefix("motor").lstrip(".")
        path = at.get(key, f"{where}, {key}" if key else where)
        if path not in paths and (key or not faults):  # what a row lacks may be in a cell at fault
            empty = key in by_column and not by_column[key].strip()
            faults.append(fault._replace(path=path, defect="an empty cell" if empty else fault.defect))
    if faults or motor is None:
        return None
    return CatalogueMotor(name, table, motor, price, currency, number)


def _cell(cell: str, column: _MotorColumn, motor: str, path: str, faults: list[Fault]) -> Any:
    """The value of a cell as in a scene; None if it is empty, or after noting a fault."""
    text, unit = cell.strip(), column.unit
    if not text:
        return None
    kind = column.kinds(motor)[0]
    if kind == "choice":
        return text
    if torn_number([text]):
        faults.append(Fault(path, quote(text), "a number", "write 1.5, not 1,5"))
        return None
    if not _NUMBER.fullmatch(text):
        try:
            if unit:
                raise QuantityError(quote(text), f"a number in {unit}, as the header has it")
            return parse_quantity(text, kind)
        except QuantityError as error:
            faults.append(Fault(path, error.defect, error.expected, error.advice))
            return None
    if unit and kind in DIMENSIONS and (wrong := _unit_faults(unit, [kind], path)):
        advice = f"a column of {motor} motors holds another quantity: put units into the cells, not into the header"
        faults.append(wrong[0]._replace(defect=f"{text} {unit}", advice=advice))
        return None
    if kind == "number":
        return text if not unit else f"{text} {unit}"
    if not unit:
        example = DIMENSIONS[kind].example.split(maxsplit=1)[-1]
        advice = f'name it in the header, such as "{column.name} ({example})"'
        faults.append(Fault(path, f"{text} without a unit", "a unit in the header or in the cell", advice))
        return None
    return f"{text} {unit}"


def _field(table: dict[str, Any], path: str, faults: list[Fault]) -> None:
    """Poles and frequency of a motor whose synchronous speed is given, if they are missing."""
    value = table.pop("synchronous_speed")
    try:
        rpm = parse_quantity(value, "speed") * 60.0 / TURN
        mains = [parse_quantity(table["frequency"], "frequency")] if "frequency" in table else list(_MAINS)
    except QuantityError as error:
        faults.append(Fault(path, error.defect, error.expected, error.advice))
        return
    for frequency in mains:
        poles = 120.0 * frequency / rpm if rpm else 0.0
        own = "poles" not in table or abs(float(table["poles"]) - poles) <= _SAME_SPEED * poles
        if poles >= 2.0 - _SAME_SPEED and abs(poles / 2 - round(poles / 2)) <= _SAME_SPEED * poles and own:
            table["frequency"], table["poles"] = f"{frequency!r} Hz", 2 * round(poles / 2)
            return
    at = " or ".join(f"{each:g} Hz" for each in mains)
    addition = f", and of {table['poles']} poles" if "poles" in table else ""
    faults.append(
        Fault(path, f"{rpm:.6g} rpm", f"the speed of a field at {at}{addition}: 120 f over an even number of poles")
    )


def _price(
    table: Mapping[str, str], columns: Iterable[_MotorColumn], at: Mapping[str, str], faults: list[Fault]
) -> tuple[float | None, str]:
    """The price of a row and its currency: in a separate column, in the header, or in the cell."""
    text = table.get("price", "").strip()
    if not text:
        return None, ""
    match = _PRICE.fullmatch(text)
    if match is None or torn_number([text]):
        faults.append(Fault(at["price"], quote(text), "a price such as 450 or 450 EUR", "write 1250.50, not 1.250,50"))
        return None, ""
    unit = next(column.unit for column in columns if column.name == "price")
    own = table.get("currency", "").strip()
    currencies = list(dict.fromkeys(filter(None, (own, unit, match["before"], match["after"]))))
    if len(currencies) > 1:
        faults.append(Fault(at["price"], f"{text} in {' and '.join(currencies)}", "one currency"))
        return None, ""
    return float(match["number"]), currencies[0] if currencies else ""
