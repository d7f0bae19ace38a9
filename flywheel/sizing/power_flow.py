"""Power flow of a steady cycle: from the motor's input through every mesh to the loads, with every loss and every store.

At each angle phi the crank turns at omega with the acceleration alpha. The parts connected to shaft s, reduced to the crank,
have the inertia I_s and the moment M_s, so that the moment which enters it is

    tau_s = I_s alpha + ½ dI_s/dphi omega² - M_s + sum over the shafts c that mesh with s of k_c tau_c,

where k_c = 1/eta_c while power goes outwards through that mesh (tau_c > 0), else eta_c, and tau = 0 at the crank. Every part
of that, times omega, is a power: of loads, of the drive, of drags, dampers and friction, of stores (inertias, springs and
weights), of a mesh, (k_c - 1) tau_c omega. In a mesh of efficiency eta and slip s the share s of the power that enters is
lost by slip, and (1 - s)(1 - eta) of it by friction of teeth or belt. Works are integrals over phi, mean powers works over
the period; the mean of stored power is zero.

Sources: J. L. Meriam and L. G. Kraige, Engineering Mechanics: Dynamics, chapter 6 (power); Fitzgerald et al., Electric
Machinery, 6th ed., chapters 6 and 7 (from the mains through a motor); M. Schmidt, The Sankey diagram in energy and material
flow management, Journal of Industrial Ecology 12 (2008), for its picture.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from flywheel.components.load_models import is_loss
from flywheel.machine.machine import FRICTION, Machine
from flywheel.numerics import cells
from flywheel.numerics.cells import MIDDLE, ROUNDING, Array, Cells, Coarse, wide
from flywheel.regime import turning_moment
from flywheel.scene.scene import Scene
from flywheel.sizing.findings import speed_error_over_cycle
from flywheel.sizing.motor import SPEED_STEP, states_on
from flywheel.sizing.results import HEATS, PowerFlow, ShaftFlow, Sizing, Stream

__all__ = ["power_flow"]

_MOST_CELLS = 2_000  # of the powers, in addition to those of the cycle itself


class _Power(NamedTuple):
    """One power: from where to where, and its moment on the crank (N m, cells and nodes)."""

    source: str
    target: str
    kind: str
    name: str
    on: str
    moment: Array


class _Flows(NamedTuple):
    """All powers on a mesh: the moment into each shaft through its mesh (N m, on the crank), and the crank's residual."""

    mesh: Cells
    omega: Array
    parts: list[_Power]
    passed: dict[str, Array]
    missing: Array
    exchanged: Array

    @property
    def moments(self) -> Array:
        """The moments of all parts, (parts, cells, nodes)."""
        return np.array([part.moment for part in self.parts]).reshape(len(self.parts), *self.omega.shape)


@np.errstate(all="ignore")  # a result asks for it after its sizing is over
def power_flow(sizing: Sizing) -> PowerFlow | None:
    """The power flow of a sizing or an analysis, along its steady motion; None for a scene of areas, or an endless cycle.

    Powers are computed at the nodes of the motion's cells, halved where works are not within its rtol yet.

    >>> import flywheel
    >>> press = {"shafts": {"motor": {"ratio": 8, "efficiency": 0.9}},
    ...          "load": [{"on": "crank", "torque": "-90 N m", "from": 0, "to": "180 deg"}],
    ...          "drive": {"on": "motor", "torque": "balance"}, "regime": {"speed": 10},
    ...          "inertia": [{"on": "crank", "value": 0.5}], "flywheel": {"irregularity": 0.02}}
    >>> flow = flywheel.power_flow(flywheel.size(flywheel.load(press), simulate=False))
    >>> round(flow.efficiency, 9), [(stream.kind, round(stream.mean / flow.input, 6)) for stream in flow.streams[:3]]
    (0.9, [('drive', 1.0), ('shaft', 0.9), ('mesh', 0.1)])
    """
    machine, cycle = sizing.machine, sizing.cycle
    if machine is None or cycle is None or not np.isfinite(_period(sizing)[0]):
        return None
    train = _Train(sizing, machine)

    def evaluated(edges: Array) -> tuple[tuple[_Flows, float, float], float, Coarse]:
        powers = train.flows(cells.cells(edges))
        half = powers.mesh.half
        rows = powers.moments
        exchanged = float(cells.integral(powers.exchanged, half).sum()) or 1e-300
        tails = cells.TAIL_OF_INTEGRAL * cells.tails(cells.fit(rows)) * half[:, 0]
        shares = tails / np.maximum(cells.integral(np.abs(rows), half).sum(axis=-1), exchanged)[:, None]
        worst = shares.max(axis=0, initial=0.0)
        return (powers, exchanged, float(worst.sum())), float(worst.sum()), cells.above(worst, 0.1)

    first = cycle.mesh.edges
    powers, exchanged, missed = cells.refined(first, evaluated, sizing.rtol, max(_MOST_CELLS, 2 * first.size))
    return _result(sizing, train, powers, exchanged, missed)


