"""Steady periodic motion of a machine whose torques depend on speed: by Newton's method on its energy, on cells fine enough.

The unknown is the kinetic energy over the cycle, E'(phi) = F(phi, omega(E)), E = ½ (J + I*) omega², closed on itself. Where
more is unknown (the flywheel for an irregularity, the balance for a mean speed) it is solved for in the same iteration
(`periodic`). The cycle's multiplier, exp(integral of dF/dE), comes with it: what a cycle leaves of a small change.

Cells are halved until the estimates allow it, and cut where laws switch at a speed or a mesh changes the side that drives:
the motion itself tells where that is, so that cutting and solving go in turns (`_Search.refinement`). Along the
motion found, the moment is a function of angle: what is known of machines with such moments then holds.

Source: U. M. Ascher, R. M. M. Mattheij, R. D. Russell, Numerical Solution of Boundary Value Problems, SIAM 1995.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bondgraph.records import NamedTuple
from flywheel.machine.dynamics import Moments, Rate, moments_on
from flywheel.machine.machine import Machine, merged
from flywheel.numerics import cells, collocation
from flywheel.numerics.budget import spend
from flywheel.numerics.cells import NODES, ORDER, ROUNDING, Array, Cells, Index
from flywheel.numerics.collocation import Changes
from flywheel.numerics.faults import Fault
from flywheel.regime import turning_moment
from flywheel.regime.constant_speed import cycle_of
from flywheel.regime.turning_moment import Cycle, NoMotionError, Run

_MOST_STEPS = 40
_PER_SEARCH = 1000  # nodes that would take as long as to reduce the machine on its cells
_PER_STEP = 50  # nodes that would take as long as what a Newton step takes whatever their number
_HALVINGS = 30  # of a Newton step
_SETTLED = 1e-13  # of the fluctuation of speed: a step smaller than this is the last
_LOST = 1e-9  # of the fluctuation: steps that stay above it have not converged
_OFF = 1e-3  # of the fluctuation: steps that stay below it lack digits, not direction
_OPEN = 1e-6  # of the work exchanged: net work of a cycle that does not close
_LEAST_GUESS = 1.0  # of omega²: as much as a first guess varies at most
_FAR = 20.0  # fluctuations: a reference speed that is twice as far off costs a digit
_KEPT = 0.25  # of omega²: a step takes no more than the rest
_NO_EFFECT = 1e-9  # net work of a balance that does none, as a share of all that it does
_BLUR = 64 * ROUNDING  # of the terms that a slope is summed from
_STOPS = "the motions tried stop within the cycle"


class Demand(NamedTuple):
    """What is asked of a regime, at the crank: one of a flywheel's `inertia` and an `irregularity` to size it for.

    With a balance also the mean of extremes `speed` (rad/s). Moments that depend on position alone, and have no balance,
    leave the level of the motion open: a speed then sets it, and what work they leave over in the cycle stays.
    """

    inertia: float | None
    irregularity: float | None
    speed: float | None


class State(NamedTuple):
    """The states over the cycle: at the nodes (cells, states, nodes), at the edges (cells + 1, states); J and the balance.

    The first state is the kinetic energy less ½ (J + I*(0)) w² (J), w being the reference speed; the others are a motor's
    own, such as its current (A).
    """

    nodes: Array
    edges: Array
    inertia: float
    unknown: float

    @property
    def of_circuit(self) -> Array:
        """A motor's own states at the nodes: (states, cells, nodes)."""
        return np.asarray(self.nodes[:, 1:].swapaxes(0, 1))


class Extremes(NamedTuple):
    """Fastest and slowest point of a motion: omega/w - 1, cell, local abscissa, J + I*, omega² = w² (1 + s)."""

    excess: Array
    cell: Index
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
    closing: Array | None = None  # what each of several states may miss of its closing
    reach: Array | None = None  # how far that carries, (states, states)

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


class LostError(NoRegimeError):
    """A motion was found whose figures rounding leaves nothing of; the message says which."""


class UntoldError(NoRegimeError):
    """A flywheel was found that rounding leaves open: its irregularity hardly depends on it."""


# -- Newton's method on given cells --------------------------------------------------------------------------------------


def periodic(moments: Moments, reference: float, demand: Demand, start: State) -> Periodic:
    """The periodic motion nearest to a start, and with it what is unknown, by Newton's method.

    Args:
        moments: the machine on its mesh.
        reference: speed (rad/s) that the energies are taken relative to: the one asked for, or near the one expected.
        demand: the inertia, or the irregularity; with a balance the mean of extremes.
        start: a first guess.

    Raises:
        NoRegimeError: where the iteration finds none: the machine would stop within the cycle, or nothing closes.

    """
    spend(_PER_SEARCH)
    equations = _Equations(moments, reference, demand)
    state, last, final = start, np.inf, demand.speed is not None
    for step in range(1, _MOST_STEPS + 1):
        here = equations.speeds(state)
        change = equations.linearisation(state, here)
        state, size = equations.newton_step(state, here, change)
        stays = size <= _OFF and size >= 0.3 * last
        settled = size <= _SETTLED or (stays and final and size <= max(_LOST, equations.rounding_step(state, change)))
        if settled and not final:  # near the reference speed, by the measure of the fluctuation?
            high, low = (s / (1.0 + np.sqrt(1.0 + s)) for s in (here.s.max(), here.s.min()))
            final = bool(abs(high + low) <= _FAR * (high - low) + ROUNDING)
        if settled and final:
            return equations.result(state, change, step)
        if settled or (
            stays and not final
        ):  # energies relative to a speed far from the motion's own have no digits to spare
            equations, state = equations.about_own_mean(state)
            final = True
        last = size
    raise NoRegimeError(f"Newton's method has not settled in {_MOST_STEPS} steps")


