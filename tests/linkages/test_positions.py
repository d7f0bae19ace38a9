"""Linkages described, checked and assembled; open chains."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import pi, tau

import numpy as np
import pytest
from numpy.typing import NDArray

from flywheel import SceneError
from flywheel.mechanisms.law import followed
from flywheel.mechanisms.linkage import enclosed
from flywheel.mechanisms.linkages.assembly import assembled, assemblies, gruebler, kutzbach
from flywheel.mechanisms.linkages.equations import WINDOW, Equations, check, lift_at, lift_bound, loops
from flywheel.mechanisms.linkages.positions import solve, solve_over
from flywheel.mechanisms.linkages.reactions import (
    Motion,
    chain_poses,
    chain_reactions,
    driving_actions,
    reactions,
    reactions_at,
    virtual_power,
)
from flywheel.mechanisms.linkages.statics import Force
from flywheel.numerics.expressions import parse
from flywheel.scene.linkage import (
    FRAME,
    GEAR,
    SLIDE,
    Coupling,
    Joint,
    Lift,
    Link,
    Linkage,
    Point,
    Side,
    common_body,
    offered,
    shadowing,
    straight,
)
from flywheel.scene.scene import Output
from tests.limits import sample
from tests.linkages import forced
from tests.linkages.linkages import (
    CASES,
    SINE,
    O,
    bar,
    cam_rocker,
    four_bar,
    geared_five_bar,
    ground,
    pin,
    rolling,
    six_bar,
    slider_crank,
    whitworth,
    whole,
)

# The description of a linkage: its bodies, ports and driver's names, and that equal ones are one.


def test_bodies_and_points_by_name() -> None:
    linkage = four_bar()
    assert linkage.names == (FRAME, "crank", "coupler", "rocker")
    assert linkage.link(FRAME).point("D") == Point("D", 0.4, 0.0)
    with pytest.raises(KeyError):
        Link("bar").point("E")


def test_equal_linkages_and_lifts_are_one() -> None:
    assert hash(four_bar()) == hash(four_bar())
    assert four_bar() == four_bar() != four_bar(side=-1)
    assert Lift(SINE.curve, 1.0) == Lift(SINE.curve, 1.0) != Lift(SINE.curve, 2.0)
    assert cam_rocker() == cam_rocker()


def test_the_frame_carries_before_any_other_body() -> None:
    linkage = geared_five_bar()
    assert linkage.carrier(linkage.couplings[0]) == FRAME
    assert common_body(pin("A", "x", FRAME), pin("B", FRAME, "x")) == FRAME
    assert common_body(pin("A", "x", "y"), pin("B", "z", "y")) == "y"
    assert common_body(pin("A", "x", "y"), pin("B", "z", "w")) == ""


def test_what_slides_and_what_rubs() -> None:
    linkage = slider_crank()
    assert not linkage.sliding
    assert replace(linkage, driver="guide").sliding
    assert not linkage.rubs
    rough = tuple(joint._replace(friction=0.1) if joint.name == "guide" else joint for joint in linkage.joints)
    assert replace(linkage, joints=rough).rubs


def test_bodies_turn_and_slides_travel() -> None:
    assert offered(six_bar(), ["tool"]) == {"coupler": True, "rocker": True, "link": True, "output": True, "tool": False}
    assert offered(whitworth()) == {"rocker": True, "link": True, "slot": False, "guide": False}
    renamed = tuple(joint._replace(name="slide") if joint.name == "guide" else joint for joint in whitworth().joints)
    assert offered(replace(whitworth(), joints=renamed)) == {"rocker": True, "link": True, "slot": False, "slide": False}


def test_what_a_slide_holds_cannot_turn() -> None:
    assert straight(slider_crank().joints) == {"slider"}
    assert "slider" not in offered(slider_crank())


def test_a_driver_called_slide_is_the_element_itself() -> None:
    base = slider_crank()
    joints = tuple(j._replace(name="slide") if j.name == "guide" else j for j in base.joints)
    assert "slide" not in offered(replace(base, joints=joints, driver="slide"))


def test_names_by_which_loads_reach_the_driver() -> None:
    assert shadowing(["crank", "rod"], sliding=False) == ["crank"]
    assert shadowing(["crank", "slide"], sliding=True) == ["slide"]


# Every fault of a linkage's description is told in a line, before anything is solved.


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
    (link(name="coupler"), 'links[1].name: found "coupler", expected a unique name; another one has this name'),
    (link(name="frame"), 'links[0].name: found "frame", expected a unique name; another one has this name'),
    (link(name=""), 'links[0].name: found "", expected a name'),
    (link(name=["crank"]), "links[0].name: found a value of type list, expected a name"),
    (link(points=[O]), "links[0].points: found a value of type list, expected a tuple of Point"),
    (link(points=((0.0, 1.0),)), "links[0].points[0]: found a value of type tuple, expected a Point"),
    (link(points=(Point("O", np.inf),)), "links[0].points[0].x: found inf, expected a finite number"),
    (link(points=(O, O)), 'links[0].points[1].name: found "O", expected a unique name; another one has this name'),
    (link(mass=-2.0), "links[0].mass: found -2.0, expected a finite number, 0 or above"),
    (link(mass=np.nan), "links[0].mass: found nan, expected a finite number, 0 or above"),
    (link(inertia="1"), 'links[0].inertia: found "1", expected a finite number, 0 or above'),
    (link(com=0.1), "links[0].com: found 0.1, expected two finite numbers, (x, y)"),
    (link(com=(np.nan, 0.0)), "links[0].com: found (nan, 0.0), expected two finite numbers, (x, y)"),
    (link(guess=np.nan), "links[0].guess: found nan, expected a finite number"),
    (joint(name="O"), 'joints[1].name: found "O", expected a unique name; another one has this name'),
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
    (coupling(name="A"), 'couplings[0].name: found "A", expected a unique name; another one has this name'),
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
    result = solve_over(BASE, 0.5)
    assert (result.low, result.high) == (0.5, 0.5)
    np.testing.assert_allclose(result.poses(0.5).value, solve(BASE, 0.0, 1.0).poses(0.5).value, rtol=0.0, atol=1e-14)
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


# Gruebler's count against the rank: too many joints, too few, and joints that repeat each other.


def parallelogram(third: float = 0.2) -> Linkage:
    """Two equal cranks and a third one between them, which is one too many: at the share `third`/0.4 of the coupler."""
    frame = ground(D=(0.4, 0.0), M=(third, 0.0))
    links = (bar("crank", 0.1), bar("coupler", 0.4, guess=0.0, M=(0.2, 0.0)), bar("rocker", 0.1), bar("middle", 0.1))
    joints = (
        pin("O", FRAME, "crank"),
        pin("A", "crank", "coupler", links[0].point("E")),
        pin("B", "coupler", "rocker", links[1].point("E"), links[2].point("E")),
        pin("D", FRAME, "rocker", frame.point("D")),
        pin("M", FRAME, "middle", frame.point("M")),
        pin("N", "middle", "coupler", links[3].point("E"), links[1].point("M")),
    )
    return Linkage(frame, links, joints, "O", start=1.0)


def test_a_redundant_crank_is_named() -> None:
    result = solve(parallelogram(), 0.5, 2.5).mobility
    assert (result.gruebler, result.freedom) == (0, 1)
    assert all("keeps its bodies parallel" in text for text in result.redundant)
    assert {"N", "M"} & set(" ".join(result.redundant).split())


@pytest.mark.parametrize("start", [0.0, 1.0])
def test_three_cranks_in_line_turn_fully_though_two_of_them_branch(start: float) -> None:
    poses = solve(replace(parallelogram(), start=start), 0.0, tau).poses(np.linspace(0.0, tau, 61))
    np.testing.assert_allclose(np.exp(1j * poses.angle("coupler").value), 1.0, atol=1e-12)
    np.testing.assert_allclose(poses.angle("rocker").rate, 1.0, atol=1e-12)
    np.testing.assert_allclose(poses.angle("middle").slope, 0.0, atol=1e-11)


@pytest.mark.parametrize("start", [0.0, 1.0])
@pytest.mark.parametrize("idler", [False, True])
def test_a_gear_pair_carries_a_parallelogram_through_its_change_points(start: float, idler: bool) -> None:
    base = parallelogram()
    frame = ground(D=(0.4, 0.0), I=(0.2, 0.0))
    plain = replace(base, ground=frame, links=base.links[:3], joints=base.joints[:4], start=start)
    geared = replace(plain, couplings=(Coupling("belt", GEAR, "O", "D", 1.0),))
    if idler:
        wheels = Coupling("first", GEAR, "O", "I", -1.0), Coupling("second", GEAR, "I", "D", -1.0)
        wheel = Link("idler", (O,), guess=-start)
        pivot = pin("I", FRAME, "idler", frame.point("I"))
        geared = replace(plain, links=(*plain.links, wheel), joints=(*plain.joints, pivot), couplings=wheels)
    poses = solve(geared, 0.0, tau).poses(np.linspace(0.0, tau, 61))
    np.testing.assert_allclose(np.exp(1j * poses.angle("coupler").value), 1.0, atol=1e-12)
    np.testing.assert_allclose(poses.angle("rocker").rate, 1.0, atol=1e-12)


def test_three_cranks_out_of_line_turn_fully() -> None:
    base = parallelogram()
    frame = ground(D=(0.4, 0.0), M=(0.15, 0.12))
    coupler = base.links[1]._replace(points=(*base.links[1].points[:2], Point("M", 0.15, 0.12)))
    links = (base.links[0], coupler, *base.links[2:])
    places = {"M": frame.point("M"), "N": coupler.point("M")}
    joints = tuple(
        j._replace(first_at=places["M"]) if j.name == "M" else j._replace(second_at=places["N"]) if j.name == "N" else j
        for j in base.joints
    )
    solution = solve(replace(base, ground=frame, links=links, joints=joints), 0.0, tau)
    poses = solution.poses(np.linspace(0.0, tau, 61))
    np.testing.assert_allclose(np.exp(1j * poses.angle("coupler").value), 1.0, atol=1e-12)
    np.testing.assert_allclose(poses.angle("rocker").rate, 1.0, atol=1e-12)
    np.testing.assert_allclose(poses.angle("middle").slope, 0.0, atol=1e-11)
    assert solution.mobility.freedom == 1


def test_a_third_crank_out_of_place_cannot_be_assembled() -> None:
    with pytest.raises(SceneError, match="cannot be assembled"):
        solve(parallelogram(0.25), 0.5, 2.5)


@pytest.mark.parametrize(("start", "crossed"), [(0.0, False), (1.0, False), (1.0, True)])
def test_change_points_of_the_parallelogram_are_named(start: float, crossed: bool) -> None:
    base = parallelogram()
    crank, _, rocker, _ = base.links
    sides = (Side(("rocker", "E"), ("crank", "E"), (FRAME, "D"), -1 if crossed else 1),) if start == 1.0 else ()
    links = (crank, bar("coupler", 0.4), rocker)
    with pytest.raises(SceneError) as caught:
        solve(replace(base, links=links, joints=base.joints[:4], sides=sides, start=start), 0.5, 4.0)
    kind = "an antiparallelogram" if crossed else "a parallelogram"
    angle = f"{180 if start else 0} deg"
    expected = f"found {kind} (coupler, crank, frame, rocker) that branches (a change point) with the driver O at {angle}"
    assert expected in str(caught.value)
    rate = -(0.4 - 0.1) / (0.4 + 0.1) if start else -(0.4 + 0.1) / (0.4 - 0.1)  # distances of the relative pole on the line
    text = str(caught.value)
    assert "a parallelogram: coupler 0 rad, rocker 1 rad per rad of the driver; or an antiparallelogram: coupler" in text
    assert f"rocker {rate:.4g} rad per rad" in text
    assert "a gear pair, or a third crank" in text


def test_two_guides_of_one_slider() -> None:
    base = slider_crank()
    twice = replace(base, joints=(*base.joints, Joint("rail", SLIDE, FRAME, "slider", Point("G", 0.0, 0.02), O)))
    result = solve(twice, 0.0, tau).mobility
    assert (result.gruebler, result.freedom) == (-1, 1)
    assert any("rail" in text for text in result.redundant)
    assert len(result.redundant) == 2


def test_too_few_joints() -> None:
    base = geared_five_bar()
    with pytest.raises(SceneError, match=r"2 degrees of freedom \(Gruebler 2\): with the driver held, angle of"):
        solve(replace(base, couplings=()), 0.0, tau)


def test_too_many_joints() -> None:
    base = four_bar()
    extra = replace(
        base,
        links=(*base.links, Link("strut", (O, Point("E", 0.42)))),
        joints=(*base.joints, pin("S", FRAME, "strut"), pin("T", "strut", "rocker", Point("E", 0.42), Point("E", 0.15))),
    )
    with pytest.raises(SceneError, match=r"loop .* stays open by .*; Gruebler's count is 0 .* a joint may be too many"):
        solve(extra, 0.0, tau)
    assert gruebler(extra) == 0


# Mechanisms in space: Kutzbach's count against the rank of the joints' screws where a mechanism stands.


Array = NDArray[np.float64]


def turning(axis: tuple[float, float, float], at: tuple[float, float, float]) -> Array:
    """The screw of a revolute joint: its unit axis, and the velocity that turning about it gives the origin."""
    unit = np.array(axis) / np.linalg.norm(axis)
    return np.concatenate((unit, np.cross(at, unit)))


def ball(at: tuple[float, float, float]) -> list[Array]:
    return [turning(axis, at) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]


def sliding(axis: tuple[float, float, float]) -> Array:
    return np.concatenate((np.zeros(3), np.array(axis) / np.linalg.norm(axis)))


def bennett(a: float, alpha: float, beta: float, theta: float) -> list[Array]:
    """The four axes of Bennett's linkage at a crank angle: links a, b with twists, a/sin alpha = b/sin beta."""
    b = a * np.sin(beta) / np.sin(alpha)
    other = 2.0 * np.arctan(np.sin((beta + alpha) / 2.0) / np.sin((beta - alpha) / 2.0) / np.tan(theta / 2.0))
    screws, frame = [], np.eye(4)
    for angle, length, twist in zip((theta, other, -theta, -other), (a, b, a, b), (alpha, beta, alpha, beta), strict=True):
        screws.append(turning(frame[:3, 2], frame[:3, 3]))
        (c, s), (u, v) = (np.cos(angle), np.sin(angle)), (np.cos(twist), np.sin(twist))
        frame = frame @ np.array(
            [[c, -s * u, s * v, length * c], [s, c * u, -c * v, length * s], [0, v, u, 0], [0, 0, 0, 1]]
        )
    np.testing.assert_allclose(frame, np.eye(4), atol=1e-12)  # the loop closes
    return screws


