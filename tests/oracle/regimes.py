"""Steady motions, at constant speed and by collocation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from tests.oracle import figures, panels
from tests.oracle.figures import Cycle
from tests.oracle.machine import Frame, Machine
from tests.oracle.numbers import EPS, KIND, Real, finer, plain, reals
from tests.oracle.panels import NODES, ORDER, Panels, Places

# Periodic motions of machines whose torques depend on speed, or whose meshes lose power.
#
# With y = omega²/2 and a part behind every lossy mesh, sum k (I y' + I' y - M) = 0, k = 1/eta where the crank drives the
# part,
# eta where the part drives the crank. y = w²/2 (1 + s): s is found on all panels at once by collocation at Gauss's nodes.
# The
# linear algebra of Newton's method is in double, what it corrects is not: only the number of steps depends on it.


AHEAD = Real("1e-7")  # of a difference quotient
_UP: Any = (panels.FIT @ panels.INTEGRATE @ panels.legendre(NODES, ORDER + 1).T).T  # values -> integral up to the nodes
_ROUNDS, _ENOUGH_ROUNDS = 20, 10
_NOTHING = finer(14)  # of a function's greatest value
_STILL = finer(14)  # rad: kinks, where moments do not jump, matter as the square of where they are put
_EVEN = 1e-10  # of s: what varies less varies by rounding
_WANDERING, _WANDER = 12, 1e-7  # steps in turn that are this small, of the range of s: they come to nothing
_FINE, _MOST = finer(18), 8000  # of the swing: what is left on a panel; panels that are refined no more


class NoMotionError(ValueError):
    """The iteration finds no periodic motion."""


class Held(NamedTuple):
    """Requirements of a motion: a flywheel or an irregularity, and with a balance the mean of extremes."""

    inertia: Any
    irregularity: Any
    speed: Any


class Guess(NamedTuple):
    """Start of the iteration; `pace` gives the speed at angles, in double."""

    speed: Any
    inertia: Any
    unknown: Any
    pace: Callable[[Any], Any]


class State(NamedTuple):
    """s at the nodes, at the left ends and (last) at the end of the cycle; the flywheel at the crank; the balance."""

    nodes: Any
    edges: Any
    inertia: Any
    unknown: Any


class Solved(NamedTuple):
    """A motion on its panels, with s and its slope, extremes, and what the last step still changed of the swing."""

    mesh: Panels
    state: State
    w: Any
    slope: Any
    places: Places
    s: Any
    doubt: float

    def pace(self, phi: Any) -> Any:
        """The speed at angles, in double."""
        s = at_angles(self.mesh, self.state.nodes, phi)
        return (self.w * plain.sqrt(1 + s)).astype(float)

    @property
    def excess(self) -> tuple[Any, Any]:
        """Greatest and least of omega/w - 1."""
        top, bottom = self.s.max(), self.s.min()
        return top / (1 + plain.sqrt(1 + top)), bottom / (1 + plain.sqrt(1 + bottom))


class Pieces(NamedTuple):
    """I, I' and M of everything before lossy meshes (efficiency 1) or behind one; the flywheel's share of it."""

    efficiency: Any
    carries: bool
    inertia: Any
    slope: Any
    moment: Any


def parts(machine: Machine, frame: Frame, omega: Any, unknown: Any) -> list[Pieces]:
    """The machine in parts, at speeds whose last column is at the anchors."""
    sample = machine.sampled(frame, omega, omega[..., -1:])
    on = machine.scene["flywheel"].get("on", "crank")
    groups = [("", [name for name in machine.shafts if name not in machine.efficiency])]
    groups += [(name, [name]) for name in machine.efficiency]
    found = []
    for name, shafts in groups:
        terms = [t.constant + unknown * t.share for t in sample.terms if t.shaft in shafts]
        found.append(
            Pieces(
                machine.efficiency.get(name, Real(1)),
                on in shafts,
                np.sum([sample.inertia[n] for n in shafts], axis=0),
                np.sum([sample.slope[n] for n in shafts], axis=0),
                np.sum([np.zeros_like(omega), *terms], axis=0),
            )
        )
    return found


def bend(found: list[Pieces], y: Any, inertia: Any) -> tuple[Any, list[Any]]:
    """y', and what the crank transmits to every part; directions as at the anchors, which are the last column."""
    whole = [p.inertia + inertia * p.carries for p in found]
    bare = [p.slope * y - p.moment for p in found]
    factors = [np.ones_like(y[..., -1:]) for _ in found]
    for _ in range(2 + 2 ** len(found)):
        slope = -np.sum([k * b for k, b in zip(factors, bare, strict=True)], axis=0)
        slope = slope / np.sum([k * i for k, i in zip(factors, whole, strict=True)], axis=0)
        sent = [i * slope + b for i, b in zip(whole, bare, strict=True)]
        new = [np.where(tau[..., -1:] > 0, 1 / p.efficiency, p.efficiency) for p, tau in zip(found, sent, strict=True)]
        if all((a == b).all() for a, b in zip(new, factors, strict=True)):
            break
        factors = new
    return slope, sent


