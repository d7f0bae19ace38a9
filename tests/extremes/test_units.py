"""Units from 1e-12 to 1e12 of length, mass and time: the answers scale with them.

Where the units are powers of two, every number is only moved along the exponents, so that the answers must not differ in a
single bit: no hidden size, no tolerance in metres or joules is left anywhere.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import flywheel

from .machines import MACHINES, SI, Measure
from .measured import Row

TWOS = [Measure(2.0**i, 2.0**j, 2.0**k) for i, j, k in ((40, 0, 0), (-40, 0, 0), (0, 40, 0), (0, -40, 0), (0, 0, 40))]
TWOS += [Measure(2.0**i, 2.0**j, 2.0**k) for i, j, k in ((0, 0, -40), (40, 40, 40), (-40, -40, -40), (40, -40, 40))]
TENS = [Measure(1e12, 1.0, 1.0), Measure(1e-12, 1.0, 1.0), Measure(1.0, 1e12, 1e-12), Measure(1.0, 1e-12, 1e12)]
FAST = [name for name in MACHINES if name not in ("cam", "law")]
TOGGLE = {"frame.height": 0.14, "bell_crank.drive_length": 0.168, "bell_crank.clamp_length": 0.22, "coupler.length": 0.095}
TOGGLE |= {"rod.length": 0.26, "coupler.com": 0.05, "rod.com": 0.13}


@cache
def figures(name: str, unit: Measure = SI) -> dict[str, Any]:
    """The answers for a machine that is written in other units, brought back to SI."""
    found = flywheel.size(flywheel.load(MACHINES[name](unit)), simulate=False)
    wheel, inertia = found.flywheel, found.reduced_inertia
    assert inertia is not None
    assert found.balance is not None
    kilograms, joules = unit.inertia(1.0), unit.joule(1.0)
    return {
        "exact": wheel.exact / kilograms,
        "approximate": wheel.approximate / kilograms,
        "approximate_total": wheel.approximate_total / kilograms,
        "inertia_torque": wheel.inertia_torque / kilograms,
        "least": inertia.least / kilograms,
        "greatest": inertia.greatest / kilograms,
        "balance": found.balance.value / joules,
        "fluctuation": found.energy_fluctuation / joules,
        "areas": [area.work / joules for area in found.areas],
        "angles": [area.end for area in found.areas] + [found.angle_speed_max, found.angle_speed_min],
        "error": found.error.exact,
    }


def apart(name: str, unit: Measure) -> float:
    """The largest relative difference of the flywheel's figures from those in SI."""
    one, other = figures(name), figures(name, unit)
    keys = ("exact", "approximate", "approximate_total", "inertia_torque", "balance", "fluctuation")
    return max(abs(other[key] - one[key]) / (one["exact"] if key in keys[:4] else abs(one[key])) for key in keys)


def results() -> list[Row]:
    """One row for powers of two, one for powers of ten."""
    two = max(apart(name, unit) for name in FAST for unit in TWOS)
    ten = max(((apart(name, unit), name) for name in FAST for unit in TENS), key=lambda pair: pair[0])
    return [
        Row("units of length, mass, time", "2^±40, together too", two, 0.0, "bit for bit the same, areas and angles too"),
        Row("units of length, mass, time", "1e±12", ten[0], figures(ten[1])["error"], "rounding of the input"),
    ]


@pytest.mark.parametrize("name", FAST)
def test_units_that_are_powers_of_two_do_not_change_a_bit(name: str) -> None:
    for unit in TWOS[1::3]:
        assert figures(name, unit) == figures(name), unit


@pytest.mark.parametrize("name", ["law", pytest.param("cam", marks=pytest.mark.slow)])
def test_nor_do_they_for_what_takes_longer(name: str) -> None:
    assert figures(name, TWOS[-1]) == figures(name)


@pytest.mark.parametrize("name", FAST)
def test_units_that_are_powers_of_ten_change_rounding_alone(name: str) -> None:
    for unit in TENS:
        assert apart(name, unit) <= 2 * figures(name)["error"] + 4e-16
        assert apart(name, unit) < 1e-13


exponents = st.integers(-40, 40)


@settings(max_examples=6, deadline=None, derandomize=True)
@given(st.sampled_from(["rotor", "scotch-yoke", "slider-crank", "crank-shaper"]), exponents, exponents, exponents)
@example("four-bar", -39, 40, -13)
def test_any_power_of_two_will_do(name: str, length: int, mass: int, time: int) -> None:
    assert figures(name, Measure(2.0**length, 2.0**mass, 2.0**time)) == figures(name)


def clamp(unit: Measure) -> dict[str, Any]:
    """A toggle clamp along its stroke."""
    mechanism: dict[str, Any] = {
        "type": "toggle-clamp",
        "block": {"mass": unit.kg(43.0)},
        "platen": {"mass": unit.kg(396.0)},
    }
    for key, value in TOGGLE.items():
        body, name = key.split(".")
        mechanism.setdefault(body, {})[name] = unit.m(value)
    mechanism["bell_crank"] |= {"angle": 0.302, "mass": unit.kg(16.0), "inertia": unit.inertia(0.12), "com": unit.m(0.11)}
    mechanism["coupler"] |= {"mass": unit.kg(1.3), "inertia": unit.inertia(0.002)}
    mechanism["rod"] |= {"mass": unit.kg(16.7), "inertia": unit.inertia(0.17)}
    stroke = {"from": unit.m(-0.06), "to": unit.m(0.19), "speed": unit.m(0.33) / unit.time}
    load = {"on": "platen", "force": unit.newton(-500.0)}
    return {"mechanism": mechanism, "load": [load], "gravity": unit.gravity(), "stroke": stroke}


def reduced(unit: Measure) -> list[list[float]]:
    """Mass and force of the clamp reduced to its block at a few places, in SI."""
    machine = flywheel.Machine(flywheel.load(clamp(unit)))
    places = [unit.m(x) for x in (-0.06, 0.0, 0.1, 0.15, 0.18999)]
    found = [machine.reduction(x) for x in places]
    return [[float(r.inertia) / unit.kg(1.0), float(r.moment) / unit.newton(1.0)] for r in found]


def test_a_toggle_clamp_scales_too() -> None:
    for unit in TWOS:
        assert reduced(unit) == reduced(SI)
