"""Files that are written: completely or not at all, and never over a file of another kind.

A file is written beside its place and renamed when it is complete, so that a failure leaves the old one. An existing file is
replaced only if it is of the same kind: a picture by its signature, CSV, JSON and text by the same beginning as the new
text. No file that was read is ever replaced, under any name.
"""

from __future__ import annotations

import errno
import os
import re
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_SIGNATURES: dict[str, re.Pattern[bytes]] = {
    "png": re.compile(rb"\x89PNG\r\n\x1a\n"),
    "svg": re.compile(rb"(\xef\xbb\xbf)?\s*(<\?xml.{0,2000})?(<!--.{0,2000}|<!DOCTYPE svg\s|<svg[\s>])", re.DOTALL),
    "pdf": re.compile(rb"%PDF-"),
    "gif": re.compile(rb"GIF8[79]a"),
    "npz": re.compile(rb"PK\x03\x04.{26}flywheel_sweep\.npy", re.DOTALL),
    "parquet": re.compile(rb"PAR1"),
}
_HEAD = 4096  # bytes of a file that tell its kind
_COLUMNS, _KEYS = 3, 2  # of a CSV's header and a JSON object, which tell ours from others
_KEY = re.compile(r'\s*"((?:[^"\\]|\\.)*)"\s*:\s*(?:"(?:[^"\\]|\\.)*"|[\w.+-]+)?\s*,?')


class RefusalError(OSError):
    """A file that is not written because of an existing one."""

    def __init__(self, reason: str, path: Path) -> None:
        super().__init__(errno.EEXIST, reason, str(path))


class InputError(RefusalError):
    """A file that is not written because it was read."""


def check(path: str | Path, kind: str, inputs: Iterable[str | Path] = (), text: str = "") -> None:
    """Refuses a place that a file of some kind ("png", "svg", "pdf", "gif", "npz", "parquet", "text") cannot have.

    Raises:
        OSError: with the reason as its `strerror`. `text` is the new text, if known.

    """
    path = Path(path)
    for source in inputs:
        if _same(path, Path(source)):
            raise InputError(f"it is {Path(source).name}, which is read: an output never replaces an input", path)
    if not path.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
    if not path.exists():
        return
    mode = path.stat().st_mode
    if stat.S_ISDIR(mode):
        raise RefusalError("it is a folder", path)
    if not stat.S_ISREG(mode):
        return
    if not os.access(path, os.W_OK):
        raise PermissionError(errno.EACCES, "Permission denied", str(path))
    with path.open("rb") as file:
        head = file.read(_HEAD)
    if head and not (_SIGNATURES[kind].match(head) if kind in _SIGNATURES else _alike(head, text)):
        what = f"is no {kind.upper()}" if kind in _SIGNATURES else "its content is of another kind"
        raise RefusalError(f"it exists already and {what}: give another name, or remove it first", path)


@contextmanager
def replacement(path: str | Path, kind: str, inputs: Iterable[str | Path] = (), text: str = "") -> Iterator[Path]:
    r"""A new file's path, to be written within the block; it replaces `path` when the block has ended without an error.

    A link keeps its place, and the file that it leads to is replaced; a pipe or device is written directly.

    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     place = Path(folder) / "a.csv"
    ...     for text in ("phi [rad],M [N m]\n1,2\n", "phi [rad],M [N m]\n3,4\n"):
    ...         with replacement(place, "text", text=text) as fresh:
    ...             _ = fresh.write_text(text)
    ...     place.read_text()
    'phi [rad],M [N m]\n3,4\n'

    """
    check(path, kind, inputs, text)
    path = Path(path)
    if path.exists() and not path.is_file():
        # without a reader it would block for ever
        if path.is_fifo():
            try:
                os.close(os.open(path, os.O_WRONLY | os.O_NONBLOCK))
            except OSError as error:
                if error.errno == errno.ENXIO:
                    raise RefusalError("it is a pipe without a reader", path) from error
                raise
        yield path
        return
    place = Path(os.path.realpath(path))
    fresh = place.with_name(f".{os.getpid()}.{abs(hash(place.name)) % 10**8}.tmp")
    try:
        yield fresh
        if place.exists():
            fresh.chmod(stat.S_IMODE(place.stat().st_mode))
        fresh.replace(place)
    finally:
        with suppress(OSError):
            fresh.unlink(missing_ok=True)


def write_text(path: str | Path, text: str, inputs: Iterable[str | Path] = ()) -> None:
    """Writes CSV, JSON or text, UTF-8 with unchanged line ends."""
    with replacement(path, "text", inputs, text) as fresh:
        fresh.write_text(text, encoding="utf-8", newline="")


def _same(path: Path, file: Path) -> bool:
    """True if two names lead to one file: through links, folders, hard links, or letters of another case."""
    try:
        return path.samefile(file)
    except OSError:
        return False


def _alike(head: bytes, text: str) -> bool:
    """True if a file begins like a text: with its first keys, columns, or line."""
    try:
        there = head.decode("utf-8")
    except UnicodeDecodeError as error:
        if error.start < len(head) - 4:  # not the last letter, cut in two
            return False
        there = head[: error.start].decode("utf-8")
    beginning = _keys if text.lstrip().startswith("{") else _columns
    return not text or beginning(there) == beginning(text)


def _keys(text: str) -> list[str]:
    """The first keys of a JSON object."""
    names: list[str] = []
    at = text.find("{") + 1
    while len(names) < _KEYS and at and (match := _KEY.match(text, at)):
        names.append(match[1])
        at = match.end()
    return names if text.lstrip().startswith("{") else []


def _columns(text: str) -> list[str]:
    """The first columns of a header, or the first line of a text."""
    line = next(iter(text.splitlines()), "")
    return line.split(",")[:_COLUMNS]
