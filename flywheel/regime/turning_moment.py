"""The balanced cycle on cells: M*, dI*/dphi and I* as series, their integrals, and the speed with a given inertia.

Everything here is quadrature of loads that depend on phi alone, with its errors; no time stepping. The speed
follows from the energy, in closed form, at the required mean of extremes; with it the period, and the errors of angles:
where the moment crosses zero, where the speed is extreme.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterable
from math import sqrt
from typing import Any, NamedTuple

import numpy as np

from flywheel.machine.equation import GREATEST_VALUE, Moments, NoMotionError, Rate, undefined
from flywheel.machine.machine import Machine
from flywheel.machine.programs import programs_of
from flywheel.numerics import cells
from flywheel.numerics.cells import NODES, ORDER, ROUNDING, Array, Cells, Coarse, Crossings, Index
from flywheel.numerics.faults import Fault, SceneError
from flywheel.scene.scene import Scene

MOMENT_ROUNDING = 4 * ROUNDING  # error of a reduced moment's integral relative to that of the sum of its parts' sizes
SHIFT = 3 * ROUNDING  # rad: a shift of all angles that has the effect of rounded geometry
BY_ANGLES = 1.5 * ROUNDING  # of an angle: 5.2 deviations of its rounding, which one in five million exceeds
INERTIA_ROUNDING = 24 * ROUNDING  # error of I* by its series relative to it
START_ROUNDING = 8 * ROUNDING  # and of one value of it
_BLOCK = 2_048  # cells evaluated together: the walk of the graph needs about forty arrays of their size
_EVEN_SHARE = 0.125  # of an error spread evenly over the cells: share that one cell may keep
_MOST_FOR_BALANCE = 2_000  # cells added to the machine's own mesh for the last digit of a balance
_MOST_FOR_PERIOD = 4_000  # cells for the time of a cycle, in addition to those of the cycle itself
_MOST_STEPS = 60  # of the search for an irregularity
_ONE_SIGN = 1e-12  # of the effect of a balance: if no more of it has the other sign, it has one
_CELL_END = 1.0 - 1e-12  # of a cell: roots beyond it lie at its end


class CycleErrors(NamedTuple):
    """Absolute errors estimated of a resolved cycle: of W (J), of the variation of I* and of I* itself (kg m²).

    `work` and `variation` hold for every difference of two values within the cycle, W - W(0) among them.

    Interpolation errors, each more than the truncation of its series, add up over the cells, but for what is left inside
    those of the two values. So does the effect of rounded lengths and angles of the scene, at most that of a shift of the
    crank by 3 units, which is one and the same all along the cycle. Two more add up by chance, so that together they are the
    root of the sum of their squares: the rounding of values, at most 4 units of the terms of their sums; and that of the
    rounding of each node's angle, itself a sum of independent shares, of 5.2 deviations. As I* is the same after a cycle,
    its error between two places is the opposite of that along the rest of the cycle, to within what the sum leaves: of the
    two, half of all errors at most.

    `start` is the error of I*(0), the value at the middle of the first cell less the integral of dI*/dphi up to there: that
    of one value, at 8 units of it, with rounded geometry and its rounded angle, and of the interpolation in that cell.

    `by_cell` has the share of each cell's interpolation in W and in the variation of I* (2, cells), `inside` the part of it
    that only places inside the cell have, not its ends, `left` (2) the most that two places have of that; `net` is the error
    of the net work (J), from which a balance follows; `inertias` that of I* itself in each cell. `parts` (7, cells + 1) are
    sums up to each edge: in twos, of W and of I*, of the errors by interpolation and rounded geometry, of those by rounded
    values and of the squares of those by rounded angles; and of the cells' shares of the balance, where these are known and
    of one sign.

    `turned` (J) is the effect of rounded directions of weights and of their paths on any difference of two values of W: each
    changes a force by one share all along the cycle, so that d g of `families.by_directions` does no work in it, and half of
    its integral's size between two places, at most c sqrt(cycle times the integral of I*)/2. Where a weight is all but
    square to its path, that exceeds the rounding of the small force.

    `residual` is the net work (J) of a cycle without a balance. It may belong anywhere in the cycle, from where it is an
    error of W, and so of every difference of two of its values. Of many cycles at once all are arrays.
    """

    work: float
    variation: float
    inertia: float
    by_cell: Array
    inside: Array
    left: Array
    net: float
    inertias: Array
    start: float
    residual: float = 0.0
    parts: Array | None = None
    turned: float = 0.0


class Cycle(NamedTuple):
    """One cycle of a balanced machine, as Chebyshev series on cells.

    `series` (3, cells, ORDER) holds M*, dI*/dphi and I*; `rising` (2, cells, ORDER + 1) the integrals of the first two from
    each cell's left end; `start` (2, cells + 1) their accumulated values at the edges: W and I* - I*(0).
    `net` is the work of M* over the cycle (J), `exchanged` the integral of the sum of |contributions| to M* (J). `noise`
    (2, cells) is the size below which M* and dI*/dphi are indistinguishable from zero. `balance_error` is the relative error
    of the balance itself.
    """

    mesh: Cells
    series: Array
    rising: Array
    start: Array
    inertia_at_start: float
    balance: float | None
    net: float
    exchanged: float
    noise: Array
    errors: CycleErrors
    balance_error: float = 0.0

    def at(self, cell: Index, t: Array) -> tuple[Array, Array]:
        """W (J) and I* - I*(0) (kg m²) at local abscissas of cells."""
        local = (self.rising[:, cell] * cells.basis(t)).sum(axis=-1)
        work, variation = self.start[:, cell] + local
        return work, variation

    def at_nodes(self) -> tuple[Array, Array]:
        """The same at the nodes of its cells."""
        work, variation = self.start[:, :-1, None] + self.rising @ cells.AT_NODES
        return work, variation


def resolve(machine: Machine, edges: Array) -> Cycle:
    """The cycle on cells between given edges: one walk of the graph at all nodes (block by block), then the balance.

    The unknown u of a balance follows from the cycle's net work, N0 + u N1 = 0. Without one the remaining net work (J) is
    one of the cycle's errors, if it exceeds the others.

    Raises SceneError where a load has no finite value, or a balance no effect.
    """
    check_cycle(machine.scene)
    mesh = cells.cells(edges)
    values = np.empty((7, *mesh.phi.shape))
    for first in range(0, len(mesh.phi), _BLOCK):
        block = slice(first, first + _BLOCK)
        own = programs_of(machine).cells(mesh.phi[block], mesh.anchor[block])
        rows = own.moment, own.slope, own.inertia, own.exchanged, own.steepness, own.per_unknown, abs(own.per_unknown)
        for place, row in zip(values, rows, strict=True):
            place[block] = row
    if not -GREATEST_VALUE <= values.min() <= values.max() <= GREATEST_VALUE:
        raise SceneError([undefined(machine, mesh, np.abs(values).max(axis=0))])
    if machine.scene.unknown is None:
        cycle = assembled(mesh, values[:5], None, shares=np.zeros(len(mesh.phi)), by_directions=machine.by_directions)
        residual = abs(cycle.net) if abs(cycle.net) > cycle.errors.work else 0.0
        return cycle._replace(errors=cycle.errors._replace(residual=residual))
    of_cells = cells.integral(values, mesh.half)
    net, _, _, exchanged, _, effect, of_sizes = of_cells.sum(axis=-1).tolist()
    if abs(effect) <= 1e-9 * of_sizes or of_sizes == 0.0:
        raise SceneError([no_effect(machine)])
    balance = -net / effect + 0.0  # never -0
    values[0] += balance * values[5]
    values[3] += abs(balance) * values[6]
    by_balance = abs(balance) * of_sizes
    spread = spread_of(effect, of_sizes, by_balance / max(exchanged + by_balance, 1e-300))
    shares = of_cells[5] / effect if of_sizes <= (1.0 + _ONE_SIGN) * abs(effect) else None
    turned = machine.by_directions
    return assembled(mesh, values[:5], balance, by_unknown=effect, spread=spread, shares=shares, by_directions=turned)


def spread_of(effect: Any, of_sizes: Any, share: Any = 0.0) -> tuple[Any, Any]:
    """Factors by which a balance spreads errors of the moment over differences of W.

    u = -N0/N1 takes the share s = (integral of dM*/du from a to b)/N1 of the net work's error from W(b) - W(a). Errors of
    integral E then leave (1 - s) of those between a and b, and s of the others: at most E max(|s|, |1 - s|), where |s| and
    |1 - s| are no more than (1 + V)/2, V the variation of the share over the cycle.

    Errors in proportion to the work exchanged are smaller, as the balance exchanges a share q of it: between a and b, the
    share r of all the work is at least p |s|, p = q/V, beyond them 1 - r at least p |1 - s|. By that |1 - s| r + |s| (1 - r)
    is at most (1 - p)(1 + V)/2 where s < 0 or s > 1, and otherwise max(s - p s (2s - 1)) = (1 + p)²/(8 p), or 1.

    Args:
        effect: N1, the integral of dM*/du over the cycle.
        of_sizes: that of |dM*/du|.
        share: q.

    Returns:
        The factors for errors that lie anywhere, and for those in proportion to the work exchanged.

    >>> [float(factor) for factor in spread_of(2.0, 2.0, 0.5)], float(spread_of(-1.0, 3.0)[0])
    ([1.0, 0.5625], 2.0)

    """
    variation = of_sizes / abs(effect)
    spread, p = 0.5 * (1.0 + variation), share / variation
    return spread, np.maximum(spread * (1.0 - p), np.minimum((1.0 + p) ** 2 / np.maximum(8.0 * p, 1e-300), 1.0))


def spread_of_closing(rate: Rate, mesh: Cells, *, balanced: bool, unknown: Any = 0.0) -> tuple[Any, Any]:
    """Factors by which a balance, or a speed that the torques set, spreads errors of the moment over differences of W.

    The first is for errors anywhere, the second for those in proportion to the work exchanged. For a balance see
    `spread_of`. A change of speed that closes the cycle changes energies by one sign all along it: where no torque rises
    with the speed, the shares s lie between 0 and 1, and both factors are 1; otherwise they are taken as 2.

    Args:
        rate: F of one motion, or of many.
        mesh: its cells.
        balanced: whether a balance closes the cycle.
        unknown: its value (SI), or those of many motions.

    """
    if not balanced:
        spread = np.where((rate.by_speed <= 0.0).all(axis=(-2, -1)), 1.0, 2.0)[()]
        return spread, spread
    effect, of_sizes, exchanged = (
        cells.integral(row, mesh.half).sum(axis=-1) for row in (rate.by_unknown, np.abs(rate.by_unknown), rate.exchanged)
    )
    effective = effect != 0.0
    own = np.abs(unknown) * of_sizes / np.maximum(exchanged, 1e-300)
    effect, of_sizes = np.where(effective, effect, 1.0), np.where(effective, of_sizes, 1.0)
    return spread_of(effect, of_sizes, own)


def assembled(
    mesh: Cells,
    values: Array,
    balance: float | None,
    *,
    by_unknown: float = 0.0,
    spread: tuple[float, float] = (1.0, 1.0),
    shares: Array | None = None,
    by_directions: float = 0.0,
) -> Cycle:
    """A cycle from its values at the nodes.

    Args:
        mesh: the cells.
        values: M* (balance included, N m), dI*/dphi, I* (kg m²), and the sums of |contributions| to M* and to dI*/dphi,
            shape (5, cells, nodes).
        balance: the unknown (SI), if there is one.
        by_unknown: the integral of dM*/du over the cycle, by which the error of the balance follows from that of the net
            work.
        spread: see `spread_of_closing`.
        shares: of the integral of dM*/du in each cell, if that has one sign; 0 without an unknown.
        by_directions: see `Machine.by_directions`.

    """
    series = cells.fit(values[:3])
    rising = cells.antiderivative(series[:2], mesh.half)
    start = cells.accumulated(rising)
    tails, of_whole = cells.truncation(series)
    by_cell = cells.TAIL_OF_INTEGRAL * tails[:2] * mesh.half[..., 0]
    inside = by_cell * (1.0 - of_whole[:2])
    peaks = np.abs(values[1:]).max(axis=-1)
    inertias = tails[2] + INERTIA_ROUNDING * peaks[1] + 2 * ROUNDING * mesh.edges[..., -1:] * peaks[0]
    # every angle is rounded by itself, nodes and breakpoints alike: what that shifts adds up as independent shares do
    rows = values[:2].reshape(*values[:2].shape[:-2], -1)
    swings = np.zeros_like(rows)  # to each node from the one before it
    np.subtract(rows[..., 1:], rows[..., :-1], out=swings[..., 1:])
    swings = swings.reshape(values[:2].shape)
    moved = BY_ANGLES * swings * mesh.phi
    squares = (moved * moved).sum(axis=-1)
    each = by_cell - inside + SHIFT * np.abs(swings).sum(axis=-1)
    rounded = MOMENT_ROUNDING * cells.integral(values[3:], mesh.half)
    parts = None
    if shares is not None:
        parts = np.zeros((7, mesh.edges.size))
        np.concatenate((each, rounded, squares, shares[None])).cumsum(axis=-1, out=parts[:, 1:])
    anywhere, by_chance, rounding = each.sum(axis=-1), squares.sum(axis=-1), rounded.sum(axis=-1)
    left_inside, gap = two_largest(inside), np.abs(start[1, ..., -1])
    net = cells.number(anywhere[0] + root_of_squares(rounding[0], by_chance[0]))
    of_work = root_of_squares(spread[1] * rounding[0], spread[0] ** 2 * by_chance[0])
    work = cells.number(spread[0] * (anywhere[0] + left_inside[0]) + of_work)
    of_variation = root_of_squares(0.5 * rounding[1], 0.5 * by_chance[1])
    variation = cells.number(0.5 * (anywhere[1] + gap) + left_inside[1] + of_variation)
    at_start = by_cell[1, ..., 0] + START_ROUNDING * peaks[1, ..., 0]
    at_start = at_start + (SHIFT + BY_ANGLES * mesh.edges[..., 1]) * peaks[3, ..., 0]
    to_middle = (series[1, ..., 0, :] @ cells.TO_MIDDLE) * mesh.half[..., 0, 0]
    by_cell[0] *= np.asarray(spread[0])[..., None]
    inside[0] *= np.asarray(spread[0])[..., None]
    left_inside[0] *= spread[0]
    noise = tails[:2] + 32 * ROUNDING * peaks[2:] + cells.by_rounded_angles(series[:2], mesh)
    turned: Any = 0.0
    if by_directions:
        turned = cells.number(0.5 * by_directions * np.sqrt(mesh.edges[..., -1] * np.abs(cells.total(values[2], mesh.half))))
        work = work + turned
        noise[0] += by_directions * np.sqrt(peaks[1])
    return Cycle(
        mesh=mesh,
        series=series,
        rising=rising,
        start=start,
        inertia_at_start=cells.number(values[2, ..., 0, cells.MIDDLE] - to_middle),
        balance=balance,
        net=cells.number(start[0, ..., -1]),
        exchanged=cells.number(rounding[0] / MOMENT_ROUNDING),
        noise=noise,
        errors=CycleErrors(
            work,
            variation,
            cells.number(inertias.max(axis=-1)),
            by_cell,
            inside,
            left_inside,
            net,
            inertias,
            cells.number(at_start),
            0.0,
            parts,
            turned,
        ),
        balance_error=net / abs(balance * by_unknown) if balance and by_unknown else 0.0,
    )


def root_of_squares(rounding: Any, squares: Any) -> Any:
    """The error by rounded values and by rounded angles, whose squares are given, by chance; see `CycleErrors`."""
    return np.sqrt(rounding * rounding + squares)


def two_largest(inside: Array) -> Array:
    """The greatest error that two places have by lying inside cells, by those of the cells (last axis)."""
    return np.asarray(np.sort(inside, axis=-1)[..., -2:].sum(axis=-1))


def work_error(cycle: Cycle) -> Any:
    """Error of a cycle's works, the net work among them, as a share of the work exchanged; of many cycles an array."""
    errors = cycle.errors
    return cells.number((np.maximum(errors.work, errors.net) + errors.residual) / np.maximum(cycle.exchanged, 1e-300))


