"""Extreme motions: long ones, standing masses, weak regimes."""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp  # type: ignore[import-untyped]

import flywheel
from flywheel import Motion, Sizing
from tests.extremes import machines
from tests.extremes.machines import OWN, Rotor, Scene
from tests.extremes.measured import Found, Row, refusal, worst
from tests.limits import sample

# Two thousand turns without loads: position and speed against an elliptic integral, and the drift that is stated.


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
    state = flywheel.simulate(machine, phi=0, omega=SPEED, until=30 * 2 * np.pi / SPEED, rtol=1e-6)
    off = flywheel.simulate(machine, phi=0, omega=SPEED, until=30 * 2 * np.pi / SPEED, rtol=1e-6, balance=1.25 + 1e-9)
    assert state.trail is not None
    assert state.trail.repeated > 20
    assert off.trail is not None
    assert off.trail.repeated == 0


@pytest.mark.slow
def test_a_transient_of_many_turns_ends_with_its_last_turn() -> None:
    ended = flywheel.transient(flywheel.load(scene()), start=SPEED, end="2 turns", rtol=RTOL)
    assert ended.reason == "way"
    assert ended.time == pytest.approx(2 * period(), rel=RTOL)


# Motion without any load, inertia that vanishes, flywheels that come out negative, and dead centres: in closed form.


STANDING_R, L, MASS, STANDING_SPEED = 0.1, 0.3, 2.0, 10.0
FREE = (1e-14, 1e-6, 0.05, 1.0, 1.99)
DWELL = "0.1*sin(phi)**3 if phi < pi else 0"  # max x'² = 0.09 (4/27): at sin² = 2/3


def yoke(eps: float, **more: Any) -> Scene:
    """A yoke of 2 kg, and nothing else: I* = m R² sin²."""
    machine = {"type": "scotch-yoke", "crank": {"length": STANDING_R}, "yoke": {"mass": MASS}}
    return {"mechanism": machine, "regime": {"speed": STANDING_SPEED}, "flywheel": {"irregularity": eps}} | more


def slider(wheel: dict[str, float], crank: float = 0.0, **more: Any) -> Scene:
    """A slider of 2 kg on a crank that may weigh nothing."""
    lengths = {"crank": {"length": STANDING_R, "inertia": crank}, "rod": {"length": L}, "slider": {"mass": MASS}}
    return {"mechanism": {"type": "slider-crank"} | lengths, "regime": {"speed": STANDING_SPEED}, "flywheel": wheel} | more


def dwelling(eps: float, **more: Any) -> Scene:
    """A slide of 3 kg that rests for half a turn."""
    machine = {"type": "law", "outputs": {"slide": {"x": DWELL, "mass": 3}}}
    return {"mechanism": machine, "regime": {"speed": STANDING_SPEED}, "flywheel": {"irregularity": eps}} | more


def sized(scene: Scene, *, simulate: bool = False) -> Sizing:
    """The scene, sized."""
    return flywheel.size(flywheel.load(scene), simulate=simulate)


def slider_peak() -> Any:
    """The greatest I* of the slider: m x'² at its greatest speed."""

    def speed(phi: Any) -> Any:
        return (
            STANDING_R
            * mp.sin(phi)
            * (1 + STANDING_R * mp.cos(phi) / mp.sqrt(mp.mpf(L) ** 2 - (STANDING_R * mp.sin(phi)) ** 2))
        )

    return mp.mpf(MASS) * speed(mp.findroot(lambda phi: mp.diff(speed, phi), mp.mpf("1.27"))) ** 2


def free(eps: float, most: Any, least: Any = 0) -> Any:
    """The flywheel of M* = 0: (z- max I* - z+ min I*)/(2 eps), and no less than none."""
    e = mp.mpf(eps)
    return max(((1 - e / 2) ** 2 * most - (1 + e / 2) ** 2 * least) / (2 * e), mp.zero)


def standing_machines() -> dict[str, tuple[Any, Any]]:
    """Functions from an irregularity to a scene, and its greatest I*."""
    return {
        "yoke": (yoke, mp.mpf(MASS) * mp.mpf(STANDING_R) ** 2),
        "slider-crank": (lambda eps: slider({"irregularity": eps}), slider_peak()),
        "dwell": (dwelling, mp.mpf(3) * mp.mpf("0.01") * 9 * mp.mpf(4) / 27),
    }


