"""Tables of a sizing: regimes, strokes, wheels, transients."""

from __future__ import annotations

import csv
import io
import json
import math
import re
from ast import literal_eval
from functools import cache
from math import log
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.testing import assert_allclose

import flywheel
from flywheel import Sizing, run_down, run_up, transient
from flywheel.cli import main
from flywheel.components.wheel_stresses import WheelAsked, material
from flywheel.components.wheels import choose
from flywheel.machine.equation import NoMotionError
from flywheel.reference import text
from flywheel.regime import turning_moment
from flywheel.sizing.results import Stability
from flywheel.tables import motions, rows
from flywheel.tables import rows as outcome
from flywheel.tables import sizing as report
from flywheel.tables.sizing import candidates
from flywheel.tables.sizing import wheel_rows as wheel_rows
from tests.limits import sample
from tests.regimes import GEARED, KLOSS, PUMP, SECTION_C, figures
from tests.scenes import press, rotor, yoke

# The printed table: every kind of scene reads well, in order, in at most 100 columns.


MACHINES = Path(__file__).parents[2] / "examples" / "machines"
SCENES = sorted((Path(__file__).parents[1] / "references" / "scenes").glob("*.toml"))


def sized(scene: dict[str, Any] | Path, simulate: bool = False) -> Sizing:
    return _sized(scene if isinstance(scene, Path) else repr(scene), simulate)


@cache
def _sized(scene: Path | str, simulate: bool) -> Sizing:
    return flywheel.size(flywheel.load(literal_eval(scene) if isinstance(scene, str) else scene), simulate=simulate)


def number(text: str, pattern: str) -> float:
    match = re.search(pattern + r"\s*([-+0-9.e]+)", text)
    assert match, f"{pattern} not in\n{text}"
    return float(match[1])


@pytest.mark.parametrize("path", sample(SCENES, 4), ids=lambda path: path.stem)
def test_every_scene_fits_and_hides_no_nan(path: Path) -> None:
    text = report.text(sized(path))
    assert max(map(len, text.splitlines())) <= outcome.WIDTH
    assert "nan" not in text.split()
    assert "None" not in text
    assert "\x1b" not in text


def test_order_and_figures_of_a_sizing() -> None:
    sizing = sized(yoke(title="Yoke", source="p. 103"), simulate=True)
    text = report.text(sizing)
    headings = [
        "Yoke",
        "Source: p. 103",
        "Flywheel on the crank for irregularity 0.04 (±2 %, steadiness 25), crank at 60 rpm",
        "exact (Wittenbauer)",
        "accumulated areas",
        "inertia torque",
        "Proven bounds: exact between",
        "Torque, power, energy",
        "Speed of the crank",
        "Reduced inertia I*",
        "Areas of the turning moment",
        "Confirmed by time simulation",
        "Estimated relative errors",
    ]
    places = [text.index(heading) for heading in headings]
    assert places == sorted(places)
    assert number(text, r"exact \(Wittenbauer\)") == pytest.approx(353.521427322, rel=1e-9)
    assert "-1.282 %" in text
    assert "+0.1998 %" in text
    assert "0.04051842141" in text
    assert number(text, "energy fluctuation") == pytest.approx(551.1019658, rel=1e-9)
    assert "1             kW = 1.341 hp = 1.3596 metric hp" in text
    assert "1e-09 asked, reached" in text


def test_areas_carry_angles_and_marks() -> None:
    text = report.text(sized(yoke()))
    row = next(line.split() for line in text.splitlines() if line.startswith("  A2"))
    assert [row[0], row[4], row[6]] == ["A2", "S2", "least"]
    assert [float(x) for x in row[1:3]] == pytest.approx([18.560745, 161.43926], abs=1e-5)
    assert sum("greatest" in line for line in text.splitlines() if "  S" in line) == 1


