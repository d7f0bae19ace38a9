"""Cost and accuracy of a motion in time at every rtol: one run, ratios to scripts by hand.

    python tests/benchmarks/bench_motion.py [--quick]

A DC motor with inductance brings a slider-crank up from rest, for a second: by `flywheel.simulate`, `flywheel.run_up` and
`bondgraph.simulate`. The truth is the same machine written by hand, at 1e-13. Beside them stand what an engineer would
write for this one machine, once and without an estimate: its equations in plain numbers, by scipy's solve_ivp and by the
fixed formula of order 4; ratios are to that formula in 1000 steps. CPU times, the
least of interleaved repeats. It fails where a true error is above its estimate or
an estimate above its rtol, and where rtol 1e-3 takes more than its share of what 1e-9 takes.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from math import cos, sin, sqrt
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import flywheel
from bondgraph import GY, Builder, I, R, Se, simulate

QUICK = "--quick" in sys.argv
RTOLS = (1e-3, 1e-4, 1e-6, 1e-9, 1e-11)
SHARE = 1 / 3  # of the time at 1e-9 that 1e-3 may take, with room for other load: the table says 1/5
CRANK, ROD, ON_CRANK, ROD_MASS, ROD_INERTIA, RAM, WHEEL = 0.05, 0.2, 0.002, 0.3, 0.001, 0.5, 0.01
VOLTAGE, RESISTANCE, CONSTANT, INDUCTANCE, HALF = 24.0, 0.5, 0.1, 0.002, 0.5
TIMES = np.linspace(0.0, 1.0, 1001)
SCENE = {
    "mechanism": {
        "type": "slider-crank",
        "crank": {"length": CRANK, "inertia": ON_CRANK},
        "rod": {"length": ROD, "mass": ROD_MASS, "inertia": ROD_INERTIA, "com": HALF * ROD},
        "slider": {"mass": RAM},
    },
    "drive": {
        "motor": {
            "type": "dc",
            "voltage": VOLTAGE,
            "resistance": RESISTANCE,
            "constant": CONSTANT,
            "inductance": INDUCTANCE,
        }
    },
    "flywheel": {"inertia": WHEEL},
}
States = tuple[float, ...]


def rates(t: float, state: Any) -> States:
    """The equations of this one machine, written by hand: of angle, speed and current."""
    phi, omega, current = state
    s, c = sin(phi), cos(phi)
    root = sqrt(ROD**2 - (CRANK * s) ** 2)
    turn = CRANK * c / root  # of the rod, for each radian
    bend = (CRANK * s * turn * turn - CRANK * s) / root
    ram, ram_slope = -CRANK * s * (1.0 + turn), -CRANK * (c + c * turn + s * bend)
    x, x_slope = -CRANK * s * (1.0 + HALF * turn), -CRANK * (c + HALF * (c * turn + s * bend))
    y, y_slope = (1.0 - HALF) * CRANK * c, -(1.0 - HALF) * CRANK * s
    inertia = WHEEL + ON_CRANK + ROD_MASS * (x * x + y * y) + ROD_INERTIA * turn * turn + RAM * ram * ram
    half_slope = ROD_MASS * (x * x_slope + y * y_slope) + ROD_INERTIA * turn * bend + RAM * ram * ram_slope
    acceleration = (CONSTANT * current - half_slope * omega * omega) / inertia
    return omega, acceleration, (VOLTAGE - RESISTANCE * current - CONSTANT * omega) / INDUCTANCE


def fixed_formula(steps: int) -> States:
    """The classical formula of order 4 with equal steps, in plain numbers."""
    state: States = (0.0, 0.0, 0.0)
    h = 1.0 / steps
    for _ in range(steps):
        a = rates(0.0, state)
        b = rates(0.0, [y + 0.5 * h * k for y, k in zip(state, a, strict=True)])
        c = rates(0.0, [y + 0.5 * h * k for y, k in zip(state, b, strict=True)])
        d = rates(0.0, [y + h * k for y, k in zip(state, c, strict=True)])
        state = tuple(y + h / 6 * (p + 2 * q + 2 * r + s) for y, p, q, r, s in zip(state, a, b, c, d, strict=True))
    return state


def graph() -> Any:
    """The same machine as a bond graph of its own: the rod's two coordinates by modulated transformers."""

    def root(phi: Any) -> Any:
        return np.sqrt(ROD**2 - (CRANK * np.sin(phi)) ** 2)

    ways = {
        "ram": (RAM, lambda phi: -CRANK * np.sin(phi) * (1.0 + CRANK * np.cos(phi) / root(phi))),
        "x": (ROD_MASS, lambda phi: -CRANK * np.sin(phi) * (1.0 + HALF * CRANK * np.cos(phi) / root(phi))),
        "y": (ROD_MASS, lambda phi: (1.0 - HALF) * CRANK * np.cos(phi)),
        "rod": (ROD_INERTIA, lambda phi: CRANK * np.cos(phi) / root(phi)),
    }
    b = Builder().one("armature", "electric").one("crank", "rotation", displacement="phi")
    b.on("armature", Se("voltage", VOLTAGE), R("resistance", RESISTANCE), I("inductance", INDUCTANCE))
    b.add(GY("constant", CONSTANT))
    b.bond("armature", "constant").bond("constant", "crank")
    b.on("crank", I("wheel", WHEEL + ON_CRANK))
    for name, (inertia, ratio) in ways.items():
        b.one(name, "rotation" if name == "rod" else "translation").on(name, I(f"of {name}", inertia))
        b.transform("crank", name, ratio, name=f"to {name}")
    return b.build()


