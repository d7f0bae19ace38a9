"""Proven intervals of a sizing's figures, for the numbers of a scene as they are written in decimals.

The machine's reduction is recorded with every number of the scene as an input, breakpoints included, and the recorded
program is evaluated over balls: another kind of numbers, the same machine. Works follow from Taylor models between the
proven breakpoints, extremes from bisection. A figure's interval contains its true value for the model that the scene
describes; of the model itself nothing is proven.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from fractions import Fraction
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from flint import arb_mat
from numpy.typing import NDArray

from bondgraph.recording import Program
from flywheel.components.motors.curves import Curve, curve_pieces
from flywheel.machine.loads import crank_angles
from flywheel.machine.machine import Machine
from flywheel.machine.programs import Structure, UnrecordedError, recorded
from flywheel.mechanisms.law import about_edges, spans, spline_curve
from flywheel.numerics import balls
from flywheel.numerics.balls import UnprovenError, WorkLimitError, rational
from flywheel.numerics.cells import table_pieces
from flywheel.numerics.faults import SceneError
from flywheel.numerics.ranges import Centred
from flywheel.numerics.units import QuantityError, exact_ratio, half_width, middle_of, split_range
from flywheel.reading.paths import dotted
from flywheel.scene.scene import Load, Scene, Table
from flywheel.sizing.enclosures import (
    MOMENT,
    PRECISIONS,
    SAME,
    UNKNOWN,
    EnergySums,
    Motions,
    NearMotion,
    SpeedBalls,
    cells_of,
    double_edges_of,
    edges_of,
    over_balls,
    place_of,
    rows_of,
    threshold,
    unevenness,
    works_of,
)
from flywheel.sizing.ranges import (
    BALANCE,
    OF_CYCLE,
    OF_MOTION,
    START,
    WHEEL,
    MotionsOverRanges,
    Part,
    RangeEnds,
    SumsOverRanges,
    halves_of,
    program_over_ranges,
    widths,
)
from flywheel.sizing.results import WIDTH, Proof

_OF_PI = 4  # units of the 60th digit: units of angle have pi to 60 digits
_READ = 1e-15  # by how much a number may differ from the float that was read
_MOST_CUTS = 2  # of ranges over which figures are not proven at once
_POINT = balls.exact(1e-9)  # of ranges, and of a number of a motion: ranges that are as good as a point
_WIDE = (80, 8)  # bits and order of polynomials all over ranges
_EVEN = 1e-4  # an irregularity beside which that of a motion which does not vary counts

_Near = Callable[[tuple[tuple[str, float], ...]], NearMotion]  # the motion near, with other numbers (SI) at some paths


def proven(scene: Scene, near: _Near | None = None) -> Proof:
    """The proof of a scene's figures, or the reason why there is none.

    Where torques depend on speed, the figures of the motion are proven near one that is given, also with other numbers.

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
            figures, same = _figures(scene, near)
        except NameError as error:
            reason = f"a function that balls do not have ({error.name})"
        except (ValueError, ArithmeticError) as error:
            reason = str(error)
    written = () if scene.document is None else scene.document.quantities.values()
    ranges = any(split_range(quantity.value) for quantity in written)
    return Proof(figures, reason, _statement(scene, figures, same, ranges), time.process_time() - started, ranges)


def _refusal(scene: Scene) -> str:
    """The reason why a scene's figures cannot be proven, by its contents; an empty text where they may be."""
    if scene.document is None:
        return "a scene that was not read has no numbers as written"
    if scene.areas is not None:
        return "a diagram of areas has no machine"
    linkages = [mechanism.linkage for mechanism in scene.mechanisms if mechanism.linkage is not None]
    if any(coupling.lift is not None for linkage in linkages for coupling in linkage.couplings):
        return "a cam's follower, whose lift is a law in pieces"
    if any(isinstance(load.law, Table) and not load.law.written.size for load in _acting(scene)):
        return "a table that was not read has no numbers as written"
    curve = None if scene.motor is None else scene.motor.curve
    if curve is not None and not curve.written:
        return "a motor's curve that was not read has no numbers as written"
    return ""


