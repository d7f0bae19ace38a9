"""One load model on its way from the scene: its keys, its place, the ends of its port's stroke."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from flywheel.components import gas_forces, load_models
from flywheel.mechanisms.families import Ends, ends_of
from flywheel.numerics.expressions import Expression
from flywheel.numerics.faults import SceneError, show
from flywheel.numerics.units import LARGEST, QuantityError, convert, parse_unit
from flywheel.reading.fields import (
    Faults,
    Fields,
    Place,
    Places,
    Setting,
    exactly_one,
    expectation,
    read_quantity,
    read_typed,
)
from flywheel.reading.schema import LOAD_MODELS, MOST_ROWS, TYPE
from flywheel.reading.tables import listed_numbers, read_table
from flywheel.scene.keys import Key
from flywheel.scene.scene import Mechanism, Table


class Site(NamedTuple):
    """Where a model acts, and when: its place, its load's window and period (rad), None where always, or not known."""

    place: Place
    places: Places
    window: tuple[float, float] | None
    every: float | None
    setting: Setting

    @property
    def on_shaft(self) -> bool:
        """Whether it sits on a shaft, not on a mechanism's port."""
        return self.place.name in self.places.shafts

    @property
    def variable(self) -> str:
        """The name of its speed in expressions."""
        return "omega" if self.on_shaft else "v"


class Modelled(NamedTuple):
    """The law that a model comes to, and what it is in words; the area (m²) on which a gas presses, if it is one."""

    law: Expression | Table
    text: str
    piston: float | None = None


class Item(NamedTuple):
    """One model's table on its way."""

    raw: Mapping[str, Any]
    fields: Fields
    kind: str
    path: str
    site: Site

    @property
    def faults(self) -> Faults:
        """The scene's faults so far."""
        return self.site.setting.faults

    def add(self, key: str, found: str, expected: str, advice: str = "") -> None:
        """Note a fault of one key."""
        self.faults.add(f"{self.path}.{key}", found, expected, advice)

    def given(self, names: Iterable[str]) -> list[str]:
        """Those of some keys that the scene gives."""
        return [name for name in names if name in self.raw]

    def one(self, *names: str) -> str | None:
        """The one of some keys that the scene gives; None after noting that there is none, or more."""
        found = self.given(names)
        return found[0] if exactly_one(found, names, self.path, self.faults) else None

    def without(self, names: Iterable[str], because: str, advice: str = "") -> None:
        """Note those of some keys that make no sense here."""
        for name in self.given(names):
            self.add(name, f"{name} {because}", "none", advice)

    def needs(self, name: str, because: str) -> None:
        """Note a key that is not there."""
        if name not in self.raw:
            self.add(name, "nothing", expectation(key_of(self.kind, name)), because)

    def by_place(self, name: str) -> float:
        """A quantity whose dimension depends on whether the place translates or rotates; NaN after noting a fault."""
        key = key_of(self.kind, name)
        if name not in self.raw:
            return float(key.default or 0.0)
        dimension = key.kind.split(" | ")[self.site.place.rotating]
        value = read_quantity(self.raw[name], dimension, key, f"{self.path}.{name}", self.faults)
        return math.nan if value is None else value

    def flag(self, name: str) -> bool:
        """Whether a key is true."""
        value = self.raw.get(name, False)
        if not isinstance(value, bool):
            self.add(name, show(value), "true or false")
        return value is True

    def number(self, name: str) -> float:
        """A value that was read already; NaN where it had a fault, or is missing."""
        value = self.fields[name]
        return math.nan if value is None else float(value)


def key_of(kind: str, name: str) -> Key:
    """One key of a model."""
    return next(key for key in LOAD_MODELS[kind].keys if key.name == name)


Made = Callable[[], Modelled | None]
"""What makes the law of a model: readers check its keys, and give this to be called where there is no fault."""


