"""Motion of any graph in numbers: several independent states, several domains, an error bound, and a power audit.

`simulate` runs an adaptive method, or one with equal steps, at tighter tolerance and with shorter steps until two runs
agree. The audit tests whether every junction and two-port transmits exactly the power that it receives, and whether the
energy adds up: efforts of all one-ports follow from their laws, an inertia's from its own acceleration; the junction
structure then has more equations than unknown efforts, and the residual is checked, element by element. Energy is
checked over the run: stored - stored at the start + dissipated - supplied.

A graph with switches is followed through its modes (`bondgraph.motion.switching`). A mode lasts until a condition changes,
to the last digit of the dense output. What passes an event is every store's momentum or displacement. Stores that share a
flow (an effort) from then on exchange impulses that do no work on what is free: of every state the sum with the followers'
shares is kept,

    y_k + sum g_dk y_d = the same before,   y_d = W_d w_d after,

so that momentum is conserved where inertias join, charge where capacitors do. The energy that is lost counts as dissipated.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from numbers import Real
from typing import Any

import numpy as np

from bondgraph.elements import TIME, GraphError, refuse
from bondgraph.graph import BondGraph, as_graph
from bondgraph.motion import stepping
from bondgraph.motion.algebra import WEIGHTLESS, Balance, settle
from bondgraph.motion.dynamics import Dynamics, PlainRates, RateLog, Walk
from bondgraph.motion.run import Auditor, Event, Mode, Run, difference, energy_scales, lost_heat, rounding
from bondgraph.motion.runge_kutta import decay
from bondgraph.motion.stepping import (
    ADAPTIVE,
    FIXED,
    PLAIN,
    Breaks,
    Events,
    Step,
    StepError,
    adaptive,
    crossing,
    fixed,
    through_breaks,
)
from bondgraph.motion.switching import TINY, dry_resistors, mode
from bondgraph.numerics import Array, count, counting

_LOOSE = 1e-5  # of what is asked: down to it order 5 takes less work than order 8
_PLAIN_PILOT, _FIRST_LOOSE = 1e-3, 0.02  # of explicit steps, and of those of order 5, for stepping.PILOT and stepping.FIRST
_FIXED_RATIO = 0.382  # of the shorter step that a fixed one is compared with: no simple part of it, so that no load hides
_SAMPLES = 400  # times at which a run's powers are summed up
_EVALUATIONS = 2_000_000  # of the rates, all runs together
_NO_ENERGY = math.sqrt(np.finfo(float).eps)  # of the state that would hold all of it: the energy of less is rounding of it

_STABLE = {"RK23": 2.5, "LSODA": 0.5} | {name: stepping.STABLE[method.order] for name, method in PLAIN.items()}
_OBSERVED = 500  # steps after which a method's steps are held against that: any mode at that limit has decayed by then
_MANY = 2000  # steps: fewer are as well taken by the explicit method
_STIFF = "Radau"
_TAYLOR, _SERIES = "Taylor", 6  # states of a graph of constants from which on its series takes less time
_MOST_RADIANS = 2000.0  # of such a run: time times the greatest |eigenvalue|; more may be stiff
_EXPLICIT = ("RK23", "RK45", "DOP853")
_THROUGH_DEAD_CENTRES = "LSODA"  # its Jacobian is of a step's end, where Radau's, of its start, knows of no inertia ahead
_NOT_FINITE = "the rates are not finite"
_NO_INERTIA = 1e-6  # of the greatest in the run
_PILOT_EVALUATIONS = 50_000
_BESIDE = 0.01  # of a displacement and of 1: how far beside a position the inertia is looked at

_AUDITED, _AUDITED_ROUGHLY = 1e-6, 100.0  # what an audit may find by default, and that as a multiple of rtol
_BALANCED = 1e-9  # of the larger of both: a value given to a store that follows others

_ON, _DRY = {0: "off", 1: "on"}, {0: "at rest", 1: "sliding", -1: "sliding back"}
_NOTHING = 1e-12  # of the greatest value so far: closer to its change a condition is at it
_AT_ONCE, _SOON = 20, 1e-9  # events within a share of the time, beyond which they chatter
_MOST_EVENTS = 20_000


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
        initial: states by name (`p_`, `q_`, displacements); also a spring's own displacement by the spring's name, and the
            flow of a 1-junction that one store alone settles by the junction's; 0 (a declared displacement: its own initial
            value) where nothing is given.
        signals: a number or function of t for every declared signal.
        rtol: required error of every state, relative to its greatest absolute value in the run; `Run.reached` is true if it
            was kept.
        method: one of "DOP853", "RK45", "RK23", "LSODA", "Radau", "BDF", as scipy calls them, or of "euler", "rk2"
            (trapezoidal), "rk4". None: explicit steps of the order that takes least work for rtol, RK45 or DOP853; of
            many linear states with constant sources their "Taylor" series.
            On a stiff graph, where an explicit one would take more steps for its stability than Radau for its accuracy, the
            motion is found by Radau, and by LSODA where the effective inertia almost vanishes at a dead centre
            and a resistor carries it through: `Run.method` and `Run.messages` report it.
        step: length of a fixed step, s.
        breaks: where laws jump or kink, so that the stepping restarts there: displacement name (or "t") -> values, or
            (values, period). Without them no step is longer than 1/400 of the time where a source or resistor varies with
            displacements or time, and what such a law does in a shorter time may be passed over: give its ends as breaks.
        tolerance: greatest power and energy imbalance allowed in the audit; more is an error. None: the larger of 1e-6
            and 100 rtol, with fixed steps reported only.
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
    chosen, method = method is None, method or ("RK45" if rtol >= _LOOSE else "DOP853")
    if as_graph(graph).switched or (not breaks and dry_resistors(graph)):
        if breaks:
            raise GraphError(f"breaks: found {breaks!r} beside switched junctions; leave it out")
        switched = Switched(graph, signals or {}, int(evaluations))
        begin = switched.begin(lambda dynamics: _start(dynamics, initial or {}))
        if step is None:
            run = switched.follow(begin, until, rtol, method)
        else:
            _check_count(method, step, until, int(evaluations))
            run = switched.stepped(begin, until, method, (step, _FIXED_RATIO * step))
        run = replace(run, rtol=rtol if step is None else None, evaluations=switched.log.evaluations, method=method)
    else:
        dynamics = Dynamics(graph, signals)
        start = _start(dynamics, initial or {})
        if chosen and step is None and len(dynamics.names) >= _SERIES and dynamics.linear is not None:
            method = _TAYLOR if dynamics.linear[2] * until < _MOST_RADIANS else method
        stepper = _Stepper(dynamics, method, until, start, _breaks(dynamics, breaks or {}, until), int(evaluations))
        run = stepper.fixed(step) if step is not None else stepper.adaptive(rtol)
        run = replace(run, messages=(*run.messages, *dynamics.branches(start.tolist())))
    run = replace(run, messages=(*run.messages, *lost_heat(graph)))
    if tolerance is None and step is None:
        tolerance = max(_AUDITED, _AUDITED_ROUGHLY * rtol)
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
        self.log, self.budget = RateLog(), budget
        self.stiffness_checked = False
        self.messages: tuple[str, ...] = ()
        self.junctions = {k: d.of for k, d in enumerate(dynamics.form.displacements, start=len(dynamics.form.stores))}
        self.anchors: list[Mapping[str, float]] = []
        self.scale, self.relative = np.maximum(np.abs(start), 1e-3), 1.0
        self.most = np.zeros(start.size)
        self._rates({})(0.0, start.tolist())  # a state without rates is an error before anything is stepped
        if self.log.undefined is not None:
            why = self._undefined_reason()
            dead = self._dead_centre([], start, 0.0) if WEIGHTLESS in why else None
            raise GraphError(f"there are no rates at the start: {why}") if dead is None else _DeadCentreError(*dead, None)

    def adaptive(self, rtol: float) -> Run:
        """The motion within rtol, through dead centres by the method that can."""
        first = _FIRST_LOOSE if self.method == "RK45" else stepping.FIRST
        method, tolerance = self.method, max(first * rtol, 10.0 * stepping.FINEST)
        if self._rounded_away():
            self._check_dead_centres()
        try:
            return self._stiffly(rtol, tolerance)
        except _DeadCentreError as error:
            if self.method == _THROUGH_DEAD_CENTRES:
                raise
            dead = error
        self.method, self.stiffness_checked = _THROUGH_DEAD_CENTRES, False
        if method != self.method:
            self.messages = (
                f"the effective inertia almost vanishes at {dead.place}, where {method} makes no progress: the "
                f"motion was computed by {self.method}",
            )
        try:
            return self._tightened(rtol, tolerance)
        except StepError:
            raise dead from None

    def _stiffly(self, rtol: float, tolerance: float) -> Run:
        """The motion within rtol; by a method for stiff graphs, where the required one takes its steps for stability alone.

        A loose run of the other shows which of the two is cheaper: Radau's steps grow as the fifth root of the
        tolerance, those of a method at its limit of stability do not.
        """
        self.stiffness_checked = self.method in _STABLE
        try:
            return self._tightened(rtol, tolerance)
        except _StiffnessError as error:
            method, slow = self.method, error
        before, budget, loose = self.log.evaluations, self.budget, max(stepping.PILOT, rtol)
        self.method, self.stiffness_checked, self.budget = _STIFF, False, min(budget, before + int(slow.evaluations))
        try:
            self._run(loose, longest=self._longest(), dense=False)
            cheaper = (self.log.evaluations - before) * (loose / tolerance) ** 0.2 < slow.evaluations
        except _DeadCentreError:
            raise
        except GraphError:
            cheaper = False
        finally:
            self.budget = budget
        if cheaper:
            self.messages += (
                f"a mode that decays within {1.0 / slow.rate:.3g} s holds the steps of {method} at {slow.step:.3g} s, for "
                f"stability alone: the motion was found by {_STIFF}",
            )
        else:
            self.method = method
        return self._tightened(rtol, tolerance)

    def _tightened(self, rtol: float, tolerance: float) -> Run:
        """Runs at tighter tolerance and with shorter steps until two of them agree within rtol, or rounding wins."""
        longest = self._longest()
        pilot = self._run(max(_PLAIN_PILOT if self.method in PLAIN else stepping.PILOT, rtol), longest=longest, dense=False)
        self.most = self._energy_scales(pilot)
        self._rescale(pilot)

        def tighter(tolerance: float, looser: Run) -> tuple[Run, float]:
            nonlocal longest
            self._rescale(looser)
            longest = min(longest, stepping.SHORTER * float(np.diff(looser.t).max()))
            run = self._run(tolerance, longest=longest, beside=None if self.method in ("BDF", "LSODA") else looser)
            return run, max(2.0 * difference(run, looser, self._scales(run)), rounding(run))

        patience = 2.0 if self.method == _THROUGH_DEAD_CENTRES else math.inf
        run, error = stepping.agreement(self._run(tolerance, longest=longest), tighter, rtol, tolerance, patience)
        return self._finished(run, error, rtol)

    def fixed(self, step: float) -> Run:
        """A run with equal steps, and its difference to one with shorter steps."""
        self._check_dead_centres()
        _check_count(self.method, step, self.until, self.budget)
        shorter, run = self._run(None, _FIXED_RATIO * step), self._run(None, step)
        self.most = self._energy_scales(shorter)
        return self._finished(run, max(2.0 * difference(run, shorter, self._scales(shorter)), rounding(run)), None)

    def _check_dead_centres(self) -> None:
        """Checks by a loose run whether a motion with varying inertia ends at a dead centre; at the start, from both sides.

        Equal steps would miss such a place, or reach it after a million steps.
        """
        if not self.dynamics.moduli:
            return
        method, start, budget = self.method, self.start, self.budget
        self.method, self.stiffness_checked = _THROUGH_DEAD_CENTRES, False
        self.budget = min(budget, self.log.evaluations + _PILOT_EVALUATIONS)
        try:
            eps = 4.0 * np.finfo(float).eps
            for begin in self._beside(start, eps * np.abs(start)) if self._rounded_away() else [start]:
                self.start = begin
                self._run(stepping.PILOT, longest=self._longest(), dense=False)
        except _DeadCentreError:
            raise
        except GraphError:  # the run that was asked for will tell
            pass
        finally:
            self.method, self.start, self.budget, self.log.undefined = method, start, budget, None

    def _beside(self, state: Array, distances: Array) -> list[Array]:
        """A state moved by its displacements' distances, to either side."""
        moved = np.where(np.arange(state.size) < len(self.dynamics.form.stores), 0.0, distances)
        return [state - moved, state + moved]

    def _finished(self, run: Run, error: float, rtol: float | None) -> Run:
        run = replace(run, evaluations=self.log.evaluations, method=self.method, messages=self.messages)
        return replace(run, error=error, rtol=rtol)

    def _longest(self) -> float:
        """A step's longest time: loads that vary are sampled often, so that no step misses one."""
        varies = self.dynamics.graph.varies and not self.breaks and not self.times
        return self.until / stepping.LEAST_STEPS if varies else np.inf

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
        anywhere, taken, began = stepping.field_of(self._rates({})), 0, self.log.evaluations
        stretches: list[Step] = []
        within, lasts = dense or bool(self.breaks), [0.0]
        length: Callable[[float], float] | None = None
        if beside is not None:
            ends, widths = beside.t[1:], stepping.SHORTER * np.diff(beside.t)

            def length(t: float) -> float:
                return float(widths[min(int(np.searchsorted(ends, t, side="right")), widths.size - 1)])

        def steps(t: float, state: Array, stop: float, anchors: Mapping[int, float]) -> Iterator[Step]:
            nonlocal taken
            by_junction = {self.junctions[k]: value for k, value in anchors.items() if k in self.junctions}
            rates = self._rates(by_junction, float(np.nextafter(stop, 0.0)))
            if rtol is None:
                made = fixed(self.method, rates, t, state, stop, step)
            elif self.method == _TAYLOR:
                assert self.dynamics.linear is not None
                tolerances = rtol * self.relative, rtol * self.scale
                made = stepping.taylor(self.dynamics.linear, t, state, stop, tolerances, length or (lambda t: longest))
            else:
                tolerances = rtol * self.relative, rtol * self.scale
                made = adaptive(self.method, rates, t, state, stop, tolerances, longest, dense=within, length=length)
            for stretch in made:
                self.anchors.append(by_junction)
                taken += 1
                self.log.evaluations += (
                    len(stretch.dense.terms) if self.method == _TAYLOR and stretch.start == stretch.dense.time else 0
                )
                if self.method in _STABLE and taken % _OBSERVED == 0:
                    mean_step, cost = (stretch.end - lasts[-1]) / _OBSERVED, (self.log.evaluations - began) / taken
                    lasts.append(stretch.end)
                    left = mean_step * (self.budget - self.log.evaluations)
                    if self.method in _EXPLICIT and (self.until - stretch.end) * cost > left:
                        dead = self._dead_centre(stretches, stretch.after, stretch.end)
                        if dead is not None:
                            raise _DeadCentreError(*dead, stretch.end)
                    if self.stiffness_checked:
                        self._check_stiffness(rates, stretch, mean_step, cost)
                yield stretch
                if self.log.evaluations > self.budget:
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
            why = "" if self.log.undefined is None else self._undefined_reason()
            if isinstance(error, StepError) and (not why or WEIGHTLESS in why or _NOT_FINITE in why):
                last = stretches[-1] if stretches else Step(None, 0.0, 0.0, after=self.start)
                dead = self._dead_centre(stretches, last.after, last.end)
                if dead is not None:
                    raise _DeadCentreError(*dead, last.end) from error
            raise type(error)(f"{error} ({why})" if why else str(error)) from error
        modes = ((),) * len(stretches)
        return Run(self.dynamics.graph, {(): self.dynamics}, tuple(stretches), modes, tuple(self.anchors))

    def _check_stiffness(self, rates: PlainRates, stretch: Step, step: float, cost: float) -> None:
        """Checks whether stability limits the steps, by a mode that has decayed long ago."""
        sizes, steps = np.maximum(np.abs(stretch.after), self.scale), (self.until - stretch.end) / step
        rate = decay(rates, sizes, stretch.end, stretch.after) if sizes.size else 0.0
        if step * rate > 0.5 * _STABLE[self.method] and steps > _MANY:
            raise _StiffnessError(rate, step, steps * cost)

    def _rescale(self, run: Run) -> None:
        """Tolerances of a step from the greatest values that a run reaches, instead of from the value at the time.

        A displacement that continues growing, as a crank's angle does, would otherwise be followed less and less closely.
        """
        first, self.scale, self.relative = len(self.dynamics.form.stores), self._scales(run), 0.0
        self.scale[first:] = np.minimum(self.scale[first:], 1.0)

    def _scales(self, run: Run) -> Array:
        """The scales of a run's states: the greatest value of each, or its share of the energy if that is 0."""
        greatest = np.abs(np.column_stack([self.start, run.ends.T])).max(axis=1, initial=0.0)
        scale = np.where(greatest > _NO_ENERGY * self.most, greatest, self.most)
        return np.where(scale > 0.0, scale, self.scale)

    def _energy_scales(self, run: Run) -> Array:
        """The value of each state with all the energy of a run in it."""
        some = np.unique(np.linspace(0, len(run.stretches) - 1, _SAMPLES).astype(int))
        anchors = {name: np.array([run.anchors[k][name] for k in (0, *some)]) for name in run.anchors[0]}
        states = np.column_stack([self.start, *(run.stretches[k].after for k in some)])
        return energy_scales(self.dynamics, np.array([0.0, *(run.stretches[k].end for k in some)]), states, anchors)

    def _rates(self, anchors: Mapping[str, float], last: float = np.inf) -> PlainRates:
        """The rates within one piece, counted for whoever counts."""
        rates = self.dynamics.within(self.log, anchors, last)

        def counted(t: float, values: Sequence[float]) -> Sequence[float]:
            count(1)
            return rates(t, values)

        return counted if counting() else rates

    def _undefined_reason(self) -> str:
        """The reason why the last evaluation gave no rates."""
        assert self.log.undefined is not None
        t, values, anchors = self.log.undefined
        try:
            with np.errstate(divide="raise", invalid="raise", over="raise"):
                self.dynamics.at(t, values, anchors)
        except (ValueError, ArithmeticError, TypeError) as error:
            return str(error)
        return f"{_NOT_FINITE} at t = {t:.9g} s"

    def _dead_centre(self, stretches: list[Step], state: Array, t: float) -> tuple[str, str] | None:
        """A flow and a position, where the inertia at a state is next to none beside its greatest around and before."""
        some = np.unique(np.linspace(0, len(stretches) - 1, _SAMPLES).astype(int)) if stretches else np.zeros(0, dtype=int)
        around = [(t, beside) for beside in self._beside(state, _BESIDE * (1.0 + np.abs(state)))]
        past = [(0.0, self.start), *((stretches[k].end, stretches[k].after) for k in some), *around]
        matrices = np.array([self._inertia(*at) for at in [*past, (t, state)]])
        if not matrices.size:
            return None
        greatest = np.nanmax(np.diagonal(matrices, axis1=1, axis2=2), axis=0)
        scale = np.sqrt(np.where(greatest > 0.0, greatest, 1.0))
        finite = np.isfinite(matrices).all(axis=(1, 2))
        if not finite[-1] or finite.sum() < 2:
            return None
        least, modes = np.linalg.eigh(matrices[finite] / np.outer(scale, scale))
        if not least[-1, 0] < _NO_INERTIA * least[:-1, 0].max():
            return None
        form = self.dynamics.form
        weakest = form.stores[self.dynamics.weighed[int(np.argmax(np.abs(modes[-1, :, 0])))]].output
        places = zip(form.displacements, state[len(self.dynamics.form.stores) :], strict=True)
        return form.name_of(weakest), ", ".join(f"{d.name} = {value:.9g}" for d, value in places) or f"t = {t:.9g} s"

    def _inertia(self, t: float, state: Array) -> Array:
        """The mass matrix at a state; not a number where a law is not defined."""
        try:
            with np.errstate(all="ignore"):
                lower, _ = Walk(self.dynamics, t, state.tolist()).mass_and_force()
        except (ValueError, ArithmeticError, TypeError):
            return np.full((len(self.dynamics.weighed),) * 2, np.nan)
        below = np.tril(np.array(lower, dtype=float))
        return np.asarray(below + np.tril(below, -1).T)

    def _rounded_away(self) -> bool:
        """Tests whether the least inertia at the start is an effect of rounding of the displacements."""
        if not (self.dynamics.moduli and self.dynamics.weighed):
            return False
        nearby = [self.start, *self._beside(self.start, 4.0 * np.finfo(float).eps * np.abs(self.start))]
        least = [float(np.linalg.det(self._inertia(0.0, state))) for state in nearby]
        return not min(least) > 0.5 * max(least)


