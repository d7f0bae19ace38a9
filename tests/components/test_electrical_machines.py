"""Alternating-current motors: induction, synchronous, two-axis model, circuit, line current."""

import cmath
import math

import numpy as np
import pytest
from mpmath import mp, mpf
from scipy.integrate import solve_ivp
from scipy.optimize import root

import flywheel
from flywheel import SceneError, transient
from flywheel.components.motors import EquivalentCircuit, Impedances, Induction, Plate, Synchronous, TwoAxisInduction
from flywheel.components.motors.synchronous import pull_out
from flywheel.components.motors.two_axis import impedances_of

# Kloss's formula against the circuit it comes from, and rated data that contradict each other.


RPM = math.pi / 30
PLATE = {"power": 7500.0, "speed": 1450 * RPM, "poles": 4, "frequency": 50.0, "breakdown_ratio": 2.5}
MOTOR = Induction(**PLATE)


def circuit_torque(omega: float, motor: Induction) -> mpf:
    """Torque of a rotor circuit r/s + jx behind a stiff voltage, scaled to the breakdown torque: s_b = r/x.

    The power that crosses the air gap, I² r/s, divided by synchronous speed.
    """
    slip = 1 - mpf(omega) * motor.poles / (4 * mp.pi * motor.frequency)
    r, x = mpf(1), 1 / mpf(motor.breakdown_slip)
    gap, greatest = (r / slip) / ((r / slip) ** 2 + x**2), 1 / (2 * x)
    return mpf(motor.breakdown_torque) * gap / greatest


def test_torque_is_that_of_the_circuit():
    speeds = np.array([-100.0, 0.0, 80.0, 131.9, 140.0, 151.8, 156.9, 157.2, 170.0, 300.0])
    with mp.workdps(30):
        expected = [float(circuit_torque(speed, MOTOR)) for speed in speeds]
    np.testing.assert_allclose(MOTOR.torque(speeds), expected, rtol=2e-14)


def test_the_curve_passes_through_rated_point_and_breakdown():
    assert MOTOR.torque(MOTOR.rated.speed) == pytest.approx(7500 / (1450 * RPM), rel=1e-14)
    assert MOTOR.rated.power == pytest.approx(7500.0, rel=1e-15)
    fine = np.linspace(100.0, 157.0, 200_001)
    torques = MOTOR.torque(fine)
    assert torques.max() == pytest.approx(2.5 * MOTOR.rated.torque, rel=1e-9)
    assert fine[torques.argmax()] == pytest.approx(MOTOR.breakdown.speed, abs=1e-3)
    assert MOTOR.slope_at(MOTOR.breakdown.speed) == pytest.approx(0.0, abs=1e-11)


def test_marks_of_the_curve():
    assert MOTOR.synchronous_speed == pytest.approx(1500 * RPM, rel=1e-15)
    assert MOTOR.rated_slip == pytest.approx(1 / 30, rel=1e-13)
    assert MOTOR.breakdown_slip == pytest.approx((2.5 + math.sqrt(5.25)) / 30, rel=1e-13)
    with mp.workdps(30):
        assert MOTOR.starting_torque == pytest.approx(float(circuit_torque(0.0, MOTOR)), rel=1e-14)
    assert MOTOR.torque(MOTOR.synchronous_speed) == 0.0


def test_starting_torque_of_a_textbook_motor():
    """Breakdown torque 500 N m at slip 0.236: 2 * 500/(1/0.236 + 0.236) at rest."""
    slip, ratio = 0.236, 2.0
    rated_slip = slip / (ratio + math.sqrt(3.0))
    speed = 1500 * RPM * (1 - rated_slip)
    motor = Induction(power=250.0 * speed, speed=speed, poles=4, frequency=50.0, breakdown_ratio=ratio)
    assert motor.breakdown == pytest.approx((1500 * RPM * (1 - slip), 500.0), rel=1e-13)
    assert motor.starting_torque == pytest.approx(1000 / (1 / slip + slip), rel=1e-13)


def test_it_generates_above_synchronous_speed_as_it_drives_below():
    off = np.linspace(0.1, 60.0, 50)
    above, below = (MOTOR.torque(MOTOR.synchronous_speed + side * off) for side in (1, -1))
    np.testing.assert_allclose(above, -below, rtol=1e-12)
    assert MOTOR.speed_at(-MOTOR.rated.torque) == pytest.approx(1550 * RPM, rel=1e-14)


def test_speed_at_no_load_and_near_it_is_exact():
    assert MOTOR.speed_at(0.0) == MOTOR.synchronous_speed
    slip = 1 - MOTOR.speed_at(1e-6) / MOTOR.synchronous_speed
    assert slip == pytest.approx(1e-6 / (2 * MOTOR.breakdown_torque) * MOTOR.breakdown_slip, rel=1e-6)


