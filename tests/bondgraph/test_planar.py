"""Planar mechanisms as bond graphs, and the slider-crank by every method."""

import doctest

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

import flywheel
from bondgraph import Builder, Dynamics, GraphError, I, R, Reduction, Se, Sf, drop_zero_velocity, reduce, simplify
from examples.bond_graphs import planar
from examples.bond_graphs.compare_methods import (
    HARMONIC,
    STEADY,
    Imposed,
    Loads,
    SliderCrank,
    agreement,
    compare_kinematics,
    compare_motion,
    compare_torques,
    divided_by_modulus,
    exact_inertia,
    natural_coordinates,
    printed_programme,
    raven,
    small_ratio_inertia,
    triangle,
)
from examples.bond_graphs.planar import Bar, counts, fix, four_bar, pin, rigid_body, slide, slider_crank

# Plane linkages: the body's own kinematics, then slider-crank and four-bar against their condensed graphs.


G = 9.80665
CRANK = {"length": 0.2, "mass": 2.0, "inertia": 0.1, "com": 0.07, "com_angle": 0.3}
ROD = {"length": 0.6, "mass": 1.5, "inertia": 0.05, "com": 0.2, "com_angle": -0.4}
ROCKER = {"length": 0.5, "mass": 1.1, "inertia": 0.02, "com": 0.3, "com_angle": 0.1}
GROUND, SLIDER, COUPLE, FORCE = 0.65, 3.0, 40.0, -300.0
CLOSE = [1e-9, np.pi - 1e-9, np.pi, np.pi + 1e-7, 1e-5]  # to the dead centres
PHI = np.concatenate([np.linspace(0, 2 * np.pi, 181), CLOSE])
LENGTHS = st.floats(-1.0, 1.0)
ANGLES = st.floats(-7.0, 7.0)


def test_examples_in_the_docstrings():
    results = doctest.testmod(planar)
    assert results.failed == 0
    assert results.attempted > 10


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
    result = four_bar(GROUND, *(Bar(**bar) for bar in bars.values()), crossed=assembly == "crossed", on=on, gravity=G)
    return condensed(mechanism, "rocker"), result


MACHINES = [(slider_cranks, 0.0), (slider_cranks, 0.15), (slider_cranks, -0.3), (four_bars, "open"), (four_bars, "crossed")]


def simplified(linkage):
    return simplify(drop_zero_velocity(linkage.graph).graph).graph


def assert_same_reduction(result, expected):
    for name in ("inertia", "slope", "moment"):
        figure = getattr(expected, name)
        assert_allclose(getattr(result, name), figure, rtol=0, atol=1e-12 * np.max(np.abs(figure)), err_msg=name)
    assert_allclose(result.inertia, expected.inertia, rtol=1e-12)


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
    state = {"p_body.J": 0.5 * omega, "p_body.m.x": 2.0 * vx, "p_body.m.y": 2.0 * vy, "body.theta": theta}
    flows = dynamics.at(0.0, [state[name] for name in dynamics.names]).flows
    arm = (x + 1j * y) * np.exp(1j * theta)
    velocity = vx + 1j * vy + 1j * omega * arm
    result = [flows[dynamics.graph.at(f"body.end.{axis}")[0].number] for axis in "xy"]
    assert_allclose(result, [velocity.real, velocity.imag], atol=1e-15)


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
    assert dynamics.names == ("p_body.J", "body.theta")
    assert_allclose(rates, [0.5 * -2 * G * 0.3 * np.cos(0.4) / (0.5 + 2 * 0.09), 0.0], rtol=1e-14)


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
        crank = reference.graph.constant(reference.names[0].removeprefix("p_"))
        expected = reference.rates(0.0, crank * omega, phi, *[phi] * len(reference.anchored))[0] / crank
        for dynamics in (whole, small):
            own = dynamics.graph.constant("crank.J")
            result = dynamics.rates(0.0, own * omega, phi, *others)[0] / own
            assert_allclose(result, expected, rtol=1e-12, atol=1e-12 * omega**2)


