"""Why no step here divides by a transformer's modulus: a slider-crank stepped from its slider's side stops or runs away.

The crank (inertia J, torque M) moves the slider (mass m, damping B, load F) through v = T(theta) omega. Written from the
slider's side, the equation of motion divides by T, which is 0 at both dead centres:

    slider side: m v' = (M - J alpha)/T - B v - F,    crank side: J alpha = M - T (m v' + B v + F).

In print the first is found with |T| for T, stepped by Euler. Here v counts inwards, as it does there, so that T is positive
while theta is between 0 and pi.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from bondgraph.elements import R, Se
from bondgraph.faults import GraphError, refuse, size_faults
from bondgraph.mechanisms.slider_crank import HARMONIC, Imposed, SliderCrank
from bondgraph.motion.simulation import Run, simulate

_RUNAWAY = 1e6  # rad/s; a crank faster than this is on its way to infinity
_TIGHT = 1e-11  # relative error of the run that the schemes are measured by

Divisor = Callable[[float], float]


class Loads(NamedTuple):
    """Torque on the crank (N m), damping (N s/m) and load (N) on the slider, the load against an inward motion."""

    torque: float = 0.0
    damping: float = 0.0
    load: float = 0.0


class Passage(NamedTuple):
    """How one scheme went: its step (s), the greatest |v - exact| (m/s; inf: it ran away), and the greatest theta (rad)."""

    scheme: str
    step: float
    error: float
    reached: float


@dataclass(frozen=True)
class Passages:
    """Every scheme with every step, and the angle (rad) that the crank truly reaches."""

    passages: tuple[Passage, ...]
    reached: float

    def errors(self, scheme: str) -> tuple[float, ...]:
        """Greatest velocity errors of one scheme, m/s, in the order of the steps."""
        found = tuple(p.error for p in self.passages if p.scheme == scheme)
        if not found:
            names = dict.fromkeys(p.scheme for p in self.passages)
            raise GraphError(f"no scheme {scheme!r}: there are {', '.join(names)}")
        return found

    def table(self) -> str:
        """The errors as text."""
        lines = [f"Euler through the dead centres; the crank truly turns to {self.reached:.4f} rad"]
        lines.append(f"{'scheme':16s}{'step, s':>10s}{'max |v - exact|':>18s}{'turns to, rad':>16s}")
        lines += [f"{p.scheme:16s}{p.step:10.0e}{p.error:18.3g}{p.reached:16.4f}" for p in self.passages]
        return "\n".join(lines)


def divided_by_modulus(
    machine: SliderCrank | None = None,
    loads: Loads = Loads(),  # noqa: B008 (immutable)
    *,
    start: tuple[float, float] = (1.0, 1.0),
    until: float = 6.0,
    steps: Sequence[float] = (1e-2, 1e-3, 1e-4),
    floor: float = 0.01,
) -> Passages:
    """A driven or free machine stepped by Euler through its dead centres, from the slider's side and from the crank's.

    From the slider's side the state is (theta, v): omega = v/T, and the slider's equation gives v'. The schemes are
    "|T|" (as found in print), "T", "T, floor" (|T| at least `floor`), and "crank side", with the state (theta, omega).
    The rod has no mass; the exact motion is that of the graph. Measured for r = 1 m, l = 2 m, J = 1/3 kg m², m = 1 kg from
    theta = 1 rad at 1 rad/s over 6 s (two to nine dead centres), greatest |v - exact| (m/s) for steps of 1e-2, 1e-3, 1e-4 s:

    ==========  ====================  ======================  ======================================================
    scheme      M = 0                 M = 1 N m               what happens
    ==========  ====================  ======================  ======================================================
    |T|         1.12, 1.10, 1.10      inf, inf, inf           turned back behind each dead centre: held at 3.14 rad,
                                                              or thrown to and fro until it runs away; 1e-5 s too
    T           1.03, 0.089, 0.0076   inf, 15, 4.9            omega = v/T there is the quotient of two errors: a kick
    T, floor    1.10, 1.10, 1.11      7.2, 6.9, 6.9           frozen: v holds no omega where T = 0, held at 3.14 rad
    crank side  0.085, 0.0085, 8e-4   2.7, 0.27, 0.027        first order in the step, as Euler is
    ==========  ====================  ======================  ======================================================

    Args:
        machine: the slider-crank; None for r = 1 m, l = 2 m and 1 kg each.
        loads: constant torque, damping and load.
        start: angle of the crank, rad, and its rate, rad/s.
        until: time to simulate, s.
        steps: lengths of step, s.
        floor: least modulus of the floored scheme, m.

    Raises:
        GraphError: if a step or the floor is not above 0.

    >>> found = divided_by_modulus(steps=(1e-2, 5e-3))
    >>> [round(a / b) for a, b in [found.errors("crank side"), found.errors("|T|")]]
    [2, 1]

    """
    _check(until, steps, floor)
    machine = replace(machine or SliderCrank(), rod=0.0)
    exact = _exact(machine, loads, start, until)
    divisors: dict[str, Divisor] = {"|T|": abs, "T": float, "T, floor": lambda t: math.copysign(max(abs(t), floor), t)}
    passages = [
        _passage(name, step, _slider_side(machine, loads, start, _count(until, step), step, divisor), exact)
        for name, divisor in divisors.items()
        for step in steps
    ]
    passages += [
        _passage("crank side", step, _crank_side(machine, loads, start, _count(until, step), step), exact) for step in steps
    ]
    return Passages(tuple(passages), float(exact.displacement("theta").max()))


def printed_programme(
    machine: SliderCrank | None = None,
    imposed: Imposed = HARMONIC,
    *,
    until: float = 10.0,
    steps: Sequence[float] = (1e-2, 1e-3, 1e-4),
    torque: str = "none",
) -> tuple[float, ...]:
    """Greatest |v - T omega| (m/s) of the programme found in print, which takes the crank's motion as known.

    It steps v' = (M - J alpha)/(|T| m) with M = 0, and alpha from second differences of theta. The motion then contradicts
    the torque: what v tends to is no velocity of the slider's. For theta = sin t over 10 s the error is 1.33, 1.32, 1.32 m/s
    at 1e-2, 1e-3, 1e-4 s; for theta = 5 t, 5.62 m/s at every step. With the torque that does impose the motion,
    J alpha + T m v', the modulus gives the force the wrong sign behind each dead centre: 1.33, 1.31, 1.30 m/s. Worse, where
    a grid point falls on a dead centre (theta = sin t over 2 pi s with 10^3, 10^4, 10^5 steps), the error of the second
    difference is divided by the rounding of T: 7e10, 7e8, 2e6 m/s.

    Args:
        machine: the slider-crank; None for r = 1 m, l = 2 m and 1 kg each. Its rod is taken without mass.
        imposed: motion of the crank.
        until: time to simulate, s.
        steps: lengths of step, s.
        torque: "none", or "needed" for the one that imposes the motion.

    Raises:
        GraphError: if `torque` is neither, or a step not above 0.

    """
    _check(until, steps, 1.0)
    if torque not in ("none", "needed"):
        raise GraphError(f"torque: found {torque!r}, expected 'none' or 'needed'")
    machine = machine or SliderCrank()
    return tuple(_printed(machine, imposed, _count(until, step), step, torque == "needed") for step in steps)


def _check(until: float, steps: Sequence[float], floor: float) -> None:
    refuse(size_faults([("until", until), ("floor", floor), *(("steps", step) for step in steps)]))


def _count(until: float, step: float) -> int:
    return max(1, round(until / step))


def _exact(machine: SliderCrank, loads: Loads, start: tuple[float, float], until: float) -> Run:
    b = machine.builder(start[0]).on("crank", Se("M", loads.torque))
    b.on("slider", Se("F", loads.load), R("B", loads.damping))  # x counts outwards, so a load against v pushes along it
    return simulate(b.build(), until, initial={"crank": start[1]}, rtol=_TIGHT)


def _alpha(machine: SliderCrank, loads: Loads, theta: float, omega: float) -> tuple[float, float]:
    """The crank's acceleration, from the crank's side, and T."""
    _, slope, bend = machine.along(1.0, theta, math)
    modulus, modulus_slope = -slope, -bend
    force = machine.slider * modulus_slope * omega**2 + loads.damping * modulus * omega + loads.load
    return (loads.torque - modulus * force) / (machine.crank_inertia + machine.slider * modulus**2), modulus


def _crank_side(
    machine: SliderCrank, loads: Loads, start: tuple[float, float], count: int, step: float
) -> list[tuple[float, float]]:
    theta, omega = start
    path = []
    for _ in range(count + 1):
        alpha, modulus = _alpha(machine, loads, theta, omega)
        path.append((theta, modulus * omega))
        theta, omega = theta + step * omega, omega + step * alpha
    return path


def _slider_side(
    machine: SliderCrank, loads: Loads, start: tuple[float, float], count: int, step: float, divisor: Divisor
) -> list[tuple[float, float]]:
    """(theta, v) at every step, ending early where the crank runs away."""
    theta, path = start[0], []
    v = _alpha(machine, loads, *start)[1] * start[1]
    for _ in range(count + 1):
        path.append((theta, v))
        by = divisor(_alpha(machine, loads, theta, 0.0)[1])
        omega = v / by if by else math.inf
        if not abs(omega) < _RUNAWAY:
            return [*path, (theta, math.inf)]
        alpha = _alpha(machine, loads, theta, omega)[0]
        push = (loads.torque - machine.crank_inertia * alpha) / by
        theta, v = theta + step * omega, v + step * (push - loads.damping * v - loads.load) / machine.slider
    return path


def _passage(scheme: str, step: float, path: list[tuple[float, float]], exact: Run) -> Passage:
    theta, v = np.array(path).T
    times = np.minimum(step * np.arange(v.size), exact.t[-1])
    return Passage(scheme, step, float(np.abs(v + exact.flow("slider", times)).max()), float(theta.max()))


def _printed(machine: SliderCrank, imposed: Imposed, count: int, step: float, needed: bool) -> float:
    t = step * np.arange(count + 2)
    theta = np.asarray(imposed.theta(t), dtype=float)
    omega, alpha = imposed.omega(t), imposed.alpha(t)
    _, slope, bend = machine.along(1.0, theta)
    acceleration = -(slope * alpha + bend * omega**2)
    torque: Any = machine.crank_inertia * alpha - slope * machine.slider * acceleration if needed else 0.0 * t
    differences = np.diff(theta, 2) / step**2
    inside = slice(1, count)  # it starts one step late, past the dead centre at theta = 0
    with np.errstate(divide="ignore", invalid="ignore"):
        rate = (torque[inside] - machine.crank_inertia * differences[inside]) / (np.abs(slope[inside]) * machine.slider)
    v = np.concatenate(([0.0], np.cumsum(step * rate)))
    return float(np.abs(v - (-slope * omega)[1 : count + 1]).max())
