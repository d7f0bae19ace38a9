"""Scenes of the tests of commands."""

from pathlib import Path

import pytest


@pytest.fixture
def scene(tmp_path: Path):
    def written(content: str) -> Path:
        path = tmp_path / "alone.toml"
        path.write_text(content)
        return path

    return written