@cache
def without_loads() -> list[Found]:
    """Name, true error and estimate of every machine at every irregularity; errors by the scale of the figure."""
    outcome = []
    with mp.workdps(30):
        for name, (scene, most) in standing_machines().items():
            for eps in FREE:
                result, true = sized(scene(eps)), free(eps, most)
                assert result.flywheel.exact is not None
                assert result.error.exact is not None
                error = float(abs(result.flywheel.exact - true) / true)
                outcome.append(Found(f"{name}, eps {eps:g}", error, result.error.exact))
    return outcome


BARE = {
    "a slider-crank": slider({"inertia": 0.0}),
    "all but": slider({"inertia": 1e-15}),
    "a dwell": dwelling(0.05, flywheel={"inertia": 0.0}),
}


def standing() -> list[Row]:
    """Free motion, the flywheels that are not needed, and what is refused."""
    rows = [worst("M* = 0, I* down to 0", "eps 1e-14..1.99", without_loads())]
    return rows + [Row("I* = 0 and no flywheel", name, None, None, refusal(scene)) for name, scene in BARE.items()]


def test_without_loads_the_exact_flywheel_is_that_of_the_inertia_alone() -> None:
    for result in without_loads():
        assert result.honest, result
        assert result.estimate < 5e-8, result


def test_without_loads_the_areas_know_of_no_flywheel() -> None:
    result = sized(yoke(0.05), simulate=True)
    assert result.energy_fluctuation == 0.0
    assert [area.work for area in result.areas] == [0.0]
    assert result.flywheel.approximate == result.flywheel.approximate_total == 0.0
    assert result.simulation is not None
    assert result.simulation.irregularity == pytest.approx(0.05, rel=1e-10)
    assert result.simulation.irregularity_approximate is None
    assert any("no steady motion with the approximate flywheel" in said for said in result.messages)


@settings(derandomize=True, deadline=None, max_examples=8)
@given(st.floats(-12, 0.29).map(lambda power: 10.0**power), st.floats(0.0, 0.05))
def test_a_crank_that_weighs_takes_its_share_of_the_flywheel(eps: float, crank: float) -> None:
    result = sized(slider({"irregularity": eps}, crank))
    assert result.reduced_inertia is not None
    assert result.flywheel.exact is not None
    true = free(eps, result.reduced_inertia.max, result.reduced_inertia.min)
    assert result.flywheel.exact == pytest.approx(float(true), rel=1e-10, abs=1e-9 * result.reduced_inertia.max)
    assert result.flywheel.needed is (result.flywheel.exact > 0.0)


@pytest.mark.parametrize("name", BARE)
def test_a_machine_that_weighs_nothing_somewhere_is_refused_without_a_flywheel(name: str) -> None:
    said = refusal(BARE[name])
    assert said.startswith("flywheel.inertia: found I* + J = 0 kg m² at crank angle")
    assert "expected a positive inertia everywhere" in said


def test_a_dwell_is_confirmed_in_time_with_its_flywheel() -> None:
    result = sized(dwelling(0.05), simulate=True)
    assert result.simulation is not None
    assert result.error.simulation is not None
    assert abs(result.simulation.irregularity / 0.05 - 1) <= result.error.simulation < 1e-9


def test_a_flywheel_that_would_be_negative_is_none() -> None:
    """The machine's own irregularity is that of its I*: (sqrt(max) - sqrt(min)) / (sqrt(max) + sqrt(min)), twice."""
    wheel = {"on": "far", "irregularity": 1.2}
    result = sized(slider({"irregularity": 0.0}, 0.02, shafts={"far": {"ratio": 7.0}}, flywheel=wheel), simulate=True)
    assert result.flywheel.exact == 0.0
    assert result.flywheel.needed is False
    assert result.flywheel.proven_bounds is not None
    assert result.flywheel.proven_bounds[0] < 0.0
    most, least = mp.sqrt(slider_peak() + mp.mpf(0.02)), mp.sqrt(mp.mpf(0.02))
    assert result.simulation is not None
    assert result.simulation.irregularity == pytest.approx(float(2 * (most - least) / (most + least)), rel=1e-9)
    assert result.speed == STANDING_SPEED


