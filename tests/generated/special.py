"""Scenes of what meets the rest of the schema more seldom, in a range of seeds of its own.

Duties, strokes, loads that work over a stroke, motors started by steps, friction in joints, limits of heat and current.
"""

from __future__ import annotations

import math
import re
from random import Random
from typing import Any

import numpy as np

from tests.estimates import bars
from tests.estimates.bars import short
from tests.generated.scenes import Drawn, Rng, Scene, Size, chance, composed, spread, volts

KINDS = ("duty", "stroke", "models", "starts", "friction", "limits")
SLIDING = ("scotch-yoke", "slider-crank", "crank-shaper", "linked slider")
RUBBING = ("linked slider", "linked slider", "linked bars", "toggle press")
Ports = list[tuple[str, bool]]


def kind_of(seed: int) -> str:
    """The kind that a seed draws."""
    return KINDS[seed % len(KINDS)]


def special(seed: int) -> Drawn:
    """The scene of a seed."""
    draw = DRAWERS[kind_of(seed)]
    for attempt in range(200):
        try:
            with np.errstate(divide="raise", invalid="raise", over="raise"):
                scene, pace, inertia = draw(np.random.default_rng([seed, attempt, 2]))
        except (ValueError, ArithmeticError):  # nothing moves, nothing has inertia, or no motor of the kind
            continue
        return Drawn(seed, {"title": f"{kind_of(seed)} {seed}"} | scene, pace, inertia)
    raise ValueError(seed)


def _static(scene: Scene, *types: str) -> Scene:
    """The motor of a scene, which has no states and needs no time."""
    motor = scene["drive"].get("motor", {})
    timed = re.search(r"\bt\b", str(scene["load"]))
    if motor.get("type") not in types or {"inductance", "electrical", "start"} & set(motor) or timed:
        raise ValueError("another motor")
    return motor  # type: ignore[no-any-return]


def _plate(motor: Scene) -> None:
    """A DC motor by its name plate, which has a rated current and a rated heat."""
    if motor["type"] == "dc":
        u, r, k = (volts(motor.pop(key)) for key in ("voltage", "resistance", "constant"))
        speed = short(0.93 * u / k)
        current = (u - k * speed) / r
        share = 1 - r * current / u
        motor |= {"voltage": f"{u} V", "power": short(u * current * share * 0.97), "speed": speed}
        motor["efficiency"] = short(share * 0.97)


def _alone(rng: Rng, scene: Scene, kinds: tuple[str, ...]) -> Ports:
    """One mechanism of some families on the crank."""
    table, ports = bars.KINDS[str(rng.choice(kinds))](Random(int(rng.integers(2**31))))
    scene["mechanism"] = table
    return [(port, what == "force") for port, what, _ in ports]


def _duty(rng: Rng) -> tuple[Scene, float, float]:
    """Two or three phases of one machine, with rests."""
    scene, size = composed(rng)
    motor = scene["drive"].get("motor", {})
    if isinstance(scene.get("mechanism"), list) or not scene["load"] or {"electrical", "start"} & set(motor):
        raise ValueError("slow")
    if re.search(r"\bt\b", f"{scene['drive']} {scene['load']}"):
        raise ValueError("a time")
    wheel = {k: v for k, v in scene["flywheel"].items() if k == "on"}
    if motor.get("type") in ("dc", "induction") and "inductance" not in motor and chance(rng, 0.4):
        _plate(motor)
        limits = {"irregularity": spread(rng, 0.02, 0.5), "motor_heat": short(rng.uniform(0.3, 2.0), 3)}
        if chance(rng, 0.5):
            limits["motor_rms"] = short(rng.uniform(0.5, 1.5), 3)
        scene["flywheel"] = wheel | {"limits": limits}
    else:
        scene["flywheel"] = wheel | {"irregularity": spread(rng, 0.01, 0.5)}
    scene["load"][0].setdefault("factor", 1.0)
    phases: list[Scene] = []
    for k in range(int(rng.choice([2, 2, 3]))):
        phase: Scene = {"name": f"p{k}"}
        phase |= {"duration": f"{rng.integers(20, 200)} s"} if chance(rng, 0.6) else {"cycles": int(rng.integers(5, 100))}
        if chance(rng, 0.6):
            phase["loads"] = short(float(rng.choice([0.0, 0.3, 0.6, 0.9, 1.1])))
        elif chance(rng, 0.6):
            phase["changes"] = {"load.0.factor": short(rng.uniform(0.2, 1.1), 2)}
        if "limits" in scene["flywheel"] and chance(rng, 0.2):
            phase["starts"] = 1
        phases.append(phase)
    if chance(rng, 0.3):
        phases.insert(int(rng.integers(0, 3)), {"name": "pause", "duration": "60 s", "rest": True})
    scene["duty"] = phases
    scene["accuracy"] = {"rtol": 1e-6}
    return scene, size.pace, size.inertia


