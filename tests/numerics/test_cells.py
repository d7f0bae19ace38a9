"""Functions of the angle: cells, collocation, resolution, switches, budgets of work."""

import math
import tracemalloc
from itertools import pairwise

import mpmath
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm

import flywheel
from flywheel.machine.equation import Moments
from flywheel.machine.loads import LoadLaw
from flywheel.numerics import cells
from flywheel.numerics.budget import Cost, Meter, count, counted
from flywheel.numerics.cells import Changes
from flywheel.numerics.expressions import Expression, between, compiled, expression_of, numeral, parse, variable
from flywheel.numerics.intervals import NAMESPACE, Interval
from flywheel.numerics.jets import Jet, jet_namespace
from flywheel.numerics.switching import SwitchingError, breakpoints, resolved, roots
from tests import regimes, scenes
from tests.limits import sample

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


@pytest.mark.parametrize("rows", [1, 128, 300])
def test_a_long_product_is_that_of_its_blocks(rows):
    random = np.random.default_rng(rows)
    left, matrix = random.normal(size=(rows, 21)), random.normal(size=(21, 43))
    assert_allclose(cells.product(left, matrix), left @ matrix, rtol=0, atol=1e-13)
    assert_allclose(cells.product(left, matrix[:, 0]), left @ matrix[:, 0], rtol=0, atol=1e-13)


def test_the_antiderivative_starts_at_zero_in_every_cell():
    mesh, series = fitted(np.cos)
    assert_allclose(cells.value(cells.antiderivative(series, mesh.half), np.full(3, -1.0)), 0.0, atol=4e-16)


def test_derivatives_are_those_of_the_series():
    mesh, series = fitted(np.exp)
    t = np.array([-1.0, 0.2, 1.0])
    value, slope, bend = cells.derivatives(series, t)
    true, half = np.exp(mesh.middle[:, 0] + mesh.half[:, 0] * t), mesh.half[:, 0]
    assert_allclose(value, true, rtol=1e-14)
    assert_allclose(slope, half * true, rtol=1e-12)
    assert_allclose(bend, half**2 * true, rtol=1e-10)


@pytest.mark.parametrize("size", [1e-150, 1.0, 1e150])
def test_roots_of_series_are_exact_whatever_their_size_also_at_ends(size):
    series = cells.fit(size * np.array([np.sin(cells.NODES - 0.3), 1.0 + cells.NODES]))
    t, slope = cells.halley(series, np.array([0.4, 0.0]), np.array([0.1, -1.0]), np.array([0.9, 0.5]))
    assert_allclose(t, [0.3, -1.0], rtol=1e-15)
    assert_allclose(slope, size, rtol=1e-12)


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


@pytest.mark.parametrize("pole", [1.12, 1.2, 1.3, 1.5, -1.15, -1.4])
@pytest.mark.parametrize("power", [1, 2])
def test_a_whole_cell_keeps_no_more_of_a_truncation_than_its_share(pole, power):
    """The integral of (pole - t)^-n over [-1, 1], whose coefficients fall by the same share from pair to pair."""
    mesh = cells.cells(np.array([-1.0, 1.0]))
    series = cells.fit((pole - mesh.phi) ** -power)
    error, share = cells.truncation(series)
    ends = np.array([pole - 1.0, pole + 1.0])
    true = np.log(ends[1] / ends[0]) if power == 1 else 1.0 / ends[0] - 1.0 / ends[1]
    missed = abs(float(cells.accumulated(cells.antiderivative(series, mesh.half))[-1]) - true)
    assert missed <= float((share * cells.TAIL_OF_INTEGRAL * error)[0]) + 1e-14 * abs(true)
    assert share[0] < 0.05


def test_a_series_that_hardly_decays_has_no_share_less_than_the_whole():
    """A corner."""
    mesh = cells.cells(np.array([-1.0, 1.0]))
    assert float(cells.truncation(cells.fit(np.abs(mesh.phi - 0.3)))[1][0]) == pytest.approx(1.0)


def test_crossings_find_roots_jumps_and_the_ends_of_zero_stretches():
    mesh = cells.cells(np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0]))
    phi = mesh.phi
    values = np.array([phi[0] - 0.3, 0 * phi[1], -1 + 0 * phi[2], 0 * phi[3], 2 + 0 * phi[4]])
    result = cells.crossings(cells.fit(values)[None], np.full((1, 1), 1e-12))
    assert_allclose(result.angles(mesh), [0.3, 2.0, 4.0], atol=1e-14)


