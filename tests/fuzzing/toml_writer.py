"""A tree of tables as TOML again, with raw pieces that no parser could have given."""

import datetime
import math
import re
from collections.abc import Mapping
from typing import Any


class Raw(str):
    """A piece of TOML to be written as it is."""

    __slots__ = ()


def written(tree: Mapping[str, Any]) -> str:
    """The text of a tree: plain keys first, then tables, then arrays of tables."""
    plain, tables, arrays = [], [], []
    for key, value in tree.items():
        if isinstance(value, dict):
            tables.append(f"[{_key(key)}]\n{_lines(value)}")
        elif isinstance(value, list) and value and all(isinstance(item, dict) for item in value):
            arrays += [f"[[{_key(key)}]]\n{_lines(item)}" for item in value]
        else:
            plain.append(f"{_key(key)} = {_value(value)}\n")
    return "".join(plain + tables + arrays)


def _lines(table: Mapping[str, Any]) -> str:
    return "".join(f"{_key(key)} = {_value(value)}\n" for key, value in table.items())


def _key(key: str) -> str:
    return key if isinstance(key, Raw) or re.fullmatch(r"[A-Za-z0-9_-]+", key) else _text(key)


def _text(text: str) -> str:
    return '"' + "".join(_escaped(character) for character in text) + '"'


def _escaped(character: str) -> str:
    if character in '"\\':
        return "\\" + character
    code = ord(character)
    return f"\\u{code:04x}" if code < 32 or code == 127 else character


def _value(value: Any) -> str:
    if isinstance(value, Raw):
        return str(value)
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(key)} = {_value(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, (datetime.date, datetime.time)):
        return value.isoformat()
    return _float(value) if isinstance(value, float) else str(value)


def _float(value: float) -> str:
    return repr(value) if math.isfinite(value) else "nan" if math.isnan(value) else "inf" if value > 0 else "-inf"
