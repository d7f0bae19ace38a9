"""Positions and influence coefficients of a mechanism, step by step: its loop equations, their solution, g and g'.

The formulas are those of the books, written down here once more; the numbers beside them are found by the library's own
chain of transformers, so that each checks the other. A prime is the derivative by the mechanism's own crank angle.
"""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Container, Mapping, Sequence
from math import tau
from typing import Any, NamedTuple

import numpy as np

from flywheel.language import text as _
from flywheel.machine.machine import Machine
from flywheel.mechanisms import KINDS
from flywheel.mechanisms.families import Family, body
from flywheel.mechanisms.linkage import Cyclic, followed
from flywheel.mechanisms.linkages.equations import Form, Relation
from flywheel.numerics.cells import Array
from flywheel.numerics.expressions import Expression, shown
from flywheel.numerics.units import Unit
from flywheel.report import formulas
from flywheel.report.document import Cell, Formula, Part, Section, Step, Table
from flywheel.report.formulas import Quantity, index, symbol_text
from flywheel.scene.linkage import CAM, GEAR, Coupling
from flywheel.scene.scene import Mechanism

ONE = ""
"""The unit of a ratio."""

Arm = tuple[str, str, str, str]
"""Symbols of a line that turns: its length, its angle, the rate of that and its slope."""


class Sheet:
    """The steps of one mechanism at one position, with every value found so far by its symbol.

    `gains` has the symbol that is the influence coefficient of a velocity of the mechanism by the mechanism's own
    coordinate, `slopes` that of its derivative; `coordinates` that of a port's place.
    """

    def __init__(self, mechanism: Mechanism, family: Family, psi: float, rate: float, needed: Container[str]) -> None:
        self.mechanism, self.family, self.rate, self.needed = mechanism, family, rate, needed
        self.position = family.position(np.float64(psi), np)
        self.values: dict[str, Quantity] = {}
        self.names: dict[str, str] = {}
        self.keys: dict[str, str] = {}
        self.sections: list[tuple[str, list[Step]]] = []
        self.tables: list[tuple[str, Table]] = []
        self.gains: dict[str, str] = {}
        self.slopes: dict[str, str] = {}
        self.coordinates: dict[str, str] = {}
        self.driver = "x" if slides(mechanism) else "phi" if rate == 1.0 and not mechanism.phase else "psi"
        self.give(self.driver, psi, "m" if self.driver == "x" else "°")

    def part(self, title: str) -> None:
        """Begin a stretch of steps."""
        self.sections.append((title, []))

    def give(self, symbol: str, value: Any, unit: str) -> None:
        """A value that is given, or that stands in a table."""
        self.values[symbol] = Quantity(symbol, float(value), unit)

    def equations(self, *equations: str) -> None:
        """Loop equations, which are solved by what follows."""
        self.part(_("Loop equations"))
        for k, equation in enumerate(equations):
            what = _("The loop closes:") if k == 0 else _("and")
            self.sections[-1][1].append(Step(what, equation))

    def find(self, of: str, formula: str, unit: str, what: str = "", found: Any = None) -> float:
        """A step: a formula of what is known, with the library's own value where it has one.

        A derivative needs no words of its own: it is that of what its symbol was found to be.
        """
        base = of.removesuffix("_prime").removesuffix("_second")
        if what:
            self.names[of] = what
        elif of.endswith("_prime"):
            what = _("Influence coefficient g of: {what}", what=self.names.get(base, base))
        else:
            what = _("Its derivative g′, of: {what}", what=self.names.get(base, base))
        used = tuple(value for symbol, value in self.values.items() if symbol in formulas.symbols(formula))
        plain = {number.symbol: number.value for number in used}
        own = formulas.value(formula, plain)
        value = own if found is None else float(found)
        size = max((abs(number.value) for number in used), default=1.0)
        value = 0.0 if abs(value) <= _NOTHING * size else value
        self.values[of] = Quantity(of, value, unit)
        note = _("It is 0: what is left is rounding.") if value == 0.0 and own != 0.0 else ""
        numbers = () if note else used
        self.sections[-1][1].append(Step(what, f"{of} = {formula}", numbers, self.values[of], note=note))
        return value

    def given(self, *names: tuple[str, str]) -> None:
        """Lengths and angles of the mechanism by their keys."""
        for symbol, key in names:
            unit = "°" if key.endswith(("angle", "direction")) else "m"
            self.keys[symbol] = key
            self.give(symbol, self.mechanism.geometry.get(key, 0.0), unit)

    def shown(self) -> tuple[Section, ...]:
        """The stretches of steps under their titles, with the tables that belong to them before the steps."""
        found = []
        for title, steps in self.sections:
            parts: list[Part] = [table for where, table in self.tables if where == title]
            parts += steps
            if parts:
                found.append(Section(title, tuple(parts)))
        return tuple(found)


_NOTHING = 1e-12  # of the largest number in a formula: a result below it is 0


def unit_text(unit: Unit | None) -> str:
    """A parameter's unit in SI, as it is shown; nothing where it has none."""
    return "" if unit is None else (shown(unit) or "").replace("^2", "²").replace("^3", "³")


def slides(mechanism: Mechanism) -> bool:
    """Whether a mechanism's driver slides."""
    if mechanism.linkage is not None:
        return mechanism.linkage.sliding
    return KINDS[mechanism.type].driver == "slides"