def test_jumps_stand_at_the_edges_themselves():
    """The middle and half the width of a cell give its end to rounding only."""
    edges = np.concatenate(([0.0], np.cumsum(0.1 + 0.07 * (np.arange(41) % 7))))
    mesh = cells.cells(edges)
    steps = np.where(np.arange(41) % 2, 1.0, -1.0)[:, None] + 0 * mesh.phi
    result = cells.crossings(cells.fit(steps)[None], np.full((1, 1), 1e-12))
    assert (mesh.middle[:-1, 0] + mesh.half[:-1, 0] != edges[1:-1]).any()
    assert result.angles(mesh).tolist() == edges[1:-1].tolist()


def test_crossings_keep_functions_apart_and_in_order():
    mesh, series = fitted(np.sin, np.linspace(0.0, 10.0, 8))
    other = cells.fit(np.cos(mesh.phi))
    result = cells.crossings(np.stack((series, other)), np.full((2, 1), 1e-14))
    assert_allclose(result.angles(mesh)[result.function == 0], np.pi * np.arange(1, 4), atol=1e-14)
    assert_allclose(result.angles(mesh)[result.function == 1], np.pi * (np.arange(3) + 0.5), atol=1e-14)


def test_two_crossings_between_two_grid_points_are_found():
    centre = 0.5 * (cells.GRID[16] + cells.GRID[17]) + 0.5
    close = 2e-3

    def dip(x):
        return (x - centre) ** 2 - close**2

    mesh, series = fitted(dip, np.array([-0.5, 1.5]))
    result = cells.crossings(series[None], np.full((1, 1), 1e-15))
    assert_allclose(result.angles(mesh), [centre - close, centre + close], atol=1e-13)


def test_crossings_on_both_sides_of_a_grid_point_are_found_once():
    mesh, series = fitted(lambda x: (x - 0.5) ** 2 - 1e-6, np.array([-0.5, 1.5]))
    result = cells.crossings(series[None], np.full((1, 1), 1e-15))
    assert_allclose(result.angles(mesh), [0.499, 0.501], atol=1e-12)


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
    result = cells.greatest(cells.fit(function(mesh.phi)))
    fine = function(np.linspace(0, 2 * np.pi, 200_001)).max() if value is None else value
    assert result == pytest.approx(fine, rel=1e-9, abs=1e-13)


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
    result = cells.basis(t, terms)
    assert_allclose(result, np.polynomial.chebyshev.chebvander(t, terms - 1), rtol=0, atol=2e-14)
    assert result[0].tolist() == [1.0] * terms
    twice = cells.basis(np.stack((t, t)), terms)
    assert twice.shape == (2, count, terms)
    assert_allclose(twice[1], result, rtol=0, atol=4e-14)


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


# Linearised motion through cells, against equations whose solutions are known.


MESH = cells.cells(np.array([0.0, 0.7, 1.1, 2.5, 4.0]))
HALF = MESH.half[:, 0]
CELLS, NODES = MESH.phi.shape


def changes(jacobian, by_parameter=None, rest=None, at_ends=None):
    """Of functions of phi: dF/dz (n, n), dF/dp (n, m), and what z_left + integral F exceeds z by (n,)."""
    rows = np.array([[jacobian(phi) for phi in cell] for cell in MESH.phi], dtype=float)
    states = rows.shape[-1]
    by = np.zeros((CELLS, NODES, states, 0))
    if by_parameter is not None:
        by = np.array([[by_parameter(phi) for phi in cell] for cell in MESH.phi], dtype=float)
    nodes = np.zeros((CELLS, states, NODES)) if rest is None else rest
    ends = np.zeros((CELLS, states)) if at_ends is None else at_ends
    return cells.changes(HALF, np.moveaxis(rows, 1, -1), np.moveaxis(by, 1, -1), nodes, ends)


def test_a_small_change_grows_by_the_integral_of_the_slope():
    result = changes(lambda phi: [[np.cos(phi)]])
    assert_allclose(result.start[:, 0, :, 0], np.exp(np.sin(MESH.phi)), rtol=1e-14)
    assert_allclose(1 + result.edge_start[:, 0, 0], np.exp(np.sin(MESH.edges)), rtol=1e-14)


