"""Motion of a machine from any state, by time stepping, with its works, heats and extremes.

A machine with compliant shafts, which one angle does not describe, is followed by its whole bond graph. Along a motion are
its samples (`sampled`), works and heats (`energy_of`) and greatest values (`peak`); along the steady cycle that a machine
reaches, its speed and time (`regime_of`, `speed_at`, `time_along`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.elements import TIME, Element, GraphError, Here, Law, Modulus
from bondgraph.elements import Motion as Position
from bondgraph.graph import BondGraph
from bondgraph.motion import runge_kutta
from bondgraph.motion.formulation import Formulation
from bondgraph.motion.run import Run
from bondgraph.motion.simulation import simulate as simulate_graph
from bondgraph.motion.stepping import TIGHTEST
from flywheel.machine.dynamics import MachineDynamics, StartState, Trail, dynamics_of
from flywheel.machine.machine import Machine, circuit_of
from flywheel.motions.motion import Motion, scales_of, works_of
from flywheel.numerics.cells import ROUNDING
from flywheel.numerics.faults import Fault, SceneError
from flywheel.regime import turning_moment
from flywheel.regime.free_motion import Goal, Passing, SwitchingTimes, Watching, end_of_stroke, follow
from flywheel.regime.joint_friction import machine_of
from flywheel.regime.state import own_coordinate
from flywheel.scene.scene import Scene
from flywheel.sizing.results import Sizing
from flywheel.sizing.sizing import size

Array = NDArray[np.float64]

_FIRST, _FIRST_LOOSE = 1 / 150, 1 / 75  # tolerance of a step to what is asked; of order 5
_LOOSEST = 7e-6  # looser steps do not err in proportion to their tolerance
_TIGHTER = 0.1  # of each run's steps to those of the run before
_TIGHTER_AGAIN = 0.3  # the same of further runs, at the most
_COMPARED, _MOST_COMPARED = 300, 20_000  # times at which two runs are compared, evenly, and within steps at the most
_WITHIN = np.array([0.27, 0.61, 1.0])  # parts of a step at which they are
_SAME_STEP = 1e-3  # of a step: two runs whose steps differ by less take the same ones
_UNSURE = 500.0  # roundings within which the net work of a cycle counts as zero
_STANDING = 1e-9  # of the greatest speed: slower than this a shaft does not reverse
SAFETY = 2.0  # factor on the error of a run, which between steps does not fall in proportion to its tolerance


@np.errstate(all="ignore")  # a step that tries too much leaves the floating-point range, and is tried again shorter
def simulate(
    machine: Machine | Scene,
    phi: float = 0.0,
    omega: float | None = None,
    until: float | None = None,
    *,
    inertia: float | None = None,
    balance: float | None = None,
    rtol: float = 1e-10,
    states: Mapping[str, float] = MappingProxyType({}),
    current: float = 0.0,
) -> Motion:
    """Motion of a machine from a given state for a given time, from (J + I*) alpha + ½ dI*/dphi omega² = M*(phi, omega, t).

    M* holds loads, drive and dampers, less the losses of meshes. Stepping restarts at every breakpoint:
    of position, of time, and where a law switches at a speed. A motor adds its own states, such as its current.
    Dry laws, and friction in joints with the reactions of the same instant, act against the motion either way; at rest
    they keep the machine there until a force exceeds them; otherwise the motion ends there. A motor runs in its own
    connection from the first instant: its `start` is followed by `flywheel.transient`.

    A machine with compliant shafts has more than one angle: its whole bond graph is followed, from a state without twist.
    A machine with a stroke is followed until it reaches one of the stroke's ends.

    Args:
        machine: a `Machine`, or a `Scene`, of which one is then built.
        phi: crank angle at t = 0, rad. On a stroke the driver's coordinate, rad, or m where it slides.
        omega: crank speed at t = 0, rad/s; it may be zero, and the machine may stop and reverse. On a stroke the driver's
            speed, m/s where it slides.
        until: time to simulate, s.
        inertia: the flywheel's, kg m² at its own shaft; the scene's own (0 if it is to be sized) if None. On a stroke
            mass or inertia that moves with the driver in addition: 0 if None, kg if it slides.
        balance: value (SI) of the scene's unknown; if None the one that balances the cycle (with rigid shafts).
        rtol: error allowed of the whole motion; its `error` is the estimate reached.
        states: a motor's own at t = 0 by name (SI); 0 if they are not given.
        current: of a motor with inductance at t = 0, A: that state.

    Raises:
        SceneError: if I* + J vanishes somewhere, so that the motion is not determined; if the machine starts outside its
            stroke, or at an end of it and is pushed outwards; if friction in joints never lets it start, or leaves no
            acceleration or several; if shafts twist where joints have friction.

    >>> import flywheel
    >>> rotor = {"inertia": [{"on": "crank", "value": 2}], "drive": {"torque": 6}, "regime": {"speed": 1},
    ...          "flywheel": {"inertia": 1}}
    >>> motion = flywheel.simulate(flywheel.load(rotor), phi=0, omega=0, until=3)
    >>> round(float(motion.omega[-1]), 9), round(float(motion.phi[-1]), 9)
    (6.0, 9.0)

    """
    if omega is None or until is None:
        required = {"omega": omega, "until": until}
        raise SceneError([Fault(name, "nothing", "a finite number") for name, value in required.items() if value is None])
    machine = actual(machine)
    finite = {"phi": phi, "omega": omega, "until": until, "rtol": rtol, "current": current}
    faults = [Fault(name, f"{value}", "a finite number") for name, value in finite.items() if not np.isfinite(value)]
    positive = {"until": until, "rtol": rtol}
    faults += [Fault(name, f"{value}", "a number above 0") for name, value in positive.items() if value <= 0.0]
    if faults:
        raise SceneError(faults)
    scene = machine.scene
    starts = {**states, "current": current} if current else dict(states)
    start = StartState(phi, omega, _own_states(scene, starts))
    own = (scene.inertia or 0.0) if inertia is None else inertia
    total = own * scene.flywheel_ratio**2
    if balance is None and scene.unknown is not None:
        rigid = machine_of(scene.with_rigid_shafts() if scene.compliances else machine)
        if rigid.depends_on_speed or (scene.rubs and scene.speed is not None):
            balance_torque = size(rigid.scene.with_flywheel(own), simulate=False).balance
            balance = 0.0 if balance_torque is None else balance_torque.value
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
    motion = motion._replace(phi=np.clip(motion.phi + stroke.start, stroke.start, stroke.end))  # there except for rounding
    if motion.ended is None and motion.t[-1] < until:
        return motion._replace(ended=end_of_stroke(scene, float(motion.phi[-1]), float(motion.t[-1])))
    return motion


def actual(source: Machine | Scene) -> Machine:
    """The machine of a scene, or the given one, with friction of the actual motion, not a moment at a constant speed.

    Raises:
        SceneError: if shafts twist in a scene with friction in joints.

    """
    machine = source if isinstance(source, Machine) else Machine(source)
    turning_moment.refuse_strokes(machine.scene)
    if machine.scene.rubs and machine.scene.compliances:
        defect, expected = "a shaft that twists in a machine with friction in joints", "one or the other"
        advice = "leave stiffness out to follow the machine with friction, or friction out to follow the twist"
        raise SceneError([Fault(f"shafts.{name}.stiffness", defect, expected, advice) for name in machine.scene.compliances])
    return machine if machine.friction is None else Machine(machine.scene)


def motion_from(
    dynamics: MachineDynamics,
    start: StartState,
    until: float,
    rtol: float,
    goals: Sequence[Goal] = (),
    passing: Passing | None = None,
    watching: Watching | None = None,
) -> Motion:
    """The motion from a start, run again with tighter steps until two runs agree within rtol, or rounding forbids it.

    Its error is no less than what its energy misses: the works of all laws are integrated along it once more.

    `passing` is called at the end of every cycle of the first run (see `follow`); the others end with the same cycle.
    `watching` receives the stretches of every run.
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
        same = rough.t.size == fine.t.size and np.allclose(np.diff(rough.t), np.diff(fine.t), rtol=_SAME_STEP, atol=0.0)
        if (error <= rtol and not same) or tight <= TIGHTEST or fine.left > rtol:
            break
        rough, last = fine, tight
        tight = max(min(0.5 * rtol / error, _TIGHTER**2 if same else _TIGHTER_AGAIN) * tight, TIGHTEST)
        # of the difference, where the tolerances lie further apart
        share = 1.0 if same else min(1.0, tight / (_TIGHTER * last))
    states, machine = fine.ends(), dynamics.machine
    cycle = machine.scene.cycle
    inside = np.clip(states[0], 0.0, cycle) if machine.scene.stroke is not None else states[0] % cycle
    kinetic = 0.5 * (dynamics.inertia + machine.reduce(inside).inertia + np.zeros_like(inside)) * states[1] ** 2
    missing = np.abs(kinetic - kinetic[0] - works_of(fine)[2])
    residual = float(missing.max() / max(float(kinetic.max()), 1e-300))
    phi, omega, work, *rows = states
    own = {} if dynamics.circuit is None else dict(zip((one.name for one in dynamics.circuit.names), rows, strict=True))
    motion = Motion(fine.t, phi, omega, work, residual, None, fine.stuck, max(error, residual), own, fine, fine.drift)
    return motion._replace(rough=rough, share=SAFETY * share)


