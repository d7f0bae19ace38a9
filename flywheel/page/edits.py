"""Edits of a form as edits of the text: the text typed into a field becomes a value of TOML at its place.

The scene on the disk is read, watched, and saved without loss of another program's changes. The content of the file is
identified by the hash of its bytes, `seen`. It is replaced only if the caller has seen it and confirms; if it has changed
since, the caller gets the present text. A file is written to a temporary name and renamed when it is complete; a link, the
permissions, the byte order mark and the line ends of the file are kept.
"""

from __future__ import annotations

import os
import re
import stat
import tomllib
from collections.abc import Mapping
from contextlib import suppress
from functools import cache
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from tempfile import NamedTemporaryFile
from threading import Lock
from typing import Any, NamedTuple

from flywheel.language import text as _
from flywheel.mechanisms import KINDS
from flywheel.numerics.faults import Fault, SceneError
from flywheel.numerics.units import QuantityError, parse_quantity, parse_range, parse_unit, split_quantity
from flywheel.page.form import FormField, FormGroup, More, form_of
from flywheel.page.places import example_of, places_of
from flywheel.reading.loads import LOAD_MODELS
from flywheel.reading.motors import MOTORS
from flywheel.reading.scenes import LARGEST, file_text, parse_scene
from flywheel.reading.schema import COUPLING, COUPLING_KEYS, JOINT, JOINT_KEYS, MECHANISM, keys_for
from flywheel.reading.toml_edits import EditError, literal, quoted, value_at, with_value, without
from flywheel.reading.toml_text import Outline, outline
from flywheel.reading.toml_text import Path as KeyPath
from flywheel.scene.scene import Key
from flywheel.starters import kinds, starter

_NUMBER = re.compile(r"[+-]?(?:0|[1-9][0-9]*)(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?")
MOST_EDITS = 1000


class Draft:
    """A text that is being edited, its outline and its form."""

    def __init__(self, text: str, earlier: Draft | None = None) -> None:
        self.outline: Outline = outline(text) if earlier is None else earlier.outline
        self.faults: list[Fault] = []
        self._form: tuple[FormGroup, ...] | None = None if earlier is None else earlier.form

    @property
    def form(self) -> tuple[FormGroup, ...]:
        """The form of the text as it stands."""
        if self._form is None:
            self._form = form_of(self.outline)
        return self._form

    def field(self, path: str) -> FormField | None:
        """The form's field at a path."""
        return next((field for group in self.form for field in group.fields if field.path == path), None)

    def addition(self, path: str) -> More | None:
        """Key or table to add at a path; a name to choose may be any."""
        for more in (more for group in self.form for more in group.more):
            if more.path == path or (more.named and path.rpartition(".")[0] == more.path.rpartition(".")[0]):
                return more
        return None

    def change(self, outline: Outline) -> None:
        """A change to another text."""
        if outline.text != self.outline.text:
            self.outline, self._form = outline, None

    def edit(self, path: str, value: str | None, unit: str | None = None) -> None:
        """One edit: another value of a field, a unit into which it is converted, a new key or table, or (None) its removal.

        A value that cannot be written at its place is noted as a fault, and the text stays.
        """
        try:
            if unit is not None and value is None:
                value = self._converted(path, unit)
            changed = self._edited(path, value)
            if len(changed.text) > LARGEST:
                raise EditError("a text of more than 1 MiB")
            self.change(changed)
        except EditError as error:
            self.faults.append(Fault(path, str(error), "a value that can be changed in the form", "change it in the text"))

    def _edited(self, path: str, value: str | None) -> Outline:
        place = self.outline.places.get(path)
        if value is None:
            if place is None:
                raise EditError("nothing to take away")
            return without(self.outline, place)
        field = self.field(path)
        if field is not None and field.written is not None:
            if value == field.value:
                return self.outline
            if place is not None and place[-1] == "type":
                return self._of_type(place, value)
            if place is None:
                raise EditError("a place that is none")
            return with_value(self.outline, place, written_as(field, value, self._snippet(place)))
        more = self.addition(path)
        new = self._new_place(path)
        if field is not None:
            return with_value(self.outline, new, written_as(field, value))
        if more is None:
            raise EditError("a key that cannot be added here")
        written = written_more(more, value)
        outline = self.outline
        for name in more.instead:
            with suppress(EditError):
                outline = without(outline, (*new[:-1], name))
        return with_value(outline, new, written)

    def _snippet(self, place: KeyPath | None) -> str:
        value = self.outline.values.get(place or ())
        return "" if value is None else self.outline.text[value.start : value.stop]

    def _new_place(self, path: str) -> KeyPath:
        """The place of a path whose last part, or last parts, are not in the text yet."""
        above, part = path, ""
        parts: list[str | int] = []
        while above and above not in self.outline.places:
            if above.endswith("]"):
                above, _bracket, part = above.rpartition("[")
                if not part[:-1].isdigit():
                    raise EditError("a place that is none")
                parts.insert(0, int(part[:-1]))
            else:
                above, _dot, part = above.rpartition(".")
                parts.insert(0, part)
        return (*self.outline.places.get(above, ()), *parts)

    def _converted(self, path: str, unit: str) -> str:
        """A field's value in another unit, to ten digits."""
        field = self.field(path)
        if field is None or field.dimension is None or field.number is None:
            raise EditError("nothing that has a unit")
        if unit == field.unit:
            return field.value
        try:
            si = parse_quantity(field.written, field.dimension)
            scale = parse_unit(unit, field.dimension) if unit else None
        except QuantityError:
            raise EditError("a unit that does not fit") from None
        number = si if scale is None else si * scale.denominator / scale.numerator
        return f"{number:.10g} {unit}".strip()

    # -- another type

    def _of_type(self, place: KeyPath, kind: str) -> Outline:
        """Gives a table another type: keys that fit stay, others are removed, and those that the new type needs are added.

        As many keys stay as the reader accepts: a value that fits a key may not fit the others.
        """
        typed = with_value(self.outline, place, quoted(kind, self._snippet(place)))
        above = place[:-1]
        made = list[Outline]()
        for keep, begun in _beginnings(above, kind, typed.mapping):
            outline = typed
            for key in list(value_at(outline.mapping, above)):
                if key not in keep:
                    outline = without(outline, (*above, key))
            for path, value in begun.items():
                if value_at(outline.mapping, path) is None:
                    outline = with_value(outline, path, value)
            made.append(outline)
        if len(made) < 2:
            return made[0] if made else typed
        return min(made, key=lambda changed: _faults_within(changed, above))


