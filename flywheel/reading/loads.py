"""Loads, springs, added inertias and the drive of a scene: their places, windows and laws.

`LOAD_MODELS` has a line for each known kind of load, `[[load]] model = {type = ..., ...}`: its keys and its reader,
which checks the values and returns the law.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from flywheel.components import load_models
from flywheel.mechanisms.families import Ends, ends_of
from flywheel.numerics.expressions import Expression, Node, expression_of, numeral
from flywheel.numerics.faults import SceneError, coordinate_text, quote, show
from flywheel.numerics.units import DIMENSIONS, LARGEST, QuantityError, convert, parse_unit
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
    read_typed,
    whole,
)
from flywheel.reading.schema import CLUTCH, MOST_TABLES, MOST_TURNS, SECTIONS, SINGLE_STROKE_EXCLUDE, Section
from flywheel.reading.tables import fit_period, fit_stroke, fit_window, read_effort, read_table
from flywheel.scene.scene import (
    NOT_NEGATIVE,
    POSITIVE,
    Brake,
    Clutch,
    Damper,
    Inertia,
    Key,
    Law,
    Load,
    Mechanism,
    Quantity,
    Range,
    SingleStroke,
    Spring,
    Table,
)

if TYPE_CHECKING:
    from flywheel.components.motors import Motor


_SLIPS = 1e-9  # share by which a ratio of tensions may pass its limit
_MOST_ROWS = 100  # of an indicator diagram against the piston's position


class Site(NamedTuple):
    """Place of a model, its load's window and period (rad); None if it always acts, or if unknown."""

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
        """The ends of the stroke of the port; None after noting that it has none, or if other faults were noted.

        A mechanism that cannot be built, or has a parameter at fault, has been noted by its own reading.
        """
        if not item.clean:
            return None
        name, _, port = self.place.name.rpartition(".")
        if not self.place.returns:
            defect = f'a {item.section.name} on "{self.place.name}", which does not come back'
            item.faults.add(item.path, defect, "a port with a stroke")
            return None
        mechanism: Mechanism | None = next((m for m in self.places.mechanisms if m.name == name), None)
        if mechanism is None or any(value != value for value in self.setting.parameters.values()):
            return None
        try:
            return ends_of(mechanism, port, self.setting.parameters)
        except SceneError as error:
            item.faults.extend(fault for fault in error.faults if fault not in item.faults)
        except ArithmeticError:
            pass
        return None


Modelled = tuple[Expression | Table, str, tuple[Quantity, ...], float | None]
"""The law of a model, its description with the quantities in it, and the piston's area (m²) if it is a gas."""


def _stated(value: float, dimension: str) -> Quantity:
    """A quantity of a description."""
    return f"{value:.6g} {DIMENSIONS[dimension].si}", value, dimension


def read_model(raw: object, path: str, site: Site | None, faults: Faults) -> Modelled | None:
    """The law of a load's model; None after noting faults, of its own keys alone if its place is not known."""
    if site is None:  # which keys exclude each other is left until its place is right
        read_typed(raw, TYPE, {name: model._replace(one_of=()) for name, model in LOAD_MODELS.items()}, path, faults)
        return None
    item = read_typed(raw, TYPE, LOAD_MODELS, path, faults, site.place.rotating)
    if item is None or item.section.reader is None:
        return None
    model: Modelled | None = item.section.reader(item, site)
    return model if item.clean else None


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


def _resisting(item: Item, site: Site, law: load_models.Resistance, text: str, *quantities: Quantity) -> Modelled | None:
    """A resistance as a law of the speed, if there is no fault."""
    if not item.clean:
        return None
    variable = "omega" if site.on_shaft else "v"
    return load_models.resistance_law(law, variable), f"{item.section.name}: {text}", quantities, None


def _constant(item: Item, site: Site) -> Modelled | None:
    """A force or torque that does not depend on speed."""
    own = _effort(item, site)
    item.needs(own, f'"{site.place.name}" takes one')
    effort = _stated(item.number(own), own)
    return _resisting(item, site, load_models.Resistance(effort[1]), f"{effort[0]} against the motion", effort)


