"""A slider-crank with Coulomb's friction in its pins and its guide, by Newton and Euler alone: nothing of the package.

Nine equations of three bodies for the crank's acceleration, six pin forces, the guide's normal force and its moment (none:
the ram's pin lies on its centre), with friction that follows them: fixed point and Newton by numpy. Integration by scipy's
DOP853 from event to event: where a rate or the normal force changes its sign.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SliderCrank:
    """Lengths (m), masses (kg), inertias about centres of mass (kg m²; `wheel` joins the crank), friction and pin radius."""

    r: float = 0.1
    length: float = 0.4
    com: float = 0.15
    crank: tuple[float, float] = (3.0, 0.02)
    rod: tuple[float, float] = (2.0, 0.03)
    ram: float = 6.0
    wheel: float = 0.0
    mu: float = 0.1
    mu_guide: float = 0.1
    radius: float = 0.015
    gravity: float = 0.0  # along -y
    torque: Callable[[float, float, float], float] = lambda t, phi, omega: 0.0
    force: Callable[[float, float, float], float] = lambda t, phi, v: 0.0

    def kinematics(self, phi: float) -> tuple[float, float, float, float, float]:
        """Angle of the rod, its rate and slope by phi; rate and slope of the ram."""
        beta = np.arcsin(-self.r * np.sin(phi) / self.length)
        g = -self.r * np.cos(phi) / (self.length * np.cos(beta))
        s = (self.r * np.sin(phi) + self.length * np.sin(beta) * g * g) / (self.length * np.cos(beta))
        x = -self.r * np.sin(phi) - self.length * np.sin(beta) * g
        bend = -self.r * np.cos(phi) - self.length * (np.cos(beta) * g * g + np.sin(beta) * s)
        return beta, g, s, x, bend

    def solved(self, t: float, phi: float, omega: float, signs: Array) -> tuple[float, Array, Array]:
        """Crank's acceleration, (O, A, B, N) forces, and frictions (couples of O, A, B; guide), for senses of the motion.

        signs: of the relative speeds in O, A, B, guide, and of N.
        """
        beta, g, s, x, bend = self.kinematics(phi)
        a, b = self.r * np.array([np.cos(phi), np.sin(phi)]), self.length * np.array([np.cos(beta), np.sin(beta)])
        c = b * self.com / self.length
        turn = lambda p: np.array([-p[1], p[0]])  # noqa: E731
        rates = turn(a) + turn(c) * g
        bends = -a + turn(c) * s - c * g * g
        m_rod, j_rod = self.rod
        # unknowns: alpha, Ox, Oy, Ax, Ay, Bx, By, N; pins: what the body before does to the one behind; friction (4) known
        matrix, right, rub = np.zeros((8, 8)), np.zeros(8), np.zeros((8, 4))
        weight = np.array([0.0, -self.gravity])
        v = x * omega
        # crank: O - A = -m g; moments about O: J alpha = T - a x A + couple_O - couple_A
        matrix[0, [1, 3]], matrix[1, [2, 4]] = (1, -1), (1, -1)
        right[:2] = -self.crank[0] * weight
        matrix[2, [0, 3, 4]] = self.crank[1] + self.wheel, -a[1], a[0]
        right[2], rub[2] = self.torque(t, phi, omega), [1, -1, 0, 0]
        # rod: A - B + m g = m (rates alpha + bends omega²); moments about its centre of mass
        for k in range(2):
            matrix[3 + k, [3 + k, 5 + k, 0]] = 1, -1, -m_rod * rates[k]
            right[3 + k] = m_rod * (bends[k] * omega**2 - weight[k])
        matrix[5, [0, 3, 4, 5, 6]] = -j_rod * g, c[1], -c[0], (b - c)[1], -(b - c)[0]
        right[5], rub[5] = j_rod * s * omega**2, [0, -1, 1, 0]
        # ram: along x with guide's friction; across
        matrix[6, [0, 5]] = -self.ram * x, 1
        right[6], rub[6] = self.ram * bend * omega**2 - self.force(t, phi, v), [0, 0, 0, -1]
        matrix[7, [6, 7]] = 1, 1
        right[7] = -self.ram * weight[1]
        free, answer = np.linalg.solve(matrix, right), np.linalg.solve(matrix, rub)
        circle = self.radius * self.mu / np.sqrt(1 + self.mu**2)
        z, last = free, np.full(8, np.inf)
        for _ in range(200):
            pins = np.hypot(z[1:7:2], z[2:7:2])
            friction = -np.append(circle * pins * signs[:3], self.mu_guide * z[7] * signs[4] * signs[3])
            z, last = free + answer @ friction, z
            if np.abs(z - last).max() <= 1e-15 * np.abs(z).max():
                break
        return float(z[0]), z[1:], friction

    def senses(self, phi: float, omega: float) -> Array:
        """Relative speeds in O, A, B and guide."""
        _, g, _, x, _ = self.kinematics(phi)
        return np.array([1.0, g - 1.0, -g, x]) * omega

    def stretch(self, t: float, y: Array, until: float, signs: Array, rtol: float) -> tuple[float, Array, int | None]:
        """To the first event: a rate (1 to 3) or the normal force (4) changes its sign, or the crank stops (0)."""

        def rates(t: float, y: Array) -> list[float]:
            alpha, _, friction = self.solved(t, y[0], y[1], signs)
            power = float(friction @ self.senses(y[0], y[1]))
            return [y[1], alpha, power, self.torque(t, y[0], y[1]) * y[1]]

        def watched(k: int) -> Callable[[float, Array], float]:
            def value(t: float, y: Array) -> float:
                if k == 0:
                    return float(y[1] * signs[0])
                if k == 4:
                    return float(self.solved(t, y[0], y[1], signs)[1][6] * signs[4])
                return float(self.senses(y[0], signs[0])[k] * signs[k])

            value.terminal, value.direction = True, -1.0  # type: ignore[attr-defined]
            return value

        events = [watched(k) for k in range(5)]
        run = solve_ivp(rates, (t, until), y, "DOP853", rtol=rtol, atol=1e-14, events=events, max_step=0.02)
        fired = [k for k, found in enumerate(run.t_events) if found.size]
        return float(run.t[-1]), run.y[:, -1], fired[0] if fired else None

    def begun(self, t: float, phi: float, omega: float, sense: float) -> Array:
        """The signs with which a stretch begins."""
        rates = np.sign(self.senses(phi + 1e-7 * sense, sense))
        signs = np.append(rates, 1.0)
        signs[4] = np.sign(self.solved(t, phi + 1e-7 * sense, omega, signs)[1][6]) or 1.0
        return signs

    def run(self, phi: float, omega: float, until: float, rtol: float = 1e-12) -> tuple[Array, Array]:
        """Times and states (phi, omega, work of friction, work of the torque) at the ends of stretches; ends at rest."""
        t, y = 0.0, np.array([phi, omega, 0.0, 0.0])
        times, states = [t], [y]
        signs: Array | None = self.begun(t, phi, omega, np.sign(omega)) if omega else self.leaving(t, phi)
        while t < until and signs is not None and len(times) < 2000:
            t, y, fired = self.stretch(t, y, until, signs, rtol)
            times.append(t)
            states.append(y)
            if fired is None:
                break
            if fired == 0:
                y = y * [1.0, 0.0, 1.0, 1.0]
                signs = self.leaving(t, y[0])
                continue
            signs = signs.copy()
            signs[fired] *= -1.0
            if fired != 4:  # the normal force may jump with the friction's sense
                signs[4] = np.sign(self.solved(t, y[0], y[1], signs)[1][6]) or signs[4]
        return np.array(times), np.array(states)

    def leaving(self, t: float, phi: float) -> Array | None:
        """The signs with which the machine leaves its rest; None where friction holds it."""
        for sense in (1.0, -1.0):
            signs = self.begun(t, phi, 0.0, sense)
            if self.solved(t, phi, 0.0, signs)[0] * sense > 1e-12:
                return signs
        return None
