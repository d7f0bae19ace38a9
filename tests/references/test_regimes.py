"""The reference figures of speed-dependent machines hold by a second route: DOP853 on equations written by hand."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from math import cos, exp, pi, sin, sqrt
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

from tests import regimes

Rate = Callable[[float, float], float]


def slider(phi: float, r: float, l: float, e: float = 0.0) -> tuple[float, float, float, float]:  # noqa: E741
    """x'(phi), x''(phi) of the slider, rod's angle' and angle''."""
    s, c = sin(phi), cos(phi)
    run = sqrt(l * l - (r * s - e) ** 2)
    spin = -r * c / run
    dspin = r * s / run + r * c * (-(r * s - e) * r * c / run) / run**2
    x1 = -r * s - (r * s - e) * r * c / run
    x2 = -r * c - ((r * c) ** 2 - (r * s - e) * r * s) / run - ((r * s - e) * r * c) ** 2 / run**3
    return x1, x2, spin, dspin


def machine(phi: float, sizes: dict[str, float]) -> tuple[float, float, float, float]:
    """I*, its slope, the weights' moment over g (weights along -y), the slider's x'."""
    r, l, a = sizes["r"], sizes["l"], sizes["com"]  # noqa: E741
    x1, x2, spin, dspin = slider(phi, r, l)
    share = a / l
    gx1, gx2 = (1 - share) * -r * sin(phi) + share * x1, (1 - share) * -r * cos(phi) + share * x2
    gy1, gy2 = (1 - share) * r * cos(phi), -(1 - share) * r * sin(phi)
    m, j, slide = sizes["m"], sizes["j"], sizes["slider"]
    inertia = sizes["crank"] + m * (gx1**2 + gy1**2) + j * spin**2 + slide * x1**2
    slope = 2 * (m * (gx1 * gx2 + gy1 * gy2) + j * spin * dspin + slide * x1 * x2)
    weight = -m * gy1 - sizes.get("crank mass", 0.0) * sizes.get("crank com", 0.0) * cos(phi)
    return inertia, slope, weight, x1


C_SIZES = {"r": 0.2, "l": 0.6, "com": 0.3, "m": 6.0, "j": 3.0, "slider": 6.0, "crank": 1.0}
PRESS = {"r": 0.1, "l": 0.5, "com": 0.2, "m": 10.0, "j": 0.3, "slider": 50.0}
PRESS |= {"crank": 0.1 + 5 * 0.02**2, "crank mass": 5.0, "crank com": 0.02}


def section_c(flywheel: float) -> Rate:
    def rate(phi: float, omega: float) -> float:
        inertia, slope, weight, _ = machine(phi, C_SIZES)
        return (10 - 2.387 * omega + 9.81 * weight - slope * omega**2 / 2) / (inertia + flywheel)

    return rate


def kloss(flywheel: float) -> Rate:
    def rate(phi: float, omega: float) -> float:
        inertia, slope, weight, x1 = machine(phi, PRESS)
        s = 1 - 12 * omega / (50 * pi)
        moment = 12 * 2 * 49.7 * 0.1916 * s / (s * s + 0.1916**2) + 9.80665 * weight
        if 300 <= np.degrees(phi) % 360 < 345:
            moment -= 20e3 * x1
        return (moment - slope * omega**2 / 2) / (inertia + 144 * (flywheel + 0.02))

    return rate


def run(rate: Rate, start: float, omega: float, end: float, breaks: tuple[float, ...] = ()) -> Any:
    """The speed along phi, and the time, stopping at every break; the last state."""
    at, state = start, np.array([omega, 0.0])
    for stop in [*sorted(b for b in breaks if start < b < end), end]:
        tiny = 1e-12 * (stop - at)

        def field(phi: float, s: Any, lo: float = at, hi: float = stop, t: float = tiny) -> list[float]:
            inside = min(max(phi, lo + t), hi - t)
            return [rate(inside, s[0]) / s[0], 1 / s[0]]

        state = solve_ivp(field, (at, stop), state, method="DOP853", rtol=2e-13, atol=1e-14).y[:, -1]
        at = stop
    return state