def _acting(scene: Scene) -> list[Load]:
    """Loads and drive."""
    return [*scene.loads, *([] if scene.drive is None else [scene.drive])]


def _follows_motion(scene: Scene) -> bool:
    """True if torques depend on speed, or meshes have losses."""
    return scene.depends_on_speed or any(efficiency < 1.0 for efficiency in scene.efficiencies.values())


def _statement(scene: Scene, figures: dict[str, tuple[float, float]], same: int, ranges: bool) -> str:
    """A line on what is proven and what is not."""
    if not figures:
        return "nothing is proven"
    taken = f"; {same} pairs of numbers that agree to 18 digits count as equal" if same else ""
    only = "; not proven: that no lighter flywheel will do, and that no other motion is steady" * _follows_motion(scene)
    numbers = "for all numbers in the scene's ranges" if ranges else "for the scene's numbers as written in decimals"
    return f"proven {numbers}: {', '.join(figures)}{taken}{only}; not proven: that the model is the machine"


# -- the machine over balls ------------------------------------------------------------------------------------------------


def _recorded(scene: Scene) -> tuple[Structure, Mapping[str, Any], Mapping[str, Any]]:
    """The structure of a scene, the quantities that are its inputs, and those that are constants there, by their paths.

    Constants are counts, such as poles, and the windows and periods of tables; and where tables are so long that their
    angles may not move, the phases.
    """
    assert scene.document is not None
    written = {dotted(path): quantity for path, quantity in scene.document.quantities.items()}
    constants = set[str]()
    windows = tuple(dotted(load.path) + "." for load in _acting(scene) if isinstance(load.law, Table))

    def structure(*endings: str) -> tuple[Structure, Mapping[str, Any], Mapping[str, Any]]:
        fixed = {k: each for k, each in written.items() if k.startswith(windows) or k.endswith(endings) or k in constants}
        inputs = {path: each for path, each in written.items() if path not in fixed}
        return recorded(scene, tuple(inputs), [each.number for each in inputs.values()], exact=True), inputs, fixed

    for endings in ((), (), (".phase",)) if windows else ((), ()):
        try:
            return structure(*endings)
        except UnrecordedError as error:
            refusal, cause = error, error.__cause__
            constants |= {fault.path for fault in cause.faults} if isinstance(cause, SceneError) else set()
    raise UnprovenError(str(refusal.__cause__ or refusal)) from refusal


def _figures(scene: Scene, near: _Near | None) -> tuple[dict[str, tuple[float, float]], int]:
    """Every figure that can be proven, by its key, and the number of pairs of numbers taken as equal."""
    recording, quantities, fixed = _recorded(scene)
    open_still = UnprovenError("nothing")
    for bits, order, left in PRECISIONS[_follows_motion(scene) :]:
        with balls.precision(bits, order):
            columns, ranges = [_as_written(*each) for each in quantities.items()], _ranges(quantities)
            if _ranges(fixed):
                raise UnprovenError("ranges of the place of a table")
            own = {each.number: ball for each, ball in zip(quantities.values(), columns, strict=True)}
            constants = [(each.number, _as_written(path, each)) for path, each in fixed.items()]
            numbers = _of_loads(recording.twin, constants, own)
            structure = recording.with_places(partial(_all_of, numbers=numbers))
            moving = _follows_motion(scene)
            if ranges and moving and scene.limits:
                raise UnprovenError("ranges of numbers under limits")
            same = _kept(structure, [balls.around(each, ranges.get(k, 0)) for k, each in enumerate(columns)])
            try:
                found, scales = (
                    (_moving(scene, structure, columns, (order, left), near), {"simulation.irregularity": _EVEN})
                    if moving
                    else _cycle(scene, structure, columns, order, left)
                )
                same += double_edges_of(structure, columns)
            except WorkLimitError:
                raise
            except UnprovenError as error:
                open_still = error
                continue
            width = max(widths(found, scales).values())
            if width > WIDTH:
                open_still = UnprovenError(f"intervals stay {width:.1e} wide, more than {WIDTH:g}")
                continue
            if ranges:
                near_at = partial(_near_at, near, quantities, ranges)
                of_part = (
                    partial(_motion_over_part, scene, structure, (order, left), near_at)
                    if moving
                    else partial(_cycle_over_part, scene, structure, order, left)
                )
                found |= _over_ranges(of_part, columns, ranges, scales, OF_MOTION if moving else OF_CYCLE)
            return {name: balls.ends(ball) for name, ball in found.items()}, same
    raise open_still


