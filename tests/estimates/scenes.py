"""Random scenes over all mechanisms, reproducible from a seed: what moves, what acts, and what is asked."""

from __future__ import annotations

from decimal import Decimal
from random import Random
from typing import Any

from tests.estimates import bars
from tests.estimates.bars import short

Scene = dict[str, Any]
Draw = Random


def log(draw: Draw, low: float, high: float) -> float:
    """A number whose logarithm is evenly spread."""
    return short(low * (high / low) ** draw.random())


def even(draw: Draw, low: float, high: float) -> float:
    """A number that is evenly spread."""
    return short(draw.uniform(low, high))


def degrees(draw: Draw, low: float = 0, high: float = 360) -> str:
    """An angle as a text."""
    return f"{draw.uniform(low, high):.3f} deg" if draw.random() < 0.7 else f"{round(draw.uniform(low, high) / 15) * 15} deg"


def scene_of(seed: int) -> Scene:
    """The scene of a seed."""
    draw = Random(seed)
    scene: Scene = {"title": f"seed {seed}"}
    speed = log(draw, 0.1, 1000.0)
    moving = draw.random() < 0.25
    _shafts(draw, scene, moving)
    ports = _mechanisms(draw, scene)
    work = _loads(draw, scene, ports, speed)
    if draw.random() < 0.35:
        scene["gravity"] = {} if draw.random() < 0.7 else {"direction": degrees(draw)}
    if draw.random() < 0.5:
        scene["inertia"] = [{"on": "crank", "value": log(draw, 1e-2, 1e2)}]
    scene["regime"] = {"speed": speed}
    if scene.pop("two turns", False):
        scene["regime"]["cycle"] = "720 deg"
    _drive(draw, scene, work)
    if moving:
        _resistance(draw, scene, ports, work, speed)
    _asked(draw, scene, work, speed)
    scene["accuracy"] = {"rtol": draw.choice([1e-4, 1e-6, 1e-9, 1e-12])}
    return scene


def _shafts(draw: Draw, scene: Scene, moving: bool) -> None:
    if draw.random() < 0.5:
        scene["shafts"] = {"motor": {"ratio": draw.choice([2.0, 3.5, 8.0, 0.4, 12.5])}}
        if moving and draw.random() < 0.5:
            scene["shafts"]["motor"]["efficiency"] = even(draw, 0.7, 0.99)


def _mechanisms(draw: Draw, scene: Scene) -> list[tuple[str, str, float]]:
    """Mechanisms of a scene; their ports as (name, "force" or "torque", extent of the motion)."""
    kind = draw.choice([*bars.KINDS, "none", "several"])
    if kind == "none":
        return []
    if kind != "several":
        table, ports = bars.KINDS[kind](draw)
        if draw.random() < 0.3:
            table["phase"] = degrees(draw)
        scene["mechanism"] = table
        return ports
    result, offered = [], []
    for k in range(draw.choice([2, 2, 3])):
        table, ports = bars.KINDS[draw.choice(list(bars.KINDS))](draw)
        table |= {"name": f"m{k}", "phase": degrees(draw)}
        if k == 1 and draw.random() < 0.5:
            slow = draw.random() < 0.5
            scene.setdefault("shafts", {})["side"] = {"ratio": 0.5 if slow else 2.0}
            table["shaft"], scene["two turns"] = "side", slow
        result.append(table)
        offered += [(f"m{k}.{name}", what, size) for name, what, size in ports]
    if scene.get("two turns"):  # what is written over a turn of the crank repeats after two, and laws do not
        offered = [port for port in offered if result[int(port[0][1])]["type"] != "law"]
        result = [table for table in result if table["type"] != "law"]
    scene["mechanism"] = result
    return offered


def _loads(draw: Draw, scene: Scene, ports: list[tuple[str, str, float]], speed: float) -> float:
    """Loads of a scene; the work of one of them, roughly."""
    work = log(draw, 1.0, 1e4)
    loads = []
    for _ in range(draw.choice([1, 1, 2, 3])):
        if ports and draw.random() < 0.75:
            name, what, size = draw.choice(ports)
            loads.append({"on": name} | _law(draw, what, short(work / size), port=True))
        else:
            name = draw.choice(["crank", *scene.get("shafts", {})])
            ratio = scene["shafts"][name]["ratio"] if name != "crank" else 1.0
            loads.append({"on": name} | _law(draw, "torque", short(work / 6 / ratio), port=False))
    scene["load"] = loads
    springs = [(name, size) for name, what, size in ports if what == "force"]
    if springs and draw.random() < 0.3:
        name, size = draw.choice(springs)
        rest = even(draw, -size, size) if draw.random() < 0.5 else 0
        scene["spring"] = [{"on": name, "stiffness": log(draw, 0.1 * work / size**2, work / size**2), "rest": rest}]
    return work


