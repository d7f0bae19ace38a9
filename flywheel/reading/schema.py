"""The scene format in one place: every table and key, what it holds, its range and its default.

The reader checks scenes against these lists, the reference texts are tested against them, and nothing else in the
toolkit spells out a key.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from flywheel.accuracy import RTOL

TURN = 2 * math.pi
NAME_PATTERN = r"[^\W\d][\w-]*"
"""Names of shafts, mechanisms and outputs: a letter, then letters, digits, `_` or `-`."""

MOST_TABLES = 1000
"""How many tables an array of them, and how many keys a table, may hold."""
MOST_MECHANISMS = 100
"""How many mechanisms a machine, and how many outputs a law, may have."""
MOST_TURNS = 1000
"""How many turns a mechanism, and how many repetitions a load, may make in a cycle."""


_TINIEST = 1e-50  # what is above 0 is at least this: squares and products of less leave the floating-point range


class Range(NamedTuple):
    """The values a key may take, from `low` to `high`; an end may be left out of the range."""

    low: float = -math.inf
    high: float = math.inf
    low_open: bool = False
    high_open: bool = False

    def __contains__(self, value: object) -> bool:
        if not isinstance(value, (int, float)):
            return False
        if self.low_open and self.low == 0.0 and value < _TINIEST:
            return False
        above = value > self.low if self.low_open else value >= self.low
        return above and (value < self.high if self.high_open else value <= self.high)

    def __str__(self) -> str:
        low = f"{'above' if self.low_open else 'at least'} {self.low:g}" if self.low > -math.inf else ""
        high = f"{'below' if self.high_open else 'at most'} {self.high:g}" if self.high < math.inf else ""
        return " and ".join(filter(None, (low, high))) or "any"


ANY = Range()
POSITIVE = Range(0.0, low_open=True)
NOT_NEGATIVE = Range(0.0)


class Key(NamedTuple):
    """One key of a table.

    kind: a dimension of `flywheel.units.DIMENSIONS`; two of them for a place that translates and one that rotates
    ("mass | inertia"); or "text", "name", "choice", "law" (quantity or expression), "position" (expression or table),
    "table", "numbers", "index", "unit", "tables" (a table of named tables), "list" (of tables, names or lengths), "flag",
    "model" (a table whose keys depend on its type).
    default: SI, or None where there is none. missing: advice where a required key is not there. later: known, but
    not supported yet. example: of a value, where that of its dimension does not suit it. many_turns: an angle that may
    be any number of turns also where it is written without a unit.
    """

    name: str
    kind: str
    about: str
    default: float | str | None = None
    range: Range = ANY
    required: bool = False
    choices: tuple[str, ...] = ()
    missing: str = ""
    later: bool = False
    example: str = ""
    many_turns: bool = False


class Section(NamedTuple):
    """One table of the scene; `array` is written `[[name]]`, `named` is `[name.NAME]`, `free` has keys of its own."""

    name: str
    about: str
    keys: tuple[Key, ...]
    array: bool = False
    named: bool = False
    free: bool = False
    later: bool = False


class Port(NamedTuple):
    """A place of a mechanism where loads, springs and added inertia may act."""

    name: str
    rotating: bool
    about: str


class Part(NamedTuple):
    """A table of a mechanism: its geometry, then what it may weigh."""

    name: str
    about: str
    geometry: tuple[Key, ...] = ()
    body: tuple[Key, ...] = ()

    @property
    def keys(self) -> tuple[Key, ...]:
        """Every key of the table."""
        return self.geometry + self.body


class Kind(NamedTuple):
    """One type of mechanism: its tables, its own keys beside the common ones, its ports."""

    name: str
    about: str
    parts: tuple[Part, ...] = ()
    keys: tuple[Key, ...] = ()
    ports: tuple[Port, ...] = ()
    later: bool = False


def _length(about: str) -> Key:
    return Key("length", "length", about, required=True, range=POSITIVE)


MASS = Key("mass", "mass", "mass of the body", 0.0, NOT_NEGATIVE)
GD2 = Key("gd2", "inertia | moment of weight", "GD² of what rotates, 4 inertias (kg m², or kgf m²)", None, NOT_NEGATIVE)
OWN_INERTIA = Key("inertia", "inertia", "inertia about its own centre of mass", 0.0, NOT_NEGATIVE)
POINT = (MASS,)
BODY = (
    MASS,
    OWN_INERTIA,
    Key("com", "length", "distance of the centre of mass from the first pin, towards the other pin", 0.0),
    Key("com_angle", "angle", "angle of that distance from the line of the pins, counter-clockwise", 0.0),
)

_CRANK = Part("crank", "turns about a fixed pivot; its first pin is the pivot", (_length("pivot to crank pin"),), BODY)

_SCOTCH_YOKE = Kind(
    "scotch-yoke",
    "a crank pin slides in a slot of a yoke that moves along a straight line",
    (
        _CRANK,
        Part("yoke", "moves along a line", (Key("direction", "angle", "of its travel, from +x", 0.0),), POINT),
        Part("block", "mass at the crank pin", (), POINT),
    ),
    ports=(Port("yoke", False, "x = R cos(phi - direction), positive along direction"),),
)
_SLIDER_CRANK = Kind(
    "slider-crank",
    "a crank drives a slider along a straight line through a rod",
    (
        _CRANK,
        Part("rod", "from the crank pin (its first pin) to the slider", (_length("crank pin to slider pin"),), BODY),
        Part(
            "slider",
            "moves along the line y = offset",
            (Key("offset", "length", "y of its line of travel", 0.0),),
            POINT,
        ),
    ),
    ports=(
        Port("slider", False, "x = r cos phi + sqrt(l^2 - (r sin phi - e)^2), positive along +x"),
        Port("rod", True, "angle of the rod from +x"),
    ),
)
_FOUR_BAR = Kind(
    "four-bar",
    "a crank and a rocker on fixed pivots, joined by a coupler",
    (
        Part("ground", "the frame", (_length("crank pivot to rocker pivot, along +x"),)),
        _CRANK,
        Part("coupler", "from the crank pin (its first pin) to the rocker", (_length("between its pins"),), BODY),
        Part("rocker", "turns about a fixed pivot, its first pin", (_length("pivot to coupler pin"),), BODY),
    ),
    (
        Key(
            "assembly",
            "choice",
            "side of the line crank pin - rocker pivot where the coupler-rocker pin lies: open left, crossed right",
            "open",
            choices=("open", "crossed"),
        ),
    ),
    (
        Port("coupler", True, "angle from +x of the line from the crank pin to the rocker pin"),
        Port("rocker", True, "angle from +x of the line from the rocker's pivot to its pin"),
    ),
)
_CRANK_SHAPER = Kind(
    "crank-shaper",
    "a block on the crank pin slides along a rocker, whose end drives a ram",
    (
        _CRANK,
        Part("frame", "the frame", (_length("rocker's pivot to crank's pivot, along +x"),)),
        Part("rocker", "turns about a fixed pivot, its first pin", (_length("pivot to ram pin"),), BODY),
        Part("block", "sits at the crank pin and turns with the rocker", (), (MASS, OWN_INERTIA)),
        Part("rocker_pin", "mass at the rocker's end", (), POINT),
        Part("ram", "moves along y", (), POINT),
    ),
    ports=(
        Port("rocker", True, "theta = atan2(r sin phi, d + r cos phi), continuous"),
        Port("ram", False, "y = L sin theta, positive along +y"),
    ),
)
_TOGGLE_CLAMP = Kind(
    "toggle-clamp",
    "a sliding block swings a bell crank through a coupler; a rod from the bell crank pushes a platen straight",
    (
        Part("frame", "the frame", (Key("height", "length", "block's line above the pivot", None, POSITIVE, True),)),
        Part("block", "drives: it slides along the line y = frame.height, and has the coupler's pin", (), POINT),
        Part(
            "bell_crank",
            "turns about a fixed pivot, its first pin; its line runs to the rod's pin",
            (
                Key("drive_length", "length", "pivot to coupler pin", None, POSITIVE, True),
                Key("clamp_length", "length", "pivot to rod pin", None, POSITIVE, True),
                Key("angle", "angle", "from the drive arm's extension beyond the pivot to the clamp arm", required=True),
            ),
            BODY,
        ),
        Part("coupler", "from the bell crank (its first pin) to the block", (_length("between its pins"),), BODY),
        Part("rod", "from the bell crank (its first pin) to the platen", (_length("between its pins"),), BODY),
        Part("platen", "moves along the line y = 0, which passes through the pivot", (), POINT),
    ),
    (
        Key(
            "assembly",
            "choice",
            "side of the line pivot - block where the coupler's other pin lies: open left, crossed right; behind: the "
            "platen lies behind the rod's other pin",
            "open",
            choices=("open", "crossed", "open-behind", "crossed-behind"),
        ),
    ),
    (
        Port("block", False, "displacement of the block along -x, from above the pivot"),
        Port("platen", False, "displacement of the platen along +x, from the pivot"),
        Port("bell_crank", True, "angle from +x of the line from the pivot to the coupler pin"),
        Port("coupler", True, "angle from +x of the line from the bell crank to the block"),
        Port("rod", True, "angle from +x of the line from the bell crank to the platen"),
    ),
)
_LAW = Kind(
    "law",
    "outputs whose position is given as a function of the crank's angle",
    keys=(Key("outputs", "tables", "one table per output, each of them a port", required=True),),
)
_LINKAGE = Kind(
    "linkage",
    "bodies, joints and couplings of any plane linkage (`flywheel.reading.schema_linkage` has their keys)",
    keys=(
        Key(
            "driver",
            "text",
            "name of the pin or slide that drives",
            required=True,
            missing='give a joint, such as "O"',
        ),
        Key("start", "angle | length", "the driver's coordinate at which guesses and assembly hold", 0.0),
        Key("assembly", "list", "an array of tables: sides on which points lie where the driver stands at start"),
        Key("bodies", "tables", "one table per body; `frame` is the fixed one", required=True),
        Key("joints", "list", "an array [[mechanism.joints]], one table per joint", required=True),
        Key("couplings", "list", "an array [[mechanism.couplings]]: gear and rolling pairs, cams"),
        Key("ports", "tables", "ports at points of bodies"),
    ),
)

KINDS = {kind.name: kind for kind in (_SCOTCH_YOKE, _SLIDER_CRANK, _FOUR_BAR, _CRANK_SHAPER, _TOGGLE_CLAMP, _LAW, _LINKAGE)}

OUTPUT = Section(
    "mechanism.outputs.NAME",
    "one output of a law",
    (
        Key("x", "position", "position in m, periodic: an expression of phi, or a table"),
        Key("theta", "position", "position in rad, may gain a constant per cycle: an expression of phi, or a table"),
        Key("mass", "mass", "mass of an output that translates", 0.0, NOT_NEGATIVE),
        Key("inertia", "inertia", "inertia of an output that rotates", 0.0, NOT_NEGATIVE),
    ),
)

TABLE = Section(
    "table",
    "numbers against angle, in the scene or in a CSV file",
    (
        Key("file", "text", "CSV file beside the scene; the angle comes first"),
        Key("column", "index", "column of the values: its name in the header, or its number from 1", "2"),
        Key("angle", "numbers", "angles, ascending; two equal ones are a jump"),
        Key("value", "numbers", "one value per angle"),
        Key("angle_unit", "unit", "unit of the angles", "rad"),
        Key("value_unit", "unit", "unit of the values; SI without it"),
        Key("interpolation", "choice", "between the rows", "linear", choices=("linear", "pchip", "step")),
    ),
)

MECHANISM = Section(
    "mechanism",
    "a mechanism: [mechanism] for one, [[mechanism]] for several",
    (
        Key("type", "text", "what it is", required=True, choices=tuple(KINDS)),
        Key("name", "name", "what places call it; needed when there are several of its type (default: the type)"),
        Key("shaft", "text", "the shaft that its crank sits on", "crank"),
        Key("phase", "angle", "its crank stands at ratio phi + phase", 0.0, Range(-MOST_TURNS * TURN, MOST_TURNS * TURN)),
    ),
    array=True,
)

_ON = Key("on", "text", "a shaft or a port", required=True)
_ON_SHAFT = Key("on", "text", "a shaft", "crank")

_SECTIONS = (
    Section(
        "parameters",
        'names for numbers that expressions may use: a quantity, or "balance" for the one unknown',
        (),
        free=True,
    ),
    Section(
        "shafts",
        "shafts geared to the crank, which always exists and has ratio 1",
        (
            Key("ratio", "number", "speed of the shaft over that of the crank", required=True, range=POSITIVE, example="5"),
            Key("stiffness", "angular stiffness", "of a compliant shaft: torque on it per twist", None, POSITIVE),
            Key("damping", "angular damping", "of the twist of a compliant shaft", None, NOT_NEGATIVE),
            Key("efficiency", "number", "of its mesh or belt", 1.0, Range(0.0, 1.0, low_open=True), example="95 %"),
        ),
        named=True,
    ),
    MECHANISM,
    Section(
        "inertia",
        "a mass or an inertia fixed on a place; it has no weight",
        (
            _ON,
            Key("value", "mass | inertia", "mass of what translates, inertia of what rotates", None, NOT_NEGATIVE),
            GD2,
        ),
        array=True,
    ),
    Section(
        "load",
        "a force or a torque on a place, positive along its positive sense",
        (
            _ON,
            Key("force", "law", "on a place that translates: a quantity or an expression in N"),
            Key("torque", "law", "on a place that rotates: a quantity or an expression in N m"),
            Key("table", "table", "force or torque against angle"),
            Key("model", "model", "force or torque of a machine of a known kind, such as a press or a compressor"),
            Key("bore", "length", "of the cylinder whose gas the force or table is that of", None, POSITIVE),
            Key("from", "angle", "where the load begins to act"),
            Key("to", "angle", "where it ceases; it wraps when to is less than from"),
            Key(
                "while",
                "text",
                "it acts only while its place moves so at positive crank speed",
                choices=("v > 0", "v < 0"),
            ),
            Key(
                "every",
                "angle",
                "the angle after which window, table and phi repeat (default: the cycle)",
                None,
                POSITIVE,
            ),
        ),
        array=True,
    ),
    Section(
        "spring",
        "a spring from a place to the frame: -stiffness (x - rest)",
        (
            _ON,
            Key(
                "stiffness",
                "stiffness | angular stiffness",
                "force per length, or torque per angle",
                None,
                NOT_NEGATIVE,
                True,
            ),
            Key("rest", "length | angle", "displacement at which it is slack", 0.0),
        ),
        array=True,
    ),
    Section(
        "damper",
        "a damper from a place to the frame: -coefficient v",
        (
            _ON,
            Key(
                "coefficient",
                "damping | angular damping",
                "force per speed",
                None,
                NOT_NEGATIVE,
                True,
                missing="the second on what rotates",
            ),
        ),
        array=True,
    ),
    Section(
        "gravity",
        "weight of every body that has mass; without this table there is none",
        (
            Key("g", "acceleration", "acceleration of free fall", 9.80665, NOT_NEGATIVE),
            Key("direction", "angle", "of the weight, from +x", -math.pi / 2),
        ),
    ),
    Section(
        "drive",
        "the torque that drives the machine, or the force where its reduction element slides",
        (
            _ON_SHAFT,
            Key("torque", "law", '"balance", a quantity or an expression in N m'),
            Key("force", "law", "a quantity or an expression in N, where the driver slides"),
            Key("motor", "model", 'a motor of a known kind, instead of a torque, such as {type = "induction", ...}'),
        ),
    ),
    Section(
        "regime",
        "steady running",
        (
            _ON_SHAFT,
            Key(
                "speed",
                "speed",
                "mean of the greatest and the least speed (without it: the machine's own, set by its torques)",
                range=POSITIVE,
            ),
            Key(
                "cycle",
                "angle",
                "crank angle after which everything repeats",
                TURN,
                Range(0.0, MOST_TURNS * TURN * (1 + 1e-9), True),
                many_turns=True,
            ),
        ),
    ),
    Section(
        "flywheel",
        "where the flywheel sits, and either what it shall achieve or how large it is",
        (
            _ON_SHAFT,
            Key("irregularity", "number", "of the speed: size the flywheel for it", None, Range(0.0, 2.0, True, True)),
            Key("inertia", "inertia", "of the given flywheel: analyse it", None, NOT_NEGATIVE),
            GD2,
        ),
    ),
    Section(
        "stroke",
        "a one-way motion of the driver, which slides or turns, instead of regime and flywheel",
        (
            Key("from", "length | angle", "driver's coordinate at the beginning", required=True),
            Key("to", "length | angle", "driver's coordinate at the end, greater than from", required=True),
            Key("speed", "velocity | speed", "of the driver, all along the stroke", required=True),
            Key("acceleration", "acceleration | angular acceleration", "of the driver, all along the stroke", 0.0),
        ),
    ),
    Section(
        "areas",
        "areas of a turning-moment diagram between its crossings, instead of mechanism, loads and drive",
        (
            Key("values", "numbers", "the areas in their order, with their signs", required=True),
            Key("scale", "energy", "work that one unit of area stands for", 1.0, POSITIVE),
        ),
    ),
    Section(
        "accuracy",
        "what is asked of the numbers",
        (
            Key("rtol", "number", "relative error asked of every figure", 1e-9, Range(*RTOL)),
            Key(
                "closure",
                "number",
                "net work allowed, as a share of the work exchanged (default: rtol)",
                None,
                Range(0.0, 0.1),
            ),
        ),
    ),
)

SECTIONS = {section.name: section for section in _SECTIONS}

TOP = (
    Key("title", "text", "what the machine is"),
    Key("source", "text", "where its data come from"),
)
"""Keys outside any table."""

AREAS_EXCLUDE = ("mechanism", "inertia", "load", "spring", "damper", "gravity", "drive")
"""Tables that a scene with `[areas]` must do without."""

STROKE_EXCLUDE = ("regime", "flywheel", "areas")
"""Tables that a scene with `[stroke]` must do without."""

STROKE_TYPES = ("toggle-clamp", "linkage")
"""Types of mechanism that may go one way, along a stroke."""
