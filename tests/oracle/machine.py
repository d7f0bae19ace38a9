"""A scene as kinetic energy and virtual work per radian of crank, at many angles at once."""

from __future__ import annotations

import ast
import itertools
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tests.oracle import formulas
from tests.oracle.formulas import Both
from tests.oracle.motions import Law, Motion, Move, mechanism
from tests.oracle.numbers import DIGITS, PI, Jet, Real, bracketed, finer, jet, plain, real, reals

GRID = 1440 if DIGITS else 6000  # steps of a cycle in which the sign changes that make breakpoints are looked for
TINY = Real(finer(16))  # rad: breakpoints closer than this are one


class Part(NamedTuple):
    """A mechanism: its own crank angle is ratio phi + phase."""

    name: str
    shaft: str
    ratio: Any
    phase: Any
    move: Move


class Place(NamedTuple):
    """A shaft (part None) or a port of a part."""

    shaft: str
    ratio: Any
    phase: Any
    part: int | None
    port: str


class Load(NamedTuple):
    """An effort at a place: a window, a sense of motion, and a law (a tree, a table, a number, "balance")."""

    place: Place
    every: Any
    window: tuple[Any, Any] | None
    sense: int
    law: Any
    drive: bool

    @property
    def offset(self) -> tuple[Any, Any]:
        """Ratio and phase of the angle that it sees."""
        return (Real(1), Real(0)) if self.place.part is None else (self.place.ratio, self.place.phase)


class Term(NamedTuple):
    """One reduced moment: constant + share * unknown, on a shaft; whether it is the drive's."""

    shaft: str
    constant: Any
    share: Any
    drive: bool


class Sample(NamedTuple):
    """I* and dI*/dphi of every shaft, and all moments."""

    inertia: dict[str, Any]
    slope: dict[str, Any]
    terms: list[Term]


class Frame(NamedTuple):
    """A machine at many angles: jets of these and of their anchors, motions at both, and what depends on no speed."""

    here: Jet
    at: Jet
    now: list[Motion]
    then: list[Motion]
    inertia: dict[str, Any]
    slope: dict[str, Any]
    passive: list[Term]