def pushed(load: dict[str, Any]) -> Sizing:
    """A load of 100 N on the slider, in some window that reaches from dead centre to dead centre."""
    loads = [{"on": "slider"} | load]
    return sized(slider({"irregularity": 0.05}, 0.02, load=loads, drive={"torque": "balance"}))


def test_loads_that_switch_at_the_dead_centres_are_one_and_the_same() -> None:
    said: list[dict[str, Any]] = [
        {"force": -100, "while": "v > 0"},
        {"force": "-100 if v > 0 else 0"},
        {"force": -100, "from": "180 deg", "to": "360 deg"},
        {"force": "-100 if phi >= pi else 0"},
    ]
    one, *others = [pushed(load) for load in said]
    assert one.balance is not None
    assert one.balance.value == pytest.approx(100 * 2 * STANDING_R / (2 * float(mp.pi)), rel=1e-13)
    for other in others:
        assert other.balance is not None
        assert other.balance.value == pytest.approx(one.balance.value, rel=1e-13)
        assert other.flywheel.exact == pytest.approx(one.flywheel.exact, rel=1e-12)
        assert len(other.areas) == len(one.areas)


@pytest.mark.parametrize("width", [1e-3, 1e-7])
def test_a_push_at_the_dead_centre_does_no_work(width: float) -> None:
    at = [{"on": "slider", "force": -100, "from": f"{180 - width} deg", "to": f"{180 + width} deg"}]
    result = sized(slider({"irregularity": 0.05}, 0.02, load=at, drive={"torque": "balance"}))
    none = sized(slider({"irregularity": 0.05}, 0.02))
    assert result.flywheel.exact == pytest.approx(none.flywheel.exact, rel=1e-4 * width)
    assert result.balance is not None
    assert abs(result.balance.value) < 1e-12


def test_a_spring_at_rest_at_the_dead_centre_stores_what_the_stroke_takes() -> None:
    spring = [{"on": "slider", "stiffness": 1e12, "rest": STANDING_R + L}]
    result = sized(slider({"irregularity": 0.05}, 0.02, spring=spring))
    assert result.energy_fluctuation == pytest.approx(0.5 * 1e12 * (2 * STANDING_R) ** 2, rel=1e-12)
    assert len(result.areas) == 2


def test_reactions_at_the_dead_centres_are_those_of_the_slider_that_turns_back() -> None:
    """x'' = -r w² (1 ± r/l): the rod pulls the slider back, nothing presses on its guide, and the crank need not push."""
    scene = flywheel.load(slider({"inertia": 1.0}, 0.02))
    result = flywheel.joint_forces(scene, [0.0, float(mp.pi)], speed=STANDING_SPEED).mechanisms["slider-crank"]
    true = [
        -MASS * STANDING_R * STANDING_SPEED**2 * (1 + STANDING_R / L),
        MASS * STANDING_R * STANDING_SPEED**2 * (1 - STANDING_R / L),
    ]
    assert result.components["slider_pin"]["x"] == pytest.approx(true, rel=1e-12)
    assert abs(result.components["guide"]["normal"]).max() < 1e-12
    assert abs(result.action).max() < 1e-12


def test_the_graph_at_a_dead_centre_has_a_gain_of_zero_and_not_a_hole() -> None:
    scene = flywheel.load(slider({"inertia": 1.0}, 0.02, load=[{"on": "slider", "force": -100}]))
    state = flywheel.reduce(scene, [0.0, float(mp.pi)])
    assert abs(state.gains["slider-crank.slider"]).max() < 1e-16
    assert state.inertia.tolist() == [0.02, 0.02]
    assert abs(state.moment).max() < 1e-14


# Regimes that hardly hold, or hold hard: multipliers near 1, near a stall, against growth, strong damping.


WEAK = ("1e-1", "1e-3", "1e-5", "1e-7", "1e-9", "1e-11")  # N m s: 1 - multiplier is 0.105 times as much
NEAR_STALL = ("1.9", "1.99", "1.999", "1.9999", "1.99999", "1.999999")
AGAINST_GROWTH = ("0.5", "1.5", "1.8", "1.9", "1.95", "1.99")
STRONG = (3e3, 3e4, 3e5)  # N m s: a load of 100 N m on a drive of up to 6 MN m
BALANCED: dict[str, Any] = {"regime": {"speed": 20}}
LIGHT: dict[str, Any] = {"regime": {"speed": 5}, "inertia": [{"on": "crank", "value": 1e-3}]}


