"""Causality: its assignment by hand and by the procedure, and what tables show of it."""

import itertools

import numpy as np
import pytest
import sympy
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from bondgraph import (
    GY,
    TF,
    Builder,
    C,
    Dynamics,
    GraphError,
    I,
    Law,
    Modulus,
    Motion,
    One,
    R,
    Se,
    Sf,
    Zero,
    causality,
    simulate,
    state_equations,
    table,
    zero_order_paths,
)
from bondgraph.graph import CONVENTION
from bondgraph.strokes import Signal

# The graphs that causality is tested on, drawn ones and random ones, and the rules that every assignment obeys.


def ratio(theta):
    return np.sin(theta)


def slider_crank(crank=True, slider_first=False):
    b = Builder().one("crank", "rotation", displacement="theta").one("slider", "translation")
    on_crank, on_slider = [Se("M", 3.0), *([I("J", 2.0)] if crank else [])], [I("m", 4.0), R("B", 0.5), Se("F", -1.0)]
    sides = [("crank", on_crank), ("slider", on_slider)]
    for junction, elements in reversed(sides) if slider_first else sides:
        b.on(junction, *elements)
    return b.transform("crank", "slider", ratio, name="T").build()


def generic():
    b = Builder().one("A", displacement="theta").one("B")
    b.on("A", Se("Se1", 1.0), I("I1", 1.0), R("B1", 1.0), C("C1", 1.0)).transform("A", "B", ratio, name="T")
    return b.on("B", I("I2", 1.0), R("B2", 1.0), C("C2", 1.0), Se("Se2", 1.0)).build()


def motor():
    b = Builder().one("coil", "electric").one("rotor", "rotation").on("coil", Se("V", 12.0), I("L", 0.1), R("Ra", 2.0))
    return b.gyrate("coil", "rotor", 0.5, name="G").on("rotor", I("J", 0.3), R("b", 0.01)).build()


def shaft():
    b = Builder().one("a").one("b").on("a", Se("M", 1.0), I("Ja", 1.0)).on("b", I("Jb", 1.0))
    return b.between("a", "b", C("k", 0.01), R("d", 2.0)).build()


def divider(second=1.0):
    return Builder().one("x").on("x", Se("V", 1.0), R("a", 1.0), R("b", second)).build()


def rivals():
    b = Builder().zero("x").zero("y").on("x", Se("a", 1.0), R("r", 1.0)).transform("x", "y", 2.0, name="T")
    return b.on("y", Se("b", 1.0), I("k", 1.0)).build()


def hub(*elements, kind="1"):
    b = Builder()
    b.add(One("x") if kind == "1" else Zero("x"))
    return b.on("x", *elements).build()


def violations(graph, strokes):
    """The rules of causality that strokes break, by element."""
    result = []
    for name, element in graph.elements.items():
        at = [strokes[b.number] == name for b in graph.at(name)]
        right = {
            "1": at.count(False) == 1,
            "0": at.count(True) == 1,
            "TF": at.count(True) == 1,
            "GY": len(set(at)) == 1,
            "Se": at == [False],
            "Sf": at == [True],
        }
        if not right.get(element.kind, True):
            result.append(name)
    return result


GRAPHS = {
    "slider-crank": slider_crank(),
    "slider-crank without J": slider_crank(crank=False),
    "generic": generic(),
    "motor": motor(),
    "shaft": shaft(),
    "divider": divider(),
    "Sf drives I": hub(Sf("v", 1.0), I("m", 1.0)),
    "two I on a 1": hub(I("a", 1.0), I("b", 1.0), R("r", 1.0)),
    "two C on a 0": hub(C("a", 1.0), C("b", 1.0), R("r", 1.0), kind="0"),
}
_MAKE = {"I": I, "C": C, "R": R, "Se": Se, "Sf": Sf}


