"""A scene's text as a form: every value with its unit, choices and slider, keys to add, and faults at their fields.

The form follows from the lists of keys by which scenes are read, so that it knows every key of the format and no other.
It shows a text as far as it can be read, and an edit of a field is an edit of the text at the place of its value.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cache
from typing import Any, NamedTuple

from flywheel.language import current
from flywheel.language import text as _
from flywheel.mechanisms import KINDS
from flywheel.numerics.faults import Fault
from flywheel.numerics.units import DIMENSIONS, QuantityError, parse_quantity, parse_unit, split_quantity
from flywheel.page.places import places_of
from flywheel.reading.fields import child
from flywheel.reading.loads import LOAD_MODELS
from flywheel.reading.motors import MOTORS, TABLES, leaves
from flywheel.reading.schema import (
    AREAS_EXCLUDE,
    COUPLING,
    COUPLING_KEYS,
    COUPLING_ONE_OF,
    FRAME_BODY,
    INNER,
    JOINT,
    JOINT_KEYS,
    LIMITS,
    LINK,
    MECHANISM,
    OUTPUT,
    POINT_PORT,
    SECTIONS,
    SIDE,
    SINGLE_STROKE_EXCLUDE,
    STROKE_EXCLUDE,
    TABLE,
    TOP,
    WHEEL_KEYS,
    Section,
    keys_for,
)
from flywheel.reading.toml_edits import literal
from flywheel.reading.toml_text import Outline
from flywheel.scene.scene import POSITIVE, Key

OFFERED = {
    "length": ("mm", "cm", "m", "in", "ft"),
    "angle": ("deg", "rad", "rev"),
    "mass": ("kg", "g", "t", "lb"),
    "time": ("s", "ms", "min", "h"),
    "inertia": ("kg m^2", "kg cm^2", "lb ft^2", "lbf in s^2"),
    "moment of weight": ("kgf m^2", "N m^2", "lbf ft^2"),
    "force": ("N", "kN", "MN", "kgf", "lbf"),
    "torque": ("N m", "kN m", "lbf ft", "lbf in"),
    "speed": ("rpm", "rad/s", "deg/s", "rev/s"),
    "velocity": ("m/s", "mm/s", "ft/s", "km/h"),
    "acceleration": ("m/s^2", "mm/s^2", "ft/s^2"),
    "angular acceleration": ("rad/s^2", "deg/s^2"),
    "energy": ("J", "kJ", "N m", "lbf ft"),
    "power": ("W", "kW", "hp", "CV"),
    "pressure": ("Pa", "kPa", "MPa", "bar", "psi"),
    "density": ("kg/m^3", "g/cm^3", "lb/in^3"),
    "area": ("mm^2", "cm^2", "m^2", "in^2"),
    "stiffness": ("N/m", "N/mm", "kN/m", "lbf/in"),
    "angular stiffness": ("N m/rad", "kN m/rad", "N m/deg"),
    "damping": ("N s/m", "kN s/m", "lbf s/in"),
    "angular damping": ("N m s/rad", "kN m s/rad"),
    "frequency": ("Hz", "kHz"),
    "rate": ("1/min", "1/s", "1/h"),
    "voltage": ("V", "kV", "mV"),
    "current": ("A", "mA", "kA"),
    "resistance": ("ohm", "mohm"),
    "inductance": ("H", "mH"),
    "motor constant": ("V s/rad", "N m/A"),
    "drag": ("N s^2/m^2",),
    "angular drag": ("N m s^2/rad^2",),
    "energy per area": ("J/m^2", "J/mm^2", "J/cm^2"),
    "volume": ("cm^3", "l", "m^3", "in^3"),
    "volume flow": ("l/min", "l/s", "m^3/s", "m^3/h"),
    "temperature difference": ("K",),
    "number": ("", "%"),
}
"""Units in a drop-down, by dimension; the unit of the value itself is always among them."""
SHARES = (
    *("efficiency", "irregularity", "droop", "armature_share", "rim_share", "arm_share", "closure", "clearance"),
    *(key.name for key in LIMITS.keys),
)
"""Numbers that may be written in percent."""
_MANY = 60  # fields of one list
_COORDINATE = Key("coordinate", "length", "")
_WHOLE = Key("teeth", "number", "", None, POSITIVE)
_EFFORTS = {True: "torque", False: "force"}


class Slider(NamedTuple):
    """The range of a slider about a number, in the number's unit."""

    least: float
    most: float
    step: float