X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
ENDS = (0.3, 0.1, 0.5), (1.1, 0.7, 0.2)
RSSR = [turning(Z, (0.0, 0.0, 0.0)), *ball(ENDS[0]), *ball(ENDS[1])]


@pytest.mark.parametrize(
    ("count", "joints", "screws", "freedom"),
    [
        (2, "RSSR", [*RSSR, turning((1.0, 2.0, -1.0), (1.0, 0.0, 0.0))], 2),  # the coupler turns about itself
        (2, "RSSP", [*RSSR, sliding((1.0, 2.0, -1.0))], 2),
        (-1, "RRUR", [turning(X, (0.3, 1.0, 0.2)), turning(Y, (0.0, 0.2, 1.0)), turning(X, ENDS[0]), turning(Z, ENDS[0]),
                     turning((1.0, 1.0, 3.0), ENDS[1])], 0),
        (-2, "RRRR", [turning(Z, at) for at in ((0.0, 0.0, 0.0), (0.1, 0.2, 0.0), (0.7, 0.5, 0.0), (0.9, 0.0, 0.0))], 1),
        (-2, "RRRR", [turning(axis, (0.0, 0.0, 0.0)) for axis in (Z, (1.0, 0.0, 2.0), (1.0, 1.0, 0.3), X)], 1),  # Hooke
        (-2, "RRRR", bennett(0.3, 0.7, 1.1, 0.9), 1),
    ],
    ids=["RSSR", "RSSP", "RRUR", "four-bar", "Hooke", "Bennett"],
)  # fmt: skip
def test_the_count_in_space_is_that_of_the_screws_less_their_rank_unless_constraints_repeat(count, joints, screws, freedom):
    assert kutzbach(4, joints) == count == len(screws) - 6
    assert len(screws) - np.linalg.matrix_rank(np.array(screws), tol=1e-9) == freedom >= count


