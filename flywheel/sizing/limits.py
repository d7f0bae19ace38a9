"""The smallest flywheel that keeps limits: an irregularity, and shares of a motor's rated figures.

Each limit's figure is taken along the steady periodic motion with a flywheel, the torque, heat and current of the motor at
its own speeds. With more inertia a machine runs more evenly, and most figures fall towards those of a constant speed; but
not all, and not always: a motor's current may swing with its rotor, and a load that grows with speed takes more of an even
motion. Therefore no figure is assumed to fall. All are computed on a grid of inertias, from one that gives an irregularity
of about 0.001 down to none, a few per decade of what the machine turns with the least of its own, more where a motor's
states resonate with the rotor; at each peak and trough of a figure its extreme is searched for; beyond the
grid the figure tends to that at infinite inertia like 1/J. Between inertias on either side of a limit the crossing is found
by inverse interpolation, at the required error.

Each motion is found from that with the nearest flywheel, so that all lie on one branch; those of the grid together, as far
as each continues the one before (`regime.several_motions`). A flywheel whose motion is neither
found nor shown not to exist counts neither as kept nor as broken. One search serves machines, duties, and many designs at
once (`Search`): it requests the figures with one flywheel after another, and its caller computes them.

Source: R. P. Brent, Algorithms for Minimization without Derivatives, Prentice-Hall 1973, ch. 4 (inverse interpolation in a
bracket) and 5 (parabolas and golden sections).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from enum import Enum
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple, TypeVar

import numpy as np

from flywheel.machine.machine import Machine, circuit_of
from flywheel.numerics.cells import ROUNDING, Array
from flywheel.numerics.faults import Fault, SceneError
from flywheel.numerics.units import figure
from flywheel.regime.branch import Branch, Existence, resonates
from flywheel.regime.cycle_equations import NoRegimeError
from flywheel.regime.periodic_motion import OwnMotion
from flywheel.regime.several_motions import lighter_motions
from flywheel.regime.turning_moment import Run
from flywheel.regime.wittenbauer import Broken, Figures
from flywheel.scene.scene import Scene
from flywheel.sizing.motor import IRREGULARITY, MotorShaft, MotorShafts, Share, of_motor, shares
from flywheel.sizing.results import Limit, Regime, Sizing

_COARSE = 1e-4  # error of trial motions
PER_DECADE, PER_DECADE_RESONANT = 4, 12
"""Flywheels of a grid in a decade of their inertia with the machine's own; where a motor's states resonate."""
SIZED = "sized"
"""Under which a machine keeps the motion that was sized for an irregularity, with that and the error allowed."""
IN_TURN = 3
"""Flywheels without a motion in turn, after which lighter ones are looked at from none up."""
_LARGEST = 1e-3  # irregularity with the heaviest flywheel of the grid, about
_LIGHT = 1e-2  # of the machine's greatest inertia: one beside which a lighter one at some angles is none
_HEAVY = 1e3  # times the heaviest of the grid: practically infinite, apart from terms in 1/J
_SECOND = 1e-2  # of those terms: share of faster ones at such inertias
_LEAST = 1e-5  # of the heaviest: an inertia far below that with which such a machine stalls
_OF_EXTREME = 1e-3  # of an inertia: resolution of the search for an extreme of a figure
_BESIDE = 1e-3  # of an inertia: distance of the points for a slope
_MOST_HALVINGS = 24  # halvings of a bracket, or widenings of it
_MOST_STEPS, _THROUGH = 100, 4  # steps towards a crossing; flywheels from which it is interpolated
_APART = 1e-6  # of an inertia: flywheels nearer than this give no slope
_GOLDEN = 0.381966011250105
_EDGE = 1e-4  # of an inertia: resolution of the lightest one with which the machine keeps turning
_NEAR_UNKNOWN = 0.1  # of an inertia: resolution beside one whose state is unknown


class Smallest(NamedTuple):
    """The motion with the smallest flywheel that keeps all limits, its relative error, the limits, which one binds."""

    motion: OwnMotion
    error: float
    limits: Mapping[str, Limit]
    binding: str | None
    broken: tuple[Broken, ...] = ()
    messages: tuple[str, ...] = ()


# -- the figures along a motion ------------------------------------------------------------------------------------------


def requirements_of(scene: Scene) -> Mapping[str, float]:
    """Requirements of the flywheel of a scene: its limits, or its irregularity."""
    return scene.limits or ({} if scene.irregularity is None else {IRREGULARITY: scene.irregularity})


def shares_along(machine: Machine, motion: OwnMotion, rtol: float) -> dict[str, Share]:
    """The figures of all limits of a machine's scene along a motion."""
    shaft = MotorShaft(machine.scene, motion.cycle, motion.run, motion.speed, rtol)
    return shares(requirements_of(machine.scene), shaft)


def kept_alone(regime: Regime, omega: Array) -> dict[str, Limit] | None:
    """The limits of a scene where a machine without inertia keeps them without a flywheel; None if it does not.

    `omega` is the crank's speed at the cycle's nodes (rad/s).
    """
    scene, run, names = regime.machine.scene, regime.motion, regime.machine.scene.limits
    if not of_motor(scene):
        return {}
    assert run is not None
    figures = shares(names, MotorShaft(scene, regime.cycle, run, regime.speed, regime.rtol, omega))
    if any(share.value - share.error > names[name] for name, share in figures.items()):
        return None
    spans = {name: Span(LimitState.KEPT, 0.0, np.inf, share.error / names[name]) for name, share in figures.items()}
    return {name: _limit(names[name], share, spans[name]) for name, share in figures.items()}


