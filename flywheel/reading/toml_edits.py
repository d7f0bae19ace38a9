"""Changes of a scene's text at the place of a value, a key or a table: comments and layout stay as they are.

Every change is checked by reading the text again: only the one place may differ. Any other change is refused, and the text
stays.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping
from typing import Any

from flywheel.reading.toml_text import Outline, Path, Value, outline

_BARE = re.compile(r"[A-Za-z0-9_-]+")
_ESCAPES = {"\\": "\\\\", '"': '\\"', "\n": "\\n", "\r": "\\r", "\t": "\\t", "\b": "\\b", "\f": "\\f"}


class EditError(ValueError):
    """A change that cannot be made at its place."""


# -- values in TOML ------------------------------------------------------------------------------------------------------


def quoted(text: str, like: str = "") -> str:
    r"""A text as a value of TOML on one line, in single quotes if the old value has them, or if that avoids escapes.

    >>> print(quoted("80 mm"), quoted('5" pipe'), quoted("a\nb'c"), quoted("x", like="'y'"))
    "80 mm" '5" pipe' "a\nb'c" 'x'
    """
    plain = "'" not in text and text.isprintable()
    if plain and (like.startswith("'") or '"' in text or "\\" in text):
        return f"'{text}'"
    return '"' + "".join(_escaped(c) for c in text) + '"'


def _escaped(c: str) -> str:
    """A character between double quotes; half of a surrogate pair is no character."""
    if "\ud800" <= c <= "\udfff":
        return "\ufffd"
    return _ESCAPES.get(c) or (f"\\u{ord(c):04x}" if c < " " or "\x7f" <= c <= "\x9f" else c)


def literal(value: object) -> str:
    """A value of TOML for a number, a truth value, a text, a list or a table.

    >>> literal({"on": "crank", "table": {"angle": [0, 1.5]}})
    '{on = "crank", table = {angle = [0, 1.5]}}'
    """
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key_text(key)} = {literal(item)}" for key, item in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(literal(item) for item in value) + "]"
    return quoted(str(value))


def key_text(key: str) -> str:
    """A key as it is written."""
    return key if _BARE.fullmatch(key) else quoted(key)


def _dotted(path: Path) -> str:
    return ".".join(key_text(str(part)) for part in path)


# -- changes -------------------------------------------------------------------------------------------------------------


def with_value(before: Outline, path: Path, written: str) -> Outline:
    r"""The text with another value (as TOML writes it) of a key that is there, or with a key or table that is not.

    >>> print(with_value(outline("[regime]\nspeed = 1 # of the crank\n"), ("regime", "speed"), '"60 rpm"').text.rstrip())
    [regime]
    speed = "60 rpm" # of the crank
    """
    if (value := before.values.get(path)) is not None:
        text = f"{before.text[: value.start]}{written}{before.text[value.stop :]}"
    elif _has(before.mapping, path):
        raise EditError("a table that stands in several places")
    else:
        text = _added(before, path, written)
    changed = outline(text)
    new_value = tomllib.loads(f"value = {written}")["value"]
    kept = _leaves(before.mapping, path)
    if (
        changed.troubles > before.troubles
        or repr(value_at(changed.mapping, path)) != repr(new_value)
        or _leaves(changed.mapping, path) != kept
    ):
        raise EditError("a place where that cannot be written")
    return changed


def without(before: Outline, path: Path) -> Outline:
    r"""The text without a key, a table or an item of a list, and without the comments right above a table's heading.

    >>> text = "[regime]\nspeed = 1\n\n# Weight.\n[gravity]\ng = 9.8\n\n[drive]\ntorque = 1\n"
    >>> print(without(outline(text), ("gravity",)).text.rstrip())
    [regime]
    speed = 1
    <BLANKLINE>
    [drive]
    torque = 1
    """
    # the innermost list or table between brackets in which it stands, if any
    inline = next((path[:k] for k in range(len(path) - 1, 0, -1) if path[:k] in before.values), ())
    text = _without_inline(before, inline, path) if inline else _without_lines(before, path)
    changed = outline(text)
    kept = _leaves(before.mapping, path)
    if isinstance(path[-1], int):  # items behind it move up
        several = [len(value_at(which.mapping, path[:-1]) or ()) for which in (before, changed)]
        good = several[1] == several[0] - 1 and _leaves(changed.mapping, path[:-1]) == _leaves(before.mapping, path[:-1])
    else:
        good = not _has(changed.mapping, path) and _leaves(changed.mapping, path) == kept
    if changed.troubles > before.troubles or not good:
        raise EditError("a place from which that cannot be taken")
    return changed


def value_at(mapping: Any, path: Path) -> Any:
    """Value at a path; None if there is none."""
    for part in path:
        try:
            mapping = mapping[part]
        except (KeyError, IndexError, TypeError):
            return None
    return mapping


def _has(mapping: Any, path: Path) -> bool:
    above = value_at(mapping, path[:-1])
    if isinstance(above, dict):
        return path[-1] in above
    return isinstance(above, list) and isinstance(path[-1], int) and path[-1] < len(above)


def _leaves(value: Any, leave: Path, path: Path = ()) -> dict[Path, Any]:
    """Every value by its path that is no table or list, except for one path."""
    if path == leave:
        return {}
    if isinstance(value, dict):
        return {k: v for key, item in value.items() for k, v in _leaves(item, leave, (*path, key)).items()}
    if isinstance(value, list):
        return {k: v for i, item in enumerate(value) for k, v in _leaves(item, leave, (*path, i)).items()}
    return {path: repr(value)}


# -- where something is added ----------------------------------------------------------------------------------------------


def _added(outline: Outline, path: Path, written: str) -> str:
    """The text with a new key or table: beside similar ones, else below the heading of its table."""
    for k in range(len(path) - 1, -1, -1):
        above, rest = path[:k], path[k:]
        if above in outline.values:
            return _added_inline(outline, outline.values[above], rest, written)
        headed = len(rest) > 1 and any(block.path[: k + 1] == path[: k + 1] for block in outline.blocks)
        if headed or written.startswith("{"):  # a table gets a heading of its own
            break
        if any(isinstance(part, int) for part in rest):
            continue
        if k and (table := _statements(outline, above)):
            return _line(outline, table[-1].stop, outline.blocks[table[-1].block].path, path, written)
        blocks = [i for i, block in enumerate(outline.blocks) if block.path == above]
        if blocks and (k or len(path) == 1):
            return _below_heading(outline, blocks[-1], path, written)
    return _with_table(outline, path, written)


def _statements(outline: Outline, path: Path) -> list[Value]:
    """The lines of a path and everything below it, written with dots below another heading."""
    below = [
        value
        for at, value in outline.values.items()
        if value.statement and at[: len(path)] == path and len(outline.blocks[value.block].path) < len(path)
    ]
    return sorted(below, key=lambda value: value.at)


def _line(outline: Outline, stop: int, block: Path, path: Path, written: str) -> str:
    """The text with a new line behind the one in which a value ends."""
    end = _line_end(outline.text, stop)
    return f"{outline.text[:end]}\n{_dotted(path[len(block) :])} = {written}{outline.text[end:]}"


def _below_heading(outline: Outline, number: int, path: Path, written: str) -> str:
    """The text with a new line behind the last one below a heading."""
    block = outline.blocks[number]
    own = [value.stop for value in outline.values.values() if value.statement and value.block == number]
    if own or block.path:
        return _line(outline, max(own, default=block.stop), block.path, path, written)
    line = f"{_dotted(path)} = {written}\n"
    head = re.match(r"(?:#[^\n]*\n)*(?=\s*\n)", outline.text)  # comments at the top are those of the whole scene
    at = head.end() if head else 0
    return (
        f"{outline.text[:at]}{line}{outline.text[at:]}"
        if at
        else f"{line}{'' if not outline.text else chr(10)}{outline.text}"
    )


def _with_table(outline: Outline, path: Path, written: str) -> str:
    """The text with a new table under its own heading: a key's own where the key is not in one yet."""
    value = tomllib.loads(f"value = {written}")["value"]
    table = path if isinstance(value, dict) or isinstance(path[-1], int) else path[:-1]
    if not table or (isinstance(path[-1], int) and not isinstance(value, dict)):
        raise EditError("a place that has no heading")
    name = _dotted(tuple(part for part in table if isinstance(part, str)))
    heading = f"[[{name}]]" if isinstance(table[-1], int) else f"[{name}]"  # of an item of an array of tables, or a table
    lines = [heading, *(_lines_of(value) if table == path else [f"{key_text(str(path[-1]))} = {written}"])]
    shared = [_shared(block.path, table) for block in outline.blocks]
    last = max(i for i, count in enumerate(shared) if count == max(shared))  # behind what has most of its path in common
    at = _begin(outline, last + 1)
    before, behind = outline.text[:at].rstrip("\n"), outline.text[at:].lstrip("\n")
    return "\n\n".join(filter(None, (before, "\n".join(lines), behind))) + ("" if behind else "\n")


