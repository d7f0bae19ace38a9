import pytest

import flywheel
from flywheel.machine.traced import TracedMachine
from tests import scenes
from tests.limits import sample


@pytest.mark.parametrize(
    "make", sample([pytest.param(scenes.ALL[n], id=n) for n in ("shaper", "press", "rotor", "yoke")], 4)
)
def test_a_time_simulation_confirms_the_irregularity_asked_for(make):
    result = flywheel.size(flywheel.load(make()))
    found = result.simulation
    assert found.route == "time"
    assert abs(found.irregularity / result.scene.irregularity - 1) <= result.error.simulation <= 1e-9
    assert 0.5 * (found.speed_max + found.speed_min) == pytest.approx(result.speed, rel=1e-10)
    assert abs(found.closure) < 1e-9
    assert found.speed_time_mean == pytest.approx(result.scene.cycle / found.period, rel=1e-14)


@pytest.mark.slow
def test_the_approximate_flywheel_gives_another_irregularity():
    result = flywheel.size(flywheel.load(scenes.yoke(regime={"speed": 100})))
    assert result.simulation.irregularity_approximate == pytest.approx(0.7393285787, rel=1e-8)


@pytest.mark.parametrize("eps", sample([1e-12, 1e-8], 2))
def test_tiny_irregularities_are_confirmed_too(eps):
    result = flywheel.size(flywheel.load(scenes.yoke(flywheel={"irregularity": eps})))
    assert result.simulation.irregularity == pytest.approx(eps, rel=1e-8)


@pytest.mark.slow
def test_thousands_of_pieces_are_not_stepped_and_that_is_said():
    sawtooth = scenes.rotor(load=[{"on": "crank", "torque": "abs(sin(400*phi))"}])
    sizing = flywheel.size(flywheel.load(sawtooth))
    assert sizing.machine.restarts.size > 1500
    assert sizing.simulation.route == "quadrature"
    assert any("not confirmed in time: its 1600 smooth pieces" in message for message in sizing.messages)
    assert sizing.left_out


def test_a_motion_that_takes_too_many_steps_is_told_by_quadrature(monkeypatch):
    monkeypatch.setattr("flywheel.sizing.confirmation._MOST", 500)
    sizing = flywheel.size(flywheel.load(scenes.press()))
    assert sizing.simulation.route == "quadrature"
    assert sizing.simulation.irregularity == pytest.approx(0.05, rel=1e-12)
    assert any("the motion takes too many steps" in message for message in sizing.messages)
    assert sizing.cost.stages["simulation"].evaluations < 600


@pytest.mark.slow
def test_an_unstable_motion_held_by_a_balance_is_sized_though_stepping_leaves_it():
    falling = {"load": [{"on": "crank", "torque": "-400*(1 + cos(phi))/omega"}], "drive": {"torque": "balance"}}
    scene = falling | {"inertia": [{"on": "crank", "value": 2}], "regime": {"speed": 5}, "flywheel": {"irregularity": 1.8}}
    sizing = flywheel.size(flywheel.load(scene))
    assert sizing.flywheel.exact == pytest.approx(0.139349049222, rel=1e-9)
    assert sizing.simulation.route == "quadrature"
    assert any("not confirmed in time" in message for message in sizing.messages)


@pytest.mark.slow
def test_what_stepping_loses_is_not_reported():
    """Next to standstill only rounding is left of the least speed."""
    bare = {"type": "slider-crank", "crank": {"length": 0.1}, "rod": {"length": 0.3}, "slider": {"mass": 2}}
    scene = {"mechanism": bare, "regime": {"speed": 10}, "flywheel": {"irregularity": 1.999999}}
    sizing = flywheel.size(flywheel.load(scene))
    assert sizing.simulation.route == "quadrature"
    assert 0.0 < sizing.simulation.speed_min < sizing.simulation.speed_max < 20.0


def test_an_approximate_flywheel_that_cannot_be_stepped_with_costs_no_more_than_its_figure(monkeypatch):
    from flywheel.regime import stepping
    from flywheel.sizing import confirmation

    calls = iter([confirmation._cycle_in_time])

    def once(*arguments):
        step = next(calls, None)
        if step is None:
            raise stepping.SlidingError
        return step(*arguments)

    monkeypatch.setattr(confirmation, "_cycle_in_time", once)
    sizing = flywheel.size(flywheel.load(scenes.press()))
    assert sizing.simulation.route == "time"
    assert sizing.simulation.irregularity_approximate is None
    assert any("approximate flywheel cannot be followed" in message for message in sizing.messages)


def test_no_motion_with_the_approximate_flywheel_is_null_with_a_message():
    result = flywheel.size(
        flywheel.load(scenes.yoke(load=[]))
    )  # areas ask for no flywheel, the dead centres have no inertia
    assert result.simulation.irregularity_approximate is None
    assert any("approximate" in message for message in result.messages)


def test_a_recording_that_is_not_the_machine_confirms_nothing(monkeypatch):
    """A constant of the recorded walk is off by a millionth: the figures may rest on it, the motion in time does not."""
    recorded = TracedMachine._recorded_motion

    def off(traced, anchor):
        piece = recorded(traced, anchor)
        assert piece is not None
        first, *rest = piece.program.places
        return piece._replace(program=piece.program._replace(places=(first * (1.0 + 1e-6), *rest)))

    monkeypatch.setattr(TracedMachine, "_recorded_motion", off)
    sizing = flywheel.size(flywheel.load(scenes.ALL["press"]()))
    assert sizing.simulation is not None
    assert sizing.simulation.route == "quadrature"
    assert any("a recording that is not the machine" in message for message in sizing.messages)
