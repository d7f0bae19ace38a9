"""Equations of a linkage and their solution: velocities, singular positions, contacts, instant centres."""

from __future__ import annotations

import re
from cmath import exp
from dataclasses import replace
from itertools import combinations
from math import pi, sqrt, tau
from typing import Any

import mpmath as mp
import numpy as np
import pytest

from flywheel import SceneError
from flywheel.mechanisms.families import build
from flywheel.mechanisms.linkage import linkage_of
from flywheel.mechanisms.linkages.assembly import assembled
from flywheel.mechanisms.linkages.equations import Equations, Poses, Track, correction, loops, settle, solved
from flywheel.mechanisms.linkages.positions import Solution, solve
from flywheel.mechanisms.linkages.reactions import reactions, reactions_at
from flywheel.mechanisms.linkages.statics import contact
from flywheel.motions.velocities import ANYWHERE, FINITE, INFINITE, centres_of, velocity
from flywheel.scene.linkage import FIXED, FRAME, SLIDE, SLOT, Joint, Link, Linkage
from flywheel.scene.scene import Mechanism
from tests.linkages import forced
from tests.linkages.linkages import (
    CASES,
    O,
    Rail,
    Reference,
    drawn,
    four_bar,
    four_bar_reference,
    meeting,
    roughly,
    scissor_jack,
    shuffled,
    six_bar,
    slider_crank,
    slider_crank_reference,
    whitworth,
    whole,
)
from tests.linkages.linkages import solve as whole_solution
from tests.mechanisms.chains import clamp, shaper, slider, walked, yoke
from tests.mechanisms.chains import four_bar as named_four_bar

# Loops and what cannot be put together; residual, Jacobian and second derivatives against differences; Newton's batches.


def setting(case: str) -> tuple[Equations, np.ndarray]:
    equations = Equations(loops(CASES[case][0]))
    return equations, np.random.default_rng(3).uniform(-1.0, 1.0, (6, len(equations.loops.names)))


@pytest.mark.parametrize("case", CASES)
def test_derivatives_are_those_of_the_residual(case: str) -> None:
    equations, z = setting(case)
    rate, h = np.random.default_rng(4).uniform(-1.0, 1.0, z.shape), 1e-4

    def residual(move: np.ndarray) -> np.ndarray:
        return equations.residual(z + move, equations.bases(z + move))

    jacobian = equations.jacobian(z, equations.bases(z))
    for k, move in enumerate(1e-6 * np.eye(z.shape[1])):
        np.testing.assert_allclose(jacobian[:, :, k], (residual(move) - residual(-move)) / 2e-6, atol=1e-8)
    bent = (residual(h * rate) - 2 * residual(0 * rate) + residual(-h * rate)) / h**2
    np.testing.assert_allclose(equations.bending(equations.bases(z), rate), bent, atol=1e-6)


@pytest.mark.parametrize("case", CASES)
def test_bounds_hold(case: str) -> None:
    equations, z = setting(case)
    rng = np.random.default_rng(5)
    a, b = rng.uniform(-1.0, 1.0, (2, *z.shape))
    bases = equations.bases(z)
    mixed = 0.25 * (equations.bending(bases, a + b) - equations.bending(bases, a - b))
    assert (np.abs(mixed) <= equations.bound(z, np.abs(bases.whole), np.abs(a), np.abs(b)) + 1e-12).all()
    h = 1e-5
    ends = [equations.bending(equations.bases(z + s * h * b), a) for s in (1, -1)]
    third = np.abs(ends[0] - ends[1]) / (2 * h)
    limit = equations.bound(z, np.abs(bases.whole), np.abs(a), np.abs(a), np.abs(b))
    assert (third <= limit * (1 + 1e-6) + 1e-6).all()


def test_a_batch_settles_though_one_is_lost() -> None:
    equations = Equations(loops(six_bar()))
    z = assembled(equations)
    off = np.tile(z, (5, 1))
    off[:, 1:] += np.random.default_rng(0).uniform(-0.05, 0.05, (5, z.size - 1))
    off[2] = np.nan
    together, last = settle(equations, off)
    kept = [0, 1, 3, 4]
    np.testing.assert_allclose(together[kept], np.tile(z, (4, 1)), atol=1e-12)
    assert (last[kept] < 1e-9).all()
    assert not last[2] < 1e-9


def test_singular_systems_are_nan_and_leave_the_others() -> None:
    matrix = np.array([[[2.0, 0.0], [0.0, 4.0]], [[1.0, 1.0], [1.0, 1.0]]])
    result = solved(matrix, np.array([[2.0, 4.0], [1.0, 0.0]]))
    assert result[0].tolist() == [1.0, 1.0]
    assert np.isnan(result[1]).all()


