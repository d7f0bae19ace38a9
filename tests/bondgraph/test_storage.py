"""Graphs as files: what is written is what is read, and what is refused."""

import json
import math
import random
import subprocess
import sys

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from bondgraph import (
    BondGraph,
    Builder,
    C,
    Function,
    GraphError,
    I,
    Law,
    Modulus,
    Motion,
    R,
    Se,
    as_data,
    from_data,
    function,
    load,
    save,
)
from bondgraph.storage import MAX_DEPTH, OPERATIONS, as_tree, from_tree, names_in, number_faults, tree_faults

theta, x, y = sympy.Symbol("theta"), sympy.Symbol("x"), sympy.Symbol("y")


def press() -> BondGraph:
    b = Builder().one("crank", "rotation", displacement="theta", initial=0.1).one("ram", "translation")
    b.parameter(k=0.1 + 0.2, open=None).signal("F")
    b.on(
        "crank",
        I("J", 2.0, part="rotor"),
        Se("M", lambda t, F: 3.0 * np.cos(0.1 * t) + F),
        R("drag", lambda f: 0.3 * f * abs(f)),
    )
    b.on("ram", I("m", 1 / 3), C("spring", lambda q, k: k * q**3), Se("weight", lambda theta: -9.81))
    return b.transform("crank", "ram", sympy.sin(theta) * sympy.Rational(1, 3) * sympy.pi, name="T").build()


def data() -> dict:
    return json.loads(json.dumps(as_data(press())))


def spoilt(change) -> dict:
    result = data()
    change(result)
    return result


def with_tree(tree) -> dict:
    result = data()
    result["elements"][3]["law"] = {"of": ["theta", "t"], "expression": tree}
    return result


def faults(content) -> list[str]:
    with pytest.raises(GraphError) as caught:
        from_data(content)
    return str(caught.value).splitlines()


def laws(graph):
    return {e.name: e.law for e in graph.elements.values() if isinstance(e.law, Function)}


# Round trips


def test_a_saved_graph_comes_back_the_same(tmp_path):
    graph = press()
    save(graph, tmp_path / "press.json")
    result = load(tmp_path / "press.json")
    assert str(result) == str(graph)
    assert (result.bonds, result.displacements, result.signals) == (graph.bonds, graph.displacements, graph.signals)
    assert result.parameters == graph.parameters
    assert [(e.kind, e.name, e.domain, e.part) for e in result.elements.values()] == [
        (e.kind, e.name, e.domain, e.part) for e in graph.elements.values()
    ]
    assert result.elements["m"].law == 1 / 3


def test_loaded_laws_give_the_same_values_and_slopes():
    graph = press()
    result = laws(from_data(as_data(graph)))
    draw = random.Random(1)
    for name, law in laws(graph).items():
        assert result[name].of == law.of
        for _ in range(20):
            at = [draw.uniform(-2, 2) for _ in law.of]
            assert result[name](*at) == pytest.approx(law(*at), rel=1e-15)
            assert result[name].partials(*at)[1] == pytest.approx(law.partials(*at)[1], rel=1e-14)


def test_data_are_a_fixed_point():
    assert as_data(from_data(data())) == data()


def test_a_law_keeps_the_names_that_its_formula_lost():
    graph = press()
    assert from_data(as_data(graph)).symbol("weight") == "MSe"
    assert from_data(as_data(graph)).elements["weight"].law.of == ("theta",)


def test_parts_keep_their_names():
    shaft = Builder().one("shaft", displacement="a").on("shaft", I("J", 2.0), Se("M", lambda a: np.sin(a))).part("shaft")
    b = Builder().include("left", shaft).include("right", shaft).bond("left.shaft", "right.shaft")
    result = from_data(as_data(b.build()))
    assert result.elements["right.M"].law.of == ("right.a",)
    assert result.elements["right.M"].law(0.5) == math.sin(0.5)


@pytest.mark.parametrize("number", [0.1 + 0.2, 5e-324, 1.7976931348623157e308, -1 / 3, 2.0])
def test_floats_keep_every_bit(number):
    graph = Builder().one("a").on("a", I("J", number), Se("M", x * sympy.Float(number))).parameter(x=number).build()
    result = from_data(json.loads(json.dumps(as_data(graph))))
    assert (result.elements["J"].law, result.parameters["x"]) == (number, number)
    assert result.elements["M"].law(1.0) == number