def ends_of_port(item: Item) -> Ends | None:
    """The ends of the stroke of the port that a model acts on; None after noting that it has none.

    A mechanism that cannot be built, or has a parameter at fault, has been noted by its own reading.
    """
    place, setting = item.site.place, item.site.setting
    name, _, port = place.name.rpartition(".")
    if not place.returns:
        item.faults.add(item.path, f'a {item.kind} on "{place.name}", which does not come back', "a port with a stroke")
        return None
    mechanism: Mechanism | None = next((m for m in item.site.places.mechanisms if m.name == name), None)
    if mechanism is None or any(map(math.isnan, setting.parameters.values())):
        return None
    try:
        return ends_of(mechanism, port, setting.parameters)
    except SceneError as error:
        setting.faults.extend(fault for fault in error.faults if fault not in setting.faults)
    except ArithmeticError:
        pass
    return None


# -- model gas ---------------------------------------------------------------------------------------------------------

# Load models of gas on a piston: indicator diagram and reciprocating compressor.


def _slides(item: Item) -> bool:
    """Whether the model's place is a port that translates, as a piston does; a fault otherwise."""
    place = item.site.place
    if place.rotating or item.site.on_shaft:
        item.add("type", f'{item.kind} on "{place.name}"', "a port that translates, as a piston does")
    return not place.rotating and not item.site.on_shaft


def _areas(item: Item) -> tuple[float, float]:
    """Area of the bore without and with the rod taken off."""
    bore, rod = item.number("bore"), item.number("rod")
    if rod >= bore:
        item.add("rod", f"{rod:.6g} m", f"less than the bore of {bore:.6g} m")
    return gas_forces.piston_area(bore), gas_forces.piston_area(bore, rod)


def _space(area: float, ends: Ends, cover: str) -> gas_forces.Space:
    return gas_forces.Space(area, ends.high, ends.low) if cover == "max" else gas_forces.Space(area, ends.low, ends.high)


def indicator(item: Item) -> Made | None:
    """Pressure of an indicator diagram, against angle or against the piston's way."""
    area = _areas(item)[1]
    gauge = item.flag("gauge")
    if gauge:
        item.without(["atmosphere"], "beside gauge pressures", "they are above it already")
    if not _slides(item):
        return None
    atmosphere = 0.0 if gauge else item.number("atmosphere")
    if item.one("table", "position", "volume") == "table":
        return _against_angle(item, area, atmosphere)
    return _against_way(item, area, atmosphere)


def _against_angle(item: Item, area: float, atmosphere: float) -> Made:
    item.without(("out", "back", "pressure_unit"), "beside a table", "its value and value_unit are the pressures")
    setting = item.site.setting
    along = "length" if setting.sliding else "angle"
    table = read_table(item.raw["table"], "pressure", f"{item.path}.table", setting.folder, item.faults, along)
    if table is not None:
        _check_pressures(item, "table", table.value)

    def made() -> Modelled | None:
        if table is None:
            return None
        sense = 1.0 if item.fields["side"] == "max" else 0.0
        force = gas_forces.gas_force(table.value, gas_forces.Space(area, sense, 1.0 - sense), atmosphere)
        return Modelled(replace(table, value=force), f"indicator: {table.angle.size} rows against angle", area)

    return made


def _against_way(item: Item, area: float, atmosphere: float) -> Made | None:
    for name in ("out", "back"):
        item.needs(name, "a diagram has both ways of the piston")
    columns = [_column(item, name) for name in (*item.given(("position", "volume")), "out", "back")]
    if len(columns) != 3 or any(column is None for column in columns):
        return None
    way, out, back = (np.array(column, dtype=float) for column in columns)
    if not _fits(item, way, out, back):
        return None
    share = (way - way[0]) / (way[-1] - way[0])
    pressures = [_pressures(item, name, column) for name, column in (("out", out), ("back", back))]

    def made() -> Modelled | None:
        ends = ends_of_port(item)
        if ends is None:
            return None
        diagram = gas_forces.Indicator(share, *pressures)
        law = gas_forces.indicator_law(diagram, _space(area, ends, item.fields["side"]), atmosphere)
        return Modelled(law, f"indicator: {share.size} rows against the piston's way", area)

    return made


def _column(item: Item, name: str) -> list[float] | None:
    """Numbers under a key; None after noting what is wrong with them."""
    if name not in item.raw:
        return None
    column = listed_numbers(item.raw[name], f"{item.path}.{name}", item.faults)
    if column and max(map(abs, column)) > LARGEST:
        item.add(name, f"{max(map(abs, column)):.6g}", f"at most {LARGEST:g}")
        return None
    return column


