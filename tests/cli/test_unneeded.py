"""Work that a scene does not need is not done: what is imported, and what is called, at every level of accuracy.

Calls are counted by the interpreter's profiling hook, so that nothing counts as left out that merely was imported before.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

import pytest

import flywheel
from tests import regimes, scenes
from tests.references.test_references import FOLDER

ROOT = Path(flywheel.__file__).parents[1]
LEVELS = ("normal", "confirm", "audit")

TIME = {"flywheel.stepping", "flywheel.one_cycle", "flywheel.confirmation", "flywheel.instant", "flywheel.implicit", "scipy"}
NEWTON = {"flywheel.collocation", "flywheel.periodic", "flywheel.own_motion"}
REACTIONS = {"flywheel.kinetostatics", "flywheel.joints", "flywheel.joint_friction", "flywheel.port_forces"}
REACTIONS |= {"flywheel.linkage.reactions", "flywheel.linkage.statics"}
OTHERS = {"flywheel.multibody", "flywheel.simulation", "flywheel.whole", "flywheel.transients", "flywheel.fate"}
OTHERS |= {"flywheel.arm", "flywheel.masses", "sympy", "matplotlib", "mpmath", "bondgraph.symbolic", "bondgraph.storing"}
SPEED = {"flywheel.constant_speed", "flywheel.by_motion", "flywheel.moments"}
WHEEL = {"flywheel.built", "flywheel.wheel.choosing", "flywheel.wheel.sizing", "flywheel.wheel.discs"}
INTERVALS = {"flywheel.features", "flywheel.formulas.intervals", "flywheel.formulas.switching"}
LINKAGE = {"flywheel.linkage.continuation", "flywheel.linkage.newton", "flywheel.mechanisms.linkage"}

WHEELED = {"irregularity": 0.04, "shape": "disc", "material": "carbon steel", "outer_radius": "0.6 m"}


def reference(name: str) -> Any:
    return FOLDER / "scenes" / f"{name}.toml"


# a scene of each class, and what beside time stepping and Newton's method it does not need
CLASSES: dict[str, tuple[Any, set[str]]] = {
    "position only": (scenes.press(), SPEED | WHEEL | INTERVALS | LINKAGE),
    "constant inertia": (scenes.rotor(inertia=[{"on": "crank", "value": 2}]), SPEED | WHEEL | INTERVALS | LINKAGE),
    "analysis": (scenes.yoke(flywheel={"inertia": 300}), SPEED | WHEEL | INTERVALS | LINKAGE),
    "law": (reference("law-gain"), SPEED | WHEEL | LINKAGE),
    "table": (reference("table-step-csv"), SPEED | WHEEL | LINKAGE),
    "several": (reference("several"), SPEED | WHEEL | LINKAGE),
    "linkage": (ROOT / "examples" / "linkages" / "six_bar.toml", SPEED | WHEEL),
    "speed": (regimes.scene("section-c", inertia=2), WHEEL | LINKAGE),
    "losses": (regimes.scene("geared-loss", inertia=0.05), WHEEL | LINKAGE),
    "inductance": (regimes.scene("dc-inductance", inertia=0.1), WHEEL | LINKAGE),
    "wheel": (scenes.yoke(flywheel=WHEELED), SPEED | INTERVALS | LINKAGE),
}
AREAS = {"areas": {"values": [100, -100], "scale": "1 J"}, "regime": {"speed": "60 rpm"}}
OWN_SPEED = ("speed", "losses", "inductance")  # their figures are those of a motion


def allowed(name: str, level: str) -> set[str]:
    """What of the things that are not always needed this class does need at a level."""
    found: set[str] = set()
    if level == "audit":
        found |= TIME | {"flywheel.moments"}  # which tells whether the motor's current is a state
    if level == "confirm" or (name in OWN_SPEED):
        found |= NEWTON | {"flywheel.moments", "flywheel.constant_speed"}
    return found


def forbidden(name: str, level: str) -> set[str]:
    return (TIME | NEWTON | REACTIONS | OTHERS | CLASSES[name][1]) - allowed(name, level)


@contextmanager
def calls() -> Iterator[set[str]]:
    """Names of the modules whose functions are called inside."""
    found: set[str] = set()

    def hook(frame: FrameType, event: str, _: Any) -> None:
        if event == "call" and frame.f_code.co_name != "<module>":
            found.add(frame.f_globals.get("__name__", ""))

    sys.setprofile(hook)
    try:
        yield found
    finally:
        sys.setprofile(None)


def within(names: set[str], packages: set[str]) -> set[str]:
    """Those of the names that are one of the packages, or inside one."""
    return {name for name in names if any(name == package or name.startswith(f"{package}.") for package in packages)}


SLOW = ("several", "law", "linkage", "wheel")  # in time, under the hook
CASES = [(name, level) for name in CLASSES for level in LEVELS if not (level == "audit" and name in SLOW)]


@pytest.mark.parametrize(("name", "level"), CASES)
def test_nothing_unneeded_is_called(name: str, level: str) -> None:
    scene = flywheel.load(CLASSES[name][0])
    flywheel.size(scene, 1e-3, accuracy=level)  # so that what imports call does not count
    with calls() as found:
        flywheel.size(scene, 1e-3, accuracy=level).as_dict()
    assert within(found, forbidden(name, level)) == set()
    assert "flywheel.regime" in found  # the hook has seen something


def test_the_hook_sees_what_is_needed() -> None:
    """What the test above forbids elsewhere is called where it is needed: it can fail."""
    scene = flywheel.load(scenes.yoke(flywheel=WHEELED))
    with calls() as found:
        flywheel.size(scene, 1e-3)
        flywheel.size(scene, 1e-3, accuracy="confirm")
        flywheel.size(flywheel.load(CLASSES["linkage"][0]), 1e-3, accuracy="normal")
        flywheel.size(flywheel.load(CLASSES["speed"][0]), 1e-3, accuracy="normal")
    needed = {
        "flywheel.stepping",
        "flywheel.periodic",
        "flywheel.built",
        "flywheel.by_motion",
        "flywheel.mechanisms.linkage",
    }
    assert needed <= found
    assert within(found, {"scipy"})
    assert within(found, INTERVALS)


@pytest.mark.parametrize("level", LEVELS)
def test_a_diagram_of_areas_calls_no_mechanics(level: str) -> None:
    scene = flywheel.load(AREAS | {"flywheel": {"irregularity": 0.02}})
    with calls() as found:
        flywheel.size(scene, accuracy=level).as_dict()
    mechanics = {"bondgraph.reduction", "bondgraph.graph", "flywheel.chain", "flywheel.piecewise", "flywheel.wittenbauer"}
    assert within(found, TIME | NEWTON | REACTIONS | OTHERS | SPEED | mechanics) == set()


def test_nothing_unneeded_is_imported() -> None:
    """In one process, in an order in which each step may import more than those before it."""
    steps = [(name, level) for level in ("normal",) for name in CLASSES if name not in OWN_SPEED]
    steps += [(name, level) for level in ("normal",) for name in OWN_SPEED]
    steps += [("position only", "confirm"), ("position only", "audit")]
    code = (
        "import json, sys, flywheel; from pathlib import Path\n"
        "for scene, level in json.loads(sys.argv[1]):\n"
        "    scene = flywheel.load(Path(scene) if isinstance(scene, str) else scene)\n"
        "    flywheel.size(scene, 1e-3, accuracy=level).as_dict()\n"
        "    print(json.dumps(sorted(sys.modules)))"
    )
    given = json.dumps([(CLASSES[name][0], level) for name, level in steps], default=str)
    run = subprocess.run(
        [sys.executable, "-c", code, given], capture_output=True, text=True, check=True, cwd=ROOT, timeout=600
    )
    imported = [set(json.loads(line)) for line in run.stdout.splitlines()]
    everything = {"scipy.integrate", *NEWTON, *TIME, *REACTIONS, *OTHERS, *SPEED, *WHEEL} - {"scipy"}
    may: set[str] = set()
    for (name, level), modules in zip(steps, imported, strict=True):
        may |= _may_import(name, level)
        assert within(modules, everything - may) == set(), (name, level)
    assert "scipy.integrate" in imported[-1]
    assert "scipy.integrate" not in imported[-2]


def _may_import(name: str, level: str) -> set[str]:
    """What a step may add to what is imported."""
    found = set(WHEEL) if name == "wheel" else set()
    if name in OWN_SPEED:
        found |= SPEED
    if name in OWN_SPEED and level == "normal":
        found |= NEWTON
    if level in ("confirm", "audit"):
        found |= NEWTON | SPEED
    return found | (TIME | {"scipy.integrate"} if level == "audit" else set())