def test_a_graph_without_expressions_loads_without_sympy(tmp_path):
    save(Builder().one("a").on("a", I("J", 2.0), Se("M", 1.0)).build(), tmp_path / "plain.json")
    code = "import sys; from bondgraph.storage import load; load(sys.argv[1]); assert 'sympy' not in sys.modules"
    subprocess.run([sys.executable, "-c", code, str(tmp_path / "plain.json")], check=True)


# Files


def test_an_existing_file_is_kept_unless_told(tmp_path):
    path = tmp_path / "a.json"
    path.write_text("mine")
    with pytest.raises(GraphError, match="exists already; choose another name"):
        save(press(), path)
    assert path.read_text() == "mine"
    save(press(), path, overwrite=True)
    assert str(load(path)) == str(press())
    assert [p.name for p in tmp_path.iterdir()] == ["a.json"]


def test_a_save_that_fails_leaves_the_old_file_alone(tmp_path, monkeypatch):
    path = tmp_path / "a.json"
    save(press(), path)
    before = path.read_bytes()

    def full(*paths):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", full)
    with pytest.raises(GraphError, match=r"cannot be written \(No space left"):
        save(press().with_parameters(k=9.0), path, overwrite=True)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["a.json"]


def test_a_folder_that_is_missing_is_named(tmp_path):
    with pytest.raises(GraphError, match=r"nowhere.*cannot be written \(No such file"):
        save(press(), tmp_path / "nowhere" / "a.json")
    with pytest.raises(GraphError, match=r"cannot be read \(No such file"):
        load(tmp_path / "a.json")


@pytest.mark.parametrize(
    "text", ["", "{", "[" * 100_000, '{"version": ' + "9" * 10_000 + "}", "\udcff".encode("utf-8", "surrogatepass")]
)
def test_what_is_no_json_is_refused(tmp_path, text):
    path = tmp_path / "a.json"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(GraphError, match="is not the JSON of a graph"):
        load(path)


def test_keys_given_twice_and_other_faults_come_at_once(tmp_path):
    path = tmp_path / "a.json"
    path.write_text(
        '{"format": "bondgraph", "version": 1, "version": 1, "elements": [], "bonds": 3, "parameters": {"k": NaN}}'
    )
    with pytest.raises(GraphError) as caught:
        load(path)
    assert str(caught.value).splitlines() == [
        f"{path}: found key 'version' twice in one object",
        f"{path}: bonds: found 3, expected a list of at most 10000",
        f"{path}: parameters.'k': found nan, expected a finite number",
    ]


# What cannot be saved


def test_laws_that_are_no_formula_are_named_all_at_once():
    b = Builder().one("a", displacement="x")
    b.on(
        "a", I("J", 1.0), Se("branch", lambda x: 1.0 if x > 0 else 2.0), Se("table", lambda x: np.interp(x, [0, 1], [2, 3]))
    )
    b.on("a", Se("motion", Law(lambda here, anchor: here.q, Motion("a"))), Se("other", sympy.floor(x)))
    b.on("a", Se("list", lambda x: [x, x]), Se("text", lambda x: "1 + 1"))
    with pytest.raises(GraphError) as caught:
        as_data(b.build())
    lines = str(caught.value).splitlines()
    assert len(lines) == 6
    assert "MSe:branch: cannot be written as a formula" in lines[0]
    assert "give it as a SymPy expression" in lines[1]
    assert "MSe:motion: is taken from a mechanism's motion" in lines[2]
    assert "MSe:other: cannot be saved: found floor" in lines[3]
    assert "MSe:list: cannot be written as a formula" in lines[4]
    assert "MSe:text: cannot be written as a formula" in lines[5]


def test_a_modulus_of_a_motion_is_refused():
    b = Builder().one("a").one("b").on("b", I("J", 1.0)).on("a", Se("M", 1.0))
    b.transform("a", "b", Modulus(lambda p: p, lambda p: 1.0, Motion("a")), name="T")
    with pytest.raises(GraphError, match="MTF:T: is taken from a mechanism's motion"):
        as_data(b.build())


