"""Section C's machine: its steady regime without and with a flywheel, flywheels for an irregularity, its first seconds.

    python section_c.py [figure.png]

A slider-crank under its rod's weight, on a motor with T = 10 - 2.387 omega2: nothing gives it a speed but that line. Every
figure stands beside one found apart from this library, at 30 digits, by shooting; the script fails where they differ. The
first seconds, from rest at theta2 = 90 deg, also stand beside the digits that three_routes.py finds; the coupler's angle and
speed with them follow from the crank's by the closed loop. With a file name, draws the source's two figures, angles and
speeds of crank and coupler over time (figure_seconds.png).
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from dataclasses import replace
from math import asin, cos, pi, sin
from pathlib import Path

import numpy as np

import flywheel
from flywheel.motions.kinematics import Kinematics
from flywheel.scene.scene import Scene

AGREEMENT = 1e-8

REGIMES = {  # flywheel, kg m²: irregularity, mean of extremes (rad/s), period (s), multiplier of the cycle
    0.0: (0.483227372500024, 4.12272990432168, 1.53853639318415, 0.0790896551696281),
    0.5: (0.365711658032882, 4.14166367594070, 1.52185236437960, 0.154718352306664),
    2.0: (0.208405562337707, 4.16486807568216, 1.50700034659716, 0.352076923755188),
    5.0: (0.111149562539679, 4.17731325731151, 1.50186895652513, 0.573400734325564),
    20.0: (0.0332021719947401, 4.18601868890661, 1.49998379923270, 0.846239173239990),
    500.0: (0.00141484754748723, 4.18922128995949, 1.49979667552453, 0.992886042380708),
}
SIZINGS = {  # irregularity: flywheel (kg m²), mean of extremes (rad/s), flywheel if the torque stayed at its mean (kg m²)
    0.3: (0.940057837715181, 4.15174871823563, 0.897126409881023),
    0.1: (5.71404870670348, 4.17863060913031, 5.61963343453149),
    0.02: (34.1057965272204, 4.18737383135602, 33.9908189073052),
    0.001: (707.986895929300, 4.18926171891125, 707.867003551665),
}
SECONDS = {  # s: theta2 (rad), omega2 (rad/s)
    0.5: (2.30098221981560, 2.83037540158621),
    1.0: (4.29275021068878, 4.76466345858209),
    2.0: (8.00001029836577, 3.32778176065805),
    5.0: (20.2703568368060, 3.21967392410521),
}

ERRATA = (
    "rod's velocity across the line: the crank's share is +a2 cos(theta2) omega2, printed with the other sign",
    "crank's acceleration across the line: the term with alpha2 is +r_G2 cos(theta2) alpha2, printed with the other sign",
    "crank's moment equation: the lever arm r_G2 stands squared in its moment of inertia, printed without the square",
    "first equation: theta2² and theta3² stand for the squares of the angular velocities",
    "theta3 = 5.94334 rad at the start is 2 pi - asin(1/3) = 5.943348 cut short: the loop is open by 5e-6 m",
)


class Table:
    """Rows of figures beside true ones; it counts those that differ."""

    def __init__(self) -> None:
        self.wrong = 0

    def row(self, name: str, found: Iterable[float], true: Iterable[float]) -> None:
        """Print a row with its verdict: the largest relative difference."""
        ours = list(found)
        off = max(abs(a / b - 1.0) for a, b in zip(ours, true, strict=True))
        self.wrong += off > AGREEMENT
        figures = "".join(f"{value:18.12g}" for value in ours)
        print(f"  {name:>8}{figures}   {'ok' if off <= AGREEMENT else 'DISAGREES'} {off:.0e}")


def regimes(scene: Scene, table: Table) -> None:
    """Steady regimes with given flywheels, by Newton on the cycle's energy."""
    print(f"steady regime\n  {'J':>8}{'irregularity':>18}{'mean of extremes':>18}{'period':>18}{'multiplier':>18}")
    for inertia, true in REGIMES.items():
        sizing = flywheel.size(replace(scene, inertia=inertia), simulate=False)
        run, cyclic = sizing.simulation, sizing.cyclic
        assert run is not None
        assert run.period is not None
        assert cyclic is not None
        table.row(f"{inertia:g}", (run.irregularity, sizing.speed, run.period, cyclic.multiplier), true)


