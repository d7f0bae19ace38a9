"""Steady periodic motion of a machine whose torques depend on speed, by collocation with Newton's method on its energy.

The unknown is the kinetic energy over the cycle, E'(phi) = F(phi, omega(E)), E = ½ (J + I*) omega², closed on itself. Where
more is unknown (the flywheel for an irregularity, the balance for a mean speed) it is solved for in the same iteration.
The cycle's multiplier, exp(integral of dF/dE), comes with it: what a cycle leaves of a small change.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.machine.dynamics import Moments, Rate
from flywheel.machine.machine import Machine, merged
from flywheel.numerics import cells as piecewise
from flywheel.numerics import collocation
from flywheel.numerics.budget import spend
from flywheel.numerics.cells import NODES, ORDER, ROUNDING, Cells
from flywheel.numerics.collocation import Changes
from flywheel.numerics.faults import Fault
from flywheel.regime import steady_motion, turning_moment
from flywheel.regime.constant_speed import cycle_of
from flywheel.regime.steady_motion import NoMotionError, Run
from flywheel.regime.turning_moment import Cycle

Array = NDArray[np.float64]

_MOST_STEPS = 40
_PER_SEARCH = 1000  # nodes that would take as long as to reduce the machine on its cells
_PER_STEP = 50  # nodes that would take as long as what a Newton step takes whatever their number
_HALVINGS = 30
_SETTLED = 1e-13  # of the swing: a step smaller than this is the last
_LOST = 1e-9  # of the swing: steps that stay above it have not converged
_OPEN = 1e-6  # of the work exchanged: net work of a cycle that does not close
_LEAST_GUESS = 1.0  # of omega²: as much as a first guess varies at most
_FAR = 20.0  # swings: a reference speed that is twice as far off costs a digit
_KEPT = 0.25  # of omega²: a step takes no more than the rest
_NO_EFFECT = 1e-9  # net work of a balance that does none, as a share of all that it does
_BLUR = 64 * ROUNDING  # of the terms that a slope is summed from
_STOPS = "the motions tried stop within the cycle"
_OFF = 1e-3  # of the swing: steps that stay below it lack digits, not direction


class Asked(NamedTuple):
    """What is asked of a regime, at the crank: one of a flywheel's `inertia` and an `irregularity` to size it for.

    With a balance also the mean of extremes `speed` (rad/s). Moments that depend on position alone, and have no balance,
    leave the level of the motion open: a speed then sets it, and what work they leave over in the cycle stays.
    """

    inertia: float | None
    irregularity: float | None
    speed: float | None


class State(NamedTuple):
    """The states over the cycle: at the nodes (cells, states, nodes), at the edges (cells + 1, states); J and the balance.

    The first state is the kinetic energy less ½ (J + I*(0)) w² (J), w being the reference speed; the second, where a motor
    has inductance, its current (A).
    """

    nodes: Array
    edges: Array
    inertia: float
    unknown: float


class Extremes(NamedTuple):
    """Fastest and slowest point of a motion: omega/w - 1, cell, local abscissa, J + I*, omega² = w² (1 + s)."""

    excess: Array
    cell: NDArray[np.intp]
    t: Array
    total: Array
    s: Array


class Sensitivity(NamedTuple):
    """How a flywheel that is sized answers to what its motion is off.

    `by_square` (kg m²) by the excess s of either extreme, omega² = w² (1 + s); `by_work` (kg m²/J) by the work of a cycle.
    Infinite where rounding leaves nothing of what a flywheel changes.
    """

    by_square: float
    by_work: float


class Periodic(NamedTuple):
    """A periodic motion on a mesh, with the reference speed w (rad/s), and how it was found.

    `multiplier` is that of the cycle, `damping` 1 less it, `steps` the Newton steps taken; `sensitivity` is that of a
    flywheel that was sized.
    """

    moments: Moments
    reference: float
    state: State
    extremes: Extremes
    rate: Rate
    omega: Array
    multiplier: float
    damping: float
    steps: int
    sensitivity: Sensitivity | None = None

    @property
    def speed(self) -> float:
        """Mean of the greatest and least speed (rad/s)."""
        return self.reference * (1.0 + 0.5 * float(self.extremes.excess.sum()))

    @property
    def irregularity(self) -> float:
        """(greatest - least)/mean."""
        high, low = self.extremes.excess.tolist()
        return float((high - low) / (1.0 + 0.5 * (high + low)))


class NoRegimeError(NoMotionError):
    """No periodic motion was found; the message says what became of the iteration."""


class UndefinedError(NoRegimeError):
    """A law has no finite value at speeds that the iteration comes to; `fault` says which and why."""

    def __init__(self, fault: Fault) -> None:
        super().__init__(f"{fault.path} comes to {fault.found}")


def periodic(moments: Moments, reference: float, asked: Asked, start: State) -> Periodic:
    """The periodic motion nearest to a start, and with it what is unknown, by Newton's method.

    Args:
        moments: the machine on its mesh.
        reference: speed (rad/s) that the energies are taken relative to: the one asked for, or near the one expected.
        asked: the inertia, or the irregularity; with a balance the mean of extremes.
        start: a first guess.

    Raises:
        NoRegimeError: where the iteration finds none: the machine would stop within the cycle, or nothing closes.

    """
    spend(_PER_SEARCH)
    solver = _Solver(moments, reference, asked)
    state, last, lost = start, np.inf, asked.speed is not None
    for step in range(1, _MOST_STEPS + 1):
        state, change, size = solver.improved(state)
        stays = size <= _OFF and size >= 0.3 * last
        still = size <= _SETTLED or (stays and lost and size <= max(_LOST, solver.unsure(state, change)))
        if still and (lost or solver.centred(state)):
            return solver.result(state, change, step)
        if (still or stays) and not lost:  # energies relative to a speed far from the motion's own have no digits to spare
            solver, state = _recentred(solver, state)
            lost = True
        last = size
    raise NoRegimeError(f"Newton's method has not settled in {_MOST_STEPS} steps")


def sensitivity(solved: Periodic, speed: float | None) -> Sensitivity:
    """How a flywheel sized for a motion's own irregularity, and mean of extremes (rad/s) if held, would answer."""
    solver = _Solver(solved.moments, solved.reference, Asked(None, solved.irregularity, speed))
    return solver.sensitivity(solved.state, solver.linearised(solved.state, solver.along(solved.state)))


def _recentred(solver: _Solver, state: State) -> tuple[_Solver, State]:
    """The same motion with its energies relative to its own mean of extremes."""
    speed = solver.w * (1.0 + 0.5 * float(solver.extremes(state, solver.along(state)).excess.sum()))
    shift = 0.5 * (state.inertia + solver.inertia.start) * (solver.w - speed) * (solver.w + speed)
    nodes, edges = state.nodes.copy(), state.edges.copy()
    nodes[:, 0], edges[:, 0] = nodes[:, 0] + shift, edges[:, 0] + shift
    return _Solver(solver.moments, speed, solver.asked), state._replace(nodes=nodes, edges=edges)