def off(result: Any, truth: Any) -> float:
    """The greatest difference of rows of states, each relative to its greatest value."""
    return float((np.abs(np.asarray(result) - truth).max(axis=1) / np.abs(truth).max(axis=1)).max())


def ways(truth: Any) -> dict[str, Callable[[float], tuple[Callable[[], Any], Callable[[Any], tuple[float, float]]]]]:
    """Every way through the motion: for an rtol the call, and what tells its true error and its estimate."""
    machine, whole = flywheel.Machine(flywheel.load(SCENE)), graph()

    def of_machine(call: Callable[[float], Any], motion: Callable[[Any], Any]) -> Any:
        return lambda rtol: (
            lambda: call(rtol),
            lambda result: (off(motion(result).at(TIMES), truth[:2]), motion(result).error),
        )

    def states(result: Any) -> Any:
        return [result.displacement("phi", TIMES), result.flow("crank", TIMES), result.flow("armature", TIMES)]

    return {
        "flywheel.simulate": of_machine(lambda rtol: flywheel.simulate(machine, 0.0, 0.0, 1.0, rtol=rtol), lambda it: it),
        "flywheel.run_up": of_machine(lambda rtol: flywheel.run_up(machine, "1 s", rtol=rtol), lambda it: it.motion),
        "bondgraph.simulate": lambda rtol: (
            lambda: simulate(whole, 1.0, rtol=rtol),
            lambda result: (off(states(result), truth), result.error),
        ),
    }


def scripts(truth: Any) -> dict[str, tuple[Callable[[], Any], Callable[[Any], float]]]:
    """Scripts for comparison: the call, and the function that gives its true error at the end."""

    def at_end(state: Any) -> float:
        return off(np.array(state)[:, None], truth[:, -1:])

    def by_scipy(method: str, rtol: float) -> Any:
        return lambda: solve_ivp(rates, (0.0, 1.0), [0.0] * 3, method, rtol=rtol, atol=1e-2 * rtol)

    result: dict[str, Any] = {}
    for method, rtol in (("RK45", 1e-3), ("RK45", 1e-6), ("DOP853", 1e-9)):
        result[f"by hand, solve_ivp {method} {rtol:.0e}"] = by_scipy(method, rtol), lambda it: at_end(it.y[:, -1])
    for steps in (250, 1000):
        result[f"by hand, order 4, {steps} steps"] = (lambda steps=steps: fixed_formula(steps)), at_end
    return result


def main() -> None:
    """Print the table; fail where an error is not kept, or a loose rtol does not pay."""
    reference = solve_ivp(rates, (0.0, 1.0), [0.0] * 3, "DOP853", rtol=1e-13, atol=1e-14, dense_output=True)
    truth = reference.sol(TIMES)
    calls: dict[tuple[str, float], tuple[Callable[[], Any], Callable[[Any], Any]]] = {}
    for name, way in ways(truth).items():
        calls |= {(name, rtol): way(rtol) for rtol in RTOLS}
    for name, (call, error) in scripts(truth).items():
        calls[name, 0.0] = call, lambda result, error=error: (error(result), None)
    least: dict[tuple[str, float], float] = {}
    last: dict[tuple[str, float], Any] = {}
    for _ in range(2 if QUICK else 7):
        for key, (call, _) in calls.items():
            start = time.process_time()
            last[key] = call()
            least[key] = min(least.get(key, np.inf), time.process_time() - start)
    baseline = least["by hand, order 4, 1000 steps", 0.0]
    print(f"{'':36s}{'rtol':>7s}{'true error':>12s}{'estimate':>10s}{'time':>11s}{'ratio':>8s}")
    faults = []
    for (name, rtol), (_, errors) in calls.items():
        true, text = errors(last[name, rtol])
        request, estimate = (f"{rtol:.0e}", f"{text:.1e}") if text is not None else ("", "none")
        seconds = least[name, rtol]
        print(f"{name:36s}{request:>7s}{true:12.1e}{estimate:>10s}{1e3 * seconds:8.1f} ms{seconds / baseline:8.2f}")
        if text is not None and not (true <= text + 2e-12 and text <= rtol):
            faults.append(f"{name} at rtol {rtol:.0e}: true error {true:.1e}, estimate {text:.1e}")
    for name in ways(truth):
        share = least[name, 1e-3] / least[name, 1e-9]
        print(f"{name}: rtol 1e-3 takes {share:.2f} of the time of 1e-9, 1e-6 {least[name, 1e-6] / least[name, 1e-9]:.2f}")
        if share > SHARE and not QUICK:  # one repeat of each tells no ratio
            faults.append(f"{name}: rtol 1e-3 takes {share:.2f} of the time of 1e-9, more than {SHARE:.2f}")
    if faults:
        sys.exit("\n".join(faults))


if __name__ == "__main__":
    main()