def test_platforms_and_loops_by_hand():
    assert (
        kutzbach(14, 6 * "UPS") == kutzbach(14, 6 * [2, 1, 3]) == 6
    )  # Stewart's platform, its base and plate and 12 half legs
    assert kutzbach(14, 6 * "SPS") == 12  # with balls at both ends each leg turns about itself
    assert kutzbach(2, "C") == kutzbach(2, "U") == 2
    assert kutzbach(4, "RCCC") == kutzbach(4, [1, 2, 2, 2]) == 1
    assert kutzbach(4, "RRRP", order=3) == 1
    assert kutzbach(4, "RRRR", order=3) == 1  # Hooke's joint turns about one point
    assert kutzbach(1, "") == 0


@pytest.mark.parametrize(
    ("arguments", "options", "says"),
    [
        ((0, "R"), {}, "bodies: found 0, expected a whole number, 1 or above"),
        ((2, "RX"), {}, r"joints\[1\]: found X, expected one of R, P, H, C, U, S, E, or its number of freedoms from 0 to 5"),
        ((2, [6]), {}, r"joints\[0\]: found 6"),
        ((4, "RRRS"), {"order": 3}, r"joints\[3\]: found S, expected one of R, P, or its number of freedoms from 0 to 2"),
        ((4, "R"), {"order": 4}, "order: found 4, expected 6 in space, or 3 in a plane"),
    ],
)
def test_a_count_of_no_mechanism_is_refused(arguments, options, says):
    with pytest.raises(SceneError, match=says):
        kutzbach(*arguments, **options)