class Equations:
    """A machine on panels, ready to tell s' anywhere."""

    def __init__(self, machine: Machine, edges: Any, w: Any, held: Held) -> None:
        self.machine, self.w, self.held, self.mesh = machine, w, held, panels.panels(edges)
        self.phi = np.concatenate((self.mesh.phi, self.mesh.middle), axis=1)
        self.frame = machine.frame(self.phi, self.mesh.middle)
        self.names = ("inertia",) * (held.inertia is None) + ("unknown",) * machine.balanced

    def parted(self, state: State) -> tuple[list[Pieces], Any]:
        """The parts at a state, and y there."""
        middle = panels.valued(panels.fit(state.nodes), np.zeros(len(state.nodes), dtype=KIND))
        s = np.concatenate((state.nodes, middle[:, None]), axis=1)
        if not s.min() > -1:
            raise NoMotionError
        omega = self.w * plain.sqrt(1 + s)
        return parts(self.machine, self.frame, omega, state.unknown), omega**2 / 2

    def rate(self, state: State) -> Any:
        """s' at the nodes."""
        found, y = self.parted(state)
        return bend(found, y, state.inertia)[0][:, :-1] / (self.w**2 / 2)

    def sent(self, state: State) -> list[Any]:
        """Torques that lossy meshes transmit, at the nodes."""
        found, y = self.parted(state)
        tau = bend(found, y, state.inertia)[1]
        return [t[:, :-1] for p, t in zip(found, tau, strict=True) if p.efficiency < 1]

    def gained(self, state: State) -> Any:
        """The net work of the cycle: large energies hide its last digits from s."""
        found, y = self.parted(state)
        tau = bend(found, y, state.inertia)[1]
        factors = [np.where(t[..., -1:] > 0, 1 / p.efficiency, p.efficiency) for p, t in zip(found, tau, strict=True)]
        lost = [(k - 1) * t for k, t in zip(factors, tau, strict=True)]
        force = np.sum([p.moment for p in found], axis=0) - np.sum(lost, axis=0)
        return panels.integrals(force[:, :-1], self.mesh.half).sum()

    def rebalanced(self, state: State) -> State:
        """The state with the balance that leaves no net work at these speeds."""
        if not self.machine.balanced:
            return state
        u, net = state.unknown, self.gained(state)
        step = AHEAD * (abs(u) if u else Real(1))
        slope = (self.gained(state._replace(unknown=u + step)) - net) / step
        return state._replace(unknown=u - net / slope)

    def slopes(self, state: State, rate: Any) -> tuple[Any, Any]:
        """ds'/ds (panels, nodes) and ds'/d(parameter) (panels, nodes, parameters), in double."""
        nodes = (self.rate(state._replace(nodes=state.nodes + AHEAD)) - rate) / AHEAD
        by = []
        for name in self.names:
            value = getattr(state, name)
            step = AHEAD * (abs(value) if value else Real(1))
            by.append((self.rate(state._replace(**{name: value + step})) - rate) / step)
        return nodes.astype(float), np.stack([*by, 0 * rate], axis=-1)[..., :-1].astype(float)

    def extremes(self, state: State, rate: Any) -> tuple[Places, Any]:
        """Places at which s may be extreme, and s there."""
        places = panels.candidates(rate)
        series = panels.fit(rate) @ panels.INTEGRATE * self.mesh.half
        s = state.edges[places.panel] + panels.valued(series[places.panel], places.t)
        return places, s

    def improved(self, state: State) -> tuple[State, float]:
        """A step of Newton's method, and its size as a share of the swing."""
        rate, h = self.rate(state), self.mesh.half
        by_s, by = self.slopes(state, rate)
        rest = state.edges[:-1, None] + h * (rate @ _UP.T) - state.nodes
        end = state.edges[:-1] + panels.integrals(rate, h) - state.edges[1:]
        half, up = h.astype(float), _UP.astype(float)
        matrix = np.eye(ORDER) - half[:, :, None] * up * by_s[:, None, :]
        forced = np.einsum("pi,ij,pjk->pik", half * np.ones(ORDER), up, by)
        right = np.concatenate((np.ones((*by_s.shape, 1)), forced, rest.astype(float)[..., None]), axis=-1)
        cell = np.linalg.solve(matrix, right)
        gained = by_s[..., None] * cell
        gained[..., 1:-1] += by
        gain = half * np.einsum("j,pjk->pk", panels.WEIGHTS.astype(float), gained)
        gain[:, -1] += end.astype(float)
        edge = chained(gain)
        left = edge[:-1].copy()
        left[:, 0] += 1
        nodes = cell[..., :1] * left[:, None, :]
        nodes[..., 1:] += cell[..., 1:]
        gap = np.append(edge[-1], float(state.edges[-1] - state.edges[0]))
        gap[-2] += gap[-1]
        step = self.solved(state, rate, nodes, edge, gap[:-1])
        return self.taken(state, nodes @ step, edge @ step + step[0], step)

    def solved(self, state: State, rate: Any, nodes: Any, edge: Any, gap: Any) -> Any:
        """The change at phi = 0 and of the parameters (and a 1 for what is left over): closed, at the speeds asked for."""
        rows, right = [gap[:-1]], [-gap[-1]]
        if self.names:
            places, s = self.extremes(state, rate)
            ends = [int(s.argmax()), int(s.argmin())]
            panel, t = places.panel[ends], places.t[ends]
            inner = np.einsum("kj,kjm->km", (panels.legendre(t, ORDER) @ panels.FIT.T).astype(float), nodes[panel])
            at_edge = edge[panel + (t > 0)].copy()
            at_edge[:, 0] += 1
            change = np.where(np.abs(t)[:, None] < 1, inner, at_edge) / (2 * np.sqrt(1 + s[ends].astype(float)))[:, None]
            excess = s[ends] / (1 + plain.sqrt(1 + s[ends]))
            for row, offset in self.conditions(excess):
                rows.append(row @ change[:, :-1])
                right.append(float(offset) - row @ change[:, -1])
        matrix = np.array(rows)
        scale = np.abs(matrix).max(axis=1)
        return np.append(np.linalg.solve(matrix / scale[:, None], np.array(right) / scale), 1.0)

    def conditions(self, excess: Any) -> list[tuple[Any, Any]]:
        """Rows for the changes of both extremes, and what these are to make up for."""
        eps, (top, bottom) = self.held.irregularity, excess
        if eps is None:
            return [(np.array([0.5, 0.5]), -(top + bottom) / 2)] if self.machine.balanced else []
        if self.machine.balanced:
            return [(np.array([1.0, 0.0]), eps / 2 - top), (np.array([0.0, 1.0]), -eps / 2 - bottom)]
        half = float(eps) / 2
        return [(np.array([1 - half, -1 - half]), eps * (1 + (top + bottom) / 2) - (top - bottom))]

    def taken(self, state: State, nodes: Any, edges: Any, step: Any) -> tuple[State, float]:
        """As much of a step as keeps the machine turning."""
        share, own = 1.0, dict(zip(self.names, step[1:-1], strict=True))
        for _ in range(30):
            new = State(
                state.nodes + share * nodes,
                state.edges + share * edges,
                state.inertia + share * own.get("inertia", 0.0),
                state.unknown + share * own.get("unknown", 0.0),
            )
            if (1 + new.nodes > 0.25 * (1 + state.nodes)).all():
                size = float(np.abs(nodes).max()) / max(float(np.ptp(state.nodes)), _EVEN)
                if "inertia" in own:
                    size = max(size, abs(float(own["inertia"] / max(abs(new.inertia), Real("1e-300")))))
                return new, size if share == 1.0 else 1.0
            share /= 2
        raise NoMotionError

    def settled(self, state: State) -> tuple[State, float]:
        """Steps until they are nothing but rounding."""
        sizes: list[float] = []
        for _ in range(40):
            state, size = self.improved(state)
            sizes.append(size)
            if not np.isfinite(size):
                raise NoMotionError
            if size < 1e-9 and len(sizes) > 1 and size > 0.2 * sizes[-2]:
                return state, size
            if size < 4 * EPS:
                return state, size
            if len(sizes) >= _WANDERING and max(sizes[-_WANDERING:]) < _WANDER:  # by rounding, more on some processors
                return state, max(sizes[-_WANDERING:])
        raise NoMotionError


