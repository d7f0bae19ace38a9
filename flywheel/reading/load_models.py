"""Loads of machines of known kinds, `[[load]] model = {type = ..., ...}`: keys, checks, and the law that each comes to.

`LOAD_MODELS` has a line for each. Its reader notes what is wrong with the values, and gives the law where nothing is.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from flywheel.components import gas_forces, load_models
from flywheel.mechanisms.families import Ends, ends_of
from flywheel.numerics.expressions import Expression
from flywheel.numerics.faults import SceneError, show
from flywheel.numerics.units import LARGEST, QuantityError, convert, parse_unit
from flywheel.reading.fields import Faults, Item, Place, Places, Setting, exactly_one, read_typed
from flywheel.reading.schema import Section
from flywheel.reading.tables import read_table
from flywheel.scene.keys import NOT_NEGATIVE, POSITIVE, Key, Range
from flywheel.scene.scene import Mechanism, Table

_SLIPS = 1e-9  # share by which a ratio of tensions may pass its limit
_MOST_ROWS = 100  # of an indicator diagram against the piston's position


class Site(NamedTuple):
    """Place of a model, its load's window and period (rad); None where it always acts, or where that is unknown."""

    place: Place
    places: Places
    window: tuple[float, float] | None
    every: float | None
    setting: Setting

    @property
    def on_shaft(self) -> bool:
        """True if it acts on a shaft, not on a mechanism's port."""
        return self.place.name in self.places.shafts

    @property
    def unit(self) -> str:
        """The unit of an effort on this place."""
        return "N m" if self.place.rotating else "N"

    def ends(self, item: Item) -> Ends | None:
        """The ends of the stroke of the port; None after noting that it has none, or where other faults were noted.

        A mechanism that cannot be built, or has a parameter at fault, has been noted by its own reading.
        """
        if not item.clean:
            return None
        name, _, port = self.place.name.rpartition(".")
        if not self.place.returns:
            found = f'a {item.section.name} on "{self.place.name}", which does not come back'
            item.faults.add(item.path, found, "a port with a stroke")
            return None
        mechanism: Mechanism | None = next((m for m in self.places.mechanisms if m.name == name), None)
        if mechanism is None or any(map(math.isnan, self.setting.parameters.values())):
            return None
        try:
            return ends_of(mechanism, port, self.setting.parameters)
        except SceneError as error:
            item.faults.extend(fault for fault in error.faults if fault not in item.faults)
        except ArithmeticError:
            pass
        return None


class Modelled(NamedTuple):
    """The law that a model comes to, and what it is in words; the area (m²) on which a gas presses, if it is one."""

    law: Expression | Table
    text: str
    piston: float | None = None


def read_model(raw: object, path: str, site: Site | None, faults: Faults) -> Modelled | None:
    """The law of a load's model; None after noting faults, of its own keys alone where its place is not known."""
    if site is None:  # which keys exclude each other is left until its place is right
        read_typed(raw, TYPE, {name: model._replace(one_of=()) for name, model in LOAD_MODELS.items()}, path, faults)
        return None
    item = read_typed(raw, TYPE, LOAD_MODELS, path, faults, site.place.rotating)
    if item is None or item.section.reader is None:
        return None
    found: Modelled | None = item.section.reader(item, site)
    return found if item.clean else None


# -- what resists motion -----------------------------------------------------------------------------------------------

