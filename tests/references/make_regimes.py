"""Write regimes.json: steady motions of the machines of tests/regimes.py, at 30 digits apart from the toolkit.

Run by hand, from the root of the project: `python -m tests.references.make_regimes [NAME ...]`; some ten minutes for all.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from mpmath import mp  # type: ignore[import-untyped]

from tests.regimes import CASES, STARTS, Case, Start, scene

from .electric import Electric
from .extrapolation import newton
from .figures import Cycle, wittenbauer
from .quantities import quantity
from .regimes import Motion, Regime, Turning

TARGET = Path(__file__).parent / "regimes.json"
DIGITS = 18


def written(motion: Motion, flywheel: Any, unknown: Any, ratio: Any) -> dict[str, Any]:
    """A steady motion as JSON holds it; the flywheel at its own shaft."""
    figures = {"inertia": flywheel / ratio**2, **motion._asdict()}
    figures |= {"balance": unknown, "speed_at_zero": mp.sqrt(2 * motion.start)}
    del figures["start"], figures["drive_work"]
    return {key: value if value is None else mp.nstr(value, DIGITS) for key, value in figures.items()}


def asked(case: Case, regime: Regime) -> Any:
    """The crank's speed where the unknown goes with it; None where the machine finds its own."""
    if case.unknown is None:
        return None
    wanted = case.scene["regime"]
    return quantity(wanted["speed"]) / regime.machine.shafts[wanted.get("on", "crank")]


def computed(name: str) -> dict[str, Any]:
    """All the motions of a case."""
    case, regime = CASES[name], Regime(scene(name, inertia=0))
    found: dict[str, Any] = {"analysis": {}, "sizing": {}}
    speed, ratio = asked(case, regime), regime.ratio
    swing, guess, balance = mp.zero, mp.mpf(case.speed), case.unknown
    for inertia in case.inertias:
        motion, wheel, balance = regime.steady(mp.mpf(repr(inertia)) * ratio**2, guess, speed=speed, unknown=balance)
        swing, guess = motion.irregularity * (wheel + regime.mean), mp.sqrt(2 * motion.start)
        found["analysis"][repr(inertia)] = written(motion, wheel, balance, ratio) | power(motion, regime)
        print(name, inertia, mp.nstr(motion.irregularity, 10), mp.nstr(motion.speed, 10), file=sys.stderr, flush=True)
    for eps in map(mp.mpf, map(repr, case.irregularities)):
        start = max(swing / eps - regime.mean, mp.mpf("0.05"))
        motion, wheel, balance = regime.sized(eps, start, guess, speed=speed, unknown=balance)
        swing, guess = eps * (wheel + regime.mean), mp.sqrt(2 * motion.start)
        found["sizing"][repr(float(eps))] = written(motion, wheel, balance, ratio) | power(motion, regime)
        print(name, float(eps), mp.nstr(wheel, 12), mp.nstr(motion.speed, 10), file=sys.stderr, flush=True)
    return found if regime.lossy else found | {"constant": constant_speed(name, guess)}


def constant_speed(name: str, guess: Any) -> dict[str, Any]:
    """What the contract takes at constant speed: the speed, the balance, the areas' extremes, the flywheels they give."""
    case, digits = CASES[name], mp.dps
    mp.dps = 45

    def cycle(speed: Any) -> Cycle:
        return Cycle(Turning(scene(name, inertia=0), speed=speed))

    speed = asked(case, Regime(scene(name, inertia=0)))
    if speed is None:
        speed = newton(lambda u: [cycle(u[0]).closure], [guess])[0]
    at = cycle(speed)
    works = [value for value, _ in at.values(mp.zero)]
    least, most = at.inertia_extremes()
    found = {
        "speed": speed, "balance": at.unknown if at.balanced else None,
        "accumulated_max": max(works), "accumulated_min": min(works),
        "work_exchanged": at.exchange, "drive_work": at.drive_work, "inertia_min": least, "inertia_max": most,
    }  # fmt: skip
    print(name, "constant", mp.nstr(speed, 12), file=sys.stderr, flush=True)
    frozen = {repr(eps): wittenbauer(at, speed, mp.mpf(repr(eps))) for eps in case.irregularities}
    mp.dps = digits
    return {key: value if value is None else mp.nstr(value, DIGITS) for key, value in found.items()} | {
        "frozen": {eps: mp.nstr(value, DIGITS) for eps, value in frozen.items()}
    }


def power(motion: Motion, regime: Regime) -> dict[str, Any]:
    """The drive's work in a cycle, and the power that the contract makes of it."""
    if "drive" not in regime.scene:
        return {"drive_work": None, "power": None}
    work = motion.drive_work if abs(motion.drive_work) > mp.mpf("1e-16") else mp.zero  # nothing but rounding
    return {"drive_work": mp.nstr(work, DIGITS), "power": mp.nstr(work * motion.speed / regime.machine.cycle, DIGITS)}


def electric(case: Case) -> dict[str, Any]:
    """Motions of the machine on a motor with inductance."""
    machine = Electric(scene("dc-inductance", inertia=0))
    given = {repr(j): machine.found(case.speed, inertia=mp.mpf(repr(j))) for j in case.inertias}
    near = next(iter(given.values()))["speed"]
    sized = {repr(e): machine.found(near, inertia=1.5, eps=mp.mpf(repr(e))) for e in case.irregularities}
    return {"analysis": {k: texts(v) for k, v in given.items()}, "sizing": {k: texts(v) for k, v in sized.items()}}


def texts(figures: dict[str, Any]) -> dict[str, Any]:
    """Numbers as decimal texts."""
    return {key: value if isinstance(value, list) else mp.nstr(value, DIGITS) for key, value in figures.items()}


def started(start: Start) -> list[dict[str, str]]:
    """Angle and speed from rest at the times of a start."""
    regime = Regime(scene(start.name, inertia=0))
    phi = mp.pi * mp.mpf(start.half_turns)
    found = regime.march(
        phi, 0, mp.mpf(start.inertia) * regime.ratio**2, [mp.mpf(repr(t)) for t in start.times], start.unknown
    )
    return [texts({"time": t, "phi": p, "omega": w}) for t, (p, w) in zip(start.times, found, strict=True)]


def main(wanted: list[str]) -> None:
    """Compute the named cases, or all, and write the file."""
    mp.dps = 30
    for name in wanted or [*CASES, *STARTS]:
        start = time.perf_counter()
        found = ELSE[name]() if name in ELSE else computed(name)
        known = json.loads(TARGET.read_text()) if TARGET.exists() else {}
        known[name] = found
        TARGET.write_text(json.dumps({n: known[n] for n in (*CASES, *STARTS) if n in known}, indent=1) + "\n")
        print(f"{name}: {time.perf_counter() - start:.0f} s", file=sys.stderr, flush=True)


ELSE: dict[str, Callable[[], Any]] = {"dc-inductance": lambda: electric(CASES["dc-inductance"])}
ELSE |= {name: partial(started, start) for name, start in STARTS.items()}

if __name__ == "__main__":
    main(sys.argv[1:])
