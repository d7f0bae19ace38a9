"""The press of the examples against its series equations, its sheet written out as an expression of the crank's angle."""

from __future__ import annotations

import runpy
from math import cos, pi, sin, sqrt
from pathlib import Path
from typing import Any

import pytest
from scipy.optimize import brentq

from tests.oracle.drive_lines import DriveLine, Regime

FOLDER = Path(__file__).parents[2] / "examples" / "drive_lines"
pytestmark = pytest.mark.slow


def by_hand(scene: dict[str, Any], inertia: float) -> Regime:
    """The press with the force of its punch against the angle, and the friction of its guides."""
    r, rod, thickness, beyond = 0.05, 0.4, 0.008, 0.004
    bottom = r + rod

    def left(phi: float) -> float:
        return bottom - r * cos(phi) - sqrt(rod**2 - (r * sin(phi)) ** 2)

    first, last = (float(brentq(lambda a, way=way: left(a) - way, pi, 2 * pi)) for way in (beyond + thickness, beyond))
    way = f"{r}*cos(phi) + sqrt({rod**2} - ({r}*sin(phi))**2) - {bottom - beyond - thickness!r}"
    force = f"-{pi * 0.06 * thickness * 360e6!r}*(1 - ({way})/{thickness})"
    load = [{"on": "slider", "force": force, "from": first, "to": last}, {"on": "slider", "force": "-900*sign(v)"}]
    return DriveLine(scene | {"load": load, "flywheel": {"on": "wheel"}}).analysed(inertia)


def test_press_in_series_and_with_all_shafts_on_the_crank(capsys: pytest.CaptureFixture[str]) -> None:
    example = runpy.run_path(str(FOLDER / "press.py"), run_name="example")
    scene = example["press"]()
    means = []
    for table in (scene, example["star"](scene)):
        sizing = example["sized"](table)
        true = by_hand(table, sizing.flywheel.exact)
        assert true.irregularity == pytest.approx(0.15, rel=1e-9)
        found = [getattr(sizing.energy, key) for key in ("mean_power", "peak_power", "rms_torque", "rotor_heat")]
        assert found == pytest.approx([true.mean_power, true.peak_power, true.rms_torque, true.rotor_heat], rel=1e-9)
        means.append((true.mean_power, true.rms_torque))
    example["main"]()
    power, torque = (other / one - 1 for one, other in zip(*means, strict=True))
    more = f"{power:+.1%} mean power, {torque:+.1%}"
    assert more in capsys.readouterr().out
    assert more == "+4.6% mean power, +3.0%"
