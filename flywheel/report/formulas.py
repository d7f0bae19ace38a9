"""Formulas of the report: one text is shown as a formula, shown again with numbers and units, and evaluated.

A formula is written as in Python, `"J = (W_max - W_min)/(epsilon*omega**2)"`, so that the displayed formula and the one that
a test evaluates are the same tree. Names are symbols: `phi` is a Greek letter, the part after `_` an index, `I_star` is I
with a star, `g_prime` a g with a prime, `omega_mean` has the index "mean". In addition to functions there are `integral(f,
phi, a, b)`, `total(f, k)` (the sum over k), `derivative(f, phi)`, `greatest(f, phi)` and `least(f, phi)` (over the angle),
which are shown and not evaluated. Any name may be called: `W(phi)`.
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping
from functools import cache
from html import escape
from typing import Any, NamedTuple

from flywheel import language
from flywheel.language import text as _
from flywheel.numerics.units import parse_unit

DIGITS = 6
"""Significant digits of a number that is shown."""
MOST_DIGITS = 15
_UNBROKEN = 40  # characters of a formula that stands in one line
_ROW = 60  # characters of a numerator or denominator in one row

_LETTERS = "alpha beta gamma delta epsilon zeta eta theta kappa mu nu xi rho sigma tau phi psi omega lamda chi pi"
_GREEK = dict(zip(_LETTERS.split(" "), "αβγδεζηθκμνξρστφψωλχπ", strict=True)) | {
    "Delta": "Δ",
    "Omega": "Ω",
    "Sigma": "Σ",
    "Phi": "Φ",
    "Psi": "Ψ",
    "Theta": "Θ",
}
_MARKS = {"star": "*", "prime": "′", "second": "″", "plus": "+", "minus": "−"}
_FUNCTIONS: Mapping[str, Callable[..., float]] = {
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "asin": math.asin,
    "acos": math.acos,
    "atan": math.atan,
    "atan2": math.atan2,
    "sqrt": math.sqrt,
    "exp": math.exp,
    "log": math.log,
    "abs": abs,
    "min": min,
    "max": max,
    "sign": lambda x: float((x > 0) - (x < 0)),
}
_SIGNS: Mapping[type[ast.unaryop], Callable[[Any], Any]] = {ast.UAdd: operator.pos, ast.USub: operator.neg}
_OPERATIONS: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
_ESCAPES = {"-": "‿", ".": "·", " ": "⁔", "_": "⁀"}  # in an index: letters that a name in Python may have
_RELATIONS = {ast.Lt: "<", ast.LtE: "≤", ast.Gt: ">", ast.GtE: "≥", ast.Eq: "=", ast.NotEq: "≠"}
_RAISED = str.maketrans("0123456789−", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")
_LOOSE, _SUM, _PRODUCT, _POWER, _ATOM = range(5)
"""Precedence of the parts of a formula: a part with a lower one than its position requires is put in brackets."""


class FormulaError(ValueError):
    """A text that is no formula, or one that cannot be evaluated."""


class Quantity(NamedTuple):
    """A number to show: its symbol as in formulas, its value in SI, and its unit and digits."""

    symbol: str
    value: float
    unit: str = ""
    digits: int = DIGITS

    @property
    def written(self) -> str:
        """The number as shown, in English and without its unit, `353.521` or `1.2e-07`."""
        return written(self.value / factor(self.unit), self.digits)

    @property
    def value_written(self) -> float:
        """Value of the shown number, in SI."""
        return float(self.written) * factor(self.unit)


def written(value: float, digits: int = DIGITS) -> str:
    """A number with its significant digits, without trailing zeros.

    >>> written(353.5214273), written(0.5), written(-0.0), written(1234567.0)
    ('353.521', '0.5', '0', '1.23457e+06')
    """
    return f"{value + 0.0:.{digits}g}" if value else "0"


@cache
def factor(unit: str) -> float:
    """The SI value of a unit as it is shown.

    >>> factor("kg m²"), factor("kN"), factor("")
    (1.0, 1000.0, 1.0)
    """
    if not unit:
        return 1.0
    unit_factor = parse_unit(unit, "frequency" if unit == "Hz" else None)  # of which an expression could not tell turns
    return unit_factor.numerator / unit_factor.denominator


def index(name: str) -> str:
    """A name of the scene (a body, a load, a shaft) as an index of a symbol.

    >>> "g_" + index("scotch-yoke.yoke")
    'g_scotch‿yoke·yoke'
    """
    return "".join(_ESCAPES.get(c, c) for c in name if c in _ESCAPES or ("a" + c).isidentifier())


# -- a symbol ---------------------------------------------------------------------------------------------------------


def _split(symbol: str) -> tuple[str, str, str]:
    """The letter, the index and the marks of a symbol, as they are shown."""
    head, *rest = symbol.split("_")
    base = "Δ" + head[5:] if head.startswith("Delta") else _GREEK.get(head, head)
    marks = "".join(_MARKS[part] for part in rest if part in _MARKS)
    words = {"mean": _("mean"), "time": _("time"), "total": _("total"), "areas": _("areas"), "before": _("before")}
    words |= {"torque": _("torque"), "short": _("short"), "alone": _("alone"), "arms": _("arms"), "hub": _("hub")}
    parts = [words.get(part, _GREEK.get(part, part)) for part in rest if part not in _MARKS and part]
    below = ",".join(parts)
    for plain, stand_in in _ESCAPES.items():
        base, below = base.replace(stand_in, plain), below.replace(stand_in, plain)
    return base, below, marks


def symbol_text(symbol: str) -> str:
    """A symbol in plain text.

    >>> symbol_text("I_star"), symbol_text("omega_max"), symbol_text("g_slider_prime"), symbol_text(index("load_torque"))
    ('I*', 'ω_max', 'g′_slider', 'load_torque')
    """
    base, below, marks = _split(symbol)
    return base + marks + (f"_{below}" if below else "")


def symbol_math(symbol: str) -> str:
    """A symbol in MathML.

    >>> symbol_math("I_star")
    '<msup><mi>I</mi><mo>*</mo></msup>'
    """
    base, below, marks = _split(symbol)
    upright = ' mathvariant="normal"' if base in "πΔ" else ""
    letter = f"<mi{upright}>{escape(base)}</mi>"
    kind = "mn" if below.isdigit() else "mi" if len(below) == 1 else "mtext"
    lower = f"<{kind}>{escape(below)}</{kind}>"
    upper = f"<mo>{escape(marks)}</mo>"
    if below and marks:
        return f"<msubsup>{letter}{lower}{upper}</msubsup>"
    if below:
        return f"<msub>{letter}{lower}</msub>"
    return f"<msup>{letter}{upper}</msup>" if marks else letter


# -- a formula --------------------------------------------------------------------------------------------------------


class Markup(NamedTuple):
    """A part of a formula as MathML and as text, and its precedence."""

    math: str
    text: str
    binds: int = _ATOM


@cache
def sides(formula: str) -> tuple[ast.expr, ...]:
    """The expressions of a formula, one for each side of its equals signs.

    Raises:
        FormulaError: for a text that is no formula.

    """
    try:
        return tuple(ast.parse(side.strip(), mode="eval").body for side in formula.split(" = "))
    except SyntaxError as error:
        raise FormulaError(f"{formula!r} is no formula: {error}") from None


def symbols(formula: str) -> frozenset[str]:
    """The symbols of a formula's last side, to which its numbers belong; symbols that are only shown are left out.

    >>> sorted(symbols("J = (W_max - W_min)/(epsilon*omega**2)"))
    ['W_max', 'W_min', 'epsilon', 'omega']
    """
    return frozenset(_names(sides(formula)[-1]))


def _names(node: ast.AST) -> set[str]:
    if isinstance(node, ast.Name):
        return set() if node.id == "pi" else {node.id}
    if isinstance(node, ast.Call):
        return set().union(*(_names(argument) for argument in node.args))
    return set().union(*(_names(child) for child in ast.iter_child_nodes(node)))


def value(formula: str, numbers: Mapping[str, float]) -> float:
    """The value of a formula's last side with numbers (SI).

    Raises:
        FormulaError: if a number is missing, or a part cannot be evaluated (an integral).

    >>> value("v = r*omega*sin(pi/2)", {"r": 0.5, "omega": 4.0})
    2.0

    """
    return float(value_of(sides(formula)[-1], {"pi": math.pi, **numbers}, _FUNCTIONS, float))


def value_of(
    node: ast.expr,
    names: Mapping[str, Any],
    functions: Mapping[str, Callable[..., Any]],
    number: Callable[[float], Any],
) -> Any:
    """The value of a tree over any kind of number: with values for its names; `number` converts a constant."""
    match node:
        case ast.Constant(value=int() | float() as constant):
            return number(constant)
        case ast.Name(id=name) if name in names:
            return names[name]
        case ast.UnaryOp(op=op, operand=inner) if type(op) in _SIGNS:
            return _SIGNS[type(op)](value_of(inner, names, functions, number))
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATIONS:
            a, b = (value_of(side, names, functions, number) for side in (left, right))
            return _OPERATIONS[type(op)](a, b)
        case ast.Call(func=ast.Name(id=name), args=arguments) if name in functions:
            return functions[name](*(value_of(argument, names, functions, number) for argument in arguments))
    raise FormulaError(f"{ast.unparse(node)!r} is not worked out")


def computable(formula: str) -> bool:
    """Tests whether a formula can be evaluated once its symbols have numbers."""
    for node in ast.walk(sides(formula)[-1]):
        if isinstance(node, ast.Call) and not (isinstance(node.func, ast.Name) and node.func.id in _FUNCTIONS):
            return False
        if isinstance(node, ast.Compare | ast.IfExp | ast.BoolOp):
            return False
    return True


def mathml(formula: str, numbers: Mapping[str, Quantity] | None = None, *, display: bool = True) -> str:
    """A formula as MathML, in a separate line or not, read out by its text; with numbers in its last side, if given.

    The numbers have the decimal mark of the language in use. A long formula in a line of its own is several elements, one
    for each term of its sums: lines break between them, wherever a sheet or a screen is too narrow.
    """
    *heads, last = sides(formula)
    terms: list[Markup] = []
    for side, numerals in [*((head, {}) for head in (heads[:1] if numbers else heads)), (last, numbers or {})]:
        first, *others = _terms(side, numerals)
        if len(terms) == 1:  # the first side stands before the first term of the second
            terms = [Markup(f"{terms[0].math}<mo>=</mo>{first.math}", f"{terms[0].text} = {first.text}"), *others]
        else:
            terms += [_signed("=", first) if terms else first, *others]
    if display and len(terms) > 1 and sum(len(term.text) for term in terms) > _UNBROKEN:
        return " ".join(_element(term, ' displaystyle="true"') for term in terms)
    return element("".join(term.math for term in terms), " ".join(term.text for term in terms), display=display)


def _terms(node: ast.expr, numbers: Mapping[str, Quantity]) -> list[Markup]:
    """The terms of a sum, all but the first with their signs; anything else is one term."""
    if not (isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub)):
        return [_markup(node, numbers)]
    first, *others = _terms(node.left, numbers)
    last, sign = _markup(node.right, numbers), "+" if isinstance(node.op, ast.Add) else "−"
    # a negative number, or a sum that is taken away, is put in brackets
    last = _bracketed(last, _PRODUCT if sign == "−" or last.text.startswith("−") else _SUM)
    return [_bracketed(first, _SUM), *others, _signed(sign, last)]


def _signed(sign: str, term: Markup) -> Markup:
    return Markup(f'<mo form="infix">{sign}</mo>{term.math}', f"{sign} {term.text}", _SUM)


def equation(quantity: Quantity) -> str:
    """A symbol and its number as MathML in a line of its own."""
    number = numeral(quantity)
    if not quantity.symbol:
        return element(number.math, number.text)
    return element(
        f"{symbol_math(quantity.symbol)}<mo>=</mo>{number.math}", f"{symbol_text(quantity.symbol)} = {number.text}"
    )


def element(inner: str, text: str, *, display: bool = True) -> str:
    """A MathML element around its content, with a text for screen readers without MathML."""
    return _element(Markup(inner, text), ' display="block"' if display else "")


def _element(markup: Markup, attributes: str) -> str:
    return f'<math{attributes} alttext="{escape(markup.text)}"><mrow>{markup.math}</mrow></math>'


def symbol_element(symbol: str) -> str:
    """A symbol as MathML within a line of text."""
    return element(symbol_math(symbol), symbol_text(symbol), display=False)


def numeral(quantity: Quantity) -> Markup:
    """A number with its unit, a power of ten written as such."""
    number = _number(quantity.written)
    if not quantity.unit:
        return number
    gap = "" if quantity.unit in ("°",) else '<mspace width="0.2em"></mspace>'
    suffix = quantity.unit if quantity.unit in ("°",) else f" {quantity.unit}"
    binds = min(number.binds, _PRODUCT)
    return Markup(f"{number.math}{gap}<mtext>{escape(quantity.unit)}</mtext>", number.text + suffix, binds)


def bare(quantity: Quantity) -> str:
    """A number in its unit, as text without the unit.

    >>> bare(Quantity("phi", 0.5235987755982988, "°"))
    '30'
    """
    return _number(quantity.written).text


def _number(english: str) -> Markup:
    sign, digits = ('<mo form="prefix">−</mo>', english[1:]) if english.startswith("-") else ("", english)
    digits, _, power = digits.partition("e")
    numeral = language.number(digits)
    markup, text = f"{sign}<mn>{numeral}</mn>", ("−" if sign else "") + numeral
    if power:
        exponent = str(int(power)).replace("-", "−")
        markup = f"{markup}<mo>·</mo><msup><mn>10</mn><mn>{exponent}</mn></msup>"
        text = f"{text}·10{exponent.translate(_RAISED)}"
    return Markup(markup, text, _SUM if sign else _PRODUCT if power else _ATOM)


def _bracketed(markup: Markup, least: int) -> Markup:
    if markup.binds >= least:
        return markup
    return Markup(f"<mrow><mo>(</mo>{markup.math}<mo>)</mo></mrow>", f"({markup.text})")


def _markup(node: ast.expr, numbers: Mapping[str, Quantity]) -> Markup:
    def show(inner: ast.expr, least: int = _LOOSE) -> Markup:
        return _bracketed(_markup(inner, numbers), least)

    match node:
        case ast.Constant(value=int() | float() as number):
            return _number(written(number, 12))
        case ast.Name(id=name) if name in numbers:
            return numeral(numbers[name])
        case ast.Name(id=name):
            return Markup(symbol_math(name), symbol_text(name))
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            part = show(inner, _PRODUCT)
            return Markup(f'<mo form="prefix">−</mo>{part.math}', f"−{part.text}", _SUM)
        case ast.UnaryOp(op=ast.Not(), operand=inner):
            part = show(inner, _POWER)
            return Markup(f"<mo>¬</mo>{part.math}", f"not {part.text}", _SUM)
        case ast.UnaryOp(operand=inner):
            return show(inner)
        case ast.BinOp(op=ast.Add() | ast.Sub()):
            terms = _terms(node, numbers)
            return Markup("".join(term.math for term in terms), " ".join(term.text for term in terms), _SUM)
        case ast.BinOp(left=left, op=op, right=right):
            return _operation(left, op, right, numbers)
        case ast.Compare(left=left, ops=ops, comparators=others):
            first, marks = show(left, _SUM), [_RELATIONS.get(type(op), "?") for op in ops]
            parts = [show(other, _SUM) for other in others]
            markup = first.math + "".join(f"<mo>{escape(m)}</mo>{p.math}" for m, p in zip(marks, parts, strict=True))
            text = first.text + "".join(f" {m} {p.text}" for m, p in zip(marks, parts, strict=True))
            return Markup(markup, text, _LOOSE)
        case ast.BoolOp(op=op, values=values):
            word = language.text("and") if isinstance(op, ast.And) else language.text("or")
            parts = [show(one, _SUM) for one in values]
            joined = f"<mtext>&nbsp;{word}&nbsp;</mtext>".join(part.math for part in parts)
            return Markup(joined, f" {word} ".join(part.text for part in parts), _LOOSE)
        case ast.IfExp(test=test, body=body, orelse=other):
            return _piecewise(show(body), show(test), show(other))
        case ast.Call(func=ast.Name(id=name), args=arguments):
            return _call(name, [_markup(argument, numbers) for argument in arguments])
    raise FormulaError(f"{ast.unparse(node)!r} is no part of a formula")


def _operation(left: ast.expr, op: ast.operator, right: ast.expr, numbers: Mapping[str, Quantity]) -> Markup:
    a, b = _markup(left, numbers), _markup(right, numbers)
    match op:
        case ast.Mult():
            a, b = _bracketed(a, _PRODUCT), _bracketed(b, _PRODUCT)
            times = isinstance(left, ast.Constant) or isinstance(right, ast.Constant) or bool(numbers)
            gap = ' rspace="0.17em"' if isinstance(right, ast.Call) else ""
            mark, word = ("<mo>·</mo>", " · ") if times and numbers else (f"<mo{gap}>&#x2062;</mo>", " ")
            return Markup(f"{a.math}{mark}{b.math}", f"{a.text}{word}{b.text}", _PRODUCT)
        case ast.Div():
            up, down = _bracketed(a, _PRODUCT), _bracketed(b, _POWER)
            fraction = f"<mfrac>{_rows(left, numbers)}{_rows(right, numbers)}</mfrac>"
            return Markup(fraction, f"{up.text}/{down.text}", _PRODUCT)
        case ast.Pow():
            a, up = _bracketed(a, _ATOM), _bracketed(b, _ATOM)
            return Markup(f"<msup><mrow>{a.math}</mrow><mrow>{b.math}</mrow></msup>", f"{a.text}^{up.text}", _POWER)
        case ast.Mod():
            a, b = _bracketed(a, _PRODUCT), _bracketed(b, _PRODUCT)
            return Markup(f"{a.math}<mo>mod</mo>{b.math}", f"{a.text} mod {b.text}", _PRODUCT)
    raise FormulaError(f"{type(op).__name__} is no operation of a formula")


def _rows(node: ast.expr, numbers: Mapping[str, Quantity]) -> str:
    """A numerator or denominator, in which no line breaks: a long sum has a row for each term."""
    terms = _terms(node, numbers)
    if sum(len(term.text) for term in terms) <= _ROW:
        return f"<mrow>{''.join(term.math for term in terms)}</mrow>"
    return f"<mtable>{''.join(f'<mtr><mtd>{term.math}</mtd></mtr>' for term in terms)}</mtable>"


def _piecewise(body: Markup, test: Markup, other: Markup) -> Markup:
    word, otherwise = language.text("if"), language.text("otherwise")
    rows = (
        f"<mtr><mtd>{body.math}</mtd><mtd><mtext>{word}&nbsp;</mtext>{test.math}</mtd></mtr>"
        f"<mtr><mtd>{other.math}</mtd><mtd><mtext>{otherwise}</mtext></mtd></mtr>"
    )
    markup = f'<mrow><mo fence="true">{{</mo><mtable columnalign="left">{rows}</mtable></mrow>'
    return Markup(markup, f"({body.text} {word} {test.text}, {otherwise} {other.text})")


def _call(name: str, arguments: list[Markup]) -> Markup:
    parts, texts = [a.math for a in arguments], [a.text for a in arguments]
    match name, arguments:
        case "integral", [f, x, low, high]:
            f = _bracketed(f, _PRODUCT)
            sign = f"<msubsup><mo>∫</mo><mrow>{low.math}</mrow><mrow>{high.math}</mrow></msubsup>"
            text = f"∫ from {low.text} to {high.text} of {f.text} d{x.text}"
            return Markup(
                f'{sign}{f.math}<mspace width="0.2em"></mspace><mi mathvariant="normal">d</mi>{x.math}', text, _PRODUCT
            )
        case "total", [f, k]:
            f = _bracketed(f, _PRODUCT)
            return Markup(f"<munder><mo>∑</mo><mrow>{k.math}</mrow></munder>{f.math}", f"∑_{k.text} {f.text}", _PRODUCT)
        case "derivative", [f, x]:
            f, d = _bracketed(f, _ATOM), '<mi mathvariant="normal">d</mi>'
            return Markup(f"<mfrac><mrow>{d}{f.math}</mrow><mrow>{d}{x.math}</mrow></mfrac>", f"d{f.text}/d{x.text}", _POWER)
        case (("greatest" | "least"), [f, x]):
            word = "max" if name == "greatest" else "min"
            f = _bracketed(f, _ATOM)
            return Markup(
                f"<munder><mo>{word}</mo><mrow>{x.math}</mrow></munder>{f.math}", f"{word}_{x.text} {f.text}", _PRODUCT
            )
        case "sqrt", [x]:
            return Markup(f"<msqrt>{x.math}</msqrt>", f"√({x.text})")
        case "abs", [x]:
            return Markup(f'<mrow><mo fence="true">|</mo>{x.math}<mo fence="true">|</mo></mrow>', f"|{x.text}|")
        case "exp", [x]:
            return Markup(f"<msup><mi>e</mi><mrow>{x.math}</mrow></msup>", f"e^({x.text})", _POWER)
    symbol = {"asin": "arcsin", "acos": "arccos", "atan": "arctan", "log": "ln"}.get(name, name)
    head = f"<mi>{symbol}</mi>" if name in _FUNCTIONS else symbol_math(name)
    text = symbol if name in _FUNCTIONS else symbol_text(name)
    between = "<mo>,</mo>".join(parts)
    return Markup(f"{head}<mo>&#x2061;</mo><mrow><mo>(</mo>{between}<mo>)</mo></mrow>", f"{text}({', '.join(texts)})")