def _near_at(near: _Near | None, paths: Iterable[str], ranges: Mapping[Any, Any], columns: Sequence[Any]) -> NearMotion:
    """The motion near the one at the numbers of a part of ranges."""
    assert near is not None
    return near(tuple((path, float(columns[k].mid())) for k, path in enumerate(paths) if k in ranges))


def _as_written(path: str, quantity: Any) -> Any:
    """The ball of a number as the scene writes it."""
    try:
        ratio = exact_ratio(middle_of(quantity.value), _dimension(path, quantity))
    except QuantityError:  # a number in a text, where an expression may stand
        ratio = exact_ratio(middle_of(quantity.value), None)
    ball = _with_pi(*ratio)
    if abs(float(ball.mid()) - quantity.number) > _READ * abs(quantity.number):
        raise UnprovenError(f"{path}: {quantity.value!r} is not taken as it is written")
    return ball


def _of_loads(machine: Machine, written: Iterable[tuple[float, Any]], inputs: Mapping[float, Any]) -> dict[float, Any]:
    """Balls of the numbers of tables' pieces, and of the angles at which loads begin anew, by the floats that are nearest.

    The pieces are calculated anew, in fractions, from the rows as they are written.

    Args:
        machine: with the loads.
        written: balls of the constants of its programs, by their floats.
        inputs: balls of the inputs of its programs, by their floats.

    """
    numbers: dict[float, Any] = {}

    def stands(number: float, ball: Any) -> None:
        numbers[number] = ball.union(numbers.get(number, ball))

    for number, ball in written:
        stands(number, ball)
    for mechanism in machine.scene.mechanisms:
        for output in mechanism.outputs:
            if isinstance(output.law, Table):
                _of_spline(output.law, mechanism.period, stands)
    motor = machine.scene.motor
    if motor is not None and motor.curve is not None:
        _of_curve(motor.curve, stands)
    for load, place in ((effort.load, effort.place) for effort in machine.efforts):
        table = load.law if isinstance(load.law, Table) else None
        if table is not None:
            _of_table(table, load.every, stands, _factor(machine.scene, load))
        elif load.every >= machine.scene.cycle:
            continue
        window = [each for each in (load.start, load.end) if each is not None]
        within = [0.0] if table is None else [*table.angle.tolist(), *window]
        every, phase, rate = (
            balls.constant(inputs.get(each, _all_of(each, numbers))) for each in (load.every, place.phase, place.rate)
        )
        for local in within:
            angles = crank_angles(local, load.every, place, machine.scene.cycle)
            for angle in angles[angles > 0.0].tolist():  # the cycle begins at 0 itself
                turn = round((angle * place.rate + place.phase - local) / load.every)
                passed = balls.constant(_all_of(local, numbers)) + turn * every
                stands(angle, (passed - phase) / rate)
                if own := local + turn * load.every:  # where the phase is an input
                    stands(own, passed)
    return numbers


def _factor(scene: Scene, load: Load) -> Fraction:
    """The factor by which a load is multiplied, as it is written."""
    factor = None if scene.document is None else scene.document.quantities.get(f"{load.path}.factor")
    return Fraction(1) if factor is None else Fraction(*exact_ratio(middle_of(factor.value), factor.dimension))


def _of_table(table: Table, every: float, stands: Callable[[float, Any], None], factor: Fraction) -> None:
    """Notes of what the numbers of a table's pieces are the floats; `every` is its period, rad."""
    angles, values = _rows(table, every, factor)
    floats = table_pieces(table.angle, table.value, table.interpolation)
    exact = table_pieces(angles, values, table.interpolation)
    for here, there in zip((table.angle, *floats), (angles, *exact), strict=True):
        for number, row in zip(here.ravel().tolist(), there.ravel().tolist(), strict=True):
            stands(number, _with_pi(*row.as_integer_ratio()))


