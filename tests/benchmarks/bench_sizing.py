"""How fast and how accurate sizing is, beside the ways that people use today: one run, figures as ratios.

    python tests/benchmarks/bench_sizing.py [--quick]

For the scotch yoke of p.103 and a slider-crank press: our sizing from a built machine at rtol 1e-12 (error estimate
included), sizing on plain grids of 360 and 100 000 angles, and sizing by a root search on the inertia over time
simulations (solve_ivp, 1e-9). Then the whole command without simulation against a bare import of click and numpy.
Errors are against 30-digit references; times are medians.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import flywheel

YOKE = """
mechanism = {type = "scotch-yoke", crank.length = "0.5 m", yoke.mass = "20 kg"}
load = [{on = "yoke", force = "1000 N", from = 0, to = "180 deg"}]
drive.torque = "balance"
regime.speed = "60 rpm"
flywheel.irregularity = 0.04
"""
PRESS = """
load = [{on = "slider", force = "-20 kN", from = "300 deg", to = "345 deg"}]
drive.torque = "balance"
regime.speed = "120 rpm"
flywheel.irregularity = 0.05
[mechanism]
type = "slider-crank"
crank = {length = 0.1, mass = 5, inertia = 0.1}
rod = {length = 0.5, mass = 10, inertia = 0.3, com = 0.2}
slider.mass = 50
"""
# 30 digits, by mpmath: the same formulas, quad split at every breakpoint, extremes by root finding
TRUE = {"yoke": 353.521427322011960829, "press": None}


class Row(NamedTuple):
    """One way of sizing: its name, median time (s), and the inertia it gives (kg m²)."""

    name: str
    seconds: float
    inertia: float


def timed(call: Callable[[], float], repeats: int) -> tuple[float, float]:
    """Median time and result."""
    times, result = [], 0.0
    for _ in range(repeats):
        start = time.perf_counter()
        result = call()
        times.append(time.perf_counter() - start)
    return statistics.median(times), result


def grid(machine: flywheel.Machine, count: int) -> float:
    """What a script does: a plain grid, the trapezoidal rule, the greatest and least sample."""
    scene = machine.scene
    phi = np.linspace(0.0, scene.cycle, count + 1)
    reduced = machine.reduce(phi)
    moment, per_unknown = reduced.moment + 0 * phi, reduced.per_unknown + 0 * phi
    moment = moment - np.trapezoid(moment, phi) / np.trapezoid(per_unknown, phi) * per_unknown
    work = np.concatenate(([0.0], np.cumsum(0.5 * (moment[1:] + moment[:-1]) * np.diff(phi))))
    square, eps = scene.speed**2, scene.irregularity
    energy = 0.5 * square * (reduced.inertia + 0 * phi)
    fast, slow = (1 + eps / 2) ** 2, (1 - eps / 2) ** 2
    return float(((work - fast * energy).max() - (work - slow * energy).min()) / (eps * square))


def search(machine: flywheel.Machine, guess: float) -> float:
    """What a simulation code does: vary the inertia until a simulated cycle has the irregularity asked for."""
    scene = machine.scene
    balance = flywheel.size(machine, simulate=False).balance.value

    def rates(t: float, state: np.ndarray, inertia: float) -> list[float]:
        reduced = machine.reduce(state[0] % scene.cycle)
        moment = reduced.moment + balance * reduced.per_unknown
        return [state[1], (moment - 0.5 * reduced.slope * state[1] ** 2) / (inertia + reduced.inertia)]

    def cycle(inertia: float, start: float) -> np.ndarray:
        def over(t: float, state: np.ndarray, inertia: float) -> float:
            return state[0] - scene.cycle

        over.terminal = True
        longest = 4 * scene.cycle / scene.speed
        run = solve_ivp(
            rates,
            (0, longest),
            [0.0, start],
            method="DOP853",
            args=(inertia,),
            events=over,
            rtol=1e-9,
            atol=1e-9,
            dense_output=True,
        )
        return run.sol(np.linspace(0.0, run.t[-1], 2_000))[1]

    def mean_error(start: float, inertia: float) -> float:
        omega = cycle(inertia, start)
        return float(omega.max() + omega.min()) / 2 - scene.speed

    def miss(inertia: float) -> float:
        start = brentq(mean_error, 0.9 * scene.speed, 1.1 * scene.speed, args=(inertia,), rtol=1e-9)
        omega = cycle(inertia, start)
        return float((omega.max() - omega.min()) / scene.speed) - scene.irregularity

    return float(brentq(miss, 0.8 * guess, 1.2 * guess, rtol=1e-9))


def compared(name: str, text: str, quick: bool) -> None:
    """Print one scene's rows, with times as ratios to ours."""
    machine = flywheel.Machine(flywheel.load(text))
    ours = timed(lambda: flywheel.size(machine, 1e-12, simulate=False).flywheel.exact, 20 if quick else 400)
    error = flywheel.size(machine, 1e-12, simulate=False).error.exact
    rows = [Row("sizing, rtol 1e-12", *ours)]
    rows += [Row(f"grid of {n} angles", *timed(lambda n=n: grid(machine, n), 5)) for n in (360, 100_000)]
    rows.append(Row("root search over simulations, 1e-9", *timed(lambda: search(machine, ours[1]), 1)))
    true = TRUE[name] or ours[1]
    print(f"\n{name}: exact flywheel {ours[1]:.13g} kg m², estimated error {error:.1e}")
    print(f"  {'method':36}{'time':>12}{'ratio':>10}{'error':>11}")
    for row in rows:
        miss = abs(row.inertia / true - 1)
        print(f"  {row.name:36}{1e3 * row.seconds:9.3f} ms{row.seconds / ours[0]:10.3g}{miss:11.1e}")


def command(quick: bool) -> None:
    """Print the time of the whole command against a bare import, alternating."""
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "yoke.toml"
        scene.write_text(YOKE)
        ours = [sys.executable, "-m", "flywheel", "size", str(scene), "--no-simulate"]
        bare = [sys.executable, "-c", "import click, numpy"]
        pairs = [(whole(ours), whole(bare)) for _ in range(3 if quick else 15)]
    ratio = statistics.median(a / b for a, b in pairs)
    a, b = (1e3 * statistics.median(column) for column in zip(*pairs, strict=True))
    print(f"\nflywheel size --no-simulate: {a:.0f} ms; bare import click, numpy: {b:.0f} ms; ratio {ratio:.2f}")


def whole(arguments: list[str]) -> float:
    """Time of one process."""
    start = time.perf_counter()
    subprocess.run(arguments, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - start


if __name__ == "__main__":
    hurry = "--quick" in sys.argv
    compared("yoke", YOKE, hurry)
    compared("press", PRESS, hurry)
    command(hurry)