def yoke(flywheel: float) -> Rate:
    def rate(phi: float, omega: float) -> float:
        gain, dgain = -0.3 * sin(phi), -0.3 * cos(phi)
        moment = 160 - 12 * omega - 150 * gain**2 * omega
        if gain < 0:
            moment += gain * (-200 + 30 * (gain * omega) ** 2)
        inertia = flywheel + 0.5 + 2 * 0.09 + 20 * gain**2
        return (moment - 20 * gain * dgain * omega**2) / inertia

    return rate


def constant_drive(flywheel: float) -> Rate:
    sizes = {"r": 0.15, "l": 0.4, "com": 0.15, "m": 5.0, "j": 0.1, "slider": 10.0, "crank": 0.3}

    def rate(phi: float, omega: float) -> float:
        inertia, slope, _, x1 = machine(phi, sizes)
        return (40 - (300 * x1**2 + 0.5) * omega - slope * omega**2 / 2) / (inertia + flywheel)

    return rate


def law(flywheel: float) -> Rate:
    def rate(phi: float, omega: float) -> float:
        ram, dram = -0.05 * sin(phi) - 0.024 * sin(2 * phi), -0.05 * cos(phi) - 0.048 * cos(2 * phi)
        swing, dswing = 0.4 * cos(phi) + 0.15 * cos(3 * phi), -0.4 * sin(phi) - 0.45 * sin(3 * phi)
        moment = 70 - 2 * omega - 0.05 * omega**2 - 0.2 * omega**2 * swing - 20 * abs(swing)
        moment -= 500 * ram if ram > 0 else 0.0
        inertia = flywheel + 0.4 + 30 * ram**2 + 1.5 * swing**2
        return (moment - (30 * ram * dram + 1.5 * swing * dswing) * omega**2) / inertia

    return rate


def rotor(inertia: float, window: tuple[float, float, float], moment: Callable[[float], float], ratio: float = 1) -> Any:
    """A rotor with a constant torque in a window (deg, deg, N m) and a moment of its speed."""
    begin, end, torque = window

    def law(flywheel: float) -> Rate:
        def rate(phi: float, omega: float) -> float:
            inside = begin <= np.degrees(phi) % 360 < end
            return (moment(omega) - (torque if inside else 0.0)) / (inertia + ratio**2 * flywheel)

        return rate

    return law


def kloss_moment(omega: float) -> float:
    s = 1 - 12 * omega / (50 * pi)
    return 12 * 2 * 49.7 * 0.1916 * s / (s * s + 0.1916**2) - 300


def twice(*degrees: float) -> tuple[float, ...]:
    """Angles of two turns."""
    return (*degrees, *(d + 360 for d in degrees))


# swing' = cos phi (0.4 - 0.45 + 0.6 cos² phi) is 0 also at cos² phi = 1/12
SWING = [np.degrees(np.arccos(x)) for x in (0.0, sqrt(1 / 12), -sqrt(1 / 12))]
RAM = np.degrees(np.arccos(-0.05 / 0.096))
MACHINES = [
    ("section-c", section_c, ()),
    ("kloss-press", kloss, twice(300, 345)),
    ("yoke", yoke, twice(0, 180)),
    ("constant-drive", constant_drive, ()),
    ("law", law, twice(0, 180, RAM, 360 - RAM, *SWING, *(360 - x for x in SWING))),
    ("governor", rotor(64 * 0.05, (60, 140, 900), lambda w: 8 * min(40, max(0, 4 * (110 - 8 * w))), 8), twice(60, 140)),
    ("unstable", rotor(1, (30, 120, 30), lambda w: 2 * w - 30), twice(30, 120)),
    ("two-speeds-fast", rotor(144 * 0.05, (90, 180, 400), kloss_moment, 12), twice(90, 180)),
    ("two-speeds-slow", rotor(144 * 0.05, (90, 180, 400), kloss_moment, 12), twice(90, 180)),
    ("peaks", rotor(0, (90, 135, 100), lambda w: 20 - w), twice(90, 135)),
]
ASKED = [(m, kind, key) for m in MACHINES for kind in ("analysis", "sizing") for key in regimes.figures(m[0])[kind]]


