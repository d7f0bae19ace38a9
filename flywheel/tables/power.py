"""Torque, power and energy of a sizing: the drive's output compared with its motor's rating, and the power flow."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

from flywheel.components.energy import HOUR, Energy, ServoLoad, kilowatt_hours
from flywheel.components.load_models import model_of
from flywheel.language import message, number
from flywheel.language import text as _
from flywheel.numerics import cells as piecewise
from flywheel.numerics.cells import TIE
from flywheel.numerics.units import columns, figure, short
from flywheel.sizing.findings import work_error
from flywheel.sizing.results import EngineCycle, PowerFlow, Sizing, Stream
from flywheel.tables.rows import (
    DEGREES,
    RPM,
    SI,
    Row,
    TradeUnits,
    block,
    encoded,
    few_digits,
    figures,
    paragraphs,
    place,
    sentences,
)

if TYPE_CHECKING:
    from flywheel.components.motors import Motor
    from flywheel.sizing.results import Duty, ElectricalTransients, Synchronism

_HORSEPOWER = 745.6998715822702  # W: 550 ft lbf/s
_METRIC_HORSEPOWER = 735.49875  # W: 75 kgf m/s
_DIGITS = 6
_NEAR = 0.9  # of the breakdown torque: a greater torque gets a remark
_LONG = 30.0  # s: in a longer cycle windings warm up and cool down


def balance_error(sizing: Sizing) -> float:
    """Absolute error of the balance's value (SI): for a drive that of the work over the angle that its shaft turns."""
    balance, scene = sizing.balance, sizing.scene
    if balance is None:
        return 0.0
    if balance.name == "drive" and scene.drive is not None:
        return work_error(sizing) / (scene.shafts[scene.drive.on] * scene.cycle)
    return balance.error * abs(balance.value)


def torque_and_work(sizing: Sizing) -> list[str]:
    """The balance, the drive's power and work, the fluctuation of energy."""
    scene, balance, work = sizing.scene, sizing.balance, work_error(sizing)
    rows = []
    if balance is not None:
        value = figure(balance.value, balance_error(sizing))
        if balance.name == "drive" and scene.drive is not None:
            rows.append(Row("torque of the drive (balance)", value, f"N m on {scene.drive.on}"))
        else:
            rows.append(Row(f"{balance.name} (balance)", value, sizing.balance_unit or "in the units of its expression"))
    if sizing.power is not None and sizing.drive_work is not None:
        error = work * sizing.speed / scene.cycle
        rows.append(
            _power(f"power, mean of extreme speeds{'' if sizing.power >= -error else ' (it brakes)'}", sizing.power, error)
        )
        rows.append(Row("work of the drive in a cycle", figure(sizing.drive_work, work), "J"))
    rows += figures(sizing)
    if sizing.engine is not None:
        rows += _engine(sizing.engine)
    elif scene.drive is None and scene.areas is None:
        rows.append(Row("power", "none", "(no drive in the scene)"))
    complete = sizing.power is not None or sizing.engine is not None
    by = " (power: work of a cycle over its angle, times the mean of extremes)" if complete else ""
    return block(f"Torque, power, energy{by}", rows)


def _power(name: str, power: float, error: float) -> Row:
    """A power in W or kW, and in both horsepowers."""
    scale, unit = (1e3, "kW") if abs(power) >= 1e3 * (1 - TIE) else (1.0, "W")
    horses = " = ".join(
        f"{figure(power / size, error / size, 5)} {name}"
        for size, name in ((_HORSEPOWER, "hp"), (_METRIC_HORSEPOWER, "metric hp"))
    )
    return Row(name, figure(power / scale, error / scale), f"{unit} = {horses}")


def _engine(engine: EngineCycle) -> Iterator[Row]:
    """Work of the gas, and the share left for the loads."""
    per_work = engine.indicated_power / engine.indicated_work
    yield Row("indicated work in a cycle", figure(engine.indicated_work, engine.error), "J")
    yield _power("indicated power", engine.indicated_power, engine.error * per_work)
    if engine.mean_effective_pressure is not None and engine.swept_volume is not None:
        pressure, litres = engine.mean_effective_pressure / 1e5, figure(1e3 * engine.swept_volume, most=6)
        error = engine.error * pressure / engine.indicated_work
        yield Row("mean effective pressure", figure(pressure, error), f"bar over {litres} l swept in a cycle")
    else:
        yield Row("mean effective pressure", "not known", "(give the load's bore)")
    if engine.brake_power is None or engine.mechanical_efficiency is None:
        return
    yield _power("brake power", engine.brake_power, engine.error * per_work)
    efficiency = figure(100 * engine.mechanical_efficiency, 100 * engine.error / engine.indicated_work, 6)
    lossless = engine.indicated_work - (engine.brake_work or 0.0) <= 2 * engine.error
    yield Row("mechanical efficiency", efficiency, "% (the scene has no losses)" if lossless else "%")


