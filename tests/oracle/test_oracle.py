"""The oracle in long doubles against figures of 20 digits, which a route of their own gave."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests import regimes as machines
from tests.limits import sample
from tests.oracle import figures, regimes
from tests.oracle.machine import Machine
from tests.oracle.numbers import Real

FOLDER = Path(__file__).parent.parent / "references"
REFERENCES = {r["scene"].removesuffix(".toml"): r for r in json.loads((FOLDER / "references.json").read_text())}
SCENES = (
    "press", "press-tight", "near-lock", "four-bar-near-change", "drag-link-crossed", "whitworth", "shaper-analysis",
    "law-dwell", "law-gain", "half-speed", "several", "springs", "weight-only", "rotor-every", "rotor-tightest",
    "yoke-analysis",
)  # fmt: skip
WITHIN = 4e-18  # of a figure or its scale


def off(found: Any, true: str, scale: Any = 0) -> float:
    """The error of a figure, relative to it or to its scale."""
    exact = Real(true)
    return float(abs(found - exact) / max(abs(exact), abs(Real(scale)), Real("1e-300")))


@pytest.mark.parametrize("name", sample(SCENES, 10))
def test_figures_that_know_no_speed(name: str) -> None:
    true = REFERENCES[name]
    scene = tomllib.loads((FOLDER / "scenes" / f"{name}.toml").read_text(), parse_float=Real)
    with np.errstate(all="ignore"):
        found = figures.references(Machine(scene, FOLDER / "scenes"))
    work, ratio = true["work_exchanged"], true["flywheel"].get("approximate_total") or 0
    errors = {k: off(found[k], true[k], work) for k in ("accumulated_max", "accumulated_min", "energy_fluctuation")}
    assert len(found["areas"]) == len(true["areas"])
    for k, (mine, area) in enumerate(zip(found["areas"], true["areas"], strict=True)):
        errors |= {f"area {k}": off(mine["work"], area["work"], work), f"to {k}": off(mine["to"], area["to"], 1)}
    errors |= {k: off(v, true["flywheel"][k], ratio) for k, v in found["flywheel"].items() if k in true["flywheel"]}
    errors |= {k: off(v, true["simulation"][k]) for k, v in found.get("simulation", {}).items()}
    most = true["reduced_inertia"]["max"]
    errors |= {f"I* {k}": off(v, true["reduced_inertia"][k], most) for k, v in found["reduced_inertia"].items()}
    if true["balance"] is not None:
        errors["balance"] = off(found["balance"], true["balance"])
    limit = WITHIN * (5 if "near" in name else 1)  # close to a change point rounding is magnified
    assert {k: e for k, e in errors.items() if not e <= limit} == {}


SIZED = "section-c pump yoke geared-loss-line brake kloss-press governor two-speeds-fast engine"
ANALYSED = "section-c four-bar geared-loss law constant-drive unstable two-speeds-slow peaks shaper"
MOTIONS = [(name, kind) for kind, names in (("sizing", SIZED), ("analysis", ANALYSED)) for name in names.split()]


@pytest.mark.parametrize(("name", "kind"), sample(MOTIONS, 6))
def test_motions_with_torques_that_depend_on_speed(name: str, kind: str) -> None:
    true = json.loads(machines.REFERENCES.read_text())[name][kind]
    asked, wanted = next(iter(true.items()))
    scene = machines.scene(name, **{"inertia" if kind == "analysis" else "irregularity": float(asked)})
    with np.errstate(all="ignore"):
        machine = Machine(scene)
        ratio = machine.shafts[scene["flywheel"].get("on", "crank")]
        given, speed = Real(wanted["inertia"]) * ratio**2, Real(wanted["speed"])
        held = regimes.Held(
            given if kind == "analysis" else None,
            None if kind == "analysis" else Real(asked),
            speed if machine.balanced else None,
        )
        unknown = Real(wanted["balance"] or 0)
        guess = regimes.Guess(speed, given, unknown * Real("1.001"), lambda phi: np.full(phi.shape, float(speed) * 1.001))
        motion = regimes.found(machine, held._replace(inertia=given, irregularity=None), guess)
        if kind == "sizing":  # from a motion that varies, and a flywheel that is not the one asked for
            guess = regimes.Guess(speed, given * Real("1.01"), unknown * Real("1.001"), motion.pace)
            motion = regimes.found(machine, held, guess)
    high, low = motion.excess
    errors = {
        "speed_max": off(motion.w * (1 + high), wanted["speed_max"]),
        "speed_min": off(motion.w * (1 + low), wanted["speed_min"]),
        "inertia": off(motion.state.inertia, str(given)) if given else 0.0,
    }
    if wanted["balance"] is not None:
        errors["balance"] = off(motion.state.unknown, wanted["balance"])
    assert {k: e for k, e in errors.items() if not e <= 1e-16} == {}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("script", "names"),
    [("make_references", ["areas-sizing"]), ("make_regimes", ["peaks"])],
)
def test_more_digits_give_the_figures_that_are_written(script: str, names: list[str]) -> None:
    command = [sys.executable, "-m", f"tests.references.{script}", "--check", *names]
    run = subprocess.run(command, cwd=FOLDER.parents[1], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