def _limit(limit: float, share: Share, kept: Span, square: float = 1.0) -> Limit:
    """A limit with the figure that is reached; `square` is that of the speed of the flywheel's shaft over the crank's."""
    return Limit(
        requirement=limit,
        reached=share.value,
        alone=kept.first / square,
        reached_error=share.error / max(share.value, 1e-300),
        alone_error=kept.error,
    )


# -- the search ----------------------------------------------------------------------------------------------------------


class LimitState(Enum):
    """State of a limit with a flywheel; `NONE` where the machine stops with it, `UNKNOWN` where that is undetermined."""

    KEPT = "kept"
    BROKEN = "broken"
    NONE = "no motion"
    UNKNOWN = "unknown"


_WITHOUT_MOTION = {Existence.NONE: LimitState.NONE, Existence.UNKNOWN: LimitState.UNKNOWN}


class Span(NamedTuple):
    """Inertias (kg m²) from `first` to `last` with one state of a limit; `error` of `first`, relative."""

    state: LimitState
    first: float
    last: float
    error: float = 0.0


class FlywheelPoint(NamedTuple):
    """A flywheel (kg m²) with its motions (of a duty, one for each phase) and the figures along them."""

    inertia: float
    existence: Existence
    motions: tuple[Any, ...] = ()
    shares: Mapping[str, Share] = {}
    error: float | None = None

    def beyond(self, name: str, limit: float) -> float:
        """Excess of a figure over its limit: not above 0 if the limit is kept, or if that is within the error."""
        if not self.motions:
            return np.inf
        share = self.shares[name]
        return 0.0 if abs(share.value - limit) <= share.error else share.value - limit

    def state(self, name: str, limit: float) -> LimitState:
        """State of a limit with this flywheel."""
        if self.motions:
            return LimitState.KEPT if self.beyond(name, limit) <= 0.0 else LimitState.BROKEN
        return _WITHOUT_MOTION[self.existence]


Outcome = TypeVar("Outcome")
Steps = Generator[tuple[float, float], FlywheelPoint, Outcome]
"""A search: it yields a flywheel (kg m²) with a relative error, and is sent the figures with it."""


def answered(steps: Steps[Outcome], at: Callable[[float, float], FlywheelPoint]) -> Outcome:
    """The outcome of a search whose flywheels are computed one after the other."""
    point = None
    while True:
        try:
            inertia, error = steps.send(point)  # type: ignore[arg-type]
        except StopIteration as end:
            outcome: Outcome = end.value
            return outcome
        point = at(inertia, error)


def grid_inertias(own: float, heaviest: float, per_decade: int = PER_DECADE) -> list[float]:
    """Inertias (kg m²) of a grid, from the heaviest down to none; with the machine's own they fall in even steps."""
    decades = float(np.log10((heaviest + own) / own))
    totals = np.geomspace(heaviest + own, own, int(np.ceil(per_decade * decades)) + 1)
    return [*(totals[:-1] - own).tolist(), 0.0]


