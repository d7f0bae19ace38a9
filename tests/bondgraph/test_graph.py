"""Graphs as they are built, and what is refused."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bondgraph import (
    DOMAINS,
    GY,
    TF,
    Bond,
    BondGraph,
    Builder,
    C,
    Displacement,
    Dynamics,
    Element,
    GraphError,
    I,
    Law,
    Modulus,
    Motion,
    One,
    Part,
    R,
    Reduction,
    Se,
    Sf,
    WordGraph,
    Zero,
    as_data,
    causality,
    draw,
    reduce,
    simplify,
    simulate,
    svg,
    table,
)
from bondgraph.graph import (
    Relation,
    SolutionStep,
    neighbours,
    places,
    plan,
    reached_from,
    relations,
    representatives,
    variables,
)

# A graph's elements, bonds and laws, what hangs together, the relations of its junctions and their order.


def two_shafts(ratio: float = 3.0) -> Builder:
    b = Builder()
    b.add(One("crank"))
    b.sum("wheel", [("crank", ratio)], "rotation")
    b.port("wheel", I("J", 2.0))
    b.port("crank", Se("M", 5.0))
    return b


def test_bonds_are_numbered_in_order_and_half_arrows_follow_power():
    graph = two_shafts().build()
    assert [b.number for b in graph.bonds] == [1, 2, 3, 4]
    assert graph.at("J")[0].head == "J"  # power flows into an inertia
    assert graph.at("M")[0].tail == "M"  # and out of a source


def test_with_law_changes_one_element_and_leaves_the_graph_alone():
    graph = two_shafts().build()
    other = graph.with_law("crank->wheel", 4.0)
    assert graph.elements["crank->wheel"].law == 3.0
    assert other.elements["crank->wheel"].law == 4.0


def test_linear_laws_are_one_constant_and_curves_are_functions_of_their_own_flow_or_displacement():
    b = Builder().parameter(k=2.0).one("a", displacement="x").on("a", I("J", 2.0), R("r", lambda k: 3.0 * k))
    b.on("a", R("curve", lambda f, k: k * f**3), R("rub", lambda x: 1.0 + x**2), C("spring", lambda q: q**3))
    graph = b.on("a", Se("M", lambda t: t), C("c", 2.0)).build()
    assert [name for name in graph.elements if graph.is_linear(name)] == ["J", "r", "c"]
    assert [name for name in graph.elements if graph.is_curve(name)] == ["curve", "spring"]


def test_flows_are_measured_by_displacements_and_by_motions():
    b = Builder().one("a", displacement="x").one("b").one("c").on("a", I("J", 1.0)).on("b", I("K", 1.0)).on("c", I("L", 1.0))
    b.transform("a", "b", Modulus(np.sin, np.cos, Motion("b"))).transform("b", "c", Modulus(np.sin, np.cos, Motion("b")))
    graph = b.build()
    assert graph.motions == ("b",)
    assert graph.measured == {"a", "b"}


def test_an_element_is_called_by_kind_name_value_and_bond():
    graph = two_shafts().build()
    assert (graph.title("M"), graph.label("M"), graph.where("M")) == ("Se:M", "Se:M = 5", "Se:M (bond 4)")


TIES = st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)), max_size=12)


def test_neighbours_are_at_the_other_ends_of_bonds():
    bonds = [Bond(1, "a", "b"), Bond(2, "c", "b")]
    assert neighbours("abcd", bonds) == {"a": ["b"], "b": ["a", "c"], "c": ["b"], "d": []}


@given(TIES)
def test_things_are_one_exactly_where_ties_lead_from_one_to_the_other(ties):
    near = {k: [b for a, b in ties if a == k] + [a for a, b in ties if b == k] for k in range(10)}
    one = representatives(range(10), ties)
    for k in range(10):
        assert {other for other in range(10) if one[other] == one[k]} == reached_from(k, near)
        assert one[k] in reached_from(k, near)


def geared():
    b = Builder().one("a").one("b").zero("node").on("a", I("J", 1.0), Se("M", 2.0)).on("b", I("K", 3.0))
    return (
        b.transform("a", "node", 2.0, name="T").bond("b", "node").bond("node", "b2").one("b2").on("b2", I("L", 1.0)).build()
    )


def test_parallel_bonds_between_the_same_junctions_add_up_or_cancel():
    b = Builder().one("a").zero("z").one("c").bond("a", "z").bond("z", "a").bond("z", "c")
    graph = b.on("a", I("J", 1.0)).on("c", I("K", 1.0)).build()
    (relation,) = relations(graph, variables(graph, "1"), "0")
    assert len(relation.terms) == 1
    b = Builder().one("a").zero("z").one("c").bond("a", "z").bond("a", "z").bond("z", "c")
    graph = b.on("a", I("J", 1.0)).on("c", I("K", 1.0)).build()
    (relation,) = relations(graph, variables(graph, "1"), "0")
    assert sorted(sign for _, _, sign in relation.terms) == [-1.0, 2.0]


def test_a_plan_goes_as_far_as_it_can_without_dividing_by_a_modulus():
    graph = geared()
    law = graph.with_law("T", lambda t: 1 + t).elements["T"].law
    waiting = [Relation("T", ((1, 1.0, 1.0), (0, law, -1.0)))]
    reference = {1}
    assert plan(waiting, reference) == []
    assert len(waiting) == 1
    reference = {0}
    (step,) = plan(waiting, reference)
    assert (step.unknown, step.terms) == ((1,), ((0, law),))
    assert waiting == []
    assert reference == {0, 1}


def test_sums_and_constant_ratios_are_turned_round():
    waiting = [Relation("z", ((0, 1.0, 1.0), (1, 1.0, 1.0), (2, 1.0, -1.0))), Relation("T", ((2, 1.0, 1.0), (3, 4.0, -1.0)))]
    total, gear = waiting
    assert plan(waiting, {0, 3}) == [
        SolutionStep((2,), (gear,), ((3, 4.0),)),
        SolutionStep((1,), (total,), ((0, -1.0), (2, 1.0))),
    ]
    assert plan([gear], {2}) == [SolutionStep((3,), (gear,), ((2, 0.25),))]


def test_what_is_left_over_must_be_square():
    graph = geared()
    flow = variables(graph, "1")
    waiting = relations(graph, flow, "0")
    with pytest.raises(
        GraphError, match=r"more than one degree of freedom: nothing connects bond 3 .*, bond 7 .* with the coordinate"
    ):
        Reduction(graph, "a")
    b = Builder().one("a").one("b").on("a", I("J", 1.0)).on("b", I("m", 1.0)).transform("a", "b", 2.0, name="T")
    with pytest.raises(GraphError, match=r"too many relations at TF:U \(bonds 5, 6\)"):
        Reduction(b.transform("a", "b", 3.0, name="U").build(), "a")
    assert places(graph, waiting) == ["0:node (bonds 5, 6, 7)", "TF:T (bonds 4, 5)"]


EXPONENTS = {  # of kg, m, s, A, K, mol
    "N": (1, 1, -2, 0, 0, 0), "m": (0, 1, 0, 0, 0, 0), "s": (0, 0, 1, 0, 0, 0), "rad": (0, 0, 0, 0, 0, 0),
    "V": (1, 2, -3, -1, 0, 0), "A": (0, 0, 0, 1, 0, 0), "C": (0, 0, 1, 1, 0, 0), "Wb": (1, 2, -2, -1, 0, 0),
    "Pa": (1, -1, -2, 0, 0, 0), "m^3": (0, 3, 0, 0, 0, 0), "K": (0, 0, 0, 0, 1, 0), "W": (1, 2, -3, 0, 0, 0),
    "J": (1, 2, -2, 0, 0, 0), "mol": (0, 0, 0, 0, 0, 1),
}  # fmt: skip
SI = {unit: np.array(exponents) for unit, exponents in EXPONENTS.items()}


def dimension(unit):
    """The exponents of a unit such as `N m/s`."""
    above, _, below = unit.partition("/")
    return sum(SI[part] for part in above.split()) - sum(SI[part] for part in below.split())


def times(*units):
    return sum(map(dimension, units))


def test_effort_times_flow_is_power_in_every_domain():
    assert {"translation", "rotation", "electric", "magnetic", "hydraulic", "thermal", "heat", "chemical"} == set(DOMAINS)
    for domain in DOMAINS.values():
        power = (times(domain.effort.unit, domain.flow.unit) == dimension("W")).all()
        assert power == (domain.name != "heat"), domain.name


def test_momentum_and_displacement_are_integrals_over_time():
    for domain in DOMAINS.values():
        assert (dimension(domain.displacement.unit) == times(domain.flow.unit, "s")).all(), domain.name
        if domain.momentum.unit != "-":
            assert (dimension(domain.momentum.unit) == times(domain.effort.unit, "s")).all(), domain.name


def test_modulated_elements_show_an_m():
    law = Law(lambda here, anchor: here.q, Motion("crank"))
    b = Builder()
    b.add(One("crank"))
    b.port("crank", Se("F", law))
    b.port("crank", C("spring", law))
    graph = b.build()
    assert "MSe:F -> 1:crank" in str(graph)
    assert graph.at("spring")[0].head == "spring"


def test_plain_numbers_leave_an_element_unmodulated():
    assert [e.symbol for e in (Se("s", 1.0), I("i", 2.0), TF("t", 3.0), GY("g", 4.0), One("j"))] == [
        "Se",
        "I",
        "TF",
        "GY",
        "1",
    ]


def flywheel() -> Part:
    """A shaft with an inertia, a spring and a moment of its angle, open at its shaft."""
    b = Builder().one("shaft", "rotation", displacement="angle", initial=0.5).parameter(k=2.0).signal("load")
    b.on("shaft", I("J", lambda k: 3.0 * k), Se("M", lambda angle, k, load, t: k * np.sin(angle) + load * t))
    return b.part("shaft")


# Steps


def test_add_returns_the_name():
    assert Builder().add(GY("motor", 2.0)) == "motor"


def test_nothing_that_was_built_changes_with_later_steps():
    b = Builder().one("a").on("a", I("m", 1.0), Se("F", 1.0))
    before = b.build()
    b.on("a", R("r", 1.0)).parameter(k=1.0).signal("u").displacement("x", "a")
    assert len(before.elements) == 3
    assert (len(before.bonds), dict(before.parameters), before.signals, dict(before.displacements)) == (2, {}, (), {})


def test_power_flows_out_of_sources_and_into_everything_else():
    graph = Builder().one("a").on("a", Se("F", 1.0), I("m", 1.0), C("c", 1.0), R("r", 1.0)).build()
    assert [b[1:] for b in graph.bonds] == [("F", "a"), ("a", "m"), ("a", "c"), ("a", "r")]
    assert Builder().zero("n").on("n", Sf("v", 1.0), C("c", 1.0)).build().bonds[0][1:] == ("v", "n")


def test_one_element_between_two_flows_hangs_on_the_0_junction():
    b = Builder().one("a").one("b").on("a", Se("F", 1.0)).on("b", I("m", 1.0)).between("a", "b", C("c", 1.0))
    graph = b.build()
    assert graph.elements["a-b"].kind == "0"
    assert [bond[1:] for bond in graph.at("a-b")] == [("a", "a-b"), ("a-b", "b"), ("a-b", "c")]


def test_several_elements_between_two_flows_share_their_difference():
    b = Builder().one("a").one("b").on("a", Se("F", 1.0)).on("b", I("m", 1.0))
    graph = b.between("a", "b", C("c", 1.0), R("r", 1.0), name="joint").build()
    assert graph.elements["joint"].kind == "0"
    assert graph.elements["joint.rate"].kind == "1"
    assert [bond[1:] for bond in graph.at("joint.rate")] == [
        ("joint", "joint.rate"),
        ("joint.rate", "c"),
        ("joint.rate", "r"),
    ]


def test_two_ports_are_named_after_their_junctions_unless_told():
    b = Builder().one("a").one("b").on("a", Se("F", 1.0)).on("b", I("m", 1.0)).transform("a", "b", 2.0)
    assert b.build().elements["a->b"].law == 2.0
    other = (
        Builder().one("a").one("b").on("a", Se("F", 1.0)).on("b", I("m", 1.0)).gyrate("a", "b", 2.0, name="motor").build()
    )
    assert other.elements["motor"].kind == "GY"
    assert [bond[1:] for bond in other.ends("motor")] == [("a", "motor"), ("motor", "b")]


def test_a_sum_adds_ratios_times_flows():
    b = Builder().one("a", displacement="x").sum("b", [("a", 2.0)], "").sum("c", [("a", 3.0), ("b", -1.0)], "")
    assert reduce(b.on("c", I("m", 1.0)).build(), 0.0, "a").inertia == pytest.approx((3.0 - 2.0) ** 2)


def test_signals_are_declared_once_and_parameters_by_their_last_value():
    b = Builder().one("a").on("a", I("m", 1.0), Se("F", 1.0)).signal("u", "v").signal("u").parameter(k=1.0).parameter(k=2.0)
    assert b.build().signals == ("u", "v")
    assert b.build().parameters == {"k": 2.0}


def test_names_are_given_once():
    with pytest.raises(GraphError, match="two elements are named 'a'"):
        Builder().one("a").zero("a")
    with pytest.raises(GraphError, match="two displacements are named 'x'"):
        Builder().one("a", displacement="x").one("b", displacement="x")


def test_a_spring_is_given_by_one_of_compliance_and_stiffness():
    assert C("c", stiffness=4.0).law == 0.25
    with pytest.raises(GraphError, match="C:c: found a compliance and a stiffness, expected one of them"):
        C("c", 1.0, stiffness=2.0)
    with pytest.raises(GraphError, match="C:c: found stiffness 0, expected a number other than 0"):
        C("c", stiffness=0.0)


# Parts


def pair():
    b = Builder().include("left", flywheel()).include("right", flywheel())
    return b.transform("left.shaft", "right.shaft", 0.5, name="gear").build()


def test_two_copies_of_a_part_keep_their_names_apart():
    graph = pair()
    assert list(graph.elements) == ["left.shaft", "left.J", "left.M", "right.shaft", "right.J", "right.M", "gear"]
    assert [b.number for b in graph.bonds] == [1, 2, 3, 4, 5, 6]
    assert graph.bonds[2][1:] == ("right.shaft", "right.J")


def test_displacements_are_each_parts_own_and_laws_follow_them():
    graph = pair()
    assert {d.name: (d.of, d.initial) for d in graph.displacements.values()} == {
        "left.angle": ("left.shaft", 0.5),
        "right.angle": ("right.shaft", 0.5),
    }
    assert graph.elements["left.M"].law.of == ("left.angle", "k", "load", "t")
    assert graph.depends_on("right.M") == ("right.angle", "load", "t")
    assert graph.elements["right.M"].law(0.5, 2.0, 3.0, 4.0) == 2.0 * np.sin(0.5) + 12.0


def test_parameters_and_signals_are_shared():
    graph = pair()
    assert graph.parameters == {"k": 2.0}
    assert graph.signals == ("load",)
    doubled = graph.with_parameters(k=4.0)
    assert (doubled.constant("left.J"), doubled.constant("right.J")) == (12.0, 12.0)


def test_a_parameter_that_a_part_leaves_open_takes_the_graphs_value():
    part = Builder().one("a").parameter(k=None).on("a", I("m", lambda k: k), Se("F", 1.0)).part("a")
    assert Builder().parameter(k=5.0).include("p", part).build().parameters == {"k": 5.0}
    assert Builder().include("p", part).parameter(k=5.0).build().parameters == {"k": 5.0}
    assert Builder().include("p", part).build().parameters == {"k": None}


def test_parts_that_differ_in_a_shared_parameter_are_refused():
    with pytest.raises(GraphError, match=r"parameter 'k': found 2.0 in part 'p', but 5.0 before; leave one open"):
        Builder().parameter(k=5.0).include("p", flywheel())


def test_elements_may_be_named_like_parameters_and_signals():
    part = Builder().one("a").parameter(J=3.0).signal("M").on("a", I("J", lambda J: J), Se("M", lambda M: M)).part("a")
    graph = Builder().include("p", part).build()
    assert graph.constant("p.J") == 3.0
    assert graph.depends_on("p.M") == ("M",)


def test_a_laws_own_flow_and_displacement_stay_its_own():
    b = Builder().one("a", displacement="q").displacement("f", "a")
    part = b.on("a", C("c", lambda q: q**3), R("r", lambda f, q: f * q), Se("F", lambda q: q)).part("a")
    graph = Builder().include("p", part).build()
    assert graph.elements["p.c"].law.of == ("q",)
    assert graph.elements["p.r"].law.of == ("f", "p.q")
    assert graph.elements["p.F"].law.of == ("p.q",)


def test_ports_may_have_other_names():
    part = Builder().one("inner").one("end").bond("inner", "end").on("end", I("m", 1.0)).part("end", port="inner")
    graph = Builder().include("p", part).one("a").on("a", Se("F", 1.0)).bond("a", "p.port").build()
    assert "p.inner" not in graph.elements
    assert graph.bonds[0][1:] == ("p.port", "p.end")
    assert graph.bonds[-1][1:] == ("a", "p.port")


def test_displacements_of_a_port_follow_its_other_name():
    part = Builder().one("inner", displacement="x").on("inner", I("m", 1.0), Se("F", lambda x: x)).part(out="inner")
    graph = Builder().include("p", part).build()
    assert graph.displacements["p.x"].of == "p.out"
    assert graph.elements["p.F"].law.of == ("p.x",)


def test_motions_follow_their_junction():
    motion = Motion("a")
    b = Builder().one("a").zero("n").on("a", Se("F", Law(lambda here, anchor: here.q, motion))).port("n", C("c", 1.0))
    b.transform("a", "n", Modulus(lambda p: p, lambda p: 1.0, motion), name="T")
    graph = Builder().include("p", b.part("a")).build()
    assert graph.elements["p.F"].law.motion.of == graph.elements["p.T"].law.motion.of == "p.a"
    assert graph.depends_on("p.T") == ("p.a",)


def test_parts_hold_parts():
    outer = Builder().include("inner", flywheel()).part("inner.shaft")
    graph = Builder().include("outer", outer).build()
    assert graph.elements["outer.inner.M"].law.of[0] == "outer.inner.angle"


def test_the_same_part_cannot_come_twice_under_one_name():
    with pytest.raises(GraphError, match=r"two elements are named 'p\.shaft'"):
        Builder().include("p", flywheel()).include("p", flywheel())


def test_a_port_is_a_junction_of_the_part():
    b = Builder().one("a").on("a", I("m", 1.0))
    with pytest.raises(GraphError, match="port 'b': 'b' is no junction of the part"):
        b.part("b")
    with pytest.raises(GraphError, match="port 'out': 'm' is no junction of the part"):
        b.part(out="m")


# Building


def test_junctions_that_lead_nowhere_are_a_fault_unless_loose():
    b = Builder().one("a").on("a", Se("F", 1.0), I("m", 1.0)).one("b").transform("a", "b", 2.0, name="T")
    b.add(Zero("n"))
    b.bond("a", "n")
    with pytest.raises(GraphError) as caught:
        b.build()
    lines = str(caught.value).splitlines()
    assert [line.split(":")[1].split(" ")[0] for line in lines] == ["b", "n"]
    assert lines[0].startswith(
        "1:b dangles: bond 4 to TF:T is its only one; attach something to it, leave it out, or build(loose"
    )
    assert len(b.build(loose=True).bonds) == 5


def test_a_junction_that_is_measured_does_not_dangle():
    b = Builder().one("a").on("a", Se("F", 1.0), I("m", 1.0)).one("b", displacement="x").transform("a", "b", 2.0)
    assert len(b.build().bonds) == 4
    law = Law(lambda here, anchor: here.q, Motion("b"))
    moved = Builder().one("a").on("a", Se("F", law), I("m", 1.0)).one("b").transform("a", "b", 2.0)
    assert len(moved.build().bonds) == 4


def test_a_parameter_that_is_left_open_is_an_error_when_it_is_used():
    graph = Builder().parameter(J=None).one("a").on("a", Se("M", 1.0), I("wheel", lambda J: 2.0 * J)).build()
    with pytest.raises(GraphError, match=r"parameter 'J' \(I:wheel, bond 2\) has no value: graph.with_parameters\(J=...\)"):
        graph.constant("wheel")
    assert graph.with_parameters(J=3.0).constant("wheel") == 6.0
    with pytest.raises(GraphError, match="no parameter 'K': the graph declares J"):
        graph.with_parameters(K=1.0)


# What is no bond graph is refused, every fault at once, a line each.


def shaft() -> Builder:
    """A sound graph to spoil: bond 1 is M -> a, bond 2 is a -> J."""
    return Builder().one("a", displacement="x").parameter(k=2.0).signal("u").on("a", Se("M", 1.0), I("J", 2.0))


def added(b: Builder, *elements: Element) -> Builder:
    for element in elements:
        b.add(element)
    return b


def rotation_and_translation() -> Builder:
    b = Builder().one("crank", "rotation").on("crank", Se("M", 1.0), I("J", 2.0))
    return b.one("ram", "translation").on("ram", I("m", 1.0))


def faults(builder: Builder) -> list[str]:
    with pytest.raises(GraphError) as caught:
        builder.build(loose=True)
    return str(caught.value).splitlines()


TWICE = "is declared twice, as two of displacement, signal and parameter"
UNDECLARED = "which is no declared displacement, signal or parameter, nor t"
STORE = "a store's law may hold parameters only"
NO_VALUE = "has no value; give it a number or a function"
JOINED = "are joined without a transducer; put a TF or GY between them"
NO_LAW = "expected a number, a function of named quantities or a SymPy expression"

ELEMENTS_AND_BONDS = {
    "to nobody": (
        shaft().bond("a", "nowhere"),
        ["bond 3: no element 'nowhere' to join 1:a to; the junctions are a"],
    ),
    "nearly a name": (
        Builder().one("shaft").on("shfat", I("J", 1.0)),
        ["bond 1: no element 'shfat' to join I:J to; did you mean 'shaft'?"],
    ),
    "one-port": (shaft().bond("a", "J"), ["I:J has 2 bonds, a one-port has 1"]),
    "no junction": (
        added(Builder(), Se("M", 1.0), I("J", 1.0)).bond("M", "J"),
        ["bond 1: joins Se:M and I:J directly; put a 1- or 0-junction between them"],
    ),
    "islands": (shaft().one("b").on("b", I("m", 1.0), R("r", 1.0)), ["not connected to the rest: b, m, r"]),
    "nothing": (Builder(), ["the graph is empty"]),
}
NAMES = {
    "of nobody": (
        shaft().displacement("y", "nowhere"),
        ["displacement 'y': 'nowhere' is no 1-junction of the graph"],
    ),
    "of a one-port": (shaft().displacement("y", "J"), ["displacement 'y': 'J' is no 1-junction of the graph"]),
    "of a 0-junction": (
        shaft().zero("n").bond("a", "n").port("n", C("c", 1.0)).displacement("y", "n"),
        ["displacement 'y': 'n' is no 1-junction of the graph"],
    ),
    "nan": (
        shaft().displacement("y", "a", math.nan),
        ["displacement 'y': found initial value nan, expected a finite number"],
    ),
    "twice": (shaft().signal("x").parameter(u=1.0), [f"'u' {TWICE}", f"'x' {TWICE}"]),
    "time": (shaft().signal("t"), ["'t' is declared, but always means the time"]),
    **{
        f"parameter {value}": (
            shaft().parameter(p=value),
            [f"parameter 'p': found {value!r}, expected a finite number, or None where it is still open"],
        )
        for value in (math.nan, math.inf, "2", [1.0])
    },
}
LAWS = {
    "undeclared": (
        shaft().on("a", Se("F", lambda x, y, k, u, t: x)),
        [f"MSe:F, bond 3: depends on 'y', {UNDECLARED}"],
    ),
    "modulus": (
        shaft().one("b").transform("a", "b", lambda phi: phi, name="T"),
        [f"MTF:T, bond 3, bond 4: depends on 'phi', {UNDECLARED}"],
    ),
    "another's own": (
        shaft().on("a", R("r", lambda q: q), C("c", lambda f: f)),
        [
            f"R:r, bond 3: depends on 'q', {UNDECLARED}; its own flow is f, its own effort e",
            f"C:c, bond 4: depends on 'f', {UNDECLARED}; its own displacement is q",
        ],
    ),
    "another's quantity": (
        shaft().on("a", Se("F", lambda e_a: e_a), Se("G", lambda f_b: f_b)),
        [
            f"MSe:F, bond 3: depends on 'e_a', {UNDECLARED}, nor the effort of a 0-junction or one-port",
            f"MSe:G, bond 4: depends on 'f_b', {UNDECLARED}, nor the flow of a 1-junction or one-port",
        ],
    ),
    "no own": (shaft().on("a", Se("F", lambda f: f)), [f"MSe:F, bond 3: depends on 'f', {UNDECLARED}"]),
    "inertia": (
        shaft().on("a", I("m", lambda x, k: x * k)),
        [f"I:m, bond 3: varies with x; {STORE}; its own momentum is p"],
    ),
    "compliance": (
        shaft().on("a", C("c", lambda q, x, t: q * x * t)),
        [f"C:c, bond 3: varies with x, t; {STORE}; its own displacement is q"],
    ),
    "missing": (shaft().on("a", C("c")), [f"C:c, bond 3: {NO_VALUE}"]),
    "none": (shaft().on("a", Se("F", None)), [f"Se:F, bond 3: {NO_VALUE}"]),
    "nan": (shaft().on("a", R("r", math.nan)), ["R:r, bond 3: found nan, expected a finite number"]),
    "inf": (shaft().on("a", R("r", -math.inf)), ["R:r, bond 3: found -inf, expected a finite number"]),
    "zero": (
        shaft().on("a", C("c", 0.0)),
        ["C:c, bond 3: found compliance 0, expected another number; a rigid joint is left out"],
    ),
    **{
        f"{value}": (shaft().on("a", R("r", value)), [f"R:r, bond 3: found {value!r}, {NO_LAW}"])
        for value in ("3 * x", [1.0], 1j)
    },
}
DOMAINS_AND_SOURCES = {
    "two domains": (
        rotation_and_translation().bond("crank", "ram"),
        [f"bond 4: 1:crank (rotation) and 1:ram (translation) {JOINED}"],
    ),
    "through one without": (
        rotation_and_translation().one("middle").bond("crank", "middle").bond("middle", "ram"),
        [f"bond 1, 2, 3, 4, 5: 1:crank (rotation) and 1:ram (translation) {JOINED}"],
    ),
    "one-ports": (
        shaft().on("a", R("r", 1.0, "electric"), C("c", 1.0, "rotation")),
        [f"bond 1, 2, 3, 4: R:r (electric) and C:c (rotation) {JOINED}"],
    ),
    "two flows": (
        shaft().on("a", Sf("v", 1.0), Sf("w", 2.0)),
        ["Sf:v (bond 3) and Sf:w (bond 4) both set the flow of 1:a; keep one of them"],
    ),
    "two efforts": (
        Builder().zero("n").on("n", Se("p", 1.0), Se("s", 2.0), C("c", 1.0)),
        ["Se:p (bond 1) and Se:s (bond 2) both set the effort of 0:n; keep one of them"],
    ),
    "equal junctions": (
        shaft().on("a", Sf("v", 1.0)).one("b").one("c").bond("a", "b").bond("b", "c").on("c", Sf("w", 1.0)),
        ["Sf:v (bond 3) and Sf:w (bond 6) both set the flow of 1:a; keep one of them"],
    ),
}
CASES = [*ELEMENTS_AND_BONDS.items(), *NAMES.items(), *LAWS.items(), *DOMAINS_AND_SOURCES.items()]


@pytest.mark.parametrize(("builder", "expected"), [case for _, case in CASES], ids=[name for name, _ in CASES])
def test_what_is_wrong_is_said_and_nothing_else(builder, expected):
    assert faults(builder) == expected


@pytest.mark.parametrize(
    ("builder", "line"),
    [
        (shaft().bond("a", "a"), "bond 3: joins 'a' to itself"),
        (added(shaft(), Sf("v", lambda t: t)), "MSf:v has 0 bonds, a one-port has 1"),
        (shaft().one("b"), "1:b has no bond"),
        (shaft().zero("n"), "0:n has no bond"),
        *(
            (
                added(shaft().one("b").on("b", I("m", 1.0)), made).bond("a", "T").bond("b", "T"),
                f"{made.kind}:T has 2 bonds in and 0 out, expected 1 and 1",
            )
            for made in (TF("T", 2.0), GY("T", 2.0))
        ),
        (
            Builder().one("b", "rotational").on("b", Se("M", 1.0), I("J", 1.0)),
            "1:b: found domain 'rotational', expected one of translation, rotation, electric, magnetic, hydraulic, thermal, "
            "heat, chemical",
        ),
    ],
)
def test_what_is_wrong_is_said_among_what_follows_from_it(builder, line):
    assert line in faults(builder)


@pytest.mark.parametrize(
    ("elements", "bonds", "displacements", "expected"),
    [
        ([Element("X", "a"), One("b")], [Bond(1, "a", "b")], (), ["X:a: no such kind of element"]),
        (
            [One("a"), I("J", 1.0), Se("M", 1.0)],
            [Bond(1, "a", "J"), Bond(1, "M", "a")],
            (),
            ["two bonds are numbered 1"],
        ),
        (  # faults that hide others come first
            [Element("X", "a"), Element("Y", "b"), I("J", math.nan)],
            [Bond(1, "a", "c")],
            (),
            [
                "X:a: no such kind of element",
                "Y:b: no such kind of element",
                "bond 1: no element 'c' to join X:a to; the junctions are none",
            ],
        ),
        (
            [One("a"), I("J", 1.0)],
            [Bond(1, "a", "J")],
            [Displacement("x", "J")],
            ["displacement 'x': 'J' is no 1-junction of the graph"],
        ),
    ],
)
def test_graphs_without_a_builder_are_checked_too(elements, bonds, displacements, expected):
    with pytest.raises(GraphError) as caught:
        BondGraph({e.name: e for e in elements}, tuple(bonds), {d.name: d for d in displacements})
    assert str(caught.value).splitlines() == expected


def test_elements_listed_under_another_name():
    with pytest.raises(GraphError, match="I:J is listed as 'K'; use its own name"):
        BondGraph({"a": One("a"), "K": I("J", 1.0)}, (Bond(1, "a", "K"),))


def test_what_is_sound_has_no_faults():
    sound = shaft().on("a", R("r", lambda f, x, t: f * x * t), C("c", lambda q, k: k * q**3)).build()
    assert (sound.depends_on("r"), sound.depends_on("c")) == (("x", "t"), ())
    assert shaft().on("a", Se("F", Law(lambda here, anchor: here.q, Motion("a")))).build().symbol("F") == "MSe"
    assert rotation_and_translation().transform("crank", "ram", 0.5).build().domain(Bond(4, "", "")).name == "rotation"
    rivals = Builder().one("a").on("a", Se("M", 1.0), Se("N", 2.0), Sf("v", 1.0)).one("b").on("b", Sf("w", 1.0))
    assert len(rivals.between("a", "b", C("c", 1.0)).build().bonds) == 7


def test_graphs_that_are_like_a_sound_one_have_their_own_faults():
    sound = shaft().on("a", Se("F", 1.0), C("c", 2.0)).build()
    assert sound.with_law("c", 3.0).constant("c") == 3.0
    assert faults(shaft().on("a", Se("F", 1.0), C("c", math.inf))) == ["C:c, bond 4: found inf, expected a finite number"]
    (heat,) = faults(shaft().on("a", Se("F", 1.0), C("c", 2.0, domain="rotational")))
    assert heat.startswith("C:c: found domain 'rotational'")
    assert shaft().on("a", Se("F", 1.0), Se("G", 2.0)).build().constant("G") == 2.0
    (rivals,) = faults(shaft().on("a", Sf("F", 1.0), Sf("G", 2.0)))
    assert rivals == "Sf:F (bond 3) and Sf:G (bond 4) both set the flow of 1:a; keep one of them"
    with pytest.raises(GraphError, match="displacement 'x'"):
        replace(sound, displacements={"x": Displacement("x", "J")})


def test_faults_of_every_sort_come_at_once():
    b = shaft().on("a", C("c"), R("r", lambda y: y), Sf("v", 1.0), Sf("w", 1.0)).displacement("z", "J").signal("x")
    b.one("b", "rotational").on("b", I("m", math.nan))
    result = "\n".join(faults(b))
    for part in ("not connected", "'z'", "'x' is declared twice", "C:c", "'y'", "I:m", "'rotational'", "both set the flow"):
        assert part in result


@pytest.mark.parametrize("use", [simulate, table, causality, draw, simplify, as_data, Dynamics, Reduction])
def test_a_builder_in_place_of_a_graph_is_told_to_build(use):
    inputs = Builder().one("a").on("a", I("J", 1.0))
    with pytest.raises(GraphError, match=r"found a Builder, expected a BondGraph; call its build\(\) first"):
        use(inputs, 1.0) if use in (simulate, Reduction) else use(inputs)


@pytest.mark.parametrize("wrong", ["I", None, [I("J", 1.0)], 3.0])
def test_what_is_no_element_cannot_be_hung(wrong):
    with pytest.raises(GraphError, match="expected an element, such as I"):
        Builder().one("a").on("a", wrong)


# Word bond graphs: parts as words with ports, drawn and expanded.


def words(**changes):
    supply = Builder().one("out", "electric").on("out", Se("u", 12.0), R("Ri", 0.5)).part("out")
    motor = Builder().one("coil", "electric").on("coil", I("L", 0.01)).one("shaft", "rotation").on("shaft", I("J", 0.2))
    motor.gyrate("coil", "shaft", 0.3, name="k")
    fan = Builder().one("hub", "rotation", displacement="phi").on("hub", R("air", lambda f: 0.01 * f * abs(f)))
    reference = {"supply": supply, "DC motor": motor.part("shaft", electric="coil"), "fan": fan.part("hub")} | changes
    return WordGraph(reference, [("supply.out", "DC motor.electric"), ("DC motor.shaft", "fan.hub")])


def test_words_expand_to_the_graph_that_is_written_by_hand():
    b = Builder().one("coil", "electric").on("coil", Se("u", 12.0), R("Ri", 0.5), I("L", 0.01)).one("shaft", "rotation")
    b.on("shaft", I("J", 0.2), R("air", lambda f: 0.01 * f * abs(f))).gyrate("coil", "shaft", 0.3, name="k")
    by_hand, expanded = simulate(b.build(), 2.0), simulate(words().expand(), 2.0)
    assert float(expanded.flow("fan.hub")[-1]) == pytest.approx(float(by_hand.flow("shaft")[-1]), rel=1e-5)
    assert words().expand().displacements.keys() == {"fan.phi"}


def test_words_are_drawn_in_frames_with_ports_and_colours_of_domains():
    figure = draw(words(), title="A fan")
    assert [text.get_text() for text in figure.axes[0].texts] == [
        "A fan", "out - electric", "shaft - hub", "supply", "DC motor", "fan", "rotation", "electric"
    ]  # fmt: skip
    assert len(figure.axes[0].lines) == 2 * 2 + 3 * 4 + 2  # bonds with half arrows, frames, colours
    open_words = WordGraph({"supply": ["out"], "lamp": ["in"]}, [("supply.out", "lamp.in")])  # before parts
    assert "lamp" in svg(open_words)
    assert "out - in" in svg(open_words)


@pytest.mark.parametrize(
    ("bonds", "says"),
    [
        ([("supply.out", "pump.in")], "bond 1: no word 'pump' in 'pump.in'; the words are supply, DC motor, fan"),
        ([("supply.in", "fan.hub")], "bond 1: word 'supply' has no port 'in'; its ports are out"),
        ([("supply.out", "DC motor.electric"), ("supply.out", "fan.hub")], "bond 2: port 'supply.out' has bond 1 already"),
        ([("supply.out", "fan.hub")], "word 'DC motor' has no bond: join one of its ports, or leave it out"),
        ([("DC motor.shaft", "DC motor.electric")], "bond 1: joins 'DC motor.shaft' to its own word"),
    ],
)
def test_bonds_between_words_that_are_none(bonds, says):
    with pytest.raises(GraphError, match=re.escape(says)):
        WordGraph(words().words, bonds)


def test_words_that_stand_for_nothing_yet_or_for_another_domain():
    with pytest.raises(GraphError, match="word 'fan' stands for no bond graph: give it a part in place of ports"):
        words(fan=["hub"]).expand()
    wheel = Builder().one("hub", "translation").on("hub", I("m", 1.0)).part("hub")
    with pytest.raises(GraphError, match=r"DC motor.shaft \(rotation\).* are joined without a transducer"):
        words(fan=wheel).expand()
