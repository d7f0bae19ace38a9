"""The scene format as a JSON Schema (draft 7), for editors: completion, explanations and red lines while a scene is typed.

It is made from the reader's lists of keys, and refuses the faults that these determine: unknown and missing keys, wrong
types, choices, ranges of bare numbers, keys that exclude each other. The reader checks all that depends on other tables
(places, units, laws, lengths that lock).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from flywheel.mechanisms import KINDS
from flywheel.numerics.units import DIMENSIONS
from flywheel.reading.loads import LOAD_MODELS
from flywheel.reading.motors import MOTORS, TABLES, Even
from flywheel.reading.schema import (
    AREAS_EXCLUDE,
    CLUTCH,
    COUPLING,
    COUPLING_KEYS,
    COUPLING_ONE_OF,
    FRAME_BODY,
    JOINT,
    JOINT_KEYS,
    LIMITS,
    LINK,
    MACHINE,
    MECHANISM,
    MOST_MECHANISMS,
    MOST_TABLES,
    NAME_PATTERN,
    OUTPUT,
    POINT_PORT,
    SECTIONS,
    SIDE,
    STROKE_EXCLUDE,
    TABLE,
    TOP,
    WHEEL_KEYS,
    Section,
    keys_for,
)
from flywheel.scene.scene import Key

Schema = dict[str, Any]

_QUANTITY = r"^\s*[-+−]?(\d|\.\d)"
_NAME: Schema = {"type": "string", "maxLength": 100, "pattern": f"^{NAME_PATTERN}$"}
_MODELS = {"motor": MOTORS, "model": LOAD_MODELS}
_TYPES = {
    "text": "string",
    "unit": "string",
    "flag": "boolean",
    "index": ["string", "integer"],
    "law": ["string", "number"],
    "changes": "object",
}


def json_schema() -> Schema:
    """The schema of a scene.

    >>> json_schema()["properties"]["gravity"]["properties"]["g"]["default"]
    9.80665
    """
    flywheel = SECTIONS["flywheel"]
    sections = {**SECTIONS, "flywheel": flywheel._replace(keys=(*flywheel.keys, *WHEEL_KEYS))}
    mechanism = _by_type("mechanism", MECHANISM.about, KINDS)
    several = {"type": ["object", "array"], "maxItems": MOST_MECHANISMS, "items": mechanism}
    properties = {key.name: _key(key) for key in TOP}
    properties |= {name: _repeated(section) for name, section in sections.items()} | {"mechanism": mechanism | several}
    models = {f"{key}.{name}": _typed(of, name) for key, types in _MODELS.items() for name, of in types.items()}
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "A scene of flywheel",
        **_object(properties),
        **_beside("stroke", STROKE_EXCLUDE),
        "else": _beside("areas", AREAS_EXCLUDE),
        "anyOf": [{"required": [name]} for name in MACHINE],
        "definitions": models | {f"mechanism.{name}": _mechanism(name) for name in KINDS},
    }


def _object(properties: Schema, required: Iterable[str] = (), about: str = "") -> Schema:
    schema: Schema = {"description": about} if about else {}
    schema |= {"type": "object", "properties": properties, "additionalProperties": False}
    return schema | ({"required": list(required)} if required else {})


def _beside(name: str, excluded: Iterable[str]) -> Schema:
    """Tables that exclude another one."""
    return {"if": {"required": [name]}, "then": {"properties": dict.fromkeys(excluded, False)}}


def _repeated(section: Section) -> Schema:
    """A table of the scene, which may have a name or be repeated."""
    if section.free:
        names: Schema = {"pattern": r"^[A-Za-z_][A-Za-z_0-9]*$"}
        return _named({"type": ["string", "number"]}, names) | {"description": section.about}
    if section.named:
        schema = _named(_table(section)) | {"description": section.about}
        if section.name == "shafts":  # all ratios are taken to the crank, which needs none
            keys = tuple(key._replace(required=False) for key in section.keys)
            schema["properties"] = {"crank": _table(section._replace(keys=keys))}
        return schema
    return _listed(section) | {"description": section.about} if section.array else _table(section)


def _named(items: Schema, names: Schema = _NAME) -> Schema:
    """Tables, or values, whose keys are names that the scene chooses."""
    return {"type": "object", "maxProperties": MOST_TABLES, "propertyNames": names, "additionalProperties": items}


def _listed(section: Section) -> Schema:
    return {"type": "array", "maxItems": MOST_TABLES, "items": _table(section)}


def _table(section: Section) -> Schema:
    """One table: its keys, those that it needs, and those that exclude each other."""
    required = [key.name for key in section.keys if key.required]
    schema = _object({key.name: _key(key) for key in section.keys}, required, section.about)
    for group in (*([(name,) for name in names] for names in section.one_of), section.either):  # one at most has any
        if group:
            schema["oneOf"] = [_way(names, group) for names in group]
    return schema


def _way(names: tuple[str, ...], group: Iterable[tuple[str, ...]]) -> Schema:
    """Keys of one alternative, without those of the others."""
    others = dict.fromkeys((name for way in group for name in way if name not in names), False)
    return {"required": list(names), "properties": others}


def _by_type(name: str, about: str, types: Iterable[str]) -> Schema:
    """A table whose keys follow from its type: `if` picks the one that is checked, `anyOf` shows all of them to editors."""
    refs = {kind: {"$ref": f"#/definitions/{name}.{kind}"} for kind in types}
    chain: Schema = {}
    for kind in reversed(refs):
        chain = {"if": {"properties": {"type": {"const": kind}}}, "then": refs[kind], "else": chain}
    schema = {"description": about, "type": "object", "properties": {"type": {"enum": list(refs)}}, "required": ["type"]}
    return schema | {"anyOf": [*refs.values(), {}]} | chain


def _typed(section: Section, kind: str) -> Schema:
    """A table of one type."""
    schema = _table(section)
    schema["properties"]["type"] = {"const": kind}
    return schema


def _mechanism(name: str) -> Schema:
    """The table of one type of mechanism, for a single mechanism and not an array."""
    kind = KINDS[name]
    keys = (*MECHANISM.keys, *kind.keys)
    schema = _typed(Section(name, kind.about, keys), name)
    tables = {part: _table(Section(part.name, part.about, part.keys)) for part in kind.parts}
    schema["properties"] |= {name: table for part, table in tables.items() for name in part.names}
    required = [part for part in kind.parts if any(key.required for key in part.keys)]
    schema["required"] += [part.name for part in required if not part.alias]
    if ways := [{"oneOf": [{"required": [name]} for name in part.names]} for part in required if part.alias]:
        schema["allOf"] = ways
    del schema["type"]
    return schema


def _key(key: Key) -> Schema:
    """Schema of the value of a key."""
    schema: Schema = {"description": key.about} | ({} if key.default is None else {"default": key.default})
    dimensions = [DIMENSIONS[part] for part in key.kind.split(" | ") if part in DIMENSIONS]
    if dimensions:
        units = ", or ".join(dimension.si for dimension in dimensions if dimension.si)
        schema["description"] += f" (a bare number: in {units})" if units else ""
        allowed = key.range
        low = {"exclusiveMinimum" if allowed.low_open else "minimum": allowed.low} if allowed.low > -math.inf else {}
        high = {"exclusiveMaximum" if allowed.high_open else "maximum": allowed.high} if allowed.high < math.inf else {}
        even = {"multipleOf": 2} if isinstance(allowed, Even) else {}
        return schema | {"type": ["number", "string"], "pattern": _QUANTITY} | low | high | even
    return _value(key) | schema


def _value(key: Key) -> Schema:
    """Schema of the value of a key that is no quantity."""
    if key.kind == "position":
        rows = _table(TABLE)
        rows["properties"]["interpolation"] = {"const": "spline"}
        return {"anyOf": [{"type": "string"}, rows, _object({"table": rows}, ["table"])]}
    if key.kind == "text" and key.choices:  # blanks do not count
        words = "|".join(r"\s*".join(choice.split()) for choice in key.choices)
        return {"type": "string", "pattern": rf"^\s*({words})\s*$", "examples": list(key.choices)}
    match key.kind:
        case "table":
            return _table(TABLES.get(key.name, TABLE))
        case "model":
            return _by_type(key.name, key.about, _MODELS[key.name])
        case "list" | "tables":
            return _inner(key.name)
        case "choice":
            return {"enum": list(key.choices)}
        case "name":
            return _NAME
        case "numbers":
            return {"type": "array", "items": {"type": "number"}}
    return {"type": _TYPES[key.kind]}


def _inner(name: str) -> Schema:
    """Tables and lists within a mechanism's own table, or the flywheel's."""
    if name == "limits":
        return _table(LIMITS) | {"minProperties": 1}
    pair: Schema = {"type": "array", "minItems": 2, "maxItems": 2}
    place = pair | {"items": {"type": ["number", "string"], "pattern": _QUANTITY}}
    if name == "clutch":
        return _table(CLUTCH)
    if name in ("com", "between", "teeth"):
        return {
            "com": place,
            "between": pair | {"items": {"type": "string"}},
            "teeth": pair | {"items": {"type": "integer"}},
        }[name]
    if name == "until":
        return {"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]}
    if name == "outputs":
        output = _table(OUTPUT)
        output["properties"]["table"] = output["properties"]["x"]["anyOf"][1]
        output["oneOf"].append(_way(("table",), [("x", "theta")]))
        return _named(output)
    if name == "bodies":
        return _named(_table(LINK)) | {"properties": {"frame": _table(FRAME_BODY)}}
    if name in ("joints", "couplings"):
        section, by_type = (JOINT, JOINT_KEYS) if name == "joints" else (COUPLING, COUPLING_KEYS)
        kinds = {kind: keys_for(section, keys) for kind, keys in by_type.items()}
        chain: Schema = {}
        for kind, keys in kinds.items():
            groups = COUPLING_ONE_OF[kind] if name == "couplings" else ()
            own = _typed(section._replace(keys=keys, one_of=groups), kind)
            chain = {"if": {"properties": {"type": {"const": kind}}}, "then": own, "else": chain}
        items = {"type": "object", "properties": {"type": {"enum": list(kinds)}}, "required": ["type"]}
        return {"type": "array", "items": items | chain}
    return {"points": _named(place), "ports": _named(_table(POINT_PORT)), "assembly": _listed(SIDE)}[name]
