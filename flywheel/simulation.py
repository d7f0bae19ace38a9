"""Motion of a machine from any state, by time stepping."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel import regime
from flywheel.advice import told
from flywheel.faults import Fault, SceneError
from flywheel.machine import Machine
from flywheel.scene import Scene
from flywheel.state import own_coordinate
from flywheel.stepping import TIGHTEST, Rates, Step, Tolerance, reduced_at, through

if TYPE_CHECKING:
    from bondgraph.motion.simulation import Run

Array = NDArray[np.float64]

_MOST_STEPS = 1_000_000


class Motion(NamedTuple):
    """A simulated motion at the integrator's own times: t (s), crank angle phi (rad, not reduced), omega (rad/s).

    `work` is that of M* since the start (J) and `energy_residual` the largest |kinetic energy gained - work| over the
    largest kinetic energy. `at(t)` gives (phi, omega) at any times within, by dense output. Where shafts twist, `work` is
    that of loads and drive and `run` the motion of the whole bond graph, with every flow, effort and its power audit.

    On a stroke phi is the driver's coordinate (x in m and omega in m/s where it slides). The motion ends where the stroke
    does, and `ended` says so; it is None for a motion that lasts until the time asked. `at` refuses later times.
    """

    t: Array
    phi: Array
    omega: Array
    work: Array
    energy_residual: float
    at: Callable[[Any], tuple[Array, Array]]
    run: Run | None = None
    ended: str | None = None


def simulate(
    machine: Machine | Scene,
    phi: float,
    omega: float,
    until: float,
    *,
    inertia: float | None = None,
    balance: float | None = None,
    rtol: float = 1e-10,
) -> Motion:
    """Motion of a machine from a given state for a given time, from (J + I*) alpha + ½ dI*/dphi omega² = M*.

    A machine with compliant shafts has more than one angle: its whole bond graph is followed, from a state without twist.
    A machine with a stroke is followed until it reaches one of the stroke's ends.

    Args:
        machine: a `Machine`, or a `Scene`, of which one is then built.
        phi: crank angle at t = 0, rad. On a stroke the driver's coordinate, rad, or m where it slides.
        omega: crank speed at t = 0, rad/s; it may be zero, and the machine may stop and turn back. On a stroke the driver's
            speed, m/s where it slides.
        until: time to simulate, s.
        inertia: the flywheel's, kg m² at its own shaft; the scene's own (0 when it asks for a sizing) if None. On a stroke
            what moves with the driver beside the machine: 0 if None, kg where it slides.
        balance: value (SI) of the scene's unknown; if None the one that balances the cycle (with rigid shafts).
        rtol: tolerance of the integrator, per step; where shafts twist, of the whole motion.

    Raises:
        SceneError: if I* + J vanishes somewhere, so that the motion is not determined; if the machine starts outside its
            stroke, or at an end of it that it is pushed out of.

    >>> import flywheel
    >>> rotor = {"inertia": [{"on": "crank", "value": 2}], "drive": {"torque": 6}, "regime": {"speed": 1},
    ...          "flywheel": {"inertia": 1}}
    >>> motion = flywheel.simulate(flywheel.load(rotor), phi=0, omega=0, until=3)
    >>> round(float(motion.omega[-1]), 9), round(float(motion.phi[-1]), 9)
    (6.0, 9.0)

    """
    if not isinstance(machine, Machine):
        machine = Machine(machine)
    _check_arguments(phi, omega, until, rtol)
    scene = machine.scene
    own = (scene.inertia or 0.0) if inertia is None else inertia
    total = own * scene.flywheel_ratio**2
    if balance is None and scene.unknown is not None:
        rigid = machine if not scene.compliances else Machine(replace(scene, compliances={}))
        balance = regime.settled_balance(rigid)
    if scene.compliances:
        from flywheel.whole import followed

        return _of_run(followed(machine, phi, omega, until, own, balance or 0.0, rtol))
    if scene.stroke is not None:
        phi = float(own_coordinate(scene, np.asarray(phi, dtype=float)))
    steps, turns = _followed(machine, phi, omega, until, total, balance or 0.0, max(rtol, TIGHTEST))
    motion = _as_motion(machine, steps, turns, total)
    return motion if scene.stroke is None else _on_stroke(motion, scene, until)


def _on_stroke(motion: Motion, scene: Scene, until: float) -> Motion:
    """The motion in the driver's own coordinate, with a word on its end if that came early."""
    assert scene.stroke is not None
    start, end, last = scene.stroke.start, scene.stroke.end, float(motion.t[-1])
    phi = np.clip(motion.phi + start, start, end)  # rounding aside, it is there already
    where = told(float(phi[-1]), scene.stroke.sliding)
    ended = None if last >= until else f"the driver reached the stroke's end at {where} after {last:.6g} s"

    def at(times: Any) -> tuple[Array, Array]:
        if np.any(np.asarray(times) > last):
            raise SceneError([Fault("t", f"{np.max(times):.6g} s", f"times up to {last:.6g} s", ended or "")])
        found, speed = motion.at(times)
        return np.clip(found + start, start, end), speed

    return motion._replace(phi=phi, at=at, ended=ended)


