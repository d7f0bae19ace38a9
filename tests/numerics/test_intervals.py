"""Interval arithmetic: whatever lies between the ends is enclosed, and tightly where the function allows it."""

import mpmath
import numpy as np
import pytest

from flywheel.numerics.intervals import NAMESPACE as ns
from flywheel.numerics.intervals import Interval
from tests.numerics.exact import mpmath_namespace

EXACT = mpmath_namespace()
SHARES = np.array([0.0, 0.1, 0.35, 0.5, 0.77, 1.0])
DOMAINS = {"asin": (-1, 1), "acos": (-1, 1), "sqrt": (0, np.inf), "log": (1e-300, np.inf)}
UNARY = ["sin", "cos", "tan", "asin", "acos", "atan", "sqrt", "exp", "log", "abs", "sign"]
BINARY = ["add", "subtract", "multiply", "divide", "minimum", "maximum", "atan2"]
BY_OPERATOR = {"add": lambda a, b: a + b, "subtract": lambda a, b: a - b, "multiply": lambda a, b: a * b}


def boxes(seed, count=60):
    """Lower and upper ends, many of them zeros, ones, right angles, or equal."""
    rng = np.random.default_rng(seed)
    special = [0.0, -0.0, 1.0, -1.0, np.pi / 2, np.pi, 1e-12, -1e-12]
    ends = np.where(rng.random((2, count)) < 0.4, rng.choice(special, (2, count)), rng.uniform(-30, 30, (2, count)))
    ends *= np.where(rng.random(count) < 0.3, 1e-2, 1.0)
    ends[1, :4] = ends[0, :4]
    return np.sort(ends, axis=0)


def samples(lo, hi):
    """Numbers in boxes, shape (boxes, shares)."""
    return np.clip(lo[:, None] + SHARES * (hi - lo)[:, None], lo[:, None], hi[:, None])


def assert_encloses(bounds, k, number, what):
    assert mpmath.mpf(float(bounds.lo[k])) <= number <= mpmath.mpf(float(bounds.hi[k])), what


@pytest.mark.parametrize("name", UNARY)
def test_functions_enclose_their_samples(name):
    lo, hi = boxes(1)
    bounds = getattr(ns, name)(Interval(lo, hi))
    assert not np.isnan([bounds.lo, bounds.hi]).any()
    least, most = DOMAINS.get(name, (-np.inf, np.inf))
    with mpmath.workdps(40):
        for (k, _), u in np.ndenumerate(samples(lo, hi)):
            if least <= u <= most:
                assert_encloses(bounds, k, getattr(EXACT, name)(mpmath.mpf(u)), u)


@pytest.mark.parametrize("name", BINARY)
def test_operations_enclose_their_samples(name):
    one, two = boxes(2), boxes(3)
    operation = BY_OPERATOR.get(name) or getattr(ns, name)
    exact = BY_OPERATOR.get(name) or getattr(EXACT, name)
    bounds = operation(Interval(*one), Interval(*two))
    assert not np.isnan([bounds.lo, bounds.hi]).any()
    with mpmath.workdps(60):
        for k, (first, second) in enumerate(zip(samples(*one), samples(*two), strict=True)):
            for a, b in np.stack(np.meshgrid(first, second), axis=-1).reshape(-1, 2):
                if not (name == "divide" and b == 0):
                    assert_encloses(bounds, k, exact(mpmath.mpf(a), mpmath.mpf(b)), (a, b))


@pytest.mark.parametrize("exponent", [0.0, 1.0, 2.0, 3.0, 8.0, -1.0, -2.0, 0.5, 2.5, -0.5])
def test_powers_enclose_their_samples(exponent):
    lo, hi = boxes(4)
    bounds = ns.power(Interval(lo, hi), exponent)
    assert not np.isnan(bounds.lo).any()
    with mpmath.workdps(60):
        for (k, _), u in np.ndenumerate(samples(lo, hi)):
            if (u > 0 or exponent.is_integer()) and not (u == 0 and exponent < 0):
                assert_encloses(bounds, k, mpmath.mpf(u) ** mpmath.mpf(exponent), u)


def test_powers_with_a_varying_exponent_enclose_their_samples():
    base, exponents = np.sort(np.random.default_rng(5).uniform(0.01, 20, (2, 40)), axis=0), boxes(6, 40)
    bounds = ns.power(Interval(*base), Interval(*exponents))
    with mpmath.workdps(60):
        for k, (bases, powers) in enumerate(zip(samples(*base), samples(*exponents), strict=True)):
            for u, n in zip(bases, powers[[5, 0, 3, 1, 2, 4]], strict=True):
                assert_encloses(bounds, k, mpmath.mpf(u) ** mpmath.mpf(n), (u, n))


def test_plain_numbers_count_as_intervals_without_width():
    u, number = Interval(*boxes(7)), np.random.default_rng(8).uniform(-30, 30, 60)
    point = Interval(number, number)
    for mixed, pure in (
        (u + number, u + point),
        (number - u, point - u),
        (u * number, u * point),
        (number / u, point / u),
    ):
        np.testing.assert_array_equal([mixed.lo, mixed.hi], [pure.lo, pure.hi])


@pytest.mark.parametrize("name", ["less", "less_equal", "greater", "greater_equal", "equal", "not_equal"])
def test_comparisons_are_sure_only_when_every_pair_agrees(name):
    one, two = boxes(9), boxes(10)
    verdict = getattr(ns, name)(Interval(*one), Interval(*two))
    outcomes = getattr(np, name)(samples(*one)[:, :, None], samples(*two)[:, None, :])
    assert (verdict.lo <= outcomes.min(axis=(1, 2))).all()
    assert (outcomes.max(axis=(1, 2)) <= verdict.hi).all()


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
