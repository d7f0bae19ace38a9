"""Random drive lines beside the series equations of `tests.oracle.drive_lines`.

    python -m tests.oracle.random_drive_lines 0 200          # seeds; a line for each figure that is off by more than it says

Two to seven shafts in a tree, each on the crank or on another, with belts that slip, drags, meshes that lose from 1 % to a
third, a slider-crank or a scotch yoke under a window of force, a branch with a fan or a damper, a motor far from the crank.
"""

from __future__ import annotations

import math
import sys
import warnings
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

import flywheel
from tests.oracle.drive_lines import DriveLine, Regime

RTOLS = (1e-3, 1e-6, 1e-9, 1e-11)
FLOOR = 2e-11  # what the oracle itself may be off by


def scene(seed: int) -> dict[str, Any]:
    """A drive line with a given flywheel that leaves it an irregularity of some per cent."""
    rng = np.random.default_rng(seed)
    found = _machine(rng)
    names = ["crank"]
    shafts: dict[str, Any] = {}
    for k in range(int(rng.integers(2, 8))):
        on = names[-1] if rng.random() < 0.6 else str(rng.choice(names))
        shaft: dict[str, Any] = {"ratio": _round(rng.uniform(0.5, 4.0))}
        if on != "crank" or rng.random() < 0.3:
            shaft["on"] = on
        if rng.random() < 0.75:
            shaft["efficiency"] = _round(1.0 - 10 ** rng.uniform(-2, -0.5))
        if rng.random() < 0.4:
            shaft["slip"] = f"{_round(rng.uniform(0.3, 5.0))} %"
        name = f"s{k}"
        shafts[name] = shaft
        names.append(name)
        if rng.random() < 0.8:
            found["inertia"].append({"on": name, "value": _round(10 ** rng.uniform(-2.5, 0) / _speed(shafts, name) ** 2)})
    found["shafts"] = shafts
    end = _farthest(shafts)
    mean = _of_loads(found)
    _drive(rng, found, shafts, end, mean)
    for name in shafts:
        speed = _speed(shafts, name)
        if rng.random() < 0.35:
            shafts[name]["drag"] = _round(rng.uniform(0.01, 0.1) * mean / speed)
    branch = str(rng.choice([n for n in names if n != end]))
    if rng.random() < 0.4:
        c = _round(rng.uniform(0.02, 0.1) * mean / found["pace"] / _speed(shafts, branch) ** 2)
        found.setdefault("damper", []).append({"on": branch, "coefficient": c})
    elif rng.random() < 0.5:
        c = _round(rng.uniform(0.02, 0.1) * mean / found["pace"] ** 2 / _speed(shafts, branch) ** 3)
        found["load"].append({"on": branch, "torque": f"-{c}*omega*abs(omega)"})
    on = str(rng.choice(["crank", end, end, *names]))
    wheel = rng.uniform(10.0, 60.0) * mean / found.pop("pace") ** 2 / _speed(shafts, on) ** 2
    found["flywheel"] = {"on": on, "inertia": _round(wheel)}
    return found


def _round(value: float) -> float:
    return float(f"{value:.4g}")


def _speed(shafts: dict[str, Any], name: str) -> float:
    """Speed over the crank's, slip aside."""
    found = 1.0
    while name != "crank":
        found, name = found * shafts[name]["ratio"], shafts[name].get("on", "crank")
    return found


def _farthest(shafts: dict[str, Any]) -> str:
    """The shaft through most meshes."""

    def depth(name: str) -> int:
        return 0 if name == "crank" else 1 + depth(shafts[name].get("on", "crank"))

    return max(shafts, key=depth)


