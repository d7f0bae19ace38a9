"""Friction in joints at the actual motion: against closed forms and against Newton and Euler by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import flywheel
from flywheel.machine.reactions import MachineMotion, port_forces
from flywheel.motions.transients import sampled
from flywheel.numerics.faults import SceneError
from tests.motions.slider_crank_by_hand import SliderCrank

G = 9.80665


def block(mu: float, degrees: float = 0.0, *, force: str = "", at: float = 0.0, **changes: Any) -> dict[str, Any]:
    """A block of 2 kg on an incline, pushed along it at a height of its side."""
    joint = {"name": "S", "type": "slide", "between": ["frame.origin", "block.origin"], "direction": f"{degrees} deg"}
    joint |= {"friction": mu, "length": changes.pop("length", 0.0)}
    bodies = {"block": {"mass": 2.0, "points": {"P": [0.0, at]}}}
    ports = {"P": {"point": "block.P", "direction": f"{degrees} deg"}}
    scene: dict[str, Any] = {
        "mechanism": {"type": "linkage", "driver": "S", "bodies": bodies, "joints": [joint], "ports": ports},
        "gravity": {},
        "stroke": {"from": 0, "to": 5.0, "speed": 1.0},
        "load": [{"on": "P", "force": force}] if force else [],
    }
    return scene | changes


def press(mu: float = 0.1, **changes: Any) -> dict[str, Any]:
    """The slider-crank of `SliderCrank` as a linkage."""
    rough = {"friction": mu, "radius": 0.015}
    pins = {"O": "frame.origin crank.origin", "A": "crank.A rod.origin", "B": "rod.B ram.origin"}
    joints: list[dict[str, Any]] = [{"name": n, "type": "pin", "between": b.split()} | rough for n, b in pins.items()]
    joints.append({"name": "ram", "type": "slide", "between": ["frame.origin", "ram.origin"], "friction": mu})
    bodies = {
        "crank": {"points": {"A": [0.1, 0]}, "mass": 3, "inertia": 0.02},
        "rod": {"points": {"B": [0.4, 0]}, "mass": 2, "inertia": 0.03, "com": [0.15, 0], "guess": 0.0},
        "ram": {"mass": 6},
    }
    scene = {
        "mechanism": {"type": "linkage", "driver": "O", "bodies": bodies, "joints": joints},
        "flywheel": {"inertia": 0.5},
    }
    return scene | changes


def pendulum(radius: float = 0.05) -> dict[str, Any]:
    joint = {"name": "O", "type": "pin", "between": ["frame.origin", "crank.origin"], "friction": 0.1, "radius": radius}
    bodies = {"crank": {"points": {"A": [1.0, 0]}, "mass": 2.0, "inertia": 0.1, "com": [0.5, 0]}}
    return {"mechanism": {"type": "linkage", "driver": "O", "bodies": bodies, "joints": [joint]}, "gravity": {}}


# -- one body: closed forms ---------------------------------------------------------------------------------------------


def test_a_block_goes_up_an_incline_comes_to_rest_and_slides_back() -> None:
    """x = x0 + v²/2(g sin a + mu g cos a), then back by g sin a - mu g cos a."""
    angle = np.radians(30.0)
    motion = flywheel.simulate(flywheel.load(block(0.2, 30.0)), 2.0, 1.5, 0.7)
    up, down = G * (np.sin(angle) + 0.2 * np.cos(angle)), G * (np.sin(angle) - 0.2 * np.cos(angle))
    turn = 1.5 / up
    assert motion.phi[-1] == pytest.approx(2.0 + 0.5 * 1.5**2 / up - 0.5 * down * (0.7 - turn) ** 2, rel=1e-12)
    assert motion.omega[-1] == pytest.approx(-down * (0.7 - turn), rel=1e-12)
    assert np.abs(motion.t - turn).min() < 1e-12
    assert motion.energy_residual < 1e-13


def test_a_block_that_friction_holds_stays_where_it_came_to_rest() -> None:
    motion = flywheel.simulate(flywheel.load(block(0.7, 30.0)), 2.0, 1.5, 3.0)
    up = G * (np.sin(np.radians(30.0)) + 0.7 * np.cos(np.radians(30.0)))
    assert motion.t[-1] == pytest.approx(1.5 / up, rel=1e-12)
    assert motion.phi[-1] == pytest.approx(2.0 + 0.5 * 1.5**2 / up, rel=1e-12)
    held = (
        f"friction in its joints holds M* = {-2 * G * 0.5:.6g} N, and would hold up to {2 * G * 0.7 * np.sqrt(0.75):.6g} N"
    )
    assert held in str(motion.ended)


def test_a_ramp_of_force_breaks_it_away_at_the_instant_when_it_exceeds_friction() -> None:
    """F = 4 t against mu m g: from t0 on x = 4 (t - t0)³/6m; the energy's table has the friction of the slide."""
    start = 0.3 * 2.0 * G / 4.0
    run = flywheel.transient(flywheel.load(block(0.3, force="4*t")), end=3.0)
    assert np.abs(run.motion.t - start).min() < 1e-11
    assert run.phi == pytest.approx(4.0 * (3.0 - start) ** 3 / 12.0, rel=1e-12)
    assert run.energy.works["friction in linkage.S"] == pytest.approx(-0.3 * 2.0 * G * run.phi, rel=1e-12)
    assert run.energy.residual < 1e-12
    waiting = flywheel.transient(flywheel.load(block(0.3, force="4*t")), end=1.0)
    assert "at rest: friction in its joints holds M* = 4 N, and would hold up to 5.88399 N" in waiting.ended
    still = sampled(run.motion.trail, np.array([0.5 * start]))
    assert still.acceleration[0] == still.omega[0] == 0.0