def with_and_without(sizing: Sizing) -> list[str]:
    """The drive's power over time, with the flywheel and without one, and the load of its motor."""
    energy, motor = sizing.energy, sizing.scene.motor
    if energy is None:
        return []
    ratios = energy.peak_to_mean, energy.peak_to_mean_alone
    hours = [_number(kilowatt_hours(power, HOUR)) for power in (energy.mean_power, energy.mean_power_alone)]
    rows = [
        ("mean, W", _signed(energy.mean_power), _signed(energy.mean_power_alone)),
        ("greatest, W", _signed(energy.peak_power), _signed(energy.peak_power_alone)),
        ("greatest over mean", *("none" if ratio is None else _number(ratio) for ratio in ratios)),
        ("energy in an hour, kWh", *hours),
    ]
    if ratios == (None, None):
        del rows[2]
    header = ("", "with the flywheel", "without one, at constant speed")
    title = "Power of the drive over the time of a cycle (mean: its work over the period)"
    lines = (
        [] if motor is None else [*_rated(sizing, motor, energy), *_heat(sizing, motor, energy), *warnings(sizing, motor)]
    )
    return [title, *columns(rows, header), *sentences(lines)]


def _number(value: float) -> str:
    return figure(value, 0.0, _DIGITS)


def _signed(value: float) -> str:
    """A power or torque of greatest size, with a word if it brakes."""
    return _number(value) + (" (it brakes)" if value < 0.0 else "")


def _share(part: float, whole: float) -> str:
    return f"{few_digits(100 * part / whole, 3)} %"


# -- the motor -------------------------------------------------------------------------------------------------------


def _ratio(sizing: Sizing) -> float:
    """Speed of the drive's shaft over that of the crank."""
    assert sizing.scene.drive is not None
    return sizing.scene.shafts[sizing.scene.drive.on]


def _rated(sizing: Sizing, motor: Motor, energy: Energy) -> Iterator[str]:
    """Power and torque that the machine needs from its motor, compared with the motor's rating."""
    rated, run, ratio = motor.rated, sizing.run, _ratio(sizing)
    if run is None or run.drive is None:
        torque = float(motor.torque(ratio * sizing.speed))
    else:  # the one that is largest in size along the cycle, at the motor's own shaft, with its sign
        series = piecewise.fit(run.drive)
        high, low = piecewise.greatest(series), -piecewise.greatest(-series)
        torque = (high if high >= -low * (1 - TIE) else low) / ratio
    greatest = f"greatest torque {_signed(torque)} N m on its shaft"
    rms = f"root of its mean square over time {_number(energy.rms_torque)} N m"
    if rated is None:
        yield f"{motor.title} without a rated point; {greatest}; {rms}."
        return
    point = f"{_number(rated.power / 1e3)} kW ({_number(rated.torque)} N m at {_number(rated.speed * RPM)} rpm)"
    shares = f"mean {_share(energy.mean_power, rated.power)}, greatest {_share(energy.peak_power, rated.power)} of it"
    if motor.governed:
        yield f"{motor.title}, full load {point}: {shares};"
        yield f"{greatest}, {_share(abs(torque), rated.torque)} of the full-load one there."
        return
    breakdown = ""
    if motor.breakdown_torque is not None:  # the same while it generates
        breakdown = f", {_share(abs(torque), motor.breakdown_torque)} of the breakdown torque"
    yield f"{motor.title}, rated power {point}: {shares};"
    yield f"{greatest}, {_share(abs(torque), rated.torque)} of the rated one{breakdown};"
    yield f"{rms}, {_share(energy.rms_torque, rated.torque)} of the rated one."


class Heat(NamedTuple):
    """Mean heat of a motor over time (W): the heat, that at its rated point, that at a constant speed.

    `share` is the heat over that at the rated point, `error` its relative error; None if no rated point is known.
    """

    heat: float
    share: float | None
    error: float
    rated: float | None
    even: float | None

    @property
    def too_hot(self) -> bool:
        """True if it exceeds the motor's rated heat by more than its error."""
        return self.share is not None and self.share > 1.0 + max(self.share * self.error, TIE)


