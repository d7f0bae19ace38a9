"""Loads of known kinds: belts, resistances (fans, pumps, windage, bearings, rolling), presses and punches, gases.

Gas on a piston acts by its pressure: from an indicator diagram, or by the cycle of a reciprocating compressor.
"""

from __future__ import annotations

from math import pi, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.numerics.expressions import Expression, Node, between, compiled, numeral, variable
from flywheel.numerics.jets import expm1, log

Array = NDArray[np.float64]


class LoadModel(NamedTuple):
    """A load of a known kind: its words, its law in a sentence, and true for a loss, which has no useful work."""

    words: str
    formula: str
    loss: bool = False


_SQUARE = "T = T₀ + c ω² against the motion, with c = (T₁ − T₀)/ω₁² by the point that is given."
_STROKE = (
    "Rectangular: F = E/s; triangular: F = (2 E/s)(1 − p/s); E the energy, s the travel of the force, p the penetration."
)
MODELS = {
    "constant": LoadModel("resistance", ""),
    "fan": LoadModel("fan", _SQUARE),
    "pump": LoadModel("pump", _SQUARE),
    "losses": LoadModel(
        "losses", "T = a + b ω + c ω² against the motion: constant, proportional and quadratic shares.", True
    ),
    "belt": LoadModel("belt", "T = (T₁ − T₂) r against the motion, tight side less slack side; by its power T = P/ω."),
    "press": LoadModel("press", _STROKE),
    "punch": LoadModel("punch", _STROKE),
    "indicator": LoadModel(
        "gas", "F = −A (p − p₀), A the piston's area, p the pressure of the diagram, straight between its rows."
    ),
    "compressor": LoadModel(
        "compressor",
        "F = −A (p − p₀), A the piston's area, p₀ the pressure behind it; p = pₛ ((1 + c)/(c + s))ⁿ while it compresses and "
        "p = p_d (c/(c + s))ᵐ while what is left in the clearance expands, c the clearance, s the share of the stroke.",
    ),
}
"""The loads of known kinds, by the type that a scene names."""


def model_of(text: str) -> LoadModel | None:
    """The known kind that a load's text names, such as `press: 24.7 kJ over 15 mm`; else None, also for a drive."""
    return MODELS.get(text.partition(":")[0])


def is_loss(text: str) -> bool:
    """Tests whether a load of this text is a loss."""
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

    Valid for either direction of motion. It is 0 at rest; in a motion in time it then holds the machine by up to a.

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
        effort: T, torque (N m) or force (N) at that speed.
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
"""Mean force over the greatest one, by its course over penetration: constant, or falling linearly to zero."""
FORCE_SHAPES = tuple(FULLNESS)


class Press(NamedTuple):
    """A working stroke: greatest force (N; N m), its travel (m; rad), shape, remaining travel (m; rad)."""

    force: float
    travel: float
    shape: str = CONSTANT
    overtravel: float = 0.0

    @property
    def energy(self) -> float:
        """Work of a stroke (J): F s for a constant force, F s/2 for one that falls to zero."""
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
    """Force at the beginning of a stroke of given energy: F = E/s constant, F = 2 E/s falling to zero.

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
    """Force against the punch at a penetration p: F, or F (1 - p/s) if it falls; 0 before and beyond the sheet.

    Args:
        penetration: p, depth in the sheet, m, any shape.
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
        high: true for the greatest displacement, false for the least.

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

    T = -E/(i theta) constant, T = -2 E/(i theta) (1 - (phi - from)/theta) falling to zero.

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


ATMOSPHERE = 101325.0
"""Standard atmosphere, Pa."""


class Space(NamedTuple):
    """A gas space in front of a piston: the area (m²) under pressure, and the ends of the stroke (m).

    `near` is the port's displacement with the piston closest to this space's cover, `far` with it farthest away.
    """

    area: float
    near: float
    far: float

    @property
    def stroke(self) -> float:
        """Stroke of the piston, m."""
        return abs(self.far - self.near)

    @property
    def sense(self) -> int:
        """1 if the cover lies at the greatest displacement, -1 if at the least: gas pushes in the opposite direction."""
        return 1 if self.near > self.far else -1


