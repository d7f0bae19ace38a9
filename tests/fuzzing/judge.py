"""What becomes of one mutant: a sane result, faults that can be read, or a failure."""

import json
import math
import shutil
import tempfile
import traceback
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import flywheel
from flywheel.numerics.faults import SceneError
from flywheel.sizing.results import Sizing
from flywheel.tables.sizing import text as report
from tests.fuzzing.guards import MEMORY, TooSlow, Watched, watched
from tests.fuzzing.mutants import Mutant
from tests.fuzzing.tables import lay_traps
from tests.limits import piece

WORK, WORK_IN_TIME = 2000, 5000  # pieces of `pace`, ten times what is ordinary: a hang, not a slow machine
LONGEST_FAULT = 400
_SEVEN = np.linspace(0.0, 6.0, 7)


class Verdict(NamedTuple):
    """The outcome (`sized`, `reduced`, `refused` or `failed`), what was said of it, seconds and MB."""

    outcome: str
    detail: str
    seconds: float
    memory: float


def judged(mutant: Mutant, *, simulate: bool = False, command: str = "") -> Verdict:
    """Try a mutant by the library (also in time), or by a command."""
    folder = Path(tempfile.mkdtemp(prefix="fuzzing-"))
    try:
        _laid_out(mutant, folder)
        return _tried(folder, simulate, command)
    finally:
        shutil.rmtree(folder)


def _laid_out(mutant: Mutant, folder: Path) -> None:
    (folder / "scene.toml").write_bytes(mutant.content)
    for name, content in mutant.files.items():
        (folder / name).write_bytes(content)
    lay_traps(folder)


def _tried(folder: Path, simulate: bool, command: str) -> Verdict:
    before, results = _names(folder), list[Watched]()
    outcome, detail = "failed", ""
    try:
        with watched(folder, piece() * (WORK_IN_TIME if simulate or command else WORK), results):
            outcome, detail = _by_command(folder, command) if command else _by_library(folder, simulate)
    except TooSlow as slow:
        detail = f"too slow: more than {slow}{_where(slow)}"
    except BaseException as error:
        detail = f"{type(error).__name__}: {str(error)[:200]}{_where(error)}"
    seen = list(results[0].seen)
    if results[0].memory > MEMORY:
        seen.append(f"{results[0].memory:.0f} MB")
    if _names(folder) != before:
        seen.append("files were changed")
    if seen:
        outcome, detail = "failed", f"{'; '.join(seen[:3])} {detail}"
    return Verdict(outcome, detail, results[0].seconds, results[0].memory)


def _names(folder: Path) -> list[str]:
    return sorted(str(path) for path in folder.rglob("*"))


def _where(error: BaseException) -> str:
    """The last places of the package on the way to an error."""
    places = [
        f"{Path(f.filename).name}:{f.lineno}"
        for f in traceback.extract_tb(error.__traceback__)
        if "/flywheel/" in f.filename
    ]
    return f" at {' '.join(places[-6:])}"


def _by_library(folder: Path, simulate: bool) -> tuple[str, str]:
    """Load, reduce and size a scene; AssertionError for what must not be."""
    try:
        scene = flywheel.load(folder / "scene.toml")
        if scene.stroke is not None:
            middle = 0.5 * (scene.stroke.start + scene.stroke.end)
            passage = flywheel.along(scene, [middle]) if math.isfinite(middle) else None
            assert passage is None or np.isfinite(passage.driving).all(), "a driving action that is not finite"
            return "reduced", ""
        sizing = flywheel.size(scene, simulate=simulate)
        _check_sizing(sizing)
        if scene.areas is None:
            state = flywheel.reduce(sizing.machine or scene, _SEVEN)
            assert np.isfinite(state.inertia).all(), "an inertia that is not finite"
        return "sized", "" if sizing.reached else "not reached"
    except SceneError as error:
        return "refused", _checked_faults(error)


def _checked_faults(error: SceneError) -> str:
    lines = [str(fault) for fault in error.faults]
    assert lines, "no faults"
    for fault, line in zip(error.faults, lines, strict=True):
        assert line.isprintable(), f"not one plain line: {line[:200]!r}"
        assert len(line) < LONGEST_FAULT, f"a fault of {len(line)} characters: {line[:200]}"
        assert all(fault[:3]), f"says nothing: {line}"
    return lines[0]


def _check_sizing(sizing: Sizing) -> None:
    found = sizing.as_dict()
    wrong = [f"{path} = {value}" for path, value in _numbers(found) if not math.isfinite(value)]
    assert not wrong, f"not finite: {', '.join(wrong[:5])}"
    errors = [(name, value) for name, value in _numbers(found["error"]) if value < 0]
    assert not errors, f"negative errors: {errors}"
    names = ("exact", "simulation", "approximate", "inertia_torque", "inertia_torque_flywheel", "work")
    relative = [found["error"][name] for name in names]
    assert sizing.reached == all(error is None or error <= sizing.rtol for error in relative)
    assert sizing.reached or sizing.messages, "not reached, and nothing said"
    assert all(message.isprintable() and len(message) < LONGEST_FAULT for message in sizing.messages), sizing.messages
    assert sizing.speed > 0, sizing.speed
    assert sizing.energy_fluctuation >= 0, sizing.energy_fluctuation
    assert json.dumps(found, allow_nan=False)
    assert report(sizing)


def _numbers(value: Any, path: str = "") -> Iterator[tuple[str, float]]:
    """Every number of a result, with its place."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        yield from _numbers(item, f"{path}.{key}")
    if isinstance(value, float):
        yield path, value


def _by_command(folder: Path, command: str) -> tuple[str, str]:
    """Run a command on the scene: exit code 0 with something on standard output, or 1 with faults."""
    from click.testing import CliRunner

    from flywheel.cli import main

    name, *options = command.split()
    result = CliRunner().invoke(main, [name, str(folder / "scene.toml"), *options])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    lines = result.stderr.splitlines()
    assert result.exit_code in (0, 1), f"exit code {result.exit_code}: {result.output[:200]}"
    assert "Traceback" not in result.output
    assert result.stdout.strip() if result.exit_code == 0 else lines, "nothing said"
    assert all(len(line) < LONGEST_FAULT + 200 for line in lines), lines
    return ("refused", lines[0]) if result.exit_code else ("sized", "")