def _faults_within(changed: Outline, above: KeyPath) -> int:
    """Counts the faults of a text at a table; a text that is read without any has none."""
    where = next((name for name, place in changed.places.items() if place == above), "")
    try:
        parse_scene(changed.text)
    except SceneError as error:
        return sum(fault.path == where or fault.path.startswith((f"{where}.", f"{where}[")) for fault in error.faults)
    return 0


# -- what is typed, in TOML ----------------------------------------------------------------------------------------------


def written_as(field: FormField, typed: str, like: str = "") -> str:
    r"""TOML value of the text typed into a field; `like` is the present value.

    A number alone is in the present unit if there is one, else a plain number.

    >>> length = FormField("a", "", "", "quantity", "80 mm", "80 mm", 80.0, "mm", ("mm",), "length")
    >>> [written_as(length, typed) for typed in ("90", "0.1 m", 'a"\nb')]
    ['"90 mm"', '"0.1 m"', '"a\\"\\nb"']
    """
    plain = typed.strip()
    if field.kind == "boolean" and plain in ("true", "false"):
        return plain
    if field.kind == "list" or isinstance(field.written, (list, dict)):
        listed = (text for text in (plain, f"[{plain}]") if text.startswith("[") and _is_toml(text))
        return next(listed, quoted(typed))
    if field.kind in ("quantity", "number", "expression") and _NUMBER.fullmatch(plain):
        if isinstance(field.written, str) and field.unit and field.number is not None:
            return quoted(f"{plain} {field.unit}", like)
        return plain if _is_toml(plain) else quoted(plain, like)
    return quoted(typed if field.kind == "text" else plain, like)


def written_more(more: More, typed: str) -> str:
    """TOML value typed for a key or table that is added."""
    plain = typed.strip()
    if more.kind == "table":
        if plain.startswith("{") and _is_toml(plain):
            return plain
        return more.value
    return written_as(FormField(more.path, "", "", more.kind, "", None), typed)


def _is_toml(text: str) -> bool:
    """Tests whether a text is one value of TOML on one line."""
    if "\n" in text or "\r" in text:
        return False
    try:
        return set(tomllib.loads(f"value = {text}\nend = 0")) == {"value", "end"}
    except (ValueError, RecursionError):
        return False


# -- what a type needs -----------------------------------------------------------------------------------------------------

_TAKEN_BY = {"motor": MOTORS, "model": LOAD_MODELS}
Beginning = tuple[set[str], dict[KeyPath, str]]  # keys that stay, and values by their place for missing keys