def _machine(rng: np.random.Generator) -> dict[str, Any]:
    """A crank with its mechanism, a window of force, sliding friction, perhaps weights."""
    r = _round(rng.uniform(0.03, 0.2))
    crank = {
        "length": r,
        "mass": _round(rng.uniform(1, 10)),
        "inertia": _round(rng.uniform(0.05, 0.5)),
        "com": _round(r / 5),
    }
    start = float(rng.integers(0, 300))
    force = {"from": f"{start} deg", "to": f"{min(start + float(rng.integers(20, 80)), 359.0)} deg"}
    size = _round(rng.uniform(2e3, 2e4))
    slide: dict[str, Any] = {"mass": _round(rng.uniform(2, 40))}
    if rng.random() < 0.6:
        rod = {"length": _round(r * rng.uniform(3, 6)), "mass": _round(rng.uniform(1, 10)), "inertia": 0.05, "com": r}
        if rng.random() < 0.4:
            slide["offset"] = _round(0.2 * r)
        kind = {"type": "slider-crank", "crank": crank, "rod": rod, "slider": slide}
        port = "slider"
    else:
        kind = {"type": "scotch-yoke", "crank": crank, "yoke": slide, "block": {"mass": 1.0}}
        port = "yoke"
    forward = math.sin(math.radians(start + 20)) < 0  # the port moves towards its greatest displacement
    load = [{"on": port, "force": -size if forward else size, **force}]
    if rng.random() < 0.6:
        load.append({"on": port, "force": f"-{_round(size / 30)}*sign(v)"})
    if rng.random() < 0.4:
        load.append({"on": "crank", "torque": _round(-size * r / 10), "from": "200 deg", "to": "320 deg"})
    found = {"mechanism": kind, "load": load, "inertia": [], "pace": _round(rng.uniform(4, 20))}
    return found | ({"gravity": {}} if rng.random() < 0.5 else {})


def _of_loads(found: dict[str, Any]) -> float:
    """A size of the mean torque on the crank (N m)."""
    return (
        0.15
        * max(abs(row["force"]) for row in found["load"] if isinstance(row.get("force"), float))
        * float(found["mechanism"]["crank"]["length"])
    )


def _drive(rng: np.random.Generator, found: dict[str, Any], shafts: dict[str, Any], end: str, mean: float) -> None:
    """A balance at a speed, a straight line, an induction motor or a curve written out, at the end of the line."""
    pace, speed = found["pace"], _speed(shafts, end)
    share = 1.0
    at = end
    while at != "crank":
        row = shafts[at]
        share *= row.get("efficiency", 1.0) * (1 - float(str(row.get("slip", "0 %")).split()[0]) / 100)
        at = row.get("on", "crank")
    torque, omega = 1.5 * mean / share / speed, pace * speed
    kind = rng.integers(0, 4)
    if kind == 0:
        found["drive"] = {"on": end, "torque": "balance"}
        found["regime"] = {"speed": pace}
    elif kind == 1:
        motor = {"type": "line", "starting_torque": _round(10 * torque), "no_load_speed": _round(1.1 * omega)}
        found["drive"] = {"on": end, "motor": motor}
    elif kind == 2:
        hertz = _round(1.05 * omega / math.tau)
        rated = _round(0.96 * math.tau * hertz)
        motor = {
            "type": "induction",
            "power": _round(torque * rated),
            "speed": rated,
            "poles": 2,
            "frequency": f"{hertz} Hz",
        }
        inertia = _round(rng.uniform(0.02, 0.5) / speed**2)
        found["drive"] = {"on": end, "motor": motor | {"breakdown_ratio": _round(rng.uniform(2.5, 4)), "inertia": inertia}}
    else:
        found["drive"] = {"on": end, "torque": f"{_round(2 * torque)} - {_round(torque / omega**2)}*omega*omega"}


PRESS: dict[str, Any] = {
    "shafts": {
        "wheel": {"ratio": 6.0, "efficiency": 0.97, "drag": 4.0},
        "motor": {"on": "wheel", "ratio": 4.7, "efficiency": 0.96, "slip": "2 %"},
    },
    "mechanism": {
        "type": "slider-crank",
        "crank": {"length": 0.05, "mass": 90, "inertia": 2.4},
        "rod": {"length": 0.4, "mass": 45, "inertia": 1.1, "com": 0.13},
        "slider": {"mass": 160},
    },
    "load": [{"on": "slider", "force": "-250 kN", "from": "320 deg", "to": "350 deg"}],
    "inertia": [{"on": "wheel", "value": 0.25}],
    "drive": {
        "on": "motor",
        "motor": {
            "type": "induction",
            "power": 6000.0,
            "speed": "1380 rpm",
            "poles": 4,
            "frequency": "50 Hz",
            "breakdown_ratio": 2.8,
            "inertia": 0.016,
        },
    },
    "flywheel": {"on": "wheel", "inertia": 14.0},
}