def check_cycle(scene: Scene) -> None:
    """Refuses a scene without a steady cycle: one with a one-way stroke, or one that works stroke by stroke."""
    refuse_strokes(scene)
    if scene.stroke is not None:
        defect = "a one-way stroke, which has no cycle and so no flywheel"
        advice = "use flywheel reduce, flywheel.reduce or flywheel.simulate, or let a crank drive the mechanism"
        raise SceneError([Fault("stroke", defect, "a machine that turns in cycles", advice)])


def refuse_strokes(scene: Scene) -> None:
    """Refuses a machine that works stroke by stroke, where its clutch and brake would be ignored."""
    if scene.single_stroke is not None:
        defect = "a machine that works stroke by stroke, which has no steady cycle"
        advice = "use flywheel size or flywheel.single_stroke, or leave clutch, brake and [single_stroke] out"
        raise SceneError([Fault("single_stroke", defect, "a machine that runs on", advice)])


def no_effect(machine: Machine) -> Fault:
    """The fault of a balance that cannot balance anything."""
    unknown = machine.scene.unknown
    path = "drive.torque" if unknown == "drive" else f"parameters.{unknown}"
    defect, expected = '"balance" that does no net work over the cycle', "an unknown whose net work is not zero"
    return Fault(path, defect, expected, "let it act where the machine moves one way, or balance another quantity")


