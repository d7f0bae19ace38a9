"""The machine at a constant speed: the net work of a cycle, the speeds at which it is zero, and the cycle.

The approximate figures take torques at this speed, and the iteration for the true motion starts from here. Causes that
prevent a steady speed appear here first, and are named.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from bondgraph.numerics import root, summit, threshold
from flywheel.machine.equation import Moments, Rate, moments_on, undefined
from flywheel.machine.machine import Machine
from flywheel.numerics import cells
from flywheel.numerics.budget import spend
from flywheel.numerics.cells import Array
from flywheel.numerics.faults import Fault, SceneError
from flywheel.regime import turning_moment
from flywheel.regime.turning_moment import Cycle, cycle_of
from flywheel.scene.scene import Scene

_DECADES = 6  # on either side of a typical speed, in which steady speeds are searched for
_PER_DECADE = 24
_NEAR_MARKS = np.array([0.9, 0.97, 0.99, 0.999, 1.0, 1.001, 1.01, 1.1])  # of a speed that a motor is known by
_AT_ONCE = 6_000  # values on the mesh that are computed together: arrays of them stay in the processor's cache
_SPEED_STEP = 1e-3  # of a speed: between those whose net works are compared
_WORK_ROUNDING = 1e-12  # of the net work: smaller differences are rounding
_NEAR_HUMP = 1e-8  # in the logarithm of a speed: resolution of the search for a hump of the net work
_FLAT = 1e-3  # of the net work: humps that fall less to the next speed cannot reach zero
_ABOVE_SAMPLES = 10.0  # times the greater fall to the next speed: height of a hump above its highest sample, at most
_BALANCES = 60
_MOST_ROUNDS = 12
_SLOPE_STEP = 1e-6  # of a speed: step for a slope
_CLOSINGS = 5  # Newton steps towards a cycle without net work
_MOST_CHANGE = 1e-3  # of a speed: greatest change by such a step
_MOST_SWITCHES = 4_000
_PER_SPEED = 0.05  # of what a node takes in a Newton step


_MADE_UP = Fault(
    "shafts",
    "losses in meshes without a torque to compensate for them",
    "a balance, or torques that depend on speed",
    'name the unknown: drive.torque = "balance", or give a motor',
)


def check_steady(machine: Machine) -> None:
    """Refuses a machine without a steady regime: a law depends on time, or nothing balances the losses in meshes."""
    scene = machine.scene
    if machine.depends_on_time:
        paths = [effort.path for effort in machine.efforts if effort.uses_time]
        advice = "follow it in time: flywheel simulate, or flywheel.simulate"
        defect = "a law that depends on time, so that no cycle repeats"
        raise SceneError([Fault(path, defect, "a steady regime", advice) for path in paths])
    if machine.keeps_step and scene.unknown is not None:
        defect, expected = f"a balance ({scene.unknown}) together with a synchronous motor", "all loads given"
        raise SceneError(
            [Fault("drive.motor", defect, expected, "the motor keeps its speed whatever the load: give the load")]
        )
    if not machine.depends_on_speed and scene.unknown is None and scene.speed is not None:
        raise SceneError([_MADE_UP])


def reference_point(machine: Machine) -> tuple[float, float, tuple[str, ...]]:
    """The speed (rad/s) of the approximate figures, the unknown (SI) there, and remarks; kept with the machine."""
    if "reference_point" not in machine.kept:
        moments, required = moments_on(machine, machine.mesh, local=True), machine.scene.speed
        if machine.scene.unknown is None:
            speed, messages = chosen_speed(moments)
            machine.kept["reference_point"] = speed, 0.0, messages
        else:
            assert required is not None
            machine.kept["reference_point"] = required, balance_at(moments, required), ()
    point: tuple[float, float, tuple[str, ...]] = machine.kept["reference_point"]
    return point


def net_works(moments: Moments, speeds: Array, *, losing: bool = True) -> Array:
    """Net works (J) of a cycle run at constant crank speeds (ascending, rad/s), a few at a time.

    Losses in meshes only take. With `losing` false they are left out where without them a cycle loses, too, unless it gains
    at one of the next two speeds: zeros and the peaks beside them are those of the whole work.
    """
    spend(_PER_SPEED * moments.mesh.phi.size * speeds.size)
    few = max(_AT_ONCE // moments.mesh.phi.size, 1)

    def at(some: Array, *, losses: bool) -> Array:
        parts = [moments.net_work(some[k : k + few], losses=losses) for k in range(0, some.size, few)]
        return np.concatenate([*parts, np.zeros(0)])

    if losing or not moments.lossy:
        return at(speeds, losses=True)
    works = at(speeds, losses=False)
    near = np.convolve(~(works <= 0.0), np.ones(5), "same") > 0.0
    works[near] = at(speeds[near], losses=True)
    return works


def exchanged_work(moments: Moments, speed: float) -> float:
    """Work (J) that a cycle at a constant crank speed (rad/s) exchanges, whatever its sign."""
    return float(cells.integral(moments.constant(speed, 0.0).exchanged, moments.mesh.half).sum())


def speed_error(machine: Machine, speed: float) -> float:
    """Relative error of a steady speed (rad/s) by rounding of the torques: the flatter they are, the greater."""
    moments = moments_on(machine, machine.mesh, local=True)
    if machine.keeps_step:
        return 24 * cells.ROUNDING
    slower, faster = (
        speed * (1.0 - _SPEED_STEP),
        speed * (1.0 + _SPEED_STEP),
    )  # a steady current follows the speed: no slope at one
    gained = abs(float(moments.net_work(faster)) - float(moments.net_work(slower))) / (2 * _SPEED_STEP)
    return 24 * cells.ROUNDING * exchanged_work(moments, speed) / max(gained, 1e-300)


def steady_speeds(moments: Moments) -> list[tuple[float, bool]]:
    """Every constant speed (rad/s) at which the net work is zero, ascending, and whether it is stable.

    The search covers twelve decades around a typical speed, and the neighbourhood of every peak and trough; if there are no
    such speeds, as many decades more on either side.
    """
    for decades in (_DECADES, 3 * _DECADES):
        grid, works = _scanned(moments, decades, losing=False)
        points = sorted([*zip(grid.tolist(), works.tolist(), strict=True), *_humps(moments, grid, works)])
        roots = [
            (root(lambda w: float(moments.net_work(w)), a, b, (before, after)), before > 0.0)
            for (a, before), (b, after) in pairwise(points)
            if before * after < 0.0 or (after == 0.0 and before != 0.0)
        ]
        if roots:
            break
    return roots


def _scanned(moments: Moments, decades: int, *, losing: bool = True) -> tuple[Array, Array]:
    """Speeds tried, and the net work at each (see `net_works`); those at which a law has no finite value are left out.

    They are replaced by the nearest speeds, by bisection.
    """
    grid = _grid(moments.machine, decades)
    works = net_works(moments, grid, losing=losing)
    finite = np.isfinite(works)
    if not finite.any():
        _finite_rate(moments, moments.machine.typical_speed, 0.0)
    ends = []
    for k in np.flatnonzero(np.diff(finite)):
        good, bad = grid[[k, k + 1]] if finite[k] else grid[[k + 1, k]]
        ends.append(threshold(lambda w: bool(np.isfinite(float(moments.net_work(w)))), float(bad), float(good)))
    if not ends:
        return grid, works
    speeds, whole = np.append(grid[finite], ends), np.append(works[finite], net_works(moments, np.array(ends)))
    order = np.unique(speeds, return_index=True)[1]
    return speeds[order], whole[order]


def _grid(machine: Machine, decades: int) -> Array:
    """Speeds to try: evenly in their logarithm, and around the characteristic speeds of a motor."""
    return np.unique(speeds_to_try(machine.typical_speed, np.array(machine.motor_speeds), decades))


def speeds_to_try(typical: Any, marks: Array, decades: int = _DECADES) -> Array:
    """The same (speeds, ...) by typical speeds and characteristic ones of motors (marks, ...), ascending."""
    even = np.multiply.outer(np.logspace(-decades, decades, 2 * decades * _PER_DECADE + 1), typical)
    near = np.multiply.outer(_NEAR_MARKS, marks).reshape(-1, *np.shape(typical))
    return np.sort(np.concatenate((even, near)), axis=0)


def _humps(moments: Moments, grid: Array, works: Array, *, every: bool = False) -> list[tuple[float, float]]:
    """Peaks below zero and troughs above it that may cross zero: there are then two speeds near them.

    A smooth peak rises above its highest sample by no more than it falls to the next, so flat ones are left out, and unless
    `every` one is needed also those far from zero, which are followed only until they prove to be.
    """
    sign, peaks = -np.sign(works), []
    for k in 1 + np.flatnonzero(humped(works)[0 if every else 1]):
        log_speed, height = summit(
            lambda x: float(sign[k] * moments.net_work(float(np.exp(x)))),  # noqa: B023 - called at once
            float(np.log(grid[k - 1])),
            float(np.log(grid[k + 1])),
            _NEAR_HUMP,
            enough=0.0,
            above=np.inf if every else _ABOVE_SAMPLES,
        )
        peaks.append((float(np.exp(log_speed)), float(sign[k]) * height))
    return peaks


def humped(works: Array) -> tuple[Any, Any]:
    """Tests at which inner speeds (speeds, ...) net works have such a peak, and which may reach zero."""
    sign, size = -np.sign(works), np.abs(works[1:-1])
    side, here = sign[1:-1], -size
    alike = (side != 0.0) & (side == sign[:-2]) & (side == sign[2:])
    rise, fall = here - side * works[:-2], here - side * works[2:]
    steepest = np.maximum(rise, fall)
    high = alike & (np.minimum(rise, fall) > _WORK_ROUNDING * size) & (steepest > _FLAT * size)
    return high, high & (_ABOVE_SAMPLES * steepest > size)


def chosen_speed(moments: Moments) -> tuple[float, tuple[str, ...]]:
    """The speed (rad/s) of a machine without a balance, and remarks.

    Of several the greatest stable one is taken, that of a running machine. Stable ones are computed again with
    cells that end where laws switch at that speed.

    Raises:
        SceneError: if there is none, with the reason.

    """
    machine, edges = moments.machine, moments.mesh.edges
    if moments.circuit is not None and moments.circuit.only_speed is not None:
        return _speed_in_step(moments), ()

    def net(w: float) -> float:
        return resolve(machine, edges, w).net

    def sharpened(speed: float) -> float:
        switches = machine.switches_at_speeds or moments.lossy
        if not switches or resolve(machine, edges, speed).mesh.edges.size == edges.size:
            return speed
        for reach in (1e-3, 1e-2, 1e-1, 0.5):
            low, high = speed * (1.0 - reach), speed * (1.0 + reach)
            if (before := net(low)) > 0.0 > (after := net(high)):
                return root(net, low, high, (before, after))
        return speed

    speeds = steady_speeds(moments)
    if not any(stable for _, stable in speeds):
        raise SceneError([_no_speed(moments, speeds) if machine.depends_on_speed else _MADE_UP])
    speeds = [(sharpened(at) if stable else at, stable) for at, stable in speeds]
    speed = [at for at, stable in speeds if stable][-1]
    if len(speeds) == 1:
        return speed, ()
    others = ", ".join(f"{at:.6g} rad/s ({'stable' if stable else 'unstable'})" for at, stable in speeds)
    return speed, (f"net work at constant speed is zero at {others}: the motion is that near {speed:.6g} rad/s",)


def _speed_in_step(moments: Moments) -> float:
    """The crank's speed (rad/s) with a synchronous motor; a SceneError where the mean load is beyond its pull-out."""
    circuit, ratio = moments.circuit, moments.drive_ratio
    assert circuit is not None
    assert circuit.only_speed is not None
    speed = circuit.only_speed / ratio
    if moments.carrying is None:
        lacks = -float(moments.net_work(speed, states=circuit.steady(circuit.only_speed)))
        torque, greatest = lacks / (ratio * float(moments.mesh.edges[-1])), circuit.greatest_torque
        defect = f"a mean load of about {torque:.6g} N m at its shaft, above the pull-out torque of {greatest:.6g} N m"
        raise SceneError([Fault("drive.motor", defect, "a motor that keeps step", "a larger motor, or a lighter load")])
    return speed


