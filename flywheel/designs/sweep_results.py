"""The record of a sweep and its files: NPZ, from which it goes on, and tables as CSV and Parquet."""

from __future__ import annotations

import hashlib
import json
import math
import zipfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import cached_property
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from time import monotonic
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.files import RefusalError, check, replacement
from flywheel.designs.figures import FIGURES, MISSING, REFUSED, Array, Batch, empty
from flywheel.designs.variation import BY_NAME
from flywheel.machine.loads import balance_unit
from flywheel.machine.machine import Machine
from flywheel.numerics import notebook
from flywheel.numerics.expressions import Expression
from flywheel.numerics.faults import Fault, SceneError, show, suggestion
from flywheel.reading.paths import dotted, numbers, with_numbers
from flywheel.scene.scene import Scene

_HEAD = "flywheel_sweep"  # the first array of a file: what it is a sweep of, as JSON
_INTERVAL, _WRITING_SHARE = 10.0, 10.0  # seconds between two times of writing, and so many times what writing takes
_ROWS = 10_000  # of a CSV, written at a time
_MOST_HEADER = 100_000  # letters of its first line
_PAIRS = 10_000  # of points that are compared at once
_NOT_COMPARED = ("title", "source", "file", "remarks", "given_as", "document")
WAYS = {0: "many at once", 1: "refined", 2: "one by one", 3: "refused", MISSING: "missing"}
_CHECKED_FIGURES = ("exact", "approximate", "inertia_torque", "inertia_torque_flywheel", "irregularity", "accumulated_max")


# -- the record ------------------------------------------------------------------------------------------------------------


class Plan(NamedTuple):
    """A sweep that is to be made."""

    scene: Scene
    columns: dict[str, Array]
    shape: tuple[int, ...]
    rtol: float
    engine: str

    @property
    def total(self) -> int:
        """Number of designs."""
        return math.prod(self.shape)

    def chunk(self, which: NDArray[np.intp]) -> tuple[tuple[str, ...], Array, float, str]:
        """Arguments of `designs.sized` beside the scene, for some of the designs."""
        rows = np.stack([column[which] for column in self.columns.values()])
        return tuple(self.columns), rows, self.rtol, self.engine


class FigureArrays(Mapping[str, NDArray[Any]]):
    """Arrays of figures by their names, also as attributes: `figures.exact`."""

    def __init__(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        self._arrays = dict(arrays)
        for array in self._arrays.values():
            array.flags.writeable = False

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self._arrays[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._arrays)

    def __len__(self) -> int:
        return len(self._arrays)

    def __getattr__(self, name: str) -> NDArray[Any]:
        arrays = self.__dict__.get("_arrays", {})
        if name not in arrays:
            raise AttributeError(f"a sweep has no figure {name!r}; it has {', '.join(arrays)}")
        array: NDArray[Any] = arrays[name]
        return array

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._arrays]

    def __repr__(self) -> str:
        return f"Figures({', '.join(self._arrays)})"


class Check(NamedTuple):
    """Designs sized many at once that `size` was asked for as well, by their index.

    `ratio`: the largest difference of a figure over the sum of both estimated errors, `figure` and `design` where it is.
    """

    designs: tuple[int, ...]
    ratio: float
    figure: str
    design: int
    failed: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False, repr=False)