def _pressures(item: Item, name: str, column: gas_forces.Array) -> gas_forces.Array:
    """Pressures in Pa, which can be pressures; after noting a fault, those given."""
    unit = item.fields["pressure_unit"]
    try:
        scale = parse_unit(unit if isinstance(unit, str) else show(unit), "pressure")
        pressure = np.array([convert(p, scale) for p in column])
    except QuantityError as error:
        item.add("pressure_unit", error.found, error.expected, error.advice)
        return column
    _check_pressures(item, name, pressure)
    return pressure


def _check_pressures(item: Item, name: str, pressure: gas_forces.Array) -> None:
    """Absolute pressures are not below 0, and none is beyond what can be computed with."""
    if np.abs(pressure).max() > LARGEST:
        item.add(name, f"{np.abs(pressure).max():.6g} Pa", f"at most {LARGEST:g} Pa")
    elif pressure.min() < 0.0 and not item.raw.get("gauge"):
        item.add(
            name, f"{pressure.min():.6g} Pa", "absolute pressures, 0 or above", "gauge = true for those above atmosphere"
        )


def _fits(item: Item, way: gas_forces.Array, out: gas_forces.Array, back: gas_forces.Array) -> bool:
    """Whether a diagram has as many pressures as places, which ascend, shares from 0 to 1."""
    name = "position" if "position" in item.raw else "volume"
    steps = np.diff(way)
    if not way.size == out.size == back.size:
        item.add(name, f"{way.size} rows, {out.size} out and {back.size} back", "as many of each")
    elif not 2 <= way.size <= MOST_ROWS:
        item.add(name, f"{way.size} rows", f"from 2 to {MOST_ROWS}")
    elif (steps < 0).any() or steps[0] == 0 or steps[-1] == 0 or ((steps[1:] == 0) & (steps[:-1] == 0)).any():
        item.add(name, "rows that do not ascend", "rows that do, two equal ones inside at most: a jump")
    elif name == "position" and (way[0] != 0.0 or way[-1] != 1.0):
        item.add(name, f"shares from {way[0]:.6g} to {way[-1]:.6g}", "shares of the stroke from 0, at the cover, to 1")
    else:
        return True
    return False


def compressor(item: Item) -> Made | None:
    """A reciprocating compressor, single- or double-acting."""
    bore, crank_end = _areas(item)
    double = item.flag("double_acting")
    if not double:
        item.without(["rod"], "of a single-acting compressor", "only a double-acting one has gas around it")
    cycle = _compression(item)
    if not _slides(item):
        return None

    def made() -> Modelled | None:
        ends = ends_of_port(item)
        if ends is None:
            return None
        side = item.fields["side"]
        other = _space(crank_end, ends, "min" if side == "max" else "max")
        spaces = (_space(bore, ends, side), *([other] if double else []))
        law = gas_forces.compressor_law(cycle, spaces, item.number("atmosphere"))
        work = sum(gas_forces.compressor_work(cycle, space.area * space.stroke) for space in spaces)
        acting = "double" if double else "single"
        return Modelled(law, f"compressor: {acting}-acting, ratio {cycle.ratio:.6g}, {work:.6g} J a double stroke")

    return made


def _compression(item: Item) -> gas_forces.Compression:
    """The cycle of a compressor, which must draw in and deliver."""
    again = "expansion_exponent" if "expansion_exponent" in item.raw else "exponent"
    names = ("suction", "discharge", "clearance", "exponent", again)
    cycle = gas_forces.Compression(*map(item.number, names))
    if cycle.discharge <= cycle.suction:
        item.add("discharge", f"{cycle.discharge:.6g} Pa", f"more than the suction's {cycle.suction:.6g} Pa")
    elif cycle.suction_begins >= 1.0 or cycle.delivery_begins <= 0.0:
        found = f"a pressure ratio of {cycle.ratio:.6g} with a clearance of {cycle.clearance:.6g}"
        advice = "the gas left in the clearance fills the cylinder; compress in stages, or make the clearance less"
        item.add("clearance", found, "so little that gas is drawn in and delivered", advice)
    return cycle


# -- model presses -----------------------------------------------------------------------------------------------------

