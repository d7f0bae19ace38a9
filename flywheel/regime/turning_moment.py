"""The balanced cycle on cells: M*, dI*/dphi and I* as series, what they accumulate, and how far all that can be trusted.

Everything here is quadrature of loads that depend on phi alone; nothing is stepped in time.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.machine.machine import Machine
from flywheel.numerics import cells
from flywheel.numerics.cells import ORDER, ROUNDING, Cells, Coarse, Crossings
from flywheel.numerics.faults import Fault, SceneError
from flywheel.scene.scene import Scene

Array = NDArray[np.float64]

_EVALUATION = 24 * ROUNDING  # rounding of a reduced quantity relative to the sum of its parts' sizes
_BLOCK = 2_048  # cells that the graph is walked at together: it needs some forty arrays of their size
_ENORMOUS = 1e150  # of forces and inertias in SI: their squares and products would leave the floating-point range
_EVEN_SHARE = 0.125  # of an error spread evenly over the cells: what one may keep
_MOST_FOR_BALANCE = 2_000  # that the last digit of a balance alone is worth, beside those of the machine's own mesh


class CycleErrors(NamedTuple):
    """Absolute errors estimated of a resolved cycle: of W (J), of the variation of I* and of I* itself (kg m²).

    Interpolation adds up over the cells, each with more than its series leaves out. So does the rounding of values, at 24
    units of the sizes that they are summed from. What the rounding of angles shifts adds up as independent shares do: twice
    the root of the sum of their squares, which is what to expect and no bound.

    `by_cell` has the share of each cell's interpolation in W and in the variation of I* (2, cells); `inertias` the error of
    I* itself in each cell.

    `residual` is the net work (J) that a cycle without a balance leaves over. It may belong anywhere in the cycle, and W is
    off by as much from there on: so is every difference of two of its values.
    """

    work: float
    variation: float
    inertia: float
    by_cell: Array
    inertias: Array
    residual: float = 0.0

    @property
    def swing(self) -> float:
        """Error (J) of the difference of two values of W."""
        return 2 * self.work + self.residual


class Cycle(NamedTuple):
    """One cycle of a balanced machine, as Chebyshev series on cells.

    `series` (3, cells, ORDER) holds M*, dI*/dphi and I*; `rising` (2, cells, ORDER + 1) the integrals of the first two from
    each cell's left end; `start` (2, cells + 1) what they have accumulated at the edges: W and I* - I*(0).
    `net` is the work of M* over the cycle (J), `exchanged` the integral of the sum of |contributions| to M* (J). `noise`
    (2, cells) is the size below which M* and dI*/dphi cannot be told from zero. `balance_error` is
    the relative error of the balance itself.
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

    def at(self, cell: NDArray[np.intp], t: Array) -> tuple[Array, Array]:
        """W (J) and I* - I*(0) (kg m²) at local abscissas of cells."""
        local = (self.rising[:, cell] * cells.basis(t)).sum(axis=-1)
        work, variation = self.start[:, cell] + local
        return work, variation

    def where(self, phi: Array) -> tuple[NDArray[np.intp], Array]:
        """Cell and local abscissa of angles in [0, cycle]."""
        return cells.located(self.mesh, phi)


def resolve(machine: Machine, edges: Array) -> Cycle:
    """The cycle on cells between given edges: one walk of the graph at all nodes (block by block), then the balance.

    The unknown u of a balance follows from the cycle's net work, N0 + u N1 = 0. Without one the net work that is left over
    (J) is among the cycle's errors, where it is more than they are.

    Raises SceneError where a load has no finite value, or a balance no effect.
    """
    check_cycle(machine.scene)
    mesh = cells.cells(edges)
    values = np.empty((6, *mesh.phi.shape))
    for first in range(0, len(mesh.phi), _BLOCK):
        block = slice(first, first + _BLOCK)
        reduced, part = machine.reduce(mesh.phi[block], mesh.anchor[block]), values[:, block]
        part[0], part[1], part[2] = reduced.moment, reduced.slope, reduced.inertia
        part[3], part[4], part[5] = reduced.per_unknown, reduced.exchanged, reduced.steepness
    if not (np.abs(values) <= _ENORMOUS).all():
        raise SceneError([undefined(machine, mesh, np.abs(values).max(axis=0))])
    rows = [0, 1, 2, 4, 5]
    if machine.scene.unknown is None:
        cycle = assembled(mesh, values[rows], None)
        residual = abs(cycle.net) if abs(cycle.net) > cycle.errors.work else 0.0
        return cycle._replace(errors=cycle.errors._replace(residual=residual))
    net, per_unknown, size = cells.integral(np.stack((values[0], values[3], np.abs(values[3]))), mesh.half).sum(-1)
    if abs(per_unknown) <= 1e-9 * size or size == 0.0:
        raise SceneError([no_effect(machine)])
    balance = float(-net / per_unknown) + 0.0  # never -0
    values[0] += balance * values[3]
    values[4] += abs(balance) * np.abs(values[3])
    return assembled(mesh, values[rows], balance, by_unknown=values[3])