class _Train:
    """The shafts of a machine with the parts connected to each, and its steady motion."""

    def __init__(self, sizing: Sizing, machine: Machine) -> None:
        scene = machine.scene
        self.sizing, self.machine, self.scene = sizing, machine, scene
        self.unknown = sizing.cycle.balance or 0.0 if sizing.cycle is not None else 0.0
        on_shafts = machine.one_ports
        self.outwards = [name for name in scene.shafts if name != "crank"]  # nearer ones first
        self.reductions = {
            name: machine.reduction.part(on_shafts[name]) if len(on_shafts) > 1 else machine.reduction
            for name in ("crank", *self.outwards)
            if on_shafts.get(name)
        }
        self.flywheel = 0.0 if sizing.run is None else sizing.run.inertia
        self.fixed = {
            name: sum(item.value for item in scene.inertias if item.on == name) * ratio * ratio
            for name, ratio in scene.shafts.items()
        }
        self.loads = {effort.path: effort.load for effort in machine.efforts}
        self.springs = {spring.path: spring.on for spring in scene.springs}
        self.dampers = {f"{damper.path} on {damper.on}": damper for damper in scene.dampers}

    def motion(self, mesh: Cells) -> tuple[Array, Array]:
        """Speed (rad/s) and acceleration (rad/s²) of the crank at the nodes."""
        sizing, cycle = self.sizing, self.sizing.cycle
        assert cycle is not None
        if sizing.run is None:
            return np.full(mesh.phi.shape, sizing.speed), np.zeros(mesh.phi.shape)
        omega = turning_moment.speed_over_cycle(cycle, sizing.speed, sizing.run, mesh.phi)
        alpha = turning_moment.acceleration_over_cycle(cycle, sizing.run, mesh.phi, omega)
        return omega, np.where(np.isfinite(alpha), alpha, 0.0)  # of a machine without inertia

    def flows(self, mesh: Cells, faster: float = 1.0) -> _Flows:
        """All powers at the nodes, with the crank `faster` by a factor close to 1."""
        scene, (omega, alpha) = self.scene, self.motion(mesh)
        omega = omega * faster
        shape, none = omega.shape, np.zeros(omega.shape)
        parts: list[_Power] = []
        entering: dict[str, Array] = {}
        missing, exchanged = none, none
        for name in (*reversed(self.outwards), "crank"):  # farther ones first
            place, own = f"shafts.{name}", none
            for part in self._on(name, mesh, omega, alpha):
                parts.append(part._replace(moment=wide(part.moment, shape)))
                own = own + part.moment * ((part.source == place) - float(part.target == place))
                if part.kind != "stored" and place in (part.source, part.target):
                    exchanged = exchanged + np.abs(part.moment)
            for other in self.outwards:
                if scene.near(other) == name:
                    own = own + self._meshed(other, entering[other]) * entering[other]
            entering[name] = own
            missing = own
        for name in self.outwards:
            parts += self._through(name, entering[name], mesh)
        return _Flows(mesh, omega, parts, entering, missing, exchanged)

    def _on(self, name: str, mesh: Cells, omega: Array, alpha: Array) -> Iterator[_Power]:
        """Moments on a shaft: taken by its loads, given by its drive, stored by its inertias."""
        place, wheel = f"shafts.{name}", self.flywheel if self.scene.flywheel_on == name else 0.0
        if wheel:
            yield _Power(place, "flywheel", "stored", "flywheel", name, wheel * alpha)
        reduction = self.reductions.get(name)
        if reduction is None:
            return
        station = reduction.at(mesh.phi, mesh.anchor)
        reduced, fixed = station.reduced, self.fixed[name]
        if fixed:
            yield _Power(place, f"{place}.inertia", "stored", f"{place}.inertia", name, fixed * alpha)
        if self.scene.mechanisms:
            moved = (reduced.inertia - fixed) * alpha + 0.5 * reduced.slope * omega * omega
            if np.any(moved):
                yield _Power(place, f"{place}.masses", "stored", f"{place}.masses", name, moved)
        moments = station.moments(self.unknown, by_name=True)
        middle = omega[:, MIDDLE : MIDDLE + 1]
        for element, effort, factor in station.contributions(omega, 0.0, middle):
            moments[element.name] = moments.get(element.name, 0.0) + effort + self.unknown * factor
        weights: Any = 0.0
        for path, moment in moments.items():
            if path in self.loads:
                yield from self._acting(path, place, moment, mesh, omega)
            elif path == FRICTION:
                yield _Power(place, "heat", "friction", FRICTION, name, -moment)
            elif path in self.springs:
                yield _Power(place, path, "stored", path, self.springs[path], -moment)
            else:
                weights = weights + moment
        if np.any(weights):
            yield _Power(place, "gravity", "stored", "gravity", name, -weights)
        for label, resistance in station.resistances().items():
            damper = self.dampers[label]
            yield _Power(place, "heat", "damper", damper.path, damper.on, resistance * omega)

    def _acting(self, path: str, place: str, moment: Any, mesh: Cells, omega: Array) -> Iterator[_Power]:
        """A load, or the drive with its motor's power from the mains."""
        load = self.loads[path]
        if load.path == "drive":
            yield from self._drive(place, wide(moment, omega.shape), mesh, omega)
        elif load.path == f"{place}.drag":
            yield _Power(place, "heat", "drag", load.path, load.on, -moment)
        elif is_loss(load.model):
            yield _Power(place, "heat", "resistance", load.path, load.on, -moment)
        else:
            yield _Power(place, load.path, "load", load.path, load.on, -moment)

    def _drive(self, place: str, moment: Array, mesh: Cells, omega: Array) -> Iterator[_Power]:
        """The drive on its shaft; for motors of known heat also that, and the power from the mains."""
        scene, run = self.scene, self.sizing.run
        assert scene.drive is not None
        ratio = scene.shafts[scene.drive.on]
        if run is not None and run.states and run.drive is not None and run.cycle is not None:
            moment = cells.interpolated(run.drive, run.cycle.mesh, mesh.phi)  # the current is a state of its own
        yield _Power("drive", place, "drive", "drive", scene.drive.on, moment)
        own = () if run is None else states_on(run, mesh)
        powers = {} if scene.motor is None else scene.motor.powers(ratio * omega, moment / ratio, own)
        taken = moment
        for kind, power in powers.items():
            heat = power / omega
            taken = taken + heat
            target = "heat" if kind in HEATS else f"drive.{kind}"
            yield _Power("drive", target, kind if kind in HEATS else "stored", f"drive.{kind}", scene.drive.on, heat)
        if powers:
            yield _Power("mains", "drive", "input", "drive", scene.drive.on, taken)

    def _meshed(self, name: str, entering: Array) -> Array | float:
        """Torque given by the nearer shaft for each N m that enters this one, decided in the middle of each cell."""
        efficiency = self.scene.efficiencies.get(name, 1.0)
        if efficiency == 1.0:
            return 1.0
        return np.where(entering[:, MIDDLE : MIDDLE + 1] > 0.0, 1.0 / efficiency, efficiency)

    def passes_inwards(self, name: str, entering: Array, half: Array) -> bool:
        """Tests whether a mesh passes power to the nearer shaft on average, by more than rounding."""
        passed = cells.integral((self._meshed(name, entering) + 1.0) * entering, half)
        return float(passed.sum()) < -cells.TIE * float(np.abs(passed).sum())

    def _through(self, name: str, entering: Array, mesh: Cells) -> Iterator[_Power]:
        """Power through a shaft's mesh, from the shaft that gives on average to the one that takes, and the loss."""
        scene, here, there = self.scene, f"shafts.{name}", f"shafts.{self.scene.near(name)}"
        power = self._meshed(name, entering) * entering
        lost = power - entering
        inwards = self.passes_inwards(name, entering, mesh.half)
        source, target, arriving = (here, there, -power) if inwards else (there, here, entering)
        yield _Power(source, target, "shaft", here, name, arriving)
        slip = scene.transmissions[name].slip if name in scene.transmissions else 0.0
        efficiency = scene.efficiencies.get(name, 1.0)
        by_slip = slip / (1.0 - efficiency) if slip else 0.0  # of what is lost: slip of what enters
        if slip:
            yield _Power(source, "heat", "slip", here, name, by_slip * lost)
        if efficiency < 1.0 - slip * (1.0 + 4 * ROUNDING):
            yield _Power(source, "heat", "mesh", here, name, (1.0 - by_slip) * lost)