def test_angles_that_are_integrated_move_as_their_closed_form(machine):
    _, linkage = machine
    dynamics, phi, omega, step = Dynamics(linkage.graph), 1.1, 3.0, 1e-6
    rates = dynamics.rates(
        0.0, linkage.graph.constant("crank.J") * omega, phi, *(float(angle(phi)) for angle in linkage.positions.values())
    )
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
    for result in (graph, simplify(graph).graph):
        assert_same_reduction(Reduction(result, "crank.turn", theta)(PHI), expected)


LOADS = {"crank.turn": [Se("M", COUPLE)], "rod.2.x": [Se("F", FORCE), R("B", 5.0)]}
SIMPLE_ROD = Bar(0.6, 1.5, 0.05, 0.2)


def source_machine(com):
    return slider_crank(Bar(0.2, 2.0, 0.1, com), SIMPLE_ROD, on=LOADS)


def powers(graph, state):
    """Effort times flow into every one-port, by name."""
    at = Dynamics(graph).at(0.0, state)
    bonds = {e.name: graph.bond_of(e.name) for e in graph.of_kind("I", "R", "Se")}
    return {name: b.sign(name) * at.flows[b.number] * at.efforts[b.number] for name, b in bonds.items()}


@pytest.mark.parametrize(("com", "left"), [(0.1, 31), (0.0, 23)])
def test_the_sources_machine_is_simplified_by_this_much(com, left):
    linkage = source_machine(com)
    result = counts(linkage.graph)
    assert result["as built"] == len(linkage.graph.bonds)
    assert result["all rules"] == left == len(simplified(linkage).bonds)
    assert list(result.values()) == sorted(result.values(), reverse=True)
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
    state = Reduction(graph, "crank.turn", {"rod.theta": lambda phi: -phi})(0.5).inertia  # both arms to the centre are 0.2 m
    true = source_machine(0.0).reduction()(0.5).inertia
    assert (state, true) == pytest.approx((0.2052, 0.1416), abs=5e-5)


def test_the_sources_last_step_is_right_where_the_rods_mass_is_at_the_slider():
    rod = Bar(0.6, 1.5, 0.05, 0.6)
    linkage = slider_crank(Bar(0.2, 2.0, 0.1), rod, on=LOADS)
    state = Reduction(centre_held(rod), "crank.turn", linkage.positions)
    assert_same_reduction(state(PHI), linkage.reduction()(PHI))


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


# The slider-crank of `examples/bond_graphs/compare_methods.py`: closed forms, agreement of methods, and dead centres.


angles = st.floats(-10.0, 10.0)
ratios = st.floats(0.05, 0.95)


@given(angles, ratios)
def test_triangle_is_the_law_of_cosines(theta, ratio):
    machine = SliderCrank(ratio, 1.0)
    x = triangle(machine, theta, 1.0, 0.0).position
    assert_allclose(x**2 + ratio**2 - 2 * x * ratio * np.cos(theta), 1.0, rtol=1e-12)


@given(angles, ratios, st.sampled_from([0.0, 0.5, 1.0]))
def test_slopes_are_derivatives(theta, ratio, share):
    machine, h = SliderCrank(ratio, 1.0), 1e-6
    before, after = machine.along(share, theta - h), machine.along(share, theta + h)
    _, slope, bend = machine.along(share, theta)
    assert_allclose((after[0] - before[0]) / (2 * h), slope, atol=1e-8)
    assert_allclose((after[1] - before[1]) / (2 * h), bend, atol=1e-6)
    swing_before, swing_after = machine.swing(theta - h)[0], machine.swing(theta + h)[0]
    assert_allclose((swing_after - swing_before) / (2 * h), machine.swing(theta)[1], atol=1e-6)


@given(angles, ratios, st.sampled_from([0.0, 2.0]), st.sampled_from([0.0, -3.0]))
def test_a_closed_loop_and_natural_coordinates_give_the_triangle(theta, ratio, omega, alpha):
    machine = SliderCrank(ratio, 1.0)
    exact = triangle(machine, theta, omega, alpha)
    for method in (raven, natural_coordinates):
        assert_allclose(method(machine, theta, omega, alpha), exact, rtol=1e-12, atol=1e-11)


