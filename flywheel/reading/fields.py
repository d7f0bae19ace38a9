"""Reading of one table by its list of keys: values in SI, and a fault for every invalid entry."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from flywheel.mechanisms import KINDS
from flywheel.numerics.faults import Fault, SceneError, nearest, quote, show, suggestion
from flywheel.numerics.jets import is_recorded
from flywheel.numerics.units import (
    DIMENSIONS,
    QuantityError,
    Unit,
    parse_range,
    parse_unit,
    plain_number,
    split_quantity,
)
from flywheel.reading.schema import GD2, MOST_TABLES, NAME_PATTERN, SECTIONS, TOP, TURN, Section
from flywheel.scene.scene import Key, Mechanism, Stroke

Fields = dict[str, Any]
"""Values by key: SI floats, checked texts, raw values of the kinds that need their place; None: absent or faulty."""

_STANDARD = 9.80665  # m/s², of a weight
_LARGEST_SHARE = 10.0  # of a number that may be written in percent
_LEAST_PERCENT = 2.0  # below it a number is as likely a share that is too large
_ROUNDING = 1.0 + 1e-12
_ROUNDED = 1e-4  # share by which whole turns written with few digits miss them
REPORTED = 5
"""Number of items of a list, or rows of a file, that are noted one by one."""
_SUGGESTIONS = 50  # a text of a megabyte may hold ten thousand wrong names; the first ones get advice


class SceneQuantity(NamedTuple):
    """A quantity as a scene writes it, its SI value, and its key."""

    value: object
    number: float
    dimension: str
    many_turns: bool


class Faults(list[Fault]):
    """The faults so far, and the quantities read, by their paths, for remarks.

    `longest` is the greatest angle (rad) without a unit: a turn, or the cycle. `meant` has the paths of
    keys that the advice on unknown keys names.
    """

    def __init__(self) -> None:
        super().__init__()
        self.longest = TURN
        self.quantities: dict[str, SceneQuantity] = {}
        self.meant = set[str]()

    def add(self, path: str, defect: str, expected: str, advice: str = "") -> None:
        """Notes one more fault."""
        self.append(Fault(path, defect, expected, advice))

    @contextmanager
    def placed(self, table: str) -> Iterator[None]:
        """Notes the faults that a record of a table raises, at the table's path."""
        try:
            yield
        except SceneError as error:
            self.extend(fault.under(table) for fault in error.faults)

    def unknown(self, path: str, name: str, valid: Collection[str], what: str = "key") -> None:
        """Notes an unknown name, with the nearest known one, or the tables that have it."""
        few, table = len(self) < _SUGGESTIONS, path.rpartition(".")[0]
        advice, key = suggestion(name, valid) if few else "", nearest(name, valid) if few else ""
        if few and what == "type" and (near := next(iter(_TRADE.get(str(name), ())), "")) in valid:
            advice = f"did you mean {quote(near)}?"
        if what.startswith("key"):
            home, meant = _home(name, valid, table.rpartition(".")[2])
            advice, key = (home, meant) if home else (advice, key)
        self.add(path, f"{what} {quote(name)}", f"a known {what}", advice)
        if key.startswith("."):
            table, key = table.rpartition(".")[0], key[1:]
        if key:
            self.meant.add(f"{table}.{key}" if table else key)

    def error(self) -> SceneError:
        """All faults, without those of missing keys that the advice on an unknown key names."""
        return SceneError(fault for fault in self if not self._is_meant(fault))

    def _is_meant(self, fault: Fault) -> bool:
        """Tests whether a fault is that of a missing key that is present under another name."""
        if fault.defect == "nothing":
            return any(fault.path == key or fault.path.startswith(f"{key}.") for key in self.meant)
        one_of = re.findall(r"\w+", fault.defect) if fault.defect.startswith("none") else ()
        return any(child(fault.path, name) in self.meant for name in one_of)


