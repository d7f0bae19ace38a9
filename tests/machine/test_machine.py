"""A machine: shafts, mechanisms, reduction."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
from numpy.testing import assert_allclose

import flywheel
from bondgraph import Modulus, Reduction
from bondgraph.elements import Here
from flywheel.designs import figures as designs
from flywheel.machine.loads import EffortPlace, LoadLaw, Senses, TableCurve, crank_angles
from flywheel.machine.machine import dead_centres
from flywheel.machine.reactions import solution_of
from flywheel.numerics.expressions import parse
from flywheel.reading.scenes import parse_scene
from flywheel.scene.scene import Load, Table, Transmission
from tests import regimes, scenes

# From a scene to its machine: loads as laws of position, the graph, breakpoints, narrow features.


EXAMPLES = Path(__file__).parents[2] / "examples"
TURN = 2 * np.pi
SHAFT = EffortPlace("crank", lambda here: here.q)


def at(q):
    return Here(np.asarray(q, dtype=float), None, np)


def value(effort, q, anchor=None):
    return effort(at(q), at(q if anchor is None else anchor))


def test_linear_tables_interpolate_and_jump():
    pieces = TableCurve(Table(np.array([0.0, 1.0, 1.0, 3.0]), np.array([0.0, 2.0, 5.0, 1.0]), "linear"))
    assert_allclose(pieces(np.array([0.5, 2.0]), np.array([0.5, 2.0])), [1.0, 3.0])
    assert (pieces(np.array(1.0), np.array(0.9)), pieces(np.array(1.0), np.array(1.1))) == (2.0, 5.0)  # by the anchor
    assert pieces.knots.tolist() == [0.0, 1.0, 3.0]


def test_pchip_tables_do_not_overshoot_and_mix_with_short_runs():
    angle = np.array([0.0, 1.0, 1.0, 2.0, 3.0, 4.0])
    pieces = TableCurve(Table(angle, np.array([0.0, 2.0, 0.0, 1.0, 1.0, 3.0]), "pchip"))
    inside = np.linspace(2.0, 3.0, 9)[1:-1]
    assert_allclose(pieces(inside, inside), 1.0)
    assert_allclose(pieces(np.array(0.5), np.array(0.5)), 1.0)


RAMP = Table(np.array([-1.0, 0.0, 1.0]), np.array([1.0, 2.0, 5.0]))


@pytest.mark.parametrize(
    ("load", "q", "expected"),
    [
        (Load("crank", 7.0, TURN, 5.0, 1.0), [0.5, 2.0, 5.5], [7.0, 0.0, 7.0]),
        (Load("crank", parse("phi"), 1.0, 0.0, 0.5), [0.25, 0.75, 2.25, 3.25], [0.25, 0.0, 0.25, 0.25]),
        (Load("crank", 3.0, TURN, 1.0, 5.0, sense=-1), [0.5, 2.0, 4.0, 6.0], [0.0, 0.0, 3.0, 0.0]),
        (Load("crank", RAMP, TURN, TURN - 1.0, 1.0), [0.5, TURN - 0.5, 3.0], [3.5, 1.5, 0.0]),
    ],
    ids=["a window that wraps", "repeated", "one sense", "a table from below zero"],
)
def test_a_load_acts_in_its_window(load, q, expected):
    effort = LoadLaw(load, SHAFT, {}, senses=Senses(np.array([np.pi]), np.array([1.0, -1.0])))
    assert_allclose(value(effort, q), expected, atol=1e-15)


def test_windows_are_half_open_by_the_piece():
    window = LoadLaw(Load("crank", 7.0, TURN, 5.0, 1.0), SHAFT, {})
    assert_allclose(value(window, [1.0, 1.0], [0.9, 1.1]), [7.0, 0.0])


def test_the_unknown_is_kept_apart_from_the_rest():
    effort = LoadLaw(Load("crank", parse("3 + 2*p*sin(phi)", frozenset("p")), TURN), SHAFT, {}, "p")
    assert effort.depends_on_unknown
    assert value(effort, 1.0) == 3.0
    assert effort.per_unknown(at(1.0), at(1.0)) == pytest.approx(2 * np.sin(1.0))
    drive = LoadLaw(Load("crank", None, TURN), SHAFT, {}, "drive")
    assert (value(drive, 1.0), drive.per_unknown(at(1.0), at(1.0))) == (0.0, 1.0)


def test_crank_angles_of_a_local_angle():
    place = EffortPlace("m.slider", lambda here: here.q, rate=2.0, phase=1.0)
    result = crank_angles(0.5, TURN, place, TURN)
    assert_allclose((2 * result + 1.0) % TURN, 0.5)
    assert result.size == 2
    assert crank_angles(0.0, TURN, SHAFT, 2 * TURN).tolist() == [0.0, TURN]


PORT = EffortPlace("m.slider", lambda here: here.q, rate=2.0, rotating=False)
WHEEL = EffortPlace("motor", lambda here: here.q, shaft=True)


def moving(q, speed, flow, time=0.0):
    return at(q)._replace(speed=speed, flow=flow, time=time)


def test_a_shaft_has_its_own_speed_and_a_port_that_of_the_shaft_that_drives_it():
    here = moving(1.0, 5.0, 20.0)
    for place, omega in ((WHEEL, 20.0), (PORT, 5.0)):
        effort = LoadLaw(Load(place.junction, parse("100*omega + v"), TURN), place, {})
        assert effort(here, here) == pytest.approx(100 * omega + 20)
        assert (effort.uses_speed, effort.uses_time) == (True, False)


def test_time_and_parameters_in_one_law_and_a_balance_as_the_factor_of_a_speed():
    effort = LoadLaw(Load("crank", parse("k*t*omega + phi", frozenset("k")), TURN), SHAFT, {"k": 3.0})
    here = moving(1.0, 5.0, 5.0, 7.0)
    assert effort.uses_time
    assert effort(here, here) == pytest.approx(3 * 7 * 5 + 1)
    effort = LoadLaw(Load("crank", parse("3 - c*omega", frozenset("c")), TURN), SHAFT, {}, "c")
    assert (effort(here, here), effort.per_unknown(here, here)) == (3.0, -5.0)


@pytest.mark.parametrize("law", ["sign(v)", "3 if v > 0 else 5", "x*(v < 0)"])
def test_the_sign_of_a_velocity_is_no_speed(law):
    effort = LoadLaw(Load("crank", parse(law), TURN), SHAFT, {}, senses=Senses(np.array([np.pi]), np.array([1.0, -1.0])))
    assert not effort.uses_speed
    assert not effort.uses_time


def test_branches_that_depend_on_speed_are_decided_at_the_anchor():
    effort = LoadLaw(Load("crank", parse("min(40, 4*(110 - omega))"), TURN), SHAFT, {})
    slow, fast = moving(0.0, 90.0, 90.0), moving(0.0, 105.0, 105.0)
    assert effort(fast, fast) == pytest.approx(20.0)
    assert effort(slow, slow) == pytest.approx(40.0)
    assert effort(fast, slow) == pytest.approx(40.0)
    assert effort(slow, fast) == pytest.approx(80.0)


def test_what_decides_branches_has_the_sign_of_their_sides():
    """|v| - 7, on the anchor's side of v = 0; v itself turns with the position, or where the machine rests."""
    effort = LoadLaw(Load("m.slider", parse("-8*max(0, abs(v) - 7)*sign(v) - (phi > 2)"), TURN), PORT, {})
    here, anchor = moving(np.ones(4), 5.0, np.array([-9.0, -3.0, 3.0, 9.0])), moving(1.0, 5.0, 9.0)
    (past,) = effort.speed_switches(here, anchor)
    assert_allclose(past, [-16, -10, -4, 2])
    (past,) = effort.speed_switches(here, moving(1.0, 5.0, -9.0))
    assert_allclose(past, [2, -4, -10, -16])
    assert not LoadLaw(Load("crank", 3.0, TURN), SHAFT, {}).speed_switches(anchor, anchor)
    assert not LoadLaw(Load("crank", parse("-omega"), TURN), SHAFT, {}).speed_switches(anchor, anchor)


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


