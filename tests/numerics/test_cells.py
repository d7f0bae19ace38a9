from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose

from flywheel.numerics import cells

EDGES = np.array([0.0, 1.0, 2.5, 4.0])


def fitted(function, edges=EDGES):
    mesh = cells.cells(edges)
    return mesh, cells.fit(function(mesh.phi))


def test_nodes_are_interior_and_hold_the_middle_exactly():
    mesh = cells.cells(EDGES)
    assert np.all(mesh.phi > EDGES[:-1, None])
    assert np.all(mesh.phi < EDGES[1:, None])
    assert_allclose(mesh.anchor[:, 0], [0.5, 1.75, 3.25], rtol=1e-16)


def test_fitted_series_interpolate_everywhere():
    mesh, series = fitted(np.exp)
    for t in (-1.0, -0.3, 0.7, 1.0):
        at = np.full(3, t)
        expected = np.exp(mesh.middle[:, 0] + mesh.half[:, 0] * t)
        assert_allclose(cells.value(series, at), expected, rtol=1e-14)


@pytest.mark.parametrize("terms", [1, 2, 5, 10, 16])
def test_polynomials_up_to_the_order_are_integrated_exactly(terms):
    coefficients = np.random.default_rng(terms).uniform(-5, 5, terms)
    polynomial = np.polynomial.Polynomial(coefficients, domain=[0, 4], window=[-1, 1])
    mesh, series = fitted(polynomial)
    rising = cells.antiderivative(series, mesh.half)
    expected = polynomial.integ()(EDGES) - polynomial.integ()(0.0)
    assert_allclose(cells.accumulated(rising), expected, atol=1e-12 * (1 + np.abs(coefficients).sum()))
    assert_allclose(cells.integral(polynomial(mesh.phi), mesh.half).sum(), expected[-1], atol=1e-11)


def test_the_antiderivative_starts_at_zero_in_every_cell():
    mesh, series = fitted(np.cos)
    assert_allclose(cells.value(cells.antiderivative(series, mesh.half), np.full(3, -1.0)), 0.0, atol=4e-16)


@pytest.mark.parametrize("sharpness", [0.5, 1.0, 2.0, 5.0, 12.0])
def test_tails_are_never_below_the_true_error(sharpness):
    def runge(x):
        return 1.0 / (1.0 + (sharpness * (x - 2.0)) ** 2)

    mesh, series = fitted(runge, np.linspace(0.0, 4.0, 7))
    t = np.linspace(-1, 1, 201)
    truth = runge(mesh.middle + mesh.half * t)
    error = np.abs(series @ cells.basis(t, cells.ORDER).T - truth).max(axis=1)
    rounding = 2 * cells.ORDER * cells.ROUNDING  # of a sum of so many terms, accounted for apart
    assert np.all(error <= cells.tails(series) + rounding)
    integrals = np.abs(cells.accumulated(cells.antiderivative(series, mesh.half))[-1])
    exact = (np.arctan(2 * sharpness) * 2) / sharpness
    bound = (cells.TAIL_OF_INTEGRAL * cells.tails(series) * mesh.half[:, 0]).sum()
    assert abs(integrals - exact) <= bound + 1e-14


def test_crossings_find_roots_jumps_and_the_ends_of_zero_stretches():
    mesh = cells.cells(np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0]))
    phi = mesh.phi
    values = np.array([phi[0] - 0.3, 0 * phi[1], -1 + 0 * phi[2], 0 * phi[3], 2 + 0 * phi[4]])
    found = cells.crossings(cells.fit(values)[None], np.full((1, 1), 1e-12))
    assert_allclose(found.angles(mesh), [0.3, 2.0, 4.0], atol=1e-14)


def test_crossings_keep_functions_apart_and_in_order():
    mesh, series = fitted(np.sin, np.linspace(0.0, 10.0, 8))
    other = cells.fit(np.cos(mesh.phi))
    found = cells.crossings(np.stack((series, other)), np.full((2, 1), 1e-14))
    assert_allclose(found.angles(mesh)[found.function == 0], np.pi * np.arange(1, 4), atol=1e-14)
    assert_allclose(found.angles(mesh)[found.function == 1], np.pi * (np.arange(3) + 0.5), atol=1e-14)