def _no_speed(moments: Moments, speeds: list[tuple[float, bool]]) -> Fault:
    """The fault of a machine that has no stable steady speed."""
    path = "drive" if moments.machine.scene.drive is not None else "load"
    expected = "torques that hold a steady speed"
    if speeds:
        at = speeds[-1][0]
        what = f"an unstable regime: near {at:.6g} rad/s a faster machine is driven on, and a slower one stops"
        return Fault(path, what, expected, "let the drive's torque fall with speed, or the load's grow with it")
    grid, works = _scanned(moments, _DECADES)
    peaks = [(work, speed) for speed, work in _humps(moments, grid, works, every=True)]
    best, speed = max([(float(works[k]), float(grid[k])) for k in (works.argmax(), 0)] + peaks)
    if best > 0.0:
        what = f"no steady speed: at every speed a cycle has net work left over ({works.min():.6g} J at least)"
        return Fault(
            path, what, expected, "the machine runs away: add a resistance that grows with speed, or limit the drive"
        )
    where = "at standstill" if speed <= _grid(moments.machine, _DECADES)[0] else f"at {speed:.6g} rad/s"
    rounding = 64 * cells.ROUNDING * exchanged_work(moments, speed)
    if np.abs(works).max() <= rounding:
        what = "torques that leave the speed open: the net work of a cycle is zero at every speed"
        return Fault(path, what, expected, 'name the unknown and give the speed: drive.torque = "balance", regime.speed')
    if abs(best) <= rounding:
        what = f"a drive that carries the mean load {where}, and at no other speed"
        return Fault(path, what, expected, "the machine stalls: a stronger drive, or a lighter load")
    what = f"a drive that cannot carry the mean load: at best, {where}, a cycle lacks {-best:.6g} J"
    return Fault(path, what, expected, "the machine stalls: a stronger drive, or a lighter load")


