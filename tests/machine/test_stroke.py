"""A one-way stroke: reduction, driving action, motion, and what there is not."""

import mpmath as mp
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

import flywheel
from flywheel import Machine, along
from flywheel.mechanisms import families

CLAMP = {
    "type": "toggle-clamp",
    "frame": {"height": 0.14},
    "block": {"mass": 33.293},
    "bell_crank": {"drive_length": 0.16763, "clamp_length": 0.22, "angle": 0.30199, "mass": 16.1475, "inertia": 0.1195},
    "coupler": {"length": 0.095, "mass": 1.3051, "inertia": 0.0022, "com": 0.04},
    "rod": {"length": 0.26, "mass": 16.7364, "inertia": 0.1699, "com": 0.12},
    "platen": {"mass": 298.4963},
}
STROKE = {"from": "-60 mm", "to": "190 mm", "speed": "328.9474 mm/s"}


def clamp(**changes):
    return flywheel.load({"mechanism": CLAMP, "stroke": STROKE} | changes)


def ram(**changes):
    """A mass of 2 kg that slides along 30 deg, from 0.1 to 0.5 m."""
    guide = {"name": "guide", "type": "slide", "between": ["frame.O", "ram.origin"], "direction": "30 deg"}
    bodies = {"frame": {"points": {"O": [0, 0]}}, "ram": {"mass": 2.0}}
    linkage = {"type": "linkage", "driver": "guide", "bodies": bodies, "joints": [guide]}
    return flywheel.load({"mechanism": linkage, "stroke": {"from": 0.1, "to": 0.5, "speed": 1}} | changes)


def lever(**changes):
    """An arm of 0.4 m on a fixed pivot, thrown from 10 to 100 deg: a driver that turns one way."""
    pivot = {"name": "pivot", "type": "pin", "between": ["frame.O", "arm.origin"]}
    bodies = {"frame": {"points": {"O": [0.1, 0]}}, "arm": {"mass": 3.0, "inertia": 0.04, "com": [0.4, 0]}}
    linkage = {"type": "linkage", "driver": "pivot", "bodies": bodies, "joints": [pivot]}
    stroke = {"from": "10 deg", "to": "100 deg", "speed": "2 rad/s", "acceleration": "3 rad/s^2"}
    return flywheel.load({"mechanism": linkage, "gravity": {}, "stroke": stroke} | changes)


def closed_clamp(x):
    """Bell crank's, coupler's and rod's angle and platen of the clamp, by closing its loops at 30 digits."""

    def loops(two, three, six, s):
        five = two + mp.mpf("0.30199") + mp.pi
        return [
            mp.mpf("0.16763") * mp.cos(two) + mp.mpf("0.095") * mp.cos(three) + x,
            mp.mpf("0.16763") * mp.sin(two) + mp.mpf("0.095") * mp.sin(three) - mp.mpf("0.14"),
            mp.mpf("0.22") * mp.cos(five) + mp.mpf("0.26") * mp.cos(six) - s,
            mp.mpf("0.22") * mp.sin(five) + mp.mpf("0.26") * mp.sin(six),
        ]

    near = families.build(clamp().mechanisms[0]).position(float(x), np)  # to begin with: the same assembly
    return mp.findroot(loops, (near.bell_crank, near.coupler, near.rod, near.platen))


def speeds(x):
    """Moving masses and inertias, as (value, g): by differences of the closed loops at 30 digits."""
    with mp.workdps(40):
        step = mp.mpf(10) ** -12

        def places(at):
            two, three, six, s = closed_clamp(at)
            five = two + mp.mpf("0.30199") + mp.pi
            pin = [mp.mpf("0.16763") * mp.cos(two), mp.mpf("0.16763") * mp.sin(two)]
            end = [mp.mpf("0.22") * mp.cos(five), mp.mpf("0.22") * mp.sin(five)]
            coupler = [pin[0] + mp.mpf("0.04") * mp.cos(three), pin[1] + mp.mpf("0.04") * mp.sin(three)]
            rod = [end[0] + mp.mpf("0.12") * mp.cos(six), end[1] + mp.mpf("0.12") * mp.sin(six)]
            return [at, two, three, six, s, *coupler, *rod]

        before, here, after = (places(mp.mpf(x) + k * step) for k in (-1, 0, 1))
        values = [mp.mpf(v) for v in ("33.293", "0.1195", "0.0022", "0.1699", "298.4963", "1.3051", "1.3051")]
        values += [mp.mpf("16.7364")] * 2
        first = [(b - a) / (2 * step) for a, b in zip(before, after, strict=True)]
        second = [(a - 2 * m + b) / step**2 for a, m, b in zip(before, here, after, strict=True)]
        return values, first, second


