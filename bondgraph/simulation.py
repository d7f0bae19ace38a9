"""Motion of any graph in numbers: several independent states, several domains, with a power audit."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.audit import Audit, Bonds, audit
from bondgraph.dynamics import Dynamics
from bondgraph.faults import GraphError
from bondgraph.graph import BondGraph
from bondgraph.laws import TIME
from bondgraph.stepping import ADAPTIVE, FIXED, Breaks, Stretch, adaptive, fixed, through_breaks
from bondgraph.walk import Instant

Array = NDArray[np.float64]

_TIGHTEST = 1e-13  # tolerance of a step: below it rounding wins
_COMPARED = 64  # times at which two runs are compared


@dataclass(frozen=True, eq=False)
class Run:
    """A simulated motion.

    Attributes:
        t: times of the steps, s.
        error: estimated error of the states, each relative to its greatest absolute value in the run: the difference to a
            second run with a looser tolerance (fixed steps: with steps twice as long).
        rtol: what was asked; None for fixed steps.
        audit: the power audit.
        evaluations: how often the rates were evaluated, second run included.

    """

    dynamics: Dynamics
    stretches: tuple[Stretch, ...]
    anchors: tuple[Mapping[str, float], ...]
    error: float
    rtol: float | None
    evaluations: int

    @property
    def t(self) -> Array:
        """Times of the steps, s."""
        return np.array([self.stretches[0].start, *(s.end for s in self.stretches)])

    @property
    def reached(self) -> bool:
        """Whether the estimated error is within the rtol asked (fixed steps: nothing was asked)."""
        return self.rtol is None or self.error <= self.rtol

    @cached_property
    def audit(self) -> Audit:
        """The power audit of the run."""
        return audit(self.dynamics, self._bonds, self.stretches, self._look)

    @cached_property
    def _bonds(self) -> Bonds:
        return Bonds(self.dynamics)

    def states(self, t: Any = None) -> dict[str, Array]:
        """Every state by name at times t (those of the steps if None)."""
        times = self._times(t)
        return dict(zip(self.dynamics.state.names, self._dense(times, self._owners(times)), strict=True))

    def flow(self, name: str, t: Any = None) -> Array:
        """The flow of an element: of a 1-junction the common one, of a one-port the one into it along its bond."""
        self._check_name(name)
        times = self._times(t)
        return self._shaped(self._look(times, self._owners(times)).flows[self.dynamics.form.variable(name)], times)

    def displacement(self, name: str, t: Any = None) -> Array:
        """A declared displacement, or a spring's own."""
        states = self.states(t)
        found = states.get(name, states.get(f"q_{name}"))
        if found is None:
            raise GraphError(f"no displacement {name!r}: the states are {', '.join(states)}")
        return found

    def effort(self, bond: int, t: Any = None) -> Array:
        """The effort of a bond by its number."""
        times = self._times(t)
        efforts = self._bonds.efforts(self._look(times, self._owners(times)), times.shape)
        if bond not in efforts:
            raise GraphError(f"no bond {bond}: the graph has bonds 1 to {len(efforts)}")
        return self._shaped(efforts[bond], times)

    def power(self, name: str, t: Any = None) -> Array:
        """The power into a one-port (out of a source: negative)."""
        self._check_name(name)
        bond = self.dynamics.graph.bond_of(name)
        times = self._times(t)
        flow = self._look(times, self._owners(times)).flows[self.dynamics.form.flow[bond.number]]
        return self._shaped(bond.sign(name) * self.effort(bond.number, times) * flow, times)

    def _check_name(self, name: str) -> None:
        if name not in self.dynamics.graph.elements:
            raise GraphError(f"no element {name!r}: the graph has {', '.join(self.dynamics.graph.elements)}")

    def _times(self, t: Any) -> Array:
        times = self.t if t is None else np.atleast_1d(np.asarray(t, dtype=float))
        if times.size and (times.min() < self.t[0] or times.max() > self.t[-1]):
            raise GraphError(f"found times to {times.max():g} s, expected within 0 and {self.t[-1]:g} s")
        return times

    def _owners(self, times: Array) -> NDArray[np.int_]:
        ends = np.array([s.end for s in self.stretches])
        return np.clip(np.searchsorted(ends, times), 0, ends.size - 1)

    def _dense(self, times: Array, owners: NDArray[np.int_]) -> Array:
        values = np.empty((len(self.dynamics.state.names), times.size))
        for owner in np.unique(owners):
            mine = owners == owner
            values[:, mine] = self.stretches[owner].dense(times[mine])
        return values

    def _look(self, times: Array, owners: NDArray[np.int_]) -> Instant:
        state = self._dense(times, owners)
        anchors = {junction: np.array([self.anchors[owner][junction] for owner in owners]) for junction in self.anchors[0]}
        return self.dynamics.at(times, list(state), anchors)

    def _shaped(self, value: Any, times: Array) -> Array:
        return np.array(np.broadcast_to(np.asarray(value, dtype=float), times.shape))


