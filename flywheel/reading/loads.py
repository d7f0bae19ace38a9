"""Loads, springs, added inertias and the drive of a scene: where they act, when, and by what law."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from flywheel.components.motors import Motor
from flywheel.numerics.expressions import Expression
from flywheel.numerics.faults import show, told
from flywheel.reading.fields import (
    Faults,
    Fields,
    Place,
    Places,
    Setting,
    as_table,
    default_period,
    exactly_one,
    expectation,
    read_fields,
    read_gd2,
    read_quantity,
    whole,
)
from flywheel.reading.schema import MOST_TABLES, MOST_TURNS, SECTIONS
from flywheel.reading.tables import TOLERANCE, fit_period, fit_stroke, fit_window, read_effort, read_table
from flywheel.scene.keys import Key
from flywheel.scene.scene import Damper, Inertia, Law, Load, Spring, Stroke, Table

_SAME = 1e-12  # share of a period within which two angles are one
_ROUNDED = 1e-15  # share of a period by which rounding alone may miss its seam
_LAWS = ("force", "torque", "table", "model")


class Window(NamedTuple):
    """When a load acts: from start to end (None: always); `good` is False where a fault was noted."""

    start: float | None = None
    end: float | None = None
    good: bool = True


def listed(raw: object, name: str, faults: Faults) -> list[tuple[str, Mapping[str, Any]]]:
    """The tables of an array with their paths, `load[0]`, `load[1]`...; a lone table is a fault, but read."""
    if raw is None:
        return []
    if isinstance(raw, Mapping):
        faults.add(name, "a table", "an array of tables", f"write [[{name}]]")
        raw = [raw]
    if not isinstance(raw, (list, tuple)):
        faults.add(name, show(raw), "an array of tables", f"write [[{name}]]")
        return []
    if len(raw) > MOST_TABLES:
        faults.add(name, f"{len(raw)} tables", f"at most {MOST_TABLES}")
        return []
    tables = [(f"{name}[{i}]", as_table(item, f"{name}[{i}]", faults)) for i, item in enumerate(raw)]
    return [(path, table) for path, table in tables if table is not None]


def read_inertias(raw: object, places: Places, setting: Setting) -> tuple[Inertia, ...]:
    """Masses and inertias fixed on places."""
    found = []
    for path, table in listed(raw, "inertia", setting.faults):
        fields = read_fields(table, SECTIONS["inertia"].keys, path, setting.faults)
        place = places.find(fields["on"], f"{path}.on", setting.faults)
        value = _inertia(table, fields, place, path, setting.faults)
        if place is not None and value is not None:
            found.append(Inertia(place.name, value, path))
    return tuple(found)


def _inertia(table: Mapping[str, Any], fields: Fields, place: Place | None, path: str, faults: Faults) -> float | None:
    """The mass or inertia of a table, or the inertia of its GD²."""
    if "gd2" not in table and "value" not in table:
        faults.add(f"{path}.value", "nothing", "a mass or an inertia, or gd2")
    elif "gd2" not in table:
        return _by_place(fields, "value", "inertia", place, path, faults)
    elif exactly_one([key for key in ("value", "gd2") if key in table], ("value", "gd2"), path, faults):
        if place is None or place.rotating:
            return read_gd2(table["gd2"], f"{path}.gd2", faults)
        faults.add(f"{path}.gd2", f'a GD² on "{place.name}", which translates', "a mass, in value")
    return None


def read_springs(raw: object, places: Places, setting: Setting) -> tuple[Spring, ...]:
    """Springs to the frame; they hang only on places that come back."""
    found = []
    for path, table in listed(raw, "spring", setting.faults):
        fields = read_fields(table, SECTIONS["spring"].keys, path, setting.faults)
        place = places.find(fields["on"], f"{path}.on", setting.faults)
        stiffness = _by_place(fields, "stiffness", "spring", place, path, setting.faults)
        rest = _by_place(fields, "rest", "spring", place, path, setting.faults)
        if place is not None and not place.returns:
            setting.faults.add(f"{path}.on", show(fields["on"]), "a place that comes back to where it was each cycle")
        elif place is not None and stiffness is not None and rest is not None:
            found.append(Spring(place.name, stiffness, rest, path))
    return tuple(found)


def read_dampers(raw: object, places: Places, setting: Setting) -> tuple[Damper, ...]:
    """Dampers to the frame."""
    found = []
    for path, table in listed(raw, "damper", setting.faults):
        fields = read_fields(table, SECTIONS["damper"].keys, path, setting.faults)
        place = places.find(fields["on"], f"{path}.on", setting.faults)
        coefficient = _by_place(fields, "coefficient", "damper", place, path, setting.faults)
        if place is not None and coefficient is not None:
            found.append(Damper(place.name, coefficient, path))
    return tuple(found)


def _by_place(fields: Fields, name: str, section: str, place: Place | None, path: str, faults: Faults) -> float | None:
    """A quantity whose dimension depends on whether its place translates or rotates."""
    key = next(key for key in SECTIONS[section].keys if key.name == name)
    if place is None or fields[name] is None:
        return None
    dimension = key.kind.split(" | ")[place.rotating]
    return read_quantity(fields[name], dimension, key, f"{path}.{name}", faults)


def read_loads(raw: object, places: Places, setting: Setting) -> tuple[Load, ...]:
    """Every load that could be read."""
    found = (_load(table, path, places, setting) for path, table in listed(raw, "load", setting.faults))
    return tuple(load for load in found if load is not None)


def _load(raw: Mapping[str, Any], path: str, places: Places, setting: Setting) -> Load | None:
    """One load; None after noting a fault."""
    faults = setting.faults
    before = len(faults)
    fields = read_fields(raw, _load_keys(setting), path, faults)
    place = places.find(fields["on"], f"{path}.on", faults)
    every = _every(fields["every"], place, path, setting) if setting.stroke is None else _once(raw, path, setting)
    window = _window(raw, fields, every, path, setting)
    sense = _sense(fields["while"], f"{path}.while", faults)
    one = exactly_one([key for key in _LAWS if key in raw], _LAWS, path, faults)
    law, model, piston = _law_or_model(raw, place, places, (window, every), path, setting) if one else (None, "", None)
    if fields["bore"] is not None:
        piston = _piston(fields["bore"], raw, place, places, path, faults)
    if isinstance(law, Table) and every is not None and window.good:
        law = _fitted(law, every, window, f"{path}.model.table" if model else f"{path}.table", setting)
    if len(faults) > before or place is None or every is None or law is None:
        return None
    return Load(place.name, law, every, window.start, window.end, sense, path, setting.stroke is not None, model, piston)


def _piston(bore: float, raw: Mapping[str, Any], place: Place | None, places: Places, path: str, faults: Faults) -> float:
    """The area (m²) of a piston that a load's gas presses on."""
    from flywheel.components.gas_forces import piston_area  # only scenes with a cylinder pay for it

    if "model" in raw:
        faults.add(f"{path}.bore", "a bore beside a model", "none", "an indicator diagram has a bore of its own")
    elif place is not None and (place.rotating or place.name in places.shafts):
        faults.add(f"{path}.bore", f'a bore on "{place.name}"', "a port that translates, as a piston does")
    return piston_area(bore)


