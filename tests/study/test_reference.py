"""A reference that its second route does not confirm is in doubt by as much."""

import math

import pytest

import flywheel
from flywheel.machine.machine import Machine
from flywheel.study import reference
from flywheel.study import reference as extended
from flywheel.study.reference import Extended
from tests import regimes
from tests.limits import sample
from tests.scenes import shaper, yoke

FAN = {
    "inertia": [{"on": "crank", "value": 2}],
    "drive": {"torque": "100 - 4*omega"},
    "load": [{"on": "crank", "torque": "-60*(1 + sin(phi))"}],
    "flywheel": {"inertia": 20},
}


def verified(scene):
    return reference.verified(Machine(flywheel.load(scene)))


def test_two_routes_that_agree():
    asked, found = verified(yoke())
    assert found.value == pytest.approx(353.52142732, rel=1e-10)
    assert found.doubt < 1e-13
    assert asked.sized
    assert "within its estimate" in found.verified


def test_two_routes_that_do_not(monkeypatch):
    monkeypatch.setattr(extended, "flywheel_inertia", lambda machine: Extended(353.5214 * (1 + 1e-6), 1e-12))
    _, found = verified(yoke())
    assert found.doubt == pytest.approx(1e-6, rel=0.1)
    assert "more than both estimates allow" in found.verified


def test_a_flywheel_that_is_not_needed_is_none():
    _, found = verified(yoke(inertia=[{"on": "crank", "value": 1000}]))
    assert found.value == 0.0


def test_a_wheel_on_another_shaft_is_told_on_that():
    on_crank, on_shaft = (verified(shaper(flywheel={"irregularity": 0.1, "on": on}))[1] for on in ("crank", "bull"))
    assert on_shaft.value == pytest.approx(4 * on_crank.value, rel=1e-12)


def test_torques_that_depend_on_speed_are_verified_in_time():
    asked, found = verified(FAN)
    assert not asked.sized
    # (J + I) omega omega' + 4 omega = 40 - 60 sin(phi), whose first harmonic at w = 10 is this but for about eps²
    assert found.value == pytest.approx(2 * 60 / 10 / math.hypot(22 * 10, 4), rel=2e-3)
    assert found.doubt < 1e-9
    assert "stepped in time" in found.verified


@pytest.mark.parametrize("name", sample(["governor", "peaks", "dc-inductance", "constant-drive", "two-speeds-fast"], 5))
@pytest.mark.parametrize("kind", ["sizing", "analysis"])
def test_it_is_true_within_its_doubt(name, kind):
    case = regimes.CASES[name]
    given = {"irregularity": case.irregularities[0]} if kind == "sizing" else {"inertia": case.inertias[0]}
    asked, found = verified(regimes.scene(name, **given))
    figures = regimes.figures(name)[kind][repr(*given.values())]
    true = float(figures["inertia" if kind == "sizing" else "irregularity"])
    assert asked.error(found.value, true) <= found.doubt + 2e-15
    assert found.doubt < 1e-12


def test_what_cannot_be_stepped_has_its_own_estimate(monkeypatch):
    size = reference.size
    monkeypatch.setattr(reference, "size", lambda machine, rtol, accuracy: size(machine, rtol, accuracy="normal"))
    _, found = verified(FAN)
    assert "by its own estimate alone" in found.verified
    assert 0.0 < found.doubt < 1e-9