class FormField(NamedTuple):
    """One value of the text, or a missing one: `written` is None if it is missing."""

    path: str
    label: str
    about: str
    kind: str
    value: str
    written: object
    number: float | None = None
    unit: str | None = None
    units: tuple[str, ...] = ()
    dimension: str | None = None
    range: Slider | None = None
    choices: tuple[str, ...] = ()

    def as_dict(self, line: int | None, span: tuple[int, int] | None, fault: str | None) -> dict[str, Any]:
        """The field for JSON; the span is that of the value in the text, in characters."""
        return {
            "path": self.path,
            "label": self.label,
            "about": self.about,
            "kind": self.kind,
            "value": self.value,
            "number": self.number,
            "unit": self.unit,
            "units": list(self.units),
            "dimension": self.dimension,
            "range": None if self.range is None else self.range._asdict(),
            "choices": list(self.choices),
            "line": line,
            "span": span,
            "fault": fault,
        }


class More(NamedTuple):
    """A key or a table to add, with its initial value.

    `instead` are keys that it would replace; `named` is true if the last part of its path is a name to choose.
    """

    key: str
    path: str
    label: str
    about: str
    kind: str
    value: str
    instead: tuple[str, ...] = ()
    named: bool = False


class FormGroup(NamedTuple):
    """A table of the scene."""

    path: str
    title: str
    about: str
    fields: tuple[FormField, ...]
    more: tuple[More, ...] = ()
    removable: bool = False
    level: int = 0


def as_groups(form: Iterable[FormGroup], outline: Outline, faults: Iterable[Fault]) -> list[dict[str, Any]]:
    """The groups for JSON: fields and groups with their lines and faults."""
    lines = {name: outline.line(path) for name, path in outline.places.items()}
    values = {name: outline.values[path] for name, path in outline.places.items() if path in outline.values}
    spans = {name: (value.start, value.stop) for name, value in values.items()}
    paths = {group.path for group in form} | {field.path for group in form for field in group.fields}
    wrong: dict[str, list[str]] = {}
    for fault in faults:
        where = fault.path
        while where and where not in paths:
            where = where[: max(where.rfind("."), where.rfind("["), 0)]
        wrong.setdefault(where, []).append(fault.sentence)
    messages_by_path = {path: "; ".join(messages) for path, messages in wrong.items()}
    return [
        {
            "path": group.path,
            "title": group.title,
            "about": group.about,
            "level": group.level,
            "fields": [
                field.as_dict(lines.get(field.path), spans.get(field.path), messages_by_path.get(field.path))
                for field in group.fields
            ],
            "more": [more._asdict() for more in group.more],
            "removable": group.removable,
            "line": lines.get(group.path),
            "fault": messages_by_path.get(group.path) if group.path else None,
        }
        for group in form
    ]


def form_of(outline: Outline) -> tuple[FormGroup, ...]:
    """The form of a text, as far as the text can be read and is not too long."""
    if outline.text and not outline.values and len(outline.text) > 2**16:
        return (FormGroup("", _("Scene"), _("This scene is too long for a form: it is edited as text."), ()),)
    return tuple(_Reader(outline.mapping).groups())


# -- words ---------------------------------------------------------------------------------------------------------------


def label_of(key: str) -> str:
    """A key in words."""
    return _(key.replace("_", " "))


def title_of(name: str) -> str:
    """A table's title."""
    title = _(name.replace("_", " "))
    return title[:1].upper() + title[1:]


@cache
def translated() -> frozenset[str]:
    """Every text of forms that comes from the lists of keys: labels, titles, descriptions of keys and tables."""
    sections = [*SECTIONS.values(), *INNER.values(), FRAME_BODY, LINK, JOINT, COUPLING, SIDE, POINT_PORT, OUTPUT, TABLE]
    sections += TABLES.values()
    sections += [*MOTORS.values(), *LOAD_MODELS.values()]
    sections += [Section("", kind.about, kind.keys) for kind in KINDS.values()]
    sections += [Section("", part.about, part.keys) for kind in KINDS.values() for part in kind.parts]
    sections.append(Section("", "", (*TOP, *WHEEL_KEYS)))
    names = {*SECTIONS, *_TITLES, *(noun for kind in KINDS.values() for noun in kind.all_nouns)}
    names |= {key.name for section in sections for key in section.keys}
    abouts = {section.about for section in sections} | {key.about for section in sections for key in section.keys}
    return frozenset(({name.replace("_", " ") for name in names} | abouts) - {""})


