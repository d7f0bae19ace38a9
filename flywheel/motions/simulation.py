"""Motion of a machine from any state, by time stepping, and what the machine does along it.

A machine with compliant shafts, which one angle does not describe, is followed by its whole bond graph. Along a motion are
its samples (`sampled`), works and heats (`energy_of`) and greatest values (`peak`); along the steady cycle that a machine
comes to, its speed and time (`regime_of`, `speed_at`, `time_along`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.elements import Element, Here, Law, Modulus
from bondgraph.elements import Motion as Position
from bondgraph.graph import BondGraph
from bondgraph.laws import TIME, GraphError
from bondgraph.motion import runge_kutta
from bondgraph.motion.dynamics import Dynamics as GraphDynamics
from bondgraph.motion.simulation import Run
from bondgraph.motion.simulation import simulate as simulate_graph
from bondgraph.motion.stepping import TIGHTEST
from bondgraph.numerics import summits
from flywheel.components.motors import Motor
from flywheel.components.motors.motor import Circuit
from flywheel.components.motors.starting import as_started
from flywheel.machine.dynamics import Dynamics
from flywheel.machine.machine import Machine, circuit_of
from flywheel.numerics import cells, notebook
from flywheel.numerics.cells import ROUNDING
from flywheel.numerics.faults import Fault, SceneError
from flywheel.regime import turning_moment
from flywheel.regime.free_motion import Goal, Passing, SwitchingTimes, Watching, end_of_stroke, follow
from flywheel.regime.joint_friction import dynamics_of, machine_of
from flywheel.regime.state import DRIVE, own_coordinate
from flywheel.regime.trail import NODES, Along, Start, Trail
from flywheel.scene.scene import Scene
from flywheel.sizing.results import Sizing
from flywheel.sizing.sizing import size

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_FIRST, _FIRST_LOOSE = 1 / 150, 1 / 75  # tolerance of a step to what is asked; of order 5
_LOOSEST = 7e-6  # looser steps do not err in proportion to their tolerance
_TIGHTER = 0.1  # of each run's steps to those of the run before
_LITTLE = 0.3  # the same of further runs, at the most
_COMPARED, _MOST_COMPARED = 300, 20_000  # times at which two runs are compared, evenly, and within steps at the most
_WITHIN = np.array([0.27, 0.61, 1.0])  # parts of a step at which they are
_SAME = 1e-3  # of a step: two runs whose steps differ by less take the same ones
_UNSURE = 500.0  # roundings: what the net work of a cycle is known to be zero by
_STANDING = 1e-9  # of the greatest speed: slower than this a shaft does not turn back
SAFETY = 2.0  # between steps the error of a run does not fall in proportion to its tolerance


class Motion(NamedTuple):
    """A simulated motion at the integrator's own times: t (s), crank angle phi (rad, not reduced), omega (rad/s).

    `work` is that of M* since the start (J) and `energy_residual` the largest |kinetic energy gained - work| over the
    largest kinetic energy, with every law evaluated apart (see `works_of`). `at(t)` gives (phi, omega) at any times within,
    by dense output. Where shafts twist, `work` is that of loads and drive and `run` the motion of the whole bond graph, with
    every flow, effort and its power audit.

    On a stroke phi is the driver's coordinate (m and omega in m/s where it slides). The motion ends where the stroke does,
    or where the machine stands still for good, and `ended` says so; it is None for a motion that lasts until the time asked.
    `at` refuses later times.

    `error` is the estimated error of phi (of the way gone, a radian at least) and of omega (of the greatest speed): the
    difference to a run with up to ten times the tolerance and longer steps, doubled (in proportion beyond ten times).
    Where the speed at phi = 0 must return, each cycle starts from it anew: `drift` is the share of the kinetic energy by
    which stepping one cycle is off, which is so kept from adding up.
    `states` are a motor's own by name, such as its `current` (A). `trail` is the motion as it was stepped, `rough` the run
    before it and `share` how much of the difference to that run may be left.
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
        """Crank angle and speed at times (s), by dense output; at rest for good after its end, on a stroke a SceneError."""
        wanted = np.atleast_1d(np.asarray(times, dtype=float))
        if self.run is not None:
            return self.run.displacement("phi", wanted), self.run.flow("crank", wanted)
        assert self.trail is not None
        still = self.trail.stuck is not None  # for good
        phi, omega = self.trail.states(np.minimum(wanted, self.t[-1]) if still else wanted)[:2]
        stroke = self.trail.dynamics.machine.scene.stroke
        if stroke is None:
            return phi, omega
        if np.any(wanted > self.t[-1]):
            last = f"times up to {self.t[-1]:.6g} s"
            raise SceneError([Fault("t", f"{wanted.max():.6g} s", last, self.ended or "")])
        return np.clip(phi + stroke.start, stroke.start, stroke.end), omega

    def __repr__(self) -> str:
        """Its extent, instead of every point."""
        last = f"t = {self.t[-1]:.6g} s, phi = {self.phi[-1]:.6g}, omega = {self.omega[-1]:.6g}"
        return f"Motion({self.t.size} points to {last}, ended={self.ended!r}, error={self.error:.2g})"

    def _repr_html_(self) -> str | None:
        """What a notebook shows."""
        return notebook.html(self)