def balance_at(moments: Moments, speed: float) -> float:
    """The value (SI) of the scene's unknown that makes the net work at a constant speed zero."""
    half = moments.mesh.half
    unknown = 0.0
    for _ in range(_BALANCES):
        rate = _finite_rate(moments, speed, unknown)
        rows = np.stack((rate.moment, rate.by_unknown, np.abs(rate.by_unknown)))
        net, slope, size = cells.integral(rows, half).sum(axis=-1)
        if abs(slope) <= 1e-9 * size or size == 0.0:
            raise SceneError([turning_moment.no_effect(moments.machine)])
        step = float(net / slope)
        unknown -= step
        if abs(step) <= 4e-16 * abs(unknown) or not moments.lossy:
            break
    return unknown + 0.0


def operating_point(machine: Machine, speed: float | None = None) -> tuple[float | None, float]:
    """The constant speed (rad/s) at which torques are taken, None if none depends on it, and the unknown's value there.

    That speed is the one given; else the required one if there is a balance, or the one at which the net work is zero;
    along a stroke it is the stroke's. Raises SceneError, with the laws that depend on it, if there is none.
    """
    scene = machine.scene
    if scene.unknown is None and not machine.depends_on_speed:
        return None, 0.0
    if not machine.sets_its_speed:
        return None, turning_moment.balance_value(machine)
    if scene.stroke is not None or scene.unknown is not None:
        required = scene.speed if scene.stroke is None else scene.stroke.speed
        speed = required if speed is None else speed
        if speed is None:
            raise SceneError([no_speed(scene)])
        return speed, 0.0 if scene.unknown is None else resolve(machine, machine.mesh, speed).balance or 0.0
    if speed is not None:
        return speed, 0.0
    try:
        return chosen_speed(moments_on(machine, machine.mesh, local=True))[0], 0.0
    except SceneError as error:
        raise SceneError([fault._replace(advice=f"{fault.advice}; or {GIVE_SPEED}") for fault in error.faults]) from error


