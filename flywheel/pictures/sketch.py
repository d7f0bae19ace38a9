"""The sketch of a mechanism: figures that move with its bodies, paths of its points, and names.

Lengths in m, angles in rad; outlines have x and y in two rows, shape (2, m), and a gap between strokes is a column of NaN.
Bars and plates go through the points of a body, blocks run on guides, pins in slots; fixed parts are hatched. Guides and
slots are as long as the motion requires.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.mechanisms.families import has_joints
from flywheel.mechanisms.linkage import linkage_of
from flywheel.mechanisms.linkages.equations import Poses
from flywheel.mechanisms.linkages.positions import Solution, solve
from flywheel.numerics.faults import Fault, SceneError, nearest
from flywheel.scene.linkage import CAM, FIXED, FRAME, GEAR, PIN, SLIDE, SLOT, Coupling, Joint, Linkage, common_body
from flywheel.scene.scene import TURN, Mechanism, Scene

Array = NDArray[np.float64]

_ROUND = 96  # points of a full circle


def circle(radius: float, centre: tuple[float, float] = (0.0, 0.0), start: float = 0.0, end: float = 2 * np.pi) -> Array:
    """An arc from `start` to `end` (rad), a full circle by default."""
    count = max(int(np.ceil(_ROUND * abs(end - start) / (2 * np.pi))), 2) + 1
    angle = np.linspace(start, end, count)
    return np.stack((centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle)))


def box(half_length: float, half_height: float) -> Array:
    """A rectangle about its centre."""
    return np.array([[-half_length, half_length, half_length, -half_length], [-half_height] * 2 + [half_height] * 2])


def slot(low: float, high: float, half_width: float) -> Array:
    """A slot along x with round ends, whose pin goes from low to high."""
    right = circle(half_width, (high, 0.0), -np.pi / 2, np.pi / 2)
    left = circle(half_width, (low, 0.0), np.pi / 2, 3 * np.pi / 2)
    return np.concatenate((right, left), axis=1)


def ground(low: float, high: float, step: float) -> Array:
    """A line along x and short oblique strokes on its lower side, about a `step` (m) apart: a fixed part."""
    count = max(round((high - low) / step), 2)
    foot = low + (np.arange(count) + 0.6) * (high - low) / count
    gap = np.full(count, np.nan)
    strokes = np.stack((np.stack((foot, foot - 0.8 * step, gap)), np.stack((0 * foot, 0 * foot - 0.8 * step, gap))))
    line = np.array([[low, high, np.nan], [0.0, 0.0, np.nan]])
    return np.concatenate((line, strokes.transpose(0, 2, 1).reshape(2, -1)), axis=1)


def round_arrow(radius: float, head: float, sense: int) -> Array:
    """An arrow over the upper side of a pivot, counter-clockwise for a sense of +1."""
    arc = circle(radius, (0.0, 0.0), np.radians(40.0), np.radians(140.0))
    tip = arc[:, -1:]
    barbs = [tip + head * np.array([[np.cos(angle)], [np.sin(angle)]]) for angle in np.radians([25.0, 85.0])]
    whole = np.concatenate((arc, barbs[0], tip, barbs[1]), axis=1)
    return whole if sense > 0 else whole * np.array([[-1.0], [1.0]])


def turned(outline: Array, angle: float, shift: tuple[float, float] = (0.0, 0.0)) -> Array:
    """An outline turned about the origin (rad, counter-clockwise), then shifted."""
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(np.array([[c, -s], [s, c]]) @ outline + np.reshape(shift, (2, 1)))


def rounded(points: Array, radius: float) -> Array:
    """The outline of a bar or plate through points (2, m): their convex hull, a radius wider on every side.

    In each direction the point that lies furthest bears the rim.

    >>> rounded(np.array([[0.0, 2.0, 1.0], [0.0, 0.0, 0.0]]), 1.0)[0, [0, 48]].round(9).tolist()
    [3.0, -1.0]
    """
    rim = circle(1.0)[:, :-1]
    return np.asarray(points[:, (rim.T @ points).argmax(axis=1)] + radius * rim)


def in_line(points: Array) -> bool:
    """Tests whether points (2, m) lie on one line, within a thousandth of their extent.

    >>> in_line(np.array([[0.0, 1.0, 2.0], [0.0, 1.0, 2.0]])), in_line(np.array([[0.0, 1.0, 2.0], [0.0, 1.0, 0.0]]))
    (True, False)
    """
    spread = np.linalg.svd(points - points.mean(axis=1, keepdims=True), compute_uv=False)
    return bool(spread[1] <= 1e-3 * spread[0])


# -- sketch ------------------------------------------------------------------------------------------------------------

Place = tuple[str, tuple[float, float]]
"""A point of a body: its name, and x, y in its own frame (m)."""

CLOSED = frozenset({"bar", "rail", "plate", "block", "fixed block", "slot", "wheel", "cam", "support", "pin", "dot", "weld"})
"""Kinds of figures whose outline closes."""

BLOCK = (2.6, 1.5)  # half length and half height of a block, in pins' radii
BAR = 0.62  # half width of a bar, in pins' radii
ORIGIN = "origin"  # of a body: a point that nobody named
_UNIT = 0.010  # radius of a pin, of the mechanism's size
_SAME_POINT = 1e-6  # of the mechanism's size: closer points are one
_LARGEST = 50.0  # times the distance of centres: wheels beyond it would fill the picture with a straight line


class Shape(NamedTuple):
    """A figure that stays on a place of a body and turns with a body: `outline` (2, m) is relative to that place.

    kind: one of `CLOSED`, or mark, track, ground, arrow. `body` is its body.
    """

    kind: str
    body: str
    outline: Array
    at: Place
    turns_with: str


def placed(shape: Shape, poses: Poses) -> Array:
    """The outline in the plane (m) at every pose, shape (2, m, n): p = o + R(theta) a."""
    at = poses.point(*shape.at).value
    theta = poses.angle(shape.turns_with).value
    c, s = np.cos(theta), np.sin(theta)
    x, y = shape.outline[:, :, None]
    return np.stack((at[0] + x * c - y * s, at[1] + x * s + y * c))


class Label(NamedTuple):
    """A name beside a place; `body` is the body that it names, `frame` for names of joints and points."""

    text: str
    body: str
    at: Place


class Trace(NamedTuple):
    """The path (2, n) of a point over the motion, and the body that it belongs to."""

    name: str
    body: str
    path: Array


class Sketch(NamedTuple):
    """All figures of a linkage; `unit` (m) is the radius of its pins, `size` (m) its extent."""

    shapes: tuple[Shape, ...]
    traces: tuple[Trace, ...]
    labels: tuple[Label, ...]
    unit: float
    size: float


def sketch(cycle: Poses, points: Sequence[str] | None = None) -> Sketch:
    """The picture of a linkage that moves through poses, with the paths of all points, or of some by their names.

    A name is that of a joint, or `body.point`. Raises KeyError for any other. The size is the larger side of the box that
    holds all joints through the motion, 1 if all are one point.
    """
    linkage, positions = cycle.linkage, places(cycle.linkage)
    paths = {name: cycle.point(*place).value for name, place in positions.items()}
    ends = [cycle.point(FRAME, joint.first_at).value for joint in linkage.joints if joint.first == FRAME]
    size = float(np.ptp(np.concatenate((*paths.values(), *ends), axis=1), axis=1).max()) or 1.0
    unit = _UNIT * size
    shapes = [
        *(shape for body in linkage.names[1:] for shape in _body(cycle, body, unit)),
        *(shape for joint in linkage.joints for shape in _joint(cycle, joint, unit)),
        *(shape for coupling in linkage.couplings for shape in _coupling(cycle, coupling, unit)),
        *_supports(linkage, unit),
        _driver(cycle, unit),
    ]
    seen = {shape.body for shape in shapes}
    for body in linkage.names[1:]:
        if body not in seen:  # a rotor on its pin: a disc with a mark
            x, y = _nodes(linkage, body)[:, 0].tolist()
            shapes.append(Shape("plate", body, circle(3.0 * unit), (body, (x, y)), body))
            shapes.append(Shape("mark", body, np.array([[0.0, 3.0 * unit], [0.0, 0.0]]), (body, (x, y)), body))

    def same(a: Array, b: Array) -> bool:
        return bool(np.abs(a - b).max() < _SAME_POINT * size)

    named = [name for name in positions if not name.endswith(f".{ORIGIN}")]
    traces: list[Trace] = []
    for name in named if points is None else points:  # paths of points that move, each once
        path = paths[name]
        if np.ptp(path, axis=1).max() > _SAME_POINT * size and not any(same(path, other.path) for other in traces):
            traces.append(Trace(name, positions[name][0], path))
    groups: list[tuple[str, list[str]]] = []  # joints, and points that are none; those of one place together
    for name in named:
        group = next((names for first, names in groups if same(paths[name], paths[first])), None)
        if group is None:
            groups.append((name, [name]))
        elif "." not in name:
            group.append(name)
    labels = [Label(", ".join(n.rpartition(".")[2] for n in names), FRAME, positions[first]) for first, names in groups]
    for body in linkage.names[1:]:
        nodes = _nodes(linkage, body)
        x, y = (0.5 * (nodes.min(axis=1) + nodes.max(axis=1)) if nodes.size else np.zeros(2)).tolist()
        labels.append(Label(body, body, (body, (x, y))))
    return Sketch(tuple(shapes), tuple(traces), tuple(labels), unit, size)


def places(linkage: Linkage) -> dict[str, Place]:
    """Every joint and every named point of a moving body, by the names that select their paths."""
    joints = {joint.name: _where(joint) for joint in linkage.joints}
    points = {f"{link.name}.{p.name}": (link.name, (p.x, p.y)) for link in linkage.links for p in link.points}
    return joints | points


def _where(joint: Joint) -> Place:
    """Place of a joint in the drawing: of a slide or a slot, that of its block or pin."""
    if joint.kind in (SLIDE, SLOT) or joint.first == FRAME:
        return joint.second, (joint.second_at.x, joint.second_at.y)
    return joint.first, (joint.first_at.x, joint.first_at.y)


def sliding(cycle: Poses, joint: Joint) -> tuple[float, float]:
    """The least and the greatest distance (m) along a guide, of its block from the guide's origin."""
    offset = cycle.point(joint.second, joint.second_at).value - cycle.point(joint.first, joint.first_at).value
    angle = cycle.angle(joint.first).value + joint.direction
    along = offset[0] * np.cos(angle) + offset[1] * np.sin(angle)
    return float(along.min()), float(along.max())