class Extent(NamedTuple):
    """Least and greatest I* without the flywheel, and the errors of the two, kg m²."""

    least: float
    greatest: float
    error: float
    greatest_error: float


def inertia_extent(cycle: Cycle, roots: Roots | None = None) -> Extent:
    """The extremes of I* by its own series: the integral of its slope would lose a small I* beside a large one.

    The error of each is that of its own cell, or of another cell that may exceed it. They are at ends of cells and at roots
    of dI*/dphi, which are among those given, or else are searched for.
    """
    roots = combined(cycle, np.array([[0.0, 1.0]]))[1] if roots is None else roots
    values = np.concatenate((cells.ends(cycle.series[2]).T.ravel(), roots.inertia))
    own, least, greatest = cycle.errors.inertias, values.min(), values.max()
    errors = np.concatenate((own, own, own.take(roots.crossings.cell)))
    of_least, of_greatest = (least - values + errors).max(), (values - greatest + errors).max()
    return Extent(float(least), float(greatest), float(of_least), float(of_greatest))


def weightless(machine: Machine, phi: float, total: float) -> Fault:
    """The fault of an inertia that is not above 0 at a position."""
    where = machine.where(phi)
    if machine.scene.stroke is None:
        path, name, advice = "flywheel.inertia", "I* + J", "add inertia"
        if not machine.scene.has_flywheel:
            path, name, advice = "inertia", "I*", 'give the bodies mass, or add [[inertia]] on = "crank"'
        return Fault(path, f"{name} = {total:g} kg m² at {where}", "a positive inertia everywhere", advice)
    name, unit = ("m*", "kg") if machine.scene.stroke.sliding else ("I*", "kg m²")
    return Fault(
        "inertia", f"{name} = {total:g} {unit} at {where}", "a positive one all along the stroke", "add [[inertia]]"
    )


