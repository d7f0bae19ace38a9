"""A machine followed in time from a start to an end: run-up, run-down, load step, stall.

In order: what ends the motion (`until`), what the machine does along it (`sampled`, `worked`, `peak`), the steady regime
that it comes to (`regime_of`, `time_along`), its errors, the record of the motion (`Transient`), and `transient` itself.

Errors are absolute, under the names that the JSON has them by. They compare the motion with the run before it, of wider
tolerance, and add what the error of position and speed makes of them. They hold for the flywheel and the balance as printed,
whose own errors stand beside them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.motion.stepping import instant
from flywheel.components.motors import DC, Induction
from flywheel.machine.dynamics import Anchor, Dynamics
from flywheel.machine.machine import Machine
from flywheel.motion.simulation import Motion, moved
from flywheel.numerics import cells
from flywheel.numerics.cells import ROUNDING
from flywheel.numerics.faults import Fault, SceneError, show, told
from flywheel.numerics.units import QuantityError, parse_quantity
from flywheel.regime import turning_moment
from flywheel.regime.free_motion import ONSET, Goal, Passing, Start, Trail, Watching, end_of_stroke
from flywheel.regime.joint_friction import machine_of
from flywheel.regime.state import own_coordinate
from flywheel.scene.scene import TURN, Scene
from flywheel.sizing.results import Sizing
from flywheel.sizing.sizing import size

Kind = Literal["time", "way", "speed", "share", "regime", "stop"]
_DIMENSIONS: tuple[tuple[Kind, str], ...] = (("time", "time"), ("way", "angle"), ("speed", "speed"), ("speed", "velocity"))
_TURNS = re.compile(r"\s*([-+.\deE]+)\s*turns?\s*")
_SHARE = re.compile(r"\s*([-+.\deE]+)\s*%\s*")
_EXPECTED = '"regime", "stop", or a time, a number of turns, a speed or a share of the regime\'s, such as "5 s" or "95 %"'


class Until(NamedTuple):
    """The end of a motion: time (s), way (rad), speed (rad/s; m/s where a driver slides), share of the regime's speed."""

    kind: Kind
    value: float = 0.0


def until(text: str) -> Until:
    """What a text says of the end of a motion; a SceneError where it says nothing that is known.

    >>> until("5 s"), until("2 turns").kind, until("95 %"), until("regime").kind
    (Until(kind='time', value=5.0), 'way', Until(kind='share', value=0.95), 'regime')
    """
    word = text.strip()
    if word == "regime":
        return Until("regime")
    if word == "stop":
        return Until("stop")
    found = _counted(text) or _measured(text)
    if found is None or not 0.0 < found.value < float("inf"):
        raise SceneError([Fault("until", show(text), _EXPECTED)])
    return found


def _counted(text: str) -> Until | None:
    """Turns, and shares of the regime's speed."""
    for pattern in (_TURNS, _SHARE):
        if match := pattern.fullmatch(text):
            try:
                number = float(match[1])
            except ValueError:
                return None
            return Until("way", number * TURN) if pattern is _TURNS else Until("share", number / 100)
    return None


def _measured(text: str) -> Until | None:
    for kind, dimension in _DIMENSIONS:
        try:
            if not _bare(text):
                return Until(kind, parse_quantity(text, dimension))
        except QuantityError:
            continue
    return None


def _bare(text: str) -> bool:
    """Whether a text is a number without a unit, which could be anything."""
    try:
        float(text)
    except ValueError:
        return False
    return True


# -- figures along a motion -------------------------------------------------------------------------------------------

Array = NDArray[np.float64]

_TOGETHER = 20_000  # times that are looked at in one go
_GAUSS = 10  # nodes in a step
_TOPS = 64  # how many of the highest samples are looked at more closely
_FINER, _ROUNDS = 33, 4  # times between the neighbours of a top, and how often they are laid closer

DRIVE = "drive"


class Samples(NamedTuple):
    """A motion at times t (s): phi (rad, not reduced), omega (rad/s), acceleration (rad/s²), moment M* less losses (N m).

    `drive` is the drive's torque at its own shaft (N m), `power` what it gives (W), `loss` what meshes lose (W), `kinetic`
    the kinetic energy (J), `current` a motor's (A; None without a DC motor). On a stroke whose driver slides: m, m/s, N.
    """

    t: Array
    phi: Array
    omega: Array
    acceleration: Array
    moment: Array
    drive: Array
    power: Array
    loss: Array
    kinetic: Array
    current: Array | None


class _Here(NamedTuple):
    """States at some times, with what the machine's laws need to know there."""

    phi: Array
    anchor: Anchor
    omega: Array
    time: Array
    current: Any


def sampled(trail: Trail, times: Array, owners: NDArray[np.intp] | None = None) -> Samples:
    """The motion at times within it; at an end of a stretch `owners` tell the side (the one before, where they are None)."""
    owners = trail.owners(times) if owners is None else owners
    parts = [_sampled(trail, times[k : k + _TOGETHER], owners[k : k + _TOGETHER]) for k in range(0, times.size, _TOGETHER)]
    joined: list[Any] = [None if column[0] is None else np.concatenate(column) for column in zip(*parts, strict=True)]
    return Samples._make(joined)


def _sampled(trail: Trail, times: Array, owners: NDArray[np.intp]) -> Samples:
    dynamics, states = trail.dynamics, trail.states(times, owners)
    here = _here(trail, times, owners, states)
    now = dynamics.along(*here)
    moments = dynamics.moments(*here)
    drive = moments.get(DRIVE, np.zeros_like(times))
    kinetic = 0.5 * now.inertia * states[1] ** 2
    current = drive_current(trail, states)
    power, loss = drive * states[1], now.loss * states[1]
    shaft = drive / dynamics.ratio
    return Samples(times, states[0], states[1], now.acceleration, now.moment, shaft, power, loss, kinetic, current)


def drive_current(trail: Trail, states: Array) -> Array | None:
    """The current (A) of a DC motor: a state of its own, or what its speed makes it."""
    if states.shape[0] > 3:
        return np.asarray(states[3])
    motor = trail.dynamics.machine.scene.motor
    if not isinstance(motor, DC):
        return None
    return np.asarray(motor.current(trail.dynamics.ratio * states[1]))


