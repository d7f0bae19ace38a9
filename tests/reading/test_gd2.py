"""GD² in scenes: in place of an inertia, as a mass or a weight times a square."""

import pytest

import flywheel
from flywheel.numerics.faults import SceneError
from flywheel.reading.scenes import load
from flywheel.scene.scene import Inertia

REST = "regime.speed = 10\n"


def faults(text):
    with pytest.raises(SceneError) as caught:
        load(text)
    return [(fault.path, fault.found) for fault in caught.value.faults]


@pytest.mark.parametrize(
    ("text", "inertia"),
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
def test_a_given_flywheel_by_its_gd2(text, inertia):
    scene = load(f"{REST}flywheel.gd2 = {text}")
    assert scene.inertia == pytest.approx(inertia, rel=1e-14)
    assert scene.irregularity is None


def test_an_added_inertia_by_its_gd2():
    scene = load(REST + "flywheel.inertia = 1\n[[inertia]]\non = 'crank'\ngd2 = '3 kgf m^2'")
    assert scene.inertias == (Inertia("crank", 0.75, "inertia[0]"),)


def test_gd2_and_inertia_are_one_machine():
    machine = {"load": [{"on": "crank", "torque": -90, "from": 0, "to": "90 deg"}], "drive": {"torque": "balance"}}
    machine["regime"] = {"speed": "300 rpm"}
    by_inertia, by_gd2 = ({**machine, "flywheel": {key: value}} for key, value in (("inertia", 2.5), ("gd2", "10 kg m^2")))
    figures = [flywheel.size(load(scene), simulate=False).simulation for scene in (by_inertia, by_gd2)]
    assert figures[0] == figures[1]


@pytest.mark.parametrize(
    ("text", "path", "found"),
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
def test_faulty_gd2(text, path, found):
    assert faults(REST + text) == [(path, found)]


def test_what_translates_has_no_gd2():
    mechanism = "[mechanism]\ntype = 'scotch-yoke'\ncrank.length = 1\n"
    scene = REST + "flywheel.inertia = 1\ninertia = [{on = 'yoke', gd2 = 1}]\n" + mechanism
    assert faults(scene) == [("inertia[0].gd2", 'a GD² on "scotch-yoke.yoke", which translates')]
