"""Proven intervals of a sizing's figures, for the numbers of a scene as they are written in decimals.

The machine's reduction is recorded with every number of the scene as an input, breakpoints included, and the recorded
program is evaluated over balls: another kind of numbers, the same machine. Works follow from Taylor models between the
proven breakpoints, extremes from bisection. A figure's interval holds its true value for the model that the scene describes;
of the model itself nothing is proven.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from importlib.util import find_spec
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bondgraph.recording import Program
from flywheel.machine.programs import RATE, Structure, recorded
from flywheel.numerics.units import exact_ratio
from flywheel.reading.paths import dotted
from flywheel.scene.scene import Scene, Table
from flywheel.sizing.results import Proof

if TYPE_CHECKING:
    from flywheel.numerics.balls import Model

WIDTH = 1e-12
"""The relative width that intervals reach, or else are refused with the width reached."""
MISSING = "python-flint, which is not installed: pip install 'flywheel-design[proof]'"
_PRECISIONS = ((96, 14, 1e-18), (192, 24, 1e-34))  # bits, order of the polynomials, what cells leave open
_SAME = 2.0**-60  # of two numbers: what they agree to within counts as the same
_OF_PI = 1  # units of the 60th digit: units of angle have pi to 60 digits
_READ = 1e-15  # by how much a number may differ from the float that was read
_PROVEN = "for the scene's numbers as written in decimals"
_LOOSE = 64.0  # what extremes leave open, over what cells do
_MOST_CELLS = 60  # of a motion, above the first precision: more would take a thousand times as long as a sizing
_OPEN_MOTION = 1e4  # what a motion may leave open, over what cells do, of its energy
_SECANT, _APART = 1e-8, 2e-14  # of a flywheel: from which its irregularity is followed, and between which it is proven
_ROWS = ("inertia", "slope", "moment", "per_unknown")
_INERTIA, _SLOPE, _MOMENT, _UNKNOWN = range(4)


class Motion(NamedTuple):
    """A motion near the one that is to be proven: its flywheel at the crank (kg m²), the unknown, the speed at phi = 0."""

    wheel: float
    unknown: float
    omega: float


def proven(scene: Scene, motion: Motion | None = None) -> Proof:
    """The proof of a scene's figures, or the reason why there is none.

    Where torques depend on speed, the figures of the motion are proven near the one given.

    >>> import flywheel
    >>> yoke = {"mechanism": {"type": "scotch-yoke", "crank": {"length": 0.5}, "yoke": {"mass": 20}},
    ...         "load": [{"on": "yoke", "force": 1000, "from": 0, "to": "180 deg"}],
    ...         "drive": {"torque": "balance"}, "regime": {"speed": "60 rpm"},
    ...         "flywheel": {"irregularity": 0.04}}
    >>> low, high = proven(flywheel.load(yoke)).figures["flywheel.exact"]
    >>> f"{low:.9f} {high:.9f}", high - low < 1e-12 * high
    ('353.521427322 353.521427322', True)

    """
    started = time.process_time()
    figures: dict[str, tuple[float, float]] = {}
    reason, same = _refusal(scene), 0
    if not reason:
        try:
            figures, same = _figures(scene, motion)
        except NameError as error:
            reason = f"a function that balls do not have ({error.name})"
        except (ValueError, ArithmeticError) as error:
            reason = str(error)
    return Proof(figures, reason, _statement(scene, figures, same), time.process_time() - started)


def _refusal(scene: Scene) -> str:
    """The reason why a scene's figures cannot be proven, by its contents; an empty text where they may be."""
    if find_spec("flint") is None:
        return MISSING
    if scene.document is None:
        return "a scene that was not read has no numbers as written"
    if scene.areas is not None:
        return "a diagram of areas has no machine"
    if any(mechanism.linkage is not None for mechanism in scene.mechanisms):
        return "positions of linkages are solved for, not given by formulas"
    if any(efficiency < 1.0 for efficiency in scene.efficiencies.values()):
        return "meshes have losses"
    for load in (*scene.loads, *([] if scene.drive is None else [scene.drive])):
        if isinstance(load.law, Table):
            return f"{load.path}: a table's pieces are calculated in floats"
    return ""


