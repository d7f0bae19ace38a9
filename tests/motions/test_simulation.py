from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

import flywheel
from tests import scenes


@pytest.mark.slow
def test_the_free_slider_crank_after_one_second():
    """r = 0.2, l = 0.6 m, no loads, from phi = 0 at 10 rad/s: quadrature at 25 digits."""
    crank = {
        "type": "slider-crank",
        "crank": {"length": 0.2, "inertia": 1.0},
        "rod": {"length": 0.6, "mass": 2.0, "inertia": 0.06, "com": 0.3},
        "slider": {"mass": 3.0},
    }
    scene = flywheel.load({"mechanism": crank, "regime": {"speed": 10}, "flywheel": {"inertia": 0}})
    motion = flywheel.simulate(scene, phi=0.0, omega=10.0, until=1.0, rtol=1e-11)
    assert motion.phi[-1] == pytest.approx(9.605127434380, rel=1e-11)
    assert motion.omega[-1] == pytest.approx(9.986857706929, rel=1e-11)
    assert motion.energy_residual < 1e-11


@pytest.mark.slow
def test_the_driven_slider_crank_from_rest():
    """Lengths 0.1 and 0.3 m, uniform rods, 0.1 N m from rest at 0: the reduced model of a published test machine."""
    crank = {
        "type": "slider-crank",
        "crank": {"length": 0.1, "mass": 0.2, "inertia": 0.2 * 0.1**2 / 12, "com": 0.05},
        "rod": {"length": 0.3, "mass": 0.2, "inertia": 0.2 * 0.3**2 / 12, "com": 0.15},
        "slider": {"mass": 0.4},
    }
    scene = {"mechanism": crank, "drive": {"torque": 0.1}, "regime": {"speed": 10}, "flywheel": {"inertia": 0}}
    motion = flywheel.simulate(flywheel.load(scene), phi=0.0, omega=0.0, until=0.93754409, rtol=1e-7)
    assert motion.phi[-1] == pytest.approx(12.626621, abs=1e-6)  # the other code, at 1e-6: 12.626642
    assert motion.omega[-1] == pytest.approx(42.986903, abs=2e-6)  # and 42.986635
    assert motion.energy_residual < 1e-8


def halves(motion):
    """The way of a motion in pieces of half a turn at most."""
    edges = np.linspace(motion.phi[0], motion.phi[-1], int(np.ptp(motion.phi) / 3) + 2)
    return pairwise(edges)


@pytest.mark.slow
def test_energy_stays_over_many_turns_of_free_motion():
    scene = flywheel.load(scenes.yoke(load=[], drive={"torque": 0}, flywheel={"inertia": 2}))
    motion = flywheel.simulate(scene, phi=0.3, omega=50.0, until=3.0, rtol=1e-9)
    assert motion.phi[-1] > 110
    time = [
        quad(lambda p: np.sqrt((2 + 5 * np.sin(p) ** 2) / (2 + 5 * np.sin(0.3) ** 2)) / 50, *part)[0]
        for part in halves(motion)
    ]
    late = abs(sum(time) - 3.0) * motion.omega.max() / motion.phi[-1]
    assert late < motion.error <= 1e-9
    assert motion.energy_residual < 1e-7


def test_a_machine_may_stop_and_turn_back():
    scene = flywheel.load(scenes.rotor(load=[], drive={"torque": -2}, flywheel={"inertia": 1}))
    motion = flywheel.simulate(scene, phi=0.1, omega=1.0, until=1.5)
    assert motion.omega[-1] == pytest.approx(1.0 - 3.0, rel=1e-9)
    assert motion.phi[-1] == pytest.approx(0.1 + 1.5 - 1.5**2, abs=1e-9)


def test_starting_at_rest_on_a_breakpoint_goes_the_way_that_the_moment_pushes():
    scene = flywheel.load(scenes.rotor(drive={"torque": 0}, flywheel={"inertia": 1}))
    motion = flywheel.simulate(scene, phi=np.pi, omega=0.0, until=0.1)  # nothing pushes past half a turn
    assert motion.phi[-1] == pytest.approx(np.pi, abs=1e-12)


