"""Point masses: printed closed forms, random bodies against sums over their grains, a four-bar that cannot tell."""

from __future__ import annotations

import numpy as np
import pytest
from mpmath import mp
from numpy.testing import assert_allclose

import flywheel
from flywheel.components.equivalent_masses import (
    compare,
    conjugate,
    correction_couple,
    equivalent_masses,
    four_masses,
    ten_masses,
    three_masses,
    two_masses,
)
from flywheel.numerics.faults import SceneError

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


def assert_complete(found, body_masses, body_places):
    """The same mass, centre and kinetic energy in any motion as the grains."""
    assert found.complete
    assert not any("static" in message for message in found.messages)
    scale = np.abs(found.masses).sum()
    assert_allclose(found.masses.sum(), body_masses.sum(), rtol=0, atol=1e-13 * scale)
    assert_allclose(found.masses @ found.places, 0.0, atol=1e-12 * scale * np.abs(found.places).max())
    seconds = [np.einsum("i,ij,ik", m, p, p) for m, p in ((found.masses, found.places), (body_masses, body_places))]
    if found.places.shape[1] < 3:
        seconds = [np.trace(second) for second in seconds]
    assert_allclose(*seconds, atol=1e-12 * scale * np.abs(found.places).max() ** 2)


def test_three_on_a_line_are_the_printed_formula():
    m, inertia, r_a, r_b = 7.0, 0.9, 0.3, 0.8
    found = three_masses(m, inertia, r_a, r_b)
    printed = [inertia / (r_a * (r_a + r_b)), inertia / (r_b * (r_a + r_b)), m - inertia / (r_a * r_b)]
    assert_allclose(found.masses, printed, rtol=1e-14)
    assert_allclose(found.places[:, 0], [-r_a, r_b, 0.0])
    assert found.complete
    assert found.messages == ()


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
    found = equivalent_masses(masses.sum(), inertia, rng.normal(size=(count, dimensions)))
    assert not found.complete
    assert found.residual.mass == pytest.approx(0.0, abs=1e-12)
    assert_allclose(found.residual.centre, 0.0, atol=1e-12)
    own = compare(found.masses, found.places, masses.sum(), np.zeros_like(inertia)).inertia
    assert_allclose(found.residual.inertia, own - inertia, atol=1e-12)
    assert any("static equivalence only" in message for message in found.messages)


def test_two_masses_agree_at_the_centre_of_percussion_alone():
    m, inertia, r_a = 4.0, 0.5, 0.4
    r_b = conjugate(m, inertia, r_a)
    assert two_masses(m, inertia, r_a).complete
    assert two_masses(m, inertia, r_a, r_b).masses == pytest.approx(three_masses(m, inertia, r_a, r_b).masses[:2])
    for forced in (0.5 * r_b, 2 * r_b):
        found = two_masses(m, inertia, r_a, forced)
        assert not found.complete
        assert found.residual.inertia == pytest.approx(m * (r_a * forced - inertia / m))
        assert ("too great by" if forced > r_b else "too small by") in found.messages[0]


def test_correction_couple_is_what_the_two_masses_lack_about_their_centre():
    """A uniform rod turned from rest about its centre: the masses' own forces, and the couple, make up -I alpha."""
    m, inertia, r_a, r_b, alpha = 3.0, 0.25, 0.5, 0.5, 7.0
    found = two_masses(m, inertia, r_a, r_b)
    of_masses = -sum(mass * place**2 * alpha for mass, place in zip(found.masses, found.places[:, 0], strict=True))
    assert of_masses + correction_couple(found.residual, alpha) == pytest.approx(-inertia * alpha)


def test_correction_couple_in_space_is_eulers(rng):
    masses, places, tensor = grains(rng, 3)
    found = equivalent_masses(masses.sum(), tensor, rng.normal(size=(4, 3)))
    alpha, omega = rng.normal(size=3), rng.normal(size=3)

    def inertia_couple(m, p):
        acceleration = np.cross(alpha, p) + np.cross(omega, np.cross(omega, p))
        return -np.cross(p, m[:, None] * acceleration).sum(axis=0)

    couple = correction_couple(found.residual, alpha, omega)
    assert_allclose(inertia_couple(found.masses, found.places) + couple, inertia_couple(masses, places), rtol=1e-11)


def test_ten_masses_choose_their_points(rng):
    for _ in range(6):
        masses, places, tensor = grains(rng, 3)
        found = ten_masses(masses.sum(), tensor)
        assert_complete(found, masses, places)
        assert_allclose(found.masses[1:3].sum() + found.masses[8:].sum(), masses.sum() / 3, rtol=1e-10)
        assert (found.masses[7:] > 0).all()


def test_a_plate_has_no_reach_across():
    found = ten_masses(6.0, np.diag([0.2, 0.3, 0.5]))
    assert found.complete
    assert_allclose(found.masses[5:], 0.0, atol=1e-12)
    assert np.abs(found.places[5:, 2]).min() == 0.0
    assert np.abs(found.places[5, 2]) > 0.1


def test_ten_masses_at_30_digits(rng):
    masses, _, tensor = grains(rng, 3)
    where = rng.normal(size=(10, 3))
    found = equivalent_masses(masses.sum(), tensor, where).masses
    with mp.workdps(30):
        rows = [
            [1, x, y, z, y * y + z * z, x * x + z * z, x * x + y * y, -y * z, -x * z, -x * y]
            for x, y, z in (map(mp.mpf, place) for place in where.tolist())
        ]
        i = tensor.tolist()
        wanted = [float(masses.sum()), 0, 0, 0, i[0][0], i[1][1], i[2][2], i[1][2], i[0][2], i[0][1]]
        true = mp.lu_solve(mp.matrix(rows).T, mp.matrix(wanted))
    assert_allclose(found, np.array(true.tolist(), dtype=float)[:, 0], rtol=1e-10)


@pytest.mark.parametrize(("count", "dimensions", "conditions"), [(4, 1, 3), (9, 1, 3), (5, 2, 4), (8, 2, 4), (13, 3, 10)])
def test_all_but_as_many_as_conditions_are_chosen(rng, count, dimensions, conditions):
    """Any of n points: n - 3 on a line, n - 4 in the plane, n - 10 in space."""
    masses, places, inertia = grains(rng, dimensions)
    points = rng.normal(size=(count, dimensions))
    picked = rng.permutation(count)[: count - conditions]
    chosen = {int(k): float(m) for k, m in zip(picked, rng.uniform(0.1, 2.0, picked.size), strict=True)}
    found = equivalent_masses(float(masses.sum()), inertia, points, chosen)
    assert_complete(found, masses, places)
    assert found.masses[picked].tolist() == [chosen[int(k)] for k in picked]
    scale = np.abs(found.masses) @ (1.0 + (points**2).sum(axis=1))
    gaps = np.abs(found.residual.mass), *np.abs(found.residual.centre), *np.abs(found.residual.inertia).flat
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
    found = three_masses(1.0, 0.5, 0.3, 0.4)
    assert found.masses[2] < 0
    assert found.complete
    assert "mass 3 is negative" in found.messages[0]


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
    found = two_masses(m, inertia, com, 0.45 - com)
    m_a, m_b = found.masses.tolist()
    forced = four_bar({}, {"on": "crank", "value": m_a * 0.15**2}, {"on": "rocker", "value": m_b * 0.35**2})
    excess = found.residual.inertia * true.gains["four-bar.coupler"] ** 2
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