def first_guess(moments: Moments, reference: float, inertia: float, unknown: float, own: Sequence[float] = ()) -> State:
    """The motion that torques taken at a constant speed would give, with that speed at phi = 0.

    The work that they leave over in the cycle is spread evenly; a motor's own states are those given.
    """
    mesh = moments.mesh
    omega = np.full(mesh.phi.shape, reference)
    steady = [np.full(mesh.phi.shape, value) for value in own]
    force = moments.rate(omega, unknown, inertia, steady).moment
    rising = cells.antiderivative(cells.fit(force), mesh.half)
    edges = cells.accumulated(rising)
    nodes = edges[:-1, None] + rising @ cells.basis(NODES).T
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
    at_nodes = np.stack((nodes, *steady), axis=1)
    at_edges = np.stack((edges, *(np.full_like(edges, value) for value in own)), axis=1)
    return State(at_nodes, at_edges, inertia, unknown)


def with_inertia(state: State, moments: Moments, reference: float, inertia: float) -> State:
    """A state with another flywheel (kg m² on the crank) at the same energies, or at the same speeds if those would stop it.

    The first is right for loads that know no speed, the second for those that know little else.
    """
    variation, square = _Inertia(moments), reference**2

    def excess(energy: Array, varies: Array, own: float) -> Array:
        return np.asarray((2 * energy - square * varies) / (square * (own + variation.start + varies)))

    now, then = (1.0 + excess(state.nodes[:, 0], variation.nodes, own) for own in (state.inertia, inertia))
    if (then > _KEPT * now).all():
        return state._replace(inertia=inertia)
    nodes, edges = state.nodes.copy(), state.edges.copy()
    for values, varies in ((nodes, variation.nodes), (edges, variation.edges)):
        s = excess(values[:, 0], varies, state.inertia)
        values[:, 0] = 0.5 * square * (varies + s * (inertia + variation.start + varies))
    return State(nodes, edges, inertia, state.unknown)


def carried(solved: Periodic, moments: Moments) -> State:
    """The states of a motion on another mesh."""
    old, new = solved.moments.mesh, moments.mesh
    series = cells.fit(solved.state.nodes)

    def at(phi: Array) -> Array:
        cell, t = cells.located(old, phi)
        return np.asarray((series[cell] * cells.basis(t, ORDER)[:, None, :]).sum(axis=-1))

    nodes = at(new.phi.ravel()).reshape(*new.phi.shape, -1)
    return solved.state._replace(nodes=np.moveaxis(nodes, -1, 1), edges=at(new.edges))


class _Inertia:
    """I* over the cycle as its value at phi = 0 and what it differs from that, at nodes and edges."""

    def __init__(self, moments: Moments) -> None:
        mesh = moments.mesh
        self.rising = cells.antiderivative(cells.fit(moments.slope), mesh.half)
        self.edges = cells.accumulated(self.rising)
        self.nodes = self.edges[:-1, None] + self.rising @ cells.basis(NODES).T
        self.start = float(cells.value(cells.fit(moments.inertia[:1]), np.array([-1.0]))[0])


class _Speeds(NamedTuple):
    """A state's speeds and the rates of its states at the nodes, with the speed's slopes by energy and inertia."""

    omega: Array
    rate: Rate
    total: Array
    s: Array
    by_energy: Array
    by_inertia: Array
    rates: Array  # (cells, states, nodes)