def test_dominating_inertia_is_said_in_words() -> None:
    text = report.text(sized(yoke(regime={"speed": 100})))
    assert "The approximate flywheel is 44 times too small" in text
    assert "varying inertia of the machine" in text
    assert "-97.73 %" in text


def test_approximate_of_zero_is_said_in_words() -> None:
    scene = press(regime={"speed": "600 rpm"}, load=[], flywheel={"irregularity": 0.001}, gravity={})
    sizing = sized(scene)
    assert sizing.flywheel.approximate is not None
    text = report.text(sizing)
    assert "give no flywheel at all" in text or "times too small" in text


def test_own_inertia_suffices() -> None:
    sizing = sized(rotor(inertia=[{"on": "crank", "value": 900}]))
    text = report.text(sizing)
    assert sizing.flywheel.needed is False
    assert "No flywheel is needed: the machine's own inertia suffices" in text
    assert "Proven" not in text
    confirmed = report.text(sized(rotor(inertia=[{"on": "crank", "value": 900}]), simulate=True))
    assert "(asked at most 0.01)" in confirmed


def test_analysis_gives_irregularity_swing_and_steadiness() -> None:
    sizing = sized(yoke(flywheel={"inertia": 300}))
    text = report.text(sizing)
    assert sizing.simulation is not None
    eps = sizing.simulation.irregularity
    assert "Given flywheel of 300 kg m² on the crank, crank at 60 rpm" in text
    assert number(text, r"  irregularity") == pytest.approx(eps, rel=1e-9)
    assert number(text, r"as ± %\s*±") == pytest.approx(50 * eps, rel=1e-9)
    assert number(text, r"steadiness") == pytest.approx(1 / eps, rel=1e-9)
    assert "by quadrature (no time simulation)" in text


def test_areas_scene_has_no_angles() -> None:
    scene = {
        "areas": {"values": [52, -124, 72], "scale": 10},
        "regime": {"speed": 60},
        "flywheel": {"irregularity": 0.02},
    }
    text = report.text(sized(scene))
    assert "deg" not in text
    assert "does not contain the machine's own inertia" in text
    assert number(text, "accumulated areas") == pytest.approx(1240 / (0.02 * 3600), rel=1e-9)


def test_flywheel_on_another_shaft_is_named_with_its_speed() -> None:
    scene = yoke(shafts={"motor": {"ratio": 10}}, flywheel={"on": "motor", "irregularity": 0.04})
    text = report.text(sized(scene))
    assert "on shaft motor (10 turns to one of the crank)" in text
    assert number(text, "mean, shaft motor") == pytest.approx(600)


def test_balance_on_a_parameter_and_a_braking_drive() -> None:
    scene = yoke(
        parameters={"push": "balance"},
        load=[{"on": "yoke", "force": "-push", "from": 0, "to": "180 deg"}],
        drive={"torque": "-100 N m"},
    )
    text = report.text(sized(scene))
    assert "push (balance)" in text
    assert "(it brakes)" in text
    assert number(text, r"push \(balance\)") == pytest.approx(200 * 3.141592653589793, rel=1e-9)


def test_machine_that_would_stop_is_said_so(monkeypatch: pytest.MonkeyPatch) -> None:
    sizing = sized(yoke())

    def stops(*_: object) -> None:
        raise NoMotionError

    monkeypatch.setattr(turning_moment, "run", stops)
    rows = [line for line in report.text(sizing).splitlines() if "no steady motion" in line]
    assert [row.split()[0] for row in rows] == ["accumulated", "inertia"]


def test_messages_and_missed_accuracy_are_shown() -> None:
    from dataclasses import replace

    sizing = replace(sized(yoke()), messages=("a sentence " * 20,), rtol=1e-16)
    text = report.text(sizing)
    assert "Note: a sentence" in text
    assert "NOT reached" in text
    assert max(map(len, text.splitlines())) <= outcome.WIDTH


