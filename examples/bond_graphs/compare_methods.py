"""Compare the bond graph of a slider-crank with the triangle and with Lagrange's equation, in tables and in a figure.

    python compare_methods.py [figure.png]

Prints how position, velocity and acceleration (imposed motion), the free motion, and the torque that imposes a motion agree
between the methods, and how a step that divides by the transformer's modulus fares at the dead centres. With a file name,
draws curves over one another and their residuals below.
"""

from __future__ import annotations

import sys
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from bondgraph.case_study import (
    HARMONIC,
    STEADY,
    Comparison,
    Loads,
    SliderCrank,
    compare_free_motion,
    compare_kinematics,
    compare_torques,
    divided_by_modulus,
)

BLUE, VERMILLION, GREEN, BLACK, GREY = "#0072B2", "#D55E00", "#009E73", "#000000", "#999999"
STYLES: dict[str, Any] = {
    "triangle": {"color": GREY, "linewidth": 4.0, "zorder": 1},
    "exact Lagrange": {"color": GREY, "linewidth": 4.0, "zorder": 1},
    "euler": {"color": VERMILLION, "linestyle": "--"},
    "rk2": {"color": GREEN, "linestyle": "-."},
    "rk4": {"color": BLUE, "linestyle": ":"},
    "DOP853": {"color": BLACK, "linewidth": 1.0},
    "bond graph": {"color": BLACK, "linewidth": 1.0},
    "small lambda": {"color": BLUE, "linestyle": "--"},
    "small lambda, m l²/3": {"color": VERMILLION, "linestyle": "-."},
}
SMALLEST = 1e-17  # residuals below it are drawn here: a logarithm has no zero


def overlay(panel: Any, comparison: Comparison, name: str) -> None:
    """The curves of one quantity over one another."""
    quantity = comparison[name]
    for method, curve in quantity.curves.items():
        panel.plot(comparison.t, curve, label=method, **STYLES[method])
    panel.set(title=comparison.title, xlabel="t, s", ylabel=f"{name}, {quantity.unit}")


def residuals(panel: Any, comparison: Comparison, name: str) -> None:
    """Their residuals, on a logarithmic scale."""
    quantity = comparison[name]
    for method in quantity.curves:
        if method != quantity.reference:
            panel.semilogy(comparison.t, abs(quantity.residual(method)).clip(SMALLEST), label=method, **STYLES[method])
    panel.set(title=f"residual to {quantity.reference}", xlabel="t, s", ylabel=f"|residual|, {quantity.unit}")
    panel.set_ylim(SMALLEST, 1e2)


def draw(columns: list[tuple[Comparison, str]], path: str) -> None:
    """One column for each comparison: curves above, residuals below."""
    figure = Figure(figsize=(15.0, 8.5), layout="constrained")
    FigureCanvasAgg(figure)
    for (above, below), (comparison, name) in zip(figure.subplots(2, len(columns)).T, columns, strict=True):
        overlay(above, comparison, name)
        residuals(below, comparison, name)
        above.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=3, fontsize="small", frameon=False)
        for panel in (above, below):
            panel.grid(color="#DDDDDD", linewidth=0.6)
    figure.savefig(path, dpi=100)


def main(path: str | None = None) -> None:
    """Print the tables; draw the figure into a file if its name is given."""
    machine = SliderCrank()
    kinematics = [compare_kinematics(machine, imposed, step=0.02) for imposed in (HARMONIC, STEADY)]
    free = compare_free_motion(machine)
    torques = [compare_torques(machine, imposed) for imposed in (HARMONIC, STEADY)]
    for comparison in (*kinematics, free, *torques):
        print(comparison.table(), end="\n\n")
    for torque in (0.0, 1.0):
        print(f"M = {torque:g} N m: {divided_by_modulus(machine, Loads(torque), steps=(1e-2, 1e-3)).table()}", end="\n\n")
    if path is not None:
        draw([(kinematics[0], "velocity"), (free, "velocity"), (torques[0], "torque")], path)
        print(f"drawn: {path}")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else None)