class _Equations:
    """One regime's equations: rates, their linearisation, and the conditions on closing and on the extremes of speed."""

    def __init__(self, moments: Moments, reference: float, demand: Demand) -> None:
        self.moments, self.w, self.demand = moments, reference, demand
        self.mesh: Cells = moments.mesh
        self.inertia = _Inertia(moments)
        self.sized = demand.inertia is None
        self.balanced = moments.machine.scene.unknown is not None
        self.parameters = ("inertia",) * self.sized + ("unknown",) * self.balanced
        self.levelled = not (self.sized or self.balanced or demand.speed is None)

    def about_own_mean(self, state: State) -> tuple[_Equations, State]:
        """The same motion with its energies relative to its own mean of extremes."""
        speed = self.w * (1.0 + 0.5 * float(self.extremes(state, self.speeds(state)).excess.sum()))
        shift = 0.5 * (state.inertia + self.inertia.start) * (self.w - speed) * (self.w + speed)
        nodes, edges = state.nodes.copy(), state.edges.copy()
        nodes[:, 0], edges[:, 0] = nodes[:, 0] + shift, edges[:, 0] + shift
        return _Equations(self.moments, speed, self.demand), state._replace(nodes=nodes, edges=edges)

    def speeds(self, state: State) -> _Speeds:
        """Speeds and rates at the nodes."""
        total = state.inertia + self.moments.inertia
        s = (2 * state.nodes[:, 0] - self.w**2 * self.inertia.nodes) / (self.w**2 * total)
        if not (s.min() > -1.0 and total.min() > 0.0):
            raise NoRegimeError(_STOPS)
        omega = self.w * np.sqrt(1.0 + s)
        circuit, ratio = self.moments.circuit, self.moments.drive_ratio
        rate = self.moments.rate(omega, state.unknown, state.inertia, state.of_circuit)
        if not np.isfinite(rate.moment).all():
            raise UndefinedError(turning_moment.undefined(self.moments.machine, self.mesh, rate.moment, omega))
        rates = [rate.moment]
        if circuit is not None:
            rates += [of_time / omega for of_time in circuit.rates(ratio * omega, state.of_circuit)]
        by_energy = 1.0 / (total * omega)
        return _Speeds(omega, rate, total, s, by_energy, -0.5 * self.w**2 * s / (total * omega), np.stack(rates, axis=1))

    def linearisation(self, state: State, here: _Speeds) -> Changes:
        """How small changes run through the cycle, by dF/dz (cells, states, states, nodes) and dF/dp."""
        spend(_PER_STEP + self.mesh.phi.size)
        rate, states, (count, nodes) = here.rate, state.nodes.shape[1], here.omega.shape
        by_state = np.zeros((count, states, states, nodes))
        by_parameter = np.zeros((count, states, len(self.parameters), nodes))
        by_speed = [rate.by_speed]
        by_state[:, 0, 0] = rate.by_speed * here.by_energy
        if self.moments.circuit is not None:  # dx/dphi = (dx/dt)/omega
            ratio = self.moments.drive_ratio
            slopes = self.moments.circuit.slopes(ratio * here.omega, state.of_circuit)
            by_state[:, 0, 1:] = rate.by_states.swapaxes(0, 1)
            for j, (by_omega, row) in enumerate(zip(slopes.rates_by_speed, slopes.rates_by_states, strict=True), 1):
                by_speed.append(ratio * by_omega / here.omega - here.rates[:, j] / here.omega)
                by_state[:, j, 0] = by_speed[j] * here.by_energy
                for k, of_time in enumerate(row, 1):
                    by_state[:, j, k] = of_time / here.omega
        for k, name in enumerate(self.parameters):
            if name == "unknown":
                by_parameter[:, 0, k] = rate.by_unknown
                continue
            for j, slope in enumerate(by_speed):
                by_parameter[:, j, k] = slope * here.by_inertia
            by_parameter[:, 0, k] += rate.by_inertia
        rising = cells.antiderivative(cells.fit(here.rates), self.mesh.half[:, None])
        at_nodes = state.edges[:-1, :, None] + rising @ cells.basis(NODES).T - state.nodes
        at_edges = state.edges[:-1] + rising.sum(axis=-1) - state.edges[1:]
        through = self.mesh.half[:, 0], by_state, by_parameter, at_nodes, at_edges
        return (
            collocation.changes(*through)
            if self.levelled
            else collocation.round_cycle(*through, state.edges[-1] - state.edges[0])
        )

    def conditions(self, state: State, here: _Speeds, change: Changes) -> tuple[Array, Array]:
        """The equations of a step: the work that closes the cycle, and the speeds asked for.

        How the excess e of the extremes, omega = w (1 + e), changes: by the unknowns (2, unknowns), and by itself (2,).
        An irregularity is asked of omega², which is linear in the energy, so that one near 2 needs no more steps.
        """
        rows = [] if change.around is None else [change.around[:, :-1]]
        right = [] if change.around is None else [-change.around[:, -1]]
        if not (self.parameters or self.levelled):
            return np.vstack(rows), np.concatenate(right)
        at, states = self.extremes(state, here), state.nodes.shape[1]
        weights = cells.basis(at.t, ORDER) @ cells.fit(np.eye(ORDER)).T
        columns = np.concatenate((change.start, change.by, change.rest[..., None]), axis=-1)[:, 0]
        at_edge = np.concatenate((change.edge_start, change.edge_by, change.edge_rest[..., None]), axis=-1)[:, 0].copy()
        at_edge[:, 0] += 1.0  # edge_start leaves out what the energy itself starts with
        inside, edge = np.abs(at.t) < 1.0, at.cell + (at.t > 0.0)
        energy = np.where(inside[:, None], np.einsum("kj,kjp->kp", weights, columns[at.cell]), at_edge[edge])
        scale = at.total * self.w * (1.0 + at.excess)
        slopes = energy / (scale * self.w)[:, None]
        if self.sized:
            slopes[:, states] += -0.5 * self.w * at.s / scale
        slopes, offsets = slopes[:, :-1], slopes[:, -1]
        mean = (self.demand.speed or self.w) / self.w
        if not self.sized:
            rows.append(0.5 * slopes.sum(axis=0)[None])
            right.append(np.array([mean - 1.0 - 0.5 * (at.excess + offsets).sum()]))
            return np.vstack(rows), np.concatenate(right)
        eps, to_square = self.demand.irregularity or 0.0, 2.0 * (1.0 + at.excess)
        of_square, found = to_square[:, None] * slopes, at.s + to_square * offsets
        ends = np.array([eps, -eps]) + 0.25 * eps * eps  # z+ - 1 and z- - 1
        if self.balanced:
            rows.append(of_square)
            right.append((mean - 1.0) * (mean + 1.0) + mean * mean * ends - found)
        else:
            slow, fast = 1.0 + ends[1], 1.0 + ends[0]
            rows.append((slow * of_square[0] - fast * of_square[1])[None])
            right.append(np.array([2.0 * eps - slow * found[0] + fast * found[1]]))
        return np.vstack(rows), np.concatenate(right)

    def newton_step(self, state: State, here: _Speeds, change: Changes) -> tuple[State, float]:
        """The state a Newton step on, or as much of it as leaves the machine turning; its size by the fluctuation of speed.

        A step leaves a quarter of omega² everywhere, and is halved until it does.
        """
        matrix, column = self.conditions(state, here, change)
        scale = np.maximum(np.abs(matrix).max(axis=1), 1e-300)
        try:
            step = np.asarray(np.linalg.solve(matrix / scale[:, None], column / scale))
        except np.linalg.LinAlgError:
            raise NoRegimeError("nothing determines its speed") from None
        states = state.nodes.shape[1]
        start, by = step[:states], step[states:]
        nodes = change.start @ start + change.by @ by + change.rest
        edges = start + change.edge_start @ start + change.edge_by @ by + change.edge_rest
        own = dict(zip(self.parameters, by.tolist(), strict=True))
        heavier, balance = own.get("inertia", 0.0), own.get("unknown", 0.0)
        share = 1.0
        for _ in range(_HALVINGS):
            new = State(
                state.nodes + share * nodes,
                state.edges + share * edges,
                state.inertia + share * heavier,
                state.unknown + share * balance,
            )
            total = new.inertia + self.moments.inertia
            s = (2 * new.nodes[:, 0] - self.w**2 * self.inertia.nodes) / (self.w**2 * total)
            if total.min() > 0.0 and np.isfinite(s).all() and ((1.0 + s) > _KEPT * (1.0 + here.s)).all():
                break
            share *= 0.5
        else:
            raise NoRegimeError(_STOPS)
        if share < 1.0:
            return new, 1.0
        shift = float(np.abs(nodes[:, 0] * here.by_energy + heavier * here.by_inertia).max())
        size = shift / max(float(np.ptp(here.omega)), 4 * ROUNDING * self.w / _SETTLED)
        if self.sized:
            size = max(size, abs(heavier) / max(abs(new.inertia), float(here.total.max())))
        return new, size

    def rounding_step(self, state: State, change: Changes) -> float:
        """The step that rounding of the torques makes where little holds the speed, by its fluctuation: `_OFF` at most."""
        if self.demand.speed is not None:
            return 0.0
        here = self.speeds(state)
        work = 64 * ROUNDING * float(cells.integral(here.rate.exchanged, self.mesh.half).sum())
        damping = max(abs(collocation.multiplier(change)[1]), 1e-300)
        level = work / (damping * self.w**2 * max(float(here.total.min()), 1e-300))
        fluctuation = float(np.ptp(self.extremes(state, here).excess))
        return min(level / max(fluctuation, 4 * ROUNDING / _SETTLED), _OFF)

    def sensitivity(self, state: State, change: Changes) -> Sensitivity:
        """How the flywheel sized answers to an excess of the extremes' omega², and to work left over in the cycle."""
        here = self.speeds(state)
        matrix, _ = self.conditions(state, here, change)
        scale = np.maximum(np.abs(matrix).max(axis=1), 1e-300)
        states, eps = state.nodes.shape[1], self.demand.irregularity or 0.0
        unit = np.zeros(matrix.shape[0])
        unit[states] = 1.0
        answer = np.abs(np.linalg.solve((matrix / scale[:, None]).T, unit)) / scale
        weights = np.ones(2) if self.balanced else np.array([2.0 + 0.5 * eps * eps])  # as in `conditions`
        by_square = float(answer[-weights.size :] @ weights)
        # the slope is what is left of changes that cancel, the more so the more torques that fall with speed take back
        fading = float(np.abs(cells.integral(here.rate.by_speed * here.by_energy, self.mesh.half)).max())
        left = 1.0 - by_square * _BLUR * (1.0 + fading) * float(np.abs(here.s).max() / here.total.min())
        return Sensitivity(by_square / left, float(answer[0]) / left) if left > 0.0 else Sensitivity(np.inf, np.inf)

    def extremes(self, state: State, here: _Speeds, *, settled: bool = False) -> Extremes:
        """Fastest and slowest point: at roots of F - ½ omega² dI*/dphi, or at an end of a cell.

        The energy is the integral of F once the state has settled; before, that integral may be anything. Roots are then
        polished as those of the function itself, not of its interpolant.
        """
        half_square = 0.5 * here.omega**2
        force = cells.fit(here.rate.moment - half_square * self.moments.slope)
        noise = 32 * ROUNDING * (here.rate.exchanged + half_square * np.abs(self.moments.slope)).max(axis=-1)
        found = cells.crossings(force[None], noise[None])
        every = np.arange(force.shape[0])
        cell = np.concatenate((every, every, found.cell))
        t = np.concatenate((np.full(every.size, -1.0), np.ones(every.size), found.t))
        s, _ = self._fluctuation(state, here, cell, t, settled)
        if not s.min() > -1.0:
            raise NoRegimeError(_STOPS)
        places = self.mesh.middle[cell, 0] + self.mesh.half[cell, 0] * t
        ends = [int(cells.peak(s, places)), int(cells.peak(-s, places))]
        cell, t, s = cell[ends], t[ends], s[ends]
        if settled:
            steep = 0.5 * self.w**2 * (1.0 + s)[:, None] * cells.fit(self.moments.slope[cell])
            polished = cells.newton(cells.fit(here.rate.moment[cell]) - steep, t, np.full(2, -1.0), np.ones(2))
            t = np.where(np.abs(t) < 1.0, polished, t)
        s, total = self._fluctuation(state, here, cell, t, settled)
        return Extremes(s / (1.0 + np.sqrt(1.0 + s)), cell, t, total, s)

    def _fluctuation(self, state: State, here: _Speeds, cell: Index, t: Array, settled: bool) -> tuple[Array, Array]:
        """The excess s in omega² = w² (1 + s), and J + I*, at local abscissas of cells."""
        basis = cells.basis(t)
        if settled:
            rising = cells.antiderivative(cells.fit(here.rate.moment), self.mesh.half)
            energy = state.edges[cell, 0] + (rising[cell] * basis).sum(axis=-1)
        else:
            within = (cells.fit(state.nodes[:, 0])[cell] * basis[:, :ORDER]).sum(axis=-1)
            energy = np.where(np.abs(t) < 1.0, within, state.edges[cell + (t > 0.0), 0])
        variation = self.inertia.edges[cell] + (self.inertia.rising[cell] * basis).sum(axis=-1)
        total = state.inertia + self.inertia.start + variation
        return (2 * energy - self.w**2 * variation) / (self.w**2 * total), total

    def result(self, state: State, change: Changes, steps: int) -> Periodic:
        """The motion at a state that the iteration has settled on.

        Its balance is the one that leaves no net work: large energies hide its last digits from the iteration.
        """
        half, here = self.mesh.half, self.speeds(state)
        if self.balanced:
            by_unknown = here.rate.by_unknown
            net, slope, size = cells.integral(np.stack((here.rate.moment, by_unknown, np.abs(by_unknown))), half).sum(-1)
            if abs(slope) > _NO_EFFECT * size:
                state = state._replace(unknown=state.unknown - float(net / slope))
                here = self.speeds(state)
        net, exchanged = cells.integral(np.stack((here.rate.moment, here.rate.exchanged)), half).sum(axis=-1)
        if not (self.levelled or abs(net) <= _OPEN * exchanged):
            raise NoRegimeError("the net work of a cycle does not come to zero")
        extremes = self.extremes(state, here, settled=True)
        answer = self.sensitivity(state, change) if self.sized else None
        multiplier, damping = collocation.multiplier(change)
        found = Periodic(self.moments, self.w, state, extremes, here.rate, here.omega, multiplier, damping, steps, answer)
        if not self.moments.swings:
            return found
        sizes = np.abs(here.rates).max(axis=-1) * half  # of what adds up in each cell
        missed = cells.TAIL_OF_INTEGRAL * np.stack(
            [cells.tails(cells.fit(row)) for row in here.rates.swapaxes(0, 1)], axis=1
        )
        closing = (missed * half + 4 * ROUNDING * sizes).sum(axis=0)
        return found._replace(closing=closing, reach=change.reach)