def test_natural_coordinates_pass_dead_centres_and_quarter_turns():
    theta = np.arange(9) * np.pi / 4  # where either of both driving equations alone is singular
    exact, result = (method(SliderCrank(), theta, 1.0, 1.0) for method in (triangle, natural_coordinates))
    assert_allclose(result, exact, atol=1e-14)


def test_middle_term_of_the_acceleration():
    theta, ratio = 0.3, 0.5
    w = np.sqrt(1 - (ratio * np.sin(theta)) ** 2)
    rest = ratio * np.cos(2 * theta) / w + np.cos(theta)
    true = ratio**3 / 4 * np.sin(2 * theta) ** 2 / w**3
    assert_allclose(-triangle(SliderCrank(), theta, 1.0, 0.0).acceleration, rest + true, rtol=1e-14)
    assert rest + true == pytest.approx(1.38288, abs=5e-6)
    assert rest + ratio**2 / 2 * np.sin(2 * theta) / w**3 == pytest.approx(1.44554, abs=5e-6)  # as printed


@settings(max_examples=12)
@given(angles, ratios, st.sampled_from([0.0, 2.5]))
def test_exact_inertia_is_the_graph_reduced(theta, ratio, rod):
    machine = SliderCrank(0.7 * ratio, 0.7, 0.4, rod, 1.3)
    reduced, exact = reduce(machine.builder().build(), theta), exact_inertia(machine, theta)
    assert_allclose(exact.value, reduced.inertia, rtol=1e-12)
    assert_allclose(exact.slope, reduced.slope, rtol=1e-9, atol=1e-12)


def test_small_ratio_is_the_limit_of_the_exact_inertia():
    theta = np.linspace(0.0, 2 * np.pi, 60)

    def gap(length):
        machine = SliderCrank(1.0, length)
        return np.abs(small_ratio_inertia(machine, theta).value - exact_inertia(machine, theta).value).max()

    assert gap(2000.0) < 2e-3
    assert gap(200.0) / gap(2000.0) == pytest.approx(10.0, rel=0.01)


def test_the_slip_of_the_rods_inertia_is_a_quarter_too_much():
    machine = SliderCrank()
    centre, end = (float(small_ratio_inertia(machine, 0.0, about=about).value) for about in ("centre", "end"))
    assert centre == pytest.approx(1 / 3 + 1 / 3)  # at a dead centre the rod turns about its end: m l²/3, times lambda²
    assert end - centre == pytest.approx(0.25)
    assert centre == pytest.approx(float(exact_inertia(machine, 0.0).value))


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"radius": 2.0}, "longer than the crank"),
        ({"slider": 0.0}, "slider: found 0.0"),
        ({"rod": -1.0}, "rod: found -1.0"),
        ({"crank": np.nan, "length": -1.0}, "length: found -1.0.*\ncrank: found nan"),
    ],
)
def test_machines_that_are_none(arguments, says):
    with pytest.raises(GraphError, match=says):
        SliderCrank(**arguments)


def test_a_rods_inertia_is_about_its_centre_or_its_end():
    with pytest.raises(GraphError, match="about: found 'pin'"):
        small_ratio_inertia(SliderCrank(), 0.0, about="pin")


def test_two_coefficients_that_are_not_the_same():
    t = np.linspace(0.0, 2 * np.pi, 500, endpoint=False)
    wave = np.sin(t)
    assert_allclose(agreement(wave, wave), (1.0, 1.0, 0.0, 0.0))
    assert_allclose(agreement(3 * wave + 1, wave)[:2], (1.0, np.sqrt(5.0)))
    assert_allclose(agreement(-wave, wave)[:2], (-1.0, np.sqrt(3.0)))
    assert agreement(2.0 * wave, wave).coefficient == pytest.approx(0.0, abs=1e-7)
    assert agreement(2.0 * wave, wave).greatest == pytest.approx(1.0)


def test_pearson_is_numpys():
    values, other = np.array([3.0, -1.0, 4.0, 1.5, -9.0]), np.arange(5) ** 2.0
    assert_allclose(agreement(values, other).pearson, np.corrcoef(values, other)[0, 1], atol=1e-9)


