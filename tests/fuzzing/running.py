"""Every way into the library tried on a scene, within limits, and judged."""

import json
import math
import multiprocessing
import os
import re
import resource
import shutil
import signal
import sys
import sysconfig
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import Any, NamedTuple

import numpy as np

import flywheel
from flywheel import SceneError, Sizing
from flywheel.tables.sizing import text as report
from tests.fuzzing.mutants import Mutant, lay_traps, mutant
from tests.limits import piece

# Watching a call: nothing executed, nothing opened that it has no business with, no warning, in time, in memory.


MEMORY = 500  # MB above what the process had
_STALLED = 30  # seconds on the clock for every second of computing: a call that waits for something
_LIBRARIES = tuple({*sysconfig.get_paths().values(), str(Path(__file__).parents[2]), sys.base_prefix})
_GENERATORS = ("dataclasses.py", "collections/__init__.py", "typing.py", "enum.py", "functools.py")
_GENERATORS += ("bondgraph/records.py", "bondgraph/motion/runge_kutta.py")  # of constructors and of unrolled sums
_RECORDED = "<recorded>"  # operations and the names of places: no text of a scene can stand in it
_OF_ITS_OWN = ', "right")'  # the side of numpy's search, which no scene writes
_OF_SCENES = ("'", '"', "\\", "#")
_FORBIDDEN = (
    *("os.system", "os.exec", "os.spawn", "os.posix_spawn", "os.fork", "os.forkpty", "os.remove", "os.rename", "os.mkdir"),
    *("os.rmdir", "os.link", "os.symlink", "os.chmod", "os.chown", "os.truncate", "os.kill", "os.putenv", "os.utime"),
    *("subprocess.", "socket.", "shutil.", "tempfile.", "urllib.", "ftplib.", "smtplib.", "webbrowser.", "pickle.", "pty."),
    *("code.__new__", "builtins.input", "sys.settrace", "sys.setprofile", "http.", "sqlite3.", "mmap.", "signal.", "fcntl."),
)


class TooSlow(BaseException):
    """Out of time; no `except Exception` may swallow it."""


class Watched(NamedTuple):
    """Observations while a call ran: seconds of computing, MB above the beginning, and forbidden events."""

    seconds: float
    memory: float
    seen: list[str]


class _Watch:
    """The one hook of the process (hooks cannot be taken out again), and the folder that is watched, if any is."""

    folder: str | None = None
    seen: list[str]
    hooked = False

    def __init__(self) -> None:
        self.seen = []

    def begin(self, folder: Path) -> None:
        if not self.hooked:
            sys.addaudithook(self.hook)
            self.hooked = True
        self.folder, self.seen = os.path.realpath(folder), []

    def hook(self, event: str, args: tuple[Any, ...]) -> None:
        if self.folder is None:
            return
        if event == "open":
            self.check_open(*args)
        elif event == "exec":
            self.check_code(args[0].co_filename)
        elif event == "compile" and args[1] == _RECORDED:
            text = (args[0].decode() if isinstance(args[0], bytes) else str(args[0])).replace(_OF_ITS_OWN, "")
            if any(sign in text for sign in _OF_SCENES):
                self.seen.append(f"compile {args[0]!r}"[:200])
        elif event == "compile" and args[1] not in ("<unknown>", "<string>", None) and not _of_library(str(args[1])):
            self.seen.append(f"compile {args[1]!r}")
        elif event.startswith(_FORBIDDEN):
            self.seen.append(f"{event} {args!r}"[:200])

    def check_open(self, path: Any, mode: str | None, flags: int) -> None:
        """Only the scene's folder and the code itself, and only to be read."""
        if isinstance(path, int):
            return
        real = os.path.realpath(os.fsdecode(path))
        inside = real == self.folder or real.startswith(f"{self.folder}{os.sep}")
        reading = not flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)
        if not (reading and (inside or _of_library(real))) and "__pycache__" not in real:
            self.seen.append(f"open {real!r} {mode}")

    def check_code(self, name: str) -> None:
        """Code from text is what dataclasses and named tuples are made of, and nothing else."""
        if _of_library(name) or name.startswith("<frozen") or name == _RECORDED:
            return
        caller = sys._getframe(2).f_code.co_filename
        if not caller.endswith(_GENERATORS) and "site-packages" not in caller:
            self.seen.append(f"exec {name!r} from {caller}")


