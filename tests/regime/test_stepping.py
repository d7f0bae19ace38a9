"""Steps through a smooth piece: explicit, implicit, what ends them, and one steady cycle of them."""

from __future__ import annotations

import numpy as np
import pytest

import flywheel
from flywheel.machine.dynamics import Dynamics
from flywheel.machine.machine import Machine
from flywheel.regime.stepping import Events, Implicit, RateField, SlidingError, Tolerance, decay, one_cycle, through
from tests import regimes
from tests.limits import sample

TIGHT, ENDS = 1e-13, (0.0, 1e9)


def stepped(rates, first, until, ends=ENDS, *, tight=TIGHT, hint=None, events=None, along=None):
    tolerance = Tolerance(tight, np.full(2, tight))
    return list(through(rates, 0.0, np.array(first), ends, until, tolerance, hint, events, along))


def falling(acceleration):
    return lambda t, state: np.array([state[1], acceleration])


@pytest.mark.parametrize(
    ("acceleration", "first", "ends", "hint", "end"),
    [
        (2.0, [0.0, 1.0], (0.0, 6.0), None, 2.0),
        (-2.0, [0.0, 2.0], (0.0, 0.999), 10.0, 1 - np.sqrt(1 - 0.999)),  # past the end and back within a step
        (-2.0, [0.5, 1.0], (0.0, 5.0), None, 0.5 + np.sqrt(0.75)),  # turns back and leaves by the other end
        (0.0, [0.0, 1.0], (0.0, 500.0), None, 100.0),  # time runs out
    ],
)
def test_the_last_step_ends_exactly_where_phi_leaves_the_piece(acceleration, first, ends, hint, end):
    steps = stepped(falling(acceleration), first, 100.0, ends, hint=hint)
    assert steps[-1].end == pytest.approx(end, rel=1e-12)
    assert steps[-1].dense(end)[1] == pytest.approx(first[1] + acceleration * end, rel=1e-11)


@pytest.mark.parametrize(
    ("values", "sides", "crossed", "end"),
    [
        (lambda t, y: np.array([2.5 - t, t - 2.0]), (1.0, -1.0), 1, 2.0),  # the first of several
        (lambda t, y: (((t - 3.123) ** 2) - 1e-6)[None], (1.0,), 0, 3.122),  # below within a step, and back
        (lambda t, y: (-t)[None], (1.0,), 0, 0.0),  # at once
        (lambda t, y: ((t - 3.0) ** 2 + 1e-9)[None], (1.0,), None, 10.0),  # only touches zero
    ],
)
def test_a_step_ends_where_something_watched_changes_its_sign(values, sides, crossed, end):
    steps = stepped(falling(0.0), [0.0, 1.0], 10.0, (0.0, 50.0), hint=10.0, events=Events(values, np.array(sides)))
    assert (steps[-1].crossed, steps[-1].end) == (crossed, pytest.approx(end, abs=1e-10))


def of(along):
    """Rates of a state at an instant, of those at many."""
    return lambda t, state: along(np.array([t]), np.asarray(state)[:, None])[:, 0]


def relaxing(rate: float):
    """phi' = 1, y' = -rate (y - cos t) - sin t: y = cos t + (y0 - 1) exp(-rate t)."""

    def along(t, states):
        return np.array([np.ones_like(t), -rate * (states[1] - np.cos(t)) - np.sin(t)])

    return of(along), RateField(along, np.ones(2))


@pytest.mark.parametrize("rate", [1e2, 1e8])
def test_a_stiff_relaxation_takes_few_steps_at_full_accuracy(rate):
    rates, along = relaxing(rate)
    steps = stepped(rates, [0.0, 3.0], 10.0, along=along)
    assert len(steps) < 150
    assert steps[-1].end == 10.0
    for step in steps:
        times = np.linspace(step.start, step.end, 7)
        assert step.dense(times)[1] == pytest.approx(np.cos(times) + 2.0 * np.exp(-rate * times), abs=2e-12)


def test_a_stiff_motion_ends_exactly_where_it_leaves_the_piece_or_something_watched_its_side():
    rates, along = relaxing(1e5)
    last = stepped(rates, [0.0, 1.0], 10.0, (0.0, 2.5), along=along)[-1]
    assert last.end == pytest.approx(2.5, rel=1e-14)
    assert last.dense(last.end) == pytest.approx([2.5, np.cos(2.5)], rel=1e-12)
    events = Events(lambda t, states: (states[1] + 0.5)[None], np.array([1.0]))
    last = stepped(rates, [0.0, 1.0], 10.0, events=events, along=along)[-1]
    assert (last.crossed, last.end) == (0, pytest.approx(2 * np.pi / 3, rel=1e-12))


