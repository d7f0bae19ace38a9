"""The smallest flywheel that keeps limits: an irregularity, and shares of what a motor is rated for.

Each limit's figure is taken along the steady periodic motion with a flywheel, the torque, heat and current of the motor at
its own speeds. With more inertia a machine runs more evenly, and most figures fall towards those of a constant speed; but
not all, and not always: a motor's current may swing with its rotor, and a load that grows with speed takes more of an even
motion. No figure is taken to fall, therefore. All are looked at on a grid of inertias, from one that leaves an irregularity
of about 0.001 down to the machine's own inertia and none, or to where the motion is very uneven and all limits are exceeded
ever more, a few a decade; beside each hump and hollow of a figure its extreme is looked for; and what lies beyond is told by
the figure at infinite inertia, to which it goes like 1/J. Between inertias on either side of a limit the crossing is found
by inverse interpolation, at the error asked for.

Source: R. P. Brent, Algorithms for Minimization without Derivatives, Prentice-Hall 1973, ch. 4 (inverse interpolation in a
bracket) and 5 (parabolas and golden sections).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property, partial
from itertools import pairwise

import numpy as np

from bondgraph.records import NamedTuple
from flywheel.machine.machine import Machine
from flywheel.numerics.budget import BudgetError, limited
from flywheel.numerics.cells import ROUNDING, Array, Cells
from flywheel.numerics.faults import Fault, SceneError
from flywheel.numerics.units import figure
from flywheel.regime import periodic_motion
from flywheel.regime.periodic_motion import Demand, NoRegimeError, OwnMotion
from flywheel.regime.wittenbauer import Figures
from flywheel.scene.scene import Scene
from flywheel.sizing.results import Limit, MotorShaft, Regime, heat_share

IRREGULARITY = "irregularity"

_COARSE = 1e-4  # error of motions that are only looked at
_PER_DECADE = 4
_LARGEST = 1e-3  # irregularity that the heaviest flywheel of the grid leaves, about
_LIGHT = 1e-2  # of the machine's own inertia: the lightest one, besides none
_HEAVY = 1e3  # times the heaviest of the grid: as good as infinite, up to what falls like 1/J
_SECOND = 1e-2  # of what falls so: what may fall faster, at those inertias
_LEAST = 1e-5  # of the heaviest: the lightest at the least, far below where such a machine stalls
_OF_EXTREME = 1e-3  # of an inertia: how near an extreme of a figure is looked for
_BESIDE = 1e-3  # of an inertia: how far off a slope is taken
_UNEVEN, _IN_TURN = 0.5, 3  # irregularity, and flywheels in turn, at which what is exceeded ever more is given up
_FEW = 24  # halvings of a bracket, or widenings of it
_MOST_STEPS, _THROUGH = 100, 4  # towards a crossing; flywheels that one is interpolated from
_APART = 1e-6  # of an inertia: flywheels nearer than this tell no slope
_GOLDEN = 0.381966011250105
_EDGE = 1e-4  # of an inertia: how near the lightest one is found with which the machine keeps turning


class Share(NamedTuple):
    """A figure that is limited, and its absolute error."""

    value: float
    error: float


class Kept(NamedTuple):
    """Inertias (kg m² on the crank) from `first` to `last` with which a limit is kept; `error` of `first`, relative.

    `lightest` tells that all flywheels keep it with which a steady motion was found, `first` being the lightest.
    """

    first: float
    last: float
    error: float
    lightest: bool = False


class Smallest(NamedTuple):
    """The motion with the smallest flywheel that keeps all limits, its relative error, the limits, and which one binds."""

    motion: OwnMotion
    error: float
    limits: Mapping[str, Limit]
    binding: str | None
    messages: tuple[str, ...] = ()


def of_motor(scene: Scene) -> tuple[str, ...]:
    """The limits of a scene that are those of its motor."""
    return tuple(name for name in scene.limits if name != IRREGULARITY)


# -- the figures along a motion ------------------------------------------------------------------------------------------


def shares(names: Iterable[str], shaft: MotorShaft) -> dict[str, Share]:
    """The figures that are limited, along a motion of the motor's shaft.

    motor_torque       max |T|/T_n
    motor_rms          sqrt((1/t) integral of T² dt)/T_n, over the period t of a cycle
    motor_heat         the mean heat over time, over that at the rated point
    current_pulsation  (max i - min i)/i_n

    Source: API 618, 5th ed., 7.1.2 (current pulsation); IEC 60034-1, 4.2.1 (equivalent loads of duty types).
    """
    found: dict[str, Share] = {}
    run, motor = shaft.run, shaft.motor
    for name in names:
        if name == IRREGULARITY:
            found[name] = Share(run.irregularity, run.error * run.irregularity)
            continue
        assert motor is not None
        assert motor.rated is not None
        rated = motor.rated.torque
        if name == "motor_torque":
            least, most, error = shaft.extremes(shaft.torque_law)
            found[name] = Share(max(most, -least) / rated, (error + shaft.torque_error) / rated)
        elif name == "motor_rms":
            square, error, _ = shaft.mean_over_time(partial(_squared, shaft.torque_law))
            root = float(np.sqrt(max(square, 0.0)))
            own = 0.5 * error / max(root, np.sqrt(error), 1e-300) + shaft.torque_error
            found[name] = Share(root / rated, own / rated)
        elif name == "motor_heat":
            found[name] = Share(*heat_share(motor, shaft))
        else:
            least, most, error = shaft.extremes(shaft.current_law)
            found[name] = Share(most - least, 2 * (error + shaft.torque_error / rated))  # a current is about as its torque
    return found


def _squared(law: Callable[[Cells, Array], tuple[Array, Array]], mesh: Cells, omega: Array) -> tuple[Array, Array]:
    value, slope = law(mesh, omega)
    return value * value, 2 * np.abs(value) * slope


def shares_along(machine: Machine, motion: OwnMotion, rtol: float) -> dict[str, Share]:
    """The figures of all limits of a machine's scene along a motion."""
    shaft = MotorShaft(machine.scene, motion.cycle, motion.run, motion.speed, rtol)
    return shares(machine.scene.limits, shaft)