_WATCH = _Watch()


def _of_library(name: str) -> bool:
    return name.startswith(_LIBRARIES)


@contextmanager
def watched(folder: Path, seconds: float, results: list[Watched]) -> Iterator[None]:
    """Watch what is done with a folder; TooSlow is raised after so many seconds of computing, or 30 times that in all."""

    def stop(number: int, frame: FrameType | None) -> None:
        raise TooSlow(f"{seconds} s")

    before = [signal.signal(number, stop) for number in (signal.SIGPROF, signal.SIGALRM)]
    start, base = time.process_time(), _fresh_peak()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        _WATCH.begin(folder)
        signal.setitimer(signal.ITIMER_PROF, seconds, 0.5)
        signal.setitimer(signal.ITIMER_REAL, _STALLED * seconds, 0.5)
        try:
            yield
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
            signal.setitimer(signal.ITIMER_REAL, 0)
            _WATCH.folder = None
            for number, handler in zip((signal.SIGPROF, signal.SIGALRM), before, strict=True):
                signal.signal(number, handler)
            seen = [*_WATCH.seen, *(f"{w.category.__name__}: {w.message} ({w.filename}:{w.lineno})" for w in caught)]
            results.append(Watched(time.process_time() - start, _peak() - base, seen))


def _fresh_peak() -> float:
    """MB in use now, with the record of the peak begun anew where the system can do that."""
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")
    return _peak()


def _peak() -> float:
    """Greatest memory in use since the record began, MB."""
    try:
        status = Path("/proc/self/status").read_text()
        return int(status.split("VmHWM:")[1].split()[0]) / 1024
    except (OSError, IndexError):
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def limit_memory(megabytes: int) -> Callable[[], None]:
    """A hard limit for this process, so that a scene that asks for all memory is caught; gives back what lifts it."""
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (megabytes << 20, hard))
    return lambda: resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


# What becomes of one mutant: a sane result, faults that can be read, or a failure.


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
    result = sizing.as_dict()
    wrong = [f"{path} = {value}" for path, value in _numbers(result) if not math.isfinite(value)]
    assert not wrong, f"not finite: {', '.join(wrong[:5])}"
    errors = [(name, value) for name, value in _numbers(result["error"]) if value < 0]
    assert not errors, f"negative errors: {errors}"
    names = ("exact", "simulation", "approximate", "inertia_torque", "inertia_torque_flywheel", "work")
    relative = [result["error"][name] for name in names]
    assert sizing.reached == all(error is None or error <= sizing.rtol for error in relative)
    assert sizing.reached or sizing.messages, "not reached, and nothing said"
    assert all(message.isprintable() and len(message) < LONGEST_FAULT for message in sizing.messages), sizing.messages
    assert sizing.speed > 0, sizing.speed
    assert sizing.energy_fluctuation >= 0, sizing.energy_fluctuation
    assert json.dumps(result, allow_nan=False)
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


# Scenes that once led to a traceback, a warning, a hang or a fault too long, by content: here and in the folder `kept`.


_ROTOR = """
[[inertia]]
on = "crank"
value = 2
[drive]
torque = "balance"
[regime]
speed = "130 rpm"
[flywheel]
irregularity = "5 %"
"""
_MOTOR = """
[drive]
motor = {type = "dc", voltage = "220 V", power = "1.5 kW", speed = "1000 rpm", efficiency = "82 %"}
[flywheel]
irregularity = "2 %"
"""
_CYLINDER = """
[mechanism]
type = "linkage"
driver = "slide"
bodies = {frame = {points = {O = [0, 0]}}, ram = {mass = 2}}
joints = [{name = "slide", type = "slide", between = ["frame.O", "ram.origin"]}]
[stroke]
from = 0.4
to = 0.6
speed = "50 mm/s"
"""


def _loads(*laws: str) -> str:
    return "".join(f'[[load]]\non = "crank"\ntorque = "{law}"\n' for law in laws)


