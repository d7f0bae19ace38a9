"""The drive's motor, `[drive] motor = {type = ..., ...}`: keys, checks, and the motor that they describe.

`MOTORS` has a line for each type. Its reader is called if no single key is at fault. `start` within it is how the
motor is started; `TABLES` are such tables within a motor's own. Last the phases of a duty, `[[duty]]`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields as dataclass_fields
from dataclasses import replace
from pathlib import Path
from typing import Any

from flywheel.components.load_models import is_loss
from flywheel.components.motors import (
    DC,
    Constant,
    Curve,
    Engine,
    Hydraulic,
    Induction,
    Inverter,
    InverterInduction,
    Line,
    Motor,
    Plate,
    Point,
    Servo,
    Start,
    Switch,
    Synchronous,
    Thermal,
    dc_from_plate,
    field_steps,
    line_from_no_load,
    line_through,
    resistance_steps,
    soft_start,
    star_delta,
    thermal,
    transformer,
)
from flywheel.components.motors.motor import BRAKING, OVERCURRENT
from flywheel.components.motors.starting import check_start
from flywheel.components.motors.synchronous import damper_slope, saliency_of
from flywheel.components.motors.thermal import CLASSES
from flywheel.components.motors.two_axis import Impedances, TwoAxisInduction, impedances_of
from flywheel.numerics.faults import Fault, SceneError, quote, show
from flywheel.numerics.jets import is_recorded
from flywheel.numerics.units import LARGEST, QuantityError, convert, parse_quantity, parse_range
from flywheel.reading.fields import (
    Faults,
    Fields,
    Item,
    Setting,
    as_table,
    exactly_one,
    items,
    read_item,
    read_typed,
    read_unit,
)
from flywheel.reading.schema import SECTIONS, Section
from flywheel.reading.tables import columns_of
from flywheel.scene.scene import ELECTRIC_BRAKING, NOT_NEGATIVE, POSITIVE, Key, Phase, Range, Scene


class Even(Range):
    """Even whole numbers."""

    def __contains__(self, value: object) -> bool:
        return super().__contains__(value) and (isinstance(value, (int, float)) or is_recorded(value)) and value % 2 == 0

    def __str__(self) -> str:
        return f"that is an even number, {self.low:g} or more"


def _whole(number: float) -> int:
    """A whole number as an int; a recorded one, which stands for those of many motors, as it is."""
    return number if is_recorded(number) else int(number)  # type: ignore[return-value]


def read_motor(raw: object, path: str, setting: Setting) -> Motor | None:
    """The motor of a table; None after noting faults.

    Faults that the motor itself reports are placed at the paths of their keys.
    """
    item = read_typed(raw, MOTOR_TYPE, MOTORS, path, setting.faults)
    return None if item is None else _motor(item, setting.folder)


def _motor(item: Item, folder: Path | None) -> Motor | None:
    """A motor, with its own faults put where the scene has the values."""
    if not item.clean or item.section.reader is None:
        return None
    motor: Motor | None = None
    with item.faults.placed(item.path):
        motor = item.section.reader(item, folder)
    if motor is not None and "start" in item.raw and "start" in item.fields:
        start = _start(item, motor)
        motor = None if start is None else replace(motor, start=start)
    if motor is not None and "thermal" in item.raw and "thermal" in item.fields:
        data = _thermal(item, motor)
        return None if data is None else replace(motor, thermal=data)
    return motor


def _thermal(item: Item, motor: Motor) -> Thermal | None:
    """Thermal data of the windings, from the table `thermal` in a motor's own; None after noting faults."""
    path = f"{item.path}.thermal"
    table = as_table(item.raw["thermal"], path, item.faults)
    if table is None:
        return None
    thermal_item = read_item(table, THERMAL, path, item.faults)
    if thermal_item.clean and motor.rated is None:
        item.add("thermal", "a motor without a rated point", "its name plate", "a rise is that at the rated point")
    if not thermal_item.clean or not item.clean:
        return None
    fields = thermal_item.fields
    with item.faults.placed(path):
        winding = fields["winding_time_constant"], fields["winding_share"]
        return thermal(fields["time_constant"], fields["rise"], fields["class"], *winding)
    return None


def _start(item: Item, motor: Motor) -> Start | None:
    """Start of a motor, from the table `start` in its own; None after noting faults."""
    path = f"{item.path}.start"
    table = as_table(item.raw["start"], path, item.faults)
    if table is None:
        return None
    start_item = read_item(table, START, path, item.faults)
    kind = start_item.fields["type"]
    if kind is None or not start_item.clean:
        return None
    if motor.circuit is not None and kind not in ("resistance", "field"):  # which tell of an armature's inductance
        expected, advice = "a motor whose torque follows its speed at once", "over a start its own states are left out"
        start_item.add("type", f"a start by {kind} of a motor with states of its own", expected, advice)
        return None
    keys, possible, make = _STARTS[kind]
    others = [name for name in start_item.raw if name not in ("type", *keys, *possible)]
    start_item.without(others, f"of a start by {kind}", f"it takes {', '.join((*keys, *possible))}")
    for name in keys:
        start_item.needs(name, f"a start by {kind} has it")
    untils = _switches(start_item)
    if not start_item.clean:
        return None
    with item.faults.placed(path):
        check_start(motor, kind)
        return make(motor, start_item, untils)
    return None


