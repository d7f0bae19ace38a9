"""Course problem p. 113 no. 1: a force on one half of the turn; the pulley counts towards the flywheel."""

from math import pi
from pathlib import Path

from steps import Step, area_steps, known, report

import flywheel

scene = flywheel.load(Path(__file__).with_suffix(".toml"))
sizing = flywheel.size(scene)
wheel = sizing.flywheel
at = flywheel.reduce(scene, [pi / 3, pi])
torque = -known(sizing.balance).value  # the scene's drive; here it resists

report(
    "p. 113 no. 1: force on one half of the turn",
    [
        Step("g(60 deg) = R cos", at.gains["scotch-yoke.yoke"][0], None, "m", 0.1),
        Step("torque C = F R/pi", torque, "318.3099", "N m", 1000 / pi),
        Step("power", -known(sizing.power), "16666.667", "W", 50000 / 3),
        Step("power in kW", -known(sizing.power) / 1000, "16.67", "kW", 50 / 3),
        Step("M*(60 deg) = F R cos - C", at.moment[0], None, "N m", 500 - 1000 / pi),
        Step("M*(180 deg) = -C", at.moment[1], None, "N m", -1000 / pi),
        Step("crossing phi1", sizing.areas[0].end, "1.24685", "rad", 1.2468502198629),
        *area_steps(
            sizing.areas,
            [551.10196582237, -1102.2039316447, 551.10196582237],
            ["551.102", "-1102.204", "551.102"],
            ["551.102", "-551.102", "0"],
        ),
        Step("I by accumulated areas", wheel.approximate_total, "40.204", "kg m2", 40.20357850901379),
        Step("flywheel (I less the pulley)", wheel.approximate, "39.204", "kg m2", 39.20357850901379),
        Step("flywheel, exact (I* is constant)", wheel.exact, "39.204", "kg m2", 39.20357850901379),
    ],
    ["the scan reads 0.12 for R in F R/pi; its value belongs to the given R = 0.2 m"],
)