SCENES = {
    "a sine of speed": _ROTOR + _loads("sin(omega*1e9)", "-60*sin(phi)"),
    "a load that varies little": _MOTOR + _loads("1*cos(2*phi - 2.273)**2 - tan(phi/8) - tan(phi/8)"),
    "a thousand jumps and a motor": _MOTOR + _loads("sign(sin(500*phi))"),
    "enormous beside ordinary": _ROTOR + _loads("1e300", "-100*abs(sin(1.5*phi))"),
    "squares out of range": _ROTOR + _loads("1e160*sin(phi)"),
    "enormous quantity": _ROTOR + '[[load]]\non = "crank"\ntorque = "1000000000000000000 N m"\n' + _loads("-9e3*sin(phi)"),
    "an exponent that jumps": _ROTOR + _loads("max(2*sin(phi), abs(omega**(phi < 1)))"),
    "an exponent that varies": _ROTOR + _loads("min(tan(1.0*(phi > 1000)) - max(abs(omega**phi), 100), 3)**-2"),
    "a long text, infinite": _ROTOR + _loads("+".join(["phi"] * 200) + " + 1/phi"),
    "a driving force out of range": _CYLINDER + '[[load]]\non = "slide"\nforce = "-1e308*x*100 + (0 - pi)**(-v)"\n',
    "line separators": _ROTOR.replace("130 rpm", "130 " + "\u2028" * 100),
    "a number of a million digits": _ROTOR + '[[load]]\non = "crank"\ntable = {file = "digits.csv"}\n',
    "names of columns in UTF-16": _ROTOR + '[[load]]\non = "crank"\ntable = {file = "wide.csv", column = "torque"}\n',
}
SCENES |= {file.stem: file.read_text() for file in sorted((Path(__file__).parent / "kept").glob("*.toml"))}

FILES = {
    "wide.csv": "angle,torque\n0,1\n6.283185307179586,1\n".encode("utf-16-be"),
    "digits.csv": b"0," + b"1" * 10**5 + b"\n6.283185307179586,1\n",
}

REFUSED = {
    "a sine of speed": "flywheel.irregularity: found no periodic motion near",
    "enormous beside ordinary": "load[0].torque: found a value that reaches",
    "squares out of range": "load[0].torque: found a value that reaches",
    "a long text, infinite": "load[0].torque: found a value that is not finite at crank angle 0 deg (1/phi: a division",
    "a driving force out of range": "load[0].force: found a value that is not finite at slide position 0.5 m and 0.05 m/s",
    "line separators": 'regime.speed: found "130 \\u2028',
    "a number of a million digits": 'load[0].table.value: found "1111',
    "names of columns in UTF-16": 'load[0].table.file: found "wide.csv", a text in UTF-16',
    "end_of_the_range": "load[0].force: found a value that reaches",
    "law_out_of_range": "mechanism.outputs.table.theta: found a second derivative that is not finite",
    "many_assemblies": "mechanism: found guesses that fit several assemblies",
    "nearly_standing_still": "flywheel.inertia: found I* + J = 0 kg m² at crank angle ",
    "sense_of_a_dwell": "load[0]: found linkage.ram, whose velocity changes sign too often",
    "sine_of_speed_on_a_linkage": "flywheel.irregularity: found no periodic motion near",
    "switch_that_chases_its_cells": "load: found laws that switch",
    "ten_thousand_waves_and_a_motor": "load[2].torque: found sin(1e4*phi): varies too fast for 10000 cells",
    "wave_too_fast_to_follow": "load[0].torque: found sin(exp(phi*3)): varies too fast for 10000 cells",
}
"""Beginning of the first fault of those that are refused; all others are sized."""
NOT_REACHED = ("balance_to_the_last_digit",)
BY_CHANCE = ("a thousand jumps and a motor", "next_to_no_load", "layered_mesh", "steep_torque_of_speed")
"""Sized: whether as well as asked, the last digit of a speed decides."""
DEAR = (
    *("enormous quantity", "layered_mesh", "sine_of_speed_on_a_linkage", "a thousand jumps and a motor"),
    *("steep_torque_of_speed", "law_out_of_range"),
)
"""Seconds each: not in the default run."""
BY_HAND = ("a sine of speed", "a load that varies little")
"""The dearest, each like another one: `python -m tests.fuzzing --kept` tries them with all others."""


