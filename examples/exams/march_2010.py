"""Exam of March 2010: a driving yoke; load and flywheel on a shaft twice as fast."""

from math import pi
from pathlib import Path

from steps import Step, area_steps, known, report

import flywheel

KCAL = 4180.0  # J; the exam's value (the thermochemical one is 4184)

scene = flywheel.load(Path(__file__).with_suffix(".toml"))
sizing = flywheel.size(scene)
wheel = sizing.flywheel
at = flywheel.reduce(scene, [pi / 2, 3 * pi / 2])
load = -known(sizing.balance).value  # on the second shaft
power = -known(sizing.power)
ratio = scene.shafts["second"]

report(
    "March 2010: yoke drives, second shaft twice as fast",
    [
        Step("g(90 deg) = 3 R sin", at.gains["scotch-yoke.yoke"][0], None, "m", 0.3),
        Step(
            "C_r*, on the crank",
            load * ratio,
            "71.6198",
            "N m",
            71.6197243913529,
            "its last digit: 71.6197 (the print has 71.619 elsewhere)",
        ),
        Step("C_r, on the second shaft", load, "35.8099", "N m", 35.80986219567645),
        Step("power", power, "1574.984", "W", 1575.0, "the print carries C_r* = 71.619; it is 1575 W exactly"),
        Step("energy in half an hour", power * 1800 / KCAL, "678.22", "kcal", 678.2296650717703),
        Step("M*(90 deg) = 225 - C_r*", at.moment[0], None, "N m", 225 - 71.6197243913529),
        Step("M*(270 deg) = -C_r*", at.moment[1], None, "N m", -71.6197243913529),
        Step("crossing phi1", sizing.areas[0].end, "0.32395", "rad", 0.32394610693198),
        Step("crossing phi2", sizing.areas[1].end, "2.817646", "rad", 2.8176465466578),
        *area_steps(
            sizing.areas,
            [-11.497942310033, 247.99588462007, -236.49794231003],
            ["-11.498", "247.996", "-236.498"],
            ["-11.498", "236.498", "0"],
        ),
        Step("I on shaft 1", known(wheel.approximate_total) * ratio**2, "10.256", "kg m2", 10.25601492576883),
        Step("flywheel on shaft 2", wheel.exact, "2.564", "kg m2", 2.5640037314422),
    ],
    ["678.22 kcal rests on the same rounded torque; 678.2297 is the true value, at 4.18 kJ to the kcal"],
)
