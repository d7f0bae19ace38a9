"""The panels for a diagram of areas, which has no machine and no angles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from flywheel.pictures import curves
from flywheel.pictures.figures import BLACK, BLUE, ORANGE, SKY, VERMILLION, name_axes
from flywheel.pictures.panels import RPM, band, legend, origin_of, say, speed_label, told
from flywheel.results import Sizing
from flywheel.writing import outcome

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]


def draw(axes: NDArray[Any], sizing: Sizing) -> None:
    """Bars of the areas, their sums, and the speed at the crossings, in four panels."""
    works = np.array([area.work for area in sizing.areas])
    sums = np.array([0.0, *(area.accumulated for area in sizing.areas)])
    _area_bars(axes[0], works)
    _sums(axes[1], sizing, sums)
    why = "The loop needs the reduced inertia of a machine.\nA diagram of areas gives none, and counts all as flywheel."
    say(axes[2], "Wittenbauer's loop", why)
    _crossing_speeds(axes[3], sizing, sums)


def _area_bars(panel: Axes, works: Array) -> None:
    name_axes(panel, "Areas of the turning moment (angles not given)", "area", "work, J")
    places = np.arange(1, works.size + 1)
    for side, colour, label in ((1, SKY, "speeds up"), (-1, ORANGE, "slows down")):
        mine = side * works > 0
        if mine.any():
            panel.bar(places[mine], works[mine], color=colour, edgecolor=BLACK, lw=0.6, label=label)
    panel.axhline(0.0, color=BLACK, lw=0.8)
    panel.set_xticks(_spread(places), [f"A{k}" for k in _spread(places)])
    if works.any():
        legend(panel)


def _spread(places: NDArray[np.intp]) -> list[int]:
    """At most two dozen of the places, for ticks."""
    return [int(k) for k in places[:: -(-places.size // 24)]]


def _sums(panel: Axes, sizing: Sizing, sums: Array) -> None:
    name_axes(panel, "Accumulated areas", "crossing", "sum, J")
    places = np.arange(sums.size)
    panel.plot(places, sums, "o-", color=BLACK, lw=1.2, ms=4)
    for colour, marker, value, name in (
        (BLUE, "^", sizing.accumulated_max, "greatest"),
        (VERMILLION, "v", sizing.accumulated_min, "least"),
    ):
        at = int(np.abs(sums - value).argmin())
        label = f"{name}: S{at} = {told(value, 5, outcome.work_error(sizing))} J"
        panel.plot(at, value, marker, color=colour, ms=9, label=label)
        panel.axhline(value, color=colour, lw=0.9, ls=":")
    panel.set_xticks(_spread(places), [f"S{k}" for k in _spread(places)])
    legend(panel)


def _crossing_speeds(panel: Axes, sizing: Sizing, sums: Array) -> None:
    """Speed at the crossings: between them a diagram of areas tells nothing."""
    inertia = sizing.scene.inertia or sizing.flywheel.exact or 0.0
    if inertia == 0.0:
        say(panel, "Speed of the crank", "The areas are all zero:\nthe speed never changes.")
        return
    eps = sizing.simulation.irregularity if sizing.simulation is not None else sizing.scene.irregularity or 0.0
    on_crank = inertia * sizing.scene.flywheel_ratio**2
    speeds = RPM * curves.crossing_speeds(sums, sizing.speed * (1 - eps / 2), on_crank)
    origin = origin_of(sizing.speed * RPM, [("", "", speeds)])
    name_axes(panel, "Speed of the crank at the crossings", "crossing", speed_label(sizing, origin))
    band(panel, sizing, origin)
    places = np.arange(sums.size)
    panel.plot(places, speeds - origin, "o", color=BLUE, ms=6, label=f"{told(inertia)} kg m², ε = {told(eps, 4)}")
    panel.set_xticks(_spread(places), [f"S{k}" for k in _spread(places)])
    legend(panel)
