"""What a machine does along a motion that was followed: acceleration, moments, power and energy at any times."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.following import Trail
from flywheel.instant import Anchor
from flywheel.motors.dc import DC

Array = NDArray[np.float64]

_TOGETHER = 20_000  # times that are looked at in one go
_GAUSS = 10  # nodes in a step
_TOPS = 4  # how many of the highest samples are looked at more closely

DRIVE = "drive"


class Samples(NamedTuple):
    """A motion at times t (s): phi (rad, not reduced), omega (rad/s), acceleration (rad/s²), moment M* less losses (N m).

    `drive` is the drive's torque at its own shaft (N m), `power` what it gives (W), `loss` what meshes lose (W), `kinetic`
    the kinetic energy (J), `current` a motor's (A; None without a DC motor). On a stroke whose driver slides: m, m/s, N.
    """

    t: Array
    phi: Array
    omega: Array
    acceleration: Array
    moment: Array
    drive: Array
    power: Array
    loss: Array
    kinetic: Array
    current: Array | None


class _Here(NamedTuple):
    """States at some times, with what the machine's laws need to know there."""

    phi: Array
    anchor: Anchor
    omega: Array
    time: Array
    current: Any


def sampled(trail: Trail, times: Array) -> Samples:
    """The motion at times within it."""
    owners = trail.owners(times)
    parts = [_sampled(trail, times[k : k + _TOGETHER], owners[k : k + _TOGETHER]) for k in range(0, times.size, _TOGETHER)]
    joined: list[Any] = [None if column[0] is None else np.concatenate(column) for column in zip(*parts, strict=True)]
    return Samples._make(joined)


def _sampled(trail: Trail, times: Array, owners: NDArray[np.intp]) -> Samples:
    dynamics, states = trail.dynamics, trail.states(times, owners)
    here = _here(trail, times, owners, states)
    now = dynamics.along(*here)
    moments = dynamics.moments(*here)
    drive = moments.get(DRIVE, np.zeros_like(times))
    kinetic = 0.5 * now.inertia * states[1] ** 2
    current = drive_current(trail, states)
    power, loss = drive * states[1], now.loss * states[1]
    shaft = drive / dynamics.ratio
    return Samples(times, states[0], states[1], now.acceleration, now.moment, shaft, power, loss, kinetic, current)


def drive_current(trail: Trail, states: Array) -> Array | None:
    """The current (A) of a DC motor: a state of its own, or what its speed makes it."""
    if states.shape[0] > 3:
        return np.asarray(states[3])
    motor = trail.dynamics.machine.scene.motor
    if not isinstance(motor, DC):
        return None
    return np.asarray(motor.current(trail.dynamics.ratio * states[1]))


def _here(trail: Trail, times: Array, owners: NDArray[np.intp], states: Array) -> _Here:
    used, where = np.unique(owners, return_inverse=True)
    stretches = [trail.stretches[k] for k in used]
    offset = np.array([stretch.offset for stretch in stretches])[where]
    anchors = np.array([stretch.anchor[:3] for stretch in stretches])[where]
    factors: tuple[Any, ...] | None = None
    if stretches[0].anchor.factors is not None:
        rows = np.array([stretch.anchor.factors for stretch in stretches])[where]
        factors = tuple(rows.T)
    anchor = Anchor(anchors[:, 0], anchors[:, 1], anchors[:, 2], factors)
    current = states[3] if states.shape[0] > 3 else 0.0
    return _Here(states[0] - offset, anchor, states[1], times, current)


class Works(NamedTuple):
    """Work (J) of all that pushes or drags, by its part; what meshes took (J), and the copper loss of a DC motor (J)."""

    by_part: dict[str, float]
    meshes: float
    copper: float | None


def nodes(trail: Trail) -> tuple[Array, Array, NDArray[np.intp]]:
    """Gauss nodes in every step, their weights (s), and the stretches that they belong to."""
    points, weights = np.polynomial.legendre.leggauss(_GAUSS)
    start = np.array([stretch.step.start for stretch in trail.stretches])[:, None]
    half = 0.5 * (np.array([stretch.step.end for stretch in trail.stretches])[:, None] - start)
    owners = np.repeat(np.arange(half.size), _GAUSS)
    return (start + half * (1.0 + points)).ravel(), (half * weights).ravel(), owners


def worked(trail: Trail) -> Works:
    """Work of every part over a motion: the integral of moment times speed over every step, by Gauss quadrature.

    It follows from the motion by dense output, apart from the work that time stepping itself adds up.
    """
    times, weights, owners = nodes(trail)
    parts: dict[str, float] = {}
    meshes = copper = 0.0
    has_current = False
    for k in range(0, times.size, _TOGETHER):
        some = slice(k, k + _TOGETHER)
        states = trail.states(times[some], owners[some])
        here = _here(trail, times[some], owners[some], states)
        pace = weights[some] * states[1]
        for part, moment in trail.dynamics.moments(*here).items():
            parts[part] = parts.get(part, 0.0) + float(pace @ moment)
        meshes += float(pace @ trail.dynamics.along(*here).loss)
        current = drive_current(trail, states)
        if current is not None:
            has_current = True
            motor: Any = trail.dynamics.machine.scene.motor
            copper += float(motor.resistance * (weights[some] @ current**2))
    return Works(parts, meshes, copper if has_current else None)


class Peak(NamedTuple):
    """A greatest value and the time (s) at which it is reached."""

    value: float
    time: float


def peak(trail: Trail, name: str, samples: Samples) -> Peak:
    """The greatest value of a column of the samples, looked for again, finer each time, about the highest of its tops."""
    times, values = samples.t, getattr(samples, name)
    padded = np.concatenate(([-np.inf], values, [-np.inf]))
    tops = np.flatnonzero((padded[1:-1] >= padded[:-2]) & (padded[1:-1] >= padded[2:]))
    highest = tops[np.argsort(values[tops])[-_TOPS:]]
    return max((_top(trail, name, times, values, int(top)) for top in highest), key=lambda found: found.value)


def _top(trail: Trail, name: str, times: Array, values: Array, best: int) -> Peak:
    """The greatest value between the neighbours of a sample."""
    found = Peak(float(values[best]), float(times[best]))
    for _ in range(4):
        times = np.linspace(times[max(best - 1, 0)], times[min(best + 1, times.size - 1)], 33)
        values = getattr(sampled(trail, times), name)
        best = int(values.argmax())
        if values[best] > found.value:
            found = Peak(float(values[best]), float(times[best]))
    return found
