"""Wittenbauer's exact flywheel and the approximate ones, from one resolved cycle, each with its error."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.machine.machine import Machine
from flywheel.numerics import cells
from flywheel.numerics.cells import ROUNDING, Coarse, Crossings
from flywheel.numerics.faults import Fault, SceneError
from flywheel.regime import steady_motion, turning_moment
from flywheel.regime.results import Area, Balance, Errors, Flywheel, ReducedInertia, Sizing
from flywheel.regime.steady_motion import NoMotionError, Run, error_of_crossings, error_of_extremes
from flywheel.regime.turning_moment import Cycle, Extent, Extremes
from flywheel.scene.scene import Scene

Array = NDArray[np.float64]

# Rows of the functions H = a W + b I* whose extremes a sizing needs, by name
_WORK, _FAST, _SLOW, _TORQUE, _INERTIA = range(5)


def settled(machine: Machine, rtol: float) -> Sizing:
    """All figures of a machine's sizing or analysis that need no simulation, at estimated errors within rtol.

    For machines whose torques depend on position alone. Raises SceneError if the machine cannot run as its scene says.
    """
    speed = machine.scene.speed
    assert speed is not None, "torques that depend on position alone do not set a speed"
    figures, motion = resolved_figures(machine, speed, rtol)
    return assembled(machine, figures, motion, rtol)


class Figures(NamedTuple):
    """A resolved cycle with the extremes of everything that a sizing compares, and the errors that follow.

    `speed` (rad/s) is the mean of extremes that the figures hold for.
    """

    cycle: Cycle
    speed: float
    extremes: Extremes
    crossings: Crossings  # of M* alone
    total: float  # I_exact + I*(0) before any floor; crank side
    error: float  # absolute, of `total` (kg m²)
    scale: float  # energy_fluctuation/(eps w²), or the figure's own where that is larger
    extent: Extent  # of I* without the flywheel


def resolved_figures(machine: Machine, speed: float, rtol: float) -> tuple[Figures, Run | None]:
    """The figures of loads that depend on position alone, and the motion that they give."""

    def resolver(edges: Array) -> Cycle:
        cycle = turning_moment.resolve(machine, edges)
        turning_moment.check_closed(cycle, machine)
        return cycle

    return refined(machine, resolver, speed, rtol, lambda figures: _motion(machine, figures))


def refined(
    machine: Machine,
    resolver: Callable[[Array], Cycle],
    speed: float,
    rtol: float,
    motion_of: Callable[[Figures], Run | None],
) -> tuple[Figures, Run | None]:
    """Halve cells until every figure's estimated error is within rtol, or until halving no longer helps."""

    def evaluated(edges: Array) -> tuple[tuple[Cycle, Figures, Run | None], float, Coarse]:
        whole = resolver(edges)
        cycle = whole._replace(errors=whole.errors._replace(residual=0.0))  # no cell can mend what is left over
        figures = _figures(machine.scene, cycle, speed)
        if not np.isfinite(figures.total) or not np.isfinite(figures.error):
            raise SceneError([_out_of_range(figures)])
        motion = motion_of(figures)
        doubt = max(figures.error / figures.scale, work_error(cycle), motion.error if motion else 0.0)
        doubt = max(doubt, _approximate_error(figures, machine.scene), _torque_flywheel_error(figures, machine.scene))
        doubt = max(doubt, _inertia_error(cycle))
        return (whole, figures, motion), doubt, turning_moment.coarse(cycle, fastest)

    fastest = speed * (1 + (machine.scene.irregularity or 0.0) / 2)
    whole, figures, motion = cells.refined(machine.mesh, evaluated, 0.5 * rtol)  # half is left to the simulation
    if not whole.errors.residual:
        return figures, motion
    figures = _figures(machine.scene, whole, speed)
    return figures, motion_of(figures)


def _out_of_range(figures: Figures) -> Fault:
    found = f"a flywheel of {figures.total:g} kg m²"
    return Fault("flywheel.irregularity", found, "a figure within the floating-point range", "check the scene's units")


