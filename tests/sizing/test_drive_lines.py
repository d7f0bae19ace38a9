"""Shafts in series against the series equations: flywheel, speeds, powers, and what every mesh loses."""

from __future__ import annotations

from math import pi
from typing import Any

import pytest
from scipy.integrate import solve_ivp

import flywheel
from tests.oracle.drive_lines import DriveLine
from tests.sizing import random_drive_lines as lines

TRUE = {  # of the press for an irregularity of 15 %, by `DriveLine(PRESS).sized(0.15)`
    "inertia": 17.291497418502406,
    "speed": 5.061360492761736,
    "speed_max": 5.440962529718867,
    "speed_min": 4.681758455804605,
    "period": 1.1978381530536135,
    "mean_power": 2910.043934195682,
    "peak_power": 9289.006905825343,
    "rms_torque": 28.37716062386729,
    "rotor_heat": 249.7916585699949,
}
LOST = {"shafts.wheel": 78.7341244312112, "shafts.motor": 172.2746009043845}  # W in the meshes
SLIP = 58.20087868391371  # W of that in the belt's slip
LARGE = (3.6390128483461517, 3.5615576045248125)  # rad/s, of that press with a motor five times as large, by `DriveLine`
RMS = {"wheel": 305.37618199008307, "motor": 28.40230158002637}  # N m through the meshes, on the shaft's side


def press(**wheel: Any) -> dict[str, Any]:
    return lines.PRESS | {"flywheel": {"on": "wheel", **wheel}}


def test_press_of_motor_belt_flywheel_shaft_gear_and_crank() -> None:
    sizing = flywheel.size(flywheel.load(press(irregularity=0.15)), simulate=False)
    found = sizing.as_dict()
    assert sizing.reached
    figures = {"inertia": found["flywheel"]["exact"], "speed": found["speed"], **found["energy"]}
    assert {key: figures[key] for key in TRUE if key in figures} == pytest.approx(
        {key: value for key, value in TRUE.items() if key in figures}, rel=1e-9
    )
    assert (sizing.run.speed_max, sizing.run.speed_min) == pytest.approx((TRUE["speed_max"], TRUE["speed_min"]), rel=1e-9)
    flow = flywheel.power_flow(sizing)
    lost: dict[str, float] = {}
    for stream in flow.streams:
        if stream.kind in ("mesh", "slip"):
            lost[stream.name] = lost.get(stream.name, 0.0) + stream.mean
    assert lost == pytest.approx(LOST, rel=1e-9)
    assert [stream.mean for stream in flow.streams if stream.kind == "slip"] == pytest.approx([SLIP], rel=1e-9)
    assert {row.shaft: row.torque_rms for row in flow.shafts if row.on} == pytest.approx(RMS, rel=1e-9)
    assert abs(flow.left) <= 1e-9 * flow.input


@pytest.mark.slow
def test_digits_of_the_press() -> None:
    found = DriveLine(press(irregularity=0.15)).sized(0.15)
    assert {key: float(getattr(found, key)) for key in TRUE} == pytest.approx(TRUE, rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_random_drive_lines(seed: int) -> None:
    table = lines.scene(seed)
    true = DriveLine(table).analysed(table["flywheel"]["inertia"])
    for rtol in lines.RTOLS:
        assert lines.compared(table, true, rtol) == []
        assert lines.recovered(table, true, rtol) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", lines.EXTREMES)
def test_extreme_drive_lines(name: str) -> None:
    table = lines.EXTREMES[name]
    true = DriveLine(table).analysed(table["flywheel"]["inertia"])
    for rtol in lines.RTOLS:
        assert lines.compared(table, true, rtol) == []


def test_drag_that_eats_the_motors_torque() -> None:
    shafts = lines.PRESS["shafts"]
    table = press(irregularity=0.15) | {"shafts": shafts | {"wheel": shafts["wheel"] | {"drag": 700.0}}}
    with pytest.raises(flywheel.SceneError, match="a drive that cannot carry the mean load"):
        flywheel.size(flywheel.load(table), simulate=False)


LIGHT = {"fly": {"ratio": 4.0, "efficiency": 0.96}, "motor": {"on": "fly", "ratio": 3.0, "efficiency": 0.95}}


def test_motor_that_passes_its_synchronous_speed_behind_two_meshes() -> None:
    table = {
        "shafts": LIGHT,
        "mechanism": {"type": "slider-crank", "crank": {"length": 0.1}, "rod": {"length": 0.45}, "slider": {"mass": 40}},
        "load": [{"on": "slider", "force": "-50*sign(v)"}],
        "inertia": [{"on": "crank", "value": 2.0}],
        "drive": {"on": "motor", "motor": lines.PRESS["drive"]["motor"] | {"power": 15e3, "speed": "1440 rpm"}},
        "flywheel": {"on": "fly", "inertia": 0.2},
    }
    line, end = DriveLine(table), 0.15
    found = flywheel.transient(flywheel.load(table), start=13.0, at=0.0, end=end)

    def rates(_: float, state: Any) -> tuple[float, float]:
        phi = state[0] % (2 * pi)
        return state[1], line.solved(*line.shafts_at(phi, 0.5 * state[1] ** 2, 0.0, 0.2, line.active(phi)))[0]

    # steps that mind no reversal: each costs them some digits, as the torque is continuous but its slope is not
    true = solve_ivp(rates, (0.0, end), (0.0, 13.0), method="DOP853", rtol=1e-9, atol=1e-11, max_step=0.005).y[:, -1]
    assert found.motion.trail.stuck is None
    assert found.motion.trail.ends()[:2, -1] == pytest.approx(true, rel=1e-7)


def test_lightly_loaded_motor_of_a_press() -> None:
    table = lines.EXTREMES["a motor five times as large"]
    run = flywheel.size(flywheel.load(table), simulate=False).run
    assert (run.speed_max, run.speed_min) == pytest.approx(LARGE, rel=1e-11)
    punch = {"type": "punch", "diameter": 0.06, "thickness": 0.008, "shear_strength": 360e6, "shape": "triangular"}
    hardly = {
        "on": "slider",
        "model": punch | {"overtravel": 0.004},
    }  # it ends steeply, and a mesh reverses there
    friction = {"on": "slider", "model": {"type": "constant", "force": 900.0}}
    press = table | {"load": [hardly, friction], "gravity": {"direction": "0 deg"}}
    assert flywheel.size(flywheel.load(press), simulate=False).reached