def _here(trail: Trail, times: Array, owners: NDArray[np.intp], states: Array) -> _Here:
    used, where = np.unique(owners, return_inverse=True)
    stretches = [trail.stretches[k] for k in used]
    offset = np.array([stretch.offset for stretch in stretches])[where]
    anchors = np.array([stretch.anchor[:3] for stretch in stretches])[where]
    factors: tuple[Any, ...] | None = None
    if stretches[0].anchor.factors is not None:
        rows = np.array([stretch.anchor.factors for stretch in stretches])[where]
        factors = tuple(rows.T)
    anchor = Anchor(anchors[:, 0], anchors[:, 1], anchors[:, 2], factors)
    current = states[3] if states.shape[0] > 3 else 0.0
    return _Here(states[0] - offset, anchor, states[1], times, current)


def switching(trail: Trail) -> tuple[Array, NDArray[np.intp]]:
    """Times at which a law switches or a piece ends, each twice, and the stretches on either side."""
    stretches = trail.stretches
    last = np.array(
        [k for k in range(len(stretches) - 1) if stretches[k].anchor is not stretches[k + 1].anchor], dtype=np.intp
    )
    return np.repeat(trail.t[last + 1], 2), np.column_stack((last, last + 1)).ravel()


def within(trail: Trail, inside: Array) -> tuple[Array, NDArray[np.intp]]:
    """Times in every stretch, at its ends and at shares (0 to 1) of it, and the stretches that they belong to."""
    shares = np.concatenate(([0.0], inside, [1.0]))
    start, end = trail.t[:-1, None], trail.t[1:, None]
    times = start + (end - start) * shares
    times[:, -1] = trail.t[1:]
    return times.ravel(), np.repeat(np.arange(len(trail.stretches)), shares.size)


class Works(NamedTuple):
    """Work (J) of all that pushes or drags, by its part; what meshes took (J); heat of a DC motor's armature (J).

    `rotor` is the heat of an induction motor's rotor (J).
    """

    by_part: dict[str, float]
    meshes: float
    copper: float | None
    rotor: float | None


def nodes(trail: Trail) -> tuple[Array, Array, NDArray[np.intp]]:
    """Gauss nodes in every step, their weights (s), and the stretches that they belong to."""
    points, weights = np.polynomial.legendre.leggauss(_GAUSS)
    start = np.array([stretch.step.start for stretch in trail.stretches])[:, None]
    half = 0.5 * (np.array([stretch.step.end for stretch in trail.stretches])[:, None] - start)
    owners = np.repeat(np.arange(half.size), _GAUSS)
    return (start + half * (1.0 + points)).ravel(), (half * weights).ravel(), owners


def worked(trail: Trail) -> Works:
    """Work of every part over a motion: the integral of moment times speed over every step, by Gauss quadrature.

    It follows from the motion by dense output, apart from the work that time stepping itself adds up.
    """
    times, weights, owners = nodes(trail)
    parts: dict[str, float] = {}
    motor, ratio = trail.dynamics.machine.scene.motor, trail.dynamics.ratio
    copper = 0.0 if isinstance(motor, DC) else None
    rotor = 0.0 if isinstance(motor, Induction) else None
    meshes = 0.0
    for k in range(0, times.size, _TOGETHER):
        some = slice(k, k + _TOGETHER)
        states = trail.states(times[some], owners[some])
        here = _here(trail, times[some], owners[some], states)
        pace = weights[some] * states[1]
        for part, moment in trail.dynamics.moments(*here).items():
            parts[part] = parts.get(part, 0.0) + float(pace @ moment)
        meshes += float(pace @ trail.dynamics.along(*here).loss)
        current = drive_current(trail, states)
        if isinstance(motor, DC) and copper is not None and current is not None:
            copper += float(weights[some] @ motor.copper_heat(current))
        if isinstance(motor, Induction) and rotor is not None:
            rotor += float(weights[some] @ motor.rotor_heat(ratio * states[1]))
    return Works(parts, meshes, copper, rotor)


class Peak(NamedTuple):
    """A greatest value and the time (s) at which it is reached."""

    value: float
    time: float


def close(trail: Trail) -> tuple[Samples, NDArray[np.intp]]:
    """The motion in every stretch, at both its ends and at ten times between, and the stretches that these belong to."""
    points, _ = np.polynomial.legendre.leggauss(_GAUSS)
    times, owners = within(trail, 0.5 * (1.0 + points))
    return sampled(trail, times, owners), owners


def peak(trail: Trail, name: str, samples: Samples, owners: NDArray[np.intp]) -> Peak:
    """The greatest value of a column of `close` samples: on either side of every jump, or between two samples of a stretch.

    About the highest samples it is looked for again, closer each time.
    """
    return max(summits(trail, name, samples, owners), key=lambda one: one.value)


def summits(trail: Trail, name: str, samples: Samples, owners: NDArray[np.intp]) -> list[Peak]:
    """The greatest values about each of the highest samples; the very greatest sample first."""
    times, values = samples.t, getattr(samples, name)
    best = int(values.argmax())
    tops = _tops(values, owners)
    own = owners[tops]
    summit = [Peak(float(values[best]), float(times[best])), *(Peak(float(values[k]), float(times[k])) for k in tops)]
    low, high = (times[_beside(tops, owners, side)] for side in (-1, 1))
    for _ in range(_ROUNDS):
        grid = np.linspace(low, high, _FINER, axis=1)
        finer = getattr(sampled(trail, grid.ravel(), np.repeat(own, _FINER)), name).reshape(grid.shape)
        rows, column = np.arange(tops.size), finer.argmax(axis=1)
        here = map(Peak, finer[rows, column].tolist(), grid[rows, column].tolist())
        summit[1:] = [max(pair, key=lambda one: one.value) for pair in zip(summit[1:], here, strict=True)]
        low, high = grid[rows, np.maximum(column - 1, 0)], grid[rows, np.minimum(column + 1, _FINER - 1)]
    return summit


def _tops(values: Array, owners: NDArray[np.intp]) -> NDArray[np.intp]:
    """The highest samples that no neighbour in their stretch exceeds."""
    every = np.arange(values.size)
    top = np.logical_and.reduce([values >= values[_beside(every, owners, side)] for side in (-1, 1)])
    found = np.flatnonzero(top)
    return np.asarray(found[np.argsort(values[found], kind="stable")[-_TOPS:]])


