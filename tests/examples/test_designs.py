"""The examples of best designs run, and their optima are those of other ways."""

import runpy
from math import pi
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "examples" / "designs"
pytestmark = pytest.mark.slow


def example(name):
    return runpy.run_path(str(FOLDER / f"{name}.py"), run_name="example")


def test_two_cranks_by_sweep_by_optimisation_and_by_hand():
    found = example("two_cranks")
    scene = found["flywheel"].load(FOLDER / "two_cranks.toml")
    angle, value = found["by_hand"]()
    assert found["by_sweep"](scene, 49) == (pytest.approx(angle, rel=1e-12), pytest.approx(value, rel=1e-11))
    optimum = found["by_optimisation"](scene)
    assert optimum.numbers["mechanism.1.phase"] == pytest.approx(pi, abs=1e-8)
    assert optimum.value == pytest.approx(value, rel=1e-11)
    assert optimum.confirmed


def test_a_balance_that_flattens_the_inertia():
    found = example("flat_inertia")
    least = found["best"]("flywheel.exact", 8, 1)
    assert least.confirmed
    assert least.value == pytest.approx(0.3407048527, rel=1e-8)
    assert least.numbers == {found["MASS"]: pytest.approx(3.59033, rel=1e-4), found["ROD"]: pytest.approx(0.44736, rel=1e-4)}


def test_the_lightest_motor_and_wheel_are_lighter_than_those_beside_them_that_are_fast_enough():
    found = example("lightest_drive")
    power, irregularity = found["BEST"]
    rows = [found["row"](power * a, irregularity) for a in (1.0, 1.1)] + [found["row"](power, 0.9 * irregularity)]
    both = [float(row[4]) for row in rows]
    assert both[0] == pytest.approx(71.627, abs=0.01)
    assert min(both) == both[0]
    assert float(rows[0][5]) == pytest.approx(30 * found["SLOWEST"] / pi, rel=1e-4)
