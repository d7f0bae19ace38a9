"""Interface of every type of motor: words, torque, current, heat, own states, and start.

1. A motor is frozen data. Its torque acts on the shaft that it drives, positive in the shaft's rotation; `omega` is that
   shaft's speed (rad/s). The torque depends on the speed alone.
2. The torque is written once, as the expression of `omega` that `law` gives. `torque` and `slope_at` evaluate it.
3. The running branch is the range of speeds in which torque falls with speed (`stable`) and which holds the no-load speed.
   There a greater load slows the motor, whose torque then rises; anywhere else it stalls the motor.
4. `covers` is the range of speeds of the motor's data. Outside it the law is an extrapolation, which each type states.
5. Further properties of a type are class variables or methods that it overrides: `Motor` has neither current nor heat.
   Other modules use these methods and never test the class.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bondgraph.graph import Part
from bondgraph.numerics import root
from bondgraph.recording import NAMESPACE, Program, Recorder
from flywheel.components.energy import Energy
from flywheel.components.motors.thermal import Thermal
from flywheel.language import text as _
from flywheel.numerics.cells import Cells
from flywheel.numerics.expressions import Expression, Node, numeral, variable
from flywheel.numerics.faults import NOT_NEGATIVE, POSITIVE, Fault, number_faults
from flywheel.numerics.jets import Jet, is_recorded, jet_namespace

Array = NDArray[np.float64]
Span = tuple[float, float]

EVERYWHERE: Span = (-math.inf, math.inf)
T, OMEGA = variable("t"), variable("omega")
_DOUBLINGS = 200  # of a step away from the known end of a branch, until a torque is enclosed


Law = Callable[[Cells, Array], tuple[Array, Array]]
"""A figure along a motion, by a mesh and the crank's speed at its nodes; and the size of its slope by that speed."""


class ShaftMotion(Protocol):
    """A motor's shaft along a steady motion, as in `MotorShaft` of `sizing`: `ratio` is its speed over the crank's.

    `has_states` is true if the motor's own states were followed, `states_error` is the greatest error of one.
    """

    ratio: float
    has_states: bool
    states_error: float

    def omega(self, mesh: Cells) -> Array:
        """Speed of the crank at the nodes, rad/s."""

    def speed_error(self, omega: Array) -> Array:
        """The error of the speed."""

    def torque(self, mesh: Cells, omega: Array) -> Array:
        """Torque of the motor on its shaft, N m."""

    def states(self, mesh: Cells) -> tuple[Array, ...]:
        """The motor's own states."""

    def current_law(self, mesh: Cells, omega: Array) -> tuple[Array, Array]:
        """Current of the motor over the rated one, a `Law`."""

    def mean_over_time(self, law: Law) -> tuple[float, float, Cells]:
        """The mean of a figure over time, its error, and cells that are fine enough for it."""

    def mean_square(self, law: Law) -> tuple[float, float, Cells]:
        """The same of its square."""

    def extremes(self, law: Law) -> tuple[float, float, float]:
        """The least and the greatest value of a figure, and the error of either."""


def figure_and_error(value: float, error: float, scale: float) -> tuple[float, float]:
    """A figure and its relative error; 0, and the error as a share of its scale, if it is within its error."""
    figure = 0.0 if abs(value) <= error else value
    return figure, error / (abs(figure) or scale)


class Point(NamedTuple):
    """A point of a torque-speed curve: speed (rad/s) and torque (N m)."""

    speed: float
    torque: float

    @property
    def power(self) -> float:
        """Mechanical power, torque times speed, W.

        >>> Point(100.0, 20.0).power
        2000.0
        """
        return self.speed * self.torque


class Fact(NamedTuple):
    """Fact of a motor for a report: words, symbol, value (SI) and unit, in a `table` of that caption if there is one.

    With a `formula`, the value follows from those of the symbols in `numbers`; words alone are a remark. `share` is
    a heat over that at the rated point, NaN if there is none.
    """

    words: str
    symbol: str = ""
    value: float | None = None
    unit: str = ""
    formula: str = ""
    numbers: tuple[Fact, ...] = ()
    table: str = ""
    share: float | None = None


# -- the own states -----------------------------------------------------------------------------------------------------