class Works(NamedTuple):
    """Works along a motion, J: by part, what meshes lost, and of all together from the start to the end of every step."""

    parts: dict[str, float]
    meshes: float
    total: Array


def works_of(trail: Trail) -> Works:
    """The works along a motion, as its positions and speeds have them: the integral of moment times speed over every step.

    By Gauss quadrature of the dense output. The law of every load is evaluated apart: where stepping decides a branch once
    for a stretch, at an anchor, in a direction, it is decided here at every instant by position, speed and time themselves.
    A law that was taken in the wrong branch, or against the motion, leaves a difference to the kinetic energy.
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
        meshes += float(way @ now.loss)
        rows.append(way * (sum(moments.values()) - now.loss))
    steps = np.concatenate(rows).reshape(-1, NODES.size).sum(axis=1)
    return Works(parts, meshes, np.append(0.0, np.cumsum(steps)))


@np.errstate(all="ignore")  # a step that tries too much leaves the floating-point range, and is tried again shorter
def simulate(
    machine: Machine | Scene,
    phi: float,
    omega: float,
    until: float,
    *,
    inertia: float | None = None,
    balance: float | None = None,
    rtol: float = 1e-10,
    states: Mapping[str, float] = MappingProxyType({}),
    current: float = 0.0,
) -> Motion:
    """Motion of a machine from a given state for a given time, from (J + I*) alpha + ½ dI*/dphi omega² = M*(phi, omega, t).

    M* holds loads, drive and dampers, less what meshes with an efficiency lose. Stepping starts afresh at every breakpoint:
    of position, of time, and where a law switches at a speed. A motor adds the states of its own, such as its current.
    Dry laws, and friction in joints with the reactions of the same instant, act against the motion either way; at rest they
    hold the machine until something breaks it away, or for good, where the motion ends. A motor runs in its own connection
    from the first instant: its `start` is followed by `flywheel.transient`.

    A machine with compliant shafts has more than one angle: its whole bond graph is followed, from a state without twist.
    A machine with a stroke is followed until it reaches one of the stroke's ends.

    Args:
        machine: a `Machine`, or a `Scene`, of which one is then built.
        phi: crank angle at t = 0, rad. On a stroke the driver's coordinate, rad, or m where it slides.
        omega: crank speed at t = 0, rad/s; it may be zero, and the machine may stop and turn back. On a stroke the driver's
            speed, m/s where it slides.
        until: time to simulate, s.
        inertia: the flywheel's, kg m² at its own shaft; the scene's own (0 when it asks for a sizing) if None. On a stroke
            what moves with the driver beside the machine: 0 if None, kg where it slides.
        balance: value (SI) of the scene's unknown; if None the one that balances the cycle (with rigid shafts).
        rtol: error allowed of the whole motion; the estimate of what was reached is its `error`.
        states: a motor's own at t = 0 by name (SI); 0 where they are not given.
        current: of a motor with inductance at t = 0, A: that state.

    Raises:
        SceneError: if I* + J vanishes somewhere, so that the motion is not determined; if the machine starts outside its
            stroke, or at an end of it that it is pushed out of; if friction in joints never lets it start, or leaves no
            acceleration or several; if shafts twist where joints rub.

    >>> import flywheel
    >>> rotor = {"inertia": [{"on": "crank", "value": 2}], "drive": {"torque": 6}, "regime": {"speed": 1},
    ...          "flywheel": {"inertia": 1}}
    >>> motion = flywheel.simulate(flywheel.load(rotor), phi=0, omega=0, until=3)
    >>> round(float(motion.omega[-1]), 9), round(float(motion.phi[-1]), 9)
    (6.0, 9.0)

    """
    machine = actual(machine)
    finite = {"phi": phi, "omega": omega, "until": until, "rtol": rtol, "current": current}
    faults = [Fault(name, f"{value}", "a finite number") for name, value in finite.items() if not np.isfinite(value)]
    positive = {"until": until, "rtol": rtol}
    faults += [Fault(name, f"{value}", "a number above 0") for name, value in positive.items() if value <= 0.0]
    if faults:
        raise SceneError(faults)
    scene = machine.scene
    given = {**states, "current": current} if current else dict(states)
    start = Start(phi, omega, _own_states(scene, given))
    own = (scene.inertia or 0.0) if inertia is None else inertia
    total = own * scene.flywheel_ratio**2
    if balance is None and scene.unknown is not None:
        rigid = machine_of(replace(scene, compliances={}) if scene.compliances else machine)
        if rigid.depends_on_speed or (scene.rubs and scene.speed is not None):
            found = size(rigid.scene.with_flywheel(own), simulate=False).balance
            balance = 0.0 if found is None else found.value
        else:
            balance = turning_moment.balance_value(rigid)
    if scene.compliances:
        run = graph_motion(machine, start, until, own, balance or 0.0, rtol)
        figures = run.displacement("phi", run.t), run.flow("crank", run.t), run.audit.supplied, run.audit.energy
        return Motion(run.t, *figures, run, error=run.error, states=states_of_graph(scene, run))
    stroke = scene.stroke
    if stroke is not None:
        start = start._replace(phi=float(own_coordinate(scene, np.asarray(phi, dtype=float))))
    motion = motion_from(dynamics_of(machine, total, balance or 0.0), start, until, rtol)
    if stroke is None:
        return motion
    motion = motion._replace(phi=np.clip(motion.phi + stroke.start, stroke.start, stroke.end))  # there but for rounding
    if motion.ended is None and motion.t[-1] < until:
        return motion._replace(ended=end_of_stroke(scene, float(motion.phi[-1]), float(motion.t[-1])))
    return motion


def actual(given: Machine | Scene) -> Machine:
    """The machine of a scene, or the one given, whose joints rub as they move: not by a moment at a constant speed.

    Raises:
        SceneError: where shafts twist in a scene with friction in joints.

    """
    machine = given if isinstance(given, Machine) else Machine(given)
    if machine.scene.rubs and machine.scene.compliances:
        found, expected = "a shaft that twists in a machine with friction in joints", "one or the other"
        advice = "leave stiffness out to follow the machine with friction, or friction out to follow the twist"
        raise SceneError([Fault(f"shafts.{name}.stiffness", found, expected, advice) for name in machine.scene.compliances])
    return machine if machine.friction is None else Machine(machine.scene)


def motion_from(
    dynamics: Dynamics,
    start: Start,
    until: float,
    rtol: float,
    goals: Sequence[Goal] = (),
    passing: Passing | None = None,
    watching: Watching | None = None,
) -> Motion:
    """The motion from a start, run again with tighter steps until two runs agree within rtol, or rounding forbids it.

    `passing` is asked at the end of every cycle of the first run (see `follow`); the others end with the same cycle.
    `watching` is told of the stretches of every run.
    """
    first = _FIRST_LOOSE if runge_kutta.method(_FIRST * rtol).order == 5 else _FIRST
    tight = max(min(first * rtol, _LOOSEST), TIGHTEST)
    share = 1.0
    rough = follow(dynamics, start, until, tight / _TIGHTER, goals, passing, watching)
    goal, cycles = rough.goal, rough.cycles
    left = cycles

    def same_cycle(t: float, omega: float) -> str | None:
        nonlocal left
        left = left - 1 or cycles
        return goal if left == cycles else None

    again = None if rough.goal in (None, *(one.name for one in goals)) else same_cycle
    while True:
        fine = follow(dynamics, start, until, tight, goals, again, watching, rough)
        if not fine.stretches:
            raise SceneError([_at_rest(fine)])
        error = share * _difference(rough, fine) + ROUNDING * (64 + len(fine.stretches) + _UNSURE * fine.repeated)
        error += fine.left
        error += 0.0 if dynamics.joint_friction is None else dynamics.joint_friction.error
        same = _same_steps(rough.t, fine.t)  # steps that no tolerance has shortened tell nothing of their error
        if (error <= rtol and not same) or tight <= TIGHTEST or fine.left > rtol:
            break
        rough, last = fine, tight
        tight = max(min(0.5 * rtol / error, _TIGHTER**2 if same else _LITTLE) * tight, TIGHTEST)
        # of the difference, where the tolerances lie further apart
        share = 1.0 if same else min(1.0, tight / (_TIGHTER * last))
    states, machine = fine.ends(), dynamics.machine
    cycle = machine.scene.cycle
    inside = np.clip(states[0], 0.0, cycle) if machine.scene.stroke is not None else states[0] % cycle
    kinetic = 0.5 * (dynamics.inertia + machine.reduce(inside).inertia + np.zeros_like(inside)) * states[1] ** 2
    missing = np.abs(kinetic - kinetic[0] - works_of(fine).total)
    residual = float(missing.max() / max(float(kinetic.max()), 1e-300))
    phi, omega, work, *rows = states
    own = {} if dynamics.circuit is None else dict(zip((one.name for one in dynamics.circuit.names), rows, strict=True))
    found = Motion(fine.t, phi, omega, work, residual, None, fine.stuck, error, own, fine, fine.drift)
    return found._replace(rough=rough, share=SAFETY * share)


def _same_steps(rough: Array, fine: Array) -> bool:
    """Whether two runs take the same steps, but for what their errors make of these."""
    return rough.size == fine.size and np.allclose(np.diff(rough), np.diff(fine), rtol=_SAME, atol=0.0)


def _difference(rough: Trail, fine: Trail) -> float:
    """The largest difference of two runs of a motion, relative to the way gone and to the greatest speed."""
    if not rough.stretches:
        return 1.0
    last = min(rough.t[-1], fine.t[-1])
    within = (fine.t[:-1, None] + np.diff(fine.t)[:, None] * _WITHIN).ravel()  # what is short lies between times evenly
    times = np.concatenate((np.linspace(0.0, last, _COMPARED), within[:: 1 + within.size // _MOST_COMPARED]))
    times = np.minimum(times, last)
    a, b = rough.states(times)[:2], fine.states(times)[:2]
    way = max(float(np.ptp(b[0])), fine.dynamics.machine.scene.cycle / (2 * np.pi))
    scales = np.array([way, max(float(np.abs(b[1]).max()), 1e-300)])
    late = abs(rough.t[-1] - fine.t[-1]) / fine.t[-1]
    return SAFETY * float(max((np.abs(a - b).max(axis=1) / scales).max(), late))


def _at_rest(trail: Trail) -> Fault:
    """The fault of a machine that does not move from its start."""
    dynamics = trail.dynamics
    where = dynamics.machine.where(trail.start.phi)
    if dynamics.machine.scene.stroke is None:
        found, expected = trail.stuck or f"a machine that stays at rest at {where}", "a start from which it moves"
        return Fault("simulation", found, expected)
    found = trail.stuck or f"a machine at {where}, the stroke's end, that moves on or is pushed out of it"
    return Fault("simulation", found, "a start from which it moves along its stroke")


def _own_states(scene: Scene, given: Mapping[str, float]) -> tuple[float, ...]:
    """A motor's own states at the start, those that are given and 0 for the others; a SceneError for unknown ones."""
    circuit = circuit_of(scene)
    names = [] if circuit is None else [one.name for one in circuit.names]
    faults = []
    for name, value in given.items():
        if name not in names:
            has = f"{', '.join(names)}: the states of its motor" if names else "none: its motor has no state of its own"
            faults.append(Fault(name, f"{value:g}", has))
        elif not np.isfinite(value):
            faults.append(Fault(name, f"{value}", "a finite number"))
    if faults:
        raise SceneError(faults)
    return tuple(float(given.get(name, 0.0)) for name in names)


