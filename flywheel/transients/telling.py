"""How a motion ended, and the figures that are told of it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from flywheel.advice import told
from flywheel.following import Start, Trail, end_of_stroke
from flywheel.machine import Machine
from flywheel.scene import TURN
from flywheel.simulation import Motion
from flywheel.transients.conditions import Until
from flywheel.transients.goals import Setting, at_rest, limit_of, pushes, target_of
from flywheel.transients.looking import Samples, Works, close, peak, sampled, worked
from flywheel.transients.record import Energy, Peaks, Transient

Array = NDArray[np.float64]

SHARE = 0.95
_SUDDEN = 1e-6  # of the time gone: a machine that would stop within this has stopped


def told_of(setting: Setting, motion: Motion, goal: Until, rtol: float) -> Transient:
    """A motion with how it ended, its peaks, its energy, and the time that it took to its regime."""
    trail, scene = motion.trail, setting.machine.scene
    assert trail is not None
    reason, ended = _ending(setting, trail, motion, goal)
    samples, owners = close(trail)
    steady = None if setting.regime is None else setting.regime.speed
    origin = scene.origin
    return Transient(
        scene=scene,
        motion=motion._replace(phi=motion.phi + origin) if origin else motion,
        ended=ended,
        reason=reason,
        inertia=setting.inertia,
        balance=setting.balance,
        regime_speed=steady,
        time_to_regime=None if steady is None else reached(trail, SHARE * steady, samples.t, samples.omega),
        peaks=peaks_of(trail, samples, owners),
        energy=energy_of(worked(trail), samples.kinetic),
        rtol=rtol,
        messages=tuple(_messages(setting, motion, trail.start, rtol)),
        given_errors=_given_errors(setting),
    )


def _given_errors(setting: Setting) -> dict[str, float | None]:
    """Errors, in their own units, of what a motion is followed with: its flywheel, its balance, the speed of its regime."""
    steady = setting.regime
    return {
        "flywheel": setting.inertia * setting.inertia_error,
        "balance": None if setting.machine.scene.unknown is None else abs(setting.balance) * setting.balance_error,
        "regime_speed": None if steady is None else steady.speed * (steady.sizing.error.simulation or 0.0),
    }


def peaks_of(trail: Trail, samples: Samples, owners: NDArray[np.intp]) -> Peaks:
    """Greatest speed, and of a driven machine torque, power and current."""
    drives = trail.dynamics.machine.scene.drive is not None
    wanted = {"omega": True, "drive": drives, "power": drives, "current": samples.current is not None}
    speed, *others = (peak(trail, name, samples, owners) if told else None for name, told in wanted.items())
    assert speed is not None
    return Peaks(speed, *others)


def _messages(setting: Setting, motion: Motion, start: Start, rtol: float) -> Iterator[str]:
    """What is to be said beside the figures."""
    if motion.error > rtol:
        yield f"rtol {rtol:.1g} not reached: the motion is good to {motion.error:.2g} (estimated, relative)"
    if start.omega == 0.0 and start.current > 0.0:
        held = f"{start.current:.6g} A, with which its motor carries the load at rest"
        yield f"held at rest until the current has risen to {held}; time counts from then on"
    if setting.regime is None and setting.machine.scene.stroke is None and setting.no_regime:
        yield f"no regime: {setting.no_regime}"


def _ending(setting: Setting, trail: Trail, motion: Motion, goal: Until) -> tuple[str, str]:
    """How a motion ended: in one word, and in a sentence."""
    machine = setting.machine
    last, omega = float(trail.t[-1]), float(motion.omega[-1])
    phi = float(motion.phi[-1])
    at = f"at {_place(machine, phi)} after {last:.6g} s"
    if trail.stuck or trail.goal == "stop":
        return _stopped(setting, trail, at, last, omega)
    if machine.scene.stroke is not None and trail.goal is None and last < limit_of(setting, trail.start, goal):
        return "stroke", end_of_stroke(machine.scene, phi + machine.scene.origin, last)
    if trail.goal == "settled":
        return "limit", f"settled to its regime without reaching {_speed(target_of(setting, goal))}: {_speed(omega)} {at}"
    if trail.goal == "limit" or (trail.goal is None and goal.kind != "time"):
        wanted = {"regime": "its regime", "stop": "a stop"}.get(goal.kind, "what was asked for")
        return "limit", f"did not come to {wanted} within {(phi - trail.start.phi) / TURN:.6g} turns and {last:.6g} s"
    if trail.goal == "steady":
        return "limit", f"does not slow down to a stop: {omega:.6g} rad/s {at}, as a cycle before"
    if trail.goal == "regime":
        return "regime", f"settled to its regime after {last:.6g} s, {(phi - trail.start.phi) / TURN:.6g} turns"
    if trail.goal in ("speed", "share"):
        return trail.goal, f"reached {_speed(omega)} {at}"
    return trail.goal or "time", f"ended {at}, at {omega:.6g} rad/s"


def _stopped(setting: Setting, trail: Trail, at: str, last: float, omega: float) -> tuple[str, str]:
    states = trail.states(np.array([last]))
    own = setting.machine
    dynamics = setting.dynamics
    begin = Start(float(states[0, 0]), 0.0, float(states[3, 0]) if states.shape[0] > 3 else 0.0)
    acceleration = abs(float(sampled(trail, np.array([last])).acceleration[0]))
    if trail.start.omega > 0.0 and omega > 0.0 and omega > _SUDDEN * last * acceleration:
        return "creep", f"slows down for ever, as only what grows with speed brakes it: {omega:.3g} rad/s {at}"
    if own.scene.drive is None:
        return "stop", f"stopped {at}"
    if not pushes(dynamics, trail, last):
        return "stop", f"stopped {at}, where its drive no longer pushes it on"
    moment, _ = at_rest(dynamics, begin, last)
    lossy = any(stage.efficiency < 1.0 for stage in own.stages)
    return "stall", f"stalled {at}: M* at rest is {moment:.6g} N m{', before losses in meshes' if lossy else ''}"


def _speed(omega: float) -> str:
    return f"{omega:.6g} rad/s ({omega * 60 / TURN:.6g} rpm)"


def _place(machine: Machine, phi: float) -> str:
    """A position in words, within the cycle."""
    scene = machine.scene
    if scene.stroke is not None:
        return told(phi + scene.origin, scene.stroke.sliding)
    return machine.where(phi % scene.cycle)


def reached(trail: Trail, speed: float, times: Array, omega: Array) -> float | None:
    """The first time at which a speed is reached."""
    above = np.flatnonzero(omega >= speed)
    if not above.size:
        return None
    if above[0] == 0:
        return 0.0
    from scipy.optimize import brentq

    low, high = float(times[above[0] - 1]), float(times[above[0]])
    if low == high:  # both sides of a switch
        return low
    return float(brentq(lambda t: float(trail.states(np.array([t]))[1, 0]) - speed, low, high, xtol=1e-300, rtol=1e-14))


def energy_of(works: Works, kinetic: Array) -> Energy:
    """Works and heats with the kinetic energy gained, and how far they close."""
    gained = float(kinetic[-1] - kinetic[0])
    parts = dict(works.by_part)
    drive = parts.pop("drive", 0.0)
    total = drive + sum(parts.values()) - works.meshes
    scale = max([float(kinetic.max()), abs(drive), *map(abs, parts.values()), 1e-300])
    return Energy(drive, parts, works.meshes, gained, abs(total - gained) / scale, works.copper, works.rotor)
