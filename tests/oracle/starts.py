"""Starts of a drive, and models of its loads."""

from __future__ import annotations

import itertools
import math
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq

from tests.oracle.courses import Course, Machine, Piece, Rest
from tests.oracle.drive_lines import value
from tests.oracle.motors import hertz, motor, volts

# A motor's connections one after another, each a drive of its own from where the one before it ends.


Table = dict[str, Any]
Stage = tuple[str, float, float]  # torque over omega, and the time (s) and the speed (rad/s) that it ends at


def stages(row: Table) -> list[Stage]:
    """The connections of a motor that is started by resistance, by field, or in one lowered connection; its own the last."""
    start, own = row["start"], {k: v for k, v in row.items() if k != "start"}
    until = start["until"] if isinstance(start["until"], list) else [start["until"]]
    texts = CONNECTIONS[start["type"]](own, start)
    ends = [(value(u), math.inf) if str(u).endswith(" s") else (math.inf, value(u)) for u in until]
    return [(text, *end) for text, end in zip(texts, ends, strict=True)] + [(str(motor(own)), math.inf, math.inf)]


def resistance(own: Table, start: Table) -> list[str]:
    """Rotor: the slip over 1 + added. Armature: its resistance times that."""
    if own["type"] == "dc":
        u, r, k, b = armature(own)
        return [f"{k / (r * (1 + a))!r}*({u!r} - {k!r}*omega) - {b!r}*omega" for a in start["added"]]
    speed, most = value(own["speed"]), float(own["breakdown_ratio"])
    sync = 4 * math.pi * hertz(own["frequency"]) / own["poles"]
    steep = (1 - speed / sync) * (most + math.sqrt(most * most - 1))
    top = 2 * most * value(own["power"]) / speed * steep
    slips = [f"((1 - omega/{sync!r})/{1 + a!r})" for a in start["added"]]
    return [f"{top!r}*{s}/({s}**2 + {steep**2!r})" for s in slips]


def field(own: Table, start: Table) -> list[str]:
    """The constant times the field."""
    u, r, k, b = armature(own)
    return [f"{k * f / r!r}*({u!r} - {k * f!r}*omega) - {b!r}*omega" for f in start["field"]]


def armature(own: Table) -> tuple[float, float, float, float]:
    """Voltage, resistance, constant and friction of a DC motor by its constants."""
    return volts(own["voltage"]), volts(own["resistance"]), volts(own["constant"]), value(own.get("friction"))


def lowered(own: Table, start: Table) -> list[str]:
    """A third of the torque, or the voltage's share squared."""
    share = 1 / 3 if start["type"] == "star-delta" else value(start["voltage"]) ** 2
    return [f"({motor(own)})*{share!r}"]


CONNECTIONS = {"resistance": resistance, "field": field, "star-delta": lowered, "transformer": lowered}


def started(scene: Table, inertia: float, until: float, rtol: float) -> tuple[Machine, Course]:
    """The motion from rest through all connections."""
    row, on = scene["drive"]["motor"], scene["drive"].get("on", "crank")
    rotor = [{"on": on, "value": row["inertia"]}] if "inertia" in row else []
    pieces: list[Piece] = []
    rests: list[Rest] = []
    t, y, machine = 0.0, None, None
    for text, last, speed in stages(row):
        bare = scene | {"drive": {"on": on, "torque": text}, "inertia": [*scene.get("inertia", []), *rotor]}
        machine = Machine(bare, inertia=inertia)
        y = machine.start(0.0, 0.0) if y is None else y
        ratio, end = machine.speeds[machine.index[on]], min(until, last)
        if end <= t or ratio * y[1] >= speed:
            continue
        course = machine.follow(y, end, t=t, scale=until, rtol=rtol)
        stop = next((s for p in course.pieces if (s := _reached(p, speed / ratio)) is not None), end)
        kept = [p for p in course.pieces if p.start < stop]
        pieces += [*kept[:-1], kept[-1]._replace(end=min(stop, kept[-1].end))]
        rests += [r._replace(end=min(r.end, stop) if stop < until else r.end) for r in course.rests if r.start < stop]
        y, t = (course.at(stop) if stop < end else course.y), stop
        if t >= until:
            break
    assert machine is not None
    return machine, Course(pieces, _joined(rests), t, y, "time")


def _reached(piece: Piece, speed: float) -> float | None:
    """Time at which a piece first reaches a speed."""
    grid = [piece.start + k / 8 * (piece.end - piece.start) for k in range(9)]
    for a, b in itertools.pairwise(grid):
        if piece.states(b)[1] >= speed > piece.states(a)[1]:
            return float(brentq(lambda t: float(piece.states(t)[1]) - speed, a, b, xtol=1e-15 * (1 + b), rtol=1e-15))
    return None


def _joined(rests: list[Rest]) -> list[Rest]:
    """Standstills, those of two connections that follow each other as one."""
    result: list[Rest] = []
    for rest in rests:
        if result and result[-1].end == rest.start:
            rest = rest._replace(start=result.pop().start)
        result.append(rest)
    return result


# Loads that work over a port's stroke (presses, diagrams, compressors) as expressions of where the port is and its way.


AIR = "101325 Pa"


class Way(NamedTuple):
    """A port's least and greatest place (m), and where it is at an angle of its own crank before either end."""

    low: float
    high: float
    before: Any