def _shafts(**changed: dict[str, Any]) -> dict[str, Any]:
    """The press with keys of its shafts changed."""
    return PRESS | {"shafts": {name: row | changed.get(name, {}) for name, row in PRESS["shafts"].items()}}


def _on_motor(table: dict[str, Any], **changed: Any) -> dict[str, Any]:
    return table | {"drive": {"on": "motor", "motor": table["drive"]["motor"] | changed}}


def _long(on: list[str]) -> dict[str, Any]:
    """Twelve shafts, each on the shaft named; the motor on the last, the flywheel in the middle."""
    shafts = {
        f"s{k}": {
            "on": near,
            "ratio": 1.3,
            "efficiency": 0.98 - 0.005 * k,
            "slip": "0.4 %" if k % 3 == 0 else 0,
            "drag": 0.2,
        }
        for k, near in enumerate(on)
    }
    inertia = [{"on": name, "value": 0.05 / (k + 1)} for k, name in enumerate(shafts)]
    sent = {"on": "s11", "torque": "400 - 3*omega"}
    return PRESS | {"shafts": shafts, "inertia": inertia, "drive": sent, "flywheel": {"on": "s5", "inertia": 60.0}}


EXTREMES: dict[str, dict[str, Any]] = {
    "efficiency of 2 %": _shafts(motor={"efficiency": 0.02})
    | {"drive": {"on": "motor", "torque": "balance"}, "regime": {"speed": "50 rpm"}},
    "flywheel behind 20 %": _shafts(wheel={"efficiency": 0.2})
    | {
        "drive": {"on": "motor", "torque": "balance"},
        "regime": {"speed": "50 rpm"},
        "flywheel": {"on": "wheel", "inertia": 90.0},
    },
    "ratio of 1000": _on_motor(
        _shafts(wheel={"ratio": 1000.0, "drag": 0.02}, motor={"ratio": 4.7 * 6 / 1000}), breakdown_ratio=3.0
    )
    | {"flywheel": {"on": "wheel", "inertia": 14.0 * 36 / 1e6}, "inertia": []},
    "ratio of 1/1000": _shafts(wheel={"ratio": 0.001, "drag": 20.0}, motor={"ratio": 4.7 * 6 * 1000})
    | {"flywheel": {"on": "wheel", "inertia": 14.0 * 36e6}},
    "flywheel behind three meshes": PRESS
    | {
        "shafts": PRESS["shafts"]
        | {
            "a": {"on": "wheel", "ratio": 2.0, "efficiency": 0.9},
            "b": {"on": "a", "ratio": 0.7, "efficiency": 0.85, "slip": "3 %"},
            "c": {"on": "b", "ratio": 1.5, "efficiency": 0.95},
        },
        "flywheel": {"on": "c", "inertia": 3.0},
    },
    "the motor's own inertia": _on_motor(PRESS, inertia=2.0) | {"flywheel": {"on": "wheel", "inertia": 0.1}},
    "a motor five times as large": _on_motor(PRESS, power=30e3, speed="980 rpm", poles=6, breakdown_ratio=2.6, inertia=0.48)
    | {"flywheel": {"on": "wheel", "inertia": 3.0}},
    "a load that drives the motor": PRESS
    | {"load": [*PRESS["load"], {"on": "crank", "torque": 1500.0}], "flywheel": {"on": "wheel", "inertia": 14.0}},
    "twelve in series": _long(["crank", *(f"s{k}" for k in range(11))]),
    "a bush of twelve": _long(["crank", "crank", "s0", "s0", "s1", "s1", "s2", "s2", "s3", "s4", "s4", "s9"]),
}


class Off(NamedTuple):
    """A figure that is off by more than the result says: its value, the true one, the error said and the true one."""

    figure: str
    value: float
    true: float
    said: float
    error: float


