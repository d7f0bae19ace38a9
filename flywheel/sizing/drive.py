"""Drive of a machine over a steady cycle: its moment, work, power and heat; an engine driven by gas; an inverter.

Finally a synchronous motor in step: its load angle and its swing.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np

from flywheel.components.energy import Energy, ServoLoad, mean_effective_pressure, mechanical_efficiency
from flywheel.components.load_models import is_loss
from flywheel.components.motors import Motor
from flywheel.components.motors.thermal import Temperature, greatest_rise
from flywheel.machine.machine import Machine
from flywheel.mechanisms.families import ends_of
from flywheel.numerics import cells
from flywheel.numerics.cells import ROUNDING, Array, Cells, Coarse
from flywheel.numerics.faults import SceneError
from flywheel.regime import turning_moment
from flywheel.regime.turning_moment import Cycle, Run
from flywheel.sizing.motor import SPEED_STEP, MotorShaft, above_error, drive_moment, heat_share
from flywheel.sizing.results import EngineCycle, Harmonic, InverterLoad, Sizing, Synchronism, Trip


def drive_work(machine: Machine, cycle: Cycle, run: Run | None, speed: float) -> float | None:
    """Work (J) of the drive over the cycle, 0 if that is no more than its error; None without a drive."""
    drive = machine.scene.drive
    if drive is None:
        return None
    if drive.law is None or isinstance(drive.law, float | int):
        torque = (cycle.balance or 0.0) if drive.law is None else drive.law
        work = torque * machine.scene.shafts[drive.on] * machine.scene.cycle
    else:
        work = float(cells.integral(drive_moment(machine, cycle, run, speed), cycle.mesh.half).sum())
    return above_error(work, cycle.errors.net)


@np.errstate(all="ignore")  # a result asks for it after its sizing is over
def energy(sizing: Sizing) -> Energy | None:
    """Mean and peak power and rms torque with the flywheel; powers of a motor that follows the loads without one.

    Peaks are at zeros of the slope of power, and at the ends of smooth pieces. None without a motion, and if
    rounding of enormous torques has stopped the machine.
    """
    machine, cycle, run, speed, scene = sizing.machine, sizing.cycle, sizing.run, sizing.speed, sizing.scene
    if machine is None or cycle is None or run is None or scene.drive is None:
        return None
    half, omega = cycle.mesh.half, turning_moment.speed_over_cycle(cycle, speed, run, cycle.mesh.phi)
    if not omega.min() > 0.0:
        return None
    drive = drive_moment(machine, cycle, run, speed)
    period, _ = turning_moment.period(cycle, speed, run, sizing.rtol)
    work = above_error(float(cells.integral(drive, half).sum()), cycle.errors.net)
    moment = cycle.series[0] @ cells.basis(cells.NODES, cells.ORDER).T
    load = drive - moment  # what the loads and losses take, and a motor without a flywheel would have to give
    alone = above_error(float(cells.integral(load, half).sum()), cycle.errors.net) / scene.cycle * speed
    noise = cycle.errors.net / scene.cycle  # of a moment
    greatest = float(np.abs(drive).max()) or 1.0  # squares of enormous moments leave the floating-point range
    square, time = (float(cells.integral(row, half).sum()) for row in ((drive / greatest) ** 2 / omega, 1.0 / omega))
    figures = Energy(
        period=period,
        work=work,
        mean_power=work / period,
        peak_power=above_error(cells.largest(cells.fit(drive * omega)), noise * speed),
        mean_power_alone=alone,
        peak_power_alone=above_error(cells.largest(cells.fit(load * speed)), noise * speed),
        rms_torque=above_error(greatest * float(np.sqrt(square / time)), noise) / scene.shafts[scene.drive.on],
    )
    heats = {} if scene.motor is None else scene.motor.heats(MotorShaft(scene, cycle, run, speed, sizing.rtol))
    return figures._replace(**heats)


# -- the engine --------------------------------------------------------------------------------------------------------


@np.errstate(all="ignore")  # a result asks for it after its sizing is over
def engine(sizing: Sizing) -> EngineCycle | None:
    """The engine of a machine: None if no gas drives it.

    The gas is that of the loads with a bore; without any, in a machine without a drive or with one that brakes, the forces
    on those ports that do positive work over the cycle. The brake work is that of all other loads and the drive, except
    models of losses.
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
    others = [load for load in loads if load.on not in ports and not is_loss(load.model)]
    taken = -sum(works[load.path] for load in others) - works.get("drive", 0.0)
    brake = taken if taken > error else None
    pistons: dict[Any, float] = {}  # m³ swept in one stroke, as often as the gas in front of each works in the cycle
    complete = all(load.piston is not None for load in gas)
    for load in gas if complete else ():
        name, _, port = load.on.rpartition(".")
        mechanism = next(m for m in machine.scene.mechanisms if m.name == name)
        try:
            ends = ends_of(mechanism, port, machine.scene.parameters)
        except SceneError:  # a port whose turning points are unknown
            complete = False
            break
        times = machine.scene.shafts[mechanism.shaft] * machine.scene.cycle / load.every
        space = load.path if load.model else ""  # the model's own; loads with a bore on one port share the cylinder
        pistons[load.on, space] = (load.piston or 0.0) * (ends.high - ends.low) * round(times)
    volume = sum(pistons.values()) if complete else None
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
            omega = turning_moment.speed_over_cycle(cycle, speed, run, mesh.phi)
    moments = machine.reduction.moments(mesh.phi, mesh.anchor, cycle.balance or 0.0, by_name=True, speed=omega)
    names = {effort.path: effort.load.path for effort in machine.efforts}
    values = {names[name]: value + np.zeros_like(mesh.phi) for name, value in moments.items() if name in names}
    works = dict.fromkeys([load.path for load in machine.scene.loads], 0.0)
    works |= {path: float(cells.integral(value, mesh.half).sum()) for path, value in values.items()}
    error = cycle.errors.net + cycle.errors.residual
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
    """Synchronism of a synchronous motor; None for another drive, and without a motion.

    Source: Kundur, Power System Stability and Control (1994), section 12.3 (natural frequency and damping ratio of the
    swing); Fitzgerald et al., Electric Machinery, 6th ed., chapter 5.
    """
    scene, run, cycle = sizing.scene, sizing.run, sizing.cycle
    motor: Any = scene.motor
    if motor is None or not motor.keeps_step or run is None or run.along is None or run.cycle is None or scene.drive is None:
        return None
    cycle, ratio, angle = run.cycle, scene.shafts[scene.drive.on], cells.fit(run.along[0])
    omega = turning_moment.speed_over_cycle(cycle, sizing.speed, run, cycle.mesh.phi)
    reduced = cycle.series[2] @ cells.basis(cells.NODES, cells.ORDER).T  # I* at the nodes, kg m²
    time, product = (cells.integral(row, cycle.mesh.half).sum() for row in (1.0 / omega, run.along[0] / omega))
    mean = float(product / time)
    off = (run.states_error[0] if run.states_error else 0.0) + float(cells.tails(angle).max()) + 8 * ROUNDING * math.pi
    greatest, least = cells.greatest(angle), -cells.greatest(-angle)
    torque = cells.fit(motor.synchronizing_torque(run.along[0]))
    peak = max(cells.greatest(torque), cells.greatest(-torque)) / motor.pull_out_torque
    inertia = (run.inertia + float(cells.integral(reduced, cycle.mesh.half).sum()) / scene.cycle) / ratio**2
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
    rows, errors["harmonics"] = harmonics(sizing, float(time), natural, damping, inertia * ratio**2)
    shares = (natural * float(time) / (2 * math.pi * one.order) * (1.0 + of_natural) for one in rows)
    moved = (magnified(x, damping) / one.magnification for x, one in zip(shares, rows, strict=True))
    errors["magnification"] = max((abs(ratio - 1.0) for ratio in moved), default=0.0)
    return Synchronism(mean, greatest, least, motor.pull_out_angle, peak, natural / (2 * math.pi), damping, rows, errors)