_TITLES = ("assembly", "body", "coupling", "joint", "output", "parameter", "point", "port", "shaft")
"""Titles of tables that have other names in the format."""


# -- groups --------------------------------------------------------------------------------------------------------------


_MOST_KEPT = 1000
_kept: dict[tuple[Any, ...], tuple[FormGroup, ...]] = {}


class _Reader:
    """A walk over the tables of a scene in the order of the format."""

    def __init__(self, mapping: Mapping[str, Any]) -> None:
        self.raw = mapping
        self.places = places_of(mapping)

    def groups(self) -> Iterator[FormGroup]:
        """Every group."""
        yield FormGroup("", _("Scene"), "", tuple(self.fields("", TOP, self.raw)), tuple(self.sections()))
        for name, section in SECTIONS.items():
            if name not in self.raw:
                continue
            raw = self.raw[name]
            if name == "mechanism":
                yield from self.mechanisms(raw)
            elif section.free:
                yield self.parameters(raw)
            elif section.named:
                for child_name, table in _tables(raw):
                    title = f"{title_of('shaft')} {child_name}"
                    yield from self.table(child(name, child_name), title, section, table, removable=True)
            elif section.array:
                for i, table in _items(raw):
                    title = f"{title_of(name)} {i + 1}"
                    on = table.get("on")
                    title += f": {on}" if isinstance(on, str) else ""
                    yield from self.table(f"{name}[{i}]", title, section, table, removable=True)
            elif name == "flywheel":
                keys = (*section.keys, *WHEEL_KEYS)
                yield from self.table(name, title_of(name), section._replace(keys=keys), raw, removable=True)
            else:
                yield from self.table(name, title_of(name), section, raw, removable=True)

    def sections(self) -> Iterator[More]:
        """Tables to add to the scene, and its own keys."""
        for key in TOP:
            if key.name not in self.raw:
                yield More(key.name, key.name, label_of(key.name), _(key.about), "text", "")
        for name, section in SECTIONS.items():
            there = name in self.raw
            excluded = set(AREAS_EXCLUDE if "areas" in self.raw else ()) | set(
                STROKE_EXCLUDE if "stroke" in self.raw else ()
            )
            needs = name == "areas" and any(other in self.raw for other in AREAS_EXCLUDE)
            needs = needs or (name == "single_stroke" and any(other in self.raw for other in SINGLE_STROKE_EXCLUDE))
            excluded |= set(SINGLE_STROKE_EXCLUDE if "single_stroke" in self.raw else ())
            needs = needs or (name == "stroke" and any(other in self.raw for other in STROKE_EXCLUDE))
            repeated = section.array and isinstance(self.raw.get(name, []), list)
            if name in excluded or needs or (there and not (repeated or section.named or section.free)):
                continue
            path = name
            if repeated and not (name == "mechanism" and not there):
                path = f"{name}[{len(self.raw.get(name, []))}]"
            if section.named or section.free:
                taken = self.raw.get(name)
                path = f"{name}.{_fresh('shaft' if section.named else 'value', taken if isinstance(taken, dict) else {})}"
            about = _(section.about)
            label = title_of("shaft" if name == "shafts" else "parameter" if name == "parameters" else name)
            kind = "quantity" if section.free else "table"
            yield More(name, path, label, about, kind, self.places.begun(name), named=section.named or section.free)

    def table(
        self,
        path: str,
        title: str,
        section: Section,
        raw: object,
        *,
        removable: bool = False,
        level: int = 0,
        on: object = None,
    ) -> Iterable[FormGroup]:
        """The group of a table, and those of the tables within it; a model acts where its load does, `on`."""
        table = raw if isinstance(raw, Mapping) else {}
        on = table.get("on", on)
        cache_key = (
            path,
            title,
            section.name,
            section.about,
            removable,
            level,
            repr(on),
            self.places,
            current(),
            repr(table),
        )
        if cache_key not in _kept:
            if len(_kept) >= _MOST_KEPT:
                _kept.clear()
            _kept[cache_key] = tuple(self.new_table(path, title, section, table, removable, level, on))
        return _kept[cache_key]

    def new_table(
        self, path: str, title: str, section: Section, table: Mapping[str, Any], removable: bool, level: int, on: object
    ) -> Iterator[FormGroup]:
        """The groups of a table, which `table` keeps: an edit changes one of many."""
        rotating = self.places.rotates(on)
        inner = [
            key for key in section.keys if key.kind in ("table", "model", "tables") and isinstance(table.get(key.name), dict)
        ]
        inner += [key for key in section.keys if key.kind == "position" and isinstance(table.get(key.name), dict)]
        plain = [key for key in section.keys if key not in inner]
        about = _(section.about)
        more = tuple(self.more(path, section, table, rotating))
        yield FormGroup(path, title, about, tuple(self.fields(path, plain, table, rotating)), more, removable, level)
        for key in inner:
            yield from self.inner(child(path, key.name), key, table[key.name], level + 1, on)

    def inner(self, path: str, key: Key, table: Mapping[str, Any], level: int, on: object) -> Iterator[FormGroup]:
        """The group of a table within a table: a model, a motor, limits, rows of numbers."""
        if key.kind == "model":
            kinds = MOTORS if key.name == "motor" else LOAD_MODELS
            kind = table.get("type")
            section = kinds.get(kind) if isinstance(kind, str) else None
            if section is None:
                type_key = next(iter(kinds.values())).keys[0]
                section = Section(key.name, key.about, (type_key,))
            yield from self.table(path, title_of(key.name), section, table, removable=True, level=level, on=on)
        elif key.name in INNER:
            yield from self.table(path, title_of(key.name), INNER[key.name], table, removable=True, level=level)
        else:
            rows = TABLES.get(key.name, TABLE)
            inner = table.get("table")
            if key.kind == "position" and isinstance(inner, dict):
                path, table = f"{path}.table", inner
            yield from self.table(path, title_of(key.name), rows, table, removable=True, level=level)

    def parameters(self, raw: object) -> FormGroup:
        """The group of names for numbers."""
        section = SECTIONS["parameters"]
        values = raw if isinstance(raw, Mapping) else {}
        fields = [self.parameter(child("parameters", name), name, value) for name, value in values.items()]
        return FormGroup("parameters", title_of("parameters"), _(section.about), tuple(fields), removable=True)

    def parameter(self, path: str, name: str, value: object) -> FormField:
        """A parameter: a quantity of any dimension, or the balance."""
        if isinstance(value, str) and (parts := split_quantity(value)) is not None:
            dimension = _dimension(parts[1])
            if dimension is not None:
                return quantity(path, name, "", Key(name, dimension, ""), value, dimension)
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            return quantity(path, name, "", Key(name, "number", ""), value, "number")
        return FormField(path, name, "", "expression", _editable(value), value, choices=("balance",))

    def fields(
        self, path: str, keys: Iterable[Key], table: Mapping[str, Any], rotating: bool | None = None
    ) -> Iterator[FormField]:
        """The fields of keys that a table has or needs; then those of keys that it should not have."""
        names = set()
        for key in keys:
            names.add(key.name)
            if key.name in table or key.required:
                yield from self.field(f"{path}.{key.name}" if path else key.name, key, table.get(key.name), rotating)
        if path:
            for name, value in table.items():
                if name not in names and not isinstance(value, (dict, list)):
                    yield FormField(child(path, name), name, "", "text", _editable(value), value)

    def field(self, path: str, key: Key, value: object, rotating: bool | None) -> Iterator[FormField]:
        """The field of one key; of a short list one for each item."""
        label, about = label_of(key.name), _(key.about)
        if isinstance(value, list) and key.kind == "list":
            if len(value) <= _MANY and not any(isinstance(item, (dict, list)) for item in value):
                for i, item in enumerate(value):
                    yield self.item(f"{path}[{i}]", key, i, item)
            return
        if key.kind == "changes" and isinstance(value, Mapping):
            for place, changed in leaves(value):
                yield self.parameter(f"{path}.{place}", place, changed)
            return
        dimension = self.dimension(key, value, rotating)
        if dimension is not None:
            yield quantity(path, label, about, key, value, dimension)
            return
        kind, choices = "text", tuple(self.choices(path, key, value))
        if choices:
            kind = "choice"
        elif key.kind == "flag":
            kind = "boolean"
        elif key.kind == "numbers" or isinstance(value, list):
            kind = "list"
        elif key.kind in ("law", "position"):
            kind = "expression"
            choices = ("balance",) if path in ("drive.torque", "drive.force") else ()
        if kind == "list" and isinstance(value, list):
            value_text = ", ".join(_editable(item) for item in value)
            yield FormField(path, label, about, kind, value_text, value)
            return
        yield FormField(path, label, about, kind, _editable(value), value, choices=choices)

    def item(self, path: str, key: Key, i: int, value: object) -> FormField:
        """The field of a list's item: a coordinate, a point, a joint, a number of teeth."""
        about = _(key.about)
        if key.name == "between":
            choices = with_value(self.places.joints if ".couplings[" in path else self.places.points, value)
            label = _("first") if i == 0 else _("second")
            return FormField(path, label, about, "choice", _editable(value), value, choices=choices)
        if key.name == "teeth":
            label = f"{label_of('teeth')} {i + 1}"
            return quantity(path, label, about, _WHOLE, value, "number")
        axis = "xy"[i] if i < 2 else str(i)
        return quantity(path, f"{label_of(key.name)} {axis}", about, _COORDINATE, value, "length")

    def dimension(self, key: Key, value: object, rotating: bool | None) -> str | None:
        """The dimension of a key's value; None if it is no quantity."""
        several = key.kind.split(" | ")
        if key.kind == "law":
            by_name = _EFFORTS[key.name == "torque"]
            typed = isinstance(value, str) and _last_unit(value, by_name) is not None
            return by_name if typed or _is_quantity(value, (by_name,)) else None
        if several[0] not in DIMENSIONS:
            return None
        if len(several) == 1:
            return several[0]
        fitting = [name for name in several if _is_quantity(value, (name,)) and isinstance(value, str)]
        if fitting:
            return fitting[0]
        if key.name in ("from", "to", "speed", "acceleration", "start"):
            return several[0 if self.places.sliding == (several[0] in ("length", "velocity", "acceleration")) else 1]
        return several[bool(rotating)]

    def choices(self, path: str, key: Key, value: object) -> Sequence[str]:
        """Choices of a key's drop-down; empty if it may be anything."""
        if key.choices:
            return with_value(key.choices, value)
        shaft = key.name == "shaft" or (key.name == "on" and key.default is not None)
        offered: Sequence[str] = ()
        if shaft:
            offered = self.places.near(path.removesuffix(".on"))
        elif key.name == "on":
            offered = self.places.all(value)
        elif key.name == "driver":
            offered = self.places.drivers
        elif path.startswith("mechanism") and key.name in ("point", "contact", "from", "to"):
            offered = self.places.points
        return with_value(offered, value) if offered else ()

    def more(self, path: str, section: Section, table: Mapping[str, Any], rotating: bool | None) -> Iterator[More]:
        """Keys to add to a table."""
        groups = [*section.one_of, *([tuple(name for way in section.either for name in way)] if section.either else [])]
        for key in section.keys:
            if key.name in table or key.required:
                continue
            way = next((way for way in section.either if key.name in way), ())
            group = next((group for group in groups if key.name in group), ())
            instead = tuple(name for name in group if name in table and name not in way)
            if len(section.either) > 2:  # ways that share keys: only the reader knows what goes with what
                instead = ()
            if section.name == "load" and key.kind == "law" and rotating is not None and (key.name == "torque") != rotating:
                continue
            dimension = self.dimension(key, None, rotating)
            value, kind = self.places.begun_key(path, key, dimension, table)
            yield More(key.name, child(path, key.name), label_of(key.name), _(key.about), kind, value, instead)

    # -- mechanisms

    def mechanisms(self, raw: object) -> Iterator[FormGroup]:
        """The groups of every mechanism."""
        tables = [("mechanism", raw)] if isinstance(raw, dict) else [(f"mechanism[{i}]", table) for i, table in _items(raw)]
        for path, table in tables:
            yield from self.mechanism(path, table if isinstance(table, dict) else {}, len(tables) > 1)

    def mechanism(self, path: str, table: Mapping[str, Any], several: bool) -> Iterator[FormGroup]:
        """The groups of a mechanism: its own keys, and its parts."""
        name, type_name = table.get("name"), table.get("type")
        kind = KINDS[type_name] if isinstance(type_name, str) and type_name in KINDS else None
        title = title_of("mechanism") + (f": {name}" if isinstance(name, str) else "")
        inner = {key.name for key in (kind.keys if kind else ()) if key.kind in ("tables", "list")}
        own = [key for key in (kind.keys if kind else ()) if key.kind not in ("tables", "list")]
        section = MECHANISM._replace(keys=(*MECHANISM.keys, *own), about=kind.about if kind else MECHANISM.about)
        parts = {name for part in kind.parts for name in part.names} if kind else set()
        plain = {k: v for k, v in table.items() if k not in parts and k not in inner}
        more = list(self.more(path, section, plain, None))
        if kind is not None and kind.name == "linkage":
            more += self.linkage_more(path, table)
        if kind is not None and kind.name == "law":
            name = _fresh("output", table.get("outputs"))
            value = '{x = "0.01*sin(phi)"}'
            more.append(
                More("output", f"{path}.outputs.{name}", title_of("output"), _(OUTPUT.about), "table", value, named=True)
            )
        fields = tuple(self.fields(path, section.keys, plain))
        yield FormGroup(path, title, _(section.about), fields, tuple(more), True)
        for part in kind.parts if kind else ():
            name = part.name_in(table)
            part_section = Section(name, part.about, part.keys)
            yield from self.table(f"{path}.{name}", title_of(name), part_section, table.get(name, {}), level=1)
        if kind is not None and kind.name == "law":
            for name, output in _tables(table.get("outputs")):
                where = child(f"{path}.outputs", name)
                yield from self.table(where, f"{title_of('output')} {name}", OUTPUT, output, removable=True, level=1)
        if kind is not None and kind.name == "linkage":
            yield from self.linkage(path, table)

    def linkage(self, path: str, table: Mapping[str, Any]) -> Iterator[FormGroup]:
        """The groups of a linkage: bodies with their points, joints, couplings, sides and ports."""
        for name, body in _tables(table.get("bodies")):
            yield self.body(child(f"{path}.bodies", name), name, body if isinstance(body, dict) else {})
        for i, joint in _items(table.get("joints")):
            kind = joint.get("type")
            section = JOINT._replace(keys=keys_for(JOINT, JOINT_KEYS.get(kind) if isinstance(kind, str) else None))
            title = f"{title_of('joint')} {joint.get('name', i + 1)}"
            yield from self.table(f"{path}.joints[{i}]", title, section, joint, removable=True, level=1)
        for i, coupling in _items(table.get("couplings")):
            kind = coupling.get("type")
            kind = kind if isinstance(kind, str) and kind in COUPLING_KEYS else None
            section = COUPLING._replace(keys=keys_for(COUPLING, COUPLING_KEYS[kind] if kind else None))
            section = section._replace(one_of=COUPLING_ONE_OF[kind] if kind else ())
            title = f"{title_of('coupling')} {coupling.get('name', i + 1)}"
            yield from self.table(f"{path}.couplings[{i}]", title, section, coupling, removable=True, level=1)
        for i, side in _items(table.get("assembly")):
            title = f"{title_of('assembly')} {i + 1}"
            yield from self.table(f"{path}.assembly[{i}]", title, SIDE, side, removable=True, level=1)
        for name, port in _tables(table.get("ports")):
            title = f"{title_of('port')} {name}"
            yield from self.table(child(f"{path}.ports", name), title, POINT_PORT, port, removable=True, level=1)

    def body(self, path: str, name: str, table: Mapping[str, Any]) -> FormGroup:
        """The group of a body: its mass and inertia, and the coordinates of its points."""
        section = FRAME_BODY if name == "frame" else LINK
        plain = [key for key in section.keys if key.name != "points"]
        fields = list(self.fields(path, plain, {k: v for k, v in table.items() if k != "points"}))
        points = table.get("points")
        for point, pair in points.items() if isinstance(points, dict) else ():
            where = child(f"{path}.points", point)
            if isinstance(pair, list) and len(pair) == 2:
                for i, value in enumerate(pair):
                    about = _("coordinate of the point in the body's own frame")
                    fields.append(quantity(f"{where}[{i}]", f"{point} {'xy'[i]}", about, _COORDINATE, value, "length"))
            else:
                fields.append(FormField(where, point, "", "list", _editable(pair), pair))
        more = list(self.more(path, section._replace(keys=tuple(plain)), table, None))
        fresh = _fresh("point", points)
        label, about = title_of("point"), _("a point with its [x, y] in the body's own frame")
        more.append(More("point", f"{path}.points.{fresh}", label, about, "list", "0, 0", named=True))
        return FormGroup(
            path, f"{title_of('body')} {name}", _(section.about), tuple(fields), tuple(more), name != "frame", 1
        )

    def linkage_more(self, path: str, table: Mapping[str, Any]) -> Iterator[More]:
        """Bodies, joints and other parts to add to a linkage."""
        points, joints = self.places.points or ("frame.origin",), self.places.joints
        first, last = points[0], points[-1]
        body, port = _fresh("body", table.get("bodies")), _fresh("port", table.get("ports"))
        begun = {
            f"bodies.{body}": (title_of("body"), LINK.about, '{mass = "1 kg"}'),
            f"joints[{_count(table.get('joints'))}]": (
                title_of("joint"),
                JOINT.about,
                f'{{name = "{_fresh("joint", dict.fromkeys(joints))}", type = "pin", between = ["{first}", "{last}"]}}',
            ),
            f"ports.{port}": (title_of("port"), POINT_PORT.about, f'{{point = "{last}"}}'),
            f"assembly[{_count(table.get('assembly'))}]": (
                title_of("assembly"),
                SIDE.about,
                f'{{point = "{last}", side = "left", from = "{first}", to = "{last}"}}',
            ),
        }
        if len(joints) > 1:
            value = f'{{type = "gear", between = ["{joints[0]}", "{joints[1]}"], ratio = 1}}'
            begun[f"couplings[{_count(table.get('couplings'))}]"] = (title_of("coupling"), COUPLING.about, value)
        for where, (label, about, value) in begun.items():
            named = "." in where
            key = where.partition(".")[0].partition("[")[0]
            yield More(key, f"{path}.{where}", label, _(about), "table", value, named=named)