def _statement(scene: Scene, figures: dict[str, tuple[float, float]], same: int) -> str:
    """A line on what is proven and what is not."""
    if not figures:
        return "nothing is proven"
    taken = f"; {same} pairs of numbers that agree to 18 digits count as equal" if same else ""
    only = "; not proven: that no lighter flywheel will do, and that no other motion is steady" * scene.depends_on_speed
    return f"proven {_PROVEN}: {', '.join(figures)}{taken}{only}; not proven: that the model is the machine"


# -- the machine over balls ------------------------------------------------------------------------------------------------


def _figures(scene: Scene, motion: Motion | None) -> tuple[dict[str, tuple[float, float]], int]:
    """Every figure that can be proven, by its key, and how many pairs of numbers count as equal."""
    from flywheel.numerics import balls

    assert scene.document is not None
    quantities = {dotted(path): quantity for path, quantity in scene.document.quantities.items()}
    structure = recorded(scene, tuple(quantities), [quantity.number for quantity in quantities.values()], zeros=True)
    open_still = balls.UnprovenError("nothing")
    for bits, order, left in _PRECISIONS:
        with balls.precision(bits, order):
            columns = [_as_written(*each) for each in quantities.items()]
            same = _kept(structure, columns)
            try:
                found = (
                    _moving(scene, structure, columns, (order, left), motion)
                    if scene.depends_on_speed
                    else _cycle(scene, structure, columns, order, left)
                )
            except balls.UnprovenError as error:
                open_still = error
                continue
            width = max(_widths(found).values())
            if width <= WIDTH:
                return {name: balls.ends(ball) for name, ball in found.items()}, same
            open_still = balls.UnprovenError(f"intervals stay {width:.1e} wide, more than {WIDTH:g}")
    raise open_still


def _widths(found: Mapping[str, Any]) -> dict[str, float]:
    """The width of every ball over the larger of the figure and its scale: the fluctuation, the flywheels' total, max I*."""
    scales = {"accumulated_max": "energy_fluctuation", "accumulated_min": "energy_fluctuation"}
    scales |= {"reduced_inertia.min": "reduced_inertia.max"}
    scales |= {name: "flywheel.approximate_total" for name in found if name.startswith("flywheel.")}
    widths = {}
    for name, ball in found.items():
        size = max(abs(float(found[one].mid())) for one in (name, scales.get(name, name)) if one in found)
        widths[name] = 0.0 if ball.rad().is_zero() else 2.0 * float(ball.rad()) / max(size, 1e-300)
    return widths


def _as_written(path: str, quantity: Any) -> Any:
    """The ball of a number as the scene writes it."""
    from flywheel.numerics.balls import UnprovenError, rational

    ball = rational(*exact_ratio(quantity.value, None if path.startswith("parameters.") else quantity.dimension))
    if abs(float(ball.mid()) - quantity.number) > _READ * abs(quantity.number):
        raise UnprovenError(f"{path}: {quantity.value!r} is not taken as it is written")
    return ball * (1 + _OF_PI * rational(1, 10**60).union(rational(-1, 10**60)))


def _over_balls(program: Program, outputs: int | None = None) -> Callable[..., Any]:
    """A recorded program as a function of balls, and of series of them: of its first outputs."""
    from flywheel.numerics import balls

    part = program if outputs is None else program.only(outputs)
    if not part.plain:
        raise balls.UnprovenError("a function or a table that is not arithmetic")
    return part._replace(places=tuple(map(balls.constant, part.places))).function(balls.NAMESPACE)


def _kept(structure: Structure, columns: Sequence[Any]) -> int:
    """Check every decision that recording took, over balls; how many rest on two numbers that are the same."""
    from flywheel.numerics import balls

    conditions, same = structure.conditions, 0
    program = conditions.program._replace(places=tuple(map(_threshold, conditions.program.places)))
    differences = program.function(balls.NAMESPACE)(balls.rational(0, 1), *columns)
    for difference, relation, holds in zip(differences, conditions.relations, conditions.holds, strict=True):
        ball = difference if hasattr(difference, "rad") else balls.rational(int(difference), 1)
        negative, zero = bool(ball < 0), bool(ball.is_zero())
        if zero or negative or ball > 0:
            answer = {"less": negative, "less_equal": negative or zero, "equal": zero}[relation]
            if answer != holds:
                raise balls.UnprovenError("a decision that the numbers as written take the other way")
        elif abs(float(ball.mid())) + float(ball.rad()) < _SAME:
            same += 1
        else:
            raise balls.UnprovenError("a decision that is open")
    return same