def _fan(item: Item, site: Site) -> Modelled | None:
    """A quadratic law through one point."""
    own = _effort(item, site)
    at, other = ("speed", "velocity") if site.place.rotating else ("velocity", "speed")
    item.without([other], f'on "{site.place.name}"', f"give a {at}")
    item.needs(at, "the characteristic passes through one point")
    exactly_one(item.present(own, "power"), (own, "power"), item.path, item.faults)
    source, speed, constant = item.one(own, "power"), item.number(at), item.number("constant")
    effort = item.number(source) / (speed if source == "power" else 1.0) if source else math.nan
    if constant > effort:
        item.add("constant", f"{constant:.6g} {site.unit}", f"at most the {effort:.6g} {site.unit} taken at that {at}")
    law = load_models.Resistance(constant, 0.0, load_models.quadratic_coefficient(effort, speed, constant))
    point = _stated(effort, own), _stated(speed, at)
    text = f"{effort:.6g} {site.unit} at {speed:.6g} {DIMENSIONS[at].si}"
    return _resisting(item, site, law, text, *point)


def _losses(item: Item, site: Site) -> Modelled | None:
    """Shares that are constant, proportional to the speed, and to its square."""
    names = load_models.Resistance._fields
    present = item.present(*names)
    if not present:
        item.faults.add(item.path, f"none of {', '.join(names)}", "one of them at least")
    law, constant = load_models.Resistance(*map(item.number, names)), item.raw.get("constant")
    written = (constant, law.constant, "torque" if site.place.rotating else "force")
    quantities = (written,) if isinstance(constant, str) else ()
    return _resisting(item, site, law, ", ".join(f"{name} {item.raw[name]}" for name in present), *quantities)


def _belt(item: Item, site: Site) -> Modelled | None:
    """The drag of a belt, from its tensions or from a power; it must not slip."""
    if not site.place.rotating:
        item.add("type", f'a belt on "{site.place.name}", which translates', "a place that rotates")
    pulled = item.one("tight", "power") == "tight"
    for name in ("slack", "radius") if pulled else ("speed",):
        item.needs(name, f"there is a {'tight side' if pulled else 'power'}")
    item.without(("power", "speed") if pulled else ("slack", "radius", "friction", "wrap", "groove"), "together with it")
    if not pulled:
        torque = item.number("power") / item.number("speed")
    else:
        tight, slack = item.number("tight"), item.number("slack")
        torque = load_models.belt_torque(tight, slack, item.number("radius"))
        if tight <= slack:
            item.add("tight", f"{tight:.6g} N", f"more than the slack side's {slack:.6g} N")
        if item.present("friction", "wrap", "groove"):
            for name in ("friction", "wrap"):
                item.needs(name, "slip is checked with friction and wrap together")
            most = load_models.tension_ratio(*map(item.number, ("friction", "wrap", "groove")))
            if tight > most * slack * (1 + _SLIPS):
                defect = f"a tight side of {tight:.6g} N on a slack side of {slack:.6g} N"
                item.add("tight", defect, f"at most {most:.6g} times the slack side", "it slips; tighten the slack side")
    drag = _stated(torque, "torque")
    return _resisting(item, site, load_models.Resistance(torque), f"{drag[0]} against the motion", drag)


# -- presses and punches -----------------------------------------------------------------------------------------------


def _end(name: str, about: str) -> Key:
    return Key(name, "choice", about, "max", choices=("max", "min"))


_SOURCES = ("energy", "shear_strength", "energy_per_area")
_AREAS = ("diameter", "perimeter", "area")
_SHAPES = load_models.FORCE_SHAPES
_PRESS = (
    Key("energy", "energy", "of a stroke", None, POSITIVE),
    Key("shear_strength", "pressure", "of the sheet", None, POSITIVE),
    Key("energy_per_area", "energy per area", "of the sheared area", None, POSITIVE),
    Key("thickness", "length", "of the sheet", None, POSITIVE),
    Key("diameter", "length", "of a round hole", None, POSITIVE),
    Key("perimeter", "length", "of a hole", None, POSITIVE),
    Key("area", "area", "that is sheared", None, POSITIVE),
    Key("angle", "angle", "of the mechanism's crank before the end, at which the force begins", None, POSITIVE),
    Key("shape", "choice", "of the force: constant, or falling to zero", load_models.CONSTANT, choices=_SHAPES),
    _end("end", "of the stroke towards which it presses: greatest or least displacement"),
    Key("overtravel", "length", "of the punch beyond the sheet", 0.0, NOT_NEGATIVE),
)


