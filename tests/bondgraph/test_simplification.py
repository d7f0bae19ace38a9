"""Simplification of graphs, rule by rule and as a procedure."""

import random
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from bondgraph import (
    GY,
    TF,
    Builder,
    C,
    Function,
    GraphError,
    I,
    Modulus,
    Motion,
    One,
    R,
    Se,
    Sf,
    Zero,
    absorb_junctions,
    drop_dangling,
    drop_two_bond_junctions,
    drop_zero_sources,
    drop_zero_velocity,
    merge_double_differences,
    merge_equal_junctions,
    procedure,
    simplify,
)

# Small graphs written as rows of junctions, and their bonds as text.


def line(*pairs, elements=None):
    """Junctions such as "1:a", joined in a row, with one-ports hung on them."""
    b = Builder()
    names = [b.add((One if pair[0] == "1" else Zero)(pair[2:])) for pair in pairs]
    for tail, head in pairwise(names):
        b.bond(tail, head)
    for name, ports_there in (elements or {}).items():
        b.on(name, *ports_there)
    return b


def listed(graph):
    return [f"{graph.label(b.tail)} -> {graph.label(b.head)}" for b in graph.bonds]


LOAD = {"a": [Se("M", 3.0), I("J", 2.0)]}


CRANK, ROD = 1.0, 2.0


def ratio(theta):
    """Velocity of the slider per angular velocity of the crank (thesis, eq. 40)."""
    share = CRANK / ROD
    return CRANK * (share / 2 * np.sin(2 * theta) / np.sqrt(1 - (share * np.sin(theta)) ** 2) + np.sin(theta))


def slider_crank(**options):
    """The thesis' slider-crank, figures 19 to 29: torque, friction and force act against the ground."""
    return procedure(
        velocities={"crank": "rotation", "slider": "translation", "bearing": "rotation", "ground": "translation"},
        zero=("bearing", "ground"),
        elements=[
            (Se("M", 3.0), "crank", "bearing"),
            (I("J", 2.0), "crank"),
            (I("m", 4.0), "slider"),
            (R("B", 0.5), "slider", "ground"),
            (Se("F", -7.0), "slider", "ground"),
        ],
        transducers=[(TF("T", ratio), "crank", "slider")],
        displacements={"theta": "crank"},
        **options,
    )


def ends(graph):
    return {(graph.symbol(b.tail), b.tail, graph.symbol(b.head), b.head) for b in graph.bonds}


def test_the_slider_crank_of_the_thesis_ends_with_its_seven_bonds():
    graph = slider_crank().graph
    assert [b.number for b in graph.bonds] == [1, 2, 3, 4, 5, 6, 7]
    assert ends(graph) == {
        ("Se", "M", "1", "crank"),
        ("1", "crank", "I", "J"),
        ("1", "crank", "MTF", "T"),
        ("MTF", "T", "1", "slider"),
        ("1", "slider", "I", "m"),
        ("1", "slider", "R", "B"),
        ("Se", "F", "1", "slider"),
    }


def test_each_step_of_the_thesis_leaves_what_its_figure_shows():
    steps = slider_crank().steps
    assert [s.number for s in steps] == [1, 2, 3, 4, 5, 6, 7]
    assert [s.graph is None for s in steps] == [True] * 3 + [False] * 4
    assert steps[0].what[2] == "1:bearing (rotation) = 0"
    assert len(steps[3].graph.bonds) == 13  # figure 25: three 0-junctions of three bonds, two inertias, the transformer
    assert len(steps[4].graph.bonds) == 10  # figure 26: the ground is gone
    assert set(steps[4].graph.elements) >= {"crank-bearing.M", "slider-ground.B", "slider-ground.F"}
    assert len(steps[5].graph.of_kind("0")) == 0  # figures 27 and 28: 0-junctions with one bond in and one out go
    assert steps[6].graph is steps[5].graph


def test_causality_is_the_thesis_one():
    result = slider_crank().causality
    assert result.integral == ("J",)
    assert result.derivative == ("m",)