@pytest.mark.slow
def test_stick_and_slip_under_a_force_that_swings() -> None:
    """8 sin 2t N on 2 kg with mu = 0.3: it sticks twice a period, each slip from where |8 sin 2t| > mu m g."""
    limit = 0.3 * 2.0 * G
    motion = flywheel.simulate(flywheel.load(block(0.3, force="8*sin(2*t)")), 1.0, 0.0, 6.0)
    x, v, t, sense = 1.0, 0.0, 0.0, 1.0
    while True:
        start = 0.5 * (np.pi * (0 if sense > 0 else 1) + np.arcsin(limit / 8.0))
        while start < t:
            start += np.pi
        if start > 6.0:
            break

        def slip(at: float, y: Any, sense: float = sense) -> list[float]:
            return [y[1], (8.0 * np.sin(2 * at) - sense * limit) / 2.0]

        def stop(at: float, y: Any, sense: float = sense) -> float:
            return float(y[1] * sense)

        stop.terminal, stop.direction = True, -1.0  # type: ignore[attr-defined]
        run = solve_ivp(slip, (start, 6.0), [x, 0.0], "DOP853", rtol=1e-13, atol=1e-15, events=stop)
        (x, v), t, sense = run.y[:, -1], float(run.t[-1]), -sense
        if not run.t_events[0].size:
            break
    assert motion.phi[-1] == pytest.approx(x, abs=1e-11)
    assert motion.omega[-1] == pytest.approx(v, abs=1e-11)


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        (block(0.3, force="4 N"), r"friction in its joints holds M\* = 4 N, and would hold up to 5.88399 N"),
        (
            block(0.3, force="4 N", at=0.4, length=0.05),
            r"locks itself, as no size of load\[0\].force moves it \(self-locking\)",
        ),
        (block(0.3), r"M\* = 0 N, so that nothing moves it"),
    ],
)
def test_what_never_starts_is_told_in_one_line_with_what_holds_it(scene: dict[str, Any], words: str) -> None:
    for follow in (lambda s: flywheel.simulate(s, 0.0, 0.0, 1.0), lambda s: flywheel.transient(s, end=1.0)):
        with pytest.raises(SceneError, match=words) as raised:
            follow(flywheel.load(scene))
        assert len(raised.value.faults) == 1


def test_an_overhang_locks_from_its_limit_on() -> None:
    """A force out of line by h tilts the shoe of length L: friction 2 mu F h/L, which is F at mu = L/2h."""
    at_limit = {"force": "4 N", "at": 0.4, "length": 0.1, "gravity": {"g": 1e-6}}
    slow = flywheel.simulate(flywheel.load(block(0.124, **at_limit)), 0.0, 0.0, 1.0)
    assert slow.phi[-1] == pytest.approx(0.5 * (4.0 / 2.0) * (1.0 - 2 * 0.124 * 4.0), rel=1e-5)
    with pytest.raises(SceneError, match="self-locking"):
        flywheel.simulate(flywheel.load(block(0.126, **at_limit)), 0.0, 0.0, 1.0)


