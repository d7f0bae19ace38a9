"""`flywheel draw` and `flywheel animate`: files, exit codes, and lines instead of tracebacks."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.test_cli import YOKE, run
from tests.limits import sample

CLAMP = Path(__file__).parents[2] / "examples" / "machines" / "injection_clamp.toml"
AREAS = Path(__file__).parents[2] / "examples" / "machines" / "diagram.toml"


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "yoke.toml"
    path.write_text(YOKE)
    return path


@pytest.mark.parametrize("name", ["a.SVG"])
def test_draw_writes_and_overwrites(scene: Path, tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_text('<?xml version="1.0"?>\n<svg xmlns="http://www.w3.org/2000/svg"/>\n')
    result = run("draw", scene, "--at", "30 deg", "--at", "1 rad", "--path", "crank_pin", "-o", path)
    assert (result.exit_code, result.stdout, result.stderr) == (0, "", "")
    assert path.stat().st_size > 4000


@pytest.mark.slow
def test_a_stroke_is_drawn_at_positions(tmp_path: Path) -> None:
    path = tmp_path / "clamp.svg"
    assert run("draw", CLAMP, "--at", "190 mm", "-o", path).exit_code == 0
    assert path.exists()


@pytest.mark.slow
def test_animate_writes(scene: Path, tmp_path: Path) -> None:
    path = tmp_path / "yoke.gif"
    result = run("animate", scene, "-o", path, "--frames", "2", "--fps", "5")
    assert (result.exit_code, result.stdout, result.stderr) == (0, "", "")
    assert path.read_bytes()[:6] == b"GIF89a"


@pytest.mark.parametrize(("command", "name"), sample([("draw", "yoke.png"), ("animate", "yoke.gif")], 2))
@pytest.mark.slow
def test_a_file_of_the_scenes_name_is_written_once(
    command: str, name: str, scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    first = run(command, scene, *(["--frames", "2"] if command == "animate" else []))
    assert (first.exit_code, first.stderr) == (0, f"wrote {name}\n")
    before = (here / name).read_bytes()
    second = run(command, scene)
    assert (second.exit_code, second.stderr) == (1, f"{name}: exists already and is left as it is; name a file with -o\n")
    assert (here / name).read_bytes() == before


@pytest.mark.parametrize(
    "arguments",
    [
        ["draw", "-o", "a.gif"],
        ["draw", "-o", "a.png", "--at", "30"],
        ["draw", "-o", "a.png", "--at", "190 mm"],
        ["animate", "-o", "a.png"],
        ["animate", "-o", "a.gif", "--frames", "1"],
        ["animate", "-o", "a.gif", "--fps", "51"],
    ],
)
def test_usage_errors(scene: Path, arguments: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    command, *options = arguments
    assert run(command, scene, *options).exit_code == 2
    assert list(tmp_path.iterdir()) == [scene]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["draw", AREAS, "-o", "a.png"], "mechanism: found a diagram of areas, expected a mechanism to draw"),
        (["animate", AREAS, "-o", "a.gif"], "mechanism: found a diagram of areas, expected a mechanism to draw"),
        (["draw", CLAMP, "-o", "a.png", "--at", "300 mm"], "at: found 300 mm, expected a position from"),
        (["draw", CLAMP, "-o", "a.png", "--path", "rodpin"], "did you mean 'rod_pin'?"),
        (["draw", CLAMP, "-o", "missing/a.png"], "missing/a.png: cannot be written (No such file or directory)"),
        (["animate", CLAMP, "--frames", "2", "-o", "missing/a.gif"], "missing/a.gif: cannot be written"),
        (["draw", "nowhere.toml", "-o", "a.png"], "nowhere.toml: found no such file"),
    ],
)
def test_faults_are_one_line(arguments: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    result = run(*arguments)
    assert result.exit_code == 1
    assert said in result.stderr
    assert result.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("command", "name"), [("draw", "yoke.png"), ("animate", "yoke.gif")])
def test_the_scene_itself_is_never_overwritten(command: str, name: str, tmp_path: Path) -> None:
    scene = tmp_path / name
    scene.write_text(YOKE)
    result = run(command, scene, "-o", scene)
    assert result.exit_code == 2
    assert "names the scene itself" in result.stderr
    assert scene.read_text() == YOKE
