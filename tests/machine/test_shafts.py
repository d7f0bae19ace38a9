"""Shafts in a tree: how they are read and turn, that lossless trains are the star they amount to, drag and rest."""

from typing import Any

import numpy as np
import pytest

import flywheel
from flywheel.scene.scene import Transmission

ROTOR: dict[str, Any] = {
    "inertia": [{"on": "crank", "value": 2.0}],
    "regime": {"speed": 10.0},
    "flywheel": {"inertia": 1.0},
}
PRESS: dict[str, Any] = {
    "mechanism": {"type": "slider-crank", "crank": {"length": 0.1}, "rod": {"length": 0.45}, "slider": {"mass": 40.0}},
    "load": [{"on": "slider", "force": -8e3, "from": "290 deg", "to": "350 deg"}],
    "inertia": [{"on": "motor", "value": 0.02}, {"on": "fan", "value": 0.01}],
    "drive": {"on": "motor", "torque": "balance"},
    "regime": {"speed": 14.0},
    "flywheel": {"on": "wheel", "irregularity": 0.05},
}


def scene(shafts: dict[str, Any], **more: Any) -> flywheel.Scene:
    return flywheel.load({**ROTOR, "shafts": shafts, **more})


def fault(shafts: dict[str, Any]) -> str:
    with pytest.raises(flywheel.SceneError) as caught:
        scene(shafts)
    return "; ".join(map(str, caught.value.faults))


# -- as they are read --------------------------------------------------------------------------------------------------


def test_speeds_go_along_the_tree_whatever_the_order_in_which_it_is_written():
    found = scene({"fan": {"on": "motor", "ratio": 2}, "motor": {"on": "wheel", "ratio": 3}, "wheel": {"ratio": 6}})
    assert dict(found.shafts) == {"crank": 1.0, "wheel": 6.0, "motor": 18.0, "fan": 36.0}
    assert list(found.transmissions) == ["wheel", "motor", "fan"]
    assert list(found.inwards("fan")) == ["fan", "motor", "wheel", "crank"]
    assert found.near("motor") == "wheel"
    assert not found.efficiencies


def test_what_is_driven_slips():
    shafts = {"wheel": {"ratio": 6, "efficiency": 0.5}, "motor": {"on": "wheel", "ratio": 3, "slip": "2 %"}}
    shafts |= {"fan": {"on": "wheel", "ratio": 2, "slip": 0.02, "efficiency": 0.9}}
    found = scene(shafts, drive={"on": "motor", "torque": "balance"})
    assert found.shafts["motor"] == pytest.approx(18 / 0.98, rel=1e-15)
    assert found.shafts["fan"] == pytest.approx(12 * 0.98, rel=1e-15)
    assert dict(found.efficiencies) == {"wheel": 0.5, "motor": 0.98, "fan": pytest.approx(0.9 * 0.98)}
    assert found.transmissions["wheel"] == Transmission("crank", 6.0, 0.5, drives=True)
    stages = flywheel.Machine(found).stages
    assert [(stage.shaft, stage.near) for stage in stages] == [("crank", 0), ("wheel", 0), ("motor", 1), ("fan", 1)]


def test_a_lossless_shaft_belongs_to_the_stage_that_it_hangs_on():
    shafts = {"a": {"ratio": 2, "efficiency": 0.9}, "b": {"on": "a", "ratio": 2}, "c": {"on": "b", "ratio": 2, "slip": 0.1}}
    machine = flywheel.Machine(scene(shafts))
    assert [machine.stage_of(shaft) for shaft in ("crank", "a", "b", "c")] == ["crank", "a", "a", "c"]
    assert [stage.near for stage in machine.stages] == [0, 0, 1]


@pytest.mark.parametrize(
    ("shafts", "words"),
    [
        (
            {"a": {"ratio": 2, "on": "b"}, "b": {"ratio": 2, "on": "a"}},
            "shafts.a.on: found a circle of shafts, a -> b -> a,",
        ),
        ({"a": {"ratio": 2, "on": "a"}}, 'shafts.a.on: found "a", the shaft itself'),
        ({"a": {"ratio": 2, "on": "weel"}, "wheel": {"ratio": 2}}, 'found "weel", expected a shaft; did you mean "wheel"?'),
        ({"a": {"ratio": 2, "slip": "100 %"}}, 'shafts.a.slip: found "100 %", expected a value at least 0 and below 1'),
        ({"a": {"ratio": 2, "slip": -0.01}}, "shafts.a.slip: found -0.01, expected a value at least 0 and below 1"),
        ({"a": {"ratio": 2, "slip": 2}}, 'write "2 %"'),
        ({"a": {"ratio": 2, "drag": -3}}, "shafts.a.drag: found -3, expected a value at least 0 N m"),
        ({"a": {"ratio": 2, "slip": 0.1, "stiffness": 4}}, "shafts.a.slip: found 0.1 on a compliant shaft"),
        ({"crank": {"on": "a"}, "a": {"ratio": 2}}, "shafts.crank.on: found"),
        ({"crank": {"slip": 0.1}}, "shafts.crank.slip: found 0.1, expected none on the crank"),
    ],
)
def test_faults(shafts, words):
    assert words in fault(shafts)


