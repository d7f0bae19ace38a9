import numpy as np
import pytest
import sympy

from bondgraph import GraphError
from bondgraph.equations.equations import generic, generic_equation, state_equations
from bondgraph.motion.dynamics import Dynamics
from tests.bondgraph.equations.written import equal

NAMES = "Se1 I1 B1 C1 Se2 I2 B2 C2"
Se1, I1, B1, C1, Se2, I2, B2, C2 = sympy.symbols(NAMES)
theta, w, q1, q2 = sympy.symbols("theta thetadot q_C1 q_C2")
T = sympy.sin(theta) * (1 + theta)


def test_all_values_open():
    graph = generic(T)
    assert set(graph.parameters) == set(NAMES.split())
    found = generic_equation(T)
    assert equal(found.inertia, I1 + T**2 * I2)
    assert equal(found.slope, 2 * I2 * T * T.diff(theta))
    assert equal(found.moment, Se1 + T * Se2 - (B1 + T**2 * B2) * w - q1 / C1 - T * q2 / C2)
    assert found.others == ((q1, w), (q2, w * T))


@pytest.mark.slow
def test_it_is_the_other_sides_equation_where_the_ratio_does_not_vanish():
    found = generic_equation(T, opaque=True)
    acceleration, ratio = found.acceleration, sympy.Function("T")(theta)
    f_B, rate_B = ratio * w, ratio * acceleration + ratio.diff(theta) * w**2
    passed = (Se1 - I1 * acceleration - B1 * w - q1 / C1) / ratio
    assert equal(rate_B, (Se2 - B2 * f_B - q2 / C2 + passed) / I2)
    printed = (Se2 - B2 * f_B - q2 / C2 - passed) / I2
    assert not equal(rate_B, printed)  # the published sign: its transformer takes power from both sides


def test_power_is_conserved():
    values = dict(zip(NAMES.split(), (3.0, 2.0, 0.3, 0.5, -4.0, 1.5, 0.7, 0.2), strict=True))
    found = generic_equation(T, **values)
    at = {theta: 0.8, w: 1.3, q1: 0.1, q2: -0.2} | found.values
    at |= dict(zip((Se1, I1, B1, C1, Se2, I2, B2, C2), values.values(), strict=True))
    f_A, a_A, ratio = 1.3, float(found.acceleration.subs(at)), float(T.subs(at))
    f_B, a_B = ratio * f_A, ratio * a_A + float(T.diff(theta).subs(at)) * f_A**2
    into = 3.0 * f_A - 4.0 * f_B
    out = (2.0 * a_A + 0.3 * f_A + 0.1 / 0.5) * f_A + (1.5 * a_B + 0.7 * f_B - 0.2 / 0.2) * f_B
    assert into == pytest.approx(out, rel=1e-12)


@pytest.mark.parametrize("ratio", [0.5, lambda theta: np.sin(theta), sympy.sin(theta)])
def test_any_kind_of_ratio_runs_in_numbers(ratio):
    values = dict.fromkeys(NAMES.split(), 1.0)
    dynamics = Dynamics(generic(ratio, **values))
    assert all(np.isfinite(dynamics.at(0.0, [1.0, 0.0, 0.1, 0.2]).rates))  # at a dead centre: T = 0
    assert len(state_equations(generic(ratio, **values)).derivatives) == 4


def test_quantities_of_the_ratio_are_parameters():
    r = sympy.Symbol("r")
    graph = generic(r * sympy.sin(theta), displacement="theta", r=0.1)
    assert graph.parameters["r"] == 0.1
    assert generic(r * sympy.sin(theta), r=0.1).displacements.keys() == {"theta"}
    with pytest.raises(GraphError, match="depends on r, theta: say which is the displacement"):
        generic(r * sympy.sin(theta))


def test_laws_of_elements_may_be_functions():
    found = generic_equation(T, without=("C1", "C2"), Se1=lambda t, M0: M0 * np.sin(t), B1=lambda f: f * abs(f))
    assert equal(found.moment.subs({B2: 0, Se2: 0}), sympy.Symbol("M0") * sympy.sin(sympy.Symbol("t")) - w * sympy.Abs(w))


@pytest.mark.parametrize("wrong", [{"I3": 1.0}, {"without": ("C3",)}])
def test_unknown_names_are_refused(wrong):
    with pytest.raises(GraphError, match=r"no element or quantity '.3': expected Se1"):
        generic(2.0, **wrong)
