"""Choosing: whatever is given stays, the inertia is met, the stress is kept, the lightest is the lightest."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest
from numpy.testing import assert_allclose

from flywheel.components.wheel_stresses import MATERIALS, material
from flywheel.components.wheels import (
    Body,
    WheelAsked,
    choose,
    inertia,
    least,
    least_mass,
    rounded_down,
    rounded_up,
    stress,
    wheel_of,
)
from flywheel.numerics.faults import SceneError
from tests.limits import sample

IRON, STEEL = material("grey cast iron"), material("carbon steel")
SIZES = {
    "outer_radius": lambda wheel: wheel.body.outer,
    "mean_radius": lambda wheel: wheel.body.mean,
    "rim_speed": lambda wheel: wheel.rim_speed,
    "width": lambda wheel: wheel.body.width,
    "thickness": lambda wheel: wheel.body.thickness,
    "width_to_thickness": lambda wheel: wheel.body.width / wheel.body.thickness,
}
GIVEN = [
    ("disc", {"outer_radius": 0.6}),
    ("disc", {"rim_speed": 20.0, "bore": 0.1}),
    ("disc", {"width": 0.04, "bore": 0.2}),
    *(
        (shape, given | ({"bore": 0.08} if shape == "arms" else {}))
        for shape in ("rim", "arms")
        for given in (
            {"outer_radius": 0.8, "width_to_thickness": 1.5},
            {"mean_radius": 0.7, "thickness": 0.06},
            {"rim_speed": 25.0, "width": 0.2},
            {"mean_radius": 0.8},
            {"width": 0.15, "thickness": 0.08},
            {"width": 0.15, "width_to_thickness": 3.0},
            {"thickness": 0.05, "width_to_thickness": 3.0},
        )
    ),
]


@pytest.mark.parametrize("method", ["exact", "thin"])
@pytest.mark.parametrize(("shape", "given"), GIVEN)
def test_what_is_given_stays_and_the_inertia_is_met(shape, given, method):
    if shape == "disc" and method == "thin":
        method = "exact"
    wheel = choose(60.0, 30.0, WheelAsked(shape, IRON, method=method, **given))
    assert_allclose(wheel.inertia, 60.0, rtol=1e-12)
    assert wheel.inertia >= 60.0 * (1 - 1e-15)
    for name in given.keys() - {"bore"}:
        assert_allclose(SIZES[name](wheel), given[name], rtol=1e-12)
    assert_allclose(wheel.body.outer - wheel.body.thickness, wheel.body.inner, atol=1e-15)
    assert_allclose(wheel.mass, sum(part.mass for part in wheel.parts), rtol=1e-15)
    if shape == "arms":
        assert [part.name for part in wheel.parts] == ["rim", "arms", "hub"]
        assert wheel.body.hub == (0.08, 0.16, wheel.body.width)
        assert_allclose(wheel.body.arms.area, 0.25 * wheel.body.section, rtol=1e-13)


@pytest.mark.parametrize("method", ["exact", "thin"])
@pytest.mark.parametrize(
    ("shape", "given"),
    [
        ("rim", {"width_to_thickness": 4.0}),
        ("rim", {"width": 0.2}),
        ("rim", {"thickness": 0.05}),
        ("arms", {"width_to_thickness": 2.0, "bore": 0.1, "torque": 2000.0, "arms": 8}),
        ("arms", {"thickness": 0.1, "bore": 0.1, "arm_width": 0.2}),
    ],
)
def test_without_a_radius_stress_decides_it(shape, given, method):
    asked = WheelAsked(shape, IRON, method=method, **given)
    wheel = choose(500.0, 40.0, asked)
    assert_allclose([wheel.utilisation, wheel.safety], [1.0, 10.0], rtol=1e-9)
    assert_allclose(wheel.inertia, 500.0, rtol=1e-12)
    larger = choose(500.0, 40.0, asked._replace(outer_radius=wheel.body.outer * 1.001))
    assert larger.utilisation > 1
    assert larger.mass < wheel.mass
    assert any("above the allowable" in sentence for sentence in larger.warnings)


@pytest.mark.parametrize("bore", [None, 0.06])
@pytest.mark.parametrize(("speed", "limit"), sample([(50.0, 0.5), (300.0, 1.0), (500.0, 0.5), (700.0, 0.5)], 3))
def test_the_lightest_wheel_beats_a_grid_of_others(speed, limit, bore):
    asked = WheelAsked("lightest", STEEL, max_radius=limit, width_to_thickness=1.0, bore=bore)
    best = choose(3.0, speed, asked)
    assert best.utilisation <= 1 + 1e-12
    assert best.body.outer <= limit
    assert best.mass == min(best.compared.values())
    grid = []
    for radius in np.linspace(0.02, limit, 40):
        for shape, ratio in (("disc", None), ("rim" if bore is None else "arms", 1.0)):
            try:
                wheel = choose(
                    3.0, speed, WheelAsked(shape, STEEL, outer_radius=radius, width_to_thickness=ratio, bore=bore)
                )
            except SceneError:
                continue
            if wheel.utilisation <= 1:
                grid.append(wheel.mass)
    assert min(grid) >= best.mass * (1 - 1e-12)
    assert min(grid) < 1.2 * best.mass


def test_a_rim_wins_where_the_radius_limits_and_a_disc_where_stress_does():
    """Thin rim against solid disc: they weigh the same where (w R)² = 2 sigma/rho."""
    even = sqrt(2 * STEEL.allowable / STEEL.density)
    for factor, shape in ((0.98, "rim"), (1.02, "disc")):
        asked = WheelAsked("lightest", STEEL, max_radius=factor * even / 300.0, thickness=1e-4)
        wheel = least_mass(1.0, 300.0, asked)
        assert wheel.shape == shape
        assert_allclose(wheel.compared["rim"], STEEL.density * 300.0**2 / STEEL.allowable, rtol=2e-3)
    widest = least_mass(1.0, 300.0, WheelAsked("lightest", STEEL, max_radius=9.0))
    assert_allclose(widest.mass, (3 + 0.3) / 4 * STEEL.density * 300.0**2 / STEEL.allowable, rtol=1e-9)


def test_where_only_one_shape_can_be_made():
    tiny = least_mass(100.0, 400.0, WheelAsked("lightest", material(density=7200.0, allowable=4e6), max_radius=0.1))
    assert list(tiny.compared) == ["disc"]
    assert any("more than its diameter" in sentence for sentence in tiny.warnings)


STEP = 0.005
ROUNDED = [
    ("disc", "exact", {"outer_radius": 0.601}, ["width"]),
    ("disc", "exact", {"rim_speed": 20.0, "bore": 0.1}, ["outer_radius", "width"]),
    ("disc", "exact", {"max_radius": 0.598}, ["outer_radius", "width"]),
    ("disc", "exact", {"width": 0.041, "bore": 0.2}, ["outer_radius"]),
    ("rim", "exact", {"outer_radius": 0.801, "width_to_thickness": 1.5}, ["thickness", "width"]),
    ("rim", "thin", {"mean_radius": 0.701, "thickness": 0.061}, ["width"]),
    ("rim", "exact", {"rim_speed": 25.0, "width": 0.201}, ["outer_radius", "thickness"]),
    ("rim", "thin", {"rim_speed": 25.0}, ["mean_radius", "thickness", "width"]),
    ("rim", "exact", {"width": 0.151, "thickness": 0.081}, ["outer_radius"]),
    ("rim", "thin", {"width_to_thickness": 2.0}, ["mean_radius", "thickness", "width"]),
    ("arms", "exact", {"bore": 0.08, "max_radius": 0.933}, ["outer_radius", "thickness", "width", "arms"]),
    ("arms", "exact", {"bore": 0.08, "width_to_thickness": 3.0}, ["outer_radius", "thickness", "width", "arms"]),
]


@pytest.mark.parametrize(("shape", "method", "given", "names"), ROUNDED)
def test_rounding_up(shape, method, given, names):
    asked = WheelAsked(shape, IRON, method=method, **given)
    plain, wheel = choose(60.0, 30.0, asked), choose(60.0, 30.0, asked._replace(size_step=STEP))
    assert wheel.inertia >= 60.0 * (1 - 1e-14)
    body, on_step = wheel.body, [SIZES[name](wheel) for name in names if name != "arms"]
    on_step += [body.arms.width, body.arms.thickness] if "arms" in names else []
    assert_allclose(np.array(on_step) / STEP, np.round(np.array(on_step) / STEP), atol=1e-9)
    for name in given.keys() & {"outer_radius", "mean_radius", "width", "thickness"}:
        assert_allclose(SIZES[name](wheel), given[name], rtol=1e-12)
    if "rim_speed" in given:
        assert 0 <= plain.rim_speed - wheel.rim_speed < 30.0 * STEP
    else:
        assert wheel.utilisation <= 1 or not given.keys() <= {"max_radius", "width_to_thickness", "bore"}
    last = {"width": -STEP} if "width" in names else {"thickness": -STEP, "inner": STEP} if "thickness" in names else {}
    if last:  # one step less would not do
        less = body._replace(**{name: getattr(body, name) + change for name, change in last.items()})
        assert inertia(less, IRON.density) < 60.0


def test_inertia_goes_up_to_its_step():
    asked = WheelAsked("disc", IRON, outer_radius=0.5, step=0.25)
    assert_allclose([choose(60.01, 30.0, asked).inertia, choose(60.0, 30.0, asked).inertia], [60.25, 60.0], rtol=1e-14)
    assert choose(60.01, 30.0, asked).needed == 60.25


def test_multiples():
    assert (rounded_up(0.35, 0.05), rounded_up(0.3500001, 0.05), rounded_up(1e-9, 0.1)) == (0.35, 0.4, 0.1)
    assert (rounded_down(0.35, 0.05), rounded_down(0.3999, 0.05)) == (0.35, 0.35)


def test_the_least_float_at_which_something_holds():
    assert least(lambda x: x >= 0.3, 0.0, 1.0) == 0.3
    assert least(lambda x: False, 0.0, 1.0) is None
    assert least(lambda x: x >= 3.0, 0.5) == 3.0
    assert least(lambda x: False, 1.0) is None


@pytest.mark.parametrize(
    ("needed", "speed", "asked", "words"),
    [
        (0.0, 1.0, WheelAsked("disc", IRON, width=0.1), "needed: found 0.0 kg m², expected a finite number above 0"),
        (1.0, -1.0, WheelAsked("disc", IRON, width=0.1), "speed: found -1.0 rad/s"),
        (1.0, 1.0, WheelAsked("ring", IRON), 'shape: found "ring", expected one of disc, rim, arms, lightest'),
        (1.0, 1.0, WheelAsked("rim", "iron", width=0.1), "material: found iron, expected a Material"),
        (1.0, 1.0, WheelAsked("rim", IRON, width=-0.1), "width: found -0.1, expected a number above 0"),
        (1.0, 1.0, WheelAsked("rim", IRON), "wheel: found none of"),
        (1.0, 1.0, WheelAsked("disc", IRON), "expected exactly one of outer_radius, rim_speed, max_radius, width"),
        (1.0, 1.0, WheelAsked("disc", IRON, outer_radius=1.0, width=1.0), "found outer_radius and width"),
        (1.0, 1.0, WheelAsked("disc", IRON, thickness=0.1), "along its axis, a disc has a width"),
        (1.0, 1.0, WheelAsked("disc", IRON, width=0.1, method="thin"), "a thin rim is not a disc"),
        (1.0, 1.0, WheelAsked("rim", IRON, outer_radius=1.0, mean_radius=1.0), "outer_radius and mean_radius"),
        (1.0, 1.0, WheelAsked("rim", IRON, outer_radius=1.0, width=0.1, thickness=0.1), "one radius and one of the section"),
        (1.0, 1.0, WheelAsked("rim", IRON, width=0.1, bore=0.1), "bore of a rim without arms"),
        (1.0, 1.0, WheelAsked("rim", IRON, width=0.1, rim_share=1.2), "at most 1"),
        (1.0, 1.0, WheelAsked("rim", material(density=7e3), width=0.1), "allowable_stress: found nothing"),
        (1.0, 1.0, WheelAsked("arms", IRON, outer_radius=1.0), "expected bore or hub_diameter; the arms stand on the hub"),
        (1.0, 1.0, WheelAsked("arms", IRON, outer_radius=1.0, bore=0.1, arms=2), "whole number from 3 to 100"),
        (1.0, 1.0, WheelAsked("arms", IRON, outer_radius=1.0, bore=0.1, hub_diameter=0.1), "a diameter above the bore"),
        (1.0, 1.0, WheelAsked("arms", IRON, outer_radius=1.0, bore=0.1, arm_thickness=0.1), "arm_width beside it"),
        (1.0, 1.0, WheelAsked("arms", IRON, outer_radius=1.0, bore=0.1, arm_share=0.1, arm_width=0.1), "one or the other"),
        (1.0, 1.0, WheelAsked("lightest", IRON), "max_radius: found nothing"),
        (1.0, 1.0, WheelAsked("lightest", IRON, outer_radius=1.0), "give max_radius"),
        (1.0, 1.0, WheelAsked("lightest", IRON, max_radius=1.0, arms=4), "bore or hub_diameter"),
        (9.0, 1.0, WheelAsked("rim", IRON, outer_radius=0.1), "a rim of radius 0.1 m, expected one that can have 9 kg m"),
        (9.0, 1.0, WheelAsked("rim", IRON, mean_radius=0.1, width=0.1), "mean_radius: found a rim of mean radius 0.1 m"),
        (9.0, 1.0, WheelAsked("disc", IRON, outer_radius=0.1, bore=0.2), "a disc of radius 0.1 m"),
        (9.0, 1e4, WheelAsked("rim", IRON, width_to_thickness=1.0), "a rim under 11.5 MPa at 10000 rad/s"),
        (9.0, 1.0, WheelAsked("rim", IRON, max_radius=0.1), "a rim of at most 0.1 m under the allowable stress"),
    ],
)
def test_faults(needed, speed, asked, words):
    with pytest.raises(SceneError) as error:
        choose(needed, speed, asked)
    assert words in str(error.value)


def test_every_fault_has_the_path_of_its_scene():
    with pytest.raises(SceneError) as error:
        choose(1.0, 1.0, WheelAsked("rim", IRON, width=-0.1, thickness=0.0, path="flywheel"))
    assert [fault.path for fault in error.value.faults] == ["flywheel.width", "flywheel.thickness"]


def test_warnings():
    rim = Body("rim", 1.0, 0.7, 0.3, 0.4, thin=True, share=0.9)
    sentences = wheel_of(WheelAsked("rim", IRON, method="thin"), rim, 100.0).warnings
    assert sentences[0] == "the rim runs at 85 m/s; grey cast iron usually stays below 30 m/s"
    assert sentences[1].startswith("the stress of 52.02 MPa (rim) is above the allowable 11.5 MPa: take a smaller radius")
    assert "35% of its mean radius" in sentences[2]
    assert "0.1 of the inertia" in sentences[3]
    calm = WheelAsked("arms", IRON, outer_radius=1.0, bore=0.1)
    assert choose(60.0, 10.0, calm._replace(torque=10.0)).warnings == ()
    assert "left out" in choose(60.0, 10.0, calm).warnings[0]
    jindal = choose(2000.0, 52.36, calm._replace(outer_radius=1.275, thickness=0.15))
    assert any("usually stays below 30 m/s" in sentence for sentence in jindal.warnings)
    bent = choose(60.0, 10.0, calm._replace(torque=3000.0))
    assert bent.place == "arms at the hub"
    assert bent.warnings[0].endswith(
        "above the allowable 11.5 MPa: enlarge arm_share or hub_diameter, or take another material"
    )


def test_what_a_warning_advises_takes_the_stress_down():
    asked = WheelAsked("arms", IRON, outer_radius=1.0, bore=0.1, torque=3000.0)
    stress_of = lambda **given: choose(60.0, 10.0, asked._replace(**given)).greatest_stress  # noqa: E731
    assert stress_of(arm_share=0.5) < stress_of()
    assert stress_of(hub_diameter=0.5) < stress_of()


def test_the_lightest_wheel_warns_of_its_rim_speed_too():
    wheel = choose(1.0, 100.0, WheelAsked("lightest", material("carbon steel"), max_radius=0.5))
    assert wheel.rim_speed > 40.0
    assert any("usually stays below 40 m/s" in sentence for sentence in wheel.warnings)


def test_wheel_of_own_dimensions():
    body = Body("disc", 0.3, 0.0, 0.3, 0.05)
    wheel = wheel_of(WheelAsked("disc", material(density=7850.0, allowable=50e6)), body, 200.0)
    assert wheel.needed == wheel.inertia == inertia(body, 7850.0)
    assert wheel.stresses == stress(body, wheel.material, 200.0)
    assert (wheel.place, wheel.safety) == ("centre", 50e6 / wheel.greatest_stress)


@pytest.mark.parametrize("name", list(MATERIALS))
def test_materials_of_the_table(name):
    found = material(name)
    assert found == MATERIALS[name]
    assert 2000 < found.density < 9000
    assert found.allowable < found.strength < 1e9
    assert found.reference == found.strength


def test_own_materials():
    assert material("carbon steel", density=7800.0).allowable == MATERIALS["carbon steel"].allowable
    assert_allclose(material("grey cast iron", strength=200e6).allowable, 20e6)
    assert material("grey cast iron", allowable=5e6).strength == 115e6
    assert material(density=1e3, strength=10e6, safety=4.0).allowable == 2.5e6
    assert material(density=1e3, strength=10e6).allowable is None
    assert material(density=1e3, allowable=1e6).reference == 1e6


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({}, "material: found neither material nor density, expected one of them; known: grey cast iron"),
        ({"name": "gray cast iron"}, 'did you mean "grey cast iron"?'),
        ({"density": -1.0}, "density: found -1.0, expected a finite number above 0"),
        ({"density": 1.0, "poisson": 0.6}, "poisson: found 0.6, expected a number from 0 to 0.5"),
        ({"density": 1.0, "safety": 2.0}, "safety: found a safety factor without a strength"),
        ({"name": "carbon steel", "safety": 2.0, "allowable": 1e6}, "found safety and allowable_stress"),
    ],
)
def test_faults_of_materials(given, words):
    with pytest.raises(SceneError) as error:
        material(**given)
    assert words in str(error.value)
