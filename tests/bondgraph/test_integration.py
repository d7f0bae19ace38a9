"""Solution of the motion of a graph: formulation, algebraic loops, steps, programs."""

import math
import pickle
from itertools import pairwise

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from bondgraph import (
    Builder,
    C,
    Dynamics,
    GraphError,
    I,
    Law,
    Modulus,
    Motion,
    R,
    Se,
    Sf,
    causality,
    linearize,
    reach,
)
from bondgraph.motion.algebra import settle, solve, solve_symmetric
from bondgraph.motion.formulation import Formulation
from bondgraph.motion.runge_kutta import ORDER_5, ORDER_8, DormandPrince, at, method
from bondgraph.motion.stepping import ADAPTIVE, FIXED, Breaks, Step, adaptive, fixed, runge_kutta_step, through_breaks
from bondgraph.numerics import summits
from bondgraph.recording import Recorder

# Which flows are independent: against the finite eigenvalues of all bond equations together, and known cases.


ONE_PORTS = {"I": I, "C": C, "R": R, "Se": Se, "Sf": Sf}


def random_graph(seed, fields=0):
    """Junctions joined at random by bonds, transformers and gyrators, with one-ports of either half arrow, and fields."""
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
    for k in range(fields):
        kind, size = rng.choice(["I", "C", "R"], p=[0.4, 0.4, 0.2]), int(rng.integers(2, 4))
        half, turned = rng.normal(size=(2, size, size))
        matrix = half @ half.T + 0.3 * np.eye(size) + (turned - turned.T if kind == "R" else 0.0)
        b.field(ONE_PORTS[kind](f"F{k}", matrix), *(f"j{int(j)}" for j in rng.integers(0, count, size)))
    return b.build()


class Bondwise:
    """E x' = A x (+ sources) with the effort and flow of every bond and the displacement of every spring as unknowns."""

    def __init__(self, graph):
        self.graph, springs = graph, [e for e in graph.of_kind("C", "I") if e.kind == "C" or callable(e.law)]
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

    def shared(self, element, b):
        """A port of a field: its law by all their states, or flows."""
        law, kind, name = element.law, element.kind, element.name
        ports = [name, *(of[2:] for of in law.of if "_" in of)]
        order = sorted(range(len(ports)), key=lambda k: "_" in law.of[k])
        slopes = [law.partials(*[0.0] * len(ports))[1][k] for k in order]
        effort, flow = (self.e[b], 1.0), (self.f[b], 1.0)
        at = [self.f[self.graph.bond_of(port).number] if kind == "R" else self.q[port] for port in ports]
        self.row([flow if kind == "I" else effort, *((k, -slope) for k, slope in zip(at, slopes, strict=True))])
        if kind != "R":
            self.row([effort if kind == "I" else flow], [(self.q[name], 1.0)])

    def one_port(self, element, b, sign):
        if callable(element.law):
            self.shared(element, b)
            return
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
    size = len(dynamics.names)
    at_zero = np.array(dynamics.at(0.0, [0.0] * size).rates, dtype=float)
    columns = [np.array(dynamics.at(0.0, row.tolist()).rates, dtype=float) - at_zero for row in np.eye(size)]
    return np.array(columns).reshape(size, size).T


def matched(result, expected):
    """The greatest distance of expected numbers to found ones, each used once, and the found ones left."""
    left, worst = list(result), 0.0
    for value in expected:
        place = int(np.argmin([abs(other - value) for other in left])) if left else None
        if place is None:
            return np.inf, left
        worst = max(worst, abs(left.pop(place) - value))
    return worst, left


def finite(graph):
    """The values s of det(s E - A) = 0 of all bond equations, as 1/(shift - s); None where they are singular for every s."""
    whole = Bondwise(graph)
    pencil = SHIFT * whole.E - whole.A
    if np.linalg.cond(pencil) > 1e10:
        return None
    values = np.linalg.eigvals(np.linalg.solve(pencil, whole.E))
    return values[np.abs(values) > 1e-7]


SHIFT = 0.7368 + 0.3j


@pytest.mark.parametrize("first", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in (100, 300, 500, 700, 900))])
def test_random_graphs_have_the_eigenvalues_of_all_bond_equations_together(first):
    """As many states as finite eigenvalues, and the same; refused where these equations are singular, and only there."""
    compared = singular = 0
    for seed in range(first, first + (100 if not first else 200)):
        try:
            graph = random_graph(seed)
        except GraphError:
            continue
        values, strokes = finite(graph), causality(graph)
        if values is None:
            singular += 1
            with pytest.raises(GraphError):
                state_matrix(graph)
            continue
        matrix = state_matrix(graph)
        assert not strokes.conflicts, seed
        assert len(matrix) == len(values) == len(strokes.integral), seed
        worst, _ = matched(1.0 / (SHIFT - np.linalg.eigvals(matrix)), values)
        assert worst < 1e-9 or not len(values), seed
        compared += 1
    assert compared > 40
    assert singular > 3


@pytest.mark.parametrize("first", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in (100, 400, 700))])
def test_random_graphs_with_fields_have_the_eigenvalues_of_all_bond_equations_together(first):
    """Ports of fields in either causality: as many states as finite eigenvalues, the same ones, and none refused."""
    compared = following = 0
    for seed in range(first, first + (30 if not first else 300)):
        try:
            graph = random_graph(seed, 1 + seed % 2)
        except GraphError:
            continue
        values, strokes = finite(graph), causality(graph)
        if values is None:
            continue
        matrix = state_matrix(graph)
        assert len(matrix) == len(values) == len(strokes.integral), seed
        worst, _ = matched(1.0 / (SHIFT - np.linalg.eigvals(matrix)), values)
        assert worst < 1e-8 or not len(values), seed
        compared += 1
        following += any(graph.coupled(name) for name in strokes.derivative)
    assert compared > 15
    assert following > 5


