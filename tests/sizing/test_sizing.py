"""Sizing, its estimates of error and the simulation that confirms it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flywheel
from flywheel.machine.programs import Programs
from flywheel.tables import sizing as report
from tests import regimes, scenes
from tests.limits import sample


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
        ("1/(phi-1)", "(1/(phi-1): a division by phi-1, which is 0)"),
        ("1/phi", "(1/phi: a division by phi, which is 0)"),
        ("0/(phi*0)", "(0/(phi*0): a division by phi*0, which is 0)"),
        ("exp(300*phi)", "(exp(300*phi): beyond the floating-point range of 1.8e308, as 300*phi = 1884.96)"),
        ("sqrt(omega-2000)", " rad/s (sqrt(omega-2000): the square root of -19"),
        ("1e200*(1+sin(phi))", "found a value that reaches 1."),
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


@pytest.mark.parametrize(
    "make", sample([pytest.param(scenes.ALL[n], id=n) for n in ("shaper", "press", "rotor", "yoke")], 4)
)
def test_a_time_simulation_confirms_the_irregularity_asked_for(make):
    result = flywheel.size(flywheel.load(make()))
    outcome = result.simulation
    assert outcome.route == "time"
    assert abs(outcome.irregularity / result.scene.irregularity - 1) <= result.error.simulation <= 1e-9
    assert 0.5 * (outcome.speed_max + outcome.speed_min) == pytest.approx(result.speed, rel=1e-10)
    assert abs(outcome.closure) < 1e-9
    assert outcome.speed_time_mean == pytest.approx(result.scene.cycle / outcome.period, rel=1e-14)


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
    monkeypatch.setattr("flywheel.sizing.confirmation._MOST_EVALUATIONS", 500)
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
    from flywheel.sizing import confirmation

    calls = iter([confirmation._cycle_in_time])

    def once(*arguments, **options):
        step = next(calls, None)
        if step is None:
            raise confirmation.SlidingError
        return step(*arguments, **options)

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
    recorded = Programs._terms

    def off(*arguments, **options):
        first, *rest = recorded(*arguments, **options)
        return [first * (1.0 + 1e-6), *rest]

    monkeypatch.setattr(Programs, "_terms", off)
    sizing = flywheel.size(flywheel.load(scenes.ALL["press"]()))
    assert sizing.simulation is not None
    assert sizing.simulation.route == "quadrature"
    assert any("a recording that is not the machine" in message for message in sizing.messages)


# Every figure of a sizing has its estimated error, and none is further off: position, speed, cycles that do not close.


ROOT = Path(__file__).parents[2]
EXAMPLES = sorted(ROOT.glob("examples/**/*.toml"))
ROUNDING = 4e-16

# what the scene says, what costs and errors themselves are, and bounds, which hold their errors already
TOLD = {"cycle", "speed_asked", "irregularity", "rtol", "cost", "error", "bounds"}
TOLD |= {"flywheel.inertia", "simulation.closure", "wheel.irregularity_error", "wheel.material", "shafts.ratio"}


def numbers(value: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """The paths of all numbers; members of a list stand under its own key."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from numbers(item, (*path, key))
    elif isinstance(value, list):
        for item in value:
            yield from numbers(item, path)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield path


def error_of(errors: dict[str, Any], path: tuple[str, ...]) -> float | None:
    """The error of a figure: under its own key, or under that of its block; flywheels and heats have theirs side by side."""
    result: Any = errors
    beside = path[0] == "flywheel" or (
        path[0] == "energy" and len(path) > 1 and path[1] in errors and path[1] not in ("period", "work")
    )
    for key in path[1:] if beside else path:
        if isinstance(result, dict):
            result = result.get(key)
    return result if isinstance(result, int | float) else None


def without_error(result: dict[str, Any]) -> set[str]:
    paths = {path for path in numbers(result) if not {".".join(path[:n]) for n in range(1, 4)} & TOLD}
    return {".".join(path) for path in paths if error_of(result["error"], path) is None}


