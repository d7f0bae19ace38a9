"""Courses of a machine in time, and the branches of its laws."""

from __future__ import annotations

import ast
import itertools
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import DOP853, solve_ivp
from scipy.optimize import brentq, minimize_scalar

from tests.oracle import formulas
from tests.oracle.drive_lines import tree, value
from tests.oracle.motions import Here, Mechanism, mechanism
from tests.oracle.motors import Motor, motor

# Expressions of a scene at one instant, each branch (a sign, a comparison, a smaller one) a number that is held.
#
# While branches are held an expression is smooth, also a little beyond where they change: there the values of its
# switches
# change their signs. Python's own compiler reads the texts, so that only scenes which the tests write may come here.


NAMES = ("phi", "x", "v", "omega", "t")
COMPARED = {ast.Lt: "<", ast.LtE: "<", ast.Gt: ">", ast.GtE: ">"}


class Law(NamedTuple):
    """A law of phi, x, v, omega, t and its held branches; `switches` gives what the sign of each branch follows."""

    text: str
    value: Callable[..., float]
    switches: Callable[..., tuple[float, ...]]
    count: int
    names: frozenset[str]


def law(text: str, parameters: dict[str, float]) -> Law:
    """The law of a text."""
    tree = ast.parse(text.strip(), mode="eval").body
    result: list[str] = []
    value = ast.unparse(_held(tree, result))
    names = {n.id for n in ast.walk(tree) if isinstance(n, ast.Name)}
    space = {k: v for k, v in vars(math).items() if not k.startswith("_")} | parameters
    arguments = ", ".join((*NAMES, "B"))
    switches = f"({', '.join(result)}{',' if result else ''})"
    return Law(
        text,
        eval(f"lambda {arguments}: {value}", space),
        eval(f"lambda {arguments}: {switches}", space),
        len(result),
        frozenset(names),
    )


def _branch(node: ast.expr, found: list[str]) -> ast.expr:
    """The number that tells on which side of nothing an expression lies."""
    found.append(ast.unparse(node))
    return ast.Subscript(ast.Name("B"), ast.Constant(len(found) - 1))


def _held(node: ast.expr, found: list[str]) -> ast.expr:
    match node:
        case ast.Compare():
            sides = [_held(side, found) for side in (node.left, *node.comparators)]
            truths: list[ast.expr] = []
            for i, op in enumerate(node.ops):
                bit = _branch(ast.BinOp(sides[i], ast.Sub(), sides[i + 1]), found)
                own = ast.Lt() if COMPARED[type(op)] == "<" else ast.Gt()
                truths.append(ast.Compare(bit, [own], [ast.Constant(0)]))
            return truths[0] if len(truths) == 1 else ast.BoolOp(ast.And(), truths)
        case ast.Call(func=ast.Name(id="sign")):
            return _branch(_held(node.args[0], found), found)
        case ast.Call(func=ast.Name(id="abs")):
            inner = _held(node.args[0], found)
            return ast.BinOp(_branch(inner, found), ast.Mult(), inner)
        case ast.Call(func=ast.Name(id="min" | "max" as name)):
            first, *others = (_held(a, found) for a in node.args)
            for other in others:
                bit = _branch(ast.BinOp(first, ast.Sub(), other), found)
                own: Any = ast.Lt() if name == "min" else ast.Gt()
                first = ast.IfExp(ast.Compare(bit, [own], [ast.Constant(0)]), first, other)
            return first
        case ast.Call():
            return ast.Call(node.func, [_held(a, found) for a in node.args], [])
        case ast.BinOp():
            return ast.BinOp(_held(node.left, found), node.op, _held(node.right, found))
        case ast.UnaryOp():
            return ast.UnaryOp(node.op, _held(node.operand, found))
        case ast.BoolOp():
            return ast.BoolOp(node.op, [_held(v, found) for v in node.values])
        case ast.IfExp():
            return ast.IfExp(_held(node.test, found), _held(node.body, found), _held(node.orelse, found))
    return node


# A machine followed from one event to the next, with standstill as a set: held while its dry laws take what acts.
#
# A scene of the toolkit is read here apart from it. Every effort is a law whose branches are held from event to event;
# the
# direction of motion (-1, 0, 1) is one of them. At rest the machine is let go in both senses: it leaves where the moment
# that a motion in that sense would have points that way, and stays, for as long as need be, where neither does. In
# between
# DOP853 steps position, speed, the motor's own states, and the work of every effort. Nothing here imports `flywheel` or
# `bondgraph`.


