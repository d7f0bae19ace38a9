"""The iterated dimensioning agrees with itself: sections, masses and reactions of its last round belong together."""

from __future__ import annotations

import runpy
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import numpy as np
import pytest

SCRIPT = Path(__file__).parents[2] / "examples" / "joint_forces" / "dimensioning.py"


@pytest.fixture(scope="module")
def run():
    """Its names, and what it prints, run as it stands."""
    with redirect_stdout(StringIO()) as printed:
        return runpy.run_path(str(SCRIPT), run_name="__main__"), printed.getvalue


@pytest.fixture(scope="module")
def example(run):
    return run[0]


@pytest.fixture(scope="module")
def rounds(example):
    return example["rounds"]


def test_every_bar_is_used_to_its_limit(example, rounds):
    sides = rounds[-1].sides
    found = example["analysed"](sides)
    for name, side in sides.items():
        normal, moment = example["strained"](found, name, example["DENSITY"] * side**2)
        use = (
            example["stress"](normal, moment, side) / example["ALLOWABLE"],
            example["thrust"](normal, side, example["LENGTHS"][name]),
        )
        assert max(use) == pytest.approx(1.0, abs=3e-6), name


@pytest.mark.slow
def test_it_ends_at_the_same_bars_from_thick_ones(example, rounds):
    other = example["dimensioned"](dict.fromkeys(example["LENGTHS"], 0.02))
    for name, mass in rounds[-1].masses.items():
        assert other[-1].masses[name] == pytest.approx(mass, rel=1e-5)
    assert len(rounds) >= 5
    assert rounds[-1].masses["crank"] > 1.05 * rounds[0].masses["crank"]


def test_bending_at_the_bars_first_pins_is_the_torque_there(example, rounds):
    """What is summed from the far end arrives at the driving torque, at nothing in the coupler, and at the load."""
    sides = rounds[-1].sides
    found = example["analysed"](sides)
    torques = {"crank": -found.action, "coupler": 0.0 * found.action, "rocker": -example["against"](found.poses)}
    joints = {"crank": ("pivot", 1.0), "coupler": ("crank_pin", 1.0), "rocker": ("rocker_pivot", 1.0)}
    for name, side in sides.items():
        normal, moment = example["strained"](found, name, example["DENSITY"] * side**2)
        np.testing.assert_allclose(moment[0], torques[name], rtol=0, atol=1e-9 * 120)
        joint, sign = joints[name]
        axis = np.exp(1j * found.poses.angle(name).value)
        held = -sign * ((found.forces[joint][0] + 1j * found.forces[joint][1]) / axis).real
        np.testing.assert_allclose(normal[0], held, rtol=0, atol=1e-9 * np.abs(held).max())


def test_it_prints_its_rounds(run):
    printed = run[1]()
    assert "coupler (mm, kg)" in printed
    assert printed.count(" % of the thrust allowed") == 3
