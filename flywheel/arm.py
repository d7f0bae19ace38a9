"""An open arm of two bars in a vertical plane: two degrees of freedom, by Lagrange's equations.

The shoulder is a pin on the frame, the elbow a pin between the bars. Coordinates q1, q2 (rad) are the bars' own angles from
the upward vertical, counter-clockwise: a point at distance s along bar 1 stands at x = -s sin q1, y = s cos q1. Torques:
T1 of the frame on bar 1, T2 of bar 1 on bar 2, so that Q1 = T1 - T2 and Q2 = T2. With

    A = I1 + m1 c1² + m2 l1²,   B = m2 l1 c2,   C = I2 + m2 c2²   (kg m²)
    G1 = (m1 c1 + m2 l1) g,     G2 = m2 c2 g                      (N m)

the kinetic energy is T = ½ A q1'² + ½ C q2'² + B q1' q2' cos(q1 - q2), the potential energy V = G1 cos q1 + G2 cos q2, and

    A q1'' + B cos(q1 - q2) q2'' + B sin(q1 - q2) q2'² - G1 sin q1 = T1 - T2
    B cos(q1 - q2) q1'' + C q2'' - B sin(q1 - q2) q1'² - G2 sin q2 = T2

Angles, speeds, accelerations and torques are arrays of shape (2, ...): one row a bar or joint. Valid for rigid bars, whose
centres of mass lie on the lines between their pins, and pins without play. Source: the course, p. 68, example 3, with any
bars. (It prints the cross term of v_G2² as 2 l1 l2 in one line; l1 l2, as in the next, is right.)

>>> arm = TwoLinkArm(slender(1.0, 3.0), slender(0.5, 1.2), gravity=10.0)
>>> driving_torques(arm, [0.0, 0.0], [0.0, 0.0], [1.0, 1.0]).round(12).tolist()
[2.9, 0.4]
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.numerics.faults import (
    ANY,
    NOT_NEGATIVE,
    POSITIVE,
    Fault,
    SceneError,
    array,
    brief,
    number_faults,
    refuse,
    require,
)

if TYPE_CHECKING:
    import sympy as sp  # type: ignore[import-untyped]

__all__ = [
    "ArmMotion", "Bar", "LagrangeEquations", "Reactions", "TwoLinkArm", "accelerations", "driving_torques", "energy",
    "lagrange_equations", "mass_matrix", "reactions", "rest", "simulate_arm", "slender",
]  # fmt: skip

Array = NDArray[np.float64]


class Bar(NamedTuple):
    """A bar: length between its pins (m), mass (kg), inertia about its centre of mass (kg m²), `com` (m).

    `com` is the distance of the centre of mass from the first pin, along the bar.
    """

    length: float
    mass: float
    inertia: float
    com: float


def slender(length: float, mass: float) -> Bar:
    """A thin uniform bar of a length (m) and a mass (kg): centre in the middle, I = m l²/12.

    Raises SceneError unless both are above 0.

    >>> slender(2.0, 3.0)
    Bar(length=2.0, mass=3.0, inertia=1.0, com=1.0)
    """
    refuse([*number_faults("length", length, POSITIVE, "m"), *number_faults("mass", mass, POSITIVE, "kg")])
    return Bar(length, mass, mass * length**2 / 12, length / 2)


class Constants(NamedTuple):
    """Constants of the equations: A, B, C (kg m²), G1, G2 (N m), and `least` = A C - B² (kg² m⁴)."""

    A: float
    B: float
    C: float
    G1: float
    G2: float
    least: float


class Reactions(NamedTuple):
    """Forces (N), x and y, shape (2, ...): of the frame on bar 1 at the shoulder, of bar 1 on bar 2 at the elbow."""

    shoulder: Array
    elbow: Array


@dataclass(frozen=True)
class TwoLinkArm:
    """Two bars, the second hinged to the end of the first, in gravity g (m/s²) along -y.

    Raises SceneError for invalid sizes, or if a bar can turn without inertia.

    >>> TwoLinkArm(slender(1.0, 3.0), slender(0.5, 1.2)).constants.B
    0.3
    """

    first: Bar
    second: Bar
    gravity: float = 9.80665

    def __post_init__(self) -> None:
        limits = (POSITIVE, "m"), (POSITIVE, "kg"), (NOT_NEGATIVE, "kg m²"), (ANY, "m")
        faults = []
        for name, bar in (("first", self.first), ("second", self.second)):
            if not isinstance(bar, Bar):
                faults.append(Fault(name, brief(bar), "a Bar"))
                continue
            for (key, value), limit in zip(bar._asdict().items(), limits, strict=True):
                faults += number_faults(f"{name}.{key}", value, *limit)
        faults += number_faults("gravity", self.gravity, unit="m/s²")
        if not faults and not self.constants.least > 0.0:
            defect = "bars that can turn without moving any mass"
            faults.append(Fault("arm", defect, "inertia about the pins", "give a bar an inertia, or its mass a distance"))
        refuse(faults)

    @cached_property
    def constants(self) -> Constants:
        """A, B, C, G1, G2, and A C - B² as a sum of positive terms."""
        (l1, m1, i1, c1), (_, m2, i2, c2) = self.first, self.second
        own, second = i1 + m1 * c1**2, i2 + m2 * c2**2
        least = own * second + m2 * l1**2 * i2
        weights = (m1 * c1 + m2 * l1) * self.gravity, m2 * c2 * self.gravity
        return Constants(own + m2 * l1**2, m2 * l1 * c2, second, *weights, least)


def mass_matrix(arm: TwoLinkArm, q: ArrayLike) -> Array:
    """M(q) = [[A, B cos(q1 - q2)], [B cos(q1 - q2), C]], kg m², shape (2, 2, ...); always positive definite.

    Args:
        arm: the arm.
        q: angles, rad, shape (2, ...).

    >>> mass_matrix(TwoLinkArm(slender(1.0, 3.0), slender(0.5, 1.2)), [0.0, 0.0]).round(12).tolist()
    [[2.2, 0.3], [0.3, 0.1]]

    """
    (angles,) = _pairs(arm, q=q)
    k = arm.constants
    across = k.B * np.cos(angles[0] - angles[1])
    return np.stack((np.stack((k.A + 0 * across, across)), np.stack((across, k.C + 0 * across))))


def rest(arm: TwoLinkArm, q: ArrayLike, qdot: ArrayLike) -> Array:
    """The terms of the equations without accelerations, N m, shape (2, ...): centrifugal ones and gravity.

    B sin(q1 - q2) q2'² - G1 sin q1 and -B sin(q1 - q2) q1'² - G2 sin q2. (In the bars' own angles there is no product
    q1' q2'; it comes with the elbow's relative angle as a coordinate.)

    Args:
        arm: the arm.
        q: angles, rad, shape (2, ...).
        qdot: speeds, rad/s, same shape.

    >>> arm = TwoLinkArm(slender(1.0, 3.0), slender(0.5, 1.2), gravity=10.0)
    >>> rest(arm, [np.pi / 2, np.pi / 2], [0.0, 2.0]).round(12).tolist()
    [-27.0, -3.0]

    """
    (q1, q2), (w1, w2) = _pairs(arm, q=q, qdot=qdot)
    k = arm.constants
    bend = k.B * np.sin(q1 - q2)
    return np.stack((bend * w2**2 - k.G1 * np.sin(q1), -bend * w1**2 - k.G2 * np.sin(q2)))


def driving_torques(arm: TwoLinkArm, q: ArrayLike, qdot: ArrayLike, qddot: ArrayLike) -> Array:
    """Inverse dynamics: T1, T2 (N m), shape (2, ...), for a given motion.

    T2 = row 2 of M q'' + rest; T1 = row 1 + T2.

    Args:
        arm: the arm.
        q: angles, rad, shape (2, ...).
        qdot: speeds, rad/s, same shape.
        qddot: accelerations, rad/s², same shape.

    Raises:
        SceneError: if an argument is not a pair of finite values.

    >>> arm = TwoLinkArm(slender(1.0, 3.0), slender(0.5, 1.2), gravity=10.0)
    >>> driving_torques(arm, [np.pi / 2, np.pi / 2], [0.0, 0.0], [0.0, 0.0]).round(12).tolist()  # held out level
    [-30.0, -3.0]

    """
    angles, turning = _pairs(arm, q=q, qddot=qddot)
    first, second = np.einsum("ij...,j...->i...", mass_matrix(arm, angles), turning) + rest(arm, angles, qdot)
    return np.stack((first + second, second))


def accelerations(arm: TwoLinkArm, q: ArrayLike, qdot: ArrayLike, torques: ArrayLike = (0.0, 0.0)) -> Array:
    """Direct dynamics: q'' (rad/s²), shape (2, ...), under torques T1, T2.

    M q'' = (T1 - T2, T2) - rest, by Cramer's rule with det M = (A C - B²) + B² sin²(q1 - q2), a sum of positive terms.

    Args:
        arm: the arm.
        q: angles, rad, shape (2, ...).
        qdot: speeds, rad/s, same shape.
        torques: T1, T2, N m, same shape or (2,).

    Raises:
        SceneError: if an argument is not a pair of finite values.

    >>> arm = TwoLinkArm(slender(1.0, 3.0), slender(0.5, 1.2), gravity=0.0)
    >>> accelerations(arm, [0.0, np.pi], [0.0, 0.0], [1.5, -0.4]).round(9).tolist()
    [0.538461538, -2.384615385]

    """
    (q1, q2), (t1, t2) = _pairs(arm, q=q, torques=torques)
    left = rest(arm, q, qdot)
    k = arm.constants
    across, bend = k.B * np.cos(q1 - q2), k.B * np.sin(q1 - q2)
    one, two = t1 - t2 - left[0], t2 - left[1]
    return np.asarray(np.stack((k.C * one - across * two, k.A * two - across * one)) / (k.least + bend**2))


def energy(arm: TwoLinkArm, q: ArrayLike, qdot: ArrayLike) -> tuple[Array, Array]:
    """Kinetic and potential energy (J); the potential is 0 with both centres at the shoulder's height.

    T = ½ A q1'² + ½ C q2'² + B q1' q2' cos(q1 - q2), V = G1 cos q1 + G2 cos q2.

    Args:
        arm: the arm.
        q: angles, rad, shape (2, ...).
        qdot: speeds, rad/s, same shape.

    >>> kinetic, potential = energy(TwoLinkArm(slender(1.0, 3.0), slender(0.5, 1.2), gravity=10.0), [0.0, 0.0], [1.0, 1.0])
    >>> round(float(kinetic), 12), round(float(potential), 12)
    (1.45, 30.0)

    """
    (q1, q2), (w1, w2) = _pairs(arm, q=q, qdot=qdot)
    k = arm.constants
    kinetic = 0.5 * k.A * w1**2 + 0.5 * k.C * w2**2 + k.B * w1 * w2 * np.cos(q1 - q2)
    return np.asarray(kinetic), np.asarray(k.G1 * np.cos(q1) + k.G2 * np.cos(q2))


def reactions(arm: TwoLinkArm, q: ArrayLike, qdot: ArrayLike, qddot: ArrayLike) -> Reactions:
    """Forces in shoulder and elbow, by Newton's law for each bar.

    F_elbow = m2 (a_G2 - g), F_shoulder = F_elbow + m1 (a_G1 - g), g the acceleration of gravity as a vector.

    Args:
        arm: the arm.
        q: angles, rad, shape (2, ...).
        qdot: speeds, rad/s, same shape.
        qddot: accelerations, rad/s², same shape.

    >>> arm = TwoLinkArm(slender(1.0, 3.0), slender(0.5, 1.2), gravity=10.0)
    >>> reactions(arm, [0.0, 1.0], [0.0, 0.0], [0.0, 0.0]).shoulder.round(12).tolist()  # at rest: the weights
    [0.0, 42.0]

    """
    angles, speeds, turning = _pairs(arm, q=q, qdot=qdot, qddot=qddot)
    s, c = np.sin(angles), np.cos(angles)
    per_metre = np.stack((speeds**2 * s - turning * c, -(speeds**2) * c - turning * s))  # acceleration: x and y, of each bar
    lift = np.array([0.0, arm.gravity]).reshape(2, *[1] * (per_metre.ndim - 2))
    elbow = arm.second.mass * (arm.first.length * per_metre[:, 0] + arm.second.com * per_metre[:, 1] + lift)
    return Reactions(elbow + arm.first.mass * (arm.first.com * per_metre[:, 0] + lift), elbow)


def _pairs(arm: TwoLinkArm, **values: ArrayLike) -> list[Array]:
    """Arguments by name, each one value for each bar or arrays of one shape; the arm must be one."""
    require("arm", arm, TwoLinkArm, "a TwoLinkArm")
    pairs = {name: pair_of(name, values) for name, values in values.items()}
    shapes = {pair.shape for pair in pairs.values() if pair.ndim > 1}
    if len(shapes) > 1:
        name, pair = list(pairs.items())[-1]
        raise SceneError([Fault(name, f"an array of shape {pair.shape}", "arguments of one shape")])
    return list(pairs.values())


def pair_of(name: str, values: ArrayLike) -> Array:
    """One value for each bar, or arrays of them."""
    pair = array(name, values)
    if pair.ndim == 0 or pair.shape[0] != 2:
        raise SceneError([Fault(name, f"an array of shape {pair.shape}", "two rows, one for each bar")])
    return pair


class LagrangeEquations(NamedTuple):
    """The equations in symbols: `left` = `right`, one a coordinate; `mass` is the matrix of the accelerations in `left`.

    `parameters` of two bars are l1, m1, I1, c1, m2, I2, c2, g; `torques` T1, T2, of slides forces F; `values(arm)` gives the
    parameters their numbers.
    """

    t: sp.Symbol
    q: tuple[sp.Expr, ...]
    parameters: tuple[sp.Symbol, ...]
    torques: tuple[sp.Symbol, ...]
    kinetic: sp.Expr
    potential: sp.Expr
    left: tuple[sp.Expr, ...]
    right: tuple[sp.Expr, ...]
    mass: sp.Matrix

    def values(self, arm: TwoLinkArm | Sequence[Bar], gravity: float = 9.80665) -> dict[sp.Symbol, float]:
        """Numbers (SI) for the parameters, of an arm with its own gravity or of bars."""
        bars = [arm.first, arm.second] if isinstance(arm, TwoLinkArm) else list(arm)
        if len(bars) != len(self.q):
            raise SceneError([Fault("arm", f"{len(bars)} bars", f"one a joint, {len(self.q)} in all")])
        numbers = [(bar.length, bar.mass, bar.inertia, bar.com) for bar in bars]
        pull = arm.gravity if isinstance(arm, TwoLinkArm) else gravity
        flat = [number for bar in numbers[:-1] for number in bar] + [*numbers[-1][1:], pull]
        return dict(zip(self.parameters, flat, strict=True))


_MOST_JOINTS = 6


def lagrange_equations(joints: str = "RR", *, relative: bool = False) -> LagrangeEquations:
    """Lagrange's equations of an open arm in symbols: T and V from the centres' positions, then by differentiation alone.

    d/dt(dL/dq_i') - dL/dq_i = Q_i, L = T - V, with Q_i from the power of all drives, T_k (omega_k - omega_k-1) and F_k s_k'.
    `flywheel.freedoms` has the same in numbers, for any linkage.

    Args:
        joints: the joint before each bar, from the frame on: `R` a pin at the end of the bar before, `P` a slide along that
            bar from its end on (one on the frame is level, along +x, and its bar upright). `RR` is the two-link arm.
        relative: True measures angles from the bar before; else from the upward vertical, like those of `TwoLinkArm`.

    Raises:
        SceneError: for other letters, or more than six joints.

    >>> equations = lagrange_equations()
    >>> equations.mass[0, 1]
    c2*l1*m2*cos(q1(t) - q2(t))
    >>> cart = lagrange_equations("PR")  # with a pendulum
    >>> cart.mass[0, 1], cart.right
    (-c2*m2*cos(q2(t)), (F1, T2))

    """
    import sympy as sp
    from sympy.simplify.fu import TR8  # type: ignore[import-untyped]

    expected = f"1 to {_MOST_JOINTS} letters R (pin) and P (slide)"
    require("joints", joints, str, expected)
    if not 0 < len(joints) <= _MOST_JOINTS or set(joints) - set("RP"):
        raise SceneError([Fault("joints", brief(joints), expected)])
    count, t = len(joints), sp.Symbol("t", real=True)
    q = tuple(sp.Function(f"q{k}", real=True)(t) for k in range(1, count + 1))
    names = [f"{letter}{k}" for k in range(1, count + 1) for letter in "lmIc"]
    names.remove(f"l{count}")
    symbols = dict(zip(names, sp.symbols(names, positive=True), strict=True)) | {"g": sp.Symbol("g", positive=True)}
    torques = tuple(sp.Symbol(f"{'T' if kind == 'R' else 'F'}{k}", real=True) for k, kind in enumerate(joints, 1))
    end, angle, twice, potential, power = sp.zeros(2, 1), sp.Integer(0), sp.Integer(0), sp.Integer(0), sp.Integer(0)
    for k, (kind, own, drive) in enumerate(zip(joints, q, torques, strict=True), 1):
        along = sp.Matrix([-sp.sin(angle), sp.cos(angle)])
        if kind == "P":
            end = end + own * (along if k > 1 else sp.Matrix([1, 0]))
            power += drive * own.diff(t)
        else:
            before, angle = angle, angle + own if relative else own
            along = sp.Matrix([-sp.sin(angle), sp.cos(angle)])
            power += drive * (angle - before).diff(t)
        centre = end + symbols[f"c{k}"] * along
        twice += symbols[f"m{k}"] * centre.diff(t).dot(centre.diff(t)) + symbols[f"I{k}"] * angle.diff(t) ** 2
        potential += symbols[f"m{k}"] * symbols["g"] * centre[1]
        end = end + symbols.get(f"l{k}", 0) * along
    kinetic = sp.expand(TR8(sp.expand(twice / 2)))  # products of sines and cosines to sums: all that there is to simplify
    potential, rates = sp.expand(potential), [own.diff(t) for own in q]
    lagrangian = kinetic - potential
    left = [sp.expand(lagrangian.diff(rate).diff(t) - lagrangian.diff(own)) for own, rate in zip(q, rates, strict=True)]
    mass = sp.Matrix(count, count, lambda i, j: sp.factor(kinetic.diff(rates[i]).diff(rates[j])))
    right = tuple(sp.expand(power).diff(rate) for rate in rates)
    return LagrangeEquations(t, q, tuple(symbols.values()), torques, kinetic, potential, tuple(left), right, mass)


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
        SceneError: if an argument, or a result of `torques`, is not finite.

    Large swings are chaotic: the energy is conserved, but after many of them the angles depend on the last digit of the
    start.

    >>> arm = TwoLinkArm(slender(1.0, 3.0), slender(0.5, 1.2))
    >>> simulate_arm(arm, [2.0, 1.0], [0.0, 0.0], 2.0).energy_residual < 1e-9
    True

    """
    from scipy.integrate import solve_ivp

    require("arm", arm, TwoLinkArm, "a TwoLinkArm")
    refuse([*number_faults("until", until, POSITIVE), *number_faults("rtol", rtol, POSITIVE)])
    starts = {"q": pair_of("q", q), "qdot": pair_of("qdot", qdot)}
    refuse([Fault(name, f"an array of shape {pair.shape}", "shape (2,)") for name, pair in starts.items() if pair.ndim > 1])

    def rates(t: float, state: Array) -> Array:
        angles, speeds = state[0:2], state[2:4]
        applied = np.zeros(2) if torques is None else pair_of("torques", torques(t, angles, speeds))
        power = applied[0] * speeds[0] + applied[1] * (speeds[1] - speeds[0])
        return np.concatenate((speeds, accelerations(arm, angles, speeds, applied), [power]))

    start = np.concatenate((*starts.values(), [0.0]))
    step = max(rtol, _FINEST)
    run: Any = solve_ivp(rates, (0.0, until), start, method="DOP853", rtol=step, atol=step, dense_output=True)
    if not run.success:
        raise SceneError([Fault("until", f"{until:g} s", f"a motion that can be followed: it stops at {run.t[-1]:g} s")])
    angles, speeds, work = run.y[0:2], run.y[2:4], run.y[4]
    kinetic, potential = energy(arm, angles, speeds)
    total = kinetic + potential
    scale = max(float(kinetic.max()), float(np.ptp(potential)), 1e-300)
    residual = float(np.abs(total - total[0] - work).max()) / scale

    def at(times: ArrayLike) -> tuple[Array, Array]:
        state = run.sol(array("times", times))
        return state[0:2], state[2:4]

    return ArmMotion(run.t, angles, speeds, kinetic, potential, work, residual, at)