def _law(draw: Draw, what: str, size: float, port: bool) -> Scene:
    """Force or torque of about a size, with a window or a sense of motion."""
    law: Scene = {}
    cyclic = not port and draw.random() < 0.3
    law["every"] = "360 deg"  # where the cycle is two turns
    if cyclic:
        law["every"] = draw.choice(["180 deg", "120 deg", "60 deg"])
    period = int(law.get("every", "360 deg").split()[0])
    chance = draw.random()
    if chance < 0.35:
        law[what] = -size if draw.random() < 0.7 else size
    elif chance < 0.65:
        law["table"] = _table(draw, size, period)
        return law
    else:
        law[what] = _expression(draw, size, port)
    if draw.random() < 0.45:
        start = draw.uniform(0, period)
        width = period * (draw.uniform(0.05, 0.8) if draw.random() < 0.8 else 10 ** draw.uniform(-5, -2))
        law |= {"from": f"{start:.4f} deg", "to": f"{(start + width) % period:.7f} deg"}
    if port and draw.random() < 0.3:
        law["while"] = draw.choice(["v > 0", "v < 0"])
    return law


def _table(draw: Draw, size: float, period: int) -> Scene:
    """A table over a period, with a jump now and then."""
    inner = sorted(draw.sample(range(1, period), draw.randint(2, 8)))
    angle = [0, *inner, period]
    if draw.random() < 0.4:
        angle = sorted([*angle, draw.choice(inner)])
    kind = draw.choice(["linear", "pchip", "step"])
    value = [short(size * draw.uniform(-1, 1), 3) for _ in angle]
    return {"angle": angle, "value": value, "angle_unit": "deg", "interpolation": kind}


def _expression(draw: Draw, size: float, port: bool) -> str:
    """A force or torque as a text of phi, and of the sense of motion."""
    a, b, width = short(draw.uniform(0.3, 6), 4), short(draw.uniform(0.1, 0.9), 3), log(draw, 0.01, 0.5)
    texts = [
        f"{size!r}*sin(phi)",
        f"{size!r}*(1 + {b!r}*cos(3*phi) - 0.5*sin(2*phi))",
        f"-{size!r}*exp(-((phi - {a!r})/{width!r})**2)",
        f"-{size!r}/(1 + ((phi - {a!r})/{width!r})**2)",
        f"-{size!r}*max(sin(phi) - {b!r}, 0)",
        f"-{size!r}*abs(cos(phi))",
        f"min({size!r}, {short(2 * size)!r}*sin(phi)**2) - {short(0.3 * size)!r}",
        f"-{size!r}*sign(sin(2*phi - {a!r}))",
        f"-{size!r} if {a!r} < phi < {short(a + width)!r} else {short(0.05 * size)!r}",
        f"-{size!r}*sqrt(1.01 + cos(phi - {a!r}))",
        f"{size!r}*(phi - {a!r}) if phi < {a!r} else -{short(0.2 * size)!r}*(phi - {a!r})**2",
    ]
    if port:
        texts += [f"-{size!r}*sign(v)", f"-{size!r}*sign(v)*(1 + {b!r}*sin(phi))"]
    return draw.choice(texts)


def _drive(draw: Draw, scene: Scene, work: float) -> None:
    """The drive, and which quantity makes the net work zero."""
    chance, on = draw.random(), draw.choice(["crank", *scene.get("shafts", {})])
    if chance < 0.7:
        scene["drive"] = {"on": on, "torque": "balance"}
        return
    mean = short(work / 6)
    scene["parameters"] = {"drag": "balance"}
    shape = draw.choice(["-drag", "-drag*(1 + 0.3*sin(phi))", "-drag*max(sin(phi), 0)", "20 - drag*(1 - cos(phi))"])
    scene["load"].append({"on": "crank", "torque": shape})
    law = mean if chance < 0.85 else f"{mean!r}*(1 + 0.2*cos(phi))"
    scene["drive"] = {"on": on, "torque": law}


def _resistance(draw: Draw, scene: Scene, ports: list[tuple[str, str, float]], work: float, speed: float) -> None:
    """Torques that depend on speed: in place of the balance, or beside it."""
    mean = work / 6
    kind = draw.choice(["linear", "square", "damper", "port", "kink", "motor", "line", "line"])
    if kind in ("motor", "line"):
        scene.pop("parameters", None)
        scene["load"] = [load for load in scene["load"] if "drag" not in str(load.get("torque", ""))]
        start, fastest = short(mean * draw.uniform(1.5, 6)), short(speed * draw.uniform(1.05, 1.5))
        scene["load"].append({"on": "crank", "torque": short(-0.5 * mean)})
        slope = short(start / fastest)
        law = {"motor": {"type": "line", "starting_torque": start, "no_load_speed": fastest}}
        scene["drive"] = {"on": "crank"} | (law if kind == "motor" else {"torque": f"{start!r} - {slope!r}*omega"})
        del scene["regime"]["speed"]
        return
    texts = {
        "linear": f"-{short(0.3 * mean / speed)!r}*omega",
        "square": f"-{short(0.3 * mean / speed**2)!r}*omega**2",
        "kink": f"-{short(mean / speed)!r}*max(0, omega - {short(0.99 * speed)!r})",
    }
    if kind == "damper" or (kind == "port" and not ports):
        scene["damper"] = [{"on": "crank", "coefficient": short(0.2 * mean / speed)}]
    elif kind == "port":
        name, _, size = draw.choice(ports)
        scene["damper"] = [{"on": name, "coefficient": short(0.5 * mean / speed / size**2)}]
    else:
        scene["load"].append({"on": "crank", "torque": texts[kind]})


