"""Three machines' flywheels as people find them today, written out by hand with NumPy and SciPy alone.

`by_grid` is the script over a dense grid of angles; what a script differentiates, `np.gradient` does. `by_simulation` is the
root search over simulated cycles. Both are better than most: they know that I* varies, the simulation closes its balance by
quadrature first, and the search is given where to look. Nothing here knows of jumps beforehand. All is SI.
"""

from __future__ import annotations

from collections.abc import Callable
from math import cos, pi, radians, sin, sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid, quad, solve_ivp
from scipy.optimize import brentq

Array = NDArray[np.float64]
TURN = 2 * pi
DEFAULTS: dict[str, Any] = {}
CAREFUL: dict[str, Any] = {"method": "DOP853", "rtol": 1e-9, "atol": 1e-9}
_LOOKED = 10_000  # times in a cycle at which a script looks for the extremes of the speed
_CYCLES = 100  # after which a machine that does not settle is given up


# -- the machines ----------------------------------------------------------------------------------------------------------


class Sizes(NamedTuple):
    """A slider-crank with its rod's centre of mass on the rod, and what turns with the crank (SI)."""

    r: float
    length: float
    com: float
    rod: float
    spin: float
    slider: float
    crank: float
    crank_moment: float
    g: float


def reduced(phi: float, m: Sizes) -> tuple[float, float, float, float]:
    """I*, dI*/dphi, moment of the weights (across the slider's line), x' of the slider."""
    s, c, r = sin(phi), cos(phi), m.r
    run = sqrt(m.length**2 - (r * s) ** 2)
    bend = r * r * s * c / run
    x1 = -r * s - bend
    x2 = -r * c - r * r * (c * c - s * s) / run - bend * bend / run
    turn = -r * c / run
    turn1 = r * s / run - r * c * bend / run**2
    share = m.com / m.length
    gx1, gx2 = (1 - share) * -r * s + share * x1, (1 - share) * -r * c + share * x2
    gy1, gy2 = (1 - share) * r * c, -(1 - share) * r * s
    inertia = m.crank + m.rod * (gx1**2 + gy1**2) + m.spin * turn**2 + m.slider * x1**2
    slope = 2 * (m.rod * (gx1 * gx2 + gy1 * gy2) + m.spin * turn * turn1 + m.slider * x1 * x2)
    return inertia, slope, -m.g * (m.rod * gy1 + m.crank_moment * c), x1


def _on_grid(phi: Array, m: Sizes) -> tuple[Array, Array, Array]:
    """I*, moment of the weights, x' of the slider: from positions, differentiated over the grid."""
    s, c, share = np.sin(phi), np.cos(phi), m.com / m.length
    x = m.r * c + np.sqrt(m.length**2 - (m.r * s) ** 2)
    x1, turn = np.gradient(x, phi), np.gradient(np.arcsin(-m.r * s / m.length), phi)
    gx1, gy1 = np.gradient((1 - share) * m.r * c + share * x, phi), np.gradient((1 - share) * m.r * s, phi)
    inertia = m.crank + m.rod * (gx1**2 + gy1**2) + m.spin * turn**2 + m.slider * x1**2
    return inertia, -m.g * (m.rod * gy1 + m.crank_moment * c), x1


_R, _YOKE_MASS = 0.5, 20.0


def _yoke(phi: float) -> tuple[float, float, float, float]:
    """As `reduced`, for the scotch yoke."""
    s, c = sin(phi), cos(phi)
    return _YOKE_MASS * (_R * s) ** 2, 2 * _YOKE_MASS * _R**2 * s * c, 0.0, -_R * s


def _yoke_on_grid(phi: Array) -> tuple[Array, Array, Array]:
    x1 = np.gradient(_R * np.cos(phi), phi)
    return _YOKE_MASS * x1**2, 0 * phi, x1


class Script(NamedTuple):
    """A machine, and the flywheel that is asked of it.

    `reduced` and `on_grid` make I*, (dI*/dphi,) the weights' moment and x' of what slides, of an angle or a grid; `force`
    pushes along x within a window of angles. `motor` is its torque at rest and how that falls with speed; without one, a
    constant torque closes the cycle.
    """

    reduced: Callable[[float], tuple[float, float, float, float]]
    on_grid: Callable[[Array], tuple[Array, Array, Array]]
    force: float
    window: tuple[float, float]
    speed: float
    irregularity: float
    motor: tuple[float, float] | None = None


SECTION_C = Sizes(0.2, 0.6, 0.3, 6.0, 3.0, 6.0, 1.0, 0.0, 9.81)
PRESS = Sizes(0.15, 0.6, 0.2, 18.0, 0.7, 60.0, 0.4 + 30 * 0.02**2, -30 * 0.02, 9.80665)
SCRIPTS = {
    "yoke-100rad": Script(_yoke, _yoke_on_grid, 1000.0, (0.0, pi), 100.0, 0.04),
    "press": Script(
        lambda phi: reduced(phi, PRESS),
        lambda phi: _on_grid(phi, PRESS),
        -80e3,
        (radians(300), radians(355)),
        120 * TURN / 60,
        0.05,
    ),
    "section-c": Script(
        lambda phi: reduced(phi, SECTION_C),
        lambda phi: _on_grid(phi, SECTION_C),
        0.0,
        (0.0, 0.0),
        10 / 2.387,
        0.1,
        (10.0, 2.387),
    ),
}