def assembled(
    mesh: Cells, values: Array, balance: float | None, *, by_unknown: Array | None = None, closed: bool = False
) -> Cycle:
    """A cycle from its values at the nodes.

    Args:
        mesh: the cells.
        values: M* (balance included, N m), dI*/dphi, I* (kg m²), and the sums of |contributions| to M* and to dI*/dphi,
            shape (5, cells, nodes).
        balance: the unknown (SI), where there is one.
        by_unknown: dM*/du at the nodes, by which the error of the balance follows from that of the net work.
        closed: whether the speed was chosen so that no work is left over: like a balance it shifts M* by what net work errs.

    """
    series = cells.fit(values[:3])
    rising = cells.antiderivative(series[:2], mesh.half)
    start = cells.accumulated(rising)
    exchanged, slope_exchanged = cells.integral(values[3:], mesh.half).sum(axis=-1).tolist()
    tails = cells.tails(series)
    shifts = 2.0 if closed or balance is not None else 1.0  # a balance shifts M* by what the net work errs
    by_cell = cells.TAIL_OF_INTEGRAL * tails[:2] * mesh.half[:, 0]
    by_cell[0] *= shifts
    # every angle is rounded by itself, nodes and breakpoints alike: what that shifts adds up as independent shares do
    shifted = np.diff(values[:2].reshape(2, -1), axis=1) * mesh.phi.reshape(-1)[1:]
    most = np.maximum(np.abs(shifted).max(axis=1, keepdims=True), 1e-300)  # squares must not leave the floating-point range
    angle = 2 * ROUNDING * most[:, 0] * np.sqrt(((shifted / most) ** 2).sum(axis=1))
    slopes, sizes = np.abs(values[1:3]).max(axis=-1)
    inertias = tails[2] + _EVALUATION * sizes + 2 * ROUNDING * mesh.edges[-1] * slopes
    interpolation = by_cell.sum(axis=1)
    work = float(interpolation[0] + shifts * (_EVALUATION * exchanged + angle[0]))
    variation = float(interpolation[1] + _EVALUATION * slope_exchanged + angle[1])
    by_balance = 0.0 if by_unknown is None else (balance or 0.0) * float(cells.integral(by_unknown, mesh.half).sum())
    return Cycle(
        mesh=mesh,
        series=series,
        rising=rising,
        start=start,
        inertia_at_start=float(cells.value(series[2, :1], np.array([-1.0]))[0]),
        balance=balance,
        net=float(start[0, -1]),
        exchanged=exchanged,
        noise=tails[:2] + 32 * ROUNDING * values[3:].max(axis=-1) + cells.by_rounded_angles(series[:2], mesh),
        errors=CycleErrors(work, variation, float(inertias.max()), by_cell, inertias),
        balance_error=work / abs(by_balance) if by_balance else 0.0,
    )


def check_cycle(scene: Scene) -> None:
    """Refuse a scene that goes one way: without a cycle nothing balances, and there is nothing for a flywheel to do."""
    if scene.stroke is not None:
        found = "a one-way stroke, which has no cycle and so no flywheel"
        advice = "use flywheel reduce, flywheel.reduce or flywheel.simulate, or let a crank drive the mechanism"
        raise SceneError([Fault("stroke", found, "a machine that turns in cycles", advice)])


