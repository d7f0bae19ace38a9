"""The reduction to one coordinate, and the positions that it counts."""

import numpy as np
import pytest
import sympy
from numpy.testing import assert_allclose

from bondgraph import GY, Builder, C, Dynamics, GraphError, I, Law, Modulus, Motion, One, R, Reduction, Se, Zero, reduce
from bondgraph.numerics import count, counted
from flywheel.numerics.intervals import Interval

PHI = np.linspace(0.1, 6.2, 23)
R_CRANK, L_ROD = 0.2, 0.6


def modulus(value, slope, of="crank"):
    return Modulus(value, slope, Motion(of))


SINE = modulus(lambda q: -0.5 * np.sin(q), lambda q: -0.5 * np.cos(q))


def chain():
    """crank -> rocker (modulated) -> ram (constant): inertia and force at the far end."""
    b = Builder()
    b.add(One("crank"))
    b.sum("rocker", [("crank", SINE)], "rotation")
    b.sum("ram", [("rocker", 2.0)], "translation")
    b.port("ram", I("m", 3.0))
    b.port("rocker", I("J", 4.0))
    b.port("ram", Se("F", 7.0))
    b.port("crank", R("damper", 1.5))
    return b.build()


def test_gains_multiply_along_the_chain():
    reduction = Reduction(chain(), "crank")
    flows = reduction.flows(PHI)
    assert_allclose(flows.gain[reduction.variable["ram"]], -np.sin(PHI), rtol=1e-15)
    assert_allclose(flows.slope[reduction.variable["ram"]], -np.cos(PHI), rtol=1e-15)


def test_reduced_quantities_are_sums_over_gains():
    reduced = reduce(chain(), PHI)
    rocker = -0.5 * np.sin(PHI)
    assert_allclose(reduced.inertia, 4 * rocker**2 + 3 * (2 * rocker) ** 2, rtol=1e-14)
    assert_allclose(reduced.slope, 2 * (4 + 12) * 0.25 * np.sin(PHI) * np.cos(PHI), rtol=1e-13, atol=1e-15)
    assert_allclose(reduced.moment, 7 * 2 * rocker, rtol=1e-14)
    assert_allclose(reduced.exchanged, np.abs(7 * 2 * rocker), rtol=1e-14)
    assert reduced.resistance == 1.5


def test_a_modulus_changed_in_mid_chain_changes_everything_downstream_and_nothing_upstream():
    graph = chain()
    before = Reduction(graph, "crank")
    doubled = modulus(lambda q: -1.0 * np.sin(q), lambda q: -1.0 * np.cos(q))
    after = Reduction(graph.with_law("crank->rocker", doubled), "crank")
    old, new = before.flows(PHI), after.flows(PHI)
    for name in ("rocker", "ram"):
        k = before.variable[name]
        assert_allclose(new.gain[k], 2 * old.gain[k], rtol=1e-14)
        assert_allclose(new.slope[k], 2 * old.slope[k], rtol=1e-14)
    assert new.gain[before.variable["crank"]] == 1.0
    assert_allclose(after(PHI).inertia, 4 * before(PHI).inertia, rtol=1e-14)
    assert_allclose(after(PHI).moment, 2 * before(PHI).moment, rtol=1e-14)


def test_a_modulus_on_a_geared_shaft_sees_that_shafts_angle():
    b = Builder().one("crank", displacement="phi")
    b.sum("cam", [("crank", 3.0)], "rotation")
    b.sum("valve", [("cam", modulus(np.sin, np.cos, "cam"))], "translation")
    b.port("valve", I("m", 1.0))
    reduced = reduce(b.build(), PHI)
    assert_allclose(reduced.inertia, 9 * np.sin(3 * PHI) ** 2, rtol=1e-12)
    assert_allclose(reduced.slope, 2 * 9 * 3 * np.sin(3 * PHI) * np.cos(3 * PHI), rtol=1e-11, atol=1e-12)


def test_zero_junctions_add_flows():
    b = Builder()
    b.add(One("crank"))
    b.sum("rod", [("crank", SINE)], "rotation")
    b.sum("point", [("crank", 2.0), ("rod", -3.0)], "translation")
    b.port("point", I("m", 1.0))
    reduced = reduce(b.build(), PHI)
    assert_allclose(reduced.inertia, (2 + 1.5 * np.sin(PHI)) ** 2, rtol=1e-14)


