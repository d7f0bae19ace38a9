"""What a sizing would cost at the other levels of accuracy, foretold from what it is known to consist of.

Evaluations are counted by structure: nodes on cells for what works on arrays, and for time stepping the degrees of the
series that the motion's acceleration has on its cells, which tell how many steps of order 8 it takes. Seconds follow from
how long one evaluation of this machine takes, and a small system of equations, here and now: they are rough.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flywheel import piecewise, steady
from flywheel.accuracy import AUDIT, CONFIRM, FAST, LEVELS, NORMAL
from flywheel.collocated import on_thirds
from flywheel.cost import FREE, Cost
from flywheel.machine import Machine
from flywheel.piecewise import ORDER
from flywheel.regime import Cycle
from flywheel.results import Sizing
from flywheel.steady import NoMotionError, Run

if TYPE_CHECKING:
    from flywheel.instant import Dynamics

Array = NDArray[np.float64]

_PER_DEGREE = 18.5  # evaluations of a time stepping for each degree of the series of what it follows
_UP_TO = 6  # degree on a cell that a step of order 8 takes no notice of
_OF_STEP = 17  # evaluations of a step with its dense output, of which a stretch takes one at the least
_TO_BEGIN = 100.0  # evaluations in which a time stepping finds how long its steps can be
_IMPLICIT = 24.0  # evaluations of implicit steps for each degree
_BATCH = 3 * 16  # of them that are found at once: at all stages, for a state and each of its two variables moved
_VISIBLE = 1e-13  # of the greatest coefficient: below it a degree does not count
_EASY = 1e-10  # rtol down to which collocation hardly ever halves the cells that it begins with
_TIGHT, _TIGHTEST = 3e-5, 3e-14  # tolerance of a step: of rtol, and the least
_PER_CELL = 5  # nodes' worth of evaluations that a motion with torques that depend on speed takes in each cell, by ORDER
_NEWTON, _OF_CELL = 560.0, 7.5  # time of one motion by collocation, and of each of its cells, in systems of equations
_WIDE = 3.0  # how much longer one takes whose irregularity is near 2
_AROUND = 2.6  # time of a step beside each evaluation, in systems of equations
_AROUND_BATCH = 2.1  # time of implicit steps over that of their evaluations


def predicted(sizing: Sizing) -> dict[str, Cost]:
    """Evaluations and seconds of a sizing at every level of accuracy, by name; its own as measured.

    A diagram of areas costs nothing at any level. Evaluations hold within a factor of three where rtol is 1e-10 or more;
    below it cells and steps come near rounding, and may need ten times as many. Seconds are rough: within a factor of three
    on a machine with nothing else to do.
    """
    machine, cycle = sizing.machine, sizing.cycle
    if machine is None or cycle is None:
        return dict.fromkeys(LEVELS, FREE)
    figures, own = _stage(sizing, "figures"), sizing.accuracy
    exact = figures if own != FAST else _exact(sizing, machine, cycle, figures)
    simulations: dict[str, Callable[[], Cost]] = {
        CONFIRM: lambda: _collocation(sizing, machine, exact.evaluations - figures.evaluations),
        AUDIT: lambda: _stepping(sizing, machine, cycle),
    }
    found = {FAST: _bounds(sizing, machine, figures), NORMAL: exact}
    found |= {level: _sum(exact, foretell()) for level, foretell in simulations.items() if level != own}
    return {level: sizing.cost if level == own else found[level] for level in LEVELS}


def _stage(sizing: Sizing, name: str) -> Cost:
    return sizing.cost.stages.get(name, FREE)


def _sum(one: Cost, two: Cost) -> Cost:
    return Cost(one.evaluations + two.evaluations, one.seconds + two.seconds)


def _motion(sizing: Sizing) -> Cost:
    """What the exact motion took where torques depend on speed."""
    return _stage(sizing, "figures").stages.get("motion", FREE)


def _bounds(sizing: Sizing, machine: Machine, figures: Cost) -> Cost:
    """The level `fast`: all but the motion, where that is what the exact figures are, or is found from them."""
    own = _motion(sizing) if machine.sets_its_speed else Cost(0, _run(sizing))
    return Cost(figures.evaluations - own.evaluations, max(figures.seconds - own.seconds, 0.1 * figures.seconds))


def _exact(sizing: Sizing, machine: Machine, cycle: Cycle, figures: Cost) -> Cost:
    """The level `normal`, from bounds alone: on the same cells, or a motion besides."""
    if not machine.sets_its_speed:
        more = int(0.5 * cycle.mesh.phi.size)
        return _sum(figures, Cost(more, _walk(machine, cycle.mesh.phi) + _run(sizing)))
    cells = machine.mesh.size - 1
    evaluations = _PER_CELL * ORDER * cells
    return _sum(figures, Cost(evaluations, _newton(sizing, machine, cycle.mesh.phi, evaluations)))


def _run(sizing: Sizing) -> float:
    """Seconds that the speed's level takes with a flywheel that is known, given or none; what is sized has it asked for."""
    known = sizing.scene.inertia is not None or sizing.flywheel.needed is False
    cycle = sizing.cycle
    return 0.0 if cycle is None or not known else _timed(lambda: _by_areas(sizing, cycle))


