"""Positions and influence coefficients of a mechanism, step by step: its loop equations, their solution, g and g'.

The formulas are those of the books, written here independently; the numbers in them are those of the library's own
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
from flywheel.mechanisms.families import ONE, Arm, Family, body
from flywheel.mechanisms.linkage import Cyclic, followed
from flywheel.mechanisms.linkages.equations import CouplingRelation, Form
from flywheel.numerics.cells import Array
from flywheel.numerics.expressions import Expression
from flywheel.numerics.expressions import unit_text as si_text
from flywheel.numerics.units import Unit
from flywheel.report import formulas
from flywheel.report.document import Cell, Formula, Part, Section, Step, Table
from flywheel.report.formulas import Quantity, index, symbol_text
from flywheel.scene.linkage import CAM, GEAR, Coupling
from flywheel.scene.scene import Mechanism


class Sheet:
    """The steps of one mechanism at one position, with every value so far by its symbol.

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
        """Begins a part of the steps."""
        self.sections.append((title, []))

    def give(self, symbol: str, value: Any, unit: str) -> None:
        """Adds a value that is given, or that is in a table."""
        self.values[symbol] = Quantity(symbol, float(value), unit)

    def equations(self, *equations: str) -> None:
        """Adds loop equations, which the next steps solve."""
        self.part(_("Loop equations"))
        for k, equation in enumerate(equations):
            what = _("The loop closes:") if k == 0 else _("and")
            self.sections[-1][1].append(Step(what, equation))

    def find(self, of: str, formula: str, unit: str, what: str = "", values: Any = None) -> float:
        """Adds a step: a formula of known values, with the library's own value if there is one.

        A derivative needs no words: it is that of the quantity of its symbol.
        """
        base = of.removesuffix("_prime").removesuffix("_second")
        if what:
            self.names[of] = what
        elif of.endswith("_prime"):
            what = _("{what}, influence coefficient g", what=self.names.get(base, base))
        else:
            what = _("{what}, its derivative g′", what=self.names.get(base, base))
        used = tuple(value for symbol, value in self.values.items() if symbol in formulas.symbols(formula))
        plain = {number.symbol: number.value for number in used}
        own = formulas.value(formula, plain)
        value = own if values is None else float(values)
        size = max((abs(number.value) for number in used), default=1.0)
        value = 0.0 if abs(value) <= _TERM_ROUNDING * size else value
        self.values[of] = Quantity(of, value, unit)
        note = _("It is 0 within rounding.") if value == 0.0 and own != 0.0 else ""
        numbers = () if note else used
        self.sections[-1][1].append(Step(what, f"{of} = {formula}", numbers, self.values[of], note=note))
        return value

    def dimensions(self, *names: tuple[str, str]) -> None:
        """Lengths and angles of the mechanism by their keys."""
        for symbol, key in names:
            unit = "°" if key.endswith(("angle", "direction")) else "m"
            self.keys[symbol] = key
            self.give(symbol, self.mechanism.geometry.get(key, 0.0), unit)

    def parts(self) -> tuple[Section, ...]:
        """The parts of the steps under their titles, with their tables before the steps."""
        all_parts = []
        for title, steps in self.sections:
            parts: list[Part] = [table for where, table in self.tables if where == title]
            parts += steps
            if parts:
                all_parts.append(Section(title, tuple(parts)))
        return tuple(all_parts)

    def angle(self, of: str, formula: str, what: str, value: float) -> float:
        """An angle that a formula gives up to whole turns, with the turns that the library counts."""
        plain = {symbol: value.value for symbol, value in self.values.items()}
        turns = round((value - formulas.value(formula, plain)) / tau)
        if turns:
            formula += f" {'+' if turns > 0 else '-'} {abs(2 * turns)}*pi"
        return self.find(of, formula, "°", what, value)

    def moves(self, **symbols: str) -> None:
        """Symbols of the displacements of ports, by their names."""
        self.coordinates |= symbols
        moving = {name: symbol for name, symbol in symbols.items() if symbol != self.driver}
        self.gains |= {name: f"{symbol}_prime" for name, symbol in moving.items()}
        self.slopes |= {name: f"{symbol}_second" for name, symbol in moving.items()}

    def pivoted(self, name: str, line: str, velocity: str) -> None:
        """Centre of mass of a body on a fixed pivot, which lies on a line of that body."""
        part = body(self.mechanism, name)
        if part.com == 0.0 or part.mass == 0.0:
            return
        self.part(_("Centre of mass of {body}", body=name))
        rates = ("1", "0") if velocity == "crank" else (f"{line}_prime", f"{line}_second")  # of the line: rate and slope
        arm = self._own_arm(name, line, *rates)
        self._point(name, [arm])
        rate = arm[2]
        symbol = f"u_{index(name)}_prime"
        what = _("Its velocity along its circle, for each rad/s of the driver")
        self.find(symbol, arm[0] if rate == "1" else f"{arm[0]}*{rate}", "m" if self.driver != "x" else ONE, what)
        self.gains[f"{name}.com"] = symbol
        if rate != "1":
            self.find(f"u_{index(name)}_second", f"{arm[0]}*{arm[3]}", "m" if self.driver != "x" else "1/m")
            self.slopes[f"{name}.com"] = f"u_{index(name)}_second"

    def floating(self, name: str, line: str, carrier: Arm) -> None:
        """Centre of mass of a body whose first pin stands at the end of a carrier's arm."""
        part = body(self.mechanism, name)
        if part.mass == 0.0:
            return
        self.part(_("Centre of mass of {body}", body=name))
        arms = [carrier]
        if part.com:
            arms.append(self._own_arm(name, line, f"{line}_prime", f"{line}_second"))
        self._point(name, arms)

    def pinned(self, name: str, title: str, arm: Arm, velocity: str) -> None:
        """A mass at the end of an arm; its symbols leave out the name of a pin that is equal to its own."""
        if body(self.mechanism, name).mass == 0.0:
            return
        self.part(title)
        short, (length, _angle, rate, slope) = name.rpartition("_")[2], arm
        self._point(short, [arm], velocity)
        self.gains[velocity] = length
        if rate != "1":
            words = _("Its velocity along its circle, for each rad/s of the driver")
            self.gains[velocity], self.slopes[velocity] = f"u_{short}_prime", f"u_{short}_second"
            self.find(self.gains[velocity], f"{length}*{rate}", "m", words)
            self.find(self.slopes[velocity], f"{length}*{slope}", "m")

    def _own_arm(self, name: str, line: str, rate: str, slope: str) -> Arm:
        """The vector from a body's first pin to its centre of mass."""
        part = body(self.mechanism, name)
        s, alpha = f"s_{index(name)}", f"alpha_{index(name)}"
        self.give(s, part.com, "m")
        self.give(alpha, part.com_angle, "°")
        return s, line + (f" + {alpha}" if part.com_angle else ""), rate, slope

    def _point(self, name: str, arms: list[Arm], point: str = "") -> None:
        """Coordinates of a centre of mass at the end of arms, with two derivatives."""

        def turning(function: str, sign: str) -> str:
            return _added(
                [f"{sign}{s}*{function}({a})" + ("" if rate == "1" else f"*{rate}") for s, a, rate, _slope in arms]
            )

        def bending(function: str, across: str, sign: str) -> str:
            terms = []
            for s, a, rate, slope in arms:
                terms.append(f"-{s}*{function}({a})" + ("" if rate == "1" else f"*{rate}**2"))
                if slope != "0":
                    terms.append(f"{sign}{s}*{across}({a})*{slope}")
            return _added(terms)

        along = self.driver == "x"
        where = point or f"{name}.com"
        for axis, function, across, sign in (("x", "cos", "sin", "-"), ("y", "sin", "cos", "")):
            if f"{where}.{axis}" not in self.needed:
                continue
            of = f"{axis}_G_{index(name)}" if not point else f"{axis}_{index(name)}"
            place = " + ".join(f"{s}*{function}({a})" for s, a, _r, _s in arms)
            self.find(of, place, "m", _("Centre of mass of {body}: {axis}", body=name, axis=axis))
            self.find(f"{of}_prime", turning(across, sign), ONE if along else "m")
            self.find(f"{of}_second", bending(function, across, sign), "1/m" if along else "m")
            self.gains[f"{where}.{axis}"], self.slopes[f"{where}.{axis}"] = f"{of}_prime", f"{of}_second"
            self.coordinates[f"{where}.{axis}"] = of


