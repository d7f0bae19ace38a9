"""Records of a motion, and works, heats and extremes along it.

In order: the motion as followed (`Motion`); samples, works, heats and greatest values along it; the result of `transient`
(`Transient`); the steady cycle of a sizing as a motion (`speed_at`, `time_along`, `steady_motion`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.motion.run import Run
from bondgraph.numerics import summits
from flywheel.components.motors.starting import as_started
from flywheel.machine.dynamics import NODES, Trail
from flywheel.machine.machine import Machine
from flywheel.machine.reactions import MachineMotion
from flywheel.motions.starting import StartHeat, start_heat
from flywheel.numerics import cells, notebook
from flywheel.numerics.faults import Fault, SceneError
from flywheel.regime import state, turning_moment
from flywheel.regime.state import DRIVE
from flywheel.scene.scene import TURN, Scene
from flywheel.sizing.findings import speed_error_over_cycle
from flywheel.sizing.results import Sizing

__all__ = [
    "DRIVER", "TIME", "DriverMotion", "Energy", "Motion", "Peak", "Peaks", "Samples", "Transient", "column",
    "energy_of", "evenly", "highest", "peak", "peaks_of", "regime_motion", "sampled", "samples_of", "speed_at",
    "states_at", "steady_motion", "switching", "time_along", "works_of",
]  # fmt: skip

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

DRIVER, TIME = "driver", "time"  # variables of the horizontal axis


class Motion(NamedTuple):
    """A simulated motion at the integrator's own times: t (s), crank angle phi (rad, not reduced), omega (rad/s).

    `work` is that of M* since the start (J) and `energy_residual` the largest |kinetic energy gained - work| over the
    largest kinetic energy, with every law evaluated apart (see `works_of`). `at(t)` gives (phi, omega) at any times within,
    by dense output. Where shafts twist, `work` is that of loads and drive and `run` the motion of the whole bond graph, with
    every flow, effort and its power audit.

    On a stroke phi is the driver's coordinate (m and omega in m/s where it slides). The motion ends where the stroke does,
    or where the machine stands still permanently, and `ended` says so; it is None for a motion that lasts until the required
    time. `at` refuses later times.

    `error` is the estimated error of phi (relative to the travel, at least a radian) and of omega (to the greatest speed):
    the difference to a run with up to ten times the tolerance and longer steps, doubled (in proportion beyond ten times). If
    the speed at phi = 0 must return, each cycle starts from that speed: `drift` is the relative change of kinetic energy in
    one stepped cycle, which then does not accumulate. `states` are a motor's own by name, such as its `current` (A). `trail`
    is the motion as it was stepped, `rough` the run before it and `share` the part of the difference to that run that may
    remain.
    """

    t: Array
    phi: Array
    omega: Array
    work: Array
    energy_residual: float
    run: Run | None = None
    ended: str | None = None
    error: float = 0.0
    states: Mapping[str, Array] = MappingProxyType({})
    trail: Trail | None = None
    drift: float = 0.0
    rough: Trail | None = None
    share: float = 1.0

    @property
    def current(self) -> Array | None:
        """The current of a motor with inductance, A."""
        return self.states.get("current")

    def at(self, times: Any) -> tuple[Array, Array]:
        """Crank angle and speed at times (s), by dense output; after its end at rest, on a stroke a SceneError."""
        instants = np.atleast_1d(np.asarray(times, dtype=float))
        if self.run is not None:
            return self.run.displacement("phi", instants), self.run.flow("crank", instants)
        assert self.trail is not None
        still = self.trail.stuck is not None  # permanently
        phi, omega = self.trail.states(np.minimum(instants, self.t[-1]) if still else instants)[:2]
        stroke = self.trail.dynamics.machine.scene.stroke
        if stroke is None:
            return phi, omega
        if np.any(instants > self.t[-1]):
            last = f"times up to {self.t[-1]:.6g} s"
            raise SceneError([Fault("t", f"{instants.max():.6g} s", last, self.ended or "")])
        return np.clip(phi + stroke.start, stroke.start, stroke.end), omega

    def __repr__(self) -> str:
        """The extent of the motion, instead of every point."""
        last = f"t = {self.t[-1]:.6g} s, phi = {self.phi[-1]:.6g}, omega = {self.omega[-1]:.6g}"
        return f"Motion({self.t.size} points to {last}, ended={self.ended!r}, error={self.error:.2g})"

    def _repr_html_(self) -> str | None:
        """HTML for a notebook."""
        return notebook.html(self)


def works_of(trail: Trail) -> tuple[dict[str, float], float, Array]:
    """The works (J) along a motion: of every part, the losses of meshes, and the total up to the end of every step.

    They are integrals of moment times speed over every step.

    By Gauss quadrature of the dense output. The law of every load is evaluated apart: where stepping decides a branch once
    for a stretch, at an anchor, in a direction, it is decided here at every instant by position, speed and time themselves;
    so is the side that drives a mesh, but with friction in joints. A law in the wrong branch, or against the motion, or a
    mesh that gives power, leaves a difference to the kinetic energy.
    """
    times, owners, lasting = trail.gauss()
    rows = [np.zeros(0)]
    parts, meshes, dynamics = dict[str, float](), 0.0, trail.dynamics
    for portion, states, here in trail.along(times, owners):
        way = lasting[portion] * states[1]
        now = dynamics.at_many(*here)
        apart = here.anchor._replace(phi=here.phi, omega=here.omega, time=here.time, direction=None)
        moments = dynamics.moments(here.phi, apart, *here[2:], now)
        for part, moment in moments.items():
            parts[part] = parts.get(part, 0.0) + float(way @ moment)
        loss = now.loss
        if dynamics.joint_friction is None and len(dynamics.machine.stages) > 1:
            loss = dynamics.losses(here.phi, apart, *here[2:], now.acceleration)
        meshes += float(way @ loss)
        rows.append(way * (sum(moments.values()) - loss))
    steps = np.concatenate(rows).reshape(-1, NODES.size).sum(axis=1)
    return parts, meshes, np.append(0.0, np.cumsum(steps))


_TOPS = 64  # number of the highest samples that are refined

_FINER, _ROUNDS = 33, 4  # times between the neighbours of a top, and how often they are laid closer


class Peak(NamedTuple):
    """A greatest value and the time (s) at which it is reached."""

    value: float
    time: float


class Energy(NamedTuple):
    """Energy balance of a motion (J): works of drive and loads, heat, and kinetic energy gained.

    `works` are by part, those of dampers and friction below 0; `meshes` is the loss in meshes. The sum of drive, loads and
    meshes is the kinetic energy gained, except for `residual`, a share of the largest of them or of the greatest kinetic
    energy. `copper` is the heat in a DC motor's armature, `rotor_heat` that in an induction motor's rotor, torque times slip
    speed. Neither is part of that balance: the drive's work is that at its shaft.
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


