"""Motion of a machine's driver: per unit, at constant speed, in the steady regime, along a transient, by a law of time.

Each gives a `DriverCourse`: position, rate and acceleration of the driver over its coordinate or over time, with errors.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.numerics import roots_between
from flywheel.machine.machine import Machine, scene_of
from flywheel.machine.reactions import solution_of
from flywheel.mechanisms.law import FormulaCurve
from flywheel.motions.motion import DRIVER as DRIVER
from flywheel.motions.motion import TIME as TIME
from flywheel.motions.motion import DriverMotion, Motion, Transient, sampled, scales_of, steady_motion, switching, time_along
from flywheel.numerics.cells import ROUNDING
from flywheel.numerics.expressions import Expression, ExpressionError, parse, renamed
from flywheel.numerics.faults import POSITIVE, Fault, SceneError, array, brief, coordinate_text, number_faults, refuse, show
from flywheel.numerics.intervals import NAMESPACE, Interval
from flywheel.numerics.jets import Jet, jet_namespace
from flywheel.numerics.switching import SwitchingError, breakpoints, resolved, roots_in_pieces
from flywheel.numerics.units import (
    QuantityError,
    Unit,
    convert,
    figure,
    parse_quantity,
    parse_range,
    parse_unit,
    round_speed,
)
from flywheel.reading.fields import Faults
from flywheel.reading.scenes import build_scene, load
from flywheel.reading.tables import read_columns
from flywheel.regime import state
from flywheel.scene.scene import Scene
from flywheel.sizing.findings import speed_error_over_cycle
from flywheel.sizing.sizing import size

Array = NDArray[np.float64]

UNSURE = state.ROUNDINGS * ROUNDING


class DriverCourse(NamedTuple):
    """Course of the driver: `at` gives it at values of a variable, its coordinate or time, from `start` to `end`.

    Between `edges` (values of the variable) it moves smoothly. `exactly` is the relative smoothness of its curves;
    `cyclic` is true if it restarts at its end.
    """

    condition: str
    variable: str
    start: float
    end: float
    at: Callable[[Array], DriverMotion]
    edges: tuple[float, ...] = ()
    messages: tuple[str, ...] = ()
    exactly: float = 1e-10
    cyclic: bool = False

    def passages(self, positions: Array, pieces: int = 4000) -> list[tuple[float, float]]:
        """Passages of the driver through positions: pairs of the variable and the position, in the order of the variable."""
        grid = np.unique(np.concatenate((np.linspace(self.start, self.end, pieces + 1), self.edges)))
        if self.variable == DRIVER:
            return [(float(q), float(q)) for q in positions if self.start <= q <= self.end]
        q = self.at(grid).q
        low, high = np.minimum(q[:-1], q[1:]), np.maximum(q[:-1], q[1:])
        indices = [(k, position) for position in positions for k in np.flatnonzero((low <= position) & (position < high))]
        at_end = [(self.end, float(position)) for position in positions if position == q[-1]]
        if not indices:
            return at_end
        cell, target = np.array([k for k, _ in indices]), np.array([position for _, position in indices])
        places = roots_between(lambda at: self.at(at).q - target, grid[cell], grid[cell + 1])
        pairs = zip(places.tolist(), target.tolist(), strict=True)
        return sorted([*pairs, *at_end])


def per_unit(scene: Scene) -> DriverCourse:
    """The driver's coordinate itself, through the cycle or along the stroke."""
    return DriverCourse(
        "per unit of the driver", DRIVER, scene.origin, scene.origin + scene.cycle, DriverMotion, cyclic=scene.stroke is None
    )


