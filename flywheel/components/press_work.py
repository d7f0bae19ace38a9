"""Work of presses: a flywheel between two speeds, energy and rate of strokes, recovery of the flywheel by the motor.

Speeds are in rad/s and the greater one comes first; inertia includes all parts that turn with the flywheel, at its shaft,
and so are energies, torques and powers: a tool takes less than the flywheel gives, by the losses between them
(`press_cycle`), and losses between the motor and the flywheel are subtracted from the motor's output.
"""

from __future__ import annotations

from math import exp, expm1, log, log1p, sqrt
from typing import NamedTuple

from bondgraph.numerics import root
from flywheel.components.load_models import FULLNESS
from flywheel.numerics.faults import NOT_NEGATIVE, POSITIVE, Fault, SceneError, entry, fits, number_faults, refuse

__all__ = [
    "Engagement", "PressCycle", "SingleStroke", "Speeds", "busy_time", "check_order", "cutting_energy", "energy_given",
    "engage", "extreme_speeds", "inertia_between", "inertia_for", "inertia_for_single_stroke", "inertia_on_line",
    "irregularity_faults", "press_at", "press_cycle", "press_of", "recovery_time", "recovery_time_of_induction",
    "recovery_time_on_line", "safety_distance", "shearing_force", "single_stroke", "speed_after", "steady_on_line",
    "stroke_energy",
]  # fmt: skip


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
        """The coefficient of fluctuation of speed: the difference of the two speeds over their mean."""
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
    """Inertia (kg m²) for an irregularity: I = E/(eps w²).

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
        stored = inertia * speed**2 / 2
        advice = "the machine stops: a larger flywheel or a greater speed"
        raise SceneError([Fault("energy", f"{energy:g} J", f"at most the {stored:.6g} J that the flywheel holds", advice)])
    return sqrt(squared)


def check_order(high: float, low: float, faults: list[Fault], apart: bool = False) -> None:
    """Refuses two speeds in the wrong order, together with other faults."""
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


def shearing_force(perimeter: float, thickness: float, strength: float) -> float:
    """Greatest force (N) that shears a sheet: F = tau P t.

    Args:
        perimeter: P of the cut, m: pi d for a round hole.
        thickness: t of the sheet, m.
        strength: tau, shear strength, Pa.

    Raises:
        SceneError: if a number is not above 0.

    Valid for a cut at once over the whole perimeter (no shear ground on the punch).
    Source: Norton, Machine Design; Khurmi and Gupta, Theory of Machines, section 16.14.

    >>> from math import pi
    >>> round(shearing_force(pi * 0.040, 0.015, 300e6), 3)
    565486.678

    """
    _check(perimeter=(perimeter, POSITIVE, "m"), thickness=(thickness, POSITIVE, "m"), strength=(strength, POSITIVE, "Pa"))
    return strength * perimeter * thickness


def stroke_energy(force: float, travel: float, shape: str = "triangular") -> float:
    """Energy (J) of a stroke: E = F s for a constant force, F s/2 for one that falls linearly to zero.

    Args:
        force: greatest force F, N.
        travel: s along which it acts, m: the sheet's thickness, or the share of it at which the sheet breaks.
        shape: `constant` or `triangular`.

    Raises:
        SceneError: if the shape is neither, or a number is below 0.

    Source: Khurmi and Gupta, section 16.14: the force falls from its greatest value to zero as the punch goes through.

    >>> stroke_energy(400e3, 0.015)
    3000.0

    """
    share = entry("shape", shape, FULLNESS)
    _check(force=(force, NOT_NEGATIVE, "N"), travel=(travel, NOT_NEGATIVE, "m"))
    return share * force * travel


def cutting_energy(perimeter: float, thickness: float, energy_per_area: float) -> float:
    """Energy (J) of a cut from the energy for each square metre sheared: E = e P t.

    Args:
        perimeter: P of the cut, m: pi d for a round hole.
        thickness: t of the sheet, m.
        energy_per_area: e, J/m² (1 J/mm² is 1e6 J/m²).

    Raises:
        SceneError: if a number is not above 0.

    With e = tau t/2 this is the triangle of `stroke_energy`. Source: Khurmi and Gupta, example 16.22.

    >>> from math import pi
    >>> round(cutting_energy(pi * 0.040, 0.015, 6e6), 6)
    11309.733553

    """
    quantities = {"thickness": (thickness, POSITIVE, "m"), "energy_per_area": (energy_per_area, POSITIVE, "J/m²")}
    _check(perimeter=(perimeter, POSITIVE, "m"), **quantities)
    return energy_per_area * perimeter * thickness


def busy_time(travel: float, stroke: float, cycle: float) -> float:
    """Time (s) during which a tool works, if it moves evenly up and down: t_b = t_c s/(2 h).

    Args:
        travel: s along which the force acts, m: the sheet's thickness.
        stroke: h of the tool, m.
        cycle: t_c from stroke to stroke, s.

    Raises:
        SceneError: if the force acts along more than the stroke, or a number is not above 0.

    An estimate: near the end of its stroke a crank-driven tool is slower. Source: Khurmi and Gupta, section 16.14, which
    takes the angle as the same share of the turn.

    >>> round(busy_time(0.032, 0.100, 10.0), 12)
    1.6

    """
    _check(travel=(travel, POSITIVE, "m"), stroke=(stroke, POSITIVE, "m"), cycle=(cycle, POSITIVE, "s"))
    if travel > stroke:
        raise SceneError([Fault("travel", f"{travel:g} m", f"at most the stroke of {stroke:g} m")])
    return cycle * travel / (2 * stroke)


class PressCycle(NamedTuple):
    """One stroke after another at a steady rate.

    `energy` of a stroke at the tool (J), time from stroke to stroke `cycle` and of the work in it `busy` (s), mean `power`
    at the tool and `motor_power` before all losses (W), energy that the flywheel gives in each stroke, `given` (J).
    """

    energy: float
    cycle: float
    busy: float
    power: float
    motor_power: float
    given: float

    @property
    def rate(self) -> float:
        """Strokes per second."""
        return 1.0 / self.cycle


def press_cycle(
    energy: float, cycle: float, busy: float, efficiency: float = 1.0, drive_efficiency: float = 1.0
) -> PressCycle:
    """A press at a given rate: P = E/t_c, P_motor = P/(eta eta_d), and the flywheel gives (E/eta) (1 - t_b/t_c).

    The flywheel supplies the losses between it and the tool, and not those between the motor and it. If only the efficiency
    from motor to tool is known it counts as the former, which gives the larger flywheel.

    Args:
        energy: E of a stroke at the tool, J.
        cycle: t_c from stroke to stroke, s.
        busy: t_b, during which the tool works, s; 0 for a blow.
        efficiency: eta from flywheel to tool, above 0, at most 1.
        drive_efficiency: eta_d from motor to flywheel, above 0, at most 1.

    Raises:
        SceneError: if `busy` is not below `cycle`, or a number is out of range.

    Valid for a motor of constant power. Source: Khurmi and Gupta, examples 16.19 and 16.22; with losses Jindal, Machine
    Design, example 19.4.

    >>> press = press_cycle(15e3, 3600 / 720, 2.0)
    >>> press.power, press.given
    (3000.0, 9000.0)
    >>> [round(press_cycle(2035.752, 1.0, 1 / 6, *losses).given, 2) for losses in ((0.95,), (1.0, 0.95))]
    [1785.75, 1696.46]

    """
    quantities = {"cycle": (cycle, POSITIVE, "s"), "busy": (busy, NOT_NEGATIVE, "s")}
    _check(energy=(energy, NOT_NEGATIVE, "J"), **quantities)
    refuse(_share_faults(efficiency, drive_efficiency, busy, cycle))
    power, flywheel_side = energy / cycle, energy / efficiency
    motor_power = flywheel_side / drive_efficiency / cycle
    return PressCycle(energy, cycle, busy, power, motor_power, flywheel_side * (1.0 - busy / cycle))


def press_at(energy: float, power: float, busy: float, efficiency: float = 1.0, drive_efficiency: float = 1.0) -> PressCycle:
    """A press as fast as its motor allows: t_c = E/(eta eta_d P).

    Args:
        energy: E of a stroke at the tool, J.
        power: P of the motor, before all losses, W.
        busy: t_b, during which the tool works, s.
        efficiency: eta from flywheel to tool, above 0, at most 1.
        drive_efficiency: eta_d from motor to flywheel, above 0, at most 1.

    Raises:
        SceneError: if a stroke takes longer than the motor needs for its energy, or a number is out of range.

    Valid for a motor of constant power. Source: Khurmi and Gupta, example 16.21; Sarkar, illustration 6.9.

    >>> press_at(7500.0, 5000.0, 1.0).rate * 3600  # strokes per hour
    2400.0

    """
    _check(energy=(energy, POSITIVE, "J"), power=(power, POSITIVE, "W"))
    refuse(_share_faults(efficiency, drive_efficiency))
    cycle = energy / (efficiency * drive_efficiency * power)
    return press_cycle(energy, cycle, busy, efficiency, drive_efficiency)


def press_of(
    released: float, cycle: float, busy: float, efficiency: float = 1.0, drive_efficiency: float = 1.0
) -> PressCycle:
    """A press whose flywheel is known to give an energy in each stroke: E = eta E_given/(1 - t_b/t_c).

    Args:
        released: energy that the flywheel gives between its two speeds, J (`two_speeds.energy_given`).
        cycle: t_c from stroke to stroke, s.
        busy: t_b, during which the tool works, s; the flywheel recovers in the rest.
        efficiency: eta from flywheel to tool, above 0, at most 1.
        drive_efficiency: eta_d from motor to flywheel, above 0, at most 1.

    Raises:
        SceneError: if `busy` is not below `cycle`, or a number is out of range.

    Valid for a motor of constant power. Source: Sarkar, illustration 6.7.

    >>> from math import pi
    >>> press = press_of(energy_given(200 * 0.5**2, 360 * pi / 30, 240 * pi / 30), 12.0, 12.0 - 4.0)
    >>> round(press.power, 6), round(press.energy, 6)  # printed 4.9 kW and 59195.3 J, with pi = 3.141
    (4934.802201, 59217.626407)

    """
    quantities = {"cycle": (cycle, POSITIVE, "s"), "busy": (busy, NOT_NEGATIVE, "s")}
    _check(given=(released, NOT_NEGATIVE, "J"), **quantities)
    refuse(_share_faults(efficiency, drive_efficiency, busy, cycle))
    return press_cycle(efficiency * released / (1.0 - busy / cycle), cycle, busy, efficiency, drive_efficiency)


def safety_distance(approach: float, stopping: float, intrusion: float = 0.0) -> float:
    """Least distance (m) of a light curtain or a two-hand control from the tools: S = K T + C.

    Args:
        approach: K, the speed of a hand, m/s.
        stopping: T, from its detection to standstill, s: response of detection and control, then the press's stop.
        intrusion: C, distance that a hand intrudes before its detection, m.

    Raises:
        SceneError: if a number is below 0.

    Valid for any machine whose stopping time is that of its worst instant. K and C are those of the standard and the local
    law; there are no defaults. Source: ISO 13855, clause 5.

    >>> round(safety_distance(2.0, 0.15, 0.128), 12)
    0.428

    """
    _check(approach=(approach, NOT_NEGATIVE, "m/s"), stopping=(stopping, NOT_NEGATIVE, "s"))
    _check(intrusion=(intrusion, NOT_NEGATIVE, "m"))
    return approach * stopping + intrusion


class BandBrake(NamedTuple):
    """Torques (N m) of a band brake: against the rotation that tightens its band, and `reverse_torque` against the other."""

    torque: float
    reverse_torque: float


def band_brake(pull: float, radius: float, friction: float, wrap: float) -> BandBrake:
    """Torques of a simple band brake, with one end of the band fixed: F (e^(mu a) - 1) r and F (1 - e^(-mu a)) r.

    Args:
        pull: F at the other end of the band, N; it is the slack end in the rotation that tightens the band.
        radius: r of the drum, m.
        friction: mu between band and drum.
        wrap: a, angle of the band on the drum, rad.

    Raises:
        SceneError: if a number is below 0.

    Valid for a thin band without bending stiffness. Source: Shigley, Mechanical Engineering Design, chapter 16 (band-type
    clutches and brakes).

    >>> [round(torque, 3) for torque in band_brake(1000.0, 0.2, 0.3, 4.712388980384690)]
    [622.241, 151.352]

    """
    _check(pull=(pull, NOT_NEGATIVE, "N"), radius=(radius, NOT_NEGATIVE, "m"))
    _check(friction=(friction, NOT_NEGATIVE, ""), wrap=(wrap, NOT_NEGATIVE, "rad"))
    return BandBrake(pull * radius * expm1(friction * wrap), -pull * radius * expm1(-friction * wrap))


class Engagement(NamedTuple):
    """A slipping clutch that has brought two sides to one speed (rad/s).

    `heat` is lost in it, `given` is the loss of the faster side, `taken` the gain of the slower one (J); `time` is that of
    the slip (s), None if its torque is not known.
    """

    speed: float
    heat: float
    given: float
    taken: float
    time: float | None = None


def engage(
    inertia: float, speed: float, driven_inertia: float, driven_speed: float = 0.0, torque: float | None = None
) -> Engagement:
    """Two sides joined by a clutch that slips until they turn alike, like bodies in a plastic impact.

    w = (J1 w1 + J2 w2)/(J1 + J2), heat = J1 J2/(J1 + J2) (w1 - w2)²/2, time = J1 J2/(J1 + J2) (w1 - w2)/M, the first two for
    any course of the clutch's torque.

    Args:
        inertia: J1 of the driving side, kg m².
        speed: w1 of the driving side, rad/s.
        driven_inertia: J2 of the driven side, at the clutch's shaft, kg m².
        driven_speed: w2, rad/s, not above w1.
        torque: M of the clutch while it slips, constant, N m; None if the time is not required.

    Raises:
        SceneError: if a number is out of range.

    Valid where no other torque acts while it slips, or only briefly. Source: conservation of angular momentum; Khurmi and
    Gupta, Theory of Machines, section 3.25 (loss of kinetic energy during clutch engagement).

    >>> engage(30.0, 20.0, 10.0)
    Engagement(speed=15.0, heat=1500.0, given=2625.0, taken=1125.0, time=None)

    """
    quantities = {"inertia": (inertia, POSITIVE, "kg m²"), "driven_inertia": (driven_inertia, NOT_NEGATIVE, "kg m²")}
    quantities |= {"speed": (speed, NOT_NEGATIVE, "rad/s"), "driven_speed": (driven_speed, NOT_NEGATIVE, "rad/s")}
    _check(torque=(1.0 if torque is None else torque, POSITIVE, "N m"), **quantities)
    if driven_speed > speed:
        raise SceneError([Fault("driven_speed", f"{driven_speed:g} rad/s", f"at most the driving side's {speed:g} rad/s")])
    slip, both = speed - driven_speed, inertia + driven_inertia
    common = (inertia * speed + driven_inertia * driven_speed) / both
    effective = inertia * driven_inertia / both
    released = inertia * (driven_inertia * slip / both) * (speed + common) / 2
    taken = driven_inertia * (inertia * slip / both) * (common + driven_speed) / 2
    return Engagement(
        common, effective * slip**2 / 2, released, taken, None if torque is None else effective * slip / torque
    )


class SingleStroke(NamedTuple):
    """One stroke of a press from standstill: the `engagement` of its clutch, then the work.

    `energy` that flywheel and driven side give in the stroke (J), `speed` after it (rad/s), `slow_down` from the speed
    before the engagement, as a share of that.
    """

    engagement: Engagement
    energy: float
    speed: float
    slow_down: float


def single_stroke(
    inertia: float,
    speed: float,
    energy: float,
    driven_inertia: float = 0.0,
    power: float = 0.0,
    busy: float = 0.0,
    efficiency: float = 1.0,
    drive_efficiency: float = 1.0,
) -> SingleStroke:
    """A single stroke: the clutch brings the driven side up to w_c, then both give the energy beyond the motor's.

    w = sqrt(w_c² - 2 (E/eta - eta_d P t_b)/(J1 + J2)), w_c = J1 w1/(J1 + J2).

    Args:
        inertia: J1 of the flywheel and all before the clutch, kg m².
        speed: of the flywheel before, rad/s.
        energy: E of the stroke at the tool, J.
        driven_inertia: J2 behind the clutch, at the flywheel's shaft, at rest before, kg m².
        power: P that the motor gives during the stroke, before all losses, W.
        busy: t_b that the stroke lasts, s.
        efficiency: eta from flywheel to tool, above 0, at most 1.
        drive_efficiency: eta_d from motor to flywheel, above 0, at most 1.

    Raises:
        SceneError: if the machine stops within the stroke, or a number is out of range.

    Valid where the clutch has ceased to slip as the tool begins to work, and J2 is constant.
    Source: `engage`, then the energy balance.

    >>> stroke = single_stroke(30.0, 20.0, 2500.0, driven_inertia=10.0)
    >>> stroke.speed, stroke.slow_down
    (10.0, 0.5)

    """
    quantities = {
        "power": (power, NOT_NEGATIVE, "W"),
        "busy": (busy, NOT_NEGATIVE, "s"),
        "speed": (speed, POSITIVE, "rad/s"),
    }
    _check(energy=(energy, NOT_NEGATIVE, "J"), **quantities)
    refuse(_share_faults(efficiency, drive_efficiency))
    joined = engage(inertia, speed, driven_inertia)
    released = energy / efficiency - drive_efficiency * power * busy
    after = speed_after(inertia + driven_inertia, joined.speed, released)
    return SingleStroke(joined, released, after, (speed - after) / speed)


def inertia_for_single_stroke(high: float, low: float, energy: float, driven_inertia: float = 0.0) -> float:
    """Flywheel (kg m²) with which a press slows down from one speed to another in a single stroke.

    The positive root J1 of (w1² - w2²) J1² - 2 (E + J2 w2²) J1 - J2 (2 E + J2 w2²) = 0: `single_stroke` solved for J1.

    Args:
        high: w1 before the clutch engages, rad/s.
        low: w2 after the stroke, rad/s.
        energy: E that flywheel and driven side give in the stroke, J: losses on the way to the tool included, the motor's
            share excluded.
        driven_inertia: J2 behind the clutch, at rest before, kg m².

    Raises:
        SceneError: if the speeds are in the wrong order, or a number is out of range.

    Source: `single_stroke`.

    >>> round(inertia_for_single_stroke(20.0, 10.0, 2500.0, 10.0), 12)
    30.0

    """
    quantities = {"high": (high, POSITIVE, "rad/s"), "low": (low, NOT_NEGATIVE, "rad/s")}
    _check(energy=(energy, NOT_NEGATIVE, "J"), driven_inertia=(driven_inertia, NOT_NEGATIVE, "kg m²"), **quantities)
    if low >= high:
        raise SceneError([Fault("low", f"{low:g} rad/s", f"a speed below high, {high:g} rad/s")])
    first, kept = (high - low) * (high + low), driven_inertia * low**2
    middle = energy + kept
    return (middle + sqrt(middle**2 + first * driven_inertia * (2 * energy + kept))) / first


def _check(**quantities: tuple[float, str, str]) -> None:
    """Refuses invalid numbers: name = (value, expected values, unit)."""
    refuse([fault for name, (value, limit, unit) in quantities.items() for fault in number_faults(name, value, limit, unit)])


def _share_faults(efficiency: float, drive_efficiency: float, busy: float = 0.0, cycle: float = 1.0) -> list[Fault]:
    """The faults of invalid efficiencies, and of a stroke as long as the cycle."""
    faults = []
    if busy >= cycle:
        advice = "the motor alone carries a stroke that long"
        faults.append(Fault("busy", f"{busy:g} s", f"less than the {cycle:.6g} s from stroke to stroke", advice))
    for name, value in (("efficiency", efficiency), ("drive_efficiency", drive_efficiency)):
        over = [] if not fits(value, POSITIVE) or value <= 1 else [Fault(name, f"{value:g}", "at most 1")]
        faults += number_faults(name, value, POSITIVE) + over
    return faults


def recovery_time(inertia: float, low: float, high: float, power: float) -> float:
    """Time (s) in which a motor of constant power accelerates a flywheel again: t = I (w1² - w2²)/(2 P).

    Args:
        inertia: I, kg m².
        low: w2 at the start, rad/s.
        high: w1 at the end, rad/s.
        power: P that reaches the flywheel (the motor's less losses), W; there are no other loads.

    Raises:
        SceneError: if the speeds are in the wrong order, or a number is out of range.

    Source: the energy balance; Sarkar, illustration 6.7, in reverse.

    >>> from math import pi
    >>> round(recovery_time(200 * 0.5**2, 240 * pi / 30, 360 * pi / 30, 4934.802200544679), 9)
    4.0

    """
    refuse(number_faults("power", power, POSITIVE, "W"))
    return energy_given(inertia, high, low) / power


def recovery_time_on_line(inertia: float, low: float, high: float, starting_torque: float, no_load_speed: float) -> float:
    """Time (s) in which a motor with a straight line accelerates a flywheel again: t = (I w0/T0) ln[(w0 - w2)/(w0 - w1)].

    The motor's torque is T = T0 (1 - w/w0); there are no other loads.

    Args:
        inertia: I, kg m².
        low: w2 at the start, rad/s.
        high: w1 at the end, rad/s, below the no-load speed, which is reached only after infinite time.
        starting_torque: T0, N m.
        no_load_speed: w0, rad/s.

    Raises:
        SceneError: if the end lies at or past the no-load speed, speeds are in the wrong order, or out of range.

    Source: I dw/dt = T integrated; Shigley, Mechanical Engineering Design, chapter 16 (motor line of a punch press).

    >>> round(recovery_time_on_line(2.0, 90.0, 95.0, 500.0, 100.0), 9)  # 0.4 ln 2
    0.277258872

    """
    faults = number_faults("inertia", inertia, POSITIVE, "kg m²")
    faults += number_faults("starting_torque", starting_torque, POSITIVE, "N m")
    check_order(high, low, faults + _below(high, no_load_speed, "no_load_speed"))
    return inertia * no_load_speed / starting_torque * log1p((high - low) / (no_load_speed - high))


def recovery_time_of_induction(
    inertia: float, low: float, high: float, synchronous_speed: float, breakdown_torque: float, breakdown_slip: float
) -> float:
    """Time (s) in which an induction motor accelerates a flywheel again.

    t = I ws/(2 Tb) [(s2² - s1²)/(2 sb) + sb ln(s2/s1)], the integral of I dw/T with Kloss's T = 2 Tb/(s/sb + sb/s) and
    s = (ws - w)/ws. From rest, s2 is 1.

    Args:
        inertia: I, kg m².
        low: w2 at the start, rad/s, with slip s2.
        high: w1 at the end, rad/s, with slip s1; below the synchronous speed, which is reached only after infinite time.
        synchronous_speed: ws, rad/s.
        breakdown_torque: Tb, N m.
        breakdown_slip: sb.

    Raises:
        SceneError: if the end lies at or past the synchronous speed, speeds are in the wrong order, or out of range.

    Source: Kloss (1901); the run-up time without load of textbooks on electric drives.

    >>> round(recovery_time_of_induction(2.0, 0.0, 95.0, 100.0, 60.0, 0.2), 6)
    5.154827

    """
    faults = number_faults("inertia", inertia, POSITIVE, "kg m²")
    faults += number_faults("breakdown_torque", breakdown_torque, POSITIVE, "N m")
    faults += number_faults("breakdown_slip", breakdown_slip, POSITIVE)
    check_order(high, low, faults + _below(high, synchronous_speed, "synchronous_speed"))
    least, most = (synchronous_speed - high) / synchronous_speed, (synchronous_speed - low) / synchronous_speed
    slips = (most - least) * (most + least) / (2 * breakdown_slip) + breakdown_slip * log(most / least)
    return inertia * synchronous_speed / (2 * breakdown_torque) * slips


def steady_on_line(
    inertia: float, starting_torque: float, no_load_speed: float, load: float, busy: float, cycle: float
) -> Speeds:
    """Extreme speeds of a machine with a constant load during a part of each cycle, on a motor with a straight line.

    With c = T0/w0, T = c (w0 - w): the motor lags by u = w0 - w, I du/dt = load - c u, which repeats where
    u2 = (load/c) (1 - e^-a)/(1 - e^-(a + b)), u1 = u2 e^-b, a = c busy/I, b = c (cycle - busy)/I.

    Args:
        inertia: I, kg m².
        starting_torque: T0, N m.
        no_load_speed: w0, rad/s.
        load: torque against the motion at the motor's shaft while the machine works, losses on the way to the tool
            included, N m.
        busy: for how long it works, s.
        cycle: time from stroke to stroke, s.

    Raises:
        SceneError: if the machine stops under the load, `busy` is not below `cycle`, or a number is out of range.

    Source: Shigley, Mechanical Engineering Design, chapter 16 (punch press on an induction motor's line).

    >>> speeds = steady_on_line(2.0, 500.0, 100.0, 120.0, 0.2, 1.0)
    >>> round(speeds.high, 6), round(speeds.low, 6)
    (98.607707, 89.712267)

    """
    lag = _lags(inertia, starting_torque, no_load_speed, load, busy, cycle)
    if lag.high >= no_load_speed:
        defect, advice = f"a torque of {load:g} N m under which the machine stops", "a larger flywheel or motor"
        raise SceneError([Fault("load", defect, "a torque that the motor and the flywheel carry", advice)])
    return Speeds(no_load_speed - lag.low, no_load_speed - lag.high)


def inertia_on_line(
    irregularity: float, starting_torque: float, no_load_speed: float, load: float, busy: float, cycle: float
) -> float:
    """Inertia (kg m²) with which `steady_on_line` gives an irregularity.

    (high - low)/mean falls from its value without inertia to 0 as the inertia grows; one root.

    Args:
        irregularity: eps.
        starting_torque: T0, N m.
        no_load_speed: w0, rad/s.
        load: torque against the motion at the motor's shaft while the machine works, losses on the way to the tool
            included, N m.
        busy: for how long it works, s.
        cycle: time from stroke to stroke, s.

    Raises:
        SceneError: if the mean load would stop the motor, the motor alone holds the irregularity, or as `steady_on_line`.

    Source: that of `steady_on_line`.

    >>> inertia = inertia_on_line(0.05, 500.0, 100.0, 120.0, 0.2, 1.0)
    >>> round(steady_on_line(inertia, 500.0, 100.0, 120.0, 0.2, 1.0).irregularity, 12)
    0.05

    """
    refuse(irregularity_faults(irregularity))
    settled = load * busy / cycle
    _lags(1.0, starting_torque, no_load_speed, load, busy, cycle)
    if settled >= starting_torque:
        defect = f"a mean torque of {settled:g} N m"
        raise SceneError([Fault("load", defect, f"a mean below the starting torque, {starting_torque:g} N m")])

    def excess(exponent: float) -> float:
        lag = _lags(exp(exponent), starting_torque, no_load_speed, load, busy, cycle)
        return lag.high - lag.low - irregularity * (no_load_speed - (lag.high + lag.low) / 2)

    scale = log(starting_torque / no_load_speed * cycle)  # of the inertia whose time constant is the cycle
    low, high = scale - log(1e6), scale + log(1e6 / irregularity)
    if excess(low) <= 0.0:
        defect = f"{irregularity:g}, which the motor holds without a flywheel"
        raise SceneError([Fault("irregularity", defect, "a smaller one")])
    return exp(root(excess, low, high))


def _lags(inertia: float, starting: float, no_load: float, load: float, busy: float, cycle: float) -> Speeds:
    """Greatest and least lag behind the no-load speed, rad/s (see `steady_on_line`)."""
    named = {"starting_torque": (starting, "N m"), "no_load_speed": (no_load, "rad/s"), "busy": (busy, "s")}
    named |= {"inertia": (inertia, "kg m²"), "cycle": (cycle, "s")}
    faults = [fault for name, (value, unit) in named.items() for fault in number_faults(name, value, POSITIVE, unit)]
    refuse(faults + number_faults("load", load, NOT_NEGATIVE, "N m"))
    if busy >= cycle:
        raise SceneError([Fault("busy", f"{busy:g} s", f"less than the cycle's {cycle:g} s")])
    slope = starting / no_load
    working, free = slope * busy / inertia, slope * (cycle - busy) / inertia
    most = load / slope * expm1(-working) / expm1(-(working + free))
    return Speeds(most, most * (1 + expm1(-free)))


def _below(high: float, limit: float, name: str) -> list[Fault]:
    """The fault of a speed that a motor does not reach."""
    faults = number_faults(name, limit, POSITIVE, "rad/s")
    if not faults and not number_faults("high", high) and high >= limit:
        faults = [Fault("high", f"{high:g} rad/s", f"a speed below {name}, {limit:g} rad/s")]
    return faults
