"""The record of a sweep and its files: NPZ, CSV, Parquet, and the folder of its figures during the calculation."""

from __future__ import annotations

import hashlib
import json
import math
import mmap
import shutil
import zipfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.files import RefusalError, check, replacement
from flywheel.designs.figures import FIGURES, MISSING, REFUSED, Array, Batch, digest, own_version
from flywheel.designs.variation import BY_NAME
from flywheel.machine.loads import balance_unit
from flywheel.machine.machine import Machine
from flywheel.numerics import notebook
from flywheel.numerics.faults import Fault, SceneError, show, suggestion
from flywheel.reading.paths import dotted, numbers, with_numbers
from flywheel.scene.scene import Scene, read_only

_HEAD = "flywheel_sweep"  # the first array of a file: what it is a sweep of, as JSON
_FOLDER, _HEADER, _REASONS = ".part", "sweep.json", "reasons.jsonl"  # of a sweep that is being made
_ROWS = 10_000  # of a table, written at a time
_BLOCK = 100_000  # numbers of an array that are taken at a time
_MAPPED = 1_000_000  # designs from which figures of a sweep with a file stay on the disk until they are wanted
_MOST_HEADER = 100_000  # letters of its first line
_PAIRS = 10_000  # of points that are compared at once
WAYS = {0: "many at once", 1: "refined", 2: "one by one", 3: "refused", MISSING: "missing"}
_CHECKED_FIGURES = ("exact", "approximate", "inertia_torque", "inertia_torque_flywheel", "irregularity", "accumulated_max")


# -- the record ------------------------------------------------------------------------------------------------------------


class Plan(NamedTuple):
    """A sweep to be made; each of its columns has its shape, with one axis per path for a grid."""

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
        place = np.unravel_index(which, self.shape)
        rows = np.stack([column[place] for column in self.columns.values()])
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
    """Designs sized many at once that `size` has checked, by their index.

    `ratio`: the largest difference of a figure over the sum of both estimated errors, `figure` and `design` those of it.
    """

    designs: tuple[int, ...]
    ratio: float
    figure: str
    design: int
    failed: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False, repr=False)