class Search:
    """The figures of a machine, or of a duty, over the inertia of a flywheel, and where each keeps its limit.

    Args:
        limits: the figures' limits, by their names.
        own: the machine's own inertia (kg m²) where it has least.
        heaviest: a flywheel (kg m²) with which the speed is nearly constant.
        rtol: required relative error of an inertia.
        swings: True if a motor has states of its own, so that a lighter flywheel may keep turning where a heavier one stops.
        per_decade: flywheels of the grid in a decade.
        in_turn: flywheels without a motion in turn, after which lighter ones are looked at from none up.
        stopped: a flywheel (kg m²) with which, as with any lighter one, there is certainly no motion.

    """

    def __init__(
        self,
        limits: Mapping[str, float],
        own: float,
        heaviest: float,
        rtol: float,
        *,
        swings: bool = False,
        per_decade: int = PER_DECADE,
        in_turn: int = IN_TURN,
        stopped: float = -np.inf,
    ) -> None:
        self.limits, self.rtol, self.in_turn, self.stopped = limits, rtol, in_turn, stopped
        self.own, self.heaviest, self.swings, self.per_decade = own, heaviest, swings, per_decade
        self.points: dict[float, FlywheelPoint] = {}  # at the required error
        self.extremes: list[FlywheelPoint] = []
        self.grid: list[FlywheelPoint] = []
        self.ultimate: dict[str, Share] = {}

    def closely(self, inertia: float) -> Steps[FlywheelPoint]:
        """The figures with a flywheel at the required error, or at the least error possible."""
        if inertia not in self.points:
            point = yield from self._at(inertia, 0.5 * self.rtol)
            self.points[inertia] = point if point.motions else (yield from self._at(inertia, _COARSE))
        return self.points[inertia]

    def _at(self, inertia: float, error: float) -> Steps[FlywheelPoint]:
        """The figures with a flywheel, which are not requested where there is certainly no motion."""
        return FlywheelPoint(inertia, Existence.NONE) if inertia <= self.stopped else (yield inertia, error)

    def _trial(self, inertia: float) -> Steps[FlywheelPoint]:
        """The figures with a flywheel of the grid: not closely, unless that leaves open on which side of a limit one is."""
        point = yield from self._at(inertia, _COARSE)
        if point.motions and any(point.beyond(*limit) == 0.0 for limit in self.limits.items()):
            point = yield from self.closely(inertia)
        return point

    def _scaled(self, inertia: float) -> float:
        return float(np.log(inertia + self.own))

    def _inertia(self, scaled: float) -> float:
        return max(float(np.exp(scaled)) - self.own, 0.0)

    @property
    def inertias(self) -> list[float]:
        """Inertias (kg m²) of the grid, from the heaviest down to none."""
        return grid_inertias(self.own, self.heaviest, self.per_decade)

    def scan(self) -> Steps[None]:
        """Finds the figures on the grid, from the heaviest flywheel down to none, unless they are known.

        If several in a row have no motion, the search continues with no flywheel, and from there with heavier ones as long
        as they have a motion. A machine that stops with one flywheel also stops with any lighter one, unless its motor
        swings.
        """
        inertias = [] if self.grid else self.inertias
        points, lost = self.grid[::-1], 0
        while inertias and lost < self.in_turn:
            points.append((yield from self._trial(inertias.pop(0))))
            lost = 0 if points[-1].motions else lost + 1
            if not points[0].motions:
                raise NoRegimeError(f"no steady motion with a flywheel of {self.heaviest:.3g} kg m² on the crank")
            if points[-1].existence is Existence.NONE and not self.swings:
                inertias = []
        light = list[FlywheelPoint]()
        while inertias and (not light or light[-1].motions):
            light.append((yield from self._trial(inertias.pop())))
        self.grid = light + points[::-1]

    # -- where a limit is kept

    def spans(self, name: str, *, alone: bool = True) -> Steps[list[Span]]:
        """The ranges of inertia, from 0 to infinity, in which a limit is kept, is not, or neither is known.

        With `alone` false, a range that begins where another limit is broken all around begins at the next flywheel of the
        grid: where all are kept does not depend on that.

        Raises:
            NoRegimeError: if even the heaviest flywheel leaves no steady motion.

        """
        limit = self.limits[name]
        yield from self.scan()
        yield from self._narrow(name, limit, alone=alone)
        points = yield from self._with_extremes(name, limit)
        states = [point.state(name, limit) for point in points]
        # no flywheel is exact, unless its figure is at the limit but for the error
        nearly = bool(points[0].motions) and abs(points[0].shares[name].value - limit) <= points[0].shares[name].error
        spans = [Span(states[0], 0.0, np.inf, points[0].shares[name].error / limit if nearly else 0.0)]
        for before, after, was, state in zip(points, points[1:], states, states[1:], strict=False):
            if was is not state:
                inertia, error = after.inertia, 1.0 - before.inertia / after.inertia
                if alone or not self._breaks_another(name, before, after):
                    inertia, error = yield from self._boundary(name, limit, before, after)
                if was is LimitState.UNKNOWN:  # it may begin anywhere in the range of which nothing is known
                    error = max(error, 1.0 - spans[-1].first / inertia)
                self._begin(spans, state, inertia, error)
        last = points[-1]
        if not last.motions:
            return spans
        rises = len(points) > 1 and name in points[-2].shares and last.shares[name].value > points[-2].shares[name].value
        ultimately = (yield from self._ultimately(name, limit)) if states[-1] is LimitState.BROKEN or rises else 0.0
        if states[-1] is LimitState.BROKEN and ultimately < 0.0:
            self._begin(spans, LimitState.KEPT, *(yield from self._beyond(name, limit, last)))
        elif states[-1] is LimitState.KEPT and ultimately > 0.0:
            self._begin(spans, LimitState.BROKEN, *(yield from self._beyond(name, limit, last)))
        return spans

    def _breaks_another(self, name: str, *points: FlywheelPoint) -> bool:
        """Tests whether flywheels break another limit, the same one all of them."""
        others = [(other, limit) for other, limit in self.limits.items() if other != name]
        return any(all(point.state(*each) is LimitState.BROKEN for point in points) for each in others)

    @staticmethod
    def _begin(spans: list[Span], state: LimitState, first: float, error: float) -> None:
        """Lets the next range begin where the last one ends."""
        spans[-1] = spans[-1]._replace(last=first)
        spans.append(Span(state, first, np.inf, error))

    def _narrow(self, name: str, limit: float, *, alone: bool) -> Steps[None]:
        """Refines the grid between flywheels that keep a limit and those without a motion, or of unknown state."""
        for _ in range(_MOST_HALVINGS):
            for before, after in pairwise(self.grid):
                if before.motions and after.motions:
                    continue
                states, gap = (before.state(name, limit), after.state(name, limit)), after.inertia - before.inertia
                near = _NEAR_UNKNOWN if LimitState.UNKNOWN in states else _EDGE
                if not alone and self._breaks_another(name, *(point for point in (before, after) if point.motions)):
                    continue
                if LimitState.KEPT in states and gap > near * after.inertia:
                    middle = self._inertia(0.5 * (self._scaled(before.inertia) + self._scaled(after.inertia)))
                    if before.inertia < middle < after.inertia:
                        point = yield from self._trial(middle)
                        self.grid = sorted([*self.grid, point], key=lambda each: each.inertia)
                        break
            else:
                return

    def _boundary(self, name: str, limit: float, before: FlywheelPoint, after: FlywheelPoint) -> Steps[tuple[float, float]]:
        """The inertia (kg m²) at which the state of a limit changes between two flywheels, and its relative error."""
        if before.motions and after.motions:
            return (yield from self._crossing(name, limit, before, after))
        states = before.state(name, limit), after.state(name, limit)
        side = after if states[0] is LimitState.UNKNOWN or (after.motions and LimitState.UNKNOWN not in states) else before
        return side.inertia, (after.inertia - before.inertia) / max(side.inertia, 1e-300)

    def _ultimately(self, name: str, limit: float) -> Steps[float]:
        """Excess of a figure over its limit at infinite inertia; 0 if that is within its error.

        Figures converge there like 1/J, or faster: they are extrapolated from those at two large inertias.
        """
        if not self.ultimate:
            light = (yield from self.closely(_HEAVY * self.heaviest)).shares
            heavy = (yield from self.closely(2.0 * _HEAVY * self.heaviest)).shares
            for each in self.limits if light and heavy else ():
                (first, first_error), (second, second_error) = light[each], heavy[each]
                error = _SECOND * abs(second - first) + first_error + 2 * second_error
                self.ultimate[each] = Share(2 * second - first, error)
        share = self.ultimate.get(name)
        return 0.0 if share is None or abs(share.value - limit) <= share.error else share.value - limit

    def _beyond(self, name: str, limit: float, last: FlywheelPoint) -> Steps[tuple[float, float]]:
        """The crossing beyond the heaviest flywheel of the grid, and its relative error."""
        share, ultimate = last.shares[name].value - limit, (yield from self._ultimately(name, limit))
        far = 2.0 * last.inertia * abs((share - ultimate) / ultimate)  # as what falls like 1/J goes there
        heavier = yield from self.closely(max(far, 2.0 * last.inertia))
        for _ in range(_MOST_HALVINGS):
            if (heavier.beyond(name, limit) > 0.0) != (share > 0.0):
                break
            heavier = yield from self.closely(4.0 * heavier.inertia)
        return (yield from self._crossing(name, limit, last, heavier))

    def _crossing(self, name: str, limit: float, before: FlywheelPoint, after: FlywheelPoint) -> Steps[tuple[float, float]]:
        """The inertia (kg m² on the crank) between two at which a figure is at its limit, and its relative error.

        By inverse interpolation from the flywheels whose figures are nearest to the limit, those of the grid at first; by
        bisection where that leaves the bracket, or gains little.
        """
        low, high, rising = yield from self._bracket(name, limit, before, after)
        for inertia, point in self.points.items():
            if low < self._scaled(inertia) < high and point.motions and point.beyond(name, limit) == 0.0:
                return inertia, (yield from self._error(name, limit, point))
        points = {point.inertia: point for point in (*self.grid, before, after)}
        points |= {inertia: point for inertia, point in self.points.items() if point.motions}
        values = {
            self._scaled(inertia): point.shares[name].value - limit
            for inertia, point in points.items()
            if point.motions and abs(self._scaled(inertia) - 0.5 * (low + high)) <= 1.5 * (high - low)
        }
        most = min(
            abs(values.get(low, np.inf)), abs(values.get(high, np.inf))
        )  # nearer to the limit outside, a figure comes to another crossing
        values = {each: off for each, off in values.items() if low <= each <= high or abs(off) > most}
        sizes = [np.inf, np.inf]
        for _ in range(_MOST_STEPS):
            scaled = _interpolated(values)
            if not low < scaled < high or sizes[-1] > 0.25 * sizes[-2]:
                scaled, sizes = 0.5 * (low + high), [np.inf, np.inf]
            inertia = self._inertia(scaled)
            here = yield from self.closely(inertia)
            if not here.motions:
                off = np.inf
            else:
                off = values[scaled] = here.shares[name].value - limit
            if off == 0.0 or high - low <= 4 * ROUNDING * max(abs(low), abs(high)):
                break
            low, high = (low, scaled) if (off > 0.0) == rising else (scaled, high)
            within = here.motions and abs(off) <= 0.3 * here.shares[name].error
            nearest = min(values, key=lambda each: abs(values[each]))  # where it is another, the zero is that of the others
            if within or (nearest == scaled and abs(_interpolated(values) - scaled) <= 0.02 * self.rtol):
                break
            sizes.append(abs(off))
        return inertia, (yield from self._error(name, limit, here))

    def _error(self, name: str, limit: float, here: FlywheelPoint) -> Steps[float]:
        """The relative error of an inertia at which a figure is at its limit; infinite where no motion or slope is known."""
        if not here.motions:
            return np.inf
        if name == IRREGULARITY and here.error is not None:
            return here.error
        missed = here.shares[name].error + abs(here.shares[name].value - limit)
        slope = yield from self.slope(name, here)
        return float(missed / max(slope, 1e-300) + 0.02 * self.rtol) if slope < np.inf else np.inf

    def _bracket(
        self, name: str, limit: float, before: FlywheelPoint, after: FlywheelPoint
    ) -> Steps[tuple[float, float, bool]]:
        """The two flywheels (scaled) between which a figure crosses its limit, and whether it rises there.

        A coarse figure may be slightly on the other side: the bracket is then widened.
        """
        rising = before.beyond(name, limit) <= 0.0

        def lies_beyond(point: FlywheelPoint) -> Steps[bool]:
            if point.motions and point.beyond(name, limit) == 0.0:
                point = yield from self.closely(point.inertia)
            return not point.motions or point.shares[name].value > limit

        ends, width = [before, after], self._scaled(after.inertia) - self._scaled(before.inertia)
        for k in range(_MOST_HALVINGS):
            good = [(yield from lies_beyond(ends[0])) != rising, (yield from lies_beyond(ends[1])) == rising]
            if all(good):
                break
            for end, sign in ((0, -1.0), (1, 1.0)):
                if not good[end]:
                    further = self._inertia(self._scaled(ends[end].inertia) + sign * 0.01 * width * 2**k)
                    ends[end] = yield from self.closely(further)
        return self._scaled(ends[0].inertia), self._scaled(ends[1].inertia), rising

    def slope(self, name: str, here: FlywheelPoint) -> Steps[float]:
        """|d figure/d ln J| at a flywheel; infinite if it is unknown."""
        beside, distance = (yield from self.beside(here)) or (None, 1.0)
        return np.inf if beside is None else abs(beside.shares[name].value - here.shares[name].value) / distance

    def beside(self, here: FlywheelPoint) -> Steps[tuple[FlywheelPoint, float] | None]:
        """The nearest flywheel of the same accuracy, or one beside it, and its distance in ln J.

        None if neither a heavier nor a lighter one beside it has a motion: how figures change with J is then unknown.
        """
        moving = [point for point in self.points.values() if point.motions and point.inertia > 0.0]
        apart = [(abs(float(np.log(point.inertia / here.inertia))), point) for point in moving]
        near, point = min((each for each in apart if each[0] > _APART), key=lambda each: each[0], default=(np.inf, here))
        if near <= 5 * _BESIDE:
            return point, near
        for distance in (_BESIDE, -_BESIDE):
            beside = yield from self.closely(here.inertia * (1.0 + distance))
            if beside.motions:
                return beside, _BESIDE
        return None

    def _with_extremes(self, name: str, limit: float) -> Steps[list[FlywheelPoint]]:
        """The flywheels of the grid, with those at which the figure may pass its limit and return between two of them."""
        points = list(self.grid)
        for low, middle, high in zip(self.grid, self.grid[1:], self.grid[2:], strict=False):
            if not (low.motions and middle.motions and high.motions):
                continue
            before, here, after = (point.shares[name].value - limit for point in (low, middle, high))
            sign = 1.0 if min(before, here, after) > 0.0 else -1.0 if max(before, here, after) <= 0.0 else 0.0
            falls, rises = sign * (before - here), sign * (after - here)
            if sign and min(falls, rises) > 0.0 and abs(here) <= max(falls, rises):
                points.append((yield from self._extreme(name, limit, sign, (low, middle, high))))
        return sorted(points, key=lambda point: point.inertia)

    def _extreme(self, name: str, limit: float, sign: float, points: Sequence[FlywheelPoint]) -> Steps[FlywheelPoint]:
        """The flywheel with which a figure is least (sign +1) or greatest, or one that is already beyond the limit.

        Args:
            name: of the limit.
            limit: of the figure.
            sign: +1 for a least figure, -1 for a greatest one.
            points: three flywheels, the middle one with the least figure, or the greatest.

        """
        by_scale = {self._scaled(point.inertia): point for point in points}
        values = {scaled: sign * point.shares[name].value for scaled, point in by_scale.items()}
        (low, best, high), middle = sorted(values), points[1]
        for _ in range(_MOST_STEPS):
            if high - low <= 2 * _OF_EXTREME or values[best] < sign * limit:
                break
            scaled = _vertex([(each, values[each]) for each in (low, best, high)])
            if not low < scaled < high or abs(scaled - best) < 0.5 * _OF_EXTREME:  # into the wider part
                scaled = best + _GOLDEN * (high - best if high - best > best - low else low - best)
            here = by_scale[scaled] = yield self._inertia(scaled), _COARSE
            if not here.motions:
                return middle
            values[scaled] = sign * here.shares[name].value
            inside = sorted((low, best, scaled, high))
            place = 1 if values[inside[1]] <= values[inside[2]] else 2
            low, best, high = inside[place - 1 : place + 2]
        self.extremes.append(by_scale[best])
        return by_scale[best]

    def best(self, name: str) -> tuple[float, float, float]:
        """The least figure with any flywheel, its error, and that flywheel's inertia (kg m² on the crank)."""
        figures = [(*point.shares[name], point.inertia) for point in (*self.grid, *self.extremes) if point.motions]
        if name in self.ultimate:
            figures.append((*self.ultimate[name], np.inf))
        return min(figures)