def test_a_parameter_acts_from_where_the_cycle_begins():
    result = changes(lambda phi: [[np.cos(phi)]], lambda phi: [[np.cos(phi), 2 * np.cos(phi)]])
    true = np.exp(np.sin(MESH.phi)) - 1
    assert_allclose(result.by[:, 0, :, 0], true, rtol=1e-13, atol=1e-14)
    assert_allclose(result.by[:, 0, :, 1], 2 * true, rtol=1e-13, atol=1e-14)
    assert_allclose(result.edge_by[:, 0, 0], np.exp(np.sin(MESH.edges)) - 1, rtol=1e-13, atol=1e-14)


@pytest.mark.parametrize("rate", [0.0, -0.8, 1.3])
def test_what_an_iterate_misses_is_carried_from_cell_to_cell(rate):
    left = MESH.edges[:-1]
    missed = np.sin(MESH.phi) - np.sin(left)[:, None]
    result = changes(lambda phi: [[rate]], None, missed[:, None, :], np.diff(np.sin(MESH.edges))[:, None])

    def true(phi):  # z' = rate z + cos phi, z(0) = 0
        return (np.sin(phi) - rate * np.cos(phi) + rate * np.exp(rate * phi)) / (1 + rate**2)

    assert_allclose(result.rest[:, 0], true(MESH.phi), rtol=1e-12, atol=1e-13)
    assert_allclose(result.edge_rest[:, 0], true(MESH.edges), rtol=1e-12, atol=1e-13)


def test_two_states_grow_together():
    matrix = np.array([[-0.3, 1.2], [-2.0, -0.1]])
    result = changes(lambda phi: matrix, lambda phi: matrix[:, :1])
    for k, phi in enumerate(MESH.edges):
        assert_allclose(np.eye(2) + result.edge_start[k], expm(matrix * phi), rtol=1e-13, atol=1e-13)
        # the column of the first state as a parameter: (exp - 1) (1, 0)
        assert_allclose(result.edge_by[k][:, 0], (expm(matrix * phi) - np.eye(2))[:, 0], rtol=1e-12, atol=1e-13)
    inner = np.array([[expm(matrix * phi) for phi in cell] for cell in MESH.phi])
    assert_allclose(np.moveaxis(result.start, 2, 1), inner, rtol=1e-12, atol=1e-13)
    grown, _ = cells.multiplier(result)
    assert grown == pytest.approx(np.exp(-0.2 * 4.0), rel=1e-13)  # a pair of conjugates: half the trace


@pytest.mark.parametrize("slope", [-1e-18, -1e-6, -0.7, 1e-9, 0.4])
def test_damping_keeps_its_digits_however_weak(slope):
    grown, damping = cells.multiplier(changes(lambda phi: [[slope]]))
    assert damping == pytest.approx(-np.expm1(4.0 * slope), rel=1e-14)
    assert grown == pytest.approx(np.exp(4.0 * slope), rel=1e-15)


def test_the_slowest_of_several_changes_is_the_multiplier():
    none = np.zeros((1, 2, 0))
    edge = np.stack([np.zeros((2, 2)), np.diag([-0.9, -0.2])])
    change = Changes(none, none, none, edge, none, none)
    assert cells.multiplier(change) == pytest.approx((0.8, 0.2))


def round_cycle(rate, gap=0.3):
    """One state, z' = rate(phi) z + 1 missed by the iterate, round a cycle that must lose a gap."""
    rates = np.array([[rate(phi) for phi in cell] for cell in MESH.phi])
    missed = MESH.phi - MESH.edges[:-1, None]
    return cells.round_cycle(
        HALF,
        rates[:, None, None, :],
        np.zeros((CELLS, 1, 0, NODES)),
        missed[:, None, :],
        np.diff(MESH.edges)[:, None],
        np.array([gap]),
    )


@pytest.mark.parametrize("rate", [0.4, -0.4, 4.0, -4.0, 7.0])
def test_a_cycle_closes_whichever_way_it_is_followed(rate):
    result = round_cycle(lambda phi: rate)
    base = -result.around[0, -1] / result.around[0, 0]
    edges = base * (1.0 + result.edge_start[:, 0, 0]) + result.edge_rest[:, 0]
    nodes = base * result.start[:, 0, :, 0] + result.rest[:, 0]

    def true(phi):  # z' = rate z + 1, z(4) = z(0) - 0.3
        from_end = np.exp(rate * (phi - 4.0)) / -np.expm1(-4.0 * rate)
        return -1.0 / rate - 0.3 * from_end

    assert_allclose(edges, true(MESH.edges), rtol=1e-9)
    assert_allclose(nodes, true(MESH.phi), rtol=1e-9)
    assert edges[-1] == pytest.approx(edges[0] - 0.3, abs=1e-12)


