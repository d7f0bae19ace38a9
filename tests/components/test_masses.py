"""Gear trains, equivalent masses and robot arms."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import sympy as sp
from mpmath import mp
from numpy.testing import assert_allclose

import flywheel
from flywheel import SceneError
from flywheel.arm import (
    Bar,
    TwoLinkArm,
    accelerations,
    driving_torques,
    energy,
    lagrange_equations,
    mass_matrix,
    reactions,
    rest,
    simulate_arm,
    slender,
)
from flywheel.components.gear_trains import Shaft, Stage, gd2, geared_acceleration, geared_torque, on_every_shaft, with_rope
from flywheel.masses import (
    compare,
    conjugate,
    correction_couple,
    equivalent_masses,
    four_masses,
    ten_masses,
    three_masses,
    two_masses,
)
from flywheel.tables.sizing import shafts_table as table

# Geared shafts with losses, against power kept in every mesh and a search over all directions of power.


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
    result = []
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
            result.append(solved[names.index(root)])
    return result


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


# Point masses: printed closed forms, random bodies against sums over their grains, a four-bar that cannot tell.


PHI = np.linspace(0, 2 * np.pi, 37)
CIRCLE = np.column_stack((np.cos([0.1, 1.0, 2.5, 4.0]), np.sin([0.1, 1.0, 2.5, 4.0])))


@pytest.fixture
def rng():
    return np.random.default_rng(20)


def grains(rng, dimensions, count=40):
    """A body as many random grains: masses, places from their centre, inertia."""
    masses = rng.uniform(0.1, 1.0, count)
    places = rng.normal(size=(count, dimensions)) * rng.uniform(0.1, 2.0, dimensions)
    places -= masses @ places / masses.sum()
    if dimensions < 3:
        return masses, places, float(masses @ (places**2).sum(axis=1))
    tensor = sum(m * (p @ p * np.eye(3) - np.outer(p, p)) for m, p in zip(masses, places, strict=True))
    return masses, places, tensor


def assert_complete(result, body_masses, body_places):
    """The same mass, centre and kinetic energy in any motion as the grains."""
    assert result.complete
    assert not any("static" in message for message in result.messages)
    scale = np.abs(result.masses).sum()
    assert_allclose(result.masses.sum(), body_masses.sum(), rtol=0, atol=1e-13 * scale)
    assert_allclose(result.masses @ result.places, 0.0, atol=1e-12 * scale * np.abs(result.places).max())
    seconds = [np.einsum("i,ij,ik", m, p, p) for m, p in ((result.masses, result.places), (body_masses, body_places))]
    if result.places.shape[1] < 3:
        seconds = [np.trace(second) for second in seconds]
    assert_allclose(*seconds, atol=1e-12 * scale * np.abs(result.places).max() ** 2)


def test_three_on_a_line_are_the_printed_formula():
    m, inertia, r_a, r_b = 7.0, 0.9, 0.3, 0.8
    result = three_masses(m, inertia, r_a, r_b)
    printed = [inertia / (r_a * (r_a + r_b)), inertia / (r_b * (r_a + r_b)), m - inertia / (r_a * r_b)]
    assert_allclose(result.masses, printed, rtol=1e-14)
    assert_allclose(result.places[:, 0], [-r_a, r_b, 0.0])
    assert result.complete
    assert result.messages == ()


@pytest.mark.parametrize("count", [3, 4, 10])
def test_random_bodies(rng, count):
    dimensions = {3: 1, 4: 2, 10: 3}[count]
    for _ in range(6):
        masses, places, inertia = grains(rng, dimensions)
        where = rng.normal(size=(count, dimensions))
        assert_complete(equivalent_masses(masses.sum(), inertia, where), masses, places)


@pytest.mark.parametrize("count", [2, 3, 4])
def test_static_sets_keep_mass_and_centre_and_own_up_to_inertia(rng, count):
    dimensions = count - 1
    masses, _, inertia = grains(rng, dimensions)
    result = equivalent_masses(masses.sum(), inertia, rng.normal(size=(count, dimensions)))
    assert not result.complete
    assert result.residual.mass == pytest.approx(0.0, abs=1e-12)
    assert_allclose(result.residual.centre, 0.0, atol=1e-12)
    own = compare(result.masses, result.places, masses.sum(), np.zeros_like(inertia)).inertia
    assert_allclose(result.residual.inertia, own - inertia, atol=1e-12)
    assert any("static equivalence only" in message for message in result.messages)


def test_two_masses_agree_at_the_centre_of_percussion_alone():
    m, inertia, r_a = 4.0, 0.5, 0.4
    r_b = conjugate(m, inertia, r_a)
    assert two_masses(m, inertia, r_a).complete
    assert two_masses(m, inertia, r_a, r_b).masses == pytest.approx(three_masses(m, inertia, r_a, r_b).masses[:2])
    for forced in (0.5 * r_b, 2 * r_b):
        result = two_masses(m, inertia, r_a, forced)
        assert not result.complete
        assert result.residual.inertia == pytest.approx(m * (r_a * forced - inertia / m))
        assert ("too great by" if forced > r_b else "too small by") in result.messages[0]


def test_correction_couple_is_what_the_two_masses_lack_about_their_centre():
    """A uniform rod turned from rest about its centre: the masses' own forces, and the couple, make up -I alpha."""
    m, inertia, r_a, r_b, alpha = 3.0, 0.25, 0.5, 0.5, 7.0
    result = two_masses(m, inertia, r_a, r_b)
    of_masses = -sum(mass * place**2 * alpha for mass, place in zip(result.masses, result.places[:, 0], strict=True))
    assert of_masses + correction_couple(result.residual, alpha) == pytest.approx(-inertia * alpha)