States = Sequence[Any] | NDArray[np.float64]
"""One value per state, each a number or an array: a tuple, or an array whose first axis is the states'."""


class StateName(NamedTuple):
    """A state by name, with its unit in SI; `turns`: an angle that grows without limit while the motor slips.

    `in_graph` is its place in the motor's part of a bond graph, if there is one: a flow "f" of a 1-junction or a
    displacement "q" of a spring, its name, and the factor by which the state is larger.
    """

    name: str
    unit: str
    turns: bool = False
    in_graph: tuple[str, str, float] | None = None


class Slopes(NamedTuple):
    """Derivatives at speeds and states: of the torque by speed and by each state, of each rate by speed and by each state.

    Units: N m s/rad, N m per unit of a state; per second, a state's unit per rad, and per unit of the other state.
    `rates_by_states[j][k]` is that of rate j by state k. Each is a number or an array.
    """

    torque_by_speed: Any
    torque_by_states: tuple[Any, ...]
    rates_by_speed: tuple[Any, ...]
    rates_by_states: tuple[tuple[Any, ...], ...]


class Circuit(ABC):
    """A motor whose torque depends on its own n states x: T(omega, x), dx/dt = f(omega, x), omega the speed of its shaft.

    `names` are its states, `scales` their sizes, by which errors are measured. `only_speed` is the one speed (rad/s) at
    which its states can be steady under load, as of a synchronous motor; None if they can at any.
    """

    names: tuple[StateName, ...]
    scales: tuple[float, ...]
    only_speed: float | None = None
    greatest_torque: float = math.inf  # N m, that it gives at that speed

    @abstractmethod
    def torque(self, omega: Any, states: States) -> Any:
        """Torque on the shaft, N m, at speeds (rad/s) and states."""

    @abstractmethod
    def rates(self, omega: Any, states: States) -> tuple[Any, ...]:
        """Rates of change of the states, per second."""

    @abstractmethod
    def slopes(self, omega: Any, states: States) -> Slopes:
        """Derivatives of torque and rates."""

    @abstractmethod
    def steady(self, omega: Any) -> tuple[Any, ...]:
        """The stationary states at constant speeds (rad/s); if there are none, those that give the mean torque."""

    def carrying(self, net: Callable[[tuple[float, ...]], float]) -> tuple[float, ...] | None:
        """The states at `only_speed` at which a net work, which grows with the torque, is 0; None if there are none."""
        raise NotImplementedError

    @abstractmethod
    def standing(self, states: States, time: Any) -> tuple[Any, ...]:
        """The states after times (s) at rest, from those at its beginning."""

    def current(self, omega: Any, states: States) -> Any:
        """The current of the motor, A (root mean square of an alternating one); None if unknown."""
        return None

    @property
    def unfed(self) -> tuple[float, ...]:
        """The states of a motor at rest just switched on."""
        return (0.0,) * len(self.names)


# -- how it is started ---------------------------------------------------------------------------------------------------


def rpm(speed: float) -> str:
    """A speed (rad/s) in revolutions per minute."""
    return f"{speed * 30 / math.pi:.6g} rpm"


class Switch(NamedTuple):
    """End of a connection: at a time after switching on (s), or when its shaft first reaches a speed (rad/s)."""

    time: float | None = None
    speed: float | None = None

    def __str__(self) -> str:
        return f"{self.time:.6g} s" if self.speed is None else rpm(self.speed)


class Connection(NamedTuple):
    """A motor in one connection: torque T(omega) v², current I(omega) v, at a share v of the voltage.

    motor: with its resistances and field in this connection, at full voltage.
    until: when it ends.
    voltage: v; with a `ramp` that at t = 0, which rises linearly to 1 in this time (s).
    line: line current over that of the motor's terminals at that voltage: v of a transformer, 1/sqrt(3) of a star.
    torque_limit: of a soft start that lowers the voltage to it, N m.
    current_limit: the same, over the rated line current.
    """

    motor: Motor
    until: Switch
    voltage: float = 1.0
    line: float = 1.0
    ramp: float = 0.0
    torque_limit: float | None = None
    current_limit: float | None = None

    def law(self) -> Node:
        """The torque on the shaft, N m, by `omega` and `t`."""
        factor, current = None, self.motor.share_law()  # the square of the voltage's share; None if it is full
        if self.ramp:
            rising = Node(
                "sum", (numeral(self.voltage), product(numeral((1.0 - self.voltage) / self.ramp), T)), signs=("+", "+")
            )
            ramp = Node("if", (before(self.ramp), rising, numeral(1.0)))
            factor = product(ramp, ramp)
        elif self.voltage != 1.0:
            factor = numeral(self.voltage**2)
        if self.current_limit is not None and current is not None:
            limit = Node("product", (numeral(self.current_limit**2), current.tree, current.tree), signs=("*", "/", "/"))
            factor = Node("min", (limit, factor or numeral(1.0)))
        torque = self.motor.law().tree
        if factor is not None:
            torque = product(torque, factor)
        return torque if self.torque_limit is None else Node("min", (torque, numeral(self.torque_limit)))