def first_guess(moments: Moments, reference: float, inertia: float, unknown: float, current: float = 0.0) -> State:
    """The motion that torques taken at a constant speed would give, with that speed at phi = 0.

    The work that they leave over in the cycle is spread evenly.
    """
    mesh = moments.mesh
    omega = np.full(mesh.phi.shape, reference)
    currents = np.full(mesh.phi.shape, current)
    force = moments.rate(omega, unknown, inertia, currents).moment
    rising = piecewise.antiderivative(piecewise.fit(force), mesh.half)
    edges = piecewise.accumulated(rising)
    nodes = edges[:-1, None] + rising @ piecewise.basis(NODES).T
    left = edges[-1] / mesh.edges[-1]
    nodes, edges = nodes - left * mesh.phi, edges - left * mesh.edges
    variation = _Inertia(moments)
    square, total = reference**2, inertia + moments.inertia
    still_nodes, still_edges = 0.5 * square * variation.nodes, 0.5 * square * variation.edges  # at that very speed
    s = 2 * (nodes - still_nodes) / (square * total)
    level = -0.25 * float(s.max() + s.min()) * square * (inertia + variation.start)
    share = min(1.0, _LEAST_GUESS / max(float(np.ptp(s)), 1e-300))  # what is strongly damped varies far less
    nodes = still_nodes + share * (nodes + level - still_nodes)
    edges = still_edges + share * (edges + level - still_edges)
    if moments.circuit is None:
        return State(nodes[:, None, :], edges[:, None], inertia, unknown)
    return State(
        np.stack((nodes, currents), axis=1), np.stack((edges, np.full_like(edges, current)), axis=1), inertia, unknown
    )


def with_inertia(state: State, moments: Moments, reference: float, inertia: float) -> State:
    """A state with another flywheel (kg m² on the crank) at the same energies, or at the same speeds if those would stop it.

    The first is right for loads that know no speed, the second for those that know little else.
    """
    variation, square = _Inertia(moments), reference**2

    def excess(energy: Array, varies: Array, total: Array) -> Array:
        return np.asarray((2 * energy - square * varies) / (square * total))

    def total(of: float, varies: Array) -> Array:
        return of + variation.start + varies

    energy, varies = state.nodes[:, 0], variation.nodes
    now, then = (1.0 + excess(energy, varies, total(of, varies)) for of in (state.inertia, inertia))
    if (then > _KEPT * now).all():
        return state._replace(inertia=inertia)
    nodes, edges = state.nodes.copy(), state.edges.copy()
    for values, varies in ((nodes, variation.nodes), (edges, variation.edges)):
        s = excess(values[:, 0], varies, total(state.inertia, varies))
        values[:, 0] = 0.5 * square * (varies + s * total(inertia, varies))
    return State(nodes, edges, inertia, state.unknown)


class _Inertia:
    """I* over the cycle as its value at phi = 0 and what it differs from that, at nodes and edges."""

    def __init__(self, moments: Moments) -> None:
        mesh = moments.mesh
        self.rising = piecewise.antiderivative(piecewise.fit(moments.slope), mesh.half)
        self.edges = piecewise.accumulated(self.rising)
        self.nodes = self.edges[:-1, None] + self.rising @ piecewise.basis(NODES).T
        self.start = float(piecewise.value(piecewise.fit(moments.inertia[:1]), np.array([-1.0]))[0])


class _Along(NamedTuple):
    """A state's speeds and the rates of its states at the nodes, with the speed's slopes by energy and inertia."""

    omega: Array
    rate: Rate
    total: Array
    s: Array
    by_energy: Array
    by_inertia: Array
    rates: Array  # (cells, states, nodes)


