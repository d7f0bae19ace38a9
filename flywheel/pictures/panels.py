"""What the panels of a sizing share: numbers, a legend with room above the curves, a band of speeds."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from flywheel.pictures.figures import GREY
from flywheel.results import Sizing
from flywheel.writing.digits import figure as number

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

RPM = 30 / np.pi
_WIDE = 350.0  # points that a legend may be wide


def told(value: float, most: int = 5, error: float = 0.0) -> str:
    """A number with a true minus sign."""
    return number(value, error, most).replace("-", "−")


def legend(panel: Axes) -> None:
    """The legend along the top, in as many columns as fit, with room made for it above the curves."""
    handles, labels = panel.get_legend_handles_labels()
    widest = next(n for n in range(len(labels), 0, -1) if n == 1 or _legend_width(labels, n) <= _WIDE)
    rows = -(-len(labels) // widest)
    ncols = -(-len(labels) // rows)  # as few columns as these rows need
    low, high = panel.get_ylim()
    panel.set_ylim(low, high + (high - low) * (0.04 + 0.065 * rows))
    style: dict[str, Any] = {"fontsize": 8.5, "handlelength": 1.7, "columnspacing": 1.2, "framealpha": 1.0}
    panel.legend(handles, labels, loc="upper center", ncols=ncols, borderaxespad=0.4, **style)


def _legend_width(labels: list[str], ncols: int) -> float:
    """About how wide (points) a legend becomes: filled column by column, the first ones with one more if need be."""
    chunks = np.array_split(np.array([len(label) for label in labels]), ncols)
    return sum(4.6 * float(chunk.max()) + 28.0 for chunk in chunks)


def say(panel: Axes, title: str, why: str) -> None:
    """A panel that has nothing to draw says why."""
    panel.set_title(title)
    panel.set_axis_off()
    panel.text(0.5, 0.5, why, ha="center", va="center", transform=panel.transAxes, fontsize=11, color=GREY)


def origin_of(mean: float, traces: list[tuple[str, str, Array]]) -> float:
    """The mean, taken off where the fluctuation is too small for tick labels that count from zero."""
    swing = max((float(np.ptp(values)) for _, _, values in traces), default=0.0)
    return mean if swing < 2e-3 * mean else 0.0


def speed_label(sizing: Sizing, origin: float) -> str:
    """The label of an axis of speeds (rpm), from an origin on."""
    return f"crank speed − {told(sizing.speed * RPM, 6)} rpm, rpm" if origin else "crank speed, rpm"


def band(panel: Axes, sizing: Sizing, origin: float) -> None:
    """The band of speeds (rpm) that was asked for, and the mean of extremes."""
    eps, mean = sizing.scene.irregularity, sizing.speed * RPM
    if eps is not None:
        low, high = mean * (1 - eps / 2) - origin, mean * (1 + eps / 2) - origin
        panel.axhspan(low, high, color="#E4E4E4", zorder=0.5, label=f"band asked, ±{number(50 * eps, 0.0, 4)} %")
    panel.axhline(mean - origin, color=GREY, lw=0.9, ls="-.")
