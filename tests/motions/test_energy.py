"""Kinetic energy and what springs store."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import flywheel
from flywheel import SceneError, cycle_shares, reduce, shares
from flywheel.mechanisms.linkages.equations import Poses
from flywheel.scene.linkage import Joint, Link, Linkage, Point
from tests import scenes
from tests.scenes import press, shaper, yoke

# Quinn's shares: from velocities, of a named mechanism and its linkage, over the cycle, refused at a standstill.


PHI = np.linspace(0.05, 6, 23)
R, L, COM = 0.1, 0.3, 0.12
MASSES = {"crank": (1.5, 0.02, 0.03), "rod": (2.0, 0.015, COM), "slider": (3.0, 0.0, 0.0)}  # m, J, com


def crank_scene(**changes):
    bodies = {name: {"mass": m, "inertia": j, "com": com} for name, (m, j, com) in MASSES.items()}
    bodies["slider"] = {"mass": MASSES["slider"][0]}
    mechanism = {"type": "slider-crank", **bodies}
    mechanism["crank"]["length"], mechanism["rod"]["length"] = R, L
    return flywheel.load({"mechanism": mechanism, "regime": {"speed": 10}, "flywheel": {"inertia": 0}} | changes)


def bare_yoke(**changes):
    mechanism = {"type": "scotch-yoke", "crank": {"length": 0.5}, "yoke": {"mass": 20}} | changes
    return flywheel.load({"mechanism": mechanism, "regime": {"speed": 1}, "flywheel": {"inertia": 0}})


def slider_crank(q):
    """Poses of the slider-crank in closed form: crank, rod and slider with the rod's frame at the crank's pin."""
    q = np.asarray(q, dtype=float)
    zero, s, c = 0 * q, np.sin(q), np.cos(q)
    lean = -np.arcsin(R * s / L)
    rate = -R * c / (L * np.cos(lean))
    slope = (R * s / L + np.sin(lean) * rate**2) / np.cos(lean)
    x = R * c + L * np.cos(lean)
    x1 = -R * s - L * np.sin(lean) * rate
    x2 = -R * c - L * (np.cos(lean) * rate**2 + np.sin(lean) * slope)
    o, i = Point("O"), Point("A", R)
    links = tuple(Link(n, (o, i), m, j, (com, 0.0)) for n, (m, j, com) in MASSES.items())
    joints = (Joint("O", "pin", "frame", "crank", o, o),)
    linkage = Linkage(Link("frame", (o,)), links, joints, "O")
    still = [zero] * 3
    return Poses(
        linkage,
        q,
        np.array([still, [zero, zero, q], [R * c, R * s, lean], [x, zero, zero]]),
        np.array([still, [zero, zero, zero + 1], [-R * s, R * c, rate], [x1, zero, zero]]),
        np.array([still, still, [-R * c, -R * s, slope], [x2, zero, zero]]),
    )


@pytest.mark.parametrize("scene", scenes.ALL.values())
def test_shares_sum_to_one(scene):
    loaded = flywheel.load(scene())
    result = shares(loaded, PHI, flywheel=2.0)
    assert_allclose(sum(result.values()), 1.0, rtol=1e-14)
    assert all((share >= 0).all() for share in result.values())


def by_velocities(poses):
    """The shares (m |g_G|² + J g²)/I* of the links of a linkage, from velocities written out."""
    links = poses.linkage.links
    centres, angles = ([at(link.name).rate for link in links] for at in (poses.centre, poses.angle))
    parts = [
        link.mass * (g**2).sum(axis=0) + link.inertia * turn**2 for link, g, turn in zip(links, centres, angles, strict=True)
    ]
    return {link.name: part / sum(parts) for link, part in zip(links, parts, strict=True)}


def test_shares_are_those_of_velocities_written_out():
    result = by_velocities(slider_crank(PHI))
    for name, share in shares(crank_scene(), PHI).items():
        assert_allclose(result[name.partition(".")[2]], share, rtol=1e-12, atol=1e-15)


def test_loads_and_balance_do_not_matter():
    """A scene whose net work is not zero has shares all the same."""
    loaded = crank_scene(load=[{"on": "slider", "force": -100}, {"on": "crank", "torque": 5}])
    assert_allclose(shares(loaded, PHI)["slider-crank.rod"], shares(crank_scene(), PHI)["slider-crank.rod"])


def test_a_flywheel_takes_its_share_at_its_own_shaft():
    geared = crank_scene(shafts={"fast": {"ratio": 3}}, flywheel={"on": "fast", "inertia": 0})
    whole = flywheel.reduce(geared, PHI).inertia + 9 * 0.5
    assert_allclose(shares(geared, PHI, flywheel=0.5)["the flywheel"], 9 * 0.5 / whole, rtol=1e-13)


def test_the_cycle_by_another_quadrature():
    result = cycle_shares(crank_scene(), rtol=1e-11)
    assert result.error <= 1e-11
    assert sum(body.mean for body in result.bodies.values()) == pytest.approx(1.0, abs=1e-13)
    exact = by_velocities(slider_crank(np.arange(400) * np.pi / 200))  # the mean of a periodic function converges fast
    for name, body in result.bodies.items():
        assert body.mean == pytest.approx(exact[name.partition(".")[2]].mean(), abs=1e-12)


def test_extremes_are_the_greatest_and_least_on_a_fine_grid():
    scene = crank_scene()
    grid = np.linspace(0, 2 * np.pi, 20001)
    for name, share in shares(scene, grid).items():
        body = cycle_shares(scene).bodies[name]
        assert share.max() - 1e-12 <= body.greatest <= share.max() + 1e-7
        assert share.min() - 1e-7 <= body.least <= share.min() + 1e-12
        at = shares(scene, [body.greatest_at, body.least_at])[name]
        assert_allclose(at, [body.greatest, body.least], atol=1e-14)


def test_a_slow_machine_shares_as_a_fast_one():
    """Every body's own energy over its own part of I* gives the same speed."""
    scene = crank_scene()
    state = flywheel.reduce(scene, PHI)
    result = shares(scene, PHI)
    for omega in (0.1, 400.0):
        energy = 0.5 * state.inertia * omega**2
        crank = np.sqrt(2 * result["slider-crank.crank"] * energy / state.inertia_parts["slider-crank.crank"])
        assert_allclose(crank, omega, rtol=1e-13)


