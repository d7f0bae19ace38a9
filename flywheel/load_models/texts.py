"""Formulas with numbers put in, as checked expressions."""

from __future__ import annotations

from flywheel.formulas.expressions import Expression, parse


def compiled(template: str, **numbers: float) -> Expression:
    """The expression that a template becomes when its names in braces are replaced by numbers, to the last bit.

    >>> compiled("-{k}*omega*abs(omega)", k=0.1).text
    '-0.1*omega*abs(omega)'
    """
    return parse(template.format(**{name: _written(number) for name, number in numbers.items()}))


def _written(number: float) -> str:
    text = repr(float(number))
    return f"({text})" if text.startswith("-") else text
