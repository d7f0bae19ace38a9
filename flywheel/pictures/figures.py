"""What all pictures share: colours, one way to make a figure and one to write it, the same every time.

Figures are objects of their own: no global state is touched, nothing is shown. Colours are those of Okabe and Ito, which
the colour-blind can tell apart.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from bondgraph.storage.files import replacement
from flywheel.numerics.units import figure as number

BLACK, GREY, PALE = "#000000", "#6E6E6E", "#DDDDDD"
BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"
BODIES = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, "#8C6D31", "#999999")
FORMATS: dict[str, dict[str, Any]] = {"png": {}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}
STYLE: Any = {"font.size": 10.0, "axes.titlesize": 11.5, "svg.hashsalt": "flywheel", "pdf.fonttype": 42}
DPI = 125


def figure(width: float, height: float, title: str, apart: float = 0.08) -> Figure:
    """An empty figure (inches), laid out so that nothing overlaps; panels stand `apart` (inches, on each side)."""
    made = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(made)
    made.get_layout_engine().set(w_pad=apart, h_pad=apart)  # type: ignore[union-attr, call-arg]
    if title:
        made.suptitle(title, fontsize=13, parse_math=False)
    return made


def save(made: Figure, path: str | Path) -> None:
    """Write a figure as PNG, SVG or PDF, as the path ends; ValueError for any other ending, OSError where it cannot be."""
    import warnings

    kind = Path(path).suffix.lower().lstrip(".")
    if kind not in FORMATS:
        raise ValueError(f"found {str(path)!r}, expected a file name ending in .png, .svg or .pdf")
    with replacement(path, kind) as fresh, rc_context(STYLE), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing")  # of a title; the picture has a box there
        made.savefig(fresh, format=kind, dpi=DPI, metadata=FORMATS[kind])


def name_axes(panel: Axes, title: str, xlabel: str, ylabel: str) -> None:
    """Title, labels and a faint grid."""
    panel.set_title(title, parse_math=False)
    panel.set_xlabel(xlabel)
    panel.set_ylabel(ylabel)
    panel.grid(color=PALE, linewidth=0.6)
    panel.set_axisbelow(True)


def shade(colour: str, light: float) -> tuple[float, float, float]:
    """A colour mixed with white (light > 0) or with black (light < 0), by that share.

    >>> shade("#0000FF", 0.5), shade("#0000FF", -0.5)
    ((0.5, 0.5, 1.0), (0.0, 0.0, 0.5))
    """
    red, green, blue = (int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))
    end, share = (1.0, light) if light > 0 else (0.0, -light)
    return tuple(part + share * (end - part) for part in (red, green, blue))  # type: ignore[return-value]


def told(value: float, most: int = 5, error: float = 0.0) -> str:
    """A number with a true minus sign."""
    return number(value, error, most).replace("-", "−")


def say(panel: Axes, title: str, why: str) -> None:
    """A panel that has nothing to draw says why."""
    panel.set_title(title)
    panel.set_axis_off()
    panel.text(0.5, 0.5, why, ha="center", va="center", transform=panel.transAxes, fontsize=11, color=GREY)