def test_breakpoints_hold_windows_dead_centres_and_the_cycle():
    degrees = np.degrees(machine(scenes.press()).breakpoints)
    assert_allclose(degrees, [0, 300, 345, 360])
    built = machine(scenes.shaper())
    lowest = np.degrees(np.arccos(-0.12 / 0.3)) * 2  # ram dead centres: the crank is square to the rocker
    assert_allclose(np.degrees(built.breakpoints), [0, lowest, 720 - lowest, 720], atol=1e-9)


RISE = "0.02*(1 - cos(pi*phi/rise)) if phi < rise else 0.02*(1 + cos(pi*(phi - rise)/(2*pi - rise)))"
RISING = {
    "parameters": {"rise": 1},
    "mechanism": {"type": "law", "outputs": {"slide": {"x": RISE, "mass": 20}}},
    "load": [{"on": "slide", "force": -1000, "while": "v > 0"}],
    "drive": {"motor": {"type": "line", "starting_torque": 300, "slope": 20}},
    "flywheel": {"irregularity": 0.05},
}


@pytest.mark.parametrize("path", ["parameters.rise", "load.0.force", "drive.motor.slope"])
def test_machines_that_break_alike_share_their_angles_and_no_others_do(path):
    """A cam whose rise ends at a parameter: what the next machine takes from the last one is what it would find itself."""
    scene, factors = flywheel.load(RISING), (1.0, 1.5, 2.0)
    values = [
        factor * {"parameters.rise": 1.0, "load.0.force": -1000.0, "drive.motor.slope": 20.0}[path] for factor in factors
    ]
    machines = [flywheel.Machine(scene.with_({path: number})) for number in values]
    breaks = [machine.breakpoints for machine in machines]
    assert all((number if path == "parameters.rise" else 1.0) in edges for number, edges in zip(values, breaks, strict=True))
    assert all(edges is breaks[0] for edges in breaks) == (path != "parameters.rise")
    swept = designs.one_by_one(scene, (path,), np.array([values]), range(3), 1e-10)
    alone = [flywheel.size(flywheel.load(_at(path, number)), 1e-10, simulate=False).inertia for number in values]
    assert_allclose(swept.values["exact"], alone, rtol=1e-12)


