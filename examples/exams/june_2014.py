"""Exam of June 2014: p. 103 in letters; the formulas with numbers of our own, beside the library's figures."""

from math import asin, cos, pi
from pathlib import Path

from steps import Step, area_steps, known, report

import flywheel

F, R, OMEGA, EPS = 2400.0, 0.15, 5 * pi, 0.03  # chosen: the exam gives none

# C_m = F r/pi, so M* = 0 where sin phi = 1/pi, whatever F and r.
torque = F * R / pi
first = asin(1 / pi)
a1 = F * R * (first / pi - 1 + cos(first))
a2 = F * R * (1 - 2 * first / pi - 2 * cos(first))
a3 = -(a1 + a2)
inertia = -a2 / (EPS * OMEGA**2)

scene = flywheel.load(Path(__file__).with_suffix(".toml"))
sizing = flywheel.size(scene)
at = flywheel.reduce(scene, [pi / 6, pi / 2])

report(
    "June 2014: the formulas, with F = 2.4 kN, r = 0.15 m, 150 rpm, eps = 0.03",
    [
        Step("g(30 deg) = -r sin", at.gains["scotch-yoke.yoke"][0], None, "m", -R / 2),
        Step("C_m = F r/pi", known(sizing.balance).value, None, "N m", torque),
        Step("M*(90 deg) = C_m - F r", at.moment[1], None, "N m", torque - F * R),
        Step("crossing phi1 = asin(1/pi)", sizing.areas[0].end, None, "rad", first),
        Step("crossing phi2 = pi - phi1", sizing.areas[1].end, None, "rad", pi - first),
        *area_steps(sizing.areas, [a1, a2, a3]),
        Step("I = (Smax - Smin)/(eps w^2)", sizing.flywheel.exact, None, "kg m2", inertia),
    ],
    ["the exam prints formulas only; A1 > 0 and S1 is the greatest, S2 the least, as it says"],
)
assert sizing.areas[0].accumulated > 0 > sizing.areas[1].accumulated
