"""Formulas of the worked report: the same text in symbols, with the numbers put in, and its value, as MathML.

A formula is written as Python writes it, `r*cos(phi) + l*cos(beta)`. Numbers in a substitution have as many digits as it
takes to come to the digits that are shown of the result, so that a reader who works it out finds what is printed. Names
that end in `__1` or `__2` have one or two primes, in `__s` a star; what follows the first `_` is a subscript.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Mapping
from functools import cache
from html import escape
from typing import Any, NamedTuple

from flywheel.language import number as localized

DIGITS = 5
"""Significant digits that are shown of a result."""

_MOST = 15
_EXACT = 1e-13  # share by which a short number may miss a value that it is shown for
_NOTHING = 1e-11  # of the size of its terms: a result below it is 0
_HALF = 0.5 + 1e-6

GREEK = {
    "alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "epsilon": "ε", "eta": "η", "theta": "θ", "lambda": "λ",
    "mu": "μ", "nu": "ν", "xi": "ξ", "rho": "ρ", "sigma": "σ", "tau": "τ", "phi": "φ", "chi": "χ", "psi": "ψ",
    "omega": "ω", "Delta": "Δ", "Sigma": "Σ",
}  # fmt: skip
_MARKS = {"1": "′", "2": "″", "s": "*", "s1": "*′"}
_FUNCTIONS: Mapping[str, Callable[..., float]] = {
    "sin": math.sin, "cos": math.cos, "tan": math.tan, "asin": math.asin, "acos": math.acos, "atan": math.atan,
    "atan2": math.atan2, "sqrt": math.sqrt, "exp": math.exp, "log": math.log, "abs": abs, "min": min, "max": max,
    "sign": lambda x: float((x > 0) - (x < 0)),
}  # fmt: skip
_WORDS = {"asin": "arcsin", "acos": "arccos", "atan": "arctan", "log": "ln", "sign": "sgn"}
_COMPARED: Mapping[type, tuple[str, Callable[[float, float], bool]]] = {
    ast.Lt: ("<", lambda a, b: a < b),
    ast.LtE: ("≤", lambda a, b: a <= b),
    ast.Gt: (">", lambda a, b: a > b),
    ast.GtE: ("≥", lambda a, b: a >= b),
    ast.Eq: ("=", lambda a, b: a == b),
    ast.NotEq: ("≠", lambda a, b: a != b),
}


class Quantity(NamedTuple):
    """A value (SI) and the unit that it is shown in; an angle in ° is kept in rad."""

    value: float
    unit: str = ""

    @property
    def scale(self) -> float:
        """SI of one unit."""
        return math.pi / 180.0 if self.unit == "°" else 1.0


class Step(NamedTuple):
    """A formula with what its names stand for, and what it comes to; `of` is the name of that.

    `labels` gives names another look: head, subscript and mark, parted by `|` ("I|rod|*").
    """

    of: str
    formula: str
    values: Mapping[str, Quantity]
    result: Quantity
    labels: Mapping[str, str] = {}

    @property
    def shown(self) -> dict[str, str]:
        """Every value as it is put in, in its unit: as short as the digits of the result allow."""
        tree, told = parsed(self.formula), written(self.result)
        wanted = float(told)
        room = _half_digit(told) if wanted else 1e-9 * self.size
        texts: dict[str, str] = {}
        for digits in range(DIGITS, _MOST + 1):
            texts = {name: written(value, digits) for name, value in self.values.items()}
            rounded = {name: float(texts[name]) * value.scale for name, value in self.values.items()}
            try:
                if abs(evaluated(tree, rounded) / self.result.scale - wanted) <= room:
                    break
            except (ValueError, ZeroDivisionError, OverflowError):
                continue
        return texts

    @property
    def size(self) -> float:
        """The largest number in it, which tells what of a result is nothing but rounding."""
        return max((abs(value.value) for value in self.values.values()), default=1.0) or 1.0


def quantity(value: Any, unit: str = "") -> Quantity:
    """A value (SI; an angle in rad, whose unit may be °) with the unit that it is shown in."""
    return Quantity(float(value), unit)


def step(
    of: str,
    formula: str,
    values: Mapping[str, Quantity],
    unit: str,
    labels: Mapping[str, str] | None = None,
    *,
    found: Any = None,
) -> Step:
    """A formula with its values; the result is what it comes to, or what the library found by its own way."""
    tree = parsed(formula)
    used = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)} - set(_FUNCTIONS) - {"pi"}
    known = {name: values[name] for name in values if name in used}
    plain = {name: value.value for name, value in known.items()}
    result = evaluated(tree, plain) if found is None else float(found)
    size = max((abs(value) for value in plain.values()), default=1.0)
    if abs(result) <= _NOTHING * size and abs(evaluated(tree, plain)) <= 10 * _NOTHING * size:
        result = 0.0
    return Step(of, formula, known, Quantity(result, unit), labels or {})


# -- numbers -----------------------------------------------------------------------------------------------------------


def written(value: Quantity, digits: int = DIGITS) -> str:
    """A value in its unit to so many significant digits, with a decimal point; shorter where that is the same number.

    >>> written(Quantity(0.0234567)), written(Quantity(400000.0)), written(Quantity(math.pi, "°")), written(Quantity(1.5e-9))
    ('0.0234567', '400000', '180', '1.5e-09')
    """
    own = value.value / value.scale
    if own == 0.0 or not math.isfinite(own):
        return "0" if own == 0.0 else str(own)
    for longer in range(digits, 10):  # a number of a scene is shown as it was given, and not rounded
        if abs(float(f"{own:.{longer}g}") - own) <= _EXACT * abs(own):
            digits = longer
            break
    text = f"{own:.{digits}g}"
    if "e" in text and 1e-4 <= abs(own) < 1e9:
        text = f"{float(text):.0f}"
    return text


def _half_digit(text: str) -> float:
    """Half a unit of the last digit that is shown of a number, of the fifth one where fewer are."""
    value, (mantissa, _, power) = abs(float(text)), text.partition("e")
    decimals = len(mantissa.partition(".")[2]) - int(power or 0)
    return float(_HALF * 10.0 ** min(math.floor(math.log10(value)) - DIGITS + 1, -decimals if decimals > 0 else 0))


def told(value: Quantity, digits: int = DIGITS) -> str:
    r"""A value with its unit as text, in the language in use, with a true minus sign.

    >>> told(Quantity(-0.5, "kg m²")), told(Quantity(1.5e-9, "m"))
    ('−0.5\xa0kg m²', '1.5·10⁻⁹\xa0m')
    """
    text, _, power = localized(written(value, digits)).partition("e")
    if power:
        text += "·10" + "".join("⁻" if sign == "-" else "⁰¹²³⁴⁵⁶⁷⁸⁹"[int(sign)] for sign in str(int(power)))
    space = "" if value.unit in ("", "°") else "\u00a0"
    return text.replace("-", "−") + space + value.unit


# -- trees -------------------------------------------------------------------------------------------------------------


@cache
def parsed(formula: str) -> ast.expr:
    """The tree of a formula."""
    return ast.parse(formula.strip(), mode="eval").body


def evaluated(node: ast.expr, values: Mapping[str, float]) -> float:
    """What a tree comes to with numbers for its names."""

    def of(inner: ast.expr) -> float:
        return evaluated(inner, values)

    match node:
        case ast.Constant(value=number):
            return float(number)  # type: ignore[arg-type]
        case ast.Name(id=name):
            return math.pi if name == "pi" and name not in values else values[name]
        case ast.BinOp(left=left, op=op, right=right):
            a, b = of(left), of(right)
            if isinstance(op, ast.Add | ast.Sub):
                return a + b if isinstance(op, ast.Add) else a - b
            if isinstance(op, ast.Mult | ast.Div):
                return a * b if isinstance(op, ast.Mult) else a / b
            return float(a**b)
        case ast.UnaryOp(op=op, operand=operand):
            return (
                float(not of(operand))
                if isinstance(op, ast.Not)
                else -of(operand)
                if isinstance(op, ast.USub)
                else of(operand)
            )
        case ast.Call(func=ast.Name(id=name), args=args):
            return float(_FUNCTIONS[name](*map(of, args)))
        case ast.IfExp(test=test, body=yes, orelse=no):
            return of(yes) if of(test) else of(no)
        case ast.Compare(left=left, ops=ops, comparators=others):
            members = [left, *others]
            pairs = zip(ops, members, members[1:], strict=False)
            return float(all(_COMPARED[type(sign)][1](of(a), of(b)) for sign, a, b in pairs))
        case ast.BoolOp(op=op, values=parts):
            return float((all if isinstance(op, ast.And) else any)(of(part) for part in parts))
    raise ValueError(f"found {ast.unparse(node)!r}, expected a formula")


# -- MathML ------------------------------------------------------------------------------------------------------------

_TIMES, _APPLY = "\u2062", "\u2061"  # invisible: a product, and a function of what follows


def mathml(shown: Step | str, labels: Mapping[str, str] | None = None) -> str:
    """A step as a block of MathML, its symbols, its substitution and its result in three rows; or a formula alone."""
    if isinstance(shown, str):
        left, _, right = shown.partition("==")
        inner = _tree(parsed(left), labels or {}, None)
        inner += f"<mo>=</mo>{_tree(parsed(right), labels or {}, None)}" if right else ""
        return f'<math xmlns="http://www.w3.org/1998/Math/MathML" display="block"><mrow>{inner}</mrow></math>'
    texts, tree = shown.shown, parsed(shown.formula)
    numbers = {name: _number(texts[name], value.unit) for name, value in shown.values.items()}
    symbol, result = identifier(shown.of, shown.labels), _number(written(shown.result), shown.result.unit)[0]
    rows = [(symbol, f"<mo>=</mo>{_tree(tree, shown.labels, None)}")]
    if not isinstance(tree, ast.Name | ast.Constant) and numbers:
        rows.append(("", f"<mo>=</mo>{_tree(tree, shown.labels, numbers)}"))
    if isinstance(tree, ast.Name):
        rows = [(symbol, f"<mo>=</mo>{_tree(tree, shown.labels, None)}")]
    rows.append(("", f"<mo>=</mo>{result}"))
    table = "".join(
        f'<mtr><mtd style="text-align:right">{left}</mtd><mtd style="text-align:left"><mrow>{right}</mrow></mtd></mtr>'
        for left, right in rows
    )
    return f'<math xmlns="http://www.w3.org/1998/Math/MathML" display="block"><mtable>{table}</mtable></math>'


def identifier(name: str, labels: Mapping[str, str] | None = None) -> str:
    """A name as MathML, with its subscript and its mark.

    >>> identifier("theta_G__1")
    '<msubsup><mi>θ</mi><mi>G</mi><mo>′</mo></msubsup>'
    """
    if labels and name in labels:
        head, sub, mark = (*labels[name].split("|"), "", "")[:3]
    else:
        base, _, mark = name.partition("__")
        head, _, sub = base.partition("_")
        head, mark = GREEK.get(head, head), _MARKS.get(mark, mark)
    letter = f"<mi>{escape(head)}</mi>"
    below = GREEK.get(sub, sub)
    under = f"<mi>{escape(below)}</mi>" if len(below) == 1 else f"<mtext>{escape(below)}</mtext>"
    above = f"<mo>{escape(mark)}</mo>"
    if sub and mark:
        return f"<msubsup>{letter}{under}{above}</msubsup>"
    return f"<msub>{letter}{under}</msub>" if sub else f"<msup>{letter}{above}</msup>" if mark else letter


def _number(text: str, unit: str = "") -> tuple[str, bool]:
    """A number with its unit as MathML, and whether it needs brackets in a product."""
    digits, _, power = localized(text.lstrip("-")).partition("e")
    inner = f"<mn>{digits}</mn>"
    if power:
        exponent = f"<mn>{int(power)}</mn>" if int(power) >= 0 else f"<mrow><mo>−</mo><mn>{-int(power)}</mn></mrow>"
        inner += f"<mo>·</mo><msup><mn>10</mn>{exponent}</msup>"
    inner = f"<mo>−</mo>{inner}" if text.startswith("-") else inner
    if unit == "°":
        inner += '<mtext class="unit">°</mtext>'
    elif unit:
        inner += f'<mtext class="unit">\u00a0{escape(unit)}</mtext>'
    return f"<mrow>{inner}</mrow>", text.startswith("-") or bool(power)


_SUM, _PRODUCT, _ATOM = 1, 2, 4


def _rank(node: ast.expr, numbers: Mapping[str, tuple[str, bool]] | None) -> int:
    """How tightly a tree holds together."""
    match node:
        case ast.BinOp(op=ast.Add() | ast.Sub()) | ast.UnaryOp() | ast.Compare() | ast.BoolOp():
            return _SUM
        case ast.BinOp(op=ast.Mult()):
            return _PRODUCT
        case ast.Name(id=name) if numbers and name in numbers and numbers[name][1]:
            return _SUM
        case ast.Constant(value=number) if isinstance(number, int | float) and number < 0:
            return _SUM
    return _ATOM


def _tree(node: ast.expr, labels: Mapping[str, str], numbers: Mapping[str, tuple[str, bool]] | None) -> str:
    """A tree as MathML, in symbols, or with the numbers put in."""

    def of(inner: ast.expr, least: int = 0) -> str:
        found = _tree(inner, labels, numbers)
        return f"<mrow><mo>(</mo>{found}<mo>)</mo></mrow>" if _rank(inner, numbers) < least else found

    match node:
        case ast.Constant(value=number):
            return _number(written(Quantity(float(number)), 10))[0]  # type: ignore[arg-type]
        case ast.Name(id="pi"):
            return "<mi>π</mi>"
        case ast.Name(id=name):
            return numbers[name][0] if numbers and name in numbers else identifier(name, labels)
        case ast.BinOp(left=left, op=ast.Pow(), right=right):
            base = of(left, _ATOM)
            if (numbers and isinstance(left, ast.Name) and left.id in numbers) or isinstance(left, ast.Call | ast.BinOp):
                base = f"<mrow><mo>(</mo>{_tree(left, labels, numbers)}<mo>)</mo></mrow>"
            return f"<msup>{base}<mrow>{of(right)}</mrow></msup>"
        case ast.BinOp(left=left, op=ast.Div(), right=right):
            return f"<mfrac><mrow>{of(left)}</mrow><mrow>{of(right)}</mrow></mfrac>"
        case ast.BinOp(left=left, op=ast.Mult(), right=right):
            sign = "·" if numbers or isinstance(right, ast.Constant) or isinstance(left, ast.Call) else _TIMES
            return f"{of(left, _PRODUCT)}<mo>{sign}</mo>{of(right, _ATOM)}"
        case ast.BinOp(left=left, op=op, right=right):
            sign = "+" if isinstance(op, ast.Add) else "−"
            first = of(left) if not isinstance(left, ast.Compare | ast.BoolOp) else of(left, _PRODUCT)
            return f"{first}<mo>{sign}</mo>{of(right, _PRODUCT)}"
        case ast.UnaryOp(op=op, operand=operand):
            sign = "¬" if isinstance(op, ast.Not) else "−" if isinstance(op, ast.USub) else "+"
            return f"<mo>{sign}</mo>{of(operand, _PRODUCT)}"
        case ast.Call(func=ast.Name(id="sqrt"), args=[inner]):
            return f"<msqrt>{of(inner)}</msqrt>"
        case ast.Call(func=ast.Name(id="abs"), args=[inner]):
            return f"<mrow><mo>|</mo>{of(inner)}<mo>|</mo></mrow>"
        case ast.Call(func=ast.Name(id=name), args=args):
            bare = len(args) == 1 and isinstance(args[0], ast.Name) and _rank(args[0], numbers) == _ATOM
            listed = "<mo>;</mo>".join(map(of, args))
            listed = listed if bare else f"<mrow><mo>(</mo>{listed}<mo>)</mo></mrow>"
            return f"<mrow><mi>{_WORDS.get(name, name)}</mi><mo>{_APPLY}</mo>{listed}</mrow>"
        case ast.IfExp(test=test, body=yes, orelse=no):
            return _cases(yes, test, no, of)
        case ast.Compare(left=left, ops=ops, comparators=others):
            return of(left) + "".join(
                f"<mo>{escape(_COMPARED[type(s)][0])}</mo>{of(o)}" for s, o in zip(ops, others, strict=True)
            )
        case ast.BoolOp(op=op, values=parts):
            return f"<mo>{'∧' if isinstance(op, ast.And) else '∨'}</mo>".join(of(part, _SUM) for part in parts)
    raise ValueError(f"found {ast.unparse(node)!r}, expected a formula")


def _cases(yes: ast.expr, test: ast.expr, no: ast.expr, of: Callable[[ast.expr], str]) -> str:
    """What holds under conditions, one below another behind a brace."""
    from flywheel.language import text as _

    rows, otherwise = [(of(yes), of(test))], no
    while isinstance(otherwise, ast.IfExp):
        rows.append((of(otherwise.body), of(otherwise.test)))
        otherwise = otherwise.orelse
    lines = [f"<mtr><mtd>{a}</mtd><mtd><mtext>{escape(_('if'))}\u00a0</mtext>{b}</mtd></mtr>" for a, b in rows]
    lines.append(f"<mtr><mtd>{of(otherwise)}</mtd><mtd><mtext>{escape(_('otherwise'))}</mtext></mtd></mtr>")
    return f'<mrow><mo stretchy="true">{{</mo><mtable>{"".join(lines)}</mtable></mrow>'
