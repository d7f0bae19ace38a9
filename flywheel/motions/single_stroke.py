"""What a machine that works stroke by stroke asks of its flywheel, clutch, brake and motor (`single_stroke`)."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from bondgraph.numerics import root, summits
from flywheel.machine.dynamics import NODES, Trail
from flywheel.machine.machine import Machine
from flywheel.motions.motion import works_of
from flywheel.motions.strokes import BRAKE, NAME, Phases, Strokes, check, periodic
from flywheel.numerics.cells import Array
from flywheel.numerics.faults import Fault, SceneError
from flywheel.regime.state import DRIVE
from flywheel.scene.scene import TURN, Scene

_TIGHT, _LOOSE = 1e-10, 1e-8  # tolerances of the steps: of the figures, and of those that they are compared with
_RATE = 1e-4  # relative, to which the greatest rate is found
_RECOVERED = 0.95  # of the drop of speed: what counts as recovered
_MOST = 40  # times that a period is lengthened
_ENOUGH = 100.0  # steps, the errors of which add up
_TIME = "time of the stroke"
_HOUR = 3600.0
_SAFETY = 2.0
_LARGEST = 1e9  # kg m², of a flywheel that is looked for


@dataclass(frozen=True)
class SingleStroke:
    """One stroke among many alike, with the flywheel given or found. SI: s, rad, rad/s at the flywheel's shaft, N m, J, W.

    `period` is the time from one engagement of the clutch to the next (of `continuous` strokes together). `keeps_up`: the
    motor is loaded within its rating (by the root of the torque's mean square and, where known, by its heat). `irregularity`
    is (greatest - least speed)/mean of the two. `slip_time` and `lock_angle` are those of the clutch, `clutch_torque` the
    greatest torque that it passes while it holds. `clutch_heat` and `brake_heat` are of one period. `brake_angle` is what
    the crank turns from the brake's application to rest, in `stopping_time`; `overrun` how far beyond `stop_at` it rests.
    `recovery_time` is that from the least speed until 95 % of the drop is made up. `greatest_rate` (1/s) is that at which
    `decides` comes to its limit. `error` holds absolute errors, `shares` the load of what has a limit, over that limit.
    `energy_residual`: the work of the motor less all heats and works of loads, over the work of the motor.
    """

    scene: Scene
    on: str
    inertia: float
    given: bool
    figures: Mapping[str, float | bool | str | None]
    shares: Mapping[str, float]
    energy: Mapping[str, float]
    error: Mapping[str, float]
    phases: Phases

    def __getattr__(self, name: str) -> Any:
        figures = self.__dict__.get("figures", {})
        if name in figures:
            return figures[name]
        raise AttributeError(name)

    @property
    def verdicts(self) -> tuple[str, ...]:
        """What is loaded beyond its limit, in words; empty where nothing is."""
        return tuple(f"{name}: {100 * share:.4g} % of its limit" for name, share in self.shares.items() if share > 1.0)

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        given, exact = (self.inertia, None) if self.given else (None, self.inertia)
        wheel = {"on": self.on, "inertia": given, "exact": exact}
        return {
            "title": self.scene.title,
            "flywheel": wheel,
            "single_stroke": {
                **self.figures,
                "shares": dict(self.shares),
                "energy": dict(self.energy),
                "verdicts": list(self.verdicts),
            },
            "error": {"single_stroke": dict(self.error)},
        }


def single_stroke(machine: Machine | Scene) -> SingleStroke:
    """The periodic stroke of a machine with clutch and brake, with its flywheel given, or sized for an irregularity.

    While the clutch slips it passes the torque T, whatever the speeds: J1 dw1/dt = M1 - T, J2 dw2/dt = M2 + T, and heats by
    T (w1 - w2). Two inertias that lock with nothing else acting lose J1 J2/(J1 + J2) (w1 - w2)²/2.

    Args:
        machine: a `Scene` with `[single_stroke]`, or its `Machine`.

    Raises:
        SceneError: for a stroke that does not go through, with where and when: a clutch that never locks or slips again, a
            machine that stalls, a brake that does not stop or hold the crank, a rate that leaves no time for the stroke.

    """
    scene = machine.scene if isinstance(machine, Machine) else machine
    if scene.single_stroke is None:
        raise SceneError([Fault("single_stroke", "nothing", "a table with rate or idle")])
    check(scene)
    if not scene.has_flywheel:
        raise SceneError([Fault("flywheel", "nothing", "a table with irregularity or inertia")])
    with np.errstate(all="ignore"):
        inertia = scene.inertia if scene.inertia is not None else _sized(scene)
        tight, loose = (_Run.of(Strokes(scene, inertia, rtol)) for rtol in (_TIGHT, _LOOSE))
        greatest, decides, off = _greatest_rate(Strokes(scene, inertia, _LOOSE), loose)
    figures = {**tight.figures, "greatest_rate": greatest, "decides": decides}
    shares = tight.shares
    error = {
        name: _SAFETY * abs(value - loose.figures[name]) + 1e-13 * abs(value)
        for name, value in tight.figures.items()
        if isinstance(value, float) and isinstance(loose.figures[name], float)
    }
    error["greatest_rate"] = off
    if scene.inertia is None:
        error["inertia"] = inertia * (_SIZED + _SAFETY * abs(tight.figures["irregularity"] / scene.irregularity - 1.0))
    return SingleStroke(
        scene, scene.flywheel_on, inertia, scene.inertia is not None, figures, shares, tight.energy, error, tight.phases
    )


# -- the figures of a stroke ------------------------------------------------------------------------------------------


class _Run(NamedTuple):
    """A periodic stroke with its figures, loads over their limits, and energies (J in a period)."""

    phases: Phases
    figures: dict[str, Any]
    shares: dict[str, float]
    energy: dict[str, float]

    @classmethod
    def of(cls, strokes: Strokes, period: float | None = None, guess: Phases | None = None) -> _Run:
        """The stroke of a machine that returns after a period (s)."""
        found = periodic(strokes, period, guess)
        energy = _energy(strokes, found)
        figures = _figures(strokes, found, energy)
        return cls(found, figures, _shares(strokes, found, figures), energy)


def _figures(strokes: Strokes, found: Phases, energy: Mapping[str, float]) -> dict[str, Any]:
    """All figures but the greatest rate."""
    plan, wheel = strokes.plan, strokes.wheel
    sides = _driving_sides(strokes, found)
    speeds = _speeds(sides)
    moments, _ = strokes.clutch_torques(found.locked)
    braking = found.braking
    mean, rms, peak = _motor_torques(strokes, sides, found.period)
    heat = _motor_heat(strokes, sides, found.period)
    hours = _HOUR / found.period
    return {
        "period": found.period,
        "rate": plan.continuous / found.period,
        "keeps_up": _keeps_up(strokes, rms, heat),
        "speed_greatest": speeds.greatest * wheel,
        "speed_least": speeds.least * wheel,
        "irregularity": speeds.irregularity,
        "slip_time": found.lock_time,
        "lock_angle": found.lock_angle,
        "clutch_torque": float(np.max(np.abs(moments))),
        "clutch_heat": energy["clutch_heat"],
        "clutch_heat_per_hour": energy["clutch_heat"] * hours,
        "brake_heat": energy["brake_heat"],
        "brake_heat_per_hour": energy["brake_heat"] * hours,
        "brake_angle": found.rest - float(braking.start.phi),
        "stopping_time": found.stop_time - found.brake_time,
        "overrun": found.rest - plan.stop_at - plan.continuous * TURN,
        "stroke_time": found.stop_time,
        "recovery_time": _recovery(sides, speeds, found),
        "mean_power": energy["motor"] / found.period,
        "motor_torque_mean": mean,
        "motor_torque_rms": rms,
        "motor_torque_peak": peak,
        "motor_heat": heat,
        "energy_residual": energy["residual"] / energy["motor"] if energy["motor"] else energy["residual"],
    }


_Side = tuple[Trail, float, float]
"""A motion of the driving side, what its speed is to be multiplied with to be the clutch shaft's, and when it begins (s)."""


def _driving_sides(strokes: Strokes, found: Phases) -> list[_Side]:
    """The driving side over a whole period; of the slip, what there is until the clutch locks."""
    return [
        (_until(found.driving, found.lock_time), 1.0, 0.0),
        (found.locked, strokes.ratio, found.lock_time),
        (found.recovery, 1.0, found.release_time),
    ]


def _until(trail: Trail, end: float) -> Trail:
    """A motion as far as a time (s)."""
    kept = [stretch for stretch in trail.stretches if stretch.step.start < end]
    step = kept[-1].step  # with the same dense output, to its new end
    kept[-1] = kept[-1]._replace(step=type(step)(step.dense, step.start, min(step.end, end)))
    return trail._replace(stretches=tuple(kept))


def _extreme(trail: Trail, sign: float, factor: float) -> tuple[float, float]:
    """Time (s) and value of the greatest (sign 1) or least (-1) speed of a motion."""
    times, owners = trail.within(NODES)
    speeds = sign * trail.states(times, owners)[1]
    best = int(speeds.argmax())
    mine = np.flatnonzero(owners == owners[best])
    low, high = times[max(best - 1, mine[0])], times[min(best + 1, mine[-1])]

    def values(grid: Array) -> Array:
        return np.asarray(sign * trail.states(grid.ravel(), np.full(grid.size, owners[best]))[1].reshape(grid.shape))

    finer = summits(values, np.array([low]), np.array([high]), 9, 12)
    place, height = float(finer.place[0]), float(finer.value[0])
    if speeds[best] >= height:
        place, height = float(times[best]), float(speeds[best])
    return place, sign * height * factor


class _Speeds(NamedTuple):
    """Greatest and least speed (rad/s) of the clutch's shaft in a period, and when (s) it is least."""

    greatest: float
    least: float
    when: float

    @property
    def irregularity(self) -> float:
        """Difference of the two over their mean."""
        return 2.0 * (self.greatest - self.least) / (self.greatest + self.least)


def _speeds(sides: list[_Side]) -> _Speeds:
    """The extremes of the driving side's speed."""
    greatest = max(_extreme(trail, 1.0, factor)[1] for trail, factor, _ in sides)
    bottoms = [(_extreme(trail, -1.0, factor), begin) for trail, factor, begin in sides]
    least, when = min((speed, time + begin) for (time, speed), begin in bottoms)
    return _Speeds(greatest, least, when)


def _recovery(sides: list[_Side], speeds_of: _Speeds, found: Phases) -> float:
    """The time (s) from the least speed until most of the drop is made up."""
    least, when = speeds_of.least, speeds_of.when
    level = least + _RECOVERED * (found.speed - least)
    for trail, factor, begin in sides:
        times, owners = trail.within(NODES)
        speeds = trail.states(times, owners)[1] * factor
        above = np.flatnonzero((speeds >= level) & (times + begin > when))
        if not above.size:
            continue
        k = int(above[0])
        if k == 0 or times[k - 1] + begin < when:
            return float(times[k]) + begin - when
        which = owners[k : k + 1]

        def over(t: float, trail: Trail = trail, factor: float = factor, which: Any = which) -> float:
            return float(trail.states(np.array([t]), which)[1, 0]) * factor - level

        low, high = float(times[k - 1]), float(times[k])
        return (low if over(low) >= 0.0 else root(over, low, high)) + begin - when
    return found.period - when


def _gauss(sides: list[_Side], ratio: float) -> tuple[Array, Array]:
    """Speeds of the motor (rad/s) over a period, and what each weighs (s); `ratio`: of its speed over the clutch shaft's."""
    speeds, weights = list[Array](), list[Array]()
    for trail, factor, _ in sides:
        times, owners, lasting = trail.gauss()
        speeds.append(trail.states(times, owners)[1] * factor * ratio)
        weights.append(lasting)
    return np.concatenate(speeds), np.concatenate(weights)


def _motor_ratio(strokes: Strokes) -> float:
    drive = strokes.scene.drive
    assert drive is not None
    return strokes.scene.shafts[drive.on] / strokes.ratio


def _torque(strokes: Strokes, speeds: Array) -> Array:
    """Torque of the drive (N m) at speeds of its shaft, rad/s."""
    if strokes.scene.motor is not None:
        return np.asarray(strokes.scene.motor.torque(speeds))
    drive = strokes.scene.drive
    assert drive is not None
    values = {**strokes.scene.parameters, "omega": speeds, "phi": 0.0, "x": 0.0, "v": speeds}
    return np.asarray(drive.law.evaluate(values, np, values)) + 0.0 * speeds  # type: ignore[union-attr]


def _motor_torques(strokes: Strokes, sides: list[_Side], period: float) -> tuple[float, float, float]:
    """Mean over time, root of the mean square, and greatest size of the drive's torque, N m."""
    ratio = _motor_ratio(strokes)
    speeds, weights = _gauss(sides, ratio)
    torques = _torque(strokes, speeds)
    extremes = [_extreme(trail, sign, factor)[1] * ratio for trail, factor, _ in sides for sign in (1.0, -1.0)]
    tops = np.abs(np.concatenate([torques, _torque(strokes, np.array(extremes))]))
    return float(weights @ torques) / period, math.sqrt(float(weights @ torques**2) / period), float(tops.max())


def _motor_heat(strokes: Strokes, sides: list[_Side], period: float) -> float | None:
    """The mean heat of the motor, W; None where its type does not tell."""
    motor = strokes.scene.motor
    if motor is None or motor.heated is None:
        return None
    speeds, weights = _gauss(sides, _motor_ratio(strokes))
    return float(weights @ np.asarray(motor.total_heat(speeds))) / period


def _keeps_up(strokes: Strokes, rms: float, heat: float | None) -> bool | None:
    """Whether a motor with a rated point is loaded within it; None where there is no such motor."""
    shares = _motor_shares(strokes, rms, heat)
    return all(share <= 1.0 for share in shares.values()) if shares else None


def _motor_shares(strokes: Strokes, rms: float, heat: float | None) -> dict[str, float]:
    motor = strokes.scene.motor
    if motor is None or motor.rated is None:
        return {}
    found = {"motor torque": rms / motor.rated.torque}
    if heat is not None:
        found["motor heat"] = heat / float(motor.total_heat(np.array(motor.rated.speed)))
    return found


def _shares(strokes: Strokes, found: Phases, figures: Mapping[str, Any]) -> dict[str, float]:
    """What has a limit, over that limit."""
    clutch, brake = strokes.clutch, strokes.brake
    shares = _motor_shares(strokes, figures["motor_torque_rms"], figures["motor_heat"])
    shares["clutch torque"] = figures["clutch_torque"] / clutch.static_torque
    for name, part in (("clutch", clutch), ("brake", brake)):
        if part.heat_per_stroke is not None:
            shares[f"{name} heat a stroke"] = figures[f"{name}_heat"] / part.heat_per_stroke
        if part.heat_per_hour is not None:
            shares[f"{name} heat an hour"] = figures[f"{name}_heat_per_hour"] / part.heat_per_hour
    shares[_TIME] = found.stop_time / found.period
    return shares


# -- energy ------------------------------------------------------------------------------------------------------------


def _energy(strokes: Strokes, found: Phases) -> dict[str, float]:
    """Works and heats of one period, J, and what is missing between them.

    By quadrature of every law over the motions apart from the stepping; the clutch's heat by the speeds of both its sides.
    """
    works: dict[str, float] = {}
    driving = _until(found.driving, found.lock_time)
    meshes = 0.0
    phases = [driving, found.slipping, found.locked, found.coasting, found.braking, found.recovery]
    for trail in phases:
        if trail is None:
            continue
        parts, lost, _ = works_of(trail)
        meshes += lost
        for part, work in parts.items():
            works[part] = works.get(part, 0.0) + work
    motor = works.pop(DRIVE, 0.0)
    brake = -sum(work for part, work in works.items() if part.startswith(BRAKE))
    works = {part: work for part, work in works.items() if not part.startswith((f"{NAME} on", BRAKE))}
    clutch = clutch_heat(strokes, driving, found.slipping)
    loads = -sum(works.values())
    energy = {"motor": motor, "loads": loads, "mesh_heat": meshes, "clutch_heat": clutch, "brake_heat": brake}
    return {**energy, "residual": motor - loads - meshes - clutch - brake}


def clutch_heat(strokes: Strokes, driving: Trail, slipping: Trail) -> float:
    """The integral of torque times slip, J, by Gauss' rule between all times at which either side or the torque changes."""
    rise, end = strokes.clutch.rise, float(slipping.t[-1])
    edges = np.unique(np.concatenate((driving.t, slipping.t, [rise])))
    edges = edges[edges <= end]
    nodes, weights = np.polynomial.legendre.leggauss(10)
    half = 0.5 * np.diff(edges)[:, None]
    times = (0.5 * (edges[:-1] + edges[1:])[:, None] + half * nodes).ravel()
    torque = strokes.clutch.torque * (np.ones_like(times) if rise == 0.0 else np.minimum(1.0, times / rise))
    slip = driving.states(times)[1] - strokes.ratio * slipping.states(times)[1]
    return float((half * weights).ravel() @ (torque * slip))


# -- searches ----------------------------------------------------------------------------------------------------------

_SIZED = 1e-8  # relative, to which a flywheel is found


def _sized(scene: Scene) -> float:
    """The smallest flywheel (kg m² at its own shaft) with which the irregularity is that asked for."""
    asked = scene.irregularity
    if asked is None:
        raise SceneError([Fault("flywheel", "no irregularity", "irregularity or inertia")])
    last: list[SceneError] = []
    begin: list[Phases] = []  # the last stroke that returns, from which the next is looked for
    known: dict[float, float] = {}

    def above(inertia: float) -> float:
        """The irregularity beyond what is asked, relative; infinite where the stroke does not go through."""
        if inertia not in known:
            tried = Strokes(scene, inertia, _TIGHT)
            try:
                found = periodic(tried, guess=begin[0] if begin else None)
            except SceneError as error:
                last[:], begin[:] = [error], []
                known[inertia] = math.inf
            else:
                begin[:] = [found]
                known[inertia] = _speeds(_driving_sides(tried, found)).irregularity / asked - 1.0
        return known[inertia]

    strokes = Strokes(scene, 1.0, _LOOSE)
    own = float(strokes.driving.at(math.pi, math.pi, strokes.typical * strokes.ratio, 0.0).inertia) - strokes.wheel**2
    crank = float(strokes.driven.at(0.0, 0.0, strokes.typical, 0.0).inertia)
    low = high = max(own, crank / strokes.ratio**2) / strokes.wheel**2
    if own > 0.0 and above(0.0) <= 0.0:
        return 0.0
    while above(high) > 0.0:
        low, high = high, 4.0 * high
        if high > _LARGEST:
            last = last or [SceneError([Fault("flywheel.irregularity", f"{asked:.4g}", "one that a flywheel keeps")])]
            raise last[0]
    while above(low) <= 0.0:
        low = 0.25 * low
    while math.isinf(above(low)):  # the least flywheel that carries the stroke through
        middle = math.sqrt(low * high)
        low, high = (middle, high) if above(middle) > 0.0 else (low, middle)
        if high / low < 1.0 + _SIZED:
            return high
    return _secant(above, low, high)


def _secant(value: Callable[[float], float], low: float, high: float) -> float:
    """The place at which a falling value of a positive number is 0, by 1/x, to a relative width."""
    of_low, of_high = value(low), value(high)
    for _ in range(60):
        share = of_low / (of_low - of_high)
        middle = 1.0 / (1.0 / low + share * (1.0 / high - 1.0 / low))
        found = value(middle)
        if abs(found) <= _SIZED or high / low - 1.0 <= _SIZED:
            return middle
        if found > 0.0:
            low, of_low, of_high = middle, found, 0.5 * of_high
        else:
            high, of_high, of_low = middle, found, 0.5 * of_low
    return high


def _greatest_rate(strokes: Strokes, run: _Run) -> tuple[float, str, float]:
    """The greatest rate (1/s) that everything bears, what decides it, and its error; all by the time between engagements.

    That is the rate without a standstill, unless something else comes to its limit before.
    """
    count, known = strokes.plan.continuous, dict[float, tuple[float, str]]()

    def worst(period: float) -> tuple[float, str]:
        """The load that is greatest over its limit, less 1, and what bears it; infinite where the stroke fails."""
        if period not in known:
            try:
                shares = _Run.of(strokes, period, run.phases).shares
                del shares[_TIME]
                name = max(shares, key=lambda each: shares[each])
                known[period] = shares[name] - 1.0, name
            except SceneError as error:
                known[period] = math.inf, f"{error.faults[0].path}: {error.faults[0].found}"
        return known[period]

    over, name = worst(0.0)
    if over <= 0.0:
        least = periodic(strokes, 0.0, run.phases).period
        return count / least, _TIME, _SAFETY * _ENOUGH * _LOOSE * count / least
    low, high = run.phases.stop_time, run.phases.period
    for _ in range(_MOST):
        if worst(high)[0] <= 0.0:
            break
        low, high = high, 1.5 * high
    else:
        return 0.0, worst(high)[1], 0.0
    while high / low - 1.0 > _RATE:
        (of_low, _), (of_high, _) = worst(low), worst(high)
        share = 0.5 if math.isinf(of_low) else min(max(of_low / (of_low - of_high), 0.05), 0.95)
        middle = low + share * (high - low)
        found, name = worst(middle)
        if abs(found) <= _RATE:
            low = high = middle
        else:
            low, high = (middle, high) if found > 0.0 else (low, middle)
    name = worst(low)[1]
    return count / high, name, count / low - count / high + 2.0 * _RATE * count / high
