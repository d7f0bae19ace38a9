"""The numbers of a scene by their paths (`mechanism.crank.length`, `load.0.from`), and the scene with other numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any, NamedTuple

from flywheel.numerics.expressions import unit_text
from flywheel.numerics.faults import Fault, SceneError, refuse, show, suggestion
from flywheel.numerics.units import (
    DIMENSIONS,
    QuantityError,
    parse_quantity,
    parse_unit,
    plain_number,
    split_quantity,
)
from flywheel.scene.scene import Scene, SceneSource

_NO_NUMBERS = ("title", "source", "name", "file", "column")
_LAWS = ("force", "torque", "x", "theta", "lift")
_INDEX = re.compile(r"\[(\d+)\]")
_MOST_NUMBERS = 10_000  # of numbers: longer tables are not searched for a path


class Number(NamedTuple):
    """A number of a scene: its value in SI and the unit of that, empty if it has none; its dimension."""

    value: float
    unit: str
    dimension: str = "number"


def dotted(path: str) -> str:
    """A path with indices in arrays between dots, which faults write in brackets.

    >>> dotted("load[0].from")
    'load.0.from'
    """
    return _INDEX.sub(r".\1", path)


def by_path(pairs: Mapping[str, Any]) -> dict[str, Any]:
    """Given values under the paths that `numbers` uses; SceneError where a path is given in two spellings.

    >>> by_path({"load[0].from": 1.0, "regime.speed": 2.0})
    {'load.0.from': 1.0, 'regime.speed': 2.0}
    """
    values = {dotted(str(path)): value for path, value in pairs.items()}
    if len(values) < len(pairs):
        names = [dotted(str(path)) for path in pairs]
        refuse([Fault(path, "two values", "one") for path in values if names.count(path) > 1])
    return values


def numbers(scene: Scene) -> dict[str, Number]:
    """Every number that a scene gives, by its path, also those written as a text with a unit; expressions do not count.

    Args:
        scene: one that was read.

    Raises:
        SceneError: for a scene made by `dataclasses.replace`, which has no text.

    >>> import flywheel
    >>> scene = flywheel.load({"load": [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}],
    ...                        "drive": {"torque": "balance"}, "regime": {"speed": "300 rpm"},
    ...                        "flywheel": {"irregularity": "1 %"}})
    >>> for path, number in list(numbers(scene).items())[:4]:
    ...     print(path, round(number.value, 6), number.unit)
    load.0.torque -100.0 N m
    load.0.from 0.0 rad
    load.0.to 3.141593 rad
    regime.speed 31.415927 rad/s

    """
    document = _document(scene)
    read = {dotted(path): quantity for path, quantity in document.quantities.items()}
    numbers: dict[str, Number] = {}
    for path, leaf in _leaves(document.tables, ""):
        quantity, alone = read.get(path), plain_number(leaf)
        if quantity is not None:
            unit = DIMENSIONS[quantity.dimension].si
            if path.startswith("parameters."):
                unit = unit_text(scene.units.get(path.removeprefix("parameters."))) or ""
            numbers[path] = Number(quantity.number, unit, quantity.dimension)
        elif alone is not None:
            numbers[path] = Number(alone, "")
        if len(numbers) == _MOST_NUMBERS:
            break
    return numbers


def with_numbers(scene: Scene, values: Mapping[str, float]) -> Scene:
    """The scene with other numbers (SI) in their places, read and checked as a whole again.

    Args:
        scene: one that was read.
        values: numbers by their paths; also of keys that the scene leaves to their defaults.

    Raises:
        SceneError: with every fault of the changed scene.

    >>> import flywheel
    >>> scene = flywheel.load({"areas": {"values": [100, -100], "scale": "1 J"}, "regime": {"speed": "60 rpm"},
    ...                        "flywheel": {"irregularity": "2 %"}})
    >>> with_numbers(scene, {"flywheel.irregularity": 0.04}).irregularity
    0.04

    """
    quantities = _document(scene).quantities
    units = {dotted(path): _unit(scene, path, quantity) for path, quantity in quantities.items() if dotted(path) in values}
    return scene.with_({path: _written(value, units.get(path, "")) for path, value in values.items()})


def path_faults(scene: Scene, columns: Mapping[str, Any]) -> list[Fault]:
    """Faults of paths that take the numbers of columns: each must lead to a number of the scene.

    A key that the scene leaves to its default counts if the first, the middle or the last number of its column can be read
    there.
    """
    document, all_numbers, faults = _document(scene), numbers(scene), []
    leaves = dict(_leaves(document.tables, ""))
    for path, column in columns.items():
        if path in all_numbers:
            continue
        if path in leaves:
            expression = path.rpartition(".")[2] in _LAWS and leaves[path] != "balance"
            advice = "vary a parameter that it holds" if expression else ""
            faults.append(Fault(path, show(leaves[path]), "a number", advice))
            continue
        if below := [name for name in leaves if name.startswith(f"{path}.")]:
            inside = [name for name in all_numbers if name in below]
            faults.append(Fault(path, "a table", "a number", suggestion(path, inside)))
            continue
        tried = [_trial(scene, path, column[k]) for k in sorted({0, len(column) // 2, len(column) - 1}) if len(column)]
        if any(error is None for error in tried):
            continue
        own = [fault for error in tried if error is not None for fault in error.faults]
        if _beyond(document.tables, path) or any(fault.expected.startswith("a known") for fault in own):
            faults.append(Fault(path, "no number of the scene", "the path of one", suggestion(path, all_numbers)))
        else:
            faults.append(own[0])
    return faults


def _beyond(value: Any, path: str) -> bool:
    """Tests whether a path leads past the end of an array."""
    for key in path.split("."):
        if isinstance(value, (list, tuple)):
            if not (key.isdecimal() and int(key) < len(value)):
                return True
            value = value[int(key)]
        elif isinstance(value, Mapping):
            value = value.get(key)
    return False


def _trial(scene: Scene, path: str, value: float) -> SceneError | None:
    try:
        with_numbers(scene, {path: value})
    except SceneError as error:
        return error
    return None


def _document(scene: Scene) -> SceneSource:
    if scene.document is None:
        advice = "change the scene that it was made from"
        raise SceneError([Fault("scene", "one made by dataclasses.replace", "one that was read", advice)])
    return scene.document


def _leaves(value: Any, path: str) -> Iterator[tuple[str, Any]]:
    """Values in tables and lists by their paths; names, files and their columns are passed over."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            if key not in _NO_NUMBERS or isinstance(inner, Mapping):
                yield from _leaves(inner, f"{path}.{key}" if path else str(key))
    elif isinstance(value, (list, tuple)):
        for i, inner in enumerate(value):
            yield from _leaves(inner, f"{path}.{i}")
    else:
        yield path, value


