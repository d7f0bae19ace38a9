"""One load model on its way from the scene: its keys, its place, the ends of its port's stroke."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

from flywheel.advice import show
from flywheel.faults import SceneError
from flywheel.formulas.expressions import Expression
from flywheel.mechanisms.ends import Ends, ends_of
from flywheel.reading.fields import Faults, Fields, exactly_one, expectation, read_quantity
from flywheel.reading.places import Place, Places, Setting
from flywheel.reading.schema import Key
from flywheel.reading.schema_load import LOAD_MODELS
from flywheel.scene import Mechanism, Table


class Site(NamedTuple):
    """Where a model acts, and when: its place, its load's window and period (rad), None where always, or not known."""

    place: Place
    places: Places
    window: tuple[float, float] | None
    every: float | None
    setting: Setting

    @property
    def on_shaft(self) -> bool:
        """Whether it sits on a shaft, not on a mechanism's port."""
        return self.place.name in self.places.shafts

    @property
    def variable(self) -> str:
        """The name of its speed in expressions."""
        return "omega" if self.on_shaft else "v"


class Modelled(NamedTuple):
    """The law that a model comes to, and what it is in words; the area (m²) on which a gas presses, if it is one."""

    law: Expression | Table
    text: str
    piston: float | None = None


class Item(NamedTuple):
    """One model's table on its way."""

    raw: Mapping[str, Any]
    fields: Fields
    kind: str
    path: str
    site: Site

    @property
    def faults(self) -> Faults:
        """The scene's faults so far."""
        return self.site.setting.faults

    def add(self, key: str, found: str, expected: str, advice: str = "") -> None:
        """Note a fault of one key."""
        self.faults.add(f"{self.path}.{key}", found, expected, advice)

    def given(self, names: Iterable[str]) -> list[str]:
        """Those of some keys that the scene gives."""
        return [name for name in names if name in self.raw]

    def one(self, *names: str) -> str | None:
        """The one of some keys that the scene gives; None after noting that there is none, or more."""
        found = self.given(names)
        return found[0] if exactly_one(found, names, self.path, self.faults) else None

    def without(self, names: Iterable[str], because: str, advice: str = "") -> None:
        """Note those of some keys that make no sense here."""
        for name in self.given(names):
            self.add(name, f"{name} {because}", "none", advice)

    def needs(self, name: str, because: str) -> None:
        """Note a key that is not there."""
        if name not in self.raw:
            self.add(name, "nothing", expectation(key_of(self.kind, name)), because)

    def by_place(self, name: str) -> float:
        """A quantity whose dimension depends on whether the place translates or rotates; NaN after noting a fault."""
        key = key_of(self.kind, name)
        if name not in self.raw:
            return float(key.default or 0.0)
        dimension = key.kind.split(" | ")[self.site.place.rotating]
        value = read_quantity(self.raw[name], dimension, key, f"{self.path}.{name}", self.faults)
        return math.nan if value is None else value

    def flag(self, name: str) -> bool:
        """Whether a key is true."""
        value = self.raw.get(name, False)
        if not isinstance(value, bool):
            self.add(name, show(value), "true or false")
        return value is True

    def number(self, name: str) -> float:
        """A value that was read already; NaN where it had a fault, or is missing."""
        value = self.fields[name]
        return math.nan if value is None else float(value)


def key_of(kind: str, name: str) -> Key:
    """One key of a model."""
    return next(key for key in LOAD_MODELS[kind].keys if key.name == name)


Made = Callable[[], Modelled | None]
"""What makes the law of a model: readers check its keys, and give this to be called where there is no fault."""


def ends_of_port(item: Item) -> Ends | None:
    """The ends of the stroke of the port that a model acts on; None after noting that it has none.

    A mechanism that cannot be built, or has a parameter at fault, has been noted by its own reading.
    """
    place, setting = item.site.place, item.site.setting
    name, _, port = place.name.rpartition(".")
    if not place.returns:
        item.faults.add(item.path, f'a {item.kind} on "{place.name}", which does not come back', "a port with a stroke")
        return None
    mechanism: Mechanism | None = next((m for m in item.site.places.mechanisms if m.name == name), None)
    if mechanism is None or any(map(math.isnan, setting.parameters.values())):
        return None
    try:
        return ends_of(mechanism, port, setting.parameters)
    except SceneError as error:
        setting.faults.extend(fault for fault in error.faults if fault not in setting.faults)
    except ArithmeticError:
        pass
    return None