def _law_or_model(
    raw: Mapping[str, Any],
    place: Place | None,
    places: Places,
    acting: tuple[Window, float | None],
    path: str,
    setting: Setting,
) -> tuple[Law | None, str, float | None]:
    """The law of a load; where it comes from a model, what it is in words, and the area of its piston."""
    if "model" not in raw:
        return _law(raw, place, path, setting), "", None
    from flywheel.reading.load_models import Site, check_keys, read_model  # only scenes with a model pay for it

    if place is None:
        check_keys(raw["model"], f"{path}.model", setting.faults)
        return None, "", None
    window, every = acting
    unread = (math.nan, math.nan) if not window.good else None
    ends = unread if window.start is None or window.end is None else (window.start, window.end)
    found = read_model(raw["model"], f"{path}.model", Site(place, places, ends, every, setting))
    return (None, "", None) if found is None else found


def _load_keys(setting: Setting) -> tuple[Key, ...]:
    """The keys of a load, whose window is one of lengths where the reduction element slides."""
    keys = SECTIONS["load"].keys
    return tuple(key._replace(kind="length") if key.kind == "angle" and setting.sliding else key for key in keys)


def _once(raw: Mapping[str, Any], path: str, setting: Setting) -> float | None:
    """How far a load reaches on a stroke, after which it does not repeat."""
    if "every" in raw:
        setting.faults.add(f"{path}.every", "every beside [stroke]", "none", "nothing repeats along a stroke")
    return setting.cycle


