"""Heat of a motor's start along a motion: integrals of current and heat up to its end, against what the motor bears."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.records import NamedTuple
from flywheel.components.motors import DC, Induction, Started
from flywheel.regime.free_motion import Trail

Array = NDArray[np.float64]

_GAUSS = 10  # nodes in a step
_WHOLE = 1e-9  # by which a number of starts may miss a whole one


class StartHeat(NamedTuple):
    """What a start does to its motor, from switching on to the rated speed in its last connection.

    Args:
        title: how it is started.
        times: of its switches, s.
        time: how long it lasts, s.
        over: whether it came to that speed; else the figures are those of the whole motion.
        current_squared: integral of (I/I_n)² dt of the windings, s; None without a rated current to relate to.
        winding: heat in the rotor of an induction motor or the armature of a DC motor itself, J.
        added: heat in the resistors beside it, J.
        stator: copper heat of an induction motor's stator, J; None where the plate does not tell it.
        allowed: (I_L/I_n)² times the time for which the warm motor bears the current I_L of its locked rotor, s.
        allowed_cold: the same of the cold motor, s.

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

    @property
    def share(self) -> float | None:
        """Share of what the warm motor bears that the start takes."""
        return _ratio(self.current_squared, self.allowed)

    @property
    def share_cold(self) -> float | None:
        """Share of what the cold motor bears that the start takes."""
        return _ratio(self.current_squared, self.allowed_cold)

    @property
    def starts(self) -> int | None:
        """How many such starts the warm motor bears one upon the other."""
        return None if self.share is None else math.floor(1.0 / self.share + _WHOLE)

    @property
    def starts_cold(self) -> int | None:
        """How many the cold motor bears."""
        return None if self.share_cold is None else math.floor(1.0 / self.share_cold + _WHOLE)

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON, SI throughout."""
        told = ("share", "share_cold", "starts", "starts_cold")
        return {**self._asdict(), "times": list(self.times), **{name: getattr(self, name) for name in told}}

    def errors(self, before: StartHeat | None, share: float, relative: float) -> dict[str, float | None]:
        """Errors of its figures: `share` of the difference from a run before, and a relative error of the motion."""
        names = ("time", "current_squared", "winding", "added", "stator", "share", "share_cold")
        found: dict[str, float | None] = {}
        for name in names:
            now, then = getattr(self, name), None if before is None else getattr(before, name)
            found[name] = None if now is None or then is None else share * abs(now - then) + relative * abs(now)
        return found


def _ratio(part: float | None, whole: float | None) -> float | None:
    return None if part is None or whole is None else part / whole


def start_heat(trail: Trail) -> StartHeat | None:
    """The heat of the start that a motion begins with; None but for an induction or DC motor that has no states of its own.

    Nothing is taken off for what the motor gives to its surroundings meanwhile, so that the figures hold for starts of some
    seconds. The start ends at the rated speed after the last switch, where the current comes down to the rated one.

    With t_L the time for which the motor bears its locked rotor, what it bears is (I_L/I_n)² t_L, and a start that takes a
    share q of that may follow another 1/q times. Source: IEC 60079-7 and IEEE 620 (time of the locked rotor, I² t as a
    thermal limit); NEMA MG 1, part 12 (two starts of a cold motor, one of a warm one).
    """
    motor, ratio = trail.dynamics.machine.scene.motor, trail.dynamics.ratio
    own = motor.own if isinstance(motor, Started) else motor
    if not isinstance(own, (Induction, DC)) or trail.dynamics.circuit is not None or not trail.stretches:
        return None
    running = motor if isinstance(motor, Started) else Started(own=own, connections=(), times=())
    rated = None if own.rated is None else trail.time_to(own.rated.speed / ratio)
    over = rated is not None and len(running.times) >= len(running.connections)
    end = max([rated or 0.0, *running.times]) if over else float(trail.t[-1])
    squared, winding, added = _integrals(trail, running, end)
    known = squared is not None and (isinstance(own, Induction) or own.rated_current is not None)
    stator = own.rated_stator_heat if isinstance(own, Induction) else None
    warm = cold = None
    if isinstance(own, Induction):
        locked = float(own.current_share(0.0)) ** 2
        times = own.plate.locked_rotor_time, own.plate.locked_rotor_time_cold
        warm, cold = (None if time is None else locked * time for time in times)
    title = "direct on line" if own.start is None else own.start.title
    return StartHeat(
        title=title,
        times=running.times,
        time=min(end, float(trail.t[-1])),
        over=over,
        current_squared=squared if known else None,
        winding=winding,
        added=added,
        stator=None if stator is None or squared is None else stator * squared,
        allowed=warm,
        allowed_cold=cold,
    )


def _integrals(trail: Trail, running: Started, end: float) -> tuple[float | None, float, float]:
    """Integrals over time up to an end (s): of the windings' current over the rated one squared (s), of both heats (J)."""
    points, weights = np.polynomial.legendre.leggauss(_GAUSS)
    first, last = trail.t[:-1], np.minimum(trail.t[1:], end)
    used = np.flatnonzero(last > first)
    half = 0.5 * (last - first)[used, None]
    times = (first[used, None] + half * (1.0 + points)).ravel()
    lasting, owners = (half * weights).ravel(), np.repeat(used, _GAUSS)
    omega = trail.dynamics.ratio * trail.states(times, owners)[1]
    within = trail.anchors(owners)[1].time
    current = running.windings_at(omega, times, within)
    heats = running.heat_at(omega, times, within), running.added_heat_at(omega, times, within)
    winding, added = (0.0 if heat is None else float(lasting @ heat) for heat in heats)
    return (None if current is None else float(lasting @ current**2)), winding, added
