"""A wheel in a report and in JSON."""

from __future__ import annotations

import json

import pytest

from flywheel.components.wheel_stresses import material
from flywheel.components.wheels import WheelAsked, choose
from flywheel.tables.flywheels import wheel_rows as rows

IRON = material("grey cast iron")
ARMED = WheelAsked("arms", IRON, outer_radius=1.0, bore=0.1, torque=100.0)


def test_rows_of_a_wheel_with_arms():
    wheel = choose(200.0, 20.0, ARMED)
    found = {name: (value, unit) for name, value, unit in rows(wheel)}
    assert found["shape"] == ("arms", "")
    assert found["outer radius"] == ("1000", "mm")
    assert found["inertia"] == ("200", "kg m²")
    assert found["arms"] == ("6", "")
    assert found["hub diameter"] == ("200", "mm")
    assert float(found["mass"][0]) == pytest.approx(wheel.mass, rel=1e-5)
    assert float(found["stress, rim at the arms"][0]) == pytest.approx(wheel.stresses["rim at the arms"] / 1e6, rel=1e-5)
    assert found["safety factor, by strength"][0].startswith(f"{wheel.safety:.4g}"[:4])
    assert {"mass, rim", "mass, arms", "mass, hub", "inertia, hub"} <= found.keys()
    assert len(found) == len(rows(wheel))


def test_rows_of_other_wheels():
    own = material(density=7000.0, allowable=5e6)
    thin = {name: value for name, value, _ in rows(choose(9.0, 20.0, WheelAsked("rim", own, "thin", width=0.1)))}
    assert thin["shape"] == "rim, taken as thin"
    assert thin["safety factor, by allowable stress"] == "1"
    assert "bore" not in thin
    bored = [name for name, _, _ in rows(choose(9.0, 20.0, WheelAsked("disc", material(density=7e3), width=0.1, bore=0.1)))]
    assert "bore" in bored
    assert not any("safety" in name or "allowable" in name or name == "thickness" for name in bored)
    lightest = [name for name, _, _ in rows(choose(9.0, 20.0, WheelAsked("lightest", own, max_radius=0.4)))]
    assert "the lightest disc instead" in lightest


def test_what_is_stressed_too_much_is_marked():
    bent = choose(200.0, 20.0, ARMED._replace(torque=20000.0))
    marked = {name for name, _, unit in rows(bent) if unit == "MPa, above the allowable"}
    assert marked == {f"stress, {place}" for place, value in bent.stresses.items() if value > 11.5e6}
    assert "stress, arms at the hub" in marked
    assert not any("above" in unit for _, _, unit in rows(choose(200.0, 5.0, ARMED)))


@pytest.mark.parametrize("asked", [ARMED, WheelAsked("disc", IRON, width=0.1), WheelAsked("lightest", IRON, max_radius=0.5)])
def test_json(asked):
    wheel = choose(20.0, 20.0, asked)
    found = json.loads(json.dumps(wheel.as_dict(), allow_nan=False))
    assert found["inertia"] == wheel.inertia
    assert found["stresses"] == dict(wheel.stresses)
    assert found["material"]["density"] == 7200.0
    assert (found["arms"] is None) == (wheel.body.arms is None)
    assert found["greatest_stress"] == max(found["stresses"].values())
    assert (found["compared"] is None) == (asked.shape != "lightest")