def constant_speed(scene: Scene, speed: float | str, over: str) -> DriverCourse:
    """A constant speed (rad/s or m/s; "scene": the scene's own), through a cycle or along the stroke, from either end."""
    stroke, acceleration = scene.stroke, 0.0
    if speed == "scene":
        setting = scene.speed if stroke is None else stroke.speed
        if setting is None:
            raise SceneError([Fault("speed", "a scene without a speed", "a speed", 'give one, such as "60 rpm"')])
        speed, acceleration = setting, 0.0 if stroke is None else stroke.acceleration
    refuse(number_faults("speed", speed))
    speed = float(speed)
    if speed == 0.0:
        raise SceneError([Fault("speed", "0", "a speed that is not 0", "leave it out for curves per unit of the driver")])
    ends = scene.origin, scene.origin + scene.cycle
    first = ends[0] if speed > 0.0 or (stroke is None and over == TIME) else ends[1]

    def at(q: Array, t: Array | None) -> DriverMotion:
        if t is None:
            return DriverMotion(q, None, np.full(q.size, speed), np.full(q.size, acceleration))
        off = 4 * ROUNDING * (np.abs(t) + abs(first / speed))
        return DriverMotion(q, t, np.full(q.size, speed), np.zeros(q.size), (off, off * abs(speed), 0.0, 0.0))

    condition = f"at {_speed(scene, speed)}"
    if acceleration:
        condition += f" and {figure(acceleration)} {'m/s^2' if scene.reduction_element == 'slide' else 'rad/s^2'}"
        if over == TIME:
            defect = "time with a speed and an acceleration that hold at every position"
            raise SceneError([Fault("over", defect, "the driver", "give a law of time")])
        return DriverCourse(condition, DRIVER, scene.origin, scene.origin + scene.cycle, lambda q: at(q, None))
    if over == TIME:
        return DriverCourse(
            condition, TIME, 0.0, abs(scene.cycle / speed), lambda t: at(first + speed * t, t), cyclic=stroke is None
        )
    return DriverCourse(
        condition,
        DRIVER,
        scene.origin,
        scene.origin + scene.cycle,
        lambda q: at(q, (q - first) / speed),
        cyclic=stroke is None,
    )


def _speed(scene: Scene, speed: float) -> str:
    if scene.sliding:
        return f"{figure(speed)} m/s"
    return round_speed(speed)


# -- the steady regime -------------------------------------------------------------------------------------------------

_INVERTED = 1440  # angles between which the time along the cycle is inverted by Newton's method


def steady(machine: Machine, over: str) -> DriverCourse:
    """The steady regime with the scene's flywheel, given or sized, through one cycle."""
    scene = machine.scene
    if scene.stroke is not None:
        raise SceneError(
            [
                Fault(
                    "regime",
                    "a stroke, which has no steady regime",
                    "a cycle",
                    'give --speed scene or --law (in Python speed="scene" or law=)',
                )
            ]
        )
    sizing = size(machine, simulate=False)
    wheel, cycle = sizing.inertia, scene.cycle
    steadily = sizing.cycle is not None and sizing.run is not None

    def time(q: Array) -> Array:
        return time_along(sizing, q) if steadily else q / sizing.speed

    period = float(time(np.array([cycle]))[0])
    share = speed_error_over_cycle(sizing) + 0.1 * sizing.rtol + UNSURE

    def along(q: Array, t: Array, late: Array) -> DriverMotion:
        """Returns the motion at angles q, which the driver passes at times t, with an error `late` of these."""
        turned = q - np.floor(q / cycle) * cycle
        steady_values, (off, slower) = steady_motion(machine, sizing, turned)
        error, speeding = late * np.abs(steady_values.omega), 0.0 * q
        if late.any():  # what the angle's error makes of the acceleration
            for side in (-1.0, 1.0):
                beside = steady_motion(machine, sizing, (turned + side * error) % cycle)[0].alpha
                speeding = np.maximum(speeding, np.abs(beside - steady_values.alpha))
        return DriverMotion(
            q,
            t,
            steady_values.omega,
            steady_values.alpha,
            (share * np.abs(t) + 4 * ROUNDING * period, error, off + np.abs(steady_values.alpha) * late, slower + speeding),
        )

    condition = f"steady regime at {_speed(scene, sizing.speed)}"
    if wheel is not None:
        condition += f" with a flywheel of {figure(wheel)} kg m^2" + (
            "" if scene.inertia is not None else ", as it is sized"
        )
    edges = np.asarray(machine.breakpoints)
    if over == DRIVER:
        return DriverCourse(
            condition,
            DRIVER,
            0.0,
            cycle,
            lambda q: along(q, time(q), 0.0 * q),
            tuple(edges.tolist()),
            exactly=1e-9,
            cyclic=True,
        )
    table = np.linspace(0.0, cycle, _INVERTED + 1)
    times = time(table)

    def at(t: Array) -> DriverMotion:
        turns = np.floor(t / period)
        left = t - turns * period
        q = np.interp(left, times, table)
        for _ in range(4):
            q = q - (time(q) - left) * steady_motion(machine, sizing, q % cycle)[0].omega
        return along(q + turns * cycle, t, share * np.abs(t) + 4 * ROUNDING * period)

    return DriverCourse(condition, TIME, 0.0, period, at, tuple(time(edges).tolist()), exactly=1e-9, cyclic=True)


