"""The duty of a scene, `[[duty]]`: its phases, and the scene that each of them makes of the machine."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from flywheel.numerics.faults import Fault, SceneError, quote, show
from flywheel.numerics.units import QuantityError, parse_quantity
from flywheel.reading.fields import Faults, Item, as_table, items, read_item
from flywheel.reading.schema import SECTIONS
from flywheel.scene.scene import Phase, Scene

MOST_PHASES = 100
STANDSTILL_COOLING = 1 / 3
"""Share by which standstill counts for the cooling of a motor whose fan sits on its shaft, unless the scene says otherwise.

Usual are 1/4 to 1/3 for motors that cool themselves.
"""
_OF_ALL = ("duty", "flywheel")
_LOSSES = "losses"


def read_duty(raw: Mapping[str, Any], faults: Faults) -> list[Item]:
    """The phases as they are written, every fault of theirs noted that does not depend on the machine."""
    duty = raw.get("duty")
    if duty is None:
        return []
    tables = items(duty)
    if tables is None or not tables:
        advice = "write [[duty]]" if isinstance(duty, Mapping) else ""
        faults.add("duty", "no phase" if tables == [] else show(duty), "an array of tables, one for each phase", advice)
        return []
    if len(tables) > MOST_PHASES:
        faults.add("duty", f"{len(tables)} phases", f"at most {MOST_PHASES}")
        return []
    for name, what in (("stroke", "a stroke has no cycle"), ("areas", "a diagram of areas has no loads")):
        if name in raw:
            faults.add("duty", f"a duty beside [{name}]", "none", what)
    if "flywheel" not in raw:
        faults.add("flywheel", "nothing, with a duty", "a table with irregularity or inertia", "of all phases together")
    found = []
    for i, each in enumerate(tables):
        table = as_table(each, f"duty[{i}]", faults)
        if table is not None:
            item = read_item(table, SECTIONS["duty"], f"duty[{i}]", faults)
            _check(item)
            found.append(item)
    names = [_name(item) for item in found]
    for i, item in enumerate(found):
        if _name(item) in names[:i]:
            item.add("name", f"{quote(_name(item))}, which is that of another phase", "a name of its own")
    if found and all(item.fields["rest"] for item in found):
        faults.add("duty", "phases at rest alone", "one at least in which the machine runs")
    return found


def _name(item: Item) -> str:
    number = item.path.removeprefix("duty[").removesuffix("]")
    return str(item.fields["name"] or f"phase {int(number) + 1}")


def _check(item: Item) -> None:
    """What does not go together in one phase."""
    if item.fields["rest"]:
        item.without(["loads", "changes", "starts"], "in a phase at rest", "the motor is off and nothing turns")
        item.without(["cycles"], "in a phase at rest", "give its duration")
        return
    item.without(["standstill_cooling"], "in a phase that runs", "it belongs to a phase with rest = true")
    starts = item.fields["starts"]
    if starts is not None and starts != int(starts):
        item.add("starts", show(item.raw["starts"]), "a whole number")
    if "changes" not in item.raw:
        return
    changes = as_table(item.raw["changes"], f"{item.path}.changes", item.faults)
    for path, _value in leaves(changes or {}):
        if path.split(".")[0] in _OF_ALL:
            item.faults.add(f"{item.path}.changes.{path}", "a change of what all phases share", "a change of the machine")


def leaves(changes: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, Any]]:
    """Values by their paths, from tables within tables as TOML reads dotted keys.

    >>> list(leaves({"load": {"0": {"force": "-2 kN"}}, "shafts.motor.ratio": 5}))
    [('load.0.force', '-2 kN'), ('shafts.motor.ratio', 5)]
    """
    for key, value in changes.items():
        name = f"{path}.{key}" if path else str(key)
        if isinstance(value, Mapping):
            yield from leaves(value, name)
        else:
            yield name, value


def phases(scene: Scene, read: list[Item], faults: Faults) -> tuple[Phase, ...]:
    """The phases of a scene that was read without a fault, each with the machine as it runs then."""
    found = []
    for item in read:
        fields, rest = item.fields, bool(item.fields["rest"])
        cooling = STANDSTILL_COOLING if fields["standstill_cooling"] is None else fields["standstill_cooling"]
        try:
            machine = None if rest else _machine(scene, item)
        except SceneError as error:
            faults.extend(_of_phase(fault, item) for fault in error.faults)
            continue
        found.append(
            Phase(
                name=_name(item),
                scene=machine,
                duration=fields["duration"],
                cycles=fields["cycles"],
                starts=int(fields["starts"] or 0),
                cooling=cooling if rest else 1.0,
                loaded=not rest and fields["loads"] != 0.0,
                path=item.path,
            )
        )
    return tuple(found)


def _of_phase(fault: Fault, item: Item) -> Fault:
    """A fault of the machine as a phase has it, at the change that makes it."""
    return fault._replace(path=f"{item.path}.changes.{fault.path}", line=None)


def _machine(scene: Scene, item: Item) -> Scene:
    """The scene of a phase: with its changes, and its loads times their share."""
    changes = dict(leaves(item.raw.get("changes", {})))
    found, share = scene.with_({**changes, "duty": None}), item.fields["loads"]
    if share is None or found.document is None:
        return found
    raw = found.document.tables.get("load", ())
    factors = {}
    for load in found.loads:
        if load.model.startswith(_LOSSES) or not load.path.startswith("load["):  # a shaft's drag is one of its bearings
            continue
        index = int(load.path.removeprefix("load[").removesuffix("]"))
        try:
            own = parse_quantity(raw[index].get("factor", 1.0), "number")
        except QuantityError:  # found wrong when it was read
            own = 1.0
        factors[f"load.{index}.factor"] = share * own
    return found.with_(factors) if factors else found
