"""The naive methods that are compared."""

import json
import math
from functools import cache
from math import pi, sqrt
from pathlib import Path

import numpy as np
import pytest

import flywheel
from flywheel import Machine
from flywheel.study import answers
from flywheel.study.answers import NoAnswerError, Question, Revolution, Trial, by_shooting, stretches_of
from tests import regimes
from tests.limits import sample
from tests.scenes import press, rotor, shaper, yoke

# The reference of comparisons, against figures computed at 30 digits apart from this package.


FOLDER = Path(__file__).parents[1] / "references"
REFERENCES = {entry["scene"]: entry for entry in json.loads((FOLDER / "references.json").read_text()) if "balance" in entry}
HALF_A_DIGIT = 2e-15
WIDE = {"press-narrow.toml": 1e-11}  # eps is so small there that rounding of angles matters


@pytest.mark.parametrize("name", sample(REFERENCES, 12))
def test_the_true_figure_is_within_the_doubt(name):
    true = REFERENCES[name]
    machine = Machine(flywheel.load(FOLDER / "scenes" / name))
    scene, crank = machine.scene, machine.scene.flywheel_ratio**2
    if scene.irregularity is not None:
        value, doubt = (part / crank for part in answers.flywheel_inertia(machine))
        expected, scale = float(true["flywheel"]["exact"]), float(true["flywheel"]["approximate_total"])
        value = max(value, 0.0)
    else:
        value, doubt = answers.irregularity(machine, (scene.inertia or 0.0) * crank)
        expected, scale = float(true["simulation"]["irregularity"]), 0.0
    scale = max(abs(expected), scale)
    assert abs(value - expected) <= doubt + HALF_A_DIGIT * scale
    assert doubt <= WIDE.get(name, 1e-13) * scale


def test_gauss_is_exact_for_polynomials():
    powers = np.arange(48, dtype=np.longdouble)
    integrals = answers._WEIGHTS @ answers._NODES[:, None] ** powers
    expected = np.where(powers % 2 == 0, 2 / (powers + 1), 0)
    assert np.abs(integrals - expected).max() <= 8 * np.finfo(np.longdouble).eps


# A cycle of the whole bond graph is that of the reduced machine.


MACHINE = Machine(flywheel.load(yoke()))
TRIAL = Trial(inertia=300.0, balance=318.0, speed=6.3, states=(), period=1.0)


def same(result, true):
    return result._replace(states=0.0) == pytest.approx(true._replace(states=0.0), rel=1e-6)


def test_it_agrees_to_its_tolerance():
    true = answers.adaptive(MACHINE, "DOP853", 1e-12, True)(TRIAL)
    assert same(answers.by_bond_graph(MACHINE, 1e-6)(TRIAL), true)


def test_it_goes_on_until_the_cycle_is_over():
    true = answers.adaptive(MACHINE, "DOP853", 1e-12, True)(TRIAL)
    assert same(answers.by_bond_graph(MACHINE, 1e-6)(TRIAL._replace(period=0.9)), true)


# A cycle by Lagrange's multipliers is that of the reduced machine, and what they cannot is told.


def machine(scene):
    return Machine(flywheel.load(scene))


@pytest.mark.slow
def test_they_agree_to_their_tolerance():
    built = machine(press(load=[{"on": "press.slider", "force": "-900*sin(phi)"}]))
    trial = Trial(inertia=40.0, balance=10.0, speed=12.0, states=(), period=0.52)
    true = answers.adaptive(built, "DOP853", 1e-8, True)(trial)
    result = answers.by_multipliers(built, 1e-5, True)(trial)
    assert result._replace(states=0.0) == pytest.approx(true._replace(states=0.0), rel=1e-5)


@pytest.mark.parametrize(
    ("scene", "reason"),
    [
        (rotor(), "one mechanism"),
        (shaper(), "turn with the crank"),
        (press(mechanism={"type": "law", "outputs": {"slider": {"x": "0.1*sin(phi)", "mass": 2}}}, load=[]), "no bodies"),
        (yoke(inertia=[{"on": "yoke", "value": 5}]), "no inertia on ports"),
    ],
)
def test_what_they_cannot(scene, reason):
    assert reason in answers.obstacle(machine(scene))


def test_a_constant_inertia_on_the_crank_is_no_obstacle():
    assert answers.obstacle(machine(yoke(inertia=[{"on": "crank", "value": 5}]))) is None