def _switches(item: Item) -> list[Switch]:
    """The ends of connections, each a time or a speed; faults noted."""
    raw, switches = item.raw.get("until"), list[Switch]()
    several = items(raw)
    for i, one in enumerate([] if raw is None else [raw] if several is None else several):
        path = f"{item.path}.until" + ("" if several is None else f"[{i}]")
        for kind in ("time", "speed"):
            try:
                value = parse_quantity(one, kind) if isinstance(one, str) else None
            except QuantityError:
                continue
            if value is not None and 0.0 < value <= LARGEST:
                switches.append(Switch(**{kind: value}))
                break
        else:
            item.faults.add(path, show(one), 'a time or a speed above 0 with its unit, such as "3 s" or "1400 rpm"')
    return switches


def _alone(untils: list[Switch]) -> Switch:
    """The only switch of a start with one connection."""
    if len(untils) != 1:
        raise SceneError([Fault("until", f"{len(untils)} ends of one connection", "one time or speed")])
    return untils[0]


def _soft(motor: Motor, item: Item, untils: list[Switch]) -> Start:
    fields, until = item.fields, _alone(untils) if untils else None
    limits = fields["torque_limit"], fields["current_limit"]
    return soft_start(motor, until, fields["voltage"] or 1.0, fields["ramp"] or 0.0, *limits)


_STARTS: dict[str, tuple[tuple[str, ...], tuple[str, ...], Callable[[Motor, Item, list[Switch]], Start]]] = {
    "star-delta": (("until",), (), lambda motor, _, untils: star_delta(motor, _alone(untils))),
    "transformer": (
        ("voltage", "until"),
        (),
        lambda motor, item, untils: transformer(motor, item.fields["voltage"], _alone(untils)),
    ),
    "soft": ((), ("voltage", "ramp", "torque_limit", "current_limit", "until"), _soft),
    "resistance": (
        ("added", "until"),
        (),
        lambda motor, item, untils: resistance_steps(motor, item.fields["added"], untils),
    ),
    "field": (("field", "until"), (), lambda motor, item, untils: field_steps(motor, item.fields["field"], untils)),
}
"""The keys that a start of each type must have, those that it may have, and what makes it of them."""


START = Section(
    "start",
    "how a motor is started, before it runs in its own connection",
    (
        Key("type", "choice", "of the start", required=True, choices=tuple(_STARTS)),
        Key("until", "list", "when each connection ends: a time after switching on, a speed of its shaft; several: a list"),
        Key("voltage", "number", "at the beginning, over the motor's own", None, Range(0.0, 1.0, True), example="40 %"),
        Key("ramp", "time", "in which the voltage rises evenly to the motor's own", None, POSITIVE),
        Key("torque_limit", "number", "of a soft start, over the rated torque", None, POSITIVE, example="1.5"),
        Key("current_limit", "number", "of a soft start, over the rated current", None, POSITIVE, example="3"),
        Key("added", "numbers", "resistance in rotor or armature circuit at each step, over the winding's own"),
        Key("field", "numbers", "field of a DC motor at each step, over its own"),
    ),
    begin={"type": "star-delta", "until": "3 s"},
)
INVERTER = Section(
    "inverter",
    "an inverter with a frequency and a proportional voltage",
    (
        Key("frequency", "frequency", "of the steady regime", None, POSITIVE, True),
        Key("field_weakening_from", "frequency", "from which its voltage stays; default: that of the motor", None, POSITIVE),
        Key("torque_limit", "number", "over the motor's rated torque", None, POSITIVE, example="1.5"),
        Key("ramp", "time", "in which its frequency rises evenly from 0", None, POSITIVE),
        Key("braking", "choice", "use of the power that the motor returns", "none", choices=BRAKING),
        Key("chopper_power", "power", "greatest of the braking resistor", None, POSITIVE),
        Key("overcurrent", "number", "current at which it trips, over the motor's rated one", OVERCURRENT, POSITIVE),
    ),
    begin={"frequency": "50 Hz"},
)
_START = Key("start", "table", "how it is started; along a motion in time alone")
_INVERTER = Key("inverter", "table", "inverter that feeds it instead of the mains")
_SHARE_OF_RISE = "of the rise at the rated point that is the windings' over the iron"
THERMAL = Section(
    "thermal",
    "how a motor's windings warm up",
    (
        Key("time_constant", "time", "of the whole motor", None, POSITIVE, True, example="20 min"),
        Key("class", "choice", "of the insulation, by IEC 60085", required=True, choices=tuple(CLASSES)),
        Key("rise", "temperature difference", "at the rated point; default: the limit of the class", None, POSITIVE),
        Key("winding_time_constant", "time", "of the windings over the iron", None, POSITIVE, example="90 s"),
        Key("winding_share", "number", _SHARE_OF_RISE, 0.0, Range(0.0, 1.0, high_open=True), example="0.4"),
    ),
    begin={"time_constant": "20 min", "class": "F"},
)
_THERMAL = Key("thermal", "table", "how its windings warm up")
_INERTIA = Key("inertia", "inertia", "of the rotor, on the shaft that it drives", 0.0, NOT_NEGATIVE)
_POWER = Key("power", "power", "at the shaft, at rated speed", None, POSITIVE)
_RATED = Key("speed", "speed", "at rated load", None, POSITIVE)
_TORQUE = Key("torque", "torque", "at rated speed", None, POSITIVE)
_CONSTANT = (Key("torque", "torque", "at any speed", None, POSITIVE, True),)
_LINE = (
    Key("starting_torque", "torque", "at rest", None, POSITIVE),
    Key("slope", "angular damping", "by which torque falls per speed", None, POSITIVE),
    Key("no_load_speed", "speed", "at which torque has fallen to zero", None, POSITIVE),
    _RATED,
    _TORQUE,
    _POWER,
)
_LINES = (
    ("starting_torque", "slope"),
    ("no_load_speed", "starting_torque"),
    ("no_load_speed", "speed", "torque"),
    ("no_load_speed", "speed", "power"),
)
"""Data from which a straight line follows."""


