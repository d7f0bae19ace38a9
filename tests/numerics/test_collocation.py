"""Linearised motion through cells, against equations whose solutions are known."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm

from flywheel.numerics import cells, collocation
from flywheel.numerics.collocation import Changes

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
    return collocation.changes(HALF, np.moveaxis(rows, 1, -1), np.moveaxis(by, 1, -1), nodes, ends)


def test_a_small_change_grows_by_the_integral_of_the_slope():
    found = changes(lambda phi: [[np.cos(phi)]])
    assert_allclose(found.start[:, 0, :, 0], np.exp(np.sin(MESH.phi)), rtol=1e-14)
    assert_allclose(1 + found.edge_start[:, 0, 0], np.exp(np.sin(MESH.edges)), rtol=1e-14)


def test_a_parameter_acts_from_where_the_cycle_begins():
    found = changes(lambda phi: [[np.cos(phi)]], lambda phi: [[np.cos(phi), 2 * np.cos(phi)]])
    true = np.exp(np.sin(MESH.phi)) - 1
    assert_allclose(found.by[:, 0, :, 0], true, rtol=1e-13, atol=1e-14)
    assert_allclose(found.by[:, 0, :, 1], 2 * true, rtol=1e-13, atol=1e-14)
    assert_allclose(found.edge_by[:, 0, 0], np.exp(np.sin(MESH.edges)) - 1, rtol=1e-13, atol=1e-14)


@pytest.mark.parametrize("rate", [0.0, -0.8, 1.3])
def test_what_an_iterate_misses_is_carried_from_cell_to_cell(rate):
    left = MESH.edges[:-1]
    missed = np.sin(MESH.phi) - np.sin(left)[:, None]
    found = changes(lambda phi: [[rate]], None, missed[:, None, :], np.diff(np.sin(MESH.edges))[:, None])

    def true(phi):  # z' = rate z + cos phi, z(0) = 0
        return (np.sin(phi) - rate * np.cos(phi) + rate * np.exp(rate * phi)) / (1 + rate**2)

    assert_allclose(found.rest[:, 0], true(MESH.phi), rtol=1e-12, atol=1e-13)
    assert_allclose(found.edge_rest[:, 0], true(MESH.edges), rtol=1e-12, atol=1e-13)


def test_two_states_grow_together():
    matrix = np.array([[-0.3, 1.2], [-2.0, -0.1]])
    found = changes(lambda phi: matrix, lambda phi: matrix[:, :1])
    for k, phi in enumerate(MESH.edges):
        assert_allclose(np.eye(2) + found.edge_start[k], expm(matrix * phi), rtol=1e-13, atol=1e-13)
        # the column of the first state as a parameter: (exp - 1) (1, 0)
        assert_allclose(found.edge_by[k][:, 0], (expm(matrix * phi) - np.eye(2))[:, 0], rtol=1e-12, atol=1e-13)
    inner = np.array([[expm(matrix * phi) for phi in cell] for cell in MESH.phi])
    assert_allclose(np.moveaxis(found.start, 2, 1), inner, rtol=1e-12, atol=1e-13)
    grown, _ = collocation.multiplier(found)
    assert grown == pytest.approx(np.exp(-0.2 * 4.0), rel=1e-13)  # a pair of conjugates: half the trace


@pytest.mark.parametrize("slope", [-1e-18, -1e-6, -0.7, 1e-9, 0.4])
def test_damping_keeps_its_digits_however_weak(slope):
    grown, damping = collocation.multiplier(changes(lambda phi: [[slope]]))
    assert damping == pytest.approx(-np.expm1(4.0 * slope), rel=1e-14)
    assert grown == pytest.approx(np.exp(4.0 * slope), rel=1e-15)


def test_the_slowest_of_several_changes_is_the_multiplier():
    none = np.zeros((1, 2, 0))
    edge = np.stack([np.zeros((2, 2)), np.diag([-0.9, -0.2])])
    change = Changes(none, none, none, edge, none, none)
    assert collocation.multiplier(change) == pytest.approx((0.8, 0.2))


def round_cycle(rate, gap=0.3):
    """One state, z' = rate(phi) z + 1 missed by the iterate, round a cycle that must lose a gap."""
    rates = np.array([[rate(phi) for phi in cell] for cell in MESH.phi])
    missed = MESH.phi - MESH.edges[:-1, None]
    return collocation.round_cycle(
        HALF,
        rates[:, None, None, :],
        np.zeros((CELLS, 1, 0, NODES)),
        missed[:, None, :],
        np.diff(MESH.edges)[:, None],
        np.array([gap]),
    )


@pytest.mark.parametrize("rate", [0.4, -0.4, 4.0, -4.0, 7.0])
def test_a_cycle_closes_whichever_way_it_is_followed(rate):
    found = round_cycle(lambda phi: rate)
    base = -found.around[0, -1] / found.around[0, 0]
    edges = base * (1.0 + found.edge_start[:, 0, 0]) + found.edge_rest[:, 0]
    nodes = base * found.start[:, 0, :, 0] + found.rest[:, 0]

    def true(phi):  # z' = rate z + 1, z(4) = z(0) - 0.3
        from_end = np.exp(rate * (phi - 4.0)) / -np.expm1(-4.0 * rate)
        return -1.0 / rate - 0.3 * from_end

    assert_allclose(edges, true(MESH.edges), rtol=1e-9)
    assert_allclose(nodes, true(MESH.phi), rtol=1e-9)
    assert edges[-1] == pytest.approx(edges[0] - 0.3, abs=1e-12)


@pytest.mark.parametrize("slope", [-7.0, -3.0, 2.0, 40.0])
def test_the_multiplier_is_that_of_the_cycle_whichever_way_it_is_followed(slope):
    grown, damping = collocation.multiplier(round_cycle(lambda phi: slope + np.cos(phi)))
    exponent = 4.0 * slope + np.sin(4.0)
    assert grown == pytest.approx(np.exp(exponent), rel=1e-11, abs=1e-12)
    assert damping == pytest.approx(-np.expm1(exponent), rel=1e-11)
