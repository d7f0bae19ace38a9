"""Motion in time: the simulation that confirms a flywheel, elastic parts, linkages."""

from __future__ import annotations

from itertools import pairwise
from math import cos, sin, sqrt, tau
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad, solve_ivp

import flywheel
from flywheel import SceneError
from flywheel.machine.machine import Anchor
from flywheel.machine.programs import Programs, programs_of
from flywheel.motions import simulation
from tests import scenes
from tests.limits import sample


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


NEAR_LOCK = {"type": "slider-crank", "crank": {"length": 0.1}, "rod": {"length": 0.1001}, "slider": {"mass": 1.0}}
SHAPER = {"type": "crank-shaper", "crank": {"length": 0.1}, "frame": {"length": 0.1001}, "rocker": {"length": 0.3}}
DISC = {"type": "law", "outputs": {"disc": {"theta": "phi + 0.3*sin(phi)", "inertia": 0.9}}}


@pytest.mark.parametrize(
    ("mechanism", "torque", "edges"),
    [
        (NEAR_LOCK, "-3*max(cos(phi), 0)", [0.25, 0.75]),
        (SHAPER | {"ram": {"mass": 1.0}}, "-3*max(sin(phi), 0)", [0.5]),
        (SHAPER | {"ram": {"mass": 1.0}}, "-3*(phi < pi)", [0.5]),
        (DISC, "-3*max(sin(phi), 0)", [0.5]),
        (DISC, "-3*sin(phi) if sin(phi) > 0 else 0", [0.5]),
        (DISC, "-3*abs(cos(phi))", [0.25, 0.75]),
        (DISC, "-3*sqrt(1 - sin(phi))", [0.25]),
    ],
)
def test_a_law_that_switches_where_a_cell_ends_for_resolution(mechanism, torque, edges):
    """Near a lock, and for a law to be followed, cells end at quarters of a turn: the speed is that of work and energy."""
    table = {
        "mechanism": mechanism,
        "inertia": [{"on": "crank", "value": 1.0}],
        "load": [{"on": "crank", "torque": torque}],
        "drive": {"torque": 5.0},
        "flywheel": {"inertia": 1.0},
    }
    scene = flywheel.load(table)
    assert_allclose(flywheel.Machine(scene).switches, tau * np.array([0.0, *edges, 1.0]), rtol=1e-14)
    motion = flywheel.simulate(scene, phi=0.1, omega=2.0, until=3.0, rtol=1e-9)
    assert motion.error < 1e-6
    assert motion.phi[-1] > 7.0  # through every switch
    law = compile(torque.replace("phi", "(phi % tau)"), "torque", "eval")
    names = {"cos": cos, "sin": sin, "sqrt": sqrt, "tau": tau, "pi": tau / 2, "max": max, "abs": abs}
    turns = [tau * (k + edge) for k in range(3) for edge in (0.0, *edges)]
    stops = [0.1, *(at for at in sorted(turns) if 0.1 < at < motion.phi[-1]), float(motion.phi[-1])]
    taken = sum(quad(lambda phi: eval(law, names, {"phi": phi}), *ends, epsabs=1e-12)[0] for ends in pairwise(stops))
    start, end = (1.0 + float(np.squeeze(flywheel.reduce(scene, float(phi)).inertia)) for phi in (0.1, motion.phi[-1]))
    speed = sqrt((start * 2.0**2 + 2 * (5.0 * (motion.phi[-1] - 0.1) + taken)) / end)
    assert motion.omega[-1] == pytest.approx(speed, rel=1e-7)


def test_a_flywheel_is_confirmed_in_time_where_a_law_switches_as_a_cell_ends():
    small = {"type": "law", "outputs": {"disc": {"theta": "phi + 0.3*sin(phi)", "inertia": 0.01}}}
    table = {
        "mechanism": small,
        "inertia": [{"on": "crank", "value": 0.003}],
        "load": [{"on": "disc", "torque": "-0.5443*max(sin(phi), 0)"}],
        "drive": {"torque": "balance"},
        "regime": {"speed": 10},
        "flywheel": {"irregularity": 0.02},
    }
    sizing = flywheel.size(flywheel.load(table))
    assert not sizing.messages
    assert sizing.simulation.irregularity == pytest.approx(0.02, rel=1e-9)


