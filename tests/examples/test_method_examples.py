"""The examples of methods run, and what they print is true: root finding counted, the two-link arm."""

from __future__ import annotations

import runpy
from math import pi
from pathlib import Path

import matplotlib as mpl
import pytest
from mpmath import mp

mpl.use("Agg")

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module")
def roots():
    return runpy.run_path(str(EXAMPLES / "root_finding" / "positions.py"), run_name="example")


@pytest.mark.parametrize("a4", [-60.0, 40.0, 190.0, 222.0])
def test_three_methods_find_the_root_of_30_digits(roots, a4):
    f, _, beta = roots["loop"](a4)
    with mp.workdps(30):
        d = mp.hypot(a4, 140)
        angle = mp.acos((d**2 + mp.mpf(167.63) ** 2 - 95**2) / (2 * d * mp.mpf(167.63)))
        true = mp.atan2(140, -a4) + angle
    assert roots["exact"](a4) == pytest.approx(float(true), abs=1e-13)
    bisected, regula, newton = roots["compare"](a4)
    assert bisected.root == pytest.approx(float(true), abs=1e-8)
    assert newton.root == pytest.approx(float(true), abs=1e-13)
    assert regula.root == pytest.approx(float(true), abs=1e-6 if a4 > 200 else 1e-8)
    assert bisected.count == 29  # pi/2^29 is the first step below 1e-8
    assert newton.count < regula.count <= (bisected.count if a4 < 200 else 300)
    assert f(beta) < 0 < f(beta + pi)


def test_the_clamps_printed_angle_at_full_stretch(roots):
    """theta2 = 2.83967 and theta3 = 1.89156 go with the printed theta6 = 0 and s = 480 mm."""
    root = roots["compare"](190.0)[2].root
    assert root == pytest.approx(2.83967, abs=5e-6)
    assert roots["third"](190.0, root) == pytest.approx(1.89156, abs=5e-6)


def test_newton_squares_its_error(roots):
    f, slope, beta = roots["loop"](190.0)
    root = roots["exact"](190.0)
    ratios = [ratio for _, ratio in roots["squares"](roots["newton"](f, slope, beta + 2.0).path, root)]
    bend = 2 * 167.63 * (-190.0 * mp.cos(root) + 140 * mp.sin(root))
    assert len(ratios) >= 4
    assert ratios[-1] == pytest.approx(float(abs(bend / (2 * slope(root)))), rel=1e-3)


def test_methods_refuse_what_they_cannot_do(roots):
    with pytest.raises(ValueError, match="no bracket"):
        roots["bisection"](lambda x: x * x + 1, 0.0, 1.0)
    with pytest.raises(ArithmeticError, match="level"):
        roots["newton"](lambda x: x * x + 1, lambda x: 2 * x, 0.0)
    with pytest.raises(ArithmeticError, match="no root within 1000 steps"):
        roots["newton"](lambda x: x * x + 1, lambda x: 2 * x, 0.7)
    assert roots["bisection"](lambda x: x, -1.0, 1.0).root == 0.0


def test_the_printed_table(roots, capsys):
    roots["main"]()
    printed = capsys.readouterr().out
    assert printed.count("    29 ") >= 7
    assert "Newton: each error 0.5000 of the last" in printed
    assert printed.count("the other one") == 2
    assert "1.761422 rad, the other assembly's 0.570387 rad" in printed


@pytest.mark.slow
def test_two_motors_bring_the_circle_about(tmp_path, capsys):
    example = runpy.run_path(str(EXAMPLES / "robot" / "five_bar.py"), run_name="example")
    picture = tmp_path / "five_bar.png"
    example["main"](picture)
    printed = capsys.readouterr().out

    def figure(after: str) -> float:
        return float(printed.partition(after)[2].split()[0].rstrip(",;"))

    assert figure("virtual powers and Newton-Euler differ by ") < 1e-13
    assert figure("followed by simulation to ") < 1e-8
    assert figure("work of the motors against energy: ") < 1e-8
    assert figure("kept to ") < 1e-9
    assert "torques: left 4.8010 N m, right 4.8010 N m" in printed  # alike by symmetry
    assert picture.stat().st_size > 10_000


@pytest.mark.slow
def test_the_arm_keeps_its_energy_and_its_plan(tmp_path, capsys):
    example = runpy.run_path(str(EXAMPLES / "robot" / "two_link.py"), run_name="example")
    picture = tmp_path / "arm.png"
    example["main"](picture)
    printed = capsys.readouterr().out
    assert "c2*l1*m2*sin(q1(t) - q2(t))*Derivative(q2(t), t)**2" in printed
    kept = float(printed.partition("energy kept to ")[2].split()[0])
    followed = float(printed.partition("simulation to ")[2].split()[0])
    assert kept < 1e-9
    assert followed < 1e-8
    work, gained = (float(printed.partition(key)[2].split()[0]) for key in ("work of the torques ", "energy gained "))
    assert work == pytest.approx(gained, abs=2e-6)
    assert picture.stat().st_size > 10_000
