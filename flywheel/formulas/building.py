"""Expressions built from numbers: numbers as texts, templates, and trees that would be too long to write out."""

from __future__ import annotations

from collections.abc import Sequence

from flywheel.formulas.expressions import Expression, parse
from flywheel.formulas.trees import Node


def written(value: float) -> str:
    """A number as an expression holds it, to the last digit; a negative one in brackets.

    >>> written(0.1), written(-2)
    ('0.1', '(-2.0)')
    """
    text = repr(float(value))
    return f"({text})" if text.startswith("-") else text


def compiled(template: str, **numbers: float) -> Expression:
    """The expression that a template becomes when its names in braces are replaced by numbers, to the last bit.

    >>> compiled("-{k}*omega*abs(omega)", k=0.1).text
    '-0.1*omega*abs(omega)'
    """
    return parse(template.format(**{name: written(number) for name, number in numbers.items()}))


def numeral(value: float) -> Node:
    """A number as a tree."""
    return Node("number", number=float(value))


def variable(name: str) -> Node:
    """A variable as a tree."""
    return Node("name", name=name)


def between(of: Node, knots: Sequence[float], leaves: Sequence[Node]) -> Node:
    """The leaf between whose knots a variable lies, found by halves; there is one leaf more than knots.

    >>> import numpy as np
    >>> law = Expression("steps", between(variable("x"), [1.0, 2.0], [numeral(10), numeral(20), numeral(30)]))
    >>> [law.evaluate({"x": x}, np) for x in (0.0, 1.0, 5.0)]
    [10.0, 20.0, 30.0]
    """
    if not knots:
        return leaves[0]
    middle = len(knots) // 2
    test = Node("compare", (of, numeral(knots[middle])), signs=("<",))
    below = between(of, knots[:middle], leaves[: middle + 1])
    return Node("if", (test, below, between(of, knots[middle + 1 :], leaves[middle + 1 :])))