def _at(path, number):
    """The tables of `RISING` with another number, with a rise given in the formula itself."""
    keys, tables = path.split("."), json.loads(json.dumps(RISING))
    if path == "parameters.rise":
        tables["mechanism"]["outputs"]["slide"]["x"] = RISE.replace("rise", repr(number))
    else:
        table = tables[keys[0]][0] if keys[0] == "load" else tables["drive"]["motor"]
        table[keys[-1]] = number
    return tables


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
    result = {e.name: v for s in built.stages for e, v, _ in s.reduction.at(PHI).contributions(10.0)}
    assert_allclose(result["load[2].torque"], -9 * 10.0)
    assert_allclose(result["load[3].torque"], -4 * 2 * 10.0)
    assert_allclose(result["load[0].force"], -30 * gain**2 * 10.0, rtol=1e-12, atol=1e-14)
    assert [len(s.reduction.at(PHI).contributions(10.0)) for s in built.stages] == [1, 0, 2]
    whole = sum(s.reduction(PHI).inertia for s in built.stages)
    assert_allclose(whole, built.reduction(PHI).inertia, rtol=1e-13)


def test_a_weight_in_the_graph_is_that_along_its_guide():
    yoke = scenes.yoke(gravity={"direction": "30 deg"})
    yoke["mechanism"]["yoke"]["direction"] = "60 deg"
    weight = machine(yoke).graph.elements["scotch-yoke.yoke.G_yoke"]
    assert weight.law == pytest.approx(20 * 9.80665 * np.cos(np.pi / 6), rel=1e-12)