def _interpolated(values: Mapping[float, float]) -> float:
    """Root of a function, by the polynomial of the abscissa through its values nearest to zero."""
    nearest = sorted(values, key=lambda each: abs(values[each]))[:_THROUGH]
    total = 0.0
    for each in nearest:
        for other in nearest:
            if other != each and values[other] == values[each]:
                return np.nan
        total += each * math.prod(values[k] / (values[k] - values[each]) for k in nearest if k != each)
    return total


def _vertex(points: Sequence[tuple[float, float]]) -> float:
    """The abscissa of the vertex of the parabola through three points, the middle one of which is the least."""
    (a, at_a), (b, at_b), (c, at_c) = points
    left, right = (b - a) * (at_b - at_c), (b - c) * (at_b - at_a)
    return b - 0.5 * ((b - a) * left - (b - c) * right) / (left - right) if left != right else np.nan


def extent(
    fluctuation: float, least: float, greatest: float, speed: float, irregularity: float = 2.0
) -> tuple[float, float]:
    """The machine's own inertia for a search, and the flywheel with which the speed is nearly constant (kg m² on the crank).

    Args:
        fluctuation: of energy at a constant speed, J.
        least: of the machine's own inertia over the cycle, kg m².
        greatest: of it.
        speed: rad/s.
        irregularity: the required one.

    """
    heaviest = max(fluctuation / (min(_LARGEST, 0.5 * irregularity) * speed**2), 10.0 * greatest) or 1.0
    return max(least, _LIGHT * greatest, _LEAST * heaviest), heaviest