def can_lose(scene: Scene) -> bool:
    """Tests whether a scene may lose power: meshes, dampers, joints, models of losses, a motor with known heat."""
    drags = any(is_loss(load.model) or load.path.endswith(".drag") for load in scene.loads)
    meshes = any(efficiency < 1.0 for efficiency in scene.efficiencies.values())
    if drags or meshes or scene.rubs or scene.dampers or scene.motor is None:
        return drags or meshes or scene.rubs or bool(scene.dampers)
    return scene.motor.takes_power


# -- the result --------------------------------------------------------------------------------------------------------


def _result(sizing: Sizing, train: _Train, powers: _Flows, exchanged: float, missed: float) -> PowerFlow:
    """Streams, shafts and the balance, from the powers at the nodes."""
    mesh, omega, half = powers.mesh, powers.omega, powers.mesh.half
    period, of_period = _period(sizing)
    rows = powers.moments
    works, sizes = (cells.integral(each, half).sum(axis=-1) for each in (rows, np.abs(rows)))
    error = _error(sizing, train, powers, exchanged, missed) + of_period
    works = np.where(np.abs(works) > error * np.maximum(sizes, exchanged), works, 0.0)
    series = cells.fit(rows * omega)
    turned = [part.kind in ("load", "drive", "input") and w < 0.0 for part, w in zip(powers.parts, works, strict=True)]
    signs = np.where(turned, -1.0, 1.0)
    works, series = signs * works, signs[:, None, None] * series
    streams = []
    for part, turn, work, one in zip(powers.parts, turned, works.tolist(), series, strict=True):
        source, target = (part.target, part.source) if turn else (part.source, part.target)
        high, low = _extremes(one, error, exchanged / period)
        streams.append(Stream(source, target, part.kind, part.name, part.on, work / period, work, high, low))
    order = sorted(range(len(streams)), key=lambda k: _ORDER.index(streams[k].kind))
    streams = [streams[k] for k in order]
    shafts = {f"shafts.{name}" for name in train.scene.shafts}
    electric = any(stream.kind == "input" for stream in streams)
    ends = [s for s in streams if s.kind in ("load", "input" if electric else "drive")]
    input_power = sum(s.mean for s in ends if s.target in shafts or (s.kind == "input" and s.target == "drive"))
    taken = sum(s.mean for s in ends) - input_power
    losses = sum(s.mean for s in streams if s.lost)
    scale = exchanged / period
    return PowerFlow(
        scene=train.scene,
        streams=tuple(streams),
        shafts=tuple(_shafts(sizing, train, powers, period)),
        period=period,
        input=input_power,
        output=taken,
        losses=losses,
        left=input_power - taken - losses,
        scale=scale,
        error=error,
        mesh=mesh,
        series=series[order],
    )