# -- cells that are cut and halved in turns with the motion --------------------------------------------------------------

MOST_WORK = 450_000
"""Nodes of Newton steps that the search for one motion may take, about a second: fifty times what a textbook's takes."""

_ROUNDS = 120
_MOST_MOVES = 8  # of the switches, before the cells are halved although they have not settled
_MOST_FAILURES = 3  # of the iteration on changed cells, before the best motion so far has to do
_SAME = 1e-12  # of the cycle: switches that move less than this stand still
_ROUGH = 1e-3  # error of a motion that is hardly resolved yet
_MOST_ROUGH, _MANY = 16, 1000  # rounds that it is given; cells from which on it is given none
_UNEVEN = 0.5  # irregularity of a motion whose speed varies as sharply as its loads, or more
_EVEN = 1e-9  # irregularity of a motion in which only rounding varies
_HARDLY = 0.1  # of J + I*: a sized flywheel in greater doubt is none
_STIFF, _UNLIKE = 3e3, 8.0  # times over that a change fades in a cycle; how far a slope may be off a difference
_HOPELESS = 0.5  # relative error past which a motion says nothing
_TINY = 1e-6  # irregularity up to which a sized motion is not solved for again
_NEAR = 0.5  # of the irregularity asked for: from here on the flywheel for it is looked for directly
_COARSE = 1e-4  # error of motions that are only passed on the way
_LAYER = 8.0  # exponent: how much of what a jump makes has faded in the first cell behind it
_HEAVIER, _BOLDER = 2.0, 3.0  # from one flywheel to the next on the way to a light one; than the step before
_EVER_HEAVIER = (1.0, 30.0, 1e3, 3e4)  # flywheels from which lighter ones are found, where the one before fails
_MOST_LIGHTER, _LITTLE = 60, 3e-3  # flywheels on that way; share of the inertia below which a step is not halved
_NEARER = 0.3  # of what an irregularity lacks of 2: from one motion to the next