def _of_run(run: Run) -> Motion:
    """What a run of the whole graph says of the crank."""

    def at(times: Any) -> tuple[Array, Array]:
        wanted = np.atleast_1d(np.asarray(times, dtype=float))
        return run.displacement("phi", wanted), run.flow("crank", wanted)

    return Motion(run.t, *at(run.t), run.audit.supplied, run.audit.energy, at, run)


def _check_arguments(phi: float, omega: float, until: float, rtol: float) -> None:
    finite = {"phi": phi, "omega": omega, "until": until, "rtol": rtol}
    faults = [Fault(name, f"{value}", "a finite number") for name, value in finite.items() if not np.isfinite(value)]
    positive = {"until": until, "rtol": rtol}
    faults += [Fault(name, f"{value}", "a number above 0") for name, value in positive.items() if value <= 0.0]
    if faults:
        raise SceneError(faults)


def _followed(
    machine: Machine, phi: float, omega: float, until: float, inertia: float, balance: float, rtol: float
) -> tuple[list[Step], list[float]]:
    """Piece after piece in either direction; phi is reduced to one cycle, `turns` adds back what was taken off."""
    cycle, ends = machine.scene.cycle, machine.restarts
    offset = float(np.floor(phi / cycle)) * cycle if machine.scene.stroke is None else 0.0
    t, state = 0.0, np.array([phi - offset, omega, 0.0])
    steps: list[Step] = []
    turns: list[float] = []
    hint: float | None = None
    while t < until:
        _check_friction(machine, t, float(state[1]))
        if machine.scene.stroke is not None and _leaves(machine, state, inertia, balance):
            break
        piece, state[0], shift = _piece(machine, state, inertia, balance)
        offset += shift
        low, high = float(ends[piece]), float(ends[piece + 1])
        rates = _rates(machine, 0.5 * (low + high), inertia, balance, (low, high))
        tolerance = Tolerance(rtol, np.array([rtol * cycle, rtol * max(abs(omega), 1e-3), rtol]))
        passed = list(through(rates, t, state, (low, high), until, tolerance, hint))
        steps += passed
        turns += [offset] * len(passed)
        t, hint = passed[-1].end, max(step.end - step.start for step in passed)
        state = np.array(passed[-1].dense(t))
        if t < until:
            state[0] = high if abs(state[0] - high) < abs(state[0] - low) else low
        if len(steps) > _MOST_STEPS:
            raise SceneError([Fault("until", f"{until:g} s", f"a shorter time: {_MOST_STEPS} steps reach {t:g} s")])
    if not steps:
        found = f"a machine at {machine.where(phi)}, the stroke's end, that moves on or is pushed out of it"
        raise SceneError([Fault("simulation", found, "a start from which it moves along its stroke")])
    return steps, turns


def _leaves(machine: Machine, state: Array, inertia: float, balance: float) -> bool:
    """Whether a machine stands at an end of its stroke and is about to leave it."""
    phi, omega = float(state[0]), float(state[1])
    outwards = {0.0: -1.0, machine.scene.cycle: 1.0}.get(phi)
    if outwards is None:
        return False
    if omega == 0.0:
        middle = 0.5 * float(machine.restarts[:2].sum() if phi == 0.0 else machine.restarts[-2:].sum())
        omega = float(_rates(machine, middle, inertia, balance, None)(0.0, state)[1])
    return omega * outwards > 0.0