class Machine:
    """Everything of a scene that moves or pushes, without the flywheel."""

    def __init__(self, scene: dict[str, Any], folder: Path = Path()) -> None:
        self.scene, self.folder = scene, folder
        self.cycle = real(scene.get("regime", {}).get("cycle", "360 deg"))
        shafts = scene.get("shafts", {})
        self.shafts = {"crank": Real(1)} | {name: real(shaft["ratio"]) for name, shaft in shafts.items()}
        self.efficiency = {n: real(s["efficiency"]) for n, s in shafts.items() if s.get("efficiency", 1) != 1}
        written = scene.get("parameters", {})
        self.unknown = next((name for name, raw in written.items() if raw == "balance"), None)
        self.parameters = {name: real(raw) for name, raw in written.items() if raw != "balance"}
        result = scene.get("mechanism", [])
        self.parts = [self.part(table) for table in (result if isinstance(result, list) else [result])]
        self.loads = [self.load(table) for table in scene.get("load", [])]
        if "drive" in scene:
            self.loads.append(self.load({"on": "crank", **scene["drive"]}, drive=True))
        self.balanced = self.unknown is not None or any(isinstance(load.law, str) for load in self.loads)
        self.springs = [(self.place(s["on"]), s) for s in scene.get("spring", [])]
        self.dampers = [(self.place(d["on"]), real(d["coefficient"])) for d in scene.get("damper", [])]
        self.added = [(self.place(i["on"]), real(i["value"])) for i in scene.get("inertia", [])]
        self.breaks = self.breakpoints()

    @property
    def moving(self) -> bool:
        """True if torques depend on speed or acceleration."""
        laws = [load.law for load in self.loads if isinstance(load.law, ast.expr)]
        return bool(self.dampers or self.efficiency) or any(formulas.names(law) & {"omega"} for law in laws)

    def part(self, table: dict[str, Any]) -> Part:
        """One mechanism with the shaft it hangs on."""
        shaft = table.get("shaft", "crank")
        move = mechanism(table, self.cycle, self.parameters, self.folder)
        return Part(table.get("name", table["type"]), shaft, self.shafts[shaft], real(table.get("phase", 0)), move)

    def place(self, name: str) -> Place:
        """The shaft or port of a name."""
        if name in self.shafts:
            return Place(name, self.shafts[name], Real(0), None, name)
        owner, _, port = name.rpartition(".")
        for i, part in enumerate(self.parts):
            if owner == part.name or (not owner and port in part.move(Jet(Real(1)), Real(1)).ports):
                return Place(part.shaft, part.ratio, part.phase, i, port)
        raise KeyError(name)

    def load(self, table: dict[str, Any], *, drive: bool = False) -> Load:
        """One load; a text that is no number is an expression."""
        every = real(table.get("every", self.cycle))
        window = (real(table["from"]), real(table["to"])) if "from" in table else None
        if window and abs(window[1] - window[0] - every) < TINY:
            window = None
        sense = {"v > 0": 1, "v < 0": -1}.get(table.get("while", ""), 0)
        law: Any = (
            formulas.pieces(table["table"], self.folder) if "table" in table else table.get("force", table.get("torque"))
        )
        if "motor" in table:  # of the type `line`
            start, speed = (repr(table["motor"][key]) for key in ("starting_torque", "no_load_speed"))
            law = f"{start} - {start}/{speed}*omega"
        if isinstance(law, str) and law != "balance":
            try:
                law = real(law)
            except ValueError:
                law = formulas.parse(law)
        elif not isinstance(law, str | formulas.Cubics):
            law = real(law)
        return Load(self.place(table["on"]), every, window, sense, law, drive)

    def motions(self, phi: Jet, anchor: Any) -> list[Motion]:
        """Every mechanism at crank angles."""
        return [p.move(p.ratio * phi + p.phase, p.ratio * anchor + p.phase) for p in self.parts]

    def displacement(self, place: Place, phi: Jet, motions: list[Motion]) -> Jet:
        """The displacement of a place."""
        return place.ratio * phi if place.part is None else motions[place.part].ports[place.port]

    def frame(self, phi: Any, anchor: Any) -> Frame:
        """Everything that moves at angles (panels, nodes), branches as at anchors (panels, 1); no speed is in it."""
        here, at = Jet(phi, Real(1)), Jet(anchor, Real(1))
        now = self.motions(here, anchor)
        return Frame(here, at, now, self.motions(at, anchor), *self.kinetic(here, now), self.passive(here, now))

    def sample(self, phi: Any, anchor: Any) -> Sample:
        """The machine at angles (panels, nodes), its branches as at anchors (panels, 1)."""
        return self.sampled(self.frame(phi, anchor), None, None)

    def sampled(self, frame: Frame, omega: Any, omega_anchor: Any) -> Sample:
        """The same at crank speeds."""
        terms = [self.work(load, *frame[:4], (omega, omega_anchor)) for load in self.loads]
        terms += frame.passive + self.damped(frame.here, frame.now, omega)
        return Sample(frame.inertia, frame.slope, terms)

    def kinetic(self, phi: Jet, motions: list[Motion]) -> tuple[dict[str, Any], dict[str, Any]]:
        """I* = sum m (x'² + y'²) + sum J theta'² of every shaft, and its slope."""
        flows = [(p.shaft, q.mass, x) for p, m in zip(self.parts, motions, strict=True) for q in m.points for x in q[1:3]]
        flows += [(p.shaft, s.inertia, s.angle) for p, m in zip(self.parts, motions, strict=True) for s in m.spins]
        flows += [(place.shaft, value, self.displacement(place, phi, motions)) for place, value in self.added]
        zero = np.zeros_like(phi.value)
        inertia, slope = dict.fromkeys(self.shafts, zero), dict.fromkeys(self.shafts, zero)
        for shaft, value, raw in flows:
            x = jet(raw)
            inertia[shaft] = inertia[shaft] + value * x.first**2
            slope[shaft] = slope[shaft] + 2 * value * x.first * x.second
        return inertia, slope

    def passive(self, phi: Jet, motions: list[Motion]) -> list[Term]:
        """The reduced moments of weights and springs."""
        result, zero = [], np.zeros_like(phi.value)
        if "gravity" in self.scene:
            gravity = self.scene["gravity"]
            g, aim = real(gravity.get("g", "9.80665 m/s^2")), real(gravity.get("direction", "-90 deg"))
            for part, motion in zip(self.parts, motions, strict=True):
                for p in motion.points:
                    if p.weighs and p.mass:
                        work = p.mass * g * (plain.cos(aim) * jet(p.x).first + plain.sin(aim) * jet(p.y).first)
                        result.append(Term(part.shaft, zero + work, zero, False))
        for place, spring in self.springs:
            x = self.displacement(place, phi, motions)
            work = -real(spring["stiffness"]) * (x.value - real(spring.get("rest", 0))) * x.first
            result.append(Term(place.shaft, zero + work, zero, False))
        return result

    def damped(self, phi: Jet, motions: list[Motion], omega: Any) -> list[Term]:
        """The reduced moments of dampers."""
        gains = [(place, c, self.displacement(place, phi, motions).first) for place, c in self.dampers]
        zero = np.zeros_like(phi.value)
        return [Term(place.shaft, zero - c * g * g * omega, zero, False) for place, c, g in gains]

    def work(self, load: Load, phi: Jet, at: Jet, now: Any, then: Any, omega: Any) -> Term:
        """The reduced moment of a load, idle where its window is shut or the motion has the other sense."""
        ratio, phase = load.offset
        seen = ratio * at.value + phase
        shift = plain.floor(seen / load.every) * load.every
        x, x_then = self.displacement(load.place, phi, now), self.displacement(load.place, at, then)
        on = active(load, seen - shift)
        if load.sense:
            on = on & (load.sense * x_then.first > 0)
        env = self.env(load, ratio * phi + phase - shift, seen - shift, x, x_then, omega)
        constant, share = self.linear(load, env)
        zero = np.zeros_like(phi.value)
        return Term(
            load.place.shaft, np.where(on, constant * x.first, zero), np.where(on, share * x.first, zero), load.drive
        )

    def env(self, load: Load, angle: Jet, seen: Any, x: Jet, x_then: Jet, omega: Any) -> dict[str, Both]:
        """The names a load's expression may use; without speeds only the sign of `v` may matter."""
        names = {"phi": Both(angle, seen), "x": Both(x, x_then.value), "v": Both(Jet(x.first), x_then.first)}
        names |= {"pi": Both(jet(PI), PI)} | {n: Both(jet(v), v) for n, v in self.parameters.items()}
        if omega[0] is not None:
            names["v"] = Both(Jet(x.first * omega[0]), x_then.first * omega[1])
            names["omega"] = Both(Jet(load.place.ratio * omega[0]), load.place.ratio * omega[1])
        return names

    def linear(self, load: Load, env: dict[str, Both]) -> tuple[Any, Any]:
        """A load's effort as a constant and a share of the unknown."""
        law, zero = load.law, Real(0)
        if isinstance(law, str):
            return zero, Real(1)
        if isinstance(law, formulas.Cubics):
            angle, seen = env["phi"]
            turn = np.where(seen >= law.ends[-1], -1, np.where(seen < law.starts[0], 1, 0)) * load.every
            return law.at(angle + turn, seen + turn).value, zero
        if not isinstance(law, ast.expr):
            return law, zero

        def valued(unknown: Any) -> Any:
            own = {self.unknown: Both(jet(unknown), unknown)} if self.unknown else {}
            return formulas.evaluate(law, env | own).here.value

        constant = valued(zero)
        return constant, valued(Real(1)) - constant if self.unknown else zero

    def breakpoints(self) -> Any:
        """Ascending angles of a cycle, its ends included, between which everything is smooth but for the speed."""
        result = [Real(0), self.cycle, *self.known()]
        grid = self.cycle * (reals(np.arange(-1, GRID + 1)) + Real("0.3141")) / GRID
        for k, values in enumerate(self.signs(grid)):

            def switch(phi: Any, k: int = k) -> Any:
                return np.broadcast_to(self.signs(phi)[k], phi.shape)

            row = np.broadcast_to(values, grid.shape)
            at = np.flatnonzero(row[1:] * row[:-1] < 0)
            if at.size:
                result += list(bracketed(switch, grid[at], grid[at + 1], row[at], row[at + 1]))
        kept: list[Any] = []
        for angle in sorted(min(max(a, Real(0)), self.cycle) for a in result if -TINY < a < self.cycle + TINY):
            if not kept or angle - kept[-1] > TINY:
                kept.append(angle)
        kept[-1] = self.cycle
        return np.array(kept)

    def known(self) -> Any:
        """Breakpoints that the scene itself names: windows, knots, seams."""
        for load in self.loads:
            marks = [Real(0), *(load.window or ())]
            if isinstance(load.law, formulas.Cubics):
                marks += [*load.law.starts, load.law.ends[-1]]
            yield from repeated(marks, load.every, *load.offset, self.cycle)
        for part in self.parts:
            if isinstance(part.move, Law):
                yield from repeated(part.move.knots(), self.cycle, part.ratio, part.phase, self.cycle)

    def signs(self, phi: Any, omega: Any = None, *, of_speed: bool = False) -> list[Any]:
        """Values whose sign changes are breakpoints: those that angles alone decide, or those that speeds do."""
        at = Jet(phi, Real(1))
        motions = self.motions(at, phi)
        result = []
        for part in self.parts:
            if isinstance(part.move, Law) and not of_speed:
                result += part.move.switches(part.ratio * phi + part.phase)
        for load in self.loads:
            x = self.displacement(load.place, at, motions)
            if load.sense and not of_speed:
                result.append(x.first)
            if isinstance(load.law, ast.expr):
                seen = load.offset[0] * phi + load.offset[1]
                seen = seen - plain.floor(seen / load.every) * load.every
                env = self.env(load, Jet(seen), seen, x, x, (omega, omega))
                if self.unknown:
                    env[self.unknown] = Both(jet(Real(1)), Real(1))
                trees = [t for t in formulas.switches(load.law) if bool(formulas.names(t) & {"omega"}) == of_speed]
                result += [formulas.evaluate(tree, env).anchor for tree in trees]
        return result


def active(load: Load, angle: Any) -> Any:
    """Tests whether a load's window is open at angles of its period."""
    if load.window is None:
        return np.ones(np.shape(angle), dtype=bool)
    start, end = (edge - plain.floor(edge / load.every) * load.every for edge in load.window)
    return (start <= angle) & (angle < end) if start < end else (angle >= start) | (angle < end)


def repeated(marks: list[Any], every: Any, ratio: Any, phase: Any, cycle: Any) -> list[Any]:
    """The crank angles of a cycle at which ratio phi + phase is one of the marks, modulo `every`."""
    result = []
    for mark in marks:
        first = plain.ceil((phase - mark) / every) - 1
        angles = ((mark + turn * every - phase) / ratio for turn in itertools.count(int(first)))
        result += list(itertools.takewhile(lambda a: a <= cycle + TINY, angles))
    return result