def check_weighs(machine: Machine, cycle: Cycle, extent: Extent, inertia: float) -> None:
    """Refuses a machine that with its flywheel (kg m² on the crank) has no inertia at some angle.

    All its masses stand there, at a dead centre, and no finite torque determines the crank's speed beyond it.
    """
    if inertia + extent.least <= extent.error:
        fault = weightless(machine, float(combined(cycle, np.array([[0.0, 1.0]]))[0].angle_least[0]), 0.0)
        raise SceneError([fault._replace(defect=f"{fault.defect} (to within {extent.error:.1g} kg m²)")])


def coarse(cycle: Cycle, speed: float) -> Coarse:
    """A mask of the cells that keep the error of W - ½ speed² I* above a share of its present value.

    A cell whose interpolation error is at the level of rounding is left unchanged: halving cannot improve it.
    """

    def chosen(share: float) -> np.typing.NDArray[np.bool_]:
        shares = cycle.errors.by_cell[0] + 0.5 * speed**2 * cycle.errors.by_cell[1]
        floor = 8 * ROUNDING * ORDER * (np.abs(cycle.series[:2]).sum(axis=-1) * cycle.mesh.half[:, 0])
        improvable = (cycle.errors.by_cell > floor).any(axis=0)
        return np.asarray(cells.above(shares, _EVEN_SHARE)(share) & improvable)

    return chosen


def balance_value(machine: Machine) -> float:
    """Value (SI) of the scene's unknown, 0 if it has none; see `balanced`."""
    return 0.0 if machine.scene.unknown is None else balanced(machine).balance or 0.0


def balanced(machine: Machine, rtol: float = 1e-13) -> Cycle:
    """The cycle of a machine with an unknown, on cells halved until its net work is within rtol of the work exchanged."""

    def evaluated(edges: Array) -> tuple[Cycle, float, Coarse]:
        cycle = resolve(machine, edges)
        return cycle, cycle.errors.net / max(cycle.exchanged, 1e-300), coarse(cycle, 0.0)

    return cells.refined(machine.mesh, evaluated, rtol, _MOST_FOR_BALANCE + 2 * machine.mesh.size)


class Extremes(NamedTuple):
    """Greatest and least value of each function over the cycle, and their angles (rad).

    Their errors are those by interpolation inside cells, which other cells do not have; `apart` is the error of a difference
    of two values without that. Between the angles `earliest` and `latest` (2, functions) the true ones lie: these are of the
    places that are as great, or as small, but for errors.
    """

    greatest: Array
    least: Array
    angle_greatest: Array
    angle_least: Array
    greatest_error: Array
    least_error: Array
    apart: Array
    earliest: Array
    latest: Array


