"""Speed and accuracy of linkages: 3600 positions of a two-loop linkage with g and g', beside other ways.

    python tests/benchmarks/bench_linkage.py [--quick]

The linkage is a six-bar of Watt, its second dyad on the rocker's end. Ratios are to our closed-form slider-crank
(positions, g and g') in the same run; errors are against 30-digit positions by intersecting circles. The planar-linkage
packages `pylinkage` and `mechanism` join in where they are installed: both give the same 3600 positions, `mechanism` by
fsolve, `pylinkage` one by one or compiled by numba, then with velocities and accelerations too. Times are medians.
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from itertools import count
from math import tau
from pathlib import Path
from typing import Any, NamedTuple

import mpmath as mp
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from flywheel.mechanisms.families import build
from flywheel.mechanisms.linkages.positions import solve
from flywheel.scene.linkage import FRAME, Linkage
from flywheel.scene.scene import Mechanism
from tests.linkages.linkages import bar, dyad, ground, pin

COUNT = 3600
D, G = (0.4, 0.0), (0.75, 0.05)
LENGTHS = {"crank": 0.1, "coupler": 0.35, "rocker": 0.3, "link": 0.5, "output": 0.3}
Q = np.linspace(0.0, tau, COUNT)


class Row(NamedTuple):
    """One way: its name, median time (s), and its greatest error of the output's angle (rad)."""

    name: str
    seconds: float
    error: float


def six_bar() -> Linkage:
    """Watt's six-bar with the second dyad on the rocker's end."""
    guesses = {"coupler": 0.9, "rocker": 1.9, "link": -0.3, "output": 1.5}
    links = tuple(bar(name, length, guesses.get(name)) for name, length in LENGTHS.items())
    crank, coupler, rocker, link, output = (item.point("E") for item in links)
    frame = ground(D=D, G=G)
    joints = (
        pin("O", FRAME, "crank"),
        pin("A", "crank", "coupler", crank),
        pin("B", "coupler", "rocker", coupler, rocker),
        pin("D", FRAME, "rocker", frame.point("D")),
        pin("F", "rocker", "link", rocker),
        pin("H", "link", "output", link, output),
        pin("G", FRAME, "output", frame.point("G")),
    )
    return Linkage(frame, links, joints, "O")


def unrounded(phi: Any) -> Any:
    """The output's angle with mpmath's numbers."""
    a = mp.mpf(LENGTHS["crank"]) * mp.expj(phi)
    b = dyad(a, mp.mpc(*D), mp.mpf(LENGTHS["coupler"]), mp.mpf(LENGTHS["rocker"]), 1)
    h = dyad(b, mp.mpc(*G), mp.mpf(LENGTHS["link"]), mp.mpf(LENGTHS["output"]), 1)
    return mp.arg(h - mp.mpc(*G))


def reference(phi: float) -> float:
    """The output's angle at 30 digits."""
    with mp.workdps(30):
        return float(unrounded(phi))


def timed(call: Callable[[], Any], repeats: int) -> tuple[float, Any]:
    """Median time and result."""
    times, result = [], None
    for _ in range(repeats):
        start = time.perf_counter()
        result = call()
        times.append(time.perf_counter() - start)
    return statistics.median(times), result


