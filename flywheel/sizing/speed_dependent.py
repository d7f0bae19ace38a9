"""Sizing and analysis of machines whose torques depend on speed, or whose meshes have losses.

The exact figures are those of the periodic motion itself, solved together with the flywheel, the energy level and the
balance. The areas and the approximate flywheels take the torques at a constant crank speed.
"""

from __future__ import annotations

import numpy as np

from bondgraph.numerics import roots_between
from flywheel.machine.equation import Moments, moments_on
from flywheel.machine.machine import Machine, circuit_of
from flywheel.numerics import cells
from flywheel.numerics.budget import BudgetError, Cost, Meter, counted, limited
from flywheel.numerics.cells import ROUNDING, Array, Cells, Coarse
from flywheel.numerics.faults import Fault, SceneError
from flywheel.regime import constant_speed, periodic_motion, turning_moment, wittenbauer
from flywheel.regime.branch import Branch, MotionSearch, Outcome, OutOfStepError, UnstableError, outcome_of, stable_motion
from flywheel.regime.cycle_equations import Demand, LostError, NoRegimeError, UnresolvedError
from flywheel.regime.periodic_motion import OwnMotion
from flywheel.regime.turning_moment import Cycle, Run
from flywheel.regime.wittenbauer import Figures
from flywheel.sizing import limits
from flywheel.sizing.motor import of_motor
from flywheel.sizing.results import Confirmation, Confirmed, Regime, Stability

_LEAST_DAMPING = 1e-12  # of 1 less the multiplier: below it the speed is fixed by rounding alone
_UNHELD = 0.01  # relative error of a speed that the torques hardly fix
_LESS_WORK = 40_000.0
_MOST_CELLS = 4_000  # of cells on which speeds follow torques at once
_WIDENINGS = 60  # of a bracket
_STEEP = 1e4  # decay times of a change of speed within a cycle: steeper torques need too many cells
_NO_INERTIA = 1e-4  # of the greatest inertia: a smaller one is negligible
_MANY = 200  # cells that the laws need
_LIGHT = 1e-3  # of the machine's own inertia: the least start of the iteration for a flywheel


def regime(machine: Machine, rtol: float) -> tuple[Regime, dict[str, Cost]]:
    """The steady regime of such a machine, its figures with estimated errors within rtol, and the cost of the motion.

    Raises:
        SceneError: if it has no steady motion, with the reason: no torque fixes the speed, the drive cannot carry the
            mean load, it stops within the cycle, it is unstable.

    """
    scene = machine.scene
    constant_speed.check_steady(machine)
    try:
        with limited(periodic_motion.MOST_WORK):
            speed, unknown, messages = constant_speed.reference_point(machine)
    except BudgetError as error:
        raise SceneError([_too_much(error.faults[0], machine, machine.typical_speed, scene.inertia or 0.0, 0.0)]) from None
    figures, loose = at_constant_speed(machine, speed, rtol)
    start = figures.cycle.balance if figures.cycle.balance is not None else unknown
    inertialess = float(np.abs(figures.cycle.series[2]).max()) <= figures.cycle.errors.inertia
    if inertialess and (balanced := _inertialess_run(machine, speed, start, rtol)) is not None:
        alone = _inertialess_regime(machine, figures, *balanced, rtol, messages)
        if (kept := limits.kept_alone(alone, balanced[1])) is not None:
            return alone._replace(limits=kept), {}
    idle = inertialess and scene.inertia is None and figures.fluctuation <= 4 * figures.cycle.errors.work
    if idle and not of_motor(scene):
        return Regime(machine, rtol, figures, None, None, figures.cycle, figures.speed, messages=messages), {}
    with counted() as tally:
        meter = Meter(tally)
        swings = scene.irregularity is not None and circuit_of(scene) is not None
        sized = scene.inertia is None
        motion = None if sized and (of_motor(scene) or swings) else _motion(machine, figures, start, rtol)
        if motion is None or (sized and scene.irregularity is not None and _unstable(motion)):
            motion, off, reached, binding, broken, gaps = _smallest(machine, figures, start, rtol)
        else:
            off = motion.inertia_error if motion.inertia > 0.0 else motion.run.error
            reached, binding, broken, gaps = {}, None, (), ()
    run, solved, messages = motion.run, motion.solved, (*messages, *gaps)
    if motion.vanishing:
        least = turning_moment.combined(figures.cycle, np.array([[0.0, 1.0]]))[0].angle_least[0]
        where = machine.where(float(least))
        messages = (
            *messages,
            f"without a flywheel the inertia is zero at {where}: the motion is the limit for ever lighter flywheels",
        )
    growth = f"a disturbance grows {solved.multiplier:.6g}-fold in a cycle"
    if solved.damping < -_LEAST_DAMPING:
        if scene.unknown is None:
            unstable = f"an unstable regime at {motion.speed:.6g} rad/s: {growth}"
            expected, advice = "a regime to which the machine returns", "let the drive's torque fall with speed"
            raise SceneError([Fault("drive", unstable, expected, advice)])
        messages = (*messages, f"at its balance this regime is unstable: {growth}; it needs a governor")
    if scene.unknown is None and scene.speed is not None:
        share = f"{100 * (motion.speed / scene.speed - 1):+.4g} %"
        messages = (
            *messages,
            f"the machine runs at {motion.speed:.10g} rad/s (mean of extremes), {share} from the required speed",
        )
    steady = Regime(
        machine=machine,
        rtol=rtol,
        figures=figures,
        motion=run,
        run=run,
        cycle=run.cycle or figures.cycle,
        speed=run.speed or figures.speed,
        cyclic=Stability(solved.multiplier, solved.damping, solved.steps, motion.level_error, figures.speed, loose),
        exact=(max(motion.inertia, 0.0), off),
        broken=broken,
        extremes_error=_error_of_extremes(motion),
        limits=reached,
        binding=binding,
        messages=messages,
        solved=motion,
    )
    return steady, {"motion": meter.cost}