class Sweep:
    """Many designs of one scene: numbers that vary, figures, errors; every array has one entry for each design.

    Figures are attributes: `sweep.exact`, `sweep.balance`... (`designs.FIGURES` names all), `sweep.error.exact` is the
    estimated error of the first, as `size` gives it: relative to the larger of the figure and its scale, in rad for angles.
    A design that is refused has nan and a reason. `needed` is 1 where a flywheel is needed, 0 where none is.

    `columns`: the numbers that vary (SI), by their paths. `reasons`: of refused designs, by their index. `ways`: how each
    was sized (0 with many at once, 1 so and refined, 2 one by one, 3 refused, 255 not yet: the sweep was interrupted).
    `shape`: the number of designs, or of a grid how many values each path has; the last path varies fastest.
    """

    scene: Scene
    columns: Mapping[str, Array]
    values: FigureArrays
    error: FigureArrays
    reasons: Mapping[int, str]
    ways: NDArray[np.uint8]
    rtol: float
    engine: str
    shape: tuple[int, ...]
    check: Check | None = None
    messages: tuple[str, ...] = ()

    def __len__(self) -> int:
        return int(self.ways.size)

    def __getattr__(self, name: str) -> NDArray[Any]:
        values = self.__dict__.get("values")
        if values is None or name not in values:
            raise AttributeError(f"a sweep has no {name!r}; its figures are {', '.join(FIGURES)}")
        array: NDArray[Any] = values[name]
        return array

    def __getitem__(self, name: str) -> NDArray[Any]:
        """A figure by its name, here or in the JSON contract of `size`, or a column by its path."""
        name = dotted(name)
        if name in self.columns:
            return self.columns[name]
        figure = BY_NAME.get(name, name)
        if figure not in self.values:
            raise SceneError([Fault("name", show(name), "a figure or a path", suggestion(name, self.names_and_paths))])
        return self.values[figure]

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *FIGURES]

    def __repr__(self) -> str:
        refused = int((self.ways == REFUSED).sum())
        counts = f"{len(self)} designs" + (f", {refused} refused" if refused else "")
        counts += f", {self.missing} missing" if self.missing else ""
        return f"Sweep({notebook.quoted(self.scene.title)}{counts} of {', '.join(self.columns)})"

    _repr_html_ = notebook.html

    @property
    def missing(self) -> int:
        """Number of designs not sized yet."""
        return int((self.ways == MISSING).sum())

    @cached_property
    def names(self) -> list[str]:
        """The figures that any design has."""
        return [name for name in FIGURES if not np.isnan(self.error[name]).all()]

    @property
    def names_and_paths(self) -> list[str]:
        """Names and paths that `sweep[...]` accepts."""
        return [*self.columns, *self.names]

    @cached_property
    def units(self) -> dict[str, str]:
        """The units (SI) of columns and figures."""
        known = numbers(self.scene)
        units = {path: known[path].unit if path in known else "" for path in self.columns}
        units |= {name: FIGURES[name].unit for name in self.names}
        if "balance" in units:
            units["balance"] = balance_unit(Machine(self.scene).efforts, self.scene) or ""
        return units

    @cached_property
    def worst(self) -> Array:
        """The largest of the errors that `rtol` is asked of, of each design; nan where it is refused."""
        return largest_error(self.error)

    @property
    def reached(self) -> NDArray[np.bool_]:
        """Mask of the designs whose estimated relative errors are all within rtol."""
        return np.asarray(self.worst <= self.rtol)

    def design(self, index: int) -> Scene:
        """The scene of one design, as `size` and all other calls take it.

        Raises:
            SceneError: where the design is refused.

        """
        return with_numbers(self.scene, {path: float(column[index]) for path, column in self.columns.items()})

    def argmin(self, of: str | Array = "exact", *, where: NDArray[np.bool_] | None = None) -> int:
        """The index of the design with the least of a figure, or of an array of one value for each design.

        Args:
            of: a figure's name, a path, or an array.
            where: the designs among which it is looked for; all if None.

        Raises:
            SceneError: for an unknown name; where no design is left.

        """
        objective = self._objective(of)
        left = np.isfinite(objective) & (True if where is None else np.asarray(where, bool))
        if not left.any():
            what = of if isinstance(of, str) else "the values given"
            raise SceneError([Fault("argmin", f"no design with {what}", "one at least", "see reasons, and where")])
        return int(np.flatnonzero(left)[np.argmin(objective[left])])

    def pareto(
        self, *of: str | Array, greatest: Sequence[str] = (), where: NDArray[np.bool_] | None = None
    ) -> NDArray[np.intp]:
        """The indices of designs that no other one beats: none is at least as good in everything and better in something.

        Args:
            of: names of figures, paths or arrays of which less is better.
            greatest: names of those of which more is better.
            where: the designs among which they are looked for; all if None.

        Returns: indices, ordered by the first of them.

        """
        if not of and not greatest:
            raise SceneError([Fault("pareto", "no figure to compare by", 'figures such as "exact", "power"')])
        columns = [*map(self._objective, of), *(-self._objective(name) for name in greatest)]
        points = np.stack(columns, axis=1)
        left = np.isfinite(points).all(axis=1) & (True if where is None else np.asarray(where, bool))
        index = np.flatnonzero(left)
        return index[front(points[index])]

    def _objective(self, of: str | Array) -> Array:
        if isinstance(of, str):
            return np.asarray(self[of], float)
        array = np.asarray(of, float)
        if array.shape != (len(self),):
            expected = f"a name, or an array of {len(self)} numbers"
            raise SceneError([Fault("of", f"an array of shape {array.shape}", expected)])
        return array

    def table(self, rows: int = 20) -> str:
        """Table that `flywheel sweep` prints: varied numbers, best designs, a table of some, and notes on all."""
        import flywheel

        text: str = flywheel.notebooks.sweep_text(self, rows)
        return text

    def plot(self, path: str | Path) -> None:
        """The picture of `flywheel sweep --plot`, written as PNG, SVG or PDF."""
        import flywheel

        flywheel.notebooks.save_picture(self, path)

    def to_csv(self, path: str | Path) -> None:
        """Writes a table with a row for each design: its numbers, figures, errors, way and reason, SI throughout."""
        write_csv(self, path)

    def to_npz(self, path: str | Path) -> None:
        """Writes everything as arrays of NumPy, from which `sweep(..., file=path)` goes on."""
        write_npz(self, path)

    def to_parquet(self, path: str | Path) -> None:
        """Writes the table of `to_csv` as Parquet; needs pyarrow."""
        write_parquet(self, path)

    def to_pandas(self) -> Any:
        """The table of `to_csv` as a data frame of pandas, errors under `error.exact`..., units in `attrs["units"]`."""
        module: Any = needed("pandas", "to_pandas")
        frame = module.DataFrame(dict(table_of(self)))
        frame.attrs["units"] = self._units_of_columns
        return frame

    @property
    def _units_of_columns(self) -> dict[str, str]:
        """The units (SI) of the columns of tables that have one, as the header of the CSV has them."""
        return {name: self.units[name] for name, _column in table_of(self) if self.units.get(name)}

    def to_xarray(self) -> Any:
        """Figures and errors over the paths of a grid, else over designs with the numbers beside: a dataset of xarray."""
        module: Any = needed("xarray", "to_xarray")
        units, grid = self.units, len(self.shape) > 1 or len(self.columns) == 1
        dims = tuple(self.columns) if grid else ("design",)
        shape = self.shape if grid else (len(self),)
        coords: dict[str, Any] = {}
        for axis, (path, column) in enumerate(self.columns.items()):
            values = np.moveaxis(column.reshape(shape), axis, 0).reshape(shape[axis], -1)[:, 0] if grid else column
            coords[path] = (path if grid else "design", values, {"units": units[path]})
        data: dict[str, Any] = {}
        for name in self.names:
            about = {"units": units[name], "long_name": FIGURES[name].about}
            data[name] = (dims, self.values[name].reshape(shape), about)
            data[f"error.{name}"] = (dims, self.error[name].reshape(shape))
        return module.Dataset(data, coords, {"title": self.scene.title or "", "rtol": self.rtol})