class Sweep:
    """Many designs of one scene: numbers that vary, figures, errors; every array has one entry for each design.

    Figures are attributes: `sweep.exact`, `sweep.balance`... (`flywheel.designs.figures.FIGURES` names all),
    `sweep.error.exact` is the estimated error of the first, as `size` gives it: relative to the larger of the figure and its
    scale, in rad for angles. A design that is refused has nan and a reason. `needed` is 1 if a flywheel is needed, 0 if none
    is.

    `columns`: the numbers that vary (SI), by their paths. `reasons`: of refused designs, by their index. `ways`: the way of
    sizing each (0 many at once, 1 the same and refined, 2 one by one, 3 refused, 255 not yet: the sweep was interrupted).
    `shape`: the number of designs, or for a grid the number of values of each path; the last path varies fastest.
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
        error = self.error
        return [name for name in FIGURES if not all(np.isnan(error[name][part]).all() for part in blocks(len(self)))]

    @property
    def names_and_paths(self) -> list[str]:
        """Names and paths that `sweep[...]` accepts."""
        return [*self.columns, *self.names]

    @cached_property
    def units(self) -> dict[str, str]:
        """The units (SI) of columns and figures."""
        all_numbers = numbers(self.scene)
        units = {path: all_numbers[path].unit if path in all_numbers else "" for path in self.columns}
        units |= {name: FIGURES[name].unit for name in self.names}
        if "balance" in units:
            units["balance"] = balance_unit(Machine(self.scene).efforts, self.scene) or ""
        return units

    @property
    def plan(self) -> Plan:
        """The plan of this record's sweep."""
        columns = {path: column.reshape(self.shape) for path, column in self.columns.items()}
        return Plan(self.scene, columns, self.shape, self.rtol, self.engine)

    def release(self) -> None:
        """Releases the memory of figures that were read from the disk."""
        release([*self.columns.values(), *self.values.values(), *self.error.values()])

    @cached_property
    def worst(self) -> Array:
        """The largest error of each design among those subject to `rtol`; nan if it is refused."""
        return largest_error(self.error)

    @property
    def reached(self) -> NDArray[np.bool_]:
        """Mask of the designs whose estimated relative errors are all within rtol."""
        return np.asarray(self.worst <= self.rtol)

    def design(self, index: int) -> Scene:
        """The scene of one design, as `size` and all other calls take it.

        Raises:
            SceneError: if the design is refused.

        """
        return with_numbers(self.scene, {path: float(column[index]) for path, column in self.columns.items()})

    def argmin(self, of: str | Array = "exact", *, where: NDArray[np.bool_] | None = None) -> int:
        """The index of the design with the least of a figure, or of an array of one value for each design.

        Args:
            of: a figure's name, a path, or an array.
            where: the designs among which it is searched for; all if None.

        Raises:
            SceneError: for an unknown name, or if no design remains.

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
        """The indices of designs that no other one dominates: none is as good in everything and better in something.

        Args:
            of: names of figures, paths or arrays to minimize.
            greatest: names of those to maximize.
            where: the designs among which they are searched for; all if None.

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
        """Writes everything as arrays of NumPy, from which `sweep(..., file=path)` continues."""
        write_npz(self, path)

    def to_parquet(self, path: str | Path) -> None:
        """Writes the table of `to_csv` as Parquet; needs pyarrow."""
        write_parquet(self, path)

    def to_pandas(self) -> Any:
        """The table of `to_csv` as a data frame of pandas, errors under `error.exact`..., units in `attrs["units"]`."""
        module: Any = needed("pandas", "to_pandas")
        frame = module.DataFrame(table_of(self))
        frame.attrs["units"] = self._units_of_columns
        return frame

    @property
    def _units_of_columns(self) -> dict[str, str]:
        """The units (SI) of the columns of tables that have one, as the header of the CSV has them."""
        return {name: self.units[name] for name in table_of(self, slice(0)) if self.units.get(name)}

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
    """Mask of those of distinct points in lexical order to which no other one is at most equal in every coordinate.

    Source: H. T. Kung, F. Luccio, F. P. Preparata, On finding the maxima of a set of vectors, J. ACM 22 (1975), 469-476.
    """
    if len(points) < 2:
        return np.ones(len(points), bool)
    half = len(points) // 2
    first, second = _unbeaten(points[:half]), _unbeaten(points[half:])
    second[second] = ~_beaten(points[half:][second, 1:], points[:half][first, 1:])  # none of the others is less in the first
    return np.concatenate((first, second))


