"""The form of a diagram: figures in SI on one axis of the driver, and rows that describe their drawing.

A row has curves, fills, marks with their words, bands and notes. `pictures/sizing` draws rows with matplotlib,
`page/static/figures/curves.js` in the live page, each without knowing which diagram it is.

Positions of the driver ascend over the cycle or the stroke; where something jumps one stands twice, for the values before
and after.

Reactions of joints: a pin, slot, fixed joint or coupling is a row of the kind "plane", the tip of its force in the frame's
axes; a slide is its normal forces over the driver, and its moment in a row of its own with the same key; so is each driving
action.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from math import ceil
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel import language
from flywheel.language import text as _
from flywheel.machine.machine import Machine
from flywheel.numerics import cells
from flywheel.pictures import written
from flywheel.regime import turning_moment
from flywheel.regime.turning_moment import Cycle, Run
from flywheel.scene.linkage import PIN, SLIDE, Linkage
from flywheel.scene.scene import TURN, Scene
from flywheel.sizing.findings import work_error
from flywheel.sizing.results import Sizing

if TYPE_CHECKING:
    from flywheel.mechanisms.linkages.reactions import Reactions
from typing import TYPE_CHECKING

from flywheel.tables.rows import RPM, place

if TYPE_CHECKING:
    from flywheel.motions.single_stroke import SingleStroke
    from flywheel.motions.stroke_course import Course


_NO_WORK = 1e-3  # of what a load gives and takes in a cycle: it does no work if less is left, as a weight does
_LOOP_SHARE = 0.10  # of the width and height of Wittenbauer's diagram: a smaller loop has a window of its own
_INTERCEPT_ROUNDING = 1e-9  # of the intercepts or inertias: work, in the same unit, that is none


class CycleSamples(NamedTuple):
    """One cycle, point by point: phi (rad), M* (N m), W (J), I* (kg m²), and the driving moment.

    `driving` is M_m* (N m): the sum of the drive, unless it brakes on the whole, and of the loads that do positive work in
    the cycle; M* less it is M_r*, with losses in meshes. `drive` is the drive's own part, None without one. Two points stand
    at every edge of a cell, one for each side.
    """

    phi: Array
    moment: Array
    work: Array
    inertia: Array
    driving: Array
    drive: Array | None


def samples_at(machine: Machine, cycle: Cycle, phi: Array, speed: float | None = None) -> CycleSamples:
    """A resolved cycle at angles (rad) that ascend; at an edge the value of the cell that begins there.

    Moments below their rounding are 0, and so is a work that nowhere exceeds its error.
    """
    cell, t = cells.located(cycle.mesh, phi)
    work, variation = cycle.at(cell, t)
    moment = cells.value(cycle.series[0, cell], t)
    driving, drive = _driving(machine, cycle, phi, machine.anchors(phi), speed)
    return CycleSamples(
        phi=phi,
        moment=np.where(np.abs(moment) > cycle.noise[0, cell], moment, 0.0),
        work=np.where(np.abs(work).max() > cycle.errors.work, work, 0.0),
        inertia=cycle.inertia_at_start + variation,
        driving=driving,
        drive=drive,
    )


def _driving(machine: Machine, cycle: Cycle, phi: Array, anchor: Array, speed: float | None) -> tuple[Array, Array | None]:
    """M_m* (N m) at angles that ascend: of the drive, unless it brakes on the whole, and of loads that do positive work.

    Second the drive's own, None without one.
    """
    moving = speed if machine.depends_on_speed or machine.depends_on_time else None
    parts = machine.reduction.moments(phi, anchor, cycle.balance or 0.0, speed=moving)
    moments, drive = np.zeros_like(phi), None
    for name, part in parts.items():
        there = part + np.zeros_like(phi)
        if name == "drive":
            drive = there
        work, size = np.trapezoid(there.ravel(), phi.ravel()), np.trapezoid(np.abs(there).ravel(), phi.ravel())
        if work > (-_NO_WORK if name == "drive" else _NO_WORK) * size:  # a drive that holds back on the whole resists
            moments = moments + there
    return moments, drive


class Loop(NamedTuple):
    """Wittenbauer's loop, F = 2 W/w² against I* (both kg m²), and the two tangents that an irregularity gives it.

    A tangent is F = slope I* + intercept, slope = (1 ± eps/2)². `contact_*` are the points where it touches, as
    (I*, F), `angle_*` their crank angles (rad). The tangents meet in P at I* = -flywheel, and MN = 2 eps flywheel.
    """

    inertia: Array
    energy: Array
    slope_fast: float
    slope_slow: float
    intercept_fast: float
    intercept_slow: float
    contact_fast: tuple[float, float]
    contact_slow: tuple[float, float]
    angle_fast: float
    angle_slow: float
    flywheel: float

    @property
    def lines(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """The tangents of the greatest and of the least speed, each as (slope, intercept)."""
        return (self.slope_fast, self.intercept_fast), (self.slope_slow, self.intercept_slow)

    @property
    def far_point(self) -> tuple[float, float]:
        """P, where the tangents meet: (I*, F)."""
        return -self.flywheel, self.intercept_fast - self.slope_fast * self.flywheel


def loop(cycle: Cycle, samples: CycleSamples, speed: float, run: Run) -> Loop:
    """The loop with the tangents for the irregularity of a run, found from extremes, not from the samples.

    `speed` is w, the mean of extremes (rad/s). Source: F. Wittenbauer, Graphische Dynamik (1923).
    """
    unit, start = 2.0 / speed**2, cycle.inertia_at_start
    fast, slow = (1 + run.irregularity / 2) ** 2, (1 - run.irregularity / 2) ** 2
    extremes, _ = turning_moment.combined(cycle, np.array([[1.0, -fast / unit], [1.0, -slow / unit]]))
    over, under = float(extremes.greatest[0]), float(extremes.least[1])
    angles = float(extremes.angle_greatest[0]), float(extremes.angle_least[1])
    work, variation = cycle.at(*cells.located(cycle.mesh, np.array(angles)))
    points = [(start + float(v), unit * float(w)) for w, v in zip(work, variation, strict=True)]
    return Loop(
        inertia=samples.inertia,
        energy=unit * samples.work,
        slope_fast=fast,
        slope_slow=slow,
        intercept_fast=unit * over - fast * start,
        intercept_slow=unit * under - slow * start,
        contact_fast=points[0],
        contact_slow=points[1],
        angle_fast=angles[0],
        angle_slow=angles[1],
        flywheel=run.inertia,
    )


def windows(loop: Loop, joule: float) -> tuple[list[list[float]], str]:
    """The visible parts of the diagram, [left, right, low, high] in kg m² and J, and the contents of the last one.

    The whole triangle ("P"), or without P where the loop would be too small in it ("MN"); if it would be even there, the
    loop follows by itself ("loop"). A loop whose work is only rounding is a line without height.
    """
    corners = np.array([[loop.inertia.min(), loop.inertia.max()], [loop.energy.min(), loop.energy.max()]])
    axis = np.array([[0.0, 0.0], [loop.intercept_slow, loop.intercept_fast]])
    at_right = [slope * corners[0, 1] + cut for slope, cut in loop.lines]
    far = np.array(loop.far_point)[:, None]
    windows, extents = list[list[float]](), np.ptp(corners, axis=1)
    line = extents[1] <= _INTERCEPT_ROUNDING * max(np.abs(axis).max(), corners[0, 1])
    for name, parts in {"P": [corners, axis, far], "MN": [corners, axis], "loop": [corners]}.items():
        points = np.concatenate(parts, axis=1)
        low, high = points.min(axis=1), points.max(axis=1)
        if name != "loop":
            low[1], high[1] = min(low[1], *at_right), max(high[1], *at_right)
        spans = np.maximum(high - low, 1e-300)
        margin = np.array([0.12, 0.1]) * spans
        (left, bottom), (right, top) = low - margin, high + margin
        large = bool((extents >= _LOOP_SHARE * spans)[: 1 if line else 2].all())
        if name != "P" or large:
            windows.append([float(left), float(right), float(joule * bottom), float(joule * top)])
        if large:
            return windows, name
    return windows, "loop"


def crossing_speeds(sums: Array, least: float, inertia: float) -> Array:
    """Crank speeds (rad/s) at the crossings of a diagram of areas, from ½ J (w² - w_min²) = S - S_min.

    `sums` are the accumulated areas S (J), `least` is w_min (rad/s), `inertia` the flywheel J on the crank (kg m²).

    >>> crossing_speeds(np.array([0.0, 3.5, -1.0]), 1.0, 1.0).round(6).tolist()
    [1.732051, 3.162278, 1.0]
    """
    return np.asarray(np.sqrt(least**2 + 2 * (sums - sums.min()) / inertia))


def roomiest(samples: CycleSamples, start: float, end: float, side: float, width: float) -> tuple[float, float]:
    """Angle at which a text of some width (rad) has most room under the curve between two angles, and the free |M*|.

    Of equally good places the one nearest to the centroid is taken; without room anywhere, the centroid.
    """
    phi = np.linspace(start, end, 201)
    size = np.maximum(side * np.interp(phi, samples.phi, samples.moment), 0.0)
    centroid = float((phi * size).sum() / size.sum()) if size.any() else 0.5 * (start + end)
    window = int(np.ceil(width / (phi[1] - phi[0]))) + 1
    if window >= phi.size:
        return centroid, 0.0
    free = np.lib.stride_tricks.sliding_window_view(size, window).min(axis=1)
    middles = phi[: free.size] + 0.5 * (window - 1) * (phi[1] - phi[0])
    good = np.flatnonzero(free >= 0.9 * free.max())
    best = good[np.abs(middles[good] - centroid).argmin()]
    return float(middles[best]), float(free[best])


Array = NDArray[np.float64]

FINE, RESTING, MOVING = 3001, 361, 181  # positions of the driver: of a picture, of the live page at rest and during a drag
_MOST_JUMPS = 40  # breakpoints of a machine that all get both sides; of more, those at which M* jumps
_JUMP_SIDE = 1e-10  # of the cycle: the distance from a jump at which its sides are evaluated
_JUMP = 1e-6  # of the greatest M*: the least jump
_NARROW = 0.15  # of the distance of positions: half the width of a cell whose own extremes become positions
_FORCE_ROUNDING = 1e-12  # of the largest force
_DIGITS = 5
_DEGREE_ERROR = 1e-9  # deg
_MOSTLY = 0.5  # share of unknown values of a couple from which on it is unknown, though known at stretched positions


class DiagramCurve(NamedTuple):
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


class ExtremeMark(NamedTuple):
    """A greatest or least value, with its words and, as far as `line` says, a level to the right end."""

    kind: str  # "greatest" or "least"
    at: float
    value: float
    words: str
    colour: str
    level: bool = False


class Band(NamedTuple):
    """A stretch of an axis: of values, one of them where both ends are the same; or of the driver's, in its own colour."""

    low: float
    high: float
    name: str
    colour: str = ""