def test_the_two_ways_agree_on_a_law_that_is_not_linear():
    """y' = -50 (y³ - 1 - sin t): explicit steps of DOP853 and implicit ones."""

    def along(t, states):
        return np.array([np.ones_like(t), -50 * (states[1] ** 3 - 1 - np.sin(t))])

    ways = (None, RateField(along, np.ones(2)))
    ends = [stepped(of(along), [0.0, 2.0], 0.5, along=way)[-1].dense(0.5)[1] for way in ways]
    assert ends[1] == pytest.approx(ends[0], rel=1e-11)


def test_what_is_not_stiff_is_stepped_as_without():
    rates, along = relaxing(1.0)
    plain, offered = (stepped(rates, [0.0, 3.0], 10.0, tight=1e-12, along=way) for way in (None, along))
    assert [step.end for step in plain] == [step.end for step in offered]


def test_where_no_implicit_step_is_accepted_explicit_ones_go_on():
    """Rates at many instants that are no numbers: Newton's method never settles."""
    rates, along = relaxing(30.0)
    broken = RateField(lambda t, states: along.rates(t, states) + np.where(t > 0.5, np.nan, 0.0), along.sizes, 0.0)
    last = stepped(rates, [0.0, 1.0], 1.0, tight=1e-12, along=broken)[-1]
    assert last.dense(1.0)[1] == pytest.approx(np.cos(1.0), abs=1e-10)


def test_a_stretch_of_many_steps_goes_on_implicitly():
    def along(t, states):
        return np.array([np.ones_like(t), 40 * np.cos(40 * t)])

    ways = (None, RateField(along, np.ones(2), np.inf))
    explicit, both = (stepped(of(along), [0.0, 0.0], 3.0, along=way) for way in ways)
    for steps in (explicit, both):
        assert steps[-1].dense(3.0)[1] == pytest.approx(np.sin(120.0), abs=1e-11)
    assert len(both) < len(explicit)


def test_the_fastest_decay_is_told():
    _, along = relaxing(250.0)
    assert decay(along, 0.0, np.array([0.0, 1.0])) == pytest.approx(250.0, rel=1e-6)
    growing = RateField(lambda t, states: np.array([np.ones_like(t), 3.0 * states[1]]), np.ones(2))
    assert decay(growing, 0.0, np.array([0.0, 1.0])) == 0.0


def test_rounding_does_not_stop_the_steps():
    """Two large torques that nearly cancel: rates are rough by 1e-16 of them, far above the tolerance."""
    big = 1e6

    def along(t, states):
        return np.array([np.ones_like(t), (1e7 + np.sin(t)) - big * (10.0 + 1e-5 * states[1])])

    solver = Implicit(RateField(along, np.array([1.0, 1e5])), 0.0, np.array([0.0, 0.0]), 3e-14, np.full(2, 3e-14))
    count = 0
    while solver.t < 5.0:
        assert solver.step(5.0 - solver.t, 1.0) is not None
        count += 1
    assert count < 60
    # y' = sin t - 10 y
    expected = (10 * np.sin(5.0) - np.cos(5.0)) / 101
    assert solver.state[1] == pytest.approx(expected, abs=1e-8)


def test_from_rest_a_step_starts_exactly_where_it_is():
    """A pace of -1e-16 there would look like a motion that turns back at once."""

    def along(t, states):
        return np.array([states[1], 10.0 - 2.0 * states[1]])

    solver = Implicit(RateField(along, np.ones(2)), 0.0, np.zeros(2), 1e-12, np.full(2, 1e-12))
    dense = solver.step(4.0, 0.0)
    assert dense is not None
    assert (dense(0.0) == 0.0).all()
    times = np.array([0.0, 1e-9, 1e-3])
    assert dense(times)[1] == pytest.approx(-5.0 * np.expm1(-2.0 * times), rel=1e-9)
    assert dense(times)[0] == pytest.approx(2.5 * (2.0 * times + np.expm1(-2.0 * times)), rel=1e-9, abs=1e-15)


@pytest.mark.parametrize(("gain", "width"), [(1e3, 1e-4), (1e2, 1e-3)])
def test_a_law_that_saturates_does_not_pass_for_rounding(gain, width):
    """y' = -gain tanh((y - cos t)/width) from far off: Newton's method goes astray in long steps, which are none to take."""

    def along(t, states):
        return np.array([np.ones_like(t), -np.sin(t) - gain * np.tanh((states[1] - np.cos(t)) / width)])

    offset, last = 3.0 * width, 5.0 * width / gain + 1e-3
    for step in stepped(of(along), [0.0, 1.0 + offset], last, along=RateField(along, np.ones(2))):
        times = np.linspace(step.start, step.end, 5)
        # y - cos t = d: d' = -gain tanh(d/width), so that sinh(d/width) = sinh(d0/width) exp(-gain t/width)
        expected = np.cos(times) + width * np.arcsinh(np.sinh(offset / width) * np.exp(-gain * times / width))
        assert step.dense(times)[1] == pytest.approx(expected, abs=2e-11)


