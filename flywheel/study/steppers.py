"""The question of a scene, answered as a script does: by a plain grid of angles, or by cycles run until one closes.

On a grid: the trapezoidal rule, the greatest and the least sample. In time: Euler, RK4, and SciPy's RK45, DOP853 and LSODA,
each with and without a restart where the machine's loads and ratios break; without one, steps run over jumps and windows as
a script's do. Without reduction: by the whole bond graph, or by Lagrange's multipliers on bodies in absolute coordinates.
What is unknown at the start of the cycle (its speed, a motor's current, the balance, the flywheel) is found by Powell's
hybrid method on what the cycle lacks at its end; whatever runs the cycle can be plugged in.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import integrate, optimize

from bondgraph.motion.stepping import FIXED, Step, hermite, runge_kutta_step
from bondgraph.numerics import root, summits
from flywheel.machine.dynamics import Dynamics, Start, dynamics_of
from flywheel.machine.machine import Anchor, Machine, circuit_of
from flywheel.mechanisms.families import has_joints
from flywheel.mechanisms.linkage import linkage_of
from flywheel.mechanisms.linkages import multibody
from flywheel.motions.simulation import graph_motion, states_of_graph
from flywheel.regime import constant_speed
from flywheel.sizing.confirmation import extreme
from flywheel.study.reference import Question

Array = NDArray[np.float64]

# -- a plain grid ------------------------------------------------------------------------------------------------------


class Samples(NamedTuple):
    """A cycle on evenly spaced angles: W (J) and I* (kg m²) there, the crank's speed w (rad/s), and the unknown's value.

    `unit` is the unknown's change (SI) that changes the cycle's net work by one joule; 0 without an unknown.
    """

    phi: Array
    work: Array
    inertia: Array
    speed: float
    balance: float
    unit: float


def sampled(machine: Machine, count: int) -> Samples:
    """The cycle at `count` angles and its end; torques that depend on speed are taken at a constant one."""
    phi = np.linspace(0.0, machine.scene.cycle, count + 1)
    reduced = machine.reduce(phi)
    moment, share, inertia = (part + 0.0 * phi for part in (reduced.moment, reduced.per_unknown, reduced.inertia))
    speed, balance, unit = machine.scene.speed or 0.0, 0.0, 0.0
    if machine.sets_its_speed:
        own, balance = constant_speed.operating_point(machine)
        speed = own or 0.0
        dynamics = dynamics_of(machine, 0.0, balance)
        dynamics.circuit = None  # at a constant speed a motor's current is steady
        anchor = Anchor(machine.anchors(phi), speed + 0.0 * phi, 0.0 * phi)
        moment = dynamics.at_many(phi, anchor, anchor.omega, anchor.time).moment
    elif net := float(np.trapezoid(share, phi)):
        balance, unit = -float(np.trapezoid(moment, phi)) / net, 1.0 / net
        moment = moment + balance * share
    steps = 0.5 * (moment[1:] + moment[:-1]) * np.diff(phi)
    return Samples(phi, np.concatenate(([0.0], np.cumsum(steps))), inertia, speed, balance, unit)


def by_grid(question: Question, count: int) -> float:
    """The answer from a plain grid."""
    samples = sampled(question.machine, count)
    if question.sized:
        return max(_flywheel(samples, question.machine.scene.irregularity or 0.0), 0.0) / question.crank
    omega = _speeds(samples, question.given)
    return _irregularity(omega.max(), omega.min())


def _flywheel(samples: Samples, eps: float) -> float:
    """Wittenbauer's flywheel (kg m² on the crank) of samples: [max(W - z+ w²I*/2) - min(W - z- w²I*/2)]/(eps w²)."""
    square = samples.speed**2
    energy = 0.5 * square * samples.inertia
    high = (samples.work - (1 + eps / 2) ** 2 * energy).max()
    low = (samples.work - (1 - eps / 2) ** 2 * energy).min()
    return float((high - low) / (eps * square))


def _speeds(samples: Samples, inertia: float) -> Array:
    """Speeds (rad/s) at the samples with a flywheel (kg m² on the crank), at the level where their mean of extremes is w."""
    total = inertia + samples.inertia

    def at(level: float) -> Array:
        return np.asarray(np.sqrt(np.maximum(2 * (level + samples.work) / total, 0.0)))

    def excess(level: float) -> float:
        omega = at(level)
        return float(0.5 * (omega.max() + omega.min()) / samples.speed - 1)

    top = float(0.5 * total.max() * samples.speed**2 + np.abs(samples.work).max())
    return at(root(excess, -float(samples.work.min()), 4 * top))