def _press(item: Item, site: Site) -> Modelled | None:
    """A press on a shaft over a window of the crank's angle, or on the port of its ram."""
    source, sheared = item.one(*_SOURCES), item.one(*_AREAS)
    if not source:
        return None
    if source == "energy":
        item.without(_AREAS, "together with energy", "give the energy, or what it follows from")
        sheared = ""
    else:
        exactly_one(item.present(*_AREAS), _AREAS, item.path, item.faults)
    by_sheet = bool(sheared) and not (source == "energy_per_area" and sheared == "area")
    if by_sheet:
        item.needs("thickness", "the work of shearing follows from it")
    if not site.on_shaft:
        return _press_on_port(item, site, source, by_sheet)
    names = ("angle", "end", "overtravel", *(() if by_sheet else ("thickness",)))
    item.without(names, f'on "{site.place.name}"', "a shaft has no end of stroke: give the load's from and to")
    if site.window is None:
        defect = f'a {item.section.name} on "{site.place.name}" without a window'
        expected = "from and to of its load, less than its period apart"
        item.faults.add(item.path, defect, expected, "or put it on the port that presses")
    if not item.clean or site.window is None or site.every is None or math.isnan(site.window[0]):
        return None
    energy, shape = _energy(item, source), item.fields["shape"]
    law = load_models.shaft_law(energy, site.window, site.every, site.setting.shafts[site.place.name], shape)
    work = _stated(energy, "energy")
    return law, f"{item.section.name}: {work[0]}, {shape}, over the load's window", (work,), None


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
    """A force (or a torque, if the port rotates) over the last part of the travel to the end of the stroke."""
    if "angle" not in item.raw and not by_sheet:
        because = "the force acts over the sheet's thickness, or over an angle before the end of the stroke"
        item.needs("angle" if site.place.rotating else "thickness", because)
    elif not by_sheet:
        item.without(["thickness"], "together with angle", "the force acts over one of them")
    if site.place.rotating:
        item.without(("thickness", "overtravel"), f'on "{site.place.name}", which rotates', "give an angle and the energy")
    if site.setting.sliding:
        item.without(["angle"], "of a driver that slides", "give the sheet's thickness")
    ends = site.ends(item)
    if ends is None:
        return None
    high, shape = item.fields["end"] == "max", item.fields["shape"]
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
            defect = f"{travel + past:.6g} m with what is beyond it" if past else f"{travel:.6g} m"
            item.add("thickness", defect, f"at most the stroke of {stroke:.6g} m")
            return None
    press = load_models.Press(load_models.greatest_force(energy, travel, shape), travel, shape, past)
    law = load_models.press_law(press, ends.high if high else ends.low, high)
    work, way = _stated(energy, "energy"), _stated(travel, "angle" if site.place.rotating else "length")
    return law, f"{item.section.name}: {work[0]} a stroke, {shape}, over {way[0]} before its end", (work, way), None


# -- gas on a piston ---------------------------------------------------------------------------------------------------

_ATMOSPHERE = Key("atmosphere", "pressure", "absolute pressure behind the piston", load_models.ATMOSPHERE, NOT_NEGATIVE)
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
    """Area of the bore without and with the rod subtracted."""
    bore, rod = item.number("bore"), item.number("rod")
    if rod >= bore:
        item.add("rod", f"{rod:.6g} m", f"less than the bore of {bore:.6g} m")
    return load_models.piston_area(bore), load_models.piston_area(bore, rod)


def _space(area: float, ends: Ends, cover: str) -> load_models.Space:
    return load_models.Space(area, ends.high, ends.low) if cover == "max" else load_models.Space(area, ends.low, ends.high)


def _indicator(item: Item, site: Site) -> Modelled | None:
    """Pressure of an indicator diagram, against angle or against the piston's travel."""
    area, gauge = _piston(item)[1], item.fields["gauge"]
    if gauge:
        item.without(["atmosphere"], "together with gauge pressures", "they are above it already")
    if not _slides(item, site):
        return None
    atmosphere = 0.0 if gauge else item.number("atmosphere")
    if "table" not in item.raw:
        return _against_way(item, site, area, atmosphere)
    item.without(("out", "back", "pressure_unit"), "together with a table", "its value and value_unit are the pressures")
    along = "length" if site.setting.sliding else "angle"
    table = read_table(item.raw["table"], "pressure", f"{item.path}.table", site.setting.folder, item.faults, along)
    if table is None:
        return None
    _check_pressures(item, "table", table.value)
    if not item.clean:
        return None
    sense = 1.0 if item.fields["side"] == "max" else 0.0
    force = load_models.gas_force(table.value, load_models.Space(area, sense, 1.0 - sense), atmosphere)
    return replace(table, value=force), f"indicator: {table.angle.size} rows against angle", (), area