@pytest.mark.parametrize("slope", [-7.0, -3.0, 2.0, 40.0])
def test_the_multiplier_is_that_of_the_cycle_whichever_way_it_is_followed(slope):
    grown, damping = cells.multiplier(round_cycle(lambda phi: slope + np.cos(phi)))
    exponent = 4.0 * slope + np.sin(4.0)
    assert grown == pytest.approx(np.exp(exponent), rel=1e-11, abs=1e-12)
    assert damping == pytest.approx(-np.expm1(exponent), rel=1e-11)


# Cells that cannot overlook a feature, shown by integrals that a blind rule gets wrong.


TURN = 2 * np.pi
RESOLUTION_NODES, WEIGHTS = np.polynomial.legendre.leggauss(17)


def env(lo, hi, anchor=None):
    return {"phi": Jet(Interval(lo, hi), 1.0), "n": 9.5}


def env_value(phi, anchor=None):
    return {"phi": phi, "n": 9.5}


def cells_of(text, a=0.0, b=TURN):
    expression = parse(text, frozenset({"n"}))
    edges = np.array([a, *breakpoints(expression, a, b, env, env_value), b])
    return expression, np.union1d(edges, resolved(expression, edges[:-1], edges[1:], env, env_value))


def integral(text, a=0.0, b=TURN, most=10_000):
    expression, edges = cells_of(text, a, b)
    assert edges.size < most
    middle, half = 0.5 * (edges[1:] + edges[:-1])[:, None], 0.5 * np.diff(edges)[:, None]
    values = expression.evaluate(env_value(middle + half * RESOLUTION_NODES), np, env_value(middle))
    return float(((np.broadcast_to(values, (half.size, 17)) @ WEIGHTS) * half[:, 0]).sum())


@pytest.mark.parametrize(("place", "width"), sample([(0.7123, 1e-5), (2.0, 1e-1), (5.5, 1e-2), (2.0, 1e-3)], 4))
def test_no_peak_is_missed(place, width):
    result = integral(f"sin(phi) + 100*exp(-((phi - {place})/{width})**2)", most=120)
    assert result == pytest.approx(100 * width * np.sqrt(np.pi), rel=1e-6, abs=1e-14)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1/(1 + ((phi - 2)/1e-4)**2)", 1e-4 * (np.arctan((TURN - 2) * 1e4) + np.arctan(2e4))),
        ("(1 + ((phi - 2)/1e-4)**2)**-1", 1e-4 * (np.arctan((TURN - 2) * 1e4) + np.arctan(2e4))),
        ("atan((phi - 3)/1e-5)", np.pi / 2 * (TURN - 6) - 1e-5 * np.log((TURN - 3) / 3)),
        ("sin(100*phi)**2", np.pi),
        ("cos(phi)**40", TURN * float(mpmath.binomial(40, 20)) / 2**40),
        ("exp(40*cos(phi))", TURN * float(mpmath.besseli(0, 40))),
        ("2**(40*cos(phi))", TURN * float(mpmath.besseli(0, 40 * mpmath.log(2)))),
        ("sqrt(1 - sin(phi))", 4 * np.sqrt(2)),
        ("abs(sin(phi))**0.3", 2 * float(mpmath.beta(0.65, 0.5))),
        ("abs(sin(phi))**n", 2 * float(mpmath.beta(5.25, 0.5))),
        ("log(2.0001 - 2*cos(phi))", TURN * np.log((2.0001 + np.sqrt(2.0001**2 - 4)) / 2)),
        ("asin(sin(phi)) + 1", TURN),
        ("acos(0.9999*cos(phi))", np.pi**2),
        ("atan2(1e-4*sin(phi), cos(phi) - 0.3) + 1", TURN),
        ("tan((phi - pi)/2.05)**2", 2 * 2.05 * (np.tan(np.pi / 2.05) - np.pi / 2.05)),
        ("(phi + 1e-3)**0.5", 2 / 3 * ((TURN + 1e-3) ** 1.5 - 1e-3**1.5)),
        ("(phi + 0.1)**(-n)", (0.1**-8.5 - (TURN + 0.1) ** -8.5) / 8.5),
        ("(1 + phi)**(1 + 0*phi)", TURN + TURN**2 / 2),
        ("1/(phi - 2) if phi > 3 else phi", np.log(TURN - 2) + 4.5),
        ("min(phi, exp(99*(phi - 6)))*(phi < 5.95)", np.exp(-4.95) / 99),
    ],
)
def test_integrals_on_resolved_cells(text, expected):
    assert integral(text) == pytest.approx(expected, rel=1e-9, abs=1e-12)


