"""Edits of a form as edits of the text: what is typed into a field becomes a value of TOML at its place, whatever it is."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from contextlib import suppress
from typing import Any, NamedTuple

from flywheel.mechanisms import KINDS
from flywheel.numerics.faults import Fault, SceneError
from flywheel.numerics.units import QuantityError, parse_quantity, parse_unit, split_quantity
from flywheel.page.form import Field, Form, More, form_of
from flywheel.page.places import example_of, places_of
from flywheel.reading.loads import LOAD_MODELS
from flywheel.reading.motors import MOTORS
from flywheel.reading.scenes import LARGEST, parse_scene
from flywheel.reading.schema import COUPLING, COUPLING_KEYS, JOINT, JOINT_KEYS, MECHANISM, Section, keys_for
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
        """A change to another text."""
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
        """Gives a table another type: what fits stays, what does not goes, and what the new type needs is put in.

        Of what could stay as much stays as the reader takes: a value that fits a key may not fit the others.
        """
        typed = with_value(self.outline, place, quoted(kind, self._snippet(place)))
        above = place[:-1]
        made = [self._with_table(typed, above, beginning) for beginning in _beginnings(above, kind, typed.mapping)]
        if len(made) < 2:
            return made[0] if made else typed
        return min(made, key=lambda changed: _faults_within(changed, above))

    def _with_table(self, found: Outline, above: Path, beginning: Beginning) -> Outline:
        """The text with the keys of a table that a beginning keeps, and with those that it puts in."""
        for key in list(value_at(found.mapping, above)):
            if key not in beginning.keep:
                found = without(found, (*above, key))
        for path, value in beginning.begun.items():
            if value_at(found.mapping, path) is None:
                found = with_value(found, path, value)
        return found


class Beginning(NamedTuple):
    """A way to begin a table of another type: keys that stay, and values by their place if there is none."""

    keep: set[str]
    begun: dict[Path, str]


def _faults_within(changed: Outline, above: Path) -> int:
    """Counts the faults of a text at a table; a text that is read without any has none."""
    where = next((name for name, place in changed.places.items() if place == above), "")
    try:
        parse_scene(changed.text)
    except SceneError as error:
        return sum(fault.path == where or fault.path.startswith((f"{where}.", f"{where}[")) for fault in error.faults)
    return 0


def _known(place: Path | None) -> Path:
    if place is None:
        raise EditError("a place that is none")
    return place


# -- what is typed, in TOML ----------------------------------------------------------------------------------------------


def written_as(field: Field, typed: str, like: str = "") -> str:
    r"""TOML value of what is typed into a field; `like` is the value there now.

    A number alone, typed if there is a unit, is in that unit; if there is none, it is a number.

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
    """TOML value typed for a key or table that is added."""
    plain = typed.strip()
    if more.kind == "table":
        if plain.startswith("{") and _is_toml(plain):
            return plain
        return more.value
    return written_as(Field(more.path, "", "", more.kind, "", None), typed)


def _list(typed: str) -> str:
    """A list as TOML writes it; empty if the typed text is no list."""
    for text in (typed, f"[{typed}]"):
        if text.startswith("[") and _is_toml(text):
            return text
    return ""


def _is_toml(text: str) -> bool:
    """Tests whether a text is one value of TOML on one line."""
    if "\n" in text or "\r" in text:
        return False
    try:
        return set(tomllib.loads(f"value = {text}\nend = 0")) == {"value", "end"}
    except (ValueError, RecursionError):
        return False


# -- what a type needs -----------------------------------------------------------------------------------------------------

_TAKEN_BY = {"motor": MOTORS, "model": LOAD_MODELS}


