"""A machine over balls: the edges of its smooth pieces, its reduction in cells, the extremes of a cycle, its steady motion.

The programs of a recorded machine are evaluated over balls and power series of them (`flywheel.numerics.balls`), which
enclose the true values; `flywheel.sizing.proof` makes proven figures of them.

Where torques depend on speed, or meshes have losses, the motion solves dE/dphi = F(phi, E) for the kinetic energy E. Losses
make F of pieces: one for each choice of the sides of meshes that drive. In a cell, that choice is proven; but where a mesh
changes its side, in a very narrow cell about that angle, F lies between its values for all choices that are possible.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import lru_cache, partial
from itertools import pairwise, product
from typing import Any, NamedTuple

import numpy as np

from bondgraph.recording import Program
from flywheel.machine.equation import balanced, lost, passed_by
from flywheel.machine.machine import Stage
from flywheel.machine.programs import RATE, STAGE, StretchWalk, Structure
from flywheel.mechanisms.linkage import Unknowns
from flywheel.numerics import balls
from flywheel.numerics.balls import Model, UnprovenError, rational
from flywheel.numerics.implicit import Implicit

PRECISIONS = ((80, 20, 1e-17), (112, 22, 1e-22), (192, 32, 1e-34))
"""Bits, order of the polynomials, what cells leave open; the first is too low for most motions."""

ROWS = (0, 2, 3)  # of the outputs of a walk: I*, M* and the unknown's share of it
INERTIA, MOMENT, UNKNOWN = range(len(ROWS))
_SMOOTH = tuple(k for k, name in enumerate(STAGE) if name != "exchanged")  # rows of a stage

_PLACES = 8  # of the cycle, for the sizes of its functions
_LOOSE = 64.0  # what extremes leave open, over what cells do
_MOST_CELLS = 450  # of a motion: more would take several hundred times as long as a sizing
_OPEN_MOTION = 1e4  # what a motion may leave open, over what cells do, of its energy
_SECANT = 1e-12  # of a flywheel, and of an unknown: change by which its effect is estimated
_MISSED = 1e-6  # of a step by that effect: what it may miss
_WIDER, _MOST_WIDER = (
    30,
    4,
)  # by how much brackets grow, and how often, until the motions at their ends are proven to lie on both sides
_SIDE = 1e-12  # of the moment in a mesh: what its greatest in a cell may leave open
_DEFECT = 1e-3  # of what a motion may leave open: what its polynomials may miss in a cell
_LEAST_UNEVEN = 1e-10  # irregularity: with less, such a cell is as wide as with this
_AT_SWITCH = 1e-8  # rad, over the root of the irregularity: half the width of a cell about an angle at which a mesh reverses


class Motion(NamedTuple):
    """A motion near the one to be proven: its flywheel at the crank (kg m²), the unknown, the speed at phi = 0.

    `outwards` says of each mesh with losses whether power passes outwards through it from an angle (rad) on.
    """

    wheel: float
    unknown: float
    omega: float
    irregularity: float
    outwards: tuple[tuple[float, tuple[bool, ...]], ...] = ((0.0, ()),)


# -- programs over balls ---------------------------------------------------------------------------------------------------


def over_balls(program: Program, outputs: int | None = None, *, jets: bool = False) -> Callable[..., Any]:
    """A recorded program as a function of balls, and of series of them, or of jets of these: of its first outputs."""
    part = program if outputs is None else program.only(outputs)
    return part._replace(places=tuple(map(place_of, part.places))).function(balls.JETS if jets else balls.NAMESPACE)


def rows_of(walk: StretchWalk) -> Program:
    """The program of I*, M* and the unknown's share of it."""
    return walk.program._replace(outputs=tuple(walk.program.outputs[k] for k in ROWS)).only(len(ROWS))


def place_of(place: Any, number: Callable[[float], Any] = balls.constant) -> Any:
    """The entry of a place of a program over balls: an index, the ball of a number, or the unknowns of a linkage."""
    if isinstance(place, Unknowns):
        return _unknowns(place)
    if isinstance(place, tuple) or callable(place):
        raise UnprovenError("a function or a table that is not arithmetic")
    return place if type(place) is int else number(place)