def test_printed_it_says_what_every_step_did():
    text = str(slider_crank())
    for line in (
        "3 transformers and gyrators\n    MTF:T between 1:crank and 1:slider",
        "R:B = 0.5 on 0:slider-ground.B between 1:slider and 1:ground",
        "1:ground dropped; 1:ground does not move",
        "all rules: from 10 bonds to 7; numbered anew",
        "derivative: m",
    ):
        assert line in text


def test_power_directions_make_a_force_push_the_first_velocity_and_pull_the_second():
    drawn = procedure(
        {"a": "translation", "b": "translation"},
        [(I("ma", 1.0), "a"), (I("mb", 2.0), "b"), (Se("F", 3.0), "a", "b"), (C("k", 0.1), "a", "b")],
    )
    directed = {(b.tail, b.head) for b in drawn.steps[3].graph.bonds}
    assert {("F", "a-b.F"), ("a-b.F", "a"), ("b", "a-b.F")} <= directed
    assert {("a-b.k", "k"), ("a", "a-b.k"), ("a-b.k", "b")} <= directed


def test_parallel_spring_and_damper_end_on_one_junction():
    drawn = procedure(
        {"a": "translation", "b": "translation"},
        [(I("ma", 1.0), "a"), (I("mb", 2.0), "b"), (R("B", 3.0), "a", "b"), (C("k", 0.1), "a", "b"), (Se("F", 1.0), "a")],
    )
    graph = drawn.graph
    assert graph.bond_of("B").other("B") == graph.bond_of("k").other("k")
    assert "double difference" in str(drawn.steps[5])


def test_a_gyrator_joins_two_domains():
    drawn = procedure(
        {"armature": "electric", "shaft": "rotation"},
        [(Se("U", 12.0), "armature"), (R("Ra", 0.3), "armature"), (I("J", 0.01), "shaft"), (R("B", 0.1), "shaft")],
        [(GY("k", 0.05), "armature", "shaft")],
    )
    assert len(drawn.graph.bonds) == 6
    assert "GY:k = 0.05 between 1:armature and 1:shaft" in str(drawn)


def test_what_is_to_be_kept_is_kept():
    kept = procedure(
        {"motor": "rotation", "shaft": "rotation"},
        [(Se("M", 1.0), "motor"), (I("J", 1.0), "shaft"), (R("B", 1.0), "shaft")],
        [(TF("T", 2.0), "motor", "shaft")],
        displacements={"phi": ("shaft", 0.5)},
        keep=["motor"],
    )
    assert {"motor", "shaft"} <= set(kept.graph.elements)
    assert kept.graph.displacements["phi"].initial == 0.5


def test_everything_that_does_not_fit_is_reported_at_once():
    with pytest.raises(GraphError) as caught:
        procedure(
            {"a": "translation", "idle": "translation"},
            [(I("m", 1.0), "a"), (I("m", 2.0), "nowhere"), (TF("T", 1.0), "a"), (R("B", 1.0), "a", "a")],
            [(GY("G", 1.0), "a", "elsewhere")],
            zero=["ground"],
            displacements={"x": "slider"},
        )
    assert str(caught.value).splitlines() == [
        "two of the velocities and elements are named 'm'",
        "I:m: no velocity 'nowhere'",
        "TF:T: found a TF, expected one of C, I, R, Se, Sf",
        "R:B: found velocities a, a, expected 1 or 2 different ones",
        "GY:G: no velocity 'elsewhere'",
        "zero velocity 'ground': no such velocity",
        "displacement 'x': no velocity 'slider'",
        "velocity 'idle': nothing is on it, leave it out",
    ]


def test_velocities_of_two_domains_need_a_transducer():
    with pytest.raises(GraphError, match="without a transducer"):
        procedure({"a": "rotation", "b": "translation"}, [(I("J", 1.0), "a"), (R("B", 1.0), "a", "b")])


# Rules of simplification keep effort and flow at every port that stays; what has no power goes.