def test_correction_couple_in_space_is_eulers(rng):
    masses, places, tensor = grains(rng, 3)
    result = equivalent_masses(masses.sum(), tensor, rng.normal(size=(4, 3)))
    alpha, omega = rng.normal(size=3), rng.normal(size=3)

    def inertia_couple(m, p):
        acceleration = np.cross(alpha, p) + np.cross(omega, np.cross(omega, p))
        return -np.cross(p, m[:, None] * acceleration).sum(axis=0)

    couple = correction_couple(result.residual, alpha, omega)
    assert_allclose(inertia_couple(result.masses, result.places) + couple, inertia_couple(masses, places), rtol=1e-11)


def test_ten_masses_choose_their_points(rng):
    for _ in range(6):
        masses, places, tensor = grains(rng, 3)
        result = ten_masses(masses.sum(), tensor)
        assert_complete(result, masses, places)
        assert_allclose(result.masses[1:3].sum() + result.masses[8:].sum(), masses.sum() / 3, rtol=1e-10)
        assert (result.masses[7:] > 0).all()


def test_a_plate_has_no_reach_across():
    result = ten_masses(6.0, np.diag([0.2, 0.3, 0.5]))
    assert result.complete
    assert_allclose(result.masses[5:], 0.0, atol=1e-12)
    assert np.abs(result.places[5:, 2]).min() == 0.0
    assert np.abs(result.places[5, 2]) > 0.1


def test_ten_masses_at_30_digits(rng):
    masses, _, tensor = grains(rng, 3)
    where = rng.normal(size=(10, 3))
    result = equivalent_masses(masses.sum(), tensor, where).masses
    with mp.workdps(30):
        rows = [
            [1, x, y, z, y * y + z * z, x * x + z * z, x * x + y * y, -y * z, -x * z, -x * y]
            for x, y, z in (map(mp.mpf, place) for place in where.tolist())
        ]
        i = tensor.tolist()
        expected = [float(masses.sum()), 0, 0, 0, i[0][0], i[1][1], i[2][2], i[1][2], i[0][2], i[0][1]]
        true = mp.lu_solve(mp.matrix(rows).T, mp.matrix(expected))
    assert_allclose(result, np.array(true.tolist(), dtype=float)[:, 0], rtol=1e-10)


