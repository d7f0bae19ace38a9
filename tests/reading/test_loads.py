"""Loads read, by name and by model."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

import flywheel
from flywheel import Machine, Scene, SceneError
from flywheel.components.load_models import Compression, Space, compressor_work, cylinder_pressure, gas_force
from flywheel.numerics.expressions import Expression
from flywheel.reading.scenes import build_scene, parse_scene
from flywheel.scene.scene import Damper, Inertia, Load, Spring, Table

# Loads, springs and inertias: where they act, when, and what is refused.


TURN = 2 * math.pi
PRESS = """
[mechanism]
type = "slider-crank"
name = "press"
crank.length = 0.1
rod.length = 0.4
[regime]
speed = "300 rpm"
[flywheel]
irregularity = 0.02
"""


def scene_with(text: str, base: str = PRESS, **kwargs) -> Scene:
    return parse_scene(base + text, **kwargs)


def load_with(keys: str, base: str = PRESS) -> Load:
    (load,) = scene_with(f"\n[[load]]\n{keys}", base).loads
    return load


def fault_of(text: str, base: str = PRESS) -> dict[str, str]:
    with pytest.raises(SceneError) as caught:
        parse_scene(base + text)
    return {fault.path: str(fault) for fault in caught.value.faults}


def load_fault(keys: str, base: str = PRESS) -> dict[str, str]:
    return fault_of(f"\n[[load]]\n{keys}", base)


@pytest.mark.parametrize("on", ["slider", "press.slider"])
def test_places_get_their_full_name(on):
    assert load_with(f"on = '{on}'\nforce = 3") == Load("press.slider", 3.0, TURN, path="load[0]")


@pytest.mark.parametrize("value", ["-5 kN", "-5000", "-5e3 N", "-5000 N "])
def test_a_text_that_is_a_quantity_is_one(value):
    assert load_with(f"on = 'slider'\nforce = '{value}'").law == -5000.0


@pytest.mark.parametrize(
    "text", ["-5e3*sin(phi)", "5 if phi < pi else 0", "5*(x > 0)", "3 - 2", "5 / 2", "-300*sign(v)", "2*(v < 0)", "5."]
)
def test_any_other_text_is_an_expression(text):
    law = load_with(f"on = 'slider'\nforce = '{text}'").law
    assert isinstance(law, Expression) or law == 5.0


@pytest.mark.parametrize(
    ("keys", "path", "hint"),
    [
        ("on = 'slider'\nforce = '5 kN*sin(phi)'", "load[0].force", "without units"),
        ("on = 'slider'\nforce = '5 kg'", "load[0].force", "kgf"),
        ("on = 'slider'\nforce = '5 N m'", "load[0].force", "torque"),
        ("on = 'slider'\nforce = '1,5 kN'", "load[0].force", "write 1.5"),
        ("on = 'slider'\nforce = 'fi'", "load[0].force", "phi"),
        ("on = 'slider'\nforce = 'Omega'", "load[0].force", "omega"),
        ("on = 'slider'\nforce = '__import__(\"os\")'", "load[0].force", ""),
        ("on = 'slider'\nforce = true", "load[0].force", ""),
        ("on = 'slider'\nforce = nan", "load[0].force", "finite"),
        ("on = 'slider'\ntorque = 3", "load[0].torque", "translates"),
        ("on = 'rod'\nforce = 3", "load[0].force", "rotates"),
        ("on = 'crank'\nforce = 3", "load[0].force", "rotates"),
        ("on = 'press'\nforce = 3", "load[0].on", "press.rod"),
        ("on = 3\nforce = 3", "load[0].on", ""),
        ("force = 3", "load[0].on", "nothing"),
        ("on = 'slider'", "load[0]", "exactly one"),
        ("on = 'slider'\nforce = 3\ntable = {}", "load[0]", "exactly one"),
        ("on = 'slider'\nforce = 3\nfrom = 1", "load[0].to", "nothing"),
        ("on = 'slider'\nforce = 3\nto = 1", "load[0].from", "nothing"),
        ("on = 'slider'\nforce = 3\nfrom = 1\nto = 1", "load[0].to", "begins"),
        ("on = 'slider'\nforce = 3\nfrom = '-90 deg'\nto = '270 deg'\nevery = '180 deg'", "load[0].to", "180"),
        ("on = 'slider'\nforce = 3\nfrom = 0\nto = 7", "load[0].to", 'write "7 deg"'),
        ("on = 'slider'\nforce = 3\nfrom = '-180 deg'\nto = '270 deg'", "load[0].to", "450 deg"),
        ("on = 'slider'\nforce = 3\nfrom = '30 deg'\nto = '-330 deg'", "load[0].to", "begins"),
        ("on = 'slider'\nforce = 3\nwhile = 'v >= 0'", "load[0].while", '"v > 0"'),
        ("on = 'slider'\nforce = 3\nwhile = 1", "load[0].while", ""),
        ("on = 'slider'\nforce = 3\nevery = '100 deg'", "load[0].every", "divides"),
        ("on = 'slider'\nforce = 3\nevery = '720 deg'", "load[0].every", "divides"),
        ("on = 'slider'\nforce = 3\nevery = 0", "load[0].every", "above 0"),
        ("on = 'slider'\nforce = 3\nevery = 1e-9", "load[0].every", "1000 times"),
        ("on = 'slider'\nforce = 3\nuntil = 3", "load[0].until", "known key"),
    ],
)
def test_faulty_loads(keys, path, hint):
    assert hint in load_fault(keys)[path]


@pytest.mark.parametrize(
    ("text", "speed", "time"),
    [("v*3", True, False), ("-omega*abs(omega)", True, False), ("t", False, True), ("v*sin(t)", True, True)]
    + [(text, False, False) for text in ("sign(v)", "3*(v > 0)", "2 if v < 0 else 1", "x*sin(phi)")],
)
def test_only_the_sign_of_a_velocity_follows_from_the_position(text, speed, time):
    law = load_with(f"on = 'slider'\nforce = '{text}'").law
    assert isinstance(law, Expression)
    assert (law.uses_speed, law.uses_time) == (speed, time)


def test_the_second_load_has_its_own_index():
    keys = "on = 'slider'\nforce = 3\n[[load]]\non = 'slider'\nforce = 3\nfrom = 'ten'\nto = 1"
    assert list(load_fault(keys)) == ["load[1].from"]


@pytest.mark.parametrize(
    ("window", "expected"),
    [
        ("from = '30 deg'\nto = '120 deg'", (30, 120)),
        ("from = '300 deg'\nto = '60 deg'", (300, 60)),
        ("from = '-60 deg'\nto = '60 deg'", (300, 60)),
        ("from = '360 deg'\nto = '60 deg'", (0, 60)),
        ("from = '300 deg'\nto = 0", (300, 360)),
        ("from = '270 deg'\nto = '-180 deg'", (270, 180)),
        ("from = '30 deg'\nto = '60 deg'\nevery = '120 deg'", (30, 60)),
        ("from = '90 deg'\nto = '90.01 deg'", (90, 90.01)),
        ("from = '340 deg'\nto = '361 deg'", (340, 1)),
        ("from = '361 deg'\nto = '420 deg'", (1, 60)),
        ("from = '-400 deg'\nto = '-300 deg'", (320, 60)),
        ("from = '100 deg'\nto = '130 deg'\nevery = '120 deg'", (100, 10)),
    ],
)
def test_windows_are_brought_into_one_period(window, expected):
    load = load_with(f"on = 'slider'\nforce = 3\n{window}")
    assert (math.degrees(load.start), math.degrees(load.end)) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    "window",
    ["", "from = 0\nto = '360 deg'", "from = '-180 deg'\nto = '180 deg'", "from = 0\nto = '90 deg'\nevery = '90 deg'"],
)
def test_a_window_of_a_whole_period_is_always(window):
    load = load_with(f"on = 'slider'\nforce = 3\n{window}")
    assert (load.start, load.end) == (None, None)


@pytest.mark.parametrize(("text", "sense"), [("v > 0", 1), ("v<0", -1), (" v  >0 ", 1)])
def test_while(text, sense):
    assert load_with(f"on = 'slider'\nforce = 3\nwhile = '{text}'").sense == sense


def test_every_is_put_exactly_onto_a_fraction_of_the_travel():
    assert load_with("on = 'slider'\nforce = 3\nevery = 2.0943951024").every == TURN / 3


SHAFT = """
[shafts]
side.ratio = {ratio}
[mechanism]
type = "scotch-yoke"
shaft = "side"
crank.length = 0.1
[regime]
speed = 1
cycle = "{cycle} deg"
[flywheel]
inertia = 1
"""


@pytest.mark.parametrize(
    ("ratio", "cycle", "every"),
    [(1, 720, 720), (2, 360, 360), (3, 720, 720), (0.5, 720, 360), (0.25, 1440, 360), (0.3333333333, 1080, 360)],
)
def test_the_default_period_on_a_port(ratio, cycle, every):
    load = load_with("on = 'yoke'\nforce = 3", SHAFT.format(ratio=ratio, cycle=cycle))
    assert math.degrees(load.every) == pytest.approx(every, rel=1e-14)


def test_a_ratio_that_fits_neither_way_needs_its_own_period():
    base = SHAFT.format(ratio=1.5, cycle=720)
    assert "divides the 1080 deg" in load_fault("on = 'yoke'\nforce = 3", base)["load[0].every"]
    assert load_with("on = 'yoke'\nforce = 3\nevery = '1080 deg'", base).every == 3 * TURN
    assert load_with("on = 'side'\ntorque = 3", base).every == 2 * TURN


def test_several_mechanisms_and_bare_names():
    base = """
