"""What the drive of a machine does over a steady cycle: its moment, work, power and heat; and the engine, whose gas drives.

A `MotorShaft` has the motor's speed, torque and current along the motion, from which means over time and extremes follow.
Last a synchronous motor in step: its load angle and what it swings with.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from flywheel.components.energy import Energy, mean_effective_pressure, mechanical_efficiency
from flywheel.machine.machine import Machine
from flywheel.mechanisms.families import ends_of
from flywheel.numerics import cells
from flywheel.numerics.cells import ROUNDING, Array, Cells, Coarse
from flywheel.numerics.faults import SceneError
from flywheel.regime import turning_moment
from flywheel.regime.turning_moment import Cycle, Run
from flywheel.scene.scene import Scene
from flywheel.sizing.results import EngineCycle, Sizing

if TYPE_CHECKING:
    from flywheel.components.motors import DC, Induction, Motor, TwoAxisInduction


from flywheel.sizing.results import Harmonic, Synchronism

SPEED_STEP = 1e-6
"""Share by which a speed is changed to see what depends on it."""
_TIE = 1e-9  # share within which two sizes are one
_LEVEL_ROUNDING = 4 * ROUNDING  # of the energy's level
_MOST_CELLS = 4_000  # that a mean over time is worth, beside those of the cycle itself


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


def crank_speed(sizing: Sizing, cycle: Cycle) -> Array:
    """The speed at the nodes (rad/s)."""
    assert sizing.run is not None
    phi = cycle.mesh.phi
    return turning_moment.speed_over_cycle(cycle, sizing.speed, sizing.run, phi.ravel()).reshape(phi.shape)


@np.errstate(all="ignore")  # a result asks for it after its sizing is over
def energy(sizing: Sizing) -> Energy | None:
    """Mean and peak power and rms torque with the flywheel; powers of a motor that follows the loads without one.

    Peaks are found where the slope of power is zero, and at the ends of smooth pieces. None without a motion, and where
    rounding of enormous torques has stopped the machine.
    """
    machine, cycle, run, speed, scene = sizing.machine, sizing.cycle, sizing.run, sizing.speed, sizing.scene
    if machine is None or cycle is None or run is None or scene.drive is None:
        return None
    half, omega = cycle.mesh.half, crank_speed(sizing, cycle)
    if not omega.min() > 0.0:
        return None
    drive = drive_moment(machine, cycle, run, speed)
    period, _ = turning_moment.period(cycle, speed, run, sizing.rtol)
    work = _above(float(cells.integral(drive, half).sum()), cycle.errors.work)
    moment = cycle.series[0] @ cells.basis(cells.NODES, cells.ORDER).T
    load = drive - moment  # what the loads and losses take, and a motor without a flywheel would have to give
    alone = _above(float(cells.integral(load, half).sum()), cycle.errors.work) / scene.cycle * speed
    noise = cycle.errors.work / scene.cycle  # of a moment
    greatest = float(np.abs(drive).max()) or 1.0  # squares of enormous moments leave the floating-point range
    square, time = (float(cells.integral(row, half).sum()) for row in ((drive / greatest) ** 2 / omega, 1.0 / omega))
    found = Energy(
        period=period,
        work=work,
        mean_power=work / period,
        peak_power=_above(_peak(cells.fit(drive * omega)), noise * speed),
        mean_power_alone=alone,
        peak_power_alone=_above(_peak(cells.fit(load * speed)), noise * speed),
        rms_torque=_above(greatest * float(np.sqrt(square / time)), noise) / scene.shafts[scene.drive.on],
    )
    motor = scene.motor
    if motor is None or motor.heated is None:
        return found
    along: Callable[[Any, MotorShaft], dict[str, Any]] = (
        _heats_by_fluxes if motor.static is not None and run.states else _HEATS[motor.heated]
    )
    return found._replace(**along(motor, MotorShaft(scene, cycle, run, speed, sizing.rtol)))


def _above(value: float, error: float) -> float:
    """A figure, or 0 where rounding leaves nothing of it: ratios to it would be noise."""
    return 0.0 if abs(value) <= error else value


def _peak(series: Array) -> float:
    """The value of a function that is largest in size, with its sign; where both signs are as large, the positive one."""
    high, low = cells.greatest(series), -cells.greatest(-series)
    return high if high >= -low * (1 - _TIE) else low


class MotorShaft:
    """A motor's shaft along the steady motion: its speed, torque and current on any mesh, with the error of the speed.

    `speed` (rad/s) is the mean of extremes of the crank, where the run does not bring its own; `rtol` what integrals and
    extremes are found to. `along` is the crank's speed at the nodes of the run's cycle where no inertia determines it.
    """

    def __init__(self, scene: Scene, cycle: Cycle, run: Run, speed: float, rtol: float, along: Array | None = None) -> None:
        self.motor, self.cycle, self.run, self.rtol = scene.motor, run.cycle or cycle, run, rtol
        self.mean, self.along = run.speed or speed, along
        self.ratio = 1.0 if scene.drive is None else scene.shafts[scene.drive.on]

    def omega(self, mesh: Cells) -> Array:
        """Speed of the crank, rad/s."""
        if self.along is not None:
            cell, t = cells.located(self.cycle.mesh, mesh.phi.ravel())
            return cells.value(cells.fit(self.along)[cell], t).reshape(mesh.phi.shape)
        return turning_moment.speed_over_cycle(self.cycle, self.mean, self.run, mesh.phi.ravel()).reshape(mesh.phi.shape)

    def torque(self, mesh: Cells, omega: Array) -> Array:
        """Torque of the motor on its shaft, N m: by its law, or that of its own states where it has any."""
        assert self.motor is not None
        if not self.run.states or self.run.drive is None:
            return self.motor.torque(self.ratio * omega)
        cell, t = cells.located(self.cycle.mesh, mesh.phi.ravel())
        return cells.value(cells.fit(self.run.drive)[cell], t).reshape(mesh.phi.shape) / self.ratio

    @property
    def torque_error(self) -> float:
        """What the cells leave open of the torque (N m on the motor's shaft) where it follows states of its own."""
        if not self.run.states or self.run.drive is None:
            return 0.0
        return float(cells.tails(cells.fit(self.run.drive)).max()) / self.ratio

    def torque_law(self, mesh: Cells, omega: Array) -> tuple[Array, Array]:
        """Torque of the motor on its shaft (N m), and the size of its slope by the crank's speed."""
        assert self.motor is not None
        return self.torque(mesh, omega), self.ratio * np.abs(self.motor.slope_at(self.ratio * omega))

    def current_law(self, mesh: Cells, omega: Array) -> tuple[Array, Array]:
        """Current of the motor over the rated one, by its own states where it has any; size of its slope by the speed."""
        motor, speed, run = self.motor, self.ratio * omega, self.run
        assert motor is not None
        here, beside = motor.current_share(speed), motor.current_share(speed * (1.0 + SPEED_STEP))
        slope = np.zeros_like(omega)
        if here is not None and beside is not None:
            slope = np.abs(beside - here) / (SPEED_STEP * omega)
        if motor.circuit is not None and run.along is not None and motor.rated_current is not None:
            own = self.cycle.mesh
            flowing = motor.circuit.current(self.ratio * self.omega(own), tuple(run.along))
            cell, t = cells.located(own, mesh.phi.ravel())
            here = cells.value(cells.fit(flowing)[cell], t).reshape(mesh.phi.shape) / motor.rated_current
        assert here is not None
        return here, slope

    def extremes(self, law: Callable[[Cells, Array], tuple[Array, Array]]) -> tuple[float, float, float]:
        """The least and the greatest value along the motion, and the error of either; `law` as in `mean_over_time`."""

        def evaluated(edges: Array) -> tuple[tuple[float, float, float], float, Coarse]:
            mesh = cells.cells(edges)
            omega = self.omega(mesh)
            value, slope = law(mesh, omega)
            series = cells.fit(value)
            least, most = cells.extents(series)
            tails, size = cells.tails(series), float(np.abs(value).max()) or 1.0
            off = float((slope * self.speed_error(omega)).max()) + 24 * ROUNDING * size
            found = float(least.min()), float(most.max()), float(tails.max()) + off
            # cells that hold neither extreme need not be fine
            near = (most + tails >= most.max() - tails.max()) | (least - tails <= least.min() + tails.max())
            worst = float(tails[near].max())
            return (*found[:2], worst + off), worst / size, lambda share: near & (tails > share * worst)

        first = self.cycle.mesh.edges
        return cells.refined(first, evaluated, 0.1 * self.rtol, max(_MOST_CELLS, 2 * first.size))

    def speed_error(self, omega: Array) -> Array:
        """Error of the crank's speed, rad/s: of the level of energy, the more the slower it is, and of what varies."""
        run = self.run
        if self.along is not None:
            return np.full(omega.shape, run.error * run.irregularity * run.speed_max)
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


def heat_share(motor: Motor, shaft: MotorShaft) -> tuple[float, float]:
    """The mean heat of a motor over time, over that at its rated point (see `Motor.heat_share`), and its absolute error."""
    if motor.heated == "copper_heat":
        found = _HEATS[motor.heated](motor, shaft)
        share = found["copper_heat_share"]
        return share, found["errors"]["copper_heat_share"] * max(share, ROUNDING)

    def law(mesh: Cells, omega: Array) -> tuple[Array, Array]:
        here, beside = (motor.heat_share(shaft.ratio * w) for w in (omega, omega * (1.0 + SPEED_STEP)))
        slope, along, own = np.abs(beside - here) / (SPEED_STEP * omega), shaft.run.along, shaft.cycle.mesh
        if along is None:
            return here, slope
        cell, t = cells.located(own, mesh.phi.ravel())
        series = cells.fit(motor.heat_share(shaft.ratio * shaft.omega(own), tuple(along)))
        return cells.value(series[cell], t).reshape(mesh.phi.shape), slope

    mean, error, _ = shaft.mean_over_time(law)
    even, rated = motor.no_load_speed or 0.0, 0.0 if motor.rated is None else motor.rated.speed
    return mean, error + 8 * ROUNDING * mean * even / max(even - rated, ROUNDING * even)  # of what slips at the rated point


def _rotor_heat(motor: Induction, shaft: MotorShaft) -> dict[str, Any]:
    """Heat of an induction motor's rotor, the mean of T (omega_s - omega); current and heat of its stator by the plate."""

    def heat(mesh: Cells, omega: Array) -> tuple[Array, Array]:
        speed = shaft.ratio * omega
        slope = motor.slope_at(speed) * (motor.synchronous_speed - speed) - motor.torque(speed)
        return motor.rotor_heat(speed), shaft.ratio * np.abs(slope)

    mean, error, _ = shaft.mean_over_time(heat)
    found, relative = _figure_and_error(mean, error, float(motor.rotor_heat(0.0)))
    rated = float(motor.rotor_heat(motor.speed))
    errors = {"rotor_heat": relative, "rotor_heat_share": relative + 8 * ROUNDING / motor.rated_slip}
    figures: dict[str, Any] = {"rotor_heat": found, "rotor_heat_share": found / rated}
    if motor.line_current.complete:
        of_stator, of_errors = _stator_heat(motor, shaft)
        figures, errors = figures | of_stator, errors | of_errors
    return {**figures, "errors": errors}


def _stator_heat(motor: Induction, shaft: MotorShaft) -> tuple[dict[str, float], dict[str, float]]:
    """Line current of an induction motor and copper heat of its stator, the mean of (I/I_n)², with relative errors."""

    def square(mesh: Cells, omega: Array) -> tuple[Array, Array]:
        share, slope = shaft.current_law(mesh, omega)
        return share * share, 2 * share * slope

    mean, error, _ = shaft.mean_over_time(square)
    _, peak, off = shaft.extremes(shaft.current_law)
    relative = error / mean
    figures, errors = {"stator_heat_share": mean}, {"stator_heat_share": relative}
    if (rated_heat := motor.rated_stator_heat) is not None:
        figures["stator_heat"], errors["stator_heat"] = mean * rated_heat, relative
    if (rated := motor.rated_current) is not None:
        figures |= {"current_rms": rated * math.sqrt(mean), "current_peak": rated * peak}
        errors |= {"current_rms": relative, "current_peak": off / peak}
    return figures, errors


def _copper_heat(motor: DC, shaft: MotorShaft) -> dict[str, Any]:
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
    found, relative = _figure_and_error(mean, error, motor.copper_heat(locked))
    peak, of_peak = _figure_and_error(_peak(series), off, locked)
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


def _figure_and_error(value: float, error: float, scale: float) -> tuple[float, float]:
    """A figure and its relative error; 0, and the error as a share of its scale, where nothing of it is left."""
    found = _above(value, error)
    return found, error / (abs(found) or scale)


def states_on(run: Run, mesh: Cells) -> tuple[Array, ...]:
    """A motor's own states along the motion, at the nodes of another mesh."""
    if run.along is None or run.cycle is None:
        return ()
    cell, t = cells.located(run.cycle.mesh, mesh.phi.ravel())
    return tuple(cells.value(cells.fit(row)[cell], t).reshape(mesh.phi.shape) for row in run.along)


def _heats_by_fluxes(motor: TwoAxisInduction, shaft: MotorShaft) -> dict[str, Any]:
    """Line current and heats of rotor and stator by the fluxes, on the mean over time, with relative errors.

    What the fluxes are off, by at most e each, makes 2 sqrt(3/2 r Q) k e of a heat Q, with k e the error of a current.
    """
    circuit, run = motor.circuit, shaft.run
    assert circuit is not None

    def of_rotor(mesh: Cells, omega: Array) -> tuple[Array, Array]:
        return np.asarray(circuit.rotor_heat(states_on(run, mesh))), np.zeros_like(omega)

    def of_stator(mesh: Cells, omega: Array) -> tuple[Array, Array]:
        return np.asarray(circuit.stator_heat(states_on(run, mesh))), np.zeros_like(omega)

    off = 2.0 * (max(run.states_error, default=0.0) + 8 * ROUNDING * circuit.scales[0])
    by_flux = (circuit.of_rotor + circuit.of_shared, circuit.of_stator + circuit.of_shared)
    found, errors = dict[str, Any](), dict[str, float]()
    rows = zip((of_rotor, of_stator), (circuit.rotor_resistance, circuit.stator_resistance), by_flux, strict=True)
    for name, (heat, resistance, gain) in zip(("rotor_heat", "stator_heat"), rows, strict=True):
        mean, error, mesh = shaft.mean_over_time(heat)
        own = 2.0 * float(np.sqrt(1.5 * resistance * mean)) * gain * off
        found[name], errors[name] = mean, (error + own) / max(mean, 1e-300)
    rated = float(motor.rotor_heat(motor.speed))
    found["rotor_heat_share"] = found["rotor_heat"] / rated
    errors["rotor_heat_share"] = errors["rotor_heat"] + 8 * ROUNDING / motor.rated_slip
    current = cells.fit(np.asarray(circuit.current(0.0, states_on(run, mesh))))
    found["current_rms"] = float(np.sqrt(found["stator_heat"] / (3.0 * circuit.stator_resistance)))
    found["current_peak"] = cells.greatest(current)
    errors["current_rms"] = errors["stator_heat"]
    errors["current_peak"] = (float(cells.tails(current).max()) + by_flux[1] * off) / max(found["current_peak"], 1e-300)
    return {**found, "errors": errors}


_HEATS: Mapping[str, Callable[[Any, MotorShaft], dict[str, Any]]] = {
    "copper_heat": _copper_heat,
    "rotor_heat": _rotor_heat,
}
"""Current and heat along a motion, by the figure of `Energy` that a type of motor is heated by."""


# -- the engine --------------------------------------------------------------------------------------------------------


@np.errstate(all="ignore")  # a result asks for it after its sizing is over
def engine(sizing: Sizing) -> EngineCycle | None:
    """The engine of a machine: None where no gas drives it.

    The gas is that of the loads with a bore; without any, in a machine without a drive or with one that brakes, the forces
    on those ports that they drive over the cycle. The brake is what all other loads and the drive take, but for models of
    losses.
    """
    machine, cycle, drive_work = sizing.machine, sizing.cycle, sizing.drive_work
    if machine is None or cycle is None:
        return None
    loads = machine.scene.loads
    gas = [load for load in loads if load.piston is not None]
    bored = bool(gas)
    if not bored and not ((drive_work or 0.0) >= 0.0 and machine.scene.drive is not None):
        gas = [load for load in loads if not machine.places[load.on].rotating]
    if not gas:
        return None
    works, error = _works(machine, cycle, sizing.run, sizing.speed)
    if not bored:  # that on the ports that it drives
        gas = [load for load in gas if sum(works[other.path] for other in gas if other.on == load.on) > 0.0]
    indicated = sum(works[load.path] for load in gas)
    if not gas or indicated <= error:
        return None
    ports = {load.on for load in gas}
    others = [load for load in loads if load.on not in ports and not load.is_loss]
    taken = -sum(works[load.path] for load in others) - works.get("drive", 0.0)
    brake = taken if taken > error else None
    pistons: dict[Any, float] = {}  # m³ swept in one stroke, as often as the gas in front of each works in the cycle
    known = all(load.piston is not None for load in gas)
    for load in gas if known else ():
        name, _, port = load.on.rpartition(".")
        mechanism = next(m for m in machine.scene.mechanisms if m.name == name)
        try:
            ends = ends_of(mechanism, port, machine.scene.parameters)
        except SceneError:  # a port whose turning points cannot be told
            known = False
            break
        times = machine.scene.shafts[mechanism.shaft] * machine.scene.cycle / load.every
        space = load.path if load.model else ""  # the model's own; loads with a bore on one port share the cylinder
        pistons[load.on, space] = (load.piston or 0.0) * (ends.high - ends.low) * round(times)
    volume = sum(pistons.values()) if known else None
    cycles = sizing.speed / machine.scene.cycle  # a second
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


ORDERS = 12


def synchronism(sizing: Sizing) -> Synchronism | None:
    """How a synchronous motor keeps step; None for another drive, and without a motion.

    Source: Kundur, Power System Stability and Control (1994), section 12.3 (natural frequency and damping ratio of the
    swing); Fitzgerald et al., Electric Machinery, 6th ed., chapter 5.
    """
    scene, run, cycle = sizing.scene, sizing.run, sizing.cycle
    motor: Any = scene.motor
    if motor is None or not motor.keeps_step or run is None or run.along is None or run.cycle is None or scene.drive is None:
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