def test_dead_centres_are_the_roots_of_the_influence_coefficient():
    built = machine(scenes.press())
    result = dead_centres(built.reduction, "press.slider", np.array([0.0, 2 * np.pi]))
    assert_allclose(result, [np.pi], atol=1e-14)
    offset = scenes.press()["mechanism"] | {"slider": {"offset": 0.05}}
    built = machine(scenes.press(mechanism=offset, gravity={}))
    # stretched and folded: sin(phi) = e/(l ± r)
    stretched, folded = np.arcsin(0.05 / 0.6), np.pi + np.arcsin(-0.05 / 0.4) + 2 * np.arcsin(0.05 / 0.4)
    result = dead_centres(built.reduction, "press.slider", np.array([0.0, 2 * np.pi]))
    assert_allclose(result, [stretched, np.pi + np.arcsin(0.05 / 0.4)], atol=1e-13)
    assert folded == pytest.approx(result[1])


SLIDER = {"type": "slider-crank", "crank.length": 0.1, "slider.mass": 1, "rod.inertia": 1}
BARS = {"type": "four-bar", "ground.length": 0.4, "crank.length": 0.1, "coupler.length": 0.35, "rocker.length": 0.3}
SHAPER = {"type": "crank-shaper", "rocker.length": 0.5, "ram.mass": 1}
DEAD_CENTRES = [
    (SLIDER | {"rod.length": 0.3}, "slider"),
    (SLIDER | {"rod.length": 0.25, "slider.offset": 0.1, "phase": 2.0}, "slider"),
    (SLIDER | {"rod.length": 0.1600001, "slider.offset": -0.06, "phase": -1.0}, "slider"),
    (SLIDER | {"rod.length": 0.3, "slider.offset": 0.1, "phase": 1.0}, "rod"),
    ({"type": "scotch-yoke", "crank.length": 0.1, "yoke.mass": 1, "yoke.direction": -2.0, "phase": 0.3}, "yoke"),
    (BARS, "rocker"),
    (BARS | {"assembly": "crossed", "phase": 1.0}, "rocker"),
    (BARS | {"coupler.length": 0.2, "rocker.length": 0.32}, "rocker"),
    (SHAPER | {"crank.length": 0.1, "frame.length": 0.3, "phase": 0.5}, "rocker"),
    (SHAPER | {"crank.length": 0.1, "frame.length": 0.3, "phase": 0.5}, "ram"),
    (SHAPER | {"crank.length": 0.3, "frame.length": 0.1}, "ram"),
]


def nested(flat):
    result = {}
    for path, value in flat.items():
        *tables, key = path.split(".")
        place = result
        for table in tables:
            place = place.setdefault(table, {})
        place[key] = value
    return result


@pytest.mark.parametrize(("flat", "port"), DEAD_CENTRES)
@pytest.mark.parametrize("ratio", [1, 2])
def test_dead_centres_of_closed_form_are_those_that_bounds_find(flat, port, ratio):
    key = "torque" if port in ("rod", "rocker") else "force"
    load = [{"on": f"m.{port}", key: "-5*sign(v)"}]
    mechanism = nested(flat) | {"name": "m", "shaft": "fast"}
    built = machine(scenes.rotor(mechanism=mechanism, shafts={"fast": {"ratio": ratio}}, load=load))
    junction = built.places[f"m.{port}"].junction
    smooth = np.unique([0.0, 2 * np.pi, *(angle for _, angle in built._mechanism_breakpoints())])
    expected = dead_centres(built.kinematics, junction, smooth)
    senses = built._senses(f"m.{port}")
    inner = senses.dead_centres[(senses.dead_centres > 1e-9) & (senses.dead_centres < 2 * np.pi - 1e-9)]
    assert_allclose([np.abs(expected - angle).min() for angle in inner], 0.0, atol=1e-11)
    assert 2 * ratio - 2 < inner.size <= 2 * ratio
    phi = np.linspace(0.01, 6.28, 333)
    apart = np.abs(phi[:, None] - senses.dead_centres).min(axis=1) > 1e-9
    gain = built.kinematics.flows(phi, phi).gain[built.kinematics.variable[junction]]
    assert (np.sign(gain) == senses.at(phi))[apart].all()