def at_constant_speed(machine: Machine, speed: float, rtol: float) -> tuple[Figures, float]:
    """The figures at a constant speed (rad/s), and the relative error of that speed if the torques set it."""

    def figures_at(speed: float) -> Figures:
        return wittenbauer.refined(machine, lambda edges: constant_speed.resolve(machine, edges, speed), speed, rtol)[0]

    figures = figures_at(speed)
    if machine.scene.unknown is not None:
        return figures, 0.0
    closer, loose = constant_speed.closed_cycle_speed(machine, figures.cycle, speed)
    return (figures if closer == speed else figures_at(closer)), loose


def _error_of_extremes(motion: OwnMotion) -> float:
    """Error (rad) of the angles of extreme speed, by errors of speed and, where the motion itself cuts cells, of these cuts.

    d phi = (|dF/d omega| + omega |dI*/dphi|) d omega/|d(M* - omega² dI*/dphi/2)/dphi| at a root inside a cell, at most the
    width of the cell.
    """
    run, rate, mesh = motion.run, motion.solved.rate, motion.solved.moments.mesh
    cycle = run.cycle
    assert cycle is not None
    speeds, places = np.array([[run.speed_max, run.speed_min], [run.angle_speed_max, run.angle_speed_min]])
    cell, t = cells.located(cycle.mesh, places)
    half = mesh.half.take(cell)
    rising = cycle.series[1].take(cell, axis=0)
    rows = cycle.series[0].take(cell, axis=0) - 0.5 * speeds[:, None] ** 2 * rising
    by_speed = cells.value(cells.fit(rate.by_speed).take(cell, axis=0), t)
    of_speed = speeds * (0.5 * run.irregularity * run.error + motion.level_error + 8 * ROUNDING)
    off = (np.abs(by_speed) + speeds * np.abs(cells.value(rising, t))) * of_speed
    errors = np.minimum(off * half / np.maximum(np.abs(cells.slope(rows, t)), 1e-300), 2.0 * half)
    edges = motion.solved.moments.machine.mesh
    cut = np.isin(places, motion.solved.moments.mesh.edges) & (
        np.abs(places[:, None] - edges).min(axis=1) > 1e-9 * edges[-1]
    )
    return float(errors[np.abs(t) < 1.0].max(initial=0.0)) + (motion.cuts_error if cut.any() else 0.0)


# -- machines without inertia ------------------------------------------------------------------------------------------