RTOL = 1e-11
INSIDE = (0.25, 0.5, 0.75, 1.0)  # of a step: where switches are looked at
AHEAD = 1e-9  # of the time scale: how far beyond an event branches are decided
STEPS, MOST = 24, 5_000  # of a turn
STABLE, SMALL = 3.0, 1e-6  # of the time of a decay: a step; of a speed: a change by which its decay is measured
MOST = 20_000  # steps
UNKNOWN = "balance_"


class Undetermined(ArithmeticError):
    """A motion that the machine's own equations leave open, or that has no end within the steps allowed."""


class Effort(NamedTuple):
    """A torque on a shaft (part None), or what acts on a port of a mechanism."""

    name: str
    shaft: int
    part: int | None
    port: int
    law: Law
    table: formulas.Cubics | None
    window: tuple[float, float] | None
    every: float
    sense: int
    factor: float
    drive: bool


class Part(NamedTuple):
    """A mechanism on a shaft: its own angle is speed phi + phase."""

    shaft: int
    phase: float
    body: Mechanism


class Mode(NamedTuple):
    """Mode of a motion: the direction, the cell of position with its active parts, the branches, the meshes that pay."""

    sense: int
    low: float
    high: float
    active: tuple[bool, ...]
    shifts: tuple[float, ...]
    branches: tuple[tuple[int, ...], ...]
    outwards: tuple[bool, ...]


class Piece(NamedTuple):
    """A stretch of the motion from start to end, its states over time, and its mode."""

    start: float
    end: float
    states: Callable[[float], Any]
    mode: Mode


class Rest(NamedTuple):
    """A standstill: from, until (infinite where nothing frees the machine), at which angle."""

    start: float
    end: float
    phi: float


class Course(NamedTuple):
    """A motion: its pieces, its standstills, its last time and states, and why it ended."""

    pieces: list[Piece]
    rests: list[Rest]
    t: float
    y: Any
    reason: str

    def at(self, t: float) -> Any:
        """The states at a time."""
        for piece in reversed(self.pieces):
            if t >= piece.start:
                return piece.states(min(t, piece.end))
        return self.pieces[0].states(t)