def slider_crank_by_closure():
    """The rod's speed is not given but follows from the closure: its far end has no velocity across the guide."""

    def tilt(q):
        return np.arcsin(R_CRANK / L_ROD * np.sin(q))

    def rate(q):
        return R_CRANK * np.cos(q) / (L_ROD * np.cos(tilt(q)))

    b = Builder()
    b.add(One("crank"))
    b.add(One("rod"))
    b.add(Zero("across"))
    b.transform("crank", "across", modulus(lambda q: R_CRANK * np.cos(q), lambda q: -R_CRANK * np.sin(q)))
    across = modulus(lambda q: -L_ROD * np.cos(tilt(q)), lambda q: L_ROD * np.sin(tilt(q)) * rate(q))
    b.transform("rod", "across", across)
    along = modulus(lambda q: -L_ROD * np.sin(tilt(q)), lambda q: -L_ROD * np.cos(tilt(q)) * rate(q))
    crank = modulus(lambda q: -R_CRANK * np.sin(q), lambda q: -R_CRANK * np.cos(q))
    b.sum("slider", [("crank", crank), ("rod", along)], "translation")
    b.port("slider", I("m", 3.0))
    b.port("rod", I("J", 0.5))
    return b.build()


def test_a_closed_loop_is_solved_and_equals_the_closed_form():
    reduced = reduce(slider_crank_by_closure(), PHI)
    root = np.sqrt(1 - (R_CRANK / L_ROD * np.sin(PHI)) ** 2)
    rod = R_CRANK / L_ROD * np.cos(PHI) / root
    slider = -R_CRANK * np.sin(PHI) - R_CRANK**2 / L_ROD * np.sin(PHI) * np.cos(PHI) / root
    inertia = 3 * slider**2 + 0.5 * rod**2
    assert_allclose(reduced.inertia, inertia, rtol=1e-13)
    step = 1e-5
    higher, lower = (reduce(slider_crank_by_closure(), PHI + d).inertia for d in (step, -step))
    assert_allclose(reduced.slope, (higher - lower) / (2 * step), rtol=1e-7, atol=1e-9)


def test_a_loop_that_locks_is_an_error():
    b = Builder()
    b.add(One("crank"))
    b.add(One("rod"))
    b.add(Zero("z"))
    b.transform("crank", "z", 1.0)
    b.transform("rod", "z", modulus(lambda q: 0.0 * q, lambda q: 0.0 * q))
    b.port("rod", I("J", 1.0))
    with pytest.raises(GraphError, match="lock or branch"):
        reduce(b.build(), PHI)


def test_two_degrees_of_freedom_are_refused_by_bond():
    b = Builder()
    b.add(One("crank"))
    b.add(One("other"))
    b.add(Zero("shaft"))
    b.bond("crank", "shaft")
    b.bond("shaft", "other")
    b.port("shaft", C("twist", Law(lambda here, anchor: here.q, Motion("crank"))))
    b.port("other", I("J", 1.0))
    with pytest.raises(GraphError, match="more than one degree of freedom"):
        reduce(b.build(), 0.0)


def test_over_constrained_graphs_are_refused():
    b = Builder()
    b.add(One("crank"))
    b.sum("a", [("crank", 2.0)], "rotation")
    b.add(Zero("z"))
    b.transform("crank", "z", 1.0)
    b.transform("a", "z", 1.0)
    b.port("a", I("J", 1.0))
    with pytest.raises(GraphError, match="over-constrained"):
        reduce(b.build(), 0.0)


def test_gyrators_and_wrong_coordinates_are_refused():
    b = Builder()
    b.add(One("crank"))
    b.add(One("coil"))
    b.add(GY("motor", 2.0))
    b.bond("coil", "motor")
    b.bond("motor", "crank")
    b.port("coil", I("L", 1.0))
    b.port("crank", I("J", 1.0))
    with pytest.raises(GraphError, match="adds a state of its own"):
        reduce(b.build(), 0.0)
    with pytest.raises(GraphError, match="no 1-junction"):
        reduce(chain(), 0.0, coordinate="m")


def test_compliances_take_power_and_unknown_sources_are_kept_apart():
    b = Builder()
    b.add(One("crank"))
    motion = Motion("crank")
    b.port("crank", C("spring", Law(lambda here, anchor: 5.0 * here.q, motion)))
    b.port("crank", Se("drive", Law(lambda here, anchor: 0.0, motion, lambda here, anchor: 2.0)))
    b.port("crank", I("J", 1.0))
    reduced = reduce(b.build(), PHI)
    assert_allclose(reduced.moment, -5.0 * PHI, rtol=1e-15)
    assert_allclose(reduced.per_unknown + 0 * PHI, 2.0)
    parts = Reduction(b.build(), "crank").moments(PHI, unknown=3.0)
    assert_allclose(parts["drive"] + 0 * PHI, 6.0)


