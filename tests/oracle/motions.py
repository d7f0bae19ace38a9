"""Laws of motion of mechanisms: chains, linkages, harmonics."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tests.oracle import formulas
from tests.oracle.formulas import Both
from tests.oracle.numbers import PI, Jet, Real, atan2, cos, jet, plain, real, reals, sin, sqrt

# Where the mass points of a mechanism are, as jets along the crank angle: positions alone, many angles at once.


Table = dict[str, Any]


class Point(NamedTuple):
    """A mass at (x, y), with weight or without."""

    mass: Any
    x: Jet
    y: Jet
    weighs: bool = True


class Spin(NamedTuple):
    """A moment of inertia that turns by `angle`."""

    inertia: Any
    angle: Jet


class Motion(NamedTuple):
    """All that moves at many crank angles."""

    points: list[Point]
    spins: list[Spin]
    ports: dict[str, Jet]


ARMS = ("drive_length", "clamp_length")
Move = Callable[[Jet, Any], Motion]  # the mechanism's own angle at nodes, and at anchors


def get(table: Table, body: str, key: str) -> Any:
    """A number of a body's table, 0 by default."""
    return real(table.get(body, {}).get(key, 0))


def body(table: Table, name: str, start: tuple[Any, Any], along: Jet) -> tuple[Point, Spin]:
    """The centre of mass and the rotation of a body whose line of pins leaves `start` at the angle `along`."""
    direction, reach = along + get(table, name, "com_angle"), get(table, name, "com")
    centre = Point(get(table, name, "mass"), start[0] + reach * cos(direction), start[1] + reach * sin(direction))
    return centre, Spin(get(table, name, "inertia"), along)


def collect(bodies: list[tuple[Point, Spin]], loose: list[Point], ports: dict[str, Jet]) -> Motion:
    """A motion from rigid bodies and loose mass points."""
    return Motion([p for p, _ in bodies] + loose, [s for _, s in bodies], ports)


def scotch_yoke(table: Table) -> Move:
    """Crank at the origin; the yoke's slot is square to its own direction of travel."""
    r, direction = get(table, "crank", "length"), get(table, "yoke", "direction")

    def move(psi: Jet, anchor: Any) -> Motion:
        pin = Point(get(table, "block", "mass"), r * cos(psi), r * sin(psi))
        along = pin.x * plain.cos(direction) + pin.y * plain.sin(direction)
        yoke = Point(get(table, "yoke", "mass"), along * plain.cos(direction), along * plain.sin(direction))
        return collect([body(table, "crank", (0, 0), psi)], [pin, yoke], {"yoke": along})

    return move


def slider_crank(table: Table) -> Move:
    """The slider is where a circle of the rod's length about the crank pin meets the line y = offset, ahead."""
    r, length, offset = get(table, "crank", "length"), get(table, "rod", "length"), get(table, "slider", "offset")

    def move(psi: Jet, anchor: Any) -> Motion:
        pin = r * cos(psi), r * sin(psi)
        rise = offset - pin[1]
        run = sqrt((length - rise) * (length + rise))
        rod = atan2(rise, run)
        slider = Point(get(table, "slider", "mass"), pin[0] + run, jet(offset))
        bodies = [body(table, "crank", (0, 0), psi), body(table, "rod", pin, rod)]
        return collect(bodies, [slider], {"slider": slider.x, "rod": rod})

    return move


def four_bar(table: Table) -> Move:
    """The far pin is one of the two points where the coupler's circle meets the rocker's."""
    ground, r = get(table, "ground", "length"), get(table, "crank", "length")
    b, c = get(table, "coupler", "length"), get(table, "rocker", "length")
    side = -1 if table.get("assembly", "open") == "crossed" else 1

    def move(psi: Jet, anchor: Any) -> Motion:
        pin = r * cos(psi), r * sin(psi)
        far = joined(pin, (jet(ground), jet(0 * ground)), b, c, side)
        coupler, rocker = atan2(far[1] - pin[1], far[0] - pin[0]), atan2(far[1], far[0] - ground)
        bodies = [body(table, "crank", (0, 0), psi), body(table, "coupler", pin, coupler)]
        ports = {"coupler": coupler, "rocker": rocker}
        return collect([*bodies, body(table, "rocker", (ground, 0), rocker)], [], ports)

    return move


def joined(one: Any, two: Any, b: Any, c: Any, side: int) -> tuple[Jet, Jet]:
    """The point at b from one point and at c from another, to the left of the line between them where side is 1."""
    dx, dy = two[0] - one[0], two[1] - one[1]
    square = dx * dx + dy * dy
    foot = (square + b**2 - c**2) / (2 * square)
    twice = ((b + c) ** 2 - square) * (square - (b - c) ** 2)  # (4 x the triangle's area)²
    height = sqrt(twice) / (2 * square) * side
    return one[0] + foot * dx - height * dy, one[1] + foot * dy + height * dx