def _against_way(item: Item, site: Site, area: float, atmosphere: float) -> Modelled | None:
    """A diagram with one pressure out and one back for each place, which ascend from the cover."""
    for name in ("out", "back"):
        item.needs(name, "a diagram covers both strokes of the piston")
    names = (*item.present("position", "volume"), "out", "back")
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
        item.add(name, f"{rows} rows, {out.size} out and {back.size} back", "the same number of each")
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
        diagram = load_models.Indicator((way - way[0]) / (way[-1] - way[0]), *pressures)
        law = load_models.indicator_law(diagram, _space(area, ends, item.fields["side"]), atmosphere)
        return law, f"indicator: {rows} rows against the piston's way", (), area
    return None


def _pressures(item: Item, name: str, column: load_models.Array) -> load_models.Array:
    """Valid pressures in Pa; after noting a fault, those given."""
    unit = item.fields["pressure_unit"]
    try:
        scale = parse_unit(unit if isinstance(unit, str) else show(unit), "pressure")
        pressure = np.array([convert(p, scale) for p in column])
    except QuantityError as error:
        item.add("pressure_unit", error.defect, error.expected, error.advice)
        return column
    _check_pressures(item, name, pressure)
    return pressure


def _check_pressures(item: Item, name: str, pressure: load_models.Array) -> None:
    """Notes absolute pressures below 0 or beyond the range of computation."""
    if np.abs(pressure).max() > LARGEST:
        item.add(name, f"{np.abs(pressure).max():.6g} Pa", f"at most {LARGEST:g} Pa")
    elif pressure.min() < 0.0 and not item.raw.get("gauge"):
        advice = "gauge = true for those above atmosphere"
        item.add(name, f"{pressure.min():.6g} Pa", "absolute pressures, 0 or above", advice)


def _compressor(item: Item, site: Site) -> Modelled | None:
    """A reciprocating compressor, single- or double-acting, which must draw in and deliver gas."""
    bore, crank_end = _piston(item)
    double, side = item.fields["double_acting"], item.fields["side"]
    if not double:
        item.without(["rod"], "of a single-acting compressor", "only a double-acting one has gas around it")
    again = "expansion_exponent" if "expansion_exponent" in item.raw else "exponent"
    cycle = load_models.Compression(*map(item.number, ("suction", "discharge", "clearance", "exponent", again)))
    if cycle.discharge <= cycle.suction:
        item.add("discharge", f"{cycle.discharge:.6g} Pa", f"more than the suction's {cycle.suction:.6g} Pa")
    elif cycle.suction_begins >= 1.0 or cycle.delivery_begins <= 0.0:
        defect = f"a pressure ratio of {cycle.ratio:.6g} with a clearance of {cycle.clearance:.6g}"
        advice = "the gas left in the clearance fills the cylinder; compress in stages, or reduce the clearance"
        item.add("clearance", defect, "small enough for gas to be drawn in and delivered", advice)
    ends = site.ends(item) if _slides(item, site) else None
    if ends is None:
        return None
    other = _space(crank_end, ends, "min" if side == "max" else "max")
    spaces = (_space(bore, ends, side), *([other] if double else []))
    law = load_models.compressor_law(cycle, spaces, item.number("atmosphere"))
    work = _stated(sum(load_models.compressor_work(cycle, space.area * space.stroke) for space in spaces), "energy")
    acting = "double" if double else "single"
    return law, f"compressor: {acting}-acting, ratio {cycle.ratio:.6g}, {work[0]} a double stroke", (work,), None