def kept_alone(regime: Regime, omega: Array) -> dict[str, Limit] | None:
    """The limits of a scene where a machine without inertia keeps them without a flywheel; None where it does not.

    `omega` is the crank's speed at the cycle's nodes (rad/s).
    """
    scene, run, names = regime.machine.scene, regime.motion, regime.machine.scene.limits
    if not of_motor(scene):
        return {}
    assert run is not None
    found = shares(names, MotorShaft(scene, regime.cycle, run, regime.speed, regime.rtol, omega))
    if any(share.value - share.error > names[name] for name, share in found.items()):
        return None
    return {name: _limit(names[name], share, Kept(0.0, np.inf, share.error / names[name])) for name, share in found.items()}


def _limit(asked: float, share: Share, kept: Kept, square: float = 1.0) -> Limit:
    """A limit with the figure that is reached; `square` is that of the speed of the flywheel's shaft over the crank's."""
    return Limit(
        asked=asked,
        reached=share.value,
        alone=kept.first / square,
        reached_error=share.error / max(share.value, 1e-300),
        alone_error=kept.error,
    )


# -- the search ----------------------------------------------------------------------------------------------------------


class _Point(NamedTuple):
    """A flywheel (kg m² on the crank) with its motion and figures; without, where no steady motion was found with it."""

    inertia: float
    motion: OwnMotion | None = None
    shares: Mapping[str, Share] = {}

    def beyond(self, name: str, asked: float) -> float:
        """By how much a figure is beyond its limit: not above 0 where it is kept."""
        if self.motion is None:
            return np.inf
        share = self.shares[name]
        return 0.0 if abs(share.value - asked) <= share.error else share.value - asked


