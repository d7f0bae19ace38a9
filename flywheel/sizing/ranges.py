"""Figures over ranges of numbers: extremes of a cycle and speeds of a steady motion, with slopes all over the ranges.

`RangeEnds` makes intervals of such figures that are hardly wider than the figures: it halves ranges where slopes leave much
open. Positions are shares of the smooth pieces between edges, which move with the numbers, so that all vary smoothly with
them (`flywheel.numerics.ranges`).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import pairwise, product
from typing import Any, NamedTuple

from bondgraph.recording import Program
from flywheel.machine.programs import StretchWalk, Structure
from flywheel.numerics import balls
from flywheel.numerics.balls import Model, UnprovenError, rational
from flywheel.numerics.jets import Jet, value_of
from flywheel.numerics.ranges import Centred, CurveOverRanges, implicit_slopes, over_ranges, slopes_at_greatest, transported
from flywheel.sizing.enclosures import (
    INERTIA,
    MOMENT,
    ROWS,
    EnergyLaw,
    EnergySums,
    MotionPlace,
    Motions,
    SpeedBalls,
    cells_of,
    marks_of,
    over_balls,
    rate_functions,
    rows_of,
    sides_kept,
    unevenness,
)

START, WHEEL, BALANCE = "start", "wheel", "unknown"  # numbers of a motion: v at its beginning, flywheel, unknown
_OVER_RANGES = 1e-7  # what cells leave open of slopes by numbers in ranges
_MOST_WIDER = 5  # tries to enclose the irregularities over ranges
OF_CYCLE, OF_MOTION = (24.0, 1.05), (2.0, 1.1)  # parts of ranges at most; over a figure's proven width: enough
_OF_POINT = 0.2  # a part without ranges, beside one with them
_REST = 0.03  # of what a number follows others by: what may be left, that is tried first
_MARGIN = 1.25  # of what motions may be apart over what they are: the radius that is tried next
_WIDEST_OPEN, _WIDEST_HULL = 0.05, 0.02  # rad: cells in which a mesh, or a switch, may change its side
_NARROWEST = 1e-3  # rad: cells that are not halved further
_NARROW = 1e-6  # of a figure: a width that does not count


def widths(found: Mapping[str, Any], scales: Mapping[str, float]) -> dict[str, float]:
    """The width of every ball over the figure, or, where that may be 0, over its scale.

    scales: of figures by their keys; those of works have the fluctuation, of flywheels their total, of I* its greatest.
    """
    others = dict.fromkeys(("accumulated_max", "accumulated_min"), "energy_fluctuation")
    others |= {"reduced_inertia.min": "reduced_inertia.max"}
    others |= {name: "flywheel.approximate_total" for name in found if name.startswith("flywheel.")}
    widths = {}
    for name, ball in found.items():
        size = abs(float(ball.mid()))
        if ball.contains(0):
            other = found.get(others.get(name, name), ball)
            size = max(size, scales.get(name, 0.0), 0.0 if other.contains(0) else abs(float(other.mid())))
        widths[name] = 0.0 if ball.rad().is_zero() else 2.0 * float(ball.rad()) / max(size, 1e-300)
    return widths


Part = tuple[tuple[float, float], ...]  # of ranges: the middle of each and half its width, as shares of half the range


class RangeEnds:
    """Both ends of figures over ranges of numbers, by their slopes in parts of the ranges.

    Where a figure is proven to rise with a number all over a part, it is greatest at the upper end of that number's range,
    so that the number's own effect leaves nothing open; a number of which that is not proven adds its greatest slope times
    half its range.
    """

    def __init__(
        self, figures: Callable[[Part], dict[str, Any]], numbers: Sequence[Any], most: float, enough: float
    ) -> None:
        self._most, self._enough = most, enough
        self._figures, self._numbers, self._parts = figures, numbers, dict[Part, dict[str, Any]]()
        self._whole: Part = ((0.0, 1.0),) * len(numbers)
        whole = self._in(self._whole)
        self.names = tuple(whole)
        self._bounds = {
            (name, side): {self._whole: (side * whole[name].value).upper()} for name in whole for side in (-1, 1)
        }
        self._sharp = set[tuple[str, int, Part]]()

    def _in(self, part: Part) -> dict[str, Any]:
        """The figures over a part, calculated once."""
        if part not in self._parts:
            self._parts[part] = self._figures(part)
        return self._parts[part]

    def _bound(self, name: str, side: int) -> Any:
        return max(self._bounds[name, side].values())

    def _reached(self, name: str, side: int) -> Any:
        return max((side * figures[name].middle).lower() for figures in self._parts.values())

    def _least_width(self, name: str) -> Any:
        """The width that a figure is proven to have, by its values at middles and ends or by its slopes."""
        figure = self._in(self._whole)[name]
        by_slopes = sum((2 * slope.abs_lower() * figure.halves[k] for k, slope in figure.slopes.items()), rational(0, 1))
        return (self._reached(name, 1) + self._reached(name, -1)).max(by_slopes)

    def _excess(self, name: str) -> float:
        """The width of a figure's interval over the least width that it is proven to have."""
        least = self._least_width(name)
        return float((self._bound(name, 1) + self._bound(name, -1)) / least) if least > 0 else math.inf

    def interval(self, name: str) -> Any:
        """The ball of a figure all over the ranges."""
        return (-self._bound(name, -1)).union(self._bound(name, 1))

    def narrow(self, scales: Mapping[str, float]) -> None:
        """Makes intervals narrower that are wider than the figures: halves the range that is open for most of their ends."""
        open_still = widths({name: figure.value for name, figure in self._in(self._whole).items()}, scales)
        wide = [name for name, width in open_still.items() if width > _NARROW]
        while True:
            wide = [name for name in wide if self._excess(name) > self._enough]
            votes = Counter[tuple[Part, int]]()
            for name, side in product(wide, (-1, 1)):
                bounds = self._bounds[name, side]
                while (name, side, part := max(bounds, key=bounds.__getitem__)) not in self._sharp:
                    self._sharpen(name, side, part)
                gap, least = bounds[part] - self._reached(name, side), (self._enough - 1) / 2 * self._least_width(name)
                if gap > least and (k := self._open(name, part)) is not None:
                    votes[part, k] += 1
            cost = sum(1.0 if any(half for _, half in part) else _OF_POINT for part in self._parts)
            if not votes or cost >= self._most:
                return
            self._halve(*votes.most_common(1)[0][0])

    def _slopes(self, name: str, part: Part) -> list[Any]:
        figure = self._in(part)[name]
        return [figure.slopes.get(k, rational(0, 1)) for k in self._numbers]

    def _sharpen(self, name: str, side: int, part: Part) -> None:
        """Bounds side times a figure over a part by its value where numbers are at the ends that are proven."""
        corner, rest = [], rational(0, 1)
        halves = self._in(part)[name].halves
        for k, slope, (middle, half) in zip(self._numbers, self._slopes(name, part), part, strict=True):
            way = 1 if side * slope >= 0 else -1 if side * slope <= 0 else 0
            corner.append((middle + way * half, 0.0))
            rest += 0 if way else abs(slope).upper() * halves.get(k, 0)
        value = (side * self._in(tuple(corner))[name].value + rest).upper()
        self._bounds[name, side][part] = self._bounds[name, side][part].min(value)
        self._sharp.add((name, side, part))

    def _open(self, name: str, part: Part) -> int | None:
        """The range in a part whose effect on a figure is most uncertain; None where no effect is."""
        halves, slopes = self._in(part)[name].halves, self._slopes(name, part)
        effects = {
            k: abs(slope).upper() * halves[self._numbers[k]]
            for k, slope in enumerate(slopes)
            if not (slope >= 0 or slope <= 0)
        }
        return max(effects, key=effects.__getitem__, default=None)

    def _halve(self, part: Part, k: int) -> None:
        """Halves a range of a part for all figures."""
        owners = [(key, bounds, bounds.pop(part)) for key, bounds in self._bounds.items() if part in bounds]
        for own in halves_of(part, k):
            for (name, side), bounds, before in owners:
                bounds[own] = before.min((side * self._in(own)[name].value).upper())


