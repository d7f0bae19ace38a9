"""The figures of a report: the flywheels side by side, every shaft, torque and power, speeds."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from math import log, log1p, pi

from flywheel.components.energy import HOUR, Energy, kilowatt_hours
from flywheel.components.gear_trains import OnShaft, gd2
from flywheel.components.motors import DC, Engine, Induction, Motor
from flywheel.components.wheels import ROUNDING, Wheel
from flywheel.numerics import cells as piecewise
from flywheel.numerics.units import columns, figure, short
from flywheel.regime.results import Cyclic, Sizing
from flywheel.report import rows as outcome
from flywheel.report.rows import (
    DEGREES,
    NOTHING,
    RPM,
    WIDTH,
    Row,
    block,
    irregularity,
    irregularity_in_words,
    or_unknown,
    percent_and_steadiness,
    rpm,
    sentences,
    shaft_of_wheel,
    wrapped,
)
from flywheel.sizing.drive import EngineCycle

# -- shafts ------------------------------------------------------------------------------------------------------------

# The same flywheel on every shaft, as the rows of a table.


_HEAD = ("shaft", "speed, rpm", "inertia, kg m²", "GD², kg m²")
_RIM = ("radius, m", "mass, kg", "rim speed, m/s")


def table(rows: Sequence[OnShaft], digits: int = 6) -> list[str]:
    """One line a shaft under a header; radius, mass and rim speed where they are known.

    >>> from flywheel.components.gear_trains import on_every_shaft
    >>> shafts = on_every_shaft(8.0, {"crank": 1.0, "motor": 2.0}, pi, radius=0.5)
    >>> for line in table(shafts):
    ...     print(line)
      shaft  speed, rpm  inertia, kg m²  GD², kg m²  radius, m  mass, kg  rim speed, m/s
      crank          30               8          32        0.5        32         1.5708
      motor          60               2           8        0.5         8         3.14159

    """
    rims = any(row.radius is not None for row in rows)
    lines = [_cells(row, rims, digits) for row in rows]
    return columns(lines, _HEAD + _RIM if rims else _HEAD)


def _cells(row: OnShaft, rims: bool, digits: int) -> list[str]:
    known = [row.speed * 30 / pi, row.inertia, row.gd2]
    rim = [row.radius, row.mass, row.rim_speed] if rims else []
    return [row.shaft, *("" if value is None else figure(value, 0.0, digits) for value in (*known, *rim))]


# -- flywheels ---------------------------------------------------------------------------------------------------------

# The first block of a report: the flywheels side by side and what they mean, or the given one.


_FAR_OFF = 1.5  # a factor between approximate and exact that deserves a sentence
_INERTIA_DIGITS = 6


def flywheel(sizing: Sizing) -> list[str]:
    """The candidates of a sizing with bounds and verdicts; the figures of a given flywheel."""
    return _sized_rows(sizing) if sizing.scene.inertia is None else _analysis_rows(sizing)


def every_shaft(sizing: Sizing) -> list[str]:
    """The same flywheel on every shaft, where there are several."""
    if len(sizing.shafts) < 2 or sizing.flywheel.needed is False:
        return []
    lines = ["The same flywheel on every shaft", *table(sizing.shafts, _INERTIA_DIGITS)]
    return lines + sentences(_on_conditions(sizing))


def _on_conditions(sizing: Sizing) -> Iterable[str]:
    """What the table of shafts holds for."""
    if sizing.built is not None:
        yield "Inertias and masses are those of the wheel above as built, made wider or narrower at its radii."
    if sizing.scene.efficiencies:
        yield "Each stores the same energy; losses in meshes may make the speed vary a little more or less."


def _sized_rows(sizing: Sizing) -> list[str]:
    asked = irregularity_in_words(sizing.scene.irregularity or 0.0)
    head = wrapped(f"Flywheel on {shaft_of_wheel(sizing)} for irregularity {asked}, crank at {rpm(sizing.speed)}", "")
    header = ("", "inertia, kg m²", "off by", "irregularity it gives", "as ± %", "steadiness")
    candidates = outcome.candidates(sizing)
    cells = [_comparison_cells(c) for c in candidates]
    table = columns(cells, header)
    if max(map(len, table)) > WIDTH:
        table = columns(cells, header, gap=" ", indent=" ")
    return head + table + _bracket(sizing) + sentences(_in_gd2(sizing, candidates)) + sentences(_verdicts(sizing))


def _comparison_cells(candidate: outcome.Candidate) -> tuple[str, ...]:
    inertia = or_unknown(candidate.inertia, candidate.error)
    off = "" if candidate.off is None else f"{figure(100 * candidate.off, 100 * candidate.off_error, 4)} %"
    if candidate.off is not None and candidate.off > 0 and off != "0 %":
        off = "+" + off
    if candidate.gives is None:
        return candidate.name, inertia, off, "no steady motion", "", ""
    eps, error = candidate.gives
    gives = or_unknown(eps, error) if eps > NOTHING else "0"
    return candidate.name, inertia, off, gives, *percent_and_steadiness(eps, error, 6)


_SHORT = {"exact": "exact", "approximate": "by the areas", "inertia_torque_flywheel": "by the torque"}


def _in_gd2(sizing: Sizing, candidates: list[outcome.Candidate]) -> Iterable[str]:
    """The inertias as GD², and the totals of the approximate ones."""
    if any(candidate.inertia > 0.0 for candidate in candidates):
        found = [f"{or_unknown(gd2(c.inertia), 4 * c.error, _INERTIA_DIGITS)} {_SHORT[c.key]}" for c in candidates]
        yield f"GD² = 4 J: {', '.join(found)}, kg m²."
    wheel, errors = sizing.flywheel, outcome.inertia_errors(sizing)
    if len(candidates) > 1 and wheel.approximate_total and wheel.inertia_torque:
        areas = or_unknown(wheel.approximate_total, errors.approximate, _INERTIA_DIGITS)
        torque = or_unknown(wheel.inertia_torque, errors.inertia_torque, _INERTIA_DIGITS)
        yield f"With the machine's own least inertia, as totals: {areas} by the areas, {torque} by the torque."


def _bracket(sizing: Sizing) -> list[str]:
    """Proven bounds of the exact flywheel."""
    wheel = sizing.flywheel
    if wheel.bracket is None or wheel.torque_bracket is None or not wheel.needed:
        return []
    errors = outcome.inertia_errors(sizing)
    areas, torque = _bounds(wheel.bracket, errors.approximate), _bounds(wheel.torque_bracket, errors.inertia_torque)
    return wrapped(f"Proven: exact between {areas} by the areas, {torque} by the torque.")


def _bounds(pair: tuple[float, float], error: float) -> str:
    low, high = (figure(max(bound, 0.0), error, 7) for bound in pair)
    return f"{low} and {high}"


def _verdicts(sizing: Sizing) -> Iterable[str]:
    """In words, what the figures above mean."""
    wheel = sizing.flywheel
    if sizing.scene.areas is not None:
        yield "A diagram of areas tells nothing of the machine's own inertia: the figure is the total inertia needed."
        return
    if wheel.needed is False:
        yield from _without_wheel(sizing)
        return
    exact, approximate = wheel.exact or 0.0, wheel.approximate or 0.0
    why = _why_far_off(sizing)
    if approximate == 0.0:
        yield f"The accumulated areas ask for no flywheel at all, and are wrong: {why}"
    elif exact > _FAR_OFF * approximate:
        yield f"The approximate flywheel is {_times(exact / approximate)} times too small: {why}"
    elif approximate > _FAR_OFF * exact:
        yield f"The approximate flywheel is {_times(approximate / exact)} times larger than needed: {why}"


def _why_far_off(sizing: Sizing) -> str:
    if sizing.cyclic is not None:
        return "it leaves out the machine's own varying inertia, and takes torques at a constant speed."
    return "at this speed the varying inertia of the machine itself dominates."


def _times(factor: float) -> str:
    return f"{factor:.0f}" if factor >= 100 else figure(factor, 0.0, 2)


def _without_wheel(sizing: Sizing) -> Iterable[str]:
    if sizing.run is None and sizing.energy_fluctuation > 0.0:
        yield "No flywheel is needed: the machine has no inertia, and its torques alone hold its speed as evenly as asked."
        return
    if sizing.run is None:
        yield "No flywheel is needed: nothing acts on the machine that could change its speed."
        return
    eps = irregularity_in_words(sizing.run.irregularity, sizing.run.error * sizing.run.irregularity)
    yield f"No flywheel is needed: the machine's own inertia suffices and gives an irregularity of {eps}."


def _analysis_rows(sizing: Sizing) -> list[str]:
    inertia = sizing.scene.inertia or 0.0
    where = f"{figure(inertia)} kg m² on {shaft_of_wheel(sizing)}"
    lines = wrapped(f"Given flywheel of {where}, crank at {rpm(sizing.speed)}", "")
    motion = sizing.simulation
    if motion is None:
        return lines
    error = (sizing.error.simulation or 0.0) * motion.irregularity
    swing, steadiness = percent_and_steadiness(motion.irregularity, error, 10)
    rows = [
        Row("irregularity", irregularity(motion.irregularity, error)),
        Row("as ± %", swing),
        Row("steadiness", steadiness),
        Row("GD² of the flywheel", figure(gd2(inertia)), "kg m²"),
    ]
    return lines + columns(rows)


# -- power -------------------------------------------------------------------------------------------------------------

# Torque, power and energy of a report: what the drive gives with the flywheel and without it, beside its motor's rating.


_HORSEPOWER = 745.6998715822702  # W: 550 ft lbf/s
_METRIC_HORSEPOWER = 735.49875  # W: 75 kgf m/s
_POWER_DIGITS = 6
_TIE = 1e-9  # share within which two sizes are one
_NEAR = 0.9  # of the breakdown torque: a torque past it is told of
_LONG = 30.0  # s: in a longer cycle windings warm up and cool down


def torque_and_work(sizing: Sizing) -> list[str]:
    """The balance, the drive's power and work, the fluctuation of energy."""
    work = outcome.work_error(sizing)
    rows = [*_balance(sizing), *_power(sizing)]
    rows.append(Row("energy fluctuation", figure(sizing.energy_fluctuation, 2 * work), "J"))
    if sizing.coefficient_of_energy is not None:
        error = 2 * work / abs(sizing.drive_work or 1.0)
        rows.append(Row("coefficient of energy", figure(sizing.coefficient_of_energy, error), "of the drive's work"))
    if sizing.engine is not None:
        rows += _engine(sizing.engine)
    elif sizing.scene.drive is None and sizing.scene.areas is None:
        rows.append(Row("power", "none", "(no drive in the scene)"))
    by = (
        ""
        if sizing.power is None and sizing.engine is None
        else " (power: work of a cycle over its angle, times the mean of extremes)"
    )
    return block(f"Torque, power, energy{by}", rows)