class _Solver:
    """One regime's equations."""

    def __init__(self, moments: Moments, reference: float, asked: Asked) -> None:
        self.moments, self.w, self.asked = moments, reference, asked
        self.mesh: Cells = moments.mesh
        self.inertia = _Inertia(moments)
        self.sized = asked.inertia is None
        self.balanced = moments.machine.scene.unknown is not None
        self.parameters = ("inertia",) * self.sized + ("unknown",) * self.balanced
        self.levelled = not (self.sized or self.balanced or asked.speed is None)

    # -- one state -----------------------------------------------------------------------------------------------------

    def along(self, state: State) -> _Along:
        """Speeds and rates at the nodes."""
        energy = state.nodes[:, 0, :]
        total = state.inertia + self.moments.inertia
        s = (2 * energy - self.w**2 * self.inertia.nodes) / (self.w**2 * total)
        if not (s.min() > -1.0 and total.min() > 0.0):
            raise NoRegimeError(_STOPS)
        omega = self.w * np.sqrt(1.0 + s)
        current = state.nodes[:, 1, :] if self.moments.circuit is not None else None
        rate = self.moments.rate(omega, state.unknown, state.inertia, current)
        if not np.isfinite(rate.moment).all():
            raise UndefinedError(turning_moment.undefined(self.moments.machine, self.mesh, rate.moment, omega))
        rates = [rate.moment]
        if self.moments.circuit is not None and current is not None:
            rates.append(self.moments.circuit.current_rate(self.moments.drive_ratio * omega, current) / omega)
        by_energy = 1.0 / (total * omega)
        return _Along(omega, rate, total, s, by_energy, -0.5 * self.w**2 * s / (total * omega), np.stack(rates, axis=1))

    def jacobians(self, along: _Along, state: State) -> tuple[Array, Array]:
        """dF/dz (cells, states, states, nodes) and dF/dp (cells, states, parameters, nodes)."""
        rate, states = along.rate, state.nodes.shape[1]
        cells, nodes = along.omega.shape
        by_state = np.zeros((cells, states, states, nodes))
        by_parameter = np.zeros((cells, states, len(self.parameters), nodes))
        slopes = [rate.by_speed]
        by_state[:, 0, 0] = rate.by_speed * along.by_energy
        if self.moments.circuit is not None:
            by_state[:, 0, 1] = rate.by_current
            by_speed, by_current = self._circuit_slopes(along, state)
            slopes.append(by_speed)
            by_state[:, 1, 0], by_state[:, 1, 1] = by_speed * along.by_energy, by_current
        for k, name in enumerate(self.parameters):
            if name == "unknown":
                by_parameter[:, 0, k] = rate.by_unknown
                continue
            for j, slope in enumerate(slopes):
                by_parameter[:, j, k] = slope * along.by_inertia
            by_parameter[:, 0, k] += rate.by_inertia
        return by_state, by_parameter

    def _circuit_slopes(self, along: _Along, state: State) -> tuple[Array, Array]:
        """Slopes of di/dphi = (di/dt)/omega by speed and by current; di/dt is linear in both."""
        circuit, ratio, omega, current = self.moments.circuit, self.moments.drive_ratio, along.omega, state.nodes[:, 1, :]
        assert circuit is not None
        at_rest = circuit.current_rate(0.0, 0.0)
        by_omega = ratio * (circuit.current_rate(1.0, 0.0) - at_rest)
        by_current = circuit.current_rate(0.0, 1.0) - at_rest
        whole = circuit.current_rate(ratio * omega, current)
        return by_omega / omega - whole / omega**2, by_current / omega

    # -- one step ------------------------------------------------------------------------------------------------------

    def improved(self, state: State) -> tuple[State, Changes, float]:
        """A Newton step, its linearisation, and its size as a share of the swing."""
        along = self.along(state)
        change = self.linearised(state, along)
        return self._taken(state, along, change, self._step(state, along, change))

    def linearised(self, state: State, along: _Along) -> Changes:
        """How small changes run through the cycle."""
        spend(_PER_STEP + self.mesh.phi.size)
        by_state, by_parameter = self.jacobians(along, state)
        rising = piecewise.antiderivative(piecewise.fit(along.rates), self.mesh.half[:, None])
        at_nodes = state.edges[:-1, :, None] + rising @ piecewise.basis(NODES).T - state.nodes
        at_edges = state.edges[:-1] + rising.sum(axis=-1) - state.edges[1:]
        gap = state.edges[-1] - state.edges[0]
        through = self.mesh.half[:, 0], by_state, by_parameter, at_nodes, at_edges
        return collocation.changes(*through) if self.levelled else collocation.round_cycle(*through, gap)

    def _step(self, state: State, along: _Along, change: Changes) -> Array:
        """Changes of the states where they start and of the parameters: the cycle closes at the speeds asked for."""
        matrix, column = self._conditions(state, along, change)
        scale = np.maximum(np.abs(matrix).max(axis=1), 1e-300)
        try:
            return np.asarray(np.linalg.solve(matrix / scale[:, None], column / scale))
        except np.linalg.LinAlgError:
            raise NoRegimeError("nothing determines its speed") from None

    def _conditions(self, state: State, along: _Along, change: Changes) -> tuple[Array, Array]:
        """The equations of a step: the work that closes the cycle, and the speeds asked for."""
        rows = [] if change.around is None else [change.around[:, :-1]]
        right = [] if change.around is None else [-change.around[:, -1]]
        if self.parameters or self.levelled:
            extremes = self.extremes(state, along)
            slopes, offsets = self._of_extremes(state, along, change, extremes)
            speed_rows, targets = self._speed_rows(slopes, offsets, extremes)
            rows.append(speed_rows)
            right.append(targets)
        return np.vstack(rows), np.concatenate(right)

    def sensitivity(self, state: State, change: Changes) -> Sensitivity:
        """How the flywheel sized answers to an excess of the extremes' omega², and to work left over in the cycle."""
        along = self.along(state)
        matrix, _ = self._conditions(state, along, change)
        scale = np.maximum(np.abs(matrix).max(axis=1), 1e-300)
        states, eps = state.nodes.shape[1], self.asked.irregularity or 0.0
        unit = np.zeros(matrix.shape[0])
        unit[states] = 1.0
        answer = np.abs(np.linalg.solve((matrix / scale[:, None]).T, unit)) / scale
        weights = np.ones(2) if self.balanced else np.array([2.0 + 0.5 * eps * eps])  # as in `_speed_rows`
        by_square = float(answer[-weights.size :] @ weights)
        # the slope is what is left of changes that cancel, the more so the more torques that fall with speed take back
        fading = float(np.abs(piecewise.integral(along.rate.by_speed * along.by_energy, self.mesh.half)).max())
        left = 1.0 - by_square * _BLUR * (1.0 + fading) * float(np.abs(along.s).max() / along.total.min())
        return Sensitivity(by_square / left, float(answer[0]) / left) if left > 0.0 else Sensitivity(np.inf, np.inf)

    def _of_extremes(self, state: State, along: _Along, change: Changes, extremes: Extremes) -> tuple[Array, Array]:
        """How omega/w - 1 at the fastest and slowest point changes: by the unknowns (2, unknowns), and by itself (2,)."""
        cell, t = extremes.cell, extremes.t
        weights = piecewise.basis(t, ORDER) @ piecewise.fit(np.eye(ORDER)).T
        inside = np.abs(t) < 1.0
        edge = cell + (t > 0.0)
        columns = np.concatenate((change.start, change.by, change.rest[..., None]), axis=-1)[:, 0]
        at_edge = np.concatenate((change.edge_start, change.edge_by, change.edge_rest[..., None]), axis=-1)[:, 0]
        states = state.nodes.shape[1]
        at_edge = at_edge.copy()
        at_edge[:, 0] += 1.0  # edge_start leaves out what the energy itself starts with
        energy = np.where(inside[:, None], np.einsum("kj,kjp->kp", weights, columns[cell]), at_edge[edge])
        omega = self.w * (1.0 + extremes.excess)
        slopes = energy / (extremes.total * omega * self.w)[:, None]
        if self.sized:
            slopes[:, states] += -0.5 * self.w * extremes.s / (extremes.total * omega)
        return slopes[:, :-1], slopes[:, -1]

    def _speed_rows(self, slopes: Array, offsets: Array, extremes: Extremes) -> tuple[Array, Array]:
        """The linearised conditions on the extremes of speed, for excess e: omega = w (1 + e).

        An irregularity is asked of omega², which is linear in the energy, so that one near 2 needs no more steps.
        """
        mean = (self.asked.speed or self.w) / self.w
        if not self.sized:
            found = extremes.excess + offsets
            return 0.5 * slopes.sum(axis=0)[None], np.array([mean - 1.0 - 0.5 * found.sum()])
        eps, to_square = self.asked.irregularity or 0.0, 2.0 * (1.0 + extremes.excess)
        rows, found = to_square[:, None] * slopes, extremes.s + to_square * offsets
        ends = np.array([eps, -eps]) + 0.25 * eps * eps  # z+ - 1 and z- - 1
        if self.balanced:
            return rows, (mean - 1.0) * (mean + 1.0) + mean * mean * ends - found
        slow, fast = 1.0 + ends[1], 1.0 + ends[0]
        return (slow * rows[0] - fast * rows[1])[None], np.array([2.0 * eps - slow * found[0] + fast * found[1]])

    def _taken(self, state: State, along: _Along, change: Changes, step: Array) -> tuple[State, Changes, float]:
        """The step, or as much of it as leaves the machine turning."""
        states = state.nodes.shape[1]
        start, by = step[:states], step[states:]
        nodes = change.start @ start + change.by @ by + change.rest
        edges = start + change.edge_start @ start + change.edge_by @ by + change.edge_rest
        own = dict(zip(self.parameters, by.tolist(), strict=True))
        share, swing = 1.0, float(np.ptp(along.omega))
        shift = nodes[:, 0] * along.by_energy + own.get("inertia", 0.0) * along.by_inertia
        for _ in range(_HALVINGS):
            new = State(
                state.nodes + share * nodes,
                state.edges + share * edges,
                state.inertia + share * own.get("inertia", 0.0),
                state.unknown + share * own.get("unknown", 0.0),
            )
            if self._turns(new, along):
                noise = 4 * ROUNDING * self.w
                size = float(np.abs(shift).max()) / max(swing, noise / _SETTLED)
                if self.sized:
                    size = max(size, abs(own["inertia"]) / max(abs(new.inertia), float(along.total.max())))
                return new, change, size if share == 1.0 else 1.0
            share *= 0.5
        raise NoRegimeError(_STOPS)

    def _turns(self, state: State, along: _Along) -> bool:
        """Whether the machine keeps turning, and has lost no more than three quarters of omega² anywhere."""
        total = state.inertia + self.moments.inertia
        if not total.min() > 0.0:
            return False
        s = (2 * state.nodes[:, 0] - self.w**2 * self.inertia.nodes) / (self.w**2 * total)
        return bool(np.isfinite(s).all() and ((1.0 + s) > _KEPT * (1.0 + along.s)).all())

    def centred(self, state: State) -> bool:
        """Whether the motion's mean of extremes is near the reference speed, by the measure of its swing."""
        excess = self.extremes(state, self.along(state)).excess
        return bool(abs(float(excess.sum())) <= _FAR * float(np.ptp(excess)) + ROUNDING)

    def unsure(self, state: State, change: Changes) -> float:
        """The step that rounding of the torques makes where little holds the speed, a share of the swing: `_OFF` at most."""
        if self.asked.speed is not None:
            return 0.0
        along = self.along(state)
        work = 64 * ROUNDING * float(piecewise.integral(along.rate.exchanged, self.mesh.half).sum())
        damping = max(abs(collocation.multiplier(change)[1]), 1e-300)
        level = work / (damping * self.w**2 * max(float(along.total.min()), 1e-300))
        swing = float(np.ptp(self.extremes(state, along).excess))
        return min(level / max(swing, 4 * ROUNDING / _SETTLED), _OFF)

    # -- extremes and the result ---------------------------------------------------------------------------------------

    def extremes(self, state: State, along: _Along, *, settled: bool = False) -> Extremes:
        """Fastest and slowest point: at roots of F - ½ omega² dI*/dphi, or at an end of a cell.

        The energy is the integral of F once the state has settled; before, that integral may be anything.
        """
        half_square = 0.5 * along.omega**2
        force = piecewise.fit(along.rate.moment - half_square * self.moments.slope)
        noise = 32 * ROUNDING * (along.rate.exchanged + half_square * np.abs(self.moments.slope)).max(axis=-1)
        found = piecewise.crossings(force[None], noise[None])
        cells = np.arange(force.shape[0])
        cell = np.concatenate((cells, cells, found.cell))
        t = np.concatenate((np.full(cells.size, -1.0), np.ones(cells.size), found.t))
        s, _ = self._fluctuation(state, along, cell, t, settled)
        if not s.min() > -1.0:
            raise NoRegimeError(_STOPS)
        ends = [int(s.argmax()), int(s.argmin())]
        cell, t = cell[ends], t[ends]
        if settled:
            t = self._polished(along, cell, t, s[ends])
        s, total = self._fluctuation(state, along, cell, t, settled)
        return Extremes(s / (1.0 + np.sqrt(1.0 + s)), cell, t, total, s)

    def _polished(self, along: _Along, cell: NDArray[np.intp], t: Array, s: Array) -> Array:
        """Local abscissas of extremes as roots of F - ½ omega² dI*/dphi itself, not of its interpolant; ends stay."""
        steep = 0.5 * self.w**2 * (1.0 + s)[:, None] * piecewise.fit(self.moments.slope[cell])
        rows = piecewise.fit(along.rate.moment[cell]) - steep
        ends = np.full_like(t, -1.0), np.ones_like(t)
        return np.where(np.abs(t) < 1.0, piecewise.newton(rows, t, *ends), t)

    def _fluctuation(
        self, state: State, along: _Along, cell: NDArray[np.intp], t: Array, settled: bool
    ) -> tuple[Array, Array]:
        """The excess s in omega² = w² (1 + s), and J + I*, at local abscissas of cells."""
        basis = piecewise.basis(t)
        if settled:
            rising = piecewise.antiderivative(piecewise.fit(along.rate.moment), self.mesh.half)
            energy = state.edges[cell, 0] + (rising[cell] * basis).sum(axis=-1)
        else:
            within = (piecewise.fit(state.nodes[:, 0])[cell] * basis[:, :ORDER]).sum(axis=-1)
            energy = np.where(np.abs(t) < 1.0, within, state.edges[cell + (t > 0.0), 0])
        variation = self.inertia.edges[cell] + (self.inertia.rising[cell] * basis).sum(axis=-1)
        total = state.inertia + self.inertia.start + variation
        return (2 * energy - self.w**2 * variation) / (self.w**2 * total), total

    def _rebalanced(self, state: State) -> State:
        """The state with the balance that leaves no net work: large energies hide its last digits from the iteration."""
        if not self.balanced:
            return state
        rate = self.along(state).rate
        net, slope, size = piecewise.integral(
            np.stack((rate.moment, rate.by_unknown, np.abs(rate.by_unknown))), self.mesh.half
        ).sum(-1)
        return state if abs(slope) <= _NO_EFFECT * size else state._replace(unknown=state.unknown - float(net / slope))

    def result(self, state: State, change: Changes, steps: int) -> Periodic:
        """The motion at a state that the iteration has settled on."""
        state = self._rebalanced(state)
        along = self.along(state)
        net, exchanged = piecewise.integral(np.stack((along.rate.moment, along.rate.exchanged)), self.mesh.half).sum(axis=-1)
        if not (self.levelled or abs(net) <= _OPEN * exchanged):
            raise NoRegimeError("the net work of a cycle does not come to zero")
        grown, damping = collocation.multiplier(change)
        return Periodic(
            self.moments,
            self.w,
            state,
            self.extremes(state, along, settled=True),
            along.rate,
            along.omega,
            grown,
            damping,
            steps,
            self.sensitivity(state, change) if self.sized else None,
        )


