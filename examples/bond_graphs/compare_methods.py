"""Compare the bond graph of a slider-crank with other methods, in tables and in figures.

The others are the triangle, Raven's complex loop, natural coordinates and Lagrange's equation.

    python compare_methods.py [figure.png]

Prints how position, velocity and acceleration (imposed motion), the motion that follows from loads or a start, and the
torque that imposes a motion agree between the methods, what each method assumes and costs, and how a step that divides by
the transformer's modulus fares at the dead centres. With a file name, draws curves over one another with their residuals:
velocities and torque into that file, and every quantity over time into one beside it for each motion (figure_sine.png,
figure_steady.png, figure_rest.png, figure_free.png; figure_dynamics.png is the programme found in print). Beside the
methods stands what `flywheel.motion` finds for the scene compare_methods.toml.

- Kinematics (`compare_kinematics`): a source of flow imposes the crank's motion; the slider's position, velocity and
  acceleration follow from the graph by integration, and from the triangle in closed form. Beside them: the closed loop by
  Raven's method, natural coordinates, the velocity by the rod's instant centre, the triangle with the root cut short (small
  lambda = r/l), and what is found in print.
- Dynamics (`compare_motion`): the crank starts at theta = 0, with a speed and no load, or at rest under a torque; the graph
  against natural coordinates with multipliers and Lagrange's equation, exact and with the coefficients of small lambda.
- Kinetostatics (`compare_torques`): the torque that imposes a motion, by the effort of the source's bond and by Lagrange.
- Dead centres (`divided_by_modulus`, `printed_programme`): the crank (inertia J, torque M) moves the slider (mass m, damping
  B, load F) through v = T(theta) omega. From the slider's side, m v' = (M - J alpha)/T - B v - F, the step divides by T,
  which is 0 at both dead centres; from the crank's, J alpha = M - T (m v' + B v + F), it does not. In print the first is
  found with |T| for T, stepped by Euler.

An imposed motion and a free one are two motions, not two methods: setting the one against the other, as is sometimes done,
measures nothing but how far apart they are. Lengths run along x from the crank's pivot to the slider, so that the slider
starts at x = r + l and first moves inwards; at the dead centres v counts inwards, so that T > 0 for 0 < theta < pi, as in
the figures found in print. The closed forms do not use the graph, so that each checks the other.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import flywheel
from bondgraph import Builder, GraphError, I, R, Run, Se, Sf, simulate

Array = NDArray[np.float64]


def check_positive(*numbers: tuple[str, float]) -> None:
    """A GraphError with a line for every number, given with its name, that is not finite or not above 0."""
    wrong = [f"{name}: found {x}, expected a number above 0" for name, x in numbers if not (math.isfinite(x) and x > 0)]
    if wrong:
        raise GraphError("\n".join(wrong))


# -- the slider-crank in closed form and as a graph --------------------------------------------------------------------


@dataclass(frozen=True)
class SliderCrank:
    """A crank (a thin bar about its end), a uniform rod and a slider on a line through the pivot.

    Args:
        radius: of the crank, r, m.
        length: of the rod, l > r, m.
        crank: mass of the crank, kg; its inertia is m r²/3.
        rod: mass of the rod, kg; its inertia about its own centre is m l²/12. 0 leaves it out.
        slider: mass of the slider, kg.

    Raises:
        GraphError: if the crank cannot turn all round, or a mass is not above 0 (the rod's: below 0).

    """

    radius: float = 1.0
    length: float = 2.0
    crank: float = 1.0
    rod: float = 1.0
    slider: float = 1.0

    def __post_init__(self) -> None:
        check_positive(*((name, value) for name, value in vars(self).items() if (name, value) != ("rod", 0)))
        if not self.radius < self.length:
            raise GraphError(
                f"radius {self.radius} m, length {self.length} m: the rod must be longer than the crank to turn"
            )

    @property
    def ratio(self) -> float:
        """Lambda = r/l."""
        return self.radius / self.length

    @property
    def crank_inertia(self) -> float:
        """Of the crank about its pivot, m r²/3, kg m²."""
        return self.crank * self.radius**2 / 3

    def along(self, share: float, theta: Any, ns: Any = np) -> tuple[Any, Any, Any]:
        """Of a point on the rod (`share` 1: the slider): x = r cos theta + share l cos beta, dx/dtheta and d²x/dtheta²."""
        u, c, ratio, r = ns.sin(theta), ns.cos(theta), self.ratio, self.radius
        w = ns.sqrt(1.0 - (ratio * u) ** 2)  # cos beta
        bend = ratio * (c * c - u * u) / w + ratio**3 * (u * c) ** 2 / w**3
        return r * c + share * self.length * w, -r * (u + share * ratio * u * c / w), -r * (c + share * bend)

    def swing(self, theta: Any, ns: Any = np) -> tuple[Any, Any]:
        """The rod's angular velocity per crank's, dbeta/dtheta = lambda cos theta/cos beta, and its slope."""
        u, c, ratio = ns.sin(theta), ns.cos(theta), self.ratio
        w = ns.sqrt(1.0 - (ratio * u) ** 2)
        return ratio * c / w, -ratio * (1.0 - ratio**2) * u / w**3

    def builder(self, theta: float = 0.0) -> Builder:
        """The graph without loads: 1-junctions "crank" (displacement theta) and "slider" (displacement x), a MTF between.

        The inertias are "J", "m" and, of a rod with mass, "J_rod", "m_x", "m_y", each behind a MTF from the crank.
        """
        b = Builder().one("crank", "rotation", displacement="theta", initial=theta)
        b.one("slider", "translation", displacement="x", initial=float(self.along(1.0, theta)[0]))
        b.on("crank", I("J", self.crank_inertia)).on("slider", I("m", self.slider))
        b.transform("crank", "slider", lambda theta: self.along(1.0, theta)[1])
        if not self.rod:
            return b
        b.one("rod", "rotation").one("rod x", "translation").one("rod y", "translation")
        b.on("rod", I("J_rod", self.rod * self.length**2 / 12)).on("rod x", I("m_x", self.rod)).on(
            "rod y", I("m_y", self.rod)
        )
        b.transform("crank", "rod", lambda theta: self.swing(theta)[0])
        b.transform("crank", "rod x", lambda theta: self.along(0.5, theta)[1])
        return b.transform("crank", "rod y", lambda theta: 0.5 * self.radius * np.cos(theta))


class Imposed(NamedTuple):
    """A motion of the crank that is given: its angle (rad), its rate and the rate of that, as functions of t (s)."""

    name: str
    theta: Callable[[Any], Any]
    omega: Callable[[Any], Any]
    alpha: Callable[[Any], Any]


HARMONIC = Imposed("theta = sin t", lambda t: np.sin(t), lambda t: np.cos(t), lambda t: -np.sin(t))
STEADY = Imposed("theta = 5 t", lambda t: 5.0 * t, lambda t: 5.0 + 0.0 * t, lambda t: 0.0 * t)


class Slider(NamedTuple):
    """The slider's position (m), velocity (m/s) and acceleration (m/s²)."""

    position: Any
    velocity: Any
    acceleration: Any


def triangle(machine: SliderCrank, theta: Any, omega: Any, alpha: Any) -> Slider:
    """The slider by the triangle of crank, rod and line.

    x = r cos theta + sqrt(l² - r² sin² theta), v = -r omega (lambda sin 2theta/(2 w) + sin theta) and, with
    w = sqrt(1 - lambda² sin² theta), a = alpha dx/dtheta - r omega² (lambda cos 2theta/w + (lambda³/4) sin² 2theta/w³
    + cos theta), dx/dtheta = v/omega. The middle term is also found printed as (lambda²/2) sin 2theta/w³, which is wrong:
    it gives 1.44554 where 1.38288 is true.

    >>> float(round(-triangle(SliderCrank(), 0.3, 1.0, 0.0).acceleration, 5))
    1.38288
    """
    x, slope, bend = machine.along(1.0, theta)
    return Slider(x, slope * omega, slope * alpha + bend * omega**2)


def instant_centre(machine: SliderCrank, theta: Any, omega: Any) -> Any:
    """The slider's velocity by the rod's instant centre P, m/s: v = -omega r PA/PB, by the law of sines in the triangle PBA.

    P lies where the crank's line meets the perpendicular to the slider's way through the slider A; B is the crank's pin. The
    angle at B is theta + beta, that at A a right angle less beta: PA/PB = sin(theta + beta)/cos(beta). At theta = ±90 deg
    P is infinitely far, and the quotient 1.

    >>> machine = SliderCrank()
    >>> float(abs(instant_centre(machine, 0.3, 2.0) - triangle(machine, 0.3, 2.0, 0.0).velocity)) < 1e-15
    True
    """
    beta = np.arcsin(machine.ratio * np.sin(theta))
    return -omega * machine.radius * np.sin(theta + beta) / np.cos(beta)


def raven(machine: SliderCrank, theta: Any, omega: Any, alpha: Any) -> Slider:
    """The slider by Raven's method: the closed loop as one complex equation, which is differentiated twice.

    r e^(i theta) + l e^(i gamma) = x. Its real and imaginary parts give gamma and x (Newton's method); its derivatives are
    linear in gamma' and v, and in gamma'' and a, always with the matrix (i l e^(i gamma), -1). It is singular where the rod
    is perpendicular to the slider's line, which a rod longer than the crank never is.

    >>> exact, found = (form(SliderCrank(), 0.3, 2.0, 1.0) for form in (triangle, raven))
    >>> bool(np.abs(np.subtract(exact, found)).max() < 1e-14)
    True
    """
    theta, omega, alpha = np.broadcast_arrays(*(np.asarray(one, dtype=float) for one in (theta, omega, alpha)))
    r, length = machine.radius, machine.length
    gamma, x = np.zeros_like(theta), r * np.cos(theta) + length

    def solved(rest: Any) -> tuple[Any, Any]:
        """The two unknowns of i l e^(i gamma) u - w = rest."""
        rod = 1j * length * np.exp(1j * gamma)
        u = rest.imag / rod.imag
        return u, rod.real * u - rest.real

    for _ in range(_NEWTON):
        step, change = solved(x - r * np.exp(1j * theta) - length * np.exp(1j * gamma))
        gamma, x = gamma + step, x + change
    rate, v = solved(-1j * r * omega * np.exp(1j * theta))
    turning = length * rate**2 * np.exp(1j * gamma)
    return Slider(x, v, solved((r * omega**2 - 1j * r * alpha) * np.exp(1j * theta) + turning)[1])


def natural_coordinates(machine: SliderCrank, theta: Any, omega: Any, alpha: Any) -> Slider:
    """The slider in natural coordinates: the crank's pin (x1, y1) and the slider's (x2, 0), without any angle.

    The bodies are two constant lengths, x1² + y1² = r² and (x2 - x1)² + y1² = l²; the motion is a third equation, x1 = r cos
    theta or y1 = r sin theta, whichever is well-conditioned: one alone is singular at a dead centre, or at 90 deg.
    Newton's method solves Phi(q, t) = 0, then Phi_q q' = -Phi_t and Phi_q q'' = -(Phi_q)' q' - Phi_tt follow.

    >>> exact, found = (form(SliderCrank(), 0.3, 2.0, 1.0) for form in (triangle, natural_coordinates))
    >>> bool(np.abs(np.subtract(exact, found)).max() < 1e-14)
    True
    """
    theta, omega, alpha = np.broadcast_arrays(*(np.asarray(one, dtype=float) for one in (theta, omega, alpha)))
    r, length = machine.radius, machine.length
    u, c = np.sin(theta), np.cos(theta)
    by_x = np.abs(u) > np.abs(c)
    given = r * np.where(by_x, c, u)
    rate = r * omega * np.where(by_x, -u, c)
    bend = r * np.where(by_x, -c * omega**2 - u * alpha, -u * omega**2 + c * alpha)
    q = np.stack([r * c, r * u, r * c + length], axis=-1)
    for _ in range(_NEWTON):
        phi = np.stack([*lengths(machine, q), np.where(by_x, q[..., 0], q[..., 1]) - given], axis=-1)
        q = q - np.linalg.solve(_driven(q, by_x), phi[..., None])[..., 0]
    matrix, none = _driven(q, by_x), np.zeros_like(theta)
    v = np.linalg.solve(matrix, np.stack([none, none, rate], axis=-1)[..., None])[..., 0]
    a = np.linalg.solve(matrix, np.stack([*curvature(v), bend], axis=-1)[..., None])[..., 0]
    return Slider(q[..., 2], v[..., 2], a[..., 2])


_NEWTON = 8  # rounds: more than Newton's method needs from the position of an endless rod


def lengths(machine: SliderCrank, q: Any) -> tuple[Any, Any]:
    """Constraints of the natural coordinates x1, y1, x2, m²: half the squares of both lengths, less r²/2 and l²/2."""
    x1, y1, x2 = np.moveaxis(q, -1, 0)
    crank, rod = x1**2 + y1**2 - machine.radius**2, (x2 - x1) ** 2 + y1**2 - machine.length**2
    return 0.5 * crank, 0.5 * rod


def gradients(q: Any) -> Any:
    """Their gradients, (..., 2, 3), m: linear in the coordinates, which is what makes these natural."""
    x1, y1, x2 = np.moveaxis(q, -1, 0)
    return np.stack([np.stack([x1, y1, 0.0 * x1], axis=-1), np.stack([x1 - x2, y1, x2 - x1], axis=-1)], axis=-2)


def curvature(v: Any) -> tuple[Any, Any]:
    """Right sides of their second derivatives: minus the squares of the velocities, m²/s²."""
    x1, y1, x2 = np.moveaxis(v, -1, 0)
    return -(x1**2) - y1**2, -((x2 - x1) ** 2) - y1**2


def _driven(q: Any, by_x: Any) -> Any:
    drive = np.stack([1.0 * by_x, 1.0 - by_x, 0.0 * by_x], axis=-1)
    return np.concatenate([gradients(q), drive[..., None, :]], axis=-2)


def natural_motion(machine: SliderCrank, omega: float, torque: float, t: Array) -> Crank:
    """The crank from theta = 0 in natural coordinates: M q'' + Phi_q^T lambda = Q and Phi_q q'' = -(Phi_q)' q'.

    M is constant: a uniform bar of mass m between two points has m/3 at each and m/6 between them. Q is the torque as a pair
    of forces on the crank's pin, and lambda the bars' forces. Five unknowns in place of Lagrange's one; no derivative of an
    inertia. The lengths drift by the error of the steps, here below 1e-10 m² in 10 s.
    """
    m = machine.rod
    mass = np.diag([(machine.crank + m) / 3.0, (machine.crank + m) / 3.0, machine.slider + m / 3.0])
    mass[0, 2] = mass[2, 0] = m / 6.0

    def accelerations(q: Any, v: Any) -> Any:
        phi = gradients(q)
        full = np.block([[mass, phi.T], [phi, np.zeros((2, 2))]])
        force = torque / machine.radius**2 * np.array([-q[1], q[0], 0.0])
        return np.linalg.solve(full, np.concatenate([force, curvature(v)]))[:3]

    def rates(_: float, state: Array) -> Array:
        return np.concatenate([state[3:], accelerations(state[:3], state[3:])])

    start = [machine.radius, 0.0, machine.radius + machine.length, 0.0, machine.radius * omega, 0.0]
    found = solve_ivp(rates, (0.0, t[-1]), start, method="DOP853", rtol=1e-12, atol=1e-12, t_eval=t)
    a = np.array([accelerations(*np.split(state, 2)) for state in found.y.T]).T
    x1, y1, _, vx, vy, _ = found.y
    return Crank(np.unwrap(np.arctan2(y1, x1)), *((x1 * dy - y1 * dx) / (x1**2 + y1**2) for dx, dy in ((vx, vy), a[:2])))


def small_ratio_slider(machine: SliderCrank, theta: Any, omega: Any, alpha: Any) -> Slider:
    """The slider with the triangle's root cut short: x = l - r lambda/4 + r (cos theta + (lambda/4) cos 2theta).

    Without its constant this is the approximate position of print; it leaves out terms of the order r lambda³. With
    r = 1 m, l = 2 m it is up to 0.0179 m off, and 0.0114 m where both are taken less their mean over a turn.

    >>> machine, theta = SliderCrank(), np.linspace(0.0, 2.0 * np.pi, 7200, endpoint=False)
    >>> exact, short = (form(machine, theta, 0.0, 0.0).position for form in (triangle, small_ratio_slider))
    >>> [round(float(np.abs(gap).max()), 4) for gap in (short - exact, short - exact - (short - exact).mean())]
    [0.0179, 0.0114]
    """
    r, quarter = machine.radius, machine.ratio / 4
    slope = -r * (np.sin(theta) + 2 * quarter * np.sin(2 * theta))
    bend = -r * (np.cos(theta) + 4 * quarter * np.cos(2 * theta))
    position = machine.length - r * quarter + r * (np.cos(theta) + quarter * np.cos(2 * theta))
    return Slider(position, slope * omega, slope * alpha + bend * omega**2)


def long_rod_slider(machine: SliderCrank, theta: Any, omega: Any, alpha: Any) -> Slider:
    """The slider of an endless rod, x = r cos theta + l: what Lagrange's equation with small lambda takes for it."""
    r, u, c = machine.radius, np.sin(theta), np.cos(theta)
    return Slider(r * c + machine.length, -r * u * omega, -r * (u * alpha + c * omega**2))


def printed_acceleration(machine: SliderCrank, theta: Any, omega: Any, alpha: Any) -> Any:
    """The slider's acceleration with the middle term as it is found in print, m/s²: see `triangle`.

    >>> float(round(-printed_acceleration(SliderCrank(), 0.3, 1.0, 0.0), 5))
    1.44554
    """
    u, ratio = np.sin(theta), machine.ratio
    w, double = np.sqrt(1.0 - (ratio * u) ** 2), np.sin(2 * theta)
    wrong = ratio**2 / 2 * double / w**3 - ratio**3 / 4 * double**2 / w**3
    return triangle(machine, theta, omega, alpha).acceleration - machine.radius * omega**2 * wrong


class Inertia(NamedTuple):
    """The machine's inertia seen from the crank, J(theta) in kg m², and dJ/dtheta."""

    value: Any
    slope: Any

    def torque(self, omega: Any, alpha: Any) -> Any:
        """The torque (N m) of a motion without loads, by Lagrange: J alpha + ½ (dJ/dtheta) omega²."""
        return self.value * alpha + 0.5 * self.slope * omega**2

    def alpha(self, omega: Any, torque: float = 0.0) -> Any:
        """The acceleration of the crank under a torque (rad/s²): (M - ½ (dJ/dtheta) omega²)/J."""
        return (torque - 0.5 * self.slope * omega**2) / self.value


def exact_inertia(machine: SliderCrank, theta: Any) -> Inertia:
    """J = J_crank + (m l²/12) (dbeta/dtheta)² + m (x_G'² + y_G'²) + m_slider x'², primes by theta: no term left out.

    >>> inertia = exact_inertia(SliderCrank(), 0.0)  # 1/3 of the crank, 1/12 + 1/4 of the rod
    >>> round(float(inertia.value), 12), float(inertia.slope)
    (0.666666666667, 0.0)
    """
    swing, swing_slope = machine.swing(theta)
    _, along, along_slope = machine.along(1.0, theta)
    _, middle, middle_slope = machine.along(0.5, theta)
    across, across_slope = 0.5 * machine.radius * np.cos(theta), -0.5 * machine.radius * np.sin(theta)
    own = machine.rod * machine.length**2 / 12
    value = own * swing**2 + machine.rod * (middle**2 + across**2) + machine.slider * along**2
    slope = own * swing * swing_slope + machine.rod * (middle * middle_slope + across * across_slope)
    return Inertia(machine.crank_inertia + value, 2.0 * (slope + machine.slider * along * along_slope))


def small_ratio_inertia(machine: SliderCrank, theta: Any, *, about: str = "centre") -> Inertia:
    """J with only the lowest powers of lambda: J_crank + (m_slider + m) r² sin² theta + (J_rod + m l²/4) lambda² cos² theta.

    The slider's swing from the rod's angle is left out (x = r cos theta + l), which costs terms of the order lambda.

    Args:
        machine: the slider-crank.
        theta: angle of the crank, rad.
        about: "centre" takes J_rod = m l²/12. "end" takes m l²/3 there, a slip found in print: the inertia about the end
            already holds the m l²/4 that the formula adds.

    Raises:
        GraphError: if `about` is neither.

    """
    if about not in ("centre", "end"):
        raise GraphError(f"about: found {about!r}, expected 'centre' or 'end'")
    rod = machine.rod * machine.length**2 * ((1 / 12 if about == "centre" else 1 / 3) + 1 / 4) * machine.ratio**2
    sliding = (machine.slider + machine.rod) * machine.radius**2
    u, c = np.sin(theta), np.cos(theta)
    return Inertia(machine.crank_inertia + sliding * u * u + rod * c * c, 2.0 * (sliding - rod) * u * c)


# -- the dead centres: what a step that divides by the modulus does ---------------------------------------------------

_RUNAWAY = 1e6  # rad/s; a crank faster than this is on its way to infinity
_TIGHT = 1e-11  # relative error of the run that the schemes are measured by

Divisor = Callable[[float], float]


class Loads(NamedTuple):
    """Torque on the crank (N m), damping (N s/m) and load (N) on the slider, the load against an inward motion."""

    torque: float = 0.0
    damping: float = 0.0
    load: float = 0.0


class Passage(NamedTuple):
    """Result of one scheme: its step (s), the greatest |v - exact| (m/s; inf: it ran away), and the greatest theta (rad)."""

    scheme: str
    step: float
    error: float
    reached: float


@dataclass(frozen=True)
class Passages:
    """Every scheme with every step, and the angle (rad) that the crank truly reaches."""

    passages: tuple[Passage, ...]
    reached: float

    def errors(self, scheme: str) -> tuple[float, ...]:
        """Greatest velocity errors of one scheme, m/s, in the order of the steps."""
        found = tuple(p.error for p in self.passages if p.scheme == scheme)
        if not found:
            names = dict.fromkeys(p.scheme for p in self.passages)
            raise GraphError(f"no scheme {scheme!r}: there are {', '.join(names)}")
        return found

    def table(self) -> str:
        """The errors as text."""
        lines = [f"Euler through the dead centres; the crank truly turns to {self.reached:.4f} rad"]
        lines.append(f"{'scheme':16s}{'step, s':>10s}{'max |v - exact|':>18s}{'turns to, rad':>16s}")
        lines += [f"{p.scheme:16s}{p.step:10.0e}{p.error:18.3g}{p.reached:16.4f}" for p in self.passages]
        return "\n".join(lines)


def divided_by_modulus(
    machine: SliderCrank | None = None,
    loads: Loads = Loads(),  # noqa: B008 (immutable)
    *,
    start: tuple[float, float] = (1.0, 1.0),
    until: float = 6.0,
    steps: Sequence[float] = (1e-2, 1e-3, 1e-4),
    floor: float = 0.01,
) -> Passages:
    """A driven or free machine stepped by Euler through its dead centres, from the slider's side and from the crank's.

    From the slider's side the state is (theta, v): omega = v/T, and the slider's equation gives v'. The schemes are
    "|T|" (as found in print), "T", "T, floor" (|T| at least `floor`), and "crank side", with the state (theta, omega).
    The rod has no mass; the exact motion is that of the graph. Measured for r = 1 m, l = 2 m, J = 1/3 kg m², m = 1 kg from
    theta = 1 rad at 1 rad/s over 6 s (two to nine dead centres), greatest |v - exact| (m/s) for steps of 1e-2, 1e-3, 1e-4 s:

    ==========  ====================  ======================  ======================================================
    scheme      M = 0                 M = 1 N m               what happens
    ==========  ====================  ======================  ======================================================
    |T|         1.12, 1.10, 1.10      inf, inf, inf           turned back behind each dead centre: held at 3.14 rad,
                                                              or thrown to and fro until it runs away; 1e-5 s too
    T           1.03, 0.089, 0.0076   inf, 15, 4.9            omega = v/T there is the quotient of two errors: a kick
    T, floor    1.10, 1.10, 1.11      7.2, 6.9, 6.9           frozen: v holds no omega where T = 0, held at 3.14 rad
    crank side  0.085, 0.0085, 8e-4   2.7, 0.27, 0.027        first order in the step, as Euler is
    ==========  ====================  ======================  ======================================================

    Args:
        machine: the slider-crank; None for r = 1 m, l = 2 m and 1 kg each.
        loads: constant torque, damping and load.
        start: angle of the crank, rad, and its rate, rad/s.
        until: time to simulate, s.
        steps: lengths of step, s.
        floor: least modulus of the floored scheme, m.

    Raises:
        GraphError: if a step or the floor is not above 0.

    >>> found = divided_by_modulus(steps=(1e-2, 5e-3))
    >>> [round(a / b) for a, b in [found.errors("crank side"), found.errors("|T|")]]
    [2, 1]

    """
    _check(until, steps, floor)
    machine = replace(machine or SliderCrank(), rod=0.0)
    exact = _exact(machine, loads, start, until)
    divisors: dict[str, Divisor] = {"|T|": abs, "T": float, "T, floor": lambda t: math.copysign(max(abs(t), floor), t)}
    passages = [
        _passage(name, step, _slider_side(machine, loads, start, _count(until, step), step, divisor), exact)
        for name, divisor in divisors.items()
        for step in steps
    ]
    passages += [
        _passage("crank side", step, _crank_side(machine, loads, start, _count(until, step), step), exact) for step in steps
    ]
    return Passages(tuple(passages), float(exact.displacement("theta").max()))


def printed_programme(
    machine: SliderCrank | None = None,
    imposed: Imposed = HARMONIC,
    *,
    until: float = 10.0,
    steps: Sequence[float] = (1e-2, 1e-3, 1e-4),
    torque: str = "none",
) -> tuple[float, ...]:
    """Greatest |v - T omega| (m/s) of the programme found in print, which takes the crank's motion as known.

    It steps v' = (M - J alpha)/(|T| m) with M = 0, and alpha from second differences of theta. The motion then contradicts
    the torque: what v tends to is no velocity of the slider's. For theta = sin t over 10 s the error is 1.33, 1.32, 1.32 m/s
    at 1e-2, 1e-3, 1e-4 s; for theta = 5 t, 5.62 m/s at every step. With the torque that does impose the motion,
    J alpha + T m v', the modulus gives the force the wrong sign behind each dead centre: 1.33, 1.31, 1.30 m/s. Worse, where
    a grid point falls on a dead centre (theta = sin t over 2 pi s with 10^3, 10^4, 10^5 steps), the error of the second
    difference is divided by the rounding of T: 7e10, 7e8, 2e6 m/s.

    Args:
        machine: the slider-crank; None for r = 1 m, l = 2 m and 1 kg each. Its rod is taken without mass.
        imposed: motion of the crank.
        until: time to simulate, s.
        steps: lengths of step, s.
        torque: "none", or "needed" for the one that imposes the motion.

    Raises:
        GraphError: if `torque` is neither, or a step not above 0.

    """
    _check(until, steps, 1.0)
    if torque not in ("none", "needed"):
        raise GraphError(f"torque: found {torque!r}, expected 'none' or 'needed'")
    machine = machine or SliderCrank()
    curves = (printed_velocities(machine, imposed, _count(until, step), step, torque == "needed") for step in steps)
    return tuple(float(np.abs(stepped - true).max()) for _, stepped, true in curves)


def _check(until: float, steps: Sequence[float], floor: float) -> None:
    check_positive(("until", until), ("floor", floor), *(("steps", step) for step in steps))


def _count(until: float, step: float) -> int:
    return max(1, round(until / step))


def _exact(machine: SliderCrank, loads: Loads, start: tuple[float, float], until: float) -> Run:
    b = machine.builder(start[0]).on("crank", Se("M", loads.torque))
    b.on("slider", Se("F", loads.load), R("B", loads.damping))  # x counts outwards, so a load against v pushes along it
    return simulate(b.build(), until, initial={"crank": start[1]}, rtol=_TIGHT)


def _alpha(machine: SliderCrank, loads: Loads, theta: float, omega: float) -> tuple[float, float]:
    """The crank's acceleration, from the crank's side, and T."""
    _, slope, bend = machine.along(1.0, theta, math)
    modulus, modulus_slope = -slope, -bend
    force = machine.slider * modulus_slope * omega**2 + loads.damping * modulus * omega + loads.load
    return (loads.torque - modulus * force) / (machine.crank_inertia + machine.slider * modulus**2), modulus


def _crank_side(
    machine: SliderCrank, loads: Loads, start: tuple[float, float], count: int, step: float
) -> list[tuple[float, float]]:
    theta, omega = start
    path = []
    for _ in range(count + 1):
        alpha, modulus = _alpha(machine, loads, theta, omega)
        path.append((theta, modulus * omega))
        theta, omega = theta + step * omega, omega + step * alpha
    return path


def _slider_side(
    machine: SliderCrank, loads: Loads, start: tuple[float, float], count: int, step: float, divisor: Divisor
) -> list[tuple[float, float]]:
    """(theta, v) at every step, ending early where the crank runs away."""
    theta, path = start[0], []
    v = _alpha(machine, loads, *start)[1] * start[1]
    for _ in range(count + 1):
        path.append((theta, v))
        by = divisor(_alpha(machine, loads, theta, 0.0)[1])
        omega = v / by if by else math.inf
        if not abs(omega) < _RUNAWAY:
            return [*path, (theta, math.inf)]
        alpha = _alpha(machine, loads, theta, omega)[0]
        push = (loads.torque - machine.crank_inertia * alpha) / by
        theta, v = theta + step * omega, v + step * (push - loads.damping * v - loads.load) / machine.slider
    return path


def _passage(scheme: str, step: float, path: list[tuple[float, float]], exact: Run) -> Passage:
    theta, v = np.array(path).T
    times = np.minimum(step * np.arange(v.size), exact.t[-1])
    return Passage(scheme, step, float(np.abs(v + exact.flow("slider", times)).max()), float(theta.max()))


def printed_velocities(
    machine: SliderCrank, imposed: Imposed, count: int, step: float, needed: bool
) -> tuple[Array, Array, Array]:
    """Times, the slider's velocity as that programme steps it, and T omega, both counted inwards."""
    t = step * np.arange(count + 2)
    theta = np.asarray(imposed.theta(t), dtype=float)
    omega, alpha = imposed.omega(t), imposed.alpha(t)
    _, slope, bend = machine.along(1.0, theta)
    acceleration = -(slope * alpha + bend * omega**2)
    torque: Any = machine.crank_inertia * alpha - slope * machine.slider * acceleration if needed else 0.0 * t
    differences = np.diff(theta, 2) / step**2
    inside = slice(1, count)  # it starts one step late, past the dead centre at theta = 0
    with np.errstate(divide="ignore", invalid="ignore"):
        rate = (torque[inside] - machine.crank_inertia * differences[inside]) / (np.abs(slope[inside]) * machine.slider)
    v = np.concatenate(([0.0], np.cumsum(step * rate)))
    return t[1 : count + 1], v, (-slope * omega)[1 : count + 1]


# -- statistics ---------------------------------------------------------------------------------------------------------


class Agreement(NamedTuple):
    """Agreement of a curve with its reference.

    pearson: r, the covariance over both standard deviations; blind to scale and offset. coefficient:
    sqrt|1 - SS_res/SS_tot|, at times called Pearson's though it is not r: it does see scale and offset, but the modulus
    lets it come back towards and past 1 when the fit is bad (a curve against its own mirror image has r = -1 and sqrt 3).
    mean, greatest: of the residual's absolute value.
    """

    pearson: float
    coefficient: float
    mean: float
    greatest: float


def agreement(curve: Any, reference: Any) -> Agreement:
    """Agreement of a curve with a reference at the same times.

    Raises:
        GraphError: if a curve has a value that is no number, or does not vary, so that no correlation exists.

    >>> t = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
    >>> [round(x, 6) for x in agreement(np.sin(t) + 0.5, np.sin(t))]
    [1.0, 0.707107, 0.5, 0.5]

    """
    a, b = np.asarray(curve, dtype=float), np.asarray(reference, dtype=float)
    if a.shape != b.shape or a.ndim != 1:
        raise GraphError(f"agreement: found curves of shape {a.shape} and {b.shape}, expected the same times")
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        raise GraphError("agreement: a curve has values that are no numbers")
    if a.size < 2 or np.ptp(a) == 0.0 or np.ptp(b) == 0.0:
        raise GraphError("agreement: a curve does not vary, so nothing correlates with it; compare residuals instead")
    residual, spread, other = np.abs(a - b), b - b.mean(), a - a.mean()
    pearson = float(other @ spread / math.sqrt((other @ other) * (spread @ spread)))
    coefficient = math.sqrt(abs(1.0 - float(residual @ residual) / float(spread @ spread)))
    return Agreement(pearson, coefficient, float(residual.mean()), float(residual.max()))


@dataclass(frozen=True, eq=False)
class Quantity:
    """One quantity by several methods at the same times, one of them the reference."""

    name: str
    unit: str
    reference: str
    curves: Mapping[str, Array]

    def residual(self, method: str) -> Array:
        """Curve minus reference."""
        return np.asarray(self._curve(method) - self.curves[self.reference])

    def agreement(self, method: str) -> Agreement:
        """Agreement of a method's curve with the reference."""
        return agreement(self._curve(method), self.curves[self.reference])

    def _curve(self, method: str) -> Array:
        if method not in self.curves:
            raise GraphError(f"{self.name}: no method {method!r}: there are {', '.join(self.curves)}")
        return self.curves[method]


@dataclass(frozen=True, eq=False)
class Comparison:
    """Methods side by side: `comparison[quantity]` holds the curves, `table()` the statistics, `seconds` what each took."""

    title: str
    t: Array
    quantities: tuple[Quantity, ...]
    seconds: Mapping[str, float] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Quantity:
        found = next((q for q in self.quantities if q.name == name), None)
        if found is None:
            raise GraphError(f"no quantity {name!r}: there are {', '.join(q.name for q in self.quantities)}")
        return found

    def table(self) -> str:
        """The statistics of every quantity and method, as text."""
        lines = [f"{self.title}; reference: {self.quantities[0].reference}"]
        lines.append(f"{'':52s}{'mean |res|':>11s}{'greatest':>11s}{'Pearson r':>15s}{'sqrt|1-SSr/SSt|':>17s}")
        for quantity in self.quantities:
            for method in quantity.curves:
                if method != quantity.reference:
                    found = quantity.agreement(method)
                    label = f"{quantity.name}, {quantity.unit}: {method}"
                    numbers = f"{found.mean:11.2e}{found.greatest:11.2e}{found.pearson:15.10f}{found.coefficient:17.10f}"
                    lines.append(f"{label:52s}{numbers}")
        return "\n".join(lines)


# -- the comparisons ----------------------------------------------------------------------------------------------------


def compare_kinematics(
    machine: SliderCrank | None = None, imposed: Imposed = HARMONIC, *, until: float = 10.0, step: float = 0.01
) -> Comparison:
    """The slider of an imposed motion: the graph integrated by four methods, against the triangle.

    The graph's crank has a source of flow; the position is the integral of the slider's flow, the acceleration the effort of
    its inertia over its mass. With theta = sin t and steps of 0.01 s the greatest error of the velocity is 1.5e-2 m/s by
    Euler, 4.3e-6 by rk2, 1.8e-12 by rk4. With theta = 5 t every method has the velocity right, as the angle is linear in t,
    while the position still shows its order: 2.8e-2, 4.7e-4, 1.2e-8 m.

    Args:
        machine: the slider-crank; None for r = 1 m, l = 2 m and 1 kg each.
        imposed: motion of the crank.
        until: time to simulate, s.
        step: of the fixed-step methods, s.

    Raises:
        GraphError: if `until` or `step` is not above 0.

    >>> found = compare_kinematics(until=1.0, step=0.1)["velocity"]
    >>> [found.agreement(method).greatest < 1e-3 for method in ("euler", "rk2", "DOP853")]
    [False, True, True]

    """
    machine = machine or SliderCrank()
    source = Sf("drive", imposed.omega)
    graph = machine.builder(float(imposed.theta(0.0))).on("crank", source).build()
    clock = Clock()
    runs = {name: clock(name, simulate, graph, until, method=name, step=step) for name in ("euler", "rk2", "rk4")}
    runs["DOP853"] = clock("DOP853", simulate, graph, until, rtol=_TIGHT)
    t, bond = runs["euler"].t, graph.bond_of("m").number
    crank = machine, imposed.theta(t), imposed.omega(t), imposed.alpha(t)
    exact = clock("triangle", triangle, *crank)
    short, long = clock(SHORT, small_ratio_slider, *crank), long_rod_slider(*crank)
    by_pole = clock(POLE, instant_centre, *crank[:3])
    loops = {RAVEN: clock(RAVEN, raven, *crank), NATURAL: clock(NATURAL, natural_coordinates, *crank)}
    printed = {"as printed": printed_acceleration(*crank)}
    if np.any(crank[3]):
        printed["as printed, alpha left at 0"] = printed_acceleration(*crank[:3], 0.0)

    def quantity(k: int, name: str, unit: str, by_run: Callable[[Any], Array], **more: Array) -> Quantity:
        by_graph = {method: by_run(run) for method, run in runs.items()}
        curves = {"triangle": exact[k]} | {method: found[k] for method, found in loops.items()}
        return Quantity(name, unit, "triangle", curves | more | by_graph | {SHORT: short[k], LONG: long[k]})

    swing = {"triangle": exact[0] - exact[0].mean(), f"{SHORT} (eq. 86)": short[0] - short[0].mean()}
    quantities = (
        quantity(0, "position", "m", lambda run: run.displacement("x", t)),
        Quantity("position less its mean", "m", "triangle", swing),
        quantity(1, "velocity", "m/s", lambda run: run.flow("slider", t), **{POLE: by_pole}),
        quantity(2, "acceleration", "m/s²", lambda run: run.effort(bond, t) / machine.slider, **printed),
    )
    return Comparison(f"slider, {imposed.name} imposed on the crank", t, quantities, clock.seconds)


POLE, SHORT, LONG, LIBRARY = "instant centre", "small lambda", "endless rod", "flywheel.motion"
RAVEN, NATURAL = "Raven", "natural coordinates"


class Clock:
    """Calls things and keeps the processor's seconds of each, by name."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    def __call__(self, name: str, call: Callable[..., Any], *args: Any, **options: Any) -> Any:
        """Returns the result of a call, and adds its time."""
        begun = time.process_time()
        found = call(*args, **options)
        self.seconds[name] = time.process_time() - begun
        return found


def lagrange_methods(machine: SliderCrank) -> dict[str, Callable[[Any], Inertia]]:
    """Inertia of the machine by every version of Lagrange's equation, by name; the first is exact."""
    return {
        "exact Lagrange": lambda theta: exact_inertia(machine, theta),
        "small lambda": lambda theta: small_ratio_inertia(machine, theta),
        "small lambda, m l²/3": lambda theta: small_ratio_inertia(machine, theta, about="end"),
    }


def compare_motion(
    machine: SliderCrank | None = None, *, omega: float = 1.0, torque: float = 0.0, until: float = 10.0, points: int = 501
) -> Comparison:
    """The motion from theta = 0: the graph and two approximate Lagrange equations, against the exact one.

    All are integrated by DOP853. The slider takes its exact law in every version, so that it shows what the coefficients do
    to the crank. Without a torque and from 1 rad/s, the default machine's graph agrees over 10 s (6.9 rad) to 2e-11 rad; the
    small-lambda crank is up to 0.15 rad off, with m l²/3 for the rod 0.96 rad, and r of its omega falls to 0.907 and 0.381.
    There the programme found in print stands beside them, which overwrites theta with sin t at every step of Euler's: its
    omega belongs to no motion.

    Args:
        machine: the slider-crank; None for r = 1 m, l = 2 m and 1 kg each.
        omega: angular velocity at the start, rad/s.
        torque: constant, on the crank, N m.
        until: time to simulate, s.
        points: number of times at which the methods are compared.

    Raises:
        GraphError: if `until` is not above 0, or fewer than 2 points are asked for.

    """
    machine, clock = machine or SliderCrank(), Clock()
    t = _times(until, points)
    states: dict[str, Crank] = {}
    for name, inertia in lagrange_methods(machine).items():
        theta, rate = clock(name, _moved, inertia, omega, torque, t)
        states[name] = Crank(theta, rate, inertia(theta).alpha(rate, torque))
    graph = machine.builder().on("crank", Se("M", torque)).build()
    run = clock("bond graph", simulate, graph, until, initial={"crank": omega}, rtol=_TIGHT)
    push, pull = (run.effort(graph.bond_of(name).number, t) for name in ("J", "m"))
    by_graph = Crank(run.displacement("theta", t), run.flow("crank", t), push / machine.crank_inertia)
    states = {"bond graph": by_graph, NATURAL: clock(NATURAL, natural_motion, machine, omega, torque, t)} | states
    if not torque:
        states["theta overwritten, as printed"] = _overwritten(machine, omega, t)
    sliders = {name: triangle(machine, *state) for name, state in states.items()}
    sliders["bond graph"] = Slider(run.displacement("x", t), run.flow("slider", t), pull / machine.slider)
    quantities = [Quantity(*of, {n: s[k] for n, s in states.items()}) for k, of in enumerate(_CRANK)]
    quantities += [Quantity(*of, {n: s[k] for n, s in sliders.items()}) for k, of in enumerate(_SLIDER)]
    start = f"from rest under {torque:g} N m" if torque else f"free motion from {omega:g} rad/s"
    return Comparison(start, t, tuple(quantities), clock.seconds)


class Crank(NamedTuple):
    """The crank's angle (rad), angular velocity (rad/s) and acceleration (rad/s²)."""

    theta: Any
    omega: Any
    alpha: Any


_CRANK = tuple((name, unit, "exact Lagrange") for name, unit in (("theta", "rad"), ("omega", "rad/s"), ("alpha", "rad/s²")))
_SLIDER = tuple(
    (name, u, "exact Lagrange") for name, u in (("position", "m"), ("velocity", "m/s"), ("acceleration", "m/s²"))
)


def _overwritten(machine: SliderCrank, omega: float, t: Array) -> Crank:
    """Euler's steps of the small-lambda equation (m l²/3 for the rod) that set out from sin t, not from the last angle."""
    path, theta, rate = [], 0.0, omega
    for before, step in zip(t, np.append(np.diff(t), 0.0), strict=True):
        alpha = float(small_ratio_inertia(machine, theta, about="end").alpha(rate))
        path.append((theta, rate, alpha))
        theta, rate = math.sin(before) + step * rate, rate + step * alpha
    return Crank(*np.array(path).T)


def _times(until: float, points: int) -> Array:
    check_positive(("until", until))
    if points < 2:
        raise GraphError(f"points: found {points}, expected 2 or more")
    return np.linspace(0.0, until, points)


def _moved(inertia: Callable[[Any], Inertia], omega: float, torque: float, t: Array) -> tuple[Array, Array]:
    def rates(_: float, state: Array) -> list[Any]:
        return [state[1], inertia(state[0]).alpha(state[1], torque)]

    found = solve_ivp(rates, (0.0, t[-1]), [0.0, omega], method="DOP853", rtol=1e-12, atol=1e-12, t_eval=t)
    return found.y[0], found.y[1]


def compare_torques(
    machine: SliderCrank | None = None, imposed: Imposed = HARMONIC, *, until: float = 10.0, points: int = 501
) -> Comparison:
    """The torque that imposes a motion: the effort of the source's bond, and Lagrange's J alpha + ½ J' omega².

    The graph finds its angle by integration; with the default machine it agrees with the exact equation to 5e-12 N m, while
    the small-lambda coefficients are up to 0.72 N m off for theta = sin t (of 2.6) and 22 N m for theta = 5 t (of 33). For
    constant omega the two small-lambda torques differ by a factor alone, so that Pearson's r cannot tell them apart.

    Args:
        machine: the slider-crank; None for r = 1 m, l = 2 m and 1 kg each.
        imposed: motion of the crank.
        until: time to simulate, s.
        points: number of times at which the methods are compared.

    Raises:
        GraphError: if `until` is not above 0, or fewer than 2 points are asked for.

    """
    machine = machine or SliderCrank()
    t = _times(until, points)
    graph = machine.builder(float(imposed.theta(0.0))).on("crank", Sf("drive", imposed.omega)).build()
    torque = simulate(graph, until, rtol=_TIGHT).effort(graph.bond_of("drive").number, t)
    curves = {"bond graph": torque}
    for name, inertia in lagrange_methods(machine).items():
        curves[name] = inertia(imposed.theta(t)).torque(imposed.omega(t), imposed.alpha(t))
    quantity = Quantity("torque", "N m", "exact Lagrange", curves)
    return Comparison(f"torque on the crank, {imposed.name}", t, (quantity,))


# -- tables and the figure ---------------------------------------------------------------------------------------------

BLUE, VERMILLION, GREEN, BLACK, GREY = "#0072B2", "#D55E00", "#009E73", "#000000", "#999999"
ORANGE, PURPLE, SKY, BROWN = "#E69F00", "#CC79A7", "#56B4E9", "#8C510A"
STYLES: dict[str, Any] = {
    "triangle": {"color": GREY, "linewidth": 4.0, "zorder": 1},
    "exact Lagrange": {"color": GREY, "linewidth": 4.0, "zorder": 1},
    RAVEN: {"color": "#332288", "linestyle": (0, (4, 4))},
    NATURAL: {"color": "#117733", "linestyle": (4, (4, 4))},
    POLE: {"color": PURPLE, "linestyle": (0, (1, 2)), "linewidth": 2.5},
    "as printed": {"color": BROWN, "linestyle": "--"},
    "as printed, alpha left at 0": {"color": BROWN, "linestyle": ":"},
    "euler": {"color": VERMILLION, "linestyle": "--"},
    "rk2": {"color": GREEN, "linestyle": "-."},
    "rk4": {"color": BLUE, "linestyle": ":"},
    "DOP853": {"color": BLACK, "linewidth": 1.0},
    "bond graph": {"color": BLACK, "linewidth": 1.0},
    SHORT: {"color": SKY, "linestyle": "--"},
    LIBRARY: {"color": "#882255", "linewidth": 1.0, "linestyle": (0, (6, 3))},
    LONG: {"color": ORANGE, "linestyle": "-."},
    "small lambda, m l²/3": {"color": VERMILLION, "linestyle": "-."},
    "theta overwritten, as printed": {"color": PURPLE, "linestyle": ":"},
}
SMALLEST = 1e-17  # residuals below it are drawn here: a logarithm has no zero


def overlay(panel: Any, comparison: Comparison, name: str) -> None:
    """The curves of one quantity over one another."""
    quantity = comparison[name]
    for method, curve in quantity.curves.items():
        panel.plot(comparison.t, curve, label=method, **STYLES[method])
    panel.set(title=comparison.title, xlabel="t, s", ylabel=f"{name}, {quantity.unit}")


def residuals(panel: Any, comparison: Comparison, name: str) -> None:
    """Their residuals, on a logarithmic scale."""
    quantity = comparison[name]
    for method in quantity.curves:
        if method != quantity.reference:
            panel.semilogy(comparison.t, abs(quantity.residual(method)).clip(SMALLEST), label=method, **STYLES[method])
    panel.set(title=f"residual to {quantity.reference}", xlabel="t, s", ylabel=f"|residual|, {quantity.unit}")
    panel.set_ylim(SMALLEST, 1e2)


def draw(columns: list[tuple[Comparison, str]], path: str) -> None:
    """One column for each comparison: curves above, residuals below."""
    figure = Figure(figsize=(15.0, 8.5), layout="constrained")
    FigureCanvasAgg(figure)
    for (above, below), (comparison, name) in zip(figure.subplots(2, len(columns)).T, columns, strict=True):
        overlay(above, comparison, name)
        residuals(below, comparison, name)
        above.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3, fontsize="small", frameon=False)
        for panel in (above, below):
            panel.grid(color="#DDDDDD", linewidth=0.6)
    figure.savefig(path, dpi=100)