GIVE_SPEED = 'give a constant speed: --speed "60 rpm" (in Python speed=6.28)'


def no_speed(scene: Scene, purpose: str = "at which quantities that depend on speed are taken") -> Fault:
    """The fault of a scene without the speed (rad/s; m/s of a slide) that a result needs."""
    sliding = scene.stroke is not None and scene.stroke.sliding
    path, example = ("regime" if scene.stroke is None else "stroke"), "0.1 m/s" if sliding else "60 rpm"
    give = GIVE_SPEED.replace("60 rpm", example).replace("6.28", "0.1" if sliding else "6.28")
    return Fault(f"{path}.speed", "nothing", f'a speed such as "{example}", {purpose}', give)


def operating_point_errors(machine: Machine, speed: float | None, *, fixed: bool = False) -> tuple[float, float]:
    """Relative errors of the speed and the unknown of `operating_point`; 0 for those it does not seek.

    fixed: the speed is given, not computed.
    """
    scene = machine.scene
    if scene.stroke is not None or (scene.unknown is None and (fixed or not machine.depends_on_speed)):
        return 0.0, 0.0
    if scene.unknown is not None:
        sets = machine.sets_its_speed and speed is not None
        cycle = resolve(machine, machine.mesh, speed or 0.0) if sets else turning_moment.balanced(machine)
        return 0.0, cycle.balance_error + 4 * cells.ROUNDING
    assert speed is not None
    closer, loose = closed_cycle_speed(machine, resolve(machine, machine.mesh, speed), speed)
    return loose + abs(closer / speed - 1.0) + 4 * cells.ROUNDING, 0.0