def _of_curve(curve: Curve, stands: Callable[[float, Any], None]) -> None:
    """Notes of what the numbers of the pieces of a motor's curve are the floats."""
    columns = np.array(curve.speeds), np.array(curve.torques)
    speeds, torques = _as_read(_fractions(curve.written), columns, "a motor's curve that is not taken as it is written")
    exact = curve_pieces(speeds, torques, curve.interpolation)
    for here, there in zip(curve_pieces(*columns, curve.interpolation), exact, strict=True):
        for number, row in zip(here, there, strict=True):
            stands(float(number), _with_pi(*Fraction(row).as_integer_ratio()))


def _of_spline(table: Table, period: float, stands: Callable[[float, Any], None]) -> None:
    """Notes of what the numbers of a periodic cubic spline are the floats: its slopes follow from C² at the rows."""
    x, y = (np.array([_with_pi(*row.as_integer_ratio()) for row in rows]) for rows in _rows(table, period))
    turn = x[-1] - x[0]
    drift = (y[-1] - y[0]) / turn
    step, chord = np.diff(x), np.diff(y) / np.diff(x) - drift
    n, rights, matrix = len(step), 3 * chord / step, arb_mat(len(step), len(step))
    for i, k in ((row, chord) for row in range(n) for chord in (row - 1, row)):
        matrix[i, i] += 2 / step[k]
        matrix[i, k % n if k < i else (i + 1) % n] += 1 / step[k]
    slope = np.array(matrix.solve(arb_mat(n, 1, [*(rights + np.roll(rights, 1))])).entries())
    after = np.roll(slope, -1)
    bend = slope + after - 2 * chord
    cubics = np.stack((bend / step**2, (chord - slope - bend) / step, slope, y[:-1] - drift * (x[:-1] - x[0])))
    curve = spline_curve(table, period)
    _, piece, turns = spans(table.angle, period)
    knots = x[piece] + np.array([int(k) * turn for k in turns])
    edges = np.array([balls.exact(0.0), *knots[1:]])
    step = np.array([-knots[0], *([balls.exact(0.0)] * (len(knots) - 1))])
    c3, c2, c1, c0 = about_edges(cubics[:, piece], step, edges - x[0], drift)
    f3, f2, f1, f0 = curve.coefficients
    exact = (edges, c3, c2, c1, c0, 3 * c3, 2 * c2, 6 * c3)
    for here, there in zip((curve.knots[:-1], f3, f2, f1, f0, 3 * f3, 2 * f2, 6 * f3), exact, strict=True):
        for number, ball in zip(here.tolist(), there.tolist(), strict=True):
            if number:
                stands(number, ball)
            elif not ball.is_zero():
                raise UnprovenError("a number of a spline that is 0 as a float")


def _rows(table: Table, every: float, factor: Fraction = Fraction(1)) -> list[Any]:
    """The rows of a table as they are written, angles (rad) and values, these times a factor."""
    rows = _fractions(table.written.tolist())
    rows[1] = factor * rows[1]
    if abs(float(table.angle[-1] - table.angle[0]) - every) <= _READ * every:  # it was put onto its period
        rows[0][-1] = rows[0][0] + balls.share_of_pi(every) * Fraction(*exact_ratio("180 deg", "angle"))
    return _as_read(rows, (table.angle, table.value), "a table whose ends are put where its load begins or ends")


def _fractions(written: Iterable[Sequence[str]]) -> list[Any]:
    """Columns of numbers with units, in SI, as they are written."""
    return [np.array([Fraction(*exact_ratio(text, None)) for text in column]) for column in written]


def _as_read(rows: list[Any], columns: tuple[NDArray[Any], ...], reason: str) -> list[Any]:
    """The rows, if the columns are their floats; else there is no proof, for the reason."""
    for number, row in zip(np.concatenate(columns).tolist(), np.concatenate(rows), strict=True):
        if abs(Fraction(number) - row) > _READ * abs(row):
            raise UnprovenError(reason)
    return rows