_TERM_ROUNDING = 1e-12  # of the largest number in a formula: a result below it is 0


def unit_text(unit: Unit | None) -> str:
    """A parameter's unit in SI, as it is shown; empty if it has none."""
    return "" if unit is None else (si_text(unit) or "").replace("^2", "²").replace("^3", "³")


def slides(mechanism: Mechanism) -> bool:
    """Tests whether a mechanism's driver slides."""
    if mechanism.linkage is not None:
        return mechanism.linkage.sliding
    return KINDS[mechanism.type].driver == "slides"


def sheet(machine: Machine, mechanism: Mechanism, phi: float) -> Sheet:
    """The steps of one of a machine's mechanisms at a coordinate of the machine's driver (rad, or m if it slides)."""
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
    kind = KINDS[mechanism.type]
    made.dimensions(*((symbol, key) for key, symbol in kind.symbols.items()))
    if kind.derivation is not None:
        kind.derivation(made)
    elif mechanism.linkage is not None:
        _linkage(made)
    elif mechanism.outputs:
        _law(made)
    return made


# -- what mechanisms have in common ------------------------------------------------------------------------------------


def _added(terms: list[str]) -> str:
    """A sum of terms, some of which begin with a minus."""
    total = f"-({terms[0][1:]})" if terms[0].startswith("-") else terms[0]
    for term in terms[1:]:
        total += f" - {term[1:]}" if term.startswith("-") else f" + {term}"
    return total