def _asked(draw: Draw, scene: Scene, work: float, speed: float) -> None:
    """A flywheel to be sized for an irregularity, or to be looked at."""
    on = draw.choice(["crank", *scene.get("shafts", {})])
    ratio = scene["shafts"][on]["ratio"] if on != "crank" else 1.0
    eps = log(draw, 1e-6, 1.5)
    if draw.random() < 0.7:
        scene["flywheel"] = {"on": on, "irregularity": eps}
    else:
        eps = max(eps, 1e-4) if draw.random() < 0.7 else eps
        scene["flywheel"] = {"on": on, "inertia": short(work / (min(eps, 0.3) * speed**2) / ratio**2 * log(draw, 0.3, 10))}


# -- scenes written otherwise ------------------------------------------------------------------------------------------

_UNITS = {"length": ("mm", 1000), "offset": ("mm", 1000), "com": ("mm", 1000), "mass": ("g", 1000)}
_UNITS |= {"inertia": ("g*m^2", 1000), "torque": ("N*mm", 1000), "force": ("mN", 1000), "starting_torque": ("N*mm", 1000)}
_SIZES = ("mass", "inertia", "torque", "force", "starting_torque", "stiffness", "coefficient")
_FACTOR, _TURN = 3, 37  # of a scaled scene; deg, of a turned one


def in_other_units(scene: Any, key: str = "") -> Any:
    """The scene with lengths, masses, inertias, forces and torques in other units, digit by digit."""
    if isinstance(scene, dict):
        return {name: in_other_units(value, name) for name, value in scene.items()}
    if isinstance(scene, list):
        return [in_other_units(value, key) for value in scene]
    if key in _UNITS and type(scene) in (int, float):
        unit, share = _UNITS[key]
        return f"{Decimal(repr(scene)) * share:f} {unit}"
    return scene


def in_another_order(scene: Any) -> Any:
    """The scene with its tables, loads, mechanisms, bodies and joints the other way round."""
    if isinstance(scene, dict):
        return {name: in_another_order(value) for name, value in reversed(scene.items())}
    if isinstance(scene, list) and all(isinstance(value, dict) for value in scene):
        return [in_another_order(value) for value in reversed(scene)]
    return scene


def scaled(scene: Any, key: str = "") -> Any:
    """The scene with three times its masses, forces and torques."""
    if isinstance(scene, dict):
        changed = {
            name: scaled(value, "inertia" if key == "inertia" and name == "value" else name) for name, value in scene.items()
        }
        if key == "load" and "table" in scene:
            changed["table"] = {**scene["table"], "value": [_times(value) for value in scene["table"]["value"]]}
        return changed
    if isinstance(scene, list):
        return [scaled(value, key) for value in scene]
    if key in _SIZES and scene != "balance":
        return _times(scene)
    return scene


def _times(value: Any) -> Any:
    return f"{_FACTOR}*({value})" if isinstance(value, str) else float(Decimal(repr(value)) * _FACTOR)


def factors_of_scaled(scene: Scene) -> dict[str, int]:
    """By how much every figure of it is larger."""
    unchanged = dict.fromkeys(("speed", "simulation.irregularity", "simulation.speed_max", "simulation.speed_min"), 1)
    return unchanged | ({"balance.value": 1} if "parameters" in scene else {})


def turned(scene: Scene) -> Scene | None:
    """The scene with its crank turned against its mechanism; None where loads follow the angle of the crank."""
    mechanism = scene.get("mechanism")
    plain = {"on", "torque", "every", "motor"}
    on_shafts = [load for load in (*scene["load"], scene["drive"]) if load["on"] in ("crank", *scene.get("shafts", {}))]
    if not isinstance(mechanism, dict) or any(
        not load.keys() <= plain or "phi" in str(load.get("torque")) for load in on_shafts
    ):
        return None
    phase = Decimal(mechanism.get("phase", "0 deg").split()[0]) + _TURN
    return {**scene, "mechanism": {**mechanism, "phase": f"{phase} deg"}}
