"""Linear algebra of periodic collocation: propagation of small changes through the cells of a cycle, and round it.

On every cell the states z obey z' = F(phi, z, p). Written as an integral, z(phi) = z_left + integral of F, and taken at the
cell's nodes, its linearisation is one small system per cell, all solved at once. The increment of a cell is kept
apart from its left end, so that a cycle that changes its start only little loses no digits.

Source: L. N. Trefethen, Approximation Theory and Approximation Practice, SIAM 2013, chapter 21 (integral collocation);
U. M. Ascher, R. M. M. Mattheij, R. D. Russell, Numerical Solution of Boundary Value Problems, SIAM 1995, section 5.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.numerics import cells as piecewise
from flywheel.numerics.cells import NODES, ORDER

Array = NDArray[np.float64]

# columns of values at the nodes -> their integral from the left end up to each node, and over the whole cell (half = 1)
_UP_TO_NODES: Array = np.ascontiguousarray(
    piecewise.basis(NODES) @ piecewise.antiderivative(piecewise.fit(np.eye(ORDER)), np.ones((1, 1))).T
)
_WHOLE: Array = piecewise.integral(np.eye(ORDER), np.ones((ORDER, 1)))

_MILD = 1.0  # exponent: what changes grow or decay by within a cell whose nodes resolve it
_STEEP = 5.0  # exponent: changes that grow or decay by more than exp of it are followed from where they only decay
_MOST_GROWTH = 700.0  # exponent that a float still holds


class Changes(NamedTuple):
    """Changes of the states as functions of those of z at phi = 0 and of the parameters: dz = start dz0 + by dp + rest.

    At the nodes: `start` (cells, states, nodes, states), `by` (cells, states, nodes, parameters), `rest` (cells, states,
    nodes); at the edges: the same with edges (cells + 1) in place of cells, and no nodes; `start` less the identity there.

    `around` (states, states + parameters + 1) is the gain round the cycle, in addition to dz0: it closes if that is 0.
    Where changes grow by orders of magnitude, dz0 is that at the edge from which none does: backwards, where the whole cycle
    makes them grow, by exp(`growth`).
    """

    start: Array
    by: Array
    rest: Array
    edge_start: Array
    edge_by: Array
    edge_rest: Array
    around: Array | None = None
    growth: float = 0.0

    @property
    def reach(self) -> Array:
        """The greatest effect of an error made anywhere in the cycle, (states, states): on each state, by that of each.

        A state that is off by r at phi = 0 in every cycle is off by Y(phi) (I - M)^-1 r, where M is the effect of a cycle on
        a change and Y the effect up to phi; the largest over the edges, in size.
        """
        through = self.edge_start + np.eye(self.edge_start.shape[-1])
        return np.asarray(np.abs(through @ np.linalg.inv(-self.gained)).max(axis=0))

    @property
    def gained(self) -> Array:
        """The gain over the cycle of a change at its start, (states, states)."""
        edge: Array = self.edge_start[..., -1, :, :]
        return edge if self.around is None else self.around[..., : self.around.shape[-2]]


def round_cycle(half: Array, jacobian: Array, by_parameter: Array, at_nodes: Array, at_edges: Array, gap: Array) -> Changes:
    """The linearised motion round a cycle whose end exceeds its start by a gap (..., states); the changes close it.

    One state is followed from the edge, and in the sense, in which changes only decay: growth by G on the way would
    lose as many digits as G has. Of many motions at once those that need that give NaN. The
    other arguments are those of `changes`.
    """
    growth = np.zeros((*half.shape[:-1], half.shape[-1] + 1))
    (half * (jacobian[..., 0, 0, :] @ _WHOLE)).cumsum(axis=-1, out=growth[..., 1:])
    ended = at_edges.copy()
    ended[..., -1, :] += gap
    turned = np.zeros(half.shape[:-1], bool)
    if jacobian.shape[-2] == 1:
        steep = growth.max(axis=-1) - growth.min(axis=-1) > _STEEP
        turned = steep & ((growth[..., -1] > 0.0) | (growth.argmax(axis=-1) % half.shape[-1] != 0))
    first, backwards = 0, False
    if half.ndim > 1:
        at_nodes = np.where(turned[..., None, None, None], np.nan, at_nodes)
    elif turned:
        first, backwards = int(growth.argmax()) % half.size, bool(growth[-1] > 0.0)
    rows = half, jacobian, by_parameter, at_nodes, ended
    rolled = [np.roll(each, -first, axis=0) for each in rows] if first else rows
    found = _backwards(*rolled) if backwards else changes(*rolled)
    base = 0 if backwards else -1
    ends = found.edge_start, found.edge_by, found.edge_rest[..., None]
    around = np.concatenate([rows[..., base, :, :] for rows in ends], axis=-1)
    if first:
        found = _unrolled(found, first)
    found.edge_rest[..., -1, :] -= gap
    return found._replace(around=around, growth=float(growth[-1]) if backwards else 0.0)


def _backwards(half: Array, jacobian: Array, by_parameter: Array, at_nodes: Array, at_edges: Array) -> Changes:
    """The same as `changes`, as functions of dz where the last cell ends."""
    from_right = at_nodes - at_edges[:, :, None]
    found = changes(
        half[::-1], -jacobian[::-1, ..., ::-1], -by_parameter[::-1, ..., ::-1], from_right[::-1, ..., ::-1], -at_edges[::-1]
    )
    nodes = found.start[::-1, :, ::-1], found.by[::-1, :, ::-1], found.rest[::-1, :, ::-1]
    return Changes(*nodes, found.edge_start[::-1], found.edge_by[::-1], found.edge_rest[::-1])


def _unrolled(found: Changes, first: int) -> Changes:
    """Changes found from the cell `first` round to itself, from phi = 0 on."""
    start, by, rest = (np.roll(rows, first, axis=0) for rows in found[:3])
    edge_start, edge_by, edge_rest = (
        np.concatenate((np.roll(rows[:-1], first, axis=0), rows[[-1 - first]])) for rows in found[3:6]
    )
    return Changes(start, by, rest, edge_start, edge_by, edge_rest)


def changes(half: Array, jacobian: Array, by_parameter: Array, at_nodes: Array, at_edges: Array) -> Changes:
    """The linearised motion through all cells; axes before those that are named are those of many motions at once.

    Args:
        half: half widths of the cells (..., cells).
        jacobian: dF/dz, (..., cells, states, states, nodes).
        by_parameter: dF/dp, (..., cells, states, parameters, nodes).
        at_nodes: excess of z_left + integral of F over z, (..., cells, states, nodes).
        at_edges: the same at the right ends, (..., cells, states).

    """
    if jacobian.shape[-2] > 1:
        return _chained(*_eliminated(half, jacobian, by_parameter, at_nodes, at_edges))
    slope = jacobian[..., 0, 0, :]
    exponents = half[..., None] * (slope @ np.column_stack((_UP_TO_NODES.T, _WHOLE)))
    solved, gained = _faded(half, exponents, slope, by_parameter[..., 0, :, :], at_nodes, at_edges)
    steep = np.abs(exponents).max(axis=-1) > _MILD
    if steep.any():
        rows = (each[steep] for each in (half, jacobian, by_parameter, at_nodes, at_edges))
        solved[steep], gained[steep] = _eliminated(*rows)
    return _chained(solved, gained)


def _faded(
    half: Array, exponents: Array, slope: Array, by_parameter: Array, at_nodes: Array, at_edges: Array
) -> tuple[Array, Array]:
    """Values of one state in each cell for a unit at its left end, for units of the parameters, beside these; and its gains.

    A change y beside the excess r obeys y' = a y + (a r + b dp), so that with G = exp(integral of a) it is
    G (y_left + integral of (a r + b dp)/G). The next step corrects the part that the cell's nodes do not resolve.
    """
    exponents = np.minimum(np.maximum(exponents, -_MILD), _MILD)  # beyond that `_eliminated` is asked
    growth = np.exp(exponents[..., :-1])
    pushed = np.concatenate((by_parameter, slope[..., None, :] * at_nodes), axis=-2) / growth[..., None, :]
    width = half[..., None, None]
    solved = np.empty((*growth.shape[:-1], 1, growth.shape[-1], pushed.shape[-2] + 1))
    solved[..., 0, :, 0] = growth
    solved[..., 0, :, 1:] = np.swapaxes(growth[..., None, :] * (width * (pushed @ _UP_TO_NODES.T)), -2, -1)
    solved[..., 0, :, -1] += at_nodes[..., 0, :]
    gained = np.empty((*half.shape, 1, pushed.shape[-2] + 1))
    gained[..., 0, 0] = np.expm1(exponents[..., -1])
    gained[..., 0, 1:] = np.exp(exponents[..., -1:]) * (half[..., None] * (pushed @ _WHOLE))
    gained[..., 0, -1] += at_edges[..., 0]
    return solved, gained


def _eliminated(half: Array, jacobian: Array, by_parameter: Array, at_nodes: Array, at_edges: Array) -> tuple[Array, Array]:
    """The same of any number of states, by elimination: (I - h S D) dz = 1 dz_left + h S (dF/dp) dp + r."""
    *lead, states, _, nodes = jacobian.shape
    parameters = by_parameter.shape[-2]
    reach = half[..., None, None] * _UP_TO_NODES
    matrix = -np.einsum("...ij,...abj->...aibj", reach, jacobian).reshape(*lead, states * nodes, states * nodes)
    matrix[..., np.arange(states * nodes), np.arange(states * nodes)] += 1.0
    right = np.zeros((*lead, states, nodes, states + parameters + 1))
    for k in range(states):
        right[..., k, :, k] = 1.0
    right[..., states:-1] = np.einsum("...ij,...apj->...aip", reach, by_parameter)
    right[..., -1] = at_nodes
    solved = np.linalg.solve(matrix, right.reshape(*lead, states * nodes, -1)).reshape(right.shape)
    rates = np.einsum("...abj,...bjk->...ajk", jacobian, solved)
    rates[..., states:-1] += np.swapaxes(by_parameter, -2, -1)
    gained = half[..., None, None] * np.einsum("j,...ajk->...ak", _WHOLE, rates)  # over a cell, beside what it starts with
    gained[..., -1] += at_edges
    return solved, gained


def _chained(solved: Array, gained: Array) -> Changes:
    """Cell after cell: each starts with the end of the one before."""
    *lead, count, states, columns = gained.shape
    edges = np.zeros((count + 1, *lead, states, columns))
    for k, gain in enumerate(np.moveaxis(gained, -3, 0) if lead else gained):
        own = gain[..., :states]
        edges[k + 1] = edges[k] + (own * edges[k] if states == 1 else own @ edges[k])
        edges[k + 1] += gain
    edge = np.moveaxis(edges, 0, -3) if lead else edges
    left = edge[..., :-1, :, :].copy()
    left[..., :states] += np.eye(states)
    at_nodes = np.einsum("...ajb,...bk->...ajk", solved[..., :states], left)
    at_nodes[..., states:] += solved[..., states:]
    return Changes(
        at_nodes[..., :states],
        at_nodes[..., states:-1],
        at_nodes[..., -1],
        edge[..., :states],
        edge[..., states:-1],
        edge[..., -1],
    )


def multiplier(change: Changes) -> tuple[Any, Any]:
    """The multiplier of a small change over a cycle (the largest in size), and 1 less it, without cancellation.

    Those of many motions at once are arrays.
    """
    if change.growth:
        return float(np.exp(min(change.growth, _MOST_GROWTH))), -float(np.expm1(min(change.growth, _MOST_GROWTH)))
    grown = change.gained
    if grown.shape[-2:] == (1, 1):
        alone = grown[..., 0, 0]
        return 1.0 + alone, -alone
    eigenvalues = np.linalg.eigvals(grown)
    largest = eigenvalues[np.argmax(np.abs(1.0 + eigenvalues))]
    size = float(np.abs(1.0 + largest))
    return size, float(-largest.real) if largest.imag == 0.0 and largest.real > -1.0 else 1.0 - size