@pytest.mark.slow
def test_structure_alone_tells_what_is_out_of_reach():
    """Of random graphs with numbers in no relation: just where the ranks of [B, AB, ...] and [C; CA; ...] tell it."""
    text = {True: 0, False: 0}
    for seed in range(25):
        try:
            graph = random_graph(seed)
            result = linearize(graph, at={})
        except GraphError:
            continue
        if result.states and result.inputs:
            output = linearize(graph, at={}, outputs=result.states[:1]).unobservable()
            structure = reach(graph, outputs=result.states[:1])
            assert bool(structure.unreachable) == bool(result.unreachable()), seed
            assert bool(structure.unobservable) == bool(output), seed
            text[bool(output)] += 1
    assert min(text.values()) > 1


def test_an_owner_of_a_displacement_without_inertia_is_no_state():
    b = Builder().one("end", displacement="x").one("mass").on("end", Se("F", 1.0), R("d", 0.5)).on("mass", I("m", 1.0))
    form = Formulation(b.between("end", "mass", C("k", stiffness=4.0)).build())
    assert [form.state_name(port) for port in form.stores] == ["p_m", "q_k"]


def test_an_inertia_without_weight_is_none():
    b = Builder().one("a").one("b").on("a", I("J", 0.0), R("r", 1.0)).on("b", I("K", 1.0))
    form = Formulation(b.between("a", "b", C("k", 1.0)).build())
    assert [form.state_name(port) for port in form.stores] == ["p_K", "q_k"]


def test_flow_sources_are_given():
    form = Formulation(Builder().one("a").on("a", Sf("w", 2.0), I("J", 1.0)).build())
    assert form.stores == ()
    assert [port.element.name for port in form.followers] == ["J"]


def test_small_ratios_count_as_much_as_others():
    b = Builder().one("piston").one("oil").on("piston", I("m", 1.0), Se("F", 1.0)).transform("piston", "oil", 1e-7)
    b.on("oil", C("volume", 1e-12), R("leak", 1e9))
    assert_allclose(Dynamics(b.build()).rates(0.0, 2.0, 3.0), [1.0 - 1e-7 * 3e12 - 1e-14 * 1e9 * 2.0, 2e-7], rtol=1e-14)


def test_a_state_lies_before_modulated_transformers_where_nothing_else_weighs():
    """A crank without inertia: the state is its own flow, M = m sin^2, and one state, not two."""
    b = Builder().one("crank", displacement="phi").one("s").transform("crank", "s", lambda phi: np.sin(phi))
    dynamics = Dynamics(b.on("s", I("m", 3.0)).on("crank", Se("M", 2.0)).build())
    assert dynamics.names == ("f_crank", "phi")
    expected = (2.0 - 3.0 * np.sin(0.4) * np.cos(0.4) * 25.0) / (3.0 * np.sin(0.4) ** 2)
    assert_allclose(dynamics.rates(0.0, 5.0, 0.4), [expected, 5.0], rtol=1e-14)


def test_parallel_bonds_of_opposite_direction_pass_nothing_on():
    b = Builder().one("a").zero("z").bond("a", "z").bond("z", "a").on("a", I("m", 2.0), R("r", 3.0))
    dynamics = Dynamics(b.on("z", C("c", 0.5), R("leak", 4.0)).build())
    assert dynamics.names == ("p_m", "q_c")
    assert_allclose(dynamics.rates(0.0, 1.0, 1.0), [-1.5, -0.5], rtol=1e-15)


def refused(builder, match):
    with pytest.raises(GraphError, match=match) as caught:
        Formulation(builder.build(loose=True))
    assert len(str(caught.value).splitlines()) == 1


def test_flow_sources_through_a_transformer_contradict():
    b = Builder().one("a").one("b").on("a", Sf("x", 1.0)).transform("a", "b", 2.0).on("b", Sf("y", 2.0), I("J", 1.0))
    refused(b, r"Sf:x \(bond 1\) and Sf:y \(bond 4\) both set the flow of TF:a->b \(bonds 2, 3\): remove one, or put")


def test_transformers_in_a_loop_contradict_repeat_or_agree():
    def ring(last):
        b = Builder().one("a").one("b").one("c").on("a", I("J", 1.0)).on("c", I("K", 1.0))
        return b.transform("a", "b", 2.0).transform("b", "c", 2.0).transform("c", "a", last)

    refused(ring(0.25), "over-constrained: TF:.* contradict or repeat the conditions of the others")
    locked = Dynamics(ring(0.5).build())
    assert locked.names == ()
    assert set(locked.at(0.0, []).flows.values()) == {0.0}


def test_numbers_that_make_flows_depend_on_each_other_are_refused():
    b = Builder().one("a").one("b").on("a", Se("F", 1.0)).on("b", R("B", 2.0))
    b.sum("c", [("a", 2.0), ("b", 3.0)], "").on("c", I("m1", 1.0)).on("c", Sf("v", 1.0))
    b.sum("d", [("a", 4.0), ("b", 6.0)], "").on("d", Sf("w", 1.0))  # twice the flow of c
    refused(
        b, "over-constrained: .* contradict or repeat the conditions of the others .*: remove one of them, or change a ratio"
    )


def test_a_flow_that_nothing_holds_is_named():
    b = Builder().zero("node").one("a").one("b").bond("a", "node").bond("node", "b")
    b.on("a", Se("E", 1.0)).on("b", Se("F", 1.0))
    refused(b, r"Se:E \(bond 3\) and Se:F \(bond 4\) both set the effort of 0:node \(bonds 1, 2\): remove one, or put")


