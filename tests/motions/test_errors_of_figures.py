"""Errors told by `reduce`, `reactions` and `simulate` in JSON: every figure has one, none is further off, none is idle."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import flywheel
from flywheel.machine.machine import Machine
from flywheel.motions.joint_forces import joint_errors, joint_forces
from flywheel.motions.transients import estimates, of_samples, transient
from flywheel.regime.state import state_errors
from flywheel.tables import forces, reduction, transients
from flywheel.tables.transients import evenly
from tests import scenes
from tests.limits import sample

ROOT = Path(__file__).parents[2]
PRESS = ROOT / "examples/machines/press.toml"

# what is asked or given, and what are errors themselves
GIVEN = {"cycle", "rtol", "error", "errors", "energy_residual", "drift", "start", "phi", "x", "stroke", "energy.residual"}


def numbers(value: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    if isinstance(value, dict):
        for key, item in value.items():
            yield from numbers(item, (*path, key))
    elif isinstance(value, list):
        for item in value[:1]:
            yield from numbers(item, path)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield path


def without_error(result: dict[str, Any]) -> set[str]:
    found = set()
    for path in numbers(result):
        names = {".".join(path[:n]) for n in range(1, 3)} | set(path)
        error: Any = result["errors"]
        for key in path:
            error = error.get(key) if isinstance(error, dict) else error
        if error is None and not names & GIVEN:
            found.add(".".join(path))
    return found


@pytest.mark.parametrize("name", ["machines/injection_clamp", "regimes/compressor"])
def test_every_figure_of_the_reduced_machine_has_its_error(name: str) -> None:
    text, _ = reduction.reduced(flywheel.load(ROOT / f"examples/{name}.toml"), points=5, as_json=True)
    assert without_error(json.loads(text)) == set()


@pytest.mark.parametrize("name", ["machines/injection_clamp", pytest.param("linkages/whitworth", marks=pytest.mark.slow)])
def test_every_force_has_its_error(name: str) -> None:
    scene = flywheel.load(ROOT / f"examples/{name}.toml")
    found = joint_forces(scene, np.linspace(0.1, 6.0, 3) if scene.stroke is None else [0.0, 0.1])
    result = json.loads(forces.json(scene, found, joint_errors(Machine(scene), found)))
    missing = {path for path in without_error(result) if not set(path.split(".")) & {"largest", "iterations", "residual"}}
    assert missing == set()


# -- reduce, against 30 digits ---------------------------------------------------------------------------------------------

ANGLES = [0.0, 0.3, 1.5, math.pi / 2, 2.0, math.pi, 4.0, math.radians(345), 6.1]


def slider_crank(crank: float, rod: float, phi: float) -> tuple[Any, Any, Any]:
    """The slider's g and g', the rod's g, to 30 digits."""
    r, length, angle = mpmath.mpf(crank), mpmath.mpf(rod), mpmath.mpf(phi)
    sin, cos = mpmath.sin(angle), mpmath.cos(angle)
    high = mpmath.sqrt(length**2 - (r * sin) ** 2)
    gain = -r * sin - r**2 * sin * cos / high
    slope = -r * cos - r**2 * (cos**2 - sin**2) / high - r**4 * sin**2 * cos**2 / high**3
    return gain, slope, -r * cos / high


def linkage(crank: float, rod: float) -> dict[str, Any]:
    points = {"O": [0, 0]}
    bodies = {
        "frame": {"points": points},
        "crank": {"points": {"O": [0, 0], "A": [crank, 0]}},
        "rod": {"points": {"A": [0, 0], "B": [rod, 0]}, "guess": -0.1},
        "slider": {"points": {"B": [0, 0]}, "mass": 3.0},
    }
    joints = [
        {"name": "O", "type": "pin", "between": ["frame.O", "crank.O"]},
        {"name": "A", "type": "pin", "between": ["crank.A", "rod.A"]},
        {"name": "B", "type": "pin", "between": ["rod.B", "slider.B"]},
        {"name": "guide", "type": "slide", "between": ["frame.O", "slider.B"]},
    ]
    return {"type": "linkage", "name": "press", "driver": "O", "bodies": bodies, "joints": joints, "start": 0.2}


