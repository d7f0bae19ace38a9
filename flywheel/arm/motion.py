"""The arm's motion, by time stepping."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.arguments import POSITIVE, array, number_faults, refuse, require
from flywheel.arm.dynamics import TwoLinkArm, accelerations, energy, pair_of
from flywheel.faults import Fault, SceneError

Array = NDArray[np.float64]
Torques = Callable[[float, Array, Array], ArrayLike]

_FINEST = 1e-13  # relative tolerance below which an integrator in double precision gains nothing


class ArmMotion(NamedTuple):
    """A simulated motion at the integrator's own times t (s): q (rad), qdot (rad/s), shape (2, n).

    `kinetic`, `potential` and `work`, that of the torques since the start, in J; `energy_residual` is the greatest
    |energy gained - work| over the greatest of kinetic energy and swing of potential energy. `at(t)` gives (q, qdot) at
    any times within, by dense output.
    """

    t: Array
    q: Array
    qdot: Array
    kinetic: Array
    potential: Array
    work: Array
    energy_residual: float
    at: Callable[[ArrayLike], tuple[Array, Array]]


def simulate_arm(
    arm: TwoLinkArm,
    q: ArrayLike,
    qdot: ArrayLike,
    until: float,
    *,
    torques: Torques | None = None,
    rtol: float = 1e-10,
) -> ArmMotion:
    """Motion from a given state for a given time, by an explicit Runge-Kutta method of order 8.

    Args:
        arm: the arm.
        q: angles at t = 0, rad, shape (2,).
        qdot: speeds at t = 0, rad/s, shape (2,).
        until: time to simulate, s.
        torques: T1, T2 (N m) as a function of (t, q, qdot); none if None. It should be smooth: end the run where it jumps.
        rtol: tolerance of the integrator, per step.

    Raises:
        SceneError: if an argument, or what `torques` returns, is not finite.

    Large swings are chaotic: the energy stays, but after many of them the angles depend on the last digit of the start.

    >>> from flywheel.arm.dynamics import slender
    >>> arm = TwoLinkArm(slender(1.0, 3.0), slender(0.5, 1.2))
    >>> simulate_arm(arm, [2.0, 1.0], [0.0, 0.0], 2.0).energy_residual < 1e-9
    True

    """
    from scipy.integrate import solve_ivp

    require("arm", arm, TwoLinkArm, "a TwoLinkArm")
    start = _state(q, qdot, until, rtol)

    def rates(t: float, state: Array) -> Array:
        angles, speeds = state[0:2], state[2:4]
        applied = np.zeros(2) if torques is None else pair_of("torques", torques(t, angles, speeds))
        power = applied[0] * speeds[0] + applied[1] * (speeds[1] - speeds[0])
        return np.concatenate((speeds, accelerations(arm, angles, speeds, applied), [power]))

    step = max(rtol, _FINEST)
    found = solve_ivp(rates, (0.0, until), start, method="DOP853", rtol=step, atol=step, dense_output=True)
    if not found.success:
        raise SceneError([Fault("until", f"{until:g} s", f"a motion that can be followed: it stops at {found.t[-1]:g} s")])
    return _as_motion(arm, found)


def _as_motion(arm: TwoLinkArm, found: Any) -> ArmMotion:
    q, qdot, work = found.y[0:2], found.y[2:4], found.y[4]
    kinetic, potential = energy(arm, q, qdot)
    total = kinetic + potential
    scale = max(float(kinetic.max()), float(np.ptp(potential)), 1e-300)
    residual = float(np.abs(total - total[0] - work).max()) / scale

    def at(times: ArrayLike) -> tuple[Array, Array]:
        state = found.sol(array("times", times))
        return state[0:2], state[2:4]

    return ArmMotion(found.t, q, qdot, kinetic, potential, work, residual, at)


def _state(q: ArrayLike, qdot: ArrayLike, until: float, rtol: float) -> Array:
    refuse([*number_faults("until", until, POSITIVE), *number_faults("rtol", rtol, POSITIVE)])
    state = {"q": pair_of("q", q), "qdot": pair_of("qdot", qdot)}
    refuse([Fault(name, f"an array of shape {pair.shape}", "shape (2,)") for name, pair in state.items() if pair.ndim > 1])
    return np.concatenate((*state.values(), [0.0]))
