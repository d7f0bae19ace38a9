"""The keys of the drive's `motor`, type by type."""

from __future__ import annotations

from flywheel.reading.schema import NOT_NEGATIVE, POSITIVE, Key, Range, Section


class _Even(Range):
    """Whole numbers that two divides."""

    def __contains__(self, value: object) -> bool:
        return super().__contains__(value) and isinstance(value, (int, float)) and value % 2 == 0

    def __str__(self) -> str:
        return f"that is an even number, {self.low:g} or more"


_TYPE = Key("type", "choice", "what it is", required=True)
_INERTIA = Key("inertia", "inertia", "of the rotor, on the shaft that it drives", 0.0, NOT_NEGATIVE)
_START = Key("starting_torque", "torque", "at rest", None, POSITIVE)
_POWER = Key("power", "power", "at the shaft, at rated speed", None, POSITIVE)
_RATED = Key("speed", "speed", "at rated load", None, POSITIVE)
_TORQUE = Key("torque", "torque", "at rated speed", None, POSITIVE)
_CONSTANT = (Key("torque", "torque", "at any speed", None, POSITIVE, True),)
_LINE = (
    _START,
    Key("slope", "angular damping", "by which torque falls per speed", None, POSITIVE),
    Key("no_load_speed", "speed", "at which torque has fallen to zero", None, POSITIVE),
    _RATED,
    _TORQUE,
    _POWER,
)
CURVE_KEYS = (
    Key("speed", "numbers", "speeds, ascending"),
    Key("torque", "numbers", "one torque per speed"),
    Key("file", "text", "CSV file beside the scene; the speed comes first"),
    Key("column", "index", "column of the torques: its name in the header, or its number from 1", "2"),
    Key("speed_unit", "unit", "unit of the speeds", "rad/s"),
    Key("torque_unit", "unit", "unit of the torques", "N m"),
    Key("interpolation", "choice", "between the rows", "linear", choices=("linear", "pchip")),
)
"""Of a table of torque against speed."""

_DC = (
    Key("voltage", "voltage", "at the armature", None, POSITIVE, True),
    Key("resistance", "resistance", "of the armature", None, POSITIVE),
    Key("constant", "motor constant", "voltage per speed, which is torque per current", None, POSITIVE),
    Key("friction", "angular damping", "of the rotor", 0.0, NOT_NEGATIVE),
    _POWER,
    _RATED,
    Key("current", "current", "of the armature at rated load", None, POSITIVE),
    Key("efficiency", "number", "at rated load", None, Range(0.0, 1.0, True, True), example="82 %"),
    Key(
        "armature_share",
        "number",
        "of the rated losses that arises in the armature",
        0.5,
        Range(0.0, 1.0, True),
        example="0.5",
    ),
    Key("inductance", "inductance", "of the armature", 0.0, NOT_NEGATIVE),
)
_INDUCTION = (
    _POWER._replace(required=True),
    _RATED._replace(required=True),
    Key("poles", "number", "number of poles, twice that of pole pairs", None, _Even(2.0, 1000.0), True, example="4"),
    Key("frequency", "frequency", "of the mains", None, POSITIVE, True),
    Key(
        "breakdown_ratio", "number", "breakdown torque over rated torque", None, Range(1.0, 100.0, True), True, example="2.5"
    ),
)
_ENGINE = (
    Key("speed", "speed", "at which the governor sets in", None, POSITIVE, True),
    _TORQUE,
    _POWER,
    Key("full_load", "table", "torque against speed at full load"),
    Key("droop", "number", "(no-load speed - rated speed) / rated speed", None, Range(0.0, 1.0, True), True),
    Key("idle", "speed", "the lowest at which it runs by itself", 0.0, NOT_NEGATIVE),
    Key("braking_torque", "torque", "of the unfired engine", 0.0, NOT_NEGATIVE),
)

_KINDS: dict[str, tuple[str, tuple[Key, ...]]] = {
    "constant": ("a torque that no speed changes", _CONSTANT),
    "line": ("a torque that falls in a straight line", _LINE),
    "table": ("torque against speed as rows of numbers", CURVE_KEYS),
    "dc": ("a DC motor with constant excitation", _DC),
    "induction": ("an induction motor, by Kloss's formula", _INDUCTION),
    "engine": ("an engine under a governor", _ENGINE),
}
TYPE = _TYPE._replace(choices=tuple(_KINDS))
MOTORS = {kind: Section("drive.motor", about, (TYPE, *keys, _INERTIA)) for kind, (about, keys) in _KINDS.items()}
"""The keys of each type of motor."""
