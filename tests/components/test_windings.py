"""Temperature of a motor's windings: over losses of any course, over a duty with its changes of speed, over a start."""

import math
import re
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

import flywheel
from flywheel import SceneError
from flywheel.components.motors.thermal import CLASSES, Losses, course, rise_after, starts_an_hour, thermal
from flywheel.motions.motion import speed_at

ONE = thermal(1200.0, 80.0, "F")
TWO = thermal(1500.0, 95.0, "F", 90.0, 0.4)
DUTY = [Losses(200.0, 1.7), Losses(140.0, 0.2), Losses(45.0, 2.9), Losses(260.0, 0.5)]
PERIOD = sum(losses.time for losses in DUTY)


def share(t: float) -> float:
    t %= PERIOD
    for losses in DUTY:
        if t < losses.time:
            return losses.share
        t -= losses.time
    return DUTY[-1].share


@pytest.mark.parametrize("data", [ONE, TWO], ids=["one", "two"])
def test_the_course_is_the_convolution_of_the_losses(data):
    result, edges = course(data, DUTY), np.cumsum([0.0, *(losses.time for losses in DUTY)])
    before = [-k * PERIOD + edge for k in range(50) for edge in edges]

    def convolved(t: float) -> float:
        times = sorted({b for b in [*before, *edges] if b < t} | {t})
        total = 0.0
        for start, end in pairwise(times):
            q = share(0.5 * (start + end))
            total += sum(r * q * quad(lambda s, c=c: math.exp(-(t - s) / c) / c, start, end)[0] for r, c, _ in data.bodies)
        return total

    assert result.ends == pytest.approx([convolved(float(edge)) for edge in edges], rel=1e-5)
    assert result.greatest >= max(result.ends) - 1e-9
    assert result.greatest == pytest.approx(convolved(result.time), rel=1e-5)


@pytest.mark.parametrize("data", [TWO, pytest.param(ONE, marks=pytest.mark.slow)], ids=["two", "one"])
def test_standstill_cools_the_motor_by_its_share_alone(data):
    sequence = [Losses(300.0, 1.5), Losses(500.0, 0.0, 0.3)]
    result = course(data, sequence)

    def rates(t: float, x: np.ndarray, losses: Losses) -> list[float]:
        rows = zip(x, data.bodies, strict=True)
        return [(r * losses.share - (losses.cooling if slow else 1.0) * part) / c for part, (r, c, slow) in rows]

    x, ends, top = np.zeros(len(data.bodies)), [], 0.0
    for _ in range(80):
        ends, top = [float(x.sum())], 0.0
        for losses in sequence:
            run = solve_ivp(rates, (0.0, losses.time), x, args=(losses,), rtol=1e-10, atol=1e-9, max_step=losses.time / 50)
            x, top = run.y[:, -1], max(top, float(run.y.sum(axis=0).max()))
            ends.append(float(x.sum()))
    assert result.ends == pytest.approx(ends, rel=1e-6)
    assert result.greatest == pytest.approx(top, rel=1e-4)


def test_short_and_intermittent_ratings_of_the_books():
    """1/(1 - e^(-t/T)) of the losses for a while t from cold, (1 - e^(-(t + t_0)/T))/(1 - e^(-t/T)) with breaks t_0.

    Dubey, Fundamentals of Electrical Drives, chapter 4 (short-time and intermittent ratings): time constants of 60 min while
    it runs and 90 min at rest, 10 min of work: 6.51 times the losses, and 1.58 times with breaks of 10 min.
    """
    hour = thermal(3600.0, 40.0, "B")
    cold = 1.0 / -math.expm1(-10 / 60)
    assert cold == pytest.approx(6.51, abs=0.01)
    times, weights = 300.0 * (1 + np.polynomial.legendre.leggauss(30)[0]), 300.0 * np.polynomial.legendre.leggauss(30)[1]
    assert rise_after(hour, times, weights, np.full(30, cold), 600.0) == pytest.approx(40.0)
    broken = -math.expm1(-(10 / 60 + 10 / 90)) / -math.expm1(-10 / 60)
    assert broken == pytest.approx(1.58, abs=0.005)
    assert course(hour, [Losses(600.0, broken), Losses(600.0, 0.0, 60 / 90)]).greatest == pytest.approx(40.0)


def test_starts_an_hour_are_the_most_that_the_limit_allows():
    start = Losses(3.0, 25.0)
    count = starts_an_hour(TWO, 0.4, start)
    tops = [course(TWO, [start, Losses(3600.0 / n - 3.0, 0.4)]).greatest for n in (count, count + 1)]
    assert tops[0] <= CLASSES["F"] < tops[1]
    assert starts_an_hour(TWO, 1.2, start) == 0