def test_idle_ports_are_named() -> None:
    scene = press(mechanism={"type": "slider-crank", "name": "press", "crank": {"length": 0.1}, "rod": {"length": 0.5}})
    text = report.text(sized(scene | {"load": [{"on": "crank", "torque": "-5", "from": 0, "to": 1}]}))
    assert "left out, as nothing depends on it" in text
    assert "press.slider" in text


def test_titles_cannot_steer_a_terminal() -> None:
    text = report.text(sized(yoke(title="a\x1b[31mb")))
    assert "\x1b" not in text


@pytest.mark.parametrize("path", sample(SCENES, 4), ids=lambda path: path.stem)
def test_inertia_torque_brackets_the_exact_flywheel(path: Path) -> None:
    sizing = sized(path)
    wheel, inertia = sizing.flywheel, sizing.reduced_inertia
    if not wheel.needed or inertia is None:
        return
    assert wheel.exact is not None
    assert wheel.inertia_torque is not None
    square = sizing.scene.flywheel_ratio**2
    slack = 1e-9 * wheel.inertia_torque
    assert wheel.inertia_torque - inertia.max / square - slack <= wheel.exact
    assert wheel.exact <= wheel.inertia_torque - inertia.min / square + slack


def test_nothing_acts() -> None:
    text = report.text(sized({"regime": {"speed": 10}, "flywheel": {"irregularity": 0.01}}))
    assert "nothing acts on the machine" in text
    assert "no steady motion" not in text
    assert "no drive in the scene" in text


# What the report says of machines whose torques depend on speed.


PRESS = {key: value for key, value in KLOSS.items() if key not in ("parameters", "drive", "inertia")} | {
    "drive": {
        "on": "motor",
        "motor": {
            "type": "induction", "power": "3 kW", "speed": "1440 rpm", "poles": 4, "frequency": "50 Hz",
            "breakdown_ratio": 2.5, "inertia": "0.02 kg m^2",
        },
    },
    "regime": {"speed": "121 rpm"},
    "flywheel": {"on": "motor", "irregularity": 0.04},
}  # fmt: skip


@cache
def _sized_once(scene: str) -> Sizing:
    return flywheel.size(flywheel.load(REGIMES[scene]), simulate=False)


def sized_regime(scene: dict[str, Any]) -> Sizing:
    return flywheel.size(flywheel.load(scene), simulate=False)


REGIMES: dict[str, dict[str, Any]] = {
    "section C": SECTION_C | {"flywheel": {"inertia": 5}},
    "section C sized": SECTION_C | {"flywheel": {"irregularity": 0.05}},
    "press": PRESS,
    "pump": PUMP | {"flywheel": {"irregularity": 0.05}},
    "geared": GEARED | {"flywheel": {"irregularity": 0.05}},
}


def regime_number(text: str, pattern: str) -> float:
    match = re.search(pattern + r"\s+(-?[0-9.e+-]+)", text)
    assert match, f"{pattern} not in\n{text}"
    return float(match[1])


@pytest.mark.parametrize("name", REGIMES)
def test_reports_fit_and_hide_no_nan(name: str) -> None:
    text = report.text(_sized_once(name))
    assert max(map(len, text.splitlines())) <= rows.WIDTH
    assert not {"nan", "None", "inf"} & set(text.split())
    assert "Proven" not in text


def test_the_multiplier_is_told_with_what_it_means() -> None:
    expected = float(figures("section-c")["analysis"]["5"]["multiplier"])
    period = float(figures("section-c")["analysis"]["5"]["period"])
    text = report.text(_sized_once("section C"))
    cycles = log(0.01) / log(expected)
    assert regime_number(text, "cycle multiplier") == pytest.approx(expected, rel=1e-5)
    assert regime_number(text, "settles to 1 % in") == pytest.approx(cycles, rel=2e-3)
    assert regime_number(text, "settles to 1 % in .* cycles,") == pytest.approx(cycles * period, rel=1e-2)
    assert "1 - multiplier" not in text


