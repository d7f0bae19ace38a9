"""Every relation's gradient and bend against derivatives at 40 digits, along a motion with velocity and acceleration."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import mpmath as mp
import pytest

from flywheel.mechanisms.linkages.multibody import COMPONENTS, Pair, Place, Row, closures, coordinate, placed
from flywheel.scene.linkage import FIXED, PIN, SLIDE, SLOT

X = (0.31, -0.22, 0.7), (0.55, 0.41, -1.3)
V = (0.4, 1.1, -2.3), (-0.9, 0.6, 1.7)
A = (-1.2, 0.3, 0.8), (0.5, -1.4, 2.1)
NS = SimpleNamespace(cos=mp.cos, sin=mp.sin)


def joint(kind: str) -> Pair:
    return Pair("J", kind, 1, 2, (0.12, -0.05), (-0.3, 0.2), (0.8, 0.6), angle=-2.0)


def moved(k: int, t: Any) -> Place:
    pose = [x + v * t + a * t * t / 2 for x, v, a in zip(X[k], V[k], A[k], strict=True)]
    return placed(pose, V[k], NS)


def along(row: Row, values: tuple[tuple[float, ...], tuple[float, ...]]) -> float:
    """The gradient times a change of both poses."""
    pairs = (zip(gradient, change, strict=True) for gradient, change in zip((row.first, row.second), values, strict=True))
    return float(sum(g * c for pair in pairs for g, c in pair))


def derivatives(value: Callable[[Any], Any]) -> tuple[float, float]:
    with mp.workdps(40):
        h = mp.mpf(10) ** -12
        low, mid, high = value(-h), value(mp.mpf(0)), value(h)
        return float((high - low) / (2 * h)), float((high - 2 * mid + low) / h**2)


@pytest.mark.parametrize("kind", [PIN, SLIDE, SLOT, FIXED])
def test_rates_and_bends_of_what_a_joint_keeps_at_zero(kind):
    rows = closures(joint(kind), placed(X[0], V[0]), placed(X[1], V[1]))
    assert len(rows) == len(COMPONENTS[kind])
    for k, row in enumerate(rows):
        rate, second = derivatives(lambda t, k=k: closures(joint(kind), moved(0, t), moved(1, t))[k].value)
        assert along(row, V) == pytest.approx(rate, abs=1e-13)
        assert along(row, A) + row.bend == pytest.approx(second, abs=1e-12)


@pytest.mark.parametrize("kind", [PIN, SLIDE, SLOT])
def test_rates_and_bends_of_coordinates(kind):
    row = coordinate(joint(kind), placed(X[0], V[0]), placed(X[1], V[1]))
    rate, second = derivatives(lambda t: coordinate(joint(kind), moved(0, t), moved(1, t)).value)
    assert along(row, V) == pytest.approx(rate, abs=1e-13)
    assert along(row, A) + row.bend == pytest.approx(second, abs=1e-12)


def test_whole_turns_do_not_open_a_rigid_joint():
    one, two = placed((0.0, 0.0, 0.0)), placed((0.0, 0.0, -2.0 + 4 * mp.pi))
    assert abs(closures(joint(FIXED), one, two)[2].value) < 1e-14
