import mpmath
import numpy as np
import pytest
from numpy.testing import assert_allclose

import flywheel
from flywheel.machine.machine import dead_centres
from tests import scenes


def machine(scene):
    return flywheel.Machine(flywheel.load(scene))


def test_dead_centres_are_the_roots_of_the_influence_coefficient():
    built = machine(scenes.press())
    found = dead_centres(built.reduction, "press.slider", np.array([0.0, 2 * np.pi]))
    assert_allclose(found, [np.pi], atol=1e-14)
    offset = scenes.press()["mechanism"] | {"slider": {"offset": 0.05}}
    built = machine(scenes.press(mechanism=offset, gravity={}))
    # stretched and folded: sin(phi) = e/(l ± r)
    stretched, folded = np.arcsin(0.05 / 0.6), np.pi + np.arcsin(-0.05 / 0.4) + 2 * np.arcsin(0.05 / 0.4)
    found = dead_centres(built.reduction, "press.slider", np.array([0.0, 2 * np.pi]))
    assert_allclose(found, [stretched, np.pi + np.arcsin(0.05 / 0.4)], atol=1e-13)
    assert folded == pytest.approx(found[1])


SLIDER = {"type": "slider-crank", "crank.length": 0.1, "slider.mass": 1, "rod.inertia": 1}
BARS = {"type": "four-bar", "ground.length": 0.4, "crank.length": 0.1, "coupler.length": 0.35, "rocker.length": 0.3}
SHAPER = {"type": "crank-shaper", "rocker.length": 0.5, "ram.mass": 1}
DEAD_CENTRES = [
    (SLIDER | {"rod.length": 0.3}, "slider"),
    (SLIDER | {"rod.length": 0.25, "slider.offset": 0.1, "phase": 2.0}, "slider"),
    (SLIDER | {"rod.length": 0.1600001, "slider.offset": -0.06, "phase": -1.0}, "slider"),
    (SLIDER | {"rod.length": 0.3, "slider.offset": 0.1, "phase": 1.0}, "rod"),
    ({"type": "scotch-yoke", "crank.length": 0.1, "yoke.mass": 1, "yoke.direction": -2.0, "phase": 0.3}, "yoke"),
    (BARS, "rocker"),
    (BARS | {"assembly": "crossed", "phase": 1.0}, "rocker"),
    (BARS | {"coupler.length": 0.2, "rocker.length": 0.32}, "rocker"),
    (SHAPER | {"crank.length": 0.1, "frame.length": 0.3, "phase": 0.5}, "rocker"),
    (SHAPER | {"crank.length": 0.1, "frame.length": 0.3, "phase": 0.5}, "ram"),
    (SHAPER | {"crank.length": 0.3, "frame.length": 0.1}, "ram"),
]


def nested(flat):
    found = {}
    for path, value in flat.items():
        *tables, key = path.split(".")
        place = found
        for table in tables:
            place = place.setdefault(table, {})
        place[key] = value
    return found


@pytest.mark.parametrize(("flat", "port"), DEAD_CENTRES)
@pytest.mark.parametrize("ratio", [1, 2])
def test_dead_centres_of_closed_form_are_those_that_bounds_find(flat, port, ratio):
    key = "torque" if port in ("rod", "rocker") else "force"
    load = [{"on": f"m.{port}", key: "-5*sign(v)"}]
    mechanism = nested(flat) | {"name": "m", "shaft": "fast"}
    built = machine(scenes.rotor(mechanism=mechanism, shafts={"fast": {"ratio": ratio}}, load=load))
    junction = built.places[f"m.{port}"].junction
    smooth = np.unique([0.0, 2 * np.pi, *(angle for _, angle in built._mechanism_breakpoints())])
    expected = dead_centres(built.kinematics, junction, smooth)
    senses = built._senses(f"m.{port}")
    inner = senses.dead_centres[(senses.dead_centres > 1e-9) & (senses.dead_centres < 2 * np.pi - 1e-9)]
    assert_allclose([np.abs(expected - angle).min() for angle in inner], 0.0, atol=1e-11)
    assert 2 * ratio - 2 < inner.size <= 2 * ratio
    phi = np.linspace(0.01, 6.28, 333)
    apart = np.abs(phi[:, None] - senses.dead_centres).min(axis=1) > 1e-9
    gain = built.kinematics.flows(phi, phi).gain[built.kinematics.variable[junction]]
    assert (np.sign(gain) == senses.at(phi))[apart].all()


def test_switches_of_an_expression_become_breakpoints():
    load = [{"on": "crank", "torque": "-5*max(sin(phi), 0.5) - (3 if phi < 2 else 1)"}]
    found = machine(scenes.rotor(load=load)).breakpoints
    assert_allclose(found, [0, np.pi / 6, 2, 5 * np.pi / 6, 2 * np.pi], atol=1e-14)