def heat_of(sizing: Sizing, motor: Motor, energy: Energy) -> Heat | None:
    """The heat of a rotor (induction) or an armature (DC); None if the motor's type does not give it."""
    even = _ratio(sizing) * (sizing.constant_speed or sizing.speed)
    heat = None if motor.heated is None else getattr(energy, motor.heated)
    if heat is None:
        return None
    if motor.rated is None:
        return Heat(heat, None, energy.errors[str(motor.heated)], None, None)
    share = f"{motor.heated}_share"
    rated, at_even = motor.rated_heat, float(motor.heat(even))
    return Heat(heat, getattr(energy, share), energy.errors[share], rated, at_even)


def _heat(sizing: Sizing, motor: Motor, energy: Energy) -> Iterator[str]:
    """Heat of the motor if its type gives it; otherwise a note that it is not known."""
    load = heat_of(sizing, motor, energy)
    if energy.rotor_heat is not None and load is not None:
        heat = f"Mean heat of its rotor over time, torque times slip speed: {_number(load.heat)} W"
        yield f"{heat}, {_verdict(energy, load)}"
        if energy.stator_heat_share is not None:
            yield from _stator(motor, energy, energy.stator_heat_share)
    elif sizing.servo is not None and load is not None:
        yield from _servo(sizing.servo)
        yield f"Mean losses of the motor over time: {_number(load.heat)} W, {_verdict(energy, load)}"
    elif load is not None:
        rms, peak, limit = energy.current_rms or 0.0, energy.current_peak or 0.0, motor.rated_current
        beside = ["" if limit is None else f", {_share(abs(current), limit)} of the rated one" for current in (rms, peak)]
        means = f"root of its mean square over time {_number(rms)} A{beside[0]}"
        yield f"Current of its armature: {means}; greatest {_signed(peak)} A{beside[1]}."
        heat = f"Mean copper heat of its armature over time, R i²: {_number(load.heat)} W"
        if load.share is None:
            yield f"{heat}; its limit is unknown without a rated point."
        else:
            yield f"{heat}, {_verdict(energy, load)}"
    elif sizing.synchronism is not None:
        yield from _in_step(sizing.synchronism)
    elif not motor.governed:
        yield "Torque against speed alone does not give its losses: give the motor as induction or dc for that."
        if motor.rated is not None and energy.mean_power > motor.rated.power * (1 + TIE):
            yield "The mean power is more than the rated one."


def _stator(motor: Motor, energy: Energy, share: float) -> Iterator[str]:
    """Line current and heat of an induction motor's stator, by its name plate."""
    suffix = "" if energy.stator_heat is None else f": {_number(energy.stator_heat)} W"
    of_rated = f"{figure(100 * share, 0.0, 5)} % of that at the rated point"
    yield f"Mean copper heat of its stator over time{suffix}, {of_rated}{', too hot' if share > 1 + TIE else ''}."
    if energy.current_rms is not None and energy.current_peak is not None and motor.rated_current is not None:
        rms, peak, rated = energy.current_rms, energy.current_peak, motor.rated_current
        means = f"root of its mean square over time {_number(rms)} A, {_share(rms, rated)} of the rated one"
        yield f"Line current: {means}; greatest {_number(peak)} A, {_share(peak, rated)} of it."


def _servo(load: ServoLoad) -> Iterator[str]:
    """The rms point and the peak point of a servo drive beside its curves, and its ratio of inertias."""
    share = f"{figure(100 * load.continuous_share, 0.0, 4)} % of the {_number(load.continuous_torque)} N m"
    at = _rpm(load.mean_speed)
    yield f"Its rms torque of {_number(load.rms_torque)} N m is {share} of its continuous curve at the mean speed of {at};"
    share, at = f"{figure(100 * load.peak_share, 0.0, 4)} %", _rpm(load.peak_speed)
    yield f"nearest to its peak curve are {_number(abs(load.peak_torque))} N m at {at}, {share} of it."
    if load.inertia_ratio is not None:
        yield f"Inertia of what its rotor moves over that of the rotor: {figure(load.inertia_ratio, 0.0, 4)}."


