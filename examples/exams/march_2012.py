"""Exam of March 2012: a force on an eighth of the turn; motor and flywheel on a shaft ten times as fast."""

from math import pi
from pathlib import Path

from steps import Step, area_steps, known, report

import flywheel

scene = flywheel.load(Path(__file__).with_suffix(".toml"))
sizing = flywheel.size(scene)
wheel = sizing.flywheel
at = flywheel.reduce(scene, [pi / 3, pi])
motor = known(sizing.balance).value
ratio = scene.shafts["motor"]

report(
    "March 2012: motor through a 1/10 gear",
    [
        Step("g(60 deg) = R cos", at.gains["scotch-yoke.yoke"][0], None, "m", 0.075),
        Step("work of the force", ratio * motor * 2 * pi, "439.34", "J", 439.3398282201787),
        Step("C*, on the slow shaft", ratio * motor, "69.923", "N m", 69.92310535838562),
        Step("C_m, on the motor's shaft", motor, "6.9923", "N m", 6.992310535838562),
        Step("power", sizing.power, "732.233", "W", 732.2330470336312),
        Step("M*(60 deg) = C* - 750", at.moment[0], None, "N m", 69.92310535838562 - 750),
        Step("M*(180 deg) = C*", at.moment[1], "69.923", "N m", 69.92310535838562),
        Step("crossing, start of the force", sizing.areas[0].end, None, "rad", pi / 4),
        Step("crossing phi1", sizing.areas[1].end, "1.524", "rad", 1.5241640241796),
        *area_steps(
            sizing.areas,
            [54.917478527522, -386.05239189232, 331.1349133648],
            ["54.917", "-386.052", "331.135"],
            ["54.917", "-331.135", "0"],
        ),
        Step("flywheel on the motor's shaft", wheel.exact, "0.7041", "kg m2", 0.7040751353007388),
        Step("the same on the slow shaft", known(wheel.exact) * ratio**2, None, "kg m2", 70.40751353007388),
    ],
    ["the print works with 104.72 rad/s, the motor's speed: its flywheel stands on the motor's shaft"],
)
