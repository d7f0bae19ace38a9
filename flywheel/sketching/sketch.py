"""What the picture of a linkage consists of: figures that move with its bodies, paths of its points, names.

Lengths in m, angles in rad. Bars and plates go through the points of a body, blocks run on guides, pins in slots; what is
fixed is hatched. Guides and slots are as long as the motion needs them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.linkage.description import FIXED, FRAME, PIN, SLIDE, SLOT, Joint, Linkage, Point
from flywheel.linkage.poses import Poses
from flywheel.sketching import symbols
from flywheel.sketching.couplings import coupling_shapes
from flywheel.sketching.shapes import Place, Shape

Array = NDArray[np.float64]
BLOCK = (2.6, 1.5)  # half length and half height of a block, in pins' radii
BAR = 0.62  # half width of a bar, in pins' radii
ORIGIN = "origin"  # of a body: a point that nobody named
_UNIT = 0.010  # radius of a pin, of the mechanism's size
_SAME = 1e-6  # of the mechanism's size: closer points are one


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
    """Everything that is drawn of a linkage; `unit` (m) is the radius of its pins, `size` (m) how far it reaches."""

    shapes: tuple[Shape, ...]
    traces: tuple[Trace, ...]
    labels: tuple[Label, ...]
    unit: float
    size: float


def sketch(cycle: Poses, points: Sequence[str] | None = None) -> Sketch:
    """The picture of a linkage that moves through poses, with the paths of all points, or of some by their names.

    A name is that of a joint, or `body.point`. Raises KeyError for any other.
    """
    linkage = cycle.linkage
    size = _reach(cycle)
    unit = _UNIT * size
    shapes = [
        *(shape for body in linkage.names[1:] for shape in _body(cycle, body, unit)),
        *(shape for joint in linkage.joints for shape in _joint(cycle, joint, unit)),
        *(shape for coupling in linkage.couplings for shape in coupling_shapes(cycle, coupling, unit)),
        *_supports(linkage, unit),
        _driver(cycle, unit),
    ]
    shapes += _discs(cycle, {shape.body for shape in shapes}, unit)
    known = places(linkage)
    named = {name: place for name, place in known.items() if not name.endswith(f".{ORIGIN}")}
    wanted = named if points is None else {name: known[name] for name in points}
    return Sketch(
        tuple(shapes), _traces(cycle, wanted, size), (*_joint_names(cycle, named, size), *_body_names(cycle)), unit, size
    )


def places(linkage: Linkage) -> dict[str, Place]:
    """Every joint and every named point of a moving body, by the names under which their paths can be asked for."""
    joints = {joint.name: _where(joint) for joint in linkage.joints}
    points = {
        f"{link.name}.{point.name}": (link.name, (point.x, point.y)) for link in linkage.links for point in link.points
    }
    return joints | points


# -- where things are ------------------------------------------------------------------------------------------------


def _where(joint: Joint) -> Place:
    """Where a joint is drawn: for a slide or a slot, where its block or pin stands."""
    at = joint.second_at if joint.kind in (SLIDE, SLOT) else joint.first_at
    body = joint.second if joint.kind in (SLIDE, SLOT) else joint.first
    if body == FRAME and joint.kind not in (SLIDE, SLOT):
        return joint.second, (joint.second_at.x, joint.second_at.y)
    return body, (at.x, at.y)


def _reach(cycle: Poses) -> float:
    """The larger side of the box that holds all joints through the motion; 1 where all are one point."""
    tracks = [cycle.point(*place).value for place in places(cycle.linkage).values()]
    ends = [cycle.point(FRAME, joint.first_at).value for joint in cycle.linkage.joints if joint.first == FRAME]
    return float(np.ptp(np.concatenate((*tracks, *ends), axis=1), axis=1).max()) or 1.0


def sliding(cycle: Poses, joint: Joint) -> tuple[float, float]:
    """The least and the greatest distance (m) along a guide, of its block from the guide's origin."""
    offset = cycle.point(joint.second, joint.second_at).value - cycle.point(joint.first, joint.first_at).value
    angle = cycle.angle(joint.first).value + joint.direction
    along = offset[0] * np.cos(angle) + offset[1] * np.sin(angle)
    return float(along.min()), float(along.max())


