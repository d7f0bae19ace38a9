"""Which elements settle which flows of a graph: inertias, resistors and gyrators, or springs alone.

A linear question about the junction structure, answered in numbers once for a graph. Moduli that vary count as numbers in
no relation to each other: where they vanish or agree is a matter of single positions.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.graph import BondGraph
from bondgraph.structure import flow_relations

Array = NDArray[np.float64]

INERTIAS, RESISTORS, SPRINGS = range(3)
_SEEN_BY = ({"Sf", "I"}, {"Sf", "I", "R", "GY"}, {"Sf", "I", "R", "GY", "C"})
_SAME = 1e-9
_NOTHING = 1e-12


class Layers:
    """The layers of a graph's flow variables.

    Attributes:
        of: by flow variable, the first layer whose elements' flows leave it no freedom; 3 where no layer's do.

    """

    def __init__(self, graph: BondGraph, flow: Mapping[int, int]) -> None:
        self.graph, self.flow = graph, flow
        self._numbers: dict[int, float] = {}
        self._basis = self._allowed()
        self.of = [len(_SEEN_BY)] * len(self._basis)
        for layer in (SPRINGS, RESISTORS, INERTIAS):
            seen = [e for e in graph.of_kind(*_SEEN_BY[layer]) if e.kind == "Sf" or e.law != 0.0]
            rows = _span(self._basis[[flow[b.number] for e in seen for b in graph.at(e.name)]])
            left = np.linalg.norm(self._basis - self._basis @ rows.T @ rows, axis=1)
            for variable in np.flatnonzero(left <= _SAME):
                self.of[variable] = layer
        for still in self.locked():
            self.of[still] = len(_SEEN_BY)

    def locked(self) -> list[int]:
        """The flow variables that the relations leave nothing but zero."""
        return [int(v) for v in np.flatnonzero(np.linalg.norm(self._basis, axis=1) <= _NOTHING)]

    def unsettled(self, coordinates: Sequence[int], resisted: Sequence[int]) -> list[int] | None:
        """Those of the resisted coordinates that resistors and gyrators do not settle: the slopes of their equations vanish.

        None where the coordinates do not settle the other flows.
        """
        columns = [coordinates.index(v) for v in resisted]
        chosen = self._basis[list(coordinates)]
        if len(_span(chosen)) < self._basis.shape[1]:
            return None
        every = np.linalg.solve(chosen.T, self._basis.T).T
        gains = _unit(np.where(np.abs(every) > _SAME * np.linalg.norm(every, axis=1)[:, None], every, 0.0)[:, columns])
        slopes = np.zeros((len(columns), len(columns)))
        for element in self.graph.of_kind("R"):
            gain = gains[self.flow[self.graph.bond_of(element.name).number]]
            slopes += np.outer(gain, gain) * (element.law != 0.0)
        for k, element in enumerate(self.graph.of_kind("GY")):
            into, out = (gains[self.flow[bond.number]] for bond in self.graph.ends(element.name))
            slopes += _arbitrary(k) * (np.outer(into, out) - np.outer(out, into)) * (element.law != 0.0)
        loose = np.abs(_complement(slopes)).max(axis=1, initial=0.0)
        return [v for v, share in zip(resisted, loose, strict=True) if share > _SAME]

    def _allowed(self) -> Array:
        """A basis of the flows that satisfy all relations: a row of length 1 (or 0) for every flow variable."""
        relations = flow_relations(self.graph, self.flow)
        matrix = np.zeros((len(relations), len(set(self.flow.values()))))
        for row, relation in enumerate(relations):
            for variable, ratio, sign in relation.terms:
                matrix[row, variable] += sign * self._number(ratio)
        return _unit(_complement(_unit(matrix)))

    def _number(self, ratio: Any) -> float:
        if isinstance(ratio, float | int) and ratio:  # 0 says what a modulus says where it vanishes
            return float(ratio)
        return self._numbers.setdefault(id(ratio), _arbitrary(len(self._numbers)))


def _arbitrary(k: int) -> float:
    """Numbers in no relation to each other."""
    return math.sqrt(2.3 + k)


def _unit(rows: Array) -> Array:
    """Rows divided by their lengths, so that small ratios count; what is nothing but rounding, as zero."""
    lengths = np.linalg.norm(rows, axis=1, keepdims=True)
    return np.asarray(np.where(lengths > _NOTHING, rows / np.where(lengths > _NOTHING, lengths, 1.0), 0.0))


def _span(rows: Array) -> Array:
    """An orthonormal basis, by rows, of what rows span."""
    _, sizes, basis = np.linalg.svd(rows)
    return np.asarray(basis[: _rank(sizes)])


def _complement(rows: Array) -> Array:
    """An orthonormal basis, by columns, of what is at right angles to all rows."""
    _, sizes, basis = np.linalg.svd(rows)
    return np.asarray(basis[_rank(sizes) :].T)


def _rank(sizes: Array) -> int:
    return int(np.sum(sizes > _SAME * sizes.max(initial=0.0)))
