"""States of a motor's own, beside its shaft's: the current of an armature, the load angle of a rotor, fluxes of windings."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.records import NamedTuple

States = Sequence[Any] | NDArray[np.float64]
"""One value per state, each a number or an array: a tuple, or an array whose first axis is the states'."""


class StateName(NamedTuple):
    """A state by name, with its unit in SI and whether it is an angle that turns on for ever where the motor slips."""

    name: str
    unit: str
    turns: bool = False


class GraphState(NamedTuple):
    """Where a state is in the motor's part of a bond graph: a flow "f" of a 1-junction or a displacement "q" of a spring.

    The state is `factor` times that.
    """

    kind: str
    name: str
    factor: float = 1.0


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
    """A motor whose torque follows n states x of its own: T(omega, x), dx/dt = f(omega, x), omega the speed of its shaft.

    `names` are its states, `scales` their sizes, by which errors are measured; `in_graph` is where the motor's part of a
    bond graph has them, empty where there is no such part. `only_speed` is the one speed (rad/s) at which its states can
    stand still under load, None where they can at any: a synchronous motor's.
    """

    names: tuple[StateName, ...]
    scales: tuple[float, ...]
    in_graph: tuple[GraphState, ...] = ()
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
        """The states that stand still at constant speeds (rad/s); where they do not, those that give the mean torque."""

    def carrying(self, net: Callable[[tuple[float, ...]], float]) -> tuple[float, ...] | None:
        """The states at `only_speed` at which a net work, which grows with the torque, is 0; None where it is not at any."""
        raise NotImplementedError

    @abstractmethod
    def standing(self, states: States, time: Any) -> tuple[Any, ...]:
        """The states after times (s) at rest, from those at its beginning."""

    def current(self, omega: Any, states: States) -> Any:
        """The current that the motor takes, A (where it alternates, its root mean square); None where that is unknown."""
        return None

    @property
    def unfed(self) -> tuple[float, ...]:
        """The states of a motor at rest that has just been switched on."""
        return (0.0,) * len(self.names)
