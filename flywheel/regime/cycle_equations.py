"""The equations of a steady periodic motion on given cells, and Newton's method on them: energy, motor's states, unknowns.

The unknown is the kinetic energy over the cycle, E'(phi) = F(phi, omega(E)), E = ½ (J + I*) omega², closed on itself. Where
more is unknown (the flywheel for an irregularity, the balance for a mean speed) it is solved for in the same iteration
(`periodic`). It also gives the cycle's multiplier, exp(integral of dF/dE): the fraction of a change left after a cycle.

The fineness of the cells is not tested here: `periodic_motion` halves and cuts them in alternation with the motion.

Source: U. M. Ascher, R. M. M. Mattheij, R. D. Russell, Numerical Solution of Boundary Value Problems, SIAM 1995.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.machine.equation import Moments, NoMotionError, Rate, undefined
from flywheel.numerics import cells
from flywheel.numerics.budget import spend
from flywheel.numerics.cells import ORDER, ROUNDING, Array, Cells, Changes, Index
from flywheel.numerics.faults import Fault

CLOSE = 1e-5
"""Of the fluctuation of speed: what Newton's method may leave of a motion that only leads to others."""

_MOST_STEPS = 40
_MOST_LONG = 12  # Newton steps with a given flywheel, in turn as long as the fluctuation and no shorter: none converges then
_MOST_BATCH_STEPS = 16  # of many motions at once: what needs more is left to be sized alone
_BATCH_HALVINGS, _MOST_DAMPED = 8, 4  # of many at once: of a Newton step; steps in turn that are halved
_NEAR_STEP = 1e-3  # of the fluctuation: a step of a motion whose mean of extremes is known well enough to refer to it
_PER_SEARCH = 1000  # nodes whose cost equals that of reducing the machine on its cells
_PER_STEP = 50  # nodes whose cost equals the fixed cost of a Newton step
_HALVINGS = 30  # of a Newton step
_LAST_STEP = 1e-13  # of the fluctuation of speed: a step smaller than this is the last
_UNCONVERGED_STEP = 1e-9  # of the fluctuation: steps that stay above it have not converged
_ROUNDING_STEP = 1e-3  # of the fluctuation: steps that stay below it are limited by rounding
_NET_WORK = 1e-6  # of the work exchanged: net work of a cycle that does not close
_LEAST_GUESS = 1.0  # of omega²: greatest variation of a first guess
_REFERENCE_DISTANCE = 20.0  # fluctuations: a reference speed twice as far away loses a digit
_KEPT = 0.25  # of omega²: least share that a step leaves
_NO_EFFECT = 1e-9  # of the total work of a balance: net work that counts as zero
_WIDEST, _SPEED_STEPS, _NEARLY = 64.0, 60, 1e-6  # speeds of balance: times the reference, steps, and how near
_STEADY = 1e-9  # of the terms in the rates of a motion at constant speed: residual of its speed
_MOST_GROWTH = 700.0  # exponent that a float still holds
_BLUR = 64 * ROUNDING  # of the terms that a slope is summed from
_STOPS = "the motions tried stop within the cycle"


class Demand(NamedTuple):
    """Requirements of a regime, at the crank: one of a flywheel's `inertia` and an `irregularity` to size it for.

    With a balance also the mean of extremes `speed` (rad/s). Moments that depend on position alone, and have no balance,
    do not determine the level of the motion: a speed then sets it, and the net work of the cycle remains. Quantities that
    are not required are None; of many motions at once the others are arrays.
    """

    inertia: Any
    irregularity: Any
    speed: Any


class State(NamedTuple):
    """The states over the cycle: at the nodes (cells, states, nodes), at the edges (cells + 1, states); J and the balance.

    The first state is the kinetic energy less ½ (J + I*(0)) w² (J), w being the reference speed; the others are a motor's
    own, such as its current (A).
    """

    nodes: Array
    edges: Array
    inertia: Any
    unknown: Any

    @property
    def of_circuit(self) -> Array:
        """A motor's own states at the nodes: (states, cells, nodes)."""
        last = self.nodes.ndim - 1
        return self.nodes[..., 1:, :].transpose(last - 1, *range(last - 1), last)


class SpeedExtremes(NamedTuple):
    """Fastest and slowest point of a motion: omega/w - 1, cell, local abscissa, J + I*, omega² = w² (1 + s)."""

    excess: Array
    cell: Index
    t: Array
    total: Array
    s: Array


class Sensitivity(NamedTuple):
    """Sensitivity of a sized flywheel to the errors of its motion.

    `by_square` (kg m²) by the excess s of either extreme, omega² = w² (1 + s); `by_work` (kg m²/J) by the work of a cycle.
    Infinite if the effect of a flywheel is lost in rounding.
    """

    by_square: float
    by_work: float


class Periodic(NamedTuple):
    """A periodic motion on a mesh, with the reference speed w (rad/s), and data of its solution.

    `multiplier` is that of the cycle, `damping` 1 minus it, `steps` the Newton steps taken; `left` is the next step, as a
    share of the fluctuation of speed, of an iteration that ended one step early, so that the multiplier is that before its
    last; else 0. `sensitivity` is that of a flywheel that was sized.
    """

    moments: Moments
    reference: float
    state: State
    extremes: SpeedExtremes
    rate: Rate
    omega: Array
    multiplier: float
    damping: float
    steps: int
    left: Any = 0.0
    sensitivity: Sensitivity | None = None
    closing: Array | None = None  # what each of several states may miss of its closing
    reach: Array | None = None  # how far that carries, (states, states)

    @property
    def speed(self) -> Any:
        """Mean of the greatest and least speed (rad/s)."""
        return self.reference * (1.0 + 0.5 * self.extremes.excess.sum(axis=-1))

    @property
    def lightest(self) -> Any:
        """The least J + I* at the nodes (kg m²)."""
        return self.state.inertia + self.moments.inertia.min(axis=(-2, -1))

    @property
    def irregularity(self) -> Any:
        """(greatest - least)/mean."""
        high, low = self.extremes.excess[..., 0], self.extremes.excess[..., 1]
        return (high - low) / (1.0 + 0.5 * (high + low))


