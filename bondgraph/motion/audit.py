"""The power audit: whether every junction and two-port passes on exactly the power it gets, and the energy adds up.

Efforts of all one-ports follow from their laws, an inertia's from its own acceleration. The junction structure then has
more equations than unknown efforts: what is left over is checked, element by element. Energy is checked over the run:
stored - stored at the start + dissipated - supplied.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.faults import GraphError
from bondgraph.motion.dynamics import Dynamics
from bondgraph.motion.stepping import Stretch
from bondgraph.motion.walk import Instant, Walk
from bondgraph.structure import Ratio, Scale, Sum, effort_relations, effort_variables, plan

Array = NDArray[np.float64]

_NO_POWER = 1e-60  # W: less than this is the remains of an iteration towards zero
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(5)


class Audit(NamedTuple):
    """What the audit found.

    power: the greatest power that a junction or two-port does not pass on, over the greatest power of any bond in the run.
    power_at: the element where that happens. energy: the greatest |stored - stored at the start + dissipated - supplied|,
    over the greatest of the energies in the run. stored, dissipated, supplied (J) at the times of the steps, the last two
    since the start.
    """

    power: float
    power_at: str
    energy: float
    stored: Array
    dissipated: Array
    supplied: Array


class Bonds:
    """Flows and efforts of every bond from an `Instant`, with the efforts inside the structure worked out from the ports."""

    def __init__(self, dynamics: Dynamics) -> None:
        self.graph, self.form = dynamics.graph, dynamics.form
        self._effort = effort_variables(self.graph)
        self._ports = [(k, p) for k, p in enumerate(self.form.ports) if p.element.kind != "Sf"]
        waiting = effort_relations(self.graph, self._effort)
        known = {self._effort[p.bond] for _, p in self._ports}
        self._steps = plan(waiting, known)
        self._unknown = sorted(set(self._effort.values()) - known)
        self._left = [r for r in waiting if any(v in self._unknown for v, _, _ in r.terms)]
        self._names = {id(e.law): e.name for e in self.graph.elements.values() if e.law is not None}

    def flows(self, instant: Instant, shape: tuple[int, ...]) -> dict[int, Array]:
        """Bond number -> flow."""
        return {b.number: _filled(instant.flows[self.form.flow[b.number]], shape) for b in self.graph.bonds}

    def efforts(self, instant: Instant, shape: tuple[int, ...]) -> dict[int, Array]:
        """Bond number -> effort."""
        values: list[Any] = [None] * (max(self._effort.values()) + 1)
        for k, port in self._ports:
            values[self._effort[port.bond]] = _filled(instant.efforts[k], shape)

        def ratio(given: Ratio) -> Any:
            return given if isinstance(given, float | int) else instant.moduli[self._names[id(given)]]

        for step in self._steps:
            if isinstance(step, Scale):
                values[step.target] = ratio(step.ratio) * values[step.source]
            elif isinstance(step, Sum):
                values[step.target] = sum(sign * values[source] for source, sign in step.terms)
        if self._unknown:
            self._fit(values, ratio, shape)
        efforts = {b.number: values[self._effort[b.number]] for b in self.graph.bonds}
        return efforts | {p.bond: _filled(instant.efforts[k], shape) for k, p in self._ports}

    def _fit(self, values: list[Any], ratio: Callable[[Ratio], Any], shape: tuple[int, ...]) -> None:
        """Efforts inside loops, by least squares: a loop of rigid parts may leave some of them undetermined."""
        matrix = np.zeros((*shape, len(self._left), len(self._unknown)))
        right = np.zeros((*shape, len(self._left)))
        for row, relation in enumerate(self._left):
            for variable, given, sign in relation.terms:
                if variable in self._unknown:
                    matrix[..., row, self._unknown.index(variable)] += sign * ratio(given)
                else:
                    right[..., row] -= sign * ratio(given) * values[variable]
        solution = (np.linalg.pinv(matrix, rcond=1e-12) @ right[..., None])[..., 0]
        for column, variable in enumerate(self._unknown):
            values[variable] = solution[..., column]

    def imbalances(self, flows: dict[int, Array], efforts: dict[int, Array]) -> dict[str, Array]:
        """Net power into every junction and two-port, by name."""
        inner = self.graph.of_kind("1", "0", "TF", "GY")
        return {
            e.name: sum(
                (b.sign(e.name) * efforts[b.number] * flows[b.number] for b in self.graph.at(e.name)), start=np.zeros(1)
            )
            for e in inner
        }


def audit(dynamics: Dynamics, bonds: Bonds, stretches: Sequence[Stretch], look: Callable[..., Instant]) -> Audit:
    """Audit a run, from five points in each of its steps; `look(times, owner)` evaluates the graph there."""
    starts = np.array([s.start for s in stretches])
    widths = np.array([s.end - s.start for s in stretches])
    times = (starts[:, None] + 0.5 * widths[:, None] * (1.0 + _POINTS)).ravel()
    inside = look(times, np.repeat(np.arange(len(stretches)), _POINTS.size))
    flows, efforts = bonds.flows(inside, times.shape), bonds.efforts(inside, times.shape)
    power = {p.element.name: p.sign * efforts[p.bond] * flows[p.bond] for p in dynamics.form.ports if p.element.kind != "GY"}

    def since_start(*kinds: str) -> Array:
        total = sum((power[e.name] for e in dynamics.graph.of_kind(*kinds)), start=np.zeros(times.size))
        by_step = 0.5 * widths * (total.reshape(-1, _POINTS.size) @ _WEIGHTS)
        return np.concatenate(([0.0], np.cumsum(by_step)))

    edges = np.append(starts, stretches[-1].end)
    owners = np.append(np.arange(len(stretches)), len(stretches) - 1)
    stored, bent = _stored(dynamics, look(edges, owners), edges.shape)
    stored = stored + (since_start("C") if bent else 0.0)
    usual = float(np.abs(stored).max()) / stretches[-1].end
    worst, where = _worst(bonds.imbalances(flows, efforts), flows, efforts, usual)
    dissipated, supplied = since_start("R"), -since_start("Se", "Sf")
    residual = np.abs(stored - stored[0] + dissipated - supplied).max()
    scale = max(float(np.abs(energy).max()) for energy in (stored, dissipated, supplied, since_start("I"), since_start("C")))
    return Audit(worst, where, float(residual / scale) if scale > _NO_POWER else 0.0, stored, dissipated, supplied)


def _worst(
    imbalances: dict[str, Array], flows: dict[int, Array], efforts: dict[int, Array], usual: float
) -> tuple[float, str]:
    """The greatest imbalance over the greatest power, and where; 0 where no power flows but by rounding of the usual one."""
    scale = max(float(np.abs(efforts[n] * flows[n]).max()) for n in flows)
    usual = max(
        usual, max(float(np.abs(e).max()) for e in efforts.values()) * max(float(np.abs(f).max()) for f in flows.values())
    )
    largest = {name: float(np.abs(value).max()) for name, value in imbalances.items()}
    where = max(largest, key=lambda name: largest[name])
    return (0.0 if scale <= max(_NO_POWER, 1e-13 * usual) else largest[where] / scale), where


def energy_scales(dynamics: Dynamics, times: Array, states: Array, anchors: Mapping[str, Any]) -> Array:
    """What each state would be if it held all the energy of a run, from states (a column for every time).

    E = greatest energy of all stores + integral of |e f| over all other ports. A flow has sqrt(2 E/M), M its own term of the
    mass matrix; a spring's displacement the least power of two with |e(q) q|/2 >= E, which a law of any shape has (linear:
    about sqrt(2 E C)); a declared displacement what these flows make of it in the time of the run.
    """
    walk, shape = Walk(dynamics.tables, times, list(states), anchors), times.shape
    with np.errstate(all="ignore"):
        matrix, _, _ = walk.mass_and_force()
        instant, passed, stored = walk.instant(), np.zeros(shape), np.zeros(shape)
        held = {p.element.name: p for p in dynamics.tables.springs}
        for port, effort in zip(dynamics.form.ports, instant.efforts, strict=True):
            flow = _filled(instant.flows[port.variable], shape)
            if port.element.kind == "I":
                stored = stored + 0.5 * dynamics.graph.constant(port.element.name) * flow**2
            elif port.element.name in held:
                stretch = states[dynamics.state.names.index(f"q_{port.element.name}")]
                stored = stored + 0.5 * np.abs(_filled(effort, shape) * stretch)
            elif effort is not None and port.element.kind != "GY":
                passed = passed + np.abs(_filled(effort, shape) * flow)
        energy = float(np.nanmax(stored) + np.nansum(0.5 * (passed[1:] + passed[:-1]) * np.diff(times)))
        flows = [math.sqrt(2.0 * energy / max(float(np.max(matrix[k][k])), 1e-300)) for k in range(len(matrix))]
    return np.array(
        [*flows, *_displaced(dynamics, walk, flows, float(times[-1])), *_stretched(dynamics, states[:, 0], energy)]
    )


def _displaced(dynamics: Dynamics, walk: Walk, flows: list[float], until: float) -> Iterator[float]:
    greatest = [*flows, *(float(np.max(np.abs(u))) for u in walk.coordinates[len(flows) :])]
    for displacement in dynamics.form.displacements:
        gains = walk.gain[dynamics.tables.owner_of[displacement.name]]
        yield until * sum(float(np.max(np.abs(gain))) * greatest[k] for k, gain in gains.items())


def _stretched(dynamics: Dynamics, start: Array, energy: float) -> Iterator[float]:
    walk = Walk(dynamics.tables, 0.0, start.tolist(), {})
    for port in dynamics.tables.springs:
        stretch, taken = 2.0**-100, 0.0
        while taken < energy and stretch < 2.0**100:
            stretch *= 2.0
            try:
                taken = 0.5 * stretch * max(abs(walk.spring(port.element.name, side * stretch)) for side in (-1.0, 1.0))
            except GraphError:  # the law ends here
                break
        yield stretch


def _stored(dynamics: Dynamics, instant: Instant, shape: tuple[int, ...]) -> tuple[Array, bool]:
    """Energy of the inertias and, where all springs are linear, of these; whether some follow a law of their own."""
    graph, total = dynamics.graph, np.zeros(shape)
    bent = any(not graph.is_linear(spring.name) for spring in graph.of_kind("C"))
    for port, effort in zip(dynamics.form.ports, instant.efforts, strict=True):
        if port.element.kind == "I":
            total += 0.5 * graph.constant(port.element.name) * _filled(instant.flows[port.variable], shape) ** 2
        elif port.element.kind == "C" and not bent:
            total += 0.5 * graph.constant(port.element.name) * _filled(effort, shape) ** 2
    return total, bent


def _filled(value: Any, shape: tuple[int, ...]) -> Array:
    return np.broadcast_to(np.asarray(value, dtype=float), shape)
