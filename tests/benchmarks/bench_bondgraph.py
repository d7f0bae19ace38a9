"""Speed of deriving, reducing and simulating graphs: one run, ratios to a baseline of the same run.

    python tests/benchmarks/bench_bondgraph.py [--quick]

The baseline of a simulation is what an engineer would write for this one machine: the reduced equation by hand, in
scipy's solve_ivp at the same tolerance. Where the package BondGraphTools is installed, its equations are timed beside ours
on a graph that it accepts (constant ratios: it refuses a modulated transformer). Times are medians;
with --quick of two runs at most.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import sympy
from scipy.integrate import solve_ivp
from sympy.core.cache import clear_cache

from bondgraph import BondGraph, Builder, I, R, Reduction, Se, motion_equation, simulate, state_equations

sys.path.insert(0, str(Path(__file__).parents[2] / "examples" / "bond_graphs"))

import dc_motor
import rosenberg

QUICK = "--quick" in sys.argv
RADIUS, ROD = 0.2, 0.6
THETA = sympy.Symbol("theta")
TRAVEL = (
    -RADIUS * sympy.sin(THETA) * (1 + RADIUS * sympy.cos(THETA) / sympy.sqrt(ROD**2 - RADIUS**2 * sympy.sin(THETA) ** 2))
)


class Row(NamedTuple):
    """One measurement: its name, its median time (s), and its baseline."""

    name: str
    seconds: float
    baseline: float
    against: str


def median(call: Callable[[], Any], repeats: int = 7) -> float:
    """Median time of a call, s; SymPy's cache is emptied before each."""
    times = []
    for _ in range(min(repeats, 2) if QUICK else repeats):
        clear_cache()
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def fan(branches: int, ratio: Any, friction: float = 0.5) -> BondGraph:
    """A crank with inertia, source and resistor, and so many masses with resistors behind transformers."""
    b = Builder().one("crank", "rotation", displacement="theta").on("crank", I("J", 1.0), Se("M", 10.0), R("b", friction))
    for k in range(branches):
        b.one(f"v{k}", "translation").on(f"v{k}", I(f"m{k}", 3.0), R(f"B{k}", 0.5), Se(f"F{k}", -3.0))
        b.transform("crank", f"v{k}", ratio(k), name=f"T{k}")
    return b.build()


def modulated(k: int) -> Any:
    """The slider's ratio, its crank turned on for every further branch."""
    return TRAVEL.subs(THETA, THETA + k)


def by_hand(until: float, rtol: float) -> Any:
    """The reduced equation of the condensed slider-crank, as one would write it for this machine alone."""

    def rates(t: float, y: Any) -> list[float]:
        theta, omega = y
        sine, cosine = np.sin(theta), np.cos(theta)
        root = np.sqrt(ROD**2 - (RADIUS * sine) ** 2)
        ratio = -RADIUS * sine * (1 + RADIUS * cosine / root)
        slope = -RADIUS * cosine - RADIUS**2 * ((cosine**2 - sine**2) / root + (RADIUS * sine * cosine) ** 2 / root**3)
        moment = 10.0 - 0.5 * omega + ratio * (-3.0 - 0.5 * ratio * omega)
        return [omega, (moment - 3.0 * ratio * slope * omega**2) / (1.0 + 3.0 * ratio**2)]

    return solve_ivp(rates, (0.0, until), [0.0, 10.0], "DOP853", rtol=rtol, atol=rtol * 1e-3)


def audited(graph: BondGraph, until: float, **inputs: Any) -> float:
    """A simulation with its audit."""
    return simulate(graph, until, **inputs).audit.energy


def rows() -> Iterator[Row]:
    """Every measurement."""
    condensed, eight = fan(1, modulated), fan(8, modulated)
    aim = "aim"
    yield Row("state equations, condensed slider-crank", median(lambda: state_equations(condensed)), 0.3, aim)
    yield Row("state equations, eight MTF branches", median(lambda: state_equations(eight), 3), 2.0, aim)
    yield Row("I* phi'' + ½ I*' phi'² = M*, condensed", median(lambda: motion_equation(condensed)), 0.3, aim)
    yield Row("I* phi'' + ½ I*' phi'² = M*, eight branches", median(lambda: motion_equation(eight), 3), 2.0, aim)
    hand = median(lambda: by_hand(5.0, 1e-9))
    start = {"crank": 10.0}
    coasting, speeding = fan(1, modulated, friction=1.2), median(lambda: audited(condensed, 5.0, initial=start))
    yield Row(
        "5 s near 8 rad/s, rtol 1e-8, estimate, audit", median(lambda: audited(coasting, 5.0, initial=start)), 0.05, aim
    )
    yield Row("5 s, 10 to 18 rad/s, the same", speeding, 0.05, aim)
    yield Row("the same", speeding, hand, "reduced by hand, solve_ivp at 1e-9, once")
    expanded = rosenberg.machine()
    sweep = np.linspace(0.0, 2 * np.pi, 361)
    plain = Reduction(condensed, "crank")
    whole = expanded.reduction()
    yield Row(
        "I*, M* at 361 angles, expanded planar bodies",
        median(lambda: whole(sweep)),
        median(lambda: plain(sweep)),
        "condensed",
    )
    yield Row(
        "1 s of DC motor, shaft, gear, slider-crank",
        median(lambda: audited(dc_motor.build(), 1.0), 3),
        hand,
        "by hand, one state pair",
    )
    yield from _beside()