@pytest.mark.parametrize(
    ("linkage", "unknowns", "closures"),
    [(four_bar(), 2, 1), (six_bar(), 4, 2), (slider_crank(), 2, 1), (whitworth(), 4, 2)],
)
def test_two_equations_a_loop(linkage: object, unknowns: int, closures: int) -> None:
    result = loops(linkage)  # type: ignore[arg-type]
    assert (result.unknowns, len(result.closures)) == (unknowns, closures)
    assert result.equations == result.unknowns


def test_bodies_that_slide_share_their_angle() -> None:
    result = loops(slider_crank())
    names = result.linkage.names
    assert not result.angles[names.index("slider")].weights.any()
    assert result.names == ("coordinate of O", "angle of rod", "slide of guide")


def test_a_body_on_nothing() -> None:
    base = four_bar()
    with pytest.raises(SceneError, match=r"bodies\.stray: found a body that no joints connect"):
        loops(replace(base, links=(*base.links, Link("stray", (O,)))))


def test_a_driver_that_cannot_move() -> None:
    base = slider_crank()
    other = Joint("rail", SLIDE, FRAME, "crank", O, O)
    with pytest.raises(SceneError, match=r"driver: found O between frame and crank, which cannot turn"):
        loops(replace(base, joints=(*base.joints, other)))


def test_two_slides_that_disagree() -> None:
    base = slider_crank()
    other = Joint("rail", SLIDE, FRAME, "slider", O, O, angle=0.1)
    with pytest.raises(SceneError, match=r"rail, which turns slider by 5\.7.* deg against"):
        loops(replace(base, joints=(*base.joints, other)))


def test_two_slides_that_agree_are_one_too_many() -> None:
    base = slider_crank()
    other = Joint("rail", SLIDE, FRAME, "slider", O, O)
    assert loops(replace(base, joints=(*base.joints, other))).doubled == ("rail",)


def test_a_pin_between_moving_bodies_may_drive() -> None:
    base = six_bar()
    result = loops(replace(base, driver="B"))
    assert result.names[0] == "coordinate of B"


# Positions and influence coefficients of linkages of every kind against 30-digit references.


ANGLES = (0.0, 1.1, 3.0, 4.6, tau)
Q = np.linspace(0.2, 6.0, 7)


def found_at(solution: Solution, name: str, q: float) -> tuple[float, float, float]:
    """A body's angle or a slide's displacement with its two derivatives."""
    poses = solution.poses(q)
    track = poses.angle(name) if name in solution.linkage.names else solution.coordinate(name, poses)
    return float(track.value[0]), float(track.rate[0]), float(track.slope[0])


def derivatives(reference: Reference, name: str, q: float) -> list[float]:
    """Value and derivatives of a reference, by differences at 60 digits."""
    with mp.workdps(60):
        h, x = mp.mpf(10) ** -15, mp.mpf(q)
        low, mid, high = (reference(x + k * h)[name] for k in (-1, 0, 1))
        return [float(v) for v in (mid, (high - low) / (2 * h), (high - 2 * mid + low) / h**2)]


@pytest.mark.parametrize("case", CASES)
def test_agrees_with_the_reference(case: str) -> None:
    linkage, reference = CASES[case]
    solution = solve(linkage, 0.0, tau)
    assert solution.mobility == (1, 1, ())
    for name in reference(mp.mpf(1)):
        expected = [derivatives(reference, name, q) for q in ANGLES]
        scale = max(abs(value) for triple in expected for value in triple[1:])
        for q, (value, rate, slope) in zip(ANGLES, expected, strict=True):
            result = found_at(solution, name, q)
            gap = result[0] - value
            if name in linkage.names:
                gap = (gap + pi) % tau - pi
            assert abs(gap) < 1e-13 * max(scale, 1.0), (name, q)
            assert abs(result[1] - rate) < 1e-12 * scale, (name, q)
            assert abs(result[2] - slope) < 1e-12 * scale, (name, q)


@pytest.mark.parametrize("case", CASES)
def test_poses_close_every_joint(case: str) -> None:
    linkage = CASES[case][0]
    q = np.linspace(0.0, tau, 57)
    poses = solve(linkage, 0.0, tau).poses(q)
    for joint in linkage.joints:
        if joint.kind == "pin":
            ends = poses.point(joint.first, joint.first_at), poses.point(joint.second, joint.second_at)
            for a, b in zip(*ends, strict=True):
                np.testing.assert_allclose(a, b, rtol=0, atol=1e-13)


@pytest.mark.parametrize("case", CASES)
def test_newton_converges_quadratically(case: str) -> None:
    solution = whole(case)
    z = solution.movement(np.array([0.3, 2.0, 4.0])).value
    z[:, 1:] += 0.02
    step = 0.02
    for _ in range(5):
        move = correction(solution.equations, z)
        z[:, 1:] += move
        before, step = step, float(np.abs(move).max())
        assert step <= 30 * before**2 + 1e-14 or before == 0.02
    assert step < 1e-9