def halves_of(part: Part, k: int) -> list[Part]:
    """Both halves of a part, of the range of one number.

    >>> halves_of(((0.0, 1.0), (0.5, 0.5)), 0)
    [((-0.5, 0.5), (0.5, 0.5)), ((0.5, 0.5), (0.5, 0.5))]
    """
    middle, half = part[k]
    return [(*part[:k], (middle + way * half / 2, half / 2), *part[k + 1 :]) for way in (-1, 1)]


def program_over_ranges(program: Program, at: Any, columns: Sequence[Any]) -> list[Any]:
    """The outputs of a program at a position all over the ranges of numbers."""
    return over_ranges(over_balls(program), over_balls(program, functions=balls.JETS), at, columns)


def _edges_over_ranges(structure: Structure, columns: Sequence[Any], origin: Any) -> Iterator[Any]:
    """Edges of smooth pieces all over the ranges of numbers."""
    for angle, formula in marks_of(structure, [getattr(one, "middle", one) for one in columns]):
        yield program_over_ranges(formula, origin, columns)[0] if formula else Centred(angle, {}, origin.halves)


class SumsOverRanges:
    """The extremes of a cycle all over the ranges of numbers, with `balance`.

    Positions are shares of the smooth pieces between edges, which move with the numbers, so that all sums vary smoothly with
    them.
    """

    def __init__(self, structure: Structure, columns: Sequence[Any], origin: Any, middle: EnergySums, order: int) -> None:
        self._middle, self._halves = middle, origin.halves
        edges = list(_edges_over_ranges(structure, columns, origin))
        for low, high in pairwise(edges):
            if not high - low > 0:
                raise UnprovenError("ranges of numbers in which angles at which loads break change their order")
        walks = structure.walks
        pieces = [_piece(k, *each, columns) for k, each in enumerate(zip(walks, pairwise(edges), strict=True))]
        cells = cells_of(pieces, [rational(k, 1) for k in range(len(edges))], order, _OVER_RANGES)
        energies, totals, parts = [origin, origin], [origin, origin], list[tuple[Any, ...]]()
        for cell in cells:
            k = int(float(cell.middle))
            if cell.low == k > 0:
                totals = [
                    total + jump
                    for total, jump in zip(totals, _jumps(walks[k - 1], walks[k], edges[k], columns), strict=True)
                ]
            inertia, *moments = self._rows(cell)
            slope = inertia.each(lambda own: own.derivative())
            energies = [moment.each(cell.rising) + total for moment, total in zip(moments, totals, strict=True)]
            totals = [energy.each(cell.at_end) for energy in energies]
            parts.append((cell, *_moved(cell, edges), energies, moments, inertia, slope))
        net, effect = totals
        self.balance = -net / effect if structure.unknown else origin
        self._curves = list[tuple[Any, ...]]()
        for *place, energies, moments, inertia, slope in parts:
            work, moment = (own + self.balance * of_unknown for own, of_unknown in (energies, moments))
            self._curves.append((*place, work, moment, inertia, slope))

    def _rows(self, cell: Model) -> list[Any]:
        """The rows of a machine as polynomials in a cell."""
        middles, wholes, *slopes = (cell.polynomials[k : k + len(ROWS)] for k in range(0, len(cell.polynomials), len(ROWS)))
        rows = zip(middles, wholes, *slopes, strict=True)
        return [
            Centred(one, dict(zip(self._halves, own, strict=True)), self._halves, all_over) for one, all_over, *own in rows
        ]

    def greatest(self, energy: Any, inertia: Any, left: float, sign: int = 1) -> Any:
        """The greatest of sign (energy W + inertia I*)."""
        found = []
        of_energy, of_inertia = (getattr(factor, "middle", factor) for factor in (energy, inertia))
        middle = self._middle.greatest(of_energy, of_inertia, left, sign)
        for cell, breaks, moved, inverse, work, moment, own, own_slope in self._curves:
            value, slope = sign * (energy * work + inertia * own), sign * (energy * moment + inertia * own_slope)
            curve = balls.BallCurve(cell.low - cell.middle, cell.high - cell.middle, value.middle, slope.middle)
            found.append(CurveOverRanges(curve, value.slopes, slope.value * inverse, moved, breaks))
        return Centred(middle, slopes_at_greatest(found, self._halves), self._halves)

    def irregularity(self, speed: Any, wheel: Any, bounds: tuple[Any, Any], left: float) -> Any:
        """The irregularity e with a given flywheel (as in `EnergySums`).

        Its slopes are -g_k/g_e, by the implicit function theorem, in a range of e that contains all results.
        """
        least, most = (bound.middle for bound in bounds)
        middle = self._middle.irregularity(speed.middle, wheel.middle, (least, most), left)
        reach, per_square = rational(0, 1), 1 / speed**2
        try:
            for _ in range(_MOST_WIDER):
                self._halves["eps"] = reach
                at = Centred(middle, {"eps": rational(1, 1)}, self._halves)
                slopes = (unevenness(self, at, per_square, left) - at * wheel).slopes
                steep = slopes.pop("eps")
                if not steep < 0:
                    break
                eps = Centred(middle, {k: -slope / steep for k, slope in slopes.items()}, self._halves)
                apart = (eps.value - middle).abs_upper()
                if apart < reach:
                    return eps
                reach = 2 * apart
        finally:
            del self._halves["eps"]
        raise UnprovenError("the motions over ranges so wide")


