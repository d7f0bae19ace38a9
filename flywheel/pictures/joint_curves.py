"""Reactions of joints as data: the figures and the rows that the pictures of forces and the live page draw alike.

A pin, slot, fixed joint or coupling is a row of the kind "plane", the tip of its force in the frame's axes; a slide is its
normal forces over the driver, and its moment in a row of its own with the same key; so is each driving action.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from flywheel.language import text as _
from flywheel.pictures import written
from flywheel.pictures.forms import Curve, Row, extremes, peak, place_of, scaled
from flywheel.scene.linkage import PIN, SLIDE, Linkage
from flywheel.scene.scene import TURN

if TYPE_CHECKING:  # the door of linkages
    from flywheel.mechanisms.linkages.reactions import Reactions

Array = NDArray[np.float64]

_STEP = 30.0  # deg between two marks
_ALONG = 11  # marks along a stroke
_SHORT = 90.0  # deg: a shorter way has as many
_NEGLIGIBLE = 1e-9  # of the largest force: a smaller moment (N m) is not drawn
_JUMP, _STEEPER = 0.02, 8.0  # of the largest force, times as steep as the steps beside it: such a step is a jump
_AT_ONCE = 1e-3  # of the median step, of the largest force: a larger change over a shorter way is a jump
_SIDES = {"normal": ("blue", "-"), "front": ("vermillion", "--"), "rear": ("green", "-.")}


def figures_of(found: Reactions, shown: Array, joints: Iterable[str] | None = None) -> dict[str, Any]:
    """Forces of joints (all if None) and driving actions at positions `shown`, with their extremes."""
    linkage = found.poses.linkage
    kinds = {joint.name: (joint.kind, joint.first, joint.second) for joint in linkage.joints}
    forces = []
    for name in found.forces if joints is None else joints:
        kind, first, second = kinds.get(name, ("coupling", "", ""))
        x, y = (_ended(values, shown.size) for values in found.forces[name])
        at, force = parted(shown, np.stack((x, y)))
        one: dict[str, Any] = {"name": name, "kind": kind, "first": first, "second": second, "x": x, "y": y}
        if kind == SLIDE:
            parts = {part: _ended(values, shown.size) for part, values in found.components[name].items()}
            one |= {part: parts[part] for part in (*_SIDES, "moment") if part in parts}
            at, force = parted(shown, np.stack([parts[part] for part in _SIDES if part in parts]))
        if kind == "coupling" and "moment" in found.components[name]:  # a belt's couple, without a force
            one["moment"] = _ended(found.components[name]["moment"], shown.size)
        one["largest"] = peak(at, np.abs(force).max(axis=0) if kind == SLIDE else np.hypot(*force), 1.0)
        forces.append(one)
    driving = []
    for name, action in found.actions.items():
        values = _ended(action, shown.size)
        at, (cut,) = parted(shown, values)
        unit = "N m" if linkage.joint(name).kind == PIN else "N"
        driving.append({"name": name, "unit": unit, "values": values, **extremes(at, cut)})
    return {"joints": forces, "driving": driving}


def rows(figures: Mapping[str, Any], linkage: Linkage, shown: Array, *, cyclic: bool = False) -> Iterator[Row]:
    """The rows of those figures; `cyclic`: the positions are those of a whole cycle, whose ends may differ by a jump."""
    for k, joint in enumerate(figures["joints"]):
        key, title, largest = f"joints.{k}", heading_of(linkage, joint["name"]), joint["largest"]
        is_belt = joint["kind"] == "coupling" and "moment" in joint
        if largest is None or (is_belt and not np.isfinite(np.diff(joint["moment"])).any()):
            about = _("Unknown: redundant constraints, or friction locks.")
            yield Row(key, title, _("force"), "N", about, ())
            continue
        if is_belt:
            yield _moment(key, title, joint["moment"], shown)
            continue
        factor, unit = scaled("N", largest["value"])
        about = _(
            "at most {force} {unit}, at {place}",
            force=written(factor * largest["value"], 4),
            unit=unit,
            place=place_of(linkage.sliding, largest["at"]),
        )
        if joint["kind"] != SLIDE:
            values = np.stack((joint["x"], joint["y"]))
            curves: tuple[Curve, ...] = Curve(f"{key}.x", "Fx", "blue", "-", 1.6), Curve(f"{key}.y", "Fy", "blue", "-", 1.6)
            along, jumps = marks(shown, values, linkage.sliding), breaks(shown, values, cyclic=cyclic)
            row = Row(key, title, "F", unit, about, curves, factor=factor, si="N", kind="plane")
            yield row._replace(along=along, breaks=jumps)
            continue
        words = {"normal": _("normal"), "front": _("front"), "rear": _("rear")}
        sides = [part for part in _SIDES if part in joint]
        curves = tuple(Curve(f"{key}.{part}", words[part], *_SIDES[part], 1.6) for part in sides)
        values = np.stack([joint[part] for part in sides])
        row = Row(key, title, _("normal force"), unit, about, curves, factor=factor, si="N", zero=True)
        yield row._replace(breaks=breaks(shown, values))
        moment = joint.get("moment")
        if moment is not None and float(np.nanmax(np.abs(moment), initial=0.0)) > _NEGLIGIBLE * largest["value"]:
            yield _moment(key, title, moment, shown)
    for k, drive in enumerate(figures["driving"]):
        yield _driving(k, drive, shown)


def _moment(key: str, title: str, moment: Array, shown: Array) -> Row:
    """The row of a moment in a slide, or of a belt's couple."""
    least, most = (written(float(value), 4) for value in (np.nanmin(moment), np.nanmax(moment)))
    about = _("from {least} to {most} {unit}", least=least, most=most, unit="N m")
    curve = Curve(f"{key}.moment", _("moment"), "purple", ":", 1.6)
    row = Row(key, title, _("moment"), "N m", about, (curve,), si="N m", zero=True)
    return row._replace(breaks=breaks(shown, moment))