def _beside(which: NDArray[np.intp], owners: NDArray[np.intp], side: int) -> NDArray[np.intp]:
    """The neighbours of samples, or they themselves where their stretch ends."""
    other = np.clip(which + side, 0, owners.size - 1)
    return np.where(owners[other] == owners[which], other, which)


# -- the steady regime ------------------------------------------------------------------------------------------------


class Regime(NamedTuple):
    """A steady cycle: its mean speed over time (rad/s), its period (s), and the analysis that it comes from."""

    speed: float
    period: float
    sizing: Sizing


def regime_of(machine: Machine, inertia: float) -> Regime:
    """The steady regime of a machine with a flywheel of some inertia (kg m² at its own shaft).

    Raises SceneError where there is none.
    """
    scene = replace(machine.scene, inertia=inertia, irregularity=None)
    sizing = size(scene, simulate=False)
    found = sizing.simulation
    if found is None or found.period is None or found.speed_time_mean is None:
        raise SceneError([Fault("regime", "a machine whose steady motion has no period", "one that has inertia")])
    return Regime(found.speed_time_mean, found.period, sizing)


def speed_at(sizing: Sizing, phi: ArrayLike) -> Array:
    """Crank speed (rad/s) of the steady cycle at crank angles phi (rad)."""
    cycle, run = sizing.cycle, sizing.run
    if cycle is None or run is None:
        raise SceneError([Fault("regime", "a sizing without a steady motion", "a machine that has inertia")])
    return turning_moment.speed_over_cycle(cycle, sizing.speed, run, np.asarray(phi, dtype=float) % sizing.scene.cycle)


def time_along(sizing: Sizing, phi: ArrayLike) -> Array:
    """Time (s) since phi = 0 along the steady cycle: t = integral of dphi/omega from 0 to phi.

    Args:
        sizing: of a scene, with its steady motion.
        phi: crank angles, rad, any shape; beyond a cycle, whole periods are added.

    Raises:
        SceneError: for a sizing that has no steady motion.

    Quadrature on the cells of the sizing, with 1/omega as a Chebyshev series on each, halved where that is not enough.
    Source: the course's time along the cycle, t = t0 + integral of dphi/omega.

    >>> import flywheel
    >>> scene = flywheel.load({"load": [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}],
    ...                        "drive": {"torque": "balance"}, "regime": {"speed": 10}, "flywheel": {"inertia": 50}})
    >>> sizing = flywheel.size(scene, simulate=False)
    >>> half = float(time_along(sizing, np.pi))  # a speed that falls evenly: from w + d to w - d, and back
    >>> abs(half / sizing.simulation.period - 0.5) < 1e-12
    True

    """
    angles = np.asarray(phi, dtype=float)
    speed_at(sizing, 0.0)
    assert sizing.cycle is not None
    turns = np.floor(angles / sizing.scene.cycle)
    mesh = cells.cells(_fine_edges(sizing))
    series = cells.fit(1.0 / speed_at(sizing, mesh.phi))
    rising = cells.antiderivative(series, mesh.half)
    start = cells.accumulated(rising)
    within = angles - turns * sizing.scene.cycle
    cell, t = cells.located(mesh, within)
    local = (rising[cell] * cells.basis(t)).sum(axis=-1)
    return np.asarray(turns * start[-1] + start[cell] + local)


def _fine_edges(sizing: Sizing) -> Array:
    """Cells on which 1/omega is a polynomial, to what the sizing asks."""
    assert sizing.cycle is not None

    def evaluated(edges: Array) -> tuple[Array, float, cells.Coarse]:
        mesh = cells.cells(edges)
        slowness = 1.0 / speed_at(sizing, mesh.phi)
        shares = cells.tails(cells.fit(slowness)) * mesh.half[:, 0] / float(cells.integral(slowness, mesh.half).sum())
        return edges, float(shares.sum()), cells.above(shares)

    return cells.refined(sizing.cycle.mesh.edges, evaluated, 0.1 * sizing.rtol)


# -- what ends a motion -----------------------------------------------------------------------------------------------

MOST_CYCLES = 1000.0
CREEPING = 1e-12  # of the speed at the start: slower than this it stands, or never will
_MOST_TIME = 20.0  # times as long as those cycles take at the machine's pace
_LOOKED_AT = np.array([0.1, 0.35, 0.6, 0.85])  # of a piece
_SEEN = 9  # speeds, and times, at which it is seen whether a drive pushes
_OFF = 0.01  # of the greatest push of a drive: with less it is off
_SETTLED = 1e-6  # of the speed: what is still missing to the regime
_SHORT = 1e-9  # the same, before a speed counts as out of reach
_NAMES = {"regime": "regime", "stop": "steady", "speed": "settled", "share": "settled"}


class Setting(NamedTuple):
    """A machine as it is followed, and what is known of it before, with relative errors of flywheel and balance."""

    machine: Machine
    dynamics: Dynamics
    inertia: float
    balance: float
    regime: Regime | None
    no_regime: str
    inertia_error: float = 0.0
    balance_error: float = 0.0


def needed(setting: Setting) -> Regime:
    """The regime, or a SceneError that says why there is none."""
    if setting.regime is None:
        raise SceneError([Fault("regime", setting.no_regime, "a machine that has a regime", "name a speed or a time")])
    return setting.regime


def target_of(setting: Setting, goal: Until) -> float:
    """The speed (rad/s) that is to be reached."""
    return goal.value * (needed(setting).speed if goal.kind == "share" else 1.0)


def at_rest(dynamics: Dynamics, begin: Start, t: float = 0.0) -> tuple[float, float]:
    """M* as the machine sets out from rest at t (s), and how large the moments in it are, there and over the cycle.

    It is M* just ahead of the start, before losses in meshes; friction is that of a motion forwards.
    """
    machine = dynamics.machine
    cycle = machine.scene.cycle
    phi = begin.phi if machine.scene.stroke is not None else begin.phi % cycle
    middle = float(machine.anchors(phi))
    place = Anchor(middle, ONSET * machine.typical_speed, t, tuple(1.0 for _ in machine.stages))
    parts = dynamics.moments(np.array([phi]), place, np.zeros(1), np.full(1, t), begin.current)
    around = _around(machine)
    still = np.zeros_like(around)
    over = dynamics.moments(around, place._replace(phi=machine.anchors(around)), still, still + t, begin.current)
    largest = sum(float(np.abs(part).max()) for part in over.values())
    return float(sum(part[0] for part in parts.values())), largest + float(sum(abs(part[0]) for part in parts.values()))