@pytest.mark.parametrize(
    ("kind", "rod"), sample([("slider-crank", 0.100001), ("slider-crank", 0.3), ("linkage", 0.100001)], 3)
)
def test_the_reduced_machine_is_off_by_no_more_than_told(kind: str, rod: float) -> None:
    """A rod hardly longer than the crank all but locks at a quarter turn: figures lose digits there, and say so."""
    named = {"type": kind, "name": "press", "crank": {"length": 0.1}, "rod": {"length": rod}, "slider": {"mass": 3.0}}
    mechanism = named if kind == "slider-crank" else linkage(0.1, rod)
    port = "press.slider" if kind == "slider-crank" else "press.guide"
    load = [{"on": port, "force": "-200*(1 + x)"}]
    scene = {"mechanism": mechanism, "load": load, "regime": {"speed": 10}, "flywheel": {"inertia": 1}}
    machine = Machine(flywheel.load({**scene, "drive": {"torque": "balance"}}))
    state = flywheel.reduce(machine, ANGLES, balance=0.0)
    errors = state_errors(machine, state)
    with mpmath.workdps(30):
        for k, phi in enumerate(state.phi.tolist()):
            gain, slope, _ = slider_crank(0.1, rod, phi)
            x = (
                mpmath.mpf("0")
                + mpmath.mpf(0.1) * mpmath.cos(phi)
                + mpmath.sqrt(mpmath.mpf(rod) ** 2 - (mpmath.mpf(0.1) * mpmath.sin(phi)) ** 2)
            )
            true = {"inertia": 3 * gain**2, "slope": 6 * gain * slope}
            pairs = [(getattr(state, name)[k], value, errors[name][k]) for name, value in true.items()]
            pairs += [(state.gains[port][k], gain, errors["gains"][port][k])]
            pairs += [(state.gain_slopes[port][k], slope, errors["gain_slopes"][port][k])]
            if kind == "slider-crank":
                pairs += [(state.moment[k], -200 * (1 + x) * gain, errors["moment"][k])]
            for value, wanted, error in pairs:
                assert abs(mpmath.mpf(float(value)) - wanted) <= error
                assert error <= 1e-11 * (1 + abs(wanted)) * (1.0 if rod > 0.105 else 1e7)


def test_a_balance_s_error_is_in_the_moment() -> None:
    scene = flywheel.load(PRESS)
    found = json.loads(reduction.reduced(scene, points=4, as_json=True)[0])
    assert found["errors"]["balance"] > 0.0
    assert min(found["errors"]["moment"]) >= found["errors"]["balance"]


# -- reactions -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rod", sample([0.100001, 0.3], 2))
def test_forces_are_off_by_no_more_than_told(rod: float) -> None:
    named = {"type": "slider-crank", "name": "press", "crank": {"length": 0.1}, "rod": {"length": rod}}
    mechanism = named | {"slider": {"mass": 3.0}}
    scene = {"mechanism": mechanism, "load": [{"on": "press.slider", "force": -200}], "drive": {"torque": "balance"}}
    machine = Machine(flywheel.load({**scene, "regime": {"speed": 10}, "flywheel": {"inertia": 1}}))
    found = joint_forces(machine, ANGLES, speed=10.0)
    errors = joint_errors(machine, found)["press"]
    forces_of = found.mechanisms["press"]
    with mpmath.workdps(30):
        for k, phi in enumerate(found.motion.phi.tolist()):
            gain, slope, _ = slider_crank(0.1, rod, phi)
            push = -200 - 3 * slope * 100
            tangent = (
                mpmath.mpf(0.1)
                * mpmath.sin(phi)
                / mpmath.sqrt(mpmath.mpf(rod) ** 2 - (mpmath.mpf(0.1) * mpmath.sin(phi)) ** 2)
            )
            action = -push * gain
            assert abs(float(forces_of.action[k]) - action) <= errors["driving"]["pivot"][k]
            assert (
                abs(float(forces_of.components["guide"]["normal"][k]) + push * tangent)
                <= errors["joints"]["guide"]["normal"][k]
            )
            assert errors["joints"]["guide"]["normal"][k] <= 1e-9 * (1 if rod > 0.2 else 1e9)


# -- simulate, against an integration by hand ------------------------------------------------------------------------------

DC = {"type": "dc", "voltage": 24.0, "resistance": 0.8, "constant": 0.6}
MACHINE = {
    "inertia": [{"on": "crank", "value": 0.15}],
    "load": [{"on": "crank", "torque": "-4 - 3*sin(phi)"}],
    "drive": {"motor": DC},
    "flywheel": {"inertia": 0.05},
}