class Indicator(NamedTuple):
    """An indicator diagram: pressures (Pa) against the share of the stroke, 0 at the cover, that ascends from 0 to 1.

    `out` holds while the piston moves away from the cover, `back` while it returns. Two equal shares are a jump.
    """

    share: Array
    out: Array
    back: Array


def piston_area(bore: float, rod: float = 0.0) -> float:
    """Area under gas pressure: A = pi (D² - d²)/4, in m².

    Args:
        bore: D of the cylinder, m.
        rod: d of a rod that passes through this gas space, m.

    Source: Khurmi & Gupta, Theory of Machines, chapter 15 (piston effort, double-acting engines).

    >>> round(piston_area(0.3), 6), round(piston_area(0.3, 0.05), 6)
    (0.070686, 0.068722)

    """
    return pi * (bore - rod) * (bore + rod) / 4


def gas_force(pressure: ArrayLike, space: Space, atmosphere: float = ATMOSPHERE) -> Array:
    """Force of gas on a port: F = ∓ (p - p_0) A, away from the cover while p is above p_0.

    The sum over the two spaces of a double-acting cylinder is p_2 (A - a) - p_1 A + p_0 a, the atmosphere's share on
    the rod included.

    Args:
        pressure: p, absolute, Pa, any shape; above the atmosphere where `atmosphere` is 0.
        space: A, and the end at which the cover lies.
        atmosphere: p_0 behind the piston, Pa.

    Source: Khurmi & Gupta, chapter 15.

    >>> gas_force([3e5, 1e5], Space(0.01, 0.5, 0.3), 1e5).tolist()
    [-2000.0, 0.0]

    """
    return -space.sense * (np.asarray(pressure, dtype=float) - atmosphere) * space.area + 0.0


def indicated_pressure(share: ArrayLike, outward: ArrayLike, diagram: Indicator) -> Array:
    """Pressure of an indicator diagram (Pa), linear between its rows.

    Args:
        share: of the stroke, from the cover, 0 to 1, any shape.
        outward: true if the piston moves away from the cover, same shape.
        diagram: its rows.

    >>> loop = Indicator(np.array([0.0, 1.0]), np.array([4e5, 2e5]), np.array([3e5, 1e5]))
    >>> indicated_pressure([0.5, 0.5], [True, False], loop).tolist()
    [300000.0, 200000.0]

    """
    at = np.asarray(share, dtype=float)
    out, back = (np.interp(at, diagram.share, column) for column in (diagram.out, diagram.back))
    return np.asarray(np.where(outward, out, back))


def indicated_work(diagram: Indicator, area: float, stroke: float) -> float:
    """Work of the gas on the piston in a double stroke: W = A S times the integral of (p_out - p_back) over the share, in J.

    Args:
        diagram: its rows.
        area: A, m².
        stroke: S, m.

    Source: Khurmi & Gupta, chapter 15 (mean effective pressure).

    >>> loop = Indicator(np.array([0.0, 1.0]), np.array([4e5, 2e5]), np.array([3e5, 1e5]))
    >>> indicated_work(loop, 0.01, 0.2)
    200.0

    """
    return float(np.trapezoid(diagram.out - diagram.back, diagram.share)) * area * stroke


