from dataclasses import replace

import numpy as np
import pytest

import flywheel
from flywheel.tables import sizing as report
from tests import scenes


def sized(scene, rtol=None):
    return flywheel.size(flywheel.load(scene), rtol, simulate=False)


@pytest.mark.parametrize("make", scenes.ALL.values(), ids=scenes.ALL)
def test_work_over_the_cycle_sums_to_zero(make):
    result = sized(make())
    assert abs(sum(area.work for area in result.areas)) < 1e-12 * result.energy_fluctuation
    assert abs(result.areas[-1].accumulated) < 1e-12 * result.energy_fluctuation


@pytest.mark.parametrize("make", scenes.ALL.values(), ids=scenes.ALL)
def test_analysing_the_sized_flywheel_gives_the_irregularity_back(make):
    result = sized(make())
    wheel = {"inertia": result.flywheel.exact}
    again = sized(make(flywheel=wheel))
    assert again.simulation.irregularity == pytest.approx(result.scene.irregularity, rel=1e-10)
    mean = 0.5 * (again.simulation.speed_max + again.simulation.speed_min)
    assert mean == pytest.approx(result.speed, rel=1e-13)
    assert again.angle_speed_max == pytest.approx(result.angle_speed_max, abs=1e-6)
    assert again.flywheel.exact is None
    assert again.error.exact is None


def test_a_heavy_machine_needs_no_flywheel():
    result = sized(scenes.press(inertia=[{"on": "crank", "value": 5000}]))
    assert result.flywheel.needed is False
    assert result.flywheel.exact == 0.0
    assert result.run.irregularity < result.scene.irregularity


def test_the_flywheel_on_a_faster_shaft_is_lighter_by_the_square_of_the_ratio():
    shafts = {"motor": {"ratio": 10}}
    plain = sized(scenes.press())
    geared = sized(scenes.press(shafts=shafts, flywheel={"irregularity": 0.05, "on": "motor"}))
    for figure in ("exact", "approximate", "approximate_total", "inertia_torque"):
        assert getattr(geared.flywheel, figure) == pytest.approx(getattr(plain.flywheel, figure) / 100, rel=1e-13)


def test_speed_may_be_given_on_another_shaft():
    shafts = {"motor": {"ratio": 10}}
    geared = sized(scenes.press(shafts=shafts, regime={"speed": "1200 rpm", "on": "motor"}))
    assert geared.speed == pytest.approx(4 * np.pi, rel=1e-15)
    assert geared.flywheel.exact == pytest.approx(sized(scenes.press()).flywheel.exact, rel=1e-13)


def test_net_work_without_a_balance_is_an_error_that_says_so():
    scene = scenes.yoke(drive={"torque": 100})
    with pytest.raises(flywheel.SceneError, match="net work") as caught:
        sized(scene)
    message = str(caught.value)
    assert "-371.68" in message  # 100 N m over a turn against 1000 J
    assert '"balance"' in message


def test_a_balance_that_does_no_work_is_refused():
    scene = scenes.rotor(parameters={"p": "balance"}, drive={"torque": "p*sin(phi)"})
    with pytest.raises(flywheel.SceneError, match="no net work"):
        sized(scene)


def test_a_balance_may_be_a_parameter():
    force = [{"on": "scotch-yoke.yoke", "force": "F if phi < pi else 0"}]
    result = sized(scenes.yoke(parameters={"F": "balance"}, load=force, drive={"torque": f"{500 / np.pi}"}))
    assert result.balance.name == "F"
    assert result.balance.value == pytest.approx(1000, rel=1e-13)
    assert result.power == pytest.approx(500 / np.pi * 2 * np.pi, rel=1e-13)


def test_values_that_are_not_finite_name_the_load_and_the_angle():
    scene = scenes.rotor(load=[{"on": "crank", "torque": "-sqrt(phi - 1)"}])
    with pytest.raises(flywheel.SceneError, match=r"load\[0\].*not finite.*deg \(sqrt\(phi - 1\): the square root of -0.99"):
        sized(scene)