def errors_of_differences(
    cycle: Cycle, extremes: Extremes, pairs: Iterable[tuple[tuple[int, int], tuple[float, float]]]
) -> list[float]:
    """The errors (J) of differences between the greatest of one function W - b I* and the least of another.

    They are those of any two values, without what is left inside cells other than those of the extremes; or, if less, those
    of the errors r on the way between the two places and r' beyond them: (1 - s) r + s r' of W, where a balance has the
    share s of its effect between them, and the less of r and r' of I*, which is the same after a cycle.

    Args:
        cycle: the cycle.
        extremes: those of the functions.
        pairs: of functions, by their rows, with b of each, (rad/s)².

    """
    local = extremes.greatest_error, extremes.least_error, extremes.apart, extremes.earliest, extremes.latest
    highest, lowest, apart, earliest, latest = (each.tolist() for each in local)
    edges, parts = cycle.mesh.edges.tolist(), None if cycle.errors.parts is None else cycle.errors.parts.tolist()
    errors, gap = [], abs(float(cycle.start[1, -1]))
    for (high, low), factors in pairs:
        off = max(apart[high], apart[low])
        before, after = sorted(((earliest[0][high], latest[0][high]), (earliest[1][low], latest[1][low])))
        last, start = bisect_left(edges, before[1]), bisect_right(edges, after[0]) - 1
        if parts is not None and last <= start:
            first, end = bisect_right(edges, before[0]) - 1, bisect_left(edges, after[1])
            between = [row[end] - row[first] for row in parts]
            beyond = [row[-1] - row[start] + row[last] for row in parts]
            (work, work_beyond), (inertia, inertia_beyond) = (
                [way[k] + sqrt(way[2 + k] ** 2 + way[4 + k]) for way in (between, beyond)] for k in (0, 1)
            )
            of_work = max((1.0 - s) * work + s * work_beyond for s in (between[6], parts[6][start] - parts[6][last]))
            of_work += cycle.errors.turned
            off = min(off, of_work + max(factors) * min(inertia, inertia_beyond + gap))
        off += abs(factors[0] - factors[1]) * cycle.errors.variation
        errors.append(off + highest[high] + lowest[low])
    return errors


class Roots(NamedTuple):
    """Sign changes of functions a M* + b dI*/dphi: their angles (rad), with W (J) and I* - I*(0) (kg m²) there.

    `inertia` is I* (kg m²) by its own series.
    """

    crossings: Crossings
    angles: Array
    work: Array
    variation: Array
    inertia: Array

    def of(self, function: int) -> Roots:
        """The roots of one function."""
        own = slice(*self.crossings.function.searchsorted((function, function + 1)).tolist())
        return Roots(Crossings._make(row[own] for row in self.crossings), *(row[own] for row in self[1:]))


def combined(cycle: Cycle, factors: Array) -> tuple[Extremes, Roots]:
    """Extremes of H = a W + b (I* - I*(0)) for each row (a, b) of factors, at roots of a M* + b dI*/dphi.

    All roots in all cells are used, and both ends of every cell, but no samples. The angle of an extreme is the first of
    places that only rounding distinguishes.
    """
    (count, _), shape = factors.shape, cycle.series.shape[1:]
    slopes, sizes = (factors @ cycle.series[:2].reshape(2, -1)).reshape(count, *shape), np.abs(factors)
    crossings = cells.crossings(slopes, sizes @ cycle.noise)
    function, cell, powers = crossings.function, crossings.cell, cells.basis(crossings.t)
    work, variation = cycle.start.take(cell, axis=1) + (cycle.rising.take(cell, axis=1) * powers).sum(axis=-1)
    inertia = (cycle.series[2].take(cell, axis=0) * powers[:, :ORDER]).sum(axis=-1)
    roots = Roots(crossings, crossings.angles(cycle.mesh), work, variation, inertia)
    # a row for every function and its negative: values at the edges, then at all roots
    errors, edges = cycle.errors, cycle.mesh.edges
    here = factors @ np.concatenate((cycle.start, (work, variation)), axis=1)
    values, places = np.array((here, -here)), np.concatenate((edges, roots.angles))
    values[:, :, edges.size :][:, function != np.arange(count)[:, None]] = -np.inf  # at roots of other functions
    inside = sizes @ errors.inside  # a place beside an extreme, or one as great but for it, may be greater
    at_edges = inside[:, :1], np.maximum(inside[:, 1:], inside[:, :-1]), inside[:, -1:]
    reached, any_two = values.max(axis=-1), sizes @ (errors.work, errors.variation)
    beside = (values + np.concatenate((*at_edges, inside.take(cell, axis=1)), axis=1)).max(axis=-1) - reached
    angles = np.where(values >= (reached - cells.SAME * np.maximum(*reached))[..., None], places, np.inf).min(axis=-1)
    near = values >= (reached - 2.0 * any_two)[..., None]
    extremes = Extremes(
        greatest=reached[0],
        least=0.0 - reached[1],  # never -0
        angle_greatest=angles[0],
        angle_least=angles[1],
        greatest_error=beside[0],
        least_error=beside[1],
        apart=any_two - sizes @ errors.left,
        earliest=np.where(near, places, edges[-1]).min(axis=-1),
        latest=np.where(near, places, 0.0).max(axis=-1),
    )
    return extremes, roots


# -- the speed over the cycle ----------------------------------------------------------------------------------------------