class Samples(NamedTuple):
    """A motion at times t (s): phi (rad, not reduced), omega (rad/s), acceleration (rad/s²), moment M* less losses (N m).

    `drive` is the drive's torque at its own shaft (N m), `power` its power (W), `loss` that lost in meshes (W), `kinetic`
    the kinetic energy (J), `current` a motor's (A; None if its kind does not give it), `states` a motor's own by
    name, None without any. On a stroke whose driver slides: m, m/s, N.
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
    states: dict[str, Array] | None = None


def sampled(trail: Trail, times: Array, owners: Indices | None = None) -> Samples:
    """The motion at times within it; at an end of a stretch `owners` select the side (the stretch before if None)."""
    dynamics, parts, own = trail.dynamics, list[Any](), list[Array]()
    motor, ratio, circuit = dynamics.machine.scene.motor, dynamics.ratio, dynamics.circuit
    for portion, states, here in trail.along(times, trail.owners(times) if owners is None else owners):
        # the current (A) of a motor, by its own states where it has any; None if its type does not give it
        if circuit is not None:
            current: Array | None = circuit.current(ratio * here.omega, here.states)
        else:
            current = None if motor is None else motor.current_along(ratio * here.omega, here.time, here.anchor.time)
        now, omega = dynamics.at_many(*here), states[1]
        drive = dynamics.moments(*here, now).get(DRIVE, np.zeros_like(omega))
        kinetic, shaft = 0.5 * now.inertia * omega**2, drive / dynamics.ratio
        figures = now.acceleration, now.moment, shaft, drive * omega, now.loss * omega, kinetic, current
        parts.append((times[portion], states[0], omega, *figures))
        own.append(states[3:])
    joined: list[Any] = [None if column[0] is None else np.concatenate(column) for column in zip(*parts, strict=True)]
    samples = Samples._make([*joined, None])
    if dynamics.circuit is None:
        return samples
    rows = zip(dynamics.circuit.names, np.concatenate(own, axis=1), strict=True)
    return samples._replace(states={one.name: row for one, row in rows})


def switching(trail: Trail) -> tuple[Array, Indices]:
    """Times at which a law switches or a piece ends, each twice, and the stretches on either side."""
    stretches = trail.stretches
    last = np.array(
        [k for k in range(len(stretches) - 1) if stretches[k].anchor is not stretches[k + 1].anchor], dtype=np.intp
    )
    return np.repeat(trail.t[last + 1], 2), np.column_stack((last, last + 1)).ravel()


_EDGE_TIE = 1e-9  # of a cycle: tolerance of the end of a step at an edge of the machine


def evenly(trail: Trail, points: int, breaks: bool = False) -> tuple[Array, Indices]:
    """Times spaced evenly from start to end, and their stretches; with `breaks` also both sides of every switch of a law."""
    times = np.linspace(0.0, float(trail.t[-1]), points)
    owners = trail.owners(times)
    if not breaks:
        return times, owners
    more, sides = switching(trail)
    machine = trail.dynamics.machine
    cycle, phi = machine.scene.cycle, trail.states(more, sides)[0]
    own = phi if machine.scene.stroke is not None else phi % cycle
    switches = machine.switches if machine.switches_at_ends else machine.switches[1:-1]
    restarts, switch = (
        np.abs(own[:, None] - edges).min(axis=1, initial=cycle) <= _EDGE_TIE * cycle
        for edges in (machine.restarts, switches)
    )
    kept = switch | ~restarts
    more, sides = more[kept], sides[kept]
    rows = np.unique(np.column_stack((np.append(owners, sides), np.append(times, more))), axis=0)
    return np.asarray(rows[:, 1], dtype=float), rows[:, 0].astype(np.intp)


def samples_of(trail: Trail) -> tuple[Samples, Indices]:
    """The motion in every stretch, at both its ends and at ten times between, and the stretches that these belong to."""
    times, owners = trail.within(NODES)
    return sampled(trail, times, owners), owners


def energy_of(trail: Trail, kinetic: Array) -> Energy:
    """Works and heats of a motion with its kinetic energy (J) at times from start to end, and their closure.

    Works are those of `works_of`, separate from the sums of time stepping itself.
    """
    motor, ratio = trail.dynamics.machine.scene.motor, trail.dynamics.ratio
    works, meshes, _ = works_of(trail)
    heated, heated_by = 0.0, None
    if motor is not None and (heated_by := as_started(motor).own.heated) is not None:
        times, owners, lasting = trail.gauss()
        for portion, _, here in trail.along(times, owners):
            heat = motor.heat_along(ratio * here.omega, here.time, here.anchor.time, here.states)
            heated += 0.0 if heat is None else float(lasting[portion] @ heat)
    gained, drive = float(kinetic[-1] - kinetic[0]), works.pop(DRIVE, 0.0)
    total = drive + sum(works.values()) - meshes
    scale = max([float(kinetic.max()), abs(drive), *map(abs, works.values()), 1e-300])
    copper, rotor = (heated if heated_by == kind else None for kind in ("copper_heat", "rotor_heat"))
    return Energy(drive, works, meshes, gained, abs(total - gained) / scale, copper, rotor)


def peaks_of(trail: Trail, samples: Samples, owners: Indices) -> Peaks:
    """Greatest speed, and of a driven machine torque, power and current."""
    drives = trail.dynamics.machine.scene.drive is not None
    others = {"drive": drives, "power": drives, "current": samples.current is not None}
    tops = [peak(trail, name, samples, owners) if selected else None for name, selected in others.items()]
    return Peaks(peak(trail, "omega", samples, owners), *tops)


def peak(trail: Trail, name: str, samples: Samples, owners: Indices) -> Peak:
    """The greatest value of a column of `samples_of`: on either side of a jump, or between two samples of a stretch."""
    return max(highest(trail, name, samples, owners), key=lambda one: one.value)


def column(samples: Samples, name: str) -> Array:
    """A column of samples; of the speed its size, because a machine that swings is fastest in either direction."""
    return np.asarray(np.abs(samples.omega) if name == "omega" else getattr(samples, name))


def highest(trail: Trail, name: str, samples: Samples, owners: Indices) -> list[Peak]:
    """The greatest values about each of the highest samples; the very greatest sample first.

    The highest are those that no neighbour in their stretch exceeds. Each is then refined.
    """
    times, values = samples.t, column(samples, name)

    def beside(which: Indices, side: int) -> Indices:
        """The neighbours of samples, or the samples themselves at the ends of their stretch."""
        other = np.clip(which + side, 0, owners.size - 1)
        return np.where(owners[other] == owners[which], other, which)

    every, best = np.arange(values.size), int(values.argmax())
    top = np.flatnonzero((values >= values[beside(every, -1)]) & (values >= values[beside(every, 1)]))
    tops = top[np.argsort(values[top], kind="stable")[-_TOPS:]]

    def along(grid: Array, which: Indices) -> Array:
        # with only the laws that the figure needs: a speed needs none, a drive no friction in joints
        at, sides = grid.ravel(), np.repeat(owners[tops[which]], grid.shape[1])
        if name == "omega":
            return np.asarray(np.abs(trail.states(at, sides)[1])).reshape(grid.shape)
        if name not in ("drive", "power"):
            return column(sampled(trail, at, sides), name).reshape(grid.shape)
        parts = [np.zeros(0)]
        for _, states, here in trail.along(at, sides):
            drive = trail.dynamics.moments(*here, rubbing=False).get(DRIVE, np.zeros_like(states[1]))
            parts.append(drive / trail.dynamics.ratio if name == "drive" else drive * states[1])
        return np.concatenate(parts).reshape(grid.shape)

    peaks = summits(along, times[beside(tops, -1)], times[beside(tops, 1)], _FINER, _ROUNDS)
    nearby = values[tops] >= peaks.value
    heights, places = np.where(nearby, values[tops], peaks.value), np.where(nearby, times[tops], peaks.place)
    return [Peak(float(values[best]), float(times[best])), *map(Peak, heights.tolist(), places.tolist())]


@dataclass(frozen=True, repr=False)
class Transient:
    """A machine followed from a start to an end.

    `ended` is its end in words, `reason` in one: `time`, `way`, `speed`, `share`, `regime`, `stop`, `stall` (its drive
    pushes, but is too weak), `creep` (it slows down without end), `limit` (the given end is not reached), `stroke`. `time`
    (s), `phi` (rad) and `omega` (rad/s) are those of the end; `way` (rad) is the travel, `turns` the same in turns. On a
    stroke whose driver slides, m.

    `regime_speed` is the mean over time of the steady cycle that the machine has with its drive (rad/s), None if there is
    none; `time_to_regime` the first time (s) at which the crank is as fast as 95 % of that. `inertia` is the flywheel's, at
    its own shaft (kg m²). `setting_errors` are those of inertia, balance and regime speed, in their units.
    """

    scene: Scene
    motion: Motion
    ended: str
    reason: str
    inertia: float
    balance: float
    regime_speed: float | None
    time_to_regime: float | None
    rtol: float
    messages: tuple[str, ...] = ()
    setting_errors: Mapping[str, float | None] = field(default_factory=dict)
    from_regime: bool = False

    @cached_property
    def samples(self) -> tuple[Samples, Indices]:
        """The motion in every stretch, and the stretches that samples belong to."""
        assert self.motion.trail is not None
        return samples_of(self.motion.trail)

    @cached_property
    def peaks(self) -> Peaks:
        """Greatest speed, and of a driven machine torque, power and current."""
        assert self.motion.trail is not None
        with np.errstate(all="ignore"):
            return peaks_of(self.motion.trail, *self.samples)

    @cached_property
    def energy(self) -> Energy:
        """Works and heats from start to end, and their closure."""
        assert self.motion.trail is not None
        with np.errstate(all="ignore"):
            return energy_of(self.motion.trail, self.samples[0].kinetic)

    @cached_property
    def start_heat(self) -> StartHeat | None:
        """Heat of the motor's start relative to its limit; None without a start, or if its type does not give it."""
        assert self.motion.trail is not None
        return None if self.from_regime else start_heat(self.motion.trail)

    def __repr__(self) -> str:
        """End of the motion, instead of the motion."""
        figures = f"time={self.time:.6g}, turns={self.turns:.6g}, omega={self.omega:.6g}"
        return f"Transient({self.reason}: {self.ended}; {figures})"

    _repr_html_ = notebook.html

    @property
    def time(self) -> float:
        """Time of its end, s."""
        return float(self.motion.t[-1])

    @property
    def phi(self) -> float:
        """Final angle, rad."""
        return float(self.motion.phi[-1])

    @property
    def omega(self) -> float:
        """The speed at the end, rad/s: 0 of a machine that stopped, whose motion ends there to rounding."""
        return 0.0 if self.reason in ("stop", "stall") else float(self.motion.omega[-1])

    @property
    def way(self) -> float:
        """Angle travelled, rad."""
        return float(self.motion.phi[-1] - self.motion.phi[0])

    @property
    def turns(self) -> float:
        """Turns of the crank travelled."""
        return self.way / TURN

    @property
    def error(self) -> float:
        """Estimated error of position and speed, relative to the travel and to the greatest speed."""
        return self.motion.error

    def as_dict(self) -> dict[str, Any]:
        """All figures for JSON, SI throughout."""
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
            "peaks": {name: one and one._asdict() for name, one in self.peaks._asdict().items()},
            "energy": self.energy._asdict(),
            "motor_start": None if self.start_heat is None else self.start_heat.as_dict(),
            "error": self.error,
            "energy_residual": self.energy.residual,
            "drift": self.motion.drift,
            "rtol": self.rtol,
            "messages": list(self.messages),
        }