def sheet(machine: Machine, mechanism: Mechanism, phi: float) -> Sheet:
    """The steps of one of a machine's mechanisms at a coordinate of the machine's driver (rad, or m where it slides)."""
    rate = machine.scene.shafts[mechanism.shaft] if mechanism.stroke is None else 1.0
    psi = rate * phi + mechanism.phase if mechanism.stroke is None else phi
    needed = {name.partition(".")[2] for name in machine.graph.elements if name.startswith(f"{mechanism.name}.")}
    made = Sheet(mechanism, machine.family(mechanism), psi, rate, needed)
    for name, value in machine.scene.parameters.items():
        made.give(name, value, unit_text(machine.scene.units.get(name)))
    if made.driver == "psi":
        made.part(_("The angle of its own crank"))
        made.give("phi", phi, "°")
        made.give("i", rate, ONE)
        made.give("psi_0", mechanism.phase, "°")
        text = " + ".join([*(["i*phi"] if rate != 1.0 else ["phi"]), *(["psi_0"] if mechanism.phase else [])])
        made.find("psi", text, "°", _("Its crank turns with its shaft, ahead by its phase"))
    written = SHEETS.get(mechanism.type)
    if written is not None:
        written(made)
    return made


# -- what mechanisms have in common ------------------------------------------------------------------------------------


def _angle(made: Sheet, of: str, formula: str, what: str, found: float) -> float:
    """An angle that a formula gives up to whole turns, with those that the library counts."""
    plain = {symbol: value.value for symbol, value in made.values.items()}
    turns = round((found - formulas.value(formula, plain)) / tau)
    if turns:
        formula += f" {'+' if turns > 0 else '-'} {abs(2 * turns)}*pi"
    return made.find(of, formula, "°", what, found)


def _rates(line: str, velocity: str) -> tuple[str, str]:
    """Names of the rate and the slope of a line; those of the crank itself are 1 and 0."""
    return ("1", "0") if velocity == "crank" else (f"{line}_prime", f"{line}_second")


def _pivoted(made: Sheet, name: str, line: str, velocity: str, tilt: str = "") -> None:
    """Centre of mass of a body on a fixed pivot, which lies on a line of that body."""
    part = body(made.mechanism, name)
    if part.com == 0.0 or part.mass == 0.0:
        return
    made.part(_("Centre of mass of {body}", body=name))
    arm = _own_arm(made, name, line, *_rates(line, velocity))
    _point(made, name, [arm])
    rate = arm[2]
    symbol = f"u_{index(name)}_prime"
    what = _("Its velocity along its circle, for each rad/s of the driver")
    made.find(symbol, arm[0] if rate == "1" else f"{arm[0]}*{rate}", "m" if made.driver != "x" else ONE, what)
    made.gains[f"{name}.com"] = symbol
    if rate != "1":
        made.find(f"u_{index(name)}_second", f"{arm[0]}*{arm[3]}", "m" if made.driver != "x" else "1/m")
        made.slopes[f"{name}.com"] = f"u_{index(name)}_second"


def _own_arm(made: Sheet, name: str, line: str, rate: str, slope: str) -> Arm:
    """From a body's first pin to its centre of mass."""
    part = body(made.mechanism, name)
    s, alpha = f"s_{index(name)}", f"alpha_{index(name)}"
    made.give(s, part.com, "m")
    made.give(alpha, part.com_angle, "°")
    return s, line + (f" + {alpha}" if part.com_angle else ""), rate, slope


def _point(made: Sheet, name: str, arms: list[Arm], point: str = "") -> None:
    """Coordinates of a centre of mass at the end of arms, with two derivatives."""

    def turning(function: str, sign: str) -> str:
        return _added([f"{sign}{s}*{function}({a})" + ("" if rate == "1" else f"*{rate}") for s, a, rate, _slope in arms])

    def bending(function: str, across: str, sign: str) -> str:
        terms = []
        for s, a, rate, slope in arms:
            terms.append(f"-{s}*{function}({a})" + ("" if rate == "1" else f"*{rate}**2"))
            if slope != "0":
                terms.append(f"{sign}{s}*{across}({a})*{slope}")
        return _added(terms)

    along = made.driver == "x"
    where = point or f"{name}.com"
    for axis, function, across, sign in (("x", "cos", "sin", "-"), ("y", "sin", "cos", "")):
        if f"{where}.{axis}" not in made.needed:
            continue
        of = f"{axis}_G_{index(name)}" if not point else f"{axis}_{index(name)}"
        place = " + ".join(f"{s}*{function}({a})" for s, a, _r, _s in arms)
        made.find(of, place, "m", _("Centre of mass of {body}: {axis}", body=name, axis=axis))
        made.find(f"{of}_prime", turning(across, sign), ONE if along else "m")
        made.find(f"{of}_second", bending(function, across, sign), "1/m" if along else "m")
        made.gains[f"{where}.{axis}"], made.slopes[f"{where}.{axis}"] = f"{of}_prime", f"{of}_second"
        made.coordinates[f"{where}.{axis}"] = of


def _added(terms: list[str]) -> str:
    """A sum of terms, some of which begin with a minus."""
    total = f"-({terms[0][1:]})" if terms[0].startswith("-") else terms[0]
    for term in terms[1:]:
        total += f" - {term[1:]}" if term.startswith("-") else f" + {term}"
    return total


def _floating(made: Sheet, name: str, line: str, carrier: Arm) -> None:
    """Centre of mass of a body whose first pin stands at the end of a carrier's arm."""
    part = body(made.mechanism, name)
    if part.mass == 0.0:
        return
    made.part(_("Centre of mass of {body}", body=name))
    arms = [carrier]
    if part.com:
        arms.append(_own_arm(made, name, line, f"{line}_prime", f"{line}_second"))
    _point(made, name, arms)


def _crank(made: Sheet) -> None:
    _pivoted(made, "crank", made.driver, "crank")


# -- families ----------------------------------------------------------------------------------------------------------