def test_driver_that_slides() -> None:
    base = slider_crank(e=0.0)
    links = tuple(link._replace(guess=g) for link, g in zip(base.links, (0.5, None, None), strict=True))
    pushed = replace(base, links=links, driver="guide", start=0.35)
    solution = solve(pushed, 0.25, 0.39)
    x = np.array([0.25, 0.3, 0.39])
    crank = solution.poses(x).angle("crank")
    cosine = (x**2 + 0.1**2 - 0.3**2) / (2 * x * 0.1)
    np.testing.assert_allclose(np.cos(crank.value), cosine, atol=1e-13)
    slope = (1 / 0.1 - (x**2 + 0.1**2 - 0.3**2) / (2 * x**2 * 0.1)) / -np.sin(crank.value)
    np.testing.assert_allclose(crank.rate, slope, rtol=1e-12)
    assert solution.linkage.sliding


def test_positions_outside_the_range_are_refused() -> None:
    solution = solve(four_bar(), 0.0, 1.0)
    with pytest.raises(SceneError, match=r"114\.59.* deg, expected one from 0 deg to 57\.29"):
        solution.poses([0.5, 2.0])


def test_start_may_lie_anywhere_in_the_range() -> None:
    base = four_bar()
    late = replace(base, start=2.5)
    q = np.linspace(0.0, tau, 9)
    early, other = (solve(linkage, 0.0, tau).poses(q) for linkage in (base, late))
    np.testing.assert_allclose(np.exp(1j * early.value[:, 2]), np.exp(1j * other.value[:, 2]), atol=1e-13)


@pytest.mark.parametrize("ratio", [0.3, 0.999999])
def test_slider_crank_close_to_its_lock(ratio: float) -> None:
    solution = solve(slider_crank(0.1, 0.1 / ratio, 0.0), 0.0, tau)
    with mp.workdps(40):
        for q in (0.3, pi / 2 - 1e-3, pi / 2, 4.7):
            r, length, x = mp.mpf(0.1), mp.mpf(0.1 / ratio), mp.mpf(q)
            run = mp.sqrt(length**2 - (r * mp.sin(x)) ** 2)
            value = r * mp.cos(x) + run
            rate = -r * mp.sin(x) - r**2 * mp.sin(x) * mp.cos(x) / run
            result = found_at(solution, "guide", q)
            closeness = float(length / run)
            assert abs(result[0] - float(value)) < 1e-16 * 20 * closeness
            assert abs(result[1] - float(rate)) < 1e-16 * 40 * closeness**2 * 0.1 + 1e-16


def test_positions_that_are_not_reached_are_told() -> None:
    base = slider_crank(0.1, 0.3, 0.0)
    links = tuple(link._replace(guess=0.5 if link.name == "crank" else link.guess) for link in base.links)
    pushed = replace(base, links=links, driver="guide", start=0.35)
    with pytest.raises(SceneError, match=r"a position that Newton's iteration does not reach, 0\.41 m"):
        solve(pushed, 0.3, 0.3999999).movement(np.array([0.41]))


def test_a_start_beside_the_range_s_end() -> None:
    base = four_bar()
    beside = replace(base, start=1e-15)
    poses = solve(beside, 0.0, 1.0).poses([-5e-10, 0.0])
    assert np.abs(poses.value).max() < 10.0


def test_arrays_that_are_kept_cannot_be_changed() -> None:
    solution = solve(four_bar(), 0.0, tau)
    with pytest.raises(ValueError, match="read-only"):
        solution.trace.value[0, 0] = 1.0
    q = np.array([0.5])
    poses = solution.poses(q)
    q[0] = 9.0
    assert poses.q[0] == 0.5


def test_a_crank_s_point_goes_round() -> None:
    track = solve(four_bar(), 0.0, tau).poses(Q).point("crank", (0.1, 0.05))
    point = (0.1 + 0.05j) * np.exp(1j * Q)
    for result, expected in zip(track, (point, 1j * point, -point), strict=True):
        np.testing.assert_allclose(result[0] + 1j * result[1], expected, atol=1e-15)


def test_derivatives_of_a_floating_point() -> None:
    solution, h = solve(six_bar(), 0.0, tau), 1e-4
    low, mid, high = (solution.poses(Q + k * h).point("link", (0.1, 0.2)) for k in (-1, 0, 1))
    np.testing.assert_allclose((high.value - low.value) / (2 * h), mid.rate, atol=1e-6)
    np.testing.assert_allclose((high.rate - low.rate) / (2 * h), mid.slope, atol=1e-6)


def test_the_centre_of_mass_is_a_point_of_its_body() -> None:
    base = four_bar()
    linkage = replace(base, links=tuple(link._replace(com=(0.07, -0.02)) for link in base.links))
    poses = solve(linkage, 0.0, tau).poses(Q)
    np.testing.assert_array_equal(poses.centre("coupler").slope, poses.point("coupler", (0.07, -0.02)).slope)


