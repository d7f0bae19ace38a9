"""Direct dynamics of plane linkages by routes that share nothing with the reduced equation but the description.

All bodies keep their absolute coordinates, the pose x, y (m), theta (rad) of their centres of mass; joints are equations
between them. Every relation phi of two poses gives its value, its gradient, and its bend (phi_x v)_x v, the part of its
second time derivative that needs no accelerations: d²phi/dt² = phi_x a + bend.

>>> from flywheel.multibody import ROUTES
>>> ROUTES
('reduced', 'newton', 'multipliers', 'energy')
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from math import sqrt
from operator import mul
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.numerics import root
from flywheel.mechanisms.linkages.bodies import (
    COMPONENTS,
    LEAST_MARGIN,
    RANK,
    Closure,
    Interpolant,
    Law,
    LinkageActions,
    LinkageModel,
    LinkageMotion,
    LinkageState,
    ScaledValues,
    UnreachableError,
    Wrench,
    acceleration_sizes,
    accelerations,
    column_accelerations,
    components,
    coordinates,
    integrate,
    projection,
    system,
)
from flywheel.mechanisms.linkages.dry_friction import with_friction
from flywheel.mechanisms.linkages.equations import Poses, check
from flywheel.mechanisms.linkages.positions import solve_over
from flywheel.mechanisms.linkages.statics import unknowns
from flywheel.numerics.faults import (
    POSITIVE,
    Fault,
    SceneError,
    array,
    brief,
    name_faults,
    number_faults,
    refuse,
    require,
    vector,
)
from flywheel.scene.linkage import Linkage

__all__ = [
    "COMPONENTS", "ENERGY", "MULTIPLIERS", "NEWTON", "REDUCED", "ROUTES", "Law", "Run", "Wrench", "components",
    "simulate",
]  # fmt: skip

Array = NDArray[np.float64]


# -- equations of motion: Newton's law with reactions, Lagrange's multipliers -----------------------------------------


def by_newton(model: LinkageModel, t: Any, state: LinkageState) -> tuple[Array, Array]:
    """Accelerations and reactions together, from Newton's law of every body cut free.

    m a_G = sum F, J alpha = sum M_G for every body, with reactions as forces (`reaction_wrenches`), and
    the closure equations differentiated twice.

    Args:
        model: the linkage.
        t: time (s), or times (n,) of as many states.
        state: its position and velocity.

    Raises:
        UnreachableError: if they are not determined.

    Source: the worked four-bar in dependent coordinates of a course on mechanisms; E. J. Haug, Computer Aided Kinematics
    and Dynamics of Mechanical Systems, Allyn and Bacon 1989, chapter 6.

    """
    return accelerations(model, t, state, model.reaction_wrenches(state))


def by_multipliers(model: LinkageModel, t: Any, state: LinkageState) -> tuple[Array, Array]:
    """Accelerations and Lagrange's multipliers of the closure equations: M a - Phi_x^T lambda = Q, Phi_x a = gamma.

    A multiplier is the reaction itself: the force (N) or moment (N m) that does work on the quantity that its equation keeps
    at zero.

    Raises:
        UnreachableError: if they are not determined.

    Source: Haug as above; E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 2nd ed., section VII.1.

    """
    return accelerations(model, t, state, np.swapaxes(state.jacobian, -1, -2))


# -- the routes: which state each integrates, and how all bodies follow from it -----------------------------------------

REDUCED, NEWTON, MULTIPLIERS, ENERGY = "reduced", "newton", "multipliers", "energy"
ROUTES = (REDUCED, NEWTON, MULTIPLIERS, ENERGY)

_NUDGE = 1e-6  # of the way: where the slope of E/u² at the start is taken from


def by_driver(model: LinkageModel, q: float, qdot: float, until: float, rtol: float, newton: bool) -> LinkageMotion:
    """The driver's coordinate, speed and the work done as state; poses closed at every driver's coordinate.

    Its acceleration is that of one reduced equation, I* and M* by the closures' influence coefficients; or by Newton's law,
    together with all reactions.
    """
    loads = 1 + len(model.varying)
    interpolant = Interpolant(model, _newton_columns if newton else _reduced_columns)

    def rates(t: float, y: Array) -> Array:
        q, qdot, _ = y.tolist()
        columns = interpolant.at(q).tolist()
        amounts = model.load_amounts(t, q, qdot)
        moment = sum(map(mul, columns, amounts))
        if newton:
            acceleration = sum(map(mul, columns[loads:], amounts)) + columns[-1] * qdot**2
        else:
            acceleration = (moment - columns[-1] * qdot**2) / columns[-2]
        return np.array([qdot, acceleration, moment * qdot])

    atol = np.array([rtol * model.unit, rtol * model.unit, np.inf])
    steps = integrate(rates, np.array([q, qdot, 0.0]), until, rtol, atol)
    states = interpolant.states(steps.states[:, 0], steps.states[:, 1])

    def at(t: float) -> tuple[float, float]:
        q, qdot, _ = steps.at(t).tolist()
        return q, qdot

    reactions = by_newton(model, steps.s, states)[1] if newton else None
    return LinkageMotion(steps.s, states, steps.states[:, 2], steps.evaluations, 0.0, at, reactions)


def _reduced_columns(model: LinkageModel, state: LinkageState) -> ScaledValues:
    """M* of every column of loads, I* and ½ dI*/dq, of poses with the velocities g = dx/dq."""
    columns, momentum = model.load_columns(state), model.masses * state.v
    slope = model.driven(state, state.along, state.gamma, -state.bend)  # g' = d²x/dq²
    inertia, half = (momentum * state.v).sum(axis=1), (momentum * slope).sum(axis=1)
    for one, place in zip(inertia.tolist(), state.q.tolist(), strict=True):
        model.heavy(one, place)
    greatest = inertia.max()
    sizes = np.einsum("ni,nic->nc", np.abs(state.v), np.abs(columns)).max(axis=0)
    values = np.column_stack((np.einsum("ni,nic->nc", state.v, columns), inertia, half))
    return values, np.append(sizes, (greatest, greatest / model.unit))


def _newton_columns(model: LinkageModel, state: LinkageState) -> ScaledValues:
    """M* of every column of loads, then the driver's acceleration by each and by its own speed's square."""
    columns = model.load_columns(state)
    none = np.zeros((*columns.shape[:2], 0))
    right, solution, alpha = column_accelerations(model, columns, state, model.reaction_wrenches(state), none)
    values = np.concatenate((np.einsum("ni,nic->nc", state.v, columns), alpha), axis=1)
    work = np.einsum("ni,nic->nc", np.abs(state.v), np.abs(columns)).max(axis=0)
    return values, np.concatenate((work, acceleration_sizes(model, right, solution)))


def in_all_coordinates(model: LinkageModel, q: float, qdot: float, until: float, rtol: float) -> LinkageMotion:
    """All coordinates and velocities as a differential-algebraic system of index 1, projected after every step.

    The motion keeps to its assembly in both directions of the driver: the determinant over its own last tangent keeps its
    sign. Source: E. L. Allgower, K. Georg, Numerical Continuation Methods, Springer 1990, chapter 8.
    """
    x, g = Closure(model).at(q)
    n = x.size
    drifts = [0.0]
    last, tangent = model.state(x, g), g / model.scale**2
    matrix, right = system(model, np.zeros(n), last, last.jacobian.T)  # filled anew at every state

    def rates(t: float, y: Array) -> Array:
        state = model.state(y[:n], y[n : 2 * n])
        forces = model.forces(t, state)
        matrix[:n, n:], matrix[n:, :n], right[:n], right[n:] = -state.jacobian.T, state.jacobian, forces, state.gamma
        derivative = np.empty_like(y)
        derivative[:n], derivative[n : 2 * n], derivative[2 * n] = state.v, model.solved(matrix, right)[:n], state.v @ forces
        return derivative

    def correct(y: Array) -> Array:
        nonlocal last, tangent
        state, drift = projection(model, y[:n], y[n : 2 * n])
        drifts.append(drift)
        if model.sense(state, tangent) != model.sense(last, tangent) or model.margin(state, tangent) < LEAST_MARGIN:
            raise model.branched(float(last.q))
        last, tangent = state, model.influence(state, tangent) / model.scale**2
        return np.concatenate((state.x, state.v, y[2 * n :]))

    atol = rtol * np.concatenate((model.scale, model.scale, [np.inf]))
    steps = integrate(rates, np.concatenate((x, g * qdot, [0.0])), until, rtol, atol, correct)
    states = model.state(steps.states[:, :n], steps.states[:, n : 2 * n])

    def at(t: float) -> tuple[float, float]:
        y = steps.at(t)
        state = projection(model, y[:n], y[n : 2 * n])[0]
        return float(state.q), float(state.qdot)

    reactions = by_multipliers(model, steps.s, states)[1]
    return LinkageMotion(steps.s, states, steps.states[:, 2 * n], steps.evaluations, max(drifts), at, reactions)


def by_energy(model: LinkageModel, q: float, qdot: float, until: float, rtol: float) -> LinkageMotion:
    """Energy and time as state over the driver's way u, q = start + sense u, until the time is reached or passed.

    E = ½ I* omega² obeys dE/dq = M*(t, q, omega): where torques depend on position alone, E is the work done; then t =
    integral of dq/omega. Only first influence coefficients are needed. omega has to keep its sign. From rest q = start +
    sense u², in which y = E/u² and omega/u are smooth: dy/du = (2/u)(sense M* - y), dt/du = 2u/omega.
    """
    interpolant, rest = Interpolant(model, _energy_columns), qdot == 0.0

    def moment_by(columns: list[float], t: float, q: float, qdot: float) -> float:
        return float(sum(map(mul, columns, model.load_amounts(t, q, qdot))))

    *parts, inertia = interpolant.at(q).tolist()
    moment = moment_by(parts, 0.0, q, qdot)
    if rest and moment == 0.0:
        raise SceneError([Fault("qdot", "a machine at rest that nothing moves", "a speed, or a load that moves it")])
    sense = float(np.sign(qdot or moment))
    begin, growth = 0.5 * inertia * qdot**2, 0.0
    if rest:  # the first step alone sees the slope of E/u² at 0: two thirds of that of M* along the motion, by a difference
        begin = abs(moment)
        rate = sqrt(2 * begin / inertia)
        near = q + sense * _NUDGE**2
        ahead = moment_by(interpolant.at(near).tolist(), 2 * _NUDGE / rate, near, sense * _NUDGE * rate)
        growth = 2 / 3 * (sense * ahead - begin) / _NUDGE

    def moving(u: float, y: float) -> tuple[float, list[float], float]:
        """Driver's coordinate, quantities there, and |omega|, or |omega|/u from rest: sqrt(2 y/I*)."""
        place = q + sense * (u * u if rest else u)
        if not y > 0.0:
            defect = f"a motion that stops at {model.where(place)}"
            advice = "take another route, or end before"
            raise UnreachableError(Fault("route", defect, "a speed that keeps its sign on the energy route", advice))
        parts = interpolant.at(place).tolist()
        return place, parts, sqrt(2 * y / parts[-1])

    def rates(u: float, both: Array) -> Array:
        y, t = both.tolist()
        place, parts, speed = moving(u, y)
        push = sense * moment_by(parts, t, place, sense * speed * (u if rest else 1.0))
        if not rest:
            return np.array([push, 1 / speed])
        return np.array([2 / u * (push - y) if u > 0.0 else growth, 2 / speed])

    atol = np.array([0.0, rtol * until])
    steps = integrate(rates, np.array([begin, 0.0]), np.inf, rtol, atol, None, lambda both: both[1] >= until)

    def driver(u: float, y: float) -> tuple[float, float]:
        place, _, speed = moving(u, y)
        return place, sense * speed * (u if rest else 1.0)

    def at(t: float) -> tuple[float, float]:
        if not t > 0.0:
            return q, qdot
        k = min(max(int(np.searchsorted(steps.states[:, 1], t)), 1), len(steps.s) - 1)
        u = float(steps.s[k - 1])
        if steps.states[k - 1, 1] < t:
            u = root(lambda u: float(steps.at(u)[1]) - t, u, float(steps.s[k]))
        return driver(u, float(steps.at(u)[0]))

    t = np.append(steps.states[:-1, 1], until)
    instants = [driver(float(u), float(both[0])) for u, both in zip(steps.s[:-1], steps.states[:-1], strict=True)]
    states = interpolant.states(*np.array([*instants, at(until)]).T)
    return LinkageMotion(t, states, None, steps.evaluations, 0.0, at)


