"""Drive, motor and engine of a machine over its steady cycle: work, power, heat; and its flywheel on every shaft."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from flywheel.components.energy import Energy
from flywheel.components.gear_trains import OnShaft, on_every_shaft
from flywheel.components.motors import DC, Induction
from flywheel.components.wheels import Wheel
from flywheel.machine.machine import Machine
from flywheel.mechanisms.families import ends_of
from flywheel.numerics import cells
from flywheel.numerics.arguments import NOT_NEGATIVE, POSITIVE, number_faults, refuse
from flywheel.numerics.cells import ROUNDING, Array, Cells, Coarse
from flywheel.numerics.faults import SceneError
from flywheel.regime import turning_moment
from flywheel.regime.turning_moment import Cycle, Run
from flywheel.scene.scene import Load, Scene

_TIE = 1e-9  # share within which two sizes are one
_LEVEL_ROUNDING = 4 * ROUNDING  # of the energy's level
_MOST_CELLS = 4_000  # that a mean over time is worth, beside those of the cycle itself
_LOSSES = "losses"  # how the model of a load begins that nothing is gained by


def drive_moment(machine: Machine, cycle: Cycle, run: Run | None, speed: float) -> Array:
    """The drive's moment on the crank (N m) along the motion, at the cycle's nodes (cells, nodes).

    Args:
        machine: with a drive.
        cycle: along the motion.
        run: the motion, where there is one.
        speed: mean of extremes, rad/s.

    """
    if run is not None and run.drive is not None:
        return run.drive
    at = speed if machine.depends_on_speed else None
    moments = machine.reduction.moments(cycle.mesh.phi, cycle.mesh.anchor, cycle.balance or 0.0, speed=at)
    return np.asarray(moments["drive"] + np.zeros_like(cycle.mesh.phi))


def drive_work(machine: Machine, cycle: Cycle, run: Run | None, speed: float) -> float | None:
    """Work (J) of the drive over the cycle, 0 where that is no more than its error; None without a drive."""
    drive = machine.scene.drive
    if drive is None:
        return None
    if drive.law is None or isinstance(drive.law, float | int):
        torque = (cycle.balance or 0.0) if drive.law is None else drive.law
        work = torque * machine.scene.shafts[drive.on] * machine.scene.cycle
    else:
        work = float(cells.integral(drive_moment(machine, cycle, run, speed), cycle.mesh.half).sum())
    return _above(work, cycle.errors.work)


@np.errstate(all="ignore")  # a result asks for it after its sizing is over
def energy(machine: Machine, cycle: Cycle, run: Run, speed: float, rtol: float) -> Energy | None:
    """Mean and peak power and rms torque with the flywheel; powers of a motor that follows the loads without one.

    Peaks are found where the slope of power is zero, and at the ends of smooth pieces. None where rounding of enormous
    torques has stopped the machine.

    Args:
        machine: with a drive.
        cycle: along the motion.
        run: the motion.
        speed: mean of extremes, rad/s.
        rtol: relative error allowed in means over time.

    """
    scene, mesh = machine.scene, cycle.mesh
    assert scene.drive is not None
    omega = turning_moment.speed_over_cycle(cycle, speed, run, mesh.phi.ravel()).reshape(mesh.phi.shape)
    if not omega.min() > 0.0:
        return None
    drive = drive_moment(machine, cycle, run, speed)
    period, _ = turning_moment.period(cycle, speed, run, rtol)
    work = _above(float(cells.integral(drive, mesh.half).sum()), cycle.errors.work)
    moment = cycle.series[0] @ cells.basis(cells.NODES, cells.ORDER).T
    load = drive - moment  # what the loads and losses take, and a motor without a flywheel would have to give
    alone = _above(float(cells.integral(load, mesh.half).sum()), cycle.errors.work) / scene.cycle * speed
    noise = cycle.errors.work / scene.cycle  # of a moment
    greatest = float(np.abs(drive).max()) or 1.0  # squares of enormous moments leave the floating-point range
    square, time = (float(cells.integral(row, mesh.half).sum()) for row in ((drive / greatest) ** 2 / omega, 1.0 / omega))
    found = Energy(
        period=period,
        work=work,
        mean_power=work / period,
        peak_power=_above(_peak(cells.fit(drive * omega)), noise * speed),
        mean_power_alone=alone,
        peak_power_alone=_above(_peak(cells.fit(load * speed)), noise * speed),
        rms_torque=_above(greatest * float(np.sqrt(square / time)), noise) / scene.shafts[scene.drive.on],
    )
    if isinstance(scene.motor, DC):
        return found._replace(**_copper_heat(scene.motor, _MotorShaft(scene, cycle, run, speed, rtol)))
    if isinstance(scene.motor, Induction):
        return found._replace(**_rotor_heat(scene.motor, _MotorShaft(scene, cycle, run, speed, rtol)))
    return found


def _above(value: float, error: float) -> float:
    """A figure, or 0 where rounding leaves nothing of it: ratios to it would be noise."""
    return 0.0 if abs(value) <= error else value


def _peak(series: Array) -> float:
    """The value of a function that is largest in size, with its sign; where both signs are as large, the positive one."""
    high, low = cells.greatest(series), -cells.greatest(-series)
    return high if high >= -low * (1 - _TIE) else low


# -- what heats the motor ----------------------------------------------------------------------------------------------


class _MotorShaft:
    """A motor's shaft along the steady motion: its speed and torque on any mesh, with the error of the speed."""

    def __init__(self, scene: Scene, cycle: Cycle, run: Run, speed: float, rtol: float) -> None:
        self.motor, self.cycle, self.run, self.rtol = scene.motor, run.cycle or cycle, run, rtol
        self.mean = run.speed or speed
        self.ratio = 1.0 if scene.drive is None else scene.shafts[scene.drive.on]

    def omega(self, mesh: Cells) -> Array:
        """Speed of the crank, rad/s."""
        return turning_moment.speed_over_cycle(self.cycle, self.mean, self.run, mesh.phi.ravel()).reshape(mesh.phi.shape)

    def torque(self, mesh: Cells, omega: Array) -> Array:
        """Torque of the motor on its shaft, N m: by its law, or that of the current where this is a state of its own."""
        assert self.motor is not None
        if self.run.current is None or self.run.drive is None:
            return self.motor.torque(self.ratio * omega)
        cell, t = cells.located(self.cycle.mesh, mesh.phi.ravel())
        return cells.value(cells.fit(self.run.drive)[cell], t).reshape(mesh.phi.shape) / self.ratio

    def speed_error(self, omega: Array) -> Array:
        """Error of the crank's speed, rad/s: of the level of energy, the more the slower it is, and of what varies."""
        run = self.run
        pinned = max(run.error - 4.0 * run.level_error, 0.0) * run.irregularity
        return self.mean * (pinned + (run.level + _LEVEL_ROUNDING) * self.mean / omega)

    def mean_over_time(self, law: Callable[[Cells, Array], tuple[Array, Array]]) -> tuple[float, float, Cells]:
        """The mean over time of a value along the motion, its error, and cells that are fine enough for it.

        integral of h/omega dphi over integral of dphi/omega; `law` gives h and |dh/domega| on a mesh. An error d(omega)
        makes (|dh/domega| + |h - mean|/omega) d(omega) of h.
        """

        def evaluated(edges: Array) -> tuple[tuple[Cells, Array, Array, Array, float, float, float], float, Coarse]:
            mesh = cells.cells(edges)
            omega = self.omega(mesh)
            value, slope = law(mesh, omega)
            rows = np.stack((value / omega, 1.0 / omega))
            total, time = cells.integral(rows, mesh.half).sum(axis=-1).tolist()
            mean = total / time
            tails = cells.TAIL_OF_INTEGRAL * cells.tails(cells.fit(rows)) * mesh.half[:, 0]
            shares = (tails[0] + abs(mean) * tails[1]) / time
            missed = float(shares.sum())
            error = missed / max(abs(mean), 1e-300) if missed else 0.0
            return (mesh, omega, value, slope, time, mean, missed), error, cells.above(shares, 0.1)

        first = self.cycle.mesh.edges
        mesh, omega, value, slope, time, mean, missed = cells.refined(
            first, evaluated, self.rtol, max(_MOST_CELLS, 2 * first.size)
        )
        by_speed = (slope + np.abs(value - mean) / omega) * self.speed_error(omega) / omega
        error = float(cells.integral(by_speed, mesh.half).sum()) / time + missed
        return mean, error + 24 * ROUNDING * abs(mean), mesh


