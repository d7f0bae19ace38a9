"""Loads of known kinds: belts, what resists motion (fans, pumps, windage, bearings, rolling), presses and punches."""

from __future__ import annotations

from math import pi, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.numerics.expressions import Expression, compiled

Array = NDArray[np.float64]


class Model(NamedTuple):
    """A load of a known kind: its words, its law in a sentence, and whether it is a loss, by which nothing is gained."""

    words: str
    formula: str
    loss: bool = False


_SQUARE = "T = T₀ + c ω² against the motion, with c = (T₁ − T₀)/ω₁² by the point that is given."
_STROKE = "F = E/s if it stays, F = (2 E/s)(1 − p/s) if it falls, E the energy, s the way, p the penetration."
MODELS = {
    "constant": Model("resistance", ""),
    "fan": Model("fan", _SQUARE),
    "pump": Model("pump", _SQUARE),
    "losses": Model("losses", "T = a + b ω + c ω² against the motion: constant, proportional and quadratic shares.", True),
    "belt": Model("belt", "T = (T₁ − T₂) r against the motion, tight side less slack side; by its power T = P/ω."),
    "press": Model("press", _STROKE),
    "punch": Model("punch", _STROKE),
    "indicator": Model(
        "gas", "F = −A (p − p₀), A the piston's area, p the pressure of the diagram, straight between its rows."
    ),
    "compressor": Model(
        "compressor",
        "F = −A (p − p₀), A the piston's area, p₀ the pressure behind it; p = pₛ ((1 + c)/(c + s))ⁿ while it compresses and "
        "p = p_d (c/(c + s))ᵐ while what is left in the clearance expands, c the clearance, s the share of the stroke.",
    ),
}
"""The loads of known kinds, by the type that a scene names."""


def model_of(text: str) -> Model | None:
    """The known kind that a load's text names, such as `press: 24.7 kJ over 15 mm`; None for another, and for a drive."""
    return MODELS.get(text.partition(":")[0])


def is_loss(text: str) -> bool:
    """Tells whether nothing is gained by a load of this text."""
    model = model_of(text)
    return model is not None and model.loss


def belt_torque(tight: float, slack: float, radius: float) -> float:
    """Torque of a belt on its pulley: T = (T1 - T2) r, in N m.

    Args:
        tight: T1, tension of the tight side, N.
        slack: T2, tension of the slack side, N.
        radius: r from the pulley's centre to the middle of the belt, m.

    Valid for a belt of negligible stiffness; the tension that its own mass adds acts on both sides alike.

    Source: Khurmi & Gupta, Theory of Machines, chapter 11 (power transmitted by a belt).

    >>> belt_torque(900.0, 300.0, 0.25)
    150.0

    """
    return (tight - slack) * radius


def tension_ratio(friction: float, wrap: float, groove: float = pi) -> float:
    """Greatest ratio of the tensions before a belt slips: T1/T2 = exp(mu theta / sin(beta/2)), Euler and Eytelwein.

    Args:
        friction: mu, coefficient of friction between belt and pulley.
        wrap: theta, angle over which the belt lies on the pulley, rad.
        groove: beta, whole angle of the groove of a V-belt, rad; a flat belt has pi.

    Valid for a belt that is about to slip all over the pulley, at rest or so slow that its own mass does not lift it.

    Source: J. A. Eytelwein, Handbuch der Statik fester Körper, 1808; Khurmi & Gupta, chapter 11.

    >>> round(tension_ratio(0.3, pi), 6), round(tension_ratio(0.3, pi, pi / 4.5), 3)
    (2.566332, 15.731)

    """
    with np.errstate(over="ignore"):  # a ratio beyond all numbers is one that no belt reaches
        return float(np.exp(friction * wrap / sin(groove / 2)))


class Resistance(NamedTuple):
    """Coefficients of a resistance on a place that translates (N, N s/m, N s²/m²) or rotates (N m, N m s, N m s²)."""

    constant: float = 0.0
    proportional: float = 0.0
    quadratic: float = 0.0


