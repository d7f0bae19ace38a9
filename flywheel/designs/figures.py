"""The figures of many designs of one scene: some of its numbers vary, and each design is sized.

Errors are those of `size`: relative to the larger of the figure and its scale, those of angles in rad.
"""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, Executor, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import fields, is_dataclass, replace
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from math import inf
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from bondgraph.recording import Conditions, Recorder
from flywheel.components.wheel_stresses import WheelAsked
from flywheel.components.wheels import Wheel
from flywheel.designs import batch, motions
from flywheel.designs.motions import LIMITED
from flywheel.machine.machine import Machine
from flywheel.machine.programs import Structure, UnrecordableError, UnrecordedError, kept_mask, recorded
from flywheel.numerics import cells
from flywheel.numerics.cells import Index
from flywheel.numerics.expressions import Expression
from flywheel.numerics.faults import SceneError
from flywheel.reading.paths import with_numbers
from flywheel.scene.scene import Scene
from flywheel.sizing.findings import FINDINGS, Finding, estimates, figure_errors
from flywheel.sizing.limits import requirements_of
from flywheel.sizing.motor import MotorShaft, shares
from flywheel.sizing.results import Estimate, Sizing
from flywheel.sizing.sizing import size

Array = NDArray[np.float64]


class FigureKind(NamedTuple):
    """A figure of a design: its unit in SI, its words, the key of its error (several may share one), its keys in JSON."""

    unit: str
    about: str
    error: str
    keys: tuple[str, ...] = ()


_FIRST = ("flywheel.", "simulation", "speed", "balance", "power", "energy_fluctuation")  # the order of the columns


def _columns() -> dict[str, Finding]:
    """The figures of a sizing that are columns, by their names, in their order."""

    def rank(one: Finding) -> int:
        return next((k for k, first in enumerate(_FIRST) if one.key.startswith(first)), len(_FIRST))

    columns = [one for one in FINDINGS if one.column is not None]
    return {one.column.name or one.key: one for one in sorted(columns, key=rank) if one.column is not None}


_OF_SIZING = _columns()
FIGURES = {
    **{
        name: FigureKind(
            one.unit.replace("²", "^2"),
            one.column.about,
            (one.column.error or name).strip("-"),
            (one.column.key or one.key,),
        )
        for name, one in _OF_SIZING.items()
        if one.column is not None
    },
    "mass": FigureKind("kg", "mass of the wheel that the scene asks for", "wheel", ("flywheel.mass", "wheel.mass")),
    "wheel.stress": FigureKind("Pa", "greatest stress in the wheel", "wheel", ("wheel.greatest_stress",)),
    "wheel.utilisation": FigureKind("", "greatest stress in the wheel over the allowable one", "wheel"),
    "wheel.safety": FigureKind("", "safety factor of the wheel", "wheel"),
    "wheel.rim_speed": FigureKind("m/s", "rim speed of the wheel", "wheel"),
    "wheel.outer_diameter": FigureKind("m", "outer diameter of the wheel", "wheel"),
}
"""Figures of a design by their names; nan where a scene has none of a kind."""
OF_WHEEL = tuple(name for name, figure in FIGURES.items() if figure.error == "wheel")
"""Those of the wheel as built."""

TRACED, REFINED, ALONE, REFUSED, MISSING = 0, 1, 2, 3, 255
"""Ways in which a design is sized: with many at once, so and refined, one by one; refused; or not yet."""

Item = TypeVar("Item")
Outcome = TypeVar("Outcome")

ENGINES = ("numpy", "numba", "size")
"""Engines that size designs: many at once by numpy or numba, or `size` one by one."""


_CACHED = 3_000, 32  # cells of a chunk, but so many designs at least: their values then stay in the processor's cache
_MACHINE_CODE = 24_000, 512  # of one for machine code, which keeps little of it at a time
_HALVINGS = 3  # of the cells of designs that miss rtol; what is then left is sized one by one
_PORTION = 16_384  # designs at once: where the user interrupts, those of the portions before are kept
_DESIGNS_WITHOUT_BAR = 16  # designs that are finished before a bar could be read


