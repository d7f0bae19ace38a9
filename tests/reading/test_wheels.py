"""The wheel of `[flywheel]` in a scene: what it becomes, and every fault in it."""

from __future__ import annotations

import pytest

import flywheel
from flywheel.components.wheel_stresses import MATERIALS, material
from flywheel.components.wheels import WheelAsked
from flywheel.reading.scenes import load
from flywheel.reference import text
from flywheel.scene.scene import Inertia


def wheel(**keys):
    """The wheel of a scene with some keys in `[flywheel]`."""
    return scene(**keys).wheel


def scene(**keys):
    load_ = {"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}
    return load(
        {
            "load": [load_],
            "drive": {"torque": "balance"},
            "regime": {"speed": "300 rpm"},
            "flywheel": {"irregularity": 0.01} | keys,
        }
    )


def faults(**keys):
    with pytest.raises(flywheel.SceneError) as error:
        wheel(**keys)
    return [str(fault) for fault in error.value.faults]


def test_no_wheel_is_asked_for():
    assert wheel() is None


def test_a_disc():
    asked = wheel(shape="disc", material="carbon steel", outer_radius="300 mm", step="0.5 kg m^2")
    steel = MATERIALS["carbon steel"]
    assert asked == WheelAsked("disc", steel, outer_radius=0.3, step=0.5, path="flywheel")


def test_every_key():
    """Each key of the wheel arrives where it belongs."""
    asked = wheel(
        shape="arms",
        density="7.2 t/m^3",
        allowable_stress="7.5 MPa",
        strength="150 MPa",
        poisson=0.25,
        method="thin",
        at="mean",
        rim_speed="25 m/s",
        width="200 mm",
        arms=8,
        arm_width="120 mm",
        arm_thickness="50 mm",
        bore="80 mm",
        hub_diameter="180 mm",
        hub_length="210 mm",
        torque="2 kN m",
        size_step="5 mm",
    )
    own = material(density=7200.0, allowable=7.5e6, strength=150e6, poisson=0.25)
    sizes = {"rim_speed": 25.0, "width": 0.2, "arms": 8, "arm_width": 0.12, "arm_thickness": 0.05}
    hub = {"bore": 0.08, "hub_diameter": 0.18, "hub_length": 0.21, "torque": 2000.0, "size_step": 0.005}
    assert asked == WheelAsked("arms", own, method="thin", at="mean", path="flywheel", **sizes, **hub)


def test_the_other_keys():
    asked = wheel(shape="rim", material="alloy steel", safety=5, mean_radius=0.4, thickness="2 cm", rim_share="90 %")
    assert asked.material.allowable == 130e6
    assert (asked.mean_radius, asked.thickness, asked.rim_share) == (0.4, 0.02, 0.9)
    lightest = wheel(shape="lightest", material="aluminium", max_radius=0.4, width_to_thickness=3, bore=0.05, arm_share=0.3)
    assert (lightest.max_radius, lightest.width_to_thickness, lightest.arm_share) == (0.4, 3.0, 0.3)


def test_a_given_inertia_may_have_a_wheel_too():
    found = load('regime.speed = 10\n[flywheel]\ninertia = "2 kg m^2"\nshape = "disc"\ndensity = 7000\nwidth = 0.1')
    assert found.inertia == 2.0
    assert found.wheel.width == 0.1


@pytest.mark.parametrize(
    ("keys", "wanted"),
    [
        (
            {"outer_radius": 0.3},
            ["flywheel.shape: found nothing, expected a shape (disc, rim, arms, lightest) beside outer_radius"],
        ),
        ({"shape": "disk", "density": 7000, "width": 1}, ['flywheel.shape: found "disk", expected one of "disc", "rim"']),
        (
            {"shape": "disc", "material": "steel", "width": 1},
            ['flywheel.material: found "steel", expected one of "grey cast iron"'],
        ),
        ({"shape": "disc", "width": 1}, ["flywheel.material: found neither material nor density"]),
        ({"shape": "disc", "density": 7000, "safety": 2, "width": 1}, ["flywheel.safety: found a safety factor without"]),
        ({"shape": "disc", "density": 7000}, ["flywheel: found none of outer_radius, rim_speed, max_radius, width"]),
        (
            {"shape": "disc", "density": 7000, "width": 1, "outer_radius": 1},
            ["flywheel: found outer_radius and width, expected exactly one of"],
        ),
        (
            {"shape": "rim", "density": "7000 kg", "width": "1 kg", "bore": -1},
            ['flywheel.density: found "7000 kg"', 'flywheel.width: found "1 kg"', "flywheel.bore: found -1"],
        ),
        (
            {"shape": "rim", "density": 7000, "widht": 1},
            ['flywheel.widht: found key "widht", expected a known key; did you mean'],
        ),
        (
            {"shape": "arms", "density": 7000, "outer_radius": 1, "arms": 2.5},
            ["flywheel.arms: found 2.5, expected a value at least 3"],
        ),
        (
            {"shape": "arms", "density": 7000, "outer_radius": 1, "bore": 0.1, "arms": 4.5},
            ["flywheel.arms: found 4.5, expected a whole number from 3 to 100"],
        ),
        (
            {"shape": "disc", "density": 7000, "width": 0.1, "torque": 5, "thickness": 0.1},
            ["flywheel.thickness: found thickness of a disc", "flywheel.torque: found torque of a disc"],
        ),
    ],
)
def test_faults(keys, wanted):
    found = faults(**keys)
    assert len(found) == len(wanted)
    for fault, words in zip(sorted(found), sorted(wanted), strict=True):
        assert fault.startswith(words)


def test_the_reference_has_the_table_of_materials():
    for name, found in MATERIALS.items():
        row = next(line for line in text("wheel").splitlines() if line.startswith(f"| `{name}`"))
        cells = [cell.strip() for cell in row.split("|")[2:7]]
        usual = "" if found.rim_speed is None else f"{found.rim_speed:g}"
        numbers = [found.density, found.strength / 1e6, found.allowable / 1e6, found.poisson]
        assert cells == [*(f"{number:g}" for number in numbers), usual]


# GD², in place of an inertia: a mass or a weight times a square

REST = "regime.speed = 10\n"


def text_faults(text_):
    with pytest.raises(flywheel.SceneError) as caught:
        load(text_)
    return [(fault.path, fault.found) for fault in caught.value.faults]


@pytest.mark.parametrize(
    ("given", "inertia"),
    [
        ("48", 12.0),
        ("'48 kg m^2'", 12.0),
        ("'48 kgf m^2'", 12.0),
        ("'48 kgf·m²'", 12.0),
        ("'470.7192 N m^2'", 12.0),
        ("'0.48 kN m^2'", 480 / 9.80665 / 4),
        ("'1000 lb ft^2'", 250 * 0.45359237 * 0.3048**2),
        ("'1000 lbf ft^2'", 250 * 0.45359237 * 0.3048**2),
        ("'8 lbf in s^2'", 2 * 0.45359237 * 9.80665 * 0.0254),
        ("'8 N m s^2'", 2.0),
        ("'480000 kg cm^2'", 12.0),
        ("0", 0.0),
    ],
)
def test_a_given_flywheel_by_its_gd2(given, inertia):
    found = load(f"{REST}flywheel.gd2 = {given}")
    assert found.inertia == pytest.approx(inertia, rel=1e-14)
    assert found.irregularity is None


def test_an_added_inertia_by_its_gd2():
    found = load(REST + "flywheel.inertia = 1\n[[inertia]]\non = 'crank'\ngd2 = '3 kgf m^2'")
    assert found.inertias == (Inertia("crank", 0.75, "inertia[0]"),)


def test_gd2_and_inertia_are_one_machine():
    machine = {"load": [{"on": "crank", "torque": -90, "from": 0, "to": "90 deg"}], "drive": {"torque": "balance"}}
    machine["regime"] = {"speed": "300 rpm"}
    by_inertia, by_gd2 = ({**machine, "flywheel": {key: value}} for key, value in (("inertia", 2.5), ("gd2", "10 kg m^2")))
    figures = [flywheel.size(load(scene), simulate=False).simulation for scene in (by_inertia, by_gd2)]
    assert figures[0] == figures[1]


@pytest.mark.parametrize(
    ("given", "path", "found"),
    [
        ("flywheel = {gd2 = -1}", "flywheel.gd2", "-1"),
        ("flywheel = {gd2 = '-1 kgf m^2'}", "flywheel.gd2", '"-1 kgf m^2"'),
        ("flywheel = {gd2 = '48 kg m'}", "flywheel.gd2", '"48 kg m"'),
        ("flywheel = {gd2 = '48 kgf m'}", "flywheel.gd2", '"48 kgf m"'),
        ("flywheel = {gd2 = '48'}", "flywheel.gd2", '"48"'),
        ("flywheel = {gd2 = true}", "flywheel.gd2", "true"),
        ("flywheel = {gd2 = [4]}", "flywheel.gd2", "a list"),
        ("flywheel = {gd2 = 1, inertia = 2}", "flywheel", "inertia and gd2"),
        ("flywheel = {gd2 = 1, irregularity = 0.1}", "flywheel", "irregularity and gd2"),
        ("flywheel.inertia = 1\ninertia = [{on = 'crank', gd2 = 1, value = 2}]", "inertia[0]", "value and gd2"),
        ("flywheel.inertia = 1\ninertia = [{on = 'crank', gd2 = '1 m'}]", "inertia[0].gd2", '"1 m"'),
        ("flywheel.inertia = 1\ninertia = [{on = 'crank'}]", "inertia[0].value", "nothing"),
    ],
)
def test_faulty_gd2(given, path, found):
    assert text_faults(REST + given) == [(path, found)]


def test_what_translates_has_no_gd2():
    mechanism = "[mechanism]\ntype = 'scotch-yoke'\ncrank.length = 1\n"
    scene = REST + "flywheel.inertia = 1\ninertia = [{on = 'yoke', gd2 = 1}]\n" + mechanism
    assert text_faults(scene) == [("inertia[0].gd2", 'a GD² on "scotch-yoke.yoke", which translates')]
