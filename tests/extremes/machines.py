"""One machine of every mechanism, each written in any units: a `Measure` turns SI numbers into those of other units."""

from __future__ import annotations

from collections.abc import Callable
from math import tau
from typing import Any, NamedTuple

Scene = dict[str, Any]


class Measure(NamedTuple):
    """Units of length, mass and time, as multiples of m, kg and s; a quantity in SI times its factor is one in them."""

    length: float = 1.0
    mass: float = 1.0
    time: float = 1.0

    def m(self, value: float) -> float:
        return value * self.length

    def kg(self, value: float) -> float:
        return value * self.mass

    def inertia(self, value: float) -> float:
        return value * (self.mass * self.length**2)

    def speed(self, value: float) -> float:
        return value / self.time

    def newton(self, value: float) -> float:
        return value * (self.mass * self.length / self.time**2)

    def joule(self, value: float) -> float:
        return value * (self.mass * self.length**2 / self.time**2)

    def stiffness(self, value: float) -> float:
        return value * (self.mass / self.time**2)

    def gravity(self) -> Scene:
        return {"g": 9.80665 * (self.length / self.time**2)}


SI = Measure()


def running(scene: Scene, speed: float, irregularity: float = 0.05) -> Scene:
    """The scene at a speed (rad/s) with a flywheel for an irregularity, its torque balanced."""
    scene.setdefault("drive", {"torque": "balance"})
    return {**scene, "regime": {**scene.get("regime", {}), "speed": speed}, "flywheel": {"irregularity": irregularity}}


def rotor(u: Measure = SI) -> Scene:
    """A shaft alone, and a table with a jump."""
    table = {"angle": [0, 1, 1, 3, tau], "value": [u.joule(v) for v in (-80.0, 10.0, -130.0, 20.0, 70.0)]}
    return running(
        {"inertia": [{"on": "crank", "value": u.inertia(0.3)}], "load": [{"on": "crank", "table": table}]}, u.speed(10.0)
    )


def yoke(u: Measure = SI) -> Scene:
    """The scotch yoke of Ruggiu, p. 103, at an angle."""
    mechanism = {
        "type": "scotch-yoke",
        "crank": {"length": u.m(0.5)},
        "yoke": {"mass": u.kg(20.0), "direction": 0.3},
    }
    return running(
        {"mechanism": mechanism, "load": [{"on": "yoke", "force": u.newton(1000.0), "from": 0, "to": "180 deg"}]},
        u.speed(6.0),
    )


def slider_crank(u: Measure = SI, rod: float = 0.5, offset: float = 0.03) -> Scene:
    """A press with weights, a spring and a narrow stroke."""
    mechanism = {
        "type": "slider-crank",
        "crank": {"length": u.m(0.1), "mass": u.kg(5.0), "inertia": u.inertia(0.1), "com": u.m(0.02)},
        "rod": {"length": u.m(rod), "mass": u.kg(10.0), "inertia": u.inertia(0.3), "com": u.m(0.2)},
        "slider": {"mass": u.kg(50.0), "offset": u.m(offset)},
    }
    return running(
        {
            "mechanism": mechanism,
            "gravity": u.gravity(),
            "load": [{"on": "slider", "force": u.newton(-20_000.0), "from": "300 deg", "to": "345 deg"}],
            "spring": [{"on": "slider", "stiffness": u.stiffness(2000.0), "rest": u.m(0.4)}],
        },
        u.speed(12.0),
    )


def four_bar(
    u: Measure = SI,
    bars: tuple[float, float, float, float] = (0.4, 0.1, 0.35, 0.3),
    assembly: str = "open",
) -> Scene:
    """A four-bar of ground, crank, coupler, rocker, loaded on its rocker."""
    ground, crank, coupler, rocker = bars
    mechanism = {
        "type": "four-bar",
        "assembly": assembly,
        "ground": {"length": u.m(ground)},
        "crank": {"length": u.m(crank), "mass": u.kg(2.0), "com": u.m(0.05)},
        "coupler": {"length": u.m(coupler), "mass": u.kg(3.0), "inertia": u.inertia(0.04), "com": u.m(0.15)},
        "rocker": {"length": u.m(rocker), "mass": u.kg(4.0), "inertia": u.inertia(0.05), "com": u.m(0.15)},
    }
    load = {"on": "rocker", "torque": u.joule(-50.0), "from": "20 deg", "to": "190 deg"}
    return running({"mechanism": mechanism, "gravity": u.gravity(), "load": [load]}, u.speed(10.0))


