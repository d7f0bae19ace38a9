"""The oracle itself, against closed forms."""

from __future__ import annotations

import json
import math
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
from tests.oracle.courses import Course
from tests.oracle.courses import Machine as CourseMachine
from tests.oracle.drive_lines import DriveLine
from tests.oracle.machine import Machine
from tests.oracle.numbers import Real

# The oracle in long doubles against figures of 20 digits, which a route of their own gave.


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
        result = figures.references(Machine(scene, FOLDER / "scenes"))
    work, ratio = true["work_exchanged"], true["flywheel"].get("approximate_total") or 0
    errors = {k: off(result[k], true[k], work) for k in ("accumulated_max", "accumulated_min", "energy_fluctuation")}
    assert len(result["areas"]) == len(true["areas"])
    for k, (mine, area) in enumerate(zip(result["areas"], true["areas"], strict=True)):
        errors |= {f"area {k}": off(mine["work"], area["work"], work), f"to {k}": off(mine["to"], area["to"], 1)}
    errors |= {k: off(v, true["flywheel"][k], ratio) for k, v in result["flywheel"].items() if k in true["flywheel"]}
    errors |= {k: off(v, true["simulation"][k]) for k, v in result.get("simulation", {}).items()}
    most = true["reduced_inertia"]["max"]
    errors |= {f"I* {k}": off(v, true["reduced_inertia"][k], most) for k, v in result["reduced_inertia"].items()}
    if true["balance"] is not None:
        errors["balance"] = off(result["balance"], true["balance"])
    limit = WITHIN * (5 if "near" in name else 1)  # close to a change point rounding is magnified
    assert {k: e for k, e in errors.items() if not e <= limit} == {}


SIZED = "section-c pump yoke geared-loss-line brake kloss-press governor two-speeds-fast engine"
ANALYSED = "section-c four-bar geared-loss law constant-drive unstable two-speeds-slow peaks shaper"
MOTIONS = [(name, kind) for kind, names in (("sizing", SIZED), ("analysis", ANALYSED)) for name in names.split()]


