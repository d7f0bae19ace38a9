"""The flywheel for an irregularity: exact (Wittenbauer), approximate (areas), and how far each can be trusted."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel import piecewise, regime, steady
from flywheel.machine import Machine
from flywheel.piecewise import ROUNDING, Crossings
from flywheel.regime import Cycle, Extremes
from flywheel.results import (
    Area,
    Balance,
    Confirmation,
    Errors,
    Flywheel,
    ReducedInertia,
    Sizing,
)
from flywheel.scene import Scene
from flywheel.steady import NoMotionError, Run

Array = NDArray[np.float64]

# Rows of the functions H = a W + b I* whose extremes a sizing needs, by name
_WORK, _FAST, _SLOW, _TORQUE, _INERTIA = range(5)


def size(machine: Machine | Scene, rtol: float | None = None, *, simulate: bool = True) -> Sizing:
    """Size (or analyse) the flywheel of a machine, and confirm it by a time simulation unless told not to.

    Exact:        I = [max(W - z+ w²I*/2) - min(W - z- w²I*/2)]/(eps w²), z± = (1 ± eps/2)²
    Approximate:  I = (max W - min W)/(eps w²) - min I*
    with W(phi) the integral of M*, w the mean of extremes (rad/s), I* the reduced inertia (kg m²), eps the irregularity.

    Args:
        machine: a `Machine`, or a `Scene`, of which one is then built.
        rtol: relative accuracy asked of every figure; the scene's own if None.
        simulate: whether to confirm by time stepping; an analysis without it uses quadrature.

    Raises:
        SceneError: if the machine cannot run as the scene says (net work, balance without effect, values not finite).

    Source: F. Wittenbauer, Graphische Dynamik (1923); the energy balance over a cycle.

    >>> import flywheel
    >>> yoke = {"mechanism": {"type": "scotch-yoke", "crank": {"length": 0.5}, "yoke": {"mass": 20}},
    ...         "load": [{"on": "yoke", "force": 1000, "from": 0, "to": "180 deg"}],
    ...         "drive": {"torque": "balance"}, "regime": {"speed": "60 rpm"},
    ...         "flywheel": {"irregularity": 0.04}}
    >>> result = flywheel.size(flywheel.load(yoke), simulate=False)
    >>> f"{result.flywheel.exact:.9f} {result.flywheel.approximate:.9f}"
    '353.521427322 348.989396780'

    """
    scene = machine.scene if isinstance(machine, Machine) else machine
    asked = scene.rtol if rtol is None else rtol
    if scene.areas is not None:
        return _from_areas(scene, asked)
    if not isinstance(machine, Machine):
        machine = Machine(machine)
    figures, motion = _settled(machine, asked)
    sizing = _assembled(machine, figures, motion, asked)
    if simulate:
        from flywheel import confirmation

        return noted(confirmation.confirmed(sizing))
    return noted(sizing if scene.inertia is None else _by_quadrature(sizing))


class _Figures(NamedTuple):
    """A resolved cycle with the extremes of everything that a sizing compares, and the errors that follow."""

    cycle: Cycle
    extremes: Extremes
    crossings: Crossings  # of M* alone
    total: float  # I_exact + I*(0) before any floor; crank side
    error: float  # absolute, of `total` (kg m²)
    scale: float  # energy_fluctuation/(eps w²), or the figure's own where that is larger


def _settled(machine: Machine, rtol: float) -> tuple[_Figures, Run | None]:
    """Halve cells until every figure's estimated error is within rtol, or until halving cannot help."""
    edges = machine.mesh
    while True:
        cycle = regime.resolve(machine, edges)
        regime.check_closed(cycle, machine)
        figures = _figures(machine, cycle)
        motion = _motion(machine, figures)
        doubt = max(figures.error / figures.scale, _work_error(figures), motion.error if motion else 0.0)
        if doubt <= rtol:
            return figures, motion
        weight = 0.5 * machine.scene.speed**2 * (1 + (machine.scene.irregularity or 0.0) / 2) ** 2
        shares = cycle.errors.by_cell[0] + weight * cycle.errors.by_cell[1]
        finer = regime.split(cycle, shares, 0.25 * float(shares.sum()) * rtol / doubt)
        if finer is None:
            return figures, motion
        edges = finer


