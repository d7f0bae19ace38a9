"""Roots and breakpoints: all of them, to the last digits, and none hidden between samples."""

import numpy as np
import pytest

from flywheel.numerics.expressions import parse
from flywheel.numerics.intervals import NAMESPACE, Interval
from flywheel.numerics.jets import Jet, jet_namespace
from flywheel.numerics.switching import SwitchingError, breakpoints, roots

TURN = 2 * np.pi
JETS = jet_namespace(NAMESPACE)


def env(lo, hi, anchor=None):
    return {"phi": Jet(Interval(lo, hi), 1.0)}


def env_value(phi, anchor=None):
    return {"phi": phi}


def found(text, a=0.0, b=TURN, known=()):
    return breakpoints(parse(text), a, b, env, env_value, known)


def found_roots(text, a, b):
    expression = parse(text)

    def enclose(lo, hi):
        jet = expression.evaluate(env(lo, hi), JETS)
        return (jet.value, jet.first) if isinstance(jet, Jet) else (jet, 0.0)

    return roots(enclose, lambda phi: expression.evaluate(env_value(phi), np), a, b)


ARC = float(np.arcsin(0.3))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("3", []),
        ("0*phi", []),
        ("phi - 2", [2.0]),
        ("phi + 2", []),
        ("sin(phi)", [np.pi]),
        ("sin(phi) - 0.3", [ARC, np.pi - ARC]),
        ("(phi - 1)*(phi - 1.0001)*(phi - 5)", [1.0, 1.0001, 5.0]),
        ("exp(-((phi - 2)/1e-3)**2) - 0.5", [2 - 1e-3 * np.log(2) ** 0.5, 2 + 1e-3 * np.log(2) ** 0.5]),
        ("exp(-((phi - 2)/1e-6)**2) - 0.5", [2 - 1e-6 * np.log(2) ** 0.5, 2 + 1e-6 * np.log(2) ** 0.5]),
        ("(phi - 1)**3", [1.0]),
        ("tan(phi)", [np.pi / 2, np.pi, 3 * np.pi / 2]),
        ("1/(phi - 2)", [2.0]),
    ],
)
def test_roots_are_found_to_the_last_digits(text, expected):
    assert found_roots(text, 0.0, TURN) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("sin(phi)**2", [np.pi]),
        ("1 - sin(phi)", [np.pi / 2]),
        ("(phi - 1)**2", [1.0]),
        ("(phi - 1)**2*(phi - 3)**4", [1.0, 3.0]),
        ("1 - cos(phi)", []),
    ],
)
def test_touching_zeros_are_found_once_and_not_at_the_ends(text, expected):
    assert found_roots(text, 0.0, TURN) == pytest.approx(expected, abs=2e-9)


def test_functions_above_zero_have_no_root_however_close():
    assert found_roots("(phi - 1)**2 + 1e-12", 0.0, TURN) == []


@pytest.mark.parametrize("count", [1, 2, 4, 7])
def test_every_root_of_a_polynomial_is_found(count):
    rng = np.random.default_rng(count)
    for _ in range(4):
        places = sorted(rng.choice(np.arange(5, 620), count, replace=False) / 100 + rng.uniform(0, 0.01))
        assert found_roots("*".join(f"(phi - {place})" for place in places), 0.0, TURN) == pytest.approx(places, rel=1e-12)


WAVES = [(1, 0.3, -2.1), (2, -0.99, 0.0), (3, 0.0, 0.5), (7, 0.98, 3.0), (19, -0.4, -1.0), (40, 0.7, 2.2)]