@pytest.mark.parametrize("law", [sympy.Add(*(x**k for k in range(2, 3500))), sympy.oo * x, sympy.zoo + x])
def test_formulas_beyond_the_limits_are_refused(law):
    graph = Builder().one("a", displacement="x").on("a", I("J", 1.0), Se("M", law)).build()
    with pytest.raises(GraphError, match="MSe:M: cannot be saved: found"):
        as_data(graph)


# What cannot be loaded


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (lambda d: d.pop("bonds"), "found no 'bonds', expected one"),
        (lambda d: d.update(format="other"), "format: found 'other', expected 'bondgraph'"),
        (lambda d: d.update(version=2), "version: found 2, expected 1"),
        (lambda d: d.update(version=True), "version: found True, expected 1"),
        (lambda d: d.update(extra=1), "found unknown key 'extra', expected format, version, elements, bonds"),
        (lambda d: d["elements"].append(7), "elements[9]: found 7, expected an object with kind, name"),
        (lambda d: d["elements"][2].update(laws=1), "elements[2]: found unknown key 'laws', expected kind, name"),
        (lambda d: d["elements"][2].update(kind=1), "elements[2].kind: found 1, expected a name"),
        (lambda d: d["elements"][2].update(name=""), "elements[2].name: found '', expected a name"),
        (lambda d: d["elements"][2].update(part=1), "elements[2].part: found 1, expected text"),
        (lambda d: d["elements"][2].update(law="foo"), "elements[2].law: found 'foo', expected a finite number or an expr"),
        (lambda d: d["elements"][2].update(law=None), "elements[2].law: found None, expected a finite number or an expr"),
        (lambda d: d["elements"][2].update(law=True), "elements[2].law: found True, expected a finite number"),
        (lambda d: d["elements"][2].update(law=math.inf), "elements[2].law: found inf, expected a finite number"),
        (lambda d: d["elements"][2].update(law=10**5000), "elements[2].law: found a huge number, expected a finite number"),
        (lambda d: d["elements"][2].update(law={}), "elements[2].law: found no 'expression', expected one"),
        (lambda d: d["elements"][2].update(law=["sin", 1]), "elements[2].law: found a list of 2, expected a finite number"),
        (lambda d: d["elements"].append(d["elements"][0]), "elements: found two named 'crank', expected every name once"),
        (lambda d: d["bonds"].append([1, "a"]), "bonds[8]: found a list of 2, expected [number, tail, head]"),
        (lambda d: d["bonds"][0].__setitem__(0, 1.5), "bonds[0][0]: found 1.5, expected a whole number from 1"),
        (lambda d: d["bonds"][0].__setitem__(1, None), "bonds[0][1]: found None, expected a name"),
        (lambda d: d["displacements"][0].update(initial="0"), "displacements[0].initial: found '0', expected a finite"),
        (lambda d: d["displacements"].append(d["displacements"][0]), "displacements: found two named 'theta'"),
        (lambda d: d["signals"].append({}), "signals[1]: found an object of 0, expected a name"),
        (lambda d: d.update(parameters=[1]), "parameters: found a list of 1, expected an object of at most 10000"),
        (lambda d: d.update(elements=[0] * 10_001), "elements: found a list of 10001, expected a list of at most 10000"),
    ],
)
def test_faults_are_named_with_their_place(change, line):
    assert any(result.startswith(line) for result in faults(spoilt(change)))


def test_all_faults_come_at_once():
    def change(result):
        result["format"] = 1
        result["elements"][2]["law"] = "foo"
        result["bonds"][3] = None

    assert [line.split(":")[0] for line in faults(spoilt(change))] == ["format", "elements[2].law", "bonds[3]"]


def test_a_graph_that_is_no_graph_is_refused_as_a_built_one_is():
    assert faults(spoilt(lambda d: d["bonds"].pop())) == [
        "MTF:T has 1 bonds in and 0 out, expected 1 and 1",
        "not connected to the rest: ram, m, spring, weight",
    ]


def test_names_that_a_law_does_not_list_are_faults():
    content = with_tree(["add", ["name", "F"], ["sin", ["name", "theta"]]])
    content["elements"][3]["law"]["of"] += ["t"]
    assert faults(content) == [
        "elements[3].law.of: found no 'F', which the expression depends on",
        "elements[3].law.of: found 't' twice, expected it once",
    ]