_SLIDING = ("slider", "yoke", "ram", "platen")
_TRADE = {
    **dict.fromkeys(("frame", "ground", "fixed", "base", "bed", "fixed_link", "bancada"), ("ground", "frame")),
    **dict.fromkeys(
        ("rod", "conrod", "con_rod", "connecting_rod", "connecting_link", "link", "pitman", "coupler", "biela"),
        ("rod", "coupler"),
    ),
    **dict.fromkeys(
        ("piston", "plunger", "ram", "crosshead", "cross_head", "slide", "slider", "deslizadera", "corredera"), _SLIDING
    ),
    **dict.fromkeys(
        ("follower", "lever", "beam", "output", "output_link", "slotted_link", "rocker_arm", "balancin"), ("rocker",)
    ),
    **dict.fromkeys(("crankshaft", "crank_arm", "eccentric", "input", "input_link", "manivela"), ("crank",)),
    **dict.fromkeys(("throw", "radius", "r"), ("length",)),
    **dict.fromkeys(("inertia", "mass"), ("value",)),
    **dict.fromkeys(("j", "i", "moment_of_inertia"), ("value", "inertia")),
    **dict.fromkeys(("rpm", "n", "rotational_speed"), ("speed",)),
    **dict.fromkeys(("moment", "couple", "momento", "par"), ("torque",)),
    **dict.fromkeys(("crank-slider", "biela-manivela"), ("slider-crank",)),
    **dict.fromkeys(("crank-rocker", "four-bar-linkage", "cuatro-barras"), ("four-bar",)),
    **dict.fromkeys(("shaper", "quick-return", "whitworth"), ("crank-shaper",)),
    "yugo-escoces": ("scotch-yoke",),
    **dict.fromkeys(("delta", "cs", "fluctuation", "coefficient_of_fluctuation"), ("irregularity",)),
}
"""Other technical words for keys and types, with those that they may mean."""


def _home(name: str, valid: Collection[str], owner: str = "") -> tuple[str, str]:
    """Advice on an unknown key of a table, and the key that is meant; both empty if there is none.

    The key is that of the table, or after a point that of the table around it.

    >>> _home("conrod", ["crank", "rod"]), _home("throw", ["length", "mass"], "crank")
    (('did you mean rod?', 'rod'), ('did you mean length?', 'length'))
    >>> _home("crank_radius", ["rod", "crank"]), _home("speed", ["on"])
    (('did you mean crank.length?', 'crank.length'), ('speed is a key of [regime] or [stroke]', ''))
    >>> _home("title", ["on"])
    ('title stands at the top, above every heading', '')
    """
    word, mechanism = "_".join(name.replace("-", " ").lower().split()), "crank" in valid
    parts = {part.name: part for kind in KINDS.values() for part in kind.parts}
    here = [part for part in parts if part in valid]
    meant = _TRADE.get(word, ())
    if near := next((key for key in meant if key in valid and (key != "length" or owner == "crank")), ""):
        return f"did you mean {near}?", near
    if mechanism and meant == ("length",):
        return "did you mean crank.length?", "crank.length"
    if word in ("stroke", "diameter", "carrera") and (
        owner in ("crank", "slider", "yoke") or {"slider", "yoke"} & set(valid)
    ):
        key = "crank.length" if mechanism else ".crank.length"
        return "the stroke of an in-line mechanism is twice crank.length", key
    of, _, key = word.partition("_")
    keys = {key.name for key in parts[of].keys} if of in here else set()
    if near := next((f"{of}.{one}" for one in (key, *_TRADE.get(key, ())) if one in keys), ""):
        return f"did you mean {near}?", near
    if owners := [f"{part}.{name}" for part in here if name in (key.name for key in parts[part].keys)]:
        return f"{name} belongs to a part: {', '.join(owners)}", owners[0] if len(owners) == 1 else ""
    if any(name == key.name for key in TOP):
        return f"{name} stands at the top, above every heading", ""
    kinds = [
        kind.name for kind in KINDS.values() if name in {*(part.name for part in kind.parts), *(k.name for k in kind.keys)}
    ]
    if mechanism and kinds:
        return f"{name} belongs to type {' or '.join(kinds)}", ""
    if owner in parts and name == "stroke":
        return "", ""
    if name in SECTIONS:
        return f"{name} is a table of its own: write {heading(name)}", ""
    if owner == "drive" and name in ("type", "poles", "frequency", "voltage", "current", "slip"):
        return f"{name} is a key of [drive.motor]", ""
    tables = [heading(section.name) for section in SECTIONS.values() if any(name == key.name for key in section.keys)]
    if kinds:
        tables = [heading("mechanism")]
    return f"{name} is a key of {' or '.join(tables)}" if tables else "", ""