def test_a_body_that_holds_the_frame_at_an_angle_is_turned_against_it() -> None:
    base = slider_crank()
    weld = Joint("weld", FIXED, "stand", FRAME, base.ground.points[0], base.ground.points[0], angle=0.3)
    state = replace(base, links=(*base.links, Link("stand", base.ground.points)), joints=(weld, *base.joints))
    poses, plain = (solve(linkage, 0.0, 1.0).poses([0.7]) for linkage in (state, base))
    np.testing.assert_allclose(poses.angle("stand").value, -0.3, atol=1e-15)
    np.testing.assert_allclose(poses.angle("rod").value, plain.angle("rod").value, atol=1e-14)


# Change points are named with what meets there, and the families of assemblies that collapsed links have.


BARS = {FRAME: "O D", "crank": "O A", "coupler": "A B", "rocker": "D B"}


def change_point_four_bar(d: float, r: float, c: float, rocker: float, side: int = 1) -> Linkage:
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
    text = refusal(shuffled(change_point_four_bar(*bars), (2, 1, 0, 3)))
    assert f"found {kind} (coupler, crank, frame, rocker) that branches (a change point) with the driver O at 180 d" in text
    assert "two assemblies meet there (" in text


def test_the_rates_of_both_assemblies_are_those_on_either_side_of_the_change_point() -> None:
    """Finite differences of circles that intersect, left and right of the line, next to the crank at 180 degrees."""
    d, r, c, rocker = 0.4, 0.1, 0.2, 0.3

    def angles(q: float, side: int) -> np.ndarray:
        b = meeting(r * exp(1j * q), d + 0j, c, rocker, side)
        return np.unwrap(np.angle([b - r * exp(1j * q), b - d]))

    h, text = 1e-4, refusal(change_point_four_bar(d, r, c, rocker))
    rates = [((angles(pi - h, side) - angles(pi - 2 * h, side) + pi) % tau - pi) / h for side in (1, -1)]
    words = re.findall(r"coupler (\S+) rad, rocker (\S+) rad per rad of the driver", text)
    assert len(words) == 2
    np.testing.assert_allclose(np.sort(np.array(words, dtype=float), axis=0), np.sort(rates, axis=0), atol=2e-3)


def test_a_kite_that_folds_onto_itself_has_a_family_where_the_driver_rests() -> None:
    text = refusal(change_point_four_bar(0.3, 0.3, 0.4, 0.4))
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
    text = refusal(roughly(change_point_four_bar(d, r, c, rocker), 0.05))
    assert float(text.split("locks with the driver O at ")[1].split(" deg")[0]) == pytest.approx(angle, abs=1e-6)


# Instant centres: by construction with 30 digits, by Aronhold and Kennedy, near infinity, and velocities by them.


CENTRE_ANGLES = np.linspace(0.13, 6.1, 9)


def crossing(a, b, c, d):
    """Point where the line through a and b meets that through c and d."""
    share = mp.im(mp.conj(d - c) * (c - a)) / mp.im(mp.conj(d - c) * (b - a))
    return a + share * (b - a)


def off(centre, k, true):
    return abs(mp.mpc(*map(float, centre.place[:, k])) - true)


def test_those_of_a_four_bar_are_where_its_bars_meet():
    result = centres_of(whole("four-bar").poses(CENTRE_ANGLES))
    for k, phi in enumerate(map(mp.mpf, CENTRE_ANGLES.tolist())):
        angles = four_bar_reference(phi)
        a, b, d = mp.mpf("0.1") * mp.expj(phi), mp.mpf("0.4") + mp.mpf("0.3") * mp.expj(angles["rocker"]), mp.mpf("0.4")
        for pair, true in (((FRAME, "coupler"), crossing(0, a, d, b)), (("crank", "rocker"), crossing(0, d, a, b))):
            centre = result[pair]
            assert not centre.permanent
            assert centre.kind[k] == FINITE
            assert off(centre, k, true) <= centre.error[k] < 1e-9 * (1 + abs(true)) ** 2


def test_far_away_the_error_is_told():
    """The rod's is on the crank's line, above the slider: it goes to infinity as the crank comes to stand across."""
    away = np.concatenate([[s * 10.0**-k for s in (-1, 1)] for k in range(1, 15)])
    result = centres_of(whole("slider-crank").poses(pi / 2 + away))[FRAME, "rod"]
    seen = 0
    for k, phi in enumerate((pi / 2 + away).tolist()):
        true = slider_crank_reference(mp.mpf(phi))["guide"] * mp.mpc(1, mp.tan(mp.mpf(phi)))
        if result.kind[k] == FINITE:
            assert off(result, k, true) <= result.error[k] < 1e-12 * abs(true) ** 2 * 100
            seen += 1
        else:
            assert abs(true) > 1e11
            assert np.isnan(result.place[:, k]).all()
    assert 24 <= seen <= 27
    assert result.error[20] > 1e3 * result.error[10]