def magnified(x: float, damping: float) -> float:
    """Factor on the swing of a free rotor, |1/(1 - x² - 2 j zeta x)|, at natural over exciting frequency x.

    For the speed of a rotor under a moment M, J dw/dt + c w + K integral(w) = M, relative to that with c = K = 0.

    >>> magnified(0.0, 0.1), round(magnified(1.0, 0.1), 12)
    (1.0, 5.0)
    """
    return 1.0 / abs(complex(1.0 - x * x, -2.0 * damping * x if x else 0.0))


def harmonics(
    sizing: Sizing, period: float, natural: float, damping: float, inertia: float
) -> tuple[tuple[Harmonic, ...], float]:
    """Harmonics of the moment that accelerates the machine at a constant speed: F - ½ omega² dI*/dphi.

    Args:
        sizing: of the machine.
        period: time of a cycle, s.
        natural: angular frequency of the swing, rad/s.
        damping: damping ratio of the swing.
        inertia: mean J + I* on the crank, kg m².

    Returns them, and the error of their moments relative to the greatest.

    """
    even = sizing.constant or sizing.cycle
    if even is None:
        return (), 0.0
    moment, slope = even.series[:2] @ cells.basis(cells.NODES, cells.ORDER).T
    push = moment - 0.5 * (sizing.constant_speed or sizing.speed) ** 2 * slope
    orders = np.arange(1, ORDERS + 1)[:, None, None]

    def evaluated(edges: Array) -> tuple[tuple[Array, float], float, Coarse]:
        mesh = cells.cells(edges)
        waves = cells.interpolated(push, even.mesh, mesh.phi) * np.exp(
            -2j * math.pi * orders * mesh.phi / sizing.scene.cycle
        )
        both = np.stack((waves.real, waves.imag))
        parts = cells.integral(both, mesh.half).sum(axis=-1)
        shares = cells.TAIL_OF_INTEGRAL * cells.tails(cells.fit(both)).max(axis=(0, 1)) * mesh.half[:, 0]
        sizes, missed = np.hypot(*parts), float(shares.sum())
        return (sizes, missed), missed / max(float(sizes.max()), 1e-300), cells.above(shares)

    sizes, missed = cells.refined(even.mesh.edges, evaluated, sizing.rtol)
    missed += even.errors.net + 24 * ROUNDING * float(cells.integral(np.abs(push), even.mesh.half).sum())
    rows = []
    for k, size in enumerate((2.0 * sizes / sizing.scene.cycle).tolist(), start=1):
        frequency = 2 * math.pi * k / period
        rows.append(Harmonic(k, k / period, size, size / (inertia * frequency), magnified(natural / frequency, damping)))
    return tuple(rows), missed / max(float(sizes.max()), 1e-300)


