"""The angle between two cranks for the least flywheel, by a sweep, by optimisation and by hand.

    python two_cranks.py [two_cranks.svg]

By hand: half a turn apart the moment is FR |sin phi| less its mean 2FR/pi. Between the angles at which these are equal,
sin a = 2/pi, the swing is FR (2 cos a - (2/pi)(pi - 2a)), and the flywheel that over eps w², less the machine's own inertia.
"""

from __future__ import annotations

import sys
from math import asin, cos, degrees, pi
from pathlib import Path

import numpy as np

import flywheel
from flywheel.designs.optimum import Optimum
from flywheel.numerics.units import columns
from flywheel.pictures import designs as picture

SCENE = Path(__file__).with_suffix(".toml")
PHASE, LOW, HIGH = "mechanism.1.phase", pi / 3, 5 * pi / 3  # rad
FORCE, CRANK, OWN = 2e3, 0.1, 0.05  # N, m, kg m²: as in the scene
SPEED, IRREGULARITY = 10 * pi, 0.02  # rad/s


def by_sweep(scene: flywheel.Scene, many: int = 241) -> tuple[float, float]:
    """The best of many angles (rad), and its flywheel (kg m²)."""
    found = flywheel.sweep(scene, {PHASE: np.linspace(LOW, HIGH, many)})
    best = found.argmin("exact")
    return float(found.columns[PHASE][best]), float(found.exact[best])


def by_optimisation(scene: flywheel.Scene) -> Optimum:
    """The best angle of all."""
    return flywheel.optimize(scene, "flywheel.exact", over={PHASE: (LOW, HIGH)}, samples=16, starts=2)


def by_hand() -> tuple[float, float]:
    """The angle (rad) and the flywheel (kg m²) in closed form."""
    a = asin(2 / pi)
    swing = FORCE * CRANK * (2 * cos(a) - (2 / pi) * (pi - 2 * a))
    return pi, swing / (IRREGULARITY * SPEED**2) - OWN


def main(path: str | None = None) -> None:
    """Print the three, and draw the course of the optimisation into a file."""
    scene = flywheel.load(SCENE)
    optimum = by_optimisation(scene)
    ways = [
        ("sweep of 241 angles", *by_sweep(scene)),
        ("optimisation", optimum.numbers[PHASE], optimum.value),
        ("by hand", *by_hand()),
    ]
    rows = [(name, f"{degrees(angle):.8f}", f"{value:.12f}") for name, angle, value in ways]
    print("\n".join(columns(rows, ("", "angle, deg", "flywheel, kg m²"))))
    if path is not None:
        picture.plot_optimum(optimum, path)


if __name__ == "__main__":
    main(*sys.argv[1:])
