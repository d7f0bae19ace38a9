"""Speed of the routes of `flywheel.multibody`, beside scripts written by hand for the same machine: CPU times as ratios.

    python tests/benchmarks/bench_multibody.py [--quick]

Six seconds of the published slider-crank under a falling torque, from rest, rtol 1e-10. Each script does for this one
machine what the route does for any: the same method (DOP853) at the same tolerance, dense output, the work done, all
poses and velocities at the steps, and the reactions where the route finds them. Positions are in closed form; linear
systems are filled entry by entry and solved by numpy. What they leave out: assembly, locks and branches, closures put back
after a step. Every run's end is compared with 30-digit values. Exit code 1 where a ratio exceeds its limit of 3.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from math import cos, pi, sin, sqrt
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

sys.path.insert(0, str(Path(__file__).parents[2]))

from flywheel.multibody import ENERGY, MULTIPLIERS, NEWTON, REDUCED, simulate
from tests.linkages.machines import EXACT, GRAVITY, motor, published

LIMIT = 3.0
R, L, C = 0.2, 0.6, 0.3  # m: crank, rod, its centre from the crank pin
I2, I3, M2, M3, M4, G = 1.0, 3.0, 12.0, 6.0, 6.0, 9.81
START, RTOL = pi / 2, 1e-10


class Row(NamedTuple):
    """A route beside its script: CPU times (s) and errors of both at the last exact time."""

    route: str
    script: float
    ours: float
    script_error: float
    our_error: float

    @property
    def ratio(self) -> float:
        return self.ours / self.script


def torque(omega: float) -> float:
    return 10.0 - 2.387 * omega


def rod(phi: float) -> tuple[float, ...]:
    """Sine and cosine of the crank's and the rod's angles, the rod's g and g'."""
    s, c = sin(phi), cos(phi)
    sb = -R * s / L
    cb = sqrt(1 - sb * sb)
    b1 = -R * c / (L * cb)
    return s, c, sb, cb, b1, (R * s / L + sb * b1 * b1) / cb


def reduced_terms(phi: float) -> tuple[float, float, float]:
    """I*, half its slope, and the moment of gravity."""
    s, c, sb, cb, b1, b2 = rod(phi)
    x1, y1 = -R * s - C * sb * b1, R * c + C * cb * b1
    x2, y2 = -R * c - C * (cb * b1**2 + sb * b2), -R * s + C * (cb * b2 - sb * b1**2)
    u1, u2 = -R * s - L * sb * b1, -R * c - L * (cb * b1**2 + sb * b2)
    inertia = I2 + M3 * (x1**2 + y1**2) + I3 * b1**2 + M4 * u1**2
    return inertia, M3 * (x1 * x2 + y1 * y2) + I3 * b1 * b2 + M4 * u1 * u2, -M3 * G * y1


def poses(phi: Any, omega: Any) -> tuple[Any, Any]:
    """x, y, theta of the three bodies and their rates at many positions, shape (n, 9)."""
    s, c = np.sin(phi), np.cos(phi)
    b = -np.arcsin(R * s / L)
    b1 = -R * c / (L * np.cos(b))
    sb, cb, o = np.sin(b), np.cos(b), 0 * phi
    place = np.column_stack((o, o, phi, R * c + C * cb, R * s + C * sb, b, R * c + L * cb, o, o))
    rate = np.column_stack((o, o, 1 + o, -R * s - C * sb * b1, R * c + C * cb * b1, b1, -R * s - L * sb * b1, o, o))
    return place, rate * np.asarray(omega)[:, None]


def residual(v: Any, work: Any) -> float:
    """Largest difference of kinetic energy and work."""
    kinetic = 0.5 * (v**2 @ np.array((M2, M2, I2, M3, M3, I3, M4, M4, 0.0)))
    return float(np.abs(kinetic - kinetic[0] - work).max() / kinetic.max())


def solved(rates: Callable[..., Any], start: list[float], until: float, **more: Any) -> Any:
    return solve_ivp(rates, (0.0, until), start, "DOP853", rtol=RTOL, atol=RTOL, dense_output=True, **more)


def by_reduction(until: float) -> Any:
    def rates(t: float, y: Any) -> list[float]:
        phi, omega, _ = y
        inertia, half, weight = reduced_terms(phi)
        moment = torque(omega) + weight
        return [omega, (moment - half * omega**2) / inertia, moment * omega]

    result = solved(rates, [START, 0.0, 0.0], until)
    x, v = poses(result.y[0], result.y[1])
    return result.sol, x, residual(v, result.y[2])


def newton_system(phi: float, omega: float) -> tuple[Any, Any]:
    """Newton and Euler for three bodies: alpha2, a3x, a3y, alpha3, a4, and O, A, B (x, y), guide's normal and moment."""
    s, c, sb, cb, b1, _ = rod(phi)
    w3 = b1 * omega
    a, r = np.zeros((13, 13)), np.zeros(13)
    a[0, 5], a[0, 7] = 1, -1  # crank, its centre at rest
    a[1, 6], a[1, 8], r[1] = 1, -1, M2 * G
    a[2, 0], a[2, 7], a[2, 8], r[2] = -I2, R * s, -R * c, -torque(omega)
    a[3, 1], a[3, 7], a[3, 9] = -M3, 1, -1
    a[4, 2], a[4, 8], a[4, 10], r[4] = -M3, 1, -1, M3 * G
    a[5, 3], a[5, 7], a[5, 8] = -I3, C * sb, -C * cb
    a[5, 9], a[5, 10] = (L - C) * sb, -(L - C) * cb
    a[6, 4], a[6, 9] = -M4, 1
    a[7, 10], a[7, 11], r[7] = 1, 1, M4 * G
    a[8, 12] = 1
    a[9, 0], a[9, 3], a[9, 1], r[9] = R * s, C * sb, 1, -R * c * omega**2 - C * cb * w3**2
    a[10, 0], a[10, 3], a[10, 2], r[10] = -R * c, -C * cb, 1, -R * s * omega**2 - C * sb * w3**2
    a[11, 0], a[11, 3], a[11, 4], r[11] = R * s, L * sb, 1, -R * c * omega**2 - L * cb * w3**2
    a[12, 0], a[12, 3], r[12] = R * c, L * cb, R * s * omega**2 + L * sb * w3**2
    return a, r