def no_effect(machine: Machine) -> Fault:
    """The fault of a balance that cannot balance anything."""
    unknown = machine.scene.unknown
    path = "drive.torque" if unknown == "drive" else f"parameters.{unknown}"
    found, expected = '"balance" that does no net work over the cycle', "an unknown whose net work is not zero"
    return Fault(path, found, expected, "let it act where the machine moves one way, or balance another quantity")


def check_closed(cycle: Cycle, machine: Machine) -> None:
    """Refuse a cycle whose work does not close: without a balance the net work must be zero within `closure`."""
    allowed = machine.scene.closure * cycle.exchanged + cycle.errors.work
    if machine.scene.unknown is None and abs(cycle.net) > allowed:
        share = abs(cycle.net) / cycle.exchanged
        raise SceneError(
            [
                Fault(
                    "load",
                    f"net work {cycle.net:.9g} J over the cycle ({share:.2g} of the work exchanged)",
                    f"zero within accuracy.closure = {machine.scene.closure:g}",
                    'name the unknown: drive.torque = "balance", or a parameter = "balance"',
                )
            ]
        )


class Extent(NamedTuple):
    """Least and greatest I* without the flywheel, and the errors of the two, kg m²."""

    least: float
    greatest: float
    error: float
    greatest_error: float


def inertia_extent(cycle: Cycle) -> Extent:
    """The extremes of I* by its own series: what its slope adds up to would lose a small I* beside a large one.

    Each is as doubtful as its own cell is, or as another cell may be beyond it.
    """
    least, greatest = cells.extents(cycle.series[2])
    low, high, errors = int(least.argmin()), int(greatest.argmax()), cycle.errors.inertias
    return Extent(
        float(least[low]),
        float(greatest[high]),
        float(max(errors[low], (least[low] - least + errors).max())),
        float(max(errors[high], (greatest - greatest[high] + errors).max())),
    )


def undefined(machine: Machine, mesh: Cells, values: Array, omega: Array | None = None) -> Fault:
    """The fault of the load without a finite value where values on a mesh have none, at crank speeds (rad/s) there."""
    cell, node = np.argwhere(~(np.abs(values) <= _ENORMOUS))[0]
    speed = None if omega is None else float(omega[cell, node])
    return not_finite(machine, float(mesh.phi[cell, node]), float(mesh.anchor[cell, 0]), speed)


def not_finite(machine: Machine, phi: float, anchor: float, speed: float | None = None, time: float = 0.0) -> Fault:
    """The fault of a load, or else the mechanism, that has no finite value at a position, or one out of all proportion.

    Args:
        machine: the machine.
        phi: the position, rad.
        anchor: a position in the middle of the smooth piece that it lies in, rad.
        speed: of the crank, rad/s, where loads that depend on it count.
        time: s, for those that depend on it.

    """
    parts = machine.reduction.moments(phi, anchor, by_name=True, speed=speed, time=time)
    culprit, moment = next(((name, part) for name, part in parts.items() if not abs(part) <= _ENORMOUS), ("mechanism", None))
    at, sliding = machine.where(phi), machine.scene.stroke is not None and machine.scene.stroke.sliding
    if speed is not None and any(effort.path == culprit and effort.uses_speed for effort in machine.efforts):
        at += f" and {speed:.6g} {'m/s' if sliding else 'rad/s'}"
    if moment is not None and math.isfinite(moment):
        unit = "N on the slide" if sliding else "N m on the crank"
        found = f"a value that comes to {moment:.4g} {unit} at {at}, beyond {_ENORMOUS:g}"
    else:
        reason = machine.undefined(culprit, phi, anchor, speed, time)
        found = f"a value that is not finite at {at}" + (f" ({reason})" if reason else "")
    return Fault(
        culprit,
        found,
        f"finite forces and torques over the whole {'cycle' if machine.scene.stroke is None else 'stroke'}",
        "mend the expression or table, or give the load a window that leaves the angle out",
    )