class DiagramRow(NamedTuple):
    """One pair of axes: over the driver, or over numbered areas or crossings (`ticks`, "A" or "S")."""

    key: str
    title: str
    label: str
    unit: str  # in which values are shown
    about: str
    curves: tuple[DiagramCurve, ...]
    height: float = 3.7  # inches in a picture; in proportion on the live page
    factor: float = 1.0  # from SI
    si: str = ""  # unit of the figures, where it is another
    origin: float = 0.0  # the value from which the axis counts
    across: float = 1.0  # from SI, of an axis that is not the driver's
    zero: bool = False  # zero is within the axis
    kind: str = "curves"  # or "stack", "bars", "points", "loop", "area"; "plane": the second curve over the first
    ticks: str = ""
    fills: tuple[Fill, ...] = ()
    marks: tuple[ExtremeMark, ...] = ()
    levels: tuple[Band, ...] = ()
    bands: tuple[Band, ...] = ()
    areas: tuple[str, ...] = ()  # words of the numbered areas of the figures
    dots: tuple[tuple[float, float], ...] = ()
    dots_name: str = ""
    span: tuple[float, float, str] | None = None  # a dimension at the right
    notes: tuple[str, ...] = ()  # in the legend, without a line
    along: tuple[float, ...] = ()  # positions of the driver that are marked on a curve in a plane
    breaks: tuple[int, ...] = ()  # samples before which the curves jump; 0 if a cycle's ends differ