def _beaten(points: Array, by: Array) -> NDArray[np.bool_]:
    """Mask of the points to which one of others is at most equal in every coordinate.

    Both are split by the first coordinate until two are left, or few: below the split only points below it beat a point;
    above it points above it do, or points below it in the other coordinates.
    """
    beaten = np.zeros(len(points), bool)
    if not points.size or not by.size:
        return beaten | bool(len(by) and not points.shape[1])
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
        beaten[above] = _beaten(points[above, 1:], by[:, 1:])
        return beaten
    split = values[values.size // 2]
    low, above = by[:, 0] < split, points[:, 0] >= split
    beaten[~above] = _beaten(points[~above], by[low])
    beaten[above] = _beaten(points[above, 1:], by[low, 1:]) | _beaten(points[above], by[~low])
    return beaten


def needed(module: str, what: str) -> Any:
    """An optional library, or an error that names the package to install."""
    try:
        return import_module(module)
    except ImportError:
        raise SceneError([Fault(what, f"no {module}", f"{module}, which it needs", f"pip install {module}")]) from None


def largest_error(errors: Mapping[str, NDArray[Any]]) -> Array:
    """The largest error of each design among those subject to `rtol`; nan if it is refused."""
    rows = [errors[name] for name in _CHECKED_FIGURES if name in errors]
    worst = np.empty(len(rows[0]))
    for part in blocks(worst.size):
        worst[part] = np.fmax.reduce([row[part] for row in rows])
    release(rows)
    return worst


def blocks(count: int, size: int = _BLOCK) -> Iterator[slice]:
    """Slices of an array, one after the other."""
    return (slice(start, start + size) for start in range(0, count, size))


def release(arrays: Iterable[NDArray[Any]]) -> None:
    """Releases the memory of arrays on the disk that were read or written."""
    for array in arrays:
        if isinstance(array, np.memmap) and hasattr(mmap, "MADV_DONTNEED"):
            array._mmap.madvise(mmap.MADV_DONTNEED)  # type: ignore[attr-defined]


# -- tables ------------------------------------------------------------------------------------------------------------


def table_of(sweep: Sweep, part: slice = slice(None)) -> dict[str, NDArray[Any]]:
    """The columns of a table of designs, or of a part of them: numbers, figures, errors, way of sizing, and reason."""
    table: dict[str, NDArray[Any]] = {path: column[part] for path, column in sweep.columns.items()}
    table |= {name: sweep.values[name][part] for name in sweep.names}
    table |= {f"error.{name}": sweep.error[name][part] for name in sweep.names if FIGURES[name].error}
    ways = sweep.ways[part]
    table["way"] = np.array([WAYS[k] for k in sorted(WAYS)])[np.searchsorted(sorted(WAYS), ways)]
    table["reason"] = np.full(ways.size, "", object)
    first = part.indices(len(sweep))[0]
    for k in np.flatnonzero(ways == REFUSED).tolist():
        table["reason"][k] = sweep.reasons.get(first + k, "")
    return table


def write_csv(sweep: Sweep, path: str | Path) -> None:
    """Writes a row for each design; a file that does not begin with its numbers is left unchanged."""
    _check_csv(Path(path), next(csv_lines(sweep, rows=0)).rstrip("\n").split(",")[: len(sweep.columns)])
    with replacement(path, "text") as fresh, fresh.open("w", encoding="utf-8", newline="") as file:
        file.writelines(csv_lines(sweep))


def _check_csv(file: Path, names: Sequence[str]) -> None:
    """Refuses a file that is no table of these numbers; its figures may be others, as those of a sweep just begun are."""
    if not file.is_file() or not file.stat().st_size:
        return
    with file.open(encoding="utf-8", errors="replace") as text:
        there = text.readline(_MOST_HEADER).rstrip("\n").split(",")
    if there[: len(names)] != names:
        reason = "it exists already and does not begin as what would be written"
        raise RefusalError(f"{reason}: give another name, or remove it first", file)


def csv_lines(sweep: Sweep, rows: int | None = None) -> Iterator[str]:
    """The lines of the CSV; empty if a figure is not known."""
    units = sweep.units
    yield ",".join(f"{name} [{units[name]}]" if units.get(name) else name for name in table_of(sweep, slice(0))) + "\n"
    for part in blocks(len(sweep) if rows is None else rows, _ROWS):
        table = table_of(sweep, part)
        if "needed" in table:  # of a design that is refused it is not known either
            needed = table["needed"]
            table["needed"] = np.where(np.isnan(needed), "", np.where(needed == 1.0, "1", "0"))
        yield "".join(f"{','.join(row)}\n" for row in zip(*map(_cells, table.values()), strict=True))
        sweep.release()


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
    path, units, own = Path(path), sweep._units_of_columns, head(sweep.plan)
    _check_parquet(path, own)
    # `attrs` of a data frame that pandas reads from it
    metadata = {_HEAD: json.dumps(own | {"engine": ""}), "PANDAS_ATTRS": json.dumps({"units": units})}
    schema = arrow.table(table_of(sweep, slice(0, 1))).schema
    fields = [field.with_metadata({"unit": units[field.name]}) if field.name in units else field for field in schema]
    schema = arrow.schema(fields, metadata)
    with replacement(path, "parquet") as fresh, parquet.ParquetWriter(fresh, schema) as file:
        for part in blocks(len(sweep)):
            file.write_table(arrow.table(table_of(sweep, part)).cast(schema))
            sweep.release()


def _check_parquet(path: Path, own: dict[str, Any]) -> None:
    """Refuses a file of another sweep."""
    parquet = needed("pyarrow.parquet", "to_parquet")
    if not path.is_file():
        return
    try:
        there = json.loads((parquet.read_schema(path).metadata or {}).get(_HEAD.encode(), b"{}"))
    except (OSError, ValueError):
        there = {}
    if any(there.get(key) != own[key] for key in _COMPARED):
        raise RefusalError("it exists already and is not this sweep's: give another name, or remove it first", path)


# -- NPZ ---------------------------------------------------------------------------------------------------------------


def write_npz(sweep: Sweep, path: str | Path) -> None:
    """Writes the sweep, finished or interrupted; a file of another sweep is not changed."""
    path, own = Path(path), head(sweep.plan)
    if fault := npz_fault(path, own):
        raise RefusalError(f"it is another's ({fault.defect}): give another name", path)
    arrays: dict[str, NDArray[Any]] = {_HEAD: np.array(json.dumps(own)), **sweep.columns}
    arrays |= {name: sweep.values[name] for name in sweep.names}
    arrays |= {f"error.{name}": sweep.error[name] for name in sweep.names}
    arrays |= {"ways": sweep.ways, "reason_of": np.array(list(sweep.reasons), np.int64)}
    arrays["reason"] = np.array(list(sweep.reasons.values()), str)
    with replacement(path, "npz") as fresh, zipfile.ZipFile(fresh, "w") as archive:  # as `np.savez`, array by array
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                np.lib.format.write_array(file, array, allow_pickle=False)
            release([array])


def npz_fault(path: Path, own: dict[str, Any]) -> Fault | None:
    """The fault of a file without the head of a sweep."""
    if not path.exists():
        return None
    there: Any = None
    no_sweep = OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, AttributeError, TypeError
    with suppress(*no_sweep), np.load(path, allow_pickle=False) as arrays:
        there = json.loads(str(arrays[_HEAD]))
    if not isinstance(there, dict):
        advice = "give another name, or remove it first"
        return Fault(str(path), "a file that is no sweep", "a new file, or that of this sweep", advice)
    return _other(path, there, own)


# -- the sweep that is being made --------------------------------------------------------------------------------------


class Store:
    """Figures of designs as they are computed: in memory, or beside an output file in a folder that outlives the process.

    Args:
        plan: of the sweep.
        files: output files (NPZ, CSV, Parquet, by their endings); the folder has the name of the first. An NPZ file of this
            sweep is continued.

    Raises:
        SceneError, OSError: for a file or folder of another sweep, and if none can be written.

    """

    def __init__(self, plan: Plan, files: Sequence[Path]) -> None:
        self.plan, self.files = plan, files
        places = [file for file in files if file.is_file() or not file.exists()]  # no pipe or device
        self.folder = places[0].with_name(places[0].name + _FOLDER) if places else None
        self.values, self.errors, self.reasons = dict[str, Array](), dict[str, Array](), dict[int, str]()
        own = head(plan) if files else {}
        for file in files:
            _check_output(file, plan, own)
        if self.folder is None:
            self.ways = np.full(plan.total, MISSING, np.uint8)
            return
        npz = next((file for file in files if file.suffix.lower() not in (".csv", ".parquet") and file.exists()), None)
        head_file = self.folder / _HEADER
        if head_file.exists():
            if fault := _other(self.folder, json.loads(head_file.read_text(encoding="utf-8")), own):
                raise SceneError([fault])
        else:
            shutil.rmtree(self.folder, ignore_errors=True)  # of a sweep that was ended before it began
            self.folder.mkdir()
            if npz is not None:
                self._unpack(npz)
            fresh = head_file.with_suffix(".new")
            fresh.write_text(json.dumps(own), encoding="utf-8")
            fresh.replace(head_file)
        for place in self.folder.glob("*.npy"):
            kind, _, figure = place.stem.partition(".")
            if place.stem in FIGURES:
                self.values[place.stem] = np.load(place, mmap_mode="r+")
            elif kind == "error" and figure in FIGURES:
                self.errors[figure] = np.load(place, mmap_mode="r+")
        self.ways = self._array("ways", np.uint8, MISSING)
        with suppress(OSError):
            for line in (self.folder / _REASONS).read_text(encoding="utf-8").splitlines():
                with suppress(ValueError):  # of a process that was killed while it wrote this
                    k, reason = json.loads(line)
                    self.reasons[k] = reason
        release([*self.values.values(), *self.errors.values()])

    def _unpack(self, npz: Path) -> None:
        """Puts the figures of a file into the folder."""
        assert self.folder is not None
        with zipfile.ZipFile(npz) as archive, np.load(npz, allow_pickle=False) as arrays:
            for name in archive.namelist():
                figure = name.removesuffix(".npy")
                if figure == "ways" or figure.removeprefix("error.") in FIGURES:
                    with archive.open(name) as packed, (self.folder / name).open("wb") as file:
                        shutil.copyfileobj(packed, file)
            self._write_reasons(dict(zip(arrays["reason_of"].tolist(), arrays["reason"].tolist(), strict=True)))

    def _write_reasons(self, reasons: Mapping[int, str]) -> None:
        if self.folder is not None and reasons:
            with (self.folder / _REASONS).open("a", encoding="utf-8") as file:
                file.writelines(f"{json.dumps(each)}\n" for each in reasons.items())

    def _array(self, name: str, kind: Any = float, fill: float = np.nan) -> NDArray[Any]:
        """An array of the folder, made if there is none, or one in memory."""
        if self.folder is None:
            return np.full(self.plan.total, fill, kind)
        place = self.folder / f"{name}.npy"
        if place.exists():
            return np.load(place, mmap_mode="r+")  # type: ignore[no-any-return]
        fresh = place.with_suffix(".new")
        array = np.lib.format.open_memmap(fresh, "w+", np.dtype(kind), (self.plan.total,))
        for part in blocks(self.plan.total):
            array[part] = fill
            release([array])
        fresh.replace(place)
        return array

    @property
    def missing(self) -> NDArray[np.intp]:
        """The designs that are not sized yet."""
        return np.flatnonzero(self.ways == MISSING)

    def add(self, which: NDArray[np.intp], batch: Batch) -> None:
        """Stores the figures of designs, and then marks them as done."""
        first, last = which[0], which[-1] + 1
        place: Any = slice(first, last) if last - first == which.size else which
        batch.errors["needed"] = np.where(np.isnan(batch.values["needed"]), np.nan, 0.0)
        for into, rows, kind in ((self.values, batch.values, ""), (self.errors, batch.errors, "error.")):
            for name, values in rows.items():
                if name not in into:
                    if np.isnan(values).all():
                        continue
                    into[name] = self._array(kind + name)
                into[name][place] = values
            release(into.values())
        reasons = {int(which[k]): reason for k, reason in batch.reasons.items()}
        self._write_reasons(reasons)
        self.reasons.update(reasons)
        self.ways[place] = batch.ways

    def record(self) -> Sweep:
        """The record of the finished designs."""
        plan, unknown = self.plan, np.broadcast_to(np.nan, (self.plan.total,))
        own: Any = np.asanyarray if plan.total >= _MAPPED else np.array
        values, errors = (
            dict.fromkeys(FIGURES, unknown) | {name: own(array) for name, array in table.items()}
            for table in (self.values, self.errors)
        )
        columns = {path: own(column) for path, column in self._numbers().items()}
        refused = {k: reason for k, reason in sorted(self.reasons.items()) if self.ways[k] == REFUSED}
        arrays = read_only(columns), FigureArrays(values), FigureArrays(errors)
        return Sweep(plan.scene, *arrays, refused, np.array(self.ways), plan.rtol, plan.engine, plan.shape)

    def _numbers(self) -> dict[str, Array]:
        """The varied numbers, one of each for every design."""
        total, columns = self.plan.total, dict[str, Array]()
        for k, (path, column) in enumerate(self.plan.columns.items()):
            if column.shape == (total,):
                columns[path] = column
                continue
            columns[path] = self._array(f"column{k}")
            for part in blocks(total):
                place = np.unravel_index(np.arange(*part.indices(total)), self.plan.shape)
                columns[path][part] = column[place]
                release([columns[path]])
        return columns

    def end(self, sweep: Sweep) -> list[str]:
        """Writes the files of a sweep, and removes the folder if all are written and no design is missing."""
        said = []
        for file in self.files:
            try:
                _WRITERS.get(file.suffix.lower(), write_npz)(sweep, file)
            except OSError as error:
                said.append(f"{file}: {UNWRITTEN} ({error.strerror or error})")
        if self.folder is not None and not said and not sweep.missing:
            shutil.rmtree(self.folder, ignore_errors=True)
        return said


UNWRITTEN = "cannot be written"
"""Words after the name of a file in a message of a sweep."""
_WRITERS = {".csv": write_csv, ".parquet": write_parquet}


def _check_output(file: Path, plan: Plan, own: dict[str, Any]) -> None:
    """Refuses a file that this sweep cannot be written to."""
    ending = file.suffix.lower()
    if ending not in _WRITERS and (fault := npz_fault(file, own)):
        raise SceneError([fault])
    check(file, {".csv": "text", ".parquet": "parquet"}.get(ending, "npz"))
    if ending == ".parquet":
        _check_parquet(file, own)
    elif ending == ".csv":
        units = {name: one.unit for name, one in numbers(plan.scene).items() if one.unit}
        _check_csv(file, [f"{name} [{units[name]}]" if name in units else name for name in plan.columns])


_COMPARED = {
    "scene": "scene",
    "rtol": "rtol",
    "version": "version of flywheel",
    "paths": "set of numbers",
    "shape": "size",
    "numbers": "numbers",
}


def _other(path: Path, there: Mapping[str, Any], own: Mapping[str, Any]) -> Fault | None:
    """The fault of a file or folder that has the head of another sweep."""
    for key, words in _COMPARED.items():
        if there.get(key) != own[key]:
            if key == "numbers":
                return Fault(str(path), "a sweep of other numbers", "one of these columns", _OTHER)
            was, now = (_value(key, value) for value in (there.get(key), own[key]))
            return Fault(str(path), f"a sweep of another {words}{was}", f"one of this {words}{now}", _OTHER)
    return None


def _value(key: str, value: Any) -> str:
    if key == "scene":
        return ""
    listed = (", " if key == "paths" else " x ").join(map(str, value)) if isinstance(value, list) else str(value)
    return f", {listed}" if key == "paths" else f" {listed}"


_OTHER = "give another file, or remove this one"


def head(plan: Plan) -> dict[str, Any]:
    """Header of a file: the sweep to which it belongs."""
    made = hashlib.sha256()
    for column in plan.columns.values():
        for part in blocks(plan.total):
            made.update(column[np.unravel_index(np.arange(*part.indices(plan.total)), plan.shape)].tobytes())
    return {
        "version": own_version(),
        "scene": digest(plan.scene),
        "title": plan.scene.title,
        "rtol": plan.rtol,
        "engine": plan.engine,
        "paths": list(plan.columns),
        "shape": list(plan.shape),
        "numbers": made.hexdigest(),
    }


def objective(sweep: Sweep) -> str:
    """The figure by which designs are compared: the exact flywheel, or in an analysis the irregularity."""
    return "exact" if "exact" in sweep.names else "irregularity"


# -- fronts ---------------------------------------------------------------------------------------------------------------


class ParetoPoint(NamedTuple):
    """A design of the front: its figures in the order of the objectives, its numbers (SI), the choices as texts.

    `confirmed` as of an `Optimum`.
    """

    values: tuple[float, ...]
    numbers: dict[str, float]
    choices: dict[str, str]
    confirmed: bool


@dataclass(frozen=True, repr=False)
class ParetoFront:
    """The front of several objectives, ordered by the first; `greatest` is true for those that are maximized."""

    scene: Scene
    objectives: tuple[str, ...]
    greatest: tuple[bool, ...]
    units: tuple[str, ...]
    points: tuple[ParetoPoint, ...]
    number_units: dict[str, str]
    searches: int
    messages: tuple[str, ...] = ()
    interrupted: bool = False

    def __repr__(self) -> str:
        """Number of designs, and the objectives."""
        names = ", ".join(self.objectives)
        return f"ParetoFront({notebook.quoted(self.scene.title)}{len(self.points)} designs by {names})"

    def as_dict(self) -> dict[str, Any]:
        """The front for JSON, SI throughout."""
        senses = ["greatest" if greatest else "least" for greatest in self.greatest]
        return {
            "title": self.scene.title,
            "objectives": [
                {"name": name, "sense": sense, "unit": unit}
                for name, sense, unit in zip(self.objectives, senses, self.units, strict=True)
            ],
            "points": [point._asdict() | {"values": list(point.values)} for point in self.points],
            "units": self.number_units,
            "searches": self.searches,
            "interrupted": self.interrupted,
            "messages": list(self.messages),
        }