def product(*factors: Node) -> Node:
    """Expressions multiplied."""
    return Node("product", factors, signs=("*",) * len(factors))


def before(time: float) -> Node:
    """Tests whether `t` is less than a time, s."""
    return Node("compare", (T, numeral(time)), signs=("<",))


class Start(NamedTuple):
    """Start of a motor: its name, and the connections before the one in which the motor runs."""

    title: str
    connections: tuple[Connection, ...]


# -- what feeds it -------------------------------------------------------------------------------------------------------

OVERCURRENT = 2.0
"""Default current at which an inverter trips, over the motor's rated one: 1.8 to 2.2 are usual."""

BRAKING = ("none", "resistor", "regenerative")


class Inverter(NamedTuple):
    """An inverter that feeds a motor with a voltage in proportion to its frequency.

    Args:
        frequency: f of the steady regime, Hz.
        weakening: frequency from which its voltage stays constant, Hz.
        torque_limit: over the motor's rated torque; None without one.
        ramp: time in which the frequency rises from 0 to f, s; 0 if it is f immediately.
        braking: use of the power that the motor returns: `none`, `resistor` or `regenerative`.
        chopper_power: greatest power of the braking resistor, W.
        overcurrent: current at which it trips, over the motor's rated one.

    """

    frequency: float
    weakening: float
    torque_limit: float | None = None
    ramp: float = 0.0
    braking: str = "none"
    chopper_power: float | None = None
    overcurrent: float = OVERCURRENT

    @property
    def rising(self) -> FrequencyRamp:
        """Ramp as a state of the motor."""
        return FrequencyRamp(self.ramp, min(self.weakening / self.frequency, 1.0))

    @property
    def limits(self) -> tuple[tuple[str, float], tuple[str, float]]:
        """Limits beyond which it trips: of the current over the rated one, of the power returned (W)."""
        kind = "chopper_power" if self.braking == "resistor" else "overvoltage"
        power = {"none": 0.0, "resistor": self.chopper_power or 0.0}.get(self.braking, math.inf)
        return ("overcurrent", self.overcurrent), (kind, power)

    def faults(self) -> list[Fault]:
        """The faults of its own numbers, by the scene's keys."""
        named = {"frequency": self.frequency, "field_weakening_from": self.weakening, "overcurrent": self.overcurrent}
        named |= {name: value for name in ("torque_limit", "chopper_power") if (value := getattr(self, name)) is not None}
        faults = [fault for name, value in named.items() for fault in number_faults(name, value, POSITIVE)]
        faults += number_faults("ramp", self.ramp, NOT_NEGATIVE)
        if self.braking not in BRAKING:
            faults.append(Fault("braking", f'"{self.braking}"', '"none", "resistor" or "regenerative"'))
        elif (self.braking == "resistor") != (self.chopper_power is not None):
            defect = (
                "a resistor without its power" if self.chopper_power is None else f'together with braking = "{self.braking}"'
            )
            faults.append(Fault("chopper_power", defect, 'a power with braking = "resistor", none otherwise'))
        return faults