REWRITES = [drop_dangling, drop_two_bond_junctions, merge_equal_junctions, drop_zero_sources, absorb_junctions]
REWRITES += [merge_double_differences, simplify, drop_zero_velocity]
LAPLACE = 1.37  # any number that is not special: d/dt becomes a factor, and the whole graph one linear system


def rows(graph):
    """Every equation of a graph as ({(variable, bond): factor}, right-hand side)."""
    for name, element in graph.elements.items():
        at, law = graph.at(name), element.law
        e, f = (("e", at[0].number), ("f", at[0].number))
        if element.kind in "01":
            same, summed = ("f", "e") if element.kind == "1" else ("e", "f")
            yield from (({(same, at[0].number): 1.0, (same, b.number): -1.0}, 0.0) for b in at[1:])
            yield {(summed, b.number): b.sign(name) for b in at}, 0.0
        elif element.kind in ("TF", "GY"):
            into, out = (b.number for b in graph.ends(name))
            crossed, ratio = element.kind == "GY", graph.constant(name)
            yield {("e" if crossed else "f", out): 1.0, ("f", into): -ratio}, 0.0
            yield {("e", into): 1.0, ("f" if crossed else "e", out): -ratio}, 0.0
        elif element.kind in ("Se", "Sf"):
            yield {e if element.kind == "Se" else f: 1.0}, law
        else:
            factor = {"I": LAPLACE * law, "R": law, "C": 1.0 / (LAPLACE * law)}[element.kind]
            yield {e: 1.0, f: -factor}, 0.0


class Solved:
    """All solutions of a graph's equations: one of them and the directions in which it is free."""

    def __init__(self, graph):
        self.graph = graph
        self.column = {(v, b.number): 2 * k + j for k, b in enumerate(graph.bonds) for j, v in enumerate("ef")}
        equations = list(rows(graph))
        matrix = np.zeros((len(equations), len(self.column)))
        for k, (terms, _) in enumerate(equations):
            for variable, factor in terms.items():
                matrix[k, self.column[variable]] += factor
        right = np.array([value for _, value in equations])
        _, singular, basis = np.linalg.svd(matrix)
        rank = int(np.sum(singular > 1e-9 * singular[0]))
        self.free = basis[rank:].T
        self.one = np.linalg.lstsq(matrix, right, rcond=1e-9)[0]
        self.consistent = bool(np.allclose(matrix @ self.one, right, atol=1e-7))

    def at(self, names):
        """Effort and flow at these one-ports: one solution, and a basis of what is free."""
        columns = [self.column[v, self.graph.bond_of(name).number] for name in names for v in "ef"]
        u, singular, _ = np.linalg.svd(self.free[columns])
        return self.one[columns], u[:, : int(np.sum(singular > 1e-7))]

    def power(self, name):
        bond = self.graph.bond_of(name)
        return -bond.sign(name) * self.one[self.column["e", bond.number]] * self.one[self.column["f", bond.number]]


def ports(graph):
    return [e.name for e in graph.of_kind("Se", "Sf", "I", "C", "R")]


def copies(graph, name):
    return [n for n in ports(graph) if n == name or (n.startswith(f"{name}.") and n.rpartition(".")[2].isdigit())]


def assert_same_ports(before, after, but=()):
    """Effort and flow at every port that stayed are what they were; the copies of a source share its power."""
    old, new = Solved(before), Solved(after)
    assert old.consistent
    assert new.consistent
    shared = [n for n in ports(after) if n in before.elements and n not in but and len(copies(after, n)) == 1]
    (x, free), (y, free_after) = old.at(shared), new.at(shared)
    assert free.shape == free_after.shape
    np.testing.assert_allclose(free @ (free.T @ free_after), free_after, atol=1e-6)
    np.testing.assert_allclose(free @ (free.T @ (x - y)), x - y, atol=1e-6, rtol=1e-6)
    for name in ports(before):
        copied = copies(after, name)
        if len(copied) > 1 and not old.at([name])[1].size and not new.at(copied)[1].size:
            assert sum(map(new.power, copied)) == pytest.approx(old.power(name), abs=1e-6)