def _inertialess_run(machine: Machine, speed: float, unknown: float, rtol: float) -> tuple[Run, Array] | None:
    """The run of a machine without inertia, M*(phi, omega) = 0: at every angle the speed (rad/s) at which torques balance.

    None if a flywheel is given or needed, and if there is no such speed: with torques that do not fall with speed, that jump
    at one, or a motor's current as a state.
    """
    scene, most = machine.scene, machine.scene.irregularity or 2.0
    mean = scene.speed if scene.unknown is not None else None

    def evaluated(edges: Array) -> tuple[tuple[Moments, Array, float, float] | None, float, Coarse]:
        moments = moments_on(machine, edges)
        if scene.inertia or moments.lossy or moments.circuit or moments.switches(np.full(moments.mesh.phi.shape, speed)):
            return None, 0.0, cells.above(np.zeros(1))
        balanced = _equilibrium_at_mean(moments, mean, unknown) if mean else (_equilibrium(moments, speed, unknown), unknown)
        omega, balance = balanced or (None, 0.0)
        if omega is None:
            return None, 0.0, cells.above(np.zeros(1))
        errors = cells.tails(cells.fit(omega))
        error = float(errors.max())
        share = error / max(float(np.ptp(omega)), 64 * ROUNDING * float(omega.max()))
        return (moments, omega, balance, error), share, lambda share: errors > share * error

    speeds = cells.refined(machine.mesh, evaluated, 0.05 * rtol, _MOST_CELLS)
    if speeds is None:
        return None
    moments, omega, unknown, error = speeds
    rate = moments.rate(omega, unknown, 0.0)
    error += 32 * ROUNDING * float((rate.exchanged / np.maximum(-rate.by_speed, 1e-300)).max())
    series = cells.fit(omega)
    (low, slow), (high, fast) = (_extreme(sign * series, moments.mesh) for sign in (-1.0, 1.0))
    run = Run(
        inertia=0.0,
        irregularity=2.0 * (high + low) / (high - low),
        speed_max=high,
        speed_min=-low,
        angle_speed_max=fast,
        angle_speed_min=slow,
        offset=0.0,
        error=2.0 * error / (high + low) if high + low > 0.0 else 0.0,
        cycle=turning_moment.cycle_of(moments, rate, None if scene.unknown is None else unknown),
        speed=0.5 * (high - low),
        drive=None if scene.drive is None else moments.drive(omega, unknown),
    )
    return (run, omega) if run.irregularity * (1.0 + run.error) <= most else None


def _equilibrium(moments: Moments, speed: float, unknown: float) -> Array | None:
    """The speeds (rad/s) at the nodes where the moment is zero and falls, by roots in a bracket."""
    low = high = np.full(moments.mesh.phi.shape, speed)
    for _ in range(_WIDENINGS):
        driven, braked = (moments.rate(high, unknown, 0.0).moment > 0.0, moments.rate(low, unknown, 0.0).moment < 0.0)
        high, low = np.where(driven, 2.0 * high, high), np.where(braked, 0.5 * low, low)
        if not (driven.any() or braked.any()):
            break
    else:
        return None
    return roots_between(lambda omega: moments.rate(omega, unknown, 0.0).moment, low, high)


def _equilibrium_at_mean(moments: Moments, speed: float, unknown: float) -> tuple[Array, float] | None:
    """The same, with the unknown that makes the mean of the greatest and the least speed the required one."""
    balanced = None
    for _ in range(_WIDENINGS):
        omega = _equilibrium(moments, speed, unknown)
        if omega is None:
            return None
        rate = moments.rate(omega, unknown, 0.0)
        slopes = -rate.by_unknown / np.minimum(rate.by_speed, -1e-300)
        least, most = cells.extents(cells.fit(omega))
        mean = 0.5 * float(least.min() + most.max())
        ends = slopes.ravel()[[omega.argmin(), omega.argmax()]]
        if abs(mean - speed) <= 64 * ROUNDING * speed:
            balanced = omega, unknown
        if abs(mean - speed) <= 8 * ROUNDING * speed or not ends.sum():
            break
        unknown += 2.0 * (speed - mean) / float(ends.sum())
    return balanced


