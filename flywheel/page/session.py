"""The scene on the disk: read, watched, and saved without loss of another program's changes.

The content of the file is identified by the hash of its bytes, `seen`. It is replaced only if the caller has seen it
and confirms; if it has changed since, the caller gets the present text. A file is written to a temporary name and
renamed when it is complete; a link, the permissions, the byte order mark and the line ends of the file are kept.
"""

from __future__ import annotations

import os
import stat
import tomllib
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from tempfile import NamedTemporaryFile
from threading import Lock
from typing import Any, NamedTuple

from flywheel.language import text as _
from flywheel.numerics.faults import SceneError
from flywheel.reading.scenes import LARGEST, file_text
from flywheel.starters import kinds, starter

_MARK = "\ufeff"
_EXAMPLES = Path(__file__).parents[2] / "examples"
_NO_FILE = ""  # what has been seen of a file that is not there


class Refusal(Exception):
    """Reason why a text is not saved, in a line."""


class Conflict(Exception):
    """A text that is not saved before the user has seen the present file."""

    def __init__(self, reason: str, text: str, seen: str) -> None:
        self.told = {"reason": reason, "text": text, "seen": seen}
        super().__init__(reason)


class OnDisk(NamedTuple):
    """A file: its text with plain line ends, the hash of its bytes, and their encoding."""

    text: str
    seen: str
    mark: bool = False
    line_end: str = "\n"


def on_disk(file: Path) -> OnDisk:
    """A scene's file; raises SceneError where it cannot be read."""
    text = file_text(file)
    content = file.read_bytes()
    plain = text.replace("\r\n", "\n").replace("\r", "\n")
    line_end = "\r\n" if "\r\n" in text else "\n"
    return OnDisk(plain, sha256(content).hexdigest(), content.startswith(_MARK.encode()), line_end)


class Session:
    """One scene and its file; without a file, the folder in which the page was opened."""

    def __init__(self, path: Path | None = None, language: str = "en") -> None:
        self.path = None if path is None else Path(os.path.abspath(path))
        self.folder = Path.cwd() if self.path is None else self.path.parent
        self.language = language
        self._own = set() if self.path is None else {str(self.path)}  # files that pages have opened or saved
        self._lock = Lock()
        if self.path is not None:
            on_disk(self.path)

    @property
    def name(self) -> str:
        """The file's name."""
        return "scene.toml" if self.path is None else self.path.name

    @property
    def stem(self) -> str:
        """The file's name without its ending, in letters that any system takes."""
        stem = "".join(c if c.isascii() and (c.isalnum() or c in "-_") else "_" for c in Path(self.name).stem)
        return stem or "scene"

    def scene(self) -> dict[str, Any]:
        """Data of a page when it is opened: the text on the disk now, and the other scenes to start from."""
        there = self._there(self.path)
        return {
            "text": there.text,
            "name": self.name,
            "path": None if self.path is None else str(self.path),
            "seen": there.seen,
            "language": self.language,
            "examples": list(examples()),
            "version": _version(),
        }

    def watch(self, seen: str, path: str = "") -> dict[str, Any]:
        """Tests whether a page's file (default: the scene's own) differs from the content that the page has seen."""
        there = self._there(Path(path) if path in self._own else self.path)
        if there.seen == seen:
            return {"seen": seen, "changed": False}
        return {"seen": there.seen, "changed": True, "text": there.text}

    def folder_of(self, origin: str) -> Path:
        """Folder of a scene's CSV files: that of the example that it comes from, else that of the scene."""
        found = _example_files().get(origin) if origin else None
        return self.folder if found is None else found.parent

    def start(self, name: str) -> dict[str, str]:
        """A starter or an example by its id; raises KeyError for another."""
        group, _, kind = name.partition("/")
        if group == "starter":
            return {"text": starter(kind), "name": f"{kind}.toml", "origin": ""}
        file = _example_files()[name]
        return {"text": on_disk(file).text, "name": file.name, "origin": name}

    def save(self, text: str, path: str | None, over: bool, seen: str) -> dict[str, Any]:
        """Writes the text into the scene's own file, or into one that is named relative to its folder.

        Raises:
            Conflict: the file exists and `over` is not set, or its content is not the one seen.
            Refusal: it cannot be written there, or the text is too long.

        """
        content = text.encode("utf-8", "replace")
        if len(content) > LARGEST:
            raise Refusal(_("a text of more than 1 MiB is no scene: put long tables into a CSV file"))
        with self._lock:
            file = self._place(path)
            there = self._there(file)
            if there.seen != _NO_FILE and there.seen != seen:
                raise Conflict("changed" if str(file) in self._own else "exists", there.text, there.seen)
            if there.seen != _NO_FILE and not over:
                raise Conflict("exists", there.text, there.seen)
            lines = text.replace("\r\n", "\n").replace("\n", there.line_end)
            content = ((_MARK if there.mark else "") + lines).encode("utf-8", "replace")
            try:
                _write(file, content, new=there.seen == _NO_FILE)
            except FileExistsError:
                there = self._there(file)
                raise Conflict("exists", there.text, there.seen) from None
            except OSError as error:
                raise Refusal(_("{name} cannot be written ({why})", name=file.name, why=error.strerror or error)) from None
            if self.path is None:
                self.path = file
            self._own.add(str(file))
            return {"seen": sha256(content).hexdigest(), "path": str(file), "name": file.name}

    def _there(self, file: Path | None) -> OnDisk:
        """File on the disk; an empty text for one that is missing or cannot be read."""
        if file is None or not os.path.lexists(file):
            return OnDisk("", _NO_FILE)
        try:
            return on_disk(file)
        except (SceneError, OSError):
            return OnDisk("", "unreadable")

    def _place(self, path: str | None) -> Path:
        """The file of a name: a `.toml` in the scene's folder or below it; the folder must exist."""
        if path in self._own:
            return Path(path)
        if path is None:
            if self.path is None:
                raise Refusal(_("give the scene a name that ends in .toml"))
            return self.path
        name = path.strip()
        if not name.isprintable() or not name or len(name) > 200 or "\\" in name or ":" in name:
            raise Refusal(_("give the scene a name that ends in .toml"))
        if not name.endswith(".toml") or Path(name).name.startswith("."):
            raise Refusal(_("the name of a scene ends in .toml"))
        file = self.folder / name
        parts = Path(name).parts
        if Path(name).is_absolute() or ".." in parts or not _within(file, self.folder):
            raise Refusal(_("a scene is saved in its own folder or below it"))
        if not file.parent.is_dir():
            raise Refusal(_("there is no folder {folder}", folder=str(Path(name).parent)))
        return file


