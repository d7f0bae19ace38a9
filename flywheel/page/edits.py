"""Edits of a form as edits of the text: what is typed into a field becomes a value of TOML at its place, whatever it is."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from flywheel.mechanisms import KINDS
from flywheel.numerics.faults import Fault
from flywheel.numerics.units import QuantityError, parse_quantity, parse_unit, split_quantity
from flywheel.page.form import Field, Form, More, form_of
from flywheel.page.places import places_of
from flywheel.reading.load_models import LOAD_MODELS
from flywheel.reading.motors import MOTORS
from flywheel.reading.scenes import LARGEST
from flywheel.reading.schema import COUPLING, COUPLING_KEYS, JOINT, JOINT_KEYS, MECHANISM, keys_for
from flywheel.reading.toml_edits import EditError, literal, quoted, value_at, with_value, without
from flywheel.reading.toml_text import Outline, Path, outline
from flywheel.scene.keys import Key
from flywheel.starters import starter

_NUMBER = re.compile(r"[+-]?(?:0|[1-9][0-9]*)(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?")
MOST_EDITS = 1000


class Draft:
    """A text that is being edited, its outline and its form."""

    def __init__(self, text: str, known: Draft | None = None) -> None:
        self.outline: Outline = outline(text) if known is None else known.outline
        self.faults: list[Fault] = []
        self._form: Form | None = None if known is None else known.form

    @property
    def form(self) -> Form:
        """The form of the text as it stands."""
        if self._form is None:
            self._form = form_of(self.outline)
        return self._form

    def change(self, found: Outline) -> None:
        """Another text."""
        if found.text != self.outline.text:
            self.outline, self._form = found, None

    def edit(self, path: str, value: str | None, unit: str | None = None) -> None:
        """One edit: another value of a field, a unit into which it is converted, a key or table more, or (None) less.

        What cannot be written at its place is noted as a fault, and the text stays.
        """
        try:
            if unit is not None and value is None:
                value = self._converted(path, unit)
            changed = self._edited(path, value)
            if len(changed.text) > LARGEST:
                raise EditError("a text of more than 1 MiB")
            self.change(changed)
        except EditError as error:
            self.faults.append(Fault(path, str(error), "a value that can be changed in the form", "change it in the text"))

    def _edited(self, path: str, value: str | None) -> Outline:
        place = self.outline.places.get(path)
        if value is None:
            if place is None:
                raise EditError("nothing to take away")
            return without(self.outline, place)
        field = self.form.field(path)
        if field is not None and field.written is not None:
            if value == field.value:
                return self.outline
            if place is not None and place[-1] == "type":
                return self._of_type(place, value)
            return with_value(self.outline, _known(place), written_as(field, value, self._snippet(place)))
        more = self.form.addition(path)
        new = self._new_place(path)
        if field is not None:
            return with_value(self.outline, new, written_as(field, value))
        if more is None:
            raise EditError("a key that cannot be added here")
        return self._with_more(new, more, value)

    def _snippet(self, place: Path | None) -> str:
        value = self.outline.values.get(place or ())
        return "" if value is None else self.outline.text[value.start : value.stop]

    def _new_place(self, path: str) -> Path:
        """The place of a path whose last part, or last parts, are not in the text yet."""
        above, part = path, ""
        parts: list[str | int] = []
        while above and above not in self.outline.places:
            if above.endswith("]"):
                above, _bracket, part = above.rpartition("[")
                if not part[:-1].isdigit():
                    raise EditError("a place that is none")
                parts.insert(0, int(part[:-1]))
            else:
                above, _dot, part = above.rpartition(".")
                parts.insert(0, part)
        return (*self.outline.places.get(above, ()), *parts)

    def _converted(self, path: str, unit: str) -> str:
        """A field's value in another unit, to ten digits."""
        field = self.form.field(path)
        if field is None or field.dimension is None or field.number is None:
            raise EditError("nothing that has a unit")
        if unit == field.unit:
            return field.value
        try:
            si = parse_quantity(field.written, field.dimension)
            scale = parse_unit(unit, field.dimension) if unit else None
        except QuantityError:
            raise EditError("a unit that does not fit") from None
        number = si if scale is None else si * scale.denominator / scale.numerator
        return f"{number:.10g} {unit}".strip()

    def _with_more(self, place: Path, more: More, value: str) -> Outline:
        """A key or a table more; what it takes the place of goes."""
        written = written_more(more, value)
        found = self.outline
        for name in more.instead:
            with suppress(EditError):
                found = without(found, (*place[:-1], name))
        return with_value(found, place, written)

    # -- another type

    def _of_type(self, place: Path, kind: str) -> Outline:
        """A table of another type: what fits is kept, what does not goes, and what the new type needs is put in."""
        found = with_value(self.outline, place, quoted(kind, self._snippet(place)))
        above = place[:-1]
        table = value_at(found.mapping, above)
        needed = _needed(above, kind, table, found.mapping)
        if needed is None:
            return found
        keep, begun = needed
        for key in [key for key in table if key not in keep]:
            found = without(found, (*above, key))
        for path, value in begun.items():
            if value_at(found.mapping, (*above, *path)) is None:
                found = with_value(found, (*above, *path), value)
        return found