def _figures(scene: Scene, cycle: Cycle, speed: float) -> Figures:
    square = speed**2
    eps = scene.irregularity or 0.0
    rows = np.array(
        [
            [1.0, 0.0],
            [1.0, -0.5 * (1 + eps / 2) ** 2 * square],
            [1.0, -0.5 * (1 - eps / 2) ** 2 * square],
            [1.0, -0.5 * square],
            [0.0, 1.0],
        ]
    )
    extremes, found = turning_moment.combined(cycle, rows)
    of_moment = slice(0, int(np.searchsorted(found.function, 1)))
    crossings = Crossings(found.function[of_moment], found.cell[of_moment], found.t[of_moment])
    fluctuation = float(extremes.greatest[_WORK] - extremes.least[_WORK])
    extent = turning_moment.inertia_extent(cycle)
    if not eps:
        return Figures(cycle, speed, extremes, crossings, 0.0, 0.0, 1.0, extent)
    spread = float(extremes.greatest[_FAST] - extremes.least[_SLOW])
    unit = max(eps * square, 5e-324)
    error = (2 * cycle.errors.work + (1 + eps / 2) ** 2 * square * cycle.errors.variation) / unit
    total = spread / unit
    error += cycle.errors.inertia + 8 * ROUNDING * (abs(total) + cycle.inertia_at_start)
    exact = total - cycle.inertia_at_start
    scale = max(exact, fluctuation / unit)
    if scale <= 4 * error:  # nothing but rounding: compare it with the inertia and the work at hand
        inertia = float(np.abs(cycle.series[2]).sum(axis=-1).max())
        scale = max(scale, inertia, cycle.exchanged / unit, 1e-300)
    error += cycle.errors.residual / unit
    if exact < -error:  # the machine's own inertia suffices, whatever rounding did: the figure is 0
        error = 0.0
    return Figures(cycle, speed, extremes, crossings, total, error, scale, extent)


def work_error(cycle: Cycle) -> float:
    """Error of a cycle's works as a share of the work exchanged."""
    return (cycle.errors.work + cycle.errors.residual) / cycle.exchanged if cycle.exchanged > 0.0 else 0.0


def _motion(machine: Machine, figures: Figures) -> Run | None:
    """The periodic motion with the exact flywheel (known in closed form), or with the given or no flywheel."""
    scene, cycle = machine.scene, figures.cycle
    ratio_square = scene.flywheel_ratio**2
    if scene.inertia is not None:
        return _run_or_fault(machine, cycle, figures.speed, scene.inertia * ratio_square)
    exact = figures.total - cycle.inertia_at_start
    if exact <= 0.0:
        return _run_or_fault(machine, cycle, figures.speed, 0.0)
    eps = scene.irregularity or 0.0
    # at the fastest point the energy is z+ w² (J + I*)/2, and z+ - 1 = eps + eps²/4: from it the level at phi = 0
    excess = eps * (1 + eps / 4)
    offset = 0.5 * figures.speed**2 * excess * figures.total - float(figures.extremes.greatest[_FAST])
    return Run(
        inertia=exact,
        irregularity=eps,
        speed_max=figures.speed * (1 + eps / 2),
        speed_min=figures.speed * (1 - eps / 2),
        angle_speed_max=float(figures.extremes.angle_greatest[_FAST]),
        angle_speed_min=float(figures.extremes.angle_least[_SLOW]),
        offset=offset,
        error=figures.error / max(figures.total, 1e-300),
    )


def _run_or_fault(machine: Machine, cycle: Cycle, speed: float, inertia: float) -> Run | None:
    scene, extent = machine.scene, turning_moment.inertia_extent(cycle)
    if extent.least <= extent.error and inertia == 0.0 and scene.inertia is None:
        return None  # nothing moves that could store energy, and nothing acts
    turning_moment.check_weighs(machine, cycle, inertia)
    try:
        return steady_motion.run(cycle, speed, inertia)
    except NoMotionError:
        path = "flywheel.inertia" if scene.inertia is not None else "regime.speed"
        found = f"a machine that stops within the cycle at {speed:.6g} rad/s (mean of extremes)"
        raise SceneError(
            [Fault(path, found, "enough inertia to turn through the whole cycle", "give a larger inertia or speed")]
        ) from None


def assembled(machine: Machine, figures: Figures, motion: Run | None, rtol: float) -> Sizing:
    """The sizing that follows from the figures and the motion with the exact, given or no flywheel.

    A motion that brings its own cycle and speed (torques depend on speed) tells the speed and the work of the drive.
    """
    scene, extremes = machine.scene, figures.extremes
    cycle = (motion and motion.cycle) or figures.cycle
    speed = (motion and motion.speed) or figures.speed
    fluctuation = float(extremes.greatest[_WORK] - extremes.least[_WORK])
    drive_work = _drive_work(machine, cycle, motion, speed)
    if drive_work is not None and abs(drive_work) <= cycle.errors.work:
        drive_work = 0.0
    return Sizing(
        scene=scene,
        speed=speed,
        balance=_balance(scene, cycle),
        power=None if drive_work is None else drive_work * speed / scene.cycle,
        drive_work=drive_work,
        areas=_areas(figures),
        accumulated_max=float(extremes.greatest[_WORK]),
        accumulated_min=float(extremes.least[_WORK]),
        energy_fluctuation=fluctuation,
        coefficient_of_energy=fluctuation / drive_work if drive_work else None,
        angle_speed_max=motion and motion.angle_speed_max,
        angle_speed_min=motion and motion.angle_speed_min,
        reduced_inertia=reduced_inertia(figures),
        flywheel=flywheel(figures, scene),
        simulation=None,
        error=_error_figures(figures, scene, motion),
        closure=abs(cycle.net) / cycle.exchanged if cycle.exchanged else 0.0,
        rtol=rtol,
        machine=machine,
        cycle=cycle,
        run=motion,
    )