def test_two_crossings_between_two_grid_points_are_found():
    centre = 0.5 * (cells.GRID[16] + cells.GRID[17]) + 0.5
    close = 2e-3

    def dip(x):
        return (x - centre) ** 2 - close**2

    mesh, series = fitted(dip, np.array([-0.5, 1.5]))
    found = cells.crossings(series[None], np.full((1, 1), 1e-15))
    assert_allclose(found.angles(mesh), [centre - close, centre + close], atol=1e-13)


def test_crossings_on_both_sides_of_a_grid_point_are_found_once():
    mesh, series = fitted(lambda x: (x - 0.5) ** 2 - 1e-6, np.array([-0.5, 1.5]))
    found = cells.crossings(series[None], np.full((1, 1), 1e-15))
    assert_allclose(found.angles(mesh), [0.499, 0.501], atol=1e-12)


def test_bisecting_cuts_only_the_chosen_cells():
    edges = cells.bisected(EDGES, np.array([False, True, False]))
    assert_allclose(edges, [0.0, 1.0, 1.75, 2.5, 4.0])


@pytest.mark.parametrize(
    ("function", "value"),
    [
        (lambda phi: np.sin(3 * phi) + 0.1 * phi, None),
        (lambda phi: -((phi - 1.234567) ** 2) * 1e-9 + 5.0, 5.0),
        (lambda phi: phi, 2 * np.pi),  # at an end
        (lambda phi: -phi, 0.0),
        (lambda phi: 0.0 * phi - 7.0, -7.0),
    ],
)
def test_greatest_values_lie_at_ends_or_where_the_slope_is_zero(function, value):
    mesh = cells.cells(np.linspace(0, 2 * np.pi, 9))
    found = cells.greatest(cells.fit(function(mesh.phi)))
    fine = function(np.linspace(0, 2 * np.pi, 200_001)).max() if value is None else value
    assert found == pytest.approx(fine, rel=1e-9, abs=1e-13)


def test_the_greatest_value_may_stand_at_a_jump():
    mesh = cells.cells(np.array([0.0, 1.0, 3.0]))
    series = cells.fit(np.where(mesh.phi < 1.0, 3.0 * mesh.phi, 2.0 - mesh.phi))
    assert cells.greatest(series) == pytest.approx(3.0, rel=1e-14)


def test_angles_are_located_in_their_cells():
    mesh = cells.cells(np.array([0.0, 1.0, 3.0]))
    cell, t = cells.located(mesh, np.array([-1.0, 0.0, 0.25, 1.0, 2.5, 3.0, 4.0]))
    assert cell.tolist() == [0, 0, 0, 1, 1, 1, 1]
    assert t.tolist() == [-1.0, -1.0, -0.5, -1.0, 0.5, 1.0, 1.0]


@pytest.mark.parametrize("count", [1, cells._MANY - 1, cells._MANY, 1000])
@pytest.mark.parametrize("terms", [cells.ORDER, cells.ORDER + 1])
def test_polynomials_at_few_abscissas_and_at_many_are_those_of_chebyshev(count, terms):
    t = np.cos(np.linspace(0.0, np.pi, count))
    found = cells.basis(t, terms)
    assert_allclose(found, np.polynomial.chebyshev.chebvander(t, terms - 1), rtol=0, atol=2e-14)
    assert found[0].tolist() == [1.0] * terms
    twice = cells.basis(np.stack((t, t)), terms)
    assert twice.shape == (2, count, terms)
    assert_allclose(twice[1], found, rtol=0, atol=4e-14)


def test_extents_are_those_of_a_fine_grid():
    _, series = fitted(lambda phi: np.sin(3 * phi) + 0.2 * phi)
    least, most = cells.extents(series)
    for k, (a, b) in enumerate(pairwise(EDGES)):
        phi = np.linspace(a, b, 20_001)
        values = np.sin(3 * phi) + 0.2 * phi
        assert_allclose((least[k], most[k]), (values.min(), values.max()), atol=3e-7)


def test_the_rounding_of_a_constant_has_no_roots_to_look_for(monkeypatch):
    """A fitted constant swings by its rounding in every cell; a swing a little larger is found."""
    values = np.full((500, cells.ORDER), 0.1)
    looked = []
    kept = cells.crossings
    monkeypatch.setattr(cells, "crossings", lambda series, noise: looked.append(series.shape[1]) or kept(series, noise))
    least, most = cells.extents(cells.fit(values))
    assert_allclose((least, most), 0.1, rtol=1e-14)
    swinging = cells.fit(values + 1e-14 * cells.NODES**2)
    least, most = cells.extents(swinging)
    assert_allclose(most - least, 1e-14, rtol=0.1)
    assert looked == [0, 500]
