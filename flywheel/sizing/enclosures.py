"""A machine over balls: the edges of its smooth pieces, its reduction in cells, the extremes of a cycle, its steady motion.

The programs of a recorded machine are evaluated over balls and power series of them (`flywheel.numerics.balls`), which
enclose the true values; `flywheel.sizing.proof` makes proven figures of them.

Where torques depend on speed, or meshes have losses, the motion solves dE/dphi = M(phi, E) for the kinetic energy E, M
without what meshes lose. Losses make M of pieces: one for each choice of the sides of meshes that drive. In a cell, that
choice is proven; but where a mesh changes its side, in a very narrow cell about that angle, M lies between its values for
all choices that are possible.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from functools import lru_cache, partial
from itertools import pairwise, product
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from bondgraph.recording import Program
from flywheel.machine.equation import balanced, lost, passed_by
from flywheel.machine.machine import MeshStage
from flywheel.machine.programs import RATE, STAGE, StretchWalk, Structure
from flywheel.mechanisms.linkage import LinkageUnknowns
from flywheel.numerics import balls
from flywheel.numerics.balls import Model, UnprovenError, WorkLimitError, rational
from flywheel.numerics.implicit import ImplicitEquations, ZeroNear, falling_zero
from flywheel.numerics.jets import Jet, value_of
from flywheel.numerics.switching import FollowedZero

SAME = 2.0**-60  # of two numbers, and of angles in rad: what they agree to within counts as the same
PRECISIONS = ((80, 20, 1e-17), (128, 24, 1e-25), (192, 32, 1e-34))
"""Bits, order of the polynomials, what cells leave open; the first is too low for most motions."""

ROWS = (0, 2, 3)  # of the outputs of a walk: I*, M* and the unknown's share of it
INERTIA, MOMENT, UNKNOWN = range(len(ROWS))
_SMOOTH = tuple(k for k, name in enumerate(STAGE) if name != "exchanged")  # rows of a stage

_PLACES = 8  # of the cycle, for the sizes of its functions
_LOOSE = 64.0  # what extremes leave open, over what cells do
_MOST_CELLS = 800  # of a motion: more would take several hundred times as long as a sizing
_OPEN_MOTION = 1e4  # what a motion may leave open, over what cells do, of its v
_RANGE = 1e-17  # of a flywheel, and of an unknown: about them, for which the laws in a cell are evaluated at once
_SECANT = 1e-12  # of a flywheel, and of an unknown: change by which its effect is estimated
_NEWTON, _SETTLED = 2, 1e-9  # steps towards both at most, and the change of a flywheel after which one more is not needed
_BRACKET = 4.0  # half the width of a bracket over what a motion in its middle leaves open
_MISSED = 1e-6  # of a step by that effect: what it may miss
_WIDER, _MOST_WIDER = (
    30,
    4,
)  # by how much brackets grow, and how often, until the motions at their ends are proven to lie on both sides
_MOST_WHEELS = 4  # with which laws are kept
_SIDE = 1e-12  # of the moment in a mesh: what its greatest in a cell may leave open
_DEFECT = 1e-3  # of what a motion may leave open: what its polynomials may miss in a cell
_LEAST_UNEVEN = 1e-10  # irregularity: with less, such a cell is as wide as with this
_AT_SWITCH = 5e-11  # rad, over the root of the irregularity: half the width of a cell about the angle of a reversal


class NearMotion(NamedTuple):
    """A motion near the one to be proven: its flywheel at the crank (kg m²), the unknown, the speed at phi = 0.

    `outwards` says of each mesh with losses whether power passes outwards through it from an angle (rad) on; a new row
    begins where a torque switches at a speed, too.
    """

    wheel: float
    unknown: float
    omega: float
    irregularity: float
    outwards: tuple[tuple[float, tuple[bool, ...]], ...] = ((0.0, ()),)


# -- programs over balls ---------------------------------------------------------------------------------------------------


def over_balls(program: Program, outputs: int | None = None, functions: Any = balls.NAMESPACE) -> Callable[..., Any]:
    """A recorded program as a function of balls and of series of them, or of what else functions take: its first outputs."""
    part = program if outputs is None else program.only(outputs)
    return part._replace(places=tuple(map(place_of, part.places))).function(functions)


def rows_of(walk: StretchWalk) -> Program:
    """The program of I*, M* and the unknown's share of it."""
    return walk.program._replace(outputs=tuple(walk.program.outputs[k] for k in ROWS)).only(len(ROWS))


def place_of(place: Any, number: Callable[[float], Any] = balls.constant) -> Any:
    """The entry of a place of a program over balls: an index, the ball of a number, or the unknowns of a linkage."""
    if isinstance(place, LinkageUnknowns):
        return _unknowns(place)
    if isinstance(place, FollowedZero):
        return zero_of(place)
    if isinstance(place, tuple) or callable(place):
        raise UnprovenError("a function or a table that is not arithmetic")
    return place if type(place) is int else number(place)