def test_costly_formulas_load_at_once_because_nothing_is_simplified():
    tree: list = ["name", "t"]
    for _ in range(MAX_DEPTH - 1):
        tree = ["sinh", tree]
    assert from_data(with_tree(tree)).elements["M"].law.of == ("theta", "t")


def test_a_name_is_never_run_as_code(tmp_path):
    name = f"__import__('pathlib').Path('{tmp_path}/ran').touch()"
    content = with_tree(["mul", 2, ["name", name]])
    content["elements"][3]["law"]["of"] = [name]
    content["signals"].append(name)
    law = from_data(content).elements["M"].law
    assert law.partials(1.5) == (3.0, (2.0,))
    assert law(np.array([1.5])) == [3.0]
    assert not list(tmp_path.iterdir())


x, y = sympy.Symbol("x"), sympy.Symbol("y")


NAMED = st.sampled_from([x, y])
NUMBERS = st.one_of(
    st.integers(-9, 9).map(sympy.Integer),
    st.fractions(-3, 3, max_denominator=50).map(lambda f: sympy.Rational(f.numerator, f.denominator)),
    st.floats(-3, 3, allow_subnormal=False).map(sympy.Float),
    st.sampled_from([sympy.pi, sympy.E]),
)


def grown(inner):
    one = st.sampled_from([sympy.sin, sympy.cos, sympy.atan, sympy.tanh, sympy.exp, sympy.Abs, sympy.sign, lambda e: e**2])
    two = st.sampled_from([lambda a, b: a + b, lambda a, b: a - b, lambda a, b: a * b, sympy.Max, sympy.Min, sympy.atan2])
    choice = st.tuples(inner, NAMED, inner).map(lambda t: sympy.Piecewise((t[0], t[1] < 1), (t[2], True)))
    return st.one_of(
        st.tuples(one, inner).map(lambda t: t[0](t[1])), st.tuples(two, inner, inner).map(lambda t: t[0](t[1], t[2])), choice
    )


@settings(max_examples=25, deadline=None)
@given(st.recursive(st.one_of(NAMED, NUMBERS), grown, max_leaves=8))
def test_any_expression_comes_back_from_its_tree(expression):
    if expression.has(sympy.nan, sympy.zoo, sympy.I):
        return
    numbers = expression.atoms(sympy.Float)
    if any(number and not float(number) for number in numbers):  # SymPy multiplies past what a double holds
        with pytest.raises(GraphError, match="that a double holds"):
            as_tree(expression)
        return
    tree = as_tree(expression)
    assert not list(tree_faults(tree, "tree"))
    assert from_tree(json.loads(json.dumps(tree))) == expression


@pytest.mark.parametrize("name", [n for n, o in OPERATIONS.items() if o.gives == "value" and o.least])
def test_every_operation_comes_back_and_has_values_and_slopes(name):
    operation = OPERATIONS[name]
    made = getattr(sympy, operation.sympy)(*(x / 2, y)[: operation.least])
    law = function(from_tree(as_tree(made)))
    at = [1.5 if name == "acosh" else 0.4, 0.7][: len(law.of)]
    at = [3.0] if name == "acosh" else at
    assert from_tree(as_tree(made)) == made
    value, slopes = law.partials(*at)
    assert math.isfinite(value)
    assert all(math.isfinite(slope) for slope in slopes)
    assert np.allclose(law(*(np.array([v, v]) for v in at)), value)


@pytest.mark.parametrize(
    "test", [x < 1, x <= y, sympy.Eq(x, 1), sympy.Ne(x, y), ~(sympy.Eq(x, 0)), (x > 0) & (x < 1), (x >= 2) | (y > 1)]
)
def test_conditions_come_back(test):
    made = sympy.Piecewise((x, test), (y, True))
    assert from_tree(as_tree(made)) == made


def test_deep_and_shared_formulas_are_refused_in_no_time():
    deep = shared = x
    for _ in range(MAX_DEPTH + 20):
        deep = sympy.sin(deep)
    for _ in range(40):
        shared = sympy.Add(sympy.sin(shared), sympy.cos(shared), evaluate=False)
    for made in (deep, shared):
        with pytest.raises(GraphError, match="or 100 levels"):
            as_tree(made)


SIN = ["sin", ["name", "theta"]]