def _in_step(synchronism: Synchronism) -> Iterator[str]:
    """Load angle and swing of a synchronous motor."""
    mean, greatest, least, limit = (
        figure(math.degrees(value), 0.0, 5)
        for value in (
            synchronism.load_angle,
            synchronism.load_angle_greatest,
            synchronism.load_angle_least,
            synchronism.pull_out_angle,
        )
    )
    share = figure(100 * synchronism.pull_out_share, 0.0, 4)
    yield f"It keeps step: load angle {mean} deg (mean over time), {least} to {greatest} deg, pull-out at {limit} deg;"
    yield f"the greatest torque of that angle is {share} % of the pull-out torque."
    swing = f"Natural frequency of its swing {figure(synchronism.natural_frequency, 0.0, 5)} Hz, damping ratio "
    yield f"{swing}{figure(synchronism.damping_ratio, 0.0, 3)}; the load's harmonics"
    rows = (
        f"{one.order}: {figure(one.frequency, 0.0, 4)} Hz, {_number(one.moment)} N m, times {short(one.magnification)}"
        for one in synchronism.counting
    )
    yield f"{'; '.join(rows)}."


def _verdict(energy: Energy, heat: Heat) -> str:
    """Verdict on a heat relative to that at the rated point."""
    assert heat.share is not None
    assert heat.rated is not None
    assert heat.even is not None
    beside = f"{figure(100 * heat.share, 0.0, 5)} % of the {_number(heat.rated)} W at the rated point"
    if heat.too_hot:
        steadily = f"at a constant speed it would be {_share(heat.even, heat.rated)}"
        larger = f": even {steadily}" if heat.even > heat.rated else f", or more flywheel: {steadily}"
        return f"{beside}, too hot for continuous running. Choose a larger motor{larger}."
    long = f"; but in a cycle of {_number(energy.period)} s its temperature rises above the mean for a while"
    return f"{beside}, within its rating{long if is_long(energy) else ''}."


def is_long(energy: Energy) -> bool:
    """Tests whether windings warm up and cool down within a cycle."""
    return energy.period > _LONG


def warnings(sizing: Sizing, motor: Motor, units: TradeUnits | None = None) -> Iterator[str]:
    """Warnings if the motor comes near the end of its running branch, passes it, or runs outside its data."""
    run, ratio = sizing.run, _ratio(sizing)
    slow, fast = (sizing.speed, sizing.speed) if run is None else (run.speed_min, run.speed_max)
    least, greatest, breakdown = ratio * slow, ratio * fast, motor.breakdown
    falls = _("Its speed falls to {speed}", speed=_rpm(least))
    if motor.governed and motor.rated is not None:
        if least < motor.rated.speed * (1 - TIE):
            governed = _("below {speed}, the greatest speed at full load", speed=_rpm(motor.rated.speed))
            yield _(
                "{falls}, {governed}: the flywheel gives the rest of the load.",
                falls=falls,
                governed=governed,
            )
    elif sizing.synchronism is not None:
        yield from _resonance(sizing.synchronism)
    elif (fluxes := sizing.electrical_transients) is not None:
        yield _fluxes(fluxes)
    elif breakdown is not None:
        kloss = motor.breakdown_torque is not None
        name = _("the breakdown torque") if kloss else _("the greatest torque of its running branch")
        there = _("{torque} at {speed}", torque=_torque(breakdown.torque, units), speed=_rpm(breakdown.speed))
        torque = float(motor.torque(least))
        flat = float(motor.torque(0.5 * breakdown.speed)) >= breakdown.torque * (1 - TIE)  # as with a relief valve
        if flat and least < breakdown.speed * (1 - TIE):
            governed = _("below {speed}, the greatest speed with its greatest torque", speed=_rpm(breakdown.speed))
            yield _(
                "{falls}, {governed}: the flywheel gives the rest of the load.",
                falls=falls,
                governed=governed,
            )
        elif least < breakdown.speed * (1 - TIE):
            past = {"falls": falls, "name": name, "there": there}
            yield _("{falls}, past {name}, {there}: at lower speed it gives less, and stalls if the load continues.", **past)
            if kloss:
                yield _("Kloss's formula, and the heat by it, is inaccurate there.")
        elif torque > _NEAR * breakdown.torque and not flat:
            near = {"share": _share(torque, breakdown.torque), "name": name, "there": there}
            yield _("At its least speed it gives {share} of {name}, {there}: at lower speed it gives less.", **near)
    low, high = motor.covers
    if least < low * (1 - TIE) or greatest > high * (1 + TIE):
        span = {"least": _revolutions(least), "greatest": _rpm(greatest), "low": _revolutions(low)}
        if math.isfinite(high):
            text = _("but its data cover {low} to {high}", low=span["low"], high=_rpm(high))
        else:
            text = _("but its data begin at {low}", low=_rpm(low))
        runs = _("It runs from {least} to {greatest}", least=span["least"], greatest=span["greatest"])
        yield _("{runs}, {known}: its torque beyond is an extrapolation.", runs=runs, known=text)


