"""The steady motions of many designs of one structure at once, where torques depend on speed.

Every design has the constant speed at which its net work is zero, its figures there, and its motion by Newton's method on
the equations of `regime.cycle_equations` with an axis of designs; errors are those of `regime.periodic_motion`. Other cases
are sized alone: no such speed or several close ones, a motion that does not converge, is unstable, stops, or has torques so
steep that cells would have to follow them. Flywheels that keep limits are searched for as by `sizing.limits`: the searches
of all designs run together, and each round computes their next flywheels at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.components.motors.motor import DesignMotors
from flywheel.designs import batch
from flywheel.machine.equation import Moments, Rate
from flywheel.machine.machine import MeshStage
from flywheel.machine.programs import RATE, STAGE, DesignValues, Structure
from flywheel.numerics import cells
from flywheel.numerics.cells import NODES, ORDER, ROUNDING, TAIL_OF_INTEGRAL, Array, Cells, Index
from flywheel.numerics.faults import SceneError
from flywheel.regime import constant_speed
from flywheel.regime.branch import Existence, stopped_flywheel
from flywheel.regime.cycle_equations import (
    Demand,
    NoRegimeError,
    Periodic,
    State,
    balanced_guess,
    first_guess,
    periodic_motions,
    with_inertia,
)
from flywheel.regime.periodic_motion import STIFF, errors_by_stiffness, motion_errors
from flywheel.regime.several_motions import (
    CUT_MOVE,
    MOST_CUTS,
    Deciding,
    SeveralMoments,
    moved_cuts,
    on_cut_cells,
    patterns,
    sound,
    through_meshes,
)
from flywheel.regime.turning_moment import CycleErrors, Run, spread_of_closing
from flywheel.sizing import limits
from flywheel.sizing.limits import FlywheelPoint, LimitState
from flywheel.sizing.motor import IRREGULARITY, MotorShafts, Share, of_motor, shares

Figures = tuple[dict[str, Array], dict[str, Array], Array]
Start = Callable[..., State | None]

_READING_ERROR = 4 * ROUNDING  # of a figure that is the scene's own
_SPEED_STEPS = 60  # of Newton's method towards a constant speed, within its bracket
_BEYOND = 1e-2  # of a speed: how far a root may lie beside the bracket that a few nodes give
_CLOSED = 1e-9  # of a speed: step towards the root from one that is at it, and not at an end of the bracket
_LIGHT = 1e-3  # of the machine's own inertia: the least start of the iteration for a flywheel
_FADING = 2.0  # exponent in a cycle from which a motion may be near the speeds at which torques balance
_LAYER, _MOST_LAYERS = 8.0, 8  # exponent of what decays in the first cell behind a jump; halvings towards it
_NO_INERTIA = 1e-6  # of the greatest: a least inertia beside which the machine is as good as weightless
_AT_ONCE = 20_000  # values at nodes for several speeds: arrays of them stay in the processor's cache
_WEIGHTS: Array = cells.integral(np.eye(ORDER), np.ones((ORDER, 1)))
_SPEEDS_LOOKED_AT = np.concatenate((np.geomspace(1e-3, 0.1, 9), np.linspace(0.15, 1.2, 36), np.geomspace(1.25, 64.0, 16)))
_FEW = slice(0, ORDER, 5)  # nodes that give the sign of a net work
_FEW_WEIGHTS: Array = np.linalg.solve(np.vander(NODES[_FEW], increasing=True).T, np.array([2.0, 0.0, 2 / 3, 0.0, 0.4]))
LIMITED = "limits."  # before the name of a figure that is limited
_QUESTIONS = 400  # flywheels that are looked at together
_BESIDE = 1e-3  # of an inertia: distance of the motion that tells how figures change with it
_MOST_ERROR, _HARDLY = 0.5, 0.1  # of an irregularity, and of J + I*: beyond these a motion is refused or open


class StagePart(NamedTuple):
    """A stage of many designs with its place, and I* and dI*/dphi (kg m²) of its parts, (designs, cells, nodes)."""

    stage: MeshStage
    place: int
    inertia: Array
    slope: Array


class _PieceProgram(NamedTuple):
    """Cells of one program: its values of `RATE` and `STAGE`, and "moving" of `RATE` alone, by `rows` without speed."""

    part: slice
    values: Callable[..., tuple[Any, ...]]
    moving: Callable[..., tuple[Any, ...]]
    rows: list[Any]


class DesignMoments(SeveralMoments):
    """The machines of designs on their own cells, as `Moments` with an axis of designs before all others.

    Args:
        structure: that the designs share.
        columns: their numbers (paths, designs), SI.
        edges: of their cells (cells + 1, designs), rad.
        starts: places of the edges of the structure's own cells among them.

    """

    def __init__(self, structure: Structure, columns: Array, edges: Array, starts: Index) -> None:
        self.machine, self.local, self.circuit, self.swings = structure.twin, False, None, False
        self.structure, self.columns, self.starts, self.drive_ratio = structure, columns, starts, 1.0
        ends = edges.T
        half = 0.5 * (ends[:, 1:, None] - ends[:, :-1, None])
        middle = ends[:, :-1, None] + half
        self.mesh = Cells(ends, middle, half, middle + half * NODES)
        inputs = columns[:, :, None, None]
        rows = np.empty((6, *self.mesh.phi.shape))
        for piece, program in structure.programs:
            part = slice(starts[piece.start], starts[piece.stop])
            for row, value in zip(rows, program.function()(self.mesh.phi[:, part], *inputs), strict=True):
                row[:, part] = value
        self.inertia, self.slope, self.still, _, _, self.steepness = rows
        self._pieces: list[_PieceProgram] = []
        self.lossy = len(self.machine.stages) > 1
        self.divided = self.lossy or self.machine.switches_at_speeds  # the motion itself divides the cells
        for piece, early, late in structure.rates:
            part = slice(starts[piece.start], starts[piece.stop])
            moving = late._replace(outputs=(late.outputs[RATE.index("moving")],)).only(1)
            rows_of = list(early.function()(self.mesh.phi[:, part], *inputs))
            self._pieces.append(_PieceProgram(part, late.function(), moving.function(), rows_of))
        self._last: tuple[Array, Any, Array] | None = None  # values at the last speeds and unknowns, for stage after stage
        values = self._evaluated(np.zeros_like(half), 0.0)
        self.resistance, of_stage = values[RATE.index("resistance")], values[len(RATE) :]
        self.parts: list[Any] = [
            StagePart(stage, k, *of_stage[k * len(STAGE) :][len(STAGE) - 2 : len(STAGE)])
            for k, stage in enumerate(self.machine.stages)
        ]

    def of(self, which: Index) -> DesignMoments:
        """The machines of some designs."""
        moments, count = copy(self), self.inertia.shape[0]
        moments.__dict__.pop("locally", None)
        moments._last = None
        moments.mesh, moments.columns = Cells(*(each[which] for each in self.mesh)), self.columns[:, which]
        for name in ("inertia", "slope", "steepness", "still", "resistance"):
            setattr(moments, name, getattr(self, name)[which])
        moments.parts = [part._replace(inertia=part.inertia[which], slope=part.slope[which]) for part in self.parts]
        moments._pieces = [
            piece._replace(rows=[row[which] if np.ndim(row) and len(row) == count else row for row in piece.rows])
            for piece in self._pieces
        ]
        return moments

    def thinned(self) -> DesignMoments:
        """The same at a few nodes of every cell, by which `total` gives the sign of values far from zero."""
        moments = copy(self)
        moments._last = None
        moments.mesh = self.mesh._replace(phi=self.mesh.phi[..., _FEW])
        for name in ("inertia", "slope", "still", "resistance"):
            setattr(moments, name, getattr(self, name)[..., _FEW])
        moments.parts = [part._replace(inertia=part.inertia[..., _FEW], slope=part.slope[..., _FEW]) for part in self.parts]

        def at_few(row: Any) -> Any:
            return row[..., _FEW] if np.ndim(row) and np.shape(row)[-1] == ORDER else row

        moments._pieces = [piece._replace(rows=[*map(at_few, piece.rows)]) for piece in self._pieces]
        return moments

    def cut(self, which: Index, angles: Array) -> DesignMoments:
        """The designs on cells with further ends at angles (rad), (designs, cuts), as many in each cell for all designs."""
        edges = self.mesh.edges[which]
        inside = (angles[:1, :, None] >= edges[:1, None, :]).sum(
            axis=(0, 1)
        )  # of the first design: so many lie beyond an edge
        before = angles.shape[1] - inside
        finer = np.sort(np.concatenate((edges, angles), axis=1), axis=1)
        return DesignMoments(self.structure, self.columns[:, which], finer.T, self.starts + before[self.starts])

    def layered(self, which: Index, layers: int) -> DesignMoments:
        """The designs on cells whose first half is halved repeatedly, because speeds settle steeply behind a jump."""
        edges = self.mesh.edges[which]
        shares = np.concatenate(([0.0], 0.5 ** np.arange(layers, 0, -1)))
        inner = edges[:, :-1, None] + np.diff(edges, axis=1)[:, :, None] * shares
        finer = np.concatenate((inner.reshape(which.size, -1), edges[:, -1:]), axis=1)
        return DesignMoments(self.structure, self.columns[:, which], finer.T, self.starts * (layers + 1))

    def _evaluated(self, omega: Array, unknown: Any, outputs: slice = slice(None)) -> Array:
        """The values of `RATE` and `STAGE` at crank speeds on (designs, cells or 1, nodes or 1)."""
        total: Array | None = None
        for part, values_of, _, rows in self._pieces:
            values = values_of(*rows, omega[:, part] if omega.shape[1] > 1 else omega, unknown)[outputs]
            if total is None:
                total = np.empty((len(values), *self.mesh.phi.shape))
            for row, value in zip(total, values, strict=True):
                row[:, part] = value
        assert total is not None
        return total

    @property
    def own_edges(self) -> Array:
        """The edges (rad) of each machine's own cells, (designs, cells + 1)."""
        return self.mesh.edges[:, self.starts]

    def _acting(self, part: Any, omega: Array, unknown: Any, states: Any) -> Rate:
        if self._last is None or self._last[0] is not omega or self._last[1] is not unknown:
            self._last = omega, unknown, self._evaluated(omega, unknown, slice(len(RATE), None))
        moment, by_speed, by_unknown, exchanged = self._last[2][part.place * len(STAGE) :][:4]
        return Rate(moment, by_speed, by_unknown, np.broadcast_to(0.0, moment.shape), np.zeros((0, *omega.shape)), exchanged)

    def switches(self, omega: Array) -> list[Array]:
        """Values at crank speeds on (designs, cells, nodes) whose signs decide branches of laws; 1 where none is decided."""
        inputs, shape = self.columns[:, :, None, None], self.mesh.phi.shape
        switches = np.ones((max((len(program.outputs) for _, program in self.structure.switches), default=0), *shape))
        for piece, program in self.structure.switches:
            part = slice(self.starts[piece.start], self.starts[piece.stop])
            values = program.function()(self.mesh.phi[:, part], *inputs, omega[:, part], 0.0)
            for row, value in zip(switches, values, strict=False):
                row[:, part] = value
        return list(switches)

    def driven(self, omega: Array, unknown: Any) -> tuple[Array, Array]:
        """The drive's share of F (N m on the crank), and its slope by the speed."""
        drive, by_speed = self._evaluated(omega, np.asarray(unknown)[..., None, None], slice(2))
        return drive, by_speed

    def net_works(self, speeds: Array) -> Array:
        """Net works (J) of a cycle run at constant crank speeds (speeds, designs), without mesh losses and unknown."""
        works = self.total(self.still) - self.total(self.resistance) * speeds
        for part, _, moving, rows in self._pieces:
            half = self.mesh.half[:, part]
            few = max(_AT_ONCE // half.size, 1)
            for k in range(0, len(speeds), few):
                moment = np.asarray(moving(*rows, speeds[k : k + few, :, None, None], 0.0)[0], dtype=float)
                wide = np.broadcast_to(moment, np.broadcast_shapes(moment.shape, (1, 1)))
                works[k : k + few] += (self._over_cell(wide) * half[..., 0]).sum(axis=-1)
        return np.asarray(works)

    def stopped_flywheels(self, speed: Array, marks: Array) -> Array:
        """The flywheels (kg m² on the crank) with which the machines certainly stop; see `branch.stopped_flywheel`.

        Args:
            speed: of the cranks, about that of their motions, rad/s.
            marks: characteristic speeds of their motors, rad/s, (marks, designs).

        """
        speeds = np.sort(np.concatenate((np.multiply.outer(_SPEEDS_LOOKED_AT, speed), marks)), axis=0)
        moments = self.still - self.resistance * speeds[:, :, None, None]
        for part, _, moving, rows in self._pieces:
            moments[:, :, part] += np.asarray(moving(*rows, speeds[:, :, None, None], 0.0)[0], dtype=float)
        return np.asarray(stopped_flywheel(moments, speeds, self.mesh.half * _WEIGHTS, self.inertia))

    def with_losses(self, speeds: Array, works: Array, row: Index) -> Array:
        """Net works (J) less the losses in meshes, from those without at speeds (speeds, designs), from a row of each down.

        They go down to the first speed at which a design gains, and stay without losses below that; none with a row of -1.
        """
        works, every, gains = works.copy(), np.arange(works.shape[1]), row < 0
        while not gains.all():
            place = row.clip(0, len(works) - 1)
            net = self.total(self.constant(speeds[place, every], 0.0).moment)
            works[place, every] = np.where(gains, works[place, every], net)
            gains = gains | ((row < len(works)) & (net > 0.0)) | (row == 0)
            row = row - ~gains
        return works

    def total(self, values: Array) -> Array:
        """The integral over the cycle of values at the nodes."""
        return np.asarray((self._over_cell(values) * self.mesh.half[..., 0]).sum(axis=-1))

    @staticmethod
    def _over_cell(values: Array) -> Array:
        """The integral over a cell of half width 1 of values at its nodes, at a few of them, or of a constant."""
        weights = {1: np.array([2.0]), ORDER: _WEIGHTS, _FEW_WEIGHTS.size: _FEW_WEIGHTS}[values.shape[-1]]
        return np.asarray(values @ weights)


def operating_points(moments: DesignMoments, numbers: Array, targets: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Constant crank speeds (rad/s) at which the net work is zero, the unknowns there, and a mask of the certain ones.

    Where there is a balance the speed is the required one. Else it is the greatest stable one of those that
    `constant_speed.steady_speeds` would find; if a peak of the net work might reach zero between two trial speeds, the
    result is not certain.

    Args:
        moments: the machines.
        numbers: typical speeds, then the characteristic ones of motors (rows, designs), rad/s.
        targets: the scene's speed, NaN without one.

    """
    if moments.machine.scene.unknown is not None:
        return targets, *closed(moments, targets, np.zeros_like(targets))[1:]
    tried, thinned = constant_speed.speeds_to_try(numbers[0], numbers[1:]), moments.thinned()
    works = lossless = thinned.net_works(tried)
    above = len(works) - (works[::-1] > 0.0).argmax(axis=0)  # losses only take: from the second row on no speed gains
    if moments.lossy:
        works = thinned.with_losses(tried, works, np.where((works > 0.0).any(axis=0), above + 1, -1))
    before, after = works[:-1], works[1:]
    stable = (before > 0.0) & (after <= 0.0)
    row, design = len(stable) - 1 - stable[::-1].argmax(axis=0), np.arange(targets.size)
    inner = np.arange(1, len(stable))[:, None]
    peaks = np.where(inner > above, constant_speed.humped(lossless)[1], constant_speed.humped(works)[1])
    good = stable.any(axis=0) & np.isfinite(lossless).all(axis=0) & ~(peaks & (inner > row)).any(axis=0)
    low, high, gained, lost = tried[row, design], tried[row + 1, design], before[row, design], after[row, design]
    start = low + (high - low) * gained / np.where(good, gained - lost, 1.0)
    speed, unknown, solved = closed(moments, start, np.zeros_like(start), low * (1.0 - _BEYOND), high * (1.0 + _BEYOND))
    return speed, unknown, good & solved


def closed(
    moments: DesignMoments, speed: Array, unknown: Array, low: Any = 0.0, high: Any = np.inf
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """The constant speeds (rad/s) near some at which the net work is zero, or the unknowns; and which of them are roots."""
    balanced = moments.machine.scene.unknown is not None
    for _ in range(_SPEED_STEPS):
        rate = moments.constant(speed, unknown[:, None, None])
        net, slope = moments.total(rate.moment), moments.total(rate.by_unknown if balanced else rate.by_speed)
        if balanced:
            step = -net / slope
            unknown, good = unknown + step, np.abs(slope) > 1e-9 * moments.total(np.abs(rate.by_unknown))
            near = np.abs(step) <= 4 * ROUNDING * np.abs(unknown)
            if not moments.lossy:
                break
        else:
            low, high, good = np.where(net >= 0.0, speed, low), np.where(net <= 0.0, speed, high), slope < 0.0
            closer = speed - net / np.where(good, slope, -1e-300)
            closer = np.where((closer >= low) & (closer <= high), closer, 0.5 * (low + high))
            near, within = np.abs(closer - speed) <= 4 * ROUNDING * speed, np.abs(net) <= _CLOSED * np.abs(slope * speed)
            speed = closer
        if (near | ~good).all():
            break
    return speed, unknown, good if balanced else good & within


class _FigureTable:
    """Figures of designs by their names, NaN if unknown, filled group by group."""

    def __init__(self, size: int) -> None:
        self.size, self.rows = size, dict[str, Array]()

    def put(self, which: Index, rows: dict[str, Array], chosen: Any = slice(None)) -> None:
        """Takes the chosen ones of the rows of a group of designs."""
        for name, row in rows.items():
            self.rows.setdefault(name, np.full((self.size, *row.shape[1:]), np.nan))[which[chosen]] = row[chosen]


def figures(structure: Structure, columns: Array, edges: Array, givens: DesignValues, halvings: int, rtol: float) -> Figures:
    """Figures of designs by their names, their errors, and the one that halving cells must bring within rtol/2.

    That is infinite for a design to be sized alone.
    """
    moments = DesignMoments(structure, columns, edges, np.arange(1 + sum(structure.counts)) << halvings)
    speed, unknown, good = operating_points(moments, structure.speeds(columns), givens.speed)
    values, errors = _FigureTable(speed.size), _FigureTable(speed.size)
    missed, start = np.full(speed.size, np.inf), np.ones((4, speed.size))

    def constant(finer: DesignMoments, which: Index, stands: Any, moved: Array | float = 0.0) -> None:
        of_some = _at_constant_speed(finer, givens.of(which), speed[which], unknown[which], moved)
        values.put(which, of_some[0], stands)
        errors.put(which, of_some[1], stands)
        missed[which[stands]], start[:, which[stands]] = of_some[2][stands], of_some[3][:, stands]

    if not moments.divided:
        constant(moments, np.arange(speed.size), slice(None))
    else:
        for which, cuts in patterns(moments, good, *_deciding(moments, speed, unknown)):
            for _ in range(MOST_CUTS):
                finer = moments.cut(which, cuts)
                speed[which], unknown[which], closed_rows = closed(
                    finer, speed[which], unknown[which], 0.9 * speed[which], 1.1 * speed[which]
                )
                cuts, moved, slack = moved_cuts(finer, cuts, *_deciding(finer, speed[which], unknown[which]))
                stands = closed_rows & (moved <= slack)
                if (stands | ~np.isfinite(moved)).all():
                    break
            constant(finer, which, stands, moved)
    least, greatest, least_error, guess = start
    good &= np.isfinite(missed)
    inertia, ratio = givens.inertia, np.broadcast_to(givens.ratio, speed.shape)
    if inertia is not None:
        inertia = guess = inertia * ratio**2
        good &= inertia + least > least_error
    limits = structure.limits_of(columns) if of_motor(moments.machine.scene) else {}
    starts = (first_guess,) if limits else (first_guess, balanced_guess)  # a search has other flywheels to begin with
    solved = partial(_solutions, moments, givens, speed, unknown, starts=starts, trials=bool(limits))

    # the motion: with the flywheel that is given or sought, or with none if none is found
    left, worst = np.flatnonzero(good), np.full(speed.shape, np.inf)
    own = Solutions({}, {}, worst[left], np.zeros(left.shape, bool), {})  # none is sought where there is no irregularity
    if inertia is not None or np.isfinite(givens.irregularity).all():
        own = solved(left, guess[left], None if inertia is None else inertia[left])
    if limits and left.size:
        stopped = moments.stopped_flywheels(speed, structure.speeds(columns)[1:])
        ends = [values.rows["energy_fluctuation"], least, greatest, speed, stopped]
        own = _limited(solved, left, limits, ends, own, rtol)
    if inertia is None and own.success.any():
        own.values["exact"] = own.values["exact"] / ratio[left] ** 2
    for alone in (False, True):
        if own.success.any():
            if inertia is None:
                own.values["needed"] = np.zeros(left.shape) if alone else np.sign(own.values["exact"])
                own.errors["needed"] = np.zeros(left.shape)
            values.put(left, own.values, own.success)
            errors.put(left, own.errors, own.success)
            worst[left[own.success]] = own.missed[own.success]
        if alone or inertia is not None or limits:
            break
        left = left[~own.success & (least > _NO_INERTIA * greatest)[left]]
        own = _even_enough(solved(left, 0.0 * speed[left], 0.0 * speed[left]), givens.irregularity[left])
    return values.rows, errors.rows, np.where(good, np.maximum(missed, worst), np.inf)


class Solutions(NamedTuple):
    """Motions: their figures and errors by name, the error that cells must bring within rtol, and a mask of those found.

    `states` are those of trials on the machines' own cells, by the names of `State`, with the reference speed (rad/s).
    """

    values: dict[str, Array]
    errors: dict[str, Array]
    missed: Array
    success: NDArray[np.bool_]
    states: dict[str, Array]


def _at_constant_speed(
    moments: DesignMoments, givens: DesignValues, speed: Array, unknown: Array, moved: Array | float
) -> tuple[dict[str, Array], dict[str, Array], Array, Array]:
    """Figures at constant speeds (rad/s) with their errors, the worst, and the initial values of the search for motions.

    That is the least and the greatest I* and the error of the former, and a guess of the flywheel, kg m² on the crank.
    `moved` (rad) are the errors of the ends of cells that are cut.
    """
    eps = givens.irregularity
    sized = givens.inertia is None and bool(np.isfinite(eps).all())
    rate = moments.constant(speed, unknown[:, None, None])
    cycle = _cycle(moments, rate, unknown, moved)
    loose: Any = 0.0
    if not givens.unknown:  # the last digits of a speed that the machine takes by itself shift a stiff torque in the cycle
        shifted = 4 * ROUNDING * speed * moments.total(np.abs(rate.by_speed))
        cycle = cycle._replace(work=cycle.work + shifted, net=cycle.net + shifted)
        loose = 2 * cycle.net / np.maximum(np.abs(moments.total(rate.by_speed)) * speed, 1e-300)
    at_speed = givens._replace(speed=speed, drive=None, unknown=False, irregularity=eps if sized else 0.0 * speed)
    square, none = speed**2, np.zeros(speed.shape)
    share = np.stack([(1 + sign * at_speed.irregularity / 2) ** 2 for sign in (1, -1, 0)])
    sums = batch.summed(cycle, -0.5 * square * share, at_speed, balance=none, by_unknown=none)
    values, errors, missed = (batch.figures if sized else batch.of_cycle)(sums, at_speed)
    for name in ("approximate", "approximate_total", "inertia_torque", "inertia_torque_flywheel") if sized else ():
        errors[name] = errors[name] + loose
    residue = 2 * np.abs(sums.net) / np.maximum(sums.exchanged, 1e-300)
    for name in ("energy_fluctuation", "accumulated_max", "accumulated_min"):
        errors[name] = errors[name] + residue
    least, greatest, least_error, _ = sums.extent
    lightest = _LIGHT * np.maximum(greatest, (sums.greatest[batch.WORK] - sums.least[batch.WORK]) / square)
    guess = (sums.greatest[batch.FAST] - sums.least[batch.SLOW]) / (eps * square) - sums.start if sized else none
    missed = np.where(greatest > sums.inertia, missed, np.inf)
    return values, errors, missed, np.stack((least, greatest, least_error, np.maximum(guess, lightest)))


def _cycle(moments: DesignMoments, rate: Rate, unknown: Array, moved: Array | float) -> batch.Cycles:
    """The cycles in which F is as given at the nodes; `moved` (rad) are the errors of the ends of cells that are cut."""
    rows = rate.moment, moments.slope, moments.inertia, rate.exchanged, moments.steepness
    values = np.zeros((5, batch.POINTS.size, *moments.mesh.half.shape[1::-1]))
    for into, row in zip(values, rows, strict=True):
        into[1:-1] = row.transpose(2, 1, 0)
    balanced = moments.machine.scene.unknown is not None
    spread = spread_of_closing(rate, moments.mesh, balanced=balanced, unknown=unknown)
    by_directions = moments.structure.givens(moments.columns).by_directions
    cycle = batch.assembled(np.ascontiguousarray(moments.mesh.edges.T), values, spread, by_directions)
    if not moments.machine.switches_at_speeds:
        return cycle
    ends = cells.ends(cells.fit(rate.moment))  # laws that switch may jump there
    wrong = moved * np.abs(ends[:, 1:, 0] - ends[:, :-1, 1]).sum(axis=-1)
    return cycle._replace(work=cycle.work + wrong, net=cycle.net + wrong)


# -- flywheels that keep limits ------------------------------------------------------------------------------------------


def _limited(
    solved: Callable[..., Solutions],
    which: Index,
    demands: dict[str, Array],
    ends: Sequence[Array],
    sized: Solutions,
    rtol: float,
) -> Solutions:
    """The motions with the smallest flywheels that keep limits: many searches at once.

    A design is sized alone if its search ends without a flywheel, or beside flywheels of unknown state: those without a
    motion from a first guess.

    Args:
        solved: the motions of designs with flywheels (kg m² on the crank).
        which: the designs.
        demands: their limits, by name.
        ends: the fluctuation of energy (J), the machine's least and greatest inertia (kg m²), the constant speed (rad/s),
            flywheels with which it certainly stops (kg m²).
        sized: the motions with flywheels for an irregularity among the limits.
        rtol: required relative error of an inertia.

    """
    answers, searches = dict[tuple[int, float], FlywheelPoint](), list[limits.Search]()
    kept, known = np.full((2, which.size), np.nan), [dict[float, dict[str, Any]]() for _ in which]

    def look(questions: list[tuple[int, float]]) -> None:
        for first in range(0, len(questions), _QUESTIONS):
            some = questions[first : first + _QUESTIONS]
            rows, inertias = (np.array(column) for column in zip(*some, strict=True))
            solutions = solved(which[rows], inertias, inertias, others=_nearest(known, some))
            answers.update({question: _point(solutions, k, question[1], demands) for k, question in enumerate(some)})
            for k in np.flatnonzero(np.isfinite(solutions.states.get("reference", ()))).tolist():
                row, inertia = some[k]
                known[row][inertia] = {name: states[k] for name, states in solutions.states.items()}

    def further(row: int, inertia: float | None = None) -> float | None:
        """The next flywheel of a design's search, after the result of the last; None at its end."""
        while True:
            last = inertia
            try:
                inertia, _ = steps[row].send(None if last is None else answers[row, last])  # type: ignore[arg-type]
            except StopIteration as end:
                spans, *rest = end.value
                if _certain(searches[row], spans, rest[0]):
                    kept[:, row] = rest
                return None
            except (SceneError, NoRegimeError):  # sized alone it says why
                return None
            if inertia == last and not answers[row, inertia].motions:  # another method, which is not tried here
                return None
            if (row, inertia) not in answers:
                return inertia

    for row, k in enumerate(which.tolist()):
        own = {name: float(values[k]) for name, values in demands.items()}
        fluctuation, least, greatest, speed, stopped = (float(end[k]) for end in ends)
        extent = limits.extent(fluctuation, least, greatest, speed, own.get(IRREGULARITY, 2.0))
        searches.append(limits.Search(own, *extent, rtol, in_turn=1, stopped=stopped))
        if sized.success[row] and (inertia := float(sized.values["exact"][row])) > 0.0:
            error = float(sized.errors["exact"][row])
            searches[row].points[inertia] = _point(sized, row, inertia, demands)._replace(error=error)
    steps = [limits.first_kept(search, 1.0, alone=False) for search in searches]
    grids = [[each for each in search.inertias if each > search.stopped] for search in searches]
    questions = [(row, further(row)) for row in range(which.size)]
    while some := [(row, inertia) for row, inertia in questions if inertia is not None]:
        ahead = max(_QUESTIONS // len(some), 1)  # of the grid, which a small round has room for
        coming = ((row, grids[row][grids[row].index(at) :] if at in grids[row] else [at]) for row, at in some)
        look([(row, inertia) for row, inertias in coming for inertia in inertias[:ahead] if (row, inertia) not in answers])
        questions = [(row, further(row, inertia)) for row, inertia in some]

    values, errors, missed = _FigureTable(which.size), _FigureTable(which.size), np.full(which.shape, np.inf)
    rows = np.flatnonzero(np.isfinite(kept[0]))
    inertia, error = kept[:, rows]
    near = _nearest(known, zip(rows.tolist(), inertia.tolist(), strict=True))
    at, beside = (solved(which[rows], each, each, others=near) for each in (inertia, inertia * (1.0 + _BESIDE)))
    stands = at.success & beside.success
    if stands.any():
        along = {name: value for name, value in at.values.items() if name != IRREGULARITY and not name.startswith(LIMITED)}
        moved = {name: np.abs(beside.values[name] - value) / _BESIDE * error for name, value in along.items()}
        scales = {
            name: 1.0 if name.startswith("angle") else np.maximum(np.abs(value), 1e-300) for name, value in along.items()
        }
        off = {name: at.errors[name] + moved[name] / scales[name] for name in along}
        values.put(rows, along | {"exact": inertia}, stands)
        errors.put(rows, off | {"exact": error}, stands)
        missed[rows[stands]] = np.maximum(at.missed, error)[stands]
    if sized.success.any():  # where the irregularity decides
        same = np.flatnonzero(sized.success & (kept[0] == sized.values["exact"]))
        for table, rows_of in ((values, sized.values), (errors, sized.errors)):
            table.put(same, {name: row[same] for name, row in rows_of.items() if not name.startswith(LIMITED)})
        missed[same] = sized.missed[same]
    return Solutions(values.rows, errors.rows, missed, np.isfinite(missed), {})


def _nearest(
    known: Sequence[Mapping[float, Mapping[str, Any]]], questions: Iterable[tuple[int, float]]
) -> Mapping[str, Array]:
    """The states of each design's known motion whose flywheel is nearest to another, NaN for designs without any."""

    def ratio(one: float, other: float) -> float:
        return max(one, other) / max(min(one, other), 1e-300)

    nearest: list[Mapping[str, Any]] = [
        known[row][min(known[row], key=partial(ratio, inertia))] if known[row] else {} for row, inertia in questions
    ]
    some = next(filter(None, nearest), {})
    nothing = {name: np.full_like(rows, np.nan) for name, rows in some.items()}
    return {name: np.array([(own or nothing)[name] for own in nearest]) for name in some}


def _point(solutions: Solutions, row: int, inertia: float, names: Iterable[str]) -> FlywheelPoint:
    """A flywheel (kg m² on the crank) with the figures along its motion, if one was found."""
    if not solutions.success[row]:
        return FlywheelPoint(inertia, Existence.UNKNOWN)
    columns = {name: f"{LIMITED}{name}" for name in names}
    values, errors = solutions.values, solutions.errors
    along = {name: Share(float(values[key][row]), float(errors[key][row])) for name, key in columns.items()}
    return FlywheelPoint(inertia, Existence.MOTION, (row,), along)


def _certain(search: limits.Search, spans: Mapping[str, Sequence[limits.Span]], inertia: float) -> bool:
    """Tests whether no lighter flywheel keeps the limits: they are broken just below it, and more so further below."""
    whole = limits.together(spans.values())
    if inertia == 0.0:  # with which it moves
        return True
    before = next((span.state for span, after in pairwise(whole) if after.first == inertia), None)
    points = [point for point in search.grid if point.motions]
    if len(points) == len(search.grid):
        return before is LimitState.BROKEN
    lightest, beside = points[0].shares, points[1].shares
    worse = any(
        lightest[name].value > max(beside[name].value, limit + lightest[name].error) for name, limit in search.limits.items()
    )
    return before is LimitState.BROKEN and worse


# -- cells that end where a mesh changes the side that drives, or a law switches at a speed ------------------------------


def _deciding(moments: DesignMoments, speed: Array, unknown: Array) -> tuple[list[Deciding], Array]:
    """The values that divide cells at constant speeds (see `several_motions.decided`), and the work exchanged (J)."""
    rate = moments.constant(speed, unknown[:, None, None])
    deciding = through_meshes(moments, rate.transmitted)
    if moments.machine.switches_at_speeds:
        omega = speed[:, None, None] + np.zeros_like(moments.mesh.phi)
        deciding += [(values, 0.0) for values in moments.switches(omega)]
    return deciding, moments.total(rate.exchanged)


# -- the motions ---------------------------------------------------------------------------------------------------------


def _solutions(
    moments: DesignMoments,
    givens: DesignValues,
    speed: Array,
    unknown: Array,
    which: Index,
    guess: Array,
    inertia: Array | None,
    starts: Sequence[Start],
    others: Mapping[str, Array] | None = None,
    *,
    trials: bool = False,
) -> Solutions:
    """The motions of some designs, from first guesses, on cells that narrow where speeds settle steeply behind a jump.

    Args:
        moments: the machines.
        givens: their requirements.
        speed: constant speeds (rad/s) from which the motions are found.
        unknown: the values of the scene's unknown there.
        which: the designs; one may occur with several flywheels.
        guess: of the flywheels, kg m² on the crank.
        inertia: of given ones; None if they are sized for the irregularity.
        starts: the first guesses, of which the second is tried where torques damp a change of speed fast.
        others: motions to begin with in place of a first guess, as `Solutions.states` has them.
        trials: True for those of a search: only one without a flywheel has narrower cells, as heavier ones serve as well.

    """
    values, errors, states = _FigureTable(which.size), _FigureTable(which.size), _FigureTable(which.size)
    missed, solved = np.full(which.shape, np.inf), np.zeros(which.shape, bool)
    omega, of_some = speed[which], givens.of(which)
    by_speed = moments.of(which).constant(omega, unknown[which][:, None, None]).by_speed
    total = (guess[:, None, None] + moments.inertia[which]) * omega[:, None, None]
    exponents = (-by_speed / total).max(axis=-1) * 2.0 * moments.mesh.half[which, :, 0]
    steepest = np.maximum(exponents.max(axis=1) / _LAYER, 1.0)
    left_out = (steepest > 1.0) & (guess > 0.0) & trials
    for first in starts:
        near = ~solved & ~left_out & (exponents.sum(axis=1) > (_FADING if first is balanced_guess else -np.inf))
        for some in (np.flatnonzero(near & (steepest == 1.0)), np.flatnonzero(near & (steepest > 1.0))):
            if not some.size:
                continue
            deep = min(int(np.ceil(np.log2(steepest[some].max()))), _MOST_LAYERS)
            finer = moments.layered(which[some], deep) if deep else moments.of(which[some])
            own, off, missing, stands, solved_states = _motions(
                finer,
                of_some.of(some),
                omega[some],
                unknown[which[some]],
                guess[some],
                None if inertia is None else inertia[some],
                first,
                {} if deep or not others else {name: rows[some] for name, rows in others.items()},
            )
            if trials and not deep:
                states.put(some, solved_states, stands)
            values.put(some, own, stands)
            errors.put(some, off, stands)
            missed[some[stands]], solved[some[stands]] = missing[stands], True
    return Solutions(values.rows, errors.rows, missed, solved, states.rows)


def _beside(
    others: Mapping[str, Array], moments: Moments, speed: Array, first: State, inertia: Array
) -> tuple[Array, State]:
    """Reference speeds (rad/s) and states to begin with: those of other motions with these flywheels, if there are any."""
    known = np.isfinite(others["reference"])
    rows = (np.where(known.reshape(-1, *[1] * (own.ndim - 1)), others[name], own) for name, own in first._asdict().items())
    reference = np.where(known, others["reference"], speed)
    return reference, with_inertia(State(*rows), moments, reference, inertia)


def _even_enough(own: Solutions, irregularity: Array) -> Solutions:
    """The motions without a flywheel that keep the irregularity, whose error replaces that of a flywheel."""
    if not own.success.any():
        return own
    eps, error = own.values.pop("irregularity"), own.errors.pop("irregularity")
    values, errors = own.values | {"exact": 0.0 * eps}, own.errors | {"exact": error}
    return Solutions(values, errors, own.missed, own.success & (eps * (1.0 + error) <= irregularity), {})


def _motions(
    moments: DesignMoments,
    givens: DesignValues,
    speed: Array,
    unknown: Array,
    guess: Array,
    inertia: Array | None,
    start: Start,
    others: Mapping[str, Array],
) -> tuple[dict[str, Array], dict[str, Array], Array, NDArray[np.bool_], dict[str, Array]]:
    """The figures of motions with their errors, the one that cells must bring within rtol, the valid motions, their states.

    Args:
        moments: the machines.
        givens: their requirements.
        speed: constant speeds (rad/s) from which the motions are found.
        unknown: the values of the scene's unknown there.
        guess: of the flywheels, kg m² on the crank.
        inertia: of given ones; None if they are sized for the irregularity.
        start: the first guess of the motion.
        others: motions to begin with in its place, as `Solutions.states` has them, if any.

    """
    demand = Demand(inertia, givens.irregularity if inertia is None else None, speed if givens.unknown else None)
    values, errors, missed, closed_rows = (
        _FigureTable(speed.size),
        _FigureTable(speed.size),
        np.full(speed.shape, np.inf),
        np.zeros(speed.shape, bool),
    )
    around = moments.locally if moments.lossy else moments
    first = start(around, speed, guess, unknown)
    if first is None:
        return values.rows, errors.rows, missed, closed_rows, {}
    reference = speed
    if others and inertia is not None:
        reference, first = _beside(others, around, speed, first, inertia)
    solved, near = periodic_motions(around, reference, demand, first)
    states: dict[str, Any] = solved.state._asdict() | {"reference": solved.reference}
    if not moments.divided:
        return *_of_motion(moments, solved, demand, givens, near, 0.0), states
    for cut in on_cut_cells(moments, solved, near, demand):
        of_some = _of_motion(cut.moments, cut.solved, cut.demand, givens.of(cut.which), cut.success, cut.moved)
        edge = cut.solved.extremes.cell + (cut.solved.extremes.t > 0.0)
        at_cuts = (np.abs(cut.solved.extremes.t) == 1.0) & ~np.isin(edge, cut.moments.starts)
        off = np.where(at_cuts.any(axis=1), np.maximum(CUT_MOVE * moments.structure.cycle, cut.moved), 0.0)
        for name in ("angle_speed_max", "angle_speed_min"):
            of_some[1][name] = of_some[1][name] + off
        for table, rows in ((values, of_some[0]), (errors, of_some[1])):
            table.put(cut.which, rows)
        missed[cut.which], closed_rows[cut.which] = of_some[2], of_some[3]
    return values.rows, errors.rows, missed, closed_rows, states


def _of_motion(
    moments: DesignMoments,
    solved: Periodic,
    demand: Demand,
    givens: DesignValues,
    closed_rows: NDArray[np.bool_],
    moved: Array | float,
) -> tuple[dict[str, Array], dict[str, Array], Array, NDArray[np.bool_]]:
    """The same of motions on cells that end where meshes change the side that drives."""
    cycle, state, extremes, eps, speed = (
        _cycle(moments, solved.rate, solved.state.unknown, moved),
        solved.state,
        solved.extremes,
        solved.irregularity,
        solved.speed,
    )
    inertia, balanced = state.inertia, givens.unknown
    by_cell, inside = (each.transpose(0, 2, 1) for each in (cycle.by_cell, cycle.inside))
    worst: Any = cycle.inertias.max(axis=0)
    of_works: Any = (cycle.work, cycle.variation, worst, by_cell, inside, cycle.left, cycle.net)
    of_cycle: Any = (*of_works, cycle.inertias.T, cycle.of_start)
    own = motion_errors(solved, demand, CycleErrors(*of_cycle), inertia + cycle.inertia_at_start)
    by_stiffness, bound_by_stiffness = errors_by_stiffness(solved)
    irregularity, bound = own.irregularity + by_stiffness, own.flywheel + bound_by_stiffness
    total = inertia[:, None, None] + moments.inertia
    fading = np.abs(cells.integral(solved.rate.by_speed / (total * solved.omega), moments.mesh.half)).sum(axis=-1)
    kept = closed_rows & (fading <= STIFF) & sound(solved, irregularity, _MOST_ERROR)
    values, errors = {"speed": speed}, {"speed": own.speed + 0.5 * eps * by_stiffness + _READING_ERROR}
    if balanced:
        errors["speed"] = _READING_ERROR + np.abs(speed / givens.speed - 1.0)
    exchanged = np.maximum(cycle.exchanged, 1e-300)
    missed = np.maximum(irregularity, np.maximum(cycle.work, cycle.net) / exchanged)
    if demand.inertia is None:
        kept &= (inertia > 0.0) & (bound <= _HARDLY * (inertia + moments.inertia.max(axis=(-2, -1))))
        scale = np.maximum(inertia, np.ptp(cycle.start[0], axis=0) / (eps * speed**2))
        values["exact"], errors["exact"] = inertia, bound / scale
        missed = np.maximum(missed, errors["exact"])
    else:
        values["irregularity"], errors["irregularity"] = eps, irregularity
    if balanced:
        balance, size = state.unknown, np.abs(state.unknown * moments.total(solved.rate.by_unknown))
        of_balance = own.balance * cycle.net / np.where(size > 0.0, size, np.inf)
        values["balance"], errors["balance"] = (
            balance,
            np.where(balance != 0.0, of_balance + _READING_ERROR, cycle.net / exchanged),
        )
    if names := limits.requirements_of(moments.machine.scene) if of_motor(moments.machine.scene) else ():
        fast, slow = (solved.reference * (1.0 + extremes.excess[:, k]) for k in (0, 1))
        figures: list[Any] = [inertia, eps, fast, slow, 0.0, 0.0, 0.0, irregularity]
        run = Run(*figures)._replace(speed=speed, level=own.level)
        ratio = 1.0 if givens.drive is None else givens.drive
        assert moments.structure.motor is not None
        motors: Any = DesignMotors(moments.structure.motor, moments.columns)
        for name, share in shares(names, MotorShafts(motors, ratio, run, solved)).items():
            values[f"{LIMITED}{name}"], errors[f"{LIMITED}{name}"] = share
    if givens.drive is not None:
        _add_power(moments, solved, cycle, values, errors, givens, errors["speed"] + 0.5 * eps * irregularity)

    # where the speed is extreme
    angle_error: Array = np.zeros_like(speed)
    high, low = (1.0 + extremes.excess[:, k] for k in (0, 1))
    loose = irregularity * eps * (high + low) + 2 * own.speed
    by_speed = cells.fit(solved.rate.by_speed)
    off_speed = 0.5 * eps * irregularity + own.speed
    for k, (name, excess) in enumerate((("angle_speed_max", high), ("angle_speed_min", low))):
        omega, cell, t, design = solved.reference * excess, extremes.cell[:, k], extremes.t[:, k], np.arange(speed.size)
        values[name], error = batch.places(cycle, 0.5 * omega**2, loose / excess, cell, t)
        half = moments.mesh.half[design, cell, 0]
        kept &= error < 2 * half
        rows = cycle.series[0, :, cell, design] - 0.5 * omega[:, None] ** 2 * cycle.series[1, :, cell, design]
        off = np.abs(cells.value(by_speed[design, cell], t)) * omega * off_speed
        by_torque = np.minimum(off * half / np.maximum(np.abs(cells.slope(rows, t)), 1e-300), 2.0 * half)
        angle_error = np.maximum(angle_error, error + np.where(np.abs(t) < 1.0, by_torque, 0.0))
    errors["angle_speed_max"] = errors["angle_speed_min"] = angle_error
    return values, errors, missed, kept


def _add_power(
    moments: DesignMoments,
    solved: Periodic,
    cycle: batch.Cycles,
    values: dict[str, Array],
    errors: dict[str, Array],
    givens: DesignValues,
    off_speed: Array,
) -> None:
    """Adds the drive's power at the mean of the extreme speeds, with its error."""
    exchanged, law = np.maximum(cycle.exchanged, 1e-300), moments.machine.scene.drive and moments.machine.scene.drive.law
    if law is None or isinstance(law, float | int):
        torque: Any = solved.state.unknown if law is None else givens.torque
        work = torque * np.asarray(givens.drive) * givens.span
        error = (errors["balance"] * np.abs(work) + cycle.net) if law is None else _READING_ERROR * np.abs(work)
    else:
        drive, by_speed = moments.driven(solved.omega, solved.state.unknown)
        work, moved = moments.total(drive), np.abs(by_speed) * solved.omega * off_speed[:, None, None]
        tails = cells.tails(cells.fit(drive)) + moved.max(axis=-1)
        error = (TAIL_OF_INTEGRAL * tails * moments.mesh.half[..., 0]).sum(axis=-1) + cycle.net + moments.total(moved)
    work = np.where(np.abs(work) <= cycle.net, 0.0, work)
    size = np.abs(work)
    values["power"] = work * solved.speed / givens.span
    errors["power"] = error / np.where(size > error, size, np.maximum(size, exchanged)) + errors["speed"] + _READING_ERROR
