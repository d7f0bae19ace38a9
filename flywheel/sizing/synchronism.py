"""How a synchronous motor keeps step over the steady cycle: its load angle, and its swing beside the load's harmonics.

A reciprocating load swings the rotor about the field. The synchronizing torque is a spring, so that the swing has a natural
frequency; a harmonic of the load near it is magnified. A heavier flywheel lowers that frequency, which takes the machine
away from resonance where it lies below the harmonic, and nearer to it where it lies above.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from bondgraph.records import NamedTuple
from flywheel.numerics import cells
from flywheel.numerics.cells import ROUNDING, Array

if TYPE_CHECKING:
    from flywheel.sizing.results import Sizing

ORDERS = 12
NEAR = 0.2
"""A harmonic whose frequency is less than this share off the natural frequency is near resonance."""

COUNTS = 0.05
"""Share of the greatest swing from which on a harmonic counts."""


class Harmonic(NamedTuple):
    """A harmonic of the moment at a constant speed: its order by the cycle, frequency (Hz), moment on the crank (N m).

    `swing` is the speed's amplitude (rad/s, crank) that it makes of a rotor held by nothing, `magnification` what the
    synchronizing torque and the damper winding make of that, by the linear swing about the mean load angle.
    """

    order: int
    frequency: float
    moment: float
    swing: float
    magnification: float


class Synchronism(NamedTuple):
    """Load angles (rad, electrical) over the steady cycle, and the swing about them.

    `load_angle` is the mean over time. `pull_out_share` is the greatest torque of the load angle over the pull-out torque.
    `natural_frequency` (Hz) and `damping_ratio` are those of small swings about the mean, with the mean inertia and the
    damper winding alone. `errors` are absolute for angles and relative for the others.
    """

    load_angle: float
    load_angle_greatest: float
    load_angle_least: float
    pull_out_angle: float
    pull_out_share: float
    natural_frequency: float
    damping_ratio: float
    harmonics: tuple[Harmonic, ...]
    errors: dict[str, float]

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {**self._asdict(), "harmonics": [one._asdict() for one in self.harmonics]}

    @property
    def counting(self) -> tuple[Harmonic, ...]:
        """The harmonics that count."""
        greatest = max((one.swing * one.magnification for one in self.harmonics), default=0.0)
        return tuple(one for one in self.harmonics if one.swing * one.magnification > COUNTS * greatest)

    @property
    def near_resonance(self) -> Harmonic | None:
        """The harmonic that counts, nearest to the natural frequency, where it is near; None where none is."""
        near = min(self.counting, key=lambda one: abs(one.frequency / self.natural_frequency - 1.0), default=None)
        return near if near is not None and abs(near.frequency / self.natural_frequency - 1.0) < NEAR else None

    @property
    def heavier_is_nearer(self) -> Harmonic | None:
        """The highest harmonic that counts below the natural frequency, to which a heavier flywheel lowers it; else None."""
        below = [one for one in self.counting if one.frequency < self.natural_frequency]
        return max(below, key=lambda one: one.frequency, default=None)


def synchronism(sizing: Sizing) -> Synchronism | None:
    """How a synchronous motor keeps step; None for another drive, and without a motion.

    Source: Kundur, Power System Stability and Control (1994), section 12.3 (natural frequency and damping ratio of the
    swing); Fitzgerald et al., Electric Machinery, 6th ed., chapter 5.
    """
    from flywheel.components.motors import Synchronous  # only machines with a motor pay for it

    scene, run, cycle = sizing.scene, sizing.run, sizing.cycle
    motor = scene.motor
    if not isinstance(motor, Synchronous) or run is None or run.along is None or run.cycle is None or scene.drive is None:
        return None
    cycle, ratio, angle = run.cycle, scene.shafts[scene.drive.on], cells.fit(run.along[0])
    omega = _speed(sizing)
    time, product = (cells.integral(row, cycle.mesh.half).sum() for row in (1.0 / omega, run.along[0] / omega))
    mean = float(product / time)
    off = (run.states_error[0] if run.states_error else 0.0) + float(cells.tails(angle).max()) + 8 * ROUNDING * math.pi
    greatest, least = cells.greatest(angle), -cells.greatest(-angle)
    torque = cells.fit(motor.synchronizing_torque(run.along[0]))
    peak = max(cells.greatest(torque), cells.greatest(-torque)) / motor.pull_out_torque
    inertia = (run.inertia + float(cells.integral(_inertia(sizing), cycle.mesh.half).sum()) / scene.cycle) / ratio**2
    natural = motor.swing_frequency(mean, inertia)
    damping = motor.damping / (2.0 * inertia * natural) if natural else math.inf
    stiffness = float(motor.stiffness(mean))
    bending = (motor.field_torque + 4.0 * motor.reluctance_torque) * off / max(abs(stiffness), 1e-300)
    of_natural = 0.5 * bending + run.error * run.irregularity + 32 * ROUNDING
    errors = {
        "load_angle": off * (1.0 + abs(mean)) + run.error * run.irregularity * float(np.abs(run.along[0]).max()),
        "load_angle_greatest": off,
        "load_angle_least": off,
        "pull_out_angle": 8 * ROUNDING,
        "pull_out_share": (motor.field_torque + 2.0 * motor.reluctance_torque)
        * off
        / motor.pull_out_torque
        / max(peak, 1e-3)
        + 8 * ROUNDING,
        "natural_frequency": of_natural,
        "damping_ratio": of_natural,
    }
    rows = harmonics(sizing, float(time), natural, damping, inertia * ratio**2)
    return Synchronism(mean, greatest, least, motor.pull_out_angle, peak, natural / (2 * math.pi), damping, rows, errors)


def _speed(sizing: Sizing) -> Array:
    """The crank's speed at the nodes of the motion's own cycle (rad/s)."""
    from flywheel.regime.turning_moment import speed_over_cycle

    run = sizing.run
    assert run is not None
    assert run.cycle is not None
    phi = run.cycle.mesh.phi
    return speed_over_cycle(run.cycle, run.speed or sizing.speed, run, phi.ravel()).reshape(phi.shape)


def _inertia(sizing: Sizing) -> Array:
    """I* at the nodes (kg m²)."""
    assert sizing.run is not None
    assert sizing.run.cycle is not None
    return np.asarray(sizing.run.cycle.series[2] @ cells.basis(cells.NODES, cells.ORDER).T)


def harmonics(sizing: Sizing, period: float, natural: float, damping: float, inertia: float) -> tuple[Harmonic, ...]:
    """The harmonics of what would accelerate the machine at a constant speed: F - ½ omega² dI*/dphi.

    Args:
        sizing: of the machine.
        period: time of a cycle, s.
        natural: angular frequency of the swing, rad/s.
        damping: damping ratio of the swing.
        inertia: mean J + I* on the crank, kg m².

    The magnification of harmonic k is |1/(1 - x² - 2 j zeta x)|, x the natural over the harmonic's frequency: of the speed
    of a rotor that a moment swings, J dw/dt + c w + K integral(w) = M, over that with c = K = 0.

    """
    even = sizing.constant or sizing.cycle
    if even is None:
        return ()
    moment, slope = even.series[:2] @ cells.basis(cells.NODES, cells.ORDER).T
    push = moment - 0.5 * (sizing.constant_speed or sizing.speed) ** 2 * slope
    mesh, turn, found = even.mesh, 2 * math.pi / sizing.scene.cycle, []
    for k in range(1, ORDERS + 1):
        wave = push * np.exp(-1j * k * turn * mesh.phi)
        real, imaginary = (float(cells.integral(part, mesh.half).sum()) for part in (wave.real, wave.imag))
        size = 2.0 * math.hypot(real, imaginary) / sizing.scene.cycle
        frequency = 2 * math.pi * k / period
        x = natural / frequency
        magnification = 1.0 / abs(complex(1.0 - x * x, -2.0 * damping * x if natural else 0.0))
        found.append(Harmonic(k, k / period, size, size / (inertia * frequency), magnification))
    return tuple(found)
