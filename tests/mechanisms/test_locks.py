"""Mechanisms that cannot turn are refused with the angles where they lock; near a lock cells are short."""

from __future__ import annotations

from itertools import pairwise
from math import pi, tau

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flywheel.mechanisms.families import build, graded, within_turn
from flywheel.numerics.faults import Fault, SceneError
from flywheel.scene.scene import Mechanism


def fault(kind: str, **lengths: float) -> Fault:
    geometry = {("slider.offset" if key == "offset" else f"{key}.length"): value for key, value in lengths.items()}
    with pytest.raises(SceneError) as refused:
        build(Mechanism(kind, "m", geometry=geometry))
    (only,) = refused.value.faults
    return only


def test_a_rod_shorter_than_the_crank_locks_four_times() -> None:
    found = fault("slider-crank", crank=0.5, rod=0.25)
    assert found.path == "mechanism.rod.length"
    assert found.found == "0.25 m"
    assert found.expected == "a rod longer than crank + |offset| = 0.5 m"
    assert found.advice == "the crank locks at 30, 150, 210 and 330 deg"


@pytest.mark.parametrize(
    ("offset", "rod", "where"),
    [
        (0.0, 0.5, "90 and 270 deg"),
        (0.1, 0.6, "270 deg"),
        (-0.1, 0.6, "90 deg"),
        (0.25, 0.5, "210 and 330 deg"),
        (2.0, 0.5, "at no crank angle"),
    ],
)
def test_an_offset_locks_on_its_far_side(offset: float, rod: float, where: str) -> None:
    assert fault("slider-crank", crank=0.5, rod=rod, offset=offset).advice.endswith(where)


def test_lengths_equal_but_for_rounding_lock() -> None:
    assert 0.1 + 0.2 != 0.3
    assert "locks at 270" in fault("slider-crank", crank=0.1, offset=0.2, rod=0.1 + 0.2).advice
    assert fault("crank-shaper", crank=0.1 + 0.2, frame=0.3, rocker=1.0).path == "mechanism.frame.length"


def test_a_shaper_with_crank_as_long_as_its_frame_locks_at_180() -> None:
    found = fault("crank-shaper", crank=0.3, frame=0.3, rocker=1.0)
    assert found[:4] == (
        "mechanism.frame.length",
        "0.3 m",
        "a length other than crank.length = 0.3 m",
        "the crank locks at 180 deg",
    )


@pytest.mark.parametrize(
    ("lengths", "path", "where"),
    [
        ((4.0, 2.0, 2.0, 3.0), "coupler", "locks at 108.21 and 251.79"),  # cos = (20 - 25)/16
        ((4.0, 1.0, 2.0, 3.0), "coupler", "locks at 180"),  # change point
        ((4.0, 2.0, 4.0, 2.0), "rocker", "locks at 0 and 180"),  # parallelogram
        ((3.0, 3.0, 2.0, 2.5), "crank", "locks"),
        ((4.0, 2.0, 9.0, 1.0), "rocker", "closes at no crank angle"),
        ((4.0, 2.0, 9.0, 3.0), "coupler", "locks at 180"),
    ],
)
def test_a_four_bar_names_the_bar_to_change(lengths: tuple[float, ...], path: str, where: str) -> None:
    found = fault("four-bar", **dict(zip(("ground", "crank", "coupler", "rocker"), lengths, strict=True)))
    assert found.path == f"mechanism.{path}.length"
    assert where in found.advice


LENGTH = st.integers(1, 24).map(lambda n: n / 4)