_SPEED = Key("speed", "speed", "of the shaft, at which it takes that much", None, POSITIVE)
_POWER = Key("power", "power", "that it takes at its speed", None, POSITIVE)
_FORCE = Key("force", "force", "against the motion, on a place that translates", None, POSITIVE)
_TORQUE = Key("torque", "torque", "against the motion, on a place that rotates", None, POSITIVE)
_SHARE = Key("constant", "force | torque", "share that does not depend on speed", 0.0, NOT_NEGATIVE)
_VELOCITY = Key("velocity", "velocity", "of a place that translates, at which it takes that much", None, POSITIVE)
_FAN = (_TORQUE, _FORCE, _POWER, _SPEED, _VELOCITY, _SHARE)
_LOSSES = (
    _SHARE,
    Key("proportional", "damping | angular damping", "share per speed", 0.0, NOT_NEGATIVE),
    Key("quadratic", "drag | angular drag", "share per square of the speed", 0.0, NOT_NEGATIVE),
)
_SLIP = "coefficient between belt and pulley, to check that it does not slip"
_BELT = (
    Key("tight", "force", "tension of the tight side", None, POSITIVE),
    Key("slack", "force", "tension of the slack side", None, NOT_NEGATIVE),
    Key("radius", "length", "of the pulley, to the middle of the belt", None, POSITIVE),
    _POWER,
    _SPEED,
    Key("friction", "number", _SLIP, None, POSITIVE, example="0.3"),
    Key("wrap", "angle", "over which the belt lies on the pulley", None, POSITIVE),
    Key("groove", "angle", "of a V-belt's groove", math.pi, Range(0.0, math.pi, low_open=True)),
)


def _effort(item: Item, site: Site) -> str:
    """The key of an effort on this place: torque or force; the other one is noted."""
    own, other, moves = ("torque", "force", "rotates") if site.place.rotating else ("force", "torque", "translates")
    item.without([other], f'on "{site.place.name}", which {moves}', f"give a {own}")
    return own


def _resisting(item: Item, site: Site, law: load_models.Resistance, text: str) -> Modelled | None:
    """A resistance as a law of the speed, where there is no fault."""
    if not item.clean:
        return None
    variable = "omega" if site.on_shaft else "v"
    return Modelled(load_models.resistance_law(law, variable), f"{item.section.name}: {text}")


def _constant(item: Item, site: Site) -> Modelled | None:
    """A force or torque that does not depend on speed."""
    own = _effort(item, site)
    item.needs(own, f'"{site.place.name}" takes one')
    value = item.number(own)
    return _resisting(item, site, load_models.Resistance(value), f"{value:.6g} {site.unit} against the motion")


def _fan(item: Item, site: Site) -> Modelled | None:
    """A quadratic law through one point."""
    own = _effort(item, site)
    at, other, unit = ("speed", "velocity", "rad/s") if site.place.rotating else ("velocity", "speed", "m/s")
    item.without([other], f'on "{site.place.name}"', f"give a {at}")
    item.needs(at, "the characteristic passes through one point")
    exactly_one(item.given(own, "power"), (own, "power"), item.path, item.faults)
    source, speed, constant = item.one(own, "power"), item.number(at), item.number("constant")
    effort = item.number(source) / (speed if source == "power" else 1.0) if source else math.nan
    if constant > effort:
        item.add("constant", f"{constant:.6g} {site.unit}", f"at most the {effort:.6g} {site.unit} taken at that {at}")
    law = load_models.Resistance(constant, 0.0, load_models.quadratic_coefficient(effort, speed, constant))
    return _resisting(item, site, law, f"{effort:.6g} {site.unit} at {speed:.6g} {unit}")


def _losses(item: Item, site: Site) -> Modelled | None:
    """Shares that are constant, proportional to the speed, and to its square."""
    names = load_models.Resistance._fields
    given = item.given(*names)
    if not given:
        item.faults.add(item.path, f"none of {', '.join(names)}", "one of them at least")
    law = load_models.Resistance(*map(item.number, names))
    return _resisting(item, site, law, ", ".join(f"{name} {item.raw[name]}" for name in given))


