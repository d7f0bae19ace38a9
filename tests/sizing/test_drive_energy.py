"""Power and energy of whole machines: against closed forms, and against points of the motion itself."""

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq, root

import flywheel
from flywheel.motions.transients import speed_at
from flywheel.regime import turning_moment
from tests import regimes, scenes
from tests.limits import sample


def sized(scene):
    return flywheel.size(flywheel.load(scene), simulate=False)


def test_the_course_s_exam_of_march_2010():
    """x = -3 R cos phi1, 750 N over half a turn; 71.6197 N m at 210 rpm: exactly 1575 W, 678.2297 kcal of 4.18 kJ."""
    law = {"type": "law", "outputs": {"saw": {"x": "-0.3*cos(phi)"}}}
    load = [{"on": "saw", "force": "-750 N", "from": 0, "to": "180 deg"}]
    scene = scenes.rotor(mechanism=law, load=load, regime={"speed": "210 rpm"}, flywheel={"irregularity": 0.05})
    energy = sized(scene).energy
    assert energy.work == pytest.approx(450, rel=1e-12)
    assert energy.mean_power_alone == pytest.approx(1575, rel=1e-12)
    assert energy.mean_power_alone * 1800 / 4180 == pytest.approx(678.2297, abs=5e-5)
    assert energy.peak_power_alone == pytest.approx(750 * 0.3 * 7 * np.pi, rel=1e-12)  # at mid-stroke
    assert energy.peak_power == pytest.approx(450 / (2 * np.pi) * 7 * np.pi * 1.025, rel=1e-12)  # at the greatest speed


@pytest.mark.parametrize(
    "name", sample(["section-c", "kloss-press", "pump", "geared-loss-line", "dc-inductance", "governor"], 2)
)
def test_the_drive_works_along_the_motion(name):
    case = regimes.CASES[name]
    result = sized(regimes.scene(name, inertia=case.inertias[-1]))
    true = regimes.figures(name)["analysis"][repr(case.inertias[-1])]
    energy = result.energy
    assert energy.period == pytest.approx(float(true["period"]), rel=1e-9)
    if "drive_work" in true:
        assert energy.work == pytest.approx(float(true["drive_work"]), rel=1e-9, abs=1e-9)
        assert result.power == pytest.approx(float(true["power"]), rel=1e-9, abs=1e-9)
    assert energy.mean_power == pytest.approx(energy.work / energy.period)


def test_a_motor_that_follows_the_loads_gives_what_they_take_at_a_constant_speed():
    """Without a flywheel: the loads' moment along the motion, at the mean of extremes; a line motor's own mean here."""
    result = sized(regimes.scene("peaks", inertia=5))
    energy = result.energy
    assert energy.peak_power_alone == pytest.approx(100 * result.speed, rel=1e-9)
    assert energy.mean_power_alone == pytest.approx(100 / 8 * result.speed, rel=1e-9)
    assert energy.peak_to_mean_alone == pytest.approx(8, rel=1e-9)
    assert energy.peak_to_mean < 2


def test_without_a_drive_there_is_no_power():
    scene = scenes.rotor(load=[{"on": "crank", "torque": "30*sin(phi)"}])
    del scene["drive"]
    assert sized(scene).energy is None
    assert sized(scene).as_dict()["energy"] is None


def test_negative_peaks_count_by_their_size():
    scene = scenes.rotor(load=[{"on": "crank", "torque": "100*sin(phi)"}], drive={"torque": "-100*sin(phi)"})
    scene["flywheel"] = {"inertia": 1e6}
    energy = sized(scene).energy
    assert abs(energy.peak_power) == pytest.approx(100 * 10 * np.pi, rel=1e-4)
    assert energy.mean_power == pytest.approx(0, abs=1e-6)
    assert energy.peak_to_mean is None or abs(energy.peak_to_mean) > 1e6


def test_the_figures_agree_with_quadrature():
    result = sized(regimes.scene("section-c", inertia=0))
    speed = lambda phi: float(turning_moment.speed_over_cycle(result.cycle, result.speed, result.run, np.array([phi]))[0])  # noqa: E731
    period = quad(lambda phi: 1 / speed(phi), 0, 2 * np.pi, epsabs=1e-10)[0]
    work = quad(lambda phi: 10 - 2.387 * speed(phi), 0, 2 * np.pi, epsabs=1e-10)[0]
    square = quad(lambda phi: (10 - 2.387 * speed(phi)) ** 2 / speed(phi), 0, 2 * np.pi, epsabs=1e-10)[0]
    assert (result.energy.period, result.energy.work) == pytest.approx((period, work), rel=1e-8, abs=1e-8)
    assert result.energy.rms_torque == pytest.approx(np.sqrt(square / period), rel=1e-8)


