"""How a motor brings a flywheel back to speed after each stroke, and between which speeds the two then run.

Speeds are in rad/s; inertia is that of all that turns with the flywheel, and torques and powers are at its shaft: losses
between it and the tool are part of a load, those between the motor and it are taken off what the motor gives.
"""

from __future__ import annotations

from math import exp, expm1, log, log1p

from flywheel.arguments import NOT_NEGATIVE, POSITIVE, number_faults, refuse
from flywheel.faults import Fault, SceneError
from flywheel.two_speeds import Speeds, check_order, energy_given, irregularity_faults


def recovery_time(inertia: float, low: float, high: float, power: float) -> float:
    """Time (s) in which a motor of constant power brings a flywheel back: t = I (w1² - w2²)/(2 P).

    Args:
        inertia: I, kg m².
        low: w2 at the start, rad/s.
        high: w1 at the end, rad/s.
        power: P that reaches the flywheel (the motor's, less what is lost on the way), W, nothing else taking any.

    Raises:
        SceneError: if the speeds are in the wrong order, or a number is out of range.

    Source: the energy balance; Sarkar, illustration 6.7, the other way round.

    >>> from math import pi
    >>> round(recovery_time(200 * 0.5**2, 240 * pi / 30, 360 * pi / 30, 4934.802200544679), 9)
    4.0

    """
    refuse(number_faults("power", power, POSITIVE, "W"))
    return energy_given(inertia, high, low) / power


def recovery_time_on_line(inertia: float, low: float, high: float, starting_torque: float, no_load_speed: float) -> float:
    """Time (s) in which a motor with a straight line brings a flywheel back: t = (I w0/T0) ln[(w0 - w2)/(w0 - w1)].

    The motor's torque is T = T0 (1 - w/w0); nothing else takes any.

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
    """Time (s) in which an induction motor brings a flywheel back.

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
    """Extreme speeds of a machine that a constant torque loads for a part of each cycle, on a motor with a straight line.

    With c = T0/w0, T = c (w0 - w): the motor lags by u = w0 - w, I du/dt = load - c u, which repeats where
    u2 = (load/c) (1 - e^-a)/(1 - e^-(a + b)), u1 = u2 e^-b, a = c busy/I, b = c (cycle - busy)/I.

    Args:
        inertia: I, kg m².
        starting_torque: T0, N m.
        no_load_speed: w0, rad/s.
        load: torque against the motion at the motor's shaft while the machine works, what is lost on the way to the tool
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
        found, advice = f"a torque of {load:g} N m under which the machine stops", "a larger flywheel or motor"
        raise SceneError([Fault("load", found, "a torque that the motor and the flywheel carry", advice)])
    return Speeds(no_load_speed - lag.low, no_load_speed - lag.high)


def inertia_on_line(
    irregularity: float, starting_torque: float, no_load_speed: float, load: float, busy: float, cycle: float
) -> float:
    """Inertia (kg m²) with which `steady_on_line` gives an irregularity.

    (high - low)/mean falls from its value without inertia to 0 as the inertia grows; one root, found by bisection.

    Args:
        irregularity: eps.
        starting_torque: T0, N m.
        no_load_speed: w0, rad/s.
        load: torque against the motion at the motor's shaft while the machine works, what is lost on the way to the tool
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
        found = f"a mean torque of {settled:g} N m"
        raise SceneError([Fault("load", found, f"a mean below the starting torque, {starting_torque:g} N m")])

    def excess(exponent: float) -> float:
        lag = _lags(exp(exponent), starting_torque, no_load_speed, load, busy, cycle)
        return lag.high - lag.low - irregularity * (no_load_speed - (lag.high + lag.low) / 2)

    scale = log(starting_torque / no_load_speed * cycle)  # of the inertia whose time constant is the cycle
    low, high = scale - log(1e6), scale + log(1e6 / irregularity)
    if excess(low) <= 0.0:
        found = f"{irregularity:g}, which the motor holds without a flywheel"
        raise SceneError([Fault("irregularity", found, "a smaller one")])
    while (middle := (low + high) / 2) not in (low, high):
        low, high = (middle, high) if excess(middle) > 0.0 else (low, middle)
    return exp(middle)


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