def _all_of(place: Any, numbers: Mapping[float, Any]) -> Any:
    """The ball of all that a number of a program may stand for; itself where it is in no table."""
    if isinstance(place, tuple | int) or callable(place) or place not in numbers:
        return place
    with suppress(UnprovenError):
        return numbers[place].union(balls.constant(place))
    return numbers[place]


def _with_pi(numerator: int, denominator: int) -> Any:
    """The ball of a ratio with up to the third power of pi to 60 digits in it."""
    return rational(numerator, denominator) * (1 + _OF_PI * rational(1, 10**60).union(rational(-1, 10**60)))


def _dimension(path: str, quantity: Any) -> str | None:
    return None if path.startswith("parameters.") else quantity.dimension


def _ranges(quantities: Mapping[str, Any]) -> dict[Any, Any]:
    """Half the width of the range that a number is written with, by its place among all; none for numbers without one."""
    halves = (half_width(each.value, _dimension(path, each)) for path, each in quantities.items())
    return {k: rational(*half) for k, half in enumerate(halves) if half[0]}


def _kept(structure: Structure, columns: Sequence[Any]) -> int:
    """Checks every decision of the recording over balls; returns the number of those between equal numbers."""
    conditions, same = structure.conditions, 0
    program = conditions.program._replace(places=tuple(place_of(place, threshold) for place in conditions.program.places))
    differences = program.function(balls.NAMESPACE)(rational(0, 1), *columns)
    for difference, relation, holds in zip(differences, conditions.relations, conditions.holds, strict=True):
        ball = difference if hasattr(difference, "rad") else rational(int(difference), 1)
        negative, zero = bool(ball < 0), bool(ball.is_zero())
        if zero or negative or ball > 0:
            answer = {"less": negative, "less_equal": negative or zero, "equal": zero}[relation]
            if answer != holds:
                raise UnprovenError("a decision that the numbers as written take the other way")
        elif abs(float(ball.mid())) + float(ball.rad()) < SAME:
            same += 1
        else:
            raise UnprovenError("a decision that is open")
    return same


def _cycle(
    scene: Scene, structure: Structure, columns: Sequence[Any], order: int, left: float
) -> tuple[dict[str, Any], dict[str, float]]:
    """The balls of the figures of a cycle, by their keys, and scales of those that may be 0, from all the work there."""
    speed, ratio, last = map(balls.ball, over_balls(_numbers(scene, structure))(rational(0, 1), *columns))
    sums, balance, effect, exchanged = _sums(structure, columns, order, left)
    figures = {"speed": speed} | ({"balance.value": balance} if structure.unknown else {})
    figures |= _of_cycle(sums, speed, ratio, last, left, asked=scene.irregularity is not None)
    scales = {"balance.value": exchanged / abs(float(effect.mid()))} if structure.unknown else {}
    scales |= dict.fromkeys(("accumulated_max", "accumulated_min", "energy_fluctuation"), exchanged)
    scales |= {"simulation.irregularity": _EVEN, "reduced_inertia.max": exchanged / float(speed.mid()) ** 2}
    unit = float((last * (speed * ratio) ** 2).mid())
    scales |= {name: exchanged / unit for name in figures if name.startswith("flywheel.")}
    return figures, scales


def _sums(structure: Structure, columns: Sequence[Any], order: int, left: float) -> tuple[EnergySums, Any, Any, float]:
    """The extremes of a cycle, its balance, 0 without one, the work of a unit of that, and about all the work done."""
    edges = edges_of(structure, columns)
    walks = [over_balls(rows_of(walk)) for walk in structure.walks]
    cells = cells_of([lambda phi, walk=walk: walk(phi, *columns) for walk in walks], edges, order, left)  # type: ignore[misc]
    net, effect = (sum(cell.at_end(cell.integral(k)) for cell in cells) for k in (MOMENT, UNKNOWN))
    balance = -net / effect if structure.unknown else 0 * net
    exchanged, numbers = 0.0, [float(column) for column in columns]
    for walk, (low, high) in zip(structure.walks, pairwise(edges), strict=True):
        sizes = walk.program._replace(outputs=walk.program.outputs[3:5]).only(2).function()
        by_unknown, others = sizes(float(low + high) / 2, *numbers)
        exchanged += float(high - low) * (abs(float(balance) * float(by_unknown)) + float(others))
    return EnergySums(cells, works_of(cells, balance)), balance, effect, exchanged


