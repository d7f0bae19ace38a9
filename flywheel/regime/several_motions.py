"""Steady periodic motions of several machines at once, or of one machine with several flywheels.

The equations are those of `regime.cycle_equations` with an axis of motions before all others. Each motion has cells of its
own, which end where meshes change the side that drives: the motion gives these angles, so that cutting and solving
alternate, for all motions with as many of them in each cell together.

Flywheels of one machine are solved twice. All begin with the motion of a heavier one, at its energies; then each begins
with that of its neighbour, on cells cut by its own. A motion that is the same both times lies on the branch of its
neighbour. The others are left to a search for each alone, from its neighbour (`regime.branch`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.machine.equation import Moments, Rate, moments_on
from flywheel.machine.machine import Machine, circuit_of
from flywheel.numerics import cells
from flywheel.numerics.cells import ROUNDING, Array, Index
from flywheel.regime.cycle_equations import (
    CLOSE,
    Demand,
    Periodic,
    Sensitivity,
    SpeedExtremes,
    State,
    carried,
    periodic_motions,
    with_inertia,
)
from flywheel.regime.periodic_motion import (
    UNSTABLE,
    MotionErrors,
    OwnMotion,
    errors_by_stiffness,
    motion_errors,
    own_motion_again,
)
from flywheel.regime.turning_moment import Run, cycle_of, work_error

CUT_MOVE = 1e-12
"""Of the cycle: ends of cells that move less have settled."""

MOST_CUTS = 10
"""Rounds in which cells are cut anew where meshes change the side that drives."""

_NO_INERTIA = 1e-6  # of the greatest: a least inertia beside which the machine is as good as weightless
_SAME_SPEED, _SAME_IRREGULARITY = 1e-3, 1e-2  # differences of one motion on cells that are cut and on others, relative


class SeveralMoments(Moments):
    """One machine on the cells of several motions, as `Moments` with an axis of motions before all others.

    Args:
        machine: the machine.
        edges: of the cells (motions, cells + 1), rad.
        local: as that of `Moments`.

    """

    def __init__(self, machine: Machine, edges: Array, *, local: bool = False) -> None:
        super().__init__(machine, cells.cells(edges), local=local)

    @property
    def own_edges(self) -> Array:
        """The edges (rad) of each machine's own cells, (motions, cells + 1)."""
        return np.repeat(self.machine.mesh[None], len(self.mesh.edges), axis=0)

    def of(self, which: Index) -> Any:
        """The machines of some motions."""
        return SeveralMoments(self.machine, self.mesh.edges[which], local=self.local)

    def cut(self, which: Index, angles: Array) -> Any:
        """The machines of some motions on cells with further ends at angles (rad), (motions, cuts)."""
        return SeveralMoments(self.machine, np.sort(np.concatenate((self.mesh.edges[which], angles), axis=1), axis=1))

    def rate(self, omega: Array, unknown: Any, inertia: Any, states: Any = ()) -> Rate:
        """F at crank speeds omega (rad/s), for values of the unknown and flywheels (motions,); see `Moments.rate`."""
        return super().rate(omega, np.asarray(unknown)[..., None, None], np.asarray(inertia)[..., None, None])

    def total(self, values: Array) -> Array:
        """The integral over the cycle of values at the nodes."""
        return cells.total(values, self.mesh.half)


# -- cells that end where a mesh changes the side that drives ------------------------------------------------------------


Deciding = tuple[Array, float]
"""Values at the nodes at whose sign changes cells end, and the share of a torque that a mesh loses by passing it the wrong
way: 0 for a law, which leaves no slack."""


class CutMotions(NamedTuple):
    """Some of several motions on cells that end where meshes change the side that drives.

    `which` of the motions they are; `moved` how far (rad) the ends of cells still move; `success` a mask of those found.
    """

    which: Index
    moments: Any
    solved: Periodic
    demand: Demand
    moved: Array
    success: NDArray[np.bool_]