def _figures(machine: Machine, cycle: Cycle) -> _Figures:
    scene, square = machine.scene, machine.scene.speed**2
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
    extremes, found = regime.combined(cycle, rows)
    of_moment = slice(0, int(np.searchsorted(found.function, 1)))
    crossings = Crossings(found.function[of_moment], found.cell[of_moment], found.t[of_moment])
    fluctuation = float(extremes.greatest[_WORK] - extremes.least[_WORK])
    if not eps:
        return _Figures(cycle, extremes, crossings, 0.0, 0.0, 1.0)
    spread = float(extremes.greatest[_FAST] - extremes.least[_SLOW])
    error = (2 * cycle.errors.work + (1 + eps / 2) ** 2 * square * cycle.errors.variation) / (eps * square)
    total = spread / (eps * square)
    error += cycle.errors.inertia + 8 * ROUNDING * (abs(total) + cycle.inertia_at_start)
    exact = total - cycle.inertia_at_start
    scale = max(exact, fluctuation / (eps * square))
    if scale <= 4 * error:  # nothing but rounding: then the machine's own inertia is what a figure can be compared with
        scale = max(scale, float(np.abs(cycle.series[2]).sum(axis=-1).max()), 1e-300)
    return _Figures(cycle, extremes, crossings, total, error, scale)


def _work_error(figures: _Figures) -> float:
    exchanged = figures.cycle.exchanged
    return figures.cycle.errors.work / exchanged if exchanged > 0.0 else 0.0


def _motion(machine: Machine, figures: _Figures) -> Run | None:
    """The periodic motion with the exact flywheel (known in closed form), or with the given or no flywheel."""
    scene, cycle = machine.scene, figures.cycle
    ratio_square = scene.flywheel_ratio**2
    if scene.inertia is not None:
        return _run_or_fault(cycle, scene, scene.inertia * ratio_square)
    exact = figures.total - cycle.inertia_at_start
    if exact <= 0.0:
        return _run_or_fault(cycle, scene, 0.0)
    eps = scene.irregularity or 0.0
    # at the fastest point the energy is z+ w² (J + I*)/2, and z+ - 1 = eps + eps²/4: from it the level at phi = 0
    excess = eps * (1 + eps / 4)
    offset = 0.5 * scene.speed**2 * excess * figures.total - float(figures.extremes.greatest[_FAST])
    return Run(
        inertia=exact,
        irregularity=eps,
        speed_max=scene.speed * (1 + eps / 2),
        speed_min=scene.speed * (1 - eps / 2),
        angle_speed_max=float(figures.extremes.angle_greatest[_FAST]),
        angle_speed_min=float(figures.extremes.angle_least[_SLOW]),
        offset=offset,
        error=figures.error / max(figures.total, 1e-300),
    )


def _run_or_fault(cycle: Cycle, scene: Scene, inertia: float) -> Run | None:
    from flywheel.faults import Fault, SceneError

    least = inertia + cycle.inertia_at_start + float(regime.combined(cycle, np.array([[0.0, 1.0]]))[0].least[0])
    if least <= cycle.errors.inertia and inertia == 0.0 and scene.inertia is None:
        return None  # nothing moves that could store energy, and nothing acts
    try:
        if least <= cycle.errors.inertia:
            raise NoMotionError
        return steady.run(cycle, scene.speed, inertia)
    except NoMotionError:
        path = "flywheel.inertia" if scene.inertia is not None else "regime.speed"
        found = f"a machine that stops within the cycle at {scene.speed:.6g} rad/s (mean of extremes)"
        raise SceneError(
            [Fault(path, found, "enough inertia to turn through the whole cycle", "give a larger inertia or speed")]
        ) from None


def _assembled(machine: Machine, figures: _Figures, motion: Run | None, rtol: float) -> Sizing:
    scene, cycle, extremes = machine.scene, figures.cycle, figures.extremes
    fluctuation = float(extremes.greatest[_WORK] - extremes.least[_WORK])
    drive_work = _drive_work(machine, cycle)
    no_work = drive_work is None or abs(drive_work) <= cycle.errors.work
    errors = _error_figures(figures, scene, motion)
    return Sizing(
        scene=scene,
        speed=scene.speed,
        balance=_balance(scene, cycle),
        power=None if drive_work is None else drive_work * scene.speed / scene.cycle,
        drive_work=drive_work,
        areas=_areas(figures),
        accumulated_max=float(extremes.greatest[_WORK]),
        accumulated_min=float(extremes.least[_WORK]),
        energy_fluctuation=fluctuation,
        coefficient_of_energy=None if no_work else fluctuation / (drive_work or 1.0),
        angle_speed_max=motion and motion.angle_speed_max,
        angle_speed_min=motion and motion.angle_speed_min,
        reduced_inertia=_reduced_inertia(figures),
        flywheel=_flywheel(figures, scene),
        simulation=None,
        error=errors,
        closure=abs(cycle.net) / cycle.exchanged if cycle.exchanged else 0.0,
        rtol=rtol,
        machine=machine,
        cycle=cycle,
        run=motion,
    )