def stepped(machine: SliderCrank, path: Path) -> None:
    """The slider's velocity by the transformer and by the dynamics that divides by |T|, for both imposed motions."""
    figure = Figure(figsize=(13.0, 4.2), layout="constrained")
    FigureCanvasAgg(figure)
    for panel, imposed in zip(figure.subplots(1, 2), (HARMONIC, STEADY), strict=True):
        for needed, label, style in ((False, "no torque, as printed", "euler"), (True, "the torque that it takes", "rk4")):
            t, dynamics, transformer = printed_velocities(machine, imposed, 1000, 0.01, needed)
            panel.plot(t, dynamics, label=f"by v' = (M - J alpha)/(|T| m): {label}", **STYLES[style])
        panel.plot(t, transformer, label="by the transformer, v = T omega", **STYLES["triangle"])
        panel.set(title=imposed.name, xlabel="t, s", ylabel="slider's velocity inwards, m/s", xlim=(0.0, 10.0))
        panel.grid(color="#DDDDDD", linewidth=0.6)
    figure.legend(*panel.get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False)
    figure.savefig(path, dpi=100)


def course(comparison: Comparison, rows: Sequence[str], path: Path, until: float | None = None) -> None:
    """Quantities over time, one below the other: the curves on the left, their residuals on the right, one legend."""
    height = 2.6 * len(rows) + 1.0
    figure = Figure(figsize=(13.0, height))
    FigureCanvasAgg(figure)
    panels = figure.subplots(len(rows), 2, sharex=True, squeeze=False)
    lines: dict[str, Any] = {}
    for row, (left, right) in zip(rows, panels, strict=True):
        overlay(left, comparison, row)
        residuals(right, comparison, row)
        lines |= {line.get_label(): line for line in left.get_lines()}
        for panel in (left, right):
            panel.grid(color="#DDDDDD", linewidth=0.6)
            panel.set(title="", xlabel="t, s" if row == rows[-1] else "", xlim=(0.0, until or comparison.t[-1]))
        right.set_ylabel(f"|residual|, {comparison[row].unit}")
    panels[0][0].set_title(comparison.title)
    panels[0][1].set_title(f"residual to {comparison.quantities[0].reference}")
    figure.legend(lines.values(), lines.keys(), loc="lower center", ncols=6, frameon=False)
    figure.subplots_adjust(0.06, 1.2 / height, 0.98, 1.0 - 0.4 / height, wspace=0.15, hspace=0.1)
    figure.savefig(path, dpi=100)