# -- any linkage -------------------------------------------------------------------------------------------------------


class Swing(NamedTuple):
    """A term of a place: an arm of a length, or of a slide, along an angle; all by their symbols, with their derivatives.

    `sign` and `length` precede the cosine; `slide` is the symbol of a displacement, or empty; `angle` is a sum of
    symbols, `rate` and `slope` its derivatives ("0" if it is constant).
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
        """The first derivative; `across` is the derivative's function, with the sign `turned`."""
        symbols = []
        if self.rate != "0":
            rate = "" if self.rate == "1" else self.rate
            symbols.append(_signed(self.sign, turned) + self._times(self.slide, f"{across}({self.angle})", rate))
        if self.slide:
            symbols.append(self.sign + self._times(f"{self.slide}_prime", f"{function}({self.angle})"))
        return symbols

    def second(self, function: str, across: str, turned: str) -> list[str]:
        """The second derivative."""
        symbols = []
        if self.rate != "0":
            rate = "" if self.rate == "1" else f"{self.rate}**2"
            symbols.append(_signed(self.sign, "-") + self._times(self.slide, f"{function}({self.angle})", rate))
            if self.slope != "0":
                symbols.append(_signed(self.sign, turned) + self._times(self.slide, f"{across}({self.angle})", self.slope))
        if self.slide:
            symbols.append(self.sign + self._times(f"{self.slide}_second", f"{function}({self.angle})"))
            if self.rate != "0":
                rate = "" if self.rate == "1" else self.rate
                sign = _signed(self.sign, turned)
                symbols.append(sign + "2*" + self._times(f"{self.slide}_prime", f"{across}({self.angle})", rate))
        return symbols


def _signed(one: str, other: str) -> str:
    return "" if one == other else "-"