def _belt(item: Item, site: Site) -> Modelled | None:
    """The drag of a belt, from its tensions or from a power; it must not slip."""
    if not site.place.rotating:
        item.add("type", f'a belt on "{site.place.name}", which translates', "a place that rotates")
    pulled = item.one("tight", "power") == "tight"
    for name in ("slack", "radius") if pulled else ("speed",):
        item.needs(name, f"there is a {'tight side' if pulled else 'power'}")
    item.without(("power", "speed") if pulled else ("slack", "radius", "friction", "wrap", "groove"), "beside it")
    if not pulled:
        torque = item.number("power") / item.number("speed")
    else:
        tight, slack = item.number("tight"), item.number("slack")
        torque = load_models.belt_torque(tight, slack, item.number("radius"))
        if tight <= slack:
            item.add("tight", f"{tight:.6g} N", f"more than the slack side's {slack:.6g} N")
        if item.given("friction", "wrap", "groove"):
            for name in ("friction", "wrap"):
                item.needs(name, "slip is checked with friction and wrap together")
            most = load_models.tension_ratio(*map(item.number, ("friction", "wrap", "groove")))
            if tight > most * slack * (1 + _SLIPS):
                found = f"a tight side of {tight:.6g} N on a slack side of {slack:.6g} N"
                item.add("tight", found, f"at most {most:.6g} times the slack side", "it slips; tighten the slack side")
    return _resisting(item, site, load_models.Resistance(torque), f"{torque:.6g} N m against the motion")


# -- presses and punches -----------------------------------------------------------------------------------------------


def _end(name: str, about: str) -> Key:
    return Key(name, "choice", about, "max", choices=("max", "min"))


_SOURCES = ("energy", "shear_strength", "energy_per_area")
_AREAS = ("diameter", "perimeter", "area")
_SHAPES = load_models.FORCE_SHAPES
_PRESS = (
    Key("energy", "energy", "of a stroke", None, POSITIVE),
    Key("shear_strength", "pressure", "of the sheet", None, POSITIVE),
    Key("energy_per_area", "energy per area", "of what is sheared", None, POSITIVE),
    Key("thickness", "length", "of the sheet", None, POSITIVE),
    Key("diameter", "length", "of a round hole", None, POSITIVE),
    Key("perimeter", "length", "of a hole", None, POSITIVE),
    Key("area", "area", "that is sheared", None, POSITIVE),
    Key("angle", "angle", "of the mechanism's crank before the end, at which the force begins", None, POSITIVE),
    Key("shape", "choice", "of the force: it stays, or it falls to nothing", load_models.CONSTANT, choices=_SHAPES),
    _end("end", "of the stroke towards which it presses: greatest or least displacement"),
    Key("overtravel", "length", "of the punch beyond the sheet", 0.0, NOT_NEGATIVE),
)


def _press(item: Item, site: Site) -> Modelled | None:
    """A press on a shaft over a window of the crank's angle, or on the port that it presses with."""
    source, sheared = item.one(*_SOURCES), item.one(*_AREAS)
    if not source:
        return None
    if source == "energy":
        item.without(_AREAS, "beside energy", "give the energy, or what it follows from")
        sheared = ""
    else:
        exactly_one(item.given(*_AREAS), _AREAS, item.path, item.faults)
    by_sheet = bool(sheared) and not (source == "energy_per_area" and sheared == "area")
    if by_sheet:
        item.needs("thickness", "the work of shearing follows from it")
    if not site.on_shaft:
        return _press_on_port(item, site, source, by_sheet)
    names = ("angle", "end", "overtravel", *(() if by_sheet else ("thickness",)))
    item.without(names, f'on "{site.place.name}"', "a shaft has no end of stroke: give the load's from and to")
    if site.window is None:
        found = f'a {item.section.name} on "{site.place.name}" without a window'
        expected = "from and to of its load, less than its period apart"
        item.faults.add(item.path, found, expected, "or put it on the port that presses")
    if not item.clean or site.window is None or site.every is None or math.isnan(site.window[0]):
        return None
    energy, shape = _energy(item, source), item.fields["shape"]
    law = load_models.shaft_law(energy, site.window, site.every, site.setting.shafts[site.place.name], shape)
    return Modelled(law, f"{item.section.name}: {energy:.6g} J, {shape}, over the load's window")


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