class Diagram(NamedTuple):
    """Figures in SI, and their drawing: rows, or the other `form` of which the live page has a script."""

    figures: dict[str, Any]
    title: str = ""
    about: str = ""
    rows: tuple[DiagramRow, ...] = ()
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
    """Positions of the driver (rad or m): those shown, and those evaluated, which are beside a jump.

    Stroke by stroke times (s) are shown, and the positions there are evaluated; `unit` is that of the values shown.
    """

    values: Array
    taken: Array
    unit: str = "rad"


class DiagramData(NamedTuple):
    """Data of all diagrams; `samples` are those of the cycle whose areas are shown, if there is one.

    `stroke` and `course` are the stroke of a machine that works stroke by stroke, and its period over time.
    """

    scene: Scene
    machine: Machine | None
    sizing: Sizing | None
    axis: Axis
    view: Mapping[str, Any] = {}
    rest: bool = True
    samples: CycleSamples | None = None
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
) -> DiagramData:
    """Positions over the cycle or stroke of a scene, about that number, and the turning moment there."""
    axis, samples = _axis(scene, machine, sizing, count), None
    if machine is not None and sizing is not None and sizing.cycle is not None:  # the cycle of the areas
        cycle, speed = sizing.cycle, None
        if sizing.cyclic is not None and sizing.constant is not None:  # at a constant speed if torques depend on speed
            cycle, speed = sizing.constant, sizing.cyclic.constant_speed
        samples = samples_at(machine, cycle, axis.taken, speed)._replace(phi=axis.values)
    return DiagramData(scene, machine, sizing, axis, view or {}, rest, samples)


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
    points = np.concatenate((ends, single, jumps, jumps))
    taken = np.concatenate((taken_ends, single, jumps - beside, jumps + beside))
    order = np.argsort(taken, kind="stable")
    return Axis(scene.origin + points[order], scene.origin + taken[order])