def _constant(item: Item, _: Path | None) -> Motor:
    return Constant(value=item.fields["torque"], inertia=item.fields["inertia"])


def _line(item: Item, _: Path | None) -> Motor | None:
    """A line by its start and slope, by both of its ends, or by no-load speed and a rated point."""
    fields, inertia = item.fields, item.fields["inertia"]
    present = {key.name for key in _LINE if key.name in item.raw}
    if present not in map(set, _LINES):
        ends = "starting_torque and slope; or no_load_speed and starting_torque"
        expected = f"{ends}; or no_load_speed and speed and torque or power"
        item.faults.add(item.path, " and ".join(sorted(present)) or "no values", expected)
        return None
    if "slope" in present:
        return Line(at_rest=fields["starting_torque"], fall=fields["slope"], inertia=inertia)
    if "speed" in present:
        return line_through(fields["no_load_speed"], _rated(fields), inertia)
    return line_from_no_load(fields["no_load_speed"], fields["starting_torque"], inertia)


def _rated(fields: Fields) -> Point:
    """The rated point, by torque or power."""
    speed, torque = fields["speed"], fields.get("torque")
    return Point(speed, fields["power"] / speed if torque is None else torque)


_ROWS = (
    Key("speed", "numbers", "speeds, ascending"),
    Key("torque", "numbers", "one torque per speed"),
    Key("file", "text", "CSV file in the scene's folder; the speed comes first"),
    Key("column", "index", "column of the torques: its name in the header, or its number from 1", "2"),
    Key("speed_unit", "unit", "unit of the speeds", "rad/s"),
    Key("torque_unit", "unit", "unit of the torques", "N m"),
    Key("interpolation", "choice", "between the rows", "linear", choices=("linear", "pchip")),
)


def _table(item: Item, folder: Path | None) -> Curve | None:
    """A curve by its rows, in the scene itself or in a file."""
    names = ("speed", "torque")
    columns = columns_of(item, names, "no rows", folder)
    units = [read_unit(item, f"{name}_unit", name) for name in names]
    if columns is None or not item.clean:
        return None
    converted = []
    for name, column, unit in zip(names, columns, units, strict=True):
        try:
            numbers = tuple(convert(number, unit) for number in column) if unit is not None else ()
        except QuantityError as error:
            item.add(name, error.defect, error.expected)
            continue
        if max(map(abs, numbers), default=0.0) > LARGEST:
            item.add(name, "a number too large", f"at most {LARGEST:g} in SI")
        converted.append(numbers)
    if not item.clean:
        return None
    inertia = item.fields.get("inertia", 0.0)  # an engine's curve of full load has none of its own
    speeds, torques = converted
    texts = [item.fields[f"{name}_unit"] or "" for name in names]
    written = tuple(tuple(f"{number} {text}" for number in column) for column, text in zip(columns, texts, strict=True))
    own = {"interpolation": item.fields["interpolation"], "written": written, "inertia": inertia}
    return Curve(speeds=speeds, torques=torques, **own)