def test_power_is_conserved_through_every_transformer():
    """Sum of e f at the crank equals the sum over the ports: M* is exactly the effort that balances the loads."""
    reduction = Reduction(chain(), "crank")
    flows = reduction.flows(PHI)
    load_power = 7.0 * flows.gain[reduction.variable["ram"]]
    assert_allclose(reduction(PHI).moment * 1.0, load_power, rtol=1e-15)


def test_laws_see_the_anchor_of_their_piece():
    b = Builder()
    b.add(One("crank"))
    b.port("crank", Se("step", Law(lambda here, anchor: np.where(anchor.q < 1.0, 2.0, 3.0), Motion("crank"))))
    b.port("crank", I("J", 1.0))
    graph = b.build()
    assert reduce(graph, np.array([1.0]), anchor=np.array([0.5])).moment == 2.0
    assert reduce(graph, np.array([1.0]), anchor=np.array([1.5])).moment == 3.0


def machine():
    """Functions as moduli, a gear, a spring with a law of its own, a force that varies with the crank's angle."""
    b = Builder().one("crank", displacement="theta", initial=0.4).one("rod").one("ram", displacement="x").one("cam")
    b.transform("crank", "rod", lambda theta: -0.3 * np.cos(theta) / np.sqrt(1 - (0.3 * np.sin(theta)) ** 2))
    b.transform("crank", "ram", sympy.sympify("-sin(theta)/5")).transform("crank", "cam", -2.5)
    b.on("crank", I("J", 0.2), Se("M", lambda theta: 3.0 + np.sin(theta))).on("rod", I("K", 0.5)).on("ram", I("m", 2.0))
    return b.on("ram", C("spring", lambda q: 40.0 * q + q**3)).on("cam", I("L", 0.1), R("brake", 0.05)).build()


def test_the_reduced_equation_of_motion_is_that_of_the_whole_graph():
    """I* theta'' = M* - dI*/dtheta theta'^2 / 2 - R* theta', with the spring's displacement as a function of theta."""
    graph, omega = machine(), 2.0
    spring = {"spring": lambda theta: 0.2 * (np.cos(theta) - np.cos(0.4))}
    reduced = reduce(graph, PHI, positions=spring)
    expected = (reduced.moment - 0.5 * reduced.slope * omega**2 - reduced.resistance * omega) / reduced.inertia
    dynamics = Dynamics(graph)
    assert dynamics.names == ("p_J", "q_spring", "theta", "x")
    rates = dynamics.at(0.0, [0.2 * omega, spring["spring"](PHI), PHI, 0.0 * PHI]).rates
    assert_allclose(rates[0] / 0.2, expected, rtol=1e-11, atol=1e-11)


def test_slopes_of_functions_are_those_of_differences():
    reduction, step = Reduction(machine(), "crank", {"spring": lambda theta: 0.0 * theta}), 1e-5
    inertia = [reduction(PHI + d).inertia for d in (-step, step)]
    assert_allclose(reduction(PHI).slope, (inertia[1] - inertia[0]) / (2 * step), rtol=1e-7, atol=1e-9)


def test_one_position_is_as_many():
    reduction = Reduction(machine(), "crank", {"spring": lambda theta: 0.1 * np.sin(theta)})
    together = reduction(PHI)
    for k, phi in enumerate(PHI.tolist()):
        alone = reduction(phi)
        for whole, one in zip(together, alone, strict=True):
            assert_allclose(np.broadcast_to(whole, PHI.shape)[k], one, rtol=1e-14, atol=1e-15)


def test_the_coordinate_only_scales():
    """Seen from the cam, which turns -2.5 times as fast: I* / 6.25, M* / -2.5."""
    b = Builder().one("crank", displacement="theta").one("cam").transform("crank", "cam", -2.5)
    graph = b.on("crank", I("J", 0.2), Se("M", 5.0)).on("cam", I("L", 0.1), R("brake", 0.05)).build()
    crank, cam = reduce(graph, 0.0), reduce(graph, 0.0, "cam")
    assert_allclose([cam.inertia, cam.moment, cam.resistance], [crank.inertia / 6.25, -2.0, crank.resistance / 6.25])