class _ArmSymbols:
    """The arms of a linkage's bodies: a symbol for every length and every fixed angle, in the order of their use."""

    def __init__(self, made: Sheet, symbols: Sequence[str]) -> None:
        self.made, self.symbols = made, symbols
        self.rows: list[tuple[Cell, ...]] = []
        self._differences: dict[tuple[float, float], tuple[str, str]] = {}

    def swing(self, coefficient: complex, weights: Array, slide: str, unit: float) -> Swing:
        """One term: a coefficient (scaled by `unit` if it is a length) at a sum of angles."""
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
        if key not in self._differences:
            n = len(self._differences) + 1
            symbol, fixed = f"l_{n}", f"gamma_{n}" if angle else ""
            self.made.give(symbol, length, ONE if slides else "m")
            row: tuple[Cell, ...] = (Formula(symbol), self.made.values[symbol], "")
            if fixed:
                self.made.give(fixed, angle, "°")
                row = (*row[:2], self.made.values[fixed])
            self.rows.append(row)
            self._differences[key] = symbol, fixed
        return self._differences[key]


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
    arms = _ArmSymbols(made, symbols)

    def swings(coefficients: Any, more: Sequence[tuple[complex, Array]] = ()) -> list[Swing]:
        bases = zip(coefficients, loops.turns, loops.slides, strict=True)
        swings = [
            (complex(c), w, symbols[k] if k > 0 else made.driver if k == 0 else "") for c, w, k in bases if abs(c) > 1e-13
        ]
        swings += [(c, w, "") for c, w in more if abs(c) > 1e-13]
        return [arms.swing(c, w, slide, loops.unit) for c, w, slide in swings]

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
    head = (_("arm"), _("length"), _("angle in its body"))
    table = Table(_("Lengths and fixed angles of the arms, from the points of the bodies"), head, tuple(arms.rows))
    made.tables.insert(0, (_("Loop equations"), table))


def _coupled(made: Sheet, coupling: Coupling, relation: CouplingRelation, symbols: Sequence[str]) -> Step:
    """A gear, a wheel that rolls, or a cam, as an equation between two coordinates."""

    def side(form: Form) -> str:
        text = _weighted([(float(w), symbols[k]) for k, w in enumerate(form.weights) if w])
        turned = f" {'+' if form.constant > 0 else '-'} {abs(np.degrees(form.constant)):.6g}*pi/180"
        return text + (turned if abs(form.constant) > 1e-12 else "")

    first, second = side(relation.first), side(relation.second)
    if coupling.kind == CAM:
        return Step(_("Lift h of the cam {name}", name=coupling.name), f"{second} = h({first})")
    phase = f" {'+' if coupling.phase > 0 else '-'} {abs(coupling.phase):.6g}" if coupling.phase else ""
    kind = (
        _("The gear {name} meshes", name=coupling.name) if coupling.kind == GEAR else _("{name} rolls", name=coupling.name)
    )
    return Step(kind, f"{second} = {coupling.ratio:.10g}*({first}){phase}")


def _unknowns(made: Sheet, cycle: Cyclic, symbols: Sequence[str]) -> None:
    """The unknowns at the position, by Newton's method, with both derivatives."""
    rows: list[tuple[Cell, ...]] = []
    for k, name in enumerate(cycle.solution.equations.loops.names[1:], start=1):
        what, of = name.split(" of ", 1)
        turning = what == "angle"
        quantities = made.position.variable(k)
        along = made.driver == "x"
        units = (
            ("°", *(("1/m", "1/m²") if along else (ONE, ONE)))
            if turning
            else ("m", *((ONE, "1/m") if along else ("m", "m")))
        )
        symbol = symbols[k]
        for end, value, unit in zip(("", "_prime", "_second"), quantities, units, strict=True):
            made.give(symbol + end, np.asarray(value), unit)
        title = _("angle of {name}", name=of) if turning else _("way along {name}", name=of)
        rows.append((title, Formula(symbol), *(made.values[symbol + end] for end in ("", "_prime", "_second"))))
        made.gains[of], made.slopes[of], made.coordinates[of] = f"{symbol}_prime", f"{symbol}_second", symbol
    if rows:
        head = (_("unknown"), _("symbol"), _("value"), _("g"), _("g′"))
        title = _("The unknowns of the loops, by Newton-Raphson from the assembly; g and g′ by the linear equations below")
        made.tables.append((_("Positions"), Table(title, head, tuple(rows))))