def _threshold(value: float) -> Any:
    """The ball of a number in a decision: a threshold of the reader is the float that it is."""
    from flywheel.numerics import balls

    try:
        return balls.constant(value)
    except balls.UnprovenError:
        return balls.exact(value)


def _cycle(scene: Scene, structure: Structure, columns: Sequence[Any], order: int, left: float) -> dict[str, Any]:
    """The balls of the figures of a cycle, by their keys."""
    from flywheel.numerics import balls

    zero = balls.rational(0, 1)
    asked = scene.irregularity is not None
    given = [structure.numbers.outputs[k] for k in ((0, 2, 1) if asked else (0, 2, 5))]
    speed, ratio, last = _over_balls(structure.numbers._replace(outputs=tuple(given)), 3)(zero, *columns)
    square = ratio * ratio
    edges = _edges(structure, columns)
    walks = [_over_balls(walk.program, len(_ROWS)) for walk in structure.walks]
    cells = _cells([lambda phi, walk=walk: walk(phi, *columns) for walk in walks], edges, order, left)  # type: ignore[misc]
    figures = {"speed": balls.ball(speed)}
    balance = zero
    if structure.unknown:
        net, effect = (sum((_gain(cell, k) for cell in cells), zero) for k in (_MOMENT, _UNKNOWN))
        balance = -net / effect
        figures["balance.value"] = balance
    sums = _Sums(cells, _works(cells, balance))
    work, low_work = sums.greatest(zero, left), -sums.greatest(zero, left, -1)
    inertia, least = sums.inertia(left), -sums.inertia(left, -1)
    figures |= {"accumulated_max": work, "accumulated_min": low_work, "energy_fluctuation": work - low_work}
    figures |= {"reduced_inertia.min": least, "reduced_inertia.max": inertia}
    if not asked:
        eps = sums.irregularity(balls.ball(speed), last * square, (least, inertia), left)
        figures |= {"simulation.irregularity": eps, "simulation.speed_max": speed * (1 + eps / 2)}
        return figures | {"simulation.speed_min": speed * (1 - eps / 2)}
    eps = last
    unit = eps * speed**2
    fast, slow, even = (-(speed**2) * factor / 2 for factor in ((1 + eps / 2) ** 2, (1 - eps / 2) ** 2, 1))
    exact = (sums.greatest(fast, left) + sums.greatest(slow, left, -1)) / unit
    torque = (sums.greatest(even, left) + sums.greatest(even, left, -1)) / unit
    total = (work - low_work) / unit
    figures["flywheel.exact"] = balls.positive(exact) / square
    figures["flywheel.approximate"] = balls.positive(total - least) / square
    figures["flywheel.approximate_total"] = total / square
    figures["flywheel.inertia_torque"] = torque / square
    figures["flywheel.inertia_torque_flywheel"] = balls.positive(torque - least) / square
    return figures


def _edges(structure: Structure, columns: Sequence[Any]) -> list[Any]:
    """Balls of the edges of smooth pieces.

    Where Newton's method has followed the zero of a function, that zero is proven anew, so that the float which it began
    at does not count. An edge inside a piece is wherever it is: nothing breaks there.
    """
    from flywheel.numerics import balls

    zero, marks = balls.rational(0, 1), structure.landmarks

    def loosely(program: Program) -> Any:
        part = program.only(1)
        found = part._replace(places=tuple(map(_threshold, part.places))).function(balls.NAMESPACE)(zero, *columns)
        return balls.ball(found[0])

    zeros = [(loosely(program), program._replace(outputs=program.outputs[1:])) for program in structure.zeros]
    edges = []
    for k, output in enumerate(marks.outputs):
        program = marks._replace(outputs=(output,))
        angle = loosely(program)
        followed = next((own for at, own in zeros if at.mid() == angle.mid() and at.rad() == angle.rad()), None)
        if 0 < k < len(structure.walks) and structure.walks[k - 1] is structure.walks[k]:
            edges.append(angle)
        elif followed is None:
            edges.append(balls.ball(_over_balls(program, 1)(zero, *columns)[0]))
        else:
            function = _over_balls(followed, 2)
            edges.append(balls.zero_near(lambda phi, at=function: at(phi, *columns), angle))  # type: ignore[misc]
    return edges