def simulate(
    graph: BondGraph,
    until: float,
    *,
    initial: Mapping[str, float] | None = None,
    signals: Mapping[str, Any] | None = None,
    rtol: float = 1e-8,
    method: str = "DOP853",
    step: float | None = None,
    breaks: Mapping[str, Any] | None = None,
    tolerance: float | None = None,
) -> Run:
    """Motion of a graph from an initial state.

    Args:
        graph: with a value for every parameter.
        until: time to simulate, s.
        initial: displacements by name, springs' own displacements and independent flows by the name of the spring or of the
            1-junction; 0 (a declared displacement: its own initial value) where nothing is given.
        signals: a number or function of t for every declared signal.
        rtol: error asked of every state, relative to its greatest absolute value in the run.
        method: one of scipy's ("DOP853", "RK45", "RK23", "LSODA", "Radau", "BDF"), or "euler", "rk2" (trapezoidal), "rk4".
        step: length of a fixed step, s.
        breaks: where laws jump or kink, so that the stepping restarts there: displacement name (or "t") -> values, or
            (values, period).
        tolerance: greatest power and energy imbalance that the audit may find; more is an error. None: reported only.

    Raises:
        GraphError: if the motion is not determined, cannot be followed, or fails the audit.

    >>> from bondgraph import Builder, C, I
    >>> b = Builder().one("mass", "translation", displacement="x").on("mass", I("m", 1.0), C("spring", stiffness=1.0))
    >>> run = simulate(b.build(), 3.0, initial={"x": 1.0, "spring": 1.0})
    >>> bool(abs(run.displacement("x", 3.0)[0] - np.cos(3.0)) < 1e-8), run.reached, run.audit.energy < 1e-8
    (True, True, True)

    """
    _check_arguments(until, rtol, method, step)
    dynamics = Dynamics(graph, signals)
    start = _start(dynamics, initial or {})
    stepper = _Stepper(dynamics, method, until, start, _breaks(dynamics, breaks or {}))
    run = stepper.fixed(step) if step is not None else stepper.adaptive(rtol)
    if tolerance is not None:
        _enforce(run.audit, tolerance)
    return run


class _Stepper:
    """One motion, by one method, at whatever tolerance or step."""

    def __init__(
        self, dynamics: Dynamics, method: str, until: float, start: Array, breaks: tuple[list[Breaks], list[float]]
    ) -> None:
        self.dynamics, self.method, self.until, self.start = dynamics, method, until, start
        self.breaks, self.times = breaks
        self.evaluations = 0
        self.junctions = {k: d.of for k, d in enumerate(dynamics.form.displacements, start=dynamics.state.flows)}
        self.anchors: list[Mapping[str, float]] = []
        self._field({})(0.0, start)  # a state without rates is an error before anything is stepped

    def adaptive(self, rtol: float) -> Run:
        """Runs at tighter and tighter tolerance until two of them agree within rtol, or rounding wins."""
        inner = 0.1 * rtol
        run = self._run(inner)
        while True:
            inner = max(0.03 * inner, _TIGHTEST)
            looser, run = run, self._run(inner)
            error = _difference(looser, run)
            if error <= rtol or inner <= _TIGHTEST:
                return Run(run.dynamics, run.stretches, run.anchors, error, rtol, self.evaluations)

    def fixed(self, step: float) -> Run:
        """A run with equal steps, and its difference to one with steps twice as long."""
        longer, run = self._run(None, 2.0 * step), self._run(None, step)
        return Run(run.dynamics, run.stretches, run.anchors, _difference(longer, run), None, self.evaluations)

    def _run(self, rtol: float | None, step: float = 0.0) -> Run:
        self.anchors = []
        scale = np.maximum(np.abs(self.start), 1e-3)
        plain = self._field({})

        def steps(t: float, state: Array, anchors: Mapping[int, float]) -> Iterator[Stretch]:
            field = self._field(anchors)
            by_junction = {self.junctions[k]: value for k, value in anchors.items() if k in self.junctions}
            if rtol is None:
                made = fixed(self.method, field, t, state, self.until, step)
            else:
                made = adaptive(self.method, field, t, state, self.until, rtol, scale)
            for stretch in made:
                self.anchors.append(by_junction)
                yield stretch

        stretches = tuple(through_breaks(steps, plain, self.breaks, self.times, self.start, self.until))
        return Run(self.dynamics, stretches, tuple(self.anchors), 0.0, rtol, 0)

    def _field(self, anchors: Mapping[int, float]) -> Callable[[float, Array], Array]:
        """The rates within one piece, as a field for the integrators; not a number where a law is not defined."""
        rates, size = self.dynamics.rates, self.start.size
        places = {junction: k for k, junction in self.junctions.items()}
        anchored = [places[junction] for junction in self.dynamics.anchored]

        def field(t: float, state: Array) -> Array:
            self.evaluations += 1
            values = state.tolist()
            try:
                return np.array(rates(t, *values, *(anchors.get(k, values[k]) for k in anchored)))
            except (ValueError, ZeroDivisionError, OverflowError) as error:
                if self.evaluations == 1:
                    raise GraphError(f"the laws are not defined at the start: {error}") from error
                return np.full(size, np.nan)

        return field