@pytest.mark.parametrize(("law", "at"), [(0.5, 3.0), (lambda q: q + q**3, 2.0)])
def test_stores_tied_through_a_gyrator_are_one_state(law, at):
    """The coil's flow sets the spring's effort: G f_L = e(q), G^2 q' + L e'(q) q' = G V."""
    b = Builder().one("coil").one("shaft").on("coil", I("L", 4.0), Se("V", 5.0)).on("shaft", C("k", law))
    dynamics = Dynamics(b.gyrate("coil", "shaft", 2.0).build())
    assert dynamics.names == ("p_L",)
    flow = at / 4.0
    q = settle(lambda v: ([v[0] + v[0] ** 3 - 2.0 * flow], [[1.0 + 3.0 * v[0] ** 2]]), 1, (), "q")[0]
    compliance = law if isinstance(law, float) else 1.0 / (1.0 + 3.0 * q**2)
    (rate,) = dynamics.rates(0.0, at)  # G q' = V - L f', with q' = c G f'
    assert_allclose(rate, 4.0 * 5.0 / (4.0 + 4.0 * compliance), rtol=1e-13)


def test_varying_ratios_are_in_no_relation_to_each_other():
    b = Builder().one("a", displacement="x").one("b").on("a", I("J", 1.0)).on("b", I("K", 1.0))
    refused(
        b.transform("a", "b", lambda x: np.sin(x)).transform("a", "b", lambda x: np.sin(x), name="other"),
        "over-constrained: .* lock ",
    )


# Small linear systems and Newton's iteration: the same over floats, arrays, symbols and recordings.


def positive_definite(size, seed):
    a = np.random.default_rng(seed).normal(size=(size, size))
    return a @ a.T + 0.1 * np.eye(size)


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 6), st.integers(0, 1000))
def test_solutions_are_numpys(size, seed):
    matrix = positive_definite(size, seed)
    right = np.random.default_rng(seed + 1).normal(size=size)
    expected = np.linalg.solve(matrix, right)
    assert_allclose(solve_symmetric(matrix.tolist(), right.tolist()), expected, rtol=1e-9, atol=1e-9)
    assert_allclose(
        [row[0] for row in solve(matrix.tolist(), [[r] for r in right.tolist()])], expected, rtol=1e-9, atol=1e-9
    )


def test_only_the_lower_triangle_is_read():
    assert solve_symmetric([[2.0, None], [1.0, 4.0]], [4.0, 9.0]) == [1.0, 2.0]


@pytest.mark.parametrize("size", [1, 2, 3])
def test_arrays_symbols_and_recordings_give_what_floats_give(size):
    matrices = [positive_definite(size, seed) for seed in range(4)]
    right = [float(k + 1) for k in range(size)]
    each = [[row[0] for row in solve(m.tolist(), [[r] for r in right])] for m in matrices]
    stacked = [[np.array([m[i, j] for m in matrices]) for j in range(size)] for i in range(size)]
    assert_allclose([row[0] for row in solve(stacked, [[r] for r in right])], np.transpose(each), rtol=1e-12)
    assert_allclose(solve_symmetric(stacked, right), np.transpose(each), rtol=1e-12)
    recorder = Recorder()
    nodes = [recorder.input(f"x{k}") for k in range(size * size)]
    rows = [nodes[size * i : size * (i + 1)] for i in range(size)]
    outputs = [*(row[0] for row in solve(rows, [[r] for r in right])), *solve_symmetric(rows, right)]
    solved = recorder.program(outputs).function("math")
    assert_allclose(solved(*matrices[0].ravel().tolist()), each[0] * 2, rtol=1e-12)
    symbols = [[sympy.Symbol(f"a{i}{j}") for j in range(size)] for i in range(size)]
    at = {symbols[i][j]: matrices[0][i, j] for i in range(size) for j in range(size)}
    result = [float(row[0].subs(at)) for row in solve(symbols, [[sympy.Float(r)] for r in right])]
    assert_allclose(result, each[0], rtol=1e-9)


@pytest.mark.parametrize("matrix", [[[0.0]], [[1.0, 2.0], [2.0, 4.0]]])
def test_singular_systems_are_errors(matrix):
    with pytest.raises(GraphError, match="lock or branch"):
        solve(matrix, [[1.0] for _ in matrix])
    with pytest.raises(GraphError, match="lock or branch"):
        solve([[sympy.Float(entry) for entry in row] for row in matrix], [[sympy.Integer(1)] for _ in matrix])


def test_a_mass_matrix_that_is_not_positive_is_an_error():
    for matrix in ([[0.0]], [[-1.0]], [[1.0, None], [1.0, 1.0]]):
        with pytest.raises(GraphError, match="the effective inertia vanishes"):
            solve_symmetric(matrix, [1.0] * len(matrix))


def test_newton_settles_each_of_many_states():
    efforts = np.array([4.0, -9.0, 1e-8, 0.0])
    (result,) = settle(lambda u: ([u[0] * abs(u[0]) - efforts], [[2.0 * abs(u[0])]]), 1, (4,), "pipe")
    assert_allclose(result, np.sign(efforts) * np.sqrt(np.abs(efforts)), rtol=1e-10, atol=1e-15)
    pair = settle(
        lambda u: ([u[0] + u[1] - 3.0, u[0] * u[1] ** 2 - 2.0], [[1.0, 1.0], [u[1] ** 2, 2 * u[0] * u[1]]]), 2, (), ""
    )
    assert_allclose([pair[0] + pair[1], pair[0] * pair[1] ** 2], [3.0, 2.0], rtol=1e-12)