def _energy_columns(model: LinkageModel, state: LinkageState) -> ScaledValues:
    """M* of every column of loads, and I*."""
    columns, inertia = model.load_columns(state), (model.masses * state.v**2).sum(axis=1)
    for one, place in zip(inertia.tolist(), state.q.tolist(), strict=True):
        model.heavy(one, place)
    sizes = np.einsum("ni,nic->nc", np.abs(state.v), np.abs(columns)).max(axis=0)
    return np.column_stack((np.einsum("ni,nic->nc", state.v, columns), inertia)), np.append(sizes, inertia.max())


# -- the call -------------------------------------------------------------------------------------------------------------


class Run(NamedTuple):
    """A simulated motion at the integrator's own times.

    t (s), q (rad or m, not reduced), qdot; `coordinates`, `velocities`: x_G, y_G, theta of every moving body and their
    rates, shape (times, bodies, 3). `reactions`: by joint, a column for each of `multibody.COMPONENTS` (N, N m), NaN if
    redundant constraints leave them open; None on routes that do not compute them. `closure`: largest closure residual (m or
    rad) of the poses given; `drift`: largest one that a step left before it was put back (0 if poses are closed at
    every step). `energy_residual`: largest |kinetic energy gained - work| over the largest kinetic energy, friction's work
    included; None on the energy route, which has no other energy. `evaluations`: of the rates. `at(t)`: (q, qdot) at any
    times within.

    Of joints with friction: `friction`, by joint or coupling, its action on the second body along the joint's coordinate
    (N m in a pin, N elsewhere); `friction_work` (J) since the start, below 0. `rests`: start and end (s) of each standstill:
    friction and reactions are not determined then (NaN); `messages`: where friction holds or locks it to the end. A time
    stands twice where a piece of the motion ends and another begins: before and after a joint reverses, or the machine
    stops.
    """

    route: str
    t: Array
    q: Array
    qdot: Array
    coordinates: Array
    velocities: Array
    reactions: Mapping[str, Array] | None
    drift: float
    closure: float
    energy_residual: float | None
    evaluations: int
    at: Callable[[ArrayLike], tuple[Array, Array]]
    friction: Mapping[str, Array]
    friction_work: Mapping[str, Array]
    rests: tuple[tuple[float, float], ...]
    messages: tuple[str, ...]


