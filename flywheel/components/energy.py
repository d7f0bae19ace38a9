"""Power and energy of a machine: mean and peak power of its motor, with the flywheel and without it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flywheel.numerics.faults import NOT_NEGATIVE, POSITIVE, Fault, SceneError, array, number_faults, refuse

HOUR = 3600.0
KILOWATT_HOUR = 3.6e6
KILOCALORIE = 4184.0
"""J: the thermochemical one, as in the units of scenes. The course takes 4180."""


class Energy(NamedTuple):
    """A machine's power and energy over one steady cycle.

    `period` (s); `work` of the motor in it (J); `mean_power` and `peak_power` of the motor with the flywheel (W), the peak
    with its sign; `mean_power_alone` and `peak_power_alone` of a motor that follows the loads without a flywheel at constant
    speed (W). Powers of a motor that brakes are below 0. `rms_torque` is the root of the mean square of the motor's torque
    over time (N m): on the drive's own shaft in a sizing, on the reduction element in `of_cycle`.

    Heat of a motor, averaged over time, in a sizing: of a DC motor the current in its armature (A), by its root mean
    square and its value of greatest size, and the copper heat R i² (W); of an induction motor the heat of its
    rotor (W), torque times slip speed, and by its name plate the line current (A) and the copper heat of its stator (W);
    each as a share of that at the rated point, too. None if they do not apply.
    `errors` are estimated relative errors of these.
    """

    period: float
    work: float
    mean_power: float
    peak_power: float
    mean_power_alone: float
    peak_power_alone: float
    rms_torque: float
    current_rms: float | None = None
    current_peak: float | None = None
    copper_heat: float | None = None
    copper_heat_share: float | None = None
    rotor_heat: float | None = None
    rotor_heat_share: float | None = None
    stator_heat: float | None = None
    stator_heat_share: float | None = None
    errors: Mapping[str, float] = {}

    @property
    def peak_to_mean(self) -> float | None:
        """Peak over mean power with the flywheel; None if the mean is 0."""
        return None if self.mean_power == 0.0 else self.peak_power / self.mean_power

    @property
    def peak_to_mean_alone(self) -> float | None:
        """Peak over mean power of a motor that follows the loads; None if the mean is 0."""
        return None if self.mean_power_alone == 0.0 else self.peak_power_alone / self.mean_power_alone

    @property
    def per_hour(self) -> float:
        """Energy in an hour, J."""
        return self.mean_power * HOUR

    @property
    def kilowatt_hours(self) -> float:
        """Energy in an hour, kWh."""
        return kilowatt_hours(self.mean_power, HOUR)

    @property
    def kilocalories(self) -> float:
        """Energy in an hour, kcal."""
        return kilocalories(self.mean_power, HOUR)

    def as_dict(self) -> dict[str, float | None]:
        """All figures for JSON: SI, with the hour's energy also in kWh and kcal."""
        more = ("peak_to_mean", "peak_to_mean_alone", "kilowatt_hours", "kilocalories")
        figures = {name: value for name, value in self._asdict().items() if name != "errors"}
        return {**figures, "energy_per_hour": self.per_hour, **{name: getattr(self, name) for name in more}}


class ServoLoad(NamedTuple):
    """The motion of a servo drive in its area of torque (N m) and speed (rad/s), both of its shaft.

    `rms_torque` is the root of the mean square over time, `continuous_torque` the continuous curve at the `mean_speed` over
    time, `continuous_share` their ratio. `peak_torque` at `peak_speed` and at the crank's `peak_angle` (rad) is the largest
    share of the peak curve, `peak_share`. `inertia_ratio` is the mean inertia of all driven parts, at the rotor's shaft,
    over the rotor's own; None without the latter. `errors` are relative except for those of the shares and the angle.
    """

    mean_speed: float
    rms_torque: float
    continuous_torque: float
    continuous_share: float
    peak_torque: float
    peak_speed: float
    peak_angle: float
    peak_share: float
    inertia_ratio: float | None
    errors: dict[str, float]

    @property
    def at_peak(self) -> bool:
        """Tests whether the peak curve limits the torque."""
        return self.peak_share >= 1.0 - self.errors["peak_share"]