@pytest.mark.slow
def test_a_pendulum_with_a_rough_pin_swings_to_rest() -> None:
    """Against m a and J alpha of the one body, R = m |a - g|, by scipy; it turns back until friction holds it."""
    circle, mass, arm, inertia = 0.2 * 0.1 / np.hypot(1.0, 0.1), 2.0, 0.5, 0.1

    def acceleration(phi: float, omega: float, sense: float) -> float:
        alpha = last = 0.0
        for _ in range(100):
            ax = -arm * (np.cos(phi) * omega**2 + np.sin(phi) * alpha)
            ay = arm * (-np.sin(phi) * omega**2 + np.cos(phi) * alpha)
            force = mass * np.hypot(ax, ay + G)
            alpha = (-mass * G * arm * np.cos(phi) - sense * circle * force) / (inertia + mass * arm**2)
            if abs(alpha - last) < 1e-15:
                break
            last = alpha
        return float(alpha)

    def stop(t: float, y: Any) -> float:
        return float(y[1] * sense)

    stop.terminal, stop.direction = True, -1.0  # type: ignore[attr-defined]
    t, y, sense = 0.0, np.zeros(2), -1.0
    while sense:
        run = solve_ivp(
            lambda t, y: [y[1], acceleration(y[0], y[1], sense)],  # noqa: B023 - called at once
            (t, 60.0), y, "DOP853", rtol=1e-12, atol=1e-13, events=stop,
        )  # fmt: skip
        t, y = float(run.t[-1]), np.array([run.y[0, -1], 0.0])
        sense = next((s for s in (1.0, -1.0) if acceleration(y[0], 0.0, s) * s > 0.0), 0.0)
    motion = flywheel.simulate(flywheel.load(pendulum(0.2)), 0.0, 0.0, 60.0)
    assert "friction in its joints holds" in str(motion.ended)
    assert motion.t[-1] == pytest.approx(t, rel=1e-10)
    assert motion.phi[-1] == pytest.approx(y[0], rel=1e-10)
    assert motion.energy_residual < 1e-11


# -- a slider-crank: Newton and Euler by hand -----------------------------------------------------------------------------


def follows_by_hand(machine: SliderCrank, scene: dict[str, Any], phi: float, omega: float, until: float) -> None:
    times, states = machine.run(phi, omega, until)
    run = flywheel.simulate(flywheel.load(scene), phi, omega, until)
    assert run.t[-1] == pytest.approx(times[-1], rel=1e-9)
    assert run.phi[-1] - phi == pytest.approx(states[-1, 0] - phi, abs=1e-9)
    assert run.omega[-1] == pytest.approx(states[-1, 1], abs=1e-9 * np.abs(states[:, 1]).max())
    assert run.energy_residual < 1e-10
    assert run.error < 1e-9
    at, speed = run.at(times[1:-1])
    np.testing.assert_allclose(at, states[1:-1, 0], atol=1e-9)
    np.testing.assert_allclose(speed, states[1:-1, 1], atol=1e-8)


@pytest.mark.slow
def test_a_run_up_with_a_falling_torque_from_rest_through_a_change_of_sides() -> None:
    machine = SliderCrank(torque=lambda t, phi, omega: 30.0 - 1.5 * omega, wheel=0.5)
    follows_by_hand(machine, press(drive={"torque": "30 - 1.5*omega"}), 1.3, 0.0, 0.2)


@pytest.mark.slow
@pytest.mark.parametrize("gravity", [0.0, G])
def test_turns_of_a_run_up_with_a_falling_torque(gravity: float) -> None:
    machine = SliderCrank(torque=lambda t, phi, omega: 30.0 - 1.5 * omega, wheel=0.5, gravity=gravity)
    scene = press(drive={"torque": "30 - 1.5*omega"}) | ({"gravity": {}} if gravity else {})
    follows_by_hand(machine, scene, 0.3, 0.0, 0.6)