def _collocation(sizing: Sizing, machine: Machine, extra: int) -> Cost:
    """One motion with the exact or given flywheel, and one with the approximate one, on cells of their own."""
    own, motions = on_thirds(machine), _motions(sizing)
    cells = own.mesh.size - 1
    harder = 1.0 + 0.4 * max(float(np.log10(_EASY / sizing.rtol)), 0.0)
    evaluations = int(motions * ORDER * cells * harder)
    if machine.sets_its_speed:
        known = _motion(sizing).evaluations or extra
        evaluations = int((1.0 if motions == 1 else 1.3) * known * cells / (machine.mesh.size - 1))
    each = _newton(sizing, machine, piecewise.cells(own.mesh).phi, evaluations / motions)
    return Cost(evaluations, motions * each)


def _newton(sizing: Sizing, machine: Machine, phi: Array, evaluations: float) -> float:
    """Seconds that one motion by collocation takes on cells of positions (cells, nodes), with so many evaluations."""
    eps = sizing.scene.irregularity or (0.0 if sizing.run is None else sizing.run.irregularity)
    systems = _NEWTON * (1.0 + _WIDE * (0.5 * eps) ** 4) + _OF_CELL * len(phi)
    return systems * _system() + evaluations / phi.size * _walk(machine, phi)


def _system() -> float:
    """Seconds that a system of as many equations as a cell has nodes takes; the shortest of some."""
    matrix, right = np.eye(ORDER), np.ones(ORDER)
    return min(_timed(lambda: np.linalg.solve(matrix, right)) for _ in range(8))


def _motions(sizing: Sizing) -> int:
    return 1 if sizing.scene.inertia is not None else 2