def extent_of(sizing: Sizing) -> tuple[float, float]:
    """The same for a sized machine, at its flywheel's own shaft."""
    least, greatest = (0.0, 0.0) if sizing.reduced_inertia is None else sizing.reduced_inertia[:2]
    own, heaviest = extent(sizing.energy_fluctuation, least, greatest, sizing.constant_speed or sizing.speed)
    square = sizing.scene.flywheel_ratio**2
    return own / square, heaviest / square


def branch_of(sizing: Sizing) -> Branch:
    """The steady motions of a sized machine over its flywheel."""
    assert sizing.machine is not None
    speed, constant = sizing.constant_speed or sizing.speed, sizing.constant or sizing.cycle
    unknown = 0.0 if constant is None else constant.balance or 0.0
    return Branch(sizing.machine, speed, unknown, None if sizing.scene.unknown is None else speed)


def together(every: Iterable[Sequence[Span]]) -> list[Span]:
    """The ranges in which all of several limits are kept, one is not, or neither is known."""
    listed = list(every)
    ranges: list[Span] = []
    for first, error in sorted({(span.first, span.error) for spans in listed for span in spans}):
        states = {span.state for spans in listed for span in spans if span.first <= first < span.last}
        broken, unknown = states & {LimitState.BROKEN, LimitState.NONE}, LimitState.UNKNOWN in states
        state = LimitState.BROKEN if broken else LimitState.UNKNOWN if unknown else LimitState.KEPT
        if ranges and ranges[-1].state is state:
            continue
        if ranges:
            ranges[-1] = ranges[-1]._replace(last=first)
        ranges.append(Span(state, first, np.inf, error))
    return ranges