def test_far_away_a_rate_that_is_a_small_difference_counts():
    """The coupler of a four-bar comes to a translation, its centre to infinity, where crank and rocker are parallel."""
    solution = whole("four-bar")
    low, high = 1.7, 2.3
    for _ in range(60):
        middle = 0.5 * (low + high)
        signs = np.sign(solution.poses([low, middle]).angle("coupler").rate)
        low, high = (low, middle) if signs[0] != signs[1] else (middle, high)
    phi = low + 10.0 ** -np.arange(2.0, 13.0)
    result = centres_of(solution.poses(phi))[FRAME, "coupler"]
    assert np.count_nonzero(result.kind == FINITE) >= 10
    for k in np.flatnonzero(result.kind == FINITE):
        with mp.workdps(30):
            angle = four_bar_reference(mp.mpf(float(phi[k])))["rocker"]
            b, d = mp.mpf("0.4") + mp.mpf("0.3") * mp.expj(angle), mp.mpf("0.4")
            true = crossing(mp.mpf(0), mp.expj(mp.mpf(float(phi[k]))), d, b)
            assert off(result, k, true) <= result.error[k] < 1e-11 * abs(true) ** 2


def test_at_infinity_there_is_the_direction_alone():
    inline = slider_crank(e=0.0)
    poses = whole_solution(inline, 0.0, 7.0).poses([pi / 2, 1.0])
    result = centres_of(poses)
    rod, guide = result[FRAME, "rod"], result[FRAME, "slider"]
    assert rod.kind.tolist() == [INFINITE, FINITE]
    assert not rod.permanent
    assert guide.kind.tolist() == [INFINITE] * 2
    assert guide.permanent
    assert abs(rod.direction[0]) == pytest.approx(pi / 2, abs=1e-12)
    assert np.isnan(rod.direction[1])
    assert result["rod", "slider"].permanent
    assert result["rod", "slider"].kind[0] == FINITE


@pytest.mark.parametrize("case", CASES)
def test_three_bodies_have_three_centres_on_a_line(case):
    linkage = CASES[case][0]
    result = centres_of(whole(case).poses(CENTRE_ANGLES))
    tried = 0
    for triple in combinations(linkage.names, 3):
        centres = [result[pair] for pair in combinations(triple, 2)]
        finite = np.all([centre.kind == FINITE for centre in centres], axis=0)
        (x1, y1), (x2, y2), (x3, y3) = (centre.place[:, finite] for centre in centres)
        area = (x2 - x1) * (y3 - y1) - (x3 - x1) * (y2 - y1)
        reach = np.hypot(x2 - x1, y2 - y1) + np.hypot(x3 - x1, y3 - y1)
        error = np.sum([centre.error[finite] for centre in centres], axis=0)
        assert (np.abs(area) <= 2 * reach * error + 1e-300).all()
        tried += int(finite.sum())
    assert tried >= 9


@pytest.mark.parametrize("case", CASES)
def test_they_give_the_velocities_that_influence_coefficients_give(case):
    linkage, poses = CASES[case][0], whole(case).poses(CENTRE_ANGLES)
    result = centres_of(poses)
    for link in linkage.links:
        centre = result[FRAME, link.name]
        for point in link.points:
            by_centre, error = velocity(poses, link.name, point, centre)
            assert (np.abs(by_centre - poses.point(link.name, point).rate) <= error + 1e-16).all()
            assert error.max() < 1e-10


def test_the_sliders_speed_is_omega_times_the_distance_of_the_shared_point():
    """And, as the source has it, omega r PB/PA with the rod's centre P."""
    poses = whole("slider-crank").poses(CENTRE_ANGLES)
    result = centres_of(poses)
    slider = np.abs(poses.point("slider", (0.0, 0.0)).rate[0])
    np.testing.assert_allclose(np.hypot(*result["crank", "slider"].place), slider, rtol=1e-12)
    pin, end, centre = poses.point("rod", (0, 0)).value, poses.point("rod", (0.3, 0)).value, result[FRAME, "rod"].place
    np.testing.assert_allclose(0.1 * np.hypot(*(end - centre)) / np.hypot(*(pin - centre)), slider, rtol=1e-12)


def test_gears_touch_in_their_pitch_point():
    """Between the axes, at their distance shared out as the radii."""
    result = centres_of(whole("geared five-bar").poses(CENTRE_ANGLES))["crank", "second"]
    np.testing.assert_allclose(result.place, np.outer([0.2, 0.0], np.ones(9)), atol=1e-14)


def test_a_follower_that_dwells_has_no_motion_of_its_own():
    result = centres_of(whole("cam and lever").poses([0.0]))
    assert result[FRAME, "lever"].kind[0] == FINITE
    assert result[FRAME, "lever"].permanent
    assert result[FRAME, "bar"].kind[0] == ANYWHERE
    assert np.isnan(result[FRAME, "bar"].error[0])
    still, error = velocity(whole("cam and lever").poses([0.0]), "bar", (0.1, 0.0), result[FRAME, "bar"])
    assert np.abs(still).max() == 0.0
    assert error[0] < 1e-12


