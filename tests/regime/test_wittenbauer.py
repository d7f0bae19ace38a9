"""The exact flywheel, the turning moment and the motion at constant speed."""

from __future__ import annotations

import json
from math import pi
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.integrate import quad
from scipy.optimize import brentq

import flywheel
from flywheel import Machine, SceneError
from flywheel.machine.equation import Moments, NoMotionError
from flywheel.numerics import cells as piecewise
from flywheel.regime import constant_speed, turning_moment, wittenbauer
from tests import regimes, scenes
from tests.limits import sample
from tests.regimes import SECTION_C


def sized(scene, rtol=None):
    return flywheel.size(flywheel.load(scene), rtol, simulate=False)


@pytest.mark.parametrize("make", scenes.ALL.values(), ids=scenes.ALL)
def test_the_certificate_brackets_the_exact_flywheel(make):
    flywheel_ = sized(make()).flywheel
    slack = 1e-12 * flywheel_.exact
    for low, high in (flywheel_.proven_bounds, flywheel_.proven_bounds_torque):
        assert low - slack <= flywheel_.exact <= high + slack


@pytest.mark.parametrize("eps", [1.0, 0.04])
def test_the_certificate_is_as_wide_as_its_formula(eps):
    """Its ends are (1 + eps²/4) (Imax - Imin)/eps apart; I* of the yoke goes from 0 to m r²."""
    low, high = sized(scenes.yoke(flywheel={"irregularity": eps})).flywheel.proven_bounds
    assert high - low == pytest.approx((1 + eps**2 / 4) * 20 * 0.5**2 / eps, rel=1e-9)


def test_exact_equals_approximate_where_the_inertia_is_constant():
    result = sized(scenes.rotor(inertia=[{"on": "crank", "value": 0.25}]))
    assert result.flywheel.exact == pytest.approx(result.flywheel.approximate, rel=1e-14)
    assert result.flywheel.inertia_torque == pytest.approx(result.flywheel.approximate_total, rel=1e-14)
    assert_allclose(result.reduced_inertia, 0.25, rtol=1e-14)


def test_the_least_inertia_may_be_in_another_cell():
    """A dip between the nodes of a wide cell is lower than the least value of a fine one: its error counts."""
    middle, width, depth = 0.35, 0.05, 0.02
    mesh = piecewise.cells(np.array([0.0, 1.0, 1.5, 2.0]))

    def inertia(phi):
        return 1.01 + 0.01 * np.cos(pi * phi) * (phi > 1.0) - depth / (1 + ((phi - middle) / width) ** 2)

    values = np.stack((0 * mesh.phi, np.zeros_like(mesh.phi), inertia(mesh.phi), 0 * mesh.phi, 0 * mesh.phi))
    extent = turning_moment.inertia_extent(turning_moment.assembled(mesh, values, None))
    fine = inertia(np.linspace(0.0, 2.0, 200_001))
    assert extent.least - float(fine.min()) > 1e-4
    assert abs(extent.least - float(fine.min())) <= extent.error
    assert abs(extent.greatest - float(fine.max())) <= extent.greatest_error


@pytest.mark.parametrize(("share", "certain"), [(0.5, False), (0.0, False), (-0.5, False), (-3.0, True), (-1e6, True)])
def test_a_flywheel_of_nothing_has_no_error_only_where_that_is_certain(share, certain):
    """The machine's own inertia is dialled so that the exact flywheel is a share of its own error."""
    mesh = piecewise.cells(np.linspace(0.0, 2 * pi, 17))
    zero, eps, speed = 0 * mesh.phi, 0.04, 10.0

    def figures(inertia):
        values = np.stack((100.0 * np.sin(mesh.phi), zero, zero + inertia, 100.0 * np.abs(np.sin(mesh.phi)), zero))
        return wittenbauer.figures_of(turning_moment.assembled(mesh, values, None), speed, eps)

    total = 200.0 / (eps * speed**2)
    error = figures(total).error
    near = figures(total - share * error)
    assert abs(near.total - near.cycle.inertia_at_start - share * error) < 0.4 * error
    assert (near.error == 0.0) == certain


@pytest.mark.parametrize("offset", [0.2, 0.5, 2.0])
def test_a_balance_spreads_errors_of_the_moment_by_no_more_than_its_factor(offset):
    """Errors of one sign within an interval and of the other outside it are the worst for the work done within."""
    mesh = piecewise.cells(np.linspace(0.0, 2 * pi, 9))
    weights, effect = piecewise.node_weights(mesh), (offset + np.cos(mesh.phi)).ravel()
    whole = float(weights @ effect)
    factor, _ = turning_moment.spread_of(whole, float(weights @ np.abs(effect)))
    worst = 0.0
    for first in range(effect.size):
        for last in range(first, effect.size):
            inside = (np.arange(effect.size) >= first) & (np.arange(effect.size) <= last)
            share = float((weights * effect)[inside].sum()) / whole
            worst = max(worst, abs(1 - share), abs(share))  # errors of integral 1, where they count most
    assert worst <= factor * (1 + 1e-12)
    assert factor == pytest.approx(1.0) if offset > 1.0 else worst > 1.2


def spread_by_its_share(own, others):
    """The worst of |1 - s| r + |s| (1 - r) over all intervals of cells, and the bound of it."""
    exchanged = np.abs(own) + others
    share, all_work = (np.concatenate(([0.0], np.cumsum(row / row.sum()))) for row in (own, exchanged))
    s, r = (row[None, :] - row[:, None] for row in (share, all_work))
    worst = np.triu(np.abs(1 - s) * r + np.abs(s) * (1 - r)).max()
    return worst, turning_moment.spread_of(own.sum(), np.abs(own).sum(), np.abs(own).sum() / exchanged.sum())[1]