def _balance(sizing: Sizing) -> Iterable[Row]:
    balance, scene = sizing.balance, sizing.scene
    if balance is None:
        return
    value = figure(balance.value, outcome.balance_error(sizing))
    if balance.name == "drive" and scene.drive is not None:
        yield Row("torque of the drive (balance)", value, f"N m on {scene.drive.on}")
    else:
        yield Row(f"{balance.name} (balance)", value, sizing.balance_unit or "in the units of its expression")


def _power(sizing: Sizing) -> Iterable[Row]:
    power, work = sizing.power, sizing.drive_work
    if power is None or work is None:
        return
    error = outcome.work_error(sizing) * sizing.speed / sizing.scene.cycle
    yield _power_row("power of the drive" if power >= -error else "power of the drive (it brakes)", power, error)
    yield Row("work of the drive in a cycle", figure(work, outcome.work_error(sizing)), "J")


def _power_row(name: str, power: float, error: float) -> Row:
    """A power in W or kW, and in both horsepowers."""
    scale, unit = (1e3, "kW") if abs(power) >= 1e3 else (1.0, "W")
    horses = " = ".join(
        f"{figure(power / size, error / size, 5)} {name}"
        for size, name in ((_HORSEPOWER, "hp"), (_METRIC_HORSEPOWER, "metric hp"))
    )
    return Row(name, figure(power / scale, error / scale), f"{unit} = {horses}")