def _law(raw: Mapping[str, Any], place: Place | None, path: str, setting: Setting) -> Law | None:
    """The law of a load: a force where its place translates, a torque where it rotates, or a table of either."""
    if "table" in raw:
        dimension = None if place is None else ("torque" if place.rotating else "force")
        along = "length" if setting.sliding else "angle"
        return read_table(raw["table"], dimension, f"{path}.table", setting.folder, setting.faults, along)
    key = "force" if "force" in raw else "torque"
    if place is not None and place.rotating != (key == "torque"):
        moves, other = ("rotates", "torque") if place.rotating else ("translates", "force")
        setting.faults.add(f"{path}.{key}", f'a {key} on "{place.name}", which {moves}', f"a {other}")
        return None
    return read_effort(raw[key], key, f"{path}.{key}", setting)


def _every(given: float | None, place: Place | None, path: str, setting: Setting) -> float | None:
    """The angle after which the load repeats: it divides the travel of the angle that the load sees."""
    if place is None or place.travel is None or setting.cycle is None:
        return None
    path = f"{path}.every"
    travel = f"the {np.degrees(place.travel):.10g} deg that its angle travels in a cycle"
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


def _window(raw: Mapping[str, Any], fields: Fields, every: float | None, path: str, setting: Setting) -> Window:
    """When the load acts, its ends brought into one period; `from` to `to` over a whole period is always."""
    faults = setting.faults
    given = [key for key in ("from", "to") if key in raw]
    if not given:
        return Window()
    if len(given) == 1:
        missing = "to" if given == ["from"] else "from"
        faults.add(f"{path}.{missing}", "nothing", f"an angle, as there is {given[0]}")
        return Window(good=False)
    start, end = fields["from"], fields["to"]
    if start is None or end is None or every is None:
        return Window(good=False)
    if setting.stroke is not None:
        return _stretch(start, end, setting.stroke, path, faults)
    if abs(end - start - every) <= TOLERANCE * every:
        return Window()
    if _out_of_range(start, end, every, path, faults):
        return Window(good=False)
    start, end = _reduced(start, every), _reduced(end, every)
    if abs(start - end) <= _SAME * every:
        faults.add(f"{path}.to", f"{show(raw['to'])}, where the load begins", "another angle")
        return Window(good=False)
    return Window(start, end or every)


def _stretch(start: float, end: float, stroke: Stroke, path: str, faults: Faults) -> Window:
    """The stretch of a stroke along which a load acts."""
    slack = TOLERANCE * stroke.span
    ends = f"{told(stroke.start, stroke.sliding)} to {told(stroke.end, stroke.sliding)}, as the stroke goes"
    for key, value in (("from", start), ("to", end)):
        if not stroke.start - slack <= value <= stroke.end + slack:
            faults.add(f"{path}.{key}", told(value, stroke.sliding), f"a place from {ends}")
            return Window(good=False)
    if end - start <= slack:
        faults.add(f"{path}.to", told(end, stroke.sliding), "a place behind that where the load begins")
        return Window(good=False)
    whole_stroke = start - stroke.start <= slack and stroke.end - end <= slack
    return Window() if whole_stroke else Window(start, end)


def _out_of_range(start: float, end: float, every: float, path: str, faults: Faults) -> bool:
    """Whether an end lies more than a period from 0, or the window is longer than a period."""
    limit = every * (1 + _SAME)
    for key, angle in (("from", start), ("to", end)):
        if abs(angle) > limit:
            period = f"{np.degrees(every):.10g}"
            faults.add(f"{path}.{key}", f"{np.degrees(angle):.10g} deg", f"an angle from -{period} to {period} deg")
    if abs(start) > limit or abs(end) > limit:
        return True
    if end - start > every:
        found = f"a window of {np.degrees(end - start):.10g} deg"
        faults.add(f"{path}.to", found, f"one of {np.degrees(every):.10g} deg at most, after which it repeats")
    return end - start > every


