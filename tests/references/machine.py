"""A scene as a machine at 45 digits: kinetic energy and virtual work per radian of crank, smooth between breakpoints."""

from __future__ import annotations

import ast
import itertools
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from mpmath import mp  # type: ignore[import-untyped]

from . import tables
from .jets import Jet, jet
from .kinematics import Law, Mechanism, Motion, mechanism
from .quantities import frozen, parse, quantity, signed, switches

Function = Callable[[Any], Any]
GRID = 1440  # steps of a cycle in which the sign changes that make breakpoints are looked for


class Part(NamedTuple):
    """A mechanism on its shaft: its own crank angle is ratio phi + phase."""

    name: str
    ratio: Any
    phase: Any
    motion: Mechanism

    def angle(self, phi: Any) -> Any:
        """The mechanism's own crank angle."""
        return self.ratio * phi + self.phase

    def seen(self, function: Function, phi: Any) -> Any:
        """A function of the mechanism's own angle, at a crank angle."""
        return function(self.angle(phi))


class Place(NamedTuple):
    """A shaft (part None) or a port of a part."""

    ratio: Any
    phase: Any
    part: int | None
    port: str


class Load(NamedTuple):
    """An effort at a place: a window, a sense of motion, and a law (a tree, a table, a number, the unknown)."""

    place: Place
    every: Any
    window: tuple[Any, Any] | None
    sense: int
    law: Any
    drive: bool


class Term(NamedTuple):
    """One reduced moment: constant + share * unknown; whether it is the drive's."""

    constant: Any
    share: Any
    drive: bool


class Sample(NamedTuple):
    """What one crank angle has: I*, dI*/dphi, and the reduced moments that make up M*."""

    inertia: Any
    slope: Any
    terms: list[Term]