def _engine(engine: EngineCycle) -> Iterable[Row]:
    """What the gas gives, and what is left of it for the loads."""
    per_work = engine.indicated_power / engine.indicated_work
    yield Row("indicated work in a cycle", figure(engine.indicated_work, engine.error), "J")
    yield _power_row("indicated power", engine.indicated_power, engine.error * per_work)
    if engine.mean_effective_pressure is not None and engine.swept_volume is not None:
        pressure, litres = engine.mean_effective_pressure / 1e5, figure(1e3 * engine.swept_volume, most=6)
        doubt = engine.error * pressure / engine.indicated_work
        yield Row("mean effective pressure", figure(pressure, doubt), f"bar over {litres} l swept in a cycle")
    else:
        yield Row("mean effective pressure", "not known", "(give the load's bore)")
    if engine.brake_power is None or engine.mechanical_efficiency is None:
        return
    yield _power_row("brake power", engine.brake_power, engine.error * per_work)
    efficiency = figure(100 * engine.mechanical_efficiency, 100 * engine.error / engine.indicated_work, 6)
    lossless = engine.indicated_work - (engine.brake_work or 0.0) <= 2 * engine.error
    yield Row("mechanical efficiency", efficiency, "% (the scene has no losses)" if lossless else "%")


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
    return figure(value, 0.0, _POWER_DIGITS)