def _lines_of(table: Mapping[str, Any], prefix: Path = ()) -> Iterator[str]:
    """A table line by line, tables within it with dots."""
    for key, value in table.items():
        if isinstance(value, dict) and value:
            yield from _lines_of(value, (*prefix, key))
        else:
            yield f"{_dotted((*prefix, key))} = {literal(value)}"


def _shared(one: Path, other: Path) -> int:
    for k, (a, b) in enumerate(zip(one, other, strict=False)):
        if a != b:
            return k
    return min(len(one), len(other))


def _begin(outline: Outline, number: int) -> int:
    """Beginning of a heading with the comments right above it; the end of the text without one."""
    if number >= len(outline.blocks):
        return len(outline.text)
    at = outline.text.rfind("\n", 0, outline.blocks[number].at) + 1
    while at:
        above = outline.text.rfind("\n", 0, at - 1) + 1
        if not outline.text[above:at].lstrip().startswith("#"):
            break
        at = above
    return at


def _line_end(text: str, at: int) -> int:
    end = text.find("\n", at)
    return len(text) if end < 0 else end


def _added_inline(outline: Outline, value: Value, rest: Path, written: str) -> str:
    """The text with one more item in a list, or one more key in a table between braces."""
    inner = outline.text[value.start + 1 : value.stop - 1]
    mark = outline.text[value.start : value.start + 1]
    if (mark == "[") != isinstance(rest[0], int) or mark not in "[{" or not all(isinstance(p, str) for p in rest[1:]):
        raise EditError("a place that takes nothing more")
    if mark == "[" and len(rest) > 1:
        written = f"{{{_dotted(rest[1:])} = {written}}}"
    item = written if mark == "[" else f"{_dotted(rest)} = {written}"
    at = value.stop - 1
    if mark == "[" and "\n" in inner:  # the last line may end with a comma, and with a comment
        last = max((v.stop for v in outline.values.values() if value.start < v.start and v.stop < value.stop), default=None)
        if last is None:
            return f"{outline.text[: value.start + 1]}{item}{outline.text[value.start + 1 :]}"
        return f"{outline.text[:last]}, {item}{outline.text[last:]}"
    stripped = inner.rstrip()
    gap = inner[len(stripped) :]
    joint = "" if not stripped.strip() else " " if stripped.endswith(",") else ", "
    lead = " " if not stripped.strip() and gap else ""
    return f"{outline.text[: at - len(gap)]}{joint}{lead}{item}{gap}{outline.text[at:]}"