def chained(gain: Any) -> Any:
    """Changes at the edges by what starts and by parameters, that of the start itself left out: panel after panel."""
    edge = np.zeros((len(gain) + 1, gain.shape[1]))
    for k, own in enumerate(gain):
        edge[k + 1] = edge[k] * (1 + own[0])
        edge[k + 1] += own
    return edge


def found(machine: Machine, held: Held, guess: Guess) -> Solved:
    """The motion nearest to a guess, on panels that end where branches change and are fine enough for it."""
    w = guess.speed if held.speed is None else held.speed
    mesh, _ = figures.resolved(machine, w)
    switched, last = np.zeros(0, dtype=KIND), np.full(4, np.inf, dtype=KIND)
    equations = Equations(machine, mesh.edges, w, held)
    state = first(equations, guess)
    for turn in range(_ROUNDS):
        state, doubt = equations.settled(state)
        rate, old = equations.rate(state), equations.mesh
        _, s = equations.extremes(state, rate)
        turns = switching(equations, state)
        coarse = (
            (panels.tails(rate) * old.half[:, 0] > _FINE * np.ptp(s)) & (old.half[:, 0] > 1e-8) & (old.half.size < _MOST)
        )
        still = turns.size == switched.size and not (np.abs(turns - switched) > _STILL).any()
        output = np.array([np.ptp(s), s.max(), state.inertia, state.unknown])
        same = turn > _ENOUGH_ROUNDS and (np.abs(output - last) <= finer(16) * np.abs(output)).all()  # only rounding is left
        if (still and not coarse.any()) or same:
            state = equations.rebalanced(state)
            rate = equations.rate(state)
            return Solved(old, state, w, rate, *equations.extremes(state, rate), doubt)
        last = output
        equations = Equations(machine, cut(old, coarse, switched, turns, machine.breaks), w, held)
        state, switched = moved(old, state, equations.mesh), turns
    raise NoMotionError