class Machine:
    """Everything of a scene that moves or pushes, without the flywheel."""

    def __init__(self, scene: dict[str, Any], folder: Path) -> None:
        self.scene = scene
        self.cycle = quantity(scene["regime"].get("cycle", 2 * mp.pi))
        self.shafts = {"crank": mp.one}
        self.shafts |= {name: quantity(shaft["ratio"]) for name, shaft in scene.get("shafts", {}).items()}
        written = scene.get("parameters", {})
        self.unknown = next((name for name, raw in written.items() if raw == "balance"), None)
        self.parameters = {name: quantity(raw) for name, raw in written.items() if raw != "balance"}
        self.parts = [self.part(table, folder) for table in listed(scene.get("mechanism", []))]
        self.loads = [self.load(table, folder) for table in scene.get("load", [])]
        if "drive" in scene:
            self.loads.append(self.load({"on": "crank", **scene["drive"]}, folder, drive=True))
        self.springs = [(self.place(s["on"]), s) for s in scene.get("spring", [])]
        self.added = [(self.place(i["on"]), quantity(i["value"])) for i in scene.get("inertia", [])]
        self.breaks = self.breakpoints()

    def part(self, table: dict[str, Any], folder: Path) -> Part:
        """One mechanism with the shaft it hangs on."""
        motion = mechanism(table, self.cycle, self.parameters, folder)
        ratio = self.shafts[table.get("shaft", "crank")]
        return Part(table.get("name", table["type"]), ratio, quantity(table.get("phase", 0)), motion)

    def place(self, name: str) -> Place:
        """The shaft or port of a name."""
        if name in self.shafts:
            return Place(self.shafts[name], mp.zero, None, name)
        owner, _, port = name.rpartition(".")
        for i, part in enumerate(self.parts):
            if owner == part.name or (not owner and port in part.motion(mp.one)(jet(mp.one)).ports):
                return Place(part.ratio, part.phase, i, port)
        raise KeyError(name)

    def load(self, table: dict[str, Any], folder: Path, *, drive: bool = False) -> Load:
        """One load; a text that is no quantity is an expression."""
        every = quantity(table.get("every", self.cycle))
        window = (quantity(table["from"]), quantity(table["to"])) if "from" in table else None
        if window and abs(window[1] - window[0] - every) < mp.mpf("1e-30"):
            window = None
        sense = {"v > 0": 1, "v < 0": -1}.get(table.get("while", ""), 0)
        law: Any = tables.stretches(table["table"], folder) if "table" in table else None
        raw = table.get("force", table.get("torque"))
        if raw == "balance":
            law = "balance"
        elif raw is not None:
            try:
                law = quantity(raw)
            except ValueError:
                law = parse(raw)
        return Load(self.place(table["on"]), every, window, sense, law, drive)

    # --- motion -------------------------------------------------------------------------------------------------

    def displacement(self, place: Place, phi: Jet, motions: list[Motion]) -> Jet:
        """The displacement of a place."""
        return place.ratio * phi if place.part is None else motions[place.part].ports[place.port]

    def piece(self, middle: Any) -> Callable[[Any], Sample]:
        """The machine around an angle, every window, table and comparison decided there: smooth in phi."""
        moves = [part.motion(part.angle(middle)) for part in self.parts]

        def motions(phi: Jet) -> list[Motion]:
            return [move(part.angle(phi)) for part, move in zip(self.parts, moves, strict=True)]

        efforts = [self.effort(load, middle, motions(Jet(middle, mp.one))) for load in self.loads]

        def sample(phi: Any) -> Sample:
            here = Jet(phi, mp.one)
            now = motions(here)
            terms = [effort(here, now) for effort in efforts if effort is not None]
            return Sample(*self.kinetic(here, now), terms + self.passive(here, now))

        return sample

    def kinetic(self, phi: Jet, motions: list[Motion]) -> tuple[Any, Any]:
        """I* = sum m (x'² + y'²) + sum J theta'², and its slope."""
        flows = [(p.mass, q) for m in motions for p in (*m.points, *m.weightless) for q in (p.x, p.y)]
        flows += [(s.inertia, s.angle) for m in motions for s in m.spins]
        flows += [(value, self.displacement(place, phi, motions)) for place, value in self.added]
        flows = [(value, jet(q)) for value, q in flows if value]
        return (
            mp.fsum(value * q.first**2 for value, q in flows),
            2 * mp.fsum(value * q.first * q.second for value, q in flows),
        )

    def passive(self, phi: Jet, motions: list[Motion]) -> list[Term]:
        """The reduced moments of weights and springs."""
        works = []
        if "gravity" in self.scene:
            gravity = self.scene["gravity"]
            g = quantity(gravity.get("g", "9.80665 m/s^2"))
            aim = quantity(gravity.get("direction", "-90 deg"))
            points = [p for m in motions for p in m.points if p.mass]
            works += [p.mass * g * (mp.cos(aim) * jet(p.x).first + mp.sin(aim) * jet(p.y).first) for p in points]
        for place, spring in self.springs:
            x = self.displacement(place, phi, motions)
            works.append(-quantity(spring["stiffness"]) * (x.value - quantity(spring.get("rest", 0))) * x.first)
        return [Term(work, mp.zero, False) for work in works]

    # --- loads --------------------------------------------------------------------------------------------------

    def angle(self, load: Load, phi: Any) -> Any:
        """The angle a load sees before it is brought into its period."""
        return load.place.ratio * phi + load.place.phase if load.place.part is not None else phi

    def effort(self, load: Load, middle: Any, motions: list[Motion]) -> Callable[[Jet, Any], Term] | None:
        """The reduced moment of a load around an angle; None where it is idle."""
        seen = self.angle(load, middle)
        shift = mp.floor(seen / load.every) * load.every
        x = self.displacement(load.place, Jet(middle, mp.one), motions)
        if not active(load, seen - shift) or (load.sense and load.sense * x.first < 0):
            return None
        law = self.smooth(load, seen - shift, x)

        def work(phi: Jet, now: list[Motion]) -> Term:
            at = self.displacement(load.place, phi, now)
            constant, share = law(self.angle(load, phi.value) - shift, at)
            return Term(constant * at.first, share * at.first, load.drive)

        return work

    def env(self, load: Load, angle: Any, x: Jet, unknown: Any) -> dict[str, Any]:
        """The names a load's expression may use; of `v` only the sign may matter."""
        names = {"phi": angle, "x": x.value, "v": x.first, "pi": mp.pi, **self.parameters}
        return names | ({self.unknown: unknown} if self.unknown else {})

    def smooth(self, load: Load, angle: Any, x: Jet) -> Callable[[Any, Jet], tuple[Any, Any]]:
        """The law of a load around an angle: (constant, share of the unknown) at an angle and displacement."""
        law = load.law
        if isinstance(law, str):
            return lambda angle, x: (mp.zero, mp.one)
        if isinstance(law, list):
            turns = (angle + turn * load.every for turn in (-1, 0, 1))
            inside = next(a for a in turns if law[0].start <= a < law[-1].end)
            stretch = next(p for p in law if inside < p.end)
            return lambda a, x: (stretch(a + inside - angle), mp.zero)
        if isinstance(law, mp.mpf):
            return lambda angle, x: (law, mp.zero)
        formula = frozen(law, self.env(load, angle, x, mp.one))

        def linear(at: Any, place: Jet) -> tuple[Any, Any]:
            constant = formula(self.env(load, at, place, mp.zero)).value
            if self.unknown is None:
                return constant, mp.zero
            return constant, formula(self.env(load, at, place, mp.one)).value - constant

        return linear

    # --- breakpoints --------------------------------------------------------------------------------------------

    def breakpoints(self) -> list[Any]:
        """Ascending angles of a cycle, its ends included, between which everything is smooth."""
        found = [mp.zero, self.cycle, *self.known()]
        for function in self.signs():
            found += sign_changes(function, self.cycle)
        tiny = mp.mpf("1e-25")
        kept: list[Any] = []
        for angle in sorted(a for a in found if -tiny < a < self.cycle + tiny):
            if not kept or angle - kept[-1] > tiny:
                kept.append(angle)
        return kept

    def known(self) -> Iterator[Any]:
        """Breakpoints that the scene itself names: windows, knots, seams."""
        for load in self.loads:
            marks = [mp.zero, *(load.window or ())]
            if isinstance(load.law, list):
                marks += [p.start for p in load.law] + [load.law[-1].end]
            ratio, phase = (load.place.ratio, load.place.phase) if load.place.part is not None else (mp.one, mp.zero)
            yield from repeated(marks, load.every, ratio, phase, self.cycle)
        for part in self.parts:
            if isinstance(part.motion, Law):
                yield from repeated(part.motion.knots(), self.cycle, part.ratio, part.phase, self.cycle)

    def signs(self) -> Iterator[Function]:
        """Functions of phi whose sign changes are breakpoints."""
        for part in self.parts:
            if isinstance(part.motion, Law):
                yield from (partial(part.seen, switch) for switch in part.motion.switches())
        for load in self.loads:
            if load.sense:
                yield partial(self.flow, load)
            if not isinstance(load.law, (str, list, mp.mpf)):
                yield from (partial(self.switch, load, tree) for tree in switches(load.law))

    def at(self, load: Load, phi: Any) -> Jet:
        """The displacement of a load's place at any angle, decisions taken right there."""
        here = Jet(phi, mp.one)
        return self.displacement(load.place, here, [p.motion(p.angle(phi))(p.angle(here)) for p in self.parts])

    def flow(self, load: Load, phi: Any) -> Any:
        """The velocity of a load's place over that of the crank, at any angle."""
        return self.at(load, phi).first

    def switch(self, load: Load, tree: ast.expr, phi: Any) -> Any:
        """The value of a switch of a load's expression at any angle."""
        angle = self.angle(load, phi) % load.every
        return signed(tree, self.env(load, angle, self.at(load, phi), mp.one))


