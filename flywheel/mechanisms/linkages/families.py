"""The named mechanisms as linkages: the same bodies, centres of mass and assembly, with every joint spelled out.

A joint bears the name of its point in both bodies; its first body is the one nearer to the driver, or the frame.

| type | bodies | joints, the driver first |
| --- | --- | --- |
| scotch-yoke | crank, block, yoke | pivot, crank_pin, slot (slide), guide (slide) |
| slider-crank | crank, rod, slider | pivot, crank_pin, slider_pin, guide (slide) |
| four-bar | crank, coupler, rocker | pivot, crank_pin, rocker_pin, rocker_pivot |
| crank-shaper | crank, block, rocker, rocker_pin, ram | pivot, crank_pin, rocker_slot (slide), rocker_pivot, end_pin, ram_slot (slide), guide (slide) |
| toggle-clamp | block, coupler, bell_crank, rod, platen | block_guide (slide), block_pin, coupler_pin, pivot, rod_pin, platen_pin, platen_guide (slide) |

A body's own x axis is the line whose angle the mechanism's port gives; that of a body without one is +x of the frame,
and of the shaper's block the rocker's line. The frame's origin is the crank's pivot, or the rocker's in a shaper.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, pi, sin
from typing import Any

import numpy as np

from flywheel.mechanisms import families
from flywheel.numerics.faults import Fault, SceneError
from flywheel.scene.linkage import FRAME, PIN, SLIDE, Joint, Link, Linkage, Point, Side
from flywheel.scene.scene import Body, Mechanism

HERE = (0.0, 0.0)


def linkage_of(mechanism: Mechanism) -> Linkage:
    """A named mechanism as a linkage, driven by the same coordinate: its crank's angle (rad) or its block's slide (m).

    Args:
        mechanism: of any type but `law`; that of a mechanism of type `linkage` is given back as it is.

    Raises:
        SceneError: for a law, which has no bodies to join; for lengths with which the mechanism locks.

    >>> lengths = {"crank.length": 0.1, "rod.length": 0.3}
    >>> linkage = linkage_of(Mechanism("slider-crank", "press", geometry=lengths))
    >>> linkage.names, linkage.driver
    (('frame', 'crank', 'rod', 'slider'), 'pivot')
    >>> [joint.name for joint in linkage.joints]
    ['pivot', 'crank_pin', 'slider_pin', 'guide']

    """
    if mechanism.linkage is not None:
        return mechanism.linkage
    if mechanism.type not in _MAKERS:
        advice = "write it as a linkage to have joints"
        found, expected = f"a mechanism of type {mechanism.type}", "one of " + ", ".join(_MAKERS)
        raise SceneError([Fault(f"{mechanism.path}.type", found, expected, advice)])
    start = mechanism.stroke[0] if mechanism.stroke is not None else 0.0
    position = families.build(mechanism).position(np.float64(start), np)
    links, joints, sides = _MAKERS[mechanism.type](mechanism, position)
    ground, *moving = links
    return Linkage(ground, tuple(moving), joints, joints[0].name, sides=sides, start=float(start), path=mechanism.path)


Made = tuple[tuple[Link, ...], tuple[Joint, ...], tuple[Side, ...]]
Places = Mapping[str, tuple[float, float]]


def _link(mechanism: Mechanism, name: str, places: Places, guess: Any = None, tilt: float = 0.0) -> Link:
    """Body with a point for each joint; its centre of mass counts from a line `tilt` (rad) from its own x axis."""
    body = mechanism.bodies.get(name, Body())
    towards = body.com_angle + tilt
    com = float(body.com * cos(towards)), float(body.com * sin(towards))
    points = tuple(Point(at, float(x), float(y)) for at, (x, y) in places.items())
    return Link(name, points, float(body.mass), float(body.inertia), com, None if guess is None else float(guess))


def _ground(**places: tuple[float, float]) -> Link:
    return Link(FRAME, tuple(Point(at, float(x), float(y)) for at, (x, y) in places.items()))


def _pin(name: str, first: Link, second: Link) -> Joint:
    return Joint(name, PIN, first.name, second.name, first.point(name), second.point(name))


def _slide(name: str, first: Link, second: Link, direction: float = 0.0, guess: Any = None) -> Joint:
    at = first.point(name), second.point(name)
    return Joint(name, SLIDE, first.name, second.name, *at, float(direction), guess=None if guess is None else float(guess))


def _scotch_yoke(mechanism: Mechanism, position: Any) -> Made:
    """The yoke's own origin, in its slot, moves along `yoke.direction` through the pivot."""
    radius, direction = mechanism.geometry["crank.length"], mechanism.geometry.get("yoke.direction", 0.0)
    ground = _ground(pivot=HERE, guide=HERE)
    crank = _link(mechanism, "crank", {"pivot": HERE, "crank_pin": (radius, 0.0)})
    block = _link(mechanism, "block", {"crank_pin": HERE, "slot": HERE})
    yoke = _link(mechanism, "yoke", {"guide": HERE, "slot": HERE})
    across = radius * sin(position.psi - direction)
    joints = (
        _pin("pivot", ground, crank),
        _pin("crank_pin", crank, block),
        _slide("slot", yoke, block, direction + pi / 2, across),
        _slide("guide", ground, yoke, direction, position.yoke),
    )
    return (ground, crank, block, yoke), joints, ()