@pytest.mark.parametrize("degrees", [0.0, 180.0, 360.0])
def test_a_dead_centre_without_inertia_is_named(degrees):
    angles = np.radians([30.0, degrees])
    with pytest.raises(SceneError, match=rf"mechanism: found no body with mass that moves at {degrees % 360:g} deg"):
        shares(bare_yoke(), angles)
    assert shares(bare_yoke(), angles[1], flywheel=1e-3)["the flywheel"] == 1.0


def test_close_to_a_dead_centre_a_yoke_alone_has_all_energy():
    assert shares(bare_yoke(), 1e-7)["scotch-yoke.yoke"] == 1.0


@pytest.mark.parametrize(("phase", "degrees"), [(0.0, "0 deg"), (0.7, "139.89")])
def test_a_cycle_through_a_standstill_is_refused(phase, degrees):
    scene = bare_yoke()
    turned = replace(scene, mechanisms=(replace(scene.mechanisms[0], phase=phase),))
    with pytest.raises(SceneError, match=f"moves at {degrees}"):
        cycle_shares(turned)


def test_a_machine_without_mass_is_refused():
    with pytest.raises(SceneError, match="no body with mass"):
        shares(bare_yoke(yoke={}), PHI)


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda scene: shares(scene, [np.nan]), "phi: found a value that is not finite"),
        (lambda scene: shares(scene, "abc"), 'phi: found "abc"'),
        (lambda scene: shares(None, 1.0), "machine: found nothing, expected a Machine, or a Scene"),
        (lambda scene: shares(scene, 1.0, flywheel="1"), 'flywheel: found "1"'),
        (lambda scene: cycle_shares(scene, rtol="1"), 'rtol: found "1"'),
        (lambda scene: shares(scene, 1.0, flywheel=-1.0), "flywheel: found -1.0 kg m²"),
        (lambda scene: cycle_shares(scene, rtol=0.0), "rtol: found 0.0"),
    ],
)
def test_refusals(call, text):
    with pytest.raises(SceneError, match=text):
        call(crank_scene())