def plain(scene: Table) -> Table:
    """The scene with those loads as expressions; itself where it has none."""
    if not any(row.get("model", {}).get("type") in MODELS for row in scene.get("load", [])):
        return scene
    loads = []
    for row in scene["load"]:
        made = MODELS.get(row.get("model", {}).get("type"))
        if made is not None:
            row = {k: v for k, v in row.items() if k != "model"} | {"force": made(row["model"], way(scene, row["on"]))}
        loads.append(row)
    return scene | {"load": loads}


def way(scene: Table, on: str) -> Way:
    """A port's way over a turn of its own crank."""
    machine = Machine({k: scene[k] for k in ("mechanism", "shafts", "parameters", "regime") if k in scene})
    i, k = machine.places[on]
    body = machine.parts[i].body

    def place(angle: float) -> float:
        return body.at(angle).ports[k][0]

    grid = np.linspace(0, 2 * math.pi, 721)
    places = [place(a) for a in grid]
    ends = []
    for sign in (1, -1):
        at = float(grid[int(np.argmin(sign * np.array(places)))])
        ends.append(float(brentq(lambda a: body.at(a).ports[k][1], at - 0.02, at + 0.02, xtol=1e-15)))  # where it stands
    return Way(place(ends[0]), place(ends[1]), lambda angle, top: place(ends[1 if top else 0] - angle))


def press(row: Table, port: Way) -> str:
    """Energy over the last of the way, evenly or falling to nothing."""
    top = row.get("end", "max") == "max"
    area = 0.0
    if "diameter" in row:
        area = math.pi * value(row["diameter"]) * value(row.get("thickness"))
    elif "perimeter" in row:
        area = value(row["perimeter"]) * value(row.get("thickness"))
    elif "area" in row:
        area = value(row["area"])
    even = row.get("shape", "constant") == "constant"
    end = port.high if top else port.low
    sign = 1 if top else -1
    last = end - sign * value(row.get("overtravel"))
    first = last - sign * value(row["thickness"]) if "angle" not in row else port.before(value(row["angle"]), top)
    length = sign * (last - first)
    if "energy" in row:
        energy = value(row["energy"])
    elif "energy_per_area" in row:
        energy = value(row["energy_per_area"]) * area
    else:
        energy = value(row["shear_strength"]) * area * length * (1.0 if even else 0.5)
    force = energy / length if even else 2 * energy / length
    text = f"{-sign * force!r}*({sign}*(x - {first!r}) > 0)*({sign}*v > 0)"
    text += f"*({sign}*({last!r} - x) > 0)" if "overtravel" in row else ""
    return text if even else f"{text}*(1 - {sign}*(x - {first!r})/{length!r})"


def _space(row: Table, side: str, port: Way, rod: float) -> tuple[float, str, int]:
    """Area of a gas space, the share of the stroke gone from its cover, and the sense away from the cover."""
    area = 0.25 * math.pi * (value(row["bore"]) ** 2 - rod**2)
    stroke = port.high - port.low
    share = f"(({port.high!r} - x)/{stroke!r})" if side == "max" else f"((x - {port.low!r})/{stroke!r})"
    return area, share, -1 if side == "max" else 1


def indicator(row: Table, port: Way) -> str:
    """Straight between the rows of the diagram, one row out and one back."""
    area, share, sense = _space(row, row.get("side", "max"), port, value(row.get("rod")))
    unit = value(f"1 {row.get('pressure_unit', 'Pa')}")
    still = 0.0 if row.get("gauge") else value(row.get("atmosphere"), AIR)
    at = [float(p) for p in row["position"]]

    def line(pressures: Any) -> str:
        text = ""
        for k in range(len(at) - 1):
            slope = (pressures[k + 1] - pressures[k]) / (at[k + 1] - at[k])
            text += f"({pressures[k] * unit!r} + {slope * unit!r}*({share} - {at[k]!r}))"
            text += f" if {share} < {at[k + 1]!r} else " if k < len(at) - 2 else ""
        return text

    return f"{sense * area!r}*((({line(row['out'])}) if {sense}*v > 0 else ({line(row['back'])})) - {still!r})"


def compressor(row: Table, port: Way) -> str:
    """Polytropic lines between suction and discharge, on one side of the piston or on both."""
    side, rod = row.get("side", "max"), value(row.get("rod"))
    low, high, dead = value(row["suction"]), value(row["discharge"]), value(row["clearance"])
    n = float(row["exponent"])
    m, still = float(row.get("expansion_exponent", n)), value(row.get("atmosphere"), AIR)
    spaces = [_space(row, side, port, 0.0)]
    if row.get("double_acting"):
        spaces.append(_space(row, "min" if side == "max" else "max", port, rod))
    texts = []
    for area, share, sense in spaces:
        gas = f"({dead!r} + {share})"
        away = f"max({low!r}, {high!r}*({dead!r}/{gas})**{m!r})"
        back = f"min({high!r}, {low!r}*({1 + dead!r}/{gas})**{n!r})"
        texts.append(f"{sense * area!r}*(({away} if {sense}*v > 0 else {back}) - {still!r})")
    return " + ".join(texts)


MODELS = {"press": press, "punch": press, "indicator": indicator, "compressor": compressor}
