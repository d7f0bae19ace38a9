"""Watching a call: nothing executed, nothing opened that it has no business with, no warning, in time, in memory."""

import os
import resource
import signal
import sys
import sysconfig
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import Any, NamedTuple

MEMORY = 500  # MB above what the process had
_STALLED = 30  # seconds on the clock for every second of computing: a call that waits for something
_LIBRARIES = tuple({*sysconfig.get_paths().values(), str(Path(__file__).parents[2]), sys.base_prefix})
_GENERATORS = ("dataclasses.py", "collections/__init__.py", "typing.py", "enum.py", "functools.py")
_GENERATORS += ("bondgraph/records.py", "bondgraph/motion/runge_kutta.py")  # of constructors and of unrolled sums
_RECORDED = "<recorded>"  # operations and the names of places: no text of a scene can stand in it
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
    """What was seen while a call ran: seconds of computing, MB above the beginning, and what must not be."""

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
            text = args[0].decode() if isinstance(args[0], bytes) else str(args[0])
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