def test_what_is_no_function_of_position_is_refused():
    def graph(law):
        return Builder().signal("u").one("crank", displacement="theta").on("crank", I("J", 1.0), Se("M", law)).build()

    with pytest.raises(GraphError, match="MSe:M depends on the time"):
        reduce(graph(lambda t: t), 0.0)
    with pytest.raises(GraphError, match="MSe:M depends on the signal 'u'"):
        reduce(graph(lambda u: u), 0.0)
    with pytest.raises(GraphError, match="R:brake follows a law of its own"):
        reduce(machine().with_law("brake", lambda f: f**3), 0.0, positions={"spring": lambda q: q})
    with pytest.raises(GraphError, match=r"give positions=.*'spring'"):
        reduce(machine(), 0.0)


def moving():
    """Brakes on crank and ram that see their own flow, the crank's, and the time; an unknown factor on one of them."""
    drag = Law(lambda here, anchor: -2.0 * here.flow * abs(here.flow), Motion("crank"), moving=True)
    pulse = Law(lambda here, anchor: np.sin(here.q) * here.time, Motion("crank"), moving=True)
    unknown = Law(lambda here, anchor: 0.5 * here.speed, Motion("crank"), lambda here, anchor: here.speed, moving=True)
    b = Builder().one("crank", "rotation", displacement="phi").one("ram", "translation").transform("crank", "ram", SINE)
    b.on("crank", I("J", 2.0), Se("pulse", pulse), Se("T", 9.0), R("film", 0.25)).on("ram", I("m", 3.0), Se("drag", drag))
    return b.on("crank", Se("brake", unknown, part="brake of the crank")).build()


def test_moving_sources_are_no_part_of_the_moment_of_positions():
    reduction = Reduction(moving(), "crank")
    assert reduction.moving
    assert not Reduction(chain(), "crank").moving
    reduced = reduction(PHI)
    assert_allclose(reduced.moment, 9.0)
    assert_allclose(reduced.per_unknown, 0.0)
    assert_allclose(reduced.resistance, 0.25)


def test_moving_sources_follow_for_any_speeds_and_times():
    station = Reduction(moving(), "crank").at(PHI)
    gain = -0.5 * np.sin(PHI)
    for speed, time in ((3.0, 0.0), (np.linspace(-2, 5, PHI.size), 1.5)):
        result = {element.name: (effort, factor) for element, effort, factor in station.contributions(speed, time)}
        assert_allclose(result["drag"][0], -2.0 * gain * speed * np.abs(gain * speed) * gain, rtol=1e-14, atol=1e-16)
        assert_allclose(result["pulse"][0], np.sin(PHI) * time, rtol=1e-14)
        assert_allclose(result["brake"][0], 0.5 * speed + 0 * PHI, rtol=1e-14)
        assert_allclose(result["brake"][1], speed + 0 * PHI, rtol=1e-14)
        assert_allclose(result["drag"][1], 0.0)
    assert_allclose(station.reduced.moment, 9.0)
    assert_allclose(station.moments()["T"], 9.0)
    assert set(station.moments()) == {"T"}
    assert_allclose(station.resistances()["film"], 0.25)


def test_moments_at_a_speed_add_up():
    reduction = Reduction(moving(), "crank")
    parts = reduction.moments(PHI, unknown=4.0, speed=3.0, time=2.0)
    assert set(parts) == {"T", "pulse", "drag", "brake of the crank", "film"}
    gain = -0.5 * np.sin(PHI)
    true = 9.0 + 2 * np.sin(PHI) - 18.0 * gain * np.abs(gain) * gain + 4.5 * 3.0 - 0.25 * 3.0
    assert_allclose(sum(parts.values()), true, rtol=1e-13)
    assert set(reduction.moments(PHI, unknown=4.0)) == {"T"}  # without a speed: of positions alone
    assert "brake" in reduction.moments(PHI, speed=3.0, by_name=True)