def _irregularity(greatest: float, least: float) -> float:
    """2 (w_max - w_min)/(w_max + w_min)."""
    return float(2 * (greatest - least) / (greatest + least))


# -- cycles that are run until they close ------------------------------------------------------------------------------

_GUESS = 360  # angles of the grid that the search starts from
_MOST_RUNS = 60
_DIFFERENCE = 1e-3  # of an unknown's scale, by which it is first varied: above the noise of rough steps
_OFF = 0.01  # of an irregularity: tolerance at the end of a search
_STOPS = 1e3  # residual of a machine that stops within its cycle


class NoAnswerError(ValueError):
    """A method that does not come to an answer; the message says why."""


class Trial(NamedTuple):
    """A cycle to be run: flywheel (kg m² on the crank), the unknown's value (SI), speed (rad/s) and states of a motor.

    `period` is about how long it takes (s).
    """

    inertia: float
    balance: float
    speed: float
    states: tuple[float, ...]
    period: float


class Revolution(NamedTuple):
    """Result of a run of one cycle: speed and a motor's own states at its end, greatest and least speed on the way."""

    speed: float
    states: tuple[float, ...]
    greatest: float
    least: float


Revolve = Callable[[Trial], Revolution]


def by_shooting(question: Question, revolve: Revolve, tolerance: float) -> float:
    """The answer from cycles run by `revolve`, to a tolerance of its search (relative).

    The search starts from a plain grid. Every unknown is measured in the change of it that matters, which is about the
    irregularity's share, and so is what a cycle lacks: irregularity, mean of extremes, closure of speed and of current.

    Raises:
        NoAnswerError: where the search comes to no motion.

    """
    machine, scene = question.machine, question.machine.scene
    circuit, balanced = circuit_of(scene), scene.unknown is not None
    samples = sampled(machine, _GUESS)
    own = float(samples.inertia.mean())
    inertia = max(_flywheel(samples, scene.irregularity or 0.0), 1e-3 * own) if question.sized else question.given
    omega = _speeds(samples, inertia)
    eps = (scene.irregularity or 0.0) if question.sized else max(_irregularity(omega.max(), omega.min()), 1e-12)
    own_states: tuple[float, ...] = ()
    if circuit is not None and scene.drive is not None:
        own_states = tuple(float(one) for one in circuit.steady(scene.shafts[scene.drive.on] * samples.speed))
    period = float(np.trapezoid(1.0 / np.maximum(omega, 1e-3 * samples.speed), samples.phi))
    guess = Trial(inertia, samples.balance, float(omega[0]), own_states, period)
    scales = {"speed": eps * samples.speed}
    if question.sized:
        scales["inertia"] = inertia + own
    if balanced:
        by_work = samples.unit * eps * (inertia + own) * samples.speed**2
        scales["balance"] = by_work or eps * (abs(samples.balance) or 1.0)
    sizes = [max(abs(state), 1.0) * eps for state in own_states]

    def trial(x: Array) -> Trial:
        count = len(scales)
        shares = zip(scales.items(), (x[:count] - 1.0).tolist(), strict=True)
        moved = {name: getattr(guess, name) + share * scale for (name, scale), share in shares}
        rows = zip(own_states, sizes, (x[count:] - 1.0).tolist(), strict=True)
        return guess._replace(**moved, states=tuple(state + share * size for state, size, share in rows))

    def lacking(x: Array) -> list[float]:
        start = trial(x)
        end = revolve(start) if start.speed > 0.0 else None
        if end is None or not np.isfinite((end.speed, *end.states, end.greatest, end.least)).all() or end.least <= 0.0:
            return [_STOPS] * (len(scales) + len(sizes))
        mean = 0.5 * (end.greatest + end.least)
        lacks = [(end.greatest - end.least) / (mean * eps) - 1.0] if question.sized else []
        if balanced or not machine.sets_its_speed:
            lacks.append((mean / (scene.speed or 1.0) - 1.0) / eps)
        if balanced or machine.sets_its_speed:
            lacks.append((end.speed - start.speed) / (mean * eps))
        return lacks + [(a - b) / size for a, b, size in zip(end.states, start.states, sizes, strict=True)]

    options: Any = {"xtol": max(tolerance, 1e-14), "eps": _DIFFERENCE**2, "maxfev": _MOST_RUNS}
    solution: Any = optimize.root(lacking, np.ones(len(scales) + len(sizes)), method="hybr", options=options)
    if not np.isfinite(solution.fun).all() or np.abs(solution.fun).max() > _OFF:
        raise NoAnswerError("its cycles reach no steady motion")
    last = trial(solution.x)
    if question.sized:
        return max(last.inertia, 0.0) / question.crank
    end = revolve(last)
    return _irregularity(end.greatest, end.least)