def test_what_is_no_pose_is_refused():
    with pytest.raises(SceneError, match="expected Poses"):
        centres_of("poses")


# The named mechanisms as linkages: the solver, which knows no closed form, finds the same motion.


SLIDES = {
    "scotch-yoke": {"yoke": "guide"},
    "slider-crank": {"slider": "guide"},
    "four-bar": {},
    "crank-shaper": {"ram": "guide"},
    "toggle-clamp": {"block": "block_guide", "platen": "platen_guide"},
}
PLAIN = {
    "yoke aslant": yoke(2.1),
    "slider": slider(0.1, 0.3),
    "slider, offset below": slider(0.1, 0.2, -0.09),
    "crank-rocker": named_four_bar(4.0, 1.0, 3.0, 3.5),
    "crank-rocker, crossed": named_four_bar(4.0, 1.0, 3.0, 3.5, "crossed"),
    "drag-link": named_four_bar(1.0, 2.0, 2.5, 2.2),
    "drag-link, crossed": named_four_bar(1.0, 2.0, 2.5, 2.2, "crossed"),
    "shaper": shaper(0.1, 0.4),
    "whitworth": shaper(0.4, 0.1),
    "clamp": clamp(),
    "clamp, crossed, behind": clamp(assembly="crossed-behind"),
    "clamp, short rod": clamp(rod=0.1, stroke=(0.08, 0.2)),
    "clamp backwards": clamp(stroke=(0.19, -0.06)),
}
NEARLY_LOCKED = {
    "slider, offset": slider(0.5, 1.0, 0.499999),
    "crank-rocker": named_four_bar(4.0, 1.0, 2.000001, 3.0),
    "drag-link": named_four_bar(1.0, 2.0, 1.000001, 2.0),
    "shaper": shaper(0.4, 0.401),
    "clamp": clamp(stroke=(-0.2222, 0.2222)),
}


def slowly(name: str, mechanism: Mechanism, twin: str) -> Any:
    """A case by its name; that of a four-bar beside another is not for the default run."""
    return pytest.param(mechanism, id=name, marks=[pytest.mark.slow] if name == twin else [])


def ends(mechanism: Mechanism) -> tuple[float, float]:
    low, high = sorted(mechanism.stroke or (0.0, tau))
    return low, high


def followed(mechanism: Mechanism, q: np.ndarray) -> tuple[Solution, Poses]:
    solution = solve(linkage_of(mechanism), *ends(mechanism))
    return solution, solution.poses(q)


def positions(mechanism: Mechanism) -> np.ndarray:
    return np.linspace(*ends(mechanism), 37)


def exactly(mechanism: Mechanism, q: np.ndarray) -> dict[str, Track]:
    """The closed form's ports, and the gains of all its velocities with their slopes."""
    family = build(mechanism)
    position, gains = family.position(q, np), walked(family, q)
    tracks = {name: Track(q, gain + 0 * q, slope + 0 * q) for name, (gain, slope) in gains.items()}
    return tracks | {n: tracks[port.velocity]._replace(value=port.position(position)) for n, port in family.ports.items()}


def motion(mechanism: Mechanism, solution: Solution, poses: Poses) -> dict[str, Track]:
    """The solver's motion by the names of the closed form: ports, and velocities of the centres of mass."""
    result = {}
    for name in build(mechanism).ports:
        slide = SLIDES[mechanism.type].get(name)
        result[name] = solution.coordinate(slide, poses) if slide else poses.angle(name)
    for link in linkage_of(mechanism).links:
        for axis, name in enumerate(("x", "y")):
            result[f"{link.name}.com.{name}"] = Track(*(part[axis] for part in poses.centre(link.name)))
    return result


def gap(result: Track, exact: Track, turning: bool) -> list[float]:
    """Greatest difference of value, g and g', each as a share of the greatest there is, or of 1."""
    first = result.value - exact.value
    first = (first + pi) % tau - pi if turning else first
    parts = (first, result.rate - exact.rate, result.slope - exact.slope)
    return [float(np.max(np.abs(part)) / max(1.0, np.max(np.abs(of)))) for part, of in zip(parts, exact, strict=True)]