# -- reduction -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("x", [0.1])
def test_the_reduced_mass_and_the_driving_force_are_those_of_the_closed_loops(x):
    values, g, slope = speeds(x)
    mass = mp.fsum(m * k**2 for m, k in zip(values, g, strict=True))
    mass_slope = 2 * mp.fsum(m * k * s for m, k, s in zip(values, g, slope, strict=True))
    gravity = -mp.mpf("9.80665") * (values[6] * g[6] + values[8] * g[8])  # of coupler and rod
    push = -40000 * g[4] - 300
    scene = clamp(gravity={}, load=[{"on": "platen", "force": "-40 kN"}, {"on": "slide", "force": "-300 N"}])
    result = along(scene, [x], acceleration=2.0)
    assert_allclose(result.state.inertia, float(mass), rtol=1e-12)
    assert_allclose(result.state.slope, float(mass_slope), rtol=1e-10)
    assert_allclose(result.state.moment, float(gravity + push), rtol=1e-11)
    v = mp.mpf("0.3289474")
    assert_allclose(result.driving, float(mass * 2 + mass_slope * v**2 / 2 - gravity - push), rtol=1e-10)


def test_the_clamp_at_full_stretch():
    """The printed read-out of the source, a dead centre: its digits, with the angle that it needs."""
    result = along(clamp(), [0.19])
    turning = {"bell_crank": (-0.7616, -11.972), "coupler": (4.0698, 13.152), "rod": (0.6445, 10.130)}
    for name, (omega, alpha) in turning.items():
        assert_allclose(result.velocities[f"toggle-clamp.{name}"], omega, atol=5e-5)
        assert_allclose(result.accelerations[f"toggle-clamp.{name}"], alpha, atol=5e-4)
    assert_allclose(1e3 * result.velocities["toggle-clamp.platen"], 0.02179, atol=5e-6)
    assert_allclose(1e3 * result.accelerations["toggle-clamp.platen"], -235.27, atol=5e-3)
    assert_allclose(result.velocities["slide"], 0.3289474)


def test_speeds_and_accelerations_of_another_motion():
    scene = clamp()
    x = np.linspace(-0.06, 0.19, 7)
    slow = along(scene, x, speed=0.5, acceleration=-1.5)
    step = 1e-6  # along x(t) = x + 0.5 t - 0.75 t²
    inside = slice(1, -1)
    at = [flywheel.reduce(scene, x[inside] + 0.5 * t - 0.75 * t**2).gains for t in (-step, step)]
    for name, result in slow.accelerations.items():
        before, after = (g[name] * (0.5 - 1.5 * t) for g, t in zip(at, (-step, step), strict=True))
        assert_allclose(result[inside], (after - before) / (2 * step), rtol=1e-7, atol=1e-7)
        assert_allclose(slow.velocities[name], 0.5 * slow.state.gains[name])


def test_virtual_power_pays_for_the_kinetic_energy():
    """With a driving force F the kinetic energy grows by its work: dT/dx = F at constant acceleration, without loads."""
    scene = clamp()
    x, a, v0, start = np.linspace(-0.05, 0.18, 9), 0.7, 0.2, -0.06
    step = 1e-6

    def energy(at):
        return 0.5 * flywheel.reduce(scene, at).inertia * (v0**2 + 2 * a * (at - start))

    slope = (energy(x + step) - energy(x - step)) / (2 * step)
    for k, place in enumerate(x):
        driving = along(scene, [place], speed=np.sqrt(v0**2 + 2 * a * (place - start)), acceleration=a).driving
        assert_allclose(driving, slope[k], rtol=1e-6)


def test_the_drive_is_not_counted_among_the_loads_that_it_must_overcome():
    loads = [{"on": "slide", "force": "-30 N"}]
    idle, driven = ram(load=loads), ram(load=loads, drive={"force": "90 N"})
    assert_allclose(flywheel.reduce(driven, [0.2]).moment, 60.0)
    assert_allclose(along(driven, [0.2], acceleration=5).driving, along(idle, [0.2], acceleration=5).driving)
    assert_allclose(along(driven, [0.2], acceleration=5).driving, 40.0)


def test_a_driver_that_turns_keeps_its_names_and_units():
    result = along(lever(), np.radians([10, 60, 100]))
    inertia = 0.04 + 3 * 0.4**2
    weight = -3 * 9.80665 * 0.4 * np.cos(result.state.phi)
    assert_allclose(result.state.inertia, inertia)
    assert_allclose(result.state.moment, weight, atol=1e-14)
    assert_allclose(result.driving, 3 * inertia - weight, atol=1e-14)
    assert set(result.velocities) >= {"crank"}
    assert_allclose(result.accelerations["crank"], 3.0)


