"""The tables of a `linkage`: bodies, joints, couplings, assembly, ports; which joint and coupling takes which keys."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flywheel.reading.schema import MASS, NOT_NEGATIVE, OWN_INERTIA, Key, Section

MOST_BODIES = 50
"""How many bodies, sides and ports a linkage may have."""
MOST_JOINTS = 2 * MOST_BODIES
"""How many joints, and how many couplings."""
MOST_POINTS = 100
"""How many points a body may have."""

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
        Key("name", "name", "what the driver, couplings and results call it", required=True),
        Key(
            "type",
            "choice",
            "what it leaves free",
            required=True,
            choices=("pin", "slide", "pin-in-slot", "fixed"),
        ),
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
        Key("type", "choice", "what couples them", required=True, choices=("gear", "rolling", "cam")),
        Key("between", "list", 'two joints, such as ["O", "P"]', required=True),
        Key("name", "name", 'what results call it (default: its joints, such as "O-P")'),
        Key("ratio", "number | length", "coordinate of the second joint per coordinate of the first"),
        Key("teeth", "list", "numbers of teeth of the two wheels, instead of a ratio"),
        Key("internal", "flag", "true where one wheel has its teeth inside; with teeth"),
        Key("phase", "angle | length", "coordinate of the second joint where that of the first is 0", 0.0),
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


def misplaced(raw: Mapping[str, Any], kind: str, by_kind: Mapping[str, tuple[str, ...]]) -> dict[str, str]:
    """Keys that one type does not take but others do, with the types that take them; none where the type is not known.

    >>> misplaced({"name": "A", "direction": 0}, "pin", JOINT_KEYS)
    {'direction': 'slide, pin-in-slot'}
    """
    if kind not in by_kind:
        return {}
    owners = {name: ", ".join(other for other, keys in by_kind.items() if name in keys) for name in raw}
    return {name: types for name, types in owners.items() if types and name not in by_kind[kind]}


def keys_for(section: Section, own: tuple[str, ...] | None) -> tuple[Key, ...]:
    """The keys that one type of joint or coupling takes; those of all types where it is not known.

    >>> [key.name for key in keys_for(JOINT, JOINT_KEYS["fixed"])]
    ['name', 'type', 'between', 'angle']
    """
    return tuple(key for key in section.keys if own is None or key.name in ("name", "type", "between", *own))
