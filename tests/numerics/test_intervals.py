"""Interval arithmetic: whatever lies between the ends is enclosed, and tightly where the function allows it."""

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flywheel.numerics.expressions import mpmath_namespace
from flywheel.numerics.intervals import NAMESPACE as ns
from flywheel.numerics.intervals import Interval

EXACT = mpmath_namespace()
ENDS = st.floats(-30, 30).map(lambda u: u if abs(u) > 1e-12 else 0.0)  # nothing that could underflow
ENDS |= st.sampled_from([0.0, -0.0, 1.0, -1.0, np.pi / 2, np.pi, 1e-12, -1e-12])
SHARES = np.array([0.0, 0.1, 0.35, 0.5, 0.77, 1.0])
CHECK = settings(derandomize=True, deadline=None, max_examples=60)

DOMAINS = {"asin": (-1, 1), "acos": (-1, 1), "sqrt": (0, np.inf), "log": (1e-300, np.inf)}
UNARY = ["sin", "cos", "tan", "asin", "acos", "atan", "sqrt", "exp", "log", "abs", "sign"]
BINARY = ["add", "subtract", "multiply", "divide", "minimum", "maximum", "atan2"]
BY_OPERATOR = {"add": lambda a, b: a + b, "subtract": lambda a, b: a - b, "multiply": lambda a, b: a * b}


@st.composite
def boxes(draw):
    a, b = sorted((draw(ENDS), draw(ENDS)))
    return a, b


def samples(box):
    return [min(max(box[0] + share * (box[1] - box[0]), box[0]), box[1]) for share in SHARES]


def encloses(bounds, number):
    return mpmath.mpf(float(bounds.lo)) <= number <= mpmath.mpf(float(bounds.hi))


@pytest.mark.parametrize("name", UNARY)
@CHECK
@given(boxes())
def test_functions_enclose_their_samples(name, box):
    bounds = getattr(ns, name)(Interval(np.array([box[0]]), np.array([box[1]])))
    least, most = DOMAINS.get(name, (-np.inf, np.inf))
    with mpmath.workdps(40):
        for u in samples(box):
            if least <= u <= most:
                number = getattr(EXACT, name)(mpmath.mpf(u))
                assert encloses(Interval(bounds.lo[0], bounds.hi[0]), number), u
    assert not np.isnan([bounds.lo, bounds.hi]).any()


@pytest.mark.parametrize("name", BINARY)
@CHECK
@given(boxes(), boxes())
def test_operations_enclose_their_samples(name, one, two):
    operation = BY_OPERATOR.get(name) or getattr(ns, name)
    exact = BY_OPERATOR.get(name) or getattr(EXACT, name)
    bounds = operation(Interval(*one), Interval(*two))
    assert not np.isnan(bounds.lo)
    assert not np.isnan(bounds.hi)
    with mpmath.workdps(60):
        for a in samples(one):
            for b in samples(two):
                if not (name == "divide" and b == 0):
                    assert encloses(bounds, exact(mpmath.mpf(a), mpmath.mpf(b))), (a, b)


@pytest.mark.parametrize("exponent", [0.0, 1.0, 2.0, 3.0, 8.0, -1.0, -2.0, 0.5, 2.5, -0.5])
@CHECK
@given(boxes())
def test_powers_enclose_their_samples(exponent, box):
    bounds = ns.power(Interval(*box), exponent)
    assert not np.isnan(bounds.lo)
    with mpmath.workdps(60):
        for u in samples(box):
            if (u > 0 or exponent.is_integer()) and not (u == 0 and exponent < 0):
                assert encloses(bounds, mpmath.mpf(u) ** mpmath.mpf(exponent)), u


@CHECK
@given(st.floats(0.01, 20), st.floats(0.01, 20), boxes())
def test_powers_with_a_varying_exponent_enclose_their_samples(one, two, exponents):
    base = min(one, two), max(one, two)
    bounds = ns.power(Interval(*base), Interval(*exponents))
    with mpmath.workdps(60):
        for u in samples(base):
            assert all(encloses(bounds, mpmath.mpf(u) ** mpmath.mpf(n)) for n in samples(exponents))


@CHECK
@given(boxes(), st.floats(-30, 30))
def test_plain_numbers_count_as_intervals_without_width(box, number):
    u, point = Interval(*box), Interval(number, number)
    for mixed, pure in (
        (u + number, u + point),
        (number - u, point - u),
        (u * number, u * point),
        (number / u, point / u),
    ):
        assert (mixed.lo, mixed.hi) == (pure.lo, pure.hi)