def pushes(dynamics: Dynamics, trail: Trail, last: float) -> bool:
    """Whether at the end (s) the drive pushes forwards anywhere in the cycle, at rest or at a speed that the motion had.

    One that does not, as time has switched it off (to a hundredth of its greatest push) or it brakes, lets the machine
    stop; any other was too weak.
    """
    machine = dynamics.machine
    speeds = np.unique(np.append(np.abs(trail.ends()[1]), 0.0))
    speeds = speeds[np.linspace(0, speeds.size - 1, min(speeds.size, _SEEN)).astype(int)]
    axes = _around(machine), speeds, np.linspace(last, 0.0, _SEEN)
    phi, omega, time = (grid.ravel() for grid in np.meshgrid(*axes, indexing="ij"))
    place = Anchor(
        machine.anchors(phi), np.maximum(omega, ONSET * machine.typical_speed), time, tuple(1.0 for _ in machine.stages)
    )
    current = 0.0 if dynamics.circuit is None else dynamics.circuit.current(dynamics.ratio * omega)
    drive = dynamics.moments(phi, place, omega, time, current).get("drive", np.zeros(phi.size))
    return bool(drive[time == last].max() > _OFF * max(float(drive.max()), 0.0))


def _around(machine: Machine) -> Array:
    """Positions all over the cycle, or the stroke, in every piece of it."""
    return np.asarray((machine.restarts[:-1, None] + np.diff(machine.restarts)[:, None] * _LOOKED_AT).ravel())


def goals_of(setting: Setting, begin: Start, goal: Until) -> list[Goal]:
    """What ends the motion, beside time; stopping always does."""
    slow = CREEPING * begin.omega
    found = [Goal("stop", lambda t, phi, omega: omega - slow)]
    way = goal.value if goal.kind == "way" else MOST_CYCLES * setting.machine.scene.cycle
    if goal.kind != "time":
        name = "way" if goal.kind == "way" else "limit"
        found.append(Goal(name, lambda t, phi, omega: begin.phi + way - phi))
    if goal.kind in ("speed", "share"):
        target = target_of(setting, goal)
        sense = 1.0 if target > begin.omega else -1.0
        found.append(Goal(goal.kind, lambda t, phi, omega: sense * (target - omega)))
    return found


def settling(setting: Setting, goal: Until, rtol: float) -> Passing | None:
    """What tells, at the end of every cycle, whether the speed there has settled.

    Three speeds in turn tell the rate at which they settle, and with it how much is still missing. Where laws depend on
    time, a speed or a stop may still come.
    """
    if goal.kind not in _NAMES or (goal.kind != "regime" and setting.machine.depends_on_time):
        return None
    name = _NAMES[goal.kind]
    missing = _SHORT if name == "settled" else _SETTLED
    speeds: list[float] = []

    def passing(t: float, omega: float) -> str | None:
        speeds.append(omega)
        if len(speeds) < 3:
            return None
        before, last = speeds[-2] - speeds[-3], speeds[-1] - speeds[-2]
        if max(abs(last), abs(before)) <= 10 * rtol * omega:  # the steps' own error tells no rate
            return name
        rate = min(abs(last / before), 1.0) if before else 0.0
        return name if abs(last) <= missing * omega * (1.0 - rate) else None

    return passing


def limit_of(setting: Setting, begin: Start, goal: Until) -> float:
    """The time (s) at which a motion is given up, or that was asked for."""
    if goal.kind == "time":
        return goal.value
    machine = setting.machine
    pace = max(machine.typical_speed, begin.omega) if setting.regime is None else setting.regime.speed
    return _MOST_TIME * MOST_CYCLES * machine.scene.cycle / pace


# -- errors -----------------------------------------------------------------------------------------------------------

_COLUMNS = {"speed": "omega", "torque": "drive", "power": "power", "current": "current"}


@np.errstate(all="ignore")  # of a figure without a scale nothing is known
def estimates(transient: Transient) -> dict[str, Any]:
    """Errors in the figures' own units; None where there is no figure, or nothing is known of its error."""
    motion = transient.motion
    fine, rough = motion.trail, motion.rough
    assert fine is not None
    other = fine if rough is None or not rough.stretches else rough
    samples, owners = close(fine)
    before, sides = close(other)
    fastest = float(np.abs(samples.omega).max())
    way = max(float(np.ptp(samples.phi)), fine.dynamics.machine.scene.cycle / (2 * np.pi))
    position, speed, time = motion.error * way, motion.error * fastest, motion.error * transient.time
    peaks: dict[str, Any] = {}
    old = peaks_of(other, before, sides)
    for name, column in _COLUMNS.items():
        now, then = getattr(transient.peaks, name), getattr(old, name)
        if now is None or then is None:
            peaks[name] = None
            continue
        value = motion.share * abs(now.value - then.value) + motion.error * float(np.abs(getattr(samples, column)).max())
        peaks[name] = {"value": value, "time": time + _when(fine, column, samples, owners, now, value)}
    return {
        **transient.given_errors,
        "end": {"t": time, "phi": position, "omega": 0.0 if transient.omega == 0.0 else speed},
        "way": position,
        "turns": position / (2 * np.pi),
        "time_to_95_percent": _late(transient, other, before, speed, time),
        "peaks": peaks,
        "energy": _energies(transient, energy_of(worked(other), before.kinetic)._asdict(), float(samples.kinetic.max())),
    }


def of_samples(transient: Transient, points: int) -> dict[str, float | None]:
    """The greatest error of each column of the motion over so many times, evenly."""
    motion = transient.motion
    assert motion.trail is not None
    rough = motion.trail if motion.rough is None or not motion.rough.stretches else motion.rough
    times = np.linspace(0.0, min(motion.trail.t[-1], rough.t[-1]), points)
    fine, before = sampled(motion.trail, times), sampled(rough, times)
    found: dict[str, float | None] = {"t": ROUNDING * float(times[-1])}
    for name, now, then in zip(Samples._fields[1:], fine[1:], before[1:], strict=True):
        found[name] = None
        if now is not None and then is not None:
            found[name] = motion.share * float(np.abs(now - then).max()) + 2 * motion.error * float(np.abs(now).max())
    return found


