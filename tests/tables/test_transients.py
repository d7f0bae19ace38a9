import csv
import io
import json

import numpy as np
import pytest

import flywheel
from flywheel.motions.transients import run_down, run_up, transient
from flywheel.tables import transients
from tests.scenes import press

SCENE = {
    "title": "Fan",
    "inertia": [{"on": "crank", "value": 2}],
    "drive": {"torque": "20 - 4*omega"},
    "flywheel": {"inertia": 0},
}
STALL = SCENE | {"load": [{"on": "crank", "torque": -60, "from": "90 deg", "to": "180 deg"}]}


@pytest.fixture(scope="module")
def found():
    return run_up(flywheel.load(SCENE), "2 s")


def test_the_text_has_the_end_the_regime_and_the_energies(found):
    text = transients.text(found)
    assert text.startswith("Fan\nFrom 0 deg, 0 rad/s (0 rpm): ended at")
    assert "first at 95 % of it           after 1.497866 s" in text
    assert "= kinetic energy gained" in text
    assert max(map(len, text.splitlines())) <= 100


@pytest.fixture(scope="module")
def stalled():
    return transients.text(run_up(flywheel.load(STALL), "20 s", rtol=1e-5))


def test_a_stall_is_the_first_thing_that_is_said(stalled):
    text = stalled
    assert "stalled at crank angle" in text.splitlines()[1]
    assert "no regime:" in text
    assert max(map(len, text.splitlines())) <= 100


def test_csv_is_the_motion_evenly_in_time(found):
    rows = list(csv.reader(io.StringIO(transients.csv(found, 5))))
    assert rows[0][:4] == ["t [s]", "phi [rad]", "omega [rad/s]", "alpha [rad/s^2]"]
    values = np.array(rows[1:], dtype=float)
    np.testing.assert_allclose(values[:, 0], [0, 0.5, 1, 1.5, 2])
    np.testing.assert_allclose(values[:, 2], 5 * (1 - np.exp(-2 * values[:, 0])), rtol=1e-8, atol=1e-12)


def test_json_has_the_motion_and_everything_else(found):
    data = json.loads(transients.json(found, 3))
    assert data["samples"]["t"] == [0.0, 1.0, 2.0]
    assert data["samples"]["current"] is None
    assert data["energy"]["drive"] == pytest.approx(found.energy.drive)


def test_a_dc_motor_adds_its_current():
    motor = {"type": "dc", "voltage": 48, "resistance": 0.4, "constant": 0.25}
    scene = flywheel.load(
        {"inertia": [{"on": "crank", "value": 0.1}], "drive": {"motor": motor}, "flywheel": {"inertia": 0}}
    )
    found = transient(scene, end="0.1 s")
    assert transients.csv(found, 2).splitlines()[0].endswith(",current [A]")
    assert float(transients.csv(found, 2).splitlines()[1].rsplit(",", 1)[1]) == pytest.approx(120.0)
    assert "heat in the motor's armature" in transients.text(found)


def test_a_stroke_is_told_in_metres():
    bodies = {"frame": {"points": {"O": [0, 0]}}, "ram": {"mass": 2.0}}
    guide = {"name": "O", "type": "slide", "between": ["frame.O", "ram.origin"]}
    linkage = {"type": "linkage", "driver": "O", "bodies": bodies, "joints": [guide]}
    force = [{"on": "slide", "force": "100 - 40*v"}]
    scene = flywheel.load({"mechanism": linkage, "load": force, "stroke": {"from": 0.1, "to": 0.5, "speed": 1}})
    found = transient(scene, end="stop")
    assert "the driver reached the stroke's end at 0.5 m" in transients.text(found)
    assert "rpm" not in transients.text(found)
    rows = transients.csv(found, 2).splitlines()
    assert rows[0].startswith("t [s],x [m],v [m/s]")
    assert [float(row.split(",")[1]) for row in rows[1:]] == pytest.approx([0.1, 0.5])


@pytest.fixture(scope="module")
def pulsed():
    pulse = {"on": "crank", "torque": -30, "from": "90 deg", "to": "91 deg"}
    return transient(flywheel.load(SCENE | {"load": [pulse]}), start=4.0, end="1 turn")


def test_csv_and_json_may_have_both_sides_of_every_switch(pulsed):
    rows = np.array([row.split(",") for row in transients.csv(pulsed, 3, breaks=True).splitlines()[1:]], dtype=float)
    t, phi, moment = rows[:, 0], rows[:, 1], rows[:, 4]
    assert rows.shape[0] == 3 + 4
    assert np.all(np.diff(t) >= 0.0)
    k = int(np.argmax(np.isclose(phi, np.pi / 2)))
    assert moment[k] - moment[k + 1] == pytest.approx(30.0, rel=1e-9)
    assert moment[k + 3] - moment[k + 2] == pytest.approx(30.0, rel=1e-9)
    assert len(json.loads(transients.json(pulsed, 3, breaks=True))["samples"]["t"]) == 7
    assert len(transients.csv(pulsed, 3).splitlines()) == 1 + 3


def test_a_run_down_is_told_without_what_it_cannot_have():
    scene = SCENE | {"load": [{"on": "crank", "torque": "-2*sign(omega)"}]}
    text = transients.text(run_down(flywheel.load(scene)))
    assert "speed at the end              0 rad/s (0 rpm)" in text
    assert "95 %" not in text
    assert "after 0 s" not in text


def test_moments_before_and_after_losses_are_told_apart(found, stalled):
    geared = STALL | {"shafts": {"motor": {"ratio": 2, "efficiency": 0.8}}, "drive": {"on": "motor", "torque": 10}}
    text = " ".join(transients.text(run_up(flywheel.load(geared | {"regime": {"speed": 5}}), "20 s", rtol=1e-5)).split())
    assert "M* at rest is -40 N m, before losses in meshes" in text
    assert ",M* after losses [N m]," in transients.csv(found, 2)
    assert "losses" not in stalled


def test_every_store_has_its_energy():
    """Kinetic energies of the bodies and the flywheel add up to the whole."""
    found = transients.json(flywheel.transient(flywheel.load(press()), end="0.5 s"), 5)
    data = json.loads(found)
    kinetic = np.sum(list(data["stores"]["kinetic"].values()), axis=0)
    np.testing.assert_allclose(kinetic, data["samples"]["kinetic"], rtol=1e-12)
    assert set(data["stores"]["potential"]) == {f"weight of press.{body}" for body in ("crank", "rod", "slider")}
    assert set(data["errors"]["stores"]["potential"]) == set(data["stores"]["potential"])
