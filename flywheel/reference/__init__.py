"""The scene format explained, topic by topic, as the command line prints it."""

from __future__ import annotations

from pathlib import Path

_TOPICS = (
    *("overview", "quantities", "expressions", "parameters", "shafts", "mechanism"),
    *("scotch-yoke", "slider-crank", "four-bar", "crank-shaper", "toggle-clamp", "law", "linkage"),
    *("inertia", "load", "load-models", "tables", "spring", "gravity", "drive", "motor", "regime", "flywheel"),
    *("wheel", "stroke", "areas", "accuracy", "faults", "results", "reactions", "simulate", "tradeoff"),
    *("joints", "bond-graphs"),
)


def topics() -> list[str]:
    """The names of all topics, in the order in which one would read them.

    >>> topics()[:3]
    ['overview', 'quantities', 'expressions']
    """
    return list(_TOPICS)


def text(topic: str | None = None) -> str:
    """What is to be said on a topic, in Markdown; the overview where none is named.

    Raises KeyError for a topic that does not exist.

    >>> text("gravity").splitlines()[0]
    '# Gravity: `[gravity]`'
    """
    name = "overview" if topic is None else topic
    if name not in _TOPICS:
        raise KeyError(name)
    return (Path(__file__).parent / f"{name}.md").read_text(encoding="utf-8")


def schema_text() -> str:
    """The scene format as a JSON Schema (draft 7), which editors check scenes by while they are written.

    >>> '"additionalProperties": false' in schema_text()
    True
    """
    import json

    from flywheel.reading.json_schema import json_schema

    return json.dumps(json_schema(), indent=1, ensure_ascii=False)