@pytest.mark.parametrize(
    ("curve", "reference", "says"),
    [
        ([1.0, 1.0], [0.0, 1.0], "does not vary"),
        ([0.0, 1.0], [1.0, 1.0], "does not vary"),
        ([0.0, np.inf], [0.0, 1.0], "no numbers"),
        ([0.0, 1.0, 2.0], [0.0, 1.0], "same times"),
    ],
)
def test_curves_without_a_correlation(curve, reference, says):
    with pytest.raises(GraphError, match=says):
        agreement(curve, reference)


@pytest.mark.slow
def test_graph_agrees_with_triangle_to_the_order_of_the_method():
    coarse, fine = (compare_kinematics(until=1.0, step=step) for step in (0.1, 0.05))
    for name in ("position", "velocity", "acceleration"):
        gain = {m: coarse[name].agreement(m).greatest / fine[name].agreement(m).greatest for m in ("euler", "rk2", "rk4")}
        assert_allclose([gain["euler"], gain["rk2"], gain["rk4"]], [2, 4, 16], rtol=0.25)
        assert fine[name].agreement("DOP853").greatest < 1e-10
        assert fine[name].agreement("DOP853").pearson == pytest.approx(1.0, abs=1e-12)


@pytest.mark.slow
def test_steady_crank_has_its_angle_right_by_any_method():
    result = compare_kinematics(imposed=STEADY, until=0.3, step=0.02)
    assert result["velocity"].agreement("euler").greatest < 1e-11
    assert result["position"].agreement("euler").greatest > 1e-2
    assert result["acceleration"].agreement("rk2").greatest < 1e-10


def test_free_motion_by_three_equations():
    result = compare_motion()
    for name in ("theta", "omega", "alpha", "position", "velocity", "acceleration"):
        for method in ("bond graph", "natural coordinates"):
            assert result[name].agreement(method).greatest < 1e-9
    assert result["omega"].agreement("small lambda").pearson == pytest.approx(0.9067, abs=1e-4)
    assert result["omega"].agreement("small lambda, m l²/3").pearson == pytest.approx(0.3813, abs=1e-4)


def test_motion_from_rest_has_the_energy_of_its_torque():
    result, machine = compare_motion(omega=0.0, torque=2.0, until=1.5, points=20), SliderCrank()
    for method in ("bond graph", "natural coordinates"):
        theta, omega, alpha, x, v, a = (quantity.curves[method] for quantity in result.quantities)
        inertia = exact_inertia(machine, theta)
        assert theta[-1] > 1.5
        assert_allclose(0.5 * inertia.value * omega**2, 2.0 * theta, atol=1e-10)
        assert_allclose(inertia.torque(omega, alpha), 2.0, atol=1e-9)
        assert_allclose(np.stack([x, v, a]), triangle(machine, theta, omega, alpha), atol=1e-9)


@pytest.mark.slow
def test_approximate_and_printed_curves_beside_the_triangle():
    result = compare_kinematics(imposed=STEADY, until=2 * np.pi / 5, step=np.pi / 50)
    mean = result["position less its mean"].agreement("small lambda (eq. 86)")
    assert mean.greatest == pytest.approx(0.0114, abs=5e-4)  # a turn's mean, its end counted twice
    assert result["velocity"].agreement("instant centre").greatest < 1e-13
    assert max(result[name].agreement("Raven").greatest for name in ("position", "velocity", "acceleration")) < 1e-12
    assert "instant centre" not in result["acceleration"].curves
    printed = result["acceleration"].residual("as printed")
    theta = 5.0 * result.t
    w = np.sqrt(1 - 0.25 * np.sin(theta) ** 2)
    middle = 0.125 / 4 * np.sin(2 * theta) ** 2 / w**3 - 0.25 / 2 * np.sin(2 * theta) / w**3
    assert_allclose(printed, 25.0 * middle, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("imposed", "off"), [(HARMONIC, 0.716), (STEADY, 22.0)])
def test_torque_that_imposes_a_motion(imposed, off):
    torque = compare_torques(imposed=imposed, until=3.0 if imposed is STEADY else 10.0)["torque"]
    assert torque.agreement("bond graph").greatest < 1e-9
    slip, sound = (torque.agreement(name) for name in ("small lambda, m l²/3", "small lambda"))
    assert sound.greatest == pytest.approx(off, rel=2e-3)
    if imposed is STEADY:  # Pearson's r cannot tell the two wrong torques apart
        assert slip.pearson == pytest.approx(sound.pearson, abs=1e-12)
        assert slip.coefficient < sound.coefficient - 0.005


