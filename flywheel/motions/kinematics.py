"""Position, velocity and acceleration of everything in a machine over a course of its driver, with their extremes.

`motion` takes the course and the curves of moving parts; a survey of cells finds the extremes of each curve.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.machine.machine import Machine, scene_of
from flywheel.mechanisms import KINDS
from flywheel.motions.curves import POINTS, MotionCurve, Moving, amount
from flywheel.motions.driver import DRIVER, DriverCourse, course_of, instants
from flywheel.motions.motion import Motion, Transient
from flywheel.numerics import cells, notebook
from flywheel.numerics.cells import ROUNDING
from flywheel.numerics.faults import Fault, SceneError, brief, name_faults
from flywheel.scene.linkage import offered
from flywheel.scene.scene import TURN, Scene

__all__ = ["DRIVERS", "CurveExtreme", "Kinematics", "Survey", "chosen", "motion", "survey"]

Array = NDArray[np.float64]

DRIVERS = ("t", "q", "rate", "acceleration")


# -- the record --------------------------------------------------------------------------------------------------------


class CurveExtreme(NamedTuple):
    """The least or greatest value of a quantity of a curve, and where on the axis (q or t) it is, with estimated errors.

    `quantity` is "position", "velocity" or "acceleration", `component` "x", "y" or "total" of a point and else empty.
    """

    quantity: str
    component: str
    which: str
    value: float
    at: float
    error: float
    at_error: float


@dataclass(frozen=True, eq=False)
class Kinematics:
    """The motion of everything in a machine, by name, over the driver's coordinate or over time.

    Attributes:
        scene: the machine's.
        condition: in words, how the driver moves.
        over: "driver" or "time".
        t: s, shape (n,); None per unit of the driver.
        q: the driver's coordinate (rad, or m where it slides), not reduced to a turn.
        rate: its rate; None per unit of the driver.
        acceleration: its acceleration; None per unit of the driver.
        curves: by name: bodies `rod`, centres of mass `rod.com`, points `rod.P`, joints `crank_pin`, angles between the
            bodies that a pin joins `crank_pin.angle`, slides `guide`, shafts `crank`; of several mechanisms `NAME.rod`.
        errors: estimated absolute errors of t, q, rate and acceleration.
        messages: notes.
        other_names: other names of the same curves.
        course: how the driver moves, everywhere.

    """

    scene: Scene
    condition: str
    over: str
    t: Array | None
    q: Array
    rate: Array | None
    acceleration: Array | None
    curves: Mapping[str, MotionCurve]
    errors: Mapping[str, Array]
    messages: tuple[str, ...]
    other_names: Mapping[str, str]
    course: DriverCourse

    def __repr__(self) -> str:
        """Short description, instead of every curve."""
        return f"Kinematics({len(self.curves)} curves at {self.q.size} positions over {self.over}, {self.condition!r})"

    _repr_html_ = notebook.html

    @property
    def axis(self) -> Array:
        """Values of the horizontal axis: q (rad or m) or t (s)."""
        return self.q if self.over == DRIVER or self.t is None else self.t

    @property
    def sliding(self) -> bool:
        """True if the driver slides."""
        return self.scene.sliding

    @cached_property
    def _survey(self) -> Survey:
        return survey(Moving(self.scene), self.course, self.over, tuple(self.curves))

    @property
    def ports(self) -> tuple[str, ...]:
        """Names of the curves that are ports of mechanisms, where loads may act."""
        ports: list[str] = []
        for mechanism in self.scene.mechanisms:
            names = [*(port.name for port in KINDS[mechanism.type].ports), *(output.name for output in mechanism.outputs)]
            if mechanism.linkage is not None:
                names = list(offered(mechanism.linkage, [port.name for port in mechanism.points]))
            full = [f"{mechanism.name}.{name}" for name in names]
            ports += [self.other_names.get(name, name) for name in full]
        return tuple(name for name in dict.fromkeys(ports) if name in self.curves)

    @property
    def breakpoints(self) -> Array:
        """Values on the axis at which a velocity or an acceleration jumps."""
        return self._survey.breakpoints

    @property
    def breakpoint_errors(self) -> Array:
        """Estimated absolute errors of the breakpoints."""
        return self._survey.breakpoint_errors

    @property
    def dead_centres(self) -> Mapping[str, Array]:
        """The places on the axis at which the velocity of a curve passes zero, by curve, within the whole motion."""
        return self._survey.dead_centres

    @property
    def dead_centre_errors(self) -> Mapping[str, Array]:
        """Estimated absolute errors of the dead centres."""
        return self._survey.dead_centre_errors

    @property
    def extremes(self) -> Mapping[str, tuple[CurveExtreme, ...]]:
        """The least and greatest position, velocity and acceleration within the whole motion, by curve."""
        return self._survey.extremes

    @property
    def remarks(self) -> tuple[str, ...]:
        """Remarks on the curves and their extremes."""
        return (*self.messages, *filter(None, [self._survey.message]))

    def __getitem__(self, name: str) -> MotionCurve:
        """The curve of a name; a SceneError with the nearest one if there is none."""
        return self.curves[chosen(name, self.curves, self.other_names)]


def chosen(name: str, curves: Mapping[str, object], other: Mapping[str, str]) -> str:
    """A curve's own name; a SceneError with the nearest name if there is none."""
    if name in curves:
        return name
    if name in other:
        return other[name]
    faults = name_faults("of", name, {**curves, **other})
    raise SceneError([fault._replace(expected=f"one of {', '.join(curves)}") for fault in faults])


