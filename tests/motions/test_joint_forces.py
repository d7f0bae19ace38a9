"""Forces in joints, and passive resistances that hang on them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import flywheel
from flywheel import Machine, SceneError, joint_forces
from flywheel.machine.reactions import MachineMotion, port_forces
from flywheel.motions.joint_forces import along_run, axis, close_times, figures_of, force_curves, joint_errors
from flywheel.motions.motion import evenly, sampled
from tests import regimes
from tests.limits import sample
from tests.scenes import crank_press, press, shaper, yoke

# A slider-crank with Coulomb's friction in its pins and its guide, by Newton and Euler alone: nothing of the package.
#
# Nine equations of three bodies for the crank's acceleration, six pin forces, the guide's normal force and its moment
# (none:
# the ram's pin lies on its centre), with friction that follows them: fixed point and Newton by numpy. Integration by
# scipy's
# DOP853 from event to event: where a rate or the normal force changes its sign.


Array = NDArray[np.float64]


@dataclass(frozen=True)
class SliderCrank:
    """Lengths (m), masses (kg), inertias about centres of mass (kg m²; `wheel` joins the crank), friction and pin radius."""

    r: float = 0.1
    length: float = 0.4
    com: float = 0.15
    crank: tuple[float, float] = (3.0, 0.02)
    rod: tuple[float, float] = (2.0, 0.03)
    ram: float = 6.0
    wheel: float = 0.0
    mu: float = 0.1
    mu_guide: float = 0.1
    radius: float = 0.015
    gravity: float = 0.0  # along -y
    torque: Callable[[float, float, float], float] = lambda t, phi, omega: 0.0
    force: Callable[[float, float, float], float] = lambda t, phi, v: 0.0

    def kinematics(self, phi: float) -> tuple[float, float, float, float, float]:
        """Angle of the rod, its rate and slope by phi; rate and slope of the ram."""
        beta = np.arcsin(-self.r * np.sin(phi) / self.length)
        g = -self.r * np.cos(phi) / (self.length * np.cos(beta))
        s = (self.r * np.sin(phi) + self.length * np.sin(beta) * g * g) / (self.length * np.cos(beta))
        x = -self.r * np.sin(phi) - self.length * np.sin(beta) * g
        bend = -self.r * np.cos(phi) - self.length * (np.cos(beta) * g * g + np.sin(beta) * s)
        return beta, g, s, x, bend

    def solved(self, t: float, phi: float, omega: float, signs: Array) -> tuple[float, Array, Array]:
        """Crank's acceleration, (O, A, B, N) forces, and frictions (couples of O, A, B; guide), for senses of the motion.

        signs: of the relative speeds in O, A, B, guide, and of N.
        """
        beta, g, s, x, bend = self.kinematics(phi)
        a, b = self.r * np.array([np.cos(phi), np.sin(phi)]), self.length * np.array([np.cos(beta), np.sin(beta)])
        c = b * self.com / self.length
        turn = lambda p: np.array([-p[1], p[0]])  # noqa: E731
        rates = turn(a) + turn(c) * g
        bends = -a + turn(c) * s - c * g * g
        m_rod, j_rod = self.rod
        # unknowns: alpha, Ox, Oy, Ax, Ay, Bx, By, N; pins: what the body before does to the one behind; friction (4) known
        matrix, right, rub = np.zeros((8, 8)), np.zeros(8), np.zeros((8, 4))
        weight = np.array([0.0, -self.gravity])
        v = x * omega
        # crank: O - A = -m g; moments about O: J alpha = T - a x A + couple_O - couple_A
        matrix[0, [1, 3]], matrix[1, [2, 4]] = (1, -1), (1, -1)
        right[:2] = -self.crank[0] * weight
        matrix[2, [0, 3, 4]] = self.crank[1] + self.wheel, -a[1], a[0]
        right[2], rub[2] = self.torque(t, phi, omega), [1, -1, 0, 0]
        # rod: A - B + m g = m (rates alpha + bends omega²); moments about its centre of mass
        for k in range(2):
            matrix[3 + k, [3 + k, 5 + k, 0]] = 1, -1, -m_rod * rates[k]
            right[3 + k] = m_rod * (bends[k] * omega**2 - weight[k])
        matrix[5, [0, 3, 4, 5, 6]] = -j_rod * g, c[1], -c[0], (b - c)[1], -(b - c)[0]
        right[5], rub[5] = j_rod * s * omega**2, [0, -1, 1, 0]
        # ram: along x with guide's friction; across
        matrix[6, [0, 5]] = -self.ram * x, 1
        right[6], rub[6] = self.ram * bend * omega**2 - self.force(t, phi, v), [0, 0, 0, -1]
        matrix[7, [6, 7]] = 1, 1
        right[7] = -self.ram * weight[1]
        free, answer = np.linalg.solve(matrix, right), np.linalg.solve(matrix, rub)
        circle = self.radius * self.mu / np.sqrt(1 + self.mu**2)
        z, last = free, np.full(8, np.inf)
        for _ in range(200):
            pins = np.hypot(z[1:7:2], z[2:7:2])
            friction = -np.append(circle * pins * signs[:3], self.mu_guide * z[7] * signs[4] * signs[3])
            z, last = free + answer @ friction, z
            if np.abs(z - last).max() <= 1e-15 * np.abs(z).max():
                break
        return float(z[0]), z[1:], friction

    def senses(self, phi: float, omega: float) -> Array:
        """Relative speeds in O, A, B and guide."""
        _, g, _, x, _ = self.kinematics(phi)
        return np.array([1.0, g - 1.0, -g, x]) * omega

    def stretch(self, t: float, y: Array, until: float, signs: Array, rtol: float) -> tuple[float, Array, int | None]:
        """To the first event: a rate (1 to 3) or the normal force (4) changes its sign, or the crank stops (0)."""

        def rates(t: float, y: Array) -> list[float]:
            alpha, _, friction = self.solved(t, y[0], y[1], signs)
            power = float(friction @ self.senses(y[0], y[1]))
            return [y[1], alpha, power, self.torque(t, y[0], y[1]) * y[1]]

        def watched(k: int) -> Callable[[float, Array], float]:
            def value(t: float, y: Array) -> float:
                if k == 0:
                    return float(y[1] * signs[0])
                if k == 4:
                    return float(self.solved(t, y[0], y[1], signs)[1][6] * signs[4])
                return float(self.senses(y[0], signs[0])[k] * signs[k])

            value.terminal, value.direction = True, -1.0  # type: ignore[attr-defined]
            return value

        events = [watched(k) for k in range(5)]
        run = solve_ivp(rates, (t, until), y, "DOP853", rtol=rtol, atol=1e-14, events=events, max_step=0.02)
        fired = [k for k, result in enumerate(run.t_events) if result.size]
        return float(run.t[-1]), run.y[:, -1], fired[0] if fired else None

    def begun(self, t: float, phi: float, omega: float, sense: float) -> Array:
        """The signs with which a stretch begins."""
        rates = np.sign(self.senses(phi + 1e-7 * sense, sense))
        signs = np.append(rates, 1.0)
        signs[4] = np.sign(self.solved(t, phi + 1e-7 * sense, omega, signs)[1][6]) or 1.0
        return signs

    def run(self, phi: float, omega: float, until: float, rtol: float = 1e-12) -> tuple[Array, Array]:
        """Times and states (phi, omega, work of friction, work of the torque) at the ends of stretches; ends at rest."""
        t, y = 0.0, np.array([phi, omega, 0.0, 0.0])
        times, states = [t], [y]
        signs: Array | None = self.begun(t, phi, omega, np.sign(omega)) if omega else self.leaving(t, phi)
        while t < until and signs is not None and len(times) < 2000:
            t, y, fired = self.stretch(t, y, until, signs, rtol)
            times.append(t)
            states.append(y)
            if fired is None:
                break
            if fired == 0:
                y = y * [1.0, 0.0, 1.0, 1.0]
                signs = self.leaving(t, y[0])
                continue
            signs = signs.copy()
            signs[fired] *= -1.0
            if fired != 4:  # the normal force may jump with the friction's sense
                signs[4] = np.sign(self.solved(t, y[0], y[1], signs)[1][6]) or signs[4]
        return np.array(times), np.array(states)

    def leaving(self, t: float, phi: float) -> Array | None:
        """The signs with which the machine leaves its rest; None where friction holds it."""
        for sense in (1.0, -1.0):
            signs = self.begun(t, phi, 0.0, sense)
            if self.solved(t, phi, 0.0, signs)[0] * sense > 1e-12:
                return signs
        return None


# Forces in the joints of whole scenes: against the reduced machine, against Newton-Euler by hand, and at its edges.


PHI = np.linspace(0.1, 6.2, 23)

FOUR_BAR: dict[str, Any] = {
    "mechanism": {
        "type": "four-bar",
        "name": "bars",
        "ground": {"length": 0.4},
        "crank": {"length": 0.1, "mass": 2, "inertia": 0.01, "com": 0.03},
        "coupler": {"length": 0.35, "mass": 1.5, "com": 0.2, "com_angle": 0.3, "inertia": 0.02},
        "rocker": {"length": 0.3, "mass": 3, "com": 0.1, "inertia": 0.04},
    },
    "gravity": {},
    "inertia": [{"on": "bars.rocker", "value": 0.05}],
    "spring": [{"on": "bars.rocker", "stiffness": 30, "rest": 1.5}],
    "load": [{"on": "bars.rocker", "torque": "-40*sign(v)"}],
    "drive": {"torque": "balance"},
    "regime": {"speed": 20},
    "flywheel": {"irregularity": 0.02},
}

SCENES = {"press": press(), "yoke": yoke(), "shaper": shaper(), "four-bar": FOUR_BAR}


def asked_of_shafts(machine: Machine, found: Any) -> Any:
    """Torque at the crank that all mechanisms ask for."""
    scene = machine.scene
    return sum(scene.shafts[m.shaft] * found.mechanisms[m.name].action for m in scene.mechanisms)


@pytest.mark.parametrize("name", SCENES)
def test_driving_actions_agree_with_the_reduced_machine(name: str) -> None:
    machine = Machine(flywheel.load(SCENES[name]))
    forces = joint_forces(machine, PHI)
    state = flywheel.reduce(machine, PHI)
    motion = forces.motion
    on_shafts = [
        k for k in state.moment_parts if k == "drive" or any(s in k.split(" on ")[-1:] for s in machine.scene.shafts)
    ]
    moments = state.moment - sum((state.moment_parts[key] for key in on_shafts), np.zeros(PHI.size))
    expected = state.inertia * motion.alpha + 0.5 * state.slope * motion.omega**2 - moments
    fixed = sum(i.value * machine.scene.shafts[i.on] ** 2 for i in machine.scene.inertias if i.on in machine.scene.shafts)
    expected = expected - fixed * motion.alpha
    np.testing.assert_allclose(asked_of_shafts(machine, forces), expected, atol=1e-10 * np.abs(expected).max())


def test_steady_motion_fulfils_the_equation_of_motion() -> None:
    machine = Machine(flywheel.load(press()))
    motion = joint_forces(machine, PHI).motion
    h = 1e-5
    around = [joint_forces(machine, PHI + s * h).motion.omega for s in (-1, 1)]
    np.testing.assert_allclose(motion.omega * (around[1] - around[0]) / (2 * h), motion.alpha, atol=1e-6)


def test_reactions_of_a_press_by_newton_and_euler() -> None:
    scene = flywheel.load(press())
    forces = joint_forces(scene, PHI)
    motion, joints = forces.motion, forces.mechanisms["press"]
    r, length, b, phi = 0.1, 0.5, 0.2, forces.motion.phi
    beta = np.arcsin(-r * np.sin(phi) / length)
    rate = -r * np.cos(phi) / (length * np.cos(beta))
    slope = (r * np.sin(phi) / length + np.sin(beta) * rate**2) / np.cos(beta)
    omega, alpha = motion.omega, motion.alpha

    def accelerated(first: Any, second: Any) -> Any:
        return first * alpha + second * omega**2

    rod_turn = accelerated(rate, slope)
    pin = accelerated(r * 1j * np.exp(1j * phi), -r * np.exp(1j * phi))
    centre = pin + b * (1j * rod_turn - (rate * omega) ** 2) * np.exp(1j * beta)
    slider = (pin + length * (1j * rod_turn - (rate * omega) ** 2) * np.exp(1j * beta)).real
    angle = np.degrees(phi)
    load = np.where((angle >= 300) & (angle < 345), -20e3, 0.0)
    at_slider = 50 * slider - load  # what the rod does to the slider, along x
    g = 9.80665
    # rod: forces at the crank pin (fx, fy) and -at_slider, -fs at the slider pin
    fx = 10 * centre.real + at_slider
    arm = length * np.exp(1j * beta)
    com = b * np.exp(1j * beta)
    # moments about the rod's centre of mass, with fy = 10 (ay + g) - fsy and fsy what the slider does to the rod
    fsx = -at_slider
    tail, head = -com, arm - com
    weight = 10 * (centre.imag + g)
    fsy = (0.3 * rod_turn + tail.imag * fx - tail.real * weight + head.imag * fsx) / (head.real - tail.real)
    fy = weight - fsy
    np.testing.assert_allclose(joints.components["crank_pin"]["x"], fx, rtol=1e-10, atol=1e-6)
    np.testing.assert_allclose(joints.components["crank_pin"]["y"], fy, rtol=1e-10, atol=1e-6)
    normal = fsy + 50 * g  # the guide carries the slider's weight and what the rod presses
    np.testing.assert_allclose(joints.components["guide"]["normal"], normal, rtol=1e-10, atol=1e-6)


def test_a_belt_beside_a_parallelogram_leaves_its_share_open_and_the_rest_known() -> None:
    bars = {"crank": (0.1, 2.0), "coupler": (0.4, 3.0), "rocker": (0.1, 2.0)}
    bodies = {name: {"points": {"E": [long, 0]}, "mass": kg, "com": [long / 2, 0]} for name, (long, kg) in bars.items()}
    bodies["coupler"]["guess"] = 0
    ends = {"O": ("frame.origin", "crank.origin"), "A": ("crank.E", "coupler.origin")}
    ends |= {"B": ("coupler.E", "rocker.E"), "D": ("frame.D", "rocker.origin")}
    joints = [{"name": name, "type": "pin", "between": list(pair)} for name, pair in ends.items()]
    belt = {"name": "belt", "type": "gear", "between": ["O", "D"], "ratio": 1}
    mechanism = {"type": "linkage", "driver": "O", "joints": joints, "couplings": [belt]}
    scene = flywheel.load({
        "mechanism": mechanism | {"bodies": bodies | {"frame": {"points": {"D": [0.4, 0]}}}},
        "load": [{"on": "rocker", "torque": "-20*sin(phi)**2"}],
        "gravity": {},
        "drive": {"torque": "balance"},
        "regime": {"speed": 10},
        "flywheel": {"inertia": 1},
    })  # fmt: skip
    phi = np.array([0.3, 1.2, 2.5, 4.0])
    forces = joint_forces(scene, phi, speed=10.0)
    result = forces.mechanisms["linkage"]
    assert set(result.undetermined) == {"O.x", "A.x", "B.x", "D.x", "belt.moment"}
    weight = 9.80665 * (2.0 * 0.05 + 3.0 * 0.1 + 2.0 * 0.05)
    np.testing.assert_allclose(result.action, weight * np.cos(phi) + 20.0 * np.sin(phi) ** 2, rtol=1e-10)
    coupler = 3.0 * (9.80665 - 0.1 * 10.0**2 * np.sin(phi))  # on two pins alike
    np.testing.assert_allclose(result.components["A"]["y"], coupler / 2, rtol=1e-9)
    np.testing.assert_allclose(result.components["B"]["y"], -coupler / 2, rtol=1e-9)
    assert {curve.component for curve in force_curves(forces, ["belt"])} == {"moment"}


def test_a_constant_speed_may_be_given() -> None:
    forces = joint_forces(flywheel.load(press()), PHI, speed=5.0, acceleration=2.0)
    assert (forces.motion.omega == 5.0).all()
    assert (forces.motion.alpha == 2.0).all()


def test_quasi_static_leaves_inertia_out() -> None:
    scene = flywheel.load(press())
    slow, fast = (joint_forces(scene, PHI, speed=w, inertia=False).mechanisms["press"].action for w in (1.0, 100.0))
    np.testing.assert_allclose(slow, fast, rtol=1e-12)


def test_a_law_has_no_joints() -> None:
    law = {"type": "law", "outputs": {"ram": {"x": "0.1*sin(phi)", "mass": 2}}}
    scene = flywheel.load({"mechanism": law, "regime": {"speed": 1}, "flywheel": {"inertia": 1}})
    with pytest.raises(SceneError, match=r"mechanism\.type"):
        joint_forces(scene)


def test_a_rotor_has_no_joints() -> None:
    rotor = flywheel.load({"inertia": [{"on": "crank", "value": 1}], "regime": {"speed": 1}, "flywheel": {"inertia": 1}})
    with pytest.raises(SceneError, match="no mechanism"):
        joint_forces(rotor)


def test_angles_are_those_asked_for_or_a_cycle() -> None:
    scene = flywheel.load(press())
    assert joint_forces(scene, speed=1.0).motion.phi.size == 360
    np.testing.assert_allclose(joint_forces(scene, [7.0], speed=1.0).motion.phi, 7.0 - 2 * np.pi)
    with pytest.raises(SceneError, match="phi: found an angle that is not finite"):
        joint_forces(scene, [np.nan], speed=1.0)
    with pytest.raises(SceneError, match="phi: found no position"):
        joint_forces(scene, [], speed=1.0)


def test_positions_outside_a_stroke_are_refused() -> None:
    clamp = Path(__file__).parents[2] / "examples" / "machines" / "injection_clamp.toml"
    with pytest.raises(SceneError, match=r"x: found 0\.3 m, expected a position within the stroke, -0\.06 m to 0\.19 m"):
        joint_forces(flywheel.load(clamp), [0.3])


@pytest.mark.parametrize(("name", "inertia"), sample([("section-c", 5), ("kloss-press", 0.1), ("four-bar", 1)], 3))
def test_driving_actions_follow_the_machine_s_own_motion(name: str, inertia: float) -> None:
    """The crank's driving action is that of drive and loads on shafts less the acceleration of shafts and flywheel."""
    machine = Machine(flywheel.load(regimes.scene(name, inertia=inertia)))
    motion = joint_forces(machine, PHI)
    scene, omega, alpha = machine.scene, motion.motion.omega, motion.motion.alpha
    ratio, fan = scene.flywheel_ratio, scene.shafts.get("fan", 0.0)
    turning = inertia * ratio**2 + sum(item.value * scene.shafts[item.on] ** 2 for item in scene.inertias)
    drive = {
        "section-c": lambda w: 10 - 2.387 * w,
        "kloss-press": lambda w: 12 * _kloss(1 - 12 * w / (50 * np.pi)),
        "four-bar": lambda w: 95 - 4.5 * w,
    }[name](omega)
    left = drive - 0.004 * fan**3 * omega**2 - turning * alpha
    assert asked_of_shafts(machine, motion) == pytest.approx(left, rel=1e-8, abs=1e-7 * np.abs(drive).max())