# -- bodies and joints -------------------------------------------------------------------------------------------------


def _nodes(linkage: Linkage, body: str) -> Array:
    """The points through which a body is drawn, in its own frame, shape (2, m): its joints and its named points."""
    nodes = [
        *((j.first_at.x, j.first_at.y) for j in linkage.joints if j.first == body and j.kind in (PIN, FIXED)),
        *((j.second_at.x, j.second_at.y) for j in linkage.joints if j.second == body),
        *((p.x, p.y) for p in linkage.link(body).points if p.name != ORIGIN),
    ]
    return np.array(sorted(set(nodes)), dtype=float).reshape(-1, 2).T


def _body(cycle: Poses, body: str, unit: float) -> Iterator[Shape]:
    """A bar or a plate through the nodes, a bar for every guide, bars that join nodes to guides, dots where no joint is."""

    def bar(points: Array, kind: str = "bar") -> Shape:
        kind = kind if in_line(points) else "plate"
        return Shape(kind, body, rounded(points, BAR * unit), (body, (0.0, 0.0)), body)

    linkage, spare = cycle.linkage, 1.5 * BLOCK[0] * unit
    nodes = off = _nodes(linkage, body)
    for joint in linkage.joints:
        if joint.first != body or joint.kind not in (SLIDE, SLOT):
            continue
        low, high = sliding(cycle, joint)
        ends = np.array([[low - spare, high + spare], [0.0, 0.0]])
        guide = turned(ends, joint.direction, (joint.first_at.x, joint.first_at.y))
        start, way = guide[:, :1], guide[:, 1:] - guide[:, :1]
        x, y = nodes - start
        aside = np.abs(way[0] * y - way[1] * x) / np.hypot(*way) > 1e-3 * unit
        off = nodes[:, aside]
        yield bar(np.concatenate((guide, nodes[:, ~aside]), axis=1), "rail")
        if off.size:  # the node that is nearest to the guide stands on it
            feet = start + np.clip((way * (off - start)).sum(axis=0) / (way * way).sum(), 0.0, 1.0) * way
            k = int(np.hypot(*(off - feet)).argmin())
            yield bar(np.stack((off[:, k], feet[:, k]), axis=1))
    if off.shape[1] > 1:
        yield bar(off)
    borne = [*((j.first, j.first_at) for j in linkage.joints), *((j.second, j.second_at) for j in linkage.joints)]
    places = {(at.x, at.y) for name, at in borne if name == body}
    for point in linkage.link(body).points:
        if point.name != ORIGIN and (point.x, point.y) not in places:
            yield Shape("dot", body, circle(0.5 * unit), (body, (point.x, point.y)), body)