def _per_hour(power: float) -> str:
    return _number(kilowatt_hours(power, HOUR))


def _ratio(value: float | None) -> str:
    return "none" if value is None else _number(value)


# -- the motor -------------------------------------------------------------------------------------------------------


def _of_motor(sizing: Sizing, energy: Energy) -> Iterator[str]:
    """What the machine asks of its motor, beside what the motor is rated for: what heats it by its own kind."""
    motor = sizing.scene.motor
    if motor is None:
        return
    rated, torque = motor.rated, _greatest_torque(sizing)
    greatest = f"greatest torque {_signed(torque)} N m on its shaft"
    if rated is None:
        yield f"{motor.title} without a rated point; {greatest}; {_rms(energy)}."
    else:
        point = f"{_number(rated.power / 1e3)} kW ({_number(rated.torque)} N m at {_number(rated.speed * RPM)} rpm)"
        shares = f"mean {_share(energy.mean_power, rated.power)}, greatest {_share(energy.peak_power, rated.power)} of it"
        if isinstance(motor, Engine):
            yield f"{motor.title}, full load {point}: {shares};"
            yield f"{greatest}, {_share(abs(torque), rated.torque)} of the full-load one there."
        else:
            yield f"{motor.title}, rated power {point}: {shares};"
            yield f"{greatest}, {_share(abs(torque), rated.torque)} of the rated one{_of_breakdown(motor, torque)};"
            yield f"{_rms(energy)}, {_share(energy.rms_torque, rated.torque)} of the rated one."
    yield from _heat(sizing, motor, energy)
    yield from _slowest(sizing, motor)
    yield from _beyond_data(sizing, motor)


def _rms(energy: Energy) -> str:
    return f"root of its mean square over time {_number(energy.rms_torque)} N m"


def _of_breakdown(motor: Motor, torque: float) -> str:
    """A torque beside an induction motor's greatest one, which is the same while it generates."""
    return f", {_share(abs(torque), motor.breakdown_torque)} of the breakdown torque" if isinstance(motor, Induction) else ""


def _heat(sizing: Sizing, motor: Motor, energy: Energy) -> Iterator[str]:
    """What heats the motor, where its kind tells; of others, that it is not known."""
    even = _ratio_of(sizing) * (sizing.constant_speed or sizing.speed)
    if isinstance(motor, Induction) and energy.rotor_heat is not None:
        rated = float(motor.rotor_heat(motor.speed))
        heat = f"Heat of its rotor, torque times slip speed on the mean over time: {_number(energy.rotor_heat)} W"
        yield f"{heat}, {_verdict(energy, 'rotor_heat', rated, float(motor.rotor_heat(even)))}"
    elif isinstance(motor, DC) and energy.copper_heat is not None:
        yield _current(motor, energy)
        heat = f"Copper heat of its armature, R i² on the mean over time: {_number(energy.copper_heat)} W"
        if motor.rated_current is None:
            yield f"{heat}; what it may be is not known without a rated point."
        else:
            rated, at_even = (motor.copper_heat(current) for current in (motor.rated_current, motor.current(even)))
            yield f"{heat}, {_verdict(energy, 'copper_heat', rated, at_even)}"
    elif not isinstance(motor, Engine):
        yield "Torque against speed alone does not tell what heats it: give the motor as induction or dc for that."
        if motor.rated is not None and energy.mean_power > motor.rated.power * (1 + _TIE):
            yield "The mean power is more than the rated one."