@pytest.mark.parametrize(("count", "dimensions", "conditions"), [(4, 1, 3), (9, 1, 3), (5, 2, 4), (8, 2, 4), (13, 3, 10)])
def test_all_but_as_many_as_conditions_are_chosen(rng, count, dimensions, conditions):
    """Any of n points: n - 3 on a line, n - 4 in the plane, n - 10 in space."""
    masses, places, inertia = grains(rng, dimensions)
    points = rng.normal(size=(count, dimensions))
    picked = rng.permutation(count)[: count - conditions]
    chosen = {int(k): float(m) for k, m in zip(picked, rng.uniform(0.1, 2.0, picked.size), strict=True)}
    result = equivalent_masses(float(masses.sum()), inertia, points, chosen)
    assert_complete(result, masses, places)
    assert result.masses[picked].tolist() == [chosen[int(k)] for k in picked]
    scale = np.abs(result.masses) @ (1.0 + (points**2).sum(axis=1))
    gaps = np.abs(result.residual.mass), *np.abs(result.residual.centre), *np.abs(result.residual.inertia).flat
    assert max(gaps) < 1e-15 * scale


def test_the_choice_that_the_determinate_set_makes_gives_that_set():
    """Four masses of which one is 0 are three; a fifth point in the plane takes from the others what it brings."""
    three = three_masses(6.0, 0.5, 0.2, 0.3)
    four = equivalent_masses(6.0, 0.5, [[-0.2], [0.1], [0.3], [0.0]], {1: 0.0})
    assert_allclose(four.masses[[0, 2, 3]], three.masses, rtol=1e-14)
    both = equivalent_masses(6.0, 0.5, [[-0.2], [0.1], [0.3], [0.0]], {1: 2.0})
    moved = np.linalg.solve([[1, 1, 1], [-0.2, 0.3, 0.0], [0.04, 0.09, 0.0]], [2.0, 0.2, 0.02])
    assert_allclose(both.masses[[0, 2, 3]], three.masses - moved, rtol=1e-13)
    static = equivalent_masses(6.0, 0.5, [[-0.2], [0.1], [0.3]], {1: 1.0})
    assert not static.complete
    assert_allclose([static.residual.mass, *static.residual.centre], 0.0, atol=1e-15)


@pytest.mark.parametrize(
    ("places", "chosen", "text"),
    [
        ([[0.0], [1.0], [1.0], [2.0]], {0: 1.0}, "points of which two lie at one place to be found"),
        ([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [0.3, 0.2]], {4: 1.0}, "on one line or circle to be found"),
        ([[-1.0, 0.0], [0.5, 0.0], [0.2, 0.0], [0.7, 0.0]], None, "given by one number each, shape (n, 1)"),
        ([[0.0], [1.0], [2.0], [3.0]], {4: 1.0}, "chosen: found point 4, expected one from 0 to 3"),
        ([[0.0], [1.0], [2.0], [3.0]], {0: np.nan}, "chosen[0]: found nan kg, expected a finite number"),
        ([[0.0], [1.0], [2.0], [3.0], [4.0]], {0: 1.0}, "chosen: found 1 masses for 5 points, expected 2 of them, or 3"),
        ([[0.0], [1.0], [2.0], [3.0]], [1.0], "chosen: found a value of type list, expected masses (kg)"),
    ],
)
def test_choices_that_decide_nothing_are_refused(places, chosen, text):
    with pytest.raises(SceneError) as refused:
        equivalent_masses(2.0, 0.1, places, chosen)
    assert text in str(refused.value)
    assert "\n" not in str(refused.value)


def test_negative_masses_are_reported():
    result = three_masses(1.0, 0.5, 0.3, 0.4)
    assert result.masses[2] < 0
    assert result.complete
    assert "mass 3 is negative" in result.messages[0]


def four_bar(coupler, *extra):
    mechanism = {
        "type": "four-bar",
        "ground": {"length": 0.5},
        "crank": {"length": 0.15, "inertia": 0.02},
        "coupler": {"length": 0.45} | coupler,
        "rocker": {"length": 0.35, "inertia": 0.1},
    }
    scene = {"mechanism": mechanism, "inertia": list(extra), "regime": {"speed": 10}, "flywheel": {"inertia": 0}}
    return flywheel.reduce(flywheel.load(scene), PHI)


