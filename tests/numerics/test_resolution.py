"""Cells that cannot overlook a feature, shown by integrals that a blind rule gets wrong."""

import mpmath
import numpy as np
import pytest

from flywheel.numerics.expressions import parse
from flywheel.numerics.intervals import Interval
from flywheel.numerics.jets import Jet
from flywheel.numerics.switching import SwitchingError, breakpoints, resolved
from tests.limits import sample

TURN = 2 * np.pi
NODES, WEIGHTS = np.polynomial.legendre.leggauss(17)


def env(lo, hi, anchor=None):
    return {"phi": Jet(Interval(lo, hi), 1.0), "n": 9.5}


def env_value(phi, anchor=None):
    return {"phi": phi, "n": 9.5}


def cells_of(text, a=0.0, b=TURN):
    expression = parse(text, frozenset({"n"}))
    edges = np.array([a, *breakpoints(expression, a, b, env, env_value), b])
    return expression, np.union1d(edges, resolved(expression, edges[:-1], edges[1:], env, env_value))


def integral(text, a=0.0, b=TURN, most=10_000):
    expression, edges = cells_of(text, a, b)
    assert edges.size < most
    middle, half = 0.5 * (edges[1:] + edges[:-1])[:, None], 0.5 * np.diff(edges)[:, None]
    values = expression.evaluate(env_value(middle + half * NODES), np, env_value(middle))
    return float(((np.broadcast_to(values, (half.size, 17)) @ WEIGHTS) * half[:, 0]).sum())


@pytest.mark.parametrize(("place", "width"), sample([(0.7123, 1e-5), (2.0, 1e-1), (5.5, 1e-2), (2.0, 1e-3)], 4))
def test_no_peak_is_missed(place, width):
    found = integral(f"sin(phi) + 100*exp(-((phi - {place})/{width})**2)", most=120)
    assert found == pytest.approx(100 * width * np.sqrt(np.pi), rel=1e-6, abs=1e-14)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1/(1 + ((phi - 2)/1e-4)**2)", 1e-4 * (np.arctan((TURN - 2) * 1e4) + np.arctan(2e4))),
        ("(1 + ((phi - 2)/1e-4)**2)**-1", 1e-4 * (np.arctan((TURN - 2) * 1e4) + np.arctan(2e4))),
        ("atan((phi - 3)/1e-5)", np.pi / 2 * (TURN - 6) - 1e-5 * np.log((TURN - 3) / 3)),
        ("sin(100*phi)**2", np.pi),
        ("cos(phi)**40", TURN * float(mpmath.binomial(40, 20)) / 2**40),
        ("exp(40*cos(phi))", TURN * float(mpmath.besseli(0, 40))),
        ("2**(40*cos(phi))", TURN * float(mpmath.besseli(0, 40 * mpmath.log(2)))),
        ("sqrt(1 - sin(phi))", 4 * np.sqrt(2)),
        ("abs(sin(phi))**0.3", 2 * float(mpmath.beta(0.65, 0.5))),
        ("abs(sin(phi))**n", 2 * float(mpmath.beta(5.25, 0.5))),
        ("log(2.0001 - 2*cos(phi))", TURN * np.log((2.0001 + np.sqrt(2.0001**2 - 4)) / 2)),
        ("asin(sin(phi)) + 1", TURN),
        ("acos(0.9999*cos(phi))", np.pi**2),
        ("atan2(1e-4*sin(phi), cos(phi) - 0.3) + 1", TURN),
        ("tan((phi - pi)/2.05)**2", 2 * 2.05 * (np.tan(np.pi / 2.05) - np.pi / 2.05)),
        ("(phi + 1e-3)**0.5", 2 / 3 * ((TURN + 1e-3) ** 1.5 - 1e-3**1.5)),
        ("(phi + 0.1)**(-n)", (0.1**-8.5 - (TURN + 0.1) ** -8.5) / 8.5),
        ("(1 + phi)**(1 + 0*phi)", TURN + TURN**2 / 2),
        ("1/(phi - 2) if phi > 3 else phi", np.log(TURN - 2) + 4.5),
        ("min(phi, exp(99*(phi - 6)))*(phi < 5.95)", np.exp(-4.95) / 99),
    ],
)
def test_integrals_on_resolved_cells(text, expected):
    assert integral(text) == pytest.approx(expected, rel=1e-9, abs=1e-12)


