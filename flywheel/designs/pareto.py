"""The front of several figures: designs that no other one betters in one figure without being worse in another.

Each figure is optimised alone. Between the values that the others have with these designs, levels are set, and the first
figure is optimised while each of the others keeps its level (the method of epsilon constraints). Every point is therefore an
optimum of its own, sized and confirmed as such.

Source: Y. Haimes, L. Lasdon, D. Wismer, IEEE Transactions on Systems, Man, and Cybernetics 1 (1971), 296.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from flywheel.designs.figures import each_of
from flywheel.designs.optimum import Combination, FigureFormula, best_design, combinations_of
from flywheel.designs.sweep_results import ParetoFront, ParetoPoint, front
from flywheel.designs.variation import NAMES, Variation, limits_of
from flywheel.machine.machine import Machine, scene_of
from flywheel.numerics.faults import Fault, SceneError, brief, refuse
from flywheel.reading.paths import by_path
from flywheel.scene.scene import Scene

_DIGITS = 9  # of figures by which two designs are one


Search = tuple[Combination, int, dict[int, float]]
"""The combination of choices, the objective that is optimised, and the levels of others by their place."""


def pareto(
    scene: Scene | Machine,
    minimize: Sequence[str] = (),
    *,
    maximize: Sequence[str] = (),
    over: Mapping[str, Any] | None = None,
    choose: Mapping[str, Any] | None = None,
    subject_to: Mapping[str, Any] | None = None,
    points: int = 9,
    samples: int = 64,
    starts: int = 4,
    seed: int = 0,
    rtol: float = 1e-11,
    engine: str | None = None,
    jobs: int = 1,
    progress: bool | None = False,
) -> ParetoFront:
    """The front of several figures, which are made least or greatest together.

    Args:
        scene: one that was read.
        minimize: figures or expressions to be made least, as for `optimize`.
        maximize: those to be made greatest.
        over: of each path the bounds (low, high).
        choose: of each path the values to choose from.
        subject_to: limits of figures or expressions.
        points: number of levels of each figure beyond the first, 2 or more: as many designs for two figures.
        samples: as for `optimize`, with `starts`, `seed`, `rtol` and `engine`.
        starts: of each search.
        seed: of the first designs.
        rtol: required relative error of the figures.
        engine: as of a sweep.
        jobs: number of worker processes among which the searches are divided.
        progress: true to show a bar on standard error; default: if that is a terminal.

    Raises:
        SceneError: for fewer than two objectives, and as `optimize` if no search finds a design.

    >>> import flywheel
    >>> rotor = {"load": [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "90 deg"}], "regime": {"speed": 30},
    ...          "drive": {"torque": "balance"}, "flywheel": {"irregularity": 0.01}}
    >>> designs = flywheel.pareto(flywheel.load(rotor), ["exact", "flywheel.irregularity"], points=3,
    ...                         over={"flywheel.irregularity": (0.01, 0.03)}, samples=4, starts=1)
    >>> [round(point.numbers["flywheel.irregularity"], 6) for point in designs.points]
    [0.03, 0.02, 0.01]

    """
    objectives = (*minimize, *maximize)
    faults = [] if len(set(objectives)) > 1 else [Fault("minimize", brief(objectives), "two or more figures to trade off")]
    refuse(faults + ([] if points >= 2 else [Fault("points", str(points), "2 or more")]))
    options = {"samples": samples, "starts": starts, "seed": seed, "rtol": rtol, "engine": engine}
    combinations = combinations_of(choose or {}) or [({}, {})]
    options["fixed"] = bool(choose)
    senses = tuple(k >= len(minimize) for k in range(len(objectives)))
    scene, numbers = scene_of(scene), by_path(over or {})
    point_of = partial(_point, scene, objectives, senses, numbers, subject_to or {}, options)

    alone: list[Search] = [(combination, k, {}) for combination in combinations for k in range(len(objectives))]
    ends = each_of(point_of, alone, jobs, progress, "searches")
    for k in range(len(objectives)):
        own = [end for (_, aim, _), end in zip(alone, ends, strict=False) if aim == k]
        if not any(isinstance(end, ParetoPoint) for end in own):
            raise next((end for end in own if isinstance(end, SceneError)), KeyboardInterrupt())
    designs = [end for end in ends if isinstance(end, ParetoPoint)]
    further = list[Search]()
    if len(ends) == len(alone):
        levels = [_levels(designs, k, senses[k], points, two=len(objectives) == 2) for k in range(1, len(objectives))]
        sets = [dict(enumerate(values, 1)) for values in product(*levels)]
        further = [(combination, 0, values) for combination in combinations for values in sets]
    between = each_of(point_of, further, jobs, progress, "searches")
    designs += [end for end in between if isinstance(end, ParetoPoint)]
    missing = len(alone) - len(ends) + len(further) - len(between)
    family = Variation(scene, numbers, rtol, engine, fixed=True)
    return ParetoFront(
        scene=scene,
        objectives=objectives,
        greatest=senses,
        units=tuple(FigureFormula(family, name, "minimize").unit for name in objectives),
        points=tuple(_unbeaten(designs, senses)),
        number_units=dict(zip(family.paths, family.units, strict=True)),
        searches=len(ends) + len(between),
        messages=("interrupted: the front of the designs so far",) if missing else (),
        interrupted=bool(missing),
    )


def _levels(designs: Sequence[ParetoPoint], k: int, greatest: bool, points: int, *, two: bool) -> list[float]:
    """Levels of an objective between its best and its worst value in the optima of each alone; open ends left out."""
    best = (max if greatest else min)(point.values[k] for point in designs)
    worst = (min if greatest else max)(point.values[k] for point in designs)
    levels: list[float] = np.linspace(best, worst, points).tolist()
    return levels[1:-1] if two else levels[1:]


def _unbeaten(designs: Sequence[ParetoPoint], greatest: Sequence[bool]) -> list[ParetoPoint]:
    """The designs that no other one betters, one of those that are equal, in the order of the first objective."""
    signs = np.where(greatest, -1.0, 1.0)
    values = np.array([[float(f"{value:.{_DIGITS - 1}e}") for value in point.values] for point in designs]) * signs
    _, first = np.unique(values, axis=0, return_index=True)
    return [designs[first[k]] for k in front(values[first])]


def _point(
    scene: Scene,
    objectives: Sequence[str],
    greatest: Sequence[bool],
    over: Mapping[str, Any],
    subject_to: Mapping[str, Any],
    options: Mapping[str, Any],
    search: Search,
) -> ParetoPoint | SceneError:
    """The best design of one search, or why there is none.

    Args:
        scene: of all searches.
        objectives: figures.
        greatest: the sense of each.
        over: numbers with their bounds.
        subject_to: limits.
        options: of the search.
        search: which of them.

    """
    limits, ((choices, values), aim, levels) = dict(subject_to), search
    try:
        scene = scene.with_(values)
        family = Variation(scene, over, options["rtol"], fixed=True)
        formulas = [FigureFormula(family, name, "minimize") for name in objectives]
        for k, level in levels.items():
            name = objectives[k]
            low, high = (None, None) if name not in limits else limits_of(limits[name], formulas[k].unit, name)
            low_level, high_level = (level, None) if greatest[k] else (None, level)
            limits[name] = (
                max((end for end in (low, low_level) if end is not None), default=None),
                min((end for end in (high, high_level) if end is not None), default=None),
            )
        sense = "maximize" if greatest[aim] else "minimize"
        best = best_design(scene, aim=sense, objective=objectives[aim], over=over, limits=limits, **options)
    except SceneError as error:
        return error
    if best.interrupted:
        raise KeyboardInterrupt
    column = np.array(list(best.numbers.values()), float)[:, None]
    figures = np.array([[best.figures.get(name, np.nan)] for name in NAMES])
    return ParetoPoint(
        tuple(float(formula(family, column, figures)[0]) for formula in formulas),
        best.numbers,
        choices,
        best.confirmed,
    )
