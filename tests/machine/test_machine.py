import numpy as np
import pytest
from numpy.testing import assert_allclose

import flywheel
from bondgraph import Modulus, Reduction
from flywheel.machine.machine import merged
from tests import regimes, scenes

PHI = np.linspace(0.05, 6.2, 31)


def machine(scene):
    return flywheel.Machine(flywheel.load(scene))


def test_the_graph_is_the_chain_and_not_a_star():
    graph = machine(scenes.shaper()).graph
    chain = ["crank->bull", "bull->crank-shaper.rocker", "crank-shaper.rocker->crank-shaper.ram"]
    assert set(chain) <= set(graph.elements)
    assert not any(name.startswith("crank->crank-shaper") for name in graph.elements)


def test_a_modulus_changed_in_mid_chain_changes_the_machine_downstream():
    built = machine(scenes.shaper())
    name = "bull->crank-shaper.rocker"
    law = built.graph.elements[name].law
    doubled = Modulus(lambda p: 2 * law.value(p), lambda p: 2 * law.slope(p), law.motion)
    changed = Reduction(built.graph.with_law(name, doubled), "crank")
    anchor = built.anchors(PHI)
    before, after = built.reduction.flows(PHI, anchor), changed.flows(PHI, anchor)
    for downstream in ("crank-shaper.rocker", "crank-shaper.ram", "crank-shaper.rocker.com"):
        k = built.reduction.variable[downstream]
        assert_allclose(after.gain[k], 2 * before.gain[k], rtol=1e-14)
    assert after.gain[built.reduction.variable["bull"]] == 0.5
    crank_alone = 0.25 * 0.4
    old, new = built.reduction(PHI, anchor), changed(PHI, anchor)
    assert_allclose(new.inertia - crank_alone, 4 * (old.inertia - crank_alone), rtol=1e-12)
    assert_allclose(new.moment, 2 * old.moment, rtol=1e-12)


def test_what_carries_nothing_is_left_out_and_listed():
    built = machine(scenes.yoke())
    assert "scotch-yoke.crank.pin" in built.omitted
    assert "scotch-yoke.crank.pin" not in built.graph.elements
    rod = machine(scenes.press(mechanism=scenes.press()["mechanism"] | {"rod": {"length": 0.5}}))
    assert "press.rod" in rod.omitted


def test_weights_appear_only_with_gravity():
    parts = machine(scenes.press()).reduction.moments(PHI)
    assert "weight of press.rod" in parts
    without = scenes.press()
    del without["gravity"]
    assert not any("weight" in part for part in machine(without).reduction.moments(PHI))


def test_breakpoints_hold_windows_dead_centres_and_the_cycle():
    degrees = np.degrees(machine(scenes.press()).breakpoints)
    assert_allclose(degrees, [0, 300, 345, 360])
    built = machine(scenes.shaper())
    lowest = np.degrees(np.arccos(-0.12 / 0.3)) * 2  # ram dead centres: the crank is square to the rocker
    assert_allclose(np.degrees(built.breakpoints), [0, lowest, 720 - lowest, 720], atol=1e-9)


def test_loads_see_their_own_mechanisms_angle():
    first = scenes.press()["mechanism"]
    two = [first | {"name": "a"}, first | {"name": "b", "phase": "90 deg"}]
    load = [{"on": "b.slider", "force": 1, "from": "90 deg", "to": "120 deg"}]
    built = machine(scenes.press(mechanism=two, load=load, gravity={}))
    assert_allclose(np.degrees(built.breakpoints), [0, 30, 360], atol=1e-12)


def test_slopes_are_those_of_the_inertia():
    step = 1e-5
    for make in scenes.ALL.values():
        built = machine(make())
        higher, lower = (built.reduce(PHI + d).inertia + 0 * PHI for d in (step, -step))
        slope = built.reduce(PHI).slope + 0 * PHI
        assert_allclose(slope, (higher - lower) / (2 * step), rtol=1e-6, atol=1e-7)


def test_moments_are_virtual_work_by_differencing_positions():
    """M* by differencing the slider's and the centres' positions, not the graph."""
    built = machine(scenes.press())
    r, length, com, g = 0.1, 0.5, 0.2, 9.80665
    step = 1e-6

    def energy(phi):
        rod = np.arcsin(-r * np.sin(phi) / length)
        slider = r * np.cos(phi) + length * np.cos(rod)
        heights = 5 * 0.02 * np.sin(phi) + 10 * (r * np.sin(phi) + com * np.sin(rod))
        return slider, -g * heights

    (x1, u1), (x0, u0) = energy(PHI + step), energy(PHI - step)
    active = (np.radians(300) <= PHI) & (np.radians(345) > PHI)
    expected = -20e3 * active * (x1 - x0) / (2 * step) + (u1 - u0) / (2 * step)
    assert_allclose(built.reduce(PHI).moment, expected, rtol=1e-6, atol=1e-5)