@given(LENGTH, LENGTH, LENGTH, LENGTH)
@settings(derandomize=True, max_examples=15, deadline=None)
def test_a_four_bar_is_refused_exactly_when_its_triangle_flattens(d: float, r: float, c: float, rocker: float) -> None:
    diagonal = np.abs(r * np.exp(1j * np.linspace(0.0, pi, 181)) - d)  # lengths in quarters: flat only at the ends
    slack = np.minimum(c + rocker - diagonal, diagonal - abs(c - rocker))
    bars = zip(("ground", "crank", "coupler", "rocker"), (d, r, c, rocker), strict=True)
    mechanism = Mechanism("four-bar", "m", geometry={f"{bar}.length": length for bar, length in bars})
    if slack.min() < 1e-9:
        with pytest.raises(SceneError):
            build(mechanism)
    else:
        position = build(mechanism).position(np.linspace(0.0, 7.0, 50), np)
        pin = r * np.exp(1j * position.psi)
        assert pin + c * np.exp(1j * position.coupler) == pytest.approx(d + rocker * np.exp(1j * position.rocker))


@given(LENGTH, LENGTH, LENGTH, LENGTH)
@settings(derandomize=True, max_examples=40, deadline=None)
def test_the_coupler_asked_for_turns(d: float, r: float, c: float, rocker: float) -> None:
    geometry = {"ground.length": d, "crank.length": r, "coupler.length": c, "rocker.length": rocker}
    try:
        build(Mechanism("four-bar", "m", geometry=geometry))
    except SceneError as refused:
        (only,) = refused.faults
        if only.path == "mechanism.coupler.length":
            words = only.expected.split()
            geometry["coupler.length"] = (float(words[1]) + float(words[3])) / 2
            build(Mechanism("four-bar", "m", geometry=geometry))


@pytest.mark.parametrize("distance", [0.4, 0.1, 1e-3, 1e-6])
def test_graded_cells_follow_a_pole_to_1e_8(distance: float) -> None:
    edges = np.array([-1.0, *graded(0.0, distance, reach=1.0), 1.0])
    nodes = np.cos((2 * np.arange(17) + 1) * pi / 34)
    for a, b in pairwise(edges):
        half, middle = (b - a) / 2, (a + b) / 2
        fitted = np.polynomial.chebyshev.chebfit(nodes, distance / (middle + half * nodes - 1j * distance), 16)
        probe = np.linspace(-1.0, 1.0, 101)
        error = np.polynomial.chebyshev.chebval(probe, fitted) - distance / (middle + half * probe - 1j * distance)
        assert np.max(np.abs(error)) < 1e-8


def test_far_singularities_need_no_breakpoint() -> None:
    assert graded(0.0, 0.7) == []
    assert build(Mechanism("slider-crank", "m", geometry={"crank.length": 0.25, "rod.length": 1.0})).breakpoints == ()


@pytest.mark.parametrize(
    ("kind", "geometry", "centres"),
    [
        ("slider-crank", {"crank.length": 0.95, "rod.length": 1.0}, [pi / 2, 3 * pi / 2]),
        ("slider-crank", {"crank.length": 0.5, "rod.length": 1.0, "slider.offset": 0.49}, [3 * pi / 2]),
        ("slider-crank", {"crank.length": 0.5, "rod.length": 1.0, "slider.offset": -0.49}, [pi / 2]),
        ("crank-shaper", {"crank.length": 0.5, "frame.length": 0.51, "rocker.length": 1.0}, [pi]),
        (
            "four-bar",
            {"ground.length": 4.0, "crank.length": 1.0, "coupler.length": 2.01, "rocker.length": 3.0},
            [pi],
        ),
        (
            "four-bar",
            {"ground.length": 4.0, "crank.length": 1.0, "coupler.length": 5.99, "rocker.length": 3.0},
            [0.0],
        ),
    ],
)
def test_breakpoints_stand_about_the_near_lock(kind: str, geometry: dict[str, float], centres: list[float]) -> None:
    found = np.array(build(Mechanism(kind, "m", geometry=geometry)).breakpoints)
    assert np.all((found >= 0.0) & (found < tau) & (np.diff(found, append=7.0) > 0.0))
    assert {c for c in (0.0, pi / 2, pi, 3 * pi / 2) if np.any(np.isclose(found, c))} == set(centres)
    assert all(min(abs((angle - c + pi) % tau - pi) for c in centres) < 1.0 for angle in found)


def test_a_hair_below_zero_stays_within_the_turn() -> None:
    assert within_turn([-1e-20]) == (0.0,)
