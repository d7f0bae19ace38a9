"""The steady regime by collocation beside running the transient until it settles: one run, figures as ratios.

    python tests/benchmarks/bench_regime.py [--quick]

Section C's machine and a press on an induction motor, each with light and heavy flywheels. Ways to run the transient, mostly
from the constant speed at which the net work is zero, which is kind to them, until the speed at phi = 0 repeats to 1e-9:

- the library's own time stepping, which starts afresh at every breakpoint: one run, and run again as `flywheel.simulate`
  does, until two runs tell its error; and one run from rest;
- solve_ivp (DOP853, rtol 1e-9) on equations written out by hand for this one machine, stopped at every breakpoint;
- the same in one go, and with solve_ivp's own defaults, as a script does it today.

Two ratios, like to like: to Newton's method on a mesh that is known (no error estimate; beside one run), and to
`flywheel.size` from a built machine (everything from the search for the speed to the error estimates; beside the run with
its estimate). Errors are against 30-digit references. Then the flywheel for an irregularity, beside a root search over
transients. A run that takes too long is broken off, and what it would have taken is reckoned from how fast it settles.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from math import ceil, log, nan, pi, radians, sin
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import flywheel

sys.path.insert(0, str(Path(__file__).parents[2]))

from flywheel.machine.dynamics import MachineDynamics, StartState
from flywheel.motions.simulation import motion_from
from flywheel.regime import periodic_motion
from flywheel.regime.cycle_equations import Demand, first_guess, periodic
from flywheel.regime.free_motion import Goal, follow
from tests import regimes
from tests.benchmarks.by_hand import SECTION_C, Sizes, reduced

RTOL, REPEATS = 1e-9, 1e-9  # of the steps; of the speed at phi = 0
TURN = 2 * pi
TARGET = 50  # times faster than the transient
CAREFUL = {"method": "DOP853", "rtol": RTOL, "atol": RTOL}
LONGEST = 20.0  # s that a transient may take
STALLS = "stalls on its way up"
Rates = Callable[[float, Any], list[float]]


# -- the machines by hand --------------------------------------------------------------------------------------------------


PRESS = Sizes(0.1, 0.5, 0.2, 10.0, 0.3, 50.0, 0.1 + 5 * 0.02**2 + 144 * 0.02, 5 * 0.02, 9.80665)


def section_c(inertia: float) -> Rates:
    """Section C's machine."""

    def rates(t: float, state: Any) -> list[float]:
        phi, omega = state
        own, slope, weight, _ = reduced(phi, SECTION_C)
        return [omega, (10 - 2.387 * omega + weight - 0.5 * slope * omega**2) / (own + inertia)]

    return rates


def press(inertia: float) -> Rates:
    """The press on an induction motor, 12 times as fast as its crank; the flywheel stands on the motor's shaft."""
    first, last = radians(300), radians(345)

    def rates(t: float, state: Any) -> list[float]:
        phi, omega = state
        own, slope, moment, x1 = reduced(phi, PRESS)
        slip = 1 - 12 * omega / (50 * pi)
        moment += 12 * 2 * 49.7 * 0.1916 * slip / (slip * slip + 0.1916**2)
        if first <= phi % TURN < last:
            moment -= 20e3 * x1
        return [omega, (moment - 0.5 * slope * omega**2) / (own + 144 * inertia)]

    return rates


class Case(NamedTuple):
    """A machine: title, its name among the reference cases, its equations by hand, angles at which they jump."""

    title: str
    name: str
    by_hand: Callable[[float], Rates]
    breaks: tuple[float, ...] = ()


C = Case("section C", "section-c", section_c)
KLOSS = Case("press on an induction motor", "kloss-press", press, (radians(300), radians(345)))


# -- the ways --------------------------------------------------------------------------------------------------------------


class Settled(NamedTuple):
    """A way's outcome: its time (s), cycles it took, irregularity and mean of extremes (rad/s), how it ended."""

    seconds: float
    cycles: int
    irregularity: float
    speed: float
    ended: str = ""


class Lap(NamedTuple):
    """A cycle that was run: its motion from its start to its end (s), and the speed at its end (rad/s)."""

    omega: Callable[[Any], Any]
    start: float
    end: float
    last: float


