"""Every fault of a linkage's description is told in a line, before anything is solved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flywheel.mechanisms.linkages.equations import check
from flywheel.mechanisms.linkages.positions import solve, solve_over
from flywheel.mechanisms.linkages.reactions import Motion, chain_reactions, reactions, reactions_at, virtual_power
from flywheel.mechanisms.linkages.wrenches import Force
from flywheel.numerics.faults import SceneError
from flywheel.scene.linkage import Coupling, Joint, Lift, Link, Linkage, Point
from tests.linkages.linkages import CASES, O, four_bar, pin

BASE = four_bar()


def link(**changes):
    """The four-bar with its crank changed."""
    return replace(BASE, links=(BASE.links[0]._replace(**changes), *BASE.links[1:]))


def joint(**changes):
    """The four-bar with its pin A changed."""
    return replace(BASE, joints=(BASE.joints[0], BASE.joints[1]._replace(**changes), *BASE.joints[2:]))


def coupling(**changes):
    """The four-bar with a coupling, which as such is sound."""
    return replace(BASE, couplings=(Coupling("mesh", "gear", "O", "A")._replace(**changes),))


def side(**changes):
    """The four-bar with its side changed."""
    return replace(BASE, sides=(BASE.sides[0]._replace(**changes),))


FAULTS = [
    (replace(BASE, driver="X"), 'driver: found "X", expected one of O, A, B, D'),
    (replace(BASE, driver=None), "driver: found nothing, expected one of O, A, B, D"),
    (replace(BASE, joints=()), 'driver: found "O", expected one of none'),
    (replace(BASE, start=np.nan), "start: found nan, expected a finite number"),
    (replace(BASE, links=list(BASE.links)), "links: found a value of type list, expected a tuple of Link"),
    (replace(BASE, joints=BASE.joints[0]), "joints: found a value of type Joint, expected a tuple of Joint"),
    (replace(BASE, joints=("A",)), 'joints[0]: found "A", expected a Joint'),
    (replace(BASE, ground=None), "ground: found nothing, expected a Link"),
    (link(name="coupler"), 'links[1].name: found "coupler", expected a name of its own; another has it already'),
    (link(name="frame"), 'links[0].name: found "frame", expected a name of its own; another has it already'),
    (link(name=""), 'links[0].name: found "", expected a name'),
    (link(name=["crank"]), "links[0].name: found a value of type list, expected a name"),
    (link(points=[O]), "links[0].points: found a value of type list, expected a tuple of Point"),
    (link(points=((0.0, 1.0),)), "links[0].points[0]: found a value of type tuple, expected a Point"),
    (link(points=(Point("O", np.inf),)), "links[0].points[0].x: found inf, expected a finite number"),
    (link(points=(O, O)), 'links[0].points[1].name: found "O", expected a name of its own; another has it already'),
    (link(mass=-2.0), "links[0].mass: found -2.0, expected a finite number, 0 or above"),
    (link(mass=np.nan), "links[0].mass: found nan, expected a finite number, 0 or above"),
    (link(inertia="1"), 'links[0].inertia: found "1", expected a finite number, 0 or above'),
    (link(com=0.1), "links[0].com: found 0.1, expected two finite numbers, (x, y)"),
    (link(com=(np.nan, 0.0)), "links[0].com: found (nan, 0.0), expected two finite numbers, (x, y)"),
    (link(guess=np.nan), "links[0].guess: found nan, expected a finite number"),
    (joint(name="O"), 'joints[1].name: found "O", expected a name of its own; another has it already'),
    (joint(kind="pn"), 'joints[1].kind: found "pn", expected one of pin, slide, pin-in-slot, fixed; did you mean "pin"?'),
    (
        joint(first="crnk"),
        'joints[1].first: found "crnk", expected one of frame, crank, coupler, rocker; did you mean "crank"?',
    ),
    (joint(second="crank"), 'joints[1].second: found "crank", expected another body than first'),
    (joint(first_at=(0.1, 0.0)), "joints[1].first_at: found a value of type tuple, expected a Point"),
    (joint(second_at=Point("O", 0.0, np.nan)), "joints[1].second_at.y: found nan, expected a finite number"),
    (joint(friction=-0.1), "joints[1].friction: found -0.1, expected a finite number, 0 or above"),
    (joint(friction=np.nan), "joints[1].friction: found nan, expected a finite number, 0 or above"),
    (joint(radius=-1.0), "joints[1].radius: found -1.0, expected a finite number, 0 or above"),
    (joint(length=None), "joints[1].length: found nothing, expected a finite number, 0 or above"),
    (joint(direction=np.inf), "joints[1].direction: found inf, expected a finite number"),
    (joint(guess="left"), 'joints[1].guess: found "left", expected a finite number'),
    (coupling(name="A"), 'couplings[0].name: found "A", expected a name of its own; another has it already'),
    (coupling(kind="geer"), 'couplings[0].kind: found "geer", expected one of gear, rolling, cam; did you mean "gear"?'),
    (coupling(first="Z"), 'couplings[0].first: found "Z", expected one of O, A, B, D'),
    (coupling(second="O"), 'couplings[0].second: found "O", expected another joint than first'),
    (coupling(ratio=np.nan), "couplings[0].ratio: found nan, expected a finite number"),
    (coupling(kind="cam"), "couplings[0].lift: found nothing, expected a Lift"),
    (coupling(contact=("crank", "F")), 'couplings[0].contact[1]: found "F", expected one of O, E'),
    (side(point=("rockr", "E")), 'sides[0].point[0]: found "rockr", expected one of frame, crank, coupler, rocker'),
    (side(start=("crank", "F")), 'sides[0].start[1]: found "F", expected one of O, E'),
    (side(end="crank"), 'sides[0].end: found "crank", expected two names, of a body and of its point'),
    (side(sense=0), "sides[0].sense: found 0, expected +1 (left) or -1 (right)"),
]


@pytest.mark.parametrize(("linkage", "text"), FAULTS, ids=[text.split(":")[0] for _, text in FAULTS])
def test_each_fault_is_the_only_one_and_tells_its_place(linkage, text):
    with pytest.raises(SceneError) as refused:
        solve(linkage, 0.0, 1.0)
    (fault,) = refused.value.faults
    assert str(fault).startswith(f"mechanism.{text}")


def test_a_fixed_joint_neither_drives_nor_takes_part_in_a_coupling():
    fixed = replace(joint(kind="fixed"), couplings=(Coupling("mesh", "gear", "O", "A"),), driver="A")
    with pytest.raises(SceneError) as refused:
        check(fixed)
    assert [fault.path for fault in refused.value.faults] == ["mechanism.couplings[0].second", "mechanism.driver"]


@pytest.mark.parametrize("case", CASES)
def test_sound_linkages_pass(case):
    check(CASES[case][0])
    check(coupling(kind="cam", lift=Lift(None, 1.0), contact=("crank", "E")))


@pytest.mark.parametrize(
    ("low", "high", "text"),
    [
        (1.0, 0.0, "high: found 0, expected a number above low, 1"),
        (1.0, 1.0, "high: found 1, expected a number above low, 1"),
        (0.0, np.nan, "high: found nan, expected a finite number"),
        (-np.inf, 1.0, "low: found -inf, expected a finite number"),
        ("0", 1.0, 'low: found "0", expected a finite number'),
    ],
)
def test_a_range_has_a_low_and_a_high_end(low, high, text):
    with pytest.raises(SceneError, match=f"^{text}$"):
        solve(BASE, low, high)


def test_a_single_position_has_a_range_of_its_own():
    found = solve_over(BASE, 0.5)
    assert (found.low, found.high) == (0.5, 0.5)
    np.testing.assert_allclose(found.poses(0.5).value, solve(BASE, 0.0, 1.0).poses(0.5).value, rtol=0.0, atol=1e-14)
    with pytest.raises(SceneError, match=r"^q: found no position"):
        solve_over(BASE, [])


SOLUTION = solve(BASE, 0.0, 1.0)
POSES = SOLUTION.poses([0.2, 0.4])
ARM = Linkage(Link("frame", (O,)), (Link("mast", (O,)),), (pin("foot", "frame", "mast"),), "foot")


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: solve(None, 0.0, 1.0), "linkage: found nothing, expected a Linkage"),
        (lambda: SOLUTION.poses("abc"), 'q: found "abc", expected finite numbers'),
        (lambda: SOLUTION.poses([0.1, np.nan]), "q: found a value that is not finite, expected finite numbers"),
        (lambda: SOLUTION.coordinate("C", POSES), 'joint: found "C", expected one of O, A, B, D'),
        (lambda: POSES.angle("rocke"), 'body: found "rocke", expected one of frame, crank, coupler, rocker; did you mean'),
        (lambda: POSES.point("X", O), 'body: found "X", expected one of frame'),
        (lambda: POSES.point("crank", "E"), 'at: found "E", expected a Point'),
        (lambda: POSES.point("crank", 3), "at: found 3, expected a Point"),
        (lambda: reactions_at(POSES, 1.0, drivers=["Q"]), r'drivers\[0\]: found "Q", expected one of O, A, B, D'),
        (lambda: reactions_at(POSES, 1.0, drivers="O"), 'drivers: found "O", expected a list'),
        (lambda: reactions_at(SOLUTION, 1.0), "poses: found a value of type Solution, expected Poses"),
        (lambda: POSES.centre("X"), 'body: found "X", expected one of frame'),
        (lambda: reactions(POSES, 0.2, 1.0), "source: found a value of type Poses, expected a Linkage, or a Solution"),
        (lambda: reactions(SOLUTION, "abc", 1.0), 'q: found "abc", expected finite numbers'),
        (lambda: reactions(SOLUTION, [[0.2], [0.4]], 1.0), r"q: found an array of shape \(2, 1\), expected a number or"),
        (lambda: reactions(SOLUTION, [], 1.0), "q: found no position"),
        (lambda: reactions(SOLUTION, 0.2, "20"), 'speed: found "20", expected finite numbers'),
        (lambda: reactions(SOLUTION, 0.2, 1.0, gravity=9.81), "gravity: found 9.81, expected two numbers, along x and y"),
        (lambda: reactions(SOLUTION, 0.2, 1.0, gravity=(0, np.nan)), "gravity: found a value that is not finite"),
        (lambda: reactions(SOLUTION, 0.2, 1.0, loads=Force("crank", "E")), "loads: found a value of type Force, expected"),
        (lambda: reactions(SOLUTION, 0.2, 1.0, loads=[("crank", "E", 1)]), r"loads\[0\]: found a value of type tuple"),
        (lambda: reactions(SOLUTION, 0.2, 1.0, loads=[Force("crank", 3)]), r"loads\[0\].at: found 3, expected two numbers"),
        (lambda: virtual_power(SOLUTION), "reactions: found a value of type Solution, expected Reactions"),
        (lambda: chain_reactions(ARM, {"foot": 1.0}), "motions.foot: found 1.0, expected a Motion"),
        (lambda: chain_reactions(ARM, {"foot": Motion("1")}), 'motions.foot.value: found "1", expected finite numbers'),
        (lambda: chain_reactions(ARM, {"foot": Motion(0.0)}, np.zeros((2, 2))), "time: found an array of shape"),
    ],
)
def test_arguments_of_another_type_are_refused(call, text):
    with pytest.raises(SceneError, match=f"^{text}"):
        call()


def test_several_faults_are_told_at_once():
    o = Point("o")
    pivot = Joint("pivot", "pin", "frame", "crnk", o, o, friction=-0.1)
    with pytest.raises(SceneError) as refused:
        check(Linkage(Link("frame", (o,)), (Link("crank", (o,), mass=-1.0),), (pivot,), "pivt"))
    assert [fault.path.split(".", 1)[1] for fault in refused.value.faults] == [
        "links[0].mass",
        "joints[0].second",
        "joints[0].friction",
        "driver",
    ]