@pytest.mark.parametrize("inertia", [0.4, 0.83, 1.3])
def test_starts_an_hour_are_those_of_losses_that_fall_within_a_start_to_within_one(inertia):
    """A rotor against 20 N m by the formula of Kloss, through start and running; the heat as that of two bodies in time."""
    idle, slip, top, rated = 50 * math.pi, 1 / 30, 2.5, 7500.0 / (1450 * math.pi / 30)
    peak = slip * (top + math.sqrt(top**2 - 1))
    torque = lambda w: 2 * top * rated / ((1 - w / idle) / peak + peak / (1 - w / idle))  # noqa: E731
    bodies, limit = ((42.0, 1200.0), (28.0, 60.0)), 80.0

    def rates(t, y):
        share = torque(y[0]) * (idle - y[0]) / (rated * slip * idle)
        return [
            (torque(y[0]) - 20.0) / inertia,
            *((rise * share - x) / T for x, (rise, T) in zip(y[1:], bodies, strict=True)),
        ]

    run = solve_ivp(rates, (0, 30), [0, 0, 0], method="DOP853", rtol=1e-9, atol=1e-9, dense_output=True)
    speed = run.y[0, -1]
    running, times = torque(speed) * (idle - speed) / (rated * slip * idle), np.linspace(0, 30, 6001)

    def greatest(count):
        rise, rest = np.zeros(times.size), 3600.0 / count - 30.0
        for k, (share, constant) in enumerate(bodies):
            left = run.y[1 + k, -1] * math.exp(-rest / constant) + share * running * -math.expm1(-rest / constant)
            rise += run.sol(times)[1 + k] + left / -math.expm1(-3600.0 / count / constant) * np.exp(-times / constant)
        return rise.max()

    whole = solve_ivp(
        lambda t, y: [rates(t, [y[0], 0, 0])[0], torque(y[0]) * (idle - y[0]) / (rated * slip * idle)],
        (0, 30), [0, 0], method="DOP853", rtol=1e-9, atol=1e-9, events=lambda t, y: y[0] - 0.995 * speed,
    )  # fmt: skip
    lasting, given = float(whole.t_events[0][0]), float(whole.y_events[0][0][1])
    two = thermal(1200.0, 70.0, "B", 60.0, 0.4)
    count = starts_an_hour(two, running, Losses(lasting, given / lasting))
    assert greatest(count - 1) <= limit < greatest(count + 2)


PLATE = """type = "induction"
power = "7.5 kW"
speed = "1450 rpm"
poles = 4
frequency = "50 Hz"
breakdown_ratio = 2.5
thermal = {time_constant = "20 min", class = "F", rise = "85 K", winding_time_constant = "2 min", winding_share = 0.3}"""
MACHINE = f"""
[[load]]
on = "crank"
torque = "-40 - 20*sin(phi)"
[drive.motor]
{PLATE}
[flywheel]
inertia = 60
"""
PHASES = """
[[duty]]
name = "heavy"
duration = "40 s"
[[duty]]
name = "light"
duration = "50 s"
loads = 0.2
"""


def test_a_steady_cycle_rises_by_its_heat_over_the_rated_one():
    result = flywheel.size(flywheel.load(MACHINE))
    assert result.temperature.greatest == pytest.approx(85.0 * result.energy.rotor_heat_share, rel=1e-6)
    assert result.as_dict()["temperature"]["within"] == (result.temperature.greatest <= 105.0)


@pytest.mark.parametrize("constants", [(60.0, None, 0.0), (20.0, 2.0, 0.3)], ids=["one", "two"])
def test_the_peak_within_a_steady_cycle_is_that_of_many_short_losses(constants):
    """Against 20,000 constant losses in turn, whose own error is below 1e-7: a press at the end of whose blow it is hot."""
    whole, winding, part = constants
    own = {"time_constant": whole, "class": "F"}
    own |= {} if winding is None else {"winding_time_constant": winding, "winding_share": part}
    motor = {"type": "induction", "power": "3 kW", "speed": "1440 rpm", "poles": 4, "frequency": "50 Hz"}
    scene = flywheel.load(
        {
            "shafts": {"motor": {"on": "crank", "ratio": 40}},
            "load": [
                {"on": "crank", "torque": -900.0, "from": "280 deg", "to": "350 deg"},
                {"on": "crank", "torque": -150.0},
            ],
            "drive": {"on": "motor", "motor": {**motor, "breakdown_ratio": 2.8, "thermal": own}},
            "flywheel": {"on": "motor", "inertia": 0.3},
        }
    )
    result = flywheel.size(scene)
    edges = np.linspace(0.0, 2.0 * np.pi, 20_001)
    edges = np.sort(np.append(edges, np.radians([280.0, 350.0])))
    speeds = speed_at(result, 0.5 * (edges[1:] + edges[:-1]))
    many = map(Losses, (np.diff(edges) / speeds).tolist(), scene.motor.heat_share(40.0 * speeds).tolist())
    fine = course(scene.motor.thermal, many)
    assert result.temperature.greatest == pytest.approx(fine.greatest, rel=1e-7)
    assert result.temperature.time == pytest.approx(fine.time, abs=1e-4)
    assert 0.0 < result.temperature.error < 1e-8


