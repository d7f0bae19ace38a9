"""Motion of any graph in numbers: several independent states, several domains, an error bound, and a power audit.

`simulate` runs an adaptive method, or one with equal steps, at tighter tolerance and with shorter steps until two runs
agree. The audit tells whether every junction and two-port passes on exactly the power it gets, and whether the energy adds
up: efforts of all one-ports follow from their laws, an inertia's from its own acceleration; the junction structure then has
more equations than unknown efforts, and what is left over is checked, element by element. Energy is checked over the run:
stored - stored at the start + dissipated - supplied.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from numbers import Real
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.elements import ONE_PORTS
from bondgraph.graph import BondGraph, Ratio, Scale, Sum, effort_relations, effort_variables, plan
from bondgraph.laws import TIME, GraphError, refuse
from bondgraph.motion import runge_kutta
from bondgraph.motion.algebra import WEIGHTLESS
from bondgraph.motion.dynamics import Dynamics, Instant, Walk
from bondgraph.motion.stepping import ADAPTIVE, FIXED, PLAIN, Breaks, Step, StepError, adaptive, fixed, through_breaks
from bondgraph.numerics import count, counting

Array = NDArray[np.float64]

_LOOSE = 1e-5  # of what is asked: down to it order 5 takes less work than order 8
_PILOT, _PLAIN_PILOT = 1e-4, 1e-3  # tolerance of the run that only tells how large the states become
_FIRST, _FIRST_LOOSE = 0.002, 0.02  # tolerance of the next run's steps to what is asked (order 5): mostly two more runs
_TIGHTEST = 1e-13  # tolerance of a step: below it rounding wins
_SHORTER = 0.7  # each further run's steps to those of the run before, at least
_MOST_RUNS = 12  # at tolerances that get tighter
_WITHIN = (0.27, 0.61, 1.0)  # parts of a step at which two runs are compared
_MOST_COMPARED = 20_000  # steps at which they are
_FIXED_RATIO = 0.382  # of the shorter step that a fixed one is compared with: no simple part of it, so that no load hides
_LEAST_STEPS = 400  # steps of a run whose loads vary, at least
_SAMPLES = 400  # times at which a run's powers are summed up
_EVALUATIONS = 2_000_000  # of the rates, all runs together
_NO_ENERGY = math.sqrt(np.finfo(float).eps)  # of the state that would hold all of it: the energy of less is rounding of it

_STABLE = {"RK23": 2.5, "RK45": 3.3, "DOP853": 6.1, "LSODA": 0.5}  # step times decay rate
_OBSERVED = 500  # steps after which a method's steps are held against that: any mode at that limit has decayed by then
_MANY = 2000  # steps: fewer are as well taken by the explicit method
_STIFF = "Radau"
_EXPLICIT = ("RK23", "RK45", "DOP853")
_THROUGH_DEAD_CENTRES = "LSODA"  # its Jacobian is of a step's end, where Radau's, of its start, knows of no inertia ahead
_NOT_FINITE = "the rates are not finite"
_NO_INERTIA = 1e-6  # of the greatest in the run
_PILOT_EVALUATIONS = 50_000
_BESIDE = 0.01  # of a displacement and of 1: how far beside a position the inertia is looked at

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


@dataclass(frozen=True, eq=False)
class Run:
    """A simulated motion.

    Attributes:
        t: times of the steps, s.
        error: error bound of the states, each relative to its greatest absolute value in the run (to what it would be with
            all the energy of the run, where it stays at rounding: its energy below 2e-16 of the run's): twice the difference
            to a run with longer steps and a looser tolerance, never less than the tolerance (fixed steps: to a run with
            steps of 0.382 of the length).
        rtol: what was asked; None for fixed steps.
        method: by which the motion was found; another than the one asked for where that one's steps were held short by
            modes that had long decayed.
        messages: what the user should know of how the motion was found.
        audit: the power audit.
        evaluations: how often the rates were evaluated, all runs together.

    """

    dynamics: Dynamics
    stretches: tuple[Step, ...]
    anchors: tuple[Mapping[str, float], ...]
    error: float
    rtol: float | None
    evaluations: int
    method: str = ""
    messages: tuple[str, ...] = ()

    def __reduce__(self) -> tuple[Any, ...]:
        return Run, tuple(getattr(self, one.name) for one in fields(self))

    @property
    def t(self) -> Array:
        """Times of the steps, s."""
        return np.array([self.stretches[0].start, *(s.end for s in self.stretches)])

    @property
    def ends(self) -> Array:
        """The states after every step, a row each."""
        return np.array([s.after for s in self.stretches])

    @property
    def reached(self) -> bool:
        """Whether the estimated error is within the rtol asked (fixed steps: nothing was asked)."""
        return self.rtol is None or self.error <= self.rtol

    @cached_property
    def audit(self) -> Audit:
        """The power audit of the run."""
        return audit(self.dynamics, self._bonds, self.stretches, self._instants)

    @cached_property
    def _plain(self) -> bool:
        """Whether all steps are explicit ones of one method, which are told all at once."""
        steps = [stretch.dense for stretch in self.stretches]
        return all(isinstance(one, runge_kutta.Step) for one in steps)

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
        return self._shaped(self._instants(times, self._owners(times)).flows[self.dynamics.form.variable(name)], times)

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
        efforts = self._bonds.efforts(self._instants(times, self._owners(times)), times.shape)
        if bond not in efforts:
            raise GraphError(f"no bond {bond}: the graph has bonds 1 to {len(efforts)}")
        return self._shaped(efforts[bond], times)

    def power(self, name: str, t: Any = None) -> Array:
        """The power into a one-port (out of a source: negative)."""
        self._check_name(name)
        if self.dynamics.graph.elements[name].kind not in ONE_PORTS:
            raise GraphError(f"{self.dynamics.graph.title(name)} is no one-port: it passes on what it gets; name a one-port")
        bond = self.dynamics.graph.bond_of(name)
        times = self._times(t)
        flow = self._instants(times, self._owners(times)).flows[self.dynamics.form.flow[bond.number]]
        return self._shaped(bond.sign(name) * self.effort(bond.number, times) * flow, times)

    def _check_name(self, name: str) -> None:
        if name not in self.dynamics.graph.elements:
            raise GraphError(f"no element {name!r}: the graph has {', '.join(self.dynamics.graph.elements)}")

    def _times(self, t: Any) -> Array:
        times = self.t if t is None else np.atleast_1d(np.asarray(t, dtype=float))
        outside = times[~((times >= self.t[0]) & (times <= self.t[-1]))]
        if outside.size:
            raise GraphError(f"found the time {outside[0]:g} s, expected one within 0 and {self.t[-1]:g} s")
        return times

    def _owners(self, times: Array) -> NDArray[np.int_]:
        ends = np.array([s.end for s in self.stretches])
        return np.clip(np.searchsorted(ends, times), 0, ends.size - 1)

    def _dense(self, times: Array, owners: NDArray[np.int_]) -> Array:
        steps = [stretch.dense for stretch in self.stretches]
        if self._plain:
            return runge_kutta.at(steps, owners, times)
        values = np.empty((len(self.dynamics.state.names), times.size))
        order = np.argsort(owners, kind="stable")
        found, firsts = np.unique(owners[order], return_index=True)
        for owner, mine in zip(found, np.split(order, firsts[1:]), strict=True):
            dense = self.stretches[owner].dense
            assert dense is not None  # only runs that are compared, and thrown away, go without
            values[:, mine] = dense(times[mine])
        return values

    def _instants(self, times: Array, owners: NDArray[np.int_]) -> Instant:
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
    method: str | None = None,
    step: float | None = None,
    breaks: Mapping[str, Any] | None = None,
    tolerance: float | None = None,
    evaluations: int = _EVALUATIONS,
) -> Run:
    """Motion of a graph from an initial state.

    Args:
        graph: with a value for every parameter.
        until: time to simulate, s.
        initial: displacements by name, springs' own displacements and independent flows by the name of the spring or of the
            1-junction; 0 (a declared displacement: its own initial value) where nothing is given.
        signals: a number or function of t for every declared signal.
        rtol: error asked of every state, relative to its greatest absolute value in the run; `Run.reached` says whether it
            was kept.
        method: one of "DOP853", "RK45", "RK23", "LSODA", "Radau", "BDF", as scipy calls them, or of "euler", "rk2"
            (trapezoidal), "rk4". None: explicit steps of the order that takes least work for rtol, RK45 or DOP853.
            On a stiff graph, where an explicit one would take more steps for its stability than Radau for its accuracy, the
            motion is found by Radau, and by LSODA where the inertia that the motion sees all but vanishes at a dead centre
            and a resistor carries it through: `Run.method` and `Run.messages` say so.
        step: length of a fixed step, s.
        breaks: where laws jump or kink, so that the stepping restarts there: displacement name (or "t") -> values, or
            (values, period). Without them no step is longer than 1/400 of the time where a source or resistor varies with
            displacements or time, and what such a law does in a shorter time may be passed over: give its ends as breaks.
        tolerance: greatest power and energy imbalance that the audit may find; more is an error. None: reported only.
        evaluations: of the rates, at most, all runs together: a motion that takes more is refused, with the time it reached.

    Raises:
        GraphError: if the motion is not determined, cannot be followed, takes too long, or fails the audit.

    >>> from bondgraph import Builder, C, I
    >>> b = Builder().one("mass", "translation", displacement="x").on("mass", I("m", 1.0), C("spring", stiffness=1.0))
    >>> run = simulate(b.build(), 3.0, initial={"x": 1.0, "spring": 1.0})
    >>> bool(abs(run.displacement("x", 3.0)[0] - np.cos(3.0)) < 1e-8), run.reached, run.audit.energy < 1e-8
    (True, True, True)

    """
    _check_arguments(until, rtol, method or "DOP853", step, evaluations)
    method = method or ("RK45" if rtol >= _LOOSE else "DOP853")
    dynamics = Dynamics(graph, signals)
    start = _start(dynamics, initial or {})
    refuse(dynamics.unbalanced(start.tolist()))
    stepper = _Stepper(dynamics, method, until, start, _breaks(dynamics, breaks or {}, until), int(evaluations))
    run = stepper.fixed(step) if step is not None else stepper.adaptive(rtol)
    if tolerance is not None:
        if not run.audit.power <= tolerance:
            raise GraphError(
                f"power audit: {run.audit.power_at} loses {run.audit.power:.3g} of the greatest power, {tolerance:g} allowed"
            )
        if not run.audit.energy <= tolerance:
            raise GraphError(f"energy audit: {run.audit.energy:.3g} of the energy is missing, {tolerance:g} allowed")
    return run


class _Stepper:
    """One motion, by one method, at whatever tolerance or step."""

    def __init__(
        self,
        dynamics: Dynamics,
        method: str,
        until: float,
        start: Array,
        breaks: tuple[list[Breaks], list[float]],
        budget: int,
    ) -> None:
        self.dynamics, self.method, self.until, self.start = dynamics, method, until, start
        self.breaks, self.times = breaks
        self.evaluations, self.budget = 0, budget
        self.stiffness_checked = False
        self.messages: tuple[str, ...] = ()
        self.junctions = {k: d.of for k, d in enumerate(dynamics.form.displacements, start=dynamics.state.flows)}
        self.anchors: list[Mapping[str, float]] = []
        self.undefined: tuple[float, list[float], Mapping[int, float]] | None = None  # where laws were, last
        self.scale, self.relative = np.maximum(np.abs(start), 1e-3), 1.0
        self.most = np.zeros(start.size)
        self._field({})(0.0, start)  # a state without rates is an error before anything is stepped
        if self.undefined is not None:
            why = self._undefined_reason()
            dead = self._dead_centre([], start, 0.0) if WEIGHTLESS in why else None
            raise GraphError(f"there are no rates at the start: {why}") if dead is None else _DeadCentreError(*dead, None)

    def adaptive(self, rtol: float) -> Run:
        """The motion within rtol, through dead centres by the method that can."""
        first = _FIRST_LOOSE if self.method == "RK45" else _FIRST
        given, tolerance = self.method, max(first * rtol, 10.0 * _TIGHTEST)
        if self._rounded_away():
            self._check_dead_centres()
        try:
            return self._stiffly(rtol, tolerance)
        except _DeadCentreError as found:
            if self.method == _THROUGH_DEAD_CENTRES:
                raise
            dead = found
        self.method, self.stiffness_checked = _THROUGH_DEAD_CENTRES, False
        if given != self.method:
            self.messages = (
                f"the inertia that the motion sees all but vanishes at {dead.place}, where {given} makes no headway: the "
                f"motion was found by {self.method}",
            )
        try:
            return self._tightened(rtol, tolerance)
        except StepError:
            raise dead from None

    def _stiffly(self, rtol: float, tolerance: float) -> Run:
        """The motion within rtol; by a method for stiff graphs, where the one asked for takes its steps for stability alone.

        Which of the two is cheaper is told by a loose run of the other: Radau's steps grow as the fifth root of the
        tolerance, those of a method at its limit of stability do not.
        """
        self.stiffness_checked = self.method in _STABLE
        try:
            return self._tightened(rtol, tolerance)
        except _StiffnessError as found:
            given, slow = self.method, found
        before, budget, loose = self.evaluations, self.budget, max(_PILOT, rtol)
        self.method, self.stiffness_checked, self.budget = _STIFF, False, min(budget, before + int(slow.evaluations))
        try:
            self._run(loose, longest=self._longest(), dense=False)
            cheaper = (self.evaluations - before) * (loose / tolerance) ** 0.2 < slow.evaluations
        except _DeadCentreError:
            raise
        except GraphError:
            cheaper = False
        finally:
            self.budget = budget
        if cheaper:
            self.messages += (
                f"a mode that decays within {1.0 / slow.rate:.3g} s holds the steps of {given} at {slow.step:.3g} s, for "
                f"stability alone: the motion was found by {_STIFF}",
            )
        else:
            self.method = given
        return self._tightened(rtol, tolerance)

    def _tightened(self, rtol: float, tolerance: float) -> Run:
        """Runs at tighter tolerance and with shorter steps until two of them agree within rtol, or rounding wins."""
        longest, before, expected, idle = self._longest(), np.inf, 0.0, 0
        pilot = self._run(max(_PLAIN_PILOT if self.method in PLAIN else _PILOT, rtol), longest=longest, dense=False)
        self.most = self._energy_scales(pilot)
        self._rescale(pilot)
        run = self._run(tolerance, longest=longest)
        for _ in range(_MOST_RUNS):
            self._rescale(run)
            part = 0.2 if expected <= rtol else max(1e-3, 0.2 * rtol / expected)
            tolerance = max(part * tolerance, _TIGHTEST)
            looser, longest = run, min(longest, _SHORTER * float(np.diff(run.t).max()))
            run = self._run(tolerance, longest=longest, beside=None if self.method in ("BDF", "LSODA") else looser)
            error = max(2.0 * _difference(looser, run, self._scales(run)), tolerance, _rounding(run))
            idle = idle + 1 if error > 0.5 * before else 0
            if error <= rtol or (idle and tolerance <= _TIGHTEST) or (idle > 2 and self.method == _THROUGH_DEAD_CENTRES):
                break
            before, expected = error, part * error
        return self._finished(run, error, rtol)

    def fixed(self, step: float) -> Run:
        """A run with equal steps, and its difference to one with shorter steps."""
        self._check_dead_centres()
        most = sum(math.ceil(self.until / length * (1.0 - 1e-12)) for length in (step, _FIXED_RATIO * step))
        needed = most * len(FIXED[self.method].nodes)
        if needed > self.budget:
            raise GraphError(
                f"steps of {step:g} s for {self.until:g} s, and the shorter ones that they are compared with, take {needed} "
                f"evaluations of the rates by {self.method}, {self.budget} are allowed: ask for a shorter time or longer "
                "steps; evaluations= allows more"
            )
        shorter, run = self._run(None, _FIXED_RATIO * step), self._run(None, step)
        self.most = self._energy_scales(shorter)
        return self._finished(run, max(2.0 * _difference(shorter, run, self._scales(shorter)), _rounding(run)), None)

    def _check_dead_centres(self) -> None:
        """Whether a motion whose inertia varies ends at a dead centre, by a loose run; at the start, from either side.

        Equal steps would pass over such a place, or come to it after a million of them.
        """
        if not self.dynamics.tables.moduli:
            return
        given, start, budget = self.method, self.start, self.budget
        self.method, self.stiffness_checked = _THROUGH_DEAD_CENTRES, False
        self.budget = min(budget, self.evaluations + _PILOT_EVALUATIONS)
        try:
            eps = 4.0 * np.finfo(float).eps
            for begin in self._beside(start, eps * np.abs(start)) if self._rounded_away() else [start]:
                self.start = begin
                self._run(_PILOT, longest=self._longest(), dense=False)
        except _DeadCentreError:
            raise
        except GraphError:  # the run that was asked for will tell
            pass
        finally:
            self.method, self.start, self.budget, self.undefined = given, start, budget, None

    def _beside(self, state: Array, distances: Array) -> list[Array]:
        """A state moved by its displacements' distances, to either side."""
        first, last = self.dynamics.state.flows, self.dynamics.state.flows + self.dynamics.state.displacements
        moved = np.zeros(state.size)
        moved[first:last] = distances[first:last]
        return [state - moved, state + moved]

    def _finished(self, run: Run, error: float, rtol: float | None) -> Run:
        return replace(run, error=error, rtol=rtol, evaluations=self.evaluations, method=self.method, messages=self.messages)

    def _longest(self) -> float:
        """A step's longest time: loads that vary are looked at often, so that no step passes over one unseen."""
        graph = self.dynamics.graph
        varying = any(graph.depends_on(e.name) for e in graph.of_kind("Se", "Sf", "R"))
        return self.until / _LEAST_STEPS if varying and not self.breaks and not self.times else np.inf

    def _run(
        self,
        rtol: float | None,
        step: float = 0.0,
        longest: float = np.inf,
        *,
        dense: bool = True,
        beside: Run | None = None,
    ) -> Run:
        """One run; `beside` another, with shorter steps than that one everywhere."""
        self.anchors = []
        anywhere, taken, began = self._field({}), 0, self.evaluations
        stretches: list[Step] = []
        within, lasts = dense or bool(self.breaks), [0.0]
        length: Callable[[float], float] | None = None
        if beside is not None:
            ends, widths = beside.t[1:], _SHORTER * np.diff(beside.t)

            def length(t: float) -> float:
                return float(widths[min(int(np.searchsorted(ends, t, side="right")), widths.size - 1)])

        def steps(t: float, state: Array, stop: float, anchors: Mapping[int, float]) -> Iterator[Step]:
            nonlocal taken
            last = float(np.nextafter(stop, 0.0))
            field: Any = self._field(anchors, last)
            by_junction = {self.junctions[k]: value for k, value in anchors.items() if k in self.junctions}
            if rtol is None:
                made = fixed(self.method, field, t, state, stop, step)
            else:
                tolerances = rtol * self.relative, rtol * self.scale
                plain: Any = self._rates(anchors, last) if self.method in PLAIN else field
                made = adaptive(self.method, plain, t, state, stop, tolerances, longest, dense=within, length=length)
            for stretch in made:
                self.anchors.append(by_junction)
                taken += 1
                if self.method in _STABLE and taken % _OBSERVED == 0:
                    mean_step, cost = (stretch.end - lasts[-1]) / _OBSERVED, (self.evaluations - began) / taken
                    lasts.append(stretch.end)
                    left = mean_step * (self.budget - self.evaluations)
                    if self.method in _EXPLICIT and (self.until - stretch.end) * cost > left:
                        dead = self._dead_centre(stretches, stretch.after, stretch.end)
                        if dead is not None:
                            raise _DeadCentreError(*dead, stretch.end)
                    if self.stiffness_checked:
                        self._check_stiffness(field, stretch, mean_step, cost)
                yield stretch
                if self.evaluations > self.budget:
                    other = "DOP853" if self.method in ("RK23", "RK45") else "LSODA"
                    advice = f"a larger rtol, give a jump's or kink's places as breaks, or use another method ({other})"
                    advice = "longer steps" if self.method in FIXED else advice
                    raise GraphError(
                        f"{self.budget} evaluations of the rates by {self.method} are spent at t = {stretch.end:.6g} s of "
                        f"{self.until:g} s: ask for a shorter time or {advice}; evaluations= allows more"
                    )

        try:
            stretches.extend(through_breaks(steps, anywhere, self.breaks, self.times, self.start, self.until))
        except _DeadCentreError:
            raise
        except GraphError as error:
            why = "" if self.undefined is None else self._undefined_reason()
            if isinstance(error, StepError) and (not why or WEIGHTLESS in why or _NOT_FINITE in why):
                last = stretches[-1] if stretches else Step(None, 0.0, 0.0, after=self.start)
                dead = self._dead_centre(stretches, last.after, last.end)
                if dead is not None:
                    raise _DeadCentreError(*dead, last.end) from error
            raise type(error)(f"{error} ({why})" if why else str(error)) from error
        return Run(self.dynamics, tuple(stretches), tuple(self.anchors), 0.0, rtol, 0)

    def _check_stiffness(self, field: Callable[[float, Array], Array], stretch: Step, step: float, cost: float) -> None:
        """Whether steps are as long as stability lets them be, by a mode that has decayed long ago."""
        at, here = stretch.end, field(stretch.end, stretch.after)
        nudge = 1e-7 * np.maximum(np.abs(stretch.after), self.scale)
        slopes = [(field(at, stretch.after + h * unit) - here) / h for h, unit in zip(nudge, np.eye(here.size), strict=True)]
        if not slopes or not np.all(np.isfinite(slopes)):
            return
        rate = float(max(-np.linalg.eigvals(np.transpose(slopes)).real.min(), 0.0))
        steps = (self.until - at) / step
        if step * rate > 0.5 * _STABLE[self.method] and steps > _MANY:
            raise _StiffnessError(rate, step, steps * cost)

    def _rescale(self, run: Run) -> None:
        """Tolerances of a step from the greatest values that a run reaches, instead of from the value at the time.

        A displacement that goes on growing, as a crank's angle does, would otherwise be followed less and less closely.
        """
        first, last = self.dynamics.state.flows, self.dynamics.state.flows + self.dynamics.state.displacements
        self.scale = self._scales(run)
        self.scale[first:last] = np.minimum(self.scale[first:last], 1.0)
        self.relative = 0.0

    def _scales(self, run: Run) -> Array:
        """What a run's states are measured by: each one's greatest value, or its share of the energy if it has none."""
        greatest = np.abs(np.column_stack([self.start, run.ends.T])).max(axis=1, initial=0.0)
        scale = np.where(greatest > _NO_ENERGY * self.most, greatest, self.most)
        return np.where(scale > 0.0, scale, self.scale)

    def _energy_scales(self, run: Run) -> Array:
        """What each state would be if it held all the energy of a run."""
        some = np.unique(np.linspace(0, len(run.stretches) - 1, _SAMPLES).astype(int))
        anchors = {name: np.array([0.0, *(run.anchors[k][name] for k in some)]) for name in run.anchors[0]}
        for name, values in anchors.items():
            values[0] = run.anchors[0][name]
        states = np.column_stack([self.start, *(run.stretches[k].after for k in some)])
        return energy_scales(self.dynamics, np.array([0.0, *(run.stretches[k].end for k in some)]), states, anchors)

    def _field(self, anchors: Mapping[int, float], last: float = np.inf) -> Callable[[float, Array], Array]:
        """The rates within one piece, as `_rates` gives them, as a field of arrays for the integrators."""
        rates = self._rates(anchors, last)
        return lambda t, state: np.array(rates(t, state.tolist()))

    def _rates(self, anchors: Mapping[int, float], last: float = np.inf) -> Callable[[float, Any], tuple[float, ...]]:
        """The rates within one piece, in plain numbers; not a number where a law is not defined.

        At the piece's end the time is `last`, just before: a law that jumps then is still on its branch.
        """
        rates, size, finite = self.dynamics.rates, self.start.size, math.isfinite
        places = {junction: k for k, junction in self.junctions.items()}
        anchored = [places[junction] for junction in self.dynamics.anchored]

        tallied = counting()

        def found(t: float, values: Any) -> tuple[float, ...]:
            self.evaluations += 1
            if tallied:
                count(1)
            t = t if t < last else last
            try:
                found = rates(t, *values, *[anchors.get(k, values[k]) for k in anchored]) if anchored else rates(t, *values)
            except (ValueError, ArithmeticError, TypeError):
                found = (math.nan,) * size
            if not finite(sum(found)) and finite(sum(values)):
                self.undefined = t, [*values], anchors
            return found

        return found

    def _undefined_reason(self) -> str:
        """Why there were no rates where they were last asked in vain."""
        assert self.undefined is not None
        t, values, anchors = self.undefined
        try:
            with np.errstate(divide="raise", invalid="raise", over="raise"):
                self.dynamics.at(t, values, {self.junctions[k]: v for k, v in anchors.items() if k in self.junctions})
        except (ValueError, ArithmeticError, TypeError) as error:
            return str(error)
        return f"{_NOT_FINITE} at t = {t:.9g} s"

    def _dead_centre(self, stretches: list[Step], state: Array, t: float) -> tuple[str, str] | None:
        """A flow and a position, where the inertia at a state is next to none beside its greatest around and before."""
        some = np.unique(np.linspace(0, len(stretches) - 1, _SAMPLES).astype(int)) if stretches else np.zeros(0, dtype=int)
        around = [(t, beside) for beside in self._beside(state, _BESIDE * (1.0 + np.abs(state)))]
        past = [(0.0, self.start), *((stretches[k].end, stretches[k].after) for k in some), *around]
        matrices = np.array([self._inertia(*at) for at in [*past, (t, state)]])
        greatest = np.nanmax(np.diagonal(matrices, axis1=1, axis2=2), axis=0)
        scale = np.sqrt(np.where(greatest > 0.0, greatest, 1.0))
        known = np.isfinite(matrices).all(axis=(1, 2))
        if not known[-1] or known.sum() < 2:
            return None
        least, modes = np.linalg.eigh(matrices[known] / np.outer(scale, scale))
        if not least[-1, 0] < _NO_INERTIA * least[:-1, 0].max():
            return None
        form = self.dynamics.form
        weakest = form.coordinates.moving[int(np.argmax(np.abs(modes[-1, :, 0])))]
        places = zip(form.displacements, state[self.dynamics.state.flows :], strict=False)
        return form.name_of(weakest), ", ".join(f"{d.name} = {value:.9g}" for d, value in places) or f"t = {t:.9g} s"

    def _inertia(self, t: float, state: Array) -> Array:
        """The mass matrix at a state; not a number where a law is not defined."""
        try:
            with np.errstate(all="ignore"):
                lower, _, _ = Walk(self.dynamics.tables, t, state.tolist(), {}).mass_and_force()
        except (ValueError, ArithmeticError, TypeError):
            return np.full((self.dynamics.state.flows,) * 2, np.nan)
        below = np.tril(np.array(lower, dtype=float))
        return np.asarray(below + np.tril(below, -1).T)

    def _rounded_away(self) -> bool:
        """Whether the least inertia at the start is what rounding makes of the displacements."""
        if not (self.dynamics.tables.moduli and self.dynamics.state.flows):
            return False
        nearby = [self.start, *self._beside(self.start, 4.0 * np.finfo(float).eps * np.abs(self.start))]
        least = [float(np.linalg.det(self._inertia(0.0, state))) for state in nearby]
        return not min(least) > 0.5 * max(least)


class _DeadCentreError(GraphError):
    """A place where the inertia that a flow meets vanishes; t, s, is None at the start."""

    def __init__(self, flow: str, place: str, t: float | None) -> None:
        found = "there are no rates at the start" if t is None else f"the motion cannot be followed past t = {t:.6g} s"
        super().__init__(
            f"{found}: the inertia that the motion sees vanishes at {place}, where nothing weighs the flow of {flow} (a "
            f"dead centre without inertia before it): give {flow} an inertia (I), or more resistance (R) to carry it through"
        )
        self.place = place


class _StiffnessError(Exception):
    """Steps of an explicit method at the limit of its stability: decay rate, 1/s, step, s, and evaluations to the end."""

    def __init__(self, rate: float, step: float, evaluations: float) -> None:
        super().__init__()
        self.rate, self.step, self.evaluations = rate, step, evaluations


def _rounding(run: Run) -> float:
    """What rounding makes of the states, at least: each step leaves some."""
    return float(4.0 * np.finfo(float).eps * math.sqrt(len(run.stretches)))


def _difference(other: Run, run: Run, scale: Array) -> float:
    """The greatest difference of two runs, at the ends of steps and within them, each state relative to its scale."""
    starts, widths = run.t[:-1], np.diff(run.t)
    some = slice(None, None, 1 + widths.size // _MOST_COMPARED)
    times = np.minimum((starts[some, None] + widths[some, None] * np.array(_WITHIN)).ravel(), run.t[-1])
    a, b = (np.array(list(each.states(times).values())) for each in (other, run))
    return float(np.max(np.abs(a - b) / scale[:, None], initial=0.0))


def _check_arguments(until: float, rtol: float, method: str, step: float | None, evaluations: int) -> None:
    faults = []
    numbers = {"until": until, "rtol": rtol, "evaluations": evaluations} | ({} if step is None else {"step": step})
    faults += [
        f"{name}: found {v!r}, expected a number above 0"
        for name, v in numbers.items()
        if not (isinstance(v, Real) and np.isfinite(v) and v > 0)
    ]
    if method not in (*ADAPTIVE, *FIXED):
        faults.append(f"method: found {method!r}, expected one of {', '.join((*ADAPTIVE, *FIXED))}")
    elif method in FIXED and step is None:
        faults.append(f"method {method!r} takes equal steps: give step, in s")
    elif method in ADAPTIVE and step is not None:
        faults.append(f"method {method!r} chooses its own steps: give rtol, not step")
    refuse(faults)


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
        elif not isinstance(value, Real) or not np.isfinite(value):
            faults.append(f"initial {name!r}: found {value!r}, expected a finite number")
        else:
            start[names.index(found)] = value
    refuse(faults)
    return start


def _breaks(dynamics: Dynamics, given: Mapping[str, Any], until: float) -> tuple[list[Breaks], list[float]]:
    """Ascending places of breaks of states, within a period if there is one, and the times of breaks."""
    breaks: list[Breaks] = []
    times: list[float] = []
    for name, values in given.items():
        period = None
        try:
            if len(values) == 2 and np.ndim(values[0]) == 1:
                places, period = np.asarray(values[0], dtype=float), float(values[1])
            else:
                places = np.asarray(values, dtype=float)
        except (TypeError, ValueError) as error:
            raise GraphError(f"breaks {name!r}: found {values!r}, expected a list of numbers, or (list, period)") from error
        if places.ndim != 1 or not np.all(np.isfinite(places)) or (period is not None and not 0.0 < period < np.inf):
            raise GraphError(f"breaks {name!r}: found {values!r}, expected finite numbers, and a period above 0")
        places = np.unique(places if period is None else places % period)
        if name == TIME:
            again = [0.0] if period is None else period * np.arange(np.ceil(until / period))
            times += [float(place + later) for later in again for place in places]
        elif name in dynamics.state.names:
            breaks.append(Breaks(dynamics.state.names.index(name), places, period, name))
        else:
            raise GraphError(f"breaks {name!r}: no such state; they are t, {', '.join(dynamics.state.names)}")
    return breaks, times


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
        if self._unknown:  # inside loops, by least squares: a loop of rigid parts may leave some of them undetermined
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
        efforts = {b.number: values[self._effort[b.number]] for b in self.graph.bonds}
        return efforts | {p.bond: _filled(instant.efforts[k], shape) for k, p in self._ports}

    def imbalances(self, flows: dict[int, Array], efforts: dict[int, Array]) -> dict[str, Array]:
        """Net power into every junction and two-port, by name."""
        inner = self.graph.of_kind("1", "0", "TF", "GY")
        return {
            e.name: sum(
                (b.sign(e.name) * efforts[b.number] * flows[b.number] for b in self.graph.at(e.name)), start=np.zeros(1)
            )
            for e in inner
        }


def audit(dynamics: Dynamics, bonds: Bonds, stretches: Sequence[Step], evaluate: Callable[..., Instant]) -> Audit:
    """Audit a run, from five points in each of its steps; `evaluate(times, owner)` gives the flows and efforts there."""
    starts = np.array([s.start for s in stretches])
    widths = np.array([s.end - s.start for s in stretches])
    times = (starts[:, None] + 0.5 * widths[:, None] * (1.0 + _POINTS)).ravel()
    inside = evaluate(times, np.repeat(np.arange(len(stretches)), _POINTS.size))
    flows, efforts = bonds.flows(inside, times.shape), bonds.efforts(inside, times.shape)
    power = {p.element.name: p.sign * efforts[p.bond] * flows[p.bond] for p in dynamics.form.ports if p.element.kind != "GY"}

    def since_start(*kinds: str) -> Array:
        total = sum((power[e.name] for e in dynamics.graph.of_kind(*kinds)), start=np.zeros(times.size))
        by_step = 0.5 * widths * (total.reshape(-1, _POINTS.size) @ _WEIGHTS)
        return np.concatenate(([0.0], np.cumsum(by_step)))

    edges = np.append(starts, stretches[-1].end)
    owners = np.append(np.arange(len(stretches)), len(stretches) - 1)
    graph, at_edges, stored = dynamics.graph, evaluate(edges, owners), np.zeros(edges.shape)
    curved = any(not graph.is_linear(spring.name) for spring in graph.of_kind("C"))
    for port, effort in zip(dynamics.form.ports, at_edges.efforts, strict=True):
        if port.element.kind == "I":
            stored += 0.5 * graph.constant(port.element.name) * _filled(at_edges.flows[port.variable], edges.shape) ** 2
        elif port.element.kind == "C" and not curved:
            stored += 0.5 * graph.constant(port.element.name) * _filled(effort, edges.shape) ** 2
    stored = stored + (since_start("C") if curved else 0.0)
    imbalances = {name: float(np.abs(value).max()) for name, value in bonds.imbalances(flows, efforts).items()}
    where = max(imbalances, key=lambda name: imbalances[name])
    greatest = max(float(np.abs(efforts[n] * flows[n]).max()) for n in flows)
    usual = max(float(np.abs(e).max()) for e in efforts.values()) * max(float(np.abs(f).max()) for f in flows.values())
    usual = max(float(np.abs(stored).max()) / stretches[-1].end, usual)
    nothing = greatest <= max(_NO_POWER, 1e-13 * usual)  # flows but the rounding of the usual power
    worst = 0.0 if nothing else imbalances[where] / greatest
    dissipated, supplied = since_start("R"), -since_start("Se", "Sf")
    residual = np.abs(stored - stored[0] + dissipated - supplied).max()
    scale = max(float(np.abs(energy).max()) for energy in (stored, dissipated, supplied, since_start("I"), since_start("C")))
    return Audit(worst, where, float(residual / scale) if scale > _NO_POWER else 0.0, stored, dissipated, supplied)


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
    greatest = [*flows, *(float(np.max(np.abs(u))) for u in walk.coordinates[len(flows) :])]
    displaced = []
    for displacement in dynamics.form.displacements:
        gains = walk.gain[dynamics.tables.owner_of[displacement.name]]
        displaced.append(float(times[-1]) * sum(float(np.max(np.abs(gain))) * greatest[k] for k, gain in gains.items()))
    start, stretched = Walk(dynamics.tables, 0.0, states[:, 0].tolist(), {}), []
    for port in dynamics.tables.springs:
        stretch, taken = 2.0**-100, 0.0
        while taken < energy and stretch < 2.0**100:
            stretch *= 2.0
            try:
                taken = 0.5 * stretch * max(abs(start.spring(port.element.name, side * stretch)) for side in (-1.0, 1.0))
            except GraphError:  # the law ends here
                break
        stretched.append(stretch)
    return np.array([*flows, *displaced, *stretched])


def _filled(value: Any, shape: tuple[int, ...]) -> Array:
    return np.broadcast_to(np.asarray(value, dtype=float), shape)