# -- own motion --------------------------------------------------------------------------------------------------------

# The steady motion of a machine whose torques depend on speed, on cells fine enough, with its error.
#
# Cells are halved until the estimates allow it, and cut where laws switch at a speed or a mesh changes the side that drives:
# the motion itself tells where that is, so that cutting and solving go in turns. Along the motion found, the moment is a
# function of angle: what is known of machines with such moments then holds.


_ROUNDS = 120
_MOST_MOVES = 8  # of the switches, before the cells are halved although they have not settled
_MOST_FAILURES = 3  # of the iteration on changed cells, before the best motion so far has to do
_SAME = 1e-12  # of the cycle: switches that move less than this stand still
_ROUGH, _MOST_ROUGH = 1e-3, 16  # error of a motion that is hardly resolved yet; rounds granted to it
_MANY = 1000  # cells from which on a rough motion is given no more rounds
_UNEVEN = 0.5  # irregularity of a motion whose speed varies as sharply as its loads, or more
_EVEN = 1e-9  # irregularity of a motion in which only rounding varies
_HARDLY = 0.1  # of J + I*: a sized flywheel in greater doubt is none
_STIFF, _UNLIKE = 3e3, 8.0  # times over that a change fades in a cycle; how far a slope may be off a difference
_HOPELESS = 0.5  # relative error past which a motion says nothing
_TINY = 1e-6  # irregularity up to which a sized motion is not solved for again
_WIDER = 1.5  # from one given flywheel to the next, to find a light and a heavy one
_MOST_TRIALS = 80
_NEAR = 0.5  # of the irregularity asked for: from here on the flywheel for it is looked for directly
_EVER_HEAVIER = (1.0, 30.0, 1e3, 3e4)  # flywheels from which lighter ones are found, where the one before fails
_COARSE = 1e-4  # error of motions that are only passed on the way
_MOST_LIGHTER = 60
_LAYER = 8.0  # exponent: how much of what a jump makes has faded in the first cell behind it
_MOST_HALVINGS = 8  # of a step to a lighter flywheel
_BOLDER = 3.0  # than the step before, on the way to a light flywheel
_STALLING, _LITTLE = 1.9, 3e-3  # irregularity from which on a step is not halved below that share of the inertia
_NEARER = 0.3  # of what an irregularity lacks of 2: from one motion to the next
_HEAVIER = 2.0  # from one flywheel to the next on the way to a light one


