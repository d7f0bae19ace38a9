"""What the blocks of a report share: rows, wrapped sentences, and figures in the words of those who read them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from flywheel.numerics.units import MOST, columns, figure
from flywheel.regime import steady_motion
from flywheel.regime.results import Sizing
from flywheel.regime.steady_motion import NoMotionError, Run

WIDTH = 100
RPM = 9.549296585513721  # rad/s -> rev/min
NOTHING = 1e-12  # an irregularity that rounding makes
DEGREES = 57.29577951308232


class Row(NamedTuple):
    """A line of a block: what it is, the figure, its unit and what goes with it."""

    name: str
    value: str
    unit: str = ""


def block(title: str, rows: Iterable[Row]) -> list[str]:
    """Rows under a title; nothing where there are none."""
    lines = columns(rows)
    return [title, *lines] if lines else []


def printable(text: str) -> str:
    """The text with a space for every character that would move the cursor."""
    return "".join(c if c.isprintable() else " " for c in text)


def wrapped(sentence: str, indent: str = "  ") -> list[str]:
    """A sentence as lines of a report."""
    from textwrap import wrap

    return wrap(printable(sentence), WIDTH, initial_indent=indent, subsequent_indent=indent)


def sentences(found: Iterable[str]) -> list[str]:
    """Sentences as lines of a report, each from a new line on."""
    return [line for sentence in found for line in wrapped(sentence)]


def rpm(speed: float) -> str:
    """A speed (rad/s) in turns a minute.

    >>> rpm(6.283185307179586)
    '60 rpm'
    """
    return f"{figure(speed * RPM)} rpm"


def percent_and_steadiness(eps: float, error: float, most: int) -> tuple[str, str]:
    """An irregularity as a deviation to either side in per cent, and as its reciprocal."""
    if eps <= max(error, NOTHING):
        return ("±0", "without limit") if max(eps, error) <= NOTHING else ("?", "?")
    return f"±{figure(50 * eps, 50 * error, most)}", figure(1 / eps, error / eps**2, most)


def irregularity(eps: float, error: float) -> str:
    """An irregularity as a figure: 0 where rounding alone makes it."""
    return figure(eps, max(error, NOTHING if eps <= NOTHING else 0.0))


def irregularity_in_words(eps: float, error: float = 0.0) -> str:
    """An irregularity as its reader may know it.

    >>> irregularity_in_words(0.04)
    '0.04 (±2 %, steadiness 25)'
    """
    swing, steadiness = percent_and_steadiness(eps, error, 6)
    return f"{irregularity(eps, error)} ({swing} %, steadiness {steadiness})"


def or_unknown(value: float, error: float, most: int = MOST) -> str:
    """A figure, or a question mark where its error leaves nothing of it."""
    return "?" if 0.0 < value <= error else figure(value, error, most)


def shaft_of_wheel(sizing: Sizing) -> str:
    """The flywheel's shaft."""
    on, ratio = sizing.flywheel.on, sizing.scene.flywheel_ratio
    return "the crank" if on == "crank" else f"shaft {on} ({figure(ratio)} turns to one of the crank)"


# -- outcome -----------------------------------------------------------------------------------------------------------

# What a sizing means: the flywheels side by side, the irregularity that each really gives, and every absolute error.
#
# Shared by the printed report and the plots.


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
            return steady_motion.run(sizing.cycle, sizing.speed, on_crank)
        from flywheel.sizing import speed_dependent

        return speed_dependent.run_with(sizing, on_crank)
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
