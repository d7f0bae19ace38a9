import math

import pytest

from bondgraph import (
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
    Motion,
    One,
    R,
    Reduction,
    Se,
    Sf,
    as_data,
    causality,
    draw,
    simplify,
    simulate,
    table,
)


def shaft() -> Builder:
    """A sound graph to spoil: bond 1 is M -> a, bond 2 is a -> J."""
    return Builder().one("a", displacement="x").parameter(k=2.0).signal("u").on("a", Se("M", 1.0), I("J", 2.0))


def faults(builder: Builder) -> list[str]:
    with pytest.raises(GraphError) as caught:
        builder.build(loose=True)
    return str(caught.value).splitlines()


def raw_faults(elements, bonds, displacements=(), **more) -> list[str]:
    with pytest.raises(GraphError) as caught:
        BondGraph({e.name: e for e in elements}, tuple(bonds), {d.name: d for d in displacements}, **more)
    return str(caught.value).splitlines()


# Elements and bonds


def test_a_sound_graph_has_no_faults():
    assert len(shaft().build().elements) == 3


def test_kinds_that_do_not_exist():
    assert raw_faults([Element("X", "a"), One("b")], [Bond(1, "a", "b")]) == ["X:a: no such kind of element"]


def test_elements_listed_under_another_name():
    with pytest.raises(GraphError, match="I:J is listed as 'K'; use its own name"):
        BondGraph({"a": One("a"), "K": I("J", 1.0)}, (Bond(1, "a", "K"),))


def test_bonds_to_nobody():
    assert faults(shaft().bond("a", "nowhere")) == ["bond 3: no element 'nowhere' to join 1:a to; the junctions are a"]


def test_bonds_of_one_number():
    both = [Bond(1, "a", "J"), Bond(1, "M", "a")]
    assert raw_faults([One("a"), I("J", 1.0), Se("M", 1.0)], both) == ["two bonds are numbered 1"]


def test_bonds_from_an_element_to_itself():
    assert "bond 3: joins 'a' to itself" in faults(shaft().bond("a", "a"))


def test_one_ports_have_one_bond():
    assert faults(shaft().bond("a", "J")) == ["I:J has 2 bonds, a one-port has 1"]
    b = shaft()
    b.add(Sf("v", lambda t: t))
    assert "MSf:v has 0 bonds, a one-port has 1" in faults(b)


def test_junctions_have_bonds():
    assert "1:b has no bond" in faults(shaft().one("b"))
    assert "0:n has no bond" in faults(shaft().zero("n"))


@pytest.mark.parametrize("made", [TF("T", 2.0), GY("T", 2.0)])
def test_two_ports_have_a_bond_in_and_one_out(made):
    b = shaft().one("b").on("b", I("m", 1.0))
    b.add(made)
    assert f"{made.kind}:T has 2 bonds in and 0 out, expected 1 and 1" in faults(b.bond("a", "T").bond("b", "T"))


def test_elements_meet_at_junctions():
    b = Builder()
    b.add(Se("M", 1.0))
    b.add(I("J", 1.0))
    expected = "bond 1: joins Se:M and I:J directly; put a 1- or 0-junction between them"
    assert faults(b.bond("M", "J")) == [expected]


def test_islands():
    b = shaft().one("b").on("b", I("m", 1.0), R("r", 1.0))
    assert faults(b) == ["not connected to the rest: b, m, r"]


def test_nothing_at_all():
    assert faults(Builder()) == ["the graph is empty"]


# Names


def test_displacements_are_of_1_junctions():
    assert faults(shaft().displacement("y", "nowhere")) == ["displacement 'y': 'nowhere' is no 1-junction of the graph"]
    assert faults(shaft().displacement("y", "J")) == ["displacement 'y': 'J' is no 1-junction of the graph"]
    with_zero = shaft().zero("n").bond("a", "n").port("n", C("c", 1.0)).displacement("y", "n")
    assert faults(with_zero) == ["displacement 'y': 'n' is no 1-junction of the graph"]


def test_displacements_start_somewhere():
    expected = "displacement 'y': found initial value nan, expected a finite number"
    assert faults(shaft().displacement("y", "a", math.nan)) == [expected]