class LostError(NoRegimeError):
    """A motion was found whose figures rounding leaves nothing of; the message says which."""


class UntoldError(NoRegimeError):
    """A flywheel was found that rounding leaves open: its irregularity hardly depends on it."""


class OwnMotion(NamedTuple):
    """A steady motion: as solved, its moment along the cycle (`cycle`), and as a `Run` at its own mean of extremes."""

    solved: Periodic
    cycle: Cycle
    run: Run
    level_error: float  # of the speed's mean, relative
    inertia_doubt: float = 0.0  # kg m² that a sized flywheel may be off

    @property
    def speed(self) -> float:
        """Mean of the greatest and least speed (rad/s)."""
        return self.solved.speed

    @property
    def inertia(self) -> float:
        """The flywheel's, on the crank (kg m²)."""
        return self.solved.state.inertia

    @property
    def inertia_error(self) -> float:
        """Error of a sized inertia, relative to the larger of itself and its scale, the swing of work over eps w²."""
        swing = float(np.ptp(self.cycle.start[0])) / max(self.solved.irregularity * self.speed**2, 1e-300)
        return self.inertia_doubt / max(self.inertia, swing, 1e-300)


def found(machine: Machine, reference: float, asked: Asked, guess: float, unknown: float, rtol: float) -> OwnMotion:
    """The steady motion with a given flywheel, or with the one that an irregularity asks for, at an error within rtol.

    Args:
        machine: the machine.
        reference: speed (rad/s) near that of the motion; the one asked for where there is one.
        asked: what is asked of the motion.
        guess: of the flywheel's inertia, kg m² on the crank, where it is sized.
        unknown: a first guess of the scene's unknown.
        rtol: relative error allowed in the irregularity, and in the inertia where it is sized.

    Raises:
        NoRegimeError: where there is no such motion.

    """
    if asked.inertia is not None:
        return _sane(_found(machine, reference, asked, asked.inertia, unknown, rtol))
    try:
        motion = _sane(_found(machine, reference, asked, guess, unknown, rtol))
    except NoRegimeError:
        if not _switches_at_all(machine):
            raise
        return _by_search(machine, reference, asked, guess, unknown, rtol)
    _check_told(machine, reference, asked, motion, rtol)
    if motion.inertia <= 0.0 or not _switches_at_all(machine) or _confirmed(machine, reference, asked, motion, rtol):
        return motion
    return _by_search(machine, reference, asked, motion.inertia, unknown, rtol)


def _found(machine: Machine, reference: float, asked: Asked, inertia: float, unknown: float, rtol: float) -> OwnMotion:
    """The motion found directly, or where that fails, from heavier flywheels down."""
    try:
        return _Search(machine, reference, asked, rtol).from_nothing(inertia, unknown)
    except NoRegimeError:
        return _by_continuation(machine, reference, asked, inertia, unknown, rtol)


def _sane(motion: OwnMotion) -> OwnMotion:
    """The motion, unless its figures cannot be: refused then, however they came about."""
    run = motion.run
    # what may as well have an irregularity of 2 may as well stop
    possible = run.speed_min > 0.0 and run.irregularity * (1.0 + run.error) < 2.0
    if possible and _untold(motion):
        raise _open_flywheel(motion)
    if possible and not run.error <= _HOPELESS and run.irregularity > _EVEN:
        work = f"work of {motion.cycle.exchanged:.3g} J in a cycle"
        raise LostError(f"an irregularity of about {run.irregularity:.2g}, lost in the rounding of {work}")
    if not possible:
        raise NoRegimeError("rounding leaves open whether the motion stops within the cycle")
    return _rounded(motion)


def _rounded(motion: OwnMotion) -> OwnMotion:
    """The motion with what the last digits of the speed make of a stiff torque, in the cells of its extremes, in its errors.

    F is off by |dF/domega| omega u there, and the energy by the integral of that from where the cell begins.
    """
    solved, run = motion.solved, motion.run
    if not run.irregularity > 0.0:
        return motion
    stiff = piecewise.integral(np.abs(solved.rate.by_speed) * solved.omega, solved.moments.mesh.half)
    work = 4 * ROUNDING * float(stiff[solved.extremes.cell].max())
    least = float(solved.state.inertia + solved.moments.inertia.min())
    off = 4.0 * work / (solved.speed**2 * least * run.irregularity)
    slope = 0.0 if solved.sensitivity is None else solved.sensitivity.by_square
    doubt = motion.inertia_doubt + 0.5 * slope * run.irregularity * off
    return motion._replace(run=run._replace(error=run.error + off), inertia_doubt=doubt)


def _check_told(machine: Machine, reference: float, asked: Asked, motion: OwnMotion, rtol: float) -> None:
    """Refuse a flywheel under torques that fade a change of speed so fast that rounding may have made its sensitivity.

    Half as much again must change the irregularity about as that says.
    """
    solved, inertia = motion.solved, motion.inertia
    fading = solved.rate.by_speed / ((inertia + solved.moments.inertia) * solved.omega)
    stiff = float(np.abs(piecewise.integral(fading, solved.moments.mesh.half)).sum()) > _STIFF
    if not stiff or inertia <= 0.0 or solved.sensitivity is None:
        return
    given = Asked(1.5 * inertia, None, asked.speed)
    heavier = _found(machine, reference, given, given.inertia or 0.0, solved.state.unknown, rtol)
    expected = inertia / max(solved.sensitivity.by_square, 1e-300)  # 0.5 J of it, and the slope of eps is twice that of s
    if not _UNLIKE * expected > abs(heavier.run.irregularity - solved.irregularity) > expected / _UNLIKE:
        raise _open_flywheel(motion)


def _open_flywheel(motion: OwnMotion) -> UntoldError:
    """Of a flywheel that its irregularity leaves open."""
    what = f"what about {motion.inertia:.2g} kg m² on the crank change of it is lost in rounding"
    return UntoldError(f"an irregularity that hardly tells the flywheel: {what}")


def _untold(motion: OwnMotion) -> bool:
    """Whether the irregularity leaves the flywheel open that was sized for it."""
    return motion.inertia_doubt > _HARDLY * (motion.inertia + float(motion.solved.moments.inertia.max()))


def _switches_at_all(machine: Machine) -> bool:
    """Whether a law switches at a speed, or a mesh has losses, so that cells are cut by the motion itself."""
    moments = Moments(machine, piecewise.cells(machine.mesh), local=True)
    return moments.lossy or bool(moments.switches(np.full(moments.mesh.phi.shape, machine.typical_speed)))


def _confirmed(machine: Machine, reference: float, asked: Asked, motion: OwnMotion, rtol: float) -> bool:
    """Whether the motion with the flywheel that was found, solved for itself, has the irregularity asked for."""
    given = Asked(motion.inertia, None, asked.speed)
    if motion.run.irregularity <= _TINY:
        return True  # so even a motion depends on its switches no more than on rounding
    if motion.run.error > _ROUGH:
        return False
    try:
        again = _sane(_Search(machine, reference, given, rtol).from_another(motion))
    except NoRegimeError:
        return False
    off = abs(again.run.irregularity / (asked.irregularity or 1.0) - 1.0)
    return off <= 10 * (again.run.error + motion.run.error) + _SAME