class Machine:
    """A scene as a machine of one freedom."""

    def __init__(
        self, scene: dict[str, Any], *, inertia: float | None = None, drive: bool = True, folder: Path = Path()
    ) -> None:
        self.scene, self.folder = scene, folder
        self.cycle = value(scene.get("regime", {}).get("cycle"), "360 deg")
        self.index, self.shafts = tree(scene)
        self.speeds = [s.speed for s in self.shafts]
        self.lossy = [k for k, s in enumerate(self.shafts) if s.share < 1]
        self.parameters = {n: value(v) for n, v in scene.get("parameters", {}).items() if v != "balance"}
        self.balance = next((n for n, v in scene.get("parameters", {}).items() if v == "balance"), UNKNOWN)
        self.own = [0.0] * len(self.shafts)
        self._parts()
        self.efforts: list[Effort] = []
        self._efforts()
        self.motor: Motor | None = None
        if drive and "drive" in scene:
            self._drive(scene["drive"])
        wheel = scene.get("flywheel", {})
        given = value(wheel.get("inertia")) if inertia is None else inertia
        self.own[self.index[wheel.get("on", "crank")]] += given
        if "motor" in scene.get("drive", {}):  # the rotor turns without its current, too
            self.own[self.index[scene["drive"].get("on", "crank")]] += value(scene["drive"]["motor"].get("inertia"))
        self.states = 0 if self.motor is None else self.motor.count
        self.size = 2 + self.states + len(self.efforts) + 1
        self.timed = any("t" in e.law.names for e in self.efforts)
        self._cells()

    # -- reading ----------------------------------------------------------------------------------------------------------

    def _parts(self) -> None:
        scene, pull = self.scene, None
        if "gravity" in scene:
            g, aim = value(scene["gravity"].get("g"), "9.80665 m/s^2"), value(scene["gravity"].get("direction"), "-90 deg")
            pull = (g * math.cos(aim), g * math.sin(aim))
        written = scene.get("mechanism", [])
        written = written if isinstance(written, list) else [written]
        names = [table.get("name", table["type"]) for table in written]
        self.parts: list[Part] = []
        masses = [(row["on"], value(row["value"])) for row in scene.get("inertia", [])]
        for name, mass in masses:
            if name in self.index:
                self.own[self.index[name]] += mass
        self.places: dict[str, tuple[int, int]] = {}
        for i, table in enumerate(written):
            shaft = self.index[table.get("shaft", "crank")]
            period = 2 * math.pi if table["type"] != "law" else self.speeds[shaft] * self.cycle
            period = 0.0 if table["type"] == "toggle-clamp" else period
            move = mechanism(table, period, self.parameters, self.folder)
            bare = Mechanism(move, period, pull, {})
            for k, port in enumerate(bare.names):
                self.places[f"{names[i]}.{port}"] = (i, k)
                self.places[port] = (i, k)
            added: dict[str, float] = {}
            for name, mass in masses:
                if name not in self.index and self.places.get(name, (None,))[0] == i:
                    port = bare.names[self.places[name][1]]
                    added[port] = added.get(port, 0.0) + mass
            self.parts.append(
                Part(shaft, value(table.get("phase")), Mechanism(move, period, pull, added) if added else bare)
            )

    def _add(self, name: str, on: str, text: str, **given: Any) -> None:
        if on in self.index:
            place = {"shaft": self.index[on], "part": None, "port": 0}
        else:
            i, k = self.places[on]
            place = {"shaft": self.parts[i].shaft, "part": i, "port": k}
        known = self.parameters | {self.balance: 0.0}
        plain: dict[str, Any] = {
            "table": None,
            "window": None,
            "every": self.cycle,
            "sense": 0,
            "factor": 1.0,
            "drive": False,
        }
        self.efforts.append(Effort(name, **place, law=law(text, known), **(plain | given)))

    def _efforts(self) -> None:
        scene = self.scene
        for k, row in enumerate(scene.get("load", [])):
            given: dict[str, Any] = {"factor": value(row.get("factor"), 1.0)}
            if "from" in row:
                given["window"] = (value(row["from"]), value(row["to"]))
            if "every" in row:
                given["every"] = value(row["every"])
            elif row["on"] not in self.index:  # of a mechanism that turns less than the cycle, its own travel
                part = self.parts[self.places[row["on"]][0]]
                travel = self.speeds[part.shaft] * self.cycle
                given["every"] = travel if travel < self.cycle else self.cycle
            given["sense"] = {"v > 0": 1, "v < 0": -1}.get(row.get("while", ""), 0)
            if "table" in row:
                given["table"] = formulas.pieces(row["table"], self.folder)
            text = modelled(row["model"]) if "model" in row else written(row.get("force", row.get("torque", 0)))
            self._add(f"load[{k}]", row["on"], text, **given)
        for k, row in enumerate(scene.get("spring", [])):
            stiffness, rest = value(row["stiffness"]), value(row.get("rest"))
            self._add(f"spring[{k}]", row["on"], f"-{stiffness!r}*(x - {rest!r})")
        for k, row in enumerate(scene.get("damper", [])):
            self._add(f"damper[{k}]", row["on"], f"-{value(row['coefficient'])!r}*v")
        for name, row in scene.get("shafts", {}).items():
            if value(row.get("drag")):
                self._add(f"shafts.{name}.drag", name, f"-{value(row['drag'])!r}*sign(v)")

    def _drive(self, row: dict[str, Any]) -> None:
        on = row.get("on", "crank")
        if "motor" not in row:
            self._add("drive", on, self.balance if row["torque"] == "balance" else written(row["torque"]), drive=True)
            return
        result = motor(row["motor"])
        if isinstance(result, str):
            self._add("drive", on, result, drive=True)
        else:
            self.motor, self.driven = result, self.index[on]
            self._add("drive", on, "0", drive=True)

    def given(self, unknown: float) -> None:
        """The value (SI) of what the scene calls "balance"."""
        known = self.parameters | {self.balance: unknown}
        self.efforts = [e._replace(law=law(e.law.text, known)) for e in self.efforts]

    def _cells(self) -> None:
        """Crank angles at which windows and tables switch, seams lie, and loads with `while` mind a dead centre."""
        result = {0.0}
        for e in self.efforts:
            ratio, phase = self._angle(e)
            marks = [*(e.window or ()), *(() if e.table is None else map(float, (*e.table.starts, e.table.ends[-1])))]
            if marks or "phi" in e.law.names or e.every != self.cycle:
                marks.append(0.0)
            turns = math.ceil(ratio * self.cycle / e.every) + 2
            result |= {(m - phase + k * e.every) / ratio for m in marks for k in range(-turns, turns + 1)}
            if e.sense and e.part is not None:
                grid = np.linspace(0, self.cycle, 1441)
                rates = [self._way(e, a) for a in grid]
                for a, b, fa, fb in zip(grid[:-1], grid[1:], rates[:-1], rates[1:], strict=True):
                    if fa * fb < 0:
                        result.add(brentq(lambda q, e=e: self._way(e, q), a, b, xtol=1e-14))
        kept: list[float] = []
        for angle in sorted(a % self.cycle for a in result):
            if not kept or angle - kept[-1] > 1e-11:
                kept.append(angle)
        if self.cycle - kept[-1] < 1e-11:
            kept.pop()
        self.breaks = [*kept, kept[0] + self.cycle]

    def _angle(self, e: Effort) -> tuple[float, float]:
        """Ratio and phase of an effort's angle to the crank's."""
        return (1.0, 0.0) if e.part is None else (self.speeds[e.shaft], self.parts[e.part].phase)

    def _way(self, e: Effort, phi: float) -> float:
        assert e.part is not None
        return self.parts[e.part].body.at(self.speeds[e.shaft] * phi + self.parts[e.part].phase).ports[e.port][1]

    # -- an instant -------------------------------------------------------------------------------------------------------

    def cell(self, phi: float, sense: int) -> tuple[float, float]:
        """The stretch of position between breaks that a motion in a sense enters."""
        turn = math.floor(phi / self.cycle) * self.cycle
        at = phi - turn + sense * 1e-11
        if at < self.breaks[0]:
            at, turn = at + self.cycle, turn - self.cycle
        if at >= self.breaks[-1]:
            at, turn = at - self.cycle, turn + self.cycle
        k = int(np.searchsorted(self.breaks, at, side="right")) - 1
        return turn + self.breaks[k], turn + self.breaks[k + 1]

    def bodies(self, phi: float) -> list[Here]:
        """All mechanisms."""
        return [p.body.at(self.speeds[p.shaft] * phi + p.phase) for p in self.parts]

    def sees(self, e: Effort, phi: float, omega: float, shift: float, here: list[Here]) -> tuple[float, float, float, float]:
        """phi, x, v and omega of an effort, the first with its shift."""
        speed = self.speeds[e.shaft]
        if e.part is None:
            return phi - shift, speed * (phi - shift), speed * omega, speed * omega
        x, way, _ = here[e.part].ports[e.port]
        return speed * phi + self.parts[e.part].phase - shift, x, way * speed * omega, speed * omega

    def torques(self, t: float, y: Sequence[float], here: list[Here], mode: Mode) -> list[float]:
        """The torque of every effort on its own shaft (N m)."""
        phi, omega = y[0], y[1]
        result = []
        for e, on, shift, bits in zip(self.efforts, mode.active, mode.shifts, mode.branches, strict=True):
            if not on:
                result.append(0.0)
                continue
            seen = self.sees(e, phi, omega, shift, here)
            if e.table is not None:
                force = float(
                    e.table.at(
                        _Plain(seen[0]), 0.5 * (mode.low + mode.high) * self._angle(e)[0] + self._angle(e)[1] - shift
                    ).value
                )
            else:
                force = e.law.value(*seen, t, bits)
            force *= e.factor
            result.append(force if e.part is None else force * here[e.part].ports[e.port][1])
        if self.motor is not None:
            result[-1] = self.motor.torque(self.speeds[self.driven] * omega, y[2 : 2 + self.states], t)
        return result

    def needs(self, omega: float, here: list[Here], torques: list[float]) -> tuple[list[float], list[float]]:
        """For every shaft: what its mesh must bring it is first * alpha + second (N m, its own), its own things alone."""
        first = [own * speed for own, speed in zip(self.own, self.speeds, strict=True)]
        second = [0.0] * len(self.shafts)
        for p, h in zip(self.parts, here, strict=True):
            n = self.speeds[p.shaft]
            first[p.shaft] += h.inertia * n
            second[p.shaft] += 0.5 * h.slope * n * n * omega * omega - h.fall
        for e, torque in zip(self.efforts, torques, strict=True):
            second[e.shaft] -= torque
        return first, second

    def walk(
        self, first: list[float], second: list[float], outwards: Sequence[bool], sense: int
    ) -> tuple[float, float, Any]:
        """The crank's remainder a alpha + b, and the shafts' needs, with the side of every mesh that pays held."""
        a, b = list(first), list(second)
        for k in range(len(self.shafts) - 1, 0, -1):
            s = self.shafts[k]
            price = s.gear * (1 / s.share if outwards[k] else s.share)
            a[s.near] += price * a[k]
            b[s.near] += price * b[k]
        return a[0], b[0], (a, b)

    def solved(self, first: list[float], second: list[float], sense: int) -> tuple[float, tuple[bool, ...], list[float]]:
        """The acceleration, which meshes send outwards with it, and what each passes (N m, its own)."""
        alpha, low, high = 0.0, -math.inf, math.inf
        for _ in range(100):
            need = [a * alpha + b for a, b in zip(first, second, strict=True)]
            for k in range(len(self.shafts) - 1, 0, -1):
                s, tau = self.shafts[k], need[k]
                need[s.near] += s.gear * (tau / s.share if tau * sense > 0 else tau * s.share)
            outwards = tuple(tau * sense > 0 for tau in need)
            a, b, _ = self.walk(first, second, outwards, sense)
            if not a > 0:
                raise Undetermined("no inertia")
            low, high = (alpha, high) if need[0] < 0 else (low, alpha)
            step = -b / a
            if abs(step - alpha) <= 1e-14 * abs(step) or need[0] == 0:
                return step, outwards, need
            inside = low < step < high
            new = step if inside or math.isinf(low + high) else 0.5 * (low + high)
            if new == alpha or (math.isfinite(low + high) and high - low <= 1e-15 * abs(high)):
                return alpha, outwards, need
            alpha = new
        raise Undetermined("no acceleration")

    def remainder(self, second: list[float], sense: int) -> float:
        """Moment that the crank lacks for equilibrium (N m), with the friction of its meshes for a motion in one sense."""
        need = list(second)
        for k in range(len(self.shafts) - 1, 0, -1):
            s, tau = self.shafts[k], need[k]
            need[s.near] += s.gear * (tau / s.share if tau * sense > 0 else tau * s.share)
        return need[0]

    def held(self, t: float, y: Sequence[float], sense: int, probe: tuple[float, float, float]) -> Mode:
        """The mode of a motion that is just a probe (time, position, speed) ahead."""
        low, high = self.cell(probe[1], sense)
        middle, active, shifts = 0.5 * (low + high), [], []
        for e in self.efforts:
            ratio, phase = self._angle(e)
            seen = ratio * middle + phase
            shift = math.floor(seen / e.every) * e.every
            at, on = seen - shift, True
            if e.window is not None and abs(e.window[1] - e.window[0] - e.every) > 1e-12:
                start, end = (edge % e.every for edge in e.window)
                on = start <= at < end if start < end else at >= start or at < end
            if e.table is not None:
                shift += e.every if at < float(e.table.starts[0]) - 1e-12 else 0.0
                shift -= 2 * e.every if seen - shift < float(e.table.starts[0]) - 1e-12 else 0.0
                shift += e.every if seen - shift > float(e.table.ends[-1]) + 1e-12 else 0.0
            if e.sense:
                way = 1.0 if e.part is None else self._way(e, middle)
                on = on and sense * way * e.sense > 0
            active.append(on)
            shifts.append(shift)
        here = self.bodies(probe[1])
        branches = []
        for e, shift in zip(self.efforts, shifts, strict=True):
            bits = [1] * e.law.count
            for k in range(e.law.count):  # a later switch may mind an earlier branch
                s = e.law.switches(*self.sees(e, probe[1], probe[2], shift, here), probe[0], bits)[k]
                bits[k] = int(s > 0) - int(s < 0)
            branches.append(tuple(bits))
        mode = Mode(sense, low, high, tuple(active), tuple(shifts), tuple(branches), ())
        torques = self.torques(probe[0], [probe[1], probe[2], *y[2:]], here, mode)
        _, outwards, _ = self.solved(*self.needs(probe[2], here, torques), sense)
        return mode._replace(outwards=outwards)

    def acceleration(self, t: float, y: Sequence[float], mode: Mode) -> tuple[float, list[float], Any]:
        """Acceleration, torques of the efforts and what the meshes pass, in a mode."""
        here = self.bodies(y[0])
        torques = self.torques(t, y, here, mode)
        a, b, (first, second) = self.walk(*self.needs(y[1], here, torques), mode.outwards, mode.sense)
        if not a > 0:
            raise Undetermined("no inertia")
        alpha = -b / a
        return alpha, torques, [p * alpha + q for p, q in zip(first, second, strict=True)]

    def rate(self, t: float, y: Any, mode: Mode) -> list[float]:
        """The rates of all states."""
        row = y.tolist()
        omega = row[1]
        alpha, torques, need = self.acceleration(t, row, mode)
        own = [] if self.motor is None else self.motor.rates(self.speeds[self.driven] * omega, row[2 : 2 + self.states], t)
        powers = [m * self.speeds[e.shaft] * omega for e, m in zip(self.efforts, torques, strict=True)]
        lost = 0.0
        for k in self.lossy:
            share, arrives = self.shafts[k].share, need[k] * self.speeds[k] * omega
            lost += arrives * (1 / share - 1) if mode.outwards[k] else -arrives * (1 - share)
        return [omega, alpha, *own, *powers, lost]

    def switches(self, t: float, y: Any, mode: Mode) -> list[float]:
        """Values that stay above 0 while the mode holds."""
        row = y.tolist()
        here = self.bodies(row[0])
        result = [mode.sense * row[1]]
        for e, on, shift, bits in zip(self.efforts, mode.active, mode.shifts, mode.branches, strict=True):
            if bits and on:
                seen = self.sees(e, row[0], row[1], shift, here)
                result += [s * b for s, b in zip(e.law.switches(*seen, t, bits), bits, strict=True) if b]
        if self.lossy:
            need = self.acceleration(t, row, mode)[2]
            result += [need[k] * mode.sense * (1 if mode.outwards[k] else -1) for k in self.lossy]
        return result

    # -- a motion ---------------------------------------------------------------------------------------------------------

    def start(self, phi: float, omega: float, states: Sequence[float] | None = None) -> Any:
        """States at a start, the motor's as it is switched on, or as given."""
        own = list(states) if states is not None else [0.0] * self.states
        return np.array([phi, omega, *own, *[0.0] * (len(self.efforts) + 1)])

    def follow(
        self,
        y: Any,
        until: float,
        *,
        way: float = math.inf,
        scale: float = 1.0,
        rtol: float = RTOL,
        rest: bool = False,
        t: float = 0.0,
    ) -> Course:
        """The motion from states at t to a time, a way, or (rest) the first standstill; `scale` is a time of it (s)."""
        pieces: list[Piece] = []
        rests: list[Rest] = []
        y, ahead = np.array(y, dtype=float), AHEAD * scale
        first, size = float(y[0]), max(abs(float(y[1])), 1e-3 / scale)
        while t < until:
            if y[1] == 0.0:
                sense, free, y = self._freed(t, y, until, ahead)
                if free > t:
                    held = self.held(t, y, 1, (t, y[0], 0.0))
                    pieces.append(Piece(t, min(free, until), lambda _, y=y: y, held._replace(sense=0)))
                    rests.append(Rest(t, free, float(y[0])))
                    if rest or free >= until:
                        return Course(pieces, rests, t if rest else until, y, "rest")
                    t = free
            else:
                sense = 1 if y[1] > 0 else -1
            mode = self._entered(t, y, sense, ahead)
            t, y = self._piece(t, y, until, mode, (ahead, rtol, size, first, way), pieces)
            size = max(size, abs(float(y[1])))
            if len(pieces) > MOST:
                raise Undetermined("too many steps")
            if abs(y[0] - first) >= way * (1 - 1e-13):
                return Course(pieces, rests, t, y, "way")
            if rest and y[1] == 0.0 and self._freed(t, y, until, ahead)[1] > t:
                return Course(pieces, rests, t, y, "rest")
        return Course(pieces, rests, t, y, "time")

    def _entered(self, t: float, y: Any, sense: int, ahead: float) -> Mode:
        """The mode into which a motion goes on in a sense."""
        row = y.tolist()
        speed = row[1] or sense * 1e-12
        mode = self.held(t, row, sense, (t + ahead, row[0] + ahead * row[1] + sense * 1e-13, speed))
        for _ in range(3):
            alpha = self.acceleration(t, row, mode)[0]
            omega = row[1] + ahead * alpha
            if omega * sense <= 0:
                omega = speed
            again = self.held(
                t, row, sense, (t + ahead, row[0] + ahead * row[1] + 0.5 * ahead**2 * alpha + sense * 1e-15, omega)
            )
            if again == mode:
                break
            mode = again
        return mode

    def _freed(self, t: float, y: Any, until: float, ahead: float) -> tuple[int, float, Any]:
        """In which sense a machine at rest leaves, and when; the time is infinite where it stays."""
        states: Callable[[float], Any] = lambda at: y  # noqa: E731
        if self.motor is not None and self.states:
            k, own = self.states, self.motor
            run = solve_ivp(
                lambda at, q: own.rates(0.0, q.tolist(), at),
                (t, until),
                y[2 : 2 + k],
                "DOP853",
                rtol=1e-12,
                atol=1e-12,
                dense_output=True,
            )

            def states(at: float) -> Any:
                result = np.array(y)
                result[2 : 2 + k] = run.sol(at)
                return result

        def push(at: float, sense: int) -> float:
            """Driving moment in a sense (N m), above 0 where it leaves."""
            row = states(at).tolist()
            probe = (at, row[0] + sense * 1e-11, sense * 1e-12)
            mode = self.held(at, row, sense, probe)
            here = self.bodies(row[0])
            torques = self.torques(at, row, here, mode)
            least = 1e-12 * (sum(map(abs, torques)) + sum(abs(h.fall) for h in here))
            return -sense * self.remainder(self.needs(0.0, here, torques)[1], sense) - least

        now = [push(t + ahead, sense) for sense in (1, -1)]
        if now[0] > 0 and now[1] > 0:
            raise Undetermined("both ways")
        if now[0] > 0 or now[1] > 0:
            return (1 if now[0] > 0 else -1), t, y
        if not self.timed and not self.states:
            return 0, math.inf, y
        grid = np.unique(np.concatenate((t + np.geomspace(ahead, until - t, 40), np.linspace(t, until, 400))))[1:].tolist()
        for a, b in itertools.pairwise(grid):
            free = [(self._root(lambda at, k=sense: -push(at, k), a, b), sense) for sense in (1, -1) if push(b, sense) > 0]
            if free:
                at, sense = min(free)
                return sense, at, states(at)
        return 0, math.inf, states(until)

    def _piece(
        self, t: float, y: Any, until: float, mode: Mode, how: tuple[float, ...], pieces: list[Piece]
    ) -> tuple[float, Any]:
        """Step from t to the end, or to where the mode ends."""
        ahead, rtol, size, first, way = how
        speed, begun = max(abs(y[1]), size), t + 2 * ahead
        atol = np.full(self.size, rtol)
        atol[1] = rtol * size
        energy = size * size * sum(o * s * s for o, s in zip(self.own, self.speeds, strict=True)) + 1e-30
        atol[2 + self.states :] = 1e-3 * math.sqrt(rtol) * energy
        if self.motor is not None:
            atol[2 : 2 + self.states] = rtol * np.array(self.motor.sizes)
        # an even motion has no error that would keep explicit steps within the time in which a change of speed decays
        faster, gain = np.array(y), SMALL * speed * (1 if y[1] >= 0 else -1)
        faster[1] += gain
        decay = float(self.rate(t, y, mode)[1] - self.rate(t, faster, mode)[1]) / gain
        longest = self.cycle / speed * max(min(1 / STEPS, STABLE * speed / self.cycle / max(decay, 1e-30)), 1 / MOST)
        solver = DOP853(lambda at, q: self.rate(at, q, mode), t, y, until, rtol=rtol, atol=atol, max_step=longest)
        low, high = max(mode.low, first - way), min(mode.high, first + way)

        def ends(at: float, q: Any) -> list[float]:
            edge = q[0] - low if mode.sense < 0 else high - q[0]
            return [edge, *self.switches(at, q, mode)]

        def broken(a: float, b: float, dense: Any) -> tuple[float, int] | None:
            """Time of the first end within a step, and which end it is."""
            looks = [a + q * (b - a) for q in (0.0, *INSIDE)]
            dips = self._dips(looks, np.array([ends(at, dense(at)) for at in looks]), lambda at: ends(at, dense(at)))
            before = a
            for at in sorted([*looks[1:], *dips]):
                if at <= begun and at < b:
                    continue
                since = max(before, begun) if at > begun else before
                result = [k for k, left in enumerate(ends(at, dense(at))) if left < 0]
                if result:
                    return min((self._root(lambda s, k=k: ends(s, dense(s))[k], since, at), k) for k in result)
                before = at
            return None

        while solver.status == "running":
            solver.step()
            if solver.status == "failed":
                raise Undetermined("no step")
            dense, a, b = solver.dense_output(), solver.t_old, solver.t
            assert a is not None
            if (first_end := broken(a, b, dense)) is not None:
                stop, k = first_end
                end = dense(stop)
                if k == 1:
                    end[1] = 0.0
                if k == 0:
                    end[0] = low if mode.sense < 0 else high
                pieces.append(Piece(a, stop, dense, mode))
                return stop, end
            pieces.append(Piece(a, b, dense, mode))
            if len(pieces) > MOST:
                raise Undetermined("too many steps")
        return until, solver.y

    @staticmethod
    def _dips(looks: list[float], left: Any, ends: Callable[[float], list[float]]) -> list[float]:
        """Times when an end closes and opens again between looks: at the vertex of a parabola through three of them."""
        bend, slope = (left[:-2] - 2 * left[1:-1] + left[2:]) / 2, (left[2:] - left[:-2]) / 2
        inside = (bend > 0) & (np.abs(slope) <= 2 * bend) & (left.min(axis=0) >= 0)
        near = inside & (left[1:-1] - slope**2 / (4 * np.where(inside, bend, np.inf)) < 0.1 * np.ptp(left, axis=0))
        dips = [
            (float(minimize_scalar(lambda at, j=j: ends(at)[j], bounds=(looks[k], looks[k + 2]), method="bounded").x), j)
            for k, j in np.argwhere(near)
        ]
        return [at for at, j in dips if ends(at)[j] < 0]

    @staticmethod
    def _root(f: Callable[[float], float], a: float, b: float) -> float:
        if a >= b or f(a) <= 0:
            return a
        return float(brentq(f, a, b, xtol=1e-15 * (1 + abs(b)), rtol=1e-15))

    def extremes(self, course: Course) -> tuple[float, float]:
        """Greatest and least speed of the crank along a motion."""
        return self._greatest(course, 1), -self._greatest(course, -1)

    @staticmethod
    def _greatest(course: Course, sign: int) -> float:
        """The greatest speed, or that backwards."""
        tops = []
        for p in course.pieces:
            grid = np.linspace(p.start, p.end, 5)
            speeds = [sign * float(p.states(at)[1]) for at in grid]
            k = int(np.argmax(speeds))
            tops.append((speeds[k], grid[max(k - 1, 0)], grid[min(k + 1, 4)], p))
        tops.sort(key=lambda row: -row[0])
        best = tops[0][0]
        for top, a, b, p in tops[:6]:
            if b > a and top > tops[0][0] - 1e-2 * abs(tops[0][0]):
                close = {"xatol": 1e-9 * (b - a) + 1e-15}
                run = minimize_scalar(lambda at, p=p: -sign * float(p.states(at)[1]), bounds=(a, b), options=close)
                best = max(best, -float(run.fun))
        return best

    def kinetic(self, y: Any) -> float:
        """Kinetic energy (J)."""
        twice = sum(o * s * s for o, s in zip(self.own, self.speeds, strict=True))
        twice += sum(
            h.inertia * self.speeds[p.shaft] ** 2 for p, h in zip(self.parts, self.bodies(float(y[0])), strict=True)
        )
        return 0.5 * twice * float(y[1]) ** 2

    def works(self, y: Any) -> dict[str, float]:
        """The work of every effort since the start, and what meshes lost (J)."""
        row = y[2 + self.states :].tolist()
        return {e.name: w for e, w in zip(self.efforts, row, strict=False)} | {"meshes": row[-1]}