def _cells(functions: Sequence[Callable[[Any], Any]], edges: Sequence[Any], order: int, left: float) -> list[Model]:
    """Models of I*, dI*/dphi, M* and whatever else functions of the stretches give, on cells all over the cycle."""
    from flywheel.numerics import balls

    stretches = list(pairwise(edges))
    scales: Any = 0.0
    for function, (low, high) in zip(functions, stretches, strict=True):
        for share in (0.2, 0.5, 0.8):
            at = balls.exact(float(low) + share * float(high - low))
            scales = np.maximum(scales, [abs(float(balls.ball(value))) for value in function(at)])
    errors = [left * (scale or 1.0) for scale in scales.tolist()]
    found: list[Model] = []
    for function, (low, high) in zip(functions, stretches, strict=True):
        found += balls.models(function, low, high, order, errors)
    return found


def _gain(cell: Model, k: int) -> Any:
    return cell.integral(k)(cell.high - cell.middle)


def _works(cells: Sequence[Model], balance: Any) -> Iterator[tuple[Any, Any]]:
    """W and M* in each cell, with the unknown's share."""
    start = 0 * balance
    for cell in cells:
        rising = cell.integral(_MOMENT) + balance * cell.integral(_UNKNOWN) + start
        yield rising, cell.polynomials[_MOMENT] + balance * cell.polynomials[_UNKNOWN]
        start = rising(cell.high - cell.middle)


class _Sums:
    """An energy, given with its slope cell by cell, and I* all over the cycle as polynomials, and their extremes."""

    def __init__(self, cells: Sequence[Model], energies: Iterable[tuple[Any, Any]]) -> None:
        self._curves = [(cell, *energy) for cell, energy in zip(cells, energies, strict=True)]
        ends = (abs(energy(cell.high - cell.middle)) for cell, energy, _ in self._curves)
        self._size = max(float(end.mid()) for end in ends)
        self._largest = max(abs(float(cell.polynomials[_INERTIA][0].mid())) for cell in cells)

    def greatest(self, factor: Any, left: float, sign: int = 1) -> Any:
        """The greatest of sign (W + factor I*)."""
        from flywheel.numerics.balls import Curve, greatest

        curves = [
            Curve(
                cell.low - cell.middle,
                cell.high - cell.middle,
                sign * (rising + factor * cell.polynomials[_INERTIA]),
                sign * (moment + factor * cell.polynomials[_SLOPE]),
            )
            for cell, rising, moment in self._curves
        ]
        return greatest(curves, _LOOSE * left * (self._size + abs(float(factor)) * self._largest))

    def irregularity(self, speed: Any, wheel: Any, bounds: tuple[Any, Any], left: float) -> Any:
        """The irregularity e with a given flywheel J, by the mean value theorem.

        g(e) = max(W - ½ w² (1 + e/2)² (I* + J)) - min(W - ½ w² (1 - e/2)² (I* + J)) falls by w² (I* + J) of some angles for
        each unit of e. So e = e' + g(e')/(w² K) for any e', K between the least and the greatest I* + J.

        Args:
            speed: w, the mean of the extreme speeds, rad/s.
            wheel: J at the crank, kg m².
            bounds: least and greatest I*, kg m².
            left: what cells leave open, relative.

        Raises UnprovenError where no motion is proven: the flywheel is too light.

        """
        from flywheel.numerics import balls

        def gap(at: Any) -> Any:
            fast, slow = (-(speed**2) * (1 + side * at / 2) ** 2 / 2 for side in (1, -1))
            return self.greatest(fast, left) + self.greatest(slow, left, -1) + wheel * (fast - slow)

        slope = speed**2 * (bounds[0].union(bounds[1]) + wheel)
        eps = balls.falling_zero(gap, slope, balls.rational(0, 1))
        if not (slope > 0 and eps < 2):
            raise balls.UnprovenError("the motion with a flywheel so light")
        return eps

    def inertia(self, left: float, sign: int = 1) -> Any:
        """The greatest of sign I*."""
        from flywheel.numerics.balls import Curve, greatest

        curves = [
            Curve(
                cell.low - cell.middle,
                cell.high - cell.middle,
                sign * cell.polynomials[_INERTIA],
                sign * cell.polynomials[_SLOPE],
            )
            for cell, *_ in self._curves
        ]
        return greatest(curves, _LOOSE * left * self._largest)


