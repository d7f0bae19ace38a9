"""Course problem p. 103 no. 1: a scotch yoke against a force; accumulated areas and the exact flywheel."""

from math import pi
from pathlib import Path

from steps import Step, area_steps, known, report

import flywheel

scene = flywheel.load(Path(__file__).with_suffix(".toml"))
sizing = flywheel.size(scene)
wheel = sizing.flywheel
at = flywheel.reduce(scene, [pi / 6, pi / 2, 3 * pi / 2])
gain = at.gains["scotch-yoke.yoke"]

report(
    "p. 103 no. 1: scotch yoke",
    [
        Step("g(30 deg) = -0.5 sin", gain[0], None, "m", -0.25),
        Step("g(90 deg)", gain[1], None, "m", -0.5),
        Step("I*(30 deg) = 5 sin^2", at.inertia[0], None, "kg m2", 1.25),
        Step("I*(90 deg)", at.inertia[1], None, "kg m2", 5.0),
        Step("motor torque 500/pi", known(sizing.balance).value, None, "N m", 500 / pi),
        Step("M*(90 deg) = 500/pi - 500", at.moment[1], None, "N m", 500 / pi - 500),
        Step("M*(270 deg) = 500/pi", at.moment[2], None, "N m", 500 / pi),
        Step("power", sizing.power, None, "W", 1000.0),
        Step("crossing theta1", sizing.areas[0].end, "0.3239", "rad", 0.32394610693198),
        Step("crossing theta2", sizing.areas[1].end, "2.8176", "rad", 2.8176465466578),
        *area_steps(
            sizing.areas,
            [25.550982911183, -551.10196582237, 525.55098291118],
            ["25.551", "-551.102", "525.551"],
            ["25.551", "-525.551", "0"],
        ),
        Step("I by accumulated areas", wheel.approximate_total, "348.989", "kg m2", 348.9893967796336),
        Step("flywheel, approximate (I less min I* = 0)", wheel.approximate, None, "kg m2", 348.9893967796336),
        Step("flywheel, exact (I* varies from 0 to 5)", wheel.exact, None, "kg m2", 353.5214273220118),
    ],
    ["the print writes A2 from theta2 to theta1; its value belongs to theta1 to theta2"],
)