def broken_beyond(spans: Sequence[Span], inertia: float, square: float = 1.0) -> tuple[Broken, ...]:
    """Ranges of heavier flywheels that break a limit; `square` is that of the speed of their shaft over the crank's."""
    ends = [span.error for span in spans[1:]] + [0.0]
    return tuple(
        Broken(span.first / square, None if span.last == np.inf else span.last / square, span.error, end)
        for span, end in zip(spans, ends, strict=True)
        if span.state is LimitState.BROKEN and span.first >= inertia
    )


def smallest(machine: Machine, figures: Figures, unknown: float, rtol: float) -> Smallest:
    """The motion with the smallest flywheel that keeps all limits of a scene.

    The motions of the grid are found together, as far as each continues that of the flywheel before; the others, and all at
    the required error, one by one from the nearest. Where the irregularity is crossed, the flywheel is solved for with it.

    Args:
        machine: a machine whose torques depend on speed.
        figures: those at a constant speed.
        unknown: a first guess of the scene's unknown.
        rtol: required relative error of the inertia.

    Raises:
        SceneError: for limits that no flywheel reaches, or that none keeps together.
        NoRegimeError: if there is no steady motion even with a heavy flywheel.

    """
    scene, requirements = machine.scene, requirements_of(machine.scene)
    branch = Branch(machine, figures.speed, unknown, figures.speed if scene.unknown is not None else None)
    least, greatest, _ = figures.reduced_inertia
    ends = extent(figures.fluctuation, least, greatest, figures.speed, requirements.get(IRREGULARITY, 2.0))
    swings = circuit_of(scene) is not None
    resonant = swings and resonates(machine, figures.speed, grid_inertias(*ends), unknown)
    search = Search(requirements, *ends, rtol, swings=swings, per_decade=PER_DECADE_RESONANT if resonant else PER_DECADE)
    at, together, left = partial(_at, machine, branch), dict[float, FlywheelPoint](), search.inertias

    def of_grid(inertia: float, error: float) -> FlywheelPoint:
        nonlocal left
        if error < _COARSE:
            return at(inertia, error)
        if inertia in left and branch.motions:
            lighter = dict(_lighter(machine, branch, left[left.index(inertia) :]))
            together.update(lighter)
            left = [each for each in left if each < min(lighter, default=0.0)][1:]  # the next is found alone, if at all
        return together[inertia] if inertia in together else at(inertia, error)

    answered(search.scan(), of_grid)
    for before, after in pairwise(search.grid) if IRREGULARITY in requirements else ():
        states = [point.state(IRREGULARITY, requirements[IRREGULARITY]) for point in (before, after)]
        if set(states) == {LimitState.KEPT, LimitState.BROKEN}:
            *known, sized = machine.kept.get(SIZED, (None,))
            if known != [requirements[IRREGULARITY], rtol]:
                sized = branch.sized(requirements[IRREGULARITY], before.inertia, after.inertia, rtol)
            if sized is not None and before.inertia < sized.inertia < after.inertia:
                own = shares_along(machine, sized, rtol)
                search.points[sized.inertia] = FlywheelPoint(
                    sized.inertia, Existence.MOTION, (sized,), own, sized.inertia_error
                )
    return answered(_smallest(scene, search), at)


