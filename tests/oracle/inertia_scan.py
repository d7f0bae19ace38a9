"""Steady motions over many inertias at once: textbook equations over the crank angle, by shooting with Runge and Kutta."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass
class Textbook:
    """A crank with its own inertia I(phi), a load and a motor behind a ratio; `current` (A/s) is the rate of a state.

    `inertia`: I and dI/dphi at an angle. `torque`: of the motor, at its speed and current. `load`: on the crank at an angle.
    """

    inertia: Callable[[float], tuple[float, float]]
    torque: Callable[[Any, Any], Any]
    load: Callable[[float], float]
    ratio: float = 1.0
    speed: float = 10.0
    amps: float = 0.0
    current: Callable[[Any, Any], Any] | None = None
    steps: int = 360

    def rates(self, phi: float, state: Any, heavy: Any) -> Any:
        own, slope = self.inertia(phi)
        omega, amps = state
        moment = self.ratio * self.torque(self.ratio * omega, amps) + self.load(phi) - 0.5 * slope * omega**2
        changes = self.amps - amps if self.current is None else self.current(self.ratio * omega, amps) / omega
        return np.stack((moment / ((own + heavy) * omega), changes))

    def cycle(self, state: Any, heavy: Any) -> Any:
        """The states at the steps of a cycle from one at its start; a crank that would stop crawls on."""
        step, passed = 2 * np.pi / self.steps, [state]
        for phi in (np.arange(self.steps) * step).tolist():  # loads switch at whole steps
            a = self.rates(phi + 1e-9, state, heavy)
            b = self.rates(phi + step / 2, state + step / 2 * a, heavy)
            c = self.rates(phi + step / 2, state + step / 2 * b, heavy)
            d = self.rates(phi + step - 1e-9, state + step * c, heavy)
            state = state + step / 6 * (a + 2 * b + 2 * c + d)
            state[0] = np.maximum(state[0], 1e-6 * self.speed)
            passed.append(state)
        return np.array(passed)

    def motions(self, heavy: Any) -> tuple[Any, Any]:
        """The speeds and currents over the steady cycle: (steps + 1, inertias)."""
        heavy = np.asarray(heavy, dtype=float)
        state = np.stack((np.full(heavy.shape, self.speed), np.full(heavy.shape, self.amps)))
        for _ in range(2):
            state = self.cycle(state, heavy)[-1]
        for _ in range(6):
            end, columns = self.cycle(state, heavy)[-1], []
            for k, size in enumerate((1e-5 * self.speed, 1e-5 * max(self.amps, 1.0))):
                beside = state.copy()
                beside[k] += size
                columns.append((self.cycle(beside, heavy)[-1] - end) / size)
            matrix = np.moveaxis(np.array(columns), (0, 1, 2), (2, 1, 0)) - np.eye(2)
            step = np.linalg.solve(matrix, (state - end).T[..., None])[..., 0].T
            state = state + step
            if (np.abs(step[0]) <= 1e-10 * state[0]).all():
                break
        passed = self.cycle(state, heavy)
        assert (np.abs(passed[-1] - passed[0])[0] <= 1e-7 * self.speed).all()
        return passed[:, 0], passed[:, 1]


def mean(values: Any, omega: Any) -> Any:
    """The mean over time of a figure over the cycle."""
    return np.trapezoid(values / omega, axis=0) / np.trapezoid(1 / omega, axis=0)


def irregularity(omega: Any) -> Any:
    """(greatest - least)/mean of a speed."""
    return 2 * np.ptp(omega, axis=0) / (omega.max(axis=0) + omega.min(axis=0))


def kept(sizing: Any, inertias: Any) -> Any:
    """Flywheels that keep the limits, according to a sizing."""
    result = inertias >= sizing.flywheel.exact
    for each in sizing.flywheel.broken:
        result &= ~((inertias >= each.start) & (inertias < (np.inf if each.end is None else each.end)))
    return result
