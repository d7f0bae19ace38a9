"""Steady periodic motion of a machine whose torques depend on speed, by collocation with Newton's method on its energy.

The unknown is the kinetic energy over the cycle, E'(phi) = F(phi, omega(E)), E = ½ (J + I*) omega², closed on itself. Where
more is unknown (the flywheel for an irregularity, the balance for a mean speed) it is solved for in the same iteration.
The cycle's multiplier, exp(integral of dF/dE), comes with it: what a cycle leaves of a small change.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel import collocation, piecewise, regime
from flywheel.collocation import Changes
from flywheel.faults import Fault
from flywheel.moments import Moments, Rate
from flywheel.patience import spend
from flywheel.piecewise import NODES, ORDER, ROUNDING, Cells
from flywheel.steady import NoMotionError

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
            raise UndefinedError(regime.undefined(self.moments.machine, self.mesh, rate.moment, omega))
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