def _system(made: Sheet, cycle: Cyclic, symbols: Sequence[str]) -> None:
    """The linear equations of the influence coefficients: the loops' derivatives by the unknowns, and by the driver."""
    equations = cycle.solution.equations
    loops = equations.loops
    psi = made.position.psi if cycle.period is None else made.position.psi % cycle.period
    z = cycle.solution.movement(np.array([float(psi)])).value
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
        metres[np.abs(metres) < _TERM_ROUNDING * np.abs(metres).max()] = 0.0  # such as the cosine of a right angle
        rows.append((name, *(Quantity("", float(v) + 0.0) for v in metres[1:]), Quantity("", -float(metres[0]) + 0.0)))
    head = (_("equation"), *(_("× {symbol}′", symbol=symbol_text(s)) for s in symbols[1:]), _("= right side"))
    title = _("The derivatives of the equations, in SI: linear in the influence coefficients, which solve them")
    made.tables.append((_("Positions"), Table(title, head, tuple(rows))))


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
        axes = [axis for axis in "xy" if f"{link.name}.com.{axis}" in made.needed]
        if link.mass and axes:
            made.part(_("Centre of mass of {body}", body=link.name))
            arms = swings(loops.origins[k], [(own, form.weights)])
            for axis in axes:
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
    """Outputs whose position is an expression of the angle: the branch that applies, and its derivatives rule by rule."""
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
                how = _("By its expression, differentiated rule by rule: {text}", text=output.law.excerpt)
            what = (_("Place of {port}"), _("{what}, influence coefficient g"), _("{what}, its derivative g′"))
            title = what[names.index(end)].format(port=output.name, what=output.name)
            made.sections[-1][1].append(Step(title, result=made.values[symbol + end], how=how))
        made.gains[output.name], made.slopes[output.name] = f"{symbol}_prime", f"{symbol}_second"
        made.coordinates[output.name] = symbol


def _worked_out(made: Sheet, text: str, value: float) -> bool:
    """Tests whether a formula gives the library's value."""
    try:
        plain = {symbol: number.value for symbol, number in made.values.items()}
        return bool(text) and abs(formulas.value(text, plain) - value) <= 1e-9 * max(1.0, abs(value))
    except (ValueError, ArithmeticError):
        return False


def _derivatives(made: Sheet, law: Expression) -> list[str]:
    """An expression, the branch that applies here and its two derivatives as formulas; empty if it is no expression."""
    import sympy  # type: ignore[import-untyped]  # only reports of laws need it

    psi = made.values[made.driver].value
    local = psi - float(made.position.turns) * made.mechanism.period
    if abs(local - psi) > 1e-12:
        return ["", "", ""]
    plain = {symbol: value.value for symbol, value in made.values.items()} | {"phi": local}
    functions = {name: getattr(sympy, name) for name in ("sin", "cos", "tan", "asin", "acos", "atan", "sqrt", "exp", "log")}

    def constant(number: float) -> Any:
        return sympy.nsimplify(number) if float(number).is_integer() else sympy.Float(number)

    try:
        tree = branch_of(ast.parse(law.text.replace("\\\n", " ").strip(), mode="eval").body, plain)
        names = {node.id: sympy.Symbol(node.id) for node in ast.walk(tree) if isinstance(node, ast.Name)}
        place = formulas.value_of(tree, names | {"pi": sympy.pi}, functions, constant)
    except (SyntaxError, ValueError, ArithmeticError):
        return ["", "", ""]
    phi, own = sympy.Symbol("phi"), made.driver
    first = sympy.diff(place, phi)
    lines = [ast.unparse(tree), str(first), str(sympy.diff(first, phi))]
    return [text if own == "phi" else re.sub(r"\bphi\b", own, text) for text in lines]


def branch_of(node: ast.expr, values: Mapping[str, float]) -> ast.expr:
    """A tree with every condition decided."""

    class Decided(ast.NodeTransformer):
        def visit_IfExp(self, node: ast.IfExp) -> Any:
            return self.visit(node.body if _holds(node.test, values) else node.orelse)

    branch = Decided().visit(node)
    assert isinstance(branch, ast.expr)
    return branch


def _holds(test: ast.expr, values: Mapping[str, float]) -> bool:
    """Tests whether a condition holds."""
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

    tree = Named().visit(node)
    assert isinstance(tree, ast.expr)
    return tree