def _extreme(series: Array, mesh: Cells) -> tuple[float, float]:
    """The greatest value of a function by its series on cells, and the angle (rad) where it is."""
    most, rounding = cells.extents(series)[1], 64 * ROUNDING * float(np.abs(series).sum(axis=-1).max())
    cell = int((most >= float(most.max()) - rounding).argmax())  # on a level stretch, its beginning
    row = series[cell]
    roots = np.polynomial.chebyshev.chebroots(np.polynomial.chebyshev.chebder(row))
    inside = roots.real[(np.abs(roots.imag) < 1e-6) & (np.abs(roots.real) < 1.0)]
    t = np.concatenate(([-1.0], np.sort(inside), [1.0]))
    values = np.polynomial.chebyshev.chebval(t, row)
    best = int((values >= float(values.max()) - rounding).argmax())
    return float(values[best]), float(mesh.middle[cell, 0] + mesh.half[cell, 0] * t[best])


def _inertialess_regime(
    machine: Machine, figures: Figures, run: Run, omega: Array, rtol: float, messages: tuple[str, ...]
) -> Regime:
    """The regime of a machine without inertia that keeps its irregularity: its speed by the balance of torques alone."""
    cycle, speed = run.cycle, run.speed
    assert cycle is not None
    assert speed is not None
    half, slowness = cycle.mesh.half, 1.0 / omega
    period = float(cells.integral(slowness, half).sum())
    cut = float((cells.TAIL_OF_INTEGRAL * cells.tails(cells.fit(slowness)) * half[:, 0]).sum()) / period
    of_period = cut + run.error * run.irregularity * run.speed_max / run.speed_min + 24 * ROUNDING
    extremes = run.irregularity, run.speed_max, run.speed_min
    motion = Confirmation(*extremes, period, machine.scene.cycle / period, 0.0, "quadrature")
    band = f"between {run.speed_min:.6g} and {run.speed_max:.6g} rad/s (irregularity {run.irregularity:.4g})"
    return Regime(
        machine=machine,
        rtol=rtol,
        figures=figures,
        motion=run,
        run=None,
        cycle=cycle,
        speed=speed,
        exact=(0.0, run.error),
        confirmed=Confirmed(motion, max(run.error, of_period), of_period, max(run.error, of_period)),
        messages=(
            *messages,
            f"the machine has no inertia, so that its speed follows its torques at once: they hold it {band}",
        ),
    )


# -- the motion --------------------------------------------------------------------------------------------------------


def _motion(machine: Machine, figures: Figures, unknown: float, rtol: float) -> OwnMotion:
    """The motion with the given flywheel, with the needed one, or with none if none is needed."""
    scene, speed = machine.scene, figures.speed
    mean = speed if scene.unknown is not None else None

    def solved(inertia: float | None, guess: float, *, directly: bool = False) -> OwnMotion:
        demand = Demand(inertia, scene.irregularity if inertia is None else None, mean)
        with limited(periodic_motion.MOST_WORK):
            return periodic_motion.own_motion(machine, speed, demand, guess, unknown, rtol, directly=directly)

    def without(*, directly: bool) -> OwnMotion | None:
        """The motion without a flywheel, if it keeps the irregularity."""
        try:
            motion = solved(0.0, 0.0, directly=directly)
        except (NoRegimeError, BudgetError):
            return None
        return motion if motion.run.irregularity * (1.0 + motion.run.error) <= (scene.irregularity or 0.0) else None

    def refused(inertia: float | None, guess: float, error: NoRegimeError | BudgetError) -> SceneError:
        return SceneError([_fault(machine, speed, inertia, guess, unknown, MotionSearch(guess, error=error))])

    if scene.inertia is not None:
        inertia = scene.inertia * scene.flywheel_ratio**2
        turning_moment.check_weighs(machine, figures.cycle, figures.extent, inertia)
        finding = Branch(machine, speed, unknown, mean).at(inertia, rtol)
        if finding.motion is not None:
            return finding.motion
        if isinstance(finding.error, UnstableError) and finding.stop is None:
            return finding.error.motion
        raise SceneError([_fault(machine, speed, inertia, 0.0, unknown, finding)])
    least = _LIGHT * max(figures.reduced_inertia.max, figures.scale)
    guess = max(figures.total - figures.cycle.inertia_at_start, least)
    damping = periodic_motion.damping(machine, speed, guess, unknown)
    steadied = guess == least or damping.keeps(scene.irregularity or 0.0)
    if steadied and (alone := without(directly=True)) is not None and not _unstable(alone):
        return alone
    try:
        motion = solved(None, guess, directly=not damping.strong)
        motion = solved(None, guess) if _unstable(motion) else motion
    except (NoRegimeError, BudgetError):  # of machines as even as asked without a flywheel none is found: these come first
        if not steadied and (alone := without(directly=True)) is not None and not _unstable(alone):
            return alone
        try:
            motion = solved(None, guess)
        except (NoRegimeError, BudgetError) as error:
            if (alone := without(directly=False)) is None:
                raise refused(None, guess, error) from None
            return alone
    if motion.inertia > 0.0:
        machine.kept[limits.SIZED] = scene.irregularity, rtol, motion
        return motion
    try:
        return solved(0.0, 0.0)
    except (NoRegimeError, BudgetError) as error:
        raise refused(0.0, 0.0, error) from None


