"""Where every mass point of a mechanism is: positions as jets along the crank angle, from geometry alone.

Velocities, kinetic energy and virtual work follow by differentiation; no influence coefficient is written down.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from mpmath import mp  # type: ignore[import-untyped]

from . import tables
from .jets import Jet, atan2, cos, jet, sin, sqrt
from .quantities import frozen, parse, quantity, signed, switches

Table = dict[str, Any]


class Point(NamedTuple):
    """A mass at (x, y)."""

    mass: Any
    x: Jet
    y: Jet


class Spin(NamedTuple):
    """A moment of inertia that turns by `angle`."""

    inertia: Any
    angle: Jet


class Motion(NamedTuple):
    """All that moves at one crank angle: mass points (with or without weight), rotations, the ports' displacements."""

    points: list[Point]
    spins: list[Spin]
    ports: dict[str, Jet]
    weightless: list[Point] = []  # noqa: RUF012 (never written to)


Move = Callable[[Jet], Motion]
Mechanism = Callable[[Any], Move]  # decisions are taken at an angle of the mechanism's crank, then positions are smooth


def get(table: Table, body: str, key: str) -> Any:
    """A number of a body's table, 0 by default."""
    return quantity(table.get(body, {}).get(key, 0))


def body(table: Table, name: str, start: tuple[Any, Any], along: Jet) -> tuple[Point, Spin]:
    """The centre of mass and the rotation of a body whose line of pins leaves `start` at the angle `along`."""
    direction = along + get(table, name, "com_angle")
    reach = get(table, name, "com")
    centre = Point(get(table, name, "mass"), start[0] + reach * cos(direction), start[1] + reach * sin(direction))
    return centre, Spin(get(table, name, "inertia"), along)


def collect(bodies: list[tuple[Point, Spin]], loose: list[Point], ports: dict[str, Jet]) -> Motion:
    """A motion from rigid bodies and loose mass points."""
    return Motion([p for p, _ in bodies] + loose, [s for _, s in bodies], ports)


def scotch_yoke(table: Table) -> Move:
    """Crank at the origin; the yoke's slot is square to its own direction of travel."""
    r, direction = get(table, "crank", "length"), get(table, "yoke", "direction")

    def move(psi: Jet) -> Motion:
        pin = Point(get(table, "block", "mass"), r * cos(psi), r * sin(psi))
        along = pin.x * mp.cos(direction) + pin.y * mp.sin(direction)
        yoke = Point(get(table, "yoke", "mass"), along * mp.cos(direction), along * mp.sin(direction))
        return collect([body(table, "crank", (0, 0), psi)], [pin, yoke], {"yoke": along})

    return move


def slider_crank(table: Table) -> Move:
    """The slider is where a circle of the rod's length about the crank pin meets the line y = offset, ahead."""
    r, length, offset = get(table, "crank", "length"), get(table, "rod", "length"), get(table, "slider", "offset")

    def move(psi: Jet) -> Motion:
        pin = r * cos(psi), r * sin(psi)
        rise = offset - pin[1]
        run = sqrt(length**2 - rise * rise)
        slider = Point(get(table, "slider", "mass"), pin[0] + run, jet(offset))
        rod = atan2(rise, run)
        bodies = [body(table, "crank", (0, 0), psi), body(table, "rod", pin, rod)]
        return collect(bodies, [slider], {"slider": slider.x, "rod": rod})

    return move


def four_bar(table: Table) -> Move:
    """The far pin is one of the two points where the coupler's circle meets the rocker's."""
    ground, r = get(table, "ground", "length"), get(table, "crank", "length")
    b, c = get(table, "coupler", "length"), get(table, "rocker", "length")
    side = -1 if table.get("assembly", "open") == "crossed" else 1

    def move(psi: Jet) -> Motion:
        pin = r * cos(psi), r * sin(psi)
        dx, dy = ground - pin[0], -pin[1]  # from the crank pin to the rocker's pivot
        square = dx * dx + dy * dy
        foot = (square + b**2 - c**2) / (2 * square)
        height = sqrt(b**2 / square - foot * foot) * side  # both as shares of the diagonal
        far = pin[0] + foot * dx - height * dy, pin[1] + foot * dy + height * dx
        coupler, rocker = atan2(far[1] - pin[1], far[0] - pin[0]), atan2(far[1], far[0] - ground)
        pivot = (ground, 0)
        bodies = [body(table, "crank", (0, 0), psi), body(table, "coupler", pin, coupler)]
        return collect([*bodies, body(table, "rocker", pivot, rocker)], [], {"coupler": coupler, "rocker": rocker})

    return move


