"""Which flows are independent: against the finite eigenvalues of all bond equations together, and known cases."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bondgraph import GY, TF, Builder, C, GraphError, I, R, Se, Sf
from bondgraph.motion.dynamics import Dynamics
from bondgraph.motion.formulation import Formulation

ONE_PORTS = {"I": I, "C": C, "R": R, "Se": Se, "Sf": Sf}


def random_graph(seed):
    """Junctions joined at random by bonds, transformers and gyrators, with one-ports of either half arrow."""
    rng = np.random.default_rng(seed)
    b, count = Builder(), int(rng.integers(1, 7))
    for k in range(count):
        (b.one if rng.random() < 0.5 else b.zero)(f"j{k}")

    def link(i, j):
        how = rng.choice(["bond", "transform", "gyrate"], p=[0.5, 0.3, 0.2])
        ratio = float(rng.choice([-1, 1]) * rng.uniform(0.5, 2.0))
        ends = (f"j{i}", f"j{j}") if rng.random() < 0.5 else (f"j{j}", f"j{i}")
        b.bond(*ends) if how == "bond" else getattr(b, how)(*ends, ratio, name=f"T{len(b)}")

    for k in range(1, count):
        link(k, int(rng.integers(0, k)))
    if count > 1 and rng.random() < 0.5:
        link(*(int(k) for k in rng.choice(count, 2, replace=False)))
    for k in range(count):
        for _ in range(int(rng.integers(0, 4))):
            kind = rng.choice(list(ONE_PORTS), p=[0.32, 0.25, 0.3, 0.08, 0.05])
            name = b.add(ONE_PORTS[kind](f"{kind}{len(b)}", float(rng.uniform(0.5, 2.0))))
            b.bond(*((name, f"j{k}") if rng.random() < 0.5 else (f"j{k}", name)))
    return b.build()


class Bondwise:
    """E x' = A x (+ sources) with the effort and flow of every bond and the displacement of every spring as unknowns."""

    def __init__(self, graph):
        self.graph, springs = graph, graph.of_kind("C")
        self.e = {b.number: 2 * k for k, b in enumerate(graph.bonds)}
        self.f = {number: k + 1 for number, k in self.e.items()}
        self.q = {spring.name: 2 * len(self.e) + k for k, spring in enumerate(springs)}
        self.size, self.rows = 2 * len(self.e) + len(springs), []
        for element in graph.elements.values():
            self.write(element)
        self.A, self.E = (np.array([row[k] for row in self.rows]) for k in (0, 1))

    def row(self, plain, rates=()):
        self.rows.append((np.zeros(self.size), np.zeros(self.size)))
        for terms, row in zip((plain, rates), self.rows[-1], strict=True):
            for place, value in terms:
                row[place] += value

    def write(self, element):
        graph, e, f, bonds = self.graph, self.e, self.f, self.graph.at(element.name)
        if element.kind in "10":
            common, summed = (f, e) if element.kind == "1" else (e, f)
            for b in bonds[1:]:
                self.row([(common[b.number], 1.0), (common[bonds[0].number], -1.0)])
            self.row([(summed[b.number], b.sign(element.name)) for b in bonds])
        elif element.kind in ("TF", "GY"):
            (into, out), ratio = (b.number for b in graph.ends(element.name)), element.law
            pairs = (
                ((f[out], f[into]), (e[into], e[out])) if element.kind == "TF" else ((e[out], f[into]), (e[into], f[out]))
            )
            for answer, cause in pairs:
                self.row([(answer, 1.0), (cause, -ratio)])
        else:
            self.one_port(element, bonds[0].number, bonds[0].sign(element.name))

    def one_port(self, element, b, sign):
        effort, flow = (self.e[b], 1.0), (self.f[b], sign * element.law if element.kind in "IR" else sign)
        if element.kind == "R":
            self.row([effort, (flow[0], -flow[1])])
        elif element.kind == "I":
            self.row([effort], [flow])
        elif element.kind == "C":
            self.row([effort, (self.q[element.name], -1.0 / element.law)])
            self.row([flow], [(self.q[element.name], 1.0)])
        else:
            self.row([effort if element.kind == "Se" else flow])


def state_matrix(graph):
    dynamics = Dynamics(graph)
    size = len(dynamics.state.names)
    at_zero = np.array(dynamics.at(0.0, [0.0] * size).rates, dtype=float)
    columns = [np.array(dynamics.at(0.0, row.tolist()).rates, dtype=float) - at_zero for row in np.eye(size)]
    return np.array(columns).reshape(size, size).T


def matched(found, expected):
    """The greatest distance of expected numbers to found ones, each used once, and the found ones left."""
    left, worst = list(found), 0.0
    for value in expected:
        place = int(np.argmin([abs(other - value) for other in left])) if left else None
        if place is None:
            return np.inf, left
        worst = max(worst, abs(left.pop(place) - value))
    return worst, left


