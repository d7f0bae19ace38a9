"""Models of loads: gas, compressors, presses, resistances, and the energy they take."""

from __future__ import annotations

import math
from math import pi

import numpy as np
import pytest
from mpmath import mp, mpf
from scipy.integrate import quad, solve_ivp

from flywheel import SceneError
from flywheel.components import energy, press_work
from flywheel.components.load_models import (
    Compression,
    Indicator,
    Press,
    Resistance,
    Space,
    belt_torque,
    compressor_law,
    compressor_work,
    cylinder_pressure,
    gas_force,
    greatest_force,
    indicated_pressure,
    indicated_work,
    indicator_law,
    piston_area,
    press_force,
    press_law,
    quadratic_coefficient,
    resistance,
    resistance_law,
    shaft_law,
    sheared_area,
    tension_ratio,
    volumetric_efficiency,
)
from flywheel.components.motors import Curve, Engine, Point
from flywheel.components.press_work import inertia_between, inertia_for

# Gas on a piston: force by area, and indicator diagrams as expressions of the piston's way.


LOOP = Indicator(
    np.array([0.0, 0.1, 0.1, 0.4, 0.9, 1.0]),
    np.array([6e5, 6e5, 5e5, 2e5, 1.2e5, 1e5]),
    np.array([6e5, 3e5, 2.5e5, 1.5e5, 0.9e5, 1e5]),
)
SPACES = [Space(0.02, 0.5, 0.3), Space(0.02, 0.3, 0.5), Space(0.013, -0.1, -0.35)]


def test_areas_of_a_double_acting_cylinder_and_the_atmosphere_on_its_rod():
    bore, rod, atmosphere = 0.3, 0.05, 1e5
    cover, crank = piston_area(bore), piston_area(bore, rod)
    assert cover - crank == pytest.approx(np.pi * rod**2 / 4, rel=1e-13)
    total = gas_force(4e5, Space(cover, 1.0, 0.0), atmosphere) + gas_force(2e5, Space(crank, 0.0, 1.0), atmosphere)
    assert total == pytest.approx(-4e5 * cover + 2e5 * crank + atmosphere * (cover - crank), rel=1e-13)


@pytest.mark.parametrize("space", SPACES)
@pytest.mark.parametrize("outward", [True, False])
def test_the_expression_is_the_formula(space, outward):
    share = np.array([0.0, 0.03, 0.0999, 0.1001, 0.25, 0.4, 0.77, 0.95, 1.0])
    x = space.near + (space.far - space.near) * share
    velocity = np.full(x.shape, (1.0 if space.far > space.near else -1.0) * (1 if outward else -1))
    law = indicator_law(LOOP, space, 1e5)
    expected = gas_force(indicated_pressure(share, np.full(x.shape, outward), LOOP), space, 1e5)
    assert law.evaluate({"x": x, "v": velocity}, np) == pytest.approx(expected, rel=1e-12, abs=1e-6)
    assert not law.uses_speed
    assert law.switches_on_velocity


@pytest.mark.parametrize("space", SPACES)
def test_the_work_of_a_loop_is_that_of_its_force(space):
    shares = [(a, b) for a, b in zip(LOOP.share, LOOP.share[1:], strict=False) if b > a]
    law = indicator_law(LOOP, space, 1e5)
    total = 0.0
    for a, b in shares:
        x = space.near + (space.far - space.near) * 0.5 * (a + b)
        way = (space.far - space.near) * (b - a)
        out, back = (float(law.evaluate({"x": x, "v": sense * way}, np)) for sense in (1, -1))
        total += way * (out - back)  # straight lines: the middle's force is the mean
    assert indicated_work(LOOP, space.area, space.stroke) == pytest.approx(total, rel=1e-12)


# The governed engine: full load, droop, brake.


FULL_LOAD = Curve(speeds=(80.0, 140.0, 180.0, 230.0), torques=(700.0, 900.0, 890.0, 800.0))
ENGINE = Engine(speed=205.0, full_load=FULL_LOAD, droop=0.06, idle=75.0, braking_torque=100.0)