def _numbers(scene: Scene, structure: Structure) -> Program:
    """The program of the speed, the flywheel's ratio to the crank, and its irregularity or inertia."""
    outputs = structure.numbers.outputs
    last = outputs[5 if scene.irregularity is None else 1]
    return structure.numbers._replace(outputs=(outputs[0], outputs[2], last)).only(3)


def _of_cycle(
    sums: EnergySums | SumsOverRanges, speed: Any, ratio: Any, last: Any, left: float, *, asked: bool
) -> dict[str, Any]:
    """The figures of a cycle, by their keys, from its extremes.

    Args:
        sums: the extremes.
        speed: mean of the extreme speeds, rad/s.
        ratio: of the flywheel to the crank.
        last: the required irregularity, or the flywheel's inertia (kg m²).
        left: uncertainty of the cells, relative.
        asked: True if it is the irregularity.

    """
    square = ratio * ratio
    work, low_work = sums.greatest(1, 0, left), -sums.greatest(1, 0, left, -1)
    inertia, least = sums.greatest(0, 1, left), -sums.greatest(0, 1, left, -1)
    figures = {"accumulated_max": work, "accumulated_min": low_work, "energy_fluctuation": work - low_work}
    figures |= {"reduced_inertia.min": least, "reduced_inertia.max": inertia}
    if not asked:
        eps = sums.irregularity(speed, last * square, (least, inertia), left)
        figures |= {"simulation.irregularity": eps, "simulation.speed_max": speed * (1 + eps / 2)}
        return figures | {"simulation.speed_min": speed * (1 - eps / 2)}
    eps = last
    per_square = 1 / speed**2
    exact = unevenness(sums, eps, per_square, left) / eps
    torque = (sums.greatest(per_square, -0.5, left) + sums.greatest(per_square, -0.5, left, -1)) / eps
    total = (work - low_work) * per_square / eps
    figures["flywheel.exact"] = balls.positive(exact) / square
    figures["flywheel.approximate"] = balls.positive(total - least) / square
    figures["flywheel.approximate_total"] = total / square
    figures["flywheel.inertia_torque"] = torque / square
    figures["flywheel.inertia_torque_flywheel"] = balls.positive(torque - least) / square
    return figures


# -- the motion where torques depend on speed --------------------------------------------------------------------------


def _regime_numbers(scene: Scene, structure: Structure) -> Program:
    """The program of the flywheel's ratio to the crank, of its irregularity or inertia, and of a speed that is required."""
    last = 1 if _required(scene) else 5 if scene.inertia is not None else 2  # under limits, the flywheel near is taken
    wanted = (2, last, *((0,) if structure.unknown else ()))
    outputs = tuple(structure.numbers.outputs[k] for k in wanted)
    return structure.numbers._replace(outputs=outputs).only(len(wanted))


class _Steady(NamedTuple):
    """A steady motion: with others near it, its flywheel (kg m² at the crank) and its unknown, and its speeds."""

    motions: Motions
    wheel: Any
    unknown: Any
    speeds: SpeedBalls


def _steady(
    scene: Scene, structure: Structure, columns: Sequence[Any], fineness: tuple[int, float], near: NearMotion
) -> _Steady:
    """The motion that a scene requires, near one that is not proven.

    A flywheel for an irregularity, and a balance for a speed, follow from the intermediate value theorem: on one side of it
    the motion is less even than required, on the other more even, and between them there is one motion for each flywheel,
    which changes continuously with it; likewise the speed with the balance. Under limits, the motion has the flywheel near.
    """
    zero = rational(0, 1)
    ratio, last, *speeds = over_balls(_regime_numbers(scene, structure))(zero, *columns)
    motions = Motions(structure, columns, near, *fineness)
    wheel = balls.exact(near.wheel) if scene.inertia is None else last * ratio**2
    ends = list[tuple[Any, SpeedBalls]]()
    if _required(scene) and near.wheel > 0.0:
        wheel, ends = motions.for_irregularity(last, *speeds)
    if speeds:
        ends.append(motions.balance(wheel, *speeds))
    unknown = ends[-1][0] if speeds else zero
    found = motions.at(wheel, unknown)
    one = all(found.start.contains(each.start) and unknown.contains(own) for own, each in ends)
    if not one or (speeds and not motions.effect):
        raise UnprovenError("that the motions on both sides belong to one")
    return _Steady(motions, wheel, unknown, found)