class FrequencyRamp(NamedTuple):
    """The frequency of an inverter that rises, x of the set one, as a state: linear except for its last thousandth.

    dx/dt = min(1/t_r, (1 - x)/(t_r/1000)), so that x reaches 1 without a kink; voltage V min(x, x_w)/x_w.

    Args:
        time: t_r in which the frequency rises from 0, s.
        weakening: x_w, frequency from which the voltage stays constant, over the set one, at most 1.

    >>> ramp = FrequencyRamp(4.0, 1.0)
    >>> [ramp.rate(x) for x in (0.0, 0.5, 1.0)], [round(float(value), 9) for value in ramp.after(0.0, np.array(2.0))]
    ([0.25, 0.25, 0.0], [0.5, 0.5])

    """

    time: float
    weakening: float

    @property
    def lag(self) -> float:
        """Time constant of the last thousandth, s."""
        return 1e-3 * self.time

    def rate(self, share: Any) -> Any:
        """dx/dt, 1/s."""
        least = min if isinstance(share, float) else np.minimum
        return least(1.0 / self.time, (1.0 - share) / self.lag)

    def slope(self, share: Any) -> Any:
        """Derivative of dx/dt by x, 1/s."""
        return np.where(1.0 - share < 1e-3, -1.0 / self.lag, 0.0)

    def voltage(self, share: Any) -> Any:
        """The voltage over that at the set frequency."""
        least = min if isinstance(share, float) else np.minimum
        return least(share, self.weakening) / self.weakening

    def flux(self, share: Any) -> Any:
        """The flux over that at the set frequency: voltage over frequency."""
        most = max if isinstance(share, float) else np.maximum
        return 1.0 / most(share, self.weakening)

    def after(self, share: float, time: Array) -> tuple[Array, Array]:
        """The share x after times (s), from one at their beginning, and its integral over them, s."""
        even = max(1.0 - 1e-3 - share, 0.0) * self.time
        before, beyond = np.minimum(time, even), np.maximum(time - even, 0.0)
        left = min(1.0 - share, 1e-3)
        fades = left * np.exp(-beyond / self.lag)
        shares = np.where(time < even, share + before / self.time, 1.0 - fades)
        return shares, before * (share + 0.5 * before / self.time) + beyond - self.lag * (left - fades)