STEPS = [
    "1/(1 + exp(-{k}*(phi - 3)))",
    "1 - 1/(1 + exp({k}*(phi - 3)))",
    "exp({k}*(phi - 3))/(1 + exp({k}*(phi - 3)))",
    "0.5 + 0.5*(exp({k}/2*(phi - 3)) - exp(-{k}/2*(phi - 3)))/(exp({k}/2*(phi - 3)) + exp(-{k}/2*(phi - 3)))",
    "1/(1 + 2**({k}/log(2)*(3 - phi)))",
]


@pytest.mark.parametrize(
    ("text", "steepness"),
    sample([(text, k) for text in STEPS for k in ("10", "1e4", "1e8") if text is not STEPS[3] or k != "1e8"], 4),
)
def test_smooth_steps_of_any_steepness_are_followed(text, steepness):
    k = float(steepness)
    true = float((mpmath.log1p(mpmath.exp(k * (TURN - 3))) - mpmath.log1p(mpmath.exp(-3 * k))) / k)
    assert integral(text.format(k=steepness), most=120) == pytest.approx(true, rel=1e-8)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("exp(60*phi)*exp(-10*phi**2)*1e-39", 1e-39 * np.exp(90) * np.sqrt(np.pi / 10)),  # where either factor is a trifle
        ("exp(300*phi)*exp(-5000*(phi - 2)**2)*exp(-609)", np.exp(-4.5) * np.sqrt(np.pi / 5000)),
        ("log(1 + exp(1e5*(phi - 3)))", 1e5 * (TURN - 3) ** 2 / 2 + np.pi**2 / 6e5),
        ("phi*exp(1e5*(phi - 3))/(1 + exp(1e5*(phi - 3)))", (TURN**2 - 9) / 2 - np.pi**2 / 6e10),
        ("2e3/(exp(1e3*(phi - 2)) + exp(-1e3*(phi - 2)))", np.pi),
        (
            "exp(-1e-3/(phi - 3)**2)*(phi < 4)*(phi > 2)",
            2 * (np.exp(-1e-3) - np.sqrt(1e-3 * np.pi) * float(mpmath.erfc(1e-3**0.5))),
        ),
    ],
)
def test_exponentials_count_by_what_they_do_to_the_whole(text, expected):
    assert integral(text) == pytest.approx(expected, rel=1e-8)


def test_a_smooth_expression_is_left_alone():
    assert cells_of("3 + phi*sin(phi)", 0.0, 2.5)[1].tolist() == [0.0, 2.5]


def test_branches_that_are_not_taken_ask_for_nothing():
    assert cells_of("exp(1e3*phi) if phi < 0 else phi")[1].tolist() == [0.0, TURN]
    assert cells_of("max(phi + 1, 0.1/(phi + 1e-3) - 1e6)")[1].tolist() == [0.0, TURN]


@pytest.mark.parametrize("text", ["tan(phi)", "1/cos(phi)", "phi**-1.5", "(phi - 3)**-2"])
def test_what_is_not_finite_is_refused(text):
    with pytest.raises(SwitchingError, match="not finite near phi"):
        cells_of(text)


def test_what_varies_too_fast_is_refused():
    with pytest.raises(SwitchingError, match=r"sin\(1e6\*phi\) varies too fast for 10000 cells"):
        cells_of("2 + sin(1e6*phi)")


def test_what_is_infinite_is_named():
    with pytest.raises(SwitchingError, match=r"near phi = 3 \(4/\(phi - 3\): a division by phi - 3, which is 0\)"):
        cells_of("2 - 4/(phi - 3)")


def test_more_cells_than_may_be_added_may_stand_there_already():
    assert cells_of("sign(sin(5100*phi))")[1].size == 10_201


# Roots and breakpoints: all of them, to the last digits, and none hidden between samples.


JETS = jet_namespace(NAMESPACE)