def _of_motion(
    scene: Scene, numbers: Sequence[Any], bounds: tuple[Any, Any], steady: _Steady, near: float
) -> dict[str, Any]:
    """The figures of a motion, by their keys.

    Args:
        scene: what is required.
        numbers: the flywheel's ratio to the crank, and so on (see `_regime_numbers`).
        bounds: least and greatest I*.
        steady: the motion.
        near: the flywheel near, 0 if none is needed.

    """
    ratio, last, *speeds = numbers
    _, wheel, unknown, found = steady
    figures = {"reduced_inertia.min": bounds[0], "reduced_inertia.max": bounds[1]}
    figures |= {"speed": speeds[0], "balance.value": unknown} if speeds else {"speed": found.level}
    if not _required(scene) or near == 0.0:
        figures |= {"simulation.irregularity": found.irregularity}
        figures |= {"simulation.speed_max": found.fast, "simulation.speed_min": found.slow}
    if _required(scene):
        if near == 0.0 and not last - found.irregularity >= 0:
            raise UnprovenError("whether a flywheel is needed")
        figures["flywheel.exact"] = wheel / ratio**2
    return figures


def _required(scene: Scene) -> bool:
    """True if an irregularity is required and nothing else, so that the flywheel follows from it."""
    return scene.irregularity is not None and not scene.limits


def _moving(
    scene: Scene, structure: Structure, columns: Sequence[Any], fineness: tuple[int, float], near: _Near | None
) -> dict[str, Any]:
    """The balls of the figures of the motion, by their keys."""
    if near is None:
        raise UnprovenError("there is no motion")
    steady, about = _steady(scene, structure, columns, fineness, near(())), near(()).wheel
    numbers = over_balls(_regime_numbers(scene, structure))(rational(0, 1), *columns)
    return _of_motion(scene, numbers, steady.motions.bounds, steady, about)


# -- over ranges of numbers ------------------------------------------------------------------------------------------------


def _over_ranges(
    of_part: Callable[[Sequence[Any], dict[Any, Any]], dict[str, Any]],
    middles: Sequence[Any],
    ranges: Mapping[Any, Any],
    scales: Mapping[str, float],
    limits: tuple[float, float],
) -> dict[str, Any]:
    """The balls of figures all over the ranges of numbers, by their keys.

    Args:
        of_part: figures over ranges that are taken as they are, from the middles of all numbers and half the widths.
        middles: of all numbers.
        ranges: half the width of the range of a number, by its place.
        scales: of figures that may be 0.
        limits: parts of the ranges at most, and what is enough over a figure's proven width.

    """
    zero = rational(0, 1)

    def figures(part: Part, cuts: int = _MOST_CUTS) -> dict[str, Any]:
        """The figures over a part of the ranges, from those over both its halves where they are not proven at once."""
        shares = [half for _, half in part]
        moved, halves = list(middles), dict[Any, Any]()
        for k, (middle, half) in zip(ranges, part, strict=True):
            moved[k] += middle * ranges[k]
            halves |= {k: half * ranges[k]} if half else {}
        try:
            return of_part(moved, halves)
        except UnprovenError:
            if not (halves and cuts):
                raise
        both = [figures(own, cuts - 1) for own in halves_of(part, shares.index(max(shares)))]
        return {
            name: Centred(one.middle, {k: balls.hull(own[name].slopes.get(k, zero) for own in both) for k in halves}, halves)
            for name, one in of_part(moved, {}).items()
        }

    ends = RangeEnds(figures, tuple(ranges), *limits)
    ends.narrow(scales)
    return {name: ends.interval(name) for name in ends.names}


