"""Moving slider-cranks: a multibody program's runs, and the energy equation at 25 digits."""

from __future__ import annotations

from typing import Any

import pytest

import flywheel

from .common import agree, inputs


def slider_crank(crank: dict[str, float], rod: dict[str, float], slider: float, **more: Any) -> flywheel.Machine:
    kind = {"type": "slider-crank", "crank": crank, "rod": rod, "slider": {"mass": slider}}
    scene = {"mechanism": kind, **more, "regime": {"speed": 10}, "flywheel": {"irregularity": 0.1}}
    return flywheel.Machine(flywheel.load(scene))


def test_free_for_a_second() -> None:
    case = inputs("xtool-exudyn-free")
    crank = {"length": case["r"], "inertia": case["I1"]}
    rod = {"length": case["l"], "mass": case["m2"], "inertia": case["I2"], "com": case["l"] / 2}
    motion = flywheel.simulate(slider_crank(crank, rod, case["m3"]), phi=0.0, omega=case["w0"], until=1.0)
    agree("xtool-exudyn-free", omega_1s=motion.omega[-1], phi_1s=motion.phi[-1])


def uniform(length: float, mass: float) -> dict[str, float]:
    return {"length": length, "mass": mass, "inertia": mass * length**2 / 12, "com": length / 2}


@pytest.mark.slow
def test_driven_from_rest() -> None:
    case = inputs("exudyn-driven")
    crank, rod = uniform(case["r"], case["m1"]), uniform(case["l"], case["m2"])
    machine = slider_crank(crank, rod, case["m3"], drive={"torque": case["torque"]})
    motion = flywheel.simulate(machine, phi=0.0, omega=0.0, until=case["t"])
    agree("exudyn-driven", phi=motion.phi[-1], omega=motion.omega[-1])
