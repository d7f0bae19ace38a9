"""Starters load, size, say what they are, and never overwrite a file."""

import pytest

import flywheel
from flywheel.reading import load
from flywheel.schema import KINDS
from flywheel.starters import kinds, starter, write_starter


def test_there_is_one_for_every_type():
    assert {kind.name for kind in KINDS.values() if not kind.later} | {"rotor", "areas"} < set(kinds())


@pytest.mark.parametrize("kind", kinds())
def test_starters_can_be_sized_as_they_are(kind):
    scene = load(starter(kind))
    result = flywheel.size(scene, simulate=False)
    assert result.flywheel.needed
    assert result.flywheel.exact > 0
    assert result.reached
    assert scene.title


@pytest.mark.parametrize("kind", kinds())
def test_starters_are_commented_and_fit_a_screen(kind):
    lines = starter(kind).splitlines()
    assert lines[0].startswith("# ")
    assert "flywheel reference" in lines[1]
    assert all(len(line) <= 120 for line in lines)


def test_a_starter_is_written_once(tmp_path):
    path = tmp_path / "press.toml"
    write_starter("press", path)
    assert path.read_text(encoding="utf-8") == starter("press")
    path.write_text("mine")
    with pytest.raises(FileExistsError):
        write_starter("press", str(path))
    assert path.read_text() == "mine"


def test_unknown_kinds(tmp_path):
    with pytest.raises(KeyError):
        starter("../press")
    with pytest.raises(KeyError):
        write_starter("steam", tmp_path / "steam.toml")
    assert not list(tmp_path.iterdir())
