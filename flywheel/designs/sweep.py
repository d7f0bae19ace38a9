"""A sweep: many designs of one scene, each with all figures and their errors, in a record of arrays.

Designs are sized in chunks, here or by an executor. A chunk that is lost is sized again; what is finished is kept, also if
the user interrupts. Figures of designs that were sized many at once are checked against `size` in a sample of them.
"""

from __future__ import annotations

import math
import pickle
from collections import Counter
from collections.abc import Generator, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import ExitStack, contextmanager, suppress
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flywheel.designs import figures as designs
from flywheel.designs.figures import ALONE, ENGINES, MISSING, REFINED, REFUSED, TRACED, Batch, progress_bar
from flywheel.designs.sweep_results import Check, FigureArrays, Keeper, Plan, Sweep, largest_error
from flywheel.machine.machine import Machine, scene_of
from flywheel.numerics.faults import Fault, SceneError, show, suggestion
from flywheel.reading.paths import dotted, path_faults, with_numbers
from flywheel.regime.turning_moment import speed_over_cycle
from flywheel.scene.accuracy import rtol_faults
from flywheel.scene.scene import Scene, read_only
from flywheel.sizing.results import Sizing
from flywheel.sizing.sizing import check_complete, size

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
    file: str | Path | None = None,
    chunk: int | None = None,
    progress: bool | None = None,
) -> Sweep:
    """Sizes many designs of a scene, in which some of its numbers vary.

    Args:
        scene: one that was read.
        columns: values (SI) of numbers of the scene by their paths (`mechanism.crank.length`, `load.0.from`); of equal
            length, a single number for all designs.
        rtol: relative error asked of every figure.
        grid: all combinations of the columns' values instead, which may then differ in length; the last varies fastest.
        executor: a `concurrent.futures.Executor`, a client of dask, or a number of worker processes; sized here if None.
        engine: "numpy", "numba" (which must be installed) or "size", which sizes one by one; "numpy" if None.
        file: an NPZ file that what is finished is written to, every now and then; a sweep that was interrupted goes on
            from it.
        chunk: designs that are sized together, 1,000 at least; by the number of designs if None, and of those that are
            sized one by one what takes about a second.
        progress: whether to show a bar on standard error; None where that is a terminal.

    Returns: a record of arrays; where it is interrupted by Ctrl-C, of what is finished.

    Raises:
        SceneError: for a path that is no number of the scene, columns of unequal length, an unknown engine, an executor that
            is none, a file of another scene, rtol, version or other columns. A design at fault is refused alone.

    >>> import flywheel
    >>> scene = flywheel.load({"load": [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}],
    ...                        "drive": {"torque": "balance"}, "regime": {"speed": "300 rpm"},
    ...                        "flywheel": {"irregularity": 0.01}})
    >>> found = flywheel.sweep(scene, {"flywheel.irregularity": [0.01, 0.02, -1.0]}, engine="size")
    >>> found.exact.round(6).tolist(), found.argmin("exact"), found.reasons[2]
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
    return _swept(plan, executor, None if file is None else Path(file), chunk, progress)


def columns_of(scene: Scene, columns: Mapping[str, Any], grid: bool = False) -> tuple[dict[str, Array], tuple[int, ...]]:
    """Columns of numbers by their dotted paths, as long as there are designs, and the shape of the sweep; or all faults."""
    if not isinstance(columns, Mapping) or not columns:
        given = show(columns) if columns else "nothing"
        raise SceneError([Fault("columns", given, "a mapping from paths to numbers")])
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
        axes = np.meshgrid(*arrays.values(), indexing="ij")
        return {path: np.ravel(axis) for path, axis in zip(arrays, axes, strict=True)}, shape
    return {path: np.array(np.broadcast_to(column, shape)) for path, column in arrays.items()}, shape


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
    """The figures of a chunk in another process, to which the scene goes pickled."""
    return designs.sized(_unpickled(scene), paths, columns, rtol, engine)


@lru_cache(maxsize=4)
def _unpickled(scene: bytes) -> Scene:
    """The scene that chunks carry, the same one for all of a sweep in a process."""
    unpickled: Scene = pickle.loads(scene)
    return unpickled


class _SweptDesigns:
    """The figures of a sweep as they come in, chunk by chunk, and the file that they are kept in."""

    def __init__(self, plan: Plan, file: Path | None) -> None:
        self.plan, self.batch = plan, designs.empty(plan.total)
        self.keeper = None
        if file is not None:
            self.keeper = Keeper(file, plan)
            if (before := self.keeper.before()) is not None:
                self.batch = before
        self.messages: list[str] = []

    @property
    def missing(self) -> NDArray[np.intp]:
        """The designs that are not sized yet."""
        return np.flatnonzero(self.batch.ways == MISSING)

    def add(self, which: NDArray[np.intp], batch: Batch) -> None:
        """Puts the figures of a chunk into their places."""
        for mine, theirs in ((self.batch.values, batch.values), (self.batch.errors, batch.errors)):
            for name, values in theirs.items():
                if name not in mine:
                    mine[name] = np.full(self.plan.total, np.nan)
                mine[name][which] = values
        self.batch.ways[which] = batch.ways
        self.batch.reasons.update({int(which[k]): reason for k, reason in batch.reasons.items()})
        self.keep()

    def keep(self, *, last: bool = False) -> None:
        """Writes what is finished into the file; a sweep whose file cannot be written goes on without it."""
        if self.keeper is None:
            return
        try:
            self.keeper.keep(self.batch, last=last)
        except OSError as error:
            self.messages.append(
                f"{self.keeper.path}: cannot be written ({error.strerror or error}): the last designs are missing from it"
            )
            self.keeper = None


def _swept(plan: Plan, executor: Any, file: Path | None, chunk: int | None, progress: bool | None) -> Sweep:
    table = _SweptDesigns(plan, file)
    missing, check = table.missing, None
    length = chunk or max(LEAST_CHUNK, min(_MOST_CHUNK, -(-missing.size // _CHUNKS)))
    pending = [missing[k : k + length] for k in range(0, missing.size, length)]
    try:
        with progress_bar(missing.size, progress) as advance, ExitStack() as stack:
            for which, batch in _batches(plan, pending, executor, table.messages, stack, cut=chunk is None):
                table.add(which, batch)
                advance(which.size)
                if batch.interrupted:
                    raise KeyboardInterrupt
        check = _checked(plan, table.batch)
    except KeyboardInterrupt:
        left = table.missing.size
        what = f"{left} of {plan.total} designs are missing" if left else "the designs are not checked"
        table.messages.append(f"interrupted: {what}" + (f"; the same sweep goes on from {file}" if file and left else ""))
    finally:
        table.keep(last=True)
    return record(plan, table.batch, check, table.messages)


def record(plan: Plan, batch: Batch, check: Check | None, messages: Iterable[str]) -> Sweep:
    """The record of a sweep, with what is to be said of it."""
    values: dict[str, NDArray[Any]] = dict(batch.values)
    batch.errors["needed"] = np.where(np.isnan(values["needed"]), np.nan, 0.0)
    refused = {k: reason for k, reason in sorted(batch.reasons.items()) if batch.ways[k] == REFUSED}
    said = (*messages, *_said(plan, batch, check))
    return Sweep(
        plan.scene,
        read_only(plan.columns),
        FigureArrays(values),
        FigureArrays(batch.errors),
        refused,
        batch.ways,
        plan.rtol,
        plan.engine,
        plan.shape,
        check,
        said,
    )


def _said(plan: Plan, batch: Batch, check: Check | None) -> Iterator[str]:
    alone = np.flatnonzero(batch.ways == ALONE)
    if alone.size and plan.engine != "size":
        why = Counter(batch.reasons[k] for k in alone.tolist() if k in batch.reasons).most_common(1)
        yield f"{_counted(alone.size, plan)} sized one by one" + (f": {why[0][0]}" if why else "")
    if refined := int((batch.ways == REFINED).sum()):
        yield f"{_counted(refined, plan)} refined to reach rtol {plan.rtol:g}"
    worst = largest_error(batch.errors)
    if missed := int((worst > plan.rtol).sum()):
        k = int(np.nanargmax(worst))
        yield f"rtol {plan.rtol:g} not reached by {missed} of {plan.total} designs: design {k} is good to {worst[k]:.2g}"
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


def _counted(count: int, plan: Plan) -> str:
    return f"{count} of {plan.total} design{'s' if plan.total > 1 else ''} {'was' if count == 1 else 'were'}"


# -- executors ---------------------------------------------------------------------------------------------------------

_Chunks = list[NDArray[np.intp]]


def _batches(
    plan: Plan, pending: _Chunks, executor: Any, messages: list[str], stack: ExitStack, *, cut: bool
) -> Iterator[tuple[NDArray[np.intp], Batch]]:
    """The chunks' figures as they are finished: by the executor, and here what that loses.

    With `cut`, where designs may have to be sized one by one, some are sized here at first: if they had to be, the chunks
    for an executor are cut to what takes about a second.
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
                lost = yield from _by_executor(plan, lost, stack.enter_context(_pool(executor)), messages)
    elif executor is not None:
        if hasattr(executor, "get_executor"):  # a client of dask
            executor = executor.get_executor()
        lost = yield from _by_executor(plan, lost, executor, messages)
    yield from _here(plan, lost)


