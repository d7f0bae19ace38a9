"""Designs of one scene that share a machine's structure: its pieces, and the walk in each as a program of what varies.

The numbers are recorded all the way from reading to the walk over the graph (`bondgraph.recording`): every comparison that
reading, mechanisms and breakpoints make with them is a guard. Designs that keep all guards have the same pieces with the
same programs; the first that does not is recorded anew. A structure is taken when at two more designs it gives what the
plain machine gives: no angle at which that breaks lies inside a cell, and all values at the nodes are the same.

What cannot be recorded has its reason in words, and is left to be sized one by one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby, pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.elements import Here
from bondgraph.recording import NAMESPACE, Conditions, Program, Recorded, Recorder
from flywheel.designs.batch import Givens
from flywheel.machine.machine import WIDEST, Machine
from flywheel.machine.recorded import RecordedMachine, UnrecordedError, deciders, plain
from flywheel.numerics import cells, expressions
from flywheel.numerics.cells import NODES
from flywheel.numerics.expressions import Expression
from flywheel.numerics.faults import SceneError
from flywheel.numerics.intervals import NAMESPACE as INTERVALS
from flywheel.numerics.intervals import Interval
from flywheel.numerics.switching import narrow
from flywheel.reading.paths import with_numbers
from flywheel.scene.scene import Scene

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Mask = NDArray[np.bool_]

_NEAR = 1e-9  # of the cycle: how far a plain machine's breakpoint may lie from an edge
_SAME = 1e-10  # of the greatest value in the cycle: how far the values of the two may lie apart
_SLACK = 1e-12  # of a cell's width: what rounding may add
_MOST, _TRIES = 64, 200  # structures of one set of paths, and designs tried for them
_FEWEST, _LEAST = 12, 0.02  # designs, and their share of those left, that a structure is worth
_MOST_POOR = 4  # structures that are not
_SAMPLE, _MOST_DOUBLED = 100, 4  # designs by which cells are made narrow enough for the rest, and how often
_BLOCK = 2_000  # designs whose cells are looked at together
_LONGEST = 5_000  # guards: those of tables with hundreds of rows, whose place varies, would take seconds


class Narrow(NamedTuple):
    """The law of a load, by its path, that may be narrow somewhere; its names as a program of (phi, *columns)."""

    path: str
    law: Expression
    names: tuple[str, ...]
    program: Program

    def at(self, phi: Any, columns: Array, namespace: Any = "numpy") -> dict[str, Any]:
        """What its names stand for."""
        return dict(zip(self.names, self.program.function(namespace)(phi, *columns), strict=True))


class Walk(NamedTuple):
    """What a stretch between landmarks has in common: from (phi, *columns) to parts of `Reduced`, and what decides there.

    `decided` is what decides branches of laws and varies with the columns; its signs are `signs` all over the stretch.
    `laws` are those that act there and may be narrow.
    """

    program: Program
    decided: Program | None
    signs: tuple[float, ...]
    laws: tuple[Narrow, ...]


@dataclass(frozen=True)
class Structure:
    """Smooth pieces that designs share; its programs are functions of (phi, *columns), columns being the numbers that vary.

    conditions: what the designs have in common. landmarks: edges between which one walk holds and nothing is narrow.
    walks: one for each stretch between them, with as many cells as `counts` says. numbers: speed (rad/s), irregularity, the
    flywheel's and the drive's ratio to the crank, the drive's torque (N m), and the greatest speed of a mechanism over the
    crank's; NaN where there is none.
    """

    paths: tuple[str, ...]
    cycle: float
    unknown: bool
    conditions: Conditions
    landmarks: Program
    walks: tuple[Walk, ...]
    numbers: Program
    counts: tuple[int, ...] = ()

    def edges(self, columns: Array) -> Array:
        """Edges of the cells (cells + 1, designs), rad."""
        marks = _at(self.landmarks, columns)
        stretch = np.repeat(np.arange(len(self.counts)), self.counts)
        share = np.concatenate([np.arange(count) / count for count in self.counts])[:, None]
        first = marks[stretch]
        return np.concatenate((first + share * (marks[stretch + 1] - first), marks[-1:]))

    @cached_property
    def programs(self) -> list[tuple[slice, Program]]:
        """Consecutive cells with the program that they share."""
        found: list[tuple[slice, Program]] = []
        end = 0
        for walk, count in zip(self.walks, self.counts, strict=True):
            same = bool(found) and found[-1][1] == walk.program
            start = found.pop()[0].start if same else end
            end += count
            found.append((slice(start, end), walk.program))
        return found

    def givens(self, columns: Array) -> Givens:
        """Speed, irregularity and drive of every design."""
        speed, irregularity, ratio, drive, torque, inertia, _ = _at(self.numbers, columns)
        driven, given, analysed = (bool(np.isfinite(row).all()) for row in (drive, torque, inertia))
        return Givens(
            speed=speed,
            irregularity=irregularity,
            ratio=ratio,
            span=self.cycle,
            unknown=self.unknown,
            drive=drive if driven else None,
            torque=torque if given else None,
            inertia=inertia if analysed else None,
        )

    def kept(self, columns: Array) -> Mask:
        """Which designs have this structure: they keep its guards, cells are narrow enough, and no branch changes in one."""
        with np.errstate(all="ignore"):
            good = _kept(self.conditions, columns)
            good[good] = (self._counts(columns[:, good]) <= np.array(self.counts)[:, None]).all(axis=0)
            for first in range(0, columns.shape[1], _BLOCK):
                block = good[first : first + _BLOCK]
                block[block] = self._followed(columns[:, first : first + _BLOCK][:, block])
        return good

    def widened(self, columns: Array) -> Structure:
        """The same with as many cells in each stretch as those designs need that keep its guards."""
        with np.errstate(all="ignore"):
            kept = columns[:, _kept(self.conditions, columns)]
            found = replace(self, counts=tuple(self._counts(kept).max(axis=1, initial=1).tolist()))
            some = kept[:, :: max(1, kept.shape[1] // _SAMPLE)]
            for _ in range(_MOST_DOUBLED if any(walk.laws for walk in self.walks) else 0):
                narrow_enough = found._narrow(some).all(axis=1)
                if narrow_enough.all():
                    break
                counts = np.array(found.counts)
                wide = ~np.logical_and.reduceat(narrow_enough, np.cumsum(counts) - counts)
                found = replace(found, counts=tuple((counts * (1 + wide)).tolist()))
        return found

    def _counts(self, columns: Array) -> Array:
        """How many cells each stretch of each design takes, at least."""
        widths = np.diff(_at(self.landmarks, columns), axis=0)
        fastest = _at(self.numbers, columns)[-1]
        counts = np.ceil(widths * fastest / WIDEST * (1.0 - _SLACK)).clip(1.0)
        return np.where(np.isfinite(counts), counts, 1e6).astype(int)

    def _followed(self, columns: Array) -> Mask:
        """Whether no branch changes and no law is too narrow, in any cell of a design."""
        good = np.ones(columns.shape[1], bool)
        for walk, low, high in self._stretches(columns) if any(walk.decided for walk in self.walks) else ():
            phi = 0.5 * (low + high) + 0.5 * (high - low) * NODES[:, None, None]
            for value, sign in zip(walk.decided.function()(phi, *columns) if walk.decided else (), walk.signs, strict=True):
                good &= np.broadcast_to(value * sign > 0.0, phi.shape).all(axis=(0, 1))
        if any(walk.laws for walk in self.walks):
            good &= self._narrow(columns).all(axis=0)
        return good

    def _stretches(self, columns: Array) -> Iterator[tuple[Walk, Array, Array]]:
        """Every walk with the left and the right edges of its cells; stretches of one piece stand together."""
        edges, end = self.edges(columns), 0
        for _, group in groupby(zip(self.walks, self.counts, strict=True), lambda each: id(each[0])):
            walks, counts = zip(*group, strict=True)
            start, end = end, end + sum(counts)
            yield walks[0], edges[start:end], edges[start + 1 : end + 1]

    def _narrow(self, columns: Array) -> Mask:
        """Which cells (cells, designs) are narrow enough for all laws that act there."""
        stretches, peaks = list(self._stretches(columns)), dict[str, Array]()
        centres = [[each.at(0.5 * (low + high), columns) for each in walk.laws] for walk, low, high in stretches]
        for (walk, low, _), found in zip(stretches, centres, strict=True):
            for each, centre in zip(walk.laws, found, strict=True):
                size = np.abs(np.broadcast_to(each.law.evaluate(centre, np, centre), low.shape))
                size = np.where(np.isfinite(size), size, 0.0).max(axis=0)
                peaks[each.path] = np.maximum(size, peaks.get(each.path, 0.0))
        masks = []
        for (walk, low, high), found in zip(stretches, centres, strict=True):
            good, share = np.ones(low.shape, bool), (high - low) / self.cycle
            for each, centre in zip(walk.laws, found, strict=True):
                inside = each.at(Interval(low, high), columns, INTERVALS)
                good &= narrow(each.law, inside, centre, share, peaks[each.path])
            masks.append(good)
        return np.concatenate(masks)


def _at(program: Program, columns: Array) -> Array:
    """What a program gives at columns, one row for each output."""
    return np.stack([np.broadcast_to(value, columns.shape[1:]) for value in program.function()(0.0, *columns)])


def _kept(conditions: Conditions, columns: Array) -> Mask:
    """Which designs keep all guards, a block at a time: hundreds of differences for each take much room."""
    blocks = [columns[:, first : first + _BLOCK] for first in range(0, columns.shape[1], _BLOCK)]
    found = [np.broadcast_to(conditions.kept(0.0, *block), block.shape[1:]) for block in blocks]
    return np.concatenate([*found, np.zeros(0, bool)])


# -- recording -------------------------------------------------------------------------------------------------------------


class LostError(UnrecordedError):
    """Numbers that a machine needs as they are, such as a count of teeth, or the lengths of a linkage."""


def recorded(scene: Scene, paths: Sequence[str], values: Sequence[float], held: Sequence[str] = ()) -> Structure:
    """The structure of a scene whose numbers at some paths have values (SI), with no cells cut yet.

    held: paths whose numbers designs of the structure have in common.

    Raises:
        SceneError: for a scene with these values that is at fault.
        LostError: where the numbers at these paths cannot be recorded.
        UnrecordedError: where the machine cannot be followed with recorded numbers, whichever they are.

    """
    base = with_numbers(scene, dict(zip(paths, values, strict=True)))
    _check(base)
    twin, recorder = Machine(base), Recorder()
    phi = recorder.input("phi")
    numbers = {path: recorder.input(path, value) for path, value in zip(paths, values, strict=True)}
    try:
        with np.errstate(all="ignore"):
            for path in held:
                recorder.compared("equal", numbers[path], numbers[path].value)
            machine = RecordedMachine(base.with_({path: numbers[path] for path in paths if path not in held}), twin)
            return _structure(machine, recorder, phi, tuple(paths))
    except UnrecordedError:
        raise
    except Exception as error:  # whatever reading or a mechanism does with a number that stands for many
        raise LostError(f"{', '.join(paths)} cannot vary in a program ({error})") from error


def lost(scene: Scene, paths: Sequence[str], values: Sequence[float]) -> tuple[str, ...]:
    """Those of some paths whose numbers cannot be recorded even alone."""
    base, found = with_numbers(scene, dict(zip(paths, values, strict=True))), []
    for path, value in zip(paths, values, strict=True):
        try:
            recorded(base, [path], [value])
        except LostError:
            found.append(path)
    return tuple(found)


def refused(scene: Scene, paths: Sequence[str], values: Sequence[float]) -> Conditions | None:
    """What designs have in common that are refused as that with these values is; None where it cannot be recorded."""
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


def _check(scene: Scene) -> None:
    """Refuse what a program of position alone does not tell."""
    drive = scene.drive
    for found, what in (
        (scene.areas is not None, "a diagram of areas has no machine"),
        (scene.stroke is not None, "a stroke is no cycle"),
        (scene.depends_on_speed, "torques depend on speed"),
        (scene.speed is None or not scene.has_flywheel, "no speed or no flywheel is given"),
        (scene.wheel is not None, "a wheel is to be chosen for each"),
        (bool(scene.duty), "a duty has several phases"),
        (scene.rubs, "friction in joints follows from the motion"),
        (any(efficiency < 1.0 for efficiency in scene.efficiencies.values()), "meshes have losses"),
        (drive is not None and not isinstance(drive.law, float | int | None), "the drive's torque is no plain number"),
    ):
        if found:
            raise UnrecordedError(what)


def _structure(machine: RecordedMachine, recorder: Recorder, phi: Recorded, paths: tuple[str, ...]) -> Structure:
    scene, twin = machine.scene, machine.twin
    if machine.depends_on_time:
        raise UnrecordedError("loads depend on time")
    pieces, landmarks, plain_marks = machine.breakpoints, machine.landmarks, twin.landmarks
    if len(recorder.guards) > _LONGEST:
        raise UnrecordedError("tables are too long, and move with what varies")
    walks: dict[int, Walk] = {}
    stretches = []
    for low, high in pairwise(plain_marks.tolist()):
        k = int(np.searchsorted(twin.breakpoints, 0.5 * (low + high))) - 1
        if k not in walks:
            walks[k] = _walk(machine, recorder, phi, 0.5 * (pieces[k] + pieces[k + 1]))
        stretches.append(walks[k])
    drive, nothing = scene.drive, float("nan")
    given: list[Any] = [scene.speed, nothing if scene.irregularity is None else scene.irregularity, scene.flywheel_ratio]
    given += [nothing, nothing] if drive is None else [scene.shafts[drive.on], nothing if drive.law is None else drive.law]
    return Structure(
        paths=paths,
        cycle=scene.cycle,
        unknown=scene.unknown is not None,
        conditions=recorder.conditions(),
        landmarks=recorder.program(landmarks),
        walks=tuple(stretches),
        numbers=recorder.program([*given, nothing if scene.inertia is None else scene.inertia, machine.fastest]),
        counts=(1,) * len(stretches),
    )


def _walk(machine: RecordedMachine, recorder: Recorder, phi: Recorded, anchor: Any) -> Walk:
    """The walk in the piece of an anchor, and what decides branches there, as far as it varies from design to design."""
    found = machine.reduction(phi, anchor, NAMESPACE)
    rows = found.inertia, found.slope, found.moment, found.per_unknown, found.exchanged, found.steepness
    decided, signs, laws = [], [], []
    for effort in machine.efforts:
        law = effort.load.law
        active = effort.active(Here(effort.place.rate * anchor, None, np))
        if isinstance(law, Expression) and active and _may_be_narrow(law):
            names, at = machine.named(effort, phi, anchor), plain(anchor)
            laws.append(Narrow(effort.path, law, tuple(names), recorder.program(names.values())))
            laws[-1].at(Interval(at, at), np.array([each.value for each in recorder.inputs[1:]]), INTERVALS)  # it is bounded
        for part in deciders(effort):
            value = machine.decided(effort, part, phi, anchor).value
            if _varies(recorder, value):
                decided.append(value)
                signs.append(float(np.sign(plain(machine.decided(effort, part, anchor, anchor).value))))
    return Walk(recorder.program(rows), recorder.program(decided) if decided else None, tuple(signs), tuple(laws))


def _may_be_narrow(law: Expression) -> bool:
    """Whether an expression is more than polynomials of low degree."""
    tame = ("number", "name", "pi", "sum", "product", "neg", "if", "abs", "sign", "min", "max", *expressions.BOOLEAN)
    return any(node.op not in tame or (node.op == "product" and "/" in node.signs) for node in expressions.walk(law.tree))


def _varies(recorder: Recorder, value: Any) -> bool:
    """Whether a value depends on more than phi, the first input."""
    if not isinstance(value, Recorded):
        return False
    program = recorder.program([value])
    varying = set(range(1, len(program.inputs)))
    return any(varying.intersection(operands) for _, *operands in program.operations)


# -- proof -----------------------------------------------------------------------------------------------------------------


def differs(structure: Structure, scene: Scene, values: Array) -> str:
    """In what a structure and the plain machine of a design differ, in words; nothing where they agree."""
    machine = Machine(with_numbers(scene, dict(zip(structure.paths, values.tolist(), strict=True))))
    column = values[:, None]
    edges = structure.edges(column)[:, 0]
    away = np.abs(machine.breakpoints[:, None] - edges).min(axis=1).max()
    if away > _NEAR * structure.cycle:
        return f"an angle at which the machine breaks lies {away:.2g} rad from where it was recorded"
    mesh = cells.cells(edges)
    reduced = machine.reduce(mesh.phi, mesh.anchor)
    wanted = reduced.inertia, reduced.slope, reduced.moment, reduced.per_unknown, reduced.exchanged, reduced.steepness
    found = np.zeros((6, *mesh.phi.shape))
    for part, program in structure.programs:
        for row, value in enumerate(program.function()(mesh.phi[part], *values)):
            found[row, part] = value
    for value, want in zip(found, wanted, strict=True):
        apart = np.abs(value - want).max()
        if not apart <= _SAME * max(np.abs(want).max(), np.abs(value).max()):
            return f"values differ by {apart:.2g}"
    return ""


class Sorted(NamedTuple):
    """Designs by their structures, those left over, and why they are, in words."""

    groups: list[tuple[Structure, Index]]
    rest: Index
    why: str


class Structures:
    """The structures of a scene whose numbers at some paths vary; they are found as designs need them."""

    def __init__(self, scene: Scene, paths: Sequence[str]) -> None:
        self.scene, self.paths, self.held, self.why = scene, tuple(paths), tuple[str, ...](), ""
        self._known: list[Structure] = []
        self._refused: list[Conditions] = []
        self._tries = self._poor = 0

    def sorted(self, columns: Array) -> Sorted:
        """The designs whose numbers stand in columns (paths, designs; SI) by their structures."""
        columns = np.asarray(columns, dtype=float)
        left: Index = np.arange(columns.shape[1])
        groups: list[tuple[Structure, Index]] = []
        rest: list[Index] = []
        known = refusals = 0
        while left.size:
            if known < len(self._known):
                structure, known = self._known[known], known + 1
                mine = structure.kept(columns[:, left])
                groups += [(structure, left[mine])] if mine.any() else []
            elif refusals < len(self._refused):
                conditions, refusals = self._refused[refusals], refusals + 1
                mine = _kept(conditions, columns[:, left])
                rest.append(left[mine])
            elif self._exhausted:
                break
            else:
                at = left.size // 2
                if self._record(columns[:, left], columns[:, left[at]]):
                    continue
                mine = np.arange(left.size) == at
                rest.append(left[mine])
            left = left[~mine]
        return Sorted(groups, np.sort(np.concatenate([*rest, left])).astype(int), self.why)

    @property
    def _exhausted(self) -> bool:
        return self._poor >= _MOST_POOR or len(self._known) >= _MOST or self._tries >= _TRIES

    def _record(self, columns: Array, values: Array) -> bool:
        """Record the structure of a design, proven at two others of those that share it, or why it is refused."""
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
            self.why, self._poor = f"recorded and plain machine part: {trouble[0]}", self._poor + 1
        if trouble or not mine.size:
            return False
        self._known.append(structure)
        if mine.shape[1] < max(_FEWEST, _LEAST * columns.shape[1]):
            self._poor += 1
            if self._poor >= _MOST_POOR:
                way = f"in {', '.join(self.held)}" if self.held else "in the order of angles, in what is narrow"
                self.why = self.why or f"designs differ in too many ways: {way}"
        return True

    def _of(self, values: list[float]) -> Structure:
        """The structure of a design; numbers that cannot be recorded are held."""
        try:
            return recorded(self.scene, self.paths, values, self.held)
        except LostError:
            self.held = () if self.held else lost(self.scene, self.paths, values)
            if not self.held:
                raise
            return recorded(self.scene, self.paths, values, self.held)
