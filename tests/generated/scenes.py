"""Scenes over the whole schema from a seed: what moves, what acts on it in which words, what drives it, what is asked."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

import numpy as np

from tests.estimates import bars
from tests.estimates.bars import short
from tests.oracle.courses import Machine
from tests.oracle.drive_lines import tree
from tests.oracle.motions import Mechanism, mechanism

Scene = dict[str, Any]
Rng = np.random.Generator
FAMILIES = ("scotch-yoke", "slider-crank", "four-bar", "crank-shaper", "linked slider", "linked bars", "toggle press")


def spread(rng: Rng, low: float, high: float) -> float:
    """A number whose logarithm is evenly spread."""
    return short(low * (high / low) ** rng.random())


def chance(rng: Rng, share: float) -> bool:
    """True in a share of cases."""
    return bool(rng.random() < share)


class Drawn(NamedTuple):
    """A scene with its seed, about the crank's speed that it is made for (rad/s), and its mean reduced inertia (kg m²)."""

    seed: int
    scene: Scene
    pace: float
    inertia: float

    def speed(self, shaft: str) -> float:
        """Speed of a shaft over the crank's."""
        index, shafts = tree(self.scene)
        return shafts[index[shaft]].speed


def drawn(seed: int) -> Drawn:
    """The scene of a seed."""
    for attempt in range(20):
        try:
            scene, size = composed(np.random.default_rng([seed, attempt]))
        except (ValueError, ArithmeticError):  # nothing moves, or nothing has inertia
            continue
        return Drawn(seed, {"title": f"seed {seed}"} | scene, size.pace, size.inertia)
    raise ValueError(seed)


class Size:
    """Scales of a machine: its pace (rad/s of the crank), moments on the crank (N m), and how far each place moves."""

    def __init__(self, rng: Rng, scene: Scene) -> None:
        self.pace = spread(rng, 1.0, 40.0)
        machine = Machine(scene)
        grid = np.linspace(0, machine.cycle, 48, endpoint=False)
        rows = [(phi, machine.bodies(float(phi))) for phi in grid]
        inertia = sum(o * s * s for o, s in zip(machine.own, machine.speeds, strict=True))
        moved = [
            inertia + sum(h.inertia * machine.speeds[p.shaft] ** 2 for p, h in zip(machine.parts, here, strict=True))
            for _, here in rows
        ]
        falls = [sum(h.fall * machine.speeds[p.shaft] for p, h in zip(machine.parts, here, strict=True)) for _, here in rows]
        self.inertia = float(np.mean(moved))
        if not self.inertia > 1e-6:
            raise ValueError("no inertia")
        self.moment = self.inertia * self.pace**2 * spread(rng, 0.01, 2.0)
        heavy = 1.5 * float(np.max(np.abs(falls)))
        if heavy > self.moment:
            self.moment = heavy * (1 + rng.random())
            self.pace = short(math.sqrt(self.moment / self.inertia / spread(rng, 0.02, 0.3)))
        self.gain = {name: machine.speeds[k] for name, k in machine.index.items()}
        self.ports: dict[str, tuple[float, float, float]] = {}
        for name, (i, k) in machine.places.items():
            values = np.array([here[i].ports[k] for _, here in rows])
            speed = machine.speeds[machine.parts[i].shaft]
            way = float(np.sqrt(np.mean((values[:, 1] * speed) ** 2)))
            self.ports[name] = (way, float(values[:, 0].min()), float(values[:, 0].max()))
            self.gain[name] = way


def composed(rng: Rng, moving: Callable[[Rng, Scene], list[tuple[str, bool]]] | None = None) -> tuple[Scene, Size]:
    """A scene with its scales; `moving` adds other mechanisms than those of every kind, and tells their ports."""
    scene: Scene = {}
    _shafts(rng, scene)
    ports = (moving or _mechanisms)(rng, scene)
    _inertias(rng, scene, ports)
    if chance(rng, 0.35) and ports:
        scene["gravity"] = {} if chance(rng, 0.7) else {"g": 3.7, "direction": f"{rng.integers(-180, 180)} deg"}
    if scene.pop("two turns", False):
        scene["regime"] = {"cycle": "720 deg"}
    size = Size(rng, scene)
    _loads(rng, scene, ports, size)
    _passive(rng, scene, ports, size)
    _drive(rng, scene, size)
    _asked(rng, scene, size)
    return scene, size


