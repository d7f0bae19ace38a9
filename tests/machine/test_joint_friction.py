"""Friction in joints as a moment on the crank: against kinetostatics position by position, and in every figure."""

from __future__ import annotations

import pickle
from dataclasses import replace
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import flywheel
from bondgraph.elements import Here
from flywheel import Machine, SceneError, joint_forces
from flywheel.machine.dynamics import MachineDynamics, dynamics_of
from flywheel.motions.motion import speed_at
from flywheel.regime import joint_friction
from flywheel.regime.joint_friction import friction_curve, machine_of
from tests.motions.test_joint_forces import SliderCrank
from tests.scenes import crank_press, straight_drive

W = 20.0


def test_without_friction_there_is_no_curve() -> None:
    machine = flywheel.Machine(flywheel.load(crank_press(0.0)))
    assert machine.friction is None
    assert not machine.scene.rubs


@cache
def rough() -> Machine:
    """The press with a friction of 0.1 in all joints, whose curve takes as long as all the rest."""
    return machine_of(flywheel.load(crank_press(0.1)))


def test_dynamics_take_the_friction_of_rubbing_joints_and_keep_it_when_pickled() -> None:
    machine = flywheel.Machine(flywheel.load(crank_press(0.1)))
    with pytest.raises(TypeError, match="the joints of the machine rub: expected their friction"):
        MachineDynamics(machine, 1.0)
    dynamics = dynamics_of(machine, 1.0)
    again = pickle.loads(pickle.dumps(dynamics))
    before, after = (each.at(0.7, float(machine.anchors(0.7)), W) for each in (dynamics, again))
    assert after.acceleration == pytest.approx(before.acceleration, rel=1e-12)
    assert before.friction is not None
    assert before.friction.moments.min() < 0.0


@pytest.mark.slow
def test_the_curve_is_kinetostatics_with_its_corners_where_a_normal_force_or_a_rate_is_zero() -> None:
    curve, scene = rough().friction, rough().scene
    assert curve is not None
    q = np.linspace(0.0, scene.cycle, 104)[1:-1]
    expected = joint_forces(rough(), q, speed=W).mechanisms["linkage"].friction.moment
    np.testing.assert_allclose(curve(Here(q, None, np), Here(q, None, np)), expected, atol=1e-10 * np.abs(expected).max())
    assert (expected < 0.0).all()
    corners = np.array(curve.breakpoints)
    sides = [joint_forces(rough(), corners + d, speed=W).mechanisms["linkage"] for d in (-1e-8, 1e-8)]
    before, after = (np.sign(joint_friction._rows([(1.0, result)])[0]) for result in sides)
    assert corners.size >= 2
    assert (before != after).any(axis=0).all()
    state = flywheel.reduce(rough(), np.linspace(0.0, 6.0, 9))
    assert (state.moment_parts["friction in joints"] < 0.0).all()


def test_a_joint_that_turns_back_at_an_edge_of_the_first_cells_is_found_and_the_drive_pays() -> None:
    """Pin B turns back at 90 degrees, where a cell happens to end; by Gauss's rule on pieces between all corners."""
    assert np.abs(rough().breakpoints - np.pi / 2).min() < 1e-12
    sizing = flywheel.size(rough(), 1e-12, simulate=False)
    assert sizing.flywheel.exact == pytest.approx(7.80294591212, rel=2e-12)
    assert sizing.balance.value == pytest.approx(27.714399558469, rel=2e-12)
    assert any("friction in joints is taken at a constant crank speed" in message for message in sizing.messages)


@pytest.mark.slow
def test_the_simulation_confirms_the_flywheel_with_friction() -> None:
    sizing = flywheel.size(flywheel.load(crank_press(0.15)))
    assert sizing.simulation.irregularity == pytest.approx(0.03, rel=1e-9)
    assert sizing.error.exact < 1e-9


@pytest.mark.slow
def test_balance_within_the_mechanism_is_found_with_its_friction() -> None:
    scene = crank_press(0.1, parameters={"F": "balance"}, drive={"torque": "60 N m"})
    scene["load"] = [{"on": "ram", "force": "-F", "while": "v > 0"}]
    sizing = flywheel.size(flywheel.load(scene), simulate=False)
    loaded = crank_press(0.1, load=[{"on": "ram", "force": -sizing.balance.value, "while": "v > 0"}])
    back = flywheel.size(flywheel.load(loaded), simulate=False)
    assert back.balance.value == pytest.approx(60.0, rel=1e-9)