# Every assembly is found, and the choice among them is never silent.


def unguessed(linkage: Linkage) -> Linkage:
    """The linkage without guesses and sides."""
    return replace(linkage, links=tuple(link._replace(guess=None) for link in linkage.links), sides=())


@pytest.mark.parametrize(
    ("linkage", "count"),
    [(four_bar(), 2), (slider_crank(), 2), (six_bar(), 4), (whitworth(), 2), (geared_five_bar(), 2), (cam_rocker(), 2)],
)
def test_finds_all_assemblies(linkage: Linkage, count: int) -> None:
    equations = Equations(loops(unguessed(linkage)))
    result = assemblies(equations)
    assert len(result) == count
    assert np.abs(equations.residual(result, equations.bases(result))).max() < 1e-10


def test_without_a_guess_the_assemblies_are_listed() -> None:
    with pytest.raises(SceneError) as caught:
        assembled(Equations(loops(unguessed(four_bar()))))
    text = str(caught.value)
    assert "2 assemblies that fit with O at 0 deg" in text
    assert text.count("coupler") == 2
    assert "guess or side" in text


def test_a_guess_between_two_assemblies_is_refused() -> None:
    base = unguessed(four_bar())
    result = assemblies(Equations(loops(base)))
    middle = float(np.angle(np.exp(1j * result[:, 1]).sum()))
    crank, coupler, rocker = base.links
    doubtful = replace(base, links=(crank, coupler._replace(guess=middle + 0.02), rocker))
    with pytest.raises(SceneError, match="guesses that fit several assemblies"):
        assembled(Equations(loops(doubtful)))


@pytest.mark.parametrize("off", [-0.5, 0.5])
def test_a_rough_guess_takes_the_nearest(off: float) -> None:
    base = unguessed(four_bar())
    result = assemblies(Equations(loops(base)))
    crank, coupler, rocker = base.links
    for z in result:
        guessed = replace(base, links=(crank, coupler._replace(guess=float(z[1]) + off), rocker))
        chosen = assembled(Equations(loops(guessed)))
        assert abs((chosen[1] - z[1] + pi) % (2 * pi) - pi) < 1e-9