@pytest.mark.parametrize(
    ("change", "path", "hint"),
    [
        ({"poles": 6}, "speed", "has 4 poles"),
        ({"poles": 2}, "speed", "has 4 poles"),
        ({"speed": 1500 * RPM}, "speed", "1500 rpm of 4 poles"),
        ({"speed": 3600 * RPM}, "speed", "1500 rpm"),
        ({"poles": 3}, "poles", "even"),
        ({"poles": 2.5}, "poles", "even"),
        ({"poles": 0}, "poles", "even"),
        ({"breakdown_ratio": 1.0}, "breakdown_ratio", "above 1"),
        ({"power": -1.0}, "power", "above 0"),
        ({"frequency": math.inf}, "frequency", "above 0"),
    ],
)
def test_data_that_contradict_each_other(change, path, hint):
    with pytest.raises(SceneError) as caught:
        Induction(**PLATE | change)
    (fault,) = caught.value.faults
    assert fault.path == path
    assert hint in str(fault)


def test_advice_only_where_poles_would_fit():
    with pytest.raises(SceneError) as caught:
        Induction(**PLATE | {"speed": 3600 * RPM})
    assert "poles" not in caught.value.faults[0].advice
    with pytest.raises(SceneError) as caught:
        Induction(**PLATE | {"speed": 1500 * RPM})
    assert not caught.value.faults[0].advice


# The equivalent circuit of an induction motor: printed cases of textbooks, and Kloss's formula as its simplification.


CHAPMAN = EquivalentCircuit(
    voltage=460.0,
    synchronous_speed=60 * math.pi,
    stator_resistance=0.641,
    stator_reactance=1.106,
    rotor_resistance=0.332,
    rotor_reactance=0.464,
    magnetizing_reactance=26.3,
)
FITZGERALD = EquivalentCircuit(
    voltage=220.0,
    synchronous_speed=40 * math.pi,
    stator_resistance=0.294,
    stator_reactance=0.503,
    rotor_resistance=0.144,
    rotor_reactance=0.209,
    magnetizing_reactance=13.25,
)


def test_chapman_example_6_3():
    """Printed for a slip of 2.2 %: 18.88 A, 0.833, 12,530 W taken, 685 W in the stator, 11,845 W in the gap, 62.8 N m.

    With 1100 W of rotational losses 10,485 W and 56.9 N m at the shaft, 83.7 %. The book rounds the impedances: 18.89 A.
    """
    current = complex(CHAPMAN.current(0.022))
    taken = 3 * 460 / math.sqrt(3) * current.real
    gap = float(CHAPMAN.torque(0.022)) * CHAPMAN.synchronous_speed
    assert abs(current) == pytest.approx(18.88, abs=0.02)
    assert CHAPMAN.power_factor(0.022) == pytest.approx(0.833, abs=1.5e-3)
    assert taken == pytest.approx(12530, abs=10)
    assert taken - gap == pytest.approx(685, abs=2)
    assert taken - gap == pytest.approx(3 * 0.641 * abs(current) ** 2, rel=1e-12)
    assert gap == pytest.approx(11845, abs=10)
    assert CHAPMAN.torque(0.022) == pytest.approx(62.8, abs=0.05)
    shaft = gap * (1 - 0.022) - 1100
    assert shaft == pytest.approx(10485, abs=10)
    assert shaft / (CHAPMAN.synchronous_speed * 0.978) == pytest.approx(56.9, abs=0.07)
    assert 100 * shaft / taken == pytest.approx(83.7, abs=0.05)


def test_chapman_example_6_5_and_its_slip():
    """Printed: breakdown at a slip of 0.198 with 229 N m, start with 104 N m; rotor resistance doubled, 0.396 and 170 N m.

    The text has X_TH + X_2 with X_TH = 1.075 ohm, but its numbers are those of X_1 + X_2 and of 266 V for a phase: with the
    formulas as they stand it is 0.2014 and 230.8 N m, 106.6 N m; 0.4028 and 174.1 N m.
    """
    thevenin, reactance, slipped = 255.2, 1.106 + 0.464, 0.332 / math.hypot(0.590, 1.106 + 0.464)
    assert slipped == pytest.approx(0.198, abs=5e-4)
    assert 3 * thevenin**2 / (2 * 188.5 * (0.590 + math.hypot(0.590, reactance))) == pytest.approx(229, abs=0.5)
    assert CHAPMAN.breakdown_slip == pytest.approx(0.2014, abs=5e-5)
    assert CHAPMAN.breakdown_torque == pytest.approx(230.8, abs=0.05)
    assert CHAPMAN.torque(1.0) == pytest.approx(106.6, abs=0.05)
    slips = np.linspace(0.15, 0.25, 100_001)
    assert CHAPMAN.torque(slips).max() == pytest.approx(CHAPMAN.breakdown_torque, rel=1e-9)


