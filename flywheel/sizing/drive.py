"""Power and energy of a sized machine's drive over its steady cycle."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from flywheel.components.energy import Energy
from flywheel.components.gear_trains import OnShaft, on_every_shaft
from flywheel.components.motors import DC, Induction
from flywheel.numerics import cells
from flywheel.numerics.arguments import NOT_NEGATIVE, POSITIVE, number_faults, refuse
from flywheel.numerics.cells import ROUNDING, Array, Cells, Coarse
from flywheel.numerics.faults import SceneError
from flywheel.regime import steady_motion
from flywheel.scene.scene import Load

if TYPE_CHECKING:
    from flywheel.components.wheels import Wheel
    from flywheel.machine.machine import Machine
    from flywheel.regime.results import Sizing
    from flywheel.regime.steady_motion import Run
    from flywheel.regime.turning_moment import Cycle


_TIE = 1e-9  # share within which two sizes are one
_LEVEL_ROUNDING = 4 * ROUNDING  # of the energy's level
_MOST_CELLS = 4_000  # that a mean over time is worth, beside those of the cycle itself


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
    omega = steady_motion.speed_over_cycle(cycle, speed, run, mesh.phi.ravel()).reshape(mesh.phi.shape)
    if not omega.min() > 0.0:  # rounding of enormous torques has stopped it
        return None
    drive = moment_of_drive(sizing)
    period, _ = steady_motion.period(cycle, speed, run, sizing.rtol)
    work = _told(float(cells.integral(drive, mesh.half).sum()), cycle.errors.work)
    moment = cycle.series[0] @ cells.basis(cells.NODES, cells.ORDER).T
    follows = drive - moment  # what the loads and losses take, and a motor without a flywheel would have to give
    alone = _told(float(cells.integral(follows, mesh.half).sum()), cycle.errors.work) / machine.scene.cycle * speed
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
    square, time = (float(cells.integral(values, half).sum()) for values in (share**2 / omega, 1.0 / omega))
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
        return steady_motion.speed_over_cycle(self.cycle, self.mean, self.run, mesh.phi.ravel()).reshape(mesh.phi.shape)

    def torque(self, mesh: Cells, omega: Array) -> Array:
        """Torque of the motor on its shaft, N m: by its law, or that of the current where this is a state of its own."""
        assert self.motor is not None
        if self.run.current is None or self.run.drive is None:
            return self.motor.torque(self.ratio * omega)
        cell, t = cells.located(self.cycle.mesh, mesh.phi.ravel())
        return cells.value(cells.fit(self.run.drive)[cell], t).reshape(mesh.phi.shape) / self.ratio

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
            first, evaluated, self.sizing.rtol, max(_MOST_CELLS, 2 * first.size)
        )
        by_speed = (slope + np.abs(value - mean) / omega) * self.doubt(omega) / omega
        error = float(cells.integral(by_speed, mesh.half).sum()) / time + missed
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
    series = cells.fit(current(mesh, omega))
    locked = motor.voltage / motor.resistance
    off = float(cells.tails(series).max()) + 24 * ROUNDING * locked
    off += course.ratio * motor.constant / motor.resistance * float(course.doubt(omega).max())
    if motor.inductance:  # the current follows the speed behind its own equation, which the cells may cut off as well
        error += 2 * motor.resistance * float(np.sqrt(mean / motor.resistance)) * float(cells.tails(series).max())
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
    return _greatest(cells.fit(power))


def _greatest(series: Array) -> float:
    """The value that is largest in size, with its sign; where both signs are as large, the positive one."""
    high, low = cells.greatest(series), -cells.greatest(-series)
    return high if high >= -low * (1 - _TIE) else low


# -- on shafts ---------------------------------------------------------------------------------------------------------

# The flywheel of a sizing, and those that do the same on the machine's other shafts.


def compared(sizing: Sizing) -> tuple[OnShaft, ...]:
    """The flywheel given or sized on every shaft, at the mean of extremes of its speed.

    Where a wheel is built, it counts as built, rounded up or not. The others are that wheel made as wide as they need to be:
    at its radii mass and inertia grow with the width alike. Their rims run at the speed that the built wheel was chosen for,
    as the shafts are geared.
    """
    scene = sizing.scene
    inertia = sizing.inertia if sizing.built is None else sizing.built.wheel.inertia
    if inertia is None:
        return ()
    rows = on_every_shaft(inertia, scene.shafts, sizing.speed, on=scene.flywheel_on)
    if sizing.built is None:
        return rows
    return tuple(_as_wheel(row, sizing.built.wheel, row.ratio / scene.flywheel_ratio) for row in rows)


def _as_wheel(row: OnShaft, wheel: Wheel, faster: float) -> OnShaft:
    """The row with the wheel made wider or narrower; `faster` is its speed over that of the wheel as built."""
    mass = wheel.mass * row.inertia / wheel.inertia
    return row._replace(radius=wheel.body.running, mass=mass, rim_speed=wheel.rim_speed * faster)


# -- engines -----------------------------------------------------------------------------------------------------------

# Engines: what the gas in their cylinders does in a cycle, and what of it reaches the loads.


_LOST = "losses"  # how the model of a load begins that nothing is gained by


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
def engine_of(sizing: Sizing) -> EngineCycle | None:
    """The engine of a sized machine: None where no gas drives it.

    The gas is that of the loads with a bore; without any, in a machine without a drive or with one that brakes, the forces
    on those ports that they drive over the cycle. The brake is what all other loads and the drive take, but for models of
    losses.
    """
    cycle, machine = sizing.cycle, sizing.machine
    if cycle is None or machine is None:
        return None
    gas = _gas(machine, driven=(sizing.drive_work or 0.0) >= 0.0 and machine.scene.drive is not None)
    if not gas:
        return None
    works, error = _works(sizing, machine)
    pistons = _driving(gas, works)
    indicated = sum(works[load.path] for load in pistons)
    if not pistons or indicated <= error:
        return None
    ports = {load.on for load in pistons}
    others = [load for load in machine.scene.loads if load.on not in ports and not load.model.startswith(_LOST)]
    taken = -sum(works[load.path] for load in others) - works.get("drive", 0.0)
    brake = taken if taken > error else None
    volume = _swept(machine, pistons)
    pace = sizing.speed / machine.scene.cycle
    return EngineCycle(
        indicated_work=indicated,
        indicated_power=indicated * pace,
        swept_volume=volume,
        mean_effective_pressure=None if volume is None else mean_effective_pressure(indicated, volume),
        brake_work=brake,
        brake_power=None if brake is None else brake * pace,
        mechanical_efficiency=None if brake is None else mechanical_efficiency(brake, indicated),
        error=error,
    )


def _gas(machine: Machine, *, driven: bool) -> list[Load]:
    """The loads that are gas, or may be in a machine that is not driven otherwise."""
    loads = machine.scene.loads
    known = [load for load in loads if load.piston is not None]
    if known or driven:
        return known
    return [load for load in loads if not machine.places[load.on].rotating]


def _driving(gas: list[Load], works: dict[str, float]) -> list[Load]:
    """Gas with a known piston; else that on the ports that it drives."""
    if gas[0].piston is not None:
        return gas
    driven = {port for port in {load.on for load in gas} if sum(works[load.path] for load in gas if load.on == port) > 0.0}
    return [load for load in gas if load.on in driven]


def _works(sizing: Sizing, machine: Machine) -> tuple[dict[str, float], float]:
    """The work (J) of every load and of the drive in the cycle, by their paths, and the error of them all."""
    cycle = sizing.cycle
    assert cycle is not None
    mesh, pace = cycle.mesh, None
    if machine.depends_on_speed:
        omega = np.full(mesh.phi.shape, sizing.speed)
        if sizing.run is not None:
            omega = steady_motion.speed_over_cycle(cycle, sizing.speed, sizing.run, mesh.phi.ravel()).reshape(mesh.phi.shape)
        pace = omega
    moments = machine.reduction.moments(mesh.phi, mesh.anchor, cycle.balance or 0.0, by_name=True, speed=pace)
    names = {effort.path: effort.load.path for effort in machine.efforts}
    values = {names[name]: value + np.zeros_like(mesh.phi) for name, value in moments.items() if name in names}
    works = dict.fromkeys([load.path for load in machine.scene.loads], 0.0)
    works |= {path: float(cells.integral(value, mesh.half).sum()) for path, value in values.items()}
    error = cycle.errors.work + cycle.errors.residual + sum(_tail(value, mesh.half) for value in values.values())
    run = sizing.run
    if pace is not None and run is not None:  # and what the error of the speed may change of what depends on it
        error += 2 * (0.5 * run.irregularity * run.error + run.level_error) * cycle.exchanged
    return works, error


def _tail(values: Array, half: Array) -> float:
    tails = cells.tails(cells.fit(values))
    exchanged = float(cells.integral(np.abs(values), half).sum())
    return float((cells.TAIL_OF_INTEGRAL * tails * half[:, 0]).sum()) + 24 * ROUNDING * exchanged


def _swept(machine: Machine, pistons: list[Load]) -> float | None:
    """The volume (m³) that pistons sweep in one stroke, as often as the gas in front of each works in the cycle."""
    from flywheel.mechanisms.families import ends_of  # only engines pay for it

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