def states_of_graph(scene: Scene, run: Run, t: Array | None = None) -> dict[str, Array]:
    """A motor's own states along the motion of the whole graph, of which it is a part, at times t (those of its steps)."""
    circuit = circuit_of(scene)
    if circuit is None:
        return {}
    states, rows = run.states(t), zip(circuit.names, circuit.in_graph, strict=True)
    return {one.name: place.factor * states[f"{place.kind}_drive.motor.{place.name}"] for one, place in rows}


def graph_motion(machine: Machine, start: Start, until: float, inertia: float, balance: float, rtol: float) -> Run:
    """The motion of the whole graph without twist at first, from crank angle (rad), speed (rad/s) and a motor's own states.

    Both sides of a compliant shaft need inertia: without it a side has no speed of its own to start with.
    """
    scene = machine.scene
    lossy = [name for name, share in scene.efficiencies.items() if share < 1.0]
    if lossy:
        found, expected = "losses in a mesh of a machine with a shaft that twists", "one or the other"
        advice = "leave efficiency and slip out to follow the twist, or stiffness to follow the machine with losses"
        raise SceneError([Fault(f"shafts.{name}", found, expected, advice) for name in lossy])
    circuit = circuit_of(scene)
    if circuit is not None and not circuit.in_graph:
        found = f"a shaft that twists beside a motor's own {' and '.join(one.name for one in circuit.names)}"
        advice = "leave stiffness out, or take the motor as static, its field always on"
        raise SceneError([Fault("drive.motor", found, "a motor that a bond graph has as a part", advice)])
    graph = compliant_graph(machine, balance, inertia)
    angles = [(d.name, scene.shafts[d.of]) for d in graph.displacements.values()]
    turning = [name for name in ("crank", *scene.compliances) if name in graph.elements]  # the others follow the crank
    states, expected = GraphDynamics(graph).state.names, "inertia on both sides of a compliant shaft"
    light = [name for name in turning if f"f_{name}" not in states]
    if light:
        raise SceneError(
            [Fault("inertia", f"nothing that weighs on {n}", expected, f'add [[inertia]] on = "{n}"') for n in light]
        )
    initial = {name: ratio * start.phi for name, ratio in angles}
    initial |= {name: scene.shafts[name] * start.omega for name in turning}
    if circuit is not None:
        given = zip(circuit.in_graph, start.states, strict=True)
        initial |= {f"drive.motor.{place.name}": value / place.factor for place, value in given}
    breaks = {name: (ratio * machine.breakpoints[:-1], ratio * scene.cycle) for name, ratio in angles}
    if machine.depends_on_time:
        breaks[TIME] = (np.array(SwitchingTimes(machine, until).every()), until)
    try:
        run = simulate_graph(graph, until, initial=initial, rtol=rtol, breaks=breaks)
    except GraphError as error:
        expected, advice = "a motion that can be followed", "check inertias and stiffness"
        raise SceneError([Fault("simulation", str(error), expected, advice)]) from error
    shafts = {mechanism.name: mechanism.shaft for mechanism in scene.mechanisms}
    for effort in machine.efforts:
        shaft = shafts.get(effort.load.on.partition(".")[0], effort.load.on)
        if effort.reverses and not effort.uses_speed and (time := _turns_back(run, shaft)) is not None:
            what = "drag" if effort.load.drag else "dry friction"
            found = f"a motion in which {shaft} turns back by {time:.6g} s, with {what} on it in a machine that twists"
            advice = f"a shorter time, or leave stiffness out: a rigid machine comes to rest by its {what}"
            raise SceneError([Fault(effort.path, found, "one that goes forwards", advice)])
    return run