def crank_shaper(table: Table) -> Move:
    """Rocker's pivot at the origin, crank's pivot at (d, 0); the rocker points at the crank pin."""
    r, d = get(table, "crank", "length"), get(table, "frame", "length")
    length = get(table, "rocker", "length")

    def move(psi: Jet, anchor: Any) -> Motion:
        pin = d + r * cos(psi), r * sin(psi)
        # where the crank is the longer one the rocker turns with it, and only their difference stays small
        rocker = atan2(pin[1], pin[0]) if r < d else psi + atan2(-d * sin(psi), r + d * cos(psi))
        end = length * cos(rocker), length * sin(rocker)
        loose = [Point(get(table, "block", "mass"), *pin), Point(get(table, "rocker_pin", "mass"), *end)]
        loose.append(Point(get(table, "ram", "mass"), 0 * end[1], end[1]))
        bodies = [body(table, "crank", (d, 0), psi), body(table, "rocker", (0, 0), rocker)]
        motion = collect(bodies, loose, {"rocker": rocker, "ram": end[1]})
        motion.spins.append(Spin(get(table, "block", "inertia"), rocker))
        return motion

    return move


def toggle_clamp(table: Table) -> Move:
    """The block at (-x, height) is the driver, x its own coordinate (m); bell crank at the origin, platen on y = 0."""
    height, drive, clamp = (get(table, *key) for key in (("frame", "height"), *(("bell_crank", k) for k in ARMS)))
    coupler, rod, angle = get(table, "coupler", "length"), get(table, "rod", "length"), get(table, "bell_crank", "angle")
    assembly = table.get("assembly", "open")
    side, ahead = (-1 if assembly.startswith("crossed") else 1), (-1 if assembly.endswith("behind") else 1)

    def move(psi: Jet, anchor: Any) -> Motion:
        block = -psi, jet(height)
        near = joined((jet(0 * height), jet(0 * height)), block, drive, coupler, side)
        arm = atan2(near[1], near[0])
        outer = arm + angle + PI
        far = clamp * cos(outer), clamp * sin(outer)
        run = sqrt((rod - far[1]) * (rod + far[1])) * ahead
        platen = far[0] + run
        link, push = atan2(block[1] - near[1], block[0] - near[0]), atan2(-far[1], run)
        bodies = [
            body(table, "bell_crank", (0, 0), outer),
            body(table, "coupler", near, link),
            body(table, "rod", far, push),
        ]
        loose = [Point(get(table, "block", "mass"), *block), Point(get(table, "platen", "mass"), platen, 0 * platen)]
        return collect(bodies, loose, {"block": psi, "platen": platen, "bell_crank": arm, "coupler": link, "rod": push})

    return move


class Law:
    """Outputs written as functions of the crank angle: expressions, or tables read as periodic cubic splines."""

    def __init__(self, table: Table, cycle: Any, parameters: Table, folder: Path) -> None:
        self.cycle, self.parameters, self.outputs, self.laws = cycle, parameters, table["outputs"], {}
        for name, output in self.outputs.items():
            law = output.get("x", output.get("theta", output.get("table")))
            self.laws[name] = formulas.spline(law, folder) if isinstance(law, dict) else formulas.parse(str(law))

    def env(self, psi: Jet, anchor: Any) -> dict[str, Both]:
        """The names of an output's expression."""
        known = {name: Both(jet(value), value) for name, value in self.parameters.items()}
        return known | {"phi": Both(psi, anchor), "pi": Both(jet(PI), PI)}

    def __call__(self, psi: Jet, anchor: Any) -> Motion:
        shift = plain.floor(anchor / self.cycle) * self.cycle
        here, at = psi - shift, anchor - shift
        ports, points, spins = {}, [], []
        for name, law in self.laws.items():
            if isinstance(law, formulas.Cubics):
                turns = plain.floor((anchor - law.starts[0]) / self.cycle) * self.cycle  # rows may begin anywhere
                ports[name] = law.at(psi - turns, anchor - turns)
            else:
                ports[name] = formulas.evaluate(law, self.env(here, at)).here
            output = self.outputs[name]
            if "mass" in output:
                points.append(Point(real(output["mass"]), ports[name], 0 * ports[name], False))
            elif "inertia" in output:
                spins.append(Spin(real(output["inertia"]), ports[name]))
        return Motion(points, spins, ports)

    def knots(self) -> list[Any]:
        """Own angles where a spline's third derivative jumps, and the cycle's seam."""
        starts = (x for law in self.laws.values() if isinstance(law, formulas.Cubics) for x in law.starts)
        return [0 * PI, *(x - plain.floor(x / self.cycle) * self.cycle for x in starts)]

    def switches(self, psi: Any) -> list[Any]:
        """Values whose sign changes are where an output may bend, at own angles."""
        angle = psi - plain.floor(psi / self.cycle) * self.cycle
        env = self.env(Jet(angle), angle)
        trees = [s for law in self.laws.values() if not isinstance(law, formulas.Cubics) for s in formulas.switches(law)]
        return [formulas.evaluate(tree, env).anchor for tree in trees]


