"""Sizing and analysis of machines whose torques depend on speed, or whose meshes have losses.

The exact figures are those of the periodic motion itself, with the flywheel, the energy level and the balance solved for at
once (`flywheel.periodic`). The areas and the approximate flywheels take the torques at a constant crank speed.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flywheel import constant_speed, own_motion, piecewise, wittenbauer
from flywheel.faults import Fault, SceneError
from flywheel.machine import Machine
from flywheel.moments import Moments
from flywheel.own_motion import OwnMotion
from flywheel.periodic import Asked, NoRegimeError
from flywheel.results import Cyclic, Sizing
from flywheel.wittenbauer import Figures

_LEAST_DAMPING = 1e-12  # 1 less the multiplier: below it nothing is left of what holds the speed but rounding
_LIGHT = 1e-3  # of the machine's own inertia: where the iteration for a flywheel starts at the least


def settled(machine: Machine, rtol: float) -> Sizing:
    """All figures of such a machine that need no simulation, at estimated errors within rtol.

    Raises:
        SceneError: if it has no steady motion, and which kind of none: nothing holds a speed, the drive cannot carry the
            mean load, it stops within the cycle, it is unstable.

    """
    _check(machine)
    moments = Moments(machine, piecewise.cells(machine.mesh), local=True)
    speed, unknown, messages = _at_constant_speed(machine, moments)
    figures, _ = wittenbauer.refined(
        machine, lambda edges: constant_speed.resolve(machine, edges, speed), speed, rtol, lambda figures: None
    )
    start = figures.cycle.balance if figures.cycle.balance is not None else unknown
    motion = _motion(machine, figures, start, rtol)
    if motion is None:
        return _still(wittenbauer.assembled(machine, figures, None, rtol), messages)
    _check_stable(machine, motion)
    sizing = wittenbauer.assembled(machine, figures, motion.run, rtol)
    return _completed(sizing, figures, motion, messages)


def _still(sizing: Sizing, messages: tuple[str, ...]) -> Sizing:
    """The sizing of a machine in which nothing varies: what the figures hold is rounding."""
    wheel = sizing.flywheel._replace(
        exact=0.0,
        approximate=0.0,
        approximate_total=0.0,
        inertia_torque=0.0,
        needed=False,
        bracket=None,
        torque_bracket=None,
    )
    return replace(sizing, flywheel=wheel, messages=(*sizing.messages, *messages))


def _check(machine: Machine) -> None:
    scene = machine.scene
    if machine.depends_on_time:
        paths = [effort.path for effort in machine.efforts if effort.uses_time]
        advice = "follow it in time: flywheel simulate, or flywheel.simulate"
        raise SceneError(
            [
                Fault(path, "a law that depends on time, so that no cycle repeats", "a steady regime", advice)
                for path in paths
            ]
        )
    if not machine.depends_on_speed and scene.unknown is None:
        found = "losses in meshes, and nothing that makes up for them"
        advice = 'name the unknown: drive.torque = "balance", or give a motor'
        raise SceneError([Fault("shafts", found, "a balance, or torques that depend on speed", advice)])


def _at_constant_speed(machine: Machine, moments: Moments) -> tuple[float, float, tuple[str, ...]]:
    """The speed that the approximate figures hold for, the unknown there, and what is to be said of it."""
    scene = machine.scene
    if scene.unknown is None:
        speed, messages = constant_speed.chosen_speed(moments)
        return speed, 0.0, messages
    assert scene.speed is not None
    return scene.speed, constant_speed.balance_at(moments, scene.speed), ()


def _motion(machine: Machine, figures: Figures, unknown: float, rtol: float) -> OwnMotion | None:
    """The motion with the given flywheel, with the one that is needed, or with none where none is.

    None where nothing varies and nothing moves that could store energy.
    """
    scene, speed = machine.scene, figures.speed
    held = speed if scene.unknown is not None else None
    if scene.inertia is not None:
        return _found(machine, speed, Asked(scene.inertia * scene.flywheel_ratio**2, None, held), 0.0, unknown, rtol)
    if _weightless(machine, figures):
        return None
    least = _LIGHT * max(wittenbauer.reduced_inertia(figures).greatest, figures.scale)
    guess = max(figures.total - figures.cycle.inertia_at_start, least)
    asked = Asked(None, scene.irregularity, held)
    try:
        motion = _found(machine, speed, asked, guess, unknown, rtol)
    except SceneError:
        bare = _bare(machine, speed, held, unknown, rtol)
        if bare is None or bare.run.irregularity > (scene.irregularity or 0.0):
            raise
        return bare
    if motion.inertia > 0.0:
        return motion
    return _found(machine, speed, Asked(0.0, None, held), 0.0, unknown, rtol)


def _weightless(machine: Machine, figures: Figures) -> bool:
    """Whether the machine has no inertia of its own, and the loads do not vary."""
    cycle, swing = figures.cycle, figures.extremes.greatest[0] - figures.extremes.least[0]
    return float(np.abs(cycle.series[2]).max()) <= cycle.errors.inertia and swing <= 4 * cycle.errors.work


def _bare(machine: Machine, speed: float, held: float | None, unknown: float, rtol: float) -> OwnMotion | None:
    """The motion without any flywheel, where there is one."""
    try:
        return own_motion.found(machine, speed, Asked(0.0, None, held), 0.0, unknown, rtol)
    except NoRegimeError:
        return None


def _found(machine: Machine, speed: float, asked: Asked, guess: float, unknown: float, rtol: float) -> OwnMotion:
    try:
        return own_motion.found(machine, speed, asked, guess, unknown, rtol)
    except NoRegimeError:
        raise SceneError([_no_motion(machine, speed, asked, guess, unknown)]) from None


def _no_motion(machine: Machine, speed: float, asked: Asked, guess: float, unknown: float) -> Fault:
    """Why there is no motion: followed in time, the machine stalls or runs away; or the iteration did not settle."""
    from flywheel.fate import Fate, fate_of  # scipy arrives with time stepping, and only where it is needed

    scene = machine.scene
    sized = asked.inertia is None
    path = "flywheel.irregularity" if sized else "flywheel.inertia"
    inertia = guess if asked.inertia is None else asked.inertia
    wheel = f" with {'about ' if sized else ''}{inertia:.6g} kg m² on the crank"
    expected = "a motion that comes back to its speed each cycle"
    ending = fate_of(machine, speed, inertia, unknown)
    what = "motor" if scene.drive is not None and scene.unknown is None else "machine"
    if ending.fate is Fate.STALLS:
        found = f"a {what} that stalls {ending.where}, let go at {speed:.6g} rad/s{wheel}"
        return Fault(path, found, expected, "a heavier flywheel, a stronger drive, or a higher speed")
    if ending.fate is Fate.RUNS_AWAY:
        found = f"a machine that runs away, let go at {speed:.6g} rad/s{wheel}"
        return Fault(path, found, expected, "a heavier flywheel, or a drive whose torque falls with speed")
    advice = "a heavier flywheel; a torque that jumps at a speed, or falls very steeply with it, made less steep"
    return Fault(path, f"no periodic motion near {speed:.6g} rad/s{wheel}", expected, advice)


def _check_stable(machine: Machine, motion: OwnMotion) -> None:
    """Refuse a motion from which the machine would run away, where nothing else sets its speed."""
    if machine.scene.unknown is None and motion.solved.damping < -_LEAST_DAMPING:
        found = (
            f"an unstable regime at {motion.speed:.6g} rad/s: what a cycle changes grows {motion.solved.multiplier:.6g} fold"
        )
        raise SceneError(
            [Fault("drive", found, "a regime that the machine comes back to", "let the drive's torque fall with speed")]
        )


def _completed(sizing: Sizing, figures: Figures, motion: OwnMotion, messages: tuple[str, ...]) -> Sizing:
    """What goes beyond the figures of position-only machines: the multiplier, the constant-speed cycle, the exact wheel."""
    scene, errors, wheel = sizing.scene, sizing.error, sizing.flywheel
    solved = motion.solved
    if scene.irregularity is not None:
        exact = max(motion.inertia, 0.0) / scene.flywheel_ratio**2
        wheel = wheel._replace(exact=exact, needed=exact > 0.0, bracket=None, torque_bracket=None)
        errors = errors._replace(exact=motion.inertia_error if exact > 0.0 else motion.run.error)
    else:
        errors = errors._replace(simulation=motion.run.error)
    noted = list(messages)
    if scene.unknown is None and scene.speed is not None:
        share = 100 * (sizing.speed / scene.speed - 1)
        noted.append(
            f"the machine takes {sizing.speed:.10g} rad/s (mean of extremes), {share:+.4g} % off the speed asked for"
        )
    if scene.unknown is not None and solved.damping < -_LEAST_DAMPING:
        noted.append(
            f"held at its balance this regime is unstable: what a cycle changes grows {solved.multiplier:.6g} fold; "
            "it needs a governor"
        )
    cyclic = Cyclic(solved.multiplier, solved.damping, solved.steps, motion.level_error, figures.speed)
    return replace(
        sizing, flywheel=wheel, error=errors, cyclic=cyclic, constant=figures.cycle, messages=(*sizing.messages, *noted)
    )


def with_flywheel(sizing: Sizing, inertia: float) -> OwnMotion:
    """The motion of a sized machine with another flywheel (kg m² on the crank).

    Raises:
        NoRegimeError: where there is none.

    """
    machine = sizing.machine
    assert machine is not None
    assert sizing.constant is not None
    held = sizing.scene.speed if sizing.scene.unknown is not None else None
    reference = held or sizing.speed
    unknown = sizing.constant.balance or 0.0
    return own_motion.found(machine, reference, Asked(inertia, None, held), 0.0, unknown, 0.5 * sizing.rtol)
