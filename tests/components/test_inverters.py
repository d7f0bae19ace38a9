"""Motors on an inverter: torque, current, heat and power at any frequency, within a limit, with a weakened field."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import flywheel
from flywheel import SceneError
from flywheel.components.motors import Induction, Inverter, InverterInduction, Plate, Synchronous
from tests.limits import sample

RPM = math.pi / 30
PLATE = Plate(voltage=400.0, current=15.0, power_factor=0.83)
OWN = {"power": 7500.0, "speed": 1450 * RPM, "poles": 4, "frequency": 50.0, "breakdown_ratio": 2.5, "plate": PLATE}
MAINS = Induction(**OWN)
FIELD, REACH = MAINS.synchronous_speed, MAINS.breakdown_slip * MAINS.synchronous_speed


def fed(frequency: float, limit: float | None = None, weakening: float = 50.0, **more: float) -> InverterInduction:
    return InverterInduction(**OWN, inverter=Inverter(frequency, weakening, limit, **more))


def rotor_circuit(frequency: float, omega: float, weakening: float = 50.0) -> tuple[float, float, float]:
    """Torque, heat and power of the air gap by the circuit r/s + j x f/f_n behind a voltage U min(f, f_w)/f_n."""
    volts = 400.0 * min(frequency, weakening) / 50.0
    x = 400.0**2 / (2 * FIELD * MAINS.breakdown_torque)  # of the greatest torque U²/(2 omega_s x)
    r = MAINS.breakdown_slip * x
    field = FIELD * frequency / 50.0
    s = (field - omega) / field
    current = volts / complex(r / s, x * frequency / 50.0)
    gap = abs(current) ** 2 * r / s
    return gap / field, gap * s, gap


@pytest.mark.parametrize(("frequency", "weakening"), [(5.0, 50.0), (30.0, 50.0), (50.0, 50.0), (80.0, 50.0), (80.0, 87.0)])
def test_it_is_the_circuit_at_a_scaled_voltage_and_frequency(frequency, weakening):
    motor = fed(frequency, weakening=weakening)
    for omega in motor.field_speed + REACH * np.array([-0.9, -0.3, 0.2, 0.7]):
        torque, heat, gap = rotor_circuit(frequency, omega, weakening)
        assert float(motor.torque(omega)) == pytest.approx(torque, rel=1e-12)
        assert float(motor.rotor_heat(omega)) == pytest.approx(heat, rel=1e-12)
        stator, constant = float(motor.stator_heat(omega)), motor.constant_losses * float(motor.constant_share(omega))
        assert float(motor.input_power(omega, torque)) == pytest.approx(gap + stator + constant, rel=1e-12)


def test_on_the_frequency_of_its_mains_it_is_the_motor_of_the_mains():
    motor, speeds = fed(50.0), np.linspace(-20.0, 250.0, 300)
    for name in ("torque", "current_share", "rotor_heat", "stator_heat"):
        np.testing.assert_allclose(getattr(motor, name)(speeds), getattr(MAINS, name)(speeds), rtol=1e-12)
    assert (motor.rated, motor.stable) == (MAINS.rated, pytest.approx(MAINS.stable))


@pytest.mark.parametrize("frequency", [35.0, 50.0])
def test_the_slip_of_a_limited_torque_is_that_of_the_circuit_and_continuous(frequency):
    """Just below the corner of a weakened field the greatest slip speed is that of the set frequency, not breakdown's."""
    motor = fed(frequency, 1.5, 40.0)
    speeds = motor.field_speed - np.linspace(0.5, 1.5, 2001) * float(motor.corner)
    slips, torques = motor.slip_speed(speeds), motor.torque(speeds)
    for omega, slip, torque in zip(speeds[::40], slips[::40], torques[::40], strict=True):
        own = 50.0 * (omega + slip) / FIELD  # frequency at which it turns so
        assert rotor_circuit(own, omega, 40.0)[0] == pytest.approx(torque, rel=1e-9)
    assert np.abs(np.diff(slips)).max() < 2e-3 * motor.field_speed


def highest(motor: InverterInduction, omega: float) -> tuple[float, float]:
    """Frequency's field and torque at a speed: the highest field up to the set one with the limit and breakdown kept."""

    def torque(field: float) -> float:
        flux = min(1.0, motor.weakening_speed / field)
        return float(flux**2 * MAINS.torque(FIELD - (field - omega)))

    ends = [motor.field_speed, omega + REACH]
    if torque(min(ends)) > motor.torque_limit:
        ends.append(brentq(lambda field: torque(field) - motor.torque_limit, omega + 1e-9, min(ends), xtol=1e-13))
    return min(ends), torque(min(ends))


