"""The lightest motor and wheel of a press together, fast enough: an optimum between a heavy motor and a heavy wheel.

    python lightest_drive.py [lightest_drive.svg]

A motor weighs 9 kg for each kilowatt. A larger one slips less, so that it helps more while the punch works, and the wheel
may be lighter; a wheel that gives more of its speed is lighter too, and the press then makes fewer holes: 58.25 a minute
are asked for. The search takes about a minute, as every design has a speed of its own to be found.
"""

from __future__ import annotations

import sys
from math import pi
from pathlib import Path

import flywheel
from flywheel.designs.optimum import Optimum
from flywheel.numerics.units import columns
from flywheel.pictures import designs as picture

SCENE = Path(__file__).with_suffix(".toml")
MOTOR, IRREGULARITY = "drive.motor.power", "flywheel.irregularity"
KG_PER_WATT = 0.009
SLOWEST = 6.1  # rad/s
BEST = (2761.5, 0.13797)  # W and irregularity, as the search finds them


def best() -> Optimum:
    """The lightest motor and wheel."""
    return flywheel.optimize(
        flywheel.load(SCENE),
        f"mass + {KG_PER_WATT}*{MOTOR}",
        over={MOTOR: ("2.5 kW", "11 kW"), IRREGULARITY: (0.05, 0.3)},
        subject_to={"speed": (SLOWEST, None), f"power - {MOTOR}": (None, 0)},
        samples=8,
        starts=1,
        rtol=1e-8,
    )


def row(power: float, irregularity: float) -> tuple[str, ...]:
    """A line of the table: what motor and wheel weigh (kg), and the holes a minute."""
    scene = flywheel.load(SCENE).with_({MOTOR: power, IRREGULARITY: irregularity})
    try:
        sizing = flywheel.size(scene, 1e-8, simulate=False)
    except flywheel.SceneError as error:
        return (f"{power:.0f}", f"{irregularity:.4f}", str(error)[:60], "", "", "", "")
    assert sizing.built is not None
    mass, holes = sizing.built.wheel.mass, 30 * sizing.speed / pi
    motor = KG_PER_WATT * power
    broken = ["too slow"] * (sizing.speed < SLOWEST * (1 - 1e-6)) + ["motor too weak"] * ((sizing.power or 0.0) > power)
    numbers = (f"{number:.3f}" for number in (motor, mass, motor + mass, holes))
    return (f"{power:.0f}", f"{irregularity:.4f}", *numbers, ", ".join(broken))


def main(path: str | None = None) -> None:
    """Print the best design and others beside it, and draw the course of the search into a file."""
    found = best()
    power, irregularity = found.numbers[MOTOR], found.numbers[IRREGULARITY]
    others = [(4000.0, 0.10), (power, 0.10), (2500.0, irregularity), (4000.0, irregularity), (5500.0, irregularity)]
    rows = [row(power, irregularity), *(row(*other) for other in others)]
    print("\n".join(columns(rows, ("motor, W", "irregularity", "motor, kg", "wheel, kg", "both, kg", "holes/min", ""))))
    print("\n".join(found.messages))
    if path is not None:
        picture.plot_optimum(found, path)


if __name__ == "__main__":
    main(*sys.argv[1:])