@pytest.mark.parametrize(("count", "level", "phase"), WAVES)
def test_every_crossing_of_a_wave_is_found(count, level, phase):
    angles = (np.array([np.arcsin(level), np.pi - np.arcsin(level)])[:, None] - phase + TURN * np.arange(-2, 43)) / count
    expected = np.sort(angles[(angles > 1e-9) & (angles < TURN - 1e-9)])
    roots_ = found_roots(f"sin({count}*phi + {phase!r}) - {level!r}", 0.0, TURN)
    assert [root for root in roots_ if 1e-9 < root < TURN - 1e-9] == pytest.approx(expected, abs=1e-13)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("sin(phi) + phi**2", []),
        ("5*(phi < pi)", [np.pi]),
        ("1 < phi <= 2", [1.0, 2.0]),
        ("3 if phi > 1 and not phi >= 4 else 2", [1.0, 4.0]),
        ("max(sin(phi), 0)", [np.pi]),
        ("abs(abs(phi - 3) - 1)", [2.0, 3.0, 4.0]),
        ("sign(sin(phi)) > 0.5", [np.pi]),
        ("max(0, min(3*sin(phi), 1))", [np.arcsin(1 / 3), np.pi - np.arcsin(1 / 3), np.pi]),
        ("sqrt(1 - sin(phi))", [np.pi / 2]),
        ("asin(sin(phi))", [np.pi / 2, 3 * np.pi / 2]),
        ("abs(phi - 2)**0.5", [2.0]),
        ("atan2(sin(phi), cos(phi))", [np.pi]),
        ("(phi - 1)**3 > 0", [1.0]),
    ],
)
def test_breakpoints_of_expressions(text, expected):
    assert found(text) == pytest.approx(expected, abs=1e-14)


def test_known_angles_are_not_repeated():
    assert found("max(sin(phi), 0)*(phi > 1)", known=[np.pi]) == [1.0]


def test_hundreds_of_switches_are_found_and_far_too_many_refused():
    def enclosures(count):
        taken = 0

        def counting(lo, hi, anchor=None):
            nonlocal taken
            taken += np.size(lo)
            return env(lo, hi, anchor)

        zeros = breakpoints(parse(f"sin({count}*phi) > 0"), 0.0, TURN, counting, env_value, ())
        assert zeros == pytest.approx(np.pi / count * np.arange(1, 2 * count), rel=1e-13)
        return taken

    assert enclosures(300) < 15 * enclosures(30)
    with pytest.raises(SwitchingError, match=r"sin\(1000000 \* phi\): changes sign too often"):
        found("sin(1e6*phi) > 0")


def test_a_displacement_with_wider_bounds_and_a_velocity_given_by_its_sign():
    """A port with x = cos phi: v changes sign at pi, which is known; x is bounded loosely on purpose."""

    def cells(lo, hi, anchor):
        u = Interval(lo, hi)
        wide = NAMESPACE.cos(u) + Interval(-1.0, 1.0) * (0.1 * u.width)
        return {"x": Jet(wide, -NAMESPACE.sin(u)), "v": np.where(0.5 * (lo + hi) < np.pi, -1.0, 1.0)}

    def values(phi, anchor):
        return {"x": np.cos(phi), "v": np.where(phi < np.pi, -1.0, 1.0)}

    angles = breakpoints(parse("max(x*sign(v), 0.5)*(v > 0)"), 0.0, TURN, cells, values, [np.pi])
    assert angles == pytest.approx([2 * np.pi / 3, 5 * np.pi / 3], rel=1e-14)


@pytest.mark.parametrize("seed", range(5))
def test_no_switch_lies_between_breakpoints(seed):
    a, b, c, d = np.random.default_rng(seed).uniform([0.2, 0.5, -0.9, 0.3], [3.0, 6.0, 0.9, 5.9]).tolist()
    text = f"max({a!r}*sin({b!r}*phi), abs(cos(phi) - {c!r})) if sin(phi*phi/2) < {c!r} else min(phi, {d!r})"
    edges = np.array([0.0, *found(text), TURN])
    middles = 0.5 * (edges[1:] + edges[:-1])
    for switch in parse(text).switches():
        for lo, hi, middle in zip(edges, edges[1:], middles, strict=False):
            inside = np.linspace(lo, hi, 41)[1:-1]
            values = switch.evaluate({"phi": inside}, np, {"phi": middle})
            assert np.all(values >= -1e-13) or np.all(values <= 1e-13), switch.text