def _unstable(motion: OwnMotion) -> bool:
    """Tests whether a small change grows from cycle to cycle, in a motion that sets its own speed."""
    return motion.solved.moments.machine.scene.unknown is None and motion.solved.damping < -_LEAST_DAMPING


def _smallest(machine: Machine, figures: Figures, unknown: float, rtol: float) -> limits.Smallest:
    """The motion with the smallest flywheel that keeps a scene's limits, if heavier ones may break them."""
    try:
        return limits.smallest(machine, figures, unknown, rtol)
    except NoRegimeError as error:
        if machine.scene.irregularity is not None:
            _motion(machine, figures, unknown, rtol)  # whose refusal names the reason
        fault = _fault(machine, figures.speed, None, figures.scale, unknown, MotionSearch(figures.scale, error=error))
        raise SceneError([fault._replace(path="flywheel.limits")]) from None


def _fault(machine: Machine, speed: float, size: float | None, guess: float, unknown: float, finding: MotionSearch) -> Fault:
    """Fault of a machine for which no motion was found, or none with meaningful figures.

    Simulated in time the machine may stall or run away; otherwise the iteration did not converge. `size` is the flywheel on
    the crank (kg m²), None if one is searched for from a guess.
    """
    scene, error = machine.scene, finding.error
    path = "flywheel.irregularity" if size is None else "flywheel.inertia"
    if scene.unknown is None and constant_speed.speed_error(machine, speed) > _UNHELD:
        defect = f"torques that hardly depend on speed: what holds it near {speed:.6g} rad/s is less than their rounding"
        advice = 'name the unknown and give the speed: drive.torque = "balance", regime.speed'
        return Fault("drive" if scene.drive is not None else "load", defect, "torques that hold a steady speed", advice)
    if isinstance(error, UnresolvedError):
        expected = "an irregularity that the flywheel changes by more than rounding"
        advice = "the torques hold the speed with any flywheel: require a smaller irregularity, or give flywheel.inertia"
        return Fault("flywheel.irregularity", str(error), expected, advice)
    if isinstance(error, LostError):
        advice = "smaller driving and resisting torques, or a larger irregularity"
        return Fault(path, str(error), "a motion that varies by more than rounding", advice)
    inertia = guess if size is None else size
    wheel = f" with {'about ' if size is None else ''}{inertia:.6g} kg m² on the crank"
    expected = "a motion that returns to its speed each cycle"
    what = "motor" if scene.drive is not None and scene.unknown is None else "machine"
    if (stop := finding.stop) is not None:
        where = f"stalls at {machine.where(stop.phi)} for lack of {stop.shortfall:.6g} N m on the crank"
        defect = f"a {what} that {where}, released at {stop.speed:.6g} rad/s{wheel}"
        return Fault(path, defect, expected, "a heavier flywheel, a stronger drive, or a higher speed")
    if isinstance(error, OutOfStepError):
        defect = f"a motor that falls out of step{wheel}: released at {speed:.6g} rad/s, it settles to {error}"
        return Fault(path, defect, "a synchronous motor in step", "a heavier flywheel, a stronger motor, or smaller loads")
    ending = outcome_of(machine, speed, inertia, unknown, hurried=isinstance(error, BudgetError))
    if ending.outcome is Outcome.STALLS:
        defect = f"a {what} that stalls {ending.where}, released at {speed:.6g} rad/s{wheel}"
        return Fault(path, defect, expected, "a heavier flywheel, a stronger drive, or a higher speed")
    if ending.outcome is Outcome.RUNS_AWAY:
        defect = f"a machine that runs away, released at {speed:.6g} rad/s{wheel}"
        return Fault(path, defect, expected, "a heavier flywheel, or a drive whose torque falls with speed")
    none = f"no periodic motion near {speed:.6g} rad/s{wheel}"
    if ending.fault is not None:
        what = "it" if ending.fault.path == "simulation" else ending.fault.path
        defect = f"{none}: followed in time, {what} comes to {ending.fault.defect}"
        return Fault(path, defect, expected, ending.fault.advice)
    if isinstance(error, BudgetError):
        return _too_much(error.faults[0], machine, speed, size or 0.0, unknown)
    return Fault(path, f"{none}: {error}", expected, "follow the machine in time: flywheel simulate")