def on_cut_cells(
    moments: Any,
    solved: Periodic,
    near: NDArray[np.bool_],
    demand: Demand,
    first: Periodic | None = None,
    within: float = 0.0,
) -> Iterator[CutMotions]:
    """Motions on cells that end where meshes change the side that drives, all with as many of these in each cell at once.

    Args:
        moments: the machines on cells without these ends.
        solved: the motions there.
        near: which of these were found.
        demand: requirements of the motions.
        first: motions to begin with, if others than these.
        within: as that of `periodic_motions`.

    """
    first = solved if first is None else first
    for which, cuts in patterns(moments, near, *decided(moments, solved)):
        part = Demand(*(None if each is None else each[which] for each in demand))
        if not cuts.size and first is solved:  # nothing changes within a cell: these are their motions
            own = moments.of(which)
            yield CutMotions(which, own, _some(solved, which, own), part, np.zeros(which.size), near[which])
            continue
        finer, reference = moments.cut(which, cuts), np.asarray(first.reference)[which]
        nearest = first._replace(moments=moments.of(which), state=State(*(each[which] for each in first.state)))
        state = carried(nearest, finer)
        for k in range(MOST_CUTS):
            again, good = periodic_motions(finer, reference, part, state, within)
            state, reference = again.state, np.asarray(again.reference)
            angles, moved, slack = moved_cuts(finer, cuts, *decided(finer, again))
            stands = good & (moved <= slack)
            if (stands | ~np.isfinite(moved)).all():
                break
            if k + 1 < MOST_CUTS:
                cuts, finer = angles, moments.cut(which, angles)
        yield CutMotions(which, finer, again, part, moved, stands)


def _some(solved: Any, which: Index, moments: Any) -> Periodic:
    """Rows of several motions, with their machines."""
    sensitivity = solved.sensitivity
    some: Periodic = solved._replace(
        moments=moments,
        reference=np.asarray(solved.reference)[which],
        state=State(*(each[which] for each in solved.state)),
        extremes=SpeedExtremes(*(each[which] for each in solved.extremes)),
        rate=_rate_of(solved.rate, which),
        omega=solved.omega[which],
        multiplier=solved.multiplier[which],
        damping=solved.damping[which],
        left=solved.left[which],
        sensitivity=None if sensitivity is None else Sensitivity(*(each[which] for each in sensitivity)),
    )
    return some


def _rate_of(rate: Rate, which: Any) -> Rate:
    """The rate of one of several motions, or of some."""
    moment, by_speed, by_unknown, by_inertia, exchanged, *transmitted = (
        each[which] for each in (*rate[:4], rate.exchanged, *rate.transmitted)
    )
    return Rate(moment, by_speed, by_unknown, by_inertia, rate.by_states[:, which], exchanged, tuple(transmitted))


def decided(moments: Any, solved: Periodic) -> tuple[list[Deciding], Array]:
    """The values whose signs decide how cells are cut along motions, and the work exchanged in a cycle (J).

    They are the torques through meshes with losses (N m), and the values by which laws switch at speeds.
    """
    deciding = through_meshes(moments, solved.rate.transmitted)
    if moments.machine.switches_at_speeds:
        deciding += [(values, 0.0) for values in moments.switches(solved.omega)]
    return deciding, moments.total(solved.rate.exchanged)


def through_meshes(moments: Any, torques: Sequence[Array]) -> list[Deciding]:
    """Torques through meshes with losses (N m), with what a mesh loses of one that it passes the wrong way."""
    spreads = [1.0 / stage.efficiency - stage.efficiency for stage in moments.machine.stages if stage.efficiency < 1.0]
    return list(zip(torques, spreads, strict=True))