_DC_DATA = (("resistance", "constant"), ("power", "speed", "current"), ("power", "speed", "efficiency"))
_ARMATURE = "of the rated losses that arises in the armature"
_DC = (
    Key("voltage", "voltage", "at the armature", None, POSITIVE, True),
    Key("resistance", "resistance", "of the armature", None, POSITIVE),
    Key("constant", "motor constant", "voltage per speed, which is torque per current", None, POSITIVE),
    Key("friction", "angular damping", "of the rotor", 0.0, NOT_NEGATIVE),
    _POWER,
    _RATED,
    Key("current", "current", "of the armature at rated load", None, POSITIVE),
    Key("efficiency", "number", "at rated load", None, Range(0.0, 1.0, True, True), example="82 %"),
    Key("armature_share", "number", _ARMATURE, 0.5, Range(0.0, 1.0, True), example="0.5"),
    Key("inductance", "inductance", "of the armature", 0.0, NOT_NEGATIVE),
)


def _dc(item: Item, _: Path | None) -> Motor | None:
    """A DC motor by its constants, or by its name plate."""
    constants, pair = ("resistance", "constant", "friction"), ("current", "efficiency")
    fields, own, plate = item.fields, item.present(*constants), item.present("power", "speed", *pair, "armature_share")
    shared = {"inductance": fields["inductance"], "inertia": fields["inertia"]}
    if bool(plate) == bool(own):
        expected = "either resistance and constant, or power, speed and current (or efficiency)"
        item.faults.add(item.path, " and ".join((*own, *plate)) or "a voltage alone", expected)
        return None
    for name in ("resistance", "constant") if own else ("power", "speed"):
        item.needs(name)
    if not item.clean:
        return None
    if own:
        return DC(**{name: fields[name] for name in ("voltage", *constants)}, **shared)
    if not exactly_one(item.present(*pair), pair, item.path, item.faults):
        return None
    current = fields["current"] or fields["power"] / (fields["efficiency"] * fields["voltage"])
    return dc_from_plate(fields["voltage"], _rated(fields), current, fields["armature_share"], **shared)


_BREAKDOWN = Range(1.0, 100.0, True)
_OVERRIDE = Range(0.0, 10.0)
_SHARE = Range(0.0, 1.0, True)
_STATOR = "of the rated losses outside the rotor that arises in the stator's copper"
_INDUCTION = (
    _POWER._replace(required=True),
    _RATED._replace(required=True),
    Key("poles", "number", "number of poles, twice that of pole pairs", None, Even(2.0, 1000.0), True, example="4"),
    Key("frequency", "frequency", "of the mains", None, POSITIVE, True),
    Key("breakdown_ratio", "number", "breakdown torque over rated torque", None, _BREAKDOWN, True, example="2.5"),
    Key("voltage", "voltage", "between the lines", None, POSITIVE),
    Key("current", "current", "of a line at rated load", None, POSITIVE),
    Key("power_factor", "number", "at rated load", None, _SHARE, example="0.83"),
    Key("efficiency", "number", "at rated load", None, Range(0.0, 1.0, True, True), example="87 %"),
    Key("no_load_current", "current", "of a line without load", None, POSITIVE),
    Key("starting_current", "number", "of the locked rotor, over the rated one", None, _BREAKDOWN, example="6.5"),
    Key("starting_torque", "number", "of the locked rotor, over the rated one", None, POSITIVE, example="2.2"),
    Key("stator_share", "number", _STATOR, 0.5, _SHARE, example="0.5"),
    Key("electrical", "choice", "its fluxes follow the speed, or are states", "static", choices=("static", "two-axis")),
    *(
        Key(name, "resistance", f"of its equivalent circuit, a phase in star; {what}", None, POSITIVE)
        for name, what in (
            ("stator_resistance", "of the stator"),
            ("stator_reactance", "leakage of the stator"),
            ("magnetizing_reactance", "shared by both"),
            ("rotor_resistance", "of the rotor, seen from the stator"),
            ("rotor_reactance", "leakage of the rotor, seen from the stator"),
        )
    ),
    Key("locked_rotor_time", "time", "for which the warm motor bears its starting current", None, POSITIVE),
    Key("locked_rotor_time_cold", "time", "the same of the cold motor", None, POSITIVE),
    _INVERTER,
)


