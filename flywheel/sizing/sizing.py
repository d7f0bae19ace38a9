"""The flywheel of a scene: cycle, figures, motion, confirmation, wheel, and the result built from them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache, partial
from importlib.util import find_spec
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from flywheel.components.wheel_stresses import ARMS, LIGHTEST, MEAN
from flywheel.components.wheels import choose
from flywheel.machine.equation import NoMotionError, moments_on
from flywheel.machine.loads import FrictionCurve
from flywheel.machine.machine import Machine, scene_of
from flywheel.numerics import cells
from flywheel.numerics.budget import Cost, Meter, counted
from flywheel.numerics.cells import MIDDLE, ROUNDING, Array
from flywheel.numerics.faults import Fault, SceneError
from flywheel.reading.paths import with_numbers
from flywheel.regime import turning_moment, wittenbauer
from flywheel.regime.joint_friction import friction_along, machine_of
from flywheel.regime.turning_moment import Run
from flywheel.regime.wittenbauer import Area, Flywheel
from flywheel.scene import scene as levels
from flywheel.scene.scene import Mechanism, Scene
from flywheel.sizing.drive import (
    drive_work,
    energy,
    engine,
    inverter_load,
    servo_load,
    servo_messages,
    synchronism,
    temperature,
    trip_messages,
)
from flywheel.sizing.findings import as_dict, estimates
from flywheel.sizing.motor import MotorShaft
from flywheel.sizing.power_flow import power_flow
from flywheel.sizing.results import (
    Balance,
    Beside,
    Confirmation,
    Confirmed,
    ConstantSpeed,
    Derivations,
    ElectricalTransients,
    Errors,
    FrictionIteration,
    Limit,
    Proof,
    Regime,
    SelectedWheel,
    Sizing,
    Stability,
)

if TYPE_CHECKING:
    from flywheel.machine.reactions import MachineMotion
    from flywheel.sizing.enclosures import NearMotion

_ALONE = (levels.NORMAL, levels.PROOF)  # levels without a second route
_NEAR = 1e-13  # rtol of the motion near which one is proven, at most
_AROUND = 1e-6  # rad, beside an angle at which that switches
_MOST_ROUNDS = 12  # iterations between motion and friction
_LEFT = 0.05  # of rtol: fraction that friction rounds may leave unresolved
_MIXED = 4  # rounds whose motions are combined
_COMPARED = 181  # angles at which their speeds are compared
_DEPENDENT = 1e-6  # of the largest change: smaller changes are left out of the combination
_SLOWER = 0.25  # of the least square of a speed: lower bound of a combination
_SLOWEST = 0.95  # of a round's change: greatest change of the next round that counts as convergence
_TITLES = {
    "exact": "exact inertia",
    "approximate": "approximate inertia",
    "inertia_torque": "inertia-torque figure",
    "inertia_torque_flywheel": "flywheel by the inertia torque",
    "work": "work",
    "simulation": "simulation",
    "period": "time of a cycle",
}


def size(
    machine: Machine | Scene,
    rtol: float | None = None,
    *,
    simulate: bool | None = None,
    accuracy: str | None = None,
) -> Sizing:
    """Sizes (or analyses) the flywheel of a machine, and confirms it by a time simulation unless that is switched off.

    Exact:        I = [max(W - z+ w²I*/2) - min(W - z- w²I*/2)]/(eps w²), z± = (1 ± eps/2)²
    Approximate:  I = (max W - min W)/(eps w²) - min I*
    with W(phi) the integral of M*, w the mean of extremes (rad/s), I* the reduced inertia (kg m²), eps the irregularity.

    Args:
        machine: a `Machine`, or a `Scene`, of which one is then built.
        rtol: required relative accuracy of every figure; the scene's own if None.
        simulate: true to confirm by time stepping (accuracy "audit", else "normal").
        accuracy: "normal", or "fast": the exact figures; "confirm": these and the motion by periodic collocation on other
            cells; "proof": the exact figures with proven intervals (extra `proof`); "audit", the default: the exact figures
            and the motion stepped in time. An analysis at "normal" has its motion by quadrature.

    Raises:
        SceneError: if the machine cannot run as the scene describes (net work, balance without effect, values not finite).
        ValueError: for another `accuracy`, or one that `simulate` contradicts.

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
    level = levels.level(accuracy, simulate)
    scene = scene_of(machine)
    check_complete(scene)
    rtol = float(scene.rtol if rtol is None else rtol)
    if faults := levels.rtol_faults(rtol):
        raise SceneError(faults)
    if scene.duty:
        from flywheel.sizing import duty  # a sizing for each of its phases

        return duty.sized(scene, partial(size, rtol=rtol, accuracy=level), partial(size, rtol=rtol, accuracy=levels.NORMAL))
    try:
        with np.errstate(all="ignore"), counted() as tally:  # values that are not finite are reported with their place
            meter = Meter(tally)
            if scene.areas is not None:
                return _of_diagram(scene, rtol, level, meter)
            return _of_machine(machine if isinstance(machine, Machine) else Machine(scene), rtol, level, meter)
    except ArithmeticError:
        defect = "numbers whose products leave the floating-point range"
        raise SceneError([Fault("scene", defect, "masses, lengths and speeds in proportion", "check the units")]) from None