# -- the motion of everything ------------------------------------------------------------------------------------------


@np.errstate(all="ignore")
def motion(
    machine: Machine | Scene,
    *,
    of: Sequence[str] = (),
    over: str | None = None,
    at: ArrayLike | None = None,
    points: int | None = None,
    speed: float | str | None = None,
    law: object = None,
    until: float | None = None,
    regime: bool = False,
    transient: Transient | Motion | None = None,
) -> Kinematics:
    """Position, velocity and acceleration of everything that moves in a machine, with estimated errors.

    Without `speed`, `law`, `regime` or `transient` they are per unit of the driver: x, g = dx/dq, g' = d²x/dq².

    Args:
        machine: a `Scene`, or a `Machine` of one.
        of: names of the selected curves; all if empty.
        over: "driver" or "time"; time of a law and of a transient, else the driver, if None.
        at: positions of the driver (rad, or m where it slides), or times (s) where it is over time.
        points: number of evenly spaced positions or times, in place of `at`; 361 if None.
        speed: constant speed of the driver, rad/s, or m/s where it slides; "scene": that of the scene, on a stroke with its
            acceleration.
        law: the driver's coordinate (rad or m) in time: an expression of `t`, the path of a CSV file with times and
            positions or a pair of such arrays (cubic spline), or a function of t that gives position, rate, acceleration.
        until: duration of a law, s.
        regime: True for the steady regime with the given or sized flywheel.
        transient: along a motion that `flywheel.transient` or `flywheel.simulate` followed.

    Raises:
        SceneError: for a name that does not exist, with the nearest; for a law that leaves the stroke, or locks, with the
            first instant; for a motion that is impossible.

    >>> import flywheel
    >>> press = {"type": "slider-crank", "crank": {"length": 1.0}, "rod": {"length": 2.0}}
    >>> scene = flywheel.load({"mechanism": press, "regime": {"speed": 1}, "flywheel": {"inertia": 1}})
    >>> slider = motion(scene, at=[np.pi / 2], speed=5.0)["slider"]
    >>> slider.position.round(6).tolist(), slider.velocity.round(9).tolist(), slider.acceleration.round(6).tolist()
    ([1.732051], [-5.0], [14.433757])

    """
    scene = scene_of(machine)
    if scene.areas is not None:
        raise SceneError([Fault("areas", "a diagram of areas", "a machine that moves", "give a mechanism instead")])
    if points is not None and points < 1:
        raise SceneError([Fault("points", brief(points), "a whole number, 1 or above")])
    course, axis = course_of(machine, over=over, speed=speed, law=law, until=until, regime=regime, transient=transient)
    if scene.compliances:
        course = course._replace(
            messages=(*course.messages, f"taken as rigid: {', '.join(scene.compliances)}, which twists")
        )
    moving = Moving(scene)
    driver = course.at(instants(course, axis, at, POINTS if points is None else points))
    curves, other = moving.curves(driver)
    names = list(dict.fromkeys(chosen(name, curves, other) for name in of)) or list(curves)
    return Kinematics(
        scene=scene,
        condition=course.condition,
        over=axis,
        t=driver.t,
        q=driver.q,
        rate=driver.rate,
        acceleration=driver.acceleration,
        curves={name: curves[name] for name in names},
        errors={name: error + 0.0 * driver.q for name, error in zip(DRIVERS, driver.errors, strict=True)},
        messages=course.messages,
        other_names=other,
        course=course,
    )