def test_random_graphs_have_the_eigenvalues_of_all_bond_equations_together():
    """Eigenvalues as 1/(s - lambda); springs whose efforts are tied add eigenvalues 0 to the state's."""
    s, compared = 0.7368 + 0.3j, 0
    for seed in range(60):
        try:
            graph = random_graph(seed)
            matrix = state_matrix(graph)
        except GraphError:
            continue
        whole = Bondwise(graph)
        pencil = s * whole.E - whole.A
        if np.linalg.cond(pencil) > 1e10:  # loops leave efforts, but no flows open
            continue
        values = np.linalg.eigvals(np.linalg.solve(pencil, whole.E))
        worst, left = matched(1.0 / (s - np.linalg.eigvals(matrix)), values[np.abs(values) > 1e-5])
        assert worst < 1e-4, seed
        assert_allclose(left, 1.0 / s, atol=1e-5)
        compared += 1
    assert compared >= 10


def test_inertias_come_first_then_resistors_then_springs():
    b = Builder().zero("node").one("line").bond("line", "node").on("line", Se("E", 1.0), R("Rs", 1.0))
    form = Formulation(b.on("node", I("L", 1.0), C("c1", 1.0), C("c2", 2.0), R("leak", 3.0)).build())
    names = [form.name_of(v) for v in form.coordinates.all]
    assert names[0] == "bond 4"  # of L
    assert len(form.coordinates.moving) == 1
    assert len(form.coordinates.massless) == 3
    assert len(form.static) == 1


def test_an_owner_of_a_displacement_without_inertia_leaves_the_mass_matrix_regular():
    b = Builder().one("end", displacement="x").one("mass").on("end", Se("F", 1.0), R("d", 0.5)).on("mass", I("m", 1.0))
    form = Formulation(b.between("end", "mass", C("k", stiffness=4.0)).build())
    assert [form.name_of(v) for v in form.coordinates.moving] == ["mass"]
    assert [form.name_of(v) for v in form.coordinates.massless] == ["end"]


def test_an_inertia_without_weight_is_none():
    b = Builder().one("a").one("b").on("a", I("J", 0.0), R("r", 1.0)).on("b", I("K", 1.0))
    form = Formulation(b.between("a", "b", C("k", 1.0)).build())
    assert [form.name_of(v) for v in form.coordinates.moving] == ["b"]


def test_flow_sources_are_given():
    form = Formulation(Builder().one("a").on("a", Sf("w", 2.0), I("J", 1.0)).build())
    assert form.coordinates.moving == ()
    assert len(form.coordinates.imposed) == 1


def test_small_ratios_count_as_much_as_others():
    b = Builder().one("piston").one("oil").on("piston", I("m", 1.0), Se("F", 1.0)).transform("piston", "oil", 1e-7)
    b.on("oil", C("volume", 1e-12), R("leak", 1e9))
    form = Formulation(b.build())
    assert len(form.coordinates.all) == 1
    assert form.coordinates.massless == ()


def test_two_gyrators_of_equal_ratio_side_by_side_are_no_accident():
    b = Builder().one("a").one("b").on("a", R("r", 1.0), Se("E", 1.0)).on("b", I("J", 1.0))
    b.add(GY("g", 1.0))
    b.add(TF("t", 0.5))
    b.zero("z").bond("a", "g").bond("g", "z").bond("b", "t").bond("t", "z").on("z", R("s", 1.0))
    assert len(Formulation(b.build()).coordinates.moving) == 1


def refused(builder, match):
    with pytest.raises(GraphError, match=match) as caught:
        Formulation(builder.build(loose=True))
    assert len(str(caught.value).splitlines()) == 1


def test_flow_sources_through_a_transformer_contradict():
    b = Builder().one("a").one("b").on("a", Sf("x", 1.0)).transform("a", "b", 2.0).on("b", Sf("y", 2.0), I("J", 1.0))
    refused(b, r"over-constrained: TF:a->b \(bonds 2, 3\) ask of the same flows")


def test_transformers_in_a_loop_contradict_repeat_or_agree():
    def ring(last):
        b = Builder().one("a").one("b").one("c").on("a", I("J", 1.0)).on("c", I("K", 1.0))
        return b.transform("a", "b", 2.0).transform("b", "c", 2.0).transform("c", "a", last)

    refused(ring(0.5), "over-constrained: TF:a->b .*, TF:b->c .*, TF:c->a .* lock a, c, b")
    refused(ring(0.25), "over-constrained: TF:.* contradict or repeat each other")


def test_a_flow_that_nothing_holds_is_named():
    b = Builder().zero("node").one("a").one("b").bond("a", "node").bond("node", "b")
    b.on("a", Se("E", 1.0)).on("b", Se("F", 1.0))
    refused(b, "nothing holds the flow of (a|b): it meets no inertia, resistor, spring or gyrator")


def test_stores_tied_through_a_gyrator_are_named():
    b = Builder().one("coil").one("shaft").on("coil", I("L", 1.0), Se("V", 1.0)).on("shaft", C("k", 1.0))
    refused(b.gyrate("coil", "shaft", 2.0), "the flow of shaft is tied through GY:coil->shaft .*: hang an I or R")


def test_varying_ratios_are_in_no_relation_to_each_other():
    b = Builder().one("a", displacement="x").one("b").on("a", I("J", 1.0)).on("b", I("K", 1.0))
    refused(b.transform("a", "b", lambda x: np.sin(x)).transform("a", "b", lambda x: np.sin(x), name="other"), "lock a, b")