class Batch(NamedTuple):
    """Figures of designs by their names, their errors (designs,), reasons of those refused by index, way of sizing each.

    `interrupted`: by the user, before all were sized.
    """

    values: dict[str, Array]
    errors: dict[str, Array]
    reasons: dict[int, str]
    ways: NDArray[np.uint8]
    interrupted: bool = False


def sized(
    scene: Scene, paths: tuple[str, ...], columns: Array, rtol: float, engine: str, progress: bool | None = False
) -> Batch:
    """The figures of designs with their numbers in columns; where the user interrupts it, of those that are finished.

    Args:
        scene: one that was read; see `flywheel.reading.paths`.
        paths: of the numbers that vary.
        columns: their values in SI (paths, designs).
        rtol: required relative error of every figure.
        engine: one of `ENGINES`.
        progress: True shows a bar if many are sized one by one; None does so if standard error is a terminal.

    """
    if engine == "size":
        return one_by_one(scene, paths, columns, range(columns.shape[1]), rtol, progress)
    results, structures = empty(columns.shape[1]), structures_of(scene, paths)
    portions = (
        (structure, same[first : first + _PORTION])
        for structure, same in structures.sorted(columns)
        for first in range(0, same.size, _PORTION)
    )
    for structure, which in portions:
        try:
            values, errors, halvings = at_once(structure, columns[:, which], rtol, engine)
        except KeyboardInterrupt:
            return results._replace(interrupted=True)
        every = (halvings >= 0).all()
        rows: Any = slice(None) if every else halvings >= 0
        place: Any = slice(None) if every and which.size == results.ways.size else which[rows]  # a structure's ascend
        results.ways[place] = np.where(halvings[rows] > 0, REFINED, TRACED)
        for into, source in ((results.values, values), (results.errors, errors)):
            for name, value in source.items():
                into[name][place] = value[rows]
    left = np.flatnonzero(results.ways == MISSING)
    alone = one_by_one(scene, paths, columns[:, left], range(left.size), rtol, progress)
    for into, source in ((results.values, alone.values), (results.errors, alone.errors)):
        for name, value in source.items():
            into[name][left] = value
    results.ways[left] = alone.ways
    results.reasons.update({int(left[k]): reason for k, reason in alone.reasons.items()})
    if structures.why:
        results.reasons.update(dict.fromkeys(left[alone.ways == ALONE].tolist(), structures.why))
    return results._replace(interrupted=alone.interrupted)


_recent: list[tuple[Scene, Structures]] = []
_BREAK_ERROR = 1e-9  # of the cycle: how far a plain machine's breakpoint may lie from an edge
_VALUE_ERROR = 1e-10  # of the greatest value in the cycle: how far the values of the two may lie apart
_MOST_STRUCTURES, _MOST_TRIALS = 64, 200  # structures of one set of paths, and designs tried for them
_LEAST_DESIGNS, _LEAST_SHARE = 12, 0.02  # designs, and their share of those left, that a structure is worth
_MOST_POOR = 4  # structures that are not


def structures_of(scene: Scene, paths: tuple[str, ...]) -> Structures:
    """The structures of a scene and paths; the last ones are kept, because a sweep needs them chunk by chunk."""
    for other, structures in _recent:
        same = other is scene or (scene.document and other.document and scene.document.tables == other.document.tables)
        if same and structures.paths == paths:
            return structures
    fresh = Structures(scene, paths)
    _recent[:] = [(scene, fresh)]
    return fresh


# -- designs of one structure, chunk by chunk ------------------------------------------------------------------------------


AtOnce = tuple[dict[str, Array], dict[str, Array], NDArray[np.int8]]