def _turns_back(run: Run, shaft: str) -> float | None:
    """The time (s) by which a shaft turns backwards, where dry laws would drive it; None where it does not."""
    speeds = run.flow(shaft, run.t)
    back = speeds < -_STANDING * float(np.abs(speeds).max())
    return float(run.t[back.argmax()]) if back.any() else None


@dataclass(frozen=True, eq=False)
class CompliantGraph(BondGraph):
    """The graph of a machine that is followed for many cycles; it is pickled as the machine and values that it is of."""

    origin: tuple[Machine, float, float] | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        assert self.origin is not None
        return compliant_graph, self.origin


def compliant_graph(machine: Machine, balance: float, inertia: float) -> CompliantGraph:
    """The machine's graph with values (SI) of its balance and flywheel.

    Its laws, which were written for one cycle of the crank, repeat with every cycle.
    """
    graph, scene = machine.with_values(balance, inertia), machine.scene

    def repeating(element: Element) -> Element:
        law = element.law
        if not isinstance(law, Modulus | Law):
            return element
        of, position = law.motion.of, law.motion.position
        period = scene.cycle * scene.shafts[of]

        def position_again(q: Any, ns: Any, anchor: Any) -> Any:
            shift = np.floor(anchor / period) * period
            return position(q - shift, ns, anchor - shift)

        motion = Position(of, position_again)
        if isinstance(law, Modulus):
            return element._replace(law=law._replace(motion=motion))
        effort = law.effort

        def effort_again(here: Here, anchor: Here) -> Any:
            shift = np.floor(anchor.q / period) * period
            return effort(here._replace(q=here.q - shift), anchor._replace(q=anchor.q - shift))

        return element._replace(law=law._replace(motion=motion, effort=effort_again, per_unknown=None))

    elements = {name: repeating(element) for name, element in graph.elements.items()}
    given = {one.name: getattr(graph, one.name) for one in fields(graph)} | {"elements": elements}
    return CompliantGraph(**given, origin=(machine, balance, inertia))