@pytest.mark.parametrize(
    ("multiplier", "damping", "expected"),
    [
        (0.5, 0.5, log(0.01) / log(0.5)),
        (0.01, 0.99, 1.0),
        (1.0, 1e-15, log(100) * 1e15),
        (0.0, 1.0, 0.0),
        (0.9, 0.4, log(0.01) / log(0.9)),  # of a pair that turns: |m| = 0.9, its real part 0.6
    ],
)
def test_cycles_to_settle(multiplier: float, damping: float, expected: float) -> None:
    assert report.settling_cycles(Stability(multiplier, damping, 1, 0.0, 1.0)) == pytest.approx(expected, rel=1e-12)


@pytest.mark.slow
def test_what_never_settles_is_said_to() -> None:
    lossy = yoke(
        shafts={"m": {"ratio": 5, "efficiency": 0.9}},
        inertia=[{"on": "m", "value": 1}],
        drive={"on": "m", "torque": "balance"},
    )
    text = report.text(sized_regime(lossy))
    assert "no torque corrects a change of speed" in text
    assert "1 - multiplier" not in text
    driven = [{"on": "crank", "torque": "3*omega - 90 + 50*sin(phi)"}]
    grows = report.text(sized_regime(rotor(load=driven, drive={"torque": "balance"})))
    assert "a change grows from cycle to cycle" in grows


def test_speed_asked_stands_beside_the_speed_taken() -> None:
    text = report.text(_sized_once("press"))
    assert regime_number(text, "asked for") == pytest.approx(121)
    assert regime_number(text, "mean of extremes") == pytest.approx(_sized_once("press").speed * 30 / 3.141592653589793)
    assert abs(regime_number(text, "mean of extremes") - 121) > 0.01
    assert "from the required speed" in text
    assert "asked for  " not in report.text(_sized_once("pump"))  # a balance keeps the speed
    assert "asked for  " not in report.text(_sized_once("section C"))


def test_areas_are_those_of_a_constant_speed() -> None:
    sizing, text = _sized_once("section C"), report.text(_sized_once("section C"))
    expected = 10 / 2.387  # weights do no net work
    assert sizing.cyclic is not None
    assert sizing.cyclic.constant_speed == pytest.approx(expected, rel=1e-12)
    assert regime_number(text, "take the torques at a constant") == pytest.approx(expected, rel=1e-6)
    assert "Areas of the turning moment at constant speed" in text
    plain = report.text(sized_regime(yoke()))
    assert "constant speed, and" not in plain
    assert "Stability of the motion" not in plain


def test_a_candidate_s_irregularity_is_that_of_its_own_motion() -> None:
    sizing = _sized_once("section C sized")
    for candidate in candidates(sizing)[1:]:
        given = sized_regime(SECTION_C | {"flywheel": {"inertia": candidate.inertia}}).simulation
        assert candidate.gives is not None
        assert given is not None
        assert candidate.gives[0] == pytest.approx(given.irregularity, rel=1e-9)
        assert candidate.motion is not None
        assert candidate.motion.speed != sizing.speed


def test_far_off_figures_are_explained_without_naming_the_wrong_cause() -> None:
    text = report.text(sized_regime(SECTION_C | {"flywheel": {"irregularity": 0.48}}))
    assert "takes torques at a constant speed" in text
    assert "at this speed the varying inertia" not in text


# `flywheel reduce` along a stroke: names and units of its own where the driver slides.


EXAMPLE = Path(__file__).parents[2] / "examples" / "machines" / "injection_clamp.toml"
LEVER = """
mechanism.type = "linkage"
mechanism.driver = "pivot"
mechanism.bodies = {frame = {points = {O = [0.1, 0]}}, arm = {mass = 3, points = {P = [0.2, 0]}}}
mechanism.joints = [{name = "pivot", type = "pin", between = ["frame.O", "arm.P"]}]
stroke = {from = "10 deg", to = "100 deg", speed = 2, acceleration = 3}
"""