def test_branches_are_decided_at_the_anchor_or_at_the_position_itself():
    """A law that bends at |v| = 1: in the middle of a piece it is past that, near its end it is not."""
    law = Law(
        lambda here, anchor: np.where(np.abs(anchor.flow) > 1.0, 10.0 * (np.abs(here.flow) - 1.0), 0.0),
        Motion("crank"),
        moving=True,
    )
    b = Builder().one("crank", "rotation", displacement="phi").one("ram", "translation").transform("crank", "ram", SINE)
    graph = b.on("crank", I("J", 2.0)).on("ram", I("m", 1.0), Se("F", law)).build()
    phi, middle, speed = np.array([0.1, 1.0]), np.array([1.5, 1.5]), 4.0
    gain = -0.5 * np.sin(phi)
    station = Reduction(graph, "crank").at(phi, middle)
    past = 10.0 * (np.abs(gain * speed) - 1.0)

    def effort(*speeds, **local):
        return station.contributions(*speeds, **local)[0][1]

    assert_allclose(effort(speed), gain * np.maximum(past, 0.0), rtol=1e-14)
    assert_allclose(effort(speed, 0.0, speed), gain * past, rtol=1e-14)
    assert_allclose(effort(speed, 0.0, speed, local=True), gain * np.maximum(past, 0.0), rtol=1e-14)
    assert_allclose(effort(speed, 0.0, 0.1 * speed), 0.0)  # there the anchor's own speed is too low
    ((element, here, anchor),) = station.places(speed, 7.0, 0.5 * speed, 3.0)
    assert (element.name, here.time, anchor.time) == ("F", 7.0, 3.0)
    assert_allclose(here.flow, gain * speed)
    assert_allclose(anchor.flow, -0.5 * np.sin(1.5) * 2.0)


def test_some_elements_alone():
    graph = moving()
    whole = Reduction(graph, "crank")
    only = whole.part({"m", "drag", "film"})
    assert_allclose(only(PHI).inertia, whole(PHI).inertia - 2.0, rtol=1e-13, atol=1e-15)
    assert_allclose(only(PHI).moment, 0.0)
    assert_allclose(only(PHI).resistance, 0.25)
    assert [element.name for element, _, _ in only.at(PHI).contributions(3.0)] == ["drag"]
    rest = whole.part({"J", "T", "pulse", "brake"})
    for name in ("inertia", "slope", "moment", "resistance"):
        both = getattr(only(PHI), name) + getattr(rest(PHI), name)
        assert_allclose(both, getattr(whole(PHI), name), rtol=1e-13, atol=1e-15)
    assert not whole.part({"m"}).moving


@pytest.mark.parametrize(
    ("ratio", "force", "said"),
    [
        (lambda phi: 1 / phi, 0.0, "no reduction at crank = 0: the ratio of MTF:T is inf"),
        (lambda phi: np.sqrt(phi), 0.0, "no reduction at crank = 0: the ratio's slope of MTF:T is inf"),
        (lambda phi: np.cos(phi), lambda phi: np.log(phi), "no reduction at crank = 0: the effort of MSe:F is -inf"),
    ],
)
def test_what_has_no_finite_value_is_refused_with_element_and_angle(ratio, force, said):
    b = Builder().one("crank", displacement="phi").one("ram").on("ram", I("m", 4.0)).on("crank", Se("F", force))
    graph = b.transform("crank", "ram", ratio, name="T").build()
    for at in (0.0, np.array([1.0, 0.0, 2.0])):
        with pytest.raises(GraphError, match=said):
            reduce(graph, at)
    assert np.all(np.isfinite(reduce(graph, np.array([1.0, 2.0])).inertia))


def test_positions_are_counted_whatever_they_come_as():
    with counted() as tally:
        count(3)
        count(np.zeros((4, 5)))
        count(0.5)
        count(np.float64(0.5))
        count(Interval(np.zeros(6), np.ones(6)))
        count(Interval(0.0, 1.0))
    assert tally.evaluations == 3 + 20 + 1 + 1 + 6 + 1


def test_nobody_pays_who_does_not_count():
    count(3)
    with counted() as tally:
        pass
    count(3)
    assert tally.evaluations == 0


def test_an_inner_tally_counts_for_the_outer_one_too():
    with counted() as outer:
        count(1)
        with counted() as inner:
            count(10)
        count(100)
    assert (inner.evaluations, outer.evaluations) == (10, 111)


def test_a_tally_that_was_left_by_an_error_counts_no_further():
    tallies = []

    def left():
        with counted() as tally:
            tallies.append(tally)
            count(2)
            raise ValueError("enough")

    with pytest.raises(ValueError, match="enough"):
        left()
    count(5)
    assert tallies[0].evaluations == 2


def test_every_walk_of_a_graph_counts_its_positions():
    graph = Builder().one("crank", displacement="phi").on("crank", I("J", 2.0), Se("M", 5.0)).build()
    reduction = Reduction(graph, "crank")
    with counted() as tally:
        reduction(np.zeros(7))
        reduction.at(np.zeros((2, 3))).reduced  # noqa: B018
        reduction.flows(0.0)
        reduction.moments(np.zeros(4))
    assert tally.evaluations == 7 + 6 + 1 + 4