def _centred(middles: Sequence[Any], halves: dict[Any, Any]) -> tuple[Centred, list[Any]]:
    """An angle of 0, and numbers over the ranges that some of them have."""
    columns = [Centred(one, {k: rational(1, 1)}, halves) if k in halves else one for k, one in enumerate(middles)]
    return Centred(rational(0, 1), {}, halves), columns


def _cycle_over_part(
    scene: Scene, structure: Structure, order: int, left: float, middles: Sequence[Any], halves: dict[Any, Any]
) -> dict[str, Any]:
    """The figures of a cycle over ranges that are taken as they are, by their keys."""
    if not halves:
        figures, _ = _cycle(scene, structure, middles, order, left)
        return {name: Centred(figure, {}, halves) for name, figure in figures.items()}
    origin, columns = _centred(middles, halves)
    speed, ratio, last = program_over_ranges(_numbers(scene, structure), origin, columns)
    sums = SumsOverRanges(structure, columns, origin, _sums(structure, middles, order, left)[0], order)
    figures = {"speed": speed} | ({"balance.value": sums.balance} if structure.unknown else {})
    return figures | _of_cycle(sums, speed, ratio, last, left, asked=scene.irregularity is not None)


def _motion_over_part(
    scene: Scene,
    structure: Structure,
    fineness: tuple[int, float],
    near: Callable[[Sequence[Any]], NearMotion],
    middles: Sequence[Any],
    halves: dict[Any, Any],
) -> dict[str, Any]:
    """The figures of the motion over ranges that are taken as they are, by their keys.

    A flywheel for an irregularity and a balance for a speed are numbers of the motion, too. Their slopes by others follow
    from those of both, by the implicit function theorem, in ranges of them that contain all results.
    """
    about, program = near(middles), _regime_numbers(scene, structure)
    steady = _steady(scene, structure, middles, fineness, about)
    if not halves:
        numbers = over_balls(program)(rational(0, 1), *middles)
        figures = _of_motion(scene, numbers, steady.motions.bounds, steady, about.wheel)
        return {name: Centred(balls.ball(figure), {}, halves) for name, figure in figures.items()}
    required, one = _required(scene) and about.wheel > 0.0, rational(1, 1)
    free = {START: steady.speeds.fast**2} | ({WHEEL: steady.wheel} if required else {})  # with their sizes
    free |= {BALANCE: abs(steady.unknown)} if structure.unknown else {}
    with balls.precision(*_WIDE):

        def motions_over(widths: Mapping[Any, Any]) -> tuple[MotionsOverRanges, Sequence[Any], Any, Any]:
            """The motions over ranges, the numbers of the regime, and what is free, from half the widths of the ranges."""
            wide = dict(widths) | {own: _POINT * size for own, size in free.items()}
            origin, columns = _centred(middles, wide)
            ratio, last, *_ = numbers = program_over_ranges(program, origin, columns)
            motions = MotionsOverRanges(structure, columns, origin, steady.motions, _WIDE[1])
            given = None if scene.inertia is None else last * ratio**2
            wheel = Centred(steady.wheel, {WHEEL: one} if required else {}, wide) if given is None else given
            unknown = Centred(steady.unknown, {BALANCE: one} if structure.unknown else {}, wide)
            return motions, numbers, (wheel, unknown, steady.speeds), partial(missed, numbers)

        def missed(numbers: Sequence[Any], found: SpeedBalls) -> list[Centred]:
            _, last, *speeds = numbers
            return [found.irregularity - last] * required + [found.level - speed for speed in speeds]

        motions, _, own, zeros = motions_over({k: _POINT * half for k, half in halves.items()})
        slopes = motions.slopes(own, zeros, halves)
        motions, numbers, own, zeros = motions_over(halves)
        motion, follow = motions.steady(own, zeros, *slopes)
        along = _Steady(steady.motions, *motion)
        figures = _of_motion(scene, numbers, motions.inertias(*steady.motions.bounds), along, about.wheel)
        return {name: figure.followed(follow, halves) for name, figure in figures.items()}