def _extremes(series: Array, error: float, scale: float) -> tuple[float, float]:
    """The greatest and the least power, 0 if that is no more than its error."""
    least, greatest = cells.extents(series)
    high, low = float(greatest.max()), float(least.min())
    tiny = error * max(high, -low, scale)
    return (high if abs(high) > tiny else 0.0), (low if abs(low) > tiny else 0.0)


_ORDER = ("input", *HEATS, "drive", "shaft", "slip", "mesh", "drag", "damper", "friction", "resistance", "load", "stored")


def _period(sizing: Sizing) -> tuple[float, float]:
    """Time of a cycle (s), and its relative error."""
    cycle = sizing.cycle
    assert cycle is not None
    if sizing.run is None:
        return sizing.scene.cycle / sizing.speed, 4 * ROUNDING
    return turning_moment.period(cycle, sizing.speed, sizing.run, sizing.rtol)


def _shafts(sizing: Sizing, train: _Train, flows: _Flows, period: float) -> Iterator[ShaftFlow]:
    """Every shaft with its speed, and the torque and power of its mesh on its own side."""
    scene, half, omega = train.scene, flows.mesh.half, flows.omega
    irregularity = 0.0 if sizing.run is None else sizing.run.irregularity
    for name in ("crank", *train.outwards):
        ratio = scene.shafts[name]
        speeds = ratio * sizing.speed, ratio * scene.cycle / period, irregularity
        if name == "crank":
            yield ShaftFlow(name, None, None, ratio, *speeds)
            continue
        near, moment = scene.near(name), flows.passed[name]
        inwards = train.passes_inwards(name, moment, half)
        moment = -moment if inwards else moment
        torque, power = moment / ratio, moment * omega
        yield ShaftFlow(
            name,
            near,
            near if inwards else name,
            ratio,
            *speeds,
            torque_mean=float(cells.integral(torque / omega, half).sum()) / period,
            torque_greatest=cells.largest(cells.fit(torque)),
            torque_rms=float(np.sqrt(cells.integral(torque * torque / omega, half).sum() / period)),
            power_mean=float(cells.integral(moment, half).sum()) / period,
            power_greatest=cells.largest(cells.fit(power)),
            power_rms=float(np.sqrt(cells.integral(power * moment, half).sum() / period)),
        )