def _rotor_heat(motor: Induction, shaft: _MotorShaft) -> dict[str, Any]:
    """Heat of an induction motor's rotor: the mean of T (omega_s - omega)."""

    def heat(mesh: Cells, omega: Array) -> tuple[Array, Array]:
        speed = shaft.ratio * omega
        slope = motor.slope_at(speed) * (motor.synchronous_speed - speed) - motor.torque(speed)
        return motor.rotor_heat(speed), shaft.ratio * np.abs(slope)

    mean, error, _ = shaft.mean_over_time(heat)
    found, relative = _relative(mean, error, float(motor.rotor_heat(0.0)))
    rated = float(motor.rotor_heat(motor.speed))
    errors = {"rotor_heat": relative, "rotor_heat_share": relative + 8 * ROUNDING / motor.rated_slip}
    return {"rotor_heat": found, "rotor_heat_share": found / rated, "errors": errors}


def _copper_heat(motor: DC, shaft: _MotorShaft) -> dict[str, Any]:
    """Current and heat of a DC motor's armature: the mean of R i²."""

    def current(mesh: Cells, omega: Array) -> Array:
        return np.asarray(motor.current_of_torque(shaft.ratio * omega, shaft.torque(mesh, omega)))

    def heat(mesh: Cells, omega: Array) -> tuple[Array, Array]:
        flowing = current(mesh, omega)
        return motor.copper_heat(flowing), 2 * shaft.ratio * motor.constant * np.abs(flowing)

    mean, error, mesh = shaft.mean_over_time(heat)
    omega = shaft.omega(mesh)
    series = cells.fit(current(mesh, omega))
    locked = motor.voltage / motor.resistance
    off = float(cells.tails(series).max()) + 24 * ROUNDING * locked
    off += shaft.ratio * motor.constant / motor.resistance * float(shaft.speed_error(omega).max())
    if motor.inductance:  # the current follows the speed behind its own equation, which the cells may cut off as well
        error += 2 * motor.resistance * float(np.sqrt(mean / motor.resistance)) * float(cells.tails(series).max())
    found, relative = _relative(mean, error, motor.copper_heat(locked))
    peak, of_peak = _relative(_peak(series), off, locked)
    errors = {"copper_heat": relative, "current_rms": relative, "current_peak": of_peak}
    share, rated = None, motor.rated_current
    if rated is not None:
        share = found / motor.copper_heat(rated)
        errors["copper_heat_share"] = relative + 8 * ROUNDING * locked / rated
    return {
        "current_rms": float(np.sqrt(found / motor.resistance)),
        "current_peak": peak,
        "copper_heat": found,
        "copper_heat_share": share,
        "errors": errors,
    }