def front(points: Array) -> NDArray[np.intp]:
    """Indices of the points that no other one is at most as large as in every coordinate and smaller in one.

    Args:
        points: shape (n, m).

    Returns: in ascending order of the first coordinate.

    >>> front(np.array([[1.0, 4.0], [2.0, 2.0], [3.0, 3.0], [4.0, 1.0]])).tolist()
    [0, 1, 3]

    """
    order = np.lexsort(points.T[::-1])
    ordered = points[order]
    new = np.append(True, (np.diff(ordered, axis=0) != 0.0).any(axis=1))[: order.size]  # equal points are beaten together
    return np.asarray(order[_unbeaten(ordered[new])[np.cumsum(new) - 1]])


def _unbeaten(points: Array) -> NDArray[np.bool_]:
    """Tells of each of different points in lexical order whether no other one is at most as large in every coordinate.

    Source: H. T. Kung, F. Luccio, F. P. Preparata, On finding the maxima of a set of vectors, J. ACM 22 (1975), 469-476.
    """
    if len(points) < 2:
        return np.ones(len(points), bool)
    half = len(points) // 2
    first, second = _unbeaten(points[:half]), _unbeaten(points[half:])
    second[second] = ~_beaten(points[half:][second, 1:], points[:half][first, 1:])  # none of the others is less in the first
    return np.concatenate((first, second))