def _press_on_port(item: Item, site: Site, source: str, by_sheet: bool) -> Modelled | None:
    """A force (or a torque, where the port rotates) over the last of the way to the end of the stroke."""
    if "angle" not in item.raw and not by_sheet:
        because = "the force acts over the sheet's thickness, or over an angle before the end of the stroke"
        item.needs("angle" if site.place.rotating else "thickness", because)
    elif not by_sheet:
        item.without(["thickness"], "beside angle", "the force acts over one of them")
    if site.place.rotating:
        item.without(("thickness", "overtravel"), f'on "{site.place.name}", which rotates', "give an angle and the energy")
    if site.setting.sliding:
        item.without(["angle"], "of a driver that slides", "give the sheet's thickness")
    ends = site.ends(item)
    if ends is None:
        return None
    high, shape, unit = item.fields["end"] == "max", item.fields["shape"], "rad" if site.place.rotating else "m"
    past, stroke, energy = item.number("overtravel"), ends.high - ends.low, _energy(item, source)
    if "angle" in item.raw:
        angle = item.number("angle")
        covered = ends.before(high, angle)
        if covered is None:
            expected = f'an angle over which "{site.place.name}" moves towards that end'
            item.add("angle", f"{np.degrees(angle):.6g} deg", expected)
            return None
        if covered <= past:
            item.add("overtravel", f"{past:.6g} m", f"less than the {covered:.6g} m covered in that angle")
            return None
        travel = covered - past
    else:
        travel = item.number("thickness")
        if travel + past > stroke:
            found = f"{travel + past:.6g} m with what is beyond it" if past else f"{travel:.6g} m"
            item.add("thickness", found, f"at most the stroke of {stroke:.6g} m")
            return None
    press = load_models.Press(load_models.greatest_force(energy, travel, shape), travel, shape, past)
    law = load_models.press_law(press, ends.high if high else ends.low, high)
    return Modelled(law, f"{item.section.name}: {energy:.6g} J a stroke, {shape}, over {travel:.6g} {unit} before its end")


# -- gas on a piston ---------------------------------------------------------------------------------------------------

_ATMOSPHERE = Key("atmosphere", "pressure", "absolute pressure behind the piston", gas_forces.ATMOSPHERE, NOT_NEGATIVE)
_BORE = Key("bore", "length", "diameter of the cylinder", None, POSITIVE, True)
_WAYS = ("table", "position", "volume")
_INDICATOR = (
    _BORE,
    Key("rod", "length", "diameter of a rod that passes through this gas space", 0.0, NOT_NEGATIVE),
    _end("side", "end at which the cover of this gas space is: the greatest or the least displacement"),
    Key("table", "table", "pressure against angle"),
    Key("position", "numbers", "shares of the stroke from the cover, 0 to 1"),
    Key("volume", "numbers", "volumes instead, in any unit; the first and the last are those at the dead centres"),
    Key("out", "numbers", "pressures while the piston moves away from the cover"),
    Key("back", "numbers", "pressures while it returns"),
    Key("pressure_unit", "unit", "of out and back", "Pa"),
    Key("gauge", "flag", "true where pressures are those above the atmosphere"),
    _ATMOSPHERE,
)
_EXPONENT = Key("exponent", "number", "n of compression", None, Range(0.5, 10.0), True, example="1.3")
_AGAIN = "of the gas left in the clearance (default: exponent)"
_COMPRESSOR = (
    _BORE,
    Key("clearance", "number", "volume left at the cover, as a share of the swept volume", None, NOT_NEGATIVE, True),
    Key("suction", "pressure", "absolute", None, POSITIVE, True),
    Key("discharge", "pressure", "absolute", None, POSITIVE, True),
    _EXPONENT,
    _EXPONENT._replace(name="expansion_exponent", about=_AGAIN, required=False),
    Key("double_acting", "flag", "true where both sides of the piston compress"),
    Key("rod", "length", "diameter of the rod, on the side away from the cover", 0.0, NOT_NEGATIVE),
    _end("side", "end at which the cover is: the greatest or the least displacement"),
    _ATMOSPHERE,
)


def _slides(item: Item, site: Site) -> bool:
    """Checks that the model's place is a port that translates, as a piston does; notes a fault otherwise."""
    wrong = site.place.rotating or site.on_shaft
    if wrong:
        item.add("type", f'{item.section.name} on "{site.place.name}"', "a port that translates, as a piston does")
    return not wrong