def test_sides_choose() -> None:
    left, right = (assembled(Equations(loops(four_bar(side=side)))) for side in (1, -1))
    assert left[2] > 0.0
    assert abs(left[2] + right[2]) < 1e-9


def test_sides_that_contradict() -> None:
    base = four_bar()
    side = base.sides[0]
    with pytest.raises(SceneError, match=r"assembly: found sides that no assembly fits"):
        assembled(Equations(loops(replace(base, sides=(side, Side(*side[:3], -side.sense))))))


def test_bars_that_do_not_reach() -> None:
    with pytest.raises(SceneError) as caught:
        assembled(Equations(loops(four_bar(d=2.0))))
    result = "bodies that cannot be assembled at any angle of O, expected loops that close"
    gap = "nearest with O at 0 deg: the loop O - A - B - D stays open by 1.25 m"
    assert str(caught.value) == f"mechanism: found {result}; {gap}"
    with pytest.raises(SceneError, match=r"with O at 90 deg, .*stays open by 0\.0923 m; change a length"):
        assembled(Equations(loops(replace(four_bar(d=0.4, r=0.1, c=0.1, length=0.22), start=pi / 2))))
    with pytest.raises(SceneError, match=r"with O at 0 deg, .*stays open by 0\.05 m; change a length, or `start`"):
        assembled(Equations(loops(four_bar(r=0.3, length=0.2))))


@pytest.mark.parametrize("seed", sample(range(12), 4))
def test_bars_drawn_at_random_that_never_reach_stay_open_by_what_the_longest_is_too_long(seed: int) -> None:
    """At their nearest all bars lie in line, whichever is the longest; at any crank angle the third side is open."""
    rng = np.random.default_rng(seed)
    short = rng.uniform(0.05, 0.4, 3)
    bars = rng.permutation([*short, sum(short) * rng.uniform(1.05, 2.0)])
    r, c, length, d = (float(bar) for bar in bars)
    result = open_by(four_bar(d, r, c, length))
    assert result == pytest.approx(2 * max(bars) - sum(bars), rel=6e-3)
    if max(d, r) == max(bars):
        start = float(rng.uniform(0.0, tau))
        apart = abs(d - r * np.exp(1j * start)) - c - length
        turned_away = replace(four_bar(d, r, c, length), start=start)
        assert open_by(turned_away) == pytest.approx(result)  # of all angles, not of the one it starts from
        assert apart >= result * (1.0 - 6e-3)


def open_by(linkage: Linkage) -> float:
    """The gap (m) of a linkage that closes at no angle of its driver, as it is reported."""
    with pytest.raises(SceneError, match="cannot be assembled at any angle of O") as caught:
        assembled(Equations(loops(linkage)))
    return float(str(caught.value).split("stays open by ")[1].split(" m")[0])


@pytest.mark.parametrize(("side", "guess"), [(-1, 60.0), (1, -60.0)])
def test_a_guess_on_the_other_branch_than_the_side_contradicts_it(side: int, guess: float) -> None:
    base = four_bar(side=side)
    crank, coupler, rocker = base.links
    guessed = replace(base, links=(crank, coupler._replace(guess=np.radians(guess)), rocker))
    with pytest.raises(SceneError) as caught:
        assembled(Equations(loops(guessed)))
    text = str(caught.value)
    assert "mechanism.assembly: found guesses for another assembly than that of the sides (angle of coupler)" in text
    kept = replace(guessed, links=(crank, coupler._replace(guess=np.radians(-guess)), rocker))
    assert assembled(Equations(loops(kept))) == pytest.approx(assembled(Equations(loops(base))), abs=1e-12)


def test_a_start_in_a_singular_position() -> None:
    flat = replace(slider_crank(0.1, 0.1, 0.0), start=pi / 2)
    with pytest.raises(SceneError, match=r"branches \(a change point\) with the driver O at 90 deg"):
        assembled(Equations(loops(flat)))


def test_guesses_that_contradict_each_other() -> None:
    base = unguessed(six_bar())
    result = assemblies(Equations(loops(base)))
    first = result[0]
    other = next(z for z in result[1:] if np.allclose(z[1:3], first[1:3]))
    expected = {"coupler": first[1], "rocker": first[2], "link": first[3], "output": other[4]}
    guesses = {name: float(value) for name, value in expected.items()}
    links = tuple(link._replace(guess=guesses.get(link.name)) for link in base.links)
    with pytest.raises(SceneError, match=r"for another assembly than the rest \(angle of|do not tell the assemblies apart"):
        assembled(Equations(loops(replace(base, links=links))))