def listed(tables: Any) -> list[Any]:
    """One table or several, as a list."""
    return tables if isinstance(tables, list) else [tables]


def active(load: Load, angle: Any) -> bool:
    """Whether a load's window is open at an angle of its period."""
    if load.window is None:
        return True
    start, end = (edge % load.every for edge in load.window)
    return bool(start <= angle < end) if start < end else bool(angle >= start or angle < end)


def repeated(marks: list[Any], every: Any, ratio: Any, phase: Any, cycle: Any) -> Iterator[Any]:
    """The crank angles of a cycle at which ratio phi + phase is one of the marks, modulo `every`."""
    for mark in marks:
        turn = mp.ceil((phase - mark) / every)
        while (mark + turn * every - phase) / ratio <= cycle:
            yield (mark + turn * every - phase) / ratio
            turn += 1


def sign_changes(function: Function, cycle: Any) -> list[Any]:
    """The angles of a cycle where a function changes its sign, from a grid that misses the round angles."""
    grid = [cycle * (i + mp.mpf("0.3141")) / GRID for i in range(-1, GRID + 1)]
    signs = [(phi, function(phi)) for phi in grid]
    pairs = itertools.pairwise(signs)
    return [bracketed(function, a, b, fa, fb) for (a, fa), (b, fb) in pairs if fa * fb < 0]


def bracketed(function: Function, a: Any, b: Any, fa: Any, fb: Any) -> Any:
    """The root between a and b, where the function has opposite signs: Illinois' regula falsi, bisecting as a guard."""
    fine = mp.mpf(10) ** (5 - mp.dps)
    for turn in range(400):
        c = (a + b) / 2 if turn % 8 == 7 else b - fb * (b - a) / (fb - fa)
        fc = function(c)
        if fc == 0:
            return c
        if fc * fb < 0:
            a, fa = b, fb
        else:
            fa /= 2
        moved, b, fb = abs(c - b), c, fc
        if abs(b - a) < fine or moved < fine * mp.mpf("0.01"):
            break
    return b