def _moved(cell: Model, edges: Sequence[Any]) -> tuple[list[Any], dict[Any, Any], Any]:
    """The ends of a cell that are edges, as distances from its middle; phi_k by which edges move it, and ds/dphi."""
    k = int(float(cell.middle))
    low, length = edges[k], edges[k + 1] - edges[k]
    breaks = [end - cell.middle for end in (cell.low, cell.high) if end in (k, k + 1)]
    moved = (low + (cell.middle - k) * length).slopes
    return breaks, {n: balls.line(moved.get(n, 0), length.slopes.get(n, 0)) for n in moved | length.slopes}, 1 / length.value


def _jumps(before: StretchWalk, after: StretchWalk, edge: Any, columns: Sequence[Any]) -> list[Any]:
    """Growth of the works of M* and of the unknown's share of it at a position beyond an edge that moves."""
    sides = (program_over_ranges(rows_of(walk), edge, columns)[MOMENT:] for walk in (before, after))
    steps = [left.value - right.value for left, right in zip(*sides, strict=True)]
    return [Centred(0 * step, {k: step * part for k, part in edge.slopes.items()}, edge.halves, 0 * step) for step in steps]


def _piece(k: int, walk: StretchWalk, ends: tuple[Any, Any], columns: Sequence[Any]) -> Callable[[Any], list[Any]]:
    """I*, M* dphi/ds and the unknown's share of it at s from k to k + 1, where phi runs from end to end.

    At the middles of ranges of numbers, then all over them, then their slopes at a given phi by one number after another.
    """
    program, (low, high) = rows_of(walk), ends
    plain, of_jets = over_balls(program), over_balls(program, functions=balls.JETS)
    length, zero = high - low, rational(0, 1)
    wide = length.value

    def rows(place: Any) -> list[Any]:
        found = over_ranges(plain, of_jets, low + (place - k) * length, columns)
        middles, wholes = ([1, span, span] for span in (length.middle, wide))
        values = [row.middle * factor for row, factor in zip(found, middles, strict=True)]
        values += [row.value * factor for row, factor in zip(found, wholes, strict=True)]
        return values + [row.slopes.get(n, zero) * wide ** (m > 0) for n in length.halves for m, row in enumerate(found)]

    return rows


