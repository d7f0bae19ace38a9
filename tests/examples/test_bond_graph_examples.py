"""Every script on bond graphs runs: its `main` prints, and draws a picture into the file that it is given."""

from __future__ import annotations

import inspect
import runpy
from pathlib import Path

import matplotlib as mpl
import pytest

from tests.limits import sample

mpl.use("Agg")

FOLDER = Path(__file__).parents[2] / "examples" / "bond_graphs"
SCRIPTS = sorted(FOLDER.glob("*.py"))
DRAWS_LEAST = 10_000  # bytes of a picture with something in it


def name(path: Path) -> str:
    return path.stem


def test_there_are_scripts():
    assert FOLDER / "compare_methods.py" in SCRIPTS


@pytest.mark.parametrize("script", sample(SCRIPTS[::-1], 3), ids=name)
def test_main_prints_and_draws(script, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.argv", [script.name])
    main = runpy.run_path(str(script), run_name="example")["main"]
    picture = tmp_path / "picture.png"
    takes_a_file = "path" in inspect.signature(main).parameters
    main(path=str(picture)) if takes_a_file else main()
    printed = capsys.readouterr().out
    assert printed.strip()
    if script.stem == "compare_methods":  # tells the methods apart
        assert (printed.count("Pearson r"), printed.count("crank side")) == (6, 4)
        assert "small lambda, m l²/3" in printed
        assert printed.count("alpha left at 0") == 1  # at a constant speed there is none to leave
        assert len(list(tmp_path.glob("picture_*.png"))) == 5
        beside = [line.split() for line in printed.splitlines() if ": flywheel.motion" in line]
        assert len(beside) == 2 * 3 + 2 * 6
        assert max(float(words[-3]) for words in beside) < 1e-9  # greatest residual
    if script.stem == "rosenberg":
        assert "23 bonds  by the rules; I*(0.5 rad) = 0.1416 kg m²" in printed
        assert "19 bonds  rod's centre held on the line, as there; I*(0.5 rad) = 0.2052 kg m²" in printed
    if takes_a_file:
        assert picture.read_bytes().startswith(b"\x89PNG")
        assert picture.stat().st_size > DRAWS_LEAST
