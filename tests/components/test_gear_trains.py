"""Geared shafts with losses, against power kept in every mesh and a search over all directions of power."""

import itertools
import math

import numpy as np
import pytest

from flywheel.components.gear_trains import Shaft, Stage, gd2, geared_acceleration, geared_torque, on_every_shaft, with_rope
from flywheel.numerics.faults import SceneError
from flywheel.tables.flywheels import shafts_table as table


def drawn(seed):
    """A random tree of two to seven shafts."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 8))
    names = [f"s{k}" for k in range(count)]
    shafts = {n: Shaft(*rng.uniform([0.1, -20.0, 0.0], [5.0, 20.0, 3.0])) for n in names}
    stages = []
    for k in range(1, count):
        pair = [names[int(rng.integers(k))], names[k]]
        if rng.random() < 0.5:
            pair.reverse()
        stages.append(Stage(*pair, float(np.exp(rng.uniform(-1.5, 1.5))), float(rng.uniform(0.4, 1.0))))
    return shafts, stages


def by_search(shafts, stages, root, direction):
    """Every consistent motion: unknown accelerations and mesh torques as one linear system for each choice of directions."""
    names = list(shafts)
    n, m = len(names), len(stages)
    found = []
    for choice in itertools.product((True, False), repeat=m):
        matrix, right = np.zeros((n + m, n + m)), np.zeros(n + m)
        for i, name in enumerate(names):
            matrix[i, i] = shafts[name].inertia
            right[i] = shafts[name].torque - direction * shafts[name].friction
        for k, (stage, forward) in enumerate(zip(stages, choice, strict=True)):
            near, far = names.index(stage.driving), names.index(stage.driven)
            share = stage.efficiency if forward else 1 / stage.efficiency
            matrix[far, n + k] = -1.0  # the driven shaft receives tau
            matrix[near, n + k] = stage.ratio / share
            matrix[n + k, far], matrix[n + k, near] = 1.0, -stage.ratio
        solved = np.linalg.solve(matrix, right)
        if all((tau * direction >= 0.0) == forward for tau, forward in zip(solved[n:], choice, strict=True)):
            found.append(solved[names.index(root)])
    return found


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("seed", range(15))
def test_the_one_consistent_motion_is_found_and_meshes_lose_their_share(seed, direction):
    shafts, stages = drawn(seed)
    running = geared_acceleration(shafts, stages, direction=direction)
    (alpha,) = by_search(shafts, stages, "s0", direction)
    assert running.accelerations["s0"] == pytest.approx(alpha, rel=1e-10, abs=1e-11)
    for mesh, stage in zip(running.meshes, stages, strict=True):
        power_in, power_out = mesh.torque_in * direction, stage.ratio * mesh.torque_out * direction
        if mesh.forward:
            assert power_in >= 0.0
            assert power_out == pytest.approx(stage.efficiency * power_in, rel=1e-12)
        else:
            assert power_out <= 0.0
            assert power_in == pytest.approx(stage.efficiency * power_out, rel=1e-12)
        assert mesh.lost * direction >= 0.0


@pytest.mark.parametrize("seed", range(8))
def test_the_motion_does_not_depend_on_the_shaft_of_reduction(seed):
    shafts, stages = drawn(seed)
    first = geared_acceleration(shafts, stages)
    for name in shafts:
        other = geared_acceleration(shafts, stages, on=name)
        for shaft, alpha in first.accelerations.items():
            assert other.accelerations[shaft] == pytest.approx(alpha, rel=1e-9, abs=1e-11)
        assert [mesh.forward for mesh in other.meshes] == [mesh.forward for mesh in first.meshes]
        assert other.moment == pytest.approx(other.inertia * other.accelerations[name], rel=1e-9, abs=1e-10)
    needed = geared_torque(shafts, stages, "s0", 3.7)
    pushed = shafts | {"s0": shafts["s0"]._replace(torque=shafts["s0"].torque + needed.torque)}
    assert geared_acceleration(pushed, stages).accelerations["s0"] == pytest.approx(3.7, rel=1e-10)
    assert needed.inertia * 3.7 == pytest.approx(needed.moment + needed.torque, rel=1e-12, abs=1e-11)


def test_without_losses_inertias_and_torques_add_by_their_ratios():
    shafts = {"a": Shaft(1.0, 4.0), "b": Shaft(2.0, -3.0), "c": Shaft(0.5, 1.0)}
    running = geared_acceleration(shafts, [Stage("a", "b", 0.5), Stage("c", "b", 0.125)])
    assert running.inertia == pytest.approx(1.0 + 2.0 * 0.5**2 + 0.5 * 4.0**2, rel=1e-15)
    assert running.moment == pytest.approx(4.0 - 3.0 * 0.5 + 4.0, rel=1e-15)
    assert all(mesh.lost == 0.0 for mesh in running.meshes)


def test_a_shaft_that_drives_in_one_motion_is_driven_in_the_other():
    hoist = {"drum": with_rope(Shaft(20.0), 100.0, 0.4, 981.0), "rotor": Shaft(0.5)}
    stage = [Stage("drum", "rotor", 10.0, 0.5)]
    sinking, rising = geared_acceleration(hoist, stage), geared_acceleration(hoist, stage, direction=-1)
    assert sinking.accelerations["drum"] == pytest.approx(392.4 / (36.0 + 50.0 / 0.5), rel=1e-14)
    assert rising.accelerations["drum"] == pytest.approx(392.4 / (36.0 + 50.0 * 0.5), rel=1e-14)
    assert [sinking.meshes[0].forward, rising.meshes[0].forward] == [True, False]


@pytest.mark.parametrize(("weight", "direction"), [(30.0, 1), (10.0, 0), (-10.0, 0), (-30.0, -1)])
def test_from_rest_it_starts_only_past_friction(weight, direction):
    shafts = {"drum": Shaft(2.0, weight), "rotor": Shaft(0.1, 0.0, 2.0)}
    running = geared_acceleration(shafts, [Stage("drum", "rotor", 5.0, 0.5)], direction=0)
    assert running.direction == direction
    assert np.sign(running.accelerations["drum"]) == direction
    assert running.inertia > 0.0


def test_a_train_without_losses_but_with_a_tie_of_directions_settles():
    running = geared_acceleration({"a": Shaft(1.0), "b": Shaft(1.0)}, [Stage("a", "b", 2.0, 0.7)])
    assert running.accelerations == {"a": 0.0, "b": 0.0}


@pytest.mark.parametrize(
    ("shafts", "stages", "paths"),
    [
        ({}, [], ["shafts"]),
        ({"a": Shaft(0.0)}, [], ["shafts"]),
        ({"a": Shaft(1.0), "b": Shaft(1.0)}, [], ["stages"]),
        ({"a": Shaft(1.0)}, [Stage("a", "a", 1.0)], ["stages"]),
        ({"a": Shaft(1.0), "b": Shaft(1.0)}, [Stage("a", "b", 1.0), Stage("b", "a", 1.0)], ["stages"]),
        ({"a": Shaft(-1.0, math.nan, -2.0)}, [], ["a.inertia", "a.torque", "a.friction"]),
        ({"a": Shaft(1.0)}, [Stage("a", "c", 0.0, 1.5)], [f"stages[0].{key}" for key in ("driven", "ratio", "efficiency")]),
    ],
)
def test_what_is_no_train_is_refused(shafts, stages, paths):
    with pytest.raises(SceneError) as caught:
        geared_acceleration(shafts, stages)
    assert [fault.path for fault in caught.value.faults] == paths


@pytest.mark.parametrize(
    "call", [lambda s: geared_acceleration(s, [], direction=2), lambda s: geared_torque(s, [], "a", 1.0, 0)]
)
def test_a_direction_is_a_sign(call):
    with pytest.raises(SceneError, match="direction: found"):
        call({"a": Shaft(1.0)})


RATIOS = {"crank": 1.0, "motor": 12.0, "slow": 0.25}


def test_the_same_flywheel_stores_the_same_on_every_shaft():
    rows = on_every_shaft(7.0, RATIOS, 9.0, on="motor")
    assert [row.energy for row in rows] == pytest.approx([0.5 * 7.0 * (12 * 9.0) ** 2] * 3, rel=1e-14)
    assert [row.gd2 for row in rows] == [4 * row.inertia for row in rows]
    assert rows[1].inertia == 7.0
    assert all(row.radius is row.mass is row.rim_speed is None for row in rows)


def test_one_rim_speed_asks_for_one_mass_one_radius_does_not():
    alike = on_every_shaft(7.0, RATIOS, 9.0, rim_speed=25.0)
    assert [row.mass for row in alike] == pytest.approx([7.0 * 9.0**2 / 25.0**2] * 3, rel=1e-14)
    assert [row.radius * row.speed for row in alike] == pytest.approx([25.0] * 3, rel=1e-14)
    sized = on_every_shaft(7.0, RATIOS, 9.0, radius=0.5)
    assert [row.mass * row.rim_speed**2 for row in sized] == pytest.approx([7.0 * 9.0**2] * 3, rel=1e-14)
    assert [row.rim_speed for row in sized] == pytest.approx([4.5, 54.0, 1.125], rel=1e-14)


def test_the_exam_of_march_2010():
    first, second = on_every_shaft(10.2560149258, {"crank": 1.0, "second": 2.0}, 7 * math.pi)
    assert second.inertia == pytest.approx(2.56400373, rel=1e-8)
    assert first.gd2 == gd2(first.inertia)


def test_both_sizes_or_an_unknown_shaft_are_refused():
    with pytest.raises(SceneError) as caught:
        on_every_shaft(1.0, {"crank": 1.0, "b": -1.0}, 1.0, on="c", radius=1.0, rim_speed=2.0)
    assert [fault.path for fault in caught.value.faults] == ["ratios.b", "radius", "on"]


def test_the_table_has_a_line_a_shaft_and_sizes_where_they_are_known():
    bare, sized = on_every_shaft(7.0, RATIOS, 9.0), on_every_shaft(7.0, RATIOS, 9.0, radius=0.5)
    assert "radius" not in table(bare)[0]
    assert "rim speed, m/s" in table(sized)[0]
    assert [line.split()[0] for line in table(sized)] == ["shaft", *RATIOS]
    assert float(table(sized)[2].split()[-1]) == 54.0
    assert sized[0].as_dict()["energy"] == sized[0].energy
