"""Power and energy of a sized machine's drive over its steady cycle."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from flywheel import piecewise, steady
from flywheel.energy import Energy
from flywheel.motors.dc import DC
from flywheel.motors.induction import Induction
from flywheel.piecewise import ROUNDING, Array, Cells

if TYPE_CHECKING:
    from flywheel.regime import Cycle
    from flywheel.results import Sizing
    from flywheel.steady import Run

_TIE = 1e-9  # share within which two sizes are one
_LEVEL_ROUNDING = 4 * ROUNDING  # of the energy's level
_MOST_CELLS = 4_000  # that a mean over time is worth, beside those of the cycle itself
_MOST_HALVINGS = 40  # of a cell


@np.errstate(all="ignore")  # a result asks for it after its sizing is over
def energy_of(sizing: Sizing) -> Energy | None:
    """Mean and peak power and rms torque with the flywheel; powers of a motor that follows the loads without one.

    None for a machine without a drive, a motion that runs on or a cycle (a diagram of areas). Peaks are found where the
    slope of power is zero, and at the ends of smooth pieces.
    """
    cycle, run, machine = sizing.cycle, sizing.run, sizing.machine
    if cycle is None or run is None or machine is None or machine.scene.drive is None:
        return None
    mesh, speed = cycle.mesh, sizing.speed
    omega = steady.speed_over_cycle(cycle, speed, run, mesh.phi.ravel()).reshape(mesh.phi.shape)
    if not omega.min() > 0.0:  # rounding of enormous torques has stopped it
        return None
    drive = moment_of_drive(sizing)
    period, _ = steady.period(cycle, speed, run, sizing.rtol)
    work = _told(float(piecewise.integral(drive, mesh.half).sum()), cycle.errors.work)
    moment = cycle.series[0] @ piecewise.basis(piecewise.NODES, piecewise.ORDER).T
    follows = drive - moment  # what the loads and losses take, and a motor without a flywheel would have to give
    alone = _told(float(piecewise.integral(follows, mesh.half).sum()), cycle.errors.work) / machine.scene.cycle * speed
    noise = cycle.errors.work / machine.scene.cycle  # of a moment
    figures = Energy(
        period=period,
        work=work,
        mean_power=work / period,
        peak_power=_told(_peak(drive * omega), noise * speed),
        mean_power_alone=alone,
        peak_power_alone=_told(_peak(follows * speed), noise * speed),
        rms_torque=_told(_rms(drive, omega, mesh.half), noise) / machine.scene.shafts[machine.scene.drive.on],
    )
    return _heated(figures, _Course(sizing, cycle, run))


def moment_of_drive(sizing: Sizing) -> Array:
    """The drive's moment on the crank (N m) along the motion, at the cycle's nodes."""
    cycle, run, machine = sizing.cycle, sizing.run, sizing.machine
    assert cycle is not None
    assert machine is not None
    if run is not None and run.drive is not None:
        return run.drive
    pace = sizing.speed if machine.depends_on_speed else None
    moments = machine.reduction.moments(cycle.mesh.phi, cycle.mesh.anchor, cycle.balance or 0.0, speed=pace)
    return np.asarray(moments["drive"] + np.zeros_like(cycle.mesh.phi))


def _rms(moment: Array, omega: Array, half: Array) -> float:
    """Root of the mean square of a moment (N m) over time: sqrt(integral of M²/omega dphi / integral of 1/omega dphi)."""
    greatest = float(np.abs(moment).max()) or 1.0  # squares of enormous moments leave the floating-point range
    share = moment / greatest
    square, time = (float(piecewise.integral(values, half).sum()) for values in (share**2 / omega, 1.0 / omega))
    return greatest * float(np.sqrt(square / time))


# -- what heats the motor ----------------------------------------------------------------------------------------------


class _Course:
    """A motor along the steady motion: its shaft's speed and torque on any mesh, and what may be wrong with the speed."""

    def __init__(self, sizing: Sizing, cycle: Cycle, run: Run) -> None:
        self.sizing, self.cycle, self.run = sizing, run.cycle or cycle, run
        self.mean = run.speed or sizing.speed
        scene = sizing.scene
        self.motor = scene.motor
        self.ratio = 1.0 if scene.drive is None else scene.shafts[scene.drive.on]

    def omega(self, mesh: Cells) -> Array:
        """Speed of the crank, rad/s."""
        return steady.speed_over_cycle(self.cycle, self.mean, self.run, mesh.phi.ravel()).reshape(mesh.phi.shape)

    def torque(self, mesh: Cells, omega: Array) -> Array:
        """Torque of the motor on its shaft, N m: by its law, or that of the current where this is a state of its own."""
        assert self.motor is not None
        if self.run.current is None or self.run.drive is None:
            return self.motor.torque(self.ratio * omega)
        cell, t = piecewise.located(self.cycle.mesh, mesh.phi.ravel())
        return piecewise.value(piecewise.fit(self.run.drive)[cell], t).reshape(mesh.phi.shape) / self.ratio

    def doubt(self, omega: Array) -> Array:
        """Error of the crank's speed, rad/s: of the level of energy, the more the slower it is, and of what varies."""
        run = self.run
        pinned = max(run.error - 4.0 * run.level_error, 0.0) * run.irregularity
        return self.mean * (pinned + (run.level + _LEVEL_ROUNDING) * self.mean / omega)

    def mean_over_time(self, law: Callable[[Cells, Array], tuple[Array, Array]]) -> tuple[float, float, Cells]:
        """The mean over time of a value along the motion, its error, and cells that are fine enough for it.

        integral of h/omega dphi over integral of dphi/omega; `law` gives h and |dh/domega| on a mesh. An error d(omega)
        makes (|dh/domega| + |h - mean|/omega) d(omega) of h.
        """
        mesh = self.cycle.mesh
        most = max(_MOST_CELLS, mesh.edges.size)
        for _ in range(_MOST_HALVINGS):
            omega = self.omega(mesh)
            value, slope = law(mesh, omega)
            rows = np.stack((value / omega, 1.0 / omega))
            total, time = piecewise.integral(rows, mesh.half).sum(axis=-1).tolist()
            mean = total / time
            tails = piecewise.TAIL_OF_INTEGRAL * piecewise.tails(piecewise.fit(rows)) * mesh.half[:, 0]
            missed = (tails[0] + abs(mean) * tails[1]) / time
            allowed = 0.1 * self.sizing.rtol * abs(mean) / missed.size
            if missed.sum() <= self.sizing.rtol * abs(mean) or not (missed > allowed).any() or mesh.edges.size > most:
                break
            mesh = piecewise.cells(piecewise.bisected(mesh.edges, missed > allowed))
        by_speed = (slope + np.abs(value - mean) / omega) * self.doubt(omega) / omega
        error = float(piecewise.integral(by_speed, mesh.half).sum()) / time + float(missed.sum())
        return mean, error + 24 * ROUNDING * abs(mean), mesh