# -- what the machine does along a motion -----------------------------------------------------------------------------

_TOPS = 64  # how many of the highest samples are looked at more closely
_FINER, _ROUNDS = 33, 4  # times between the neighbours of a top, and how often they are laid closer


class Peak(NamedTuple):
    """A greatest value and the time (s) at which it is reached."""

    value: float
    time: float


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


class Samples(NamedTuple):
    """A motion at times t (s): phi (rad, not reduced), omega (rad/s), acceleration (rad/s²), moment M* less losses (N m).

    `drive` is the drive's torque at its own shaft (N m), `power` what it gives (W), `loss` what meshes lose (W), `kinetic`
    the kinetic energy (J), `current` a motor's (A; None where its kind does not tell it), `states` a motor's own by
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


def _current(motor: Motor | None, circuit: Circuit | None, ratio: float, here: Along) -> Array | None:
    """The current (A) of a motor, by its own states where it has any; None where its type does not tell it."""
    if circuit is not None:
        current: Array | None = circuit.current(ratio * here.omega, here.states)
        return current
    return None if motor is None else motor.current_along(ratio * here.omega, here.time, here.anchor.time)


def sampled(trail: Trail, times: Array, owners: Indices | None = None) -> Samples:
    """The motion at times within it; at an end of a stretch `owners` tell the side (the one before, where they are None)."""
    dynamics, parts, own = trail.dynamics, list[Any](), list[Array]()
    motor, ratio, circuit = dynamics.machine.scene.motor, dynamics.ratio, dynamics.circuit
    for portion, states, here in trail.along(times, trail.owners(times) if owners is None else owners):
        current = _current(motor, circuit, ratio, here)
        now, omega = dynamics.at_many(*here), states[1]
        drive = dynamics.moments(*here, now).get(DRIVE, np.zeros_like(omega))
        kinetic, shaft = 0.5 * now.inertia * omega**2, drive / dynamics.ratio
        figures = now.acceleration, now.moment, shaft, drive * omega, now.loss * omega, kinetic, current
        parts.append((times[portion], states[0], omega, *figures))
        own.append(states[3:])
    joined: list[Any] = [None if column[0] is None else np.concatenate(column) for column in zip(*parts, strict=True)]
    found = Samples._make([*joined, None])
    if dynamics.circuit is None:
        return found
    rows = zip(dynamics.circuit.names, np.concatenate(own, axis=1), strict=True)
    return found._replace(states={one.name: row for one, row in rows})


def switching(trail: Trail) -> tuple[Array, Indices]:
    """Times at which a law switches or a piece ends, each twice, and the stretches on either side."""
    stretches = trail.stretches
    last = np.array(
        [k for k in range(len(stretches) - 1) if stretches[k].anchor is not stretches[k + 1].anchor], dtype=np.intp
    )
    return np.repeat(trail.t[last + 1], 2), np.column_stack((last, last + 1)).ravel()


_CLOSE = 1e-9  # of a cycle: how near to an edge of the machine a step that ends there may end


def evenly(trail: Trail, points: int, breaks: bool = False) -> tuple[Array, Indices]:
    """So many times from start to end, and their stretches; with `breaks` also where laws switch, once for each side."""
    times = np.linspace(0.0, float(trail.t[-1]), points)
    owners = trail.owners(times)
    if not breaks:
        return times, owners
    more, sides = switching(trail)
    machine = trail.dynamics.machine
    cycle, phi = machine.scene.cycle, trail.states(more, sides)[0]
    own = phi if machine.scene.stroke is not None else phi % cycle
    restarts, switch = (
        np.abs(own[:, None] - edges).min(axis=1, initial=cycle) <= _CLOSE * cycle
        for edges in (machine.restarts, machine.switches)
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
    """Works and heats of a motion with its kinetic energy (J) at times from start to end, and how far they close.

    Works are those of `works_of`, apart from what time stepping itself adds up.
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
    tops = [peak(trail, name, samples, owners) if wanted else None for name, wanted in others.items()]
    return Peaks(peak(trail, "omega", samples, owners), *tops)


