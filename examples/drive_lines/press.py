"""An ordinary press with its shafts in series, and what it seems to need with all of them geared to the crank.

    python press.py
    python press.py press.png             # the power flow as a picture

The power goes from motor to wheel through the belt, and from the wheel to the crank through the gear. With both geared
to the crank, what fills the wheel would pass the gear on its way in as well: the same press seems to take more power.
"""

from __future__ import annotations

import sys
import tomllib
from math import pi
from pathlib import Path
from typing import Any

import flywheel
from flywheel.numerics.units import columns
from flywheel.sizing.results import Sizing

SCENE = Path(__file__).with_suffix(".toml")


def press() -> dict[str, Any]:
    """The scene as it is written."""
    return tomllib.loads(SCENE.read_text(encoding="utf-8"))


def star(scene: dict[str, Any]) -> dict[str, Any]:
    """The same press with its motor on the crank: ratio and efficiency are those of belt and gear together."""
    wheel, motor = scene["shafts"]["wheel"], scene["shafts"]["motor"]
    passed = 1.0 - float(motor["slip"].removesuffix(" %")) / 100
    ratio = wheel["ratio"] * motor["ratio"] / passed
    on_crank = {"ratio": ratio, "efficiency": wheel["efficiency"] * motor["efficiency"] * passed}
    return scene | {"shafts": {"wheel": wheel, "motor": on_crank}}


def sized(scene: dict[str, Any]) -> Sizing:
    """The sizing, without time stepping."""
    return flywheel.size(flywheel.load(scene), simulate=False)


def row(name: str, sizing: Sizing) -> list[str]:
    """Flywheel, speed, power, torque and heat of a drive line."""
    energy, wheel = sizing.energy, sizing.flywheel.exact
    assert energy is not None
    assert wheel is not None
    assert energy.rotor_heat_share is not None
    figures = [energy.mean_power / 1e3, energy.peak_power / 1e3, energy.rms_torque, energy.rotor_heat_share]
    return [name, f"{wheel:.3f}", f"{sizing.speed * 30 / pi:.3f}", *(f"{value:.4f}" for value in figures)]


def losses(sizing: Sizing) -> str:
    """Table of the mean power of every loss and load (W), and of what their sum leaves of the input."""
    flow = flywheel.power_flow(sizing)
    assert flow is not None
    rows = [["in", "", f"{flow.input:.3f}", ""]]
    shown = [stream for stream in flow.streams if stream.lost or stream.kind == "load"]
    rows += [[stream.kind, stream.name, f"{stream.mean:.3f}", f"{stream.mean / flow.input:.2%}"] for stream in shown]
    rows.append(["left", "", f"{flow.left:.1e}", ""])
    return "\n".join(columns(rows, ["", "of", "W", "of the input"]))


def main(picture: str | None = None) -> None:
    """Print the comparison, and draw the power flow."""
    scene = press()
    series, geared = sized(scene), sized(star(scene))
    head = ["shafts", "J, kg m²", "crank, rpm", "mean, kW", "peak, kW", "rms, N m", "heat of rated"]
    print("\n".join(columns([row("in series", series), row("all on the crank", geared)], head)))
    one, other = series.energy, geared.energy
    assert one is not None
    assert other is not None
    print(
        f"\n  all on the crank: {other.mean_power / one.mean_power - 1:+.1%} mean power, "
        f"{other.rms_torque / one.rms_torque - 1:+.1%} rms torque\n"
    )
    print(losses(series))
    if picture is not None:
        flow = flywheel.power_flow(series)
        assert flow is not None
        flow.plot(picture)


if __name__ == "__main__":
    main(*sys.argv[1:2])