def _piston(item: Item) -> tuple[float, float]:
    """Area of the bore without and with the rod taken off."""
    bore, rod = item.number("bore"), item.number("rod")
    if rod >= bore:
        item.add("rod", f"{rod:.6g} m", f"less than the bore of {bore:.6g} m")
    return gas_forces.piston_area(bore), gas_forces.piston_area(bore, rod)


def _space(area: float, ends: Ends, cover: str) -> gas_forces.Space:
    return gas_forces.Space(area, ends.high, ends.low) if cover == "max" else gas_forces.Space(area, ends.low, ends.high)


def _indicator(item: Item, site: Site) -> Modelled | None:
    """Pressure of an indicator diagram, against angle or against the piston's way."""
    area, gauge = _piston(item)[1], item.fields["gauge"]
    if gauge:
        item.without(["atmosphere"], "beside gauge pressures", "they are above it already")
    if not _slides(item, site):
        return None
    atmosphere = 0.0 if gauge else item.number("atmosphere")
    if "table" not in item.raw:
        return _against_way(item, site, area, atmosphere)
    item.without(("out", "back", "pressure_unit"), "beside a table", "its value and value_unit are the pressures")
    along = "length" if site.setting.sliding else "angle"
    table = read_table(item.raw["table"], "pressure", f"{item.path}.table", site.setting.folder, item.faults, along)
    if table is None:
        return None
    _check_pressures(item, "table", table.value)
    if not item.clean:
        return None
    sense = 1.0 if item.fields["side"] == "max" else 0.0
    force = gas_forces.gas_force(table.value, gas_forces.Space(area, sense, 1.0 - sense), atmosphere)
    return Modelled(replace(table, value=force), f"indicator: {table.angle.size} rows against angle", area)


def _against_way(item: Item, site: Site, area: float, atmosphere: float) -> Modelled | None:
    """A diagram with as many pressures out and back as places, which ascend from the cover."""
    for name in ("out", "back"):
        item.needs(name, "a diagram covers both strokes of the piston")
    names = (*item.given("position", "volume"), "out", "back")
    columns = [item.fields[name] for name in names]
    for name, column in zip(names, columns, strict=True):
        if column and max(map(abs, column)) > LARGEST:
            item.add(name, f"{max(map(abs, column)):.6g}", f"at most {LARGEST:g}")
            return None
    if len(columns) != 3 or any(column is None for column in columns):
        return None
    way, out, back = (np.array(column, dtype=float) for column in columns)
    name, steps, rows = names[0], np.diff(way), way.size
    if not rows == out.size == back.size:
        item.add(name, f"{rows} rows, {out.size} out and {back.size} back", "as many of each")
    elif not 2 <= rows <= _MOST_ROWS:
        item.add(name, f"{rows} rows", f"from 2 to {_MOST_ROWS}")
    elif (steps < 0).any() or steps[0] == 0 or steps[-1] == 0 or ((steps[1:] == 0) & (steps[:-1] == 0)).any():
        item.add(name, "rows that do not ascend", "rows that do, two equal ones inside at most: a jump")
    elif name == "position" and (way[0] != 0.0 or way[-1] != 1.0):
        item.add(name, f"shares from {way[0]:.6g} to {way[-1]:.6g}", "shares of the stroke from 0, at the cover, to 1")
    else:
        pressures = [_pressures(item, key, column) for key, column in (("out", out), ("back", back))]
        ends = site.ends(item)
        if ends is None:
            return None
        diagram = gas_forces.Indicator((way - way[0]) / (way[-1] - way[0]), *pressures)
        law = gas_forces.indicator_law(diagram, _space(area, ends, item.fields["side"]), atmosphere)
        return Modelled(law, f"indicator: {rows} rows against the piston's way", area)
    return None


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
        advice = "gauge = true for those above atmosphere"
        item.add(name, f"{pressure.min():.6g} Pa", "absolute pressures, 0 or above", advice)