@pytest.mark.parametrize(
    ("law", "reason"),
    [
        ("log(phi-3)", "(log(phi-3): the logarithm of -2.99"),
        ("asin(phi)", "(asin(phi): the arcsine of 1.0"),
        ("1/(phi-1)", "(1/(phi-1): a division by phi-1, which comes to 0)"),
        ("1/phi", "(1/phi: a division by phi, which is 0)"),
        ("0/(phi*0)", "(0/(phi*0): a division by phi*0, which is 0)"),
        ("exp(300*phi)", "(exp(300*phi): beyond the floating-point range of 1.8e308, as 300*phi = 1884.96)"),
        ("sqrt(omega-2000)", " rad/s (sqrt(omega-2000): the square root of -19"),
        ("1e200*(1+sin(phi))", "found a value that comes to 1."),
    ],
)
def test_values_that_are_not_finite_are_told_with_their_reason(law, reason):
    with pytest.raises(flywheel.SceneError) as caught:
        sized(scenes.rotor(load=[{"on": "crank", "torque": law}]))
    assert reason in str(caught.value)


def test_an_inertia_that_vanishes_is_told_as_that():
    """A slider alone stands still at its dead centres: nothing there tells how fast a crank without inertia goes on."""
    crank = {"type": "slider-crank", "crank": {"length": 0.1}, "rod": {"length": 0.4}, "slider": {"mass": 2}}
    load = [{"on": "slider-crank.slider", "force": -1000, "while": "v > 0"}]
    for drive in ({"torque": "200 - 10*omega"}, {"torque": "balance"}):
        scene = {"mechanism": crank, "load": load, "drive": drive, "regime": {"speed": 20}, "flywheel": {"inertia": 0}}
        with pytest.raises(flywheel.SceneError, match=r"^flywheel.inertia: found I\* \+ J = 0 kg m² at crank angle 0 deg"):
            sized(scene)


def test_no_moment_at_all_is_one_area_and_no_flywheel():
    result = sized(scenes.rotor(load=[], inertia=[{"on": "crank", "value": 1}]))
    assert len(result.areas) == 1
    assert result.areas[0].work == 0.0
    assert result.flywheel.exact == 0.0
    assert result.flywheel.needed is False


def test_areas_alone():
    areas = {"areas": {"values": [295, -685, 40, -340, 960, -270], "scale": "0.5 J"}}
    result = sized({**areas, "regime": {"speed": 10}, "flywheel": {"irregularity": 0.1}})
    assert result.energy_fluctuation == pytest.approx(985 * 0.5)
    assert result.flywheel.exact == result.flywheel.approximate == pytest.approx(985 * 0.5 / 10)
    assert result.areas[0].start is None
    given = sized({**areas, "regime": {"speed": 10}, "flywheel": {"inertia": 98.5}})
    assert given.simulation.irregularity == pytest.approx(0.05)
    assert given.simulation.speed_max == pytest.approx(10.25)
    assert given.simulation.period is None


def test_areas_with_too_light_a_flywheel_are_refused():
    scene = {"areas": {"values": [10, -10], "scale": 1}, "regime": {"speed": 1}, "flywheel": {"inertia": 1}}
    with pytest.raises(flywheel.SceneError, match=r"flywheel\.inertia"):
        sized(scene)


def test_a_given_flywheel_that_lets_the_machine_stop_is_refused():
    with pytest.raises(flywheel.SceneError, match="stops within the cycle"):
        sized(scenes.yoke(flywheel={"inertia": 0.001}))


def test_a_balance_must_be_linear():
    scene = scenes.rotor(parameters={"p": "balance"}, drive={"torque": "p**2"})
    with pytest.raises(flywheel.SceneError, match=r"drive\.torque.*not linear in the balance p"):
        sized(scene)


def test_a_figure_beyond_the_floating_point_range_is_refused():
    scene = replace(flywheel.load(scenes.rotor()), irregularity=1e-300, speed=1e-50)
    with pytest.raises(flywheel.SceneError, match="floating-point range"):
        flywheel.size(scene, simulate=False)
    scene = replace(flywheel.load(scenes.rotor()), speed=1e200)
    with pytest.raises(flywheel.SceneError, match="floating-point range"):
        flywheel.size(scene, simulate=False)