@lru_cache(maxsize=16)
def _unknowns(unknowns: LinkageUnknowns) -> ImplicitEquations:
    """The unknowns of a linkage over balls."""
    equations, count = unknowns.equations, unknowns.count
    return ImplicitEquations(
        over_balls(equations, count, balls.JETS), over_balls(equations), lambda x: unknowns(x)[: 2 * count]
    )


@lru_cache(maxsize=64)
def zero_of(zero: FollowedZero) -> ZeroNear:
    """A zero that a recording has solved for, over balls."""
    return ZeroNear(over_balls(zero.program), over_balls(zero.program, functions=balls.JETS), zero.near, SAME)


def threshold(value: float) -> Any:
    """The ball of a number in a decision: a threshold of the reader is its exact float."""
    try:
        return balls.constant(value)
    except UnprovenError:
        return balls.exact(value)


class Branches:
    """A program over balls that gives also the differences whose signs decide its branches, in turn.

    Each sign is what a function gives for the number of a difference and itself. Where it gives None, the value is the hull
    of both branches; arguments are balls then.
    """

    def __init__(self, program: Program, functions: Any = balls.NAMESPACE) -> None:
        self._sign_of: Callable[[int, Any], int | None] = _own_sign
        self._differences: list[Any] = []
        own: dict[str, Any] = {name: partial(self._answer, signs) for name, signs in balls.SIGNS.items()}
        own |= {name: partial(_unless_open, getattr(np, name)) for name in ("logical_and", "logical_or", "logical_not")}
        own |= {"sign": self._sign, "where": _chosen, "abs": lambda u: self._greater(u, -u, 1)}
        own |= {"minimum": partial(self._greater, way=-1), "maximum": partial(self._greater, way=1)}
        self._function = over_balls(program, functions=SimpleNamespace(**vars(functions) | own))

    def __call__(self, sign_of: Callable[[int, Any], int | None], *arguments: Any) -> tuple[Any, list[Any]]:
        """The outputs at arguments, and these differences."""
        self._sign_of, self._differences = sign_of, []
        return self._function(*arguments), self._differences

    def _side(self, difference: Any) -> int | None:
        plain = value_of(difference)
        self._differences.append(plain)
        return self._sign_of(len(self._differences) - 1, plain)

    def _answer(self, signs: tuple[int, ...], a: Any, b: Any) -> bool | None:
        side = self._side(a - b)
        return None if side is None else side in signs

    def _sign(self, u: Any) -> Any:
        side = self._side(u)
        return balls.around(0, balls.exact(1)) if side is None else side

    def _greater(self, a: Any, b: Any, way: int) -> Any:
        """The greater of two, or the smaller one (way -1)."""
        side = self._side(a - b)
        return _chosen(None if side is None else side == way, a, b)


def _unless_open(logical: Callable[..., Any], *tests: Any) -> Any:
    return None if any(test is None for test in tests) else logical(*tests)


def _chosen(test: Any, yes: Any, no: Any) -> Any:
    return _either((yes, no)) if test is None else yes if test else no


def _either(values: Iterable[Any]) -> Any:
    """The smallest ball that contains some, or the jet whose value and slope do; one alone as it is."""
    first, *others = values
    if not others:
        return first
    parts = [(own.value, own.first) if isinstance(own, Jet) else (own, 0) for own in (first, *others)]
    value, slope = (balls.hull(map(balls.ball, part)) for part in zip(*parts, strict=True))
    return Jet(value, slope) if any(isinstance(own, Jet) for own in (first, *others)) else value


def _all_over(u: Any) -> Any:
    """The ball of a series at its first coefficient, or a jet of such balls."""
    return Jet(balls.first(u.value), balls.first(u.first)) if isinstance(u, Jet) else balls.first(u)


def _own_sign(_: int, difference: Any) -> int:
    """The sign of a difference; an error if it is open."""
    return balls.sign(difference)


def _middle_sign(_: int, difference: Any) -> int:
    """The sign of the middle of a difference, by which nothing is proven."""
    return balls.sign(balls.first(difference).mid())


def possible_sign(_: int, difference: Any) -> int | None:
    """The sign of a difference; None if it is open."""
    with suppress(UnprovenError):
        return balls.sign(difference)
    return None


