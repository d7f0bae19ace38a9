"""A motor along a motion: the speed, torque and current of its shaft, its heat, and its limited figures.

Cycle, duty, limits, confirmation and catalogue take these from here. `MotorShaft` follows the shaft over a steady cycle;
means over time and extremes follow from it, each with its error.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np

from flywheel.machine.machine import Machine
from flywheel.numerics import cells
from flywheel.numerics.cells import ROUNDING, Array, Cells, Coarse
from flywheel.regime import turning_moment
from flywheel.regime.turning_moment import Cycle, Run
from flywheel.scene.scene import Scene

if TYPE_CHECKING:
    from flywheel.components.motors import Motor
    from flywheel.components.motors.motor import Law
    from flywheel.regime.cycle_equations import Periodic


AnyFigures = TypeVar("AnyFigures")
SPEED_STEP = 1e-6
"""Share by which a speed is changed to see what depends on it."""

_LEVEL_ROUNDING = 4 * ROUNDING  # of the energy's level
_MOST_CELLS = 4_000  # of a mean over time, in addition to those of the cycle itself


def drive_moment(machine: Machine, cycle: Cycle, run: Run | None, speed: float) -> Array:
    """The drive's moment on the crank (N m) along the motion, at the cycle's nodes (cells, nodes).

    Args:
        machine: with a drive.
        cycle: along the motion.
        run: the motion, if there is one.
        speed: mean of extremes, rad/s.

    """
    if run is not None and run.drive is not None:
        return run.drive
    at = speed if machine.depends_on_speed else None
    moments = machine.reduction.moments(cycle.mesh.phi, cycle.mesh.anchor, cycle.balance or 0.0, speed=at)
    return np.asarray(moments["drive"] + np.zeros_like(cycle.mesh.phi))


def above_error(value: float, error: float) -> float:
    """A figure, or 0 if it is within rounding: ratios to it would be noise."""
    return 0.0 if abs(value) <= error else value


class MotorShaft:
    """A motor's shaft along the steady motion: its speed, torque and current on any mesh, with the error of the speed.

    `speed` (rad/s) is the mean of extremes of the crank, if the run does not have its own; `rtol` the tolerance of integrals
    and extremes. `along` is the crank's speed at the nodes of the run's cycle where no inertia determines it.
    """

    def __init__(self, scene: Scene, cycle: Cycle, run: Run, speed: float, rtol: float, along: Array | None = None) -> None:
        self.motor, self.cycle, self.run, self.rtol = scene.motor, run.cycle or cycle, run, rtol
        self.mean, self.along = run.speed or speed, along
        self.ratio = 1.0 if scene.drive is None else scene.shafts[scene.drive.on]
        self.has_states, self.states_error = bool(run.states), max(run.states_error, default=0.0)

    def omega(self, mesh: Cells) -> Array:
        """Speed of the crank, rad/s."""
        if self.along is not None:
            return cells.interpolated(self.along, self.cycle.mesh, mesh.phi)
        return turning_moment.speed_over_cycle(self.cycle, self.mean, self.run, mesh.phi)

    def torque(self, mesh: Cells, omega: Array) -> Array:
        """Torque of the motor on its shaft, N m: by its law, or that of its own states where it has any."""
        assert self.motor is not None
        if not self.run.states or self.run.drive is None:
            return self.motor.torque(self.ratio * omega)
        return cells.interpolated(self.run.drive, self.cycle.mesh, mesh.phi) / self.ratio

    @property
    def torque_error(self) -> float:
        """Error of the torque by the cells (N m on the motor's shaft) where it follows its own states."""
        if not self.run.states or self.run.drive is None:
            return 0.0
        return float(cells.tails(cells.fit(self.run.drive)).max()) / self.ratio

    def torque_law(self, mesh: Cells, omega: Array) -> tuple[Array, Array]:
        """Torque of the motor on its shaft (N m), and the size of its slope by the crank's speed."""
        assert self.motor is not None
        return self.torque(mesh, omega), self.ratio * np.abs(self.motor.slope_at(self.ratio * omega))

    def current_law(self, mesh: Cells, omega: Array) -> tuple[Array, Array]:
        """Current of the motor over the rated one, by its own states where it has any; size of its slope by the speed."""
        motor, speed, run = self.motor, self.ratio * omega, self.run
        assert motor is not None
        both = motor.current_share(np.stack((speed, speed * (1.0 + SPEED_STEP))))
        here, beside = (None, None) if both is None else both
        slope = np.zeros_like(omega)
        if here is not None and beside is not None:
            slope = np.abs(beside - here) / (SPEED_STEP * omega)
        if motor.circuit is not None and run.along is not None and motor.rated_current is not None:
            own = self.cycle.mesh
            flowing = motor.circuit.current(self.ratio * self.omega(own), tuple(run.along))
            here = cells.interpolated(flowing, own, mesh.phi) / motor.rated_current
        assert here is not None
        return here, slope

    def states(self, mesh: Cells) -> tuple[Array, ...]:
        """The motor's own states at the nodes of a mesh; none if it follows the speed at once."""
        return states_on(self.run, mesh)

    def mean_square(self, law: Law) -> tuple[Any, Any, Cells]:
        """The mean over time of the square of a value along the motion, its error, and cells that are fine enough for it."""

        def square(mesh: Cells, omega: Array) -> tuple[Array, Array]:
            value, slope = law(mesh, omega)
            return value * value, 2 * np.abs(value) * slope

        return self.mean_over_time(square)

    def extremes(self, law: Law) -> tuple[Any, Any, Any]:
        """The least and the greatest value along the motion, and the error of either; `law` as in `mean_over_time`.

        Where a law bends at a speed, cells end at that speed but for the motion's error: past it the interpolant goes on
        straight, which its tails do not show. The law itself at the ends of cells does.
        """

        def evaluated(mesh: Cells) -> tuple[tuple[Any, Any, Any], Any, Coarse]:
            omega = self.omega(mesh)
            value, slope = law(mesh, omega)
            series = cells.fit(value)
            least, most = (rows.reshape(series.shape[:-1]) for rows in cells.extents(series.reshape(-1, series.shape[-1])))
            tails, size = cells.tails(series), np.abs(value).max(axis=(-2, -1))
            size = np.where(size > 0.0, size, 1.0)
            off = (slope * self.speed_error(omega)).max(axis=(-2, -1)) + 24 * ROUNDING * size
            low, high, tail = (rows[..., None] for rows in (least.min(axis=-1), most.max(axis=-1), tails.max(axis=-1)))
            # cells that hold neither extreme need not be fine
            near = (most + tails >= high - tail) | (least - tails <= low + tail)
            worst = np.where(near, tails, 0.0).max(axis=-1)
            if not self.has_states:
                at_ends, _ = law(mesh, cells.ends(cells.fit(omega)))
                off = off + np.where(near, np.abs(at_ends - cells.ends(series)).max(axis=-1), 0.0).max(axis=-1)
            figures = cells.number(low[..., 0]), cells.number(high[..., 0]), cells.number(worst + off)
            return figures, (worst + off) / size, lambda share: near & (tails > share * worst)

        return self.refined(evaluated, 0.1 * self.rtol)

    def refined(self, evaluated: Callable[[Cells], tuple[AnyFigures, Any, Coarse]], rtol: float) -> AnyFigures:
        """The outcome of `evaluated`, beside its error and the cells that are too coarse, on a mesh that is fine enough."""
        first = self.cycle.mesh.edges
        return cells.refined(first, lambda edges: evaluated(cells.cells(edges)), rtol, max(_MOST_CELLS, 2 * first.size))

    def speed_error(self, omega: Array) -> Array:
        """Error of the crank's speed, rad/s: from the level of energy, greater at low speed, and from its variation."""
        run = self.run
        if self.along is not None:
            return np.full(omega.shape, run.error * run.irregularity * run.speed_max)
        pinned = np.maximum(run.error - 4.0 * run.level_error, 0.0) * run.irregularity
        mean, pinned, level = (np.asarray(row)[..., None, None] for row in (self.mean, pinned, run.level + _LEVEL_ROUNDING))
        return np.asarray(mean * (pinned + level * mean / omega))

    def mean_over_time(self, law: Law) -> tuple[Any, Any, Cells]:
        """The mean over time of a value along the motion, its error, and cells that are fine enough for it.

        integral of h/omega dphi over integral of dphi/omega; `law` gives h and |dh/domega| on a mesh. An error d(omega)
        changes h by (|dh/domega| + |h - mean|/omega) d(omega).
        """

        def evaluated(mesh: Cells) -> tuple[tuple[Any, ...], Any, Coarse]:
            omega = self.omega(mesh)
            value, slope = law(mesh, omega)
            rows = np.stack((value / omega, 1.0 / omega))
            total, time = cells.integral(rows, mesh.half).sum(axis=-1)
            mean = total / time
            tails = cells.TAIL_OF_INTEGRAL * cells.tails(cells.fit(rows)) * mesh.half[..., 0]
            shares = (tails[0] + np.abs(mean)[..., None] * tails[1]) / time[..., None]
            missed = shares.sum(axis=-1)
            error = missed / np.maximum(np.abs(mean), 1e-300)
            return (mesh, omega, value, slope, time, mean, missed), error, cells.above(shares, 0.1)

        mesh, omega, value, slope, time, mean, missed = self.refined(evaluated, self.rtol)
        by_speed = (slope + np.abs(value - mean[..., None, None]) / omega) * self.speed_error(omega) / omega
        error = cells.integral(by_speed, mesh.half).sum(axis=-1) / time + missed + 24 * ROUNDING * np.abs(mean)
        return cells.number(mean), cells.number(error), mesh


class MotorShafts(MotorShaft):
    """The shafts of motors along many motions, on the cells of these.

    Args:
        motor: that all have, or those of each as one (see `DesignMotors`).
        ratio: speed of each shaft over its crank's; a number, or one for each motion.
        run: the motions' speeds and errors, arrays.
        solved: the motions.

    """

    def __init__(self, motor: Motor | None, ratio: Any, run: Run, solved: Periodic) -> None:
        speed: Any = run.speed
        self.motor, self.run, self.mean, self.along, self.rtol = motor, run, speed, None, 0.0
        self.mesh, self.speeds = solved.moments.mesh, solved.omega
        self.ratio: Any = np.broadcast_to(ratio, speed.shape)[:, None, None]
        self.has_states, self.states_error = False, 0.0

    def omega(self, mesh: Cells) -> Array:
        """Speeds of the cranks, rad/s."""
        return self.speeds

    def refined(self, evaluated: Callable[[Cells], tuple[AnyFigures, Any, Coarse]], rtol: float) -> AnyFigures:
        """The outcome on the motions' own cells: other cells are tried only for one motion by itself."""
        return evaluated(self.mesh)[0]


def heat_share(motor: Motor, shaft: MotorShaft) -> tuple[Any, Any]:
    """The mean heat of a motor over time, over that at its rated point (see `Motor.heat_share`), and its absolute error."""
    if motor.whole_heat is not None:
        heats = motor.heats(shaft)
        share = heats[motor.whole_heat]
        return share, heats["errors"][motor.whole_heat] * max(share, ROUNDING)

    def law(mesh: Cells, omega: Array) -> tuple[Array, Array]:
        here, beside = motor.heat_share(shaft.ratio * np.stack((omega, omega * (1.0 + SPEED_STEP))))
        slope, along = np.abs(beside - here) / (SPEED_STEP * omega), shaft.run.along
        if along is None:
            return here, slope
        own = shaft.cycle.mesh
        return cells.interpolated(motor.heat_share(shaft.ratio * shaft.omega(own), tuple(along)), own, mesh.phi), slope

    mean, error, _ = shaft.mean_over_time(law)
    even: Any = 0.0 if motor.no_load_speed is None else motor.no_load_speed
    rated = 0.0 if motor.rated is None else motor.rated.speed
    slip = np.maximum(np.maximum(even - rated, ROUNDING * even), 1e-300)  # of what slips at the rated point
    return mean, error + 8 * ROUNDING * mean * even / slip


def states_on(run: Run, mesh: Cells) -> tuple[Array, ...]:
    """A motor's own states along the motion, at the nodes of another mesh."""
    if run.along is None or run.cycle is None:
        return ()
    return tuple(cells.interpolated(row, run.cycle.mesh, mesh.phi) for row in run.along)


# -- the figures that are limited ---------------------------------------------------------------------------------------

IRREGULARITY = "irregularity"
"""The name of the limit that is none of the motor's."""


class Share(NamedTuple):
    """A limited figure and its absolute error; along many motions arrays of them."""

    value: Any
    error: Any


def of_motor(scene: Scene) -> tuple[str, ...]:
    """The limits of a scene that apply to its motor."""
    return tuple(name for name in scene.limits if name != IRREGULARITY)


def shares(names: Iterable[str], shaft: MotorShaft) -> dict[str, Share]:
    """The limited figures along a motion of the motor's shaft.

    motor_torque       max |T|/T_n
    motor_rms          sqrt((1/t) integral of T² dt)/T_n, over the period t of a cycle
    motor_heat         the mean heat over time, over that at the rated point
    current_pulsation  (max i - min i)/i_n

    Source: API 618, 5th ed., 7.1.2 (current pulsation); IEC 60034-1, 4.2.1 (equivalent loads of duty types).
    """
    figures: dict[str, Share] = {}
    run, motor = shaft.run, shaft.motor
    for name in names:
        if name == IRREGULARITY:
            figures[name] = Share(run.irregularity, run.error * run.irregularity)
            continue
        assert motor is not None
        assert motor.rated is not None
        rated = motor.rated.torque
        if name == "motor_torque":
            least, most, error = shaft.extremes(shaft.torque_law)
            figures[name] = Share(cells.number(np.maximum(most, -least)) / rated, (error + shaft.torque_error) / rated)
        elif name == "motor_rms":
            square, error, _ = shaft.mean_square(shaft.torque_law)
            root = cells.number(np.sqrt(np.maximum(square, 0.0)))
            own = 0.5 * error / cells.number(np.maximum(np.maximum(root, np.sqrt(error)), 1e-300)) + shaft.torque_error
            figures[name] = Share(root / rated, own / rated)
        elif name == "motor_heat":
            figures[name] = Share(*heat_share(motor, shaft))
        else:
            least, most, error = shaft.extremes(shaft.current_law)
            figures[name] = Share(most - least, 2 * (error + shaft.torque_error / rated))  # a current is about as its torque
    return figures