def simulate(
    linkage: Linkage,
    route: str,
    q: float,
    qdot: float,
    until: float,
    *,
    gravity: tuple[float, float] | None = None,
    drive: Law = 0.0,
    wrenches: Iterable[Wrench] = (),
    rtol: float = 1e-10,
    start: Poses | None = None,
) -> Run:
    """Motion of a linkage from a position and a speed of its driver, in absolute coordinates of all bodies.

    Args:
        linkage: bodies, joints, couplings. Friction in pins, slides, slots and cams is that of
            `flywheel.mechanisms.linkages.statics`, with the reactions of the same instant, which `newton` and `multipliers`
            compute; the other routes refuse it.
        route: `reduced` (one equation for the driver), `newton` (poses closed at every driver's coordinate, accelerations
            and reactions together from Newton's law), `multipliers` (all coordinates as a differential-algebraic system of
            index 1, put back onto the closures after every step), `energy` (work over the way, then time; the driver's
            speed keeps its sign).
        q: the driver's coordinate at t = 0, rad, or m where it slides.
        qdot: its rate, rad/s or m/s; it may be zero.
        until: time to simulate, s.
        gravity: components along x and y, m/s²; none if None.
        drive: torque (N m) or force (N) at the driver's joint, on its second body and back on its first; a number or a
            function of (t, q, qdot). It should be smooth: steps are not restarted at jumps.
        wrenches: external actions on bodies.
        rtol: tolerance of the integrator, per step.
        start: poses whose first one is taken instead of the assembly that the linkage's guesses and sides choose.

    Raises:
        SceneError: if an argument is no finite number or of another type, where the linkage is not valid, locks or branches,
            where friction locks it while it moves or meets a route without reactions, or where it stops on the energy route.

    >>> from flywheel.scene.linkage import Joint, Link, Linkage, Point
    >>> o = Point("o")
    >>> rotor = Linkage(Link("frame", (o,)), (Link("rotor", (o,), inertia=2.0),),
    ...                 (Joint("pivot", "pin", "frame", "rotor", o, o),), "pivot")
    >>> run = simulate(rotor, "newton", 0.0, 0.0, 3.0, drive=6.0)
    >>> round(float(run.q[-1]), 9), round(float(run.qdot[-1]), 9)
    (13.5, 9.0)

    """
    check(linkage)
    faults = [*name_faults("route", route, dict.fromkeys(ROUTES)), *number_faults("q", q), *number_faults("qdot", qdot)]
    refuse([*faults, *number_faults("until", until, POSITIVE), *number_faults("rtol", rtol, POSITIVE)])
    if start is not None:
        require("start", start, Poses, "Poses")
    actions = _actions(linkage, gravity, drive, wrenches)
    if start is None:
        start = solve_over(linkage, (linkage.start, q)).poses(q)
    if linkage.rubs:
        unknowns(start, (), np.ones(start.q.shape), True)  # names what friction lacks
        if route not in (NEWTON, MULTIPLIERS):
            defect = f"{route} for joints with friction, which follows from reactions"
            raise SceneError([Fault("route", defect, f"{NEWTON} or {MULTIPLIERS}, which find them")])
    model = LinkageModel(linkage, actions, coordinates(start))
    try:
        if linkage.rubs:
            solution = with_friction(model, q, qdot, until, rtol, route == NEWTON)
        elif route in (REDUCED, NEWTON):
            solution = by_driver(model, q, qdot, until, rtol, route == NEWTON)
        else:
            solution = (in_all_coordinates if route == MULTIPLIERS else by_energy)(model, q, qdot, until, rtol)
        states = solution.states
        reactions = None if solution.reactions is None else _reactions(model, states, solution.reactions)
    except UnreachableError as error:
        raise SceneError([error.fault]) from None
    residual = None
    if solution.work is not None:
        kinetic = 0.5 * (states.v**2 @ model.masses)
        work = solution.work + sum(solution.friction_work.values())
        residual = float(np.abs(kinetic - kinetic[0] - work).max() / max(float(kinetic.max()), 1e-300))

    def at(times: ArrayLike) -> tuple[Array, Array]:
        rows = np.array([solution.at(float(t)) for t in np.atleast_1d(array("times", times))]).reshape(-1, 2)
        return rows[:, 0], rows[:, 1]

    return Run(
        route,
        solution.t,
        states.q,
        states.qdot,
        states.x.reshape(solution.t.size, -1, 3),
        states.v.reshape(solution.t.size, -1, 3),
        reactions,
        drift=solution.drift,
        closure=float(np.abs(states.value).max(initial=0.0)),
        energy_residual=residual,
        evaluations=solution.evaluations,
        at=at,
        friction=solution.friction,
        friction_work=solution.friction_work,
        rests=solution.rests,
        messages=solution.messages,
    )