@pytest.mark.slow
def test_a_crank_that_gravity_swings_until_friction_holds_it() -> None:
    machine = SliderCrank(gravity=G, mu=0.05, mu_guide=0.05)
    follows_by_hand(machine, press(0.05, gravity={}, flywheel={"inertia": 0.0}), 0.3, 0.0, 30.0)


@pytest.mark.slow
def test_a_rod_without_mass_whose_force_passes_zero_in_all_pins_at_once() -> None:
    """Its pins' resultants have a kink there, which is found like a normal force that changes its sign."""
    machine = SliderCrank(torque=lambda t, phi, omega: 30.0 - 1.5 * omega, wheel=0.5, rod=(0.0, 0.0))
    scene = press(drive={"torque": "30 - 1.5*omega"})
    scene["mechanism"]["bodies"]["rod"] |= {"mass": 0, "inertia": 0}
    follows_by_hand(machine, scene, 0.3, 0.0, 0.6)


@pytest.mark.parametrize(
    ("weights", "words"),
    [({"gravity": {}}, "2 accelerations fit .*linkage.B"), ({}, "linkage.B jams .* no acceleration fits")],
)
def test_friction_that_leaves_no_acceleration_or_two_is_named_with_its_joint(weights: dict[str, Any], words: str) -> None:
    """As many as roots of |z| = |a + Q |z|| were found from 3000 starts."""
    scene = press(3.0, drive={"torque": "30 - 1.5*omega"}) | weights
    for joint in scene["mechanism"]["joints"][:3]:
        joint["radius"] = 0.09
    with pytest.raises(SceneError, match=rf"no one motion at crank angle 17.1887 deg after 0 s: .*{words}.*Painlevé"):
        flywheel.simulate(flywheel.load(scene), 0.3, 10.0, 0.3)


@pytest.mark.slow
def test_everything_that_acts_on_ports_presses_on_the_joints() -> None:
    """Loads of v and x, a damper, a spring, added inertia, weights: kinetostatics gives the torque back."""
    scene = press(
        drive={"torque": "30 - 1.5*omega"},
        load=[{"on": "ram", "force": "-100*v", "while": "v>0"}, {"on": "ram", "force": "-50 - 20*x"}],
        damper=[{"on": "ram", "coefficient": 5}],
        spring=[{"on": "ram", "stiffness": 200, "rest": 0.3}],
        inertia=[{"on": "ram", "value": 1.5}],
        gravity={},
    )
    run = flywheel.transient(flywheel.load(scene), end=0.4, at=1.3)
    assert run.energy.residual < 1e-10
    machine, now = run.motion.trail.dynamics.machine, sampled(run.motion.trail, np.array([0.1, 0.2, 0.35]))
    found = port_forces(machine, MachineMotion(now.phi, now.omega, now.acceleration), 0.0, machine.scene.mechanisms[0])
    np.testing.assert_allclose(found.action, 30.0 - 1.5 * now.omega - 0.5 * now.acceleration, rtol=1e-9)


@pytest.mark.slow
def test_friction_over_a_run_is_that_of_kinetostatics_at_its_instants_and_closes_the_energy() -> None:
    run = flywheel.transient(flywheel.load(press(drive={"torque": "30 - 1.5*omega"})), at=1.3, end=0.15)
    assert run.energy.residual < 1e-9
    assert {"friction in linkage.O", "friction in linkage.ram"} < set(run.energy.works)
    assert all(work < 0.0 for part, work in run.energy.works.items() if part.startswith("friction"))
    machine = run.motion.trail.dynamics.machine
    now = sampled(run.motion.trail, np.array([0.03, 0.12]))
    motion = MachineMotion(now.phi, now.omega, now.acceleration)
    found = port_forces(machine, motion, 0.0, machine.scene.mechanisms[0])
    np.testing.assert_allclose(found.action, 30.0 - 1.5 * now.omega - 0.5 * now.acceleration, rtol=1e-9)


def test_twisting_shafts_and_rough_joints_are_refused_together() -> None:
    scene = press(drive={"torque": "30 N m"}, shafts={"wheel": {"ratio": 1, "stiffness": 1e4}})
    with pytest.raises(SceneError, match="a shaft that twists in a machine with friction in joints"):
        flywheel.simulate(flywheel.load(scene), 0.3, 1.0, 1.0)