[[mechanism]]
type = "slider-crank"
name = "left"
crank.length = 0.1
rod.length = 0.4
[[mechanism]]
type = "slider-crank"
name = "right"
phase = "180 deg"
crank.length = 0.1
rod.length = 0.4
[[mechanism]]
type = "scotch-yoke"
name = "pump"
crank.length = 0.1
[regime]
speed = 1
[flywheel]
inertia = 1
"""
    assert load_with("on = 'yoke'\nforce = 3", base).on == "pump.yoke"
    assert load_with("on = 'right.slider'\nforce = 3", base).on == "right.slider"
    message = load_fault("on = 'slider'\nforce = 3", base)["load[0].on"]
    assert "left.slider" in message
    assert "right.slider" in message


def test_a_name_that_is_a_shaft_and_a_port_is_ambiguous():
    assert "press.rod" in load_fault("on = 'rod'\ntorque = 3\n[shafts]\nrod.ratio = 2")["load[0].on"]


def test_a_mechanism_of_unknown_type_hides_its_ports():
    base = PRESS.replace("slider-crank", "slidercrank")
    result = load_fault("on = 'slider'\nforce = 3", base)
    assert list(result) == ["mechanism.type"]
    assert '"slider-crank"' in result["mechanism.type"]


def test_dampers_take_the_dimension_of_their_place():
    scene = scene_with("""