def random_graph(seed):
    """A connected graph of junctions of any kind, plainly or through two-ports joined, with loops, zeros and loose ends."""
    draw = random.Random(seed)
    b = Builder()
    names = [b.add(draw.choice([One, Zero])(f"j{k}")) for k in range(draw.randint(1, 7))]
    links = [(names[k], names[draw.randrange(k)]) for k in range(1, len(names))]
    links += [tuple(draw.sample(names, 2)) for _ in range(draw.randint(0, 3)) if len(names) > 1]
    for k, link in enumerate(links):
        first, second = draw.sample(link, 2)
        kind = draw.choices(["bond", "TF", "GY"], [8, 2, 1])[0]
        if kind == "bond":
            b.bond(first, second)
        else:
            ratio = draw.choice([0.0, -0.7, 1.3, 2.0, 0.6, 1.7])
            b.parameter(**{f"ratio{k}": ratio})
            law = draw.choice([ratio, Function(lambda x: x, ("x",), (f"ratio{k}",))])  # plain, or only known to vary
            two_port = b.add({"TF": TF, "GY": GY}[kind](f"t{k}", law))
            b.bond(first, two_port).bond(two_port, second)
    ones = [name for name in names if b.part(name).elements[name].kind == "1"]
    for k in range(draw.choice([0, 0, 2, 3]) if len(ones) > 1 else 0):
        zero, turn = b.add(Zero(f"d{k}")), draw.choice([1, 1, 1, -1])
        for one in ones[:2]:
            b.bond(*(one, zero)[::turn] if one == ones[0] else (zero, one)[::turn])
        b.port(zero, draw.choice([I, C, R, Se])(f"q{k}", draw.uniform(0.5, 2.0)))
    for k in range(draw.randint(1, len(names) + 2)):
        kind, value = draw.choice([Se, Sf, I, C, R]), draw.uniform(0.5, 2.0)
        b.port(draw.choice(names), kind(f"p{k}", 0.0 if kind in (Se, Sf) and draw.random() < 0.5 else value))
    try:
        return b.build(loose=True)
    except GraphError:
        return None


def unless_contradictory(before, rewrite):
    """The rewritten graph; a graph that has solutions must not be refused, unless they are all zero."""
    consistent, after, refused = Solved(before).consistent, None, ""
    try:
        after = rewrite()
    except GraphError as error:
        refused = str(error)
    assert after or "nothing is left" in refused or not consistent
    assume(after and consistent)
    return after


@pytest.mark.parametrize("rule", REWRITES, ids=lambda rule: rule.__name__)
@given(seed=st.integers(0, 2**32))
@settings(max_examples=6, deadline=None, derandomize=True)
def test_every_rule_leaves_effort_and_flow_at_the_ports_that_stay(rule, seed):
    graph = random_graph(seed)
    assume(graph is not None)
    assert_same_ports(graph, unless_contradictory(graph, lambda: rule(graph).graph))


@given(seed=st.integers(0, 2**32))
@settings(max_examples=8, deadline=None, derandomize=True)
def test_what_is_to_stay_stays_and_what_is_held_at_zero_moves_no_more(seed):
    graph = random_graph(seed)
    assume(graph is not None)
    draw = random.Random(seed)
    ones = [e.name for e in graph.of_kind("1")]
    keep = draw.sample(list(graph.elements), 2)
    ground = draw.sample(ones, min(len(ones), draw.choice([0, 1, 2])))
    state = Builder()
    state._elements, state._bonds = dict(graph.elements), list(graph.bonds)
    state.parameter(**graph.parameters)
    for name in ground:
        state.port(name, Sf(f"{name}.ground", 0.0))
    try:
        before = state.build(loose=True)
    except GraphError:
        return
    after = unless_contradictory(before, lambda: simplify(drop_zero_velocity(graph, ground, keep).graph, keep).graph)
    assert set(keep) <= set(after.elements)
    # what a source holds back at a junction to keep is undetermined while a second zero holds that too, and known after
    assert_same_ports(before, after, but=[n for n in ports(before) if before.elements[n].law == 0.0])