@pytest.mark.slow
def test_changes_between_phases_are_those_of_the_duty_followed_in_time():
    result = flywheel.size(flywheel.load(MACHINE + PHASES))
    motor = result.scene.motor

    def rates(t: float, y: np.ndarray, loads: float) -> list[float]:
        torque = float(motor.torque(y[1]))
        return [y[1], (torque - loads * (40 + 20 * math.sin(y[0]))) / 60.0, torque * (50 * math.pi - y[1])]

    y, heats = np.array([0.0, 155.0, 0.0]), {}
    for _ in range(3):
        for name, duration, loads in (("heavy", 40.0, 1.0), ("light", 50.0, 0.2)):
            run = solve_ivp(rates, (0.0, duration), [y[0], y[1], 0.0], args=(loads,), method="LSODA", rtol=1e-8, atol=1e-8)
            y, heats[name] = run.y[:, -1], float(run.y[2, -1]) / duration
    rows = {row.name: row for row in result.duty.phases}
    for name, heat in heats.items():
        assert rows[name].change_time > 0.0
        assert rows[name].heat == pytest.approx(heat, rel=5e-4)  # by the angle at which a phase begins
    assert not any("left out" in line for line in result.messages)
    alone = flywheel.size(flywheel.load(MACHINE + PHASES.split('[[duty]]\nname = "light"')[0])).duty.heat
    assert abs(rows["heavy"].heat / alone - 1.0) > 0.005  # what was left out


@pytest.mark.slow
def test_the_error_of_a_rise_contains_the_course_of_losses_within_starts():
    text = MACHINE.replace("-40 - 20*sin(phi)", "-30").replace("inertia = 60", "inertia = 1.2")
    result = flywheel.size(
        flywheel.load(text + PHASES.split('[[duty]]\nname = "light"')[0].replace('"40 s"', '"40 s"\nstarts = 1'))
    )
    (row,), motor = result.duty.phases, result.scene.motor

    def rates(t: float, y: np.ndarray) -> list[float]:
        return [(float(motor.torque(y[0])) - 30.0) / 1.2, float(motor.total_heat(y[0])) / motor.rated_total_heat]

    run = solve_ivp(rates, (0.0, 40.0), [0.0, 0.0], method="DOP853", rtol=1e-10, atol=1e-10, dense_output=True)
    edges = np.linspace(0.0, 40.0, 40001)
    losses, since = np.diff(run.sol(edges)[1]), 0.5 * (edges[1:] + edges[:-1])
    true = max(
        sum(
            rise / constant * losses @ np.exp(-np.mod(end - since, 40.0) / constant) / -math.expm1(-40.0 / constant)
            for rise, constant in ((0.7 * 85.0, 1200.0), (0.3 * 85.0, 120.0))
        )
        for end in np.linspace(0.5 * row.start_time, 1.5 * row.start_time, 50)
    )
    off = abs(result.temperature.greatest / true - 1.0)
    assert 1e-4 < off < result.temperature.error < 20.0 * off


def test_a_start_has_the_rise_of_its_losses():
    text = MACHINE.replace("-40 - 20*sin(phi)", "-0.0002*omega**2").replace("inertia = 60", "inertia = 2")
    run = flywheel.run_up(flywheel.load(text))
    rated = run.scene.motor.rated_total_heat
    short = 85.0 * run.start_heat.winding / rated * (0.7 / 1200.0 + 0.3 / 120.0)  # all of it kept
    assert 0.95 * short < run.start_heat.rise < short


@pytest.mark.usefixtures("blank")
@pytest.mark.parametrize("phases", ["", PHASES], ids=["cycle", "duty"])
def test_the_report_has_the_rise_beside_the_heat(phases):
    light = (MACHINE + phases).replace("inertia = 60", "inertia = 2")  # it changes its speed in no time
    sizing = flywheel.size(flywheel.load(light), simulate=False)
    for language, words in (("en", "Greatest rise"), ("es", "Calentamiento máximo")):
        text = re.sub(r"<[^>]*>|\s+", " ", flywheel.report.html(sizing, language=language))
        number = f"{sizing.temperature.greatest:.6g}".replace(".", "," if language == "es" else ".")
        assert number in text[text.index(words) :][:900]


@pytest.mark.parametrize(
    ("written", "path"),
    [
        ('{time_constant = "20 min", class = "G"}', "drive.motor.thermal.class"),
        ('{class = "F"}', "drive.motor.thermal.time_constant"),
        ('{time_constant = "20 min", class = "F", rise = "80 °C"}', "drive.motor.thermal.rise"),
        ('{time_constant = "20 min", class = "F", winding_share = 0.3}', "drive.motor.thermal.winding_share"),
        (
            '{time_constant = "2 min", class = "F", winding_share = 0.3, winding_time_constant = "3 min"}',
            "drive.motor.thermal.winding_time_constant",
        ),
    ],
)
def test_a_fault_of_thermal_data_has_its_place(written, path):
    text = MACHINE.replace(PLATE.splitlines()[-1], f"thermal = {written}")
    with pytest.raises(SceneError) as caught:
        flywheel.load(text)
    assert [fault.path for fault in caught.value.faults] == [path]
