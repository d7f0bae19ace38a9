"""Mechanisms of a scene: their tables, turns in a cycle or stroke, the laws of `law`, and the ports that they offer."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from flywheel.mechanisms import KINDS
from flywheel.mechanisms.families import Kind, build, stroke_ranges
from flywheel.numerics.faults import Fault, SceneError, quote, show, suggestion, told
from flywheel.numerics.units import QuantityError, parse_quantity
from flywheel.reading.fields import (
    Faults,
    Place,
    Places,
    Setting,
    as_table,
    check_name,
    child,
    default_period,
    items,
    read_fields,
    read_item,
    whole,
)
from flywheel.reading.schema import MECHANISM, MOST_MECHANISMS, MOST_TURNS, OUTPUT, SECTIONS, STROKE_EXCLUDE, TURN
from flywheel.reading.tables import fitted, read_law, repeats
from flywheel.scene.keys import Key
from flywheel.scene.scene import Body, Mechanism, Output, Stroke, Table

_SHORTEST = 1e-9  # of a stroke, as a share of the coordinates at its ends


def read_stroke(raw: Mapping[str, Any], faults: Faults) -> Stroke | None:
    """The stroke of a scene whose driver moves one way; None if it turns in cycles.

    Its numbers are NaN if they could not be read, so that the rest can be read against it all the same.
    """
    slides = driver_slides(raw)
    unread = Stroke(math.nan, math.nan, None, math.nan, slides is not False)
    if "stroke" not in raw:
        if not slides:
            return None
        beside = " and ".join(f"[{name}]" for name in ("regime", "flywheel") if name in raw)
        advice = "the mechanism's driver slides, so that there is no cycle" + (f": leave out {beside}" if beside else "")
        faults.add("stroke", "nothing", "a table with from and to, between which the driver moves", advice)
        return unread
    for name in STROKE_EXCLUDE:
        if name in raw:
            faults.add(name, f"{name} together with [stroke]", "none", "a one-way stroke has no cycle, and so no flywheel")
    mechanism = raw.get("mechanism")
    tables = [mechanism] if isinstance(mechanism, Mapping) else items(mechanism) or []
    if "mechanism" not in raw or (len(tables) != 1 and isinstance(mechanism, (list, tuple))):
        found = f"{len(tables)} mechanisms" if tables else "nothing"
        faults.add("mechanism", found, "one mechanism, whose driver makes the stroke")
    elif tables and isinstance(tables[0], Mapping):
        path, kind = "mechanism" if isinstance(mechanism, Mapping) else "mechanism[0]", tables[0].get("type")
        if isinstance(kind, str) and kind in KINDS and not _goes_one_way(KINDS[kind]):
            expected = " or ".join(f'"{name}"' for name, known in KINDS.items() if _goes_one_way(known))
            advice = "for a crank that turns in cycles leave out [stroke]"
            faults.add(f"{path}.type", f"{show(kind)} together with [stroke]", expected, advice)
        for name in ("phase", "shaft"):
            if name in tables[0]:
                advice = "the stroke is that of the mechanism's own driver"
                faults.add(f"{path}.{name}", f"{name} together with [stroke]", "none", advice)
    table = as_table(raw["stroke"], "stroke", faults)
    if table is None:
        return unread
    if slides is None:  # the mechanism does not give it, but perhaps the stroke's own unit
        try:
            parse_quantity(table.get("to"), "angle")
            slides = False
        except QuantityError:
            slides = True
    fields = read_fields(table, SECTIONS["stroke"].keys, "stroke", faults, rotating=not slides)
    start, end, speed, acceleration = fields.values()
    if None in (start, end, acceleration) or (speed is None and "speed" in table):
        return unread._replace(sliding=slides)
    if end - start <= _SHORTEST * max(abs(start), abs(end)):
        found, ends = told(end, slides), f"more than from, which is {told(start, slides)}"
        faults.add("stroke.to", found, ends, "a return stroke has the same ends and a negative speed")
    elif not slides and end - start > MOST_TURNS * TURN:
        faults.add("stroke.to", f"{(end - start) / TURN:.6g} turns", f"at most {MOST_TURNS}")
    else:
        return Stroke(start, end, speed, acceleration, slides)
    return unread._replace(sliding=slides)


def _goes_one_way(kind: Kind) -> bool:
    """Tests whether a mechanism may have a stroke: all may but laws, whose outputs are written for whole turns."""
    return kind.driver != "turns" or kind.skeleton is not None


def driver_slides(raw: Mapping[str, Any]) -> bool | None:
    """Tests whether the driver of the scene's mechanism slides; None if that cannot be decided.

    >>> driver_slides({"mechanism": {"type": "toggle-clamp"}}), driver_slides({"mechanism": {"type": "four-bar"}})
    (True, False)
    """
    mechanism = raw.get("mechanism")
    tables = [mechanism] if isinstance(mechanism, Mapping) else items(mechanism) or []
    table = tables[0] if len(tables) == 1 else None
    kind = table.get("type", "") if isinstance(table, Mapping) else None
    if not isinstance(table, Mapping) or not isinstance(kind, str):
        return None
    driver = KINDS[kind].driver if kind in KINDS else "turns"
    if driver != "either":
        return driver == "slides"
    joints = [joint for joint in items(table.get("joints")) or [] if isinstance(joint, Mapping)]
    name = table.get("driver")  # from Python a scene may hold anything, NumPy's arrays too
    named = [joint for joint in joints if isinstance(name, str) and isinstance(joint.get("name"), str)]
    kinds = [joint.get("type") for joint in named if joint["name"] == name]
    return kinds[0] == "slide" if kinds and isinstance(kinds[0], str) and kinds[0] in ("slide", "pin") else None


class Found(NamedTuple):
    """One mechanism as far as it could be read: `mechanism` is None if it has faults.

    `complete` is False if it may have more ports than could be read.
    """

    name: str
    rotating: Mapping[str, bool]
    travel: float | None
    mechanism: Mechanism | None
    complete: bool = True


def read_mechanisms(raw: object, setting: Setting) -> tuple[tuple[Mechanism, ...], Places]:
    """Every mechanism of the scene, and every place of the machine, as far as they are free of faults."""
    faults, once = setting.faults, setting.stroke is not None
    if isinstance(raw, (list, tuple)) and len(raw) > MOST_MECHANISMS:
        faults.add("mechanism", f"{len(raw)} mechanisms", f"at most {MOST_MECHANISMS}")
        raw = None
    given = enumerate(raw) if isinstance(raw, (list, tuple)) else () if raw is None else ((None, raw),)
    paths = [("mechanism" if i is None else f"mechanism[{i}]", item) for i, item in given]
    tables = [(path, table) for path, item in paths if (table := as_table(item, path, faults)) is not None]
    types = [table.get("type") for _, table in tables]
    found = [_mechanism(table, path, types.count(table.get("type")) == 1, setting) for path, table in tables]
    seen: set[str] = set()
    for (path, _), item in zip(tables, found, strict=True):
        if item is None:
            continue
        if item.name in setting.shafts or (item.name in seen and f"{path}.name" not in {fault.path for fault in faults}):
            other = "a shaft" if item.name in setting.shafts else "another mechanism"
            faults.add(f"{path}.name", quote(item.name), "a unique name", f"{other} has this name already")
        seen.add(item.name)
    ports: dict[str, Place] = {}
    known = all(abs(value) < math.inf for value in setting.parameters.values())
    for (_, table), item in zip(tables, found, strict=True):
        if item is None:
            continue
        returns: dict[str, bool] = {}
        if item.mechanism is not None and known:
            try:
                family = build(item.mechanism, setting.parameters)
                returns = {name: port.returns or once for name, port in family.ports.items()}
            except SceneError as error:  # it locks
                kind, alone = KINDS[item.mechanism.type], not once and len(found) == 1
                moves = stroke_ranges(item.mechanism, setting.parameters) if alone else ""
                partly = f"; a [stroke] may lie within {moves}" if moves else ""
                for fault in error.faults:
                    advice = fault.advice + (partly if fault.locks else "")
                    faults.append(_as_written(fault, kind, table)._replace(advice=advice))
            except ArithmeticError:
                advice = "lengths whose squares can be computed"
                faults.add(item.mechanism.path, "lengths that differ too much in size", advice)
        for port, rotating in item.rotating.items():
            name = f"{item.name}.{port}"
            ports[name] = Place(name, rotating, item.travel, returns.get(port, True))
    shafts = {name: Place(name, not setting.sliding, setting.cycle, once) for name in setting.shafts}
    complete = all(item is not None and item.complete for item in found)
    read = tuple(item.mechanism for item in found if item is not None and item.mechanism is not None)
    return read, Places(shafts, ports, complete, read)


def _mechanism(raw: Mapping[str, Any], path: str, alone: bool, setting: Setting) -> Found | None:
    """One mechanism; None if not even its ports are known."""
    faults, stroke = setting.faults, setting.stroke
    before = len(faults)
    kind = KINDS.get(raw["type"]) if isinstance(raw.get("type"), str) else None
    if kind is None:  # the keys of a type make no sense without it
        if isinstance(raw.get("type"), str):
            faults.unknown(f"{path}.type", raw["type"], KINDS, "type")
        else:
            faults.add(f"{path}.type", show(raw.get("type")), "one of " + ", ".join(KINDS))
        common = [key for key in MECHANISM.keys if key.name != "type"]
        fields = read_fields({key.name: raw[key.name] for key in common if key.name in raw}, common, path, faults)
        _travel(fields["shaft"], f"{path}.shaft", setting)
        return None
    names = items(raw.get("driver")) if kind.name == "linkage" else None
    if names is not None and all(isinstance(driver, str) for driver in names):
        found = f"{len(names)} drivers ({', '.join(map(str, names))})" if len(names) != 1 else "a list of one driver"
        advice = "several are read by flywheel.load_linkage (see flywheel reference freedoms)"
        faults.add(f"{path}.driver", found, "the name of one, of one degree of freedom", advice)
        return None
    parts = tuple(Key(part.name_in(raw), "part", part.about) for part in kind.parts)
    twins = [part for part in kind.parts if all(name in raw for name in part.names[1:]) and part.name in raw and part.alias]
    for part in twins:
        found = f"{part.alias} together with {part.name}, which is the same"
        faults.add(f"{path}.{part.alias}", found, "one of the two", f"leave {part.alias} out")
    raw = {key: value for key, value in raw.items() if key not in {part.alias for part in twins}}
    fields = read_fields(raw, (*MECHANISM.keys, *kind.keys, *parts), path, faults)
    name = fields["name"] or kind.name
    if not alone and "name" not in raw:
        faults.add(f"{path}.name", "nothing", "a name, as there are several of this type")
    travel = _travel(fields["shaft"], f"{path}.shaft", setting)
    period = None
    if kind.name == "law" and travel is not None and setting.cycle is not None:
        period = default_period(travel, setting.cycle)
        if period is None:
            found = f"a law that turns {np.degrees(travel):.10g} deg in a cycle of {np.degrees(setting.cycle):.10g} deg"
            faults.add(f"{path}.shaft", found, "that one of the two divides the other", "change regime.cycle")
    geometry: dict[str, float] = {}
    bodies: dict[str, Body] = {}
    for part in kind.parts:
        where = f"{path}.{part.name_in(raw)}"
        given = raw.get(part.name_in(raw), {})
        if isinstance(given, (str, int, float)) and any(key.name == "length" for key in part.keys):
            faults.add(where, show(given), "a table", f"write {part.name_in(raw)}.length = {show(given)}")
        elif (table := as_table(given, where, faults)) is not None:
            values = read_fields(table, part.keys, where, faults)
            geometry |= {f"{part.name}.{key.name}": values[key.name] for key in part.geometry}
            if part.body:
                bodies[part.name] = Body(**{key.name: values[key.name] for key in part.body})
    own: dict[str, Any] = {}
    rotating, complete = {port.name: port.rotating for port in kind.ports}, True
    if kind.name == "linkage":
        from flywheel.reading.linkages import read_linkage  # only scenes with one need it

        drawn = read_linkage(raw, fields, path, setting)
        own, complete = {"linkage": drawn.linkage, "points": drawn.points}, drawn.complete
        rotating |= drawn.ports
    elif kind.name == "law":
        outputs, period = _outputs(raw, period, travel, path, setting)
        given = raw["outputs"] if isinstance(raw.get("outputs"), Mapping) else {}
        own = {"outputs": outputs, "period": period}
        rotating |= {str(name): isinstance(of, Mapping) and "theta" in _positioned(of) for name, of in given.items()}
    else:
        own = {"assembly": fields.get("assembly", "open")}
    if len(faults) > before or own.get("period", TURN) is None or (stroke is not None and setting.cycle is None):
        return Found(name, rotating, travel, None, complete)
    at = {"shaft": fields["shaft"], "phase": fields["phase"], "travel": TURN if travel is None else travel}
    if stroke is not None:  # the driver's coordinate begins where its stroke does
        at = {"shaft": stroke.element, "phase": stroke.start, "travel": stroke.span, "stroke": (stroke.start, stroke.end)}
        own["period"] = stroke.span if stroke.sliding else TURN
    mechanism = Mechanism(type=kind.name, name=name, geometry=geometry, bodies=bodies, path=path, **at, **own)
    return Found(name, rotating, travel, mechanism, complete)


def _as_written(fault: Fault, kind: Kind, raw: Mapping[str, Any]) -> Fault:
    """A fault of a mechanism's lengths with the names that its table has for its parts."""
    for part in kind.parts:
        name = part.name_in(raw)
        path = fault.path.replace(f".{part.name}.", f".{name}.")
        fault = fault._replace(path=path, expected=fault.expected.replace(f"{part.name}.", f"{name}."))
    return fault