def crank_shaper(table: Table) -> Move:
    """Rocker's pivot at the origin, crank's pivot at (d, 0); the rocker points at the crank pin."""
    r, d = get(table, "crank", "length"), get(table, "frame", "length")
    length = get(table, "rocker", "length")

    def move(psi: Jet) -> Motion:
        pin = d + r * cos(psi), r * sin(psi)
        # where the crank is the longer one the rocker turns with it, and only their difference stays small
        rocker = atan2(pin[1], pin[0]) if r < d else psi + atan2(-d * sin(psi), r + d * cos(psi))
        end = length * cos(rocker), length * sin(rocker)
        loose = [Point(get(table, "block", "mass"), *pin), Point(get(table, "rocker_pin", "mass"), *end)]
        loose.append(Point(get(table, "ram", "mass"), jet(0), end[1]))
        bodies = [body(table, "crank", (d, 0), psi), body(table, "rocker", (0, 0), rocker)]
        motion = collect(bodies, loose, {"rocker": rocker, "ram": end[1]})
        motion.spins.append(Spin(get(table, "block", "inertia"), rocker))
        return motion

    return move


class Law:
    """Outputs written as functions of the crank angle: expressions, or tables read as periodic cubic splines."""

    def __init__(self, table: Table, cycle: Any, parameters: dict[str, Any], folder: Path) -> None:
        self.cycle, self.parameters, self.outputs = cycle, parameters, table["outputs"]
        self.laws: dict[str, Any] = {}
        for name, output in self.outputs.items():
            law = output.get("x", output.get("theta"))
            if isinstance(law, dict):
                self.laws[name] = tables.periodic_spline(*tables.columns(law, folder))
            elif law is not None:
                self.laws[name] = parse(str(law))
            else:
                self.laws[name] = tables.periodic_spline(*tables.columns(output["table"], folder))

    def env(self, angle: Any) -> dict[str, Any]:
        """The names an output's expression may use."""
        return {"phi": angle, "pi": mp.pi, **self.parameters}

    def __call__(self, middle: Any) -> Move:
        shift = mp.floor(middle / self.cycle) * self.cycle
        laws = {name: self.smooth(law, middle - shift) for name, law in self.laws.items()}

        def move(psi: Jet) -> Motion:
            ports = {name: law(psi - shift) for name, law in laws.items()}
            points, spins = [], []
            for name, output in self.outputs.items():
                if "mass" in output:
                    points.append(Point(quantity(output["mass"]), ports[name], jet(0)))
                elif "inertia" in output:
                    spins.append(Spin(quantity(output["inertia"]), ports[name]))
            return Motion([], spins, ports, points)

        return move

    def smooth(self, law: Any, angle: Any) -> Callable[[Jet], Jet]:
        """A law around an angle: its spline's cubic, or its expression with every decision taken."""
        if isinstance(law, list):
            span = law[-1].end - law[0].start
            turns = mp.floor((angle - law[0].start) / span)
            piece = next(p for p in law if angle - turns * span < p.end)
            gain = turns * (law[-1](law[-1].end) - law[0](law[0].start))
            return lambda psi: jet(piece(psi - turns * span)) + gain
        formula = frozen(law, self.env(angle))
        return lambda psi: jet(formula(self.env(psi)))

    def knots(self) -> list[Any]:
        """Angles where a spline's third derivative jumps, and the cycle's seam."""
        return [mp.zero, *(piece.start for law in self.laws.values() if isinstance(law, list) for piece in law)]

    def switches(self) -> list[Callable[[Any], Any]]:
        """Functions of the angle whose zeros are where an output's expression may bend."""
        trees = [s for law in self.laws.values() if not isinstance(law, list) for s in switches(law)]
        return [partial(self.switch, tree) for tree in trees]

    def switch(self, tree: ast.expr, angle: Any) -> Any:
        """The value of a switch at any angle."""
        return signed(tree, self.env(angle % self.cycle))


BUILDERS = {
    "scotch-yoke": scotch_yoke, "slider-crank": slider_crank, "four-bar": four_bar, "crank-shaper": crank_shaper,
}  # fmt: skip


def mechanism(table: Table, cycle: Any, parameters: dict[str, Any], folder: Path) -> Mechanism:
    """The mechanism of a scene's table."""
    if table["type"] == "law":
        return Law(table, cycle, parameters, folder)
    move = BUILDERS[table["type"]](table)
    return lambda middle: move