@pytest.mark.parametrize(("name", "kind"), sample(MOTIONS, 6))
def test_motions_with_torques_that_depend_on_speed(name: str, kind: str) -> None:
    true = json.loads(machines.REFERENCES.read_text())[name][kind]
    request, wanted = next(iter(true.items()))
    scene = machines.scene(name, **{"inertia" if kind == "analysis" else "irregularity": float(request)})
    with np.errstate(all="ignore"):
        machine = Machine(scene)
        ratio = machine.shafts[scene["flywheel"].get("on", "crank")]
        given, speed = Real(wanted["inertia"]) * ratio**2, Real(wanted["speed"])
        held = regimes.Held(
            given if kind == "analysis" else None,
            None if kind == "analysis" else Real(request),
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


# Motions from event to event against what is known in closed form.


ROTOR = [{"on": "crank", "value": 1.0}]


def followed(scene: dict[str, Any], omega: float, until: float, **given: Any) -> tuple[CourseMachine, Course]:
    machine = CourseMachine(scene, **given)
    return machine, machine.follow(machine.start(0.0, omega), until, scale=until)


def test_dry_and_viscous_friction_from_rest() -> None:
    """J dw/dt = M - a - b w."""
    model = {"type": "losses", "constant": 4.0, "proportional": 0.05}
    scene = {"load": [{"on": "crank", "model": model}], "drive": {"torque": 10}, "inertia": [{"on": "crank", "value": 2}]}
    _, course = followed(scene, 0.0, 0.8)
    assert course.y[1] == pytest.approx(120 * -math.expm1(-0.8 * 0.05 / 2), rel=1e-11)


def test_two_dry_laws_stop_a_machine_for_good() -> None:
    scene = {"shafts": {"crank": {"drag": 1}}, "load": [{"on": "crank", "torque": "-3*sign(v)"}], "inertia": ROTOR}
    machine, course = followed(scene, 5.0, 3.0)
    assert (course.y[0], course.y[1]) == (pytest.approx(3.125, rel=1e-11), 0.0)
    (rest,) = course.rests
    assert (rest.start, rest.end) == (pytest.approx(1.25, rel=1e-9), math.inf)
    assert machine.works(course.y)["shafts.crank.drag"] == pytest.approx(-3.125, rel=1e-9)


def test_a_growing_drive_frees_what_friction_holds() -> None:
    """Held until 30 t = 30, then dw/dt = 30 t - 30 up to 60."""
    scene = {"load": [{"on": "crank", "torque": "-30*sign(v)"}], "drive": {"torque": "min(60, 30*t)"}, "inertia": ROTOR}
    _, course = followed(scene, 0.0, 3.0)
    assert course.rests[0].end == pytest.approx(1.0, abs=1e-9)
    assert course.y[1] == pytest.approx(15 + 30, rel=1e-9)


def test_friction_that_holds_a_weight_and_one_that_does_not() -> None:
    """A pendulum under dry friction swings until a turning point where the weight is less than friction."""
    scene = {"load": [{"on": "crank", "torque": "-10*sin(phi) - 3*sign(v)"}], "inertia": ROTOR}
    machine = CourseMachine(scene)
    course = machine.follow(machine.start(2.0, 0.0), 10.0, scale=10.0)
    phi = 2.0
    for _ in range(len(course.rests) + 20):  # 10 cos falls by what friction takes on the way
        side, turn = math.copysign(1, phi), math.asin(0.3)  # where the weight drives on no more
        if 10 * abs(math.sin(phi)) <= 3:
            break

        def left(other: float, phi: float = phi) -> float:
            return 10 * (math.cos(other) - math.cos(phi)) - 3 * abs(phi - other)

        low, high = (-abs(phi), turn) if side > 0 else (-turn, abs(phi))
        for _ in range(200):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if (left(middle) > 0) == (side < 0) else (low, middle)
        phi = 0.5 * (low + high)
    assert (course.y[0], course.y[1]) == (pytest.approx(phi, abs=1e-9), 0.0)


def test_a_mesh_that_loses_drives_in_neither_sense() -> None:
    """A weight behind a mesh of 60 %: it needs 1/0.6 of its torque to be lifted, and gives 0.6 of it as it sinks."""
    scene = {
        "shafts": {"drum": {"ratio": 0.5, "efficiency": 0.6}},
        "inertia": ROTOR,
        "load": [{"on": "drum", "torque": -12}],
    }
    for torque, alpha in ((12.0, 2.0), (10.0, 0.0), (3.6, 0.0), (2.6, -1.0)):
        machine = CourseMachine(scene | {"drive": {"torque": torque}})
        course = machine.follow(machine.start(0.0, 0.0), 1.0, scale=1.0)
        assert course.y[1] == pytest.approx(alpha, abs=1e-9), torque


def test_energy_of_every_element_closes() -> None:
    scene = {
        "shafts": {"motor": {"ratio": 4, "efficiency": 0.9, "drag": 0.2}},
        "mechanism": {
            "type": "slider-crank",
            "crank": {"length": 0.1, "inertia": 0.1},
            "rod": {"length": 0.35, "mass": 3, "inertia": 0.05, "com": 0.15},
            "slider": {"mass": 8},
        },
        "gravity": {},
        "load": [
            {"on": "slider", "force": "-40*sign(v) - 8*v"},
            {"on": "slider", "force": -300, "from": "200 deg", "to": "300 deg"},
        ],
        "drive": {"on": "motor", "torque": "9 - 0.1*omega"},
    }
    machine, course = followed(scene, 5.0, 3.0, inertia=0.2)
    works = machine.works(course.y)
    gained = machine.kinetic(course.y) - machine.kinetic(course.at(0.0))
    fall = (
        9.80665 * (-3 * 0.15 / 0.35 + 3) * 0.1 * math.sin(course.y[0])
    )  # the rod's centre of mass rises with the crank pin
    total = sum(work for name, work in works.items() if name != "meshes") - works["meshes"] - fall
    assert total == pytest.approx(gained, rel=1e-8)


# Shafts in series, shot at step by step, against what is known in closed form and against the other oracle.


PRESS = {
    "shafts": {"motor": {"ratio": 8, "efficiency": 0.94}, "fan": {"ratio": 3, "efficiency": 0.9}},
    "mechanism": {
        "type": "slider-crank",
        "crank": {"length": 0.1, "mass": 5, "inertia": 0.1, "com": 0.02},
        "rod": {"length": 0.45, "mass": 10, "inertia": 0.3, "com": 0.2},
        "slider": {"mass": 40, "offset": 0.02},
    },
    "gravity": {},
    "inertia": [{"on": "motor", "value": 0.05}, {"on": "fan", "value": 0.1}],
    "load": [
        {"on": "slider", "force": "-8 kN", "from": "290 deg", "to": "350 deg"},
        {"on": "slider", "force": "-200 N", "while": "v > 0"},
        {"on": "fan", "torque": "-0.01*omega*abs(omega)"},
    ],
    "drive": {"on": "motor", "torque": "60 - 0.4*omega"},
    "flywheel": {"on": "motor", "inertia": 0.3},
}


def test_steady_train_by_hand() -> None:
    """Under constant torques everything is a product: 0.96 * 0.98 of a belt that slips 2 %, then 0.97 of a gear."""
    scene = {
        "shafts": {
            "wheel": {"ratio": 5.0, "efficiency": 0.97, "drag": 3.0},
            "motor": {"on": "wheel", "ratio": 3.0, "efficiency": 0.96, "slip": 0.02},
        },
        "inertia": [{"on": "crank", "value": 10.0}],
        "load": [{"on": "crank", "torque": -500.0}],
        "drive": {"on": "motor", "torque": "balance"},
        "regime": {"speed": 8.0},
    }
    result = DriveLine(scene).analysed(1.0)
    on_wheel = 500.0 / 5.0 / 0.97 + 3.0
    assert result.unknown == pytest.approx(on_wheel / 3.0 / 0.96, rel=1e-12)  # slip costs speed, not torque
    assert result.mean_power == pytest.approx(on_wheel * 40.0 / 0.96 / 0.98, rel=1e-12)
    assert result.flows["motor"].lost == pytest.approx(result.mean_power * (1 - 0.96 * 0.98), rel=1e-12)
    assert result.works["drag wheel"] == pytest.approx(-3.0 * 5.0 * math.tau, rel=1e-12)


@pytest.mark.slow
def test_two_meshes_on_the_crank_as_by_collocation() -> None:
    result, machine = DriveLine(PRESS).analysed(0.3), Machine(PRESS)
    held = regimes.Held(Real(0.3) * 64, None, None)
    guess = regimes.Guess(Real(result.speed), held.inertia, Real(0), lambda phi: np.full(phi.shape, 1.001 * result.speed))
    with np.errstate(all="ignore"):
        other = regimes.found(machine, held, guess)
    high, low = other.excess
    assert result.speed_max == pytest.approx(float(other.w * (1 + high)), rel=1e-12)
    assert result.speed_min == pytest.approx(float(other.w * (1 + low)), rel=1e-12)


@pytest.mark.slow
def test_power_of_a_train_closes() -> None:
    """Work of drive, loads, drag and what belts and gears lose make nothing over a cycle, far from a steady train."""
    shafts = {
        "wheel": {"ratio": 4.0, "efficiency": 0.9, "drag": 2.0},
        "motor": {"on": "wheel", "ratio": 2.0, "efficiency": 0.95, "slip": 0.03},
        "fan": {"on": "wheel", "ratio": 1.5, "slip": 0.01},
    }
    result = DriveLine(PRESS | {"shafts": shafts, "flywheel": {"on": "wheel"}}).analysed(2.0)
    lost = sum(flow.lost for flow in result.flows.values()) * result.period
    assert sum(result.works.values()) == pytest.approx(lost, rel=1e-11)
