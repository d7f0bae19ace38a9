"""Regimes that hardly hold, or hold hard: multipliers near 1, near a stall, against growth, strong damping."""

from __future__ import annotations

from functools import cache
from typing import Any

import pytest
from mpmath import mp  # type: ignore[import-untyped]

import flywheel
from flywheel.sizing.results import Sizing
from tests.limits import sample

from . import rotors
from .measured import Found, Row, refusal, worst
from .rotors import OWN, Rotor

WEAK = ("1e-1", "1e-3", "1e-5", "1e-7", "1e-9", "1e-11")  # N m s: 1 - multiplier is 0.105 times as much
NEAR_STALL = ("1.9", "1.99", "1.999", "1.9999", "1.99999", "1.999999")
AGAINST_GROWTH = ("0.5", "1.5", "1.8", "1.9", "1.95", "1.99")
STRONG = (3e3, 3e4, 3e5)  # N m s: a load of 100 N m on a drive of up to 6 MN m
BALANCED: dict[str, Any] = {"regime": {"speed": 20}}
LIGHT: dict[str, Any] = {"regime": {"speed": 5}, "inertia": [{"on": "crank", "value": 1e-3}]}


def sized(scene: dict[str, Any]) -> Sizing:
    """The scene, sized without time stepping."""
    return flywheel.size(flywheel.load(scene), simulate=False)


def off(found: float | None, true: Any) -> float:
    """Relative error."""
    assert found is not None
    return float(abs(mp.mpf(found) / true - 1))


def of_motion(what: str, found: Sizing, true: Rotor) -> Found:
    """The worst of an analysis' irregularity, mean and extremes of speed."""
    motion, error = found.simulation, found.error.simulation
    assert motion is not None
    assert error is not None
    pairs = [(motion.irregularity, true.irregularity), (found.speed, true.speed), (motion.speed_max, true.fastest)]
    return Found(what, max(off(*pair) for pair in [*pairs, (motion.speed_min, true.slowest)]), error)


def of_wheel(what: str, found: Sizing, true: Rotor, own: float = OWN) -> Found:
    """A sized inertia, by the measure of the whole one."""
    assert found.flywheel.exact is not None
    assert found.error.exact is not None
    return Found(what, off(found.flywheel.exact + own, true.inertia), found.error.exact)


@cache
def weak() -> list[Found]:
    """A drive that hardly depends on speed, around 25 N m at 20 rad/s: given and sized flywheels."""
    found = []
    for slope in WEAK:
        with mp.workdps(60):  # what the expression says of its doubles
            line = f"25 - {slope}*(omega - 20)"
            torque = 25 + mp.mpf(float(slope)) * 20
        given = rotors.on_a_line(torque, mp.mpf(float(slope)), 20, inertia=3)
        found.append(of_motion(slope, sized(rotors.scene(line, {"inertia": 1})), given))
        asked = rotors.on_a_line(torque, mp.mpf(float(slope)), 20, inertia=5.9, irregularity=mp.mpf(0.05))
        found.append(of_wheel(slope, sized(rotors.scene(line, {"irregularity": 0.05})), asked))
    return found


@cache
def stalling() -> list[Found]:
    """A flywheel just heavy enough for the load not to stop it."""
    found, guess = [], (4, 14)
    for eps in NEAR_STALL:
        true = rotors.on_a_line(60, 2, guess[1], inertia=guess[0], irregularity=mp.mpf(float(eps)))
        guess = true.inertia, true.speed
        scene = rotors.scene("60 - 2*omega", {"irregularity": float(eps)}, inertia=[{"on": "crank", "value": 1e-3}])
        found.append(of_wheel(eps, sized(scene), true, 1e-3))
    return found


@cache
def growing() -> list[Found]:
    """A load that falls with speed: what a cycle changes grows, up to the multiplier's size."""
    found = []
    for eps in AGAINST_GROWTH:
        scene = rotors.scene("balance", {"irregularity": float(eps)}, "-400/omega", "180 deg", **LIGHT)
        found.append(of_wheel(eps, sized(scene), rotors.held(400, 5, mp.mpf(float(eps))), 1e-3))
    return found


@cache
def damped() -> list[Found]:
    """A damper that overcomes everything else, and a balance that makes up for it."""
    found = []
    for slope in STRONG:
        scene = rotors.scene("balance", {"inertia": 1}, damper=[{"on": "crank", "coefficient": slope}], **BALANCED)
        found.append(of_motion(f"{slope:g}", sized(scene), rotors.damped(slope, 20, 3)))
    return found