def _known(place: Path | None) -> Path:
    if place is None:
        raise EditError("a place that is none")
    return place


# -- what is typed, in TOML ----------------------------------------------------------------------------------------------


def written_as(field: Field, typed: str, like: str = "") -> str:
    r"""What is typed into a field as a value of TOML, whatever it is; `like` is what stands there.

    A number alone, typed where there is a unit, is in that unit; where there is none, it is a number.

    >>> length = Field("a", "", "", "quantity", "80 mm", "80 mm", 80.0, "mm", ("mm",), "length")
    >>> [written_as(length, typed) for typed in ("90", "0.1 m", 'a"\nb')]
    ['"90 mm"', '"0.1 m"', '"a\\"\\nb"']
    """
    plain = typed.strip()
    if field.kind == "boolean" and plain in ("true", "false"):
        return plain
    if field.kind == "list" or isinstance(field.written, (list, dict)):
        return _list(plain) or quoted(typed)
    if field.kind in ("quantity", "number", "expression") and _NUMBER.fullmatch(plain):
        if isinstance(field.written, str) and field.unit and field.number is not None:
            return quoted(f"{plain} {field.unit}", like)
        return plain if _is_toml(plain) else quoted(plain, like)
    return quoted(typed if field.kind == "text" else plain, like)


def written_more(more: More, typed: str) -> str:
    """What is typed as the value of a key or table that is added."""
    plain = typed.strip()
    if more.kind == "table":
        if plain.startswith("{") and _is_toml(plain):
            return plain
        return more.value
    return written_as(Field(more.path, "", "", more.kind, "", None), typed)


def _list(typed: str) -> str:
    """A list as TOML writes it; empty where what is typed is none."""
    for text in (typed, f"[{typed}]"):
        if text.startswith("[") and _is_toml(text):
            return text
    return ""


def _is_toml(text: str) -> bool:
    """Whether a text is one value of TOML on one line."""
    if "\n" in text or "\r" in text:
        return False
    try:
        return set(tomllib.loads(f"value = {text}\nend = 0")) == {"value", "end"}
    except (ValueError, RecursionError):
        return False


# -- what a type needs -----------------------------------------------------------------------------------------------------

_MOTORS: dict[str, dict[str, Any]] = {
    "constant": {"torque": "40 N m"},
    "line": {"no_load_speed": "1500 rpm", "starting_torque": "100 N m"},
    "table": {"speed": [0, 100, 157], "torque": [50, 40, 0]},
    "dc": {"voltage": "220 V", "resistance": "0.5 ohm", "constant": "1.2 V s/rad"},
    "induction": {"power": "3 kW", "speed": "1415 rpm", "poles": 4, "frequency": "50 Hz", "breakdown_ratio": 2.5},
    "engine": {"speed": "1500 rpm", "power": "10 kW", "droop": "5 %"},
    "hydraulic": {
        "displacement": "160 cm^3",
        "flow": "240 l/min",
        "pressure": "140 bar",
        "volumetric_efficiency": 0.92,
        "mechanical_efficiency": 0.93,
    },
}
_MODELS: dict[str, dict[str, Any]] = {
    "constant": {"EFFORT": None},
    "fan": {"EFFORT": None, "SPEED": None},
    "pump": {"EFFORT": None, "SPEED": None},
    "losses": {"constant": "EFFORT"},
    "belt": {"tight": "600 N", "slack": "200 N", "radius": "200 mm"},
    "press": {"energy": "500 J", "thickness": "5 mm"},
    "punch": {"diameter": "20 mm", "thickness": "5 mm", "shear_strength": "300 MPa"},
    "indicator": {"bore": "80 mm", "position": [0, 1], "out": [1e5, 1e5], "back": [1e5, 1e5]},
    "compressor": {"bore": "80 mm", "clearance": 0.05, "suction": "1 bar", "discharge": "6 bar", "exponent": 1.3},
}
_TAKEN_BY = {"motor": (MOTORS, _MOTORS), "model": (LOAD_MODELS, _MODELS)}