class _DeadCentreError(GraphError):
    """A place where the inertia that a flow meets vanishes; t, s, is None at the start."""

    def __init__(self, flow: str, place: str, t: float | None) -> None:
        defect = "there are no rates at the start" if t is None else f"the motion cannot be followed past t = {t:.6g} s"
        super().__init__(
            f"{defect}: the effective inertia vanishes at {place}, where the flow of {flow} has no inertia (a "
            f"dead centre without inertia before it): give {flow} an inertia (I), or more resistance (R) to carry it through"
        )
        self.place = place


class _StiffnessError(Exception):
    """Steps of an explicit method at the limit of its stability: decay rate, 1/s, step, s, and evaluations to the end."""

    def __init__(self, rate: float, step: float, evaluations: float) -> None:
        super().__init__()
        self.rate, self.step, self.evaluations = rate, step, evaluations


# -- through modes ----------------------------------------------------------------------------------------------------------


class Switched:
    """A graph with switches; `phases` has the equations of the modes that were met so far."""

    def __init__(self, graph: BondGraph, signals: Mapping[str, Any], evaluations: int) -> None:
        self.graph, self.signals = graph, signals
        self.dry, self.switches = dry_resistors(graph), (*graph.switched, *dry_resistors(graph))
        self.phases: dict[Mode, Dynamics] = {}
        self.log, self.budget = RateLog(), evaluations
        self.scale: dict[tuple[int, int], float] = {}  # of every condition its greatest value so far

    def dynamics(self, at: Mode) -> Dynamics:
        """The equations of a mode."""
        if at not in self.phases:
            states = dict(zip(self.switches, at, strict=True))
            try:
                dynamics = Dynamics(mode(self.graph, **states), self.signals)
            except GraphError as error:
                said = ", ".join(f"{n} {(_DRY if n in self.dry else _ON)[s]}" for n, s in states.items())
                raise GraphError(f"with {said}: {error}") from error
            if any(p.element.name != n for p in dynamics.form.followers for n in self.graph.coupled(p.element.name)):
                raise GraphError("a field's ports follow in one mode and not in another: put an R, or a C, between")
            self.phases[at] = dynamics
        return self.phases[at]

    def margins(self, at: Mode, times: Array, states: Array) -> tuple[Array, list[tuple[int, int]]]:
        """The margins of a mode, each above 0 within it, at times (n,); for each the switch and its state beyond."""
        here, rows = self._observed(self.dynamics(at), times, states), []
        beyond: list[tuple[int, int]] = []
        for k, (name, on) in enumerate(zip(self.switches, at, strict=True)):
            if name not in self.dry:
                value = here.law(name)
                rows.append(value if on else -value)
                beyond.append((k, 1 - on))
            elif on:
                rows.append(on * here.flow(name))
                beyond.append((k, 0))
            else:
                effort = here.efforts[self.graph.bond_of(name).number]
                rows += [here.law(name, TINY) - effort, effort - here.law(name, -TINY)]
                beyond += [(k, 1), (k, -1)]
        return np.array(rows).reshape(len(rows), *np.shape(times)), beyond

    def _observed(self, dynamics: Dynamics, times: Array, states: Array) -> Auditor:
        """The graph with all that conditions may read: of a switched junction the sum over its bonds, too."""
        with np.errstate(all="ignore"):
            instant = dynamics.at(times, list(states))
        here = Auditor(dynamics, self.graph, times, dict(zip(dynamics.names, states, strict=True)), {}, instant)
        for name in self.graph.switched:
            letter, summed = ("e", here.efforts) if self.graph.elements[name].kind == "1" else ("f", here.flows)
            if (read := f"{letter}_{name}") not in (*self.graph.displacements, *self.graph.signals):
                here.places[read] = sum(b.sign(name) * summed[b.number] for b in self.graph.at(name))
        return here

    def contents(self, at: Mode, t: float, state: Sequence[float]) -> dict[str, float]:
        """The momentum or displacement of every store, and every further state, by name."""
        dynamics = self.dynamics(at)
        following = Walk(dynamics, t, list(state)).following()
        return dict(zip(dynamics.names, map(float, state), strict=True)) | {n: float(x) for n, x in following.items()}

    def carried(self, stored: Mapping[str, float], at: Mode, t: float) -> Array:
        """The state of a mode that begins with the stores' present values; followers share theirs with their leaders."""
        dynamics = self.dynamics(at)
        form = dynamics.form
        state = np.array([stored.get(name, 0.0) for name in dynamics.names])
        if not form.stores or not (form.followers or form.massless):
            return state
        size, names = len(form.stores), [form.state_name(p) for p in (*form.stores, *form.followers)]
        sign = [p.sense for p in (*form.stores, *form.followers)]
        own = [0.0 if p.element.name in form.massless else sign[k] for k, p in enumerate(form.stores)]
        before, rest = [stored.get(name, 0.0) for name in names], state[size:].tolist()
        largest = {x: max((abs(v) for n, v in zip(names, before, strict=True) if n[0] == x), default=0.0) for x in "fpq"}
        scale = [largest[name[0]] or 1.0 for name in names[:size]]

        def balance(shares: list[float]) -> Balance:
            values = [share * unit for share, unit in zip(shares, scale, strict=True)]
            walk = Walk(dynamics, t, [*values, *rest])
            outputs = [walk.output_slopes(k) for k in range(size)]
            residuals = [own[k] * (values[k] - before[k]) for k in range(size)]
            slopes = [[own[i] if i == j else 0.0 for j in range(size)] for i in range(size)]
            for k, (port, weight) in enumerate(zip(form.followers, walk.weights(), strict=True), start=size):
                more = sign[k] * (float(walk.followed(k - size)) - before[k])
                gains = {column: float(gain) for column, gain in walk.gain[port.input].items() if column < size}
                for i, gain in gains.items():
                    residuals[i] += gain * more
                    for other, n, slope in ((g, n, s) for j, g in gains.items() for n, s in outputs[j].items()):
                        slopes[i][n] += gain * weight * other * slope
            rows = [[slope * unit / scale[i] for slope, unit in zip(slopes[i], scale, strict=True)] for i in range(size)]
            return [residual / unit for residual, unit in zip(residuals, scale, strict=True)], rows

        where = ", ".join(self.graph.where(p.element.name) for p in form.followers) or "the joint inertia"
        start = [value / unit for value, unit in zip(state.tolist(), scale, strict=False)]
        shares = settle(balance, size, (), where, start)
        return np.array([*(share * unit for share, unit in zip(shares, scale, strict=True)), *rest])

    def settled(self, at: Mode, t: float, stored: Mapping[str, float]) -> tuple[Mode, Array]:
        """The mode that continues from the stores' present values: that given, or another if its conditions fail."""
        seen = [at]
        while True:
            state = self.carried(stored, at, t)
            values, beyond = self.margins(at, np.array([t]), state[:, None])
            failed = (p for value, p in zip(values[:, 0], beyond, strict=True) if value < -_NOTHING * self.scale.get(p, 0.0))
            change = next(failed, None)
            if change is None:
                return at, state
            at = (*at[: change[0]], change[1], *at[change[0] + 1 :])
            if at in seen:
                self._chatters(t, seen)
            seen.append(at)

    def _chatters(self, t: float, seen: Sequence[Mode]) -> None:
        last = {k for one in seen for two in seen for k, (a, b) in enumerate(zip(one, two, strict=True)) if a != b}
        names = ", ".join(self.graph.where(self.switches[k]) for k in sorted(last))
        raise GraphError(
            f"the condition of {names} chatters at t = {t:.9g} s: each state of it requires the other at once; "
            "let it read quantities that its own change does not affect"
        )

    def follow(self, start: tuple[Mode, Array], until: float, rtol: float, method: str) -> Run:
        """The motion within rtol: runs at tighter tolerance until two agree, in their events too."""
        longest = until / stepping.LEAST_STEPS if self.graph.varies else math.inf
        tolerance = max(stepping.FIRST * rtol, 10.0 * stepping.FINEST)

        def tighter(tolerance: float, looser: Run) -> tuple[Run, float]:
            nonlocal longest
            sizes = _sizes(looser)
            run, longest = self._run(start, until, method, (tolerance, sizes), longest), stepping.SHORTER * longest
            return run, _error(run, looser, sizes)

        first, _ = tighter(tolerance, self._run(start, until, method, (max(stepping.PILOT, rtol), {}), longest))
        run, error = stepping.agreement(first, tighter, rtol, tolerance)
        return replace(run, error=error)

    def stepped(self, start: tuple[Mode, Array], until: float, method: str, steps: tuple[float, float]) -> Run:
        """The motion in equal steps from event to event, with twice its difference to one with steps of another length."""
        run, other = (self._run(start, until, method, (0.0, {}), math.inf, step) for step in steps)
        return replace(run, error=_error(run, other, _sizes(other)))

    def begin(self, start: Callable[[Dynamics], Array]) -> tuple[Mode, Array]:
        """The mode that a motion begins in, and its state; `start` gives that of a mode, or does not know its states."""
        fault: GraphError | None = None
        for at in self._freest():
            try:
                state = start(self.dynamics(at))
            except GraphError as error:
                fault = fault or error
                continue
            here = self._observed(self.dynamics(at), np.array([0.0]), state[:, None])
            ways = {name: int(np.sign(here.flow(name)[0])) for name in self.dry}
            first = tuple(ways.get(n, s) for n, s in zip(self.switches, at, strict=True))
            return self.settled(first, 0.0, self.contents(at, 0.0, state.tolist()))
        assert fault is not None
        raise fault

    def _freest(self) -> list[Mode]:
        """Modes, those with the most states first: what is given of a start is not bound by what is joined."""
        freedoms: dict[Mode, int] = {}

        def states(at: Mode) -> int:
            if at not in freedoms:
                try:
                    freedoms[at] = len(self.dynamics(at).names)
                except GraphError:
                    freedoms[at] = -1
            return freedoms[at]

        best = tuple(1 for _ in self.switches)
        states(best)
        for k, name in enumerate(self.switches):
            other = (*best[:k], 0, *best[k + 1 :])
            if name not in self.dry and states(other) > states(best):
                best = other
        return sorted(freedoms, key=lambda at: -freedoms[at])

    def _run(
        self,
        start: tuple[Mode, Array],
        until: float,
        method: str,
        tolerance: tuple[float, Mapping[str, float]],
        longest: float,
        length: float | None = None,
    ) -> Run:
        """The motion from a mode and state on; with a `length`, s, in equal steps."""
        (at, state), t = start, 0.0
        stretches: list[Step] = []
        modes: list[Mode] = []
        events: list[Event] = []
        turns: list[float] = []
        while t < until:
            dynamics = self.dynamics(at)
            scales = np.array([tolerance[0] * tolerance[1].get(n, 1.0) for n in dynamics.names])
            beyond = self.margins(at, np.array([t]), state[:, None])[1]
            relative = (0.0, np.maximum(scales, 1e-300))
            crossed = None
            rates = self._rates(dynamics)
            equal = fixed(method, rates, t, state, until, length) if length else None
            for step in equal or adaptive(method, rates, t, state, until, relative, longest):
                step = crossing(self._watched(at, step, beyond), step) if beyond else step
                crossed = step.crossed
                state = np.asarray(step.dense(step.end) if crossed is not None else step.last, dtype=float)
                stretches.append(step._replace(crossed=None, after=state))
                modes.append(at)
                if step.end == step.start:  # it leaves at once
                    stretches.pop()
                    modes.pop()
                t = step.end
                if crossed is not None:
                    break
            if crossed is None:
                break
            stored, place = self.contents(at, t, state.tolist()), beyond[crossed]
            after, state = self.settled((*at[: place[0]], place[1], *at[place[0] + 1 :]), t, stored)
            events += [Event(t, self.switches[k], b) for k, (a, b) in enumerate(zip(at, after, strict=True)) if a != b]
            turns.append(t)
            if len(turns) > _AT_ONCE and t - turns[-_AT_ONCE] <= _SOON * until:
                self._chatters(t, [at, (*at[: place[0]], place[1], *at[place[0] + 1 :])])
            if len(events) > _MOST_EVENTS:
                raise GraphError(f"{_MOST_EVENTS} events reach t = {t:.6g} s only: ask for a shorter time")
            at = after
        return Run(self.graph, self.phases, tuple(stretches), tuple(modes), ({},) * len(modes), tuple(events))

    def _watched(self, at: Mode, step: Step, beyond: Sequence[tuple[int, int]]) -> Events:
        """The conditions of a mode as events of a step."""
        times = step.start + (step.end - step.start) * stepping.WITHIN
        sizes = np.abs(self.margins(at, times, step.dense(times))[0]).max(axis=1)
        for (k, state), size in zip(beyond, sizes.tolist(), strict=True):
            for side in (state,) if self.switches[k] in self.dry else (0, 1):  # one condition, on either side
                self.scale[k, side] = max(self.scale.get((k, side), 0.0), size)
        rounding = np.array([_NOTHING * self.scale[place] for place in beyond])
        return Events(lambda times, states: self.margins(at, times, states)[0], np.ones(len(beyond)), rounding=rounding)

    def _rates(self, dynamics: Dynamics) -> PlainRates:
        """The rates of a mode, as long as evaluations are left."""
        rates = dynamics.within(self.log)

        def limited(t: float, values: Sequence[float]) -> Sequence[float]:
            if self.log.evaluations >= self.budget:
                raise GraphError(
                    f"{self.budget} evaluations of the rates are spent at t = {t:.6g} s: ask for a shorter time or a larger "
                    "rtol, or use a method for stiff equations (Radau); evaluations= allows more"
                )
            return rates(t, values)

        return limited