def ours(repeats: int) -> list[Row]:
    """Following the linkage, and its 3600 positions with g and g'."""
    linkage = six_bar()
    fresh = (replace(linkage, path=f"mechanism[{k}]") for k in count())  # a linkage of its own each time: none is kept
    following, solution = timed(lambda: solve(next(fresh), 0.0, tau), max(repeats // 3, 1))
    seconds, poses = timed(lambda: solution.poses(Q), repeats)
    error = error_of(poses.angle("output").value)
    track, square = poses.angle("output"), LENGTHS["output"] ** 2
    return [
        Row("ours: assemblies and certified continuation", following, np.nan),
        Row("ours: 3600 positions, g and g'", seconds, error),
        Row("ours: both", following + seconds, error),
        Row("  our g, relative error", np.nan, rate_error(1, track.rate[1:] * square)),
        Row("  our g', relative error", np.nan, rate_error(2, track.slope[1:] * square)),
    ]


def error_of(angles: Any) -> float:
    """Greatest error of the output's angle at every hundredth position."""
    result = np.asarray(angles)[::100]
    true = np.array([reference(q) for q in Q[::100]])
    return float(np.abs(np.angle(np.exp(1j * (result - true)))).max())


def closed_form(repeats: int) -> Row:
    """The slider-crank's formulas with their two derivatives."""
    geometry = {"crank.length": 0.1, "rod.length": 0.3, "slider.offset": 0.0}
    position = build(Mechanism("slider-crank", "press", geometry=geometry)).position

    def run() -> None:
        p = position(Q, np)
        _ = p.slider, p.slider_rate, p.slider_slope, p.rod, p.rod_rate, p.rod_slope

    return Row("closed-form slider-crank", timed(run, repeats)[0], np.nan)


def pylinkage_rows(repeats: int) -> list[Row]:
    """The package pylinkage: positions from circle to circle, its compiled calls, and their first call, which compiles.

    It gives velocities and accelerations of the pins at a crank's speed of 1 rad/s: the output's g and g' follow from them.
    """
    from pylinkage import Crank, Ground, RRRDyad
    from pylinkage.simulation import Linkage as Steps

    o, d, g = Ground(0.0, 0.0), Ground(*D), Ground(*G)

    def six_bar_of_theirs() -> Any:
        crank = Crank(anchor=o, radius=LENGTHS["crank"], angular_velocity=tau / (COUNT - 1), initial_angle=0.0)
        a = LENGTHS["crank"] + 0j
        b = dyad(a, complex(*D), LENGTHS["coupler"], LENGTHS["rocker"], 1)
        h = dyad(b, complex(*G), LENGTHS["link"], LENGTHS["output"], 1)
        first = RRRDyad(crank.output, d, LENGTHS["coupler"], LENGTHS["rocker"], float(b.real), float(b.imag))
        second = RRRDyad(first, g, LENGTHS["link"], LENGTHS["output"], float(h.real), float(h.imag))
        steps = Steps([o, d, g, crank, first, second])
        steps.set_input_velocity(crank, 1.0)
        return steps

    def fresh(call: str) -> Any:
        return getattr(six_bar_of_theirs(), call)(iterations=COUNT - 1)

    def angles(places: Any) -> Any:
        ends = np.asarray(places, dtype=float) - G
        return np.concatenate(([reference(0.0)], np.arctan2(ends[:, 1], ends[:, 0])))

    seconds, places = timed(lambda: list(six_bar_of_theirs().step(iterations=COUNT - 1)), 3)
    rows = [Row("pylinkage: positions", seconds, error_of(angles([coords[-1] for coords in places])))]
    for call, what in (("step_fast", "positions"), ("step_fast_with_kinematics", "positions, velocities, accelerations")):
        compiled, _ = timed(lambda call=call: fresh(call), 1)
        seconds, result = timed(lambda call=call: fresh(call), repeats)
        track = result[0] if isinstance(result, tuple) else result
        rows.append(Row(f"pylinkage {call}, first call", compiled, np.nan))
        rows.append(Row(f"pylinkage {call}: {what}", seconds, error_of(angles(track[:, -1]))))
        if isinstance(result, tuple):
            arm = (np.asarray(result[0])[:, -1] - G) @ [1.0, 1j]
            rows += [
                Row(
                    f"  its {name}, relative error",
                    np.nan,
                    rate_error(order, (arm.conjugate() * (part[:, -1] @ [1.0, 1j])).imag),
                )
                for order, name, part in ((1, "g", result[1]), (2, "g'", result[2]))
            ]
    return rows


def rate_error(order: int, turned: Any) -> float:
    """Greatest error of the output's g or g' at every hundredth position but the first, against its largest value.

    turned: arm x velocity or arm x acceleration of the output's end, m²: the arm's length squared times g or g'.
    """
    with mp.workdps(30):
        true = np.array([float(mp.diff(unrounded, mp.mpf(q), order)) for q in Q[100::100]])
    result = np.asarray(turned)[99::100] / LENGTHS["output"] ** 2
    return float(np.abs(result[: true.size] - true).max() / np.abs(true).max())


def mechanism_rows(_: int) -> list[Row]:
    """The same positions by the package mechanism: fsolve at every one."""
    from mechanism import Mechanism as Solver
    from mechanism import Vector, get_joints

    o, a, b, d, h, g = get_joints("O A B D H G")
    crank = Vector((o, a), r=LENGTHS["crank"])
    coupler, rocker = Vector((a, b), r=LENGTHS["coupler"]), Vector((d, b), r=LENGTHS["rocker"])
    link, output = Vector((b, h), r=LENGTHS["link"]), Vector((g, h), r=LENGTHS["output"])
    base = Vector((o, d), r=D[0], theta=0.0, style="ground")
    far = Vector((o, g), r=float(np.hypot(*G)), theta=float(np.arctan2(G[1], G[0])), style="ground")

    def loops(x: Any, i: Any) -> Any:
        gaps = np.zeros((2, 2))
        gaps[0] = crank(i) + coupler(x[0]) - rocker(x[1]) - base()
        gaps[1] = crank(i) + coupler(x[0]) + link(x[2]) - output(x[3]) - far()
        return gaps.flatten()

    z = solve(six_bar(), 0.0, tau).poses(0.0).value[2:, 2, 0]
    vectors = (crank, coupler, rocker, link, output, base, far)
    solver = Solver(vectors=vectors, origin=o, loops=loops, pos=Q, guess=(z,))
    seconds, _ = timed(solver.iterate, 1)
    return [Row("mechanism: positions (fsolve)", seconds, error_of(output.pos.thetas))]


def others(repeats: int) -> list[Row]:
    """Rows of the packages that are there."""
    rows: list[Row] = []
    for make in (pylinkage_rows, mechanism_rows):
        try:
            rows += make(repeats)
        except ImportError as error:
            print(f"left out: {error}")
    return rows


def main() -> None:
    """Measure and print."""
    repeats = 5 if "--quick" in sys.argv else 25
    base = closed_form(repeats)
    print(f"{'way':66s} {'ms':>9s} {'ratio':>8s} {'error, rad':>11s}")
    for row in [base, *ours(repeats), *others(repeats)]:
        print(f"{row.name:66s} {1e3 * row.seconds:9.2f} {row.seconds / base.seconds:8.1f} {row.error:11.1e}")
        if row.name.startswith("ours") and row.error > 1e-13:
            sys.exit("these positions are not those at 30 digits")


if __name__ == "__main__":
    main()