def _kloss(slip: Any) -> Any:
    return 2 * 49.7 * 0.1916 * slip / (slip**2 + 0.1916**2)


# -- along a motion in time ---------------------------------------------------------------------------------------------

PUSHED: dict[str, Any] = {
    "mechanism": {
        "type": "slider-crank",
        "crank": {"length": 0.1, "mass": 2, "inertia": 0.01},
        "rod": {"length": 0.3, "mass": 3, "inertia": 0.03, "com": 0.12},
        "slider": {"mass": 5},
    },
    "load": [
        {"on": "slider", "force": "-200 - 50*sin(20*t) - 3*v - (400 if t > 0.03 else 0)"},
        {"on": "slider", "force": -300, "from": "10 deg", "to": "20 deg"},
    ],
    "damper": [{"on": "rod", "coefficient": 0.4}],
    "drive": {"torque": 100},
    "regime": {"speed": 30},
    "flywheel": {"inertia": 0.2},
}


@cache
def pushed(rtol: float = 1e-9) -> flywheel.Transient:
    return flywheel.transient(flywheel.load(PUSHED), end=0.06, rtol=rtol)


def test_along_a_run_up_the_shaft_gives_what_the_drive_leaves() -> None:
    """Loads of the instant: whatever acts on the slider, the crank gets T - J alpha of the motion that was followed."""
    forces = joint_forces(flywheel.load(PUSHED), transient=pushed())
    assert forces.motion.time is not None
    assert forces.motion.phi.size == 500
    action = forces.mechanisms["slider-crank"].action
    np.testing.assert_allclose(action, 100.0 - 0.2 * forces.motion.alpha, rtol=0, atol=1e-11 * np.abs(action).max())
    phi, t = forces.motion.phi, forces.motion.time
    beta = -np.arcsin(np.sin(phi) / 3)
    reach = -0.1 * (np.sin(phi) - np.cos(phi) * np.tan(beta))
    slope = np.gradient(reach * forces.motion.omega, t)  # the slider's acceleration
    force = -200 - 50 * np.sin(20 * t) - 3 * reach * forces.motion.omega - 400 * (t > 0.03)
    force -= 300 * ((np.degrees(phi) >= 10) & (np.degrees(phi) < 20))
    inside = (np.abs(t - 0.03) > 3e-4) & (np.abs(np.degrees(phi) - 15) > 5.5) & (np.abs(np.degrees(phi) - 15) > 4.5)
    given = forces.mechanisms["slider-crank"].components["slider_pin"]["x"]
    np.testing.assert_allclose(given[inside][1:-1], (5 * slope - force)[inside][1:-1], rtol=2e-3, atol=0.5)