@CHECK
@given(boxes(), boxes())
def test_comparisons_are_sure_only_when_every_pair_agrees(one, two):
    for name in ("less", "less_equal", "greater", "greater_equal", "equal", "not_equal"):
        verdict = getattr(ns, name)(Interval(*one), Interval(*two))
        outcomes = {bool(getattr(np, name)(a, b)) for a in samples(one) for b in samples(two)}
        assert verdict.lo <= min(outcomes)
        assert max(outcomes) <= verdict.hi


def test_comparisons_that_are_sure():
    low, high = Interval(0.0, 1.0), Interval(2.0, 3.0)
    assert (ns.less(low, high).lo, ns.less(high, low).hi) == (1.0, 0.0)
    assert (ns.equal(Interval(2.0, 2.0), 2.0).lo, ns.not_equal(low, high).lo) == (1.0, 1.0)


def test_an_open_choice_is_the_hull_of_both_branches():
    test = ns.less(Interval(np.array([0.0, 0.0, 2.0]), np.array([0.5, 2.0, 3.0])), 1.0)
    chosen = ns.where(test, 5.0, Interval(-1.0, 0.0))
    assert (chosen.lo.tolist(), chosen.hi.tolist()) == ([5.0, -1.0, -1.0], [5.0, 5.0, 0.0])
    both = ns.logical_and(test, ns.logical_not(test))
    assert (both.lo.tolist(), both.hi.tolist()) == ([0.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    either = ns.logical_or(test, ns.logical_not(test))
    assert (either.lo.tolist(), either.hi.tolist()) == ([1.0, 0.0, 1.0], [1.0, 1.0, 1.0])


def test_extremes_inside_a_cell_are_exact_and_others_tight():
    crest = ns.sin(Interval(1.0, 2.0))
    assert crest.hi == 1.0
    assert crest.lo == pytest.approx(np.sin(1.0), rel=1e-14)
    assert ns.sin(Interval(-1.0, 1e9)).width == 2.0
    assert ns.cos(Interval(3.0, 3.5)).lo == -1.0
    assert ns.cos(Interval(0.1, 0.2)).hi < 1.0
    square = ns.power(Interval(-1.0, 2.0), 2.0)
    assert (square.lo, float(square.hi)) == (0.0, pytest.approx(4.0, rel=1e-14))


def test_what_may_be_anything():
    for bounds in (
        1.0 / Interval(-1.0, 2.0),
        ns.tan(Interval(1.5, 1.6)),
        ns.power(Interval(-1.0, 1.0), -1.0),
        ns.sin(Interval(-np.inf, np.inf)) * Interval(-np.inf, np.inf),
    ):
        assert (bounds.lo, bounds.hi) == (-np.inf, np.inf)
    half = [1.0 / Interval(0.0, 2.0), -1.0 / Interval(-2.0, 0.0), 1.0 / Interval(-0.0, 2.0), 1.0 / -Interval(0.0, 2.0)]
    assert [(bounds.lo <= 0.5 <= bounds.hi, bounds.hi == np.inf) for bounds in half[:3]] == [(True, True)] * 3
    assert all(bounds.lo > 0.49 for bounds in half[:3])
    assert half[3].lo == -np.inf
    assert half[3].hi > -0.51
    cut = ns.atan2(Interval(-1.0, 1.0), Interval(-2.0, -1.0))
    assert cut.lo < -np.pi < np.pi < cut.hi


def test_zero_stays_zero():
    nothing = Interval(0.0, 0.0) * Interval(-np.inf, np.inf) + 0.0 * Interval(1.0, 2.0)
    assert (nothing.lo, nothing.hi) == (0.0, 0.0)


def test_overflow_is_enclosed():
    with np.errstate(over="ignore"):
        huge = ns.exp(Interval(800.0, 900.0))
        assert np.isfinite(huge.lo)
        assert huge.hi == np.inf
        assert (huge - huge).contains(0.0)


def test_arrays_of_cells_mix_with_arrays_and_numpy_scalars():
    cells = Interval(np.array([0.0, 1.0]), np.array([1.0, 2.0]))
    shifted = np.array([10.0, 20.0]) + np.float64(2.0) * cells - np.float64(1.0)
    assert shifted.contains(np.array([9.0, 21.0])).all()
    assert shifted.width == pytest.approx(np.array([2.0, 2.0]), rel=1e-14)
    assert (-cells).magnitude.tolist() == [1.0, 2.0]
    assert (cells**2).mignitude == pytest.approx(np.array([0.0, 1.0]), rel=1e-14)
    assert repr(Interval(0.0, 0.5)) == "Interval(0., 0.5)"