class Run(NamedTuple):
    """Periodic motion with a given inertia on the crank (kg m²): speeds in rad/s, angles in rad.

    `offset` is the kinetic energy at phi = 0 less ½ (J + I*(0)) w_a² (J); `error` bounds the relative error of the
    irregularity, 2 (w_max - w_min)/(w_max + w_min); `level` that of the energy as a whole, as a share of (J + I*(0)) w_a²,
    where the machine sets its own. Where torques depend on speed, `cycle` is the one along this motion and
    `speed` its own mean of extremes w_a; else they are those of the whole sizing. `drive` is then the drive's moment on the
    crank (N m) at the cycle's nodes, `states` a motor's own at phi = 0, such as its current (A), `along` the same at the
    nodes (states, cells, nodes) and `states_error` their greatest error anywhere, if known.
    """

    inertia: float
    irregularity: float
    speed_max: float
    speed_min: float
    angle_speed_max: float
    angle_speed_min: float
    offset: float
    error: float
    cycle: Cycle | None = None
    speed: float | None = None
    drive: Array | None = None
    states: tuple[float, ...] = ()
    along: Array | None = None
    states_error: tuple[float, ...] = ()
    level: float = 0.0

    @property
    def level_error(self) -> Any:
        """Relative error of the mean of extremes from that of the energy's level: the slower, the greater."""
        mean = 0.5 * (self.speed_max + self.speed_min)
        return self.level * mean**2 / np.maximum(np.maximum(self.speed_max * self.speed_min, ROUNDING * mean**2), 1e-300)

    @property
    def error_about_mean(self) -> float:
        """Relative error of the extreme speeds w (1 ± eps/2), whose mean w is exact: at the slower, w d eps/2 over it."""
        mean = 0.5 * (self.speed_max + self.speed_min)
        return 0.5 * self.error * self.irregularity * mean / max(self.speed_min, ROUNDING * mean) + 4 * ROUNDING


def run(cycle: Cycle, speed: float, inertia: float) -> Run:
    """The motion whose mean of greatest and least speed is `speed` w (rad/s), by Newton's method on its irregularity eps.

    The inertia J is the exact flywheel for eps: D(eps) = max(W - z+ w²V/2) - min(W - z- w²V/2) = eps w² (J + I*(0)),
    V = I* - I*(0), z± = (1 ± eps/2)². With eps the difference of the two sides falls, by w²/2 times the sum of
    (1 ± eps/2) (J + I*) at the two places: so there is one eps, and an error of D shifts it by the error divided by that
    sum.

    Raises NoMotionError where D is too large even at eps = 2: the machine would stop.
    """
    square, errors = speed**2, cycle.errors
    least = float(combined(cycle, np.array([[0.0, 1.0]]))[0].least[0])
    start = inertia + cycle.inertia_at_start
    if start + least <= errors.variation:  # rounding may leave something if there is nothing
        raise NoMotionError

    def compared(eps: float) -> tuple[Extremes, float]:
        """The extremes of both functions, and the difference of energies in excess of the inertia's share (J)."""
        factors = -0.5 * square * np.array([1 + eps / 2, 1 - eps / 2]) ** 2
        extremes = combined(cycle, np.stack((np.ones(2), factors), axis=-1))[0]
        return extremes, float(extremes.greatest[0] - extremes.least[1]) - eps * square * start

    if compared(2.0)[1] >= 0.0:
        raise NoMotionError
    low, high, eps = 0.0, 2.0, 0.0
    for _ in range(_MOST_STEPS):
        extremes, excess = compared(eps)
        low, high = (eps, high) if excess > 0.0 else (low, eps)
        places = np.array([extremes.angle_greatest[0], extremes.angle_least[1]])
        totals = start + cycle.at(*cells.located(cycle.mesh, places))[1]
        steepness = 0.5 * square * float(np.array([1 + eps / 2, 1 - eps / 2]) @ totals)
        target = eps + excess / steepness
        step = (target if low <= target <= high else 0.5 * (low + high)) - eps
        eps += step
        if abs(step) <= 8 * ROUNDING * float(extremes.greatest[0] - extremes.least[1]) / steepness:
            break
    factors = 0.5 * square * (1 + eps / 2) ** 2, 0.5 * square * (1 - eps / 2) ** 2
    error = errors_of_differences(cycle, extremes, [((0, 1), factors)])[0] + errors.residual
    error += eps * square * (errors.start + 4 * ROUNDING * start)
    error = error / (steepness * eps) if eps else 0.0
    return motion_of(inertia, start, speed, eps, extremes, (0, 1), error)


def motion_of(
    inertia: float, start: float, speed: float, eps: float, extremes: Extremes, rows: tuple[int, int], error: float
) -> Run:
    """The motion with an inertia (kg m² on the crank) that is the exact one for an irregularity.

    Args:
        inertia: J.
        start: J + I*(0), kg m².
        speed: w, the mean of extremes, rad/s.
        eps: the irregularity.
        extremes: of functions, among them W - z+ w²V/2 and W - z- w²V/2: at the greatest of the one the machine is fastest,
            with the energy z+ w² (J + I*)/2, at the least of the other slowest.
        rows: of these two functions.
        error: of the irregularity, relative.

    """
    return Run(
        inertia=inertia,
        irregularity=eps,
        speed_max=speed * (1 + eps / 2),
        speed_min=speed * (1 - eps / 2),
        angle_speed_max=float(extremes.angle_greatest[rows[0]]),
        angle_speed_min=float(extremes.angle_least[rows[1]]),
        offset=0.5 * speed**2 * eps * (1 + eps / 4) * start - float(extremes.greatest[rows[0]]),
        error=error,
    )


def resolved_run(machine: Machine, cycle: Cycle, speed: float, inertia: float, rtol: float) -> tuple[Cycle, Run]:
    """The same motion on cells fine enough for its own error to be within rtol, if halving them can reach that."""

    def evaluated(edges: Array) -> tuple[tuple[Cycle, Run], float, Coarse]:
        here = cycle if edges is cycle.mesh.edges else resolve(machine, edges)
        motion = run(here, speed, inertia)
        return (here, motion), motion.error, coarse(here, motion.speed_max)

    return cells.refined(cycle.mesh.edges, evaluated, rtol)