def _beginnings(above: KeyPath, kind: str, mapping: Mapping[str, Any]) -> list[Beginning]:
    """Initial contents of a table of a type, the one that keeps most first; none for an unknown type."""
    table = value_at(mapping, above)
    if above[-1] in _TAKEN_BY:
        section = _TAKEN_BY[str(above[-1])].get(kind)
        if section is None:
            return []
        # with all values that fit, with the initial ones, with neither
        rotating = places_of(mapping).rotates((value_at(mapping, above[:-1]) or {}).get("on")) is not False
        values_begun = {(*above, key): value for key, value in _begun(section.begin, rotating).items()}
        for key in section.keys:
            example = example_of(key) if key.required else None
            if example is not None:
                values_begun.setdefault((*above, key.name), literal(example))
        names = {key.name for key in section.keys}
        required = {(*above, key.name) for key in section.keys if key.required}
        least = {path: value for path, value in values_begun.items() if path in required}
        ways: list[Beginning] = [
            *([(names, least)] if (names & table.keys()) - {"type", "inertia"} else []),
            (names, values_begun),
            ({"type", "inertia", *(str(path[-1]) for path in values_begun)}, values_begun),
            ({"type", "inertia"}, values_begun),
        ]
        return [way for k, way in enumerate(ways) if way not in ways[:k]]
    for name, section, by_type in (("joints", JOINT, JOINT_KEYS), ("couplings", COUPLING, COUPLING_KEYS)):
        if name in above and kind in by_type:
            keep = {key.name for key in keys_for(section, by_type[kind])}
            lift = kind == "cam" and not {"lift", "table"} & table.keys()
            ratio = kind in ("gear", "rolling") and not {"ratio", "teeth"} & table.keys()
            begun = {"lift": '"0.01*(1 - cos(phi))"'} if lift else {"ratio": "1"} if ratio else {}
            return [(keep, {(*above, key): value for key, value in begun.items()})]
    if above[0] == "mechanism" and kind in KINDS and len(above) <= 2:
        return [_mechanism(above, kind, table, mapping)]
    return []


def _begun(values: Mapping[str, Any], rotating: bool) -> dict[str, str]:
    """Initial values, for a place that rotates or one that translates."""
    effort, value = ("torque", "1 N m") if rotating else ("force", "1 N")
    speed, at = ("speed", "100 rpm") if rotating else ("velocity", "1 m/s")
    names = {"EFFORT": effort, "SPEED": speed}
    values_by_key = {names.get(key, key): {"EFFORT": value, "SPEED": at}.get(key, item) for key, item in values.items()}
    return {key: literal(value if item == "EFFORT" else item) for key, item in values_by_key.items()}


def _mechanism(above: KeyPath, kind: str, table: Mapping[str, Any], mapping: Mapping[str, Any]) -> Beginning:
    """A mechanism of a type; missing lengths are those of its starter, in proportion to the crank's."""
    family = KINDS[kind]
    keep = {*(key.name for key in (*MECHANISM.keys, *family.keys)), *(part.name_in(table) for part in family.parts)}
    scene, share = dict[str, Any](), 1.0
    with suppress(KeyError):
        scene = tomllib.loads(starter(kind))
    example = scene.get("mechanism", {})
    with suppress(QuantityError, KeyError, TypeError, ZeroDivisionError):
        share = parse_range(table["crank"]["length"], "length") / parse_range(example["crank"]["length"], "length")
    begun: dict[KeyPath, str] = {}
    for part in family.parts:
        for key in part.keys:
            start = example.get(part.name, {}).get(key.name, None if scene else example_of(key))
            if key.required and start is not None:
                begun[(*above, part.name_in(table), key.name)] = literal(_scaled(start, key, share))
    for key in family.keys:
        if key.required and key.name in example:
            begun[(*above, key.name)] = literal(example[key.name])
    words = set(re.findall(r"\w+", " ".join(begun.values())))
    for name, value in scene.get("parameters", {}).items():  # that the starter's values speak of
        if name in words:
            begun["parameters", name] = literal(value)
    return keep, begun


def _scaled(value: object, key: Key, share: float) -> object:
    """A length in proportion, to three digits; anything else as it is."""
    parts = split_quantity(value) if isinstance(value, str) else None
    if key.kind != "length" or parts is None:
        return value
    return f"{float(f'{float(parts[0]) * share:.3g}'):.10g} {parts[1]}"


_MARK = "\ufeff"
_EXAMPLES = Path(__file__).parents[2] / "examples"
_NO_FILE = ""  # what has been seen of a file that is not there


class Refusal(Exception):
    """Reason why a text is not saved, in a line."""


class Conflict(Exception):
    """A text that is not saved before the user has seen the present file."""

    def __init__(self, reason: str, text: str, seen: str) -> None:
        self.details = {"reason": reason, "text": text, "seen": seen}
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
        file = _example_files().get(origin) if origin else None
        return self.folder if file is None else file.parent

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
    files = sorted(file for file in _EXAMPLES.glob("*/*.toml") if file.parent.name != "bond_graphs")
    return {f"example/{file.parent.name}/{file.stem}": file for file in files}


@cache
def examples() -> tuple[dict[str, str], ...]:
    """Every starter and example: id, title, group."""
    listed = [
        {"id": f"starter/{kind}", "title": _title(starter(kind), kind), "group": "starters", "kind": kind}
        for kind in kinds()
    ]
    for name, file in _example_files().items():
        title = _title(file.read_text("utf-8"), file.stem)
        listed.append({"id": name, "title": title, "group": file.parent.name, "kind": file.stem})
    return tuple(listed)


def _title(text: str, name: str) -> str:
    title = tomllib.loads(text).get("title")
    return title if isinstance(title, str) else name