_ENDS = (("torque",), ("force",), ("power",))
_ENERGY = (_SOURCES,)
_TYPES = (
    Section("constant", "a force or torque against the motion", (_FORCE, _TORQUE), either=_ENDS[:2], reader=_constant,
            begin={"EFFORT": None}),
    Section("fan", "a fan: it grows with the square of the speed", _FAN, either=_ENDS, reader=_fan,
            begin={"EFFORT": None, "SPEED": None}),
    Section("pump", "a centrifugal pump: as a fan", _FAN, either=_ENDS, reader=_fan, begin={"EFFORT": None, "SPEED": None}),
    Section("losses", "bearings, rolling, windage: constant, proportional and quadratic shares", _LOSSES, reader=_losses,
            begin={"constant": "EFFORT"}),
    Section("belt", "the drag of a belt on its pulley", _BELT, one_of=(("tight", "power"),), reader=_belt,
            begin={"tight": "600 N", "slack": "200 N", "radius": "200 mm"}),
    Section("press", "a press: the energy of a stroke, spent over its last part", _PRESS, one_of=_ENERGY, reader=_press,
            begin={"energy": "500 J", "thickness": "5 mm"}),
    Section("punch", "a punch: as a press", _PRESS, one_of=_ENERGY, reader=_press,
            begin={"diameter": "20 mm", "thickness": "5 mm", "shear_strength": "300 MPa"}),
    Section("indicator", "gas on a piston, from an indicator diagram", _INDICATOR, one_of=(_WAYS,), reader=_indicator,
            begin={"bore": "80 mm", "position": [0, 1], "out": [1e5, 1e5], "back": [1e5, 1e5]}),
    Section("compressor", "gas of a reciprocating compressor", _COMPRESSOR, reader=_compressor,
            begin={"bore": "80 mm", "clearance": 0.05, "suction": "1 bar", "discharge": "6 bar", "exponent": 1.3}),
)  # fmt: skip
TYPE = Key("type", "choice", "of the machine", required=True, choices=tuple(model.name for model in _TYPES))
LOAD_MODELS = {model.name: model._replace(keys=(TYPE, *model.keys)) for model in _TYPES}
"""Models of loads: keys, reader of the law, and initial values on a form."""


_SAME_ANGLE = 1e-12  # share of a period within which two angles are one
_ROUNDED = 1e-15  # share of a period by which rounding alone may miss its seam


Window = tuple[float, float] | None
"""Window of a load: from an angle to another (rad; m along a stroke); None: always."""
UNREAD = (math.nan, math.nan)
"""The window of a load whose window could not be read."""


def _listed(raw: object, section: Section, places: Places, setting: Setting) -> Iterator[tuple[Item, Place | None]]:
    """The tables of an array, `load[0]`, `load[1]`..., each with its place; a single table is a fault, but read."""
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


def read_elements(raw: Mapping[str, Any], places: Places, drags: Mapping[str, float], setting: Setting) -> dict[str, Any]:
    """Inertias, springs, dampers and loads, each a tuple of those that could be read.

    drags: constant torques (N m) against the rotation of shafts, by their names; they are loads too.
    """
    inertias, springs, dampers, loads = list[Inertia](), list[Spring](), list[Damper](), list[Load]()
    for item, place in _listed(raw.get("inertia"), SECTIONS["inertia"], places, setting):
        present = item.present("value", "gd2")
        if not present:
            item.add("value", "nothing", "a mass or an inertia, or gd2")
        elif len(present) > 1:
            exactly_one(present, ("value", "gd2"), item.path, item.faults)
        elif present == ["gd2"] and place is not None and not place.rotating:
            item.add("gd2", f'a GD² on "{place.name}", which translates', "a mass, in value")
        value = item.fields["gd2" if "gd2" in present else "value"]
        if place is not None and value is not None:
            inertias.append(Inertia(place.name, value, item.path))
    section = SECTIONS["load"]
    if setting.sliding:  # windows are stretches of the slide's way
        keys = tuple(key._replace(kind="length") if key.kind == "angle" else key for key in section.keys)
        section = section._replace(keys=keys)
    for item, place in _listed(raw.get("load"), section, places, setting):
        load = _load(item, place, places, setting)
        if load is not None:
            loads.append(load)
    if setting.cycle is not None:
        every, once = setting.cycle, setting.stroke is not None
        loads += [
            Load(name, -drag, every, path=f"{child('shafts', name)}.drag", once=once, drag=True)
            for name, drag in drags.items()
        ]
    for item, place in _listed(raw.get("spring"), SECTIONS["spring"], places, setting):
        stiffness, rest = item.fields["stiffness"], item.fields["rest"]
        if place is not None and not place.returns:
            item.add("on", show(item.raw["on"]), "a place that comes back to where it was each cycle")
        elif place is not None and stiffness is not None and rest is not None:
            springs.append(Spring(place.name, stiffness, rest, item.path))
    for item, place in _listed(raw.get("damper"), SECTIONS["damper"], places, setting):
        if place is not None and item.fields["coefficient"] is not None:
            dampers.append(Damper(place.name, item.fields["coefficient"], item.path))
    return {"inertias": tuple(inertias), "loads": tuple(loads), "springs": tuple(springs), "dampers": tuple(dampers)}


