"""Loops and what cannot be put together; residual, Jacobian and second derivatives against differences; Newton's batches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flywheel.mechanisms.linkages.assembly import assembled
from flywheel.mechanisms.linkages.equations import Equations, loops, settle, solved
from flywheel.numerics.faults import SceneError
from flywheel.scene.linkage import FRAME, SLIDE, Joint, Link
from tests.linkages.linkages import CASES, O, four_bar, six_bar, slider_crank, whitworth


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
    found = solved(matrix, np.array([[2.0, 4.0], [1.0, 0.0]]))
    assert found[0].tolist() == [1.0, 1.0]
    assert np.isnan(found[1]).all()


@pytest.mark.parametrize(
    ("linkage", "unknowns", "closures"),
    [(four_bar(), 2, 1), (six_bar(), 4, 2), (slider_crank(), 2, 1), (whitworth(), 4, 2)],
)
def test_two_equations_a_loop(linkage: object, unknowns: int, closures: int) -> None:
    found = loops(linkage)  # type: ignore[arg-type]
    assert (found.unknowns, len(found.closures)) == (unknowns, closures)
    assert found.equations == found.unknowns


def test_bodies_that_slide_share_their_angle() -> None:
    found = loops(slider_crank())
    names = found.linkage.names
    assert not found.angles[names.index("slider")].weights.any()
    assert found.names == ("coordinate of O", "angle of rod", "slide of guide")


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
    found = loops(replace(base, driver="B"))
    assert found.names[0] == "coordinate of B"
