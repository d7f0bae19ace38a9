"""Loads, springs, added inertias and the drive of a scene: where they act, when, and by what law."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from flywheel.numerics.expressions import Expression, Node, expression_of, numeral
from flywheel.numerics.faults import quote, show, told
from flywheel.reading.fields import (
    TOLERANCE,
    Faults,
    Item,
    Place,
    Places,
    Setting,
    as_table,
    child,
    default_period,
    exactly_one,
    expectation,
    read_fields,
    read_item,
    whole,
)
from flywheel.reading.schema import CLUTCH, MOST_TABLES, MOST_TURNS, SECTIONS, SINGLE_STROKE_EXCLUDE, Section
from flywheel.reading.tables import fit_period, fit_stroke, fit_window, read_effort, read_table
from flywheel.scene.scene import Brake, Clutch, Damper, Inertia, Law, Load, SingleStroke, Spring, Table

if TYPE_CHECKING:
    from flywheel.components.motors import Motor

_SAME_ANGLE = 1e-12  # share of a period within which two angles are one
_ROUNDED = 1e-15  # share of a period by which rounding alone may miss its seam


Window = tuple[float, float] | None
"""Window of a load: from an angle to another (rad; m along a stroke); None: always."""
UNREAD = (math.nan, math.nan)
"""The window of a load whose window could not be read."""


def _listed(raw: object, section: Section, places: Places, setting: Setting) -> Iterator[tuple[Item, Place | None]]:
    """The tables of an array, `load[0]`, `load[1]`..., as read, each with its place; a lone table is a fault, but read."""
    name, faults = section.name, setting.faults
    if isinstance(raw, Mapping):
        faults.add(name, "a table", "an array of tables", f"write [[{name}]]")
        raw = [raw]
    if raw is not None and not isinstance(raw, (list, tuple)):
        faults.add(name, show(raw), "an array of tables", f"write [[{name}]]")
    elif raw is not None and len(raw) > MOST_TABLES:
        faults.add(name, f"{len(raw)} tables", f"at most {MOST_TABLES}")
    else:
        for i, each in enumerate(raw or ()):
            path = f"{name}[{i}]"
            table = as_table(each, path, faults)
            if table is not None:
                place = places.find(table.get("on"), f"{path}.on", faults)
                yield read_item(table, section, path, faults, None if place is None else place.rotating), place


def read_inertias(raw: object, places: Places, setting: Setting) -> tuple[Inertia, ...]:
    """Masses and inertias fixed on places, given as such or as GD²."""
    found = []
    for item, place in _listed(raw, SECTIONS["inertia"], places, setting):
        given = item.given("value", "gd2")
        if not given:
            item.add("value", "nothing", "a mass or an inertia, or gd2")
        elif len(given) > 1:
            exactly_one(given, ("value", "gd2"), item.path, item.faults)
        elif given == ["gd2"] and place is not None and not place.rotating:
            item.add("gd2", f'a GD² on "{place.name}", which translates', "a mass, in value")
        value = item.fields["gd2" if "gd2" in given else "value"]
        if place is not None and value is not None:
            found.append(Inertia(place.name, value, item.path))
    return tuple(found)


def read_springs(raw: object, places: Places, setting: Setting) -> tuple[Spring, ...]:
    """Springs to the frame; they hang only on places that come back."""
    found = []
    for item, place in _listed(raw, SECTIONS["spring"], places, setting):
        stiffness, rest = item.fields["stiffness"], item.fields["rest"]
        if place is not None and not place.returns:
            item.add("on", show(item.raw["on"]), "a place that comes back to where it was each cycle")
        elif place is not None and stiffness is not None and rest is not None:
            found.append(Spring(place.name, stiffness, rest, item.path))
    return tuple(found)


def read_dampers(raw: object, places: Places, setting: Setting) -> tuple[Damper, ...]:
    """Dampers to the frame."""
    found = []
    for item, place in _listed(raw, SECTIONS["damper"], places, setting):
        if place is not None and item.fields["coefficient"] is not None:
            found.append(Damper(place.name, item.fields["coefficient"], item.path))
    return tuple(found)


def read_loads(raw: object, places: Places, setting: Setting) -> tuple[Load, ...]:
    """Every load that could be read."""
    section = SECTIONS["load"]
    if setting.sliding:  # windows are stretches of the slide's way
        keys = tuple(key._replace(kind="length") if key.kind == "angle" else key for key in section.keys)
        section = section._replace(keys=keys)
    found = (_load(item, place, places, setting) for item, place in _listed(raw, section, places, setting))
    return tuple(load for load in found if load is not None)


def read_shaft_drag(drags: Mapping[str, float], setting: Setting) -> tuple[Load, ...]:
    """The constant torques (N m) against the rotation of shafts, by their names."""
    if setting.cycle is None:
        return ()
    once, every = setting.stroke is not None, setting.cycle
    return tuple(
        Load(name, -drag, every, path=f"{child('shafts', name)}.drag", once=once, drag=True) for name, drag in drags.items()
    )


def read_single_stroke(raw: Mapping[str, Any], places: Places, setting: Setting) -> SingleStroke | None:
    """Clutch, brake and rate of a machine that works stroke by stroke; None where it does not, or after faults."""
    faults, clutches = setting.faults, _clutches(raw, setting.faults)
    brakes = list(_listed(raw.get("brake"), SECTIONS["brake"], places, setting))
    if "single_stroke" not in raw:
        advice = "give rate or idle there, or leave it out"
        for path in (*(f"{item.path}" for item in clutches.values()), *(item.path for item, _ in brakes)):
            faults.add(path, "nothing to engage it", "a table [single_stroke]", advice)
        return None
    for name in SINGLE_STROKE_EXCLUDE:
        if name in raw:
            advice = {"stroke": "[stroke] is a driver that goes one way"}.get(name, "")
            faults.add(name, f"{name} beside [single_stroke]", "one of the two", advice)
    table = as_table(raw["single_stroke"], "single_stroke", faults)
    plan = None if table is None else read_item(table, SECTIONS["single_stroke"], "single_stroke", faults)
    if len(clutches) != 1:
        found = f"{len(clutches)} clutches" if clutches else "no clutch"
        faults.add("shafts", found, "one", 'write clutch = {torque = "900 N m", disengage = "330 deg"} in a shaft\'s table')
    if len(brakes) != 1:
        faults.add("brake", f"{len(brakes)} brakes" if brakes else "nothing", "one table [[brake]]")
    if plan is None or len(clutches) != 1 or len(brakes) != 1:
        return None
    (on, clutch), (brake, at) = next(iter(clutches.items())), brakes[0]
    shaft = places.shaft(brake.fields["on"], f"{brake.path}.on", faults)
    if at is not None and at.name not in places.shafts:
        brake.add("on", quote(at.name), "a shaft")
    stop_at, count = plan.fields["stop_at"], whole(plan.fields["continuous"] or 1.0)
    if count is None or abs(count - (plan.fields["continuous"] or 1.0)) > 0.0:
        plan.add("continuous", show(plan.raw["continuous"]), "a whole number of strokes")
    for item, key in ((clutch, "engage"), (brake, "release")):
        angle = item.fields[key]
        if angle is not None and stop_at is not None and abs(math.remainder(angle - stop_at, 2 * math.pi)) > TOLERANCE:
            found = f"{math.degrees(angle):.6g} deg, and stop_at at {math.degrees(stop_at):.6g} deg"
            item.add(key, found, "the same angle", "a stroke begins where the crank was stopped: leave it out")
    if not (plan.clean and clutch.clean and brake.clean):
        return None
    torque = clutch.fields["torque"]
    shared = ("rise", "fall", "heat_per_stroke", "heat_per_hour")
    static = torque if clutch.fields["static_torque"] is None else clutch.fields["static_torque"]
    return SingleStroke(
        Clutch(on, torque, clutch.fields["disengage"], static, *(clutch.fields[name] for name in shared)),
        Brake(shaft, brake.fields["torque"], brake.fields["engage"], *(brake.fields[name] for name in shared)),
        plan.fields["rate"],
        plan.fields["idle"],
        stop_at,
        count or 1,
    )


def _clutches(raw: Mapping[str, Any], faults: Faults) -> dict[str, Item]:
    """The clutches of shafts by the names of these."""
    shafts, found = raw.get("shafts"), dict[str, Item]()
    for name, shaft in shafts.items() if isinstance(shafts, Mapping) else ():
        if isinstance(shaft, Mapping) and "clutch" in shaft:
            path = f"{child('shafts', name)}.clutch"
            table = as_table(shaft["clutch"], path, faults)
            if name == "crank":
                faults.add(path, "a clutch on the crank", "one on the shaft that drives it", "name that shaft")
            if table is not None:
                found[name] = read_item(table, CLUTCH, path, faults)
    return found


def _load(item: Item, place: Place | None, places: Places, setting: Setting) -> Load | None:
    """One load; None where it could not be read."""
    fields, path, faults, stroke = item.fields, item.path, item.faults, setting.stroke
    if stroke is not None:
        item.without(["every"], "beside [stroke]", "nothing repeats along a stroke")
    every = setting.cycle if stroke is not None else _every(fields["every"], place, path, setting)
    window = _window(item, every, setting)
    text, senses = fields["while"], {"": 0, "v>0": 1, "v<0": -1}
    sense = senses.get(re.sub(r"\s", "", (text or "")[:100]))
    if sense is None or (text is not None and not sense):
        item.add("while", show(text), '"v > 0" or "v < 0"')
    law, model, piston = _law(item, place, places, (window, every), setting)
    if fields["bore"] is not None:
        if "model" in item.raw:
            item.add("bore", "a bore beside a model", "none", "an indicator diagram has a bore of its own")
        elif place is not None and (place.rotating or place.name in places.shafts):
            item.add("bore", f'a bore on "{place.name}"', "a port that translates, as a piston does")
        from flywheel.components.gas_forces import piston_area  # only cylinders have a bore

        piston = piston_area(fields["bore"])
    if isinstance(law, Table) and every is not None and window is not UNREAD:
        table = f"{path}.model.table" if model else f"{path}.table"
        if stroke is not None:
            law = fit_stroke(law, window or (stroke.start, stroke.end), table, faults)
        else:
            law = fit_window(law, window, every, table, faults) if window else fit_period(law, every, table, faults)
    if place is None or every is None or law is None or window is UNREAD:
        return None
    start, end = window or (None, None)
    factor = fields["factor"]
    if "factor" in item.raw and factor is not None:
        law = _multiplied(law, factor)
    return Load(place.name, law, every, start, end, sense or 0, path, stroke is not None, model, piston, factor or 0.0)


def _multiplied(law: Law, factor: float) -> Law:
    """A law times a number."""
    if isinstance(law, Table):
        return replace(law, value=law.value * factor)
    if factor == 0.0:
        return 0.0
    if not isinstance(law, Expression):
        return law * factor
    tree = Node("product", (numeral(factor), law.tree), signs=("*", "*"))
    return Expression(f"{expression_of(factor)}*({law.text})", tree)


def _law(
    item: Item, place: Place | None, places: Places, acting: tuple[Window, float | None], setting: Setting
) -> tuple[Law | None, str, float | None]:
    """The law of a load; where it comes from a model, what it is in words, and the area of its piston."""
    raw, path, key = item.raw, item.path, item.one("force", "torque", "table", "model")
    if key == "model":
        from flywheel.reading.load_models import Site, read_model  # only scenes with a model pay for it

        site = None if place is None else Site(place, places, *acting, setting)
        return read_model(raw["model"], f"{path}.model", site, item.faults) or (None, "", None)
    if key == "table":
        dimension = None if place is None else ("torque" if place.rotating else "force")
        along = "length" if setting.sliding else "angle"
        return read_table(raw["table"], dimension, f"{path}.table", setting.folder, item.faults, along), "", None
    if key and place is not None and place.rotating != (key == "torque"):
        moves, other = ("rotates", "torque") if place.rotating else ("translates", "force")
        item.add(key, f'a {key} on "{place.name}", which {moves}', f"a {other}")
        return None, "", None
    return read_effort(raw[key], key, f"{path}.{key}", setting) if key else None, "", None


def _every(given: float | None, place: Place | None, path: str, setting: Setting) -> float | None:
    """The angle after which the load repeats: it divides the travel of the angle that the load sees."""
    if place is None or place.travel is None or setting.cycle is None:
        return None
    path, travel = f"{path}.every", f"the {np.degrees(place.travel):.10g} deg that its angle travels in a cycle"
    if given is None:
        period = default_period(place.travel, setting.cycle)
        if period is None:
            setting.faults.add(path, "nothing", f"an angle that divides {travel}", "the cycle does not")
        return period
    repeats = whole(place.travel / given)
    if repeats is None or repeats > MOST_TURNS:
        found = f"{np.degrees(given):.10g} deg"
        setting.faults.add(path, found, f"an angle that divides {travel}, {MOST_TURNS} times at most")
        return None
    return place.travel / repeats


def _window(item: Item, every: float | None, setting: Setting) -> Window:
    """Window of the load: its ends within one period, or along the stroke; None for always, `UNREAD` after a fault."""
    start, end, stroke = item.fields["from"], item.fields["to"], setting.stroke
    missing = [key for key in ("from", "to") if key not in item.raw]
    if len(missing) == 2:
        return None
    if missing:
        item.add(missing[0], "nothing", f"an angle, as there is {'to' if missing == ['from'] else 'from'}")
        return UNREAD
    if start is None or end is None or every is None:
        return UNREAD
    before = len(item.faults)
    if stroke is not None:
        slack = TOLERANCE * stroke.span
        ends = f"{told(stroke.start, stroke.sliding)} to {told(stroke.end, stroke.sliding)}, as the stroke goes"
        beyond = [at for at in (start, end) if not stroke.start - slack <= at <= stroke.end + slack]
        if beyond:
            item.add("from" if beyond[0] == start else "to", told(beyond[0], stroke.sliding), f"a place from {ends}")
        elif end - start <= slack:
            item.add("to", told(end, stroke.sliding), "a position beyond the beginning of the load")
        elif start - stroke.start <= slack and stroke.end - end <= slack:
            return None
        return UNREAD if len(item.faults) > before else (start, end)
    if abs(end - start - every) <= TOLERANCE * every:
        return None
    period, most = f"{np.degrees(every):.10g}", f"{np.degrees(2 * every):.10g}"
    for key, angle in (("from", start), ("to", end)):
        if abs(angle) > 2 * every * (1 + _SAME_ANGLE):
            item.add(key, f"{np.degrees(angle):.10g} deg", f"an angle from -{most} to {most} deg")
    if end - start > every and len(item.faults) == before:
        found = f"a window of {np.degrees(end - start):.10g} deg"
        item.add("to", found, f"one of {period} deg at most, after which it repeats")
    # brought into [0, every), the period's end being its beginning
    for _ in range(2):
        start, end = (angle + every if angle < 0 else angle - every if angle > every else angle for angle in (start, end))
    seam = _ROUNDED * every
    start, end = (0.0 if angle <= seam or angle >= every - seam else angle for angle in (start, end))
    if abs(start - end) <= _SAME_ANGLE * every and len(item.faults) == before:
        item.add("to", f"{show(item.raw['to'])}, where the load begins", "another angle")
    return UNREAD if len(item.faults) > before else (start, end or every)


class Drive(NamedTuple):
    """The drive's load, whether its torque (or force) is the scene's balance, and the motor that gives it, if any."""

    load: Load | None = None
    balance: bool = False
    motor: Motor | None = None


def read_drive(raw: object, places: Places, setting: Setting) -> Drive:
    """The drive: a torque (a force, where the reduction element slides), which may be the balance, or a motor."""
    table, faults = None if raw is None else as_table(raw, "drive", setting.faults), setting.faults
    if table is None:
        return Drive()
    element, keys = next(iter(setting.shafts)), SECTIONS["drive"].keys
    fields = read_fields(table, keys, "drive", faults)
    shaft = places.shaft(fields["on"] if "on" in table else element, "drive.on", faults)
    turning, pushing = ("torque", "motor"), ("force",)
    valid, wrong, moves = (pushing, turning, "slides") if setting.sliding else (turning, pushing, "turns")
    given, misplaced = ([name for name in names if name in table] for names in (valid, wrong))
    for name in misplaced:
        faults.add(f"drive.{name}", f'a {name} on "{element}", which {moves}', f"a {valid[0]}")
    if len(given) > 1:
        exactly_one(given, valid, "drive", faults)
    elif not given and not misplaced:
        key = next(key for key in keys if key.name == valid[0])
        faults.add(f"drive.{valid[0]}", "nothing", expectation(key), "or a motor" if "motor" in valid else "")
    motor: Motor | None = None
    law: Law | None = None
    balance = given in (["torque"], ["force"]) and isinstance(table[given[0]], str) and table[given[0]] == "balance"
    if given == ["motor"]:
        from flywheel.reading.motors import read_motor  # only scenes with a motor pay for it

        motor = read_motor(table["motor"], "drive.motor", setting)
        law = None if motor is None else motor.law()
    elif len(given) == 1 and not balance:
        law = read_effort(table[given[0]], given[0], f"drive.{given[0]}", setting)
    if setting.cycle is None or (law is None and not balance):
        return Drive(None, balance)
    title = "" if motor is None else motor.title
    return Drive(Load(shaft, law, setting.cycle, path="drive", once=setting.stroke is not None, model=title), balance, motor)