# -- a transient -------------------------------------------------------------------------------------------------------


def along_transient(scene: Scene, source: Transient | Motion) -> DriverCourse:
    """A motion that `flywheel.transient` or `flywheel.simulate` followed, with its own estimated error."""
    motion = source.motion if isinstance(source, Transient) else source
    trail = motion.trail
    if trail is None:
        defect = "a motion of a machine with compliant shafts"
        raise SceneError(
            [Fault("transient", defect, "one with rigid shafts", "its own `run` holds the motion of every shaft")]
        )
    other = trail.dynamics.machine.scene
    if (other.mechanisms, other.shafts, other.stroke) != (scene.mechanisms, scene.shafts, scene.stroke):
        raise SceneError([Fault("transient", "the motion of another machine", "one of this scene")])
    rough = trail if motion.rough is None or not motion.rough.stretches else motion.rough
    origin = scene.origin
    way, fastest = scales_of(motion.phi, motion.omega, scene)
    last = float(motion.t[-1])

    def at(t: Array) -> DriverMotion:
        _within(t, 0.0, last)
        t = np.clip(t, 0.0, last)
        now = sampled(trail, t)
        before = sampled(rough, np.minimum(t, rough.t[-1])).acceleration
        least = 2 * motion.error * float(np.abs(now.acceleration).max(initial=0.0))
        q = now.phi + origin
        q = q if scene.stroke is None else np.clip(q, scene.stroke.start, scene.stroke.end)
        off = motion.share * np.abs(now.acceleration - before) + least
        error = np.full(t.size, motion.error)
        return DriverMotion(q, t, now.omega, now.acceleration, (0.0 * t, error * way, error * fastest, off))

    ended = source.ended if isinstance(source, Transient) else motion.ended
    place, pace = (
        coordinate_text(float(motion.phi[0]), scene.reduction_element == "slide"),
        _speed(scene, float(motion.omega[0])),
    )
    edges = np.unique(switching(trail)[0])
    return DriverCourse(
        f"from {place}, {pace}: {ended or f'followed for {figure(last)} s'}",
        TIME,
        0.0,
        last,
        at,
        tuple(edges[(edges > 0.0) & (edges < last)].tolist()),
        exactly=max(1e-9, motion.error),
    )


def _within(t: Array, low: float, high: float) -> None:
    """Refuses times outside a motion."""
    slack = 1e-12 * max(abs(low), abs(high))
    outside = (t < low - slack) | (t > high + slack)
    if outside.any():
        raise SceneError([Fault("at", f"{t[outside][0]:.9g} s", f"a time within the motion, {low:.9g} s to {high:.9g} s")])


