import pytest

import flywheel
from tests.flywheel import scenes


@pytest.mark.parametrize("make", scenes.ALL.values(), ids=scenes.ALL)
def test_a_time_simulation_confirms_the_irregularity_asked_for(make):
    result = flywheel.size(flywheel.load(make()))
    found = result.simulation
    assert found.route == "time"
    assert abs(found.irregularity / result.scene.irregularity - 1) <= result.error.simulation <= 1e-9
    assert 0.5 * (found.speed_max + found.speed_min) == pytest.approx(result.speed, rel=1e-10)
    assert abs(found.closure) < 1e-9
    assert found.speed_time_mean == pytest.approx(result.scene.cycle / found.period, rel=1e-14)


def test_the_approximate_flywheel_gives_another_irregularity():
    result = flywheel.size(flywheel.load(scenes.yoke(regime={"speed": 100})))
    assert result.simulation.irregularity_approximate == pytest.approx(0.7393285787, rel=1e-8)


@pytest.mark.parametrize("eps", [1e-8, 1e-12])
def test_tiny_irregularities_are_confirmed_too(eps):
    result = flywheel.size(flywheel.load(scenes.yoke(flywheel={"irregularity": eps})))
    assert result.simulation.irregularity == pytest.approx(eps, rel=1e-8)


def test_an_irregularity_near_two_is_confirmed():
    result = flywheel.size(flywheel.load(scenes.rotor(flywheel={"irregularity": 1.9})))
    assert result.simulation.irregularity == pytest.approx(1.9, rel=1e-9)


def test_no_motion_with_the_approximate_flywheel_is_null_with_a_message():
    result = flywheel.size(
        flywheel.load(scenes.yoke(load=[]))
    )  # areas ask for no flywheel, the dead centres have no inertia
    assert result.simulation.irregularity_approximate is None
    assert any("approximate" in message for message in result.messages)


def test_quadrature_and_time_stepping_agree_on_an_analysis():
    scene = flywheel.load(scenes.press(flywheel={"inertia": 30}))
    stepped, closed = flywheel.size(scene).simulation, flywheel.size(scene, simulate=False).simulation
    assert closed.route == "quadrature"
    for name in ("irregularity", "speed_max", "speed_min", "period", "speed_time_mean"):
        assert getattr(stepped, name) == pytest.approx(getattr(closed, name), rel=1e-9)