# -- what is taken away --------------------------------------------------------------------------------------------------


def _without_inline(before: Outline, inline: Path, path: Path) -> str:
    """The text without a path and everything below it, between brackets."""
    inside = before.values[inline]
    while taken := min((p for p in before.values if p[: len(path)] == path), key=len, default=None):
        value = before.values[taken]
        siblings = sorted(  # values that belong to the list or table directly, not to one nested in it
            (v.at, v.stop)
            for p, v in before.values.items()
            if not v.statement and inside.start < v.at and v.stop < inside.stop and p[: len(inline)] == inline
            if not any(p[:k] in before.values for k in range(len(inline) + 1, len(p)))
        )
        k = siblings.index((value.at, value.stop))
        if k + 1 < len(siblings):
            begin, end = value.at, siblings[k + 1][0]
        elif k:
            begin, end = siblings[k - 1][1], value.stop
        else:
            begin, end = value.at, value.stop
        text = f"{before.text[:begin]}{before.text[end:]}"
        if isinstance(taken[-1], int) or taken == path:
            return text
        before = outline(text)
        if before.troubles or inline not in before.values:
            raise EditError("a place from which that cannot be taken")
        inside = before.values[inline]
    return before.text


def _without_lines(outline: Outline, path: Path) -> str:
    """The text without the headings and lines of a path and everything below it."""
    gone = [i for i, block in enumerate(outline.blocks) if block.path[: len(path)] == path]
    cuts = [(_begin(outline, i), _begin(outline, i + 1)) for i in gone]
    for at, value in outline.values.items():
        if value.statement and at[: len(path)] == path and value.block not in gone:
            start = outline.text.rfind("\n", 0, value.at) + 1
            cuts.append((start, min(_line_end(outline.text, value.stop) + 1, len(outline.text))))
    text = outline.text
    for begin, end in sorted(cuts, reverse=True):
        text = text[:begin] + text[end:]
    return f"{text.rstrip()}\n" if cuts and max(cuts)[1] == len(outline.text) and text.strip() else text