def test_forces_of_a_run_are_as_good_as_they_say() -> None:
    scene, t = flywheel.load(PUSHED), np.linspace(0.0, 0.06, 41)
    rough, fine = (joint_forces(scene, transient=pushed(rtol), t=t) for rtol in (1e-5, 1e-9))
    errors = joint_errors(Machine(scene), rough)["slider-crank"]["joints"]
    true, close = (figures_of(result.mechanisms["slider-crank"])["joints"] for result in (fine, rough))
    for joint, parts in true.items():
        for part, values in parts.items():
            off, output = np.abs(values - close[joint][part]), errors[joint][part]
            assert (off <= output).all()
            assert output.max() <= 1e-2 * np.abs(values).max() or not values.any()


def test_a_switch_of_a_run_has_two_sides() -> None:
    run = pushed()
    times, owners = evenly(run.motion.trail, 2, breaks=True)
    result = along_run(run, times, owners)
    at = np.flatnonzero(np.abs(times - 0.03) < 1e-12)
    assert at.size == 2
    before, after = result.mechanisms["slider-crank"].components["slider_pin"]["x"][at]
    alpha = result.motion.alpha[at]
    gain = float(np.diff(alpha)[0])  # at one place: the slider's acceleration changes by g dalpha
    phi = float(result.motion.phi[at[0]])
    reach = -0.1 * (np.sin(phi) + np.cos(phi) * np.sin(phi) / np.sqrt(9 - np.sin(phi) ** 2))
    assert after - before == pytest.approx(400 + 5 * reach * gain, rel=1e-9)


