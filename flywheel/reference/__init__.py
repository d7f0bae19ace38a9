"""The scene format explained, topic by topic, as the command line prints it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from flywheel.mechanisms import KINDS

if TYPE_CHECKING:
    from flywheel.mechanisms.families import Kind
    from flywheel.scene.scene import Key

__all__ = ["described", "schema_text", "text", "topics"]

_BEFORE = ("overview", "quantities", "expressions", "parameters", "shafts", "mechanism")
_AFTER = (
    *(
        "inertia",
        "load",
        "load-models",
        "tables",
        "spring",
        "gravity",
        "drive",
        "motor",
        "regime",
        "flywheel",
        "wheel",
        "duty",
    ),
    *(
        "stroke",
        "single-stroke",
        "areas",
        "accuracy",
        "faults",
        "results",
        "report",
        "page",
        "motion",
        "reactions",
        "simulate",
        "tradeoff",
        "sweep",
        "designs",
        "catalogue",
        "library",
        "joints",
        "freedoms",
        "bond-graphs",
        "methods",
    ),
)


def topics() -> list[str]:
    """The names of all topics, in reading order.

    >>> topics()[:3]
    ['overview', 'quantities', 'expressions']
    """
    return [*_BEFORE, *KINDS, *_AFTER]


def text(topic: str | None = None) -> str:
    """Text of a topic, in Markdown; the overview if none is named.

    Raises KeyError for a topic that does not exist.

    >>> text("gravity").splitlines()[0]
    '# Gravity: `[gravity]`'
    """
    name = "overview" if topic is None else topic
    if name not in topics():
        raise KeyError(name)
    file = Path(__file__).parent / f"{name}.md"
    return file.read_text(encoding="utf-8") if file.exists() else described(KINDS[name])


def described(kind: Kind) -> str:
    """The topic of a family of mechanisms, from its tables and ports."""
    keys = [(f"{part.name}.{key.name}", key) for part in kind.parts for key in part.keys]
    keys += [(key.name, key) for key in kind.keys]
    rows = [f"| `{path}` | {_value(key)} | {key.about} |" for path, key in keys]
    ports = [f"- `{port.name}`, {'rotating' if port.rotating else 'translating'}: {port.about}." for port in kind.ports]
    head = [f'# {kind.name}: `type = "{kind.name}"`', "", f"{kind.about[:1].upper()}{kind.about[1:]}.", ""]
    return "\n".join([*head, "| key | | |", "| --- | --- | --- |", *rows, "", "Ports:", "", *ports, ""])


def _value(key: Key) -> str:
    """Values of a key: its choices or its kind and range, and its default."""
    what = ", ".join(key.choices) if key.choices else key.kind + ("" if str(key.range) == "any" else f" {key.range}")
    rest = "required" if key.required else "" if key.default is None else f"default {key.default}"
    return f"{what}, {rest}" if rest else what


def schema_text() -> str:
    """The scene format as a JSON Schema (draft 7), by which editors check scenes while they are written.

    >>> '"additionalProperties": false' in schema_text()
    True
    """
    import json

    from flywheel.reading.json_schema import json_schema

    return json.dumps(json_schema(), indent=1, ensure_ascii=False)