def _at(machine: Machine, branch: Branch, inertia: float, rtol: float) -> FlywheelPoint:
    """A flywheel (kg m² on the crank) with its motion and figures, at an error."""
    finding = branch.at(inertia, rtol)
    if finding.motion is None:
        return FlywheelPoint(inertia, finding.existence)
    return FlywheelPoint(inertia, finding.existence, (finding.motion,), shares_along(machine, finding.motion, rtol))


def _lighter(machine: Machine, branch: Branch, inertias: Sequence[float]) -> Iterator[tuple[float, FlywheelPoint]]:
    """Lighter and lighter flywheels (kg m² on the crank) with their figures, as far as their motions are known together."""
    scene, requirements, heavier = machine.scene, requirements_of(machine.scene), branch.nearest(inertias[0])
    whole = scene.motor is not None and scene.motor.whole_heat is not None  # which it gives along one motion alone
    if heavier is None or heavier.inertia <= inertias[0] or (whole and "motor_heat" in requirements):
        return
    ratio = 1.0 if scene.drive is None else scene.shafts[scene.drive.on]
    for motions, places in lighter_motions(machine, heavier, np.array(inertias), branch.mean, _COARSE):
        figures = shares(requirements, MotorShafts(scene.motor, ratio, motions.runs(), motions.solved))
        for row, inertia in ((row, inertias[place]) for row, place in enumerate(places) if place >= 0):
            branch.others[inertia] = partial(motions.again, row, branch.mean, _COARSE)
            each = {name: Share(float(share.value[row]), float(share.error[row])) for name, share in figures.items()}
            if all(share.error <= _COARSE * requirements[name] for name, share in each.items()):
                yield inertia, FlywheelPoint(inertia, Existence.MOTION, (motions,), each)


def first_kept(search: Search, square: float, *, alone: bool = True) -> Steps[tuple[dict[str, list[Span]], float, float]]:
    """Finds the range of each limit, and the least inertia (kg m²) that keeps all, with its relative error.

    Args:
        search: the search.
        square: of the speed of the flywheel's shaft over that of the inertias.
        alone: False where the range of one limit is not needed within that of another that is broken.

    Raises:
        SceneError: for limits that no flywheel reaches, or that none keeps together.
        NoRegimeError: if even the heaviest flywheel leaves no steady motion.

    """
    spans = dict[str, list[Span]]()
    for name in search.limits:
        spans[name] = yield from search.spans(name, alone=alone)
    if search.extremes and not alone:  # a limit that is broken on either side of a flywheel may be kept with it
        return (yield from first_kept(search, square))
    check_reached(search, spans, square)
    check_together(spans, square)
    return spans, *next((span.first, span.error) for span in together(spans.values()) if span.state is LimitState.KEPT)


def loosened(run: Run, uneven: float, level: float) -> Run:
    """A run of which the irregularity is known less well by a share, and the mean speed by another."""
    return run._replace(error=run.error + 2.0 * uneven, level=run.level + 2.0 * level)


def _loosened(motion: OwnMotion, other: OwnMotion | None, share: float) -> OwnMotion:
    """A motion whose flywheel is known less well: its errors grow by a share of the change to another motion.

    Without one, as if the irregularity changed by the share, and the mean speed by that share of the irregularity.
    """
    run, beside = motion.run, motion.run if other is None else other.run
    uneven, level = share, share * run.irregularity
    if other is not None:
        uneven *= abs(beside.irregularity - run.irregularity) / max(run.irregularity, ROUNDING)
        level = share * abs(other.speed / motion.speed - 1.0)
    each = zip(run.states_error, run.states, beside.states, strict=False)
    states = tuple(error + share * abs(to - at) for error, at, to in each)
    moved = abs(beside.angle_speed_max - run.angle_speed_max), abs(beside.angle_speed_min - run.angle_speed_min)
    run = loosened(run, uneven, level)._replace(states_error=states)
    cuts = motion.cuts_error + share * max(moved)
    return motion._replace(run=run, level_error=motion.level_error + level, cuts_error=cuts)


