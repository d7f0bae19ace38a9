"""Single problems from other books: Norton, Uicker, and a quiz."""

from __future__ import annotations

import pytest

from flywheel.components.press_work import inertia_for

from .common import LBF_IN, agree, inputs, of_areas, of_swing


def test_norton_11_3_areas_that_leave_a_closure() -> None:
    case = inputs("norton-11.3")
    result = of_areas(case["areas_lbf_in"], "1 lbf in", case["omega"], irregularity=case["k"])
    swing, inertia = result["energy_fluctuation"] / LBF_IN, result["flywheel"]["exact"] / LBF_IN
    agree("norton-11.3", dE_lbf_in=swing, Is_lb_in_s2=inertia, closure_lbf_in=result["closure"] * swing)


def test_uicker_18_2_disc_flywheel() -> None:
    case = inputs("uicker-18.2")
    result = of_swing(case["dU_J"], f"{case['N_rpm']} rpm", irregularity=case["Cs"])
    agree("uicker-18.2", I=result["flywheel"]["exact"])


def test_quiz_160_both_ways() -> None:
    case = inputs("quiz-160")
    result = of_swing(case["dE_J"], case["omega"], irregularity=f"{100 * case['Cs']} %")
    agree("quiz-160", I=result["flywheel"]["exact"])
    assert result["irregularity"] == pytest.approx(2 * 0.0175)


def test_quiz_160_by_formula() -> None:
    case = inputs("quiz-160")
    agree("quiz-160", I=inertia_for(case["dE_J"], case["omega"], case["Cs"]))