def _sizes(run: Run) -> dict[str, float]:
    """The greatest absolute value of every state of a run, 1 of one that stays 0."""
    return {name: float(np.abs(values).max()) or 1.0 for name, values in run.states().items()}


def _error(run: Run, other: Run, sizes: Mapping[str, float]) -> float:
    """An error bound of a run, by its difference to another one."""
    return max(2.0 * difference(run, other, np.array([sizes.get(name, 1.0) for name in run.names])), rounding(run))


# -- what a simulation is given ---------------------------------------------------------------------------------------------


def _check_count(method: str, step: float, until: float, budget: int) -> None:
    """Refuses equal steps, with the shorter ones that they are compared with, of more evaluations than are allowed."""
    most = sum(math.ceil(until / length * (1.0 - 1e-12)) for length in (step, _FIXED_RATIO * step))
    needed = most * len(FIXED[method][0])
    if needed > budget:
        raise GraphError(
            f"steps of {step:g} s for {until:g} s, and the shorter ones that they are compared with, take {needed} "
            f"evaluations of the rates by {method}, {budget} are allowed: ask for a shorter time or longer steps; "
            "evaluations= allows more"
        )


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
    """The initial state; names may be those of the state, of a spring, or of a 1-junction whose flow a store settles."""
    names, form = dynamics.names, dynamics.form
    start = np.zeros(len(names))
    for k, displacement in enumerate(form.displacements, start=len(dynamics.form.stores)):
        start[k] = displacement.initial
    faults, flows, following = [], dict[str, float](), dict[int, tuple[str, float]]()
    followers = {form.state_name(port): place for place, port in enumerate(form.followers)}
    for name, value in initial.items():
        junction = name.removeprefix("f_")
        state = next((n for n in (name, f"q_{name}") if n in names), None)
        if not isinstance(value, Real) or not np.isfinite(value):
            faults.append(f"initial {name!r}: found {value!r}, expected a finite number")
        elif state is not None:
            start[names.index(state)] = value
        elif (follower := next((n for n in (name, f"q_{name}") if n in followers), None)) is not None:
            following[followers[follower]] = name, value
        elif form.flow_state(junction) is not None:
            flows[junction] = value
        else:
            faults.append(_no_state(dynamics, name))
    refuse(faults)
    for junction, value in flows.items():
        led, gain = form.flow_state(junction), Walk(dynamics, 0.0, start.tolist(), {}, acts=False).gain
        assert led is not None
        port, share = form.stores[led], gain[form.variable(junction)][led]
        if form.graph.coupled(port.element.name):
            raise GraphError(f"initial {junction!r}: its flow follows from several states: give {', '.join(names)}")
        if not share:
            raise GraphError(
                f"initial {junction!r}: its flow is 0 at the start, whatever {names[led]} is: give {names[led]}"
            )
        start[led] = dynamics.stored(port, value / share)
    walk = Walk(dynamics, 0.0, start.tolist()) if following else None
    for place, (name, value) in following.items():
        port = form.followers[place]
        leads, due = form.follows[port.element.name], float(walk.following()[form.state_name(port)]) if walk else 0.0
        if abs(value - due) > _BALANCED * max(abs(value), abs(due)):
            faults.append(
                f"initial {name!r}: found {value:g}, but {leads}, which makes it {due:.6g} (difference "
                f"{abs(value - due):.6g}): give the states, {', '.join(names)}"
            )
    refuse(faults)
    return start


