"""What the oracle does not know of the reference figures, by DOP853 on equations written by hand."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import cos, exp, pi, sin, sqrt
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

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
