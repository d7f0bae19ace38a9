"""The slider-crank in closed form: against the triangle, differences, the reduced graph and the limit of a long rod."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from bondgraph import GraphError, reduce
from bondgraph.case_study import SliderCrank, exact_inertia, small_ratio_inertia, triangle

angles = st.floats(-10.0, 10.0)
ratios = st.floats(0.05, 0.95)


@given(angles, ratios)
def test_triangle_is_the_law_of_cosines(theta, ratio):
    machine = SliderCrank(ratio, 1.0)
    x = triangle(machine, theta, 1.0, 0.0).position
    assert_allclose(x**2 + ratio**2 - 2 * x * ratio * np.cos(theta), 1.0, rtol=1e-12)


@given(angles, ratios, st.sampled_from([0.0, 0.5, 1.0]))
def test_slopes_are_derivatives(theta, ratio, share):
    machine, h = SliderCrank(ratio, 1.0), 1e-6
    before, after = machine.along(share, theta - h), machine.along(share, theta + h)
    _, slope, bend = machine.along(share, theta)
    assert_allclose((after[0] - before[0]) / (2 * h), slope, atol=1e-8)
    assert_allclose((after[1] - before[1]) / (2 * h), bend, atol=1e-6)
    swing_before, swing_after = machine.swing(theta - h)[0], machine.swing(theta + h)[0]
    assert_allclose((swing_after - swing_before) / (2 * h), machine.swing(theta)[1], atol=1e-6)


def test_middle_term_of_the_acceleration():
    theta, ratio = 0.3, 0.5
    w = np.sqrt(1 - (ratio * np.sin(theta)) ** 2)
    rest = ratio * np.cos(2 * theta) / w + np.cos(theta)
    true = ratio**3 / 4 * np.sin(2 * theta) ** 2 / w**3
    assert_allclose(-triangle(SliderCrank(), theta, 1.0, 0.0).acceleration, rest + true, rtol=1e-14)
    assert rest + true == pytest.approx(1.38288, abs=5e-6)
    assert rest + ratio**2 / 2 * np.sin(2 * theta) / w**3 == pytest.approx(1.44554, abs=5e-6)  # as printed


@settings(max_examples=25)
@given(angles, ratios, st.sampled_from([0.0, 2.5]))
def test_exact_inertia_is_the_graph_reduced(theta, ratio, rod):
    machine = SliderCrank(0.7 * ratio, 0.7, 0.4, rod, 1.3)
    reduced, exact = reduce(machine.builder().build(), theta), exact_inertia(machine, theta)
    assert_allclose(exact.value, reduced.inertia, rtol=1e-12)
    assert_allclose(exact.slope, reduced.slope, rtol=1e-9, atol=1e-12)


def test_small_ratio_is_the_limit_of_the_exact_inertia():
    theta = np.linspace(0.0, 2 * np.pi, 60)

    def gap(length):
        machine = SliderCrank(1.0, length)
        return np.abs(small_ratio_inertia(machine, theta).value - exact_inertia(machine, theta).value).max()

    assert gap(2000.0) < 2e-3
    assert gap(200.0) / gap(2000.0) == pytest.approx(10.0, rel=0.01)


def test_the_slip_of_the_rods_inertia_is_a_quarter_too_much():
    machine = SliderCrank()
    centre, end = (float(small_ratio_inertia(machine, 0.0, about=about).value) for about in ("centre", "end"))
    assert centre == pytest.approx(1 / 3 + 1 / 3)  # at a dead centre the rod turns about its end: m l²/3, times lambda²
    assert end - centre == pytest.approx(0.25)
    assert centre == pytest.approx(float(exact_inertia(machine, 0.0).value))


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"radius": 2.0}, "longer than the crank"),
        ({"slider": 0.0}, "slider: found 0.0"),
        ({"rod": -1.0}, "rod: found -1.0"),
        ({"crank": np.nan, "length": -1.0}, "length: found -1.0.*\ncrank: found nan"),
    ],
)
def test_machines_that_are_none(arguments, says):
    with pytest.raises(GraphError, match=says):
        SliderCrank(**arguments)


def test_a_rods_inertia_is_about_its_centre_or_its_end():
    with pytest.raises(GraphError, match="about: found 'pin'"):
        small_ratio_inertia(SliderCrank(), 0.0, about="pin")
