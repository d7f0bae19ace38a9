"""Power with the flywheel and without it, beside what the motor is rated for."""

from __future__ import annotations

import re

import pytest

from flywheel.sizing.results import Sizing
from flywheel.tables import power as figures
from tests.regimes import SECTION_C
from tests.scenes import rotor, yoke
from tests.tables.test_regimes import PRESS, sized

RPM = 0.10471975511965977  # rad/s


def lines(sizing: Sizing) -> str:
    return "\n".join(figures.with_and_without(sizing))


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
    assert "too hot for continuous running. Choose a larger motor: even at a constant speed it would be" in text
    assert "of the breakdown torque" in text


def test_motors_without_a_rating_or_a_fall_are_told_of() -> None:
    dc = {"type": "dc", "voltage": 48, "resistance": 0.5, "constant": 0.6}
    text = lines(sized(SECTION_C | {"drive": {"motor": dc}, "load": [{"on": "crank", "torque": "-5 N m"}],
                                    "flywheel": {"inertia": 2}}))  # fmt: skip
    assert "DC motor without a rated point; greatest torque" in text
    assert "Copper heat of its armature" in text
    assert "not known without a rated point" in " ".join(text.split())
    constant = rotor(drive={"motor": {"type": "constant", "torque": "50 N m"}})
    constant["load"] = [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}]
    text = lines(sized(constant))
    assert "greatest torque 50 N m" in text
    assert "rated" not in text.replace("without a rated point", "")
    assert "does not tell what heats it" in text


def test_a_motor_that_brakes_is_said_to() -> None:
    load = [{"on": "crank", "torque": "100 N m", "from": 0, "to": "180 deg"}]
    text = lines(sized(rotor(load=load)))
    mean = next(line for line in text.splitlines() if line.strip().startswith("mean, W"))
    assert mean.count("(it brakes)") == 2
    assert "-" in mean


def press(power_: str, rpm: str, wheel: dict[str, object], ratio: float = 2.5) -> dict[str, object]:
    """The press on another induction motor."""
    motor = {**PRESS["drive"]["motor"], "power": power_, "speed": rpm, "breakdown_ratio": ratio}
    return PRESS | {"drive": {"on": "motor", "motor": motor}, "flywheel": {"on": "motor", **wheel}}


def test_a_motor_whose_torque_is_within_its_rating_may_have_too_much_heat() -> None:
    """Torque by its root mean square does not heat a rotor: slip does, and that grows more than torque does."""
    sizing = sized(press("2.6 kW", "1300 rpm", {"inertia": 0.09}, 1.6))
    energy = sizing.energy
    assert energy is not None
    assert energy.rotor_heat_share is not None
    rated = 2600 / (1300 * RPM)
    assert energy.rms_torque < rated
    assert energy.rotor_heat_share > 1.2
    text = " ".join(lines(sizing).split())
    rotor_heat = re.search(r"Heat of its rotor, .*? ([0-9.]+) W, ([0-9.]+) % of the ([0-9.]+) W at the rated point", text)
    assert rotor_heat is not None
    assert float(rotor_heat[1]) == pytest.approx(energy.rotor_heat, rel=1e-4)
    assert float(rotor_heat[2]) == pytest.approx(100 * energy.rotor_heat_share, rel=1e-3)
    assert float(rotor_heat[3]) == pytest.approx(rated * 200 * RPM, rel=1e-4)
    assert "too hot for continuous running. Choose a larger motor, or more flywheel: at a constant speed" in text


def test_more_flywheel_cures_what_it_is_said_to_cure() -> None:
    heavy = sized(press("2.6 kW", "1300 rpm", {"inertia": 50.0}, 1.6))
    text = " ".join(lines(sized(press("2.6 kW", "1300 rpm", {"inertia": 0.09}, 1.6))).split())
    told = re.search(r"at a constant speed it would be ([0-9.]+) %", text)
    assert told is not None
    assert heavy.energy is not None
    assert float(told[1]) == pytest.approx(100 * (heavy.energy.rotor_heat_share or 0.0), rel=5e-3)
    assert "within what it is rated for" in " ".join(lines(heavy).split())


def test_an_induction_motor_past_its_breakdown_is_told_of() -> None:
    text = " ".join(lines(sized(press("1.5 kW", "1440 rpm", {"irregularity": 0.25}))).split())
    assert "past the breakdown torque, 24.868 N m at 1212.52 rpm" in text
    assert "is rough there" in text