@pytest.mark.parametrize("ratio", [-1.0, 0.5])
@pytest.mark.parametrize("phase", [-150.0, 30.0, 690.0])
def test_gears_hold_their_relation_and_the_side_is_kept(ratio: float, phase: float) -> None:
    base = unguessed(geared_five_bar(ratio, phase * pi / 180))
    side = Side(("left", "E"), ("crank", "E"), ("second", "E"), 1)
    solution = solve(replace(base, sides=(side,)), 0.0, 1.0)
    phi = np.linspace(0.0, 1.0, 7)
    poses = solution.poses(phi)
    second = ratio * phi + phase * pi / 180
    np.testing.assert_allclose(np.exp(1j * poses.angle("second").value), np.exp(1j * second), atol=1e-12)
    a, b = 0.08 * np.exp(1j * phi), 0.3 + 0.06 * np.exp(1j * second)
    along = (0.3**2 - 0.28**2 + abs(b - a) ** 2) / (2 * abs(b - a))
    c = a + (b - a) / abs(b - a) * (along + 1j * np.sqrt(0.3**2 - along**2))
    np.testing.assert_allclose(np.exp(1j * poses.angle("left").value), (c - a) / abs(c - a), atol=1e-12)


def geared_arm(ratio: float, guess: float | None) -> Linkage:
    """A four-bar whose rocker drives an arm on a pivot of the frame by a gear pair."""
    base = four_bar()
    arm = Link("arm", (O, Point("E", 0.1)), guess=guess)
    joints = (*base.joints, pin("W", FRAME, "arm", Point("W", 0.6, 0.1)))
    return replace(base, links=(*base.links, arm), joints=joints, couplings=(Coupling("pair", GEAR, "D", "W", ratio),))


def test_turns_of_a_geared_rocker_are_counted_within_half_a_turn_unless_guessed() -> None:
    rocker = float(solve(four_bar(), 0.0, 1.0).poses([0.0]).angle("rocker").value[0])
    rocker = (rocker + pi) % (2 * pi) - pi
    plain = solve(geared_arm(0.5, None), 0.0, 1.0).poses([0.0]).angle("arm").value[0]
    assert plain == pytest.approx(0.5 * rocker, abs=1e-12)
    other = solve(geared_arm(0.5, 0.5 * rocker + pi), 0.0, 1.0).poses([0.0]).angle("arm").value[0]
    assert np.exp(1j * other) == pytest.approx(np.exp(1j * (0.5 * rocker + pi)), abs=1e-12)


@pytest.mark.parametrize("guess", [1.9, 1.9 + 4 * pi])
def test_angles_start_within_half_a_turn_of_their_guesses(guess: float) -> None:
    base = unguessed(four_bar())
    crank, coupler, rocker = base.links
    solution = solve(replace(base, links=(crank, coupler, rocker._replace(guess=guess))), 0.0, 1.0)
    assert abs(solution.poses([0.0]).angle("rocker").value[0] - guess) < pi


@pytest.mark.parametrize("make", [six_bar, whitworth, geared_five_bar, cam_rocker, four_bar])
def test_every_assembly_is_chosen_by_its_own_angles(make: Callable[[], Linkage]) -> None:
    base = unguessed(make())
    result = Equations(loops(base))
    for z in assemblies(result):
        angles = {name.removeprefix("angle of "): float(v) for name, v in zip(result.loops.names, z, strict=True)}
        links = tuple(link._replace(guess=angles.get(link.name)) for link in base.links)
        chosen = assembled(Equations(loops(replace(base, links=links))))
        np.testing.assert_allclose(np.exp(1j * chosen), np.exp(1j * z), atol=1e-9)


def test_a_small_pinion_turns_as_often_as_its_rack_asks() -> None:
    base, radius = rolling(), 0.004
    links = tuple(link._replace(guess=None) for link in base.links)
    joints = tuple(j._replace(guess=0.39) if j.name == "guide" else j for j in base.joints)
    pair = base.couplings[0]._replace(ratio=radius, phase=-0.967)
    solution = solve(replace(base, links=links, joints=joints, couplings=(pair,)), 0.0, 1.0)
    poses = solution.poses([0.0])
    slide = float(solution.coordinate("guide", poses).value[0])
    assert slide == pytest.approx(0.1 + np.sqrt(0.09 - 0.02**2), abs=1e-12)
    assert poses.angle("pinion").value[0] == pytest.approx((slide + 0.967) / radius, rel=1e-12)


# Bounds of positions over stretches, and of a cam's lift near every angle: they hold, and are not far above the truth.


def lift(text: str) -> Lift:
    """A lift as a scene would have it, with breakpoints where it is narrow."""
    return Lift(followed(Output("lift", False, parse(text), 0.0), tau, {}, "lift"), tau)


def with_lift(text: str) -> Linkage:
    base = cam_rocker()
    return replace(base, couplings=(base.couplings[0]._replace(lift=lift(text)),))


def bump(height: float, width: float) -> str:
    return f"0.02*(1 - cos(phi)) + {height}*exp(-((phi - 2.0005)/{width})**2)"


@pytest.mark.parametrize("text", ["0.02*(1 - cos(2*phi))", bump(1e-3, 0.05), bump(1e-4, 1e-3)])
def test_bounds_hold_and_are_not_absurd(text: str) -> None:
    law = lift(text)
    angle = np.concatenate((np.linspace(0.0, tau, 4001), 2.0005 + np.linspace(-4e-3, 4e-3, 2001)))
    second = np.abs(lift_at(law, angle)[2])
    h = 1e-7
    third = np.abs(lift_at(law, angle + h)[2] - lift_at(law, angle - h)[2]) / (2 * h)
    for order, values in ((2, second), (3, third)):
        limit = lift_bound(law, angle, order)
        assert (values <= limit * (1 + 1e-6) + 1e-6 * values.max()).all()
        assert limit.max() < 40 * values.max()
    far = lift_bound(law, np.array([5.0]), 2)[0]
    assert far < 1.0