def _shafts(rng: Rng, scene: Scene) -> None:
    names, shafts = ["crank"], {}
    for k in range(int(rng.choice([0, 0, 1, 1, 2, 3]))):
        on = names[-1] if chance(rng, 0.6) else str(rng.choice(names))
        row: Scene = {"ratio": short(rng.choice([rng.uniform(0.5, 4), rng.integers(2, 7)]))}
        if on != "crank" or chance(rng, 0.3):
            row["on"] = on
        if chance(rng, 0.5):
            row["efficiency"] = short(rng.uniform(0.6, 0.99), 3)
        if chance(rng, 0.2):
            row["slip"] = f"{short(rng.uniform(0.5, 4), 2)} %"
        shafts[f"s{k}"] = row
        names.append(f"s{k}")
    if shafts:
        scene["shafts"] = shafts


def _mechanisms(rng: Rng, scene: Scene) -> list[tuple[str, bool]]:
    """Mechanisms of a scene; their ports, and whether each translates."""
    count = int(rng.choice([0, 0, 1, 1, 1, 1, 2]))
    result, ports = [], []
    for k in range(count):
        kind = str(rng.choice([*FAMILIES, "slider-crank", "scotch-yoke", "outputs"]))
        table, offered = _outputs(rng) if kind == "outputs" else _family(rng, kind)
        name = table["type"] if count == 1 else f"m{k}"
        if count > 1:
            table["name"] = name
        if chance(rng, 0.3):
            table["phase"] = f"{rng.integers(0, 24) * 15} deg"
        whole = [n for n, s in scene.get("shafts", {}).items() if "on" not in s and "slip" not in s]
        if whole and chance(rng, 0.35) and table["type"] != "law":
            table["shaft"] = on = str(rng.choice(whole))
            ratio = scene["shafts"][on]["ratio"] = int(rng.integers(1, 4)) if chance(rng, 0.7) else 0.5
            scene["two turns"] = scene.get("two turns", False) or ratio == 0.5
        result.append(table)
        ports += [(f"{name}.{port}" if count > 1 else port, what == "force") for port, what, _ in offered]
    if scene.get("two turns") and any(table["type"] == "law" for table in result):
        raise ValueError("a law would not repeat")
    if result:
        scene["mechanism"] = result[0] if count == 1 else result
    return ports


def _family(rng: Rng, kind: str) -> tuple[Scene, Any]:
    """A mechanism of a family that turns round and stays away from where it locks."""
    while True:
        table, ports = bars.KINDS[kind](Random(int(rng.integers(2**31))))
        with np.errstate(invalid="ignore", divide="ignore"):  # bars that do not close have no series
            result = Mechanism(mechanism(table, 2 * math.pi, {}, Path()), 2 * math.pi, None, {})
        if result.series is not None and result.series[0].size < 120:
            return table, ports


def _outputs(rng: Rng) -> tuple[Scene, Any]:
    """A law of motion of a few harmonics."""
    size = spread(rng, 0.02, 0.5)
    texts = [f"{short(size * rng.uniform(-1, 1) / k**2)!r}*{rng.choice(['sin', 'cos'])}({k}*phi)" for k in (1, 2, 3)]
    if chance(rng, 0.7):
        output: Scene = {"x": " + ".join(texts), "mass": spread(rng, 0.5, 50)}
        return {"type": "law", "outputs": {"follower": output}}, [("follower", "force", size)]
    output = {"theta": f"phi + {short(rng.uniform(0.1, 0.8))!r}*sin(phi)", "inertia": spread(rng, 0.01, 1)}
    return {"type": "law", "outputs": {"disc": output}}, [("disc", "torque", 1.0)]


def _inertias(rng: Rng, scene: Scene, ports: list[tuple[str, bool]]) -> None:
    rows = []
    if not ports or chance(rng, 0.65):  # else nothing on the crank but its own mechanism
        rows.append({"on": "crank", "value": spread(rng, 0.05, 20)})
    for name, row in scene.get("shafts", {}).items():
        if chance(rng, 0.6):
            rows.append({"on": name, "value": short(spread(rng, 0.02, 5) / row["ratio"] ** 2)})
    if ports and chance(rng, 0.2):
        name, slides = ports[rng.integers(len(ports))]
        rows.append({"on": name, "value": spread(rng, 0.5, 20) if slides else spread(rng, 0.01, 1)})
    if rows:
        scene["inertia"] = rows


