"""Shafts in series, shot at step by step, against what is known in closed form and against the other oracle."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.oracle import regimes
from tests.oracle.drive_lines import DriveLine
from tests.oracle.machine import Machine
from tests.oracle.numbers import Real

PRESS = {
    "shafts": {"motor": {"ratio": 8, "efficiency": 0.94}, "fan": {"ratio": 3, "efficiency": 0.9}},
    "mechanism": {
        "type": "slider-crank",
        "crank": {"length": 0.1, "mass": 5, "inertia": 0.1, "com": 0.02},
        "rod": {"length": 0.45, "mass": 10, "inertia": 0.3, "com": 0.2},
        "slider": {"mass": 40, "offset": 0.02},
    },
    "gravity": {},
    "inertia": [{"on": "motor", "value": 0.05}, {"on": "fan", "value": 0.1}],
    "load": [
        {"on": "slider", "force": "-8 kN", "from": "290 deg", "to": "350 deg"},
        {"on": "slider", "force": "-200 N", "while": "v > 0"},
        {"on": "fan", "torque": "-0.01*omega*abs(omega)"},
    ],
    "drive": {"on": "motor", "torque": "60 - 0.4*omega"},
    "flywheel": {"on": "motor", "inertia": 0.3},
}


def test_steady_train_by_hand() -> None:
    """Under constant torques everything is a product: 0.96 * 0.98 of a belt that slips 2 %, then 0.97 of a gear."""
    scene = {
        "shafts": {
            "wheel": {"ratio": 5.0, "efficiency": 0.97, "drag": 3.0},
            "motor": {"on": "wheel", "ratio": 3.0, "efficiency": 0.96, "slip": 0.02},
        },
        "inertia": [{"on": "crank", "value": 10.0}],
        "load": [{"on": "crank", "torque": -500.0}],
        "drive": {"on": "motor", "torque": "balance"},
        "regime": {"speed": 8.0},
    }
    found = DriveLine(scene).analysed(1.0)
    on_wheel = 500.0 / 5.0 / 0.97 + 3.0
    assert found.unknown == pytest.approx(on_wheel / 3.0 / 0.96, rel=1e-12)  # slip costs speed, not torque
    assert found.mean_power == pytest.approx(on_wheel * 40.0 / 0.96 / 0.98, rel=1e-12)
    assert found.flows["motor"].lost == pytest.approx(found.mean_power * (1 - 0.96 * 0.98), rel=1e-12)
    assert found.works["drag wheel"] == pytest.approx(-3.0 * 5.0 * math.tau, rel=1e-12)


@pytest.mark.slow
def test_two_meshes_on_the_crank_as_by_collocation() -> None:
    found, machine = DriveLine(PRESS).analysed(0.3), Machine(PRESS)
    held = regimes.Held(Real(0.3) * 64, None, None)
    guess = regimes.Guess(Real(found.speed), held.inertia, Real(0), lambda phi: np.full(phi.shape, 1.001 * found.speed))
    with np.errstate(all="ignore"):
        other = regimes.found(machine, held, guess)
    high, low = other.excess
    assert found.speed_max == pytest.approx(float(other.w * (1 + high)), rel=1e-12)
    assert found.speed_min == pytest.approx(float(other.w * (1 + low)), rel=1e-12)


@pytest.mark.slow
def test_power_of_a_train_closes() -> None:
    """Work of drive, loads, drag and what belts and gears lose make nothing over a cycle, far from a steady train."""
    shafts = {
        "wheel": {"ratio": 4.0, "efficiency": 0.9, "drag": 2.0},
        "motor": {"on": "wheel", "ratio": 2.0, "efficiency": 0.95, "slip": 0.03},
        "fan": {"on": "wheel", "ratio": 1.5, "slip": 0.01},
    }
    found = DriveLine(PRESS | {"shafts": shafts, "flywheel": {"on": "wheel"}}).analysed(2.0)
    lost = sum(flow.lost for flow in found.flows.values()) * found.period
    assert sum(found.works.values()) == pytest.approx(lost, rel=1e-11)