@st.composite
def graphs(draw, ports=("I", "C", "R"), most=6, ring=False, needs_r=True):
    """Random trees of junctions, joined directly or by two-ports; with `ring` one more bond that closes a loop."""
    b, kinds = Builder(), []
    for k in range(draw(st.integers(1, most))):
        kinds.append(draw(st.sampled_from("01")))
        b.add(One(f"j{k}") if kinds[k] == "1" else Zero(f"j{k}"))
        if k:
            _join(draw, b, draw(st.integers(0, k - 1)), k)
    if ring and len(kinds) > 2:
        _join(draw, b, 0, len(kinds) - 1)
    for k in range(len(kinds)):
        hung = (["R"] if needs_r else []) + draw(st.lists(st.sampled_from(ports), max_size=2))
        for n, kind in enumerate(hung):
            b.port(f"j{k}", _MAKE[kind](f"{kind}{k}{n}", 1.0))
    try:
        return b.build(loose=True)
    except GraphError:
        assume(False)


def _join(draw, b, first, second):
    way = draw(st.sampled_from(["bond", "TF", "GY"]))
    tail, head = draw(st.permutations([f"j{first}", f"j{second}"]))
    if way == "bond":
        b.bond(tail, head)
        return
    name = b.add({"TF": TF, "GY": GY}[way](f"{way}{first}-{second}-{len(b)}", 2.0))
    b.bond(tail, name).bond(name, head)


# Strokes by sequential assignment, what follows what, and algebraic loops.


@pytest.mark.parametrize("prefer", ["integral", "derivative"])
@pytest.mark.parametrize("graph", GRAPHS.values(), ids=GRAPHS)
def test_every_bond_gets_a_stroke_and_every_rule_holds(graph, prefer):
    result = causality(graph, prefer)
    assert set(result.strokes) == set(result.reasons) == {b.number for b in graph.bonds}
    assert result.conflicts == ()
    assert violations(graph, result.strokes) == []
    assert sorted(result.integral + result.derivative) == sorted(e.name for e in graph.of_kind("I", "C"))


@pytest.mark.parametrize("slider_first", [False, True])
def test_slider_crank_has_the_crank_integral_and_the_slider_follows_whatever_is_declared_first(slider_first):
    result = causality(slider_crank(slider_first=slider_first))
    assert (result.integral, result.derivative) == (("J",), ("m",))
    assert result.follows == {"m": "I:m follows I:J through MTF:T"}
    assert result.loops == ()


def test_reasons_say_what_came_first():
    graph = slider_crank()
    result = causality(graph)
    kinds = [result.reasons[b.number].kind for b in graph.bonds]
    assert kinds == ["source", "preferred", "derivative", "propagated", "source", "propagated", "propagated"]
    assert result.reasons[1].text == "Se:M imposes its effort"
    assert result.reasons[2].text == "I:J integral, gives its flow"
    assert result.reasons[3].text == "I:m has to follow: bond 7 sets the flow of 1:slider"
    assert result.reasons[7].text == "MTF:T passes on bond 6"


def test_a_backward_pass_through_a_modulated_transformer_is_named_where_it_cannot_be_avoided():
    result = causality(slider_crank(crank=False))
    assert result.integral == ("m",)
    assert "f_5 = f_6 / T divides by MTF:T, singular where it is 0" in result.reasons[5].text
    assert not any("divides" in r.text for r in causality(slider_crank()).reasons.values())


def test_a_fixed_transformer_is_passed_either_way():
    b = Builder().one("a").one("b").on("b", I("Jb", 1.0)).on("a", I("Ja", 1.0)).transform("a", "b", 2.0, name="T")
    result = causality(b.build())
    assert result.integral == ("Jb",)
    assert result.follows["Ja"] == "I:Ja follows I:Jb through TF:T"
    assert not any("divides" in reason.text for reason in result.reasons.values())


def test_a_resistor_given_as_a_function_of_its_flow_is_taken_as_resistance():
    for graph in (divider(second=lambda f: f**3), hub(Se("V", 1.0), R("b", lambda f: f**3), R("a", 1.0))):
        result = causality(graph)
        assert result.strokes[graph.bond_of("b").number] == "x"
        assert result.strokes[graph.bond_of("a").number] == "a"
    forced = causality(hub(Se("V", 1.0), R("b", lambda f: f**3)))
    assert "the law e(f) of R:b has to be solved for f" in forced.reasons[2].text