def _loads(rng: Rng, scene: Scene, ports: list[tuple[str, bool]], size: Size) -> None:
    loads = []
    for _ in range(int(rng.choice([1, 2, 2, 3, 4, 5]))):
        if ports and chance(rng, 0.55):
            on, slides = ports[rng.integers(len(ports))]
        else:
            on, slides = str(rng.choice(["crank", *scene.get("shafts", {})])), False
        gain = size.gain[on]
        if gain < 1e-9:
            continue
        effort = size.moment * spread(rng, 0.1, 1.0) / gain
        loads.append(_load(rng, scene, on, slides, effort, size.pace * gain))
    scene["load"] = loads
    for name in ("crank", *scene.get("shafts", {})):
        if chance(rng, 0.2):
            table = scene.setdefault("shafts", {}).setdefault(name, {})
            table["drag"] = short(size.moment * spread(rng, 0.05, 0.5) / size.gain[name])


def _load(rng: Rng, scene: Scene, on: str, slides: bool, effort: float, speed: float) -> Scene:
    """A load of about a size at about a speed of its place."""
    e, w, what = short(effort), short(speed), "force" if slides else "torque"
    on_port = on not in ("crank", *scene.get("shafts", {}))
    dry = [
        f"-{e!r}*sign(v)",
        f"-{e!r}*sign(v) - {short(e / w)!r}*v",
        f"-{e!r}*(v > 0) + {short(0.7 * e)!r}*(v < 0)",
        f"-{e!r}*sign(v)*(1 + 0.5*sin(phi))",
        f"-{e!r}*sign(v)*(1 + (v/{w!r})**2)",
        f"-{short(0.5 * e)!r}*(sign(v) + v/{w!r}) - {short(0.2 * e)!r}*sign(v)",
        f"-{e!r}*sign(v)*(1 + 0.1*abs(omega)/{w!r})" if not on_port else f"-{e!r}*sign(v)",
    ]
    smooth = [
        f"-{short(e / w)!r}*v",
        f"-{short(e / w**2)!r}*v*abs(v)",
        f"-{short(e / w)!r}*omega" if not on_port else f"-{short(e / w)!r}*v",
        f"-{e!r}*(1 + 0.8*sin(phi))*v/{w!r}",
        f"-{e!r}*max(0, v/{w!r} - 0.5)",
    ]
    placed = [
        f"{e!r}*sin(phi)",
        f"-{e!r}*(1 + cos(2*phi))",
        f"-{e!r}*max(sin(phi), 0)",
        f"-{e!r} if 1 < phi < 2.5 else {short(0.1 * e)!r}",
        f"-{e!r}",
    ]
    timed = [
        f"-{e!r}*sign(v)*(1 + 0.5*(t > {short(6 / w if not on_port else 1.0, 2)!r}))",
        f"-{short(0.3 * e)!r}*sin({short(w, 2)!r}*t)",
    ]
    kind = rng.choice(
        ["dry", "dry", "smooth", "placed", "model", "table", "timed", "window"],
        p=[0.25, 0.1, 0.15, 0.14, 0.18, 0.08, 0.02, 0.08],
    )
    row: Scene = {"on": on}
    if kind == "table":
        row["table"] = _table(rng, e)
        row["every"] = "360 deg"
    elif kind == "model":
        row["model"] = _model(rng, what, e, w)
    elif kind == "window":
        start = int(rng.integers(0, 36)) * 10
        row |= {
            what: -e,
            "from": f"{start} deg",
            "to": f"{(start + int(rng.integers(2, 20)) * 10) % 360} deg",
            "every": "360 deg",
        }
    else:
        row[what] = str(rng.choice({"dry": dry, "smooth": smooth, "placed": placed, "timed": timed}[str(kind)]))
        row["every"] = "360 deg"
    if chance(rng, 0.1):
        row["factor"] = f"{rng.integers(30, 120)} %"
    if on_port and kind in ("smooth", "placed", "window") and chance(rng, 0.15):
        row["while"] = str(rng.choice(["v > 0", "v < 0"]))
    return row