def switch_env(lo, hi, anchor=None):
    return {"phi": Jet(Interval(lo, hi), 1.0)}


def switch_env_value(phi, anchor=None):
    return {"phi": phi}


def found(text, a=0.0, b=TURN, reference=()):
    return breakpoints(parse(text), a, b, switch_env, switch_env_value, reference)


def found_roots(text, a, b):
    expression = parse(text)

    def enclose(lo, hi):
        jet = expression.evaluate(switch_env(lo, hi), JETS)
        return (jet.value, jet.first) if isinstance(jet, Jet) else (jet, 0.0)

    return roots(enclose, lambda phi: expression.evaluate(switch_env_value(phi), np), a, b)


ARC = float(np.arcsin(0.3))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("3", []),
        ("0*phi", []),
        ("phi - 2", [2.0]),
        ("phi + 2", []),
        ("sin(phi)", [np.pi]),
        ("sin(phi) - 0.3", [ARC, np.pi - ARC]),
        ("(phi - 1)*(phi - 1.0001)*(phi - 5)", [1.0, 1.0001, 5.0]),
        ("exp(-((phi - 2)/1e-3)**2) - 0.5", [2 - 1e-3 * np.log(2) ** 0.5, 2 + 1e-3 * np.log(2) ** 0.5]),
        ("exp(-((phi - 2)/1e-6)**2) - 0.5", [2 - 1e-6 * np.log(2) ** 0.5, 2 + 1e-6 * np.log(2) ** 0.5]),
        ("(phi - 1)**3", [1.0]),
        ("tan(phi)", [np.pi / 2, np.pi, 3 * np.pi / 2]),
        ("1/(phi - 2)", [2.0]),
    ],
)
def test_roots_are_found_to_the_last_digits(text, expected):
    assert found_roots(text, 0.0, TURN) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("sin(phi)**2", [np.pi]),
        ("1 - sin(phi)", [np.pi / 2]),
        ("(phi - 1)**2", [1.0]),
        ("(phi - 1)**2*(phi - 3)**4", [1.0, 3.0]),
        ("1 - cos(phi)", []),
    ],
)
def test_touching_zeros_are_found_once_and_not_at_the_ends(text, expected):
    assert found_roots(text, 0.0, TURN) == pytest.approx(expected, abs=2e-9)


def test_functions_above_zero_have_no_root_however_close():
    assert found_roots("(phi - 1)**2 + 1e-12", 0.0, TURN) == []


@pytest.mark.parametrize("count", [1, 2, 4, 7])
def test_every_root_of_a_polynomial_is_found(count):
    rng = np.random.default_rng(count)
    for _ in range(4):
        places = sorted(rng.choice(np.arange(5, 620), count, replace=False) / 100 + rng.uniform(0, 0.01))
        assert found_roots("*".join(f"(phi - {place})" for place in places), 0.0, TURN) == pytest.approx(places, rel=1e-12)


WAVES = [(1, 0.3, -2.1), (2, -0.99, 0.0), (3, 0.0, 0.5), (7, 0.98, 3.0), (19, -0.4, -1.0), (40, 0.7, 2.2)]


@pytest.mark.parametrize(("count", "level", "phase"), WAVES)
def test_every_crossing_of_a_wave_is_found(count, level, phase):
    angles = (np.array([np.arcsin(level), np.pi - np.arcsin(level)])[:, None] - phase + TURN * np.arange(-2, 43)) / count
    expected = np.sort(angles[(angles > 1e-9) & (angles < TURN - 1e-9)])
    roots_ = found_roots(f"sin({count}*phi + {phase!r}) - {level!r}", 0.0, TURN)
    assert [root for root in roots_ if 1e-9 < root < TURN - 1e-9] == pytest.approx(expected, abs=1e-13)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("sin(phi) + phi**2", []),
        ("5*(phi < pi)", [np.pi]),
        ("1 < phi <= 2", [1.0, 2.0]),
        ("3 if phi > 1 and not phi >= 4 else 2", [1.0, 4.0]),
        ("max(sin(phi), 0)", [np.pi]),
        ("abs(abs(phi - 3) - 1)", [2.0, 3.0, 4.0]),
        ("sign(sin(phi)) > 0.5", [np.pi]),
        ("max(0, min(3*sin(phi), 1))", [np.arcsin(1 / 3), np.pi - np.arcsin(1 / 3), np.pi]),
        ("sqrt(1 - sin(phi))", [np.pi / 2]),
        ("asin(sin(phi))", [np.pi / 2, 3 * np.pi / 2]),
        ("abs(phi - 2)**0.5", [2.0]),
        ("atan2(sin(phi), cos(phi))", [np.pi]),
        ("(phi - 1)**3 > 0", [1.0]),
    ],
)
def test_breakpoints_of_expressions(text, expected):
    assert found(text) == pytest.approx(expected, abs=1e-14)