def speed_over_cycle(cycle: Cycle, speed: float, motion: Run, phi: Array) -> Array:
    """Crank speed (rad/s) of a run at angles phi (rad); `speed` is the mean of extremes that it was found for.

    For a run with its own cycle and speed, these are used.
    """
    cycle, speed = motion.cycle or cycle, motion.speed or speed
    work, variation = cycle.at_nodes() if phi is cycle.mesh.phi else cycle.at(*cells.located(cycle.mesh, phi))
    total = motion.inertia + cycle.inertia_at_start + variation
    s = (2 * motion.offset + 2 * work - speed**2 * variation) / (speed**2 * total)
    return np.asarray(speed * np.sqrt(np.maximum(1.0 + s, 0.0)))


def acceleration_over_cycle(cycle: Cycle, motion: Run, phi: Array, omega: Array) -> Array:
    """Crank acceleration (rad/s²) of a run at angles phi (rad) and its speeds there (rad/s).

    alpha = (M* - ½ dI*/dphi omega²)/(I* + J). For a run with its own cycle, that is used.
    """
    cycle = motion.cycle or cycle
    cell, t = cells.located(cycle.mesh, phi)
    moment, slope, inertia = (cells.value(row[cell], t) for row in cycle.series)
    return np.asarray((moment - 0.5 * slope * omega**2) / (inertia + motion.inertia))


def period(cycle: Cycle, speed: float, motion: Run, rtol: float) -> tuple[float, float]:
    """Time of one cycle (s), the integral of dphi/omega, and its estimated relative error; cells are halved as needed.

    An error of energy matters more at low speed: that of the level, with its rounding, has the factor (w_a/omega)², that of
    the mean of extremes w_a/omega, both in the mean over time. Root, product, reciprocal and weight of a value are rounded
    by half a unit each, and so are the sums of positive terms in a cell and over the cells; a term passes 16 in the mean at
    most: ten units.
    """

    def evaluated(edges: Array) -> tuple[tuple[Array, Array, float, float], float, Coarse]:
        mesh = cycle.mesh if edges is first else cells.cells(edges)
        slowness = 1.0 / speed_over_cycle(cycle, speed, motion, mesh.phi)
        total = float(cells.integral(slowness, mesh.half).sum())
        shares = cells.TAIL_OF_INTEGRAL * cells.tails(cells.fit(slowness)) * mesh.half[:, 0] / total
        missed = float(shares.sum())
        return (slowness, mesh.half, total, missed), missed, cells.above(shares, 0.1)

    first = cycle.mesh.edges
    slowness, half, total, missed = cells.refined(first, evaluated, rtol, max(_MOST_FOR_PERIOD, 2 * first.size))
    slower = (motion.speed or speed) * slowness
    once, twice = (float(cells.integral(slowness * slower**n, half).sum()) / total for n in (1, 2))
    pinned = max(motion.error - 4.0 * motion.level, 0.0) * motion.irregularity  # an error of the level counts once
    return total, missed + pinned * once + (motion.level + 4 * ROUNDING) * twice + 10 * ROUNDING


# -- errors of angles ------------------------------------------------------------------------------------------------------


def error_of_crossings(cycle: Cycle, roots: Roots) -> float:
    """Error (rad) of the angles where M* crosses zero.

    Each error is that of M* over its slope, near a double root the angle 2 sqrt(2 noise/|M*''|) in which M* is within its
    error. At the end of a cell, where the moment jumps through zero or the cycle ends, only rounding remains; where a
    stretch of zeros ends, the side after it decides. The net work of the cycle may shift the crossing as far as the moment
    does that work.
    """
    end, crossings = float(cycle.mesh.edges[-1]), roots.crossings
    at_end = crossings.t >= _CELL_END
    cell = np.minimum(crossings.cell + at_end, cycle.mesh.half.size - 1)
    t = np.where(at_end, -1.0, crossings.t)
    noise = cycle.noise[0].take(cell) + cycle.errors.net / end
    value, slope, bend = np.abs(cells.derivatives(cycle.series[0].take(cell, axis=0), t))
    slope = np.maximum(slope, 1e-300)
    along = noise / slope
    along = along * (1.0 + 6.0 * along * bend / slope)
    errors = np.minimum(np.minimum(along, 2.0 * np.sqrt(2.0 * noise / np.maximum(bend, 1e-300))), 2.0)
    uncertain = ~at_end | ((value <= noise) & (crossings.cell + 1 < cycle.mesh.half.size))
    error = 4 * ROUNDING * end + float((cycle.mesh.half.take(cell) * errors)[uncertain].max(initial=0.0))
    if not cycle.errors.residual or not crossings.t.size:
        return error
    phi, work = _at_nodes(cycle)[:2]
    beyond = 0.0
    for angle, accumulated in zip(roots.angles, roots.work, strict=True):
        far = phi[np.abs(work - accumulated) > cycle.errors.residual]
        beyond = max(beyond, angle - far[far < angle].max(initial=0.0), far[far > angle].min(initial=end) - angle)
    return error + float(beyond)


