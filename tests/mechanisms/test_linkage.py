"""Linkages as chains: the same gains as their poses have, the same machines as the named types, turns and strokes."""

from __future__ import annotations

from dataclasses import replace
from math import pi, tau
from typing import Any

import numpy as np
import pytest

import flywheel
from flywheel.mechanisms.families import Family, build
from flywheel.mechanisms.linkage import linkage_of
from flywheel.mechanisms.linkages.positions import solve
from flywheel.numerics.faults import SceneError
from flywheel.numerics.intervals import NAMESPACE, Interval
from flywheel.scene.linkage import Lift, Linkage
from flywheel.scene.scene import Mechanism, PointPort, Scene
from tests.limits import sample
from tests.linkages.linkages import CASES, SINE, cam_rocker, geared_five_bar, six_bar, slider_crank
from tests.mechanisms.chains import shaper, walked

PSI = np.array([0.2, 1.3, 2.9, 4.4, 6.0])


def heavy(linkage: Linkage) -> Linkage:
    """The linkage with masses, inertias and centres of mass off every line."""
    links = tuple(
        link._replace(mass=1.0 + k, inertia=0.01 * (k + 1), com=(0.03 * k - 0.02, 0.01 + 0.02 * k))
        for k, link in enumerate(linkage.links)
    )
    return replace(linkage, links=links)


def made(linkage: Linkage, **changes: Any) -> Mechanism:
    return Mechanism("linkage", "m", linkage=linkage, **changes)


def block_on_a_rocker() -> Linkage:
    """A shaper whose block is placed along the rocker that it slides on, not by the crank's pin."""
    linkage = linkage_of(shaper(0.1, 0.4))
    return replace(linkage, joints=tuple(sorted(linkage.joints, key=lambda joint: joint.name == "pivot")))


ALL = {name: linkage for name, (linkage, _) in CASES.items()} | {"+": block_on_a_rocker()}


@pytest.mark.parametrize("linkage", sample([pytest.param(linkage, id=name) for name, linkage in ALL.items()], 2))
def test_gains_inertia_and_ports_are_those_of_the_poses(linkage: Linkage) -> None:
    linkage = heavy(linkage)
    family = build(made(linkage))
    gains = {name: (gain + 0 * PSI, slope + 0 * PSI) for name, (gain, slope) in walked(family, PSI).items()}
    poses = solve(linkage, 0.0, tau).poses(PSI)
    inertia = np.zeros_like(PSI)
    for link in linkage.links:
        angle, centre = poses.angle(link.name), poses.centre(link.name)
        inertia += link.mass * (centre.rate**2).sum(axis=0) + link.inertia * angle.rate**2
        if link.name in gains and link.name != "crank":
            np.testing.assert_allclose(gains[link.name][0], angle.rate, atol=1e-12)
            np.testing.assert_allclose(gains[link.name][1], angle.slope, atol=1e-11)
        for axis, name in enumerate("xy"):
            rate, slope = gains.get(f"{link.name}.com.{name}", (0.0 * PSI, 0.0 * PSI))
            np.testing.assert_allclose(rate, centre.rate[axis], atol=1e-12)
            np.testing.assert_allclose(slope, centre.slope[axis], atol=1e-11)
    found = sum(mass.value * gains[mass.velocity][0] ** 2 for mass in family.masses)
    np.testing.assert_allclose(found, inertia, rtol=1e-13)
    for port in family.ports.values():
        low, high = (port.position(family.position(PSI + h, np, PSI)) for h in (-1e-4, 1e-4))
        np.testing.assert_allclose((high - low) / 2e-4, gains[port.velocity][0], atol=2e-6)


def test_port_at_a_point_along_a_direction() -> None:
    linkage = six_bar()
    family = build(made(linkage, points=(PointPort("tool", "rocker", "F", 0.7),)))
    poses = solve(linkage, 0.0, tau).poses(PSI).point("rocker", linkage.link("rocker").point("F"))
    along = np.array([np.cos(0.7), np.sin(0.7)])
    port = family.ports["tool"]
    np.testing.assert_allclose(port.position(family.position(PSI, np)), along @ poses.value, atol=1e-14)
    np.testing.assert_allclose(walked(family, PSI)["tool"][0], along @ poses.rate, atol=1e-13)