def check_complete(scene: Scene) -> None:
    """Refuses a scene without a cycle, a flywheel or a speed, which a sizing or an analysis needs.

    Without a speed the machine needs torques or losses that depend on it, and nothing else that is unknown.
    """
    turning_moment.check_cycle(scene)
    faults, expected = [], 'a speed such as "210 rpm" or a bare number in rad/s'
    if not scene.has_flywheel:
        faults.append(Fault("flywheel", "nothing", "a table with irregularity or inertia"))
    if (scene.areas is not None and scene.speed is None) or not scene.has_speed:
        advice = "" if scene.areas is not None else "or torques that depend on speed, which fix it"
        faults.append(Fault("regime.speed", "nothing", expected, advice))
    elif scene.speed is None and scene.unknown is not None:
        faults.append(Fault("regime.speed", 'nothing, with a "balance"', expected, "one of the two must be known"))
    if faults:
        raise SceneError(faults)


def _of_machine(machine: Machine, rtol: float, level: str, meter: Meter) -> Sizing:
    """The sizing of a machine: every stage takes the results of those before it, and the record is made at the end."""
    scene = machine.scene

    # cycle, figures and motion, with friction in joints as it is along that motion
    regime, of_motion, friction = (
        _with_friction(machine, rtol) if machine.has_joint_friction else (*_regime(machine, rtol), None)
    )
    machine = regime.machine
    figures, cycle, speed = regime.figures, regime.cycle, regime.speed
    reduced_inertia = figures.reduced_inertia
    even = _even(regime)
    flywheel = _flywheel(regime, even)
    regime = regime._replace(run=_even_run(regime) if even else regime.run)
    work = drive_work(machine, cycle, regime.motion, speed)
    of_figures = meter.lap()._replace(stages=of_motion)

    # confirmation, and the errors of all that
    confirmed = _confirmed(regime, flywheel.approximate, level)
    of_confirmation = meter.lap()
    errors = _errors(regime, confirmed, even)
    left = abs(cycle.net) / cycle.exchanged if cycle.exchanged else 0.0
    remainder = f"{cycle.net:.3g} J of net work ({left:.2g} of the work exchanged)" if cycle.errors.residual > 0.0 else ""

    # wheel
    inertia = flywheel.exact if scene.inertia is None else scene.inertia
    irregularity = scene.irregularity if confirmed.motion is None else confirmed.motion.irregularity
    built, of_wheel = _wheel(scene, inertia or 0.0, speed, irregularity or 0.0, regime)

    # result
    reached = scene.irregularity if flywheel.needed or regime.run is None else regime.run.irregularity
    limits, binding = regime.limits, regime.binding
    if not limits:
        limits, binding = _limits(scene, flywheel.exact, errors.exact, reached)
    limits = {name: limit._replace(simulated=confirmed.limited.get(name)) for name, limit in limits.items()}
    balance = None
    if scene.unknown is not None and cycle.balance is not None:
        balance = Balance(scene.unknown, cycle.balance, cycle.balance_error)
    shaft = None if regime.run is None or scene.motor is None else MotorShaft(scene, cycle, regime.run, speed, rtol)
    inverter, servo = (None, None) if shaft is None else (inverter_load(shaft), servo_load(shaft))
    messages = (
        *_missed(errors, rtol, remainder, regime.cyclic),
        *regime.messages,
        *(message for mechanism in scene.mechanisms if mechanism.linkage for message in _redundant(mechanism)),
        *(() if scene.motor is None else scene.motor.doubts),
        *(() if inverter is None else trip_messages(inverter.trips)),
        *(() if servo is None else servo_messages(servo)),
        *confirmed.messages,
        *(() if machine.friction is None else _of_friction(regime, machine.friction, friction, flywheel.exact)),
        *of_wheel,
    )
    return Sizing(
        scene=scene,
        speed=speed,
        balance=balance,
        power=None if work is None else work * speed / scene.cycle,
        drive_work=work,
        areas=wittenbauer.areas(figures),
        accumulated_max=figures.accumulated[0],
        accumulated_min=figures.accumulated[1],
        energy_fluctuation=figures.fluctuation,
        coefficient_of_energy=figures.fluctuation / work if work else None,
        angle_speed_max=regime.motion and regime.motion.angle_speed_max,
        angle_speed_min=regime.motion and regime.motion.angle_speed_min,
        reduced_inertia=reduced_inertia,
        flywheel=flywheel,
        simulation=confirmed.motion,
        error=errors,
        closure=left,
        rtol=rtol,
        derived=DERIVED,
        messages=messages,
        machine=machine,
        cycle=cycle,
        run=regime.run,
        constant=regime.constant,
        cyclic=regime.cyclic,
        built=built,
        friction=friction,
        inverter=inverter,
        servo=servo,
        temperature=None if shaft is None else temperature(shaft),
        limits=limits,
        binding=binding,
        accuracy=level,
        left_out=levels.left_out(confirmed.motion and confirmed.motion.route, moves=regime.run is not None),
        cost=meter.cost._replace(stages={"figures": of_figures, "simulation": of_confirmation}),
        proof=_proof(scene, regime) if level == levels.PROOF else None,
    )


