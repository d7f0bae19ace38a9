"""The flywheel of a sizing on every shaft, with its wheel made wider."""

from functools import cache

import pytest

import flywheel
from flywheel.components.wheels import parts
from flywheel.tables import sizing as report
from tests import scenes

SHAFTS = {"slow": {"ratio": 0.5}, "fast": {"ratio": 4, "efficiency": 0.9}}


@cache
def sized(**given):
    wheel = {"on": "fast", "irregularity": 0.04, **given}
    return flywheel.size(flywheel.load(scenes.yoke(shafts=SHAFTS, flywheel=wheel)), simulate=False)


def test_every_shaft_s_flywheel_stores_the_same_energy():
    sizing = sized()
    rows = {row.shaft: row for row in sizing.shafts}
    assert list(rows) == ["crank", "slow", "fast"]
    assert rows["fast"].inertia == sizing.flywheel.exact
    for row in rows.values():
        assert row.energy == pytest.approx(rows["fast"].energy, rel=1e-14)
        assert row.gd2 == 4 * row.inertia
        assert row.mass is None


@pytest.mark.parametrize("shape", ["disc", "rim"])
def test_a_wheel_made_wider_has_the_inertia_of_its_shaft(shape):
    sizing = sized(shape=shape, material="carbon steel", outer_radius="0.5 m")
    wheel = sizing.built.wheel
    for row in sizing.shafts:
        body = wheel.body
        wider = body._replace(width=body.width * row.inertia / wheel.inertia)
        (part,) = parts(wider, wheel.material.density)
        assert part.inertia == pytest.approx(row.inertia, rel=1e-12)
        assert part.mass == pytest.approx(row.mass, rel=1e-12)
        assert row.radius == 0.5
        assert row.rim_speed == pytest.approx(0.5 * row.ratio * sizing.run.speed_max, rel=1e-12)


def test_the_report_says_what_the_table_holds_for():
    plain = report.text(sized())
    assert "The same flywheel on every shaft" in plain
    assert "losses in meshes" in plain
    assert "made wider" not in plain
    assert "made wider or narrower" in report.text(sized(shape="disc", material="carbon steel", outer_radius="0.5 m"))
    alone = flywheel.size(flywheel.load(scenes.yoke()), simulate=False)
    assert "every shaft" not in report.text(alone)


def test_a_wheel_that_is_rounded_up_is_compared_as_it_is_built():
    sizing = sized(shape="disc", material="carbon steel", outer_radius="0.5 m", step="5 kg m^2")
    wheel = sizing.built.wheel
    rows = {row.shaft: row for row in sizing.shafts}
    assert wheel.inertia == pytest.approx(25.0)
    assert wheel.inertia > 1.1 * sizing.flywheel.exact
    assert (rows["fast"].inertia, rows["fast"].mass) == (wheel.inertia, pytest.approx(wheel.mass, rel=1e-14))
    assert rows["crank"].gd2 == pytest.approx(4 * 16 * 25.0)
    text = " ".join(report.text(sizing).split())
    assert "Rounded up: it has 25 kg m² for 22." in text
    assert "all other figures are those of the exact inertia" in text
    assert "Rounded up" not in report.text(sized(shape="disc", material="carbon steel", outer_radius="0.5 m"))


def test_gd2_stands_beside_the_inertias():
    text = report.text(flywheel.size(flywheel.load(scenes.yoke()), simulate=False))
    assert "GD² = 4 J: 1414.09 exact, 1395.96 by the areas, 1416.91 by the torque, kg m²." in text
    given = report.text(flywheel.size(flywheel.load(scenes.yoke(flywheel={"inertia": 300})), simulate=False))
    assert any(line.split()[-3:] == ["1200", "kg", "m²"] for line in given.splitlines() if "GD²" in line)