def by_newton(until: float) -> Any:
    def rates(t: float, y: Any) -> list[float]:
        phi, omega, _ = y
        alpha = np.linalg.solve(*newton_system(phi, omega))[0]
        _, c, _, cb, b1, _ = rod(phi)
        return [omega, alpha, (torque(omega) - M3 * G * (R * c + C * cb * b1)) * omega]

    result = solved(rates, [START, 0.0, 0.0], until)
    x, v = poses(result.y[0], result.y[1])
    systems = [newton_system(phi, omega) for phi, omega in zip(result.y[0], result.y[1], strict=True)]
    reactions = np.linalg.solve(np.stack([a for a, _ in systems]), np.stack([r for _, r in systems])[..., None])[:, 5:, 0]
    return result.sol, x, residual(v, result.y[2]), reactions


MASSES = np.diag((M2, M2, I2, M3, M3, I3, M4, M4, 1.0))
WEIGHTS = np.array((0, -M2 * G, 0, 0, -M3 * G, 0, 0, -M4 * G, 0.0))


def multiplier_system(x: Any, v: Any) -> tuple[Any, Any]:
    """Accelerations of nine coordinates and eight multipliers: 17 equations."""
    s2, c2, s3, c3 = sin(x[2]), cos(x[2]), sin(x[5]), cos(x[5])
    j = np.zeros((8, 9))
    j[0, 0] = j[1, 1] = 1
    j[2, 0], j[2, 2], j[2, 3], j[2, 5] = -1, R * s2, 1, C * s3
    j[3, 1], j[3, 2], j[3, 4], j[3, 5] = -1, -R * c2, 1, -C * c3
    j[4, 3], j[4, 5], j[4, 6] = -1, (L - C) * s3, 1
    j[5, 4], j[5, 5], j[5, 7] = -1, -(L - C) * c3, 1
    j[6, 7] = j[7, 8] = 1
    w2, w3 = v[2] ** 2, v[5] ** 2
    gamma = [0, 0, -R * c2 * w2 - C * c3 * w3, -R * s2 * w2 - C * s3 * w3, -(L - C) * c3 * w3, -(L - C) * s3 * w3, 0, 0]
    a = np.zeros((17, 17))
    a[:9, :9], a[:9, 9:], a[9:, :9] = MASSES, -j.T, j
    forces = WEIGHTS.copy()
    forces[2] = torque(v[2])
    return a, np.concatenate((forces, gamma))