def as_expected(name: str, outcome: str, detail: str) -> bool:
    """Tests whether a scene has the outcome that it has had since it was corrected."""
    if name in REFUSED:
        return outcome == "refused" and re.sub(r" \([^()]*line \d+\)", "", detail, count=1).startswith(REFUSED[name])
    if name in BY_CHANCE:
        return outcome == "sized" and detail in ("", "not reached")
    return (outcome, detail) == ("sized", "not reached" if name in NOT_REACHED else "")


# Many mutants, tried in processes of their own, so that one that dies or hangs takes nothing with it.


_AT_ONCE = 500  # mutants that one process is given
_MOST_WORK = 900.0  # seconds without a word after which a process is taken for hung
_COMMANDS = (
    "size",
    "size --json --no-simulate",
    "reduce --points 7",
    "graph",
    "reactions",
    "size --rtol 1e-6 --no-simulate",
)


class Tried(NamedTuple):
    """A mutant's seed, kind and base, the way it was tried, and its verdict."""

    seed: int
    kind: str
    base: str
    way: str
    verdict: Verdict


def way_of(seed: int) -> str:
    """Route of a mutant: one in 15 in time, one in 15 by a command, all others by load, size and reduce."""
    return "time" if seed % 15 == 7 else _COMMANDS[seed // 15 % len(_COMMANDS)] if seed % 15 == 11 else "library"


def tried(seed: int) -> Tried:
    """One mutant, tried."""
    result = mutant(seed)
    way = way_of(seed)
    verdict = judged(result, simulate=way == "time", command="" if way in ("time", "library") else way)
    return Tried(seed, result.kind, result.base, way, verdict)


def again(name: str) -> Verdict:
    """A scene that once failed, tried by the library."""
    files = {file: content for file, content in FILES.items() if file in SCENES[name]}
    return judged(Mutant(0, "kept", name, SCENES[name].encode(), files))


def _worker(seeds: list[int], results: "multiprocessing.Queue[Tried | int]") -> None:
    limit_memory(6000)
    for seed in seeds:
        results.put(seed)
        results.put(tried(seed))


def all_tried(seeds: list[int], jobs: int) -> Iterator[Tried]:
    """Every mutant tried, by so many processes; one that dies or hangs is a failure of the mutant it was at."""
    context = multiprocessing.get_context("spawn")
    waiting = [seeds[i : i + _AT_ONCE] for i in range(0, len(seeds), _AT_ONCE)][::-1]
    running: list[_Process] = []
    while waiting or running:
        while waiting and len(running) < jobs:
            running.append(_Process(context, waiting.pop()))
        for process in list(running):
            yield from process.said()
            if process.over:
                running.remove(process)
                if process.at is not None:
                    yield process.failure()
                elif process.left:
                    raise RuntimeError(f"a process ended with {process.process.exitcode} before its first mutant")
                if process.left:
                    waiting.append(process.left)
        time.sleep(0.02)


class _Process:
    """A process, the mutants it has still to try, and the one it is at."""

    def __init__(self, context: multiprocessing.context.SpawnContext, seeds: list[int]) -> None:
        self.results = context.Queue()
        self.process = context.Process(target=_worker, args=(seeds, self.results), daemon=True)
        self.process.start()
        self.left, self.at, self.heard = list(seeds), None, time.monotonic()

    def said(self) -> Iterator[Tried]:
        alive = self.process.is_alive()
        while not self.results.empty():
            result = self.results.get()
            self.heard = time.monotonic()
            if isinstance(result, int):
                self.at = result
                self.left.remove(result)
            else:
                self.at = None
                yield result
        if alive and time.monotonic() - self.heard > _MOST_WORK:
            self.process.kill()
            self.process.join()

    @property
    def over(self) -> bool:
        return not self.process.is_alive() and self.results.empty()

    def failure(self) -> Tried:
        assert self.at is not None
        result = mutant(self.at)
        detail = f"the process ended with {self.process.exitcode}, or hung"
        return Tried(self.at, result.kind, result.base, way_of(self.at), Verdict("failed", detail, 0.0, 0.0))