def _slider_crank(made: Sheet) -> None:
    """Loop: r cos phi + l cos beta = x, r sin phi + l sin beta = e."""
    p, phi = made.position, made.driver
    made.given(("r", "crank.length"), ("l", "rod.length"), ("e", "slider.offset"))
    offset = bool(made.values["e"].value)
    made.equations(f"r*cos({phi}) + l*cos(beta) = x", f"r*sin({phi}) + l*sin(beta) = {'e' if offset else '0'}")
    made.part(_("Positions"))
    made.find(
        "beta",
        f"asin((e - r*sin({phi}))/l)" if offset else f"-asin(r*sin({phi})/l)",
        "°",
        _("Angle of the rod"),
        found=p.rod,
    )
    made.find("x", f"r*cos({phi}) + l*cos(beta)", "m", _("Place of the slider"), found=p.slider)
    made.part(_("Influence coefficients g: the first derivatives"))
    made.find("beta_prime", f"-(r*cos({phi}))/(l*cos(beta))", ONE, found=p.rod_rate)
    made.find("x_prime", f"-(r*sin({phi})) - l*sin(beta)*beta_prime", "m", found=p.slider_rate)
    made.part(_("Their derivatives g′"))
    made.find("beta_second", f"(r*sin({phi}) + l*sin(beta)*beta_prime**2)/(l*cos(beta))", ONE, found=p.rod_slope)
    made.find(
        "x_second", f"-(r*cos({phi})) - l*cos(beta)*beta_prime**2 - l*sin(beta)*beta_second", "m", found=p.slider_slope
    )
    made.coordinates |= {"rod": "beta", "slider": "x"}
    made.gains |= {"rod": "beta_prime", "slider": "x_prime"}
    made.slopes |= {"rod": "beta_second", "slider": "x_second"}
    _crank(made)
    _floating(made, "rod", "beta", ("r", phi, "1", "0"))


def _four_bar(made: Sheet) -> None:
    """Loop: r cos phi + c cos chi = d + L cos theta, r sin phi + c sin chi = L sin theta."""
    p, phi, side = made.position, made.driver, "-" if made.mechanism.assembly != "crossed" else "+"
    made.given(("d", "ground.length"), ("r", "crank.length"), ("c", "coupler.length"), ("L", "rocker.length"))
    made.equations(
        f"r*cos({phi}) + c*cos(chi) = d + L*cos(theta)",
        f"r*sin({phi}) + c*sin(chi) = L*sin(theta)",
    )
    made.part(_("Positions, by the diagonal D from the rocker's pivot to the crank's pin"))
    made.find("D", f"sqrt(d**2 + r**2 - 2*d*r*cos({phi}))", "m", _("Length of the diagonal"))
    made.find("delta", f"atan2(r*sin({phi}), r*cos({phi}) - d)", "°", _("Angle of the diagonal"))
    made.find(
        "rho", "acos((D**2 + L**2 - c**2)/(2*D*L))", "°", _("Angle between diagonal and rocker, by the law of cosines")
    )
    _angle(made, "theta", f"delta {side} rho", _("Angle of the rocker"), float(p.rocker))
    _angle(
        made,
        "chi",
        f"atan2(L*sin(theta) - r*sin({phi}), d + L*cos(theta) - r*cos({phi}))",
        _("Angle of the coupler"),
        float(p.coupler),
    )
    made.part(_("Influence coefficients g: the first derivatives"))
    made.find("theta_prime", f"r*sin({phi} - chi)/(L*sin(theta - chi))", ONE, found=p.rocker_rate)
    made.find("chi_prime", f"r*sin({phi} - theta)/(c*sin(theta - chi))", ONE, found=p.coupler_rate)
    made.part(_("Their derivatives g′"))
    across = f"(r*cos({phi} - chi) + c*chi_prime**2 - L*cos(theta - chi)*theta_prime**2)/(L*sin(theta - chi))"
    made.find("theta_second", across, ONE, found=p.rocker_slope)
    across = f"(r*cos({phi} - theta) + c*cos(theta - chi)*chi_prime**2 - L*theta_prime**2)/(c*sin(theta - chi))"
    made.find("chi_second", across, ONE, found=p.coupler_slope)
    made.coordinates |= {"coupler": "chi", "rocker": "theta"}
    made.gains |= {"coupler": "chi_prime", "rocker": "theta_prime"}
    made.slopes |= {"coupler": "chi_second", "rocker": "theta_second"}
    _crank(made)
    _floating(made, "coupler", "chi", ("r", phi, "1", "0"))
    _pivoted(made, "rocker", "theta", "rocker")


def _block(made: Sheet, radius: str) -> None:
    """The block on the crank's pin."""
    if body(made.mechanism, "block").mass:
        made.part(_("Block on the crank's pin"))
        _point(made, "block", [(radius, made.driver, "1", "0")], "crank.pin")
        made.gains["crank.pin"] = radius


def _scotch_yoke(made: Sheet) -> None:
    """Loop: x = R cos(phi - delta)."""
    p, phi = made.position, made.driver
    made.given(("R", "crank.length"), ("delta", "yoke.direction"))
    at = f"{phi} - delta" if made.values["delta"].value else phi
    made.equations(f"R*cos({at}) = x")
    made.part(_("Positions"))
    made.find("x", f"R*cos({at})", "m", _("Place of the yoke"), found=p.yoke)
    made.part(_("Influence coefficients g: the first derivatives"))
    made.find("x_prime", f"-(R*sin({at}))", "m", found=p.yoke_rate)
    made.part(_("Their derivatives g′"))
    made.find("x_second", f"-(R*cos({at}))", "m", found=p.yoke_slope)
    made.gains["yoke"], made.slopes["yoke"], made.coordinates["yoke"] = "x_prime", "x_second", "x"
    _block(made, "R")
    _crank(made)