BUILDERS: dict[str, Callable[[Table], Move]] = {
    "scotch-yoke": scotch_yoke, "slider-crank": slider_crank, "four-bar": four_bar, "crank-shaper": crank_shaper,
    "toggle-clamp": toggle_clamp,
}  # fmt: skip


def mechanism(table: Table, cycle: Any, parameters: Table, folder: Path) -> Move:
    """The mechanism of a scene's table."""
    if table["type"] == "law":
        return Law(table, cycle, parameters, folder)
    if table["type"] == "linkage":
        return linkage(table)
    return BUILDERS[table["type"]](table)


# Linkages put together dyad by dyad from their written description: two bodies at a time, each from closed forms.


class Pose(NamedTuple):
    """Position of a body's origin, and its rotation."""

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
            added = next(result for joint in table["joints"] if (result := dyad(table, poses, joint, ports)))
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


# A mechanism over a turn of its own crank, at one angle in a few microseconds: the series of what closed forms say.


SIZES = (64, 128, 256, 512, 1024)
ENDED = 1e-14  # of its greatest part: what the last quarter of a series may hold


class Here(NamedTuple):
    """Reduced inertia, its slope and the work of weights per radian; of each port x and its first two derivatives."""

    inertia: float
    slope: float
    fall: float
    ports: list[tuple[float, float, float]]


class Mechanism:
    """A mechanism with masses added on its ports."""

    def __init__(self, move: Move, period: float, pull: tuple[float, float] | None, added: dict[str, float]) -> None:
        self.move, self.period, self.pull, self.added = move, period, pull, added
        self.names = list(move(Jet(reals(np.zeros(1)), Real(1)), reals(np.zeros(1))).ports)
        sizes = SIZES if period else ()  # a driver that slides comes back nowhere
        self.series = next((s for n in sizes if (s := self._series(n)) is not None), None)

    def rows(self, angles: Any) -> Any:
        """Inertia, slope, fall, then x, x' and x'' of each port, in rows."""
        angles = reals(np.asarray(angles, dtype=float))
        motion = self.move(Jet(angles, Real(1)), angles)
        zero = np.zeros(angles.shape)
        inertia, slope, fall = zero, zero, zero
        flows = [(p.mass, jet(q)) for p in motion.points for q in (p.x, p.y)]
        flows += [(s.inertia, jet(s.angle)) for s in motion.spins]
        flows += [(mass, jet(motion.ports[name])) for name, mass in self.added.items()]
        for mass, x in flows:
            inertia = inertia + float(mass) * np.asarray(x.first**2, dtype=float)
            slope = slope + 2 * float(mass) * np.asarray(x.first * x.second, dtype=float)
        for p in motion.points:
            if self.pull is not None and p.weighs:
                work = self.pull[0] * jet(p.x).first + self.pull[1] * jet(p.y).first
                fall = fall + float(p.mass) * np.asarray(work, dtype=float)
        ports = [np.asarray(part, dtype=float) + zero for n in self.names for part in jet(motion.ports[n])]
        return np.array([inertia + zero, slope + zero, fall + zero, *ports])

    def _series(self, count: int) -> Any:
        """Coefficients (modes, rows), and what each port gains in a radian; None where they do not end."""
        values = self.rows(np.arange(count) * self.period / count)
        if not np.isfinite(values).all():
            return None
        parts = np.fft.rfft(values, axis=1) / count
        gains = np.zeros(len(values))
        for k in range(3, len(values), 3):  # a displacement is the integral of its derivative, which never winds
            gains[k] = parts[k + 1, 0].real
            waves = np.arange(1, parts.shape[1]) * 2 * math.pi / self.period
            parts[k, 1:] = parts[k + 1, 1:] / (1j * waves)
            parts[k, 0] = values[k, 0] - 2 * parts[k, 1:].sum().real
        size = np.abs(parts).max(axis=1, keepdims=True) + 1e-300
        if (np.abs(parts[:, -count // 8 :]) > ENDED * size).any():
            return None
        parts[:, 1:] *= 2
        kept = int(np.flatnonzero((np.abs(parts) > 1e-17 * size).any(axis=0)).max(initial=0)) + 1
        waves = 1j * np.arange(kept) * 2 * math.pi / self.period
        return waves, np.ascontiguousarray(parts[:, :kept].T), gains

    def at(self, angle: float) -> Here:
        """The mechanism at its own angle."""
        if self.series is None:
            row = self.rows([angle])[:, 0].tolist()
        else:
            waves, parts, gains = self.series
            row = ((np.exp(waves * angle) @ parts).real + gains * angle).tolist()
        return Here(row[0], row[1], row[2], [tuple(row[k : k + 3]) for k in range(3, len(row), 3)])  # type: ignore[misc]