def _inverter(item: Item) -> Inverter | None:
    """The inverter of a motor, from the table `inverter` in its own; None without one, and after noting faults."""
    path = f"{item.path}.inverter"
    table = as_table(item.raw["inverter"], path, item.faults) if "inverter" in item.raw else None
    if table is None:
        return None
    inverter_item = read_item(table, INVERTER, path, item.faults)
    if "start" in item.raw:
        item.add("start", "a start together with an inverter", "a ramp of the inverter", "its frequency starts the motor")
    if not inverter_item.clean or not item.clean:
        return None
    fields = inverter_item.fields
    return Inverter(
        fields["frequency"],
        fields["field_weakening_from"] or item.fields["frequency"],
        fields["torque_limit"],
        ramp=fields["ramp"] or 0.0,
        braking=fields["braking"],
        chopper_power=fields["chopper_power"],
        overcurrent=fields["overcurrent"],
    )


def _two_axis(item: Item, static: Induction) -> TwoAxisInduction | None:
    """An induction motor with its fluxes as states; its circuit follows from the name plate where it is not given."""
    present = item.present(*Impedances._fields)
    if present and len(present) < len(Impedances._fields):
        missing = ", ".join(name for name in Impedances._fields if name not in present)
        item.faults.add(
            item.path, f"{', '.join(present)} without {missing}", "all five, or none where the name plate gives them"
        )
        return None
    if "start" in item.raw:
        item.add("start", "a start together with two axes", "electrical static: a start changes the torque, not the fluxes")
        return None
    item.needs("voltage")
    if not item.clean:
        return None
    circuit = Impedances(*(item.fields[name] for name in Impedances._fields)) if present else impedances_of(static)
    own = {one.name: getattr(static, one.name) for one in dataclass_fields(static)}
    return TwoAxisInduction(**own, voltage=item.fields["voltage"], impedances=circuit)


def _induction(item: Item, _: Path | None) -> Motor | None:
    """An induction motor; the fault of a bare speed states that it is in rad/s, although name plates have rpm."""
    names, bare = ("power", "speed", "frequency", "breakdown_ratio", "inertia"), item.raw["speed"]
    plate = Plate(**{name: item.fields[name] for name in Plate._fields})
    try:
        static = Induction(poles=_whole(item.number("poles")), plate=plate, **{name: item.fields[name] for name in names})
        inverter = _inverter(item)
        if not item.clean:
            return None
        if item.fields["electrical"] != "static":
            axes = _two_axis(item, static)
            return axes if axes is None or inverter is None else axes.fed(inverter)
        if inverter is None:
            return static
        own = {one.name: getattr(static, one.name) for one in dataclass_fields(static)}
        return InverterInduction(**own | {"inverter": inverter}).started()
    except SceneError as error:
        if isinstance(bare, str):
            raise
        advice = f'a bare number is in rad/s: write "{bare:g} rpm"'
        faults = (fault._replace(advice=advice) if fault.path == "speed" else fault for fault in error.faults)
        raise SceneError(faults) from None


_LOAD_ANGLE = Range(0.0, math.pi / 2, True, True)
_SYNCHRONOUS = (
    _POWER._replace(required=True),
    Key("poles", "number", "number of poles, twice that of pole pairs", None, Even(2.0, 1000.0), True, example="20"),
    Key("frequency", "frequency", "of the mains", None, POSITIVE, True),
    Key("pull_out_ratio", "number", "pull-out torque over rated torque", None, _BREAKDOWN, True, example="2"),
    Key("load_angle", "angle", "electrical, at rated torque; without it, that of a round rotor", None, _LOAD_ANGLE),
    Key("saliency", "number", "reluctance torque over that of the field", None, NOT_NEGATIVE, example="0.3"),
    Key("damping", "angular damping", "of the damper winding near synchronous speed", None, NOT_NEGATIVE),
    Key("asynchronous_slip", "number", "at which the damper winding gives rated torque", None, Range(0.0, 1.0, True, True)),
    Key("asynchronous_ratio", "number", "greatest torque of the damper winding over rated torque", None, POSITIVE),
    Key("field_at", "speed", "from which the field is given, below synchronous speed", None, POSITIVE),
    Key("field_time", "time", "time constant of the field", 0.0, NOT_NEGATIVE),
    _INVERTER,
)


