"""The injection clamp over its stroke, as its source draws it: motion of links, platen and centres of mass.

    python injection_clamp.py [figure.png]

The block goes at 250 mm in 0.76 s. Prints what the source's window reads out at the end of the stroke beside the figures
of its own lengths, and everything at a few positions of the block. With a file name, draws against the block's position
(figure_position.png, figure_velocity.png, figure_acceleration.png, figure_centres.png).

The window cuts its digits off instead of rounding them, and two of its angles are misprints. The source's acceleration of
the coupler's centre counts from the bell crank's pin but leaves out the acceleration of that pin: as the other end goes at a
constant speed, what it gives is the true vector with the other sign. That the centres
of bell crank and rod rise and fall as one is so: each lies half way to the pin between them.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from math import pi
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import flywheel

Array = NDArray[np.float64]

SCENE = Path(__file__).with_suffix(".toml")
ALPHA = 0.30199  # rad between the bell crank's arms, as in the scene
PLACES = np.array([-60.0, -10.0, 40.0, 90.0, 130.0, 160.0, 190.0])  # mm
CENTRES = {"coupler": "coupler.com", "bell crank": "bell_crank.com", "rod": "rod.com", "platen": "platen.com"}
COLOURS = {"theta2": "#0072B2", "theta3": "#D55E00", "theta5": "#56B4E9", "theta6": "#009E73", "s": "#000000"}
CENTRE_COLOURS = ("#D55E00", "#56B4E9", "#009E73", "#000000")


class Curve(NamedTuple):
    """One thing over the stroke: rad or mm, and the same per second and per second squared."""

    position: Array
    velocity: Array
    acceleration: Array


READ_OUT = (  # at 190 mm, as the source's window gives it
    (("theta2", 2.836), ("theta3", 1.891), ("theta5", 6.264), ("theta6", 0.000), ("s", 480.0)),
    (("theta2", -0.76), ("theta3", 4.069), ("theta5", -0.76), ("theta6", 0.644), ("s", 0.022)),
    (("theta2", -11.9), ("theta3", 13.15), ("theta5", -11.9), ("theta6", 10.13), ("s", -235.0)),
)
UNITS = (("rad", "mm"), ("rad/s", "mm/s"), ("rad/s²", "mm/s²"))
LAST_DIGIT = (
    {"theta2": 1e-3, "theta3": 1e-3, "theta5": 1e-3, "theta6": 1e-3, "s": 1.0},
    {"theta2": 1e-2, "theta3": 1e-3, "theta5": 1e-2, "theta6": 1e-3, "s": 1e-3},
    {"theta2": 1e-1, "theta3": 1e-2, "theta5": 1e-1, "theta6": 1e-2, "s": 1.0},
)


def course(a4: Array) -> tuple[dict[str, Curve], dict[str, Curve]]:
    """Links and platen, and centres of mass (two rows: x, y), at the block's positions (mm), by the source's letters."""
    scene = flywheel.load(SCENE)
    found = flywheel.motion(scene, at=1e-3 * a4, speed=scene.stroke.speed).curves

    def taken(name: str, scale: float = 1.0, offset: float = 0.0) -> Curve:
        curve = found[name]
        return Curve(scale * curve.position + offset, scale * curve.velocity, scale * curve.acceleration)

    links = {"theta2": taken("bell_crank"), "theta3": taken("coupler")}
    links |= {"theta5": taken("bell_crank", offset=ALPHA + pi), "theta6": taken("rod"), "s": taken("platen_guide", 1e3)}
    return links, {name: taken(point, 1e3) for name, point in CENTRES.items()}


def verdict(printed: float, true: float, digit: float) -> str:
    """Verdict on a printed figure, by the true one."""
    if abs(printed - true) <= 0.5 * digit * (1 + 1e-9):
        return "rounded"
    if abs(printed) <= abs(true) < abs(printed) + digit:
        return "cut off"
    return f"MISPRINT, {printed - true:+.4f}"


def letter(name: str, order: int) -> str:
    """The source's symbol of a position, velocity or acceleration: theta2, omega2, alpha2; s, v_s, a_s."""
    return ("s", "v_s", "a_s")[order] if name == "s" else name.replace("theta", ("theta", "omega", "alpha")[order])