class NoRegimeError(NoMotionError):
    """No periodic motion was found; the message gives the outcome of the iteration."""


class UndefinedError(NoRegimeError):
    """A law has no finite value at a speed of the iteration; `fault` has the law and the reason."""

    def __init__(self, fault: Fault) -> None:
        super().__init__(f"{fault.path} comes to {fault.defect}")


class LostError(NoRegimeError):
    """A motion whose figures are lost in rounding; the message names them."""


class UnresolvedError(NoRegimeError):
    """A flywheel that rounding leaves undetermined: the irregularity hardly depends on it."""


# -- Newton's method on given cells --------------------------------------------------------------------------------------


def periodic(
    moments: Moments,
    reference: float,
    demand: Demand,
    start: State,
    apart: Array | None = None,
    within: float = 0.0,
    *,
    rough: bool = False,
) -> Periodic:
    """The periodic motion nearest to a start, with its unknowns, by Newton's method.

    Args:
        moments: the machine on its mesh.
        reference: speed (rad/s) to which the energies are relative: the required one, or near the expected one.
        demand: the inertia, or the irregularity; with a balance the mean of extremes.
        start: a first guess.
        apart: part subtracted from the rates of the states, (cells, states, nodes), in a continuation (`unevenness`).
        within: share of the fluctuation of speed that the next step may have for the iteration to end early.
        rough: true to end even with the first step where that is within this share: nothing measures then what it leaves.

    Raises:
        NoRegimeError: if the iteration does not converge: the machine would stop within the cycle, or no motion closes.

    """
    spend(_PER_SEARCH)
    equations = _RegimeEquations(moments, reference, demand, apart)
    state, last, final, long = start, np.inf, demand.speed is not None, 0
    for step in range(1, _MOST_STEPS + 1):
        here = equations.speeds(state)
        change = equations.linearisation(state, here)
        state, size = equations.newton_step(state, here, change)
        stays = size <= _ROUNDING_STEP and size >= 0.3 * last
        settled = size <= _LAST_STEP or (
            stays and final and size <= max(_UNCONVERGED_STEP, equations.rounding_step(state, change))
        )
        shortens = not settled and 0.0 < last < 1.0
        left = min(size / last, 1.0) * size if shortens else 0.0  # at most: steps shorten faster and faster
        left = size if rough and not (settled or shortens) else left
        settled |= 0.0 < left < within
        if settled and not final:
            final = bool(here.about_reference)
        if settled and final:
            motion = equations.result(state, change, step)._replace(left=left)
            state = motion.state._replace(inertia=float(motion.state.inertia), unknown=float(motion.state.unknown))
            return motion._replace(state=state, multiplier=float(motion.multiplier), damping=float(motion.damping))
        if settled or (
            stays and not final
        ):  # energies relative to a speed far from the motion's own have no digits to spare
            equations, state = equations.about_own_mean(state)
            final = True
        last, long = size, long + 1 if size >= max(0.3 * last, 1.0) else 0
        if long >= _MOST_LONG and not equations.sized:
            break
    raise NoRegimeError(f"Newton's method has not converged in {step} steps")


def periodic_motions(
    moments: Any, reference: Array, demand: Demand, start: State, within: float = 0.0
) -> tuple[Periodic, NDArray[np.bool_]]:
    """The periodic motions of many machines at once, each nearest to its start, and which of them were found.

    Arguments as those of `periodic`, with an axis of machines before all others. Those that have converged or failed are set
    aside when they are half of all.
    """
    equations, which = _RegimeEquations(moments, reference, demand), np.arange(reference.size)
    state, last, damped = start, np.full(reference.shape, np.inf), np.zeros(reference.shape)
    final, good = np.full(reference.shape, demand.speed is not None), np.zeros(reference.shape, bool)
    aside: list[tuple[Index, tuple[Any, ...]]] = []
    for step in range(1, _MOST_BATCH_STEPS + 1):
        here = equations.speeds(state)
        change = equations.linearisation(state, here)
        state, size = equations.newton_step(state, here, change)
        final |= (size <= _NEAR_STEP) & here.about_reference
        stays, settled = final & (size <= _ROUNDING_STEP) & (size >= 0.3 * last), final & (size <= _LAST_STEP)
        left = np.minimum(size / np.maximum(last, 1e-300), 1.0) * size
        early = final & ~settled & (last < 1.0) & (left < within)
        left, settled = np.where(early, left, 0.0), settled | early
        if (stays & ~settled).any():
            settled |= stays & (size <= np.maximum(_UNCONVERGED_STEP, equations.rounding_step(state, change)))
        damped = np.where(size >= 1.0, damped + 1, 0)
        equations.lost |= ~np.isfinite(size) | (damped > _MOST_DAMPED)
        good[which], done = settled & ~equations.lost, settled | equations.lost
        last, near = size, ~final & ~done & (size <= _NEAR_STEP)
        if near.any():
            equations, state = equations.about_own_mean(state, near)
            final |= near
        if 2 * done.sum() >= done.size or step == _MOST_BATCH_STEPS:
            gone = done if step < _MOST_BATCH_STEPS else np.ones_like(done)
            every: tuple[Any, ...] = (*state, equations.w, left, *change[:7])
            aside.append((which[gone], tuple(each[gone] for each in every)))
            if gone.all():
                break
            rest = np.flatnonzero(~gone)
            equations, state, which = equations.of(rest), State(*(each[rest] for each in state)), which[rest]
            last, damped, final = last[rest], damped[rest], final[rest]
    columns: list[Any] = [np.empty((reference.size, *row.shape[1:])) for row in aside[0][1]]
    for some, rows in aside:
        for column, row in zip(columns, rows, strict=True):
            column[some] = row
    equations = _RegimeEquations(moments, columns[4], demand)
    equations.lost = ~good
    motions = equations.result(State(*columns[:4]), Changes(*columns[6:]), _MOST_BATCH_STEPS)
    return motions._replace(left=columns[5]), good & ~equations.lost