def _synchronous(item: Item, _: Path | None) -> Motor | None:
    """A synchronous motor; its saliency may follow from the rated load angle, its damping from a slip."""
    fields, dampings = item.fields, ("damping", "asynchronous_slip")
    if not exactly_one(item.present(*dampings), dampings, item.path, item.faults):
        return None
    if len(item.present("load_angle", "saliency")) > 1:
        item.faults.add(item.path, "load_angle and saliency", "one of them: the other follows")
        return None
    poles, ratio, saliency = _whole(item.number("poles")), fields["pull_out_ratio"], fields["saliency"] or 0.0
    if (angle := fields["load_angle"]) is not None:
        ratio_of_axes = saliency_of(angle, ratio)
        if ratio_of_axes is None:
            round_rotor = math.degrees(math.asin(1.0 / ratio))
            defect = f"{math.degrees(angle):.6g} deg with a pull_out_ratio of {ratio:g}"
            item.add("load_angle", defect, f"{round_rotor:.4g} deg, that of a round rotor, or somewhat less")
            return None
        saliency = ratio_of_axes
    damping, greatest = fields["damping"], fields["asynchronous_ratio"]
    if (slip := fields["asynchronous_slip"]) is not None:
        if greatest is not None and not greatest > 1.0:
            item.add("asynchronous_ratio", f"{greatest:g}", "above 1, as asynchronous_slip is that of rated torque")
            return None
        field = 4 * math.pi * fields["frequency"] / poles
        damping = fields["power"] / field * damper_slope(greatest, slip * field)
    names = ("power", "frequency", "pull_out_ratio", "asynchronous_ratio", "field_at", "field_time", "inertia")
    inverter = _inverter(item)
    if not item.clean:
        return None
    motor = Synchronous(poles=poles, saliency=saliency, damping=damping, **{name: fields[name] for name in names})
    return motor if inverter is None else motor.fed(inverter)


_SERVO = (
    _RATED._replace(required=True),
    _TORQUE,
    _POWER,
    Key("standstill_torque", "torque", "continuous, at rest; default: that at rated speed", None, POSITIVE),
    Key("peak_torque", "torque", "greatest, for a short time", None, POSITIVE, True),
    Key("corner_speed", "speed", "up to which it has its peak torque", None, NOT_NEGATIVE, True),
    Key("maximum_speed", "speed", "at which the peak curve has fallen to zero", None, POSITIVE, True),
    Key("set_speed", "speed", "which its controller holds", None, POSITIVE, True),
    Key("droop", "number", "by which its speed falls at rated torque, over the set speed", 0.01, Range(0.0, 1.0, True)),
    Key("efficiency", "number", "at the rated point", None, Range(0.0, 1.0, True, True), example="90 %"),
    Key("resistance", "resistance", "between two terminals, instead, with its torque_constant", None, POSITIVE),
    Key("torque_constant", "motor constant", "torque over current of a line", None, POSITIVE),
    Key("braking", "choice", "use of the power that the motor returns", "none", choices=BRAKING),
    Key("chopper_power", "power", "greatest of the braking resistor", None, POSITIVE),
)


def _servo(item: Item, _: Path | None) -> Motor | None:
    """A servo drive; its losses in continuous running follow from an efficiency, or from its winding."""
    fields, point = item.fields, _rated(item.fields)
    constant, standstill = fields["torque_constant"], fields["standstill_torque"]
    if fields["resistance"] is None:
        losses = point.power * (1.0 / fields["efficiency"] - 1.0)
    else:
        item.needs("torque_constant", "copper losses follow from the resistance and the current")
        if not item.clean:
            return None
        losses = 1.5 * fields["resistance"] * ((standstill or point.torque) / constant) ** 2
    own = ("speed", "set_speed", "peak_torque", "corner_speed", "maximum_speed", "droop", "inertia")
    amplifier = Inverter(
        frequency=fields["set_speed"] / math.tau,
        weakening=fields["maximum_speed"] / math.tau,
        overcurrent=fields["peak_torque"] / point.torque,
        braking=fields["braking"],
        chopper_power=fields["chopper_power"],
    )
    return Servo(
        continuous_torque=point.torque,
        standstill_torque=standstill,
        torque_constant=constant,
        losses=losses,
        inverter=amplifier,
        **{name: fields[name] for name in own},
    )


_ENGINE = (
    Key("speed", "speed", "at which the governor sets in", None, POSITIVE, True),
    _TORQUE,
    _POWER,
    Key("full_load", "table", "torque against speed at full load"),
    Key("droop", "number", "(no-load speed - rated speed) / rated speed", None, Range(0.0, 1.0, True), True),
    Key("idle", "speed", "lowest speed at which it runs by itself", 0.0, NOT_NEGATIVE),
    Key("braking_torque", "torque", "of the unfired engine", 0.0, NOT_NEGATIVE),
)


def _engine(item: Item, folder: Path | None) -> Motor | None:
    """An engine by its rated point, or by its curve of full load."""
    if "full_load" not in item.raw:
        full_load: Any = _rated(item.fields).torque
    else:
        path = f"{item.path}.full_load"
        table = as_table(item.raw["full_load"], path, item.faults)
        full_load = None if table is None else _motor(read_item(table, CURVE, path, item.faults), folder)
    names = ("speed", "droop", "idle", "braking_torque", "inertia")
    return None if full_load is None else Engine(full_load=full_load, **{name: item.fields[name] for name in names})


