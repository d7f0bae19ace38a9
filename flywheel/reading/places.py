"""The setting that a scene's parts share, and the places where something can act: shafts and ports."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from flywheel.advice import mean, quote
from flywheel.reading.fields import Faults
from flywheel.scene import Mechanism, Stroke

TOLERANCE = 1e-9


class Setting(NamedTuple):
    """What the parts of a scene are read against.

    `cycle` is None while its own reading failed. `names` are the parameters that expressions may use, the unknown
    included; `parameters` holds those that have a value. `stroke` is set where the driver goes one way; its numbers are
    NaN, and `cycle` is None, where they could not be read.
    """

    cycle: float | None
    shafts: dict[str, float]
    parameters: Mapping[str, float]
    names: frozenset[str]
    folder: Path | None
    faults: Faults
    stroke: Stroke | None = None

    @property
    def element(self) -> str:
        """The reduction element."""
        return "crank" if self.stroke is None else self.stroke.element

    @property
    def sliding(self) -> bool:
        """Whether the reduction element slides."""
        return self.element == "slide"


class Place(NamedTuple):
    """A shaft or a port, by its canonical name; `travel` (rad) of the angle that its loads see, in a cycle.

    `travel` is None while it is not known; `returns` is False where the displacement gains a constant.
    """

    name: str
    rotating: bool
    travel: float | None
    returns: bool


class Places(NamedTuple):
    """Every place of a machine. `complete` is False where a faulty mechanism hides some of its ports."""

    shafts: dict[str, Place]
    ports: dict[str, Place]
    complete: bool = True
    mechanisms: tuple[Mechanism, ...] = ()

    def find(self, name: object, path: str, faults: Faults) -> Place | None:
        """The place that a text names: a shaft, `mechanism.port`, or a port's bare name where it is unique."""
        if not isinstance(name, str):
            return None
        bare = [port for port in self.ports.values() if port.name.rpartition(".")[2] == name]
        found = [table[name] for table in (self.shafts, self.ports) if name in table] + bare
        if len(found) == 1:
            return found[0]
        if found:
            names = " or ".join(quote(place.name) for place in found)
            faults.add(path, f"{quote(name)}, which may be {names}", "a place that is unique", "write the full name")
        elif self.complete:
            known = [*self.shafts, *self.ports]
            short = {port.rpartition(".")[2]: port for port in self.ports}
            faults.add(path, quote(name), "a shaft or a port", mean(name, known, short))
        return None

    def shaft(self, name: object, path: str, faults: Faults) -> str:
        """The shaft that a text names; the reduction element, after noting a fault, if it names none."""
        if isinstance(name, str) and name not in self.shafts:
            faults.add(path, quote(name), "a shaft", mean(name, self.shafts))
        return name if isinstance(name, str) and name in self.shafts else next(iter(self.shafts))


def whole(count: float) -> int | None:
    """The whole number, 1 at least, that a count is within 1e-9; None if it is near none.

    >>> whole(3.0000000001), whole(2.5), whole(0.0)
    (3, None, None)
    """
    if not math.isfinite(count) or count < 0.5:
        return None
    number = round(count)
    return number if abs(count - number) <= TOLERANCE * number else None


def default_period(travel: float, cycle: float) -> float | None:
    """The angle after which a load or a law repeats unless the scene says otherwise.

    It is the cycle where that divides the travel of the angle, else the travel where that divides the cycle.
    """
    if repeats := whole(travel / cycle):
        return travel / repeats
    return travel if whole(cycle / travel) else None