def run(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


@pytest.fixture
def lever(tmp_path):
    path = tmp_path / "lever.toml"
    path.write_text(LEVER)
    return path


def test_json_of_a_driver_that_slides():
    data = json.loads(run("reduce", EXAMPLE, "--json", "--at", "190 mm", "--at", "0.1 m").stdout)
    state = flywheel.reduce(flywheel.load(EXAMPLE), [0.19, 0.1])
    assert data["reduction"] == "slide"
    assert data["stroke"] == {"from": -0.06, "to": 0.19, "speed": 0.3289474, "acceleration": 0.0}
    assert data["x"] == [0.19, 0.1]
    assert_allclose(data["reduced_mass"], state.inertia)
    assert_allclose(data["reduced_mass_slope"], state.slope)
    assert_allclose(data["reduced_force"], state.moment)
    assert_allclose(data["driving_force"], 0.5 * state.slope * 0.3289474**2 - state.moment)
    assert_allclose(sum(map(sum, data["mass_parts"].values())), state.inertia.sum())
    assert_allclose(1e3 * data["velocities"]["toggle-clamp.platen"][0], 0.02179, atol=5e-6)
    assert_allclose(1e3 * data["accelerations"]["toggle-clamp.platen"][0], -235.27, atol=5e-3)
    assert not {"phi", "inertia", "moment"} & set(data)


def test_the_clamp_has_the_masses_of_its_source():
    """At full stretch, where all lies on the platen's line: from the speeds there, to the digits that they have here."""
    v, turn, coupler, rod = 0.3289474, -0.7616, 4.0698, 0.6445  # m/s and rad/s
    half = 0.0475 * coupler  # the coupler stands at 1.89156 rad; its upper pin is the block's
    across = math.hypot(-v + half * math.sin(1.89156), half * math.cos(1.89156))
    energy = (33.2930 + 10.0088) * v**2 + 16.1475 * (0.11 * turn) ** 2 + 0.1195 * turn**2
    energy += 1.3051 * across**2 + 0.0022 * coupler**2
    energy += 16.7364 * (0.22 * turn + 0.13 * rod) ** 2 + 0.1699 * rod**2
    data = json.loads(run("reduce", EXAMPLE, "--json", "--at", "190 mm").stdout)
    assert_allclose(data["reduced_mass"], energy / v**2, rtol=2e-5)
    platen = [column[0] for name, column in data["mass_parts"].items() if name.endswith("platen")]
    assert_allclose(platen, (298.4963 + 97.4437) * data["gains"]["toggle-clamp.platen"][0] ** 2)
    weight = 16.1475 * 0.11 * turn + 16.7364 * (0.22 * turn + 0.13 * rod) - 1.3051 * half * math.cos(1.89156)
    assert_allclose(data["reduced_force"], -9.80665 * weight / v, rtol=2e-4)


def test_json_of_a_driver_that_turns(lever):
    data = json.loads(run("reduce", lever, "--json", "--at", "60 deg").stdout)
    assert data["reduction"] == "crank"
    assert_allclose(data["inertia"], 3 * 0.2**2)
    assert_allclose(data["driving_torque"], 3 * 3 * 0.2**2)
    assert not {"x", "reduced_mass", "driving_force"} & set(data)


def test_every_key_is_explained(lever):
    for scene in (EXAMPLE, lever):
        data = json.loads(run("reduce", scene, "--json", "--points", 2).stdout)
        assert all(f"`{key}`" in text("stroke") for key in {*data, *data["stroke"]} - {"title"})


def test_csv_runs_from_end_to_end_with_its_units():
    rows = list(csv.DictReader(run("reduce", EXAMPLE, "--points", 6).stdout.splitlines()))
    assert_allclose([float(row["x [m]"]) for row in rows], [-0.06, -0.01, 0.04, 0.09, 0.14, 0.19])
    state = flywheel.reduce(flywheel.load(EXAMPLE), [0.19])
    last = {key: float(value) for key, value in rows[-1].items()}
    assert_allclose(last["m* [kg]"], state.inertia)
    assert_allclose(last["dm*/dx [kg/m]"], state.slope)
    for name, unit in (("rod", "1/m"), ("platen", "1")):
        assert_allclose(last[f"g toggle-clamp.{name} [{unit}]"], state.gains[f"toggle-clamp.{name}"])
    assert_allclose(last["dg/dx toggle-clamp.rod [1/m^2]"], state.gain_slopes["toggle-clamp.rod"])
    assert_allclose(last["dg/dx toggle-clamp.platen [1/m]"], state.gain_slopes["toggle-clamp.platen"])
    assert_allclose(last["v toggle-clamp.rod [rad/s]"], 0.6445, atol=5e-5)
    assert_allclose(last["a toggle-clamp.platen [m/s^2]"], -0.23527, atol=5e-6)
    assert {"F* [N]", "F_drive [N]"} <= set(last)


@pytest.mark.parametrize(
    ("at", "code", "words"), [("30 deg", 2, "not a position"), ("0.2 m", 1, "x: found 0.2 m"), ("5", 2, "not")]
)
def test_places_that_a_stroke_does_not_have(at, code, words):
    result = run("reduce", EXAMPLE, "--at", at)
    assert (result.exit_code, result.stdout) == (code, "")
    assert words in result.stderr


def test_a_crank_has_angles(lever):
    result = run("reduce", lever, "--at", "30 mm")
    assert result.exit_code == 2
    assert "'30 mm' is not an angle with its unit" in result.stderr


def test_sizing_refuses_in_one_line():
    result = run("size", EXAMPLE)
    assert result.exit_code == 1
    (line,) = result.stderr.splitlines()
    assert "a one-way stroke, which has no cycle and so no flywheel" in line


@pytest.mark.parametrize("option", [[], ["--simplify"]])
def test_the_graph_shows_the_slide(option):
    result = run("graph", EXAMPLE, *option)
    assert result.exit_code == 0, result.stderr
    assert "1:slide" in result.stdout
    assert "crank " not in result.stdout.replace("bell_crank", "")


# A wheel in a report and in JSON.


IRON = material("grey cast iron")
ARMED = WheelAsked("arms", IRON, outer_radius=1.0, bore=0.1, torque=100.0)


def test_rows_of_a_wheel_with_arms():
    wheel = choose(200.0, 20.0, ARMED)
    found = {name: (value, unit) for name, value, unit, _ in wheel_rows(wheel)}
    assert found["shape"] == ("arms", "")
    assert found["outer radius"] == ("1000", "mm")
    assert found["inertia"] == ("200", "kg m²")
    assert found["arms"] == ("6", "")
    assert found["hub diameter"] == ("200", "mm")
    assert float(found["mass"][0]) == pytest.approx(wheel.mass, rel=1e-5)
    assert float(found["stress, rim at the arms"][0]) == pytest.approx(wheel.stresses["rim at the arms"] / 1e6, rel=1e-5)
    assert found["safety factor, by strength"][0].startswith(f"{wheel.safety:.4g}"[:4])
    assert {"mass, rim", "mass, arms", "mass, hub", "inertia, hub"} <= found.keys()
    assert len(found) == len(wheel_rows(wheel))


def test_rows_of_other_wheels():
    own = material(density=7000.0, allowable=5e6)
    thin = {name: value for name, value, _, _ in wheel_rows(choose(9.0, 20.0, WheelAsked("rim", own, "thin", width=0.1)))}
    assert thin["shape"] == "rim, taken as thin"
    assert thin["safety factor, by allowable stress"] == "1"
    assert "bore" not in thin
    bored = [
        name
        for name, _, _, _ in wheel_rows(choose(9.0, 20.0, WheelAsked("disc", material(density=7e3), width=0.1, bore=0.1)))
    ]
    assert "bore" in bored
    assert not any("safety" in name or "allowable" in name or name == "thickness" for name in bored)
    lightest = [row.label for row in wheel_rows(choose(9.0, 20.0, WheelAsked("lightest", own, max_radius=0.4)))]
    assert "the lightest disc instead" in lightest


def test_what_is_stressed_too_much_is_marked():
    bent = choose(200.0, 20.0, ARMED._replace(torque=20000.0))
    marked = {name for name, _, unit, _ in wheel_rows(bent) if unit == "MPa, above the allowable"}
    assert marked == {f"stress, {place}" for place, value in bent.stresses.items() if value > 11.5e6}
    assert "stress, arms at the hub" in marked
    assert not any("above" in unit for _, _, unit, _ in wheel_rows(choose(200.0, 5.0, ARMED)))


@pytest.mark.parametrize("asked", [ARMED, WheelAsked("disc", IRON, width=0.1), WheelAsked("lightest", IRON, max_radius=0.5)])
def test_json(asked):
    wheel = choose(20.0, 20.0, asked)
    data = json.loads(json.dumps(wheel.as_dict(), allow_nan=False))
    assert data["inertia"] == wheel.inertia
    assert data["stresses"] == dict(wheel.stresses)
    assert data["material"]["density"] == 7200.0
    assert (data["arms"] is None) == (wheel.body.arms is None)
    assert data["greatest_stress"] == max(data["stresses"].values())
    assert (data["compared"] is None) == (asked.shape != "lightest")


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
    text = motions.transient_text(found)
    assert text.startswith("Fan\nFrom 0 deg, 0 rad/s (0 rpm): ended at")
    assert "first at 95 % of it           after 1.497866 s" in text
    assert "= kinetic energy gained" in text
    assert max(map(len, text.splitlines())) <= 100


@pytest.fixture(scope="module")
def stalled():
    return motions.transient_text(run_up(flywheel.load(STALL), "20 s", rtol=1e-5))


@pytest.mark.slow
def test_a_stall_is_the_first_thing_that_is_said(stalled):
    text = stalled
    assert "stalled at crank angle" in text.splitlines()[1]
    assert "no regime:" in text
    assert max(map(len, text.splitlines())) <= 100


def test_csv_is_the_motion_evenly_in_time(found):
    rows = list(csv.reader(io.StringIO(motions.transient_csv(found, 5))))
    assert rows[0][:4] == ["t [s]", "phi [rad]", "omega [rad/s]", "alpha [rad/s^2]"]
    values = np.array(rows[1:], dtype=float)
    np.testing.assert_allclose(values[:, 0], [0, 0.5, 1, 1.5, 2])
    np.testing.assert_allclose(values[:, 2], 5 * (1 - np.exp(-2 * values[:, 0])), rtol=1e-8, atol=1e-12)


def test_json_has_the_motion_and_everything_else(found):
    data = json.loads(motions.transient_json(found, 3))
    assert data["samples"]["t"] == [0.0, 1.0, 2.0]
    assert data["samples"]["current"] is None
    assert data["energy"]["drive"] == pytest.approx(found.energy.drive)


def test_a_dc_motor_adds_its_current():
    motor = {"type": "dc", "voltage": 48, "resistance": 0.4, "constant": 0.25}
    scene = flywheel.load(
        {"inertia": [{"on": "crank", "value": 0.1}], "drive": {"motor": motor}, "flywheel": {"inertia": 0}}
    )
    found = transient(scene, end="0.1 s")
    assert motions.transient_csv(found, 2).splitlines()[0].endswith(",current [A]")
    assert float(motions.transient_csv(found, 2).splitlines()[1].rsplit(",", 1)[1]) == pytest.approx(120.0)
    assert "heat in the motor's armature" in motions.transient_text(found)


def test_a_stroke_is_told_in_metres():
    bodies = {"frame": {"points": {"O": [0, 0]}}, "ram": {"mass": 2.0}}
    guide = {"name": "O", "type": "slide", "between": ["frame.O", "ram.origin"]}
    linkage = {"type": "linkage", "driver": "O", "bodies": bodies, "joints": [guide]}
    force = [{"on": "slide", "force": "100 - 40*v"}]
    scene = flywheel.load({"mechanism": linkage, "load": force, "stroke": {"from": 0.1, "to": 0.5, "speed": 1}})
    found = transient(scene, end="stop")
    assert "the driver reached the stroke's end at 0.5 m" in motions.transient_text(found)
    assert "rpm" not in motions.transient_text(found)
    rows = motions.transient_csv(found, 2).splitlines()
    assert rows[0].startswith("t [s],x [m],v [m/s]")
    assert [float(row.split(",")[1]) for row in rows[1:]] == pytest.approx([0.1, 0.5])


@pytest.fixture(scope="module")
def pulsed():
    pulse = {"on": "crank", "torque": -30, "from": "90 deg", "to": "91 deg"}
    return transient(flywheel.load(SCENE | {"load": [pulse]}), start=4.0, end="1 turn")


def test_csv_and_json_may_have_both_sides_of_every_switch(pulsed):
    rows = np.array([row.split(",") for row in motions.transient_csv(pulsed, 3, breaks=True).splitlines()[1:]], dtype=float)
    t, phi, moment = rows[:, 0], rows[:, 1], rows[:, 4]
    assert rows.shape[0] == 3 + 4
    assert np.all(np.diff(t) >= 0.0)
    k = int(np.argmax(np.isclose(phi, np.pi / 2)))
    assert moment[k] - moment[k + 1] == pytest.approx(30.0, rel=1e-9)
    assert moment[k + 3] - moment[k + 2] == pytest.approx(30.0, rel=1e-9)
    assert len(json.loads(motions.transient_json(pulsed, 3, breaks=True))["samples"]["t"]) == 7
    assert len(motions.transient_csv(pulsed, 3).splitlines()) == 1 + 3


def test_a_run_down_is_told_without_what_it_cannot_have():
    scene = SCENE | {"load": [{"on": "crank", "torque": "-2*sign(omega)"}]}
    text = motions.transient_text(run_down(flywheel.load(scene)))
    assert "speed at the end              0 rad/s (0 rpm)" in text
    assert "95 %" not in text
    assert "after 0 s" not in text


@pytest.mark.slow
def test_moments_before_and_after_losses_are_told_apart(found, stalled):
    geared = STALL | {"shafts": {"motor": {"ratio": 2, "efficiency": 0.8}}, "drive": {"on": "motor", "torque": 10}}
    text = " ".join(
        motions.transient_text(run_up(flywheel.load(geared | {"regime": {"speed": 5}}), "8 s", rtol=1e-5)).split()
    )
    assert "the loss in its meshes holds M* = " in text
    assert ",M* after losses [N m]," in motions.transient_csv(found, 2)
    assert "losses" not in stalled


def test_every_store_has_its_energy():
    """Kinetic energies of the bodies and the flywheel add up to the whole."""
    found = motions.transient_json(flywheel.transient(flywheel.load(press()), end="0.5 s"), 5)
    data = json.loads(found)
    kinetic = np.sum(list(data["stores"]["kinetic"].values()), axis=0)
    np.testing.assert_allclose(kinetic, data["samples"]["kinetic"], rtol=1e-12)
    assert set(data["stores"]["potential"]) == {f"weight of press.{body}" for body in ("crank", "rod", "slider")}
    assert set(data["errors"]["stores"]["potential"]) == set(data["stores"]["potential"])