@lru_cache(maxsize=16)
def _unknowns(unknowns: Unknowns) -> Implicit:
    """The unknowns of a linkage over balls."""
    equations, count = unknowns.equations, unknowns.count
    return Implicit(over_balls(equations, count, jets=True), over_balls(equations), lambda x: unknowns(x)[: 2 * count])


def threshold(value: float) -> Any:
    """The ball of a number in a decision: a threshold of the reader is its exact float."""
    try:
        return balls.constant(value)
    except UnprovenError:
        return balls.exact(value)


class _Mark(NamedTuple):
    """An edge of a smooth piece: its approximate angle (rad), and its formula, or the function of which it is a zero.

    An edge inside a piece, or one where a cell ends only for resolution, has neither: its exact place has no effect.
    """

    angle: Any
    formula: Program | None = None
    zero: Program | None = None


def marks_of(structure: Structure, columns: Sequence[Any]) -> Iterator[_Mark]:
    """The edges of smooth pieces."""
    zero, marks, twin = rational(0, 1), structure.landmarks, structure.twin
    resolving = np.isin(twin.landmarks, np.setdiff1d(twin.breakpoints, twin.switches))

    def loosely(program: Program) -> Any:
        part = program.only(1)
        places = tuple(place_of(place, threshold) for place in part.places)
        return balls.ball(part._replace(places=places).function(balls.NAMESPACE)(zero, *columns)[0])

    zeros = [(loosely(program), program._replace(outputs=program.outputs[1:]).only(2)) for program in structure.zeros]
    for k, output in enumerate(marks.outputs):
        program = marks._replace(outputs=(output,)).only(1)
        angle = loosely(program)
        followed = next((own for at, own in zeros if at.mid() == angle.mid() and at.rad() == angle.rad()), None)
        if resolving[k] or (0 < k < len(structure.walks) and structure.walks[k - 1] is structure.walks[k]):
            yield _Mark(angle)
        else:
            yield _Mark(angle, program if followed is None else None, followed)


def edges_of(structure: Structure, columns: Sequence[Any]) -> list[Any]:
    """Balls of the edges of smooth pieces.

    Where Newton's method has followed the zero of a function, that zero is proven anew, so that the float at which it began
    has no effect.
    """
    edges = []
    for angle, formula, zero in marks_of(structure, columns):
        if zero is not None:
            function = over_balls(zero)
            edges.append(balls.zero_near(lambda phi, at=function: at(phi, *columns), angle))  # type: ignore[misc]
        else:
            edges.append(balls.ball(over_balls(formula)(rational(0, 1), *columns)[0]) if formula else angle)
    return edges


def cells_of(functions: Sequence[Callable[[Any], Any]], edges: Sequence[Any], order: int, left: float) -> list[Model]:
    """Models of I*, M* and all other outputs of the stretches' functions, on cells over the whole cycle."""
    scales: Any = 0.0
    for function, (low, high) in zip(functions, pairwise(edges), strict=True):
        length = float(high - low)
        places = math.ceil(_PLACES * length / float(edges[-1] - edges[0]))
        for k in range(places):
            at = balls.exact(float(low) + length * (k + 0.5) / places)
            scales = np.maximum(scales, [abs(float(balls.ball(value))) for value in function(at)])
    errors = [left * (scale or 1.0) for scale in scales.tolist()]
    return balls.models(functions, edges, order, errors)


def works_of(cells: Sequence[Model], balance: Any) -> Iterator[tuple[Any, Any]]:
    """W and M* in each cell, with the unknown's share."""
    start = 0 * balance
    for cell in cells:
        rising = cell.integral(MOMENT) + balance * cell.integral(UNKNOWN) + start
        yield rising, cell.polynomials[MOMENT] + balance * cell.polynomials[UNKNOWN]
        start = cell.at_end(rising)