def resistance(speed: ArrayLike, law: Resistance) -> Array:
    """Force or torque against the motion: -(a sign v + b v + c v |v|).

    Args:
        speed: v of the place, m/s or rad/s, any shape.
        law: a, b, c.

    Valid for either sense of motion. At rest it is 0 here; followed in time, a machine is held there by up to a.

    Source: T. D. Gillespie, Fundamentals of Vehicle Dynamics, SAE 1992, chapter 4 (rolling resistance and drag of the
    air); W. Leonhard, Control of Electrical Drives, Springer 2001, section 1.4 (load torques).

    >>> resistance([-2.0, 0.0, 2.0], Resistance(3.0, 1.0, 0.5)).tolist()
    [7.0, -0.0, -7.0]

    """
    v = np.asarray(speed, dtype=float)
    a, b, c = law
    return np.asarray(-(a * np.sign(v) + b * v + c * v * np.abs(v)))


def resistance_law(law: Resistance, variable: str) -> Expression:
    """The same as an expression of `omega` (of a shaft) or `v` (of a port); the constant share needs the sign of v alone.

    Args:
        law: a, b, c.
        variable: "omega" or "v".

    >>> resistance_law(Resistance(3.0, 0.0, 0.5), "omega").text
    '-3.0*sign(v) - 0.5*omega*abs(omega)'

    """
    parts = {
        "{a}*sign(v)": law.constant,
        f"{{b}}*{variable}": law.proportional,
        f"{{c}}*{variable}*abs({variable})": law.quadratic,
    }
    terms = [part for part, number in parts.items() if number]
    text = "-" + " - ".join(terms) if terms else "0"
    return compiled(text, a=law.constant, b=law.proportional, c=law.quadratic)


def quadratic_coefficient(effort: float, speed: float, constant: float = 0.0) -> float:
    """Coefficient c of a fan or pump from one point of its characteristic: c = (T - T0)/omega².

    Args:
        effort: T, torque (N m) or force (N) that it takes at that speed.
        speed: omega, rad/s or m/s, above 0.
        constant: T0, the share that does not depend on speed (static head, friction), in units of T.

    Valid by the affinity laws (flow with speed, head with its square, power with its cube): a turbomachine against a
    system without static head. A pump against a static head follows it only near its point.

    Source: I. J. Karassik and others, Pump Handbook, McGraw-Hill 2008, chapter 2; Leonhard, section 1.4.

    >>> quadratic_coefficient(50.0, 10.0, 10.0)
    0.4

    """
    return (effort - constant) / speed**2


CONSTANT, TRIANGULAR = "constant", "triangular"
FULLNESS = {CONSTANT: 1.0, TRIANGULAR: 0.5}
"""Mean force over the greatest one, by how it goes with penetration: it stays, or falls in a straight line to nothing."""
FORCE_SHAPES = tuple(FULLNESS)


class Press(NamedTuple):
    """A working stroke: greatest force (N; N m), way that it acts along (m; rad), shape, way that is left then (m; rad)."""

    force: float
    travel: float
    shape: str = CONSTANT
    overtravel: float = 0.0

    @property
    def energy(self) -> float:
        """Work of a stroke (J): F s where the force is constant, F s/2 where it falls to nothing."""
        return self.force * self.travel * FULLNESS[self.shape]


def sheared_area(thickness: float, perimeter: float) -> float:
    """Area that a punch shears: A = p t, in m²; p = pi d for a round hole.

    Args:
        thickness: t of the sheet, m.
        perimeter: p of the hole, m.

    Source: Khurmi & Gupta, Theory of Machines, chapter 16 (flywheel in punching press).

    >>> round(sheared_area(0.015, np.pi * 0.04) * 6e6, 2)  # example 16.22: 6 J/mm², 40 mm through 15 mm
    11309.73

    """
    return perimeter * thickness