def run_until_settled(laps: Callable[[], Lap], start: float, longest: float) -> Settled:
    """Cycle after cycle until the speed at phi = 0 repeats; what is missing when time is up is reckoned."""
    begun, speeds = time.perf_counter(), [start]
    while True:
        lap = laps()
        speeds.append(lap.last)
        spent = time.perf_counter() - begun
        change = abs(speeds[-1] - speeds[-2])
        if change <= REPEATS * lap.last:
            return Settled(spent, len(speeds) - 1, *_extremes(lap))
        if spent > longest:
            return _reckoned(speeds, spent, lap)


def _reckoned(speeds: list[float], spent: float, lap: Lap) -> Settled:
    """Estimated cost of a run that was broken off; none where changes are few or do not fall steadily."""
    cycles, changes = len(speeds) - 1, np.abs(np.diff(speeds))
    tens = changes[cycles % 10 :].reshape(-1, 10).max(axis=1)[-5:]
    if tens.size < 5 or not (tens[1:] < 0.98 * tens[:-1]).all():
        return Settled(spent, cycles, *_extremes(lap), f"not yet: repeats to {changes[-1] / speeds[-1]:.0e}")
    rate = (tens[-1] / tens[0]) ** (1 / 40)
    whole = cycles + ceil(log(REPEATS * speeds[-1] / changes[-1]) / log(rate))
    return Settled(spent * whole / cycles, whole, *_extremes(lap), f"~ broken off at cycle {cycles}")


def _extremes(lap: Lap) -> tuple[float, float]:
    high, low = _greatest(lap, 1.0), -_greatest(lap, -1.0)
    return 2 * (high - low) / (high + low), 0.5 * (high + low)


def _greatest(lap: Lap, sign: float) -> float:
    """The greatest of sign times the speed over a cycle, looked for again and again about the greatest."""
    low, high = lap.start, lap.end
    for _ in range(6):
        times = np.linspace(low, high, 301)
        values = sign * lap.omega(times)
        best = int(values.argmax())
        low, high = times[max(best - 1, 0)], times[min(best + 1, 300)]
    return float(values.max())


def with_estimate(machine: flywheel.Machine, inertia: float, start: float) -> float:
    """Time (s) of the library's own stepping until it settles, with the runs that tell its error."""
    dynamics, before = MachineDynamics(machine, inertia * machine.scene.flywheel_ratio**2, 0.0), start

    def passing(t: float, omega: float) -> str | None:
        nonlocal before
        before, change = omega, abs(omega - before)
        return "settled" if change <= REPEATS * omega else None

    begun = time.perf_counter()
    motion_from(dynamics, StartState(0.0, start), np.inf, RTOL, (), passing)
    return time.perf_counter() - begun


def by_library(machine: flywheel.Machine, inertia: float, start: float, longest: float) -> Settled:
    """The library's own time stepping."""
    dynamics, speed = MachineDynamics(machine, inertia * machine.scene.flywheel_ratio**2, 0.0), start

    def lap() -> Lap:
        nonlocal speed
        stop = Goal("stop", lambda t, phi, omega: omega)
        trail = follow(dynamics, StartState(0.0, speed), np.inf, RTOL, [stop], lambda t, omega: "lap")
        if not trail.cycles:
            raise ArithmeticError(STALLS)
        speed = float(trail.ends()[1, -1])
        return Lap(lambda t: trail.states(np.asarray(t))[1], 0.0, float(trail.t[-1]), speed)

    try:
        return run_until_settled(lap, start, longest)
    except ArithmeticError:
        return Settled(nan, 0, nan, nan, STALLS)


def split_by_hand(case: Case, inertia: float, start: float, longest: float) -> Settled:
    """solve_ivp on equations by hand, stopped at every breakpoint; in each piece the law is that of its middle."""
    rates, ends, speed = case.by_hand(inertia), (0.0, *case.breaks, TURN), start

    def piece(low: float, high: float, omega: float) -> Any:
        tiny = 1e-12 * (high - low)

        def inside(t: float, state: Any) -> list[float]:
            return rates(t, (min(max(state[0], low + tiny), high - tiny), state[1]))

        def over(t: float, state: Any) -> float:
            return float(state[0] - high)

        over.terminal = True  # type: ignore[attr-defined]
        return solve_ivp(inside, (0, 100.0), [low, omega], "DOP853", events=over, rtol=RTOL, atol=RTOL, dense_output=True)

    def lap() -> Lap:
        nonlocal speed
        runs, at = [], [0.0]
        for low, high in pairwise(ends):
            runs.append(piece(low, high, speed))
            speed = float(runs[-1].y[1, -1])
            at.append(at[-1] + float(runs[-1].t[-1]))

        def omega(t: Any) -> Any:
            which = np.clip(np.searchsorted(at, t, side="right") - 1, 0, len(runs) - 1)
            return np.array([runs[k].sol(x - at[k])[1] for k, x in zip(which, t, strict=True)])

        return Lap(omega, 0.0, at[-1], speed)

    return run_until_settled(lap, start, longest)