def _joint(cycle: Poses, joint: Joint, unit: float) -> Iterator[Shape]:
    """The symbol of a joint, without the support under a fixed pivot."""
    at = _where(joint)
    if joint.kind == PIN:
        yield Shape("pin", FRAME, circle(unit), at, FRAME)
    elif joint.kind == FIXED:
        yield Shape("weld", FRAME, box(unit, unit), at, joint.first)
    elif joint.kind == SLIDE:
        if joint.first == FRAME:  # the hatched line that a block runs on, on its lower side, or on its right going upwards
            (low, high), angle, spare = sliding(cycle, joint), joint.direction, 1.6 * BLOCK[0] * unit
            if np.cos(angle) < -1e-9:
                angle, low, high = angle + np.pi, -high, -low
            line = ground(low - spare, high + spare, 1.6 * unit) - np.array([[0.0], [BLOCK[1] * unit]])
            yield Shape("ground", FRAME, turned(line, angle), (FRAME, (joint.first_at.x, joint.first_at.y)), FRAME)
        block = turned(box(max(BLOCK[0] * unit, 0.5 * joint.length), BLOCK[1] * unit), joint.direction)
        yield Shape("fixed block" if joint.second == FRAME else "block", joint.second, block, at, joint.first)
    else:
        outline = turned(slot(*sliding(cycle, joint), 1.35 * unit), joint.direction)
        yield Shape("slot", joint.first, outline, (joint.first, (joint.first_at.x, joint.first_at.y)), joint.first)
        yield Shape("pin", FRAME, circle(unit), at, FRAME)


