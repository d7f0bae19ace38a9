"""Derivatives of figures by the numbers of a scene, beside 30-digit ones and closed forms, and the reasons for none."""

import math
from itertools import pairwise

import mpmath
import numpy as np
import pytest

import flywheel
from flywheel.numerics.differences import gradient, slopes

YOKE = {
    "mechanism": {"type": "scotch-yoke", "crank": {"length": 0.5}, "yoke": {"mass": 20}},
    "load": [{"on": "yoke", "force": 1000, "from": 0, "to": "180 deg"}],
    "drive": {"torque": "balance"},
    "regime": {"speed": "60 rpm"},
    "flywheel": {"irregularity": 0.04},
}
ROTOR = {
    "load": [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}],
    "drive": {"torque": "balance"},
    "regime": {"speed": 30},
    "flywheel": {"irregularity": 0.01},
}


def yoke_by_hand(radius, mass, force, speed, eps):
    """The exact flywheel of the yoke: M = FR/pi less FR sin(phi) to 180 deg, I* = m R² sin²(phi)."""
    even = force * radius / mpmath.pi

    def excess(phi, z):
        work = even * phi - force * radius * (1 - mpmath.cos(phi) if phi < mpmath.pi else 2)
        return work - z * speed**2 / 2 * mass * radius**2 * mpmath.sin(phi) ** 2

    def slope(phi, z):
        moment = even - (force * radius * mpmath.sin(phi) if phi < mpmath.pi else 0)
        return moment - z * speed**2 / 2 * mass * radius**2 * mpmath.sin(2 * phi)

    def extremes(z):
        grid = [2 * mpmath.pi * k / 60 for k in range(61)]
        at = [mpmath.findroot(lambda phi: slope(phi, z), (a, b), solver="anderson")
              for a, b in pairwise(grid) if slope(a, z) * slope(b, z) < 0]  # fmt: skip
        return [excess(phi, z) for phi in (*at, mpmath.mpf(0), mpmath.pi, 2 * mpmath.pi)]

    fast, slow = (1 + eps / 2) ** 2, (1 - eps / 2) ** 2
    return (max(extremes(fast)) - min(extremes(slow))) / (eps * speed**2)


def test_derivatives_of_the_exact_flywheel_beside_30_digits():
    paths = ["mechanism.crank.length", "mechanism.yoke.mass", "load.0.force", "regime.speed", "flywheel.irregularity"]
    found = flywheel.sensitivities(flywheel.load(YOKE), paths, figures=["flywheel.exact"])
    with mpmath.workdps(30):
        at = [mpmath.mpf(found.numbers[path]) for path in paths]
        assert found.values["exact"] == pytest.approx(float(yoke_by_hand(*at)), rel=1e-12)
        for k, path in enumerate(paths):
            order = tuple(int(i == k) for i in range(len(paths)))
            true = mpmath.diff(yoke_by_hand, tuple(at), order)
            derivative = found.derivative("exact", path)
            assert abs(derivative.value - true) < min(derivative.error, 1e-8 * abs(true))
            assert derivative.left == derivative.right == derivative.value


def test_derivatives_of_a_window_in_closed_form():
    """Load T from 0 to b: fluctuation T b (1 - b/2pi), power T b w/2pi, both 0 where nothing depends on a number."""
    found = flywheel.sensitivities(flywheel.load(ROTOR), ["load[0].to", "flywheel.irregularity", "load.0.torque"])
    w, b = 30.0, math.pi
    exact = 100 * b * (1 - b / math.tau) / (0.01 * w**2)
    assert found.derivative("power", "load.0.to").value == pytest.approx(100 * w / math.tau, rel=1e-8)
    assert found.derivative("exact", "load.0.to").value == pytest.approx(0.0, abs=1e-8 * exact)
    assert found.derivative("exact", "load.0.torque").value == pytest.approx(-exact / 100, rel=1e-8)
    power = found.derivative("power", "flywheel.irregularity")
    assert abs(power.value) <= power.error < 1e-5
    assert found.elasticity("flywheel.exact", "flywheel.irregularity") == pytest.approx(-1.0, rel=1e-8)
    assert math.isnan(found.elasticity("angle_speed_max", "load.0.to"))  # of a figure that is 0


def test_the_slopes_of_two_equal_lobes_are_given_with_the_reason():
    """Two equal loads: with the first larger by d the fluctuation grows by 0.75 d pi/2, smaller by d by 0.25 d pi/2."""
    loads = [{"on": "crank", "torque": -100, "from": f"{a} deg", "to": f"{a + 90} deg"} for a in (0, 180)]
    found = flywheel.sensitivities(flywheel.load({**ROTOR, "load": loads}), "load.0.torque")
    lobes = found.derivative("energy_fluctuation", "load.0.torque")
    assert math.isnan(lobes.value)
    assert lobes.left == pytest.approx(-0.75 * math.pi / 2, rel=1e-8)
    assert lobes.right == pytest.approx(0.25 * math.pi / 2, rel=1e-8)
    assert lobes.reason.startswith("two greatest values of W are equal, at ")
    angle = found.derivative("angle_speed_min", "load.0.torque")
    assert math.isnan(angle.value)
    assert "equal" in angle.reason
    assert not found.derivative("power", "load.0.torque").reason