def unsplit_by_hand(case: Case, inertia: float, start: float, longest: float, **inputs: Any) -> Settled:
    """solve_ivp on equations by hand in one go; a lap is looked at where phi passes a whole turn."""
    rates = case.by_hand(inertia)

    def passing(t: float, state: Any) -> float:
        return sin(0.5 * state[0])

    state, t = [0.0, start], 0.0
    waiting: list[Lap] = []

    def lap() -> Lap:
        nonlocal state, t
        if not waiting:
            run = solve_ivp(rates, (t, t + 20.5 * TURN / start), state, events=passing, dense_output=True, **inputs)
            passed = zip(run.t_events[0].tolist(), run.y_events[0].tolist(), strict=True)
            marks = [(a, b) for a, b in passed if a > t + 0.1 / start]
            edges = [t, *(a for a, _ in marks)]
            waiting.extend(
                Lap(partial(_speed, run.sol), a, b, y[1]) for (a, b), (_, y) in zip(pairwise(edges), marks, strict=True)
            )
            t, state = marks[-1]
        return waiting.pop(0)

    return run_until_settled(lap, start, longest)


def _speed(motion: Any, t: Any) -> Any:
    return motion(t)[1]


# -- the tables ------------------------------------------------------------------------------------------------------------


def timed(call: Callable[[], Any], repeats: int) -> float:
    """Median time, s."""
    times = []
    for _ in range(repeats):
        begun = time.perf_counter()
        call()
        times.append(time.perf_counter() - begun)
    return statistics.median(times)


class Ratios(NamedTuple):
    """Cost of the library's transient as ratios: one run to Newton alone, the run with its estimate to the sizing,
    one run from rest than the sizing (None where the machine stalls on its way).
    """

    alone: float
    whole: float
    from_rest: float | None


def compared(case: Case, label: str, inertia: float, figures: dict[str, str], quick: bool) -> Ratios:
    """Print one machine's rows."""
    machine = flywheel.Machine(flywheel.load(regimes.scene(case.name, inertia=inertia)))
    repeats, longest = (3, 0.03 * LONGEST) if quick else (25, LONGEST)
    sizing, start, solve = solved(machine, inertia)
    size, newton = timed(lambda: flywheel.size(machine, simulate=False), repeats), timed(solve, repeats)
    alone, eps = solve(), float(figures["irregularity"])
    print(f"\n{case.title}, {label}: flywheel {inertia:.6g} kg m², eps {eps:.6g}, multiplier {sizing.cyclic.multiplier:.4g}")
    print(f"  {'way':32}{'time':>12}{'/ Newton':>10}{'/ size':>9}{'cycles':>8}{'error eps':>11}{'error speed':>13}")
    stepped = by_library(machine, inertia, start, longest)
    risen = by_library(machine, inertia, 0.0, longest)
    long = bool(stepped.ended) or stepped.seconds > 0.2 * longest
    estimated = 2 * stepped.seconds if long else with_estimate(machine, inertia, start)
    rows = {
        f"Newton, {alone.steps} steps": Settled(newton, 0, alone.irregularity, alone.speed),
        "flywheel.size": Settled(size, 0, sizing.simulation.irregularity, sizing.speed),
        "library, split": stepped,
        "library, split, from rest": risen,
        "the same with its estimate": stepped._replace(seconds=estimated, ended="~ twice one run" if long else ""),
        "by hand, split": split_by_hand(case, inertia, start, longest),
        "by hand, in one go": unsplit_by_hand(case, inertia, start, 0.2 * longest, **CAREFUL),
        "by hand, in one go, defaults": unsplit_by_hand(case, inertia, start, 0.1 * longest),
    }
    for name, row in rows.items():
        misses = abs(row.irregularity / eps - 1), abs(row.speed / float(figures["speed"]) - 1)
        ratios = f"{row.seconds / newton:10.3g}{row.seconds / size:9.3g}"
        errors = f"{row.cycles or '':>8}{misses[0]:11.0e}{misses[1]:13.0e}"
        if row.cycles == 0 and max(misses) > RTOL:
            sys.exit(f"{name}: further than {RTOL} from 30 digits")
        print(f"  {name:32}{1e3 * row.seconds:9.2f} ms{ratios}{errors}  {row.ended}")
    return Ratios(stepped.seconds / newton, estimated / size, None if risen.ended == STALLS else risen.seconds / size)


