"""Exam of January 2012: an arm with a mass at its end, a belt from the motor, a force on a quarter of the turn."""

from math import pi
from pathlib import Path

from steps import Step, area_steps, known, report

import flywheel

scene = flywheel.load(Path(__file__).with_suffix(".toml"))
sizing = flywheel.size(scene)
wheel = sizing.flywheel
at = flywheel.reduce(scene, [pi / 3, pi])
motor = known(sizing.balance).value

report(
    "January 2012: arm with a mass, belt drive",
    [
        Step("g(60 deg) = l cos phi", at.gains["scotch-yoke.yoke"][0], None, "m", 0.3),
        Step("speed ratio of motor and arm", at.gains["motor"][0], "3", "", 3.0),
        Step("work of the force", 3 * motor * 2 * pi, "509.117", "J", 509.1168824543142),
        Step("motor torque M_m", motor, "27", "N m", 27.00948948471318),
        Step("M_m* = 3 M_m, on the arm", 3 * motor, "81.028", "N m", 81.02846845413955),
        Step("M*(60 deg) = M_m*", at.moment[0], None, "N m", 81.02846845413955),
        Step("M*(180 deg) = M_m* - 360", at.moment[1], None, "N m", 81.02846845413955 - 360),
        Step("power", sizing.power, None, "W", 678.8225099390858),
        Step("crossing, start of the force", sizing.areas[0].end, None, "rad", 0.75 * pi),
        Step("crossing, end of the force", sizing.areas[1].end, None, "rad", 1.25 * pi),
        *area_steps(
            sizing.areas,
            [190.91883092037, -381.83766184074, 190.91883092037],
            ["190.919", "-381.838", "190.919"],
            ["190.919", "-190.919", "0"],
        ),
        Step("I by accumulated areas", wheel.approximate_total, "54.405", "kg m2", 54.40534292380225),
        Step("I* of the arm, M l^2", at.inertia[0], "3.6", "kg m2", 3.6),
        Step("flywheel on the arm's shaft", wheel.approximate, "50.805", "kg m2", 50.80534292380225),
        Step("flywheel, exact (I* is constant)", wheel.exact, "50.805", "kg m2", 50.80534292380225),
    ],
    ["the print writes A3 over 2 pi - 3 pi/4; its value belongs to 2 pi - 5 pi/4"],
)