def test_a_four_bar_cannot_tell_its_coupler_from_three_masses():
    m, inertia, com = 4.0, 0.08, 0.2
    true = four_bar({"mass": m, "inertia": inertia, "com": com})
    m_a, m_b, m_g = three_masses(m, inertia, com, 0.45 - com).masses.tolist()
    on_pins = {"on": "crank", "value": m_a * 0.15**2}, {"on": "rocker", "value": m_b * 0.35**2}
    replaced = four_bar({"mass": m_g, "com": com}, *on_pins)
    assert_allclose(replaced.inertia, true.inertia, rtol=1e-12)
    assert_allclose(replaced.slope, true.slope, rtol=1e-11, atol=1e-13)


def test_with_two_masses_a_four_bar_is_out_by_their_inertia():
    m, inertia, com = 4.0, 0.03, 0.2
    true = four_bar({"mass": m, "inertia": inertia, "com": com})
    result = two_masses(m, inertia, com, 0.45 - com)
    m_a, m_b = result.masses.tolist()
    forced = four_bar({}, {"on": "crank", "value": m_a * 0.15**2}, {"on": "rocker", "value": m_b * 0.35**2})
    excess = result.residual.inertia * true.gains["four-bar.coupler"] ** 2
    assert_allclose(forced.inertia, true.inertia + excess, rtol=1e-12)
    assert (excess / true.inertia).max() > 0.05


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: two_masses(1.0, 0.1, 0.0), "r_a: found 0 m"),
        (lambda: two_masses("1", 0.1, 0.2), 'mass: found "1", expected a finite number above 0'),
        (lambda: two_masses(1.0, np.nan, 0.1), "inertia: found nan kg m², expected a finite number, 0 or above"),
        (lambda: two_masses(1.0, 0.1, 0.2, "0.1"), 'r_b: found "0.1", expected a finite number'),
        (lambda: three_masses(1.0, 0.1, np.nan, 0.2), "r_a: found nan m"),
        (lambda: conjugate("3", 0.1, 0.2), 'mass: found "3"'),
        (lambda: four_masses(1.0, 0.1, [[1.0, 2.0], [3.0]]), "places: found a value of type list, expected finite numbers"),
        (lambda: compare([1.0, 2.0], [[1.0]], 3.0, 0.1), "places: found an array of shape (1, 1), expected one row a mass"),
        (lambda: correction_couple(1.0, 2.0), "residual: found 1.0, expected a Residual"),
        (lambda: ten_masses(1.0, np.eye(2)), "inertia: found an array of shape (2, 2), expected a tensor"),
        (lambda: two_masses(1.0, 0.1, 0.2, -0.2), "two points at one place"),
        (lambda: three_masses(1.0, 0.1, 0.2, 0.0), "two lie at one place"),
        (lambda: two_masses(-1.0, 0.1, 0.2), "mass: found -1.0 kg"),
        (lambda: two_masses(1.0, -0.1, 0.2), "inertia: found -0.1 kg m²"),
        (lambda: four_masses(1.0, 0.1, CIRCLE), "four points on one line or circle"),
        (lambda: four_masses(1.0, 0.1, np.ones((2, 2))), "shape (2, 2)"),
        (
            lambda: equivalent_masses(1.0, 0.1, np.ones((5, 2))),
            "chosen: found 0 masses for 5 points, expected 1 of them, or 2 for a static set",
        ),
        (lambda: equivalent_masses(1.0, 0.1, [[0.0, 1.0], [1.0, 2.0], [2.0, 3.0]]), "three points on one line"),
        (lambda: equivalent_masses(1.0, 0.1, [[np.nan], [1.0]]), "not finite"),
        (lambda: equivalent_masses(1.0, 0.1, np.eye(4)[:, :3]), "shape ()"),
        (lambda: ten_masses(1.0, np.diag([1.0, 2.0, 4.0])), "principal moments 1, 2, 4"),
        (lambda: ten_masses(1.0, np.eye(3) + np.eye(3, k=1)), "not symmetric"),
        (lambda: ten_masses(np.inf, np.eye(3)), "mass: found inf kg"),
    ],
)
def test_refusals(call, text):
    with pytest.raises(SceneError) as refused:
        call()
    assert text in str(refused.value)
    assert "\n" not in str(refused.value)