def _here(plan: Plan, pending: _Chunks) -> Iterator[tuple[NDArray[np.intp], Batch]]:
    """The figures of chunks, sized here; where that goes one by one, in parts of about a second, so that it shows."""
    few = _second_of_designs(plan)
    alone = plan.engine == "size" or few < _SLOW_RATE
    for chunk in pending:
        left = chunk
        while left.size:
            part, left = (left[:few], left[few:]) if alone else (left, left[:0])
            batch = designs.sized(plan.scene, *plan.chunk(part))
            alone = _mostly_alone(batch)
            yield part, batch


def _second_of_designs(plan: Plan) -> int:
    """The number of designs that take about a second one by one, `LEAST_CHUNK` at most."""
    return max(1, min(LEAST_CHUNK, int(1.0 / min(_seconds(plan), _seconds(plan)))))  # the first one imports, too


def _mostly_alone(batch: Batch) -> bool:
    """Tells whether more than half of the designs of a chunk were sized one by one."""
    return int((batch.ways == ALONE).sum()) > batch.ways.size // 2


@contextmanager
def _pool(workers: int) -> Iterator[Executor]:
    """Worker processes of this sweep's own, which leave Ctrl-C to it."""
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_begin_work)
    try:
        yield pool
    except KeyboardInterrupt:  # chunks that nobody will take are not waited for
        for worker in list((getattr(pool, "_processes", None) or {}).values()):
            worker.terminate()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _begin_work() -> None:
    """Let a worker process leave Ctrl-C to the process that began it, and end with that whatever ends it."""
    import os
    import signal
    from multiprocessing import connection, parent_process
    from threading import Thread

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    assert parent is not None

    def follow() -> None:
        connection.wait([parent.sentinel])
        os._exit(1)

    Thread(target=follow, daemon=True).start()