def first_guess(moments: Moments, reference: Any, inertia: Any, unknown: Any, own: Sequence[float] = ()) -> State:
    """The motion under torques at a constant speed, with that speed at phi = 0.

    Their net work in the cycle is spread evenly; a motor's own states are those given.
    """
    mesh, ends = moments.mesh, moments.mesh.edges
    omega = _over_cells(reference) + np.zeros_like(mesh.phi)
    steady = [np.full(mesh.phi.shape, value) for value in own]
    force = moments.rate(omega, unknown, inertia, steady).moment
    rising = cells.antiderivative(cells.fit(force), mesh.half)
    edges = cells.accumulated(rising)
    nodes = edges[..., :-1, None] + rising @ cells.AT_NODES
    left = (edges[..., -1] / ends[..., -1])[..., None]
    nodes, edges = nodes - left[..., None] * mesh.phi, edges - left * ends
    variation = _CycleInertia(moments)
    square, total = np.asarray(reference**2)[..., None], _over_cells(inertia) + moments.inertia
    # at that very speed
    still_nodes, still_edges = 0.5 * square[..., None] * variation.nodes, 0.5 * square * variation.edges
    s = 2 * (nodes - still_nodes) / (square[..., None] * total)
    middle = 0.25 * (s.max(axis=(-2, -1)) + s.min(axis=(-2, -1)))
    level = -square * (middle * (inertia + variation.start))[..., None]
    share = np.minimum(1.0, _LEAST_GUESS / np.maximum(np.ptp(s, axis=(-2, -1)), 1e-300))[..., None]
    # what is strongly damped varies far less
    nodes = still_nodes + share[..., None] * (nodes + level[..., None] - still_nodes)
    edges = still_edges + share * (edges + level - still_edges)
    at_nodes = np.stack((nodes, *steady), axis=-2)
    at_edges = np.stack((edges, *(np.full_like(edges, value) for value in own)), axis=-1)
    return State(at_nodes, at_edges, inertia, unknown)


def even_guess(moments: Moments, reference: float, inertia: float, unknown: float, own: Sequence[float] = ()) -> State:
    """A constant speed and constant states of a motor: the motion itself where loads are constant."""
    variation, square = _CycleInertia(moments), reference**2
    at_nodes = [0.5 * square * variation.nodes, *(np.full(moments.mesh.phi.shape, value) for value in own)]
    at_edges = [0.5 * square * variation.edges, *(np.full(variation.edges.shape, value) for value in own)]
    return State(np.stack(at_nodes, axis=1), np.stack(at_edges, axis=1), inertia, unknown)


def even_motion(moments: Moments, reference: float, demand: Demand, inertia: float, unknown: float) -> Periodic | None:
    """The motion at a constant speed if nothing varies it, in closed form; else None.

    A small change z of the states then obeys z' = A z with a constant A: a cycle of theta rad leaves the share
    exp(theta Re a) of it, a the eigenvalue of A with the greatest real part.
    """
    total = inertia + moments.inertia
    if not (float(total.min()) > 0.0 and float(np.ptp(total)) <= _BLUR * float(total.max())):
        return None
    own = [float(value) for value in moments.steady_states(reference)]
    state = even_guess(moments, reference, inertia, unknown, own)
    equations = _RegimeEquations(moments, reference, demand._replace(inertia=inertia, irregularity=None))
    here = equations.speeds(state)
    left = here.rates.copy()
    left[:, 0] -= 0.5 * reference**2 * moments.slope
    scale = float((here.rate.exchanged + 0.5 * reference**2 * moments.steepness).max())
    even = float(np.ptp(left[:, 0])) <= _BLUR * scale and float(np.abs(left[:, 0]).max()) <= _STEADY * scale
    if moments.circuit is not None:
        even &= bool((np.abs(left[:, 1:]).max(axis=(0, 2)) <= _STEADY * np.array(moments.circuit.scales)).all())
    jacobian = equations.slopes(state, here)[0]
    uniform = np.ptp(jacobian, axis=(0, 3)) <= _STEADY * np.abs(jacobian).max(axis=(0, 3))
    if not (even and uniform.all()):
        return None
    exponent = float(moments.mesh.edges[-1] * np.linalg.eigvals(jacobian[0, ..., 0]).real.max())
    multiplier, damping = float(np.exp(min(exponent, _MOST_GROWTH))), -float(np.expm1(min(exponent, _MOST_GROWTH)))
    nothing = np.zeros(2)
    extremes = SpeedExtremes(
        nothing, np.zeros(2, dtype=np.intp), np.full(2, -1.0), np.full(2, float(here.total[0, 0])), nothing
    )
    return Periodic(moments, reference, state, extremes, here.rate, here.omega, multiplier, damping, 0)