def _fluxes(transients: ElectricalTransients) -> str:
    """Effect of the fluxes of a two-axis motor compared with its static curve."""
    shares = {name: f"{100 * one.difference:+.2g} %" for name, one in transients._asdict().items()}
    if transients.matters:
        return _(
            "Its fluxes matter: compared with the static curve irregularity {irregularity}, greatest torque "
            "{greatest_torque}, heat of the rotor {rotor_heat}.",
            **shares,
        )
    return _(
        "Its fluxes are of little effect here: compared with the static curve irregularity {irregularity}, greatest torque "
        "{greatest_torque}, heat of the rotor {rotor_heat}.",
        **shares,
    )


DAMPED = 0.5
"""Damping ratio above which no harmonic is magnified: 1/(2 zeta) at resonance is 1 or less."""


def _resonance(synchronism: Synchronism) -> Iterator[str]:
    """Warnings of a synchronous motor near pull-out, and of a swing near a harmonic of its load."""
    if synchronism.pull_out_share > _NEAR:
        yield _(
            "The torque of its load angle reaches {share} of the pull-out torque.",
            share=_share(synchronism.pull_out_share, 1.0),
        )
    if not synchronism.damping_ratio < DAMPED:
        return
    natural, near = f"{number(figure(synchronism.natural_frequency, 0.0, 4))} Hz", synchronism.near_resonance
    if near is not None:
        values = {"natural": natural, "k": near.order, "harmonic": f"{number(figure(near.frequency, 0.0, 4))} Hz"}
        times = number(figure(near.magnification, 0.0, 3))
        yield _(
            "Its swing, of natural frequency {natural}, is near harmonic {k} of the load, {harmonic}: {times} times larger.",
            **values,
            times=times,
        )
    above = synchronism.heavier_is_nearer
    if above is not None:
        values = {"natural": natural, "k": above.order, "harmonic": f"{number(figure(above.frequency, 0.0, 4))} Hz"}
        yield _(
            "Its swing, of natural frequency {natural}, lies above harmonic {k} of the load, {harmonic}: "
            "a heavier flywheel brings it nearer to resonance.",
            **values,
        )


# -- a duty ----------------------------------------------------------------------------------------------------------


def duty(sizing: Sizing) -> list[str]:
    """A duty phase by phase, and its motor's load over all of it."""
    load = sizing.duty
    if load is None:
        return []
    table = []
    for row in load.phases:
        if row.rest:
            table.append((row.name, figure(row.duration, 0.0, 5), *("",) * 5))
            continue
        heat, share = row.heat, row.heat_share
        table.append(
            (
                row.name,
                figure(row.duration, row.errors.get("duration", 0.0), 5),
                figure((row.speed or 0.0) * RPM, 0.0, 5),
                "" if row.irregularity is None else figure(row.irregularity, 0.0, 4),
                "" if row.mean_power is None else figure(row.mean_power, row.errors["mean_power"], 5),
                "" if row.rms_torque is None else figure(row.rms_torque, row.errors["rms_torque"], 5),
                "" if heat is None else figure(heat if share is None else 100 * share, 0.0, 4),
            )
        )
    hot = "heat, W" if load.heat_share is None else "heat, %"
    header = ("", "s", "rpm", "irregularity", "power, W", "rms, N m", hot)
    kept = [k for k in range(len(header)) if k == 0 or any(row[k] for row in table)]
    kind = "" if load.type is None else f", {load.type}"
    percent = figure(100 * load.cyclic_duration_factor, 0.0, 4)
    title = f"Duty of {figure(load.period, 0.0, 5)} s{kind}, loaded for {percent} % of it; the hardest: {load.governing}"
    lines = [title, *columns([[row[k] for k in kept] for row in table], [header[k] for k in kept])]
    lines += block("Over the duty", _over(load))[1:]
    rise = sizing.temperature
    if rise is not None:
        ends = ", ".join(f"{figure(end, 0.0, 4)} K after {name}" for name, end in rise.phases)
        most, after = figure(rise.greatest, 0.0, 5), figure(rise.time, 0.0, 4)
        line = f"Windings: greatest rise {most} K after {after} s, limit {rise.limit:g} K; {ends}."
        lines += sentences([line, *(f"At most {count} starts an hour into {name}." for name, count in rise.starts.items())])
    return lines


