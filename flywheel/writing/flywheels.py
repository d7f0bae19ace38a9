"""The first block of a report: the flywheels side by side and what they mean, or the given one."""

from __future__ import annotations

from collections.abc import Iterable

from flywheel.accuracy import FAST
from flywheel.every_shaft import gd2
from flywheel.results import Sizing
from flywheel.writing import outcome, shafts
from flywheel.writing.bounds import by_areas
from flywheel.writing.digits import columns, figure
from flywheel.writing.rows import (
    NOTHING,
    WIDTH,
    Row,
    irregularity,
    irregularity_in_words,
    or_unknown,
    percent_and_steadiness,
    rpm,
    sentences,
    shaft_of_wheel,
    wrapped,
)

_FAR_OFF = 1.5  # a factor between approximate and exact that deserves a sentence
_DIGITS = 6


def flywheel(sizing: Sizing) -> list[str]:
    """The candidates of a sizing with bounds and verdicts; the figures of a given flywheel."""
    if sizing.accuracy == FAST and sizing.scene.areas is None:
        return by_areas(sizing)
    return _sized(sizing) if sizing.scene.inertia is None else _analysed(sizing)


def every_shaft(sizing: Sizing) -> list[str]:
    """The same flywheel on every shaft, where there are several."""
    if len(sizing.shafts) < 2 or sizing.flywheel.needed is False:
        return []
    lines = ["The same flywheel on every shaft", *shafts.table(sizing.shafts, _DIGITS)]
    return lines + sentences(_on_conditions(sizing))


def _on_conditions(sizing: Sizing) -> Iterable[str]:
    """What the table of shafts holds for."""
    if sizing.built is not None:
        yield "Inertias and masses are those of the wheel above as built, made wider or narrower at its radii."
    if sizing.scene.efficiencies:
        yield "Each stores the same energy; losses in meshes may make the speed vary a little more or less."


def _sized(sizing: Sizing) -> list[str]:
    asked = irregularity_in_words(sizing.scene.irregularity or 0.0)
    head = wrapped(f"Flywheel on {shaft_of_wheel(sizing)} for irregularity {asked}, crank at {rpm(sizing.speed)}", "")
    header = ("", "inertia, kg m²", "off by", "irregularity it gives", "as ± %", "steadiness")
    candidates = outcome.candidates(sizing)
    cells = [_cells(c) for c in candidates]
    table = columns(cells, header)
    if max(map(len, table)) > WIDTH:
        table = columns(cells, header, gap=" ", indent=" ")
    return head + table + _bracket(sizing) + sentences(_in_gd2(sizing, candidates)) + sentences(_verdicts(sizing))


def _cells(candidate: outcome.Candidate) -> tuple[str, ...]:
    inertia = or_unknown(candidate.inertia, candidate.error)
    off = "" if candidate.off is None else f"{figure(100 * candidate.off, 100 * candidate.off_error, 4)} %"
    if candidate.off is not None and candidate.off > 0 and off != "0 %":
        off = "+" + off
    if candidate.gives is None:
        return candidate.name, inertia, off, "no steady motion", "", ""
    eps, error = candidate.gives
    gives = or_unknown(eps, error) if eps > NOTHING else "0"
    return candidate.name, inertia, off, gives, *percent_and_steadiness(eps, error, 6)


_SHORT = {"exact": "exact", "approximate": "by the areas", "inertia_torque_flywheel": "by the torque"}


def _in_gd2(sizing: Sizing, candidates: list[outcome.Candidate]) -> Iterable[str]:
    """The inertias as GD², and the totals of the approximate ones."""
    if any(candidate.inertia > 0.0 for candidate in candidates):
        found = [f"{or_unknown(gd2(c.inertia), 4 * c.error, _DIGITS)} {_SHORT[c.key]}" for c in candidates]
        yield f"GD² = 4 J: {', '.join(found)}, kg m²."
    wheel, errors = sizing.flywheel, outcome.inertia_errors(sizing)
    if len(candidates) > 1 and wheel.approximate_total and wheel.inertia_torque:
        areas = or_unknown(wheel.approximate_total, errors.approximate, _DIGITS)
        torque = or_unknown(wheel.inertia_torque, errors.inertia_torque, _DIGITS)
        yield f"With the machine's own least inertia, as totals: {areas} by the areas, {torque} by the torque."


def _bracket(sizing: Sizing) -> list[str]:
    """Proven bounds of the exact flywheel."""
    wheel = sizing.flywheel
    if wheel.bracket is None or wheel.torque_bracket is None or not wheel.needed:
        return []
    errors = outcome.inertia_errors(sizing)
    areas, torque = _bounds(wheel.bracket, errors.approximate), _bounds(wheel.torque_bracket, errors.inertia_torque)
    return wrapped(f"Proven: exact between {areas} by the areas, {torque} by the torque.")


def _bounds(pair: tuple[float, float], error: float) -> str:
    low, high = (figure(max(bound, 0.0), error, 7) for bound in pair)
    return f"{low} and {high}"


def _verdicts(sizing: Sizing) -> Iterable[str]:
    """In words, what the figures above mean."""
    wheel = sizing.flywheel
    if sizing.scene.areas is not None:
        yield "A diagram of areas tells nothing of the machine's own inertia: the figure is the total inertia needed."
        return
    if wheel.needed is False:
        yield from _without_wheel(sizing)
        return
    exact, approximate = wheel.exact or 0.0, wheel.approximate or 0.0
    why = _why_far_off(sizing)
    if approximate == 0.0:
        yield f"The accumulated areas ask for no flywheel at all, and are wrong: {why}"
    elif exact > _FAR_OFF * approximate:
        yield f"The approximate flywheel is {_times(exact / approximate)} times too small: {why}"
    elif approximate > _FAR_OFF * exact:
        yield f"The approximate flywheel is {_times(approximate / exact)} times larger than needed: {why}"


def _why_far_off(sizing: Sizing) -> str:
    if sizing.cyclic is not None:
        return "it leaves out the machine's own varying inertia, and takes torques at a constant speed."
    return "at this speed the varying inertia of the machine itself dominates."


def _times(factor: float) -> str:
    return f"{factor:.0f}" if factor >= 100 else figure(factor, 0.0, 2)


def _without_wheel(sizing: Sizing) -> Iterable[str]:
    if sizing.run is None and sizing.energy_fluctuation > 0.0:
        yield "No flywheel is needed: the machine has no inertia, and its torques alone hold its speed as evenly as asked."
        return
    if sizing.run is None:
        yield "No flywheel is needed: nothing acts on the machine that could change its speed."
        return
    eps = irregularity_in_words(sizing.run.irregularity, sizing.run.error * sizing.run.irregularity)
    yield f"No flywheel is needed: the machine's own inertia suffices and gives an irregularity of {eps}."


def _analysed(sizing: Sizing) -> list[str]:
    inertia = sizing.scene.inertia or 0.0
    where = f"{figure(inertia)} kg m² on {shaft_of_wheel(sizing)}"
    lines = wrapped(f"Given flywheel of {where}, crank at {rpm(sizing.speed)}", "")
    motion = sizing.simulation
    if motion is None:
        return lines
    error = (sizing.error.simulation or 0.0) * motion.irregularity
    swing, steadiness = percent_and_steadiness(motion.irregularity, error, 10)
    rows = [
        Row("irregularity", irregularity(motion.irregularity, error)),
        Row("as ± %", swing),
        Row("steadiness", steadiness),
        Row("GD² of the flywheel", figure(gd2(inertia)), "kg m²"),
    ]
    return lines + columns(rows)