[[damper]]
on = "slider"
coefficient = "3 kN s/m"
[[damper]]
on = "crank"
coefficient = "2 N m s/rad"
[[damper]]
on = "rod"
coefficient = 0
""")
    assert scene.dampers == (
        Damper("press.slider", 3000.0, "damper[0]"),
        Damper("crank", 2.0, "damper[1]"),
        Damper("press.rod", 0.0, "damper[2]"),
    )


@pytest.mark.parametrize(
    ("keys", "path", "hint"),
    [
        ("coefficient = 3", "damper[0].on", "nothing"),
        ("on = 'slider'", "damper[0].coefficient", "nothing"),
        ("on = 'slider'\ncoefficient = -3", "damper[0].coefficient", "at least 0"),
        ("on = 'slider'\ncoefficient = '3 N m s'", "damper[0].coefficient", "N s/m"),
        ("on = 'crank'\ncoefficient = '3 N s/m'", "damper[0].coefficient", "N m s"),
        ("on = 'slider'\ncoefficient = 'v'", "damper[0].coefficient", ""),
        ("on = 'slider'\ncoefficient = 3\nrest = 1", "damper[0].rest", "known key"),
    ],
)
def test_faulty_dampers(keys, path, hint):
    assert hint in fault_of(f"\n[[damper]]\n{keys}")[path]


def test_inertias_and_springs_take_the_dimension_of_their_place():
    scene = scene_with("""