def test_a_run_down_of_a_stroke_has_its_forces() -> None:
    ram = {"points": {"P": [0, 0]}, "mass": 2.0}
    guide = {"name": "O", "type": "slide", "between": ["frame.O", "ram.origin"]}
    bodies = {"frame": {"points": {"O": [0, 0]}}, "ram": ram}
    linkage = {"type": "linkage", "driver": "O", "bodies": bodies, "joints": [guide]}
    load = [{"on": "O", "force": "-3*v - 2*t"}]
    scene = flywheel.load({"mechanism": linkage, "load": load, "stroke": {"from": 0, "to": 10, "speed": 1}})
    run = flywheel.transient(scene, start=4.0, end=0.5)
    forces = joint_forces(scene, transient=run, t=[0.0, 0.25, 0.5])
    np.testing.assert_allclose(forces.mechanisms["linkage"].action, 0.0, atol=1e-9)  # nothing but its load slows it
    v = forces.motion.omega
    np.testing.assert_allclose(forces.motion.alpha, (-3 * v - 2 * np.array([0.0, 0.25, 0.5])) / 2, rtol=1e-12)


def test_what_does_not_go_with_a_run_is_told() -> None:
    scene = flywheel.load(PUSHED)
    with pytest.raises(SceneError, match=r"t: found 0\.07 s, expected times of the motion, from 0 to 0\.06 s"):
        joint_forces(scene, transient=pushed(), t=[0.07])
    with pytest.raises(SceneError, match="phi: found a value, expected none, as it follows from the motion"):
        joint_forces(scene, [0.1], transient=pushed())
    with pytest.raises(SceneError, match="transient: found a motion of another scene"):
        joint_forces(flywheel.load(press()), transient=pushed())
    with pytest.raises(SceneError, match="t: found times without a motion in time"):
        joint_forces(scene, t=[0.1])