def _current(motor: DC, energy: Energy) -> str:
    """A DC motor's current, beside the rated one where that is known."""
    rms, greatest, rated = energy.current_rms or 0.0, energy.current_peak or 0.0, motor.rated_current
    beside = ["" if rated is None else f", {_share(abs(current), rated)} of the rated one" for current in (rms, greatest)]
    means = f"root of its mean square over time {_number(rms)} A{beside[0]}"
    return f"Current of its armature: {means}; greatest {_signed(greatest)} A{beside[1]}."


def _verdict(energy: Energy, name: str, rated: float, even: float) -> str:
    """What a heat means beside that at the rated point; `even` is the heat at a speed that does not vary (both W)."""
    share, error = getattr(energy, f"{name}_share"), energy.errors[f"{name}_share"]
    beside = f"{figure(100 * share, 0.0, 5)} % of the {_number(rated)} W at the rated point"
    if share > 1.0 + max(share * error, _TIE):
        hot, steadily = f"{beside}, too hot for continuous running", f"at a constant speed it would be {_share(even, rated)}"
        return f"{hot}. Choose a larger motor{f': even {steadily}' if even > rated else f', or more flywheel: {steadily}'}."
    long = f"; but in a cycle of {_number(energy.period)} s it grows hotter for a while than on the mean"
    return f"{beside}, within what it is rated for{long if energy.period > _LONG else ''}."


def _slowest(sizing: Sizing, motor: Motor) -> Iterator[str]:
    """A warning where the motor comes near the end of its running branch, or beyond it."""
    least, breakdown = _speeds(sizing)[0], motor.breakdown
    falls = f"Its speed falls to {_number(least * RPM)} rpm"
    if isinstance(motor, Engine):
        if least < motor.speed * (1 - _TIE):
            governed = f"below the {_number(motor.speed * RPM)} rpm up to which it is at full load"
            yield f"{falls}, {governed}: what the load takes beyond that comes from the flywheel."
        return
    if breakdown is None:
        return
    name = "the breakdown torque" if isinstance(motor, Induction) else "the greatest torque of its running branch"
    there = f"{_number(breakdown.torque)} N m at {_number(breakdown.speed * RPM)} rpm"
    torque = float(motor.torque(least))
    if least < breakdown.speed * (1 - _TIE):
        yield f"{falls}, past {name}, {there}: slower than that it gives less, and stalls if the load goes on."
        if isinstance(motor, Induction):
            yield "Kloss's formula, and the heat by it, is rough there."
    elif torque > _NEAR * breakdown.torque:
        share = f"At its least speed it gives {_share(torque, breakdown.torque)} of {name}, {there}"
        yield f"{share}: slower than that it gives less."


def _beyond_data(sizing: Sizing, motor: Motor) -> Iterator[str]:
    """A warning where the motor runs at speeds that its data do not speak of."""
    (least, greatest), (low, high) = _speeds(sizing), motor.covers
    if least < low * (1 - _TIE) or greatest > high * (1 + _TIE):
        runs = f"It runs from {_number(least * RPM)} to {_number(greatest * RPM)} rpm"
        known = f"to {_number(high * RPM)} rpm" if math.isfinite(high) else "upwards"
        yield f"{runs}, but its data hold from {_number(low * RPM)} {known}: its torque beyond is a guess."


def _ratio_of(sizing: Sizing) -> float:
    """Speed of the drive's shaft over that of the crank."""
    assert sizing.scene.drive is not None
    return sizing.scene.shafts[sizing.scene.drive.on]


def _speeds(sizing: Sizing) -> tuple[float, float]:
    """Least and greatest speed of the motor, rad/s."""
    run, ratio = sizing.run, _ratio_of(sizing)
    return (sizing.speed * ratio,) * 2 if run is None else (ratio * run.speed_min, ratio * run.speed_max)


def _greatest_torque(sizing: Sizing) -> float:
    """The torque (N m) of the motor that is largest in size along the cycle, at its own shaft, with its sign."""
    scene, run = sizing.scene, sizing.run
    assert scene.motor is not None
    ratio = _ratio_of(sizing)
    if run is None or run.drive is None:
        return float(scene.motor.torque(ratio * sizing.speed))
    series = piecewise.fit(run.drive)
    high, low = piecewise.greatest(series), -piecewise.greatest(-series)
    return (high if high >= -low * (1 - _TIE) else low) / ratio


