"""The level `fast` of a sizing: figures by the accumulated areas, and bounds between which the exact one is proven to lie.

The exact flywheel's extremes are not looked for, nor the motion; cells are halved for the areas alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.machine.machine import Machine
from flywheel.numerics.cells import ROUNDING, Crossings
from flywheel.numerics.faults import Fault, SceneError
from flywheel.regime import turning_moment, wittenbauer
from flywheel.regime.results import Bounds, Confirmation, Sizing
from flywheel.regime.turning_moment import Cycle, Extremes
from flywheel.regime.wittenbauer import Figures

Array = NDArray[np.float64]

_STOPS = 2.0  # irregularity of a machine that comes to a stop within the cycle
_UNPROVEN = "{}: nothing is proven of how far the areas are off; --accuracy normal finds the motion itself"
_SPEEDS = "torques depend on speed, and are taken at a constant one"
_LOSSES = "losses in meshes depend on how the speed varies, and are taken at a constant one"


def settled(machine: Machine, rtol: float) -> Sizing:
    """The approximate figures, with bounds of the exact one where loads depend on position alone.

    Raises SceneError if the machine cannot run as its scene says, as far as its areas tell.
    """
    resolver, speed, messages = _resolver(machine)
    figures = _refined(machine, resolver, speed, rtol)
    sizing = wittenbauer.assembled(machine, figures, None, rtol)
    wheel = sizing.flywheel._replace(exact=None, needed=None, bracket=None, torque_bracket=None)
    sizing = replace(sizing, flywheel=wheel, error=sizing.error._replace(exact=None), messages=(*sizing.messages, *messages))
    if machine.sets_its_speed:
        return _analysed(replace(sizing, constant=figures.cycle), None)
    terms = _terms(machine, figures)
    return _sized(sizing, terms) if sizing.scene.inertia is None else _analysed(sizing, terms)


def _resolver(machine: Machine) -> tuple[Callable[[Array], Cycle], float, tuple[str, ...]]:
    """What gives the cycle on cells, the speed (rad/s) that it is taken at, and what is to be said of it."""
    if machine.sets_its_speed or machine.depends_on_time:
        from flywheel.regime import constant_speed  # only machines that set their own speed pay for it

        constant_speed.check_steady(machine)
        taken, _, messages = constant_speed.taken_at(machine)
        unproven = _UNPROVEN.format(_SPEEDS if machine.depends_on_speed else _LOSSES)
        return lambda edges: constant_speed.resolve(machine, edges, taken), taken, (*messages, unproven)
    speed = machine.scene.speed
    assert speed is not None, "torques that depend on position alone do not set a speed"

    def resolver(edges: Array) -> Cycle:
        cycle = turning_moment.resolve(machine, edges)
        turning_moment.check_closed(cycle, machine)
        return cycle

    return resolver, speed, ()


def _refined(machine: Machine, resolver: Callable[[Array], Cycle], speed: float, rtol: float) -> Figures:
    """Halve cells until the areas and the approximate flywheel are within rtol, or until that no longer helps."""
    edges, before, stalls = machine.mesh, np.inf, 0
    while True:
        whole = resolver(edges)
        cycle = whole._replace(errors=whole.errors._replace(residual=0.0))  # no cell can mend what is left over
        errors, unit = cycle.errors, (machine.scene.irregularity or 0.0) * speed**2
        own = (2 * errors.work + unit * errors.inertia) / _scale(cycle, float(np.ptp(cycle.start[0])), unit)
        doubt = max(wittenbauer.work_error(cycle), own)
        stalls = stalls + 1 if doubt > 0.9 * before else 0
        if doubt <= 0.5 * rtol or stalls > 1:
            break
        finer = turning_moment.split(cycle, float(np.sqrt(2 * unit)), rtol / doubt)  # I* counts for as much as in the figure
        if finer is None:
            break
        before, edges = doubt, finer
    return _figures(machine, whole, speed)


def _figures(machine: Machine, cycle: Cycle, speed: float) -> Figures:
    """The extremes of W, of W - w²I*/2 and of I*; the two of the exact flywheel stay unknown."""
    found, crossings = turning_moment.combined(cycle, np.array([[1.0, 0.0], [1.0, -0.5 * speed**2], [0.0, 1.0]]))
    extremes = Extremes(*(np.array([work, np.nan, np.nan, torque, inertia]) for work, torque, inertia in found))
    of_moment = slice(0, int(np.searchsorted(crossings.function, 1)))
    own = Crossings(crossings.function[of_moment], crossings.cell[of_moment], crossings.t[of_moment])
    if machine.scene.irregularity is None:
        return Figures(cycle, speed, extremes, own, 0.0, 0.0, 1.0, turning_moment.inertia_extent(cycle))
    unit = max(machine.scene.irregularity * speed**2, 5e-324)
    scale = _scale(cycle, float(found.greatest[0] - found.least[0]), unit) / unit
    if not np.isfinite(scale):
        what = f"a flywheel of {scale:g} kg m²"
        raise SceneError([Fault("flywheel.irregularity", what, "a figure within the floating-point range", "check units")])
    return Figures(cycle, speed, extremes, own, 0.0, 0.0, scale, turning_moment.inertia_extent(cycle))


def _scale(cycle: Cycle, swing: float, unit: float) -> float:
    """What errors of the areas (J) are relative to: the swing of energy, or where that is but rounding, what is at hand."""
    if swing > 4 * (2 * cycle.errors.work + unit * cycle.errors.inertia):
        return swing
    return max(swing, unit * float(np.abs(cycle.series[2]).sum(axis=-1).max()), cycle.exchanged, 1e-300)


# -- bounds ----------------------------------------------------------------------------------------------------------


class Terms(NamedTuple):
    """What bounds are made of, each as (at least, at most), kg m² on the crank.

    (max W - min W)/w²; (max H - min H)/w² with H = W - w²I*/2; the least and the greatest I*. `spread` is what these two
    differ by at most.
    """

    areas: tuple[float, float]
    torque: tuple[float, float]
    least: tuple[float, float]
    greatest: tuple[float, float]
    spread: float


def _terms(machine: Machine, figures: Figures) -> Terms:
    """The terms of a machine, their errors included."""
    errors, square = figures.cycle.errors, max(figures.speed**2, 5e-324)
    swing = figures.extremes.greatest - figures.extremes.least
    inertia = wittenbauer.reduced_inertia(figures)
    work = errors.swing + (0.0 if machine.friction is None else 2 * machine.friction.error)
    own = errors.inertia + errors.variation

    def around(value: float, error: float) -> tuple[float, float]:
        error += 16 * ROUNDING * abs(value)
        return max(value - error, 0.0), max(value, 0.0) + error

    return Terms(
        areas=around(float(swing[0]) / square, work / square),
        torque=around(float(swing[3]) / square, work / square + errors.variation),
        least=around(inertia.least, own),
        greatest=around(inertia.greatest, own),
        spread=around(float(swing[4]), 2 * errors.variation)[1],
    )


def bounds_of_inertia(terms: Terms, irregularity: float) -> tuple[float, float]:
    """Bounds (kg m², on the crank, before any floor at 0) of the exact flywheel for an irregularity eps.

    By the areas: A/eps - (min I* + max I*)/2 -+ (1 + eps²/4) (max I* - min I*)/(2 eps), A = (max W - min W)/w²
    By the torque: T/eps - max I* and T/eps - min I*, T = (max H - min H)/w², H = W - w² I*/2

    Args:
        terms: of the machine; A and T in kg m².
        irregularity: eps, 0 < eps < 2.

    Both are proven, so that what they have in common is. Source: extremes of a sum lie between the sums of extremes.

    >>> wheel = (2.0, 2.0)
    >>> bounds_of_inertia(Terms((1.0, 1.0), (1.0, 1.0), wheel, wheel, 0.0), 0.1)
    (8.0, 8.0)

    """
    half = (1 + irregularity**2 / 4) * terms.spread / (2 * irregularity)
    middle = [0.5 * (a + b) for a, b in zip(terms.least, terms.greatest, strict=True)]
    by_areas = terms.areas[0] / irregularity - middle[1] - half, terms.areas[1] / irregularity - middle[0] + half
    by_torque = terms.torque[0] / irregularity - terms.greatest[1], terms.torque[1] / irregularity - terms.least[0]
    return max(by_areas[0], by_torque[0]), min(by_areas[1], by_torque[1])


def bounds_of_irregularity(terms: Terms, inertia: float) -> tuple[float, float]:
    """Bounds of the irregularity eps that a flywheel J gives, those above turned round; 2 where nothing bounds it.

    The exact flywheel for the eps that J gives is J itself, so that lower(eps) <= J <= upper(eps), and both fall with eps:
    by the areas, with m = (min I* + max I*)/2 and D = max I* - min I*,
    eps >= 2 a/(J + m + sqrt((J + m)² + a D/2)), a = A - D/2, and eps <= 2 b/(J + m + sqrt((J + m)² - b D/2)), b = A + D/2;
    by the torque T/(J + max I*) <= eps <= T/(J + min I*).

    Args:
        terms: of the machine.
        inertia: J, kg m² on the crank.

    Source: the bounds of the exact flywheel, quadratic in eps.

    >>> wheel = (2.0, 2.0)
    >>> bounds_of_irregularity(Terms((1.0, 1.0), (1.0, 1.0), wheel, wheel, 0.0), 8.0)
    (0.1, 0.1)

    """
    spread = terms.spread
    light, heavy = (inertia + 0.5 * (a + b) for a, b in zip(terms.least, terms.greatest, strict=True))
    low, high = terms.areas[0] - 0.5 * spread, terms.areas[1] + 0.5 * spread
    under = light**2 - 0.5 * high * spread
    by_areas = (
        2 * low / (heavy + np.sqrt(heavy**2 + 0.5 * low * spread)) if low > 0.0 else 0.0,
        2 * high / (light + np.sqrt(under)) if under >= 0.0 and light > 0.0 else _STOPS,
    )
    slowest, fastest = inertia + terms.least[0], inertia + terms.greatest[1]
    by_torque = (
        terms.torque[0] / fastest if fastest > 0.0 else 0.0,
        terms.torque[1] / slowest if slowest > 0.0 else _STOPS,
    )
    return float(max(by_areas[0], by_torque[0])), float(min(by_areas[1], by_torque[1], _STOPS))


def _sized(sizing: Sizing, terms: Terms) -> Sizing:
    """The sizing with the bounds of its exact flywheel, and whether they decide that one is needed."""
    scene, square = sizing.scene, sizing.scene.flywheel_ratio**2
    low, high = (bound / square for bound in bounds_of_inertia(terms, scene.irregularity or 0.0))
    needed = True if low > 0.0 else False if high <= 0.0 else None
    found = Bounds("exact", max(low, 0.0), max(high, 0.0))
    return replace(sizing, flywheel=sizing.flywheel._replace(needed=needed), bounds=found)


def _analysed(sizing: Sizing, terms: Terms | None) -> Sizing:
    """An analysis with the irregularity by the areas, A/(J + min I*), and its bounds where there are any."""
    scene, inertia = sizing.scene, sizing.reduced_inertia
    if scene.inertia is None or inertia is None:
        return sizing
    wheel = scene.inertia * scene.flywheel_ratio**2
    bounds = None if terms is None else Bounds("irregularity", *bounds_of_irregularity(terms, wheel))
    total = wheel + inertia.least
    if total <= 0.0 or (bounds is not None and bounds.least >= _STOPS):
        raise SceneError([_stops(sizing.speed)])
    eps = sizing.energy_fluctuation / (sizing.speed**2 * total)
    motion = Confirmation(eps, None, None, None, None, None, None, "areas")
    error = None if bounds is None or eps <= 0.0 else max(bounds.greatest / eps - 1.0, 1.0 - bounds.least / eps)
    return replace(sizing, simulation=motion, bounds=bounds, error=sizing.error._replace(simulation=error))


def evened(sizing: Sizing) -> Sizing:
    """The sizing of a machine whose speed nothing but rounding varies: no flywheel, irregularity 0."""
    if sizing.scene.irregularity is None:
        motion = sizing.simulation and sizing.simulation._replace(irregularity=0.0)
        return replace(sizing, simulation=motion, error=sizing.error._replace(simulation=None))
    wheel, work = sizing.flywheel._replace(approximate=0.0, approximate_total=0.0, needed=False), sizing.error.work
    wheel = wheel._replace(inertia_torque=0.0, inertia_torque_flywheel=0.0)
    error = sizing.error._replace(approximate=work, inertia_torque=work, inertia_torque_flywheel=work)
    return replace(sizing, flywheel=wheel, error=error, bounds=sizing.bounds and Bounds("exact", 0.0, 0.0))


def _stops(speed: float) -> Fault:
    found = f"a machine that stops within the cycle at {speed:.6g} rad/s (mean of extremes)"
    return Fault(
        "flywheel.inertia", found, "enough inertia to turn through the whole cycle", "give a larger inertia or speed"
    )
