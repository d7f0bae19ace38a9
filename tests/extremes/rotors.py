"""Rotors whose steady motion has a closed form, solved at 40 digits, beside the scenes that describe them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from mpmath import mp  # type: ignore[import-untyped]

from .machines import Scene

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

        def asked(total: Any, mean: Any) -> list[Any]:
            return closes(total, mean * (1 + eps / 2), mean * (1 - eps / 2))

        total, mean = solved(asked, inertia, speed)
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