# -- the motion where torques depend on speed --------------------------------------------------------------------------


def _moving(
    scene: Scene, structure: Structure, columns: Sequence[Any], fineness: tuple[int, float], near: Motion | None
) -> dict[str, Any]:
    """The balls of the figures of the motion, by their keys.

    A flywheel for an irregularity, and a balance for a speed, follow from the intermediate value theorem: on one side of
    it the motion is less even than asked, on the other more, and in between there is one motion for each flywheel, which
    changes continuously with it; and so is the speed with the balance.
    """
    from flywheel.numerics import balls

    if near is None:
        raise balls.UnprovenError("there is no motion")
    asked, zero = scene.irregularity, balls.rational(0, 1)
    wanted = (2, 1 if asked is not None else 5, *((0,) if structure.unknown else ()))
    numbers = structure.numbers._replace(outputs=tuple(structure.numbers.outputs[k] for k in wanted))
    ratio, last, *speeds = _over_balls(numbers, len(wanted))(zero, *columns)
    motions = _Motions(structure, columns, near, *fineness)
    wheel = last * ratio**2 if asked is None else balls.exact(near.wheel)
    if asked is not None and near.wheel > 0.0:
        wheel = motions.for_irregularity(last, *speeds)
    sides = motions.between
    unknown = motions.balance(wheel, *speeds) if speeds else zero
    found = motions.at(wheel, unknown)
    if not all(found.start.contains(start) for start in (*sides, *motions.between)):
        raise balls.UnprovenError("that the motions on both sides belong to one")
    figures = {"reduced_inertia.min": motions.bounds[0], "reduced_inertia.max": motions.bounds[1]}
    figures |= {"speed": found.level} | ({"balance.value": unknown} if speeds else {})
    if asked is None or near.wheel == 0.0:
        figures |= {"simulation.irregularity": found.irregularity}
        figures |= {"simulation.speed_max": found.fast, "simulation.speed_min": found.slow}
    if asked is not None:
        if near.wheel == 0.0 and not found.irregularity <= last:
            raise balls.UnprovenError("whether a flywheel is needed")
        figures["flywheel.exact"] = wheel / ratio**2
    return figures