def test_where_it_was_last_is_where_it_goes_on():
    calls = []

    def equations(flows):
        calls.append(flows)
        return [flows[0] ** 2 - 4.0], [[2.0 * flows[0]]]

    assert settle(equations, 1, (), "pipe", near=[-2.0]) == [-2.0]
    assert calls == [[-2.0]]


def test_a_step_into_where_a_law_is_not_defined_is_shortened():
    def equations(flows):
        if flows[0] <= 0.0:
            raise ValueError("no logarithm")
        return [np.log(flows[0]) + 3.0], [[1.0 / flows[0]]]

    assert_allclose(settle(equations, 1, (), "pipe"), np.exp(-3.0), rtol=1e-12)


@pytest.mark.parametrize("slope", [0.0, 1.0])
def test_equations_without_solution_are_an_error_that_names_the_flows(slope):
    with pytest.raises(
        GraphError, match=r"no value solves the law of pipe: sought from 0\.001, 1, -0\.001, -1, 1000, -1000 on"
    ):
        settle(lambda flows: ([1.0 + flows[0] ** 2], [[slope * 2.0 * flows[0]]]), 1, (), "pipe")


# Methods of order 5 and 8 in plain numbers: their order at the end of a step and within it, and what is kept of a step.


ORDERS = {5: (ORDER_5, 5, 4), 8: (ORDER_8, 8, 7)}


def swing(t, y):
    """Of y'' = -y, and the integral of t cos t."""
    return y[1], -y[0], t * math.cos(t)


def truth(t):
    t = np.asarray(t)
    return np.array([np.cos(t), -np.sin(t), t * np.sin(t) + np.cos(t) - 1.0])


@pytest.mark.parametrize("order", ORDERS)
def test_errors_fall_by_the_order_of_the_method(order):
    chosen, at_end, within = ORDERS[order]
    ends, inside = [], []
    for h in (1.0, 0.5):
        step = DormandPrince(swing, 0.0, (1.0, 0.0, 0.0), 10.0, 1.0, (math.inf,) * 3, h, chosen).step()
        ends.append(abs(np.array(step.after) - truth(h)).max())
        inside.append(abs(step(h * np.array([0.3, 0.6])) - truth(h * np.array([0.3, 0.6]))).max())
    assert math.log2(ends[0] / ends[1]) > at_end + 0.7
    assert math.log2(inside[0] / inside[1]) > within + 0.5


@pytest.mark.parametrize("order", ORDERS)
def test_a_motion_is_as_good_as_asked_and_told_alike_in_every_way(order):
    chosen, tolerance = ORDERS[order][0], 1e-8
    runner, steps = DormandPrince(swing, 0.0, (1.0, 0.0, 0.0), 10.0, tolerance, (tolerance,) * 3, method=chosen), []
    while runner.t < 10.0:
        steps.append(runner.step())
    times = np.linspace(0.0, 10.0, 101)
    owners = np.clip(np.searchsorted([step.t + step.h for step in steps], times), 0, len(steps) - 1)
    result = at(steps, owners, times)
    assert abs(result - truth(times)).max() < 100 * tolerance
    one_by_one = np.array([steps[owner](t) for owner, t in zip(owners, times, strict=True)]).T
    assert abs(one_by_one - result).max() < 1e-14
    kept = pickle.loads(pickle.dumps(steps[-1]))
    assert np.array_equal(kept(9.99), steps[-1](9.99))


def test_a_loose_tolerance_is_met_by_the_lower_order():
    assert (method(1e-3).order, method(1e-10).order) == (5, 8)


# Methods, their orders, and restarts at breaks.


def oscillator(t, y):
    return np.array([y[1], -y[0]])


@pytest.mark.parametrize(("name", "order"), [("euler", 1), ("rk2", 2), ("rk4", 4)])
def test_a_step_satisfies_its_order_conditions(name, order):
    """On y' = y a step of order p is the exponential series up to h^p."""
    h = 0.3
    stepped = runge_kutta_step(FIXED[name], lambda t, y: y, 0.0, np.ones(1), h, np.ones(1))[0]
    assert_allclose(stepped, sum(h**k / [1, 1, 2, 6, 24][k] for k in range(order + 1)), rtol=1e-15)


def test_equal_steps_end_exactly_and_are_joined_smoothly():
    steps = list(fixed("rk4", oscillator, 0.0, np.array([1.0, 0.0]), 1.0, 0.3))
    assert [s.start for s in steps] == pytest.approx([0.0, 0.3, 0.6, 0.9])
    assert steps[-1].end == 1.0
    for before, after in pairwise(steps):
        assert_allclose(before.dense(before.end), after.dense(after.start), rtol=1e-15)
    times = np.linspace(0.3, 0.6, 7)
    assert_allclose(steps[1].dense(times)[0], np.cos(times), atol=2e-4)


@pytest.mark.parametrize("method", ADAPTIVE)
def test_every_adaptive_method_keeps_its_tolerance(method):
    steps = list(adaptive(method, oscillator, 0.0, np.array([1.0, 0.0]), 3.0, (1e-8, 1e-8 * np.ones(2))))
    assert steps[0].start == 0.0
    assert steps[-1].end == 3.0
    assert_allclose(steps[-1].dense(3.0), [np.cos(3.0), -np.sin(3.0)], atol=1e-6)


@pytest.mark.parametrize("method", ADAPTIVE)
def test_a_field_that_ends_is_an_error_with_the_time(method):
    def field(t, y):
        return np.array([1.0 if y[0] < 1.0 else np.nan])

    with pytest.raises(GraphError, match=r"the motion cannot be followed past t = (0|1)"):
        list(adaptive(method, field, 0.0, np.zeros(1), 3.0, (1e-6, 1e-6 * np.ones(1))))