@pytest.mark.slow
def test_a_lobe_that_takes_over_nearby_is_not_in_the_derivative():
    """With the first load larger by a ten-thousandth its own slope holds, and steps are smaller than that."""
    loads = [{"on": "crank", "torque": t, "from": f"{a} deg", "to": f"{a + 90} deg"} for a, t in ((0, -100.01), (180, -100))]
    found = flywheel.sensitivities(flywheel.load({**ROTOR, "load": loads}), "load.0.torque")
    assert found.derivative("energy_fluctuation", "load.0.torque").value == pytest.approx(-0.75 * math.pi / 2, rel=1e-8)


@pytest.mark.slow
def test_where_a_flywheel_stops_being_needed_both_slopes_are_given():
    """The machine's own inertia is what is asked for: less of it is missing one to one, more of it changes nothing."""
    whole = 50 * math.pi / (0.01 * 30**2)
    scene = flywheel.load({**ROTOR, "inertia": [{"on": "crank", "value": whole}]})
    flips = flywheel.sensitivities(scene, ["inertia.0.value"]).derivative("exact", "inertia.0.value")
    assert math.isnan(flips.value)
    assert (flips.left, flips.right) == (pytest.approx(-1.0, rel=1e-7), pytest.approx(0.0, abs=1e-7))
    assert flips.reason == "the flywheel is needed on one side alone"


@pytest.mark.slow
def test_a_number_at_the_end_of_its_range_has_the_slope_of_one_side():
    """Crank and motor shaft without losses: an efficiency above 1 is refused."""
    raw = {**ROTOR, "shafts": {"motor": {"ratio": 5, "efficiency": 1}}, "drive": {"on": "motor", "torque": "balance"}}
    found = flywheel.sensitivities(flywheel.load(raw), ["shafts.motor.efficiency"])
    power = found.derivative("power", "shafts.motor.efficiency")
    assert math.isnan(power.value)
    assert math.isnan(power.right)
    assert power.left == pytest.approx(-1500.0, rel=1e-7)
    assert power.reason.startswith("refused above: shafts.motor.efficiency: found 1.000001")


def test_faults_name_the_nearest():
    scene = flywheel.load(ROTOR)
    for call, words in (
        ({"paths": "load.0.torqe"}, 'load.0.torqe: found no number of the scene, expected the path of one; did you mean "load.0.torque"?'),  # noqa: E501
        ({"paths": ()}, "paths: found none, expected paths of numbers"),
        ({"figures": ["exakt"]}, 'figures: found "exakt", expected a figure; did you mean "exact"?'),
        ({"figures": ["mass"]}, "mass: found no figure of this scene"),
        ({"engine": "nunba"}, 'did you mean "numba"?'),
    ):  # fmt: skip
        with pytest.raises(flywheel.SceneError) as error:
            flywheel.sensitivities(scene, **call)
        assert words in str(error.value)


@pytest.mark.slow
def test_all_numbers_are_taken_where_none_is_named_and_the_record_is_plain():
    found = flywheel.sensitivities(flywheel.load(ROTOR), figures=["exact"])
    assert list(found.numbers) == ["load.0.torque", "load.0.from", "load.0.to", "regime.speed", "flywheel.irregularity"]
    data = found.as_dict()["figures"]["exact"]["derivatives"]["regime.speed"]
    assert data["elasticity"] == pytest.approx(-2.0, rel=1e-8)
    assert repr(found) == "Sensitivities(1 figures by 5 numbers)"


def test_corners_jumps_and_poles_of_functions():
    def values(x):
        a, b = x
        parts = [np.exp(a) * np.sin(b), np.maximum(a - 1.0, 0.0) + a**3, np.where(a < 1.0, 0.0, 1.0) + b, 1 / (1.02 - a)]
        return np.stack(parts), 1e-15 * np.ones((4, a.size))

    found = slopes(values, np.array([1.0, 2.0]), np.array([1.0, 2.0]))
    assert found.both[0] == pytest.approx([math.e * math.sin(2), math.e * math.cos(2)], rel=1e-9)
    assert (found.left[1, 0], found.right[1, 0]) == (pytest.approx(3.0, rel=1e-8), pytest.approx(4.0, rel=1e-8))
    assert found.corner.tolist() == [[False, False], [True, False], [False, False], [False, False]]
    assert found.jump.tolist() == [[False, False], [False, False], [True, False], [False, False]]
    assert abs(found.both[3, 0] - 2500.0) < found.error[3, 0] < 1e-6
    assert found.both[2, 1] == pytest.approx(1.0, rel=1e-9)
    assert gradient(values, np.array([1.0, 2.0]), np.ones(2))[1][0] == pytest.approx(found.both[0], rel=1e-7)