# -- the motor -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class Motor(ABC):
    """A motor. `inertia` is that of its rotor (kg m²), which counts as an inertia on its shaft.

    `inverter` feeds it instead of the mains; `start` is its starting method, `thermal` the data of its temperature. All
    other figures are those in normal running, in the last connection.
    """

    inertia: float = 0.0
    start: Start | None = None
    inverter: Inverter | None = None
    thermal: Thermal | None = None
    title: ClassVar[str]
    formula: ClassVar[str] = ""
    """Its torque in a sentence; empty if its expression suffices."""
    heated: ClassVar[str | None] = None
    """The figure of a sizing's `Energy` that heats it; None if torque against speed alone does not give it."""
    whole_heat: ClassVar[str | None] = None
    """The figure of `heats` that is all its heat over that at the rated point; None if rotor and stator share it."""
    starts: ClassVar[tuple[str, ...]] = ()
    """The starts that it can have."""
    governed: ClassVar[bool] = False
    """True for a governed motor: its rated point is full load, and it has no windings that heat up."""
    keeps_step: ClassVar[bool] = False
    """True if it runs at one speed alone, by its load angle."""
    takes_power: ClassVar[bool] = False
    """True if `powers` gives its losses in addition to the power of its shaft."""

    @abstractmethod
    def law(self) -> Expression:
        """The torque on the shaft (N m) as an expression of its speed `omega` (rad/s)."""

    @property
    @abstractmethod
    def no_load_speed(self) -> float | None:
        """Speed (rad/s) at which the torque has fallen to zero; None if it never does."""

    @property
    @abstractmethod
    def stable(self) -> Span | None:
        """Ends (rad/s) of the running branch, in which dT/domega < 0; None if there is none."""

    @property
    def rated(self) -> Point | None:
        """The point of the name plate, if there is one."""
        return None

    @cached_property
    def circuit(self) -> Circuit | None:
        """States of the motor, in addition to its shaft's; None if torque depends on the instantaneous speed."""
        return None

    @property
    def doubts(self) -> tuple[str, ...]:
        """Doubts about its data, one sentence each."""
        return ()

    @property
    def covers(self) -> Span:
        """Lowest and highest speed (rad/s) of the motor's data."""
        return EVERYWHERE

    @property
    def rated_current(self) -> float | None:
        """Current at the rated point, A, of a stator's line or an armature; None if the data do not give it."""
        return None

    @property
    def points(self) -> tuple[Point, ...]:
        """The measured points of its curve, if any."""
        return ()

    @property
    def curve(self) -> Any:
        """The `Curve` of its torque, or of its full load, if its data are rows."""
        return None

    @property
    def breakdown_torque(self) -> float | None:
        """The greatest torque, N m, if its name plate gives it."""
        return None

    @property
    def static(self) -> Motor | None:
        """The same motor with states that follow the speed without delay, for a comparison."""
        return None

    def peak(self, omega: ArrayLike) -> Any:
        """The peak curve of a servo drive, N m, at speeds omega (rad/s), of their shape; None of other types."""
        return None

    def continuous(self, omega: ArrayLike) -> Any:
        """The continuous curve of a servo drive, N m, at speeds omega (rad/s), of their shape; None of other types."""
        return None

    def current(self, omega: ArrayLike) -> Any:
        """Current (A) at steady speeds omega (rad/s), of their shape; None if the type or the data do not give it."""
        return None

    def current_share(self, omega: ArrayLike) -> Array | None:
        """Current over the rated one at steady speeds omega (rad/s), of their shape; None if the type does not give it."""
        return None

    def share_law(self) -> Expression | None:
        """The current over the rated one as an expression of `omega`, for a limit by an alternating voltage."""
        return None

    def current_along(self, omega: Array, time: Array, switched: Array) -> Array | None:
        """Current (A) along a motion, at speeds (rad/s) and times (s); `switched` are times that decide the connection."""
        currents = self.current(omega)
        return None if currents is None else np.asarray(currents)

    def at(self, time: Array) -> Motor:
        """The motor at times (s) of a connection: itself, unless its data change with time."""
        return self

    def windings_share(self, omega: Array, torque: Array, running: Motor) -> Array | None:
        """Current of the windings over the rated one of the motor as it is `running`, as connected with other torques.

        Where that has no rated current, A. None if the type does not give it.
        """
        share = self.current_share(omega)
        if share is None:
            return None
        full = self.torque(omega)
        with np.errstate(all="ignore"):
            square = np.where(full == 0.0, 1.0, torque / full)
        return np.asarray(share * np.sqrt(np.maximum(square, 0.0)))

    def heat(self, omega: Any, states: States = ()) -> Any:
        """Heat (W) of rotor or armature at speeds omega (rad/s) and its own states; None if the type does not give it."""
        return None

    def heat_along(self, omega: Array, time: Array, switched: Array, states: States) -> Array | None:
        """The same along a motion; arguments as in `current_along`."""
        return None if self.heated is None else np.asarray(self.heat(omega, states))

    def split_heat(self, omega: Array, torque: Array, running: Motor) -> tuple[Array | None, Array | None]:
        """Heat (W) in the winding itself, and in resistors beside it, of a motor as connected with other torques."""
        return None, None

    def stator_heat(self, omega: ArrayLike) -> Array | None:
        """Copper heat of the stator, W, at speeds omega (rad/s); None if the type or the data do not give it."""
        return None

    @property
    def rated_stator_heat(self) -> float | None:
        """Copper heat of the stator at rated load, W; None if the type or the data do not give it."""
        return None

    def total_heat(self, omega: Any, states: States = ()) -> Any:
        """Heat (W) of all windings for which data exist, at speeds omega (rad/s) and its own states."""
        stator, heat = self.stator_heat(omega), self.heat(omega, states)
        return heat if stator is None else heat + stator

    @property
    def rated_heat(self) -> float:
        """Heat (W) of rotor or armature at the rated point."""
        assert self.rated is not None
        return _number(self.heat(self.rated.speed))

    @cached_property
    def rated_total_heat(self) -> float:
        """Heat (W) of all windings for which data exist, at the rated point."""
        assert self.rated is not None
        return _number(self.total_heat(self.rated.speed))

    def heat_share(self, omega: Any, states: States = ()) -> Array:
        """The same over that at the rated point."""
        return np.asarray(self.total_heat(omega, states) / self.rated_total_heat)

    def heats(self, shaft: ShaftMotion) -> dict[str, Any]:
        """Current and heat along a motion as figures of `Energy`, with their relative `errors`; empty without data."""
        return {}

    def locked_rotor_limit(self, cold: bool = False) -> float | None:
        """The limit of the integral of (I/I_n)² dt in a start (s), by its locked rotor's time; None if unknown."""
        return None

    def powers(self, omega: Array, torque: Array, states: tuple[Array, ...] = ()) -> dict[str, Array]:
        """Powers of the motor except its shaft's (W), by kind, at speeds (rad/s), torques (N m) and its own states."""
        return {}

    def input_power(self, omega: Array, torque: Array, states: tuple[Array, ...] = ()) -> Array:
        """Power (W) taken from mains or an inverter: T omega and `powers`; below 0 if it returns some."""
        return np.asarray(torque * omega + sum(self.powers(omega, torque, states).values()))

    def with_resistance(self, share: float) -> Motor:
        """The motor with a resistance added to rotor or armature, over the winding's own."""
        raise NotImplementedError

    def with_field(self, share: float) -> Motor:
        """The motor with another field, over its own."""
        raise NotImplementedError

    def graph(self) -> Part | None:
        """The motor as a part of a bond graph, open at the 1-junction `rotor` of its shaft; None if its law suffices."""
        return None

    def facts(self) -> Iterator[Fact]:
        """Facts for a report, from its name plate on."""
        if (point := self.rated) is not None:
            plate = _("Name plate")
            power = Fact(_("rated power"), "P_n", point.power, "W", table=plate)
            speed = Fact(_("rated speed"), "omega_n", point.speed, "rad/s", table=plate)
            yield from (power, speed)
            yield Fact(_("Rated torque"), "T_n", point.torque, "N m", "T_n = P_n/omega_n", (power, speed))

    def heat_facts(self, energy: Energy) -> Iterator[Fact]:
        """Facts for a report on its heat over a cycle."""
        yield Fact(_("Torque against speed alone does not give the losses of this motor."))

    @property
    def starting_torque(self) -> float:
        """Torque (N m) at rest."""
        return float(self.torque(0.0))

    @property
    def breakdown(self) -> Point | None:
        """The lower end of the running branch, where torque is greatest; None if the branch continues through rest."""
        start = -math.inf if self.stable is None else self.stable[0]
        return Point(start, float(self.torque(start))) if math.isfinite(start) else None

    def torque(self, omega: ArrayLike) -> Array:
        """Torque on the shaft (N m) at speeds omega (rad/s), of their shape."""
        speeds = floats(omega)
        torques: Array = np.zeros_like(speeds) + self._law.evaluate({"omega": speeds}, np)
        return torques

    def slope_at(self, omega: ArrayLike) -> Array:
        """Slope dT/domega (N m s/rad) at speeds omega (rad/s), of their shape; at a kink, that of the side in use."""
        speeds = floats(omega)
        torque = self._law.evaluate({"omega": Jet(speeds, np.ones_like(speeds))}, jet_namespace(np))
        slopes: Array = np.zeros_like(speeds) + (torque.first if isinstance(torque, Jet) else 0.0)
        return slopes

    def speed_at(self, torque: float) -> float | None:
        """Speed (rad/s) on the running branch at which the motor gives a torque (N m).

        None if the branch does not reach it: above the breakdown torque, the motor stalls.
        """
        if self.stable is None:
            return None
        low, high = (self._within(end, torque, side) for end, side in zip(self.stable, (-1.0, 1.0), strict=True))
        if not self.torque(low) >= torque >= self.torque(high):
            return None
        return root(lambda omega: float(self.torque(omega)) - torque, low, high)

    def _within(self, end: float, torque: float, side: float) -> float:
        """A finite end of the running branch, beyond the speed at which it reaches a torque."""
        if math.isfinite(end):
            return end
        limits = (*(self.stable or ()), self.no_load_speed)
        middle = next((speed for speed in limits if speed is not None and math.isfinite(speed)), 0.0)
        steps = (middle + side * max(1.0, abs(middle)) * 2.0**k for k in range(_DOUBLINGS))
        return next((speed for speed in steps if side * (float(self.torque(speed)) - torque) <= 0), middle)

    @cached_property
    def _law(self) -> Expression:
        return self.law()


