"""Speed of a motion with friction in the joints, beside a script written by hand: CPU times as a ratio.

    python tests/benchmarks/bench_friction.py [--quick]

Three seconds of a slider-crank from rest under a falling torque, friction in three pins and the guide. The
script does one pass for this one machine: Newton's and Euler's equations of its bodies in closed form, filled entry by entry
and solved by numpy, friction put in again until it settles, DOP853 at 1e-11. It does not stop where friction jumps, finds no
energies and peaks, and tells no error. `flywheel.transient` does all that for any machine, in two passes or more. Both ends
are compared with the angle of a tighter script that stops at every jump. The best of three runs, with `--quick` of one. Exit
code 1 above the limit.
"""

from __future__ import annotations

import sys
import time
from math import cos, hypot, sin, sqrt
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import flywheel
from flywheel.motions.transients import estimates

LIMIT = 5.0  # 2.4 to 3.5 were measured: three passes' worth of work and the estimate of the error
R, L, C = 0.1, 0.3, 0.15  # m: crank, rod, its centre from the crank pin
I2, I3, M2, M3, M4, G = 0.05, 0.02, 4.0, 2.0, 3.0, 9.80665
MU, MU_GUIDE, PIN = 0.1, 0.15, 0.02
RHO = PIN * MU / sqrt(1 + MU**2)
RTOL = 1e-11
UNTIL, EXACT = 3.0, 51.6335508671  # s, rad


def scene() -> Any:
    """The machine as a scene."""
    friction = {"type": "pin", "friction": MU, "radius": PIN}
    bodies = {
        "frame": {"points": {"O": [0, 0]}},
        "crank": {"points": {"O": [0, 0], "A": [R, 0]}, "mass": M2, "inertia": I2},
        "rod": {"points": {"A": [0, 0], "B": [L, 0]}, "mass": M3, "inertia": I3, "com": [C, 0], "guess": "-10 deg"},
        "slider": {"points": {"B": [0, 0]}, "mass": M4},
    }
    joints = [
        {"name": "O", "between": ["frame.O", "crank.O"], **friction},
        {"name": "A", "between": ["crank.A", "rod.A"], **friction},
        {"name": "B", "between": ["rod.B", "slider.B"], **friction},
        {"name": "G", "type": "slide", "between": ["frame.O", "slider.B"], "friction": MU_GUIDE},
    ]
    mechanism = {"type": "linkage", "driver": "O", "bodies": bodies, "joints": joints}
    return flywheel.load({"mechanism": mechanism, "gravity": {}, "drive": {"torque": "10 - 0.5*omega"}})


def acceleration(phi: float, omega: float) -> float:
    """Of the crank, with friction that follows the reactions."""
    s, c = sin(phi), cos(phi)
    sb = -R * s / L
    cb = sqrt(1 - sb * sb)
    b1 = -R * c / (L * cb)
    b2 = (R * s / L + sb * b1 * b1) / cb
    x1, y1 = -R * s - C * sb * b1, R * c + C * cb * b1
    x2, y2 = -R * c - C * (cb * b1**2 + sb * b2), -R * s + C * (cb * b2 - sb * b1**2)
    u1, u2 = -R * s - L * sb * b1, -R * c - L * (cb * b1**2 + sb * b2)
    square, sense = omega * omega, 1.0 if omega >= 0.0 else -1.0
    d = L - C
    # crank, rod (x, y, turning), slider (x, y) in alpha, forces on the rod at A, on the slider at B, of the guide
    matrix = [
        [I2, -R * s, R * c, 0, 0, 0],
        [M3 * x1, -1, 0, 1, 0, 0],
        [M3 * y1, 0, -1, 0, 1, 0],
        [I3 * b1, -C * sb, C * cb, -d * sb, d * cb, 0],
        [M4 * u1, 0, 0, -1, 0, 0],
        [0, 0, 0, 0, 1, 1],
    ]
    bare = [10 - 0.5 * omega, -M3 * x2 * square, -M3 * (y2 * square + G), -I3 * b2 * square, -M4 * u2 * square, M4 * G]
    inverse = np.linalg.inv(np.array(matrix))
    at_o = at_a = at_b = guide = alpha = 0.0
    while True:
        right = bare.copy()
        right[0] += at_o - at_a
        right[3] += at_a - at_b
        right[4] += guide
        before = alpha
        alpha, ax, ay, bx, by, normal = (inverse @ right).tolist()
        if abs(alpha - before) <= 1e-14 * abs(alpha):
            return float(alpha)
        at_o = -RHO * hypot(ax, ay + M2 * G) * sense
        at_a = -RHO * hypot(ax, ay) * (sense if b1 > 1.0 else -sense)
        at_b = -RHO * hypot(bx, by) * (sense if b1 < 0.0 else -sense)
        guide = -MU_GUIDE * abs(normal) * (sense if u1 > 0.0 else -sense)


def by_hand(until: float) -> float:
    """The angle at the end."""

    def rates(t: float, state: Any) -> list[float]:
        phi, omega = state.tolist()
        return [omega, acceleration(phi, omega)]

    result = solve_ivp(rates, (0.0, until), [0.0, 0.0], "DOP853", rtol=RTOL, atol=RTOL, dense_output=True)
    return float(result.y[0, -1])


def by_library(until: float) -> float:
    """The angle at the end, of the whole answer with its energies, peaks and errors."""
    result = flywheel.transient(scene(), end=until)
    assert estimates(result)
    return float(result.phi)


def main(quick: bool) -> int:
    """Print the ratio; 1 where it is above its limit."""
    by_library(0.01)  # what it takes to import
    times = []
    for call in (by_hand, by_library):
        spent = []
        for _ in range(3 if quick else 5):
            start = time.process_time()
            angle = call(UNTIL)
            spent.append(time.process_time() - start)
        times.append(min(spent))
        print(f"{call.__name__:<10}{times[-1]:8.2f} s   angle {angle:.9f} rad, off by {abs(angle - EXACT):.1e}")
    ratio = times[1] / times[0]
    print(f"ratio {ratio:.2f}, at most {LIMIT:g}")
    return int(ratio > LIMIT)


if __name__ == "__main__":
    sys.exit(main("--quick" in sys.argv[1:]))