class Stretch(NamedTuple):
    """Angles (rad) that are stepped in one go; `middle` is inside their smooth piece, None without restart."""

    low: float
    high: float
    middle: float | None


def stretches_of(machine: Machine, restart: bool) -> list[Stretch]:
    """The cycle in one go, or from one place where the machine's loads and ratios break to the next."""
    if not restart:
        return [Stretch(0.0, machine.scene.cycle, None)]
    return [Stretch(a, b, 0.5 * (a + b)) for a, b in pairwise(machine.restarts.tolist())]


_BETWEEN, _CLOSER = 8, 7  # samples between two times, and rounds of looking closer


def _summit(speed: Callable[[Array], Array], times: Array, sign: float) -> float:
    """The greatest (sign 1) or least (-1) of a speed over time, between given times and ever closer about the best ones."""
    fine = np.append((times[:-1, None] + np.diff(times)[:, None] * np.arange(_BETWEEN) / _BETWEEN).ravel(), times[-1])
    tops = np.array(standing_out(sign * speed(fine)))
    low, high = fine[np.maximum(tops - 1, 0)], fine[np.minimum(tops + 1, fine.size - 1)]
    found = summits(lambda grid: sign * speed(grid.ravel()).reshape(grid.shape), low, high, 2 * _BETWEEN + 1, _CLOSER)
    return sign * float(found.value.max())


def standing_out(values: Array) -> list[int]:
    """The samples that stand out among their neighbours, as far as a peak beside one may come to be the greatest of all.

    >>> standing_out(np.array([0.0, 1.0, 0.5, 0.98, 0.5, 0.2, 0.3, 0.1]))
    [1, 3]
    """
    steps = np.abs(np.diff(values))
    reach = np.maximum(np.append(steps, 0.0), np.append(0.0, steps))  # what a peak between samples may add, at most
    beside = np.pad(values, 1, constant_values=-np.inf)
    out = (values >= beside[:-2]) & (values >= beside[2:]) & (values + reach >= values.max())
    return [int(k) for k in np.flatnonzero(out)]


# -- a cycle by steps --------------------------------------------------------------------------------------------------

Rates = Callable[[float, Array], Array]
StretchSteps = Callable[[Rates, float, Array, Stretch, float], Iterator[Step]]

ADAPTIVE = ("RK45", "DOP853", "LSODA")
_MOST_STEPS = 200_000  # in a stretch: a machine that stops within it never gets to its end
_MANY = 100  # steps, past which extremes are looked for beside the best ones only


def fixed(machine: Machine, name: str, count: int, restart: bool) -> Revolve:
    """Runs cycles by a rule of fixed step, about `count` steps a cycle."""
    tableau = FIXED[name.lower()]

    def stretch_steps(rates: Rates, t: float, state: Array, stretch: Stretch, period: float) -> Iterator[Step]:
        share = (stretch.high - stretch.low) / machine.scene.cycle
        wanted = max(round(count * share), 1)
        h = period * share / wanted if not restart else (stretch.high - state[0]) / state[1] / wanted
        for _ in range(_MOST_STEPS):
            step = partial(runge_kutta_step, tableau, rates, t, state, rate=rates(t, state))
            after = step(h)
            if after[0] >= stretch.high:
                h = root(lambda length: float(step(length)[0]) - stretch.high, 0.0, h)  # noqa: B023 - called at once
                after = step(h)
                after[0] = stretch.high
            yield Step(_between(rates, t, state, h, after), t, t + h)
            t, state = t + h, after
            if state[0] >= stretch.high:
                return
            if not state[1] > 0.0:
                break
        raise NoAnswerError("the machine stops within its cycle")

    return _stepped(machine, restart, stretch_steps)


def _between(rates: Rates, t: float, state: Array, h: float, after: Array) -> Callable[[Any], Array]:
    """Hermite's cubic over a step; its rates are found when it is first looked into, as few steps ever are."""
    cubic: list[Callable[[Any], Array]] = []

    def dense(times: Any) -> Array:
        if np.ndim(times) == 0 and times == t + h:
            return after
        if not cubic:
            cubic.append(hermite(t, t + h, state, after, rates(t, state), rates(t + h, after)))
        return cubic[0](times)

    return dense