def test_equal_steps_into_nowhere_are_an_error():
    with pytest.raises(GraphError, match=r"cannot be followed past t = 0\.9 s"):
        list(fixed("rk4", lambda t, y: np.array([1.0 if y[0] < 0.95 else np.nan]), 0.0, np.zeros(1), 3.0, 0.1))


def test_pieces_are_those_between_breaks():
    breaks = Breaks(0, np.array([1.0, 4.0]), None)
    assert breaks.around(2.0, forwards=True) == (1.0, 4.0)
    assert breaks.around(1.0, forwards=True) == (1.0, 4.0)
    assert breaks.around(1.0, forwards=False) == (-np.inf, 1.0)
    assert breaks.around(5.0, forwards=True) == (4.0, np.inf)
    periodic = Breaks(0, np.array([1.0, 4.0]), 2 * np.pi)
    low, high = periodic.around(-3.0, forwards=True)
    assert_allclose([low, high], [1.0 - 2 * np.pi, 4.0 - 2 * np.pi])
    assert_allclose(periodic.around(4.0 + 20 * np.pi, forwards=True), [4.0 + 20 * np.pi, 1.0 + 22 * np.pi])
    assert_allclose(periodic.around(0.5, forwards=True), [4.0 - 2 * np.pi, 1.0])


def pushed(accelerations, edges, start, until, times=()):
    """A mass with a constant acceleration in each piece between the edges, stepped."""
    edges = np.array(edges, dtype=float)

    def acceleration(q):
        return accelerations[int(np.searchsorted(edges, q, side="right"))]

    def steps(t, y, stop, anchors):
        a = acceleration(anchors[0])
        return adaptive("DOP853", lambda t, y: np.array([y[1], a]), t, y, stop, (1e-10, 1e-10 * np.ones(2)))

    def rate(t, y):
        return np.array([y[1], acceleration(y[0])])

    return list(through_breaks(steps, rate, [Breaks(0, edges, None, "q")], times, np.array(start, dtype=float), until))


PUSHES, EDGES = (2.0, -3.0, 2.0, -1.0), (1.0, 4.0, 4.01)


def by_hand(accelerations, edges, start, until):
    """The same motion, from the roots of its parabolas."""
    (q, v), t = start, 0.0
    place = int(np.searchsorted(edges, q + 1e-9 * (v or accelerations[int(np.searchsorted(edges, q, side="right"))])))
    while True:
        a, span = accelerations[place], until - t
        leaves = []
        for edge, to in [(edges[k], k + 1 - (k < place)) for k in (place - 1, place) if 0 <= k < len(edges)]:
            roots = np.roots([0.5 * a, v, q - edge])
            leaves += [(r.real, to, edge) for r in roots if abs(r.imag) < 1e-12 and 1e-9 < r.real < span]
        when, to, edge = min(leaves, default=(span, place, None))
        q, v, t = q + v * when + 0.5 * a * when**2 if edge is None else edge, v + a * when, t + when
        if edge is None:
            return q, v
        place = to if to != place else (place - 1 if edge == edges[place - 1] else place + 1)


@pytest.mark.parametrize(
    ("start", "until"),
    [
        ((0.0, 3.0), 5.0),
        ((5.0, -3.0), 5.0),
        ((0.2, 0.0), 5.0),
        ((4.0, 0.0), 0.59),
        ((1.0, 0.4), 5.0),
        ((4.0 + 1e-7, -1e-3), 5.0),
        ((6.0, -20.0), 5.0),
    ],
    ids=["forwards", "backwards", "from rest", "from rest on a break", "from a break", "just before a break", "fast"],
)
def test_motions_through_breaks_are_those_of_the_pieces_by_hand(start, until):
    steps = pushed(PUSHES, EDGES, start, until)
    assert_allclose(steps[-1].dense(until), by_hand(PUSHES, EDGES, start, until), rtol=1e-10, atol=1e-10)
    for before, after in pairwise(steps):
        assert before.end == after.start
        assert_allclose(before.dense(before.end), after.dense(after.start), rtol=1e-12, atol=1e-12)


def test_a_motion_that_comes_to_rest_where_either_side_leads_away_keeps_its_energy():
    """From rest at 4 it is back there after 0.6 s, pushed away on both sides: the last digit says which way it goes."""
    work = np.concatenate(([0.0], np.cumsum(np.multiply(PUSHES[1:3], np.diff(EDGES)))))  # up to each edge, from q = 1
    for step in pushed(PUSHES, EDGES, (4.0, 0.0), 5.0):
        q, v = step.after
        place = int(np.searchsorted(EDGES, q))
        level = (work[place - 1] + PUSHES[place] * (q - EDGES[place - 1])) if place else PUSHES[0] * (q - 1.0)
        assert_allclose(0.5 * v * v - level, -work[1], rtol=1e-9)


@settings(max_examples=25, deadline=None)
@given(st.floats(-2.0, 7.0), st.floats(0.1, 8.0), st.booleans())
def test_starts_anywhere(q, speed, forwards):
    start = q, speed if forwards else -speed
    steps = pushed(PUSHES, EDGES, start, 3.0)
    assert_allclose(steps[-1].dense(3.0), by_hand(PUSHES, EDGES, start, 3.0), rtol=1e-8, atol=1e-8)


def test_a_step_does_not_jump_over_a_narrow_window():
    steps = pushed((0.0, -1000.0, 0.0), (1.0, 1.0001), (0.0, 3.0), 5.0)
    assert_allclose(steps[-1].dense(5.0)[1], np.sqrt(9.0 - 2 * 1000 * 0.0001), rtol=1e-12)
    assert any(abs(s.end - 1 / 3) < 1e-15 for s in steps)


