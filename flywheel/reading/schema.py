"""The scene format in one place: every table and key, its kind of value, range and default.

The reader checks scenes against these lists, the reference texts are tested against them. Load models and motors have
theirs, with their readers, in `load_models` and `motors`; families of mechanisms in `mechanisms`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from flywheel.components.wheel_stresses import FEWEST, MATERIALS, METHODS, MOST, SPEEDS, WHEEL_SHAPES
from flywheel.mechanisms import KINDS
from flywheel.scene.scene import (
    DEFAULT_RTOL,
    ELECTRIC_BRAKING,
    MASS,
    NOT_NEGATIVE,
    OWN_INERTIA,
    POSITIVE,
    RTOL,
    Key,
    Range,
)

TURN = 2 * math.pi
NAME_PATTERN = r"[^\W\d][\w-]*"
"""Names of shafts, mechanisms and outputs: a letter, then letters, digits, `_` or `-`."""

MOST_TABLES = 1000
"""Greatest numbers of tables in an array of them, and of keys in a table."""
MOST_MECHANISMS = 100
"""Greatest numbers of mechanisms in a machine, and of outputs of a law."""
MOST_TURNS = 1000
"""Greatest numbers of turns of a mechanism, and of repetitions of a load, in a cycle."""


class Section(NamedTuple):
    """One table of the scene; `array` is written `[[name]]`, `named` is `[name.NAME]`, `free` has keys of its own.

    one_of: groups of keys, of each of which a table has exactly one. either: sets of keys, of which a table has one and no
    key of the others; the reader checks other combinations. reader: function that makes a load's law, or a motor, from a
    table whose keys follow from its type; makes: the class of the motor; begin: values with which it begins on a form
    ("EFFORT" and "SPEED" stand for those of a place that rotates or translates).
    """

    name: str
    about: str
    keys: tuple[Key, ...]
    array: bool = False
    named: bool = False
    free: bool = False
    one_of: tuple[tuple[str, ...], ...] = ()
    either: tuple[tuple[str, ...], ...] = ()
    reader: Callable[..., Any] | None = None
    makes: Any = None
    begin: Mapping[str, Any] = MappingProxyType({})


GD2 = Key(
    "gd2",
    "inertia | moment of weight",
    "GD² of a rotating part, four times its inertia (kg m², or kgf m²)",
    None,
    NOT_NEGATIVE,
)
OUTPUT = Section(
    "mechanism.outputs.NAME",
    "one output of a law",
    (
        Key("x", "position", "position in m, periodic: an expression of phi, or a table"),
        Key("theta", "position", "position in rad, may gain a constant per cycle: an expression of phi, or a table"),
        Key("mass", "mass", "mass of an output that translates", 0.0, NOT_NEGATIVE),
        Key("inertia", "inertia", "inertia of an output that rotates", 0.0, NOT_NEGATIVE),
    ),
    one_of=(("x", "theta"),),
)

TABLE = Section(
    "table",
    "numbers against angle, in the scene or in a CSV file",
    (
        Key("file", "text", "CSV file in the scene's folder; the angle comes first"),
        Key("column", "index", "column of the values: its name in the header, or its number from 1", "2"),
        Key("angle", "numbers", "angles, ascending; two equal ones are a jump"),
        Key("value", "numbers", "one value per angle"),
        Key("angle_unit", "unit", "unit of the angles", "rad"),
        Key("value_unit", "unit", "unit of the values; SI without it"),
        Key("interpolation", "choice", "between the rows", "linear", choices=("linear", "pchip", "step")),
    ),
    either=(("file",), ("angle", "value")),
)

MECHANISM = Section(
    "mechanism",
    "a mechanism: [mechanism] for one, [[mechanism]] for several",
    (
        Key("type", "text", "its type", required=True, choices=tuple(KINDS)),
        Key("name", "name", "name used in places; needed when there are several of its type (default: the type)"),
        Key("shaft", "text", "the shaft that its crank sits on", "crank"),
        Key("phase", "angle", "its crank angle is ratio phi + phase", 0.0, Range(-MOST_TURNS * TURN, MOST_TURNS * TURN)),
    ),
    array=True,
)

_ON = Key("on", "text", "a shaft or a port", required=True)
_ON_SHAFT = Key("on", "text", "a shaft", "crank")

_ONCE_ROUND = Range(0.0, TURN * (1 + 1e-9))
_RAMPS = (Key("rise", "time", "in which the torque increases linearly", 0.0, NOT_NEGATIVE),)
_HEATS = (
    Key("heat_per_stroke", "energy", "permissible in one stroke, or in several in a row", None, POSITIVE),
    Key("heat_per_hour", "energy", "permissible in an hour", None, POSITIVE),
)

_SECTIONS = (
    Section(
        "parameters",
        'names for numbers that expressions may use: a quantity, or "balance" for the one unknown',
        (),
        free=True,
    ),
    Section(
        "shafts",
        "shafts geared to the crank, which always exists and has ratio 1, or to one another",
        (
            Key("ratio", "number", "speed of the shaft over that of `on`", required=True, range=POSITIVE, example="5"),
            Key("on", "text", "the shaft that it meshes with", "crank"),
            Key("stiffness", "angular stiffness", "of a compliant shaft: torque on it per twist", None, POSITIVE),
            Key("damping", "angular damping", "of the twist of a compliant shaft", None, NOT_NEGATIVE),
            Key("efficiency", "number", "of its mesh or belt", 1.0, Range(0.0, 1.0, low_open=True), example="95 %"),
            Key("slip", "number", "of its belt: share of speed lost", 0.0, Range(0.0, 1.0, high_open=True), example="2 %"),
            Key("drag", "torque", "constant, against the shaft's own rotation", 0.0, NOT_NEGATIVE),
            Key("clutch", "tables", "friction clutch in its mesh, which drives the crank stroke by stroke"),
        ),
        named=True,
    ),
    MECHANISM,
    Section(
        "inertia",
        "a mass or an inertia fixed on a place; it has no weight",
        (
            _ON,
            Key(
                "value", "mass | inertia", "mass on a place that translates, inertia on one that rotates", None, NOT_NEGATIVE
            ),
            GD2,
        ),
        array=True,
        either=(("value",), ("gd2",)),
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
            Key("from", "angle", "angle at which the load begins"),
            Key("to", "angle", "angle at which the load ends; the window wraps if to is less than from"),
            Key(
                "while",
                "text",
                "it acts only while its place moves in this direction, at positive crank speed",
                choices=("v > 0", "v < 0"),
            ),
            Key("every", "angle", "period of window, table and phi (default: the cycle)", None, POSITIVE),
            Key("factor", "number", "factor on force or torque", 1.0, NOT_NEGATIVE, example="60 %"),
        ),
        array=True,
        one_of=(("force", "torque", "table", "model"),),
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
                missing="the second on a place that rotates",
            ),
        ),
        array=True,
    ),
    Section(
        "gravity",
        "weight of every body that has mass; without this table bodies have no weight",
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
        either=(("torque",), ("force",), ("motor",)),
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
                "crank angle after which motion and loads repeat",
                TURN,
                Range(0.0, MOST_TURNS * TURN * (1 + 1e-9), True),
                many_turns=True,
            ),
        ),
    ),
    Section(
        "flywheel",
        "shaft of the flywheel, and either the required irregularity or its inertia",
        (
            _ON_SHAFT,
            Key("irregularity", "number", "of the speed: size the flywheel for it", None, Range(0.0, 2.0, True, True)),
            Key("inertia", "inertia", "of the given flywheel: analyse it", None, NOT_NEGATIVE),
            GD2,
            Key("limits", "tables", "limits of the motion and the motor, instead"),
        ),
        one_of=(("irregularity", "inertia", "gd2", "limits"),),
    ),
    Section(
        "duty",
        "a phase of a repeating sequence: another load, idling, or standstill",
        (
            Key("name", "text", "name used in results (default: phase 1, phase 2...)"),
            Key("duration", "time", "of the phase", None, POSITIVE),
            Key(
                "cycles",
                "number",
                "number of cycles of the machine, instead of a duration",
                None,
                POSITIVE,
                example="120",
            ),
            Key("loads", "number", "share of all loads but those of model losses", None, Range(0.0, 2.0), example="60 %"),
            Key("changes", "changes", "other values in the scene, by their paths, such as load.0.force"),
            Key("starts", "number", "number of starts from rest in the phase", None, NOT_NEGATIVE, example="1"),
            Key(
                "braking",
                "choice",
                "electric, after each of its starts",
                "none",
                choices=tuple(ELECTRIC_BRAKING),
            ),
            Key("rest", "flag", "true: the motor is off and the machine stands still"),
            Key(
                "standstill_cooling",
                "number",
                "share of the time at rest that cools the motor: 1 with a fan of its own drive",
                None,
                Range(0.0, 1.0),
                example="0.33",
            ),
        ),
        array=True,
        one_of=(("duration", "cycles"),),
    ),
    Section(
        "stroke",
        "a one-way motion of the driver, which slides or turns, instead of regime and flywheel",
        (
            Key("from", "length | angle", "driver's coordinate at the beginning", required=True),
            Key("to", "length | angle", "driver's coordinate at the end, greater than from", required=True),
            Key("speed", "velocity | speed", "constant speed of the driver, for results that depend on it"),
            Key("acceleration", "acceleration | angular acceleration", "constant acceleration of the driver", 0.0),
        ),
    ),
    Section(
        "brake",
        "a brake that stops the crank at the end of a stroke",
        (
            _ON_SHAFT,
            Key("torque", "torque", "against the shaft's rotation", None, POSITIVE, required=True),
            Key(
                "reverse_torque", "torque", "of a band brake, against a rotation backwards (default: torque)", None, POSITIVE
            ),
            Key("engage", "angle", "crank angle at which it is applied", required=True, range=_ONCE_ROUND),
            Key("release", "angle", "crank angle at which it is released: that of stop_at", range=_ONCE_ROUND),
            *_RAMPS[:1],
            Key("fall", "time", "in which its torque vanishes when a stroke begins", 0.0, NOT_NEGATIVE),
            *_HEATS,
        ),
        array=True,
    ),
    Section(
        "single_stroke",
        "work stroke by stroke: the clutch accelerates the crank, the brake stops it",
        (
            Key("rate", "rate", "strokes per unit of time", None, POSITIVE),
            Key("idle", "time", "from standstill to the next engagement of the clutch", None, NOT_NEGATIVE),
            Key("stop_at", "angle", "crank angle at which the crank should stop", 0.0, _ONCE_ROUND),
            Key("continuous", "number", "strokes in a row before the crank is stopped", 1.0, Range(1.0, 100.0), example="3"),
            Key("approach", "velocity", "of a hand, K of ISO 13855: S = K T + C", None, POSITIVE, example="2 m/s"),
            Key("response", "time", "of light curtain and control, part of T", 0.0, NOT_NEGATIVE, example="30 ms"),
            Key("inch", "time", "for which a touch engages the clutch, in setting up", None, POSITIVE, example="40 ms"),
            Key("intrusion", "length", "that a hand comes in unseen, C", 0.0, NOT_NEGATIVE, example="128 mm"),
        ),
        one_of=(("rate", "idle"),),
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
        "required accuracy of the figures",
        (
            Key("rtol", "number", "required relative error of every figure", DEFAULT_RTOL, Range(*RTOL)),
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


def _limit(name: str, about: str, example: str) -> Key:
    return Key(name, "number", about, None, Range(0.0, 10.0, low_open=True), example=example)


LIMITS = Section(
    "flywheel.limits",
    "limits that the flywheel shall keep, all of those that are given: the smallest one is sized",
    (
        Key("irregularity", "number", "of the speed", None, Range(0.0, 2.0, True, True)),
        _limit("motor_torque", "greatest torque of the motor in size, over the rated one", "150 %"),
        _limit("motor_rms", "root of the torque's mean square over time, over the rated torque", "100 %"),
        _limit("motor_heat", "mean heat of the motor over time, over that at its rated point", "100 %"),
        _limit("current_pulsation", "of the motor's current, peak to peak, over the rated one", "40 %"),
    ),
)
"""Keys of `[flywheel.limits]`, one at least."""

CLUTCH = Section(
    "shafts.NAME.clutch",
    "a friction clutch in the mesh of a shaft",
    (
        Key("torque", "torque", "of the slipping clutch, at its shaft", None, POSITIVE, required=True),
        Key("static_torque", "torque", "greatest of the locked clutch (default: torque)", None, POSITIVE),
        Key("engage", "angle", "crank angle at which it is engaged: that of stop_at", range=_ONCE_ROUND),
        Key("disengage", "angle", "crank angle at which it is released", required=True, range=_ONCE_ROUND),
        *_RAMPS,
        Key("hold", "time", "for which it holds all its torque after its release", 0.0, NOT_NEGATIVE),
        Key("fall", "time", "in which its torque then vanishes", 0.0, NOT_NEGATIVE),
        *_HEATS,
    ),
)
"""Keys of the clutch of a shaft."""

INNER = {"limits": LIMITS, "clutch": CLUTCH}
"""Tables within a table of the scene, by their names."""

TOP = (Key("title", "text", "description of the machine"), Key("source", "text", "source of its data"))
"""Keys outside any table."""

MACHINE = ("mechanism", "shafts", "inertia", "load", "spring", "damper", "drive", "flywheel", "areas")
"""Tables of which a scene has one at least: what is there without them does not move."""

AREAS_EXCLUDE = ("mechanism", "inertia", "load", "spring", "damper", "gravity", "drive")
"""Tables that a scene with `[areas]` must do without."""

STROKE_EXCLUDE = ("regime", "flywheel", "areas")
"""Tables that a scene with `[stroke]` must do without."""

SINGLE_STROKE_EXCLUDE = ("stroke", "duty", "areas")
"""Tables that a scene with `[single_stroke]` must do without."""


# The tables of a linkage

MOST_BODIES = 50
"""Greatest number of bodies, sides and ports of a linkage."""
MOST_JOINTS = 2 * MOST_BODIES
"""Greatest number of joints, and of couplings."""
MOST_POINTS = 100
"""Greatest number of points of a body."""

_POINTS = Key("points", "tables", "names of points, each with its [x, y] in the body's own frame")

FRAME_BODY = Section("mechanism.bodies.frame", "the fixed body", (_POINTS,))

LINK = Section(
    "mechanism.bodies.NAME",
    "a moving body",
    (
        _POINTS,
        MASS,
        OWN_INERTIA,
        Key("com", "list", "[x, y] of the centre of mass in the body's own frame"),
        Key("guess", "angle", "about its angle from +x where the driver stands at start"),
    ),
)

JOINT = Section(
    "mechanism.joints",
    "a joint between a point of one body and a point of another",
    (
        Key("name", "name", "name used by the driver, couplings and results", required=True),
        Key("type", "choice", "type of the joint", required=True, choices=("pin", "slide", "pin-in-slot", "fixed")),
        Key("between", "list", 'two points, such as ["frame.O", "crank.O"]', required=True),
        Key("direction", "angle", "of the guide, in the first body's own frame", 0.0),
        Key("angle", "angle", "of the second body against the first", 0.0),
        Key("guess", "length", "about its coordinate where the driver stands at start"),
        Key("friction", "number", "Coulomb's coefficient", 0.0, NOT_NEGATIVE),
        Key("radius", "length", "of the pin", 0.0, NOT_NEGATIVE),
        Key("length", "length", "of the shoe along the guide", 0.0, NOT_NEGATIVE),
    ),
    array=True,
)

JOINT_KEYS = {
    "pin": ("friction", "radius"),
    "slide": ("direction", "angle", "guess", "friction", "length"),
    "pin-in-slot": ("direction", "guess", "friction"),
    "fixed": ("angle",),
}
"""Beside `name`, `type` and `between`."""

COUPLING = Section(
    "mechanism.couplings",
    "a relation between the coordinates of two joints",
    (
        Key("type", "choice", "type of the coupling", required=True, choices=("gear", "rolling", "cam")),
        Key("between", "list", 'two joints, such as ["O", "P"]', required=True),
        Key("name", "name", 'name used in results (default: its joints, such as "O-P")'),
        Key("ratio", "length | number", "coordinate of the second joint per coordinate of the first"),
        Key("teeth", "list", "numbers of teeth of the two wheels, instead of a ratio"),
        Key("internal", "flag", "true where one wheel has its teeth inside; with teeth"),
        Key("phase", "length | angle", "coordinate of the second joint where that of the first is 0", 0.0),
        Key("pressure_angle", "angle", "of the teeth", 0.0),
        Key("lift", "position", "coordinate of the follower: an expression of phi, the cam's angle"),
        Key("table", "table", "coordinate of the follower against the cam's angle"),
        Key("contact", "text", "point of the follower through which the cam pushes, such as its roller's centre"),
        Key("friction", "number", "Coulomb's coefficient between cam and follower", 0.0, NOT_NEGATIVE),
    ),
    array=True,
)

COUPLING_KEYS = {
    "gear": ("ratio", "teeth", "internal", "phase", "pressure_angle"),
    "rolling": ("ratio", "phase", "pressure_angle"),
    "cam": ("lift", "table", "contact", "friction"),
}
"""Beside `type`, `between` and `name`."""
COUPLING_ONE_OF = {"gear": (("ratio", "teeth"),), "rolling": (), "cam": (("lift", "table"),)}

SIDE = Section(
    "mechanism.assembly",
    "a choice of assembly: where the driver stands at start, a point lies on one side of a line",
    (
        Key("point", "text", "the point", required=True),
        Key("side", "choice", "of the line, looking along it", required=True, choices=("left", "right")),
        Key("from", "text", "the point at which the line begins", required=True),
        Key("to", "text", "the point at which it ends", required=True),
    ),
    array=True,
)

POINT_PORT = Section(
    "mechanism.ports.NAME",
    "a port where a point of a body moves along a fixed direction",
    (
        Key("point", "text", "the point", required=True),
        Key("direction", "angle", "positive sense of the port, from +x", 0.0),
    ),
)

LINKAGE_SECTIONS = (FRAME_BODY, LINK, JOINT, COUPLING, SIDE, POINT_PORT)


def keys_for(section: Section, own: tuple[str, ...] | None) -> tuple[Key, ...]:
    """The keys of one type of joint or coupling; those of all types if it is unknown.

    >>> [key.name for key in keys_for(JOINT, JOINT_KEYS["fixed"])]
    ['name', 'type', 'between', 'angle']
    """
    return tuple(key for key in section.keys if own is None or key.name in ("name", "type", "between", *own))


# The keys of a wheel


def _size(name: str, about: str) -> Key:
    return Key(name, "length", about, None, POSITIVE)


def _number(name: str, about: str, example: str, values: Range = POSITIVE) -> Key:
    return Key(name, "number", about, None, values, example=example)


_SHARE = Range(0.0, 1.0, low_open=True)
MATERIAL_KEYS = (
    Key("material", "choice", "of the table", choices=tuple(MATERIALS)),
    Key("density", "density", "in place of the table's", None, POSITIVE),
    Key("allowable_stress", "pressure", "in place of the table's", None, POSITIVE),
    Key("strength", "pressure", "tensile or yield strength, in place of the table's", None, POSITIVE),
    _number("safety", "strength over allowable stress, in place of the table's", "4"),
    _number("poisson", "Poisson's ratio, in place of the table's", "0.3", Range(0.0, 0.5)),
)
WHEEL_KEYS = (
    Key("shape", "choice", "of the wheel", choices=WHEEL_SHAPES),
    *MATERIAL_KEYS,
    Key("method", "choice", "of inertia and stress: an annulus, or a rim at its mean radius", choices=METHODS),
    Key("at", "choice", "speed of the shaft at which stresses and rim speeds are taken", choices=SPEEDS),
    _size("outer_radius", "of the wheel"),
    _size("mean_radius", "of the rim"),
    _size("max_radius", "greatest outer radius"),
    Key("rim_speed", "velocity", "of the outer radius (of the mean one with method thin)", None, POSITIVE),
    _size("width", "of rim or disc, along the axis"),
    _size("thickness", "of the rim, along the radius"),
    _number("width_to_thickness", "of the rim", "2"),
    _number("rim_share", "of the inertia, where hub and arms have the rest", "0.9", _SHARE),
    _number("arms", "number of arms", "6", Range(FEWEST, MOST)),
    _number("arm_share", "section of one arm, as a share of the rim's", "0.25"),
    _size("arm_width", "of an arm's elliptical section, in the plane of rotation"),
    _size("arm_thickness", "of an arm's elliptical section, along the axis"),
    Key("bore", "length", "diameter of the hole for the shaft", None, NOT_NEGATIVE),
    _size("hub_diameter", "where the arms meet it"),
    _size("hub_length", "along the axis"),
    Key("torque", "torque", "the greatest between hub and rim, which bends the arms", None, NOT_NEGATIVE),
    Key("step", "inertia", "the inertia is rounded up to a multiple of it", None, POSITIVE),
    _size("size_step", "dimensions are rounded to a multiple of it"),
)