# A reference that its second route does not confirm is in doubt by as much.


FAN = {
    "inertia": [{"on": "crank", "value": 2}],
    "drive": {"torque": "100 - 4*omega"},
    "load": [{"on": "crank", "torque": "-60*(1 + sin(phi))"}],
    "flywheel": {"inertia": 20},
}


def verified(scene):
    return answers.verified(Machine(flywheel.load(scene)))


def test_two_routes_that_agree():
    request, result = verified(yoke())
    assert result.value == pytest.approx(353.52142732, rel=1e-10)
    assert result.doubt < 1e-13
    assert request.sized
    assert "within its estimate" in result.verified


def test_two_routes_that_do_not(monkeypatch):
    monkeypatch.setattr(answers, "flywheel_inertia", lambda machine: (353.5214 * (1 + 1e-6), 1e-12))
    _, result = verified(yoke())
    assert result.doubt == pytest.approx(1e-6, rel=0.1)
    assert "more than both estimates allow" in result.verified


def test_a_flywheel_that_is_not_needed_is_none():
    _, result = verified(yoke(inertia=[{"on": "crank", "value": 1000}]))
    assert result.value == 0.0


def test_a_wheel_on_another_shaft_is_told_on_that():
    on_crank, on_shaft = (verified(shaper(flywheel={"irregularity": 0.1, "on": on}))[1] for on in ("crank", "bull"))
    assert on_shaft.value == pytest.approx(4 * on_crank.value, rel=1e-12)


def test_torques_that_depend_on_speed_are_verified_in_time():
    request, result = verified(FAN)
    assert not request.sized
    # (J + I) omega omega' + 4 omega = 40 - 60 sin(phi), whose first harmonic at w = 10 is this but for about eps²
    assert result.value == pytest.approx(2 * 60 / 10 / math.hypot(22 * 10, 4), rel=2e-3)
    assert result.doubt < 1e-9
    assert "stepped in time" in result.verified


@pytest.mark.parametrize("name", sample(["governor", "peaks", "dc-inductance", "constant-drive", "two-speeds-fast"], 5))
@pytest.mark.parametrize("kind", ["sizing", "analysis"])
def test_it_is_true_within_its_doubt(name, kind):
    case = regimes.CASES[name]
    inputs = {"irregularity": case.irregularities[0]} if kind == "sizing" else {"inertia": case.inertias[0]}
    request, result = verified(regimes.scene(name, **inputs))
    figures = regimes.figures(name)[kind][repr(*inputs.values())]
    true = float(figures["inertia" if kind == "sizing" else "irregularity"])
    assert request.error(result.value, true) <= result.doubt + 2e-15
    assert result.doubt < 1e-12


def test_what_cannot_be_stepped_has_its_own_estimate(monkeypatch):
    size = answers.size
    monkeypatch.setattr(answers, "size", lambda machine, rtol, accuracy: size(machine, rtol, accuracy="normal"))
    _, result = verified(FAN)
    assert "by its own estimate alone" in result.verified
    assert 0.0 < result.doubt < 1e-9


# The search for a steady cycle, with cycles of whose motion a formula is known.


OWN, SPEED = 2.0, 10 * pi