def test_a_motion_that_turns_beyond_a_break_is_seen_even_between_the_ends_of_a_step():
    steps = pushed((-1.0, -9.0), (1.0,), (0.0, 1.5), 5.0)
    assert_allclose(steps[-1].dense(5.0), by_hand((-1.0, -9.0), (1.0,), (0.0, 1.5), 5.0), rtol=1e-11)


def test_laws_that_drive_a_motion_back_onto_a_break_from_both_sides_are_an_error():
    with pytest.raises(GraphError, match="sticks at q = 1, t = 0 s"):
        pushed((2.0, -3.0), (1.0,), (1.0, 0.0), 5.0)


@pytest.mark.parametrize("place", [0.1, 1.0 / 3.0, 7.7, -123.4, 1e6])
def test_a_start_at_rest_on_a_break_is_left_at_once_whatever_its_digits(place):
    with pytest.raises(GraphError, match="sticks at q = "):
        pushed((2.0, -3.0), (place,), (place, 0.0), 5.0)


def test_steps_end_at_given_times():
    steps = pushed((1.0, 1.0), (100.0,), (0.0, 1.0), 2.0, times=(0.5, 1.25, 7.0, 0.0))
    ends = [s.end for s in steps]
    assert 0.5 in ends
    assert 1.25 in ends
    assert ends[-1] == 2.0


def test_far_too_many_steps_are_an_error(monkeypatch):
    monkeypatch.setattr("bondgraph.motion.stepping._MOST_STEPS", 10)

    def steps(t, y, stop, anchors):
        return (Step(lambda t: np.zeros(1), 0.01 * k, 0.01 * (k + 1), after=np.zeros(1)) for k in range(1000))

    with pytest.raises(GraphError, match=r"10 steps reach t = 0.11 s only: .*Radau, LSODA"):
        list(through_breaks(steps, lambda t, y: y, [], (), np.zeros(1), 5.0))


# One walk on floats, on arrays and recorded gives the same; states, signals and starts by name.


t, u, theta, f = sympy.symbols("t u theta f")


def coil_and_shaft():
    b = Builder().one("coil", "electric").one("shaft", "rotation", displacement="theta")
    return b.on("coil", Se("V", 3.0), R("Ra", 2.0)).on("shaft", I("J", 0.5), R("b", 0.1))


def modulated_gyrator():
    b = coil_and_shaft().on("coil", I("L", 0.1)).gyrate("coil", "shaft", lambda theta: 1 + 0.5 * np.sin(theta))
    return b.on("shaft", R("brake", lambda f, theta: 0.1 * f * (1 + theta**2)))


def no_inductance():
    return coil_and_shaft().gyrate("coil", "shaft", 0.7)


def two_gyrators():
    b = coil_and_shaft().one("middle").on("middle", R("r", 1.0)).on("coil", I("L", 0.1))
    return b.gyrate("coil", "middle", 2.0).gyrate("middle", "shaft", 4.0)


def algebraic_loop():
    b = Builder().one("a").one("b").one("mass", displacement="x").on("mass", I("m", 2.0)).on("a", Se("F", 3.0), R("ra", 1.0))
    return b.on("b", R("rb", 2.0)).between("a", "b", R("ab", 3.0)).between("b", "mass", R("bm", 0.5), C("k", stiffness=4.0))


def bent_resistor_without_mass():
    b = Builder().one("mass").one("end", displacement="x").on("mass", I("m", 2.0), C("k0", stiffness=3.0))
    return b.between("mass", "end", C("k", stiffness=5.0)).on("end", R("d", lambda f: f * np.abs(f) + f**3))


def springs_in_series():
    b = Builder().one("mass").one("end").on("mass", I("m", 2.0)).between("mass", "end", C("k1", lambda q: q + q**3))
    return b.on("end", C("k2", stiffness=3.0))


def parallel_capacitors():
    b = Builder().zero("node").one("line").bond("line", "node").on("line", Se("E", lambda t: 5 + t), R("Rs", 2.0))
    return b.on("node", C("c1", 0.1), C("c2", 0.3), R("leak", 10.0))


def driven_mechanism():
    b = Builder().one("crank", displacement="theta").one("ram").transform("crank", "ram", sympy.sin(theta) + 2)
    return b.on("ram", I("m", 1.0), R("r", 1.0)).on("crank", Sf("w", lambda t: np.cos(3 * t)))


def modulus_of_time():
    b = Builder().signal("u").one("a").one("b", displacement="x").on("a", I("m", 1.0), Se("F", lambda u: u))
    return b.transform("a", "b", lambda u, t: 2 + np.sin(u) * t).on("b", I("M", 2.0), R("r", sympy.sqrt(1 + u**2) * f))


def by_closure():
    """A four-bar: rod's and rocker's speeds from two loop equations."""
    b = Builder().one("crank", "rotation", displacement="theta").one("rod", "rotation", displacement="phi", initial=0.3)
    b.one("rocker", "rotation", displacement="psi", initial=1.2).zero("x", "translation").zero("y", "translation")
    for name, angle, length in (("crank", "theta", 0.2), ("rod", "phi", 0.6), ("rocker", "psi", -0.5)):
        symbol = sympy.Symbol(angle)
        b.transform(name, "x", -length * sympy.sin(symbol)).transform(name, "y", length * sympy.cos(symbol))
    return b.on("crank", I("J", 0.1), Se("M", 1.0)).on("rod", I("K", 0.2)).on("rocker", I("L", 0.3), R("r", 0.4))


GALLERY = [
    modulated_gyrator, no_inductance, two_gyrators, algebraic_loop, bent_resistor_without_mass, springs_in_series,
    parallel_capacitors, driven_mechanism, modulus_of_time, by_closure,
]  # fmt: skip
SIGNALS = {"u": lambda t: t * t}