def with_library(comparison: Comparison, found: flywheel.Kinematics) -> Comparison:
    """The comparison with the library's own motion of crank and slider at the same times."""
    crank, slider = found["crank"], found["slider"]
    names = dict(zip(CRANK + SLIDER, (*crank[3:6], *slider[3:6]), strict=True))
    quantities = tuple(
        replace(quantity, curves={**quantity.curves, LIBRARY: names[quantity.name]}) if quantity.name in names else quantity
        for quantity in comparison.quantities
    )
    return replace(comparison, quantities=quantities)


CRANK, SLIDER = ("theta", "omega", "alpha"), ("position", "velocity", "acceleration")


def methods(kinematics: Comparison, rest: Comparison) -> str:
    """Assumptions and cost of every method: the velocity's greatest error and the processor's time for all points."""
    imposed = (
        ("triangle", "nothing", "a formula for each quantity, by hand for each mechanism"),
        (POLE, "nothing", "a formula for velocities alone"),
        (RAVEN, "nothing", "the closed loop, complex: 2 unknowns, Newton, then 2 linear equations"),
        (NATURAL, "nothing", "points for coordinates: 3 unknowns, Newton, then 3 linear equations"),
        (SHORT, "(r/l)² small", "a shorter formula"),
        ("euler", "nothing", "bond graph: equations of first order; order 1 in the step"),
        ("rk2", "nothing", "bond graph, order 2"),
        ("rk4", "nothing", "bond graph, order 4"),
        ("DOP853", "nothing", "bond graph, order 8, the step chosen for the tolerance"),
    )
    moved = (
        ("exact Lagrange", "no friction but viscous", "one equation of second order, by hand for each mechanism"),
        (SHORT, "(r/l)² small", "the same with shorter coefficients"),
        (NATURAL, "nothing", "constant masses, 5 linear equations a step; forces in the bars with it"),
        ("bond graph", "nothing", "assembled from parts; forces in every bond with it"),
    )
    lines = []
    for comparison, rows in ((kinematics, imposed), (rest, moved)):
        velocity = comparison["velocity"]
        lines.append(f"{comparison.title}, {comparison.t.size} points")
        lines.append(f"  {'method':20s}{'error of v, m/s':>16s}{'time, ms':>10s}  {'assumes':26s}what it is")
        for name, assumed, kind in rows:
            error = "reference" if name == velocity.reference else f"{velocity.agreement(name).greatest:.1e}"
            lines.append(f"  {name:20s}{error:>16s}{1e3 * comparison.seconds[name]:10.2f}  {assumed:26s}{kind}")
    return "\n".join(lines)