def _compressor(item: Item, site: Site) -> Modelled | None:
    """A reciprocating compressor, single- or double-acting, which must draw in and deliver."""
    bore, crank_end = _piston(item)
    double, side = item.fields["double_acting"], item.fields["side"]
    if not double:
        item.without(["rod"], "of a single-acting compressor", "only a double-acting one has gas around it")
    again = "expansion_exponent" if "expansion_exponent" in item.raw else "exponent"
    cycle = gas_forces.Compression(*map(item.number, ("suction", "discharge", "clearance", "exponent", again)))
    if cycle.discharge <= cycle.suction:
        item.add("discharge", f"{cycle.discharge:.6g} Pa", f"more than the suction's {cycle.suction:.6g} Pa")
    elif cycle.suction_begins >= 1.0 or cycle.delivery_begins <= 0.0:
        found = f"a pressure ratio of {cycle.ratio:.6g} with a clearance of {cycle.clearance:.6g}"
        advice = "the gas left in the clearance fills the cylinder; compress in stages, or make the clearance less"
        item.add("clearance", found, "so little that gas is drawn in and delivered", advice)
    ends = site.ends(item) if _slides(item, site) else None
    if ends is None:
        return None
    other = _space(crank_end, ends, "min" if side == "max" else "max")
    spaces = (_space(bore, ends, side), *([other] if double else []))
    law = gas_forces.compressor_law(cycle, spaces, item.number("atmosphere"))
    work = sum(gas_forces.compressor_work(cycle, space.area * space.stroke) for space in spaces)
    acting = "double" if double else "single"
    return Modelled(law, f"compressor: {acting}-acting, ratio {cycle.ratio:.6g}, {work:.6g} J a double stroke")


_ENDS = (("torque",), ("force",), ("power",))
_ENERGY = (_SOURCES,)
_TYPES = (
    (Section("constant", "a force or torque against the motion", (_FORCE, _TORQUE), either=_ENDS[:2], reader=_constant),
     {"EFFORT": None}),
    (Section("fan", "a fan: it grows with the square of the speed", _FAN, either=_ENDS, reader=_fan),
     {"EFFORT": None, "SPEED": None}),
    (Section("pump", "a centrifugal pump: as a fan", _FAN, either=_ENDS, reader=_fan), {"EFFORT": None, "SPEED": None}),
    (Section("losses", "bearings, rolling, windage: constant, proportional and quadratic shares", _LOSSES, reader=_losses),
     {"constant": "EFFORT"}),
    (Section("belt", "the drag of a belt on its pulley", _BELT, one_of=(("tight", "power"),), reader=_belt),
     {"tight": "600 N", "slack": "200 N", "radius": "200 mm"}),
    (Section("press", "a press: the energy of a stroke, spent over its last part", _PRESS, one_of=_ENERGY, reader=_press),
     {"energy": "500 J", "thickness": "5 mm"}),
    (Section("punch", "a punch: as a press", _PRESS, one_of=_ENERGY, reader=_press),
     {"diameter": "20 mm", "thickness": "5 mm", "shear_strength": "300 MPa"}),
    (Section("indicator", "gas on a piston, from an indicator diagram", _INDICATOR, one_of=(_WAYS,), reader=_indicator),
     {"bore": "80 mm", "position": [0, 1], "out": [1e5, 1e5], "back": [1e5, 1e5]}),
    (Section("compressor", "gas of a reciprocating compressor", _COMPRESSOR, reader=_compressor),
     {"bore": "80 mm", "clearance": 0.05, "suction": "1 bar", "discharge": "6 bar", "exponent": 1.3}),
)  # fmt: skip
TYPE = Key("type", "choice", "of the machine", required=True, choices=tuple(model.name for model, _ in _TYPES))
LOAD_MODELS = {model.name: model._replace(keys=(TYPE, *model.keys), begin=begin) for model, begin in _TYPES}
"""What a load's model may be: its keys, what reads a law from them, and how it begins on a form."""