class Sums:
    """An energy, given with its slope cell by cell, and I* all over the cycle as polynomials, and their extremes."""

    def __init__(self, cells: Sequence[Model], energies: Iterable[tuple[Any, Any]]) -> None:
        self._curves = [(cell, *energy) for cell, energy in zip(cells, energies, strict=True)]
        self._slopes = [cell.polynomials[INERTIA].derivative() for cell in cells]
        ends = (abs(energy(cell.high - cell.middle)) for cell, energy, _ in self._curves)
        self._size = max(float(end.mid()) for end in ends)
        self._largest = max(abs(float(cell.polynomials[INERTIA][0].mid())) for cell in cells)

    def greatest(self, energy: Any, inertia: Any, left: float, sign: int = 1) -> Any:
        """The greatest of sign (energy W + inertia I*)."""
        curves = [
            balls.Curve(
                cell.low - cell.middle,
                cell.high - cell.middle,
                sign * (energy * rising + inertia * cell.polynomials[INERTIA]),
                sign * (energy * moment + inertia * slope),
            )
            for (cell, rising, moment), slope in zip(self._curves, self._slopes, strict=True)
        ]
        size = abs(float(energy)) * self._size + abs(float(inertia)) * self._largest
        return balls.greatest(curves, _LOOSE * left * size)

    def irregularity(self, speed: Any, wheel: Any, bounds: tuple[Any, Any], left: float) -> Any:
        """The irregularity e with a given flywheel J, by the mean value theorem.

        g(e) = max(W/w² - ½ (1 + e/2)² (I* + J)) - min(W/w² - ½ (1 - e/2)² (I* + J)) falls by I* + J of some angles for each
        unit of e. So e = e' + g(e')/K for any e', K between the least and the greatest I* + J.

        Args:
            speed: w, the mean of the extreme speeds, rad/s.
            wheel: J at the crank, kg m².
            bounds: least and greatest I*, kg m².
            left: uncertainty of the cells, relative.

        Raises UnprovenError where no motion is proven: the flywheel is too light.

        """
        slope, per_square = bounds[0].union(bounds[1]) + wheel, 1 / speed**2
        eps = balls.falling_zero(lambda e: unevenness(self, e, per_square, left) - e * wheel, slope, rational(0, 1))
        if not (slope > 0 and eps < 2):
            raise UnprovenError("the motion with a flywheel so light")
        return eps


def unevenness(sums: Any, eps: Any, per_square: Any, left: float) -> Any:
    """max(W/w² - ½ (1 + e/2)² I*) - min(W/w² - ½ (1 - e/2)² I*), which is e J for the exact flywheel J at the crank."""
    fast, slow = (-((1 + side * eps / 2) ** 2) / 2 for side in (1, -1))
    return sums.greatest(per_square, fast, left) + sums.greatest(per_square, slow, left, -1)


# -- the steady motion -----------------------------------------------------------------------------------------------------