def _model(rng: Rng, what: str, effort: float, speed: float) -> Scene:
    pace, unit = ("speed", "N m s") if what == "torque" else ("velocity", "N s/m")
    kind = str(rng.choice(["constant", "losses", "losses", "fan", "belt" if what == "torque" else "constant"]))
    if kind == "constant":
        return {"type": "constant", what: effort}
    if kind == "belt":
        return {"type": "belt", "tight": short(effort * 3), "slack": short(effort), "radius": 0.5}
    if kind == "fan":
        result = {"type": str(rng.choice(["fan", "pump"])), what: effort, pace: speed}
        return result | ({"constant": short(0.3 * effort)} if chance(rng, 0.5) else {})
    result = {"type": "losses", "constant": short(effort * rng.uniform(0.2, 1))}
    if chance(rng, 0.7):
        result["proportional"] = (
            f"{short(0.5 * effort / speed):.6f} {unit}" if effort / speed > 0.01 else short(0.5 * effort / speed)
        )
    if chance(rng, 0.4):
        result["quadratic"] = short(0.5 * effort / speed**2)
    return result


def _table(rng: Rng, effort: float) -> Scene:
    inner = sorted(int(a) for a in rng.choice(np.arange(1, 36), size=int(rng.integers(2, 6)), replace=False) * 10)
    angle = [0, *inner, 360]
    if chance(rng, 0.3):
        angle = sorted([*angle, inner[0]])
    return {
        "angle": angle,
        "value": [short(effort * rng.uniform(-1, 0.3), 3) for _ in angle],
        "angle_unit": "deg",
        "interpolation": str(rng.choice(["linear", "step", "pchip"])),
    }


def _passive(rng: Rng, scene: Scene, ports: list[tuple[str, bool]], size: Size) -> None:
    sliding = [name for name, slides in ports if slides and size.gain[name] > 1e-6]
    if sliding and chance(rng, 0.25):
        name = str(rng.choice(sliding))
        way, low, high = size.ports[name]
        stiffness = short(size.moment * spread(rng, 0.1, 0.6) / way / max(high - low, 1e-9))
        scene["spring"] = [{"on": name, "stiffness": stiffness, "rest": short(0.5 * (low + high))}]
    if chance(rng, 0.3):
        name = str(rng.choice(["crank", *scene.get("shafts", {}), *sliding]))
        scene["damper"] = [
            {"on": name, "coefficient": short(0.2 * size.moment * rng.random() / size.pace / size.gain[name] ** 2)}
        ]


def _drive(rng: Rng, scene: Scene, size: Size) -> None:
    """A drive that carries about what the loads take at about the pace."""
    on = str(rng.choice(["crank", *scene.get("shafts", {})]))
    share, at = 1.0, on
    while at != "crank":
        row = scene["shafts"][at]
        share *= row.get("efficiency", 1.0)
        at = row.get("on", "crank")
    taken = _taken(scene, size)
    gain = size.gain[on]
    torque = max(taken, 0.1 * size.moment) / gain / share
    speed = size.pace * gain
    t, w = short(torque * rng.uniform(1.0, 1.6)), short(speed)
    kinds = ["line", "curve", "constant", "ramp", "balance", "motor", "motor", "motor"]
    kind = str(rng.choice(kinds, p=[0.2, 0.1, 0.06, 0.08, 0.12, 0.2, 0.12, 0.12]))
    drive: Scene = {"on": on} if on != "crank" else {}
    if kind == "line":
        drive["torque"] = f"{short(3 * t)!r} - {short(2 * t / w)!r}*omega"
    elif kind == "curve":
        drive["torque"] = f"{short(2 * t)!r} - {short(t / w**2)!r}*omega*abs(omega)"
    elif kind == "constant":
        drive["torque"] = short(t * 1.2)
    elif kind == "ramp":
        rise = short(torque / max(2 * math.pi / size.pace * rng.uniform(0.1, 1.0), 1e-3))
        falls = f" - {short(2 * t / w)!r}*omega" if chance(rng, 0.5) else ""
        drive["torque"] = f"min({short(3 * t)!r}, {rise!r}*t){falls}"
    elif kind == "balance":
        drive["torque"] = "balance"
    else:
        drive["motor"] = _motor(rng, t, w)
        if chance(rng, 0.5):
            drive["motor"]["inertia"] = short(size.inertia * rng.uniform(0.01, 0.3) / gain**2)
    scene["drive"] = drive
    if kind == "balance":
        scene.setdefault("regime", {})["speed"] = short(size.pace)


def _taken(scene: Scene, size: Size) -> float:
    """The mean moment (N m, on the crank) that loads take at the pace."""
    machine = Machine({k: v for k, v in scene.items() if k != "drive"}, inertia=0.0)
    result = []
    for phi in np.linspace(0, machine.cycle, 25)[:-1] + 0.0123:
        y = [float(phi), size.pace]
        mode = machine.held(1.0, y, 1, (1.0, float(phi), size.pace))
        here = machine.bodies(float(phi))
        _, second = machine.needs(size.pace, here, machine.torques(1.0, y, here, mode))
        result.append(machine.remainder(second, 1))
    return float(np.mean(result))