@pytest.mark.parametrize("make", GALLERY)
def test_floats_arrays_and_recordings_give_the_same_rates(make):
    graph = make().build()
    dynamics = Dynamics(graph, {name: SIGNALS[name] for name in graph.signals})
    rng = np.random.default_rng(5)
    times, states = rng.uniform(0.1, 1.0, 6), rng.uniform(0.2, 1.0, (len(dynamics.names), 6))
    together = dynamics.at(times, list(states))
    for k, time in enumerate(times.tolist()):
        values = states[:, k].tolist()
        alone = dynamics.at(time, values)
        assert all(isinstance(rate, float) for rate in alone.rates)
        assert_allclose(dynamics.rates(time, *values), alone.rates, rtol=1e-12, atol=1e-12)
        bonds = [b.number for b in graph.bonds]
        for many, one in ((together.flows, alone.flows), (together.efforts, alone.efforts)):
            result = [np.broadcast_to(many[number], times.shape)[k] for number in bonds]
            assert_allclose(result, [one[number] for number in bonds], rtol=1e-12, atol=1e-12)
        assert_allclose([np.broadcast_to(v, times.shape)[k] for v in together.rates], alone.rates, rtol=1e-12, atol=1e-12)


@settings(max_examples=20, deadline=None)
@given(st.integers(2, 6), st.integers(0, 999))
def test_accelerations_of_several_flows_are_those_of_the_mass_matrix(size, seed):
    """Masses m_k on every flow, and one on each sum of two: M = diag(m) + coupling, M u' = F."""
    rng = np.random.default_rng(seed)
    masses, coupled, forces = rng.uniform(0.5, 2.0, size), rng.uniform(0.5, 2.0, size - 1), rng.normal(size=size)
    b, matrix = Builder(), np.diag(masses)
    for k in range(size):
        b.one(f"v{k}").on(f"v{k}", I(f"m{k}", masses[k]), Se(f"F{k}", forces[k]))
    for k in range(size - 1):
        ratio = float(rng.normal())
        b.sum(f"s{k}", [(f"v{k}", 1.0), (f"v{k + 1}", ratio)], "translation").on(f"s{k}", I(f"c{k}", coupled[k]))
        row = np.eye(size)[k] + ratio * np.eye(size)[k + 1]
        matrix = matrix + coupled[k] * np.outer(row, row)
    dynamics = Dynamics(b.build())
    assert dynamics.names == tuple(f"p_m{k}" for k in range(size))
    assert_allclose(dynamics.at(0.0, [0.0] * size).rates, masses * np.linalg.solve(matrix, forces), rtol=1e-10, atol=1e-12)


def test_springs_in_series_share_their_rate_by_stiffness():
    dynamics = Dynamics(springs_in_series().build())
    assert dynamics.names == ("p_m", "q_k1")
    stiffness = 1 + 3 * 0.5**2
    share = stiffness / (stiffness + 3.0)
    assert_allclose(dynamics.at(0.0, [4.0, 0.5]).rates, [-0.5 - 0.5**3, 2.0 * (1 - share)], rtol=1e-14)


def test_a_varying_modulus_takes_its_part_of_the_acceleration():
    """T = 2 + u t with m, M at its ends: (m + T^2 M) a' = F - T T' M a - ..., T' = u' t + u."""
    b = Builder().signal("u").one("a").one("b").on("a", I("m", 1.0)).on("b", I("M", 2.0))
    graph = b.transform("a", "b", lambda u, t: 2 + u * t).build()
    for signal in (lambda t: t * t, t**2):
        ratio, slope = 2 + 0.5**3, 3 * 0.5**2
        rates = Dynamics(graph, {"u": signal}).rates(0.5, 0.7)  # the momentum of m = 1
        assert_allclose(rates, [-ratio * slope * 2.0 * 0.7 / (1.0 + ratio**2 * 2.0)], rtol=1e-14)


def test_a_flow_source_through_a_mechanism_takes_the_force_that_its_law_needs():
    """T = sin(theta) + 2 driven at w(t): the inertia's effort is m (T w' + T' w^2)."""
    dynamics = Dynamics(driven_mechanism().build())
    instant = dynamics.at(0.4, [0.3])
    flow, rate = np.cos(1.2), -3 * np.sin(1.2)
    assert_allclose(
        instant.efforts[dynamics.graph.bond_of("m").number], (np.sin(0.3) + 2) * rate + np.cos(0.3) * flow**2, rtol=1e-14
    )


@pytest.mark.parametrize(
    ("law", "inverse"),
    [
        (lambda f: f * np.abs(f), lambda e: np.sign(e) * np.sqrt(np.abs(e))),
        (lambda f: f**3, np.cbrt),
        (lambda f: np.sign(f) * np.sqrt(np.abs(f)), lambda e: e * np.abs(e)),
        (lambda f: 2.0 * np.arctan(50.0 * f) + 0.1 * f, None),
        (f * sympy.Abs(f), lambda e: np.sign(e) * np.sqrt(np.abs(e))),
    ],
    ids=["square", "cube", "root", "saturating", "SymPy"],
)
@pytest.mark.parametrize("effort", [4.0, -300.0, 1e-6, 0.0])
def test_resistors_that_bend_settle_flows_without_inertia(law, inverse, effort):
    graph = Builder().one("a", displacement="x").on("a", Se("E", effort), R("r", law)).build()
    dynamics = Dynamics(graph)
    flow = dynamics.at(0.0, [0.0]).flows[1]
    if inverse is None:
        assert_allclose(2.0 * np.arctan(50.0 * flow) + 0.1 * flow, effort, rtol=1e-9, atol=1e-15)
    else:
        assert_allclose(flow, inverse(effort), rtol=1e-10, atol=1e-15)
    assert_allclose(dynamics.rates(0.0, 0.0), [flow], rtol=1e-10, atol=1e-20)