_HYDRAULIC = (
    Key("displacement", "volume", "that passes through it in a turn", None, POSITIVE, True),
    Key("flow", "volume flow", "of the pump", None, POSITIVE, True),
    Key("pressure", "pressure", "over the motor, at which the relief valve opens", None, POSITIVE, True),
    Key("volumetric_efficiency", "number", "at that pressure", None, Range(0.0, 1.0, True, True), True, example="92 %"),
    Key("mechanical_efficiency", "number", "hydraulic and mechanical", None, _SHARE, True, example="93 %"),
    Key("override", "number", "rise of the valve's pressure when all of the flow goes through it", 0.0, _OVERRIDE),
)


def _hydraulic(item: Item, _: Path | None) -> Motor:
    """A hydraulic motor behind a pump and a relief valve."""
    return Hydraulic(**{key.name: item.fields[key.name] for key in (*_HYDRAULIC, _INERTIA)})


_TABLE = (("file",), ("speed", "torque"))
CURVE = Section(
    "table",
    "torque against speed as rows of numbers",
    _ROWS,
    either=_TABLE,
    reader=_table,
    makes=Curve,
    begin={"speed": [0, 100, 157], "torque": [50, 40, 0]},
)
"""A motor by its curve, and the curve of an engine's full load."""
_FULL = (("torque", "power", "full_load"),)
_CONTINUOUS = (("torque", "power"), ("efficiency", "resistance"))
_TYPES = (
    Section("constant", "a torque that does not depend on speed", _CONSTANT, reader=_constant, makes=Constant,
            begin={"torque": "40 N m"}),
    Section("line", "a torque that falls in a straight line", _LINE, either=_LINES, reader=_line, makes=Line,
            begin={"no_load_speed": "1500 rpm", "starting_torque": "100 N m"}),
    CURVE,
    Section("dc", "a DC motor with constant excitation", _DC, either=_DC_DATA, reader=_dc, makes=DC,
            begin={"voltage": "220 V", "resistance": "0.5 ohm", "constant": "1.2 V s/rad"}),
    Section("induction", "an induction motor, by Kloss's formula", _INDUCTION, reader=_induction, makes=Induction,
            begin={"power": "3 kW", "speed": "1415 rpm", "poles": 4, "frequency": "50 Hz", "breakdown_ratio": 2.5}),
    Section("synchronous", "a synchronous motor, by its load angle", _SYNCHRONOUS, reader=_synchronous, makes=Synchronous,
            begin={"power": "15 kW", "poles": 4, "frequency": "50 Hz", "pull_out_ratio": 2, "asynchronous_slip": 0.04}),
    Section("servo", "a servo drive that holds a speed within its area", _SERVO, one_of=_CONTINUOUS, reader=_servo,
            makes=Servo,
            begin={"speed": "3000 rpm", "torque": "8 N m", "peak_torque": "30 N m", "corner_speed": "2500 rpm",
                   "maximum_speed": "5000 rpm", "set_speed": "1500 rpm", "efficiency": "90 %"}),
    Section("hydraulic", "a hydraulic motor behind a pump and a relief valve", _HYDRAULIC, reader=_hydraulic,
            makes=Hydraulic,
            begin={"displacement": "160 cm^3", "flow": "240 l/min", "pressure": "140 bar", "volumetric_efficiency": 0.92,
                   "mechanical_efficiency": 0.93}),
    Section("engine", "an engine under a governor", _ENGINE, one_of=_FULL, reader=_engine, makes=Engine,
            begin={"speed": "1500 rpm", "power": "10 kW", "droop": "5 %"}),
)  # fmt: skip
MOTOR_TYPE = Key("type", "choice", "its type", required=True, choices=tuple(motor.name for motor in _TYPES))
MOTORS = {
    motor.name: motor._replace(
        keys=(
            *(MOTOR_TYPE, *motor.keys, _INERTIA),
            *([_START] if motor.makes.starts else []),
            *([_THERMAL] if motor.makes.heated else []),
        )
    )
    for motor in _TYPES
}
"""Types of motor: keys, the function that makes the motor of them, class, and the values on a new form."""
TABLES = {"full_load": CURVE, "start": START, "inverter": INVERTER, "thermal": THERMAL}
"""Tables within a motor's own, by their keys."""

# -- duty --------------------------------------------------------------------------------------------------------------


MOST_PHASES = 100
STANDSTILL_COOLING = 1 / 3
"""Share by which standstill counts for the cooling of a motor whose fan sits on its shaft, unless the scene says otherwise.

Usual are 1/4 to 1/3 for motors that cool themselves.
"""
_OF_ALL = ("duty", "flywheel")