def test_motion_is_known_between_the_steps():
    scene = flywheel.load(scenes.rotor(load=[], drive={"torque": 3}, flywheel={"inertia": 1}))
    motion = flywheel.simulate(scene, phi=0.0, omega=1.0, until=4.0)
    times = np.linspace(0, 4, 9)
    phi, omega = motion.at(times)
    assert_allclose(omega, 1 + 3 * times, rtol=1e-9)
    assert_allclose(phi, times + 1.5 * times**2, rtol=1e-9, atol=1e-12)


def test_a_machine_without_inertia_cannot_be_simulated():
    scene = flywheel.load(scenes.rotor(flywheel={"inertia": 0}))
    with pytest.raises(flywheel.SceneError, match="positive inertia"):
        flywheel.simulate(scene, phi=0.0, omega=1.0, until=1.0)


@pytest.mark.parametrize(
    ("argument", "value"), [("phi", np.nan), ("omega", np.inf), ("until", np.inf), ("rtol", np.nan), ("until", 0.0)]
)
def test_senseless_arguments_are_refused(argument, value):
    scene = flywheel.load(scenes.rotor(flywheel={"inertia": 1}))
    arguments = {"phi": 0.0, "omega": 1.0, "until": 1.0, argument: value}
    with pytest.raises(flywheel.SceneError, match=argument):
        flywheel.simulate(scene, **arguments)


@pytest.mark.slow
def test_steps_that_try_too_much_are_taken_again_without_a_warning():
    """A heavy slider on a crank of next to no inertia of its own: it turns by jerks, from dead centre to dead centre."""
    scene = {
        "mechanism": {
            "type": "slider-crank",
            "crank": {"length": 0.1, "inertia": 1e-6},
            "rod": {"length": 0.4},
            "slider": {"mass": 3},
        },
        "regime": {"speed": 10},
        "flywheel": {"inertia": 0},
    }
    machine = flywheel.Machine(flywheel.load(scene))
    motion = flywheel.simulate(machine, 0.0, 10.0, 5.0)

    def slowness(phi):
        return float(np.sqrt(machine.reduce(phi % (2 * np.pi)).inertia / 1e-4))

    assert sum(quad(slowness, *part, epsabs=0.0)[0] for part in halves(motion)) == pytest.approx(5.0, rel=1e-8)
    energy = 0.5 * np.asarray(machine.reduce(motion.phi % (2 * np.pi)).inertia) * motion.omega**2
    np.testing.assert_allclose(energy, 0.5e-4, rtol=1e-9)


@pytest.mark.parametrize("rtol", [1e-3, 1e-5, 1e-8])
def test_every_rtol_is_kept_and_its_estimate_too(rtol):
    """A rotor of 0.01 kg m² on a DC motor with inductance, from rest: two exponentials."""
    motor = {"type": "dc", "voltage": 48, "resistance": 0.4, "constant": 0.25, "inductance": 0.02}
    rotor = {"inertia": [{"on": "crank", "value": 0.01}], "drive": {"motor": motor}, "flywheel": {"inertia": 0}}
    found = flywheel.simulate(flywheel.load(rotor), 0.0, 0.0, 0.5, rtol=rtol)
    matrix = np.array([[0.0, 0.25 / 0.01], [-0.25 / 0.02, -0.4 / 0.02]])
    values, vectors = np.linalg.eig(matrix)
    steady, times = np.array([48 / 0.25, 0.0]), np.linspace(0.0, 0.5, 201)
    parts = np.linalg.solve(vectors, -steady.astype(complex))
    omega = (steady[:, None] + vectors @ (np.exp(np.outer(values, times)) * parts[:, None])).real[0]
    error = np.abs(found.at(times)[1] - omega).max() / omega.max()
    assert error <= found.error <= rtol
