"""The first block of a report at the level `fast`: the flywheel by the areas, and how far that can be trusted."""

from __future__ import annotations

from collections.abc import Iterable

from flywheel.results import Bounds, Sizing
from flywheel.writing import outcome
from flywheel.writing.digits import columns, figure, short
from flywheel.writing.rows import (
    Row,
    irregularity,
    irregularity_in_words,
    or_unknown,
    rpm,
    sentences,
    shaft_of_wheel,
    wrapped,
)

_WIDE = 0.1  # of a figure: bounds further apart than this do not settle it
_DIGITS = 7


def by_areas(sizing: Sizing) -> list[str]:
    """The approximate figures of a sizing, or the irregularity of a given flywheel, with their bounds."""
    return _sized(sizing) if sizing.scene.inertia is None else _analysed(sizing)


def _sized(sizing: Sizing) -> list[str]:
    asked = irregularity_in_words(sizing.scene.irregularity or 0.0)
    head = wrapped(f"Flywheel on {shaft_of_wheel(sizing)} for irregularity {asked}, crank at {rpm(sizing.speed)}", "")
    wheel, errors = sizing.flywheel, outcome.inertia_errors(sizing)
    rows = [
        Row("accumulated areas", or_unknown(wheel.approximate or 0.0, errors.approximate), "kg m²"),
        Row("inertia torque", or_unknown(wheel.inertia_torque_flywheel or 0.0, errors.inertia_torque_flywheel), "kg m²"),
    ]
    return head + columns(rows) + sentences(_proven(sizing))


def _analysed(sizing: Sizing) -> list[str]:
    where = f"{figure(sizing.scene.inertia or 0.0)} kg m² on {shaft_of_wheel(sizing)}"
    lines = wrapped(f"Given flywheel of {where}, crank at {rpm(sizing.speed)}", "")
    eps = 0.0 if sizing.simulation is None else sizing.simulation.irregularity
    rows = [Row("irregularity by the areas", irregularity(eps, outcome.work_error(sizing) / _energy(sizing)))]
    return lines + columns(rows) + sentences(_proven(sizing))


def _energy(sizing: Sizing) -> float:
    """J w² (J) of the given flywheel, by which an error of work becomes one of the irregularity."""
    inertia = (sizing.scene.inertia or 0.0) * sizing.scene.flywheel_ratio**2
    return max(inertia * sizing.speed**2, sizing.energy_fluctuation, 1e-300)


def _proven(sizing: Sizing) -> Iterable[str]:
    """The bounds in words, and what to run where they do not settle the matter."""
    bounds = sizing.bounds
    if bounds is None:
        return
    if bounds.of == "exact" and sizing.flywheel.needed is False:
        yield "Proven: no flywheel is needed, the machine's own inertia suffices."
        return
    what = "exact flywheel" if bounds.of == "exact" else "exact irregularity"
    low, high = (figure(bound, 0.0, _DIGITS) for bound in _outwards(bounds))
    yield f"Proven: the {what} lies between {low} and {high}, a relative width of {short(bounds.width)}."
    if bounds.of == "irregularity" and bounds.greatest >= 2.0:
        yield "That does not exclude that the machine stops within the cycle."
    if bounds.of == "exact" and sizing.flywheel.needed is None:
        yield "That leaves open whether a flywheel is needed at all."
    if bounds.width > _WIDE:
        yield "The areas do not suffice here: --accuracy normal works out the exact figure."


def _outwards(bounds: Bounds) -> tuple[float, float]:
    """The bounds moved apart by what their digits round off, so that the printed ones still hold."""
    rounding = 0.5 * 10.0 ** (1 - _DIGITS)
    low, high = bounds.least * (1 - rounding), bounds.greatest * (1 + rounding)
    return low, high if bounds.of == "exact" else min(high, 2.0)