@pytest.mark.slow
def test_friction_that_locks_names_the_position() -> None:
    with pytest.raises(SceneError, match=r"friction that locks the mechanism at crank angle"):
        flywheel.size(flywheel.load(crank_press(3.0, 0.09)))


@pytest.mark.slow
def test_other_mechanisms_beside_a_rough_one() -> None:
    linkage = crank_press(0.1)
    yoke = {"type": "scotch-yoke", "name": "yoke", "crank": {"length": 0.1}, "yoke": {"mass": 5}}
    both = linkage | {"mechanism": [linkage["mechanism"] | {"name": "press"}, yoke]}
    both["load"] = [linkage["load"][0] | {"on": "press.ram"}]
    alone, result = (flywheel.size(flywheel.load(scene), simulate=False) for scene in (linkage, both))
    assert result.friction.constant_speed.balance == pytest.approx(alone.friction.constant_speed.balance, rel=1e-9)
    assert result.balance.value == pytest.approx(alone.balance.value, rel=1e-4)  # the yoke makes another motion


def test_a_normal_force_of_rounding_has_no_corners() -> None:
    curve = friction_curve(flywheel.Machine(flywheel.load(straight_drive())))
    assert curve.breakpoints == ()
    assert curve.mesh.edges.size < 20
    assert curve.error < 1e-9
    assert np.abs(curve.series).max() < 1e-9


@pytest.mark.slow
def test_cells_are_cut_no_more_at_their_largest_number(monkeypatch: pytest.MonkeyPatch) -> None:
    fine = friction_curve(flywheel.Machine(flywheel.load(crank_press(0.1))))
    monkeypatch.setattr(joint_friction, "_MOST_CELLS", 4)
    coarse = friction_curve(flywheel.Machine(flywheel.load(crank_press(0.1))))
    assert coarse.mesh.edges.size < fine.mesh.edges.size
    assert coarse.error > fine.error


# -- the steady regime with friction at its own speed ----------------------------------------------------------------------


@cache
def steady(mu: float, eps: float) -> flywheel.Sizing:
    return flywheel.size(flywheel.load(crank_press(mu, flywheel={"irregularity": eps})), 1e-11, simulate=False)


@pytest.mark.slow
def test_friction_in_a_steady_regime_is_that_of_its_own_speeds_and_accelerations() -> None:
    """Against shooting by hand-written equations of Newton and Euler, solved to 3e-12 (see the slow test below)."""
    result = steady(0.1, 0.03)
    assert result.flywheel.exact == pytest.approx(7.802957683474, rel=1e-11)
    assert result.balance.value == pytest.approx(27.713716075703, rel=1e-11)
    assert result.error.exact < 1e-10
    assert result.friction.left < 1e-8
    constant = result.friction.constant_speed
    assert (constant.speed, constant.exact) == (W, pytest.approx(7.80294591212, rel=1e-11))
    assert constant.balance == pytest.approx(27.714399558469, rel=1e-11)
    assert "at a constant 20 rad/s it would give 7.80295 kg m^2, 0.00015 % less" in result.messages[-1]
    assert result.as_dict()["friction"]["constant_speed"]["balance"] == constant.balance