def test_fitzgerald_examples_6_2_and_6_3():
    """Printed: slip 2 %, 18.8 A, 5740 W in the gap, with 403 W of losses 42.4 N m; breakdown 175 N m at 970 rpm."""
    current = complex(FITZGERALD.current(0.02))
    gap = float(FITZGERALD.torque(0.02)) * FITZGERALD.synchronous_speed
    assert abs(current) == pytest.approx(18.8, abs=0.05)
    assert gap == pytest.approx(5740, abs=5)
    assert (0.98 * gap - 403) / (0.98 * FITZGERALD.synchronous_speed) == pytest.approx(42.4, abs=0.05)
    assert FITZGERALD.breakdown_torque == pytest.approx(175, abs=0.5)
    assert 1200 * (1 - FITZGERALD.breakdown_slip) == pytest.approx(970, abs=0.5)


def test_without_a_stator_it_is_kloss_s_motor_and_its_line_current():
    circuit = EquivalentCircuit(
        voltage=400.0,
        synchronous_speed=50 * math.pi,
        stator_resistance=0.0,
        stator_reactance=0.0,
        rotor_resistance=0.5,
        rotor_reactance=3.0,
        magnetizing_reactance=40.0,
    )
    slip = 0.03
    rated = complex(circuit.current(slip))
    speed = circuit.synchronous_speed * (1 - slip)
    torque = float(circuit.torque(slip))
    plate = Plate(voltage=400.0, current=abs(rated), power_factor=rated.real / abs(rated))
    data = {"power": torque * speed, "speed": speed, "poles": 4, "frequency": 50.0}
    ratio = circuit.breakdown_torque / torque
    motor = Induction(**data, breakdown_ratio=ratio, plate=plate._replace(power_factor=plate.power_factor, voltage=None))
    slips = np.array([-0.2, 0.01, 0.03, 0.1, 0.5, 1.0])
    speeds = circuit.synchronous_speed * (1 - slips)
    np.testing.assert_allclose(motor.torque(speeds), circuit.torque(slips), rtol=1e-11)
    np.testing.assert_allclose(motor.current(speeds), np.abs(circuit.current(slips)), rtol=1e-11)


def test_values_out_of_range():
    with pytest.raises(SceneError, match="rotor_resistance"):
        EquivalentCircuit(
            voltage=400.0,
            synchronous_speed=157.0,
            stator_resistance=0.0,
            stator_reactance=0.0,
            rotor_resistance=0.0,
            rotor_reactance=3.0,
            magnetizing_reactance=40.0,
        )


# The line current of an induction motor by its name plate, against phasors, and plates that contradict themselves.


DATA = {"power": 7500.0, "speed": 1450 * RPM, "poles": 4, "frequency": 50.0, "breakdown_ratio": 2.5}
FULL = Plate(voltage=400.0, current=15.0, power_factor=0.83)


def motor(**plate):
    return Induction(**DATA, plate=FULL._replace(**plate))


def by_phasors(result: Induction, omega: float) -> complex:
    """The line current of a circuit U/(R/s + jX) that gives Kloss's torque, with magnetizing and loss branches beside it."""
    phase, sync = result.plate.voltage / math.sqrt(3), result.synchronous_speed
    reactance = 3 * phase**2 / (2 * sync * result.breakdown_torque)
    resistance = result.breakdown_slip * reactance

    def load(speed: float) -> complex:
        return phase / (resistance * sync / (sync - speed) + 1j * reactance)

    rated = result.plate.current * cmath.exp(-1j * math.acos(result.plate.power_factor))
    return load(omega) + rated - load(result.speed)


def test_the_current_is_that_of_the_circuit_through_the_rated_point():
    speeds = np.array([-40.0, 0.0, 100.0, 131.0, 140.0, 151.0, 1450 * RPM, 156.0, 160.0, 200.0])
    expected = [abs(by_phasors(motor(), omega)) for omega in speeds]
    np.testing.assert_allclose(motor().current(speeds), expected, rtol=1e-13)


def test_without_a_plate_the_current_goes_with_the_rotor_heat():
    bare = Induction(**DATA)
    speeds = np.array([0.0, 100.0, 140.0, 151.0, 156.0, 160.0])
    heat = bare.rotor_heat(speeds) / bare.rotor_heat(bare.speed)
    np.testing.assert_allclose(bare.current_share(speeds) ** 2, heat, rtol=1e-13)
    assert bare.rated_current is None
    assert bare.current(100.0) is None
    assert not bare.line_current.complete


@pytest.mark.parametrize(
    "plate",
    [
        {},
        {"no_load_current": 7.0},
        {"starting_current": 6.5, "starting_torque": 2.2},
        {"no_load_current": 7.0, "starting_current": 6.5, "starting_torque": 2.2},
    ],
)
def test_rated_point_no_load_and_locked_rotor_hold(plate):
    result = motor(**plate)
    assert result.current(result.speed) == pytest.approx(15.0, rel=1e-14)
    assert result.torque(result.speed) == pytest.approx(result.rated.torque, rel=1e-14)
    assert result.breakdown.torque == pytest.approx(2.5 * result.rated.torque, rel=1e-13)
    if "no_load_current" in plate:
        assert result.current(result.synchronous_speed) == pytest.approx(7.0, rel=1e-14)
    if "starting_current" in plate:
        assert result.current(0.0) == pytest.approx(6.5 * 15.0, rel=1e-14)
        assert result.starting_torque == pytest.approx(2.2 * result.rated.torque, rel=1e-14)