def sized_weak(scene: dict[str, Any]) -> Sizing:
    """The scene, sized without time stepping."""
    return flywheel.size(flywheel.load(scene), simulate=False)


def off(result: float | None, true: Any) -> float:
    """Relative error."""
    assert result is not None
    return float(abs(mp.mpf(result) / true - 1))


def of_motion(what: str, result: Sizing, true: Rotor) -> Found:
    """The worst of an analysis' irregularity, mean and extremes of speed."""
    motion, error = result.simulation, result.error.simulation
    assert motion is not None
    assert error is not None
    pairs = [(motion.irregularity, true.irregularity), (result.speed, true.speed), (motion.speed_max, true.fastest)]
    return Found(what, max(off(*pair) for pair in [*pairs, (motion.speed_min, true.slowest)]), error)


def of_wheel(what: str, result: Sizing, true: Rotor, own: float = OWN) -> Found:
    """A sized inertia, by the measure of the whole one."""
    assert result.flywheel.exact is not None
    assert result.error.exact is not None
    return Found(what, off(result.flywheel.exact + own, true.inertia), result.error.exact)


@cache
def weak() -> list[Found]:
    """A drive that hardly depends on speed, around 25 N m at 20 rad/s: given and sized flywheels."""
    result = []
    for slope in WEAK:
        with mp.workdps(60):  # what the expression says of its doubles
            line = f"25 - {slope}*(omega - 20)"
            torque = 25 + mp.mpf(float(slope)) * 20
        inputs = machines.on_a_line(torque, mp.mpf(float(slope)), 20, inertia=3)
        result.append(of_motion(slope, sized_weak(machines.scene(line, {"inertia": 1})), inputs))
        request = machines.on_a_line(torque, mp.mpf(float(slope)), 20, inertia=5.9, irregularity=mp.mpf(0.05))
        result.append(of_wheel(slope, sized_weak(machines.scene(line, {"irregularity": 0.05})), request))
    return result


@cache
def stalling() -> list[Found]:
    """A flywheel just heavy enough for the load not to stop it."""
    result, guess = [], (4, 14)
    for eps in NEAR_STALL:
        true = machines.on_a_line(60, 2, guess[1], inertia=guess[0], irregularity=mp.mpf(float(eps)))
        guess = true.inertia, true.speed
        scene = machines.scene("60 - 2*omega", {"irregularity": float(eps)}, inertia=[{"on": "crank", "value": 1e-3}])
        result.append(of_wheel(eps, sized_weak(scene), true, 1e-3))
    return result


@cache
def growing() -> list[Found]:
    """A load that falls with speed: a disturbance grows in a cycle, up to the multiplier's size."""
    result = []
    for eps in AGAINST_GROWTH:
        scene = machines.scene("balance", {"irregularity": float(eps)}, "-400/omega", "180 deg", **LIGHT)
        result.append(of_wheel(eps, sized_weak(scene), machines.held(400, 5, mp.mpf(float(eps))), 1e-3))
    return result


@cache
def damped() -> list[Found]:
    """A damper that overcomes everything else, and a balance that makes up for it."""
    result = []
    for slope in STRONG:
        scene = machines.scene("balance", {"inertia": 1}, damper=[{"on": "crank", "coefficient": slope}], **BALANCED)
        result.append(of_motion(f"{slope:g}", sized_weak(scene), machines.damped(slope, 20, 3)))
    return result


GROUPS = {
    "multiplier near 1": (weak, "1 - multiplier from 1e-2 to 1e-12"),
    "near a stall": (stalling, "irregularity 1.9 to 1.999999"),
    "load c/omega, held by a balance": (growing, "irregularity 0.5 to 1.99"),
    "strong damper": (damped, "up to 6e4 times the load's own moment"),
}
REFUSED = {
    "held by less than rounding": (
        machines.scene("25 - 1e-14*(omega - 20)", {"inertia": 1}),
        "drive",
        "hardly depend on speed",
    ),
    "held by nothing": (machines.scene("25 + 0*omega", {"inertia": 1}), "drive", "leave the speed open"),
    "let go by the least bit": (machines.scene("25 + 1e-10*(omega - 20)", {"inertia": 1}), "drive", "unstable regime"),
    "too light": (machines.scene("60 - 2*omega", {"inertia": 0}, **LIGHT), "flywheel.inertia", "stalls at crank angle"),
    "lost in a damper": (
        machines.scene("balance", {"inertia": 1}, damper=[{"on": "crank", "coefficient": 3e9}], **BALANCED),
        "flywheel.inertia",
        "lost in the rounding",
    ),
}


