"""Belts: the torque that two tensions take from a pulley, and how far apart they may be before the belt slips."""

from __future__ import annotations

from math import pi, sin

import numpy as np


def belt_torque(tight: float, slack: float, radius: float) -> float:
    """Torque of a belt on its pulley: T = (T1 - T2) r, in N m.

    Args:
        tight: T1, tension of the tight side, N.
        slack: T2, tension of the slack side, N.
        radius: r from the pulley's centre to the middle of the belt, m.

    Valid for a belt of negligible stiffness; the tension that its own mass adds acts on both sides alike.

    Source: Khurmi & Gupta, Theory of Machines, chapter 11 (power transmitted by a belt).

    >>> belt_torque(900.0, 300.0, 0.25)
    150.0

    """
    return (tight - slack) * radius


def tension_ratio(friction: float, wrap: float, groove: float = pi) -> float:
    """Greatest ratio of the tensions before a belt slips: T1/T2 = exp(mu theta / sin(beta/2)), Euler and Eytelwein.

    Args:
        friction: mu, coefficient of friction between belt and pulley.
        wrap: theta, angle over which the belt lies on the pulley, rad.
        groove: beta, whole angle of the groove of a V-belt, rad; a flat belt has pi.

    Valid for a belt that is about to slip all over the pulley, at rest or so slow that its own mass does not lift it.

    Source: J. A. Eytelwein, Handbuch der Statik fester Körper, 1808; Khurmi & Gupta, chapter 11.

    >>> round(tension_ratio(0.3, pi), 6), round(tension_ratio(0.3, pi, pi / 4.5), 3)
    (2.566332, 15.731)

    """
    with np.errstate(over="ignore"):  # a ratio beyond all numbers is one that no belt reaches
        return float(np.exp(friction * wrap / sin(groove / 2)))