@pytest.mark.parametrize(("case", "kind", "key"), ASKED)
def test_a_cycle_from_the_greatest_speed_returns_by_the_least(case: Any, kind: str, key: str) -> None:
    name, law, degrees = case
    true = {k: float(v) for k, v in regimes.figures(name)[kind][key].items() if v}
    rate, breaks = law(true.get("inertia", 0.0)), tuple(np.radians(degrees))
    start = true["angle_speed_max"]
    low = start + (true["angle_speed_min"] - start) % (2 * pi)
    at_low = run(rate, start, true["speed_max"], low, breaks)
    around = run(rate, start, true["speed_max"], start + 2 * pi, breaks)
    close = 1e-8 if name == "governor" else 4e-12  # it bends where its speed says so, inside a step
    assert at_low[0] == pytest.approx(true["speed_min"], rel=close)
    assert around == pytest.approx([true["speed_max"], true["period"]], rel=close)
    assert true["irregularity"] * true["speed"] == pytest.approx(true["speed_max"] - true["speed_min"], rel=1e-8)


@pytest.mark.parametrize("key", ["0", "5", "500"])
def test_the_multiplier_is_the_integral_along_the_motion(key: str) -> None:
    true = regimes.figures("section-c")["analysis"][key]
    rate, start = section_c(float(key)), float(true["speed_at_zero"])

    def field(phi: float, s: Any) -> list[float]:
        return [rate(phi, s[0]) / s[0], -2.387 / (machine(phi, C_SIZES)[0] + float(key)) / s[0]]

    end = solve_ivp(field, (0, 2 * pi), [start, 0.0], method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    assert exp(end[1]) == pytest.approx(float(true["multiplier"]), rel=1e-11)


def test_section_c_is_what_the_source_gives() -> None:
    true = regimes.figures("section-c")["analysis"]["0"]
    assert float(true["irregularity"]) == pytest.approx(0.483227, abs=5e-7)
    assert float(true["speed"]) == pytest.approx(4.12273, abs=5e-6)
    assert float(true["period"]) == pytest.approx(1.538536393184, abs=5e-13)


@pytest.mark.parametrize("name", ["start-section-c", "start-section-c-flywheel", "start-section-c-dead-centre"])
def test_a_start_by_dop853_in_time(name: str) -> None:
    start = regimes.STARTS[name]
    rate = section_c(start.inertia)
    listed: Any = regimes.figures(name)
    truth = np.array([[float(f["phi"]), float(f["omega"])] for f in listed])
    field = lambda t, s: [s[1], rate(s[0], s[1])]  # noqa: E731
    first = [start.half_turns * pi, 0.0]
    found = solve_ivp(field, (0, 5), first, method="DOP853", rtol=1e-13, atol=1e-14, t_eval=start.times).y.T
    assert found == pytest.approx(truth, rel=5e-11)


def geared(flywheel: float, moment: float, force: float) -> tuple[Rate, Rate]:
    """The crank with a lossy mesh: its acceleration, and what the mesh gives the wheel, which drives where that is below 0.

    Of the accelerations with either sense the less is then the true one.
    """
    sizes = {"r": 0.1, "l": 0.45, "com": 0.15, "m": 8.0, "j": 0.2, "slider": 40.0, "crank": 0.4}
    behind = 64 * (flywheel + 0.01)

    def rate(phi: float, omega: float) -> float:
        inertia, slope, _, x1 = machine(phi, sizes)
        loaded = 290 <= np.degrees(phi) % 360 < 350
        front = -slope * omega**2 / 2 - (force * x1 if loaded else 0.0)
        ways = [(front + loss * 8 * moment) / (inertia + loss * behind) for loss in (0.9, 1 / 0.9)]
        return ways[0] if behind * ways[0] - 8 * moment <= 0 else ways[1]

    return rate, lambda phi, omega: behind * rate(phi, omega) - 8 * moment


def changes_of_side(rate: Rate, given: Rate, omega: float, breaks: tuple[float, ...]) -> Iterator[float]:
    """About where the mesh changes the side that drives, along the motion from phi = 0: a kink of the acceleration."""
    for low, high in pairwise((0.0, *breaks, 2 * pi)):
        field = lambda phi, s: [rate(phi, s[0]) / s[0]]  # noqa: E731
        motion = solve_ivp(field, (low, high), [omega], method="DOP853", rtol=1e-9, atol=1e-9, dense_output=True)
        along = lambda phi, sol=motion.sol: given(phi, float(sol(phi)[0]))  # noqa: E731
        inside = np.linspace(low, high, 200)[1:-1].tolist()
        yield from (brentq(along, a, b) for a, b in pairwise(inside) if along(a) * along(b) < 0.0)
        omega = float(motion.y[0, -1])


@pytest.mark.parametrize("kind", ["analysis", "sizing"])
def test_a_lossy_mesh_by_the_acceleration_of_either_sense(kind: str) -> None:
    true = {k: float(v) for k, v in regimes.figures("geared-loss")[kind]["0.05"].items() if v}
    rate, given = geared(true["inertia"], true["balance"], 8e3)
    windows, first = tuple(np.radians([290, 350])), true["speed_at_zero"]
    breaks = (*windows, *changes_of_side(rate, given, first, windows))
    assert len(breaks) > len(windows)
    assert run(rate, 0.0, first, 2 * pi, breaks) == pytest.approx([first, true["period"]], rel=1e-11)
    low = run(rate, 0.0, first, true["angle_speed_min"], breaks)
    high = run(rate, 0.0, first, true["angle_speed_max"], breaks)
    assert [low[0], high[0]] == pytest.approx([true["speed_min"], true["speed_max"]], rel=1e-11)


@pytest.mark.parametrize(("kind", "key"), [("analysis", "0.1"), ("sizing", "0.05")])
def test_a_motor_with_inductance_turns_volts_into_heat_and_work(kind: str, key: str) -> None:
    true = regimes.figures("dc-inductance")[kind][key]
    work = quad(lambda phi: 20e3 * slider(phi, 0.1, 0.5)[0], 5 * pi / 3, 23 * pi / 12, epsabs=1e-10)[0]
    assert float(true["electric_work"]) - float(true["heat"]) == pytest.approx(work, rel=1e-12)
    assert float(true["electric_work"]) == pytest.approx(
        220 * float(true["current_time_mean"]) * float(true["period"]), rel=1e-14
    )


def test_a_motor_with_inductance_settles_on_its_motion() -> None:
    true = {
        k: v if isinstance(v, list) else float(v) for k, v in regimes.figures("dc-inductance")["analysis"]["0.1"].items()
    }
    edges = [0, *np.radians([300, 345, 360])]
    state = [13.0, 10.0, 0.0, 0.0]
    for _ in range(12):
        state[2:] = [0.0, 0.0]
        for at, stop in pairwise(edges):
            force = 20e3 if at == edges[1] else 0.0

            def field(phi: float, s: Any, force: float = force) -> list[float]:
                inertia, slope, _, x1 = machine(phi, PRESS)
                moment = 15 * s[1] - force * x1 - slope * s[0] ** 2 / 2
                current = (220 - 0.8 * s[1] - 15 * s[0]) / 0.05
                return [moment / (inertia + 100 * 0.13) / s[0], current / s[0], 1 / s[0], s[1] / s[0]]

            state = list(solve_ivp(field, (at, stop), state, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1])
    assert state[2] == pytest.approx(true["period"], rel=1e-10)
    assert state[3] / state[2] == pytest.approx(true["current_time_mean"], rel=1e-10)


@pytest.mark.parametrize("name", ["unstable", "two-speeds-slow"])
def test_unstable_motions_grow(name: str) -> None:
    assert all(float(found["multiplier"]) > 1 for found in regimes.figures(name)["analysis"].values())


def test_every_case_has_its_figures() -> None:
    for name, case in regimes.CASES.items():
        found = regimes.figures(name)
        assert list(found["analysis"]) == [repr(j) for j in case.inertias]
        assert list(found["sizing"]) == [repr(e) for e in case.irregularities]
        assert [float(found["sizing"][repr(e)]["irregularity"]) for e in case.irregularities] == pytest.approx(
            case.irregularities, rel=1e-15
        )