@pytest.mark.parametrize(
    ("tree", "line"),
    [
        ([], ": found nothing, expected an operation: name, ratio"),
        (["eval", "1"], ": found 'eval', expected an operation"),
        (["mul", SIN, ["__import__", "os"]], "[2]: found '__import__', expected an operation"),
        ([["sin"], 1], ": found a list of 1, expected an operation"),
        ("theta", ": found 'theta', expected a finite number or [operation, argument, ...]"),
        (["sin", "theta"], "[1]: found 'theta', expected a finite number or [operation, argument, ...]"),
        (["sin"], ": found sin of 0 arguments, expected 1"),
        (["add", 1], ": found add of 1 arguments, expected 2 to 10000"),
        (["sin", math.nan], "[1]: found nan, expected a finite number"),
        (["mul", SIN, 10**400], "[2]: found a huge number, expected a finite number"),
        (["name", 3], ": found a list of 2, expected [name, text]"),
        (["name", ["name", "t"]], ": found a list of 2, expected [name, text]"),
        (["ratio", 1, 0], ": found a list of 3, expected [ratio, whole number, whole number above 0]"),
        (["ratio", 1.5, 2], ": found a list of 3, expected [ratio"),
        (["ratio", True, 2], ": found a list of 3, expected [ratio"),
        (["less", 1, 2], ": found less, which is a condition, expected a value"),
        (["piecewise", 1, SIN], "[2]: found sin, which is a value, expected a condition"),
        (["piecewise", 1, 2], "[2]: found 2, expected a condition"),
        (["piecewise", 1, ["name", "t"]], "[2]: found a list of 2, expected a condition"),
        (["piecewise", 1, ["true"], 2], ": found piecewise of 3 arguments, expected pairs of value and condition"),
        (["piecewise"], ": found piecewise of 0 arguments, expected pairs"),
        (
            ["piecewise", 1, ["less", ["add", 1, ["piecewise", 1, ["true"]]], 2]],
            "[2][1][2]: found piecewise, expected a value w",
        ),
        (["power", 7, 10**9], ": found a power of exact numbers with more than 100000 bits"),
        (["power", ["power", ["power", 7, 999], 999], 999], ": found a power of exact numbers"),
        (["power", 7, ["power", 10, 9]], ": found a power of exact numbers"),
        (["power", ["mul", 2, ["name", "t"]], -(10**9)], ": found a power of exact numbers"),
        (["power", 2, ["add", ["name", "t"], 10**9]], ": found a power of exact numbers"),
        (["power", ["ratio", 3, 2], ["ratio", 10**9, 7]], ": found a power of exact numbers"),
        (["mul", *([SIN] * 6000)], ": found more than 10000 operations or 100 levels"),
    ],
)
def test_faults_of_trees_are_named_with_their_place(tree, line):
    assert next(tree_faults(tree, "law")).startswith(f"law{line}")


def test_every_fault_of_a_tree_comes_at_once():
    lines = tree_faults(["mul", ["foo"], ["bar"], ["sin"]], "law")
    assert [line.split(":")[0] for line in lines] == ["law[1]", "law[2]", "law[3]"]


@pytest.mark.slow
def test_endless_and_deep_trees_are_refused():
    deep: list = ["sin", 1]
    for _ in range(100_000):
        deep = ["sin", deep]
    endless: list = ["add", 1]
    endless += [endless, endless]
    for tree in (deep, endless):
        assert list(tree_faults(tree, "law")) == [
            "law: found more than 10000 operations or 100 levels, expected a smaller tree"
        ]


def test_names_like_functions_are_names():
    law = function(from_tree(["sin", ["name", "sin"]]))
    assert law(0.5) == math.sin(0.5)


def test_the_names_in_a_tree_are_those_of_its_leaves():
    assert names_in(["add", 1, ["name", "t"], ["sin", ["mul", ["name", "x"], ["name", "t"]]]]) == {"t", "x"}
    assert names_in(2.0) == names_in(["pi"]) == set()


def test_exact_numbers_reach_as_far_as_floats():
    """1023 bits are the most that every float of the range has; one more is refused, with its place."""
    assert list(number_faults(2**1023 - 1, "value")) == []
    assert list(number_faults(2**1023, "value")) == ["value: found a huge number, expected a finite number"]
