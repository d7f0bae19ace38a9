"""Every assembly is found, and the choice among them is never silent."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from flywheel.faults import SceneError
from flywheel.linkage.assembly import assembled, assemblies
from flywheel.linkage.description import Linkage, Side
from flywheel.linkage.equations import Equations
from flywheel.linkage.loops import loops
from tests.flywheel.linkage.linkages import cam_rocker, four_bar, geared_five_bar, six_bar, slider_crank, whitworth


def unguessed(linkage: Linkage) -> Linkage:
    """The linkage without guesses and sides."""
    return replace(linkage, links=tuple(link._replace(guess=None) for link in linkage.links), sides=())


@pytest.mark.parametrize(
    ("linkage", "count"),
    [(four_bar(), 2), (slider_crank(), 2), (six_bar(), 4), (whitworth(), 2), (geared_five_bar(), 2), (cam_rocker(), 2)],
)
def test_finds_all_assemblies(linkage: Linkage, count: int) -> None:
    equations = Equations(loops(unguessed(linkage)))
    found = assemblies(equations)
    assert len(found) == count
    assert np.abs(equations.residual(found, equations.bases(found))).max() < 1e-10


def test_without_a_guess_the_assemblies_are_listed() -> None:
    with pytest.raises(SceneError) as caught:
        assembled(Equations(loops(unguessed(four_bar()))))
    text = str(caught.value)
    assert "2 assemblies that fit with O at 0 deg" in text
    assert text.count("coupler") == 2
    assert "guess or side" in text


def test_a_guess_between_two_assemblies_is_refused() -> None:
    base = unguessed(four_bar())
    found = assemblies(Equations(loops(base)))
    middle = float(np.angle(np.exp(1j * found[:, 1]).sum()))
    crank, coupler, rocker = base.links
    doubtful = replace(base, links=(crank, coupler._replace(guess=middle + 0.02), rocker))
    with pytest.raises(SceneError, match="guesses that do not tell the assemblies apart"):
        assembled(Equations(loops(doubtful)))


@pytest.mark.parametrize("off", [-0.5, 0.0, 0.5])
def test_a_rough_guess_takes_the_nearest(off: float) -> None:
    base = unguessed(four_bar())
    found = assemblies(Equations(loops(base)))
    crank, coupler, rocker = base.links
    for z in found:
        guessed = replace(base, links=(crank, coupler._replace(guess=float(z[1]) + off), rocker))
        chosen = assembled(Equations(loops(guessed)))
        assert abs((chosen[1] - z[1] + pi) % (2 * pi) - pi) < 1e-9


def test_sides_choose() -> None:
    left, right = (assembled(Equations(loops(four_bar(side=side)))) for side in (1, -1))
    assert left[2] > 0.0
    assert abs(left[2] + right[2] - 2 * pi) < 1e-9


def test_sides_that_contradict() -> None:
    base = four_bar()
    side = base.sides[0]
    with pytest.raises(SceneError, match=r"assembly: found sides that no assembly fits"):
        assembled(Equations(loops(replace(base, sides=(side, Side(*side[:3], -side.sense))))))


def test_bars_that_do_not_reach() -> None:
    with pytest.raises(SceneError, match=r"cannot be assembled with O at 0 deg, .* the loop .* stays open by 1\.25 m"):
        assembled(Equations(loops(four_bar(d=2.0))))


def test_a_start_in_a_singular_position() -> None:
    flat = replace(slider_crank(0.1, 0.1, 0.0), start=pi / 2)
    with pytest.raises(SceneError, match=r"an assembly that locks or branches with O at 90 deg \(rod"):
        assembled(Equations(loops(flat)))


def test_guesses_that_contradict_each_other() -> None:
    base = unguessed(six_bar())
    found = assemblies(Equations(loops(base)))
    first = found[0]
    other = next(z for z in found[1:] if np.allclose(z[1:3], first[1:3]))
    wanted = {"coupler": first[1], "rocker": first[2], "link": first[3], "output": other[4]}
    guesses = {name: float(value) for name, value in wanted.items()}
    links = tuple(link._replace(guess=guesses.get(link.name)) for link in base.links)
    with pytest.raises(SceneError, match=r"contradict each other, as angle of|do not tell the assemblies apart"):
        assembled(Equations(loops(replace(base, links=links))))
