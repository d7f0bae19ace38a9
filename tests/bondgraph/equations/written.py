"""What the tests of symbolic equations share: a slider-crank, and whether formulas agree with numbers."""

import numpy as np
import sympy

from bondgraph import Builder, I, R, Se
from bondgraph.equations.equations import state_equations
from bondgraph.motion.dynamics import Dynamics

theta = sympy.Symbol("theta")
LAMBDA = sympy.Rational(1, 2)
T = LAMBDA * sympy.sin(2 * theta) / (2 * sympy.sqrt(1 - LAMBDA**2 * sympy.sin(theta) ** 2)) + sympy.sin(theta)


def slider_crank(ratio=T, *more):
    """A crank with M and J, a slider with m, B and F; `more` hangs on the slider."""
    b = Builder().one("crank", "rotation", displacement="theta").one("slider", "translation")
    b.on("crank", Se("M", 3.0), I("J", 2.0)).on("slider", I("m", 1.5), R("B", 0.7), Se("F", -4.0), *more)
    return b.transform("crank", "slider", ratio, name="T")


def equal(a, b):
    return sympy.simplify(a - b) == 0


def agrees(graph, signals=None):
    """Symbolic rates against `Dynamics.rates`, at several states and times, relative to the largest rate."""
    found, dynamics = state_equations(graph), Dynamics(graph, signals)
    numeric = found.numeric(signals)
    rng = np.random.default_rng(1)
    for now in (0.0, 0.7, 1.9):
        flows = rng.uniform(0.2, 1.0, len(found.states))
        scale = np.ones(len(flows))
        for place, state in enumerate(found.states):
            keeper = str(state).removeprefix("p_")
            if str(state).startswith("p_") and keeper in graph.elements:
                scale[place] = graph.bond_of(keeper).sign(keeper) * graph.constant(keeper)
        expected = np.array(dynamics.at(now, list(flows)).rates, float)
        got = np.array(numeric(now, list(flows * scale))) / scale
        assert np.max(np.abs(got - expected)) <= 1e-12 * max(1.0, np.max(np.abs(expected)))
    return found
