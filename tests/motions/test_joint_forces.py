"""Forces in the joints of whole scenes: against the reduced machine, against Newton-Euler by hand, and at its edges."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flywheel
from flywheel.machine.machine import Machine
from flywheel.motions.joint_forces import along_run, axis, close_times, figures_of, force_curves, joint_errors, joint_forces
from flywheel.motions.transients import evenly
from flywheel.numerics.faults import SceneError
from tests import regimes
from tests.limits import sample
from tests.machine.test_joint_friction import crank_press
from tests.scenes import press, shaper, yoke

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
    found = joint_forces(machine, PHI)
    state = flywheel.reduce(machine, PHI)
    motion = found.motion
    on_shafts = [
        k for k in state.moment_parts if k == "drive" or any(s in k.split(" on ")[-1:] for s in machine.scene.shafts)
    ]
    moments = state.moment - sum((state.moment_parts[key] for key in on_shafts), np.zeros(PHI.size))
    expected = state.inertia * motion.alpha + 0.5 * state.slope * motion.omega**2 - moments
    fixed = sum(i.value * machine.scene.shafts[i.on] ** 2 for i in machine.scene.inertias if i.on in machine.scene.shafts)
    expected = expected - fixed * motion.alpha
    np.testing.assert_allclose(asked_of_shafts(machine, found), expected, atol=1e-10 * np.abs(expected).max())


def test_steady_motion_fulfils_the_equation_of_motion() -> None:
    machine = Machine(flywheel.load(press()))
    motion = joint_forces(machine, PHI).motion
    h = 1e-5
    around = [joint_forces(machine, PHI + s * h).motion.omega for s in (-1, 1)]
    np.testing.assert_allclose(motion.omega * (around[1] - around[0]) / (2 * h), motion.alpha, atol=1e-6)


def test_reactions_of_a_press_by_newton_and_euler() -> None:
    scene = flywheel.load(press())
    found = joint_forces(scene, PHI)
    motion, joints = found.motion, found.mechanisms["press"]
    r, length, b, phi = 0.1, 0.5, 0.2, found.motion.phi
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


def test_a_constant_speed_may_be_given() -> None:
    found = joint_forces(flywheel.load(press()), PHI, speed=5.0, acceleration=2.0)
    assert (found.motion.omega == 5.0).all()
    assert (found.motion.alpha == 2.0).all()


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
    """What the crank asks is what drive and loads on shafts leave after shafts and flywheel have been accelerated."""
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
    found = joint_forces(flywheel.load(PUSHED), transient=pushed())
    assert found.motion.time is not None
    assert found.motion.phi.size == 500
    action = found.mechanisms["slider-crank"].action
    np.testing.assert_allclose(action, 100.0 - 0.2 * found.motion.alpha, rtol=0, atol=1e-11 * np.abs(action).max())
    phi, t = found.motion.phi, found.motion.time
    beta = -np.arcsin(np.sin(phi) / 3)
    reach = -0.1 * (np.sin(phi) - np.cos(phi) * np.tan(beta))
    slope = np.gradient(reach * found.motion.omega, t)  # the slider's acceleration
    force = -200 - 50 * np.sin(20 * t) - 3 * reach * found.motion.omega - 400 * (t > 0.03)
    force -= 300 * ((np.degrees(phi) >= 10) & (np.degrees(phi) < 20))
    inside = (np.abs(t - 0.03) > 3e-4) & (np.abs(np.degrees(phi) - 15) > 5.5) & (np.abs(np.degrees(phi) - 15) > 4.5)
    given = found.mechanisms["slider-crank"].components["slider_pin"]["x"]
    np.testing.assert_allclose(given[inside][1:-1], (5 * slope - force)[inside][1:-1], rtol=2e-3, atol=0.5)


def test_forces_of_a_run_are_as_good_as_they_say() -> None:
    scene, t = flywheel.load(PUSHED), np.linspace(0.0, 0.06, 41)
    rough, fine = (joint_forces(scene, transient=pushed(rtol), t=t) for rtol in (1e-5, 1e-9))
    errors = joint_errors(Machine(scene), rough)["slider-crank"]["joints"]
    true, close = (figures_of(found.mechanisms["slider-crank"])["joints"] for found in (fine, rough))
    for joint, parts in true.items():
        for part, values in parts.items():
            off, told = np.abs(values - close[joint][part]), errors[joint][part]
            assert (off <= told).all()
            assert told.max() <= 1e-2 * np.abs(values).max() or not values.any()


def test_a_switch_of_a_run_has_two_sides() -> None:
    run = pushed()
    times, owners = evenly(run.motion.trail, 2, breaks=True)
    found = along_run(run, times, owners)
    at = np.flatnonzero(np.abs(times - 0.03) < 1e-12)
    assert at.size == 2
    before, after = found.mechanisms["slider-crank"].components["slider_pin"]["x"][at]
    alpha = found.motion.alpha[at]
    gain = float(np.diff(alpha)[0])  # at one place: the slider's acceleration changes by g dalpha
    phi = float(found.motion.phi[at[0]])
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
    found = joint_forces(scene, transient=run, t=[0.0, 0.25, 0.5])
    np.testing.assert_allclose(found.mechanisms["linkage"].action, 0.0, atol=1e-9)  # nothing but its load slows it
    v = found.motion.omega
    np.testing.assert_allclose(found.motion.alpha, (-3 * v - 2 * np.array([0.0, 0.25, 0.5])) / 2, rtol=1e-12)


def test_what_does_not_go_with_a_run_is_told() -> None:
    scene = flywheel.load(PUSHED)
    with pytest.raises(SceneError, match=r"t: found 0\.07 s, expected times of the motion, from 0 to 0\.06 s"):
        joint_forces(scene, transient=pushed(), t=[0.07])
    with pytest.raises(SceneError, match="phi: found a value, expected none, as the motion tells it"):
        joint_forces(scene, [0.1], transient=pushed())
    with pytest.raises(SceneError, match="transient: found a motion of another scene"):
        joint_forces(flywheel.load(press()), transient=pushed())
    with pytest.raises(SceneError, match="t: found times without a motion in time"):
        joint_forces(scene, t=[0.1])


def test_a_constant_speed_has_its_time_and_so_have_its_loads() -> None:
    scene = flywheel.load(PUSHED)
    found = joint_forces(scene, [0.5, 1.0], speed=10.0)
    np.testing.assert_allclose(found.motion.time, [0.05, 0.1])
    held = PUSHED | {"load": [{"on": "slider", "force": f"{-600 - 50 * float(np.sin(1.0))!r} - 3*v"}]}
    same = joint_forces(flywheel.load(held), [0.5], speed=10.0)
    actions = [f.mechanisms["slider-crank"].action[0] for f in (found, same)]
    assert actions[0] == pytest.approx(actions[1], rel=1e-12)
    with pytest.raises(SceneError, match=r"load\[0\]\.force: found a law that depends on time, expected a constant speed"):
        joint_forces(scene, [0.5], speed=10.0, acceleration=1.0)


# -- curves -------------------------------------------------------------------------------------------------------------


def test_curves_are_found_by_the_names_of_joints_and_components() -> None:
    found = joint_forces(flywheel.load(press()), PHI, speed=5.0)
    assert [curve.name for curve in force_curves(found, ["pivot"])] == [
        "pivot.driving",
        "pivot.x",
        "pivot.y",
        "pivot.resultant",
    ]
    (across,) = force_curves(found, ["press.guide"], ["y"])
    np.testing.assert_array_equal(across.values, found.mechanisms["press"].components["guide"]["normal"])
    with pytest.raises(SceneError, match=r"joints: found 'guid', expected one of pivot, .*; did you mean 'guide'\?"):
        force_curves(found, ["guid"])
    with pytest.raises(
        SceneError, match="component: found 'normal', which no joint asked for has, expected one of driving, x"
    ):
        force_curves(found, ["pivot"], ["normal"])


def test_the_axis_is_the_angle_or_the_time_with_its_switches() -> None:
    scene = flywheel.load(press())
    machine = Machine(scene)
    found = joint_forces(machine, np.linspace(0.0, 6.2, 400), speed=5.0)
    over = axis(found, "time")
    assert (over.name, over.unit) == ("t", "s")
    np.testing.assert_allclose(over.edges[-2:] * 5.0, np.radians([300.0, 345.0]), atol=0.02)
    with pytest.raises(SceneError, match="over: found time, of forces at 5 rad/s and 1 rad/s², expected a motion in time"):
        axis(joint_forces(machine, PHI, speed=5.0, acceleration=1.0), "time")


@pytest.mark.slow
def test_along_a_run_with_friction_the_reactions_have_the_friction_of_the_instant() -> None:
    """What the crank asks of its shaft, friction included, is what drive and flywheel leave; its work is the energy's."""
    scene = flywheel.load(crank_press(0.1, drive={"torque": 60}, flywheel={"inertia": 3}, regime={}))
    run = flywheel.transient(scene, end=0.3)
    forces = along_run(run, *close_times(run))
    found, alpha = forces.mechanisms["linkage"], forces.motion.alpha
    left = np.abs(found.action + 3.0 * alpha - 60.0)
    assert (left <= 1e-9 * 60.0).mean() > 0.99  # where a joint turns back its friction is open
    work = np.trapezoid(found.friction.moment * forces.motion.omega, forces.motion.time)
    assert work == pytest.approx(sum(v for k, v in run.energy.works.items() if "friction" in k), rel=1e-5)
    assert not forces.messages