def heading(name: str) -> str:
    """Heading of a table as it is written in TOML.

    >>> heading("regime"), heading("load"), heading("mechanism")
    ('[regime]', '[[load]]', '[mechanism]')
    """
    return f"[[{name}]]" if SECTIONS[name].array and name != "mechanism" else f"[{name}]"


def as_table(raw: object, path: str, faults: Faults) -> Mapping[str, Any] | None:
    """A TOML table as a mapping with a limited number of text keys; anything else is a fault."""
    if isinstance(raw, Mapping) and len(raw) > MOST_TABLES:
        faults.add(path, f"a table of {len(raw)} keys", f"at most {MOST_TABLES}")
        return None
    if isinstance(raw, Mapping) and all(isinstance(key, str) for key in raw):
        return raw
    advice = f"write [{path}] once" if isinstance(raw, list) and raw and isinstance(raw[0], Mapping) else ""
    defect = "a table with keys that are no texts" if isinstance(raw, Mapping) else show(raw)
    faults.add(path, defect, "a table", advice)
    return None


def child(path: str, name: str) -> str:
    """Path of a key; a key that is no plain word is quoted."""
    plain = name if re.fullmatch(r"[\w-]+", name) and len(name) <= 64 else quote(name)
    return f"{path}.{plain}" if path else plain


class Item(NamedTuple):
    """One table: as written, its values by key, its place, the faults so far, its list of keys.

    `before` is the number of faults before its reading.
    """

    raw: Mapping[str, Any]
    fields: Fields
    path: str
    faults: Faults
    section: Section
    before: int

    @property
    def clean(self) -> bool:
        """True if no fault was noted since its reading began."""
        return len(self.faults) == self.before

    def add(self, key: str, defect: str, expected: str, advice: str = "") -> None:
        """Notes a fault of one key."""
        self.faults.add(child(self.path, key), defect, expected, advice)

    def present(self, *names: str) -> list[str]:
        """The keys of `names` that are present."""
        return [name for name in names if name in self.raw]

    def one(self, *names: str) -> str:
        """The one of some keys that is present; empty if none or several are."""
        present = [name for name in names if name in self.raw]
        return present[0] if len(present) == 1 else ""

    def without(self, names: Iterable[str], because: str, advice: str = "") -> None:
        """Notes those of some keys that are not allowed here."""
        for name in self.present(*names):
            self.add(name, f"{name} {because}", "none", advice)

    def needs(self, name: str, because: str = "") -> bool:
        """Checks that a key is present; notes a fault otherwise."""
        if name not in self.raw:
            key = next(key for key in self.section.keys if key.name == name)
            self.add(name, "nothing", expectation(key), because)
        return name in self.raw

    def number(self, name: str) -> float:
        """A number; NaN if it has a fault, or is missing."""
        value = self.fields[name]
        return math.nan if value is None else value


def read_item(raw: Mapping[str, Any], section: Section, path: str, faults: Faults, rotating: bool | None = None) -> Item:
    """A table by its section: the values of its keys, and exactly one of those that exclude each other.

    rotating: true if its place rotates, which decides between two dimensions; None if unknown.
    """
    before = len(faults)
    item = Item(raw, read_fields(raw, section.keys, path, faults, rotating), path, faults, section, before)
    for group in section.one_of:
        present = [name for name in group if name in raw]
        if len(present) != 1:
            exactly_one(present, group, path, faults)
    return item