def _supports(linkage: Linkage, unit: float) -> Iterator[Shape]:
    """A triangle on hatched ground under every place where a body is pinned or fixed to the frame."""
    ends = [
        *(joint.first_at for joint in linkage.joints if joint.first == FRAME and joint.kind in (PIN, FIXED)),
        *(joint.second_at for joint in linkage.joints if joint.second == FRAME and joint.kind in (PIN, FIXED, SLOT)),
    ]
    for place in sorted({(end.x, end.y) for end in ends}):
        triangle = 2.2 * unit * np.array([[0.0, -1.0, 1.0], [0.0, -1.7, -1.7]])
        yield Shape("support", FRAME, triangle, (FRAME, place), FRAME)
        line = ground(-3.6 * unit, 3.6 * unit, 1.6 * unit) - np.array([[0.0], [1.7 * 2.2 * unit]])
        yield Shape("ground", FRAME, line, (FRAME, place), FRAME)


def _driver(cycle: Poses, unit: float) -> Shape:
    """An arrow at the driver: the positive sense of its coordinate, seen from the body that moves."""
    joint = cycle.linkage.joint(cycle.linkage.driver)
    if joint.kind == PIN:
        sense = -1 if joint.second == FRAME else 1
        return Shape("arrow", FRAME, round_arrow(4.0 * unit, 1.5 * unit, sense), _where(joint), FRAME)
    above = 2.6 * unit if np.cos(joint.direction) > -1e-9 else -2.6 * unit  # of the block, away from the ground
    length, head = 5.0 * unit, 1.5 * unit
    arrow = np.array([[0.0, length, length - head, length, length - head], [0.0, 0.0, 0.5 * head, 0.0, -0.5 * head]])
    arrow = turned(arrow + np.array([[-0.5 * length], [above]]), joint.direction)
    return Shape("arrow", FRAME, arrow, _where(joint), joint.first)