def one_turn(machine: SliderCrank, energy: float) -> tuple[float, float, float]:
    """Half the square of the speed after a turn from phi = 0, and the greatest and least speed, by scipy over the angle."""
    start, extremes = energy, [float(np.sqrt(2 * energy))]
    for low, high in pairwise(np.arange(5) * np.pi / 2):  # between the angles where pin B, or the ram, turns back
        senses = np.sign(machine.senses(0.5 * (low + high), 1.0))
        pushed = replace(machine, force=lambda t, phi, v, back=senses[3] > 0: -800.0 if back else 0.0)
        while low < high:
            normal = pushed.solved(0.0, low + 1e-9, np.sqrt(2 * energy), np.append(senses, 1.0))[1][6]
            signs = np.append(senses, np.sign(normal))

            def rate(phi: float, e: Any, pushed: SliderCrank = pushed, signs: Any = signs) -> list[float]:
                return [pushed.solved(0.0, phi, np.sqrt(2 * e[0]), signs)[0]]

            def turns(phi: float, e: Any, pushed: SliderCrank = pushed, signs: Any = signs) -> float:
                return float(pushed.solved(0.0, phi, np.sqrt(2 * e[0]), signs)[1][6] * signs[4])

            turns.terminal, turns.direction = True, -1.0  # type: ignore[attr-defined]
            options = {"rtol": 1e-11, "atol": 1e-13, "events": turns, "max_step": 0.2, "dense_output": True}
            run = solve_ivp(rate, (low, high), [energy], "DOP853", **options)
            grid = np.linspace(run.t[0], run.t[-1], 25)
            slopes = [rate(phi, run.sol(phi))[0] for phi in grid]
            for k in np.flatnonzero(np.diff(np.sign(slopes))):
                top = brentq(lambda phi: rate(phi, run.sol(phi))[0], grid[k], grid[k + 1], xtol=1e-12)  # noqa: B023
                extremes.append(float(np.sqrt(2 * run.sol(top)[0])))
            low, energy = float(run.t[-1]), float(run.y[0, -1])
            extremes.append(float(np.sqrt(2 * energy)))
    assert start > 0.0
    return energy, max(extremes), min(extremes)


@pytest.mark.slow
@pytest.mark.parametrize(("mu", "eps"), [(0.1, 0.03), (0.15, 0.5)])
def test_the_steady_regime_returns_by_hand_written_equations(mu: float, eps: float) -> None:
    result = steady(mu, eps)
    begun = 0.5 * float(speed_at(result, 0.0)) ** 2
    torque = result.balance.value
    machine = SliderCrank(mu=mu, mu_guide=mu, wheel=result.flywheel.exact, torque=lambda t, phi, omega: torque)
    ended, fastest, slowest = one_turn(machine, begun)
    assert ended == pytest.approx(begun, rel=1e-10)
    assert 0.5 * (fastest + slowest) == pytest.approx(W, rel=1e-10)
    assert 2 * (fastest - slowest) / (fastest + slowest) == pytest.approx(eps, rel=1e-9)
    off = result.friction.constant_speed
    assert abs(off.balance / torque - 1.0) > 1e-5


@pytest.mark.slow
def test_a_simulation_with_friction_of_each_instant_confirms_the_steady_regime() -> None:
    result = steady(0.15, 0.5)
    scene = flywheel.load(crank_press(0.15, flywheel={"inertia": result.flywheel.exact}))
    again = flywheel.size(scene, simulate=False)
    assert again.simulation.irregularity == pytest.approx(0.5, rel=1e-9)
    begun = float(speed_at(result, 0.0))
    motion = flywheel.simulate(scene, 0.0, begun, again.simulation.period, balance=result.balance.value, rtol=1e-9)
    assert motion.phi[-1] == pytest.approx(2 * np.pi, rel=1e-8)
    assert motion.omega[-1] == pytest.approx(begun, rel=1e-8)
    times = np.linspace(0.0, motion.t[-1], 20001)
    omega = motion.at(times)[1]
    assert 2 * np.ptp(omega) / (omega.max() + omega.min()) == pytest.approx(0.5, rel=1e-6)


@pytest.mark.slow
def test_rounds_of_motion_and_friction_that_swing_to_and_fro_settle() -> None:
    """A light machine that sets its own speed: in time, with friction of each instant, its motion returns and has 0.6."""
    changes = {"load": [{"on": "ram", "force": -100}], "drive": {"torque": "30 - omega"}, "regime": {}}
    scene = crank_press(0.2, **changes, flywheel={"irregularity": 0.6})
    scene["mechanism"]["bodies"]["ram"]["mass"] = 30
    result = flywheel.size(flywheel.load(scene), simulate=False)
    assert result.error.exact < 1e-8
    begun = float(speed_at(result, 0.0))
    inputs = flywheel.load(scene | {"flywheel": {"inertia": result.flywheel.exact}})
    motion = flywheel.simulate(inputs, 0.0, begun, 1.3 * 2 * np.pi / result.speed, rtol=1e-9)
    back = brentq(lambda t: float(motion.at(np.array([t]))[0][0]) - 2 * np.pi, 0.0, float(motion.t[-1]), xtol=1e-14)
    omega = motion.at(np.linspace(0.0, back, 20001))[1]
    assert omega[-1] == pytest.approx(begun, rel=1e-8)
    assert 2 * np.ptp(omega) / (omega.max() + omega.min()) == pytest.approx(0.6, rel=1e-6)


