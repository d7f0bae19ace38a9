"""What a sizing means: the flywheels side by side, the irregularity that each really gives, and every absolute error.

Shared by the printed report and the plots.
"""

from __future__ import annotations

from typing import NamedTuple

from flywheel import steady
from flywheel.results import Sizing
from flywheel.steady import NoMotionError, Run


class InertiaErrors(NamedTuple):
    """Absolute errors (kg m²) of the flywheel figures, at the flywheel's own shaft."""

    exact: float
    approximate: float
    inertia_torque: float
    inertia_torque_flywheel: float


class Candidate(NamedTuple):
    """One flywheel (kg m² at its own shaft): how far it is off the exact one (a share), and the irregularity it gives.

    `gives` is (irregularity, its absolute error), (0, 0) where nothing acts, or None where the machine would stop in
    the cycle; `motion` is the run behind it, None for a diagram of areas.
    """

    key: str
    name: str
    inertia: float
    error: float
    off: float | None
    off_error: float
    gives: tuple[float, float] | None
    motion: Run | None


_NAMES = (
    ("exact", "exact (Wittenbauer)"),
    ("approximate", "accumulated areas"),
    ("inertia_torque_flywheel", "inertia torque"),
)


def inertia_errors(sizing: Sizing) -> InertiaErrors:
    """Absolute errors of the flywheel figures: the estimates are relative to the larger of the figure and its scale."""
    wheel, error = sizing.flywheel, sizing.error
    scale = max(wheel.exact or 0.0, wheel.approximate_total or 0.0)
    own = [(getattr(error, name) or 0.0, getattr(wheel, name) or 0.0) for name in InertiaErrors._fields]
    return InertiaErrors(*(part * max(scale, figure) for part, figure in own))


def work_error(sizing: Sizing) -> float:
    """Absolute error (J) of an accumulated work."""
    exchanged = sizing.energy_fluctuation if sizing.cycle is None else sizing.cycle.exchanged
    return (sizing.error.work or 0.0) * exchanged


def area_error(sizing: Sizing) -> float:
    """The same of the areas, which a constant speed found as a root closes with a residue of its own (J)."""
    residue = 0.0 if sizing.constant is None else abs(sizing.constant.net)
    return work_error(sizing) + 2 * residue


def balance_error(sizing: Sizing) -> float:
    """Absolute error of the balance's value (SI): for a drive that of the work over the angle that its shaft turns."""
    balance, scene = sizing.balance, sizing.scene
    if balance is None:
        return 0.0
    if balance.name == "drive" and scene.drive is not None:
        return work_error(sizing) / (scene.shafts[scene.drive.on] * scene.cycle)
    return balance.error * abs(balance.value)


def candidates(sizing: Sizing) -> list[Candidate]:
    """The exact flywheel and the approximate ones; for a diagram of areas, where they are one, that one alone."""
    wheel = sizing.flywheel
    exact, errors = wheel.exact or 0.0, inertia_errors(sizing)
    if sizing.scene.areas is not None:
        gives = (sizing.scene.irregularity or 0.0, 0.0)
        return [Candidate("approximate", "accumulated areas", exact, errors.exact, None, 0.0, gives, None)]
    found = []
    for key, name in _NAMES:
        inertia, error = getattr(wheel, key) or 0.0, getattr(errors, key)
        off = inertia / exact - 1 if exact > 0.0 and key != "exact" else None
        off_error = 2 * (error + errors.exact) / exact if exact > 0.0 else 0.0
        motion = run_with(sizing, inertia)
        found.append(Candidate(key, name, inertia, error, off, off_error, _given(sizing, key, motion), motion))
    return found


def run_with(sizing: Sizing, inertia: float) -> Run | None:
    """Steady motion with a flywheel (kg m² at its own shaft); None where the machine would stop within the cycle."""
    if sizing.cycle is None:
        return None
    on_crank = inertia * sizing.scene.flywheel_ratio**2
    if sizing.run is not None and on_crank == sizing.run.inertia:
        return sizing.run
    try:
        if sizing.machine is None or not sizing.machine.sets_its_speed:
            return steady.run(sizing.cycle, sizing.speed, on_crank)
        from flywheel import by_motion

        return by_motion.run_with(sizing, on_crank)
    except NoMotionError:
        return None


def _given(sizing: Sizing, key: str, motion: Run | None) -> tuple[float, float] | None:
    """The irregularity and its error: the simulation's where there is one, else that of the periodic motion."""
    confirmed = sizing.simulation
    simulated = confirmed and {
        "exact": confirmed.irregularity,
        "approximate": confirmed.irregularity_approximate,
    }.get(key)
    if simulated is not None:
        return simulated, (sizing.error.simulation or 0.0) * simulated
    if motion is None:
        still = sizing.run is None and sizing.energy_fluctuation <= work_error(sizing)
        return (0.0, 0.0) if still else None  # nothing acts, or the machine would stop
    return motion.irregularity, motion.error * motion.irregularity


class Speeds(NamedTuple):
    """Greatest and least crank speed and their absolute error, rad/s."""

    greatest: float
    least: float
    error: float


def speeds(sizing: Sizing) -> Speeds | None:
    """The extremes of speed as simulated, else those of the periodic motion; None where there are none."""
    confirmed, motion = sizing.simulation, sizing.run
    if confirmed is not None and confirmed.speed_max is not None and confirmed.speed_min is not None:
        error = (sizing.error.simulation or 0.0) * confirmed.irregularity * sizing.speed
        return Speeds(confirmed.speed_max, confirmed.speed_min, error)
    if motion is None:
        return None
    return Speeds(motion.speed_max, motion.speed_min, motion.error * motion.irregularity * sizing.speed)