class _Law(NamedTuple):
    """F of the energy about a place, or all over a cell, from what position alone gives there.

    `late` gives the rows of every stage (`_SMOOTH`) from `known`, the speed and the unknown; `inertia` is I*. `outwards`
    says of each mesh whether power passes outwards; None where one changes its side in the cell: then F is a ball all over
    it, and `span` the ball of all distances from its middle.
    """

    stages: tuple[Stage, ...]
    inertia: Any
    known: Sequence[Any]
    late: Callable[..., Any]
    outwards: tuple[bool, ...] | None
    span: Any

    def rates(self, energy: Any, wheel: Any, unknown: Any) -> tuple[Any, Any, Any]:
        """F, dF/dE and dF/du at an energy (J), with a flywheel (kg m² at the crank) and a value of the unknown."""
        energy = balls.over(energy, self.span) if self.outwards is None else energy
        by_energy, (moments, by_speed, by_unknown, inertias, slopes), bare = self._moments(energy, wheel, unknown)
        if len(self.stages) == 1:
            return moments[0], by_speed[0] * by_energy, by_unknown[0]
        speed = 1 / (by_energy * (self.inertia + wheel))
        steep = [slope * speed - change for slope, change in zip(slopes, by_speed, strict=True)]
        possible = [self._factors(self.outwards)] if self.outwards is not None else self._possible(inertias, bare)

        def less_lost(kept: Sequence[Any], rest: Sequence[Any]) -> Any:
            """A sum over all stages without what meshes lose of it, for all possible sides."""
            return balls.hull(sum(kept) - lost(factors, balanced(inertias, rest, factors)[1]) for factors in possible)

        of_unknown = less_lost(by_unknown, [-each for each in by_unknown])
        return less_lost(moments, bare), less_lost(by_speed, steep) * by_energy, of_unknown

    def passed(self, energy: Any, wheel: Any, unknown: Any) -> Sequence[Any]:
        """The moment (N m, at the crank) that passes outwards through each mesh with losses."""
        assert self.outwards is not None
        _, rows, bare = self._moments(energy, wheel, unknown)
        factors = self._factors(self.outwards)
        return passed_by(balanced(rows[3], bare, factors)[1], self.stages, factors, None)[0][1:]

    def all_over(self) -> _Law:
        """The same with a ball in place of each series."""
        return self._replace(inertia=balls.first(self.inertia), known=list(map(balls.first, self.known)))

    def _moments(self, energy: Any, wheel: Any, unknown: Any) -> tuple[Any, list[list[Any]], list[Any]]:
        """domega/dE; the rows of all stages, the flywheel among their inertias; ½ I' omega² - M of each.

        Of a single stage, I* and its slope are not among the rows: nothing is lost there.
        """
        total = self.inertia + wheel
        speed = (2 * energy / total).sqrt()
        rows = self.late(*self.known, speed, unknown)
        moments, by_speed, by_unknown, inertias, slopes = (list(rows[k :: len(_SMOOTH)]) for k in range(len(_SMOOTH)))
        inertias = [own + wheel * stage.carries_flywheel for stage, own in zip(self.stages, inertias, strict=False)]
        bare = [slope * energy / total - moment for slope, moment in zip(slopes, moments, strict=False)]
        return 1 / (total * speed), [moments, by_speed, by_unknown, inertias, slopes], bare

    def _factors(self, outwards: tuple[bool, ...]) -> tuple[Any, ...]:
        """The factors K of all parts (see `flywheel.machine.equation`)."""
        factors = [rational(1, 1)]
        for stage, out in zip(self.stages[1:], outwards, strict=True):
            factors.append(factors[stage.near] * (1 / stage.efficiency if out else stage.efficiency))
        return tuple(factors)

    def _possible(self, inertias: Sequence[Any], bare: Sequence[Any]) -> list[tuple[Any, ...]]:
        """The factors K for each choice of sides that may fit: all meshes have a moment of their own sign then."""
        possible = []
        for outwards in product((True, False), repeat=len(self.stages) - 1):
            factors = self._factors(outwards)
            passed, _ = passed_by(balanced(inertias, bare, factors)[1], self.stages, factors, None)
            if not any(tau < 0 if out else tau > 0 for tau, out in zip(passed[1:], outwards, strict=True)):
                possible.append(factors)
        return possible


class _Stretch(NamedTuple):
    """Part of a smooth piece, from a place on, and the sides of meshes there; None about an angle at which one changes.

    `inertia` gives I* and its slope, `early` what position alone gives, from which `late` gives all stages' rows.
    """

    low: Any
    outwards: tuple[bool, ...] | None
    inertia: Callable[..., Any]
    early: Callable[..., Any]
    late: Callable[..., Any]

    def laws(self, cell: Model, stages: tuple[Stage, ...], columns: Sequence[Any]) -> list[_Law]:
        """The law about the middle of a cell, and about every place of it."""
        centres = (cell.middle, cell.low.union(cell.high))
        about = [
            _Law(stages, self.inertia(phi, *columns)[0], self.early(phi, *columns), self.late, self.outwards, cell.span)
            for phi in map(balls.variable, centres)
        ]
        return [about[1].all_over()] * 2 if self.outwards is None else about