# -- places and loads ------------------------------------------------------------------------------------------------


def test_loads_see_the_drivers_coordinate():
    loads = [
        {"on": "slide", "force": "100*x"},
        {"on": "slide", "force": "-7 N", "from": "0.2 m", "to": "300 mm"},
        {"on": "guide", "force": "1000*phi"},
        {"on": "slide", "table": {"angle": [100, 500], "angle_unit": "mm", "value": [0, 4]}},
    ]
    state = flywheel.reduce(ram(load=loads), [0.1, 0.25, 0.3, 0.5])
    assert_allclose(state.moment_parts["load[0] on slide"], [10, 25, 30, 50])
    assert_allclose(state.moment_parts["load[1] on slide"], [0, -7, 0, 0])
    assert_allclose(state.moment_parts["load[2] on linkage.guide"], [100, 250, 300, 500])
    assert_allclose(state.moment_parts["load[3] on slide"], [0, 1.5, 2, 4], atol=1e-14)


def test_loads_break_where_they_say_and_where_expressions_switch():
    loads = [
        {"on": "slide", "force": "-7 N", "from": "0.2 m", "to": "0.3 m"},
        {"on": "slide", "force": "5 if x > 0.45 else 0"},
        {"on": "slide", "force": "5 if phi > 0.4 else 0"},
        {"on": "slide", "table": {"angle": [0.05, 0.35, 0.9], "value": [0, 4, 1]}},
    ]
    breakpoints = Machine(ram(load=loads)).breakpoints
    assert_allclose(breakpoints + 0.1, [0.1, 0.2, 0.3, 0.35, 0.4, 0.45, 0.5])


def test_a_stroke_on_the_negative_side_does_not_wrap():
    loads = [{"on": "slide", "force": "-7 N", "from": "-0.35 m", "to": "-0.3 m"}, {"on": "slide", "force": "phi"}]
    scene = ram(load=loads, stroke={"from": -0.5, "to": -0.2, "speed": -1})
    state = flywheel.reduce(scene, [-0.5, -0.34, -0.2])
    assert_allclose(state.moment, [-0.5, -7.34, -0.2])
    assert_allclose(along(scene, [-0.3]).velocities["slide"], -1)


def test_one_sided_loads_follow_the_sense_of_their_port():
    loads = [{"on": "platen", "force": "-10 N", "while": "v < 0"}]
    scene = clamp(load=loads, stroke=STROKE | {"to": "200 mm"})
    (stretched,) = (x for x in Machine(scene).breakpoints - 0.06 if 0.1900 < x < 0.1901)  # 30 µm past the printed end
    assert abs(flywheel.reduce(scene, [stretched]).gains["toggle-clamp.platen"][0]) < 1e-12
    state = flywheel.reduce(scene, [0.18, 0.195])
    assert state.moment[0] == 0.0
    assert state.moment[1] > 0.0


def test_springs_and_added_masses_sit_on_the_slide():
    scene = ram(spring=[{"on": "slide", "stiffness": 50, "rest": "0.1 m"}], inertia=[{"on": "slide", "value": "3 kg"}])
    state = flywheel.reduce(scene, [0.1, 0.5])
    assert_allclose(state.inertia, 5.0)
    assert_allclose(state.moment, [0, -20], atol=1e-14)


@pytest.mark.parametrize("x", [0.0999, 0.51, np.nan])
def test_positions_outside_the_stroke_are_refused_not_wrapped(x):
    with pytest.raises(flywheel.SceneError, match=r"^x: found .* m, expected|^x: found a position that is not finite"):
        flywheel.reduce(ram(), [0.2, x])


def test_an_angle_outside_is_told_in_degrees():
    with pytest.raises(
        flywheel.SceneError, match="phi: found 120 deg, expected an angle within the stroke, 10 deg to 100 deg"
    ):
        flywheel.reduce(lever(), np.radians([120]))


def test_a_load_that_is_not_finite_is_named_with_the_slides_position():
    with pytest.raises(flywheel.SceneError, match=r"load\[0\].force: .* slide position 0.2 m"):
        flywheel.reduce(ram(load=[{"on": "slide", "force": "1/(x - 0.2)"}]), [0.2])
    with pytest.raises(flywheel.SceneError, match=r"not finite near phi = 0.2 .* over the stroke"):
        flywheel.simulate(ram(load=[{"on": "slide", "force": "1/(x - 0.2)"}]), 0.1, 1.0, 1.0)


