"""Methods compared on a slider-crank: the statistics, and how far the methods agree."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from bondgraph import GraphError
from bondgraph.case_study import (
    HARMONIC,
    STEADY,
    Imposed,
    SliderCrank,
    agreement,
    compare_free_motion,
    compare_kinematics,
    compare_torques,
    exact_inertia,
)

# -- statistics ---------------------------------------------------------------------------------------------------------


def test_two_coefficients_that_are_not_the_same():
    t = np.linspace(0.0, 2 * np.pi, 500, endpoint=False)
    wave = np.sin(t)
    assert_allclose(agreement(wave, wave), (1.0, 1.0, 0.0, 0.0))
    assert_allclose(agreement(3 * wave + 1, wave)[:2], (1.0, np.sqrt(5.0)))
    assert_allclose(agreement(-wave, wave)[:2], (-1.0, np.sqrt(3.0)))
    assert agreement(2.0 * wave, wave).coefficient == pytest.approx(0.0, abs=1e-7)
    assert agreement(2.0 * wave, wave).greatest == pytest.approx(1.0)


@given(st.lists(st.floats(-1e3, 1e3), min_size=3, max_size=12).filter(lambda v: np.ptp(v) > 1e-3))
def test_pearson_is_numpys(values):
    other = np.arange(len(values)) ** 2.0
    assert_allclose(agreement(values, other).pearson, np.corrcoef(values, other)[0, 1], atol=1e-9)


@pytest.mark.parametrize(
    ("curve", "reference", "says"),
    [
        ([1.0, 1.0], [0.0, 1.0], "does not vary"),
        ([0.0, 1.0], [1.0, 1.0], "does not vary"),
        ([0.0, np.inf], [0.0, 1.0], "no numbers"),
        ([0.0, 1.0, 2.0], [0.0, 1.0], "same times"),
    ],
)
def test_curves_without_a_correlation(curve, reference, says):
    with pytest.raises(GraphError, match=says):
        agreement(curve, reference)


# -- comparisons --------------------------------------------------------------------------------------------------------


def test_graph_agrees_with_triangle_to_the_order_of_the_method():
    coarse, fine = (compare_kinematics(until=6.0, step=step) for step in (0.2, 0.1))
    for name in ("position", "velocity", "acceleration"):
        gain = {m: coarse[name].agreement(m).greatest / fine[name].agreement(m).greatest for m in ("euler", "rk2", "rk4")}
        assert_allclose([gain["euler"], gain["rk2"], gain["rk4"]], [2, 4, 16], rtol=0.25)
        assert fine[name].agreement("DOP853").greatest < 1e-10
        assert fine[name].agreement("DOP853").pearson == pytest.approx(1.0, abs=1e-12)


def test_steady_crank_has_its_angle_right_by_any_method():
    found = compare_kinematics(imposed=STEADY, until=2.0, step=0.02)
    assert found["velocity"].agreement("euler").greatest < 1e-11
    assert found["position"].agreement("euler").greatest > 1e-2
    assert found["acceleration"].agreement("rk2").greatest < 1e-10


def test_free_motion_by_three_equations():
    found = compare_free_motion()
    for name in ("theta", "omega", "velocity"):
        assert found[name].agreement("bond graph").greatest < 1e-9
    assert found["omega"].agreement("small lambda").pearson == pytest.approx(0.9067, abs=1e-4)
    assert found["omega"].agreement("small lambda, m l²/3").pearson == pytest.approx(0.3813, abs=1e-4)


def test_free_motion_keeps_its_energy():
    machine = SliderCrank(0.5, 1.5, 2.0, 1.0, 3.0)
    found = compare_free_motion(machine, omega=4.0, until=3.0)
    theta, omega = (found[name].curves["bond graph"] for name in ("theta", "omega"))
    energy = exact_inertia(machine, theta).value * omega**2
    assert_allclose(energy, energy[0], rtol=1e-9)


@pytest.mark.parametrize(("imposed", "off"), [(HARMONIC, 0.716), (STEADY, 22.0)])
def test_torque_that_imposes_a_motion(imposed, off):
    torque = compare_torques(imposed=imposed)["torque"]
    assert torque.agreement("bond graph").greatest < 1e-9
    assert torque.agreement("small lambda").greatest == pytest.approx(off, rel=2e-3)


def test_pearson_cannot_tell_two_wrong_torques_apart():
    torque = compare_torques(imposed=STEADY)["torque"]
    slip, sound = (torque.agreement(name) for name in ("small lambda, m l²/3", "small lambda"))
    assert slip.pearson == pytest.approx(sound.pearson, abs=1e-12)
    assert slip.coefficient < sound.coefficient - 0.005


def test_motion_that_does_not_start_at_zero():
    imposed = Imposed("theta = 1 + t²", lambda t: 1.0 + t * t, lambda t: 2.0 * t, lambda t: 2.0 + 0.0 * t)
    found = compare_kinematics(SliderCrank(0.3, 0.8), imposed, until=2.0, step=0.02)
    assert found["position"].agreement("DOP853").greatest < 1e-10
    assert compare_torques(imposed=imposed, until=2.0)["torque"].agreement("bond graph").greatest < 1e-8


def test_table_has_every_quantity_and_method():
    lines = compare_free_motion(until=1.0, points=20).table().splitlines()
    assert lines[0] == "free motion from 1 rad/s; reference: exact Lagrange"
    assert len(lines) == 2 + 3 * 3
    assert {len(line) for line in lines[1:]} == {98}


# -- faults -------------------------------------------------------------------------------------------------------------


def test_names_that_are_not_there():
    found = compare_free_motion(until=1.0, points=20)
    with pytest.raises(GraphError, match="no quantity 'speed': there are theta, omega, velocity"):
        found["speed"]
    with pytest.raises(GraphError, match="theta: no method 'newton': there are bond graph"):
        found["theta"].agreement("newton")


def test_arguments_that_mean_nothing():
    with pytest.raises(GraphError, match="points: found 1"):
        compare_torques(points=1)
    with pytest.raises(GraphError, match="until: found -1"):
        compare_free_motion(until=-1.0)