@pytest.mark.parametrize("number", ["ratio", "rod"])
def test_a_shafts_ratio_moves_no_angles_of_loads_and_mechanisms_on_other_shafts(number):
    """A slider's force begins at a position, a loss on the crank reads its speed: a motor's ratio changes neither."""

    def built(factor: float) -> flywheel.Machine:
        return machine(
            {
                "shafts": {"motor": {"ratio": 2.0 * (factor if number == "ratio" else 1.0)}},
                "mechanism": {
                    "type": "slider-crank",
                    "crank": {"length": 0.1},
                    "rod": {"length": 0.4 * (factor if number == "rod" else 1.0)},
                    "slider": {"mass": 5},
                },
                "load": [{"on": "slider", "force": "-900 if x > 0.45 else 0"}, {"on": "crank", "torque": "-2*v"}],
                "drive": {"on": "motor", "motor": {"type": "line", "starting_torque": 300, "slope": 2}},
                "flywheel": {"irregularity": 0.05},
            }
        )

    first, second, third = built(1.0), built(1.0), built(1.1)
    assert second.landmarks is first.landmarks
    assert (third.landmarks is first.landmarks) == (number == "ratio")
    for each, rod in (first, 0.4), (third, 0.44 if number == "rod" else 0.4):
        angles = each.breakpoints
        reached = 0.1 * np.cos(angles) + np.sqrt(rod**2 - (0.1 * np.sin(angles)) ** 2)
        assert np.abs(reached - 0.45).min() <= 1e-12


def test_switches_of_an_expression_become_breakpoints():
    load = [{"on": "crank", "torque": "-5*max(sin(phi), 0.5) - (3 if phi < 2 else 1)"}]
    result = machine(scenes.rotor(load=load)).breakpoints
    assert_allclose(result, [0, np.pi / 6, 2, 5 * np.pi / 6, 2 * np.pi], atol=1e-14)


def test_switches_on_displacement_follow_the_mechanism():
    load = [{"on": "yoke", "force": "-100 if x > 0.25 else 0"}]
    result = machine(scenes.yoke(load=load)).breakpoints
    assert_allclose(result, [0, np.pi / 3, 5 * np.pi / 3, 2 * np.pi], atol=1e-14)


def test_machines_that_differ_by_masses_alone_have_the_same_angles():
    """A cam's follower of three masses: breakpoints are kept, and I* is linear in the mass."""
    text = (EXAMPLES / "linkages/cam_press.toml").read_text("utf-8")
    scenes_of_masses = (parse_scene(text.replace('mass = "9 kg"', f'mass = "{mass} kg"')) for mass in (9, 30, 51))
    light, middle, heavy = map(flywheel.Machine, scenes_of_masses)
    assert middle.landmarks is light.landmarks
    phi = np.linspace(0.0, light.scene.cycle, 50)
    one, two, three = (machine.reduce(phi).inertia for machine in (light, middle, heavy))
    assert np.ptp(two - one) > 1e-3
    assert_allclose(three - two, two - one, rtol=1e-9, atol=1e-12)
    poses = [solution_of(machine.scene.mechanisms[0])[0].poses(1.0) for machine in (light, heavy)]
    assert [each.linkage.link("bell_crank").mass for each in poses] == [9.0, 51.0]


@pytest.mark.parametrize("width", [1e-2, 1e-5])
def test_a_narrow_peak_is_never_missed(width):
    load = [{"on": "crank", "torque": f"-(sin(phi) + 100*exp(-((phi - 2)/{width})**2))"}]
    result = flywheel.size(flywheel.load(scenes.rotor(load=load)), simulate=False)
    work = 100 * width * np.sqrt(np.pi)  # the peak's; the sine's is zero
    assert result.balance.value == pytest.approx(work / (2 * np.pi), rel=1e-9)
    assert result.reached


