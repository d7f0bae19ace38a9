import numpy as np
import pytest

from bondgraph import GY, Builder, C, GraphError, I, Law, Modulus, Motion, Part, R, Se, Sf, Zero, reduce


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
    with pytest.raises(GraphError, match="C:c: found stiffness 0, expected another number"):
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
        "1:b dangles: bond 4 to TF:T is its only one; hang something on it, leave it out, or build(loose"
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