_POINTS = 65  # in a cell, and again about the greatest and the ends of its stretch
_ZOOMS = 3
_FLAT = 1e-9  # of the largest value: by which a figure is lower away from where it is greatest


class Place(NamedTuple):
    """The crank's angle at which a figure is greatest, the first on a flat stretch, and the stretch that holds it (rad)."""

    angle: float
    start: float
    end: float


def place_of_greatest(mesh: Cells, values: Array) -> Place:
    """The place at which a figure, given at the nodes of cells, is greatest: the first of several that are as great."""
    series = cells.fit(values)
    angles = (mesh.middle + mesh.half * np.linspace(-1.0, 1.0, _POINTS)).ravel()
    for _ in range(_ZOOMS):
        cell, t = cells.located(mesh, angles)
        fine = cells.value(series[cell], t)
        lower = np.append(fine < fine.max() - _FLAT * np.abs(fine).max(), True)
        begins = int(np.argmin(lower))
        ends = begins + int(np.argmax(lower[begins:])) - 1
        k = begins + int(np.argmax(fine[begins : ends + 1]))
        first, last = max(begins - 1, 0), min(ends + 1, fine.size - 1)
        place = Place(*angles[[begins, first, last]].tolist())
        pairs = angles[[first, max(k - 1, 0), ends]], angles[[begins, min(k + 1, fine.size - 1), last]]
        angles = np.sort(np.linspace(*pairs, _POINTS), axis=None)
    return place