def test_a_machine_with_its_friction_given_keeps_it() -> None:
    result = flywheel.size(rough(), simulate=False)
    assert result.friction is None
    assert result.machine is not None
    assert result.machine.friction is rough().friction


@pytest.mark.slow
def test_the_first_position_that_locks_is_found() -> None:
    """A rod between two rough slides at right angles locks where its slope is mu: x = l cos(atan mu)."""
    joints = [
        {"name": "x", "type": "slide", "between": ["frame.O", "across.origin"], "friction": 0.4},
        {
            "name": "y",
            "type": "slide",
            "between": ["frame.O", "up.origin"],
            "direction": "90 deg",
            "guess": 0.29,
            "friction": 0.4,
        },
        {"name": "A", "type": "pin", "between": ["across.origin", "rod.origin"]},
        {"name": "U", "type": "pin", "between": ["rod.U", "up.origin"]},
    ]
    bodies = {"frame": {"points": {"O": [0, 0]}}, "across": {"mass": 1}, "up": {"mass": 1}}
    bodies["rod"] = {"points": {"U": [0.3, 0]}, "guess": "100 deg"}
    trammel = {"type": "linkage", "driver": "x", "start": 0.05, "bodies": bodies, "joints": joints}
    load = [{"on": "slide", "force": "-200 N"}, {"on": "y", "force": "150 N"}]
    scene = flywheel.load({"mechanism": trammel, "load": load, "stroke": {"from": 0.02, "to": 0.28}})
    with pytest.raises(SceneError, match=r"locks the mechanism at slide position 0\.278543 m"):
        flywheel.reduce(scene, [0.2])


# -- loads whose branches depend on a velocity -------------------------------------------------------------------------


def pushed(force: str, friction: float = 0.0) -> dict[str, Any]:
    scene = crank_press(friction)
    return scene | {"load": [*scene["load"], {"on": "ram", "force": force}]}


def test_branches_that_depend_on_a_velocity_are_those_at_every_angle() -> None:
    """In the reduced moment and in joints: they had been decided in the middles of smooth pieces."""
    kinked, plain, none = (flywheel.load(pushed(force)) for force in ("-900*max(0, v - 0.7)", "-900*(v - 0.7)", "0*v"))
    q = np.linspace(0.0, kinked.cycle, 83)[:-1]
    state = flywheel.reduce(kinked, q, balance=0.0, speed=W)
    gain = state.gains["linkage.ram"]
    fast = gain * W > 0.7
    expected = flywheel.reduce(none, q, balance=0.0, speed=W).moment - 900 * gain * np.maximum(0.0, gain * W - 0.7)
    np.testing.assert_allclose(state.moment, expected, atol=1e-9 * np.abs(expected).max())
    forces, faster, slower = (
        joint_forces(Machine(each), q, speed=W).mechanisms["linkage"].components for each in (kinked, plain, none)
    )
    for name, parts in forces.items():
        for part, values in parts.items():
            true = np.where(fast, faster[name][part], slower[name][part])
            np.testing.assert_allclose(values, true, atol=1e-9 * np.abs(true).max() + 1e-9)


@pytest.mark.slow
def test_a_regime_with_friction_under_a_load_whose_branches_depend_on_a_velocity_is_stayed_in() -> None:
    """A balance was 9e-5 off, with 1e-10 stated."""
    scene = flywheel.load(pushed("-900*max(0, v - 0.7)", 0.1))
    result = flywheel.size(scene, accuracy="normal")
    assert result.balance is not None
    start, settings = (
        float(speed_at(result, 0.0)),
        dict[str, Any](inertia=result.flywheel.exact, balance=result.balance.value),
    )
    run = flywheel.transient(scene, start="regime", end=f"{scene.cycle!r} rad", rtol=1e-9, **settings)
    assert run.omega == pytest.approx(start, rel=1e-8)