def sizings(scene: Scene, table: Table) -> None:
    """Flywheels for an irregularity, with the speed that the machine then takes: one problem, solved as one."""
    head = f"{'asked':>8}{'J, kg m²':>18}{'mean of extremes':>18}{'J, torque frozen':>18}"
    print(f"\nflywheel for an irregularity; frozen: T = 0, as it is at the constant speed 10/2.387 rad/s\n  {head}")
    for eps, true in SIZINGS.items():
        asked = replace(scene, inertia=None, irregularity=eps)
        sizing = flywheel.size(asked, simulate=False)
        frozen = flywheel.size(replace(asked, drive=None, motor=None, speed=10.0 / 2.387), simulate=False)
        exact, constant = sizing.flywheel.exact, frozen.flywheel.exact
        assert exact is not None
        assert constant is not None
        table.row(f"{eps:g}", (exact, sizing.speed, constant), true)


def coupler(theta2: float, omega2: float) -> tuple[float, float]:
    """Angle (rad) and speed (rad/s) of the coupler: sin theta3 = -sin theta2/3."""
    theta3 = 2 * pi - asin(sin(theta2) / 3)
    return theta3, -cos(theta2) * omega2 / (3 * cos(theta3))


def seconds(scene: Scene, table: Table) -> Kinematics:
    """The motion from rest at theta2 = 90 deg: crank and coupler over time."""
    heads = ("theta2, rad", "omega2, rad/s", "theta3, rad", "omega3, rad/s")
    print(f"\nfrom rest at theta2 = 90 deg\n  {'t, s':>8}" + "".join(f"{head:>18}" for head in heads))
    run = flywheel.simulate(scene, phi=pi / 2, omega=0.0, until=max(SECONDS), rtol=1e-10)
    t = np.unique([*SECONDS, *np.linspace(0.0, max(SECONDS), 501)])
    found = flywheel.motion(scene, transient=run, of=("crank", "rod"), at=t)
    crank, rod = found["crank"], found["rod"]
    for time, true in SECONDS.items():
        k = int(np.searchsorted(t, time))
        angles = crank.position[k], crank.velocity[k], 2 * pi + rod.position[k], rod.velocity[k]
        table.row(f"{time:g}", map(float, angles), (*true, *coupler(*true)))
    return found


def plot(found: Kinematics, path: Path) -> None:
    """Angles and speeds of crank and coupler over time, one below the other."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 6.5), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(2, 1, sharex=True)
    crank, rod = found["crank"], found["rod"]
    panels[0].plot(found.t, crank.position, color="#0072B2", label="theta2, crank")
    panels[0].plot(found.t, 2 * pi + rod.position, color="#D55E00", label="theta3, coupler")
    panels[1].plot(found.t, crank.velocity, color="#0072B2", label="omega2, crank")
    panels[1].plot(found.t, rod.velocity, color="#D55E00", label="omega3, coupler")
    panels[0].set(title="From rest at 90 deg, T = 10 - 2.387 omega2", ylabel="angle, rad")
    panels[1].set(ylabel="speed, rad/s", xlabel="t, s", xlim=(0.0, max(SECONDS)))
    for panel in panels:
        panel.grid(color="#DDDDDD", linewidth=0.6)
        panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    figure.savefig(path, dpi=100)


def main(path: str | None = None) -> None:
    """Print the tables; draw the figures if a name is given."""
    scene, table = flywheel.load(Path(__file__).with_suffix(".toml")), Table()
    regimes(scene, table)
    sizings(scene, table)
    found = seconds(scene, table)
    print("\nwhere the print errs")
    for erratum in ERRATA:
        print(f"  {erratum}")
    if path is not None:
        file = Path(path)
        plot(found, file.with_stem(f"{file.stem}_seconds"))
    if table.wrong:
        raise SystemExit(f"{table.wrong} rows disagree")


if __name__ == "__main__":
    main(*sys.argv[1:2])
