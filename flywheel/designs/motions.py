"""The steady motions of many designs of one structure at once, where torques depend on speed.

Every design has the constant speed at which its net work is zero, its figures there, and its motion by Newton's method on
the equations of `regime.cycle_equations` with an axis of designs; errors are those of `regime.periodic_motion`. Whatever is
no plain case is left to be sized alone: no such speed or several that are near, a motion that does not settle, is unstable,
stops, needs no flywheel, or has torques so steep that cells would have to follow them.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flywheel.designs import batch
from flywheel.machine.equation import Moments, Rate
from flywheel.machine.programs import DesignValues, Structure
from flywheel.numerics import cells
from flywheel.numerics.cells import NODES, ROUNDING, TAIL_OF_INTEGRAL, Array, Cells, Index
from flywheel.regime import constant_speed
from flywheel.regime.cycle_equations import Demand, Periodic, State, balanced_guess, first_guess, periodic_motions
from flywheel.regime.periodic_motion import STIFF, UNSTABLE, errors_by_stiffness, motion_errors
from flywheel.regime.turning_moment import CycleErrors

Figures = tuple[dict[str, Array], dict[str, Array], Array]

_SPREAD = 2.0  # by which what closes a cycle at its own speed spreads errors of the moment, at most; as in `cycle_of`
_READING_ERROR = 4 * ROUNDING  # of a figure that is the scene's own
_SPEED_STEPS = 40  # of Newton's method towards a constant speed, within its bracket
_LIGHT = 1e-3  # of the machine's own inertia: the least start of the iteration for a flywheel
_FADING = 2.0  # exponent in a cycle from which a motion may be near the speeds at which torques balance
_NO_INERTIA = 1e-6  # of the greatest: a least inertia beside which the machine is as good as weightless
_MOST_ERROR, _HARDLY = 0.5, 0.1  # of an irregularity, and of J + I*: beyond these a motion is refused or open


class DesignMoments(Moments):
    """The machines of designs on cells of their own, as `Moments` with an axis of designs before all others.

    Args:
        structure: that the designs share.
        columns: their numbers (paths, designs), SI.
        edges: of their cells (cells + 1, designs), rad.
        halvings: how often the structure's cells have been halved.

    """

    def __init__(self, structure: Structure, columns: Array, edges: Array, halvings: int) -> None:
        self.machine, self.local, self.lossy, self.circuit, self.swings = structure.twin, False, False, None, False
        self.drive_ratio, ends = 1.0, edges.T
        half = 0.5 * (ends[:, 1:, None] - ends[:, :-1, None])
        middle = ends[:, :-1, None] + half
        self.mesh = Cells(ends, middle, half, middle + half * NODES)
        given = columns[:, :, None, None]
        rows = np.empty((6, *self.mesh.phi.shape))
        for piece, program in structure.programs:
            part = slice(piece.start << halvings, piece.stop << halvings)
            for row, value in zip(rows, program.function()(self.mesh.phi[:, part], *given), strict=True):
                row[:, part] = value
        self.inertia, self.slope, self.still, self.per_unknown, _, self.steepness = rows
        self._groups: list[tuple[Any, Any, list[Any]]] = []
        for piece, program in structure.rates:
            early, late = program.split(2)
            part = slice(piece.start << halvings, piece.stop << halvings)
            self._groups.append((part, late.function(), list(early.function()(self.mesh.phi[:, part], *given))))
        self.resistance = self._evaluated(np.zeros_like(half), 0.0)[7]

    def of(self, which: Index) -> DesignMoments:
        """Those of some designs."""
        found, count = copy(self), self.inertia.shape[0]
        found.mesh = Cells(*(each[which] for each in self.mesh))
        for name in ("inertia", "slope", "steepness", "still", "per_unknown", "resistance"):
            setattr(found, name, getattr(self, name)[which])
        found._groups = [
            (part, late, [row[which] if np.ndim(row) and len(row) == count else row for row in rows])
            for part, late, rows in self._groups
        ]
        return found

    def _evaluated(self, omega: Array, unknown: Any, outputs: slice = slice(None)) -> Array:
        """The values of `programs.RATE` at crank speeds on (designs, cells or 1, nodes or 1)."""
        found: Array | None = None
        for part, late, rows in self._groups:
            values = late(*rows, omega[:, part] if omega.shape[1] > 1 else omega, unknown)[outputs]
            if found is None:
                found = np.empty((len(values), *self.mesh.phi.shape))
            for row, value in zip(found, values, strict=True):
                row[:, part] = value
        assert found is not None
        return found

    def rate(self, omega: Array, unknown: Any, inertia: Any, states: Any = ()) -> Rate:
        """F at crank speeds omega (rad/s), for values of the unknown (designs,); see `Moments.rate`."""
        balance = np.asarray(unknown)[..., None, None]
        moment, by_speed, by_unknown, exchanged = self._evaluated(omega, balance, slice(4))
        nothing = np.zeros((0, *omega.shape))
        return Rate(moment, by_speed, by_unknown, np.zeros(()), nothing, exchanged)

    def driven(self, omega: Array, unknown: Any) -> tuple[Array, Array]:
        """The drive's share of F (N m on the crank), and its slope by the speed."""
        drive, by_speed = self._evaluated(omega, np.asarray(unknown)[..., None, None], slice(4, 6))
        return drive, by_speed

    def net_works(self, speeds: Array) -> Array:
        """Net works (J) of a cycle run at constant crank speeds (speeds, designs), without an unknown."""
        half = self.mesh.half[..., 0]
        still, resistance = (cells.integral(row, self.mesh.half).sum(axis=-1) for row in (self.still, self.resistance))
        found = still - resistance * speeds
        for part, late, rows in self._groups:
            width, own = 2.0 * half[:, part].sum(axis=-1), self.mesh.half[:, part]
            for k, speed in enumerate(speeds):
                moving = np.asarray(late(*rows, speed[:, None, None], 0.0)[6], dtype=float)
                if moving.shape[-2:] in ((), (1, 1)):
                    found[k] += width * (moving[:, 0, 0] if moving.ndim else moving)
                else:
                    shape = np.broadcast_shapes(moving.shape, self.mesh.phi[:, part].shape)
                    found[k] += cells.integral(np.broadcast_to(moving, shape), own).sum(axis=-1)
        return np.asarray(found)

    def total(self, values: Array) -> Array:
        """The integral over the cycle of values at the nodes."""
        return np.asarray(cells.integral(values, self.mesh.half).sum(axis=-1))