def _relative(value: float, error: float, scale: float) -> tuple[float, float]:
    """A figure and its relative error; 0, and the error as a share of its scale, where nothing of it is left."""
    found = _above(value, error)
    return found, error / (abs(found) or scale)


# -- the flywheel on every shaft ---------------------------------------------------------------------------------------


def on_shafts(scene: Scene, inertia: float, speed: float, wheel: Wheel | None) -> tuple[OnShaft, ...]:
    """The flywheel on every shaft, at the mean of extremes of its speed.

    Where a wheel is built, it counts as built, rounded up or not. The others are that wheel made as wide as they need to be:
    at its radii mass and inertia grow with the width alike. Their rims run at the speed that the built wheel was chosen for,
    as the shafts are geared.

    Args:
        scene: with the shafts.
        inertia: of the flywheel, kg m² at its own shaft.
        speed: of the crank, rad/s.
        wheel: to be built, where one is asked for.

    """
    rows = on_every_shaft(inertia if wheel is None else wheel.inertia, scene.shafts, speed, on=scene.flywheel_on)
    if wheel is None:
        return rows
    return tuple(
        row._replace(
            radius=wheel.body.running,
            mass=wheel.mass * row.inertia / wheel.inertia,
            rim_speed=wheel.rim_speed * (row.ratio / scene.flywheel_ratio),
        )
        for row in rows
    )


# -- engines -----------------------------------------------------------------------------------------------------------


class EngineCycle(NamedTuple):
    """What an engine does in a steady cycle; powers are works over its angle, times the mean of extremes.

    `indicated_work` (J) and `indicated_power` (W) of the gas on its pistons; `swept_volume` (m³) of all cylinders, as often
    as their gas works in the cycle, and `mean_effective_pressure` (Pa) over it, None where a bore is not known;
    `brake_work` and `brake_power` that the loads take, and `mechanical_efficiency`, their share in what is indicated, None
    where they take nothing. `error` (J) is that of the works.
    """

    indicated_work: float
    indicated_power: float
    swept_volume: float | None
    mean_effective_pressure: float | None
    brake_work: float | None
    brake_power: float | None
    mechanical_efficiency: float | None
    error: float

    def as_dict(self) -> dict[str, float | None]:
        """Everything for JSON, SI; the error stands with those of the other figures."""
        return {name: value for name, value in self._asdict().items() if name != "error"}


def mean_effective_pressure(work: float, swept_volume: float) -> float:
    """Mean effective pressure (Pa): the constant one that would do the same work in one stroke, p = W/V.

    Args:
        work: W of the gas in a cycle of the engine (two strokes or four), J; the brake's work for the brake's pressure.
        swept_volume: V of the pistons, m³.

    Raises:
        SceneError: if the volume is not above 0, or a number is not finite.

    Source: Khurmi and Gupta, Theory of Machines, chapter 15.

    >>> round(mean_effective_pressure(400.0, 500e-6) / 1e5, 12)  # bar
    8.0

    """
    refuse(number_faults("work", work, unit="J") + number_faults("swept_volume", swept_volume, POSITIVE, "m³"))
    return work / swept_volume


