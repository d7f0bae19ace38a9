"""A linkage's motion under its loads, by any of four routes, with what tells how good it is."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.arguments import POSITIVE, array, name_faults, number_faults, refuse, require, shown, vector
from flywheel.faults import Fault, SceneError
from flywheel.linkage.checks import check
from flywheel.linkage.description import Linkage
from flywheel.linkage.poses import Poses
from flywheel.multibody.closure import UnreachableError
from flywheel.multibody.model import Actions, Law, Model, State, Wrench, components, coordinates, model, undetermined
from flywheel.multibody.routes import FOLLOW, Followed, Start

Array = NDArray[np.float64]

ROUTES = tuple(FOLLOW)
_RANK = 1e-9


class Run(NamedTuple):
    """A simulated motion at the integrator's own times.

    t (s), q (rad or m, not reduced), qdot; `coordinates`, `velocities`: x_G, y_G, theta of every moving body and their
    rates, shape (times, bodies, 3). `reactions`: by joint, a column for each of `multibody.COMPONENTS` (N, N m), NaN where
    redundant constraints leave them open; None on routes that do not find them. `closure`: largest closure residual (m or
    rad) of the poses given; `drift`: largest one that a step left before it was put back (0 where poses are closed at
    every step). `energy_residual`: largest |kinetic energy gained - work| over the largest kinetic energy; None on the
    energy route, which has no other energy. `evaluations`: of the rates. `at(t)`: (q, qdot) at any times within.
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
        linkage: bodies, joints, couplings; joints with friction are refused.
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
        wrenches: what acts on bodies from outside.
        rtol: tolerance of the integrator, per step.
        start: poses whose first one is taken instead of the assembly that the linkage's guesses and sides choose.

    Raises:
        SceneError: where an argument is no finite number or of another type, where the linkage is ill described, locks or
            branches, has friction, or stops on the energy route.

    >>> from flywheel.linkage.description import Joint, Link, Linkage, Point
    >>> o = Point("o")
    >>> rotor = Linkage(Link("frame", (o,)), (Link("rotor", (o,), inertia=2.0),),
    ...                 (Joint("pivot", "pin", "frame", "rotor", o, o),), "pivot")
    >>> run = simulate(rotor, "newton", 0.0, 0.0, 3.0, drive=6.0)
    >>> round(float(run.q[-1]), 9), round(float(run.qdot[-1]), 9)
    (13.5, 9.0)

    """
    check(linkage)
    faults = [*name_faults("route", route, FOLLOW), *number_faults("q", q), *number_faults("qdot", qdot)]
    refuse([*faults, *number_faults("until", until, POSITIVE), *number_faults("rtol", rtol, POSITIVE)])
    if start is not None:
        require("start", start, Poses, "Poses")
    prepared = model(linkage, _actions(gravity, drive, wrenches))
    x = coordinates(start if start is not None else _assembled(linkage, q))
    jacobian = prepared.state(x, np.zeros_like(x)).jacobian
    prepared = replace(prepared, redundant=bool(np.linalg.matrix_rank(jacobian, rtol=_RANK) < len(jacobian)))
    try:
        return _run(prepared, route, FOLLOW[route](prepared, Start(x, q, qdot), until, rtol))
    except UnreachableError as error:
        raise SceneError([error.fault]) from None


def _actions(gravity: tuple[float, float] | None, drive: Law, wrenches: Iterable[Wrench]) -> Actions:
    """All actions, laws that are no finite numbers or functions refused."""
    if isinstance(wrenches, Wrench) or not isinstance(wrenches, Iterable):
        raise SceneError([Fault("wrenches", shown(wrenches), "a list of Wrench")])
    given = tuple(wrenches)
    laws = {"drive": drive}
    for k, wrench in enumerate(given):
        require(f"wrenches[{k}]", wrench, Wrench, "a Wrench")
        laws |= _laws(f"wrenches[{k}]", wrench)
    refuse([fault for path, law in laws.items() if not callable(law) for fault in number_faults(path, law)])
    return Actions((0.0, 0.0) if gravity is None else vector("gravity", gravity, "m/s²"), drive, given)


def _laws(path: str, wrench: Wrench) -> dict[str, Law]:
    """The three laws of a wrench, its place checked."""
    if wrench.at is not None and not isinstance(wrench.at, str):
        vector(f"{path}.at", wrench.at, "m")
    if not isinstance(wrench.force, (tuple, list)) or len(wrench.force) != 2:
        raise SceneError([Fault(f"{path}.force", shown(wrench.force), "two laws, along x and y")])
    return {f"{path}.force[0]": wrench.force[0], f"{path}.force[1]": wrench.force[1], f"{path}.torque": wrench.torque}


def _assembled(linkage: Linkage, q: float) -> Poses:
    from flywheel.linkage.solution import solve_over  # only motions without given poses need it

    return solve_over(linkage, (linkage.start, q)).poses(q)


def _run(prepared: Model, route: str, found: Followed) -> Run:
    """What a motion says at its own times."""
    states = [found.state(float(t)) for t in found.t]
    poses, paces = _over(states, 0), _over(states, 5)

    def at(times: ArrayLike) -> tuple[Array, Array]:
        wanted = [found.state(float(t)) for t in np.atleast_1d(array("times", times))]
        return _driver(wanted)

    return Run(
        route,
        found.t,
        *_driver(states),
        poses,
        paces,
        reactions=_reactions(prepared, found, states),
        drift=found.drift,
        closure=max(float(np.abs(state.value).max(initial=0.0)) for state in states),
        energy_residual=_energy_residual(prepared, paces, found.work),
        evaluations=found.evaluations,
        at=at,
    )


def _over(states: list[State], first: int) -> Array:
    """Three fields of every moving body's place, from `first` on."""
    return np.array([[place[first : first + 3] for place in state.places[1:]] for state in states])


def _driver(states: list[State]) -> tuple[Array, Array]:
    return np.array([state.q for state in states]), np.array([state.qdot for state in states])


def _energy_residual(prepared: Model, paces: Array, work: Array | None) -> float | None:
    if work is None:
        return None
    kinetic = 0.5 * (paces.reshape(len(paces), -1) ** 2 @ prepared.masses)
    return float(np.abs(kinetic - kinetic[0] - work).max() / max(float(kinetic.max()), 1e-300))


def _reactions(prepared: Model, found: Followed, states: list[State]) -> dict[str, Array] | None:
    """Reactions by joint, those left open as NaN."""
    if found.law is None:
        return None
    rows = [found.law(prepared, float(t), state).reactions for t, state in zip(found.t, states, strict=True)]
    if prepared.redundant:
        rows = [np.where(undetermined(state.jacobian), np.nan, row) for row, state in zip(rows, states, strict=True)]
    table, names = np.array(rows), [joint for joint, _ in components(prepared.linkage)]
    return {name: table[:, [k for k, joint in enumerate(names) if joint == name]] for name in dict.fromkeys(names)}