def _late(transient: Transient, other: Trail, before: Samples, speed: float, time: float) -> float | None:
    """Error (s) of the time to 95 % of the regime: what speed and regime are off by, over the acceleration there."""
    when, steady = transient.time_to_regime, transient.regime_speed
    if when is None or steady is None:
        return None
    if when == 0.0:
        return 0.0
    assert transient.motion.trail is not None
    then = reached(other, SHARE * steady, before.t, before.omega)
    acceleration = abs(float(sampled(transient.motion.trail, np.array([when])).acceleration[0]))
    off = (speed + SHARE * (transient.given_errors["regime_speed"] or 0.0)) / acceleration
    return None if then is None else transient.motion.share * abs(when - then) + off + time


def _when(trail: Trail, name: str, samples: Samples, owners: NDArray[np.intp], top: Peak, off: float) -> float:
    """How far (s) from a peak's time its column may be as great, as far as its values are known.

    The column falls from a peak at least as a parabola does, or evenly, to its samples on either side; other summits count
    where they may be as great.
    """
    values = getattr(samples, name)
    near = [one for one in summits(trail, name, samples, owners) if one.value >= top.value - 2 * off]
    far = max(abs(one.time - top.time) for one in near)
    lower = np.flatnonzero(values < top.value - 2 * off)
    wide = 0.0
    for beside in (lower[samples.t[lower] <= top.time][-1:], lower[samples.t[lower] >= top.time][:1]):
        for k in beside:
            share = min(2 * off / (top.value - float(values[k])), 1.0)
            wide = max(wide, abs(float(samples.t[k]) - top.time) * float(np.sqrt(share)))
    return far + wide


def _energies(transient: Transient, before: dict[str, Any], kinetic: float) -> dict[str, Any]:
    """Errors (J) of works, heats and kinetic energy: of two runs, of speeds, and of how far all of it closes."""
    energy, motion = transient.energy, transient.motion
    scale = max(kinetic, abs(energy.drive), energy.meshes, *map(abs, energy.works.values()), 1e-300)
    share = 2 * motion.error + energy.residual

    def off(now: float | None, then: float | None) -> float | None:
        if now is None or then is None:
            return None
        return motion.share * abs(now - then) + share * max(scale, abs(now))

    found = {name: off(value, before[name]) for name, value in energy._asdict().items() if name not in ("works", "residual")}
    return found | {"works": {name: off(value, before["works"].get(name)) for name, value in energy.works.items()}}


# -- the record -------------------------------------------------------------------------------------------------------


class Energy(NamedTuple):
    """Where the energy of a motion came from and went (J): works of drive and loads, heat, and kinetic energy gained.

    `works` are by part, those of dampers and friction below 0; `meshes` is what meshes lost. What drive, loads and meshes
    leave is the kinetic energy gained, but for `residual`, a share of the largest of them or of the greatest kinetic energy.
    `copper` is the heat in a DC motor's armature, `rotor_heat` that in an induction motor's rotor, torque times slip speed.
    Neither is part of that balance: the drive's work is what its shaft gives.
    """

    drive: float
    works: dict[str, float]
    meshes: float
    kinetic_gained: float
    residual: float
    copper: float | None
    rotor_heat: float | None = None


class Peaks(NamedTuple):
    """Greatest speed of the crank (rad/s), torque of the drive (N m, at its shaft), its power (W), a motor's current (A)."""

    speed: Peak
    torque: Peak | None
    power: Peak | None
    current: Peak | None