def _by_search(machine: Machine, reference: float, asked: Asked, guess: float, unknown: float, rtol: float) -> OwnMotion:
    """The flywheel for an irregularity between two given ones, one too light and one too heavy, closer and closer.

    For machines whose switches keep the iteration for the flywheel itself from settling.
    """
    wanted = asked.irregularity or 0.0

    def tried(inertia: float) -> OwnMotion | None:
        try:
            return _sane(_found(machine, reference, Asked(inertia, None, asked.speed), inertia, unknown, rtol))
        except NoRegimeError:
            return None

    def excess(motion: OwnMotion | None) -> float:
        return np.inf if motion is None else motion.run.irregularity / wanted - 1.0

    if not excess(tried(0.0)) > 0.0:
        raise NoRegimeError("even without a flywheel the speed varies less than asked")
    too_light, last = excess(tried(guess)) > 0.0, guess
    for _ in range(_MOST_LIGHTER):
        before, last = last, last * _WIDER if too_light else last / _WIDER
        if (excess(tried(last)) > 0.0) != too_light:
            return _between(tried, excess, min(before, last), max(before, last), asked.speed)
    raise NoRegimeError("the search between light and heavy flywheels settles on none with that irregularity")


def _between(
    tried: Callable[[float], OwnMotion | None],
    excess: Callable[[OwnMotion | None], float],
    light: float,
    heavy: float,
    speed: float | None,
) -> OwnMotion:
    """The motion with the flywheel between a light and a heavy one at which nothing is in excess, by false position."""
    best, side = tried(heavy), 0
    at_low, at_high = excess(tried(light)), excess(best)
    for _ in range(_MOST_TRIALS):
        share = at_low / (at_low - at_high) if np.isfinite(at_low) and at_low > at_high else 0.5
        inertia = light + (heavy - light) * min(max(share, 0.01), 0.99)
        best = tried(inertia)
        value = excess(best)
        if abs(value) <= _SAME or heavy - light <= 1e-15 * heavy:
            break
        if value > 0.0:
            light, at_low, at_high = inertia, value, at_high * (0.5 if side > 0 else 1.0)
            side = 1
        else:
            heavy, at_high, at_low = inertia, value, at_low * (0.5 if side < 0 else 1.0)
            side = -1
    if best is None or not abs(excess(best)) <= _ROUGH:
        raise NoRegimeError("the search between light and heavy flywheels settles on none with that irregularity")
    answer, off = sensitivity(best.solved, speed), best.run.error + abs(excess(best))
    return best._replace(
        run=best.run._replace(error=off), inertia_doubt=answer.by_square * 0.5 * best.run.irregularity * off
    )


class _Search:
    """Cells and switches that change in turns with the motion that is found on them."""

    def __init__(self, machine: Machine, reference: float, asked: Asked, rtol: float) -> None:
        self.machine, self.reference, self.asked, self.rtol = machine, reference, asked, rtol
        self._begin()

    def _begin(self) -> None:
        """Nothing cut, nothing found yet."""
        self.base, self.cuts = self.machine.mesh, np.zeros(0)
        self.best: tuple[float, OwnMotion] | None = None
        self.stalls = self.moves = self.failures = self.rough = 0

    def from_nothing(self, inertia: float, unknown: float) -> OwnMotion:
        """The motion found from what torques at a constant speed would give."""
        moments = self._layered(self.reference, inertia, unknown)
        current = 0.0 if moments.circuit is None else float(moments.steady_current(np.array(self.reference)))
        start = first_guess(moments, self.reference, inertia, unknown, current)
        try:
            return self._refined(periodic(moments, self.reference, self.asked, start))
        except NoRegimeError:
            if not moments.switches(np.full(moments.mesh.phi.shape, self.reference)) and not moments.lossy:
                raise
        self._begin()
        moments = self._moments(local=True)
        start = first_guess(moments, self.reference, inertia, unknown, current)
        rough = periodic(moments, self.reference, self.asked, start)
        self.cuts = _switching(rough)
        moments = self._moments()
        return self._refined(periodic(moments, self.reference, self.asked, carried(rough, moments)))

    def from_another(self, other: OwnMotion) -> OwnMotion:
        """The motion found from that with another flywheel."""
        self.cuts = _switching(other.solved)
        if other.run.irregularity > _UNEVEN:  # what resolved it is needed again; else its switches have moved on
            self.base = other.solved.moments.mesh.edges
        moments = self._layered(other.speed, other.inertia, other.solved.state.unknown)
        start = carried(other.solved, moments)
        if self.asked.inertia is not None:
            start = with_inertia(start, moments, other.solved.reference, self.asked.inertia)
        return self._refined(periodic(moments, self.reference, self.asked, start))

    def _refined(self, solved: Periodic) -> OwnMotion:
        """The motion at an error within rtol, or the best that can be had."""
        for _ in range(_ROUNDS):
            if self._settled(solved) and self._enough(self._described(solved)):
                break
            if self.moves == 0 and not self._split(self._described(solved)):
                break
            if self.moves == _MOST_MOVES:
                self._split(self._described(solved))
            before, solved = solved, self._again(solved)
            if self.failures > _MOST_FAILURES:
                break
        else:
            self._enough(_doubtful(self._described(solved), before))
        if self.failures and (self.best is None or self.best[0] > _ROUGH):
            raise NoRegimeError("on finer cells the iteration settles on no motion")
        if self.best is None:
            self._enough(self._described(solved))
        assert self.best is not None
        return self.best[1]

    def _described(self, solved: Periodic) -> OwnMotion:
        return _described(solved, self.asked)

    def _moments(self, *, local: bool = False) -> Moments:
        edges = merged([*self.base.tolist(), *self.cuts.tolist()], float(self.base[-1]))
        return Moments(self.machine, piecewise.cells(edges), local=local)

    def _layered(self, speed: float, inertia: float, unknown: float) -> Moments:
        """The machine on cells that are narrow where a motion at about that speed settles steeply."""
        moments = self._moments()
        finer = layered(moments, speed, inertia, unknown)
        if finer.size == moments.mesh.edges.size:
            return moments
        self.base = finer[~np.isin(finer, moments.mesh.edges) | np.isin(finer, self.base)]
        return self._moments()

    def _settled(self, solved: Periodic) -> bool:
        """Whether the motion switches where the cells are cut; they are cut anew where it does."""
        moved, cuts = _switching(solved), self.cuts
        settled = moved.size == cuts.size and bool((np.abs(moved - cuts) <= _SAME * self.base[-1]).all())
        self.cuts, self.moves = moved, 0 if settled else self.moves % _MOST_MOVES + 1
        return settled

    def _enough(self, motion: OwnMotion) -> bool:
        """Whether a motion is as good as asked, or no better than before; the best one is kept."""
        doubt = _doubt(motion, self.asked)
        gained = self.best is None or doubt <= 0.9 * self.best[0]
        self.rough += doubt > _ROUGH
        few = motion.cycle.mesh.edges.size < _MANY
        # cells may first have to become as narrow as what they follow
        patient = doubt > _ROUGH and self.rough < _MOST_ROUGH and few
        self.stalls = 0 if gained or patient else self.stalls + 1
        if self.best is None or doubt < self.best[0]:
            self.best = doubt, motion
        rounding = _untold(motion) and motion.run.error <= 0.5 * self.rtol  # which finer cells do not mend
        return doubt <= 0.5 * self.rtol or self.stalls > 1 or rounding

    def _split(self, motion: OwnMotion) -> bool:
        """Halve the cells that need it; False where that cannot help.

        What does not settle may be no more than what the cells leave open, so that they are halved then too.
        """
        doubt, finer = _doubt(motion, self.asked), None
        if doubt > 0.5 * self.rtol:
            coarse = turning_moment.coarse(motion.cycle, motion.run.speed_max)(0.5 * self.rtol / doubt)
            finer = piecewise.halved(motion.cycle.mesh.edges, coarse)
        if finer is None:
            return False
        self.base = finer[~np.isin(finer, motion.cycle.mesh.edges) | np.isin(finer, self.base)]
        return True

    def _again(self, solved: Periodic) -> Periodic:
        """The motion on the cells as they are now, from the one before; on halved ones where the iteration fails."""
        try:
            moments = self._moments()
            return periodic(moments, self.reference, self.asked, carried(solved, moments))
        except NoRegimeError:
            self.failures += 1
            self.base, self.cuts = piecewise.bisected(self.base, np.ones(self.base.size - 1, dtype=bool)), np.zeros(0)
            return solved


