"""A flywheel between two speeds: what it gives, and how large it must be.

Speeds are in rad/s and the greater one comes first; inertia is that of all that turns with the flywheel, at its shaft, and
so are energies: a tool takes less than the flywheel gives, by what is lost between them (`presses.press_cycle`).
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

from flywheel.arguments import NOT_NEGATIVE, POSITIVE, number_faults, refuse
from flywheel.faults import Fault, SceneError


class Speeds(NamedTuple):
    """The greatest and the least speed, rad/s.

    >>> speeds = Speeds(124.41, 117.81)
    >>> round(speeds.mean, 9), round(speeds.irregularity, 9)
    (121.11, 0.054495913)
    """

    high: float
    low: float

    @property
    def mean(self) -> float:
        """The mean of the two, rad/s."""
        return (self.high + self.low) / 2

    @property
    def irregularity(self) -> float:
        """Their difference over their mean: the coefficient of fluctuation of speed."""
        return (self.high - self.low) / self.mean


def energy_given(inertia: float, high: float, low: float) -> float:
    """Energy (J) that a flywheel gives as it slows down: E = I (w1² - w2²)/2 = I w (w1 - w2), w the mean of the two.

    The second form is no approximation: it is I w² eps with eps = (w1 - w2)/w.

    Args:
        inertia: I, kg m².
        high: w1, rad/s.
        low: w2, rad/s, not above w1.

    Raises:
        SceneError: if the speeds are in the wrong order, or a number is out of range.

    Source: Shigley, Mechanical Engineering Design, chapter 16; Khurmi and Gupta, Theory of Machines, section 16.10.

    >>> round(energy_given(110.72, 124.41, 117.81), 6)  # in lbf: the book has 88 502, and 88 508 with a rounded eps
    88501.37472

    """
    check_order(high, low, number_faults("inertia", inertia, NOT_NEGATIVE, "kg m²"))
    return inertia * (high - low) * (high + low) / 2


def inertia_between(energy: float, high: float, low: float) -> float:
    """Inertia (kg m²) that gives an energy between two speeds: I = 2 E/(w1² - w2²).

    Divided by the square of the radius of gyration it is the mass.

    Args:
        energy: E that the flywheel must give, J.
        high: w1, rad/s.
        low: w2, rad/s, below w1.

    Raises:
        SceneError: if the second speed is not below the first, or a number is out of range.

    Exact if no other energy is stored. Source: Khurmi and Gupta, section 16.14 (punching press), example 16.19.

    >>> from math import pi
    >>> round(inertia_between(9000.0, 225 * pi / 30, 200 * pi / 30) / 0.5**2, 6)  # kg; printed 618
    617.940019

    """
    faults = number_faults("energy", energy, NOT_NEGATIVE, "J")
    check_order(high, low, faults, apart=True)
    return 2 * energy / ((high - low) * (high + low))


def inertia_for(energy: float, mean: float, irregularity: float) -> float:
    """Inertia (kg m²) that holds an irregularity: I = E/(eps w²).

    Args:
        energy: E, greatest less least energy within a cycle, J.
        mean: w, the mean of the two extreme speeds, rad/s.
        irregularity: eps, their difference over their mean; "± 1.75 %" is 0.035.

    Raises:
        SceneError: if a number is out of range (eps lies above 0 and below 2).

    Exact where w is the mean of the extremes and all inertia is constant. With the mean speed of a thin rim (m/s) in place
    of w it is the rim's mass (kg).
    Source: Khurmi and Gupta, section 16.10, example 16.3.

    >>> round(inertia_for(160.0, 12.0, 0.035), 6)
    31.746032

    """
    faults = number_faults("energy", energy, NOT_NEGATIVE, "J") + number_faults("mean", mean, POSITIVE, "rad/s")
    refuse(faults + irregularity_faults(irregularity))
    return energy / (irregularity * mean**2)


def extreme_speeds(inertia: float, mean: float, energy: float) -> Speeds:
    """Greatest and least speed about a mean: w ± E/(2 I w).

    Args:
        inertia: I, kg m².
        mean: w, the mean of the two, rad/s.
        energy: E, greatest less least energy within a cycle, J.

    Raises:
        SceneError: if the flywheel would stop (E of 2 I w² and more), or a number is out of range.

    Source: E = I w (w1 - w2); Khurmi and Gupta, example 16.1.

    >>> from math import pi
    >>> speeds = extreme_speeds(6500 * 1.8**2, 120 * pi / 30, 56e3)
    >>> [round(w * 30 / pi, 6) for w in speeds]  # rpm; printed 121 and 119
    [121.010325, 118.989675]

    """
    faults = number_faults("inertia", inertia, POSITIVE, "kg m²") + number_faults("mean", mean, POSITIVE, "rad/s")
    refuse(faults + number_faults("energy", energy, NOT_NEGATIVE, "J"))
    off = energy / (2 * inertia * mean)
    if off >= mean:
        raise SceneError([Fault("energy", f"{energy:g} J", f"less than 2 I w² = {2 * inertia * mean**2:.6g} J")])
    return Speeds(mean + off, mean - off)


def speed_after(inertia: float, speed: float, energy: float) -> float:
    """Speed (rad/s) after a flywheel has given an energy: w2 = sqrt(w1² - 2 E/I).

    Args:
        inertia: I, kg m².
        speed: w1 before, rad/s.
        energy: E given, J; negative where the flywheel takes energy in.

    Raises:
        SceneError: if there is less energy in the flywheel than it should give, or a number is out of range.

    Source: Khurmi and Gupta, example 16.21; Sarkar, Theory of Machines, illustration 6.9.

    >>> from math import pi
    >>> w = speed_after(150 * 0.6**2, 300 * pi / 30, 10e3 - 3e3 * 1.0)  # the motor gives 3 kW for 1 s of the 10 kJ
    >>> round(w * 30 / pi, 6)  # rpm; printed 257.6
    257.601224

    """
    faults = number_faults("inertia", inertia, POSITIVE, "kg m²") + number_faults("speed", speed, NOT_NEGATIVE, "rad/s")
    refuse(faults + number_faults("energy", energy, unit="J"))
    squared = speed**2 - 2 * energy / inertia
    if squared < 0.0:
        held = inertia * speed**2 / 2
        advice = "the machine stops: a larger flywheel or a greater speed"
        raise SceneError([Fault("energy", f"{energy:g} J", f"at most the {held:.6g} J that the flywheel holds", advice)])
    return sqrt(squared)


def check_order(high: float, low: float, faults: list[Fault], apart: bool = False) -> None:
    """Refuse two speeds in the wrong order, with what else is wrong."""
    own = number_faults("high", high, POSITIVE, "rad/s") + number_faults("low", low, NOT_NEGATIVE, "rad/s")
    if not own and (low > high or (apart and low == high)):
        own = [Fault("low", f"{low:g} rad/s", f"a speed below high, {high:g} rad/s")]
    refuse([*faults, *own])


def irregularity_faults(irregularity: float) -> list[Fault]:
    """The fault of a number that is no irregularity."""
    faults = number_faults("irregularity", irregularity, POSITIVE)
    if not faults and irregularity >= 2:
        faults = [Fault("irregularity", f"{irregularity:g}", "a number below 2")]
    return faults