def mechanical_efficiency(brake: float, indicated: float) -> float:
    """Mechanical efficiency: the brake's work (or power) over the indicated one.

    Args:
        brake: what the engine gives, J or W.
        indicated: what its gas gives, J or W.

    Raises:
        SceneError: if a number is below 0, or the second 0.

    Source: Khurmi and Gupta, Theory of Machines, chapter 15.

    >>> mechanical_efficiency(300.0, 400.0)
    0.75

    """
    refuse(number_faults("brake", brake, NOT_NEGATIVE) + number_faults("indicated", indicated, POSITIVE))
    return brake / indicated


@np.errstate(all="ignore")  # a result asks for it after its sizing is over
def engine(machine: Machine, cycle: Cycle, run: Run | None, speed: float, drive_work: float | None) -> EngineCycle | None:
    """The engine of a machine: None where no gas drives it.

    The gas is that of the loads with a bore; without any, in a machine without a drive or with one that brakes, the forces
    on those ports that they drive over the cycle. The brake is what all other loads and the drive take, but for models of
    losses.
    """
    loads = machine.scene.loads
    gas = [load for load in loads if load.piston is not None]
    bored = bool(gas)
    if not bored and not ((drive_work or 0.0) >= 0.0 and machine.scene.drive is not None):
        gas = [load for load in loads if not machine.places[load.on].rotating]
    if not gas:
        return None
    works, error = _works(machine, cycle, run, speed)
    if not bored:  # that on the ports that it drives
        gas = [load for load in gas if sum(works[other.path] for other in gas if other.on == load.on) > 0.0]
    indicated = sum(works[load.path] for load in gas)
    if not gas or indicated <= error:
        return None
    ports = {load.on for load in gas}
    others = [load for load in loads if load.on not in ports and not load.model.startswith(_LOSSES)]
    taken = -sum(works[load.path] for load in others) - works.get("drive", 0.0)
    brake = taken if taken > error else None
    volume = _swept_volume(machine, gas)
    cycles = speed / machine.scene.cycle  # a second
    return EngineCycle(
        indicated_work=indicated,
        indicated_power=indicated * cycles,
        swept_volume=volume,
        mean_effective_pressure=None if volume is None else mean_effective_pressure(indicated, volume),
        brake_work=brake,
        brake_power=None if brake is None else brake * cycles,
        mechanical_efficiency=None if brake is None else mechanical_efficiency(brake, indicated),
        error=error,
    )


def _works(machine: Machine, cycle: Cycle, run: Run | None, speed: float) -> tuple[dict[str, float], float]:
    """The work (J) of every load and of the drive in the cycle, by their paths, and the error of them all."""
    mesh, omega = cycle.mesh, None
    if machine.depends_on_speed:
        omega = np.full(mesh.phi.shape, speed)
        if run is not None:
            omega = turning_moment.speed_over_cycle(cycle, speed, run, mesh.phi.ravel()).reshape(mesh.phi.shape)
    moments = machine.reduction.moments(mesh.phi, mesh.anchor, cycle.balance or 0.0, by_name=True, speed=omega)
    names = {effort.path: effort.load.path for effort in machine.efforts}
    values = {names[name]: value + np.zeros_like(mesh.phi) for name, value in moments.items() if name in names}
    works = dict.fromkeys([load.path for load in machine.scene.loads], 0.0)
    works |= {path: float(cells.integral(value, mesh.half).sum()) for path, value in values.items()}
    error = cycle.errors.work + cycle.errors.residual
    error += sum(
        float((cells.TAIL_OF_INTEGRAL * cells.tails(cells.fit(value)) * mesh.half[:, 0]).sum())
        + 24 * ROUNDING * float(cells.integral(np.abs(value), mesh.half).sum())
        for value in values.values()
    )
    if omega is not None and run is not None:  # and what the error of the speed may change of what depends on it
        error += 2 * (0.5 * run.irregularity * run.error + run.level_error) * cycle.exchanged
    return works, error


def _swept_volume(machine: Machine, pistons: list[Load]) -> float | None:
    """The volume (m³) that pistons sweep in one stroke, as often as the gas in front of each works in the cycle."""
    found: dict[Any, float] = {}
    for load in pistons:
        if load.piston is None:
            return None
        name, _, port = load.on.rpartition(".")
        mechanism = next(m for m in machine.scene.mechanisms if m.name == name)
        try:
            ends = ends_of(mechanism, port, machine.scene.parameters)
        except SceneError:  # a port whose turning points cannot be told
            return None
        times = machine.scene.shafts[mechanism.shaft] * machine.scene.cycle / load.every
        space = load.path if load.model else ""  # the model's own; loads with a bore on one port share the cylinder
        found[load.on, space] = load.piston * (ends.high - ends.low) * round(times)
    return sum(found.values())