def _moment_jumps(cycle: turning_moment.Cycle) -> Array:
    """Angles at which M* jumps within a cycle (rad)."""
    series = cycle.series[0]
    left, right = series.sum(axis=-1), (series * (-1.0) ** np.arange(series.shape[-1])).sum(axis=-1)
    apart = np.abs(right[1:] - left[:-1])
    return np.asarray(cycle.mesh.edges[1:-1][apart > _JUMP * np.abs(series).sum(axis=-1).max()])


def _narrow(cycle: turning_moment.Cycle, width: float) -> Array:
    """Angles (rad) within cells far narrower than a width: in each such width those with the greatest and least M*."""
    mesh = cycle.mesh
    fine = mesh.half[:, 0] < _NARROW * width
    phi = mesh.phi[fine].ravel()
    if not phi.size:
        return phi
    cell, t = cells.located(cycle.mesh, phi)
    moment = (cycle.series[0, cell] * np.cos(np.arccos(t)[:, None] * np.arange(cycle.series.shape[-1]))).sum(axis=-1)
    place = np.floor(phi / width)
    orders = np.lexsort((moment, place)), np.lexsort((-moment, place))
    return np.unique(np.concatenate([phi[order[np.append(True, np.diff(place[order]) > 0.0)]] for order in orders]))


def along_motion(part: DiagramData) -> CycleSamples:
    """The cycle of the motion itself, on the axis."""
    sizing, record = part.sizing, part.samples
    assert sizing is not None
    assert sizing.cycle is not None
    assert record is not None
    assert part.machine is not None
    return record if sizing.constant is None else samples_at(part.machine, sizing.cycle, part.axis.taken)


def peak(positions: Array, values: Array, sense: float) -> dict[str, Any] | None:
    """Point at which a curve is greatest (sense 1) or least: top of a parabola through three samples, or a sample."""
    signed = np.where(np.isfinite(values), sense * values, -np.inf)
    k = int(signed.argmax())
    if not np.isfinite(signed[k]):
        return None
    at, value = float(positions[k]), float(signed[k])
    if 0 < k < positions.size - 1 and np.isfinite(signed[k - 1 : k + 2]).all():
        (a, b, c), (u, v, w) = positions[k - 1 : k + 2], signed[k - 1 : k + 2]
        if a < b < c:
            left, right = (v - u) / (b - a), (w - v) / (c - b)
            bend = (right - left) / (c - a)
            if bend < 0.0:
                top = 0.5 * (a + b) - 0.5 * left / bend
                if a < top < c:
                    at, value = float(top), float(v + left * (top - b) + bend * (top - a) * (top - b))
    return {"value": sense * value, "at": at}


def extremes(positions: Array, values: Array) -> dict[str, Any]:
    """The least and the greatest value of a curve, each with its place."""
    return {"least": peak(positions, values, -1.0), "greatest": peak(positions, values, 1.0)}


def without_noise(forces: Mapping[str, Array]) -> dict[str, Array]:
    """Forces, with zero for those within the rounding of the others."""
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
    """Absolute error (J) of an accumulated work, with the residual of a constant speed that is a root."""
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


_STEP = 30.0  # deg between two marks
_ALONG = 11  # marks along a stroke
_SHORT = 90.0  # deg: a shorter way has as many
_NEGLIGIBLE = 1e-9  # of the largest force: a smaller moment (N m) is not drawn
_FORCE_JUMP, _STEEPER = 0.02, 8.0  # of the largest force, times as steep as the steps beside it: such a step is a jump
_AT_ONCE = 1e-3  # of the median step, of the largest force: a larger change over a shorter way is a jump
_SIDES = {"normal": ("blue", "-"), "front": ("vermillion", "--"), "rear": ("green", "-.")}


