"""The flywheel of a scene: sized or analysed, exactly and approximately, and confirmed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from flywheel.machine.machine import Machine
from flywheel.numerics.budget import Cost, metered, unmeasured
from flywheel.numerics.cells import ROUNDING
from flywheel.numerics.faults import Fault, SceneError
from flywheel.regime import steady_motion, turning_moment, wittenbauer
from flywheel.regime.joint_friction import machine_of
from flywheel.regime.results import Area, Confirmation, Errors, Flywheel, Sizing
from flywheel.scene import accuracy as dial
from flywheel.scene.scene import Scene

_FRICTION = "friction in joints is taken at a constant crank speed of {:.6g} rad/s, and so is its share of the moment"

_OF_FLYWHEELS = ("exact", "approximate", "inertia_torque", "inertia_torque_flywheel")  # errors by name


def size(
    machine: Machine | Scene,
    rtol: float | None = None,
    *,
    simulate: bool | None = None,
    accuracy: str | None = None,
) -> Sizing:
    """Size (or analyse) the flywheel of a machine, and confirm it by a time simulation unless told not to.

    Exact:        I = [max(W - z+ w²I*/2) - min(W - z- w²I*/2)]/(eps w²), z± = (1 ± eps/2)²
    Approximate:  I = (max W - min W)/(eps w²) - min I*
    with W(phi) the integral of M*, w the mean of extremes (rad/s), I* the reduced inertia (kg m²), eps the irregularity.

    Args:
        machine: a `Machine`, or a `Scene`, of which one is then built.
        rtol: relative accuracy asked of every figure; the scene's own if None.
        simulate: whether to confirm by time stepping (accuracy "audit", or else "normal").
        accuracy: "normal", or "fast": the exact figures; "confirm": these and the motion by periodic collocation on other
            cells; "audit", which is taken if None: the exact figures and the motion stepped in time. An analysis at "normal"
            has its motion by quadrature.

    Raises:
        SceneError: if the machine cannot run as the scene says (net work, balance without effect, values not finite).
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
    level = dial.level(accuracy, simulate)
    scene = machine.scene if isinstance(machine, Machine) else machine
    if not isinstance(scene, Scene):
        raise TypeError(f"expected a Machine or a Scene (flywheel.load makes one), found {type(machine).__name__}")
    turning_moment.check_cycle(scene)
    asked = _checked(scene.rtol if rtol is None else rtol)
    try:
        with np.errstate(all="ignore"), metered() as whole:  # values that are not finite are reported with their place
            if scene.areas is not None:
                sizing = _noted(replace(_from_areas(scene, asked), accuracy=level))
            else:
                sizing = _of_machine(machine, asked, level)
            sizing = _built(sizing)
    except ArithmeticError:
        found = "numbers whose products leave the floating-point range"
        raise SceneError([Fault("scene", found, "masses, lengths and speeds in proportion", "check the units")]) from None
    cost = Cost(*whole.cost[:2], sizing.cost.stages)
    return replace(sizing, left_out=dial.left_out(sizing), cost=cost)


def _built(sizing: Sizing) -> Sizing:
    """The sizing with the wheel that the scene asks for, where its inertia is known."""
    if sizing.scene.wheel is None:
        return sizing
    with unmeasured():
        from flywheel.sizing.wheel import with_wheel  # only scenes that ask for a wheel pay for it

    return with_wheel(sizing)


def _checked(rtol: float) -> float:
    if faults := dial.rtol_faults(rtol):
        raise SceneError(faults)
    return float(rtol)


def _of_machine(given: Machine | Scene, asked: float, level: str) -> Sizing:
    with metered() as first:
        machine = machine_of(given)
        scene = machine.scene
        sizing = _evened(replace(_settled(machine, asked), accuracy=level))
    if told := (*_redundant(scene), *(() if scene.motor is None else scene.motor.doubts)):
        sizing = replace(sizing, messages=(*sizing.messages, *told))
    inner = sizing.cost.stages
    with metered() as second:
        sizing = _followed(sizing)
    sizing = _noted(_with_friction(sizing, machine))
    stages = {"figures": first.cost._replace(stages=inner), "simulation": second.cost}
    return replace(sizing, cost=Cost(0, 0.0, stages))


