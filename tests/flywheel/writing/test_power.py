"""Power with the flywheel and without it, beside what the motor is rated for."""

from __future__ import annotations

import re

import pytest

import flywheel
from flywheel.results import Sizing
from flywheel.writing import power
from tests.flywheel.regimes import SECTION_C
from tests.flywheel.scenes import rotor, yoke
from tests.flywheel.writing.test_regimes import PRESS, sized


def lines(sizing: Sizing) -> str:
    return "\n".join(power.with_and_without(sizing))


def row(text: str, name: str) -> list[float]:
    found = next(line for line in text.splitlines() if line.strip().startswith(name))
    return [float(cell) for cell in found.replace(name, "").split()]


def test_a_balanced_drive_evens_out_with_the_flywheel() -> None:
    sizing = sized(yoke())  # 1000 N against the yoke over half a turn at 60 rpm: 1000 J a turn
    text = lines(sizing)
    assert row(text, "mean, W")[1] == pytest.approx(1000)
    assert row(text, "greatest, W") == pytest.approx([1000 * 1.02, 1000 * 3.14159265], rel=1e-5)
    assert row(text, "greatest over mean")[1] == pytest.approx(3.14159265, rel=1e-5)
    assert row(text, "energy in an hour, kWh")[1] == pytest.approx(1.0)


def test_a_mean_of_nought_has_no_ratio() -> None:
    text = lines(sized(SECTION_C | {"flywheel": {"inertia": 2}}))
    assert row(text, "mean, W") == [0.0, 0.0]
    assert "greatest over mean" not in text


def test_the_motor_s_rating_stands_beside() -> None:
    text = " ".join(lines(sized(PRESS)).split())
    assert "induction motor, rated power 3 kW (19.8944 N m at 1440 rpm): mean 72.2 %" in text
    assert "too hot" not in text
    assert "stalls" not in text
    energy = sized(PRESS).energy
    assert energy is not None
    rms = re.search(r"root of its mean square over time ([0-9.]+) N m, ([0-9.]+) % of the rated one", text)
    assert rms is not None
    assert float(rms[1]) == pytest.approx(energy.rms_torque, rel=1e-5)
    assert float(rms[2]) == pytest.approx(100 * energy.rms_torque / 19.8944, rel=1e-2)
    torque = re.search(r"greatest torque ([0-9.]+) N m on its shaft, ([0-9.]+) % of the rated one, ([0-9.]+) % of the", text)
    assert torque is not None  # near 1410 rpm, where power is greatest too
    assert float(torque[3]) == pytest.approx(float(torque[2]) / 2.5, rel=0.01)
    assert float(torque[1]) == pytest.approx(energy.peak_power / (12 * 12.4), rel=0.01)


def test_too_small_a_motor_is_warned_of() -> None:
    drive = {**PRESS["drive"], "motor": {**PRESS["drive"]["motor"], "power": "1.5 kW"}}
    wheel = {"on": "motor", "irregularity": 0.15}
    text = " ".join(lines(sized(PRESS | {"drive": drive, "flywheel": wheel})).split())
    assert "more than the motor is rated for: it would grow too hot" in text
    assert "of the breakdown torque" in text


def test_motors_without_a_rating_or_a_fall_are_told_of() -> None:
    dc = {"type": "dc", "voltage": 48, "resistance": 0.5, "constant": 0.6}
    text = lines(sized(SECTION_C | {"drive": {"motor": dc}, "load": [{"on": "crank", "torque": "-5 N m"}],
                                    "flywheel": {"inertia": 2}}))  # fmt: skip
    assert "DC motor without a rated point; greatest torque" in text
    constant = rotor(drive={"motor": {"type": "constant", "torque": "50 N m"}})
    constant["load"] = [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}]
    assert "greatest torque 50 N m" in lines(sized(constant))


def test_a_motor_that_brakes_is_said_to() -> None:
    load = [{"on": "crank", "torque": "100 N m", "from": 0, "to": "180 deg"}]
    text = lines(sized(rotor(load=load)))
    mean = next(line for line in text.splitlines() if line.strip().startswith("mean, W"))
    assert mean.count("(it brakes)") == 2
    assert "-" in mean


def test_the_two_mean_powers_are_labelled() -> None:
    sizing = sized(PRESS)
    assert power.torque_and_work(sizing)[0].endswith("(power: work of a cycle over its angle, times the mean of extremes)")
    assert power.with_and_without(sizing)[0].endswith("(mean: its work over the period)")


def test_nothing_is_said_without_a_drive() -> None:
    assert power.with_and_without(sized(rotor(drive={"torque": 0}, load=[]))) == []
    areas = {"areas": {"values": [5, -5]}, "regime": {"speed": 3}, "flywheel": {"irregularity": 0.1}}
    assert power.with_and_without(flywheel.size(flywheel.load(areas))) == []