def adaptive(machine: Machine, name: str, rtol: float, restart: bool) -> Revolve:
    """Runs cycles by one of SciPy's integrators at a tolerance of its steps."""
    kind: Any = getattr(integrate, name)

    def stretch_steps(rates: Rates, t: float, state: Array, stretch: Stretch, period: float) -> Iterator[Step]:
        scale: Any = rtol * np.maximum(np.abs(state), [1.0, 0.0, 1.0][: state.size])
        solver = kind(rates, t, state, t + 100 * period, rtol=rtol, atol=scale)
        for _ in range(_MOST_STEPS):
            if solver.status != "running":
                break
            solver.step()
            dense, before = solver.dense_output(), float(solver.t_old)
            if solver.y[0] >= stretch.high:
                end = root(lambda t: float(dense(t)[0]) - stretch.high, before, float(solver.t))  # noqa: B023
                yield Step(dense, before, end)
                return
            yield Step(dense, before, float(solver.t))
            if not solver.y[1] > 0.0:
                break
        raise NoAnswerError("the machine stops within its cycle")

    return _stepped(machine, restart, stretch_steps)


def _stepped(machine: Machine, restart: bool, stretch_steps: StretchSteps) -> Revolve:
    """Runs cycles stretch by stretch: the state is phi, omega, and a motor's own states."""
    stretches, cycle = stretches_of(machine, restart), machine.scene.cycle

    def rates(dynamics: Dynamics, stretch: Stretch, t: float, state: Array) -> Array:
        phi, omega, *own = state.tolist()
        if stretch.middle is None:
            phi = phi % cycle
            now = dynamics.at(phi, float(machine.anchors(phi)), omega, states=own)
        else:
            now = dynamics.at(phi, stretch.middle, omega, states=own, ends=(stretch.low, stretch.high))
        return np.array([omega, float(now.acceleration), *map(float, now.rates)])

    def revolve(trial: Trial) -> Revolution:
        dynamics = dynamics_of(machine, trial.inertia, trial.balance)
        state = np.array([0.0, trial.speed, *trial.states])
        t, steps = 0.0, list[Step]()
        for stretch in stretches:
            steps += stretch_steps(partial(rates, dynamics, stretch), t, state, stretch, trial.period)
            t = steps[-1].end
            state = np.array(steps[-1].dense(t))
            state[0] = stretch.high
        greatest, least = (extreme(_near(steps, sign), sign)[1] for sign in (1.0, -1.0))
        return Revolution(float(state[1]), tuple(state[2:].tolist()), greatest, least)

    return revolve


def _near(steps: list[Step], sign: float) -> list[Step]:
    """Of many steps those beside ends that stand out as fastest (sign 1) or slowest (-1)."""
    if len(steps) < _MANY:
        return steps
    ends = np.array([steps[0].dense(steps[0].start)[1], *(step.dense(step.end)[1] for step in steps)])
    chosen = {j for k in standing_out(sign * ends) for j in (k - 1, k) if 0 <= j < len(steps)}
    return [steps[j] for j in sorted(chosen)]


# -- a cycle without reduction -----------------------------------------------------------------------------------------

_LONGER = (1.02, 1.3, 3.0, 10.0)  # than the period expected: how long the whole graph is simulated, until the cycle is over
_SLACK = (1.1, 1.5, 3.0, 10.0)  # the same of bodies with multipliers
_ANGLES = 13  # at which the inertia beside the bodies' own is compared
_EVEN_STEP = 1e-9
_STUCK = "the machine stops within its cycle"


def by_bond_graph(machine: Machine, rtol: float) -> Revolve:
    """Runs cycles by `bondgraph.simulate` on the machine's own graph, where every element has its own law."""
    scene = machine.scene

    def revolve(trial: Trial) -> Revolution:
        start = Start(0.0, trial.speed, trial.states)
        for longer in _LONGER:
            inertia = trial.inertia / scene.flywheel_ratio**2
            run = graph_motion(machine, start, longer * trial.period, inertia, trial.balance, rtol)

            def missing(t: float, run: Any = run) -> float:
                return float(run.displacement("phi", np.array([t]))[0]) - scene.cycle

            if missing(float(run.t[-1])) >= 0.0:
                break
        else:
            raise NoAnswerError(_STUCK)
        end, greatest, least = _end_and_extremes(missing, lambda times: np.asarray(run.flow("crank", times)), run.t)
        own = tuple(float(row[0]) for row in states_of_graph(scene, run, np.array([end])).values())
        return Revolution(float(run.flow("crank", np.array([end]))[0]), own, greatest, least)

    return revolve


