"""A sweep: many designs of one scene, each with all figures and their errors, in a record of arrays.

Designs are sized in chunks, here or by an executor. A lost chunk is sized again; finished chunks are kept, also if the user
interrupts. Figures of designs that were sized many at once are checked against `size` in a sample of them.
"""

from __future__ import annotations

import csv
import math
import pickle
from collections import Counter
from collections.abc import Generator, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from contextlib import ExitStack, suppress
from dataclasses import replace
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flywheel.designs import figures as designs
from flywheel.designs.figures import ALONE, ENGINES, FIGURES, REFINED, TRACED, Batch, progress_bar, worker_pool
from flywheel.designs.sweep_results import Check, Plan, Store, Sweep, needed
from flywheel.machine.machine import Machine, scene_of
from flywheel.numerics.faults import Fault, SceneError, show, suggestion
from flywheel.numerics.optima import METHODS, unit_points
from flywheel.numerics.units import QuantityError
from flywheel.reading.paths import dotted, parsed, path_faults
from flywheel.regime.turning_moment import speed_over_cycle
from flywheel.scene.scene import Scene, rtol_faults
from flywheel.sizing.results import Sizing
from flywheel.sizing.sizing import check_complete, size
from flywheel.study.answers import Question

__all__ = ["LEAST_CHUNK", "MOST_DESIGNS", "columns_of", "read_columns", "sampled", "sized_elsewhere", "sweep"]

Array = NDArray[np.float64]

LEAST_CHUNK = 1_000
"""Designs of a chunk at least: fewer are not worth being sent to another process, unless they are sized one by one."""
_MOST_CHUNK, _CHUNKS = 20_000, 64
MOST_DESIGNS = 20_000_000
_SLOW_RATE = 100  # designs a second, one by one: below it a few are tried first, as many at once may not do
_TRIED = 4  # designs that show whether an executor's will be sized one by one
_OUTSTANDING = 64  # chunks that wait for an executor at a time
_POOLS = 3  # of worker processes, before what is left is sized here
_SAMPLE, _WORST = 8, 4  # designs that are checked: at random, and those with the largest estimates
_RELATIVE_TO_TOTAL = ("exact", "approximate", "approximate_total", "inertia_torque", "inertia_torque_flywheel")
_FIGURE_ROUNDING = 1e-14
_SPEED_TIE = 1e-9  # of the fluctuation of speed, within which two extremes are one
_ERROR_RATIO = 2.0  # by which two figures may differ beyond the sum of their estimated errors


# -- what is asked -----------------------------------------------------------------------------------------------------