def _over(load: Duty) -> Iterator[Row]:
    """The motor's load over a duty."""

    def beside(share: float | None) -> str:
        return "" if share is None else f", {figure(100 * share, 0.0, 4)} % of that at the rated point"

    if load.mean_power is not None:
        yield Row("mean power over the duty", figure(load.mean_power, 0.0, 6), "W")
    if load.rms_torque is not None:
        yield Row("rms torque over the duty", figure(load.rms_torque, 0.0, 6), f"N m{beside(load.rms_torque_share)}")
    if load.current_rms is not None:
        yield Row("rms current over the duty", figure(load.current_rms, 0.0, 6), "A")
    if load.heat is not None:
        yield Row("mean heat over the duty", figure(load.heat, 0.0, 6), f"W{beside(load.heat_share)}")
    for row in load.phases:
        if row.change_time is not None:
            heat = "" if row.change_heat is None else f", heat {figure(row.change_heat, 0.0, 4)} J"
            yield Row(f"the change into {row.name}", figure(row.change_time, 0.0, 4), f"s{heat}")
        if row.start_time is not None:
            heat = "" if row.start_heat is None else f", heat {figure(row.start_heat, 0.0, 4)} J"
            yield Row(f"a start into {row.name}", figure(row.start_time, 0.0, 4), f"s{heat}")


def _revolutions(speed: float) -> str:
    return number(_number(speed * RPM))


def _rpm(speed: float) -> str:
    return f"{_revolutions(speed)} rpm"


def _torque(torque: float, units: TradeUnits | None) -> str:
    """A torque to five digits in customary units, or to all digits of this table in N m."""
    return f"{number(_number(torque))} N m" if units is None else str(units.written(torque, "torque"))


# -- where the power goes ----------------------------------------------------------------------------------------------


_MOST_LOSSES, _LONGEST = 3, 90  # losses in a sentence, and their letters
_TINY = 5e-5  # of the input: a loss that no sentence names


class Entry(NamedTuple):
    """A stream with its name and its power (W): the mean, or that at an angle."""

    stream: Stream
    label: str
    power: float


def entries(flow: PowerFlow, at: float | None = None) -> tuple[Entry, ...]:
    """Every stream with its name in the language in use, and its mean power (W) or that at a crank angle (rad)."""
    all_entries = []
    for stream, power in zip(flow.streams, [s.mean for s in flow.streams] if at is None else flow.at(at), strict=True):
        tiny = flow.error * max(abs(stream.greatest), abs(stream.least), flow.scale)
        all_entries.append(Entry(stream, stream_name(stream, flow), power if abs(power) > tiny else 0.0))
    return tuple(all_entries)


def places(flow: PowerFlow) -> dict[str, str]:
    """The names of the shafts, the drive and the mains of a power flow, by their places.

    >>> import flywheel
    >>> scene = {"load": [{"on": "crank", "torque": "-9 N m", "from": 0, "to": 3}], "drive": {"torque": "balance"},
    ...          "regime": {"speed": 10}, "flywheel": {"irregularity": 0.02}}
    >>> flow = flywheel.power_flow(flywheel.size(flywheel.load(scene), simulate=False))
    >>> places(flow), [stream_name(stream, flow) for stream in flow.streams]
    ({'mains': 'mains', 'drive': 'drive', 'shafts.crank': 'crank'}, ['drive', 'load on crank', 'flywheel'])
    """
    drive = _("drive") if flow.scene.motor is None else _("motor")
    by_kind = any(stream.kind in ("stator", "copper") for stream in flow.streams)
    mains = _("mains") if by_kind or flow.scene.motor is None else _("air gap of the motor")
    return {"mains": mains, "drive": drive} | {f"shafts.{name}": shaft_name(name) for name in flow.scene.shafts}


def shaft_name(name: str) -> str:
    """A shaft's name in the language in use."""
    return place(name) if name == "crank" else _("shaft {name}", name=name)


