"""Files of a sweep: NPZ, from which it goes on, and tables as CSV and Parquet."""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.storage.files import RefusalError, check, replacement
from flywheel.designs.figures import FIGURES, MISSING, REFUSED, Batch, empty
from flywheel.numerics.expressions import Expression
from flywheel.numerics.faults import Fault, SceneError
from flywheel.scene.scene import Scene

if TYPE_CHECKING:
    from flywheel.designs.sweep import Plan, Sweep

_HEAD = "flywheel_sweep"  # the first array of a file: what it is a sweep of, as JSON
_EVERY, _SHARE = 10.0, 10.0  # seconds between two times of writing, and so many times what writing takes
_ROWS = 10_000  # of a CSV, written at a time
_NOT_TOLD = ("title", "source", "file", "remarks", "given_as", "document")
WAYS = {0: "many at once", 1: "refined", 2: "one by one", 3: "refused", MISSING: "missing"}


# -- tables ------------------------------------------------------------------------------------------------------------


def table_of(found: Sweep) -> Iterator[tuple[str, NDArray[Any]]]:
    """The columns of a table of designs: numbers, figures, errors, how each was sized, and why not."""
    yield from found.columns.items()
    for name in found.names:
        yield name, found.values[name]
    for name in found.names:
        if FIGURES[name].error:
            yield f"error.{name}", found.error[name]
    yield "way", np.array([WAYS[k] for k in range(max(WAYS) + 1) if k in WAYS])[np.searchsorted(sorted(WAYS), found.ways)]
    reasons = np.full(len(found), "", object)
    for k, reason in found.reasons.items():
        reasons[k] = reason
    yield "reason", reasons


def write_csv(found: Sweep, path: str | Path) -> None:
    """A row for each design; a file that begins otherwise is left as it is."""
    header = csv_lines(found, rows=0)
    with replacement(path, "text", text=next(iter(header))) as fresh, fresh.open("w", encoding="utf-8", newline="") as file:
        file.writelines(csv_lines(found))


def csv_lines(found: Sweep, rows: int | None = None) -> Iterator[str]:
    """The lines of the CSV; empty where a figure is not known."""
    units, table = found.units, dict(table_of(found))
    if "needed" in table:  # of a design that is refused it is not known either
        known = ~np.isnan(found.error["needed"])
        table["needed"] = np.where(known, np.where(found.values["needed"], "1", "0"), "")
    yield ",".join(f"{name} [{units[name]}]" if units.get(name) else name for name in table) + "\n"
    for start in range(0, len(found) if rows is None else rows, _ROWS):
        part = [_cells(column[start : start + _ROWS]) for column in table.values()]
        yield "".join(f"{','.join(row)}\n" for row in zip(*part, strict=True))


def _cells(column: NDArray[Any]) -> list[str]:
    if column.dtype == bool:
        return ["1" if value else "0" for value in column.tolist()]
    if column.dtype.kind == "f":
        return ["" if value != value else repr(value) for value in column.tolist()]
    return [_quoted(str(value)) for value in column.tolist()]


def _quoted(text: str) -> str:
    doubled = text.replace('"', '""')
    return f'"{doubled}"' if any(mark in text for mark in ',"\n\r') else text


def write_parquet(found: Sweep, path: str | Path) -> None:
    """The same table as Parquet."""
    from flywheel.designs.sweep import needed

    arrow, parquet = needed("pyarrow", "to_parquet"), needed("pyarrow.parquet", "to_parquet")
    path, told = Path(path), {_HEAD: _told(found)}
    if path.is_file() and _parquet_head(parquet, path) != told[_HEAD]:
        raise RefusalError("it exists already and is not this sweep's: give another name, or take it away first", path)
    table = arrow.table(dict(table_of(found))).replace_schema_metadata(told)
    with replacement(path, "parquet") as fresh:
        parquet.write_table(table, fresh)


def _parquet_head(parquet: Any, path: Path) -> str:
    try:
        return str((parquet.read_schema(path).metadata or {}).get(_HEAD.encode(), b"").decode())
    except (OSError, ValueError):
        return ""


# -- NPZ ---------------------------------------------------------------------------------------------------------------


def write_npz(found: Sweep, path: str | Path) -> None:
    """Everything, as a sweep that was interrupted or not; a file that is not this sweep's is left as it is."""
    from flywheel.designs.sweep import Plan

    plan = Plan(found.scene, dict(found.columns), found.shape, found.rtol, found.engine)
    asked = np.where(np.isnan(found.error["needed"]), np.nan, found.values["needed"])
    batch = Batch({**found.values, "needed": asked}, dict(found.error), dict(found.reasons), found.ways)
    try:
        keeper = Keeper(Path(path), plan)
    except SceneError as error:
        raise RefusalError(f"it is another's ({error.faults[0].found}): give another name", Path(path)) from None
    keeper.keep(batch, last=True)


