"""Steady motion with torques that depend on speed, at 30 digits: shooting with the extrapolated midpoint rule.

I(phi) omega²/2 changes by the moment: with y = omega²/2, I y' + I' y = M(phi, omega). A periodic y is sought by Newton's
method, alone or together with the flywheel and the balance. Where an expression branches on the speed, or the tooth
force of a lossy stage changes its sense, the integration stops and starts again there.
"""

from __future__ import annotations

import ast
import copy
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from mpmath import mp  # type: ignore[import-untyped]

from .extrapolation import State, advanced, newton, root
from .jets import Jet
from .machine import Load, Machine, Term, active
from .quantities import Freeze, names, quantity, signed, switches

WIDEST = 48  # cells per turn
STRIDE = mp.mpf("0.0625")  # s
FUNCTIONS = {n: getattr(mp, n) for n in ("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sqrt", "exp", "log")}
ARGUMENTS = ("phi", "x", "v", "omega", "unknown")


class Turning(Machine):
    """A machine with dampers, whose expressions know the speed that the crank is said to have."""

    def __init__(self, scene: dict[str, Any], folder: Path = Path(), speed: Any = 1) -> None:
        self.speed = mp.mpf(speed)
        super().__init__({"regime": {}, **scene}, folder)
        self.dampers = [(self.place(d["on"]), quantity(d["coefficient"])) for d in scene.get("damper", [])]

    def env(self, load: Load, angle: Any, x: Jet, unknown: Any) -> dict[str, Any]:
        """The names of an expression at the crank's speed."""
        return super().env(load, angle, x, unknown) | {"omega": load.place.ratio * self.speed, "v": x.first * self.speed}

    def passive(self, phi: Jet, motions: list[Any]) -> list[Any]:
        """Weights, springs, and dampers."""
        gains = [(c, self.displacement(place, phi, motions).first) for place, c in self.dampers]
        drags = [Term(-c * g * g * self.speed, mp.zero, False) for c, g in gains]
        return super().passive(phi, motions) + drags


class Push(NamedTuple):
    """A load in a stretch where it is smooth: its law of (phi, x, v, omega, unknown), and the shift of its angle."""

    load: Load
    law: Callable[..., Any]
    shift: Any


class Frame(NamedTuple):
    """What one angle has: I*, its slope, moments that know no speed, damping, and (angle, x, gain) of every push."""

    inertia: Any
    slope: Any
    passive: Any
    damping: Any
    places: list[tuple[Any, Any, Any]]


class Smooth(NamedTuple):
    """A stretch of the cycle with every decision taken."""

    pushes: list[Push]
    frames: dict[Any, Frame]
    sense: int  # of the tooth force of the lossy stage


class Motion(NamedTuple):
    """A steady motion: its extremes with their angles, its mean over time, and its multiplier."""

    irregularity: Any
    speed: Any
    speed_max: Any
    speed_min: Any
    angle_speed_max: Any
    angle_speed_min: Any
    speed_time_mean: Any
    period: Any
    multiplier: Any
    drive_work: Any
    start: Any


def compiled(tree: ast.expr, parameters: dict[str, Any], unknown: str | None) -> Callable[..., Any]:
    """A smooth tree as a function of ARGUMENTS."""
    values: dict[str, Any] = {"pi": mp.pi, **FUNCTIONS, **parameters}

    class Rename(ast.NodeTransformer):
        def visit_Constant(self, node: ast.Constant) -> ast.AST:
            values[f"c{len(values)}_"] = mp.mpf(node.value)
            return ast.Name(f"c{len(values) - 1}_", ast.Load())

        def visit_Name(self, node: ast.Name) -> ast.AST:
            return ast.Name("unknown" if node.id == unknown else node.id, ast.Load())

    body = Rename().visit(copy.deepcopy(tree))
    arguments = ast.arguments([], [ast.arg(a) for a in ARGUMENTS], None, [], [], None, [])
    code = ast.fix_missing_locations(ast.Expression(ast.Lambda(arguments, body)))
    function: Callable[..., Any] = eval(compile(code, "<law>", "eval"), values)
    return function