def _stroke(rng: Rng) -> tuple[Scene, float, float]:
    """A driver that goes one way: a clamp's block, or a crank between two angles."""
    draw = Random(int(rng.integers(2**31)))
    slides = chance(rng, 0.5)
    if slides:
        table, ports, low, high = _clamp(rng)
    else:
        table, result = bars.KINDS[str(rng.choice(["scotch-yoke", "slider-crank", "four-bar", "crank-shaper"]))](draw)
        ports = [(port, what == "force") for port, what, _ in result]
        low = float(rng.integers(10, 120))
        high = low + float(rng.integers(40, 200))
    scene: Scene = {"mechanism": table}
    if chance(rng, 0.4):
        scene["gravity"] = {}
    driver = "slide" if slides else "crank"
    scene["inertia"] = [{"on": driver, "value": spread(rng, 1.0, 50.0)}]
    mean = scene["inertia"][0]["value"] + (300.0 if slides else 1.0)
    way = (high - low) * (1e-3 if slides else math.pi / 180)
    pace = spread(rng, 0.2, 2.0) * (0.3 if slides else 3.0)
    push = mean * pace**2 / way
    what = "force" if slides else "torque"
    loads: list[Scene] = [{"on": driver, what: f"-{short(0.2 * push)!r}*sign(v)"}]
    if chance(rng, 0.6):
        a, b = sorted(round(low + q * (high - low)) for q in rng.uniform(0.2, 0.9, 2))
        unit = "mm" if slides else "deg"
        if a < b:
            loads.append({"on": driver, what: short(-0.5 * push), "from": f"{a} {unit}", "to": f"{b} {unit}"})
    if chance(rng, 0.5):
        loads.append({"on": driver, what: f"-{short(0.3 * push / pace)!r}*v"})
    for port, translates in ports:
        if chance(rng, 0.7):
            e = short(push * (0.1 if slides or not translates else 0.5))
            dry = chance(rng, 0.5)
            row = {"on": port, "force" if translates else "torque": f"-{e!r}*sign(v)" if dry else f"-{e!r}*v"}
            loads.append(row)
    scene["load"] = loads
    if slides and chance(rng, 0.5):
        scene["spring"] = [{"on": "platen", "stiffness": short(push / 0.3), "rest": 0.4}]
    if chance(rng, 0.4):
        scene["damper"] = [{"on": driver, "coefficient": short(0.1 * push / pace)}]
    full = short(push * rng.uniform(0.8, 2.0))
    drives = [repr(full), f"{full!r} - {short(0.5 * full / pace)!r}*{'v' if slides else 'omega'}"]
    drives.append(f"min({full!r}, {short(3 * full * pace / way)!r}*t)")
    scene["drive"] = {what: str(rng.choice(drives))}
    unit = "mm" if slides else "deg"
    scene["stroke"] = {"from": f"{low:g} {unit}", "to": f"{high:g} {unit}", "speed": pace}
    return scene, pace, mean


def _clamp(rng: Rng) -> tuple[Scene, Ports, float, float]:
    """A toggle clamp near that of the reference, scaled."""

    def near(number: float, share: float = 0.03) -> float:
        return short(number * rng.uniform(1 - share, 1 + share))

    mass = spread(rng, 0.5, 2.0)
    table: Scene = {"type": "toggle-clamp", "frame": {"height": f"{near(140)} mm"}, "block": {"mass": short(43 * mass)}}
    table["bell_crank"] = {"drive_length": f"{near(167.63)} mm", "clamp_length": f"{near(220)} mm"}
    table["bell_crank"] |= {"angle": f"{near(17.3)} deg", "mass": short(16 * mass), "inertia": 0.12, "com": "110 mm"}
    table["coupler"] = {"length": f"{near(95)} mm", "mass": short(1.3 * mass), "inertia": 0.0022, "com": "47.5 mm"}
    table["rod"] = {"length": f"{near(260)} mm", "mass": short(17 * mass), "inertia": 0.17, "com": "130 mm"}
    table["platen"] = {"mass": short(400 * mass)}
    if chance(rng, 0.5):
        table["rod"]["com_angle"] = f"{rng.integers(-20, 20)} deg"
    return table, [("platen", True)], 10.0, float(rng.integers(90, 140))


