"""One cycle without reduction: by the whole bond graph, or by Lagrange's multipliers on bodies in absolute coordinates.

In the graph every element has its own law. With multipliers joints are equations, put back after every step; loads come in
as the torque at the crank that does the same work, and what turns in a constant ratio as inertia of the crank.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bondgraph.motion.simulation import Run
from bondgraph.motion.stepping import instant
from flywheel.machine.dynamics import Dynamics, circuit_of
from flywheel.machine.machine import Machine
from flywheel.mechanisms.families import has_joints
from flywheel.mechanisms.linkages import multibody
from flywheel.mechanisms.linkages.families import linkage_of
from flywheel.mechanisms.linkages.multibody import MULTIPLIERS
from flywheel.mechanisms.linkages.multibody import Run as MultibodyRun
from flywheel.motion.compliance import followed
from flywheel.scene.linkage import Linkage
from flywheel.study.steppers import NoAnswerError, Revolution, Revolve, Stretch, Trial, stretches_of, summit

Array = NDArray[np.float64]

_LONGER = (1.02, 1.3, 3.0, 10.0)  # than the period expected: how long the motion is followed, until the cycle is over
_ARMATURE = "drive.motor.armature"


def whole(machine: Machine, rtol: float) -> Revolve:
    """Runs cycles by `bondgraph.simulate` on the machine's own graph."""
    scene = machine.scene
    cycle = scene.cycle

    def revolve(trial: Trial) -> Revolution:
        start = (0.0, trial.speed, trial.current)
        for longer in _LONGER:
            inertia = trial.inertia / scene.flywheel_ratio**2
            run = followed(machine, start, longer * trial.period, inertia, trial.balance, rtol)
            last = float(run.t[-1])
            if float(run.displacement("phi", np.array([last]))[0]) >= cycle:
                return _ended(run, cycle, circuit_of(scene) is not None)
        raise NoAnswerError("the machine does not get through its cycle")

    return revolve


def _ended(run: Run, cycle: float, with_current: bool) -> Revolution:
    def beyond(t: float) -> float:
        return float(run.displacement("phi", np.array([t]))[0]) - cycle

    def omega(times: Array) -> Array:
        return np.asarray(run.flow("crank", times))

    end = instant(beyond, 0.0, float(run.t[-1]))
    current = float(run.flow(_ARMATURE, np.array([end]))[0]) if with_current else 0.0
    times = np.append(run.t[run.t < end], end)
    greatest, least = (summit(omega, times, sign) for sign in (1.0, -1.0))
    return Revolution(float(omega(np.array([end]))[0]), current, greatest, least)


# -- Lagrange's multipliers -------------------------------------------------------------------------------------------

_SLACK = (1.1, 1.5, 3.0, 10.0)
_ANGLES = 13
_SAME = 1e-9


def obstacle(machine: Machine) -> str | None:
    """Why a machine cannot be followed so; None where it can."""
    scene = machine.scene
    if len(scene.mechanisms) != 1:
        return "it takes machines with one mechanism"
    mechanism = scene.mechanisms[0]
    if not has_joints(mechanism):
        return f"a {mechanism.type} has no bodies to join"
    if scene.shafts[mechanism.shaft] != 1.0:
        return "it takes mechanisms that turn with the crank"
    if circuit_of(scene) is not None or any(value < 1.0 for value in scene.efficiencies.values()):
        return "it takes no motor's current and no losses in meshes"
    if machine.friction is not None:
        return "it takes joints without friction"
    if _added(machine) is None:
        return "it takes no inertia on ports beside the bodies' own"
    return None


def _added(machine: Machine) -> float | None:
    """Inertia on the crank (kg m²) beside the mechanism's bodies; None where it varies."""
    scene = machine.scene
    bare = Machine(replace(scene, inertias=(), loads=(), springs=(), dampers=(), drive=None, motor=None))
    phi = np.linspace(0.1, scene.cycle - 0.1, _ANGLES)
    whole, own = (np.asarray(part.reduce(phi).inertia + 0.0 * phi) for part in (machine, bare))
    added = whole - own
    return float(added.mean()) if np.ptp(added) <= _SAME * (np.abs(whole).max() + 1e-300) else None


def by_multipliers(machine: Machine, rtol: float, restart: bool) -> Revolve:
    """Runs cycles by `flywheel.multibody` on the machine's mechanism as a linkage."""
    scene, mechanism = machine.scene, machine.scene.mechanisms[0]
    linkage, added = linkage_of(mechanism), _added(machine) or 0.0
    stretches = stretches_of(machine, restart)

    def revolve(trial: Trial) -> Revolution:
        heavier = _with_inertia(linkage, trial.inertia + added)
        dynamics = Dynamics(machine, trial.inertia, trial.balance)
        omega, extremes = trial.speed, list[float]()
        for stretch in stretches:
            share = (stretch.high - stretch.low) / scene.cycle
            drive = _drive(dynamics, mechanism.phase, stretch)
            for longer in _SLACK:
                start, until = stretch.low + mechanism.phase, longer * share * trial.period
                run = multibody.simulate(heavier, MULTIPLIERS, start, omega, until, drive=drive, rtol=rtol)
                if run.q[-1] - mechanism.phase >= stretch.high:
                    break
            else:
                raise NoAnswerError("the machine does not get through its cycle")
            omega, *found = _end_state(run, stretch.high + mechanism.phase)
            extremes += found
        return Revolution(omega, 0.0, max(extremes), min(extremes))

    return revolve


def _drive(dynamics: Dynamics, phase: float, stretch: Stretch) -> Callable[[float, float, float], float]:
    """The torque at the crank (N m) that does what all loads do, as a law of the driver's coordinate and rate."""
    machine, ends = dynamics.machine, (stretch.low, stretch.high)

    def drive(t: float, q: float, qdot: float) -> float:
        phi = q - phase
        if stretch.middle is not None:
            return float(dynamics.at(phi, stretch.middle, qdot, ends=ends).moment)
        phi = phi % machine.scene.cycle
        return float(dynamics.at(phi, float(machine.anchors(phi)), qdot).moment)

    return drive


def _with_inertia(linkage: Linkage, inertia: float) -> Linkage:
    """The linkage with more inertia (kg m²) on the body that its driver turns."""
    joint = next(joint for joint in linkage.joints if joint.name == linkage.driver)
    links = tuple(
        link._replace(inertia=link.inertia + inertia) if link.name == joint.second else link for link in linkage.links
    )
    return replace(linkage, links=links)


def _end_state(run: MultibodyRun, last: float) -> tuple[float, float, float]:
    """The driver's rate where it reaches a coordinate, and the greatest and least on the way."""
    until = float(run.t[-1])
    end = instant(lambda t: float(run.at(t)[0][0]) - last, 0.0, until)
    times = np.append(run.t[run.t < end], end)

    def omega(wanted: Array) -> Array:
        return np.asarray(run.at(wanted)[1])

    greatest, least = (summit(omega, times, sign) for sign in (1.0, -1.0))
    return float(run.at(end)[1][0]), greatest, least