def test_preferences_can_be_turned_round_for_all_or_some():
    assert causality(shaft(), "derivative").derivative == ("Ja", "k")  # the 0-junction leaves one flow to I:Jb
    assert causality(slider_crank(), {"J": "derivative"}).integral == ("m",)
    assert causality(hub(I("a", 1.0), I("b", 1.0)), {"a": "derivative"}).integral == ("b",)


def test_a_store_of_nothing_does_not_become_a_state():
    assert causality(hub(I("a", 0.0), I("b", 1.0))).integral == ("b",)


@pytest.mark.parametrize(
    ("prefer", "message"),
    [
        ("both", "prefer: found 'both', expected 'integral', 'derivative'"),
        ({"M": "integral"}, "prefer: 'M' is no I or C of the graph"),
        ({"J": "none"}, "prefer: found 'none' for I:J"),
    ],
)
def test_other_preferences_are_refused(prefer, message):
    with pytest.raises(GraphError, match=message):
        causality(slider_crank(), prefer)


def test_rival_sources_are_a_conflict_that_names_both_and_the_rest_is_assigned():
    result = causality(rivals())
    assert len(result.strokes) == 6
    assert violations(result.graph, result.strokes) == ["T"]
    assert len(result.conflicts) == 1
    rivalry = "Se:a (bond 1) and Se:b (bond 5) both set the effort of TF:T (bonds 3, 4)"
    assert result.conflicts == (f"{rivalry}: remove one, or put an R between",)


def test_a_junction_whose_flow_nobody_sets_is_a_conflict():
    result = causality(hub(Se("a", 1.0), Se("b", 1.0)))
    assert result.conflicts == (
        "Se:a (bond 1) and Se:b (bond 2) both set the effort of 1:x (bonds 1, 2): remove one, or put an R between",
    )
    (line,) = causality(hub(Se("a", 1.0))).conflicts
    assert line == "1:x: none of bond 1 (from Se:a) sets its flow; attach an I or R to it"


def test_two_flow_sources_through_a_gyrator_conflict():
    b = Builder().one("x").zero("y").on("x", Sf("a", 1.0)).on("y", Se("b", 1.0)).gyrate("x", "y", 2.0, name="G")
    (line,) = causality(b.build()).conflicts
    assert (
        line == "Sf:a (bond 1) and Se:b (bond 2) both set the effort of GY:G (bonds 3, 4): remove one, or put an R between"
    )


def test_describe_lists_every_bond_and_all_that_was_found():
    text = causality(slider_crank()).describe()
    assert len(text.splitlines()) == 1 + 7 + 5
    assert "preferred: I:J integral" in text
    assert "  I:m follows I:J through MTF:T" in text
    assert "conflicts: none" in text
    assert "algebraic loop through R:a and R:b" in causality(divider()).describe()
    assert "both set the effort of TF:T" in causality(rivals()).describe()


@settings(max_examples=12, deadline=None, derandomize=True)
@given(graphs())
@pytest.mark.slow
def test_trees_without_sources_and_with_a_resistor_everywhere_never_conflict(graph):
    result = causality(graph)
    assert result.conflicts == ()
    assert violations(graph, result.strokes) == []


