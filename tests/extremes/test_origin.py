"""The origin of phi shifted: a phase and all windows turned with it leave the figures as they are and turn the areas."""

from __future__ import annotations

from functools import cache
from math import degrees, pi, tau
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import flywheel
from flywheel.sizing.results import Sizing
from tests.limits import sample

from .machines import MACHINES, Scene
from .measured import Row

TURNED = ("scotch-yoke", "slider-crank", "four-bar", "crank-shaper", "law", "linkage")
SHIFTS = (1e-15, 1e-12, 1e-9, 0.3, pi / 2, pi, 5.0, tau - 1e-12, -1.0)
FIGURES = ("exact", "approximate", "approximate_total", "inertia_torque")


def turned(name: str, shift: float, turns: int = 0) -> Scene:
    """A machine whose mechanism stands at a phase, with a load of the shaft that is turned back by as much."""
    scene = MACHINES[name]()
    window = {key: (angle - shift) % tau for key, angle in (("from", 0.5), ("to", 1.5))}
    load: dict[str, Any] = {"on": "crank", "torque": -40.0, **window}
    mechanism = {**scene["mechanism"], "phase": f"{shift + turns * tau!r} rad"}
    return {**scene, "mechanism": mechanism, "load": [*scene["load"], load]}


@cache
def sized(name: str, shift: float = 0.0, turns: int = 0) -> Sizing:
    return flywheel.size(flywheel.load(turned(name, shift, turns)), simulate=False)


def apart(name: str, shift: float, turns: int = 0) -> tuple[float, float]:
    """The largest difference of the figures from those that are not turned, and what both errors allow."""
    one, other = sized(name), sized(name, shift, turns)
    scale = max(one.flywheel.exact or 0.0, one.flywheel.approximate_total or 0.0)
    gaps = [abs(getattr(other.flywheel, key) - getattr(one.flywheel, key)) / scale for key in FIGURES]
    gaps.append(abs(other.energy_fluctuation / one.energy_fluctuation - 1))
    return max(gaps), (one.error.exact or 0.0) + (other.error.exact or 0.0)


def results() -> list[Row]:
    """One row for shifts, one for many turns of phase."""
    shifted = max((apart(name, shift) for name in TURNED if name != "law" for shift in SHIFTS), key=lambda pair: pair[0])
    wound = max((apart(name, 0.3, 900) for name in ("slider-crank", "crank-shaper")), key=lambda pair: pair[0])
    return [
        Row("origin of phi", "phase -1..2 pi rad, 1e-15 among them", *shifted, "difference; both estimates added"),
        Row("origin of phi", "phase of 900 turns", *wound, "difference; both estimates added"),
    ]


@pytest.mark.parametrize("name", sample(TURNED, 2))
def test_the_figures_do_not_know_the_origin(name: str) -> None:
    for shift in SHIFTS[::2] if name != "law" else SHIFTS[3:5]:
        gap, allowed = apart(name, shift)
        assert gap <= allowed
        assert gap < 1e-9


@pytest.mark.parametrize("name", ["slider-crank", "crank-shaper"])
def test_nor_do_they_know_hundreds_of_turns(name: str) -> None:
    gap, allowed = apart(name, 0.3, 900)
    assert gap <= allowed


@settings(max_examples=6, deadline=None, derandomize=True)
@given(st.sampled_from(["scotch-yoke", "slider-crank", "crank-shaper"]), st.floats(-tau, tau))
@example("slider-crank", tau)
def test_whatever_the_shift(name: str, shift: float) -> None:
    gap, allowed = apart(name, shift)
    assert gap <= allowed


@pytest.mark.parametrize("shift", [0.3, 2.0, 5.0])
def test_the_areas_turn_with_it(shift: float) -> None:
    """Each crossing moves by the shift; the area that the seam cuts is told in two parts."""
    one, other = sized("slider-crank"), sized("slider-crank", shift)
    crossings = sorted((area.end - shift) % tau for area in one.areas[:-1])
    inner = [area.end for area in other.areas[:-1]]
    assert inner == pytest.approx(crossings, abs=1e-12)
    assert (other.angle_speed_max + shift - one.angle_speed_max + pi) % tau == pytest.approx(pi, abs=1e-9)
    assert (other.angle_speed_min + shift - one.angle_speed_min + pi) % tau == pytest.approx(pi, abs=1e-9)


def test_a_phase_may_be_written_in_degrees() -> None:
    scene = turned("slider-crank", 0.3)
    scene["mechanism"]["phase"] = f"{degrees(0.3)!r} deg"
    found = flywheel.size(flywheel.load(scene), simulate=False)
    assert found.flywheel.exact == pytest.approx(sized("slider-crank", 0.3).flywheel.exact, rel=1e-13)