def _error_figures(figures: Figures, scene: Scene, motion: Run | None) -> Errors:
    cycle, sized = figures.cycle, scene.irregularity is not None
    angles = error_of_crossings(cycle, figures.crossings)
    extremes = None if motion is None else error_of_extremes(cycle, motion, sized=sized)
    if not sized:
        return Errors(simulation=motion and motion.error, work=work_error(cycle), angles=angles, extremes=extremes)
    by_torque = _torque_error(figures, scene)
    return Errors(
        exact=figures.error / figures.scale or by_torque,  # an exact 0 leaves the doubt of the figure nearest to it
        approximate=_approximate_error(figures, scene),
        inertia_torque=by_torque,
        inertia_torque_flywheel=_torque_flywheel_error(figures, scene),
        work=work_error(cycle),
        angles=angles,
        extremes=extremes,
    )


def _inertia_error(cycle: Cycle) -> float:
    """Error of the extremes of I*, relative to the greatest."""
    greatest = float(np.abs(cycle.series[2]).sum(axis=-1).max())
    return min(cycle.errors.inertia, cycle.errors.variation) / greatest if greatest > 0.0 else 0.0


def _approximate_error(figures: Figures, scene: Scene) -> float:
    """Error of the approximate flywheels, relative to that of the areas."""
    if scene.irregularity is None:
        return 0.0
    errors, unit = figures.cycle.errors, scene.irregularity * figures.speed**2
    total = float(figures.extremes.greatest[_WORK] - figures.extremes.least[_WORK]) / unit
    of_total = 2 * errors.work / unit
    least, _, doubt, _ = figures.extent
    error = of_total + doubt + min(doubt, errors.variation)  # as `reduced_inertia` has it, by the one way or the other
    if total - least < -error:  # then the approximate one is 0, and only the total is in doubt
        error = of_total
    return _relative(error, 0.0, figures, unit)


def _torque_error(figures: Figures, scene: Scene) -> float:
    """Error of the flywheel by the inertia torque, relative to the larger of itself and that of the areas."""
    if scene.irregularity is None:
        return 0.0
    errors, unit = figures.cycle.errors, scene.irregularity * figures.speed**2
    torque = float(figures.extremes.greatest[_TORQUE] - figures.extremes.least[_TORQUE]) / unit
    return _relative((2 * errors.work + figures.speed**2 * errors.variation) / unit, torque, figures, unit)


def _torque_flywheel_error(figures: Figures, scene: Scene) -> float:
    """The same without the machine's least inertia: where that leaves nothing, the error of the total."""
    if scene.irregularity is None:
        return 0.0
    errors, unit = figures.cycle.errors, scene.irregularity * figures.speed**2
    total = float(figures.extremes.greatest[_TORQUE] - figures.extremes.least[_TORQUE]) / unit
    of_total = (2 * errors.work + figures.speed**2 * errors.variation) / unit
    least, _, doubt, _ = figures.extent
    error = of_total + doubt + min(doubt, errors.variation)
    figure = max(total - least, 0.0)
    return _relative(of_total if total - least < -error else error, figure, figures, unit)


def _relative(error: float, figure: float, figures: Figures, unit: float) -> float:
    """An error relative to the larger of a figure and energy_fluctuation/unit; if these are rounding, to what is at hand.

    What the cycle leaves over is added to it.
    """
    scale = max(figure, float(figures.extremes.greatest[_WORK] - figures.extremes.least[_WORK]) / unit)
    scale = scale if scale > 4 * error else max(scale, figures.scale)
    return (error + figures.cycle.errors.residual / unit) / scale


def _balance(scene: Scene, cycle: Cycle) -> Balance | None:
    if scene.unknown is None or cycle.balance is None:
        return None
    return Balance(scene.unknown, cycle.balance, cycle.balance_error)


def _areas(figures: Figures) -> tuple[Area, ...]:
    """Areas of M* between its sign changes, from phi = 0 to the cycle's end."""
    cycle = figures.cycle
    angles = figures.crossings.angles(cycle.mesh)
    work, _ = cycle.at(figures.crossings.cell, figures.crossings.t)
    bounds = [0.0, *angles.tolist(), float(cycle.mesh.edges[-1])]
    sums = [0.0, *work.tolist(), cycle.net]
    return tuple(
        Area(a, b, end - start, end) for a, b, start, end in zip(bounds[:-1], bounds[1:], sums[:-1], sums[1:], strict=True)
    )


