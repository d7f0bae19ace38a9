"""Good scenes to begin with: examples, references, starters, and what the reference texts show."""

import re
from functools import cache
from pathlib import Path
from typing import NamedTuple

from flywheel.reference import text, topics

ROOT = Path(__file__).parents[2]
_FOLDERS = ("examples", "tests/references/scenes", "flywheel/starters")


class Base(NamedTuple):
    """A scene's text with the files beside it that it names."""

    name: str
    text: str
    files: dict[str, bytes]


@cache
def corpus() -> tuple[Base, ...]:
    """Every scene of the project, in an order that does not change."""
    scenes = [scene for folder in _FOLDERS for scene in sorted((ROOT / folder).rglob("*.toml"))]
    return (*map(_from_file, scenes), *_from_texts())


@cache
def with_tables() -> tuple[Base, ...]:
    """Those that read a CSV file."""
    return tuple(base for base in corpus() if base.files)


def _from_file(scene: Path) -> Base:
    content = scene.read_text(encoding="utf-8")
    named = [file for file in sorted(scene.parent.glob("*.csv")) if file.name in content]
    return Base(str(scene.relative_to(ROOT)), content, {file.name: file.read_bytes() for file in named})


def _from_texts() -> list[Base]:
    blocks = [(topic, block) for topic in topics() for block in re.findall(r"```toml\n(.*?)```", text(topic), re.DOTALL)]
    return [Base(f"reference {topic}", block, {}) for topic, block in blocks]