# -- a law of time -----------------------------------------------------------------------------------------------------

_NODES = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 17))
_DIGITS = 9
_JUMP = 1e-9  # of the range: less is rounding
_CORNER = 1e-7  # of the greatest rate
_FEWEST = 4  # rows of a table
_PROBED = 32


class _PositionLaw(NamedTuple):
    """A position in time, with two derivatives by the formula that holds at an anchor, smooth between edges.

    `passes` gives the times at which it has a value.
    """

    words: str
    jet: Callable[[Array, Array], tuple[Array, Array, Array]]
    edges: Array
    breaks: tuple[float, ...]
    passes: Callable[[float], Array]


def imposed(
    scene: Scene, law: object, until: float | None, limits: Mapping[str, tuple[float, float]] | None = None
) -> DriverCourse:
    """A driver that is moved by a law of time.

    Args:
        scene: whose driver it is; its parameters may stand in an expression.
        law: an expression of `t` (its value the driver's coordinate, rad or m), the path of a CSV file with times and
            positions, a pair of such arrays, or a function of t that gives position, rate and acceleration.
        until: duration (s); of a table its last time, if None.
        limits: coordinates that the driver may not pass (rad or m), by their description.

    Raises:
        SceneError: for a law that is not finite, or that jumps; for one that passes a limit, with the first instant.

    """
    if until is not None:
        refuse(number_faults("until", until, POSITIVE))
    imposed_law = _law_of(scene, law, until)
    edges = imposed_law.edges
    low, high = edges[:-1, None], edges[1:, None]
    nodes = low + (high - low) * _NODES
    nodes[:, -1] = edges[1:]
    anchor = np.broadcast_to(0.5 * (low + high), nodes.shape)
    values = [np.broadcast_to(part, nodes.shape) for part in imposed_law.jet(nodes, anchor)]
    for what, part in zip(("whose position", "whose rate", "whose acceleration"), values, strict=True):
        if not np.isfinite(part).all():
            t = float(nodes[~np.isfinite(part)][0])
            where = f"{imposed_law.words}, {what} is not finite at t = {t:.{_DIGITS}g} s"
            raise SceneError([Fault("law", where, "a law with a finite position, rate and acceleration")])
    q, rate, _ = values
    scale = max(float(np.ptp(q)), UNSURE * float(np.abs(q).max()), 1e-300)
    jumps = np.abs(q[1:, 0] - q[:-1, -1])
    if (jumps > _JUMP * scale).any():
        worst = int(np.argmax(jumps > _JUMP * scale))
        unit = "m" if scene.sliding else "rad"
        where = f"{imposed_law.words}, which jumps by {jumps[worst]:.6g} {unit} at t = {edges[worst + 1]:.{_DIGITS}g} s"
        raise SceneError([Fault("law", where, "a law whose position does not jump")])
    corners = np.abs(rate[1:, 0] - rate[:-1, -1]) > _CORNER * float(np.abs(rate).max())
    messages = [
        f"the driver's speed jumps at t = {t:.{_DIGITS}g} s: an acceleration without end there" for t in edges[1:-1][corners]
    ]
    stroke = scene.stroke
    ends = {} if stroke is None else {"out of its stroke": (min(stroke.start, stroke.end), max(stroke.start, stroke.end))}
    _check_limits(scene, imposed_law, {**ends, **(limits or {})})
    first, last = float(edges[0]), float(edges[-1])
    size = [float(np.abs(part).max()) for part in values]

    def at(t: Array) -> DriverMotion:
        _within(t, first, last)
        t = np.clip(t, first, last)
        place = np.clip(np.searchsorted(edges, t, side="right") - 1, 0, edges.size - 2)
        middle = 0.5 * (edges[place] + edges[place + 1])
        parts = [part + 0.0 * t for part in imposed_law.jet(t, middle)]
        aside = 16 * ROUNDING * max(abs(first), abs(last)) * np.where(middle < t, -1.0, 1.0)
        others = [imposed_law.jet(t + share * aside, middle) for share in (1.0, 0.4)]
        errors = [state.spread(part, [other[k] for other in others]) + UNSURE * size[k] for k, part in enumerate(parts)]
        return DriverMotion(parts[0], t, parts[1], parts[2], (0.0 * t, *errors))

    edge = tuple(edges[1:-1].tolist())
    return DriverCourse(f"imposed: {imposed_law.words}", TIME, first, last, at, edge, tuple(messages))