def test_known_angles_are_not_repeated():
    assert found("max(sin(phi), 0)*(phi > 1)", reference=[np.pi]) == [1.0]


def test_hundreds_of_switches_are_found_and_far_too_many_refused():
    def enclosures(count):
        taken = 0

        def counting(lo, hi, anchor=None):
            nonlocal taken
            taken += np.size(lo)
            return switch_env(lo, hi, anchor)

        zeros = breakpoints(parse(f"sin({count}*phi) > 0"), 0.0, TURN, counting, switch_env_value, ())
        assert zeros == pytest.approx(np.pi / count * np.arange(1, 2 * count), rel=1e-13)
        return taken

    assert enclosures(300) < 15 * enclosures(30)
    with pytest.raises(SwitchingError, match=r"sin\(1000000 \* phi\): changes sign too often"):
        found("sin(1e6*phi) > 0")


def test_a_displacement_with_wider_bounds_and_a_velocity_given_by_its_sign():
    """A port with x = cos phi: v changes sign at pi, which is known; x is bounded loosely on purpose."""

    def cells(lo, hi, anchor):
        u = Interval(lo, hi)
        wide = NAMESPACE.cos(u) + Interval(-1.0, 1.0) * (0.1 * u.width)
        return {"x": Jet(wide, -NAMESPACE.sin(u)), "v": np.where(0.5 * (lo + hi) < np.pi, -1.0, 1.0)}

    def values(phi, anchor):
        return {"x": np.cos(phi), "v": np.where(phi < np.pi, -1.0, 1.0)}

    angles = breakpoints(parse("max(x*sign(v), 0.5)*(v > 0)"), 0.0, TURN, cells, values, [np.pi])
    assert angles == pytest.approx([2 * np.pi / 3, 5 * np.pi / 3], rel=1e-14)


@pytest.mark.parametrize("seed", range(5))
def test_no_switch_lies_between_breakpoints(seed):
    a, b, c, d = np.random.default_rng(seed).uniform([0.2, 0.5, -0.9, 0.3], [3.0, 6.0, 0.9, 5.9]).tolist()
    text = f"max({a!r}*sin({b!r}*phi), abs(cos(phi) - {c!r})) if sin(phi*phi/2) < {c!r} else min(phi, {d!r})"
    edges = np.array([0.0, *found(text), TURN])
    middles = 0.5 * (edges[1:] + edges[:-1])
    for switch in parse(text).switches():
        for lo, hi, middle in zip(edges, edges[1:], middles, strict=False):
            inside = np.linspace(lo, hi, 41)[1:-1]
            values = switch.evaluate({"phi": inside}, np, {"phi": middle})
            assert np.all(values >= -1e-13) or np.all(values <= 1e-13), switch.text


def test_laps_add_up_to_the_whole():
    with counted() as tally:
        meter = Meter(tally)
        count(4)
        first = meter.lap()
        count(3)
        second = meter.lap()
    assert (first.evaluations, second.evaluations, meter.cost.evaluations) == (4, 3, 7)
    assert 0.0 < first.seconds + second.seconds <= meter.cost.seconds


def test_stages_are_told_by_name():
    cost = Cost(3, 0.5, {"figures": Cost(1, 0.25)})
    assert cost.as_dict() == {"evaluations": 3, "seconds": 0.5, "figures": {"evaluations": 1, "seconds": 0.25}}


@pytest.mark.parametrize("level", ["normal", "confirm"])
def test_a_sizing_tells_what_it_cost(level):
    scene = flywheel.load(scenes.press())
    with counted() as tally:
        cost = flywheel.size(scene, accuracy=level).cost
    figures, simulation = cost.stages["figures"], cost.stages["simulation"]
    assert cost.evaluations == tally.evaluations == figures.evaluations + simulation.evaluations
    assert figures.seconds + simulation.seconds <= cost.seconds
    assert (simulation.evaluations > 0) == (level == "confirm")
    assert level == "confirm" or flywheel.size(scene, accuracy=level).cost.evaluations == cost.evaluations