def speed_at(sizing: Sizing, phi: ArrayLike) -> Array:
    """Crank speed (rad/s) of the steady cycle at crank angles phi (rad)."""
    cycle, run = sizing.cycle, sizing.run
    if cycle is None or run is None:
        raise SceneError([Fault("regime", "a sizing without a steady motion", "a machine that has inertia")])
    return turning_moment.speed_over_cycle(cycle, sizing.speed, run, np.asarray(phi, dtype=float) % sizing.scene.cycle)


def states_at(sizing: Sizing, phi: float) -> tuple[float, ...]:
    """A motor's own states in the steady cycle at a crank angle (rad); none if it has none."""
    cycle, run = sizing.cycle, sizing.run
    if cycle is None or run is None or run.along is None:
        return ()
    cell, t = cells.located(cycle.mesh, np.array([phi % sizing.scene.cycle]))
    return tuple(float(cells.value(cells.fit(row)[cell], t)[0]) for row in run.along)


def scales_of(phi: Array, omega: Array, scene: Scene) -> tuple[float, float]:
    """Scales of a motion's errors: its travel, at least a cycle over 2 pi (rad or m), and its greatest speed."""
    return max(float(np.ptp(phi)), scene.cycle / (2 * np.pi)), float(np.abs(omega).max())


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

    def evaluated(edges: Array) -> tuple[tuple[cells.Cells, Array], float, cells.Coarse]:
        mesh = cells.cells(edges)
        slowness = 1.0 / speed_at(sizing, mesh.phi)
        series = cells.fit(slowness)
        shares = cells.tails(series) * mesh.half[:, 0] / float(cells.integral(slowness, mesh.half).sum())
        return (mesh, series), float(shares.sum()), cells.above(shares)

    mesh, series = cells.refined(sizing.cycle.mesh.edges, evaluated, 0.1 * sizing.rtol)
    rising = cells.antiderivative(series, mesh.half)
    start = cells.accumulated(rising)
    turns = np.floor(angles / sizing.scene.cycle)
    cell, t = cells.located(mesh, angles - turns * sizing.scene.cycle)
    return np.asarray(turns * start[-1] + start[cell] + (rising[cell] * cells.basis(t)).sum(axis=-1))