def _crank_shaper(made: Sheet) -> None:
    """Loop: d + r cos phi = s cos theta, r sin phi = s sin theta, y = L sin theta."""
    p, phi = made.position, made.driver
    made.given(("r", "crank.length"), ("d", "frame.length"), ("L", "rocker.length"))
    made.equations(f"d + r*cos({phi}) = s*cos(theta)", f"r*sin({phi}) = s*sin(theta)", "L*sin(theta) = y")
    made.part(_("Positions"))
    made.find(
        "s",
        f"sqrt(d**2 + r**2 + 2*d*r*cos({phi}))",
        "m",
        _("Distance of the block from the rocker's pivot"),
        found=p.distance,
    )
    _angle(made, "theta", f"atan2(r*sin({phi}), d + r*cos({phi}))", _("Angle of the rocker"), float(p.rocker))
    made.find("y", "L*sin(theta)", "m", _("Place of the ram"), found=p.ram)
    made.part(_("Influence coefficients g: the first derivatives"))
    made.find("s_prime", f"-(r*sin({phi} - theta))", "m")
    made.find("theta_prime", f"r*cos({phi} - theta)/s", ONE, found=p.rocker_rate)
    made.find("y_prime", "L*cos(theta)*theta_prime", "m", found=p.ram_rate * p.rocker_rate)
    made.part(_("Their derivatives g′"))
    made.find("theta_second", "s_prime*(1 - 2*theta_prime)/s", ONE, found=p.rocker_slope)
    found = p.ram_slope * p.rocker_rate + p.ram_rate * p.rocker_slope
    made.find("y_second", "L*cos(theta)*theta_second - L*sin(theta)*theta_prime**2", "m", found=found)
    made.coordinates |= {"rocker": "theta", "ram": "y"}
    made.gains |= {"rocker": "theta_prime", "ram": "y_prime"}
    made.slopes |= {"rocker": "theta_second", "ram": "y_second"}
    _block(made, "r")
    if body(made.mechanism, "rocker_pin").mass:
        made.part(_("Pin at the rocker's end"))
        _point(made, "pin", [("L", "theta", "theta_prime", "theta_second")], "rocker.pin")
        made.find("u_pin_prime", "L*theta_prime", "m", _("Its velocity along its circle, for each rad/s of the driver"))
        made.find("u_pin_second", "L*theta_second", "m")
        made.gains["rocker.pin"], made.slopes["rocker.pin"] = "u_pin_prime", "u_pin_second"
    _crank(made)
    _pivoted(made, "rocker", "theta", "rocker")


def _toggle_clamp(made: Sheet) -> None:
    """a2 at theta2 and a3 at theta3 reach the block at (-x, a1); a5 at theta5 and a6 at theta6 the platen at (s, 0)."""
    p, m = made.position, made.mechanism
    made.given(
        ("a_1", "frame.height"), ("a_2", "bell_crank.drive_length"), ("a_3", "coupler.length"),
        ("a_5", "bell_crank.clamp_length"), ("a_6", "rod.length"), ("alpha", "bell_crank.angle"),
    )  # fmt: skip
    made.equations(
        "a_2*cos(theta_2) + a_3*cos(theta_3) = -x",
        "a_2*sin(theta_2) + a_3*sin(theta_3) = a_1",
        "a_5*cos(theta_5) + a_6*cos(theta_6) = s",
        "a_5*sin(theta_5) + a_6*sin(theta_6) = 0",
    )
    side, ahead = ("-" if m.assembly.startswith("crossed") else "+"), not m.assembly.endswith("-behind")
    made.part(_("Positions, by the diagonal D from the bell crank's pivot to the block"))
    made.find("D", "sqrt(a_1**2 + x**2)", "m", _("Length of the diagonal"))
    made.find("delta", "atan2(a_1, -x)", "°", _("Angle of the diagonal"))
    made.find(
        "rho",
        "acos((D**2 + a_2**2 - a_3**2)/(2*D*a_2))",
        "°",
        _("Angle between diagonal and drive arm, by the law of cosines"),
    )
    _angle(made, "theta_2", f"delta {side} rho", _("Angle of the drive arm of the bell crank"), float(p.bell_crank))
    _angle(
        made, "theta_3", "atan2(a_1 - a_2*sin(theta_2), -x - a_2*cos(theta_2))", _("Angle of the coupler"), float(p.coupler)
    )
    made.find("theta_5", "theta_2 + alpha + pi", "°", _("Angle of the clamp arm of the bell crank"), found=p.clamp)
    _angle(
        made,
        "theta_6",
        "-asin(a_5*sin(theta_5)/a_6)" if ahead else "pi + asin(a_5*sin(theta_5)/a_6)",
        _("Angle of the rod"),
        float(p.rod),
    )
    made.find("s", "a_5*cos(theta_5) + a_6*cos(theta_6)", "m", _("Place of the platen"), found=p.platen)
    made.part(_("Influence coefficients g: the first derivatives"))
    made.find("theta_2_prime", "cos(theta_3)/(a_2*sin(theta_2 - theta_3))", "1/m", found=p.bell_crank_rate)
    made.find("theta_3_prime", "-cos(theta_2)/(a_3*sin(theta_2 - theta_3))", "1/m", found=p.coupler_rate)
    made.find("theta_6_prime", "-(a_5*cos(theta_5)*theta_2_prime)/(a_6*cos(theta_6))", "1/m", found=p.rod_turn)
    made.find("theta_5_prime", "theta_2_prime", "1/m")
    s1 = p.platen_rate * p.bell_crank_rate
    made.find("s_prime", "-(a_5*sin(theta_5)*theta_2_prime) - a_6*sin(theta_6)*theta_6_prime", ONE, found=s1)
    made.part(_("Their derivatives g′"))
    text = "-(a_3*theta_3_prime**2 + a_2*cos(theta_2 - theta_3)*theta_2_prime**2)/(a_2*sin(theta_2 - theta_3))"
    made.find("theta_2_second", text, "1/m²", found=p.bell_crank_slope)
    text = "(a_2*theta_2_prime**2 + a_3*cos(theta_2 - theta_3)*theta_3_prime**2)/(a_3*sin(theta_2 - theta_3))"
    made.find("theta_3_second", text, "1/m²", found=p.coupler_slope)
    made.find("theta_5_second", "theta_2_second", "1/m²")
    top = "a_5*sin(theta_5)*theta_2_prime**2 - a_5*cos(theta_5)*theta_2_second + a_6*sin(theta_6)*theta_6_prime**2"
    found = p.rod_slope * p.bell_crank_rate + p.rod_rate * p.bell_crank_slope
    made.find("theta_6_second", f"({top})/(a_6*cos(theta_6))", "1/m²", found=found)
    text = "-(a_5*cos(theta_5)*theta_2_prime**2) - a_5*sin(theta_5)*theta_2_second"
    text += " - a_6*cos(theta_6)*theta_6_prime**2 - a_6*sin(theta_6)*theta_6_second"
    found = p.platen_slope * p.bell_crank_rate + p.platen_rate * p.bell_crank_slope
    made.find("s_second", text, "1/m", found=found)
    made.coordinates |= {"block": "x", "bell_crank": "theta_2", "coupler": "theta_3", "rod": "theta_6", "platen": "s"}
    made.gains |= {"bell_crank": "theta_2_prime", "coupler": "theta_3_prime", "rod": "theta_6_prime", "platen": "s_prime"}
    made.slopes |= {
        "bell_crank": "theta_2_second",
        "coupler": "theta_3_second",
        "rod": "theta_6_second",
        "platen": "s_second",
    }
    _pivoted(made, "bell_crank", "theta_5", "bell_crank")
    _floating(made, "coupler", "theta_3", ("a_2", "theta_2", "theta_2_prime", "theta_2_second"))
    _floating(made, "rod", "theta_6", ("a_5", "theta_5", "theta_5_prime", "theta_5_second"))


