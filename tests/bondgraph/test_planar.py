"""Plane linkages: the body's own kinematics, then slider-crank and four-bar against their condensed graphs."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import flywheel
from bondgraph import Builder, GraphError, I, R, Reduction, Se, Sf
from bondgraph.motion.dynamics import Dynamics
from bondgraph.planar import Bar, Count, counts, fix, four_bar, pin, rigid_body, slide, slider_crank
from bondgraph.simplification.rules import drop_zero_velocity, simplify

G = 9.80665
CRANK = {"length": 0.2, "mass": 2.0, "inertia": 0.1, "com": 0.07, "com_angle": 0.3}
ROD = {"length": 0.6, "mass": 1.5, "inertia": 0.05, "com": 0.2, "com_angle": -0.4}
ROCKER = {"length": 0.5, "mass": 1.1, "inertia": 0.02, "com": 0.3, "com_angle": 0.1}
GROUND, SLIDER, COUPLE, FORCE = 0.65, 3.0, 40.0, -300.0
CLOSE = [1e-9, np.pi - 1e-9, np.pi, np.pi + 1e-7, 1e-5]  # to the dead centres
PHI = np.concatenate([np.linspace(0, 2 * np.pi, 181), CLOSE])
LENGTHS = st.floats(-1.0, 1.0)
ANGLES = st.floats(-7.0, 7.0)


def condensed(mechanism, port):
    """The machine with one transformer from the crank to each velocity, as the package `flywheel` writes it."""
    loads = [{"on": port, "torque" if port == "rocker" else "force": FORCE}, {"on": "crank", "torque": COUPLE}]
    scene = {"mechanism": mechanism, "load": loads, "gravity": {"g": G}, "regime": {"speed": 20.0}}
    return flywheel.Machine(flywheel.load(scene | {"flywheel": {"irregularity": 0.1}}))


def slider_cranks(offset):
    mechanism = {"type": "slider-crank", "crank": CRANK, "rod": ROD, "slider": {"mass": SLIDER, "offset": offset}}
    on = {"crank.turn": [Se("M", COUPLE)], "rod.2.x": [Se("F", FORCE)]}
    return condensed(mechanism, "slider"), slider_crank(Bar(**CRANK), Bar(**ROD), SLIDER, offset, on=on, gravity=G)


def four_bars(assembly):
    bars = {"crank": CRANK, "coupler": ROD, "rocker": ROCKER}
    mechanism = {"type": "four-bar", "ground": {"length": GROUND}, "assembly": assembly} | bars
    on = {"crank.turn": [Se("M", COUPLE)], "rocker.turn": [Se("T", FORCE)]}
    found = four_bar(GROUND, *(Bar(**bar) for bar in bars.values()), crossed=assembly == "crossed", on=on, gravity=G)
    return condensed(mechanism, "rocker"), found


MACHINES = [(slider_cranks, 0.0), (slider_cranks, 0.15), (slider_cranks, -0.3), (four_bars, "open"), (four_bars, "crossed")]


def simplified(linkage):
    return simplify(drop_zero_velocity(linkage.graph).graph).graph


def assert_same_reduction(found, expected):
    for name in ("inertia", "slope", "moment"):
        figure = getattr(expected, name)
        assert_allclose(getattr(found, name), figure, rtol=0, atol=1e-12 * np.max(np.abs(figure)), err_msg=name)
    assert_allclose(found.inertia, expected.inertia, rtol=1e-12)


@pytest.fixture(params=MACHINES, ids=lambda case: f"{case[0].__name__}({case[1]})")
def machine(request):
    build, variant = request.param
    return build(variant)


@given(LENGTHS, LENGTHS, ANGLES, LENGTHS, LENGTHS, LENGTHS, st.booleans())
@settings(max_examples=10, deadline=None)
def test_a_pin_has_the_velocity_of_the_centre_plus_omega_times_its_arm(x, y, theta, omega, vx, vy, inward):
    assume(x or y)
    b = Builder().include("body", rigid_body(2.0, 0.5, {"end": (x, y)}, inlets=["end"] if inward else []))
    dynamics = Dynamics(b.build(loose=True))
    state = {"f_body.turn": omega, "f_body.x": vx, "f_body.y": vy, "body.theta": theta}
    flows = dynamics.at(0.0, [state[name] for name in dynamics.state.names]).flows
    arm = (x + 1j * y) * np.exp(1j * theta)
    velocity = vx + 1j * vy + 1j * omega * arm
    found = [flows[dynamics.form.variable(f"body.end.{axis}")] for axis in "xy"]
    assert_allclose(found, [velocity.real, velocity.imag], atol=1e-15)


def test_the_two_ends_of_a_bar_have_opposite_arms_where_the_source_has_equal_ones():
    graph = Builder().include("bar", Bar(0.5, com=0.2).body()).build(loose=True)
    theta, omega = 0.7, 3.0
    ratio = {name: graph.elements[f"bar.{name}.arm"].law(theta) for name in ("1.x", "1.y", "2.x", "2.y")}
    s, c = np.sin(theta), np.cos(theta)
    inlet = -1.0  # the 0-junctions of pin 1 take v_1 - v_G - omega x r = 0
    assert_allclose(inlet * ratio["1.x"] * omega, 0.2 * omega * s)  # the source: v_1x = v_x - omega R1 sin theta
    assert_allclose(inlet * ratio["1.y"] * omega, -0.2 * omega * c)
    assert_allclose(ratio["2.x"] * omega, -0.3 * omega * s)
    assert_allclose(ratio["2.y"] * omega, 0.3 * omega * c)  # the source: v_y - omega R2 cos theta


@given(LENGTHS, LENGTHS, ANGLES)
@settings(max_examples=10, deadline=None)
def test_a_body_on_a_fixed_pin_has_the_inertia_of_steiners_theorem(x, y, theta):
    assume(x or y)
    b = fix(Builder().include("body", rigid_body(2.0, 0.5, {"pivot": (x, y)})), "body.pivot")
    reduced = Reduction(drop_zero_velocity(b.build()).graph, "body.turn")(theta)
    assert_allclose(reduced.inertia, 0.5 + 2 * (x * x + y * y), rtol=1e-14)
    assert_allclose(reduced.slope, 0.0, atol=1e-15)


def test_a_pendulum_falls_as_the_formula_says():
    b = fix(Builder().include("body", rigid_body(2.0, 0.5, {"pivot": (-0.3, 0.0)}, angle=0.4)), "body.pivot")
    dynamics = Dynamics(b.on("body.y", Se("weight", -2.0 * G)).build())
    rates = dynamics.at(0.0, [0.0, 0.4]).rates
    assert_allclose(rates, [-2 * G * 0.3 * np.cos(0.4) / (0.5 + 2 * 0.09), 0.0], rtol=1e-14)


def test_a_pin_at_the_centre_of_mass_needs_no_transformer():
    graph = Builder().include("body", rigid_body(2.0, 0.5, {"middle": (0.0, 0.0), "end": (0.1, 0.0)})).build(loose=True)
    assert [e.name for e in graph.of_kind("TF")] == ["body.end.x.arm", "body.end.y.arm"]


def test_reduced_quantities_are_those_of_the_condensed_graph(machine):
    condensed, linkage = machine
    expected = condensed.reduce(PHI)
    assert_same_reduction(linkage.reduction()(PHI), expected)
    assert_same_reduction(Reduction(simplified(linkage), linkage.coordinate, linkage.positions)(PHI), expected)


def test_accelerations_are_those_of_the_condensed_graph(machine):
    condensed, linkage = machine
    reference = Dynamics(condensed.graph)
    whole, small = Dynamics(linkage.graph), Dynamics(simplified(linkage))
    rng = np.random.default_rng(7)
    angles = [0.0, np.pi, np.pi / 2, *rng.uniform(0, 2 * np.pi, 10)]
    for phi, omega in zip(angles, rng.uniform(-20, 20, len(angles)), strict=True):
        others = [float(angle(phi)) for angle in linkage.positions.values()]
        expected = reference.rates(0.0, omega, phi, *[phi] * len(reference.anchored))[0]
        for dynamics in (whole, small):
            found = dynamics.rates(0.0, omega, phi, *others)[0]
            assert_allclose(found, expected, rtol=1e-12, atol=1e-12 * omega**2)


def test_angles_that_are_integrated_move_as_their_closed_form(machine):
    _, linkage = machine
    dynamics, phi, omega, step = Dynamics(linkage.graph), 1.1, 3.0, 1e-6
    rates = dynamics.rates(0.0, omega, phi, *(float(angle(phi)) for angle in linkage.positions.values()))
    for rate, angle in zip(rates[2:], linkage.positions.values(), strict=True):
        assert_allclose(rate, omega * (angle(phi + step) - angle(phi - step)) / (2 * step), rtol=1e-8)


def test_a_linkage_starts_where_it_is_told():
    linkage = slider_crank(Bar(0.2), Bar(0.6), SLIDER, 0.1, start=0.8)
    start = {name: d.initial for name, d in linkage.graph.displacements.items()}
    assert start == pytest.approx({"crank.theta": 0.8, "rod.theta": -np.arcsin((0.2 * np.sin(0.8) - 0.1) / 0.6)}, rel=1e-14)


def test_a_slanted_guide_is_the_level_one_turned():
    tilt = 0.5
    b = Builder().include("crank", Bar(**CRANK).body()).include("rod", Bar(**ROD).body())
    pin(fix(b, "crank.1"), "crank.2", "rod.1")
    along = slide(b, "rod.2", tilt)
    b = b.on(along, I("slider", SLIDER), Se("F", FORCE)).on("crank.turn", Se("M", COUPLE))
    level = slider_crank(Bar(**CRANK), Bar(**ROD), SLIDER, on={"crank.turn": [Se("M", COUPLE)], "rod.2.x": [Se("F", FORCE)]})
    theta = {"rod.theta": lambda phi: tilt + level.positions["rod.theta"](phi - tilt)}
    graph = drop_zero_velocity(b.build()).graph
    expected = level.reduction()(PHI - tilt)
    for found in (graph, simplify(graph).graph):
        assert_same_reduction(Reduction(found, "crank.turn", theta)(PHI), expected)


LOADS = {"crank.turn": [Se("M", COUPLE)], "rod.2.x": [Se("F", FORCE), R("B", 5.0)]}
SIMPLE_ROD = Bar(0.6, 1.5, 0.05, 0.2)


def source_machine(com):
    return slider_crank(Bar(0.2, 2.0, 0.1, com), SIMPLE_ROD, on=LOADS)


def powers(graph, state):
    """Effort times flow into every one-port, by name; a source of flow has none that a law gives."""
    dynamics = Dynamics(graph)
    at = dynamics.at(0.0, state)
    ports = zip(dynamics.form.ports, at.efforts, strict=True)
    return {p.element.name: p.sign * at.flows[p.variable] * e for p, e in ports if e is not None}


@pytest.mark.parametrize(("com", "left"), [(0.1, 31), (0.0, 23)])
def test_the_sources_machine_is_simplified_by_this_much(com, left):
    linkage = source_machine(com)
    found = counts(linkage.graph)
    assert found[0] == Count("as built", len(linkage.graph.bonds))
    assert found[-1] == Count("all rules", left) == ("all rules", len(simplified(linkage).bonds))
    assert [count.bonds for count in found] == sorted((count.bonds for count in found), reverse=True)
    small = Reduction(simplified(linkage), linkage.coordinate, linkage.positions)
    assert_same_reduction(small(PHI), linkage.reduction()(PHI))


def touching(graph, *names):
    """The number of bonds at elements of either axis."""
    return len({bond.number for name in names for axis in "xy" for bond in graph.at(name.format(axis))})


def test_the_sources_steps_undone_give_forty_bonds_where_it_numbers_thirty_five():
    graph = source_machine(0.1).graph
    ours = touching(graph, "crank.{}", "crank.1.{}.sum", "crank.1.{}.arm")  # the source lists ten of these twelve
    last = {b.number for name in ("rod.y", "rod.2.y.sum", "rod.2.y.arm") for b in graph.at(name)}
    passed_on, between_arms = 4, 1  # 14, 17, 19 and 16, 18, 20 each become one; so do the two beside the last 0-junction
    assert (ours, len(last)) == (12, 6)
    assert 17 + between_arms + len(last) + passed_on + ours == 40
    joint, holds, slider = 2, 3, 1
    assert len(graph.bonds) == 40 + joint + holds + slider


@pytest.mark.parametrize("com", [0.1, 0.0])
def test_simplification_leaves_every_power_as_it_was(com):
    linkage = source_machine(com)
    state = [11.0, 0.9, float(linkage.positions["rod.theta"](0.9))]
    before, after = powers(linkage.graph, state), powers(simplified(linkage), state)
    assert {"M", "F", "B", "crank.J", "rod.J", "rod.m.x", "rod.m.y"} <= set(after)
    for name, power in after.items():
        assert_allclose(power, before[name], rtol=1e-12, atol=1e-12, err_msg=name)
    assert_allclose(sum(before.values()), 0.0, atol=1e-11)
    assert_allclose([power for name, power in before.items() if name not in after], 0.0, atol=1e-12)


def centre_held(rod):
    """The source's last step: the rod's centre of mass, not its end, is held to the line."""
    b = Builder().include("crank", Bar(0.2, 2.0, 0.1).body()).include("rod", rod.body(inlets=("1", "2")))
    pin(fix(b, "crank.1"), "crank.2", "rod.1").on("rod.y", Sf("hold", 0.0))
    for junction, elements in LOADS.items():
        b.on(junction, *elements)
    return simplify(drop_zero_velocity(b.build(loose=True)).graph).graph


def test_the_sources_last_step_leaves_nineteen_bonds_and_moves_another_machine():
    graph = centre_held(SIMPLE_ROD)
    assert len(graph.bonds) == 19  # 17, a junction between two transformers in a row, and the slider's own
    held = Reduction(graph, "crank.turn", {"rod.theta": lambda phi: -phi})(0.5).inertia  # both arms to the centre are 0.2 m
    true = source_machine(0.0).reduction()(0.5).inertia
    assert (held, true) == pytest.approx((0.2052, 0.1416), abs=5e-5)


def test_the_sources_last_step_is_right_where_the_rods_mass_is_at_the_slider():
    rod = Bar(0.6, 1.5, 0.05, 0.6)
    linkage = slider_crank(Bar(0.2, 2.0, 0.1), rod, on=LOADS)
    held = Reduction(centre_held(rod), "crank.turn", linkage.positions)
    assert_same_reduction(held(PHI), linkage.reduction()(PHI))


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: rigid_body(1.0, 1.0, {"end": (0.3,)}), r"pin 'end': found \(0.3,\), expected two finite lengths"),
        (lambda: rigid_body(1.0, 1.0, {"end": (0.3, np.nan)}), r"pin 'end': found \(0.3, nan\), expected two"),
        (lambda: rigid_body(1.0, 1.0, {"a": (0, 0)}, inlets=["b"]), "inlet 'b': no such pin; the body has a"),
        (lambda: slider_crank(Bar(0.2), Bar(0.0)), "rod: found 0.0, expected a positive length"),
        (lambda: slider_crank(Bar(-0.2), Bar(np.nan)), "(?s)crank: found -0.2.*rod: found nan"),
        (lambda: slider_crank(Bar(0.6), Bar(0.2), start=1.0), "rod: 0.2 m do not reach .* crank angle of 1 rad"),
        (lambda: four_bar(9.0, Bar(1.0), Bar(2.0), Bar(3.0)), "2 m and 3 m do not meet at a crank angle of 0 rad"),
        (lambda: four_bar(0.0, Bar(1.0), Bar(2.0), Bar(2.0)), "ground: found 0.0, expected a positive length"),
        (lambda: slider_crank(Bar(0.6, inertia=1.0), Bar(0.5)).reduction()(np.array([0.1, 1.0])), "crank angle of 1 rad"),
        (lambda: slider_crank(Bar(0.2), Bar(0.6), on={"ram": [Se("F", 1.0)]}), "no element 'ram'"),
    ],
)
def test_faults_are_named(build, message):
    with pytest.raises(GraphError, match=message):
        build()