def test_a_two_bond_junction_goes_if_power_passes_through():
    b = line("1:a", "0:z", "1:b", elements={"a": [Se("M", 3.0), I("J", 1.0)], "b": [I("m", 2.0), R("B", 0.5)]})
    result = drop_two_bond_junctions(b.build())
    assert listed(result.graph)[0] == "1:a -> 1:b"
    assert str(result.log[0]) == "two bonds: bond 1, 2: 0:z dropped; 1:a -> 1:b says the same"


def test_a_two_bond_junction_that_turns_a_sign_stays():
    b = line("1:a", elements=LOAD).zero("z").one("b").on("b", I("m", 1.0), R("B", 0.5)).bond("a", "z").bond("b", "z")
    assert drop_two_bond_junctions(b.build()).log == ()


def test_a_two_bond_junction_between_a_source_and_a_transformer_stays():
    b = Builder().one("a").on("a", Se("M", 1.0)).one("b").on("b", I("J", 1.0), R("B", 1.0)).transform("a", "b", 2.0)
    assert drop_two_bond_junctions(b.build()).log == ()


def test_equal_junctions_merge_and_their_displacement_moves_along():
    b = (
        line("1:a", "1:b", elements={**LOAD, "b": [R("B", 0.5)]})
        .bond("b", "a")
        .displacement("x", "b")
        .displacement("y", "a")
    )
    result = merge_equal_junctions(b.build())
    assert listed(result.graph) == ["Se:M = 3 -> 1:a", "1:a -> I:J = 2", "1:a -> R:B = 0.5"]
    assert {d.of for d in result.graph.displacements.values()} == {"a"}
    assert "displacement 'x' moves there" in result.log[0].what


def test_a_merged_junction_takes_the_motions_of_laws_with_it():
    b = line("1:a", "1:b", elements=LOAD).one("c").on("c", I("m", 1.0))
    b = b.transform("b", "c", Modulus(np.sin, np.cos, Motion("b")), name="T").displacement("x", "a")
    result = merge_equal_junctions(b.build(), keep=["a"]).graph
    assert result.elements["T"].law.motion.of == "a"


def test_the_junction_to_keep_gives_its_name():
    graph = line("1:a", "1:b", elements=LOAD).on("b", R("B", 1.0)).build()
    assert "b" in merge_equal_junctions(graph, keep=["b"]).graph.elements
    assert merge_equal_junctions(graph, keep=["a", "b"]).log == ()


def base_motion():
    """A moving base that shakes two masses, which a spring joins."""
    b = Builder().one("base").on("base", Sf("v", 0.3)).one("a").one("b").on("a", I("ma", 1.0)).on("b", I("mb", 2.0))
    return b.between("base", "a", C("k1", 0.1)).between("base", "b", C("k2", 0.2)).between("a", "b", C("k3", 0.3)).build()


def test_a_source_at_a_junction_is_copied_to_neighbours_and_the_powers_add_up():
    graph = base_motion()
    result = absorb_junctions(graph)
    assert [a.rule for a in result.log] == ["source at a junction"]
    assert result.graph.elements["v.2"].law == 0.3
    whole, parts = Solved(graph), Solved(result.graph)
    assert parts.power("v") + parts.power("v.2") == pytest.approx(whole.power("v"), rel=1e-9)
    assert whole.power("v") != pytest.approx(0.0)


def test_a_double_difference_becomes_one():
    b = Builder().one("a").one("b").on("a", Se("F", 1.0), I("ma", 1.0)).on("b", I("mb", 2.0))
    graph = b.between("a", "b", C("k", 0.1), name="zk").between("a", "b", R("B", 0.5), name="zB").build()
    result = merge_double_differences(graph)
    assert listed(result.graph)[3:] == [
        "1:a -> 0:zk",
        "0:zk -> 1:b",
        "1:zk.rate -> C:k = 0.1",
        "1:zk.rate -> R:B = 0.5",
        "0:zk -> 1:zk.rate",
    ]
    assert_same_ports(graph, result.graph)