DC_PLATE = {"type": "dc", "voltage": 220, "power": "3 kW", "speed": "1440 rpm", "efficiency": 0.82}


def test_a_dc_motor_is_judged_by_its_copper_heat() -> None:
    sizing = sized(PRESS | {"drive": {"on": "motor", "motor": DC_PLATE}, "flywheel": {"on": "motor", "inertia": 0.1}})
    energy, text = sizing.energy, " ".join(lines(sizing).split())
    assert energy is not None
    assert energy.copper_heat_share is not None
    current = 3000 / (0.82 * 220)
    shares = re.search(r"mean square over time ([0-9.]+) A, ([0-9.]+) % of the rated one; greatest ([0-9.]+) A", text)
    assert shares is not None
    assert float(shares[1]) == pytest.approx(energy.current_rms, rel=1e-4)
    assert float(shares[2]) == pytest.approx(100 * float(shares[1]) / current, rel=1e-2)
    assert energy.copper_heat_share == pytest.approx((float(shares[1]) / current) ** 2, rel=1e-4)
    assert ("too hot" in text) == (energy.copper_heat_share > 1)


ENGINE = {
    "load": [{"on": "crank", "torque": "-570 N m", "from": "180 deg", "to": "270 deg"}],
    "drive": {"motor": {"type": "engine", "speed": "1500 rpm", "droop": "8 %", "torque": "148 N m"}},
    "flywheel": {"irregularity": "3 %"},
}


def test_an_engine_has_full_load_and_a_governor_and_no_breakdown_and_no_windings() -> None:
    text = " ".join(lines(sized(ENGINE)).split())
    assert "governed engine, full load 23.2478 kW (148 N m at 1500 rpm): mean" in text
    assert "below the 1500 rpm up to which it is at full load" in text
    for word in ("breakdown", "heat", "hot", "mean square", "rated", "stall"):
        assert word not in text


def test_a_straight_line_and_a_table_are_judged_by_nothing_that_is_not_known() -> None:
    load = [{"on": "crank", "torque": "-30 N m", "from": 0, "to": "180 deg"}]
    line = {"type": "line", "no_load_speed": "1500 rpm", "speed": "1400 rpm", "power": "2 kW"}
    text = " ".join(lines(sized({"load": load, "drive": {"motor": line}, "flywheel": {"irregularity": 0.03}})).split())
    assert "The mean power is more than the rated one." in text
    assert "hot" not in text
    table = {"type": "table", "speed": [1200, 1300, 1400, 1450], "torque": [30, 32, 20, 10], "speed_unit": "rpm"}
    text = " ".join(lines(sized({"load": load, "drive": {"motor": table}, "flywheel": {"irregularity": 0.1}})).split())
    assert "It runs from 1346.73 to 1488.49 rpm, but its data hold from 1200 to 1450 rpm" in text
    for word in ("hot", "breakdown", "rated point at"):
        assert word not in text


@pytest.mark.slow
def test_a_long_cycle_is_no_mean() -> None:
    slow = {
        "type": "induction",
        "power": "3 kW",
        "speed": "1440 rpm",
        "poles": 4,
        "frequency": "50 Hz",
        "breakdown_ratio": 2.5,
    }
    drive = {"on": "motor", "motor": slow}
    load = [{"on": "crank", "torque": "-30 kN m", "from": 0, "to": "180 deg"}]
    scene = {"shafts": {"motor": {"ratio": 2000}}, "load": load, "drive": drive}
    text = lines(sized(scene | {"flywheel": {"on": "motor", "inertia": 0.1}}))
    assert "hotter for a while than on the mean" in " ".join(text.split())


def test_a_motor_with_a_relief_valve_gives_no_less_where_the_valve_is_open() -> None:
    motor = {"type": "hydraulic", "displacement": "164 cm^3", "flow": "360 l/min", "pressure": "70 bar"}
    motor |= {"volumetric_efficiency": 0.91, "mechanical_efficiency": 0.93}
    load = {"on": "crank", "torque": "-520 N m", "from": 0, "to": "90 deg"}
    sizing = sized({"load": [load], "drive": {"motor": motor}, "flywheel": {"irregularity": 0.3}})
    (told,) = figures.warnings(sizing, sizing.scene.motor)
    assert "comes from the flywheel" in told
    assert "gives less" not in told