def test_droop_by_its_definition():
    motor = Engine(speed=150.0, full_load=200.0, droop=0.05)
    assert (motor.no_load_speed - motor.rated.speed) / motor.rated.speed == pytest.approx(0.05, rel=1e-13)
    assert motor.rated == Point(150.0, 200.0)
    assert motor.torque(150.0 * 1.0125) == pytest.approx(150.0, rel=1e-12)  # a quarter of the droop, a quarter of the load
    assert motor.torque([0.0, 149.9]).tolist() == [200.0, 200.0]
    assert motor.torque([157.6, 400.0]).tolist() == [0.0, 0.0]


def test_the_curve_rules_up_to_rated_speed_and_the_governor_above():
    below = np.linspace(80.0, 205.0, 57)
    np.testing.assert_array_equal(ENGINE.torque(below), FULL_LOAD.torque(below))
    assert ENGINE.rated == (205.0, pytest.approx(845.0))
    line = np.linspace(205.0, ENGINE.no_load_speed, 21)
    np.testing.assert_allclose(ENGINE.torque(line), np.linspace(845.0, 0.0, 21), rtol=1e-12, atol=1e-10)
    assert ENGINE.torque(300.0) == -100.0


def test_the_running_branch_begins_where_full_load_begins_to_fall():
    assert ENGINE.stable == (140.0, pytest.approx(205.0 * 1.06 + 100.0 * 205.0 * 0.06 / 845.0))
    assert ENGINE.breakdown == Point(140.0, 900.0)
    assert Engine(speed=130.0, full_load=FULL_LOAD, droop=0.06).stable[0] == 130.0
    assert Engine(speed=140.0, full_load=FULL_LOAD, droop=0.06).stable[0] == 140.0
    assert ENGINE.speed_at(870.0) == pytest.approx(180.0 + 50.0 * 20.0 / 90.0)  # lugging, on the curve of full load
    assert ENGINE.speed_at(901.0) is None


@pytest.mark.parametrize(
    ("change", "path"),
    [
        ({"droop": 0.0}, "droop"),
        ({"idle": 205.0}, "idle"),
        ({"speed": 231.0}, "full_load"),
        ({"speed": 76.0}, "full_load"),
        ({"speed": -1.0}, "speed"),
        ({"braking_torque": -1.0}, "braking_torque"),
        ({"full_load": Curve(speeds=(0.0, 205.0), torques=(10.0, 0.0))}, "full_load"),
    ],
)
def test_engines_that_cannot_be(change, path):
    inputs = {"speed": 205.0, "full_load": FULL_LOAD, "droop": 0.06, "idle": 75.0, "braking_torque": 100.0}
    with pytest.raises(SceneError) as caught:
        Engine(**inputs | change)
    assert [fault.path for fault in caught.value.faults] == [path]


# Reciprocating compressors: the cycle's pressures, its work by quadrature, and the expression of its force.


CYCLES = [
    Compression(1e5, 7e5, 0.05, 1.3, 1.3),
    Compression(1e5, 7e5, 0.05, 1.35, 1.2),
    Compression(1e5, 3e5, 0.0, 1.4, 1.4),
    Compression(0.9e5, 5e5, 0.08, 1.0, 1.0),
    Compression(2e5, 2.1e5, 0.3, 1.25, 1.3),
]


@pytest.mark.parametrize("cycle", CYCLES)
def test_the_work_is_the_area_of_the_cycle(cycle):
    edges = [0.0, cycle.suction_begins, cycle.delivery_begins, 1.0]
    total = 0.0
    for a, b in zip(sorted(edges), sorted(edges)[1:], strict=False):
        for outward, sign in ((True, -1), (False, 1)):
            pressure = quad(lambda s: float(cylinder_pressure(s, outward, cycle)), a, b, epsabs=0, epsrel=1e-12)[0]  # noqa: B023
            total += sign * pressure
    assert compressor_work(cycle, 2e-3) == pytest.approx(2e-3 * total, rel=1e-11)


def test_work_and_efficiency_at_30_digits():
    """The textbook's own form, with one exponent: n/(n-1) p (V1 - V4) (r^((n-1)/n) - 1)."""
    with mp.workdps(30):
        c, r, n = mpf("0.05"), mpf(7), mpf("1.3")
        efficiency = 1 + c - c * r ** (1 / n)
        work = n / (n - 1) * 10**5 * mpf("1e-3") * efficiency * (r ** ((n - 1) / n) - 1)
    cycle = CYCLES[0]
    assert volumetric_efficiency(cycle) == pytest.approx(float(efficiency), rel=1e-14)
    assert compressor_work(cycle, 1e-3) == pytest.approx(float(work), rel=1e-14)


