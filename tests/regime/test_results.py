import json

import pytest

import flywheel
from tests import scenes
from tests.limits import sample
from tests.regimes import SECTION_C

KEYS = {
    "title", "reduction", "cycle", "speed", "speed_asked", "irregularity", "balance", "power", "areas",
    "accumulated_max", "accumulated_min", "energy_fluctuation", "coefficient_of_energy", "angle_speed_max",
    "angle_speed_min", "reduced_inertia", "flywheel", "simulation", "error",
}  # fmt: skip
FLYWHEEL = {"on", "inertia", "exact", "approximate", "approximate_total", "inertia_torque",
    "inertia_torque_flywheel", "needed", "limits", "binding"}  # fmt: skip
SIMULATION = {"irregularity", "irregularity_approximate", "speed_max", "speed_min", "speed_time_mean", "period"}


@pytest.mark.parametrize("make", sample([scenes.rotor, scenes.press], 2))
def test_every_key_of_the_contract_is_there(make):
    result = flywheel.size(flywheel.load(make())).as_dict()
    assert set(result) >= KEYS
    assert set(result["flywheel"]) == FLYWHEEL
    assert set(result["simulation"]) >= SIMULATION
    assert set(result["reduced_inertia"]) == {"min", "max", "mean"}
    assert set(result["error"]) >= {"exact", "simulation"}
    assert all(set(area) == {"from", "to", "work", "accumulated"} for area in result["areas"])
    assert json.loads(json.dumps(result)) == result


def test_keys_of_regimes_power_and_shafts():
    scene = SECTION_C | {"shafts": {"fast": {"ratio": 3}}, "flywheel": {"on": "fast", "irregularity": 0.05}}
    sizing = flywheel.size(flywheel.load(scene), simulate=False)
    result = sizing.as_dict()
    assert json.loads(json.dumps(result)) == result
    assert result["constant_speed"] == pytest.approx(10 / 2.387, rel=1e-12)
    assert 0 < result["multiplier"] < 1
    assert result["speed_asked"] is None
    assert result["gd2"] == 4 * result["flywheel"]["exact"]
    crank, fast = result["shafts"]
    assert (crank["shaft"], fast["shaft"]) == ("crank", "fast")
    assert fast["inertia"] == pytest.approx(result["flywheel"]["exact"], rel=1e-15)
    assert crank["inertia"] == pytest.approx(9 * fast["inertia"], rel=1e-14)
    assert crank["energy"] == pytest.approx(fast["energy"], rel=1e-14)
    assert fast["speed"] == 3 * result["speed"]
    assert (result["energy"]["mean_power"], result["energy"]["peak_to_mean"]) == (0.0, None)
    assert result["wheel"] is None


def test_what_is_null_where():
    sizing = flywheel.size(flywheel.load(scenes.yoke()), simulate=False).as_dict()
    assert sizing["simulation"] is None
    assert sizing["error"]["simulation"] is None
    given = flywheel.size(flywheel.load(scenes.yoke(flywheel={"inertia": 300})), simulate=False).as_dict()
    assert given["irregularity"] is None
    assert {key for key, value in given["flywheel"].items() if value is None} == FLYWHEEL - {"on", "inertia"}
    assert given["simulation"]["irregularity"] > 0
    coasting = flywheel.load(scenes.rotor(drive={"torque": 0}, load=[], inertia=[{"on": "crank", "value": 1}]))
    assert flywheel.size(coasting).as_dict()["coefficient_of_energy"] is None
    nothing = scenes.rotor(load=[])
    del nothing["drive"]
    assert flywheel.size(flywheel.load(nothing)).as_dict()["power"] is None


def test_areas_leave_the_machine_null():
    scene = {"areas": {"values": [5, -5]}, "regime": {"speed": 3}, "flywheel": {"irregularity": 0.1}}
    result = flywheel.size(flywheel.load(scene)).as_dict()
    for key in ("cycle", "power", "balance", "simulation", "coefficient_of_energy", "angle_speed_max"):
        assert result[key] is None
    assert result["areas"][0]["from"] is None
    assert set(result["reduced_inertia"].values()) == {None}
    assert result["flywheel"]["exact"] == result["flywheel"]["approximate"] == result["flywheel"]["approximate_total"]
