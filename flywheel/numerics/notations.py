"""Other notations of expressions (spreadsheets, calculators, C, textbooks), and how they are written here."""

from __future__ import annotations

import re
from collections.abc import Collection

CONDITION = "a condition is written a if c else b"
PRODUCT = "a product is written *"
_LETTERS = str.maketrans({"π": "pi", "φ": "phi", "ϕ": "phi", "ω": "omega"})
_LONGEST = 60  # of a text that is written anew as a whole
_CHOICES = tuple(
    re.compile(rf"\s*{form}\s*", re.IGNORECASE)
    for form in (
        r"(?:i?if|ifelse|where|cond)\s*\((?P<c>[^,;?|&]+)[,;](?P<a>[^,;]+)[,;](?P<b>[^,;]+)\)",
        r"(?P<c>[^?:|&]+)\?(?P<a>[^?:]+):(?P<b>[^?:]+)",
        r"if\b(?P<c>.+?)\bthen\b(?P<a>.+?)\belse\b(?P<b>.+)",
        r"(?P<c>[^<>=]+[<>=]+[^<>=]+?)\band\b(?P<a>[^<>=]+?)\bor\b(?P<b>[^<>=]+)",
    )
)
_HABITS = tuple(
    (re.compile(pattern), advice)
    for pattern, advice in (
        (r"\b[iI]+[fF]\s*\(.*[,;]|\?|\b(then|THEN)\b|\b(where|ifelse|piecewise|cond|switch|heaviside)\s*\(", CONDITION),
        (r"\bif\b(?!.*\belse\b)", CONDITION),
        (r"&|\bAND\b", "write and"),
        (r"\|\||\bOR\b", "write or"),
        (r"\|([^|]+)\|", r"write abs(\1)"),
        (r"!(?!=)|\bNOT\b", "write not"),
        (r"<>|≠", "write !="),
        (r"≤|=<", "write <="),
        (r"≥|=>", "write >="),
        (r"(?<![<>=!])=(?!=)", "a comparison for equality is written =="),
        (r"\b(sin|cos|tan)\s*(?:⁻¹|(?:\^|\*\*)\s*\(?-1\)?)", r"write a\1(...)"),
        (r"\b(sin|cos|tan)\s*(?:²|(?:\^|\*\*)\s*2)\s*\(([^()]*)\)", r"write \1(\2)**2"),
        (r"\be\s*(?:\^|\*\*)", "write exp(...)"),
        (r"[\^²³⁴⁵]", "a power is written **"),
        (r"[·×⋅∙•]", PRODUCT),
        (r"[÷∕:]", "a quotient is written /"),
        (r"[−–—]", "a minus is written -"),
        (r"√", "write sqrt(...)"),
        (r"°|\b(?:deg|rad|radians)\s*\(|\d\s*(?:deg|grad)\b", "angles in an expression are in rad: write 30*pi/180"),
        (r"^e$", "write exp(...)"),
        (r"π|\bPI\b|\bPi\b", "write pi"),
        (r"[φϕθϑ]|\btheta\b", "write phi"),
        (r"ω", "write omega"),
        (r"\btime\b", "write t"),
        (r"(?i)\b(?:np|numpy|c?math|sympy)\.", "functions have no prefix here: write sin(...)"),
        (r"\bln\s*\(", "log is the natural logarithm"),
        (r"\b(?:log10|lg)\s*\(", "write log(...)/log(10)"),
        (r"\b(?:sgn|signum)\s*\(", "write sign(...)"),
        (r"\bfabs\s*\(", "write abs(...)"),
        (r"\b(max|min)imum\s*\(", r"write \1(...)"),
        (r"\barc(sin|cos|tan)(2?)\s*\(", r"write a\1\2(...)"),
        (r"\b(sin|cos|tan)d\s*\(", r"angles in an expression are in rad: write \1(...*pi/180)"),
        (r"\bpow(?:er)?\s*\(", "a power is written **"),
        (r"\b(sin|cos)h\s*\(", "write it with exp(x) and exp(-x)"),
        (r"\btanh\s*\(", "write it with exp(x) and exp(-x)"),
        (r"\b(?:cot|ctg)\s*\(", "write 1/tan(...)"),
        (r"\btg\s*\(", "write tan(...)"),
        (r"\b(sin|cos|tan|asin|acos|atan|sqrt|exp|log|abs|sign)\s+(\w+)", r"write \1(\2)"),
        (r";", "arguments are separated by commas"),
    )
)


def written_here(text: str, names: Collection[str]) -> str:
    """Advice on the first habit of another notation in a text, if there is one; `names` are those of the expression.

    >>> written_here("if(v > 0, 1, -2)", ["v"]), written_here("3 sin(phi)", ["sin", "phi"])
    ('write 1 if v > 0 else -2', 'a product is written *: 3*sin')
    >>> written_here("|v|", ["v"]), written_here("v*abs(v)", ["v", "abs"])
    ('write abs(v)', '')
    """
    if whole := next((match for form in _CHOICES if (match := form.fullmatch(text))), None):
        c, a, b = (whole[name].strip() for name in "cab")
        advice = f"write {a} if {c} else {b}"
        return advice if len(advice) <= _LONGEST and advice.isascii() else CONDITION
    found = next((match.expand(advice) for pattern, advice in _HABITS if (match := pattern.search(text))), "")
    return found or product(text, names)


def product(text: str, names: Collection[str]) -> str:
    """Advice on a product without its sign: a number before a name or a bracket, or a bracket before another.

    >>> product("2*(3phi + 1)", ["phi"]), product("2.5e3*phi", ["phi"])
    ('a product is written *: 3*phi', '')
    >>> product("2π", ["pi"])
    'a product is written *: 2*pi'
    """
    text = text.translate(_LETTERS)
    for match in re.finditer(r"(?<![\w.])(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+|\))\s*([^\W\d]\w*|\()", text):
        left, right = match.groups()
        if right in names or (right == "(" and left != ")"):
            return f"{PRODUCT}: {left}*{right}"
        if right == "(":
            return PRODUCT
    return ""