def read_fields(
    raw: Mapping[str, Any], keys: Sequence[Key], path: str, faults: Faults, rotating: bool | None = None
) -> Fields:
    """Every key of a table by its list, with its value or its default; unknown, missing and wrong ones are noted.

    The value is None if it is at fault, and unchanged if its reading needs its place or other tables.
    """
    by_name = {key.name: key for key in keys}
    for name in raw:
        if name not in by_name:
            faults.unknown(child(path, name), name, by_name)
    fields: Fields = {}
    for name, key in by_name.items():
        where = f"{path}.{name}" if path else name
        fields[name] = _value(raw[name], key, where, faults, rotating) if name in raw else key.default
        if key.required and name not in raw:
            faults.add(where, "nothing", expectation(key), key.missing)
    return fields


def _value(value: Any, key: Key, path: str, faults: Faults, rotating: bool | None) -> Any:
    """One key's value by its kind; None after noting a fault."""
    if key.name == GD2.name:
        return read_gd2(value, path, faults)
    if " | " in key.kind:
        return None if rotating is None else read_quantity(value, key.kind.split(" | ")[rotating], key, path, faults)
    if key.kind in DIMENSIONS:
        return read_quantity(value, key.kind, key, path, faults)
    if key.kind == "numbers":
        return read_numbers(value, path, faults)
    if key.kind == "flag" and not isinstance(value, bool):
        faults.add(path, show(value), "true or false")
        return None
    if key.kind not in ("text", "name", "choice"):
        return value
    if not isinstance(value, str):
        faults.add(path, show(value), expectation(key))
        return None
    if key.kind == "choice" and value not in key.choices:
        near = nearest(value, key.choices)
        faults.add(path, show(value), expectation(key), f'did you mean "{near}"?' if near else "")
        return None
    return None if key.kind == "name" and not check_name(value, path, faults) else str(value)


def read_typed(
    raw: object, key: Key, kinds: Mapping[str, Section], path: str, faults: Faults, rotating: bool | None = None
) -> Item | None:
    """A table whose keys follow from its type, the value of `key`; None for an unknown type."""
    if isinstance(raw, str):
        name, near = path.rpartition(".")[2], nearest(raw, kinds) or next(iter(kinds))
        topic = "load-models" if name == "model" else name
        advice = f'write {name} = {{{key.name} = "{near}", ...}}; see flywheel reference {topic}'
        faults.add(path, show(raw), "a table", advice)
        return None
    table = as_table(raw, path, faults)
    if table is None:
        return None
    kind = table.get(key.name)
    if not isinstance(kind, str) or kind not in kinds:
        read_fields({key.name: kind} if key.name in table else {}, (key,), path, faults)
        return None
    return read_item(table, kinds[kind], path, faults, rotating)


def read_numbers(raw: object, path: str, faults: Faults) -> list[float] | None:
    """A list of finite numbers; None after noting its faults, those of the first few items."""
    numbers = items(raw)
    if numbers is None:
        faults.add(path, show(raw), "a list of numbers")
        return None
    plain = [plain_number(item) for item in numbers]
    wrong = [i for i, number in enumerate(plain) if number is None or not abs(number) < math.inf]
    for i in wrong[:REPORTED]:
        faults.add(f"{path}[{i}]", show(numbers[i]), "a finite number")
    if len(wrong) > REPORTED:
        faults.add(path, f"{len(wrong) - REPORTED} more like these", "finite numbers")
    return None if wrong else [number for number in plain if number is not None]


def read_unit(item: Item, name: str, dimension: str | None) -> Unit | None:
    """The unit of a column; the SI unit if none is named, None after noting a fault."""
    text = item.fields[name]
    if text is None:
        return Unit()
    if not isinstance(text, str):
        item.add(name, show(text), "a text that names a unit")
        return None
    try:
        return parse_unit(text, dimension)
    except QuantityError as error:
        item.add(name, error.defect, error.expected, error.advice)
        return None