def test_cells_are_counted_once_where_loads_depend_on_position_alone():
    sizing = flywheel.size(flywheel.load(scenes.press()), accuracy="normal")
    assert sizing.cycle.mesh.edges.size == sizing.machine.mesh.size  # nothing was halved
    assert sizing.cost.evaluations == sizing.cycle.mesh.phi.size


def test_torques_at_other_speeds_count_again():
    machine = flywheel.Machine(flywheel.load(regimes.scene("section-c", inertia=2)))
    mesh = cells.cells(machine.mesh)
    with counted() as tally:
        moments = Moments(machine, mesh, local=True)
    walked = tally.evaluations
    assert walked == moments.mesh.phi.size
    with counted() as tally:
        moments.rate(np.full(moments.mesh.phi.shape, 4.0), 0.0, 0.0)
    assert tally.evaluations == walked


def test_a_diagram_of_areas_costs_no_evaluation():
    areas = {"areas": {"values": [100, -100], "scale": "1 J"}, "regime": {"speed": "60 rpm"}}
    sizing = flywheel.size(flywheel.load(areas | {"flywheel": {"irregularity": 0.02}}))
    assert sizing.cost.evaluations == 0
    assert sizing.cost.seconds > 0.0


def test_the_motion_is_a_stage_of_its_own_where_torques_depend_on_speed():
    cost = flywheel.size(flywheel.load(regimes.scene("pump", inertia=5)), accuracy="normal").cost
    motion = cost.as_dict()["figures"]["motion"]
    assert 0 < motion["evaluations"] < cost.evaluations


def windows(count, **load):
    """A press whose slider is pushed in so many windows, three fifths of the turn."""
    width = 360 / count
    places = [{"from": f"{k * width} deg", "to": f"{(k + 0.6) * width} deg"} for k in range(count)]
    return scenes.press(load=[{"on": "slider"} | place | load for place in places])


@pytest.mark.parametrize(
    "load", sample([{"force": "-1 kN", "while": "v > 0"}, {"force": "-1 kN"}, {"force": "-1000 - 9*v"}], 3)
)
def test_stepping_asks_only_the_loads_that_act(load, monkeypatch):
    request = []
    law = LoadLaw.__call__
    monkeypatch.setattr(LoadLaw, "__call__", lambda self, here, anchor: request.append(here.q) or law(self, here, anchor))
    cost = flywheel.size(flywheel.load(windows(5, **load)), 1e-4).cost
    assert sum(isinstance(q, float) for q in request) < 3 * cost.evaluations  # a load, the drive, and what searches look at


def test_a_long_table_takes_memory_for_its_rows_and_no_grids():
    rows = 4_000
    angle = np.linspace(0.0, 2 * np.pi, rows)
    table = {"angle": angle.tolist(), "value": (-9 - np.sin(angle)).tolist()}
    scene = flywheel.load(scenes.press(load=[{"on": "crank", "table": table}]))
    tracemalloc.start()
    flywheel.size(scene, accuracy="normal")
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 6_000 * rows


def test_designs_whose_dead_centres_are_known_are_searched_for_none():
    load = [{"on": "slider", "force": "-800*sign(v)"}]
    with counted() as tally:
        machine = flywheel.Machine(flywheel.load(scenes.press(load=load)))
    assert tally.evaluations == 0
    assert machine.breakpoints.tolist() == [0.0, np.pi, 2 * np.pi]


@pytest.mark.parametrize("value", [0.1, -0.1, 1e-300, -2.5e17, -0.0, math.pi])
def test_a_number_is_read_back_to_the_last_bit(value):
    result = float(parse(f"1*{expression_of(value)}").evaluate({}, np))
    assert (result, math.copysign(1, result)) == (value, math.copysign(1, value))
    assert float(compiled("3 - {k}", k=value).evaluate({}, np)) == 3.0 - value


@pytest.mark.parametrize("count", [1, 2, 3, 8, 33])
def test_every_stretch_between_knots_has_its_own_leaf(count):
    knots = [float(k) for k in range(1, count)]
    law = Expression("steps", between(variable("x"), knots, [numeral(10 * k) for k in range(count)]))
    for x in [-1.0, *np.arange(0.0, count, 0.5).tolist(), count + 5.0]:
        assert law.evaluate({"x": x}, np) == 10 * min(max(math.floor(x), 0), count - 1)