def _proof(scene: Scene, regime: Regime | None = None) -> Proof:
    """The proof of a scene's figures, near the motion of its regime; without the library of balls the way to install it."""
    if find_spec("flint") is None:
        return Proof(
            {}, "python-flint, which is not installed: pip install 'flywheel-design[proof]'", "nothing is proven", 0.0
        )
    from flywheel.sizing.proof import proven  # the library is an extra

    if regime is None or regime.run is None:
        return proven(scene)
    run = regime.run

    @cache
    def near(values: tuple[tuple[str, float], ...]) -> NearMotion:
        """The motion of the regime, or with other numbers (SI) at some paths; reversals of meshes near the true ones."""
        own, machine = regime, Machine(with_numbers(scene, dict(values))) if values else regime.machine
        if values or (machine.sets_its_speed and not scene.limits):
            with suppress(SceneError):  # the one at hand will do
                own, _ = _regime(machine, min(regime.rtol, _NEAR))
        return _near(own, own.run or run)

    return proven(scene, near)


def _near(regime: Regime, run: Run) -> NearMotion:
    """The motion of a regime, near which one is proven, with the angles at which a mesh or a torque switches."""
    from flywheel.sizing.enclosures import NearMotion  # the library is an extra

    machine, unknown = regime.machine, regime.cycle.balance or 0.0

    def decisive(edges: Array) -> tuple[Array, list[Array], list[Array]]:
        """Angles of nodes; there, moments outwards through meshes with losses, and what decides other branches."""
        nodes, moments = cells.cells(edges).phi, moments_on(machine, edges, local=True)
        omega = turning_moment.speed_over_cycle(regime.cycle, regime.speed, run, nodes)
        return nodes, [*moments.rate(omega, unknown, run.inertia).transmitted], moments.switches(omega)

    def switch(angle: float, number: int) -> float:
        """The angle at which a value changes its sign, where one cell ends that was cut for it."""
        (nodes,), *values = decisive(np.array([angle - _AROUND, angle + _AROUND]))
        ((value,),) = [*chain(*values)][number : number + 1]
        (changes,) = np.nonzero((value[1:] > 0.0) != (value[:-1] > 0.0))
        if len(changes) != 1:
            return angle
        k = int(changes[0])
        return float(nodes[k] - value[k] * (nodes[k + 1] - nodes[k]) / (value[k + 1] - value[k]))

    edges = regime.cycle.mesh.edges
    _, passed, others = decisive(edges)
    decided = [each[:, MIDDLE] > 0.0 for each in (*passed, *others)]
    sides = [tuple(row) for row in np.reshape(decided, (len(decided), len(edges) - 1)).T.tolist()]
    outwards = [(0.0, sides[0][: len(passed)])]
    breaks = np.append(machine.breakpoints, machine.scene.cycle)
    for low, before, own in zip(edges[1:-1].tolist(), sides[:-1], sides[1:], strict=True):
        if own != before:
            number = next(k for k, (one, other) in enumerate(zip(before, own, strict=True)) if one != other)
            at_break = np.abs(breaks - low).min() < 2 * _AROUND
            outwards.append((low if at_break else switch(low, number), own[: len(passed)]))
    start = float(turning_moment.speed_over_cycle(regime.cycle, regime.speed, run, np.zeros(1))[0])
    return NearMotion(run.inertia, unknown, start, run.irregularity, tuple(outwards))