# -- any linkage -------------------------------------------------------------------------------------------------------


class Swing(NamedTuple):
    """A term of a place: an arm of a length, or of a slide, along an angle; all by their symbols, with their derivatives.

    `sign` and `length` stand before the cosine; `slide` is the symbol of a displacement, or nothing; `angle` is a sum of
    symbols, `rate` and `slope` its derivatives ("0" where it keeps still).
    """

    sign: str
    length: str
    slide: str
    angle: str
    rate: str
    slope: str

    def _times(self, *factors: str) -> str:
        return "*".join(factor for factor in (self.length, *factors) if factor)

    def along(self, function: str) -> list[str]:
        """The term itself, by cos along x and by sin along y."""
        if self.angle == "0":
            return [self.sign + (self._times(self.slide) or "1")] if function == "cos" else []
        return [self.sign + self._times(self.slide, f"{function}({self.angle})")]

    def first(self, function: str, across: str, turned: str) -> list[str]:
        """Its derivative; `across` is what the function becomes, with the sign `turned`."""
        found = []
        if self.rate != "0":
            rate = "" if self.rate == "1" else self.rate
            found.append(_signed(self.sign, turned) + self._times(self.slide, f"{across}({self.angle})", rate))
        if self.slide:
            found.append(self.sign + self._times(f"{self.slide}_prime", f"{function}({self.angle})"))
        return found

    def second(self, function: str, across: str, turned: str) -> list[str]:
        """Its second derivative."""
        found = []
        if self.rate != "0":
            rate = "" if self.rate == "1" else f"{self.rate}**2"
            found.append(_signed(self.sign, "-") + self._times(self.slide, f"{function}({self.angle})", rate))
            if self.slope != "0":
                found.append(_signed(self.sign, turned) + self._times(self.slide, f"{across}({self.angle})", self.slope))
        if self.slide:
            found.append(self.sign + self._times(f"{self.slide}_second", f"{function}({self.angle})"))
            if self.rate != "0":
                rate = "" if self.rate == "1" else self.rate
                sign = _signed(self.sign, turned)
                found.append(sign + "2*" + self._times(f"{self.slide}_prime", f"{across}({self.angle})", rate))
        return found


def _signed(one: str, other: str) -> str:
    return "" if one == other else "-"


class _Arms:
    """The arms of a linkage's bodies: a symbol for every length and every fixed angle, listed as they are met."""

    def __init__(self, made: Sheet, symbols: Sequence[str]) -> None:
        self.made, self.symbols = made, symbols
        self.rows: list[tuple[Cell, ...]] = []
        self._known: dict[tuple[float, float], tuple[str, str]] = {}

    def swing(self, coefficient: complex, weights: Array, slide: str, unit: float) -> Swing:
        """One term: a coefficient (scaled by `unit` where it is a length) at a sum of angles."""
        length, angle = abs(coefficient) * (1.0 if slide else unit), float(np.angle(coefficient))
        sign = ""
        if angle > 0.5 * np.pi + 1e-9 or angle <= -0.5 * np.pi + 1e-9:
            angle, sign = (angle - np.pi if angle > 0 else angle + np.pi), "-"
        angle = 0.0 if abs(angle) < 1e-12 else angle
        one = slide and abs(length - 1.0) < 1e-12
        symbol, fixed = ("", "") if one and not angle else self._symbols(length, angle, bool(slide))
        terms = [(float(w), self.symbols[k]) for k, w in enumerate(weights) if w]
        text = _weighted(terms) if terms else ""
        rate = _weighted([(w, _rate_of(k)) for w, k in terms if _rate_of(k) != "1"])
        driver = sum(w for w, k in terms if _rate_of(k) == "1")
        rate = _plus_number(rate, driver)
        slope = _weighted([(w, f"{k}_second") for w, k in terms if _rate_of(k) != "1"]) or "0"
        whole = " + ".join(filter(None, (text, fixed))) or "0"
        bracketed = f"({rate})" if " " in rate else rate
        return Swing(sign, symbol if not one else "", slide, whole, bracketed, f"({slope})" if " " in slope else slope)

    def _symbols(self, length: float, angle: float, slides: bool) -> tuple[str, str]:
        key = round(length, 12), round(angle, 12)
        if key not in self._known:
            n = len(self._known) + 1
            symbol, fixed = f"l_{n}", f"gamma_{n}" if angle else ""
            self.made.give(symbol, length, ONE if slides else "m")
            row: tuple[Cell, ...] = (Formula(symbol), self.made.values[symbol], "")
            if fixed:
                self.made.give(fixed, angle, "°")
                row = (*row[:2], self.made.values[fixed])
            self.rows.append(row)
            self._known[key] = symbol, fixed
        return self._known[key]


