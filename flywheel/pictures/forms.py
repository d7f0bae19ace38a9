"""The form of a diagram: figures in SI on one axis of the driver, and rows that say what is drawn of them.

A row has curves, fills, marks with their words, bands and notes. `pictures/sizing` draws rows with matplotlib,
`page/static/figures/curves.js` in the live page, each without knowing which diagram it is.

Positions of the driver ascend over the cycle or the stroke; where something jumps one stands twice, for the value before
and the one behind.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel import language
from flywheel.machine.machine import Machine
from flywheel.pictures import samples, written
from flywheel.pictures.samples import Samples
from flywheel.regime import turning_moment
from flywheel.scene.scene import Scene
from flywheel.sizing.findings import work_error
from flywheel.sizing.results import Sizing

Array = NDArray[np.float64]

FINE, RESTING, MOVING = 3001, 361, 181  # positions of the driver: of a picture, of the live page at rest and during a drag
_MOST_JUMPS = 40  # breakpoints of a machine that all get both sides; of more, those at which M* jumps
_JUMP_SIDE = 1e-10  # of the cycle: the distance from a jump at which its sides are evaluated
_JUMP = 1e-6  # of the greatest M*: the least jump
_NARROW = 0.15  # of the distance of positions: half the width of a cell whose own extremes become positions
_FORCE_ROUNDING = 1e-12  # of the largest force
_DIGITS = 5
_DEGREE_ERROR = 1e-9  # deg


class Curve(NamedTuple):
    """A line over the driver: where its values are in the diagram's figures ("traces.0.values"), its name and style."""

    of: str
    name: str
    colour: str = "ink"
    dash: str = "-"
    width: float = 1.8
    drawn: bool = True  # else it stands in the legend alone
    body: str = ""  # whose colour it has, where the mechanism is beside


class Fill(NamedTuple):
    """Area between a curve and zero, on the side above it (1) or below (-1)."""

    of: str
    side: int
    name: str
    colour: str
    hatch: str


class Mark(NamedTuple):
    """A greatest or least value, with its words and, as far as `line` says, a level to the right end."""

    kind: str  # "greatest" or "least"
    at: float
    value: float
    words: str
    colour: str
    level: bool = False


class Level(NamedTuple):
    """A band between two values, or one value where both are the same."""

    low: float
    high: float
    name: str


class Band(NamedTuple):
    """A stretch of the axis, over the whole height of a row."""

    low: float
    high: float
    name: str
    colour: str


class Row(NamedTuple):
    """One pair of axes: over the driver, or over numbered areas or crossings (`ticks`, "A" or "S")."""

    key: str
    title: str
    label: str
    unit: str  # in which values are shown
    about: str
    curves: tuple[Curve, ...]
    height: float = 3.7  # inches in a picture; in proportion on the live page
    factor: float = 1.0  # from SI
    si: str = ""  # unit of the figures, where it is another
    origin: float = 0.0  # the value from which the axis counts
    across: float = 1.0  # from SI, of an axis that is not the driver's
    zero: bool = False  # zero is within the axis
    kind: str = "curves"  # or "stack", "bars", "points", "loop", "area"; "plane": the second curve over the first
    ticks: str = ""
    fills: tuple[Fill, ...] = ()
    marks: tuple[Mark, ...] = ()
    levels: tuple[Level, ...] = ()
    bands: tuple[Band, ...] = ()
    areas: tuple[str, ...] = ()  # words of the numbered areas of the figures
    dots: tuple[tuple[float, float], ...] = ()
    dots_name: str = ""
    span: tuple[float, float, str] | None = None  # a dimension at the right
    notes: tuple[str, ...] = ()  # in the legend, without a line
    along: tuple[float, ...] = ()  # positions of the driver that are marked on a curve in a plane
    breaks: tuple[int, ...] = ()  # samples before which the curves jump; 0 if a cycle's ends differ


class Diagram(NamedTuple):
    """Figures in SI, and what is drawn of them: rows, or the other `form` of which the live page has a script."""

    figures: dict[str, Any]
    title: str = ""
    about: str = ""
    rows: tuple[Row, ...] = ()
    remarks: tuple[str, ...] = ()  # sentences that the live page sets above
    form: str = "rows"

    def values(self, of: str) -> Array:
        """The values of a curve."""
        place: Any = self.figures
        for key in of.split("."):
            place = place[int(key)] if isinstance(place, list) else place[key]
        return np.asarray(place, dtype=float)

    def as_dict(self) -> dict[str, Any]:
        """The figures, and beside them how they are drawn, as plain mappings and lists."""
        rows = [row._asdict() for row in self.rows]
        for row in rows:
            for key in ("curves", "fills", "marks", "levels", "bands"):
                row[key] = [part._asdict() for part in row[key]]
        drawing = {"title": self.title, "about": self.about, "remarks": self.remarks, "form": self.form, "rows": rows}
        return self.figures | {"diagram": drawing}