def by_multipliers(machine: Machine, rtol: float, restart: bool) -> Revolve:
    """Runs cycles by `flywheel.multibody` on the machine's mechanism as a linkage.

    Joints are equations with multipliers, put back after every step. Loads come in as the torque at the crank that does the
    same work, and what turns in a constant ratio as inertia of the crank.
    """
    scene, mechanism = machine.scene, machine.scene.mechanisms[0]
    linkage, added = linkage_of(mechanism), _added_inertia(machine) or 0.0
    driven = linkage.joint(linkage.driver).second
    stretches = stretches_of(machine, restart)

    def revolve(trial: Trial) -> Revolution:
        more = trial.inertia + added
        links = (link._replace(inertia=link.inertia + more) if link.name == driven else link for link in linkage.links)
        heavier = replace(linkage, links=tuple(links))
        dynamics = dynamics_of(machine, trial.inertia, trial.balance)
        omega, extremes = trial.speed, list[float]()
        for stretch in stretches:

            def torque(t: float, q: float, qdot: float, stretch: Stretch = stretch) -> float:
                phi = q - mechanism.phase
                if stretch.middle is None:
                    phi = phi % scene.cycle
                    return float(dynamics.at(phi, float(machine.anchors(phi)), qdot).moment)
                return float(dynamics.at(phi, stretch.middle, qdot, ends=(stretch.low, stretch.high)).moment)

            expected = (stretch.high - stretch.low) / scene.cycle * trial.period
            start, last = stretch.low + mechanism.phase, stretch.high + mechanism.phase
            for longer in _SLACK:
                run = multibody.simulate(
                    heavier, multibody.MULTIPLIERS, start, omega, longer * expected, drive=torque, rtol=rtol
                )
                if run.q[-1] - mechanism.phase >= stretch.high:
                    break
            else:
                raise NoAnswerError(_STUCK)

            def missing(t: float, run: Any = run, last: float = last) -> float:
                return float(run.at(t)[0][0]) - last

            def speed(times: Array, run: Any = run) -> Array:
                return np.asarray(run.at(times)[1])

            end, *found = _end_and_extremes(missing, speed, run.t)
            omega = float(run.at(end)[1][0])
            extremes += found
        return Revolution(omega, (), max(extremes), min(extremes))

    return revolve


def _end_and_extremes(
    missing: Callable[[float], float], omega: Callable[[Array], Array], times: Array
) -> tuple[float, float, float]:
    """Time (s) at which a motion is over; the greatest and the least speed until then."""
    end = root(missing, 0.0, float(times[-1]))
    until = np.append(times[times < end], end)
    return end, _summit(omega, until, 1.0), _summit(omega, until, -1.0)


def obstacle(machine: Machine) -> str | None:
    """Reason why a machine cannot be run by multipliers; None where it can."""
    scene = machine.scene
    if len(scene.mechanisms) != 1:
        return "it takes machines with one mechanism"
    mechanism = scene.mechanisms[0]
    if not has_joints(mechanism):
        return f"a {mechanism.type} has no bodies to join"
    if scene.shafts[mechanism.shaft] != 1.0:
        return "it takes mechanisms that turn with the crank"
    if circuit_of(scene) is not None or any(value < 1.0 for value in scene.efficiencies.values()):
        return "it takes no motor's current and no losses in meshes"
    if machine.friction is not None:
        return "it takes joints without friction"
    if _added_inertia(machine) is None:
        return "it takes no inertia on ports beside the bodies' own"
    return None


def _added_inertia(machine: Machine) -> float | None:
    """Inertia on the crank (kg m²) beside the mechanism's bodies; None where it varies."""
    scene = machine.scene
    bare = Machine(replace(scene, inertias=(), loads=(), springs=(), dampers=(), drive=None, motor=None))
    phi = np.linspace(0.1, scene.cycle - 0.1, _ANGLES)
    total, own = (np.asarray(part.reduce(phi).inertia + 0.0 * phi) for part in (machine, bare))
    added = total - own
    return float(added.mean()) if np.ptp(added) <= _EVEN_STEP * (np.abs(total).max() + 1e-300) else None
