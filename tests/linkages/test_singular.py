"""Change points are named with what meets there, and the families of assemblies that collapsed links have."""

from __future__ import annotations

import re
from cmath import exp
from math import pi, sqrt, tau

import numpy as np
import pytest

from flywheel.mechanisms.linkages.positions import solve
from flywheel.numerics.faults import SceneError
from flywheel.scene.linkage import FRAME, SLOT, Joint, Linkage
from tests.linkages.gallery import Rail, drawn, meeting, roughly, scissor_jack, shuffled

BARS = {FRAME: "O D", "crank": "O A", "coupler": "A B", "rocker": "D B"}


def four_bar(d: float, r: float, c: float, rocker: float, side: int = 1) -> Linkage:
    a = r * exp(1j)
    return drawn({"O": 0j, "D": d + 0j, "A": a, "B": meeting(a, d + 0j, c, rocker, side)}, BARS, "O", 1.0)


def refusal(linkage: Linkage, high: float = tau) -> str:
    with pytest.raises(SceneError) as caught:
        solve(linkage, 0.0, high)
    return str(caught.value)


@pytest.mark.parametrize(
    ("bars", "kind"),
    [
        ((0.4, 0.1, 0.1, 0.4), "a kite"),
        ((0.4, 0.1, 0.2, 0.3), "a four-bar whose shortest and longest bars are together as long as the others"),
        ((0.1, 0.4, 0.2, 0.3), "a four-bar whose shortest and longest bars are together as long as the others"),
        ((0.3, 0.3, 0.3, 0.3), "a parallelogram"),
        ((0.25, 0.07, 0.25, 0.07), "a parallelogram"),
    ],
)
def test_four_bars_with_a_change_point(bars: tuple[float, ...], kind: str) -> None:
    text = refusal(shuffled(four_bar(*bars), (2, 1, 0, 3)))
    assert f"found {kind} (coupler, crank, frame, rocker) that branches (a change point) with the driver O at 180 d" in text
    assert "two assemblies meet there (" in text


def test_the_rates_of_both_assemblies_are_those_on_either_side_of_the_change_point() -> None:
    """Finite differences of circles that intersect, left and right of the line, next to the crank at 180 degrees."""
    d, r, c, rocker = 0.4, 0.1, 0.2, 0.3

    def angles(q: float, side: int) -> np.ndarray:
        b = meeting(r * exp(1j * q), d + 0j, c, rocker, side)
        return np.unwrap(np.angle([b - r * exp(1j * q), b - d]))

    h, text = 1e-4, refusal(four_bar(d, r, c, rocker))
    rates = [((angles(pi - h, side) - angles(pi - 2 * h, side) + pi) % tau - pi) / h for side in (1, -1)]
    told = re.findall(r"coupler (\S+) rad, rocker (\S+) rad per rad of the driver", text)
    assert len(told) == 2
    np.testing.assert_allclose(np.sort(np.array(told, dtype=float), axis=0), np.sort(rates, axis=0), atol=2e-3)


def test_a_kite_that_folds_onto_itself_has_a_family_where_the_driver_rests() -> None:
    text = refusal(four_bar(0.3, 0.3, 0.4, 0.4))
    assert "a kite (coupler, crank, frame, rocker) that branches (a change point) with the driver O at 360 deg" in text
    assert "coupler and rocker can move freely while the driver rests" in text


def test_a_parallelogram_within_a_six_bar() -> None:
    a = 0.1 * exp(1j)
    places = {"O": 0j, "D": 0.4 + 0j, "A": a, "B": a + 0.4, "T": a + 0.2 + 0.1j, "G": 0.8 + 0.2j}
    places["H"] = meeting(places["T"], places["G"], 0.5, 0.4, 1)
    bodies = BARS | {FRAME: "O D G", "coupler": "A B T", "link": "T H", "output": "G H"}
    text = refusal(drawn(places, bodies, "O", 1.0))
    assert "found a parallelogram (coupler, crank, frame, rocker) that branches (a change point)" in text
    assert "at 180 deg" in text


def test_two_parallelograms_in_a_row() -> None:
    a = 0.1 * exp(1j)
    places = {"O": 0j, "D": 0.4 + 0j, "S": 0.8 + 0j, "A": a, "B": a + 0.4, "W": a + 0.8}
    bodies = {FRAME: "O D S", "crank": "O A", "rod": "A B", "middle": "D B", "second rod": "B W", "last": "S W"}
    text = refusal(drawn(places, bodies, "O", 1.0))
    assert "found a parallelogram" in text
    assert "with the driver O at 180 deg" in text
    assert "several assemblies meet there" in text