def _beside() -> Iterator[Row]:
    """Another package's equations, where it is installed."""
    try:
        import BondGraphTools as other
    except ImportError:
        print("BondGraphTools is not installed: left out")
        return
    for count in (1, 2):
        theirs = median(lambda count=count: _theirs(other, count).constitutive_relations, 3)
        ours = median(lambda count=count: state_equations(fan(count, lambda k: 0.5)), 3)
        yield Row(f"state equations, {count} constant ratios", ours, theirs, "BondGraphTools")
    equations = _modulated(other)
    kept = any("cos" in equation for equation in equations)
    print(f"BondGraphTools, ratio 0.2*sin(x): dT/dt is {'in' if kept else 'left out of'} its equations {equations}")


def _modulated(other: Any) -> list[str]:
    """Its equations of two inertias through T = 0.2 sin x, x of a spring beside the first; dT/dt = 0.2 cos(x) x'."""
    model, shaft = other.new(name="modulated"), other.new("1", name="shaft")
    near, far, spring = other.new("I", value=2.0), other.new("I", value=4.0), other.new("C", value=1.0)
    ratio = other.new("TF", name="T", value={"r": "0.2*sin(x_2)"})
    other.add(model, near, far, ratio, shaft, spring)
    for port in (near, spring, (ratio, 0)):
        other.connect(shaft, port)
    other.connect((ratio, 1), far)
    return [str(equation) for equation in model.constitutive_relations]


def _theirs(other: Any, count: int) -> Any:
    model, crank = other.new(name="fan"), other.new("1", name="crank")
    ports = [other.new("I", value=1.0), other.new("Se", value=10.0), other.new("R", value=0.5)]
    other.add(model, crank, *ports)
    for port in ports:
        other.connect(crank, port)
    for k in range(count):
        ratio, ram = other.new("TF", value=0.5, name=f"T{k}"), other.new("1", name=f"v{k}")
        hung = [other.new("I", value=3.0), other.new("R", value=0.5), other.new("Se", value=-3.0)]
        other.add(model, ratio, ram, *hung)
        other.connect(crank, (ratio, 0))
        other.connect((ratio, 1), ram)
        for port in hung:
            other.connect(ram, port)
    return model


def errors() -> str:
    """Differences of the two routes over the same 5 s, each state relative to its greatest value."""
    graph, start, hand = fan(1, modulated), {"crank": 10.0}, by_hand(5.0, 1e-9)
    truth = np.array(list(simulate(graph, 5.0, initial=start, rtol=1e-11).states(hand.t).values()))[::-1]  # theta, omega
    ours = simulate(graph, 5.0, initial=start)
    result = np.array(list(ours.states(hand.t).values()))[::-1]
    off = [(np.abs(way - truth).max(axis=1) / np.abs(truth).max(axis=1)).max() for way in (result, hand.y)]
    if not off[0] <= ours.error + 1e-11:
        sys.exit(f"the simulation is {off[0]:.1e} off, more than it tells: {ours.error:.1e}")
    return f"5 s, 10 to 18 rad/s: ours is {off[0]:.1e} off (estimate {ours.error:.1e}), the hand-written run {off[1]:.1e}"


def main() -> None:
    """Print the table, and what the times have bought."""
    print(f"{'':52s}{'time':>12s}{'ratio':>9s}  to")
    for row in rows():
        ratio, against = row.seconds / row.baseline, f"{row.against}: {1e3 * row.baseline:.3g} ms"
        print(f"{row.name:52s}{1e3 * row.seconds:9.2f} ms{ratio:9.3g}  {against}")
    print(errors())


if __name__ == "__main__":
    main()