def read_quantity(value: object, dimension: str, key: Key, path: str, faults: Faults) -> float | None:
    """A quantity within its key's range; None after noting a fault."""
    try:
        number = parse_range(value, dimension)
    except QuantityError as error:
        expected = error.expected.replace(DIMENSIONS[dimension].expected, _quantity(dimension, key))
        is_balance = isinstance(value, str) and value.strip().lower() == "balance"
        advice = "the balance is that of [drive] torque, or of a parameter" if is_balance else error.advice
        faults.add(path, error.defect, expected, advice)
        return None
    written = isinstance(value, str) or is_recorded(value)
    if dimension == "angle" and not key.many_turns and not written and abs(number) > faults.longest * _ROUNDING:
        most = "one turn" if faults.longest == TURN else "the cycle"
        form = f'an angle with its unit such as "90 deg", or a bare number in rad of at most {faults.longest:.6g}, {most}'
        turns = round(
            abs(number) / TURN
        )  # one that passes a turn by its last digits alone, such as 6.2832, was meant in rad
        if abs(abs(number) / TURN - turns) < _ROUNDED * abs(number) / TURN:
            advice = f'write "{math.copysign(360 * turns, number):g} deg"'
        else:
            advice = f'write "{number:.10g} deg", or "{number:.10g} rad" if it is radians'
        faults.add(path, show(value), form, advice)
        return None
    if number not in key.range:
        unit = DIMENSIONS[dimension].si
        percent = key.kind == "number" and key.range.high <= _LARGEST_SHARE and number >= _LEAST_PERCENT
        percent = percent and not (isinstance(value, str) and "%" in value) and number / 100 in key.range
        advice = f'write "{number:g} %"' if percent else ""
        within = f"a value {key.range}{' ' + unit if unit else ''}"
        within = "an angle from 0 to 360 deg" if unit == "rad" and TURN <= key.range.high < 1.001 * TURN else within
        faults.add(path, show(value), within, advice)
        return None
    faults.quantities[path] = SceneQuantity(value, number, dimension, key.many_turns)
    return number


def _quantity(dimension: str, key: Key) -> str:
    """Description of the quantity expected, with the example that suits its key."""
    expected = DIMENSIONS[dimension]
    return expected._replace(example=key.example or expected.example).expected


def check_name(text: str, path: str, faults: Faults) -> bool:
    """Checks whether a text may name a shaft, mechanism, body or output; notes a fault otherwise."""
    good = len(text) <= 100 and re.fullmatch(NAME_PATTERN, text) is not None
    if not good:
        faults.add(path, quote(text), "a letter, then letters, digits, _ or -")
    return good


def expectation(key: Key) -> str:
    """Description, for a fault, of the value expected of a key."""
    if key.choices:
        return "one of " + ", ".join(f'"{choice}"' for choice in key.choices)
    if key.kind in DIMENSIONS:
        return _quantity(key.kind, key)
    if " | " in key.kind:
        return ", or ".join(_quantity(dimension, key) for dimension in key.kind.split(" | "))
    words = {"text": "a text", "name": "a text", "numbers": "a list of numbers", "tables": "a table of tables"}
    return words.get(key.kind, key.about)


def items(raw: object) -> list[Any] | None:
    """The items of a TOML array, a tuple or a one-dimensional NumPy array; None for anything else."""
    if isinstance(raw, np.ndarray):
        return list(raw.tolist()) if raw.ndim == 1 else None
    return list(raw) if isinstance(raw, (list, tuple)) else None


def exactly_one(present: Sequence[str], names: Sequence[str], path: str, faults: Faults) -> bool:
    """Checks that exactly one of some keys was given; notes a fault otherwise."""
    if len(present) == 1:
        return True
    defect = " and ".join(present) if present else f"none of {', '.join(names)}"
    faults.add(path, defect, f"exactly one of {', '.join(names)}")
    return False


TOLERANCE = 1e-9
"""Share of a period within which an angle counts as its end; of a count, within which it counts as an integer."""


class Setting(NamedTuple):
    """Context in which the parts of a scene are read.

    `cycle` is None while its own reading failed. `names` are the parameters that expressions may use, the unknown
    included; `parameters` holds those that have a value. `stroke` is set if the driver moves one way; its numbers are
    NaN, and `cycle` is None, where they could not be read.
    """

    cycle: float | None
    shafts: dict[str, float]
    parameters: Mapping[str, float]
    names: frozenset[str]
    folder: Path | None
    faults: Faults
    stroke: Stroke | None = None

    @property
    def sliding(self) -> bool:
        """True if the reduction element slides."""
        return self.stroke is not None and self.stroke.sliding