@pytest.mark.parametrize(
    ("text", "steepness"),
    [("-100/(1 + exp(-{k}*(phi - 3)))", 300), ("-100*exp({k}*(phi - 3))/(1 + exp({k}*(phi - 3)))", 1e8)],
)
def test_a_steep_step_is_sized_within_its_estimate(text, steepness):
    result = flywheel.size(
        flywheel.load(scenes.rotor(load=[{"on": "crank", "torque": text.format(k=steepness)}])), simulate=False
    )
    with mpmath.workdps(30):
        k, turn = mpmath.mpf(steepness), 2 * mpmath.pi

        def step(phi):
            return mpmath.log1p(mpmath.exp(k * (phi - 3))) / k

        mean = (step(turn) - step(0)) / turn
        top = 3 + mpmath.log(mean / (1 - mean)) / k
        swing = 100 * (mean * top - step(top) + step(0))
        true = float(swing / (mpmath.mpf("0.01") * (10 * mpmath.pi) ** 2))
        assert result.balance.value == pytest.approx(float(100 * mean), rel=1e-9)
    assert abs(result.flywheel.exact / true - 1) <= result.error.exact <= 1e-9


def test_an_expression_that_cannot_be_followed_is_a_fault_with_its_place():
    with pytest.raises(flywheel.SceneError, match=r"load\[0\]"):
        _ = machine(scenes.rotor(load=[{"on": "crank", "torque": "-1/sin(phi - 1)"}])).mesh


@pytest.mark.parametrize("every", [360, 120])
def test_a_switch_just_before_phi_starts_again_is_found(every):
    last = float(np.radians(every)) - 1e-3
    load = [{"on": "crank", "torque": f"-100 if phi > {last!r} else 0", "every": f"{every} deg"}]
    result = flywheel.size(flywheel.load(scenes.rotor(load=load)), simulate=False)
    assert result.balance.value == pytest.approx(100 * 1e-3 / np.radians(every), rel=1e-9)


def test_what_is_steep_at_the_speed_of_running_has_cells_of_its_own():
    """A narrow peak whose height depends on the speed."""
    speed = 30.0
    load = [{"on": "crank", "torque": "-omega*exp(-((phi - 2)/1e-3)**2)"}]
    built = machine(scenes.rotor(load=load, regime={"speed": speed}))
    near = built.landmarks[np.abs(built.landmarks - 2) < 0.02]
    assert near.size > 4
    result = flywheel.size(built, simulate=False)
    work = speed * 1e-3 * np.sqrt(np.pi)
    assert result.balance.value * 2 * np.pi == pytest.approx(work, rel=1e-4)
    assert result.reached


def test_a_root_of_any_order_is_followed_to_its_branch_point():
    """Mean of |cos|**p over a turn: Gamma((p + 1)/2)/(sqrt(pi) Gamma(p/2 + 1))."""
    power = 0.01
    load = [{"on": "crank", "torque": f"-50*abs(cos(phi))**{power}"}]
    scene = {"load": load, "drive": {"torque": "balance"}, "regime": {"speed": 20}, "flywheel": {"irregularity": 0.03}}
    result = flywheel.size(flywheel.load(scene), simulate=False)
    mean = mpmath.gamma((power + 1) / 2) / (mpmath.sqrt(mpmath.pi) * mpmath.gamma(power / 2 + 1))
    assert result.balance.value == pytest.approx(50 * float(mean), rel=1e-11)


# Shafts in a tree: how they are read and turn, that lossless trains are the star they amount to, drag and rest.


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
    result = scene({"fan": {"on": "motor", "ratio": 2}, "motor": {"on": "wheel", "ratio": 3}, "wheel": {"ratio": 6}})
    assert dict(result.shafts) == {"crank": 1.0, "wheel": 6.0, "motor": 18.0, "fan": 36.0}
    assert list(result.transmissions) == ["wheel", "motor", "fan"]
    assert list(result.inwards("fan")) == ["fan", "motor", "wheel", "crank"]
    assert result.near("motor") == "wheel"
    assert not result.efficiencies