@pytest.mark.parametrize("mechanism", [slowly(name, m, "drag-link, crossed") for name, m in PLAIN.items()])
def test_the_solver_has_the_motion_and_the_inertia_of_the_closed_form(mechanism: Mechanism) -> None:
    family, q = build(mechanism), positions(mechanism)
    solution, poses = followed(mechanism, q)
    exact, result = exactly(mechanism, q), motion(mechanism, solution, poses)
    for name in family.ports:
        assert max(gap(result[name], exact[name], name not in SLIDES[mechanism.type])) <= 1e-12, name
    for name in set(exact) & {name for name in result if ".com." in name}:
        assert max(gap(result[name]._replace(value=q), exact[name], False)) <= 1e-12, name
    inertia: Any = sum(mass.value * exact[mass.velocity].rate ** 2 for mass in family.masses)
    expected = np.zeros_like(q)
    for link in linkage_of(mechanism).links:
        expected += link.mass * (poses.centre(link.name).rate ** 2).sum(axis=0)
        expected += link.inertia * poses.angle(link.name).rate ** 2
    assert np.max(np.abs(inertia - expected)) <= 1e-12 * np.max(expected)
    assert solution.mobility == (1, 1, ())


@pytest.mark.parametrize("mechanism", [slowly(name, m, "drag-link") for name, m in NEARLY_LOCKED.items()])
@pytest.mark.slow
def test_close_to_a_lock_they_agree_as_far_as_lengths_are_known(mechanism: Mechanism) -> None:
    """To 1e-12, or to what one rounding of each length makes of g and g' where that is more."""
    family, q = build(mechanism), positions(mechanism)
    exact, result = exactly(mechanism, q), motion(mechanism, *followed(mechanism, q))
    for name in family.ports:
        turning = name not in SLIDES[mechanism.type]
        reference = np.zeros(3)
        for length, value in mechanism.geometry.items():
            moved = replace(mechanism, geometry={**mechanism.geometry, length: value * (1 + 2.0**-52)})
            reference += gap(exactly(moved, q)[name], exact[name], turning)
        assert np.all(np.array(gap(result[name], exact[name], turning)) <= np.maximum(1e-12, 4 * reference)), name


@pytest.mark.parametrize("mechanism", PLAIN.values(), ids=PLAIN.keys())
def test_joints_and_bodies_are_named_as_documented(mechanism: Mechanism) -> None:
    linkage = linkage_of(mechanism)
    rows = [line.strip() for line in (linkage_of.__doc__ or "").splitlines()]
    row = next(line for line in rows if line.startswith(f"| {mechanism.type} |"))
    _, _, bodies, joints, _ = (cell.strip() for cell in row.split("|"))
    assert bodies.split(", ") == list(linkage.names[1:])
    assert joints.replace(" (slide)", "").split(", ") == [joint.name for joint in linkage.joints]
    assert joints.count("(slide)") == sum(joint.kind == "slide" for joint in linkage.joints)
    assert linkage.driver == linkage.joints[0].name
    for joint in linkage.joints:
        assert joint.first_at.name == joint.second_at.name == joint.name


def test_slides_inside_have_the_coordinates_of_the_field() -> None:
    for mechanism in (yoke(2.1), shaper(0.1, 0.4), shaper(0.4, 0.1)):
        q = positions(mechanism)
        solution, poses = followed(mechanism, q)
        position = build(mechanism).position(q, np)
        if mechanism.type == "scotch-yoke":
            expected = {"slot": 0.5 * np.sin(q - 2.1)}
        else:
            expected = {"rocker_slot": position.distance, "ram_slot": 0.8 * position.rocker_cos}
        for joint, value in expected.items():
            assert np.max(np.abs(solution.coordinate(joint, poses).value - value)) <= 1e-14


def test_the_driver_starts_where_the_stroke_does() -> None:
    assert linkage_of(clamp()).start == -0.06
    assert linkage_of(clamp(stroke=(0.19, -0.06))).start == 0.19
    assert linkage_of(clamp()).sliding
    assert not linkage_of(slider(0.1, 0.3)).sliding


def test_a_linkage_is_given_back_as_it_is() -> None:
    linkage = Linkage(Link("frame"), (), (), "pivot")
    assert linkage_of(Mechanism("linkage", "m", linkage=linkage)) is linkage


@pytest.mark.parametrize("kind", ["law", "gearbox"])
def test_what_has_no_joints_is_refused(kind: str) -> None:
    with pytest.raises(SceneError, match=rf"^mechanism\[1\].type: found a mechanism of type {kind}, expected one of sc"):
        linkage_of(Mechanism(kind, "m", path="mechanism[1]"))


def test_a_mechanism_that_locks_is_refused_with_its_length() -> None:
    with pytest.raises(SceneError, match=r"mechanism.rod.length: .* locks at 30, 150, 210 and 330 deg"):
        linkage_of(slider(0.5, 0.25))


# Where couplings touch, against what wheels and cams are known to do.


CONTACTS_Q = np.linspace(0.1, 3.0, 5)


def touch(linkage):
    poses = solve(linkage, 0.0, 3.1).poses(CONTACTS_Q)
    return contact(poses, linkage.couplings[0]), poses