class Axis(NamedTuple):
    """Positions of the driver (rad or m): as they are shown, and as they are evaluated, beside a jump.

    Stroke by stroke times (s) are shown, and the positions there are evaluated; `unit` is that of what is shown.
    """

    shown: Array
    taken: Array
    unit: str = "rad"


class Part(NamedTuple):
    """Data of all diagrams; `samples` are those of the cycle whose areas are shown, if there is one.

    `stroke` and `course` are the single stroke of a machine that works so, and its period over time.
    """

    scene: Scene
    machine: Machine | None
    sizing: Sizing | None
    axis: Axis
    view: Mapping[str, Any] = {}
    rest: bool = True
    samples: Samples | None = None
    stroke: Any = None
    course: Any = None


def part_of(
    scene: Scene,
    machine: Machine | None,
    sizing: Sizing | None,
    count: int = FINE,
    view: Mapping[str, Any] | None = None,
    *,
    rest: bool = True,
) -> Part:
    """Positions over the cycle or stroke of a scene, about so many, and the turning moment at them."""
    axis = _axis(scene, machine, sizing, count)
    return Part(scene, machine, sizing, axis, view or {}, rest, _samples(machine, sizing, axis))


# -- the axis ------------------------------------------------------------------------------------------------------------


def _axis(scene: Scene, machine: Machine | None, sizing: Sizing | None, count: int) -> Axis:
    """Positions over the cycle or the stroke: even ones, narrow features, both sides of jumps, and the places of figures."""
    cycle = scene.cycle
    even = np.linspace(0.0, cycle, count)
    if machine is None or scene.areas is not None:
        return Axis(even, even)
    beside = _JUMP_SIDE * cycle
    edges = np.asarray(machine.breakpoints)
    jumps = edges if edges.size <= _MOST_JUMPS else np.array([])
    more = [np.array([]), edges if edges.size <= count else np.array([])]
    if sizing is not None and sizing.cycle is not None:
        for each in filter(None, (sizing.cycle, sizing.constant)):
            jumps = np.concatenate((jumps, _moment_jumps(each)))
            more.append(_narrow(each, cycle / count))
        at = [sizing.angle_speed_max, sizing.angle_speed_min, *(area.end for area in sizing.areas[:count])]
        more.append(np.array([place for place in at if place is not None]))
    jumps = np.unique(jumps[(jumps > beside) & (jumps < cycle - beside)])
    single = np.unique(np.concatenate((even[1:-1], *more)))
    single = single[(single > beside) & (single < cycle - beside)]
    if jumps.size:
        near = np.searchsorted(jumps, single)
        gaps = np.abs(single - jumps[np.minimum(near, jumps.size - 1)]), np.abs(single - jumps[np.maximum(near - 1, 0)])
        single = single[np.minimum(*gaps) > 2 * beside]
    ends, taken_ends = np.array([0.0, cycle]), np.array([0.0, cycle * (1.0 - _JUMP_SIDE)])
    if scene.stroke is not None:
        taken_ends = ends
    shown = np.concatenate((ends, single, jumps, jumps))
    taken = np.concatenate((taken_ends, single, jumps - beside, jumps + beside))
    order = np.argsort(taken, kind="stable")
    return Axis(scene.origin + shown[order], scene.origin + taken[order])


def _moment_jumps(cycle: turning_moment.Cycle) -> Array:
    """Angles at which M* jumps within a cycle (rad)."""
    series = cycle.series[0]
    left, right = series.sum(axis=-1), (series * (-1.0) ** np.arange(series.shape[-1])).sum(axis=-1)
    apart = np.abs(right[1:] - left[:-1])
    return np.asarray(cycle.mesh.edges[1:-1][apart > _JUMP * np.abs(series).sum(axis=-1).max()])