def test_the_locked_rotor_leaves_the_running_branch_as_it_is():
    speeds = np.linspace(motor().breakdown.speed, 180.0, 50)
    started = motor(starting_current=6.5, starting_torque=2.2)
    np.testing.assert_array_equal(started.torque(speeds), motor().torque(speeds))
    np.testing.assert_array_equal(started.current(speeds), motor().current(speeds))
    near = started.breakdown.speed - 1e-6
    assert started.slope_at(near) == pytest.approx(float(motor().slope_at(near)), abs=1e-5)


def test_losses_add_up_at_the_rated_point():
    result = motor(efficiency=0.87)
    taken = math.sqrt(3) * 400.0 * 15.0 * 0.83  # current and power factor count
    assert result.input_power(result.speed, result.torque(result.speed)) == pytest.approx(taken, rel=1e-13)
    losses = result.stator_heat(result.speed) + result.rotor_heat(result.speed) + result.constant_losses
    assert losses == pytest.approx(taken - 7500.0, rel=1e-12)
    twice = result.synchronous_speed - 2 * (result.synchronous_speed - result.speed)
    assert result.stator_heat(twice) == pytest.approx(
        result.rated_stator_heat * (result.current(twice) / 15.0) ** 2, rel=1e-14
    )


def test_any_two_of_three_tell_the_third():
    by_current = motor()
    efficiency = by_current.line_current.efficiency
    by_efficiency = motor(power_factor=None, efficiency=efficiency)
    by_both = motor(current=None, efficiency=efficiency)
    for result in (by_efficiency, by_both):
        assert result.rated_current == pytest.approx(15.0, rel=1e-14)
        assert result.current(140.0) == pytest.approx(float(by_current.current(140.0)), rel=1e-12)


@pytest.mark.parametrize(
    ("plate", "path", "words"),
    [
        ({"efficiency": 0.7}, "efficiency", "6037.9 W"),
        ({"voltage": 230.0, "efficiency": 0.87}, "efficiency", "between lines"),
        ({"power_factor": 0.99, "efficiency": 0.95, "current": None}, "power_factor", "0.98 at most"),
        ({"current": 11.0}, "current", "1.186"),
        ({"current": 11.0, "power_factor": None, "efficiency": 0.87}, "current", "8620.7 W drawn of 7621 V A"),
        ({"current": None, "power_factor": None, "efficiency": 0.97}, "efficiency", "below 0.9667"),
        ({"no_load_current": 1.0}, "no_load_current", "the current of the losses"),
        ({"no_load_current": 16.0, "voltage": None, "power_factor": None}, "no_load_current", "below the rated current"),
        ({"no_load_current": 3.0, "current": None}, "no_load_current", "a current with it"),
        ({"starting_torque": 2.6}, "starting_torque", "breakdown_ratio of 2.5"),
        ({"starting_current": 1.0}, "starting_current", "more than 1"),
        ({"power_factor": 1.1}, "power_factor", "share of 1"),
    ],
)
def test_plates_that_contradict_themselves(plate, path, words):
    with pytest.raises(SceneError) as caught:
        motor(**plate)
    (fault,) = caught.value.faults
    assert fault.path == path
    assert words in str(fault)


# Synchronous motors: load angle and pull-out, damper winding, swings; motions against equations written by hand.


SYNCHRONOUS = {
    "type": "synchronous",
    "power": 150e3,
    "poles": 20,
    "frequency": 50.0,
    "pull_out_ratio": 2.0,
    "asynchronous_slip": 0.04,
    "saliency": 0.2,
    "inertia": 20.0,
}
PAIRS, FIELD = 10, 2 * math.pi * 5.0
RATED = 150e3 / FIELD
SYNCHRONIZING = 2.0 * RATED / pull_out(0.2)[1]
DAMPING = RATED / (0.04 * FIELD)


def scene(inertia=300.0, mean=3000.0, rtol=1e-9, **motor):
    load = [{"on": "crank", "torque": f"-{mean} - 2500*sin(phi) - 1200*sin(2*phi + 0.5)"}]
    wheel = {"inertia": inertia}
    return flywheel.load(
        {"drive": {"motor": SYNCHRONOUS | motor}, "load": load, "flywheel": wheel, "accuracy": {"rtol": rtol}}
    )


def by_hand(inertia, phi, y):
    """d(omega, d, t, integral of d over t)/dphi."""
    omega, d = y[:2]
    slip = FIELD - omega
    torque = SYNCHRONIZING * (np.sin(d) + 0.2 * np.sin(2 * d)) + DAMPING * slip
    load = -3000.0 - 2500.0 * np.sin(phi) - 1200.0 * np.sin(2 * phi + 0.5)
    return [(torque + load) / (inertia + 20.0) / omega, PAIRS * slip / omega, 1 / omega, d / omega]