@pytest.mark.parametrize("cycle", CYCLES)
def test_pressures_meet_where_valves_open(cycle):
    close = 1e-9
    opens, draws = cycle.delivery_begins, cycle.suction_begins
    assert cylinder_pressure([opens - close, opens], [False, False], cycle) == pytest.approx(
        [cycle.discharge] * 2, rel=1e-12
    )
    assert cylinder_pressure(opens + close, False, cycle) == pytest.approx(cycle.discharge, rel=1e-6)
    assert cylinder_pressure(draws + close, True, cycle) == pytest.approx(cycle.suction, rel=1e-12)
    assert cylinder_pressure(1.0, False, cycle) == pytest.approx(cycle.suction, rel=1e-12)
    if cycle.clearance:
        assert cylinder_pressure(0.0, True, cycle) == pytest.approx(cycle.discharge, rel=1e-12)


def test_an_exponent_of_1_is_the_limit():
    near = CYCLES[3]._replace(exponent=1.0 + 1e-9, expansion=1.0 + 1e-9)
    assert compressor_work(CYCLES[3], 1.0) == pytest.approx(compressor_work(near, 1.0), rel=1e-8)


@pytest.mark.parametrize("cycle", CYCLES)
@pytest.mark.parametrize("near_far", [(0.5, 0.3), (0.3, 0.5), (-0.4, -0.2)])
def test_the_expression_is_the_formula_compressors(cycle, near_far):
    near, far = near_far
    spaces = Space(0.02, near, far), Space(0.017, far, near)
    share = np.linspace(0.001, 0.999, 101)
    x = near + (far - near) * share
    for outward in (True, False):
        velocity = np.full(x.shape, (far - near) * (1 if outward else -1))
        expected = gas_force(cylinder_pressure(share, outward, cycle), spaces[0])
        assert compressor_law(cycle, spaces[:1]).evaluate({"x": x, "v": velocity}, np) == pytest.approx(expected, rel=1e-11)
        expected = expected + gas_force(cylinder_pressure(1 - share, not outward, cycle), spaces[1])
        law = compressor_law(cycle, spaces)
        assert law.evaluate({"x": x, "v": velocity}, np) == pytest.approx(expected, rel=1e-10, abs=1e-6)
        assert not law.uses_speed


# What resists motion: values, the compiled expression, the point that a fan's characteristic passes through.


SPEEDS = np.array([-30.0, -1.5, -1e-6, 1e-6, 0.3, 2.0, 80.0])


@pytest.mark.parametrize("variable", ["omega", "v"])
@pytest.mark.parametrize(
    "law",
    [
        Resistance(4.0),
        Resistance(0.0, 0.7),
        Resistance(0.0, 0.0, 0.03),
        Resistance(4.0, 0.7, 0.03),
        Resistance(1e-9, 0, 1e9),
    ],
)
def test_the_expression_is_the_formula_resistance(law, variable):
    result = resistance_law(law, variable).evaluate({"omega": SPEEDS, "v": SPEEDS}, np)
    assert result == pytest.approx(resistance(SPEEDS, law), rel=1e-15)
    assert np.all(resistance(SPEEDS, law) * SPEEDS < 0)


def test_nothing_resists_where_every_share_is_0():
    assert float(resistance_law(Resistance(), "v").evaluate({}, np)) == 0.0


def test_only_shares_that_depend_on_speed_make_a_law_depend_on_it():
    assert not resistance_law(Resistance(3.0), "omega").uses_speed
    assert resistance_law(Resistance(3.0, 0.1), "omega").uses_speed
    assert resistance_law(Resistance(0.0, 0.0, 0.1), "v").uses_speed


def test_a_fan_takes_what_it_was_given_at_its_speed_and_follows_the_affinity_laws():
    c = quadratic_coefficient(50.0, 10.0)
    assert resistance(10.0, Resistance(quadratic=c)) == pytest.approx(-50.0)
    assert resistance(20.0, Resistance(quadratic=c)) * 20.0 == pytest.approx(8 * -500.0)
    with_head = Resistance(20.0, 0.0, quadratic_coefficient(50.0, 10.0, 20.0))
    assert resistance([10.0, 1e-9], with_head) == pytest.approx([-50.0, -20.0])