def operating_points(moments: DesignMoments, numbers: Array, asked: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Constant crank speeds (rad/s) at which the net work is zero, the unknowns there, and which of them are certain.

    Where there is a balance the speed is the one asked for. Else it is the greatest stable one of those that
    `constant_speed.steady_speeds` would find; where a hump of the net work might reach zero between two speeds tried,
    nothing is certain.

    Args:
        moments: the machines.
        numbers: typical speeds, then those that a motor is known by (rows, designs), rad/s.
        asked: the scene's speed, NaN without one.

    """
    shape = moments.mesh.phi.shape
    if moments.machine.scene.unknown is not None:
        rate = moments.rate(np.broadcast_to(asked[:, None, None], shape), 0.0, 0.0)
        net, by_unknown, size = (moments.total(row) for row in (rate.moment, rate.by_unknown, np.abs(rate.by_unknown)))
        return asked, -net / by_unknown, np.abs(by_unknown) > 1e-9 * size
    tried = constant_speed.speeds_to_try(numbers[0], numbers[1:])
    works = moments.net_works(tried)
    before, after = works[:-1], works[1:]
    stable = (before > 0.0) & (after <= 0.0)
    good = stable.any(axis=0) & np.isfinite(works).all(axis=0) & ~constant_speed.humped(works)[1].any(axis=0)
    row, design = stable.shape[0] - 1 - stable[::-1].argmax(axis=0), np.arange(shape[0])
    low, high = tried[row, design], tried[row + 1, design]
    speed = low + (high - low) * before[row, design] / np.where(good, before[row, design] - after[row, design], 1.0)
    for _ in range(_SPEED_STEPS):
        rate = moments.rate(speed[:, None, None] + np.zeros(shape), 0.0, 0.0)
        net, slope = moments.total(rate.moment), moments.total(rate.by_speed)
        low, high = np.where(net >= 0.0, speed, low), np.where(net <= 0.0, speed, high)
        closer = speed - net / np.where(slope < 0.0, slope, -1e-300)
        closer = np.where((closer >= low) & (closer <= high), closer, 0.5 * (low + high))
        speed, moved = closer, np.abs(closer - speed)
        if (~good | (moved <= 4 * ROUNDING * speed)).all():
            break
    return speed, np.zeros_like(speed), good


def figures(structure: Structure, columns: Array, edges: Array, givens: DesignValues, halvings: int) -> Figures:
    """Figures of designs by their names, their errors, and the one that halving cells is to bring within rtol.

    That is infinite for a design that is to be sized alone.
    """
    moments = DesignMoments(structure, columns, edges, halvings)
    speed, unknown, good = operating_points(moments, structure.speeds(columns), givens.speed)
    balanced, eps = givens.unknown, givens.irregularity
    given = None if givens.inertia is None else givens.inertia * givens.ratio**2
    rate = moments.rate(speed[:, None, None] + np.zeros(moments.mesh.phi.shape), unknown, 0.0)
    cycle = _cycle(moments, rate)
    loose: Any = 0.0
    if not balanced:  # the last digits of a speed that the machine takes by itself shift a stiff torque all over the cycle
        shifted = 4 * ROUNDING * speed * moments.total(np.abs(rate.by_speed))
        cycle = cycle._replace(work=cycle.work + shifted)
        loose = 2 * cycle.work / np.maximum(np.abs(moments.total(rate.by_speed)) * speed, 1e-300)
    at_speed = givens._replace(
        speed=speed, drive=None, unknown=False, irregularity=0.0 * speed if given is not None else eps
    )
    square, none = speed**2, np.zeros(speed.shape)
    share = np.stack([(1 + sign * at_speed.irregularity / 2) ** 2 for sign in (1, -1, 0)])
    sums = batch.summed(cycle, -0.5 * square * share, at_speed, balance=none, by_unknown=none)
    values, errors, missed = (batch.figures if given is None else batch.of_cycle)(sums, at_speed)
    for name in ("approximate", "approximate_total", "inertia_torque", "inertia_torque_flywheel") if given is None else ():
        errors[name] = errors[name] + loose
    residue = 2 * np.abs(sums.net) / np.maximum(sums.exchanged, 1e-300)
    for name in ("energy_fluctuation", "accumulated_max", "accumulated_min"):
        errors[name] = errors[name] + residue
    good &= np.isfinite(missed) & (sums.extent[1] > sums.inertia)

    # the motion: with the flywheel that is given or sought, or with none where none is found
    least = _LIGHT * np.maximum(sums.extent[1], (sums.greatest[batch.WORK] - sums.least[batch.WORK]) / square)
    if given is None:
        total = (sums.greatest[batch.FAST] - sums.least[batch.SLOW]) / (eps * square)
        guess, ways = np.maximum(total - sums.start, least), [False, True]
    else:
        good &= given + sums.extent[0] > sums.extent[2]
        guess, ways = given, [False]

    def fading(some: Index, inertia: Array) -> Array:
        """The exponent by which torques fade a change of the constant speed in a cycle."""
        total = (inertia[some, None, None] + moments.inertia[some]) * speed[some, None, None]
        return np.asarray(cells.integral(-rate.by_speed[some] / total, moments.mesh.half[some]).sum(axis=-1))

    left, worst = np.flatnonzero(good), np.full(speed.shape, np.inf)
    for alone, start in [(way, start) for way in ways for start in (first_guess, balanced_guess)]:
        if alone:
            left = left[(sums.extent[0] > _NO_INERTIA * sums.extent[1])[left]]
        tried = left
        if start is balanced_guess:
            tried = left[fading(left, none if alone else guess) > _FADING]
        if not tried.size:
            continue
        asked = None if given is None and not alone else (none if given is None else given)[tried]
        own, of_motion, missing, found = _motions(
            moments.of(tried),
            givens.of(tried),
            speed[tried],
            unknown[tried],
            (none if alone else guess)[tried],
            asked,
            start,
        )
        if not found.any():
            continue
        if alone:
            found &= own["irregularity"] * (1.0 + of_motion["irregularity"]) <= eps[tried]
            own |= {"exact": none[tried], "needed": none[tried]}
            of_motion["exact"] = of_motion.pop("irregularity")
            del own["irregularity"]
        elif given is None:
            own |= {
                "exact": own["exact"] / np.broadcast_to(givens.ratio, speed.shape)[tried] ** 2,
                "needed": none[tried] + 1.0,
            }
        for into, of_some in ((values, own), (errors, of_motion)):
            for name, row in of_some.items():
                into.setdefault(name, none + np.nan)[tried[found]] = row[found]
        worst[tried[found]], left = missing[found], np.setdiff1d(left, tried[found], assume_unique=True)
    return values, errors, np.where(good, np.maximum(missed, worst), np.inf)


def _cycle(moments: DesignMoments, rate: Rate) -> batch.Cycles:
    """The cycles in which F is as given at the nodes."""
    rows = rate.moment, moments.slope, moments.inertia, rate.exchanged, moments.steepness
    values = np.zeros((5, batch.POINTS.size, *moments.mesh.half.shape[1::-1]))
    for into, row in zip(values, rows, strict=True):
        into[1:-1] = row.transpose(2, 1, 0)
    return batch.assembled(np.ascontiguousarray(moments.mesh.edges.T), values, _SPREAD)


def _motions(
    moments: DesignMoments,
    givens: DesignValues,
    speed: Array,
    unknown: Array,
    guess: Array,
    inertia: Array | None,
    start: Callable[..., State | None],
) -> tuple[dict[str, Array], dict[str, Array], Array, NDArray[np.bool_]]:
    """The figures of motions with their errors, the one that cells are to bring within rtol, and which motions stand.

    Args:
        moments: the machines.
        givens: what is asked of them.
        speed: constant speeds (rad/s) from which the motions are found.
        unknown: the values of the scene's unknown there.
        guess: of the flywheels, kg m² on the crank.
        inertia: of those that are given; None where one is sought for the irregularity.
        start: the first guess of the motion.

    """
    demand = Demand(inertia, givens.irregularity if inertia is None else None, speed if givens.unknown else None)
    first = start(moments, speed, guess, unknown)
    if first is None:
        return {}, {}, np.full(speed.shape, np.inf), np.zeros(speed.shape, bool)
    solved, found = periodic_motions(moments, speed, demand, first)
    cycle, state, extremes, eps, speed = (
        _cycle(moments, solved.rate),
        solved.state,
        solved.extremes,
        solved.irregularity,
        solved.speed,
    )
    inertia, balanced = state.inertia, givens.unknown
    by_cell = cycle.by_cell.transpose(0, 2, 1)
    of_cycle: Any = (cycle.work, cycle.variation, cycle.inertias.max(axis=0), by_cell, cycle.inertias.T)
    own = motion_errors(solved, demand, CycleErrors(*of_cycle), inertia + cycle.inertia_at_start)
    by_stiffness, bound_by_stiffness = errors_by_stiffness(solved)
    irregularity, bound = own.irregularity + by_stiffness, own.flywheel + bound_by_stiffness
    total = inertia[:, None, None] + moments.inertia
    fading = np.abs(cells.integral(solved.rate.by_speed / (total * solved.omega), moments.mesh.half)).sum(axis=-1)
    kept = found & (total.min(axis=(-2, -1)) > 0.0) & (fading <= STIFF) & (irregularity <= _MOST_ERROR)
    kept &= (extremes.excess[:, 1] > -1.0) & (eps > 0.0) & (eps * (1.0 + irregularity) < 2.0)
    if not balanced:
        kept &= solved.damping >= -UNSTABLE
    values, errors = {"speed": speed}, {"speed": own.speed + _READING_ERROR + np.zeros_like(speed)}
    if balanced:
        errors["speed"] = _READING_ERROR + np.abs(speed / givens.speed - 1.0)
    exchanged = np.maximum(cycle.exchanged, 1e-300)
    missed = np.maximum(irregularity, cycle.work / exchanged)
    if demand.inertia is None:
        kept &= (inertia > 0.0) & (bound <= _HARDLY * (inertia + moments.inertia.max(axis=(-2, -1))))
        scale = np.maximum(inertia, np.ptp(cycle.start[0], axis=0) / (eps * speed**2))
        values["exact"], errors["exact"] = inertia, bound / scale
        missed = np.maximum(missed, errors["exact"])
    else:
        values["irregularity"], errors["irregularity"] = eps, irregularity
    if balanced:
        balance, size = state.unknown, np.abs(state.unknown * moments.total(solved.rate.by_unknown))
        of_balance = own.balance * cycle.work / np.where(size > 0.0, size, np.inf)
        values["balance"], errors["balance"] = (
            balance,
            np.where(balance != 0.0, of_balance + _READING_ERROR, cycle.work / exchanged),
        )
    if givens.drive is not None:
        _add_power(moments, solved, cycle, values, errors, givens, errors["speed"] + 0.5 * eps * irregularity)

    # where the speed is extreme
    angle_error: Array = np.zeros_like(speed)
    high, low = (1.0 + extremes.excess[:, k] for k in (0, 1))
    loose = 2 * irregularity * eps * 0.5 * (high + low)
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
        error = (errors["balance"] * np.abs(work) + cycle.work) if law is None else _READING_ERROR * np.abs(work)
    else:
        drive, by_speed = moments.driven(solved.omega, solved.state.unknown)
        work, moved = moments.total(drive), np.abs(by_speed) * solved.omega * off_speed[:, None, None]
        tails = cells.tails(cells.fit(drive)) + moved.max(axis=-1)
        error = (TAIL_OF_INTEGRAL * tails * moments.mesh.half[..., 0]).sum(axis=-1) + cycle.work + moments.total(moved)
    work = np.where(np.abs(work) <= cycle.work, 0.0, work)
    size = np.abs(work)
    values["power"] = work * solved.speed / givens.span
    errors["power"] = error / np.where(size > error, size, np.maximum(size, exchanged)) + errors["speed"] + _READING_ERROR