# -- the stages --------------------------------------------------------------------------------------------------------


def _regime(machine: Machine, rtol: float) -> tuple[Regime, dict[str, Cost]]:
    """The steady regime, by the cheapest formulation that the machine allows, and the cost of its motion."""
    if of_motor := [name for name in machine.scene.limits if name != "irregularity"]:
        motor = machine.scene.motor
        if motor is None or motor.rated is None or not machine.sets_its_speed:  # no scene that was read
            raise SceneError([Fault(f"flywheel.limits.{of_motor[0]}", "no motor with a rated point", "one in [drive]")])
    if machine.sets_its_speed or machine.depends_on_time:
        from flywheel.sizing import speed_dependent  # Newton's method is for machines that set their own speed

        return speed_dependent.regime(machine, rtol)
    figures, run = wittenbauer.resolved_figures(machine, rtol)
    return Regime(machine, rtol, figures, run, run, figures.cycle, figures.speed), {}


def _with_friction(machine: Machine, rtol: float) -> tuple[Regime, dict[str, Cost], FrictionIteration]:
    """The steady regime of a machine with friction in its joints, taken at its own speeds and accelerations.

    Friction follows from the motion, flywheel and balance, and these follow from friction. From friction at a constant speed
    on, each is computed from the other until the change by further rounds is negligible compared with the required error.
    Each change is a fraction of the previous one, which gives that bound; it is part of the friction's error. Simple rounds
    converge slowly, or diverge, if the irregularity is large: friction is taken along a mixture of the last few motions (see
    `_mixture`).
    """
    regime, costs = _regime(machine_of(machine), rtol)
    at_constant, left, rounds, before = _at_constant_speed(regime), 0.0, 0, None
    angles = np.linspace(0.0, machine.scene.cycle, _COMPARED)
    along = np.full(angles.size, at_constant.speed**2)  # squares of the speeds (rad²/s²) that friction is taken at
    last: list[tuple[Regime, Array, Array]] = []  # rounds: a regime, the squares that its friction is taken at, its own
    while regime.run is not None and regime.confirmed is None and rounds < _MOST_ROUNDS:
        friction = regime.machine.friction
        assert friction is not None
        last = [*last[1 - _MIXED :], (regime, along, _motion_of(regime, angles).omega ** 2)]
        regimes, taken, own = zip(*last, strict=True)
        weights = _mixture(np.array(taken), np.array(own))
        along = np.asarray(sum(weight * square for weight, square in zip(weights, own, strict=True)))
        balance = sum(weight * (one.cycle.balance or 0.0) for weight, one in zip(weights, regimes, strict=True))
        meshes = [one.cycle.mesh for one in regimes]
        edges = sorted({at for mesh in meshes for at in (mesh.middle + mesh.half)[:-1, 0].tolist()})
        curve = friction_along(machine, partial(_mixed, weights, regimes), balance, edges)
        enough = max(_LEFT * rtol * regime.figures.fluctuation, curve.error)
        changed = curve.apart(friction)
        share = _SLOWEST if before is None else min(changed / before, _SLOWEST)
        left = changed if changed <= curve.error else 2 * changed * share / (1.0 - share)
        curve.error += left
        regime, costs = _regime(Machine(machine.scene, curve), rtol)
        rounds, before = rounds + 1, changed
        if left <= enough:
            break
    return regime, costs, FrictionIteration(rounds, left, at_constant)


def _mixture(taken: Array, own: Array) -> list[float]:
    """Weights of the last rounds' motions in the one along which friction is taken next (Anderson's mixing).

    taken, own: squares of speeds (rad²/s²) at some angles, (rounds, angles): of the motion whose friction a round has, and
    of the motion with that friction.

    Equation: with the change r_i of the squares of speeds in round i, the sum of w_i r_i is least where w_i sum to 1.
    A mixture that stops, or nearly stops, is no motion: the mean of the last two then replaces it.
    Source: D. G. Anderson, Iterative Procedures for Nonlinear Integral Equations, J. ACM 12 (1965).
    """
    if len(own) == 1:
        return [1.0]
    changes = own - taken
    shares = np.linalg.lstsq((changes[:-1] - changes[-1]).T, -changes[-1], rcond=_DEPENDENT)[0]
    weights = [*shares.tolist(), 1.0 - float(shares.sum())]
    if np.min(np.asarray(weights) @ own) >= _SLOWER * own.min():
        return weights
    return [*[0.0] * (len(own) - 2), 0.5, 0.5]