def _reversals(moments: Any, deciding: Sequence[Deciding], exchanged: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Angles (rad) where meshes change the side that drives, their errors, and where two cancel.

    (motions, reversals), ascending, filled up with NaN; see `periodic_motion`, which finds those of one motion.
    """
    mesh, count = moments.mesh, exchanged.size
    edges, cycle = moments.own_edges, float(mesh.edges[0, -1])
    every: list[tuple[Index, Array, Array]] = [(np.zeros(0, np.intp), np.zeros(0), np.zeros(0))]  # if nothing decides
    fleeting = np.zeros(count, bool)
    for values, spread in deciding:
        noise = 1e-13 * np.abs(values).max(axis=(-2, -1))
        crossings = cells.crossings(cells.fit(values), np.broadcast_to(noise[:, None], values.shape[:2]))
        half = mesh.half[crossings.function, crossings.cell, 0]
        inside = mesh.middle[crossings.function, crossings.cell, 0] + half * crossings.t
        angle = np.where(crossings.t == 1.0, mesh.edges[crossings.function, crossings.cell + 1], inside)
        slope = np.maximum(spread * np.abs(crossings.slope) / half, 1e-300)
        width = np.sqrt(2.0 * ROUNDING * exchanged[crossings.function] / slope) if spread else np.zeros(slope.shape)
        apart = np.abs(edges[crossings.function] - angle[:, None]).min(axis=1) > 1e-9 * cycle
        motion, angle, width = crossings.function[apart], angle[apart], width[apart]
        close = (np.diff(motion) == 0) & (np.diff(angle) < np.minimum(width[1:], width[:-1]))
        fleeting[motion[1:][close]] = True
        every.append((motion, angle, width))
    motion, angle, width = (np.concatenate(rows) for rows in zip(*every, strict=True))
    order = np.lexsort((angle, motion))
    motion, angle, width = motion[order], angle[order], width[order]
    first = motion.searchsorted(np.arange(count + 1))
    angles = np.full((count, int(np.diff(first).max(initial=0))), np.nan)
    widths = angles.copy()
    place = np.arange(motion.size) - first[motion]
    angles[motion, place], widths[motion, place] = angle, width
    return angles, widths, fleeting


def patterns(
    moments: Any, good: NDArray[np.bool_], deciding: Sequence[Deciding], exchanged: Array
) -> Iterator[tuple[Index, Array]]:
    """Motions with as many reversals in each cell, and their angles (rad)."""
    angles, _, fleeting = _reversals(moments, deciding, exchanged)
    ends = moments.mesh.edges[:, None, :]
    counts = np.diff((angles[:, :, None] < ends).sum(axis=1), axis=1)
    some = np.flatnonzero(good & ~fleeting)
    if some.size:
        patterns, group = np.unique(counts[some], axis=0, return_inverse=True)
        for k, pattern in enumerate(patterns):
            which = some[group.ravel() == k]
            yield which, angles[which, : int(pattern.sum())]


def moved_cuts(moments: Any, cuts: Array, deciding: Sequence[Deciding], exchanged: Array) -> tuple[Array, Array, Array]:
    """New ends of cells (rad), their distance from the present ones, infinite elsewhere, and which may be moved."""
    angles, widths, fleeting = _reversals(moments, deciding, exchanged)
    same = (np.isfinite(angles).sum(axis=1) == cuts.shape[1]) & ~fleeting
    if not cuts.shape[1] or angles.shape[1] < cuts.shape[1]:
        return cuts, np.where(same, 0.0, np.inf), np.zeros(exchanged.shape)
    angles, widths = angles[:, : cuts.shape[1]], widths[:, : cuts.shape[1]]
    moved, allowed = np.abs(angles - cuts), np.maximum(widths, CUT_MOVE * moments.mesh.edges[0, -1])
    worst = np.where(same, moved.max(axis=1), np.inf)
    return np.where(same[:, None], angles, cuts), worst, np.where((moved <= allowed).all(axis=1), np.inf, 0.0)


# -- one machine with several flywheels -----------------------------------------------------------------------------------


class LighterMotions(NamedTuple):
    """Motions of one machine with several flywheels, with their errors; `irregularity_error` is relative."""

    solved: Periodic
    errors: MotionErrors
    irregularity_error: Array

    def of(self, row: int) -> Periodic:
        """One of the motions by itself."""
        solved: Any = self.solved
        state = solved.state
        return Periodic(
            moments=moments_on(solved.moments.machine, solved.moments.mesh.edges[row]),
            reference=float(solved.reference[row]),
            state=State(state.nodes[row], state.edges[row], float(state.inertia[row]), float(state.unknown[row])),
            extremes=SpeedExtremes(*(each[row] for each in solved.extremes)),
            rate=_rate_of(solved.rate, row),
            omega=solved.omega[row],
            multiplier=float(solved.multiplier[row]),
            damping=float(solved.damping[row]),
            steps=solved.steps,
            left=float(solved.left[row]),
        )

    def again(self, row: int, mean: float | None, rtol: float) -> OwnMotion:
        """The same, as it is searched for alone; arguments as those of `lighter_motions`."""
        solved = self.of(row)
        return own_motion_again(solved.moments.machine, solved, Demand(solved.state.inertia, None, mean), rtol)

    def runs(self) -> Run:
        """The runs of the motions, each number an array."""
        solved, extremes = self.solved, self.solved.extremes
        fast, slow = (solved.reference * (1.0 + extremes.excess[:, k]) for k in (0, 1))
        figures: list[Any] = [solved.state.inertia, solved.irregularity, fast, slow, 0.0, 0.0, 0.0, self.irregularity_error]
        return Run(*figures)._replace(speed=solved.speed, level=self.errors.level)


def lighter_motions(
    machine: Machine, heavier: OwnMotion, inertias: Array, mean: float | None, rtol: float
) -> list[tuple[LighterMotions, list[int]]]:
    """The stable motions with lighter and lighter flywheels, down to the first that is not the continuation of the last.

    Args:
        machine: one whose motor follows the speed at once; there are none of others.
        heavier: the motion with a heavier flywheel.
        inertias: of the flywheels (kg m² on the crank), descending.
        mean: mean of extremes (rad/s) that a balance holds; None if the machine sets its own speed.
        rtol: relative error allowed in the irregularity.

    Returns:
        The motions, those on cells alike together, with the places of their flywheels among those given, -1 for those
        that do not count.

    """
    if circuit_of(machine.scene) is not None:
        return []
    moments = SeveralMoments(machine, np.repeat(machine.mesh[None], inertias.size, axis=0))
    alone, last = carried(heavier.solved, moments_on(machine, machine.mesh)), heavier.solved.reference
    first = State(*(np.repeat(np.asarray(each)[None], inertias.size, axis=0) for each in alone))
    references, demand = np.full(inertias.size, last), Demand(inertias, None, mean and np.full(inertias.size, mean))
    start = with_inertia(first, moments, references, inertias)
    solved, near = periodic_motions(moments.locally, references, demand, start, CLOSE)
    rows = (np.concatenate((one[:1], other[:-1])) for one, other in zip(first, solved.state, strict=True))
    reference: Any = np.append(last, np.asarray(solved.reference)[:-1])
    neighbours = solved._replace(reference=reference, state=with_inertia(State(*rows), moments, reference, inertias))
    if moments.lossy or machine.switches_at_speeds:
        cut = [*on_cut_cells(moments, solved, near, demand, neighbours, CLOSE)]
    else:
        again, good = periodic_motions(moments, reference, demand, neighbours.state, CLOSE)
        cut = [CutMotions(np.arange(inertias.size), moments, again, demand, np.zeros(inertias.size), good)]
    motions, good = list[LighterMotions](), np.zeros(inertias.size, bool)
    for some in cut:
        cycle = cycle_of(some.moments, some.solved.rate, None)
        errors = motion_errors(some.solved, some.demand, cycle.errors, some.solved.state.inertia + cycle.inertia_at_start)
        error = errors.irregularity + errors_by_stiffness(some.solved)[0]
        motions.append(LighterMotions(some.solved, errors, error))
        missed = np.maximum(error, work_error(cycle))
        before = solved.irregularity[some.which], solved.speed[some.which]
        same = np.abs(some.solved.irregularity / before[0] - 1.0) <= _SAME_IRREGULARITY
        same &= np.abs(some.solved.speed / before[1] - 1.0) <= _SAME_SPEED
        heavy = some.solved.lightest > _NO_INERTIA * some.moments.inertia.max(axis=(-2, -1))
        good[some.which] = some.success & same & heavy & sound(some.solved, error, 0.5 * rtol) & (missed <= 0.5 * rtol)
    count = inertias.size if good.all() else int(good.argmin())
    places = (np.where(some.which < count, some.which, -1).tolist() for some in cut)
    return [*zip(motions, places, strict=True)]


def sound(solved: Periodic, error: Array, most: float) -> NDArray[np.bool_]:
    """Tests whether motions keep turning, are stable where they set their own speed, and err by `most` in irregularity."""
    eps = solved.irregularity
    good = (solved.lightest > 0.0) & (error <= most) & (solved.extremes.excess[:, 1] > -1.0)
    good &= (eps > 0.0) & (eps * (1.0 + error) < 2.0)
    return np.asarray(good if solved.moments.machine.scene.unknown is not None else good & (solved.damping >= -UNSTABLE))
