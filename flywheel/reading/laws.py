"""Efforts and positions as a scene writes them: a quantity, a number, an expression or a table."""

from __future__ import annotations

import re

from flywheel.advice import nearest, show
from flywheel.faults import Fault
from flywheel.formulas.expressions import Expression, ExpressionError, parse
from flywheel.reading.fields import Faults
from flywheel.reading.places import Setting
from flywheel.units import DIMENSIONS, QuantityError, Unit, convert, parse_quantity, split_quantity

_WORDS = re.compile(r"\b(?:if|else|and|or|not)\b|[+(<>=]")


def read_effort(value: object, dimension: str, path: str, setting: Setting) -> float | Expression | None:
    """A force or torque: a bare number, a quantity, or an expression of SI numbers; None after noting a fault."""
    faults = setting.faults
    if isinstance(value, str):
        return _effort_text(value, dimension, path, setting)
    try:
        return parse_quantity(value, dimension)
    except QuantityError as error:
        faults.add(path, error.found, f"{error.expected}, or an expression", error.advice)
        return None


def _effort_text(text: str, dimension: str, path: str, setting: Setting) -> float | Expression | None:
    """A text that is a quantity is one; any other text is an expression."""
    parts = split_quantity(text)
    if parts is not None and not parts[1]:
        parts = parts[0], DIMENSIONS[dimension].si
    if parts is not None and re.match(r"[^\W\d_]|[%°,]|1\s*/", parts[1]) and not _WORDS.search(parts[1]):
        return _quantity(text, parts, dimension, path, setting.faults)
    return read_expression(text, path, setting)


def _quantity(text: str, parts: tuple[str, str], dimension: str, path: str, faults: Faults) -> float | None:
    """A number with a unit; a number alone is SI, as it would be in an expression."""
    try:
        return convert(parts[0], Unit()) if text.strip() == parts[0] else parse_quantity(text, dimension)
    except QuantityError as error:
        faults.add(path, error.found, f"{error.expected}, or an expression", error.advice)
        return None


def read_expression(text: str, path: str, setting: Setting) -> Expression | None:
    """An expression whose names are the variables and the scene's parameters."""
    try:
        return parse(text, setting.names)
    except ExpressionError as error:
        setting.faults.append(Fault(path, error.found, error.expected, error.advice or _advice(text)))
        return None


def _advice(text: str) -> str:
    """What to do about the commonest slips."""
    if nearest(text.strip().lower(), ["balance"]):
        return "only the drive's torque, or a parameter that an expression uses, can be the balance"
    if re.search(r"\d\s*[^\W\d_]", text):
        return "numbers in an expression are SI, without units"
    return ""


def read_position(value: object, path: str, setting: Setting) -> Expression | None:
    """The position of a law's output: an expression of phi and of parameters that have a value."""
    if not isinstance(value, str):
        setting.faults.add(path, show(value), "an expression of phi, or a table")
        return None
    parts = split_quantity(value)
    if parts is not None and re.match(r"[^\W\d_]|[%°]", parts[1]) and not _WORDS.search(parts[1]):
        setting.faults.add(path, show(value), "an expression of phi, or a table", "its numbers are SI, without units")
        return None
    expression = read_expression(value, path, setting)
    if expression is None:
        return None
    if foreign := sorted(expression.names & {"x", "v", "omega", "t"}):
        setting.faults.add(path, f"an expression of {', '.join(foreign)}", "one of phi and parameters")
        return None
    if unknown := sorted(expression.names - {"phi", *setting.parameters}):
        advice = "a balance makes up for loads; it cannot change the geometry"
        setting.faults.add(path, f"an expression of {', '.join(unknown)}", "parameters that have a value", advice)
        return None
    return expression