def error_of_extremes(cycle: Cycle, motion: Run, *, sized: bool) -> float:
    """Error (rad) of the angles of extreme speed, roots of M* - ½ omega² dI*/dphi; `sized`: the required speeds.

    The net work N of the cycle shifts kinetic energies by no more than itself, so that the greatest speed w is reached
    where (J + I*) (w² - omega²)/2 <= (1 + r) N, r the ratio of the greatest J + I* to the least; and likewise for the least.
    """
    along = motion.cycle or cycle
    speeds, places = np.array([[motion.speed_max, motion.speed_min], [motion.angle_speed_max, motion.angle_speed_min]])
    cell, t = cells.located(along.mesh, places)
    factors = 0.5 * speeds**2
    closed_form = sized and motion.inertia > 0.0 and motion.cycle is None
    half = along.mesh.half.take(cell)
    at_end = np.abs(t) >= _CELL_END - 8 * ROUNDING * along.mesh.edges[-1] / half  # rounding of t
    errors = [0.0]
    if not at_end.all():
        # noise of M* - factor dI*/dphi over its slope, at most a cell's width
        moment, slope = along.series[:2].take(cell, axis=1)
        level, slope_noise = along.noise.take(cell, axis=1)
        rows = moment - factors[:, None] * slope
        noise = level + factors * slope_noise + along.errors.net / along.mesh.edges[-1]
        if not closed_form:
            loose = 2 * motion.error * motion.irregularity * speeds.mean() / np.maximum(speeds, 1e-300)
            noise = noise + loose * factors * np.abs(cells.value(slope, t))
        of_roots = np.minimum(noise / np.maximum(np.abs(cells.derivatives(rows, t)[1]) / half, 1e-300), 2 * half)
        of_roots = np.where(np.abs(rows).sum(axis=-1) <= noise, 2 * half, of_roots)  # noise alone: anywhere in the cell
        of_roots = np.where(np.abs(t) < _CELL_END, of_roots, 0.0)
        errors += of_roots.tolist()
        at_end |= of_roots >= 2 * half  # anywhere in the cell, and so perhaps in the next
    if at_end.any():
        errors += _end_errors(along, (cell + (t > 0.0))[at_end], factors[at_end])
    error = 4 * ROUNDING * float(cycle.mesh.edges[-1]) + max(errors)
    if not cycle.errors.residual:
        return error
    phi, work, variation = _at_nodes(cycle)
    total = motion.inertia + cycle.inertia_at_start + variation
    energy = motion.offset + work + 0.5 * float(speeds.mean()) ** 2 * (total - variation)
    reach = (1.0 + float(total.max() / max(total.min(), 1e-300))) * cycle.errors.residual
    beyond = 0.0
    for speed, angle in zip(speeds, places, strict=True):
        near = np.abs(energy - 0.5 * speed**2 * total) <= reach
        near |= np.roll(near, 1) | np.roll(near, -1)  # between two angles
        apart = np.abs(phi[near] - angle)
        beyond = max(beyond, float(np.minimum(apart, cycle.mesh.edges[-1] - apart).max(initial=0.0)))
    return error + beyond


def _at_nodes(cycle: Cycle) -> tuple[Array, Array, Array]:
    """Angles (rad) that ascend over the cycle, W (J) and I* - I*(0) (kg m²) there."""
    count = cycle.mesh.half.size
    t = np.concatenate(([-1.0], np.sort(NODES)))
    cell, t = np.repeat(np.arange(count), t.size), np.tile(t, count)
    return cycle.mesh.middle[cell, 0] + cycle.mesh.half[cell, 0] * t, *cycle.at(cell, t)


def _end_errors(cycle: Cycle, edges: Index, factors: Array) -> list[float]:
    """Errors (rad) of extremes of speed at ends of cells.

    0 if M* - factor dI*/dphi jumps through zero there. Else a root lies beside the end, so near that the speed at
    both is the same except for rounding; or the function is indistinguishable from zero in whole cells around: it is their
    width.
    """
    count, least = cycle.mesh.half.size, cycle.errors.net / cycle.mesh.edges[-1]
    beside = np.array([edges - 1, edges % count])
    moment, slopes = cycle.series[:2].take(beside, axis=1)
    level, of_slope = cycle.noise.take(beside, axis=1)
    rows, noise = moment - factors[:, None] * slopes, level + factors * of_slope + least
    before, after = cells.ends(rows)
    values = np.array((before[:, 1], after[:, 0]))
    jumps = (values[0] * values[1] < 0.0) & (np.abs(values) > noise).all(axis=0)
    errors, widths = [0.0], 2 * cycle.mesh.half[:, 0]
    for k in (~jumps).nonzero()[0].tolist():
        slope = np.abs(cells.slope(rows[:, k], np.array([1.0, -1.0]))) / (0.5 * widths[beside[:, k]])
        near = (np.abs(values[:, k]) + noise[:, k]) / np.maximum(slope, 1e-300)
        size = np.abs(cycle.series[0] - factors[k] * cycle.series[1]).sum(axis=-1)
        level = cycle.noise[0] + factors[k] * cycle.noise[1] + least
        quiet, turned = (np.roll(each, -edges[k]) for each in (size <= level, widths))
        ahead, back = (count if row.all() else int(np.argmin(row)) for row in (quiet, quiet[::-1]))
        errors.append(min(float(turned[:ahead].sum() + turned[count - back :].sum()), float(turned.sum())))
        errors.append(float(np.minimum(near, widths[beside[:, k]]).min()))
    return errors


def cycle_of(moments: Moments, rate: Rate, unknown: float | None) -> Cycle:
    """The cycle in which F is as given at the nodes, or those of many motions; `unknown` is None if it has no value."""
    values = np.stack((rate.moment, moments.slope, moments.inertia, rate.exchanged, moments.steepness))
    by_unknown = 0.0 if unknown is None else float(cells.integral(rate.by_unknown, moments.mesh.half).sum())
    balanced = moments.machine.scene.unknown is not None
    spread = spread_of_closing(rate, moments.mesh, balanced=balanced, unknown=unknown or 0.0)
    turned = moments.machine.by_directions
    return assembled(moments.mesh, values, unknown, by_unknown=by_unknown, spread=spread, by_directions=turned)