def _followed(sizing: Sizing) -> Sizing:
    """The sizing with its motion as the level of accuracy asks; a machine without inertia brings its own."""
    if sizing.simulation is not None:
        wanted = sizing.scene.inertia is not None or sizing.accuracy in (dial.AUDIT, dial.CONFIRM)
        error = sizing.error._replace(simulation=None, period=None)
        return sizing if wanted else replace(sizing, simulation=None, error=error)
    if sizing.accuracy == dial.AUDIT:
        return _confirmed(sizing)
    if sizing.accuracy == dial.CONFIRM:
        return _collocated(sizing)
    return sizing if sizing.scene.inertia is None else _by_quadrature(sizing)


def _collocated(sizing: Sizing) -> Sizing:
    """The sizing confirmed by collocation; by quadrature, saying so, where the iteration finds no motion."""
    with unmeasured():
        from flywheel.numerics.budget import BudgetError
        from flywheel.sizing.confirmation import collocated  # only this level pays for Newton's method
    from flywheel.regime.steady_motion import NoMotionError

    try:
        return collocated(sizing)
    except BudgetError:
        return _unconfirmed(sizing, "not confirmed by collocation: the motion takes too long to find on cells of its own")
    except NoMotionError:
        return _unconfirmed(sizing, "not confirmed by collocation: on cells of its own the iteration finds no motion")


def _confirmed(sizing: Sizing) -> Sizing:
    """The sizing confirmed in time; by quadrature, saying so, where the motion cannot be stepped."""
    with unmeasured():
        from flywheel.regime.one_cycle import SlidingError
        from flywheel.sizing.confirmation import (  # scipy arrives with time stepping, and not before
            UnconfirmedError,
            confirmed,
        )

    try:
        return confirmed(sizing)
    except UnconfirmedError as error:
        why = str(error)
    except SceneError as error:  # the figures stand without it
        why = f"stepping finds {error.faults[0].found}"
    except SlidingError:
        jumps = sizing.machine is not None and sizing.machine.sets_its_speed
        slides = "the motion slides along a law that jumps at a speed; make it steep instead"
        why = slides if jumps else "the motion takes too many steps"
    return _unconfirmed(sizing, f"not confirmed in time: {why}")


def _unconfirmed(sizing: Sizing, message: str) -> Sizing:
    """The sizing with its motion by quadrature in place of a confirmation, and why."""
    return replace(_by_quadrature(sizing), messages=(*sizing.messages, message))


def _settled(machine: Machine, asked: float) -> Sizing:
    """The figures without simulation, by the cheapest formulation that the machine allows."""
    if not (machine.sets_its_speed or machine.depends_on_time):
        return wittenbauer.settled(machine, asked)
    with unmeasured():
        from flywheel.sizing import speed_dependent  # only machines that set their own speed pay for it

    return speed_dependent.settled(machine, asked)


def _evened(sizing: Sizing) -> Sizing:
    """The sizing, where nothing but rounding varies the speed, of the even motion: no flywheel, irregularity 0."""
    cycle, inertia, run = sizing.constant or sizing.cycle, sizing.reduced_inertia, sizing.run
    if cycle is None or inertia is None:
        return sizing
    errors, speed = cycle.errors, sizing.speed
    if sizing.energy_fluctuation > 4 * errors.work or inertia.greatest - inertia.least > max(
        4 * errors.variation, errors.inertia
    ):
        return sizing
    even = run and run._replace(irregularity=0.0, speed_max=speed, speed_min=speed, offset=0.0, error=0.0)
    if sizing.scene.irregularity is None:
        return replace(sizing, run=even)
    bare = None if even is None or inertia.greatest <= errors.inertia else even._replace(inertia=0.0)
    wheel = Flywheel(sizing.flywheel.on, None, 0.0, 0.0, 0.0, 0.0, 0.0, needed=False)
    error = sizing.error._replace(**dict.fromkeys(_OF_FLYWHEELS, sizing.error.work))
    return replace(sizing, flywheel=wheel, run=bare, error=error)


def _redundant(scene: Scene) -> Iterator[str]:
    """What is to be said of linkages that are held more often than needed."""
    for mechanism in scene.mechanisms:
        if mechanism.linkage is not None:
            from flywheel.mechanisms.linkage import followed  # only scenes with linkages pay for it

            found = followed(mechanism).solution.mobility
            if found.redundant:
                what = "; ".join(found.redundant)
                yield f"{mechanism.name} has redundant constraints (Gruebler counts {found.gruebler}, not 1): {what}"