def marks_of(structure: Structure, columns: Sequence[Any]) -> Iterator[tuple[Any, Program | None]]:
    """The edges of smooth pieces: approximate angle (rad), and its formula.

    An edge inside a piece, or one where a cell ends only for resolution, has none: its exact place has no effect.
    """
    zero, marks, twin = rational(0, 1), structure.landmarks, structure.twin
    resolving = np.isin(twin.landmarks, np.setdiff1d(twin.breakpoints, twin.switches))
    for k, output in enumerate(marks.outputs):
        program = marks._replace(outputs=(output,)).only(1)
        part = program._replace(places=tuple(place_of(place, threshold) for place in program.places))
        angle = balls.ball(part.function(balls.NAMESPACE)(zero, *columns)[0])
        inner = resolving[k] or (0 < k < len(structure.walks) and structure.walks[k - 1] is structure.walks[k])
        yield angle, None if inner else program


def edges_of(structure: Structure, columns: Sequence[Any]) -> list[Any]:
    """Balls of the edges of smooth pieces."""
    return [
        balls.ball(over_balls(formula)(rational(0, 1), *columns)[0]) if formula else angle
        for angle, formula in marks_of(structure, columns)
    ]


def double_edges_of(structure: Structure, columns: Sequence[Any]) -> int:
    """The number of edges at which a function only touches zero: at most two zeros of it, which count as one."""
    zeros = (place for place in structure.landmarks.places if isinstance(place, FollowedZero))
    return sum(zero_of(zero).at(columns)[1] for zero in zeros)


def cells_of(functions: Sequence[Callable[[Any], Any]], edges: Sequence[Any], order: int, left: float) -> list[Model]:
    """Models of I*, M* and all other outputs of the stretches' functions, on cells over the whole cycle."""
    scales: Any = 0.0
    for function, (low, high) in zip(functions, pairwise(edges), strict=True):
        length = float(high - low)
        places = math.ceil(_PLACES * length / float(edges[-1] - edges[0]))
        for k in range(places):
            at = balls.exact(float(low) + length * (k + 0.5) / places)
            scales = np.maximum(scales, [abs(float(balls.ball(value))) for value in function(at)])
    return balls.models(functions, edges, order, [scale or 1.0 for scale in scales.tolist()], left)


def works_of(cells: Sequence[Model], balance: Any) -> Iterator[tuple[Any, Any]]:
    """W and M* in each cell, with the unknown's share."""
    start = 0 * balance
    for cell in cells:
        rising = cell.integral(MOMENT) + balance * cell.integral(UNKNOWN) + start
        yield rising, cell.polynomials[MOMENT] + balance * cell.polynomials[UNKNOWN]
        start = cell.at_end(rising)