def crank_shaper(u: Measure = SI, crank: float = 0.12, frame: float = 0.3) -> Scene:
    """A shaper that cuts while its ram moves one way."""
    mechanism = {
        "type": "crank-shaper",
        "crank": {"length": u.m(crank), "inertia": u.inertia(0.4)},
        "frame": {"length": u.m(frame)},
        "rocker": {"length": u.m(0.6), "mass": u.kg(20.0), "inertia": u.inertia(0.7), "com": u.m(0.3)},
        "ram": {"mass": u.kg(60.0)},
    }
    load = {"on": "ram", "force": u.newton(-2000.0), "while": "v > 0"}
    return running({"mechanism": mechanism, "load": [load]}, u.speed(5.0))


def law(u: Measure = SI) -> Scene:
    """A cam by an expression and one by a table; loads by expressions of parameters."""
    table = {"angle": [0, 1, 2, 4, tau], "value": [u.m(v) for v in (0.0, 0.01, 0.03, 0.02, 0.0)]}
    outputs = {
        "cam": {"x": "a*(1-cos(phi))**2", "mass": u.kg(3.0)},
        "tab": {"table": table, "mass": u.kg(2.0)},
    }
    loads = [
        {"on": "cam", "force": "-F*(1+sign(v))/2"},
        {"on": "tab", "force": "-F*min(1,max(-1,2*(x-a)/a))"},
    ]
    parameters = {"a": u.m(0.02), "F": u.newton(200.0)}
    return running(
        {"parameters": parameters, "mechanism": {"type": "law", "outputs": outputs}, "load": loads}, u.speed(10.0)
    )


def linkage(u: Measure = SI) -> Scene:
    """The four-bar above, as a linkage."""
    bodies = {
        "frame": {"points": {"O": [0, 0], "D": [u.m(0.4), 0]}},
        "crank": {"points": {"B": [u.m(0.1), 0]}, "mass": u.kg(2.0), "com": [u.m(0.05), 0]},
        "coupler": {
            "points": {"C": [u.m(0.35), 0]},
            "mass": u.kg(3.0),
            "inertia": u.inertia(0.04),
            "com": [u.m(0.15), 0],
        },
        "rocker": {
            "points": {"C": [u.m(0.3), 0]},
            "mass": u.kg(4.0),
            "inertia": u.inertia(0.05),
            "com": [u.m(0.15), 0],
        },
    }
    pairs = {
        "O": ["frame.O", "crank.origin"],
        "B": ["crank.B", "coupler.origin"],
        "C": ["coupler.C", "rocker.C"],
        "D": ["frame.D", "rocker.origin"],
    }
    mechanism = {
        "type": "linkage",
        "driver": "O",
        "assembly": [{"point": "coupler.C", "side": "left", "from": "crank.B", "to": "frame.D"}],
        "bodies": bodies,
        "joints": [{"name": name, "type": "pin", "between": pair} for name, pair in pairs.items()],
    }
    return {**four_bar(u), "mechanism": mechanism}


def cam(u: Measure = SI) -> Scene:
    """A cam on the crank with a sliding follower, as a linkage in which no point is away from its body's origin."""
    mechanism = {
        "type": "linkage",
        "driver": "O",
        "bodies": {
            "frame": {"points": {"O": [0, 0]}},
            "disc": {"inertia": u.inertia(0.01)},
            "follower": {"mass": u.kg(4.0)},
        },
        "joints": [
            {"name": "O", "type": "pin", "between": ["frame.O", "disc.origin"]},
            {"name": "ram", "type": "slide", "between": ["frame.O", "follower.origin"], "direction": "90 deg"},
        ],
        "couplings": [{"type": "cam", "between": ["O", "ram"], "lift": "b + h*(1 - cos(2*phi))"}],
    }
    load = {"on": "ram", "force": u.newton(-300.0), "while": "v > 0"}
    parameters = {"b": u.m(0.05), "h": u.m(0.008)}
    return running({"parameters": parameters, "mechanism": mechanism, "gravity": u.gravity(), "load": [load]}, u.speed(5.0))


MACHINES: dict[str, Callable[..., Scene]] = {
    "rotor": rotor,
    "scotch-yoke": yoke,
    "slider-crank": slider_crank,
    "four-bar": four_bar,
    "crank-shaper": crank_shaper,
    "law": law,
    "linkage": linkage,
    "cam": cam,
}
KNOWN = ("rotor", "scotch-yoke", "slider-crank", "four-bar", "crank-shaper", "law")
"""Those that the 30-digit references know; `linkage` is `four-bar` over again."""