class Place(NamedTuple):
    """A shaft or a port, by its canonical name; `travel` (rad) of its loads' angle in a cycle.

    `travel` is None while it is not known; `returns` is False if the displacement gains a constant.
    """

    name: str
    rotating: bool
    travel: float | None
    returns: bool


class Places(NamedTuple):
    """Every place of a machine. `complete` is False if a faulty mechanism hides some of its ports."""

    shafts: dict[str, Place]
    ports: dict[str, Place]
    complete: bool = True
    mechanisms: tuple[Mechanism, ...] = ()

    def find(self, name: object, path: str, faults: Faults) -> Place | None:
        """The place that a text names: a shaft, `mechanism.port`, or a port's bare name where it is unique."""
        if not isinstance(name, str):
            return None
        bare = [port for port in self.ports.values() if port.name.rpartition(".")[2] == name]
        places = [table[name] for table in (self.shafts, self.ports) if name in table] + bare
        if len(places) == 1:
            return places[0]
        if places:
            names = " or ".join(quote(place.name) for place in places)
            faults.add(path, f"{quote(name)}, which may be {names}", "a place that is unique", "write the full name")
        elif self.complete:
            candidates = [*self.shafts, *self.ports]
            short = {port.rpartition(".")[2]: port for port in self.ports}
            word = next((word for word in _TRADE.get(name, ()) if word in short), name)
            faults.add(path, quote(name), "a shaft or a port", suggestion(word, candidates, short))
        return None

    def shaft(self, name: object, path: str, faults: Faults) -> str:
        """The shaft that a text names; the reduction element, after noting a fault, if it names none."""
        if isinstance(name, str) and name not in self.shafts:
            faults.add(path, quote(name), "a shaft", suggestion(name, self.shafts))
        return name if isinstance(name, str) and name in self.shafts else next(iter(self.shafts))


def whole(count: float) -> int | None:
    """The whole number, at least 1, to which a count is equal within 1e-9; None if there is none.

    >>> whole(3.0000000001), whole(2.5), whole(0.0)
    (3, None, None)
    """
    if not 0.5 <= count < math.inf:
        return None
    number = round(count)
    return number if abs(count - number) <= TOLERANCE * number else None


def default_period(travel: float, cycle: float) -> float | None:
    """The angle after which a load or a law repeats by default.

    It is the cycle if that divides the travel of the angle, else the travel if that divides the cycle.
    """
    if repeats := whole(travel / cycle):
        return travel / repeats
    return travel if whole(cycle / travel) else None


def read_gd2(value: object, path: str, faults: Faults) -> float | None:
    """The inertia (kg m²) of a GD²: J = GD²/4 of a mass times a square, GD²/(4 g) of a weight times a square.

    The two forms have the same number in kg m² and in kgf m², g being the 9.80665 m/s² of the kilogram-force.
    None after noting a fault.

    Source: technical system of units; G was the weight, D twice the radius of gyration.

    >>> read_gd2("48 kg m^2", "flywheel.gd2", Faults()), read_gd2("48 kgf m^2", "flywheel.gd2", Faults())
    (12.0, 12.0)
    """
    parts = split_quantity(value) if isinstance(value, str) else None
    is_weight = parts is not None and re.search("N|kgf|lbf", parts[1]) and "s" not in parts[1]
    try:
        quantity = parse_range(value, "moment of weight") / _STANDARD if is_weight else parse_range(value, "inertia")
    except QuantityError as error:
        expected = 'a GD² such as "48 kg m^2" or "48 kgf m^2", or a bare number in kg m^2'
        faults.add(path, error.defect, expected, error.advice)
        return None
    if quantity not in GD2.range:
        faults.add(path, show(value), f"a value {GD2.range} kg m^2")
        return None
    faults.quantities[path] = SceneQuantity(value, quantity, "inertia", False)
    return quantity / 4.0