class _Plain(NamedTuple):
    """An angle without derivatives, for tables."""

    value: float
    first: float = 0.0
    second: float = 0.0


def written(raw: Any) -> str:
    """A quantity or an expression as an expression."""
    try:
        return repr(value(raw))
    except ValueError:
        return str(raw)


def modelled(row: dict[str, Any]) -> str:
    """The law of a model that acts against the motion, v being the speed of its place."""
    kind = row["type"]
    if kind == "constant":
        return f"-{value(row.get('force', row.get('torque')))!r}*sign(v)"
    if kind == "losses":
        a, b, c = (value(row.get(key)) for key in ("constant", "proportional", "quadratic"))
        return f"-{a!r}*sign(v) - {b!r}*v - {c!r}*v*abs(v)"
    if kind == "belt":
        if "power" in row:
            return f"-{value(row['power']) / value(row['speed'])!r}*sign(v)"
        return f"-{(value(row['tight']) - value(row['slack'])) * value(row['radius'])!r}*sign(v)"
    if kind in ("fan", "pump"):
        speed = value(row.get("speed", row.get("velocity")))
        full = value(row["power"]) / speed if "power" in row else value(row.get("torque", row.get("force")))
        still = value(row.get("constant"))
        return f"-({still!r} + {(full - still) / speed**2!r}*v*v)*sign(v)"
    raise ValueError(kind)