def quantity(path: str, label: str, about: str, key: Key, value: object, dimension: str) -> FormField:
    """The field of a quantity, as far as it can be read: its number, its unit and its slider."""
    kind = "number" if dimension == "number" else "quantity"
    si = DIMENSIONS[dimension].si
    number, unit = None, si
    if isinstance(value, str):
        parts = split_quantity(value)
        if parts is not None and _is_quantity(value, (dimension,)):
            number, unit = float(parts[0]), parts[1]
        else:
            unit = _last_unit(value, dimension) or si
    elif isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value):
        number = float(value)
    offered = OFFERED.get(dimension, (si,))
    if dimension == "number" and key.name not in SHARES and unit != "%":
        offered = ()
    units = offered if unit in offered or not offered else (unit, *offered)
    slide = None
    if number is not None:
        with suppress(QuantityError, OverflowError, ZeroDivisionError):
            slide = slider(number, key, dimension, _factor(unit, dimension))
    return FormField(path, label, about, kind, _editable(value), value, number, unit, units, dimension, slide)


def _last_unit(value: str, dimension: str) -> str | None:
    """The unit at the end of a text that is no quantity, so that a typing error in the number keeps it.

    >>> _last_unit("6o rpm", "speed"), _last_unit("-4O0 kN m", "torque"), _last_unit("sin(phi)", "torque")
    ('rpm', 'kN m', None)
    """
    words = value.split()
    tails = (" ".join(words[k:]) for k in range(1, len(words)))
    return next((tail for tail in tails if _fits(tail, dimension)), None)