def _stretches(
    walks: Iterable[StretchWalk], edges: Sequence[Any], near: Motion, stages: int, reach: Any
) -> Iterator[_Stretch]:
    """The smooth pieces, divided at a reach from the angles at which a mesh changes its side in the motion near."""
    for walk, (low, high) in zip(walks, pairwise(edges), strict=True):
        assert walk.rate is not None
        rows = range(len(RATE), len(walk.rate.outputs), len(STAGE))
        outputs = tuple(walk.rate.outputs[row + k] for row in rows for k in _SMOOTH)
        rate = walk.rate._replace(outputs=outputs).only(3 if stages == 1 else len(outputs))
        functions = over_balls(walk.program, 2), *map(over_balls, rate.split(2))
        reversals = [balls.exact(angle) for angle, _ in near.outwards if low + reach < angle < high - reach]
        places = [low, *sorted(angle + side * reach for angle in reversals for side in (-1, 1)), high]
        for k, ends in enumerate(pairwise(places)):
            outwards = max(each for each in near.outwards if sum(ends) / 2 >= each[0])[1]
            yield _Stretch(ends[0], None if k % 2 else outwards, *functions)


class Speeds(NamedTuple):
    """The greatest and the least speed of a motion, and the sign of the unknown's effect on it (0: both).

    `start` is the ball of the kinetic energy at the beginning of the cycle, J.
    """

    fast: Any
    slow: Any
    effect: int
    start: Any

    @property
    def level(self) -> Any:
        """Mean of the two."""
        return (self.fast + self.slow) / 2

    @property
    def irregularity(self) -> Any:
        """Difference of the two over their mean."""
        return 2 * (self.fast - self.slow) / (self.fast + self.slow)

    def growth(self, before: Speeds, step: Any) -> tuple[Any, Any]:
        """Growth of level and irregularity from another motion, for each unit of a step."""
        return ((self.level - before.level) / step).mid(), ((self.irregularity - before.irregularity) / step).mid()