def test_the_rms_torque_of_a_constant_drive_is_that_torque_on_its_own_shaft():
    scene = scenes.rotor(shafts={"motor": {"ratio": 5}})
    scene["drive"] = {"on": "motor", "torque": "balance"}
    result = sized(scene)
    assert result.energy.rms_torque == pytest.approx(result.balance.value, rel=1e-13)


def test_rounding_is_no_power():
    energy = sized(scenes.rotor(load=[{"on": "crank", "torque": "-100*sin(17*phi)"}])).energy
    assert (energy.mean_power, energy.peak_power, energy.rms_torque) == (0.0, 0.0, 0.0)
    assert energy.peak_power_alone == pytest.approx(1000 * np.pi)


# -- what heats the motor ------------------------------------------------------------------------------------------------

SOFT = {"type": "induction", "power": "1.1 kW", "speed": "1320 rpm", "poles": 4, "frequency": "50 Hz", "inertia": 0.02}
SOFT["breakdown_ratio"] = 2.2
PLATE = {"type": "dc", "voltage": 220, "power": "1.5 kW", "speed": "1000 rpm", "efficiency": 0.8, "inertia": 0.01}
WOUND = {"type": "dc", "voltage": 220, "resistance": 3.0, "constant": 1.9, "friction": 0.01, "inductance": 0.3}
HEATED = {
    "induction": SOFT,
    "dc from its plate": PLATE,
    "dc with inductance": WOUND,
}
LOADS = {"working": (-65.0, -5.0), "driven for half of it": (-75.0, 55.0)}
RATIO, CRANK, WHEEL, HALF = 5.0, 0.4, 0.05, np.pi


def heated(motor, load, efficiency):
    """A motor on its own shaft, geared to a crank whose load takes one value over half a turn and another over the rest."""
    parts = [{"on": "crank", "torque": torque, "from": k * HALF, "to": (k + 1) * HALF} for k, torque in enumerate(load)]
    return scenes.rotor(
        shafts={"motor": {"ratio": RATIO, "efficiency": efficiency}},
        inertia=[{"on": "crank", "value": CRANK}],
        load=parts,
        drive={"on": "motor", "motor": motor},
        regime={},
        flywheel={"on": "motor", "inertia": WHEEL},
    )


def by_hand(motor, load, efficiency):
    """Period, mean and greatest of what heats the motor: its equations in time, stepped from half turn to half turn."""
    rotor = WHEEL + motor.inertia
    inductive = getattr(motor, "inductance", 0.0) > 0.0

    def torque(speed, current):
        return motor.constant * current - motor.friction * speed if inductive else float(motor.torque(speed))

    def rates(t, state, moment):
        speed = RATIO * state[1]
        driving = torque(speed, state[2])
        alpha = (moment + RATIO * driving) / (CRANK + RATIO**2 * rotor)
        if efficiency < 1.0:
            passed = CRANK * alpha - moment  # to the crank
            k = efficiency if passed > 0.0 else 1.0 / efficiency
            alpha = (moment + k * RATIO * driving) / (CRANK + k * RATIO**2 * rotor)
        if hasattr(motor, "synchronous_speed"):
            value = driving * (motor.synchronous_speed - speed)
        else:
            current = state[2] if inductive else (motor.voltage - motor.constant * speed) / motor.resistance
            value = motor.resistance * current**2
        rate = float(motor.current_rate(speed, state[2])) if inductive else 0.0
        return [state[1], alpha, rate, value]

    def turned(start):
        state, time, currents = [0.0, *start, 0.0], 0.0, []
        for k, moment in enumerate(load):
            end = lambda t, y, moment, k=k: y[0] - (k + 1) * HALF  # noqa: E731
            end.terminal = True
            run = solve_ivp(
                rates, (0, 10), state, "DOP853", args=(moment,), events=end, rtol=1e-11, atol=1e-11, dense_output=True
            )
            state, time = run.y_events[0][0], time + run.t_events[0][0]
            dense = run.sol(np.linspace(0, run.t_events[0][0], 2001))
            currents.append(dense[2] if inductive else dense[1] * RATIO)
        return state, time, np.concatenate(currents)

    def returned(start):
        return np.array(turned(start)[0][1:3]) - start

    if inductive:
        start = root(returned, [20.0, 3.0], tol=1e-13).x
    else:
        start = [brentq(lambda w: returned([w, 0.0])[0], 10, 40, xtol=1e-13), 0.0]
    state, time, currents = turned(np.array(start))
    if not inductive and hasattr(motor, "voltage"):
        currents = (motor.voltage - motor.constant * currents) / motor.resistance
    return time, state[3] / time, currents