@pytest.mark.parametrize(
    ("load", "drive"),
    [
        ("-7*(1 - cos(phi))", 12.0),
        ("-40*phi**4", 12.0),
        ("7*(1 - cos(phi))", 12.0),
        ("7*(1 - cos(phi))", -12.0),
        ("0*phi", 12.0),
    ],
)
def test_a_load_behind_a_mesh_that_begins_with_nothing(load, drive):
    """From rest the mesh passes nothing at first, so that either side may seem to drive it: the load decides later."""
    table = {
        "shafts": {"far": {"ratio": 2.0, "efficiency": 0.7}},
        "inertia": [{"on": "crank", "value": 1.5}],
        "load": [{"on": "far", "torque": load}],
        "drive": {"torque": drive},
        "flywheel": {"inertia": 0.5},
    }
    motion = flywheel.simulate(flywheel.load(table), phi=0.0, omega=0.0, until=0.5, rtol=1e-9)
    torque = compile(load, "torque", "eval")

    def rates(_, y):
        passed = -2.0 * eval(torque, {"phi": y[0] % tau, "cos": cos})
        outwards = passed * drive > 0.0  # the motion has the direction of the drive
        return [y[1], (drive - passed / 0.7 if outwards else drive - passed * 0.7) / 2.0]

    true = solve_ivp(rates, (0.0, 0.5), [0.0, 0.0], "DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
    assert_allclose((motion.phi[-1], motion.omega[-1]), true, rtol=1e-8)
    assert motion.energy_residual < 1e-9


def test_the_audit_sees_a_mesh_that_gives_power(monkeypatch):
    """The side of every mesh is held as it was decided at the anchor: the losses of the audit are by the motion itself."""
    sides = flywheel.machine.dynamics.MachineDynamics.sides

    def without_meshes(self, phi, *arguments, **options):
        return [np.abs(row) + 1.0 for row in sides(self, phi, *arguments, **options)]

    table = {
        "shafts": {"far": {"ratio": 2.0, "efficiency": 0.7}},
        "inertia": [{"on": "crank", "value": 1.5}, {"on": "far", "value": 0.5}],
        "load": [{"on": "far", "torque": "-7*sin(phi)"}],
        "drive": {"torque": 1.0},
        "flywheel": {"inertia": 0.5},
    }
    scene = flywheel.load(table)
    assert flywheel.simulate(scene, 0.0, 4.0, 2.0, rtol=1e-9).energy_residual < 1e-9
    monkeypatch.setattr(flywheel.machine.dynamics.MachineDynamics, "sides", without_meshes)
    assert flywheel.simulate(scene, 0.0, 4.0, 2.0, rtol=1e-9).energy_residual > 1e-3


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


def test_a_motion_begins_at_crank_angle_0_where_no_other_is_given():
    rotor = {"inertia": [{"on": "crank", "value": 2}], "drive": {"torque": "6 + sin(phi)"}, "flywheel": {"inertia": 1}}
    scene = flywheel.load(rotor)
    result, same = flywheel.simulate(scene, omega=1.0, until=0.5), flywheel.simulate(scene, 0.0, 1.0, 0.5)
    assert (result.phi[0], result.phi.tolist()) == (0.0, same.phi.tolist())
    with pytest.raises(SceneError) as caught:
        flywheel.simulate(scene)
    assert [str(fault) for fault in caught.value.faults] == [
        "omega: found nothing, expected a finite number",
        "until: found nothing, expected a finite number",
    ]


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
    result = flywheel.simulate(flywheel.load(rotor), 0.0, 0.0, 0.5, rtol=rtol)
    matrix = np.array([[0.0, 0.25 / 0.01], [-0.25 / 0.02, -0.4 / 0.02]])
    values, vectors = np.linalg.eig(matrix)
    steady, times = np.array([48 / 0.25, 0.0]), np.linspace(0.0, 0.5, 201)
    parts = np.linalg.solve(vectors, -steady.astype(complex))
    omega = (steady[:, None] + vectors @ (np.exp(np.outer(values, times)) * parts[:, None])).real[0]
    error = np.abs(result.at(times)[1] - omega).max() / omega.max()
    assert error <= result.error <= rtol


def test_a_motion_ends_at_the_time_asked_also_where_a_turn_ends_just_beyond():
    """A load of position alone, after which every turn takes as long: whole turns by quadrature of 1/omega."""
    scene = flywheel.load(
        {"load": [{"on": "crank", "torque": "1.5*sin(phi)"}], "regime": {"speed": 5}, "flywheel": {"inertia": 2}}
    )
    turn = quad(lambda phi: 1 / np.sqrt(25 + 1.5 * (1 - np.cos(phi))), 0, 2 * np.pi, epsabs=0, epsrel=1e-13)[0]
    for turns in (1, 40):
        for before in (1e-9, 1e-12, 0.0):
            until = turns * turn - before
            motion = flywheel.simulate(scene, phi=0.0, omega=5.0, until=until)
            assert motion.t[-1] == until
            assert motion.phi[-1] == pytest.approx(turns * 2 * np.pi, abs=1e-6)


# Machines with compliant shafts, whose whole bond graph is followed.


R, LENGTH = 0.2, 0.6


def scene(**shaft):
    return {
        "shafts": {"motor": {"ratio": 3.0, **shaft}},
        "mechanism": {
            "type": "slider-crank",
            "crank": {"length": R},
            "rod": {"length": LENGTH},
            "slider": {"mass": 3.0},
        },
        "inertia": [{"on": "motor", "value": 0.2}, {"on": "crank", "value": 1.0}],
        "load": [{"on": "slider", "force": -40.0, "from": "30 deg", "to": "150 deg"}],
        "drive": {"on": "motor", "torque": 0.5},
        "regime": {"speed": 10.0},
        "flywheel": {"on": "motor", "inertia": 0.0},
    }


def gains(phi):
    root = np.sqrt(LENGTH**2 - (R * np.sin(phi)) ** 2)
    first = -R * np.sin(phi) - R**2 * np.sin(phi) * np.cos(phi) / root
    second = -R * np.cos(phi) - R**2 * (np.cos(2 * phi) / root + (R * np.sin(phi) * np.cos(phi)) ** 2 / root**3)
    return first, second


def by_hand(stiffness, damping, until, flywheel_inertia=0.0):
    """The two angles' equations, written out, and stepped from one end of the load's window to the next."""

    def rates(t, y, loaded):
        phi, omega, angle, speed = y
        g, g_slope = gains(phi)
        torque = stiffness * (3 * phi - angle) + damping * (3 * omega - speed)
        force = -40.0 if loaded else 0.0
        alpha = (force * g - 3 * torque - 3.0 * g * g_slope * omega**2) / (1.0 + 3.0 * g**2)
        return [omega, alpha, speed, (0.5 + torque) / (0.2 + flywheel_inertia)]

    t, y = 0.0, [0.0, 10.0, 0.0, 30.0]
    edges = [2 * np.pi * turn + np.radians(a) for turn in range(100) for a in (30.0, 150.0)]
    for k, edge in enumerate(edges):

        def passing(t, y, loaded, edge=edge):
            return y[0] - edge

        passing.terminal, passing.direction = True, 1.0
        result = solve_ivp(rates, (t, until), y, "DOP853", rtol=1e-13, atol=1e-13, events=passing, args=(k % 2 == 1,))
        t, y = result.t[-1], result.y[:, -1]
        if result.status == 0:
            return y
    raise AssertionError("more turns than expected")


@pytest.mark.parametrize(("stiffness", "damping", "wheel"), sample([(50.0, 0.0, 0.7), (300.0, 0.4, 0.0)], 2))
def test_a_compliant_shaft_moves_as_its_equations_written_by_hand(stiffness, damping, wheel):
    """The flywheel turns with its own shaft."""
    machine = flywheel.Machine(flywheel.load(scene(stiffness=stiffness, damping=damping)))
    motion = flywheel.simulate(machine, phi=0.0, omega=10.0, until=0.3, rtol=1e-10, inertia=wheel)
    phi, omega, angle, speed = by_hand(stiffness, damping, 0.3, wheel)
    assert_allclose(motion.at(0.3), [[phi], [omega]], rtol=1e-9)
    assert_allclose(motion.run.displacement("phi_motor", 0.3), angle, rtol=1e-9)
    assert_allclose(motion.run.flow("motor", 0.3), speed, rtol=1e-9)
    assert motion.energy_residual < 1e-9
    assert motion.run.audit.power < 1e-13


@pytest.mark.slow
def test_mechanisms_on_rigid_shafts_start_and_break_at_their_own_angles():
    valve = {"type": "scotch-yoke", "name": "valve", "shaft": "cam", "phase": "40 deg", "crank": {"length": 0.1}}

    def with_valve(**shaft):
        given = scene(**shaft)
        given["shafts"]["cam"] = {"ratio": 2.0}
        given["mechanism"] = [given["mechanism"] | {"name": "main"}, valve | {"yoke": {"mass": 5.0}}]
        given["load"][0]["on"] = "main.slider"
        given["load"].append({"on": "valve.yoke", "force": 30.0, "from": "20 deg", "to": "100 deg"})
        return flywheel.load(given)

    rigid = flywheel.simulate(with_valve(), phi=1.0, omega=10.0, until=0.5)
    stiff = flywheel.simulate(with_valve(stiffness=1e5, damping=20.0), phi=1.0, omega=10.0, until=0.5, rtol=1e-7)
    assert_allclose(stiff.omega[-1], rigid.omega[-1], rtol=1e-4)
    assert_allclose(stiff.run.displacement("phi_cam"), 2.0 * stiff.phi, rtol=1e-6)


def test_the_unknown_is_balanced_with_rigid_shafts_unless_it_is_given():
    balanced = scene(stiffness=200.0) | {"drive": {"on": "motor", "torque": "balance"}}
    rigid = flywheel.size(flywheel.load(scene() | {"drive": {"on": "motor", "torque": "balance"}}), simulate=False)
    load = flywheel.load(balanced)
    given = flywheel.simulate(load, phi=0.0, omega=10.0, until=0.05, balance=rigid.balance.value)
    result = flywheel.simulate(load, phi=0.0, omega=10.0, until=0.05)
    assert_allclose(result.omega[-1], given.omega[-1], rtol=1e-12)


@pytest.mark.parametrize("ask", [flywheel.size, lambda s: flywheel.reduce(s, [0.0])])
def test_what_needs_one_angle_refuses_a_shaft_that_twists(ask):
    with pytest.raises(SceneError, match=r"shafts\.motor\.stiffness: found a compliant shaft.*flywheel\.simulate"):
        ask(flywheel.load(scene(stiffness=100.0)))


def test_the_graph_holds_the_twist_as_a_spring_and_a_resistor_between_gear_and_shaft():
    graph = flywheel.Machine(flywheel.load(scene(stiffness=100.0, damping=2.0))).graph
    assert {"motor.gear", "motor.twist", "motor.compliance", "motor.damping"} <= set(graph.elements)
    assert graph.constant("motor.compliance") == 0.01


def test_a_side_of_a_compliant_shaft_without_inertia_is_named():
    light = {key: value for key, value in scene(stiffness=80.0).items() if key not in ("mechanism", "load")}
    light["inertia"] = [{"on": "motor", "value": 0.2}]
    with pytest.raises(SceneError, match=r'inertia: found no inertia on crank.*add \[\[inertia\]\] on = "crank"'):
        flywheel.simulate(flywheel.load(light), phi=0.0, omega=5.0, until=1.0)


@pytest.mark.slow
def test_loads_of_speed_and_time_on_a_stiff_shaft_move_it_like_a_rigid_one():
    loads = [
        {"on": "slider", "force": "-40 - 8*v*abs(v)", "from": "30 deg", "to": "150 deg"},
        {"on": "crank", "torque": "-2*(t > 0.1)"},
    ]
    parts = {
        "load": loads,
        "damper": [{"on": "slider", "coefficient": 20}, {"on": "motor", "coefficient": 0.01}],
        "drive": {"on": "motor", "torque": "min(3, 6 - 0.1*omega)"},
    }
    rigid = flywheel.simulate(flywheel.load(scene() | parts), 0.0, 10.0, 0.2)
    stiff = flywheel.simulate(flywheel.load(scene(stiffness=2e4, damping=20.0) | parts), 0.0, 10.0, 0.2, rtol=1e-6)
    assert stiff.omega[-1] == pytest.approx(rigid.omega[-1], rel=3e-5)
    assert stiff.phi[-1] == pytest.approx(rigid.phi[-1], rel=3e-5)
    assert np.abs(stiff.t - 0.1).min() < 1e-12
    assert stiff.run.audit.energy < 1e-6


# Recorded programs of linkages, wherever their own turn begins in the crank's cycle: against loops closed by hand.


CRANK_LENGTH, L, MASS, J = 0.1, 0.3, 50.0, 0.5
D, COUPLER, ROCKER, BEAM = 0.25, 0.24, 0.2, 0.6  # of the four-bar: ground, coupler, rocker (m), inertia of the rocker

SLIDER_CRANK: dict[str, Any] = {
    "name": "press",
    "bodies": {"arm": {"points": {"A": [CRANK_LENGTH, 0.0]}}, "rod": {"points": {"B": [L, 0.0]}}, "ram": {"mass": MASS}},
    "joints": [
        {"name": "O", "type": "pin", "between": ["frame.origin", "arm.origin"]},
        {"name": "A", "type": "pin", "between": ["arm.A", "rod.origin"]},
        {"name": "B", "type": "pin", "between": ["rod.B", "ram.origin"]},
        {
            "name": "g",
            "type": "slide",
            "between": ["frame.origin", "ram.origin"],
            "direction": 0.0,
            "guess": CRANK_LENGTH + L,
        },
    ],
}
FOUR_BAR: dict[str, Any] = {
    "name": "beam",
    "bodies": {
        "frame": {"points": {"D": [D, 0.0]}},
        "arm": {"points": {"A": [CRANK_LENGTH, 0.0]}},
        "coupler": {"points": {"B": [COUPLER, 0.0]}, "guess": "60 deg"},
        "rocker": {"points": {"B": [ROCKER, 0.0]}, "inertia": BEAM, "guess": "90 deg"},
    },
    "joints": [
        {"name": "O", "type": "pin", "between": ["frame.origin", "arm.origin"]},
        {"name": "A", "type": "pin", "between": ["arm.A", "coupler.origin"]},
        {"name": "B", "type": "pin", "between": ["coupler.B", "rocker.B"]},
        {"name": "D", "type": "pin", "between": ["frame.D", "rocker.origin"]},
    ],
}


def ram(psi: float) -> tuple[float, float]:
    """Inertia (kg m²) of the slider-crank's ram on its crank, and its slope, by the slider's rate and that one's rate."""
    s, c, root = CRANK_LENGTH * sin(psi), CRANK_LENGTH * cos(psi), sqrt(L * L - CRANK_LENGTH * CRANK_LENGTH * sin(psi) ** 2)
    rate = -s - s * c / root
    bend = -c - (c * c - s * s) / root - (s * c) ** 2 / root**3
    return MASS * rate * rate, 2.0 * MASS * rate * bend


def rocker(psi: float) -> tuple[float, float]:
    """Inertia (kg m²) of the four-bar's rocker on its crank, and its slope, by closing the loop and differentiating it."""
    x, y = CRANK_LENGTH * cos(psi) - D, CRANK_LENGTH * sin(psi)
    far = x * x + y * y
    angle = np.arctan2(y, x) - np.arccos((far + ROCKER**2 - COUPLER**2) / (2.0 * ROCKER * sqrt(far)))
    coupler = np.arctan2(ROCKER * sin(angle) - y, ROCKER * cos(angle) - x)
    matrix = np.array([[-COUPLER * sin(coupler), ROCKER * sin(angle)], [COUPLER * cos(coupler), -ROCKER * cos(angle)]])
    a, b = np.linalg.solve(matrix, [CRANK_LENGTH * sin(psi), -CRANK_LENGTH * cos(psi)])
    curving = CRANK_LENGTH * np.array([cos(psi), sin(psi)]) + COUPLER * a * a * np.array([cos(coupler), sin(coupler)])
    curving -= ROCKER * b * b * np.array([cos(angle), sin(angle)])
    bend = np.linalg.solve(matrix, curving)[1]
    return BEAM * float(b) ** 2, 2.0 * BEAM * float(b) * float(bend)


def linkage_scene(
    *placed: tuple[dict[str, Any], float, float], cycle: float = tau, torque: str = "20 - 4*omega"
) -> dict[str, Any]:
    """Linkages with the ratio of the shaft and the phase of each."""
    shafts = {f"s{k}": {"ratio": ratio} for k, (_, ratio, _) in enumerate(placed)}
    mechanisms = [
        linkage | {"type": "linkage", "driver": "O", "shaft": f"s{k}", "phase": phase}
        for k, (linkage, _, phase) in enumerate(placed)
    ]
    return {
        "mechanism": mechanisms,
        "shafts": shafts,
        "inertia": [{"on": "crank", "value": J}],
        "drive": {"torque": torque},
        "regime": {"cycle": cycle},
        "flywheel": {"inertia": 0.0},
    }


@pytest.mark.parametrize("phase", [0.0, 1.0, 3.0, -2.0])
def test_every_program_of_a_linkage_is_its_walk_all_over_its_piece(phase):
    machine = flywheel.Machine(
        flywheel.load(linkage_scene((SLIDER_CRANK, 2.0, phase), (FOUR_BAR, 1.0, 2 * phase), cycle=2 * tau))
    )
    for low, high in zip(machine.breakpoints[:-1], machine.breakpoints[1:], strict=True):
        phi, middle = np.linspace(low, high, 41), float(0.5 * (low + high))
        inertia, slope, _ = programs_of(machine).motion(Anchor(middle, None, None)).function("numpy")(phi, 1.0, 0.0, 0.0)
        closed = [
            [J + 4.0 * a + b, 8.0 * da + db]
            for (a, da), (b, db) in ((ram(2.0 * at + phase), rocker(at + 2 * phase)) for at in phi)
        ]
        assert_allclose(np.stack((inertia, slope)).T, np.array(closed), rtol=1e-11, atol=1e-11)


def test_no_motion_goes_by_a_recording_that_is_not_the_machine(monkeypatch):
    """A term of the recorded walk is off by a millionth: told wherever a motion asks for it."""
    recorded = Programs._terms

    def off(*arguments, **options):
        first, *rest = recorded(*arguments, **options)
        return [first * (1.0 + 1e-6), *rest]

    monkeypatch.setattr(Programs, "_terms", off)
    machine = flywheel.load(linkage_scene((SLIDER_CRANK, 1.0, 0.5)))
    with pytest.raises(SceneError, match="a recording that is not the machine"):
        flywheel.simulate(machine, 0.0, 5.0, 0.1)
    with pytest.raises(SceneError, match="a recording that is not the machine"):
        flywheel.transient(machine, start=5.0, end=0.1, inertia=0.0)


@pytest.mark.parametrize(
    ("force", "true"),
    [
        ("-50*max(0, v/0.2 - 0.5)", lambda v: -50 * max(0.0, v / 0.2 - 0.5)),
        ("-250*v if v > 0.1 else 0", lambda v: -250 * v if v > 0.1 else 0.0),
    ],
)
@pytest.mark.parametrize("phi", [0.5, 2.0, 4.0])
def test_a_force_that_acts_one_way_and_switches_at_a_speed_does_so_where_the_crank_turns_backwards(force, true, phi):
    """v = -r omega sin phi is above 0 in the half turn in which it is below 0 where the crank turns forwards."""
    load = {"on": "yoke", "force": force, "while": "v > 0"}
    yoke = {"type": "scotch-yoke", "crank": {"length": 0.1, "inertia": 0.5}, "yoke": {"mass": 5}}
    motion = flywheel.simulate(
        flywheel.load({"mechanism": yoke, "load": [load], "flywheel": {"inertia": 0}}), phi, -6.0, 1.0, rtol=1e-9
    )

    def rates(_t, state):
        ratio, slope = -0.1 * sin(state[0]), -0.1 * cos(state[0])
        effort = ratio * true(ratio * state[1]) - 5 * ratio * slope * state[1] ** 2
        return [state[1], effort / (0.5 + 5 * ratio**2)]

    own = solve_ivp(rates, (0.0, 1.0), [phi, -6.0], "DOP853", rtol=1e-11, atol=1e-13, max_step=0.005)
    assert motion.phi[-1] == pytest.approx(own.y[0, -1], abs=1e-6)
    assert motion.omega[-1] == pytest.approx(own.y[1, -1], abs=1e-5)
    assert motion.energy_residual < 1e-8


def test_an_energy_that_does_not_close_is_part_of_the_error(monkeypatch):
    scene = flywheel.load(scenes.press())
    motion = flywheel.simulate(scene, 0.0, 10.0, 0.5, balance=0.0)
    assert motion.energy_residual < 0.1 * motion.error
    works_of = simulation.works_of
    monkeypatch.setattr(simulation, "works_of", lambda trail: (*works_of(trail)[:2], 1.01 * works_of(trail)[2]))
    off = flywheel.simulate(scene, 0.0, 10.0, 0.5, balance=0.0)
    assert off.error == off.energy_residual > 1e-4