class Motions:
    """Steady motions of a machine with any flywheel and balance, as solutions of dE/dphi = F(phi, E)."""

    def __init__(self, structure: Structure, columns: Sequence[Any], near: Motion, order: int, left: float) -> None:
        self._near, self._order, self._left = near, order, left
        self._polynomials: tuple[Any, ...] = ()  # of the last motion
        self._unknown = balls.exact(near.unknown)
        self._per_unknown: tuple[Any, Any] | None = None  # effect of the unknown on the speed and on the irregularity
        self.between: list[Any] = []  # energies at the start of the motions on both sides of what is wanted, J
        assert structure.efficiencies is not None
        efficiencies = over_balls(structure.efficiencies)(rational(0, 1), *columns)
        stages = tuple(
            stage._replace(efficiency=each) for stage, each in zip(structure.twin.stages, efficiencies, strict=True)
        )
        edges = edges_of(structure, columns)
        reach = balls.exact(_AT_SWITCH * max(near.irregularity, _LEAST_UNEVEN) ** 0.5)
        stretches = list(_stretches(structure.walks, edges, near, len(stages), reach))
        self._first = balls.ball(stretches[0].inertia(edges[0], *columns)[0])
        speed = balls.exact(near.omega)

        def rows(stretch: _Stretch, phi: Any) -> Any:
            moments = stretch.late(*stretch.early(phi, *columns), speed, self._unknown)[:: len(_SMOOTH)]
            return (*stretch.inertia(phi, *columns)[:1], sum(moments))

        functions = [partial(rows, each) for each in stretches]
        cells = cells_of(functions, [*(each.low for each in stretches), edges[-1]], order, left)
        lows = [float(each.low) for each in stretches]
        pieces = [sum(low <= float(cell.middle) for low in lows) - 1 for cell in cells]
        self._cells, self._laws = list[Model](), list[list[_Law]]()
        todo, value = [*zip(cells, pieces, strict=True)][::-1], self._start(balls.exact(near.wheel)).mid()
        while todo:
            cell, k = todo.pop()
            laws = stretches[k].laws(cell, stages, columns)
            end = self._end(cell, laws, value)
            if (
                end is None and cell.high - cell.low < reach and laws[0].outwards
            ):  # a mesh changes its side where a piece begins or ends
                laws = stretches[k]._replace(outwards=None).laws(cell, stages, columns)
                end = self._end(cell, laws, value)
            if end is None and cell.high - cell.low < reach:
                raise UnprovenError(f"the motion at {float(cell.middle):.6g} rad")
            if end is None:
                todo += [(half, k) for half in reversed(balls.halves(functions[k], cell, order))]
            else:
                self._cells.append(cell)
                self._laws.append(laws)
                value = end
            if len(self._cells) + len(todo) > _MOST_CELLS:
                raise UnprovenError("that a motion through so many cells is found in time")
        self._effort = max(abs(float(cell.polynomials[MOMENT][0].mid())) for cell in self._cells)
        sums = Sums(self._cells, [(0 * cell.polynomials[0], 0 * cell.polynomials[0]) for cell in self._cells])
        self.bounds = -sums.greatest(0, 1, left, -1), sums.greatest(0, 1, left)

    def _end(self, cell: Model, laws: Sequence[_Law], value: Any) -> Any:
        """The energy (J) at the end of a cell on the motion near, from that at its beginning; None if the cell is too wide.

        It is where polynomials miss the motion by more than they may, or where the sides of meshes are not proven.
        """
        wheel, unknown, most = balls.exact(self._near.wheel), self._unknown, _DEFECT * self._allowed(value)
        place = self._place(cell, laws, wheel, unknown)
        try:
            own, _ = balls.solution(place, value, balls.line(value, 0), self._order, _DEFECT * most)
            exact = laws[0].outwards is not None
            if exact and not balls.missed(place, own, self._order) * (cell.high - cell.low) < most:
                return None
            if laws[0].outwards:
                self._check_sides(place, own, laws, wheel, unknown)
        except (ArithmeticError, ValueError):  # UnprovenError is one
            return None
        return own(cell.high - cell.middle).mid()

    def _allowed(self, energy: Any) -> float:
        """The part of an energy (J) that a motion may leave open."""
        return _OPEN_MOTION * self._left * abs(float(energy))

    def _start(self, wheel: Any) -> Any:
        """The kinetic energy (J) of the motion near, with a flywheel, where the cycle begins."""
        return (self._first + wheel) * balls.exact(self._near.omega) ** 2 / 2

    def _place(self, cell: Model, laws: Sequence[_Law], wheel: Any, unknown: Any) -> balls.Place:
        def rate(law: _Law) -> Callable[[Any], Any]:
            return lambda energy: law.rates(energy, wheel, unknown)[:2]

        return balls.Place(cell.low, cell.high, cell.middle, *map(rate, laws))

    def at(self, wheel: Any, unknown: Any) -> Speeds:
        """The speeds of the motion with a flywheel (kg m² at the crank) and a value of the unknown."""
        omega, start = balls.exact(self._near.omega), self._start(wheel)
        places = [self._place(*each, wheel, unknown) for each in zip(self._cells, self._laws, strict=True)]
        orbit = balls.periodic(places, start, self._order, self._allowed(start), self._polynomials)
        self._polynomials = orbit.polynomials
        open_by = orbit.reach.union(-orbit.reach)
        steps = []
        for cell, energy, laws in zip(places, orbit.polynomials, self._laws, strict=True):
            if laws[0].outwards:
                self._check_sides(cell, energy + open_by, laws, wheel, unknown)
            all_over = laws[1].all_over().rates(energy(cell.span) + open_by, wheel, unknown)
            _, by_energy, by_unknown = map(balls.ball, all_over)
            steps.append((cell.high - cell.low, by_unknown, by_energy))
        effect = balls.one_way(steps)
        sums = Sums(self._cells, [(energy, energy.derivative()) for energy in orbit.polynomials])
        slope = self.bounds[0].union(self.bounds[1]) + wheel

        def extreme(sign: int) -> Any:
            def gap(square: Any) -> Any:
                return sign * (sums.greatest(1, -square, self._left, sign) + open_by) - square * wheel

            return (2 * balls.falling_zero(gap, slope, omega**2 / 2)).sqrt()

        return Speeds(extreme(1), extreme(-1), effect, orbit.start)

    def _check_sides(self, cell: balls.Place, energy: Any, laws: Sequence[_Law], wheel: Any, unknown: Any) -> None:
        """Refuses a motion in which power passes through a mesh the other way somewhere in a cell."""
        order, near = self._order, [energy, energy(balls.line(cell.span, 1))]
        series = [balls.series(polynomial, order) for polynomial in near]
        passed, cut = (law.passed(each, wheel, unknown) for law, each in zip(laws, series, strict=True))
        for out, inner, outer in zip(laws[0].outwards or (), passed, cut, strict=True):
            tau = (-1 if out else 1) * balls.enclosing(inner, outer, order)
            curve = balls.Curve(cell.low - cell.middle, cell.high - cell.middle, tau, tau.derivative())
            if all(term.is_zero() for term in tau.coeffs()):  # an idle mesh loses nothing either way
                continue
            if not balls.greatest([curve], _SIDE * abs(float(tau(0).mid()))) < 0:
                raise UnprovenError(f"which side of a mesh with losses drives at {float(cell.middle):.6g} rad")

    def balance(self, wheel: Any, speed: Any) -> Any:
        """The ball of the unknown with which a motion has a speed, near that of the last motion."""
        here, size = self._unknown, max(abs(self._near.unknown), self._effort)
        found = self.at(wheel, here)
        if self._per_unknown is None:
            step = balls.exact(_SECANT * size)
            self._per_unknown = self.at(wheel, here + step).growth(found, step)
        slope = self._per_unknown[0]
        if slope.is_zero():
            raise UnprovenError("the effect of the balance on the speed")
        rest = (speed - found.level) / slope
        self._unknown = (here + rest).mid()
        apart = (4 * rest.rad() + _MISSED * abs(rest) + self._left * size).upper()
        for _ in range(_MOST_WIDER):
            sides = [self.at(wheel, self._unknown + side * found.effect * apart) for side in (-1, 1)]
            if found.effect and sides[0].level < speed < sides[1].level:
                self.between = [each.start for each in sides]
                return balls.around(self._unknown, apart)
            apart *= _WIDER
        raise UnprovenError("that the mean speed is the required one with a balance near")

    def for_irregularity(self, asked: Any, *speeds: Any) -> Any:
        """The ball of the flywheel with which a motion has an irregularity."""

        def motion(wheel: Any) -> Speeds:
            return self.at(wheel, self.balance(wheel, *speeds) if speeds else rational(0, 1))

        wheel = balls.exact(self._near.wheel)
        here, step = motion(wheel), (wheel * balls.exact(_SECANT)).mid()
        level, uneven = self.at(wheel + step, self._unknown).growth(here, step)
        if self._per_unknown is not None:  # the unknown follows the flywheel
            share = level / self._per_unknown[0]
            uneven -= share * self._per_unknown[1]
        step = ((asked - here.irregularity) / uneven).mid()
        if self._per_unknown is not None:
            self._unknown = (self._unknown - share * step).mid()
        wheel = (wheel + step).mid()
        rest = (asked - motion(wheel).irregularity) / uneven
        apart = (4 * abs(rest) + self._left * wheel).upper()
        for _ in range(_MOST_WIDER):
            sides = [motion(light := wheel - apart), motion(heavy := wheel + apart)]
            if sides[0].irregularity > asked > sides[1].irregularity:
                self.between = [each.start for each in sides]
                return light.union(heavy)
            apart *= _WIDER
        raise UnprovenError("that the irregularity is the required one with a flywheel near")