# Energy in every store: its slope is the force that the store exerts, and a machine left alone keeps the sum.


EXAMPLES = Path(__file__).parents[2] / "examples"


def clamp():
    scene = tomllib.loads((EXAMPLES / "machines" / "injection_clamp.toml").read_text(encoding="utf-8"))
    springs = [{"on": "platen", "stiffness": 3e4, "rest": 0.4}, {"on": "slide", "stiffness": 500}]
    return scene | {"spring": [*springs, {"on": "rod", "stiffness": 20, "rest": 0.1}]}


SCENES = {
    "press": press(spring=[{"on": "slider", "stiffness": 700, "rest": 0.2}, {"on": "rod", "stiffness": 30}]),
    "shaper": shaper(gravity={}, spring=[{"on": "ram", "stiffness": 900, "rest": 0.1}, {"on": "rocker", "stiffness": 40}]),
    "yoke": yoke(gravity={"direction": 0.3}, spring=[{"on": "yoke", "stiffness": 900, "rest": 0.1}]),
    "clamp": clamp(),
}


@pytest.mark.parametrize(
    "name", ["clamp", *(pytest.param(name, marks=pytest.mark.slow) for name in SCENES if name != "clamp")]
)
def test_its_slope_is_the_stores_own_moment(name):
    scene = flywheel.load(SCENES[name])
    low, high = (scene.origin, scene.origin + scene.cycle)
    phi = np.linspace(low, high, 9)[1:-1]
    step = 1e-4 * (high - low)
    ahead, behind = (flywheel.stored_energy(scene, phi + s * step).potential for s in (1, -1))
    parts = reduce(scene, phi, balance=0.0).moment_parts
    for store, before in behind.items():
        slope = (ahead[store] - before) / (2 * step)
        moment = parts.get(store, np.zeros_like(phi))
        size = np.abs(slope).max() + 1e-6 * np.abs(before).max() / (high - low)
        np.testing.assert_allclose(-slope, moment, atol=1e-6 * size)
    assert set(ahead) >= {store for store in parts if store.startswith(("weight", "spring"))}


@pytest.mark.slow
def test_a_machine_left_alone_keeps_its_energy():
    """A slider-crank with a spring and weights, let go with 4 rad/s, for 3 s: the sum against an independent stepping."""
    alone = {
        "mechanism": SCENES["press"]["mechanism"],
        "gravity": {},
        "spring": [{"on": "slider", "stiffness": 700, "rest": 0.2}],
        "inertia": [{"on": "crank", "value": 20.0}],
    }
    scene = flywheel.load(alone)
    run = flywheel.transient(scene, start=4.0, end="3 s", rtol=1e-11)
    phi, omega = run.motion.phi, run.motion.omega
    result = flywheel.stored_energy(scene, phi, omega)
    total = result.total
    assert np.ptp(sum(result.kinetic.values())) > 10.0
    np.testing.assert_allclose(total, total[0], rtol=1e-9)


def test_energies_have_their_errors_and_the_flywheel_its_share():
    scene = flywheel.load(SCENES["press"])
    result = flywheel.stored_energy(scene, [0.3, 1.0], 7.0, flywheel=2.0)
    assert result.kinetic["the flywheel"].tolist() == [49.0, 49.0]
    assert set(result.errors) == {*result.kinetic, *result.potential}
    centre = 0.1 * np.cos(0.3) + np.sqrt(0.25 - 0.01 * np.sin(0.3) ** 2)
    true = 350 * (centre - 0.2) ** 2
    store = "spring[0] on press.slider"
    assert abs(result.potential[store][0] - true) <= result.errors[store][0] < 1e-11
    parts = reduce(scene, [0.3], balance=0.0).inertia_parts
    for body, part in parts.items():
        assert result.kinetic[body][0] == pytest.approx(0.5 * part[0] * 49.0, rel=1e-14)


def test_speeds_of_another_number_are_refused():
    with pytest.raises(SceneError, match="3 speeds, expected one, or 2"):
        flywheel.stored_energy(flywheel.load(SCENES["yoke"]), [0.0, 1.0], [1.0, 2.0, 3.0])
