"""The units of what an expression holds: of the expression from those of its names, of one name from the expression's.

Numbers are taken as numbers, without units of their own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import reduce
from operator import mul

from flywheel.formulas import trees
from flywheel.formulas.trees import Node
from flywheel.units import DIMENSIONS, Unit

_ONE = Unit()
_KEEPING = frozenset({"neg", "abs", "sum", "min", "max"})  # have the unit of what they are made of


def unit_of(node: Node, units: Mapping[str, Unit]) -> Unit | None:
    """The unit of an expression; None where names of unknown units, or sums of different ones, leave it open.

    >>> from flywheel.formulas.expressions import parse
    >>> from flywheel.units import parse_unit
    >>> shown(unit_of(parse("2*v**2/x").tree, {"v": parse_unit("m/s", None), "x": parse_unit("m", None)}))
    'm/s^2'
    """
    if node.op == "name":
        return units.get(node.name)
    if node.op in _KEEPING or node.op == "if":
        found = {unit_of(arg, units) for arg in (node.args[1:] if node.op == "if" else node.args)}
        return found.pop() if len(found) == 1 else None
    if node.op == "product":
        return _product([_powered(unit_of(arg, units), s) for arg, s in zip(node.args, node.signs, strict=True)])
    if node.op == "**":
        base, exponent = unit_of(node.args[0], units), node.args[1]
        if base == _ONE:
            return _ONE
        whole = exponent.op == "number" and exponent.number == int(exponent.number)
        return base ** int(exponent.number) if base is not None and whole else None
    return _ONE if node.op != "sqrt" or unit_of(node.args[0], units) == _ONE else None


def units_of_name(node: Node, name: str, unit: Unit, units: Mapping[str, Unit]) -> Iterator[Unit | None]:
    """The unit of a name everywhere in an expression that has a unit itself; None where that is left open.

    >>> from flywheel.formulas.expressions import parse
    >>> from flywheel.units import parse_unit
    >>> law, speed = parse("-k*omega", frozenset({"k"})).tree, {"omega": parse_unit("rad/s", None)}
    >>> [shown(found) for found in units_of_name(law, "k", parse_unit("N m", None), speed)]
    ['N m s/rad']
    """
    if node.op == "name" and node.name == name:
        yield unit
    elif node.op in _KEEPING or node.op == "if":
        for arg in node.args[1:] if node.op == "if" else node.args:
            yield from units_of_name(arg, name, unit, units)
    elif node.op == "product":
        for k, arg in enumerate(node.args):
            if trees.depends(arg, name):
                rest = zip((*node.args[:k], *node.args[k + 1 :]), (*node.signs[:k], *node.signs[k + 1 :]), strict=True)
                others = _product([_powered(unit_of(other, units), sign) for other, sign in rest])
                if others is None or node.signs[k] == "/":
                    yield None
                else:
                    yield from units_of_name(arg, name, unit * others**-1, units)
    elif trees.depends(node, name):
        yield None


def shown(unit: Unit | None) -> str | None:
    """A unit in SI as text: by its usual name, else by powers of N (or kg), m, s, A and rad."""
    if unit is None:
        return None
    for dimension in DIMENSIONS.values():
        if unit.powers == dimension.powers and unit.angle == dimension.angles[-1]:
            return dimension.si or "1"
    length, mass, time, angle, current = unit[2:]
    force = max(mass, 0)
    powers = {"N": force, "kg": mass - force, "m": length - force, "s": time + 2 * force, "A": current, "rad": angle}
    over = " ".join(_power(name, power) for name, power in powers.items() if power > 0)
    under = " ".join(_power(name, -power) for name, power in powers.items() if power < 0)
    return f"{over or '1'}/{under}" if under else over


def _power(name: str, power: int) -> str:
    return name if power == 1 else f"{name}^{power}"


def _powered(unit: Unit | None, sign: str) -> Unit | None:
    return unit**-1 if unit is not None and sign == "/" else unit


def _product(found: list[Unit | None]) -> Unit | None:
    known = [unit for unit in found if unit is not None]
    return reduce(mul, known, _ONE) if len(known) == len(found) else None