def _models(rng: Rng) -> tuple[Scene, float, float]:
    """A press, a diagram or a compressor on a port that slides, or a law of motion by a table."""
    if chance(rng, 0.2):
        scene, size = composed(rng, _tabled)
        return scene, size.pace, size.inertia
    scene, size = composed(rng, lambda r, s: _alone(r, s, SLIDING))
    ports = [name for name, (way, _, _) in size.ports.items() if "." not in name and size.gain[name] > 1e-6]
    name = next((p for p in ("slider", "yoke", "ram") if p in ports), None)
    if name is None:
        raise ValueError("nothing slides")
    row: Scene = {"on": name, "model": _working(rng, size, name)}
    scene["load"] = [*scene["load"][: int(rng.integers(0, 3))], row]
    return scene, size.pace, size.inertia


def _tabled(rng: Rng, scene: Scene) -> Ports:
    """A follower whose lift is a table."""
    size, count = spread(rng, 0.02, 0.3), int(rng.choice([6, 9, 13]))
    angle = [360 * k / (count - 1) for k in range(count)]
    value = [
        short(1000 * size * math.sin(2 * math.pi * k / (count - 1) + 0.7) * rng.uniform(0.7, 1.3)) for k in range(count)
    ]
    lift = {"angle": angle, "value": [*value[:-1], value[0]], "angle_unit": "deg", "value_unit": "mm"}
    scene["mechanism"] = {"type": "law", "outputs": {"follower": {"x": lift, "mass": spread(rng, 0.5, 20)}}}
    return [("follower", True)]


def _working(rng: Rng, size: Size, name: str) -> Scene:
    """A model that takes about the machine's moment over the way of a port."""
    way, low, high = size.ports[name]
    stroke = high - low
    force = size.moment * spread(rng, 0.2, 1.0) / way
    kind = str(rng.choice(["press", "punch", "indicator", "compressor"]))
    result: Scene = {"type": kind}
    if kind in ("press", "punch"):
        thickness = short(stroke * rng.uniform(0.05, 0.25))
        result |= {"shape": str(rng.choice(["constant", "triangular"])), "end": str(rng.choice(["max", "min"]))}
        if chance(rng, 0.4):
            return result | {"energy": f"{short(force * stroke * 0.3)} J", "angle": f"{rng.integers(20, 70)} deg"}
        result["thickness"] = thickness
        if chance(rng, 0.4):
            result["overtravel"] = short(0.2 * thickness)
        if chance(rng, 0.5):
            return result | {"energy": f"{short(force * stroke * 0.3)} J"}
        strength = 4e8
        return result | {"diameter": short(2 * force / (math.pi * thickness * strength)), "shear_strength": "400 MPa"}
    result |= {"bore": short(math.sqrt(4 * force / math.pi / 3e5)), "side": str(rng.choice(["max", "min"]))}
    if kind == "compressor":
        result |= {
            "clearance": short(rng.uniform(0.03, 0.12), 2),
            "suction": "1 bar",
            "discharge": f"{rng.integers(3, 7)} bar",
        }
        result |= {"exponent": 1.3} | ({"expansion_exponent": 1.2} if chance(rng, 0.5) else {})
        return result | ({"double_acting": True, "rod": short(0.3 * result["bore"])} if chance(rng, 0.4) else {})
    out, back = [5.0, short(rng.uniform(3, 5)), 1.5, 1.0], [5.0, 2.0, short(rng.uniform(1, 1.4)), 1.0]
    result |= {"position": [0.0, short(rng.uniform(0.1, 0.4)), 0.7, 1.0], "out": out, "back": back, "pressure_unit": "bar"}
    return result | ({"gauge": True} if chance(rng, 0.3) else {})