def test_what_is_driven_slips():
    shafts = {"wheel": {"ratio": 6, "efficiency": 0.5}, "motor": {"on": "wheel", "ratio": 3, "slip": "2 %"}}
    shafts |= {"fan": {"on": "wheel", "ratio": 2, "slip": 0.02, "efficiency": 0.9}}
    result = scene(shafts, drive={"on": "motor", "torque": "balance"})
    assert result.shafts["motor"] == pytest.approx(18 / 0.98, rel=1e-15)
    assert result.shafts["fan"] == pytest.approx(12 * 0.98, rel=1e-15)
    assert dict(result.efficiencies) == {"wheel": 0.5, "motor": 0.98, "fan": pytest.approx(0.9 * 0.98)}
    assert result.transmissions["wheel"] == Transmission("crank", 6.0, 0.5, drives=True)
    stages = flywheel.Machine(result).stages
    assert [(stage.shaft, stage.near) for stage in stages] == [("crank", 0), ("wheel", 0), ("motor", 1), ("fan", 1)]


def test_a_machine_for_other_requirements_is_the_same_machine():
    machine = flywheel.Machine(flywheel.load(scenes.yoke(flywheel={"irregularity": 0.04})))
    before = flywheel.size(machine, simulate=False)
    other = flywheel.load(scenes.yoke(flywheel={"irregularity": 0.02}))
    again = machine.with_requirements(other)
    assert (again.scene, again.reduction, again.mesh is machine.mesh) == (other, machine.reduction, True)
    assert flywheel.size(again, simulate=False).flywheel == flywheel.size(other, simulate=False).flywheel
    assert flywheel.size(machine, simulate=False).flywheel == before.flywheel


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
    text = fault(shafts)
    assert text.count("a circle of shafts") == 2
    assert "far" not in text


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
    result = scene(DRAGS, load=[{"on": "crank", "torque": "10*t"}])
    motion = flywheel.simulate(result, phi=0.0, omega=0.0, until=2.0)
    assert motion.at([0.49])[1] == pytest.approx([0.0], abs=1e-12)
    assert motion.at([2.0])[1] == pytest.approx([(5 * 2.0**2 - 5 * 2.0 + 1.25) / 3], rel=1e-9)
    with pytest.raises(flywheel.SceneError, match="the drag of its shafts holds M"):
        flywheel.transient(scene(DRAGS, drive={"torque": 4.0}), end="stop")


def test_a_train_runs_down_by_drags_and_losses():
    shafts = {"crank": {"drag": 1.0}, "m": {"ratio": 2.0, "drag": 1.0, "efficiency": 0.5}}
    shafts |= {"n": {"on": "m", "ratio": 2.0, "drag": 0.5, "efficiency": 0.9}}
    result = scene(shafts, inertia=[{"on": "crank", "value": 2.0}, {"on": "n", "value": 1.0}])
    transient = flywheel.transient(result, start=10.0, end="stop")
    # 3 a + 1 + 0.5 (2 + 0.9 (16 a + 2)) = 0, as the far shafts drive
    assert transient.time == pytest.approx(10.0 * (3.0 + 0.5 * 0.9 * 16.0) / (1.0 + 0.5 * (2.0 + 0.9 * 2.0)), rel=1e-9)


def test_losses_and_a_shaft_that_twists_are_not_followed_together():
    shafts = {"m": {"ratio": 2, "efficiency": 0.9}, "t": {"on": "m", "ratio": 1, "stiffness": 500}}
    weighs = [{"on": name, "value": 0.2} for name in ("crank", "m", "t")]
    with pytest.raises(flywheel.SceneError, match="losses in a mesh of a machine with a shaft that twists"):
        flywheel.simulate(scene(shafts, inertia=weighs), phi=0.0, omega=10.0, until=1.0)


def test_what_is_steep_is_seen_in_the_window_of_its_own_shaft():
    """Twice a turn of the crank, at 135° and 315° of it, within a window that is open there on the faster shaft alone."""
    load = [{"on": "yoke", "force": "100*exp(-((phi - 1.5*pi)/1e-3)**2)", "from": "200 deg", "to": "340 deg"}]
    mechanism = scenes.yoke()["mechanism"] | {"shaft": "fast"}
    built = machine(scenes.yoke(mechanism=mechanism, shafts={"fast": {"ratio": 2}}, load=load))
    for at in (0.75 * np.pi, 1.75 * np.pi):
        assert (np.abs(built.landmarks - at) < 0.01).sum() > 4