# Load models of presses and punches, on a port towards the end of its stroke or on a shaft over a window.


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
        area = load_models.sheared_area(thickness, perimeter)
    if source == "energy_per_area":
        return item.number(source) * area
    return load_models.Press(item.number(source) * area, thickness, item.fields["shape"]).energy


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
        law = load_models.shaft_law(energy, site.window, site.every, site.setting.shafts[site.place.name], shape)
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
        press = load_models.Press(load_models.greatest_force(energy, travel, shape), travel, shape, past)
        unit = "rad" if item.site.place.rotating else "m"
        law = load_models.press_law(press, ends.high if high else ends.low, high)
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


# -- model resistance --------------------------------------------------------------------------------------------------

# Load models that resist motion: constant, fan and pump, losses, belt.


_SLIPS = 1e-9  # share by which a ratio of tensions may pass its limit


def _effort(item: Item) -> str:
    """The key of an effort on this place: torque or force; the other one is noted."""
    own, other, moves = ("torque", "force", "rotates") if item.site.place.rotating else ("force", "torque", "translates")
    item.without([other], f'on "{item.site.place.name}", which {moves}', f"give a {own}")
    return own


def _resisting(item: Item, law: load_models.Resistance, text: str) -> Modelled:
    return Modelled(load_models.resistance_law(law, item.site.variable), f"{item.kind}: {text}")


def constant(item: Item) -> Made:
    """A force or torque that does not depend on speed."""
    own = _effort(item)
    item.needs(own, f'"{item.site.place.name}" takes one')
    value, unit = item.number(own), _unit(item)
    return lambda: _resisting(item, load_models.Resistance(value), f"{value:.6g} {unit} against the motion")


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
        law = load_models.Resistance(constant, 0.0, load_models.quadratic_coefficient(effort, speed, constant))
        return _resisting(item, law, f"{effort:.6g} {_unit(item)} at {speed:.6g} {'rad/s' if at == 'speed' else 'm/s'}")

    return made


def losses(item: Item) -> Made:
    """Shares that are constant, proportional to the speed, and to its square."""
    names = load_models.Resistance._fields
    if not item.given(names):
        item.faults.add(item.path, f"none of {', '.join(names)}", "one of them at least")
    law = load_models.Resistance(*map(item.by_place, names))
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
        torque = load_models.belt_torque(item.number("tight"), item.number("slack"), item.number("radius"))
    else:
        torque = item.number("power") / item.number("speed")
    return lambda: _resisting(item, load_models.Resistance(torque), f"{torque:.6g} N m against the motion")


def _check_tensions(item: Item) -> None:
    tight, slack = item.number("tight"), item.number("slack")
    if tight <= slack:
        item.add("tight", f"{tight:.6g} N", f"more than the slack side's {slack:.6g} N")
    if item.given(("friction", "wrap", "groove")):
        for name in ("friction", "wrap"):
            item.needs(name, "friction and wrap together tell whether it slips")
        most = load_models.tension_ratio(*map(item.number, ("friction", "wrap", "groove")))
        if tight > most * slack * (1 + _SLIPS):
            found = f"a tight side of {tight:.6g} N on a slack side of {slack:.6g} N"
            item.add("tight", found, f"at most {most:.6g} times the slack side", "it slips; tighten the slack side")


# -- load models -------------------------------------------------------------------------------------------------------

# Loads of machines of known kinds: `[[load]] model = {type = ..., ...}`, compiled to an expression or a table.


__all__ = ["Modelled", "Site", "read_model"]


def read_model(raw: object, path: str, site: Site) -> Modelled | None:
    """The law of a load's model; None after noting faults."""
    faults = site.setting.faults
    before = len(faults)
    typed = read_typed(raw, TYPE, LOAD_MODELS, path, faults)
    if typed is None:
        return None
    kind, table, fields = typed
    read = _READERS[kind](Item(table, fields, kind, path, site))
    return read() if len(faults) == before and read is not None else None


def check_keys(raw: object, path: str, faults: Faults) -> None:
    """Note what is wrong with a model's own keys, where its place is not known."""
    read_typed(raw, TYPE, LOAD_MODELS, path, faults)


_READERS: dict[str, Callable[[Item], Made | None]] = {
    "constant": constant,
    "fan": fan,
    "pump": fan,
    "losses": losses,
    "belt": belt,
    "press": press,
    "punch": press,
    "indicator": indicator,
    "compressor": compressor,
}