def test_a_point_that_does_not_move_is_no_port() -> None:
    with pytest.raises(SceneError, match=r"ports\.tool: found slider\.O, which does not move along 90 deg"):
        build(made(slider_crank(), points=(PointPort("tool", "slider", "O", pi / 2),)))


def test_intervals_hold_the_positions() -> None:
    family = build(made(six_bar()))
    low = np.linspace(0.0, 6.2, 30)
    cells = family.position(Interval(low, low + 0.03), NAMESPACE, low + 0.015)
    for name, port in family.ports.items():
        bounds = port.position(cells)
        for share in (0.0, 0.4, 1.0):
            value = port.position(family.position(low + 0.03 * share, np))
            assert np.all(bounds.contains(value)), name


def test_angles_gain_a_turn_each_turn() -> None:
    family = build(made(geared_five_bar(-2.0)))
    second = family.ports["second"]
    ends = [float(second.position(family.position(np.array(q), np))) for q in (0.5, 0.5 + tau)]
    assert ends[1] - ends[0] == pytest.approx(-2 * tau)
    assert not second.returns
    assert family.ports["left"].returns


def test_the_last_single_positions_are_kept_and_arrays_are_not() -> None:
    at = build(made(geared_five_bar(-2.0))).position
    first, other = at(0.3, np, 0.5), at(0.4, np, 0.5)
    assert at(0.3, np, 0.5) is first
    assert at(0.4, np, 0.5) is other
    assert at(0.3, np, 7.0) is not first
    for k in range(4):
        at(1.0 + k, np, 0.5)
    assert at(0.3, np, 0.5) is not first
    table = np.array([0.3])
    assert at(table, np) is not at(table, np)


def test_psi_is_brought_into_the_anchor_s_turn() -> None:
    family = build(made(geared_five_bar(-2.0)))
    near, far = (family.position(q, np, anchor) for q, anchor in ((0.3, 0.5), (0.3 + 3 * tau, 0.5 + 3 * tau)))
    left, second = family.ports["left"], family.ports["second"]
    assert abs(float(left.position(near)) - float(left.position(far))) < 1e-13
    assert abs(float(second.position(near)) - 6 * tau - float(second.position(far))) < 1e-12


def test_a_ratio_that_needs_two_turns() -> None:
    half = geared_five_bar(0.5, 0.7)
    family = build(made(half, travel=2 * tau))
    left = family.ports["left"]
    values = [float(left.position(family.position(np.array(q), np))) for q in (0.5, 0.5 + tau, 0.5 + 2 * tau)]
    assert values[2] == pytest.approx(values[0], abs=1e-12)
    assert abs(values[1] - values[0]) > 1e-3
    with pytest.raises(SceneError, match=r"does not return after 1 turn .* it returns after 2: set regime\.cycle"):
        build(made(half))


def test_a_body_called_crank_must_turn_with_the_driver() -> None:
    base = slider_crank()
    names = {"crank": "arm", "rod": "crank"}
    links = tuple(link._replace(name=names.get(link.name, link.name)) for link in base.links)
    joints = tuple(j._replace(first=names.get(j.first, j.first), second=names.get(j.second, j.second)) for j in base.joints)
    with pytest.raises(SceneError, match=r"bodies\.crank: found a body called crank that does not turn with the driver"):
        build(made(replace(base, links=links, joints=joints)))


def test_cells_shorten_close_to_a_lock() -> None:
    wide, near = (build(made(slider_crank(0.1, length, 0.0))) for length in (0.3, 0.100001))
    assert len(near.breakpoints) > 10 > len(wide.breakpoints)
    assert min(abs(angle - pi / 2) for angle in near.breakpoints) < 0.01