class _Search:
    """The figures of a machine over the inertia of its flywheel.

    Args:
        machine: the machine.
        figures: those at a constant speed.
        unknown: a first guess of the scene's unknown.
        rtol: relative error asked of the inertia.

    """

    def __init__(self, machine: Machine, figures: Figures, unknown: float, rtol: float) -> None:
        self.machine, self.unknown, self.rtol, self.speed = machine, unknown, rtol, figures.speed
        self.names = of_motor(machine.scene)
        self.held = figures.speed if machine.scene.unknown is not None else None
        own, extent = figures.reduced_inertia.greatest, figures.extent
        even = figures.fluctuation / (_LARGEST * figures.speed**2)
        self.heaviest = max(even, 10.0 * own) or 1.0
        self.lightest = max(_LIGHT * own, _LEAST * self.heaviest)
        self.turns_alone = extent.least > extent.error
        self.known: dict[float, _Point] = {}  # at the error asked for
        self.extremes: list[_Point] = []
        self.grid = self._scanned()

    def at(self, inertia: float, rtol: float, near: OwnMotion | None = None) -> _Point:
        """The figures with a flywheel, whose motion is found from one with another flywheel, or else from nothing."""
        try:
            with limited(periodic_motion.MOST_WORK):
                if near is None:
                    wanted = Demand(inertia, None, self.held)
                    motion = periodic_motion.own_motion(self.machine, self.speed, wanted, 0.0, self.unknown, rtol)
                else:
                    motion = periodic_motion.own_motion_near(self.machine, near, inertia, self.held, rtol)
        except (NoRegimeError, BudgetError):
            return _Point(inertia)
        return _Point(inertia, motion, shares_along(self.machine, motion, rtol))

    def closely(self, inertia: float) -> _Point:
        """The figures with a flywheel at the error asked for."""
        if inertia not in self.known:
            others = [point for point in (*self.known.values(), *self.grid) if point.motion is not None]
            nearest = min(others, key=lambda point: abs(self._scaled(point.inertia) - self._scaled(inertia)))
            found = self.at(inertia, 0.5 * self.rtol, nearest.motion)
            self.known[inertia] = found if found.motion is not None else self.at(inertia, 0.5 * self.rtol)
        return self.known[inertia]

    def _scaled(self, inertia: float) -> float:
        return float(np.log(inertia + self.lightest))

    def _inertia(self, scaled: float) -> float:
        return max(float(np.exp(scaled)) - self.lightest, 0.0)

    def _scanned(self) -> list[_Point]:
        """Flywheels of the grid, the lightest first; those lighter than one that no motion was found with are left out."""
        points = [self.at(self.heaviest, _COARSE)]
        if points[0].motion is None:
            raise NoRegimeError(f"no steady motion with a flywheel of {self.heaviest:.3g} kg m² on the crank")
        count = round(_PER_DECADE * float(np.log10(self.heaviest / self.lightest)))
        for inertia in np.geomspace(self.heaviest, self.lightest, count + 1).tolist()[1:]:
            point = self._lighter(points[-1], inertia)
            points.append(point)
            if point.motion is None or self._far_gone(points[-_IN_TURN:]):
                break
        last = points[-1]
        if last.motion is not None and not self._far_gone(points[-_IN_TURN:]):
            points.append(self._lighter(last, 0.0) if self.turns_alone else _Point(0.0))
        return points[::-1]

    def _far_gone(self, points: Sequence[_Point]) -> bool:
        """Whether a motion is very uneven and every limit exceeded, by ever more from each flywheel to the next lighter."""
        last, limits = points[-1], self.machine.scene.limits
        if len(points) < _IN_TURN or last.motion is None or last.motion.run.irregularity < _UNEVEN:
            return False
        return all(
            last.shares[name].value > limits[name]
            and all(after.shares[name].value > before.shares[name].value for before, after in pairwise(points))
            for name in self.names
        )

    def _lighter(self, heavier: _Point, inertia: float) -> _Point:
        """A lighter flywheel than one whose motion is known, if need be by way of one between."""
        point = self.at(inertia, _COARSE, heavier.motion)
        if point.motion is not None:
            return point
        between = self.at(
            self._inertia(0.5 * (self._scaled(heavier.inertia) + self._scaled(inertia))), _COARSE, heavier.motion
        )
        return point if between.motion is None else self.at(inertia, _COARSE, between.motion)

    @cached_property
    def ultimate(self) -> dict[str, Share]:
        """The figures at infinite inertia, from two that are nearly so: they go there like 1/J, or faster."""
        light, heavy = (self.closely(factor * _HEAVY * self.heaviest).shares for factor in (1.0, 2.0))
        found = {}
        for name in self.names if light and heavy else ():
            (first, first_error), (second, second_error) = light[name], heavy[name]
            found[name] = Share(2 * second - first, _SECOND * abs(second - first) + first_error + 2 * second_error)
        return found

    # -- where a limit is kept

    def kept(self, name: str, asked: float) -> list[Kept]:
        """The ranges of inertia in which a limit is kept, ascending."""
        found: list[Kept] = []
        first: Kept | None = None
        points = self._with_extremes(name, asked)
        if points[0].beyond(name, asked) <= 0.0:
            first = Kept(points[0].inertia, np.inf, points[0].shares[name].error / asked)
        for before, after in pairwise(points):
            if first is None and after.beyond(name, asked) <= 0.0:
                first = self._edge(before, after) if before.motion is None else self._from(name, asked, before, after)
            elif first is not None and after.beyond(name, asked) > 0.0:
                found.append(first._replace(last=self._crossing(name, asked, before, after)[0]))
                first = None
        last = points[-1]
        if first is not None:
            rises = len(points) > 1 and last.shares[name].value > points[-2].shares[name].value
            outlasted = rises and self._ultimately(name, asked) > 0.0
            found.append(first._replace(last=self._beyond(name, asked, last).first) if outlasted else first)
        elif self._ultimately(name, asked) < 0.0:
            found.append(self._beyond(name, asked, last))
        return found

    def _from(self, name: str, asked: float, before: _Point, after: _Point) -> Kept:
        """What is kept from the crossing between two flywheels on."""
        inertia, error = self._crossing(name, asked, before, after)
        return Kept(inertia, np.inf, error)

    def _ultimately(self, name: str, asked: float) -> float:
        """By how much a figure is beyond its limit at infinite inertia; nothing where its error leaves it open."""
        share = self.ultimate.get(name)
        return 0.0 if share is None or abs(share.value - asked) <= share.error else share.value - asked

    def _beyond(self, name: str, asked: float, last: _Point) -> Kept:
        """What would be kept from the crossing beyond the heaviest flywheel of the grid on."""
        share, ultimate = last.shares[name].value - asked, self._ultimately(name, asked)
        far = 2.0 * last.inertia * abs((share - ultimate) / ultimate)  # as what falls like 1/J goes there
        heavier = self.closely(max(far, 2.0 * last.inertia))
        for _ in range(_FEW):
            if (heavier.beyond(name, asked) > 0.0) != (share > 0.0):
                break
            heavier = self.closely(4.0 * heavier.inertia)
        return self._from(name, asked, last, heavier)

    def _crossing(self, name: str, asked: float, before: _Point, after: _Point) -> tuple[float, float]:
        """The inertia (kg m² on the crank) between two at which a figure is at its limit, and its relative error.

        By inverse interpolation from the flywheels whose figures are nearest to the limit, those of the grid at first; by
        halves where that leaves the bracket, or gains little.
        """
        low, high, rising = self._bracket(name, asked, before, after)
        known = {point.inertia: point for point in (*self.grid, before, after)}
        known |= {inertia: point for inertia, point in self.known.items() if point.motion is not None}
        values = {
            self._scaled(inertia): point.shares[name].value - asked
            for inertia, point in known.items()
            if point.motion is not None and abs(self._scaled(inertia) - 0.5 * (low + high)) <= 2.0 * (high - low)
        }
        sizes = [np.inf, np.inf]
        for _ in range(_MOST_STEPS):
            scaled = _interpolated(values)
            if not low < scaled < high or sizes[-1] > 0.25 * sizes[-2]:
                scaled, sizes = 0.5 * (low + high), [np.inf, np.inf]
            inertia = self._inertia(scaled)
            here = self.closely(inertia)
            if here.motion is None:
                off = np.inf
            else:
                off = values[scaled] = here.shares[name].value - asked
            if off == 0.0 or high - low <= 4 * ROUNDING * max(abs(low), abs(high)):
                break
            low, high = (low, scaled) if (off > 0.0) == rising else (scaled, high)
            within = here.motion is not None and abs(off) <= 0.3 * here.shares[name].error
            nearest = min(values, key=lambda each: abs(values[each]))  # where it is another, the zero is that of the others
            if within or (nearest == scaled and abs(_interpolated(values) - scaled) <= 0.02 * self.rtol):
                break
            sizes.append(abs(off))
        missed = here.shares[name].error + abs(here.shares[name].value - asked)
        return inertia, missed / max(self._slope(name, here), 1e-300) + 0.02 * self.rtol

    def _bracket(self, name: str, asked: float, before: _Point, after: _Point) -> tuple[float, float, bool]:
        """The two flywheels (scaled) between which a figure crosses its limit, and whether it rises there.

        What is looked at coarsely may lie on the other side by a little: the bracket is widened then.
        """
        rising = before.beyond(name, asked) <= 0.0

        def lies_beyond(point: _Point) -> bool:
            if point.motion is not None and point.beyond(name, asked) == 0.0:
                point = self.closely(point.inertia)
            return point.motion is None or point.shares[name].value > asked

        ends, width = [before, after], self._scaled(after.inertia) - self._scaled(before.inertia)
        for k in range(_FEW):
            good = [lies_beyond(ends[0]) != rising, lies_beyond(ends[1]) == rising]
            if all(good):
                break
            for end, sign in ((0, -1.0), (1, 1.0)):
                if not good[end]:
                    further = self._inertia(self._scaled(ends[end].inertia) + sign * 0.01 * width * 2**k)
                    ends[end] = self.closely(further)
        return self._scaled(ends[0].inertia), self._scaled(ends[1].inertia), rising

    def _slope(self, name: str, here: _Point) -> float:
        """|d figure/d ln J| at a flywheel, from the nearest one that is known as closely, or from one beside it."""
        value = here.shares[name].value
        apart = {
            abs(float(np.log(point.inertia / here.inertia))): point.shares[name].value
            for point in self.known.values()
            if point.motion is not None and point.inertia > 0.0
        }
        near = min((distance for distance in apart if distance > _APART), default=np.inf)
        if near <= 5 * _BESIDE:
            return abs(apart[near] - value) / near
        beside = self.closely(here.inertia * (1.0 + _BESIDE))
        return np.inf if beside.motion is None else abs(beside.shares[name].value - value) / _BESIDE

    def _edge(self, lost: _Point, found: _Point) -> Kept:
        """What is kept from the lightest flywheel with a steady motion on; its error tells how near the next one is."""
        light, heavy = lost.inertia, found
        for _ in range(_FEW):
            if heavy.inertia - light <= _EDGE * heavy.inertia:
                break
            middle = self.at(self._inertia(0.5 * (self._scaled(light) + self._scaled(heavy.inertia))), _COARSE, heavy.motion)
            light, heavy = (middle.inertia, heavy) if middle.motion is None else (light, middle)
        return Kept(heavy.inertia, np.inf, (heavy.inertia - light) / heavy.inertia, lightest=True)

    def _with_extremes(self, name: str, asked: float) -> list[_Point]:
        """The flywheels of the grid, with those at which the figure may pass its limit and come back between two of them."""
        found = list(self.grid)
        for low, middle, high in zip(self.grid, self.grid[1:], self.grid[2:], strict=False):
            if low.motion is None or middle.motion is None or high.motion is None:
                continue
            values = np.array([point.shares[name].value - asked for point in (low, middle, high)])
            sign = 1.0 if (values > 0.0).all() else -1.0 if (values <= 0.0).all() else 0.0
            depth = (sign * (values[[0, 2]] - values[1])).min()
            if sign and depth > 0.0 and np.abs(values[1]) <= np.abs(values[[0, 2]] - values[1]).max():
                found.append(self._extreme(name, asked, sign, (low, middle, high)))
        return sorted(found, key=lambda point: point.inertia)

    def _extreme(self, name: str, asked: float, sign: float, points: Sequence[_Point]) -> _Point:
        """The flywheel with which a figure is least (sign +1) or greatest, or one that lies beyond the limit already.

        Args:
            name: of the limit.
            asked: the limit.
            sign: +1 for a least figure, -1 for a greatest one.
            points: three flywheels, the middle one with the least figure, or the greatest.

        """
        by_scale = {self._scaled(point.inertia): point for point in points}
        values = {scaled: sign * point.shares[name].value for scaled, point in by_scale.items()}
        (low, best, high), middle = sorted(values), points[1]
        for _ in range(_MOST_STEPS):
            if high - low <= 2 * _OF_EXTREME or values[best] < sign * asked:
                break
            scaled = _vertex([(each, values[each]) for each in (low, best, high)])
            if not low < scaled < high or abs(scaled - best) < 0.5 * _OF_EXTREME:  # into the wider part
                scaled = best + _GOLDEN * (high - best if high - best > best - low else low - best)
            here = by_scale[scaled] = self.at(self._inertia(scaled), _COARSE, middle.motion)
            if here.motion is None:
                return middle
            values[scaled] = sign * here.shares[name].value
            inside = sorted((low, best, scaled, high))
            place = 1 if values[inside[1]] <= values[inside[2]] else 2
            low, best, high = inside[place - 1 : place + 2]
        self.extremes.append(by_scale[best])
        return by_scale[best]

    def best(self, name: str) -> tuple[float, float, float]:
        """The least figure that any flywheel gives, its error, and that flywheel's inertia (kg m² on the crank)."""
        found = [(*point.shares[name], point.inertia) for point in (*self.grid, *self.extremes) if point.motion]
        if name in self.ultimate:
            found.append((*self.ultimate[name], np.inf))
        return min(found)


