"""Wittenbauer's exact flywheel and the approximate ones, from one resolved cycle, each with its error.

Exact:           I = [max(W - z+ w²I*/2) - min(W - z- w²I*/2)]/(eps w²), z± = (1 ± eps/2)²
By the areas:    I = (max W - min W)/(eps w²) - min I*
Inertia torque:  I = [max(W - w²I*/2) - min(W - w²I*/2)]/(eps w²), the machine's own inertia included
with W(phi) (J) the integral of M*, I*(phi) (kg m²) the reduced inertia, w (rad/s) the mean of extremes, eps irregularity.

Source: F. Wittenbauer, Graphische Dynamik (1923); the energy balance over a cycle.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.machine.equation import NoMotionError
from flywheel.machine.machine import Machine
from flywheel.numerics import cells
from flywheel.numerics.cells import ROUNDING, Array, Coarse
from flywheel.numerics.faults import Fault, SceneError
from flywheel.regime import turning_moment
from flywheel.regime.turning_moment import Cycle, Extent, Extremes, Roots, Run
from flywheel.scene.scene import Scene

_WORK, _FAST, _SLOW, _TORQUE, _INERTIA = range(5)  # rows of the functions H = a W + b I* whose extremes are compared


class Area(NamedTuple):
    """An area of the turning-moment diagram: the work (J) of M* between two sign changes (rad), and W at its end.

    The angles are None for areas read off a diagram.
    """

    start: float | None
    end: float | None
    work: float
    accumulated: float


class ReducedInertia(NamedTuple):
    """I* without the flywheel over a cycle, kg m²: least, greatest, mean over phi."""

    min: float
    max: float
    mean: float


class Broken(NamedTuple):
    """Heavier flywheels (kg m²), from `start` to `end` (None: infinity), that break a limit that a lighter one keeps.

    The errors are those of the ends, relative.
    """

    start: float
    end: float | None
    start_error: float = 0.0
    end_error: float = 0.0

    def as_dict(self) -> dict[str, float | None]:
        """The ends for JSON; the errors are among those of the other figures."""
        return {"from": self.start, "to": self.end}


class Flywheel(NamedTuple):
    """Flywheel figures in kg m² at the flywheel's own shaft `on`.

    The exact figure (before its floor at 0) is proven to lie within `proven_bounds`, which follow from the accumulated
    areas, and within `proven_bounds_torque`, which follow from the inertia torque. `inertia_torque` is a total,
    `inertia_torque_flywheel` the flywheel's share of it: without the machine's least inertia, as in `approximate`.
    `exact` is the smallest that keeps the requirements; `broken` lists heavier ones that do not.
    """

    on: str
    inertia: float | None
    exact: float | None
    approximate: float | None
    approximate_total: float | None
    inertia_torque: float | None
    inertia_torque_flywheel: float | None
    needed: bool | None
    proven_bounds: tuple[float, float] | None = None
    proven_bounds_torque: tuple[float, float] | None = None
    broken: tuple[Broken, ...] = ()


class FlywheelErrors(NamedTuple):
    """Relative errors of the flywheels: relative to the larger of the figure and energy_fluctuation/(eps w²)."""

    exact: float
    approximate: float
    inertia_torque: float
    inertia_torque_flywheel: float


class Figures(NamedTuple):
    """A resolved cycle with the extremes of everything that a sizing compares.

    `speed` (rad/s) is the mean of extremes that the figures hold for, `irregularity` the required one. `roots` are those
    of M*, `extent` that of I* without the flywheel by its own series, `reduced_inertia` by its slope where that is more
    accurate. `total` is I_exact + I*(0) before any floor, `error` its own (kg m² on the crank), `scale` the reference of its
    relative error; `errors` are those of all flywheels, None in an analysis.
    """

    cycle: Cycle
    speed: float
    irregularity: float | None
    extremes: Extremes
    roots: Roots
    extent: Extent
    reduced_inertia: ReducedInertia
    total: float = 0.0
    error: float = 0.0
    scale: float = 1.0
    errors: FlywheelErrors | None = None

    @property
    def accumulated(self) -> tuple[float, float]:
        """The greatest and the least W, J."""
        return float(self.extremes.greatest[_WORK]), float(self.extremes.least[_WORK])

    @property
    def fluctuation(self) -> float:
        """Max W - min W, J."""
        return float(self.extremes.greatest[_WORK] - self.extremes.least[_WORK])


def resolved_figures(machine: Machine, rtol: float) -> tuple[Figures, Run | None]:
    """The figures of loads that depend on position alone, and the motion that they give; see `refined`.

    Raises:
        SceneError: if the machine cannot run as its scene says.

    """
    speed = machine.scene.speed
    assert speed is not None, "torques that depend on position alone do not set a speed"

    def cycle(edges: Array) -> Cycle:
        balanced = turning_moment.resolve(machine, edges)
        closure = machine.scene.closure
        if machine.scene.unknown is None and abs(balanced.net) > closure * balanced.exchanged + balanced.errors.work:
            share = abs(balanced.net) / balanced.exchanged
            what = f"net work {balanced.net:.9g} J over the cycle ({share:.2g} of the work exchanged)"
            advice = 'name the unknown: drive.torque = "balance", or a parameter = "balance"'
            raise SceneError([Fault("load", what, f"zero within accuracy.closure = {closure:g}", advice)])
        return balanced

    return refined(machine, cycle, speed, rtol, lambda figures: _motion(machine, figures))


def refined(
    machine: Machine,
    cycle_on: Callable[[Array], Cycle],
    speed: float,
    rtol: float,
    motion_of: Callable[[Figures], Run | None] = lambda _: None,
) -> tuple[Figures, Run | None]:
    """The figures on cells that are halved until every estimated error is within rtol/2, or halving has no effect.

    Args:
        machine: the machine.
        cycle_on: the cycle on cells between given edges (rad).
        speed: mean of extremes, rad/s.
        rtol: relative error allowed; half of it is reserved for the confirmation.
        motion_of: the motion with the flywheel of the figures, whose error counts as well.

    """
    eps = machine.scene.irregularity

    def evaluated(edges: Array) -> tuple[tuple[Cycle, Figures, Run | None], float, Coarse]:
        whole = cycle_on(edges)
        cycle = whole
        if whole.errors.residual:  # no cell can mend what is left over
            cycle = whole._replace(errors=whole.errors._replace(residual=0.0))
        figures = figures_of(cycle, speed, eps)
        motion = motion_of(figures)
        greatest = float(np.abs(cycle.series[2]).sum(axis=-1).max())
        of_inertia = min(cycle.errors.inertia, cycle.errors.variation) / greatest if greatest > 0.0 else 0.0
        error = max(turning_moment.work_error(cycle), motion.error if motion else 0.0, of_inertia)
        if (wheels := figures.errors) is not None:
            error = max(error, figures.error / figures.scale, wheels.approximate, wheels.inertia_torque_flywheel)

        def coarse(share: float) -> NDArray[np.bool_]:
            pieces = np.searchsorted(edges, cycle.mesh.middle[:, 0]) - 1  # where laws switch at a speed, cells have been cut
            fine = turning_moment.coarse(cycle, speed * (1 + (eps or 0.0) / 2))(share)
            return np.asarray(np.bincount(pieces, weights=fine, minlength=edges.size - 1) > 0)

        return (whole, figures, motion), error, coarse

    whole, figures, motion = cells.refined(machine.mesh, evaluated, 0.5 * rtol)
    if not whole.errors.residual:
        return figures, motion
    figures = figures_of(whole, speed, eps)
    return figures, motion_of(figures)


def figures_of(cycle: Cycle, speed: float, irregularity: float | None) -> Figures:
    """The extremes of W, of W - z w²I*/2 with z of the fastest and the slowest point and 1, and of I*, over a cycle.

    Raises SceneError where a required flywheel leaves the floating-point range.
    """
    square, eps = speed**2, irregularity or 0.0
    fast, slow = -0.5 * (1 + eps / 2) ** 2 * square, -0.5 * (1 - eps / 2) ** 2 * square
    factors = np.array([[1.0, 0.0], [1.0, fast], [1.0, slow], [1.0, -0.5 * square], [0.0, 1.0]])
    extremes, roots = turning_moment.combined(cycle, factors)
    extent = turning_moment.inertia_extent(cycle, roots)
    mean = float((cycle.series[2] @ cells.MEAN) @ cycle.mesh.half[:, 0] / cycle.mesh.edges[-1])
    # by the integral of its slope, which keeps the small variation of a large I*, or by its series, which keeps the least I*
    # beside a peak: by the more accurate one
    least, greatest, least_error, greatest_error = extent
    if cycle.errors.variation <= least_error:
        least = cycle.inertia_at_start + float(extremes.least[_INERTIA])
    if cycle.errors.variation <= greatest_error:
        greatest = cycle.inertia_at_start + float(extremes.greatest[_INERTIA])
    inertia = ReducedInertia(max(least, 0.0), greatest, mean)
    figures = Figures(cycle, speed, irregularity, extremes, roots.of(_WORK), extent, inertia)
    return _with_flywheels(figures, eps, (-fast, -slow)) if eps else figures


def _with_flywheels(figures: Figures, irregularity: float, factors: tuple[float, float]) -> Figures:
    """The figures with the exact total flywheel and the errors of all flywheels; `factors` are those of z w²/2.

    If an approximate flywheel is 0, because the machine's own inertia suffices, only the total has an error; an exact 0 has
    the error of the figure before its floor. The net work of the cycle is part of each. If figure and fluctuation are only
    rounding, the errors are relative to the machine's inertia and the work exchanged.
    """
    cycle, square, (greatest, least) = figures.cycle, figures.speed**2, figures.extremes[:2]
    errors, unit = cycle.errors, max(irregularity * square, 5e-324)
    residual, total = errors.residual / unit, float(greatest[_FAST] - least[_SLOW]) / unit
    functions = ((_FAST, _SLOW), factors), ((_WORK, _WORK), (0.0, 0.0)), ((_TORQUE, _TORQUE), (0.5 * square,) * 2)
    error, *apart = turning_moment.errors_of_differences(cycle, figures.extremes, functions)
    error = error / unit + errors.start + 4 * ROUNDING * (abs(total) + cycle.inertia_at_start)
    exact, fluctuation = total - cycle.inertia_at_start, figures.fluctuation / unit
    scale = max(exact, fluctuation)
    if scale <= 4 * error:  # nothing but rounding: compare it with the inertia and the work at hand
        scale = max(scale, _at_hand(cycle, unit))
    error += residual
    if exact < -error:  # the machine's own inertia suffices, whatever rounding did: the figure is 0
        error = 0.0
    if not np.isfinite(total) or not np.isfinite(error):
        what = f"a flywheel of {total:g} kg m²"
        expected, advice = "a figure within the floating-point range", "check the scene's units"
        raise SceneError([Fault("flywheel.irregularity", what, expected, advice)])
    by_slope = min(figures.extent.error, errors.variation)  # as `reduced_inertia` has it, by the one way or the other
    relative = []  # by the areas, by the inertia torque: of the total, then of the share without the least I*
    for row, of_difference in zip((_WORK, _TORQUE), apart, strict=True):
        figure = float(greatest[row] - least[row]) / unit
        off = of_difference / unit + 4 * ROUNDING * figure
        share, of_share = figure - figures.extent.least, off + figures.extent.error + by_slope
        if share < -of_share:  # the figure is 0
            of_share = off
        for size, missed in ((max(figure, fluctuation), off), (max(share, fluctuation), of_share)):
            relative.append((missed + residual) / (size if size > 4 * missed else max(size, _at_hand(cycle, unit))))
    of_areas, approximate, torque, of_torque = relative
    of_all = FlywheelErrors(error / scale or torque, max(of_areas, approximate), torque, of_torque)
    return figures._replace(total=total, error=error, scale=scale, errors=of_all)


def _at_hand(cycle: Cycle, unit: float) -> float:
    """The reference inertia (kg m²) of errors if a figure is only rounding: the machine's, or that by its work."""
    return max(float(np.abs(cycle.series[2]).sum(axis=-1).max()), cycle.exchanged / unit, 1e-300)


