"""Torque, power and energy of a report: what the drive gives with the flywheel and without it, beside its motor's rating."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from flywheel import piecewise
from flywheel.energy import HOUR, Energy, kilowatt_hours
from flywheel.motors.base import Motor
from flywheel.results import Sizing
from flywheel.writing import outcome
from flywheel.writing.digits import columns, figure
from flywheel.writing.rows import RPM, Row, block, sentences

_HORSEPOWER = 745.6998715822702  # W: 550 ft lbf/s
_METRIC_HORSEPOWER = 735.49875  # W: 75 kgf m/s
_DIGITS = 6
_TIE = 1e-9  # share within which two sizes are one
_NEAR = 0.9  # of the breakdown torque: a torque past it is told of


def torque_and_work(sizing: Sizing) -> list[str]:
    """The balance, the drive's power and work, the fluctuation of energy."""
    work = outcome.work_error(sizing)
    rows = [*_balance(sizing), *_power(sizing)]
    rows.append(Row("energy fluctuation", figure(sizing.energy_fluctuation, 2 * work), "J"))
    if sizing.coefficient_of_energy is not None:
        error = 2 * work / abs(sizing.drive_work or 1.0)
        rows.append(Row("coefficient of energy", figure(sizing.coefficient_of_energy, error), "of the drive's work"))
    elif sizing.scene.drive is None and sizing.scene.areas is None:
        rows.append(Row("power", "none", "(no drive in the scene)"))
    by = "" if sizing.power is None else " (power: work of a cycle over its angle, times the mean of extremes)"
    return block(f"Torque, power, energy{by}", rows)


def _balance(sizing: Sizing) -> Iterable[Row]:
    balance, scene = sizing.balance, sizing.scene
    if balance is None:
        return
    value = figure(balance.value, outcome.balance_error(sizing))
    if balance.name == "drive" and scene.drive is not None:
        yield Row("torque of the drive (balance)", value, f"N m on {scene.drive.on}")
    else:
        yield Row(f"{balance.name} (balance)", value, "SI")


def _power(sizing: Sizing) -> Iterable[Row]:
    power, work = sizing.power, sizing.drive_work
    if power is None or work is None:
        return
    error = outcome.work_error(sizing) * sizing.speed / sizing.scene.cycle
    scale, unit = (1e3, "kW") if abs(power) >= 1e3 else (1.0, "W")
    horses = " = ".join(
        f"{figure(power / size, error / size, 5)} {name}"
        for size, name in ((_HORSEPOWER, "hp"), (_METRIC_HORSEPOWER, "metric hp"))
    )
    name = "power of the drive" if power >= -error else "power of the drive (it brakes)"
    yield Row(name, figure(power / scale, error / scale), f"{unit} = {horses}")
    yield Row("work of the drive in a cycle", figure(work, outcome.work_error(sizing)), "J")


def with_and_without(sizing: Sizing) -> list[str]:
    """The drive's power over time, with the flywheel and without one, and what that asks of its motor."""
    energy = sizing.energy
    if energy is None:
        return []
    ratios = energy.peak_to_mean, energy.peak_to_mean_alone
    rows = [
        ("mean, W", _signed(energy.mean_power), _signed(energy.mean_power_alone)),
        ("greatest, W", _signed(energy.peak_power), _signed(energy.peak_power_alone)),
        *([] if ratios == (None, None) else [("greatest over mean", *map(_ratio, ratios))]),
        ("energy in an hour, kWh", _per_hour(energy.mean_power), _per_hour(energy.mean_power_alone)),
    ]
    header = ("", "with the flywheel", "without one, at constant speed")
    title = "Power of the drive over the time of a cycle (mean: its work over the period)"
    return [title, *columns(rows, header), *sentences(_of_motor(sizing, energy))]


def _signed(value: float) -> str:
    """A power or torque, the one that is largest in size, with a word where it brakes."""
    return _number(value) + (" (it brakes)" if value < 0.0 else "")


def _number(value: float) -> str:
    return figure(value, 0.0, _DIGITS)


def _per_hour(power: float) -> str:
    return _number(kilowatt_hours(power, HOUR))


def _ratio(value: float | None) -> str:
    return "none" if value is None else _number(value)


# -- the motor -------------------------------------------------------------------------------------------------------


def _of_motor(sizing: Sizing, energy: Energy) -> Iterator[str]:
    """What the machine asks of its motor, beside what the motor is rated for."""
    motor = sizing.scene.motor
    if motor is None:
        return
    rated, torque = motor.rated, _greatest_torque(sizing)
    greatest = f"greatest torque {_signed(torque)} N m on its shaft"
    rms = f"root of its mean square over time {_number(energy.rms_torque)} N m"
    limit = "" if motor.breakdown is None else f", {_share(abs(torque), motor.breakdown.torque)} of the breakdown torque"
    if rated is None:
        yield f"{motor.title} without a rated point; {greatest}{limit}; {rms}."
        return
    point = f"{_number(rated.torque)} N m at {_number(rated.speed * RPM)} rpm"
    shares = f"mean {_share(energy.mean_power, rated.power)}, greatest {_share(energy.peak_power, rated.power)} of it"
    yield f"{motor.title}, rated power {_number(rated.power / 1e3)} kW ({point}): {shares};"
    yield f"{greatest}, {_share(abs(torque), rated.torque)} of the rated one{limit};"
    yield f"{rms}, {_share(energy.rms_torque, rated.torque)} of the rated one: it is what heats the motor."
    if energy.rms_torque > rated.torque:
        yield "That is more than the motor is rated for: it would grow too hot. Choose a larger one, or more flywheel."
    elif energy.mean_power > rated.power:
        yield "The mean power is more than the motor is rated for. Choose a larger one."
    yield from _near_breakdown(motor, torque)


def _near_breakdown(motor: Motor, torque: float) -> Iterator[str]:
    """A warning where the torque comes near the greatest one that the running branch has."""
    breakdown = motor.breakdown
    if breakdown is not None and torque > _NEAR * breakdown.torque:
        share = f"{_share(torque, breakdown.torque)} of the breakdown torque, {_number(breakdown.torque)} N m"
        yield f"The greatest torque is {share}: beyond it the motor stalls."


def _greatest_torque(sizing: Sizing) -> float:
    """The torque (N m) of the motor that is largest in size along the cycle, at its own shaft, with its sign."""
    scene, run = sizing.scene, sizing.run
    assert scene.drive is not None
    assert scene.motor is not None
    ratio = scene.shafts[scene.drive.on]
    if run is None or run.drive is None:
        return float(scene.motor.torque(ratio * sizing.speed))
    series = piecewise.fit(run.drive)
    high, low = piecewise.greatest(series), -piecewise.greatest(-series)
    return (high if high >= -low * (1 - _TIE) else low) / ratio


def _share(part: float, whole: float) -> str:
    return f"{figure(100 * part / whole, 0.0, 3)} %"
