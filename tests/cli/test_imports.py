"""What a command loads: the heavy libraries and parts come in by five doors, and only where they are needed."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import flywheel

ROOT = Path(flywheel.__file__).parents[1]
PRESS = "examples/machines/press.toml"
DOORS = ("scipy", "sympy", "matplotlib", "flywheel.mechanisms.linkages", "flywheel.pictures")
PARTS = ("flywheel.machine", "flywheel.sizing", "flywheel.study", "flywheel.designs", "bondgraph")


def loaded(*steps: str) -> list[set[str]]:
    """The modules of one process after each of these steps, lines of Python or commands of the program."""
    code = "import sys\n"
    for step in steps:
        line = step if step.startswith("import") else f"main({step.split()}, standalone_mode=False)"
        code += f"{line}\nprint('loaded', *sys.modules, file=sys.stderr)\n"
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", code]
    run = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT, env=environment, timeout=600)
    return [set(line.split()) for line in run.stderr.splitlines() if line.startswith("loaded")]


@pytest.mark.slow
def test_the_library_and_its_commands_open_only_the_doors_that_they_need(tmp_path: Path) -> None:
    library, _, told, sized, plotted, drawn, arm = loaded(
        "import flywheel",
        "import flywheel.cli; from flywheel.cli import main",
        "tradeoff --help",
        f"size {PRESS} --accuracy normal --json",
        f"size {PRESS} --accuracy normal --plot {tmp_path}/sizing.svg",
        f"draw {PRESS} -o {tmp_path}/press.svg",
        "import flywheel.arm",
    )
    assert [name for name in library if name.startswith("flywheel.")] == []
    assert library.isdisjoint(("numpy", "scipy", "sympy", "matplotlib", "mpmath"))
    assert "click" in told
    assert told.isdisjoint((*DOORS, *PARTS))
    assert sized.isdisjoint(DOORS)
    assert plotted.isdisjoint(("scipy", "sympy", DOORS[3]))
    assert "flywheel.pictures" in drawn
    assert "sympy" not in drawn
    assert "flywheel.arm" in arm
    assert "sympy" not in arm


@pytest.mark.slow
def test_a_flywheel_that_is_confirmed_opens_no_door() -> None:
    _, confirmed = loaded("import flywheel.cli; from flywheel.cli import main", f"size {PRESS}")
    assert "flywheel.regime.stepping" in confirmed
    assert confirmed.isdisjoint(DOORS)
