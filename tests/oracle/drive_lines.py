"""A drive line written out in series, by shooting: every shaft, every mesh, solved from the far ends inwards.

A scene of the toolkit (a mapping: slider-crank or scotch yoke, shafts on shafts, loads with windows, dampers, a motor) is
read here apart from it. On every shaft its own torques act; with an acceleration of the crank given, the far ends say what
torque each mesh must bring them, the mesh says what the nearer side pays for that (1/share where power goes outwards, share
where it comes back), and so inwards to the crank, which nothing else may push: that remainder, increasing in the
acceleration, is brought to zero by false position. The motion over the crank angle is stepped by DOP853, with steps that end
at windows, dead centres and wherever the power of a mesh reverses, and shot at until it repeats. Nothing here imports
`flywheel` or `bondgraph`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq, minimize_scalar

from tests.oracle.numbers import real

RTOL = 1e-13
STEPS = 30  # of a cycle at least
INSIDE = (0.13, 0.37, 0.61, 0.83)  # of a step: where powers are looked at besides its end
NODES, WEIGHTS = np.polynomial.legendre.leggauss(10)
Law = Callable[[float, float, float], float]  # of the angle that a load sees, the speed of its place, the unknown


def value(raw: Any, default: Any = 0) -> float:
    """A number of the scene in SI."""
    return float(real(default if raw is None else raw))


class Shaft(NamedTuple):
    """A shaft: on which it hangs, its speed over that one's and over the crank's, shares of power and speed that pass."""

    name: str
    near: int
    gear: float
    speed: float
    share: float
    slip: float


class Push(NamedTuple):
    """A torque on a shaft (port False), or a force on the mechanism's slide, where it is active."""

    name: str
    shaft: int
    port: bool
    law: Law
    every: float
    window: tuple[float, float] | None
    sense: int
    drive: bool


class Piece(NamedTuple):
    """A step of the motion: half the speed squared over the crank angle, what is active, which meshes pass power on."""

    start: float
    end: float
    half: Callable[[Any], Any]
    active: tuple[bool, ...]
    outwards: tuple[bool, ...]


class Flow(NamedTuple):
    """Power that a shaft's mesh passes to it (W): on the mean over time, least and greatest, and the mean loss."""

    mean: float
    least: float
    greatest: float
    rms_torque: float
    lost: float
    slip: float


class Regime(NamedTuple):
    """The steady cycle: speeds are the crank's (rad/s), powers over time (W), `works` (J) of each push in a cycle."""

    inertia: float
    unknown: float
    speed: float
    irregularity: float
    speed_max: float
    speed_min: float
    period: float
    mean_power: float
    peak_power: float
    rms_torque: float
    greatest_torque: float
    rotor_heat: float
    works: dict[str, float]
    flows: dict[str, Flow]
    pieces: tuple[Piece, ...]


def order(shafts: dict[str, Any]) -> list[str]:
    """The names of shafts, each after the one that it hangs on."""
    result = ["crank"]
    while len(result) <= len(shafts):
        result.append(next(n for n, s in shafts.items() if n not in result and s.get("on", "crank") in result))
    return result


def tree(scene: dict[str, Any]) -> tuple[dict[str, int], list[Shaft]]:
    """The shafts of a scene, each after the one that it hangs on, and their places by name."""
    written = {name: row for name, row in scene.get("shafts", {}).items() if name != "crank"}
    names = order(written)
    index = {name: k for k, name in enumerate(names)}
    beyond, at = set(), scene.get("drive", {}).get("on", "crank")
    while at != "crank":  # those through which the drive's power comes in
        beyond.add(at)
        at = written[at].get("on", "crank")
    shafts = [Shaft("crank", 0, 1.0, 1.0, 1.0, 0.0)]
    for name in names[1:]:
        row = written[name]
        near, slip = index[row.get("on", "crank")], value(row.get("slip"))
        gear = value(row["ratio"]) * ((1 - slip) if name not in beyond else 1 / (1 - slip))
        share = value(row.get("efficiency"), 1) * (1 - slip)
        shafts.append(Shaft(name, near, gear, gear * shafts[near].speed, share, slip))
    return index, shafts