def _too_much(fault: Fault, machine: Machine, speed: float, inertia: float, unknown: float) -> Fault:
    """The fault of a search without a result, with the reason if the machine shows one.

    It tries the given flywheel; in a search also light ones, and none.
    """
    moments = moments_on(machine, machine.mesh, local=True)
    total = inertia + moments.inertia
    if float(total.min()) <= _NO_INERTIA * float(total.max()):
        where = machine.where(float(moments.mesh.phi.ravel()[total.argmin()]))
        defect = f"{fault.defect}: there is almost no inertia near {where}, where the speed follows the torques at once"
        return fault._replace(defect=defect, advice="add inertia to the crank")
    if moments.circuit is None:
        slope = moments.rate(np.full(moments.mesh.phi.shape, speed), unknown, inertia).by_speed
        fading = float(cells.integral(np.maximum(-slope, 0.0) / (total * speed), moments.mesh.half).sum())
        if fading > _STEEP:
            steep = f"torques fall so steeply with speed that a change in speed decays by exp(-{fading:.2g}) in a cycle"
            return fault._replace(defect=f"{fault.defect}: {steep}", advice="add inertia, or make them less steep")
    pieces = machine.mesh.size - 1
    if pieces > _MANY:
        return fault._replace(defect=f"{fault.defect}: torques jump or bend, or vary fast, in {pieces} cells of a cycle")
    return fault


@np.errstate(all="ignore")  # a report asks for it after the sizing is over
def run_with(machine: Machine, constant: Cycle, speed: float, inertia: float, rtol: float, *, stored: bool) -> Run:
    """The run of a machine with another flywheel (kg m² on the crank), or with none if nothing stores energy.

    Args:
        machine: the machine.
        constant: its cycle at a constant speed.
        speed: mean of extremes, rad/s.
        inertia: of the flywheel.
        rtol: of the sizing.
        stored: true if anything but the flywheel stores energy.

    Raises:
        NoRegimeError: if there is none.

    """
    if inertia > 0.0 or stored:
        return with_flywheel(machine, constant, speed, inertia, rtol).run
    run = _inertialess_run(machine, speed, constant.balance or 0.0, 0.5 * rtol)
    if run is None:
        raise NoRegimeError("its torques alone do not hold a speed at every angle")
    return run[0]


def with_flywheel(
    machine: Machine, constant: Cycle, speed: float, inertia: float, rtol: float, other: OwnMotion | None = None
) -> OwnMotion:
    """The motion of a machine with another flywheel (kg m² on the crank); arguments as in `run_with`.

    `other` is a motion with another flywheel, from which it is then found sooner.

    Raises:
        NoRegimeError: if there is none.

    """
    mean = machine.scene.speed if machine.scene.unknown is not None else None
    unknown = constant.balance or 0.0
    try:
        with limited(_LESS_WORK):
            demand = Demand(inertia, None, mean)
            return stable_motion(machine, other, mean or speed, demand, unknown, 0.5 * rtol)
    except BudgetError as error:
        raise NoRegimeError(str(error)) from None