def test_belts_by_integrating_the_tension_along_the_wrap():
    friction, wrap, steps = 0.25, 2.8, 200_000
    tension = np.prod(np.full(steps, 1 + friction * wrap / steps))
    assert tension_ratio(friction, wrap) == pytest.approx(tension, rel=1e-5)
    half = np.radians(17.0)
    assert tension_ratio(friction, wrap, 2 * half) == pytest.approx(tension_ratio(friction / np.sin(half), wrap), rel=1e-14)
    assert belt_torque(1200.0, 400.0, 0.3) == pytest.approx(240.0)
    assert tension_ratio(1e3, 1e3) == np.inf


# Presses: energy of a stroke, force by penetration, and the same as expressions of x and v, or of phi.


SHAPES = ["constant", "triangular"]


@pytest.mark.parametrize("shape", SHAPES)
def test_the_energy_of_a_stroke_is_the_work_of_its_force(shape):
    press = Press(3e5, 0.012, shape)
    work = quad(lambda p: float(press_force(p, press)), 0.0, 0.012, epsabs=0, epsrel=1e-13)[0]
    assert press.energy == pytest.approx(work, rel=1e-13)
    assert greatest_force(press.energy, press.travel, shape) == pytest.approx(press.force, rel=1e-15)


def test_a_shearing_force_does_half_of_its_greatest_times_the_thickness():
    thickness, strength = 0.015, 300e6
    area = sheared_area(thickness, np.pi * 0.04)
    assert area == pytest.approx(np.pi * 0.04 * 0.015)
    assert Press(strength * area, thickness, "triangular").energy == pytest.approx(strength * area * thickness / 2)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("overtravel", [0.0, 0.004])
@pytest.mark.parametrize("high", [True, False])
def test_the_expression_is_the_formula_press_loads(shape, overtravel, high):
    press, end, sign = Press(3e5, 0.012, shape, overtravel), 0.3, 1 if high else -1
    way_left = np.array([0.03, 0.0161, 0.0159, 0.0121, 0.0119, 0.008, 0.0041, 0.0039, 0.001, 1e-5])
    law = press_law(press, end, high)
    at = {"x": end - sign * way_left, "v": np.full(way_left.shape, float(sign))}
    expected = -sign * press_force(press.travel + overtravel - way_left, press)
    assert law.evaluate(at, np) == pytest.approx(expected, rel=1e-12)
    assert not np.any(law.evaluate(at | {"v": -at["v"]}, np))
    assert not law.uses_speed


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("window", [(1.0, 2.5), (5.0, 1.0), (0.0, 0.3), (4.0, 6.0)])
def test_the_torque_on_a_shaft_gives_the_energy_over_its_window(shape, window):
    every, ratio = 6.0, 2.5
    law = shaft_law(70.0, window, every, ratio, shape)
    start, end = window
    pieces = [(start, end)] if start < end else [(start, every), (0.0, end)]
    torque = [quad(lambda phi: float(law.evaluate({"phi": phi}, np)), *piece)[0] for piece in pieces]
    assert ratio * sum(torque) == pytest.approx(-70.0, rel=1e-12)
    peak = float(law.evaluate({"phi": start}, np))
    assert peak == pytest.approx(-(2 if shape == "triangular" else 1) * 70.0 / (ratio * ((end - start) % every)))
    if shape == "triangular":
        assert float(law.evaluate({"phi": end}, np)) == pytest.approx(0.0, abs=1e-12)


def test_khurmi_16_22_energy_of_a_hole():
    """40 mm through 15 mm at 6 J/mm²: its flywheel gives what the motor does not in 0.1 s of 2 s, from 160 to 140 rpm."""
    energy = 6e6 * sheared_area(0.015, np.pi * 0.04)
    inputs = energy * (1 - 0.1 / 2.0)
    high, low = 160 * np.pi / 30, 140 * np.pi / 30
    assert inputs / (0.5 * (high**2 - low**2)) == pytest.approx(326.58594322456935, rel=1e-12)


# Presses: strokes, rates and clutches, against energy and momentum kept by hand.