def _motion(machine: Machine, figures: Figures) -> Run | None:
    """The periodic motion with the exact flywheel (known in closed form), or with the given or no flywheel."""
    scene, cycle, speed = machine.scene, figures.cycle, figures.speed
    exact, eps = figures.total - cycle.inertia_at_start, scene.irregularity or 0.0
    if scene.inertia is not None or exact <= 0.0:
        inertia = 0.0 if scene.inertia is None else scene.inertia * scene.flywheel_ratio**2
        if scene.inertia is None and figures.extent.least <= figures.extent.error:
            return None  # nothing moves that could store energy, and nothing acts
        turning_moment.check_weighs(machine, cycle, figures.extent, inertia)
        try:
            return turning_moment.run(cycle, speed, inertia)
        except NoMotionError:
            path = "flywheel.inertia" if scene.inertia is not None else "regime.speed"
            defect = f"a machine that stops within the cycle at {speed:.6g} rad/s (mean of extremes)"
            expected, advice = "enough inertia to turn through the whole cycle", "give a larger inertia or speed"
            raise SceneError([Fault(path, defect, expected, advice)]) from None
    error = figures.error / max(figures.total, 1e-300)
    return turning_moment.motion_of(exact, figures.total, speed, eps, figures.extremes, (_FAST, _SLOW), error)