def _fits(unit: str, dimension: str) -> bool:
    """Tests whether a text is a unit of a dimension."""
    with suppress(QuantityError):
        parse_unit(unit, dimension)
        return True
    return False


@cache
def _factor(unit: str, dimension: str) -> float:
    """SI value of a unit."""
    if not unit:
        return 1.0
    unit_factor = parse_unit(unit, dimension)
    return unit_factor.numerator / unit_factor.denominator


@cache
def _dimension(unit: str) -> str | None:
    """The most likely dimension of a unit; None if it is no unit."""
    return next((dimension for dimension in DIMENSIONS if _fits(unit, dimension)), None) if unit else "number"


def _is_quantity(value: object, dimensions: Iterable[str]) -> bool:
    """Tests whether a value, or one that is missing, can be a quantity of some dimension."""
    for dimension in dimensions:
        with suppress(QuantityError):
            parse_quantity(value, dimension)
            return True
    return False


def _editable(value: object) -> str:
    """A value as a text to be edited."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return value
    if isinstance(value, (int, float)):
        return repr(value)
    return literal(value)


def with_value(offered: Sequence[str], value: object) -> tuple[str, ...]:
    """Choices, including the present value, even an invalid one."""
    return tuple(offered) if not isinstance(value, str) or value in offered else (value, *offered)


def _tables(raw: object) -> list[tuple[str, Any]]:
    return list(raw.items()) if isinstance(raw, dict) else []


def _items(raw: object) -> list[tuple[int, Any]]:
    return [(i, item) for i, item in enumerate(raw) if isinstance(item, dict)] if isinstance(raw, list) else []


def _count(raw: object) -> int:
    return len(raw) if isinstance(raw, list) else 0


def _fresh(name: str, taken: object) -> str:
    """A name that is not taken yet."""
    names = taken if isinstance(taken, Mapping) else {}
    return next(f"{name}{k}" for k in range(1, len(names) + 2) if f"{name}{k}" not in names)


# -- sliders -------------------------------------------------------------------------------------------------------------

_USUAL = {"length": 0.1, "mass": 10.0, "inertia": 1.0, "force": 1e3, "torque": 100.0, "speed": 100.0, "velocity": 1.0}
"""The range of a slider about a value of zero, in SI; 1 for any other dimension."""
_COUNTED = ("poles", "arms", "teeth")
_STEPS = 200


def slider(number: float, key: Key, dimension: str, factor: float) -> Slider:
    """A slider about a number: from zero to about twice the number, within the key's range.

    Its ends are round numbers, equal for all numbers of a range, so that they stay while the number is dragged;
    an angle has a whole turn. `factor` is the SI value of the number's unit.

    >>> slider(80.0, Key("length", "length", "", None, POSITIVE), "length", 1e-3)
    Slider(least=1.0, most=200.0, step=1.0)
    >>> slider(-250.0, Key("force", "law", ""), "force", 1e3)
    Slider(least=-500.0, most=500.0, step=2.0)
    """
    low, high = key.range.low / factor, key.range.high / factor
    reach = 2 * math.pi / factor if dimension == "angle" else _USUAL.get(dimension, 1.0) / factor
    if dimension == "angle":
        reach *= max(1.0, math.ceil(abs(number) / reach - 1e-9))
        most, step = reach, reach / 360 if reach > 7 else _round_down(reach / _STEPS)
        least = 0.0 if number >= 0 else -reach
    else:
        most = _round_up(2 * abs(number) if number else reach)
        step = _round_down(most / _STEPS)
        least = -most if low < 0 and (number < 0 or key.kind == "law" or "|" in key.kind or low == -math.inf) else 0.0
    if key.name in _COUNTED:
        step = 2.0 if key.name == "poles" else 1.0
        most = max(_round_up(2 * abs(number)), 12.0)
    least, most = max(least, low), min(most, high)
    if least == low and (key.range.low_open or (key.name in _COUNTED and not least)):
        least += step
    if most == high and key.range.high_open:
        most -= step
    return Slider(min(least, number), max(most, number), step)


def _round_up(value: float) -> float:
    """The next of 1, 2, 5, 10, 20...

    >>> _round_up(160.0), _round_up(0.021)
    (200.0, 0.05)
    """
    power = 10.0 ** math.floor(math.log10(value))
    factor = next(k for k in (1, 2, 5, 10) if k * power >= value * (1 - 1e-9))
    return float(f"{factor * power:.3g}")


def _round_down(value: float) -> float:
    """The greatest of 1, 2, 5, 10... that is not above."""
    power = 10.0 ** math.floor(math.log10(value))
    factor = next(k for k in (5, 2, 1) if k * power <= value * (1 + 1e-9))
    return float(f"{factor * power:.3g}")
