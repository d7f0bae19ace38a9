"""Load models of gas on a piston: indicator diagram and reciprocating compressor."""

from __future__ import annotations

import numpy as np

from flywheel.advice import show
from flywheel.load_models import compressors, gas
from flywheel.mechanisms.ends import Ends
from flywheel.reading.model_items import Item, Made, Modelled, ends_of_port
from flywheel.reading.schema_load import MOST_ROWS
from flywheel.reading.tables import listed_numbers, read_table
from flywheel.units import LARGEST, QuantityError, convert, parse_unit


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
    return gas.piston_area(bore), gas.piston_area(bore, rod)


def _space(area: float, ends: Ends, cover: str) -> gas.Space:
    return gas.Space(area, ends.high, ends.low) if cover == "max" else gas.Space(area, ends.low, ends.high)


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
        force = gas.gas_force(table.value, gas.Space(area, sense, 1.0 - sense), atmosphere)
        return Modelled(table._replace(value=force), f"indicator: {table.angle.size} rows against angle", area)

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
        diagram = gas.Indicator(share, *pressures)
        law = gas.indicator_law(diagram, _space(area, ends, item.fields["side"]), atmosphere)
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


def _pressures(item: Item, name: str, column: gas.Array) -> gas.Array:
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


def _check_pressures(item: Item, name: str, pressure: gas.Array) -> None:
    """Absolute pressures are not below 0, and none is beyond what can be computed with."""
    if np.abs(pressure).max() > LARGEST:
        item.add(name, f"{np.abs(pressure).max():.6g} Pa", f"at most {LARGEST:g} Pa")
    elif pressure.min() < 0.0 and not item.raw.get("gauge"):
        item.add(
            name, f"{pressure.min():.6g} Pa", "absolute pressures, 0 or above", "gauge = true for those above atmosphere"
        )


def _fits(item: Item, way: gas.Array, out: gas.Array, back: gas.Array) -> bool:
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
        law = compressors.compressor_law(cycle, spaces, item.number("atmosphere"))
        work = sum(compressors.compressor_work(cycle, space.area * space.stroke) for space in spaces)
        acting = "double" if double else "single"
        return Modelled(law, f"compressor: {acting}-acting, ratio {cycle.ratio:.6g}, {work:.6g} J a double stroke")

    return made


def _compression(item: Item) -> compressors.Compression:
    """The cycle of a compressor, which must draw in and deliver."""
    again = "expansion_exponent" if "expansion_exponent" in item.raw else "exponent"
    names = ("suction", "discharge", "clearance", "exponent", again)
    cycle = compressors.Compression(*map(item.number, names))
    if cycle.discharge <= cycle.suction:
        item.add("discharge", f"{cycle.discharge:.6g} Pa", f"more than the suction's {cycle.suction:.6g} Pa")
    elif cycle.suction_begins >= 1.0 or cycle.delivery_begins <= 0.0:
        found = f"a pressure ratio of {cycle.ratio:.6g} with a clearance of {cycle.clearance:.6g}"
        advice = "the gas left in the clearance fills the cylinder; compress in stages, or make the clearance less"
        item.add("clearance", found, "so little that gas is drawn in and delivered", advice)
    return cycle