def _beaten(points: Array, by: Array) -> NDArray[np.bool_]:
    """Tells of each point whether one of others is at most as large in every coordinate.

    Both are split by the first coordinate until two are left, or few: below the split only what lies below it beats a point;
    above it what lies above it does, or what lies below it in the other coordinates.
    """
    found = np.zeros(len(points), bool)
    if not points.size or not by.size:
        return found | bool(len(by) and not points.shape[1])
    if points.shape[1] == 1:
        return np.asarray(points[:, 0] >= by.min())
    if points.shape[1] == 2:
        by = by[np.argsort(by[:, 0])]
        place = np.searchsorted(by[:, 0], points[:, 0], side="right")
        return np.asarray(np.append(np.inf, np.minimum.accumulate(by[:, 1]))[place] <= points[:, 1]) & (place > 0)
    if len(points) * len(by) <= _PAIRS:
        return np.asarray(np.any(np.all(by <= points[:, None], axis=2), axis=1))
    values = np.unique(by[:, 0])
    if values.size == 1:
        above = points[:, 0] >= values[0]
        found[above] = _beaten(points[above, 1:], by[:, 1:])
        return found
    split = values[values.size // 2]
    low, above = by[:, 0] < split, points[:, 0] >= split
    found[~above] = _beaten(points[~above], by[low])
    found[above] = _beaten(points[above, 1:], by[low, 1:]) | _beaten(points[above], by[~low])
    return found


def needed(module: str, what: str) -> Any:
    """An optional library, or the line that says what to install."""
    try:
        return import_module(module)
    except ImportError:
        raise SceneError([Fault(what, f"no {module}", f"{module}, which it needs", f"pip install {module}")]) from None


def largest_error(errors: Mapping[str, NDArray[Any]]) -> Array:
    """The largest of the errors that `rtol` is asked of, of each design; nan where it is refused."""
    rows = [errors[name] for name in _CHECKED_FIGURES if name in errors]
    return np.asarray(np.fmax.reduce(rows))


# -- tables ------------------------------------------------------------------------------------------------------------


def table_of(sweep: Sweep) -> Iterator[tuple[str, NDArray[Any]]]:
    """The columns of a table of designs: numbers, figures, errors, how each was sized, and why not."""
    yield from sweep.columns.items()
    for name in sweep.names:
        yield name, sweep.values[name]
    for name in sweep.names:
        if FIGURES[name].error:
            yield f"error.{name}", sweep.error[name]
    yield "way", np.array([WAYS[k] for k in range(max(WAYS) + 1) if k in WAYS])[np.searchsorted(sorted(WAYS), sweep.ways)]
    reasons = np.full(len(sweep), "", object)
    for k, reason in sweep.reasons.items():
        reasons[k] = reason
    yield "reason", reasons


def write_csv(sweep: Sweep, path: str | Path) -> None:
    """A row for each design; a file that begins otherwise is left as it is."""
    header = csv_lines(sweep, rows=0)
    with replacement(path, "text", text=next(iter(header))) as fresh, fresh.open("w", encoding="utf-8", newline="") as file:
        file.writelines(csv_lines(sweep))


def check_csv(path: str | Path, scene: Scene, paths: Iterable[str]) -> None:
    """Refuse a file that begins otherwise than a table of designs in which the numbers at some paths vary.

    Raises:
        OSError: with the reason as its `strerror`.

    """
    known, place = numbers(scene), Path(path)
    if not place.is_file() or not place.stat().st_size:
        return
    names = [f"{name} [{known[name].unit}]" if name in known and known[name].unit else name for name in paths]
    with place.open(encoding="utf-8", errors="replace") as file:
        there = file.readline(_MOST_HEADER).rstrip("\n").split(",")
    if there[: len(names)] != names:
        reason = "it exists already and does not begin as what would be written"
        raise RefusalError(f"{reason}: give another name, or take it away first", place)


def csv_lines(sweep: Sweep, rows: int | None = None) -> Iterator[str]:
    """The lines of the CSV; empty where a figure is not known."""
    units, table = sweep.units, dict(table_of(sweep))
    if "needed" in table:  # of a design that is refused it is not known either
        table["needed"] = np.where(np.isnan(sweep.needed), "", np.where(sweep.needed == 1.0, "1", "0"))
    yield ",".join(f"{name} [{units[name]}]" if units.get(name) else name for name in table) + "\n"
    for start in range(0, len(sweep) if rows is None else rows, _ROWS):
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


def write_parquet(sweep: Sweep, path: str | Path) -> None:
    """The same table as Parquet."""
    arrow, parquet = needed("pyarrow", "to_parquet"), needed("pyarrow.parquet", "to_parquet")
    path, metadata = Path(path), {_HEAD: _metadata(sweep)}
    if path.is_file() and _parquet_head(parquet, path) != metadata[_HEAD]:
        raise RefusalError("it exists already and is not this sweep's: give another name, or remove it first", path)
    units = sweep._units_of_columns
    metadata["PANDAS_ATTRS"] = json.dumps({"units": units})  # `attrs` of a data frame that pandas reads from it
    table = arrow.table(dict(table_of(sweep)))
    table = table.cast(
        arrow.schema(
            [field.with_metadata({"unit": units[field.name]}) if field.name in units else field for field in table.schema],
            metadata,
        )
    )
    with replacement(path, "parquet") as fresh:
        parquet.write_table(table, fresh)


def _parquet_head(parquet: Any, path: Path) -> str:
    try:
        return str((parquet.read_schema(path).metadata or {}).get(_HEAD.encode(), b"").decode())
    except (OSError, ValueError):
        return ""


# -- NPZ ---------------------------------------------------------------------------------------------------------------


def write_npz(sweep: Sweep, path: str | Path) -> None:
    """Writes the sweep, finished or interrupted; a file of another sweep is not changed."""
    plan = Plan(sweep.scene, dict(sweep.columns), sweep.shape, sweep.rtol, sweep.engine)
    batch = Batch(dict(sweep.values), dict(sweep.error), dict(sweep.reasons), sweep.ways)
    try:
        keeper = Keeper(Path(path), plan)
    except SceneError as error:
        raise RefusalError(f"it is another's ({error.faults[0].found}): give another name", Path(path)) from None
    keeper.keep(batch, last=True)


class Keeper:
    """The NPZ file that a sweep is kept in, and from which it goes on; another's is refused and left as it is."""

    def __init__(self, path: Path, plan: Plan) -> None:
        self.path, self.plan, self.head = path, plan, head(plan)
        self.next = monotonic() + _INTERVAL
        if path.exists():
            there, faults = _read_head(path), []
            if there is None:
                advice = "give another name, or remove it first"
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
        """Designs that were finished already."""
        batch = empty(self.plan.total)
        with np.load(self.path, allow_pickle=False) as there:
            for name in there.files:
                kind, _, figure = name.partition(".")
                if name in FIGURES:
                    batch.values[name][:] = there[name]
                elif kind == "error" and figure in FIGURES:
                    batch.errors[figure][:] = there[name]
            batch.ways[:] = there["ways"]
            reasons = zip(there["reason_of"].tolist(), there["reason"].tolist(), strict=True)
            batch.reasons.update({int(k): str(reason) for k, reason in reasons})
        return batch

    def keep(self, batch: Batch, *, last: bool = False) -> None:
        """Writes what is finished, unless that was done a moment ago."""
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
        self.next = now + max(_INTERVAL, _WRITING_SHARE * (now - begun))


_COMPARED = {"scene": "scene", "rtol": "rtol", "version": "version of flywheel", "paths": "set of numbers", "shape": "size"}


def _value(key: str, value: Any) -> str:
    if key == "scene":
        return ""
    listed = (", " if key == "paths" else " x ").join(map(str, value)) if isinstance(value, list) else str(value)
    return f", {listed}" if key == "paths" else f" {listed}"


_OTHER = "give another file, or remove this one"


def head(plan: Plan) -> dict[str, Any]:
    """Header of a file: the sweep to which it belongs."""
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


def _metadata(sweep: Sweep) -> str:
    contents = head(Plan(sweep.scene, dict(sweep.columns), sweep.shape, sweep.rtol, sweep.engine))
    numbers = hashlib.sha256(b"".join(np.ascontiguousarray(column).tobytes() for column in sweep.columns.values()))
    return json.dumps({**contents, "engine": "", "columns": numbers.hexdigest()})


def _read_head(path: Path) -> dict[str, Any] | None:
    try:
        with np.load(path, allow_pickle=False) as there:
            contents = json.loads(str(there[_HEAD]))
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, AttributeError, TypeError):
        return None
    return contents if isinstance(contents, dict) else None


def _same_columns(path: Path, plan: Plan) -> bool:
    with np.load(path, allow_pickle=False) as there:
        return all(
            name in there.files and np.array_equal(there[name], column, equal_nan=True)
            for name, column in plan.columns.items()
        )


def digest(scene: Scene) -> str:
    """Digest of a scene, independent of its title, file and form of writing."""
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
            if field.name not in _NOT_COMPARED:
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


def objective(found: Sweep) -> str:
    """The figure by which designs are compared: the exact flywheel, or in an analysis the irregularity."""
    return "exact" if "exact" in found.names else "irregularity"