# -- couplings: pitch circles of gears, wheels that roll, cams with the profile that the motion gives them -------------


def radii(ratio: float, centres: float) -> tuple[float, float]:
    """Pitch radii r1, r2 (m) of wheels whose speeds against their carrier are w2 = ratio w1, `centres` (m) apart.

    From outside (ratio < 0): r1 + r2 = a; one inside the other (ratio > 0): |r1 - r2| = a; in both r1 = |ratio| r2.
    Equal speeds (ratio 1) have no pitch circles: both are infinite.

    >>> radii(-2.0, 0.3), radii(2.0, 0.1)
    ((0.2, 0.1), (0.2, 0.1))
    """
    if ratio == 1.0:
        return np.inf, np.inf
    small = centres / abs(ratio - 1.0)
    return round(abs(ratio) * small, 15), round(small, 15)


def _coupling(cycle: Poses, coupling: Coupling, unit: float) -> Iterator[Shape]:
    """Shapes of a coupling: wheels with a mark that shows their turning, and their track; or a cam."""
    first, second = cycle.linkage.joint(coupling.first), cycle.linkage.joint(coupling.second)
    carrier = common_body(first, second)
    wheel, sense = _wheel_on(first, carrier)
    if coupling.kind == CAM:
        yield _cam(cycle, coupling, wheel, second, unit)
        return
    if coupling.kind == GEAR:
        other, other_sense = _wheel_on(second, carrier)
        distance = float(np.hypot(*(cycle.point(*other).value[:, 0] - cycle.point(*wheel).value[:, 0])))
        sizes = radii(coupling.ratio * sense * other_sense, distance)
        wheels = list(zip((wheel, other), sizes, strict=True)) if max(sizes) <= _LARGEST * distance else []
    else:
        yield _rolled_on(cycle, second, carrier, wheel, coupling.ratio * sense, unit)
        wheels = [(wheel, abs(coupling.ratio))]
    for at, radius in wheels:
        yield Shape("wheel", at[0], circle(radius), at, at[0])
        yield Shape("mark", at[0], np.array([[0.0, radius], [0.0, 0.0]]), at, at[0])


def _wheel_on(joint: Joint, carrier: str) -> tuple[Place, int]:
    """The place of the wheel on a pin, and the sign of its turning in the pin's coordinate."""
    if joint.first == carrier:
        return (joint.second, (joint.second_at.x, joint.second_at.y)), 1
    return (joint.first, (joint.first_at.x, joint.first_at.y)), -1


def _within(cycle: Poses, spots: Array, at: Place) -> Array:
    """Points of the plane (2, n) seen from a body: from a place of it, in its own directions."""
    turn = cycle.angle(at[0]).value
    x, y = spots - cycle.point(*at).value
    return np.stack((x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)))


def _rolled_on(cycle: Poses, slide: Joint, carriage: str, wheel: Place, ratio: float, unit: float) -> Shape:
    """The line that a wheel of radius |ratio| rolls on, on the side where wheel and line have one velocity."""
    carried = slide.second == carriage
    other, end = (slide.first, slide.first_at) if carried else (slide.second, slide.second_at)
    at = other, (end.x, end.y)
    side = ratio * (1 if carried else -1)
    angle = cycle.angle(slide.first).value + slide.direction
    inside = _within(cycle, cycle.point(*wheel).value + side * np.stack((-np.sin(angle), np.cos(angle))), at)
    direction = slide.direction - (0.0 if carried else slide.angle)
    run = np.array([np.cos(direction), np.sin(direction)]) @ (inside - inside[:, :1])
    low, high, start = float(run.min()) - 4 * unit, float(run.max()) + 4 * unit, (float(inside[0, 0]), float(inside[1, 0]))
    if other == FRAME:
        low, high, direction = (-high, -low, direction + np.pi) if side > 0 else (low, high, direction)
        return Shape("ground", FRAME, turned(ground(low, high, 1.6 * unit), direction, start), at, other)
    line = turned(np.array([[low, high], [0.0, 0.0]]), direction, start)
    stem = np.stack((np.full(2, np.nan), np.zeros(2), line[:, int(np.hypot(*line).argmin())]), axis=1)
    return Shape("track", other, np.concatenate((line, stem), axis=1), at, other)