def _interpolated(values: Mapping[float, float]) -> float:
    """Where a function is zero, by the polynomial of the abscissa through those of its values that are nearest to zero."""
    nearest = sorted(values, key=lambda each: abs(values[each]))[:_THROUGH]
    total = 0.0
    for each in nearest:
        for other in nearest:
            if other != each and values[other] == values[each]:
                return np.nan
        total += each * float(np.prod([values[k] / (values[k] - values[each]) for k in nearest if k != each]))
    return total


def _vertex(points: Sequence[tuple[float, float]]) -> float:
    """The abscissa of the vertex of the parabola through three points, the middle one of which is the least."""
    (a, at_a), (b, at_b), (c, at_c) = points
    left, right = (b - a) * (at_b - at_c), (b - c) * (at_b - at_a)
    return b - 0.5 * ((b - a) * left - (b - c) * right) / (left - right) if left != right else np.nan


def smallest(machine: Machine, figures: Figures, unknown: float, rtol: float, by_irregularity: OwnMotion | None) -> Smallest:
    """The motion with the smallest flywheel that keeps all limits of a scene.

    Args:
        machine: a machine whose torques depend on speed.
        figures: those at a constant speed.
        unknown: a first guess of the scene's unknown.
        rtol: relative error asked of the inertia.
        by_irregularity: the motion with the flywheel that the irregularity alone asks for, where one is limited.

    Raises:
        SceneError: for limits that no flywheel reaches, or that none keeps together.
        NoRegimeError: where even a heavy flywheel leaves no steady motion.

    """
    scene, search = machine.scene, _Search(machine, figures, unknown, rtol)
    kept = {name: search.kept(name, scene.limits[name]) for name in search.names}
    if faults := [_unreached(search, name, scene.limits[name]) for name, ranges in kept.items() if not ranges]:
        raise SceneError(faults)
    if by_irregularity is not None:
        off = by_irregularity.inertia_error if by_irregularity.inertia > 0.0 else by_irregularity.run.error
        kept[IRREGULARITY] = [Kept(max(by_irregularity.inertia, 0.0), np.inf, off)]
    kept = {name: kept[name] for name in scene.limits}
    firsts = sorted((span.first, span.error, name) for name, ranges in kept.items() for span in ranges)
    common = [first for first in firsts if all(_holds(ranges, first[0]) for ranges in kept.values())]
    if not common:
        raise SceneError([_apart(scene, kept)])
    inertia, error, binding = common[0]
    if by_irregularity is not None and inertia == kept[IRREGULARITY][0].first:
        motion = by_irregularity
    else:
        closely = search.closely(inertia).motion
        if closely is None:
            raise NoRegimeError(f"no steady motion with the flywheel of {inertia:.6g} kg m² on the crank")
        motion = closely
    square = scene.flywheel_ratio**2
    found = shares_along(machine, motion, rtol)
    if inertia > 0.0:  # what the error of the inertia makes of each
        beside = search.closely(inertia * (1.0 + _BESIDE)).shares
        moved = {name: abs(beside[name].value - share.value) / _BESIDE * error for name, share in found.items() if beside}
        found = {name: share._replace(error=share.error + moved.get(name, 0.0)) for name, share in found.items()}
    limits = {name: _limit(scene.limits[name], share, kept[name][0], square) for name, share in found.items()}
    return Smallest(motion, error, limits, binding if inertia > 0.0 else None, tuple(_told(scene, kept, inertia)))