def _by_continuation(
    machine: Machine, reference: float, asked: Asked, inertia: float, unknown: float, rtol: float
) -> OwnMotion:
    """Given flywheels from one heavy enough to hold the speed nearly constant down to the one wanted.

    A sized flywheel lies on the way: it is looked for from motions that vary half as much as asked and more.
    """
    moments = Moments(machine, piecewise.cells(machine.mesh))
    work = piecewise.antiderivative(piecewise.fit(moments.constant(reference, unknown).moment), moments.mesh.half)
    swing = float(np.ptp(piecewise.accumulated(work)))
    own = float(np.abs(moments.inertia).max())
    heavy = max(20.0 * max(swing / reference**2, own, 1e-300), 4.0 * inertia)
    last = _heavy(machine, reference, asked.speed, heavy, unknown)
    step = last.inertia
    for _ in range(_MOST_LIGHTER):
        there = _there(machine, reference, asked, last, rtol)
        if there is not None:
            return there
        before, last = last, _lighter(machine, reference, asked.speed, last, asked.inertia or 0.0, _BOLDER * step)
        step = before.inertia - last.inertia
    raise NoRegimeError("the motions tried with lighter and lighter flywheels stop within the cycle")


def _heavy(machine: Machine, reference: float, speed: float | None, inertia: float, unknown: float) -> OwnMotion:
    """The motion with a flywheel heavy enough to keep the speed where a steep torque neither ends nor saturates."""
    for heavier in _EVER_HEAVIER:
        try:
            asked = Asked(heavier * inertia, None, speed)
            return _Search(machine, reference, asked, _COARSE).from_nothing(heavier * inertia, unknown)
        except NoRegimeError:
            if heavier == _EVER_HEAVIER[-1] or not _switches_at_all(machine):
                raise
    raise AssertionError


def _there(machine: Machine, reference: float, asked: Asked, last: OwnMotion, rtol: float) -> OwnMotion | None:
    """The motion asked for, once that with a heavier flywheel is near enough to find it from; None while it is not."""
    search = _Search(machine, reference, asked, rtol)
    if asked.irregularity is None:
        return search.from_another(last) if last.inertia <= (asked.inertia or 0.0) else None
    if last.run.irregularity >= _NEAR * asked.irregularity:
        try:
            return search.from_another(_slower(machine, reference, asked, last))
        except NoRegimeError:
            if last.run.irregularity >= asked.irregularity:
                raise
    elif last.inertia <= 0.0:
        raise NoRegimeError("even without a flywheel the speed varies less than asked")
    return None


def _slower(machine: Machine, reference: float, asked: Asked, last: OwnMotion) -> OwnMotion:
    """The motion that is nearer to standing still somewhere, by steps each on the cells of the one before."""
    left = 2.0 - (asked.irregularity or 0.0)
    while left < _NEARER * (2.0 - last.run.irregularity):
        wanted = Asked(None, 2.0 - _NEARER * (2.0 - last.run.irregularity), asked.speed)
        last = _Search(machine, reference, wanted, _COARSE).from_another(last)
    return last


def _lighter(
    machine: Machine, reference: float, speed: float | None, last: OwnMotion, target: float, most: float
) -> OwnMotion:
    """The motion with a lighter flywheel, by as large a step towards the target as can be taken, at most `most`."""
    weight = last.inertia - target
    scale = last.inertia + float(last.solved.moments.inertia.max())
    step = min(weight / _HEAVIER if weight > 0.1 * scale else weight, most)
    for _ in range(_MOST_HALVINGS):
        try:
            return _Search(machine, reference, Asked(last.inertia - step, None, speed), _COARSE).from_another(last)
        except NoRegimeError:
            step *= 0.5
        if last.run.irregularity > _STALLING and step < _LITTLE * scale:
            break
    raise NoRegimeError("the motions tried with lighter and lighter flywheels stop within the cycle")


def layered(moments: Moments, speed: float, inertia: float, unknown: float) -> Array:
    """Edges of cells, and cuts, ever closer, towards that end of each at which the speed settles steeply.

    What a jump of torque does to a strongly damped machine is over within 1/|dF/dE| rad after it; where changes grow with
    phi, before it.
    """
    edges = moments.mesh.edges
    if moments.circuit is not None:
        return edges
    rate = moments.rate(np.full(moments.mesh.phi.shape, speed), unknown, inertia)
    pull = rate.by_speed / ((inertia + moments.inertia) * speed)
    cuts = edges.tolist()
    for k, row in enumerate(pull):
        low, high = moments.mesh.edges[k : k + 2].tolist()
        steepest = float(row[np.abs(row).argmax()])
        width = _LAYER / max(abs(steepest), 1e-300)
        while width < 0.5 * (high - low) and np.isfinite(steepest):
            cuts.append(low + width if steepest < 0.0 else high - width)
            width *= 2.0
    return merged(cuts, float(edges[-1])) if len(cuts) > edges.size else edges


def carried(solved: Periodic, moments: Moments) -> State:
    """The states of a motion on another mesh."""
    old, new = solved.moments.mesh, moments.mesh
    series = piecewise.fit(solved.state.nodes)

    def at(phi: Array) -> Array:
        cell, t = piecewise.located(old, phi)
        return np.asarray((series[cell] * piecewise.basis(t, ORDER)[:, None, :]).sum(axis=-1))

    nodes = at(new.phi.ravel()).reshape(*new.phi.shape, -1)
    return solved.state._replace(nodes=np.moveaxis(nodes, -1, 1), edges=at(new.edges))


def _switching(solved: Periodic) -> Array:
    """Angles where the motion makes a law switch, or a mesh change the side that drives, from the mesh's cells."""
    return np.array(sorted(_switches(solved)))