def floats(values: ArrayLike) -> Any:
    """Values as an array of floats; recorded numbers, which stand for those of many motors, as they are."""
    return values if is_recorded(values) else np.asarray(values, dtype=float)


def _number(value: Any) -> float:
    """A value as a float; a recorded number as it is."""
    one = np.asarray(value)[()]
    return one if is_recorded(one) else float(one)


def wrong_numbers(motor: Motor, positive: tuple[str, ...] = (), not_negative: tuple[str, ...] = ()) -> list[Fault]:
    """The faults of a motor's own numbers, by their names."""
    ranges = [(name, POSITIVE) for name in positive] + [(name, NOT_NEGATIVE) for name in (*not_negative, "inertia")]
    return [fault for name, expected in ranges for fault in number_faults(name, getattr(motor, name), expected)]


def wrong_field(motor: Any, ratio: str) -> list[Fault]:
    """The faults of a motor's number of poles, and of the ratio of its greatest torque to the rated one."""
    poles, greatest = motor.poles, getattr(motor, ratio)
    faults = number_faults("poles", poles), number_faults(ratio, greatest)
    if not faults[0] and (poles < 2 or poles % 2):
        faults[0].append(Fault("poles", f"{poles:g}", "an even number, 2 or more"))
    if not faults[1] and greatest <= 1:
        faults[1].append(Fault(ratio, f"{greatest:g}", "a number above 1"))
    return faults[0] + faults[1]