# -- motion ----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_motion_without_loads_keeps_its_energy_and_ends_with_the_stroke():
    scene = clamp()
    machine = Machine(scene)
    motion = flywheel.simulate(machine, -0.06, 0.5, until=9.0, rtol=1e-12)
    start = float(flywheel.reduce(machine, -0.06).inertia)

    def pace(x):
        return np.sqrt(float(flywheel.reduce(machine, x).inertia) / start) / 0.5

    time = quad(pace, -0.06, 0.19, epsabs=1e-13, epsrel=1e-12)[0]
    assert motion.phi[-1] == pytest.approx(0.19, abs=1e-15)
    assert motion.t[-1] == pytest.approx(time, rel=1e-10)
    assert motion.omega[-1] == pytest.approx(1 / pace(0.19), rel=1e-10)
    assert motion.energy_residual < 1e-10
    assert motion.ended == f"the driver reached the stroke's end at 0.19 m after {time:.6g} s"
    x, _ = motion.at([0.0, 0.1])
    assert x[0] == pytest.approx(-0.06)
    with pytest.raises(flywheel.SceneError, match="times up to"):
        motion.at([0.3])


def test_an_oscillator_turns_back_before_the_end():
    """2 kg on 800 N/m: w = 20 rad/s about x = 0.3, amplitude 0.1."""
    scene = ram(spring=[{"on": "slide", "stiffness": 800, "rest": 0.3}])
    motion = flywheel.simulate(scene, 0.3, 2.0, until=1.0, rtol=1e-12)
    t = np.linspace(0, 1, 21)
    x, v = motion.at(t)
    assert motion.ended is None
    assert motion.t[-1] == 1.0
    assert_allclose(x, 0.3 + 0.1 * np.sin(20 * t), atol=1e-10)
    assert_allclose(v, 2 * np.cos(20 * t), atol=2e-9)


@pytest.mark.parametrize(("speed", "end", "sense"), [(5.0, 0.5, 1), (-5.0, 0.1, -1)])
def test_an_oscillator_that_is_too_fast_meets_either_end(speed, end, sense):
    scene = ram(spring=[{"on": "slide", "stiffness": 800, "rest": 0.3}])
    motion = flywheel.simulate(scene, 0.3, speed, until=1.0, rtol=1e-12)
    assert motion.phi[-1] == pytest.approx(end, abs=1e-13)
    assert motion.t[-1] == pytest.approx(np.arcsin(0.2 * 20 / 5) / 20, rel=1e-10)
    assert motion.omega[-1] == pytest.approx(sense * 3.0, rel=1e-10)


def test_a_lever_is_thrown_from_rest():
    scene = lever(drive={"torque": "20 N m"})
    motion = flywheel.simulate(scene, np.radians(10), 0.0, until=5.0)
    work = 20 * np.radians(90) - 3 * 9.80665 * 0.4 * (np.sin(np.radians(100)) - np.sin(np.radians(10)))
    assert motion.phi[-1] == pytest.approx(np.radians(100), abs=1e-12)
    assert motion.omega[-1] == pytest.approx(np.sqrt(2 * work / (0.04 + 3 * 0.4**2)), rel=1e-9)
    assert "100 deg" in motion.ended


@pytest.mark.parametrize(("x", "speed", "force"), [(0.5, 1.0, 0), (0.1, 0.0, -4)])
def test_a_start_that_leaves_the_stroke_is_refused(x, speed, force):
    with pytest.raises(flywheel.SceneError, match=f"slide position {x} m, the stroke's end"):
        flywheel.simulate(ram(load=[{"on": "slide", "force": force}]), x, speed, until=1.0)


def test_a_machine_without_mass_is_refused_with_its_position():
    guide = {"name": "guide", "type": "slide", "between": ["frame.origin", "ram.origin"]}
    linkage = {"type": "linkage", "driver": "guide", "bodies": {"frame": {}, "ram": {}}, "joints": [guide]}
    scene = flywheel.load({"mechanism": linkage, "stroke": {"from": 0, "to": 1, "speed": 1}})
    with pytest.raises(flywheel.SceneError, match=r"inertia: found m\* = 0 kg at slide position 0.5 m"):
        flywheel.simulate(scene, 0.5, 1.0, until=1.0)


# -- what there is not -----------------------------------------------------------------------------------------------


def test_a_stroke_has_no_cycle_to_size_a_flywheel_for():
    with pytest.raises(flywheel.SceneError) as error:
        flywheel.size(clamp())
    (line,) = str(error.value).splitlines()
    assert line.startswith("stroke: found a one-way stroke, which has no cycle and so no flywheel")
    assert "let a crank drive" in line


def test_a_cycle_has_no_stroke_to_go_along():
    rotor = {"regime": {"speed": 1}, "flywheel": {"inertia": 1}}
    with pytest.raises(flywheel.SceneError, match="stroke: found nothing"):
        along(flywheel.load(rotor), [0.0])