def test_a_dangling_junction_behind_a_gyrator_holds_the_flow_before_it():
    b = Builder().one("a").one("b").one("c").on("a", I("J", 1.0)).on("c", I("m", 2.0), Se("F", 3.0))
    graph = b.between("a", "c", C("k", 0.5)).gyrate("a", "b", 2.0, name="G").build(loose=True)
    result = drop_dangling(graph).graph
    assert "J" not in result.elements
    assert_same_ports(graph, result)


def test_opposite_differences_are_left_alone():
    b = Builder().one("a").one("b").on("a", Se("F", 1.0), I("ma", 1.0)).on("b", I("mb", 2.0))
    graph = b.between("a", "b", C("k", 0.1), name="z1").between("b", "a", R("B", 0.5), name="z2").build()
    assert merge_double_differences(graph).log == ()


def test_the_domain_that_a_dropped_junction_named_is_not_lost():
    b = Builder().one("a", "rotation").one("b").bond("a", "b").on("a", Se("M", 1.0)).on("b", I("J", 1.0), R("B", 1.0))
    graph = simplify(b.build()).graph
    assert "a" not in graph.elements
    assert graph.domain(graph.bonds[0]).name == "rotation"


def test_simplifying_twice_changes_nothing_and_numbers_bonds_from_one():
    once = simplify(base_motion())
    twice = simplify(once.graph)
    assert listed(twice.graph) == listed(once.graph)
    assert [b.number for b in once.graph.bonds] == list(range(1, len(once.graph.bonds) + 1))
    assert once.log[-1].what == f"from 12 bonds to {len(once.graph.bonds)}"
    assert len(twice.log) == 1


def test_measured_junctions_stay_even_with_two_bonds():
    b = line("1:a", "0:z", "1:b", elements={"a": [Se("M", 1.0)], "b": [I("J", 1.0)]}).displacement("q", "b")
    assert "b" in simplify(b.build()).graph.elements


def test_all_unknown_names_are_reported_at_once():
    graph = line("1:a", elements=LOAD).build()
    with pytest.raises(GraphError, match=r"(?s)'x'.*'y'"):
        simplify(graph, keep=["x", "y"])
    with pytest.raises(GraphError, match=r"(?s)'x': no 1-junction.*'J': no 1-junction"):
        drop_zero_velocity(graph, ["x", "J"])


@pytest.mark.parametrize("row", [["1:a", "1:x"], ["1:a", "0:z", "1:x"], ["1:a", "1:y", "0:z", "1:x"]])
def test_dangling_1_junctions_go_with_the_junctions_that_lead_to_them(row):
    result = drop_dangling(line(*row, elements=LOAD).build(loose=True)).graph
    assert set(result.elements) >= {"a", "M", "J"}
    assert not set(result.elements) & {"x", "z"}


def test_a_dangling_0_junction_stops_the_1_junction_that_it_hangs_on():
    b = line("1:a", "0:z", "1:b", elements={**LOAD, "b": [I("m", 1.0)], "z": [R("B", 1.0)]}).zero("x").bond("b", "x")
    result = drop_dangling(b.build(loose=True))
    assert result.log[0].what == "1:b, I:m, 0:x dropped"
    assert listed(result.graph)[-1] == "0:z -> R:B = 1"


def test_a_dangling_1_junction_takes_the_power_of_all_that_shares_its_zero_effort():
    b = line("1:a", "0:z", "1:x", elements={**LOAD, "z": [C("k", 0.1), R("B", 0.5)]})
    result = drop_dangling(b.build(loose=True))
    assert listed(result.graph) == ["Se:M = 3 -> 1:a", "1:a -> I:J = 2"]
    assert result.log[0].what == "0:z, 1:x, C:k, R:B dropped"
    assert result.log[0].bonds == (1, 2, 5, 6)