class OwnMotion(NamedTuple):
    """A steady motion: as solved, its moment along the cycle (`cycle`), and as a `Run` at its own mean of extremes."""

    solved: Periodic
    cycle: Cycle
    run: Run
    level_error: float  # of the speed's mean, relative
    inertia_bound: float = 0.0  # kg m² that a sized flywheel may be off
    cuts_error: float = 0.0  # rad by which meshes may reverse elsewhere than cells are cut

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
        """Error of a sized inertia, relative to the larger of itself and the fluctuation of work over eps w²."""
        scale = float(np.ptp(self.cycle.start[0])) / max(self.solved.irregularity * self.speed**2, 1e-300)
        return self.inertia_bound / max(self.inertia, scale, 1e-300)

    @property
    def hardly_sized(self) -> bool:
        """Whether the irregularity leaves the flywheel open that was sized for it."""
        return self.inertia_bound > _HARDLY * (self.inertia + float(self.solved.moments.inertia.max()))


def own_motion(machine: Machine, reference: float, demand: Demand, guess: float, unknown: float, rtol: float) -> OwnMotion:
    """The steady motion with a given flywheel, or with the one that an irregularity asks for, at an error within rtol.

    Args:
        machine: the machine.
        reference: speed (rad/s) near that of the motion; the one asked for where there is one.
        demand: what is asked of the motion.
        guess: of the flywheel's inertia, kg m² on the crank, where it is sized.
        unknown: a first guess of the scene's unknown.
        rtol: relative error allowed in the irregularity, and in the inertia where it is sized.

    Raises:
        NoRegimeError: where there is no such motion, or none that can be resolved.

    A sized flywheel is checked by the motion with it: by half as much again where torques fade a change of speed so fast
    that rounding may have made its sensitivity, and by itself where laws switch along the motion.

    """
    search = _Search(machine, reference, demand, rtol)
    motion = _checked(search.motion(guess if demand.inertia is None else demand.inertia, unknown))
    if demand.inertia is not None or motion.inertia <= 0.0:
        return motion
    solved, inertia = motion.solved, motion.inertia
    fading = solved.rate.by_speed / ((inertia + solved.moments.inertia) * solved.omega)
    if solved.sensitivity and float(np.abs(cells.integral(fading, solved.moments.mesh.half)).sum()) > _STIFF:
        heavier = search.given(1.5 * inertia).motion(1.5 * inertia, solved.state.unknown)
        expected = inertia / max(solved.sensitivity.by_square, 1e-300)  # 0.5 J of it; the slope of eps is twice that of s
        if not _UNLIKE * expected > abs(heavier.run.irregularity - solved.irregularity) > expected / _UNLIKE:
            raise _open_flywheel(motion)
    # at least irregularities even a motion depends on its switches no more than on rounding
    if motion.run.irregularity > _TINY and search.switches():
        again = _checked(search.given(inertia).from_another(motion)) if motion.run.error <= _ROUGH else None
        off = np.inf if again is None else abs(again.run.irregularity / (demand.irregularity or 1.0) - 1.0)
        if again is None or not off <= 10 * (again.run.error + motion.run.error) + _SAME:
            raise NoRegimeError("the motion with the flywheel found for it has another irregularity")
    return motion


def own_motion_near(machine: Machine, other: OwnMotion, inertia: float, speed: float | None, rtol: float) -> OwnMotion:
    """The steady motion with a given flywheel (kg m² on the crank), found from one with a flywheel near it.

    Args:
        machine: the machine.
        other: the motion to begin with.
        inertia: of the flywheel.
        speed: mean of extremes (rad/s) that a balance holds; None where the machine sets its own.
        rtol: relative error allowed in the irregularity.

    Raises:
        NoRegimeError: where there is no such motion, or it is too far off.

    """
    search = _Search(machine, other.solved.reference, Demand(inertia, None, speed), rtol)
    return _checked(search.from_another(other))