def read_out() -> None:
    """The window's figures at the end of the stroke beside the true ones."""
    links, _ = course(np.array([190.0]))
    print("at 190 mm\n                        printed         true")
    for order, row in enumerate(READ_OUT):
        for name, printed in row:
            true = float(links[name][order][0])
            unit, told = UNITS[order][name == "s"], verdict(printed, true, LAST_DIGIT[order][name])
            print(f"  {letter(name, order):10s}{unit:8s}{printed:11g}{true:13.5f}   {told}")
    print("theta6 = 0 and s = 480 mm, printed beside them, need the true theta2 and theta5")


def table() -> None:
    """Links, platen and centres of mass at a few positions."""
    links, centres = course(PLACES)
    for order, words in enumerate(
        ("positions, rad and mm", "velocities, rad/s and mm/s", "accelerations, rad/s² and mm/s²")
    ):
        print(f"\n{words}\n{'a4, mm':>8s}" + "".join(f"{letter(name, order):>12s}" for name in links))
        for k, place in enumerate(PLACES):
            print(f"{place:8.1f}" + "".join(f"{curve[order][k] + 0.0:12.5f}" for curve in links.values()))
    print(f"\naccelerations of centres of mass, mm/s²\n{'a4, mm':>8s}" + "".join(f"{name:>24s}" for name in centres))
    print(f"{'':8s}" + f"{'x':>12s}{'y':>12s}" * len(centres))
    for k, place in enumerate(PLACES):
        print(f"{place:8.1f}" + "".join(f"{value:12.3f}" for c in centres.values() for value in c.acceleration[:, k] + 0.0))
    third = links["theta3"]
    arm = 47.5 * np.exp(1j * third.position)
    printed = (1j * third.acceleration - third.velocity**2) * arm
    print(
        f"the coupler's by the printed formula at 190 mm: {printed[-1].real:.3f} and {printed[-1].imag:.3f}, the other sign"
    )


def plot(path: Path) -> None:
    """The source's figures over the stroke, each pair of them in one file."""
    a4 = np.linspace(-60.0, 190.0, 501)
    links, centres = course(a4)
    dead = a4[np.flatnonzero(np.diff(np.sign(links["s"].velocity)))]

    def draw(name: str, *panels: tuple[str, str, list[Line]]) -> None:
        over_stroke(a4, panels, dead, path.with_stem(f"{path.stem}_{name}"))

    for order, name in enumerate(("position", "velocity", "acceleration")):
        shown = COLOURS if order == 0 else ("theta2", "theta3", "theta6", "s")  # both arms of the bell crank turn as one
        *turning, platen = (Line(letter(key, order), links[key][order], COLOURS[key]) for key in shown)
        of_links = (f"Angular {name} of the links", UNITS[order][0], turning)
        draw(name, of_links, (f"{name.capitalize()} of the platen", UNITS[order][1], [platen]))
    lines = [
        [
            Line(name, curve.acceleration[k], colour)
            for (name, curve), colour in zip(centres.items(), CENTRE_COLOURS, strict=True)
        ]
        for k in (0, 1)
    ]
    draw(
        "centres",
        *((f"Acceleration of centres of mass, {axis}", "mm/s²", row) for axis, row in zip("xy", lines, strict=True)),
    )


class Line(NamedTuple):
    """A curve in a picture."""

    label: str
    values: Array
    colour: str


def over_stroke(a4: Array, panels: Sequence[tuple[str, str, list[Line]]], dead: Array, path: Path) -> None:
    """Curves against the block's position, one panel below the other; where the platen stands still is marked."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 7.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(len(panels), 1, sharex=True)
    for panel, (title, unit, lines) in zip(axes, panels, strict=True):
        for place in (*dead, a4[-1]):
            panel.axvline(place, color="#999999", linewidth=0.8, linestyle="--", zorder=0)
        for label, values, colour in lines:
            wide = {"bell crank": 4.0}.get(label, 1.6)  # under the rod, which is often the same
            panel.plot(a4, values, color=colour, label=label, linewidth=wide)
        panel.set(title=title, ylabel=unit, xlim=(a4[0], a4[-1] + 3.0))
        panel.grid(color="#DDDDDD", linewidth=0.6)
        panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    axes[-1].set_xlabel("block, a4, mm (dashed: the platen stands still)")
    figure.savefig(path, dpi=100)


def main(path: str | None = None) -> None:
    """Print the tables; draw the figures if a name is given."""
    read_out()
    table()
    if path is not None:
        plot(Path(path))


if __name__ == "__main__":
    main(*sys.argv[1:2])