def cycle_of(name: str, inertia: float, *, scale: float = 1.0) -> tuple[Machine, float, list, float]:
    """A case's cycle from the state at phi = 0 that the references give."""
    machine = Machine(flywheel.load(regimes.scene(name, inertia=inertia)))
    [found] = [item for item in regimes.figures(name)["analysis"].values() if float(item["inertia"]) == inertia]
    speed, start = float(found["speed"]), float(found["speed_at_zero"])
    balance = float(found["balance"]) if found["balance"] is not None else 0.0
    dynamics = Dynamics(machine, inertia * machine.scene.flywheel_ratio**2, balance)
    u = (start / speed - 1) / scale
    steps = one_cycle(dynamics, speed, scale, np.array([0.0, u]), 1e-12)
    return machine, speed, steps, u


@pytest.mark.parametrize("name", sample(["governor", "geared-loss"], 2))
def test_a_periodic_motion_comes_back_to_where_it_started(name):
    inertia = regimes.CASES[name].inertias[0]
    machine, _, steps, u = cycle_of(name, inertia)
    last = steps[-1]
    phi, end = last.dense(last.end)[:2]
    assert phi == pytest.approx(machine.scene.cycle, rel=1e-12)
    assert end == pytest.approx(u, abs=1e-9)


def test_the_scale_changes_nothing():
    inertia = regimes.CASES["governor"].inertias[0]
    ends = [cycle_of("governor", inertia, scale=scale)[2][-1].end for scale in (1.0, 0.01)]
    assert ends[0] == pytest.approx(ends[1], rel=1e-10)


@pytest.mark.slow
def test_a_motion_along_a_jump_is_told_apart():
    """Friction that sets in above a speed holds the motion at that speed: no step gets on."""
    rotor = {
        "load": [
            {"on": "crank", "torque": -30, "from": 0, "to": "90 deg"},
            {"on": "crank", "torque": "-60*(omega > 10)"},
        ],
        "drive": {"torque": "20"},
        "flywheel": {"inertia": 2.0},
        "regime": {"speed": 10},
    }
    dynamics = Dynamics(Machine(flywheel.load(rotor)), 2.0)
    with pytest.raises(SlidingError):
        one_cycle(dynamics, 10.0, 1.0, np.array([0.0, 0.0]), 1e-10)


def governed(gain: float, inertia: float) -> tuple[Machine, np.ndarray]:
    """A rotor held at 10 rad/s by a drive of a gain (N m s), and its speed less 10 at 128 angles.

    v = omega - 10 obeys gain v = -80 sin phi - 20 cos 3 phi - inertia (10 + v) v', by iteration on its Fourier series.
    """
    scene = {
        "load": [{"on": "crank", "torque": "-100 - 80*sin(phi) - 20*cos(3*phi)"}],
        "inertia": [{"on": "crank", "value": inertia}],
        "drive": {"torque": f"{100 + 10 * gain} - {gain}*omega"},
        "flywheel": {"inertia": 0},
        "regime": {},
    }
    phi, order = 2 * np.pi * np.arange(128) / 128, np.fft.fftfreq(128, 1 / 128)
    load = 80 * np.sin(phi) + 20 * np.cos(3 * phi)
    v = -load / gain
    for _ in range(60):
        slope = np.fft.ifft(np.where(np.abs(order) < 40, 1j * order * np.fft.fft(v), 0)).real
        v = -(load + inertia * (10 + v) * slope) / gain
    return Machine(flywheel.load(scene)), v


@pytest.mark.parametrize("gain", sample([1e6, 1e3], 2))
def test_a_steep_drive_is_stepped_in_few_steps_and_keeps_its_digits(gain):
    """Up to 6e7 time constants a cycle, and a drive whose torque of 1e7 N m leaves but 100 N m."""
    machine, v = governed(gain, 0.01)
    scale = 0.1 * float(np.ptp(v))
    steps = one_cycle(Dynamics(machine, 0.0), 10.0, scale, np.array([0.0, v[0] / (10 * scale)]), 3e-14)
    found = np.concatenate([step.dense(np.linspace(step.start, step.end, 9)) for step in steps], axis=1)
    series = np.fft.fft(v) / 128
    exact = (series * np.exp(1j * np.outer(found[0], np.fft.fftfreq(128, 1 / 128)))).sum(axis=1).real
    assert len(steps) < 250
    assert np.abs(10 * scale * found[1] - exact).max() < 1e-11 * np.ptp(v) + 20 * np.finfo(float).eps * 10


def test_a_fast_current_is_confirmed_by_the_steady_motion():
    scene = regimes.scene("dc-inductance", inertia=0.1)
    motor = {**scene["drive"]["motor"], "inductance": 1e-6}
    result = flywheel.size(flywheel.load({**scene, "drive": {**scene["drive"], "motor": motor}}))
    assert result.simulation.route == "time"
    assert abs(result.simulation.irregularity / result.run.irregularity - 1) <= 1e-12
    assert result.error.simulation <= 1e-9