def _difference(rough: Trail, fine: Trail) -> float:
    """The largest difference of two runs of a motion, relative to the travel and to the greatest speed."""
    if not rough.stretches:
        return 1.0
    last = min(rough.t[-1], fine.t[-1])
    within = (fine.t[:-1, None] + np.diff(fine.t)[:, None] * _WITHIN).ravel()  # what is short lies between times evenly
    times = np.concatenate((np.linspace(0.0, last, _COMPARED), within[:: 1 + within.size // _MOST_COMPARED]))
    times = np.minimum(times, last)
    a, b = rough.states(times)[:2], fine.states(times)[:2]
    scales = np.maximum(scales_of(b[0], b[1], fine.dynamics.machine.scene), 1e-300)
    late = abs(rough.t[-1] - fine.t[-1]) / fine.t[-1]
    return SAFETY * float(max((np.abs(a - b).max(axis=1) / scales).max(), late))


def _at_rest(trail: Trail) -> Fault:
    """The fault of a machine that does not move from its start."""
    dynamics = trail.dynamics
    where = dynamics.machine.where(trail.start.phi)
    if dynamics.machine.scene.stroke is None:
        defect, expected = trail.stuck or f"a machine that stays at rest at {where}", "a start from which it moves"
        return Fault("simulation", defect, expected)
    defect = trail.stuck or f"a machine at {where}, the stroke's end, that moves on or is pushed out of it"
    return Fault("simulation", defect, "a start from which it moves along its stroke")


def _own_states(scene: Scene, values: Mapping[str, float]) -> tuple[float, ...]:
    """A motor's own states at the start, those that are given and 0 for the others; a SceneError for unknown ones."""
    circuit = circuit_of(scene)
    names = [] if circuit is None else [one.name for one in circuit.names]
    faults = []
    for name, value in values.items():
        if name not in names:
            has = f"{', '.join(names)}: the states of its motor" if names else "none: its motor has no state of its own"
            faults.append(Fault(name, f"{value:g}", has))
        elif not np.isfinite(value):
            faults.append(Fault(name, f"{value}", "a finite number"))
    if faults:
        raise SceneError(faults)
    return tuple(float(values.get(name, 0.0)) for name in names)


def states_of_graph(scene: Scene, run: Run, t: Array | None = None) -> dict[str, Array]:
    """A motor's own states along the motion of the whole graph, of which it is a part, at times t (those of its steps)."""
    circuit = circuit_of(scene)
    if circuit is None:
        return {}
    by_element = {}
    for one in circuit.names:
        assert one.in_graph is not None, one.name
        kind, name, factor = one.in_graph
        by_element[one.name] = factor * (run.flow if kind == "f" else run.displacement)(f"drive.motor.{name}", t)
    return by_element


def graph_motion(machine: Machine, start: StartState, until: float, inertia: float, balance: float, rtol: float) -> Run:
    """The motion of the whole graph without twist at first, from crank angle (rad), speed (rad/s) and a motor's own states.

    Both sides of a compliant shaft need inertia: without it a side has no speed of its own to start with.
    """
    scene = machine.scene
    lossy = [name for name, share in scene.efficiencies.items() if share < 1.0]
    if lossy:
        defect, expected = "losses in a mesh of a machine with a shaft that twists", "one or the other"
        advice = "leave efficiency and slip out to follow the twist, or stiffness to follow the machine with losses"
        raise SceneError([Fault(f"shafts.{name}", defect, expected, advice) for name in lossy])
    circuit = circuit_of(scene)
    places = () if circuit is None else tuple(one.in_graph for one in circuit.names if one.in_graph is not None)
    if circuit is not None and len(places) < len(circuit.names):
        defect = f"a shaft that twists together with a motor's own {' and '.join(one.name for one in circuit.names)}"
        advice = "leave stiffness out, or take the motor as static, its field always on"
        raise SceneError([Fault("drive.motor", defect, "a motor that a bond graph has as a part", advice)])
    graph = compliant_graph(machine, balance, inertia)
    angles = [(d.name, scene.shafts[d.of]) for d in graph.displacements.values()]
    turning = [name for name in ("crank", *scene.compliances) if name in graph.elements]  # the others follow the crank
    form, expected = Formulation(graph), "inertia on both sides of a compliant shaft"
    light = [name for name in turning if form.flow_state(name) is None]
    if light:
        raise SceneError([Fault("inertia", f"no inertia on {n}", expected, f'add [[inertia]] on = "{n}"') for n in light])
    initial = {name: ratio * start.phi for name, ratio in angles}
    initial |= {name: scene.shafts[name] * start.omega for name in turning}
    values = zip(places, start.states, strict=False)
    initial |= {f"drive.motor.{name}": value / factor for (_kind, name, factor), value in values}
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
            what = "drag on it" if effort.load.drag else "dry friction on it"
            defect = f"a motion in which {shaft} turns back by {time:.6g} s, with {what} in a machine that twists"
            advice = "a shorter time, or leave stiffness out: a rigid machine comes to rest by its friction"
            raise SceneError([Fault(effort.path, defect, "one that moves forwards", advice)])
    return run


def _turns_back(run: Run, shaft: str) -> float | None:
    """The time (s) by which a shaft turns backwards, where dry laws would drive it; None if it does not."""
    speeds = run.flow(shaft, run.t)
    back = speeds < -_STANDING * float(np.abs(speeds).max())
    return float(run.t[back.argmax()]) if back.any() else None


@dataclass(frozen=True, eq=False)
class CompliantGraph(BondGraph):
    """The graph of a machine that is followed for many cycles; it is pickled as its machine and values."""

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
    parts = {one.name: getattr(graph, one.name) for one in fields(graph)} | {"elements": elements}
    return CompliantGraph(**parts, origin=(machine, balance, inertia))


# -- what the machine does along a motion -----------------------------------------------------------------------------


# -- the steady regime ------------------------------------------------------------------------------------------------


class Regime(NamedTuple):
    """A steady cycle: its mean speed over time (rad/s), its period (s), and the analysis that it comes from."""

    speed: float
    period: float
    sizing: Sizing


def regime_of(machine: Machine, inertia: float) -> Regime:
    """The steady regime of a machine with a flywheel of some inertia (kg m² at its own shaft).

    Raises SceneError if there is none.
    """
    scene = machine.scene
    same = scene.inertia == inertia and machine.friction is None
    sizing = size(machine if same else scene.with_flywheel(inertia), simulate=False)
    cycle_motion = sizing.simulation
    if cycle_motion is None or cycle_motion.period is None or cycle_motion.speed_time_mean is None:
        raise SceneError([Fault("regime", "a machine whose steady motion has no period", "one that has inertia")])
    return Regime(cycle_motion.speed_time_mean, cycle_motion.period, sizing)