def test_ten_points_on_a_sphere_are_refused(rng):
    directions = rng.normal(size=(10, 3))
    sphere = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    with pytest.raises(SceneError, match="surface of second degree"):
        ten_masses(1.0, np.eye(3), sphere)


# The arm against Lagrange's equations in symbols, Newton-Euler bar by bar, energy kept and the pendulum's period.


ARM = TwoLinkArm(Bar(0.7, 4.0, 0.25, 0.4), Bar(0.5, 2.5, 0.09, 0.3))
SWUNG = TwoLinkArm(slender(1.0, 3.0), slender(0.5, 1.2), gravity=-3.7)
START = [2.4, 0.5], [1.0, -3.0]


@pytest.fixture(scope="module")
def found():
    return lagrange_equations()


def test_the_printed_lagrangian_for_bars_with_their_centres_in_the_middle(found):
    """L of the course, p. 68, example 3."""
    l1, m1, i1, c1, m2, i2, c2, g = found.parameters
    l2 = sp.Symbol("l2", positive=True)
    (q1, q2), (w1, w2) = found.q, (q.diff(found.t) for q in found.q)
    printed = m1 * l1**2 / 4 * w1**2 / 2 + i1 * w1**2 / 2 + m2 * l1**2 * w1**2 / 2 + m2 * l2**2 * w2**2 / 8
    printed += m2 * l1 * l2 * w1 * w2 * sp.cos(q1 - q2) / 2 + i2 * w2**2 / 2
    printed -= m1 * g * l1 / 2 * sp.cos(q1) + m2 * g * (l1 * sp.cos(q1) + l2 / 2 * sp.cos(q2))
    own = (found.kinetic - found.potential).subs({c1: l1 / 2, c2: l2 / 2})
    assert sp.simplify(own - printed) == 0


@pytest.mark.parametrize("arm", [ARM, SWUNG])
def test_numbers_agree_with_the_closed_form_at_25_digits(found, arm):
    q, qdot, qddot = [0.8, -1.9], [2.5, -4.0], [30.0, 11.0]
    motion = [angle + w * found.t + b * found.t**2 / 2 for angle, w, b in zip(q, qdot, qddot, strict=True)]
    put = {symbol: sp.Float(value, 30) for symbol, value in found.values(arm).items()}
    left = [
        sp.N(side.subs(put).subs(dict(zip(found.q, motion, strict=True))).doit().subs(found.t, 0), 25) for side in found.left
    ]
    assert [float(left[0] + left[1]), float(left[1])] == pytest.approx(
        driving_torques(arm, q, qdot, qddot).tolist(), rel=1e-13
    )
    matrix = found.mass.subs(put).subs(dict(zip(found.q, q, strict=True)))
    assert np.array(matrix, dtype=float) == pytest.approx(mass_matrix(arm, q), rel=1e-14)


def test_torques_do_work_between_the_bars(found):
    """Virtual power T1 w1 + T2 (w2 - w1)."""
    t1, t2 = found.torques
    w1, w2 = sp.symbols("w1 w2")
    assert sp.expand(found.right[0] * w1 + found.right[1] * w2 - t1 * w1 - t2 * (w2 - w1)) == 0


def test_a_cart_with_a_pendulum_in_symbols():
    """By hand: m1 + m2, m2 c sin and cos of the pendulum's angle from the upward vertical; absolute and relative alike."""
    for relative in (False, True):
        cart = lagrange_equations("PR", relative=relative)
        _, m1, _, _, m2, i2, c2, g = cart.parameters
        (x, a), (force, torque) = cart.q, cart.torques
        xdd, ad, add = x.diff(cart.t, 2), a.diff(cart.t), a.diff(cart.t, 2)
        expected = (
            (m1 + m2) * xdd - m2 * c2 * (add * sp.cos(a) - ad**2 * sp.sin(a)),
            (i2 + m2 * c2**2) * add - m2 * c2 * xdd * sp.cos(a) - m2 * g * c2 * sp.sin(a),
        )
        assert [sp.expand(left - side) for left, side in zip(cart.left, expected, strict=True)] == [0, 0]
        assert cart.right == (force, torque)