def _starts(rng: Rng) -> tuple[Scene, float, float]:
    """A motor that is started by steps of resistance or field, or by a connection that ends at a speed."""
    scene, size = composed(rng)
    motor = _static(scene, "dc", "induction")
    if "inverter" in motor:
        raise ValueError("an inverter has a start of its own")
    idle = volts(motor["voltage"]) / volts(motor["constant"]) if motor["type"] == "dc" else motor["speed"]
    count = int(rng.choice([1, 2, 3]))
    shares = sorted(0.1 + 0.7 * (k + rng.uniform(0.0, 0.9)) / count for k in range(count))
    turn = 2 * math.pi / size.pace
    speeds = [f"{short(q * idle)} rad/s" for q in shares]
    times = [f"{short(q * 1.5 * turn)} s" for q in shares]
    kind = str(rng.choice(["resistance", "field"] if motor["type"] == "dc" else ["resistance", "star-delta", "transformer"]))
    if kind in ("star-delta", "transformer"):
        until: Any = speeds[0] if chance(rng, 0.7) else times[0]
        motor["start"] = {"type": kind, "until": until} | ({"voltage": 0.7} if kind == "transformer" else {})
    else:
        if motor["type"] == "induction":
            motor.pop("starting_torque", None)
        until = speeds if chance(rng, 0.6) else times
        if count > 1 and chance(rng, 0.2):
            until = [times[0], *speeds[1:]]
        name = "added" if kind == "resistance" else "field"
        steps = sorted((short(rng.uniform(0.5, 6), 2) for _ in range(count)), reverse=True)
        if kind == "field":
            steps = [short(1 + 0.2 * (count - k), 2) for k in range(count)]
        motor["start"] = {"type": kind, "until": until, name: steps}
    wheel = {k: v for k, v in scene["flywheel"].items() if k == "on"}
    gain = size.gain[wheel.get("on", "crank")]
    scene["flywheel"] = wheel | {"inertia": short(size.inertia * spread(rng, 0.02, 3) / gain**2)}
    return scene, size.pace, size.inertia


def _friction(rng: Rng) -> tuple[Scene, float, float]:
    """A linkage whose joints rub."""
    scene, size = composed(rng, lambda r, s: _alone(r, s, RUBBING))
    joints = [dict(joint) for joint in scene["mechanism"]["joints"]]
    for joint in joints:
        if chance(rng, 0.6):
            joint["friction"] = short(rng.uniform(0.02, 0.2), 2)
            if joint["type"] == "pin":
                joint["radius"] = short(rng.uniform(0.005, 0.02), 2)
    scene["mechanism"] = scene["mechanism"] | {"joints": joints}
    if scene["drive"].get("motor", {}).get("electrical"):
        raise ValueError("slow")
    return scene, size.pace, size.inertia


def _limits(rng: Rng) -> tuple[Scene, float, float]:
    """Limits of heat and current, a field that is given late, an idling engine, a balance that is a load's."""
    scene, size = composed(rng)
    kind = str(rng.choice(["heat", "heat", "field", "idle", "parameter"]))
    wheel = {k: v for k, v in scene["flywheel"].items() if k == "on"}
    if kind == "heat":
        motor = _static(scene, "dc", "induction")
        _plate(motor)
        limits = {"motor_heat": short(rng.uniform(0.3, 2.0), 3), "irregularity": spread(rng, 0.02, 0.8)}
        limits["motor_torque"] = short(rng.uniform(0.7, 2.0), 3)
        if motor["type"] == "dc":
            limits["current_pulsation"] = spread(rng, 0.05, 1.5)
        names = {"motor_heat" if chance(rng, 0.6) else "current_pulsation", str(rng.choice(list(limits)))} & set(limits)
        scene["flywheel"] = wheel | {"limits": {name: limits[name] for name in sorted(names)}}
    elif kind == "field":
        motor = scene["drive"].get("motor", {})
        if motor.get("type") != "synchronous":
            raise ValueError("another motor")
        speed = 2 * math.pi * float(motor["frequency"].split()[0]) / (motor["poles"] / 2)
        motor |= {"field_at": short(speed * rng.uniform(0.8, 0.96)), "field_time": short(spread(rng, 0.05, 1.0) / speed * 6)}
        motor["asynchronous_ratio"] = 2.0
    elif kind == "idle":
        motor = _static(scene, "engine")
        motor["idle"] = short(motor["speed"] * rng.uniform(0.2, 0.5))
        if "full_load" in motor:
            motor["idle"] = max(motor["idle"], motor["full_load"]["speed"][0])
    else:
        first = next((row for row in scene["load"] if isinstance(row.get("force", row.get("torque")), str)), None)
        if first is None or "motor" in scene["drive"] or "while" in first:
            raise ValueError("no load to balance")
        if re.search(r"\b(t|omega)\b", str(scene["drive"]["torque"])):
            raise ValueError("a drive that needs another balance")
        what = "force" if "force" in first else "torque"
        first[what] = f"F*({first[what]})"
        scene["parameters"] = {"F": "balance"}
        if scene["drive"]["torque"] == "balance":
            scene["drive"]["torque"] = short(size.moment / size.gain[scene["drive"].get("on", "crank")])
        scene.setdefault("regime", {})["speed"] = short(size.pace)
        scene["flywheel"] = wheel | {"irregularity": spread(rng, 0.01, 0.8)}
    return scene, size.pace, size.inertia


DRAWERS = {"duty": _duty, "stroke": _stroke, "models": _models, "starts": _starts, "friction": _friction, "limits": _limits}
