"""Linkages put together dyad by dyad from their written description: two bodies at a time, each from closed forms."""

from __future__ import annotations

from typing import Any, NamedTuple

from .motions import Motion, Move, Point, Spin, Table, joined
from .numbers import Jet, Real, atan2, cos, jet, plain, real, sin, sqrt


class Pose(NamedTuple):
    """Where the origin of a body is, and how it is turned."""

    x: Any
    y: Any
    angle: Any

    def at(self, point: tuple[Any, Any]) -> tuple[Any, Any]:
        """A point of the body, in the frame."""
        c, s = cos(self.angle), sin(self.angle)
        return self.x + c * point[0] - s * point[1], self.y + s * point[0] + c * point[1]


def linkage(table: Table) -> Move:
    """A linkage whose driver is a pin of the frame at phi, made of pins, and of slides on the frame without turning."""

    def move(psi: Jet, anchor: Any) -> Motion:
        zero = jet(Real(0))
        poses = {"frame": Pose(zero, zero, zero)}
        driver = next(j for j in table["joints"] if j["name"] == table["driver"])
        crank, place = driver["between"][1].split(".")[0], poses["frame"].at(local(table, driver["between"][0]))
        poses[crank] = Pose(*place, psi)  # its own point is its origin
        ports: dict[str, Jet] = {}
        while len(poses) < len(table["bodies"]):
            added = next(found for joint in table["joints"] if (found := dyad(table, poses, joint, ports)))
            poses |= added
        moving = {name: pose for name, pose in poses.items() if name not in ("frame", crank)}
        turning = {name: jet(pose.angle) for name, pose in moving.items()}
        return carried(table, poses, turning | ports)  # a slide may be called as its body, which cannot turn

    return move


def carried(table: Table, poses: dict[str, Pose], ports: dict[str, Jet]) -> Motion:
    """Masses and inertias at the bodies' poses, and the ports at points."""
    points, spins = [], []
    for name, pose in poses.items():
        body = table["bodies"][name]
        centre = pose.at(tuple(map(real, body.get("com", (0, 0)))))
        points.append(Point(real(body.get("mass", 0)), jet(centre[0]), jet(centre[1])))
        spins.append(Spin(real(body.get("inertia", 0)), jet(pose.angle)))
    for name, port in table.get("ports", {}).items():
        owner = port["point"].split(".")[0]
        x, y = poses[owner].at(local(table, port["point"]))
        aim = real(port.get("direction", 0))
        ports[name] = x * plain.cos(aim) + y * plain.sin(aim)
    return Motion(points, spins, ports)


def local(table: Table, name: str) -> tuple[Any, Any]:
    """A point in its own body's frame."""
    body, _, point = name.partition(".")
    raw = (0, 0) if point == "origin" else table["bodies"][body]["points"][point]
    return real(raw[0]), real(raw[1])


def pinned(table: Table, body: str, poses: dict[str, Pose]) -> tuple[str, Any, str] | None:
    """A pin of a body to a known one: the body's own point, where it is, and the known body's point."""
    for joint in table["joints"]:
        if joint["type"] == "pin":
            for here, there in (joint["between"], joint["between"][::-1]):
                if here.split(".")[0] == body and there.split(".")[0] in poses:
                    return here, poses[there.split(".")[0]].at(local(table, there)), there
    return None


def dyad(table: Table, poses: dict[str, Pose], joint: Table, ports: dict[str, Jet]) -> dict[str, Pose]:
    """The poses of the two bodies that a pin joins, once both hang on known ones; none where they do not."""
    one, two = (point.split(".")[0] for point in joint["between"])
    if joint["type"] != "pin" or one in poses or two in poses:
        return {}
    first = pinned(table, one, poses)
    slide = next((j for j in table["joints"] if j["type"] == "slide" and j["between"][1].split(".")[0] == two), None)
    if first is not None and slide is not None:
        return sliding(table, first, joint, slide, ports)
    second = pinned(table, two, poses)
    return {} if first is None or second is None else barred(table, first, second, joint)


def barred(table: Table, first: Any, second: Any, joint: Table) -> dict[str, Pose]:
    """Two bars: their common pin on the side of the line between the known pins that `assembly` says."""
    marks = [m for m in table["assembly"] if m["point"] in joint["between"]]
    (mark,) = marks
    side = (1 if mark["side"] == "left" else -1) * (1 if mark["from"] in (first[0], first[2]) else -1)
    a, b = (bar(table, known[0], end) for known, end in zip((first, second), joint["between"], strict=True))
    x, y = joined(first[1], second[1], a[0], b[0], side)
    ends = zip((first, second), (a, b), joint["between"], strict=True)
    return {end.split(".")[0]: posed(table, known, along, (x, y)) for known, along, end in ends}


def bar(table: Table, start: str, end: str) -> tuple[Any, Any]:
    """Length and own angle of the line between two points of a body."""
    (ax, ay), (bx, by) = local(table, start), local(table, end)
    return plain.sqrt((bx - ax) ** 2 + (by - ay) ** 2), plain.arctan2(by - ay, bx - ax)


def posed(table: Table, known: Any, along: Any, end: Any) -> Pose:
    """A body from a known point of it and the place of a second one."""
    angle = atan2(end[1] - known[1][1], end[0] - known[1][0]) - along[1]
    rough = Pose(jet(Real(0)), jet(Real(0)), angle).at(local(table, known[0]))
    return Pose(known[1][0] - rough[0], known[1][1] - rough[1], angle)


def sliding(table: Table, first: Any, joint: Table, slide: Table, ports: dict[str, Jet]) -> dict[str, Pose]:
    """A bar and a body on a guide of the frame: of the two places on it the one further along."""
    along, aim = bar(table, first[0], joint["between"][0]), real(slide.get("direction", 0))
    ux, uy = plain.cos(aim), plain.sin(aim)
    guide, pin = local(table, slide["between"][0]), local(table, joint["between"][1])
    wx, wy = guide[0] + pin[0] - first[1][0], guide[1] + pin[1] - first[1][1]
    across = wx * uy - wy * ux
    q = sqrt((along[0] - across) * (along[0] + across)) - (wx * ux + wy * uy)
    ports[slide["name"]] = q
    block = Pose(guide[0] + q * ux, guide[1] + q * uy, jet(0 * aim))
    end = block.at(pin)
    one, two = (point.split(".")[0] for point in joint["between"])
    return {one: posed(table, first, along, end), two: block}
