"""Estimated errors of the figures of a motion that was followed, absolute, under the names that its JSON has them by.

All compare the motion with the run before it, of wider tolerance, and add what the error of position and speed makes of
them. They hold for the flywheel and the balance as printed, whose own errors stand beside them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from flywheel.following import Trail
from flywheel.piecewise import ROUNDING
from flywheel.transients.looking import Peak, Samples, close, sampled, summits, worked
from flywheel.transients.record import Transient
from flywheel.transients.telling import SHARE, energy_of, peaks_of, reached

Array = NDArray[np.float64]

_COLUMNS = {"speed": "omega", "torque": "drive", "power": "power", "current": "current"}


@np.errstate(all="ignore")  # of a figure without a scale nothing is known
def estimates(transient: Transient) -> dict[str, Any]:
    """Errors in the figures' own units; None where there is no figure, or nothing is known of its error."""
    motion = transient.motion
    fine, rough = motion.trail, motion.rough
    assert fine is not None
    other = fine if rough is None or not rough.stretches else rough
    samples, owners = close(fine)
    before, sides = close(other)
    fastest = float(np.abs(samples.omega).max())
    way = max(float(np.ptp(samples.phi)), fine.dynamics.machine.scene.cycle / (2 * np.pi))
    position, speed, time = motion.error * way, motion.error * fastest, motion.error * transient.time
    peaks: dict[str, Any] = {}
    old = peaks_of(other, before, sides)
    for name, column in _COLUMNS.items():
        now, then = getattr(transient.peaks, name), getattr(old, name)
        if now is None or then is None:
            peaks[name] = None
            continue
        value = motion.share * abs(now.value - then.value) + motion.error * float(np.abs(getattr(samples, column)).max())
        peaks[name] = {"value": value, "time": time + _when(fine, column, samples, owners, now, value)}
    return {
        **transient.given_errors,
        "end": {"t": time, "phi": position, "omega": 0.0 if transient.omega == 0.0 else speed},
        "way": position,
        "turns": position / (2 * np.pi),
        "time_to_95_percent": _late(transient, other, before, speed, time),
        "peaks": peaks,
        "energy": _energies(transient, energy_of(worked(other), before.kinetic)._asdict(), float(samples.kinetic.max())),
    }


def of_samples(transient: Transient, points: int) -> dict[str, float | None]:
    """The greatest error of each column of the motion over so many times, evenly."""
    motion = transient.motion
    assert motion.trail is not None
    rough = motion.trail if motion.rough is None or not motion.rough.stretches else motion.rough
    times = np.linspace(0.0, min(motion.trail.t[-1], rough.t[-1]), points)
    fine, before = sampled(motion.trail, times), sampled(rough, times)
    found: dict[str, float | None] = {"t": ROUNDING * float(times[-1])}
    for name, now, then in zip(Samples._fields[1:], fine[1:], before[1:], strict=True):
        found[name] = None
        if now is not None and then is not None:
            found[name] = motion.share * float(np.abs(now - then).max()) + 2 * motion.error * float(np.abs(now).max())
    return found


def _late(transient: Transient, other: Trail, before: Samples, speed: float, time: float) -> float | None:
    """Error (s) of the time to 95 % of the regime: what speed and regime are off by, over the acceleration there."""
    when, steady = transient.time_to_regime, transient.regime_speed
    if when is None or steady is None:
        return None
    if when == 0.0:
        return 0.0
    assert transient.motion.trail is not None
    then = reached(other, SHARE * steady, before.t, before.omega)
    acceleration = abs(float(sampled(transient.motion.trail, np.array([when])).acceleration[0]))
    off = (speed + SHARE * (transient.given_errors["regime_speed"] or 0.0)) / acceleration
    return None if then is None else transient.motion.share * abs(when - then) + off + time


def _when(trail: Trail, name: str, samples: Samples, owners: NDArray[np.intp], top: Peak, off: float) -> float:
    """How far (s) from a peak's time its column may be as great, as far as its values are known.

    The column falls from a peak at least as a parabola does, or evenly, to its samples on either side; other summits count
    where they may be as great.
    """
    values = getattr(samples, name)
    near = [one for one in summits(trail, name, samples, owners) if one.value >= top.value - 2 * off]
    far = max(abs(one.time - top.time) for one in near)
    lower = np.flatnonzero(values < top.value - 2 * off)
    wide = 0.0
    for beside in (lower[samples.t[lower] <= top.time][-1:], lower[samples.t[lower] >= top.time][:1]):
        for k in beside:
            share = min(2 * off / (top.value - float(values[k])), 1.0)
            wide = max(wide, abs(float(samples.t[k]) - top.time) * float(np.sqrt(share)))
    return far + wide


def _energies(transient: Transient, before: dict[str, Any], kinetic: float) -> dict[str, Any]:
    """Errors (J) of works, heats and kinetic energy: of two runs, of speeds, and of how far all of it closes."""
    energy, motion = transient.energy, transient.motion
    scale = max(kinetic, abs(energy.drive), energy.meshes, *map(abs, energy.works.values()), 1e-300)
    share = 2 * motion.error + energy.residual

    def off(now: float | None, then: float | None) -> float | None:
        if now is None or then is None:
            return None
        return motion.share * abs(now - then) + share * max(scale, abs(now))

    found = {name: off(value, before[name]) for name, value in energy._asdict().items() if name not in ("works", "residual")}
    return found | {"works": {name: off(value, before["works"].get(name)) for name, value in energy.works.items()}}