def _within(file: Path, folder: Path) -> bool:
    """Tests whether a file, links followed, lies in a folder or below it."""
    try:
        return file.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError):
        return False


def _write(file: Path, content: bytes, new: bool) -> None:
    """Writes a file completely or not at all; a new file does not replace one created meanwhile."""
    if new:
        with file.open("xb") as stream:
            try:
                stream.write(content)
                stream.flush()
            except OSError:
                file.unlink()
                raise
        return
    place = Path(os.path.realpath(file))
    mode = stat.S_IMODE(place.stat().st_mode)
    if not mode & 0o222 or not os.access(place, os.W_OK):
        raise PermissionError(13, _("it is read-only"))
    with NamedTemporaryFile("wb", dir=place.parent, prefix=f".{place.name[:100]}.", delete=False) as stream:
        try:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
            os.chmod(stream.name, mode)
            os.replace(stream.name, place)
        except OSError:
            with suppress(OSError):
                os.unlink(stream.name)
            raise


# -- what to start from --------------------------------------------------------------------------------------------------


def _version() -> str:
    try:
        return version("flywheel-design")
    except PackageNotFoundError:
        return ""


@cache
def _example_files() -> dict[str, Path]:
    """Scenes of the examples by their ids, if they lie next to the package, as in a copy of the project."""
    if not (_EXAMPLES / "machines").is_dir():
        return {}
    found = sorted(file for file in _EXAMPLES.glob("*/*.toml") if file.parent.name != "bond_graphs")
    return {f"example/{file.parent.name}/{file.stem}": file for file in found}


@cache
def examples() -> tuple[dict[str, str], ...]:
    """Every starter and example: id, title, group."""
    return tuple(_listed())


def _listed() -> Iterator[dict[str, str]]:
    for kind in kinds():
        yield {"id": f"starter/{kind}", "title": _title(starter(kind), kind), "group": "starters", "kind": kind}
    for name, file in _example_files().items():
        text = file.read_text("utf-8")
        yield {"id": name, "title": _title(text, file.stem), "group": file.parent.name, "kind": file.stem}


def _title(text: str, name: str) -> str:
    title = tomllib.loads(text).get("title")
    return title if isinstance(title, str) else name