def cycle_by_hand(inertia, start, points=None):
    result = solve_ivp(
        lambda phi, y: by_hand(inertia, phi, y),
        (0.0, 2 * math.pi),
        [*start, 0.0, 0.0],
        method="DOP853",
        rtol=1e-12,
        atol=1e-12,
        t_eval=points,
    )
    return result.y


@pytest.mark.parametrize("inertia", [pytest.param(80.0, marks=pytest.mark.slow), 2000.0])
def test_the_regime_is_that_of_shooting(inertia):
    start = root(lambda y: cycle_by_hand(inertia, y)[:2, -1] - y, [FIELD, 0.3], tol=1e-13).x
    phi = np.linspace(0.0, 2 * math.pi, 1201)
    omega, angle, t, product = cycle_by_hand(inertia, start, phi)
    sizing = flywheel.size(scene(inertia))
    near = np.clip(np.array([omega.argmax(), omega.argmin()]), 1, 1199)
    tops = [
        np.polyval(p := np.polyfit(phi[k - 1 : k + 2] - phi[k], omega[k - 1 : k + 2], 2), -p[1] / (2 * p[0])) for k in near
    ]
    assert sizing.run.speed_max == pytest.approx(tops[0], rel=1e-8)
    assert sizing.run.speed_min == pytest.approx(tops[1], rel=1e-8)
    assert sizing.simulation.period == pytest.approx(0.2, rel=1e-12)
    assert sizing.simulation.speed_time_mean == pytest.approx(FIELD, rel=1e-12)
    assert sizing.error.simulation < 1e-9
    result = sizing.synchronism
    assert result.load_angle == pytest.approx(product[-1] / t[-1], abs=1e-9)
    assert result.load_angle_greatest == pytest.approx(angle.max(), abs=1e-5)
    assert result.load_angle_least == pytest.approx(angle.min(), abs=1e-5)
    assert sizing.run.states[0] == pytest.approx(start[1], abs=1e-9)
    flow = sizing.power_flow
    assert abs(flow.left) <= 1e-9 * flow.input


@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-11])
def test_errors_hold_at_every_tolerance(rtol):
    best, result = (flywheel.size(scene(150.0, rtol=one)) for one in (1e-12, rtol))
    for name in ("irregularity", "period", "speed_max"):
        true = getattr(best.simulation, name)
        assert abs(getattr(result.simulation, name) / true - 1) <= result.error.simulation + best.error.simulation


def test_small_swings_have_the_frequency_of_the_formula():
    """Kundur, section 12.3: omega_n² = p (dT/dd)/J, zeta = c/(2 J omega_n)."""
    motor = Synchronous(power=150e3, poles=20, frequency=50.0, pull_out_ratio=2.0, saliency=0.2, damping=50.0)
    angle, inertia = motor.load_angle(3000.0), 320.0
    natural = motor.swing_frequency(angle, inertia)
    matrix = np.array([[-50.0 / inertia, float(motor.stiffness(angle)) / inertia], [-PAIRS, 0.0]])
    value = np.linalg.eigvals(matrix)[0]
    assert abs(value) == pytest.approx(natural, rel=1e-12)
    assert -value.real / abs(value) == pytest.approx(50.0 / (2 * inertia * natural), rel=1e-12)


def test_harmonics_are_those_of_the_load_within_their_error():
    """Of a load over half a turn the odd ones, 2 M/(k pi), which its cells are too wide for at first."""
    sines = flywheel.size(scene(), simulate=False).synchronism
    load = [{"on": "crank", "torque": "-3000 - 2500*(phi < pi)"}]
    wheel = {"inertia": 300.0}
    half = flywheel.size(flywheel.load({"drive": {"motor": SYNCHRONOUS}, "load": load, "flywheel": wheel}), simulate=False)
    square = [2 * 2500.0 / (k * math.pi) * (k % 2) for k in range(1, 13)]
    for result, moments in ((sines, [2500.0, 1200.0, *[0.0] * 10]), (half.synchronism, square)):
        off = max(abs(one.moment - true) for one, true in zip(result.harmonics, moments, strict=True)) / max(moments)
        assert off <= result.errors["harmonics"] < 1e-9
        assert result.errors["magnification"] < 1e-9


def test_a_heavier_flywheel_towards_resonance_is_named():
    light = flywheel.size(scene(5.0, asynchronous_slip=0.3), simulate=False).synchronism
    assert light.heavier_is_nearer.order in (1, 2)
    heavy = flywheel.size(scene(3000.0, asynchronous_slip=0.3), simulate=False).synchronism
    assert heavy.heavier_is_nearer is None
    assert heavy.near_resonance is None