def _smallest(scene: Scene, search: Search) -> Steps[Smallest]:
    """The same from a search, for the flywheels that it has computed."""
    square = scene.flywheel_ratio**2
    spans, inertia, error = yield from first_kept(search, square)
    binding = next((name for name in spans for span in spans[name] if span.first == inertia and inertia > 0.0), None)
    point = yield from search.closely(inertia)
    if not point.motions:
        raise NoRegimeError(f"no steady motion with the flywheel of {inertia:.6g} kg m² on the crank")
    motion = point.motions[0]
    figures = dict(point.shares)
    if inertia > 0.0 and (scene.limits or point.error is None):  # what the error of the inertia makes of each
        for name, share in figures.items():
            figures[name] = share._replace(error=share.error + (yield from search.slope(name, point)) * error)
        beside, distance = (yield from search.beside(point)) or (None, 1.0)
        motion = _loosened(motion, None if beside is None else beside.motions[0], error / distance)
    kept = {name: next(span for span in spans[name] if span.state is LimitState.KEPT) for name in spans}
    limits = {name: _limit(scene.limits[name], figures[name], kept[name], square) for name in scene.limits}
    messages = [*gaps(spans, inertia, square)]
    plate = getattr(scene.motor, "line_current", None)  # of an induction motor
    if "current_pulsation" in spans and plate is not None and not plate.complete:
        part = "current_pulsation is that of the load's current alone: give power_factor or no_load_current for the whole"
        messages = [part, *messages]
    broken = broken_beyond(together(spans.values()), inertia, square)
    return Smallest(motion, error, limits, binding, broken, tuple(messages))


def _percent(share: float, error: float = 0.0) -> str:
    return f"{figure(100 * share, 100 * error, 6)} %"


def check_reached(search: Search, spans: Mapping[str, Sequence[Span]], square: float, *, duty: bool = False) -> None:
    """Refuses limits that no flywheel reaches.

    Args:
        search: the search.
        spans: where each limit is kept, by their names.
        square: of the speed of the flywheel's shaft over that of the inertias.
        duty: True if figures are those of a whole duty.

    """
    never = [name for name, each in spans.items() if not any(span.state is LimitState.KEPT for span in each)]
    if never:
        raise SceneError([_unreached(search, name, spans[name], square, duty=duty) for name in never])


def check_together(spans: Mapping[str, Sequence[Span]], square: float) -> None:
    """Refuses limits that some flywheels keep one by one, but none together."""
    if any(span.state is LimitState.KEPT for span in together(spans.values())):
        return
    ranges = "; ".join(
        f"{name} by {' or '.join(_range(span, square) for span in each if span.state is LimitState.KEPT)}"
        for name, each in spans.items()
    )
    defect = f"limits that no flywheel keeps together: {ranges}"
    raise SceneError([Fault("flywheel.limits", defect, "limits that one keeps", "allow more")])


def _unreached(search: Search, name: str, spans: Sequence[Span], square: float, *, duty: bool) -> Fault:
    """The fault of a limit that no flywheel reaches, with the best value possible."""
    (least, error, inertia), limit = search.best(name), _percent(search.limits[name])
    where = "at a constant speed" if inertia == np.inf else f"with a flywheel of {figure(inertia / square, most=5)} kg m^2"
    best = _percent(least, error)
    defect = f"{limit}, which no flywheel achieves: at best, {where}, it is {best}"
    if duty:
        defect = f"{limit}, which no flywheel achieves over the duty: at best, {where}, it is {best}"
    if unknown := _unknown(spans, square):
        defect = (
            f"{defect}; for flywheels of {unknown} it is unknown: no steady motion was found, and its absence was not shown"
        )
    return Fault(f"flywheel.limits.{name}", defect, "a limit above that", "give a larger motor, or allow it more")


def _range(span: Span, square: float) -> str:
    if span.last == np.inf:
        return f"{figure(span.first / square, most=5)} kg m^2 and more"
    return f"{figure(span.first / square, most=5)} to {figure(span.last / square, most=5)} kg m^2"


def _unknown(spans: Iterable[Span], square: float) -> str:
    """The flywheels whose state is unknown, in words; empty if there are none."""
    return " and ".join(_range(span, square) for span in spans if span.state is LimitState.UNKNOWN)


def gaps(spans: Mapping[str, Sequence[Span]], inertia: float, square: float) -> Iterator[str]:
    """Messages on lighter flywheels that stop, on heavier ones that fail, and on those that are unknown."""
    for name, each in spans.items():
        for before, span in pairwise(each):
            if before.state is LimitState.NONE and span.state is LimitState.KEPT and span.first == inertia:
                least = figure(inertia / square, most=5)
                yield f"{name} is kept by all flywheels with which the machine keeps turning, from {least} kg m^2 on"
        for span in each:
            if span.state in (LimitState.BROKEN, LimitState.NONE) and span.first >= inertia:
                yield f"{name} is not kept by heavier flywheels of {_range(span, square)}"
    if unknown := _unknown(together(spans.values()), square):
        yield f"whether flywheels of {unknown} keep it is unknown: no steady motion was found, and its absence was not shown"