def sweep(
    scene: Scene | Machine,
    columns: Mapping[str, Any],
    rtol: float = 1e-10,
    *,
    grid: bool = False,
    executor: Any = None,
    engine: str | None = None,
    file: str | Path | Sequence[str | Path] | None = None,
    chunk: int | None = None,
    progress: bool | None = None,
) -> Sweep:
    """Sizes many designs of a scene, in which some of its numbers vary.

    Args:
        scene: one that was read.
        columns: values (SI) of numbers of the scene by their paths (`mechanism.crank.length`, `load.0.from`); of equal
            length, a single number for all designs.
        rtol: required relative error of every figure.
        grid: all combinations of the columns' values instead, which may then differ in length; the last varies fastest.
        executor: a `concurrent.futures.Executor`, a client of dask, or a number of worker processes; sized here if None.
        engine: "numpy", "numba" (which must be installed) or "size", which sizes one by one; "numpy" if None.
        file: output file, NPZ or by its ending CSV or Parquet; or several. Finished designs are kept in a folder beside the
            first, `FILE.part`, until it is complete: the same sweep continues from there if it was interrupted or its
            process was killed, and its figures take no memory.
        chunk: designs that are sized together, at least 1,000; by the number of designs if None, and about a second's worth
            of those sized one by one.
        progress: True shows a bar on standard error; None does so if that is a terminal.

    Returns: a record of arrays; after Ctrl-C, of the finished designs.

    Raises:
        SceneError: for a path that is no number of the scene, columns of unequal length, an unknown engine, an invalid
            executor, a file of another scene, rtol, version or other columns. A design at fault is refused alone.
        OSError: for a file that cannot be written, before any design is sized.

    >>> import flywheel
    >>> scene = flywheel.load({"load": [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}],
    ...                        "drive": {"torque": "balance"}, "regime": {"speed": "300 rpm"},
    ...                        "flywheel": {"irregularity": 0.01}})
    >>> designs = flywheel.sweep(scene, {"flywheel.irregularity": [0.01, 0.02, -1.0]}, engine="size")
    >>> designs.exact.round(6).tolist(), designs.argmin("exact"), designs.reasons[2]
    ([15.915494, 7.957747, nan], 1, 'flywheel.irregularity: found -1.0, expected a value above 0 and below 2')

    """
    scene = scene_of(scene)
    check_complete(scene)
    named, shape = columns_of(scene, columns, grid)
    faults = [] if isinstance(rtol, (int, float)) and not isinstance(rtol, bool) else [Fault("rtol", show(rtol), "a number")]
    faults += (faults or rtol_faults(float(rtol))) + _engine_faults(engine) + _executor_faults(executor)
    if chunk is not None and not (isinstance(chunk, int) and chunk >= LEAST_CHUNK):
        faults.append(Fault("chunk", show(chunk), f"{LEAST_CHUNK} designs or more"))
    if faults:
        raise SceneError(list(dict.fromkeys(faults)))
    plan = Plan(scene, named, shape, float(rtol), engine or ENGINES[0])
    files = [] if file is None else [file] if isinstance(file, (str, Path)) else file
    return _swept(plan, executor, list(map(Path, files)), chunk, progress)


def columns_of(scene: Scene, columns: Mapping[str, Any], grid: bool = False) -> tuple[dict[str, Array], tuple[int, ...]]:
    """Columns of numbers by their dotted paths, each of the shape of the sweep, and that shape; or all faults."""
    if not isinstance(columns, Mapping) or not columns:
        header = show(columns) if columns else "nothing"
        raise SceneError([Fault("columns", header, "a mapping from paths to numbers")])
    faults: list[Fault] = []
    arrays: dict[str, Array] = {}
    for path, values in columns.items():
        name = dotted(path) if isinstance(path, str) else show(path)
        try:
            array = np.asarray(values, float)
        except (TypeError, ValueError):
            array = np.zeros((0, 0))
        if name in arrays:
            faults.append(Fault(name, "two columns", "one"))
        elif array.ndim > 1 or array.size == 0:
            faults.append(Fault(name, "no numbers" if array.size == 0 else "a table", "a row of numbers in SI"))
        arrays[name] = array if array.ndim == 1 else np.atleast_1d(array.ravel())
    if not faults:
        faults = path_faults(scene, arrays)
    single = [path for path, values in columns.items() if np.ndim(values) == 0]
    lengths = {path: len(column) for path, column in arrays.items() if path not in map(dotted, map(str, single))}
    if not faults and not grid and len(set(lengths.values())) > 1:
        usual = Counter(lengths.values()).most_common(1)[0][0]
        other = next(path for path, length in lengths.items() if length != usual)
        advice = "grid=True takes all combinations"
        faults.append(Fault(other, f"{lengths[other]} numbers", f"{usual}, as many as the others", advice))
    shape = tuple(map(len, arrays.values())) if grid else (max(lengths.values(), default=1),)
    if not faults and (count := math.prod(shape)) > MOST_DESIGNS:
        faults.append(Fault("columns", f"{count} designs", f"at most {MOST_DESIGNS}"))
    if faults:
        raise SceneError(faults)
    if grid:
        return dict(zip(arrays, np.meshgrid(*arrays.values(), indexing="ij", copy=len(arrays) == 1), strict=True)), shape
    return {path: np.array(np.broadcast_to(column, shape)) for path, column in arrays.items()}, shape