def scene_moved(path: Path, law: object, until: float | None) -> Scene:
    """The scene in a file for a motion by a law of time: the mechanism needs to move only as far as the law goes.

    Raises:
        SceneError: of the scene; for a law that drives its mechanism into a lock, with the first instant.

    """
    import tomllib

    try:
        return load(path)
    except SceneError as error:
        failed = error
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8-sig"))
        kept: dict[str, Any] = {
            name: tables[name] for name in ("title", "source", "parameters", "shafts", "mechanism") if name in tables
        }
        numbers = {name: parse_range(value, None) for name, value in tables.get("parameters", {}).items()}
        course = imposed(Scene(None, parameters=numbers), law, until)
    except (OSError, ValueError, AttributeError):
        raise failed from None
    if "stroke" in tables:
        raise failed
    q = course.at(np.unique(np.concatenate((np.linspace(course.start, course.end, 4001), course.edges)))).q
    first, room = float(q[0]), 1e-6 * float(np.ptp(q)) + 1e-12
    least, most = float(q.min()) - room, float(q.max()) + room
    limits = [-np.inf, np.inf]
    for k, ends in enumerate(((first - room, first + room), (least, first), (first, most))):
        try:
            for mechanism in build_scene({**kept, "stroke": {"from": ends[0], "to": ends[1]}}, path.parent).mechanisms:
                solution_of(mechanism)
        except SceneError as error:
            locks = [lock for fault in error.faults for lock in fault.locks]
            if not locks or not k:  # it cannot even be put together where the law begins
                raise failed from None
            limits[k - 1] = max(locks) if k == 1 else min(locks)
    if np.isfinite(limits).any():
        imposed(Scene(None, parameters=numbers), law, until, {"into a lock": (limits[0], limits[1])})
    return build_scene({**kept, "stroke": {"from": least, "to": most}}, path.parent, path)


def _check_limits(scene: Scene, law: _PositionLaw, limits: Mapping[str, tuple[float, float]]) -> None:
    """A SceneError with the first instant at which a law passes a limit."""
    first, last = float(law.edges[0]), float(law.edges[-1])
    faults: list[tuple[float, Fault]] = []
    sliding = scene.sliding
    for what, (low, high) in limits.items():
        for end, sense in ((low, -1.0), (high, 1.0)):
            if not np.isfinite(end):
                continue
            slack = 1e-12 * max(abs(end), high - low if np.isfinite(high - low) else 1.0)
            passed = law.passes(end + sense * slack)
            times = np.unique(np.concatenate(([first], passed[(passed > first) & (passed < last)], [last])))
            middles = 0.5 * (times[1:] + times[:-1])
            place = np.clip(np.searchsorted(law.edges, middles, side="right") - 1, 0, law.edges.size - 2)
            q = law.jet(middles, 0.5 * (law.edges[place] + law.edges[place + 1]))[0] + 0.0 * middles
            beyond = sense * (q - end) > slack
            if beyond.any():
                t = float(times[int(np.argmax(beyond))])
                t = max((float(one) for one in law.passes(end) if one <= t), default=t)  # without the slack
                defect = f"{law.words}, which drives the machine {what} at t = {t:.{_DIGITS}g} s, "
                defect += f"above {coordinate_text(end, sliding)}" if sense > 0 else f"below {coordinate_text(end, sliding)}"
                expected = f"a law from {coordinate_text(low, sliding)} to {coordinate_text(high, sliding)}"
                if not np.isfinite(low):
                    expected = f"a law below {coordinate_text(high, sliding)}"
                elif not np.isfinite(high):
                    expected = f"a law above {coordinate_text(low, sliding)}"
                faults.append((t, Fault("law", defect, expected)))
    if faults:
        raise SceneError([min(faults, key=lambda one: one[0])[1]])