def read_single_stroke(raw: Mapping[str, Any], places: Places, setting: Setting) -> SingleStroke | None:
    """Clutch, brake and rate of a machine that works stroke by stroke; None if it does not, or after faults."""
    faults, clutches, shafts = setting.faults, dict[str, Item](), raw.get("shafts")
    for name, written in shafts.items() if isinstance(shafts, Mapping) else ():
        if isinstance(written, Mapping) and "clutch" in written:
            path = f"{child('shafts', name)}.clutch"
            table = as_table(written["clutch"], path, faults)
            if name == "crank":
                faults.add(path, "a clutch on the crank", "one on the shaft that drives it", "name that shaft")
            if table is not None:
                clutches[name] = read_item(table, CLUTCH, path, faults)
    brakes = list(_listed(raw.get("brake"), SECTIONS["brake"], places, setting))
    if "single_stroke" not in raw:
        advice = "give rate or idle there, or leave it out"
        for path in (*(f"{item.path}" for item in clutches.values()), *(item.path for item, _ in brakes)):
            faults.add(path, "nothing to engage it", "a table [single_stroke]", advice)
        return None
    for name in SINGLE_STROKE_EXCLUDE:
        if name in raw:
            advice = {"stroke": "[stroke] is a driver that goes one way"}.get(name, "")
            faults.add(name, f"{name} together with [single_stroke]", "one of the two", advice)
    table = as_table(raw["single_stroke"], "single_stroke", faults)
    plan = None if table is None else read_item(table, SECTIONS["single_stroke"], "single_stroke", faults)
    if len(clutches) != 1:
        defect = f"{len(clutches)} clutches" if clutches else "no clutch"
        faults.add("shafts", defect, "one", 'write clutch = {torque = "900 N m", disengage = "330 deg"} in a shaft\'s table')
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
            defect = f"{math.degrees(angle):.6g} deg, and stop_at at {math.degrees(stop_at):.6g} deg"
            item.add(key, defect, "the same angle", "a stroke begins where the crank was stopped: leave it out")
    for key in ("response", "intrusion"):
        if key in plan.raw and plan.fields["approach"] is None and "approach" not in plan.raw:
            plan.add(
                key,
                show(plan.raw[key]),
                "approach together with it",
                "the safety distance is approach times the stopping time",
            )
    torque = clutch.fields["torque"]
    static = torque if clutch.fields["static_torque"] is None else clutch.fields["static_torque"]
    if torque is not None and static < torque:
        clutch.add("static_torque", show(clutch.raw["static_torque"]), f"at least the {'torque'} of {torque:g} N m")
    if not (plan.clean and clutch.clean and brake.clean):
        return None
    shared = ("rise", "fall", "heat_per_stroke", "heat_per_hour")
    braking, reverse = brake.fields["torque"], brake.fields["reverse_torque"]
    reverse = braking if reverse is None else reverse
    return SingleStroke(
        Clutch(on, torque, clutch.fields["disengage"], static, *(clutch.fields[name] for name in (*shared, "hold"))),
        Brake(shaft, braking, reverse, brake.fields["engage"], *(brake.fields[name] for name in shared)),
        plan.fields["rate"],
        plan.fields["idle"],
        stop_at,
        count or 1,
        plan.fields["approach"],
        plan.fields["response"],
        plan.fields["intrusion"],
        plan.fields["inch"],
    )


