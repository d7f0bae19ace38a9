"""The best design: beside closed forms and sweeps, in corners, at bounds and under limits; and where there is none."""

import math

import numpy as np
import pytest

import flywheel
from flywheel.numerics.optima import minimum

ROTOR = {
    "load": [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "90 deg"}],
    "drive": {"torque": "balance"},
    "regime": {"speed": 30},
    "flywheel": {"irregularity": 0.01},
}
"""Load T from 0 to b at w: power T b w/2pi, fluctuation T b (1 - b/2pi), flywheel that over eps w²."""


def loads(*starts):
    return [{"on": "crank", "torque": -100, "from": f"{a} deg", "to": f"{a + 60} deg"} for a in starts]


@pytest.mark.slow
def test_a_limit_that_binds_beside_a_sweep_along_it():
    """Two loads whose power together is 900 W at least: along the limit none of a sweep is better."""
    scene = flywheel.load({**ROTOR, "load": loads(0, 100)})
    found = flywheel.optimize(scene, "flywheel.exact", over={"load.1.torque": (-150, -80), "load.0.torque": (-130, -90)},
                              subject_to={"power": (900, None)}, samples=16, starts=2)  # fmt: skip
    assert found.confirmed
    assert found.limits[0].binds == "low"
    assert found.figures["power"] == pytest.approx(900, rel=1e-9)
    grid = np.array([[a, -900 * 6 / 30 - a] for a in np.linspace(-130, -90, 9)])
    kept = [row for row in grid if -150 <= row[1] <= -80]
    sweep = [flywheel.size(scene.with_({"load.0.torque": a, "load.1.torque": b}), simulate=False).flywheel.exact
             for a, b in kept]  # fmt: skip
    assert found.value <= min(sweep) * (1 + 1e-9)


def test_the_least_swing_is_where_lobes_are_equal():
    """A torque of -T for 60 deg from 0, another of S from 180 deg: equal ones leave the least swing for their sum."""
    scene = flywheel.load({**ROTOR, "load": loads(0, 180)})
    found = flywheel.optimize(scene, "energy_fluctuation/power", over={"load.0.torque": (-200, -50)}, samples=8, starts=1)
    assert found.numbers["load.0.torque"] == pytest.approx(-100, rel=1e-8)
    assert found.confirmed
    assert found.unit == ""


@pytest.mark.slow
def test_an_optimum_inside_and_one_at_a_bound():
    scene = flywheel.load(ROTOR)
    over = {"load.0.to": ("60 deg", "300 deg"), "regime.speed": (20, 40)}
    found = flywheel.optimize(scene, maximize="flywheel.exact", over=over, samples=16, starts=2)
    assert found.numbers == {"load.0.to": pytest.approx(math.pi, abs=1e-5), "regime.speed": 20.0}
    assert found.value == pytest.approx(50 * math.pi / (0.01 * 400), rel=1e-11)
    assert found.at_bounds == {"regime.speed": "low"}
    assert found.messages[0] == ("at its lower bound: regime.speed = 20 rad/s, beyond which flywheel.exact rises on")
    assert abs(found.sizing.flywheel.exact - found.value) <= 2 * found.error
    assert found.best.speed == 20.0
    assert found.as_dict()["numbers"]["regime.speed"]["before"] == 30.0


@pytest.mark.slow
def test_a_wheel_whose_mass_is_least():
    """A disc of given radius: mass 2 J/R², the largest allowed radius is best."""
    wheel = {"irregularity": 0.01, "shape": "disc", "outer_radius": 0.3, "material": "cast steel"}
    scene = flywheel.load({**ROTOR, "flywheel": wheel})
    found = flywheel.optimize(scene, "flywheel.mass", over={"flywheel.outer_radius": ("0.2 m", "500 mm")}, samples=4,
                              starts=1)  # fmt: skip
    exact = 50 * math.pi * 0.75 / (0.01 * 900)
    assert found.value == pytest.approx(2 * exact / 0.25, rel=1e-9)
    assert found.unit == "kg"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"minimize": "exact", "over": {"load.0.to": (1, 2)}, "subject_to": {"power": (None, "100 W")}},
         'subject_to power: found 477.465 W at the best, where load.0.to = 1 rad, expected power <= 100 W'),
        ({"minimize": "exact", "over": {"flywheel.irregularity": (2.5, 3)}}, "no design within the bounds that is"),
        ({"minimize": "mass", "over": {"load.0.to": (1, 2)}}, "give the flywheel a shape"),
        ({"minimize": "exakt", "over": {"load.0.to": (1, 2)}}, 'did you mean "exact"?'),
        ({"minimize": "exact + ", "over": {"load.0.to": (1, 2)}}, "an expression of figures"),
        ({"minimize": "exact", "over": {"load.0.too": (1, 2)}}, 'did you mean "load.0.to"?'),
        ({"minimize": "exact", "over": {"load.0.to": (1, None)}}, "two bounds (low, high)"),
        ({"minimize": "exact", "over": {"load.0.to": (2, 1)}}, "the lower one first"),
        ({"minimize": "exact", "over": {}}, "paths: found none"),
        ({"over": {"load.0.to": (1, 2)}}, "minimize: found nothing to minimize"),
        ({"minimize": "exact", "over": {"load.0.to": (1, 2)}, "subject_to": {"power": 5}}, "limits (low, high)"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_one_line(options, words):
    with pytest.raises(flywheel.SceneError) as error:
        flywheel.optimize(flywheel.load(ROTOR), **options, samples=4, starts=1)
    assert words in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.slow
def test_an_optimum_that_does_not_exist_is_said():
    """Nothing depends on the irregularity; and the flywheel falls on to where designs are refused."""
    scene = flywheel.load(ROTOR)
    found = flywheel.optimize(scene, "power", over={"flywheel.irregularity": (0.01, 0.02)}, samples=2, starts=1)
    assert found.messages == ("no optimum: power is the same for all designs, whatever flywheel.irregularity",)
    found = flywheel.optimize(scene, "exact", over={"flywheel.irregularity": (0.5, 3)}, samples=4, starts=1)
    assert found.messages[-1].startswith("no optimum within the bounds: the best ends at flywheel.irregularity = 2")


def test_least_values_of_functions_with_corners():
    calls = []

    def lobes(x):
        calls.append(x.shape[1])
        return np.array([np.abs(x[0] - 0.3) + 3 * np.abs(x[1] - 0.7 * x[0]) + x[1] ** 2, 0.1 - x[0]])

    low, high = np.zeros(2), np.ones(2)
    assert minimum(lobes, np.array([0.2, 0.9]), low, high, high) == pytest.approx([0.3, 0.21], abs=1e-9)
    assert sum(calls) < 1000