def reduced_inertia(figures: Figures) -> ReducedInertia:
    """I* without the flywheel over the cycle: extremes by its slope, summed up, or by its own series, as is known better.

    A sum keeps the small variation of a large I*, and loses the least I* beside a peak.
    """
    cycle, extremes = figures.cycle, figures.extremes
    mean = float((cycle.series[2] @ cells.MEAN * cycle.mesh.half[:, 0]).sum() / cycle.mesh.edges[-1])
    least, greatest, error, greatest_error = figures.extent
    if cycle.errors.variation <= error:
        least = cycle.inertia_at_start + float(extremes.least[_INERTIA])
    if cycle.errors.variation <= greatest_error:
        greatest = cycle.inertia_at_start + float(extremes.greatest[_INERTIA])
    return ReducedInertia(max(least, 0.0), greatest, mean)


def flywheel(figures: Figures, scene: Scene) -> Flywheel:
    """The flywheels, exact and approximate, at the flywheel's own shaft (kg m²)."""
    eps, ratio_square = scene.irregularity, scene.flywheel_ratio**2
    if eps is None:
        return Flywheel(scene.flywheel_on, scene.inertia, None, None, None, None, None, None)
    extremes, unit = figures.extremes, eps * figures.speed**2
    inertia = reduced_inertia(figures)
    swing = extremes.greatest - extremes.least
    total = float(swing[_WORK]) / unit
    exact = figures.total - figures.cycle.inertia_at_start
    torque = max(float(swing[_TORQUE]) / unit, 0.0)
    by_areas = certificate(total, inertia, eps)
    by_torque = (torque - inertia.greatest, torque - inertia.least)  # both shifts of H = W - w²I*/2 add up to eps w²I*
    return Flywheel(
        on=scene.flywheel_on,
        inertia=None,
        exact=max(exact, 0.0) / ratio_square,
        approximate=max(total - inertia.least, 0.0) / ratio_square,
        approximate_total=total / ratio_square,
        inertia_torque=torque / ratio_square,
        inertia_torque_flywheel=max(torque - inertia.least, 0.0) / ratio_square,
        needed=exact > 0.0,
        bracket=(by_areas[0] / ratio_square, by_areas[1] / ratio_square),
        torque_bracket=(by_torque[0] / ratio_square, by_torque[1] / ratio_square),
    )


def certificate(approximate_total: float, inertia: ReducedInertia, irregularity: float) -> tuple[float, float]:
    """Bounds (kg m²) proven for the exact flywheel, given the approximate total one.

    (z- min I* - z+ max I*)/(2 eps) <= I_exact - I_approximate_total <= (z- max I* - z+ min I*)/(2 eps), z± = (1 ± eps/2)²

    Args:
        approximate_total: (max W - min W)/(eps w²), kg m², on the crank.
        inertia: reduced inertia of the machine over the cycle, kg m².
        irregularity: eps, 0 < eps < 2.

    Valid for any I*(phi) within its extremes; the bounds meet where I* is constant and eps tends to 0.
    Source: max and min over a cycle of a sum lie between the sums of extremes.

    >>> certificate(10.0, ReducedInertia(2.0, 2.0, 2.0), 0.1)
    (8.0, 8.0)

    """
    # z- a - z+ b = (1 + eps²/4)(a - b) - eps (a + b): written so, nothing cancels for a small eps
    spread = (1 + irregularity**2 / 4) * (inertia.greatest - inertia.least) / (2 * irregularity)
    middle = approximate_total - 0.5 * (inertia.greatest + inertia.least)
    return middle - spread, middle + spread


def _drive_work(machine: Machine, cycle: Cycle, motion: Run | None, speed: float) -> float | None:
    """Work (J) of the drive over the cycle; None without a drive."""
    drive = machine.scene.drive
    if drive is None:
        return None
    ratio = machine.scene.shafts[drive.on]
    if drive.law is None:
        return (cycle.balance or 0.0) * ratio * machine.scene.cycle
    if isinstance(drive.law, float | int):
        return drive.law * ratio * machine.scene.cycle
    mesh = cycle.mesh
    if motion is not None and motion.drive is not None:
        return float(cells.integral(motion.drive, mesh.half).sum())
    pace = speed if machine.depends_on_speed else None
    torque = machine.reduction.moments(mesh.phi, mesh.anchor, cycle.balance or 0.0, speed=pace)["drive"]
    return float(cells.integral(torque + np.zeros_like(mesh.phi), mesh.half).sum())
