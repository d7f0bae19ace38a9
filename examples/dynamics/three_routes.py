"""The motion of a slider-crank under a falling motor torque and gravity, by three routes and by the reduced equation.

    python three_routes.py

Data of a paper on differential-algebraic equations: a2 = 0.2 m, a3 = 0.6 m, e = 0; I2 = 1, I3 = 3 kg m²; m2 = 12,
m3 = m4 = 6 kg; rod's centre at its middle; T = 10 - 2.387 omega2 N m; g = 9.81 m/s² downwards, from rest at
theta2 = 90 deg. Prints theta2 and omega2 at a few times with their deviation from the reduced equation written out by hand,
how far the loop a2 sin theta2 + a3 sin theta3 + e is open, drift, energy residual and cost of every route.
"""

from __future__ import annotations

from math import asin, cos, pi, sin, sqrt
from time import perf_counter

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from flywheel.mechanisms.linkages.multibody import ROUTES, Run, simulate
from flywheel.scene.linkage import Joint, Link, Linkage, Point

Array = NDArray[np.float64]

A2, A3, E = 0.2, 0.6, 0.0  # m
I2, I3 = 1.0, 3.0  # kg m²
M2, M3, M4 = 12.0, 6.0, 6.0  # kg
G3 = 0.3  # m, from the crank pin to the rod's centre of mass
GRAVITY = 9.81  # m/s²
START = pi / 2
TIMES = (0.5, 1.0, 2.0, 5.0)  # s
RTOL = 1e-10


def torque(t: float, theta2: float, omega2: float) -> float:
    """The motor's torque, N m."""
    return 10.0 - 2.387 * omega2


def slider_crank() -> Linkage:
    """Bodies and joints; the guide lies at y = -e."""
    origin, guide = Point("O"), Point("guide", 0.0, -E)
    crank_end, rod_end = Point("end", A2), Point("end", A3)
    theta3 = 2 * pi - asin((A2 * sin(START) + E) / A3)
    links = (
        Link("crank", (origin, crank_end), M2, I2),
        Link("rod", (origin, rod_end), M3, I3, (G3, 0.0), guess=theta3),
        Link("slider", (origin,), M4),
    )
    joints = (
        Joint("pivot", "pin", "frame", "crank", origin, origin),
        Joint("crank pin", "pin", "crank", "rod", crank_end, origin),
        Joint("slider pin", "pin", "rod", "slider", rod_end, origin),
        Joint("guide", "slide", "frame", "slider", guide, origin),
    )
    return Linkage(Link("frame", (origin, guide)), links, joints, "pivot", start=START)


def by_hand(t: float, state: Array) -> list[float]:
    """I* alpha + ½ dI*/dphi omega² = M*, written out; b is the rod's angle, sin b = -(a2 sin phi + e)/a3."""
    phi, omega = state
    s, c = sin(phi), cos(phi)
    sb = -(A2 * s + E) / A3
    cb = sqrt(1 - sb * sb)
    b1 = -A2 * c / (A3 * cb)
    b2 = (A2 * s / A3 + sb * b1**2) / cb
    x1, y1 = -A2 * s - G3 * sb * b1, A2 * c + G3 * cb * b1
    x2, y2 = -A2 * c - G3 * (cb * b1**2 + sb * b2), -A2 * s + G3 * (cb * b2 - sb * b1**2)
    v1, v2 = -A2 * s - A3 * sb * b1, -A2 * c - A3 * (cb * b1**2 + sb * b2)
    inertia = I2 + M3 * (x1**2 + y1**2) + I3 * b1**2 + M4 * v1**2
    half_slope = M3 * (x1 * x2 + y1 * y2) + I3 * b1 * b2 + M4 * v1 * v2
    moment = torque(t, phi, omega) - M3 * GRAVITY * y1
    return [omega, (moment - half_slope * omega**2) / inertia]


def loop_residual(run: Run) -> float:
    """Largest |a2 sin theta2 + a3 sin theta3 + e|, m."""
    theta2, theta3 = run.coordinates[:, 0, 2], run.coordinates[:, 1, 2]
    return float(np.abs(A2 * np.sin(theta2) + A3 * np.sin(theta3) + E).max())


def main() -> None:
    """Print the comparison."""
    reference = solve_ivp(by_hand, (0.0, TIMES[-1]), [START, 0.0], "DOP853", TIMES, rtol=3e-14, atol=1e-14).y
    begun = perf_counter()
    solve_ivp(by_hand, (0.0, TIMES[-1]), [START, 0.0], "DOP853", rtol=RTOL, atol=RTOL)
    cost = perf_counter() - begun
    print(f"{'t, s':>22}" + "".join(f"{t:>16g}" for t in TIMES))
    print(f"{'theta2, rad':>22}" + "".join(f"{value:16.10f}" for value in reference[0]))
    print(f"{'omega2, rad/s':>22}" + "".join(f"{value:16.10f}" for value in reference[1]))
    print(
        f"\n{'route':<12}{'deviation':>11}{'loop, m':>11}{'drift':>11}{'energy':>11}{'evaluations':>13}{'time/by hand':>14}"
    )
    for route in ROUTES:
        begun = perf_counter()
        run = simulate(slider_crank(), route, START, 0.0, TIMES[-1], gravity=(0.0, -GRAVITY), drive=torque, rtol=RTOL)
        spent = perf_counter() - begun
        deviation = float(np.abs(np.array(run.at(TIMES)) - reference).max())
        energy = "-" if run.energy_residual is None else f"{run.energy_residual:.1e}"
        errors = f"{deviation:11.1e}{loop_residual(run):11.1e}{run.drift:11.1e}{energy:>11}"
        verdict = "agrees" if deviation < 1e-8 else "DISAGREES"
        print(f"{route:<12}{errors}{run.evaluations:13}{spent / cost:14.0f}  {verdict}")


if __name__ == "__main__":
    main()