def stream_name(stream: Stream, flow: PowerFlow) -> str:
    """Name of a stream of power: "belt motor–wheel", "load on slider (2)" if there are more of them."""
    name = _name(stream, flow)
    alike = [other for other in flow.streams if _name(other, flow) == name]
    return name if len(alike) == 1 else f"{name} ({alike.index(stream) + 1})"


def _name(stream: Stream, flow: PowerFlow) -> str:
    """The same name without a number."""
    scene, on = flow.scene, place(stream.on)
    if len(scene.mechanisms) == 1 and stream.on not in scene.shafts:
        on = stream.on.removeprefix(f"{scene.mechanisms[0].name}.")
    if stream.kind in ("input", "drive"):
        return places(flow)["mains" if stream.kind == "input" else "drive"]
    if stream.kind in ("mesh", "slip", "shaft"):
        row = next(row for row in flow.shafts if row.shaft == stream.on)
        pair = "–".join(map(place, (row.shaft, row.on or "crank")))
        belt = any(other.kind == "slip" and other.on == stream.on for other in flow.streams)
        words = {"slip": _("slip of belt {shafts}"), "shaft": _("through {shafts}")}
        return words.get(stream.kind, _("belt {shafts}") if belt else _("mesh {shafts}")).format(shafts=pair)
    if stream.kind == "load":
        model = next((model_of(load.model) for load in scene.loads if load.path == stream.name), None)
        return _("{what} on {place}", what=_("load") if model is None else message(model.words), place=on)
    if stream.kind == "stored":
        stores = {
            "flywheel": _("flywheel"),
            "gravity": _("weights on {place}", place=on),
            "inductance": _("inductance of the motor"),
            "field": _("field of the motor"),
            "inertia": _("inertia on {shaft}", shaft=on),
            "masses": _("masses on {shaft}", shaft=on),
        }
        return stores.get(stream.name.rsplit(".", 1)[-1], _("spring on {place}", place=on))
    words = {
        "copper": _("windings of the motor"),
        "stator": _("stator of the motor"),
        "rotor": _("rotor of the motor"),
        "iron": _("iron and friction of the motor"),
        "windage": _("friction and fan of the motor"),
        "drag": _("drag on {place}", place=on),
        "damper": _("damper on {place}", place=on),
        "friction": _("friction in joints"),
        "resistance": _("losses on {place}", place=on),
    }
    return words.get(stream.kind, stream.kind)


def input_power(flow: PowerFlow, entries_in: Sequence[Entry]) -> float:
    """Power from outside and from stores (W): the whole to which shares refer."""
    return sum(abs(entry.power) for entry in entries_in if gives(flow, entry))


def gives(flow: PowerFlow, entry: Entry) -> bool:
    """Tests whether a stream gives power at that time: from outside, or out of a store."""
    kind, power = entry.stream.kind, entry.power
    if kind == "stored":
        return power < 0.0
    if kind == "drive" and any(stream.kind == "input" for stream in flow.streams):
        return False
    outside = entry.stream.source in ("mains", "drive") or (kind == "load" and entry.stream.source == entry.stream.name)
    return kind in ("input", "drive", "load") and (power > 0.0 if outside else power < 0.0)


# -- the table -----------------------------------------------------------------------------------------------------------


def text(flow: PowerFlow, at: float | None = None) -> str:
    """Text that `flywheel power` prints: the balance, every stream, every shaft."""
    title = [flow.scene.title] if flow.scene.title else []
    return paragraphs((sentences(title, ""), balance(flow, at), shafts(flow)))


def json(flow: PowerFlow, at: float | None = None) -> str:
    """JSON that `flywheel power --json` prints, SI throughout."""
    return encoded({"title": flow.scene.title, **flow.as_dict(at), "error": flow.error}, indent=2)