def steady_motion(machine: Machine, sizing: Sizing, phi: Array) -> tuple[MachineMotion, tuple[Array | float, Array | float]]:
    """The steady regime of a sizing at crank angles phi (rad), and errors: alpha = (M* - ½ dI*/dphi omega²)/(I* + J)."""
    machine = sizing.machine or machine  # with friction in joints as it is in that regime

    if sizing.cycle is None or sizing.run is None:
        return MachineMotion(phi, np.full(phi.size, sizing.speed), np.zeros(phi.size)), (0.0, 0.0)
    omega = turning_moment.speed_over_cycle(sizing.cycle, sizing.speed, sizing.run, phi)
    reduced = state.reduce(machine, phi, balance=sizing.cycle.balance or 0.0)
    moment = reduced.moment
    noise = sizing.cycle.noise[:, cells.located(sizing.cycle.mesh, phi - machine.scene.origin)[0]]
    if sizing.run.cycle is not None:
        cell, t = cells.located(sizing.cycle.mesh, phi)
        moment = cells.value(sizing.cycle.series[0, cell], t)
    total = reduced.inertia + sizing.run.inertia
    alpha = (moment - 0.5 * reduced.slope * omega**2) / total
    off = omega * speed_error_over_cycle(sizing)
    heavy = (sizing.error.exact or 0.0) * sizing.run.inertia / total
    slower = (noise[0] + 0.5 * omega**2 * noise[1] + np.abs(reduced.slope) * omega * off) / total + np.abs(alpha) * heavy
    return MachineMotion(phi, omega, alpha), (off, slower)


def regime_motion(sizing: Sizing, phi: Array) -> MachineMotion:
    """The steady regime of a sizing at crank angles from 0 to the cycle (rad), without its errors."""
    if sizing.cycle is None or sizing.run is None:
        return MachineMotion(phi, np.full(phi.size, sizing.speed), np.zeros(phi.size))
    omega = turning_moment.speed_over_cycle(sizing.cycle, sizing.speed, sizing.run, phi)
    return MachineMotion(phi, omega, turning_moment.acceleration_over_cycle(sizing.cycle, sizing.run, phi, omega))


class DriverMotion(NamedTuple):
    """The driver at n instants: q (rad or m), t (s), rate and acceleration, and their estimated absolute errors.

    Per unit of the driver there is neither time nor rate. `errors` are those of t, q, rate and acceleration.
    """

    q: Array
    t: Array | None = None
    rate: Array | None = None
    acceleration: Array | None = None
    errors: tuple[Array | float, Array | float, Array | float, Array | float] = (0.0, 0.0, 0.0, 0.0)