def _rate_of(symbol: str) -> str:
    return "1" if symbol in ("phi", "psi", "x") else f"{symbol}_prime"


def _weighted(terms: Sequence[tuple[float, str]]) -> str:
    """A sum of symbols with weights, which are 1 or -1 most often."""
    text = ""
    for weight, symbol in terms:
        size = "" if abs(abs(weight) - 1.0) < 1e-12 else f"{abs(weight):.12g}*"
        sign = (" - " if weight < 0 else " + ") if text else ("-" if weight < 0 else "")
        text += f"{sign}{size}{symbol}"
    return text


def _plus_number(text: str, number: float) -> str:
    if not number:
        return text or "0"
    return f"{number:.12g} + {text}" if text else f"{number:.12g}"


def _linkage(made: Sheet) -> None:
    """The loop equations of any linkage as they are solved, the unknowns, and every centre of mass by its arms."""
    cycle = followed(made.mechanism)
    loops, linkage = cycle.solution.equations.loops, cycle.solution.linkage
    symbols = [made.driver]
    for name in loops.names[1:]:
        what, of = name.split(" of ", 1)
        symbols.append(f"{'theta' if what == 'angle' else 's'}_{index(of)}")
    arms = _Arms(made, symbols)

    def swings(coefficients: Any, more: Sequence[tuple[complex, Array]] = ()) -> list[Swing]:
        bases = zip(coefficients, loops.turns, loops.slides, strict=True)
        found = [
            (complex(c), w, symbols[k] if k > 0 else made.driver if k == 0 else "") for c, w, k in bases if abs(c) > 1e-13
        ]
        found += [(c, w, "") for c, w in more if abs(c) > 1e-13]
        return [arms.swing(c, w, slide, loops.unit) for c, w, slide in found]

    made.part(_("Loop equations"))
    closed = [swings(closure) for closure in loops.closures]
    steps = made.sections[-1][1]
    for path, terms in zip(loops.paths, closed, strict=True):
        what = _("The loop over {joints} closes along x", joints=", ".join(path))
        for function, words in (("cos", what), ("sin", _("and along y"))):
            steps.append(Step(words, _added([text for term in terms for text in term.along(function)]) + " = 0"))
    for coupling, relation in zip(linkage.couplings, loops.relations, strict=False):
        steps.append(_coupled(made, coupling, relation, symbols))
    made.part(_("Positions"))
    _unknowns(made, cycle, symbols)
    if loops.names[1:]:
        _system(made, cycle, symbols)
    _bodies(made, cycle, symbols, swings)
    made.tables.insert(0, (_("Loop equations"), _arm_table(arms)))


def _arm_table(arms: _Arms) -> Table:
    head = (_("arm"), _("length"), _("angle in its body"))
    return Table(_("Lengths and fixed angles of the arms, from the points of the bodies"), head, tuple(arms.rows))


def _coupled(made: Sheet, coupling: Coupling, relation: Relation, symbols: Sequence[str]) -> Step:
    """A gear, a wheel that rolls, or a cam, as an equation between two coordinates."""

    def side(form: Form) -> str:
        text = _weighted([(float(w), symbols[k]) for k, w in enumerate(form.weights) if w])
        turned = f" {'+' if form.constant > 0 else '-'} {abs(np.degrees(form.constant)):.6g}*pi/180"
        return text + (turned if abs(form.constant) > 1e-12 else "")

    first, second = side(relation.first), side(relation.second)
    if coupling.kind == CAM:
        return Step(_("The cam {name} asks for its lift h", name=coupling.name), f"{second} = h({first})")
    phase = f" {'+' if coupling.phase > 0 else '-'} {abs(coupling.phase):.6g}" if coupling.phase else ""
    kind = (
        _("The gear {name} meshes", name=coupling.name) if coupling.kind == GEAR else _("{name} rolls", name=coupling.name)
    )
    return Step(kind, f"{second} = {coupling.ratio:.10g}*({first}){phase}")


def _unknowns(made: Sheet, cycle: Cyclic, symbols: Sequence[str]) -> None:
    """The unknowns at the position, as Newton's method finds them, with both derivatives."""
    rows: list[tuple[Cell, ...]] = []
    for k, name in enumerate(cycle.solution.equations.loops.names[1:], start=1):
        what, of = name.split(" of ", 1)
        turning = what == "angle"
        found = made.position.variable(k)
        along = made.driver == "x"
        units = (
            ("°", *(("1/m", "1/m²") if along else (ONE, ONE)))
            if turning
            else ("m", *((ONE, "1/m") if along else ("m", "m")))
        )
        symbol = symbols[k]
        for end, value, unit in zip(("", "_prime", "_second"), found, units, strict=True):
            made.give(symbol + end, np.asarray(value), unit)
        told = _("angle of {name}", name=of) if turning else _("way along {name}", name=of)
        rows.append((told, Formula(symbol), *(made.values[symbol + end] for end in ("", "_prime", "_second"))))
        made.gains[of], made.slopes[of], made.coordinates[of] = f"{symbol}_prime", f"{symbol}_second", symbol
    if rows:
        head = (_("unknown"), _("symbol"), _("value"), _("g"), _("g′"))
        told = _("The unknowns of the loops, by Newton-Raphson from the assembly; g and g′ by the linear equations below")
        made.tables.append((_("Positions"), Table(told, head, tuple(rows))))


