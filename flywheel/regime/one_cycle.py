"""One steady cycle stepped in time, in scaled variables that keep their digits however little the speed varies.

tau = w t and omega = w (1 + scale u), the scale being of the size of the irregularity. Stepping starts afresh at every
breakpoint of position, and where a law switches at a speed or a mesh changes the side that drives.
"""

from __future__ import annotations

from itertools import islice

import numpy as np
from numpy.typing import NDArray

from flywheel.machine.dynamics import Anchor, Dynamics
from flywheel.regime.stepping import RateField, Rates, Step, Tolerance, Watch, stiffness, through

Array = NDArray[np.float64]
Ends = tuple[float, float]

_AHEAD = 1e-7  # of a piece: how far beyond a switch its side is looked up
_MOST_STEPS, _MOST_CROSSINGS = 4_000, 500  # in a stretch, and in a cycle
_FEW_STEPS = 1000  # in a stretch where switches are no longer looked for
_TRIES = 8  # changes of side at one place, before they are no longer looked for


def one_cycle(dynamics: Dynamics, speed: float, scale: float, first: Array, tight: float) -> list[Step]:
    """The steps of a cycle from a state at phi = 0: phi (rad), u, and the current (A) where a motor's is a state.

    Args:
        dynamics: the machine with its flywheel and balance.
        speed: w, rad/s.
        scale: of the speed's variation.
        first: the state at phi = 0.
        tight: tolerance of a step.

    Raises:
        SlidingError: where the motion keeps changing sides, as it does along a torque that jumps at a speed.

    Where it changes sides again and again at one place, the rest of that piece is stepped without looking for switches.

    """
    return _Cycle(dynamics, speed, scale, tight).steps(first)


class SlidingError(ValueError):
    """A motion that does not get on: it slides along a law that drives it back from both sides."""


class _Cycle:
    def __init__(self, dynamics: Dynamics, speed: float, scale: float, tight: float) -> None:
        self.dynamics, self.speed, self.scale, self.tight = dynamics, speed, scale, tight

    def steps(self, first: Array) -> list[Step]:
        """Piece after piece, and within each from switch to switch."""
        ends = self.dynamics.machine.restarts
        tolerance = Tolerance(self.tight, self.tight * np.array([1.0, 1.0, *np.abs(first[2:])]))
        state, tau, found = first, 0.0, list[Step]()
        hint: float | None = None
        crossings = 0
        for low, high in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True):
            tries = 0
            while True:
                anchor = self._anchor(state, (low, high)) if tries <= _TRIES else None
                watch = None if anchor is None else self._watch(anchor, state)
                rates, along = self._rates((low, high), anchor), self._along((low, high), anchor, state)
                stepping = through(rates, tau, state, (low, high), np.inf, tolerance, hint, watch, along)
                most = _MOST_STEPS if watch is not None or tries == 0 else _FEW_STEPS
                passed = [*islice(stepping, most)]
                last, crossings = passed[-1], crossings + (passed[-1].crossed is not None)
                found += [step for step in passed if step.end > step.start]
                if len(passed) == most or crossings > _MOST_CROSSINGS:
                    raise SlidingError
                tries = tries + 1 if last.end == tau else 0
                state, tau = np.array(last.dense(last.end)), last.end
                if last.crossed is None or high - state[0] <= 2 * _AHEAD * (high - low):
                    break
            hint = max((step.end - step.start for step in passed if step.end > step.start), default=hint)
            state[0] = high
        return found

    def _omega(self, u: Array | float) -> Array | float:
        return self.speed * (1.0 + self.scale * u)

    def _rates(self, ends: Ends, anchor: Anchor | None) -> Rates:
        """d(phi, u, current)/dtau within a stretch."""
        dynamics, speed, scale = self.dynamics, self.speed, self.scale
        middle = 0.5 * (ends[0] + ends[1]) if anchor is None else anchor.phi

        def rates(tau: float, state: Array) -> Array:
            pace = 1.0 + scale * state[1]
            current = float(state[2]) if state.size > 2 else 0.0
            at = dynamics.at(float(state[0]), middle, float(speed * pace), current=current, ends=ends, anchor=anchor)
            found = [pace, at.acceleration / (speed * speed * scale)]
            return np.array(found if state.size == 2 else [*found, at.current_rate / speed])

        return rates

    def _along(self, ends: Ends, anchor: Anchor | None, state: Array) -> RateField | None:
        """The same rates at many instants at once; None where branches are decided at every instant."""
        dynamics, speed, scale, circuit = self.dynamics, self.speed, self.scale, self.dynamics.circuit
        if anchor is None and dynamics.branching:
            return None
        place = anchor or Anchor(0.5 * (ends[0] + ends[1]), None, None)
        sizes = [1.0, 1.0 / scale]
        if circuit is not None:
            sizes.append(max(abs(float(state[2])), abs(circuit.voltage / circuit.resistance)))

        def rates(tau: Array, states: Array) -> Array:
            pace = 1.0 + scale * states[1]
            current = states[2] if circuit is not None else 0.0
            at = dynamics.along(states[0], place, speed * pace, np.zeros_like(tau), current, ends)
            found = [pace, at.acceleration / (speed * speed * scale)]
            return np.array(found if circuit is None else [*found, at.current_rate / speed])

        return RateField(rates, np.array(sizes), stiffness(dynamics.machine))

    def _anchor(self, state: Array, ends: Ends) -> Anchor | None:
        """Where branches are decided in the coming stretch, a little ahead; None where position alone decides them."""
        if not self.dynamics.branching:
            return None
        phi, width = float(state[0]), ends[1] - ends[0]
        rate = self._rates(ends, None)(0.0, state)
        ahead = _AHEAD * width / float(rate[0])
        held = min(max(phi + ahead * float(rate[0]), ends[0] + _AHEAD * width), ends[1] - 0.01 * _AHEAD * width)
        omega = float(self._omega(float(state[1] + ahead * rate[1])))
        anchor = Anchor(held, omega, 0.0)
        current = float(state[2] + ahead * rate[2]) if state.size > 2 else 0.0
        now = self.dynamics.at(held, held, omega, current=current, ends=ends, anchor=anchor)
        return anchor._replace(factors=now.factors or None)

    def _watch(self, anchor: Anchor, state: Array) -> Watch:
        """What ends the coming stretch, with the sides that it is on at the anchor."""

        def values(tau: Array, states: Array) -> Array:
            current = states[2] if states.shape[0] > 2 else 0.0
            omega = np.asarray(self._omega(states[1]))
            found = self.dynamics.sides(states[0], anchor, omega, np.zeros_like(tau), current)
            return np.array(found, dtype=float).reshape(len(found), tau.size)  # none where no load switches in this piece

        current = state[2:3] if state.size > 2 else 0.0
        here = np.array([anchor.phi]), anchor, np.array([anchor.omega]), np.zeros(1), current
        return Watch(values, np.array([1.0 if side[0] >= 0.0 else -1.0 for side in self.dynamics.sides(*here)]))
