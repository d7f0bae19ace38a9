"""Course problem p. 115 no. 2: reduced inertia of a crank-shaper; the printed formula and the true one."""

from math import acos, atan2, cos, degrees, hypot, pi, radians, sin
from pathlib import Path

from steps import Step, area_steps, known, report

import flywheel

R, D, L = 0.15, 0.45, 0.8  # m, chosen: the course gives none
I_G2, I_G4, M6 = 2.0, 30.0, 50.0
ANGLES = [radians(a) for a in (30, 90, 150, 270)]
TRUE = [5.446368675179738, 2.588, 8.677032101650066, 2.588]
ERRATUM = "the print drops I_G4 and multiplies m6 by a spurious phi^2"


def rocker(phi: float) -> tuple[float, float]:
    """Rocker angle theta and its influence coefficient (r/s) cos(theta - phi)."""
    x, y = D + R * cos(phi), R * sin(phi)
    theta = atan2(y, x)
    return theta, R / hypot(x, y) * cos(theta - phi)


def true_inertia(phi: float) -> float:
    """I* = I_G2 + (r/s)^2 cos^2(theta - phi) (I_G4 + m6 (L cos theta)^2)."""
    theta, gain = rocker(phi)
    return I_G2 + gain**2 * (I_G4 + M6 * (L * cos(theta)) ** 2)


def printed_inertia(phi: float) -> float:
    """I* as printed: I_G2 + (r/s)^2 cos^2(theta - phi) + m6 phi^2 (r y/s)^2 cos^2(theta - phi), y = L cos theta."""
    theta, gain = rocker(phi)
    return I_G2 + gain**2 * (1 + M6 * phi**2 * (L * cos(theta)) ** 2)


scene = flywheel.load(Path(__file__).with_suffix(".toml"))
sizing = flywheel.size(scene)
wheel = sizing.flywheel
at = flywheel.reduce(scene, ANGLES)
dead_centre = acos(-R / D)

steps = []
for i, phi in enumerate(ANGLES):
    name = f"({degrees(phi):.0f} deg)"
    theta, gain = rocker(phi)
    steps += [
        Step(f"theta'{name}", at.gains["crank-shaper.rocker"][i], None, "", gain),
        Step(f"ram's influence coefficient{name}", at.gains["crank-shaper.ram"][i], None, "m", L * cos(theta) * gain),
        Step(f"I*{name}", at.inertia[i], f"{printed_inertia(phi):.6f}", "kg m2", TRUE[i], ERRATUM),
        Step(f"I*{name} by the true formula", true_inertia(phi), None, "kg m2", at.inertia[i]),
    ]
torque = 2 * 3000 * L * sin(rocker(dead_centre)[0]) / (2 * pi)
steps += [
    Step("motor torque, 3 kN on the slow stroke", known(sizing.balance).value, None, "N m", torque),
    Step("power", sizing.power, None, "W", 1600.0),
    *area_steps(sizing.areas, [-359.61469967506, 719.22939935012, -359.61469967506]),
    Step("I by accumulated areas", wheel.approximate_total, None, "kg m2", 182.1829351313042),
    Step("flywheel, approximate", wheel.approximate, None, "kg m2", 180.1829351313042),
    Step("flywheel, exact", wheel.exact, None, "kg m2", 181.0955308883092),
]
report(
    "p. 115 no. 2: crank-shaper, lengths and load chosen",
    steps,
    ["the course prints no numbers: under `printed` stands its formula, evaluated"],
)