def _difference(looser: Run, tighter: Run) -> float:
    """The greatest difference of two runs, each state relative to its greatest value."""
    times = np.linspace(0.0, tighter.t[-1], _COMPARED)
    a, b = looser.states(times), tighter.states(times)
    worst = 0.0
    for name, value in b.items():
        scale = float(np.abs(value).max())
        gap = float(np.abs(a[name] - value).max())
        worst = max(worst, gap / scale if scale else gap)
    return worst


def _check_arguments(until: float, rtol: float, method: str, step: float | None) -> None:
    faults = []
    numbers = {"until": until, "rtol": rtol} | ({} if step is None else {"step": step})
    faults += [
        f"{name}: found {v}, expected a number above 0" for name, v in numbers.items() if not (np.isfinite(v) and v > 0)
    ]
    if method not in (*ADAPTIVE, *FIXED):
        faults.append(f"method: found {method!r}, expected one of {', '.join((*ADAPTIVE, *FIXED))}")
    elif method in FIXED and step is None:
        faults.append(f"method {method!r} takes equal steps: give step, in s")
    elif method in ADAPTIVE and step is not None:
        faults.append(f"method {method!r} chooses its own steps: give rtol, not step")
    if faults:
        raise GraphError("\n".join(faults))


def _start(dynamics: Dynamics, initial: Mapping[str, float]) -> Array:
    """The initial state; names may be those of the state, or of the 1-junction or spring that a state belongs to."""
    names = dynamics.state.names
    start = np.zeros(len(names))
    for k, displacement in enumerate(dynamics.form.displacements, start=dynamics.state.flows):
        start[k] = displacement.initial
    faults = []
    for name, value in initial.items():
        found = next((n for n in (name, f"f_{name}", f"q_{name}") if n in names), None)
        if found is None:
            faults.append(f"initial {name!r}: no such state; the independent ones are {', '.join(names)}")
        elif not np.isfinite(value):
            faults.append(f"initial {name!r}: found {value}, expected a finite number")
        else:
            start[names.index(found)] = value
    if faults:
        raise GraphError("\n".join(faults))
    return start


def _breaks(dynamics: Dynamics, given: Mapping[str, Any]) -> tuple[list[Breaks], list[float]]:
    breaks, times = [], []
    for name, values in given.items():
        period = None
        if len(values) == 2 and not isinstance(values[0], float | int):
            values, period = values[0], float(values[1])
        ascending = np.unique(np.asarray(values, dtype=float) % period if period else np.asarray(values, dtype=float))
        if name == TIME:
            times += ascending.tolist()
        elif name in dynamics.state.names:
            breaks.append(Breaks(dynamics.state.names.index(name), ascending, period))
        else:
            raise GraphError(f"breaks {name!r}: no such state; they are t, {', '.join(dynamics.state.names)}")
    return breaks, times


def _enforce(found: Audit, tolerance: float) -> None:
    if not found.power <= tolerance:
        raise GraphError(
            f"power audit: {found.power_at} loses {found.power:.3g} of the greatest power, {tolerance:g} allowed"
        )
    if not found.energy <= tolerance:
        raise GraphError(f"energy audit: {found.energy:.3g} of the energy is missing, {tolerance:g} allowed")