class Regime:
    """The steady motions of a machine; flywheel and unknown are given with every question."""

    def __init__(self, scene: dict[str, Any], folder: Path = Path()) -> None:
        self.machine = Turning(scene, folder)
        self.scene = scene
        self.ratio = self.machine.shafts[scene.get("flywheel", {}).get("on", "crank")]
        shafts = scene.get("shafts", {})
        self.lossy = next((n for n, s in shafts.items() if "efficiency" in s), None)
        self.efficiency = quantity(shafts[self.lossy]["efficiency"]) if self.lossy else mp.one
        self.stretches: dict[Any, Smooth] = {}
        self.kept: dict[Any, dict[Any, Frame]] = {}
        self.wide = 2 * mp.pi / WIDEST
        angles = [self.machine.cycle * (i + mp.mpf("0.3141")) / 16 for i in range(16)]
        self.mean = mp.fsum(self.machine.piece(phi)(phi).inertia for phi in angles) / 16  # roughly, for first guesses

    # --- one angle ----------------------------------------------------------------------------------------------

    def smooth(self, middle: Any, phi: Any, y: Any, unknown: Any, flywheel: Any) -> Smooth:
        """The stretch around `middle`, what depends on speed decided at (phi, y)."""
        machine, omega = self.machine, mp.sqrt(2 * y)
        machine.speed = omega
        here = Jet(phi, mp.one)
        motions = [p.motion(p.angle(middle))(p.angle(here)) for p in machine.parts]
        pushes = []
        for load in machine.loads:
            seen = machine.angle(load, middle)
            shift = mp.floor(seen / load.every) * load.every
            x = machine.displacement(load.place, here, motions)
            if active(load, seen - shift) and not (load.sense and load.sense * x.first < 0):
                env = machine.env(load, machine.angle(load, phi) - shift, x, unknown)
                pushes.append(Push(load, self.law(load, seen - shift, env), shift))
        frames = self.kept.setdefault((middle, tuple(id(p.load) for p in pushes)), {})
        bare = Smooth(pushes, frames, 1)
        return (
            bare._replace(sense=1 if self.tooth(bare, middle, phi, y, unknown, flywheel) > 0 else -1) if self.lossy else bare
        )

    def law(self, load: Load, angle: Any, env: dict[str, Any]) -> Callable[..., Any]:
        """A load's law with its decisions taken."""
        law = load.law
        if isinstance(law, str):
            return lambda phi, x, v, omega, unknown: unknown
        if isinstance(law, mp.mpf):
            return lambda phi, x, v, omega, unknown: law
        if isinstance(law, list):
            turn, inside = next(
                (t, angle + t * load.every) for t in (-1, 0, 1) if law[0].start <= angle + t * load.every < law[-1].end
            )
            stretch = next(p for p in law if inside < p.end)
            return lambda phi, x, v, omega, unknown: stretch(phi + turn * load.every)
        tree = Freeze(env).visit(copy.deepcopy(law))
        return compiled(tree, self.machine.parameters, self.machine.unknown)

    def frame(self, smooth: Smooth, middle: Any, phi: Any) -> Frame:
        """The geometry at an angle, kept."""
        if phi not in smooth.frames:
            machine, here = self.machine, Jet(phi, mp.one)
            now = [p.motion(p.angle(middle))(p.angle(here)) for p in machine.parts]
            machine.speed = mp.zero
            passive = mp.fsum(t.constant for t in machine.passive(here, now))
            gains = [(c, machine.displacement(place, here, now).first) for place, c in machine.dampers]
            ports = [(push, machine.displacement(push.load.place, here, now)) for push in smooth.pushes]
            places = [(machine.angle(p.load, phi) - p.shift, x.value, x.first) for p, x in ports]
            damping = mp.fsum(c * g * g for c, g in gains)
            smooth.frames[phi] = Frame(*machine.kinetic(here, now), passive, damping, places)
        return smooth.frames[phi]

    def moments(self, smooth: Smooth, frame: Frame, omega: Any, unknown: Any) -> list[tuple[Load, Any]]:
        """Every load with its reduced moment."""
        ready = zip(smooth.pushes, frame.places, strict=True)
        return [(p.load, g * p.law(angle, x, g * omega, p.load.place.ratio * omega, unknown)) for p, (angle, x, g) in ready]

    # --- the lossy stage ----------------------------------------------------------------------------------------

    def behind(self, smooth: Smooth, middle: Any, phi: Any, y: Any, unknown: Any, flywheel: Any) -> tuple[Any, Any, Any]:
        """Inertia and moment behind the lossy stage, and the frame, all at the crank."""
        machine, frame, omega = self.machine, self.frame(smooth, middle, phi), mp.sqrt(2 * y)
        ratio = machine.shafts[self.lossy or "crank"]
        inertia = mp.fsum(
            v * ratio**2
            for i, (p, v) in zip(self.scene.get("inertia", []), machine.added, strict=True)
            if i["on"] == self.lossy
        )
        inertia += flywheel if self.scene["flywheel"].get("on") == self.lossy else 0
        moment = mp.fsum(
            m
            for load, m in self.moments(smooth, frame, omega, unknown)
            if load.place.part is None and load.place.ratio == ratio
        )
        return inertia, moment, frame

    def shares(self, smooth: Smooth, middle: Any, phi: Any, y: Any, unknown: Any, flywheel: Any) -> tuple[Any, ...]:
        """(front inertia, front moment, inertia behind, moment behind): constant inertias behind the stage."""
        inertia, moment, frame = self.behind(smooth, middle, phi, y, unknown, flywheel)
        omega = mp.sqrt(2 * y)
        every = mp.fsum(m for _, m in self.moments(smooth, frame, omega, unknown))
        net = every - moment + frame.passive - frame.damping * omega - frame.slope * y
        return frame.inertia + flywheel - inertia, net, inertia, moment

    def tooth(self, smooth: Smooth, middle: Any, phi: Any, y: Any, unknown: Any, flywheel: Any) -> Any:
        """The torque that the stage would carry if it lost nothing: its sign is that of the true one."""
        front, net, inertia, moment = self.shares(smooth, middle, phi, y, unknown, flywheel)
        return inertia * (net + moment) / (front + inertia) - moment

    def field(self, smooth: Smooth, middle: Any, unknown: Any, flywheel: Any, full: bool) -> Callable[[Any, State], State]:
        """d[y, time, drive's work]/dphi; y alone unless full."""

        def rates(phi: Any, state: State) -> State:
            y = state[0]
            if y <= 0:
                raise ArithmeticError("stall")
            omega = mp.sqrt(2 * y)
            frame = self.frame(smooth, middle, phi)
            moments = self.moments(smooth, frame, omega, unknown)
            if self.lossy:
                front, net, inertia, moment = self.shares(smooth, middle, phi, y, unknown, flywheel)
                loss = self.efficiency ** (-smooth.sense)
                rate = (net + loss * moment) / (front + loss * inertia)
            else:
                moment = mp.fsum(m for _, m in moments) + frame.passive - frame.damping * omega
                rate = (moment - frame.slope * y) / (frame.inertia + flywheel)
            return [rate, 1 / omega, mp.fsum(m for load, m in moments if load.drive)] if full else [rate]

        return rates

    # --- along the cycle ----------------------------------------------------------------------------------------

    def signs(self, smooth: Smooth, middle: Any, phi: Any, y: Any, unknown: Any, flywheel: Any) -> list[Any]:
        """The switches that depend on the speed."""
        machine, found = self.machine, []
        machine.speed = mp.sqrt(2 * y)
        here = Jet(phi, mp.one)
        for push in smooth.pushes:
            trees = list(switches(push.load.law)) if isinstance(push.load.law, ast.expr) else []
            for tree in trees:
                if names(tree) & {"omega", "v"} and not isinstance(tree, ast.Name):
                    now = [p.motion(p.angle(middle))(p.angle(here)) for p in machine.parts]
                    x = machine.displacement(push.load.place, here, now)
                    found.append(
                        signed(tree, machine.env(push.load, machine.angle(push.load, phi) - push.shift, x, unknown))
                    )
        return [*found, self.tooth(smooth, middle, phi, y, unknown, flywheel)] if self.lossy else found

    def cells(self, y: Any, flywheel: Any, unknown: Any, full: bool) -> list[tuple[Any, State, Any, State, Any]]:
        """(start, state, end, state, field) of every cell of a cycle that starts with y."""
        state = [mp.mpf(y), mp.zero, mp.zero] if full else [mp.mpf(y)]
        done = []
        breaks = self.machine.breaks
        for a, b in pairwise(breaks):
            middle, count = (a + b) / 2, int(mp.ceil((b - a) / self.wide))
            edges = [a + (b - a) * i / count for i in range(count)] + [b]
            at = a
            smooth = None
            for end in edges[1:]:
                while at < end:
                    smooth = smooth or self.fresh(middle, at, state, end, unknown, flywheel)
                    field = self.field(smooth, middle, unknown, flywheel, full)
                    stop, after = self.carried(smooth, middle, field, at, state, end, unknown, flywheel)
                    done.append((at, state, stop, after, field))
                    if stop < end:
                        smooth = None
                    at, state = stop, after
        return done

    def fresh(self, middle: Any, at: Any, state: State, end: Any, unknown: Any, flywheel: Any) -> Smooth:
        """The decisions just behind an angle."""
        first = self.smooth(middle, at, state[0], unknown, flywheel)
        rate = self.field(first, middle, unknown, flywheel, False)(at, state[:1])[0]
        ahead = (end - at) * mp.mpf("1e-9")
        return self.smooth(middle, at + ahead, state[0] + ahead * rate, unknown, flywheel)

    def carried(
        self, smooth: Smooth, middle: Any, field: Any, at: Any, state: State, end: Any, unknown: Any, flywheel: Any
    ) -> tuple[Any, State]:
        """The state at the end of a cell, or where a switch that depends on speed turns over."""
        after = advanced(field, at, state, end - at)
        ahead = (end - at) * mp.mpf("1e-8")
        near = [state[0] + ahead * field(at, state)[0]]
        before = self.signs(smooth, middle, at + ahead, near[0], unknown, flywheel)
        if not before:
            return end, after
        later = self.signs(smooth, middle, end, after[0], unknown, flywheel)
        stops = []
        for k, (f, g) in enumerate(zip(before, later, strict=True)):
            if f * g < 0:

                def switch(phi: Any, k: int = k) -> Any:
                    y = advanced(field, at, state, phi - at)[0]
                    return self.signs(smooth, middle, phi, y, unknown, flywheel)[k]

                stops.append(root(switch, at + ahead, end, f, g))
        if not stops:
            return end, after
        stop = min(stops)
        return stop, advanced(field, at, state, stop - at)

    def extremes(self, cells: list[Any]) -> list[tuple[Any, Any]]:
        """(speed, angle) wherever the speed may be extreme."""
        found = []
        for a, state, b, after, field in cells:
            found += [(mp.sqrt(2 * state[0]), a), (mp.sqrt(2 * after[0]), b)]
            f, g = field(a, state)[0], field(b, after)[0]
            if f * g < 0:
                kept: dict[Any, Any] = {}

                def slope(phi: Any, a: Any = a, state: State = state, field: Any = field, kept: Any = kept) -> Any:
                    kept[phi] = advanced(field, a, state[:1] if len(state) == 1 else state, phi - a)
                    return field(phi, kept[phi])[0]

                at = root(slope, a, b, f, g)
                found.append((mp.sqrt(2 * kept[at][0]), at))
        return found

    # --- questions ----------------------------------------------------------------------------------------------

    def spread(self, y: Any, flywheel: Any, unknown: Any) -> tuple[Any, Any, Any]:
        """(net gain of y in a cycle, as a share; irregularity; mean of extremes)."""
        cells = self.cells(y, flywheel, unknown, False)
        speeds = [w for w, _ in self.extremes(cells)]
        mean = (max(speeds) + min(speeds)) / 2
        return (cells[-1][3][0] - y) / y, (max(speeds) - min(speeds)) / mean, mean

    def steady(self, flywheel: Any, guess: Any, *, speed: Any = None, unknown: Any = None) -> tuple[Motion, Any, Any]:
        """(motion, flywheel, unknown) with a flywheel at the crank; with a speed, the unknown goes with it."""
        flywheel = mp.mpf(flywheel)

        def residual(u: State) -> State:
            gain, _, mean = self.spread(u[0], flywheel, u[1] if len(u) > 1 else mp.zero)
            return [gain, mean / speed - 1] if len(u) > 1 else [gain]

        start = [mp.mpf(guess) ** 2 / 2] + ([mp.mpf(unknown)] if unknown is not None else [])
        u = newton(residual, start)
        return self.motion(u[0], flywheel, u[1] if len(u) > 1 else mp.zero), flywheel, u[1] if len(u) > 1 else None

    def sized(
        self, eps: Any, flywheel: Any, guess: Any, *, speed: Any = None, unknown: Any = None
    ) -> tuple[Motion, Any, Any]:
        """(motion, flywheel at the crank, unknown) of an irregularity, from guesses."""

        def residual(u: State) -> State:
            gain, found, mean = self.spread(u[0], u[1], u[2] if len(u) > 2 else mp.zero)
            return [gain, found / eps - 1] + ([mean / speed - 1] if len(u) > 2 else [])

        start = [mp.mpf(guess) ** 2 / 2, mp.mpf(flywheel)] + ([mp.mpf(unknown)] if unknown is not None else [])
        u = newton(residual, start)
        free = u[2] if len(u) > 2 else None
        return self.motion(u[0], u[1], free or mp.zero), u[1], free

    def motion(self, y: Any, flywheel: Any, unknown: Any) -> Motion:
        """All of a periodic motion, on cells half as wide."""
        self.wide /= 2
        cells = self.cells(y, flywheel, unknown, True)
        self.wide *= 2
        last = cells[-1][3]
        assert abs(last[0] - y) < mp.mpf("1e-20") * y, "not periodic"
        found = self.extremes(cells)
        top, bottom = max(found), min(found)
        h = y * mp.mpf("1e-10")
        ends = [self.cells(y + s * h, flywheel, unknown, False)[-1][3][0] for s in (1, -1)]
        mean, length = (top[0] + bottom[0]) / 2, self.machine.cycle
        return Motion(
            (top[0] - bottom[0]) / mean, mean, top[0], bottom[0], top[1] % length, bottom[1] % length,
            length / last[1], last[1], (ends[0] - ends[1]) / (2 * h), last[2], y,
        )  # fmt: skip

    def march(self, phi: Any, omega: Any, flywheel: Any, times: list[Any], unknown: Any = 0) -> list[tuple[Any, Any]]:
        """(angle, speed) at ascending times from a state at time 0, by steps in time; for machines without breakpoints.

        Where the tooth force of a lossy stage turns over, the steps end and start again.
        """
        middle, unknown = self.machine.cycle / 2, mp.mpf(unknown)
        bare = self.smooth(middle, middle, mp.mpf("1e-6"), unknown, flywheel)

        def shares(phi: Any, omega: Any) -> tuple[Any, ...]:
            bare.frames.clear()
            if self.lossy:
                return self.shares(bare, middle, phi, omega**2 / 2, unknown, flywheel)
            frame = self.frame(bare, middle, phi)
            moment = mp.fsum(m for _, m in self.moments(bare, frame, omega, unknown))
            net = moment + frame.passive - frame.damping * omega - frame.slope * omega**2 / 2
            return frame.inertia + flywheel, net, mp.zero, mp.zero

        def tooth(state: State) -> Any:
            front, net, inertia, moment = shares(*state)
            return inertia * (net + moment) / (front + inertia) - moment

        def rates(loss: Any, t: Any, state: State) -> State:
            front, net, inertia, moment = shares(*state)
            return [state[1], (net + loss * moment) / (front + loss * inertia)]

        state, t, found = [mp.mpf(phi), mp.mpf(omega)], mp.zero, []
        for end in times:
            while t < end:
                h = min(STRIDE, end - t)
                ahead = advanced(partial(rates, mp.one), t, state, h * mp.mpf("1e-9"))
                sense = mp.sign(tooth(ahead)) if self.lossy else 0
                field = partial(rates, self.efficiency ** (-sense))
                after = advanced(field, t, state, h)
                if sense and tooth(after) * sense < 0:
                    start = state

                    def turned(part: Any, field: Any = field, t: Any = t, start: State = start) -> Any:
                        return tooth(advanced(field, t, start, part))

                    h = root(turned, h * mp.mpf("1e-9"), h, tooth(ahead), tooth(after))
                    after = advanced(field, t, state, h)
                state, t = after, end if h == end - t else t + h
            found.append((state[0], state[1]))
        return found