def test_a_triangle_of_force_is_the_energy_per_area():
    perimeter, thickness, strength = math.pi * 0.04, 0.015, 400e6
    force = press_work.shearing_force(perimeter, thickness, strength)
    energy = press_work.stroke_energy(force, thickness)
    assert energy == pytest.approx(press_work.cutting_energy(perimeter, thickness, strength * thickness / 2), rel=1e-14)
    assert press_work.stroke_energy(force, thickness, "constant") == 2 * energy


def test_a_press_whose_punch_works_for_a_share_of_its_travel():
    """38 mm holes in 32 mm plate, 7 J/mm², one in 10 s, stroke 100 mm, rim at 25 m/s within 3 %."""
    energy = press_work.cutting_energy(math.pi * 0.038, 0.032, 7e6)
    press = press_work.press_cycle(energy, 10.0, press_work.busy_time(0.032, 0.1, 10.0))
    assert press.power == pytest.approx(math.pi * 38 * 32 * 7 / 10, rel=1e-14)
    assert press.given == pytest.approx(energy * 0.84, rel=1e-14)
    mass = inertia_for(press.given, 25.0, 0.03)
    assert mass == pytest.approx(inertia_between(press.given, 25.0 * 1.015, 25.0 * 0.985), rel=1e-13)


@pytest.mark.parametrize("losses", [(0.8, 1.0), (1.0, 0.8), (0.9, 0.7)])
def test_energy_is_kept_whatever_is_known_first(losses):
    """While the tool works flywheel and motor give what it takes and what is lost on the way; the motor gives all of it."""
    press = press_work.press_cycle(9e3, 4.0, 0.5, *losses)
    after, before = losses
    assert press.motor_power * press.cycle * before * after == pytest.approx(press.energy, rel=1e-15)
    reaching = press.motor_power * before
    assert (press.given + reaching * press.busy) * after == pytest.approx(press.energy, rel=1e-15)
    assert reaching * (press.cycle - press.busy) == pytest.approx(press.given, rel=1e-14)  # what the flywheel gets back
    assert press_work.press_at(9e3, press.motor_power, 0.5, *losses) == pytest.approx(press, rel=1e-14)
    assert press_work.press_of(press.given, 4.0, 0.5, *losses) == pytest.approx(press, rel=1e-14)


def test_the_flywheel_gives_what_is_lost_behind_it():
    """Jindal, example 19.4: 2035.752 J in a sixth of each second, 95 % of the motor's energy reaches the tool."""
    assert press_work.press_cycle(2035.752, 1.0, 1 / 6, 0.95).given == pytest.approx(1785.747, abs=1e-3)
    assert press_work.press_cycle(2035.752, 1.0, 1 / 6, drive_efficiency=0.95).given == pytest.approx(1696.46, abs=1e-3)


def test_a_clutch_loses_what_its_sides_do_not_have():
    met = press_work.engage(30.0, 20.0, 10.0, driven_speed=4.0, torque=80.0)
    assert 40.0 * met.speed == pytest.approx(30.0 * 20.0 + 10.0 * 4.0, rel=1e-15)
    assert met.given == pytest.approx(15.0 * (20.0**2 - met.speed**2), rel=1e-14)
    assert met.taken == pytest.approx(5.0 * (met.speed**2 - 4.0**2), rel=1e-14)
    assert met.heat == pytest.approx(met.given - met.taken, rel=1e-14)
    assert 20.0 - 80.0 / 30.0 * met.time == pytest.approx(met.speed, rel=1e-14)
    assert 4.0 + 80.0 / 10.0 * met.time == pytest.approx(met.speed, rel=1e-14)


def test_the_heat_is_the_clutch_torque_over_the_slip_however_it_varies():
    def rates(time, state):
        torque = 200.0 * time * (3.0 + math.sin(40.0 * time))
        return [-torque / 30.0, torque / 10.0, torque * (state[0] - state[1])]

    def slip(_, state):
        return state[0] - state[1]

    slip.terminal = True
    end = solve_ivp(rates, (0.0, 10.0), [20.0, 0.0, 0.0], rtol=1e-11, atol=1e-11, events=slip, method="DOP853").y[:, -1]
    met = press_work.engage(30.0, 20.0, 10.0)
    assert end == pytest.approx([met.speed, met.speed, met.heat], rel=1e-8)


