"""A scene is frozen to its leaves, pickles, and gives a changed one by paths of its text."""

from __future__ import annotations

import pickle
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flywheel
from flywheel import SceneError
from tests import regimes, scenes
from tests.limits import sample
from tests.scenes import crank_press

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*/*.toml"))
SHAFT = {"regime": {"speed": "100 rpm"}, "flywheel": {"irregularity": 0.02}}
WHEEL = {"irregularity": 0.02, "shape": "disc", "material": "grey cast iron", "outer_radius": "0.5 m"}
PRESS = {"type": "press", "energy": "50 J", "thickness": "15 mm"}
COMPRESSOR = {
    "type": "compressor",
    "bore": 0.1,
    "clearance": 0.05,
    "suction": "1 bar",
    "discharge": "7 bar",
    "exponent": 1.3,
}
MOTORS: dict[str, dict[str, Any]] = {
    "line": {"type": "line", "no_load_speed": "1500 rpm", "power": "4 kW", "speed": "1440 rpm"},
    "curve": {"type": "table", "speed": [0, 100, 150], "torque": [30, 40, 0]},
    "induction": {
        "type": "induction",
        "power": "3 kW",
        "speed": "1440 rpm",
        "poles": 4,
        "frequency": 50,
        "breakdown_ratio": 2.5,
    },
    "dc": {"type": "dc", "voltage": 220, "resistance": 1.2, "constant": 1.4, "inductance": 0.02},
    "engine": {"type": "engine", "power": "10 kW", "speed": "1500 rpm", "droop": "4 %"},
}


def driven(motor: dict[str, Any]) -> dict[str, Any]:
    inertia = [{"on": "crank", "value": 3}]
    load = [{"on": "crank", "torque": "-0.002*omega**2*(1 + sin(phi))"}]
    return {"inertia": inertia, "load": load, "drive": {"motor": motor}, "flywheel": {"inertia": 2}, "regime": {}}


FEATURES: dict[str, dict[str, Any]] = {
    **{name: make() for name, make in scenes.ALL.items()},
    **{name: regimes.scene(name, inertia=1) for name in ("section-c", "kloss-press", "dc-inductance")},
    **{f"motor-{name}": driven(motor) for name, motor in MOTORS.items()},
    "law": {
        "mechanism": {"type": "law", "outputs": {"ram": {"x": "0.05*cos(phi) + a*cos(2*phi)", "mass": 30}}},
        "parameters": {"a": "12 mm"},
        "load": [{"on": "ram", "force": "-500 - 100*max(0, sin(phi))", "while": "v > 0"}],
        "drive": {"torque": "balance"},
        **SHAFT,
    },
    "table": {
        "load": [
            {"on": "crank", "table": {"angle": [0, 1, 4, 2 * np.pi], "value": [0, -9, -3, 0], "interpolation": "pchip"}}
        ],
        "drive": {"torque": "balance"},
        **SHAFT,
    },
    "losses": {
        "shafts": {"motor": {"ratio": 8, "efficiency": 0.9}},
        "inertia": [{"on": "motor", "value": 0.01}, {"on": "crank", "value": 4}],
        "load": [{"on": "crank", "torque": "-20*(1 + sin(phi))"}],
        "drive": {"on": "motor", "torque": "balance"},
        "regime": {"speed": 10},
        "flywheel": {"on": "motor", "inertia": 1},
    },
    "wheel": scenes.rotor(flywheel=WHEEL),
    "friction": crank_press(0.1),
    "press": scenes.press(load=[{"on": "press.slider", "model": PRESS}]),
    "compressor": scenes.press(load=[{"on": "press.slider", "model": COMPRESSOR}]),
}


def read(name: str) -> flywheel.Scene:
    return flywheel.load(FEATURES[name])


def mutable(value: Any, path: str = "scene") -> Iterator[str]:
    """Every leaf that can be written through."""
    if isinstance(value, (dict, list, set, bytearray)) or (isinstance(value, np.ndarray) and value.flags.writeable):
        yield path
    elif isinstance(value, Mapping):
        for key, inner in value.items():
            yield from mutable(inner, f"{path}.{key}")
    elif isinstance(value, tuple):
        for k, inner in enumerate(value):
            yield from mutable(inner, f"{path}[{k}]")
    elif hasattr(value, "__dict__") and not callable(value):
        for key, inner in vars(value).items():
            yield from mutable(inner, f"{path}.{key}")


def again(value: Any) -> Any:
    return pickle.loads(pickle.dumps(value))


@pytest.mark.parametrize("source", [*sample(EXAMPLES, 6), *FEATURES], ids=lambda source: getattr(source, "stem", source))
def test_a_scene_is_frozen_and_its_machine_pickles(source: Path | str) -> None:
    scene = read(source) if isinstance(source, str) else flywheel.load(source)
    copy = again(scene)
    assert copy == scene
    assert repr(copy) == repr(scene)
    assert [*mutable(scene), *mutable(copy)] == []
    if scene.areas is None:
        machine = flywheel.Machine(scene)
        phi = np.linspace(0.01, 0.99, 7) * scene.cycle
        result, expected = again(machine).reduce(phi), machine.reduce(phi)
        np.testing.assert_array_equal(result.inertia, expected.inertia)
        np.testing.assert_array_equal(result.moment, expected.moment)


@pytest.mark.parametrize(
    "name", [*sample(sorted(FEATURES.keys() - {"friction"}), 2), pytest.param("friction", marks=pytest.mark.slow)]
)
def test_a_sizing_pickles(name: str) -> None:
    sizing = flywheel.size(read(name), accuracy="normal")
    copy = again(sizing)
    assert copy.as_dict() == sizing.as_dict()
    assert flywheel.size(copy.machine, accuracy="normal").flywheel == sizing.flywheel


@pytest.mark.slow
def test_motions_and_comparisons_pickle() -> None:
    t = np.linspace(0.0, 0.2, 5)
    twisting = driven(MOTORS["line"]) | {"shafts": {"fan": {"ratio": 2, "stiffness": 400, "damping": 1}}}
    twisting["inertia"] = [*twisting["inertia"], {"on": "fan", "value": 0.5}]
    for case in (FEATURES["motor-dc"], FEATURES["losses"] | {"drive": {"torque": 30}}, twisting):
        motion = flywheel.simulate(flywheel.load(case), phi=0, omega=10, until=0.2)
        np.testing.assert_array_equal(again(motion).at(t), motion.at(t))
    up = flywheel.run_up(flywheel.load(driven(MOTORS["line"])))
    assert again(up).as_dict() == up.as_dict()
    rows = flywheel.tradeoff(read("rotor"), 1e-3, budget=0.01)
    assert again(rows) == rows


@pytest.mark.slow
def test_a_pool_sizes_scenes() -> None:
    inputs, size = [read("rotor"), read("wheel")], partial(flywheel.size, accuracy="normal")
    with ProcessPoolExecutor(1, mp_context=get_context("forkserver")) as pool:
        result = list(pool.map(size, inputs))
    assert [one.flywheel for one in result] == [size(scene).flywheel for scene in inputs]


# -- changes -------------------------------------------------------------------------------------------------------------


def test_a_changed_scene_is_what_its_changed_text_is() -> None:
    scene = read("press")
    changes = {"mechanism.crank.length": "90 mm", "load[0].model.energy": "60 J", "mechanism.slider.offset": "5 mm"}
    text = FEATURES["press"]
    mechanism = text["mechanism"] | {"crank": text["mechanism"]["crank"] | {"length": "90 mm"}}
    mechanism["slider"] = mechanism["slider"] | {"offset": "5 mm"}
    load = [{"on": "press.slider", "model": PRESS | {"energy": "60 J"}}]
    assert scene.with_(changes) == flywheel.load(text | {"mechanism": mechanism, "load": load})
    assert scene == read("press")
    assert scene.with_(changes).with_({"mechanism.slider.offset": None, "title": "again"}).title == "again"
    assert again(scene).with_(changes) == scene.with_(changes)


def test_items_are_put_in_and_taken_out() -> None:
    scene = read("rotor")
    more = scene.with_({"load.1": {"on": "crank", "torque": -3}, "load.1.torque": -4, "gravity.g": 9.81})
    assert [load.law for load in more.loads] == [-100.0, -4.0]
    assert more.gravity is not None
    assert more.with_({"load.1": None, "gravity": None}) == scene


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mechanism.crank.lenght": 1}, 'mechanism.crank.lenght: found key "lenght".*did you mean "length"'),
        ({"regime.speed": "-3 rpm"}, "regime.speed: found .*-3 rpm"),
        ({"load.1.force": 3}, "load\\[1\\]"),
        ({"load.7.force": 3}, r'load.7: found "7", expected a place from 0 to 1; load is an array'),
        ({"load.force": 3}, r'load.force: found "force", expected a place from 0 to 1'),
        ({"regime.speed.unit": 3}, r'regime.speed.unit: found "120 rpm", expected a table'),
        ({"regime.sped": None}, r'regime.sped: found nothing to take out.*did you mean "speed"'),
        ({3: 1}, "changes: found 3"),
        ([1], "changes: found a list"),
    ],
)
def test_a_wrong_change_is_a_fault(changes: Any, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        flywheel.load(scenes.press()).with_(changes)


def test_only_what_was_read_can_be_changed(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="one made by"):
        replace(read("rotor"), speed=3.0).with_({"title": "a"})
    (tmp_path / "law.csv").write_text("angle,value\n0,0\n1,-5\n6.283185307179586,0\n")
    file = tmp_path / "scene.toml"
    file.write_text(
        'load = [{on = "crank", table = {file = "law.csv"}}]\ndrive.torque = "balance"\n'
        'regime.speed = "1500 rpm"\nflywheel.inertia = 1\n'
    )
    changed = flywheel.load(file).with_({"flywheel.inertia": 2})
    assert (changed.inertia, changed.file) == (2.0, file)