def _piece(machine: Machine, state: Array, inertia: float, balance: float) -> tuple[int, float, float]:
    """The piece that the motion goes on in, the angle within the cycle there, and what was taken off it."""
    ends, cycle = machine.restarts, machine.scene.cycle
    phi, omega = float(state[0]), float(state[1])
    turn = cycle if machine.scene.stroke is None else 0.0  # nothing comes round again on a stroke
    forwards = omega > 0.0
    if omega == 0.0:
        forward = min(max(int(np.searchsorted(ends, phi, side="right")) - 1, 0), ends.size - 2)
        middle = 0.5 * float(ends[forward] + ends[forward + 1])
        forwards = _rates(machine, middle, inertia, balance, None)(0.0, state)[1] >= 0.0
    if forwards:
        shift = turn if phi >= cycle else 0.0
        return min(int(np.searchsorted(ends, phi - shift, side="right")) - 1, ends.size - 2), phi - shift, shift
    shift = -turn if phi <= 0.0 else 0.0
    return max(int(np.searchsorted(ends, phi - shift, side="left")) - 1, 0), phi - shift, shift


def _rates(machine: Machine, middle: float, inertia: float, balance: float, ends: tuple[float, float] | None) -> Rates:
    """d(phi, omega, work)/dt within the piece around `middle`."""

    def rates(t: float, state: Array) -> Array:
        phi, omega = state[0], state[1]
        total, slope, moment = reduced_at(machine, phi, middle, balance, ends)
        total += inertia
        if not total > 0.0:
            raise SceneError([_weightless(machine, phi, total)])
        return np.array([omega, (moment - 0.5 * slope * omega * omega) / total, moment * omega])

    return rates


def _weightless(machine: Machine, phi: float, total: float) -> Fault:
    where = machine.where(phi)
    if machine.scene.stroke is None:
        return Fault(
            "flywheel.inertia", f"I* + J = {total:g} kg m² at {where}", "a positive inertia everywhere", "add inertia"
        )
    name, unit = ("m*", "kg") if machine.scene.stroke.sliding else ("I*", "kg m²")
    return Fault(
        "inertia", f"{name} = {total:g} {unit} at {where}", "a positive one all along the stroke", "add [[inertia]]"
    )


def _check_friction(machine: Machine, t: float, omega: float) -> None:
    """Refuse to follow a motion that turns back where joints rub: their friction is known for one sense alone."""
    stroke = machine.scene.stroke
    sense = 1.0 if stroke is None or stroke.speed > 0.0 else -1.0
    if machine.friction is not None and omega * sense < 0.0:
        found = f"a motion that turns back by {t:.6g} s, with friction in joints"
        expected = "one that keeps the sense for which that friction was found"
        raise SceneError([Fault("until", found, expected, "a shorter time, or leave friction out")])


def _as_motion(machine: Machine, steps: list[Step], turns: list[float], inertia: float) -> Motion:
    ends = np.array([step.end for step in steps])
    states = np.array([steps[0].dense(steps[0].start), *(step.dense(step.end) for step in steps)])
    shifts = np.array([turns[0], *turns])
    t = np.concatenate(([steps[0].start], ends))
    kinetic = 0.5 * (inertia + _inertia(machine, states[:, 0])) * states[:, 1] ** 2
    residual = np.abs(kinetic - kinetic[0] - states[:, 2]).max() / max(float(kinetic.max()), 1e-300)

    def at(times: Any) -> tuple[Array, Array]:
        wanted = np.atleast_1d(np.asarray(times, dtype=float))
        which = np.clip(np.searchsorted(ends, wanted), 0, ends.size - 1)
        found = np.array([steps[k].dense(time)[:2] for k, time in zip(which, wanted, strict=True)])
        return found[:, 0] + np.array(turns)[which], found[:, 1]

    return Motion(t, states[:, 0] + shifts, states[:, 1], states[:, 2], float(residual), at)


def _inertia(machine: Machine, phi: Array) -> Array:
    inside = np.clip(phi, 0.0, machine.scene.cycle)
    return np.asarray(machine.reduce(inside).inertia + np.zeros_like(inside))
