"""Where the mass points of a mechanism are, as jets along the crank angle: positions alone, many angles at once."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from . import formulas, tables
from .formulas import Both
from .numbers import PI, Jet, atan2, cos, jet, plain, real, sin, sqrt

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


class Law:
    """Outputs written as functions of the crank angle: expressions, or tables read as periodic cubic splines."""

    def __init__(self, table: Table, cycle: Any, parameters: Table, folder: Path) -> None:
        self.cycle, self.parameters, self.outputs, self.laws = cycle, parameters, table["outputs"], {}
        for name, output in self.outputs.items():
            law = output.get("x", output.get("theta", output.get("table")))
            self.laws[name] = tables.spline(law, folder) if isinstance(law, dict) else formulas.parse(str(law))

    def env(self, psi: Jet, anchor: Any) -> dict[str, Both]:
        """The names of an output's expression."""
        known = {name: Both(jet(value), value) for name, value in self.parameters.items()}
        return known | {"phi": Both(psi, anchor), "pi": Both(jet(PI), PI)}

    def __call__(self, psi: Jet, anchor: Any) -> Motion:
        shift = plain.floor(anchor / self.cycle) * self.cycle
        here, at = psi - shift, anchor - shift
        ports, points, spins = {}, [], []
        for name, law in self.laws.items():
            if isinstance(law, tables.Cubics):
                ports[name] = law.at(here, at)
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
        return [0 * PI, *(x for law in self.laws.values() if isinstance(law, tables.Cubics) for x in law.starts)]

    def switches(self, psi: Any) -> list[Any]:
        """Values whose sign changes are where an output may bend, at own angles."""
        angle = psi - plain.floor(psi / self.cycle) * self.cycle
        env = self.env(Jet(angle), angle)
        trees = [s for law in self.laws.values() if not isinstance(law, tables.Cubics) for s in formulas.switches(law)]
        return [formulas.evaluate(tree, env).anchor for tree in trees]


BUILDERS: dict[str, Callable[[Table], Move]] = {
    "scotch-yoke": scotch_yoke, "slider-crank": slider_crank, "four-bar": four_bar, "crank-shaper": crank_shaper,
}  # fmt: skip


def mechanism(table: Table, cycle: Any, parameters: Table, folder: Path) -> Move:
    """The mechanism of a scene's table."""
    if table["type"] == "law":
        return Law(table, cycle, parameters, folder)
    if table["type"] == "linkage":
        from .linkages import linkage

        return linkage(table)
    return BUILDERS[table["type"]](table)