[[inertia]]
on = "slider"
value = "5 kg"
[[inertia]]
on = "crank"
value = "5 kg m^2"
[[spring]]
on = "slider"
stiffness = "2 kN/m"
rest = "300 mm"
[[spring]]
on = "rod"
stiffness = "2 N m/rad"
rest = "-5 deg"
""")
    assert scene.inertias == (Inertia("press.slider", 5.0, "inertia[0]"), Inertia("crank", 5.0, "inertia[1]"))
    assert scene.springs == (
        Spring("press.slider", 2000.0, 0.3, "spring[0]"),
        Spring("press.rod", 2.0, -math.pi / 36, "spring[1]"),
    )


@pytest.mark.parametrize(
    ("text", "path"),
    [
        ("[[inertia]]\non = 'slider'\nvalue = '5 kg m^2'", "inertia[0].value"),
        ("[[inertia]]\non = 'slider'\nvalue = -5", "inertia[0].value"),
        ("[[inertia]]\non = 'slider'", "inertia[0].value"),
        ("[[inertia]]\nvalue = 3", "inertia[0].on"),
        ("[[spring]]\non = 'slider'\nstiffness = '5 N m/rad'", "spring[0].stiffness"),
        ("[[spring]]\non = 'slider'\nstiffness = 5\nrest = '5 deg'", "spring[0].rest"),
        ("[[spring]]\non = 'crank'\nstiffness = 5", "spring[0].on"),
        ("[[spring]]\non = 'slider'", "spring[0].stiffness"),
    ],
)
def test_faulty_inertias_and_springs(text, path):
    assert path in fault_of("\n" + text)


@pytest.mark.parametrize(
    "mechanism",
    [
        "type = 'crank-shaper'\ncrank.length = 0.5\nframe.length = 0.3\nrocker.length = 1",
        "type = 'four-bar'\nground.length = 0.1\ncrank.length = 0.3\ncoupler.length = 0.3\nrocker.length = 0.3",
        "type = 'law'\noutputs.rocker = {theta = 'phi + 0.1*sin(phi)', inertia = 1}",
    ],
)
def test_no_spring_on_a_port_that_does_not_return(mechanism):
    base = f"[mechanism]\n{mechanism}\n[regime]\nspeed = 1\n[flywheel]\ninertia = 1\n"
    assert "comes back" in fault_of("[[spring]]\non = 'rocker'\nstiffness = 5", base)["spring[0].on"]


def test_a_drive_may_be_a_quantity_or_an_expression():
    assert scene_with("[drive]\ntorque = '50 N m'").drive == Load("crank", 50.0, TURN, path="drive")
    assert isinstance(scene_with("[drive]\ntorque = '50*sin(phi)**2'").drive.law, Expression)


# Load models in scenes: what they come to in a sized machine, and what is refused.


R, ROD = 0.05, 0.2
STROKE = 2 * R
MODEL_TURN = 2 * np.pi


def model_scene_with(model: Any, on: str = "slider", base: dict[str, Any] | None = None, **load: Any) -> Scene:
    machine = {
        "mechanism": {"type": "slider-crank", "crank": {"length": R}, "rod": {"length": ROD}, "slider": {"mass": 2}},
        "shafts": {"fast": {"ratio": 2.5}},
        "drive": {"torque": "balance"},
        "regime": {"speed": "200 rpm"},
        "flywheel": {"irregularity": 0.03},
    }
    return build_scene(machine | (base or {}) | {"load": [{"on": on, "model": model} | load]})


def model_with(model: Any, on: str = "slider", **load: Any) -> Load:
    return model_scene_with(model, on, **load).loads[0]


def faults_of(model: Any, on: str = "slider", base: dict[str, Any] | None = None, **load: Any) -> dict[str, str]:
    with pytest.raises(SceneError) as caught:
        model_scene_with(model, on, base, **load)
    return {fault.path: str(fault) for fault in caught.value.faults}


def x_of(phi: Any) -> Any:
    return R * np.cos(phi) + np.sqrt(ROD**2 - (R * np.sin(phi)) ** 2)


def rate_of(phi: Any) -> Any:
    return -R * np.sin(phi) - R**2 * np.sin(phi) * np.cos(phi) / np.sqrt(ROD**2 - (R * np.sin(phi)) ** 2)


def swing_of(moment: Any, edges: list[float]) -> tuple[float, float]:
    """Balance torque and energy fluctuation of a moment by quadrature between edges and roots on a fine grid."""
    edges = sorted({0.0, *edges, MODEL_TURN})

    def work(a: float, b: float) -> float:
        return float(quad(moment, a, b, epsabs=0, epsrel=1e-12, limit=200)[0])

    torque = -sum(work(a, b) for a, b in pairwise(edges)) / MODEL_TURN
    ends = set(edges)
    for a, b in pairwise(edges):
        grid = np.linspace(a, b, 101)[1:-1]
        values = np.array([moment(phi) + torque for phi in grid])
        for k in np.flatnonzero(np.sign(values[1:]) * np.sign(values[:-1]) < 0):
            ends.add(brentq(lambda phi: moment(phi) + torque, grid[k], grid[k + 1], xtol=1e-15))
    ends = sorted(ends)
    levels = np.cumsum([0.0, *(work(a, b) + torque * (b - a) for a, b in pairwise(ends))])
    return torque, float(np.ptp(levels))


def crank_angle(x: float, low: float, high: float) -> float:
    """Crank angle of a position of the slider, between two dead centres."""
    return float(brentq(lambda phi: x_of(phi) - x, low, high, xtol=1e-15))


# -- presses -------------------------------------------------------------------------------------------------------------

HOLE = 6e6 * np.pi * 0.04 * 0.015
SHEAR = 250e6 * np.pi * 0.04 * 0.015
PRESSES = [
    ({"type": "punch", "diameter": "40 mm", "thickness": "15 mm", "energy_per_area": "6 J/mm^2"}, HOLE),
    ({"type": "punch", "perimeter": np.pi * 0.04, "thickness": 0.015, "shear_strength": "250 MPa"}, SHEAR * 0.015),
    ({"type": "press", "energy": "3 kJ", "thickness": 0.015}, 3000.0),
    ({"type": "press", "area": "2000 mm^2", "thickness": 0.015, "energy_per_area": 1e6}, 2000.0),
]


@pytest.mark.parametrize("shape", ["constant", "triangular"])
@pytest.mark.parametrize(("end", "window"), [("max", (np.pi, MODEL_TURN)), ("min", (0.0, np.pi))])
@pytest.mark.parametrize(("model", "energy"), PRESSES)
def test_a_press_gives_its_energy_on_the_last_of_its_way(model, energy, shape, end, window):
    result = flywheel.size(model_scene_with(model | {"shape": shape, "end": end}), simulate=False)
    thickness, sign = 0.015, 1 if end == "max" else -1
    energy = energy * (0.5 if "shear_strength" in model and shape == "triangular" else 1.0)
    force = energy / thickness * (2 if shape == "triangular" else 1)
    last = ROD + R if end == "max" else ROD - R
    met = crank_angle(last - sign * thickness, *window)

    def moment(phi: float) -> float:
        if not met <= phi < window[1]:
            return 0.0
        left = sign * (last - x_of(phi)) / thickness
        return -sign * force * (left if shape == "triangular" else 1.0) * rate_of(phi)

    torque, swing = swing_of(moment, [met, window[1]])
    assert result.balance.value * MODEL_TURN == pytest.approx(energy, rel=1e-11)
    assert torque * MODEL_TURN == pytest.approx(energy, rel=1e-11)
    assert result.energy_fluctuation == pytest.approx(swing, rel=1e-9)


@pytest.mark.parametrize("end", ["max", "min"])
def test_an_angle_before_the_end_is_a_way(end):
    load = model_with({"type": "press", "energy": 1000.0, "angle": "40 deg", "end": end})
    result = flywheel.size(
        model_scene_with({"type": "press", "energy": 1000.0, "angle": "40 deg", "end": end}), simulate=False
    )
    assert result.balance.value * MODEL_TURN == pytest.approx(1000.0, rel=1e-11)
    dead = MODEL_TURN if end == "max" else np.pi
    way = abs(x_of(dead) - x_of(dead - np.radians(40)))
    force = float(load.law.evaluate({"x": x_of(dead - 0.1), "v": 1.0 if end == "max" else -1.0}, np))
    assert abs(force) == pytest.approx(1000.0 / way, rel=1e-12)
    starts = [area["from"] for area in result.as_dict()["areas"]]
    assert min(abs(start - (dead - np.radians(40))) for start in starts) < 1e-9


def test_an_angle_with_a_sheared_area_has_the_energy_of_the_sheet():
    model = {"type": "punch", "diameter": 0.04, "thickness": 0.015, "energy_per_area": 6e6, "angle": "30 deg"}
    assert flywheel.size(model_scene_with(model), simulate=False).balance.value * MODEL_TURN == pytest.approx(
        HOLE, rel=1e-11
    )


def test_overtravel_ends_the_force_before_the_end():
    model = {"type": "punch", "energy": 2000.0, "thickness": 0.01, "overtravel": "3 mm"}
    scene = model_scene_with(model)
    assert flywheel.size(scene, simulate=False).balance.value * MODEL_TURN == pytest.approx(2000.0, rel=1e-11)
    law = scene.loads[0].law
    way = np.array([0.0131, 0.0129, 0.0031, 0.0029])
    assert law.evaluate({"x": ROD + R - way, "v": np.ones(4)}, np) == pytest.approx([0, -2e5, -2e5, 0])


@pytest.mark.parametrize(("on", "ratio"), [("crank", 1.0), ("fast", 2.5)])
@pytest.mark.parametrize("shape", ["constant", "triangular"])
def test_a_press_on_a_shaft_gives_its_energy_over_the_loads_window(on, ratio, shape):
    load = {"from": "300 deg", "to": "20 deg"}
    model = {"type": "press", "energy": 600.0, "shape": shape}
    result = flywheel.size(model_scene_with(model, on, **load), simulate=False)
    assert result.balance.value * MODEL_TURN == pytest.approx(600.0, rel=1e-12)
    twice = model_scene_with(model, on, every="180 deg", **{"from": "-20 deg", "to": "20 deg"})
    assert flywheel.size(twice, simulate=False).balance.value * MODEL_TURN == pytest.approx(1200.0, rel=1e-12)
    if shape == "constant":
        assert float(twice.loads[0].law.evaluate({}, np)) == pytest.approx(-600.0 / (ratio * np.radians(40)))


def test_a_press_on_a_rocker_works_over_an_angle_of_the_crank():
    bars = {"ground": 4.0, "crank": 1.0, "coupler": 2.5, "rocker": 3.0}
    base = {"mechanism": {"type": "four-bar"} | {name: {"length": length} for name, length in bars.items()}}
    result = flywheel.size(
        model_scene_with({"type": "press", "energy": 50.0, "angle": "25 deg"}, "rocker", base), simulate=False
    )
    assert result.balance.value * MODEL_TURN == pytest.approx(50.0, rel=1e-10)


def test_a_window_picks_one_of_two_strokes():
    model = {"type": "press", "energy": 50.0, "thickness": 0.01}
    base = {"regime": {"speed": 10.0, "cycle": "720 deg"}}
    both = flywheel.size(model_scene_with(model, base=base), simulate=False)
    one = flywheel.size(model_scene_with(model, base=base, **{"from": 0, "to": "360 deg"}), simulate=False)
    assert both.balance.value * 2 * MODEL_TURN == pytest.approx(100.0, rel=1e-11)
    assert one.balance.value * 2 * MODEL_TURN == pytest.approx(50.0, rel=1e-11)


# -- gas -----------------------------------------------------------------------------------------------------------------

PUMP = {"type": "compressor", "bore": 0.1, "clearance": 0.05, "suction": "1 bar", "discharge": "7 bar", "exponent": 1.3}


@pytest.mark.parametrize(
    ("changes", "cycle"),
    [
        ({}, Compression(1e5, 7e5, 0.05, 1.3, 1.3)),
        ({"side": "min", "atmosphere": 0}, Compression(1e5, 7e5, 0.05, 1.3, 1.3)),
        ({"expansion_exponent": 1.2}, Compression(1e5, 7e5, 0.05, 1.3, 1.2)),
        ({"clearance": 0, "exponent": 1}, Compression(1e5, 7e5, 0.0, 1.0, 1.0)),
    ],
)
def test_a_compressor_takes_the_work_of_its_cycle(changes, cycle):
    result = flywheel.size(model_scene_with(PUMP | changes), simulate=False)
    area = np.pi * 0.01 / 4
    assert result.balance.value * MODEL_TURN == pytest.approx(compressor_work(cycle, area * STROKE), rel=1e-9)
    low, high = ROD - R, ROD + R
    space = Space(area, low, high) if changes.get("side") == "min" else Space(area, high, low)
    atmosphere = changes.get("atmosphere", 101325.0)

    def moment(phi: float) -> float:
        share = abs(x_of(phi) - space.near) / STROKE
        pressure = cylinder_pressure(share, rate_of(phi) * space.sense < 0, cycle)
        return float(gas_force(pressure, space, atmosphere)) * rate_of(phi)

    ways = [space.near + (space.far - space.near) * s for s in (cycle.delivery_begins, cycle.suction_begins) if 0 < s < 1]
    edges = [crank_angle(x, *half) for x in ways for half in ((0.0, np.pi), (np.pi, MODEL_TURN))]
    assert result.energy_fluctuation == pytest.approx(swing_of(moment, [np.pi, *edges])[1], rel=1e-8)


def test_a_double_acting_compressor_takes_the_work_of_both_sides():
    model = PUMP | {"double_acting": True, "rod": "30 mm"}
    cycle, areas = Compression(1e5, 7e5, 0.05, 1.3, 1.3), (np.pi * 0.01 / 4, np.pi * (0.01 - 0.0009) / 4)
    result = flywheel.size(model_scene_with(model), simulate=False)
    work = sum(compressor_work(cycle, area * STROKE) for area in areas)
    assert result.balance.value * MODEL_TURN == pytest.approx(work, rel=1e-9)
    assert model_scene_with(model).loads[0].model == f"compressor: double-acting, ratio 7, {work:.6g} J a double stroke"


LOOP = {"position": [0, 0.2, 0.2, 0.7, 1], "out": [6, 5, 4, 2, 1.5], "back": [6, 3, 3, 1.1, 1.5]}


@pytest.mark.parametrize("side", ["max", "min"])
def test_an_indicator_diagram_gives_the_area_of_its_loop(side):
    model = {"type": "indicator", "bore": 0.1, "pressure_unit": "bar", "side": side} | LOOP
    result = flywheel.size(model_scene_with(model), simulate=False)
    gap = np.array(LOOP["out"]) - np.array(LOOP["back"])
    work = 1e5 * np.trapezoid(gap, LOOP["position"]) * np.pi * 0.01 / 4 * STROKE
    assert result.balance.value * MODEL_TURN == pytest.approx(-work, rel=1e-11)
    gauge = model | {"gauge": True}
    assert flywheel.size(model_scene_with(gauge), simulate=False).balance.value == pytest.approx(
        result.balance.value, rel=1e-11
    )


def test_volumes_stand_for_positions():
    volumes = {"volume": [50, 90, 90, 190, 250]} | {key: LOOP[key] for key in ("out", "back")}
    model = {"type": "indicator", "bore": 0.1, "pressure_unit": "bar"}
    by_volume, by_position = (model_with(model | rows).law for rows in (volumes, LOOP))
    at = {"x": np.linspace(0.151, 0.249, 7), "v": np.array([1, -1, 1, -1, 1, -1, 1])}
    assert by_volume.evaluate(at, np) == pytest.approx(by_position.evaluate(at, np), rel=1e-12)


def test_a_diagram_against_angle_is_a_table_of_forces():
    table = {"angle": [0, 90, 360], "angle_unit": "deg", "value": [5, 3, 5], "value_unit": "bar", "interpolation": "pchip"}
    law = model_with({"type": "indicator", "bore": 0.1, "rod": 0.02, "side": "min", "table": table}).law
    assert isinstance(law, Table)
    assert law.value == pytest.approx((np.array([5e5, 3e5, 5e5]) - 101325) * np.pi * (0.01 - 0.0004) / 4)
    assert law.interpolation == "pchip"
    short = {"angle": [0, 1], "value": [5, 3]}
    assert "360 deg" in faults_of({"type": "indicator", "bore": 0.1, "table": short})["load[0].model.table"]


def test_bevan_12_3_double_acting_engine_with_its_pressures_on_both_sides():
    """Bore 9 in, rod 2 in, crank 12 in, connecting rod 60 in, 160 and 32 psi at 40 deg: 6117.47 lbf ft exactly."""
    spaces = [("max", 160, 0), ("min", 32, "2 in")]
    flat = {"angle": [0, 360], "angle_unit": "deg", "value_unit": "psi"}
    models = [
        {"type": "indicator", "bore": "9 in", "rod": rod, "side": side, "table": flat | {"value": [p, p]}, "gauge": True}
        for side, p, rod in spaces
    ]
    machine = {
        "mechanism": {"type": "slider-crank", "crank": {"length": "12 in"}, "rod": {"length": "60 in"}},
        "load": [{"on": "slider", "model": model} for model in models],
        "drive": {"torque": "balance"},
        "regime": {"speed": 1.0},
        "flywheel": {"inertia": 1.0},
    }
    moment = Machine(build_scene(machine)).reduce(np.radians(40)).moment
    pound_foot = 4.4482216152605 * 0.3048
    assert float(moment) / pound_foot == pytest.approx(6117.467822013093, rel=1e-12)


# -- what resists --------------------------------------------------------------------------------------------------------

SPEEDS = np.array([-20.0, -0.5, 0.5, 20.0])
RESISTING = [
    ("crank", {"type": "constant", "torque": "3 N m"}, lambda v: -3 * np.sign(v)),
    ("slider", {"type": "constant", "force": "3 N"}, lambda v: -3 * np.sign(v)),
    ("fast", {"type": "fan", "torque": 30, "speed": 20}, lambda v: -30 * v * abs(v) / 400),
    ("crank", {"type": "fan", "power": "600 W", "speed": 20}, lambda v: -30 * v * abs(v) / 400),
    ("crank", {"type": "pump", "torque": 30, "speed": 20, "constant": 10}, lambda v: -np.sign(v) * (10 + 20 * v * v / 400)),
    ("slider", {"type": "fan", "force": 8, "velocity": 2}, lambda v: -2 * v * abs(v)),
    ("slider", {"type": "fan", "power": 16, "velocity": 2}, lambda v: -2 * v * abs(v)),
    ("rod", {"type": "losses", "proportional": "0.2 N m s", "quadratic": 0.1}, lambda v: -0.2 * v - 0.1 * v * abs(v)),
    ("slider", {"type": "losses", "constant": 5, "quadratic": "3 N s^2/m^2"}, lambda v: -5 * np.sign(v) - 3 * v * abs(v)),
    ("crank", {"type": "belt", "tight": 900, "slack": 300, "radius": "250 mm"}, lambda v: -150 * np.sign(v)),
    ("crank", {"type": "belt", "power": 3000, "speed": 20}, lambda v: -150 * np.sign(v)),
]


@pytest.mark.parametrize(("on", "model", "wanted"), RESISTING)
def test_what_resists(on, model, wanted):
    load = model_with(model, on)
    own = "v" if on in ("slider", "rod") else "omega"
    assert isinstance(load.law, Expression)
    assert load.law.names <= {own, "v"}
    values = load.law.evaluate({"v": SPEEDS, "omega": SPEEDS}, np)
    assert values == pytest.approx(wanted(SPEEDS), rel=1e-14)
    assert load.model.startswith(f"{model['type']}: ")


def test_a_belt_at_its_limit_just_holds():
    limit = float(np.exp(0.3 * np.pi))
    belt = {"type": "belt", "slack": 100.0, "radius": 0.2, "friction": 0.3, "wrap": "180 deg"}
    assert model_with(belt | {"tight": 100 * limit}, "crank").model
    assert "slips" in faults_of(belt | {"tight": 101 * limit}, "crank")["load[0].model.tight"]
    assert model_with(belt | {"tight": 101 * limit, "groove": "40 deg"}, "crank").model


# -- faults --------------------------------------------------------------------------------------------------------------

MODEL_PRESS = {"type": "press", "energy": 100.0, "thickness": 0.01}
LAW = {"type": "indicator", "bore": 0.1} | LOOP


@pytest.mark.parametrize(
    ("on", "model", "path", "hint"),
    [
        ("slider", 3, "", "a table"),
        ("slider", {}, ".type", "compressor"),
        ("slider", {"type": "pres"}, ".type", 'did you mean "press"?'),
        ("slider", {"type": ["press"]}, ".type", "one of"),
        ("slider", {"type": "constant", "force": 3, "torqe": 2}, ".torqe", "known key"),
        ("slider", {"type": "constant", "torque": 3}, ".torque", "translates"),
        ("slider", {"type": "constant"}, ".force", "nothing"),
        ("crank", {"type": "constant", "torque": -3}, ".torque", "above 0"),
        ("crank", {"type": "fan", "torque": 3, "power": 3, "speed": 2}, "", "exactly one"),
        ("crank", {"type": "fan", "torque": 3}, ".speed", "nothing"),
        ("crank", {"type": "fan", "torque": 3, "speed": 2, "velocity": 3}, ".velocity", "give a speed"),
        ("crank", {"type": "fan", "power": 3, "speed": 2, "constant": 2}, ".constant", "at most the 1.5 N m"),
        ("crank", {"type": "fan", "power": 3, "speed": 2, "constant": "1 N"}, ".constant", "torque"),
        ("slider", {"type": "losses"}, "", "one of them"),
        ("slider", {"type": "losses", "quadratic": "1 kg m^2"}, ".quadratic", "drag"),
        ("slider", {"type": "belt", "power": 3, "speed": 2}, ".type", "translates"),
        ("crank", {"type": "belt", "power": 3}, ".speed", "nothing"),
        ("crank", {"type": "belt", "power": 3, "speed": 2, "radius": 1}, ".radius", "none"),
        ("crank", {"type": "belt", "tight": 3, "slack": 4, "radius": 1}, ".tight", "slack"),
        ("crank", {"type": "belt", "tight": 3, "slack": 2}, ".radius", "nothing"),
        ("crank", {"type": "belt", "tight": 3, "slack": 2, "radius": 1, "friction": 0.2}, ".wrap", "nothing"),
        ("slider", {"type": "press", "thickness": 0.01}, "", "exactly one"),
        ("slider", MODEL_PRESS | {"shear_strength": 1e6}, "", "exactly one"),
        ("slider", MODEL_PRESS | {"diameter": 0.1}, ".diameter", "none"),
        ("slider", MODEL_PRESS | {"angle": 0.1}, ".thickness", "one of them"),
        ("slider", {"type": "press", "energy": 10}, ".thickness", "nothing"),
        ("slider", {"type": "press", "shear_strength": 1e6, "diameter": 0.1}, ".thickness", "nothing"),
        ("slider", {"type": "press", "shear_strength": 1e6, "thickness": 0.1}, "", "exactly one"),
        ("slider", MODEL_PRESS | {"thickness": 0.11}, ".thickness", "stroke of 0.1 m"),
        ("slider", MODEL_PRESS | {"overtravel": 0.095}, ".thickness", "0.105 m with what is beyond it"),
        ("slider", MODEL_PRESS | {"shape": "round"}, ".shape", "triangular"),
        ("slider", MODEL_PRESS | {"end": "top"}, ".end", "min"),
        ("slider", {"type": "press", "energy": 10, "angle": "190 deg"}, ".angle", "moves towards that end"),
        ("slider", {"type": "press", "energy": 10, "angle": "9 deg", "overtravel": 0.01}, ".overtravel", "less than"),
        ("rod", MODEL_PRESS, ".thickness", "rotates"),
        ("rod", {"type": "press", "energy": 10}, ".angle", "nothing"),
        ("crank", {"type": "press", "energy": 10}, "", "without a window"),
        ("crank", MODEL_PRESS, ".thickness", "from and to"),
        ("crank", LAW, ".type", "a port that translates"),
        ("slider", {"type": "indicator", "bore": 0.1}, "", "exactly one"),
        ("slider", LAW | {"rod": 0.2}, ".rod", "less than the bore"),
        ("slider", LAW | {"gauge": 1}, ".gauge", "true or false"),
        ("slider", LAW | {"gauge": True, "atmosphere": 1e5}, ".atmosphere", "none"),
        ("slider", LAW | {"out": [1, 2]}, ".position", "the same number of each"),
        ("slider", LAW | {"out": 3}, ".out", "a list"),
        ("slider", LAW | {"out": [1, 2, 3, -4, 5]}, ".out", "gauge"),
        ("slider", LAW | {"out": [1, 2, 3, 1e60, 5]}, ".out", "at most"),
        ("slider", LAW | {"pressure_unit": "kg"}, ".pressure_unit", "pressure"),
        ("slider", LAW | {"pressure_unit": 3}, ".pressure_unit", "pressure"),
        ("slider", LAW | {"position": [0, 0.2, 0.1, 0.7, 1]}, ".position", "ascend"),
        ("slider", LAW | {"position": [0.1, 0.2, 0.2, 0.7, 1]}, ".position", "from 0"),
        ("slider", LAW | {"table": {"angle": [0, 1], "value": [0, 1]}}, "", "exactly one"),
        ("slider", {"type": "indicator", "bore": 0.1, "table": {"angle": [0, 7], "value": [-1, 1]}}, ".table", "gauge"),
        ("slider", PUMP | {"discharge": "1 bar"}, ".discharge", "more than"),
        ("slider", PUMP | {"clearance": "50 %"}, ".clearance", "stages"),
        ("slider", PUMP | {"rod": 0.02}, ".rod", "single-acting"),
        ("slider", PUMP | {"exponent": 20}, ".exponent", "at most 10"),
        ("rod", PUMP, ".type", "a port that translates"),
        ("slider", {"type": "compressor"}, ".clearance", "nothing"),
    ],
)
def test_faulty_models(on, model, path, hint):
    assert hint in faults_of(model, on)[f"load[0].model{path}"]


def test_a_model_stands_alone_and_its_window_may_be_faulty():
    assert "exactly one" in faults_of(MODEL_PRESS, force=3)["load[0]"]
    assert set(faults_of({"type": "press", "energy": 10}, "crank", **{"from": "x", "to": 1})) == {"load[0].from"}


def test_keys_are_told_of_although_the_place_is_wrong():
    result = faults_of({"type": "punch", "diametre": "30 mm"}, "slidr")
    assert set(result) == {"load[0].on", "load[0].model.diametre"}


def test_a_model_named_by_a_text_is_a_table_to_be():
    advice = 'write model = {type = "punch", ...}; see flywheel reference load-models'
    assert faults_of("punch")["load[0].model"].endswith(advice)


def test_a_mechanism_that_locks_is_told_once():
    base = {"mechanism": {"type": "slider-crank", "crank": {"length": 0.3}, "rod": {"length": 0.2}}}
    assert set(faults_of(MODEL_PRESS, base=base)) == {"mechanism.rod.length"}


def test_a_port_that_does_not_come_back_has_no_end():
    bars = {"ground": 1.0, "crank": 3.0, "coupler": 3.5, "rocker": 4.0}
    base = {"mechanism": {"type": "four-bar"} | {name: {"length": length} for name, length in bars.items()}}
    result = faults_of({"type": "press", "energy": 10, "angle": 0.3}, "rocker", base)
    assert "does not come back" in result["load[0].model"]
