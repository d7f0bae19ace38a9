"""Machines at the edge of what is possible, and rotors in closed form."""

from __future__ import annotations

from collections.abc import Callable
from math import tau
from typing import Any, NamedTuple

from mpmath import mp  # type: ignore[import-untyped]

# One machine of every mechanism, each written in any units: a `Measure` turns SI numbers into those of other units.


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


# Rotors whose steady motion has a closed form, solved at 40 digits, beside the scenes that describe them.


DIGITS = 40  # of the answers; twice as many on the way
OWN = 2  # kg m²
LOAD = 100  # N m
QUARTER = "90 deg"


class Rotor(NamedTuple):
    """A steady motion: total inertia, greatest and least speed, and the balance."""

    inertia: Any
    fastest: Any
    slowest: Any
    balance: Any

    @property
    def irregularity(self) -> Any:
        """(greatest - least)/mean."""
        return 2 * (self.fastest - self.slowest) / (self.fastest + self.slowest)

    @property
    def speed(self) -> Any:
        """Mean of extremes."""
        return (self.fastest + self.slowest) / 2


def scene(drive: Any, wheel: dict[str, Any], load: Any = -LOAD, to: str = QUARTER, **more: Any) -> Scene:
    """A rotor of 2 kg m² with a load from 0 to an angle."""
    acting = [{"on": "crank", "torque": load, "from": 0, "to": to}]
    return {
        "inertia": [{"on": "crank", "value": OWN}],
        "load": acting,
        "drive": {"torque": drive},
        "regime": {},
        "flywheel": wheel,
    } | more


def turned(torque: Any, slope: Any, before: Any, after: Any) -> Any:
    """Radians in which I omega omega' = torque - slope omega takes the speed from one value to another, over I."""
    return ((before - after) + torque / slope * mp.log((torque - slope * before) / (torque - slope * after))) / slope


def solved(equations: Callable[..., Any], *guess: Any) -> Any:
    """The root of equations, near a guess."""
    return mp.findroot(equations, [mp.mpf(g) for g in guess], tol=mp.mpf(10) ** -DIGITS, maxsteps=80)


def on_a_line(torque: Any, slope: Any, speed: Any, *, inertia: Any = None, irregularity: Any = None) -> Rotor:
    """A drive torque - slope omega against the load, over the first quarter; from a guess of the speed."""
    with mp.workdps(2 * DIGITS):
        torque, slope, quarter = mp.mpf(torque), mp.mpf(slope), mp.pi / 2

        def closes(total: Any, fast: Any, slow: Any) -> list[Any]:
            loaded, free = turned(torque - LOAD, slope, fast, slow), turned(torque, slope, slow, fast)
            # what a weak slope tells is in the small difference of the two
            return [total * loaded / quarter - 1, total * (loaded - free / 3) / (quarter * slope)]

        if irregularity is None:
            total = mp.mpf(inertia)
            swing = LOAD * quarter * mp.mpf("0.75") / (total * speed)
            fast, slow = solved(lambda a, b: closes(total, a, b), speed + swing / 2, speed - swing / 2)
            return Rotor(total, fast, slow, None)
        eps = mp.mpf(irregularity)

        def request(total: Any, mean: Any) -> list[Any]:
            return closes(total, mean * (1 + eps / 2), mean * (1 - eps / 2))

        total, mean = solved(request, inertia, speed)
        return Rotor(total, mean * (1 + eps / 2), mean * (1 - eps / 2), None)


def damped(slope: Any, speed: Any, inertia: Any) -> Rotor:
    """A constant drive (the balance) and a damper that brings the speed to rest within an arc far below the load's."""
    with mp.workdps(DIGITS):
        # of one stretch's speed exp(-slope arc/(I w)) is left in the next: 1e-34 and less
        slope, speed = mp.mpf(slope), mp.mpf(speed)
        fast, slow = speed + LOAD / slope / 2, speed - LOAD / slope / 2
        return Rotor(mp.mpf(inertia), fast, slow, slope * fast)


def held(pull: Any, speed: Any, irregularity: Any) -> Rotor:
    """A constant drive (the balance) against a load pull/omega over half a turn: the faster, the less it resists."""
    with mp.workdps(DIGITS):
        eps, half = mp.mpf(irregularity), mp.pi
        fast, slow = speed * (1 + eps / 2), speed * (1 - eps / 2)

        def loaded(u: Any, w: Any) -> Any:
            return w**2 / (2 * u) + pull * w / u**2 + pull**2 / u**3 * mp.log(abs(u * w - pull))

        def ratio(u: Any) -> Any:  # the total inertia cancels: both halves are as long
            return (loaded(u, slow) - loaded(u, fast)) / ((fast**2 - slow**2) / (2 * u)) - 1

        high = pull / fast  # above it even the fastest point would speed up under load
        balance = mp.findroot(ratio, (high * mp.mpf("0.05"), high * mp.mpf("0.9999")), solver="anderson", verify=False)
        return Rotor(2 * balance * half / (fast**2 - slow**2), fast, slow, balance)