def cut(old: Panels, coarse: Any, switched: Any, turns: Any, breaks: Any) -> Any:
    """Edges with coarse panels halved, and with those that were put in for switches moved to where these are now."""
    kept = np.setdiff1d(panels.bisected(old.edges, coarse), switched)
    kept = kept[np.abs(kept[:, None] - turns[None, :]).min(axis=1, initial=9) > 1e-9]
    return np.unique(np.concatenate((kept, turns, breaks)))


def switching(equations: Equations, state: State) -> Any:
    """Angles inside panels, or at the ends of them, where what speeds decide changes its sign."""
    machine, mesh = equations.machine, equations.mesh
    values = equations.sent(state)
    omega = equations.w * plain.sqrt(1 + state.nodes)
    values += [np.broadcast_to(v, omega.shape) for v in machine.signs(mesh.phi, omega, of_speed=True)]
    angles: list[Any] = []
    for rows in values:
        angles += kinks(np.asarray(rows), mesh, machine.breaks)
    inner = [a for a in sorted(angles) if np.abs(a - machine.breaks).min() > 1e-15]
    return np.array([a for k, a in enumerate(inner) if k == 0 or a - inner[k - 1] > 1e-9], dtype=KIND)


def first(equations: Equations, guess: Guess) -> State:
    """The motion that is guessed."""
    mesh, w = equations.mesh, equations.w

    def s(phi: Any) -> Any:
        return (reals(guess.pace(phi.astype(float))) / w) ** 2 - 1

    return State(s(mesh.phi), s(mesh.edges), guess.inertia, guess.unknown)


def moved(old: Panels, state: State, mesh: Panels) -> State:
    """A state on other panels."""
    return state._replace(nodes=at_angles(old, state.nodes, mesh.phi), edges=at_angles(old, state.nodes, mesh.edges))


def at_angles(mesh: Panels, nodes: Any, phi: Any) -> Any:
    """Values at angles of what is known at the nodes."""
    k = np.clip(np.searchsorted(mesh.edges, phi, side="right") - 1, 0, len(mesh.half) - 1)
    return panels.valued(panels.fit(nodes)[k], (phi - mesh.middle[k, 0]) / mesh.half[k, 0])