def weak_results() -> list[Row]:
    """The worst figure of every group, and the words of every refusal."""
    rows = [worst(name, span, group()) for name, (group, span) in GROUPS.items()]
    return rows + [Row("regime refused", key, None, None, refusal(scene)) for key, (scene, *_) in REFUSED.items()]


@pytest.mark.parametrize("name", sample(GROUPS, 4))
def test_every_figure_is_known_to_its_estimate(name: str) -> None:
    assert [result for result in GROUPS[name][0]() if not result.honest] == []


def test_what_holds_a_speed_ten_times_less_costs_one_digit() -> None:
    for result, slope in zip(weak(), [s for s in WEAK for _ in range(2)], strict=True):
        assert result.error < 2e-15 / float(slope) + 1e-12  # a few roundings, by the slope that holds the speed
        assert result.estimate < 2e-13 / float(slope) + 1e-9


@pytest.mark.parametrize("power", [-12, -6, 6, 12])
def test_a_scale_of_time_or_of_mass_scales_what_is_found(power: int) -> None:
    """Torques by mass or by 1/time², the slope by mass or by 1/time."""
    scale, wheel = 10.0**power, {"irregularity": 0.05}
    plain = sized_weak(machines.scene("45 - omega", wheel))
    heavy = machines.scene(f"{45 * scale!r} - {scale!r}*omega", wheel, -machines.LOAD * scale)
    heavier = sized_weak(heavy | {"inertia": [{"on": "crank", "value": OWN * scale}]})
    faster = sized_weak(machines.scene(f"{45 * scale**2!r} - {scale!r}*omega", wheel, -machines.LOAD * scale**2))
    assert heavier.flywheel.exact == pytest.approx((plain.flywheel.exact or 0.0) * scale, rel=1e-13)
    assert heavier.speed == pytest.approx(plain.speed, rel=1e-13)
    assert faster.flywheel.exact == pytest.approx(plain.flywheel.exact, rel=1e-13)
    assert faster.speed == pytest.approx(plain.speed * scale, rel=1e-13)


@pytest.mark.slow
def test_near_a_stall_and_against_growth_sizing_keeps_its_digits() -> None:
    for result in (*stalling(), *growing()):
        assert result.error < 1e-11
        assert result.estimate < 1e-8


def test_a_hardly_held_machine_is_sized_as_one_with_a_balance_at_its_speed() -> None:
    hardly = sized_weak(machines.scene("25 - 1e-6*(omega - 20)", {"irregularity": 0.05}))
    state = sized_weak(machines.scene("balance", {"irregularity": 0.05}, regime={"speed": hardly.speed}))
    assert hardly.flywheel.exact == pytest.approx(state.flywheel.exact, rel=1e-6)


def test_an_irregularity_beyond_the_bare_machines_needs_no_flywheel() -> None:
    lighter = machines.scene("balance", {"irregularity": 1.95}, "-400/omega", "180 deg", regime={"speed": 5})
    result = sized_weak(lighter)
    assert result.flywheel.exact == 0.0
    assert result.flywheel.needed is False
    assert result.run is not None
    bare = machines.held(400, 5, mp.mpf(result.run.irregularity))
    assert float(bare.inertia) == pytest.approx(OWN, rel=1e-9)


@pytest.mark.parametrize("name", sample(REFUSED, 5))
def test_a_regime_that_cannot_be_is_refused_with_its_reason(name: str) -> None:
    scene, path, words = REFUSED[name]
    said = refusal(scene)
    assert said.startswith(f"{path}: found ")
    assert words in said


RESULTS = {  # tables of the page of results, by their titles
    "Two thousand turns without loads: position and speed against an elliptic integral, and the stated drift": results,
    "Motion without load, inertia that vanishes, negative flywheels, and dead centres: in closed form": standing,
    "Regimes that hardly hold, or hold hard: multipliers near 1, near a stall, against growth, strong damping": weak_results,
}
