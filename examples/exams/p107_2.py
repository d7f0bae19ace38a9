"""Course problem p. 107 no. 2: a two-stroke engine with s' = -r sin phi, and what the true slider-crank makes of it."""

from math import pi
from pathlib import Path

from steps import Step, area_steps, known, report

import flywheel

NEAR = 1e-5  # rad from a dead centre: near enough for the limit of a ratio of two gains that both vanish there

folder = Path(__file__).parent
scene = flywheel.load(folder / "p107_2.toml")
exact_scene = flywheel.load(folder / "p107_2_exact.toml")
sizing, exact = flywheel.size(scene), flywheel.size(exact_scene)
angles = [pi / 4, NEAR, pi - NEAR, pi / 3]
at = flywheel.reduce(scene, angles)
at_exact = flywheel.reduce(exact_scene, angles)
short, true = at.gains["scotch-yoke.yoke"], at_exact.gains["slider-crank.slider"]
errors = 100 * abs(1 - short / true)

report(
    "p. 107 no. 2: two-stroke engine, s' = -r sin phi",
    [
        Step("s'(45 deg), exact", true[0], "-0.469519", "m", -0.4695193496758127),
        Step("s'(45 deg), approximate", short[0], "-0.424264", "m", -0.6 * 0.5**0.5),
        Step("error of s' at 45 deg", errors[0], "9.639", "%", 9.638640238177928),
        Step(
            "greatest error of s', 0 to 90 deg",
            errors[1],
            "9.639",
            "%",
            100 * 0.15 / 1.15,
            "the error is greatest towards phi = 0, (r/l)/(1 + r/l), not at 45 deg: above the 12 % allowed",
        ),
        Step(
            "greatest error of s', 90 to 180 deg",
            errors[2],
            "9.639",
            "%",
            100 * 0.15 / 0.85,
            "towards phi = 180 deg it reaches (r/l)/(1 - r/l)",
        ),
        Step("F_max", known(sizing.balance).value, "490747.2984", "N", 490747.2984056587),
        Step("M*(60 deg) = F_max r sin - M_r", at.moment[3], None, "N m", 214999.7763547298),
        Step("crossing psi1", sizing.areas[0].end, "0.136268", "rad", 0.13626858133497),
        *area_steps(
            sizing.areas,
            [-2721.1464666196, 234337.67243822, -231616.5259716],
            ["-2721.146", "234337.672", "-231616.526"],
            ["-2721.146", "231616.526", "0"],
        ),
        Step("flywheel", sizing.flywheel.exact, "13355.646", "kg m2", 13355.64581817981),
    ],
)
report(
    "the same with the true slider-crank, l = 4 m",
    [
        Step("F_max", known(exact.balance).value, None, "N", 460217.0776993071),
        Step("crossing psi1", exact.areas[0].end, None, "rad", 0.12642940069449),
        *area_steps(exact.areas, [-2523.924361142, 236649.90811795, -234125.98375681]),
        Step("flywheel", exact.flywheel.exact, None, "kg m2", 13487.42744964063),
    ],
)