@pytest.mark.parametrize("lean", [0.3, 1.0, 4.0])
def test_a_balance_spreads_rounding_by_no_more_than_its_share_allows(lean):
    draw = np.random.default_rng(5)
    for _ in range(300):
        own = draw.normal(size=12) + draw.choice([-1.0, 1.0]) * lean
        worst, factor = spread_by_its_share(own, draw.exponential(size=12) ** draw.integers(1, 6))
        assert worst <= factor * (1 + 1e-12)


def test_the_worst_share_of_rounding_is_the_bound_itself():
    """A balance that does half of all the work evenly, against a load in one place: 3/4 of the cycle, without that."""
    worst, factor = spread_by_its_share(np.ones(12), 12.0 * (np.arange(12) == 11))
    assert worst == pytest.approx(factor) == pytest.approx(9 / 16)


@pytest.mark.parametrize("direction", [17, -43, 71, 109, -123, 155, -171])
@pytest.mark.parametrize("tilt", [89, 91])
def test_rounded_directions_of_a_weight_all_but_square_to_its_path_are_in_the_error_of_its_work(direction, tilt):
    """The yoke rises by 2 r, and its force is m g sin 1°: both directions are rounded, as if m g were."""
    bodies = {"crank": {"length": 0.375, "inertia": 1}, "yoke": {"mass": 60.5, "direction": f"{direction} deg"}}
    gravity = {"g": 9.75, "direction": f"{direction + tilt} deg"}
    result = sized(scenes.yoke(mechanism={"type": "scotch-yoke", **bodies}, gravity=gravity, load=[]))
    true = 60.5 * 9.75 * 0.75 * mpmath.sin(mpmath.pi / 180)
    off = abs(result.energy_fluctuation - true) / (2 * true)  # up and down again: the work exchanged
    assert off <= result.error.work <= 1e-13
    assert result.error.exact >= off


@pytest.mark.parametrize("inertia", [5.0, 200.0])
def test_an_error_of_the_irregularity_moves_extreme_speeds_by_their_own_error(inertia):
    """Their mean is the required one: the irregularity's error counts by half of it, and more at the slower speed."""
    machine = Machine(flywheel.load(scenes.press(flywheel={"inertia": inertia})))
    cycle, speed = turning_moment.balanced(machine), machine.scene.speed
    here, beside = (turning_moment.run(cycle, speed, inertia * (1.0 + share)) for share in (0.0, 1e-6))
    moved = abs(beside.speed_min / here.speed_min - 1.0)
    error = here._replace(error=abs(beside.irregularity / here.irregularity - 1.0)).error_about_mean
    assert moved <= error <= moved * (1.0 + 1e-3)


def test_extreme_speeds_confirmed_in_time_differ_by_their_error():
    """Stepped loosely, far less than the irregularity does, which is a small difference of theirs."""
    scene = flywheel.load(SECTION_C | {"flywheel": {"inertia": 200.0}})
    loose, tight = (flywheel.size(scene, rtol, accuracy=level) for rtol, level in ((1e-3, "audit"), (1e-12, "normal")))
    motion, true = loose.simulation, tight.simulation
    off = max(abs(motion.speed_max / true.speed_max - 1.0), abs(motion.speed_min / true.speed_min - 1.0))
    assert 1e-13 < off <= loose.error.extreme_speeds <= off + 1e-14
    assert loose.error.extreme_speeds < 0.1 * loose.error.simulation


@pytest.mark.parametrize("phase", [0.3, 1.0, 1.6, 2.9, 5.5])
@pytest.mark.parametrize("count", [2, 13])
def test_the_inertia_at_the_start_is_good_to_the_error_of_one_value(phase, count):
    """m r² sin² of the phase: interpolation counts on one cell, rounding on twelve, less than at the end of a series."""
    mechanism = {"type": "scotch-yoke", "crank": {"length": 0.375}, "yoke": {"mass": 60.5}, "phase": phase}
    scene = scenes.yoke(mechanism=mechanism)
    cycle, _ = coarsely(scene, np.linspace(0.0, 2 * pi, count))
    true = 60.5 * 0.375**2 * mpmath.sin(mpmath.mpf(phase)) ** 2
    assert abs(cycle.inertia_at_start - true) <= cycle.errors.start
    assert count == 2 or cycle.errors.start <= 0.5 * cycle.errors.inertias[0]


@pytest.mark.parametrize("inertia", [0.0, 5.0, 200.0])
def test_an_error_of_the_inertia_at_the_start_moves_figures_by_their_errors(inertia):
    scene = scenes.press(flywheel={"irregularity": 0.1}, inertia=[{"on": "crank", "value": 10.0}])
    machine, off = Machine(flywheel.load(scene)), 1e-6
    cycle, speed, eps = turning_moment.balanced(machine), machine.scene.speed, machine.scene.irregularity
    moved, doubtful = (
        cycle._replace(inertia_at_start=cycle.inertia_at_start + off),
        cycle._replace(errors=cycle.errors._replace(start=cycle.errors.start + off)),
    )
    runs = [turning_moment.run(each, speed, inertia) for each in (cycle, moved, doubtful)]
    apart = abs(runs[1].irregularity / runs[0].irregularity - 1.0)
    assert runs[2].error - runs[0].error == pytest.approx(apart, rel=1e-3)
    figures = [wittenbauer.figures_of(each, speed, eps) for each in (cycle, moved, doubtful)]
    exact = [each.total - each.cycle.inertia_at_start for each in figures]
    assert figures[2].error - figures[0].error == pytest.approx(abs(exact[1] - exact[0]), rel=1e-6)


def test_a_time_of_a_cycle_that_is_not_as_accurate_as_required_is_reported():
    """Near a stall the irregularity is almost exact, and the time of a cycle is not."""
    result = near_a_stall(99.999, simulate=False, rtol=1e-9)
    assert result.error.simulation < 1e-12 < 1e-9 < result.error.period
    assert not result.reached
    assert any("the time of a cycle is good to" in message for message in result.messages)