@pytest.mark.parametrize("load", sample(LOADS, 5))
@pytest.mark.parametrize(("name", "efficiency"), list(zip(HEATED, (1.0, 0.9, 0.9), strict=True)))
def test_what_heats_a_motor_is_that_of_its_equations_in_time(name, load, efficiency):
    """Rotor heat T (omega_s - omega), copper heat R i², on the mean over time; while it generates, too."""
    result = sized(heated(HEATED[name], LOADS[load], efficiency))
    motor, energy, error = result.scene.motor, result.energy, result.as_dict()["error"]
    period, heat, currents = by_hand(motor, LOADS[load], efficiency)
    assert energy.period == pytest.approx(period, rel=1e-9)
    assert (result.run.drive.min() < 0.0) == (load != "working")
    if "induction" in name:
        rated = motor.rated.torque * (motor.synchronous_speed - motor.speed)
        assert energy.rotor_heat == pytest.approx(heat, rel=1e-8)
        assert energy.rotor_heat_share == pytest.approx(heat / rated, rel=1e-8)
        told = {"rotor_heat", "rotor_heat_share"}
    else:
        peak = currents[np.abs(currents).argmax()]
        assert energy.copper_heat == pytest.approx(heat, rel=1e-8)
        assert energy.current_rms == pytest.approx(np.sqrt(heat / motor.resistance), rel=1e-8)
        assert energy.current_peak == pytest.approx(peak, rel=1e-6)
        assert abs(energy.current_peak) >= abs(peak) * (1 - 1e-9)
        told = {"copper_heat", "current_rms", "current_peak"} | ({"copper_heat_share"} if "plate" in name else set())
        if "plate" in name:
            current = 1500 / (0.8 * 220)
            assert energy.copper_heat_share == pytest.approx(heat / (motor.resistance * current**2), rel=1e-8)
    every = {"rotor_heat", "rotor_heat_share", "copper_heat", "copper_heat_share", "current_rms", "current_peak"}
    assert {key for key in every if result.as_dict()["energy"][key] is not None} == told
    assert {key for key in every if error[key] is not None} == told
    assert all(0.0 < error[key] < 1e-8 for key in told)


def test_the_heat_of_a_constant_load_is_that_of_its_speed():
    """At the rated point the rotor has its rated heat, whatever the mesh between: share 1, and no more."""
    load = [{"on": "crank", "torque": -5 * 1100 / (1320 * np.pi / 30)}]
    scene = heated(SOFT, (0, 0), 1.0) | {"load": load}
    energy = sized(scene).energy
    assert energy.rotor_heat_share == pytest.approx(1.0, rel=1e-9)
    assert energy.rotor_heat == pytest.approx(1100 * 180 / 1320, rel=1e-9)  # the slip's share of what the field gives


def test_errors_of_heats_cover_what_a_coarse_motion_misses():
    scene = flywheel.load(heated(PLATE, LOADS["working"], 0.9))
    fine, coarse = (flywheel.size(scene, rtol=rtol, simulate=False).energy for rtol in (1e-11, 1e-2))
    for key, error in coarse.errors.items():
        true = getattr(fine, key)
        assert abs(getattr(coarse, key) - true) <= (error + fine.errors[key]) * abs(true)


def test_heat_of_a_stator_is_the_integral_of_the_line_current():
    plate = {"voltage": 400.0, "current": 15.0, "power_factor": 0.83, "no_load_current": 7.0}
    motor = {"type": "induction", "power": 7500.0, "speed": 151.8, "poles": 4, "frequency": 50.0, "breakdown_ratio": 2.5}
    load = {"on": "crank", "torque": -150.0, "from": 0, "to": 2.0}
    found = flywheel.size(
        flywheel.load({"load": [load], "drive": {"motor": motor | plate}, "flywheel": {"inertia": 0.8}}), simulate=False
    )
    points, weights = np.polynomial.legendre.leggauss(40)
    edges = np.array([0.0, 2.0, 4.0, 2 * np.pi])
    half = 0.5 * np.diff(edges)[:, None]
    omega = speed_at(found, (edges[:-1, None] + half * (1 + points)).ravel())
    lasting = (half * weights).ravel() / omega
    share = found.scene.motor.current_share(omega)
    energy = found.energy
    assert energy.stator_heat_share == pytest.approx(lasting @ share**2 / lasting.sum(), rel=1e-10)
    assert energy.stator_heat == pytest.approx(energy.stator_heat_share * found.scene.motor.rated_stator_heat, rel=1e-14)
    assert energy.current_rms == pytest.approx(15.0 * energy.stator_heat_share**0.5, rel=1e-14)
    edge = found.scene.motor.current(speed_at(found, [0.0, 2.0]))
    assert energy.current_peak == pytest.approx(float(edge.max()), rel=1e-10)
    assert 0 < energy.errors["stator_heat_share"] < 1e-9
