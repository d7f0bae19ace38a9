"""Results of a machine that works stroke by stroke, as blocks of rows: the summary, the live page, and every figure."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

from flywheel.language import message, number
from flywheel.language import text as _
from flywheel.motions.single_stroke import (
    BY_KEY,
    FINDINGS,
    SingleStroke,
    brake_for_stop,
    load_limits,
    rate_limit,
    share_name,
    verdicts_of_parts,
)
from flywheel.motions.stroke_course import servo_load
from flywheel.numerics.units import columns, figure
from flywheel.scene.scene import TURN
from flywheel.sizing.drive import trip_messages
from flywheel.sizing.findings import KINDS, Finding
from flywheel.tables.rows import SYSTEMS, Row, TradeUnits, Written, few_digits, five_digits, paragraphs, printable
from flywheel.tables.scene import scene_rows
from flywheel.tables.sizing import limit_names
from flywheel.tables.summary import Block, lines_of, machine_block, servo_rows

_OF_STROKE = (
    *("period", "rate", "stroke_time", "speed_greatest", "speed_least", "irregularity", "wheel_energy"),
    "recovery_time",
)
_OF_CLUTCH = (
    *("slip_time", "lock_angle", "second_slip_time", "second_slip_angle", "second_slip_heat"),
    *("clutch_torque", "clutch_heat", "clutch_heat_per_hour", "brake_angle", "stopping_time"),
    *("overrun", "holding_torque", "brake_heat", "brake_heat_per_hour"),
    *("emergency_time", "emergency_angle", "safety_distance", "inch_angle"),
)
_OF_DRIVE = (
    *("mean_power", "motor_torque_rms", "motor_torque_peak", "motor_heat", "temperature"),
    *("inverter_current", "power_returned", "greatest_rate"),
)
_PERCENT = 100.0


def written(one: Finding, value: float, error: float, system: TradeUnits) -> Written:
    """A figure to five digits in the customary units: angles in degrees, rates a minute."""
    kind = {**KINDS, "rad": "angle", "m": "length"}.get(one.unit)
    if kind is not None:
        return system.written(value, kind, error)
    factor, unit = (60.0, "1/min") if one.unit == "1/s" else (1.0, one.unit)
    return Written(five_digits(factor * value, factor * error), unit)


def blocks(result: SingleStroke, units: str = "si") -> tuple[Block, ...]:
    """The summary, in the language in use."""
    system = SYSTEMS[units]

    def rows(keys: Iterable[str]) -> Iterator[Row]:
        for key in keys:
            value = result.figures[key]
            if isinstance(value, float) and (result.phases.slips or not key.startswith("second_slip")):
                yield Row(BY_KEY[key].name, *written(BY_KEY[key], value, result.error.get(key, 0.0), system))

    trips = [message(each) for each in trip_messages(result.trips)]
    point = servo_load(result.strokes, result.phases)
    servo = () if point is None else servo_rows(point, system)
    remarks = tuple(_off_stop(result, system))
    if result.phases.slips:
        angle = system.read(float(result.phases.slips[0].driven.start.phi) % TURN, "angle")
        again = _("THE CLUTCH SLIPS AGAIN under the work from {angle} on: it needs a greater torque.", angle=angle)
        remarks = again, *remarks
    title = printable(result.scene.title or "").strip() or _("Machine that works stroke by stroke")
    return (
        Block("title", title),
        machine_block(result.scene, system),
        _parts(result, system),
        _flywheel(result, system),
        Block("stroke", _("Stroke"), tuple(rows(_OF_STROKE))),
        Block("clutch", _("Clutch and brake"), tuple(rows(_OF_CLUTCH)), sentences=remarks),
        Block("drive", _("Drive"), (*rows(_OF_DRIVE), *servo), sentences=(*trips, *rate_limit(result))),
        _shares(result, system),
        _formulas(result, system),
    )


def _off_stop(result: SingleStroke, system: TradeUnits) -> Iterator[str]:
    if (mended := brake_for_stop(result)) is None:
        return
    off = system.read(math.radians(round(math.degrees(abs(result.overrun)), 1)), "angle")
    yield (
        _("THE CRANK STOPS {angle} PAST stop_at.", angle=off)
        if result.overrun > 0.0
        else _("The crank stops {angle} before stop_at.", angle=off)
    )
    torque = system.read(float(f"{mended[1]:.3g}"), "torque")
    if mended[0] is None:
        yield _("It would stop there with a brake of about {torque}.", torque=torque)
    else:
        angle = system.read(math.radians(round(math.degrees(mended[0]))), "angle")
        yield _(
            "It would stop there with its brake put on at about {angle}, or with one of about {torque}.",
            angle=angle,
            torque=torque,
        )


def _parts(result: SingleStroke, system: TradeUnits) -> Block:
    """Answers for each part whether it suffices, with its load that is nearest to its limit, or its heat without one."""
    names = {"flywheel": _("flywheel"), "clutch": _("clutch"), "brake": _("brake"), "motor": _("motor")}
    fall = number(f"{_PERCENT * (1.0 - result.speed_least / result.speed_greatest):.3g}")
    words, rows = {True: _("suffices"), False: _("DOES NOT SUFFICE")}, list[Row]()
    for one in verdicts_of_parts(result):
        notes = [_("its speed falls by {fall} %", fall=fall)] if one.part == "flywheel" else []
        if one.unknown is not None:
            heat = written(BY_KEY[one.unknown], float(result.figures[one.unknown] or 0.0), 0.0, system)
            notes.append(_("{heat} an hour, no limit given", heat=heat))
        if one.load is not None:
            share = number(f"{_PERCENT * (one.share or 0.0):.3g}")
            notes.append(_("{load} at {share} %", load=share_name(one.load), share=share))
        unclear = _("check heat") if one.unknown else _("not rated")
        rows.append(Row(names[one.part], unclear if one.suffices is None else words[one.suffices], "", "; ".join(notes)))
    rate = number(figure(60.0 * result.rate, 60.0 * result.error["rate"], 4))
    return Block("parts", _("Do the parts suffice for {rate} strokes a minute?", rate=rate), tuple(rows))


def _flywheel(result: SingleStroke, system: TradeUnits) -> Block:
    inertia = system.written(result.inertia, "inertia", result.error.get("inertia", 0.0))
    origin = _("as given") if result.is_analysis else _("sized")
    names, rows = limit_names(), [Row(_("inertia"), *inertia, origin)]
    for name, limit in result.limits.items():
        reached = number(figure(_PERCENT * limit.reached, _PERCENT * limit.reached_error * limit.reached, 5))
        lone = system.written(limit.alone, "inertia", limit.alone_error * limit.alone)
        limit_value = number(figure(_PERCENT * limit.requirement, most=5))
        alone = _("of {asked} %; alone it needs {inertia}", asked=limit_value, inertia=lone)
        rows.append(Row(names[name], reached, "%", alone))
    decides = (_("{limit} decides.", limit=names[result.binding]),) if result.binding else ()
    return Block("flywheel", _("Flywheel on {shaft}", shaft=result.on), tuple(rows), sentences=decides)


def _shares(result: SingleStroke, system: TradeUnits) -> Block:
    """Loads and limits, each with its figure and its limit."""
    rows, limits = [], load_limits(result.strokes, result.phases, result.figures)
    for name, share in result.shares.items():
        key, most = limits[name]
        reached, limit = (
            written(BY_KEY[key], each, 1e-4 * each, system) for each in (float(result.figures[key] or 0.0), most)
        )
        words = {"value": str(reached).rstrip(), "limit": str(limit).rstrip()}  # a current over another has no unit
        note, error = _("{value} of {limit}", **words), result.error["shares"][name]
        rows.append(Row(share_name(name), few_digits(_PERCENT * share, 4, _PERCENT * error), "%", note))
    return Block("shares", _("Loads and limits"), tuple(rows))


def _formulas(result: SingleStroke, system: TradeUnits) -> Block:
    """The formulas of presses compared with the motion."""
    table = []
    for key, value in result.formulas.items():
        one, exact = BY_KEY[key], float(result.figures[key] or 0.0)
        off = f"{100.0 * (value / exact - 1.0):+.3g} %" if exact else ""
        cells = written(one, value, 0.0, system), written(one, exact, result.error.get(key, 0.0), system)
        table.append((one.name, *map(str, cells), number(off)))
    header = ("", _("by formula"), _("in the motion"), _("difference"))
    sentence = _("The formulas contain only the work of the loads: no heat of clutch and brake, no drive within the stroke.")
    title = _("Formulas of presses compared with the motion")
    return Block("formulas", title, header=header, table=tuple(table), sentences=(sentence,))


def text(result: SingleStroke, units: str = "si") -> str:
    """The summary in 80 columns."""
    return "\n".join(lines_of(blocks(result, units), 40)) + "\n"


def full(result: SingleStroke) -> str:
    """Every figure with the digits that its error leaves, in SI and in English."""
    rows = [("flywheel", figure(result.inertia, result.error.get("inertia", 0.0)), f"kg m² on {result.on}")]
    for one in FINDINGS:
        value = result.figures[one.key]
        if isinstance(value, float):
            rows.append((one.key, figure(value, result.error.get(one.key, 0.0)), one.unit))
    rows += [(key, str(result.figures[key]), "") for key in ("keeps_up", "decides")]
    energies = [(key, figure(value, result.error["energy"][key]), "J") for key, value in result.energy.items()]
    shares = [(key, figure(value, result.error["shares"][key]), "") for key, value in result.shares.items()]
    formulas = [(key, figure(value), BY_KEY[key].unit) for key, value in result.formulas.items()]
    lists = {"Figures": rows, "Energy of a period": energies, "Loads and limits": shares, "By formulas": formulas}
    return paragraphs(
        [[result.scene.title or ""], scene_rows(result.scene), *([title, *columns(each)] for title, each in lists.items())]
    )