def _no_state(dynamics: Dynamics, name: str) -> str:
    """The line on a name that is no state, with the probable state or the one that it follows."""
    graph, names = dynamics.graph, dynamics.names
    follower = dynamics.form.follows.get(name)
    if follower is not None:
        return f"initial {name!r}: it is no state, for {follower}; the states are {', '.join(names)}"
    meant = next((n for n in (f"p_{name}", f"q_{name}") if n in names), None)
    junction = name.removeprefix("f_")
    if meant is None and junction in graph.elements:
        on = dynamics.form.support[dynamics.form.variable(junction)]
        meant = " and ".join(names[k] for k in on if k < len(dynamics.form.stores)) or None
    advice = f"; give {meant}" if meant else ""
    return f"initial {name!r}: no such state{advice}; the independent ones are {', '.join(names)}"


def _breaks(dynamics: Dynamics, breakpoints: Mapping[str, Any], until: float) -> tuple[list[Breaks], list[float]]:
    """Ascending places of breaks of states, within a period if there is one, and the times of breaks."""
    breaks: list[Breaks] = []
    times: list[float] = []
    for name, values in breakpoints.items():
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
        elif name not in dynamics.names and period is None and (led := _led(dynamics, name)) is not None:
            port, share = dynamics.form.stores[led[0]], led[1]
            at = np.array([dynamics.stored(port, value / share) for value in places])
            breaks.append(Breaks(led[0], np.sort(at), None, name))
        elif name in dynamics.names:
            breaks.append(Breaks(dynamics.names.index(name), places, period, name))
        else:
            raise GraphError(f"breaks {name!r}: no such state; they are t, {', '.join(dynamics.names)}")
    return breaks, times


def _led(dynamics: Dynamics, name: str) -> tuple[int, float] | None:
    """The place of the store that settles a 1-junction's flow f_NAME by a fixed ratio, and that ratio."""
    junction, form = name.removeprefix("f_"), dynamics.form
    k = form.flow_state(junction)
    if k is None or form.graph.coupled(form.stores[k].element.name):
        return None
    if not all(map(dynamics.graph.is_linear, form.through(form.variable(junction)))):
        return None
    gain = Walk(dynamics, 0.0, [0.0] * len(dynamics.names)).gain[form.variable(junction)][k]
    return (k, float(gain)) if gain else None
