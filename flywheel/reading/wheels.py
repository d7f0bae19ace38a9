"""The wheel in `[flywheel]`: its shape, material and known dimensions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flywheel.faults import Fault, SceneError
from flywheel.reading.fields import Faults, Fields
from flywheel.reading.schema import Key
from flywheel.reading.schema_wheel import MATERIAL_KEYS, WHEEL_KEYS
from flywheel.wheel.asked import EXACT, GREATEST, SHAPES, WheelAsked, asked_faults
from flywheel.wheel.materials import Material, material

PATH = "flywheel"
_ARGUMENTS = {"material": "name", "allowable_stress": "allowable"}
_OTHERS = tuple(key for key in WHEEL_KEYS if key not in MATERIAL_KEYS)


def read_wheel(table: Mapping[str, Any], fields: Fields, faults: Faults) -> WheelAsked | None:
    """The wheel that is asked for; None where none is, or after noting faults.

    Args:
        table: `[flywheel]` as written.
        fields: its values, those of `WHEEL_KEYS` among them.
        faults: where to note what is wrong.

    """
    written = [key for key in WHEEL_KEYS if key.name in table]
    if not written:
        return None
    if any(fields[key.name] is None for key in written) or table.keys() - fields.keys():  # noted already
        return None
    if fields["shape"] is None:
        expected = f"a shape ({', '.join(SHAPES)}) beside {written[0].name}"
        faults.add(f"{PATH}.shape", "nothing", expected)
        return None
    found = _material(fields, faults)
    return None if found is None else _asked(fields, found, faults)


def _material(fields: Fields, faults: Faults) -> Material | None:
    """The material, from the table or of own values."""
    try:
        return material(**_values(MATERIAL_KEYS, fields))
    except SceneError as error:
        faults.extend(_at_home(fault) for fault in error.faults)
        return None


def _asked(fields: Fields, found: Material, faults: Faults) -> WheelAsked | None:
    """The wheel, if its dimensions go together."""
    given = {"method": EXACT, "at": GREATEST} | _values(_OTHERS, fields)
    asked = WheelAsked(material=found, path=PATH, **given)
    wrong = asked_faults(asked)
    faults.extend(wrong)
    return None if wrong else asked


def _values(keys: tuple[Key, ...], fields: Fields) -> dict[str, Any]:
    """What is given of some keys, by the names of the arguments that take it."""
    return {_ARGUMENTS.get(key.name, key.name): fields[key.name] for key in keys if fields[key.name] is not None}


def _at_home(fault: Fault) -> Fault:
    """A fault of the material's, at the path of its key."""
    return fault._replace(path=f"{PATH}.{fault.path}")
