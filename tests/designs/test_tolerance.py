"""How figures spread as numbers do: extremes inside and at the ends of intervals, statistics and shares in closed form."""

import math

import numpy as np
import pytest

import flywheel

ROTOR = {
    "load": [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}],
    "drive": {"torque": "balance"},
    "regime": {"speed": 30},
    "flywheel": {"irregularity": 0.01},
}
"""Load T from 0 to b at w: power T b w/2pi, fluctuation T b (1 - b/2pi)."""


@pytest.fixture(scope="module")
def within():
    vary = {"load.0.torque": ("-110 N m", "-90 N m"), "regime.speed": (25, 35), "load.0.to": ("150 deg", "230 deg")}
    return flywheel.tolerance(flywheel.load(ROTOR), vary, figures=["power", "energy_fluctuation"], samples=64)


def test_extremes_at_corners_and_within(within):
    b, t = math.radians(230), 110.0
    assert within["power"].greatest.value == pytest.approx(t * b * 35 / math.tau, rel=1e-12)
    assert within["power"].least.at == {"load.0.torque": -90.0, "regime.speed": 25.0, "load.0.to": math.radians(150)}
    greatest = within["energy_fluctuation"].greatest
    assert greatest.value == pytest.approx(t * math.pi / 2, rel=1e-12)
    assert greatest.at["load.0.to"] == pytest.approx(math.pi, abs=1e-5)
    assert within["energy_fluctuation"].least.value == pytest.approx(90 * b * (1 - b / math.tau), rel=1e-12)


def test_no_sample_lies_outside_of_the_extremes(within):
    for name, values in within.figures.items():
        assert within[name].least.value <= values.min()
        assert values.max() <= within[name].greatest.value
    low, high = within.intervals["load.0.to"]
    assert low <= within.samples[2].min() <= within.samples[2].max() <= high


def test_statistics_and_shares_of_a_product_within_their_errors(within):
    """Of y = x1 x2 x3, independent and even: with c = V(x)/m², V(y)/E(y)² is the product of all 1 + c less 1."""
    ends = np.array([[90, 110], [25, 35], [math.radians(150), math.radians(230)]])
    c = ((ends[:, 1] - ends[:, 0]) ** 2 / 12) / ends.mean(axis=1) ** 2
    whole, power = np.prod(1 + c) - 1, within["power"]
    mean = ends.mean(axis=1).prod() / math.tau
    assert power.mean == pytest.approx(mean, abs=4 * power.mean_error)
    assert power.mean_error < 1e-4 * mean
    assert power.deviation == pytest.approx(mean * math.sqrt(whole), abs=4 * power.deviation_error)
    for k, share in enumerate(power.shares.values()):
        assert share.first == pytest.approx(c[k] / whole, abs=4 * share.first_error + 1e-6)
        total = c[k] * np.prod(np.delete(1 + c, k)) / whole
        assert share.total == pytest.approx(total, abs=4 * share.total_error + 1e-6)
        assert share.first_error < 2e-3


def test_deviations_give_quantiles_with_their_sampling_errors():
    found = flywheel.tolerance(flywheel.load(ROTOR), {"load.0.torque": 2, "regime.speed": "2 rpm"}, samples=64)
    power = found["power"]
    of_torque, of_speed = 2 / 100, 2 * math.pi / 30 / 30
    deviation = 1500 * math.sqrt(of_torque**2 + of_speed**2 + (of_torque * of_speed) ** 2)
    assert power.deviation == pytest.approx(deviation, abs=4 * power.deviation_error + 1e-9)
    for z, value, error in zip((-2.3263, -1.6449, 0.0, 1.6449, 2.3263), power.quantiles, power.quantile_errors, strict=True):
        assert value == pytest.approx(1500 + z * deviation, abs=3 * error)
    assert power.least is None
    assert found["exact"].shares["regime.speed"].first == pytest.approx(0.3277, abs=1e-3)  # exact ~ T/w²
    assert found["speed"].shares["load.0.torque"].total == pytest.approx(0.0, abs=1e-9)
    assert sum(share.first for share in power.shares.values()) == pytest.approx(1.0, abs=1e-3)
    assert found.as_dict()["numbers"]["load.0.torque"]["deviation"] == 2.0


def test_quantiles_of_designs_that_are_left_are_those_of_samples():
    found = flywheel.tolerance(flywheel.load(ROTOR), {"regime.speed": 15}, samples=64)
    assert found.refused > 0  # speeds below zero
    speeds = found.samples[0][found.samples[0] > 0.0]
    assert found["power"].quantiles == pytest.approx(np.quantile(50 * speeds, [0.01, 0.05, 0.5, 0.95, 0.99]))


@pytest.mark.slow
def test_designs_that_are_refused_are_counted():
    """An efficiency above 1 is no machine: half of a scatter about 1."""
    raw = {**ROTOR, "shafts": {"motor": {"ratio": 5, "efficiency": 0.999}}, "drive": {"on": "motor", "torque": "balance"}}
    found = flywheel.tolerance(flywheel.load(raw), {"shafts.motor.efficiency": 0.001}, figures=["power"], samples=64)
    assert found.refused == pytest.approx(0.16 * 128, abs=4)
    assert found.reason.startswith("shafts.motor.efficiency: found 1.0")
    assert 1500 < found["power"].quantiles[0] < found["power"].quantiles[-1] < 1506


@pytest.mark.parametrize(
    ("vary", "words"),
    [
        (2.5, "vary: found 2.5, expected paths, each with (low, high)"),
        ({}, "paths: found none"),
        ({"load.0.torqe": 1}, 'did you mean "load.0.torque"?'),
        ({"regime.speed": (35, 25)}, "regime.speed: found from 35 to 25, expected a low end below the high one"),
        ({"regime.speed": (25, 30, 35)}, "regime.speed: found 3 numbers"),
        ({"regime.speed": -1}, "regime.speed: found a standard deviation of -1"),
        ({"regime.speed": "1 mm"}, "expected a speed"),
        ({"regime.speed": 1, "load.0.to": (1, 2)}, "found a standard deviation beside intervals, expected all of one kind"),
    ],
)
def test_what_is_no_tolerance_is_refused(vary, words):
    with pytest.raises(flywheel.SceneError) as error:
        flywheel.tolerance(flywheel.load(ROTOR), vary)
    assert words in str(error.value)
