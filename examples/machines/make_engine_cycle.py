"""Write engine_cycle.csv: gas force on the piston of a four-stroke petrol engine against its crank angle.

The cycle is an ideal Otto cycle with polytropic strokes: intake at constant pressure, compression p V^n, heat added at
constant volume at the dead centre (pressure multiplied by `PRESSURE_RISE`), expansion p V^n, blow-down at the other
dead centre, exhaust at constant pressure. Volumes follow the true slider-crank. The force is positive along +x, away
from the crank, so gas pressure above the crankcase's makes it negative. Two rows at one angle are a jump.
"""

from __future__ import annotations

import math
from pathlib import Path

BORE = 0.084  # m
CRANK = 0.045  # m, half the stroke
ROD = 0.145  # m
COMPRESSION_RATIO = 9.5
EXPONENT_COMPRESSION = 1.32
EXPONENT_EXPANSION = 1.28
PRESSURE_RISE = 3.2  # pressure after combustion over pressure before it
INTAKE, EXHAUST, CRANKCASE = 0.95e5, 1.10e5, 1.013e5  # Pa
STEP = 2  # deg

AREA = math.pi * BORE**2 / 4
DISPLACED = 2 * CRANK * AREA
CLEARANCE = DISPLACED / (COMPRESSION_RATIO - 1)


def volume(angle: float) -> float:
    """Gas volume (m³) at a crank angle (deg) after the dead centre of least volume."""
    phi = math.radians(angle)
    reach = CRANK * math.cos(phi) + math.sqrt(ROD**2 - (CRANK * math.sin(phi)) ** 2)
    return CLEARANCE + AREA * (CRANK + ROD - reach)


def intake(_: float) -> float:
    """Pressure (Pa) on the intake stroke."""
    return INTAKE


def exhaust(_: float) -> float:
    """Pressure (Pa) on the exhaust stroke."""
    return EXHAUST


def compression(angle: float) -> float:
    """Pressure (Pa) on the compression stroke."""
    return INTAKE * math.pow((CLEARANCE + DISPLACED) / volume(angle), EXPONENT_COMPRESSION)


def expansion(angle: float) -> float:
    """Pressure (Pa) on the expansion stroke."""
    return PRESSURE_RISE * compression(360) * math.pow(CLEARANCE / volume(angle), EXPONENT_EXPANSION)


def cycle_csv() -> str:
    """Give the table as text, each stroke from dead centre to dead centre: crank angle in deg, force in N."""
    lines = ["angle_deg,force_N"]
    for number, pressure in enumerate((intake, compression, expansion, exhaust)):
        for angle in range(180 * number, 180 * number + 181, STEP):
            line = f"{angle},{-(pressure(angle) - CRANKCASE) * AREA:.2f}"
            if line != lines[-1]:  # strokes that meet without a jump share the row of their dead centre
                lines.append(line)
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    Path(__file__).with_name("engine_cycle.csv").write_text(cycle_csv(), encoding="ascii", newline="\n")