@pytest.mark.slow
def test_absolute_and_relative_angles_are_one_motion():
    """T and V of three bars, the absolute angles being sums of the relative ones."""
    one, other = lagrange_equations("RRR"), lagrange_equations("RRR", relative=True)
    sums = {q: sum(other.q[: k + 1]) for k, q in enumerate(one.q)}
    gap = (one.kinetic - one.potential).subs(sums).doit() - (other.kinetic - other.potential)
    assert sp.expand(gap) == 0
    assert [str(side) for side in one.right] == ["T1 - T2", "T2 - T3", "T3"]


@pytest.mark.parametrize("joints", ["", "RX", "RRRRRRR", 2])
def test_joints_that_are_none_are_refused(joints):
    with pytest.raises(SceneError, match=r"joints: found .* expected 1 to 6 letters R"):
        lagrange_equations(joints)


def test_values_are_one_bar_a_joint(found):
    with pytest.raises(SceneError, match="arm: found 1 bars, expected one a joint, 2 in all"):
        found.values([slender(1.0, 1.0)])


def states(count=30):
    """Angles, speeds, accelerations: shape (2, count)."""
    rng = np.random.default_rng(5)
    return tuple(rng.normal(scale=scale, size=(2, count)) for scale in (3.0, 5.0, 20.0))


@pytest.mark.parametrize("arm", [ARM, SWUNG])
def test_newton_and_euler_agree_bar_by_bar(arm):
    """Reactions from Newton's law, torques from Euler's about each centre: x, y, z components written out."""
    q, qdot, qddot = states()
    shoulder, elbow = reactions(arm, q, qdot, qddot)
    (l1, _, i1, c1), (_, _, i2, c2) = arm.first, arm.second
    e1, e2 = (np.array([-np.sin(a), np.cos(a)]) for a in q)

    def moment(arm_of_force, force):
        return arm_of_force[0] * force[1] - arm_of_force[1] * force[0]

    second = i2 * qddot[1] - moment(-c2 * e2, elbow)
    first = i1 * qddot[0] + second - moment(-c1 * e1, shoulder) - moment((l1 - c1) * e1, -elbow)
    assert_allclose(driving_torques(arm, q, qdot, qddot), [first, second], rtol=1e-11, atol=1e-10)


def test_direct_dynamics_undo_inverse_dynamics():
    q, qdot, qddot = states()
    assert_allclose(accelerations(ARM, q, qdot, driving_torques(ARM, q, qdot, qddot)), qddot, rtol=1e-11, atol=1e-10)


def test_accelerations_solve_the_mass_matrix():
    q, qdot, _ = states()
    forces = np.array([7.0 - 2.0, 2.0])
    solved = [np.linalg.solve(mass_matrix(ARM, a), forces - rest(ARM, a, w)) for a, w in zip(q.T, qdot.T, strict=True)]
    assert_allclose(accelerations(ARM, q, qdot, (7.0, 2.0)), np.transpose(solved), rtol=1e-11)


def test_kinetic_energy_is_half_of_momentum_times_speed():
    q, qdot, _ = states()
    kinetic, potential = energy(ARM, q, qdot)
    assert_allclose(kinetic, 0.5 * np.einsum("in,ijn,jn->n", qdot, mass_matrix(ARM, q), qdot), rtol=1e-12)
    (l1, m1, _, c1), (_, m2, _, c2) = ARM.first, ARM.second
    heights = c1 * np.cos(q[0]), l1 * np.cos(q[0]) + c2 * np.cos(q[1])
    assert_allclose(potential, ARM.gravity * (m1 * heights[0] + m2 * heights[1]), rtol=1e-12, atol=1e-12)


