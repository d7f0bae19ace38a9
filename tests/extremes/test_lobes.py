"""Lobes that are equal, or all but: the value is right whichever is taken, and the angle is one of theirs."""

from __future__ import annotations

from math import pi, tau

import numpy as np
import pytest

import flywheel
from tests.limits import sample

from .cases import turning
from .machines import Scene, running
from .measured import ROUNDING, Row

COUNTS = (1, 2, 3, 7, 40, 200)
TILTS = (0.0, 1e-15, -1e-15, 1e-13, -1e-13, 1e-11, -1e-11)


def wave(count: int, tilt: float = 0.0) -> Scene:
    """A shaft with as many equal lobes in a turn, one of them raised by a tilt."""
    return turning([{"torque": f"100*sin({count}*phi) + {100 * tilt!r}*sin(phi)"}])


def square(count: int) -> Scene:
    """The same with jumps, where all extremes stand on breakpoints."""
    return turning([{"torque": f"100*sign(sin({count}*phi))"}])


def twins() -> Scene:
    """Two slider-cranks half a turn apart: every lobe comes twice."""
    cranks = [
        {
            "type": "slider-crank",
            "name": name,
            "phase": f"{phase} deg",
            "crank": {"length": 0.1},
            "rod": {"length": 0.3, "mass": 2.0, "com": 0.1},
            "slider": {"mass": 5.0},
        }
        for name, phase in (("one", 0), ("two", 180))
    ]
    loads = [{"on": f"{name}.slider", "force": -900.0, "while": "v > 0"} for name in ("one", "two")]
    return running({"mechanism": cranks, "load": loads}, 10.0)


def off(count: int, tilt: float) -> tuple[float, float]:
    """Error and estimate of a wave's flywheel: 2 T/(n eps w²) and what a tilt adds, but for its square."""
    found = flywheel.size(flywheel.load(wave(count, tilt)), simulate=False)
    true = 40 / count * (1 + 0.5 * count * tilted(count, tilt))
    return abs(found.flywheel.exact - true) / true, found.error.exact


def tilted(count: int, tilt: float) -> float:
    """What -tilt cos phi adds to the swing of -cos(n phi): the best of the equal tops less the best of the bottoms."""
    tops = -tilt * np.cos((2 * np.arange(count) + 1) * pi / count)
    bottoms = -tilt * np.cos(2 * np.arange(count) * pi / count)
    return float(tops.max() - bottoms.min())


def results() -> list[Row]:
    """One row for smooth lobes, one for lobes with corners."""
    smooth = max((off(count, tilt) for count in COUNTS for tilt in TILTS), key=lambda pair: pair[0])
    corners = []
    for count in (1, 2, 10):
        found = flywheel.size(flywheel.load(square(count)), simulate=False)
        corners.append((abs(found.flywheel.exact * count / (20 * pi) - 1), found.error.exact))
    return [
        Row("equal lobes, one raised by 0..1e-11", "1..200 in a turn", *smooth, "closed form"),
        Row("equal lobes between jumps", "1, 2, 10 in a turn", *max(corners), "closed form"),
    ]


@pytest.mark.parametrize("tilt", sample(TILTS, 5))
@pytest.mark.parametrize("count", [1, 3, 200])
def test_the_value_is_right_whichever_lobe_is_taken(count: int, tilt: float) -> None:
    error, estimate = off(count, tilt)
    assert error <= estimate + ROUNDING
    assert estimate <= 0.5e-9  # half of what is asked by default
    assert len(flywheel.size(flywheel.load(wave(count, tilt)), simulate=False).areas) == 2 * count


@pytest.mark.parametrize("count", [2, 7, 200])
def test_the_angle_is_that_of_one_of_the_lobes(count: int) -> None:
    found = flywheel.size(flywheel.load(wave(count)), simulate=False)
    assert found.error.extremes is not None
    for angle, shift in ((found.angle_speed_max, 0.5), (found.angle_speed_min, 0.0)):
        assert angle is not None
        turns = angle * count / tau - shift
        assert abs(turns - round(turns)) * tau / count <= found.error.extremes + 1e-15


@pytest.mark.parametrize("tilt", [1e-8, -1e-8])
def test_a_lobe_that_is_truly_higher_is_the_one(tilt: float) -> None:
    """W = -50 cos 2 phi - 100 tilt cos(phi + 1) has tops at 90 and 270 deg, bottoms at 0 and 180 deg."""
    torque = f"100*sin(2*phi) + {100 * tilt!r}*sin(phi + 1)"
    found = flywheel.size(flywheel.load(turning([{"torque": torque}])), simulate=False)
    top = max((0.5 * pi, 1.5 * pi), key=lambda phi: -tilt * np.cos(phi + 1))
    bottom = min((0.0, pi), key=lambda phi: -tilt * np.cos(phi + 1))
    assert found.angle_speed_max == pytest.approx(top, abs=1e-7)
    assert found.angle_speed_min is not None
    assert (found.angle_speed_min - bottom + pi) % tau == pytest.approx(pi, abs=1e-7)


@pytest.mark.parametrize("count", [1, 2, 10])
def test_lobes_between_jumps(count: int) -> None:
    found = flywheel.size(flywheel.load(square(count)), simulate=False)
    assert found.flywheel.exact == pytest.approx(20 * pi / count, rel=found.error.exact)
    assert len(found.areas) == 2 * count


def test_two_cranks_half_a_turn_apart_say_everything_twice() -> None:
    found = flywheel.size(flywheel.load(twins()), simulate=False)
    assert found.angle_speed_max is not None
    works = sorted(area.work for area in found.areas[1:-1])  # the seam cuts an area in two
    assert works[::2][: len(works) // 2] == pytest.approx(works[1::2], rel=1e-12)
    whole = flywheel.size(flywheel.load({**twins(), "regime": {"speed": 10.0, "cycle": "720 deg"}}), simulate=False)
    assert whole.flywheel.exact == pytest.approx(found.flywheel.exact, rel=found.error.exact + whole.error.exact)
    assert whole.energy_fluctuation == pytest.approx(found.energy_fluctuation, rel=1e-12)