def _mixed(weights: Sequence[float], last: Sequence[Regime], phi: Array) -> MachineMotion:
    """The motion whose squares of speeds, and so accelerations, are a mixture of those of some rounds, at angles (rad)."""
    motions = [_motion_of(one, phi) for one in last]
    square = sum(weight * motion.omega**2 for weight, motion in zip(weights, motions, strict=True))
    alpha = sum(weight * motion.alpha for weight, motion in zip(weights, motions, strict=True))
    return motions[-1]._replace(omega=np.sqrt(square), alpha=np.asarray(alpha))


def _motion_of(regime: Regime, phi: Array) -> MachineMotion:
    """The motion of a regime at crank angles (rad)."""
    from flywheel.machine.reactions import MachineMotion  # only linkages have friction

    assert regime.run is not None
    omega = turning_moment.speed_over_cycle(regime.cycle, regime.speed, regime.run, phi)
    return MachineMotion(phi, omega, turning_moment.acceleration_over_cycle(regime.cycle, regime.run, phi, omega))


def _at_constant_speed(regime: Regime) -> ConstantSpeed:
    """The figures of a regime whose friction is that of a constant speed."""
    friction, even = regime.machine.friction, _even(regime)
    return ConstantSpeed(
        speed=regime.speed if friction is None or friction.speed is None else friction.speed,
        exact=_flywheel(regime, even).exact,
        irregularity=None if regime.run is None else regime.run.irregularity,
        balance=regime.cycle.balance,
        energy_fluctuation=regime.figures.fluctuation,
    )


def _of_friction(
    regime: Regime, curve: FrictionCurve, friction: FrictionIteration | None, exact: float | None
) -> Iterator[str]:
    """Message on friction in joints: the speed at which it was taken, and the result at another."""
    if curve.speed is not None:
        taken = f"friction in joints is taken at a constant crank speed of {curve.speed:.6g} rad/s"
        yield f"{taken}, and so is its share of the moment"
    if friction is None or not friction.rounds:
        return
    constant, run = friction.constant_speed, regime.run
    figure, other, words = exact, constant.exact, "{:.6g} kg m^2"
    if exact is None and run is not None:
        figure, other, words = run.irregularity, constant.irregularity, "an irregularity of {:.6g}"
    message = "friction in joints is that of the motion's own speed and acceleration"
    if figure and other is not None:
        off = 100.0 * (other / figure - 1.0)
        message += f"; at a constant {constant.speed:.6g} rad/s it would give {words.format(other)}, "
        message += f"{abs(off):.2g} % {'more' if off > 0.0 else 'less'}"
    yield message


def _even(regime: Regime) -> bool:
    """Tests whether the speed varies by rounding alone."""
    errors, inertia = (regime.constant or regime.cycle).errors, regime.figures.reduced_inertia
    if regime.motion is None and regime.machine.sets_its_speed:  # nothing varies, and nothing stores energy
        return True
    if regime.figures.fluctuation > 4 * errors.work:
        return False
    return inertia.max - inertia.min <= max(4 * errors.variation, errors.inertia)


def _even_run(regime: Regime) -> Run | None:
    """The motion if nothing varies the speed: as given, or without the flywheel that is not needed."""
    run, speed = regime.run, regime.speed
    if run is None:
        return None
    run = run._replace(irregularity=0.0, speed_max=speed, speed_min=speed, offset=0.0, error=0.0)
    if regime.machine.scene.irregularity is None:
        return run
    greatest = regime.figures.reduced_inertia.max
    return None if greatest <= (regime.constant or regime.cycle).errors.inertia else run._replace(inertia=0.0)


def _flywheel(regime: Regime, even: bool) -> Flywheel:
    """The flywheels of the regime: by its figures, the exact one by its motion if torques depend on speed."""
    scene = regime.machine.scene
    if even and scene.irregularity is not None:
        return Flywheel(scene.flywheel_on, None, 0.0, 0.0, 0.0, 0.0, 0.0, needed=False)
    figures = wittenbauer.flywheel(regime.figures, scene)
    if regime.exact is None or not (scene.irregularity is not None or scene.limits):
        return figures
    exact = regime.exact[0] / scene.flywheel_ratio**2
    return figures._replace(
        exact=exact, needed=exact > 0.0, proven_bounds=None, proven_bounds_torque=None, broken=regime.broken
    )