def _guides(cycle: Poses, body: str, spare: float) -> list[Array]:
    """The guides that a body carries, in its own frame: their two ends, shape (2, 2), `spare` (m) beyond the motion."""
    found = []
    for joint in cycle.linkage.joints:
        if joint.first == body and joint.kind in (SLIDE, SLOT):
            low, high = sliding(cycle, joint)
            ends = np.array([[low - spare, high + spare], [0.0, 0.0]])
            found.append(symbols.turned(ends, joint.direction, (joint.first_at.x, joint.first_at.y)))
    return found


def _nodes(linkage: Linkage, body: str) -> Array:
    """The points through which a body is drawn, in its own frame, shape (2, m): its joints and its named points."""
    found = [
        *((j.first_at.x, j.first_at.y) for j in linkage.joints if j.first == body and j.kind in (PIN, FIXED)),
        *((j.second_at.x, j.second_at.y) for j in linkage.joints if j.second == body),
        *((p.x, p.y) for p in linkage.link(body).points if p.name != ORIGIN),
    ]
    return np.array(sorted(set(found)), dtype=float).reshape(-1, 2).T


# -- bodies ----------------------------------------------------------------------------------------------------------


def _body(cycle: Poses, body: str, unit: float) -> Iterator[Shape]:
    """A bar or a plate through the nodes, a bar for every guide, bars that join nodes to guides, dots where no joint is."""

    def bar(points: Array, kind: str = "bar") -> Shape:
        kind = kind if symbols.in_line(points) else "plate"
        return Shape(kind, body, symbols.rounded(points, BAR * unit), (body, (0.0, 0.0)), body)

    nodes = off = _nodes(cycle.linkage, body)
    for guide in _guides(cycle, body, 1.5 * BLOCK[0] * unit):
        aside = np.abs(_across(nodes, guide)) > 1e-3 * unit
        off = nodes[:, aside]
        yield bar(np.concatenate((guide, nodes[:, ~aside]), axis=1), "rail")
        if off.size:
            near = min(off.T, key=lambda node: float(np.hypot(*(node - _foot(node, guide)))))
            yield bar(np.stack((near, _foot(near, guide)), axis=1))
    if off.shape[1] > 1:
        yield bar(off)
    for point in cycle.linkage.link(body).points:
        if point.name != ORIGIN and not any(_bears(joint, body, point) for joint in cycle.linkage.joints):
            yield Shape("dot", body, symbols.circle(0.5 * unit), (body, (point.x, point.y)), body)


def _discs(cycle: Poses, seen: set[str], unit: float) -> Iterator[Shape]:
    """A disc with a mark for every body of which nothing else is to be seen: a rotor on its pin."""
    for body in cycle.linkage.names[1:]:
        if body not in seen:
            x, y = _nodes(cycle.linkage, body)[:, 0].tolist()
            yield Shape("plate", body, symbols.circle(3.0 * unit), (body, (x, y)), body)
            yield Shape("mark", body, np.array([[0.0, 3.0 * unit], [0.0, 0.0]]), (body, (x, y)), body)


def _across(points: Array, guide: Array) -> Array:
    """How far points (2, m) lie to the left of a guide's line."""
    along = guide[:, 1] - guide[:, 0]
    x, y = points - guide[:, :1]
    return np.asarray((along[0] * y - along[1] * x) / np.hypot(*along))


def _foot(point: Array, guide: Array) -> Array:
    """The point of a guide that is nearest to a point."""
    start, along = guide[:, 0], guide[:, 1] - guide[:, 0]
    share = np.clip(along @ (point - start) / (along @ along), 0.0, 1.0)
    return np.asarray(start + share * along)


def _bears(joint: Joint, body: str, point: Point) -> bool:
    """Whether a joint is at a point of a body."""
    ends = ((joint.first, joint.first_at), (joint.second, joint.second_at))
    return any(name == body and (at.x, at.y) == (point.x, point.y) for name, at in ends)


# -- joints ----------------------------------------------------------------------------------------------------------


def _joint(cycle: Poses, joint: Joint, unit: float) -> Iterator[Shape]:
    """The symbol of a joint, without the support under a fixed pivot."""
    at = _where(joint)
    if joint.kind == PIN:
        yield Shape("pin", FRAME, symbols.circle(unit), at, FRAME)
    elif joint.kind == FIXED:
        yield Shape("weld", FRAME, symbols.box(unit, unit), at, joint.first)
    elif joint.kind == SLIDE:
        if joint.first == FRAME:
            yield _ground(cycle, joint, unit)
        half = max(BLOCK[0] * unit, 0.5 * joint.length), BLOCK[1] * unit
        block = symbols.turned(symbols.box(*half), joint.direction)
        yield Shape("fixed block" if joint.second == FRAME else "block", joint.second, block, at, joint.first)
    else:
        low, high = sliding(cycle, joint)
        outline = symbols.turned(symbols.slot(low, high, 1.35 * unit), joint.direction)
        yield Shape("slot", joint.first, outline, (joint.first, (joint.first_at.x, joint.first_at.y)), joint.first)
        yield Shape("pin", FRAME, symbols.circle(unit), at, FRAME)