def inverter_load(shaft: MotorShaft) -> InverterLoad | None:
    """Current and power of a motor on its inverter along a motion, and causes of a trip; None for another drive.

    Power that the motor returns charges the inverter's capacitors, whose energy is neglected: without a resistor or a
    mains that accepts it, any returned power trips it. Source: IEC 61800-2 (ratings of drives with inverters).
    """
    motor, inverter = shaft.motor, None if shaft.motor is None else shaft.motor.inverter
    if motor is None or inverter is None:
        return None

    def power(mesh: Cells, omega: Array) -> tuple[Array, Array]:
        speed, torque = shaft.ratio * omega, shaft.torque(mesh, omega)
        if shaft.has_states:
            return motor.input_power(speed, torque, shaft.states(mesh)), np.zeros_like(omega)
        here, step = motor.input_power(speed, torque), SPEED_STEP * omega
        changed = torque + motor.slope_at(speed) * shaft.ratio * step
        return here, np.abs(motor.input_power(speed + shaft.ratio * step, changed) - here) / step

    mean, error, _ = shaft.mean_over_time(power)
    least, most, off = shaft.extremes(power)
    scale = max(abs(most), abs(least), 1e-300)
    errors = {"power": error / max(abs(mean), 1e-300), "power_greatest": off / scale, "power_least": off / scale}
    mesh, current, trips = shaft.cycle.mesh, None, list[Trip]()
    omega = shaft.omega(mesh)
    if motor.current_share(np.zeros(1)) is not None:
        _, current, errors["current"] = shaft.extremes(shaft.current_law)
        if current > inverter.overcurrent + errors["current"]:
            place = place_of_greatest(mesh, shaft.current_law(mesh, omega)[0])
            trips.append(Trip("overcurrent", current, inverter.overcurrent, place.angle))
    if -least > (returned := inverter.limits[1])[1] + off:
        place = place_of_greatest(mesh, -power(mesh, omega)[0])
        trips.append(Trip(returned[0], -least, returned[1], place.angle))
    return InverterLoad(mean, most, least, current, tuple(trips), errors)


USUAL_INERTIA_RATIO = 10.0
"""Inertia of the load over that of the rotor up to which speed controllers are usually well damped."""


def servo_load(shaft: MotorShaft) -> ServoLoad | None:
    """The motion of a servo drive in its area of torque and speed; None for another drive.

    The rms point has the root of the mean square of the torque, and the mean of the size of the speed, both over time.
    Source: Gross, Hamann and Wiegärtner, Electrical Feed Drives in Automation, chapter 8 (effective torque and mean speed
    within the S1 curve, peak points within the peak curve, ratio of inertias).
    """
    motor = shaft.motor
    if motor is None or motor.peak(0.0) is None:
        return None

    def speed(mesh: Cells, omega: Array) -> tuple[Array, Array]:
        return shaft.ratio * np.abs(omega), np.full_like(omega, shaft.ratio)

    def share(mesh: Cells, omega: Array) -> tuple[Array, Array]:
        here, beside = (share_of_peak(motor, shaft.ratio * w) for w in (omega, omega * (1.0 + SPEED_STEP)))
        return here, np.abs(beside - here) / (SPEED_STEP * omega)

    mean, of_mean, _ = shaft.mean_over_time(speed)
    square, of_square, _ = shaft.mean_square(shaft.torque_law)
    rms, limit = math.sqrt(max(square, 0.0)), float(motor.continuous(mean))
    _, most, of_share = shaft.extremes(share)
    mesh = shaft.cycle.mesh
    omega = shaft.omega(mesh)
    place = place_of_greatest(mesh, share(mesh, omega)[0])
    cell, t = cells.located(mesh, np.array([place.angle, *np.linspace(place.start, place.end, _POINTS)]))
    speeds = shaft.ratio * cells.value(cells.fit(omega)[cell], t)
    torques, of_speed = np.asarray(motor.torque(speeds)), shaft.ratio * float(shaft.speed_error(omega).max())
    there, peak = float(speeds[0]), float(torques[0])
    of_torque = float(np.abs(motor.slope_at(speeds)).max()) * of_speed
    off = 0.5 * of_square / max(rms, math.sqrt(of_square), 1e-300)
    bend = abs(float(motor.continuous(mean * (1.0 + SPEED_STEP))) - limit) / (SPEED_STEP * mean)
    errors = {
        "mean_speed": of_mean / mean,
        "rms_torque": off / max(rms, 1e-300),
        "continuous_torque": bend * of_mean / limit,
    }
    errors |= {"continuous_share": (off + rms * bend * of_mean / limit) / limit, "peak_share": min(of_share, 1.0)}
    errors["peak_angle"] = place.end - place.start
    errors["peak_speed"] = (float(np.abs(speeds - there).max()) + of_speed) / there
    errors["peak_torque"] = (float(np.abs(torques - peak).max()) + of_torque) / max(abs(peak), 1e-300)
    ratio = None
    if motor.inertia:
        series = shaft.cycle.series[2] @ cells.basis(cells.NODES, cells.ORDER).T  # I* at the nodes, kg m²
        span = float(cells.integral(np.ones_like(series), mesh.half).sum())
        driven = shaft.run.inertia + float(cells.integral(series, mesh.half).sum()) / span
        ratio = driven / shaft.ratio**2 / motor.inertia - 1.0
        errors["inertia_ratio"] = (shaft.cycle.errors.inertia / driven + 8 * ROUNDING) * (1.0 + 1.0 / max(ratio, 1e-300))
    return ServoLoad(mean, rms, limit, rms / limit, peak, there, place.angle, most, ratio, errors)