# -- the motion where torques depend on speed --------------------------------------------------------------------------


class _WidePlace(NamedTuple):
    """A cell of a motion all over the ranges of numbers: dphi/dx, the plain laws, and for each number those of jets by it.

    `inertia` is the polynomial of I*, `inertias` those of its slopes; `breaks` are its ends that are edges of pieces.
    """

    place: MotionPlace
    growth: Centred
    laws: list[EnergyLaw]
    jets: dict[Any, list[EnergyLaw]]
    inertia: Any
    inertias: dict[Any, Any]
    breaks: list[Any]


_Free = tuple[Centred, Centred, SpeedBalls]  # flywheel at the crank (kg m²), unknown of the loads, speeds
_Missed = Callable[[SpeedBalls], list[Centred]]


class MotionsOverRanges:
    """The extreme speeds of a steady motion all over the ranges of numbers, of its flywheel and of its unknown.

    With phi = phi_0 + (x - x_0) r in a piece, whose ends move with numbers p, v = ½ omega² follows dv/dx = F(x, v, p), and
    its slopes by numbers dv_k/dx = dF/dv v_k + F_k. While these slopes, over all v within a radius of the motion at the
    middles of the ranges, keep v within less than that radius, no motion in the ranges leaves it.
    """

    def __init__(self, structure: Structure, columns: Sequence[Any], origin: Centred, motions: Motions, order: int) -> None:
        assert structure.efficiencies is not None
        self._columns, self._halves, self._order, self._radius = columns, origin.halves, order, rational(0, 1)
        self._free = [own for own in origin.halves if isinstance(own, str)]
        self._starts = {START: rational(1, 1)}  # slopes by which v at the start follows numbers
        self._edges, self._stages = list(_edges_over_ranges(structure, columns, origin)), structure.twin.stages
        if not all(high - low > 0 for low, high in pairwise(self._edges)):
            raise UnprovenError("ranges of numbers in which angles at which loads break change their order")
        self._efficiencies = program_over_ranges(structure.efficiencies, origin, columns)
        self._pieces = [
            [rate_functions(walk, len(self._stages), functions) for functions in (balls.NAMESPACE, balls.JETS)]
            for walk in structure.walks
        ]
        self._places = [wide for place in motions.places() for wide in self._over_ranges(place)]

    def _over_ranges(self, place: MotionPlace) -> list[_WidePlace]:
        """A cell of the motion at the middles all over the ranges, in parts where it is too wide."""
        try:
            return [self._widened(place)]
        except (ArithmeticError, ValueError):  # UnprovenError is one
            return self._in_halves(place)

    def _in_halves(self, place: MotionPlace) -> list[_WidePlace]:
        """Both halves of a cell all over the ranges; an UnprovenError where it is too narrow for that."""
        if not place.cell.high - place.cell.low > _NARROWEST:
            raise UnprovenError("the motions over ranges so wide")
        return [wide for half in _halved(place) for wide in self._over_ranges(half)]

    def _widened(self, place: MotionPlace) -> _WidePlace:
        cell, (low, high) = place.cell, self._edges[place.piece : place.piece + 2]
        growth = (high - low) / (high - low).middle
        angles = [low + (x - low.middle) * growth for x in (cell.middle, cell.low.union(cell.high))]
        laws, *jets = ([self._law(place, phi, growth, k) for phi in angles] for k in (None, *self._halves))
        by_number = dict(zip(self._halves, jets, strict=True))
        inertias = {k: self._enclosing(_slope(law.inertia) for law in own) for k, own in by_number.items()}
        ends = [end for end in (cell.low, cell.high) if any(end.overlaps(edge.middle) for edge in (low, high))]
        inertia, breaks = self._enclosing(law.inertia for law in laws), [end - cell.middle for end in ends]
        return _WidePlace(place, growth, laws, by_number, inertia, inertias, breaks)

    def _law(self, place: MotionPlace, phi: Centred, growth: Centred, k: Any) -> EnergyLaw:
        """The law about an angle, as it changes with x, of jets by a number k; plain without one."""

        def own(number: Any) -> Any:
            return number if not isinstance(number, Centred) else number.value if k is None else number.jet(k)

        at, rate, numbers = own(phi), own(growth), [own(each) for each in self._columns]
        moves = any(isinstance(each, Jet) for each in (at, rate, *numbers))
        functions, (*_, late) = self._pieces[place.piece][moves], self._pieces[place.piece][k is not None]
        line = balls.series(balls.line(value_of(at), value_of(rate)), self._order)
        if isinstance(at, Jet) or isinstance(rate, Jet):
            line = Jet(line, balls.series(balls.line(_slope(at), _slope(rate)), self._order))
        stages = zip(self._stages, map(own, self._efficiencies), strict=True)
        own_stages = tuple(stage._replace(efficiency=each) for stage, each in stages)
        inertia, slope = functions[0](line, *numbers)
        law = place.law._replace(stages=own_stages, inertia=inertia, slope=slope, known=functions[1](line, *numbers))
        return law._replace(late=late, span=place.cell.span)

    def _enclosing(self, pair: Iterable[Any]) -> Any:
        about, all_over = pair
        return balls.enclosing(about, all_over, self._order)

    def _greatest(self, rows: Iterable[tuple[Any, Any, Any]], sign: int) -> dict[Any, Any]:
        """Slopes of the greatest value of sign times a function, from its values, slopes by numbers and slope in cells."""
        curves = list[CurveOverRanges]()
        for each, (value, slopes, steep) in zip(self._places, rows, strict=True):
            cell = each.place.cell
            low, high = cell.low - cell.middle, cell.high - cell.middle
            curve = balls.BallCurve(low, high, sign * value, sign * value.derivative())
            curves.append(
                CurveOverRanges(curve, {k: sign * own for k, own in slopes.items()}, sign * steep, {}, each.breaks)
            )
        return {k: sign * slope for k, slope in slopes_at_greatest(curves, self._halves).items()}

    def inertias(self, least: Any, most: Any) -> tuple[Centred, Centred]:
        """The least and the greatest I*, from those at the middles."""
        rows = [(each.place.cell.polynomials[INERTIA], each.inertias, each.inertia.derivative()) for each in self._places]
        low, high = (self._greatest(rows, sign) for sign in (-1, 1))
        return Centred(least, low, self._halves), Centred(most, high, self._halves)

    def slopes(self, free: _Free, missed: _Missed, ranges: Mapping[Any, Any]) -> tuple[dict[Any, dict[Any, Any]], Any]:
        """Slopes by which what is free follows other numbers, and how far v moves in ranges of these, not proven.

        Args:
            free: the flywheel, the unknown and the speeds at the middles.
            missed: what the free numbers make 0.
            ranges: half the width of the range of each other number.

        """
        paths, found, gap = self._along(*free)
        follow = implicit_slopes([gap, *missed(found)], self._free, [*ranges])
        slopes = {own: {k: slope.mid() for k, slope in rates.items()} for own, rates in follow.items()}
        return slopes, self._apart(paths, follow, ranges)

    def steady(
        self, free: _Free, missed: _Missed, slopes: dict[Any, dict[Any, Any]], apart: Any
    ) -> tuple[_Free, dict[Any, dict[Any, Any]]]:
        """The flywheel, the unknown and the extreme speeds, and slopes by which what is free follows the other numbers.

        Free are v at the start and, as numbers of their own, the flywheel and the unknown where they follow. They have
        slopes by the others; what stays free hardly varies.

        Args:
            free: the flywheel, the unknown and the speeds at the middles.
            missed: what the free numbers make 0.
            slopes: about those of free numbers.
            apart: about how far v moves.

        Raises UnprovenError where not all motions over the ranges are proven to be near.

        """
        wheel, unknown, near = free
        wheel, unknown = (_along_with(one, slopes.get(own, {})) for one, own in ((wheel, WHEEL), (unknown, BALANCE)))
        halves, numbers = self._halves, {k: half for k, half in self._halves.items() if k not in self._free}
        self._starts |= slopes[START]
        self._radius = (_MARGIN * apart).upper()
        for own in self._free:
            halves[own] = _REST * sum((abs(slopes[own][k]) * half for k, half in numbers.items()), rational(0, 1))
        for _ in range(_MOST_WIDER):
            paths, found, gap = self._along(wheel, unknown, near)
            follow = implicit_slopes([gap, *missed(found)], self._free, [*numbers])
            moved = {own: Centred(rational(0, 1), rates, numbers).value.abs_upper() for own, rates in follow.items()}
            apart = self._apart(paths, follow, numbers)
            fades = BALANCE in self._free or gap.slopes[START] < 0  # a balance holds the speed
            if not (fades and all(each.is_finite() for each in (apart, *moved.values()))):
                break
            if apart < self._radius and all(moved[own] < halves[own] for own in self._free):
                return (wheel, unknown, found), follow
            self._radius = self._radius.max((_MARGIN * apart).upper())
            halves.update({own: halves[own].max((_MARGIN * rest).upper()) for own, rest in moved.items()})
        raise UnprovenError("the motions over ranges so wide")

    def _apart(self, paths: dict[Any, list[Any]], follow: dict[Any, dict[Any, Any]], ranges: Mapping[Any, Any]) -> Any:
        """The greatest distance by which v moves in ranges of numbers that free ones follow."""
        most = rational(0, 1)
        for n, each in enumerate(self._places):
            moved = {k: own[n](each.place.cell.span) for k, own in paths.items()}
            most = most.max(Centred(rational(0, 1), moved, self._halves).followed(follow, dict(ranges)).value.abs_upper())
        return most

    def _along(self, wheel: Centred, unknown: Centred, near: SpeedBalls) -> tuple[dict[Any, list[Any]], SpeedBalls, Centred]:
        """Slopes of v in each cell by numbers, the extreme speeds, and the growth of v over the cycle."""
        growing, steeps, forces, rates = list[balls.Growth](), list[Any](), list[dict[Any, Any]](), list[Any]()
        todo, self._places = self._places[::-1], []
        while todo:
            each = todo.pop()
            cell = each.place.cell
            squares = balls.pair(each.place.square + balls.around(0, self._radius), cell.span, self._order)
            choices = self._choices(each, squares, wheel.value, unknown.value)
            if len(choices) != 1 and cell.high - cell.low > (_WIDEST_OPEN if choices else _WIDEST_HULL):
                todo += reversed(self._in_halves(each.place))
                continue
            laws = [{k: [law._replace(outwards=own) for law in pair] for k, pair in each.jets.items()} for own in choices]
            laws = laws or [{k: [own[1].all_over()._replace(outwards=None)] * 2 for k, own in each.jets.items()}]
            try:
                possible = [self._rates(jets, each.growth, squares, wheel, unknown) for jets in laws]
            except (ArithmeticError, ValueError):
                todo += reversed(self._in_halves(each.place))
                continue
            self._places.append(each)
            rate, steep, *slopes = map(balls.polynomial_hull, zip(*possible, strict=True))
            low, high = (end.mid() - cell.middle for end in (cell.low, cell.high))
            growing.append(balls.growth(low, high, steep, self._order))
            steeps.append(steep)
            forces.append(dict(zip(self._halves, slopes, strict=True)))
            rates.append(rate)
        paths, ends = dict[Any, list[Any]](), dict[Any, Any]()
        for k in self._halves:
            pushed = [own[k] for own in forces]
            start = self._starts.get(k, rational(0, 1))
            paths[k], end = transported(growing, steeps, pushed, start, self._order)
            ends[k] = end - start
        rows = [
            (each.place.square, {k: own[n] for k, own in paths.items()}, rate)
            for n, (each, rate) in enumerate(zip(self._places, rates, strict=True))
        ]
        fast, slow = (
            Centred(own**2 / 2, self._greatest(rows, sign), self._halves, balls.around(own**2 / 2, self._radius))
            for own, sign in ((near.fast, 1), (near.slow, -1))
        )
        speeds = SpeedBalls((2 * fast).sqrt(), (2 * slow).sqrt(), near.start)
        return paths, speeds, Centred(rational(0, 1), ends, self._halves)

    def _rates(
        self, jets: dict[Any, list[EnergyLaw]], growth: Centred, squares: Sequence[Any], wheel: Centred, unknown: Centred
    ) -> list[Any]:
        """Polynomials of F and of dF/dv in a cell, and those of the slopes of F by numbers."""
        slopes = list[Any]()
        for k, pair in jets.items():
            loaded = [law.loaded(wheel.jet(k)) for law in pair]
            both = [law.square_rates(v, unknown.jet(k)) for law, v in zip(loaded, squares, strict=True)]
            moved = [[growth.jet(k) * rate for rate in rates] for rates in both]
            slopes.append(self._enclosing(_slope(rate) for rate, _ in moved))
        return [*(self._enclosing(map(value_of, own)) for own in zip(*moved, strict=True)), *slopes]

    def _choices(self, each: _WidePlace, squares: Sequence[Any], wheel: Any, unknown: Any) -> list[tuple[bool, ...]]:
        """The sides of meshes that may occur in a cell; none where a switch may change its own."""
        outwards, meshes = each.laws[0].outwards, len(self._stages) - 1
        if outwards is None:
            return []
        try:
            laws = [law.loaded(wheel) for law in each.laws]
            kept = [*sides_kept(each.place.cell, squares, laws, unknown, self._order)]
            undecided = not all(kept[: len(kept) - meshes])
        except (ArithmeticError, ValueError):  # UnprovenError is one
            kept, undecided = [], True
        if undecided and each.laws[0].jumps:
            raise UnprovenError("ranges in which a torque may jump at a speed")
        if undecided:
            return []
        sides = zip(outwards, kept[len(kept) - meshes :], strict=True)
        return [*product(*([own] if proven else [True, False] for own, proven in sides))]


def _along_with(number: Centred, slopes: dict[Any, Any]) -> Centred:
    """A number of the motion with further slopes by others."""
    moved = {k: number.slopes.get(k, 0) + slope for k, slope in slopes.items()}
    return Centred(number.middle, number.slopes | moved, number.halves)


def _halved(place: MotionPlace) -> Iterator[MotionPlace]:
    """Both halves of a cell."""
    cell = place.cell
    for low, high in ((cell.low, cell.middle), (cell.middle, cell.high)):
        middle = ((low + high) / 2).mid()
        move = balls.line(middle - cell.middle, 1)
        half = cell._replace(low=low, high=high, middle=middle, polynomials=(cell.polynomials[INERTIA](move),))
        yield place._replace(cell=half, square=place.square(move))


def _slope(number: Any) -> Any:
    return number.first if isinstance(number, Jet) else rational(0, 1)