def test_a_constant_speed_has_its_time_and_so_have_its_loads() -> None:
    scene = flywheel.load(PUSHED)
    forces = joint_forces(scene, [0.5, 1.0], speed=10.0)
    np.testing.assert_allclose(forces.motion.time, [0.05, 0.1])
    back = joint_forces(scene, [0.5, 1.0], speed=-10.0)
    np.testing.assert_allclose(back.motion.time, [(scene.cycle - 0.5) / 10.0, (scene.cycle - 1.0) / 10.0])
    held = PUSHED | {"load": [{"on": "slider", "force": f"{-600 - 50 * float(np.sin(1.0))!r} - 3*v"}]}
    same = joint_forces(flywheel.load(held), [0.5], speed=10.0)
    actions = [f.mechanisms["slider-crank"].action[0] for f in (forces, same)]
    assert actions[0] == pytest.approx(actions[1], rel=1e-12)
    with pytest.raises(SceneError, match=r"load\[0\]\.force: found a law that depends on time, expected a constant speed"):
        joint_forces(scene, [0.5], speed=10.0, acceleration=1.0)


# -- curves -------------------------------------------------------------------------------------------------------------


def test_curves_are_found_by_the_names_of_joints_and_components() -> None:
    forces = joint_forces(flywheel.load(press()), PHI, speed=5.0)
    assert [curve.name for curve in force_curves(forces, ["pivot"])] == [
        "pivot.driving",
        "pivot.x",
        "pivot.y",
        "pivot.resultant",
    ]
    (across,) = force_curves(forces, ["press.guide"], ["y"])
    np.testing.assert_array_equal(across.values, forces.mechanisms["press"].components["guide"]["normal"])
    with pytest.raises(SceneError, match=r"joints: found 'guid', expected one of pivot, .*; did you mean 'guide'\?"):
        force_curves(forces, ["guid"])
    with pytest.raises(
        SceneError, match="component: found 'normal', which no requested joint has, expected one of driving, x"
    ):
        force_curves(forces, ["pivot"], ["normal"])


