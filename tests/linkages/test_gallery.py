"""The gallery moves as closed forms and circles that intersect say, from any start, guess and order of names."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import replace
from math import pi, tau

import mpmath as mp
import numpy as np
import pytest
from numpy.typing import NDArray

from flywheel import SceneError
from flywheel.mechanisms.linkages.positions import Solution, solve
from flywheel.scene.linkage import Linkage, Side
from tests.limits import sample
from tests.linkages.linkages import (
    KLANN,
    dyad,
    hart,
    jansen,
    klann,
    pantograph,
    peaucellier,
    peaucellier_by_crank,
    roughly,
    sarrus,
    scissor_jack,
    scissor_lift,
    shuffled,
)

GALLERY: dict[str, tuple[Callable[[], Linkage], float, float]] = {
    "Peaucellier": (lambda: peaucellier(0.3), -1.0, 1.4),
    "Peaucellier with a full turn": (lambda: peaucellier(0.5, radius=0.012, pivot=0.055), 0.0, tau),
    "Peaucellier by a crank": (peaucellier_by_crank, 0.0, tau),
    "Hart": (lambda: hart(0.4), 0.0, tau),
    "Sarrus": (lambda: sarrus(0.3), 0.05, 0.35),
    "one stage": (lambda: scissor_lift(1, 0.3), 0.1, 0.48),
    "three stages": (lambda: scissor_lift(3, 0.3), 0.2, 0.45),
    "jack": (lambda: scissor_jack(0.25), 0.1, 0.35),
    "pantograph": (lambda: pantograph(0.3), 0.0, tau),
    "pantograph with a rhombus": (lambda: pantograph(0.3, 0.13, 0.13, 2.0), 0.0, tau),
    "Jansen": (lambda: jansen(0.2), 0.0, tau),
    "Klann": (klann, -pi, pi),
}

SAME = ("Peaucellier with a full turn", "one stage", "pantograph with a rhombus")  # kinds that stand there in other sizes


def point(solution: Solution, body: str, name: str, q: NDArray[np.float64]) -> NDArray[np.complex128]:
    x, y = solution.poses(q).point(body, solution.linkage.link(body).point(name)).value
    return x + 1j * y


@pytest.mark.parametrize("name", sample([name for name in GALLERY if name not in SAME], 3))
def test_it_begins_as_it_was_drawn_and_names_and_rough_guesses_do_not_change_it(name: str) -> None:
    make, low, high = GALLERY[name]
    drawing = make()
    low, high = max(low, drawing.start - 0.1), min(high, drawing.start + 0.1)
    q = np.array([low, drawing.start, high])
    expected = solve(drawing, low, high).poses(q)
    places = random.Random(1).sample(range(40), 40)
    result = solve(shuffled(roughly(drawing, 0.1), places), low, high).poses(q)
    for link in drawing.links:
        assert np.exp(1j * expected.angle(link.name).value[1]) == pytest.approx(np.exp(1j * (link.guess or 0.0)), abs=1e-11)
        at = (0.01, 0.02)
        np.testing.assert_allclose(result.point(link.name, at).value, expected.point(link.name, at).value, atol=1e-11)


@pytest.mark.parametrize("phi", sample([-1.2, 0.0, 1.5], 3))
def test_peaucellier_draws_a_straight_line_from_every_start(phi: float) -> None:
    """A circle through the centre of inversion becomes a line across OQ, arm² - side² over the circle's diameter away."""
    q = np.linspace(-1.5, 1.5, 31)
    line = point(solve(peaucellier(phi), -1.5, 1.5), "far upper", "P", q)
    np.testing.assert_allclose(line.real, (0.1**2 - 0.06**2) / 0.06, atol=1e-13)
    np.testing.assert_allclose(line.imag, (0.1**2 - 0.06**2) / 0.06 * np.tan(q / 2), atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    "guessed", sample(map(pytest.param, [(), ("upper arm", "far upper"), ("lower arm", "far lower", "near lower")]), 3)
)
def test_few_guesses_or_sides_choose_among_peaucelliers_four_assemblies(guessed: tuple[str, ...]) -> None:
    drawing = peaucellier(0.3)
    request = roughly(drawing, 0.05, guessed)
    if not guessed:
        with pytest.raises(SceneError, match=r"found 4 assemblies that fit with Q at 17\.1887 deg"):
            solve(request, 0.2, 0.4)
        arm = Side(("upper arm", "A"), ("frame", "O"), ("crank", "C"), 1)
        sides = (arm, Side(("far upper", "P"), ("upper arm", "A"), ("lower arm", "B"), 1))
        request = replace(request, sides=sides)
    np.testing.assert_allclose(
        point(solve(request, 0.2, 0.4), "far upper", "P", np.array([0.3])).real, 0.0064 / 0.06, atol=1e-13
    )


@pytest.mark.parametrize("name", sample(["Peaucellier with a full turn", "Peaucellier by a crank"], 2))
def test_peaucellier_inverts(name: str) -> None:
    make, low, high = GALLERY[name]
    solution, q = solve(make(), low, high), np.linspace(low, high, 61)
    near, far = point(solution, "near upper", "C", q), point(solution, "far upper", "P", q)
    np.testing.assert_allclose(near.conj() * far, 0.1**2 - 0.06**2, atol=1e-14)