@settings(max_examples=25, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(graphs(ports=("I", "C", "R", "Se", "Sf"), most=4, ring=True, needs_r=False))
def test_a_conflict_is_reported_exactly_where_no_assignment_exists(graph):
    assume(len(graph.bonds) <= 11)
    result = causality(graph)
    numbers = [b.number for b in graph.bonds]
    every = itertools.product(*(b[1:] for b in graph.bonds))
    possible = any(not violations(graph, dict(zip(numbers, ends, strict=True))) for ends in every)
    assert possible == all("join already" in line for line in result.conflicts)  # what no stroke tells: rings
    assert (violations(graph, result.strokes) == []) == possible


def test_a_ring_of_equal_junctions_is_told_by_every_call():
    b = Builder().zero("a").zero("b").one("c").bond("a", "b").bond("b", "c").bond("a", "b").on("a", Sf("u", 1.0))
    graph, line = (
        b.on("c", I("m", 1.0)).build(),
        r"^bond 3 joins 0:a and 0:b, which other bonds join already: nothing",
    )
    for call in (table, state_equations, Dynamics, zero_order_paths, lambda graph: simulate(graph, 1.0)):
        with pytest.raises(GraphError, match=line):
            call(graph)


def test_sixty_bonds_and_more_are_assigned():
    b = Builder().one("v0").on("v0", Se("M", 1.0), I("J0", 1.0))
    for k in range(1, 40):
        b.one(f"v{k}").on(f"v{k}", I(f"J{k}", 1.0)).between(f"v{k - 1}", f"v{k}", C(f"k{k}", 1.0), R(f"d{k}", 1.0))
    result = causality(b.build())
    assert len(result.integral) == 79
    assert violations(result.graph, result.strokes) == []


def test_what_is_asked_for_by_name_is_asked_first():
    b = Builder().one("crank", displacement="theta").one("slider").on("crank", I("J", 1.0), Se("M", 1.0))
    graph = b.on("slider", I("m", 2.0)).transform("crank", "slider", lambda theta: theta, name="T").build()
    assert causality(graph).integral == ("J",)
    request = causality(graph, prefer={"m": "integral"})
    assert (request.integral, request.derivative, request.conflicts) == (("m",), ("J",), ())
    assert any("divides by MTF:T" in reason.text for reason in request.reasons.values())


def test_the_order_of_writing_does_not_turn_transformers_round():
    b = Builder().one("slider").on("slider", I("m", 2.0)).one("crank", displacement="theta")
    graph = b.on("crank", I("J", 1.0), Se("M", 1.0)).transform("crank", "slider", lambda theta: theta, name="T").build()
    assert causality(graph).integral == ("J",)
    loop = Builder().one("crank", displacement="theta").one("rod")
    loop.transform("crank", "rod", lambda theta: 0.3 * theta, name="T1")
    loop.sum("x", [("crank", lambda theta: theta), ("rod", lambda theta: 1 + theta)], "translation")
    loop.on("rod", I("J_rod", 1.0)).on("x", I("m", 1.0)).on("crank", I("J", 1.0), Se("M", 1.0))
    result = causality(loop.build())
    assert (result.integral, result.loops) == (("J",), ())


def strokes(graph):
    return causality(graph).strokes


def test_stores_on_one_junction_follow_the_first():
    assert causality(GRAPHS["two I on a 1"]).follows == {"b": "I:b follows I:a"}
    assert causality(GRAPHS["two C on a 0"]).follows == {"b": "C:b follows C:a"}
    assert causality(GRAPHS["Sf drives I"]).follows == {"m": "I:m follows Sf:v"}


def test_two_resistors_form_a_named_loop():
    (loop,) = causality(divider()).loops
    assert loop.elements == ("x", "a", "b")
    assert loop.bonds == (2, 3)
    assert loop.text == "algebraic loop through R:a and R:b: e_2 -> e_3 -> f_3 -> f_2 -> e_2"
    assert "an algebraic loop" in causality(divider()).reasons[2].text


def test_zero_order_paths_have_their_gains():
    """Seen through T, leak is leak T^2 (e_in = T e_out, f_out = T f_in): its loop with r has the gain -r/(leak T^2)."""
    b = Builder().one("a").zero("node").zero("far").bond("a", "node").on("a", Se("u", 1.0), R("r", 2.0))
    b.transform("node", "far", 3.0, name="T").on("far", R("leak", 4.0)).one("b").bond("node", "b").on("b", I("m", 1.0))
    (path,) = zero_order_paths(b.build())
    r, leak, T = sympy.symbols("r leak T")
    assert sympy.simplify(path.gain * leak * T**2 + r) == 0
    assert path.value == pytest.approx(-2.0 / (4.0 * 9.0))
    assert {"r", "leak", "T"} < set(path.elements)
    assert str(path).endswith("= -0.0555556")
    assert zero_order_paths(Builder().one("a").on("a", Se("u", 1.0), R("r", 2.0), I("m", 1.0)).build()) == ()


def test_a_ladder_has_all_its_paths_once():
    """e_x = u - r1 (e_x/g1 + f_b), e_y = e_x - r2 f_b, f_b = e_y/g2 + ...: r1 and r2 meet g2, r1 meets g1."""
    b = Builder().one("a").zero("x").one("b").zero("y").bond("a", "x").bond("x", "b").bond("b", "y")
    b.on("a", Se("u", 1.0), R("r1", 2.0)).on("x", R("g1", 3.0)).on("b", R("r2", 5.0)).on("y", R("g2", 7.0))
    result = zero_order_paths(b.one("c").bond("y", "c").on("c", I("m", 1.0)).build())
    assert sorted(path.value for path in result) == pytest.approx([-5.0 / 7.0, -2.0 / 3.0, -2.0 / 7.0])


@pytest.mark.parametrize("join", ["transform", "gyrate"])
def test_loops_go_through_transformers_and_gyrators(join):
    b = Builder().one("x").one("y").on("x", Se("V", 1.0), R("a", 1.0))
    far = "y"
    if join == "gyrate":
        b.zero("z").bond("y", "z")
        far = "z"
    getattr(b, join)("x", "y", 2.0, name="T").on(far, R("b", 1.0), R("c", 1.0))
    result = causality(b.build())
    (loop,) = result.loops
    assert {"a", "b", "T"} <= set(loop.elements)
    assert violations(result.graph, result.strokes) == []


def test_a_ring_of_transformers_is_a_loop_of_the_junction_structure():
    b = Builder().one("x").one("y").zero("p").zero("q").on("x", I("J", 1.0)).on("y", R("r", 1.0))
    b.bond("x", "p").bond("p", "y").bond("x", "q").transform("q", "y", 2.0, name="T")
    result = causality(b.build())
    assert result.conflicts == ()
    assert violations(result.graph, result.strokes) == []
    assert result.follows == {"J": "I:J follows no store and no source: the junctions alone decide it"}
    assert [loop.elements for loop in result.loops] == [("x", "y", "p", "q", "T")] * 2
    assert result.loops[0].text.startswith("algebraic loop through the junction structure at 1:x, ")
    assert result.loops[0].text.endswith(": e_3 -> e_4 -> e_7 -> e_6 -> e_5 -> e_3")
    assert result.reasons[3].text.startswith("nothing decides it: 0:p taken to receive the effort")


TABLE_GRAPHS = {"crank": slider_crank(), "generic": generic(), "motor": motor(), "shaft": shaft(), "divider": divider()}


def source_table_7():
    """Seven bonds, numbered and directed as the source has them: the force F takes power out of the slider."""
    b = Builder().one("1w", displacement="theta").one("1v").on("1w", Se("M", 1.0), I("J", 1.0))
    b.transform("1w", "1v", lambda theta: theta, name="T")
    b.on("1v", I("m", 1.0), R("B", 1.0))
    b.bond("1v", b.add(Se("F", 1.0)))
    return b.build()


def source_table_9():
    """Ten bonds, numbered and directed as the source has them."""
    b = Builder().one("A", displacement="theta").one("B")
    b.on("A", Se("Se1", 1.0), I("I1", 1.0), R("B1", 1.0), C("C1", 1.0)).transform("A", "B", lambda theta: theta, name="T")
    return b.on("B", I("I2", 1.0), R("B2", 1.0), C("C2", 1.0), Se("Se2", 1.0)).build()


def cells(graph):
    """Bond -> its effort, flow and state equation as text."""
    header, *lines = table(graph).text().splitlines()
    starts = [header.index(word) for word in ("effort", "flow", "state")]
    rows = lines[: len(graph.bonds)]
    return {
        k + 1: tuple(line[a:b].strip() for a, b in zip(starts, [*starts[1:], None], strict=True))
        for k, line in enumerate(rows)
    }


def quantities(term):
    if term.quantity is not None:
        yield term.quantity
    for argument in term.factor.arguments if term.factor is not None else ():
        if not isinstance(argument, str):
            yield from quantities(argument)


def assert_complete(graph):
    result = table(graph)
    equations = [e for row in result.rows for e in (row.effort, row.flow)]
    variables = {Signal(letter, b.number) for b in graph.bonds for letter in "ef"}
    assert [row.bond for row in result.rows] == [b.number for b in graph.bonds]
    assert len(equations) == len(variables)
    assert {e.left for e in equations} == variables
    states = {Signal("p" if e.kind == "I" else "q", graph.bond_of(e.name).number) for e in graph.of_kind("I", "C")}
    reference = variables | states | {s._replace(rate=True) for s in states}
    used = {q for row in result.rows for e in (row.effort, row.flow, row.state) if e for t in e.right for q in quantities(t)}
    assert used <= reference
    assert {row.state.left._replace(rate=False) for row in result.rows if row.state} == states
    laws = {t.factor.name for e in equations for t in e.right if t.factor is not None}
    assert laws <= set(graph.elements)


def solved(graph):
    """Efforts and flows from the table's equations alone: laws by random numbers, states and their rates free."""
    rng = np.random.default_rng(1)
    laws = {name: rng.uniform(0.5, 2.0) for name in graph.elements}
    result = table(graph)
    column = {Signal(x, b.number): 2 * k + (x == "f") for k, b in enumerate(graph.bonds) for x in "ef"}
    matrix, right = np.eye(len(column)), np.zeros(len(column))
    for row in result.rows:
        for equation in (row.effort, row.flow):
            line = column[equation.left]
            for term in equation.right:
                factor = laws[term.factor.name] ** (-1 if term.divided else 1) if term.factor is not None else 1.0
                value = factor if term.positive else -factor
                if term.quantity in column:
                    matrix[line, column[term.quantity]] -= value
                else:
                    right[line] += value * rng.uniform(1.0, 2.0)
    x = np.linalg.solve(matrix, right)
    return laws, {q: x[k] for q, k in column.items()}


def assert_power_is_kept(graph):
    laws, x = solved(graph)
    e, f = ({b.number: x[Signal(letter, b.number)] for b in graph.bonds} for letter in "ef")
    for name, element in graph.elements.items():
        bonds = graph.at(name)
        if element.kind in ("0", "1"):
            common, summed = (f, e) if element.kind == "1" else (e, f)
            assert np.ptp([common[b.number] for b in bonds]) == pytest.approx(0.0, abs=1e-6)
            assert sum(b.sign(name) * summed[b.number] for b in bonds) == pytest.approx(0.0, abs=1e-6)
        elif element.kind in ("TF", "GY"):
            into, out = (b.number for b in graph.ends(name))
            T = laws[name]
            first, second = (f[out], e[into]) if element.kind == "TF" else (e[out], e[into])
            assert first == pytest.approx(T * f[into], rel=1e-6, abs=1e-6)
            assert second == pytest.approx(T * (e[out] if element.kind == "TF" else f[out]), rel=1e-6, abs=1e-6)
        elif element.kind == "R":
            (bond,) = bonds
            assert e[bond.number] == pytest.approx(bond.sign(name) * laws[name] * f[bond.number], rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("graph", TABLE_GRAPHS.values(), ids=TABLE_GRAPHS)
def test_every_effort_and_flow_is_defined_once_and_the_equations_hold_at_every_junction_and_two_port(graph):
    assert_complete(graph)
    assert_power_is_kept(graph)


@settings(max_examples=15, deadline=None, derandomize=True)
@given(graphs())
def test_random_graphs_have_complete_tables_that_keep_power(graph):
    assert_complete(graph)
    assert_power_is_kept(graph)


def test_a_law_that_moves_shows_the_flows_and_the_time_that_it_sees():
    def built(*sees):
        law = Law(lambda here, anchor: -1.0 * here.flow, Motion("a"), moving=True, sees=sees)
        b = Builder().one("a").one("b").on("a", I("J", 2.0)).transform("a", "b", 0.5)
        return table(b.on("b", I("m", 1.0), Se("F", law)).build())

    assert "e_5 = F(a, f_5)" in built("flow").text()
    assert "e_5 = F(a, f_1, f_5, t)" in built("speed", "flow", "time").text()
    assert "$e_{5} = F(a, f_{1}, t)$" in built("speed", "time").latex()


def test_source_table_7_slider_crank():
    # The source prints e_6 = e_4 - e_4 - e_7, a misprint for e_4 - e_5 - e_7. It also gives I:m a state of its own beside
    # f_4 = ... = f_7 = T omega, though only one inertia can be a state; and its e_4 = e_3 / T fails at dead centres.
    assert cells(source_table_7()) == {
        1: ("e_1 = M", "f_1 = f_2", ""),
        2: ("e_2 = e_1 - e_3", "f_2 = p_2/J", "dp_2/dt = e_2"),
        3: ("e_3 = T(theta) e_4", "f_3 = f_2", ""),
        4: ("e_4 = e_5 + e_6 + e_7", "f_4 = T(theta) f_3", ""),
        5: ("e_5 = dp_5/dt", "f_5 = f_4", "p_5 = m f_5"),
        6: ("e_6 = B f_6", "f_6 = f_4", ""),
        7: ("e_7 = F", "f_7 = f_4", ""),
    }


def test_source_table_9_generic_graph():
    # The source prints e_6 = e_10 - e_7 - e_8 - e_9: with f_6 = T f_5 and e_6 = e_5 / T the whole has the other sign.
    assert cells(source_table_9()) == {
        1: ("e_1 = Se1", "f_1 = f_2", ""),
        2: ("e_2 = e_1 - e_3 - e_4 - e_5", "f_2 = p_2/I1", "dp_2/dt = e_2"),
        3: ("e_3 = B1 f_3", "f_3 = f_2", ""),
        4: ("e_4 = q_4/C1", "f_4 = f_2", "dq_4/dt = f_4"),
        5: ("e_5 = T(theta) e_6", "f_5 = f_2", ""),
        6: ("e_6 = e_7 + e_8 + e_9 - e_10", "f_6 = T(theta) f_5", ""),
        7: ("e_7 = dp_7/dt", "f_7 = f_6", "p_7 = I2 f_7"),
        8: ("e_8 = B2 f_8", "f_8 = f_6", ""),
        9: ("e_9 = q_9/C2", "f_9 = f_6", "dq_9/dt = f_9"),
        10: ("e_10 = Se2", "f_10 = f_6", ""),
    }


def test_the_convention_and_what_follows_what_are_printed_below():
    result = table(slider_crank())
    assert result.notes == ("I:m follows I:J through MTF:T",)
    assert result.text().splitlines()[-2:] == [f"convention: {CONVENTION}", result.notes[0]]


def test_rows_say_ends_half_arrow_and_stroke():
    row = table(slider_crank()).rows[1]
    assert (row.tail, row.head, row.half_arrow, row.stroke) == ("1:crank", "I:J", ("crank", "J"), "J")


def test_implicit_equations_are_named():
    assert "implicit equations: algebraic loop through R:a and R:b" in table(divider()).text()


def test_laws_that_are_functions_show_what_they_vary_with():
    b = Builder().one("x", displacement="s").signal("u").parameter(k=2.0)
    b.on("x", Se("F", lambda t, u: t * u), I("m", lambda k: k), R("d", lambda f, s: f * s), C("c", lambda q, k: k * q**3))
    result = cells(b.build())
    assert result[1][0] == "e_1 = F(t, u)"
    assert result[2][1] == "f_2 = p_2/m"
    assert result[3][0] == "e_3 = d(f_3, s)"
    assert result[4][0] == "e_4 = c(q_4)"


def test_laws_in_the_other_causality_are_inverted():
    graph = Builder().zero("x").on("x", Se("V", 1.0), R("d", lambda f: f**3), C("c", lambda q: q**3), C("k", 2.0)).build()
    result = cells(graph)
    assert result[2][1] == "f_2 = d^-1(e_2)"
    assert result[3] == ("e_3 = e_1", "f_3 = dq_3/dt", "q_3 = c^-1(e_3)")
    assert result[4] == ("e_4 = e_1", "f_4 = dq_4/dt", "q_4 = k e_4")


def test_a_half_arrow_out_of_a_store_or_resistor_turns_its_sign():
    b = Builder().one("x").zero("y").bond("x", "y").on("x", Se("V", 1.0))
    for element, junction in ((I("m", 1.0), "x"), (R("r", 1.0), "x"), (R("g", lambda f: f**3), "x"), (C("c", 1.0), "y")):
        b.bond(b.add(element), junction)
    result = cells(b.build())
    assert result[3][1:] == ("f_3 = p_3/m", "dp_3/dt = -e_3")
    assert result[4][0] == "e_4 = -r f_4"
    assert result[5][0] == "e_5 = g(-f_5)"
    assert result[6] == ("e_6 = q_6/c", "f_6 = -f_1", "dq_6/dt = -f_6")


def test_a_ready_made_modulus_shows_the_junction_that_it_depends_on():
    modulus = Modulus(lambda position: position, lambda position: 1.0, Motion("a"))
    graph = Builder().one("a").one("b").on("a", I("J", 1.0)).on("b", R("r", 1.0)).transform("a", "b", modulus).build()
    assert cells(graph)[4][1] == "f_4 = TF[a->b](a) f_3"


def test_gyrators_swap_effort_and_flow():
    result = cells(motor())
    assert result[4][:2] == ("e_4 = G f_5", "f_4 = f_2")
    assert result[5][:2] == ("e_5 = G f_4", "f_5 = f_6")


def test_markdown_has_a_row_per_bond():
    lines = table(slider_crank()).markdown().splitlines()
    assert lines[0] == "| bond | from | to | half arrow | stroke at | effort | flow | state |"
    assert all(line.count("|") == 9 for line in lines[: 2 + 7])
    assert "`e_6 = T(theta) e_7`" in lines[2 + 5]


def test_latex_writes_symbols_subscripts_and_escapes():
    text = table(slider_crank()).latex()
    assert r"$f_{7} = T(\theta)\,f_{6}$" in text
    assert r"$f_{2} = \frac{p_{2}}{J}$" in text
    assert r"$e_{3} = \dot{p}_{3}$" in text
    assert text.count(r"\\") == 1 + 7
    assert text.startswith(r"\begin{tabular}{rlllllll}")
    graph = Builder().one("x_1").on("x_1", Se("M&F", 1.0), I("m2", 1.0)).build()
    assert r"\mbox{M\&F}" in table(graph).latex()
    assert r"x\_1" in table(graph).latex()
    assert r"\frac{p_{2}}{m_{2}}" in table(graph).latex()


def test_conflicts_are_refused_with_their_lines():
    with pytest.raises(GraphError, match=r"Se:a .* and Se:b .* both set the effort of TF:T"):
        table(rivals())


def test_a_causality_of_another_graph_is_refused():
    with pytest.raises(GraphError, match="that of another graph"):
        table(motor(), causality(motor()))


def test_what_laws_read_has_a_row_of_its_own():
    """A controller that reads a speed and a voltage: two activated bonds, which carry no power."""
    b = Builder().one("arm").one("rotor").on("arm", R("r", 1.0), I("L", 0.1), Se("u", lambda f_rotor, e_r: -f_rotor - e_r))
    result = table(b.on("rotor", I("J", 1.0)).gyrate("arm", "rotor", 2.0, name="k").build())
    *_, speed, voltage, _ = result.text().splitlines()
    assert speed.split() == ["1:rotor", "MSe:u", "=>", "f_rotor", "=", "f_4"]
    assert voltage.split() == ["R:r", "MSe:u", "=>", "e_r", "=", "e_1"]
    assert [row.bond for row in result.rows] == [1, 2, 3, 4, 5, 6, -1, -2]
    assert r"$\mbox{f\_rotor} = f_{4}$" in result.latex()


def test_another_causality_gives_another_table():
    graph = slider_crank()
    rows = table(graph, causality(graph, {"J": "derivative"})).rows
    assert [row.bond for row in rows if row.state and row.state.left.rate] == [3]