def exponents(moments: Moments, reference: float, inertias: Sequence[float], unknown: float) -> NDArray[np.complex128]:
    """The exponents, per radian of the crank, of small changes of speed and a motor's states about the even motion.

    Their imaginary parts are frequencies of swings. A harmonic load excites a pair -d ± j w most at a frequency of its own,
    a resonance, if w > d: damping ratio below 1/sqrt(2).

    Args:
        moments: the machine.
        reference: speed of the even motion, rad/s.
        inertias: of flywheels, kg m² on the crank; meshes lose as with the first.
        unknown: value of the scene's unknown.

    Returns:
        Those with each flywheel, (flywheels, states).

    """
    own = [float(value) for value in moments.steady_states(reference)]
    state = even_guess(moments, reference, inertias[0], unknown, own)
    equations = _RegimeEquations(moments, reference, Demand(inertias[0], None, None))
    here = equations.speeds(state)
    jacobian = np.repeat(equations.slopes(state, here)[0][None], len(inertias), axis=0)
    lighter = here.total / (here.total + (np.array(inertias) - inertias[0])[:, None, None])  # as an energy changes the speed
    jacobian[..., 0, :] *= lighter[..., None, :]
    return np.asarray(np.linalg.eigvals(jacobian.mean(axis=(1, 4))), dtype=complex)


def about(solved: Periodic, reference: float) -> State:
    """The states of a motion with energies relative to another speed (rad/s)."""
    state, start = solved.state, solved.state.inertia + _CycleInertia(solved.moments).start
    shift = 0.5 * start * (solved.reference - reference) * (solved.reference + reference)
    nodes, edges = state.nodes.copy(), state.edges.copy()
    nodes[:, 0], edges[:, 0] = nodes[:, 0] + shift, edges[:, 0] + shift
    return state._replace(nodes=nodes, edges=edges)


def balanced_guess(moments: Moments, reference: Any, inertia: Any, unknown: Any) -> State | None:
    """Speeds at which the torques do not change the speed, at each angle, F = ½ omega² dI*/dphi; None if there is none.

    Stiff torques hold the motion near it: that of a machine whose inertia goes to 0 except for dead centres. Of many
    machines those without such speeds have NaN.
    """
    omega = _over_cells(reference) + np.zeros_like(moments.mesh.phi)
    low, high = omega / _WIDEST, omega * _WIDEST
    for _ in range(_SPEED_STEPS):
        rate = moments.rate(omega, unknown, inertia)
        push = rate.moment - 0.5 * moments.slope * omega**2
        slope = rate.by_speed - moments.slope * omega
        low, high = np.where(push >= 0.0, omega, low), np.where(push <= 0.0, omega, high)
        closer = omega - push / np.minimum(slope, -1e-300)
        closer = np.where((closer > low) & (closer < high), closer, 0.5 * (low + high))
        omega, moved = closer, np.abs(closer - omega)
        finite, near = np.isfinite(omega).all(axis=(-2, -1)), (moved <= _NEARLY * omega).all(axis=(-2, -1))
        if np.all(near | ~finite):
            break
    if not np.any(near):
        return None
    omega = np.where(_over_cells(near), omega, np.nan)
    start = (inertia + _CycleInertia(moments).start) * reference**2
    energy = 0.5 * ((_over_cells(inertia) + moments.inertia) * omega**2 - _over_cells(start))
    ends = cells.ends(cells.fit(energy))
    edges = np.concatenate((ends[..., 0], ends[..., -1:, 1]), axis=-1)
    return State(energy[..., None, :], edges[..., None], inertia, unknown)


def sampled(moments: Moments, reference: float, inertia: float, phi: Array, omega: Array, own: Array) -> State:
    """The states of a motion given at ascending angles (rad) over a cycle: speeds (rad/s) and a motor's own."""
    mesh, variation = moments.mesh, _CycleInertia(moments)
    start = inertia + variation.start

    def at(places: Array, varies: Array) -> Array:
        rows = [np.interp(places, phi, row, period=mesh.edges[-1]) for row in (omega, *own)]
        energy = 0.5 * ((start + varies) * rows[0] ** 2 - start * reference**2)
        return np.stack((energy, *rows[1:]), axis=1)

    return State(at(mesh.phi, variation.nodes), at(mesh.edges, variation.edges), inertia, 0.0)


def unevenness(moments: Moments, reference: float, even: State) -> Array:
    """The excess of the states' rates over those of an even motion, (cells, states, nodes): zero where that is steady."""
    equations = _RegimeEquations(moments, reference, Demand(even.inertia, None, None))
    excess = equations.speeds(even).rates.copy()
    excess[:, 0] -= 0.5 * reference**2 * moments.slope
    return excess


def with_inertia(state: State, moments: Moments, reference: Any, inertia: Any) -> State:
    """A state with another flywheel (kg m² on the crank) at the same energies, or at the same speeds if it would stop.

    The first suits loads that do not depend on speed, the second those that depend mainly on it. Of many motions each is
    treated by itself.
    """
    variation, square = _CycleInertia(moments), np.asarray(reference) ** 2

    def beside(number: Any, varies: Array) -> Array:
        number = np.asarray(number)
        return np.asarray(number.reshape(*number.shape, *[1] * (varies.ndim - number.ndim)))

    def excess(energy: Array, varies: Array, own: Any) -> Array:
        base, start = beside(square, varies), beside(own + variation.start, varies)
        return np.asarray((2 * energy - base * varies) / (base * (start + varies)))

    now, then = (1.0 + excess(state.nodes[..., 0, :], variation.nodes, own) for own in (state.inertia, inertia))
    stops = ~(then > _KEPT * now).all(axis=(-2, -1))
    nodes, edges = state.nodes.copy(), state.edges.copy()
    for values, varies in ((nodes[..., 0, :], variation.nodes), (edges[..., 0], variation.edges)) if np.any(stops) else ():
        s = excess(values, varies, state.inertia)
        faster = 0.5 * beside(square, varies) * (varies + s * (beside(inertia + variation.start, varies) + varies))
        values[...] = np.where(beside(stops, varies), faster, values)
    return State(nodes, edges, inertia, state.unknown)