def noted(sizing: Sizing) -> Sizing:
    """The sizing with a message for every figure whose estimated error is above rtol."""
    from dataclasses import replace

    names = {"exact": "exact inertia", "approximate": "approximate inertia", "work": "work", "simulation": "simulation"}
    missed = [
        f"rtol {sizing.rtol:.1g} not reached: the {title} is good to {error:.2g} (estimated, relative)"
        for name, title in names.items()
        if (error := getattr(sizing.error, name)) is not None and error > sizing.rtol
    ]
    return replace(sizing, messages=(*missed, *sizing.messages)) if missed else sizing


def _error_figures(figures: _Figures, scene: Scene, motion: Run | None) -> Errors:
    cycle = figures.cycle
    if scene.irregularity is None:
        return Errors(simulation=motion and motion.error, work=_work_error(figures), angles=_angle_error(figures, motion))
    unit = scene.irregularity * scene.speed**2
    approximate = 2 * cycle.errors.work / unit + cycle.errors.inertia
    torque = (2 * cycle.errors.work + scene.speed**2 * cycle.errors.variation) / unit
    scale = figures.scale
    return Errors(
        exact=figures.error / scale,
        approximate=approximate / scale,
        inertia_torque=torque / scale,
        work=_work_error(figures),
        angles=_angle_error(figures, motion),
    )


def _angle_error(figures: _Figures, motion: Run | None) -> float:
    """Error (rad) of the crossing angles and of the angles of extreme speed.

    Each is a root of M* - factor dI*/dphi, off by that function's own error over its slope; where the root is the end of
    a cell the moment jumps through zero, or the cycle ends, and only rounding is left.
    """
    cycle, found = figures.cycle, figures.crossings
    cell, t, factor = found.cell, found.t, np.zeros_like(found.t)
    if motion is not None:
        speeds = np.array([motion.speed_max, motion.speed_min])
        extreme_cell, extreme_t = cycle.where(np.array([motion.angle_speed_max, motion.angle_speed_min]))
        cell, t = np.concatenate((cell, extreme_cell)), np.concatenate((t, extreme_t))
        factor = np.concatenate((factor, 0.5 * speeds**2))
    half = cycle.mesh.half[cell, 0]
    rows = cycle.series[0, cell] - factor[:, None] * cycle.series[1, cell]
    slope = np.maximum(np.abs(piecewise.slope(rows, t)) / half, 1e-300)
    noise = cycle.noise[0, cell] + factor * cycle.noise[1, cell] + cycle.errors.work / cycle.mesh.edges[-1]
    doubt = np.where(np.abs(t) < 1.0, np.minimum(noise / slope, 2 * half), 0.0)
    return 4 * ROUNDING * float(cycle.mesh.edges[-1]) + float(doubt.max(initial=0.0))


def _balance(scene: Scene, cycle: Cycle) -> Balance | None:
    if scene.unknown is None or cycle.balance is None:
        return None
    error = cycle.errors.work / cycle.exchanged if cycle.exchanged else 0.0
    return Balance(scene.unknown, cycle.balance, error)


def _areas(figures: _Figures) -> tuple[Area, ...]:
    """Areas of M* between its sign changes, from phi = 0 to the cycle's end."""
    cycle = figures.cycle
    angles = figures.crossings.angles(cycle.mesh)
    work, _ = cycle.at(figures.crossings.cell, figures.crossings.t)
    bounds = [0.0, *angles.tolist(), float(cycle.mesh.edges[-1])]
    sums = [0.0, *work.tolist(), cycle.net]
    return tuple(
        Area(a, b, end - start, end) for a, b, start, end in zip(bounds[:-1], bounds[1:], sums[:-1], sums[1:], strict=True)
    )