def _cam(cycle: Poses, coupling: Coupling, at: Place, follower: Joint, unit: float) -> Shape:
    """The cam's profile from the motion, about its pin; a plain disc where it is unknown.

    Cam and follower meet at the point named, or on the face across a sliding follower: a flat face at height h over the
    cam's axis touches it at the eccentricity -dh/dtheta, to the left of its travel. The face is unknown for a follower that
    turns, or whose point lies behind the axis.
    """
    turn, contact = cycle.angle(at[0]), None
    if coupling.contact is not None:
        body, name = coupling.contact
        contact = cycle.point(body, cycle.linkage.link(body).point(name)).value
    elif (follower.kind, follower.first) == (SLIDE, FRAME) and np.all(turn.rate):
        along = np.array([[np.cos(follower.direction)], [np.sin(follower.direction)]])
        face, axis = cycle.point(follower.second, follower.second_at), cycle.point(*at)
        height = np.sum(along * (face.value - axis.value), axis=0)
        rise = np.sum(along * (face.rate - axis.rate), axis=0) / turn.rate
        if height.min() > 0.0:
            contact = axis.value + height * along - rise * np.stack((-along[1], along[0]))
    if contact is None:
        return Shape("cam", at[0], circle(6.0 * unit), at, at[0])
    once = np.abs(turn.value - turn.value[0]) <= 2 * np.pi * (1 + 1e-12)
    whole = np.ptp(turn.value) >= 2 * np.pi * (1 - 1e-9)
    return Shape("cam" if whole else "track", at[0], _within(cycle, contact, at)[:, once], at, at[0])


# -- views: the mechanisms of a scene as linkages that move with the machine's coordinate -------------------------------

_POINTS = 361  # of a path
_TURNED, _SLID = (1 / 6, 0.0, 1 / 3, 1 / 2, 2 / 3, 5 / 6), (0.5, 0.0, 0.25, 0.75, 1.0)  # of a turn, of a stroke


@dataclass(frozen=True)
class View:
    """One mechanism, and its own angle as a function of the machine's coordinate q: psi = ratio q + phase."""

    mechanism: Mechanism
    solution: Solution
    ratio: float = 1.0
    phase: float = 0.0
    points: tuple[str, ...] | None = None

    def poses(self, q: ArrayLike) -> Poses:
        """Poses at coordinates q of the machine (rad, or m on a sliding stroke)."""
        low, high = self.solution.low, self.solution.high
        psi = self.ratio * np.atleast_1d(np.asarray(q, dtype=float)) + self.phase
        turning = self.mechanism.stroke is None
        return self.solution.poses(low + (psi - low) % (high - low) if turning else np.clip(psi, low, high))

    @cached_property
    def cycle(self) -> Poses:
        """Poses over the whole motion, evenly spread, both ends included."""
        return self.solution.poses(np.linspace(self.solution.low, self.solution.high, _POINTS))

    @cached_property
    def sketch(self) -> Sketch:
        """The figures of the mechanism, with the paths of the required points."""
        return sketch(self.cycle, self.points)

    @cached_property
    def box(self) -> Array:
        """The box (m) around all figures of the mechanism through its motion: x and y, least and greatest."""
        few = self.solution.poses(self.cycle.q[::6])
        outlines = [placed(shape, few).reshape(2, -1) for shape in self.sketch.shapes]
        whole = np.concatenate((*outlines, *(trace.path for trace in self.sketch.traces)), axis=1)
        return np.stack((np.nanmin(whole, axis=1), np.nanmax(whole, axis=1)), axis=1)