def _slider_crank(mechanism: Mechanism, position: Any) -> Made:
    geometry = mechanism.geometry
    ground = _ground(pivot=HERE, guide=(0.0, geometry.get("slider.offset", 0.0)))
    crank = _link(mechanism, "crank", {"pivot": HERE, "crank_pin": (geometry["crank.length"], 0.0)})
    rod = _link(mechanism, "rod", {"crank_pin": HERE, "slider_pin": (geometry["rod.length"], 0.0)}, position.rod)
    slider = _link(mechanism, "slider", {"slider_pin": HERE, "guide": HERE})
    joints = (
        _pin("pivot", ground, crank),
        _pin("crank_pin", crank, rod),
        _pin("slider_pin", rod, slider),
        _slide("guide", ground, slider, guess=position.slider),
    )
    return (ground, crank, rod, slider), joints, ()


def _four_bar(mechanism: Mechanism, position: Any) -> Made:
    lengths = {bar: mechanism.geometry[f"{bar}.length"] for bar in ("ground", "crank", "coupler", "rocker")}
    ground = _ground(pivot=HERE, rocker_pivot=(lengths["ground"], 0.0))
    crank = _link(mechanism, "crank", {"pivot": HERE, "crank_pin": (lengths["crank"], 0.0)})
    ends: Places = {"crank_pin": HERE, "rocker_pin": (lengths["coupler"], 0.0)}
    coupler = _link(mechanism, "coupler", ends, position.coupler)
    ends = {"rocker_pivot": HERE, "rocker_pin": (lengths["rocker"], 0.0)}
    rocker = _link(mechanism, "rocker", ends, position.rocker)
    joints = (
        _pin("pivot", ground, crank),
        _pin("crank_pin", crank, coupler),
        _pin("rocker_pin", coupler, rocker),
        _pin("rocker_pivot", ground, rocker),
    )
    sense = -1 if mechanism.assembly == "crossed" else 1
    side = Side(("coupler", "rocker_pin"), ("crank", "crank_pin"), (FRAME, "rocker_pivot"), sense)
    return (ground, crank, coupler, rocker), joints, (side,)


def _crank_shaper(mechanism: Mechanism, position: Any) -> Made:
    """The block slides on the rocker; the pin at the rocker's end slides across the ram in a slot of it."""
    geometry = mechanism.geometry
    ground = _ground(pivot=(geometry["frame.length"], 0.0), rocker_pivot=HERE, guide=HERE)
    crank = _link(mechanism, "crank", {"pivot": HERE, "crank_pin": (geometry["crank.length"], 0.0)})
    block = _link(mechanism, "block", {"crank_pin": HERE, "rocker_slot": HERE}, position.rocker)
    ends: Places = {"rocker_pivot": HERE, "rocker_slot": HERE, "end_pin": (geometry["rocker.length"], 0.0)}
    rocker = _link(mechanism, "rocker", ends, position.rocker)
    end = _link(mechanism, "rocker_pin", {"end_pin": HERE, "ram_slot": HERE})
    ram = _link(mechanism, "ram", {"ram_slot": HERE, "guide": HERE})
    joints = (
        _pin("pivot", ground, crank),
        _pin("crank_pin", crank, block),
        _slide("rocker_slot", rocker, block, guess=position.distance),
        _pin("rocker_pivot", ground, rocker),
        _pin("end_pin", rocker, end),
        _slide("ram_slot", ram, end, guess=geometry["rocker.length"] * position.rocker_cos),
        _slide("guide", ground, ram, pi / 2, position.ram),
    )
    return (ground, crank, block, rocker, end, ram), joints, ()


def _toggle_clamp(mechanism: Mechanism, position: Any) -> Made:
    geometry, tilt = mechanism.geometry, mechanism.geometry["bell_crank.angle"] + pi
    ground = _ground(pivot=HERE, block_guide=(0.0, geometry["frame.height"]), platen_guide=HERE)
    block = _link(mechanism, "block", {"block_guide": HERE, "block_pin": HERE})
    ends: Places = {"coupler_pin": HERE, "block_pin": (geometry["coupler.length"], 0.0)}
    coupler = _link(mechanism, "coupler", ends, position.coupler)
    length = geometry["bell_crank.clamp_length"]
    ends = {
        "pivot": HERE,
        "coupler_pin": (geometry["bell_crank.drive_length"], 0.0),
        "rod_pin": (length * cos(tilt), length * sin(tilt)),
    }
    bell_crank = _link(mechanism, "bell_crank", ends, position.bell_crank, tilt)
    rod = _link(mechanism, "rod", {"rod_pin": HERE, "platen_pin": (geometry["rod.length"], 0.0)}, position.rod)
    platen = _link(mechanism, "platen", {"platen_pin": HERE, "platen_guide": HERE})
    joints = (
        _slide("block_guide", ground, block, pi),
        _pin("block_pin", block, coupler),
        _pin("coupler_pin", coupler, bell_crank),
        _pin("pivot", ground, bell_crank),
        _pin("rod_pin", bell_crank, rod),
        _pin("platen_pin", rod, platen),
        _slide("platen_guide", ground, platen, guess=position.platen),
    )
    sense = -1 if mechanism.assembly.startswith("crossed") else 1
    side = Side(("bell_crank", "coupler_pin"), (FRAME, "pivot"), ("block", "block_pin"), sense)
    return (ground, block, coupler, bell_crank, rod, platen), joints, (side,)


_MAKERS = {
    "scotch-yoke": _scotch_yoke,
    "slider-crank": _slider_crank,
    "four-bar": _four_bar,
    "crank-shaper": _crank_shaper,
    "toggle-clamp": _toggle_clamp,
}