def _reduced(angle: float, every: float) -> float:
    """An angle brought into [0, every), the period's end being its beginning."""
    angle = angle + every if angle < 0 else angle
    return 0.0 if abs(angle - every) <= _ROUNDED * every or angle <= _ROUNDED * every else angle


def _sense(text: str | None, path: str, faults: Faults) -> int:
    """The sense of motion in which a load acts: 1, -1, or 0 for both."""
    if text is None:
        return 0
    senses = {"v>0": 1, "v<0": -1}
    plain = re.sub(r"\s", "", text[:100])
    if plain not in senses:
        faults.add(path, show(text), '"v > 0" or "v < 0"')
    return senses.get(plain, 0)


def _fitted(law: Table, every: float, window: Window, path: str, setting: Setting) -> Table | None:
    """The table of a load, exactly as long as its period, or at least as its window."""
    faults, stroke = setting.faults, setting.stroke
    if stroke is not None:
        start = stroke.start if window.start is None else window.start
        return fit_stroke(law, (start, stroke.end if window.end is None else window.end), path, faults)
    if window.start is None or window.end is None:
        return fit_period(law, every, path, faults)
    return fit_window(law, (window.start, window.end), every, path, faults)


class Drive(NamedTuple):
    """The drive's load, whether its torque (or force) is the scene's balance, and the motor that gives it, if any."""

    load: Load | None = None
    balance: bool = False
    motor: Motor | None = None

    @property
    def rotor(self) -> tuple[Inertia, ...]:
        """The inertia of the motor's rotor, on the shaft that it drives."""
        if self.load is None or self.motor is None or not self.motor.inertia:
            return ()
        return (Inertia(self.load.on, self.motor.inertia, "drive.motor.inertia"),)


def read_drive(raw: object, places: Places, setting: Setting) -> Drive:
    """The drive: a torque (a force, where the reduction element slides), which may be the balance, or a motor."""
    table = None if raw is None else as_table(raw, "drive", setting.faults)
    if table is None:
        return Drive()
    fields = read_fields(table, SECTIONS["drive"].keys, "drive", setting.faults)
    shaft = places.shaft(fields["on"] if "on" in table else setting.element, "drive.on", setting.faults)
    key = _driving(table, setting)
    if key is None:
        return Drive()
    if key == "motor":
        return _motored(table["motor"], shaft, setting)
    balance = isinstance(table[key], str) and table[key] == "balance"
    law: float | Expression | None = None
    if not balance:
        law = read_effort(table[key], key, f"drive.{key}", setting)
    if setting.cycle is None or (law is None and not balance):
        return Drive(None, balance)
    return Drive(Load(shaft, law, setting.cycle, path="drive", once=setting.stroke is not None), balance)


def _motored(raw: object, shaft: str, setting: Setting) -> Drive:
    """A drive by a motor, whose law depends on the speed of its shaft."""
    from flywheel.reading.motors import read_motor  # only scenes with a motor pay for it

    motor = read_motor(raw, "drive.motor", setting)
    if motor is None or setting.cycle is None:
        return Drive()
    once = setting.stroke is not None
    return Drive(Load(shaft, motor.law(), setting.cycle, path="drive", once=once, model=motor.title), motor=motor)


def _driving(table: Mapping[str, Any], setting: Setting) -> str | None:
    """What drives: torque or motor, or the force where the reduction element slides; None after noting a fault."""
    turning, pushing = ("torque", "motor"), ("force",)
    valid, wrong, moves = (pushing, turning, "slides") if setting.sliding else (turning, pushing, "turns")
    given, misplaced = ([name for name in names if name in table] for names in (valid, wrong))
    for name in misplaced:
        setting.faults.add(f"drive.{name}", f'a {name} on "{setting.element}", which {moves}', f"a {valid[0]}")
    if len(given) > 1:
        exactly_one(given, valid, "drive", setting.faults)
    elif not given and not misplaced:
        key = next(key for key in SECTIONS["drive"].keys if key.name == valid[0])
        setting.faults.add(f"drive.{valid[0]}", "nothing", expectation(key), "or a motor" if "motor" in valid else "")
    return given[0] if len(given) == 1 else None