def _by_executor(
    plan: Plan, pending: _Chunks, executor: Any, messages: list[str]
) -> Generator[tuple[NDArray[np.intp], Batch], None, _Chunks]:
    """The figures of chunks as an executor finishes them; those that it loses are returned, with a word on it."""
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


def _checked(plan: Plan, batch: Batch) -> Check | None:
    """A sample of the designs that were sized many at once, and those with the largest estimates, beside `size`."""
    many = np.flatnonzero((batch.ways == TRACED) | (batch.ways == REFINED))
    if not many.size:
        return None
    chosen = np.random.default_rng(many.size).choice(many, min(_SAMPLE, many.size), replace=False)
    worst = many[np.argsort(largest_error(batch.errors)[many])[-_WORST:]]
    checks: dict[int, tuple[float, str]] = {}
    for k in dict.fromkeys([*chosen.tolist(), *worst.tolist()]):
        values = {path: float(column[k]) for path, column in plan.columns.items()}
        try:
            sizing = size(with_numbers(plan.scene, values), plan.rtol, accuracy="normal")
        except SceneError as error:
            checks[k] = (math.inf, f"which size refuses ({error.faults[0]}): exact")
            continue
        theirs = designs.figures_of(sizing)
        mine = {name: (float(batch.values[name][k]), float(batch.errors[name][k])) for name in batch.values}
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
        scale = max(scale, abs(theirs["approximate_total"][0]))
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