def test_the_axis_is_the_angle_or_the_time_with_its_switches() -> None:
    scene = flywheel.load(press())
    machine = Machine(scene)
    forces = joint_forces(machine, np.linspace(0.0, 6.2, 400), speed=5.0)
    over = axis(forces, "time")
    assert (over.name, over.unit) == ("t", "s")
    np.testing.assert_allclose(over.edges[-2:] * 5.0, np.radians([300.0, 345.0]), atol=0.02)
    with pytest.raises(SceneError, match="over: found time, for forces at 5 rad/s and 1 rad/s², expected a motion in time"):
        axis(joint_forces(machine, PHI, speed=5.0, acceleration=1.0), "time")


@pytest.mark.slow
def test_along_a_run_with_friction_the_reactions_have_the_friction_of_the_instant() -> None:
    """The crank's driving action, friction included, is that of drive less flywheel; its work is the energy's."""
    scene = flywheel.load(crank_press(0.1, drive={"torque": 60}, flywheel={"inertia": 3}, regime={}))
    run = flywheel.transient(scene, end=0.3)
    forces = along_run(run, *close_times(run))
    result, alpha = forces.mechanisms["linkage"], forces.motion.alpha
    left = np.abs(result.action + 3.0 * alpha - 60.0)
    assert (left <= 1e-9 * 60.0).mean() > 0.99  # where a joint turns back its friction is open
    work = np.trapezoid(result.friction.moment * forces.motion.omega, forces.motion.time)
    assert work == pytest.approx(sum(v for k, v in run.energy.works.items() if "friction" in k), rel=1e-5)
    assert not forces.messages


# Friction in joints at the actual motion: against closed forms and against Newton and Euler by hand.


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


def resisted_press(mu: float = 0.1, **changes: Any) -> dict[str, Any]:
    """The slider-crank of `SliderCrank` as a linkage."""
    scene = {"mechanism": crank_press(mu)["mechanism"], "flywheel": {"inertia": 0.5}}
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
        f"friction in its joints holds F* = {-2 * G * 0.5:.6g} N, and would hold up to {2 * G * 0.7 * np.sqrt(0.75):.6g} N"
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
    assert "at rest: friction in its joints holds F* = 4 N, and would hold up to 5.88399 N" in waiting.ended
    still = sampled(run.motion.trail, np.array([0.5 * start]))
    assert still.acceleration[0] == still.omega[0] == 0.0


def test_a_current_that_rises_breaks_a_rough_pin_away() -> None:
    """K i against r sin(atan mu) m g: i = (1 - exp(-R t/L)) U/R comes to it at t = -L/R ln(1 - R M_f/(K U)), if ever."""
    bodies = {"frame": {"points": {"O": [0, 0]}}, "disc": {"mass": 20.0, "inertia": 0.3}}
    pin = {"name": "O", "type": "pin", "between": ["frame.O", "disc.origin"], "friction": 0.1, "radius": 0.02}
    motor = {"type": "dc", "voltage": 24.0, "resistance": 2.0, "constant": 0.5, "inductance": 0.4}
    mechanism = {"type": "linkage", "driver": "O", "bodies": bodies, "joints": [pin]}
    scene = {"mechanism": mechanism, "gravity": {"g": G}, "drive": {"motor": motor}, "flywheel": {"inertia": 0}}
    run = flywheel.transient(flywheel.load(scene), start="rest", end="1 s")
    rubs = 0.02 * 0.1 / np.hypot(1.0, 0.1) * 20.0 * G
    start = -0.4 / 2.0 * np.log(1.0 - 2.0 * rubs / (0.5 * 24.0))
    assert np.abs(run.motion.t - start).min() < 1e-9

    def rates(t: float, y: Any) -> list[float]:
        return [y[1], (0.5 * y[2] - rubs) / 0.3, (24.0 - 2.0 * y[2] - 0.5 * y[1]) / 0.4]

    after = solve_ivp(rates, (start, 1.0), [0.0, 0.0, rubs / 0.5], "DOP853", rtol=1e-12, atol=1e-14)
    assert run.phi == pytest.approx(after.y[0, -1], rel=1e-7)
    weak = scene | {"drive": {"motor": motor | {"voltage": 1.0}}}
    waiting = flywheel.transient(flywheel.load(weak), start="rest", end="5 s")
    assert f"at rest: friction in its joints holds M* = 0.25 N m, and would hold up to {rubs:.6g} N m" in waiting.ended


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
        (block(0.3, force="4 N"), r"friction in its joints holds F\* = 4 N, and would hold up to 5.88399 N"),
        (
            block(0.3, force="4 N", at=0.4, length=0.05),
            r"locks itself, as no size of load\[0\].force moves it \(self-locking\)",
        ),
        (block(0.3), r"F\* = 0 N, so that nothing moves it"),
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
    follows_by_hand(machine, resisted_press(drive={"torque": "30 - 1.5*omega"}), 1.3, 0.0, 0.2)