def of_cycle(omega: ArrayLike, drive: ArrayLike, load: ArrayLike, weights: ArrayLike, speed: float | None = None) -> Energy:
    """Power and energy over one cycle: work = sum w M_d, T = sum w/omega, mean = work/T, peak = max of M_d omega.

    Without a flywheel the motor follows the loads at a constant speed: its power is -M_l times that speed, the mean
    (-sum w M_l/sum w) times it. The root of the mean square of the torque over time is sqrt(sum (w M_d²/omega)/T).

    Args:
        omega: speed of the reduction element with the flywheel, rad/s, shape (n,).
        drive: moment of the motor reduced to it, N m; a number or shape (n,).
        load: moment of everything except inertia, reduced to it, N m, below 0 if it resists; a number or shape (n,).
        weights: of the points in an integral over the cycle's angle, rad, shape (n,): Gauss or Clenshaw-Curtis weights, or
            steps. A weight of 0 marks a point that counts only for peaks, such as an end of a piece.
        speed: the constant speed without a flywheel, rad/s; the mean of the greatest and the least omega if None.

    Raises:
        SceneError: if speeds are not above 0, weights are below 0 or all 0, shapes do not fit, or a number is not finite.

    Peaks are the greatest values at the given points; their accuracy depends on the spacing of the points.
    Source: power as moment times speed; the course's March 2010 exam.

    >>> from math import pi
    >>> press = of_cycle([10.0] * 4, 60.0, [-120.0, -120.0, 0.0, 0.0], [pi / 2] * 4)  # a load for half a turn
    >>> round(press.mean_power, 9), round(press.peak_to_mean, 9), round(press.peak_to_mean_alone, 9)
    (600.0, 1.0, 2.0)

    """
    speeds, weighed = array("omega", omega), array("weights", weights)
    if speeds.ndim != 1 or not speeds.size:
        raise SceneError([Fault("omega", f"an array of shape {speeds.shape}", "one speed a point")])
    faults = []
    if weighed.shape != speeds.shape:
        faults.append(Fault("weights", f"an array of shape {weighed.shape}", f"one weight a point, {speeds.size} in all"))
    elif weighed.min() < 0.0 or weighed.sum() <= 0.0:
        faults.append(Fault("weights", "weights below 0, or all of them 0", "weights of an integral over the cycle"))
    if speeds.min() <= 0.0:
        faults.append(Fault("omega", f"{speeds.min():g} rad/s", "speeds above 0 all along the cycle"))
    refuse(faults)
    moments = []
    for name, moment in (("drive", drive), ("load", load)):
        values = array(name, moment)
        if values.shape not in ((), speeds.shape):
            raise SceneError([Fault(name, f"an array of shape {values.shape}", f"a number, or {speeds.size} of them")])
        moments.append(np.broadcast_to(values, speeds.shape))
    driving, loading = moments
    steady = (speeds.max() + speeds.min()) / 2 if speed is None else speed
    refuse(number_faults("speed", steady, POSITIVE, "rad/s"))
    period, work = float(weighed @ (1.0 / speeds)), float(weighed @ driving)
    alone = -float(weighed @ loading) / float(weighed.sum()) * steady
    rms = float(np.sqrt(weighed @ (driving**2 / speeds) / period))
    peak, peak_alone = (float(power[np.abs(power).argmax()]) for power in (driving * speeds, -loading * steady))
    return Energy(period, work, work / period, peak, float(alone), peak_alone, rms)


def kilowatt_hours(power: float, time: float) -> float:
    """Energy (kWh) of a mean power: P t/3.6e6.

    Args:
        power: P, W.
        time: t, s.

    Raises:
        SceneError: if a number is not finite.

    Source: the definition of the kilowatt hour.

    >>> kilowatt_hours(1500.0, 7200.0)
    3.0

    """
    return _energy(power, time) / KILOWATT_HOUR


def kilocalories(power: float, time: float, calorie: float = KILOCALORIE / 1000) -> float:
    """Energy (kcal) of a mean power: P t/(1000 cal).

    Args:
        power: P, W.
        time: t, s.
        calorie: J; the thermochemical 4.184 unless another one is given.

    Raises:
        SceneError: if a number is not finite, or the calorie not above 0.

    Source: ISO 80000-5 for the calories; the course's March 2010 exam (1575 W for half an hour) takes 4.18 J.

    >>> round(kilocalories(1575.0, 1800.0, 4.18), 4), round(kilocalories(1575.0, 1800.0), 4)
    (678.2297, 677.5813)

    """
    refuse(number_faults("calorie", calorie, POSITIVE, "J"))
    return _energy(power, time) / (1000 * calorie)


def _energy(power: float, time: float) -> float:
    refuse(number_faults("power", power, unit="W") + number_faults("time", time, unit="s"))
    return power * time


def mean_effective_pressure(work: float, swept_volume: float) -> float:
    """Mean effective pressure (Pa): the constant one that would do the same work in one stroke, p = W/V.

    Args:
        work: W of the gas in a cycle of the engine (two strokes or four), J; the brake's work for the brake's pressure.
        swept_volume: V of the pistons, m³.

    Raises:
        SceneError: if the volume is not above 0, or a number is not finite.

    Source: Khurmi and Gupta, Theory of Machines, chapter 15.

    >>> round(mean_effective_pressure(400.0, 500e-6) / 1e5, 12)  # bar
    8.0

    """
    refuse(number_faults("work", work, unit="J") + number_faults("swept_volume", swept_volume, POSITIVE, "m³"))
    return work / swept_volume


def mechanical_efficiency(brake: float, indicated: float) -> float:
    """Mechanical efficiency: the brake's work (or power) over the indicated one.

    Args:
        brake: output of the engine, J or W.
        indicated: work or power of its gas, J or W.

    Raises:
        SceneError: if a number is below 0, or the second 0.

    Source: Khurmi and Gupta, Theory of Machines, chapter 15.

    >>> mechanical_efficiency(300.0, 400.0)
    0.75

    """
    refuse(number_faults("brake", brake, NOT_NEGATIVE) + number_faults("indicated", indicated, POSITIVE))
    return brake / indicated
