"""The flywheel of a sizing, and those that do the same on the machine's other shafts."""

from __future__ import annotations

from typing import TYPE_CHECKING

from flywheel.every_shaft import OnShaft, on_every_shaft

if TYPE_CHECKING:
    from flywheel.results import Sizing
    from flywheel.wheel.result import Wheel


def compared(sizing: Sizing) -> tuple[OnShaft, ...]:
    """The flywheel given or sized on every shaft, at the mean of extremes of its speed.

    Where a wheel is built, it counts as built, rounded up or not. The others are that wheel made as wide as they need to be:
    at its radii mass and inertia grow with the width alike. Their rims run at the speed that the built wheel was chosen for,
    as the shafts are geared.
    """
    scene = sizing.scene
    inertia = sizing.inertia if sizing.built is None else sizing.built.wheel.inertia
    if inertia is None:
        return ()
    rows = on_every_shaft(inertia, scene.shafts, sizing.speed, on=scene.flywheel_on)
    if sizing.built is None:
        return rows
    return tuple(_as_wheel(row, sizing.built.wheel, row.ratio / scene.flywheel_ratio) for row in rows)


def _as_wheel(row: OnShaft, wheel: Wheel, faster: float) -> OnShaft:
    """The row with the wheel made wider or narrower; `faster` is its speed over that of the wheel as built."""
    mass = wheel.mass * row.inertia / wheel.inertia
    return row._replace(radius=wheel.body.running, mass=mass, rim_speed=wheel.rim_speed * faster)