class _Speeds(NamedTuple):
    """The greatest and the least speed of a motion, and whether the unknown speeds it up (1), slows it down (-1) or both.

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


class _Motions:
    """Steady motions of a machine with any flywheel and balance, as solutions of dE/dphi = M*(phi, sqrt(2 E/(I* + J)))."""

    def __init__(self, structure: Structure, columns: Sequence[Any], near: Motion, order: int, left: float) -> None:
        from flywheel.numerics import balls

        self._near, self._order, self._left = near, order, left
        self.between: list[Any] = []  # energies at the start of the motions on both sides of what is wanted, J
        parts, functions, edges = [], [], _edges(structure, columns)
        speed, unknown = balls.exact(near.omega), balls.exact(near.unknown)
        for walk in structure.walks:
            assert walk.rate is not None
            inertia, first = _over_balls(walk.program, 2), len(RATE)
            rate = walk.rate._replace(outputs=walk.rate.outputs[first : first + 3]).only(3)
            parts.append((inertia, *map(_over_balls, rate.split(2))))

            moment = _over_balls(rate)
            functions.append(lambda phi, i=inertia, m=moment: (*i(phi, *columns), m(phi, *columns, speed, unknown)[0]))
        self._cells = _cells(functions, edges, order, left)
        if order > _PRECISIONS[0][1] and len(self._cells) > _MOST_CELLS:
            raise balls.UnprovenError("that a motion through so many cells is found in time")
        self._effort = max(abs(float(cell.polynomials[_MOMENT][0].mid())) for cell in self._cells)
        self._laws, ends = [], [float(edge) for edge in edges[1:]]
        for cell in self._cells:
            inertia, early, late = parts[sum(end < float(cell.middle) for end in ends)]
            places = [balls.variable(centre) for centre in (cell.middle, cell.low.union(cell.high))]
            self._laws.append([(inertia(phi, *columns)[0], early(phi, *columns), late) for phi in places])
        sums = _Sums(self._cells, [(0 * cell.polynomials[0], 0 * cell.polynomials[0]) for cell in self._cells])
        self.bounds = -sums.inertia(left, -1), sums.inertia(left)

    def at(self, wheel: Any, unknown: Any) -> _Speeds:
        """The speeds of the motion with a flywheel (kg m² at the crank) and a value of the unknown."""
        from flywheel.numerics import balls

        omega = balls.exact(self._near.omega)

        def law(inertia: Any, known: Sequence[Any], late: Callable[..., Any]) -> Callable[[Any], Any]:
            def rate(energy: Any) -> tuple[Any, Any]:
                total = inertia + wheel
                speed = (2 * energy / total).sqrt()
                moment, by_speed, _ = late(*known, speed, unknown)
                return moment, by_speed / (total * speed)

            return rate

        places = [
            balls.Place(cell.low, cell.high, cell.middle, *(law(*each) for each in pair))
            for cell, pair in zip(self._cells, self._laws, strict=True)
        ]
        first = self._cells[0]
        start = (first.polynomials[_INERTIA](first.low - first.middle) + wheel) * omega**2 / 2
        orbit = balls.periodic(places, start, self._order, _OPEN_MOTION * self._left * abs(float(start)))
        open_by = orbit.reach.union(-orbit.reach)
        parts = zip(places, orbit.polynomials, self._laws, strict=True)
        effect = balls.one_way(
            (cell.high - cell.low, *self._effect(whole, energy(cell.span) + open_by, wheel, unknown))
            for cell, energy, (_, whole) in parts
        )
        sums = _Sums(self._cells, [(energy, energy.derivative()) for energy in orbit.polynomials])
        slope = self.bounds[0].union(self.bounds[1]) + wheel

        def extreme(sign: int) -> Any:
            def gap(square: Any) -> Any:
                return sign * (sums.greatest(-square, self._left, sign) + open_by) - square * wheel

            return (2 * balls.falling_zero(gap, slope, omega**2 / 2)).sqrt()

        return _Speeds(extreme(1), extreme(-1), effect, orbit.start)

    def _effect(self, law: Sequence[Any], energy: Any, wheel: Any, unknown: Any) -> tuple[Any, Any]:
        """dF/du and dF/dE all over a cell, at energies there."""
        from flywheel.numerics import balls

        inertia, known, late = law
        total = balls.first(inertia) + wheel
        speed = (2 * energy / total).sqrt()
        _, by_speed, by_unknown = late(*map(balls.first, known), speed, unknown)
        return balls.ball(by_unknown), by_speed / (total * speed)

    def balance(self, wheel: Any, speed: Any) -> Any:
        """The ball of the unknown with which a motion has a speed."""
        from flywheel.numerics import balls

        size = max(abs(self._near.unknown), self._effort)
        here, step = balls.exact(self._near.unknown), balls.exact(_SECANT * size)
        found = self.at(wheel, here)
        slope = (self.at(wheel, here + step).level - found.level) / step
        middle = (here + (speed - found.level) / slope).mid()
        apart = (4 * abs((speed - self.at(wheel, middle).level) / slope) + self._left * size).upper()
        sides = [self.at(wheel, middle + side * found.effect * apart) for side in (-1, 1)]
        self.between = [each.start for each in sides]
        if not (found.effect and sides[0].level < speed < sides[1].level):
            raise balls.UnprovenError("that the mean speed is the required one with a balance near")
        return balls.around(middle, apart)

    def for_irregularity(self, asked: Any, *speeds: Any) -> Any:
        """The ball of the flywheel with which a motion has an irregularity."""
        from flywheel.numerics import balls

        def motion(wheel: Any) -> _Speeds:
            return self.at(wheel, self.balance(wheel, *speeds) if speeds else balls.rational(0, 1))

        wheel = balls.exact(self._near.wheel)
        beside = (wheel * (1 + balls.exact(_SECANT))).mid()
        here, there = motion(wheel).irregularity, motion(beside).irregularity
        wheel = (wheel + (asked - here) * (beside - wheel) / (there - here)).mid()
        light, heavy = ((wheel * (1 + side * balls.exact(_APART))).mid() for side in (-1, 1))
        sides = [motion(light), motion(heavy)]
        self.between = [each.start for each in sides]
        if not sides[0].irregularity > asked > sides[1].irregularity:
            raise balls.UnprovenError("that the irregularity is the required one with a flywheel near")
        return light.union(heavy)