class EnergySums:
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
            balls.BallCurve(
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
        eps = falling_zero(lambda e: unevenness(self, e, per_square, left) - e * wheel, slope, rational(0, 1))
        if not (slope > 0 and eps < 2):
            raise UnprovenError("the motion with a flywheel so light")
        return eps


def unevenness(sums: Any, eps: Any, per_square: Any, left: float) -> Any:
    """max(W/w² - ½ (1 + e/2)² I*) - min(W/w² - ½ (1 - e/2)² I*), which is e J for the exact flywheel J at the crank."""
    fast, slow = (-((1 + side * eps / 2) ** 2) / 2 for side in (1, -1))
    return sums.greatest(per_square, fast, left) + sums.greatest(per_square, slow, left, -1)


# -- the steady motion -----------------------------------------------------------------------------------------------------


class EnergyLaw(NamedTuple):
    """dE/dphi about a place, or all over a cell, from what position alone gives there.

    `late` gives the rows of every stage (`_SMOOTH`) from `known`, the speed and the unknown; `inertia` is I*. `outwards`
    says of each mesh whether power passes outwards, `signs` on which sides of its switches every torque is; without
    them these have to show. `outwards` is None where one of them changes in the cell: then the law is a ball all
    over it, and `span` the ball of all distances from its middle.
    """

    stages: tuple[MeshStage, ...]
    inertia: Any
    known: Sequence[Any]
    late: Branches
    outwards: tuple[bool, ...] | None
    span: Any
    jumps: bool
    signs: tuple[int, ...] | None = None
    wheel: Any = None
    per_inertia: Any = None
    slope: Any = 0

    def loaded(self, wheel: Any) -> EnergyLaw:
        """The law with a flywheel (kg m² at the crank)."""
        return self._replace(wheel=wheel, per_inertia=1 / (self.inertia + wheel))

    def rates(self, energy: Any, unknown: Any) -> Iterator[Any]:
        """dE/dphi (N m); then its slopes by E and by the unknown, which are calculated only where they are taken."""
        energy = balls.over(energy, self.span) if self.outwards is None else energy
        rates = self._rates(energy * self.per_inertia, unknown)
        yield next(rates)
        yield next(rates) * self.per_inertia
        yield next(rates)

    def square_rates(self, square: Any, unknown: Any) -> tuple[Any, Any]:
        """dv/dphi of v = ½ omega² (rad/s²), and its slope by v."""
        square = balls.over(square, self.span) if self.outwards is None else square
        moment, by_square, _ = self._rates(square, unknown)
        return (moment - square * self.slope) * self.per_inertia, (by_square - self.slope) * self.per_inertia

    def _rates(self, square: Any, unknown: Any) -> Iterator[Any]:
        """dE/dphi, and its slopes by ½ omega² and by the unknown."""
        speed, (moments, by_speed, by_unknown, inertias, slopes), bare, _ = self._moments(square, unknown)
        if len(self.stages) == 1:
            yield moments[0]
            yield by_speed[0] / speed
            yield by_unknown[0]
            return
        possible = [self._factors(self.outwards)] if self.outwards is not None else self._possible(inertias, bare)

        def less_lost(kept: Sequence[Any], rest: Sequence[Any]) -> Any:
            """A sum over all stages without what meshes lose of it, for all possible sides."""
            return _either(sum(kept) - lost(factors, balanced(inertias, rest, factors)[1]) for factors in possible)

        yield less_lost(moments, bare)
        curved = [slope * speed - change for slope, change in zip(slopes, by_speed, strict=True)]
        yield less_lost(by_speed, curved) / speed
        yield less_lost(by_unknown, [-each for each in by_unknown])

    def decisive(self, square: Any, unknown: Any) -> list[Any]:
        """The differences that decide branches of torques; then the moments (N m, at the crank) outwards through meshes."""
        assert self.outwards is not None
        _, rows, bare, differences = self._moments(square, unknown)
        if len(self.stages) == 1:
            return differences
        factors = self._factors(self.outwards)
        return [*differences, *passed_by(balanced(rows[3], bare, factors)[1], self.stages, factors, None)[0][1:]]

    def all_over(self) -> EnergyLaw:
        """The same with a ball in place of each series."""
        return self._replace(
            inertia=_all_over(self.inertia), slope=_all_over(self.slope), known=list(map(_all_over, self.known))
        )

    def _moments(self, square: Any, unknown: Any) -> tuple[Any, list[list[Any]], list[Any], list[Any]]:
        """The speed, from ½ omega²; all stages' rows, the flywheel among inertias; ½ I' omega² - M of each; what decides.

        Of a single stage, I* and its slope are not among the rows: nothing is lost there.
        """
        speed = balls.JETS.sqrt(2 * square)
        rows, differences = self.late(self._sign_of, *self.known, speed, unknown)
        moments, by_speed, by_unknown, inertias, slopes = (list(rows[k :: len(_SMOOTH)]) for k in range(len(_SMOOTH)))
        inertias = [own + self.wheel * stage.carries_flywheel for stage, own in zip(self.stages, inertias, strict=False)]
        bare = [slope * square - moment for slope, moment in zip(slopes, moments, strict=False)]
        return speed, [moments, by_speed, by_unknown, inertias, slopes], bare, differences

    def _sign_of(self, number: int, difference: Any) -> int | None:
        if self.outwards is None:
            return _own_sign(number, difference) if self.jumps else possible_sign(number, difference)
        return _own_sign(number, difference) if self.signs is None else self.signs[number]

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
            if not any(tau < 0 if out else tau > 0 for tau, out in zip(map(value_of, passed[1:]), outwards, strict=True)):
                possible.append(factors)
        return possible


class _PieceStretch(NamedTuple):
    """Part of a smooth piece, from a place on, and the sides of meshes there; None about an angle at which one changes.

    `inertia` gives I* and its slope, `early` what position alone gives, from which `late` gives all stages' rows.
    """

    low: Any
    piece: int
    outwards: tuple[bool, ...] | None
    inertia: Callable[..., Any]
    early: Callable[..., Any]
    late: Branches
    jumps: bool

    def laws(self, cell: Model, stages: tuple[MeshStage, ...], known: Callable[..., Any]) -> list[EnergyLaw]:
        """The law about the middle of a cell, and about every place of it."""
        places = (known(self, balls.variable(centre)) for centre in (cell.middle, cell.low.union(cell.high)))
        return [
            EnergyLaw(stages, inertia, early, self.late, self.outwards, cell.span, self.jumps) for inertia, early in places
        ]


def rate_functions(walk: StretchWalk, stages: int, functions: Any = balls.NAMESPACE) -> tuple[Any, Any, Branches]:
    """I* and its slope; what position alone gives of the moments; and all stages' rows from that and the speed."""
    assert walk.rate is not None
    rows = range(len(RATE), len(walk.rate.outputs), len(STAGE))
    outputs = tuple(walk.rate.outputs[row + k] for row in rows for k in _SMOOTH)
    early, late = walk.rate._replace(outputs=outputs).only(3 if stages == 1 else len(outputs)).split(2)
    return over_balls(walk.program, 2, functions), over_balls(early, functions=functions), Branches(late, functions)


def _stretches(structure: Structure, edges: Sequence[Any], near: NearMotion, reach: Any) -> Iterator[_PieceStretch]:
    """The smooth pieces, divided at a reach from the angles at which the motion near has a mesh or a torque switch."""
    for piece, (walk, (low, high)) in enumerate(zip(structure.walks, pairwise(edges), strict=True)):
        functions = rate_functions(walk, len(structure.twin.stages))
        reversals = [balls.exact(angle) for angle, _ in near.outwards if low + reach < angle < high - reach]
        places = [low, *sorted(angle + side * reach for angle in reversals for side in (-1, 1)), high]
        for k, ends in enumerate(pairwise(places)):
            outwards = max(each for each in near.outwards if sum(ends) / 2 >= each[0])[1]
            yield _PieceStretch(ends[0], piece, None if k % 2 else outwards, *functions, structure.twin.jumps_at_speeds)


class MotionPlace(NamedTuple):
    """A cell of a motion in a piece: the law with the sides of meshes and switches, and the polynomial of ½ omega²."""

    cell: Model
    piece: int
    law: EnergyLaw
    square: Any


def sides_kept(cell: Any, squares: Sequence[Any], laws: Sequence[EnergyLaw], unknown: Any, order: int) -> Iterator[bool]:
    """Switches, then meshes: true for one that is on its side all over a cell.

    Args:
        cell: with its ends, middle and span.
        squares: series of ½ omega² about its middle and about every place of it.
        laws: likewise, with a flywheel.
        unknown: of the loads.
        order: of the series.

    """
    assert laws[0].outwards is not None
    values, cut = (law.decisive(each, unknown) for law, each in zip(laws, squares, strict=True))
    sides = [*(laws[0].signs or ()), *(1 if out else -1 for out in laws[0].outwards)]
    first = len(values) - len(sides)  # without signs of their own, switches have to show theirs
    for side, inner, outer in zip(sides, values[first:], cut[first:], strict=True):
        beyond = -(side or 1) * balls.enclosing(inner, outer, order)
        curve = balls.BallCurve(cell.low - cell.middle, cell.high - cell.middle, beyond, beyond.derivative())
        idle = all(term.is_zero() for term in beyond.coeffs())  # a mesh that loses nothing either way
        error = _SIDE * abs(float(beyond(0).mid())) + _LOOSE * float(beyond(0).rad())
        yield idle or bool(balls.greatest([curve], error) < 0)


def check_sides(cell: Any, squares: Sequence[Any], laws: Sequence[EnergyLaw], unknown: Any, order: int) -> None:
    """Refuses a motion with a switch on its other side, or a mesh driven from its other side, somewhere in a cell."""
    if laws[0].outwards is not None and not all(sides_kept(cell, squares, laws, unknown, order)):
        raise UnprovenError(f"on which side of a switch or of a mesh the motion is at {float(cell.middle):.6g} rad")


class SpeedBalls(NamedTuple):
    """The greatest and the least speed of a motion; `start` is the ball of E at the beginning of the cycle."""

    fast: Any
    slow: Any
    start: Any

    @property
    def level(self) -> Any:
        """Mean of the two."""
        return (self.fast + self.slow) / 2

    @property
    def irregularity(self) -> Any:
        """Difference of the two over their mean."""
        return 2 * (self.fast - self.slow) / (self.fast + self.slow)

    def growth(self, before: SpeedBalls, step: Any) -> tuple[Any, Any]:
        """Growth of level and irregularity from another motion, for each unit of a step."""
        return ((self.level - before.level) / step).mid(), ((self.irregularity - before.irregularity) / step).mid()


class Motions:
    """Steady motions of a machine with any flywheel and balance."""

    def __init__(self, structure: Structure, columns: Sequence[Any], near: NearMotion, order: int, left: float) -> None:
        self._near, self._order, self._left = near, order, left
        self._unknown = balls.exact(near.unknown)
        self._per_unknown: tuple[Any, Any] | None = None  # effect of the unknown on the speed and on the irregularity
        assert structure.efficiencies is not None
        efficiencies = over_balls(structure.efficiencies)(rational(0, 1), *columns)
        stages = tuple(
            stage._replace(efficiency=each) for stage, each in zip(structure.twin.stages, efficiencies, strict=True)
        )
        edges = edges_of(structure, columns)
        reach = balls.exact(_AT_SWITCH * max(near.irregularity, _LEAST_UNEVEN) ** 0.5)
        stretches = self._stretches = list(_stretches(structure, edges, near, reach))
        self._switches = len(stages) > 1 or structure.twin.switches_at_speeds
        speed = balls.exact(near.omega)
        first = balls.ball(stretches[0].inertia(edges[0], *columns)[0])
        value = ((first + balls.exact(near.wheel)) * speed**2 / 2).mid()
        self._allowed = _OPEN_MOTION * left * float(value)  # the part of E that a motion may leave open

        places: dict[Any, tuple[Any, Any]] = {}

        def known(stretch: _PieceStretch, phi: Any) -> tuple[Any, Any]:
            """I* and what else position alone gives about a place, calculated once."""
            place = (balls.key(stretch.low), balls.key(balls.first(phi)), isinstance(phi, type(first)))
            if place not in places:
                places[place] = stretch.inertia(phi, *columns)[0], stretch.early(phi, *columns)
            return places[place]

        def rows(stretch: _PieceStretch, phi: Any) -> Any:
            inertia, early = known(stretch, phi)
            return inertia, sum(stretch.late(_middle_sign, *early, speed, self._unknown)[0][:: len(_SMOOTH)])

        functions = [partial(rows, each) for each in stretches]
        cells = cells_of(functions, [*(each.low for each in stretches), edges[-1]], order, left)
        self._cells, self._laws, self._polynomials = list[Model](), list[Sequence[EnergyLaw]](), list[Any]()
        self._inertias = list[tuple[Any, Any]]()  # I* about the middle of each cell, and about every place of it
        self._loaded = dict[Any, list[Any]]()
        todo = cells[::-1]
        while todo:
            cell = todo.pop()
            laws = stretches[cell.stretch].laws(cell, stages, known)
            inertias = laws[0].inertia, laws[1].inertia
            narrow = cell.high - cell.low < reach
            if laws[0].outwards is None:
                laws = [laws[1].all_over()] * 2
            own, followed = self._followed(cell, laws, value, narrow)
            open_still = self._switches and laws[0].outwards is not None and own is None
            if open_still and (narrow or near.irregularity < _LEAST_UNEVEN):  # where a piece begins, or a mesh idles
                own, followed = self._followed(cell, [laws[1].all_over()._replace(outwards=None)] * 2, value, narrow)
            if own is None and narrow and structure.twin.jumps_at_speeds:
                raise UnprovenError(f"a torque that may jump at a speed, at {float(cell.middle):.6g} rad")
            if own is None and narrow:
                raise UnprovenError(f"the motion at {float(cell.middle):.6g} rad")
            if own is None:
                todo += reversed(balls.halves(functions[cell.stretch], cell, order))
            else:
                self._cells.append(cell)
                self._laws.append(followed)
                self._polynomials.append(own)
                self._inertias.append(inertias)
                value = own(cell.high - cell.middle).mid()
            if len(self._cells) + len(todo) > _MOST_CELLS:
                raise WorkLimitError("that a motion through so many cells is found in time")
        self._effort = max(abs(float(cell.polynomials[MOMENT][0].mid())) for cell in self._cells)
        sums = EnergySums(self._cells, [(0 * cell.polynomials[0], 0 * cell.polynomials[0]) for cell in self._cells])
        self.bounds = -sums.greatest(0, 1, left, -1), sums.greatest(0, 1, left)
        self._tubes: tuple[Any, ...] = ()
        self._ranges = (balls.exact(0), balls.exact(0))
        self._growing: Sequence[balls.Growth] = ()
        self.effect = 0  # sign of the unknown's effect on all motions in the tubes

    def _followed(self, cell: Model, laws: Sequence[EnergyLaw], value: Any, narrow: bool) -> tuple[Any, Sequence[EnergyLaw]]:
        """The polynomial of E in a cell on the motion near, from E at its low end, and the laws there with their signs.

        None where the cell is too wide: where polynomials miss the motion by more than they may, or where the sides of
        meshes or of switches are not proven. A narrow cell may leave the sides open.
        """
        most = _DEFECT * self._allowed
        try:
            laws = [law.loaded(balls.exact(self._near.wheel)) for law in laws]
            place = self._place(cell, laws, self._unknown)
            own = balls.solution(place, value, balls.line(value, 0), self._order, _DEFECT * most)
            if self._switches and laws[0].outwards is not None:
                middle = laws[0].decisive(balls.series(own, self._order) * laws[0].per_inertia, self._unknown)
                signs = tuple(_middle_sign(0, each) for each in middle[: len(middle) - len(laws[0].outwards)])
                laws = [law._replace(signs=signs) for law in laws]
                place = self._place(cell, laws, self._unknown)
                check_sides(place, self._squares_in(place, own, laws), laws, self._unknown, self._order)
            unsided = narrow and laws[0].outwards is None
            if not (unsided or balls.missed(place, own, self._order) * (cell.high - cell.low) < most):
                return None, laws
        except (ArithmeticError, ValueError):  # UnprovenError is one
            return None, laws
        return own, laws

    def _squares_in(self, cell: balls.BallPlace, energy: Any, laws: Sequence[EnergyLaw]) -> list[Any]:
        """The series of ½ omega² about the middle of a cell and all over it, from the polynomial of E."""
        return [each * law.per_inertia for each, law in zip(balls.pair(energy, cell.span, self._order), laws, strict=True)]

    @staticmethod
    def _place(cell: Model, laws: Sequence[EnergyLaw], unknown: Any) -> balls.BallPlace:
        """The laws in a cell with a flywheel and a value of the unknown."""
        about, all_over = (partial(law.rates, unknown=unknown) for law in laws)
        return balls.BallPlace(cell.low, cell.high, cell.middle, about, about, all_over)

    def _with_wheel(self, wheel: Any) -> list[Any]:
        """The laws of each cell with a flywheel, and the polynomial of 1/(I* + J); those of the last few are kept."""
        key = balls.key(wheel)
        if key not in self._loaded:
            if len(self._loaded) >= _MOST_WHEELS:
                self._loaded.pop(next(iter(self._loaded)))
            rows = self._loaded[key] = []
            for laws, (about, all_over) in zip(self._laws, self._inertias, strict=True):
                per_inertia = balls.enclosing(1 / (about + wheel), 1 / (all_over + wheel), self._order)
                rows.append(([law.loaded(wheel) for law in laws], per_inertia))
        return self._loaded[key]

    def near(self, wheel: Any, unknown: Any) -> SpeedBalls:
        """The speeds of the motion with a flywheel (kg m² at the crank) and a value of the unknown, not proven."""
        places = [
            self._place(cell, laws, unknown) for cell, (laws, _) in zip(self._cells, self._with_wheel(wheel), strict=True)
        ]
        self._growing = self._growing or balls.growths(places, self._order, self._polynomials)
        error = _DEFECT * self._allowed
        self._polynomials = [*balls.approached(places, self._order, error, self._polynomials, self._growing)[0]]
        return self._speeds(wheel, balls.exact(0), balls.exact(0))

    def at(self, wheel: Any, unknown: Any) -> SpeedBalls:
        """The speeds of the motion with a flywheel (kg m² at the crank) and a value of the unknown."""
        numbers, sizes = (wheel, unknown), (abs(wheel), max(abs(unknown), balls.exact(self._effort)))
        if not (self._tubes and all(wide.contains(own) for wide, own in zip(self._ranges, numbers, strict=True))):
            reaches = (_RANGE * size + _BRACKET * own.rad() for own, size in zip(numbers, sizes, strict=True))
            low, high = (balls.around(own.mid(), reach) for own, reach in zip(numbers, reaches, strict=True))
            self._ranges, self._tubes = (low, high), ()
        ranged = ((cell, laws) for cell, (laws, _) in zip(self._cells, self._with_wheel(self._ranges[0]), strict=True))
        places = [
            self._place(cell, laws, self._ranges[1])._replace(inner=partial(own[0].rates, unknown=unknown))
            for (cell, laws), (own, _) in zip(ranged, self._with_wheel(wheel), strict=True)
        ]
        self._growing = self._growing or balls.growths(places, self._order, self._polynomials)
        orbit = balls.periodic(places, self._order, self._allowed, self._polynomials, self._tubes, self._growing)
        if orbit.tubes is not self._tubes:
            if self._switches and not self._decided(places, orbit.tubes):
                return self.at(wheel, unknown)
            self._tubes = orbit.tubes
            of_unknown = [(cell.high - cell.low, *tube.rates[:0:-1]) for cell, tube in zip(places, orbit.tubes, strict=True)]
            self.effect = balls.one_way(of_unknown)
        self._polynomials = list(orbit.polynomials)
        return self._speeds(wheel, orbit.reach, orbit.start)

    def places(self) -> Iterator[MotionPlace]:
        """The cells of the last motion."""
        for cell, laws, square in zip(self._cells, self._laws, self._squares, strict=True):
            yield MotionPlace(cell, self._stretches[cell.stretch].piece, laws[0], square)

    def _decided(self, places: Sequence[balls.BallPlace], tubes: Sequence[balls.Tube]) -> bool:
        """Tests whether meshes and switches keep to their sides in all tubes; in other cells their sides are left open.

        Raises UnprovenError where a torque may jump, which has no slope then.
        """
        undecided = list[int]()
        for k, (place, tube, (laws, _)) in enumerate(zip(places, tubes, self._with_wheel(self._ranges[0]), strict=True)):
            try:
                squares = self._squares_in(place, tube.polynomial + balls.around(0, tube.radius), laws)
                check_sides(place, squares, laws, self._ranges[1], self._order)
            except UnprovenError:
                if laws[0].jumps:
                    raise
                undecided.append(k)
        for k in undecided:
            self._laws[k] = [self._laws[k][1].all_over()._replace(outwards=None)] * 2
        if undecided:
            self._loaded.clear()
        return not undecided

    def _speeds(self, wheel: Any, reach: Any, start: Any) -> SpeedBalls:
        """The extreme speeds of motions with a flywheel no farther from the polynomials than a reach."""
        rows = zip(self._polynomials, self._with_wheel(wheel), strict=True)
        motions = self._squares = [(own + balls.around(0, reach)) * per_inertia for own, (_, per_inertia) in rows]
        total = self.bounds[0] + wheel
        size = self._near.omega**2 / 2
        least = _LOOSE * self._left * size + _BRACKET * float((reach + size * wheel.rad()) / total)

        def extreme(sign: int) -> Any:
            curves = (
                balls.BallCurve(cell.low - cell.middle, cell.high - cell.middle, sign * own, sign * own.derivative())
                for cell, own in zip(self._cells, motions, strict=True)
            )
            return (2 * sign * balls.greatest(curves, least)).sqrt()

        return SpeedBalls(extreme(1), extreme(-1), start)

    def _slopes(self, here: SpeedBalls, wheel: Any) -> tuple[Any, Any]:
        """Effects of a unit of the unknown on the speed and on the irregularity, near a motion with a flywheel."""
        if self._per_unknown is None:
            step = balls.exact(_SECANT * max(abs(self._near.unknown), self._effort))
            self._per_unknown = self.near(wheel, self._unknown + step).growth(here, step)
            if self._per_unknown[0].is_zero():
                raise UnprovenError("the effect of the balance on the speed")
        return self._per_unknown

    def balance(self, wheel: Any, speed: Any, apart: Any = None) -> tuple[Any, SpeedBalls]:
        """The ball of the unknown with which a motion has a speed, near that of the last motion, and its speeds.

        apart: half its width at first; None for one from the motion with the last unknown.
        """
        if apart is None:
            here = self.at(wheel, self._unknown)
            slope = self._slopes(here, wheel.mid())[0]
            rest = (speed - here.level) / slope
            self._unknown = (self._unknown + rest).mid()
            apart = (_BRACKET * (rest.rad() + self._left * speed / abs(slope)) + _MISSED * abs(rest)).upper()
        for _ in range(_MOST_WIDER):
            low, high = (self.at(wheel, self._unknown + side * self.effect * apart) for side in (-1, 1))
            if self.effect and low.level < speed < high.level:  # every motion between has speeds between theirs
                return balls.around(self._unknown, apart), SpeedBalls(*map(balls.hull, zip(low, high, strict=True)))
            apart *= _WIDER
        raise UnprovenError("that the mean speed is the required one with a balance near")

    def for_irregularity(self, asked: Any, *speeds: Any) -> tuple[Any, list[tuple[Any, SpeedBalls]]]:
        """The ball of the flywheel with which a motion has an irregularity; unknown and speeds at both of its ends."""
        wheel, zero = balls.exact(self._near.wheel), rational(0, 1)
        here, step = self.near(wheel, self._unknown), (wheel * balls.exact(_SECANT)).mid()
        of_level, of_uneven = self._slopes(here, wheel) if speeds else (rational(1, 1), zero)
        level, uneven = self.near(wheel + step, self._unknown).growth(here, step)
        share = level / of_level if speeds else zero
        uneven -= share * of_uneven  # the unknown follows the flywheel
        for _ in range(_NEWTON):
            change = (speeds[0] - here.level) / of_level if speeds else zero
            rest = (asked - here.irregularity - of_uneven * change) / uneven
            if not rest.is_finite():
                raise UnprovenError("a steady motion that is stable")
            self._unknown, wheel = (self._unknown + change - share * rest).mid(), (wheel + rest).mid()
            here = self.near(wheel, self._unknown)
            if abs(rest) < _SETTLED * abs(wheel):
                break
        here, unknown = self.at(wheel, self._unknown), self._unknown
        apart = (_BRACKET**2 * (abs(asked - here.irregularity) + self._left) / uneven).abs_upper()
        for _ in range(_MOST_WIDER):
            ends = list[tuple[Any, SpeedBalls]]()
            for side in (-1, 1):
                self._unknown, own = (unknown - side * share * apart).mid(), wheel + side * apart
                off = [abs(speed - here.level) + self._left * speed + _MISSED * abs(level * apart) for speed in speeds]
                missed = [(_BRACKET * each / of_level).abs_upper() for each in off]
                ends.append(self.balance(own, *speeds, *missed) if speeds else (zero, self.at(own, zero)))
            self._unknown = unknown
            if ends[0][1].irregularity > asked > ends[1][1].irregularity:
                return balls.around(wheel, apart), ends
            apart *= _WIDER
        raise UnprovenError("that the irregularity is the required one with a flywheel near")