class Keeper:
    """The NPZ file that a sweep is kept in, and from which it goes on; another's is refused and left as it is."""

    def __init__(self, path: Path, plan: Plan) -> None:
        self.path, self.plan, self.head = path, plan, head(plan)
        self.next = monotonic() + _EVERY
        if path.exists():
            there, faults = _read_head(path), []
            if there is None:
                advice = "give another name, or take it away first"
                raise SceneError([Fault(str(path), "a file that is no sweep", "a new file, or that of this sweep", advice)])
            for key, words in _COMPARED.items():
                if there.get(key) != self.head[key]:
                    was, now = (_value(key, value) for value in (there.get(key), self.head[key]))
                    faults.append(Fault(str(path), f"a sweep of another {words}{was}", f"one of this {words}{now}", _OTHER))
            if not faults and not _same_columns(path, plan):
                faults.append(Fault(str(path), "a sweep of other numbers", "one of these columns", _OTHER))
            if faults:
                raise SceneError(faults[:1])
        check(path, "npz")
        if not path.exists():  # where it cannot be written, that is told before anything is computed
            self.keep(empty(plan.total), last=True)

    def before(self) -> Batch | None:
        """What is finished already."""
        found = empty(self.plan.total)
        with np.load(self.path, allow_pickle=False) as there:
            for name in there.files:
                kind, _, figure = name.rpartition(".")
                if name in FIGURES:
                    found.values[name][:] = there[name]
                elif kind == "error" and figure in FIGURES:
                    found.errors[figure][:] = there[name]
            found.ways[:] = there["ways"]
            found.values["needed"][found.ways >= REFUSED] = np.nan
            reasons = zip(there["reason_of"].tolist(), there["reason"].tolist(), strict=True)
            found.reasons.update({int(k): str(reason) for k, reason in reasons})
        return found

    def keep(self, batch: Batch, *, last: bool = False) -> None:
        """Write what is finished, unless that was done a moment ago."""
        if not last and monotonic() < self.next:
            return
        begun = monotonic()
        arrays: dict[str, Any] = {_HEAD: np.array(json.dumps(self.head))}
        arrays |= self.plan.columns
        known = [name for name, values in batch.values.items() if not np.isnan(values).all()]
        arrays |= {name: batch.values[name] for name in known}
        arrays |= {f"error.{name}": batch.errors[name] for name in known if name in batch.errors}
        arrays |= {"ways": batch.ways, "reason_of": np.array(list(batch.reasons), np.int64)}
        arrays["reason"] = np.array(list(batch.reasons.values()), str)
        with replacement(self.path, "npz") as fresh, fresh.open("wb") as file:
            np.savez(file, **arrays)
        now = monotonic()
        self.next = now + max(_EVERY, _SHARE * (now - begun))


_COMPARED = {"scene": "scene", "rtol": "rtol", "version": "version of flywheel", "paths": "set of numbers", "shape": "size"}


def _value(key: str, value: Any) -> str:
    if key == "scene":
        return ""
    listed = (", " if key == "paths" else " x ").join(map(str, value)) if isinstance(value, list) else str(value)
    return f", {listed}" if key == "paths" else f" {listed}"


_OTHER = "give another file, or take this one away"


def head(plan: Plan) -> dict[str, Any]:
    """What a file says that it is a sweep of."""
    try:
        own = version("flywheel-design")
    except PackageNotFoundError:
        own = "source"
    return {
        "version": own,
        "scene": digest(plan.scene),
        "title": plan.scene.title,
        "rtol": plan.rtol,
        "engine": plan.engine,
        "paths": list(plan.columns),
        "shape": list(plan.shape),
    }


def _told(found: Sweep) -> str:
    from flywheel.designs.sweep import Plan

    told = head(Plan(found.scene, dict(found.columns), found.shape, found.rtol, found.engine))
    numbers = hashlib.sha256(b"".join(np.ascontiguousarray(column).tobytes() for column in found.columns.values()))
    return json.dumps({**told, "engine": "", "columns": numbers.hexdigest()})


def _read_head(path: Path) -> dict[str, Any] | None:
    try:
        with np.load(path, allow_pickle=False) as there:
            found = json.loads(str(there[_HEAD]))
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, AttributeError, TypeError):
        return None
    return found if isinstance(found, dict) else None


def _same_columns(path: Path, plan: Plan) -> bool:
    with np.load(path, allow_pickle=False) as there:
        return all(
            name in there.files and np.array_equal(there[name], column, equal_nan=True)
            for name, column in plan.columns.items()
        )


def digest(scene: Scene) -> str:
    """What tells a scene from others, whatever its title, file and form of writing."""
    made = hashlib.sha256()
    for token in _tokens(scene):
        made.update(token)
    return made.hexdigest()


def _tokens(value: Any) -> Iterable[bytes]:
    if isinstance(value, Expression):
        yield value.text.encode()
    elif is_dataclass(value):
        yield type(value).__name__.encode()
        for field in fields(value):
            if field.name not in _NOT_TOLD:
                yield from _tokens(getattr(value, field.name))
    elif isinstance(value, Mapping):
        for key in sorted(value):
            yield f"{key}=".encode()
            yield from _tokens(value[key])
    elif isinstance(value, np.ndarray):
        yield repr(value.shape).encode() + np.ascontiguousarray(value).tobytes()
    elif isinstance(value, (tuple, list)):
        yield b"("
        for inner in value:
            yield from _tokens(inner)
        yield b")"
    else:
        yield repr(value).encode() + b";"