@pytest.mark.parametrize("rtol", [float("nan"), 0.0, -1.0, 1.0])
def test_senseless_tolerances_are_refused(rtol):
    with pytest.raises(flywheel.SceneError, match="rtol"):
        sized(scenes.rotor(), rtol)


def test_what_is_no_scene_is_refused_with_advice():
    for call in (flywheel.size, flywheel.Machine, lambda scene: flywheel.reduce(scene, 0.0)):
        with pytest.raises(TypeError, match=r"flywheel\.load makes one.*dict"):
            call(scenes.rotor())


def test_areas_that_are_not_finite_are_refused():
    areas = {"values": [1e308, -1e308], "scale": 1e10}
    with pytest.raises(flywheel.SceneError, match="areas"):
        sized({"areas": areas, "regime": {"speed": 1}, "flywheel": {"irregularity": 0.1}})


def test_work_left_over_in_the_cycle_is_told():
    drive = {"torque": "55 N m"}
    result = sized(scenes.rotor(drive=drive, accuracy={"closure": "10 %"}))
    assert "net work" in result.messages[0]


def test_an_expression_that_varies_too_fast_is_refused_with_its_key():
    with pytest.raises(flywheel.SceneError, match=r"load\[0\]\.torque: .*too fast"):
        sized(scenes.rotor(load=[{"on": "crank", "torque": "-sin(1e6*phi)"}]))


def test_net_work_below_its_own_error_gives_no_coefficient_of_energy():
    drive = {"torque": "5*sin(phi)"}
    result = sized(scenes.rotor(load=[{"on": "crank", "torque": "sin(phi)"}], drive=drive))
    assert result.coefficient_of_energy is None


EVEN = {"load": [{"on": "crank", "torque": "-100 N m"}], "drive": {"on": "motor", "torque": "balance"}}


@pytest.mark.parametrize("own", [[], [{"on": "crank", "value": 2}]], ids=["without inertia", "with some"])
@pytest.mark.parametrize("simulate", [False, True])
def test_a_motion_without_any_variation_needs_no_flywheel(own, simulate):
    scene = scenes.rotor(**EVEN, shafts={"motor": {"ratio": 5}}, inertia=own)
    result = flywheel.size(flywheel.load(scene), simulate=simulate)
    wheel = result.flywheel
    assert (wheel.exact, wheel.approximate, wheel.inertia_torque, wheel.needed) == (0.0, 0.0, 0.0, False)
    assert result.reached
    text = report.text(result)
    assert "?" not in text
    assert "±0  without limit" in text
    assert not any("e-1" in line for line in text.split("Estimated")[0].splitlines() if "closure" not in line)


def test_what_little_varies_is_not_taken_for_rounding():
    load = [{"on": "crank", "torque": "-100 - 1e-6*sin(phi)"}]
    result = sized(scenes.rotor(load=load))
    assert result.flywheel.exact == pytest.approx(2e-6 / (0.01 * result.speed**2), rel=1e-6)
    assert result.flywheel.needed


def test_a_sizing_is_told_in_a_line():
    assert repr(sized(scenes.yoke(title="Yoke"))).startswith("Sizing('Yoke', on='crank', exact=353.52142732")
    given = flywheel.size(flywheel.load(scenes.yoke(flywheel={"inertia": 300})), simulate=False)
    assert len(repr(given)) < 200
    assert "inertia=300.0, speed=" in repr(given)


def test_a_motor_of_an_unusual_slip_is_told_of():
    motor = {"type": "induction", "power": "4 kW", "speed": "1430 rpm", "poles": 4, "breakdown_ratio": 2.5}
    load = [{"on": "crank", "torque": "-20 N m", "from": 0, "to": "180 deg"}]
    scene = {"load": load, "flywheel": {"inertia": 1}}
    odd, usual = (sized(scene | {"drive": {"motor": motor | {"frequency": mains}}}) for mains in ("60 Hz", "50 Hz"))
    assert any("slip is 0.206" in message and "frequency" in message for message in odd.messages)
    assert not any("slip" in message for message in usual.messages)