def test_the_determinant_keeps_its_digits_where_the_arm_is_straight():
    """A heavy second bar whose inertia is nearly all about the elbow: A C and B² agree to 12 digits."""
    arm = TwoLinkArm(Bar(1.0, 1e-6, 0.0, 1e-3), Bar(1.0, 1.0, 1e-6, 1.0), gravity=0.0)
    result = accelerations(arm, [0.3, 0.3], [0.0, 0.0], [1.0, 0.0])
    with mp.workdps(40):
        a, b, c = mp.mpf(1e-6) * mp.mpf(1e-3) ** 2 + 1, mp.mpf(1), mp.mpf(1e-6) + 1
        exact = [float(v / (a * c - b * b)) for v in (c, -b)]
    assert_allclose(result, exact, rtol=1e-12)


@pytest.mark.parametrize(
    ("bars", "text"),
    [
        ((Bar(0.0, 1.0, 0.1, 0.1), slender(1, 1)), "first.length: found 0.0 m"),
        ((slender(1, 1), Bar(1.0, -1.0, 0.1, 0.1)), "second.mass: found -1.0 kg"),
        ((slender(1, 1), Bar(1.0, 1.0, np.nan, 0.1)), "second.inertia: found nan kg m²"),
        ((slender(1, 1), Bar(1.0, 1.0, 0.1, np.inf)), "second.com: found inf m"),
        ((1, slender(1, 1)), "first: found 1, expected a Bar"),
        ((slender(1, 1), Bar(1.0, "2", 0.1, 0.1)), 'second.mass: found "2", expected a finite number above 0'),
        ((slender(1, 1), Bar(1.0, 1.0, 0.0, 0.0)), "turn without moving any mass"),
        ((Bar(1.0, 1.0, 0.0, 0.0), Bar(1.0, 1.0, 0.0, 1.0)), "turn without moving any mass"),
    ],
)
def test_bars_that_are_none(bars, text):
    with pytest.raises(SceneError) as refused:
        TwoLinkArm(*bars)
    assert text in str(refused.value)
    assert len(refused.value.faults) == 1


def test_arguments_of_different_shapes_or_no_arm():
    with pytest.raises(SceneError, match=r"qdot: found an array of shape \(2, 4\), expected arguments of one shape"):
        rest(ARM, np.zeros((2, 3)), np.zeros((2, 4)))
    with pytest.raises(SceneError, match="arm: found 1, expected a TwoLinkArm"):
        mass_matrix(1, [0.0, 0.0])
    level = accelerations(ARM, np.zeros((2, 3)), np.zeros((2, 3)), (1.0, 0.0))
    assert_allclose(level[:, 1], accelerations(ARM, [0.0, 0.0], [0.0, 0.0], (1.0, 0.0)), rtol=1e-14)


def test_a_slender_bar_has_a_length_and_a_mass():
    with pytest.raises(SceneError) as refused:
        slender("a", -2.0)
    assert [str(fault) for fault in refused.value.faults] == [
        'length: found "a", expected a finite number above 0',
        "mass: found -2.0 kg, expected a finite number above 0",
    ]


def test_arguments_that_are_no_pair():
    with pytest.raises(SceneError, match="q: found an array of shape"):
        mass_matrix(ARM, [1.0, 2.0, 3.0])
    with pytest.raises(SceneError, match="qdot: found a value that is not finite"):
        rest(ARM, [1.0, 2.0], [np.nan, 0.0])
    with pytest.raises(SceneError, match="gravity: found nan"):
        TwoLinkArm(slender(1, 1), slender(1, 1), np.nan)


def test_energy_stays_without_torques():
    motion = simulate_arm(ARM, *START, 0.7, rtol=1e-12)
    total = motion.kinetic + motion.potential
    assert np.ptp(motion.kinetic) > 10.0
    assert motion.energy_residual < 1e-10
    scale = max(motion.kinetic.max(), np.ptp(motion.potential))
    assert motion.energy_residual == pytest.approx(np.abs(total - total[0]).max() / scale, rel=1e-12)
    assert not motion.work.any()