def _checked(motion: OwnMotion) -> OwnMotion:
    """The motion, with what the last digits u of the speed make of a stiff torque in its errors; refused if it cannot be.

    F is off by |dF/domega| omega u where the speed is extreme, and the energy by the integral of that from where the cell
    begins. No cells mend that: it comes to the errors when the search for cells is over.
    """
    solved, run = motion.solved, motion.run
    # what may as well have an irregularity of 2 may as well stop
    if not (run.speed_min > 0.0 and run.irregularity * (1.0 + run.error) < 2.0):
        raise NoRegimeError("rounding leaves open whether the motion stops within the cycle")
    if motion.hardly_sized:
        raise _open_flywheel(motion)
    if not run.error <= _HOPELESS and run.irregularity > _EVEN:
        work = f"work of {motion.cycle.exchanged:.3g} J in a cycle"
        raise LostError(f"an irregularity of about {run.irregularity:.2g}, lost in the rounding of {work}")
    if not run.irregularity > 0.0:
        return motion
    stiff = cells.integral(np.abs(solved.rate.by_speed) * solved.omega, solved.moments.mesh.half)
    work_error = 4 * ROUNDING * float(stiff[solved.extremes.cell].max())
    least = float(solved.state.inertia + solved.moments.inertia.min())
    off = 4.0 * work_error / (solved.speed**2 * least * run.irregularity)
    slope = 0.0 if solved.sensitivity is None else solved.sensitivity.by_square
    bound = motion.inertia_bound + 0.5 * slope * run.irregularity * off
    return motion._replace(run=run._replace(error=run.error + off), inertia_bound=bound)


def _open_flywheel(motion: OwnMotion) -> UntoldError:
    """Of a flywheel that its irregularity leaves open."""
    what = f"what about {motion.inertia:.2g} kg m² on the crank change of it is lost in rounding"
    return UntoldError(f"an irregularity that hardly tells the flywheel: {what}")


class _Search(NamedTuple):
    """A machine, a speed near that of its motion, what is asked of it, and the error allowed."""

    machine: Machine
    reference: float
    demand: Demand
    rtol: float

    def given(self, inertia: float) -> _Search:
        """The search for the motion with a given flywheel."""
        return self._replace(demand=Demand(inertia, None, self.demand.speed))

    def moments(self, base: Array, cuts: Array, *, local: bool = False) -> Moments:
        """The machine on cells between edges, cut where the motion switches."""
        edges = merged([*base.tolist(), *cuts.tolist()], float(base[-1]))
        return moments_on(self.machine, edges, local=local)

    def switches(self) -> bool:
        """Whether a law switches at a speed, or a mesh has losses, so that cells are cut by the motion itself."""
        moments = self.moments(self.machine.mesh, np.zeros(0), local=True)
        return moments.lossy or bool(moments.switches(np.full(moments.mesh.phi.shape, self.machine.typical_speed)))

    def motion(self, inertia: float, unknown: float) -> OwnMotion:
        """The motion found directly, or where that fails, from heavier flywheels down."""
        try:
            return self.from_nothing(inertia, unknown)
        except NoRegimeError:
            return self.by_continuation(inertia, unknown)

    def from_nothing(self, inertia: float, unknown: float) -> OwnMotion:
        """The motion found from what torques at a constant speed would give.

        Where laws switch and that fails, branches are first decided at every node, and cells cut where they then switch.
        """
        base, cuts = self.layers(self.machine.mesh, np.zeros(0), self.reference, inertia, unknown)
        moments = self.moments(base, cuts)
        own = [float(value) for value in moments.steady_states(self.reference)]
        start = first_guess(moments, self.reference, inertia, unknown, own)
        try:
            return self.refinement(periodic(moments, self.reference, self.demand, start), base, cuts)
        except NoRegimeError:
            if not moments.switches(np.full(moments.mesh.phi.shape, self.reference)) and not moments.lossy:
                raise
        base = self.machine.mesh
        moments = self.moments(base, cuts, local=True)
        start = first_guess(moments, self.reference, inertia, unknown, own)
        rough = periodic(moments, self.reference, self.demand, start)
        cuts, _ = _switching(rough)
        start = carried(rough, moments := self.moments(base, cuts))
        return self.refinement(periodic(moments, self.reference, self.demand, start), base, cuts)

    def from_another(self, other: OwnMotion) -> OwnMotion:
        """The motion found from that with another flywheel."""
        # what resolved an uneven motion is needed again; the switches of an even one have moved on
        (cuts, _), base = _switching(other.solved), self.machine.mesh
        if other.run.irregularity > _UNEVEN:
            edges = other.solved.moments.mesh.edges
            base = edges[(np.abs(edges[:, None] - cuts) > 1e-9 * base[-1]).all(axis=1)]
        base, cuts = self.layers(base, cuts, other.speed, other.inertia, other.solved.state.unknown)
        start = carried(other.solved, moments := self.moments(base, cuts))
        if self.demand.inertia is not None:
            start = with_inertia(start, moments, other.solved.reference, self.demand.inertia)
        return self.refinement(periodic(moments, self.reference, self.demand, start), base, cuts)

    def layers(self, base: Array, cuts: Array, speed: float, inertia: float, unknown: float) -> tuple[Array, Array]:
        """Edges and cuts, with edges ever closer towards that end of each cell at which the speed settles steeply.

        What a jump of torque does to a strongly damped machine is over within 1/|dF/dE| rad after it; where changes grow
        with phi, before it.
        """
        moments = self.moments(base, cuts)
        if moments.circuit is not None:
            return base, cuts
        edges = moments.mesh.edges
        rate = moments.rate(np.full(moments.mesh.phi.shape, speed), unknown, inertia)
        found = []
        for k, row in enumerate(rate.by_speed / ((inertia + moments.inertia) * speed)):
            low, high = edges[k : k + 2].tolist()
            steepest = float(row[np.abs(row).argmax()])
            width = _LAYER / max(abs(steepest), 1e-300)
            while width < 0.5 * (high - low) and np.isfinite(steepest):
                found.append(low + width if steepest < 0.0 else high - width)
                width *= 2.0
        return (_without(merged([*edges, *found], float(edges[-1])), edges, base) if found else base), cuts

    def refinement(self, solved: Periodic, base: Array, cuts: Array) -> OwnMotion:
        """The motion at an error within rtol, or the best that can be had, from one on cells between edges and cuts.

        Cells are cut anew until the switches stand still, and then halved; what does not settle may be no more than what
        the cells leave open, so that they are halved then too. Where the iteration fails, all are.
        """
        best: OwnMotion | None = None
        least, allowed = np.inf, 0.5 * self.rtol
        stalls = moves = failures = rough = 0
        for _ in range(_ROUNDS):
            angles, slack = _switching(solved)
            moved = np.abs(angles - cuts) if angles.size == cuts.size else np.array([np.inf])
            settled = bool((moved <= _SAME * base[-1]).all())
            cuts, moves = angles, 0 if settled else moves % _MOST_MOVES + 1
            if settled or moves == _MOST_MOVES:
                motion, finer = _described(solved, self.demand), None
                if not settled and angles.size == moved.size and (moved <= np.maximum(slack, _SAME * base[-1])).all():
                    settled, motion = True, motion._replace(cuts_error=float(moved.max()))
                sized = motion.inertia_error if self.demand.inertia is None else 0.0
                error = max(motion.run.error, sized, motion.cycle.errors.work / max(motion.cycle.exchanged, 1e-300))
                edges = motion.cycle.mesh.edges
                if settled:
                    gained = best is None or error <= 0.9 * least
                    rough += error > _ROUGH  # cells may first have to become as narrow as what they follow
                    narrowing = error > _ROUGH and rough < _MOST_ROUGH and edges.size < _MANY
                    stalls = 0 if gained or narrowing else stalls + 1
                    if best is None or error < least:
                        best, least = motion, error
                    rounding = motion.hardly_sized and motion.run.error <= allowed  # which finer cells do not mend
                    if error <= allowed or stalls > 1 or rounding:
                        break
                if error > allowed:
                    coarse = turning_moment.coarse(motion.cycle, motion.run.speed_max)
                    finer = cells.halved(edges, coarse(allowed / error))
                if finer is None and settled:
                    break
                base = base if finer is None else _without(finer, edges, base)
            try:
                moments = self.moments(base, cuts)
                solved = periodic(moments, self.reference, self.demand, carried(solved, moments))
            except NoRegimeError:
                failures += 1
                base, cuts = cells.bisected(base, np.ones(base.size - 1, dtype=bool)), np.zeros(0)
                if failures > _MOST_FAILURES:
                    break
        if failures and (best is None or least > _ROUGH):
            raise NoRegimeError("on finer cells the iteration settles on no motion")
        if best is None:
            raise NoRegimeError("the angles at which its laws switch do not settle")
        return best

    def by_continuation(self, inertia: float, unknown: float) -> OwnMotion:
        """Given flywheels from one heavy enough to hold the speed nearly constant down to the one wanted.

        Each step is as large as can be taken. A sized flywheel lies on the way: it is looked for from motions that vary half
        as much as asked and more; an irregularity near 2 by steps towards it, each on the cells of the one before.
        """
        eps, target = self.demand.irregularity, self.demand.inertia or 0.0
        moments = self.moments(self.machine.mesh, np.zeros(0))
        work = cells.antiderivative(cells.fit(moments.constant(self.reference, unknown).moment), moments.mesh.half)
        fluctuation, own = float(np.ptp(cells.accumulated(work))), float(np.abs(moments.inertia).max())
        heavy = max(20.0 * max(fluctuation / self.reference**2, own, 1e-300), 4.0 * inertia)
        for heavier in _EVER_HEAVIER:  # enough to keep the speed where a steep torque neither ends nor saturates
            try:
                last = self.given(heavier * heavy)._replace(rtol=_COARSE).from_nothing(heavier * heavy, unknown)
                break
            except NoRegimeError:
                if heavier == _EVER_HEAVIER[-1] or not self.switches():
                    raise
        stops = NoRegimeError("the motions tried with lighter and lighter flywheels stop within the cycle")
        before = last.inertia
        for _ in range(_MOST_LIGHTER):
            if eps is None and last.inertia <= target:
                return self.from_another(last)
            if eps is not None and last.run.irregularity >= _NEAR * eps:
                near = last
                try:
                    while 2.0 - eps < _NEARER * (2.0 - near.run.irregularity):
                        nearer = Demand(None, 2.0 - _NEARER * (2.0 - near.run.irregularity), self.demand.speed)
                        near = self._replace(demand=nearer, rtol=_COARSE).from_another(near)
                    return self.from_another(near)
                except NoRegimeError:
                    if last.run.irregularity >= eps:
                        raise
            if eps is not None and last.inertia <= 0.0:
                raise NoRegimeError("even without a flywheel the speed varies less than asked")
            weight, scale = last.inertia - target, last.inertia + float(last.solved.moments.inertia.max())
            step = min(weight / _HEAVIER if weight > 0.1 * scale else weight, _BOLDER * before)
            while True:
                try:
                    lighter = self.given(last.inertia - step)._replace(rtol=_COARSE).from_another(last)
                    break
                except NoRegimeError:
                    step *= 0.5
                if step < _LITTLE * scale:
                    raise stops
            before, last = last.inertia - lighter.inertia, lighter
        raise stops