def _confirmed(regime: Regime, approximate: float | None, level: str) -> Confirmed:
    """The motion by the method of the level of accuracy; by quadrature if it cannot be confirmed."""
    analysis = regime.machine.scene.inertia is not None
    if regime.confirmed is not None:
        return regime.confirmed if analysis or level not in _ALONE else Confirmed()
    if level in _ALONE:
        return _by_quadrature(regime) if analysis else Confirmed()
    from flywheel.sizing.confirmation import UnconfirmedError, by_collocation, in_time  # the figures do without

    try:
        return (by_collocation if level == levels.CONFIRM else in_time)(regime, approximate)
    except UnconfirmedError as error:
        return _by_quadrature(regime)._replace(messages=(str(error),))


def _by_quadrature(regime: Regime) -> Confirmed:
    """The motion without time stepping: irregularity in closed form, time by quadrature."""
    cycle, run = regime.cycle, regime.run
    if run is None:
        return Confirmed()
    period, error = turning_moment.period(cycle, regime.speed, run, regime.rtol)
    extremes, mean = (run.irregularity, run.speed_max, run.speed_min), regime.machine.scene.cycle / period
    left = abs(cycle.net) / cycle.exchanged if cycle.exchanged else 0.0
    motion = Confirmation(*extremes, period, mean, left, "quadrature")
    return Confirmed(motion, run.error, error, run.error_about_mean)


def _errors(regime: Regime, confirmed: Confirmed, even: bool) -> Errors:
    """Estimated error of every figure, with that of the fit of friction's moment."""
    figures, motion, machine = regime.figures, regime.motion, regime.machine
    wheels, work = figures.errors, turning_moment.work_error(figures.cycle)
    friction = 0.0 if machine.friction is None else 2 * machine.friction.error
    share = friction / max(figures.fluctuation, 1e-300)
    loose = 0.0 if regime.cyclic is None else 2 * regime.cyclic.constant_speed_error
    exact = approximate = torque = torque_flywheel = None
    if wheels is not None and even:
        exact = approximate = torque = torque_flywheel = work + share
    elif wheels is not None:
        exact = (wheels.exact if regime.exact is None else regime.exact[1]) + share
        approximate, torque = wheels.approximate + loose + share, wheels.inertia_torque + loose + share
        torque_flywheel = wheels.inertia_torque_flywheel + loose + share
    elif regime.limits and regime.exact is not None:
        exact = regime.exact[1] + share
    speeds = extremes = None
    if confirmed.motion is not None and confirmed.speeds_error is not None:
        level = 0.0 if regime.cyclic is None else regime.cyclic.level_error
        speeds = confirmed.speeds_error + level + share * confirmed.motion.irregularity
    if motion is not None:
        extremes = turning_moment.error_of_extremes(figures.cycle, motion, sized=wheels is not None) + regime.extremes_error
    return Errors(
        exact=exact,
        simulation=None if confirmed.error is None else confirmed.error + share,
        approximate=approximate,
        inertia_torque=torque,
        inertia_torque_flywheel=torque_flywheel,
        work=work + friction / max(regime.cycle.exchanged, 1e-300),
        angles=turning_moment.error_of_crossings(figures.cycle, figures.roots),
        period=confirmed.period_error,
        extremes=extremes,
        extreme_speeds=speeds,
    )


def _limits(
    scene: Scene, exact: float | None, error: float | None, reached: float | None
) -> tuple[dict[str, Limit], str | None]:
    """The irregularity if it is the only limit, which the exact flywheel is for; and its name if a flywheel is needed."""
    if not scene.limits or exact is None or reached is None:
        return {}, None
    limit = {name: Limit(limit, reached, exact, None, error or 0.0, error or 0.0) for name, limit in scene.limits.items()}
    return limit, next(iter(limit)) if exact > 0.0 else None