@pytest.mark.parametrize(
    ("linkage", "at", "aside"),
    [
        (forced.geared_five_bar(0.3), (0.2, 0.0), (1.0, 0.0)),  # outside: 0.3 m split 2 : 1, pressed apart
        (forced.internal(), (0.06, 0.08), (0.6, 0.8)),  # inside: radii 0.05 and 0.1, the ring is pressed outwards
    ],
)
def test_wheels_touch_where_their_pitch_circles_do(linkage, at, aside):
    result, _ = touch(linkage)
    np.testing.assert_allclose(result.at, np.outer(at, CONTACTS_Q**0), atol=1e-15)
    np.testing.assert_allclose(result.aside, np.outer(aside, CONTACTS_Q**0), atol=1e-14)


def test_a_planet_touches_its_sun_on_the_arm():
    result, poses = touch(forced.planetary())
    arm = poses.point("arm", (0.1, 0.0)).value
    np.testing.assert_allclose(result.at, 0.6 * arm, atol=1e-15)  # sun 0.06, planet 0.04: 1.5 turns a turn
    assert (result.first, result.second) == (0, 2)


def test_a_wheel_rolls_below_its_axle():
    result, poses = touch(forced.rolling_wheel())
    axle = poses.point("slider", (0.0, 0.05)).value
    np.testing.assert_allclose(result.at, axle - np.array([[0.0], [0.05]]), atol=1e-15)


def test_a_flat_face_is_touched_at_the_eccentricity_of_the_lifts_slope():
    result, _ = touch(forced.cam("flat"))
    slope = -0.01 * np.sin(CONTACTS_Q) + 0.006 * np.cos(2 * CONTACTS_Q)
    lift = 0.05 + 0.01 * np.cos(CONTACTS_Q) + 0.003 * np.sin(2 * CONTACTS_Q)
    np.testing.assert_allclose(result.at, np.stack((slope, lift)), atol=1e-15)
    np.testing.assert_allclose(result.push, np.stack((0 * CONTACTS_Q, 1 + 0 * CONTACTS_Q)), atol=1e-15)


def test_a_roller_is_pushed_across_the_pitch_curve():
    """The normal of the curve that the roller's centre draws on the cam, by differences of that curve."""
    linkage = forced.cam("roller")
    result, poses = touch(linkage)
    near = solve(linkage, 0.0, 3.1)

    def drawn(q):
        p = near.poses(q)
        x, y = p.point("follower", (0.0, 0.0)).value
        angle = p.angle("cam").value
        return (x + 1j * y) * np.exp(-1j * angle)

    along = (drawn(CONTACTS_Q + 1e-5) - drawn(CONTACTS_Q - 1e-5)) * np.exp(1j * poses.angle("cam").value)
    assert np.abs(result.push[0] * along.real + result.push[1] * along.imag).max() < 1e-9 * np.abs(along).min() * 10
    assert (result.push[1] > 0.5).all()


def test_the_pressure_angle_parts_the_wheels_whichever_flank_drives():
    """Radial force = |tangential| tan(alpha); the pins feel it, the driving torque does not."""
    alpha = 0.35
    q = np.linspace(0.1, 6.0, 7)
    plain, slanted = (reactions(forced.geared_five_bar(a), q, 15.0) for a in (0.0, alpha))
    tangential = plain.components["mesh"]["tangential"]
    assert (tangential > 0).any()
    assert (tangential < 0).any()
    radial = slanted.components["mesh"]["radial"]
    np.testing.assert_allclose(slanted.components["mesh"]["tangential"], tangential, rtol=1e-12)
    np.testing.assert_allclose(radial, np.abs(tangential) * np.tan(alpha), rtol=1e-12)
    np.testing.assert_allclose(slanted.action, plain.action, rtol=1e-12)
    for pivot, sense in (("pivot", 1.0), ("pinion_pivot", -1.0)):  # the frame holds both wheels together
        change = slanted.components[pivot]["x"] - plain.components[pivot]["x"]
        np.testing.assert_allclose(change, sense * radial, rtol=1e-9)


def refused(linkage, **change):
    other = linkage.couplings[0]._replace(**change)
    poses = solve(linkage, 0.0, 0.2).poses([0.1])
    with pytest.raises(SceneError) as caught:
        contact(poses, other)
    return str(caught.value)


def test_what_has_no_contact_is_refused():
    assert "a belt has no tooth flanks" in refused(forced.geared_five_bar(0.3), ratio=1.0)
    assert "mesh" in refused(forced.geared_five_bar(), second="top")
    assert "a slide on which the wheel rolls" in refused(forced.geared_five_bar(), kind="rolling")
    assert "contact" in refused(forced.cam("rocker"), contact=None)


def test_friction_of_teeth_is_refused():
    linkage = forced.geared_five_bar()
    rubbing = replace(linkage, couplings=(linkage.couplings[0]._replace(friction=0.1),))
    with pytest.raises(SceneError, match="nothing slides"):
        reactions_at(solve(linkage, 0.0, 1.0).poses([0.5])._replace(linkage=rubbing), 1.0)
