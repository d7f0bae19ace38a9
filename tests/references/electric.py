"""Steady motion with a direct-current motor whose armature has inductance: two states, speed and current, by shooting.

L di/dt = U - R i - k n omega, and the motor's torque k i on a shaft n times as fast as the crank.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple

from mpmath import mp  # type: ignore[import-untyped]

from .extrapolation import State, advanced, newton
from .quantities import quantity
from .regimes import Regime


class Armature(NamedTuple):
    """Voltage, resistance, constant, inductance (SI), and the ratio of the motor's shaft."""

    voltage: Any
    resistance: Any
    constant: Any
    inductance: Any
    ratio: Any


class Electric(Regime):
    """A machine that a motor with inductance drives; its scene has `drive.motor` in SI numbers."""

    def __init__(self, scene: dict[str, Any]) -> None:
        drive = scene["drive"]
        super().__init__({key: value for key, value in scene.items() if key != "drive"})
        motor = drive["motor"]
        keys = ("voltage", "resistance", "constant", "inductance")
        u, r, k, inductance = (mp.mpf(str(motor[key])) for key in keys)
        self.motor = Armature(u, r, k, inductance, quantity(scene["shafts"][drive["on"]]["ratio"]))

    def rates(self, smooth: Any, middle: Any, flywheel: Any, full: bool) -> Callable[[Any, State], State]:
        """d[y, current, (time, charge, heat)]/dphi."""
        u, r, k, inductance, n = self.motor

        def field(phi: Any, state: State) -> State:
            omega, frame = mp.sqrt(2 * state[0]), self.frame(smooth, middle, phi)
            moment = mp.fsum(m for _, m in self.moments(smooth, frame, omega, mp.zero)) + k * n * state[1]
            rate = (moment + frame.passive - frame.damping * omega - frame.slope * state[0]) / (frame.inertia + flywheel)
            electric = (u - r * state[1] - k * n * omega) / (inductance * omega)
            more = [1 / omega, state[1] / omega, r * state[1] ** 2 / omega] if full else []
            return [rate, electric, *more]

        return field

    def turned(self, start: State, flywheel: Any, full: bool = False) -> list[Any]:
        """The cells of a cycle."""
        state, done = list(start), []
        for a, b in pairwise(self.machine.breaks):
            middle, count = (a + b) / 2, int(mp.ceil((b - a) / self.wide))
            smooth = self.smooth(middle, middle, state[0], mp.zero, flywheel)
            field = self.rates(smooth, middle, flywheel, full)
            edges = [a + (b - a) * i / count for i in range(count)] + [b]
            for at, end in pairwise(edges):
                after = advanced(field, at, state, end - at)
                done.append((at, state, end, after, field))
                state = after
        return done

    def gain(self, start: State, flywheel: Any) -> tuple[State, Any]:
        """(what speed and current gain in a cycle, irregularity)."""
        cells = self.turned(start, flywheel)
        speeds = [w for w, _ in self.extremes(cells)]
        end = cells[-1][3]
        eps = 2 * (max(speeds) - min(speeds)) / (max(speeds) + min(speeds))
        return [end[0] / start[0] - 1, (end[1] - start[1]) * self.motor.resistance / self.motor.voltage], eps

    def found(self, speed: Any, *, inertia: Any, eps: Any = None) -> dict[str, Any]:
        """The steady motion with a flywheel at its shaft; with an irregularity the inertia is but a guess."""
        wheel = mp.mpf(inertia) * self.ratio**2
        u, r, k, _, n = self.motor
        start = [mp.mpf(speed) ** 2 / 2, (u - k * n * speed) / r] + ([wheel] if eps else [])

        def residual(x: State) -> State:
            rise, found = self.gain(x[:2], x[2] if eps else wheel)
            return [*rise, found / eps - 1] if eps else rise

        solution = newton(lambda x: self.gain(x, wheel)[0], start[:2])
        if eps:
            solution = newton(residual, [*solution, wheel])
        return self.figures(solution[:2], solution[2] if eps else wheel)

    def figures(self, start: State, wheel: Any) -> dict[str, Any]:
        """All of a periodic motion."""
        cells = self.turned([*start, mp.zero, mp.zero, mp.zero], wheel, True)
        end, speeds = cells[-1][3], self.extremes(cells)
        (top, high), (bottom, low) = max(speeds), min(speeds)
        return {
            "inertia": wheel / self.ratio**2,
            "irregularity": 2 * (top - bottom) / (top + bottom), "speed": (top + bottom) / 2,
            "speed_max": top, "speed_min": bottom, "angle_speed_max": high, "angle_speed_min": low, "period": end[2],
            "speed_time_mean": self.machine.cycle / end[2], "current_time_mean": end[3] / end[2],
            "electric_work": self.motor.voltage * end[3], "heat": end[4], "multipliers": self.multipliers(start, wheel),
        }  # fmt: skip

    def multipliers(self, start: State, wheel: Any) -> list[str]:
        """The eigenvalues of the map from cycle to cycle."""
        columns = []
        for j in range(2):
            h = start[j] * mp.mpf("1e-10")
            ends = [self.turned([x + s * h * (i == j) for i, x in enumerate(start)], wheel)[-1][3] for s in (1, -1)]
            columns.append([(a - b) / (2 * h) for a, b in zip(*ends, strict=True)])
        (a, c), (b, d) = columns
        root = mp.sqrt(((a - d) / 2) ** 2 + b * c)
        return [mp.nstr((a + d) / 2 + s * root, 15) for s in (1, -1)]