def test_switches_on_displacement_follow_the_mechanism():
    load = [{"on": "yoke", "force": "-100 if x > 0.25 else 0"}]
    found = machine(scenes.yoke(load=load)).breakpoints
    assert_allclose(found, [0, np.pi / 3, 5 * np.pi / 3, 2 * np.pi], atol=1e-14)


@pytest.mark.parametrize("width", [1e-1, 1e-2, 1e-4, 1e-5])
def test_a_narrow_peak_is_never_missed(width):
    load = [{"on": "crank", "torque": f"-(sin(phi) + 100*exp(-((phi - 2)/{width})**2))"}]
    result = flywheel.size(flywheel.load(scenes.rotor(load=load)), simulate=False)
    work = 100 * width * np.sqrt(np.pi)  # the peak's; the sine's is zero
    assert result.balance.value == pytest.approx(work / (2 * np.pi), rel=1e-9)
    assert result.reached


@pytest.mark.parametrize("steepness", [10, 300, 1e5, 1e8])
@pytest.mark.parametrize("text", ["-100/(1 + exp(-{k}*(phi - 3)))", "-100*exp({k}*(phi - 3))/(1 + exp({k}*(phi - 3)))"])
def test_a_steep_step_is_sized_within_its_estimate(text, steepness):
    result = flywheel.size(
        flywheel.load(scenes.rotor(load=[{"on": "crank", "torque": text.format(k=steepness)}])), simulate=False
    )
    with mpmath.workdps(30):
        k, turn = mpmath.mpf(steepness), 2 * mpmath.pi

        def step(phi):
            return mpmath.log1p(mpmath.exp(k * (phi - 3))) / k

        mean = (step(turn) - step(0)) / turn
        top = 3 + mpmath.log(mean / (1 - mean)) / k
        swing = 100 * (mean * top - step(top) + step(0))
        true = float(swing / (mpmath.mpf("0.01") * (10 * mpmath.pi) ** 2))
        assert result.balance.value == pytest.approx(float(100 * mean), rel=1e-9)
    assert abs(result.flywheel.exact / true - 1) <= result.error.exact <= 1e-9


def test_scenes_without_expressions_do_not_pay_for_bounds():
    built = machine(scenes.yoke())
    assert built.landmarks is built.breakpoints


def test_an_expression_that_cannot_be_followed_is_a_fault_with_its_place():
    with pytest.raises(flywheel.SceneError, match=r"load\[0\]"):
        _ = machine(scenes.rotor(load=[{"on": "crank", "torque": "-1/sin(phi - 1)"}])).mesh


@pytest.mark.parametrize("every", [360, 180, 120])
def test_a_switch_just_before_phi_starts_again_is_found(every):
    last = float(np.radians(every)) - 1e-3
    load = [{"on": "crank", "torque": f"-100 if phi > {last!r} else 0", "every": f"{every} deg"}]
    result = flywheel.size(flywheel.load(scenes.rotor(load=load)), simulate=False)
    assert result.balance.value == pytest.approx(100 * 1e-3 / np.radians(every), rel=1e-9)


@pytest.mark.parametrize("speed", [1.0, 30.0])
def test_what_is_steep_at_the_speed_of_running_has_cells_of_its_own(speed):
    """A narrow peak whose height depends on the speed: seen at the machine's pace."""
    load = [{"on": "crank", "torque": "-omega*exp(-((phi - 2)/1e-3)**2)"}]
    built = machine(scenes.rotor(load=load, regime={"speed": speed}))
    near = built.landmarks[np.abs(built.landmarks - 2) < 0.02]
    assert near.size > 4
    result = flywheel.size(built, simulate=False)
    work = speed * 1e-3 * np.sqrt(np.pi)
    assert result.balance.value * 2 * np.pi == pytest.approx(work, rel=1e-4)
    assert result.reached


@pytest.mark.parametrize("power", [0.01, 0.1, 0.5])
def test_a_root_of_any_order_is_followed_to_its_branch_point(power):
    """Mean of |cos|**p over a turn: Gamma((p + 1)/2)/(sqrt(pi) Gamma(p/2 + 1))."""
    load = [{"on": "crank", "torque": f"-50*abs(cos(phi))**{power}"}]
    scene = {"load": load, "drive": {"torque": "balance"}, "regime": {"speed": 20}, "flywheel": {"irregularity": 0.03}}
    found = flywheel.size(flywheel.load(scene), simulate=False)
    mean = mpmath.gamma((power + 1) / 2) / (mpmath.sqrt(mpmath.pi) * mpmath.gamma(power / 2 + 1))
    assert found.balance.value == pytest.approx(50 * float(mean), rel=1e-11)