def _reduced_inertia(figures: _Figures) -> ReducedInertia:
    cycle, extremes = figures.cycle, figures.extremes
    start, mesh = cycle.inertia_at_start, cycle.mesh
    mean = float((cycle.series[2] @ piecewise.MEAN * mesh.half[:, 0]).sum() / mesh.edges[-1])
    least = max(start + float(extremes.least[_INERTIA]), 0.0)
    return ReducedInertia(least, start + float(extremes.greatest[_INERTIA]), mean)


def _flywheel(figures: _Figures, scene: Scene) -> Flywheel:
    eps, ratio_square = scene.irregularity, scene.flywheel_ratio**2
    if eps is None:
        return Flywheel(scene.flywheel_on, scene.inertia, None, None, None, None, None)
    extremes, unit = figures.extremes, eps * scene.speed**2
    inertia = _reduced_inertia(figures)
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


def _drive_work(machine: Machine, cycle: Cycle) -> float | None:
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
    torque = machine.reduction.moments(mesh.phi, mesh.anchor, cycle.balance or 0.0)["drive"]
    return float(piecewise.integral(torque + np.zeros_like(mesh.phi), mesh.half).sum())


def _by_quadrature(sizing: Sizing) -> Sizing:
    """The confirmation of an analysis without time stepping: irregularity in closed form, time by quadrature."""
    from dataclasses import replace

    machine, cycle, motion = sizing.machine, sizing.cycle, sizing.run
    if machine is None or cycle is None or motion is None:
        return sizing
    period, doubt = steady.period(machine, cycle, sizing.speed, motion, sizing.rtol)
    errors = sizing.error._replace(simulation=max(motion.error, doubt), period=doubt)
    confirmation = Confirmation(
        irregularity=motion.irregularity,
        irregularity_approximate=None,
        speed_max=motion.speed_max,
        speed_min=motion.speed_min,
        speed_time_mean=sizing.scene.cycle / period,
        period=period,
        closure=sizing.closure,
        route="quadrature",
    )
    return replace(sizing, simulation=confirmation, error=errors)


def _from_areas(scene: Scene, rtol: float) -> Sizing:
    """Sizing from the areas of a turning-moment diagram: the machine's own inertia is not known and left out."""
    assert scene.areas is not None
    works = np.array(scene.areas.values) * scene.areas.scale
    sums = np.concatenate(([0.0], works.cumsum()))
    swing = float(np.ptp(sums))
    eps, square = scene.irregularity, scene.speed**2
    figure = None if eps is None else swing / (eps * square) / scene.flywheel_ratio**2
    needed = None if eps is None else swing > 0.0
    rounding = 4 * ROUNDING * (float(np.abs(works).sum()) / swing if swing else 0.0)
    return Sizing(
        scene=scene,
        speed=scene.speed,
        balance=None,
        power=None,
        drive_work=None,
        areas=tuple(Area(None, None, w, s) for w, s in zip(works.tolist(), sums[1:].tolist(), strict=True)),
        accumulated_max=float(sums.max()),
        accumulated_min=float(sums.min()),
        energy_fluctuation=swing,
        coefficient_of_energy=None,
        angle_speed_max=None,
        angle_speed_min=None,
        reduced_inertia=None,
        flywheel=Flywheel(scene.flywheel_on, scene.inertia, figure, figure, figure, figure, needed),
        simulation=None if scene.inertia is None else _swing_of(scene, swing),
        error=Errors(exact=figure and rounding, simulation=None if scene.inertia is None else rounding, work=rounding),
        closure=abs(float(works.sum())) / swing if swing else 0.0,
        rtol=rtol,
    )


def _swing_of(scene: Scene, swing: float) -> Confirmation:
    """Irregularity from the swing of energy alone: eps = swing/(J w²)."""
    from flywheel.faults import Fault, SceneError

    inertia = (scene.inertia or 0.0) * scene.flywheel_ratio**2
    eps = swing / (inertia * scene.speed**2) if inertia else np.inf
    if eps >= 2.0:
        found = f"{scene.inertia} kg m², which the swing of {swing:.6g} J would stop"
        raise SceneError([Fault("flywheel.inertia", found, "enough inertia to keep turning", "give a larger one")])
    return Confirmation(eps, None, scene.speed * (1 + eps / 2), scene.speed * (1 - eps / 2), None, None, None, "areas")