def _beginnings(above: Path, kind: str, mapping: Mapping[str, Any]) -> list[Beginning]:
    """Initial contents of a table of a type, the one that keeps most first; none for an unknown type."""
    table = value_at(mapping, above)
    if above[-1] in _TAKEN_BY:
        section = _TAKEN_BY[str(above[-1])].get(kind)
        return [] if section is None else _of_section(above, section, table, mapping)
    for name, section, by_type in (("joints", JOINT, JOINT_KEYS), ("couplings", COUPLING, COUPLING_KEYS)):
        if name in above and kind in by_type:
            keep = {key.name for key in keys_for(section, by_type[kind])}
            lift = kind == "cam" and not {"lift", "table"} & table.keys()
            ratio = kind in ("gear", "rolling") and not {"ratio", "teeth"} & table.keys()
            begun = {"lift": '"0.01*(1 - cos(phi))"'} if lift else {"ratio": "1"} if ratio else {}
            return [Beginning(keep, {(*above, key): value for key, value in begun.items()})]
    if above[0] == "mechanism" and kind in KINDS and len(above) <= 2:
        return [_mechanism(above, kind, table, mapping)]
    return []


def _of_section(above: Path, section: Section, table: Mapping[str, Any], mapping: Mapping[str, Any]) -> list[Beginning]:
    """Initial contents of a motor, or of a load's model: with all values that fit, with the initial ones, with none."""
    rotating = places_of(mapping).rotates((value_at(mapping, above[:-1]) or {}).get("on")) is not False
    begun = {(*above, key): value for key, value in _begun(section.begin, rotating).items()}
    for key in section.keys:
        example = example_of(key) if key.required else None
        if example is not None:
            begun.setdefault((*above, key.name), literal(example))
    names = {key.name for key in section.keys}
    required = {(*above, key.name) for key in section.keys if key.required}
    least = {path: value for path, value in begun.items() if path in required}
    ways = [
        *([Beginning(names, least)] if (names & table.keys()) - {"type", "inertia"} else []),
        Beginning(names, begun),
        Beginning({"type", "inertia", *(str(path[-1]) for path in begun)}, begun),
        Beginning({"type", "inertia"}, begun),
    ]
    return [way for k, way in enumerate(ways) if way not in ways[:k]]


def _begun(values: Mapping[str, Any], rotating: bool) -> dict[str, str]:
    """Initial values, for a place that rotates or one that translates."""
    effort, value = ("torque", "1 N m") if rotating else ("force", "1 N")
    speed, at = ("speed", "100 rpm") if rotating else ("velocity", "1 m/s")
    names = {"EFFORT": effort, "SPEED": speed}
    given = {names.get(key, key): {"EFFORT": value, "SPEED": at}.get(key, item) for key, item in values.items()}
    return {key: literal(value if item == "EFFORT" else item) for key, item in given.items()}


def _mechanism(above: Path, kind: str, table: Mapping[str, Any], mapping: Mapping[str, Any]) -> Beginning:
    """A mechanism of a type; lengths that it lacks are those of its starter, in the crank's proportion."""
    family = KINDS[kind]
    keep = {*(key.name for key in (*MECHANISM.keys, *family.keys)), *(part.name_in(table) for part in family.parts)}
    scene, share = dict[str, Any](), 1.0
    with suppress(KeyError):
        scene = tomllib.loads(starter(kind))
    example = scene.get("mechanism", {})
    with suppress(QuantityError, KeyError, TypeError, ZeroDivisionError):
        share = parse_quantity(table["crank"]["length"], "length") / parse_quantity(example["crank"]["length"], "length")
    begun: dict[Path, str] = {}
    for part in family.parts:
        for key in part.keys:
            given = example.get(part.name, {}).get(key.name, None if scene else example_of(key))
            if key.required and given is not None:
                begun[(*above, part.name_in(table), key.name)] = literal(_scaled(given, key, share))
    for key in family.keys:
        if key.required and key.name in example:
            begun[(*above, key.name)] = literal(example[key.name])
    words = set(re.findall(r"\w+", " ".join(begun.values())))
    for name, value in scene.get("parameters", {}).items():  # that the starter's values speak of
        if name in words:
            begun["parameters", name] = literal(value)
    return Beginning(keep, begun)


def _scaled(given: object, key: Key, share: float) -> object:
    """A length in proportion, to three digits; anything else as it is."""
    parts = split_quantity(given) if isinstance(given, str) else None
    if key.kind != "length" or parts is None:
        return given
    return f"{float(f'{float(parts[0]) * share:.3g}'):.10g} {parts[1]}"
