"""How a machine goes through its motion: times from its speed, evenly spread, for cycles and strokes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import flywheel
from flywheel.numerics.faults import SceneError
from flywheel.pictures.mechanisms import Timing, timing
from flywheel.pictures.sketch import views
from flywheel.regime import turning_moment
from tests.pictures.test_sketch_views import CLAMP
from tests.regimes import SECTION_C, figures
from tests.scenes import press, yoke


def of(scene: dict[str, Any]) -> Timing:
    loaded = flywheel.load(scene)
    return timing(loaded, views(loaded)[0])


def test_the_cycle_takes_its_period() -> None:
    sizing = flywheel.size(flywheel.load(yoke()), simulate=False)
    assert sizing.machine is not None
    assert sizing.cycle is not None
    assert sizing.run is not None
    period, _ = turning_moment.period(sizing.cycle, sizing.speed, sizing.run, 1e-9)
    assert of(yoke()).time[-1] == pytest.approx(period, rel=1e-6)


def test_a_machine_that_sets_its_own_speed_takes_its_own_time() -> None:
    known = figures("section-c")["analysis"]["5"]
    found = of(SECTION_C | {"flywheel": {"inertia": 5}})
    assert found.time[-1] == pytest.approx(float(known["period"]), rel=1e-6)
    assert found.curve.max() == pytest.approx(float(known["speed_max"]) * 30 / np.pi, rel=1e-5)


def test_the_curve_is_the_speed_with_the_flywheel() -> None:
    found = of(yoke())
    assert found.curve.max() == pytest.approx(60 * 1.02, rel=1e-4)
    assert found.curve.min() == pytest.approx(60 * 0.98, rel=1e-4)
    assert found.label == "crank speed, rpm"
    assert "353.52 kg m²" in found.title


def test_frames_are_even_in_time_and_close_the_cycle() -> None:
    found = of(press(flywheel={"inertia": 20}))
    time, q, curve = found.evenly(50)
    assert np.ptp(np.diff(time)) < 1e-12
    assert time[0] == q[0] == 0.0
    assert q[-1] < 2 * np.pi
    speed = np.diff(q) / np.diff(time)
    assert np.ptp(speed) > 0.05 * speed.mean()
    between = np.pi / 30 * 0.5 * (curve[1:] + curve[:-1])
    np.testing.assert_allclose(speed, between, rtol=2e-2)
    assert "a flywheel of 20 kg m²" in found.title


def test_small_swings_are_drawn_about_the_mean() -> None:
    found = of(yoke(flywheel={"irregularity": 1e-6}))
    assert found.label == "crank speed − 60 rpm, rpm"
    assert np.abs(found.curve).max() < 1e-4


def test_a_stroke_shows_the_driven_slide_s_velocity() -> None:
    found = of(CLAMP)
    assert not found.closed
    assert found.label == "velocity of platen, m/s"
    assert found.time[-1] == pytest.approx(0.25 / 0.3289474)
    assert found.curve[-1] == pytest.approx(2.179e-5, rel=1e-3)  # the dead centre's printed 0.02179 mm/s
    _, q, _ = found.evenly(11)
    np.testing.assert_allclose(q, np.linspace(-0.06, 0.19, 11), atol=1e-12)


def test_a_stroke_backwards_begins_at_its_end() -> None:
    found = of(CLAMP | {"stroke": CLAMP["stroke"] | {"speed": -0.5}})
    assert (found.q[0], found.q[-1]) == (0.19, -0.06)
    assert found.time[0] == 0.0
    assert found.time[-1] == pytest.approx(0.5)


def test_a_stroke_that_stands_still_is_refused() -> None:
    with pytest.raises(SceneError, match=r"stroke\.speed: found 0"):
        of(CLAMP | {"stroke": CLAMP["stroke"] | {"speed": 0.0}})