def _driving(k: int, drive: Mapping[str, Any], shown: Array) -> Row:
    """The row of a driving torque or force."""
    name, title = _("driving torque"), _("driving torque at {joint}", joint=drive["name"])
    if drive["unit"] == "N":
        name, title = _("driving force"), _("driving force at {joint}", joint=drive["name"])
    if drive["least"] is None:
        return Row(f"driving.{k}", title, name, drive["unit"], _("Unknown: friction locks everywhere."), ())
    low, high = drive["least"]["value"], drive["greatest"]["value"]
    factor, unit = scaled(drive["unit"], max(-low, high))
    about = _("from {least} to {most} {unit}", least=written(factor * low, 4), most=written(factor * high, 4), unit=unit)
    curves = (Curve(f"driving.{k}.values", name, "green", "-", 1.6),)
    row = Row(f"driving.{k}", title, name, unit, about, curves, factor=factor, si=drive["unit"], zero=True)
    return row._replace(breaks=breaks(shown, drive["values"]))


def heading_of(linkage: Linkage, name: str) -> str:
    """A joint's name with the bodies between which its force acts: "slider_pin: rod on slider"."""
    for joint in linkage.joints:
        if joint.name == name:
            return _("{joint}: {first} on {second}", joint=name, first=joint.first, second=joint.second)
    return name


def marks(shown: Array, values: Array, sliding: bool) -> tuple[float, ...]:
    """Positions (rad or m) at which a hodograph (2, n) is marked: every 30 deg, more where several turns crowd.

    Along a short way, or a slide's, they are even. A curve that ends where it begins is marked there once; where the force
    is not known, not at all.
    """
    low, high = float(shown.min()), float(shown.max())
    if sliding or np.degrees(high - low) < _SHORT:
        places = np.linspace(low, high, _ALONG)
    else:
        step = np.radians(_STEP) * max(ceil((high - low) / TURN - 1e-9), 1)
        places = step * np.arange(ceil(low / step - 1e-9), int(high / step + 1e-9) + 1)
    spots = np.stack([np.interp(places, shown, part) for part in values])
    known = np.isfinite(spots).all(axis=0)
    places, spots = places[known], spots[:, known]
    if not sliding and places.size > 1:
        turns = (places[-1] - places[0]) / TURN
        if turns > 0.5 and abs(turns - round(turns)) < 1e-9 and np.allclose(spots[:, 0], spots[:, -1]):
            places = places[:-1]
    return tuple(map(float, places))


def parted(x: Array, values: Array) -> tuple[Array, Array]:
    """X and a curve (m, n) over it, both with NaN if the curve jumps."""
    values = np.atleast_2d(values)
    at = [k for k in breaks(x, values) if k]
    return np.insert(x, at, np.nan), np.insert(values, at, np.nan, axis=1)


def _ended(values: Array, size: int) -> Array:
    """Values with the first one again at the end, if there is to be one more."""
    return values if values.shape[-1] == size else np.concatenate((values, values[..., :1]), axis=-1)


def breaks(x: Array, values: Array, *, cyclic: bool = False) -> tuple[int, ...]:
    """The samples before which a curve (m, n) over x jumps: 0 if a cycle's ends differ.

    A jump is a step at one place, or one that is far steeper than those beside it and no small part of the whole.
    """
    values = np.atleast_2d(values)
    steps, ways = np.hypot.reduce(np.abs(np.diff(values, axis=1)), axis=0), np.abs(np.diff(x))
    whole = float(np.nanmax(np.abs(values), initial=0.0))
    at_once = (ways <= _AT_ONCE * np.median(ways)) & (steps > _AT_ONCE * whole)
    steep = steps / np.maximum(ways, 1e-6 * np.median(ways))
    beside = np.fmax(np.concatenate(([0.0], steep[:-1])), np.concatenate((steep[1:], [0.0])))
    found = np.flatnonzero(at_once | ((steep > _STEEPER * beside) & (steps > _JUMP * whole))) + 1
    opened = cyclic and bool(np.hypot.reduce(values[:, -1] - values[:, 0]) > _JUMP * whole)
    return (*((0,) if opened else ()), *map(int, found))