def sampled(
    ranges: Mapping[str, tuple[float, float]], count: int, method: str = METHODS[0], seed: int = 0
) -> dict[str, Array]:
    """Columns of numbers spread over their ranges.

    Args:
        ranges: the two ends of each number (SI), by its path.
        count: of designs.
        method: "latin", a Latin hypercube: each of `count` equal parts of a range contains one number; "sobol", a scrambled
            sequence of low discrepancy; or "random".
        seed: of the random numbers.

    Raises:
        SceneError: for an unknown method, or a count below 1.

    >>> samples = sampled({"regime.speed": (10.0, 14.0), "flywheel.irregularity": (0.01, 0.05)}, 4)
    >>> sorted(samples["regime.speed"].astype(int).tolist())
    [10, 11, 12, 13]

    """
    faults = [] if method in METHODS else [Fault("method", show(method), f"one of {', '.join(METHODS)}")]
    if not 1 <= count <= MOST_DESIGNS:
        faults.append(Fault("samples", show(count), f"from 1 to {MOST_DESIGNS}"))
    if faults:
        raise SceneError(faults)
    unit = unit_points(method, count, len(ranges), [seed])
    return {path: low + (high - low) * row for (path, (low, high)), row in zip(ranges.items(), unit, strict=True)}


def read_columns(scene: Scene | Machine, file: str | Path) -> dict[str, Array]:
    """Columns of numbers (SI) from a table of designs, one a row: CSV, or by its ending Parquet.

    Args:
        scene: one that was read.
        file: whose columns are named by paths of numbers of the scene, with a unit if it is not SI
            ("mechanism.crank.length [mm]"). Cells of CSV may have their own units. Figures, errors, way and reason, as in
            tables of a sweep, are ignored.

    Raises:
        SceneError: for a cell that is no number of the kind, with its line.
        OSError: for a file that cannot be read.

    """
    scene, file = scene_of(scene), Path(file)
    if file.suffix.lower() == ".parquet":
        table = needed("pyarrow.parquet", "a table of designs").read_table(file)
        units = [(field.metadata or {}).get(b"unit", b"").decode() for field in table.schema]
        options: dict[str, Any] = {
            f"{name} [{unit}]" if unit else name: column.to_pylist()
            for name, unit, column in zip(table.column_names, units, table.columns, strict=True)
        }
    else:
        with file.open(encoding="utf-8-sig", newline="") as text:
            rows = list(csv.reader(text))
        wrong = next((k for k, row in enumerate(rows) if len(row) != len(rows[0])), 0)
        if wrong or len(rows) < 2:
            defect = f"{len(rows[wrong])} cells" if wrong else "no designs"
            expected = f"{len(rows[0])}, as many as columns" if wrong else "a header of paths, and a row for each design"
            raise SceneError([Fault(f"{file.name}, line {wrong + 1}", defect, expected)])
        options = dict(zip(rows[0], zip(*rows[1:], strict=True), strict=True))
    columns = dict[str, Array]()
    for head, cells in options.items():
        name, _, unit = head.rstrip(" ]").partition(" [")
        path = dotted(name.strip())
        if path not in (*FIGURES, "way", "reason") and path.partition(".")[0] != "error":
            columns[path] = _column(scene, path, unit.strip(), cells, file.name)
    return columns


def _column(scene: Scene, path: str, unit: str, cells: Sequence[Any], file: str) -> Array:
    """The numbers (SI) of cells; those without a unit have that of their column."""

    def number(k: int) -> float:
        text = str(cells[k]).strip()
        with suppress(ValueError):
            text = f"{float(text)!r} {unit}".strip()
        try:
            return parsed(scene, path, text)
        except QuantityError as error:
            where = f"{file}, line {k + 2}, {path}"
            raise SceneError([Fault(where, error.defect, error.expected, error.advice)]) from None

    try:
        plain = np.array(cells, float)
    except (TypeError, ValueError):
        return np.array([number(k) for k in range(len(cells))])
    ends = [int(plain.argmin()), int(plain.argmax())]  # NaN first
    checked = [number(k) for k in ends]
    scale = parsed(scene, path, f"1 {unit}") if unit else 1.0
    same = np.allclose(scale * plain[ends], checked, rtol=1e-12)  # no temperature
    return scale * plain if same else np.array([number(k) for k in range(len(cells))])