@pytest.mark.slow
@pytest.mark.parametrize("gravity", [0.0, G])
def test_turns_of_a_run_up_with_a_falling_torque(gravity: float) -> None:
    machine = SliderCrank(torque=lambda t, phi, omega: 30.0 - 1.5 * omega, wheel=0.5, gravity=gravity)
    scene = resisted_press(drive={"torque": "30 - 1.5*omega"}) | ({"gravity": {}} if gravity else {})
    follows_by_hand(machine, scene, 0.3, 0.0, 0.6)


@pytest.mark.slow
def test_a_crank_that_gravity_swings_until_friction_holds_it() -> None:
    machine = SliderCrank(gravity=G, mu=0.05, mu_guide=0.05)
    follows_by_hand(machine, resisted_press(0.05, gravity={}, flywheel={"inertia": 0.0}), 0.3, 0.0, 30.0)


@pytest.mark.slow
def test_a_rod_without_mass_whose_force_passes_zero_in_all_pins_at_once() -> None:
    """Its pins' resultants have a kink there, which is found like a normal force that changes its sign."""
    machine = SliderCrank(torque=lambda t, phi, omega: 30.0 - 1.5 * omega, wheel=0.5, rod=(0.0, 0.0))
    scene = resisted_press(drive={"torque": "30 - 1.5*omega"})
    scene["mechanism"]["bodies"]["rod"] |= {"mass": 0, "inertia": 0}
    follows_by_hand(machine, scene, 0.3, 0.0, 0.6)


@pytest.mark.parametrize(
    ("weights", "words"),
    [({"gravity": {}}, "2 accelerations fit .*linkage.B"), ({}, "linkage.B jams .* no acceleration fits")],
)
def test_friction_that_leaves_no_acceleration_or_two_is_named_with_its_joint(weights: dict[str, Any], words: str) -> None:
    """As many as roots of |z| = |a + Q |z|| were found from 3000 starts."""
    scene = resisted_press(3.0, drive={"torque": "30 - 1.5*omega"}) | weights
    for joint in scene["mechanism"]["joints"][:3]:
        joint["radius"] = 0.09
    with pytest.raises(SceneError, match=rf"no one motion at crank angle 17.1887 deg after 0 s: .*{words}.*Painlevé"):
        flywheel.simulate(flywheel.load(scene), 0.3, 10.0, 0.3)