def _heated(figures: Energy, course: _Course) -> Energy:
    """The figures with what heats the motor, where its kind says what that is."""
    if isinstance(course.motor, DC):
        return _with_copper_heat(figures, course, course.motor)
    if isinstance(course.motor, Induction):
        return _with_rotor_heat(figures, course, course.motor)
    return figures


def _with_rotor_heat(figures: Energy, course: _Course, motor: Induction) -> Energy:
    """Heat of an induction motor's rotor: the mean of T (omega_s - omega)."""

    def heat(mesh: Cells, omega: Array) -> tuple[Array, Array]:
        speed = course.ratio * omega
        slope = motor.slope_at(speed) * (motor.synchronous_speed - speed) - motor.torque(speed)
        return motor.rotor_heat(speed), course.ratio * np.abs(slope)

    mean, error, _ = course.mean_over_time(heat)
    found, relative = _relative(mean, error, float(motor.rotor_heat(0.0)))
    rated = float(motor.rotor_heat(motor.speed))
    errors = {"rotor_heat": relative, "rotor_heat_share": relative + 8 * ROUNDING / motor.rated_slip}
    return figures._replace(rotor_heat=found, rotor_heat_share=found / rated, errors=errors)


def _with_copper_heat(figures: Energy, course: _Course, motor: DC) -> Energy:
    """Current and heat of a DC motor's armature: the mean of R i²."""

    def current(mesh: Cells, omega: Array) -> Array:
        return np.asarray(motor.current_of_torque(course.ratio * omega, course.torque(mesh, omega)))

    def heat(mesh: Cells, omega: Array) -> tuple[Array, Array]:
        flowing = current(mesh, omega)
        return motor.copper_heat(flowing), 2 * course.ratio * motor.constant * np.abs(flowing)

    mean, error, mesh = course.mean_over_time(heat)
    omega = course.omega(mesh)
    series = piecewise.fit(current(mesh, omega))
    locked = motor.voltage / motor.resistance
    off = float(piecewise.tails(series).max()) + 24 * ROUNDING * locked
    off += course.ratio * motor.constant / motor.resistance * float(course.doubt(omega).max())
    if motor.inductance:  # the current follows the speed behind its own equation, which the cells may cut off as well
        error += 2 * motor.resistance * float(np.sqrt(mean / motor.resistance)) * float(piecewise.tails(series).max())
    found, relative = _relative(mean, error, motor.copper_heat(locked))
    peak, of_peak = _relative(_greatest(series), off, locked)
    errors = {"copper_heat": relative, "current_rms": relative, "current_peak": of_peak}
    share, rated = None, motor.rated_current
    if rated is not None:
        share = found / motor.copper_heat(rated)
        errors["copper_heat_share"] = relative + 8 * ROUNDING * locked / rated
    return figures._replace(
        current_rms=float(np.sqrt(found / motor.resistance)),
        current_peak=peak,
        copper_heat=found,
        copper_heat_share=share,
        errors=errors,
    )


def _relative(value: float, error: float, scale: float) -> tuple[float, float]:
    """A figure and its relative error; 0, and the error as a share of its scale, where nothing of it is left."""
    told = _told(value, error)
    return told, error / (abs(told) or scale)


def _told(value: float, error: float) -> float:
    """A figure, or 0 where rounding leaves nothing of it: ratios to it would be noise."""
    return 0.0 if abs(value) <= error else value


def _peak(power: Array) -> float:
    """The power that is largest in size, with its sign (W)."""
    return _greatest(piecewise.fit(power))


def _greatest(series: Array) -> float:
    """The value that is largest in size, with its sign; where both signs are as large, the positive one."""
    high, low = piecewise.greatest(series), -piecewise.greatest(-series)
    return high if high >= -low * (1 - _TIE) else low