def test_a_bound_looks_as_far_as_the_window() -> None:
    law = lift(bump(1e-4, 1e-3))
    near, beyond = lift_bound(law, np.array([2.0005 - 0.9 * WINDOW, 2.0005 - 2 * WINDOW]), 2)
    assert near > 50.0 > beyond


@pytest.mark.parametrize("width", sample([2e-4, 1e-2], 2))
def test_enclosures_hold_on_a_narrow_bump(width: float) -> None:
    solution = solve(with_lift(bump(width / 50, width)), 0.0, 2.2)
    low = 2.0005 + width * np.linspace(-4.0, 4.0, 21)
    result = enclosed(solution, low, low + width / 50)
    for share in (0.0, 0.3, 1.0):
        moved = solution.movement(low + share * width / 50)
        for (middle, reach), value in zip(result, moved, strict=True):
            assert (np.abs(value - middle) <= reach).all()


@pytest.mark.slow
def test_a_bump_that_the_bar_cannot_follow_locks() -> None:
    with pytest.raises(SceneError, match=r"locks with the driver O at 11[34]\."):
        solve(with_lift(bump(0.3, 5e-3)), 0.0, 2.2)


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("width", sample([1e-1, 1e-2, 1e-4], 2))
def test_holds_every_position_of_the_stretch(case: str, width: float) -> None:
    solution = whole(case)
    low = np.linspace(0.0, tau - width, 20)
    result = enclosed(solution, low, low + width)
    for share in (0.0, 0.3, 1.0):
        moved = solution.movement(low + share * width)
        for (middle, reach), value in zip(result, moved, strict=True):
            assert (np.abs(value - middle) <= reach).all()


@pytest.mark.parametrize("case", CASES)
def test_narrow_stretches_are_tight(case: str) -> None:
    solution = whole(case)
    low = np.linspace(0.0, tau - 1e-6, 60)
    (_, z_reach), _, (slope, slope_reach) = enclosed(solution, low, low + 1e-6)
    scale = np.abs(slope).max()
    assert np.isfinite(slope_reach).all()
    assert z_reach.max() < 1e-5
    assert slope_reach.max() < 1e-3 * max(scale, 1.0) * (50 if "cam" in case else 1)


def test_too_wide_a_stretch_is_left_open() -> None:
    solution = solve(slider_crank(0.1, 0.1001, 0.0), 0.0, tau)
    (_, reach), *_ = enclosed(solution, np.array([1.0]), np.array([2.0]))
    assert np.isinf(reach[:, 1:]).all()
    assert reach[0, 0] == pytest.approx(0.5)


# Open chains: positions, velocities, accelerations, and as many driving actions as degrees of freedom.


TIME = np.linspace(0.0, 2.0, 11)
G = 9.81


def arm() -> Linkage:
    frame = forced.ground()
    upper, lower = forced.bar("upper", 0.5, 3.0), forced.bar("lower", 0.4, 2.0)
    joints = forced.pin("shoulder", frame, "o", upper), forced.pin("elbow", upper, "end", lower)
    return Linkage(frame, (upper, lower), joints, "shoulder")


def robot() -> Linkage:
    """A turning column, a telescope in it, a hand welded to that, a finger on a pin whose first body is the finger."""
    frame = forced.ground(base=(0.1, 0.2))
    column, telescope = forced.bar("column", 0.3, 2.0), forced.bar("telescope", 0.4, 1.0)
    hand, finger = forced.bar("hand", 0.1, 0.5), forced.bar("finger", 0.15, 0.2)
    joints = (
        forced.pin("knuckle", finger, "o", hand, "end"),
        forced.Joint("weld", "fixed", "telescope", "hand", telescope.point("end"), hand.point("o"), angle=0.7),
        forced.slide("reach", column, "end", telescope, "o", direction=0.3, angle=0.2),
        forced.pin("turn", frame, "base", column),
    )
    return Linkage(frame, (column, telescope, hand, finger), joints, "turn")


def courses(t=TIME):
    return {
        "turn": Motion(np.sin(t), np.cos(t), -np.sin(t)),
        "reach": Motion(0.1 + 0.05 * t**2, 0.1 * t, 0.1 + 0 * t),
        "knuckle": Motion(0.4 * t, 0.4 + 0 * t, 0.0),
    }


def test_velocities_and_accelerations_are_those_of_the_positions():
    eps = 1e-5
    now, before, after = (chain_poses(robot(), courses(TIME + d), TIME + d) for d in (0.0, -eps, eps))
    np.testing.assert_allclose(now.rate, (after.value - before.value) / (2 * eps), atol=1e-9)
    np.testing.assert_allclose(now.slope, (after.rate - before.rate) / (2 * eps), atol=1e-9)


