"""A motor's start: the load at rest on its shaft, the run-up through its torque map, and its heat.

In order: the loads at rest, and the torque that balances them (`load_at_rest`); the run-up through a table of
net moment by angle and speed (`mapped_run_up`), which is fast and accurate to about a thousandth; and the heat of a start
along a motion that was followed in time (`start_heat`).
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.numerics import root
from flywheel.components.motors import Connection, Motor, Started, Switch
from flywheel.components.motors.starting import as_started
from flywheel.components.motors.thermal import rise_after
from flywheel.machine.dynamics import NODES, ONSET, MachineDynamics, StartState, Trail
from flywheel.machine.equation import Moments
from flywheel.machine.machine import DRIVE, Anchor, Machine
from flywheel.numerics import cells
from flywheel.numerics.cells import Index
from flywheel.sizing.results import Trip

Array = NDArray[np.float64]

_WHOLE_START = 1e-9  # by which a number of starts may miss a whole one
_SPEEDS = 160  # rows of a torque map, evenly from rest to the speed that is to be reached
_WIDEST, _CLOSER = 1 / 12, 1 / 8  # of the cycle: a cell of a torque map; of the way, where a start takes less than a cycle
_SAME_EDGE = 1e-9  # of the cycle: edges nearer than this are one
_LOOKED_AT = np.array([0.1, 0.35, 0.6, 0.85])  # of a piece
_SEEN = 9  # speeds, and times, at which the push of a drive is evaluated
_OFF = 0.01  # of the greatest push of a drive: below it the drive is off
_MOST_TURNS = 5_000  # of a run-up
_NO_POWER = 1e-9  # share of the greatest power: less that is returned is rounding
_SIMPSON = np.array([1.0, 4.0, 1.0]) / 6.0  # of a square at both ends of a step and in its middle
_ON_A_RAMP = 257  # times at which the torque of a connection is taken at rest
_SAME_SPEED = 1e-9  # share of the energy below which a cycle leaves the speed constant


# -- at rest -----------------------------------------------------------------------------------------------------------


def torque_at_rest(motor: Motor) -> float:
    """The greatest torque (N m) that a motor gives at rest, among the connections that it goes through by time alone.

    >>> from flywheel.components.motors import DC, Switch, resistance_steps
    >>> from dataclasses import replace
    >>> motor = DC(voltage=100.0, resistance=1.0, constant=0.5)
    >>> stepped = replace(motor, start=resistance_steps(motor, [4.0, 1.0], [Switch(time=1.0), Switch(speed=50.0)]))
    >>> torque_at_rest(motor), torque_at_rest(stepped)
    (50.0, 25.0)
    """
    connections = () if motor.start is None else motor.start.connections
    torques = []
    for connection in connections:
        own = Started(own=motor, connections=(connection,), times=())
        over = np.linspace(0.0, connection.ramp or connection.until.time or 0.0, _ON_A_RAMP)
        torques.append(float(own.torque_at(0.0, over).max()))
        if connection.until.time is None:
            return max(torques)
    return max([*torques, motor.starting_torque])


def load_at_rest(machine: Machine, phi: Array) -> Array:
    """The torque (N m, on the motor's shaft) that just balances a machine at rest at crank angles (rad), about to start.

    The torque of every part passes through each mesh between it and the motor, with a loss in each: on the way from the
    motor a mesh of efficiency eta needs 1/eta of its output, one with reversed power returns eta of it.

    Valid for rigid shafts; friction in joints is left out. Source: the balance of powers at a vanishing speed.

    >>> import flywheel
    >>> press = {"shafts": {"a": {"ratio": 2.0, "efficiency": 0.5}, "motor": {"ratio": 3.0, "on": "a", "efficiency": 0.5}},
    ...          "load": [{"on": "crank", "torque": "-180 N m"}], "drive": {"on": "motor", "torque": "200 N m"}}
    >>> load_at_rest(Machine(flywheel.load(press)), np.zeros(1)).tolist()
    [120.0]
    """
    scene, stages, anchor = machine.scene, machine.stages, machine.anchors(phi)
    onset = ONSET * machine.typical_speed
    needed: list[Array] = []
    for stage in stages:
        station = stage.reduction.at(phi, anchor)
        still = sum(value for part, value in station.moments(0.0).items() if part != "drive")
        laws = station.contributions(0.0, 0.0, onset, 0.0) if stage.reduction.moving else []
        moving = sum(effort for element, effort, _ in laws if not element.name.startswith(DRIVE))
        needed.append(np.zeros(phi.shape) - still - moving)
    way = [next(k for k, stage in enumerate(stages) if stage.drives)]
    while way[-1]:
        way.append(stages[way[-1]].near)
    for k in range(len(stages) - 1, 0, -1):
        if k not in way:
            needed[stages[k].near] = needed[stages[k].near] + _with_mesh_losses(needed[k], stages[k].efficiency)
    total = needed[0]
    for k in way[-2::-1]:
        total = needed[k] + _with_mesh_losses(total, stages[k].efficiency)
    assert scene.drive is not None
    return np.asarray(total / scene.shafts[scene.drive.on])


def _with_mesh_losses(passed: Array, efficiency: float) -> Array:
    """Torque at the driving side of a mesh for a torque that passes it in either direction."""
    return np.where(passed > 0.0, passed / efficiency, passed * efficiency)


def moment_at_rest(dynamics: MachineDynamics, begin: StartState, t: float = 0.0) -> tuple[float, float]:
    """M* at the start from rest at t (s), and the sizes of its moments, there and over the cycle.

    It is M* just ahead of the start, before losses in meshes; friction is that of a motion forwards.
    """
    machine = dynamics.machine
    phi = within(machine, begin.phi)
    place = Anchor(float(machine.anchors(phi)), ONSET * machine.typical_speed, t, tuple(1.0 for _ in machine.stages))
    parts = dynamics.moments(np.array([phi]), place, np.zeros(1), np.full(1, t), begin.states)
    around = _around(machine)
    still = np.zeros_like(around)
    over = dynamics.moments(around, place._replace(phi=machine.anchors(around)), still, still + t, begin.states)
    largest = sum(float(np.abs(part).max()) for part in over.values())
    return float(sum(part[0] for part in parts.values())), largest + float(sum(abs(part[0]) for part in parts.values()))


def within(machine: Machine, phi: float) -> float:
    """A position within the cycle, or along the stroke."""
    return phi if machine.scene.stroke is not None else phi % machine.scene.cycle


def _around(machine: Machine) -> Array:
    """Positions all over the cycle, or the stroke, in every piece of it."""
    return np.asarray((machine.restarts[:-1, None] + np.diff(machine.restarts)[:, None] * _LOOKED_AT).ravel())


def drive_acts(dynamics: MachineDynamics, trail: Trail, last: float) -> bool:
    """Tests whether at the end (s) the drive pushes forwards anywhere in the cycle, at rest or at a speed of the motion.

    If time has switched it off (to a hundredth of its greatest push), or it brakes, the machine
    stops; otherwise the drive was too weak.
    """
    machine = dynamics.machine
    speeds = np.unique(np.append(np.abs(trail.ends()[1]), 0.0))
    speeds = speeds[np.linspace(0, speeds.size - 1, min(speeds.size, _SEEN)).astype(int)]
    axes = _around(machine), speeds, np.linspace(last, 0.0, _SEEN)
    phi, omega, time = (grid.ravel() for grid in np.meshgrid(*axes, indexing="ij"))
    onset = np.maximum(omega, ONSET * machine.typical_speed)
    place = Anchor(machine.anchors(phi), onset, time, tuple(1.0 for _ in machine.stages))
    states = () if dynamics.circuit is None else dynamics.circuit.steady(dynamics.ratio * omega)
    drive = dynamics.moments(phi, place, omega, time, states).get("drive", np.zeros(phi.size))
    return bool(drive[time == last].max() > _OFF * max(float(drive.max()), 0.0))


# -- the run-up through a torque map ----------------------------------------------------------------------------------


class RunUp(NamedTuple):
    """A run-up: its time (s), its turns of the crank, and the integral of (I/I_n)² dt of the windings (s).

    current_squared: None if the motor's type or plate does not give its current.
    speed: of the crank at the end, rad/s: the target, 0 if the machine stops, or the speed at which it stays.
    reached: true if the target was reached; None if it would take more turns than are followed.
    stop: crank angle (rad) at which it stops again; None if it does not.
    """

    time: float
    turns: float
    current_squared: float | None
    speed: float
    reached: bool | None
    stop: float | None = None


def maps(motor: Motor) -> bool:
    """Tests whether a start may be followed through torque maps: the torque depends on speed alone in each connection."""
    return motor.start is None or not any(one.ramp or one.motor.law().uses_time for one in motor.start.connections)


def mapped_run_up(machine: Machine, inertia: float, at: float, target: float) -> RunUp:
    """The run-up of a machine from rest at a crank angle to a crank speed, through its motor's connections.

    Net moments F = dE/dphi, with mesh losses, those by acceleration included, are tabulated over angles and speeds; the
    kinetic energy E = (I* + J) omega²/2 then follows from node to node, and the time from dt = dphi/omega.

    Args:
        machine: driven by a motor; states of its torque are taken as steady at every speed.
        inertia: J of the flywheel, kg m² on the crank.
        at: crank angle, rad.
        target: speed to be reached in the last connection, rad/s.

    Raises:
        SceneError: for laws that are not defined somewhere on the way.

    A step from omega to omega' gives I omega'²/2 = E + w F at their mean, F as a line in omega: a quadratic, of order 2,
    stable where torque falls steeply, and exact in the cycle's work at a constant speed. Valid for loads
    that do not depend on time, and connections without a ramp (`maps`).

    >>> import flywheel
    >>> fan = {"drive": {"motor": {"type": "line", "starting_torque": 10, "slope": 1}}, "flywheel": {"inertia": 2}}
    >>> run = mapped_run_up(Machine(flywheel.load(fan)), 2.0, 0.0, 9.5)
    >>> run.reached, round(run.time, 2), round(2 * math.log(20), 2)
    (True, 5.99, 5.99)

    """
    run = _run_up(machine, inertia, at, target, _mesh(machine, at))
    way = 2 * math.pi * run.turns
    if not 0.0 < way < 0.5 * machine.scene.cycle:
        return run
    return _run_up(machine, inertia, at, target, _mesh(machine, at, way))


def _mesh(machine: Machine, at: float, way: float = 0.0) -> cells.Cells:
    """Cells of a torque map, an edge of which is where the start begins; finer along the way that is given (rad)."""
    cycle = machine.scene.cycle
    edges = np.unique(np.append(machine.restarts, [at % cycle, min(at % cycle + way, cycle)]))
    edges = edges[np.diff(edges, prepend=-1.0) > _SAME_EDGE * cycle]
    edges[-1] = cycle
    while True:
        ahead = (edges[:-1] - at) % cycle < (1.0 - _SAME_EDGE) * way
        wide = np.diff(edges) > (1.0 + _SAME_EDGE) * np.where(ahead, _CLOSER * way, _WIDEST * cycle)
        if not wide.any():
            return cells.cells(edges)
        edges = cells.bisected(edges, wide)


def _run_up(machine: Machine, inertia: float, at: float, target: float, mesh: cells.Cells) -> RunUp:
    motor, drive = machine.scene.motor, machine.scene.drive
    assert motor is not None
    assert drive is not None
    ratio = machine.scene.shafts[drive.on]
    legs = [*(() if motor.start is None else motor.start.connections), Connection(motor, Switch(time=math.inf))]
    place, energy, clock, turned, squared, certain = at, 0.0, 0.0, 0.0, 0.0, True
    for k, leg in enumerate(legs):
        last = k + 1 == len(legs)
        running = Started(own=motor, connections=(leg,), times=())
        table = _Map(machine if last else _driven_by(machine, running), inertia, target, mesh)
        level = target if last else math.inf if leg.until.speed is None else leg.until.speed / ratio
        end = math.inf if last or leg.until.time is None else leg.until.time
        times, omega, place, energy, way, done, stop = table.followed(place, energy, level, end - clock)
        ends = omega if omega.size else np.zeros((1, 2))
        within = ratio * np.stack((ends[:, 0], ends.mean(axis=1), ends[:, 1]))
        share = running.windings_at(within, np.zeros(within.shape))
        certain = certain and share is not None and motor.current_share(0.0) is not None
        if share is not None and omega.size:
            squared += float(times @ (_SIMPSON @ share**2))
        clock, turned = clock + float(times.sum()), turned + way / (2 * math.pi)
        if stop is not None or not done:
            break
    speed = 0.0 if stop is not None or not omega.size else float(omega[-1, 1])
    reached = False if stop is not None else done
    return RunUp(clock, float(turned), squared if certain else None, target if reached else speed, reached, stop)


def _driven_by(machine: Machine, motor: Motor) -> Machine:
    """The machine with another motor instead of its own."""
    scene = machine.scene
    assert scene.drive is not None
    return Machine(replace(scene, drive=scene.drive._replace(law=motor.law()), motor=motor), machine.friction)


class _Map:
    """Net moment of a machine (N m, on the crank) by node of the cycle and speed, its inertia with the flywheel by node.

    Cells are evaluated as the motion comes to them, ever more at once: most starts are over within a part of a cycle.
    """

    def __init__(self, machine: Machine, inertia: float, fastest: float, mesh: cells.Cells) -> None:
        self.machine, self.inertia, self.edges = machine, inertia, mesh.edges
        self.phi, self.cycle = mesh.phi.ravel(), float(mesh.edges[-1])
        self.weights = cells.node_weights(mesh)
        self.speeds = np.linspace(0.0, 1.02 * fastest, _SPEEDS)
        self.spacing = float(self.speeds[1])
        self.nodes: list[tuple[list[float], float] | None] = [None] * self.phi.size
        self.ahead = 1

    def at(self, node: int) -> tuple[list[float], float]:
        """The net moments (N m) at all speeds at a node, and the inertia there (kg m²)."""
        known = self.nodes[node]
        if known is not None:
            return known
        first = node // cells.ORDER
        mesh = cells.cells(self.edges[first : first + self.ahead + 1])
        self.ahead *= 2
        moments = Moments(self.machine, mesh, local=True)
        at_speeds = np.maximum(self.speeds, ONSET * self.machine.typical_speed)[:, None, None] + np.zeros(mesh.phi.shape)
        states = () if moments.circuit is None else moments.circuit.steady(moments.drive_ratio * at_speeds)
        moment = moments.rate(at_speeds, 0.0, self.inertia, states).moment
        rows = zip(moment.reshape(_SPEEDS, -1).T.tolist(), (moments.inertia.ravel() + self.inertia).tolist(), strict=True)
        self.nodes[first * cells.ORDER : first * cells.ORDER + mesh.phi.size] = rows
        return self.at(node)

    def followed(
        self, place: float, energy: float, level: float, lasting: float
    ) -> tuple[Array, Array, float, float, float, bool | None, float | None]:
        """Follows the motion from a place and an energy to a speed (rad/s), a time (s), or a standstill.

        Gives the time of each step (s), its first and last speed (rad/s); place, energy and way at the end; whether the
        speed or time was reached (None: not within the turns that are followed), and the place of a standstill.
        """
        weights, count, spacing = self.weights.tolist(), self.phi.size, self.spacing
        node = int(np.searchsorted(self.phi, place % self.cycle)) % count
        times, speeds, clock, way = list[float](), list[tuple[float, float]](), 0.0, 0.0
        omega = math.sqrt(2.0 * energy / self.at(node)[1])
        done: bool | None = omega >= level or lasting <= 0.0
        stop, before = None, energy
        for k in range(0 if done else math.ceil(count * _MOST_TURNS * 2 * math.pi / self.cycle)):
            row, total = self.nodes[node] or self.at(node)
            half, weight = 0.5 * total, weights[node]
            omega = math.sqrt(energy / half)
            below = min(int(omega / spacing), _SPEEDS - 2)
            slope = (row[below + 1] - row[below]) / spacing
            moment = row[below] + slope * (omega - below * spacing)
            linear, square = 0.5 * weight * slope, energy + weight * (moment - 0.5 * slope * omega)
            under = linear * linear + 4.0 * half * square
            after = (linear + math.sqrt(under)) / (2.0 * half) if under >= 0.0 else 0.0
            if after <= 0.0:
                stop = float(self.phi[node])
                break
            step = 2.0 * weight / (omega + after)
            part = min(1.0, (level - omega) / (after - omega) if after > level else 1.0, (lasting - clock) / step)
            energy = half * (omega + part * (after - omega)) ** 2
            times.append(part * step)
            speeds.append((omega, omega + part * (after - omega)))
            clock, way, node = clock + part * step, way + part * weight, (node + 1) % count
            if after >= level or clock >= lasting:
                done = True
                break
            if (k + 1) % count == 0:
                if math.isinf(lasting) and energy - before <= _SAME_SPEED * energy:
                    break
                before = energy
        else:
            done = done or None
        return np.array(times), np.array(speeds).reshape(-1, 2), float(self.phi[node]), energy, way, done, stop


# -- its heat along a motion -------------------------------------------------------------------------------------------


class StartHeat(NamedTuple):
    """Load of a start on its motor, from switching on to the rated speed in its last connection.

    Args:
        title: kind of start.
        times: of its switches, s.
        time: its duration, s.
        over: true if it reached that speed; else the figures are those of the whole motion.
        current_squared: integral of (I/I_n)² dt of the windings, s; None without a rated current to relate to.
        winding: heat in the rotor of an induction motor or the armature of a DC motor itself, J.
        added: heat in added resistors, J.
        stator: copper heat of an induction motor's stator, J; None if the plate does not give it.
        allowed: (I_L/I_n)² times the time for which the warm motor bears the current I_L of its locked rotor, s.
        allowed_cold: the same of the cold motor, s.
        rise: of the temperature of the windings in it, K; None if the motor's data do not give it.

    """

    title: str
    times: tuple[float, ...]
    time: float
    over: bool
    current_squared: float | None
    winding: float
    added: float
    stator: float | None
    allowed: float | None
    allowed_cold: float | None
    rise: float | None = None

    @property
    def share(self) -> float | None:
        """Load of the start over the limit of the warm motor."""
        return _ratio(self.current_squared, self.allowed)

    @property
    def share_cold(self) -> float | None:
        """Load of the start over the limit of the cold motor."""
        return _ratio(self.current_squared, self.allowed_cold)

    @property
    def starts(self) -> int | None:
        """Permissible number of such starts in succession of the warm motor."""
        return None if self.share is None else math.floor(1.0 / self.share + _WHOLE_START)

    @property
    def starts_cold(self) -> int | None:
        """Permissible number of such starts of the cold motor."""
        return None if self.share_cold is None else math.floor(1.0 / self.share_cold + _WHOLE_START)

    def as_dict(self) -> dict[str, Any]:
        """All figures for JSON, SI throughout."""
        names = ("share", "share_cold", "starts", "starts_cold")
        return {**self._asdict(), "times": list(self.times), **{name: getattr(self, name) for name in names}}

    def errors(self, before: StartHeat | None, share: float, relative: float) -> dict[str, float | None]:
        """Errors of its figures: `share` of the difference to the previous run, and a relative error of the motion."""
        names = ("time", "current_squared", "winding", "added", "stator", "share", "share_cold", "rise")
        errors: dict[str, float | None] = {}
        for name in names:
            now, then = getattr(self, name), None if before is None else getattr(before, name)
            errors[name] = None if now is None or then is None else share * abs(now - then) + relative * abs(now)
        return errors


def _ratio(part: float | None, whole: float | None) -> float | None:
    return None if part is None or whole is None else part / whole


def start_heat(trail: Trail) -> StartHeat | None:
    """The heat of the start that a motion begins with; None for other motors than induction and DC, and with own states.

    Heat given to the surroundings meanwhile is neglected, so the figures hold for starts of some
    seconds. The start ends at the rated speed after the last switch, where the current falls to the rated one.

    With t_L the permissible time of the locked rotor, the limit is (I_L/I_n)² t_L, and a start that takes a
    share q of that may follow another 1/q times. Source: IEC 60079-7 and IEEE 620 (time of the locked rotor, I² t as a
    thermal limit); NEMA MG 1, part 12 (two starts of a cold motor, one of a warm one).
    """
    motor, ratio = trail.dynamics.machine.scene.motor, trail.dynamics.ratio
    if motor is None or trail.dynamics.circuit is not None or not trail.stretches:
        return None
    running = as_started(motor)
    own = running.own
    if own.heated is None:
        return None
    rated = None if own.rated is None else trail.time_to(own.rated.speed / ratio)
    over = rated is not None and len(running.times) >= len(running.connections)
    end = max([rated or 0.0, *running.times]) if over else float(trail.t[-1])
    if not end > 0.0:
        return None  # it begins faster than that
    squared, winding, added, rise = _integrals(trail, running, end)
    certain, stator = squared is not None and own.current_share(0.0) is not None, own.rated_stator_heat
    title = "direct on line" if own.start is None else own.start.title
    return StartHeat(
        title=title,
        times=running.times,
        time=min(end, float(trail.t[-1])),
        over=over,
        current_squared=squared if certain else None,
        winding=winding,
        added=added,
        stator=None if stator is None or squared is None else stator * squared,
        allowed=own.locked_rotor_limit(),
        allowed_cold=own.locked_rotor_limit(cold=True),
        rise=rise,
    )


def _integrals(trail: Trail, running: Started, end: float) -> tuple[float | None, float, float, float | None]:
    """Integrals over time up to an end (s): of the windings' current over the rated one squared (s), of both heats (J).

    And the rise of the windings' temperature, K.
    """
    times, owners, lasting = trail.gauss(end)
    omega = trail.dynamics.ratio * trail.states(times, owners)[1]
    within = trail.anchors(owners)[1].time
    current = running.windings_at(omega, times, within)
    heats = running.heat_at(omega, times, within), running.added_heat_at(omega, times, within)
    winding, added = (0.0 if heat is None else float(lasting @ heat) for heat in heats)
    rise, own = None, running.own
    if own.thermal is not None and heats[0] is not None:
        stator = 0.0 if current is None else (own.rated_stator_heat or 0.0) * current**2
        rise = rise_after(own.thermal, times, lasting, (heats[0] + stator) / own.rated_total_heat, end)
    return (None if current is None else float(lasting @ current**2)), winding, added, rise


# -- what trips an inverter ----------------------------------------------------------------------------------------------


def inverter_trips(trail: Trail) -> tuple[Trip, ...]:
    """Causes that trip a motor's inverter along a motion, each at its first time; empty for other drives."""
    dynamics = trail.dynamics
    motor = dynamics.machine.scene.motor
    running = None if motor is None else as_started(motor)
    inverter = None if running is None else running.own.inverter
    if running is None or inverter is None or not trail.stretches:
        return ()

    def figures(times: Array, owners: Index) -> tuple[Array, Array]:
        """Current over the rated one, and power (W) that the motor returns."""
        states = trail.states(times, owners)
        omega, within = dynamics.ratio * states[1], trail.anchors(owners)[1].time
        if dynamics.circuit is not None:
            own, rated = tuple(states[3 : 3 + len(dynamics.circuit.names)]), running.own.rated_current
            taken = running.own.input_power(omega, dynamics.circuit.torque(omega, own), own)
            current = dynamics.circuit.current(omega, own)
            return (np.zeros_like(taken) if current is None or rated is None else current / rated), -taken
        returned = -running.input_power_at(omega, times, within)
        share = running.windings_at(omega, times, within)
        return (np.zeros_like(returned) if share is None else share), returned

    times, owners = trail.within(NODES)
    rows, trips = figures(times, owners), list[Trip]()
    for k, (kind, limit) in enumerate(inverter.limits):
        beyond = np.flatnonzero(rows[k] > limit + k * _NO_POWER * float(np.abs(rows[1]).max()))
        if not beyond.size:
            continue
        first = int(beyond[0])
        owner, before, at = owners[first : first + 1], float(times[first - 1]) if first else 0.0, float(times[first])

        def above(t: float, owner: Index = owner, k: int = k, limit: float = limit) -> float:
            return float(figures(np.array([t]), owner)[k][0]) - limit

        if before < at and above(before) < 0.0:  # equal on both sides of a switch
            at = root(above, before, at)
        phi = float(trail.states(np.array([at]), owner)[0, 0])
        trips.append(Trip(kind, float(rows[k].max()), limit, phi, at))
    return tuple(trips)