def test_cam_breaks_where_its_lift_does() -> None:
    class Broken:
        breakpoints = (0.0, 2.0)
        jet = SINE.curve.jet

    base = cam_rocker()
    lift = base.couplings[0]._replace(lift=Lift(Broken(), SINE.period))
    family = build(made(replace(base, couplings=(lift,))))
    assert min(abs(angle - 2.0) for angle in family.breakpoints) < 1e-12


def test_a_sliding_driver() -> None:
    base = heavy(slider_crank(0.1, 0.3, 0.0))
    crank, rod, slider = base.links
    pushed = replace(base, links=(crank._replace(name="arm", guess=0.5), rod, slider), driver="guide", start=0.35)
    joints = tuple(
        j._replace(first=j.first.replace("crank", "arm"), second=j.second.replace("crank", "arm")) for j in pushed.joints
    )
    pushed = replace(pushed, joints=joints)
    family = build(made(pushed, stroke=(0.25, 0.39)))
    x = np.array([0.26, 0.3, 0.38])
    gains = walked(family, x)
    turned = walked(build(made(base)), solve(pushed, 0.25, 0.39).poses(x).angle("arm").value)
    np.testing.assert_allclose(gains["arm"][0], 1 / turned["guide"][0], rtol=1e-11)
    np.testing.assert_allclose(gains["arm"][1], -turned["guide"][1] / turned["guide"][0] ** 3, rtol=1e-10)
    assert gains["guide"] == (1.0, 0.0)
    assert family.ports["guide"].position(family.position(x, np)).tolist() == x.tolist()


def test_sizes_like_the_named_type() -> None:
    rod = {"length": 0.3, "mass": 2.0, "inertia": 0.01, "com": 0.05, "com_angle": 0.3}
    lengths = {"crank": {"length": 0.1}, "rod": rod, "slider": {"offset": 0.02}}
    named = flywheel.load(
        {
            "mechanism": {"type": "slider-crank", "name": "m", **lengths},
            "gravity": {},
            "load": [{"on": "m.slider", "force": "-40 * sign(v)"}],
            "drive": {"torque": "balance"},
            "regime": {"speed": 20},
            "flywheel": {"irregularity": 0.02},
        }
    )
    linkage = linkage_of(named.mechanisms[0])
    loads = tuple(load._replace(on="m.guide") for load in named.loads)
    built: Scene = replace(named, mechanisms=(made(linkage),), loads=loads)
    first, second = (flywheel.size(scene, simulate=False) for scene in (named, built))
    assert second.flywheel.exact == pytest.approx(first.flywheel.exact, rel=1e-11)
    assert second.balance.value == pytest.approx(first.balance.value, rel=1e-11)


def test_every_family_has_positions_at_single_angles() -> None:
    family: Family = build(made(six_bar()))
    alone = family.ports["output"].position(family.position(1.0, np))
    assert np.shape(alone) == ()
    assert float(alone) == float(family.ports["output"].position(family.position(np.array([1.0]), np))[0])


def test_redundant_constraints_are_told_with_the_sizing() -> None:
    bodies = {
        "crank": {"points": {"A": [0.1, 0]}, "inertia": 0.1},
        "rod": {"points": {"B": [0.3, 0]}, "mass": 1.0, "guess": 0.0},
        "ram": {"mass": 4.0},
    }
    joints = [
        {"name": "O", "type": "pin", "between": ["frame.origin", "crank.origin"]},
        {"name": "A", "type": "pin", "between": ["crank.A", "rod.origin"]},
        {"name": "B", "type": "pin", "between": ["rod.B", "ram.origin"]},
        {"name": "ram", "type": "slide", "between": ["frame.origin", "ram.origin"]},
        {"name": "rail", "type": "slide", "between": ["frame.origin", "ram.origin"]},
    ]
    mechanism = {"type": "linkage", "driver": "O", "bodies": bodies, "joints": joints}
    scene = flywheel.load({"mechanism": mechanism, "regime": {"speed": 20}, "flywheel": {"irregularity": 0.1}})
    messages = flywheel.size(scene, simulate=False).messages
    assert any("linkage has redundant constraints (Gruebler counts -1, not 1)" in m and "rail" in m for m in messages)