@cache
def motion_by_hand(until: float) -> Any:
    def rates(t: float, y: Any) -> list[float]:
        current = (24.0 - 0.6 * y[1]) / 0.8
        load = -4 - 3 * math.sin(y[0])
        return [y[1], (0.6 * current + load) / 0.2, 0.6 * current * y[1], load * y[1], 0.8 * current**2]

    return solve_ivp(rates, (0, until), [0.0] * 5, "DOP853", rtol=1e-13, atol=1e-14, dense_output=True)


@pytest.mark.parametrize("rtol", sample([1e-5, 1e-7], 2))
def test_a_run_up_is_off_by_no_more_than_told(rtol: float) -> None:
    found = transient(flywheel.load(MACHINE), end=2.0, rtol=rtol)
    errors, by_hand = estimates(found), motion_by_hand(2.0)
    phi, omega, drive, load, copper = by_hand.y[:, -1]
    wanted = {"end.phi": phi, "end.omega": omega, "energy.drive": drive, "energy.copper": copper}
    wanted["energy.works.load[0] on crank"] = load
    wanted["energy.kinetic_gained"] = 0.1 * omega**2
    assert found.regime_speed is not None
    asked = 0.95 * found.regime_speed
    times = np.linspace(0, 2, 4001)
    speeds = by_hand.sol(times)[1]
    above = int(np.argmax(speeds >= asked))
    wanted["time_to_95_percent"] = brentq(lambda t: by_hand.sol(t)[1] - asked, times[above - 1], times[above], xtol=1e-14)
    result = found.as_dict()
    for path, true in wanted.items():
        value, error = result, errors
        for key in path.split(".", 2):
            value, error = value[key], error[key]
        assert abs(value - true) <= error + 1e-12 * abs(true), path
        assert error <= 2e3 * rtol * max(abs(true), 1.0), path
    power = speeds * 0.6 * (24 - 0.6 * speeds) / 0.8
    top = result["peaks"]["power"]
    assert top["value"] >= power.max() - errors["peaks"]["power"]["value"]
    assert top["time"] == pytest.approx(times[power.argmax()], abs=errors["peaks"]["power"]["time"] + 2e-3)
    assert errors["peaks"]["power"]["time"] < 0.3
    columns, told = evenly(found, 50), of_samples(found, 50)
    at = by_hand.sol(columns.t)
    for name, true in (("phi", at[0]), ("omega", at[1]), ("kinetic", 0.1 * at[1] ** 2)):
        error = told[name]
        assert error is not None
        assert np.abs(getattr(columns, name) - true).max() <= error + 1e-12 * np.abs(true).max(), name


@pytest.mark.slow
def test_the_time_of_a_flat_peak_is_as_open_as_it_is() -> None:
    """Power of a line is greatest at half its no-load speed: w = w0 (1 - exp(-t/T)), so at t = T ln 2."""
    line = {"type": "line", "starting_torque": 10.0, "slope": 1.0}
    scene = {"inertia": [{"on": "crank", "value": 2}], "drive": {"motor": line}, "flywheel": {"inertia": 0}}
    found = transient(flywheel.load(scene), end=5.0)
    errors = estimates(found)["peaks"]["power"]
    assert found.peaks.power is not None
    assert abs(found.peaks.power.value - 25.0) <= errors["value"]
    assert abs(found.peaks.power.time - 2 * math.log(2)) <= errors["time"] < 1e-2


@pytest.mark.slow
def test_peaks_that_come_again_each_turn_have_no_one_time() -> None:
    """Without losses every turn is as the first: which of the equal peaks is the greatest is rounding."""
    found = transient(flywheel.load(scenes.yoke(flywheel={"inertia": 300})), start="regime", end="2 turns")
    assert estimates(found)["peaks"]["speed"]["time"] > 1.0


@pytest.mark.parametrize("options", sample([{"start": "regime", "drive": False, "end": "stop"}, {"end": "1.2 s"}], 2))
def test_every_figure_of_a_motion_has_its_error(options: dict[str, Any]) -> None:
    found = transient(flywheel.load(MACHINE), rtol=1e-6, **options)
    result = json.loads(transients.json(found, 20, breaks=True))
    assert without_error(result) == set()