def _motor(rng: Rng, torque: float, speed: float) -> Scene:
    """A motor that gives about a torque at about a speed."""
    kind = str(
        rng.choice(
            [
                "line",
                "table",
                "dc",
                "dc inductive",
                "induction",
                "induction",
                "hydraulic",
                "engine",
                "synchronous",
                "two-axis",
            ]
        )
    )
    idle = short(1.08 * speed)
    power = short(torque * speed)
    if kind == "line":
        if chance(rng, 0.5):
            return _servo(rng, torque, speed)
        return {"type": "line", "starting_torque": short(8 * torque), "no_load_speed": idle}
    if kind == "table":
        rows = {"speed": [0.0, short(0.6 * speed), short(speed), short(1.1 * speed)]}
        return {"type": "table"} | rows | {"torque": [short(1.8 * torque), short(2.4 * torque), torque, 0.0]}
    if kind.startswith("dc"):
        constant = short(200 / idle)
        result: Scene = {
            "type": "dc",
            "voltage": "200 V",
            "resistance": f"{short(constant * (200 - constant * speed) / torque)} ohm",
            "constant": f"{constant} V s",
        }
        if kind == "dc inductive":
            result["inductance"] = (
                f"{short(volts(result['resistance']) * spread(rng, 0.02, 0.5) * 2 * math.pi / speed):.8f} H"
            )
        return result
    if kind == "induction":
        hertz = short(1.04 * speed / math.pi)  # of four poles
        rated = short(0.96 * math.pi * hertz)
        result = {
            "type": "induction",
            "power": short(torque * rated),
            "speed": rated,
            "poles": 4,
            "frequency": f"{hertz} Hz",
        }
        result["breakdown_ratio"] = short(rng.uniform(1.8, 3.5), 3)
        if chance(rng, 0.4):
            result["starting_torque"] = short(rng.uniform(1.1, 1.7), 3)
        roll = rng.random()
        if roll > 0.7:
            return _on_inverter(rng, result, torque, rated, hertz)
        if roll < 0.35:
            result["start"] = _start(rng, rated, 2 * math.pi / rated)
        return result
    if kind == "hydraulic":
        pressure, turn = 1e7, 2 * math.pi
        displacement = torque * turn / pressure / 0.9
        result = {
            "type": "hydraulic",
            "displacement": f"{displacement * 1e6:.6g} cm^3",
            "flow": short(idle * displacement / turn),
        }
        result |= {"pressure": "100 bar", "volumetric_efficiency": 0.92, "mechanical_efficiency": 0.94}
        return result | ({"override": 0.1} if chance(rng, 0.5) else {})
    if kind == "engine":
        result = {"type": "engine", "speed": speed, "droop": short(rng.uniform(0.04, 0.12), 2)}
        if chance(rng, 0.5):
            return result | {"torque": short(1.3 * torque), "braking_torque": short(0.2 * torque)}
        full = {"speed": [short(0.4 * speed), short(0.8 * speed), short(1.1 * speed)]}
        return result | {"full_load": full | {"torque": [short(1.2 * torque), short(1.6 * torque), short(1.3 * torque)]}}
    if kind == "synchronous":
        result = {
            "type": "synchronous",
            "power": power,
            "poles": 4,
            "frequency": f"{speed / math.pi!r} Hz",
            "pull_out_ratio": 2.2,
        }
        return result | {"asynchronous_slip": f"{rng.integers(1, 8)} %"}
    return _two_axis(torque, speed)


def _servo(rng: Rng, torque: float, speed: float) -> Scene:
    """A servo drive that holds about a speed, by a soft or a stiff controller; its peak curve may cut it off."""
    result: Scene = {"type": "servo", "speed": speed, "torque": torque, "set_speed": short(speed * rng.uniform(0.8, 1.1))}
    result |= {"droop": short(spread(rng, 0.005, 0.1)), "peak_torque": short(torque * rng.uniform(1.5, 4.0))}
    result |= {"corner_speed": short(speed * rng.uniform(0.7, 1.15)), "maximum_speed": short(1.5 * speed)}
    return result | {"standstill_torque": short(1.2 * torque), "efficiency": 0.9, "braking": "regenerative"}