def _engine_faults(engine: str | None) -> list[Fault]:
    if engine is None or engine in ENGINES:
        lacking = engine == "numba" and find_spec("numba") is None
        advice = 'pip install "flywheel-design[numba]", or engine="numpy"'
        return [Fault("engine", "no numba", "numba, which it needs", advice)] if lacking else []
    return [Fault("engine", show(engine), f"one of {', '.join(ENGINES)}", suggestion(str(engine), ENGINES))]


def _executor_faults(executor: Any) -> list[Fault]:
    if executor is None or hasattr(executor, "submit") or hasattr(executor, "get_executor"):
        return []
    if isinstance(executor, int) and not isinstance(executor, bool) and executor >= 1:
        return []
    expected = "an executor of concurrent.futures, a client of dask, or a number of worker processes"
    return [Fault("executor", show(executor), expected)]


# -- the work ----------------------------------------------------------------------------------------------------------


def sized_elsewhere(scene: bytes, paths: tuple[str, ...], columns: Array, rtol: float, engine: str) -> Batch:
    """The figures of a chunk in another process, to which the scene is sent pickled."""
    return designs.sized(_unpickled(scene), paths, columns, rtol, engine)


@lru_cache(maxsize=4)
def _unpickled(scene: bytes) -> Scene:
    """The scene that chunks carry, the same one for all of a sweep in a process."""
    unpickled: Scene = pickle.loads(scene)
    return unpickled


