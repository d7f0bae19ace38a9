"""An open arm of two bars in a vertical plane: two degrees of freedom, by Lagrange's equations.

The shoulder is a pin on the frame, the elbow a pin between the bars. Coordinates q1, q2 (rad) are the bars' own angles from
the upward vertical, counter-clockwise: a point at distance s along bar 1 stands at x = -s sin q1, y = s cos q1. Torques:
T1 of the frame on bar 1, T2 of bar 1 on bar 2, so that Q1 = T1 - T2 and Q2 = T2. With

    A = I1 + m1 c1² + m2 l1²,   B = m2 l1 c2,   C = I2 + m2 c2²   (kg m²)
    G1 = (m1 c1 + m2 l1) g,     G2 = m2 c2 g                      (N m)

the kinetic energy is T = ½ A q1'² + ½ C q2'² + B q1' q2' cos(q1 - q2), the potential energy V = G1 cos q1 + G2 cos q2, and

    A q1'' + B cos(q1 - q2) q2'' + B sin(q1 - q2) q2'² - G1 sin q1 = T1 - T2
    B cos(q1 - q2) q1'' + C q2'' - B sin(q1 - q2) q1'² - G2 sin q2 = T2

Angles, speeds, accelerations and torques are arrays of shape (2, ...): one row a bar or joint. Valid for rigid bars, whose
centres of mass lie on the lines between their pins, and pins without play. Source: the course, p. 68, example 3, with
bars of any make. (It prints the cross term of v_G2² as 2 l1 l2 in one line; l1 l2, as in the next, is right.)

>>> from flywheel.arm import TwoLinkArm, driving_torques, slender
>>> arm = TwoLinkArm(slender(1.0, 3.0), slender(0.5, 1.2), gravity=10.0)
>>> driving_torques(arm, [0.0, 0.0], [0.0, 0.0], [1.0, 1.0]).round(12).tolist()
[2.9, 0.4]
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from flywheel.arm.dynamics import (
    Bar,
    Reactions,
    TwoLinkArm,
    accelerations,
    driving_torques,
    energy,
    mass_matrix,
    reactions,
    rest,
    slender,
)
from flywheel.arm.motion import ArmMotion, simulate_arm

if TYPE_CHECKING:
    from flywheel.arm.equations import LagrangeEquations, lagrange_equations

__all__ = [
    "ArmMotion",
    "Bar",
    "LagrangeEquations",
    "Reactions",
    "TwoLinkArm",
    "accelerations",
    "driving_torques",
    "energy",
    "lagrange_equations",
    "mass_matrix",
    "reactions",
    "rest",
    "simulate_arm",
    "slender",
]

_SYMBOLIC = ("LagrangeEquations", "lagrange_equations")


def __getattr__(name: str) -> Any:
    """The equations in symbols, imported when first asked for: sympy is slow to import."""
    if name not in _SYMBOLIC:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from flywheel.arm import equations

    return getattr(equations, name)