def test_names_are_declared_as_one_thing():
    line = "is declared twice, as two of displacement, signal and parameter"
    assert faults(shaft().signal("x").parameter(u=1.0)) == [f"'u' {line}", f"'x' {line}"]


def test_t_is_the_time():
    assert faults(shaft().signal("t")) == ["'t' is declared, but always means the time"]


@pytest.mark.parametrize("value", [math.nan, math.inf, "2", [1.0]])
def test_parameters_are_finite_numbers(value):
    expected = f"parameter 'p': found {value!r}, expected a finite number, or None where it is still open"
    assert faults(shaft().parameter(p=value)) == [expected]


# Laws


def test_laws_are_of_what_is_declared():
    expected = "MSe:F, bond 3: depends on 'y', which is no declared displacement, signal or parameter, nor t"
    assert faults(shaft().on("a", Se("F", lambda x, y, k, u, t: x))) == [expected]
    other = "MTF:T, bond 3, bond 4: depends on 'phi', which is no declared displacement, signal or parameter, nor t"
    assert faults(shaft().one("b").on("b").transform("a", "b", lambda phi: phi, name="T")) == [other]


def test_resistors_have_their_own_flow_and_compliances_their_own_displacement():
    sound = shaft().on("a", R("r", lambda f, x, t: f * x * t), C("c", lambda q, k: k * q**3)).build()
    assert (sound.depends_on("r"), sound.depends_on("c")) == (("x", "t"), ())
    crossed = faults(shaft().on("a", R("r", lambda q: q), C("c", lambda f: f)))
    line = "which is no declared displacement, signal or parameter, nor t; its own"
    assert crossed == [
        f"R:r, bond 3: depends on 'q', {line} flow is f",
        f"C:c, bond 4: depends on 'f', {line} displacement is q",
    ]
    assert "nor t" in faults(shaft().on("a", Se("F", lambda f: f)))[0]


def test_stores_vary_with_nothing_but_parameters():
    line = "a store's law may hold parameters only"
    assert faults(shaft().on("a", I("m", lambda x, k: x * k))) == [f"I:m, bond 3: varies with x; {line}"]
    expected = [f"C:c, bond 3: varies with x, t; {line}; its own displacement is q"]
    assert faults(shaft().on("a", C("c", lambda q, x, t: q * x * t))) == expected


def test_values_that_are_missing():
    assert faults(shaft().on("a", C("c"))) == ["C:c, bond 3: has no value; give it a number or a function"]
    assert faults(shaft().on("a", Se("F", None))) == ["Se:F, bond 3: has no value; give it a number or a function"]


@pytest.mark.parametrize("value", [math.nan, -math.inf])
def test_values_that_are_not_finite(value):
    assert faults(shaft().on("a", R("r", value))) == [f"R:r, bond 3: found {value}, expected a finite number"]


def test_compliances_of_zero():
    expected = "C:c, bond 3: found compliance 0, expected another number; a rigid joint is left out"
    assert faults(shaft().on("a", C("c", 0.0))) == [expected]


@pytest.mark.parametrize("value", ["3 * x", [1.0], 1j])
def test_laws_that_are_no_law(value):
    expected = f"R:r, bond 3: found {value!r}, expected a number, a function of named quantities or a SymPy expression"
    assert faults(shaft().on("a", R("r", value))) == [expected]


def test_laws_of_a_motion_are_laws():
    assert shaft().on("a", Se("F", Law(lambda here, anchor: here.q, Motion("a")))).build().symbol("F") == "MSe"


# Domains


def rotation_and_translation() -> Builder:
    b = Builder().one("crank", "rotation").on("crank", Se("M", 1.0), I("J", 2.0))
    return b.one("ram", "translation").on("ram", I("m", 1.0))


def test_domains_meet_at_two_ports_only():
    expected = (
        "bond 4: 1:crank (rotation) and 1:ram (translation) are joined without a transducer; put a TF or GY between them"
    )
    assert faults(rotation_and_translation().bond("crank", "ram")) == [expected]
    assert rotation_and_translation().transform("crank", "ram", 0.5).build().domain(Bond(4, "", "")).name == "rotation"