def _with_friction(sizing: Sizing, machine: Machine) -> Sizing:
    """What is to be said of friction in joints, and what the fit of its moment adds to every error."""
    if machine.friction is None:
        return sizing
    doubt = machine.friction.error
    swing = max(sizing.energy_fluctuation, 1e-300)
    exchanged = swing if sizing.cycle is None else max(sizing.cycle.exchanged, 1e-300)

    def grown(error: float | None, scale: float) -> float | None:
        return None if error is None else error + 2 * doubt / scale

    errors = sizing.error._replace(
        work=grown(sizing.error.work, exchanged),
        **{name: grown(getattr(sizing.error, name), swing) for name in (*_OF_FLYWHEELS, "simulation")},
    )
    message = _FRICTION.format(sizing.speed)
    return replace(sizing, error=errors, messages=(*sizing.messages, message))


def _noted(sizing: Sizing) -> Sizing:
    """The sizing with a message for every figure whose estimated error is above rtol; one where that is left-over work."""
    names = {"exact": "exact inertia", "approximate": "approximate inertia", "inertia_torque": "inertia-torque figure"}
    names |= {"inertia_torque_flywheel": "flywheel by the inertia torque", "work": "work", "simulation": "simulation"}
    good = [
        f"the {title} is good to {error:.2g}"
        for name, title in names.items()
        if (error := getattr(sizing.error, name)) is not None and error > sizing.rtol
    ]
    if not good:
        return sizing
    left = _left_over(sizing)
    missed = [f"rtol {sizing.rtol:.1g} not reached: {what} (estimated, relative)" for what in good]
    if left:
        missed = [f"rtol {sizing.rtol:.1g} not reached: {left}, and may belong anywhere in it: {', '.join(good)}"]
    return replace(sizing, messages=(*missed, *sizing.messages))


def _left_over(sizing: Sizing) -> str:
    """The work that a cycle does not close by, in words; nothing where no more than rounding is left over."""
    if sizing.scene.areas is not None:
        left, share = sum(area.work for area in sizing.areas), "swing"
        found = sizing.closure > 0.5 * (sizing.error.work or 0.0)
    else:
        left, share = (0.0, "") if sizing.cycle is None else (sizing.cycle.net, "work exchanged")
        found = sizing.cycle is not None and sizing.cycle.errors.residual > 0.0
    return f"{left:.3g} J of net work ({sizing.closure:.2g} of the {share}) are left over in the cycle" if found else ""


def _by_quadrature(sizing: Sizing) -> Sizing:
    """The confirmation of an analysis without time stepping: irregularity in closed form, time by quadrature."""
    machine, cycle, motion = sizing.machine, sizing.cycle, sizing.run
    if machine is None or cycle is None or motion is None:
        return sizing
    period, doubt = steady_motion.period(cycle, sizing.speed, motion, sizing.rtol)
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
    assert scene.speed is not None  # the reader sees to it
    works = np.array(scene.areas.values) * scene.areas.scale
    sums = np.concatenate(([0.0], works.cumsum()))
    swing = float(np.ptp(sums))
    if not np.isfinite(sums).all():
        raise SceneError([Fault("areas", "works that are not finite", "values and a scale in proportion")])
    eps, square = scene.irregularity, scene.speed**2
    figure = None if eps is None else swing / max(eps * square, 5e-324) / scene.flywheel_ratio**2
    needed = None if eps is None else swing > 0.0
    closure = abs(float(works.sum())) / swing if swing else 0.0
    error = 4 * ROUNDING * (float(np.abs(works).sum()) / swing if swing else 0.0)
    error += closure if closure > error else 0.0  # what is left over may belong to any of the areas
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
        flywheel=Flywheel(scene.flywheel_on, scene.inertia, figure, figure, figure, figure, figure, needed),
        simulation=None if scene.inertia is None else _swing_of(scene, swing),
        error=Errors(
            **dict.fromkeys(_OF_FLYWHEELS, None if figure is None else error),
            simulation=None if scene.inertia is None else error,
            work=error,
        ),
        closure=closure,
        rtol=rtol,
    )


def _swing_of(scene: Scene, swing: float) -> Confirmation:
    """Irregularity from the swing of energy alone: eps = swing/(J w²)."""
    inertia, speed = (scene.inertia or 0.0) * scene.flywheel_ratio**2, scene.speed or 0.0
    eps = swing / (inertia * speed**2) if inertia else np.inf
    if eps >= 2.0:
        found = f"{scene.inertia} kg m², which the swing of {swing:.6g} J would stop"
        raise SceneError([Fault("flywheel.inertia", found, "enough inertia to keep turning", "give a larger one")])
    return Confirmation(eps, None, speed * (1 + eps / 2), speed * (1 - eps / 2), None, None, None, "areas")
