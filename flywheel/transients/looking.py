"""What a machine does along a motion that was followed: acceleration, moments, power and energy at any times."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.following import Trail
from flywheel.instant import Anchor
from flywheel.motors.dc import DC
from flywheel.motors.induction import Induction

Array = NDArray[np.float64]

_TOGETHER = 20_000  # times that are looked at in one go
_GAUSS = 10  # nodes in a step
_TOPS = 64  # how many of the highest samples are looked at more closely
_FINER, _ROUNDS = 33, 4  # times between the neighbours of a top, and how often they are laid closer

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


def sampled(trail: Trail, times: Array, owners: NDArray[np.intp] | None = None) -> Samples:
    """The motion at times within it; at an end of a stretch `owners` tell the side (the one before, where they are None)."""
    owners = trail.owners(times) if owners is None else owners
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


def switching(trail: Trail) -> tuple[Array, NDArray[np.intp]]:
    """Times at which a law switches or a piece ends, each twice, and the stretches on either side."""
    stretches = trail.stretches
    last = np.array(
        [k for k in range(len(stretches) - 1) if stretches[k].anchor is not stretches[k + 1].anchor], dtype=np.intp
    )
    return np.repeat(trail.t[last + 1], 2), np.column_stack((last, last + 1)).ravel()


def within(trail: Trail, inside: Array) -> tuple[Array, NDArray[np.intp]]:
    """Times in every stretch, at its ends and at shares (0 to 1) of it, and the stretches that they belong to."""
    shares = np.concatenate(([0.0], inside, [1.0]))
    start, end = trail.t[:-1, None], trail.t[1:, None]
    times = start + (end - start) * shares
    times[:, -1] = trail.t[1:]
    return times.ravel(), np.repeat(np.arange(len(trail.stretches)), shares.size)


class Works(NamedTuple):
    """Work (J) of all that pushes or drags, by its part; what meshes took (J); heat of a DC motor's armature (J).

    `rotor` is the heat of an induction motor's rotor (J).
    """

    by_part: dict[str, float]
    meshes: float
    copper: float | None
    rotor: float | None


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
    motor, ratio = trail.dynamics.machine.scene.motor, trail.dynamics.ratio
    copper = 0.0 if isinstance(motor, DC) else None
    rotor = 0.0 if isinstance(motor, Induction) else None
    meshes = 0.0
    for k in range(0, times.size, _TOGETHER):
        some = slice(k, k + _TOGETHER)
        states = trail.states(times[some], owners[some])
        here = _here(trail, times[some], owners[some], states)
        pace = weights[some] * states[1]
        for part, moment in trail.dynamics.moments(*here).items():
            parts[part] = parts.get(part, 0.0) + float(pace @ moment)
        meshes += float(pace @ trail.dynamics.along(*here).loss)
        current = drive_current(trail, states)
        if isinstance(motor, DC) and copper is not None and current is not None:
            copper += float(weights[some] @ motor.copper_heat(current))
        if isinstance(motor, Induction) and rotor is not None:
            rotor += float(weights[some] @ motor.rotor_heat(ratio * states[1]))
    return Works(parts, meshes, copper, rotor)


class Peak(NamedTuple):
    """A greatest value and the time (s) at which it is reached."""

    value: float
    time: float


def close(trail: Trail) -> tuple[Samples, NDArray[np.intp]]:
    """The motion in every stretch, at both its ends and at ten times between, and the stretches that these belong to."""
    points, _ = np.polynomial.legendre.leggauss(_GAUSS)
    times, owners = within(trail, 0.5 * (1.0 + points))
    return sampled(trail, times, owners), owners


def peak(trail: Trail, name: str, samples: Samples, owners: NDArray[np.intp]) -> Peak:
    """The greatest value of a column of `close` samples: on either side of every jump, or between two samples of a stretch.

    About the highest samples it is looked for again, closer each time.
    """
    return max(summits(trail, name, samples, owners), key=lambda one: one.value)


def summits(trail: Trail, name: str, samples: Samples, owners: NDArray[np.intp]) -> list[Peak]:
    """The greatest values about each of the highest samples; the very greatest sample first."""
    times, values = samples.t, getattr(samples, name)
    best = int(values.argmax())
    tops = _tops(values, owners)
    own = owners[tops]
    summit = [Peak(float(values[best]), float(times[best])), *(Peak(float(values[k]), float(times[k])) for k in tops)]
    low, high = (times[_beside(tops, owners, side)] for side in (-1, 1))
    for _ in range(_ROUNDS):
        grid = np.linspace(low, high, _FINER, axis=1)
        finer = getattr(sampled(trail, grid.ravel(), np.repeat(own, _FINER)), name).reshape(grid.shape)
        rows, column = np.arange(tops.size), finer.argmax(axis=1)
        here = map(Peak, finer[rows, column].tolist(), grid[rows, column].tolist())
        summit[1:] = [max(pair, key=lambda one: one.value) for pair in zip(summit[1:], here, strict=True)]
        low, high = grid[rows, np.maximum(column - 1, 0)], grid[rows, np.minimum(column + 1, _FINER - 1)]
    return summit


def _tops(values: Array, owners: NDArray[np.intp]) -> NDArray[np.intp]:
    """The highest samples that no neighbour in their stretch exceeds."""
    every = np.arange(values.size)
    top = np.logical_and.reduce([values >= values[_beside(every, owners, side)] for side in (-1, 1)])
    found = np.flatnonzero(top)
    return np.asarray(found[np.argsort(values[found], kind="stable")[-_TOPS:]])


def _beside(which: NDArray[np.intp], owners: NDArray[np.intp], side: int) -> NDArray[np.intp]:
    """The neighbours of samples, or they themselves where their stretch ends."""
    other = np.clip(which + side, 0, owners.size - 1)
    return np.where(owners[other] == owners[which], other, which)