def asked(wheel):
    """A rotor with a load of 100 N m over the first half of a turn."""
    scene = rotor(
        load=[{"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}],
        inertia=[{"on": "crank", "value": OWN}],
        drive={"torque": "balance"},
        regime={"speed": SPEED},
        flywheel=wheel,
    )
    machine = Machine(flywheel.load(scene))
    return Question.of(flywheel.size(machine, simulate=False))


def by_energy(trial):
    """The rotor's cycle: omega² changes by 2/(J + I) times the work."""
    total = trial.inertia + OWN
    half = trial.speed**2 + 2 * (trial.balance - 100) * pi / total
    end = half + 2 * trial.balance * pi / total
    if min(half, end) <= 0.0:
        return Revolution(0.0, (), trial.speed, 0.0)
    speeds = [trial.speed, sqrt(half), sqrt(end)]
    return Revolution(speeds[-1], (), max(speeds), min(speeds))


def test_a_flywheel_is_found():
    result = by_shooting(asked({"irregularity": 0.01}), by_energy, 1e-12)
    assert result == pytest.approx(50 * pi / (0.01 * SPEED**2) - OWN, rel=1e-10)


def test_an_irregularity_is_found():
    result = by_shooting(asked({"inertia": 13.0}), by_energy, 1e-12)
    assert result == pytest.approx(50 * pi / (15 * SPEED**2), rel=1e-10)


def test_no_motion_is_no_answer():
    with pytest.raises(NoAnswerError, match="no steady motion"):
        by_shooting(asked({"irregularity": 0.01}), lambda trial: Revolution(1.0, (), 1.0, -1.0), 1e-9)


def test_stretches_run_from_break_to_break():
    machine = asked({"irregularity": 0.01}).machine
    whole, parts = stretches_of(machine, False), stretches_of(machine, True)
    assert whole == [(0.0, 2 * pi)]
    assert [high for _, high in parts] == pytest.approx([pi, 2 * pi])
    assert [low for low, _ in parts] == pytest.approx([0.0, pi])


# Steps of fixed length have their order, jumps take it from them, and a restart gives it back.


SMOOTH = yoke(load=[{"on": "yoke", "force": "400*sin(phi)"}])
JUMP = yoke(load=[{"on": "yoke", "force": 1000, "from": "45 deg", "to": "180 deg"}])
STEP_TRIAL = Trial(inertia=30.0, balance=20.0, speed=8.0, states=(), period=0.8)


@cache
def cycle(jumps):
    """The true one, with the jump or smooth."""
    return answers.adaptive(machine(JUMP if jumps else SMOOTH), "DOP853", 1e-13, True)(STEP_TRIAL)


def errors(scene, name, counts, restart):
    """Of the speed at the cycle's end, by so many steps."""
    built, true = machine(scene), cycle(scene is JUMP).speed
    return np.array([abs(answers.fixed(built, name, count, restart)(STEP_TRIAL).speed - true) for count in counts])


@pytest.mark.parametrize(("name", "order"), [("Euler", 1), ("RK4", 4)])
@pytest.mark.parametrize(("scene", "restart"), [(SMOOTH, False), (JUMP, True)])
def test_the_order_of_a_rule(name, order, scene, restart):
    rough, fine = errors(scene, name, (16, 128), restart)
    assert np.log2(rough / fine) / 3 == pytest.approx(order, abs=0.3)


@pytest.mark.slow
def test_a_jump_within_a_step_takes_the_order():
    counts = (32, 64)
    over, restarted = (errors(JUMP, "RK4", counts, restart) for restart in (False, True))
    assert (over > 1e3 * restarted).all()


@pytest.mark.parametrize("name", answers.ADAPTIVE)
def test_adaptive_rules_come_to_the_same_cycle(name):
    built, true = machine(JUMP), cycle(True)
    result = answers.adaptive(built, name, 1e-8, True)(STEP_TRIAL)
    assert result._replace(states=0.0) == pytest.approx(true._replace(states=0.0), rel=1e-6)
    assert result.least <= min(STEP_TRIAL.speed, result.speed) <= max(STEP_TRIAL.speed, result.speed) <= result.greatest


@pytest.mark.parametrize("revolve", [answers.fixed, answers.adaptive])
def test_a_machine_that_stops_has_no_cycle(revolve):
    setting = ("RK4", 36) if revolve is answers.fixed else ("RK45", 1e-6)
    stopping = revolve(machine(SMOOTH), *setting, True)
    with pytest.raises(NoAnswerError, match="stops within its cycle"):
        stopping(STEP_TRIAL._replace(balance=-500.0))


@pytest.mark.slow
def test_the_fastest_of_nearly_equal_lobes_is_found_among_many_steps():
    """Seven lobes a hair apart: the greatest speed is not beside the greatest of the steps' ends."""
    torque = "100*sin(7*phi + 0.3) + 0.01*sin(phi + 1)"
    scene = {
        "inertia": [{"on": "crank", "value": 1.0}],
        "load": [{"on": "crank", "torque": torque}],
        "drive": {"torque": "balance"},
        "regime": {"speed": 10.0},
        "flywheel": {"inertia": 1.0},
    }
    built = machine(scene)
    sizing = flywheel.size(built, 1e-12, accuracy="normal")
    result = by_shooting(Question.of(sizing), answers.fixed(built, "RK4", 720, True), 1e-9)
    assert result == pytest.approx(sizing.simulation.irregularity, rel=1e-7)