GROUPS = {
    "multiplier near 1": (weak, "1 - multiplier from 1e-2 to 1e-12"),
    "near a stall": (stalling, "irregularity 1.9 to 1.999999"),
    "load c/omega, held by a balance": (growing, "irregularity 0.5 to 1.99"),
    "strong damper": (damped, "up to 6e4 times the load's own moment"),
}
REFUSED = {
    "held by less than rounding": (
        rotors.scene("25 - 1e-14*(omega - 20)", {"inertia": 1}),
        "drive",
        "hardly depend on speed",
    ),
    "held by nothing": (rotors.scene("25 + 0*omega", {"inertia": 1}), "drive", "leave the speed open"),
    "let go by the least bit": (rotors.scene("25 + 1e-10*(omega - 20)", {"inertia": 1}), "drive", "unstable regime"),
    "too light": (rotors.scene("60 - 2*omega", {"inertia": 0}, **LIGHT), "flywheel.inertia", "stalls at crank angle"),
    "lost in a damper": (
        rotors.scene("balance", {"inertia": 1}, damper=[{"on": "crank", "coefficient": 3e9}], **BALANCED),
        "flywheel.inertia",
        "lost in the rounding",
    ),
}


def results() -> list[Row]:
    """The worst figure of every group, and the words of every refusal."""
    rows = [worst(name, span, group()) for name, (group, span) in GROUPS.items()]
    return rows + [Row("regime refused", key, None, None, refusal(scene)) for key, (scene, *_) in REFUSED.items()]


@pytest.mark.parametrize("name", sample(GROUPS, 4))
def test_every_figure_is_known_to_its_estimate(name: str) -> None:
    assert [found for found in GROUPS[name][0]() if not found.honest] == []


def test_what_holds_a_speed_ten_times_less_costs_one_digit() -> None:
    for found, slope in zip(weak(), [s for s in WEAK for _ in range(2)], strict=True):
        assert found.error < 2e-15 / float(slope) + 1e-12  # a few roundings, by the slope that holds the speed
        assert found.estimate < 2e-13 / float(slope) + 1e-9


@pytest.mark.parametrize("power", [-12, -6, 6, 12])
def test_a_scale_of_time_or_of_mass_scales_what_is_found(power: int) -> None:
    """Torques by mass or by 1/time², the slope by mass or by 1/time."""
    scale, wheel = 10.0**power, {"irregularity": 0.05}
    plain = sized(rotors.scene("45 - omega", wheel))
    heavy = rotors.scene(f"{45 * scale!r} - {scale!r}*omega", wheel, -rotors.LOAD * scale)
    heavier = sized(heavy | {"inertia": [{"on": "crank", "value": OWN * scale}]})
    faster = sized(rotors.scene(f"{45 * scale**2!r} - {scale!r}*omega", wheel, -rotors.LOAD * scale**2))
    assert heavier.flywheel.exact == pytest.approx((plain.flywheel.exact or 0.0) * scale, rel=1e-13)
    assert heavier.speed == pytest.approx(plain.speed, rel=1e-13)
    assert faster.flywheel.exact == pytest.approx(plain.flywheel.exact, rel=1e-13)
    assert faster.speed == pytest.approx(plain.speed * scale, rel=1e-13)


@pytest.mark.slow
def test_near_a_stall_and_against_growth_sizing_keeps_its_digits() -> None:
    for found in (*stalling(), *growing()):
        assert found.error < 1e-11
        assert found.estimate < 1e-8


def test_a_hardly_held_machine_is_sized_as_one_with_a_balance_at_its_speed() -> None:
    hardly = sized(rotors.scene("25 - 1e-6*(omega - 20)", {"irregularity": 0.05}))
    held = sized(rotors.scene("balance", {"irregularity": 0.05}, regime={"speed": hardly.speed}))
    assert hardly.flywheel.exact == pytest.approx(held.flywheel.exact, rel=1e-6)


def test_an_irregularity_beyond_the_bare_machines_needs_no_flywheel() -> None:
    lighter = rotors.scene("balance", {"irregularity": 1.95}, "-400/omega", "180 deg", regime={"speed": 5})
    found = sized(lighter)
    assert found.flywheel.exact == 0.0
    assert found.flywheel.needed is False
    assert found.run is not None
    bare = rotors.held(400, 5, mp.mpf(found.run.irregularity))
    assert float(bare.inertia) == pytest.approx(OWN, rel=1e-9)


@pytest.mark.parametrize("name", sample(REFUSED, 5))
def test_a_regime_that_cannot_be_is_refused_with_its_reason(name: str) -> None:
    scene, path, words = REFUSED[name]
    said = refusal(scene)
    assert said.startswith(f"{path}: found ")
    assert words in said
