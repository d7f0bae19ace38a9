"""Motion of a machine from any state, by time stepping."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel import regime
from flywheel.faults import Fault, SceneError
from flywheel.machine import Machine
from flywheel.scene import Scene
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
    """

    t: Array
    phi: Array
    omega: Array
    work: Array
    energy_residual: float
    at: Callable[[Any], tuple[Array, Array]]
    run: Run | None = None


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

    Args:
        machine: a `Machine`, or a `Scene`, of which one is then built.
        phi: crank angle at t = 0, rad.
        omega: crank speed at t = 0, rad/s; it may be zero, and the machine may stop and turn back.
        until: time to simulate, s.
        inertia: the flywheel's, kg m² at its own shaft; the scene's own (0 when it asks for a sizing) if None.
        balance: value (SI) of the scene's unknown; if None the one that balances the cycle (with rigid shafts).
        rtol: tolerance of the integrator, per step; where shafts twist, of the whole motion.

    Raises:
        SceneError: if I* + J vanishes somewhere, so that the motion is not determined.

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
        balance = regime.resolve(rigid, rigid.mesh).balance
    if scene.compliances:
        from flywheel.whole import followed

        return _of_run(followed(machine, phi, omega, until, own, balance or 0.0, rtol))
    steps, turns = _followed(machine, phi, omega, until, total, balance or 0.0, max(rtol, TIGHTEST))
    return _as_motion(machine, steps, turns, total)


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
    offset = float(np.floor(phi / cycle)) * cycle
    t, state = 0.0, np.array([phi - offset, omega, 0.0])
    steps: list[Step] = []
    turns: list[float] = []
    hint: float | None = None
    while t < until:
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
    return steps, turns


def _piece(machine: Machine, state: Array, inertia: float, balance: float) -> tuple[int, float, float]:
    """The piece that the motion goes on in, the angle within the cycle there, and what was taken off it."""
    ends, cycle = machine.restarts, machine.scene.cycle
    phi, omega = float(state[0]), float(state[1])
    forwards = omega > 0.0
    if omega == 0.0:
        forward = min(max(int(np.searchsorted(ends, phi, side="right")) - 1, 0), ends.size - 2)
        middle = 0.5 * float(ends[forward] + ends[forward + 1])
        forwards = _rates(machine, middle, inertia, balance, None)(0.0, state)[1] >= 0.0
    if forwards:
        shift = cycle if phi >= cycle else 0.0
        return int(np.searchsorted(ends, phi - shift, side="right")) - 1, phi - shift, shift
    shift = -cycle if phi <= 0.0 else 0.0
    return int(np.searchsorted(ends, phi - shift, side="left")) - 1, phi - shift, shift


def _rates(machine: Machine, middle: float, inertia: float, balance: float, ends: tuple[float, float] | None) -> Rates:
    """d(phi, omega, work)/dt within the piece around `middle`."""

    def rates(t: float, state: Array) -> Array:
        phi, omega = state[0], state[1]
        total, slope, moment = reduced_at(machine, phi, middle, balance, ends)
        total += inertia
        if not total > 0.0:
            found = f"I* + J = {total:g} kg m² at crank angle {np.degrees(phi):.6g} deg"
            raise SceneError([Fault("flywheel.inertia", found, "a positive inertia everywhere", "add inertia")])
        return np.array([omega, (moment - 0.5 * slope * omega * omega) / total, moment * omega])

    return rates


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