@pytest.mark.parametrize(("offset", "angle"), [(0.0, "90"), (0.05, "270")])
def test_slider_cranks_with_a_change_point(offset: float, angle: str) -> None:
    """Rod and crank differ by the offset: the pin stands on the guide's line, and the slider may rest there."""
    a, rod = 0.2 * exp(1j), 0.2 + offset
    places = {"O": 0j, "A": a, "B": a.real + sqrt(rod**2 - (offset - a.imag) ** 2) + 1j * offset}
    bodies = {FRAME: "O", "crank": "O A", "rod": "A B", "slider": "B"}
    text = refusal(drawn(places, bodies, "O", 1.0, {"guide": Rail("slider", "B")}))
    assert f"a linkage that branches (a change point) with the driver O at {angle} deg" in text
    assert "m per rad of the driver; or rod" in text


def test_a_third_guide_carries_cardans_circles_through() -> None:
    a = 0.2 * exp(1j)
    places = {"O": 0j, "A": a, "B": 2 * a.real + 0j, "C": 2j * a.imag}
    bodies = {FRAME: "O", "crank": "O A", "rod": "A B C", "along": "B", "across": "C"}
    rails = {"guide": Rail("along", "B"), "cross guide": Rail("across", "C", pi / 2)}
    solution = solve(drawn(places, bodies, "O", 1.0, rails), 0.0, tau)
    q = np.linspace(0.0, tau, 73)
    np.testing.assert_allclose(solution.coordinate("guide", solution.poses(q)).value, 0.4 * np.cos(q), atol=1e-12)


def test_a_swinging_lever_about_the_circle_of_its_crank() -> None:
    a = 0.2 * exp(1j)
    base = drawn({"O": 0j, "A": a, "Q": -0.2j}, {FRAME: "O Q", "crank": "O A", "lever": "Q A"}, "O", 1.0)
    lever, crank = base.link("lever"), base.link("crank")
    slot = Joint("slot", SLOT, "lever", "crank", lever.points[0], crank.points[1], guess=abs(a + 0.2j))
    text = refusal(Linkage(base.ground, base.links, (*base.joints[:2], slot), "O", start=1.0))
    assert "branches (a change point) with the driver O at 270 deg" in text
    assert "lever can move freely while the driver rests" in text


def test_a_collapsed_jack_is_named_as_a_family() -> None:
    """With head and foot on each other, all four arms and the nuts turn about them."""
    jack = scissor_jack(0.25)
    turned = {"lower left": 2.0, "lower right": 2.0 - 2 * np.arcsin(0.625), "upper left": 2.0}
    guesses = turned | {"upper right": turned["lower right"]}
    links = tuple(link._replace(guess=guesses.get(link.name)) for link in jack.links)
    joints = tuple(joint._replace(guess=0.0 if joint.name == "lift" else None) for joint in jack.joints)
    text = refusal(Linkage(jack.ground, links, joints, "screw", start=0.25), 0.3)
    assert "found a continuous family of assemblies" in text
    assert "can move freely with the driver held while the pins" in text
    assert "lower left" in text
    assert "expected one assembly that the driver settles" in text


def test_a_family_without_any_assembly_beside_it() -> None:
    """A crank as long as the frame, on the rocker's pivot: coupler and rocker are free."""
    places = {"O": 0j, "D": 0.2 + 0j, "A": 0.2 + 0j, "B": 0.2 + 0.15j}
    text = refusal(drawn(places, BARS, "O"))
    assert "found a continuous family of assemblies, as coupler and rocker can move freely" in text
    assert "the pins A and D lie on each other" in text
    assert "choose another `start`" in text


def test_a_lock_is_still_a_lock() -> None:
    d, r, c, rocker = 0.4, 0.3, 0.25, 0.3
    angle = np.degrees(np.arccos((d**2 + r**2 - (c + rocker) ** 2) / (2 * d * r)))
    text = refusal(roughly(four_bar(d, r, c, rocker), 0.05))
    assert float(text.split("locks with the driver O at ")[1].split(" deg")[0]) == pytest.approx(angle, abs=1e-6)