def _travel(shaft: object, path: str, setting: Setting) -> float | None:
    """Angle (rad) through which the mechanism's own crank turns in a cycle: a whole number of turns, else a fault."""
    if not isinstance(shaft, str) or setting.cycle is None or setting.stroke is not None:
        return setting.cycle if isinstance(shaft, str) else None
    if shaft not in setting.shafts:
        setting.faults.add(path, quote(shaft), "a shaft", suggestion(shaft, setting.shafts))
        return None
    turns = setting.shafts[shaft] * setting.cycle / TURN
    count = whole(turns)
    if count is None or count > MOST_TURNS:
        found = f"{turns:.10g} turns of {quote(shaft)} in the cycle of {np.degrees(setting.cycle):.10g} deg"
        wanted = f"a whole number of them, at most {MOST_TURNS}"
        degrees = whole(setting.cycle / 90) if setting.cycle > TURN else None
        advice = f'write regime.cycle = "{90 * degrees} deg"' if degrees else "change regime.cycle or the shaft's ratio"
        setting.faults.add(path, found, wanted, advice)
        return None
    crank = whole(setting.cycle / TURN)
    setting.shafts[shaft] = count / crank if crank else count * TURN / setting.cycle  # it may be given with fewer digits
    return count * TURN


def _outputs(
    raw: Mapping[str, Any], period: float | None, travel: float | None, path: str, setting: Setting
) -> tuple[tuple[Output, ...], float | None]:
    """The outputs of a law and the angle after which all of them repeat."""
    faults = setting.faults
    path = child(path, "outputs")
    tables = as_table(raw.get("outputs", {}), path, faults) or {}
    if not tables and isinstance(raw.get("outputs"), Mapping):
        faults.add(path, "no output", "one table at least, such as [mechanism.outputs.ram]")
    if len(tables) > MOST_MECHANISMS:
        faults.add(path, f"{len(tables)} outputs", f"at most {MOST_MECHANISMS}")
        return (), None
    outputs = [_output(name, table, child(path, name), setting) for name, table in tables.items()]
    good = [output for output in outputs if output is not None]
    if period is None or travel is None:
        return tuple(good), None
    if all(isinstance(output.law, Table) for output in good) and any(repeats(o, period) is None for o in good):
        period = travel  # nothing here sees phi, so that the whole travel may be the period
    return tuple(fitted(output, period, path, faults) for output in good), period