def _law_of(scene: Scene, law: object, until: float | None) -> _PositionLaw:
    if isinstance(law, Path) or (isinstance(law, str) and law.strip().lower().endswith(".csv")):
        # times (s) and positions (rad or m) of a CSV file, in the units that its header has in brackets
        path = Path(law)
        if not path.is_file():
            raise SceneError([Fault("law", f"no file {show(str(path))}", "a CSV file with times and positions")])
        faults = Faults()
        columns = read_columns(path.name, None, path.parent, "law", faults)
        if columns is None:
            raise SceneError(list(faults))
        position = "length" if scene.sliding else "angle"
        with path.open(encoding="utf-8-sig") as stream:
            head = next((line for line in stream if line.strip() and not line.lstrip().startswith("#")), "")
        units = [_UNIT.search(name) for name in (*re.split(r"[,;\t]", head), "")[:2]]
        try:
            parts = [
                parse_unit(unit[1] or unit[2], what) if unit else Unit()
                for unit, what in zip(units, ("time", position), strict=True)
            ]
        except QuantityError as error:
            raise SceneError([Fault("law", error.defect, error.expected, f"in the header of {path.name}")]) from None
        time_rows, path_rows = (
            np.array([convert(number, unit) for number in column]) for column, unit in zip(columns, parts, strict=True)
        )
        return _table(scene, time_rows, path_rows, until, f"the table {Path(law).name}")
    if isinstance(law, str):
        return _formula(scene, law, _needed(until))
    if callable(law):
        return _function(law, _needed(until))
    if isinstance(law, Sequence | np.ndarray) and len(law) == 2:
        times, positions = (array("law", column).ravel() for column in law)
        return _table(scene, times, positions, until, "a table")
    expected = "an expression of t, a CSV file, a pair of times and positions, or a function of t"
    raise SceneError([Fault("law", brief(law), expected)])


def _needed(until: float | None) -> float:
    if until is None:
        raise SceneError([Fault("until", "a law without an end", "how long it lasts", 'such as until=2 or --until "2 s"')])
    return float(until)


def _formula(scene: Scene, text: str, until: float) -> _PositionLaw:
    """A law by an expression of t and the scene's parameters."""
    dimension = "velocity" if scene.sliding else "speed"
    try:
        parse_quantity(text, dimension)
    except QuantityError:
        pass
    else:
        if re.search(r"[^\d.eE+\-\s]", text):
            raise SceneError(
                [Fault("law", f"{show(text)}, a speed", "a position as an expression of t", "give it as speed")]
            )
    try:
        formula = parse(text, frozenset(scene.parameters))
    except ExpressionError as error:
        raise SceneError([Fault("law", error.defect, error.expected, error.advice)]) from None
    if foreign := sorted(formula.names - {"t", *scene.parameters}):
        raise SceneError([Fault("law", f"an expression of {', '.join(foreign)}", "one of t and the scene's parameters")])
    law = Expression(text, renamed(formula.tree, "t", "phi"))
    curve = FormulaCurve(law, scene.parameters)
    constants = dict(scene.parameters)

    def enclosed(lo: Array, hi: Array, anchor: Array) -> Mapping[str, Any]:
        return {**constants, "phi": Jet(Interval(lo, hi), 1.0)}

    def valued(t: Array, anchor: Array) -> Mapping[str, Any]:
        return {**constants, "phi": t}

    def jet(t: Array, anchor: Array) -> tuple[Array, Array, Array]:
        derivatives = curve.jet(t, anchor, np)
        return derivatives.value + 0.0 * t, derivatives.first + 0.0 * t, derivatives.second + 0.0 * t

    try:
        breaks = breakpoints(law, 0.0, until, enclosed, valued)
        edges = np.array([0.0, *breaks, until])
        edges = np.unique(np.concatenate((edges, resolved(law, edges[:-1], edges[1:], enclosed, valued))))
    except SwitchingError as error:
        in_time = re.sub(r"\bphi\b", "t", str(error))
        raise SceneError([Fault("law", in_time, f"a law that can be followed to {until:g} s")]) from None

    def passes(end: float) -> Array:
        def enclose(lo: Array, hi: Array, anchor: Array) -> tuple[Any, Any]:
            bounds = law.evaluate(enclosed(lo, hi, anchor), _JETS, valued(anchor, anchor))
            return (bounds.value - end, bounds.first) if isinstance(bounds, Jet) else (bounds - end, 0.0)

        return roots_in_pieces(enclose, lambda t, anchor: jet(t, anchor)[0] - end, edges)

    return _PositionLaw(text.strip(), jet, edges, tuple(breaks), passes)