# -- extremes, dead centres and breakpoints ----------------------------------------------------------------------------

_QUANTITIES = ("position", "velocity", "acceleration")
_WIDEST = TURN / 8  # of a cell, in the angle of the fastest shaft: 21 nodes then resolve plain sines to rounding
_FEWEST, _SIZE = 16, 20_000_000  # cells; values of all curves at the nodes of all cells
_JUMP = 1e-6  # of the greatest value: least jump at a breakpoint
_INSIDE = 1e-6  # of half a cell: distance from its ends at which their errors are taken
_STILL = 1e-7  # of the greatest speed: greatest speed of a point that reverses


class Survey(NamedTuple):
    """Extremes and dead centres of curves over a whole motion, and their jumps."""

    breakpoints: Array
    breakpoint_errors: Array
    dead_centres: Mapping[str, Array]
    dead_centre_errors: Mapping[str, Array]
    extremes: Mapping[str, tuple[CurveExtreme, ...]]
    message: str


class _CurveRow(NamedTuple):
    """One function of the course's variable: which quantity and component of which curve (`total` squared)."""

    name: str
    order: int
    component: str


@np.errstate(all="ignore")
def survey(moving: Moving, course: DriverCourse, over: str, names: Sequence[str]) -> Survey:
    """Extremes, dead centres and breakpoints of curves over a whole course, by Chebyshev series on cells.

    Cells are halved until the series of all velocities and accelerations agree with them as closely as the course is smooth.
    """
    most = _SIZE // (cells.ORDER * 12 * max(len(names), 1))
    edges, close = _cell_edges(moving, course, most // 2)
    rows: list[_CurveRow] = []

    def values(mesh: cells.Cells) -> Array:
        values = moving.plain(course.at(mesh.phi.ravel()), names)
        table: list[Array] = []
        rows.clear()
        for name, parts in values.items():
            for order, part in enumerate(parts):
                components = (
                    {"": part} if part.ndim == 1 else {"x": part[0], "y": part[1], "total": part[0] ** 2 + part[1] ** 2}
                )
                for component, column in components.items():
                    if order or component != "total":
                        rows.append(_CurveRow(name, order, component))
                        table.append(column.reshape(mesh.phi.shape))
        return np.array(table)

    def evaluate(edges: Array) -> tuple[tuple[cells.Cells, Array], float, cells.Coarse]:
        mesh = cells.cells(edges)
        series = cells.fit(values(mesh))
        scale = np.abs(series).sum(axis=-1).max(axis=-1)[:, None]
        size = {name: max(scale[k, 0] for k, row in enumerate(rows) if row.name == name) for name in names}
        scale = np.maximum(scale, np.array([[1e-9 * size[row.name]] for row in rows]))
        share = np.where(scale > 0.0, cells.tails(series) / np.maximum(scale, 1e-300), 0.0).max(axis=0)
        return (mesh, series), float(share.max()), lambda least: share > least * share.max()

    mesh, series = cells.refined(edges, evaluate, course.exactly, most)
    tail = cells.tails(series)
    scale = np.abs(series).sum(axis=-1).max(axis=-1)
    inside = mesh.middle + (1.0 - _INSIDE) * mesh.half * np.array([-1.0, 1.0])  # at a jump itself either side may be meant
    curves = moving.curves(course.at(inside.ravel()))[0]
    noise = np.array([_noise(curves[row.name], row) for row in rows])
    level = np.maximum(noise[:, None], tail)
    breaks = _jumps(mesh, series, rows, scale, noise)
    centres = _dead_centres(course, mesh, series, rows, scale, level)
    return Survey(
        breakpoints=_axis(course, over, breaks),
        breakpoint_errors=_axis_errors(course, over, breaks, _break_errors(course, breaks)),
        dead_centres={name: _axis(course, over, at) for name, (at, _) in centres.items()},
        dead_centre_errors={name: _axis_errors(course, over, at, off) for name, (at, off) in centres.items()},
        extremes=_extremes(moving, course, over, mesh, series, rows, level),
        message=""
        if close
        else "too many turns for reliable extremes and dead centres: choose fewer curves, or a part of the motion",
    )


def _component(vector: Array, component: str) -> Array:
    """A component of a curve's array: the array itself, x, y, or the amount of both."""
    return vector if component == "" else amount(vector) if component == "total" else vector["xy".index(component)]


def _noise(curve: MotionCurve, row: _CurveRow) -> float:
    """Accuracy of a function's values at the edges of cells, where it is least."""
    error = _component(curve.errors[row.order], row.component)
    if row.component == "total":
        value = amount((curve.position, curve.velocity, curve.acceleration)[row.order])
        return float((2 * value * error + error**2).max())
    return float(error.max())


def _cell_edges(moving: Moving, course: DriverCourse, most: int) -> tuple[Array, bool]:
    """Edges of the first cells over a course: its and the mechanisms' switches, and between; True if close enough."""
    scene = moving.scene
    fastest = max(1.0, *map(abs, scene.shafts.values())) if scene.stroke is None else 1.0
    grid = np.linspace(course.start, course.end, 2001)
    q = course.at(grid).q
    inner = moving.edges + scene.origin
    if scene.stroke is None:
        turns = np.arange(np.floor(q.min() / scene.cycle), np.ceil(q.max() / scene.cycle) + 1) * scene.cycle
        inner = np.unique((moving.edges[:-1] + turns[:, None]).ravel()) if inner.size > 2 else np.array([])
    passed = [v for v, _ in course.passages(inner)] if inner.size else []
    edges = np.unique([course.start, *course.edges, *passed, course.end])
    edges = edges[(edges >= course.start) & (edges <= course.end)]
    edges = edges[np.append(True, np.diff(edges) > 1e-12 * (course.end - course.start))]
    edges[-1] = course.end
    path = float(np.abs(np.diff(q)).sum()) * fastest
    count = _FEWEST if scene.stroke is not None else max(_FEWEST, int(np.ceil(path / _WIDEST)))
    close, count = count <= most, min(count, most)
    even = np.linspace(course.start, course.end, count + 1)
    near = np.abs(even[:, None] - edges[None, :]).min(axis=1) > 0.1 * (even[1] - even[0])
    return np.sort(np.concatenate((edges, even[near]))), close


def _axis(course: DriverCourse, over: str, variable: Array) -> Array:
    """Values of a course's variable as places on the axis."""
    return variable if over == course.variable or not variable.size else course.at(variable).q


def _jumps(mesh: cells.Cells, series: Array, rows: Sequence[_CurveRow], scale: Array, noise: Array) -> Array:
    """Edges at which a velocity or an acceleration jumps."""
    chosen = [k for k, row in enumerate(rows) if row.order and row.component != "total" and scale[k] > 100 * noise[k]]
    if not chosen:
        return np.array([])
    rows_of = series[chosen]
    left, right = (
        np.moveaxis(rows_of, -1, 0) * np.reshape(side ** np.arange(series.shape[-1]), (-1, 1, 1)) for side in (1.0, -1.0)
    )
    gap = np.abs(right.sum(axis=0)[:, 1:] - left.sum(axis=0)[:, :-1])
    jumps = (gap > _JUMP * scale[chosen][:, None]).any(axis=0)
    return np.asarray(mesh.edges[1:-1][jumps])


def _axis_errors(course: DriverCourse, over: str, at: Array, off: Array) -> Array:
    """Errors on the axis from errors of the variable; for a motion in time on the driver's axis, those of its position."""
    if over == course.variable or not at.size:
        return off
    driver = course.at(at)
    assert driver.rate is not None
    return np.asarray(off * np.abs(driver.rate) + driver.errors[1])


def _break_errors(course: DriverCourse, breaks: Array) -> Array:
    """Errors of breakpoints: rounding, and in time the driver's delay if its position is not more accurate."""
    rounding = np.full(breaks.size, 64 * ROUNDING * max(abs(course.start), abs(course.end)))
    if course.variable == DRIVER or not breaks.size:
        return rounding
    driver = course.at(breaks)
    assert driver.rate is not None
    assert driver.acceleration is not None
    off = driver.errors[1] + 0.0 * breaks
    late = np.minimum(
        off / np.maximum(np.abs(driver.rate), 1e-300), np.sqrt(2 * off / np.maximum(np.abs(driver.acceleration), 1e-300))
    )
    return np.asarray(rounding + np.minimum(late, course.end - course.start))


def _dead_centres(
    course: DriverCourse, mesh: cells.Cells, series: Array, rows: Sequence[_CurveRow], scale: Array, level: Array
) -> dict[str, tuple[Array, Array]]:
    """Values of the course's variable at which velocities pass zero, with errors: of a point both components at once."""
    names = list(dict.fromkeys(row.name for row in rows))
    mine = [[k for k, row in enumerate(rows) if row[:2] == (name, 1) and row.component != "total"] for name in names]
    first = [max(of, key=lambda k: float(scale[k])) for of in mine]
    crossed = cells.crossings(series[first], level[first])
    dead_centres = {}
    for n, (name, of, k) in enumerate(zip(names, mine, first, strict=True)):
        here = (crossed.function == n) & (scale[k] > 10 * level[k].min())
        for other in of:
            slow = (
                np.abs(cells.value(series[other][crossed.cell], crossed.t)) <= _STILL * scale[k] + level[other][crossed.cell]
            )
            here &= slow
        cell, t = crossed.cell[here], crossed.t[here]
        at = crossed._replace(cell=cell, t=t).angles(mesh)
        steep = np.abs(cells.slope(series[k][cell], t)) / mesh.half[cell, 0]
        off = np.minimum(2 * level[k][cell] / np.maximum(steep, 1e-300), 2 * mesh.half[cell, 0])
        if course.cyclic and scale[k] > 10 * level[k].min() and _turns_at_seam(series[of], level[of]):
            steepness = abs(float(cells.slope(series[k][:1], np.array([-1.0]))[0])) / float(mesh.half[0, 0])
            at, off = np.append(course.start, at), np.append(2 * level[k][0] / max(steepness, 1e-300), off)
        dead_centres[name] = at, off
    return dead_centres


def _turns_at_seam(series: Array, level: Array) -> bool:
    """Tests whether velocities pass zero at the end of the cycle."""
    ends = [
        cells.value(series[:, cell], np.full(len(series), t)) for cell, t in ((0, -1.0), (-1, 1.0), (0, -0.9), (-1, 0.9))
    ]
    still = (np.abs(ends[0]) <= 10 * level[:, 0]) & (np.abs(ends[1]) <= 10 * level[:, -1])
    return bool(still.all() and (ends[2] * ends[3] < 0.0).any())


def _turning_points(mesh: cells.Cells, series: Array, level: Array) -> tuple[Any, ...]:
    """Ends of cells and zeros of slopes, in the cells whose terms may exceed the values at the ends of all cells.

    Of each its row, the variable and its share t of a cell, the value, half the cell, the second derivative, and the error
    of the position for a series with an error of its level.
    """
    left, right = (series * (-1.0) ** np.arange(series.shape[-1])).sum(axis=-1), series.sum(axis=-1)
    reach = np.abs(series[..., 1:]).sum(axis=-1)
    reach += 64 * ROUNDING * (reach + np.abs(series[..., 0]))  # all of a cell's terms may add up at its end
    candidates = series[..., 0] + reach >= np.maximum(left, right).max(axis=1, keepdims=True)
    candidates |= series[..., 0] - reach <= np.minimum(left, right).min(axis=1, keepdims=True)
    steady = np.ptp(np.concatenate((left, right), axis=1), axis=1) + reach.max(axis=1) <= 4 * level.max(axis=1)
    candidates[steady] = np.arange(series.shape[1]) == 0  # what never changes has its extremes anywhere
    row, cell = np.nonzero(candidates)
    slopes = cells.derivative(series[row, cell])
    crossed = cells.crossings(slopes[:, None, :], 64 * ROUNDING * np.abs(slopes).sum(axis=-1)[:, None])
    row, cell = (np.concatenate((of, of, of[crossed.function])) for of in (row, cell))
    t = np.concatenate((np.full(len(slopes), -1.0), np.full(len(slopes), 1.0), crossed.t))
    half, slope, noise = mesh.half[cell, 0], cells.derivative(series[row, cell]), level[row, cell]
    steep, bend = np.abs(cells.value(slope, t)) / half, np.abs(cells.slope(slope, t)) / half**2
    off = 2 * noise / np.maximum(bend, 1e-300)  # a polynomial's slope is off by at most (degree²/half) of its error
    wide = np.minimum(np.minimum(np.sqrt(4 * off), cells.ORDER**2 * off / half), 2 * half)
    wide = np.where((np.abs(t) == 1.0) & (steep * wide > 8 * noise), 0.0, wide)  # it runs on beyond its cell
    return row, mesh.middle[cell, 0] + half * t, t, cells.value(series[row, cell], t), half, bend, wide


def _extremes(
    moving: Moving,
    course: DriverCourse,
    over: str,
    mesh: cells.Cells,
    series: Array,
    rows: Sequence[_CurveRow],
    level: Array,
) -> dict[str, tuple[CurveExtreme, ...]]:
    """Least and greatest values: at the ends of cells, or where their slope is zero, in cells that may hold them."""
    row, where, t, extreme_values, half, bend, wide = _turning_points(mesh, series, level)
    places: list[tuple[int, str, float, float, float, float, float]] = []  # row, which, variable, value, errors, inside
    for k in range(len(rows)):
        mine = np.flatnonzero(row == k)
        for which, sense in (("least", -1.0), ("greatest", 1.0)):
            values = sense * extreme_values[mine]
            near = mine[values >= values.max() - 64 * ROUNDING * np.abs(values).max()]
            best = near[where[near].argmin()]  # the first of equal ones
            short = 0.5 * bend[best] * wide[best] ** 2
            inner = where[best] - np.trunc(t[best]) * _INSIDE * half[best]
            place, value, width = float(where[best]), float(extreme_values[best]), float(wide[best])
            places.append((k, which, place, value, width, float(short), float(inner)))
    variable = np.clip(np.array([place[2] for place in places]), course.start, course.end)
    driver = course.at(variable)
    exact, axis = moving.curves(driver)[0], _axis(course, over, variable)
    inside = moving.curves(course.at(np.clip([place[6] for place in places], course.start, course.end)))[0]
    by_name: dict[str, list[CurveExtreme]] = {}
    for n, (k, which, _, value, width, short, _) in enumerate(places):
        name, order, component = rows[k]
        curve = exact[name]
        quantity, error = (curve.position, curve.velocity, curve.acceleration)[order], inside[name].errors[order]
        now, off = float(_component(quantity, component)[n]), float(_component(error, component)[n])
        if component == "total":  # its square was looked at
            value, short = float(np.sqrt(max(value, 0.0))), short / max(2 * now, float(np.sqrt(short)), 1e-300)
        power = 0.5 if component == "total" else 1.0
        size, noise = (float(of) ** power for of in (np.abs(series[k]).sum(axis=-1).max(), level[k].max()))
        if abs(now - value) > _JUMP * size + 4 * noise:  # before a jump
            now, off = value, off + noise
        if over != course.variable and driver.rate is not None:
            width = width * abs(float(driver.rate[n])) + float(np.broadcast_to(driver.errors[1], variable.shape)[n])
        by_name.setdefault(name, []).append(
            CurveExtreme(_QUANTITIES[order], component, which, now, float(axis[n]), off + short, width)
        )
    return {name: tuple(extremes) for name, extremes in by_name.items()}