def force_figures(reactions: Reactions, positions: Array, joints: Iterable[str] | None = None) -> dict[str, Any]:
    """Forces of joints (all if None) and driving actions at `positions`, with their extremes."""
    linkage = reactions.poses.linkage
    kinds = {joint.name: (joint.kind, joint.first, joint.second) for joint in linkage.joints}
    forces = []
    for name in reactions.forces if joints is None else joints:
        kind, first, second = kinds.get(name, ("coupling", "", ""))
        x, y = (_ended(values, positions.size) for values in reactions.forces[name])
        at, force = parted(positions, np.stack((x, y)))
        one: dict[str, Any] = {"name": name, "kind": kind, "first": first, "second": second, "x": x, "y": y}
        if kind == SLIDE:
            parts = {part: _ended(values, positions.size) for part, values in reactions.components[name].items()}
            one |= {part: parts[part] for part in (*_SIDES, "moment") if part in parts}
            at, force = parted(positions, np.stack([parts[part] for part in _SIDES if part in parts]))
        if kind == "coupling" and "moment" in reactions.components[name]:  # a belt's couple, without a force
            one["moment"] = _ended(reactions.components[name]["moment"], positions.size)
        one["largest"] = peak(at, np.abs(force).max(axis=0) if kind == SLIDE else np.hypot(*force), 1.0)
        forces.append(one)
    driving = []
    for name, action in reactions.actions.items():
        values = _ended(action, positions.size)
        at, (cut,) = parted(positions, values)
        unit = "N m" if linkage.joint(name).kind == PIN else "N"
        driving.append({"name": name, "unit": unit, "values": values, **extremes(at, cut)})
    return {"joints": forces, "driving": driving}


def force_rows(
    figures: Mapping[str, Any], linkage: Linkage, positions: Array, *, cyclic: bool = False
) -> Iterator[DiagramRow]:
    """The rows of those figures; `cyclic`: the positions are those of a whole cycle, whose ends may differ by a jump."""
    for k, joint in enumerate(figures["joints"]):
        key, title, largest = f"joints.{k}", heading_of(linkage, joint["name"]), joint["largest"]
        is_belt = joint["kind"] == "coupling" and "moment" in joint
        if largest is None or (is_belt and np.isnan(joint["moment"]).mean() > _MOSTLY):
            about = _("Unknown: redundant constraints, or friction locks.")
            yield DiagramRow(key, title, _("force"), "N", about, ())
            continue
        if is_belt:
            yield _moment_row(key, title, joint["moment"], positions)
            continue
        factor, unit = scaled("N", largest["value"])
        about = _(
            "at most {force} {unit}, at {place}",
            force=written(factor * largest["value"], 4),
            unit=unit,
            place=place_of(linkage.sliding, largest["at"]),
        )
        if joint["kind"] != SLIDE:
            values = np.stack((joint["x"], joint["y"]))
            curves: tuple[DiagramCurve, ...] = (
                DiagramCurve(f"{key}.x", "Fx", "blue", "-", 1.6),
                DiagramCurve(f"{key}.y", "Fy", "blue", "-", 1.6),
            )
            along, jumps = force_marks(positions, values, linkage.sliding), breaks(positions, values, cyclic=cyclic)
            row = DiagramRow(key, title, "F", unit, about, curves, factor=factor, si="N", kind="plane")
            yield row._replace(along=along, breaks=jumps)
            continue
        words = {"normal": _("normal"), "front": _("front"), "rear": _("rear")}
        sides = [part for part in _SIDES if part in joint]
        curves = tuple(DiagramCurve(f"{key}.{part}", words[part], *_SIDES[part], 1.6) for part in sides)
        values = np.stack([joint[part] for part in sides])
        row = DiagramRow(key, title, _("normal force"), unit, about, curves, factor=factor, si="N", zero=True)
        yield row._replace(breaks=breaks(positions, values))
        moment = joint.get("moment")
        if moment is not None and float(np.nanmax(np.abs(moment), initial=0.0)) > _NEGLIGIBLE * largest["value"]:
            yield _moment_row(key, title, moment, positions)
    for k, drive in enumerate(figures["driving"]):
        yield _action_row(k, drive, positions)