def _without(finer: Array, edges: Array, base: Array) -> Array:
    """Finer edges without those of the cells before that do not belong to the base: cuts, that is."""
    return np.asarray(finer[~np.isin(finer, edges) | np.isin(finer, base)])


def _switching(solved: Periodic) -> tuple[Array, Array]:
    """Angles where the motion makes a law switch, or a mesh change the side that drives, beside the machine's own edges.

    And by how much each may be off (rad) before what that makes of a cycle's work is more than rounding: nothing where a law
    switches; where a mesh reverses, what it passes is tau' x after x rad, of which (1/efficiency - efficiency) tau' x²/2 J
    would be lost too many or too few. Two reversals of a mesh with less between them are none.
    """
    moments, state = solved.moments, solved.state
    mesh, known = moments.mesh, moments.machine.mesh
    deciding = [(values, 0.0) for values in moments.switches(solved.omega)]
    if moments.lossy:
        spreads = [1.0 / eta - eta for part in moments.parts if (eta := part.stage.efficiency) < 1.0]
        passed = moments.transmitted(solved.omega, state.unknown, state.inertia, state.of_circuit)
        deciding += zip(passed, spreads, strict=True)
    rounding = ROUNDING * float(cells.integral(solved.rate.exchanged, mesh.half).sum())
    every: list[tuple[float, float]] = []
    for values, spread in deciding:
        series = cells.fit(values)[None]
        noise = np.full(series.shape[:2], 1e-13 * float(np.abs(values).max(initial=0.0)))
        crossings = cells.crossings(series, noise)
        slopes = spread * np.abs(crossings.slope) / mesh.half[crossings.cell, 0]
        slack = np.sqrt(2.0 * rounding / np.maximum(slopes, 1e-300)) if spread else np.zeros_like(slopes)
        found: list[tuple[float, float]] = []
        for angle, width in zip(crossings.angles(mesh).tolist(), slack.tolist(), strict=True):
            if np.abs(known - angle).min() <= 1e-9 * mesh.edges[-1]:
                continue
            if found and angle - found[-1][0] < min(width, found[-1][1]):
                found.pop()
            else:
                found.append((angle, width))
        every += found
    return tuple(np.array(sorted(every)).reshape(-1, 2).T)  # type: ignore[return-value]