def greatest_force(energy: float, travel: float, shape: str = CONSTANT) -> float:
    """Force at the beginning of a stroke of given energy: F = E/s constant, F = 2 E/s falling to nothing.

    Args:
        energy: E of the stroke, J.
        travel: s along which the force acts (the sheet's thickness), m; or an angle (rad), for a torque.
        shape: "constant" or "triangular".

    Valid where the force falls linearly with penetration: a shearing force, which is tau A where the punch meets the whole
    sheet. Then E = tau A t/2.

    Source: Khurmi & Gupta, Theory of Machines, chapter 16; R. G. Budynas and J. K. Nisbett, Shigley's Mechanical
    Engineering Design, chapter 16.

    >>> greatest_force(1500.0, 0.01), greatest_force(1500.0, 0.01, "triangular")
    (150000.0, 300000.0)

    """
    return energy / (travel * FULLNESS[shape])


def press_force(penetration: ArrayLike, press: Press) -> Array:
    """Force against the punch at a penetration p: F, or F (1 - p/s) where it falls; 0 before and behind the sheet.

    Args:
        penetration: p, way into the sheet, m, any shape.
        press: F, s, and the shape.

    Source: as `greatest_force`.

    >>> press_force([-1e-3, 0.0, 5e-3, 11e-3], Press(1e5, 0.01, "triangular")).tolist()
    [0.0, 100000.0, 50000.0, 0.0]

    """
    p = np.asarray(penetration, dtype=float)
    falling = 1.0 - p / press.travel if press.shape == TRIANGULAR else np.ones_like(p)
    return np.where((p >= 0.0) & (p < press.travel), press.force * falling, 0.0)


def press_law(press: Press, end: float, high: bool) -> Expression:
    """Force on a port that presses on its way to one end of its stroke, as an expression of x and v.

    With the sheet's far side `overtravel` before the end, penetration is p = s - o - |end - x|.

    Args:
        press: F, s, the shape, and o.
        end: displacement of the port where its stroke ends, m (rad).
        high: whether that is the greatest displacement, else the least.

    >>> press_law(Press(1e5, 0.01), 0.5, True).text
    '(-100000.0) if v > 0 and x > 0.49 else 0'

    """
    sign = 1 if high else -1
    left = end - sign * press.overtravel
    met = left - sign * press.travel
    after, before = (">", "<") if high else ("<", ">")
    test = f"v {after} 0 and x {after} {{met}}" + (f" and x {before} {{left}}" if press.overtravel else "")
    falling = "{slope}*(x - {left})" if press.shape == TRIANGULAR else "{force}"
    slope = press.force / press.travel
    return compiled(f"{falling} if {test} else 0", force=-sign * press.force, slope=slope, met=met, left=left)


def shaft_law(energy: float, window: tuple[float, float], every: float, ratio: float, shape: str = CONSTANT) -> Expression:
    """Torque on a shaft that gives an energy over a window of the crank's angle, as an expression of phi.

    T = -E/(i theta) constant, T = -2 E/(i theta) (1 - (phi - from)/theta) falling to nothing.

    Args:
        energy: E of one window, J.
        window: from and to, rad in [0, every]; it wraps where to is less than from.
        every: period of the angle, rad.
        ratio: i, speed of the shaft over that of the crank.
        shape: "constant" or "triangular".

    >>> shaft_law(90.0, (5.0, 1.0), 6.0, 2.0).text
    '(-22.5)'

    """
    start, end = window
    width = end - start if end > start else end - start + every
    torque = greatest_force(energy, ratio * width, shape)
    if shape == CONSTANT:
        return compiled("{torque}", torque=-torque)
    turn = " + ({every} if phi < {middle} else 0)" if end < start else ""
    text = "{torque}*(1 - (phi - {start}" + turn + ")/{width})"
    return compiled(text, torque=-torque, start=start, every=every, middle=0.5 * (start + end), width=width)