def _missed(errors: Errors, rtol: float, remainder: str, cyclic: Stability | None = None) -> Iterator[str]:
    """A message for every figure whose estimated error is above rtol; a single one if the cause is net work."""
    figures = [
        f"the {title} is good to {error:.2g}"
        for name, title in _TITLES.items()
        if (error := getattr(errors, name)) is not None and error > rtol
    ]
    if cyclic is not None and cyclic.level_error > rtol:
        figures.append(f"the speed is good to {cyclic.level_error:.2g}")
    if figures and remainder:
        yield f"rtol {rtol:.1g} not reached: {remainder} are left over in the cycle, and may belong anywhere in it: " + (
            ", ".join(figures)
        )
    elif figures:
        yield from (f"rtol {rtol:.1g} not reached: {what} (estimated, relative)" for what in figures)


def _redundant(mechanism: Mechanism) -> Iterator[str]:
    """Message on a linkage with redundant constraints."""
    from flywheel.mechanisms import linkage  # only scenes with linkages need it

    mobility = linkage.followed(mechanism).solution.mobility
    if mobility.redundant:
        what = "; ".join(mobility.redundant)
        yield f"{mechanism.name} has redundant constraints (Gruebler counts {mobility.gruebler}, not 1): {what}"


def _wheel(
    scene: Scene,
    inertia: float,
    speed: float,
    irregularity: float,
    regime: Regime | None,
    fluctuation: float = 0.0,
    error: float = 0.0,
) -> tuple[SelectedWheel | None, tuple[str, ...]]:
    """The wheel of the scene's shape, the irregularity with it as built, and remarks.

    The wheel has the exact inertia (or the given one), at the greatest speed of its shaft unless the scene chooses the
    mean. Without a given torque its arms transmit the accelerating torque: J times the greatest acceleration.

    Args:
        scene: with the wheel's shape and material.
        inertia: kg m² at its own shaft.
        speed: mean of extremes of the crank, rad/s.
        irregularity: if the regime has no motion of its own.
        regime: of the machine; None for a diagram of areas.
        fluctuation: of a diagram of areas, J.
        error: of that, relative.

    """
    rim = scene.wheel
    if rim is None:
        return None, ()
    if not inertia:
        return None, ("no wheel is chosen, as no flywheel is needed",)
    ratio, run = scene.flywheel_ratio, None if regime is None else regime.run
    greatest = speed * (1 + irregularity / 2) if run is None else run.speed_max
    hub = rim.bore is not None or rim.hub_diameter is not None
    armed = rim.shape == ARMS or (rim.shape == LIGHTEST and hub)
    if armed and rim.torque is None and regime is not None and run is not None:
        phi = (run.cycle or regime.cycle).mesh.phi
        omega = turning_moment.speed_over_cycle(regime.cycle, regime.speed, run, phi)
        series = cells.fit(turning_moment.acceleration_over_cycle(regime.cycle, run, phi, omega))
        rim = rim._replace(torque=inertia * ratio * max(cells.greatest(series), cells.greatest(-series)))
    wheel = choose(inertia, ratio * (speed if rim.at == MEAN else greatest), rim)
    torque, on_crank = None if wheel.body.arms is None else rim.torque, wheel.inertia * ratio**2
    if regime is None:
        return SelectedWheel(wheel, fluctuation / (on_crank * speed**2), error, torque), wheel.warnings
    try:
        if regime.constant is None:
            motion = turning_moment.run(regime.cycle, speed, on_crank)
        else:
            from flywheel.sizing.speed_dependent import with_flywheel

            motion = with_flywheel(regime.machine, regime.constant, speed, on_crank, regime.rtol, regime.solved).run
    except NoMotionError:
        return SelectedWheel(wheel, None, 0.0, torque), wheel.warnings
    return SelectedWheel(wheel, motion.irregularity, motion.error, torque), wheel.warnings


# -- a diagram of areas ------------------------------------------------------------------------------------------------