def sized_estimate(scene: Any, **options: Any) -> dict[str, Any]:
    return flywheel.size(flywheel.load(scene), **options).as_dict()


@pytest.mark.parametrize("path", sample(EXAMPLES, 9), ids=lambda path: path.stem)
def test_every_number_of_every_example_has_its_error(path: Path) -> None:
    scene = flywheel.load(path)
    one_way = scene.stroke is not None or scene.single_stroke is not None
    if one_way or (scene.irregularity is None and scene.inertia is None):
        return
    result = flywheel.size(scene, simulate=False).as_dict()
    assert without_error(result) == set()
    assert all(error >= 0.0 for path in numbers(result["error"]) if (error := error_of(result["error"], path)) is not None)


SCENES = {
    "wheel": scenes.yoke(flywheel={"irregularity": 0.04, "shape": "disc", "material": "carbon steel", "outer_radius": 0.6}),
    "shafts": scenes.yoke(shafts={"fast": {"ratio": 3}}, flywheel={"on": "fast", "irregularity": 0.04}),
    "analysis": scenes.yoke(flywheel={"inertia": 300}),
    "no need": scenes.yoke(inertia=[{"on": "crank", "value": 1000}]),
    "open": scenes.yoke(drive={"torque": 160}, accuracy={"closure": 0.05}),
    "areas": {"areas": {"values": [5, -4.9]}, "regime": {"speed": 3}, "flywheel": {"irregularity": 0.1}},
    "areas given": {"areas": {"values": [5, -5]}, "regime": {"speed": 3}, "flywheel": {"inertia": 10}},
} | {name: regimes.scene(name, irregularity=0.05) for name in ("kloss-press", "geared-loss", "dc-inductance")}


@pytest.mark.parametrize(
    ("name", "accuracy"), [*sample([(n, "normal") for n in SCENES], 2), *sample([(n, "audit") for n in SCENES], 18)]
)
def test_every_number_has_its_error(name: str, accuracy: str) -> None:
    assert without_error(sized_estimate(SCENES[name], accuracy=accuracy)) == set()


# --- speed-dependent machines, against 30 digits ------------------------------------------------------------------------

OTHER = ("unstable", "two-speeds-slow")  # motions that the toolkit refuses, or leaves for the faster one
ANALYSES = [(name, inertia) for name, case in regimes.CASES.items() for inertia in case.inertias if name not in OTHER]


@pytest.mark.parametrize(("name", "inertia"), sample(ANALYSES, 8))
def test_figures_of_motions_are_off_by_no_more_than_they_say(name: str, inertia: float) -> None:
    true = regimes.figures(name)["analysis"][f"{inertia:g}"]
    result = sized_estimate(regimes.scene(name, inertia=inertia), simulate=False)
    outcome = {key: result[key] for key in ("speed", "power", "multiplier")}
    errors = {key: result["error"][key] for key in outcome}
    for key, value in (("period", "period"), ("work", "drive_work")):
        outcome[value], errors[value] = result["energy"] and result["energy"][key], result["error"]["energy"]
    for key, value in outcome.items():
        if value is None or true.get(key) is None:
            continue
        scale = 1.0 if key == "multiplier" else abs(float(true[key]))
        assert abs(value - float(true[key])) <= errors[key] * scale + ROUNDING * max(scale, 1e-300), key


# --- cycles that do not close ---------------------------------------------------------------------------------------------


def figures(result: dict[str, Any], exchanged: float) -> dict[str, tuple[float, float]]:
    """Figures and the scales of their errors."""
    wheel, works = result["flywheel"], ("accumulated_max", "accumulated_min", "energy_fluctuation")
    names = ("exact", "approximate", "approximate_total", "inertia_torque", "inertia_torque_flywheel")
    outcome = {name: (wheel[name], wheel["approximate_total"]) for name in names}
    return outcome | {name: (result[name], exchanged) for name in works}


