"""Engines: indicated and brake work against integrals by hand, and the unit of every balance."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

import flywheel
from flywheel.numerics.faults import SceneError
from flywheel.sizing.results import mean_effective_pressure, mechanical_efficiency
from flywheel.tables import sizing as report

BORE, CRANK, ROD = 0.084, 0.045, 0.145
AREA = pi * BORE**2 / 4
SLIDER = {"type": "slider-crank", "crank": {"length": CRANK}, "rod": {"length": ROD}, "slider": {"mass": 0.5}}
DIAGRAM = {"type": "indicator", "bore": BORE, "position": [0, 0.5, 1], "out": [40e5, 12e5, 4e5], "back": [9e5, 2e5, 1e5]}
LOOP = (31e5 / 2 + 10e5 + 3e5 / 2) / 2  # mean of out less back over the stroke, by trapezia


def scene(**changes: Any) -> dict[str, Any]:
    loads = [{"on": "slider", "model": DIAGRAM}, {"on": "crank", "torque": "-T"}]
    machine = {"mechanism": SLIDER, "load": loads, "parameters": {"T": "balance"}, "regime": {"speed": 150}}
    return {**machine, "flywheel": {"irregularity": 0.02}, **changes}


def sized(**changes: Any) -> flywheel.Sizing:
    return flywheel.size(flywheel.load(scene(**changes)), simulate=False)


def speed_of_slider(phi: float) -> float:
    s, c = np.sin(phi), np.cos(phi)
    return float(-CRANK * s - CRANK**2 * s * c / np.sqrt(ROD**2 - (CRANK * s) ** 2))


def test_a_diagram_s_work_its_mean_pressure_and_what_the_load_takes() -> None:
    result = sized()
    engine, work = result.engine, LOOP * AREA * 2 * CRANK
    assert engine is not None
    assert engine.indicated_work == pytest.approx(work, rel=1e-12)
    assert engine.indicated_power == pytest.approx(work * 150 / (2 * pi), rel=1e-12)
    assert engine.swept_volume == pytest.approx(AREA * 2 * CRANK, rel=1e-12)
    assert engine.mean_effective_pressure == pytest.approx(LOOP, rel=1e-12)
    assert engine.brake_work == pytest.approx(work, rel=1e-12)
    assert engine.mechanical_efficiency == pytest.approx(1.0, rel=1e-12)
    text = report.text(result)
    assert "N m" in text.split("T (balance)")[1].splitlines()[0]
    assert f"{LOOP / 1e5:g}" in text.split("mean effective pressure")[1].splitlines()[0]
    assert "none" not in text.split("Speed of the crank")[0]


def test_what_a_damper_takes_the_load_does_not_get() -> None:
    engine = sized(damper=[{"on": "slider", "coefficient": 3.0}]).engine
    assert engine is not None
    assert engine.mechanical_efficiency is not None
    assert engine.mechanical_efficiency < 1.0
    assert engine.indicated_work == pytest.approx(LOOP * AREA * 2 * CRANK, rel=1e-9)


def test_losses_at_constant_speed_by_hand() -> None:
    """Friction on the piston and in the bearings, of constant size: 2 F stroke and T 2 pi a cycle."""
    loads = [*scene()["load"], {"on": "slider", "force": "-40*sign(v)"}]
    loads += [{"on": "crank", "model": {"type": "losses", "constant": "1.5 N m"}}]
    engine = sized(load=loads).engine
    assert engine is not None
    lost = 40 * 4 * CRANK + 1.5 * 2 * pi
    assert engine.brake_work == pytest.approx(engine.indicated_work - lost, rel=1e-9)
    assert engine.mechanical_efficiency == pytest.approx(1 - lost / engine.indicated_work, rel=1e-9)


FORCE = {"on": "slider", "force": "-9e3*(1 + cos(phi))*(1 if phi < pi else 0.25)", "every": 2 * pi}


@pytest.mark.parametrize("bore", [None, BORE])
def test_a_force_is_that_of_gas_where_it_drives(bore: float | None) -> None:
    gas = FORCE | ({} if bore is None else {"bore": bore})
    engine = sized(load=[gas, {"on": "crank", "torque": "-T"}], regime={"speed": 150, "cycle": 4 * pi}).engine
    force = (lambda phi: -9e3 * (1 + np.cos(phi)), lambda phi: -9e3 * (1 + np.cos(phi)) / 4)
    halves = ((0.0, pi), (pi, 2 * pi))
    work = sum(quad(lambda p, f=f: f(p) * speed_of_slider(p), a, b, epsabs=0, epsrel=1e-12)[0]
               for f, (a, b) in zip(force, halves, strict=True))  # fmt: skip
    assert engine is not None
    assert engine.indicated_work == pytest.approx(2 * work, rel=1e-9)
    if bore is None:
        assert (engine.swept_volume, engine.mean_effective_pressure) == (None, None)
    else:
        assert engine.swept_volume == pytest.approx(2 * AREA * 2 * CRANK, rel=1e-12)  # twice in these two turns
        assert engine.mean_effective_pressure == pytest.approx(work / (AREA * 2 * CRANK), rel=1e-9)


def test_three_cylinders_and_a_drive_that_brakes() -> None:
    """Forces alone, in the scene's own words: the drive takes what they give."""
    engine = flywheel.size(flywheel.load("examples/machines/three_cylinder.toml"), simulate=False).engine
    single = flywheel.size(flywheel.load("examples/machines/engine.toml"), simulate=False).engine
    assert engine is not None
    assert single is not None
    assert engine.indicated_work == pytest.approx(3 * single.indicated_work, rel=1e-12)
    assert engine.swept_volume == pytest.approx(3 * AREA * 2 * CRANK, rel=1e-12)
    assert engine.mean_effective_pressure == pytest.approx(single.mean_effective_pressure, rel=1e-12)
    assert engine.brake_work == pytest.approx(engine.indicated_work, rel=1e-12)