def test_steady_and_in_time_agree():
    result = transient(scene(), start="regime", end=1.0)
    sizing = flywheel.size(scene())
    assert result.motion.omega[-1] == pytest.approx(result.motion.omega[0], rel=1e-7)
    assert result.turns == pytest.approx(5.0, rel=1e-8)
    assert result.motion.states["load_angle"][-1] == pytest.approx(sizing.run.states[0], abs=1e-7)


@pytest.mark.slow
def test_a_field_that_is_switched_pulls_the_rotor_in():
    motor = {"asynchronous_ratio": 1.5, "asynchronous_slip": 0.02, "field_at": 30.5, "field_time": 0.2}
    load = [{"on": "crank", "torque": "-1000*omega/31.4"}]
    table = {"drive": {"motor": SYNCHRONOUS | motor}, "load": load, "flywheel": {"inertia": 100.0}}
    result = transient(flywheel.load(table), end=8.0, rtol=1e-7)
    angle, field = (result.motion.states[name] for name in ("load_angle", "field"))
    assert field[0] == 0.0
    assert field[-1] == pytest.approx(1.0, abs=1e-6)
    assert result.omega == pytest.approx(FIELD, rel=1e-5)
    assert math.sin(angle[-1]) > 0.0


@pytest.mark.slow
def test_the_bond_graph_swings_alike():
    table = {
        "drive": {"motor": SYNCHRONOUS},
        "load": [{"on": "crank", "torque": "-3000 - 2000*sin(phi)"}],
        "flywheel": {"inertia": 300.0},
    }
    stiff = table | {
        "shafts": {"motor": {"ratio": 1.0, "stiffness": 1e9, "damping": 1e5}},
        "drive": {"on": "motor", "motor": SYNCHRONOUS},
    }
    states = {"load_angle": 0.3}
    rigid, twisted = (
        flywheel.simulate(flywheel.load(one), 0.0, FIELD, 0.05, states=states, rtol=1e-6) for one in (table, stiff)
    )
    assert twisted.states["load_angle"][0] == pytest.approx(0.3)
    assert twisted.omega[-1] == pytest.approx(rigid.omega[-1], rel=1e-4)
    assert twisted.states["load_angle"][-1] == pytest.approx(rigid.states["load_angle"][-1], abs=1e-3)


@pytest.mark.parametrize(
    ("table", "match"),
    [
        ({"mean": 9900.0}, "above the pull-out torque of 9549.3"),
        ({"load_angle": 0.7, "saliency": None}, "load_angle"),
        ({"damping": 100.0}, "damping and asynchronous_slip"),
        ({"field_at": 31.4, "field_time": 0.1}, "field_at"),
        ({"saliency": 3.0}, "saliency"),
    ],
)
def test_what_cannot_be_is_refused(table, match):
    inputs = {key: value for key, value in (SYNCHRONOUS | table).items() if value is not None and key != "mean"}
    load = [{"on": "crank", "torque": -table.get("mean", 3000.0)}]
    with pytest.raises(SceneError, match=match):
        flywheel.size(flywheel.load({"drive": {"motor": inputs}, "load": load, "flywheel": {"inertia": 300.0}}))


def test_no_balance_stands_beside_it():
    table = {
        "parameters": {"a": "balance"},
        "drive": {"motor": SYNCHRONOUS},
        "load": [{"on": "crank", "torque": "-a*(1 + sin(phi))"}],
        "regime": {"speed": FIELD},
        "flywheel": {"inertia": 300.0},
    }
    with pytest.raises(SceneError, match="keeps its speed whatever the load"):
        flywheel.size(flywheel.load(table))


def test_a_load_angle_that_is_not_finite_has_no_torque():
    """A step in time that is tried too far ended in a traceback, "math domain error"."""
    motor = Synchronous(power=150e3, poles=20, frequency=50.0, pull_out_ratio=2.0, damping=50.0)
    assert all(math.isnan(motor.circuit.torque(30.0, (angle,))) for angle in (math.inf, -math.inf, math.nan))


# Induction motors with fluxes as states: against Krause's equations written by hand, and against the static circuit.


# Krause, Wasynczuk and Sudhoff, Analysis of Electric Machinery and Drive Systems, 2nd ed., table 4.10-1: 3 hp, 220 V
KRAUSE = {
    "type": "induction",
    "power": 2238.0,
    "speed": "1710 rpm",
    "poles": 4,
    "frequency": 60.0,
    "breakdown_ratio": 4.95,
    "electrical": "two-axis",
    "voltage": 220.0,
    "stator_resistance": 0.435,
    "stator_reactance": 0.754,
    "magnetizing_reactance": 26.13,
    "rotor_resistance": 0.816,
    "rotor_reactance": 0.754,
    "inertia": 0.089,
}
MAINS = 2 * math.pi * 60.0
SHARED = np.array([[26.884, 0, 26.13, 0], [0, 26.884, 0, 26.13], [26.13, 0, 26.884, 0], [0, 26.13, 0, 26.884]]) / MAINS
TO_CURRENTS = np.linalg.inv(SHARED)


