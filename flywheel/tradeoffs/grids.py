"""What a script does: a plain grid of angles, the trapezoidal rule, the greatest and the least sample."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from flywheel import constant_speed
from flywheel.instant import Anchor, Dynamics
from flywheel.machine import Machine
from flywheel.tradeoffs.question import Question

Array = NDArray[np.float64]


class Samples(NamedTuple):
    """A cycle on evenly spaced angles: W (J) and I* (kg m²) there, the crank's speed w (rad/s), and the unknown's value.

    `unit` is the unknown's change (SI) that changes the cycle's net work by one joule; 0 without an unknown.
    """

    phi: Array
    work: Array
    inertia: Array
    speed: float
    balance: float
    unit: float


def sampled(machine: Machine, count: int) -> Samples:
    """The cycle at `count` angles and its end; torques that depend on speed are taken at a constant one."""
    scene = machine.scene
    phi = np.linspace(0.0, scene.cycle, count + 1)
    reduced = machine.reduce(phi)
    moment, share, inertia = (part + 0.0 * phi for part in (reduced.moment, reduced.per_unknown, reduced.inertia))
    speed = scene.speed or 0.0
    if machine.sets_its_speed:
        pace, held = constant_speed.settled(machine)
        speed = pace or 0.0
        dynamics = Dynamics(machine, 0.0, held)
        dynamics.circuit = None  # at a constant speed a motor's current is steady
        anchor = Anchor(machine.anchors(phi), speed + 0.0 * phi, 0.0 * phi)
        moment, share = dynamics.along(phi, anchor, anchor.omega, anchor.time).moment, 0.0 * phi
        balance, unit = held, 0.0
    else:
        net = float(np.trapezoid(share, phi))
        balance = -float(np.trapezoid(moment, phi)) / net if net else 0.0
        unit = 1.0 / net if net else 0.0
    moment = moment + balance * share
    steps = 0.5 * (moment[1:] + moment[:-1]) * np.diff(phi)
    return Samples(phi, np.concatenate(([0.0], np.cumsum(steps))), inertia, speed, balance, unit)


def by_grid(asked: Question, count: int) -> float:
    """The answer from a plain grid."""
    samples = sampled(asked.machine, count)
    if asked.sized:
        return max(total(samples, asked.machine.scene.irregularity or 0.0), 0.0) / asked.crank
    omega = speeds(samples, (asked.machine.scene.inertia or 0.0) * asked.crank)
    return irregularity(omega)


def total(samples: Samples, eps: float) -> float:
    """Wittenbauer's flywheel (kg m² on the crank) of samples: [max(W - z+ w²I*/2) - min(W - z- w²I*/2)]/(eps w²)."""
    square = samples.speed**2
    energy = 0.5 * square * samples.inertia
    high = (samples.work - (1 + eps / 2) ** 2 * energy).max()
    low = (samples.work - (1 - eps / 2) ** 2 * energy).min()
    return float((high - low) / (eps * square))


def speeds(samples: Samples, inertia: float) -> Array:
    """Speeds (rad/s) at the samples with a flywheel (kg m² on the crank), at the level where their mean of extremes is w."""
    own = inertia + samples.inertia

    def pace(level: float) -> Array:
        return np.asarray(np.sqrt(np.maximum(2 * (level + samples.work) / own, 0.0)))

    def miss(level: float) -> float:
        omega = pace(level)
        return float(0.5 * (omega.max() + omega.min()) / samples.speed - 1)

    top = float(0.5 * own.max() * samples.speed**2 + np.abs(samples.work).max())
    return pace(float(brentq(miss, -float(samples.work.min()), 4 * top, xtol=1e-15 * top, rtol=1e-15)))


def irregularity(omega: Array) -> float:
    """2 (w_max - w_min)/(w_max + w_min)."""
    return float(2 * (omega.max() - omega.min()) / (omega.max() + omega.min()))
