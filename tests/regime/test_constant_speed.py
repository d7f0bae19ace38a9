"""The machine at a constant speed: where its net work is zero, what keeps it from that, and the cycle there."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.integrate import quad
from scipy.optimize import brentq

import flywheel
from flywheel.machine.dynamics import Moments
from flywheel.machine.machine import Machine
from flywheel.numerics import cells as piecewise
from flywheel.numerics.faults import SceneError
from flywheel.regime import constant_speed
from tests import regimes

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
    (found,) = speeds(loaded(f"{-2 * share * start!r}*(phi < pi)", f"{start!r} - {slope!r}*omega"))
    assert found.stable
    assert found.speed == pytest.approx((1 - share) * start / slope, rel=1e-12)


@pytest.mark.parametrize("share", [0.1, 0.99, 1 - 1e-12])
def test_an_induction_motor_meets_a_load_twice(share):
    """The slips of 2 Tb s sb/(s² + sb²) = M are sb (Tb/M ± sqrt(Tb²/M² - 1))."""
    break_down, sb, top = 596.4, 0.1916, 50 * np.pi / 12
    scene = {key: regimes.TWO_SPEEDS[key] for key in ("parameters", "shafts", "drive")}
    found = speeds(scene | {"load": [{"on": "crank", "torque": -share * break_down}]})
    slips = sb * (1 / share + np.array([1, -1]) * np.sqrt(1 / share**2 - 1))
    true = top * (1 - slips)
    within = true > 0
    assert [item.stable for item in found] == [
        stable for stable, inside in zip([False, True], within, strict=True) if inside
    ]
    close = 1e-12 if share < 0.999 else 1e-6 if share < 1 - 1e-9 else 2e-3  # two roots that near are told apart no better
    assert_allclose([item.speed for item in found], true[within], rtol=close)


@pytest.mark.parametrize("gap", [0.2, 1e-4])
def test_humps_that_reach_across_between_the_speeds_looked_at(gap):
    top = 7.7
    found = speeds(loaded("-1", f"1 + (omega - {top - gap})*({top + gap} - omega)"))
    assert_allclose([item.speed for item in found], [top - gap, top + gap], rtol=1e-12 / gap)
    assert [item.stable for item in found] == [False, True]
    assert not speeds(loaded("-1", f"1 - (omega - {top})**2 - {gap}"))


def test_stretches_where_nothing_changes_are_not_searched(monkeypatch):
    """A governor's full torque, a fan's at low speed: no hump worth a search."""
    searched = []
    summit = constant_speed._summit
    monkeypatch.setattr(constant_speed, "_summit", lambda *a: searched.append(a) or summit(*a))
    for name in ("governor", "engine"):
        (found,) = constant_speed.steady_speeds(moments_of(regimes.scene(name, inertia=0.3)))
        assert found.stable
        assert found.speed == pytest.approx(float(regimes.figures(name)["constant"]["speed"]), rel=1e-12)
    assert not searched


@pytest.mark.parametrize("name", [n for n in regimes.CASES if "constant" in regimes.figures(n) and "slow" not in n])
def test_the_cycle_at_constant_speed_is_that_of_the_references(name):
    """Accumulated work and net work of torques at that speed, each to rounding of the work exchanged."""
    true = regimes.figures(name)["constant"]
    machine = Machine(flywheel.load(regimes.scene(name, inertia=0.3)))
    if machine.scene.unknown is None and name != "unstable":
        found, _ = constant_speed.operating_point(machine)
        assert found == pytest.approx(float(true["speed"]), rel=1e-11)
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
    found = flywheel.size(flywheel.load({**torques, "flywheel": {"inertia": 1.0}}), simulate=False)
    true = abs(found.as_dict()["energy_fluctuation"] / (2 * load) - 1)
    assert true <= found.error.work < 1e-6