def _narrow(cycle: turning_moment.Cycle, width: float) -> Array:
    """Angles (rad) within cells far narrower than a width: of those in one such width the greatest and least M*."""
    mesh = cycle.mesh
    fine = mesh.half[:, 0] < _NARROW * width
    phi = mesh.phi[fine].ravel()
    if not phi.size:
        return phi
    cell, t = cycle.where(phi)
    moment = (cycle.series[0, cell] * np.cos(np.arccos(t)[:, None] * np.arange(cycle.series.shape[-1]))).sum(axis=-1)
    place = np.floor(phi / width)
    orders = np.lexsort((moment, place)), np.lexsort((-moment, place))
    return np.unique(np.concatenate([phi[order[np.append(True, np.diff(place[order]) > 0.0)]] for order in orders]))


def _samples(machine: Machine | None, sizing: Sizing | None, axis: Axis) -> Samples | None:
    """The cycle that the areas are of, on the axis: that at a constant speed, where torques depend on speed."""
    if sizing is None or sizing.cycle is None or machine is None:
        return None
    if sizing.cyclic is None or sizing.constant is None:
        return samples.samples_at(machine, sizing.cycle, axis.taken)._replace(phi=axis.shown)
    constant = samples.samples_at(machine, sizing.constant, axis.taken, sizing.cyclic.constant_speed)
    return constant._replace(phi=axis.shown)


def along_motion(part: Part) -> Samples:
    """The cycle of the motion itself, on the axis."""
    sizing, record = part.sizing, part.samples
    assert sizing is not None
    assert sizing.cycle is not None
    assert record is not None
    assert part.machine is not None
    return record if sizing.constant is None else samples.samples_at(part.machine, sizing.cycle, part.axis.taken)


def peak(shown: Array, values: Array, sense: float) -> dict[str, Any] | None:
    """Point at which a curve is greatest (sense 1) or least: top of a parabola through three samples, or a sample."""
    signed = np.where(np.isfinite(values), sense * values, -np.inf)
    k = int(signed.argmax())
    if not np.isfinite(signed[k]):
        return None
    at, value = float(shown[k]), float(signed[k])
    if 0 < k < shown.size - 1 and np.isfinite(signed[k - 1 : k + 2]).all():
        (a, b, c), (u, v, w) = shown[k - 1 : k + 2], signed[k - 1 : k + 2]
        if a < b < c:
            left, right = (v - u) / (b - a), (w - v) / (c - b)
            bend = (right - left) / (c - a)
            if bend < 0.0:
                top = 0.5 * (a + b) - 0.5 * left / bend
                if a < top < c:
                    at, value = float(top), float(v + left * (top - b) + bend * (top - a) * (top - b))
    return {"value": sense * value, "at": at}


def extremes(shown: Array, values: Array) -> dict[str, Any]:
    """The least and the greatest value of a curve, each with its place."""
    return {"least": peak(shown, values, -1.0), "greatest": peak(shown, values, 1.0)}


def without_noise(forces: Mapping[str, Array]) -> dict[str, Array]:
    """Forces with those as zero that are no more than the rounding of the others."""
    largest = max((float(np.nanmax(np.abs(force), initial=0.0)) for force in forces.values()), default=0.0)
    level = _FORCE_ROUNDING * largest
    return {
        name: np.zeros_like(force) if np.all(np.abs(force) <= level) else np.asarray(force) for name, force in forces.items()
    }


# -- words ---------------------------------------------------------------------------------------------------------------


def angle(radians: float) -> str:
    """An angle of the crank in degrees."""
    return f"{written(float(np.degrees(radians)), _DIGITS, _DEGREE_ERROR)}°"


def area_work(work: float, error: float) -> str:
    """The work of an area (J) with its sign."""
    digits = written(work, _DIGITS, 2 * error)
    return f"{'+' if work > 0 and digits != '0' else ''}{digits} J"


def works_error(sizing: Sizing) -> float:
    """Absolute error (J) of an accumulated work, with the remainder of a constant speed that is found as a root."""
    return work_error(sizing) + 2 * (0.0 if sizing.constant is None else abs(sizing.constant.net))


def place_of(sliding: bool, at: float) -> str:
    """A position of the driver in words: an angle in degrees or a way in mm."""
    if sliding:
        return f"{written(1000.0 * at, _DIGITS)} mm"
    return f"{language.number(f'{np.degrees(at):.1f}'.replace('-', '−'))}°"


def scaled(unit: str, largest: float) -> tuple[float, str]:
    """Factor for values of a unit, and the unit in which they are then shown."""
    if unit == "rad":
        return 180.0 / np.pi, "°"
    if unit in ("m", "m/s", "m/rad", "m/rad²") and 0.0 < largest < 1.0:
        return 1000.0, f"m{unit}"
    if unit in ("N", "N m") and largest >= 1e4:
        return 1e-3, f"k{unit}"
    return 1.0, unit
