"""Exam of May 2013: a slotted lever with small r/d and its disc; then the exact law."""

from math import acos, pi
from pathlib import Path

from steps import Step, area_steps, known, report

import flywheel

DENSITY = 7200.0  # kg/m3
RIM_SPEED = 1.5  # m/s

folder = Path(__file__).parent
scene = flywheel.load(folder / "may_2013.toml")
sizing = flywheel.size(scene)
at = flywheel.reduce(scene, [pi / 3, 4 * pi / 3])
inertia = known(sizing.flywheel.exact)
radius = RIM_SPEED / sizing.speed
mass = 2 * inertia / radius**2
volume = mass / DENSITY
width = volume / (pi * radius**2)

report(
    "May 2013: slotted lever, x = (r/d) L sin theta, and its disc",
    [
        Step("g(60 deg) = (r/d) L cos", at.gains["law.slide"][0], None, "m", 0.01),
        Step("C_m = -10/pi", known(sizing.balance).value, None, "N m", -10 / pi),
        Step("M*(240 deg) = 10 - 10/pi", at.moment[1], None, "N m", 10 - 10 / pi),
        Step("crossing, start of the force", sizing.areas[0].end, None, "rad", pi),
        Step("crossing theta1", sizing.areas[1].end, "4.5526", "rad", 4.5525543539996),
        *area_steps(
            sizing.areas,
            [-10.0, 15.253841755403, -5.2538417554026],
            ["-10", "15.2538", "-5.2538"],
            ["-10", "5.2538", "0"],
        ),
        Step(
            "flywheel",
            inertia,
            "7.72767",
            "kg m2",
            7.72768650875153,
            "the print carries the swing rounded to 15.2538 J; its boxed 7.7277 is right",
        ),
        Step("flywheel, as boxed", inertia, "7.7277", "kg m2", 7.72768650875153),
        Step("disc radius", radius, "0.2387", "m", 0.238732414637843),
        Step("disc mass", mass, "271.179", "kg", 271.179408984935),
        Step("disc volume", volume, "0.03766", "m3", 0.03766380680346319),
        Step("disc width", width, "0.21035", "m", 0.2103543800177515),
    ],
)

law = flywheel.load(folder / "may_2013_exact.toml")
exact = flywheel.size(law)
extreme = flywheel.size(flywheel.load(folder / "may_2013_extreme.toml"))
least_x = 2 * pi - acos(1 / 6)
at_least = flywheel.reduce(law, [least_x])

report(
    "the same with the exact law x = r L sin theta/(d - r cos theta)",
    [
        Step("g where cos theta = r/d (279.594 deg)", at_least.gains["law.slide"][0], None, "m", 0.0, scale=0.02),
        Step("force to 270 deg: C_m", known(exact.balance).value, None, "N m", -3.183098861837907),
        *area_steps(exact.areas, [-10.0, 15.0, -5.0]),
        Step("force to 270 deg: flywheel", exact.flywheel.exact, None, "kg m2", 7.599088773175333),
        Step("force to the extreme: C_m", known(extreme.balance).value, None, "N m", -3.228251455564566),
        *area_steps(extreme.areas, [-10.141851056742, 14.929366399921, -4.7875153431792]),
        Step("force to the extreme: flywheel", extreme.flywheel.exact, None, "kg m2", 7.563305373350891),
    ],
)