def indicator_law(diagram: Indicator, space: Space, atmosphere: float = ATMOSPHERE) -> Expression:
    """Force on a port from an indicator diagram, as an expression of x and the sense of v: `gas_force` row by row.

    Args:
        diagram: its rows, absolute pressures.
        space: area, ends of the stroke.
        atmosphere: behind the piston, Pa; 0 for pressures above it.

    """
    order = slice(None, None, -space.sense)
    x = (space.near + (space.far - space.near) * diagram.share)[order]
    wide = np.flatnonzero(np.diff(x) > 0)

    def rows(column: Array) -> Node:
        """Straight lines between the rows of a column, of the name x."""
        force = gas_force(column, space, atmosphere)[order]
        lines = []
        for k in wide:
            way = Node("sum", (variable("x"), numeral(x[k])), signs=("+", "-"))
            slope = (force[k + 1] - force[k]) / (x[k + 1] - x[k])
            rise = Node("product", (numeral(slope), way), signs=("*", "*"))
            lines.append(Node("sum", (numeral(force[k]), rise), signs=("+", "+")) if slope else numeral(force[k]))
        return between(variable("x"), x[wide[1:]].tolist(), lines)

    away = compiled(f"v {'<' if space.sense > 0 else '>'} 0").tree
    return Expression(f"indicator diagram of {x.size} rows", Node("if", (away, rows(diagram.out), rows(diagram.back))))


class Compression(NamedTuple):
    """A compressor's cycle: absolute pressures (Pa), clearance as a share of the swept volume, exponents of p V^n.

    `exponent` n is that of compression, `expansion` m that of the gas left in the clearance.
    """

    suction: float
    discharge: float
    clearance: float
    exponent: float
    expansion: float

    @property
    def ratio(self) -> float:
        """Ratio of the pressures, r."""
        return self.discharge / self.suction

    @property
    def delivery_begins(self) -> float:
        """Share of the stroke from the cover at which the delivery valve opens: (1 + c) r^(-1/n) - c."""
        share: float = (1.0 + self.clearance) * self.ratio ** (-1.0 / self.exponent) - self.clearance
        return share

    @property
    def suction_begins(self) -> float:
        """Share of the stroke from the cover at which the suction valve opens: c (r^(1/m) - 1)."""
        share: float = self.clearance * (self.ratio ** (1.0 / self.expansion) - 1.0)
        return share


def volumetric_efficiency(cycle: Compression) -> float:
    """Share of the swept volume that is drawn in, at suction conditions: 1 + c - c r^(1/m).

    Args:
        cycle: pressures, clearance c, exponents.

    Valid without losses in the valves and without heating of the gas drawn in. Where it is 0 or less, the compressor
    delivers nothing.

    Source: T. D. Eastop and A. McConkey, Applied Thermodynamics for Engineering Technologists, chapter 12.

    >>> round(volumetric_efficiency(Compression(1e5, 7e5, 0.05, 1.3, 1.3)), 6)
    0.826619

    """
    return 1.0 - cycle.suction_begins


def compressor_work(cycle: Compression, swept: float) -> float:
    """Work of a gas space in a double stroke: compression and delivery less the work returned by the clearance, J.

    W = n/(n-1) p_s V_1 (r^((n-1)/n) - 1) - m/(m-1) p_s V_4 (r^((m-1)/m) - 1), with V_1 = V (1 + c), V_4 = V c r^(1/m);
    with one exponent n/(n-1) p_s (V_1 - V_4) (r^((n-1)/n) - 1). An exponent of 1 has the logarithm of r instead.

    Args:
        cycle: pressures, clearance, exponents.
        swept: V = A S, m³.

    Valid for an ideal gas without losses in the valves.

    Source: Eastop and McConkey, chapter 12.

    >>> round(compressor_work(Compression(1e5, 7e5, 0.05, 1.3, 1.3), 1e-3), 4)
    203.0405

    """

    def head(exponent: float) -> float:
        """n/(n-1) (r^((n-1)/n) - 1), which tends to log r for n = 1."""
        if exponent == 1.0:
            return log(cycle.ratio)
        power = (exponent - 1.0) / exponent
        return expm1(power * log(cycle.ratio)) / power

    drawn = (1.0 + cycle.clearance) * swept
    left = cycle.clearance * cycle.ratio ** (1.0 / cycle.expansion) * swept
    work: float = cycle.suction * (drawn * head(cycle.exponent) - left * head(cycle.expansion))
    return work