def test_nothing_behind_the_clutch_loses_nothing():
    stroke = press_work.single_stroke(2.0, 30.0, 500.0)
    assert stroke.engagement.heat == 0.0
    assert stroke.speed == pytest.approx(20.0, rel=1e-15)
    assert stroke.slow_down == pytest.approx(1 / 3, rel=1e-14)


def test_a_single_stroke_keeps_account_of_all_energy():
    stroke = press_work.single_stroke(12.0, 40.0, 3e3, driven_inertia=1.5, power=2e3, busy=0.3)
    before, after = 6.0 * 40.0**2, 6.75 * stroke.speed**2
    assert before + 2e3 * 0.3 == pytest.approx(after + 3e3 + stroke.engagement.heat, rel=1e-14)


def test_a_single_stroke_pays_for_its_losses():
    """The tool's 3 kJ are 80 % of what the shaft gives, and 90 % of the motor's power reach it."""
    losses = {"efficiency": 0.8, "drive_efficiency": 0.9}
    stroke = press_work.single_stroke(12.0, 40.0, 3e3, driven_inertia=1.5, power=2e3, busy=0.3, **losses)
    assert stroke.energy == pytest.approx(3e3 / 0.8 - 0.9 * 2e3 * 0.3, rel=1e-14)
    plain = press_work.single_stroke(12.0, 40.0, 3e3 / 0.8, driven_inertia=1.5, power=1.8e3, busy=0.3)
    assert stroke.speed == pytest.approx(plain.speed, rel=1e-14)


@pytest.mark.parametrize(("low", "driven"), [(35.0, 0.0), (35.0, 2.0), (0.0, 2.0), (39.9, 0.1)])
def test_the_flywheel_of_a_single_stroke(low, driven):
    inertia = press_work.inertia_for_single_stroke(40.0, low, 3e3, driven)
    assert press_work.single_stroke(inertia * (1 + 1e-12), 40.0, 3e3, driven).speed == pytest.approx(low, rel=1e-9, abs=1e-3)
    if driven == 0.0:
        assert inertia == pytest.approx(inertia_between(3e3, 40.0, low), rel=1e-14)


@pytest.mark.parametrize(
    ("call", "paths"),
    [
        (lambda: press_work.shearing_force(0.0, -1.0, math.inf), ["perimeter", "thickness", "strength"]),
        (lambda: press_work.stroke_energy(1.0, 1.0, "square"), ["shape"]),
        (lambda: press_work.cutting_energy(1.0, 1.0, "6"), ["energy_per_area"]),
        (lambda: press_work.busy_time(0.2, 0.1, 1.0), ["travel"]),
        (lambda: press_work.press_cycle(1.0, 2.0, 2.0, 1.1), ["busy", "efficiency"]),
        (lambda: press_work.press_cycle(1.0, 2.0, 1.0, 0.0, 1.1), ["efficiency", "drive_efficiency"]),
        (lambda: press_work.single_stroke(2.0, 30.0, 500.0, efficiency=95.0), ["efficiency"]),
        (lambda: press_work.press_at(1e3, 1e3, 1.5), ["busy"]),
        (lambda: press_work.press_of(1e3, 1.0, 1.0), ["busy"]),
        (lambda: press_work.engage(1.0, 2.0, 1.0, 3.0), ["driven_speed"]),
        (lambda: press_work.engage(1.0, 2.0, 1.0, torque=0.0), ["torque"]),
        (lambda: press_work.single_stroke(1.0, 2.0, 3.0), ["energy"]),
        (lambda: press_work.inertia_for_single_stroke(1.0, 1.0, 3.0), ["low"]),
    ],
)
def test_what_cannot_be_is_refused(call, paths):
    with pytest.raises(SceneError) as caught:
        call()
    assert [fault.path for fault in caught.value.faults] == paths


# Power and energy over a cycle, against closed forms.


def gauss(n=200):
    nodes, weights = np.polynomial.legendre.leggauss(n)
    return pi * (nodes + 1), pi * weights