@pytest.mark.slow
def test_everything_that_acts_on_ports_presses_on_the_joints() -> None:
    """Loads of v and x, a damper, a spring, added inertia, weights: kinetostatics gives the torque back."""
    scene = resisted_press(
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
    result = port_forces(machine, MachineMotion(now.phi, now.omega, now.acceleration), 0.0, machine.scene.mechanisms[0])
    np.testing.assert_allclose(result.action, 30.0 - 1.5 * now.omega - 0.5 * now.acceleration, rtol=1e-9)


@pytest.mark.slow
def test_friction_over_a_run_is_that_of_kinetostatics_at_its_instants_and_closes_the_energy() -> None:
    run = flywheel.transient(flywheel.load(resisted_press(drive={"torque": "30 - 1.5*omega"})), at=1.3, end=0.15)
    assert run.energy.residual < 1e-9
    assert {"friction in linkage.O", "friction in linkage.ram"} < set(run.energy.works)
    assert all(work < 0.0 for part, work in run.energy.works.items() if part.startswith("friction"))
    machine = run.motion.trail.dynamics.machine
    now = sampled(run.motion.trail, np.array([0.03, 0.12]))
    motion = MachineMotion(now.phi, now.omega, now.acceleration)
    result = port_forces(machine, motion, 0.0, machine.scene.mechanisms[0])
    np.testing.assert_allclose(result.action, 30.0 - 1.5 * now.omega - 0.5 * now.acceleration, rtol=1e-9)


def test_twisting_shafts_and_rough_joints_are_refused_together() -> None:
    scene = resisted_press(drive={"torque": "30 N m"}, shafts={"wheel": {"ratio": 1, "stiffness": 1e4}})
    with pytest.raises(SceneError, match="a shaft that twists in a machine with friction in joints"):
        flywheel.simulate(flywheel.load(scene), 0.3, 1.0, 1.0)


def test_a_pendulum_is_as_good_as_its_steps_though_what_its_square_of_speed_gives_is_rounding():
    """Arm of constant inertia: the power of its d'Alembert force at constant speed is zero but for rounding."""
    mass, about, reach, mu, radius = 3.0, 1.0, 0.4, 0.3, 0.01
    pivot = {"name": "O", "type": "pin", "between": ["frame.origin", "arm.origin"], "friction": mu, "radius": radius}
    arm = {"mass": mass, "inertia": about, "com": [reach, 0.0]}
    scene = flywheel.load(
        {
            "mechanism": {"type": "linkage", "driver": "O", "bodies": {"arm": arm}, "joints": [pivot]},
            "gravity": {},
            "stroke": {"from": -2.6, "to": -0.4},
        }
    )
    motion = flywheel.simulate(scene, -0.7, 0.0, 0.5)
    lever = radius * mu / np.sqrt(1.0 + mu * mu)

    def rates(_, state):
        phi, omega = state
        along, across = np.array([np.cos(phi), np.sin(phi)]), np.array([-np.sin(phi), np.cos(phi)])
        total = about + mass * reach**2
        alpha = -mass * G * reach * np.cos(phi) / total
        for _ in range(50):  # the force in the pin depends on the acceleration, and this on the force
            force = mass * (reach * (alpha * across - omega**2 * along) + [0.0, G])
            alpha = (-mass * G * reach * np.cos(phi) + lever * np.hypot(*force)) / total
        return [omega, alpha]

    expected = solve_ivp(rates, (0.0, 0.5), [-0.7, 0.0], method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    np.testing.assert_allclose([motion.phi[-1], motion.omega[-1]], expected, rtol=1e-9)
    assert motion.error < 1e-9


def test_a_drive_that_grows_frees_a_machine_which_rests_where_a_joint_turns_back() -> None:
    """At 90 deg the rod turns back on the ram's pin: neither which way it turns nor its friction is told by the rate there.

    From rest, as it is by hand from next to none; under weights released when the torque reaches what friction holds, with
    all joints as they turn beyond 90 deg.
    """
    scene = resisted_press(0.1, drive={"torque": "30*t"}, flywheel={"inertia": 0.0})
    hand = SliderCrank(mu_guide=0.1, torque=lambda t, phi, omega: 30.0 * t)
    motion = flywheel.simulate(flywheel.load(scene), 0.5 * np.pi, 0.0, 0.3)
    _, states = hand.run(0.5 * np.pi, 1e-10, 0.3)
    assert motion.ended is None
    assert motion.phi[-1] == pytest.approx(states[-1, 0], rel=1e-9)
    assert motion.omega[-1] == pytest.approx(states[-1, 1], rel=1e-9)
    weighed = SliderCrank(mu_guide=0.1, gravity=G, torque=lambda t, phi, omega: 30.0 * t)
    signs = weighed.begun(0.0, 0.5 * np.pi, 0.0, 1.0)
    start = brentq(lambda t: weighed.solved(t, 0.5 * np.pi, 0.0, signs)[0], 0.0, 1.0, xtol=1e-15)
    motion = flywheel.simulate(flywheel.load(scene | {"gravity": {}}), 0.5 * np.pi, 0.0, start + 0.1)
    assert np.abs(motion.t - start).min() < 1e-11
    assert motion.ended is None
    assert motion.omega[-1] > 0.0


def near_a_lock() -> dict[str, Any]:
    """A four-bar of joints whose coupler and rocker come close to a straight line, where positions need short cells."""
    points = {"frame": {"O": [0, 0], "D": [0.5999, 0]}, "crank": {"A": [0.1, 0]}, "coupler": {"B": [0.4, 0]}}
    bodies: dict[str, Any] = {name: {"points": at} for name, at in points.items()}
    bodies["coupler"] |= {"guess": "20 deg", "mass": 2.0, "inertia": 0.1}
    bodies["rocker"] = {"points": {"B": [0.3001, 0]}, "guess": "100 deg", "mass": 1.0, "inertia": 0.1}
    pairs = {"O": "frame.O crank.origin", "A": "crank.A coupler.origin"}
    pairs |= {"B": "coupler.B rocker.B", "D": "frame.D rocker.origin"}
    joints = [{"name": name, "type": "pin", "between": ends.split()} for name, ends in pairs.items()]
    mechanism = {"type": "linkage", "driver": "O", "bodies": bodies, "joints": joints}
    load = {"on": "rocker", "torque": "-5", "from": "90 deg", "to": "200 deg"}
    regime = {"speed": "60 rpm"}
    return {
        "mechanism": mechanism,
        "load": [load],
        "drive": {"torque": "balance"},
        "regime": regime,
        "flywheel": {"inertia": 5},
    }


def test_breakpoints_are_told_only_where_a_law_switches() -> None:
    scene = flywheel.load(near_a_lock())
    machine = Machine(scene)
    assert machine.breakpoints.size > 6
    assert np.degrees(machine.switches) == pytest.approx([0.0, 90.0, 200.0, 360.0])
    phi = np.linspace(0.0, 2 * np.pi, 721)[:-1]
    assert axis(joint_forces(scene, phi), "driver").edges == pytest.approx([90.0, 200.0])
    run = flywheel.transient(scene, start=6.0, end="1 turns")
    assert run.motion.trail is not None
    times = evenly(run.motion.trail, 2, breaks=True)[0]
    assert np.degrees(sampled(run.motion.trail, *evenly(run.motion.trail, 2, breaks=True)).phi)[1:-1:2] == pytest.approx(
        [90.0, 200.0]
    )
    assert times.size == 6