def imposed_on(imposed: Imposed, t: Array) -> tuple[Any, Any, Any]:
    """A motion of the crank as `flywheel.motion` takes it."""
    return imposed.theta(t), imposed.omega(t), imposed.alpha(t)


def main(path: str | None = None) -> None:
    """Print the tables; draw the figures if the name of one is given."""
    machine, scene = SliderCrank(), flywheel.load(Path(__file__).with_suffix(".toml"))
    kinematics = []
    for imposed in (HARMONIC, STEADY):
        found = compare_kinematics(machine, imposed, step=0.02)
        law = partial(imposed_on, imposed)
        kinematics.append(with_library(found, flywheel.motion(scene, law=law, until=found.t[-1], at=found.t)))
    free, rest = compare_motion(machine), compare_motion(machine, omega=0.0, torque=1.0, until=5.0)
    runs = [
        flywheel.simulate(moved, phi=0.0, omega=omega, until=until, rtol=1e-10)
        for moved, omega, until in ((replace(scene, drive=None), 1.0, 10.0), (scene, 0.0, 5.0))
    ]
    free, rest = (
        with_library(c, flywheel.motion(scene, transient=run, at=c.t)) for c, run in zip((free, rest), runs, strict=True)
    )
    torques = [compare_torques(machine, imposed) for imposed in (HARMONIC, STEADY)]
    for comparison in (*kinematics, free, rest, *torques):
        print(comparison.table(), end="\n\n")
    print(methods(kinematics[0], rest), end="\n\n")
    for torque in (0.0, 1.0):
        print(f"M = {torque:g} N m: {divided_by_modulus(machine, Loads(torque), steps=(1e-2, 1e-3)).table()}", end="\n\n")
    print("the programme found in print, greatest |v - T omega|, m/s, at steps of 0.01 and 0.001 s")
    for imposed in (HARMONIC, STEADY):
        for torque_taken in ("none", "needed"):
            errors = printed_programme(machine, imposed, steps=(1e-2, 1e-3), torque=torque_taken)
            print(f"{imposed.name:16s}torque: {torque_taken:8s}" + "".join(f"{error:10.3g}" for error in errors))
    if path is not None:
        draw([(kinematics[0], "velocity"), (free, "velocity"), (torques[0], "torque")], path)
        file = Path(path)
        for name, comparison, rows, until in (
            ("sine", kinematics[0], SLIDER, None),
            ("steady", kinematics[1], SLIDER, 4.0),  # three turns of eight
            ("rest", rest, CRANK + SLIDER, None),
            ("free", free, CRANK + SLIDER, None),
        ):
            course(comparison, rows, file.with_stem(f"{file.stem}_{name}"), until)
        stepped(machine, file.with_stem(f"{file.stem}_dynamics"))
        print(f"drawn: {path} and five beside it")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else None)