def peak(trail: Trail, name: str, samples: Samples, owners: Indices) -> Peak:
    """The greatest value of a column of `samples_of`: on either side of a jump, or between two samples of a stretch."""
    return max(highest(trail, name, samples, owners), key=lambda one: one.value)


def column(samples: Samples, name: str) -> Array:
    """A column of samples; of the speed its size, as a machine that swings back is fastest either way."""
    return np.asarray(np.abs(samples.omega) if name == "omega" else getattr(samples, name))


def _figure(trail: Trail, name: str, times: Array, owners: Indices) -> Array:
    """A column of samples, by no more than it takes: a speed needs no laws, and what drives no friction in joints."""
    dynamics = trail.dynamics
    if name == "omega":
        return np.asarray(np.abs(trail.states(times, owners)[1]))
    if name not in ("drive", "power"):
        return column(sampled(trail, times, owners), name)
    parts = [np.zeros(0)]
    for _, states, here in trail.along(times, owners):
        drive = dynamics.moments(*here, rubbing=False).get(DRIVE, np.zeros_like(states[1]))
        parts.append(drive / dynamics.ratio if name == "drive" else drive * states[1])
    return np.concatenate(parts)


def highest(trail: Trail, name: str, samples: Samples, owners: Indices) -> list[Peak]:
    """The greatest values about each of the highest samples; the very greatest sample first.

    The highest are those that no neighbour in their stretch exceeds. Each is then refined on times ever closer.
    """
    times, values = samples.t, column(samples, name)

    def beside(which: Indices, side: int) -> Indices:
        """The neighbours of samples, or they themselves where their stretch ends."""
        other = np.clip(which + side, 0, owners.size - 1)
        return np.where(owners[other] == owners[which], other, which)

    every, best = np.arange(values.size), int(values.argmax())
    top = np.flatnonzero((values >= values[beside(every, -1)]) & (values >= values[beside(every, 1)]))
    tops = top[np.argsort(values[top], kind="stable")[-_TOPS:]]

    def along(grid: Array) -> Array:
        return _figure(trail, name, grid.ravel(), np.repeat(owners[tops], _FINER)).reshape(grid.shape)

    found = summits(along, times[beside(tops, -1)], times[beside(tops, 1)], _FINER, _ROUNDS)
    nearby = values[tops] >= found.value
    heights, places = np.where(nearby, values[tops], found.value), np.where(nearby, times[tops], found.place)
    return [Peak(float(values[best]), float(times[best])), *map(Peak, heights.tolist(), places.tolist())]


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
    scene = machine.scene
    same = scene.inertia == inertia and machine.friction is None
    sizing = size(machine if same else scene.with_flywheel(inertia), simulate=False)
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


def states_at(sizing: Sizing, phi: float) -> tuple[float, ...]:
    """A motor's own states in the steady cycle at a crank angle (rad); none where it has none."""
    cycle, run = sizing.cycle, sizing.run
    if cycle is None or run is None or run.along is None:
        return ()
    cell, t = cells.located(cycle.mesh, np.array([phi % sizing.scene.cycle]))
    return tuple(float(cells.value(cells.fit(row)[cell], t)[0]) for row in run.along)


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
