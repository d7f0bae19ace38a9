"""Two thousand turns without loads: position and speed against an elliptic integral, and the drift that is stated."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest
from mpmath import mp  # type: ignore[import-untyped]

import flywheel
from flywheel.motions.simulation import Motion

from .machines import Scene
from .measured import Row

R, YOKE, CRANK, SPEED = 0.1, 2.0, 0.05, 10.0
TURNS = 2000
RTOL = 1e-7


def scene(**more: Any) -> Scene:
    """A yoke with a crank that weighs."""
    machine = {"type": "scotch-yoke", "crank": {"length": R, "inertia": CRANK}, "yoke": {"mass": YOKE}}
    return {"mechanism": machine, "regime": {"speed": SPEED}, "flywheel": {"inertia": 0.0}} | more


def period() -> float:
    """Time of a turn: omega = w / sqrt(1 + k sin²), k = m R²/J, so that t = E(phi | -k) / w."""
    with mp.workdps(30):
        return float(4 * mp.ellipe(-mp.mpf(YOKE) * mp.mpf(R) ** 2 / mp.mpf(CRANK)) / SPEED)


class Followed(NamedTuple):
    """A motion, and how far off its last position (a share of the way) and speed are."""

    motion: Motion
    position: float
    speed: float


@cache
def followed(turns: int) -> Followed:
    """So many turns, to phi = 0 again."""
    motion = flywheel.simulate(flywheel.load(scene()), phi=0, omega=SPEED, until=turns * period(), rtol=RTOL)
    way = 2 * np.pi * turns
    return Followed(motion, abs(float(motion.phi[-1]) / way - 1), abs(float(motion.omega[-1]) / SPEED - 1))


def results() -> list[Row]:
    """Position and speed at the end, and the drift in each cycle."""
    motion, position, speed = followed(TURNS)
    span = f"{TURNS} turns"
    drift = f"energy drift stated: {motion.drift:.1g} a cycle, {motion.energy_residual:.1g} in all"
    return [
        Row("free motion, position", span, position, motion.error, "elliptic integral"),
        Row("free motion, speed at phi = 0", span, speed, motion.error, drift),
    ]


@pytest.mark.slow
def test_thousands_of_turns_end_where_and_as_they_must() -> None:
    motion, position, speed = followed(TURNS)
    assert max(position, speed) <= motion.error <= RTOL
    assert motion.trail is not None
    assert motion.trail.cycles >= TURNS - 1
    assert motion.trail.repeated > TURNS - 5


@pytest.mark.slow
def test_the_energy_drift_is_stated_and_does_not_add_up() -> None:
    motion = followed(TURNS).motion
    assert 0.0 <= motion.drift < 1e-11
    assert motion.energy_residual <= motion.error
    short = followed(20).motion
    assert short.drift <= 1e-11
    assert abs(float(short.omega[-1]) / SPEED - 1) <= short.error


@pytest.mark.slow
def test_the_speed_returns_at_every_turn() -> None:
    motion = followed(TURNS).motion
    times = period() * np.array([1, 2, 3, 57, 500, 1234, TURNS - 1])
    phi, omega = motion.at(times)
    assert phi / (2 * np.pi) == pytest.approx(times / period(), rel=motion.error)
    assert omega == pytest.approx(SPEED, rel=motion.error)


def test_a_motion_that_does_not_return_is_stepped_to_its_end() -> None:
    """2 N m on a rotor of 1 kg m²: each turn adds as much energy."""
    rotor = {"inertia": [{"on": "crank", "value": 1}], "drive": {"torque": 2}, "regime": {"speed": 1}}
    motion = flywheel.simulate(flywheel.load(rotor | {"flywheel": {"inertia": 0.0}}), phi=0, omega=1.0, until=10)
    assert motion.trail is not None
    assert motion.trail.repeated == 0
    assert motion.omega[-1] == pytest.approx(21.0, rel=1e-9)


@pytest.mark.slow
def test_a_balanced_machine_returns_and_one_out_of_balance_by_little_does_not() -> None:
    load = [{"on": "crank", "torque": -5, "from": 0, "to": "90 deg"}]
    machine = flywheel.load(scene(load=load, drive={"torque": "balance"}, flywheel={"inertia": 1.0}))
    held = flywheel.simulate(machine, phi=0, omega=SPEED, until=30 * 2 * np.pi / SPEED, rtol=1e-6)
    off = flywheel.simulate(machine, phi=0, omega=SPEED, until=30 * 2 * np.pi / SPEED, rtol=1e-6, balance=1.25 + 1e-9)
    assert held.trail is not None
    assert held.trail.repeated > 20
    assert off.trail is not None
    assert off.trail.repeated == 0


@pytest.mark.slow
def test_a_transient_of_many_turns_ends_with_its_last_turn() -> None:
    ended = flywheel.transient(flywheel.load(scene()), start=SPEED, end="2 turns", rtol=RTOL)
    assert ended.reason == "way"
    assert ended.time == pytest.approx(2 * period(), rel=RTOL)