def _output(name: str, raw: object, path: str, setting: Setting) -> Output | None:
    """One output: a position, with mass or inertia."""
    faults = setting.faults
    before = len(faults)
    check_name(name, path, faults)
    table = as_table(raw, path, faults)
    if table is None:
        return None
    table = _positioned(table)
    item = read_item(table, OUTPUT, path, faults)
    if not item.one("x", "theta"):
        return None
    key, own, other = ("x", "mass", "inertia") if "x" in table else ("theta", "inertia", "mass")
    if other in table:
        faults.add(f"{path}.{other}", f"{other} of an output with {key}", own)
    law = read_law(table[key], key, f"{path}.{key}", setting)
    if law is None or len(faults) > before:
        return None
    return Output(name, key == "theta", law, item.fields[own])


def _positioned(output: Mapping[str, Any]) -> Mapping[str, Any]:
    """An output whose position stands under `table`, as one with a table for its `x`, or its `theta` if that rotates."""
    if "table" not in output or "x" in output or "theta" in output:
        return output
    table = output["table"]
    unit = table.get("value_unit") if isinstance(table, Mapping) else None
    key = "theta" if "inertia" in output or unit in ("deg", "rad", "°", "rev") else "x"
    return {key: table, **{name: value for name, value in output.items() if name != "table"}}
