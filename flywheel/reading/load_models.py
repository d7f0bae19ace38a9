"""Loads of machines of known kinds: `[[load]] model = {type = ..., ...}`, compiled to an expression or a table."""

from __future__ import annotations

from collections.abc import Callable

from flywheel.reading import model_gas, model_presses, model_resistance
from flywheel.reading.fields import Faults, read_typed
from flywheel.reading.model_items import Item, Made, Modelled, Site
from flywheel.reading.schema_load import LOAD_MODELS, TYPE

__all__ = ["Modelled", "Site", "read_model"]


def read_model(raw: object, path: str, site: Site) -> Modelled | None:
    """The law of a load's model; None after noting faults."""
    faults = site.setting.faults
    before = len(faults)
    typed = read_typed(raw, TYPE, LOAD_MODELS, path, faults)
    if typed is None:
        return None
    kind, table, fields = typed
    read = _READERS[kind](Item(table, fields, kind, path, site))
    return read() if len(faults) == before and read is not None else None


def check_keys(raw: object, path: str, faults: Faults) -> None:
    """Note what is wrong with a model's own keys, where its place is not known."""
    read_typed(raw, TYPE, LOAD_MODELS, path, faults)


_READERS: dict[str, Callable[[Item], Made | None]] = {
    "constant": model_resistance.constant,
    "fan": model_resistance.fan,
    "pump": model_resistance.fan,
    "losses": model_resistance.losses,
    "belt": model_resistance.belt,
    "press": model_presses.press,
    "punch": model_presses.press,
    "indicator": model_gas.indicator,
    "compressor": model_gas.compressor,
}
