"""A punch press under different drives, with the flywheel that each needs for the same irregularity, and without one.

    python punch_press.py

The motor's own characteristic, the constant torque of the textbooks at the same mean speed, and the same motor wound for
three times the slip. The stiffer the motor, the more it works while the punch does: it saves a tenth of the flywheel, and
pays with nearly three times the mean power at the peak. Without a flywheel it stalls.
"""

from __future__ import annotations

import tomllib
from math import cos, pi, sin, sqrt, tau
from pathlib import Path
from typing import Any, NamedTuple

import flywheel
from flywheel.components.press_work import press_cycle, shearing_force, stroke_energy
from flywheel.numerics.units import columns
from flywheel.sizing.results import Sizing

SCENE = Path(__file__).with_suffix(".toml")
DIAMETER, THICKNESS, STRENGTH, OVERTRAVEL = 0.030, 0.012, 360e6, 0.003  # m, m, Pa, m: as in the scene
CRANK, ROD = 0.040, 0.260  # m
SOFT = "1320 rpm"  # rated speed of the motor with more slip


class Drive(NamedTuple):
    """A press with one drive: its name and its sizing."""

    name: str
    sizing: Sizing


def drives() -> list[Drive]:
    """The press with its motor, with a constant torque at the same mean speed, and with a motor of more slip."""
    scene = tomllib.loads(SCENE.read_text(encoding="utf-8"))
    own = _sized(scene)
    motor = scene["drive"]["motor"]
    rotor = {"on": "motor", "value": motor["inertia"]}
    constant = {
        **scene,
        "drive": {"on": "motor", "torque": "balance"},
        "inertia": [rotor],
        "regime": {"speed": own.speed},
    }
    soft = {**scene, "drive": {"on": "motor", "motor": {**motor, "speed": SOFT}}}
    return [
        Drive("the motor, 4 % slip at rated load", own),
        Drive("constant torque", _sized(constant)),
        Drive("a motor with 12 % slip", _sized(soft)),
    ]


def _sized(scene: dict[str, Any]) -> Sizing:
    return flywheel.size(flywheel.load(scene), simulate=False)


def without_flywheel() -> str:
    """Outcome of the press without a flywheel, by its own masses alone, in words."""
    scene = tomllib.loads(SCENE.read_text(encoding="utf-8"))
    try:
        bare = _sized({**scene, "flywheel": {"on": "motor", "inertia": 0}})
    except flywheel.SceneError as error:
        return error.faults[0].defect
    assert bare.simulation is not None
    return f"irregularity {bare.simulation.irregularity:.3g}"


def by_hand(speed: float, irregularity: float) -> float:
    """The flywheel (kg m², on the motor's shaft) as a textbook finds it: J = E (1 - t_b/t_c)/(eps w²), constant power.

    The punch is in the sheet from 15 to 3 mm before the end of its stroke.
    """
    energy = stroke_energy(shearing_force(pi * DIAMETER, THICKNESS, STRENGTH), THICKNESS)
    angles = [_before_end(left) for left in (OVERTRAVEL + THICKNESS, OVERTRAVEL)]
    cycle = tau / speed
    press = press_cycle(energy, cycle, cycle * (angles[0] - angles[1]) / tau)
    return press.given / (irregularity * (24 * speed) ** 2)


def _before_end(left: float) -> float:
    """The crank angle (rad) before its end at which the slider is `left` (m) from it, by bisection."""
    low, high = 0.0, pi
    for _ in range(60):
        phi = 0.5 * (low + high)
        way = CRANK + ROD - CRANK * cos(phi) - sqrt(ROD**2 - (CRANK * sin(phi)) ** 2)
        low, high = (phi, high) if way < left else (low, phi)
    return low


def main() -> None:
    """Print the comparison."""
    found = drives()
    rows = []
    for name, sizing in found:
        energy, wheel = sizing.energy, sizing.flywheel.exact
        assert energy is not None
        assert wheel is not None
        assert energy.peak_to_mean is not None
        speed = 24 * sizing.speed * 30 / pi
        powers = [energy.mean_power / 1e3, energy.peak_power / 1e3, energy.peak_to_mean]
        rows.append([name, f"{wheel:.6f}", f"{speed:.2f}", *(f"{value:.3f}" for value in powers)])
    own = found[0].sizing
    assert own.energy is not None
    assert own.scene.irregularity is not None
    print("\n".join(columns(rows, ["drive", "J, kg m²", "motor, rpm", "mean, kW", "peak, kW", "peak/mean"])))
    print(f"\n  by hand, constant power       {by_hand(own.speed, own.scene.irregularity):.3f} kg m²")
    print(f"  peak if the motor were to follow the punch at constant speed: {own.energy.peak_power_alone / 1e3:.1f} kW")
    print(f"  without a flywheel: {without_flywheel()}")


if __name__ == "__main__":
    main()