def _moment_row(key: str, title: str, moment: Array, positions: Array) -> DiagramRow:
    """The row of a moment in a slide, or of a belt's couple."""
    least, most = (written(float(value), 4) for value in (np.nanmin(moment), np.nanmax(moment)))
    about = _("from {least} to {most} {unit}", least=least, most=most, unit="N m")
    curve = DiagramCurve(f"{key}.moment", _("moment"), "purple", ":", 1.6)
    row = DiagramRow(key, title, _("moment"), "N m", about, (curve,), si="N m", zero=True)
    return row._replace(breaks=breaks(positions, moment))


def _action_row(k: int, drive: Mapping[str, Any], positions: Array) -> DiagramRow:
    """The row of a driving torque or force."""
    name, title = _("driving torque"), _("driving torque at {joint}", joint=drive["name"])
    if drive["unit"] == "N":
        name, title = _("driving force"), _("driving force at {joint}", joint=drive["name"])
    if drive["least"] is None:
        return DiagramRow(f"driving.{k}", title, name, drive["unit"], _("Unknown: friction locks everywhere."), ())
    low, high = drive["least"]["value"], drive["greatest"]["value"]
    factor, unit = scaled(drive["unit"], max(-low, high))
    about = _("from {least} to {most} {unit}", least=written(factor * low, 4), most=written(factor * high, 4), unit=unit)
    curves = (DiagramCurve(f"driving.{k}.values", name, "green", "-", 1.6),)
    row = DiagramRow(f"driving.{k}", title, name, unit, about, curves, factor=factor, si=drive["unit"], zero=True)
    return row._replace(breaks=breaks(positions, drive["values"]))


def heading_of(linkage: Linkage, name: str) -> str:
    """A joint's name with the bodies between which its force acts: "slider_pin: rod on slider"."""
    for joint in linkage.joints:
        if joint.name == name:
            return _("{joint}: {first} on {second}", joint=name, first=joint.first, second=joint.second)
    return name


def force_marks(positions: Array, values: Array, sliding: bool) -> tuple[float, ...]:
    """Positions (rad or m) at which a hodograph (2, n) is marked: every 30 deg, more where several turns crowd.

    Along a short travel, or a slide's, they are even. A closed curve is marked once at its end; there are no marks where the
    force is unknown.
    """
    low, high = float(positions.min()), float(positions.max())
    if sliding or np.degrees(high - low) < _SHORT:
        places = np.linspace(low, high, _ALONG)
    else:
        step = np.radians(_STEP) * max(ceil((high - low) / TURN - 1e-9), 1)
        places = step * np.arange(ceil(low / step - 1e-9), int(high / step + 1e-9) + 1)
    spots = np.stack([np.interp(places, positions, part) for part in values])
    finite = np.isfinite(spots).all(axis=0)
    places, spots = places[finite], spots[:, finite]
    if not sliding and places.size > 1:
        turns = (places[-1] - places[0]) / TURN
        if turns > 0.5 and abs(turns - round(turns)) < 1e-9 and np.allclose(spots[:, 0], spots[:, -1]):
            places = places[:-1]
    return tuple(map(float, places))


def parted(x: Array, values: Array) -> tuple[Array, Array]:
    """X and a curve (m, n) over it, both with NaN if the curve jumps."""
    values = np.atleast_2d(values)
    at = [k for k in breaks(x, values) if k]
    return np.insert(x, at, np.nan), np.insert(values, at, np.nan, axis=1)


def _ended(values: Array, size: int) -> Array:
    """Values with the first one again at the end, if there is to be one more."""
    return values if values.shape[-1] == size else np.concatenate((values, values[..., :1]), axis=-1)


def breaks(x: Array, values: Array, *, cyclic: bool = False) -> tuple[int, ...]:
    """The samples before which a curve (m, n) over x jumps: 0 if a cycle's ends differ.

    A jump is a step at one place, or one that is far steeper than those beside it and no small part of the whole.
    """
    values = np.atleast_2d(values)
    steps, ways = np.hypot.reduce(np.abs(np.diff(values, axis=1)), axis=0), np.abs(np.diff(x))
    whole = float(np.nanmax(np.abs(values), initial=0.0))
    at_once = ways <= _AT_ONCE * np.median(ways)
    steep = steps[~at_once] / ways[~at_once]
    beside = np.fmax(np.concatenate(([0.0], steep[:-1])), np.concatenate((steep[1:], [0.0])))
    jumps = steps > _AT_ONCE * whole
    jumps[~at_once] = (steep > _STEEPER * beside) & (steps[~at_once] > _FORCE_JUMP * whole)
    places = np.flatnonzero(jumps) + 1
    opened = cyclic and bool(np.hypot.reduce(values[:, -1] - values[:, 0]) > _FORCE_JUMP * whole)
    return (*((0,) if opened else ()), *map(int, places))


