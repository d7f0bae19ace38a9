import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import flywheel
from tests import scenes


def sized(scene, rtol=None):
    return flywheel.size(flywheel.load(scene), rtol, simulate=False)


@pytest.mark.parametrize("make", scenes.ALL.values(), ids=scenes.ALL)
def test_the_certificate_brackets_the_exact_flywheel(make):
    flywheel_ = sized(make()).flywheel
    slack = 1e-12 * flywheel_.exact
    for low, high in (flywheel_.bracket, flywheel_.torque_bracket):
        assert low - slack <= flywheel_.exact <= high + slack


def test_exact_equals_approximate_where_the_inertia_is_constant():
    result = sized(scenes.rotor(inertia=[{"on": "crank", "value": 0.25}]))
    assert result.flywheel.exact == pytest.approx(result.flywheel.approximate, rel=1e-14)
    assert result.flywheel.inertia_torque == pytest.approx(result.flywheel.approximate_total, rel=1e-14)
    assert_allclose(result.reduced_inertia, 0.25, rtol=1e-14)


def test_the_exam_of_p103():
    slow = sized(scenes.yoke())
    assert slow.balance.value == pytest.approx(500 / np.pi, rel=1e-14)
    assert slow.flywheel.exact == pytest.approx(353.521427322012, rel=1e-13)
    assert slow.flywheel.approximate == pytest.approx(348.98939678, rel=1e-11)
    fast = sized(scenes.yoke(regime={"speed": 100}))
    assert fast.flywheel.exact == pytest.approx(60.6536269904903, rel=1e-13)
    assert fast.flywheel.approximate == pytest.approx(1.37775491456, rel=1e-11)


@pytest.mark.parametrize("rtol", [1e-3, 1e-12])
def test_rtol_is_kept_and_the_estimate_covers_the_error(rtol):
    result = sized(scenes.yoke(regime={"speed": 100}), rtol)
    error = abs(result.flywheel.exact / 60.653626990490335 - 1)
    assert error <= result.error.exact <= rtol
    assert result.reached


def test_varying_inertia_alone_needs_a_flywheel_that_areas_do_not_see():
    result = sized(scenes.yoke(load=[]))
    assert result.energy_fluctuation == pytest.approx(0, abs=1e-12)
    assert result.flywheel.approximate == 0.0
    eps, low, high = 0.04, 0.0, 5.0
    fast, slow = (1 + eps / 2) ** 2, (1 - eps / 2) ** 2
    assert result.flywheel.exact == pytest.approx((slow * high - fast * low) / (2 * eps), rel=1e-12)


@given(eps=st.floats(1e-8, 1.9), speed=st.floats(1e-3, 1e5), mass=st.floats(1e-3, 1e4))
@settings(derandomize=True, deadline=None, max_examples=12)
def test_exact_lies_in_the_bracket_and_rtol_is_met_over_the_whole_range(eps, speed, mass):
    mechanism = scenes.yoke()["mechanism"] | {"yoke": {"mass": mass}}
    result = sized(scenes.yoke(mechanism=mechanism, regime={"speed": speed}, flywheel={"irregularity": eps}))
    assert result.error.exact <= 1e-9
    low, high = result.flywheel.bracket
    slack = 1e-9 * max(abs(low), abs(high))
    assert low - slack <= result.flywheel.exact
    assert result.flywheel.exact <= max(high, 0.0) + slack


@given(scale=st.floats(1e-9, 1e9))
@settings(derandomize=True, deadline=None, max_examples=6)
def test_scaling_masses_and_loads_scales_the_flywheel(scale):
    base = scenes.yoke()
    mechanism = base["mechanism"] | {"yoke": {"mass": 20 * scale}}
    load = [base["load"][0] | {"force": 1000 * scale}]
    result = sized(scenes.yoke(mechanism=mechanism, load=load))
    assert result.flywheel.exact == pytest.approx(353.521427322012 * scale, rel=1e-12)


@given(phase=st.floats(0, 6.28))
@settings(derandomize=True, deadline=None, max_examples=6)
def test_shifting_the_origin_of_phi_changes_nothing(phase):
    mechanism = scenes.yoke()["mechanism"] | {"phase": phase}
    result = sized(scenes.yoke(mechanism=mechanism))
    assert result.flywheel.exact == pytest.approx(353.521427322012, rel=1e-12)
    assert result.energy_fluctuation == pytest.approx(551.1021, rel=1e-6)
