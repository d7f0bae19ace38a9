"""Presses and punches: energy of a stroke, motor and flywheel for a rate, one stroke through a clutch.

The flywheel between two speeds is in `flywheel.two_speeds`.
"""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

from flywheel.arguments import NOT_NEGATIVE, POSITIVE, fits, known, number_faults, refuse
from flywheel.faults import Fault, SceneError
from flywheel.load_models.presses import FULLNESS
from flywheel.two_speeds import speed_after


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
    """Energy (J) of a stroke: E = F s where the force is constant, F s/2 where it falls evenly to zero.

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
    share = known("shape", shape, FULLNESS)
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

    The flywheel gives what is lost between it and the tool, and not what is lost between the motor and it. Where only the
    efficiency of the whole way from motor to tool is known it counts as the former, which asks for the larger flywheel.

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
    _check_shares(busy, cycle, efficiency, drive_efficiency)
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
    refuse(_efficiency_faults(efficiency, drive_efficiency))
    cycle = energy / (efficiency * drive_efficiency * power)
    return press_cycle(energy, cycle, busy, efficiency, drive_efficiency)


def press_of(given: float, cycle: float, busy: float, efficiency: float = 1.0, drive_efficiency: float = 1.0) -> PressCycle:
    """A press whose flywheel is known to give an energy in each stroke: E = eta E_given/(1 - t_b/t_c).

    Args:
        given: energy that the flywheel gives between its two speeds, J (`two_speeds.energy_given`).
        cycle: t_c from stroke to stroke, s.
        busy: t_b, during which the tool works, s; the flywheel recovers in the rest.
        efficiency: eta from flywheel to tool, above 0, at most 1.
        drive_efficiency: eta_d from motor to flywheel, above 0, at most 1.

    Raises:
        SceneError: if `busy` is not below `cycle`, or a number is out of range.

    Valid for a motor of constant power. Source: Sarkar, illustration 6.7.

    >>> from math import pi
    >>> from flywheel.two_speeds import energy_given
    >>> press = press_of(energy_given(200 * 0.5**2, 360 * pi / 30, 240 * pi / 30), 12.0, 12.0 - 4.0)
    >>> round(press.power, 6), round(press.energy, 6)  # printed 4.9 kW and 59195.3 J, with pi = 3.141
    (4934.802201, 59217.626407)

    """
    quantities = {"cycle": (cycle, POSITIVE, "s"), "busy": (busy, NOT_NEGATIVE, "s")}
    _check(given=(given, NOT_NEGATIVE, "J"), **quantities)
    _check_shares(busy, cycle, efficiency, drive_efficiency)
    return press_cycle(efficiency * given / (1.0 - busy / cycle), cycle, busy, efficiency, drive_efficiency)


class Engagement(NamedTuple):
    """A slipping clutch that has brought two sides to one speed (rad/s).

    `heat` is lost in it, `given` is what the faster side lost, `taken` what the slower one gained (J); `time` that it
    slipped (s), None where its torque is not known.
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

    w = (J1 w1 + J2 w2)/(J1 + J2), heat = J1 J2/(J1 + J2) (w1 - w2)²/2, time = J1 J2/(J1 + J2) (w1 - w2)/M, whatever the
    clutch's torque does meanwhile for the first two.

    Args:
        inertia: J1 of the driving side, kg m².
        speed: w1 of the driving side, rad/s.
        driven_inertia: J2 of the driven side, at the clutch's shaft, kg m².
        driven_speed: w2, rad/s, not above w1.
        torque: M of the clutch while it slips, constant, N m; None where the time is not asked.

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
    given = inertia * (driven_inertia * slip / both) * (speed + common) / 2
    taken = driven_inertia * (inertia * slip / both) * (common + driven_speed) / 2
    return Engagement(common, effective * slip**2 / 2, given, taken, None if torque is None else effective * slip / torque)


class SingleStroke(NamedTuple):
    """One stroke of a press that stood: the `engagement` of its clutch, then the work.

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
    """A single stroke: the clutch brings the driven side up to w_c, then both give what the motor does not.

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
    refuse(_efficiency_faults(efficiency, drive_efficiency))
    joined = engage(inertia, speed, driven_inertia)
    given = energy / efficiency - drive_efficiency * power * busy
    after = speed_after(inertia + driven_inertia, joined.speed, given)
    return SingleStroke(joined, given, after, (speed - after) / speed)


def inertia_for_single_stroke(high: float, low: float, energy: float, driven_inertia: float = 0.0) -> float:
    """Flywheel (kg m²) of a press that after a single stroke from one speed still has another.

    The positive root J1 of (w1² - w2²) J1² - 2 (E + J2 w2²) J1 - J2 (2 E + J2 w2²) = 0: `single_stroke` solved for J1.

    Args:
        high: w1 before the clutch engages, rad/s.
        low: w2 after the stroke, rad/s.
        energy: E that flywheel and driven side give in the stroke, J: what is lost on the way to the tool included, what the
            motor gives left out.
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
    """Refuse numbers that are not what they should be: name = (value, what is expected, unit)."""
    refuse(
        [fault for name, (value, wanted, unit) in quantities.items() for fault in number_faults(name, value, wanted, unit)]
    )


def _check_shares(busy: float, cycle: float, efficiency: float, drive_efficiency: float) -> None:
    faults = []
    if busy >= cycle:
        advice = "the motor alone carries a stroke that long"
        faults.append(Fault("busy", f"{busy:g} s", f"less than the {cycle:.6g} s from stroke to stroke", advice))
    refuse(faults + _efficiency_faults(efficiency, drive_efficiency))


def _efficiency_faults(efficiency: float, drive_efficiency: float) -> list[Fault]:
    """The faults of efficiencies that are none."""
    faults = []
    for name, value in (("efficiency", efficiency), ("drive_efficiency", drive_efficiency)):
        over = [] if not fits(value, POSITIVE) or value <= 1 else [Fault(name, f"{value:g}", "at most 1")]
        faults += number_faults(name, value, POSITIVE) + over
    return faults
