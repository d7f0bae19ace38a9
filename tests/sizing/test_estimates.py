"""Every figure of a sizing has its estimated error, and none is further off: position, speed, cycles that do not close."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flywheel
from tests import regimes, scenes
from tests.limits import sample

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
    found: Any = errors
    beside = path[0] == "flywheel" or (
        path[0] == "energy" and len(path) > 1 and path[1] in errors and path[1] not in ("period", "work")
    )
    for key in path[1:] if beside else path:
        if isinstance(found, dict):
            found = found.get(key)
    return found if isinstance(found, int | float) else None


def without_error(result: dict[str, Any]) -> set[str]:
    paths = {path for path in numbers(result) if not {".".join(path[:n]) for n in range(1, 4)} & TOLD}
    return {".".join(path) for path in paths if error_of(result["error"], path) is None}


def sized(scene: Any, **options: Any) -> dict[str, Any]:
    return flywheel.size(flywheel.load(scene), **options).as_dict()


@pytest.mark.parametrize("path", sample(EXAMPLES, 9), ids=lambda path: path.stem)
def test_every_number_of_every_example_has_its_error(path: Path) -> None:
    scene = flywheel.load(path)
    if scene.stroke is not None or (scene.irregularity is None and scene.inertia is None):
        return
    result = flywheel.size(scene, simulate=False).as_dict()
    assert without_error(result) == set()
    assert all(error >= 0.0 for path in numbers(result["error"]) if (error := error_of(result["error"], path)) is not None)


WHEEL = {"shape": "arms", "material": "cast iron", "outer_radius": 0.6, "arms": 6, "bore": 0.08}
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
    assert without_error(sized(SCENES[name], accuracy=accuracy)) == set()


# --- speed-dependent machines, against 30 digits ------------------------------------------------------------------------

OTHER = ("unstable", "two-speeds-slow")  # motions that the toolkit refuses, or leaves for the faster one
ANALYSES = [(name, inertia) for name, case in regimes.CASES.items() for inertia in case.inertias if name not in OTHER]


@pytest.mark.parametrize(("name", "inertia"), sample(ANALYSES, 8))
def test_figures_of_motions_are_off_by_no_more_than_they_say(name: str, inertia: float) -> None:
    true = regimes.figures(name)["analysis"][f"{inertia:g}"]
    result = sized(regimes.scene(name, inertia=inertia), simulate=False)
    found = {key: result[key] for key in ("speed", "power", "multiplier")}
    errors = {key: result["error"][key] for key in found}
    for key, value in (("period", "period"), ("work", "drive_work")):
        found[value], errors[value] = result["energy"] and result["energy"][key], result["error"]["energy"]
    for key, value in found.items():
        if value is None or true.get(key) is None:
            continue
        scale = 1.0 if key == "multiplier" else abs(float(true[key]))
        assert abs(value - float(true[key])) <= errors[key] * scale + ROUNDING * max(scale, 1e-300), key


# --- cycles that do not close ---------------------------------------------------------------------------------------------


def figures(result: dict[str, Any], exchanged: float) -> dict[str, tuple[float, float]]:
    """Figures and the scales of their errors."""
    wheel, works = result["flywheel"], ("accumulated_max", "accumulated_min", "energy_fluctuation")
    names = ("exact", "approximate", "approximate_total", "inertia_torque", "inertia_torque_flywheel")
    found = {name: (wheel[name], wheel["approximate_total"]) for name in names}
    return found | {name: (result[name], exchanged) for name in works}


MACHINES = {
    "yoke": scenes.yoke(),
    "fast yoke": scenes.yoke(regime={"speed": "60 rad/s"}),
    "rotor": scenes.rotor(flywheel={"irregularity": 0.02}),
}
PLACED = {
    "spread": lambda work: {"torque": work / (2 * np.pi)},
    "early": lambda work: {"torque": work / 0.3, "from": 0.2, "to": 0.5},
    "late": lambda work: {"torque": work / 0.05, "from": 6.0, "to": 6.05},
    "middle": lambda work: {"torque": work / 1.0, "from": 2.6, "to": 3.6},
}


@pytest.mark.parametrize("share", [1e-4, -0.03])
@pytest.mark.parametrize("place", ["spread", "late"])
@pytest.mark.parametrize("name", sample(MACHINES, 2))
def test_what_a_cycle_leaves_over_may_belong_anywhere(name: str, place: str, share: float) -> None:
    """A machine with work left over, and the same where a torque takes it up: no figure moves by more."""
    scene = MACHINES[name]
    balanced = flywheel.size(flywheel.load(scene), simulate=False)
    left = share * balanced.cycle.exchanged
    found = sized(
        scene | {"drive": {"torque": balanced.balance.value + left / (2 * np.pi)}, "accuracy": {"closure": 0.05}},
        simulate=False,
    )
    true = sized(scene | {"load": [*scene["load"], {"on": "crank", **PLACED[place](-left)}]}, simulate=False)
    assert true["reached"]
    assert not found["reached"]
    assert any("left over" in message for message in found["messages"])
    scale = balanced.cycle.exchanged + abs(left)
    closed = figures(true, scale)
    for key, (value, size) in figures(found, scale).items():
        assert abs(value - closed[key][0]) <= found["error"][key] * max(abs(value), size) + 1e-12 * size, key
        assert found["error"][key] <= 60 * abs(share), key
    for key in ("angle_speed_max", "angle_speed_min"):
        gap = abs(found[key] - true[key])
        assert min(gap, found["cycle"] - gap) <= found["error"][key], key
    work = found["power"] * found["cycle"] / found["speed"]
    assert abs(left) <= found["error"]["power"] * abs(work) * (1 + 1e-9)  # the drive's, if it is that which is off


@pytest.mark.parametrize("accuracy", ["normal", "confirm", "audit"])
def test_an_analysis_of_a_cycle_that_does_not_close(accuracy: str) -> None:
    scene = scenes.yoke(flywheel={"inertia": 300})
    balanced = flywheel.size(flywheel.load(scene), accuracy="normal")
    torque = balanced.balance.value * 1.01
    found = flywheel.size(
        flywheel.load(scene | {"drive": {"torque": torque}, "accuracy": {"closure": 0.05}}), accuracy=accuracy
    )
    assert not found.reached
    for name in ("irregularity", "speed_max", "speed_min", "period"):
        value, true = getattr(found.simulation, name), getattr(balanced.simulation, name)
        assert value is None or abs(value / true - 1) <= found.error.simulation
    assert found.error.simulation <= 0.1


@pytest.mark.parametrize("left", [0.5, 0.05, -0.4])
def test_areas_that_do_not_add_up_to_nothing(left: float) -> None:
    """Whichever area the rest belongs to, the flywheel is no further off than told."""
    areas = [10.0, -6.0, 4.0, -8.0 + left]
    asked = {"regime": {"speed": 3}, "flywheel": {"irregularity": 0.1}}
    found = flywheel.size(flywheel.load({"areas": {"values": areas}, **asked}))
    assert not found.reached
    assert "left over" in found.messages[0]
    for k in range(4):
        mended = [area - left * (j == k) for j, area in enumerate(areas)]
        true = flywheel.size(flywheel.load({"areas": {"values": mended}, **asked}))
        assert true.reached
        assert abs(found.flywheel.exact / true.flywheel.exact - 1) <= found.error.exact * 1.1
    assert found.error.exact <= 2 * abs(left) / 10