def _share(part: float, whole: float) -> str:
    return f"{figure(100 * part / whole, 0.0, 3)} %"


# -- regimes -----------------------------------------------------------------------------------------------------------

# Speeds of a report: asked and taken, greatest and least; and how a motion whose torques depend on speed holds itself.


_LEFT = 0.01  # of a change, when it counts as gone
_NEAR_ONE = 0.01  # of a multiplier to 1: the difference then says more
_NOTHING = 1e-12  # of a damping that rounding makes
_ALIKE = 1e-9  # a multiplier, and 1 less the damping, of a motor with a current too: theirs may turn


def speeds(sizing: Sizing) -> list[str]:
    """The speeds of the crank, and of the flywheel's shaft."""
    found, scene = outcome.speeds(sizing), sizing.scene
    if found is None:
        return []
    rows = [
        *_asked(sizing),
        _regime_cells("mean of extremes", sizing.speed, 0.0),
        _regime_cells("greatest", found.greatest, found.error, sizing.angle_speed_max),
        _regime_cells("least", found.least, found.error, sizing.angle_speed_min),
    ]
    if sizing.simulation is not None and sizing.simulation.speed_time_mean is not None:
        rows.append(_regime_cells("mean over time", sizing.simulation.speed_time_mean, found.error))
    if scene.flywheel_on != "crank":
        rows.append(_regime_cells(f"mean, shaft {scene.flywheel_on}", sizing.speed * scene.flywheel_ratio, 0.0))
    header = ("", "rpm", "rad/s", "at, deg")
    keep = slice(4 if sizing.angle_speed_max is not None else 3)
    return ["Speed of the crank", *columns([row[keep] for row in rows], header[keep])]


def _asked(sizing: Sizing) -> Iterable[tuple[str, ...]]:
    """The speed asked for, where the machine takes one of its own."""
    if sizing.cyclic is not None and sizing.scene.unknown is None and sizing.scene.speed is not None:
        yield _regime_cells("asked for", sizing.scene.speed, 0.0)


def _regime_cells(name: str, speed: float, error: float, angle: float | None = None) -> tuple[str, ...]:
    at = "" if angle is None else figure(angle * DEGREES, 1e-9, 7)
    return name, figure(speed * RPM, error * RPM), figure(speed, error), at


def holding(sizing: Sizing) -> list[str]:
    """The cycle multiplier in words, and the constant speed that the approximate figures hold for."""
    cyclic = sizing.cyclic
    if cyclic is None:
        return []
    lines = block("How the motion holds itself", [*_multiplier(cyclic), *_settling(sizing, cyclic)])
    speed = cyclic.constant_speed
    at = f"{figure(speed, 0.0, 7)} rad/s ({figure(speed * RPM, 0.0, 7)} rpm)"
    return lines + sentences([f"Areas and approximate figures take the torques at a constant {at}."])


def _multiplier(cyclic: Cyclic) -> Iterable[Row]:
    value = figure(cyclic.multiplier, 0.0, 6)
    yield Row("cycle multiplier", value, "what a cycle leaves of a small change of speed")
    if _NOTHING < abs(cyclic.damping) < _NEAR_ONE:
        yield Row("1 - multiplier", short(cyclic.damping))


def _settling(sizing: Sizing, cyclic: Cyclic) -> Iterable[Row]:
    """How long a change takes to go, or why it does not."""
    if cyclic.damping < -_NOTHING or cyclic.multiplier > 1.0 + _ALIKE:
        yield Row("settles", "no", "a change grows from cycle to cycle")
    elif cyclic.damping <= _NOTHING:
        yield Row("settles", "no", "no torque brings a change of speed back")
    else:
        cycles = settling_cycles(cyclic)
        lasts = sizing.scene.cycle / sizing.speed
        yield Row("settles to 1 % in", figure(cycles, 0.0, 3), f"cycles, {figure(cycles * lasts, 0.0, 3)} s")


def settling_cycles(cyclic: Cyclic) -> float:
    """Cycles after which a hundredth of a small change is left: ln 0.01/ln multiplier, below 1 where it goes faster.

    >>> round(settling_cycles(Cyclic(0.5, 0.5, 3, 0.0, 1.0)), 6)
    6.643856
    """
    if cyclic.multiplier < _LEFT**100:  # nothing is left that a number could show
        return 0.0
    near = cyclic.damping < 0.5 and abs(1.0 - cyclic.damping - cyclic.multiplier) < _ALIKE  # its digits are in damping
    return log(_LEFT) / (log1p(-cyclic.damping) if near else log(cyclic.multiplier))