def _actions(
    linkage: Linkage, gravity: tuple[float, float] | None, drive: Law, wrenches: Iterable[Wrench]
) -> LinkageActions:
    """All actions; SceneError for laws that are no numbers or functions, for friction, for bodies that do not move."""
    if isinstance(wrenches, Wrench) or not isinstance(wrenches, Iterable):
        raise SceneError([Fault("wrenches", brief(wrenches), "a list of Wrench")])
    loads = tuple(wrenches)
    laws: dict[str, Law] = {"drive": drive}
    for k, wrench in enumerate(loads):
        path = f"wrenches[{k}]"
        require(path, wrench, Wrench, "a Wrench")
        if wrench.at is not None and not isinstance(wrench.at, str):
            vector(f"{path}.at", wrench.at, "m")
        if not isinstance(wrench.force, (tuple, list)) or len(wrench.force) != 2:
            raise SceneError([Fault(f"{path}.force", brief(wrench.force), "two laws, along x and y")])
        laws |= {f"{path}.force[{k}]": law for k, law in enumerate(wrench.force)} | {f"{path}.torque": wrench.torque}
    refuse([fault for path, law in laws.items() if not callable(law) for fault in number_faults(path, law)])
    actions = LinkageActions((0.0, 0.0) if gravity is None else vector("gravity", gravity, "m/s²"), drive, loads)
    faults = list[Fault]()
    moving = [link.name for link in linkage.links]
    for k, wrench in enumerate(loads):
        if wrench.body not in moving:
            faults.append(Fault(f"wrenches[{k}].body", repr(wrench.body), f"a moving body: {', '.join(moving)}"))
            continue
        points = [point.name for point in linkage.link(wrench.body).points]
        if isinstance(wrench.at, str) and wrench.at not in points:
            expected = f"a point of {wrench.body}: {', '.join(points)}"
            faults.append(Fault(f"wrenches[{k}].at", repr(wrench.at), expected))
    refuse(faults)
    return actions


def _reactions(model: LinkageModel, states: LinkageState, table: Array) -> dict[str, Array]:
    """Reactions by joint; NaN if a redundant linkage leaves them open: those with a part in the null space of Phi_x^T."""
    if model.redundant:
        left, sizes, _ = np.linalg.svd(states.jacobian)
        null = np.ones(left.shape[::2], dtype=bool)
        null[:, : sizes.shape[1]] = sizes <= RANK * sizes.max(axis=1, keepdims=True)
        table = np.where((np.abs(left) * null[:, None]).max(axis=2) > RANK, np.nan, table)
    names = [joint for joint, _ in components(model.linkage)]
    return {name: table[:, [k for k, joint in enumerate(names) if joint == name]] for name in dict.fromkeys(names)}