def read_duty(raw: Mapping[str, Any], faults: Faults) -> list[Item]:
    """The phases as they are written, after noting all faults that do not depend on the machine."""
    duty = raw["duty"]
    tables = items(duty)
    if tables is None or not tables:
        advice = "write [[duty]]" if isinstance(duty, Mapping) else ""
        faults.add("duty", "no phase" if tables == [] else show(duty), "an array of tables, one for each phase", advice)
        return []
    if len(tables) > MOST_PHASES:
        faults.add("duty", f"{len(tables)} phases", f"at most {MOST_PHASES}")
        return []
    for name, what in (("stroke", "a stroke has no cycle"), ("areas", "a diagram of areas has no loads")):
        if name in raw:
            faults.add("duty", f"a duty together with [{name}]", "none", what)
    if "flywheel" not in raw:
        faults.add("flywheel", "nothing, with a duty", "a table with irregularity or inertia", "of all phases together")
    phases = []
    for i, each in enumerate(tables):
        table = as_table(each, f"duty[{i}]", faults)
        if table is not None:
            item = read_item(table, SECTIONS["duty"], f"duty[{i}]", faults)
            _check(item)
            phases.append(item)
    names = [_name(item) for item in phases]
    for i, item in enumerate(phases):
        if _name(item) in names[:i]:
            item.add("name", f"{quote(_name(item))}, which is that of another phase", "a unique name")
    if phases and all(item.fields["rest"] for item in phases):
        faults.add("duty", "phases at rest alone", "one at least in which the machine runs")
    return phases


def _name(item: Item) -> str:
    number = item.path.removeprefix("duty[").removesuffix("]")
    return str(item.fields["name"] or f"phase {int(number) + 1}")


def _check(item: Item) -> None:
    """Notes contradictions within one phase."""
    if item.fields["rest"]:
        item.without(
            ["loads", "changes", "starts", "braking"], "in a phase at rest", "the motor is off and the machine stands still"
        )
        item.without(["cycles"], "in a phase at rest", "give its duration")
        return
    item.without(["standstill_cooling"], "in a phase that runs", "it belongs to a phase with rest = true")
    starts = item.fields["starts"]
    if starts is not None and starts != int(starts):
        item.add("starts", show(item.raw["starts"]), "a whole number")
    if not starts:
        item.without(["braking"], "in a phase without starts", "give starts: each one is braked at its end")
    if "changes" not in item.raw:
        return
    changes = as_table(item.raw["changes"], f"{item.path}.changes", item.faults)
    for path, _value in leaves(changes or {}):
        if path.split(".")[0] in _OF_ALL:
            item.faults.add(f"{item.path}.changes.{path}", "a change of what all phases share", "a change of the machine")


def leaves(changes: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, Any]]:
    """Values by their paths, from tables within tables as TOML reads dotted keys.

    >>> list(leaves({"load": {"0": {"force": "-2 kN"}}, "shafts.motor.ratio": 5}))
    [('load.0.force', '-2 kN'), ('shafts.motor.ratio', 5)]
    """
    for key, value in changes.items():
        name = f"{path}.{key}" if path else str(key)
        if isinstance(value, Mapping):
            yield from leaves(value, name)
        else:
            yield name, value


def phases(scene: Scene, read: list[Item], faults: Faults) -> tuple[Phase, ...]:
    """The phases of a scene that was read without a fault, each with its machine."""
    rows = []
    for item in read:
        fields, rest, braking = item.fields, bool(item.fields["rest"]), ELECTRIC_BRAKING[item.fields["braking"] or "none"]
        cooling = STANDSTILL_COOLING if fields["standstill_cooling"] is None else fields["standstill_cooling"]
        try:
            machine = None if rest else _machine(scene, item)
        except SceneError as error:
            faults.extend(  # those of the machine as the phase has it, at the change that makes them
                fault.under(f"{item.path}.changes")._replace(line=None) for fault in error.faults
            )
            continue
        rows.append(
            Phase(
                name=_name(item),
                scene=machine,
                duration=fields["duration"],
                cycles=fields["cycles"],
                starts=int(fields["starts"] or 0) * (1 + braking),
                braking=braking,
                cooling=cooling if rest else 1.0,
                loaded=not rest and fields["loads"] != 0.0,
                path=item.path,
            )
        )
    return tuple(rows)


def _machine(scene: Scene, item: Item) -> Scene:
    """The scene of a phase: with its changes, and its loads times their share."""
    changes = dict(leaves(item.raw.get("changes", {})))
    variant, share = scene.with_({**changes, "duty": None}), item.fields["loads"]
    if share is None or variant.document is None:
        return variant
    raw = variant.document.tables.get("load", ())
    factors = {}
    for load in variant.loads:
        if is_loss(load.model) or not load.path.startswith("load["):  # a shaft's drag is one of its bearings
            continue
        index = int(load.path.removeprefix("load[").removesuffix("]"))
        try:
            own = parse_range(raw[index].get("factor", 1.0), "number")
        except QuantityError:  # found wrong when it was read
            own = 1.0
        factors[f"load.{index}.factor"] = share * own
    return variant.with_(factors) if factors else variant
