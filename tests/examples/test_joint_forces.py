"""The iterated dimensioning agrees with itself: sections, masses and reactions of its last round belong together."""

from __future__ import annotations

import runpy
import sys
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


@pytest.mark.slow
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


CLAMP = Path(__file__).parents[2] / "examples" / "joint_forces" / "injection_clamp.py"
STROKE = Path(__file__).parents[2] / "examples" / "machines" / "injection_clamp.py"


@pytest.fixture(scope="module")
def clamp():
    return runpy.run_path(str(CLAMP), run_name="example")


@pytest.fixture(scope="module")
def stroke():
    return runpy.run_path(str(STROKE), run_name="example")


def test_the_clamps_reactions_are_those_of_13_equations_by_hand(clamp):
    a4 = np.array([-60.0, -36.0, 14.0, 82.0, 130.0, 190.0])
    ours, by_hand = clamp["by_library"](a4), clamp["by_newton"](clamp["Clamp"](), a4)
    for joint, force in by_hand.items():
        np.testing.assert_allclose(ours[joint], force, rtol=0, atol=1e-10 * np.abs(force).max(), err_msg=joint)


def test_the_sources_differences_are_averaged_again(clamp):
    means = [clamp["told"](joint)[1].mean() for joint in clamp["JOINTS"]]
    assert means == pytest.approx([5.86, 8.36, 11.69, 17.66, 3.12], abs=0.005)
    assert [clamp["told"](joint)[0].size for joint in clamp["JOINTS"]] == [27, 27, 25, 27, 27]
    assert max(clamp["told"](joint)[1].max() for joint in clamp["JOINTS"]) == pytest.approx(66.997, abs=1e-3)


@pytest.mark.slow
def test_the_clamps_table_and_figures_without_the_other_program(clamp, tmp_path, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "exudyn", None)
    clamp["main"](str(tmp_path / "clamp.png"))
    printed = capsys.readouterr().out
    assert "a3       17.65   17.66   62.51 (102)" in printed
    assert printed.count("-53") == 3
    assert "Exudyn is not installed: its column is left out" in printed
    assert {path.stem for path in tmp_path.glob("*.png")} == {f"clamp_{n}" for n in ("together", "singly", "differences")}


@pytest.mark.slow
def test_the_clamps_reactions_by_another_program(clamp):
    pytest.importorskip("exudyn")
    a4 = np.arange(-50.0, 191.0, 20.0)
    by_hand = clamp["by_newton"](clamp["Clamp"](), a4)
    stepped = clamp["by_exudyn"](clamp["Clamp"](), a4)
    for joint, force in by_hand.items():
        np.testing.assert_allclose(stepped[joint], force, rtol=0, atol=2e-6 * np.abs(force).max(), err_msg=joint)


def test_the_clamps_motion_is_that_of_its_loops_by_hand(clamp, stroke):
    a4 = np.array([-60.0, 40.0, 190.0])
    links, centres = stroke["course"](a4)
    for k, x in enumerate(a4):
        at = clamp["place"](clamp["Clamp"](), 1e-3 * x)
        names = ("theta3", "theta2", "theta6")
        assert [links[name].velocity[k] for name in names] == pytest.approx(at.rates, abs=1e-10)
        assert [links[name].acceleration[k] for name in names] == pytest.approx(at.alphas, abs=1e-9)
        for curve, centre in zip(centres.values(), at.centres, strict=True):
            assert 1e-3 * curve.acceleration[:, k] == pytest.approx([centre.real, centre.imag], abs=1e-10)
        assert links["s"].position[k] == pytest.approx(1e3 * at.platen.real, abs=1e-9)


def test_the_clamps_read_out_has_two_misprints(stroke, capsys):
    stroke["main"]()
    printed = capsys.readouterr().out
    wrong = [line.split() for line in printed.splitlines() if "MISPRINT" in line]
    assert [(line[0], line[-1]) for line in wrong] == [("theta2", "-0.0037"), ("theta5", "-0.0193")]
    assert printed.count("  cut off") == 4
    assert "-344.800 and -943.597, the other sign" in printed


@pytest.mark.slow
def test_the_clamps_motion_is_drawn(stroke, tmp_path):
    stroke["plot"](tmp_path / "clamp.png")
    assert len(list(tmp_path.glob("clamp_*.png"))) == 4