def cylinder_pressure(share: ArrayLike, outward: ArrayLike, cycle: Compression) -> Array:
    """Absolute pressure over a double stroke, Pa.

    Towards the cover p = p_s ((1 + c)/(c + s))^n until it reaches p_d; away from it p = p_d (c/(c + s))^m until it falls to
    p_s.

    Args:
        share: s of the stroke, from the cover, 0 to 1, any shape.
        outward: true if the piston moves away from the cover, same shape.
        cycle: pressures, clearance c, exponents.

    Valid without losses in the valves, which open and close at once.

    Source: Eastop and McConkey, chapter 12.

    >>> cycle = Compression(1e5, 4e5, 0.25, 2.0, 2.0)
    >>> cylinder_pressure([0.0, 0.25, 0.375, 1.0, 1.0], [True, True, False, False, True], cycle).tolist()
    [400000.0, 100000.0, 400000.0, 100000.0, 100000.0]

    """
    s, c = np.asarray(share, dtype=float), cycle.clearance
    with np.errstate(divide="ignore", invalid="ignore"):
        rising = np.minimum(cycle.suction * ((1.0 + c) / (c + s)) ** cycle.exponent, cycle.discharge)
        falling = np.maximum(cycle.discharge * (c / (c + s)) ** cycle.expansion, cycle.suction)
    return np.where(outward, falling if c else cycle.suction, rising)


def compressor_law(cycle: Compression, spaces: tuple[Space, ...], atmosphere: float = ATMOSPHERE) -> Expression:
    """Force of a compressor's gas on its port, as an expression of x and the sense of v: the sum over its gas spaces.

    Each space has its `gas_force` by `cylinder_pressure`; a double-acting cylinder has two spaces.

    Args:
        cycle: pressures, clearance, exponents.
        spaces: areas and ends of the stroke.
        atmosphere: p_0 behind each piston face, Pa.

    >>> cycle = Compression(1e5, 4e5, 0.25, 2.0, 2.0)
    >>> law = compressor_law(cycle, (Space(0.01, 0.2, 0.0),), 1e5)
    >>> float(law.evaluate({"x": 0.2, "v": 1.0}, np)), law.uses_speed
    (-3000.0, False)

    """
    parts = [_space_law(cycle, space, atmosphere) for space in spaces]
    if len(parts) == 1:
        return parts[0]
    tree = Node("sum", tuple(part.tree for part in parts), signs=("+",) * len(parts))
    return Expression(" + ".join(f"({part.text})" for part in parts), tree)


def _space_law(cycle: Compression, space: Space, atmosphere: float) -> Expression:
    """Force of one gas space; its volumes are lengths of cylinder from a head at `head`."""
    towards, inside = (">", "head - x") if space.sense > 0 else ("<", "x - head")
    inside = inside.replace("head", "{head}")
    rising = f"{{pd}} if x {towards} {{opens}} else {{ps}}*({{whole}}/({inside}))**{{n}}"
    falling = f"{{ps}} if x {'<' if space.sense > 0 else '>'} {{draws}} else {{pd}}*({{least}}/({inside}))**{{m}}"
    falling = falling if cycle.clearance else "{ps}"
    stroke, c = space.stroke, cycle.clearance
    at = {
        name: space.near - space.sense * stroke * share
        for name, share in {"head": -cycle.clearance, "opens": cycle.delivery_begins, "draws": cycle.suction_begins}.items()
    }
    return compiled(
        f"{{force}}*((({rising}) if v {towards} 0 else ({falling})) - {{p0}})",
        force=-space.sense * space.area,
        ps=cycle.suction,
        pd=cycle.discharge,
        p0=atmosphere,
        n=cycle.exponent,
        m=cycle.expansion,
        whole=(1.0 + c) * stroke,
        least=c * stroke,
        **at,
    )
