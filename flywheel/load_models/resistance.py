"""What resists motion: a constant share, one that grows with the speed, one that grows with its square.

Fans and pumps are such loads, and so are windage, bearings and rolling resistance.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.formulas.building import compiled
from flywheel.formulas.expressions import Expression

Array = NDArray[np.float64]


class Resistance(NamedTuple):
    """Coefficients of a resistance on a place that translates (N, N s/m, N s²/m²) or rotates (N m, N m s, N m s²)."""

    constant: float = 0.0
    proportional: float = 0.0
    quadratic: float = 0.0


def resistance(speed: ArrayLike, law: Resistance) -> Array:
    """Force or torque against the motion: -(a sign v + b v + c v |v|).

    Args:
        speed: v of the place, m/s or rad/s, any shape.
        law: a, b, c.

    Valid for either sense of motion; at rest it is 0, so that it holds nothing.

    Source: T. D. Gillespie, Fundamentals of Vehicle Dynamics, SAE 1992, chapter 4 (rolling resistance and drag of the
    air); W. Leonhard, Control of Electrical Drives, Springer 2001, section 1.4 (load torques).

    >>> resistance([-2.0, 0.0, 2.0], Resistance(3.0, 1.0, 0.5)).tolist()
    [7.0, -0.0, -7.0]

    """
    v = np.asarray(speed, dtype=float)
    a, b, c = law
    return np.asarray(-(a * np.sign(v) + b * v + c * v * np.abs(v)))


def resistance_law(law: Resistance, variable: str) -> Expression:
    """The same as an expression of `omega` (of a shaft) or `v` (of a port); the constant share needs the sign of v alone.

    Args:
        law: a, b, c.
        variable: "omega" or "v".

    >>> resistance_law(Resistance(3.0, 0.0, 0.5), "omega").text
    '-3.0*sign(v) - 0.5*omega*abs(omega)'

    """
    parts = {
        "{a}*sign(v)": law.constant,
        f"{{b}}*{variable}": law.proportional,
        f"{{c}}*{variable}*abs({variable})": law.quadratic,
    }
    terms = [part for part, number in parts.items() if number]
    text = "-" + " - ".join(terms) if terms else "0"
    return compiled(text, a=law.constant, b=law.proportional, c=law.quadratic)


def quadratic_coefficient(effort: float, speed: float, constant: float = 0.0) -> float:
    """Coefficient c of a fan or pump from one point of its characteristic: c = (T - T0)/omega².

    Args:
        effort: T, torque (N m) or force (N) that it takes at that speed.
        speed: omega, rad/s or m/s, above 0.
        constant: T0, the share that does not depend on speed (static head, friction), in units of T.

    Valid by the affinity laws (flow with speed, head with its square, power with its cube): a turbomachine against a
    system without static head. A pump against a static head follows it only near its point.

    Source: I. J. Karassik and others, Pump Handbook, McGraw-Hill 2008, chapter 2; Leonhard, section 1.4.

    >>> quadratic_coefficient(50.0, 10.0, 10.0)
    0.4

    """
    return (effort - constant) / speed**2