def _load(item: Item, place: Place | None, places: Places, setting: Setting) -> Load | None:
    """One load; None if it could not be read."""
    fields, path, faults, stroke = item.fields, item.path, item.faults, setting.stroke
    if stroke is not None:
        item.without(["every"], "together with [stroke]", "nothing repeats along a stroke")
    every = setting.cycle if stroke is not None else _every(fields["every"], place, path, setting)
    window = _window(item, every, setting)
    text, senses = fields["while"], {"": 0, "v>0": 1, "v<0": -1}
    sense = senses.get(re.sub(r"\s", "", (text or "")[:100]))
    if sense is None or (text is not None and not sense):
        item.add("while", show(text), '"v > 0" or "v < 0"')
    law, model, quantities, piston = _law(item, place, places, (window, every), setting)
    if fields["bore"] is not None:
        if "model" in item.raw:
            item.add("bore", "a bore together with a model", "none", "an indicator diagram has a bore of its own")
        elif place is not None and (place.rotating or place.name in places.shafts):
            item.add("bore", f'a bore on "{place.name}"', "a port that translates, as a piston does")
        from flywheel.components.load_models import piston_area  # only cylinders have a bore

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
    where = (place.name, law, every, start, end, sense or 0, path, stroke is not None)
    return Load(*where, model, quantities, piston, factor or 0.0)


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
) -> tuple[Law | None, str, tuple[Quantity, ...], float | None]:
    """The law of a load; if it comes from a model, its description with quantities, and the area of its piston."""
    raw, path, key = item.raw, item.path, item.one("force", "torque", "table", "model")
    if key == "model":
        site = None if place is None else Site(place, places, *acting, setting)
        return read_model(raw["model"], f"{path}.model", site, item.faults) or (None, "", (), None)
    if key == "table":
        dimension = None if place is None else ("torque" if place.rotating else "force")
        along = "length" if setting.sliding else "angle"
        return read_table(raw["table"], dimension, f"{path}.table", setting.folder, item.faults, along), "", (), None
    if key and place is not None and place.rotating != (key == "torque"):
        moves, other = ("rotates", "torque") if place.rotating else ("translates", "force")
        item.add(key, f'a {key} on "{place.name}", which {moves}', f"a {other}")
        return None, "", (), None
    return read_effort(raw[key], key, f"{path}.{key}", setting) if key else None, "", (), None


def _every(values: float | None, place: Place | None, path: str, setting: Setting) -> float | None:
    """The angle after which the load repeats: it divides the travel of the load's angle."""
    if place is None or place.travel is None or setting.cycle is None:
        return None
    path, travel = f"{path}.every", f"the {np.degrees(place.travel):.10g} deg that its angle travels in a cycle"
    if values is None:
        period = default_period(place.travel, setting.cycle)
        if period is None:
            setting.faults.add(path, "nothing", f"an angle that divides {travel}", "the cycle does not")
        return period
    repeats = whole(place.travel / values)
    if repeats is None or repeats > MOST_TURNS:
        defect = f"{np.degrees(values):.10g} deg"
        setting.faults.add(path, defect, f"an angle that divides {travel}, {MOST_TURNS} times at most")
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
        first, last = (coordinate_text(end, stroke.sliding) for end in (stroke.start, stroke.end))
        ends = f"{first} to {last}, as the stroke goes"
        beyond = [at for at in (start, end) if not stroke.start - slack <= at <= stroke.end + slack]
        if beyond:
            item.add(
                "from" if beyond[0] == start else "to", coordinate_text(beyond[0], stroke.sliding), f"a place from {ends}"
            )
        elif end - start <= slack:
            item.add("to", coordinate_text(end, stroke.sliding), "a position beyond the beginning of the load")
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
        defect = f"a window of {np.degrees(end - start):.10g} deg"
        item.add("to", defect, f"one of {period} deg at most, after which it repeats")
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
    present, misplaced = ([name for name in names if name in table] for names in (valid, wrong))
    for name in misplaced:
        faults.add(f"drive.{name}", f'a {name} on "{element}", which {moves}', f"a {valid[0]}")
    if len(present) > 1:
        exactly_one(present, valid, "drive", faults)
    elif not present and not misplaced:
        key = next(key for key in keys if key.name == valid[0])
        faults.add(f"drive.{valid[0]}", "nothing", expectation(key), "or a motor" if "motor" in valid else "")
    motor: Motor | None = None
    law: Law | None = None
    balance = present in (["torque"], ["force"]) and isinstance(table[present[0]], str) and table[present[0]] == "balance"
    if present == ["motor"]:
        from flywheel.reading.motors import read_motor  # only scenes with a motor need it

        motor = read_motor(table["motor"], "drive.motor", setting)
        law = None if motor is None else motor.law()
    elif len(present) == 1 and not balance:
        law = read_effort(table[present[0]], present[0], f"drive.{present[0]}", setting)
    if setting.cycle is None or (law is None and not balance):
        return Drive(None, balance)
    title = "" if motor is None else motor.title
    return Drive(Load(shaft, law, setting.cycle, path="drive", once=setting.stroke is not None, model=title), balance, motor)
