"""Energy in every store: its slope is the force that the store exerts, and a machine left alone keeps the sum."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

import flywheel
from flywheel.numerics.faults import SceneError
from flywheel.regime.state import reduce
from tests.scenes import press, shaper, yoke

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
    found = flywheel.stored_energy(scene, phi, omega)
    total = found.total
    assert np.ptp(sum(found.kinetic.values())) > 10.0
    np.testing.assert_allclose(total, total[0], rtol=1e-9)


def test_energies_have_their_errors_and_the_flywheel_its_share():
    scene = flywheel.load(SCENES["press"])
    found = flywheel.stored_energy(scene, [0.3, 1.0], 7.0, flywheel=2.0)
    assert found.kinetic["the flywheel"].tolist() == [49.0, 49.0]
    assert set(found.errors) == {*found.kinetic, *found.potential}
    centre = 0.1 * np.cos(0.3) + np.sqrt(0.25 - 0.01 * np.sin(0.3) ** 2)
    true = 350 * (centre - 0.2) ** 2
    store = "spring[0] on press.slider"
    assert abs(found.potential[store][0] - true) <= found.errors[store][0] < 1e-11
    parts = reduce(scene, [0.3], balance=0.0).inertia_parts
    for body, part in parts.items():
        assert found.kinetic[body][0] == pytest.approx(0.5 * part[0] * 49.0, rel=1e-14)


def test_speeds_of_another_number_are_refused():
    with pytest.raises(SceneError, match="3 speeds, expected one, or 2"):
        flywheel.stored_energy(flywheel.load(SCENES["yoke"]), [0.0, 1.0], [1.0, 2.0, 3.0])