_MOST_CAPACITY = 4.0  # times the greatest torque: a capacity above that is named, not drawn


def part_of_stroke(
    result: SingleStroke, count: int = FINE, view: Mapping[str, Any] | None = None, *, rest: bool = True
) -> DiagramData:
    """A period of a machine that works stroke by stroke, at about that number of times."""
    from flywheel.motions.stroke_course import course  # a door: motions load linkages

    along = course(result.strokes, result.phases, count)
    axis = Axis(along.time, along.phi, "s")
    return DiagramData(result.scene, None, None, axis, view or {}, rest, stroke=result, course=along)


def stroke_diagram(part: DiagramData, forces: object = "") -> Diagram | str:
    """Speeds on both sides of the clutch with its slip shaded, torques of clutch and brake, energy of wheel and drive."""
    stroke, along = part.stroke, part.course
    if stroke is None or along is None:
        return _("The stroke is not completed: see the faults.")
    figures: dict[str, Any] = dict(along._asdict())
    figures["both"] = along.drive_work + along.wheel_work
    rows = _speeds(stroke, along), _torques(stroke, along), _energies(stroke, along)
    title = _("One stroke over time")
    return Diagram(figures, title, " ".join(row.about for row in rows), rows)


def _bands(result: SingleStroke) -> tuple[Band, ...]:
    """Slip of the clutch and braking of the crank."""
    phases = result.phases
    return (
        *(Band(leg.begin, leg.end, _("the clutch slips"), "orange") for leg in (phases.legs[0], *phases.slips)),
        Band(phases.brake_time, phases.stop_time, _("the crank is braked"), "sky"),
    )


def _speeds(result: SingleStroke, course: Course) -> DiagramRow:
    on = result.strokes.clutch.on
    least = peak(course.time, course.driving, -1.0)
    assert least is not None
    slowest = result.speed_least / result.strokes.wheel  # at the clutch's shaft
    words = {"speed": written(RPM * slowest), "time": written(least["at"], 4)}
    lowest = _("least: {speed} rpm at {time} s", **words)
    slip = {"slip": written(result.phases.lock_time, 4), "stop": written(result.phases.stop_time, 4)}
    about = _("The clutch slips for {slip} s; the crank stands after {stop} s.", **slip)
    return DiagramRow(
        key="stroke_speeds",
        title=_("Speeds on both sides of the clutch"),
        label=_("speed at shaft {name}", name=on),
        unit="rpm",
        factor=RPM,
        si="rad/s",
        about=f"{about} {lowest}.",
        curves=(
            DiagramCurve("driving", _("motor side, with the flywheel"), "blue", "-", 1.8),
            DiagramCurve("crank", _("crank, times the ratio"), "vermillion", "--", 1.6),
        ),
        height=4.4,
        zero=True,
        bands=_bands(result),
        marks=(ExtremeMark("least", least["at"], slowest, lowest, "blue"),),
    )


def _torques(result: SingleStroke, course: Course) -> DiagramRow:
    clutch, brake = result.strokes.clutch, result.strokes.brake
    top = float(np.abs(np.concatenate((course.clutch, course.brake))).max())
    capacity = _("the clutch holds {torque} N m", torque=written(clutch.static_torque))
    near = clutch.static_torque <= _MOST_CAPACITY * top
    about = _(
        "Clutch up to {clutch} N m when locked, brake {brake} N m.",
        clutch=written(result.clutch_torque, 5, result.error["clutch_torque"]),
        brake=written(brake.torque),
    )
    return DiagramRow(
        key="stroke_torques",
        title=_("Torques of clutch and brake"),
        label=_("torque"),
        unit="N m",
        about=about,
        curves=(
            DiagramCurve("clutch", _("clutch, on {shaft}", shaft=place(clutch.on)), "ink", "-", 1.7),
            DiagramCurve("brake", _("brake, on {shaft}", shaft=place(brake.on)), "purple", "-.", 1.7),
        ),
        height=4.4,
        zero=True,
        bands=_bands(result),
        levels=(Band(clutch.static_torque, clutch.static_torque, capacity),) if near else (),
        notes=() if near else (capacity,),
    )