def test_domains_that_meet_through_somebody_without_one_name_the_whole_region():
    b = rotation_and_translation().one("middle").bond("crank", "middle").bond("middle", "ram")
    assert faults(b)[0].startswith("bond 1, 2, 3, 4, 5: 1:crank (rotation) and 1:ram (translation) are joined without")


def test_one_ports_may_name_a_domain_too():
    b = shaft().on("a", R("r", 1.0, "electric"), C("c", 1.0, "rotation"))
    assert faults(b)[0].startswith("bond 1, 2, 3, 4: R:r (electric) and C:c (rotation) are joined without")


def test_domains_that_do_not_exist():
    line = "1:b: found domain 'rotational', expected one of translation, rotation, electric, magnetic, hydraulic"
    assert faults(Builder().one("b", "rotational").on("b", Se("M", 1.0), I("J", 1.0)))[0].startswith(line)


# Sources


def test_two_flows_at_one_1_junction():
    both = "Sf:v (bond 3) and Sf:w (bond 4) both set the flow of 1:a; keep one of them"
    assert faults(shaft().on("a", Sf("v", 1.0), Sf("w", 2.0))) == [both]


def test_two_efforts_at_one_0_junction():
    b = Builder().zero("n").on("n", Se("p", 1.0), Se("s", 2.0), C("c", 1.0))
    assert faults(b) == ["Se:p (bond 1) and Se:s (bond 2) both set the effort of 0:n; keep one of them"]


def test_rivals_meet_through_equal_junctions():
    b = shaft().on("a", Sf("v", 1.0)).one("b").one("c").bond("a", "b").bond("b", "c").on("c", Sf("w", 1.0))
    assert faults(b) == ["Sf:v (bond 3) and Sf:w (bond 6) both set the flow of 1:a; keep one of them"]


def test_sources_that_do_not_rival():
    b = Builder().one("a").on("a", Se("M", 1.0), Se("N", 2.0), Sf("v", 1.0)).one("b").on("b", Sf("w", 1.0))
    assert len(b.between("a", "b", C("c", 1.0)).build().bonds) == 7


# All at once


def test_faults_of_every_sort_come_at_once():
    b = shaft().on("a", C("c"), R("r", lambda y: y), Sf("v", 1.0), Sf("w", 1.0)).displacement("z", "J").signal("x")
    b.one("b", "rotational").on("b", I("m", math.nan))
    found = "\n".join(faults(b))
    for part in ("not connected", "'z'", "'x' is declared twice", "C:c", "'y'", "I:m", "'rotational'", "both set the flow"):
        assert part in found


def test_faults_that_hide_others_come_first():
    elements = [Element("X", "a"), Element("Y", "b"), I("J", math.nan)]
    expected = [
        "X:a: no such kind of element",
        "Y:b: no such kind of element",
        "bond 1: no element 'c' to join X:a to; the junctions are none",
    ]
    assert raw_faults(elements, [Bond(1, "a", "c")]) == expected


def test_displacements_given_by_hand_are_checked_too():
    where = [Displacement("x", "J")]
    expected = ["displacement 'x': 'J' is no 1-junction of the graph"]
    assert raw_faults([One("a"), I("J", 1.0)], [Bond(1, "a", "J")], where) == expected


def test_a_name_that_is_nearly_right_is_suggested():
    with pytest.raises(GraphError, match="bond 1: no element 'shfat' to join I:J to; did you mean 'shaft'"):
        Builder().one("shaft").on("shfat", I("J", 1.0)).build()


@pytest.mark.parametrize("use", [simulate, table, causality, draw, simplify, as_data, Dynamics, Reduction])
def test_a_builder_in_place_of_a_graph_is_told_to_build(use):
    given = Builder().one("a").on("a", I("J", 1.0))
    with pytest.raises(GraphError, match=r"found a Builder, expected a BondGraph; call its build\(\) first"):
        use(given, 1.0) if use in (simulate, Reduction) else use(given)


@pytest.mark.parametrize("wrong", ["I", None, [I("J", 1.0)], 3.0])
def test_what_is_no_element_cannot_be_hung(wrong):
    with pytest.raises(GraphError, match="expected an element, such as I"):
        Builder().one("a").on("a", wrong)