class DriveLine:
    """A scene as shafts in series."""

    def __init__(self, scene: dict[str, Any]) -> None:
        self.scene = scene
        self.cycle = value(scene.get("regime", {}).get("cycle"), "360 deg")
        self.index, self.shafts = tree(scene)
        self.wheel = self.index[scene.get("flywheel", {}).get("on", "crank")]
        self.parameters = {n: value(v) for n, v in scene.get("parameters", {}).items() if v != "balance"}
        self.unknown = next((n for n, v in scene.get("parameters", {}).items() if v == "balance"), None)
        self.mechanism = scene.get("mechanism")
        if self.mechanism is not None:
            self.slide_on = self.index[self.mechanism.get("shaft", "crank")]
            self._mechanism(self.mechanism)
        self.own = [0.0] * len(self.shafts)
        self.pushes: list[Push] = []
        for row in scene.get("inertia", []):
            if row["on"] in self.index:
                self.own[self.index[row["on"]]] += value(row["value"])
        for k, row in enumerate(scene.get("load", [])):
            self._push(f"load {k}", row, False)
        for k, row in enumerate(scene.get("damper", [])):
            c = value(row["coefficient"])
            self._add(f"damper {k}", row["on"], lambda _, speed, __, c=c: -c * speed)
        for name, row in scene.get("shafts", {}).items():
            if value(row.get("drag")):
                self._add(f"drag {name}", name, self._law(-value(row["drag"])))
        if "drive" in scene:
            self._drive(scene["drive"])
        self.breaks = self._breaks()

    def _mechanism(self, table: dict[str, Any]) -> None:
        crank, rod, gravity = table.get("crank", {}), table.get("rod", {}), self.scene.get("gravity")
        self.r, self.phase = value(crank["length"]), value(table.get("phase"))
        self.crank_mass, self.crank_com = value(crank.get("mass")), value(crank.get("com"))
        self.still = value(crank.get("inertia")) + self.crank_mass * self.crank_com**2
        self.rod_mass, self.rod_inertia, self.rod_com = (value(rod.get(k)) for k in ("mass", "inertia", "com"))
        self.weight = (0.0, 0.0)
        if gravity is not None:
            g, aim = value(gravity.get("g"), "9.80665 m/s^2"), value(gravity.get("direction"), "-90 deg")
            self.weight = (g * math.cos(aim), g * math.sin(aim))
        if table["type"] == "scotch-yoke":
            self.still += value(table.get("block", {}).get("mass")) * self.r**2
            self.block = value(table.get("block", {}).get("mass"))
            self.slide, self.aim = value(table["yoke"].get("mass")), value(table["yoke"].get("direction"))
        else:
            self.rod, self.offset = value(rod["length"]), value(table["slider"].get("offset"))
            self.slide = value(table["slider"].get("mass"))
        self.slider_crank = table["type"] == "slider-crank"
        ports = [(i, row) for i, row in enumerate(self.scene.get("inertia", [])) if row["on"] not in self.index]
        self.slide_added = sum(value(row["value"]) for _, row in ports)

    def body(self, angle: float) -> tuple[float, float, float, float]:
        """Reduced inertia, its slope, the work of weights and the way of the slide, per radian of the mechanism's crank."""
        s, c = math.sin(angle), math.cos(angle)
        gx, gy = self.weight
        fall = self.crank_mass * self.crank_com * (-s * gx + c * gy)
        m = self.slide + self.slide_added
        if not self.slider_crank:
            a = angle - self.aim
            v, acc = -self.r * math.sin(a), -self.r * math.cos(a)
            fall += self.slide * v * (gx * math.cos(self.aim) + gy * math.sin(self.aim))
            fall += self.block * self.r * (-s * gx + c * gy)
            return self.still + m * v * v, 2 * m * v * acc, fall, v
        r, rod, h = self.r, self.rod, self.rod_com
        sb = (self.offset - r * s) / rod
        cb = math.sqrt(1 - sb * sb)
        b1 = -r * c / (rod * cb)
        b2 = (r * s + rod * sb * b1 * b1) / (rod * cb)
        v, acc = -r * s - rod * sb * b1, -r * c - rod * (cb * b1 * b1 + sb * b2)
        gxv, gyv = -r * s - h * sb * b1, r * c + h * cb * b1
        gxa, gya = -r * c - h * (cb * b1 * b1 + sb * b2), -r * s - h * (sb * b1 * b1 - cb * b2)
        inertia = self.still + self.rod_mass * (gxv * gxv + gyv * gyv) + self.rod_inertia * b1 * b1 + m * v * v
        slope = 2 * (self.rod_mass * (gxv * gxa + gyv * gya) + self.rod_inertia * b1 * b2 + m * v * acc)
        fall += self.rod_mass * (gx * gxv + gy * gyv) + self.slide * gx * v
        return inertia, slope, fall, v

    def _add(self, name: str, on: str, law: Law, **kw: Any) -> None:
        given = {"every": self.cycle, "window": None, "sense": 0, "drive": False} | kw
        port = on not in self.index
        self.pushes.append(Push(name, self.slide_on if port else self.index[on], port, law, **given))

    def _push(self, name: str, row: dict[str, Any], drive: bool) -> None:
        raw = row.get("force", row.get("torque"))
        window = (value(row["from"]), value(row["to"])) if "from" in row else None
        sense = {"v > 0": 1, "v < 0": -1}.get(row.get("while", ""), 0)
        every = value(row.get("every"), self.cycle)
        self._add(name, row.get("on", "crank"), self._law(raw), every=every, window=window, sense=sense, drive=drive)

    def _law(self, raw: Any) -> Law:
        if raw == "balance":
            return lambda _, __, unknown: unknown
        try:
            constant = value(raw)
        except ValueError:
            code, names = compile(raw, "law", "eval"), self.parameters | vars(math)
            own = self.unknown

            def law(phi: float, speed: float, unknown: float) -> float:
                here = {"phi": phi, "omega": speed, "v": speed, "abs": abs, "max": max, "min": min}
                here["sign"] = lambda x: math.copysign(1.0, x)
                return float(eval(code, {"__builtins__": {}}, names | here | ({own: unknown} if own else {})))

            return law
        return lambda _, __, ___: constant

    def _drive(self, row: dict[str, Any]) -> None:
        motor = row.get("motor")
        self.synchronous = self.copper = None
        if motor is None:
            self._push("drive", row, True)
            return
        on = row.get("on", "crank")
        self.own[self.index[on]] += value(motor.get("inertia"))
        self._add("drive", on, self._motor(motor), drive=True)

    def _motor(self, motor: dict[str, Any]) -> Law:
        kind = motor["type"]
        if kind == "constant":
            torque = value(motor["torque"])
            return lambda _, __, ___: torque
        if kind == "line":
            start, idle = value(motor["starting_torque"]), value(motor["no_load_speed"])
            return lambda _, speed, __: start * (1 - speed / idle)
        rated = value(motor["power"]) / value(motor["speed"])
        most = float(motor["breakdown_ratio"])
        frequency = float(str(motor["frequency"]).removesuffix("Hz"))
        sync = self.synchronous = 2 * math.pi * frequency / (motor["poles"] / 2)
        steep = (1 - value(motor["speed"]) / sync) * (most + math.sqrt(most * most - 1))

        def kloss(_: float, speed: float, __: float) -> float:
            s = 1 - speed / sync
            return 2 * most * rated * s * steep / (s * s + steep * steep)

        return kloss

    def _breaks(self) -> list[float]:
        """Crank angles at which something switches: windows, and dead centres where a load minds the sense of motion."""
        result = {0.0, self.cycle}
        for push in self.pushes:
            ratio, phase = (self.shafts[push.shaft].speed, self.phase) if push.port else (1.0, 0.0)
            for edge in push.window or ():
                turns = math.ceil(ratio * self.cycle / push.every) + 1
                result |= {(edge - phase + k * push.every) / ratio for k in range(-turns, turns + 1)}
        if any(p.sense for p in self.pushes) or any(
            "sign(v)" in str(row.get("force")) for row in self.scene.get("load", [])
        ):
            ratio = self.shafts[self.slide_on].speed
            grid = np.linspace(0, self.cycle, 721)
            speeds = [self.body(ratio * a + self.phase)[3] for a in grid]
            for k in range(720):
                if speeds[k] * speeds[k + 1] < 0:
                    result.add(brentq(lambda a: self.body(ratio * a + self.phase)[3], grid[k], grid[k + 1], xtol=1e-15))
        kept: list[float] = []
        for angle in sorted(a for a in result if -1e-12 < a < self.cycle + 1e-12):
            if not kept or angle - kept[-1] > 1e-12:
                kept.append(angle)
        return kept

    def active(self, phi: float) -> tuple[bool, ...]:
        """Pushes that act at a crank angle."""
        result = []
        for push in self.pushes:
            angle = self.shafts[push.shaft].speed * phi + self.phase if push.port else phi
            on = True
            if push.window:
                start, end = (edge % push.every for edge in push.window)
                at = angle % push.every
                on = start <= at < end if start < end else at >= start or at < end
            if push.sense:
                on = on and push.sense * self.body(angle)[3] > 0
            result.append(on)
        return tuple(result)

    def torques(self, phi: float, omega: float, unknown: float, active: Sequence[bool]) -> list[float]:
        """The torque of every push on its own shaft (N m), 0 where it is idle."""
        result = []
        for push, on in zip(self.pushes, active, strict=True):
            if not on:
                result.append(0.0)
                continue
            speed = self.shafts[push.shaft].speed
            if push.port:
                angle = speed * phi + self.phase
                way = self.body(angle)[3]
                result.append(way * push.law(angle % push.every, way * speed * omega, unknown))
            else:
                result.append(push.law(phi % push.every, speed * omega, unknown))
        return result

    def shafts_at(self, phi: float, half: float, unknown: float, inertia: float, active: Any) -> tuple[list, list]:
        """For every shaft: the torque that it needs brought by its mesh is first * alpha + second, alone (N m, its own)."""
        omega = math.sqrt(2 * half)
        first, second = [], []
        for k, shaft in enumerate(self.shafts):
            first.append((self.own[k] + (inertia if k == self.wheel else 0.0)) * shaft.speed)
            second.append(0.0)
        if self.mechanism is not None:
            k, n = self.slide_on, self.shafts[self.slide_on].speed
            inertia_here, slope, fall, _ = self.body(n * phi + self.phase)
            first[k] += inertia_here * n
            second[k] += slope * n * n * half - fall
        for push, torque in zip(self.pushes, self.torques(phi, omega, unknown, active), strict=True):
            second[push.shaft] -= torque
        return first, second

    def series(self, first: Any, second: Any, alpha: float) -> tuple[float, list[float]]:
        """The remainder at the crank for an acceleration, and the torque that each shaft is brought (N m, its own)."""
        need = [a * alpha + b for a, b in zip(first, second, strict=True)]
        for k in range(len(self.shafts) - 1, 0, -1):
            shaft, tau = self.shafts[k], need[k]
            need[shaft.near] += shaft.gear * (tau / shaft.share if tau > 0 else tau * shaft.share)
        return need[0], need

    def solved(self, first: Any, second: Any) -> tuple[float, list[float]]:
        """The acceleration that leaves the crank no remainder, and the torque that each shaft is brought."""
        alpha, low, high = 0.0, -math.inf, math.inf
        for _ in range(200):
            remainder, need = self.series(first, second, alpha)
            outwards = [tau > 0 for tau in need]
            a, b = self.held(first, second, outwards)
            low, high = (alpha, high) if remainder < 0 else (low, alpha)
            step = -b / a
            if abs(step - alpha) <= 1e-15 * abs(step) or remainder == 0:
                return step, need
            inside = low < step < high
            alpha = step if inside or math.isinf(low + high) else 0.5 * (low + high)
            if low == high or (not inside and high - low <= 1e-15 * abs(high)):
                return alpha, need
        raise ArithmeticError("no acceleration")

    def held(self, first: Any, second: Any, outwards: Sequence[bool]) -> tuple[float, float]:
        """The crank's remainder, a alpha + b, with every mesh's direction held."""
        a, b = list(first), list(second)
        for k in range(len(self.shafts) - 1, 0, -1):
            shaft = self.shafts[k]
            price = shaft.gear * (1 / shaft.share if outwards[k] else shaft.share)
            a[shaft.near] += price * a[k]
            b[shaft.near] += price * b[k]
        return a[0], b[0]

    def brought(self, first: Any, second: Any, outwards: Sequence[bool]) -> tuple[float, list[float]]:
        """The acceleration with every mesh's direction held, and the torque that each shaft is brought."""
        a, b = self.held(first, second, outwards)
        alpha = -b / a
        need = [x * alpha + y for x, y in zip(first, second, strict=True)]
        for k in range(len(self.shafts) - 1, 0, -1):
            shaft = self.shafts[k]
            need[shaft.near] += shaft.gear * need[k] * (1 / shaft.share if outwards[k] else shaft.share)
        return alpha, need

    def cycle_from(self, half: float, unknown: float, inertia: float) -> tuple[Piece, ...]:
        """One cycle from half the square of the crank's speed at phi = 0, as pieces that end at everything that switches."""
        lossy = [k for k, s in enumerate(self.shafts) if s.share < 1]
        pieces: list[Piece] = []
        for start, end in zip(self.breaks[:-1], self.breaks[1:], strict=True):
            active, phi = self.active(0.5 * (start + end)), start
            while phi < end:
                phi, half = self._run(phi, end, half, (unknown, inertia, active), lossy, pieces)
        return tuple(pieces)

    def _run(self, phi: float, end: float, half: float, given: Any, lossy: list[int], pieces: list[Piece]) -> Any:
        """Step from phi to the end of what is active, or to where a mesh's power reverses."""
        ahead = min(1e-9, 0.5 * (end - phi))
        alpha, need = self.solved(*self.shafts_at(phi, half, *given))
        _, need = self.solved(*self.shafts_at(phi + ahead, half + ahead * alpha, *given))
        outwards = tuple(tau > 0 for tau in need)

        def rate(at: float, y: Any) -> Any:
            if y[0] <= 0:
                raise ArithmeticError("it stops")
            return [self.brought(*self.shafts_at(at, y[0], *given), outwards)[0]]

        def tau(at: float, dense: Any, k: int) -> float:
            return self.brought(*self.shafts_at(at, float(dense(at)[0]), *given), outwards)[1][k]

        def wrong(at: float, dense: Any, known: set[int]) -> int:
            taus = self.brought(*self.shafts_at(at, float(dense(at)[0]), *given), outwards)[1]
            most = max(abs(t) for t in taus)
            return next(
                (k for k in lossy if k not in known and (taus[k] > 0) != outwards[k] and abs(taus[k]) > 1e-13 * most), 0
            )

        solver = DOP853(rate, phi, [half], end, rtol=RTOL, atol=RTOL * half, max_step=self.cycle / STEPS)
        while solver.status == "running":
            solver.step()
            if solver.status == "failed":
                raise ArithmeticError("no step")
            dense, a, b = solver.dense_output(), solver.t_old, solver.t
            crossed, low = None, max(a, phi + ahead)
            for at in (*(a + q * (b - a) for q in INSIDE), b) if lossy else ():
                known: set[int] = set()
                while at > low and (k := wrong(at, dense, known)):  # the first of those that reverse
                    known.add(k)
                    inside = (tau(low, dense, k) > 0) == outwards[k]
                    crossed = at = brentq(tau, low, at, (dense, k), xtol=1e-15, rtol=1e-15) if inside else low
                if crossed is not None:
                    break
            stop = b if crossed is None else crossed
            pieces.append(Piece(a, stop, dense, given[2], outwards))
            if crossed is not None:
                return stop, float(dense(stop)[0])
        return end, float(solver.y[0])

    def extremes(self, pieces: Sequence[Piece], unknown: float, inertia: float) -> tuple[float, float]:
        """Greatest and least speed of the crank along a cycle."""
        result = []
        for p in pieces:
            given = (unknown, inertia, p.active)

            def alpha(at: float, p: Piece = p, given: Any = given) -> float:
                return self.brought(*self.shafts_at(at, float(p.half(at)[0]), *given), p.outwards)[0]

            grid = np.linspace(p.start, p.end, 4)
            slopes = [alpha(at) for at in grid]
            result += [float(p.half(p.start)[0]), float(p.half(p.end)[0])]
            for k in range(3):
                if slopes[k] * slopes[k + 1] < 0:
                    result.append(float(p.half(brentq(alpha, grid[k], grid[k + 1], xtol=1e-15))[0]))
        return math.sqrt(2 * max(result)), math.sqrt(2 * min(result))

    # -- the steady regime ------------------------------------------------------------------------------------------------

    @property
    def balanced(self) -> bool:
        return self.unknown is not None or self.scene.get("drive", {}).get("torque") == "balance"

    def lacking(self, speed: float, unknown: float, angles: int = 360) -> Any:
        """The crank's remainder (N m) at a constant speed, at angles of a cycle: above 0 the machine is slowed down."""
        result, half = [], 0.5 * speed * speed
        for phi in (np.arange(angles) + 0.5) * self.cycle / angles:
            _, second = self.shafts_at(phi, half, unknown, 0.0, self.active(phi))
            result.append(self.series([0.0] * len(self.shafts), second, 0.0)[0])
        return np.array(result)

    def constant_net(self, speed: float, unknown: float) -> float:
        """The mean of that."""
        return float(self.lacking(speed, unknown, 90).mean())

    def guess(self, asked: float | None) -> list[float]:
        """Speed and unknown to begin with."""
        if self.balanced:
            assert asked is not None
            unknown = 1.0
            while self.constant_net(asked, unknown) * self.constant_net(asked, -unknown) > 0:
                unknown *= 3
            return [asked, float(brentq(lambda u: self.constant_net(asked, u), -unknown, unknown, xtol=1e-6 * unknown))]
        if asked is not None:
            return [asked, 0.0]
        drive = next(p for p in self.pushes if p.drive)
        top = 1.3 * (self.synchronous or 1e4) / self.shafts[drive.shaft].speed
        speeds = top * np.geomspace(1, 1e-4, 120)
        k = next(k for k in range(119) if self.constant_net(speeds[k + 1], 0.0) <= 0)
        return [float(brentq(lambda s: self.constant_net(s, 0.0), speeds[k + 1], speeds[k], rtol=1e-6)), 0.0]

    def steady(self, inertia: float, start: Sequence[float], asked: float | None) -> tuple[list[float], tuple[Piece, ...]]:
        """Speed at phi = 0 and unknown with which the cycle repeats, about the mean of extremes asked for where balanced."""
        free = 2 if self.balanced else 1
        scale = np.array([start[0], abs(start[1]) or 1.0])[:free]

        def miss(x: Any) -> Any:
            w, unknown = x[0], x[1] if free == 2 else 0.0
            pieces = self.cycle_from(0.5 * w * w, unknown, inertia)
            end = math.sqrt(2 * float(pieces[-1].half(self.cycle)[0]))
            result = [(end - w) / scale[0]]
            if free == 2:
                assert asked is not None
                result.append(sum(self.extremes(pieces, unknown, inertia)) / 2 / asked - 1)
            return np.array(result), pieces

        x = np.array(start[:free], dtype=float)
        f, pieces = miss(x)
        jacobian = np.empty((free, free))
        for j in range(free):
            step = 1e-5 * scale[j]
            jacobian[:, j] = (miss(x + step * np.eye(free)[j])[0] - f) / step
        for _ in range(12):
            move = -np.linalg.solve(jacobian, f)
            move *= min(1.0, 0.2 / max(np.abs(move / scale).max(), 1e-300))
            for _ in range(8):
                try:
                    x_new = x + move
                    f_new, pieces = miss(x_new)
                    break
                except ArithmeticError:  # it came to rest
                    move = move / 4
            if np.abs(f_new).max() < 3e-13 or np.abs(move / scale).max() < 1e-14:
                x = x_new
                break
            jacobian += np.outer(f_new - f - jacobian @ move, move) / (move @ move)
            x, f = x_new, f_new
        return [float(x[0]), float(x[1]) if free == 2 else 0.0], pieces

    def asked_speed(self) -> float | None:
        regime = self.scene.get("regime", {})
        return (
            value(regime["speed"]) / self.shafts[self.index[regime.get("on", "crank")]].speed if "speed" in regime else None
        )

    def analysed(self, inertia: float, start: Sequence[float] | None = None) -> Regime:
        """The steady cycle with a flywheel (kg m², at its own shaft)."""
        request = self.asked_speed() if self.balanced else None
        x, pieces = self.steady(inertia, start or self.guess(request), request)
        return self.figures(inertia, x[1], pieces)

    def sized(self, irregularity: float) -> Regime:
        """The flywheel for an irregularity, by bracketing."""
        request = self.asked_speed() if self.balanced else None
        known: dict[float, tuple[float, list[float]]] = {}
        start = self.guess(request)

        def excess(inertia: float) -> float:
            near = min(known, key=lambda j: abs(j - inertia), default=None)
            x, pieces = self.steady(inertia, known[near][1] if near is not None else start, request)
            top, bottom = self.extremes(pieces, x[1], inertia)
            known[inertia] = (2 * (top - bottom) / (top + bottom) / irregularity - 1, x)
            return known[inertia][0]

        swing = np.ptp(np.cumsum(self.lacking(*start))) * self.cycle / 360
        least = 1e-6 * swing / (irregularity * (start[0] * self.shafts[self.wheel].speed) ** 2)
        low = high = 1e6 * least
        while excess(high) > 0:
            low, high = high, 2 * high
        while low == high or excess(low) < 0:
            low, high = low / 2, low
            if low < least:
                return self.analysed(0.0, known[high][1])
        inertia = brentq(lambda j: known[j][0] if j in known else excess(j), low, high, xtol=1e-14 * high, rtol=1e-13)
        return self.analysed(float(inertia), known[float(inertia)][1] if inertia in known else None)

    def figures(self, inertia: float, unknown: float, pieces: tuple[Piece, ...]) -> Regime:
        """All figures of a cycle that repeats, by Gauss on its steps."""
        n, speeds = len(self.shafts), np.array([s.speed for s in self.shafts])
        shares, slips = np.array([s.share for s in self.shafts]), np.array([s.slip for s in self.shafts])
        on = [q.shaft for q in self.pushes]
        drive = next((k for k, p in enumerate(self.pushes) if p.drive), 0)
        time, works, heat, square, sent = 0.0, np.zeros(len(self.pushes)), 0.0, 0.0, np.zeros((4, n))

        def at(phi: float, p: Piece) -> tuple[float, Any, Any]:
            """Speed of the crank, torques of the pushes and of the meshes, each on its own shaft."""
            half = float(p.half(phi)[0])
            omega = math.sqrt(2 * half)
            taus = self.brought(*self.shafts_at(phi, half, unknown, inertia, p.active), p.outwards)[1]
            return omega, np.array(self.torques(phi, omega, unknown, p.active)), np.array(taus)

        for p in pieces:
            mid, wide = 0.5 * (p.start + p.end), 0.5 * (p.end - p.start)
            for node, weight in zip(NODES, WEIGHTS, strict=True):
                omega, pushed, taus = at(mid + wide * node, p)
                dt = weight * wide / omega
                time += dt
                works += dt * pushed * speeds[on] * omega
                arrives = taus * speeds * omega
                gives = np.abs(np.where(arrives > 0, arrives / shares, arrives))  # the side that sends
                sent += dt * np.array([arrives, taus**2, gives * (1 - shares), gives * slips])
                square += dt * pushed[drive] ** 2
                if self.synchronous:
                    heat += dt * pushed[drive] * (self.synchronous - speeds[on[drive]] * omega)

        def row(phi: float, p: Piece) -> Any:
            """Powers into each shaft, the drive's power and torque, of which extremes are told."""
            omega, pushed, taus = at(phi, p)
            return np.array([*(taus * speeds * omega), pushed[drive] * speeds[on[drive]] * omega, pushed[drive]])

        grids = [np.linspace(p.start, p.end, 7) for p in pieces]
        values = np.array([[row(phi, p) for phi in grid] for p, grid in zip(pieces, grids, strict=True)])

        def greatest(k: int, sign: int) -> float:
            """The greatest value of a row, or of its negative."""
            rows = sign * values[:, :, k]
            best = rows.max()
            for j in np.flatnonzero(rows.max(axis=1) > best - 0.05 * np.ptp(rows)):
                i = int(np.clip(rows[j].argmax(), 1, 5))  # an extreme may stand beside the end of a step
                result = minimize_scalar(
                    lambda phi, j=j: -sign * row(phi, pieces[j])[k],
                    bounds=(grids[j][i - 1], grids[j][i + 1]),
                    method="bounded",
                    options={"xatol": 1e-9},
                )
                best = max(best, -float(result.fun))
            return float(best)

        flows = {
            s.name: Flow(
                sent[0, k] / time, -greatest(k, -1), greatest(k, 1), math.sqrt(sent[1, k] / time), *(sent[2:, k] / time)
            )
            for k, s in enumerate(self.shafts)
            if k
        }
        top, bottom = self.extremes(pieces, unknown, inertia)
        high, low = greatest(n, 1), -greatest(n, -1)
        return Regime(
            inertia=inertia,
            unknown=unknown,
            speed=(top + bottom) / 2,
            irregularity=2 * (top - bottom) / (top + bottom),
            speed_max=top,
            speed_min=bottom,
            period=time,
            mean_power=works[drive] / time,
            peak_power=high if high >= -low else low,
            rms_torque=math.sqrt(square / time),
            greatest_torque=max(greatest(n + 1, 1), greatest(n + 1, -1)),
            rotor_heat=heat / time,
            works={p.name: float(w) for p, w in zip(self.pushes, works, strict=True)},
            flows=flows,
            pieces=pieces,
        )
