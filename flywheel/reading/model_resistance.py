"""Load models that resist motion: constant, fan and pump, losses, belt."""

from __future__ import annotations

import math

from flywheel.load_models import belts, resistance
from flywheel.reading.model_items import Item, Made, Modelled

_SLIPS = 1e-9  # share by which a ratio of tensions may pass its limit


def _effort(item: Item) -> str:
    """The key of an effort on this place: torque or force; the other one is noted."""
    own, other, moves = ("torque", "force", "rotates") if item.site.place.rotating else ("force", "torque", "translates")
    item.without([other], f'on "{item.site.place.name}", which {moves}', f"give a {own}")
    return own


def _resisting(item: Item, law: resistance.Resistance, text: str) -> Modelled:
    return Modelled(resistance.resistance_law(law, item.site.variable), f"{item.kind}: {text}")


def constant(item: Item) -> Made:
    """A force or torque that does not depend on speed."""
    own = _effort(item)
    item.needs(own, f'"{item.site.place.name}" takes one')
    value, unit = item.number(own), _unit(item)
    return lambda: _resisting(item, resistance.Resistance(value), f"{value:.6g} {unit} against the motion")


def _unit(item: Item) -> str:
    """The unit of an effort on this place."""
    return "N m" if item.site.place.rotating else "N"


def fan(item: Item) -> Made:
    """A quadratic law through one point."""
    own = _effort(item)
    at, other = ("speed", "velocity") if item.site.place.rotating else ("velocity", "speed")
    item.without([other], f'on "{item.site.place.name}"', f"give a {at}")
    item.needs(at, "the characteristic passes through one point")
    source = item.one(own, "power")
    speed, constant = item.number(at), item.by_place("constant")
    effort = math.nan if source is None else item.number(source) / (speed if source == "power" else 1.0)
    if constant > effort:
        found, most = (f"{value:.6g} {_unit(item)}" for value in (constant, effort))
        item.add("constant", found, f"at most the {most} taken at that {at}")

    def made() -> Modelled:
        law = resistance.Resistance(constant, 0.0, resistance.quadratic_coefficient(effort, speed, constant))
        return _resisting(item, law, f"{effort:.6g} {_unit(item)} at {speed:.6g} {'rad/s' if at == 'speed' else 'm/s'}")

    return made


def losses(item: Item) -> Made:
    """Shares that are constant, proportional to the speed, and to its square."""
    names = resistance.Resistance._fields
    if not item.given(names):
        item.faults.add(item.path, f"none of {', '.join(names)}", "one of them at least")
    law = resistance.Resistance(*map(item.by_place, names))
    said = ", ".join(f"{name} {item.raw[name]}" for name in item.given(names))
    return lambda: _resisting(item, law, said)


def belt(item: Item) -> Made:
    """The drag of a belt, from its tensions or from a power; it must not slip."""
    place = item.site.place
    if not place.rotating:
        item.add("type", f'a belt on "{place.name}", which translates', "a place that rotates")
    pulled = item.one("tight", "power") == "tight"
    for name in ("slack", "radius") if pulled else ("speed",):
        item.needs(name, f"there is a {'tight side' if pulled else 'power'}")
    item.without(("power", "speed") if pulled else ("slack", "radius", "friction", "wrap", "groove"), "beside it")
    if pulled:
        _check_tensions(item)
        torque = belts.belt_torque(item.number("tight"), item.number("slack"), item.number("radius"))
    else:
        torque = item.number("power") / item.number("speed")
    return lambda: _resisting(item, resistance.Resistance(torque), f"{torque:.6g} N m against the motion")


def _check_tensions(item: Item) -> None:
    tight, slack = item.number("tight"), item.number("slack")
    if tight <= slack:
        item.add("tight", f"{tight:.6g} N", f"more than the slack side's {slack:.6g} N")
    if item.given(("friction", "wrap", "groove")):
        for name in ("friction", "wrap"):
            item.needs(name, "friction and wrap together tell whether it slips")
        most = belts.tension_ratio(*map(item.number, ("friction", "wrap", "groove")))
        if tight > most * slack * (1 + _SLIPS):
            found = f"a tight side of {tight:.6g} N on a slack side of {slack:.6g} N"
            item.add("tight", found, f"at most {most:.6g} times the slack side", "it slips; tighten the slack side")