def forced_oscillator():
    b = Builder().signal("push").one("mass", "translation", displacement="x").on("mass", I("m", 2.0), R("d", 0.5))
    return b.on("mass", C("spring", stiffness=8.0), Se("F", lambda push: push)).build()


def test_the_state_is_momenta_and_displacements_of_stores_then_declared_ones():
    dynamics = Dynamics(forced_oscillator(), {"push": 3.0})
    assert dynamics.names == ("p_m", "q_spring", "x")
    assert dynamics.at(0.0, [2.0, 0.25, 0.5]).rates == [3.0 - 0.5 - 2.0, 1.0, 1.0]


@pytest.mark.parametrize("push", [2, 2.0, np.float64(2.0), lambda t: 4.0 * t, 4 * sympy.Symbol("t"), sympy.Integer(2)])
def test_signals_are_numbers_functions_or_expressions(push):
    assert_allclose(Dynamics(forced_oscillator(), {"push": push}).rates(0.5, 0.0, 0.0, 0.0), [2.0, 0.0, 0.0], rtol=1e-15)


@pytest.mark.parametrize(
    ("signals", "match"),
    [
        ({}, "signal 'push' has no function of t"),
        ({"push": 1.0, "pull": 1.0}, "no signal 'pull': the graph declares push"),
        ({"push": "sin(t)"}, r"signal 'push': found 'sin\(t\)', expected a number, a function of t"),
        ({"push": lambda t, x: t}, "signal 'push': found a function of t, x, expected one of t"),
    ],
)
def test_wrong_signals_are_named(signals, match):
    with pytest.raises(GraphError, match=match):
        Dynamics(forced_oscillator(), signals)


def test_open_parameters_are_named():
    graph = Builder().parameter(k=None).one("a").on("a", I("m", sympy.Symbol("k")), Se("F", 1.0)).build()
    with pytest.raises(GraphError, match=r"parameter 'k' \(I:m, bond 1\) has no value"):
        Dynamics(graph).at(0.0, [0.0])
    with_value = Dynamics(graph.with_parameters(k=4.0)).at(0.0, [2.0])
    assert (with_value.rates, with_value.flows) == ([1.0], {1: 0.5, 2: 0.5})


def test_evaluating_leaves_the_graph_alone():
    graph = forced_oscillator()
    before = str(graph), dict(graph.elements), graph.bonds
    dynamics = Dynamics(graph, {"push": 3.0})
    first, second = (dynamics.rates(0.1, 1.0, 2.0, 3.0) for _ in range(2))
    assert first == second == tuple(dynamics.at(0.1, [1.0, 2.0, 3.0]).rates)
    assert before == (str(graph), dict(graph.elements), graph.bonds)


def test_a_spring_whose_law_a_motion_gives_is_no_state_and_motions_are_anchored_once_each():
    law = Law(lambda here, anchor: here.q, Motion("a"))
    b = Builder().one("a").one("ram").on("a", I("m", 1.0), C("k", 1.0), C("cam", law), Se("M", law)).on("ram", I("M'", 1.0))
    dynamics = Dynamics(b.transform("a", "ram", Modulus(np.sin, np.cos, Motion("a"))).build())
    assert dynamics.names == ("p_m", "q_k", "a")
    assert dynamics.anchored == ("a",)


SUMMITS = {  # with the place of the greatest value, between 0 and 2
    "smooth": (lambda x, at: np.cos(x - at) + 0.2 * np.sin(2.0 * (x - at)) - 0.4 * (x - at), 1e-5),
    "flat": (lambda x, at: -((x - at) ** 4), 2e-3),
    "kink": (lambda x, at: np.where(x < at, 3.0, -0.2) * (x - at), 1e-6),
    "even kink": (lambda x, at: -np.abs(x - at), 1e-6),
    "kink on a parabola": (lambda x, at: -((x - at) ** 2) - 1e-3 * np.abs(x - at), 1e-6),
    "unknown beyond": (lambda x, at: np.where(np.abs(x - at) <= 0.2, np.cos(x - at), -np.inf), 1e-5),
    "jump": (lambda x, at: np.where(x <= at, x - at, x - at - 3.0), 1e-6),
}


@pytest.mark.parametrize("name", SUMMITS)
def test_summits_of_every_shape_are_where_they_are(name: str) -> None:
    curve, width = SUMMITS[name]
    at = np.append(np.linspace(0.3, 1.7, 41), (0.0, 1.0, 2.0))
    result = summits(lambda x, which: 5.0 + curve(x, at[which, None]), np.zeros(at.size), np.full(at.size, 2.0), 9, 14)
    greatest = 5.0 + curve(at, at)
    assert np.abs(result.value - greatest).max() < 1e-6 * (0.0 if name in ("smooth", "unknown beyond") else 1.0) + 1e-11
    assert np.abs(result.place - at).max() < width
    assert ((result.low <= result.place) & (result.place <= result.high)).all()
    if name in ("kink", "jump"):
        assert (result.high - result.low).max() < 1e-5


def test_a_smooth_summit_costs_few_values_and_one_of_a_few_summits_ends_alone() -> None:
    count = []

    def value(x: np.ndarray, which: np.ndarray) -> np.ndarray:
        count.append(which.tolist())
        return np.where(which[:, None] == 0, np.cos(x - 1.0), -np.abs(x - 0.7))

    result = summits(value, np.zeros(2), np.full(2, 1.9), 13, 9)
    assert result.place.round(7).tolist() == [1.0, 0.7]
    assert [0, 1] in count
    assert count[-1] == [1]
    assert sum(0 in each for each in count) <= 6