# -- wheels ------------------------------------------------------------------------------------------------------------

# A wheel as rows of a report.


WheelRow = tuple[str, str, str]

_MEGA = 1e6
_WHEEL_DIGITS = 6


def rows(wheel: Wheel) -> list[WheelRow]:
    """Name, value and unit of everything about a wheel: dimensions in mm, stresses in MPa.

    >>> from flywheel.wheel import WheelAsked, choose
    >>> from flywheel.components.wheel_stresses import material
    >>> wheel = choose(10.0, 100.0, WheelAsked("disc", material("carbon steel"), outer_radius=0.3))
    >>> rows(wheel)[:3]
    [('shape', 'disc', ''), ('material', 'carbon steel', ''), ('outer radius', '300', 'mm')]
    """
    return [
        ("shape", _shape(wheel), ""),
        ("material", wheel.material.name, ""),
        *_dimensions(wheel),
        *_masses(wheel),
        ("rim speed", _quantity(wheel.rim_speed), "m/s"),
        *((f"stress, {place}", _quantity(value / _MEGA), _mega(wheel, value)) for place, value in wheel.stresses.items()),
        *_judgement(wheel),
    ]


def _shape(wheel: Wheel) -> str:
    return f"{wheel.shape}, taken as thin" if wheel.body.thin else wheel.shape


_COMPARED = {
    "disc": "the lightest disc instead",
    "rim": "the lightest rim instead",
    "arms": "the lightest rim on arms instead",
}


def _mega(wheel: Wheel, stress: float) -> str:
    """The unit of a stress, with a mark where it is too much."""
    allowable = wheel.material.allowable
    return "MPa" if allowable is None or stress <= allowable * (1 + ROUNDING) else "MPa, above the allowable"


def _quantity(value: float) -> str:
    return figure(value, most=_WHEEL_DIGITS)


def _size(name: str, value: float) -> WheelRow:
    return name, _quantity(value * 1e3), "mm"


def _dimensions(wheel: Wheel) -> list[WheelRow]:
    """Every dimension that the shape has."""
    body, found = wheel.body, [_size("outer radius", wheel.body.outer)]
    if wheel.shape != "disc":
        found += [_size("mean radius", body.mean), _size("thickness", body.thickness)]
    found.append(_size("width", body.width))
    if wheel.shape == "disc" and body.inner > 0.0:
        found.append(_size("bore", 2 * body.inner))
    if body.arms is not None:
        sizes = _size("arm width", body.arms.width), _size("arm thickness", body.arms.thickness)
        found += [("arms", str(body.arms.number), ""), *sizes]
    if body.hub is not None:
        found += [
            _size("bore", body.hub.bore),
            _size("hub diameter", body.hub.diameter),
            _size("hub length", body.hub.length),
        ]
    return found


def _masses(wheel: Wheel) -> list[WheelRow]:
    """Mass and inertia, of the parts too where there are several."""
    found: list[WheelRow] = [("mass", _quantity(wheel.mass), "kg"), ("inertia", figure(wheel.inertia), "kg m²")]
    found.append(("GD²", figure(gd2(wheel.inertia)), "kg m²"))
    if len(wheel.parts) > 1:
        found += [(f"mass, {part.name}", _quantity(part.mass), "kg") for part in wheel.parts if part.mass is not None]
        found += [(f"inertia, {part.name}", _quantity(part.inertia), "kg m²") for part in wheel.parts]
    return found


def _judgement(wheel: Wheel) -> list[WheelRow]:
    """Safety, and the other shapes where the lightest one was asked for."""
    found: list[WheelRow] = []
    if wheel.material.allowable is not None:
        found.append(("allowable stress", _quantity(wheel.material.allowable / _MEGA), "MPa"))
    if wheel.safety is not None:
        against = "strength" if wheel.material.strength is not None else "allowable stress"
        found.append((f"safety factor, by {against}", _quantity(wheel.safety), ""))
    others = {shape: mass for shape, mass in wheel.compared.items() if shape != wheel.shape}
    return [*found, *((_COMPARED[shape], _quantity(mass), "kg") for shape, mass in others.items())]