def _described(solved: Periodic, demand: Demand) -> OwnMotion:
    """A solved motion as a cycle with its moment along it, and as a run with its error.

    With a given flywheel what the level is off weighs on the irregularity, the more the nearer the machine comes to a stop;
    a flywheel sought has the irregularity asked for, and hardly changes with the level there.
    """
    moments, state, extremes, mesh = solved.moments, solved.state, solved.extremes, solved.moments.mesh
    unknown = state.unknown if moments.machine.scene.unknown is not None else None
    cycle = cycle_of(moments, solved.rate, unknown)
    start, eps = state.inertia + cycle.inertia_at_start, solved.irregularity
    kept = _kept_work(solved, cycle)
    # energies are closed round the cycle, to their digits
    closing = kept + 2 * ROUNDING * float(np.abs(state.edges[:, 0]).max())
    free = unknown is None and moments.machine.sets_its_speed
    level = closing / (max(abs(solved.damping), 1e-300) * solved.speed**2 * max(start, 1e-300)) if free else 0.0
    of_states: tuple[float, ...] = ()
    if solved.reach is not None and solved.closing is not None:  # nothing fades by itself, and errors swing along
        carried_on = solved.reach @ np.concatenate(([closing], solved.closing[1:]))
        kept, of_states = float(carried_on[0]), tuple(carried_on[1:].tolist())
        level = kept / (solved.speed**2 * max(start, 1e-300))
    least = float(state.inertia + moments.inertia.min())
    off = 2 * (2 * kept + solved.speed**2 * cycle.errors.variation) / solved.speed**2 / least  # of the irregularity
    off += 2 * eps * (cycle.errors.inertia / least + 4 * ROUNDING)
    inside = mesh.middle[extremes.cell, 0] + mesh.half[extremes.cell, 0] * extremes.t
    angles = np.where(np.abs(extremes.t) < 1.0, inside, mesh.edges[extremes.cell + (extremes.t > 0.0)])
    run = Run(
        inertia=state.inertia,
        irregularity=eps,
        speed_max=solved.reference * (1.0 + float(extremes.excess[0])),
        speed_min=solved.reference * (1.0 + float(extremes.excess[1])),
        angle_speed_max=float(angles[0]),
        angle_speed_min=float(angles[1]),
        offset=float(state.edges[0, 0]) + 0.5 * start * (solved.reference**2 - solved.speed**2),
        error=off / eps if eps > 0.0 else 0.0,
        speed=solved.speed,
        drive=moments.drive(solved.omega, state.unknown, state.of_circuit),
        states=tuple(state.edges[0, 1:].tolist()),
        along=state.of_circuit if state.of_circuit.size else None,
        states_error=of_states,
        level=level,
    )
    varying = 0.5 * eps * run.error  # what speeds may be off the level
    if free:
        run = run._replace(error=run.error + 4.0 * (level if demand.inertia is None else run.level_error))
    if unknown is not None and cycle.balance_error:
        pulled = cells.integral(np.abs(solved.rate.by_speed) * solved.omega, mesh.half).sum()
        of_speeds = 1.0 + varying * float(pulled) / cycle.errors.work
        cycle = cycle._replace(balance_error=cycle.balance_error * of_speeds)
    answer, missed = solved.sensitivity, abs(eps - (demand.irregularity or eps))
    bound = 0.0 if answer is None else answer.by_square * (varying + missed) + answer.by_work * closing
    return OwnMotion(solved, cycle, run._replace(cycle=cycle), run.level_error + varying if free else 0.0, bound)


def _kept_work(solved: Periodic, cycle: Cycle) -> float:
    """Largest error (J) of the kinetic energy by errors of the cycle's work, which decay where torques fall with the speed.

    As dE' = (dF/dE) dE + r is one-signed, errors r of one sign in all cells are the worst that can be.
    """
    moments, errors, half = solved.moments, cycle.errors, solved.moments.mesh.half
    held = moments.machine.scene.unknown is not None  # then the balance's own error does not fade
    if held or moments.circuit is not None or not errors.work > 0.0:
        return errors.work
    growth = cells.integral(solved.rate.by_speed / ((solved.state.inertia + moments.inertia) * solved.omega), half)
    rounding = errors.work - float(errors.by_cell[0].sum())
    made = errors.by_cell[0] + rounding * cells.integral(solved.rate.exchanged, half) / max(cycle.exchanged, 1e-300)
    fades = np.minimum(growth, -1e-9)
    made = made * np.where(growth > fades, 1.0, np.expm1(fades) / fades)  # spread evenly over its cell
    kept = most = 0.0
    for left, added in [*zip(np.exp(np.minimum(growth, 1.0)).tolist(), made.tolist(), strict=True)] * 2:
        kept = min(kept * left + added, errors.work)
        most = max(most, kept)
    return most


def error_of_cuts(motion: OwnMotion) -> float:
    """Error (rad) of the angles of extreme speed that stand where cells are cut by the motion itself."""
    moments, run = motion.solved.moments, motion.run
    angles, known = np.array([run.angle_speed_max, run.angle_speed_min]), moments.machine.mesh
    cut = np.isin(angles, moments.mesh.edges) & (np.abs(angles[:, None] - known).min(axis=1) > 1e-9 * known[-1])
    return max(_SAME * float(known[-1]), motion.cuts_error) if cut.any() else 0.0