def test_energy_reports_a_loose_tolerance():
    loose, tight = (simulate_arm(ARM, *START, 1.0, rtol=rtol).energy_residual for rtol in (1e-4, 1e-9))
    assert tight < 1e-7 < 1e-6 < loose


def test_bars_balanced_at_the_elbow_swing_like_a_pendulum():
    """With its centre in the elbow bar 2 does not turn; half a period is 2 K(sin(q0/2)) sqrt(A/G1)."""
    arm = TwoLinkArm(slender(0.8, 2.0), Bar(0.4, 1.5, 0.03, 0.0))
    amplitude = 2.0
    k = arm.constants
    half = 2 * float(mp.ellipk(mp.sin(amplitude / 2) ** 2)) * np.sqrt(k.A / k.G1)
    motion = simulate_arm(arm, [np.pi - amplitude, 0.7], [0.0, 0.0], half, rtol=1e-12)
    assert motion.q[:, -1] == pytest.approx([np.pi + amplitude, 0.7], abs=1e-9)
    assert motion.qdot[:, -1] == pytest.approx([0.0, 0.0], abs=1e-9)


def test_torques_from_a_motion_bring_that_motion_about():
    def wanted(t):
        q = np.array([1.0 + 0.5 * np.sin(2 * t), 0.3 * t + 0.4 * np.cos(3 * t)])
        qdot = np.array([np.cos(2 * t), 0.3 - 1.2 * np.sin(3 * t)])
        return q, qdot, np.array([-2 * np.sin(2 * t), -3.6 * np.cos(3 * t)])

    motion = simulate_arm(
        ARM, *wanted(0.0)[:2], 1.0, torques=lambda t, q, qdot: driving_torques(ARM, *wanted(t)), rtol=1e-12
    )
    times = np.linspace(0, 1, 7)
    for result, request in zip(motion.at(times), wanted(times), strict=False):
        assert_allclose(result, request, atol=1e-6)
    assert_allclose(motion.at(motion.t)[0], motion.q, atol=1e-13)
    assert motion.energy_residual < 1e-10
    assert np.abs(motion.work).max() > 1.0


def test_work_of_constant_torques_is_torque_times_angle():
    motion = simulate_arm(ARM, *START, 1.0, torques=lambda t, q, qdot: (3.0, -0.5))
    turned = motion.q[:, -1] - motion.q[:, 0]
    assert motion.work[-1] == pytest.approx(3.0 * turned[0] - 0.5 * (turned[1] - turned[0]), rel=1e-9)


def test_damping_takes_energy():
    motion = simulate_arm(ARM, *START, 3.0, torques=lambda t, q, qdot: (-2 * qdot[0], -(qdot[1] - qdot[0])))
    assert (np.diff(motion.work) <= 0).all()
    assert motion.energy_residual < 1e-8


def test_at_rest_in_balance_nothing_moves():
    motion = simulate_arm(ARM, [0.0, 0.0], [0.0, 0.0], 1.0)
    assert not motion.q.any()
    assert motion.energy_residual == 0.0


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"until": 0.0}, "until: found 0.0"),
        ({"until": "1"}, 'until: found "1"'),
        ({"arm": 1.0}, "arm: found 1.0, expected a TwoLinkArm"),
        ({"q": np.zeros((2, 3))}, r"q: found an array of shape \(2, 3\)"),
        ({"q": "ab"}, 'q: found "ab", expected finite numbers'),
        ({"until": np.inf}, "until: found inf"),
        ({"rtol": -1.0}, "rtol: found -1.0"),
        ({"q": [0.0]}, r"q: found an array of shape \(1,\)"),
        ({"qdot": [0.0, np.nan]}, "qdot: found a value that is not finite"),
        ({"torques": lambda t, q, qdot: (np.nan, 0.0)}, "torques: found a value that is not finite"),
        ({"torques": lambda t, q, qdot: 1.0}, "torques: found an array of shape"),
    ],
)
def test_motions_that_cannot_be(changes, text):
    with pytest.raises(SceneError, match=text):
        simulate_arm(**({"arm": ARM, "q": START[0], "qdot": START[1], "until": 1.0} | changes))