def at_once(structure: Structure, columns: Array, rtol: float, engine: str = "numpy", threads: int | None = None) -> AtOnce:
    """Figures of designs by their names, their errors, and the number of halvings of each design's cells; -1 if unknown.

    They are computed chunk by chunk, on cells that are halved until the error is within rtol/2.

    Unknown are those of designs whose error remains larger, with net work, at a constant speed, or with values that are not
    finite.

    Args:
        structure: of all designs.
        columns: their numbers (paths, designs), SI.
        rtol: relative error allowed.
        engine: "numpy" or "numba"; numpy is used for structures whose programs call functions.
        threads: of machine code; the number of processors if None. Numpy uses one.

    """
    count, sums_of, (size, fewest) = columns.shape[1], batch.sums, _CACHED
    engine = engine if all(program.plain for _, program in structure.programs) and not structure.rates else "numpy"
    if engine == "numba":
        from flywheel.designs import kernels  # an extra

        sums_of, (size, fewest) = kernels.sums, _MACHINE_CODE
    threads = 1 if engine == "numpy" else threads or os.cpu_count() or 1
    outcome: AtOnce = {}, {}, np.full(count, -1, np.int8)
    left: Any = np.arange(count)
    for halvings in range(_HALVINGS + 1):
        most = max(size // structure.programs[-1][0].stop, fewest) >> halvings
        parts = _parts(left, min(most, batch.DESIGNS) if engine == "numpy" else most, threads)
        chunk = partial(_chunk, structure, columns, halvings=halvings, rtol=rtol, sums_of=sums_of)
        if threads == 1 or len(parts) < 2:
            missed = [_put(outcome, part, *chunk(part)) for part in parts]
        else:
            with ThreadPoolExecutor(threads) as pool:
                missed = [_put(outcome, part, *results) for part, results in zip(parts, pool.map(chunk, parts), strict=True)]
        left = np.concatenate([*missed, left[:0]])
    return outcome


def _parts(which: Index, size: int, threads: int) -> list[Index]:
    """Designs in chunks of a size, or smaller ones so that every thread has one."""
    size = max(1, min(size, -(-which.size // threads)))
    return np.split(which, range(size, which.size, size)) if which.size else []


def _put(outcome: AtOnce, which: Index, values: dict[str, Array], errors: dict[str, Array], halvings: Array) -> Index:
    """Adds the figures of a chunk of designs to the results; returns the designs that miss rtol."""
    missed, every = which[halvings == -1], (halvings >= 0).all()
    good: Any = slice(None) if every else halvings >= 0
    consecutive = every and which[-1] - which[0] == which.size - 1  # as they ascend
    rows: Any = slice(which[0], which[0] + which.size) if consecutive else which[good]
    outcome[2][rows] = halvings[good]
    for into, source in ((outcome[0], values), (outcome[1], errors)):
        for name, value in source.items():
            if name not in into:
                into[name] = np.full(outcome[2].size, np.nan)
            into[name][rows] = np.broadcast_to(value, halvings.shape)[good]
    return np.asarray(missed)


@np.errstate(all="ignore")
def _chunk(structure: Structure, columns: Array, which: Index, *, halvings: int, rtol: float, sums_of: batch.Engine) -> Any:
    """Figures and errors of a chunk of designs, and the number of halvings of their cells; -1 if rtol is missed.

    -2 where finer cells are not tried, as no motion was found.
    """
    columns = columns[:, which]
    edges, givens = structure.edges(columns), structure.givens(columns)
    for _ in range(halvings):
        finer = np.empty((2 * edges.shape[0] - 1, edges.shape[1]))
        finer[::2], finer[1::2] = edges, 0.5 * (edges[1:] + edges[:-1])
        edges = finer
    if structure.rates:
        values, errors, missed = motions.figures(structure, columns, edges, givens, halvings, rtol)
        return values, errors, np.where(missed <= 0.5 * rtol, halvings, np.where(np.isfinite(missed), -1, -2))
    pieces = [(slice(piece.start << halvings, piece.stop << halvings), program) for piece, program in structure.programs]
    if givens.inertia is not None:
        analysis, inertia = givens._replace(irregularity=0.0 * givens.speed), givens.inertia * givens.ratio**2
        sums, givens, error = batch.moved(lambda moving: sums_of(pieces, moving, columns, edges), analysis, inertia)
        values, errors, missed = batch.of_cycle(sums, givens)
        values["irregularity"], errors["irregularity"] = givens.irregularity, error
        return values, errors, np.where(np.maximum(missed, error) <= 0.5 * rtol, halvings, -1)
    sums = sums_of(pieces, givens, columns, edges)
    values, errors, missed = batch.figures(sums, givens)
    alone = np.flatnonzero((values["needed"] == 0.0) & (missed <= 0.5 * rtol))
    if alone.size:  # the machine runs without a flywheel, at its own irregularity
        few, at = columns[:, alone], edges[:, alone]
        moved, _, missed[alone] = batch.moved(
            lambda moving: sums_of(pieces, moving, few, at), givens.of(alone), np.zeros(alone.size)
        )
        values["angle_speed_max"][alone], values["angle_speed_min"][alone] = moved.fastest, moved.slowest
        errors["angle_speed_max"][alone] = errors["angle_speed_min"][alone] = moved.angle
    return values, errors, np.where(missed <= 0.5 * rtol, halvings, -1)


# -- designs by their structures -------------------------------------------------------------------------------------------


class Structures:
    """The structures of a scene whose numbers at some paths vary; they are recorded as designs need them."""

    def __init__(self, scene: Scene, paths: Sequence[str]) -> None:
        self.scene, self.paths, self.fixed, self.why = scene, tuple(paths), tuple[str, ...](), ""
        self._structures: list[Structure] = []
        self._refused: list[Conditions] = []
        self._tries = self._poor = 0

    def sorted(self, columns: Array) -> list[tuple[Structure, Index]]:
        """Designs, numbers in columns (paths, designs; SI), by their structures; `why` has the reason why others remain."""
        columns = np.asarray(columns, dtype=float)
        left: Index = np.arange(columns.shape[1])
        groups: list[tuple[Structure, Index]] = []
        repeats = refusals = 0
        while left.size:
            if repeats < len(self._structures):
                structure, repeats = self._structures[repeats], repeats + 1
                mine = structure.kept(columns[:, left])
                groups += [(structure, left[mine])] if mine.any() else []
            elif refusals < len(self._refused):
                conditions, refusals = self._refused[refusals], refusals + 1
                mine = kept_mask(conditions, columns[:, left])
            elif self._poor >= _MOST_POOR or len(self._structures) >= _MOST_STRUCTURES or self._tries >= _MOST_TRIALS:
                break
            else:
                at = left.size // 2
                if self._record(columns[:, left], columns[:, left[at]]):
                    continue
                mine = np.arange(left.size) == at
            left = left[~mine]
        return groups

    def _record(self, columns: Array, values: Array) -> bool:
        """Records the structure of a design, checked at two others that share it, or the reason of its refusal."""
        self._tries += 1
        try:
            structure = self._of(values.tolist()).widened(columns)
        except SceneError:  # sized one by one, it says what is wrong
            conditions = refused(self.scene, self.paths, values.tolist())
            self._refused += [] if conditions is None else [conditions]
            return conditions is not None
        except UnrecordedError as error:
            self.why, self._poor = str(error), self._poor + 1
            return False
        mine = columns[:, structure.kept(columns)]
        try:
            ends = {0, mine.shape[1] - 1} if mine.size else set()
            trouble = [text for k in ends if (text := differs(structure, self.scene, mine[:, k]))]
        except SceneError as error:
            trouble = [str(error)]
        if trouble:
            self.why, self._poor = f"the recorded machine and the machine itself differ: {trouble[0]}", self._poor + 1
        if trouble or not mine.size:
            return False
        self._structures.append(structure)
        if mine.shape[1] < max(_LEAST_DESIGNS, _LEAST_SHARE * columns.shape[1]):
            self._poor += 1
            if self._poor >= _MOST_POOR:
                way = f"in {', '.join(self.fixed)}" if self.fixed else "in the order of angles, in narrow intervals"
                self.why = self.why or f"designs differ in too many ways: {way}"
        return True

    def _of(self, values: list[float]) -> Structure:
        """The structure of a design; numbers that cannot be recorded are constants."""
        try:
            return recorded(self.scene, self.paths, values, self.fixed)
        except UnrecordableError:
            self.fixed = () if self.fixed else lost(self.scene, self.paths, values)
            if not self.fixed:
                raise
            return recorded(self.scene, self.paths, values, self.fixed)


def lost(scene: Scene, paths: Sequence[str], values: Sequence[float]) -> tuple[str, ...]:
    """The paths whose numbers cannot be recorded even alone."""
    base, unrecorded = with_numbers(scene, dict(zip(paths, values, strict=True))), []
    for path, value in zip(paths, values, strict=True):
        try:
            recorded(base, [path], [value])
        except UnrecordableError:
            unrecorded.append(path)
    return tuple(unrecorded)


def refused(scene: Scene, paths: Sequence[str], values: Sequence[float]) -> Conditions | None:
    """Conditions shared by designs that are refused like the one with these values; None if they cannot be recorded."""
    recorder = Recorder()
    recorder.input("phi")
    numbers = {path: recorder.input(path, value) for path, value in zip(paths, values, strict=True)}
    try:
        scene.with_(numbers)
    except SceneError:
        return recorder.conditions()
    except Exception:
        return None
    return None


def differs(structure: Structure, scene: Scene, values: Array) -> str:
    """The difference between a structure and the plain machine of a design, in words; empty if they agree."""
    machine = Machine(with_numbers(scene, dict(zip(structure.paths, values.tolist(), strict=True))))
    column = values[:, None]
    edges = structure.edges(column)[:, 0]
    away = np.abs(machine.breakpoints[:, None] - edges).min(axis=1).max()
    if away > _BREAK_ERROR * structure.cycle:
        return f"an angle at which the machine breaks lies {away:.2g} rad from where it was recorded"
    mesh = cells.cells(edges)
    reduced = machine.reduce(mesh.phi, mesh.anchor)
    outputs = reduced.inertia, reduced.slope, reduced.moment, reduced.per_unknown, reduced.exchanged, reduced.steepness
    rows = np.zeros((6, *mesh.phi.shape))
    for part, program in structure.programs:
        for row, value in enumerate(program.function()(mesh.phi[part], *values)):
            rows[row, part] = value
    for value, want in zip(rows, outputs, strict=True):
        apart = np.abs(value - want).max()
        if not apart <= _VALUE_ERROR * max(np.abs(want).max(), np.abs(value).max()):
            return f"values differ by {apart:.2g}"
    return ""


# -- one by one ------------------------------------------------------------------------------------------------------------


def one_by_one(
    scene: Scene,
    paths: tuple[str, ...],
    columns: Array,
    which: range,
    rtol: float,
    progress: bool | None = False,
    inertias: Array | None = None,
) -> Batch:
    """The figures of some of the designs, by `size` one after the other; nan for the others, whose way is `MISSING`.

    With `inertias` (designs,) they have these flywheels (kg m²) in place of the smallest that keep their limits, and their
    limited figures over the limits are among the figures. If the user interrupts it, those that are finished are returned.
    """
    results = empty(columns.shape[1], () if inertias is None else [f"{LIMITED}{name}" for name in requirements_of(scene)])
    with progress_bar(len(which) if len(which) > _DESIGNS_WITHOUT_BAR else 0, progress, "designs one by one") as advance:
        for k in which:
            try:
                design = with_numbers(scene, dict(zip(paths, columns[:, k].tolist(), strict=True)))
                if inertias is None:
                    sizing_figures = figures_of(size(design, rtol, accuracy="normal"))
                else:
                    sizing_figures = figures_with(size(replace(design, inertia=float(inertias[k])), rtol, accuracy="normal"))
            except SceneError as error:
                results.ways[k], results.reasons[k] = REFUSED, "; ".join(map(str, error.faults))
            except KeyboardInterrupt:
                return results._replace(interrupted=True)
            else:
                results.ways[k] = ALONE
                for name, (value, error_of) in sizing_figures.items():
                    results.values[name][k], results.errors[name][k] = value, error_of
            advance(1)
    return results


@contextmanager
def progress_bar(count: int, progress: bool | None, label: str = "designs") -> Iterator[Callable[[int], object]]:
    """Progress of finished designs: a bar on standard error if that is a terminal."""
    visible = sys.stderr is not None and sys.stderr.isatty() if progress is None else progress
    if not visible or not count:
        yield lambda finished: None
        return
    import click

    with click.progressbar(length=count, label=label, file=sys.stderr, show_pos=True) as bar:
        yield bar.update


@contextmanager
def worker_pool(workers: int) -> Iterator[Executor]:
    """Worker processes, which leave Ctrl-C to this one."""
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
    """Makes a worker process leave Ctrl-C to its parent, and end whenever that ends."""
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


def each_of(
    function: Callable[[Item], Outcome],
    items: Sequence[Item],
    jobs: int,
    progress: bool | None,
    label: str,
    keep: Callable[[Outcome], object] = lambda outcome: None,
) -> list[Outcome]:
    """The values of a function of items in turn, by worker processes if `jobs` is above 1; those before an interruption.

    `keep` is called with each of them.
    """
    outcomes: list[Outcome] = []
    with progress_bar(len(items), progress, label) as bar, suppress(KeyboardInterrupt):

        def add(outcome: Outcome) -> None:
            keep(outcome)
            outcomes.append(outcome)
            bar(1)

        if jobs > 1:
            with worker_pool(jobs) as pool, suppress(BrokenExecutor):  # what a lost worker leaves is done here
                for outcome in pool.map(function, items):
                    add(outcome)
        for item in items[len(outcomes) :]:
            add(function(item))
    return outcomes


def empty(count: int, further: Iterable[str] = ()) -> Batch:
    """A batch of designs without any results yet, with `further` figures beside those of `FIGURES`."""
    values, errors = ({name: np.full(count, np.nan) for name in (*FIGURES, *further)} for _ in range(2))
    return Batch(values, errors, {}, np.full(count, MISSING, np.uint8))


def figures_of(sizing: Sizing) -> dict[str, tuple[float, float]]:
    """The figures of one sizing, each with its error; nan if there is none."""
    own = {name: ((one.column and one.column.value) or one.of)(sizing) for name, one in _OF_SIZING.items()}
    if sizing.scene.wheel is not None:
        own |= wheel_figures(sizing.scene.wheel, sizing.built and sizing.built.wheel)
    errors: Mapping[str, Estimate] = figure_errors(sizing) if sizing.built is None else estimates(sizing)
    figures = {}
    for name in FIGURES:
        value = own.get(name)
        error = errors.get(FIGURES[name].error) if FIGURES[name].error else 0.0
        limit = error if isinstance(error, float) else np.nan
        figures[name] = (np.nan, np.nan) if value is None else (float(value), limit)
    return figures


def figures_with(sizing: Sizing) -> dict[str, tuple[float, float]]:
    """The figures of a sizing with a given flywheel, and its limited ones over their limits, with absolute errors."""
    own, names = figures_of(sizing), requirements_of(sizing.scene)
    assert sizing.cycle is not None
    assert sizing.run is not None
    shaft = MotorShaft(sizing.scene, sizing.cycle, sizing.run, sizing.speed, sizing.rtol)
    reached = {name: (share.value / names[name], share.error / names[name]) for name, share in shares(names, shaft).items()}
    return own | {f"{LIMITED}{name}": share for name, share in reached.items()}


def wheel_figures(request: WheelAsked, wheel: Wheel | None) -> dict[str, float | None]:
    """The figures of a design's wheel; if none is needed they are mass 0, stress 0 and infinite safety.

    >>> from flywheel.components.wheel_stresses import material
    >>> from flywheel.components.wheels import Body, wheel_of
    >>> asked = WheelAsked("rim", material("grey cast iron"))
    >>> figures = wheel_figures(asked, wheel_of(asked, Body("rim", 1.05, 0.95, 0.1, 0.2, thin=True), 25.0))
    >>> [figures[name] for name in ("wheel.stress", "wheel.rim_speed", "wheel.outer_diameter")]
    [4500000.0, 25.0, 2.1]
    >>> wheel_figures(asked, None)["wheel.utilisation"]
    0.0

    """
    if wheel is None:
        unloaded = None if request.material.allowable is None else 0.0
        bounds = 0.0, 0.0, unloaded, None if request.material.reference is None else inf, 0.0, 0.0
        return dict(zip(OF_WHEEL, bounds, strict=True))
    stress = wheel.mass, wheel.greatest_stress, wheel.utilisation, wheel.safety
    return dict(zip(OF_WHEEL, (*stress, wheel.rim_speed, 2 * wheel.body.outer), strict=True))


MAIN = ("mass", "exact", "irregularity", "power")
"""The figures that are shown unless others are named."""


def selection(there: Iterable[str], names: Sequence[str] = ()) -> list[str]:
    """The figures to be shown: those that are named, or the main ones."""
    own = list(there)
    return [name for name in names or MAIN if name in own] or own[:1]


# -- files ----------------------------------------------------------------------------------------------------------------

_NOT_COMPARED = ("title", "source", "file", "remarks", "given_as", "document")


def own_version() -> str:
    """The version of this package; "source" if it is not installed."""
    try:
        return version("flywheel-design")
    except PackageNotFoundError:
        return "source"


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