def test_machines_that_gas_does_not_drive_are_no_engines() -> None:
    loads = [{"on": "slider", "force": "-500*sign(v)"}]
    assert sized(load=loads, drive={"torque": "balance"}, parameters={}).engine is None
    backwards = DIAGRAM | {"out": DIAGRAM["back"], "back": DIAGRAM["out"]}
    assert sized(load=[{"on": "slider", "model": backwards}, {"on": "crank", "torque": "T"}]).engine is None


@pytest.mark.parametrize(
    ("load", "fault"),
    [
        ({"on": "crank", "torque": "-T", "bore": 0.1}, "load[0].bore"),
        ({"on": "slider", "model": DIAGRAM, "bore": 0.1}, "load[0].bore"),
        ({"on": "slider", "force": "-T", "bore": 0}, "load[0].bore"),
        ({"on": "slider", "force": "-T", "bore": "84 kg"}, "load[0].bore"),
    ],
)
def test_bores_that_are_none(load: dict[str, Any], fault: str) -> None:
    with pytest.raises(SceneError) as caught:
        flywheel.load(scene(load=[load, {"on": "crank", "torque": "-T"}]))
    assert [found.path for found in caught.value.faults] == [fault]


def test_formulas_refuse_what_cannot_be() -> None:
    with pytest.raises(SceneError, match="swept_volume"):
        mean_effective_pressure(1.0, 0.0)
    with pytest.raises(SceneError, match="indicated"):
        mechanical_efficiency(1.0, 0.0)


# --- units of balances ------------------------------------------------------------------------------------------------

UNITS = {
    "-T": "N m",
    "-T*omega": "N m s/rad",
    "-T*omega**2/2": "N m s^2/rad^2",
    "-3 - T if phi < pi else -T": "N m",
    "-T*x": "N m/rad",
    "-T/k": "N^2 m^2",
    "-T*(1 + omega)": None,
}


@pytest.mark.parametrize("law", UNITS)
def test_a_balance_has_the_unit_of_what_it_stands_in(law: str) -> None:
    parameters = {"T": "balance", "k": "2 N m", "j": 3}
    result = sized(load=[scene()["load"][0], {"on": "crank", "torque": law}], parameters=parameters)
    assert result.balance_unit == UNITS[law] == result.as_dict()["balance_unit"]
    line = report.text(result).split("T (balance)")[1].splitlines()[0]
    assert line.endswith(UNITS[law] or "in the units of its expression")


def test_a_balance_in_two_places_of_two_units_has_none() -> None:
    loads = [scene()["load"][0], {"on": "slider", "force": "-T*sign(v)"}, {"on": "crank", "torque": "-T"}]
    assert sized(load=loads).balance_unit is None
    assert flywheel.size(flywheel.load(scene(load=loads[:2], drive={"torque": "2 N m"})), simulate=False).balance_unit == "N"