def test_joints_hold():
    poses = chain_poses(robot(), courses(), TIME)
    for joint in robot().joints:
        first, second = poses.point(joint.first, joint.first_at).value, poses.point(joint.second, joint.second_at).value
        gap = second - first
        if joint.kind == "slide":
            angle = poses.angle("column").value + 0.3
            gap -= np.asarray(courses()["reach"].value) * np.stack((np.cos(angle), np.sin(angle)))
        np.testing.assert_allclose(gap, 0.0, atol=1e-15)
    np.testing.assert_allclose(poses.angle("hand").value - poses.angle("telescope").value, 0.7)
    np.testing.assert_allclose(poses.angle("hand").value - poses.angle("finger").value, 0.4 * TIME)


def test_two_link_arm_has_the_torques_of_lagranges_equations():
    """Its equations with m1, c1 (complex: centre in the link's frame), l1, J1 and so on, written out by angle of link."""
    q1, q2 = 0.3 + np.sin(2 * TIME), 1.0 + 0.5 * TIME
    v1, v2 = 2 * np.cos(2 * TIME), 0.5 + 0 * TIME
    a1, a2 = -4 * np.sin(2 * TIME), 0 * TIME
    pull = 15.0
    result = chain_reactions(
        arm(),
        {"shoulder": Motion(q1, v1, a1), "elbow": Motion(q2, v2, a2)},
        TIME,
        gravity=(0.0, -G),
        loads=[Force("lower", "end", pull, 0.0)],
    )
    upper, lower = arm().links
    m1, m2, j1, j2, l1, l2 = upper.mass, lower.mass, upper.inertia, lower.inertia, 0.5, 0.4
    c1, c2 = complex(*upper.com), complex(*lower.com)
    a, b = q1, q1 + q2  # angles of both links; T = ½ A a'² + ½ B b'² + C a' b' cos(b - a + gamma)
    big_a, big_b, big_c, gamma = j1 + m1 * abs(c1) ** 2 + m2 * l1**2, j2 + m2 * abs(c2) ** 2, m2 * l1 * abs(c2), np.angle(c2)
    va, vb, aa, ab = v1, v1 + v2, a1, a1 + a2
    lean = b - a + gamma
    of_a = big_a * aa + big_c * (ab * np.cos(lean) - vb**2 * np.sin(lean))
    of_b = big_b * ab + big_c * (aa * np.cos(lean) + va**2 * np.sin(lean))
    of_a += G * (m1 * (c1 * np.exp(1j * a)).real + m2 * l1 * np.cos(a)) + pull * l1 * np.sin(a)
    of_b += G * m2 * (c2 * np.exp(1j * b)).real + pull * l2 * np.sin(b)
    np.testing.assert_allclose(result.actions["shoulder"], of_a + of_b, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(result.actions["elbow"], of_b, rtol=1e-11, atol=1e-11)


def test_the_routes_agree_for_many_drives():
    result = chain_reactions(robot(), courses(), TIME, gravity=(1.0, -G), loads=[Force("finger", "end", 5.0, TIME)])
    by_hand = sum(result.actions[name] * np.asarray(motion.speed) for name, motion in courses().items())
    np.testing.assert_allclose(result.power, by_hand, atol=1e-12)
    other = virtual_power(result)
    for joint, parts in other.items():
        for part, value in parts.items():
            mine = result.actions[joint] if part == "drive" else result.components[joint][part]
            np.testing.assert_allclose(mine, value, rtol=0, atol=1e-10 * 50)
    unit = [{n: Motion(m.value, float(n == name)) for n, m in courses().items()} for name in result.actions]
    coefficients = [chain_poses(robot(), motions, TIME) for motions in unit]
    for mine, value in zip(result.actions.values(), driving_actions(coefficients, result.others), strict=True):
        np.testing.assert_allclose(mine, value, rtol=0, atol=1e-11 * 50)


def test_the_table_goes_by_time():
    result = chain_reactions(robot(), courses(), TIME)
    lines = result.table().splitlines()
    assert lines[1].split("  ")[1] == "time (s)"
    assert all(f"{name} (N" in lines[1] for name in courses())
    assert result.csv().startswith("time (s),knuckle.drive (N m),reach.drive (N),turn.drive (N m),")


def test_what_is_no_open_chain_is_refused():
    with pytest.raises(SceneError, match="closes a loop"):
        chain_poses(forced.four_bar(), {}, TIME)
    with pytest.raises(SceneError, match=r"elbow: found no motion"):
        chain_poses(arm(), {"shoulder": Motion(0.0)}, TIME)
    with pytest.raises(SceneError, match=r"motions.wrist"):
        chain_poses(arm(), {"shoulder": Motion(0.0), "elbow": Motion(0.0), "wrist": Motion(0.0)}, TIME)
    with pytest.raises(SceneError, match=r"motions.elbow.speed"):
        chain_poses(arm(), {"shoulder": Motion(0.0), "elbow": Motion(0.0, [1.0, 2.0])}, TIME)
    loose = Linkage(arm().ground, arm().links, (arm().joints[1], arm().joints[1]._replace(name="twice")), "elbow")
    with pytest.raises(SceneError, match="open chain"):
        chain_poses(loose, {"elbow": Motion(0.0), "twice": Motion(0.0)}, TIME)