# -- the ways --------------------------------------------------------------------------------------------------------------


def by_grid(script: Script, count: int) -> float:
    """The flywheel (kg m²) from `count` angles: the trapezoidal rule, the greatest and the least sample.

    A torque that depends on speed is taken at the constant speed at which the cycle closes, as a grid has to.
    """
    phi = np.linspace(0.0, TURN, count + 1)
    inertia, moment, x1 = script.on_grid(phi)
    low, high = script.window
    moment = moment + np.where((phi >= low) & (phi <= high), script.force, 0.0) * x1
    mean = np.trapezoid(moment, phi) / TURN
    speed = script.speed if script.motor is None else (script.motor[0] + mean) / script.motor[1]
    work = cumulative_trapezoid(moment - mean, phi, initial=0)
    energy, eps = 0.5 * speed**2 * inertia, script.irregularity
    greatest = (work - (1 + eps / 2) ** 2 * energy).max()
    least = (work - (1 - eps / 2) ** 2 * energy).min()
    return float((greatest - least) / (eps * speed**2))


Cycle = Callable[[float, float], tuple[float, float, float]]  # inertia, speed at phi = 0: speed at 2 pi, its extremes


def by_simulation(script: Script, inputs: dict[str, Any], tolerance: float) -> float:
    """The flywheel (kg m²) by a root search over cycles that `solve_ivp` runs; `tolerance` is the search's, relative."""
    return searched(script, _simulated(script, inputs), tolerance)


def searched(script: Script, cycle: Cycle, tolerance: float) -> float:
    """The flywheel (kg m²) with which cycles have the irregularity asked; looked for about a rough grid's answer."""

    def miss(inertia: float) -> float:
        settle = _settled if script.motor is not None else _at_speed
        greatest, least = settle(script, cycle, inertia, tolerance)
        return 2 * (greatest - least) / (greatest + least) - script.irregularity

    guess = by_grid(script, 360)
    return float(brentq(miss, 0.7 * guess, 1.4 * guess, xtol=tolerance * guess, rtol=max(tolerance, 1e-15)))


def _at_speed(script: Script, cycle: Cycle, inertia: float, tolerance: float) -> tuple[float, float]:
    """Extremes of the speed (rad/s) of the cycle whose mean of extremes is what was asked."""

    def miss(start: float) -> float:
        _, greatest, least = cycle(inertia, start)
        return 0.5 * (greatest + least) - script.speed

    low, high = 0.9 * script.speed, 1.1 * script.speed
    start = brentq(miss, low, high, xtol=tolerance * script.speed, rtol=max(tolerance, 1e-15))
    return cycle(inertia, float(start))[1:]


def _settled(script: Script, cycle: Cycle, inertia: float, tolerance: float) -> tuple[float, float]:
    """Extremes of the speed (rad/s) once the speed at phi = 0 repeats."""
    start = script.speed
    for _ in range(_CYCLES):
        end, greatest, least = cycle(inertia, start)
        if abs(end - start) <= tolerance * script.irregularity * start:
            return greatest, least
        start = end
    raise RuntimeError(f"not settled after {_CYCLES} cycles")


def balance(script: Script) -> float:
    """The constant torque (N m) that closes the cycle, by adaptive quadrature."""
    low, high = script.window

    def moment(phi: float) -> float:
        _, _, weight, x1 = script.reduced(phi)
        return weight + (script.force * x1 if low <= phi < high else 0.0)

    inner = [angle for angle in script.window if 0.0 < angle < TURN]
    net = quad(moment, 0.0, TURN, points=inner or None, epsabs=1e-12, epsrel=1e-12, limit=500)[0]
    return -float(net) / TURN


def _simulated(script: Script, inputs: dict[str, Any]) -> Cycle:
    rest, fall = script.motor or (balance(script), 0.0)
    low, high = script.window

    def rates(t: float, state: Any, inertia: float) -> list[float]:
        phi, omega = float(state[0]), float(state[1])
        own, slope, moment, x1 = script.reduced(phi)
        moment += rest - fall * omega
        if low <= phi % TURN < high:
            moment += script.force * x1
        return [omega, (moment - 0.5 * slope * omega**2) / (own + inertia)]

    def passed(t: float, state: Any, inertia: float) -> float:
        return float(state[0]) - TURN

    over: Any = passed
    over.terminal = True

    def cycle(inertia: float, start: float) -> tuple[float, float, float]:
        longest = 4 * TURN / start
        run: Any = solve_ivp(rates, (0, longest), [0.0, start], events=over, args=(inertia,), dense_output=True, **inputs)
        omega = run.sol(np.linspace(0.0, run.t[-1], _LOOKED))[1]
        return float(run.y[1, -1]), float(omega.max()), float(omega.min())

    return cycle
