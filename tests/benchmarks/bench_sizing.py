"""Speed and accuracy of sizing, beside the methods in use today: one run, figures as ratios.

    python tests/benchmarks/bench_sizing.py [--quick]

For the scotch yoke of p.103 and a slider-crank press: our sizing from a built machine at rtol 1e-12 (error estimate
included), sizing on plain grids of 360 and 100 000 angles, and sizing by a root search on the inertia over time
simulations (solve_ivp, 1e-9). Then the whole command without simulation against a bare import of click and numpy.
Then one design of a sweep, of that press and of examples/machines/press.toml, and what windows and rows of tables add.
Errors are against 30-digit references; times are medians.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import flywheel

FOLDER = Path(__file__).parent.parent / "references"
SCENES = {"scotch yoke of p.103": "yoke-60rpm", "slider-crank press": "press"}


def true_inertia(name: str) -> float:
    """The exact flywheel of a reference scene at 30 digits, as a double."""
    references = json.loads((FOLDER / "references.json").read_text())
    return float(next(r for r in references if r["scene"] == f"{name}.toml")["flywheel"]["exact"])


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
    """Flywheel by a simple script: a plain grid, the trapezoidal rule, the greatest and least sample."""
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


def search(machine: flywheel.Machine, guess: float, rtol: float) -> float:
    """Flywheel by a simulation code: vary the inertia until a simulated cycle has the irregularity asked for."""
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
            rtol=rtol,
            atol=rtol,
            dense_output=True,
        )
        return run.sol(np.linspace(0.0, run.t[-1], 2_000))[1]

    def mean_error(start: float, inertia: float) -> float:
        omega = cycle(inertia, start)
        return float(omega.max() + omega.min()) / 2 - scene.speed

    def miss(inertia: float) -> float:
        start = brentq(mean_error, 0.9 * scene.speed, 1.1 * scene.speed, args=(inertia,), rtol=rtol)
        omega = cycle(inertia, start)
        return float((omega.max() - omega.min()) / scene.speed) - scene.irregularity

    return float(brentq(miss, 0.8 * guess, 1.2 * guess, rtol=rtol))


def compared(title: str, name: str, quick: bool) -> None:
    """Print one scene's rows, with times as ratios to ours."""
    machine = flywheel.Machine(flywheel.load(FOLDER / "scenes" / f"{name}.toml"))
    true = true_inertia(name)
    ours = timed(lambda: flywheel.size(machine, 1e-12, simulate=False).flywheel.exact, 50 if quick else 1000)
    estimate = flywheel.size(machine, 1e-12, simulate=False).error.exact
    rows = [Row("sizing, rtol 1e-12, with its estimate", *ours)]
    rows += [Row(f"grid of {n} angles", *timed(lambda n=n: grid(machine, n), 1 if quick else 5)) for n in (360, 100_000)]
    rtol = 1e-3 if quick else 1e-9
    rows.append(Row(f"root search over simulations, {rtol:.0e}", *timed(lambda: search(machine, true, rtol), 1)))
    print(f"\n{title}: exact flywheel {true:.12g} kg m², estimated error {estimate:.1e}")
    print(f"  {'method':38}{'time':>12}{'ratio':>10}{'true error':>12}")
    for row in rows:
        miss = abs(row.inertia / true - 1)
        print(f"  {row.name:38}{1e3 * row.seconds:9.3f} ms{row.seconds / ours[0]:10.3g}{miss:12.1e}")
    if not abs(ours[1] / true - 1) <= max(estimate, 2e-16):
        sys.exit("the flywheel is further off than its estimate")


def sweep(quick: bool) -> None:
    """Print the time of one design of a sweep: scene read, machine built, flywheel sized at the default rtol."""
    scenes = FOLDER / "scenes" / "press.toml", FOLDER.parent.parent / "examples" / "machines" / "press.toml"
    print("\none design of a sweep, from its scene to its flywheel (CPU time):")
    first = 0.0
    for path in scenes:
        mapping, count = tomllib.loads(path.read_text()), 20 if quick else 500
        flywheel.size(flywheel.load(mapping), simulate=False)
        times = []
        for k in range(count):
            mapping["mechanism"]["rod"]["length"] = 0.5 + 0.2 * k / count
            start = time.process_time()
            flywheel.size(flywheel.load(mapping), simulate=False)
            times.append(time.process_time() - start)
        each = statistics.median(times)
        first = first or each
        name, ratio = f"{path.parent.name}/{path.name}", each / first
        print(f"  {name}: {1e3 * each:.2f} ms, ratio {ratio:.2f}; 100 000: {each * 1e5 / 60:.1f} min")


def proportion(quick: bool) -> None:
    """Print what many windows of a force on a press's slider cost at the default level, and long tables, against few."""
    press = tomllib.loads((FOLDER / "scenes" / "press.toml").read_text())

    def windows(count: int) -> list[dict[str, object]]:
        width = 360 / count
        place = [{"from": f"{k * width} deg", "to": f"{(k + 0.6) * width} deg"} for k in range(count)]
        return [{"on": "slider", "force": f"{-1 - k % 3} kN"} | where for k, where in enumerate(place)]

    def rows(count: int) -> list[dict[str, object]]:
        angle = np.linspace(0.0, 2 * np.pi, count)
        return [{"on": "crank", "table": {"angle": angle.tolist(), "value": (-900 - 90 * np.sin(angle)).tolist()}}]

    counts = ((10, 30), (400, 4_000)) if quick else ((10, 30, 100, 300), (400, 4_000, 40_000))
    for what, loads, numbers, level in (("windows", windows, counts[0], "audit"), ("rows", rows, counts[1], "normal")):
        print(f"\n{what} (accuracy {level}, CPU time):")
        few = 0.0
        for number in numbers:
            scene = flywheel.load(press | {"load": loads(number)})
            start = time.process_time()
            flywheel.size(scene, accuracy=level)
            spent = time.process_time() - start
            few = few or spent
            print(f"  {number:6}: {1e3 * spent:6.0f} ms, ratio {spent / few:5.1f} for {number // numbers[0]} times as many")


def command(quick: bool) -> None:
    """Print the time of the whole command against a bare import, alternating."""
    scene = FOLDER / "scenes" / "yoke-60rpm.toml"
    ours = [sys.executable, "-m", "flywheel", "size", str(scene), "--no-simulate"]
    bare = [sys.executable, "-c", "import click, numpy"]
    pairs = [(whole(ours), whole(bare)) for _ in range(5 if quick else 25)][1:]  # the first one warms the caches
    ratio = statistics.median(a / b for a, b in pairs)
    a, b = (1e3 * statistics.median(column) for column in zip(*pairs, strict=True))
    print(f"\nflywheel size --no-simulate: {a:.0f} ms; bare import of click and numpy: {b:.0f} ms; ratio {ratio:.2f}")


def whole(arguments: list[str]) -> float:
    """Time of one process, byte code cached as it is wherever nobody forbids it."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    start = time.perf_counter()
    subprocess.run(arguments, check=True, stdout=subprocess.DEVNULL, env=environment)
    return time.perf_counter() - start


if __name__ == "__main__":
    hurry = "--quick" in sys.argv
    for scene_title, scene_name in SCENES.items():
        compared(scene_title, scene_name, hurry)
    sweep(hurry)
    proportion(hurry)
    command(hurry)