def test_a_dangling_1_junction_that_contradicts_a_source_is_an_error_that_names_it():
    b = line("1:a", "0:z", "1:x", elements={**LOAD, "z": [Se("F", 3.0)]})
    with pytest.raises(GraphError, match="bond 5: Se:F = 3 sets an effort that the rest keeps at 0"):
        drop_dangling(b.build(loose=True))


def slider(driven):
    """A slider that nothing hangs on, driven through an MTF from the crank, or driving it."""
    b = line("1:a", elements=LOAD).one("x").displacement("q", "a")
    return b.transform(*(("a", "x") if driven else ("x", "a")), lambda q: np.sin(q), name="T").build(loose=True)


def test_a_modulated_transformer_goes_only_in_the_direction_in_which_its_zeros_do_not_matter():
    assert set(drop_dangling(slider(True)).graph.elements) == {"a", "M", "J"}
    assert drop_dangling(slider(False)).log == ()  # where sin q = 0, x takes any effort and a stands still


@pytest.mark.parametrize(
    ("junction", "source", "left"),
    [
        (One, Se, {"j", "p", "q", "other", "r"}),  # no term in the sum of efforts
        (Zero, Sf, {"j", "p", "q", "other", "r"}),  # no term in the sum of flows
        (Zero, Se, {"other", "r"}),  # no effort at j: nothing on it has power
        (One, Sf, {"other", "r"}),  # no flow at j
    ],
)
def test_a_zero_source_is_no_term_or_takes_its_junction_with_it(junction, source, left):
    b = Builder()
    other = Zero if junction is One else One
    b.add(junction("j"))
    b.add(other("other"))
    b.on("j", source("s", 0.0), I("p", 1.0), R("q", 2.0)).bond("j", "other").port("other", R("r", 1.0))
    assert set(drop_zero_sources(b.build()).graph.elements) == left


def test_ground_goes_with_all_that_hangs_on_it():
    b = line("1:a", elements=LOAD).one("ground").on("ground", I("earth", 6e24), R("soil", 1.0))
    result = drop_zero_velocity(b.between("a", "ground", R("B", 0.5)).build(), ["ground"])
    assert listed(result.graph)[-1] == "0:a-ground -> R:B = 0.5"
    assert result.log[0].what == "1:ground, I:earth, R:soil dropped"
    assert listed(simplify(result.graph).graph) == ["Se:M = 3 -> 1:a", "1:a -> I:J = 2", "1:a -> R:B = 0.5"]


def test_ground_stays_where_a_displacement_is_measured_or_the_graph_would_fall_apart():
    b = Builder().one("g").one("a").one("b").on("a", I("ma", 1.0)).on("b", I("mb", 1.0))
    graph = b.between("a", "g", C("ka", 1.0)).between("b", "g", C("kb", 1.0)).build()
    state = drop_zero_velocity(graph, ["g"]).graph
    assert state.elements["g.zero"].law == 0.0
    measured = Builder().one("g", displacement="x").one("a").on("a", I("m", 1.0)).between("a", "g", C("k", 1.0)).build()
    assert "g.zero" in drop_zero_velocity(measured, ["g"]).graph.elements


def test_ground_beyond_a_modulated_transformer_is_held_by_a_source():
    b = line("1:a", elements=LOAD).displacement("q", "a").one("g").transform("a", "g", lambda q: np.cos(q), name="T")
    result = drop_zero_velocity(b.on("g", I("m", 1.0)).build(), ["g"])
    assert listed(result.graph)[2:] == ["1:a -> MTF:T", "MTF:T -> 1:g", "Sf:g.zero = 0 -> 1:g"]


def test_a_graph_of_zeros_alone_is_an_error():
    with pytest.raises(GraphError, match="nothing is left without Se:s"):
        simplify(line("1:a", "1:b", elements={"a": [Se("s", 0.0)]}).build(loose=True))