def _walk(machine: Machine, phi: Array) -> float:
    """Seconds that one walk of the graph takes at positions (cells, nodes); the shorter of two."""
    anchor = phi[:, ORDER // 2][:, None]
    return min(_timed(lambda: machine.reduction(phi, anchor)) for _ in range(2))


def _timed(work: Callable[[], object]) -> float:
    begin = perf_counter()
    work()
    return perf_counter() - begin


# -- time stepping ---------------------------------------------------------------------------------------------------


def _stepping(sizing: Sizing, machine: Machine, cycle: Cycle) -> Cost:
    """Steps of order 8 through every smooth stretch, for both flywheels; for linkages implicit ones."""
    from flywheel.implicit import stiffness  # what time stepping would use

    degrees = [_degrees(run.cycle or cycle, run, run.speed or sizing.speed) for run in _runs(sizing, cycle)]
    if stiffness(machine) == 0.0:
        evaluations = int(_IMPLICIT * sum(float(degree.sum()) for degree in degrees))
        return Cost(evaluations, evaluations / _BATCH * _AROUND_BATCH * _batch(machine, sizing))
    looser = (max(_TIGHT * sizing.rtol, _TIGHTEST) / _TIGHTEST) ** (-1 / 8)
    followed = sum(float((degree - _UP_TO).clip(0).sum()) for degree in degrees)
    least = _OF_STEP * (machine.restarts.size - 1) + _TO_BEGIN
    total = _PER_DEGREE * looser * followed + least * len(degrees)
    instants = total * len(machine.stages)
    evaluations = int(instants * len(machine.stages))
    return Cost(evaluations, instants * (_instant(machine, sizing) + _AROUND * _system()))


def _runs(sizing: Sizing, cycle: Cycle) -> Iterator[Run]:
    """The motions that are stepped, as far as they are known without finding them."""
    exact = sizing.run or _by_areas(sizing, cycle)
    if exact is None:
        return
    yield exact
    figure = sizing.flywheel.approximate
    if figure is None:
        return
    try:
        inertia = figure * sizing.scene.flywheel_ratio**2
        yield exact if sizing.cyclic is not None else steady.run(cycle, sizing.speed, inertia)
    except NoMotionError:
        return


def _by_areas(sizing: Sizing, cycle: Cycle) -> Run | None:
    """The motion with the given flywheel or the middle of the bounds, from the areas' own cycle."""
    bounds, given = sizing.bounds, sizing.scene.inertia
    figure = given if given is not None else sizing.flywheel.approximate_total
    if given is None and bounds is not None:
        figure = 0.5 * (bounds.least + bounds.greatest)
    try:
        return steady.run(cycle, sizing.speed, (figure or 0.0) * sizing.scene.flywheel_ratio**2)
    except NoMotionError:
        return None


def _degrees(cycle: Cycle, run: Run, speed: float) -> NDArray[np.intp]:
    """The degree on each cell of the series of what is stepped: the slope of speed, and time, over angle."""
    mesh = cycle.mesh
    omega = steady.speed_over_cycle(cycle, speed, run, mesh.phi.ravel()).reshape(mesh.phi.shape)
    moment, slope, inertia = cycle.series @ piecewise.basis(piecewise.NODES, ORDER).T
    bend = (moment - 0.5 * omega**2 * slope) / ((run.inertia + inertia) * omega)
    found = np.zeros((2, len(omega)), dtype=np.intp)
    for row, values in enumerate((bend, 1.0 / omega)):
        size = np.abs(piecewise.fit(values))
        visible = size > _VISIBLE * max(float(size.max()), 1e-300)
        found[row] = np.where(visible, np.arange(ORDER), 0).max(axis=1)
    return np.asarray(found.max(axis=0))


def _instant(machine: Machine, sizing: Sizing) -> float:
    """Seconds that the machine takes at one position, speed and time."""
    dynamics, (low, high) = _dynamics(machine, sizing), machine.breakpoints[:2].tolist()
    middle = 0.5 * (low + high)
    return min(_timed(lambda: dynamics.at(middle, middle, sizing.speed)) for _ in range(4))


def _batch(machine: Machine, sizing: Sizing) -> float:
    """Seconds that the machine takes at all the instants of an implicit step."""
    from flywheel.instant import Anchor

    dynamics, (low, high) = _dynamics(machine, sizing), machine.breakpoints[:2].tolist()
    phi = np.linspace(low, high, _BATCH + 2)[1:-1]
    anchor, omega, time = Anchor(0.5 * (low + high), None, None), np.full(_BATCH, sizing.speed), np.zeros(_BATCH)
    return min(_timed(lambda: dynamics.along(phi, anchor, omega, time, 0.0, (low, high))) for _ in range(2))


def _dynamics(machine: Machine, sizing: Sizing) -> Dynamics:
    from flywheel.instant import Dynamics  # what time stepping would use

    inertia = sizing.run.inertia if sizing.run is not None else 1.0
    return Dynamics(machine, inertia, 0.0 if sizing.cycle is None else sizing.cycle.balance or 0.0)
