"""From a mechanism's record to positions and influence coefficients, a file for each family.

Uses `scene` and the folders below it. A family is one file, with its tables, ports, formulas, locks and joints in a `Kind`
(`flywheel.mechanisms.families`), and one line of `KINDS`; `register` adds a family from outside the package.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flywheel.mechanisms.families import Kind

__all__ = ["KINDS", "Kinds", "register"]


class Kinds(Mapping[str, "Kind"]):
    """Families of mechanisms by the `type` in scenes; a file of this package is imported when its family is needed."""

    def __init__(self, homes: Mapping[str, str]) -> None:
        self.homes: dict[str, str | Kind] = dict(homes)

    def __getitem__(self, name: str) -> Kind:
        home = self.homes[name]
        if isinstance(home, str):
            self.homes[name] = home = import_module(f"flywheel.mechanisms.{home}").KIND
        return home

    def __iter__(self) -> Iterator[str]:
        return iter(self.homes)

    def __len__(self) -> int:
        return len(self.homes)


KINDS = Kinds(
    {
        "scotch-yoke": "scotch_yoke",
        "slider-crank": "slider_crank",
        "four-bar": "four_bar",
        "crank-shaper": "crank_shaper",
        "toggle-clamp": "toggle_clamp",
        "law": "law",
        "linkage": "linkage",
    }
)


def register(kind: Kind) -> None:
    """Registers a family of mechanisms for scenes, reference texts, sizing, reactions and pictures of this process.

    Raises ValueError if another family has its name.
    """
    if kind.name in KINDS and KINDS[kind.name] is not kind:
        raise ValueError(f"there is a family of mechanisms called {kind.name!r} already")
    KINDS.homes[kind.name] = kind
