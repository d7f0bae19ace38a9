"""Moments at any speed, flywheel, balance and current: their slopes, losses in meshes, and a constant speed."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import flywheel
from flywheel.machine.dynamics import Dynamics, Moments
from flywheel.machine.machine import Machine
from flywheel.numerics import cells
from tests import regimes

STEP = 1e-6
# name, a speed at which it runs, a value of the balance, a current
KINDS = {
    "section-c": (4.2, 0.0, None),
    "kloss-press": (12.0, 0.0, None),
    "pump": (12.6, 50.0, None),
    "four-bar": (15.0, 0.0, None),
    "two-mechanisms": (14.0, 60.0, None),
    "law": (17.0, 0.0, None),
    "brake": (125.0, 0.1, None),
    "geared-loss": (13.6, 15.0, None),
    "geared-loss-line": (12.5, 0.0, None),
    "dc-inductance": (13.5, 0.0, 11.0),
}


def moments_of(scene):
    machine = Machine(flywheel.load(scene))
    return Moments(machine, cells.cells(machine.mesh))


def case(name):
    """Moments with a speed that varies over the cycle, a balance, a flywheel on the crank, and a current."""
    scene = regimes.scene(name, inertia=0.5)
    if name == "dc-inductance":
        scene["drive"] = scene["drive"] | {"motor": scene["drive"]["motor"] | {"friction": 0.01}}
    moments = moments_of(scene)
    speed, unknown, current = KINDS[name]
    phi = moments.mesh.phi
    omega = speed * (1 + 0.05 * np.sin(phi) - 0.03 * np.cos(2 * phi))
    return moments, omega, unknown, 2.5, None if current is None else current * (1 + 0.1 * np.cos(phi))


@pytest.mark.parametrize("name", KINDS)
def test_slopes_are_those_of_the_moment(name):
    moments, omega, unknown, inertia, current = case(name)
    found = moments.rate(omega, unknown, inertia, current)

    def slope(*changed):
        more, less = (moments.rate(*(a if b is None else a + s * b for a, b in changed)).moment for s in (1, -1))
        return (more - less) / (2 * STEP)

    one = STEP * np.ones_like(omega)
    state = [omega, unknown, inertia, current]
    sizes = [found.by_speed, found.by_unknown, found.by_inertia, found.by_current]
    for k, analytic in enumerate(sizes):
        if state[k] is None:
            assert not analytic.any()
            continue
        changed = [(value, (one if np.ndim(value) else STEP) if j == k else None) for j, value in enumerate(state)]
        numeric = slope(*changed)
        assert_allclose(analytic, numeric, rtol=1e-6, atol=1e-6 * np.abs(found.moment).max())
        assert k != 0 or np.abs(analytic).max() > 0


@pytest.mark.parametrize("name", KINDS)
def test_the_moment_is_that_of_time_stepping(name):
    moments, omega, unknown, inertia, current = case(name)
    found = moments.rate(omega, unknown, inertia, current)
    dynamics = Dynamics(moments.machine, inertia, unknown)
    middle = cells.MIDDLE  # where the directions of meshes are decided
    for k in range(0, len(omega), 2):
        phi, anchor = float(moments.mesh.phi[k, middle]), float(moments.mesh.anchor[k, 0])
        now = 0.0 if current is None else float(current[k, middle])
        at = dynamics.at(phi, anchor, float(omega[k, middle]), current=now)
        assert at.moment == pytest.approx(found.moment[k, middle], rel=1e-12, abs=1e-10)
        energy = at.inertia * at.acceleration + 0.5 * moments.slope[k, middle] * omega[k, middle] ** 2
        assert energy == pytest.approx(found.moment[k, middle], rel=1e-11, abs=1e-9)


@pytest.mark.parametrize("efficiency", [0.95, 0.6])
def test_what_a_mesh_loses_is_its_share_of_what_it_transmits(efficiency):
    scene = regimes.scene("geared-loss", inertia=0.05)
    scene["shafts"] = {"motor": {"ratio": 8, "efficiency": efficiency}}
    moments, plain = moments_of(scene), moments_of(scene | {"shafts": {"motor": {"ratio": 8}}})
    omega = 13.6 * (1 + 0.05 * np.sin(moments.mesh.phi))
    (tau,) = moments.transmitted(omega, 15.0, 3.2)
    middle = slice(cells.MIDDLE, cells.MIDDLE + 1)
    lost = np.where(tau[:, middle] > 0, (1 / efficiency - 1) * tau, (efficiency - 1) * tau)
    assert (lost[:, middle] >= 0).all()
    assert {True, False} == set((tau[:, middle] > 0).ravel().tolist())  # it changes sides within the cycle
    gap = plain.rate(omega, 15.0, 3.2).moment - moments.rate(omega, 15.0, 3.2).moment
    assert_allclose(gap, lost, rtol=1e-11, atol=1e-10)
    # tau = I_s alpha + ½ I_s' omega² - M_s of all behind the mesh, alpha that of the whole machine
    alpha = (moments.rate(omega, 15.0, 3.2).moment - 0.5 * moments.slope * omega**2) / (3.2 + moments.inertia)
    assert_allclose(tau, (3.2 + 64 * 0.01) * alpha - 8 * 15.0, rtol=1e-10)


def test_a_mesh_without_loss_is_no_mesh():
    scene = regimes.scene("geared-loss", inertia=0.05)
    plain = moments_of(scene | {"shafts": {"motor": {"ratio": 8, "efficiency": 1}}})
    assert (plain.lossy, len(plain.parts)) == (False, 1)
    assert moments_of(scene).lossy


def test_speeds_may_be_many_at_once():
    for name in ("kloss-press", "geared-loss-line", "dc-inductance"):
        moments = moments_of(regimes.scene(name, inertia=0.5))
        speeds = np.array([3.0, 8.0, 13.0])
        every = moments.constant(speeds, 0.0)
        for k, speed in enumerate(speeds.tolist()):
            for all_of_them, one in zip(every, moments.constant(speed, 0.0), strict=True):
                assert_allclose(all_of_them[k], one, rtol=1e-14)


def test_at_a_constant_speed_nothing_is_accelerated():
    moments = moments_of(regimes.scene("geared-loss", inertia=0.05))
    found, speed, phi = moments.constant(13.0, 15.0), 13.0, moments.mesh.phi
    # the motor's shaft carries the drive alone: 120 N m at the crank drives it through the mesh at 0.9
    plain = moments.machine.reduction.moments(phi, moments.mesh.anchor, 15.0)
    others = sum(value for name, value in plain.items() if name != "drive")
    assert_allclose(found.moment, others + 0.9 * 8 * 15.0, rtol=1e-13)
    assert_allclose(found.by_unknown, 0.9 * 8)
    (tau,) = moments.constant_losses(speed, 15.0)
    assert_allclose(tau, -8 * 15.0)


def test_a_steady_current_is_that_of_the_line():
    moments = moments_of(regimes.scene("dc-inductance", inertia=0.1))
    assert_allclose(moments.steady_current(np.array([0.0, 10.0])), [220 / 0.8, (220 - 1.5 * 100) / 0.8])
    found = (
        moments.constant(10.0, 0.0).moment
        - moments.machine.reduction.moments(moments.mesh.phi, moments.mesh.anchor)["load[0] on slider-crank.slider"]
    )
    assert_allclose(found, 10 * 1.5 * (220 - 150) / 0.8, rtol=1e-12)


@pytest.mark.parametrize(("name", "torque"), [("section-c", lambda w: 10 - 2.387 * w), ("pump", lambda w: 50 + 0 * w)])
def test_the_drives_share_is_its_own_torque(name, torque):
    moments, omega, unknown, _, current = case(name)
    assert_allclose(moments.drive(omega, unknown, current), torque(omega), rtol=1e-14)


def test_the_drives_share_is_taken_to_the_crank():
    moments, omega, unknown, _, current = case("dc-inductance")
    torque = 1.5 * current - 0.01 * 10 * omega
    assert_allclose(moments.drive(omega, unknown, current), 10 * torque, rtol=1e-13)


def test_switches_are_what_decides_branches_at_a_speed():
    moments = moments_of(regimes.scene("governor", inertia=0.5))
    omega = 13.0 + 0.5 * np.sin(moments.mesh.phi)
    found = [switch for switch in moments.switches(omega) if np.ptp(switch) > 0]
    inner = 4 * (110 - 8 * omega)  # max(0, inner) and min(40, that)
    assert any(np.allclose(np.abs(switch), np.abs(inner)) for switch in found)
    assert any(np.allclose(np.abs(switch), np.abs(40 - np.maximum(inner, 0))) for switch in found)


def test_an_efficiency_of_next_to_nothing_keeps_its_digits():
    """The drive pays the work of the load through ratio and efficiency: 80 J = 2 pi 2 eta u."""
    scene = {
        "shafts": {"s": {"ratio": 2, "efficiency": 1e-6}},
        "inertia": [{"on": "crank", "value": 0.3}],
        "load": [{"on": "crank", "torque": -80, "from": 1, "to": 2}],
        "drive": {"on": "s", "torque": "balance"},
        "regime": {"speed": 10},
        "flywheel": {"irregularity": 0.01},
    }
    found = flywheel.size(flywheel.load(scene), simulate=False)
    assert found.balance.value == pytest.approx(80 / (4 * np.pi * 1e-6), rel=4e-15)
    assert found.error.exact < 1e-12