def _error(sizing: Sizing, train: _Train, powers: _Flows, exchanged: float, missed: float) -> float:
    """Relative error of all powers: by cells, rounding, the crank's residual, and the speed's own error."""
    cycle, machine, half = sizing.cycle, train.machine, powers.mesh.half
    assert cycle is not None
    off = cycle.errors.net + cycle.errors.residual + (0.0 if machine.friction is None else 2 * machine.friction.error)
    off += float(cells.integral(np.abs(powers.missing), half).sum())
    rows = powers.moments * powers.omega
    series = cells.fit(rows)
    sizes = np.maximum(np.abs(rows).max(axis=(1, 2)), exchanged / sizing.scene.cycle * sizing.speed)
    between = float((cells.tails(series).max(axis=-1) / np.maximum(sizes, 1e-300)).max(initial=0.0))
    meshes = [k for k, part in enumerate(powers.parts) if part.kind in ("mesh", "slip")]
    for k in meshes:  # what a mesh seems to gain beside the angle at which its power changes its sense
        between += 2.0 * max(0.0, -float(cells.extents(series[k])[0].min())) / max(float(sizes[k]), 1e-300)
    of_speed = speed_error_over_cycle(sizing)
    error = missed + off / exchanged + between + 24 * ROUNDING + 3 * of_speed
    if machine.depends_on_speed:
        beside = train.flows(powers.mesh, 1.0 + SPEED_STEP)
        moved = np.abs(beside.moments - powers.moments) / SPEED_STEP
        error += float(((moved * powers.omega).max(axis=(1, 2)) / np.maximum(sizes, 1e-300)).max(initial=0.0)) * of_speed
    return error