def carried(solved: Periodic, moments: Moments) -> State:
    """The states of a motion on another mesh."""
    old, new = solved.moments.mesh, moments.mesh
    if new is old:
        return solved.state
    series = cells.fit(solved.state.nodes)
    lead = new.edges.shape[:-1]
    motions = np.arange(lead[0])[:, None] if lead else None

    def at(phi: Array) -> Array:
        cell, t = cells.located(old, phi)
        rows = series[cell] if motions is None else series[motions, cell]
        return np.asarray((rows * cells.basis(t, ORDER)[..., None, :]).sum(axis=-1))

    nodes = at(new.phi.reshape(*lead, -1)).reshape(*new.phi.shape, -1)
    return solved.state._replace(nodes=np.moveaxis(nodes, -1, -2), edges=at(new.edges))


def speeds(state: State, moments: Moments, reference: float) -> Array | None:
    """The speeds (rad/s) at the nodes of a state; None if it stops."""
    total = state.inertia + moments.inertia
    s = (2 * state.nodes[:, 0] - reference**2 * _CycleInertia(moments).nodes) / (reference**2 * total)
    return reference * np.sqrt(1.0 + s) if s.min() > -1.0 and total.min() > 0.0 else None


class _CycleInertia:
    """I* over the cycle as its value at phi = 0 and the difference from that, at nodes and edges."""

    def __init__(self, moments: Moments) -> None:
        mesh = moments.mesh
        self.rising = cells.antiderivative(cells.fit(moments.slope), mesh.half)
        self.edges = cells.accumulated(self.rising)
        self.nodes = self.edges[..., :-1, None] + self.rising @ cells.AT_NODES
        self.start = cells.ends(cells.fit(moments.inertia[..., 0, :]))[..., 0]


class _NodeSpeeds(NamedTuple):
    """A state's speeds and the rates of its states at the nodes, with the speed's slopes by energy and inertia."""

    omega: Array
    rate: Rate
    total: Array
    s: Array
    by_energy: Array
    by_inertia: Array
    rates: Array  # (cells, states, nodes)

    @property
    def about_reference(self) -> Any:
        """Tests whether the reference speed is near the motion's, by the measure of its fluctuation."""
        high, low = (s / (1.0 + np.sqrt(1.0 + s)) for s in (self.s.max(axis=(-2, -1)), self.s.min(axis=(-2, -1))))
        return np.abs(high + low) <= _REFERENCE_DISTANCE * (high - low) + ROUNDING


def _over_cells(numbers: Any) -> Any:
    """A number, or one of each of many motions, beside values on (..., cells, nodes)."""
    return np.asarray(numbers)[..., None, None]