def _system(made: Sheet, cycle: Cyclic, symbols: Sequence[str]) -> None:
    """The linear equations of the influence coefficients: the loops' derivatives by the unknowns, and by the driver."""
    equations = cycle.solution.equations
    loops = equations.loops
    psi = made.position.psi if cycle.period is None else made.position.psi % cycle.period
    z = cycle.solution.movement(np.array([float(psi)])).z
    jacobian = equations.jacobian(z, equations.bases(z))[0]
    sliding = np.array([made.driver == "x", *(name.startswith("slide") for name in loops.names[1:])])
    by = np.where(sliding, 1.0, loops.unit)  # from a row in units of length to one in m
    rows: list[tuple[Cell, ...]] = []
    for k, row in enumerate(jacobian):
        metres = row * by if k < 2 * len(loops.closures) else row * np.where(sliding, 1.0 / loops.unit, 1.0)
        name = (
            f"{k // 2 + 1}, {'xy'[k % 2]}"
            if k < 2 * len(loops.closures)
            else loops.linkage.couplings[k - 2 * len(loops.closures)].name
        )
        rows.append((name, *(Quantity("", float(v) + 0.0) for v in metres[1:]), Quantity("", -float(metres[0]) + 0.0)))
    head = (_("equation"), *(_("× {symbol}′", symbol=symbol_text(s)) for s in symbols[1:]), _("= right side"))
    told = _("The derivatives of the equations, in SI: linear in the influence coefficients, which solve them")
    made.tables.append((_("Positions"), Table(told, head, tuple(rows))))


def _bodies(made: Sheet, cycle: Cyclic, symbols: Sequence[str], swings: Callable[..., list[Swing]]) -> None:
    """Angles of bodies that are no unknowns themselves, centres of mass and ports, each by its arms."""
    loops, linkage = cycle.solution.equations.loops, cycle.solution.linkage
    along = made.driver == "x"
    for k, body_name in enumerate(linkage.names):
        form = loops.angles[k]
        if body_name in made.gains or body_name not in made.needed or not form.weights.any():
            continue
        terms = [(float(w), symbols[j]) for j, w in enumerate(form.weights) if w]
        of = f"theta_{index(body_name)}"
        made.part(_("Angle of {body}", body=body_name))
        constant = (
            f" {'+' if form.constant > 0 else '-'} {abs(float(form.constant / np.pi)):.12g}*pi" if form.constant else ""
        )
        made.find(of, _weighted(terms) + constant, "°", _("Angle of {body}", body=body_name))
        moving = [(w, _rate_of(s)) for w, s in terms if _rate_of(s) != "1"]
        rate = _plus_number(_weighted(moving), sum(w for w, s in terms if _rate_of(s) == "1"))
        made.find(f"{of}_prime", rate, "1/m" if along else ONE)
        made.gains[body_name], made.coordinates[body_name] = f"{of}_prime", of
        if moving:
            made.find(f"{of}_second", _weighted([(w, f"{s[:-6]}_second") for w, s in moving]), "1/m²" if along else ONE)
            made.slopes[body_name] = f"{of}_second"
    for k, link in enumerate(linkage.links, start=1):
        form = loops.angles[k]
        own = complex(*link.com) / loops.unit * complex(np.exp(1j * form.constant))
        wanted = [axis for axis in "xy" if f"{link.name}.com.{axis}" in made.needed]
        if link.mass and wanted:
            made.part(_("Centre of mass of {body}", body=link.name))
            arms = swings(loops.origins[k], [(own, form.weights)])
            for axis in wanted:
                of = f"{axis}_G_{index(link.name)}"
                what = _("Centre of mass of {body}: {axis}", body=link.name, axis=axis)
                _by_arms(made, arms, axis, of, f"{link.name}.com.{axis}", what)
    for port in made.mechanism.points:
        if port.name not in made.needed:
            continue
        k = linkage.names.index(port.body)
        at, form = linkage.link(port.body).point(port.point), loops.angles[k]
        turned = complex(np.exp(-1j * port.direction))
        own = complex(at.x, at.y) / loops.unit * complex(np.exp(1j * form.constant)) * turned
        made.part(_("Place of {port}, along its direction", port=port.name))
        arms = swings(loops.origins[k] * turned, [(own, form.weights)])
        _by_arms(made, arms, "x", f"x_{index(port.name)}", port.name, _("Place of {port}", port=port.name))


def _by_arms(made: Sheet, terms: Sequence[Swing], axis: str, of: str, where: str, what: str) -> None:
    """A place as a sum of arms, with two derivatives."""
    along = made.driver == "x"
    function, across, turned = ("cos", "sin", "-") if axis == "x" else ("sin", "cos", "")
    made.find(of, _added([text for term in terms for text in term.along(function)]), "m", what)
    first = [text for term in terms for text in term.first(function, across, turned)]
    if not first:
        return
    made.find(f"{of}_prime", _added(first), ONE if along else "m")
    second = [text for term in terms for text in term.second(function, across, turned)]
    made.gains[where], made.coordinates[where] = f"{of}_prime", of
    if second:
        made.find(f"{of}_second", _added(second), "1/m" if along else "m")
        made.slopes[where] = f"{of}_second"


# -- laws --------------------------------------------------------------------------------------------------------------