def test_powers_with_and_without_a_flywheel():
    phi, weights = gauss()
    omega, load = 20 + 2 * np.cos(phi), -(50 + 30 * np.sin(phi))
    result = energy.of_cycle(omega, 50.0, load, weights)
    period = 2 * pi / np.sqrt(20**2 - 2**2)  # the integral of dphi/(a + b cos phi)
    assert result.period == pytest.approx(period, rel=1e-13)
    assert result.work == pytest.approx(100 * pi, rel=1e-13)
    assert result.mean_power == pytest.approx(100 * pi / period, rel=1e-13)
    assert result.peak_power == pytest.approx(50 * 22, rel=1e-3)
    assert result.mean_power_alone == pytest.approx(50 * 20, rel=1e-4)
    assert result.peak_to_mean_alone == pytest.approx(80 / 50, rel=1e-3)


def test_points_without_weight_count_for_peaks_alone():
    phi, weights = gauss()
    ends = np.append(phi, [0.0, pi / 2])
    loads = -(50 + 30 * np.sin(ends))
    result = energy.of_cycle(20 + 2 * np.cos(ends), 50.0, loads, np.append(weights, [0.0, 0.0]), speed=20.0)
    assert result.work == pytest.approx(100 * pi, rel=1e-13)
    assert result.peak_power == 1100.0
    assert result.peak_power_alone == 1600.0
    assert result.mean_power_alone == pytest.approx(1000.0, rel=1e-13)


def test_a_motor_that_brakes_has_powers_below_zero():
    result = energy.of_cycle([10.0, 10.0], -3.0, [6.0, 0.0], [pi, pi])
    assert (result.mean_power, result.peak_power) == pytest.approx((-30.0, -30.0))
    assert result.peak_power_alone == -60.0
    assert result.peak_to_mean == pytest.approx(1.0)
    assert result.peak_to_mean_alone == pytest.approx(2.0)


def test_no_mean_power_gives_no_ratio():
    result = energy.of_cycle([10.0, 10.0], 0.0, [6.0, -6.0], [pi, pi])
    assert result.peak_to_mean is None
    assert result.peak_to_mean_alone is None
    assert result.as_dict()["kilowatt_hours"] == 0.0


def test_the_exam_of_march_2010():
    """x = -3 R cos phi, R = 0.1 m, 750 N over half a turn at 210 rpm: 1575 W, printed 678.22 kcal in half an hour."""
    nodes, halves = np.polynomial.legendre.leggauss(40)
    once = pi / 2 * (nodes + 1)
    weights = np.concatenate((pi / 2 * halves, pi / 2 * halves))
    load = np.concatenate((-750.0 * 0.3 * np.sin(once), np.zeros(40)))
    result = energy.of_cycle(np.full(80, 7 * pi), 225 / pi, load, weights)
    assert result.work == pytest.approx(450.0, rel=1e-14)
    assert result.mean_power == pytest.approx(1575.0, rel=1e-13)
    assert energy.kilocalories(result.mean_power, 1800.0, 4.18) == pytest.approx(678.2297, abs=5e-5)
    assert result.as_dict()["kilowatt_hours"] == pytest.approx(1.575, rel=1e-13)
    assert result.peak_to_mean_alone == pytest.approx(pi, rel=1e-2)


@pytest.mark.parametrize(
    ("arguments", "paths"),
    [
        (([], 1.0, 1.0, []), ["omega"]),
        (([1.0, 0.0], 1.0, 1.0, [1.0, 1.0]), ["omega"]),
        (([1.0, 2.0], 1.0, 1.0, [1.0]), ["weights"]),
        (([1.0, 2.0], 1.0, 1.0, [1.0, -1.0]), ["weights"]),
        (([1.0, 2.0], [1.0], 1.0, [1.0, 1.0]), ["drive"]),
        (([1.0, 2.0], 1.0, np.nan, [1.0, 1.0]), ["load"]),
        (([1.0, 2.0], 1.0, 1.0, [1.0, 1.0], -1.0), ["speed"]),
    ],
)
def test_what_is_no_cycle_is_refused(arguments, paths):
    with pytest.raises(SceneError) as caught:
        energy.of_cycle(*arguments)
    assert [fault.path for fault in caught.value.faults] == paths


def test_numbers_alone_are_converted():
    with pytest.raises(SceneError, match="calorie"):
        energy.kilocalories(1.0, 1.0, 0.0)
    with pytest.raises(SceneError, match="power"):
        energy.kilowatt_hours("1 kW", 1.0)