def by_multipliers(until: float) -> Any:
    def rates(t: float, y: Any) -> Any:
        x, v = y[:9], y[9:18]
        a, r = multiplier_system(x, v)
        return np.concatenate((v, np.linalg.solve(a, r)[:9], [v @ r[:9]]))

    x, g = poses(np.array([START]), np.array([0.0]))
    result = solved(rates, [*x[0], *g[0], 0.0], until)
    systems = [multiplier_system(y[:9], y[9:18]) for y in result.y.T]
    reactions = np.linalg.solve(np.stack([a for a, _ in systems]), np.stack([r for _, r in systems])[..., None])[:, 9:, 0]
    return result.sol, result.y.T, residual(result.y[9:18].T, result.y[18]), reactions


def by_energy(until: float) -> Any:
    """From rest q = start + u²: y = E/u², dy/du = (2/u)(M - y), dt/du = 2/(omega/u)."""
    inertia, _, weight = reduced_terms(START)
    begin = torque(0.0) + weight

    def rates(u: float, both: Any) -> list[float]:
        y, _ = both
        inertia, _, weight = reduced_terms(START + u * u)
        speed = sqrt(2 * y / inertia)
        slope = 2 / u * (torque(speed * u) + weight - y) if u > 0 else -2.0 / 3.0 * 2.387 * sqrt(2 * begin / inertia)
        return [slope, 2 / speed]

    def over(u: float, both: Any) -> float:
        return both[1] - until

    over.terminal = True
    result = solve_ivp(rates, (0.0, 1e3), [begin, 0.0], "DOP853", rtol=RTOL, atol=RTOL, dense_output=True, events=over)
    phi = START + result.t**2
    inertia = np.array([reduced_terms(one)[0] for one in phi])
    omega = result.t * np.sqrt(2 * result.y[0] / inertia)
    return (phi, omega), poses(phi, omega)


SCRIPTS = {REDUCED: by_reduction, NEWTON: by_newton, MULTIPLIERS: by_multipliers, ENERGY: by_energy}


def measured(route: str, until: float, repeats: int) -> Row:
    """Least CPU times of a route and of its script, run in turns."""
    times: tuple[list[float], list[float]] = ([], [])
    for _ in range(repeats):
        begun = time.process_time()
        script = SCRIPTS[route](until)
        times[0].append(time.process_time() - begun)
        begun = time.process_time()
        run = simulate(published(), route, START, 0.0, until, gravity=GRAVITY, drive=motor, rtol=RTOL)
        times[1].append(time.process_time() - begun)
    last = max(t for t in EXACT if t <= until)
    ours = abs(float(run.at(last)[0][0]) - EXACT[last][0])
    theirs = np.nan if route == ENERGY else abs(float(script[0](last)[2 if route == MULTIPLIERS else 0]) - EXACT[last][0])
    return Row(route, min(times[0]), min(times[1]), theirs, ours)


def main() -> int:
    """Print the table; 1 where a ratio is above its limit."""
    quick = "--quick" in sys.argv[1:]
    until, repeats = (6.0, 10) if quick else (6.0, 15)
    print(
        f"{until:g} s of the published slider-crank, from rest, rtol {RTOL:g}; errors of the angle at the last exact time\n"
    )
    print(f"{'route':<12}{'script':>10}{'error':>10}{'route':>10}{'error':>10}{'ratio':>8}")
    rows = [measured(route, until, repeats) for route in SCRIPTS]
    for row in rows:
        script, ours = f"{1e3 * row.script:.1f} ms", f"{1e3 * row.ours:.1f} ms"
        print(f"{row.route:<12}{script:>10}{row.script_error:10.0e}{ours:>10}{row.our_error:10.0e}{row.ratio:8.2f}")
    slow = [row.route for row in rows if row.ratio > LIMIT]
    if slow:
        print(f"\nabove the limit of {LIMIT:g}: {', '.join(slow)}")
    return 1 if slow else 0


if __name__ == "__main__":
    sys.exit(main())