def pairs(sizing: Any, true: Regime) -> Iterator[tuple[str, float, float, float, float]]:
    """Figures of an analysis or a sizing with the true ones, the errors said of them, and what errors are relative to."""
    found = sizing.as_dict()
    error, motion, energy = found["error"], found["simulation"], found["energy"]
    yield "speed", found["speed"], true.speed, error["speed"], true.speed
    for key in ("irregularity", "speed_max", "speed_min", "period"):
        yield key, motion[key], getattr(true, key), error["simulation"], getattr(true, key)
    if found["balance"] is not None:
        yield "balance", found["balance"]["value"], true.unknown, error["balance"], true.unknown
    flow = sizing.power_flow if hasattr(sizing, "power_flow") else flywheel.power_flow(sizing)
    scale = flow.scale
    drive = true.rms_torque / true.mean_power * scale if true.mean_power else 1.0
    for key, size in (("mean_power", scale), ("peak_power", scale), ("rms_torque", drive)):
        yield key, energy[key], getattr(true, key), error["energy"], max(abs(getattr(true, key)), size)
    if energy.get("rotor_heat") is not None and energy.get("rotor_heat_share") is not None:
        yield "rotor_heat", energy["rotor_heat"], true.rotor_heat, error["rotor_heat"], true.rotor_heat
    of = {(stream.kind, stream.name): stream.mean for stream in flow.streams}
    for name, passed in true.flows.items():
        lost = of.get(("mesh", f"shafts.{name}"), 0.0) + of.get(("slip", f"shafts.{name}"), 0.0)
        yield f"lost {name}", lost, passed.lost, flow.error, scale
        yield f"slip {name}", of.get(("slip", f"shafts.{name}"), 0.0), passed.slip, flow.error, scale
    for row in flow.shafts:
        if row.on is not None:
            rms = true.flows[row.shaft].rms_torque
            yield f"rms torque {row.shaft}", row.torque_rms, rms, flow.error, max(rms, scale / row.speed)
    yield "in less out less losses", flow.left, 0.0, flow.error, scale


def compared(table: dict[str, Any], true: Regime, rtol: float) -> list[Off]:
    """Errors of an analysis or a sizing above its estimates, or above rtol where that is reported as reached."""
    sizing = flywheel.size(flywheel.load(table | {"accuracy": {"rtol": rtol}}), simulate=False)
    found = []
    for figure, value, exact, said, size in pairs(sizing, true):
        error = abs(value - exact) / max(abs(size), 1e-300)
        if error > said + FLOOR or (sizing.reached and error > rtol + FLOOR):
            found.append(Off(figure, value, exact, said, error))
    return found


def recovered(table: dict[str, Any], true: Regime, rtol: float) -> list[Off]:
    """Error of the flywheel that a sizing finds for the irregularity of an analysis, above its estimate or rtol."""
    wheel = {"on": table["flywheel"]["on"], "irregularity": true.irregularity}
    sizing = flywheel.size(flywheel.load(table | {"flywheel": wheel, "accuracy": {"rtol": rtol}}), simulate=False)
    found = sizing.as_dict()
    value, said = found["flywheel"]["exact"], found["error"]["exact"]
    error = abs(value / true.inertia - 1.0)
    allowed = min(said, rtol) if sizing.reached else said
    slack = FLOOR * (1.0 + true.speed / (true.speed_max - true.speed_min))  # as the irregularity is known
    return [Off("flywheel", value, true.inertia, said, error)] if error > allowed + slack else []


def main(first: int, last: int) -> None:
    """Compare seeds, and print what is off."""
    warnings.simplefilter("ignore")
    for seed in range(first, last):
        table = scene(seed)
        try:
            true = DriveLine(table).analysed(table["flywheel"]["inertia"])
        except (ArithmeticError, StopIteration, ValueError) as error:
            print(seed, "no regime by the oracle:", repr(error))
            true = None
        for rtol in RTOLS:
            try:
                if true is None:
                    flywheel.size(flywheel.load(table), simulate=False)
                    print(seed, "  but the toolkit finds one")
                    break
                for off in (*compared(table, true, rtol), *recovered(table, true, rtol)):
                    print(seed, f"{rtol:g}", *off)
            except flywheel.SceneError as error:
                print(seed, f"{rtol:g}", "refused:", error.faults[0].path, error.faults[0].found[:150])
                break
        else:
            print(seed, f"eps {true.irregularity:.4g}, {len(table['shafts'])} shafts, {len(true.pieces)} pieces", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
