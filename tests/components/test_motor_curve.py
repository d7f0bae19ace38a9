"""Curves of rows: between them numpy's and SciPy's interpolation, beyond them straight on."""

import math

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from flywheel.components.motors import Curve
from flywheel.numerics.faults import SceneError

SPEEDS = (0.0, 60.0, 100.0, 130.0, 150.0)
TORQUES = (20.0, 18.0, 30.0, 24.0, -5.0)


def curve(speeds=SPEEDS, torques=TORQUES, **kwargs) -> Curve:
    return Curve(speeds=tuple(speeds), torques=tuple(torques), **kwargs)


def test_linear_between_the_rows():
    inside = np.linspace(0.0, 150.0, 977)
    np.testing.assert_allclose(curve().torque(inside), np.interp(inside, SPEEDS, TORQUES), rtol=1e-13, atol=1e-13)
    np.testing.assert_array_equal(curve().torque(SPEEDS[:-1]), TORQUES[:-1])


def test_pchip_between_the_rows():
    inside = np.linspace(0.0, 150.0, 977)
    motor = curve(interpolation="pchip")
    np.testing.assert_allclose(motor.torque(inside), PchipInterpolator(SPEEDS, TORQUES)(inside), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("interpolation", ["linear", "pchip"])
def test_straight_on_beyond_the_rows(interpolation):
    motor = curve(interpolation=interpolation)
    for start, side in ((0.0, -1.0), (150.0, 1.0)):
        slope = motor.slope_at(start + 1e-9 * -side)
        far = start + side * np.array([1.0, 20.0, 300.0])
        np.testing.assert_allclose(motor.torque(far), motor.torque(start) + slope * (far - start), rtol=1e-7)
        np.testing.assert_allclose(np.diff(motor.slope_at(far)), 0.0, atol=1e-14)


def test_many_rows_make_a_shallow_tree():
    speeds = np.linspace(0.0, 157.0, 200)
    torques = 30 + 10 * np.sin(speeds / 20) - (speeds / 100) ** 4 * 6
    motor = curve(speeds, torques)
    probe = np.linspace(0.0, 157.0, 1001)
    np.testing.assert_allclose(motor.torque(probe), np.interp(probe, speeds, torques), rtol=1e-12)

    def depth(node) -> int:
        return 1 + max((depth(arg) for arg in node.args), default=0)

    assert depth(motor.law().tree) <= 14
    assert len(motor.law().switches()) == 198


@pytest.mark.parametrize(
    ("torques", "interpolation", "expected"),
    [
        ((20.0, 18.0, 30.0, 24.0, 6.0), "linear", 150 + 20 / 3),
        ((20.0, 18.0, 30.0, 24.0, 0.0), "linear", 150.0),
        ((20.0, 18.0, 30.0, 0.0, -4.0), "linear", 130.0),
        ((20.0, -18.0, 30.0, -6.0, -7.0), "linear", 125.0),
        ((20.0, 18.0, 30.0, 24.0, 26.0), "linear", None),
        ((20.0, 18.0, 30.0, 24.0, 24.0), "pchip", None),
    ],
)
def test_no_load_speed(torques, interpolation, expected):
    found = curve(torques=torques, interpolation=interpolation).no_load_speed
    assert found is expected is None or found == pytest.approx(expected, rel=1e-14)


def test_no_load_speed_of_cubics():
    motor = curve(interpolation="pchip")
    (root,) = (r for r in PchipInterpolator(SPEEDS, TORQUES).roots(extrapolate=False))
    assert motor.no_load_speed == pytest.approx(root, rel=1e-13)
    beyond = curve(torques=(20.0, 18.0, 30.0, 24.0, 6.0), interpolation="pchip")
    slope = PchipInterpolator(SPEEDS, (20.0, 18.0, 30.0, 24.0, 6.0))(150.0, 1)
    assert beyond.no_load_speed == pytest.approx(150.0 - 6.0 / slope, rel=1e-13)


@pytest.mark.parametrize(
    ("torques", "interpolation", "expected"),
    [
        (TORQUES, "linear", (100.0, math.inf)),
        ((20.0, 18.0, 10.0, 4.0, 0.0), "linear", (-math.inf, math.inf)),
        ((20.0, 18.0, 30.0, 24.0, 26.0), "linear", (100.0, 130.0)),
        ((20.0, 21.0, 30.0, -5.0, 8.0), "linear", (100.0, 130.0)),
        ((20.0, 21.0, 30.0, -5.0, -5.0), "linear", (100.0, 130.0)),
        ((20.0, 18.0, 30.0, 5.0, -0.0), "pchip", (100.0, math.inf)),
        ((20.0, 20.0, 18.0, 9.0, 8.0), "pchip", (60.0, 150.0)),  # pchip ends flat there
        ((1.0, 2.0, 3.0, 3.0, 4.0), "linear", None),
    ],
)
def test_running_branch(torques, interpolation, expected):
    assert curve(torques=torques, interpolation=interpolation).stable == expected


def test_a_torque_that_never_falls_finds_no_speed():
    assert curve(torques=(1.0, 2.0, 3.0, 3.0, 4.0)).speed_at(2.0) is None
    assert curve(torques=(20.0, 18.0, 30.0, 24.0, 26.0)).speed_at(5.0) is None


@pytest.mark.parametrize(
    ("change", "path", "hint"),
    [
        ({"speeds": (0.0, 60.0, 60.0, 130.0, 150.0)}, "speed[2]", "ascend"),
        ({"speeds": (0.0, 60.0, 50.0, 130.0, 150.0)}, "speed[2]", "50 rad/s after 60 rad/s"),
        ({"speeds": (0.0, 60.0)}, "torque", "2 speeds and 5 torques"),
        ({"speeds": (0.0, math.nan, 1.0, 2.0, 3.0)}, "speed[1]", "finite"),
        ({"speeds": (0.0,), "torques": (1.0,)}, "speed", "2 to 200"),
        ({"torques": (0.0, -1.0, -2.0, -3.0, -4.0)}, "torque", "above 0"),
        ({"interpolation": "pchipp"}, "interpolation", 'did you mean "pchip"?'),
    ],
)
def test_rows_that_make_no_curve(change, path, hint):
    with pytest.raises(SceneError) as caught:
        curve(**change)
    (fault,) = caught.value.faults
    assert fault.path == path
    assert hint in str(fault)