def balance(flow: PowerFlow, at: float | None = None) -> list[str]:
    """The balance of mean powers, stream by stream: input, losses, output; then stored power."""
    now = None if at is None else {entry.stream.name + entry.stream.kind: entry.power for entry in entries(flow, at)}
    mean = entries(flow)
    whole = input_power(flow, mean)
    header = [_("power, W"), _("mean"), _("share, %"), _("least"), _("greatest")]
    if at is not None:
        header.append(_("at {angle}°", angle=number(figure(at * DEGREES, most=_DIGITS))))

    def row(entry: Entry, name: str) -> tuple[str, ...]:
        stream = entry.stream
        cells = [_watts(flow, stream.mean), _share_of_input(stream.mean, whole)]
        cells += [_watts(flow, stream.least), _watts(flow, stream.greatest)]
        return (name, *cells, *([] if now is None else [_watts(flow, now[stream.name + stream.kind])]))

    electric = any(stream.kind == "input" for stream in flow.streams)
    ends: dict[str, list[Entry]] = {"input": [], "lost": [], "output": []}
    for entry in mean:
        if entry.stream.lost:
            ends["lost"].append(entry)
        elif entry.stream.kind in ("input", "load") or (entry.stream.kind == "drive" and not electric):
            ends["input" if gives(flow, entry) else "output"].append(entry)
    rows: list[tuple[str, ...]] = []
    sums = {"input": flow.input, "lost": flow.losses, "output": flow.output}
    titles = {"input": _("comes in"), "lost": _("is lost"), "output": _("arrives")}
    blank = ("",) * (len(header) - 3)
    for key, parts in ends.items():
        if parts:
            rows.append((titles[key], _watts(flow, sums[key]), _share_of_input(sums[key], whole), *blank))
            rows += [row(entry, f"  {entry.label}") for entry in parts]
    rows.append((_("lost and arrived"), _watts(flow, flow.losses + flow.output),
                 _share_of_input(flow.losses + flow.output, whole), *blank))  # fmt: skip
    stored = [entry for entry in mean if entry.stream.kind == "stored"]
    if stored:
        rows.append((_("stored and given back"), *("",) * (len(header) - 1)))
        rows += [row(entry, f"  {entry.label}") for entry in stored]
    period = number(figure(flow.period, flow.error * flow.period, _DIGITS))
    return [_("Power flow over a cycle of {period} s", period=period), *columns(rows, header)]


def shafts(flow: PowerFlow) -> list[str]:
    """Every shaft: its speed, and torque and power of its mesh on its own side."""
    header = [_("shaft"), "rpm", _("power to"), _("mean, W"), _("greatest, W"), _("rms, W")]
    header += [_("mean, N m"), _("greatest, N m"), _("rms, N m")]
    rows = []
    for one in flow.shafts:
        powers = one.power_mean, one.power_greatest, one.power_rms
        torques = one.torque_mean, one.torque_greatest, one.torque_rms
        figures = ["" if value is None else _watts(flow, value) for value in (*powers, *torques)]
        to = "" if one.to is None else place(one.to)
        rows.append((place(one.shaft), number(figure(one.speed * RPM, 0.0, _DIGITS)), to, *figures))
    if len(rows) < 2:
        return []
    title = _("Shafts: mean speed, and power and torque through the mesh, on its own side")
    return [title, *columns(rows, header)]


def _watts(flow: PowerFlow, value: float) -> str:
    return number(figure(value, flow.error * max(abs(value), 1e-9 * flow.scale), _DIGITS))


def _share_of_input(value: float, whole: float) -> str:
    return number(figure(100 * value / whole, 0.0, 4)) if whole > 0.0 else ""


# -- the sentence ----------------------------------------------------------------------------------------------------


def sentence(flow: PowerFlow, units: TradeUnits = SI, *, losses: bool = True) -> str | None:
    """The share that arrives, and the main losses: "92.4 % of 7.31 kW reaches the loads; lost: belt motor–wheel 290 W."."""
    if not flow.losses > _TINY * flow.input:
        return None
    lost = sorted((entry for entry in entries(flow) if entry.stream.lost), key=lambda entry: -entry.power)
    lost = [entry for entry in lost if entry.power > _TINY * flow.input]
    parts = [f"{entry.label} {units.read(entry.power, 'power', 3)}" for entry in lost]
    kept = len(parts)
    while kept > 1 and (kept > _MOST_LOSSES or len(", ".join(parts[:kept])) > _LONGEST):
        kept -= 1
    if kept < len(parts):
        rest = units.read(sum(entry.power for entry in lost[kept:]), "power", 3)
        parts[kept:] = [_("{n} more {power}", n=len(parts) - kept, power=rest)]
    whole = units.read(flow.input, "power", 3)
    if flow.output <= _TINY * flow.input:
        return _("All of {power} is lost: {losses}.", power=whole, losses=", ".join(parts))
    values = {"share": few_digits(100 * flow.output / flow.input, 3), "power": whole, "losses": ", ".join(parts)}
    if not losses:
        return _("{share} % of {power} reaches the loads.", **values)
    return _("{share} % of {power} reaches the loads; lost: {losses}.", **values)