_JETS = jet_namespace(NAMESPACE)


def _table(scene: Scene, times: Array, positions: Array, until: float | None, words: str) -> _PositionLaw:
    """A law by the cubic spline through a table (C², not periodic, not-a-knot ends)."""
    from scipy.interpolate import CubicSpline  # only a table needs it

    if times.size != positions.size:
        size = f"{times.size} times and {positions.size} positions"
        raise SceneError([Fault("law", size, "the same number of both")])
    if times.size < _FEWEST:
        raise SceneError([Fault("law", f"{words} of {times.size} rows", f"{_FEWEST} rows at least")])
    falling = np.flatnonzero(np.diff(times) <= 0.0)
    if falling.size:
        k = int(falling[0])
        raise SceneError([Fault("law", f"{times[k + 1]:g} s after {times[k]:g} s", "times that ascend")])
    last = float(times[-1])
    if until is not None and until > last * (1 + 1e-12):
        raise SceneError([Fault("until", f"{until:g} s", f"a time within {words}, to {last:g} s")])
    spline = CubicSpline(times, positions)
    end = last if until is None else min(float(until), last)
    edges = np.unique(np.concatenate((times[times < end], [end])))

    def jet(t: Array, anchor: Array) -> tuple[Array, Array, Array]:
        k = np.clip(np.searchsorted(times, anchor, side="right") - 1, 0, times.size - 2)
        c3, c2, c1, c0 = spline.c[:, k]
        step = t - times[k]
        value = ((c3 * step + c2) * step + c1) * step + c0
        return value, (3 * c3 * step + 2 * c2) * step + c1, 6 * c3 * step + 2 * c2

    def passes(value: float) -> Array:
        roots = spline.solve(value, extrapolate=False)
        return np.asarray(roots[np.isfinite(roots)])

    return _PositionLaw(f"{words} by a cubic spline", jet, edges, (), passes)


_UNIT = re.compile(r"\[([^\]]*)\]|\(([^)]*)\)")