@pytest.mark.parametrize(("frequency", "limit"), [(20.0, 1.5), (50.0, 0.8), (70.0, 1.2), (90.0, 1.8), (100.0, 2.4)])
def test_a_limit_lowers_the_frequency_only_as_far_as_it_must(frequency, limit):
    motor = fed(frequency, limit)
    for omega in np.linspace(0.0, 0.999, 23) * motor.field_speed:
        field, torque = highest(motor, omega)
        assert float(motor.torque(omega)) == pytest.approx(torque, rel=1e-10)
        assert float(motor.slip_speed(omega)) == pytest.approx(field - omega, rel=1e-9)
        flux = min(1.0, motor.weakening_speed / field)
        assert float(motor.current_share(omega)) == pytest.approx(
            flux * MAINS.current_share(FIELD - field + omega), rel=1e-9
        )
    assert float(motor.torque(0.0)) == pytest.approx(limit * MAINS.rated.torque)


def test_braking_mirrors_driving_about_the_field_where_no_flux_is_lost():
    motor = fed(20.0, 1.5)
    slips = np.linspace(0.0, 40.0, 50)
    driving, braking = (motor.torque(motor.field_speed + way * slips) for way in (-1.0, 1.0))
    np.testing.assert_allclose(braking, -driving, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(motor.slip_speed(motor.field_speed + slips), -motor.slip_speed(motor.field_speed - slips))


def test_the_rated_point_with_a_weakened_field_has_the_rated_heat():
    motor = fed(75.0)
    assert float(motor.rotor_heat(motor.rated.speed)) == pytest.approx(float(MAINS.rotor_heat(MAINS.speed)), rel=1e-12)
    assert motor.rated.torque == pytest.approx(MAINS.rated.torque / 1.5, rel=0.04)  # about the same power
    assert float(motor.torque(motor.rated.speed)) == pytest.approx(motor.rated.torque, rel=1e-12)


def test_a_limit_below_the_rated_torque_leaves_the_rated_heat_that_of_the_plate():
    motor = fed(50.0, 0.6)
    assert motor.rated_total_heat == MAINS.rated_total_heat
    assert float(motor.heat_share(0.0)) < 0.6


@pytest.mark.parametrize(
    ("inverter", "path"),
    [
        (Inverter(0.0, 50.0), "inverter.frequency"),
        (Inverter(50.0, 50.0, torque_limit=2.5), "inverter.torque_limit"),
        (Inverter(180.0, 50.0), "inverter.frequency"),
        (Inverter(50.0, 50.0, braking="resistor"), "inverter.chopper_power"),
        (Inverter(50.0, 50.0, chopper_power=1e3), "inverter.chopper_power"),
        (Inverter(50.0, 50.0, braking="chopper"), "inverter.braking"),
    ],
)
def test_what_an_inverter_or_its_motor_cannot_do_is_refused(inverter, path):
    with pytest.raises(SceneError) as caught:
        InverterInduction(**OWN, inverter=inverter)
    assert [fault.path for fault in caught.value.faults] == [path]


MOTOR = """[drive.motor]
type = "induction"
power = "7.5 kW"
speed = "1450 rpm"
poles = 4
frequency = "50 Hz"
breakdown_ratio = 2.5
voltage = "400 V"
current = "15 A"
power_factor = 0.83
"""
SCENE = (
    """
[[load]]
on = "crank"
torque = "-60 N m"
from = 0
to = "120 deg"
"""
    + MOTOR
    + """inverter = {frequency = "70 Hz", torque_limit = 0.6}
[flywheel]
inertia = 0.05
"""
)


@pytest.mark.slow
def test_electric_power_is_shaft_and_losses_where_the_limit_acts():
    sizing = flywheel.size(flywheel.load(SCENE))
    motor, flow = sizing.scene.motor, sizing.power_flow
    assert isinstance(motor, InverterInduction)
    assert sizing.run.speed_min < motor.stable[0] < sizing.run.speed_max
    mean = {stream.kind: stream.mean for stream in flow.streams if stream.source in ("mains", "drive")}
    lost = sum(mean[kind] for kind in ("rotor", "stator", "iron"))
    assert mean["input"] == pytest.approx(mean["drive"] + lost, rel=1e-9)
    assert sizing.energy.rotor_heat == pytest.approx(mean["rotor"], rel=1e-9)
    phi = np.linspace(0.0, 2 * math.pi, 200_001)
    omega = flywheel.regime.turning_moment.speed_over_cycle(sizing.run.cycle, sizing.speed, sizing.run, phi[:-1])
    power = motor.input_power(omega, motor.torque(omega))
    assert np.sum(power / omega) / np.sum(1.0 / omega) == pytest.approx(mean["input"], rel=1e-4)


def test_a_scene_has_its_inverter_and_each_fault_its_place():
    motor = flywheel.load(SCENE).motor
    assert isinstance(motor, InverterInduction)
    assert motor.inverter == Inverter(70.0, 50.0, torque_limit=0.6)
    for written, path in (
        ('frequency = "70 Hz", overcurrent = 0', "drive.motor.inverter.overcurrent"),
        ("torque_limit = 1.5", "drive.motor.inverter.frequency"),
        ('frequency = "70 Hz", limit = 3', "drive.motor.inverter.limit"),
    ):
        with pytest.raises(SceneError) as caught:
            flywheel.load(SCENE.replace('frequency = "70 Hz", torque_limit = 0.6', written))
        assert [fault.path for fault in caught.value.faults] == [path]


DRIVEN = SCENE.replace('"-60 N m"', '"40 N m"').replace("torque_limit = 0.6", "torque_limit = 1.5, {more}")


@pytest.mark.parametrize(
    ("more", "kind"),
    [
        ("overcurrent = 1.0", "overvoltage"),
        ('braking = "resistor", chopper_power = "1 kW"', "chopper_power"),
        ('braking = "resistor", chopper_power = "30 kW"', None),
        ('braking = "regenerative"', None),
    ],
)
def test_a_motor_that_is_driven_trips_an_inverter_that_takes_nothing_back(more, kind):
    sizing = flywheel.size(flywheel.load(DRIVEN.replace("{more}", more)))
    load, motor = sizing.inverter, sizing.scene.motor
    omega = sizing.run.speed_max  # where it brakes hardest
    returned = -float(motor.input_power(omega, motor.torque(omega)))
    assert -load.power_least == pytest.approx(returned, rel=1e-6)
    assert [trip.kind for trip in load.trips if trip.kind != "overcurrent"] == ([] if kind is None else [kind])
    assert any("THE INVERTER TRIPS" in line for line in sizing.messages) == bool(load.trips)
    for trip in load.trips:
        assert trip.angle == pytest.approx(2 * math.pi / 3, abs=0.1)  # after 120 deg of driving


def test_overcurrent_tells_where():
    sizing = flywheel.size(flywheel.load(SCENE.replace("torque_limit = 0.6", "overcurrent = 0.6, torque_limit = 1.2")))
    (trip,) = sizing.inverter.trips
    motor = sizing.scene.motor
    slowest = float(motor.current_share(sizing.run.speed_min))
    assert (trip.kind, trip.value) == ("overcurrent", pytest.approx(slowest, rel=1e-6))
    assert "a lower torque_limit needs less" in " ".join(sizing.messages)


# A start on the ramp of frequency.

STARTED = (
    """
inertia = [{on = "crank", value = 2.0}]
[[load]]
on = "crank"
torque = "-15*sign(omega) - 0.0004*omega*abs(omega)"
"""
    + MOTOR
    + """inverter = {%s}
[flywheel]
inertia = 0.05
"""
)


@pytest.mark.parametrize(("more", "end"), sample([(", torque_limit = 2.3", 4.0), ("", 5.9)], 2))
def test_a_start_on_the_ramp_follows_the_circuit_at_the_frequency_of_the_moment(more, end):
    run = flywheel.transient(flywheel.load(STARTED % f'frequency = "70 Hz", ramp = "6 s"{more}'), end=f"{end} s")

    def rates(t: float, y: np.ndarray) -> list[float]:
        torque, heat, gap = rotor_circuit(max(70.0 * t / 6.0, 1e-9), y[0])
        driven = (torque - 15.0 - 0.0004 * y[0] ** 2) / 2.05
        return [driven, heat, gap, torque * y[0]] if y[0] > 0.0 or driven > 0.0 else [0.0, heat, gap, 0.0]

    free = brentq(lambda t: rotor_circuit(70.0 * t / 6.0, 0.0)[0] - 15.0, 1e-4, 0.5)  # when it breaks away
    state = solve_ivp(lambda t, y: [0.0, *rotor_circuit(max(70.0 * t / 6.0, 1e-9), 0.0)[1:], 0.0], (0.0, free), [0.0] * 4,
                     method="DOP853", rtol=1e-11, atol=1e-12)  # fmt: skip
    result = solve_ivp(rates, (free, end), state.y[:, -1], method="DOP853", rtol=1e-11, atol=1e-10)
    omega, heat, gap, shaft = result.y[:, -1]
    assert run.omega == pytest.approx(omega, rel=1e-8)
    assert run.energy.rotor_heat == pytest.approx(heat, rel=1e-7)
    assert run.energy.drive == pytest.approx(shaft, rel=1e-7)
    assert gap == pytest.approx(shaft + heat, rel=1e-9)  # what the field gives is the shaft's and the rotor's
    assert run.messages[0] == "held at rest by dry friction for " + f"{free:.6g} s"


@pytest.mark.parametrize("limit", [1.2, 2.2])
def test_a_limit_on_the_ramp_is_that_of_the_frequency_of_the_moment(limit):
    motor = flywheel.load(STARTED % f'frequency = "90 Hz", ramp = "4 s", torque_limit = {limit}').motor
    ramped = motor.start.connections[0].motor
    times = np.array([0.5, 1.0, 2.0, 3.0, 3.9])
    for share in (0.1, 0.5, 0.8, 0.97, 1.1):
        fields = motor.field_speed * times / 4.0
        at_times = ramped.at(times)
        for k, field in enumerate(fields):
            own = fed(50.0 * field / FIELD, limit)
            omega = share * field
            assert float(at_times.torque(np.full(5, omega))[k]) == pytest.approx(float(own.torque(omega)), rel=1e-12)
            for name in ("slip_speed", "current_share", "rotor_heat", "constant_share"):
                result = getattr(at_times, name)(np.full(5, omega))[k]
                assert float(result) == pytest.approx(float(getattr(own, name)(omega)), rel=1e-9), name


def test_a_ramp_too_short_trips_by_overcurrent_when_the_current_comes_to_its_limit():
    run = flywheel.transient(flywheel.load(STARTED % 'frequency = "50 Hz", ramp = "0.5 s"'), end="0.4 s")
    (line,) = [message for message in run.messages if "TRIPS" in message]
    at = float(line.split("after ")[1].split(" s")[0])
    motor = flywheel.load(STARTED % 'frequency = "50 Hz", ramp = "0.5 s"').motor.start.connections[0].motor
    omega = float(np.interp(at, run.motion.t, run.motion.omega))
    assert float(motor.at(np.array([at])).current_share([omega])[0]) == pytest.approx(2.0, rel=1e-3)
    assert "overcurrent" in line
    slower = flywheel.transient(flywheel.load(STARTED % 'frequency = "50 Hz", ramp = "8 s"'), end="0.4 s")
    assert not any("TRIPS" in message for message in slower.messages)


@pytest.mark.parametrize(("frequency", "weakening"), [(30.0, 50.0), (80.0, 50.0)])
def test_a_synchronous_motor_is_its_circuit_at_that_voltage_and_frequency(frequency, weakening):
    mains = Synchronous(power=15e3, poles=4, frequency=50.0, pull_out_ratio=2.0, damping=4.0, saliency=0.3)
    motor = mains.fed(Inverter(frequency, weakening, braking="regenerative"))
    field = 50 * math.pi
    xd = 1.0 / (mains.field_torque * field)  # at U = E = 1: T = E U sin d/(x omega) + U² (1/x_q - 1/x_d) sin 2d/(2 omega)
    both = 2.0 * mains.reluctance_torque * field
    volts, back, share = min(frequency, weakening) / 50.0, frequency / 50.0, frequency / 50.0
    for d in (0.2, 0.7, 1.2):
        torque = volts * back * math.sin(d) / (xd * share) + volts**2 * both / share * math.sin(2 * d) / 2.0
        assert float(motor.synchronizing_torque(d)) == pytest.approx(torque / (field * share), rel=1e-12)
    assert float(motor.damper_torque(3.0)) == pytest.approx((volts / share) ** 2 * 12.0)
    assert motor.no_load_speed == pytest.approx(field * share)
    with pytest.raises(SceneError, match=r"inverter\.torque_limit.*servo"):
        mains.fed(Inverter(frequency, weakening, torque_limit=1.5))


@pytest.mark.parametrize(("hertz", "end"), [(30.0, 0.44), (80.0, 0.38)])
def test_a_synchronous_motor_starts_with_the_frequency_of_its_inverter(hertz, end):
    """By voltage, electromotive force and reactances of the moment; the field turns by the integral of the frequency."""
    own = {"type": "synchronous", "power": "15 kW", "poles": 4, "frequency": "50 Hz", "pull_out_ratio": 2, "saliency": 0.3}
    own |= {"damping": 40.0, "inverter": {"frequency": f"{hertz} Hz", "ramp": "0.4 s", "braking": "regenerative"}}
    load = [{"on": "crank", "torque": "-20 - 0.0004*omega*abs(omega)"}]
    run = flywheel.transient(
        flywheel.load({"load": load, "drive": {"motor": own}, "flywheel": {"inertia": 0.1}}), end=f"{end} s"
    )
    mains = Synchronous(power=15e3, poles=4, frequency=50.0, pull_out_ratio=2.0, damping=40.0, saliency=0.3)
    field = 50 * math.pi
    xd = 1.0 / (mains.field_torque * field)  # as above, at 50 Hz
    both = 2.0 * mains.reluctance_torque * field

    def figures(t: float, omega: float, d: float) -> tuple[float, float, float]:
        """Torque and power of the field, and its speed over that at 50 Hz."""
        x = t / 0.4 if t < 0.3996 else 1.0 - 1e-3 * math.exp(-(t - 0.3996) / 4e-4)
        share = max(x * hertz / 50.0, 1e-12)
        volts = min(share, 1.0)
        gap = volts * share * math.sin(d) / (xd * share) + volts**2 * both / share * math.sin(2 * d) / 2.0
        torque = gap / (field * share) + 40.0 * (volts / share) ** 2 * (field * share - omega)
        return torque, torque * field * share, share

    def rates(t: float, y: np.ndarray) -> list[float]:
        torque, power, share = figures(t, y[0], y[1])
        driven = (torque - 20.0 - 0.0004 * y[0] * abs(y[0])) / 0.1
        return [driven, 2.0 * (field * share - y[0]), torque * y[0], power]

    result = solve_ivp(rates, (0.0, end), [0.0] * 4, method="DOP853", rtol=1e-11, atol=1e-11)
    omega, angle, work, taken = result.y[:, -1]
    assert run.omega == pytest.approx(omega, rel=1e-7)
    assert run.motion.states["load_angle"][-1] == pytest.approx(angle, abs=1e-6)
    assert run.energy.drive == pytest.approx(work, rel=1e-7)
    assert taken > work
    assert omega == pytest.approx(field * figures(end, omega, angle)[2], rel=0.02)  # in step


@pytest.mark.parametrize("ramp", [{}, {"ramp": "2 s"}])
def test_a_synchronous_motor_keeps_step_with_its_inverter(ramp):
    scene = {
        "load": [{"on": "crank", "torque": "-30 - 20*sin(phi)"}],
        "drive": {
            "motor": {"type": "synchronous", "power": "15 kW", "poles": 4, "frequency": "50 Hz", "pull_out_ratio": 2}
            | {"asynchronous_slip": 0.04, "inverter": {"frequency": "30 Hz"} | ramp},
        },
        "flywheel": {"inertia": 0.5},
    }
    result = flywheel.size(flywheel.load(scene))
    assert 2 * math.pi / result.energy.period == pytest.approx(30 * math.pi, rel=1e-9)
    assert result.inverter.power == pytest.approx(result.power_flow.input, rel=1e-6)
    assert result.inverter.current is None
    assert result.inverter.trips == ()


# By the fluxes of a circuit.

AXES = {
    "type": "induction", "electrical": "two-axis", "power": "2238 W", "speed": "1710 rpm", "poles": 4, "frequency": "60 Hz",
    "breakdown_ratio": 4.5, "voltage": "220 V", "stator_resistance": 0.435, "stator_reactance": 0.754,
    "magnetizing_reactance": 26.13, "rotor_resistance": 0.816, "rotor_reactance": 0.754, "inertia": 0.089,
}  # fmt: skip


def by_axes(inverter: dict, torque: str, wheel: float = 0.25) -> flywheel.Scene:
    load = [{"on": "crank", "torque": torque}]
    return flywheel.load({"load": load, "drive": {"motor": AXES | {"inverter": inverter}}, "flywheel": {"inertia": wheel}})


@pytest.mark.parametrize(("hertz", "ramp", "end"), sample([(60.0, 1.0, 0.4), (80.0, 0.2, 0.3), (40.0, 0.0, 0.2)], 3))
def test_a_start_by_two_axes_is_that_of_the_phases_in_the_frame_of_the_stator(hertz, ramp, end):
    """The voltage turns by the integral of the frequency, which rises evenly, and the last thousandth exponentially."""
    fed = {"frequency": f"{hertz} Hz"} | ({"ramp": f"{ramp} s"} if ramp else {})
    run = flywheel.transient(by_axes(fed, "-0.0004*omega*abs(omega)"), end=f"{end} s")
    w, lag = 120 * math.pi, 1e-3 * ramp
    ls, lm = (26.13 + 0.754) / w, 26.13 / w
    lost = ls * ls - lm * lm

    def share(t: float) -> float:
        if not ramp:
            return 1.0
        return t / ramp if t < ramp - lag else 1.0 - 1e-3 * math.exp(-(t - ramp + lag) / lag)

    def rates(t: float, y: np.ndarray) -> list[float]:
        stator, rotor, omega = complex(y[0], y[1]), complex(y[2], y[3]), y[4]
        current, inner = (ls * stator - lm * rotor) / lost, (ls * rotor - lm * stator) / lost
        here = share(t) * hertz
        volts = 220 * math.sqrt(2 / 3) * min(here, 60.0) / 60.0 * complex(math.cos(y[5]), math.sin(y[5]))
        first, second = volts - 0.435 * current, -0.816 * inner + 2j * omega * rotor
        torque = 3.0 * (stator.conjugate() * current).imag
        driven = (torque - 0.0004 * omega * abs(omega)) / 0.339
        heat, taken = 1.224 * abs(inner) ** 2, 1.5 * (volts.conjugate() * current).real
        return [first.real, first.imag, second.real, second.imag, driven, math.tau * here, heat, torque * omega, taken]

    result = solve_ivp(rates, (0.0, end), [0.0] * 9, method="DOP853", rtol=1e-10, atol=1e-11, dense_output=True)
    assert run.omega == pytest.approx(result.y[4, -1], rel=1e-7)
    assert run.energy.rotor_heat == pytest.approx(result.y[6, -1], rel=1e-7)
    assert run.energy.drive == pytest.approx(result.y[7, -1], rel=1e-7)

    def current_share(t: float) -> float:
        y = result.sol(t)
        current = (ls * complex(y[0], y[1]) - lm * complex(y[2], y[3])) / lost
        return abs(current) / math.sqrt(2.0) / run.scene.motor.rated_current

    text = [line for line in run.messages if "overcurrent" in line]
    peak = max(current_share(t) for t in np.linspace(0.0, end, 600))
    assert bool(text) == (peak > 2.0)
    if text:
        assert current_share(float(text[0].split("after ")[1].split(" s")[0])) == pytest.approx(2.0, rel=2e-3)


def test_a_steady_cycle_by_two_axes_takes_what_its_shaft_and_its_windings_take():
    result = flywheel.size(by_axes({"frequency": "45 Hz"}, "-6 - 4*sin(phi)"), simulate=False)
    ramped = flywheel.size(by_axes({"frequency": "45 Hz", "ramp": "2 s"}, "-6 - 4*sin(phi)"), simulate=False)
    energy, load = result.energy, result.inverter
    assert load.power == pytest.approx(energy.mean_power + energy.rotor_heat + energy.stator_heat, rel=1e-8)
    assert load.trips == ()
    assert load.current == pytest.approx(energy.current_peak / result.scene.motor.rated_current, rel=1e-6)
    assert ramped.run.irregularity == pytest.approx(result.run.irregularity, rel=1e-7)
    assert ramped.inverter.power == pytest.approx(load.power, rel=1e-7)
    assert result.scene.motor.rated_heat == pytest.approx(float(result.scene.motor.on_mains.rotor_heat(1710 * RPM)))


@pytest.mark.parametrize(
    ("fed", "path"), [({"frequency": "60 Hz", "torque_limit": 1.5}, "torque_limit"), ({"frequency": "5 Hz"}, "frequency")]
)
def test_what_two_axes_do_not_tell_of_is_refused(fed, path):
    with pytest.raises(SceneError) as caught:
        by_axes(fed, "-6")
    assert [fault.path for fault in caught.value.faults] == [f"drive.motor.inverter.{path}"]