def _of_diagram(scene: Scene, rtol: float, level: str, meter: Meter) -> Sizing:
    """Sizing from the areas of a turning-moment diagram: the machine's own inertia is not known and left out."""
    assert scene.areas is not None
    assert scene.speed is not None  # the reader sees to it
    works = np.array(scene.areas.values) * scene.areas.scale
    sums = np.concatenate(([0.0], works.cumsum()))
    fluctuation, square, left = float(np.ptp(sums)), scene.speed**2, float(works.sum())
    if not np.isfinite(sums).all():
        raise SceneError([Fault("areas", "works that are not finite", "values and a scale in proportion")])
    eps, ratio_square = scene.irregularity, scene.flywheel_ratio**2
    figure = None if eps is None else fluctuation / max(eps * square, 5e-324) / ratio_square
    closure = abs(left) / fluctuation if fluctuation else 0.0
    error = 4 * ROUNDING * (float(np.abs(works).sum()) / fluctuation if fluctuation else 0.0)
    error += closure if closure > error else 0.0  # what is left over may belong to any of the areas
    motion, own_inertia = None, 0.0
    if scene.inertia is not None:  # the irregularity from the fluctuation of energy alone: eps = fluctuation/(J w²)
        inertia = scene.inertia * ratio_square
        own_inertia = fluctuation / (inertia * square) if inertia else np.inf
        if own_inertia >= 2.0:
            defect = f"{scene.inertia} kg m², which the swing of {fluctuation:.6g} J would stop"
            raise SceneError([Fault("flywheel.inertia", defect, "enough inertia to keep turning", "give a larger one")])
        fastest, slowest = scene.speed * (1 + own_inertia / 2), scene.speed * (1 - own_inertia / 2)
        motion = Confirmation(own_inertia, fastest, slowest, route="areas")
    of_wheels, of_motion = (None, error) if figure is None else (error, None)
    errors = Errors(of_wheels, of_motion, of_wheels, of_wheels, of_wheels, error)
    remainder = f"{left:.3g} J of net work ({closure:.2g} of the swing)" if closure > 0.5 * error else ""
    inertia, irregularity = (scene.inertia or 0.0, own_inertia) if figure is None else (figure, eps or 0.0)
    built, of_wheel = _wheel(scene, inertia, scene.speed, irregularity, None, fluctuation, error)
    limits, binding = _limits(scene, figure, error, eps)
    return Sizing(
        scene=scene,
        speed=scene.speed,
        balance=None,
        power=None,
        drive_work=None,
        areas=tuple(Area(None, None, w, s) for w, s in zip(works.tolist(), sums[1:].tolist(), strict=True)),
        accumulated_max=float(sums.max()),
        accumulated_min=float(sums.min()),
        energy_fluctuation=fluctuation,
        coefficient_of_energy=None,
        angle_speed_max=None,
        angle_speed_min=None,
        reduced_inertia=None,
        flywheel=Flywheel(
            scene.flywheel_on,
            scene.inertia,
            figure,
            figure,
            figure,
            figure,
            figure,
            None if eps is None else fluctuation > 0.0,
        ),
        simulation=motion,
        error=errors,
        closure=closure,
        rtol=rtol,
        derived=DERIVED,
        messages=(*_missed(errors, rtol, remainder), *of_wheel),
        built=built,
        limits=limits,
        binding=binding,
        accuracy=level,
        cost=meter.cost,
        proof=_proof(scene) if level == levels.PROOF else None,
    )


# -- what follows from a sizing ------------------------------------------------------------------------------------------


def electrical_transients(sizing: Sizing) -> ElectricalTransients | None:
    """The same machine and flywheel with the fluxes and with the static curve; None for other motors, and without one."""
    scene, run, motor = sizing.scene, sizing.run, sizing.scene.motor
    static = None if motor is None else motor.static
    if static is None or run is None or scene.drive is None:
        return None
    inertia = run.inertia / scene.flywheel_ratio**2
    try:
        other = size(replace(scene, motor=static, irregularity=None, inertia=inertia, limits={}), simulate=False)
    except SceneError:
        return None
    if other.run is None or other.energy is None or sizing.energy is None:
        return None
    ratio = scene.shafts[scene.drive.on]

    def figures(one: Sizing) -> Iterator[tuple[float, float]]:
        """Irregularity, greatest torque and heat of the rotor, each with its relative error."""
        assert one.run is not None
        assert one.energy is not None
        drive = cells.fit(one.run.drive if one.run.drive is not None else np.zeros((1, cells.ORDER)))
        torque, heat, flow = cells.greatest(drive) / ratio, one.energy.rotor_heat or 0.0, one.power_flow
        scale = 0.0 if flow is None else flow.scale / (one.run.speed_min * ratio)
        of_energy = one.errors["energy"]
        assert isinstance(of_energy, float)
        off = of_energy * max(abs(torque), scale) + float(cells.tails(drive).max()) / ratio
        yield one.run.irregularity, one.run.error
        yield torque, off / max(abs(torque), 1e-300)
        yield heat, one.energy.errors.get("rotor_heat", 0.0)

    pairs = zip(figures(sizing), figures(other), strict=True)
    return ElectricalTransients(*(Beside(moving, still, max(off, beside)) for (moving, off), (still, beside) in pairs))


DERIVED = Derivations(as_dict, estimates, energy, engine, power_flow, electrical_transients, synchronism)