def resolve(machine: Machine, edges: Array, speed: float) -> Cycle:
    """The cycle at a constant speed, on cells between given edges and where laws switch at that speed."""
    for _ in range(_MOST_ROUNDS):
        moments = moments_on(machine, edges)
        omega = np.full(moments.mesh.phi.shape, speed)
        unknown = balance_at(moments, speed) if machine.scene.unknown is not None else None
        switching = moments.switches(omega) + moments.constant_losses(speed, unknown or 0.0)
        finer = _with_switches(moments, np.stack(switching), edges) if switching else edges
        if finer.size == edges.size:
            break
        edges = finer
    rate = _finite_rate(moments, speed, unknown or 0.0)
    cycle = cycle_of(moments, rate, unknown)
    if unknown is not None:
        return cycle
    # the last digits of a speed that the machine takes by itself shift a stiff torque all over the cycle
    shifted = 4 * cells.ROUNDING * speed * float(cells.integral(np.abs(rate.by_speed), moments.mesh.half).sum())
    errors = cycle.errors
    return cycle._replace(errors=errors._replace(work=errors.work + shifted, net=errors.net + shifted))


def _finite_rate(moments: Moments, speed: float, unknown: float) -> Rate:
    """F at a constant speed (rad/s), refused where a load has no finite value."""
    rate, mesh = moments.constant(speed, unknown), moments.mesh
    if not np.isfinite(rate.moment).all():
        omega = np.full(mesh.phi.shape, speed)
        raise SceneError([undefined(moments.machine, mesh, rate.moment, omega)])
    return rate


def closed_cycle_speed(machine: Machine, cycle: Cycle, speed: float) -> tuple[float, float]:
    """The speed (rad/s) near that of a cycle at which its cells have no net work, and its relative error."""
    edges = cycle.mesh.edges
    if machine.keeps_step:
        return speed, 4 * cells.ROUNDING
    for _ in range(_CLOSINGS):
        # a motor's current follows the speed
        beside = float(moments_on(machine, cycle.mesh.edges).net_work(speed * (1.0 + _SLOPE_STEP)))
        slope = (beside - cycle.net) / (_SLOPE_STEP * speed)
        step = cycle.net / slope if slope else 0.0
        if not 4 * cells.ROUNDING < abs(step) / speed < _MOST_CHANGE:
            break
        closer = resolve(machine, edges, speed - step)
        if not abs(closer.net) < abs(cycle.net):
            break
        cycle, speed = closer, speed - step
    return speed, cycle.errors.net / max(abs(slope) * speed, 1e-300)


def _with_switches(moments: Moments, switching: Array, edges: Array) -> Array:
    """The edges, with the angles inside cells at which one of several functions on the mesh changes its sign."""
    series = cells.fit(switching)
    sizes = np.abs(switching).max(axis=(1, 2))
    roots = cells.crossings(series, np.repeat(1e-13 * sizes[:, None], series.shape[1], axis=1))
    angles = roots.angles(moments.mesh)[np.abs(roots.t) < 1.0]
    if angles.size > _MOST_SWITCHES:
        fault = f"laws that switch {angles.size} times and more within a cycle at a constant speed"
        raise SceneError([Fault("load", fault, "laws that can be followed over the cycle", "make them less steep")])
    above = np.searchsorted(edges, angles).clip(1, edges.size - 1)
    distance = np.minimum(np.abs(angles - edges[above - 1]), np.abs(edges[above] - angles))
    return cells.merged([*edges.tolist(), *angles[distance > 1e-9 * edges[-1]].tolist()], float(edges[-1]))