def _on_inverter(rng: Rng, found: Scene, torque: float, rated: float, hertz: float) -> Scene:
    """A motor of another frequency of the mains, on an inverter that turns its field at about the same speed."""
    mains = short(hertz * rng.choice([0.8, 1.0, 1.3, 2.0]))
    speed = short(math.pi * mains - (math.pi * hertz - rated))
    fed: Scene = {"frequency": f"{hertz} Hz"}
    if chance(rng, 0.6):
        fed["torque_limit"] = short(rng.uniform(0.7, 0.95 * found["breakdown_ratio"]), 3)
    if chance(rng, 0.2):
        fed["field_weakening_from"] = f"{short(hertz * rng.uniform(0.85, 1.3))} Hz"
    return found | {"power": short(torque * speed), "speed": speed, "frequency": f"{mains} Hz", "inverter": fed}


def volts(text: str) -> float:
    """The number of a quantity."""
    return float(text.split()[0])


def _two_axis(torque: float, speed: float) -> Scene:
    """An induction motor by its circuit: rated and breakdown torque are those of the circuit."""
    hertz, poles, u = short(1.04 * speed / math.pi), 4, 400.0
    sync = math.pi * hertz
    rated = short(0.96 * sync)
    phase = u / math.sqrt(3)
    z = 1.5 * phase**2 / (sync * torque) * 0.04 / 0.96  # rotor resistance that gives about the torque at 4 % of slip
    rr, rs, xs, xr, xm = (short(z * k) for k in (1.0, 0.8, 2.2, 2.2, 70.0))
    slip = 1 - rated / sync

    fed = round(1e3 * hertz) % 3 == 0  # of mains with another frequency, by an inverter
    k = 1.25 if fed else 1.0

    def at(s: float) -> float:
        rotor, shared = complex(rr / s, xr * k), 1j * xm * k
        both = shared * rotor / (rotor + shared)
        inner = k * phase / (complex(rs, xs * k) + both) * shared / (rotor + shared)
        return 3 * abs(inner) ** 2 * rr / s / (k * sync)

    slip /= k
    most = max(at(s) for s in np.geomspace(0.01, 1, 400))
    speed = short(k * sync * (1 - slip))
    result: Scene = {"type": "induction", "electrical": "two-axis", "power": short(at(slip) * speed), "speed": speed}
    result |= {"poles": poles, "frequency": f"{k * hertz!r} Hz", "breakdown_ratio": short(most / at(slip))}
    result["voltage"] = f"{k * u} V"
    if fed:
        result["inverter"] = {"frequency": f"{hertz} Hz", "braking": "regenerative", "overcurrent": 20}
    names = ("stator_resistance", "stator_reactance", "magnetizing_reactance", "rotor_resistance", "rotor_reactance")
    return result | {name: f"{value} ohm" for name, value in zip(names, (rs, xs * k, xm * k, rr, xr * k), strict=True)}


def _start(rng: Rng, rated: float, period: float) -> Scene:
    kind = str(rng.choice(["star-delta", "transformer", "soft"]))
    time = short(period * spread(rng, 2, 30), 3)
    if kind == "soft":
        return {"type": "soft", "voltage": 0.4, "ramp": f"{time} s"}
    return {"type": kind, "until": f"{time} s"} | ({"voltage": 0.6} if kind == "transformer" else {})


def _asked(rng: Rng, scene: Scene, size: Size) -> None:
    on = str(rng.choice(["crank", "crank", *scene.get("shafts", {})]))
    wheel: Scene = {"on": on} if on != "crank" else {}
    motor = scene["drive"].get("motor", {})
    if motor.get("type") in ("induction", "hydraulic") and "electrical" not in motor and chance(rng, 0.35):
        limits = {"irregularity": spread(rng, 0.02, 0.8), "motor_torque": short(rng.uniform(0.7, 2.0), 3)}
        limits["motor_rms"] = short(rng.uniform(0.6, 1.5), 3)
        names = rng.choice(list(limits), size=int(rng.integers(1, 4)), replace=False)
        scene["flywheel"] = wheel | {"limits": {str(name): limits[str(name)] for name in names}}
    elif chance(rng, 0.7):
        scene["flywheel"] = wheel | {"irregularity": spread(rng, 0.003, 1.2)}
    else:
        scene["flywheel"] = wheel | {"inertia": short(size.inertia * spread(rng, 0.02, 5) / size.gain[on] ** 2)}
    scene["accuracy"] = {"rtol": float(rng.choice([1e-6, 1e-9]))}