def areas(figures: Figures) -> tuple[Area, ...]:
    """Areas of M* between its sign changes, from phi = 0 to the cycle's end."""
    bounds = [0.0, *figures.roots.angles.tolist(), float(figures.cycle.mesh.edges[-1])]
    sums = [0.0, *figures.roots.work.tolist(), figures.cycle.net]
    return tuple(
        Area(a, b, end - start, end) for a, b, start, end in zip(bounds[:-1], bounds[1:], sums[:-1], sums[1:], strict=True)
    )


def flywheel(figures: Figures, scene: Scene) -> Flywheel:
    """The flywheels, exact and approximate, at the flywheel's own shaft (kg m²), with bounds of the exact one."""
    eps, ratio_square = figures.irregularity, scene.flywheel_ratio**2
    if eps is None:
        return Flywheel(scene.flywheel_on, scene.inertia, None, None, None, None, None, None)
    unit, inertia = eps * figures.speed**2, figures.reduced_inertia
    total = figures.fluctuation / unit
    exact = figures.total - figures.cycle.inertia_at_start
    torque = max(float(figures.extremes.greatest[_TORQUE] - figures.extremes.least[_TORQUE]) / unit, 0.0)
    by_areas = proven_bounds(total, inertia, eps)
    by_torque = (torque - inertia.max, torque - inertia.min)  # both shifts of H = W - w²I*/2 add up to eps w²I*
    return Flywheel(
        on=scene.flywheel_on,
        inertia=None,
        exact=max(exact, 0.0) / ratio_square,
        approximate=max(total - inertia.min, 0.0) / ratio_square,
        approximate_total=total / ratio_square,
        inertia_torque=torque / ratio_square,
        inertia_torque_flywheel=max(torque - inertia.min, 0.0) / ratio_square,
        needed=exact > 0.0,
        proven_bounds=(by_areas[0] / ratio_square, by_areas[1] / ratio_square),
        proven_bounds_torque=(by_torque[0] / ratio_square, by_torque[1] / ratio_square),
    )


def proven_bounds(approximate_total: float, inertia: ReducedInertia, irregularity: float) -> tuple[float, float]:
    """Bounds (kg m²) proven for the exact flywheel, given the approximate total one.

    (z- min I* - z+ max I*)/(2 eps) <= I_exact - I_approximate_total <= (z- max I* - z+ min I*)/(2 eps), z± = (1 ± eps/2)²

    Args:
        approximate_total: (max W - min W)/(eps w²), kg m², on the crank.
        inertia: reduced inertia of the machine over the cycle, kg m².
        irregularity: eps, 0 < eps < 2.

    Valid for any I*(phi) within its extremes; the bounds meet where I* is constant and eps tends to 0.
    Source: max and min over a cycle of a sum lie between the sums of extremes.

    >>> proven_bounds(10.0, ReducedInertia(2.0, 2.0, 2.0), 0.1)
    (8.0, 8.0)

    """
    # z- a - z+ b = (1 + eps²/4)(a - b) - eps (a + b): written so, nothing cancels for a small eps
    spread = (1 + irregularity**2 / 4) * (inertia.max - inertia.min) / (2 * irregularity)
    middle = approximate_total - 0.5 * (inertia.max + inertia.min)
    return middle - spread, middle + spread