def test_added_inertia_on_a_port_that_jumps_is_refused():
    law = {"type": "law", "outputs": {"bar": {"x": "0.1*abs(sin(phi))"}}}
    scene = scenes.rotor(mechanism=law, inertia=[{"on": "law.bar", "value": 1}])
    with pytest.raises(flywheel.SceneError, match="inertia"):
        machine(scene)


def test_merged_angles_drop_what_only_rounding_tells_apart():
    assert_allclose(merged([1.0, 1.0 + 1e-15, 2.0, 6.0 - 1e-15, 1e-16], 6.0), [0.0, 1.0, 2.0, 6.0])


# -- what depends on more than position ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "speed", "time"),
    [
        ({}, False, False),
        ({"damper": [{"on": "yoke", "coefficient": 3}]}, True, False),
        ({"drive": {"torque": "30 - omega"}}, True, False),
        ({"load": [{"on": "yoke", "force": "-3*v"}]}, True, False),
        ({"load": [{"on": "yoke", "force": "-3*sign(v)"}]}, False, False),
        ({"load": [{"on": "yoke", "force": "-3*t"}]}, False, True),
    ],
)
def test_what_the_moment_depends_on(change, speed, time):
    built = machine(scenes.yoke(**change))
    assert (built.depends_on_speed, built.depends_on_time, built.sets_its_speed) == (speed, time, speed)


def test_a_typical_speed_is_the_one_asked_for_or_the_motor_s():
    assert machine(scenes.rotor()).typical_speed == pytest.approx(10 * np.pi)
    assert machine(regimes.scene("dc-inductance", inertia=1)).typical_speed == pytest.approx(220 / 1.5 / 10)
    assert machine(regimes.scene("section-c", inertia=1)).typical_speed == 1.0


def test_every_mesh_with_losses_is_a_stage_of_what_hangs_behind_it():
    scene = {
        "shafts": {"motor": {"ratio": 8, "efficiency": 0.9}, "fan": {"ratio": 3, "efficiency": 0.8}, "plain": {"ratio": 2}},
        "mechanism": [scenes.yoke()["mechanism"] | {"shaft": "fan", "crank": {"length": 0.5, "inertia": 0.7}}],
        "inertia": [{"on": "motor", "value": 0.01}, {"on": "plain", "value": 0.5}, {"on": "crank", "value": 4}],
        "load": [
            {"on": "yoke", "force": "-30*v"},
            {"on": "crank", "torque": "-5"},
            {"on": "fan", "torque": "-omega"},
            {"on": "plain", "torque": "-2*omega"},
        ],
        "damper": [{"on": "motor", "coefficient": 0.2}],
        "drive": {"on": "motor", "torque": "balance"},
        "regime": {"speed": 10},
        "flywheel": {"on": "motor", "inertia": 1},
    }
    built = machine(scene)
    crank, motor, fan = built.stages
    assert [(s.shaft, s.efficiency, s.carries_flywheel, s.drives) for s in built.stages] == [
        ("crank", 1.0, False, False),
        ("motor", 0.9, True, True),
        ("fan", 0.8, False, False),
    ]
    gain = 0.5 * np.sin(3 * PHI) * 3
    assert_allclose(crank.reduction(PHI).inertia, 4 + 4 * 0.5)
    assert_allclose(motor.reduction(PHI).inertia, 64 * 0.01)
    assert_allclose(fan.reduction(PHI).inertia, 9 * 0.7 + 20 * gain**2, rtol=1e-12)
    assert_allclose(motor.reduction(PHI).resistance, 64 * 0.2)
    assert_allclose(crank.reduction(PHI).moment, -5.0)
    found = {e.name: v for s in built.stages for e, v, _ in s.reduction.at(PHI).contributions(10.0)}
    assert_allclose(found["load[2].torque"], -9 * 10.0)
    assert_allclose(found["load[3].torque"], -4 * 2 * 10.0)
    assert_allclose(found["load[0].force"], -30 * gain**2 * 10.0, rtol=1e-12, atol=1e-14)
    assert [len(s.reduction.at(PHI).contributions(10.0)) for s in built.stages] == [1, 0, 2]
    whole = sum(s.reduction(PHI).inertia for s in built.stages)
    assert_allclose(whole, built.reduction(PHI).inertia, rtol=1e-13)


def test_without_losses_there_is_one_stage():
    (stage,) = machine(regimes.scene("kloss-press", inertia=1)).stages
    assert (stage.shaft, stage.efficiency, stage.carries_flywheel, stage.drives) == ("crank", 1.0, True, True)


def test_breakpoints_of_position_hold_in_laws_of_speed():
    """A branch on phi breaks the cycle; one on omega does not: the motion will tell."""
    load = [{"on": "crank", "torque": "-omega*(2 if phi < 2 else 1) - min(3, omega)"}]
    assert_allclose(machine(scenes.rotor(load=load)).breakpoints, [0, 2, 2 * np.pi], atol=1e-14)