@dataclass(frozen=True, repr=False)
class Transient:
    """A machine followed from a start to an end.

    `ended` says in words how, `reason` in one: `time`, `way`, `speed`, `share`, `regime`, `stop`, `stall` (its drive pushes,
    and is too weak), `creep` (it slows down for ever), `limit` (what was asked for does not come), `stroke`.
    `time` (s), `phi` (rad) and `omega` (rad/s) are those of the end; `way` (rad) is how far it went, `turns` the same in
    turns. On a stroke whose driver slides, m.

    `regime_speed` is the mean over time of the steady cycle that the machine has with its drive (rad/s), None where there is
    none; `time_to_regime` the first time (s) at which the crank is as fast as 95 % of that. `inertia` is the flywheel's, at
    its own shaft (kg m²). `given_errors` are those of inertia, balance and regime speed, in their units.
    """

    scene: Scene
    motion: Motion
    ended: str
    reason: str
    inertia: float
    balance: float
    regime_speed: float | None
    time_to_regime: float | None
    peaks: Peaks
    energy: Energy
    rtol: float
    messages: tuple[str, ...] = ()
    given_errors: Mapping[str, float | None] = field(default_factory=dict)

    def __repr__(self) -> str:
        """How it ended, instead of the motion."""
        figures = f"time={self.time:.6g}, turns={self.turns:.6g}, omega={self.omega:.6g}"
        return f"Transient({self.reason}: {self.ended}; {figures})"

    @property
    def time(self) -> float:
        """When it ended, s."""
        return float(self.motion.t[-1])

    @property
    def phi(self) -> float:
        """Where it ended, rad."""
        return float(self.motion.phi[-1])

    @property
    def omega(self) -> float:
        """The speed at the end, rad/s: 0 of a machine that stopped, whose motion ends there to rounding."""
        return 0.0 if self.reason in ("stop", "stall") else float(self.motion.omega[-1])

    @property
    def way(self) -> float:
        """How far it went, rad."""
        return float(self.motion.phi[-1] - self.motion.phi[0])

    @property
    def turns(self) -> float:
        """How far it went, in turns of the crank."""
        return self.way / TURN

    @property
    def error(self) -> float:
        """Estimated error of position and speed, relative to the way gone and to the greatest speed."""
        return self.motion.error

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON, SI throughout."""
        return {
            "title": self.scene.title,
            "reduction": self.scene.reduction_element,
            "reason": self.reason,
            "ended": self.ended,
            "start": {"phi": float(self.motion.phi[0]), "omega": float(self.motion.omega[0])},
            "end": {"t": self.time, "phi": self.phi, "omega": self.omega},
            "way": self.way,
            "turns": self.turns,
            "flywheel": {"on": self.scene.flywheel_on, "inertia": self.inertia},
            "balance": self.scene.unknown and {"name": self.scene.unknown, "value": self.balance},
            "regime_speed": self.regime_speed,
            "time_to_95_percent": self.time_to_regime,
            "peaks": {name: found and found._asdict() for name, found in self.peaks._asdict().items()},
            "energy": self.energy._asdict(),
            "error": self.error,
            "energy_residual": self.motion.energy_residual,
            "drift": self.motion.drift,
            "rtol": self.rtol,
            "messages": list(self.messages),
        }


# -- how it ended -----------------------------------------------------------------------------------------------------

SHARE = 0.95
_SUDDEN = 1e-6  # of the time gone: a machine that would stop within this has stopped


def told_of(setting: Setting, motion: Motion, goal: Until, rtol: float) -> Transient:
    """A motion with how it ended, its peaks, its energy, and the time that it took to its regime."""
    trail, scene = motion.trail, setting.machine.scene
    assert trail is not None
    reason, ended = _ending(setting, trail, motion, goal)
    samples, owners = close(trail)
    steady = None if setting.regime is None else setting.regime.speed
    origin = scene.origin
    return Transient(
        scene=scene,
        motion=motion._replace(phi=motion.phi + origin) if origin else motion,
        ended=ended,
        reason=reason,
        inertia=setting.inertia,
        balance=setting.balance,
        regime_speed=steady,
        time_to_regime=None if steady is None else reached(trail, SHARE * steady, samples.t, samples.omega),
        peaks=peaks_of(trail, samples, owners),
        energy=energy_of(worked(trail), samples.kinetic),
        rtol=rtol,
        messages=tuple(_messages(setting, motion, trail.start, rtol)),
        given_errors=_given_errors(setting),
    )


def _given_errors(setting: Setting) -> dict[str, float | None]:
    """Errors, in their own units, of what a motion is followed with: its flywheel, its balance, the speed of its regime."""
    steady = setting.regime
    return {
        "flywheel": setting.inertia * setting.inertia_error,
        "balance": None if setting.machine.scene.unknown is None else abs(setting.balance) * setting.balance_error,
        "regime_speed": None if steady is None else steady.speed * (steady.sizing.error.simulation or 0.0),
    }


def peaks_of(trail: Trail, samples: Samples, owners: NDArray[np.intp]) -> Peaks:
    """Greatest speed, and of a driven machine torque, power and current."""
    drives = trail.dynamics.machine.scene.drive is not None
    wanted = {"omega": True, "drive": drives, "power": drives, "current": samples.current is not None}
    speed, *others = (peak(trail, name, samples, owners) if told else None for name, told in wanted.items())
    assert speed is not None
    return Peaks(speed, *others)


def _messages(setting: Setting, motion: Motion, start: Start, rtol: float) -> Iterator[str]:
    """What is to be said beside the figures."""
    if motion.error > rtol:
        yield f"rtol {rtol:.1g} not reached: the motion is good to {motion.error:.2g} (estimated, relative)"
    if start.omega == 0.0 and start.current > 0.0:
        held = f"{start.current:.6g} A, with which its motor carries the load at rest"
        yield f"held at rest until the current has risen to {held}; time counts from then on"
    if setting.regime is None and setting.machine.scene.stroke is None and setting.no_regime:
        yield f"no regime: {setting.no_regime}"


def _ending(setting: Setting, trail: Trail, motion: Motion, goal: Until) -> tuple[str, str]:
    """How a motion ended: in one word, and in a sentence."""
    machine = setting.machine
    last, omega = float(trail.t[-1]), float(motion.omega[-1])
    phi = float(motion.phi[-1])
    at = f"at {_place(machine, phi)} after {last:.6g} s"
    if trail.stuck or trail.goal == "stop":
        return _stopped(setting, trail, at, last, omega)
    if machine.scene.stroke is not None and trail.goal is None and last < limit_of(setting, trail.start, goal):
        return "stroke", end_of_stroke(machine.scene, phi + machine.scene.origin, last)
    if trail.goal == "settled":
        return "limit", f"settled to its regime without reaching {_speed(target_of(setting, goal))}: {_speed(omega)} {at}"
    if trail.goal == "limit" or (trail.goal is None and goal.kind != "time"):
        wanted = {"regime": "its regime", "stop": "a stop"}.get(goal.kind, "what was asked for")
        return "limit", f"did not come to {wanted} within {(phi - trail.start.phi) / TURN:.6g} turns and {last:.6g} s"
    if trail.goal == "steady":
        return "limit", f"does not slow down to a stop: {omega:.6g} rad/s {at}, as a cycle before"
    if trail.goal == "regime":
        return "regime", f"settled to its regime after {last:.6g} s, {(phi - trail.start.phi) / TURN:.6g} turns"
    if trail.goal in ("speed", "share"):
        return trail.goal, f"reached {_speed(omega)} {at}"
    return trail.goal or "time", f"ended {at}, at {omega:.6g} rad/s"


def _stopped(setting: Setting, trail: Trail, at: str, last: float, omega: float) -> tuple[str, str]:
    states = trail.states(np.array([last]))
    own = setting.machine
    dynamics = setting.dynamics
    begin = Start(float(states[0, 0]), 0.0, float(states[3, 0]) if states.shape[0] > 3 else 0.0)
    acceleration = abs(float(sampled(trail, np.array([last])).acceleration[0]))
    if trail.start.omega > 0.0 and omega > 0.0 and omega > _SUDDEN * last * acceleration:
        return "creep", f"slows down for ever, as only what grows with speed brakes it: {omega:.3g} rad/s {at}"
    if own.scene.drive is None:
        return "stop", f"stopped {at}"
    if not pushes(dynamics, trail, last):
        return "stop", f"stopped {at}, where its drive no longer pushes it on"
    moment, _ = at_rest(dynamics, begin, last)
    lossy = any(stage.efficiency < 1.0 for stage in own.stages)
    return "stall", f"stalled {at}: M* at rest is {moment:.6g} N m{', before losses in meshes' if lossy else ''}"


def _speed(omega: float) -> str:
    return f"{omega:.6g} rad/s ({omega * 60 / TURN:.6g} rpm)"


def _place(machine: Machine, phi: float) -> str:
    """A position in words, within the cycle."""
    scene = machine.scene
    if scene.stroke is not None:
        return told(phi + scene.origin, scene.stroke.sliding)
    return machine.where(phi % scene.cycle)


def reached(trail: Trail, speed: float, times: Array, omega: Array) -> float | None:
    """The first time at which a speed is reached."""
    above = np.flatnonzero(omega >= speed)
    if not above.size:
        return None
    if above[0] == 0:
        return 0.0
    low, high = float(times[above[0] - 1]), float(times[above[0]])

    def faster(t: float) -> float:
        return float(trail.states(np.array([t]))[1, 0]) - speed

    return low if low == high or faster(low) >= 0.0 else instant(faster, low, high)  # equal on both sides of a switch


def energy_of(works: Works, kinetic: Array) -> Energy:
    """Works and heats with the kinetic energy gained, and how far they close."""
    gained = float(kinetic[-1] - kinetic[0])
    parts = dict(works.by_part)
    drive = parts.pop("drive", 0.0)
    total = drive + sum(parts.values()) - works.meshes
    scale = max([float(kinetic.max()), abs(drive), *map(abs, parts.values()), 1e-300])
    return Energy(drive, parts, works.meshes, gained, abs(total - gained) / scale, works.copper, works.rotor)


# -- the motion -------------------------------------------------------------------------------------------------------

_BALANCED = 64 * ROUNDING
_MORE = 1e-9  # current than balances the load: so that the machine moves on, and not back


@np.errstate(all="ignore")  # as in `flywheel.simulate`
def transient(
    machine: Machine | Scene,
    *,
    start: float | str = "rest",
    at: float | None = None,
    end: Until | str | float = "regime",
    drive: bool = True,
    inertia: float | None = None,
    balance: float | None = None,
    rtol: float = 1e-9,
    watching: Watching | None = None,
) -> Transient:
    """Follow a machine from a start to an end: (J + I*) alpha + ½ dI*/dphi omega² = M*(phi, omega, t).

    Args:
        machine: a `Machine`, or a `Scene`, of which one is then built.
        start: "rest", "regime" (its steady speed at the position), or a speed of the crank, rad/s (m/s of a slide).
        at: the position at the start, rad (m where a driver slides); 0, or where a stroke begins, if None.
        end: a time (s), or what `until` reads: "5 s", "10 turns", "200 rpm", "95 %" (of the regime's mean speed),
            "regime" (its speed at phi = 0 repeats to 1e-6), "stop". A machine that settles before it comes to a speed ends
            with that: `reason` is "limit".
        drive: whether the drive drives; without it the machine runs down.
        inertia: the flywheel's, kg m² at its own shaft; if None the scene's own, or the one that it is sized to.
        balance: value (SI) of the scene's unknown; if None the one that balances the regime.
        rtol: error allowed of position and speed.
        watching: is told time (s) and position (rad) as the motion goes on; a motion is followed twice at least, so that
            both begin again.

    Raises:
        SceneError: where the machine does not start, has no regime where one is asked for, or cannot be followed.

    A motion ends early where the machine stops, with its angle: `stall` where the drive pushes but is too weak, `stop`
    without one, or where it is off by then or brakes. At a step of load or drive (an expression of `t`) stepping starts
    afresh.

    >>> import math, flywheel
    >>> fan = {"inertia": [{"on": "crank", "value": 2}], "drive": {"torque": "10 - omega"}, "flywheel": {"inertia": 0}}
    >>> run = transient(flywheel.load(fan), end="95 %")
    >>> run.reason, round(run.time, 7), round(2 * math.log(20), 7)
    ('share', 5.9914645, 5.9914645)

    """
    machine = machine_of(machine)
    goal = end if isinstance(end, Until) else until(end) if isinstance(end, str) else Until("time", float(end))
    _check(machine, goal, start, rtol)
    setting = _setting(machine, drive, inertia, balance)
    begin = _started(setting, _start(setting, start, at))
    goals = list(goals_of(setting, begin, goal))
    settled = settling(setting, goal, rtol)
    motion = moved(setting.dynamics, begin, limit_of(setting, begin, goal), rtol, goals, settled, watching)
    return told_of(setting, motion, goal, rtol)


def run_up(
    machine: Machine | Scene,
    end: Until | str | float = "regime",
    *,
    at: float | None = None,
    inertia: float | None = None,
    balance: float | None = None,
    rtol: float = 1e-9,
) -> Transient:
    """A machine from rest to its regime, or to another end.

    Args:
        machine: a `Machine`, or a `Scene`, of which one is then built.
        end: a time (s), or "5 s", "10 turns", "200 rpm", "95 %" (of the regime's mean speed), "regime".
        at: the position at the start, rad (m where a driver slides); 0, or where a stroke begins, if None.
        inertia: the flywheel's, kg m² at its own shaft; if None the scene's own, or the one that it is sized to.
        balance: value (SI) of the scene's unknown; if None the one that balances the regime.
        rtol: error allowed of position and speed.

    Raises:
        SceneError: where the machine does not start, or cannot be followed; see `transient`.

    """
    return transient(machine, start="rest", end=end, at=at, inertia=inertia, balance=balance, rtol=rtol)


def run_down(
    machine: Machine | Scene,
    end: Until | str | float = "stop",
    *,
    start: float | str = "regime",
    at: float | None = None,
    inertia: float | None = None,
    balance: float | None = None,
    rtol: float = 1e-9,
) -> Transient:
    """A machine with its drive off, from its regime to its stop, or to another end.

    Args:
        machine: a `Machine`, or a `Scene`, of which one is then built.
        end: "stop", or a time (s), or "5 s", "10 turns", "200 rpm", "50 %" (of the regime's mean speed).
        start: "regime" (its steady speed at the position), or a speed of the crank, rad/s.
        at: the position at the start, rad; 0 if None.
        inertia: the flywheel's, kg m² at its own shaft; if None the scene's own, or the one that it is sized to.
        balance: value (SI) of the scene's unknown, where that is a load; if None the one that balances the regime.
        rtol: error allowed of position and speed.

    Raises:
        SceneError: where the machine has no regime to start from, or cannot be followed; see `transient`.

    """
    given: Any = {"at": at, "inertia": inertia, "balance": balance, "rtol": rtol}
    return transient(machine, start=start, end=end, drive=False, **given)


# -- before ----------------------------------------------------------------------------------------------------------


def _check(machine: Machine, goal: Until, start: float | str, rtol: float) -> None:
    faults, scene = [], machine.scene
    if scene.areas is not None:
        faults.append(Fault("areas", "a diagram of areas", "a machine to follow", "give mechanism, inertia or load instead"))
    if not 1e-13 <= rtol <= 0.1:
        faults.append(Fault("rtol", f"{rtol}", "a number from 1e-13 to 0.1"))
    if not 0.0 < goal.value < np.inf and goal.kind not in ("regime", "stop"):
        faults.append(Fault("until", f"{goal.value}", "a finite number above 0"))
    wanted = [goal.kind in ("regime", "share"), start == "regime"]
    if scene.stroke is not None and any(wanted):
        faults.append(Fault("until" if wanted[0] else "from", "a regime", "a time, a speed or the end of the stroke"))
    if goal.kind == "regime" and machine.depends_on_time:
        found = "a regime of a machine whose loads or drive depend on time"
        faults.append(Fault("until", found, "a time, a way or a speed", 'such as --until "5 s"'))
    if isinstance(start, str) and start not in ("rest", "regime"):
        faults.append(Fault("from", f'"{start}"', '"rest", "regime", or a speed'))
    elif not isinstance(start, str) and not 0.0 <= start < np.inf:
        faults.append(Fault("from", f"{start}", "a finite speed, at least 0"))
    if faults:
        raise SceneError(faults)


def _setting(machine: Machine, drive: bool, inertia: float | None, balance: float | None) -> Setting:
    scene = machine.scene
    own, doubt = _flywheel(scene) if inertia is None else (inertia, 0.0)
    steady, why = _regime(machine, own)
    balance, off = _balance(machine, steady) if balance is None else (balance, 0.0)
    if not drive:
        unknown = None if scene.unknown == "drive" else scene.unknown
        machine = machine_of(replace(scene, drive=None, motor=None, unknown=unknown))
    return Setting(machine, Dynamics(machine, own * scene.flywheel_ratio**2, balance), own, balance, steady, why, doubt, off)


def _flywheel(scene: Scene) -> tuple[float, float]:
    """The flywheel that the scene gives, or is sized to, and its relative error."""
    if scene.irregularity is None:
        return scene.inertia or 0.0, 0.0
    try:
        sizing = size(scene, simulate=False)
        return sizing.flywheel.exact or 0.0, sizing.error.exact or 0.0
    except SceneError as error:
        found = f"an irregularity, to which no flywheel can be sized: {'; '.join(fault.found for fault in error.faults)}"
        advice = 'give its inertia: --flywheel "0.3 kg m^2" (in Python inertia=0.3)'
        raise SceneError([Fault("flywheel", found, "a flywheel to follow the machine with", advice)]) from error


def _regime(machine: Machine, inertia: float) -> tuple[Regime | None, str]:
    if machine.scene.stroke is not None:
        return None, "a stroke has no regime"
    if machine.depends_on_time:
        return None, "loads or drive that depend on time have no regime"
    try:
        return regime_of(machine, inertia), ""
    except SceneError as error:
        return None, "; ".join(str(fault) for fault in error.faults)


def _balance(machine: Machine, steady: Regime | None) -> tuple[float, float]:
    """The unknown's value, and its relative error."""
    if machine.scene.unknown is None:
        return 0.0, 0.0
    if steady is not None and steady.sizing.balance is not None:
        return steady.sizing.balance.value, steady.sizing.balance.error
    if machine.depends_on_speed or machine.depends_on_time:
        found = '"balance" with torques that depend on speed or time, and without a regime to balance'
        raise SceneError([Fault("balance", found, "a value", "give the unknown its value")])
    cycle = turning_moment.balanced(machine)
    return cycle.balance or 0.0, cycle.balance_error


def _start(setting: Setting, start: float | str, at: float | None) -> Start:
    scene = setting.machine.scene
    origin = scene.origin if at is None else at
    phi = origin if scene.stroke is None else float(own_coordinate(scene, np.asarray(origin, dtype=float)))
    if start == "regime":
        omega = float(speed_at(needed(setting).sizing, phi))
    else:
        omega = 0.0 if isinstance(start, str) else float(start)
    circuit = setting.dynamics.circuit
    current = circuit.current(setting.dynamics.ratio * omega) if circuit is not None and omega else 0.0
    return Start(phi, omega, float(current))


def _started(setting: Setting, begin: Start) -> Start:
    """The start; a SceneError for a machine that stays at rest, or goes back, when it is let go.

    A motor with inductance has no torque at first. Where the load would turn it back until then, it is held until the
    current is strong enough, and starts with that.
    """
    machine, dynamics = setting.machine, setting.dynamics
    if begin.omega > 0.0:
        return begin
    circuit = dynamics.circuit
    locked = begin if circuit is None else begin._replace(current=float(circuit.current(0.0)))
    moment, size_of = at_rest(dynamics, locked)
    if moment > _BALANCED * size_of:
        unfed = moment if circuit is None else at_rest(dynamics, begin)[0]
        return begin if unfed >= 0.0 else begin._replace(current=locked.current * (1 + _MORE) * unfed / (unfed - moment))
    if machine.depends_on_time and abs(moment) <= _BALANCED * size_of:
        return begin
    balanced = abs(moment) <= _BALANCED * size_of
    share = "M* = 0, so that nothing moves it" if balanced else f"M* = {moment:.6g} N m, which holds it or turns it back"
    found = f"a machine that does not start: at rest at {machine.where(begin.phi)} it has {share}"
    raise SceneError([Fault("from", found, "a moment that sets it going", _to_start(machine.scene, balanced))])


def _to_start(scene: Scene, balanced: bool) -> str:
    """What makes a machine start that does not."""
    if scene.drive is None:
        sliding = scene.reduction_element == "slide"
        speed = "0.1 m/s" if sliding else "200 rpm"
        regime = "" if scene.stroke is not None else "--from regime, or "
        return f'nothing drives it: start at a speed, {regime}--from "{speed}"'
    if balanced:
        return "start at another angle"
    return "the drive stalls there: start at another angle, or with a larger drive"