def _switches(solved: Periodic) -> Iterator[float]:
    moments, state = solved.moments, solved.state
    mesh, current = moments.mesh, (state.nodes[:, 1] if moments.circuit is not None else None)
    watched = moments.switches(solved.omega)
    if moments.lossy:
        watched += moments.transmitted(solved.omega, state.unknown, state.inertia, current)
    known = moments.machine.mesh
    for values in watched:
        series = piecewise.fit(values)[None]
        noise = np.full(series.shape[:2], 1e-13 * float(np.abs(values).max(initial=0.0)))
        crossing = piecewise.crossings(series, noise)
        for angle in crossing.angles(mesh).tolist():
            if np.abs(known - angle).min() > 1e-9 * mesh.edges[-1]:
                yield angle


def _described(solved: Periodic, asked: Asked) -> OwnMotion:
    """A solved motion as a cycle with its moment along it, and as a run with its error.

    With a given flywheel what the level is off weighs on the irregularity, the more the nearer the machine comes to a stop;
    a flywheel sought has the irregularity asked for, and hardly changes with the level there.
    """
    moments, state = solved.moments, solved.state
    unknown = state.unknown if moments.machine.scene.unknown is not None else None
    cycle = cycle_of(moments, solved.rate, unknown)
    start = state.inertia + cycle.inertia_at_start
    offset = float(state.edges[0, 0]) + 0.5 * start * (solved.reference**2 - solved.speed**2)
    kept = _kept_work(solved, cycle)
    # energies are closed round the cycle, to their digits
    closing = kept + 2 * ROUNDING * float(np.abs(state.edges[:, 0]).max())
    level = closing / (max(abs(solved.damping), 1e-300) * solved.speed**2 * max(start, 1e-300))
    free = unknown is None and moments.machine.sets_its_speed
    run = _run(solved, cycle, offset, kept)
    varying = 0.5 * run.irregularity * run.error  # what speeds may be off the level
    if free:
        run = run._replace(level=level)
        run = run._replace(error=run.error + 4.0 * (level if asked.inertia is None else run.level_error))
    if unknown is not None and cycle.balance_error:
        pulled = piecewise.integral(np.abs(solved.rate.by_speed) * solved.omega, moments.mesh.half).sum()
        of_speeds = 1.0 + varying * float(pulled) / cycle.errors.work
        run = run._replace(cycle=cycle._replace(balance_error=cycle.balance_error * of_speeds))
    answer = solved.sensitivity
    missed = abs(run.irregularity - (asked.irregularity or run.irregularity))
    doubt = 0.0 if answer is None else answer.by_square * (varying + missed) + answer.by_work * closing
    return OwnMotion(solved, run.cycle or cycle, run, run.level_error + varying if free else 0.0, doubt)


def _kept_work(solved: Periodic, cycle: Cycle) -> float:
    """What the energy keeps (J) of the errors of the cycle's work: where torques fall with the speed, they fade on the way.

    dE' = (dF/dE) dE + r is one-signed, so that errors r of one sign in all cells are the worst that can be.
    """
    moments, errors = solved.moments, cycle.errors
    held = moments.machine.scene.unknown is not None  # then the balance's own error does not fade
    if held or moments.circuit is not None or not errors.work > 0.0:
        return errors.work
    half = moments.mesh.half
    growth = piecewise.integral(solved.rate.by_speed / ((solved.state.inertia + moments.inertia) * solved.omega), half)
    rounding = errors.work - float(errors.by_cell[0].sum())
    made = errors.by_cell[0] + rounding * piecewise.integral(solved.rate.exchanged, half) / max(cycle.exchanged, 1e-300)
    fades = np.minimum(growth, -1e-9)
    made = made * np.where(growth > fades, 1.0, np.expm1(fades) / fades)  # spread evenly over its cell
    kept = most = 0.0
    for left, added in [*zip(np.exp(np.minimum(growth, 1.0)).tolist(), made.tolist(), strict=True)] * 2:
        kept = min(kept * left + added, errors.work)
        most = max(most, kept)
    return most


def _run(solved: Periodic, cycle: Cycle, offset: float, kept: float) -> Run:
    """The same figures as for moments that depend on angle alone; `kept` is the error of the energy (J)."""
    mesh, extremes = solved.moments.mesh, solved.extremes
    inside = mesh.middle[extremes.cell, 0] + mesh.half[extremes.cell, 0] * extremes.t
    edge = mesh.edges[extremes.cell + (extremes.t > 0.0)]
    angles = np.where(np.abs(extremes.t) < 1.0, inside, edge)
    speed, eps = solved.speed, solved.irregularity
    currents = solved.state.nodes[:, 1] if solved.moments.circuit is not None else None
    least = float(solved.state.inertia + solved.moments.inertia.min())
    swing = 2 * (2 * kept + speed**2 * cycle.errors.variation) / speed**2 / least
    swing += 2 * eps * (cycle.errors.inertia / least + 4 * ROUNDING)
    return Run(
        inertia=solved.state.inertia,
        irregularity=eps,
        speed_max=solved.reference * (1.0 + float(extremes.excess[0])),
        speed_min=solved.reference * (1.0 + float(extremes.excess[1])),
        angle_speed_max=float(angles[0]),
        angle_speed_min=float(angles[1]),
        offset=offset,
        error=swing / eps if eps > 0.0 else 0.0,
        cycle=cycle,
        speed=speed,
        drive=solved.moments.drive(solved.omega, solved.state.unknown, currents),
        current=None if currents is None else float(solved.state.edges[0, 1]),
    )


def doubt_of_cuts(motion: OwnMotion) -> float:
    """Error (rad) of the angles of extreme speed that stand where cells are cut by the motion itself."""
    moments, run = motion.solved.moments, motion.run
    found, known = np.array([run.angle_speed_max, run.angle_speed_min]), moments.machine.mesh
    cut = np.isin(found, moments.mesh.edges) & (np.abs(found[:, None] - known).min(axis=1) > 1e-9 * known[-1])
    return _SAME * float(known[-1]) if cut.any() else 0.0


def _doubtful(motion: OwnMotion, before: Periodic) -> OwnMotion:
    """A motion whose switches have not come to rest, with ten times what their last move changed added to its error."""
    solved = motion.solved
    moved = abs(solved.irregularity - before.irregularity) / max(solved.irregularity, 1e-300)
    moved += abs(solved.speed - before.speed) / solved.speed
    total = solved.state.inertia + float(solved.moments.inertia.max())
    heavier = abs(solved.state.inertia - before.state.inertia)
    moved += heavier / max(total, 1e-300)
    return motion._replace(
        run=motion.run._replace(error=motion.run.error + 10 * moved), inertia_doubt=motion.inertia_doubt + 10 * heavier
    )


def _doubt(motion: OwnMotion, asked: Asked) -> float:
    """The largest relative error among the figures asked for."""
    sized = motion.inertia_error if asked.inertia is None else 0.0
    return max(motion.run.error, sized, motion.cycle.errors.work / max(motion.cycle.exchanged, 1e-300))


def along(motion: OwnMotion, edges: Array) -> Cycle:
    """The cycle of a motion on other cells, between which its own edges must be."""
    solved = motion.solved
    moments = Moments(solved.moments.machine, piecewise.cells(edges))
    state = carried(solved, moments)
    speed = steady_motion.speed_over_cycle(motion.cycle, motion.speed, motion.run, moments.mesh.phi.ravel()).reshape(
        moments.mesh.phi.shape
    )
    current = state.nodes[:, 1] if moments.circuit is not None else None
    rate = moments.rate(speed, state.unknown, state.inertia, current)
    return cycle_of(moments, rate, motion.cycle.balance)