def _law(made: Sheet) -> None:
    """Outputs whose place is an expression of the angle: the branch that holds, and its derivatives rule by rule."""
    along = {True: ("°", ONE, ONE), False: ("m", "m", "m")}
    for output in made.mechanism.outputs:
        jet, symbol = made.position.jet(output.name), f"{'theta' if output.rotating else 'x'}_{index(output.name)}"
        made.part(_("Place of {port}", port=output.name))
        angle, units = made.driver, along[output.rotating]
        values = [float(np.asarray(part)) for part in (jet.value, jet.first, jet.second)]
        texts = _derivatives(made, output.law) if isinstance(output.law, Expression) else ["", "", ""]
        names = ("", "_prime", "_second")
        for end, text, value, unit in zip(names, texts, values, units, strict=True):
            own = _worked_out(made, text, value)
            if own:
                made.find(symbol + end, text, unit, _("Place of {port}", port=output.name) if not end else "", value)
                continue
            made.values[symbol + end] = Quantity(symbol + end, value, unit)
            how = _("By the periodic cubic spline through its table, at {angle}.", angle=symbol_text(angle))
            if isinstance(output.law, Expression):
                how = _("By its expression, differentiated rule by rule: {text}", text=output.law.shown)
            what = (_("Place of {port}"), _("Influence coefficient g of: {what}"), _("Its derivative g′, of: {what}"))
            told = what[names.index(end)].format(port=output.name, what=output.name)
            made.sections[-1][1].append(Step(told, result=made.values[symbol + end], how=how))
        made.gains[output.name], made.slopes[output.name] = f"{symbol}_prime", f"{symbol}_second"
        made.coordinates[output.name] = symbol


def _worked_out(made: Sheet, text: str, value: float) -> bool:
    """Whether a formula comes to the library's value."""
    try:
        plain = {symbol: number.value for symbol, number in made.values.items()}
        return bool(text) and abs(formulas.value(text, plain) - value) <= 1e-9 * max(1.0, abs(value))
    except (ValueError, ArithmeticError):
        return False


def _derivatives(made: Sheet, law: Expression) -> list[str]:
    """An expression, its branch that holds here, and two derivatives of that, as formulas; nothing for what is none."""
    import sympy  # type: ignore[import-untyped]  # only reports of laws pay for it

    psi = made.values[made.driver].value
    local = psi - float(made.position.turns) * made.mechanism.period
    if abs(local - psi) > 1e-12:
        return ["", "", ""]
    plain = {symbol: value.value for symbol, value in made.values.items()} | {"phi": local}
    functions = {name: getattr(sympy, name) for name in ("sin", "cos", "tan", "asin", "acos", "atan", "sqrt", "exp", "log")}

    def read(node: ast.expr) -> Any:
        match node:
            case ast.Constant(value=int() | float() as number):
                return sympy.nsimplify(number) if float(number).is_integer() else sympy.Float(number)
            case ast.Name(id=name):
                return sympy.pi if name == "pi" else sympy.Symbol(name)
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                return -read(inner)
            case ast.BinOp(left=left, op=op, right=right):
                a, b = read(left), read(right)
                match op:
                    case ast.Add():
                        return a + b
                    case ast.Sub():
                        return a - b
                    case ast.Mult():
                        return a * b
                    case ast.Div():
                        return a / b
                    case ast.Pow():
                        return a**b
            case ast.Call(func=ast.Name(id=name), args=[inner]) if name in functions:
                return functions[name](read(inner))
        raise ValueError(ast.unparse(node))

    try:
        tree = branch_of(ast.parse(law.text.replace("\\\n", " ").strip(), mode="eval").body, plain)
        place = read(tree)
    except (SyntaxError, ValueError, ArithmeticError):
        return ["", "", ""]
    phi, own = sympy.Symbol("phi"), made.driver
    first = sympy.diff(place, phi)
    found = [ast.unparse(tree), str(first), str(sympy.diff(first, phi))]
    return [text if own == "phi" else re.sub(r"\bphi\b", own, text) for text in found]


def branch_of(node: ast.expr, values: Mapping[str, float]) -> ast.expr:
    """A tree with every condition decided."""

    class Decided(ast.NodeTransformer):
        def visit_IfExp(self, node: ast.IfExp) -> Any:
            return self.visit(node.body if _holds(node.test, values) else node.orelse)

    found = Decided().visit(node)
    assert isinstance(found, ast.expr)
    return found


def _holds(test: ast.expr, values: Mapping[str, float]) -> bool:
    """Whether a condition holds."""
    match test:
        case ast.BoolOp(op=op, values=parts):
            return (all if isinstance(op, ast.And) else any)(_holds(part, values) for part in parts)
        case ast.UnaryOp(op=ast.Not(), operand=inner):
            return not _holds(inner, values)
        case ast.Compare(left=left, ops=ops, comparators=others):
            numbers = [formulas.value(ast.unparse(side), values) for side in (left, *others)]
            compared = {ast.Lt: "lt", ast.LtE: "le", ast.Gt: "gt", ast.GtE: "ge", ast.Eq: "eq", ast.NotEq: "ne"}
            return all(
                getattr(operator, compared[type(op)])(a, b) for op, a, b in zip(ops, numbers, numbers[1:], strict=False)
            )
    return formulas.value(ast.unparse(test), values) != 0.0


def renamed(node: ast.expr, names: Mapping[str, Quantity]) -> ast.expr:
    """A tree with the symbols of the report for the names of the scene."""

    class Named(ast.NodeTransformer):
        def visit_Name(self, node: ast.Name) -> Any:
            return ast.Name(id=names[node.id].symbol if node.id in names else node.id, ctx=ast.Load())

    found = Named().visit(node)
    assert isinstance(found, ast.expr)
    return found


SHEETS: Mapping[str, Callable[[Sheet], None]] = {
    "slider-crank": _slider_crank,
    "four-bar": _four_bar,
    "scotch-yoke": _scotch_yoke,
    "crank-shaper": _crank_shaper,
    "toggle-clamp": _toggle_clamp,
    "linkage": _linkage,
    "law": _law,
}
