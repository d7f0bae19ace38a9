import numpy as np
import pytest
import sympy

from bondgraph import Builder, GraphError, I, R, Se
from bondgraph.equations.twin import Names, clean, exact, numeric_function, twin

x = sympy.Symbol("x")


def press(law=lambda theta, u, k: k * u * np.sin(theta)):
    b = Builder().one("crank", displacement="theta").signal("u").parameter(k=2.0, open=None)
    return b.on("crank", I("J", 3.0), Se("M", law), R("rub", lambda f, open: open * f)).build()


def test_the_twin_has_the_graphs_structure_with_a_symbol_for_every_number():
    graph = press()
    found = twin(graph)
    assert found.graph.bonds == graph.bonds
    assert {str(s): v for s, v in found.values.items()} == {"J": 3.0, "k": 2.0}
    assert {name: str(s) for name, s in found.own.items()} == {"J": "J"}
    assert {name: str(s) for name, s in found.places.items()} == {"t": "t", "theta": "theta", "u": "u"}
    assert {name: str(s) for name, s in found.rates.items()} == {"u": "udot"}
    assert str(found.finish(found.graph.constant("J"))) == "J"


def test_a_law_that_is_no_formula_is_named_with_its_bond():
    with pytest.raises(GraphError, match=r"MSe:M \(bond 2\): cannot be written as a formula"):
        twin(press(lambda theta: 1.0 if theta > 0 else 0.0))


def test_names_are_handed_out_once_as_identifiers():
    names = Names()
    taken = [str(names.take(*pair)) for pair in (("a->b", "TF"), ("a b", "I"), ("a.b", "I"), ("2", "C"), ("*", "R"))]
    assert taken == ["a_b", "I_a_b", "I_a_b_", "x2", "x"]
    assert clean("rod.m") == "rod_m"


def test_whole_numbers_and_halves_become_exact_and_no_others():
    assert exact(2.0 * x**1.5 - 0.5) == 2 * x ** sympy.Rational(3, 2) - sympy.Rational(1, 2)
    assert exact(0.3 * x) == 0.3 * x


def test_a_function_known_by_its_values_has_another_as_its_derivative():
    slope = numeric_function("T_slope", lambda q: 2.0 * q)
    called = numeric_function("T", lambda q: q**2, slope)
    assert str(called(x).diff(x)) == "T_slope(x)"
    assert sympy.lambdify(x, [called(x), called(x).diff(x)], modules="numpy")(3.0) == [9.0, 6.0]


def test_ratios_may_stay_numbers():
    found = twin(
        Builder().one("a").one("b").transform("a", "b", 2.0, name="n").on("b", I("J", 1.0)).build(loose=True), ratios=False
    )
    assert found.graph.elements["n"].law == 2.0
    assert list(map(str, found.values)) == ["J"]