def wrong_point(point: Any, speed: str = "speed", torque: str = "torque") -> list[Fault]:
    """The faults of a rated point, whose torque must be positive."""
    return number_faults(speed, point.speed, POSITIVE) + number_faults(torque, point.torque, POSITIVE)


# -- those of many designs ------------------------------------------------------------------------------------------------

_OF_DESIGNS = ("torque", "slope", "current_share", "heat_share", "rated_torque", "rated_speed", "no_load_speed")


def motor_program(motor: Motor, limits: Sequence[str], recorder: Recorder, omega: Any) -> Program:
    """The program of a motor with recorded numbers, from all inputs on record, as far as limits need it.

    Torque with its slope, current and heat over those at its rated point, at a recorded speed of its shaft (rad/s); then
    that point, and its speed without load. NaN where its type does not give it, or no limit needs it.
    """
    nothing, torque = math.nan, motor.law().evaluate({"omega": Jet(omega, 1.0)}, jet_namespace(NAMESPACE))
    torque = torque if isinstance(torque, Jet) else Jet(torque, 0.0)
    current = motor.current_share(omega) if "current_pulsation" in limits else None
    heat = motor.heat_share(omega) if "motor_heat" in limits else None
    rated = (nothing, nothing) if motor.rated is None else (motor.rated.torque, motor.rated.speed)
    outputs = torque.value, torque.first, current, heat, *rated, motor.no_load_speed
    return recorder.program([nothing if each is None else np.asarray(each)[()] for each in outputs])


class DesignMotors:
    """The motors of designs as one, with those methods of `Motor` by which limited figures follow along motions.

    Args:
        program: of `motor_program`, from (phi, *columns, omega, unknown).
        columns: the numbers of the designs (paths, designs), SI.

    """

    circuit = whole_heat = None

    def __init__(self, program: Program, columns: Array) -> None:
        self._program, self._inputs = program, columns[:, :, None, None]
        nothing = np.zeros((columns.shape[1], 1, 1))
        names = "rated_speed", "rated_torque", "no_load_speed"
        rated: Any
        *rated, self.no_load_speed = (self._at(name, nothing)[:, 0, 0] for name in names)
        self.rated = Point(*rated)

    def _at(self, name: str, omega: Array) -> Array:
        """An output of the program at speeds of the shafts (rad/s), (designs, cells, nodes)."""
        part = self._program._replace(outputs=(self._program.outputs[_OF_DESIGNS.index(name)],)).only(1)
        return np.asarray(part.function()(0.0, *self._inputs, omega, 0.0)[0] + np.zeros_like(omega))

    def torque(self, omega: Array) -> Array:
        """Torques on the shafts, N m."""
        return self._at("torque", omega)

    def slope_at(self, omega: Array) -> Array:
        """Slopes of the torques, N m s/rad."""
        return self._at("slope", omega)

    def current_share(self, omega: Array) -> Array:
        """Currents over the rated ones."""
        return self._at("current_share", omega)

    def heat_share(self, omega: Array) -> Array:
        """Heat over that at the rated points."""
        return self._at("heat_share", omega)