def share_of_peak(motor: Motor, omega: Array) -> Array:
    """Torque over the peak curve; 1 beyond the greatest speed, where both are 0."""
    torque, most = np.abs(motor.torque(omega)), np.asarray(motor.peak(omega))
    return np.where(most > 0.0, torque / np.where(most > 0.0, most, 1.0), 1.0)


def servo_messages(load: ServoLoad) -> Iterator[str]:
    """Messages on a servo drive at its peak curve, or with a load of great inertia: place, amount and remedy."""
    if load.at_peak:
        at, speed = f"at crank angle {np.degrees(load.peak_angle):.4g} deg", load.peak_speed * 30 / math.pi
        message = f"THE SERVO DRIVE REACHES ITS PEAK CURVE {at}, {abs(load.peak_torque):.4g} N m at {speed:.5g} rpm"
        yield f"{message}: it does not hold its set speed; a heavier flywheel, another ratio or a larger drive needs less"
    if load.inertia_ratio is not None and load.inertia_ratio > USUAL_INERTIA_RATIO:
        message = f"the inertia that the servo drive moves is {load.inertia_ratio:.3g} times that of its rotor"
        advice = "another ratio, or a rotor of more inertia, brings it down"
        yield f"{message}; above {USUAL_INERTIA_RATIO:g} a speed controller is hard to damp in practice: {advice}"


def temperature(shaft: MotorShaft) -> Temperature | None:
    """Rise of the windings along a steady motion; None if the motor's data do not give it."""
    motor = shaft.motor
    if motor is None or motor.thermal is None:
        return None
    data, (mean, error) = motor.thermal, heat_share(motor, shaft)

    def evaluated(mesh: Cells) -> tuple[Temperature, float, Coarse]:
        omega = shaft.omega(mesh)
        shares = motor.heat_share(shaft.ratio * omega, shaft.states(mesh))
        rise, tails = greatest_rise(data, mesh.half[:, 0], 1.0 / omega, shares), cells.tails(cells.fit(shares))
        return rise, rise.error, cells.above(tails, 0.1)

    rise = shaft.refined(evaluated, shaft.rtol)
    return rise._replace(error=error / max(mean, 1e-300) + rise.error)


def trip_messages(trips: Iterable[Trip], ramped: bool = False) -> Iterator[str]:
    """Messages on an inverter that trips: cause, place and remedy, of a start on its ramp or of a motion that returns."""
    for kind, value, limit, angle, time in trips:
        at = f"at crank angle {np.degrees(angle) % 360.0:.4g} deg" + ("" if time is None else f" after {time:.5g} s")
        if kind == "overcurrent":
            message = f"THE INVERTER TRIPS by overcurrent {at}: {value:.4g} times the rated current, above {limit:g}"
            if ramped:
                yield f"{message}; a longer ramp, a larger motor or (without two-axis) a lower torque_limit needs less"
                continue
            yield f"{message}; a heavier flywheel, a larger motor or (without two-axis) a lower torque_limit needs less"
        elif kind == "overvoltage":
            message = f'THE INVERTER TRIPS by overvoltage {at}: the motor returns {value:.4g} W, and braking is "none"'
            yield f'{message}; give it a resistor, braking = "regenerative", or a load that drives less'
        else:
            message = f"THE INVERTER TRIPS {at}: the motor returns {value:.4g} W, above the chopper_power of {limit:.4g} W"
            yield f'{message}; give it a larger resistor, braking = "regenerative", or a load that drives less'