def kinks(values: Any, mesh: Panels, base: Any) -> list[Any]:
    """Angles where a function changes its sign, inside panels or where two of them meet, unless it is nothing there."""
    values = np.where(np.abs(values).max(axis=-1, keepdims=True) > _NOTHING * np.abs(values).max(), values, 0)
    looked = panels.looked(panels.fit(values))
    at = (looked[1:, 0] * looked[:-1, -1] < 0) & ~np.isin(mesh.edges[1:-1], base)
    return [*panels.roots(values).angles(mesh), *mesh.edges[1:-1][at]]


# The cycle of torques taken at a constant crank speed, and the speed at which it leaves no net work.


_CONSTANT_ROUNDS = 20


def constant_cycle(machine: Machine, speed: Any, unknown: Any) -> Cycle:
    """The cycle of torques at a constant speed, its balance solved; panels end where a mesh changes its direction."""
    base, switched = machine.breaks, np.zeros(0, dtype=KIND)
    for _ in range(_CONSTANT_ROUNDS):
        mesh, _ = figures.resolved(machine, speed, np.unique(np.concatenate((base, switched))))
        frame = machine.frame(np.concatenate((mesh.phi, mesh.middle), axis=1), mesh.middle)
        omega = np.full(frame.here.value.shape, speed, dtype=KIND)
        moment, exchanged, sent = constant_moment(machine, frame, omega, unknown)
        if machine.balanced:
            for _ in range(60):
                net = panels.integrals(moment, mesh.half).sum()
                step = abs(unknown) * AHEAD + Real("1e-30") if unknown else Real("1e-9")
                ahead = panels.integrals(constant_moment(machine, frame, omega, unknown + step)[0], mesh.half).sum()
                before, unknown = unknown, unknown - net * step / (ahead - net)
                moment, exchanged, sent = constant_moment(machine, frame, omega, unknown)
                if abs(unknown - before) <= 2 * EPS * abs(unknown):
                    break
        angles = sorted(a for tau in sent for a in kinks(tau, mesh, base))
        turns = np.array([a for k, a in enumerate(angles) if k == 0 or a - angles[k - 1] > 1e-12], dtype=KIND)
        if turns.size == switched.size and np.abs(turns - switched).max(initial=0) < finer(17):
            break
        switched = turns
    sample = machine.sampled(frame, omega, omega[..., -1:])
    drive = sum(
        (panels.integrals((t.constant + unknown * t.share)[:, :-1], mesh.half).sum() for t in sample.terms if t.drive),
        Real(0),
    )
    trimmed = sample._replace(
        inertia={k: v[:, :-1] for k, v in sample.inertia.items()}, slope={k: v[:, :-1] for k, v in sample.slope.items()}
    )
    return figures.assembled(mesh, moment, trimmed, unknown, panels.integrals(exchanged, mesh.half).sum(), drive)


def constant_moment(machine: Machine, frame: Frame, omega: Any, unknown: Any) -> tuple[Any, Any, list[Any]]:
    """M* at constant speeds, the sum of all contributions' sizes, and what lossy meshes transmit; at the nodes."""
    sample = machine.sampled(frame, omega, omega[..., -1:])
    found = parts(machine, frame, omega, unknown)
    moment = np.sum([p.moment for p in found], axis=0)
    exchanged = np.sum([np.abs(t.constant + unknown * t.share) for t in sample.terms], axis=0)
    sent = []
    for p in found:
        if p.efficiency < 1:
            tau = p.slope * omega**2 / 2 - p.moment
            factor = np.where(tau[..., -1:] > 0, 1 / p.efficiency, p.efficiency) - 1
            moment, exchanged = moment - factor * tau, exchanged + np.abs(factor * tau)
            sent.append(tau[:, :-1])
    return moment[:, :-1], exchanged[:, :-1], sent


def constant_speed(machine: Machine, guess: Any) -> Any:
    """The speed near a guess at which a cycle at constant speed has no net work."""

    def net(speed: Any) -> Any:
        return constant_cycle(machine, speed, Real(0)).work.edges[-1]

    a, b = guess, guess * (1 + Real("1e-6"))
    fa, fb = net(a), net(b)
    for _ in range(30):
        if fa == fb:
            break
        a, b, fa = b, b - fb * (b - a) / (fb - fa), fb
        if abs(b - a) <= 2 * EPS * abs(b):
            break
        fb = net(b)
    return b