def views(scene: Scene, points: Sequence[str] = ()) -> tuple[View, ...]:
    """Every mechanism of a scene except those without joints, such as laws, which have no bodies to draw.

    `points` are the names of joints or points whose paths are drawn, all if none is given.
    A name is that of a joint (`B`), a point of a body (`rod.P`), or a point's own name where only one has it; with several
    mechanisms the name of the mechanism may stand before it (`press.rod.P`).

    Raises:
        SceneError: for a scene without mechanism, a mechanism that is no linkage or cannot move, an unknown point.

    """
    if not scene.mechanisms:
        defect = "a diagram of areas" if scene.areas is not None else "a scene without any"
        raise SceneError([Fault("mechanism", defect, "a mechanism to draw")])
    drawn = [mechanism for mechanism in scene.mechanisms if has_joints(mechanism)]
    if not drawn:
        expected, advice = "a mechanism with bodies, to draw", "write it as a linkage"
        bodiless = [(f"{m.path}.type", f'"{m.type}", which has no bodies') for m in scene.mechanisms]
        raise SceneError([Fault(path, what, expected, advice) for path, what in bodiless])
    all_views = []
    for mechanism in drawn:
        linkage = mechanism.linkage if mechanism.linkage is not None else linkage_of(mechanism)
        if scene.stroke is not None:
            all_views.append(View(mechanism, solve(linkage, scene.stroke.start, scene.stroke.end)))
            continue
        span = mechanism.travel if mechanism.linkage is not None else TURN
        solution = solve(linkage, mechanism.phase, mechanism.phase + span)
        all_views.append(View(mechanism, solution, scene.shafts[mechanism.shaft], mechanism.phase))
    if not points:
        return tuple(all_views)
    positions = [list(places(view.solution.linkage)) for view in all_views]
    chosen: list[list[str]] = [[] for _ in all_views]
    faults = []
    for name in points:
        matches = 0
        for view, names, own in zip(all_views, positions, chosen, strict=True):
            inner = name.removeprefix(f"{view.mechanism.name}.")
            same = [place for place in names if place.rpartition(".")[2] == inner]
            exact = [place for place in (name, inner) if place in names][:1]
            match = exact or (same if len(same) == 1 else [])
            own += match
            matches += len(match)
        if not matches:
            everything = list(dict.fromkeys(place for names in positions for place in names))
            near = nearest(name, everything)
            advice = f"did you mean {near!r}?" if near else ""
            faults.append(Fault("points", repr(name), "one of " + ", ".join(everything), advice))
    if faults:
        raise SceneError(faults)
    return tuple(replace(view, points=tuple(names)) for view, names in zip(all_views, chosen, strict=True))


def headline(scene: Scene) -> str:
    """The title of a picture: the scene's, or its file's name; it names parts that cannot be drawn."""
    title = scene.title or (scene.file.stem if scene.file is not None else "")
    bare = [mechanism for mechanism in scene.mechanisms if not has_joints(mechanism)]
    names, types = ", ".join(m.name for m in bare), ", ".join(dict.fromkeys(m.type for m in bare))
    return f"{title} (not drawn: {names}, a {types} without bodies)".strip() if bare else title


def positions(scene: Scene) -> tuple[float, ...]:
    """Default positions of the drawing: a few over a turn or a stroke (rad or m), the main one first."""
    if scene.stroke is not None:
        return tuple(scene.stroke.start + share * scene.stroke.span for share in _SLID)
    turn = min(TURN / scene.shafts[mechanism.shaft] for mechanism in scene.mechanisms)
    return tuple(share * min(turn, scene.cycle) for share in _TURNED)


def checked(scene: Scene, at: Iterable[float]) -> tuple[float, ...]:
    """Required coordinates; a SceneError for one that is not finite or, on a stroke, beyond its ends."""
    coordinates = tuple(map(float, at))
    stroke = scene.stroke
    for q in coordinates:
        if not np.isfinite(q):
            raise SceneError([Fault("at", f"{q}", "positions that are finite")])
        if stroke is not None and not stroke.start - 1e-9 * stroke.span <= q <= stroke.end + 1e-9 * stroke.span:
            ends = f"a position from {coordinate_text(scene, stroke.start)} to {coordinate_text(scene, stroke.end)}"
            raise SceneError([Fault("at", coordinate_text(scene, q), ends, "the stroke ends there")])
    return coordinates


def coordinate_text(scene: Scene, q: float) -> str:
    """A coordinate of the machine in words: in degrees, or in mm where it slides."""
    sliding = scene.stroke is not None and scene.stroke.sliding
    return (f"{1000 * q:.6g} mm" if sliding else f"{np.degrees(q):.6g}°").replace("-", "−")