class _RegimeEquations:
    """One regime's equations: rates, their linearisation, and the conditions on closing and on the extremes of speed.

    Those of many motions at once have an axis of motions before all others, in moments, states and demand. A motion
    that cannot continue is then marked as `lost`; alone it is refused.
    """

    def __init__(self, moments: Moments, reference: Any, demand: Demand, apart: Array | None = None) -> None:
        self.moments, self.w, self.demand, self.apart = moments, reference, demand, apart
        self.mesh: Cells = moments.mesh
        self.inertia = _CycleInertia(moments)
        self.sized = demand.inertia is None
        self.balanced = moments.machine.scene.unknown is not None
        self.parameters = ("inertia",) * self.sized + ("unknown",) * self.balanced
        self.levelled = not (self.sized or self.balanced or demand.speed is None)
        self.lost: Any = np.zeros(np.shape(reference), bool)

    def check(self, good: Any, fault: Callable[[], NoRegimeError]) -> None:
        """Marks failed motions as lost; a single one is refused."""
        if np.ndim(good):
            self.lost = self.lost | ~good
        elif not good:
            raise fault()

    def of(self, which: Index) -> _RegimeEquations:
        """The equations of some of many motions."""
        moments: Any = self.moments
        demand = Demand(*(None if each is None else each[which] for each in self.demand))
        selection = _RegimeEquations(moments.of(which), self.w[which], demand)
        selection.lost = self.lost[which]
        return selection

    def about_own_mean(self, state: State, which: Any = True) -> tuple[_RegimeEquations, State]:
        """The same motion with its energies relative to its own mean of extremes; of many, a selection."""
        speed = self.w * (1.0 + 0.5 * self.extremes(state, self.speeds(state)).excess.sum(axis=-1))
        speed = np.where(which, speed, self.w)[()]
        shift = 0.5 * (state.inertia + self.inertia.start) * (self.w - speed) * (self.w + speed)
        nodes, edges = state.nodes.copy(), state.edges.copy()
        nodes[..., 0, :] += _over_cells(shift)
        edges[..., 0] += shift[..., None]
        equations = copy(self)
        equations.w = speed
        return equations, state._replace(nodes=nodes, edges=edges)

    def excess(self, energy: Array, inertia: Any) -> tuple[Array, Array]:
        """J + I* and the excess s in omega² = w² (1 + s) at the nodes, by the energy there."""
        total, square = _over_cells(inertia) + self.moments.inertia, _over_cells(self.w) ** 2
        return total, (2 * energy - square * self.inertia.nodes) / (square * total)

    def speeds(self, state: State) -> _NodeSpeeds:
        """Speeds and rates at the nodes."""
        total, s = self.excess(state.nodes[..., 0, :], state.inertia)
        self.check((s.min(axis=(-2, -1)) > -1.0) & (total.min(axis=(-2, -1)) > 0.0), lambda: NoRegimeError(_STOPS))
        w = _over_cells(self.w)
        omega = w * np.sqrt(1.0 + s)
        circuit, ratio = self.moments.circuit, self.moments.drive_ratio
        rate = self.moments.rate(omega, state.unknown, state.inertia, state.of_circuit)
        self.check(
            np.isfinite(rate.moment).all(axis=(-2, -1)),
            lambda: UndefinedError(undefined(self.moments.machine, self.mesh, rate.moment, omega)),
        )
        rates = [rate.moment]
        if circuit is not None:
            rates += [of_time / omega for of_time in circuit.rates(ratio * omega, state.of_circuit)]
        by_energy = 1.0 / (total * omega)
        followed = np.stack(rates, axis=-2) if self.apart is None else np.stack(rates, axis=-2) - self.apart
        return _NodeSpeeds(omega, rate, total, s, by_energy, -0.5 * w**2 * s / (total * omega), followed)

    def slopes(self, state: State, here: _NodeSpeeds) -> tuple[Array, Array]:
        """dF/dz (cells, states, states, nodes) and dF/dp (cells, states, parameters, nodes) of all states' rates F."""
        rate, states = here.rate, state.nodes.shape[-2]
        *lead, nodes = here.omega.shape
        by_state = np.zeros((*lead, states, states, nodes))
        by_parameter = np.zeros((*lead, states, len(self.parameters), nodes))
        by_speed = [rate.by_speed]
        by_state[..., 0, 0, :] = rate.by_speed * here.by_energy
        if self.moments.circuit is not None:  # dx/dphi = (dx/dt)/omega
            ratio = self.moments.drive_ratio
            slopes = self.moments.circuit.slopes(ratio * here.omega, state.of_circuit)
            apart = np.zeros((1, states, 1)) if self.apart is None else self.apart
            by_state[..., 0, 1:, :] = np.moveaxis(rate.by_states, 0, -2)
            for j, (by_omega, row) in enumerate(zip(slopes.rates_by_speed, slopes.rates_by_states, strict=True), 1):
                by_speed.append(ratio * by_omega / here.omega - (here.rates[..., j, :] + apart[..., j, :]) / here.omega)
                by_state[..., j, 0, :] = by_speed[j] * here.by_energy
                for k, of_time in enumerate(row, 1):
                    by_state[..., j, k, :] = of_time / here.omega
        for k, name in enumerate(self.parameters):
            if name == "unknown":
                by_parameter[..., 0, k, :] = rate.by_unknown
                continue
            for j, slope in enumerate(by_speed):
                by_parameter[..., j, k, :] = slope * here.by_inertia
            by_parameter[..., 0, k, :] += rate.by_inertia
        return by_state, by_parameter

    def linearisation(self, state: State, here: _NodeSpeeds) -> Changes:
        """The equations of small changes over the cycle."""
        spend(_PER_STEP + self.mesh.phi.size)
        by_state, by_parameter = self.slopes(state, here)
        rising, edges = cells.antiderivative(cells.fit(here.rates), self.mesh.half[..., None]), state.edges
        at_nodes = edges[..., :-1, :, None] + rising @ cells.AT_NODES - state.nodes
        at_edges = edges[..., :-1, :] + rising.sum(axis=-1) - edges[..., 1:, :]
        through = self.mesh.half[..., 0], by_state, by_parameter, at_nodes, at_edges
        if self.levelled:
            return cells.changes(*through)
        return cells.round_cycle(*through, edges[..., -1, :] - edges[..., 0, :])

    def conditions(
        self, state: State, here: _NodeSpeeds, change: Changes, at: SpeedExtremes | None = None
    ) -> tuple[Array, Array]:
        """The equations of a step: the work that closes the cycle, and the required speeds.

        Derivatives of the excess e of the extremes, omega = w (1 + e): by the unknowns (2, unknowns), and by itself (2,).
        The irregularity is imposed on omega², which is linear in the energy, so that one near 2 needs no more steps.
        `at` are the extremes where they are known.
        """
        rows = [] if change.around is None else [change.around[..., :-1]]
        right = [] if change.around is None else [-change.around[..., -1]]
        if self.parameters or self.levelled:
            of_extremes = self._of_extremes(state, here, change, self.extremes(state, here) if at is None else at)
            rows.append(of_extremes[0])
            right.append(of_extremes[1])
        return np.concatenate(rows, axis=-2), np.concatenate(right, axis=-1)

    def _of_extremes(self, state: State, here: _NodeSpeeds, change: Changes, at: SpeedExtremes) -> tuple[Array, Array]:
        """The equations on the extremes of speed."""
        states = state.nodes.shape[-2]
        columns = np.concatenate((change.start, change.by, change.rest[..., None]), axis=-1)[..., 0, :, :]
        at_edge = np.concatenate((change.edge_start, change.edge_by, change.edge_rest[..., None]), axis=-1)[..., 0, :].copy()
        at_edge[..., 0] += 1.0  # edge_start leaves out what the energy itself starts with
        inside, edge = np.abs(at.t) < 1.0, at.cell + (at.t > 0.0)
        within = np.einsum("...kj,...kjp->...kp", cells.weights(at.t), self._at(columns, at.cell))
        energy = np.where(inside[..., None], within, self._at(at_edge, edge))
        w = np.asarray(self.w)[..., None]
        scale = at.total * w * (1.0 + at.excess)
        slopes = energy / (scale * w)[..., None]
        if self.sized:
            slopes[..., states] += -0.5 * w * at.s / scale
        slopes, offsets = slopes[..., :-1], slopes[..., -1]
        mean = np.asarray(self.w if self.demand.speed is None else self.demand.speed)[..., None] / w
        if not self.sized:
            return 0.5 * slopes.sum(axis=-2, keepdims=True), mean - 1.0 - 0.5 * (at.excess + offsets).sum(-1, keepdims=True)
        eps = np.asarray(0.0 if self.demand.irregularity is None else self.demand.irregularity)[..., None]
        to_square = 2.0 * (1.0 + at.excess)
        of_square, places = to_square[..., None] * slopes, at.s + to_square * offsets
        ends = eps * np.array([1.0, -1.0]) + 0.25 * eps * eps  # z+ - 1 and z- - 1
        if self.balanced:
            return of_square, (mean - 1.0) * (mean + 1.0) + mean * mean * ends - places
        slow, fast = 1.0 + ends[..., 1:], 1.0 + ends[..., :1]
        row = slow[..., None] * of_square[..., :1, :] - fast[..., None] * of_square[..., 1:, :]
        return row, 2.0 * eps - slow * places[..., :1] + fast * places[..., 1:]

    def newton_step(self, state: State, here: _NodeSpeeds, change: Changes) -> tuple[State, Any]:
        """The state after a Newton step, shortened so that the machine keeps turning; its size by the fluctuation of speed.

        After a step at least a quarter of omega² remains everywhere; steps are halved until that holds.
        """
        matrix, column = self.conditions(state, here, change)
        scale = np.maximum(np.abs(matrix).max(axis=-1), 1e-300)
        step = self._solved(matrix / scale[..., None], column / scale)
        states = state.nodes.shape[-2]
        start, by = step[..., :states], step[..., states:]
        nodes = (change.start @ start[..., None, None, :, None] + change.by @ by[..., None, None, :, None])[..., 0]
        nodes += change.rest
        edges = (change.edge_start @ start[..., None, :, None] + change.edge_by @ by[..., None, :, None])[..., 0]
        edges += start[..., None, :] + change.edge_rest
        own = {name: by[..., k] for k, name in enumerate(self.parameters)}
        heavier, balance = own.get("inertia", 0.0), own.get("unknown", 0.0)
        share: Any = np.ones(np.shape(self.w))
        for _ in range(_HALVINGS if share.ndim == 0 else _BATCH_HALVINGS):
            new = State(
                state.nodes + share[..., None, None, None] * nodes,
                state.edges + share[..., None, None] * edges,
                state.inertia + share * heavier,
                state.unknown + share * balance,
            )
            total, s = self.excess(new.nodes[..., 0, :], new.inertia)
            good = (total.min(axis=(-2, -1)) > 0.0) & (np.isfinite(s) & ((1.0 + s) > _KEPT * (1.0 + here.s))).all(
                axis=(-2, -1)
            )
            if np.all(good | self.lost):
                break
            share = np.where(good, share, 0.5 * share)
        self.check(good, lambda: NoRegimeError(_STOPS))
        shift = np.abs(nodes[..., 0, :] * here.by_energy + _over_cells(heavier) * here.by_inertia).max(axis=(-2, -1))
        size = shift / np.maximum(np.ptp(here.omega, axis=(-2, -1)), 4 * ROUNDING * self.w / _LAST_STEP)
        if self.sized:
            size = np.maximum(size, np.abs(heavier) / np.maximum(np.abs(new.inertia), here.total.max(axis=(-2, -1))))
        return new, np.where(share < 1.0, 1.0, size)

    def _solved(self, matrix: Array, column: Array) -> Array:
        """The unknowns of a step; NaN for motions whose equations are singular."""
        try:
            return np.asarray(np.linalg.solve(matrix, column[..., None])[..., 0])
        except np.linalg.LinAlgError:
            singular = np.linalg.matrix_rank(np.nan_to_num(matrix)) < matrix.shape[-1]
            self.check(~singular, lambda: NoRegimeError("nothing determines its speed"))
            sound = np.where(singular[..., None, None], np.eye(matrix.shape[-1]), matrix)
            return np.where(singular[..., None], np.nan, np.linalg.solve(sound, column[..., None])[..., 0])

    def rounding_step(self, state: State, change: Changes) -> Any:
        """The step due to rounding of torques that determine the speed weakly: `_ROUNDING_STEP` at most."""
        if self.demand.speed is not None:
            return 0.0
        here = self.speeds(state)
        work = 64 * ROUNDING * cells.integral(here.rate.exchanged, self.mesh.half).sum(axis=-1)
        damping = np.maximum(np.abs(cells.multiplier(change)[1]), 1e-300)
        level = work / (damping * self.w**2 * np.maximum(here.total.min(axis=(-2, -1)), 1e-300))
        fluctuation = np.ptp(self.extremes(state, here).excess, axis=-1)
        return np.minimum(level / np.maximum(fluctuation, 4 * ROUNDING / _LAST_STEP), _ROUNDING_STEP)

    def sensitivity(self, state: State, here: _NodeSpeeds, change: Changes, at: SpeedExtremes) -> Sensitivity:
        """The sensitivity of the sized flywheel to an excess of the extremes' omega², and to net work of the cycle."""
        matrix, _ = self.conditions(state, here, change, at)
        scale = np.maximum(np.abs(matrix).max(axis=-1), 1e-300)
        eps = np.asarray(0.0 if self.demand.irregularity is None else self.demand.irregularity)
        unit = np.zeros(matrix.shape[:-1])
        unit[..., state.nodes.shape[-2]] = 1.0
        answer = np.abs(self._solved((matrix / scale[..., None]).swapaxes(-2, -1), unit)) / scale
        # weights as in `conditions`
        by_square = answer[..., -2:].sum(axis=-1) if self.balanced else answer[..., -1] * (2.0 + 0.5 * eps * eps)
        # the slope is what is left of changes that cancel, the more so the more torques that fall with speed take back
        fading = np.abs(cells.integral(here.rate.by_speed * here.by_energy, self.mesh.half)).max(axis=-1)
        lightest = here.total.min(axis=(-2, -1))
        left = 1.0 - by_square * _BLUR * (1.0 + fading) * np.abs(here.s).max(axis=(-2, -1)) / lightest
        divisor = np.where(left > 0.0, left, 0.0)
        with np.errstate(divide="ignore"):
            return Sensitivity((by_square / divisor)[()], (answer[..., 0] / divisor)[()])

    def extremes(self, state: State, here: _NodeSpeeds, *, settled: bool = False) -> SpeedExtremes:
        """Fastest and slowest point: at roots of F - ½ omega² dI*/dphi, or at an end of a cell.

        The energy is the integral of F once the iteration has converged; before, that integral has no meaning. All roots
        are polished as those of the function itself, not of its interpolant, before they are compared.
        """
        half_square = 0.5 * here.omega**2
        force = cells.fit(here.rate.moment - half_square * self.moments.slope)
        noise = 32 * ROUNDING * (here.rate.exchanged + half_square * np.abs(self.moments.slope)).max(axis=-1)
        *lead, number, _ = force.shape
        roots = cells.crossings(force.reshape(-1, number, ORDER), noise.reshape(-1, number))
        # both ends of every cell, then the roots, filled up with phi = 0
        first = roots.function.searchsorted(np.arange(1 + force.size // (number * ORDER)))
        cell = np.zeros((first.size - 1, 2 * number + int((first[1:] - first[:-1]).max())), np.intp)
        t = np.full(cell.shape, -1.0)
        cell[:, :number] = cell[:, number : 2 * number] = np.arange(number)
        t[:, number : 2 * number] = 1.0
        column = 2 * number + np.arange(roots.t.size) - first[roots.function]
        cell[roots.function, column], t[roots.function, column] = roots.cell, roots.t
        row = (cell + number * np.arange(first.size - 1)[:, None]).reshape(*lead, -1)
        cell, t = cell.reshape(*lead, -1), t.reshape(*lead, -1)
        inside = np.abs(t) < 1.0
        s, _ = self._fluctuation(state, here, cell, t, settled)
        self.check(s.min(axis=-1) > -1.0, lambda: NoRegimeError(_STOPS))
        square = (np.asarray(self.w)[..., None] ** 2 * (1.0 + s))[inside][:, None]
        moment, slope = (each.reshape(-1, ORDER)[row[inside]] for each in (here.rate.moment, self.moments.slope))
        ends = np.ones(len(row[inside]))
        t[inside] = cells.halley(cells.fit(moment - 0.5 * square * slope), t[inside], -ends, ends)[0]
        s, total = self._fluctuation(state, here, cell, t, settled)
        places = self._at(self.mesh.middle[..., 0], cell) + self._at(self.mesh.half[..., 0], cell) * t
        summits = np.stack((cells.peak(s, places), cells.peak(-s, places)), axis=-1)
        cell, t, s, total = (self._at(each, summits) for each in (cell, t, s, total))
        return SpeedExtremes(s / (1.0 + np.sqrt(1.0 + s)), cell, t, total, s)

    def _at(self, values: Any, cell: Index) -> Any:
        """Values of cells or edges (..., cells, others) at some of them, (..., some)."""
        if cell.ndim == 1:
            return values[cell]
        motions, number, *others = values.shape
        return values.reshape(-1, *others)[number * np.arange(motions)[:, None] + cell]

    def _fluctuation(self, state: State, here: _NodeSpeeds, cell: Index, t: Array, settled: bool) -> tuple[Array, Array]:
        """The excess s in omega² = w² (1 + s), and J + I*, at local abscissas of cells."""
        basis = cells.basis(t)
        if settled:
            rising = cells.antiderivative(cells.fit(here.rate.moment), self.mesh.half)
            energy = self._at(state.edges[..., 0], cell) + (self._at(rising, cell) * basis).sum(axis=-1)
        else:
            within = (self._at(cells.fit(state.nodes[..., 0, :]), cell) * basis[..., :ORDER]).sum(axis=-1)
            energy = np.where(np.abs(t) < 1.0, within, self._at(state.edges[..., 0], cell + (t > 0.0)))
        variation = self._at(self.inertia.edges, cell) + (self._at(self.inertia.rising, cell) * basis).sum(axis=-1)
        total = np.asarray(state.inertia + self.inertia.start)[..., None] + variation
        square = np.asarray(self.w)[..., None] ** 2
        return (2 * energy - square * variation) / (square * total), total

    def result(self, state: State, change: Changes, steps: int) -> Periodic:
        """The motion at the state to which the iteration converged.

        Its balance makes the net work zero, because the iteration loses its last digits in large energies.
        """
        half, here = self.mesh.half, self.speeds(state)
        if self.balanced:
            by_unknown = here.rate.by_unknown
            rows = np.stack((here.rate.moment, by_unknown, np.abs(by_unknown)))
            net, slope, size = cells.integral(rows, half).sum(axis=-1)
            effective = np.abs(slope) > _NO_EFFECT * size
            state = state._replace(unknown=state.unknown - np.where(effective, net / np.where(effective, slope, 1.0), 0.0))
            here = self.speeds(state)
        net, exchanged = cells.integral(np.stack((here.rate.moment, here.rate.exchanged)), half).sum(axis=-1)
        if not (self.levelled or self.apart is not None):
            closed = np.abs(net) <= _NET_WORK * exchanged
            self.check(closed, lambda: NoRegimeError("the net work of a cycle is not zero"))
        extremes = self.extremes(state, here, settled=True)
        answer = self.sensitivity(state, here, change, extremes) if self.sized else None
        multiplier, damping = cells.multiplier(change)
        motion = Periodic(self.moments, self.w, state, extremes, here.rate, here.omega, multiplier, damping, steps)
        motion = motion._replace(sensitivity=answer)
        if not self.moments.swings:
            return motion
        sizes = np.abs(here.rates).max(axis=-1) * half  # of what adds up in each cell
        missed = cells.TAIL_OF_INTEGRAL * np.stack(
            [cells.tails(cells.fit(row)) for row in np.moveaxis(here.rates, -2, 0)], axis=-1
        )
        closing = (missed * half + 4 * ROUNDING * sizes).sum(axis=-2)
        return motion._replace(closing=closing, reach=change.reach)