def two_axis_by_hand(y, load, inertia):
    """d(l_qs, l_ds, l_qr, l_dr, omega)/dt; and the torque."""
    qs, ds, qr, dr, omega = y
    iqs, ids, iqr, idr = TO_CURRENTS @ y[:4]
    slip = MAINS - 2 * omega
    torque = 1.5 * 2 * (ds * iqs - qs * ids)
    fluxes = [
        220 * math.sqrt(2 / 3) - 0.435 * iqs - MAINS * ds,
        -0.435 * ids + MAINS * qs,
        -0.816 * iqr - slip * dr,
        -0.816 * idr + slip * qr,
    ]
    return np.array([*fluxes, (torque + load) / inertia]), torque


def two_axis_scene(load=None, inertia=0.0, **motor):
    loads = [] if load is None else [{"on": "crank", "torque": load}]
    return flywheel.load({"drive": {"motor": KRAUSE | motor}, "load": loads, "flywheel": {"inertia": inertia}})


def test_free_acceleration_is_that_of_krause():
    """Section 4.10: the shaft's torque swings with the mains at first, up to eleven times the base torque of 11.9 N m."""
    result = transient(two_axis_scene(), end=0.05, rtol=1e-8)
    times = np.linspace(0.0, 0.05, 2001)
    true = solve_ivp(
        lambda t, y: two_axis_by_hand(y, 0.0, 0.089)[0], (0.0, 0.05), np.zeros(5), "DOP853", times, rtol=1e-11, atol=1e-12
    ).y
    assert result.omega == pytest.approx(true[4, -1], rel=1e-8)
    assert [state[-1] for state in result.motion.states.values()] == pytest.approx(true[:4, -1].tolist(), abs=1e-8)
    torques = np.array([two_axis_by_hand(y, 0.0, 0.089)[1] for y in true.T])
    assert result.peaks.torque.value == pytest.approx(torques.max(), rel=1e-3)
    assert result.peaks.torque.value > 11 * 11.9
    heat = np.array([1.5 * 0.816 * ((TO_CURRENTS @ y[:4])[2:] ** 2).sum() for y in true.T])
    assert result.energy.rotor_heat == pytest.approx(np.trapezoid(heat, times), rel=1e-4)


def test_states_that_stand_still_give_the_static_curve():
    motor = two_axis_scene().motor
    speeds = np.array([0.0, 50.0, 120.0, motor.speed, 188.0, 200.0])
    states = motor.circuit.steady(speeds)
    assert motor.circuit.torque(speeds, states) == pytest.approx(motor.torque(speeds), rel=1e-12)
    assert np.abs(motor.circuit.rates(speeds, states)).max() < 1e-11
    assert motor.circuit.rotor_heat(states) == pytest.approx(motor.rotor_heat(speeds), rel=1e-11)
    start, t = np.array([0.1, 0.05, -0.02, 0.03]), 0.03
    true = solve_ivp(lambda t, y: motor.circuit.rates(0.0, y), (0.0, t), start, rtol=1e-11, atol=1e-13).y[:, -1]
    assert motor.circuit.standing(start, t) == pytest.approx(true, abs=1e-9)


def test_slopes_are_those_of_torque_and_rates():
    circuit, omega, states = two_axis_scene().motor.circuit, 150.0, np.array([0.1, 0.4, 0.05, 0.3])
    slopes, step = circuit.slopes(omega, states), 1e-6
    for k in range(4):
        more, less = (states + sign * step * np.eye(4)[k] for sign in (1, -1))
        assert slopes.torque_by_states[k] == pytest.approx(
            (circuit.torque(omega, more) - circuit.torque(omega, less)) / (2 * step)
        )
        result = (np.array(circuit.rates(omega, more)) - circuit.rates(omega, less)) / (2 * step)
        assert [row[k] for row in slopes.rates_by_states] == pytest.approx(result.tolist(), abs=1e-6)
    result = (np.array(circuit.rates(omega + 0.1, states)) - circuit.rates(omega - 0.1, states)) / 0.2
    assert slopes.rates_by_speed == pytest.approx(result.tolist(), abs=1e-9)


@pytest.mark.slow
def test_the_two_axis_regime_is_that_of_shooting():
    def cycle(start, points=None):
        def rates(phi, y):
            result, _ = two_axis_by_hand(y[:5], -8.0 - 6.0 * math.sin(phi), 0.389)
            return [*(result / y[4]), 1.0 / y[4]]

        return solve_ivp(rates, (0.0, 2 * math.pi), [*start, 0.0], "DOP853", points, rtol=1e-11, atol=1e-12).y

    sizing = flywheel.size(two_axis_scene("-8 - 6*sin(phi)", 0.3))
    first = np.array([*sizing.run.states, sizing.run.speed_min])
    start = root(lambda y: cycle(y)[:5, -1] - y, first, tol=1e-11).x
    assert list(sizing.run.states) == pytest.approx(start[:4].tolist(), abs=1e-8)
    y = cycle(start, np.linspace(0.0, 2 * math.pi, 2001))
    assert sizing.run.speed_max == pytest.approx(y[4].max(), rel=1e-7)
    assert sizing.run.speed_min == pytest.approx(y[4].min(), rel=1e-7)
    assert sizing.simulation.period == pytest.approx(y[5, -1], rel=1e-9)
    heat = np.array([1.5 * 0.816 * ((TO_CURRENTS @ one[:4])[2:] ** 2).sum() for one in y.T])
    assert sizing.energy.rotor_heat == pytest.approx(np.trapezoid(heat, y[5]) / y[5, -1], rel=1e-6)
    flow = sizing.power_flow
    assert abs(flow.left) <= 1e-9 * flow.input