MACHINES = {
    "yoke": scenes.yoke(),
    "fast yoke": scenes.yoke(regime={"speed": "60 rad/s"}),
    "rotor": scenes.rotor(flywheel={"irregularity": 0.02}),
}
PLACED = {
    "spread": lambda work: {"torque": work / (2 * np.pi)},
    "late": lambda work: {"torque": work / 0.05, "from": 6.0, "to": 6.05},
}


@pytest.mark.parametrize("share", [1e-4, -0.03])
@pytest.mark.parametrize("place", ["spread", "late"])
@pytest.mark.parametrize("name", sample(MACHINES, 2))
def test_what_a_cycle_leaves_over_may_belong_anywhere(name: str, place: str, share: float) -> None:
    """A machine with work left over, and the same where a torque takes it up: no figure moves by more."""
    scene = MACHINES[name]
    balanced = flywheel.size(flywheel.load(scene), simulate=False)
    left = share * balanced.cycle.exchanged
    result = sized_estimate(
        scene | {"drive": {"torque": balanced.balance.value + left / (2 * np.pi)}, "accuracy": {"closure": 0.05}},
        simulate=False,
    )
    true = sized_estimate(scene | {"load": [*scene["load"], {"on": "crank", **PLACED[place](-left)}]}, simulate=False)
    assert true["reached"]
    assert not result["reached"]
    assert any("left over" in message for message in result["messages"])
    scale = balanced.cycle.exchanged + abs(left)
    closed = figures(true, scale)
    for key, (value, size) in figures(result, scale).items():
        assert abs(value - closed[key][0]) <= result["error"][key] * max(abs(value), size) + 1e-12 * size, key
        assert result["error"][key] <= 60 * abs(share), key
    for key in ("angle_speed_max", "angle_speed_min"):
        gap = abs(result[key] - true[key])
        assert min(gap, result["cycle"] - gap) <= result["error"][key], key
    work = result["power"] * result["cycle"] / result["speed"]
    assert abs(left) <= result["error"]["power"] * abs(work) * (1 + 1e-9)  # the drive's, if it is that which is off


@pytest.mark.parametrize("accuracy", ["normal", "confirm", "audit"])
def test_an_analysis_of_a_cycle_that_does_not_close(accuracy: str) -> None:
    scene = scenes.yoke(flywheel={"inertia": 300})
    balanced = flywheel.size(flywheel.load(scene), accuracy="normal")
    torque = balanced.balance.value * 1.01
    result = flywheel.size(
        flywheel.load(scene | {"drive": {"torque": torque}, "accuracy": {"closure": 0.05}}), accuracy=accuracy
    )
    assert not result.reached
    for name in ("irregularity", "speed_max", "speed_min", "period"):
        value, true = getattr(result.simulation, name), getattr(balanced.simulation, name)
        assert value is None or abs(value / true - 1) <= result.error.simulation
    assert result.error.simulation <= 0.1


@pytest.mark.parametrize("left", [0.5, 0.05, -0.4])
def test_areas_that_do_not_add_up_to_nothing(left: float) -> None:
    """Whichever area the rest belongs to, the flywheel is no further off than told."""
    areas = [10.0, -6.0, 4.0, -8.0 + left]
    request = {"regime": {"speed": 3}, "flywheel": {"irregularity": 0.1}}
    result = flywheel.size(flywheel.load({"areas": {"values": areas}, **request}))
    assert not result.reached
    assert "left over" in result.messages[0]
    for k in range(4):
        mended = [area - left * (j == k) for j, area in enumerate(areas)]
        true = flywheel.size(flywheel.load({"areas": {"values": mended}, **request}))
        assert true.reached
        assert abs(result.flywheel.exact / true.flywheel.exact - 1) <= result.error.exact * 1.1
    assert result.error.exact <= 2 * abs(left) / 10
