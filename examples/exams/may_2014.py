"""Exam of May 2014: a four-stroke engine, driven shaft four times slower; both printed solutions err."""

from math import pi
from pathlib import Path

from steps import Step, area_steps, known, report

import flywheel

DISC_RADIUS = 0.2  # m
ENGINE_SPEED = 2600 * pi / 30
TRUE_AREAS = [-60.761525266208, 91.523050532416, -91.523050532416, 91.523050532416, -30.761525266208]
CROSSINGS = "the print solves 4 F sin(4 phi) = M, without r_m = 0.04 m"
STROKE = "the second print puts the crossings at the ends of the expansion stroke"

ENGINE_TORQUE = 2600.0 / ENGINE_SPEED

# 1. The engine alone at 2.6 kW: its gas force is the unknown.
engine = {
    "parameters": {"F": "balance"},
    "mechanism": {"type": "scotch-yoke", "crank": {"length": "0.04 m"}},
    "load": [{"on": "yoke", "force": "-F", "from": "360 deg", "to": "540 deg"}],
    "drive": {"torque": -ENGINE_TORQUE},
    "regime": {"speed": "2600 rpm", "cycle": "720 deg"},
    "flywheel": {"irregularity": 0.05},
}
alone = flywheel.size(flywheel.load(engine))

# 2. and 3. The driven shaft, one turn of which holds two engine cycles.
scene = flywheel.load(Path(__file__).with_suffix(".toml"))
sizing = flywheel.size(scene)
inertia = known(sizing.flywheel.exact)
mass = 2 * inertia / DISC_RADIUS**2
at = flywheel.reduce(scene, [5 * pi / 8, pi])

report(
    "May 2014: four-stroke engine, driven shaft four times slower (first printed solution)",
    [
        Step("engine torque C_m = 30/pi", ENGINE_TORQUE, "9.5492", "N m", 30 / pi),
        Step("gas force F", known(alone.balance).value, "1500", "N", 1500.0),
        Step("engine speed over driven speed", at.gains["engine"][0], "4", "", 4.0),
        Step("g(112.5 deg of the driven shaft)", at.gains["scotch-yoke.yoke"][0], None, "m", -0.16),
        Step("M, on the driven shaft", -known(sizing.balance).value, "38.197", "N m", 120 / pi),
        Step("M*(112.5 deg) = 240 - M", at.moment[0], None, "N m", 240 - 120 / pi),
        Step("M*(180 deg) = -M", at.moment[1], None, "N m", -120 / pi),
        Step("power taken", -known(sizing.power), None, "W", 2600.0),
        Step("crossing phi1", sizing.areas[0].end, "1.5724", "rad", 1.6107549833912, CROSSINGS),
        Step("crossing phi2", sizing.areas[1].end, "2.3546", "rad", 2.3162358335961, CROSSINGS),
        *area_steps(
            sizing.areas,
            TRUE_AREAS,
            ["-60.059", "90.119", "-90.119", "90.119", "-30.059"],
            ["-60.059", "30.06", "-60.059", "30.06", "0"],
            CROSSINGS,
        ),
        Step("flywheel on the driven shaft", inertia, "0.389", "kg m2", 0.3950722570154629, CROSSINGS),
        Step("the same on the engine's shaft", inertia / 16, None, "kg m2", 0.02469201606346643),
        Step("disc mass, R = 0.2 m", mass, "19.451", "kg", 19.7536128507731, CROSSINGS),
    ],
    [
        "the scan boxes the mass as 19451: its decimal comma is lost",
        "the print closes A3 at 8 pi/2; its value belongs to 3 pi/2",
    ],
)
report(
    "May 2014: second printed solution",
    [
        *area_steps(
            sizing.areas,
            TRUE_AREAS,
            sums=["-60", "30", "-60", "30", "0"],
            erratum=STROKE,
        ),
        Step("flywheel on the driven shaft", inertia, "0.8885", "kg m2", 0.3950722570154629, STROKE),
        Step("disc mass, R = 0.2 m", mass, "19.425", "kg", 19.7536128507731, STROKE),
    ],
    ["0.8885 is misread: 90/(0.05 68.0678^2) = 0.3885, to which its 19.425 kg belongs"],
)