def test_hart_inverts() -> None:
    solution, q = solve(hart(0.4), 0.0, tau), np.linspace(0.0, tau, 61)
    near, far = point(solution, "first", "O", q), point(solution, "second", "R", q)
    np.testing.assert_allclose(near, 0.0, atol=1e-13)
    product = (0.08 + 0.03 * np.exp(1j * q)).conj() * far
    np.testing.assert_allclose(product, -0.4 * 0.6 * (0.2**2 - 0.1**2), atol=1e-13)


@pytest.mark.parametrize("stages", [1, 3])
def test_a_scissor_lift_rises_by_pythagoras(stages: int) -> None:
    q = np.linspace(0.2, 0.45, 11)
    poses = solve(roughly(scissor_lift(stages, 0.3), 0.1), 0.2, 0.45).poses(q)
    height = poses.point("platform", (0.0, 0.0))
    root = np.sqrt(0.25 - q**2)
    np.testing.assert_allclose(height.value[1], stages * root, atol=1e-12)
    np.testing.assert_allclose(height.rate[1], -stages * q / root, atol=1e-11)
    np.testing.assert_allclose(height.slope[1], -stages * 0.25 / root**3, atol=1e-9)
    np.testing.assert_allclose(poses.angle("platform").value, 0.0, atol=1e-11)


@pytest.mark.parametrize("screw", sample([0.35, 0.1], 2))
def test_a_scissor_jack_from_every_start(screw: float) -> None:
    q = np.linspace(0.08, 0.37, 9)
    height = solve(roughly(scissor_jack(screw), 0.1), 0.08, 0.37).poses(q).point("head", (0.0, 0.0))
    root = np.sqrt(4 * 0.2**2 - q**2)
    np.testing.assert_allclose(height.value[1], root, atol=1e-12)
    np.testing.assert_allclose(height.slope[1], -4 * 0.2**2 / root**3, atol=1e-10)


def test_sarrus_in_the_plane_rises_straight() -> None:
    q = np.linspace(0.05, 0.35, 9)
    poses = solve(roughly(sarrus(0.3), 0.1), 0.05, 0.35).poses(q)
    folded = 2 * np.arccos(q / 0.4)
    np.testing.assert_allclose(
        np.cos(poses.angle("upper").value - poses.angle("lower").value), -np.cos(pi - folded), atol=1e-12
    )
    np.testing.assert_allclose(poses.point("lid", (0.0, 0.0)).value[0], 0.0, atol=1e-14)


@pytest.mark.parametrize("sizes", [(0.1, 0.15, 3.0), (0.13, 0.13, 2.0)])
def test_a_pantograph_enlarges(sizes: tuple[float, float, float]) -> None:
    solution, q = solve(pantograph(0.3, *sizes), 0.0, tau), np.linspace(0.0, tau, 61)
    np.testing.assert_allclose(point(solution, "pen", "C", q), sizes[2] * point(solution, "crank", "P", q), atol=1e-12)


def jansens_foot(phi: mp.mpf) -> mp.mpc:
    """By circles that intersect, with mpmath's numbers."""
    a, b, c, d, e, f, g, h, i, j, k, down, m = (
        mp.mpf(n) / 100
        for n in ("38", "41.5", "39.3", "40.1", "55.8", "39.4", "36.7", "65.7", "49", "50", "61.9", "7.8", "15")
    )
    pivot, crank = mp.mpc(-a, -down), m * mp.expj(phi)
    top, bottom = dyad(crank, pivot, j, b, -1), dyad(crank, pivot, k, c, 1)
    corner = dyad(dyad(top, pivot, e, d, -1), bottom, f, g, -1)
    return dyad(corner, bottom, h, i, -1)


def klanns_foot(phi: mp.mpf) -> mp.mpc:
    """From the same drawing, by circles that intersect."""
    z = {name: mp.mpc(at) / 10 for name, at in KLANN.items()}
    crank = z["O"] + abs(z["A"] - z["O"]) * mp.expj(phi)
    elbow = dyad(crank, z["H"], abs(z["E"] - z["A"]), abs(z["E"] - z["H"]), -1)
    knee = crank + (elbow - crank) * (z["K"] - z["A"]) / (z["E"] - z["A"])
    hip = dyad(knee, z["G"], abs(z["S"] - z["K"]), abs(z["S"] - z["G"]), 1)
    return knee + (hip - knee) * (z["F"] - z["K"]) / (z["S"] - z["K"])


@pytest.mark.parametrize(("name", "reference"), sample([("Klann", klanns_foot), ("Jansen", jansens_foot)], 2))
def test_feet_at_30_digits_and_their_derivatives(name: str, reference: Callable[[mp.mpf], mp.mpc]) -> None:
    make, low, high = GALLERY[name]
    solution, q = solve(make(), low, high), np.linspace(low, high, 5)
    track = solution.poses(q).point("leg", solution.linkage.link("leg").point("F"))
    with mp.workdps(30):
        for k, phi in enumerate(map(mp.mpf, q)):
            taylor = [mp.diff(reference, phi, n) for n in range(3)]
            for value, part in zip(taylor, track, strict=True):
                assert part[0, k] == pytest.approx(float(value.real), abs=1e-11)
                assert part[1, k] == pytest.approx(float(value.imag), abs=1e-11)