@pytest.mark.slow
def test_whether_the_fluxes_matter_is_measured():
    beside = flywheel.size(two_axis_scene("-8 - 6*sin(phi)", 0.0), simulate=False).electrical_transients
    assert beside.irregularity.difference == pytest.approx(0.063, abs=0.002)
    assert beside.matters
    rough = flywheel.size(two_axis_scene("-8 - 6*sin(phi)", 0.0), 1e-4, simulate=False).electrical_transients
    for one, better in zip(rough, beside, strict=True):
        assert abs(one.two_axis / better.two_axis - 1) <= one.error + better.error < 1e-3
        assert abs(one.static / better.static - 1) <= one.error + better.error
    static = flywheel.size(two_axis_scene("-8 - 6*sin(phi)", 0.0, electrical="static"), simulate=False)
    assert static.electrical_transients is None


def test_no_shaft_twists_beside_it():
    table = {
        "shafts": {"motor": {"ratio": 1.0, "stiffness": 1e4}},
        "drive": {"on": "motor", "motor": KRAUSE},
        "inertia": [{"on": "crank", "value": 0.3}],
        "flywheel": {"inertia": 0.1},
    }
    with pytest.raises(SceneError, match="shaft that twists"):
        flywheel.simulate(flywheel.load(table), 0.0, 180.0, 0.01)


def test_a_name_plate_has_a_circuit():
    plate = Plate(voltage=400.0, current=15.0, power_factor=0.83)
    inputs = {"power": 7500.0, "speed": 1450 * math.pi / 30, "poles": 4, "frequency": 50.0, "breakdown_ratio": 2.5}
    motor = Induction(**inputs, plate=plate)
    result = TwoAxisInduction(**inputs, plate=plate, voltage=400.0, impedances=impedances_of(motor))
    assert float(result.torque(motor.speed)) == pytest.approx(motor.rated.torque, rel=1e-9)
    assert result.breakdown_torque == pytest.approx(motor.breakdown_torque, rel=1e-9)
    circuit = result.circuit
    assert circuit.current(motor.speed, circuit.steady(motor.speed)) == pytest.approx(15.0, rel=1e-9)


@pytest.mark.parametrize(
    ("motor", "match"),
    [
        ({"rotor_resistance": None}, "without rotor_resistance"),
        ({"rotor_resistance": 1.6}, "rotor_resistance.* of the circuit at rated speed"),
        ({"breakdown_ratio": 2.5}, "breakdown_ratio.*about 4.95"),
        (dict.fromkeys(Impedances._fields), "electrical.*name plate without"),
        ({"start": {"type": "soft", "ramp": 2.0}}, "states of its own|start"),
    ],
)
def test_what_a_two_axis_motor_cannot_be_is_refused(motor, match):
    inputs = {key: value for key, value in (KRAUSE | motor).items() if value is not None}
    with pytest.raises(SceneError, match=match):
        flywheel.load({"drive": {"motor": inputs}, "flywheel": {"inertia": 1.0}})


def test_the_current_at_a_constant_speed_is_that_of_the_circuit():
    """Phasors of a phase; the rated current of the plate at rated speed."""
    plate = Plate(voltage=400.0, current=15.0, power_factor=0.83, starting_current=6.5, no_load_current=7.0)
    data = {"power": 7500.0, "speed": 1450 * math.pi / 30, "poles": 4, "frequency": 50.0, "breakdown_ratio": 2.5}
    for text in (plate, Plate()):
        z = impedances_of(Induction(**data, plate=plate))
        motor = TwoAxisInduction(**data, plate=text, voltage=400.0, impedances=z)
        for speed in (0.0, 80.0, 150.0, motor.speed, 160.0, 200.0):
            branch = z.rotor_resistance / (1 - speed / motor.synchronous_speed) + 1j * z.rotor_reactance
            shunt = 1j * z.magnetizing_reactance
            whole = complex(z.stator_resistance, z.stator_reactance) + shunt * branch / (shunt + branch)
            assert motor.current(speed) == pytest.approx(400 / math.sqrt(3) / abs(whole), rel=1e-12)
        assert motor.rated_current == pytest.approx(15.0, rel=1e-9)
        assert motor.current_share(motor.speed) == pytest.approx(1.0, rel=1e-9)