def solved(machine: flywheel.Machine, inertia: float) -> tuple[Any, float, Callable[[], Any]]:
    """The analysis, the constant speed at which the net work is zero, and Newton's method from there on the final mesh."""
    sizing = flywheel.size(machine, simulate=False)
    start = sizing.cyclic.constant_speed
    request = Demand(inertia * machine.scene.flywheel_ratio**2, None, None)
    mesh = periodic_motion.own_motion(machine, start, request, 0.0, 0.0, sizing.rtol).solved.moments
    return sizing, start, lambda: periodic(mesh, start, request, first_guess(mesh, start, request.inertia, 0.0))


def sized(case: Case, eps: str, quick: bool) -> None:
    """Print the flywheel for an irregularity: ours, and a root search over transients by hand, split."""
    request, figures = float(eps), regimes.figures(case.name)["sizing"][eps]
    true, start = float(figures["inertia"]), float(regimes.figures(case.name)["constant"]["speed"])
    machine = flywheel.Machine(flywheel.load(regimes.scene(case.name, irregularity=request)))
    result = flywheel.size(machine, simulate=False).flywheel.exact
    ours = timed(lambda: flywheel.size(machine, simulate=False), 5 if quick else 25)
    runs, tolerance = 0, 1e-3 if quick else 1e-9

    def miss(inertia: float) -> float:
        nonlocal runs
        runs += 1
        return split_by_hand(case, inertia, start, LONGEST).irregularity - request

    begun = time.perf_counter()
    searched = brentq(miss, 0.8 * true, 1.2 * true, xtol=tolerance * true, rtol=tolerance)
    spent = time.perf_counter() - begun
    print(f"\n{case.title}, flywheel for eps = {eps}: {true:.12g} kg m²")
    print(f"  {'flywheel.size':34}{1e3 * ours:9.2f} ms{1:8}  error {abs(result / true - 1):.0e}")
    name = f"root search over {runs} transients"
    print(f"  {name:34}{1e3 * spent:9.2f} ms{spent / ours:8.3g}  error {abs(searched / true - 1):.0e}")


def main(quick: bool) -> None:
    """Print every table, and whether the target is met."""
    c, kloss = regimes.figures("section-c"), regimes.figures("kloss-press")
    result = []
    for inertia, label in (("0", "no flywheel"), ("5", "light"), ("500", "heavy")):
        result.append(compared(C, label, float(inertia), c["analysis"][inertia], quick))
    heavy = kloss["sizing"]["0.02"]
    result.append(compared(KLOSS, "light", 0.1, kloss["analysis"]["0.1"], quick))
    result.append(compared(KLOSS, "heavy", float(heavy["inertia"]), heavy, quick))
    sized(C, "0.1", quick)
    sized(KLOSS, "0.02" if quick else "0.1", quick)
    print(f"\nhow many times faster than the library's own transient (target {TARGET}):")
    names = (
        "Newton, beside one run",
        "flywheel.size, beside the run with its estimate",
        "flywheel.size, beside one run from rest",
    )
    for k, name in enumerate(names):
        ratios = [row[k] for row in result if row[k] is not None]
        verdict = "met by all" if min(ratios) >= TARGET else f"met by {sum(r >= TARGET for r in ratios)} of {len(ratios)}"
        print(f"  {name:50}{verdict:14}{', '.join(f'{ratio:.3g}' for ratio in ratios)}")


if __name__ == "__main__":
    main("--quick" in sys.argv)