def _swept(plan: Plan, executor: Any, files: Sequence[Path], chunk: int | None, progress: bool | None) -> Sweep:
    store, messages = Store(plan, files), list[str]()
    missing = store.missing
    length = chunk or max(LEAST_CHUNK, min(_MOST_CHUNK, -(-missing.size // _CHUNKS)))
    pending = [missing[k : k + length] for k in range(0, missing.size, length)]
    try:
        with progress_bar(missing.size, progress) as advance, ExitStack() as stack:
            for which, batch in _batches(plan, pending, executor, messages, stack, cut=chunk is None):
                store.add(which, batch)
                advance(which.size)
                if batch.interrupted:
                    raise KeyboardInterrupt
    except KeyboardInterrupt:
        messages.append(f"interrupted: {store.missing.size} of {plan.total} designs are missing")
        messages[-1] += f"; the same sweep goes on from {files[0]}" if files and store.missing.size else ""
    del missing, pending
    sweep = store.record()
    try:
        sweep = sweep if sweep.missing else replace(sweep, check=_checked(sweep))
    except KeyboardInterrupt:
        messages.append("interrupted: the designs are not checked")
    messages += _said(sweep, Counter(why for k, why in store.reasons.items() if sweep.ways[k] == ALONE))
    return replace(sweep, messages=(*messages, *store.end(sweep)))


def _said(sweep: Sweep, why: Counter[str]) -> Iterator[str]:
    total = f"of {len(sweep)} design{'s' if len(sweep) > 1 else ''}"
    for way, what in ((ALONE, "sized one by one"), (REFINED, f"refined to reach rtol {sweep.rtol:g}")):
        count = int((sweep.ways == way).sum()) if (way, sweep.engine) != (ALONE, "size") else 0
        cause = f": {why.most_common(1)[0][0]}" if way == ALONE and why else ""
        if count:
            yield f"{count} {total} {'was' if count == 1 else 'were'} {what}{cause}"
    if missed := int((sweep.worst > sweep.rtol).sum()):
        k = int(np.nanargmax(sweep.worst))
        worst = f"design {k} is good to {sweep.worst[k]:.2g}"
        yield f"rtol {sweep.rtol:g} not reached by {missed} of {len(sweep)} designs: {worst}"
    check = sweep.check
    if check is not None and check.failed:
        yield (
            f"{len(check.failed)} of {len(check.designs)} designs that were checked differ from those of size by more than "
            f"the estimated errors: {check.figure} of design {check.design} by {check.ratio:.2g} times them; "
            'engine="size" sizes one by one'
        )


def _seconds(plan: Plan) -> float:
    """Time of one design alone, s."""
    begun = process_time()
    with suppress(SceneError):
        size(plan.scene, plan.rtol, accuracy="normal")
    return max(process_time() - begun, 1e-6)


# -- executors ---------------------------------------------------------------------------------------------------------

_Chunks = list[NDArray[np.intp]]


def _batches(
    plan: Plan, pending: _Chunks, executor: Any, messages: list[str], stack: ExitStack, *, cut: bool
) -> Iterator[tuple[NDArray[np.intp], Batch]]:
    """The chunks' figures as they are finished: by the executor, and lost ones here.

    With `cut`, where designs may have to be sized one by one, some are first sized here: if that was necessary, the chunks
    for an executor are cut to about a second's worth.
    """
    lost, few = pending, _second_of_designs(plan) if executor is not None and cut and pending else LEAST_CHUNK
    if few < _SLOW_RATE and plan.engine != "size":
        tried = min(few, _TRIED)
        first, lost = lost[0][:tried], [chunk for chunk in (lost[0][tried:], *lost[1:]) if chunk.size]
        batch = designs.sized(plan.scene, *plan.chunk(first))
        yield first, batch
        few = few if _mostly_alone(batch) else LEAST_CHUNK
    if few < _SLOW_RATE or plan.engine == "size":
        lost = [chunk[k : k + few] for chunk in lost for k in range(0, chunk.size, few)]
    if isinstance(executor, int):
        for _ in range(_POOLS):
            if lost:
                lost = yield from _by_executor(plan, lost, stack.enter_context(worker_pool(executor)), messages)
    elif executor is not None:
        if hasattr(executor, "get_executor"):  # a client of dask
            executor = executor.get_executor()
        lost = yield from _by_executor(plan, lost, executor, messages)
    yield from _here(plan, lost)


def _here(plan: Plan, pending: _Chunks) -> Iterator[tuple[NDArray[np.intp], Batch]]:
    """The figures of chunks, sized here; one by one in parts of about a second, to show progress.

    No figure depends on the time that a design takes: structures are recorded for a chunk as a whole.
    """
    few, alone = 0, True
    for chunk in pending:
        left = chunk
        if alone and plan.engine != "size":
            paths, columns, *_ = plan.chunk(chunk)
            groups = designs.structures_of(plan.scene, paths).sorted(columns)
            alone = 2 * sum(which.size for _, which in groups) < chunk.size
        while left.size:
            few = (few or _second_of_designs(plan)) if alone else few
            part, left = np.split(left, [few]) if alone else (left, left[:0])
            batch = designs.sized(plan.scene, *plan.chunk(part))
            alone = plan.engine == "size" or _mostly_alone(batch)
            yield part, batch


def _second_of_designs(plan: Plan) -> int:
    """The number of designs that take about a second one by one, `LEAST_CHUNK` at most."""
    return max(1, min(LEAST_CHUNK, int(1.0 / min(_seconds(plan), _seconds(plan)))))  # the first one imports, too


def _mostly_alone(batch: Batch) -> bool:
    """Tests whether more than half of the designs of a chunk were sized one by one."""
    return int((batch.ways == ALONE).sum()) > batch.ways.size // 2


def _by_executor(
    plan: Plan, pending: _Chunks, executor: Any, messages: list[str]
) -> Generator[tuple[NDArray[np.intp], Batch], None, _Chunks]:
    """The figures of chunks as an executor finishes them; lost ones are returned, with a message."""
    waiting, lost, causes = list(reversed(pending)), _Chunks(), Counter[str]()
    running: dict[Future[Batch], NDArray[np.intp]] = {}
    packed = pickle.dumps(plan.scene)
    try:
        while waiting or running:
            while waiting and len(running) < _OUTSTANDING:
                try:
                    running[executor.submit(sized_elsewhere, packed, *plan.chunk(waiting[-1]))] = waiting[-1]
                except (BrokenExecutor, RuntimeError) as error:  # broken, or shut down
                    causes[_cause(error)] += len(waiting)
                    lost += reversed(waiting)
                    waiting = []
                else:
                    waiting.pop()
            for future in wait(running, return_when=FIRST_COMPLETED).done if running else ():
                which = running.pop(future)
                try:
                    batch = future.result()
                except Exception as error:
                    causes[_cause(error)] += 1
                    lost.append(which)
                else:
                    yield which, batch
    except KeyboardInterrupt:
        for future in running:
            if future.done() and not future.cancelled() and future.exception() is None:
                yield running[future], future.result()
        raise
    finally:
        for future in running:
            future.cancel()
    if lost:
        why = causes.most_common(1)[0][0]
        messages.append(f"the executor lost {len(lost)} of {len(pending)} chunks ({why}); they were sized again")
    return lost


def _cause(error: BaseException) -> str:
    first = str(error).strip().splitlines()
    return f"{type(error).__name__}: {first[0][:120]}" if first else type(error).__name__


# -- the check ---------------------------------------------------------------------------------------------------------


def _checked(sweep: Sweep) -> Check | None:
    """A check by `size` of a sample of designs that were sized many at once, and of those with the largest estimates."""
    many = np.flatnonzero((sweep.ways == TRACED) | (sweep.ways == REFINED))
    if not many.size:
        return None
    chosen = np.random.default_rng(many.size).choice(many, min(_SAMPLE, many.size), replace=False)
    worst = many[np.argpartition(sweep.worst[many], -min(_WORST, many.size))[-_WORST:]]
    checks: dict[int, tuple[float, str]] = {}
    for k in dict.fromkeys([*chosen.tolist(), *worst.tolist()]):
        try:
            sizing = size(sweep.design(k), sweep.rtol, accuracy="normal")
        except SceneError as error:
            checks[k] = (math.inf, f"which size refuses ({error.faults[0]}): exact")
            continue
        theirs = designs.figures_of(sizing)
        mine = {name: (float(sweep.values[name][k]), float(sweep.error[name][k])) for name in FIGURES}
        apart = (_apart(name, mine[name], theirs, sizing) for name in mine)
        checks[k] = max(zip(apart, mine, strict=True))
    k = max(checks, key=lambda k: checks[k][0])
    failed = tuple(k for k, (ratio, _) in checks.items() if not ratio <= _ERROR_RATIO)
    return Check(tuple(checks), *checks[k], k, failed)


def _apart(name: str, mine: tuple[float, float], theirs: Mapping[str, tuple[float, float]], sizing: Sizing) -> float:
    """The difference of two values of a figure over the sum of their estimated errors; infinite if one is missing."""
    (value, error), (other, of_other) = mine, theirs[name]
    if math.isnan(value) or math.isnan(other):
        return 0.0 if math.isnan(value) and math.isnan(other) else math.inf
    cycle, period = sizing.cycle, sizing.scene.cycle
    exchanged = 0.0 if cycle is None else cycle.exchanged
    scale, difference = max(abs(value), abs(other)), abs(value - other)
    if name in _RELATIVE_TO_TOTAL:
        scale = max(scale, Question.of(sizing).scale)
    elif name.startswith(("accumulated", "energy")):
        scale = max(scale, exchanged)
    elif name.startswith("reduced_inertia"):
        scale = max(scale, theirs["reduced_inertia_greatest"][0])
    elif name == "balance":
        scale = max(scale, exchanged / period)
    elif name.startswith("angle"):
        scale, difference = 1.0, abs(math.remainder(value - other, period))
        if difference > _FIGURE_ROUNDING and cycle is not None and sizing.run is not None:
            speeds = speed_over_cycle(sizing.run.cycle or cycle, sizing.speed, sizing.run, np.array([value, other]))
            if np.ptp(speeds) <= _SPEED_TIE * sizing.run.irregularity * sizing.speed:
                return 0.0  # two angles of one extreme speed
    allowed = (np.nan_to_num(error) + np.nan_to_num(of_other) + _FIGURE_ROUNDING) * scale
    return float(difference / allowed) if difference else 0.0