def _function(law: Callable[..., Any], until: float) -> _PositionLaw:
    """A law by a function of t that gives position, rate and acceleration, checked against its own differences."""

    def jet(t: Array, anchor: Array) -> tuple[Array, Array, Array]:
        flat = np.asarray(t, dtype=float).ravel()
        triples = np.array([_triple(law(float(one))) for one in flat]).reshape(flat.size, 3).T
        return tuple(part.reshape(np.shape(t)) for part in triples)  # type: ignore[return-value]

    edges = np.linspace(0.0, until, 65)
    probes = until * (np.arange(_PROBED) + 0.37) / _PROBED
    step = 1e-5 * until
    before, now, after = (jet(probes + side * step, probes) for side in (-1.0, 0.0, 1.0))
    wrong = "a function whose second value is not the rate of its first", "a function whose third is not that of its second"
    for k, what in enumerate(wrong):
        slope = (after[k] - before[k]) / (2 * step)
        off = np.abs(slope - now[k + 1]) > 1e-3 * (np.abs(now[k + 1]).max() + np.ptp(now[k]) / until)
        if np.mean(off) > 0.5:
            raise SceneError([Fault("law", what, "position, rate and acceleration at t")])

    def passes(value: float) -> Array:
        grid = np.linspace(0.0, until, 4001)
        q = jet(grid, grid)[0] - value
        at = np.flatnonzero(np.sign(q[1:]) != np.sign(q[:-1]))
        return roots_between(lambda t: jet(t, t)[0] - value, grid[at], grid[at + 1])

    return _PositionLaw("a function of t", jet, edges, (), passes)


def _triple(value: Any) -> tuple[float, float, float]:
    parts = np.asarray(value, dtype=float).ravel()
    if parts.size != 3:
        what = f"a function that gives {parts.size} values" if parts.size != 1 else "a function that gives one value"
        raise SceneError([Fault("law", what, "position, rate and acceleration at t")])
    return float(parts[0]), float(parts[1]), float(parts[2])


def course_of(
    machine: Machine | Scene,
    *,
    over: str | None,
    speed: float | str | None,
    law: object,
    until: float | None,
    regime: bool,
    transient: Transient | Motion | None,
    limits: Callable[[], Mapping[str, tuple[float, float]]] | None = None,
) -> tuple[DriverCourse, str]:
    """The requested course, and the axis of its curves."""
    scene = scene_of(machine)
    options = {"speed": speed, "law": law, "regime": regime or None, "transient": transient}
    named = [name for name, value in options.items() if value is not None]
    if len(named) > 1:
        raise SceneError([Fault(named[1], f"{named[1]} beside {named[0]}", "one motion of the driver", "leave one out")])
    axis = over or (TIME if named and named[0] in ("law", "transient") else DRIVER)
    if axis not in (DRIVER, TIME):
        raise SceneError([Fault("over", brief(over), f'"{DRIVER}" or "{TIME}"')])
    if until is not None and law is None:
        raise SceneError([Fault("until", brief(until), "none without a law", "give a law of time")])
    if not named and axis == TIME:
        expected, advice = (
            "a motion in time",
            "give --speed, --regime, --law or --from (in Python speed, regime, law or transient)",
        )
        raise SceneError([Fault("over", "time without a motion in time", expected, advice)])
    if speed is not None:
        return constant_speed(scene, speed, axis), axis
    if regime:
        return steady(machine if isinstance(machine, Machine) else Machine(scene), axis), axis
    if transient is not None:
        return along_transient(scene, transient), axis
    if law is not None:
        return imposed(scene, law, until, None if limits is None else limits()), axis
    return per_unit(scene), axis


def instants(course: DriverCourse, over: str, at: ArrayLike | None, points: int) -> Array:
    """Values of a course's variable: those of given positions or times, or evenly spaced ones.

    Positions of a motion in time are those that the driver passes first.
    """
    if at is None:
        return np.linspace(course.start, course.end, points)
    times = np.atleast_1d(array("at", at)).ravel()
    if not times.size:
        raise SceneError([Fault("at", "no position or time", "one at least, or None")])
    if over == course.variable:
        return times
    first = {q: t for t, q in reversed(course.passages(times))}
    missing = [q for q in times.tolist() if q not in first]
    if missing:
        ends = course.at(np.array([course.start, course.end])).q
        defect = f"{missing[0]:.9g}, which the driver does not pass"
        raise SceneError(
            [Fault("at", defect, f"a position that it passes between its ends, from {ends[0]:.9g} to {ends[1]:.9g}")]
        )
    return np.array([first[q] for q in times.tolist()])
