"""Figures over ranges of numbers: extremes of a cycle and speeds of a steady motion, with slopes all over the ranges.

`RangeEnds` makes intervals of such figures that are hardly wider than the figures: it halves ranges where slopes leave much
open. Positions are shares of the smooth pieces between edges, which move with the numbers, so that all vary smoothly with
them (`flywheel.numerics.ranges`).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise, product
from typing import Any

from bondgraph.recording import Program
from flywheel.machine.programs import StretchWalk, Structure
from flywheel.numerics import balls
from flywheel.numerics.balls import Model, UnprovenError, rational
from flywheel.numerics.ranges import Centred, CurveOverRanges, over_ranges, slopes_at_greatest
from flywheel.sizing.enclosures import MOMENT, ROWS, EnergySums, cells_of, marks_of, over_balls, rows_of, unevenness

_OVER_RANGES = 1e-7  # what cells leave open of slopes by numbers in ranges
_MOST_WIDER = 6  # tries to enclose the irregularities over ranges
_MOST_PARTS, _OF_POINT = 24.0, 0.2  # parts of ranges; a part in which no number has a range, beside one with ranges
_ENOUGH = 1.05  # of the width that a figure is proven to have: its interval
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

    def __init__(self, figures: Callable[[Part], dict[str, Any]], numbers: Sequence[Any]) -> None:
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
            wide = [name for name in wide if self._excess(name) > _ENOUGH]
            votes = Counter[tuple[Part, int]]()
            for name, side in product(wide, (-1, 1)):
                bounds = self._bounds[name, side]
                while (name, side, part := max(bounds, key=bounds.__getitem__)) not in self._sharp:
                    self._sharpen(name, side, part)
                gap, least = bounds[part] - self._reached(name, side), (_ENOUGH - 1) / 2 * self._least_width(name)
                if gap > least and (k := self._open(name, part)) is not None:
                    votes[part, k] += 1
            cost = sum(1.0 if any(half for _, half in part) else _OF_POINT for part in self._parts)
            if not votes or cost >= _MOST_PARTS:
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
        middle, half = part[k]
        owners = [(key, bounds, bounds.pop(part)) for key, bounds in self._bounds.items() if part in bounds]
        for way in (-1, 1):
            own = (*part[:k], (middle + way * half / 2, half / 2), *part[k + 1 :])
            for (name, side), bounds, before in owners:
                bounds[own] = before.min((side * self._in(own)[name].value).upper())


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