def _needed(
    above: Path, kind: str, table: Mapping[str, Any], mapping: Mapping[str, Any]
) -> tuple[set[str], dict[Path, str]] | None:
    """The keys that a type of table has, and those that it must have, with values; None where there is no such type."""
    if above[-1] in _TAKEN_BY:
        kinds, values = _TAKEN_BY[str(above[-1])]
        if kind not in kinds:
            return None
        keep = {key.name for key in kinds[kind].keys}
        rotating = places_of(mapping).rotates((value_at(mapping, above[:-1]) or {}).get("on")) is not False
        begun = _begun(values[kind], rotating)
        fits = keep & table.keys() - {"type", "inertia"}
        required = {key.name for key in kinds[kind].keys if key.required}
        begun = {path: value for path, value in begun.items() if not fits or path[0] in required}
        if kinds[kind].either and not any(set(way) <= table.keys() for way in kinds[kind].either):
            keep, begun = {"type", "inertia"}, _begun(values[kind], rotating)
        return keep, begun
    for name, section, by_type in (("joints", JOINT, JOINT_KEYS), ("couplings", COUPLING, COUPLING_KEYS)):
        if name in above and kind in by_type:
            keep = {key.name for key in keys_for(section, by_type[kind])}
            lift = kind == "cam" and not {"lift", "table"} & table.keys()
            ratio = kind in ("gear", "rolling") and not {"ratio", "teeth"} & table.keys()
            begun = {("lift",): '"0.01*(1 - cos(phi))"'} if lift else {("ratio",): "1"} if ratio else {}
            return keep, begun
    if above[0] == "mechanism" and kind in KINDS and len(above) <= 2:
        return _mechanism(kind, table)
    return None


def _begun(values: Mapping[str, Any], rotating: bool) -> dict[Path, str]:
    """Values to begin with, for a place that rotates or one that does not."""
    effort, value = ("torque", "1 N m") if rotating else ("force", "1 N")
    speed, at = ("speed", "100 rpm") if rotating else ("velocity", "1 m/s")
    names = {"EFFORT": effort, "SPEED": speed}
    given = {names.get(key, key): {"EFFORT": value, "SPEED": at}.get(key, item) for key, item in values.items()}
    return {(key,): literal(value if item == "EFFORT" else item) for key, item in given.items()}


def _mechanism(kind: str, table: Mapping[str, Any]) -> tuple[set[str], dict[Path, str]]:
    """What a type of mechanism has; lengths that it lacks are those of its starter, in the crank's proportion."""
    family = KINDS[kind]
    keep = {*(key.name for key in (*MECHANISM.keys, *family.keys)), *(part.name for part in family.parts)}
    example = tomllib.loads(starter(kind))["mechanism"]
    share = 1.0
    with suppress(QuantityError, KeyError, TypeError, ZeroDivisionError):
        share = parse_quantity(table["crank"]["length"], "length") / parse_quantity(example["crank"]["length"], "length")
    begun: dict[Path, str] = {}
    for part in family.parts:
        for key in part.keys:
            given = example.get(part.name, {}).get(key.name)
            if key.required and given is not None:
                begun[part.name, key.name] = literal(_scaled(given, key, share))
    for key in family.keys:
        if key.required and key.name in example:
            begun[(key.name,)] = literal(example[key.name])
    return keep, begun


def _scaled(value: object, key: Key, share: float) -> object:
    """A length in proportion, to three digits; anything else as it is."""
    parts = split_quantity(value) if isinstance(value, str) else None
    if key.kind != "length" or parts is None:
        return value
    return f"{float(f'{float(parts[0]) * share:.3g}'):.10g} {parts[1]}"
