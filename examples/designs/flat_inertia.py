"""A balance weight and its rod that flatten the inertia of a compressor, or make its flywheel least.

    python flat_inertia.py [flat_inertia.svg]

By hand, with rods so long that both pistons run as sines: m1 r² sin² phi + m2 r² cos² phi is constant where m2 = m1, m1 the
piston with the part of the rod that goes with it. With rods as they are the flywheel asks for a little less: the load has
its own swing, which the inertia's takes a part of.
"""

from __future__ import annotations

import sys
from pathlib import Path

import flywheel
from flywheel.designs.optimum import Optimum
from flywheel.numerics.units import columns
from flywheel.pictures import designs as picture
from flywheel.sizing.results import Sizing

SCENE = Path(__file__).with_suffix(".toml")
MASS, ROD = "mechanism.1.slider.mass", "mechanism.1.rod.length"
OVER = {MASS: ("1 kg", "8 kg"), ROD: ("160 mm", "600 mm")}
PISTON, RODS_MASS, COM, LENGTH = 3.5, 1.2, 0.080, 0.240  # kg, kg, m, m: as in the scene
FLAT = "reduced_inertia_greatest - reduced_inertia_least"


def best(objective: str, samples: int = 32, starts: int = 2) -> Optimum:
    """The mass and the rod that make something least."""
    return flywheel.optimize(flywheel.load(SCENE), objective, over=OVER, samples=samples, starts=starts)


def by_hand() -> float:
    """The balance mass (kg) for long rods: the piston, and the part of its rod that goes with it."""
    return PISTON + RODS_MASS * COM / LENGTH


def row(name: str, sizing: Sizing) -> tuple[str, ...]:
    """A line of the table: the balance, the swing of the inertia, the flywheel."""
    balance, inertia, exact = sizing.scene.mechanisms[1], sizing.reduced_inertia, sizing.flywheel.exact
    assert inertia is not None
    assert exact is not None
    numbers = (balance.bodies["slider"].mass, 1e3 * balance.geometry["rod.length"])
    return (name, *(f"{number:.5g}" for number in numbers), f"{inertia.max - inertia.min:.5f}", f"{exact:.6f}")


def main(path: str | None = None) -> None:
    """Print the compressor as it is and the best ones, and draw the course of the first search into a file."""
    scene = flywheel.load(SCENE)
    hand = {MASS: by_hand(), ROD: 0.600}
    least, flattest = best("flywheel.exact"), best(FLAT)
    rows = [
        row("as it is", flywheel.size(scene, simulate=False)),
        row("least flywheel", least.sizing),
        row("flattest inertia", flattest.sizing),
        row("long rods, by hand", flywheel.size(scene.with_(hand), simulate=False)),
    ]
    header = ("", "balance, kg", "its rod, mm", "swing of I*, kg m²", "flywheel, kg m²")
    print("\n".join(columns(rows, header)))
    if path is not None:
        picture.plot_optimum(least, path)


if __name__ == "__main__":
    main(*sys.argv[1:])