STEPS = [
    "1/(1 + exp(-{k}*(phi - 3)))",
    "1 - 1/(1 + exp({k}*(phi - 3)))",
    "exp({k}*(phi - 3))/(1 + exp({k}*(phi - 3)))",
    "0.5 + 0.5*(exp({k}/2*(phi - 3)) - exp(-{k}/2*(phi - 3)))/(exp({k}/2*(phi - 3)) + exp(-{k}/2*(phi - 3)))",
    "1/(1 + 2**({k}/log(2)*(3 - phi)))",
]


@pytest.mark.parametrize(
    ("text", "steepness"),
    sample([(text, k) for text in STEPS for k in ("10", "1e4", "1e8") if text is not STEPS[3] or k != "1e8"], 4),
)
def test_smooth_steps_of_any_steepness_are_followed(text, steepness):
    k = float(steepness)
    true = float((mpmath.log1p(mpmath.exp(k * (TURN - 3))) - mpmath.log1p(mpmath.exp(-3 * k))) / k)
    assert integral(text.format(k=steepness), most=120) == pytest.approx(true, rel=1e-8)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("exp(60*phi)*exp(-10*phi**2)*1e-39", 1e-39 * np.exp(90) * np.sqrt(np.pi / 10)),  # where either factor is a trifle
        ("exp(300*phi)*exp(-5000*(phi - 2)**2)*exp(-609)", np.exp(-4.5) * np.sqrt(np.pi / 5000)),
        ("log(1 + exp(1e5*(phi - 3)))", 1e5 * (TURN - 3) ** 2 / 2 + np.pi**2 / 6e5),
        ("phi*exp(1e5*(phi - 3))/(1 + exp(1e5*(phi - 3)))", (TURN**2 - 9) / 2 - np.pi**2 / 6e10),
        ("2e3/(exp(1e3*(phi - 2)) + exp(-1e3*(phi - 2)))", np.pi),
        (
            "exp(-1e-3/(phi - 3)**2)*(phi < 4)*(phi > 2)",
            2 * (np.exp(-1e-3) - np.sqrt(1e-3 * np.pi) * float(mpmath.erfc(1e-3**0.5))),
        ),
    ],
)
def test_exponentials_count_by_what_they_do_to_the_whole(text, expected):
    assert integral(text) == pytest.approx(expected, rel=1e-8)


def test_a_smooth_expression_is_left_alone():
    assert cells_of("3 + phi*sin(phi)", 0.0, 2.5)[1].tolist() == [0.0, 2.5]


def test_branches_that_are_not_taken_ask_for_nothing():
    assert cells_of("exp(1e3*phi) if phi < 0 else phi")[1].tolist() == [0.0, TURN]
    assert cells_of("max(phi + 1, 0.1/(phi + 1e-3) - 1e6)")[1].tolist() == [0.0, TURN]


@pytest.mark.parametrize("text", ["tan(phi)", "1/cos(phi)", "phi**-1.5", "(phi - 3)**-2"])
def test_what_is_not_finite_is_refused(text):
    with pytest.raises(SwitchingError, match="not finite near phi"):
        cells_of(text)


def test_what_varies_too_fast_is_refused():
    with pytest.raises(SwitchingError, match=r"sin\(1e6\*phi\) varies too fast for 10000 cells"):
        cells_of("2 + sin(1e6*phi)")


def test_what_is_infinite_is_named():
    with pytest.raises(SwitchingError, match=r"near phi = 3 \(4/\(phi - 3\): a division by phi - 3, which comes to 0\)"):
        cells_of("2 - 4/(phi - 3)")


def test_more_cells_than_may_be_added_may_stand_there_already():
    assert cells_of("sign(sin(5100*phi))")[1].size == 10_201