def _energies(result: SingleStroke, course: Course) -> DiagramRow:
    spent = float(course.drive_work[-1])
    most = peak(course.time, course.wheel_work, 1.0)
    assert most is not None
    words = {"energy": written(result.wheel_energy), "time": written(most["at"], 4)}
    note = _("the wheel has given {energy} J at {time} s", **words)
    about = _("The drive gives {energy} J a period.", energy=written(spent, 5, result.error["energy"]["motor"]))
    return DiagramRow(
        key="stroke_energies",
        title=_("Energy given since the clutch engaged"),
        label=_("energy"),
        unit="J",
        about=f"{about} {note}.",
        curves=(
            DiagramCurve("wheel_work", _("by the flywheel and what turns with it"), "blue", "-", 1.8),
            DiagramCurve("drive_work", _("by the drive"), "orange", "--", 1.8),
            DiagramCurve("both", _("by both"), "ink", ":", 1.6),
        ),
        zero=True,
        bands=_bands(result),
        marks=(ExtremeMark("greatest", most["at"], result.wheel_energy, note, "blue"),),
    )


_BRAKING = 1e-9  # of the greatest torque: the least braking that is shown
_LIMITS = 241  # speeds at which the curves of a servo drive are drawn


def servo_diagram(part: DiagramData, forces: object = "") -> Diagram | str:
    """Peak and continuous curve of a servo drive over speed, the loop of the motion, the rms point and the peak point."""
    sizing, motor = part.sizing, part.scene.motor
    assert motor is not None
    assert part.scene.drive is not None
    if part.stroke is not None:
        from flywheel.motions.stroke_course import motor_ratio, servo_load  # a door: motions load linkages

        load = servo_load(part.stroke.strokes, part.stroke.phases)
        speed = motor_ratio(part.stroke.strokes) * part.course.driving
    elif sizing is None or sizing.cycle is None or sizing.servo is None or sizing.run is None:
        return _("The machine cannot run with this scene: see the faults.")
    else:
        load, cycle, run = sizing.servo, sizing.run.cycle or sizing.cycle, sizing.run
        omega = turning_moment.speed_over_cycle(cycle, run.speed or sizing.speed, run, np.clip(part.axis.taken, 0.0, None))
        speed = part.scene.shafts[part.scene.drive.on] * omega
    assert load is not None
    torque = motor.torque(speed)
    speeds = np.linspace(0.0, max(motor.covers[1], float(speed.max())), _LIMITS)
    greatest, continuous = motor.peak(speeds), motor.continuous(speeds)
    top = 1.05 * float(greatest.max())
    points = (
        ("least", load.mean_speed, load.rms_torque, load.continuous_share, "green"),
        ("greatest", load.peak_speed, load.peak_torque, load.peak_share, "vermillion"),
    )
    names = _("rms point"), _("peak point")
    marks = []
    for name, (kind, at, value, share, colour) in zip(names, points, strict=True):
        place = _("{torque} N m at {speed} rpm", torque=written(value, 4), speed=written(at * RPM, 5))
        curve = _("of the continuous curve") if kind == "least" else _("of the peak curve")
        marks.append(ExtremeMark(kind, at, value, f"{name}: {place}, {written(100 * share, 3)} % {curve}", colour))
    figures = {
        "speeds": speeds,
        "peak": greatest,
        "continuous": continuous,
        "speed": speed,
        "torque": torque,
        "names": names,
        "words": _("speed of the motor, rpm"),
        "window": [0.0, float(speeds[-1]), -top if torque.min() < -_BRAKING * top else 0.0, top],
    }
    curves = (
        DiagramCurve("peak", _("peak curve"), "vermillion", "--", 1.6),
        DiagramCurve("continuous", _("continuous curve"), "green", "-.", 1.6),
        DiagramCurve("torque", _("motion over a cycle"), "blue", "-", 2.0),
    )
    remarks = []
    if load.inertia_ratio is not None:
        ratio_words = written(load.inertia_ratio, 4)
        remarks.append(_("Inertia of what it moves over that of its rotor: {ratio}.", ratio=ratio_words))
    about = "; ".join(mark.words for mark in marks) + "."
    title = _("Area of the servo drive")
    row = DiagramRow(
        "servo", title, _("torque of the motor"), "N m", about, curves, 4.4, kind="area", across=RPM, marks=tuple(marks)
    )
    return Diagram(figures, title, about, (row,), tuple(remarks), "area")


def has_stroke(scene: Scene) -> bool:
    """Tests whether a scene works stroke by stroke."""
    return scene.single_stroke is not None


def has_servo(scene: Scene) -> bool:
    """Tests whether a scene has a drive with such an area."""
    return scene.motor is not None and scene.motor.peak(0.0) is not None
