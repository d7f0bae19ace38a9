"""Presses: energy of a stroke, force by penetration, and the same as expressions of x and v, or of phi."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from flywheel.components.load_models import Press, greatest_force, press_force, press_law, shaft_law, sheared_area

SHAPES = ["constant", "triangular"]


@pytest.mark.parametrize("shape", SHAPES)
def test_the_energy_of_a_stroke_is_the_work_of_its_force(shape):
    press = Press(3e5, 0.012, shape)
    work = quad(lambda p: float(press_force(p, press)), 0.0, 0.012, epsabs=0, epsrel=1e-13)[0]
    assert press.energy == pytest.approx(work, rel=1e-13)
    assert greatest_force(press.energy, press.travel, shape) == pytest.approx(press.force, rel=1e-15)


def test_a_shearing_force_does_half_of_its_greatest_times_the_thickness():
    thickness, strength = 0.015, 300e6
    area = sheared_area(thickness, np.pi * 0.04)
    assert area == pytest.approx(np.pi * 0.04 * 0.015)
    assert Press(strength * area, thickness, "triangular").energy == pytest.approx(strength * area * thickness / 2)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("overtravel", [0.0, 0.004])
@pytest.mark.parametrize("high", [True, False])
def test_the_expression_is_the_formula(shape, overtravel, high):
    press, end, sign = Press(3e5, 0.012, shape, overtravel), 0.3, 1 if high else -1
    way_left = np.array([0.03, 0.0161, 0.0159, 0.0121, 0.0119, 0.008, 0.0041, 0.0039, 0.001, 1e-5])
    law = press_law(press, end, high)
    at = {"x": end - sign * way_left, "v": np.full(way_left.shape, float(sign))}
    wanted = -sign * press_force(press.travel + overtravel - way_left, press)
    assert law.evaluate(at, np) == pytest.approx(wanted, rel=1e-12)
    assert not np.any(law.evaluate(at | {"v": -at["v"]}, np))
    assert not law.uses_speed


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("window", [(1.0, 2.5), (5.0, 1.0), (0.0, 0.3), (4.0, 6.0)])
def test_the_torque_on_a_shaft_gives_the_energy_over_its_window(shape, window):
    every, ratio = 6.0, 2.5
    law = shaft_law(70.0, window, every, ratio, shape)
    start, end = window
    pieces = [(start, end)] if start < end else [(start, every), (0.0, end)]
    torque = [quad(lambda phi: float(law.evaluate({"phi": phi}, np)), *piece)[0] for piece in pieces]
    assert ratio * sum(torque) == pytest.approx(-70.0, rel=1e-12)
    peak = float(law.evaluate({"phi": start}, np))
    assert peak == pytest.approx(-(2 if shape == "triangular" else 1) * 70.0 / (ratio * ((end - start) % every)))
    if shape == "triangular":
        assert float(law.evaluate({"phi": end}, np)) == pytest.approx(0.0, abs=1e-12)


def test_khurmi_16_22_energy_of_a_hole():
    """40 mm through 15 mm at 6 J/mm²: its flywheel gives what the motor does not in 0.1 s of 2 s, from 160 to 140 rpm."""
    energy = 6e6 * sheared_area(0.015, np.pi * 0.04)
    given = energy * (1 - 0.1 / 2.0)
    high, low = 160 * np.pi / 30, 140 * np.pi / 30
    assert given / (0.5 * (high**2 - low**2)) == pytest.approx(326.58594322456935, rel=1e-12)