@pytest.mark.slow
def test_motion_that_does_not_start_at_zero():
    imposed = Imposed("theta = 1 + t²", lambda t: 1.0 + t * t, lambda t: 2.0 * t, lambda t: 2.0 + 0.0 * t)
    assert compare_torques(imposed=imposed, until=0.2, points=51)["torque"].agreement("bond graph").greatest < 1e-8


def test_table_and_names_that_are_not_there():
    result = compare_motion(until=1.0, points=20)
    lines = result.table().splitlines()
    assert lines[0] == "free motion from 1 rad/s; reference: exact Lagrange"
    assert len(lines) == 2 + 6 * 5
    assert {len(line) for line in lines[1:]} == {106}
    with pytest.raises(
        GraphError, match="no quantity 'speed': there are theta, omega, alpha, position, velocity, acceleration"
    ):
        result["speed"]
    with pytest.raises(GraphError, match="theta: no method 'newton': there are bond graph"):
        result["theta"].agreement("newton")


def test_arguments_that_mean_nothing():
    with pytest.raises(GraphError, match="points: found 1"):
        compare_torques(points=1)
    with pytest.raises(GraphError, match="until: found -1"):
        compare_motion(until=-1.0)


@pytest.mark.slow
def test_without_torque_the_printed_modulus_stops_at_the_first_dead_centre():
    result = divided_by_modulus(steps=(1e-2, 1e-3))
    assert_allclose(result.errors("|T|"), [1.12, 1.10], atol=0.01)
    assert_allclose([p.reached for p in result.passages if p.scheme == "|T|"], np.pi, atol=0.01)
    assert_allclose([p.reached for p in result.passages if p.scheme == "T, floor"], np.pi, atol=0.01)
    assert result.reached == pytest.approx(9.1352, abs=1e-4)


@pytest.mark.slow
def test_with_torque_it_runs_away_at_every_step():
    result = divided_by_modulus(loads=Loads(torque=1.0), steps=(2e-2,))
    assert result.errors("|T|") == (np.inf,)
    assert min(result.errors("T")) > 10.0
    assert min(result.errors("T, floor")) > 5.0


def test_crank_side_is_of_first_order():
    coarse, fine = divided_by_modulus(loads=Loads(1.0, 0.5, 0.2), steps=(4e-3, 2e-3), until=2.0).errors("crank side")
    assert coarse / fine == pytest.approx(2.0, rel=0.1)


def test_dead_centre_from_the_start():
    result = divided_by_modulus(start=(0.0, 1.0), steps=(1e-2,), until=1.0)
    assert result.errors("|T|") == (np.inf,)
    assert result.errors("crank side")[0] < 0.1


def test_printed_programme_tends_to_another_curve():
    steps = (1e-2, 1e-3)
    assert_allclose(printed_programme(None, HARMONIC, steps=steps), 1.32, atol=0.01)
    assert_allclose(printed_programme(None, STEADY, steps=steps), 5.616, atol=0.001)
    assert_allclose(printed_programme(None, HARMONIC, steps=steps, torque="needed"), 1.31, atol=0.02)


def test_printed_programme_on_a_dead_centre():
    (error,) = printed_programme(until=2 * np.pi, steps=(2 * np.pi / 1000,))
    assert error > 1e9


def test_schemes_that_are_not_there():
    with pytest.raises(GraphError, match="no scheme 'x': there are"):
        divided_by_modulus(steps=(0.1,)).errors("x")


def test_arguments_of_the_dead_centres_that_mean_nothing():
    with pytest.raises(GraphError, match="torque: found 'some'"):
        printed_programme(torque="some")
    with pytest.raises(GraphError, match=r"steps: found 0\.0"):
        divided_by_modulus(steps=(0.1, 0.0))
    with pytest.raises(GraphError, match="floor: found -1"):
        divided_by_modulus(floor=-1.0)