def _ground(cycle: Poses, joint: Joint, unit: float) -> Shape:
    """The hatched line that a block runs on, on its lower side, or on its right where it runs upwards."""
    low, high = sliding(cycle, joint)
    spare = 1.6 * BLOCK[0] * unit
    angle = joint.direction
    if np.cos(angle) < -1e-9:
        angle, low, high = angle + np.pi, -high, -low
    line = symbols.ground(low - spare, high + spare, 1.6 * unit) - np.array([[0.0], [BLOCK[1] * unit]])
    return Shape("ground", FRAME, symbols.turned(line, angle), (FRAME, (joint.first_at.x, joint.first_at.y)), FRAME)


def _supports(linkage: Linkage, unit: float) -> Iterator[Shape]:
    """A triangle on hatched ground under every place where a body is pinned or fixed to the frame."""
    ends = [
        *(joint.first_at for joint in linkage.joints if joint.first == FRAME and joint.kind in (PIN, FIXED)),
        *(joint.second_at for joint in linkage.joints if joint.second == FRAME and joint.kind in (PIN, FIXED, SLOT)),
    ]
    for place in sorted({(end.x, end.y) for end in ends}):
        yield Shape("support", FRAME, symbols.support(2.2 * unit), (FRAME, place), FRAME)
        line = symbols.ground(-3.6 * unit, 3.6 * unit, 1.6 * unit) - np.array([[0.0], [1.7 * 2.2 * unit]])
        yield Shape("ground", FRAME, line, (FRAME, place), FRAME)


def _driver(cycle: Poses, unit: float) -> Shape:
    """An arrow at the driver: the positive sense of its coordinate, seen from the body that moves."""
    joint = cycle.linkage.joint(cycle.linkage.driver)
    sense = -1 if joint.second == FRAME else 1
    if joint.kind == PIN:
        return Shape("arrow", FRAME, symbols.round_arrow(4.0 * unit, 1.5 * unit, sense), _where(joint), FRAME)
    above = 2.6 * unit if np.cos(joint.direction) > -1e-9 else -2.6 * unit  # of the block, away from the ground
    arrow = symbols.straight_arrow(5.0 * unit, 1.5 * unit) + np.array([[-2.5 * unit], [above]])
    return Shape("arrow", FRAME, symbols.turned(arrow, joint.direction), _where(joint), joint.first)


# -- paths and names -------------------------------------------------------------------------------------------------


def _traces(cycle: Poses, wanted: dict[str, Place], size: float) -> tuple[Trace, ...]:
    """The paths of the points that move, each once."""
    found: list[Trace] = []
    for name, (body, at) in wanted.items():
        path = cycle.point(body, at).value
        if np.ptp(path, axis=1).max() > _SAME * size and not any(np.abs(path - t.path).max() < _SAME * size for t in found):
            found.append(Trace(name, body, path))
    return tuple(found)


def _joint_names(cycle: Poses, named: dict[str, Place], size: float) -> list[Label]:
    """The names of joints and of points that are none, those of one place together."""
    groups: list[tuple[Place, Array, list[str]]] = []
    for name, place in named.items():
        path = cycle.point(*place).value
        same = next((names for _, other, names in groups if np.abs(path - other).max() < _SAME * size), None)
        if same is None:
            groups.append((place, path, [name]))
        elif "." not in name:
            same.append(name)
    return [Label(", ".join(name.rpartition(".")[2] for name in names), FRAME, place) for place, _, names in groups]


def _body_names(cycle: Poses) -> list[Label]:
    """The name of every moving body, at the middle of the points through which it is drawn."""
    labels = []
    for body in cycle.linkage.names[1:]:
        nodes = _nodes(cycle.linkage, body)
        middle = 0.5 * (nodes.min(axis=1) + nodes.max(axis=1)) if nodes.size else np.zeros(2)
        labels.append(Label(body, body, (body, (float(middle[0]), float(middle[1])))))
    return labels