def coarsely(scene, edges):
    """The exact flywheel's figures on given cells."""
    machine = Machine(flywheel.load(scene))
    cycle = turning_moment.resolve(machine, edges)
    return cycle, wittenbauer.figures_of(cycle, machine.scene.speed, machine.scene.irregularity)


@pytest.mark.parametrize("middle", [1.6, 2.6, 4.7])
@pytest.mark.parametrize("balanced", [True, False])
def test_a_cell_without_an_extreme_hardly_counts_but_covers_its_error(middle, balanced):
    """A peak of the load in one of six cells: wherever it lies, the estimate covers what it adds."""
    peak = f"-20*exp(-((phi - {middle})/0.22)**2)"
    even = f"{20 * 0.22 * pi**0.5 / (2 * pi)}"
    load = [{"on": "crank", "torque": f"30*sin(phi)*(1 + 0.3*cos(phi)) {peak}" + ("" if balanced else f" + {even}")}]
    scene = scenes.rotor(load=load, drive={"torque": "balance" if balanced else 0}, accuracy={"closure": 1e-3})
    _, true = coarsely(scene, np.linspace(0.0, 2 * pi, 97))
    cycle, result = coarsely(scene, np.linspace(0.0, 2 * pi, 7))
    assert abs(result.total - true.total) <= result.error + true.error
    assert not balanced or result.error > 1e3 * true.error
    cell, ends = int(middle // (pi / 3)), (result.extremes.angle_greatest[1], result.extremes.angle_least[2])
    share = result.error * result.irregularity * result.speed**2 / cycle.errors.work
    assert share < 0.1 if all(cell != int(place // (pi / 3)) for place in ends) else not balanced or share > 0.9


def test_cells_in_which_extremes_may_lie_count_on_both_sides():
    """Errors of 1 J, 2 J ... in six cells, and by rounding: the greatest in the second, the least where the fourth ends."""
    mesh = piecewise.cells(np.arange(7.0))
    values = np.stack([mesh.phi - 3.0, 0 * mesh.phi, 1 + 0 * mesh.phi, 0 * mesh.phi, 0 * mesh.phi])
    cycle = turning_moment.assembled(mesh, values, None)
    parts, doubled, squares = np.zeros((7, 7)), np.cumsum(2.0 ** np.arange(6)), np.cumsum(100 * 4.0 ** np.arange(6))
    parts[0, 1:], parts[2, 1:], parts[4, 1:], parts[6, 1:] = doubled, 3 * doubled, squares, np.arange(1, 7) / 6
    cycle = cycle._replace(errors=cycle.errors._replace(work=1000.0, inside=np.zeros((2, 6)), left=np.zeros(2), parts=parts))
    extremes = turning_moment.combined(cycle, np.array([[1.0, 0.0]]))[0]
    extremes = extremes._replace(greatest_error=np.zeros(1), least_error=np.ones(1))
    extremes = extremes._replace(earliest=np.array([[1.3], [4.0]]), latest=np.array([[1.6], [4.0]]))
    between = 2 + 4 + 8 + np.sqrt((3 * (2 + 4 + 8)) ** 2 + 100 * (4 + 16 + 64))
    beyond = 1 + 2 + 16 + 32 + np.sqrt((3 * (1 + 2 + 16 + 32)) ** 2 + 100 * (1 + 4 + 256 + 1024))
    share = 3 / 6
    pair = [((0, 0), (0.0, 0.0))]
    assert turning_moment.errors_of_differences(cycle, extremes, pair)[0] == pytest.approx(
        (1 - share) * between + share * beyond + 1
    )
    same = extremes._replace(latest=np.array([[4.5], [4.0]]))  # both may lie in the same cells
    assert turning_moment.errors_of_differences(cycle, same, pair)[0] == pytest.approx(1001.0)


def test_the_exam_of_p103():
    slow = sized(scenes.yoke())
    assert slow.balance.value == pytest.approx(500 / np.pi, rel=1e-14)
    assert slow.flywheel.exact == pytest.approx(353.521427322012, rel=1e-13)
    assert slow.flywheel.approximate == pytest.approx(348.98939678, rel=1e-11)
    fast = sized(scenes.yoke(regime={"speed": 100}))
    assert fast.flywheel.exact == pytest.approx(60.6536269904903, rel=1e-13)
    assert fast.flywheel.approximate == pytest.approx(1.37775491456, rel=1e-11)


@pytest.mark.parametrize("rtol", [1e-3, 1e-12])
def test_rtol_is_kept_and_the_estimate_covers_the_error(rtol):
    result = sized(scenes.yoke(regime={"speed": 100}), rtol)
    error = abs(result.flywheel.exact / 60.653626990490335 - 1)
    assert error <= result.error.exact <= rtol
    assert result.reached


def test_varying_inertia_alone_needs_a_flywheel_that_areas_do_not_see():
    result = sized(scenes.yoke(load=[]))
    assert result.energy_fluctuation == pytest.approx(0, abs=1e-12)
    assert result.flywheel.approximate == 0.0
    eps, low, high = 0.04, 0.0, 5.0
    fast, slow = (1 + eps / 2) ** 2, (1 - eps / 2) ** 2
    assert result.flywheel.exact == pytest.approx((slow * high - fast * low) / (2 * eps), rel=1e-12)


# The resolved cycle, the speed with a given inertia, and how far angles and the period can be trusted.


def resolved(scene):
    machine = flywheel.Machine(flywheel.load(scene))
    return machine, turning_moment.resolve(machine, machine.mesh)


def test_the_work_of_the_yoke_is_the_closed_form():
    _, cycle = resolved(scenes.yoke())
    phi = np.linspace(0, np.pi, 50)
    work, variation = cycle.at(*piecewise.located(cycle.mesh, phi))
    assert_allclose(work, 500 / np.pi * phi - 500 * (1 - np.cos(phi)), atol=1e-11)
    assert_allclose(variation, 5 * np.sin(phi) ** 2, atol=1e-13)


def test_inertia_accumulated_from_its_slope_is_the_inertia():
    machine, cycle = resolved(scenes.press())
    phi = np.linspace(0, 2 * np.pi, 77)
    _, variation = cycle.at(*piecewise.located(cycle.mesh, phi))
    assert_allclose(cycle.inertia_at_start + variation, machine.reduce(phi).inertia, rtol=1e-11)


def test_run_puts_the_mean_of_extremes_at_the_speed_asked():
    _, cycle = resolved(scenes.press())
    for inertia in (20.0, 200.0, 2e6):
        run = turning_moment.run(cycle, 4 * np.pi, inertia)
        assert 0.5 * (run.speed_max + run.speed_min) == pytest.approx(4 * np.pi, rel=1e-14)


def test_tiny_irregularities_keep_their_digits():
    _, cycle = resolved(scenes.rotor())
    swing = 50 * np.pi
    for inertia in (1e3, 1e9, 1e14):
        run = turning_moment.run(cycle, 10 * np.pi, inertia)
        expected = swing / (inertia * (10 * np.pi) ** 2)
        assert run.irregularity == pytest.approx(expected, rel=1e-12)
        assert abs(run.irregularity / expected - 1) <= run.error


def test_speed_over_the_cycle_obeys_the_energy_balance():
    machine, cycle = resolved(scenes.press())
    run = turning_moment.run(cycle, 4 * np.pi, 50.0)
    phi = np.linspace(0, 2 * np.pi, 60)
    omega = turning_moment.speed_over_cycle(cycle, 4 * np.pi, run, phi)
    energy = 0.5 * (50.0 + machine.reduce(phi).inertia) * omega**2
    work, _ = cycle.at(*piecewise.located(cycle.mesh, phi))
    assert_allclose(energy - energy[0], work - work[0], atol=1e-9 * energy.max())
    alpha = turning_moment.acceleration_over_cycle(cycle, run, phi, omega)[1:-1]
    back, on = (turning_moment.speed_over_cycle(cycle, 4 * np.pi, run, phi[1:-1] + h) for h in (-1e-5, 1e-5))
    assert_allclose(alpha, (on**2 - back**2) / 4e-5, atol=1e-6 * np.abs(alpha).max())


def test_the_period_is_the_integral_of_one_over_speed():
    _machine, cycle = resolved(scenes.rotor())
    speed, inertia = 10 * np.pi, 0.3
    run = turning_moment.run(cycle, speed, inertia)
    period, error = turning_moment.period(cycle, speed, run, 1e-12)
    # constant torque on each half turn: the mean speed of each half is that of its ends
    expected = 2 * np.pi / (0.5 * (run.speed_max + run.speed_min))
    assert period == pytest.approx(expected, rel=1e-12)
    assert abs(period / expected - 1) <= error


def test_an_error_of_the_level_hides_none_of_the_irregularity_in_the_period():
    """A sized flywheel has four times that of the level in its irregularity's error, however slow the machine becomes."""
    _machine, cycle = resolved(scenes.rotor())
    run = turning_moment.run(cycle, 10 * np.pi, 0.3)
    level, own = 1e-9, 1e-10
    without, both = (
        turning_moment.period(cycle, 10 * np.pi, run._replace(level=level, error=4 * level + own * on), 1e-12)[1]
        for on in (0.0, 1.0)
    )
    assert both - without >= 0.99 * own * run.irregularity


def test_the_least_inertia_that_keeps_turning_has_irregularity_two():
    _, cycle = resolved(scenes.rotor())
    least = 50 * np.pi / (2 * (10 * np.pi) ** 2)
    assert turning_moment.run(cycle, 10 * np.pi, 1.0001 * least).irregularity == pytest.approx(2 / 1.0001, rel=1e-9)
    with pytest.raises(NoMotionError):
        turning_moment.run(cycle, 10 * np.pi, 0.9999 * least)


def near_a_stall(amplitude, **level):
    """A rotor of 1 kg m² under a sine at 10 rad/s: all is known in closed form, omega² = c - 2 A cos(phi)."""
    scene = {
        "load": [{"on": "crank", "torque": f"{amplitude}*sin(phi)"}],
        "drive": {"torque": "balance"},
        "regime": {"speed": 10},
        "flywheel": {"inertia": 1},
    }
    return flywheel.size(flywheel.load(scene), **level)


@pytest.mark.parametrize("amplitude", [50.0, 99.999])
def test_the_error_of_the_period_grows_towards_a_stall(amplitude):
    with mpmath.workdps(30):
        slow, fast = 10 - mpmath.mpf(amplitude) / 10, 10 + mpmath.mpf(amplitude) / 10
        true = 4 / fast * mpmath.ellipk(4 * mpmath.mpf(amplitude) / fast**2)
        result = near_a_stall(amplitude, simulate=False)
        assert abs(result.simulation.period / true - 1) <= result.error.period
        assert abs(result.simulation.speed_min / slow - 1) <= result.error.extreme_speeds
    assert result.error.period < (1e-8 if amplitude < 99.95 else 1e-5)


@pytest.mark.parametrize("accuracy", ["confirm", "audit"])
def test_a_confirmed_period_has_an_error_of_its_own(accuracy):
    result = near_a_stall(50.0, accuracy=accuracy)
    true = 4 / 15 * float(mpmath.ellipk(200 / 225))
    assert abs(result.simulation.period / true - 1) <= result.error.period <= result.error.simulation


ROTOR: dict[str, Any] = {"inertia": [{"on": "crank", "value": 2.0}], "regime": {"speed": 10.0}}


def sized_moment(scene: dict[str, Any]) -> Any:
    return flywheel.size(flywheel.load(scene), simulate=False)


def test_a_sine_crosses_zero_at_half_a_turn() -> None:
    load = [{"on": "crank", "torque": "100*sin(phi)"}]
    result = sized_moment({**ROTOR, "load": load, "drive": {"torque": "balance"}, "flywheel": {"irregularity": 0.1}})
    assert 0.0 < result.error.angles < 1e-12
    assert abs(result.areas[0].end - pi) <= result.error.angles
    assert abs(result.angle_speed_max - pi) <= result.error.extremes


def test_a_jump_through_zero_is_known_to_rounding() -> None:
    load = [{"on": "crank", "torque": -100.0, "from": 1.0, "to": 2.0}]
    result = sized_moment({**ROTOR, "load": load, "drive": {"torque": "balance"}, "flywheel": {"irregularity": 0.1}})
    assert result.angle_speed_max == 1.0
    assert result.angle_speed_min == 2.0
    assert result.error.extremes < 1e-14


def test_speeds_that_are_not_known_leave_angles_open() -> None:
    """A given flywheel's extremes depend on the speed; the error of that is in theirs."""
    scene = {
        "mechanism": {"type": "slider-crank", "crank": {"length": 0.2}, "rod": {"length": 0.7}, "slider": {"mass": 30}},
        "load": [{"on": "slider", "force": "-500*sign(v)"}],
        "drive": {"torque": "balance"},
        "regime": {"speed": 20.0},
        "flywheel": {"inertia": 1.5},
    }
    loose, tight = (sized_moment({**scene, "accuracy": {"rtol": rtol}}) for rtol in (1e-3, 1e-13))
    for key in ("angle_speed_max", "angle_speed_min"):
        assert abs(getattr(loose, key) - getattr(tight, key)) <= loose.error.extremes + tight.error.extremes
    assert tight.error.extremes < 1e-9


@pytest.mark.parametrize("steep", [0.05, 60.0])
def test_a_speed_that_has_settled_has_no_angle(steep: float) -> None:
    """Strongly damped, the speed settles between loads: where it is least is anyone's guess, and the estimate says so."""
    scene = {
        "load": [{"on": "crank", "torque": 5.0, "from": 0.6, "to": 0.62}, {"on": "crank", "torque": -2.5}],
        "inertia": [{"on": "crank", "value": 3.0}],
        "drive": {"torque": f"{2.5 + 14.0 * steep} - {33.0 * steep}*omega"},
        "flywheel": {"inertia": 0.1},
        "accuracy": {"rtol": 1e-10},
    }
    result = sized_moment(scene)
    assert abs(result.angle_speed_max - 0.62) <= max(1e-12, result.error.extremes)
    assert (result.error.extremes > 1.0) == (steep > 10.0)
    assert result.error.angles < 1e-12


# The machine at a constant speed: where its net work is zero, what keeps it from that, and the cycle there.


WHEEL = {"flywheel": {"inertia": 2}}


def moments_of(scene):
    machine = Machine(flywheel.load(scene))
    return Moments(machine, piecewise.cells(machine.mesh))


def speeds(scene):
    return constant_speed.steady_speeds(moments_of(WHEEL | scene))


def loaded(torque, drive):
    return {"load": [{"on": "crank", "torque": torque}], "drive": {"torque": drive}}


@settings(max_examples=8, deadline=None)
@given(st.floats(1e-3, 1e3), st.floats(1e-3, 1e3), st.floats(0.01, 0.99))
def test_a_straight_line_meets_the_mean_load(start, slope, share):
    ((speed, stable),) = speeds(loaded(f"{-2 * share * start!r}*(phi < pi)", f"{start!r} - {slope!r}*omega"))
    assert stable
    assert speed == pytest.approx((1 - share) * start / slope, rel=1e-12)


@pytest.mark.parametrize("share", [0.1, 0.99, 1 - 1e-12])
def test_an_induction_motor_meets_a_load_twice(share):
    """The slips of 2 Tb s sb/(s² + sb²) = M are sb (Tb/M ± sqrt(Tb²/M² - 1))."""
    break_down, sb, top = 596.4, 0.1916, 50 * np.pi / 12
    scene = {key: regimes.TWO_SPEEDS[key] for key in ("parameters", "shafts", "drive")}
    result = speeds(scene | {"load": [{"on": "crank", "torque": -share * break_down}]})
    slips = sb * (1 / share + np.array([1, -1]) * np.sqrt(1 / share**2 - 1))
    true = top * (1 - slips)
    within = true > 0
    assert [stable for _, stable in result] == [
        stable for stable, inside in zip([False, True], within, strict=True) if inside
    ]
    close = 1e-12 if share < 0.999 else 1e-6 if share < 1 - 1e-9 else 2e-3  # two roots that near are told apart no better
    assert_allclose([speed for speed, _ in result], true[within], rtol=close)


@pytest.mark.parametrize("gap", [0.2, 1e-4])
def test_humps_that_reach_across_between_the_speeds_looked_at(gap):
    top = 7.7
    result = speeds(loaded("-1", f"1 + (omega - {top - gap})*({top + gap} - omega)"))
    assert_allclose([speed for speed, _ in result], [top - gap, top + gap], rtol=1e-12 / gap)
    assert [stable for _, stable in result] == [False, True]
    assert not speeds(loaded("-1", f"1 - (omega - {top})**2 - {gap}"))


def test_stretches_where_nothing_changes_are_not_searched(monkeypatch):
    """A governor's full torque, a fan's at low speed: no hump worth a search."""
    searched = []
    summit = constant_speed.summit
    monkeypatch.setattr(constant_speed, "summit", lambda *a, **b: searched.append(a) or summit(*a, **b))
    for name in ("governor", "engine"):
        ((speed, stable),) = constant_speed.steady_speeds(moments_of(regimes.scene(name, inertia=0.3)))
        assert stable
        assert speed == pytest.approx(float(regimes.figures(name)["constant"]["speed"]), rel=1e-12)
    assert not searched


@pytest.mark.parametrize("power", ["1 kW", "4 kW"])
def test_losses_in_meshes_are_left_out_only_where_a_cycle_loses_without_them(power):
    scene = flywheel.load("examples/drive_lines/press.toml").with_({"drive.motor.power": power})
    machine = Machine(scene)
    moments = Moments(machine, piecewise.cells(machine.mesh))
    speeds = np.geomspace(1e-3, 1e3, 241)
    works, quick = (constant_speed.net_works(moments, speeds, losing=losing) for losing in (True, False))
    gains = np.array([float(moments.net_work(speed, losses=False)) for speed in speeds.tolist()]) > 0.0
    beside = gains | np.append(gains[1:], False) | np.append(False, gains[:-1])
    assert gains.any()
    assert_allclose(quick[beside], works[beside], rtol=1e-12, atol=1e-9)
    assert (quick >= works - 1e-9).all()
    assert (np.sign(quick) == np.sign(works)).all()
    assert not np.allclose(quick, works)


@pytest.mark.parametrize("name", [n for n in regimes.CASES if "constant" in regimes.figures(n) and "slow" not in n])
def test_the_cycle_at_constant_speed_is_that_of_the_references(name):
    """Accumulated work and net work of torques at that speed, each to rounding of the work exchanged."""
    true = regimes.figures(name)["constant"]
    machine = Machine(flywheel.load(regimes.scene(name, inertia=0.3)))
    if machine.scene.unknown is None and name != "unstable":
        result, _ = constant_speed.operating_point(machine)
        assert result == pytest.approx(float(true["speed"]), rel=1e-11)
    cycle = constant_speed.resolve(machine, machine.mesh, float(true["speed"]))
    exchanged = float(true["work_exchanged"])
    assert abs(cycle.net) < 1e-8 * exchanged
    if true["balance"] is not None:
        assert cycle.balance == pytest.approx(float(true["balance"]), rel=1e-7)
    swing = [float(true["accumulated_max"]), float(true["accumulated_min"])]
    works = np.concatenate((cycle.start[0], cycle.at(*_inner(cycle))[0]))
    assert works.max() <= swing[0] + 1e-8 * exchanged
    assert works.min() >= swing[1] - 1e-8 * exchanged


def _inner(cycle):
    cells = np.repeat(np.arange(len(cycle.mesh.half)), 9)
    return cells, np.tile(np.linspace(-1, 1, 9), len(cycle.mesh.half))


def test_a_law_that_switches_at_a_speed_breaks_its_cells_there():
    """Drag past 1.2 m/s alone: the speed of zero net work, by quadrature split where the drag sets in."""
    scene = WHEEL | {
        "mechanism": {"type": "scotch-yoke", "crank": {"length": 0.3, "inertia": 0.5}, "yoke": {"mass": 20}},
        "load": [{"on": "yoke", "force": "-400*max(0, abs(v) - 1.2)*sign(v)"}],
        "drive": {"torque": "160 - 12*omega"},
    }

    def net(w):
        edge = np.arcsin(min(1.2 / (0.3 * w), 1))
        drag = quad(lambda p: 400 * (0.3 * np.sin(p) * w - 1.2) * 0.3 * np.sin(p), edge, np.pi / 2)[0]
        return (160 - 12 * w) * np.pi / 2 - drag

    true = brentq(net, 5, 13, xtol=1e-14)
    machine = Machine(flywheel.load(scene))
    speed, _ = constant_speed.operating_point(machine)
    assert speed == pytest.approx(true, rel=1e-13)
    cycle = constant_speed.resolve(machine, machine.mesh, speed)
    assert abs(cycle.net) < 1e-13 * cycle.exchanged
    edge = np.arcsin(4 / true)
    for angle in (edge, np.pi - edge, np.pi + edge, 2 * np.pi - edge):
        assert np.abs(cycle.mesh.edges - angle).min() < 1e-9


def test_losses_break_cells_where_a_mesh_changes_the_side_that_drives():
    scene = regimes.scene("geared-loss", inertia=0.05)
    scene["load"] = [*scene["load"], {"on": "motor", "torque": "20*sin(phi) - 3"}]
    machine = Machine(flywheel.load(scene))
    cycle = constant_speed.resolve(machine, machine.mesh, 13.0)
    unknown = cycle.balance
    assert abs(cycle.net) < 1e-13 * cycle.exchanged
    # tau = -8 (T - 3 + 20 sin phi) at constant speed, as the motor's shaft has no varying inertia
    angle = np.arcsin((3 - unknown) / 20)
    assert np.abs(cycle.mesh.edges - (np.pi - angle)).min() < 1e-9


def test_a_balance_is_linear_but_for_losses():
    moments = moments_of(regimes.scene("pump", inertia=5))
    for speed in (6.0, 12.0):
        unknown = constant_speed.balance_at(moments, speed)
        assert abs(float(moments.net_work(speed, unknown))) < 1e-11 * abs(2 * np.pi * unknown)
    lossy = moments_of(regimes.scene("geared-loss", inertia=0.05))
    unknown = constant_speed.balance_at(lossy, 13.0)
    assert abs(float(lossy.net_work(13.0, unknown))) < 1e-11 * 16 * np.pi * unknown


def test_a_balance_without_effect_is_named():
    scene = regimes.scene("pump", inertia=5)
    scene["parameters"], scene["drive"] = {"F": "balance"}, {"torque": 20}
    scene["load"] = [{"on": "slider", "force": "F"}]
    with pytest.raises(SceneError, match="does no net work"):
        constant_speed.balance_at(moments_of(scene), 10.0)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("runaway", "no steady speed: at every speed a cycle has net work left over (125.66"),
        ("stalled", "a drive that cannot carry the mean load: at best, at 10.58"),
        ("starved", "a drive that cannot carry the mean load: at best, at standstill, a cycle lacks 31.4159 J"),
    ],
)
def test_why_there_is_no_speed_is_named(name, words):
    with pytest.raises(SceneError) as caught:
        constant_speed.operating_point(Machine(flywheel.load(regimes.BAD[name].scene)))
    (fault,) = caught.value.faults
    assert fault.path == "drive"
    assert words in str(fault)


def test_an_unstable_speed_is_named():
    with pytest.raises(SceneError, match=r"drive: found an unstable regime: near 18\.75 rad/s"):
        constant_speed.operating_point(Machine(flywheel.load(regimes.scene("unstable", inertia=3))))


def test_of_several_speeds_the_greatest_stable_one_is_taken_and_all_are_told():
    speed, (message,) = constant_speed.chosen_speed(moments_of(regimes.scene("two-speeds-fast", inertia=0.5)))
    assert speed == pytest.approx(float(regimes.figures("two-speeds-fast")["constant"]["speed"]), rel=1e-13)
    assert "6.57677 rad/s (unstable), 12.1242 rad/s (stable)" in message


@pytest.mark.parametrize(("slope", "load"), [(1e4, 1e-3), (1e5, 1e-2)])
def test_the_last_digits_of_the_speed_are_in_the_error_of_work_under_a_stiff_motor(slope, load):
    """Torques slope (20 - omega) and -load (1 + sin phi): at the constant speed their energy fluctuates by 2 load."""
    torques = {
        "load": [{"on": "crank", "torque": f"-{load} - {load}*sin(phi)"}],
        "drive": {"torque": f"{slope}*(20 - omega)"},
    }
    result = flywheel.size(flywheel.load({**torques, "flywheel": {"inertia": 1.0}}), simulate=False)
    true = abs(result.as_dict()["energy_fluctuation"] / (2 * load) - 1)
    assert true <= result.error.work < 1e-6


KEYS = {
    "title", "reduction", "cycle", "speed", "speed_asked", "irregularity", "balance", "power", "areas",
    "accumulated_max", "accumulated_min", "energy_fluctuation", "coefficient_of_energy", "angle_speed_max",
    "angle_speed_min", "reduced_inertia", "flywheel", "simulation", "error",
}  # fmt: skip
FLYWHEEL = {"on", "inertia", "exact", "approximate", "approximate_total", "inertia_torque",
    "inertia_torque_flywheel", "needed", "limits", "binding", "broken"}  # fmt: skip
SIMULATION = {"irregularity", "irregularity_approximate", "speed_max", "speed_min", "speed_time_mean", "period"}


@pytest.mark.parametrize("make", sample([scenes.rotor, scenes.press], 2))
def test_every_key_of_the_contract_is_there(make):
    result = flywheel.size(flywheel.load(make())).as_dict()
    assert set(result) >= KEYS
    assert set(result["flywheel"]) == FLYWHEEL
    assert set(result["simulation"]) >= SIMULATION
    assert set(result["reduced_inertia"]) == {"min", "max", "mean"}
    assert set(result["error"]) >= {"exact", "simulation"}
    assert all(set(area) == {"from", "to", "work", "accumulated"} for area in result["areas"])
    assert json.loads(json.dumps(result)) == result


def test_keys_of_regimes_power_and_shafts():
    scene = SECTION_C | {"shafts": {"fast": {"ratio": 3}}, "flywheel": {"on": "fast", "irregularity": 0.05}}
    sizing = flywheel.size(flywheel.load(scene), simulate=False)
    result = sizing.as_dict()
    assert json.loads(json.dumps(result)) == result
    assert result["constant_speed"] == pytest.approx(10 / 2.387, rel=1e-12)
    assert 0 < result["multiplier"] < 1
    assert result["speed_asked"] is None
    assert result["gd2"] == 4 * result["flywheel"]["exact"]
    crank, fast = result["shafts"]
    assert (crank["shaft"], fast["shaft"]) == ("crank", "fast")
    assert fast["inertia"] == pytest.approx(result["flywheel"]["exact"], rel=1e-15)
    assert crank["inertia"] == pytest.approx(9 * fast["inertia"], rel=1e-14)
    assert crank["energy"] == pytest.approx(fast["energy"], rel=1e-14)
    assert fast["speed"] == 3 * result["speed"]
    assert (result["energy"]["mean_power"], result["energy"]["peak_to_mean"]) == (0.0, None)
    assert result["wheel"] is None


def test_what_is_null_where():
    sizing = flywheel.size(flywheel.load(scenes.yoke()), simulate=False).as_dict()
    assert sizing["simulation"] is None
    assert sizing["error"]["simulation"] is None
    inputs = flywheel.size(flywheel.load(scenes.yoke(flywheel={"inertia": 300})), simulate=False).as_dict()
    assert inputs["irregularity"] is None
    assert {key for key, value in inputs["flywheel"].items() if value is None} == FLYWHEEL - {"on", "inertia"}
    assert inputs["simulation"]["irregularity"] > 0
    coasting = flywheel.load(scenes.rotor(drive={"torque": 0}, load=[], inertia=[{"on": "crank", "value": 1}]))
    assert flywheel.size(coasting).as_dict()["coefficient_of_energy"] is None
    nothing = scenes.rotor(load=[])
    del nothing["drive"]
    assert flywheel.size(flywheel.load(nothing)).as_dict()["power"] is None


def test_areas_leave_the_machine_null():
    scene = {"areas": {"values": [5, -5]}, "regime": {"speed": 3}, "flywheel": {"irregularity": 0.1}}
    result = flywheel.size(flywheel.load(scene)).as_dict()
    for key in ("cycle", "power", "balance", "simulation", "coefficient_of_energy", "angle_speed_max"):
        assert result[key] is None
    assert result["areas"][0]["from"] is None
    assert set(result["reduced_inertia"].values()) == {None}
    assert result["flywheel"]["exact"] == result["flywheel"]["approximate"] == result["flywheel"]["approximate_total"]


PHI = np.linspace(0, 6, 13)


def test_parts_add_up_to_the_whole():
    state = flywheel.reduce(flywheel.load(scenes.press()), PHI)
    assert_allclose(sum(state.inertia_parts.values()), state.inertia, rtol=1e-13)
    assert_allclose(sum(state.moment_parts.values()), state.moment, rtol=1e-12, atol=1e-9)


def test_the_balance_is_solved_for_unless_given():
    scene = flywheel.load(scenes.yoke())
    solved, inputs = flywheel.reduce(scene, [4.0]), flywheel.reduce(scene, [4.0], balance=100.0)
    assert_allclose(solved.moment, 500 / np.pi)
    assert_allclose(inputs.moment, 100.0)


def test_influence_coefficients_have_their_slopes():
    scene = flywheel.load(scenes.shaper())
    step = 1e-6
    state = flywheel.reduce(scene, PHI)
    higher, lower = (flywheel.reduce(scene, PHI + d) for d in (step, -step))
    for name, gain in state.gains.items():
        slope = (higher.gains[name] - lower.gains[name]) / (2 * step)
        inside = PHI > 0.01
        assert_allclose(state.gain_slopes[name][inside], slope[inside], atol=1e-8)
        assert gain.shape == PHI.shape


def test_ports_that_carry_nothing_have_their_coefficients_too():
    bare = {"type": "slider-crank", "crank": {"length": 0.1}, "rod": {"length": 0.3}}
    scene = flywheel.load({"mechanism": bare, "regime": {"speed": 1}, "flywheel": {"inertia": 1}})
    state = flywheel.reduce(scene, [np.pi / 2])
    assert_allclose(state.gains["slider-crank.slider"], -0.1)
    assert_allclose(state.gains["slider-crank.rod"], 0.0, atol=1e-16)
    assert_allclose(state.inertia, 0.0)


# -- torques that depend on speed ----------------------------------------------------------------------------------------


def test_the_moment_at_a_speed_holds_loads_dampers_and_the_drive():
    scene = flywheel.load(regimes.scene("yoke", inertia=3))
    state = flywheel.reduce(scene, PHI, speed=8.0)
    gain = -0.3 * np.sin(PHI)
    load = np.where(gain < 0, gain * (-200 - 30 * gain * 8 * np.abs(gain * 8)), 0.0)
    assert_allclose(state.moment, 160 - 12 * 8 - 150 * gain**2 * 8 + load, rtol=1e-12, atol=1e-12)
    assert_allclose(sum(state.moment_parts.values()), state.moment, rtol=1e-12, atol=1e-12)
    assert set(state.moment_parts) == {"drive", "load[0] on scotch-yoke.yoke", "damper[0] on scotch-yoke.yoke"}
    faster = flywheel.reduce(scene, PHI, speed=9.0)
    assert_allclose(faster.inertia, state.inertia)
    assert (faster.moment < state.moment).all()


def test_without_a_speed_it_is_the_one_asked_for_or_that_of_zero_net_work():
    scene = flywheel.load(regimes.scene("pump", inertia=5))
    request = flywheel.reduce(scene, PHI)
    inputs = flywheel.reduce(scene, PHI, speed=4 * np.pi)
    balance = float(regimes.figures("pump")["constant"]["balance"])
    assert_allclose(request.moment, inputs.moment)
    assert_allclose(request.moment_parts["drive"], balance, rtol=1e-9)
    free = flywheel.reduce(flywheel.load(regimes.scene("section-c", inertia=0)), PHI)
    assert_allclose(
        free.moment_parts["drive"], 10 - 2.387 * float(regimes.figures("section-c")["constant"]["speed"]), atol=1e-14
    )


def test_a_branch_that_a_velocity_decides_is_taken_where_the_machine_stands():
    """Drag past 1.2 m/s: at 8 rad/s none of it within 30 deg of the dead centre."""
    load = [{"on": "yoke", "force": "-400*max(0, abs(v) - 1.2)*sign(v)"}]
    scene = flywheel.load(regimes.scene("yoke", inertia=3) | {"load": load, "damper": []})
    phi = np.array([0.1, np.pi / 6 - 1e-9, np.pi / 6 + 1e-3, 1.0, 3.0, 4.0])
    velocity = -0.3 * np.sin(phi) * 8
    force = -400 * np.maximum(0, np.abs(velocity) - 1.2) * np.sign(velocity)
    state = flywheel.reduce(scene, phi, speed=8.0)
    assert_allclose(state.moment_parts["load[0] on scotch-yoke.yoke"], force * -0.3 * np.sin(phi), rtol=1e-11, atol=1e-11)


def test_losses_in_meshes_are_no_part_of_the_moment():
    scene = regimes.scene("geared-loss", inertia=0.05)
    plain = scene | {"shafts": {"motor": {"ratio": 8}}}
    states = [flywheel.reduce(flywheel.load(each), PHI, balance=15.0) for each in (scene, plain)]
    assert_allclose(states[0].moment, states[1].moment, rtol=1e-13)
    assert_allclose(states[0].inertia, states[1].inertia, rtol=1e-13)


@pytest.mark.parametrize("asked", [{"irregularity": 0.01}, {"inertia": 20.0}], ids=["sized", "given"])
def test_work_left_over_is_an_error_of_angles_and_of_the_motion(asked):
    """M* = -100 sin(phi) + N/(2 pi): beside its extremes W falls by 50 d² (d in rad), and N may lie anywhere."""
    left, swing = 1.0, 200.0
    drive, load = {"torque": 100 + left / (2 * pi)}, [{"on": "crank", "torque": "-100*(1 + sin(phi))"}]
    result = sized(scenes.rotor(drive=drive, load=load, flywheel=asked, accuracy={"closure": 0.01}))
    errors = result.errors
    assert (2 * left / 100) ** 0.5 <= errors["angles"] <= 0.2
    for name in ("angle_speed_max", "angle_speed_min"):  # energies are off by 2 N where the inertia is constant
        assert (4 * left / 100) ** 0.5 <= errors[name] <= 0.3
    wheels = ("exact", "approximate", "inertia_torque", "inertia_torque_flywheel")
    for name in wheels if "irregularity" in asked else ("simulation",):
        assert 0.99 * left / swing <= errors[name] <= 1.5 * left / swing
    assert 0.99 * result.closure <= errors["work"] <= 1.5 * result.closure