def weightless(machine: Machine, phi: float, total: float) -> Fault:
    """The fault of an inertia that is not above 0 at a position."""
    where = machine.where(phi)
    if machine.scene.stroke is None:
        return Fault(
            "flywheel.inertia", f"I* + J = {total:g} kg m² at {where}", "a positive inertia everywhere", "add inertia"
        )
    name, unit = ("m*", "kg") if machine.scene.stroke.sliding else ("I*", "kg m²")
    return Fault(
        "inertia", f"{name} = {total:g} {unit} at {where}", "a positive one all along the stroke", "add [[inertia]]"
    )


def check_weighs(machine: Machine, cycle: Cycle, inertia: float) -> None:
    """Refuse to run a machine that with its flywheel (kg m² on the crank) has no inertia at some angle.

    All its masses stand there, at a dead centre, and no finite torque tells how fast the crank goes on.
    """
    extent = inertia_extent(cycle)
    if inertia + extent.least <= extent.error:
        fault = weightless(machine, float(combined(cycle, np.array([[0.0, 1.0]]))[0].angle_least[0]), 0.0)
        raise SceneError([fault._replace(found=f"{fault.found} (to within {extent.error:.1g} kg m²)")])


def coarse(cycle: Cycle, speed: float) -> Coarse:
    """Which cells keep the error of W - ½ speed² I* above a share of what it is now.

    A cell whose interpolation error is at the level of rounding is left alone: halving cannot help it.
    """

    def chosen(share: float) -> NDArray[np.bool_]:
        shares = cycle.errors.by_cell[0] + 0.5 * speed**2 * cycle.errors.by_cell[1]
        floor = 8 * ROUNDING * ORDER * (np.abs(cycle.series[:2]).sum(axis=-1) * cycle.mesh.half[:, 0])
        improvable: NDArray[np.bool_] = (cycle.errors.by_cell > floor).any(axis=0)
        return cells.above(shares, _EVEN_SHARE)(share) & improvable

    return chosen


def balance_value(machine: Machine) -> float:
    """Value (SI) of the scene's unknown, 0 where it has none; see `balanced`."""
    return 0.0 if machine.scene.unknown is None else balanced(machine).balance or 0.0


def balanced(machine: Machine, rtol: float = 1e-13) -> Cycle:
    """The cycle of a machine with an unknown, on cells halved until its net work is known to rtol of the work exchanged."""
    most = _MOST_FOR_BALANCE + 2 * machine.mesh.size
    return cells.refined(machine.mesh, lambda edges: closed_work(resolve(machine, edges)), rtol, most)


def closed_work(cycle: Cycle) -> tuple[Cycle, float, Coarse]:
    """A cycle, the error of its work as a share of the work exchanged, and the cells that make it."""
    return cycle, cycle.errors.work / max(cycle.exchanged, 1e-300), coarse(cycle, 0.0)


class Extremes(NamedTuple):
    """Greatest and least value of each function over the cycle, and the angles (rad) where they stand."""

    greatest: Array
    least: Array
    angle_greatest: Array
    angle_least: Array


def combined(cycle: Cycle, factors: Array) -> tuple[Extremes, Crossings]:
    """Extremes of H = a W + b (I* - I*(0)) for each row (a, b) of factors, at roots of a M* + b dI*/dphi.

    Every root in every cell counts, and both ends of every cell; nothing is sampled.
    """
    shape = cycle.series.shape[1:]
    slopes = (factors @ cycle.series[:2].reshape(2, -1)).reshape(len(factors), *shape)
    found = cells.crossings(slopes, np.abs(factors) @ cycle.noise)
    work, variation = cycle.at(found.cell, found.t)
    at_roots = factors[found.function, 0] * work + factors[found.function, 1] * variation
    angles = found.angles(cycle.mesh)
    bounds = np.searchsorted(found.function, np.arange(len(factors) + 1))
    columns = np.empty((4, len(factors)))
    for j, at_edges in enumerate(factors @ cycle.start):
        own = slice(bounds[j], bounds[j + 1])
        values = np.concatenate((at_edges, at_roots[own]))
        places = np.concatenate((cycle.mesh.edges, angles[own]))
        top, bottom = values.argmax(), values.argmin()
        columns[:, j] = values[top], values[bottom], places[top], places[bottom]
    return Extremes(*columns), found