def test_every_circle_is_told_once_and_what_hangs_on_it_is_not():
    shafts = {"far": {"ratio": 2, "on": "a"}} | {n: {"ratio": 2, "on": on} for n, on in zip("abcpq", "bcaqp", strict=True)}
    told = fault(shafts)
    assert told.count("a circle of shafts") == 2
    assert "far" not in told


# -- as they turn ------------------------------------------------------------------------------------------------------


def sized(shafts: dict[str, Any], **more: Any) -> flywheel.Sizing:
    return flywheel.size(flywheel.load({**PRESS, "shafts": shafts, **more}), simulate=False)


def test_a_lossless_train_is_the_star_with_its_speeds():
    series = {"wheel": {"ratio": 4}, "motor": {"on": "wheel", "ratio": 3}, "fan": {"on": "motor", "ratio": 0.5}}
    star = {"wheel": {"ratio": 4}, "motor": {"ratio": 12}, "fan": {"ratio": 6}}
    a, b = sized(series), sized(star)
    assert a.flywheel.exact == pytest.approx(b.flywheel.exact, rel=1e-13)
    assert a.balance.value == pytest.approx(b.balance.value, rel=1e-13)


def test_meshes_with_nothing_between_them_lose_as_one_of_the_product():
    series = {"a": {"ratio": 2, "efficiency": 0.9, "slip": 0.05}, "wheel": {"on": "a", "ratio": 2, "efficiency": 0.8}}
    series |= {"motor": {"on": "wheel", "ratio": 3, "efficiency": 0.97}, "fan": {"ratio": 6}}
    one = {"wheel": {"ratio": 4 / 0.95, "efficiency": 0.9 * 0.95 * 0.8}}
    one |= {"motor": {"on": "wheel", "ratio": 3, "efficiency": 0.97}, "fan": {"ratio": 6}}
    a, b = sized(series), sized(one)
    assert a.flywheel.exact == pytest.approx(b.flywheel.exact, rel=1e-12)
    assert a.energy.mean_power == pytest.approx(b.energy.mean_power, rel=1e-12)


# -- drag --------------------------------------------------------------------------------------------------------------

DRAGS = {"crank": {"drag": 3.0}, "m": {"ratio": 2.0, "drag": 1.0}}  # 5 N m on the crank, with 3 kg m²


def test_a_rotor_runs_down_by_drag_and_stays_where_it_stops():
    transient = flywheel.transient(scene(DRAGS), start=10.0, end="stop")
    assert transient.reason == "stop"
    assert transient.time == pytest.approx(6.0, rel=1e-9)
    assert transient.energy.works == pytest.approx({"shafts.crank.drag": -90.0, "shafts.m.drag": -60.0})
    for omega in (10.0, -10.0):
        motion = flywheel.simulate(scene(DRAGS), phi=0.0, omega=omega, until=8.0)
        assert "stands still" in str(motion.ended)
        assert motion.at([6.0, 7.0, 8.0])[0] == pytest.approx(np.full(3, 3.0 * omega))
        assert np.abs(motion.at([6.0, 7.0, 8.0])[1]).max() < 1e-9


def test_drag_turns_round_with_the_motion():
    driven = scene(DRAGS, load=[{"on": "crank", "torque": -8.0}])
    motion = flywheel.simulate(driven, phi=0.0, omega=10.0, until=8.0)
    assert motion.at([8.0])[1] == pytest.approx([-(8.0 - 30.0 / 13.0)])


def test_drag_holds_until_what_drives_is_stronger():
    found = scene(DRAGS, load=[{"on": "crank", "torque": "10*t"}])
    motion = flywheel.simulate(found, phi=0.0, omega=0.0, until=2.0)
    assert motion.at([0.49])[1] == pytest.approx([0.0], abs=1e-12)
    assert motion.at([2.0])[1] == pytest.approx([(5 * 2.0**2 - 5 * 2.0 + 1.25) / 3], rel=1e-9)
    with pytest.raises(flywheel.SceneError, match="the drag of its shafts holds M"):
        flywheel.transient(scene(DRAGS, drive={"torque": 4.0}), end="stop")


def test_a_train_runs_down_by_drags_and_losses():
    shafts = {"crank": {"drag": 1.0}, "m": {"ratio": 2.0, "drag": 1.0, "efficiency": 0.5}}
    shafts |= {"n": {"on": "m", "ratio": 2.0, "drag": 0.5, "efficiency": 0.9}}
    found = scene(shafts, inertia=[{"on": "crank", "value": 2.0}, {"on": "n", "value": 1.0}])
    transient = flywheel.transient(found, start=10.0, end="stop")
    # 3 a + 1 + 0.5 (2 + 0.9 (16 a + 2)) = 0, as the far shafts drive
    assert transient.time == pytest.approx(10.0 * (3.0 + 0.5 * 0.9 * 16.0) / (1.0 + 0.5 * (2.0 + 0.9 * 2.0)), rel=1e-9)


def test_losses_and_a_shaft_that_twists_are_not_followed_together():
    shafts = {"m": {"ratio": 2, "efficiency": 0.9}, "t": {"on": "m", "ratio": 1, "stiffness": 500}}
    weighs = [{"on": name, "value": 0.2} for name in ("crank", "m", "t")]
    with pytest.raises(flywheel.SceneError, match="losses in a mesh of a machine with a shaft that twists"):
        flywheel.simulate(scene(shafts, inertia=weighs), phi=0.0, omega=10.0, until=1.0)