def _holds(ranges: Sequence[Kept], inertia: float) -> bool:
    return any(span.first <= inertia <= span.last for span in ranges)


def _percent(share: float, error: float = 0.0) -> str:
    return f"{figure(100 * share, 100 * error, 6)} %"


def _unreached(search: _Search, name: str, asked: float) -> Fault:
    """The fault of a limit that no flywheel reaches, with the best that there is."""
    best, error, inertia = search.best(name)
    square = search.machine.scene.flywheel_ratio**2
    where = "at a constant speed" if inertia == np.inf else f"with a flywheel of {figure(inertia / square, most=5)} kg m^2"
    found = f"{_percent(asked)}, which no flywheel reaches: at best, {where}, it is {_percent(best, error)}"
    return Fault(f"flywheel.limits.{name}", found, "a limit above that", "give a larger motor, or allow it more")


def _apart(scene: Scene, kept: Mapping[str, Sequence[Kept]]) -> Fault:
    """The fault of limits that are kept each by some flywheels, but by none together."""
    square = scene.flywheel_ratio**2
    told = "; ".join(
        f"{name} by {' or '.join(_range(span.first / square, span.last / square) for span in ranges)}"
        for name, ranges in kept.items()
    )
    return Fault("flywheel.limits", f"limits that no flywheel keeps together: {told}", "limits that one keeps", "allow more")


def _range(first: float, last: float) -> str:
    if last == np.inf:
        return f"{figure(first, most=5)} kg m^2 and more"
    return f"{figure(first, most=5)} to {figure(last, most=5)} kg m^2"


def _told(scene: Scene, kept: Mapping[str, Sequence[Kept]], inertia: float) -> Iterable[str]:
    """What is to be said of a current that is not known whole, of flywheels that stall, of heavier ones that fail."""
    square, plate = scene.flywheel_ratio**2, getattr(scene.motor, "line_current", None)  # of an induction motor
    if "current_pulsation" in kept and plate is not None and not plate.complete:
        yield "current_pulsation is that of the load's current alone: give power_factor or no_load_current for the whole"
    for name, ranges in kept.items():
        if ranges[0].lightest:
            least = figure(ranges[0].first / square, most=5)
            yield f"{name} is kept by all flywheels with which a steady motion was found, from {least} kg m^2 on"
        rest = [span for span in ranges if span.last >= inertia]
        ends = [*(span.first for span in rest[1:]), np.inf]
        for span, further in zip(rest, ends, strict=True):
            if span.last < np.inf:
                yield f"{name} is not kept by heavier flywheels of {_range(span.last / square, further / square)}"
