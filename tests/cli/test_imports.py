"""What a command loads: the heavy libraries and parts come in by five doors, and only where they are needed."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import flywheel

ROOT = Path(flywheel.__file__).parents[1]
PRESS, LINKAGE = "examples/machines/press.toml", "examples/linkages/six_bar.toml"
DOORS = ("scipy", "sympy", "matplotlib", "flywheel.mechanisms.linkages", "flywheel.pictures")
LIBRARIES = ("numpy", "scipy", "sympy", "matplotlib", "mpmath")

# a command, and which of the doors (and what beside them) it may not open
COMMANDS: list[tuple[str, tuple[str, ...]]] = [
    ("tradeoff --help", (*DOORS, "bondgraph", "flywheel.machine", "flywheel.sizing", "flywheel.study")),
    (f"size {PRESS} --accuracy normal --json", DOORS),
    (f"size {PRESS}", DOORS[1:]),
    (f"size {PRESS} --accuracy normal --plot {{}}/sizing.svg", ("scipy", "sympy", DOORS[3])),
    (f"draw {PRESS} -o {{}}/press.svg", ("sympy",)),
]


def loaded(code: str, *arguments: str) -> set[str]:
    """The modules of a process at its end, and the packages that they are in."""
    command = [sys.executable, "-c", f"import sys\n{code}\nprint(*sys.modules, file=sys.stderr)", *arguments]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    run = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT, env=environment, timeout=600)
    return set(run.stderr.splitlines()[-1].split())


@pytest.mark.parametrize(("command", "closed"), COMMANDS, ids=[command for command, _ in COMMANDS])
def test_a_command_opens_only_the_doors_that_it_needs(command: str, closed: tuple[str, ...], tmp_path: Path) -> None:
    code = "from flywheel.cli import main\nmain(sys.argv[1:], standalone_mode=False)"
    names = loaded(code, *command.format(tmp_path).split())
    assert "click" in names
    assert names.isdisjoint(closed)


def test_the_import_of_the_library_loads_none_of_its_parts() -> None:
    names = loaded("import flywheel")
    assert [name for name in names if name.startswith("flywheel.")] == []
    assert names.isdisjoint(LIBRARIES)


def test_the_arm_loads_sympy_for_its_equations_alone() -> None:
    assert "sympy" not in loaded("import flywheel.arm")
    assert "sympy" in loaded("import flywheel.arm\nflywheel.arm.lagrange_equations()")
