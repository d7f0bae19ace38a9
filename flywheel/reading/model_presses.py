"""Load models of presses and punches, on a port towards the end of its stroke or on a shaft over a window."""

from __future__ import annotations

import math

import numpy as np

from flywheel.load_models import presses
from flywheel.mechanisms.ends import Ends
from flywheel.reading.model_items import Item, Made, Modelled, ends_of_port

_SOURCES = ("energy", "shear_strength", "energy_per_area")
_AREAS = ("diameter", "perimeter", "area")


def press(item: Item) -> Made | None:
    """A press on the port that it presses with, or on a shaft over a window of the crank's angle."""
    source = item.one(*_SOURCES)
    if source is None:
        return None
    sheared = source != "energy" and item.one(*_AREAS)
    if source == "energy":
        item.without(_AREAS, "beside energy", "give the energy, or what it follows from")
    by_sheet = bool(sheared) and not (source == "energy_per_area" and sheared == "area")
    if by_sheet:
        item.needs("thickness", "the work of shearing follows from it")
    if item.site.on_shaft:
        return _press_on_shaft(item, source, by_sheet)
    if "angle" not in item.raw and not by_sheet:
        item.needs(
            "angle" if item.site.place.rotating else "thickness",
            "the force acts over the sheet's thickness, or over an angle before the end of the stroke",
        )
    elif not by_sheet:
        item.without(["thickness"], "beside angle", "the force acts over one of them")
    return _press_on_port(item, source)


def _energy(item: Item, source: str) -> float:
    """The energy of a stroke, J."""
    if source == "energy":
        return item.number("energy")
    thickness, area = item.number("thickness"), item.number("area")
    if "area" not in item.raw:
        perimeter = math.pi * item.number("diameter") if "diameter" in item.raw else item.number("perimeter")
        area = presses.sheared_area(thickness, perimeter)
    if source == "energy_per_area":
        return item.number(source) * area
    return presses.Press(item.number(source) * area, thickness, item.fields["shape"]).energy


def _press_on_shaft(item: Item, source: str, by_sheet: bool) -> Made:
    """A torque over the load's window."""
    site = item.site
    names = ("angle", "end", "overtravel", *(() if by_sheet else ("thickness",)))
    item.without(names, f'on "{site.place.name}"', "a shaft has no end of stroke: give the load's from and to")
    if site.window is None:
        found = f'a {item.kind} on "{site.place.name}" without a window'
        expected = "from and to of its load, less than its period apart"
        item.faults.add(item.path, found, expected, "or put it on the port that presses")

    def made() -> Modelled | None:
        if site.window is None or site.every is None or math.isnan(site.window[0]):
            return None
        energy, shape = _energy(item, source), item.fields["shape"]
        law = presses.shaft_law(energy, site.window, site.every, site.setting.shafts[site.place.name], shape)
        return Modelled(law, f"{item.kind}: {energy:.6g} J, {shape}, over the load's window")

    return made


def _press_on_port(item: Item, source: str) -> Made:
    """A force (or a torque, where the port rotates) over the last of the way to the end of the stroke."""
    if item.site.place.rotating:
        item.without(
            ("thickness", "overtravel"), f'on "{item.site.place.name}", which rotates', "give an angle and the energy"
        )
    if item.site.setting.sliding:
        item.without(["angle"], "of a driver that slides", "give the sheet's thickness")

    def made() -> Modelled | None:
        ends = ends_of_port(item)
        if ends is None:
            return None
        high, shape = item.fields["end"] == "max", item.fields["shape"]
        past, energy = item.number("overtravel"), _energy(item, source)
        travel = _travel(item, ends, high)
        if travel is None:
            return None
        press = presses.Press(presses.greatest_force(energy, travel, shape), travel, shape, past)
        unit = "rad" if item.site.place.rotating else "m"
        law = presses.press_law(press, ends.high if high else ends.low, high)
        return Modelled(law, f"{item.kind}: {energy:.6g} J a stroke, {shape}, over {travel:.6g} {unit} before its end")

    return made


def _travel(item: Item, ends: Ends, high: bool) -> float | None:
    """The way that a press works along; None after noting that its stroke is too short for it."""
    past, whole = item.number("overtravel"), ends.high - ends.low
    if "angle" in item.raw:
        angle = item.number("angle")
        covered = ends.before(high, angle)
        if covered is None:
            expected = f'an angle over which "{item.site.place.name}" moves towards that end'
            item.add("angle", f"{np.degrees(angle):.6g} deg", expected)
        elif covered <= past:
            item.add("overtravel", f"{past:.6g} m", f"less than the {covered:.6g} m covered in that angle")
        else:
            return covered - past
        return None
    travel = item.number("thickness")
    if travel + past <= whole:
        return travel
    found = f"{travel + past:.6g} m with what is beyond it" if past else f"{travel:.6g} m"
    item.add("thickness", found, f"at most the stroke of {whole:.6g} m")
    return None
