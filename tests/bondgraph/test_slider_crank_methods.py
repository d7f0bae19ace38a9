"""The slider-crank of `examples/bond_graphs/compare_methods.py`: closed forms, agreement of methods, and dead centres."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from bondgraph import GraphError, reduce
from examples.bond_graphs.compare_methods import (
    HARMONIC,
    STEADY,
    Imposed,
    Loads,
    SliderCrank,
    agreement,
    compare_kinematics,
    compare_motion,
    compare_torques,
    divided_by_modulus,
    exact_inertia,
    printed_programme,
    small_ratio_inertia,
    triangle,
)

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


@settings(max_examples=12)
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


def test_two_coefficients_that_are_not_the_same():
    t = np.linspace(0.0, 2 * np.pi, 500, endpoint=False)
    wave = np.sin(t)
    assert_allclose(agreement(wave, wave), (1.0, 1.0, 0.0, 0.0))
    assert_allclose(agreement(3 * wave + 1, wave)[:2], (1.0, np.sqrt(5.0)))
    assert_allclose(agreement(-wave, wave)[:2], (-1.0, np.sqrt(3.0)))
    assert agreement(2.0 * wave, wave).coefficient == pytest.approx(0.0, abs=1e-7)
    assert agreement(2.0 * wave, wave).greatest == pytest.approx(1.0)


def test_pearson_is_numpys():
    values, other = np.array([3.0, -1.0, 4.0, 1.5, -9.0]), np.arange(5) ** 2.0
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


@pytest.mark.slow
def test_graph_agrees_with_triangle_to_the_order_of_the_method():
    coarse, fine = (compare_kinematics(until=1.0, step=step) for step in (0.1, 0.05))
    for name in ("position", "velocity", "acceleration"):
        gain = {m: coarse[name].agreement(m).greatest / fine[name].agreement(m).greatest for m in ("euler", "rk2", "rk4")}
        assert_allclose([gain["euler"], gain["rk2"], gain["rk4"]], [2, 4, 16], rtol=0.25)
        assert fine[name].agreement("DOP853").greatest < 1e-10
        assert fine[name].agreement("DOP853").pearson == pytest.approx(1.0, abs=1e-12)


@pytest.mark.slow
def test_steady_crank_has_its_angle_right_by_any_method():
    found = compare_kinematics(imposed=STEADY, until=0.3, step=0.02)
    assert found["velocity"].agreement("euler").greatest < 1e-11
    assert found["position"].agreement("euler").greatest > 1e-2
    assert found["acceleration"].agreement("rk2").greatest < 1e-10


def test_free_motion_by_three_equations():
    found = compare_motion()
    for name in ("theta", "omega", "alpha", "position", "velocity", "acceleration"):
        assert found[name].agreement("bond graph").greatest < 1e-9
    assert found["omega"].agreement("small lambda").pearson == pytest.approx(0.9067, abs=1e-4)
    assert found["omega"].agreement("small lambda, m l²/3").pearson == pytest.approx(0.3813, abs=1e-4)


def test_motion_from_rest_has_the_energy_of_its_torque():
    found, machine = compare_motion(omega=0.0, torque=2.0, until=1.5, points=20), SliderCrank()
    theta, omega, alpha, x, v, a = (found[name].curves["bond graph"] for name in [q.name for q in found.quantities])
    inertia = exact_inertia(machine, theta)
    assert theta[-1] > 1.5
    assert_allclose(0.5 * inertia.value * omega**2, 2.0 * theta, atol=1e-10)
    assert_allclose(inertia.torque(omega, alpha), 2.0, atol=1e-9)
    assert_allclose(np.stack([x, v, a]), triangle(machine, theta, omega, alpha), atol=1e-9)


@pytest.mark.slow
def test_approximate_and_printed_curves_beside_the_triangle():
    found = compare_kinematics(imposed=STEADY, until=2 * np.pi / 5, step=np.pi / 50)
    mean = found["position less its mean"].agreement("small lambda (eq. 86)")
    assert mean.greatest == pytest.approx(0.0114, abs=5e-4)  # a turn's mean, its end counted twice
    assert found["velocity"].agreement("instant centre").greatest < 1e-13
    assert "instant centre" not in found["acceleration"].curves
    printed = found["acceleration"].residual("as printed")
    theta = 5.0 * found.t
    w = np.sqrt(1 - 0.25 * np.sin(theta) ** 2)
    middle = 0.125 / 4 * np.sin(2 * theta) ** 2 / w**3 - 0.25 / 2 * np.sin(2 * theta) / w**3
    assert_allclose(printed, 25.0 * middle, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("imposed", "off"), [(HARMONIC, 0.716), (STEADY, 22.0)])
def test_torque_that_imposes_a_motion(imposed, off):
    torque = compare_torques(imposed=imposed, until=3.0 if imposed is STEADY else 10.0)["torque"]
    assert torque.agreement("bond graph").greatest < 1e-9
    slip, sound = (torque.agreement(name) for name in ("small lambda, m l²/3", "small lambda"))
    assert sound.greatest == pytest.approx(off, rel=2e-3)
    if imposed is STEADY:  # Pearson's r cannot tell the two wrong torques apart
        assert slip.pearson == pytest.approx(sound.pearson, abs=1e-12)
        assert slip.coefficient < sound.coefficient - 0.005


@pytest.mark.slow
def test_motion_that_does_not_start_at_zero():
    imposed = Imposed("theta = 1 + t²", lambda t: 1.0 + t * t, lambda t: 2.0 * t, lambda t: 2.0 + 0.0 * t)
    assert compare_torques(imposed=imposed, until=0.2, points=51)["torque"].agreement("bond graph").greatest < 1e-8


def test_table_and_names_that_are_not_there():
    found = compare_motion(until=1.0, points=20)
    lines = found.table().splitlines()
    assert lines[0] == "free motion from 1 rad/s; reference: exact Lagrange"
    assert len(lines) == 2 + 6 * 4
    assert {len(line) for line in lines[1:]} == {106}
    with pytest.raises(
        GraphError, match="no quantity 'speed': there are theta, omega, alpha, position, velocity, acceleration"
    ):
        found["speed"]
    with pytest.raises(GraphError, match="theta: no method 'newton': there are bond graph"):
        found["theta"].agreement("newton")


def test_arguments_that_mean_nothing():
    with pytest.raises(GraphError, match="points: found 1"):
        compare_torques(points=1)
    with pytest.raises(GraphError, match="until: found -1"):
        compare_motion(until=-1.0)


@pytest.mark.slow
def test_without_torque_the_printed_modulus_stops_at_the_first_dead_centre():
    found = divided_by_modulus(steps=(1e-2, 1e-3))
    assert_allclose(found.errors("|T|"), [1.12, 1.10], atol=0.01)
    assert_allclose([p.reached for p in found.passages if p.scheme == "|T|"], np.pi, atol=0.01)
    assert_allclose([p.reached for p in found.passages if p.scheme == "T, floor"], np.pi, atol=0.01)
    assert found.reached == pytest.approx(9.1352, abs=1e-4)


@pytest.mark.slow
def test_with_torque_it_runs_away_at_every_step():
    found = divided_by_modulus(loads=Loads(torque=1.0), steps=(2e-2,))
    assert found.errors("|T|") == (np.inf,)
    assert min(found.errors("T")) > 10.0
    assert min(found.errors("T, floor")) > 5.0


def test_crank_side_is_of_first_order():
    coarse, fine = divided_by_modulus(loads=Loads(1.0, 0.5, 0.2), steps=(4e-3, 2e-3), until=2.0).errors("crank side")
    assert coarse / fine == pytest.approx(2.0, rel=0.1)


def test_dead_centre_from_the_start():
    found = divided_by_modulus(start=(0.0, 1.0), steps=(1e-2,), until=1.0)
    assert found.errors("|T|") == (np.inf,)
    assert found.errors("crank side")[0] < 0.1


def test_printed_programme_tends_to_another_curve():
    steps = (1e-2, 1e-3)
    assert_allclose(printed_programme(None, HARMONIC, steps=steps), 1.32, atol=0.01)
    assert_allclose(printed_programme(None, STEADY, steps=steps), 5.616, atol=0.001)
    assert_allclose(printed_programme(None, HARMONIC, steps=steps, torque="needed"), 1.31, atol=0.02)


def test_printed_programme_on_a_dead_centre():
    (error,) = printed_programme(until=2 * np.pi, steps=(2 * np.pi / 1000,))
    assert error > 1e9


def test_schemes_that_are_not_there():
    with pytest.raises(GraphError, match="no scheme 'x': there are"):
        divided_by_modulus(steps=(0.1,)).errors("x")


def test_arguments_of_the_dead_centres_that_mean_nothing():
    with pytest.raises(GraphError, match="torque: found 'some'"):
        printed_programme(torque="some")
    with pytest.raises(GraphError, match=r"steps: found 0\.0"):
        divided_by_modulus(steps=(0.1, 0.0))
    with pytest.raises(GraphError, match="floor: found -1"):
        divided_by_modulus(floor=-1.0)
