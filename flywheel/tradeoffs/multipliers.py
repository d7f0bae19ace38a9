"""One cycle by Lagrange's multipliers: all bodies in absolute coordinates, joints as equations, put back after every step.

Bodies, joints and inertia forces are followed without any reduction. Loads come in as the torque at the crank that does the
same work, and what turns in a constant ratio as inertia of the crank.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from flywheel import multibody
from flywheel.instant import Dynamics
from flywheel.linkage.description import Linkage
from flywheel.linkage.named import linkage_of
from flywheel.machine import Machine
from flywheel.moments import circuit_of
from flywheel.multibody import MULTIPLIERS
from flywheel.multibody.running import Run
from flywheel.tradeoffs.shooting import NoAnswerError, Revolution, Revolve, Stretch, Trial, stretches_of, summit

Array = NDArray[np.float64]

_LONGER = (1.1, 1.5, 3.0, 10.0)
_ANGLES = 13
_SAME = 1e-9


def obstacle(machine: Machine) -> str | None:
    """Why a machine cannot be followed so; None where it can."""
    scene = machine.scene
    if len(scene.mechanisms) != 1:
        return "it takes machines with one mechanism"
    mechanism = scene.mechanisms[0]
    if mechanism.type == "law":
        return "a law has no bodies to join"
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
            for longer in _LONGER:
                start, until = stretch.low + mechanism.phase, longer * share * trial.period
                run = multibody.simulate(heavier, MULTIPLIERS, start, omega, until, drive=drive, rtol=rtol)
                if run.q[-1] - mechanism.phase >= stretch.high:
                    break
            else:
                raise NoAnswerError("the machine does not get through its cycle")
            omega, *found = _ended(run, stretch.high + mechanism.phase)
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


def _ended(run: Run, last: float) -> tuple[float, float, float]:
    """The driver's rate where it reaches a coordinate, and the greatest and least on the way."""
    until = float(run.t[-1])
    end = float(brentq(lambda t: float(run.at(t)[0][0]) - last, 0.0, until, xtol=1e-15 * until, rtol=1e-15))
    times = np.append(run.t[run.t < end], end)

    def omega(wanted: Array) -> Array:
        return np.asarray(run.at(wanted)[1])

    greatest, least = (summit(omega, times, sign) for sign in (1.0, -1.0))
    return float(run.at(end)[1][0]), greatest, least
