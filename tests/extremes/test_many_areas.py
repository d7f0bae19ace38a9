"""A spring on x = a sin(n phi): M* changes its sign a hundred times and more, at angles known in closed form."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

import flywheel
from flywheel.sizing.results import Sizing

from .machines import Scene
from .measured import ROUNDING, Row

A, N, MASS, STIFF, SPEED = 0.01, 50, 0.5, 1e4, 10.0
RESTS = (0.0, 0.003, -0.007, 0.0099)  # inside the stroke: where the spring is at rest M* changes its sign as well
EPS = (1e-14, 1e-9, 0.05, 1.0, 1.9)
PULSES = ({"from": "100 deg", "to": "101 deg", "torque": -5}, {"from": "200 deg", "to": "200.001 deg", "torque": -500})
FEW_STEPS = 2_000_000  # of a grid on which signs are counted

Array = NDArray[np.float64]


class Found(NamedTuple):
    """The worst true errors of a sizing, by its scale, of its areas' angles (rad), and what it states of them."""

    what: str
    exact: float
    estimate: float
    angles: float
    angles_estimate: float


def scene(rest: float = 0.0, eps: float = 0.05, n: int = N, **more: Any) -> Scene:
    """A slide that swings n times in a turn, against a spring."""
    slide = {"x": f"{A}*sin({n}*phi)", "mass": MASS}
    return {
        "mechanism": {"type": "law", "outputs": {"slide": slide}},
        "spring": [{"on": "slide", "stiffness": STIFF, "rest": rest}],
        "regime": {"speed": SPEED},
        "flywheel": {"irregularity": eps},
    } | more


def sized(asked: Scene) -> Sizing:
    """Sized, without time stepping."""
    return flywheel.size(flywheel.load(asked), simulate=False)


def crossings(rest: float, n: int = N) -> Array:
    """Where M* = -k (x - rest) x' changes its sign inside a turn: at x' = 0, and at x = rest."""
    turns = np.arange(n) * 2 * np.pi
    at_rest = np.arcsin(rest / A)
    angles = [(turns + part) / n for part in (np.pi / 2, 3 * np.pi / 2, at_rest % (2 * np.pi), np.pi - at_rest)]
    found = np.sort(np.concatenate(angles))
    return found[(found > 1e-12) & (found < 2 * np.pi - 1e-12)]


def exact(rest: float, eps: float) -> float:
    """Wittenbauer's figure: extremes over s = sin(n phi) of -k/2 (x² - 2 rest x) - z± w² m (a n)² (1 - s²)/2."""

    def value(s: float, z: float) -> float:
        kinetic = z * SPEED**2 * MASS * (A * N) ** 2 * (1 - s * s) / 2
        return -0.5 * STIFF * ((A * s) ** 2 - 2 * rest * A * s) - kinetic

    def extremes(z: float) -> Iterator[float]:
        bend = -STIFF * A * A + z * SPEED**2 * MASS * (A * N) ** 2
        within = -STIFF * rest * A / bend  # of value's slope
        yield from (value(s, z) for s in (-1.0, 1.0, within) if abs(s) <= 1.0)

    return (max(extremes((1 + eps / 2) ** 2)) - min(extremes((1 - eps / 2) ** 2))) / (eps * SPEED**2)


@cache
def swept(every: int = 1) -> list[Found]:
    """Every rest and irregularity, or every so many of them."""
    found = []
    for rest in RESTS[::every]:
        for eps in EPS[::every]:
            result, true = sized(scene(rest, eps)), exact(rest, eps)
            angles = np.array([area.end for area in result.areas[:-1]])
            assert angles.size == crossings(rest).size
            assert result.flywheel.exact is not None
            assert result.flywheel.approximate_total is not None
            assert result.error.exact is not None
            assert result.error.angles is not None
            off = float(np.abs(angles - crossings(rest)).max())
            scale = max(true, result.flywheel.approximate_total)
            what = f"rest {rest:g} m, eps {eps:g}"
            error = abs(result.flywheel.exact - true) / scale
            found.append(Found(what, error, result.error.exact, off, result.error.angles))
    return found


def results() -> list[Row]:
    """The worst flywheel and the worst angle."""
    wheel, angle = max(swept(), key=lambda found: found.exact), max(swept(), key=lambda found: found.angles)
    span = "199 and 200 areas, eps 1e-14..1.9"
    return [
        Row("M* changes sign, flywheel", span, wheel.exact, wheel.estimate, f"closed form; worst: {wheel.what}"),
        Row("M* changes sign, angles (rad)", span, angle.angles, angle.angles_estimate, f"worst: {angle.what}"),
    ]


def test_no_area_is_missed_and_every_figure_is_known_to_its_estimate() -> None:
    for found in swept(2):
        assert found.exact <= found.estimate + ROUNDING, found
        assert found.angles <= found.angles_estimate + 8 * ROUNDING, found
        assert found.estimate < 1e-8, found


@pytest.mark.parametrize("n", [1, 100])
def test_the_areas_are_four_in_every_swing(n: int) -> None:
    found = sized(scene(0.003, n=n))
    assert len(found.areas) == 4 * n + 1
    off = abs(found.energy_fluctuation / (0.5 * STIFF * (A + 0.003) ** 2) - 1)
    assert found.cycle is not None
    assert found.error.work is not None
    assert off <= found.error.work * found.cycle.exchanged / found.energy_fluctuation < 1e-8


def test_windows_on_top_add_their_own_areas() -> None:
    loads = [{"on": "crank"} | pulse for pulse in PULSES]
    found = sized(scene(load=loads, drive={"torque": "balance"}))
    assert found.balance is not None
    true = (5 + 500 * 0.001) / 360
    assert found.balance.value == pytest.approx(true, rel=1e-9)
    windows = np.radians([100.0, 101.0, 200.0, 200.001])
    grid = np.sort(np.concatenate((np.linspace(0, 2 * np.pi, FEW_STEPS), windows - 1e-13, windows + 1e-13)))[1:-1]
    moment = -STIFF * A * A * N * np.sin(N * grid) * np.cos(N * grid) + true
    moment -= 5.0 * ((grid >= windows[0]) & (grid < windows[1])) + 500.0 * ((grid >= windows[2]) & (grid < windows[3]))
    assert len(found.areas) == 1 + np.count_nonzero(np.diff(np.sign(moment)))