def _unit(scene: Scene, path: str, quantity: Any) -> str:
    """The unit with which a number is written: where a bare number would be refused, or change its meaning."""
    if path.startswith("parameters."):
        return unit_text(scene.units.get(path.removeprefix("parameters."))) or ""
    return "rad" if quantity.dimension == "angle" else ""


def _written(value: float, unit: str) -> float | str:
    number = float(value)
    return f"{number!r} {unit}" if unit and math.isfinite(number) else number


def parsed(scene: Scene, path: str, text: str) -> float:
    """A value (SI) for a number of the scene, from a text: a quantity of its dimension, or a bare number in SI.

    Raises:
        QuantityError: for anything else, such as a unit of another dimension.

    >>> import flywheel
    >>> parsed(flywheel.load({"regime": {"speed": 6}, "flywheel": {"inertia": 2}}), "regime.speed", "60 rpm") == math.tau
    True

    """
    number, alone = numbers(scene).get(path), _bare(text)
    if path.startswith("parameters."):
        value, parts = parse_quantity(text, None), split_quantity(text)
        unit = scene.units.get(path.removeprefix("parameters."))
        if parts is not None and parts[1] and unit is not None and parse_unit(parts[1], None).powers != unit.powers:
            raise QuantityError(
                show(text), f"a quantity in {unit_text(unit)}, as the parameter is one, or a bare number in SI"
            )
        return value
    dimension = number.dimension if number is not None else _dimension_of_default(scene, path, text)
    if alone is not None and dimension == "angle" and abs(alone) > 2 * math.pi:
        raise QuantityError(show(text), "an angle with its unit, or a bare number in rad of at most one turn")
    if alone is None:
        return parse_quantity(text, dimension)
    return parse_quantity(alone, dimension)


def _bare(text: str) -> float | None:
    """The number of a text without a unit."""
    try:
        return float(text)
    except ValueError:
        return None


def _dimension_of_default(scene: Scene, path: str, text: str) -> str | None:
    """The dimension of a number that a scene leaves to its default, if one can be read there; else None."""
    for value in (text, 0.0, 0.5, 5.0):
        with suppress(SceneError):
            read = {dotted(name): each for name, each in _document(scene.with_({path: value})).quantities.items()}
            return read[path].dimension if path in read else None
    return None
