"""Switches of expressions, and the cell width that follows them: proven by interval subdivision, never by samples.

Roots: a cell whose enclosure excludes zero has none, a cell whose derivative keeps its sign has at most one; any other cell
is halved. Source: R. E. Moore, R. B. Kearfott, M. J. Cloud, Introduction to Interval Analysis, SIAM 2009, chapters 6 and 8.

Widths: sin(phi) + 100 exp(-((phi - 2)/0.01)²) on one cell of 24 nodes looks like a sine to its last coefficient. Whatever a
function of the tree may do in a cell is known from the bounds of its argument, and from the distance to its nearest
singularity: L. N. Trefethen, Approximation Theory and Approximation Practice, SIAM 2013, chapter 8. The error allowed in
every node, which changes the expression by a negligible share of its greatest value, is passed down the tree. An exponential
factor that a quotient or a logarithm removes again is left out with it, so that exp(a)/(1 + exp(a)) needs narrow cells
where it rises, and not where it is 1.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from bondgraph.numerics import roots_between
from flywheel.numerics import expressions
from flywheel.numerics.expressions import At, Expression, Node
from flywheel.numerics.intervals import NAMESPACE, Interval, Powers, Scaled, interval, plain, scaled_namespace
from flywheel.numerics.jets import Jet, jet_namespace

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Enclosures = Callable[[Array, Array, Array], Mapping[str, Any]]
Values = Callable[[Array, Array], Mapping[str, Any]]

CELL_CAP = 200_000
FINEST = 1e-9  # of the range: cells that are still open then are taken for one touching point
_EPS = float(np.finfo(float).eps)
_START = 32
_ZERO = 1e-12  # of the values beside it: what counts as zero at an edge
_JETS = jet_namespace(NAMESPACE)


class SwitchingError(ValueError):
    """A function that cannot be followed over a range of angles; `{near}` in its text stands for the angle."""

    def __init__(self, text: str, near: float = 0.0) -> None:
        super().__init__(text.replace("{near}", f"{near:.6g}"))
        self.text, self.near = text, near


_NEWTON_STEPS = 8  # of Newton's method, from the root of a function whose numbers are recorded
_LAST_STEP = 1e-12  # of a range of angles: the last step, at most
_DIGITS = 9  # decimals of an angle by which zeros of one function are told apart


class FollowedZero:
    """The zero of a function of an angle and recorded numbers that is near an angle (rad).

    `program` gives value and slope. Called with the numbers it is that zero in floats, by Newton's method.
    """

    def __init__(self, program: Any, near: float) -> None:
        self.program, self.near = program, near

    def __call__(self, *numbers: Any) -> list[Any]:  # noqa: D102  # said above
        function, phi = self.program.function(), self.near
        for _ in range(_NEWTON_STEPS):
            value, slope = function(phi, *numbers)
            phi = phi - value / slope
        return [phi]


def solved(recorder: Any, function: Callable[[Any], tuple[Any, Any]], angle: float) -> Any:
    """The zero of a function of the first input of an exact recording, and of its numbers: a call, for all kinds of numbers.

    Args:
        recorder: the recording.
        function: value and slope at an angle.
        angle: the zero now, rad.

    """
    phi, numbers = recorder.inputs[0], [each for each in recorder.inputs if each.value is not None]
    program = recorder.program(function(phi), [phi, *numbers])
    zero = recorder.solved.setdefault((program, round(angle, _DIGITS)), FollowedZero(program, angle))
    return recorder.call(zero, numbers, 1, [angle])[0]


def followed(function: Callable[[Any], tuple[Any, Any]], angle: float, span: float) -> Any:
    """The zero of a function whose numbers are recorded, from that of their present values by Newton's method.

    Args:
        function: value and slope at an angle.
        angle: the zero now, rad.
        span: range of the angles, rad: a guard tests that the last step is negligible compared with it.

    Raises:
        SwitchingError: if the steps do not settle.

    """
    phi: Any = angle
    step: Any = 0.0
    for _ in range(_NEWTON_STEPS):
        value, slope = function(phi)
        step = value / slope
        phi = phi - step
    settled = _LAST_STEP * span
    if not -settled <= step <= settled:
        raise SwitchingError("an angle at which a law only touches its switch, or a place only stands still")
    return phi


def roots(
    enclose: Callable[[Array, Array], tuple[Any, Any]],
    value: Callable[[Array], Any],
    a: float,
    b: float,
    most: int = CELL_CAP,
) -> list[float]:
    """Every angle in (a, b) where a function changes sign or touches zero, ascending.

    `enclose(lo, hi)` gives enclosures of the function and of its derivative over arrays of cells, `value(phi)` its
    values. A stretch where the enclosure is exactly 0 has no roots; one where the function cannot be distinguished from zero
    has a single, harmless one. Raises SwitchingError if there are too many for `most` cells.

    >>> from flywheel.numerics.intervals import NAMESPACE as ns
    >>> angles = roots(lambda lo, hi: (ns.sin(Interval(lo, hi)), ns.cos(Interval(lo, hi))), np.sin, 1.0, 7.0)
    >>> [round(angle, 14) for angle in angles]
    [3.14159265358979, 6.28318530717959]
    """
    edges = np.array([a, b], dtype=float)
    zeros = roots_in_pieces(lambda lo, hi, _: enclose(lo, hi), lambda phi, _: value(phi), edges, most)
    return [float(root) for root in zeros[1:-1]]


def roots_in_pieces(
    enclose: Callable[[Array, Array, Array], tuple[Any, Any]],
    value: Callable[[Array, Array], Any],
    edges: Array,
    most: int = CELL_CAP,
) -> Array:
    """The ascending edges, and between them every root of a function that is smooth in each piece, all at once.

    As `roots`, except for a third argument of `enclose` and a second of `value`: the middle of the piece that a cell lies
    in. Roots that differ from an edge or from each other only by rounding are left out.
    """
    with np.errstate(all="ignore"):
        monotone, flat = _isolated(enclose, edges, most)
        crossings, rest = _sign_changes(value, monotone)
        ends = np.concatenate((rest[[0, 0, 2]], rest[[1, 1, 2]]), axis=1)  # cells without width
        if ends.size:  # where rounding cannot tell the value from zero
            doubtful = interval(enclose(*ends)[0]).contains(0.0)
            flat = np.concatenate((flat, ends[:, np.broadcast_to(doubtful, ends[0].shape)]), axis=1)
        zeros = np.sort(np.concatenate((crossings, _touching_points(enclose, value, flat, edges))))
    near = 16 * _EPS * max(abs(edges[0]), abs(edges[-1]))
    zeros = zeros[_distance(zeros, edges) > near]
    return np.sort(np.concatenate((edges, zeros[np.diff(zeros, prepend=-np.inf) > near])))


def _isolated(enclose: Callable[[Array, Array, Array], tuple[Any, Any]], edges: Array, most: int) -> tuple[Array, Array]:
    """Cells with at most one root, and cells that need no further splitting: lo, hi and anchor as rows.

    The bounds of a value are the intersection of its plain enclosure with f(middle) + f'(cell) (cell - middle); the width at
    the middle is due to rounding alone.
    """
    share = -(-_START // (edges.size - 1))
    steps = np.linspace(0.0, 1.0, share + 1)
    grid = edges[:-1, None] * (1 - steps) + edges[1:, None] * steps
    grid[:, -1] = edges[1:]
    cells = np.stack((grid[:, :-1].ravel(), grid[:, 1:].ravel(), np.repeat(0.5 * (edges[:-1] + edges[1:]), share)))
    finest, seen = FINEST * (edges[-1] - edges[0]), 0
    monotone, touching = [], []
    while cells.size:
        lo, hi, anchor = cells
        seen += lo.size
        if seen > most:
            text = f"changes sign too often: its zeros are not separated in {most} cells (first near phi = {{near}})"
            raise SwitchingError(text, float(lo[0]))
        middle = 0.5 * (lo + hi)
        enclosures = enclose(np.concatenate((lo, middle)), np.concatenate((hi, middle)), np.tile(anchor, 2))
        value, slopes = (_of_shape(u, 2 * lo.size) for u in enclosures)
        slope = Interval(slopes.lo[: lo.size], slopes.hi[: lo.size])
        centre = Interval(value.lo[lo.size :], value.hi[lo.size :])
        mean = centre + slope * Interval(lo - middle, hi - middle)
        bounds = Interval(np.fmax(value.lo[: lo.size], mean.lo), np.fmin(value.hi[: lo.size], mean.hi))
        is_open = ~((bounds.lo > 0) | (bounds.hi < 0) | ((bounds.lo == 0) & (bounds.hi == 0)))
        is_monotone = is_open & ((slope.lo > 0) | (slope.hi < 0))
        too_fine = (hi - lo <= finest) | (bounds.width <= 4 * centre.width)
        monotone.append(cells[:, is_monotone])
        touching.append(cells[:, is_open & ~is_monotone & too_fine])
        halves = np.stack((lo, middle, anchor)), np.stack((middle, hi, anchor))
        cells = np.concatenate(halves, axis=1)[:, np.tile(is_open & ~is_monotone & ~too_fine, 2)]
    return np.concatenate(monotone, axis=1), np.concatenate(touching, axis=1)


def _touching_points(
    enclose: Callable[[Array, Array, Array], tuple[Any, Any]],
    value: Callable[[Array, Array], Any],
    cells: Array,
    edges: Array,
) -> Array:
    """One angle for every run of neighbouring cells: the sign change in it, else the extreme, else its middle.

    A run without sign change that ends at an edge touches zero there and adds no angle.
    """
    if not cells.size:
        return np.empty(0)
    lo, hi, anchor = cells[:, np.lexsort((cells[1], cells[0]))]
    first = np.concatenate(([True], (lo[1:] != hi[:-1]) | (anchor[1:] != anchor[:-1])))
    runs = np.stack((lo[first], hi[np.roll(first, -1)], anchor[first]))
    crossings, rest = _sign_changes(value, runs)
    rest = rest[:, (_distance(rest[0], edges) > 0) & (_distance(rest[1], edges) > 0)]

    def slope(phi: Array, anchor: Array) -> Array:
        bounds = interval(enclose(phi, phi, anchor)[1])
        return np.asarray(0.5 * (bounds.lo + bounds.hi))

    extremes, rest = _sign_changes(slope, rest)
    return np.concatenate((crossings, extremes, 0.5 * (rest[0] + rest[1])))


def _sign_changes(value: Callable[[Array, Array], Any], cells: Array) -> tuple[Array, Array]:
    """The roots of cells at whose ends the signs differ, to the last unit or two, and the other cells."""

    def at(phi: Array, anchor: Array) -> Array:
        return np.broadcast_to(np.asarray(value(phi, anchor), dtype=float), phi.shape)

    if not cells.size:
        return cells[0], cells
    change = np.sign(at(cells[0], cells[2])) * np.sign(at(cells[1], cells[2])) < 0
    low, high, anchor = cells[:, change]
    return roots_between(lambda phi: at(phi, anchor), low, high), cells[:, ~change]


def _distance(angles: Array, edges: Array) -> Array:
    """Distance of each angle from the nearest of ascending edges."""
    above = np.searchsorted(edges, angles)
    after, before = edges[np.minimum(above, edges.size - 1)], edges[np.maximum(above - 1, 0)]
    return np.minimum(np.abs(after - angles), np.abs(angles - before))


def _of_shape(u: Any, shape: int | tuple[int, ...]) -> Interval:
    """Bounds as arrays of one shape."""
    bounds = interval(u)
    lo, hi = (np.broadcast_to(np.asarray(end, dtype=float), shape) for end in (bounds.lo, bounds.hi))
    return Interval(lo, hi)


def breakpoints(
    expression: Expression, a: float, b: float, env: Enclosures, env_value: Values, smooth_edges: Iterable[float] = ()
) -> list[float]:
    """Every angle in (a, b) where a switch of the expression changes, or a root, asin or acos has a branch point.

    Switches that depend on speed or time are left out, because position does not determine them.

    `env(lo, hi, anchor)` gives, for arrays of cells, the names as jets of intervals (constants as floats),
    `env_value(phi, anchor)` their values; the anchor is the middle of the piece, which distinguishes an angle at its end
    from the next piece's beginning. Between `edges` angles the names must be smooth and `v`, given by its sign, constant.

    >>> phi_cells = lambda lo, hi, anchor: {"phi": Jet(Interval(lo, hi), 1.0)}
    >>> from flywheel.numerics.expressions import parse
    >>> angles = breakpoints(parse("max(sin(phi), 0.5)*(phi < 2)"), 0, 6, phi_cells, lambda phi, _: {"phi": phi})
    >>> [round(angle, 14) for angle in angles]
    [0.5235987755983, 2.0, 2.61799387799149]
    """
    start = np.array(sorted({float(a), *map(float, smooth_edges), float(b)}))
    edges = start
    for part in decided_by_position(expression):
        try:
            edges = _with_zeros(part, edges, env, env_value)
        except SwitchingError as error:
            raise SwitchingError(f"{part.excerpt}: {error.text}", error.near) from None
    return [float(angle) for angle in edges[_distance(edges, start) > 0]]


def branching(expression: Expression, edges: Array, env_value: Values) -> Mask:
    """Tests at which edges of smooth pieces, all breakpoints among them, a switch changes or is zero; the ends are one.

    `breakpoints` seeks zeros between edges alone: where a piece ends for another reason too, only this tells.

    >>> from flywheel.numerics.expressions import parse
    >>> quarters = 0.5 * np.pi * np.arange(5)
    >>> branching(parse("max(sin(phi), 0)"), quarters, lambda phi, _: {"phi": phi}).tolist()
    [True, False, True, False, True]
    """
    middle, changes = 0.5 * (edges[:-1] + edges[1:]), np.zeros(edges.size, dtype=bool)
    anchors = np.append(middle, middle[-1])
    for part in decided_by_position(expression):
        inside, there = (
            np.broadcast_to(part.evaluate(env_value(phi, at), np, env_value(at, at)), phi.shape)
            for phi, at in ((middle, middle), (edges, anchors))
        )
        before, after = np.append(inside[-1], inside), np.append(inside, inside[0])
        zero = np.abs(there) <= _ZERO * np.maximum(np.abs(before), np.abs(after))
        changes |= (np.sign(before) != np.sign(after)) | zero
    return changes


def decided_by_position(expression: Expression) -> list[Expression]:
    """The switches and branch points of an expression that depend on neither speed nor time."""
    parts = (*expression.switches(), *expression.branch_points())
    return [part for part in parts if not (part.uses_speed or part.uses_time)]


def _with_zeros(part: Expression, edges: Array, env: Enclosures, env_value: Values) -> Array:
    """The edges, and the zeros of an expression between them."""

    def enclose(lo: Array, hi: Array, anchor: Array) -> tuple[Any, Any]:
        jet = part.evaluate(env(lo, hi, anchor), _JETS, env_value(anchor, anchor))
        return (jet.value, jet.first) if isinstance(jet, Jet) else (jet, 0.0)

    def value(phi: Array, anchor: Array) -> Any:
        return part.evaluate(env_value(phi, anchor), np, env_value(anchor, anchor))

    return roots_in_pieces(enclose, value, edges)


RESOLUTION_CAP = 10_000  # cells added by halving: more would take seconds
FINEST_CELL = 1e-14  # of the range: narrower cells are no longer split

_ROOTED = 1e-12  # of the range: in narrower cells rounding of the angle would take nodes across a root's branch point

_EXPONENT = 8.0  # widest range of an exponential's argument
_NEGLIGIBLE = 1e-20  # of the greatest value of the whole expression
_PHASE = 3.0  # widest range of a sine's argument
_POLE = 3.0  # greatest ratio of the distances from a pole
_BRANCH = 6.0  # greatest ratio of the distances from a branch point
_TAME_POWER = 8  # up to here a power of what the nodes resolve is resolved by them
_SCALED = scaled_namespace(NAMESPACE)


class _TrialCells(NamedTuple):
    """Cells under examination: their bounds in interval arithmetic, values in their middles, share of the range.

    `wide` collects the nodes for which cells are too wide, each with a mask of those.
    """

    bounds: At
    middle: At
    share: Array
    wide: list[tuple[Node, Mask]]

    def scaled(self, node: Node) -> Scaled:
        """Bounds of a node, with its exponential factor kept separate."""
        u = expressions.value(node, self.bounds)
        return u if isinstance(u, Scaled) else Scaled(u, {}, NAMESPACE)

    def bounds_of(self, u: Any) -> Interval:
        """Bounds as arrays, one value a cell."""
        return _of_shape(u, self.share.shape)

    def factor(self, node: Node) -> Interval:
        """Bounds of a node except for its exponential factor."""
        return self.bounds_of(self.scaled(node).factor)

    def enclosure(self, node: Node) -> Interval:
        """Bounds of a node."""
        return self.bounds_of(self.scaled(node).plain)


def resolved(expression: Expression, lo: Array, hi: Array, env: Enclosures, env_value: Values) -> Array:
    """Angles at which the cells from `lo` to `hi` (rad) must be split further for the nodes to follow an expression.

    The cells must lie between the expression's breakpoints; `env` and `env_value` are those of `breakpoints`.
    Raises SwitchingError where a denominator is zero, a tangent is infinite, or 10 000 more cells are not enough.

    >>> from flywheel.numerics.expressions import parse
    >>> peak = parse("sin(phi) + exp(-((phi - 2)/1e-3)**2)")
    >>> cells = lambda lo, hi, anchor: {"phi": Jet(Interval(lo, hi), 1.0)}
    >>> splits = resolved(peak, np.array([0.0]), np.array([6.0]), cells, lambda phi, _: {"phi": phi})
    >>> bool(np.min(np.diff(splits)) < 4e-3)
    True
    """
    lo, hi = np.asarray(lo, dtype=float), np.asarray(hi, dtype=float)
    span = float(hi.max() - lo.min())
    splits: list[Array] = []
    peak, count = 0.0, 0
    with np.errstate(all="ignore"):
        while lo.size:
            middle = 0.5 * (lo + hi)
            centre = env_value(middle, middle)
            sizes = np.abs(np.broadcast_to(expression.evaluate(centre, np, centre), lo.shape))
            peak = float(np.max(sizes[np.isfinite(sizes)], initial=peak))
            inside = {name: u.value if isinstance(u, Jet) else u for name, u in env(lo, hi, middle).items()}
            cells = _examined(inside, centre, (hi - lo) / span)
            wide = _too_wide(expression.tree, cells, np.full(lo.shape, _NEGLIGIBLE * peak), {})
            count += int(np.count_nonzero(wide))
            finest = wide & (cells.share <= FINEST_CELL)
            if finest.any() or count > RESOLUTION_CAP:
                at = int(np.flatnonzero(finest if finest.any() else wide)[0])
                raise _refusal(expression, cells, at, float(lo[at]), env_value(middle[at], middle[at]), bool(finest.any()))
            lo, hi, middle = lo[wide], hi[wide], middle[wide]
            splits.append(middle)
            lo, hi = np.concatenate((lo, middle)), np.concatenate((middle, hi))
    return np.sort(np.concatenate(splits or [lo]))


def _examined(inside: Mapping[str, Any], centre: Mapping[str, Any], share: Array) -> _TrialCells:
    """Cells with the values of names over them (intervals or constants) and in their middles."""
    return _TrialCells(At(inside, _SCALED, At(centre, _SCALED)), At(centre, scaled_namespace(np)), share, [])


def narrow(expression: Expression, inside: Mapping[str, Any], centre: Mapping[str, Any], share: Array, peak: Array) -> Mask:
    """A mask of the cells (cells, machines) narrow enough for the nodes to follow an expression, as `resolved` requires.

    Args:
        expression: of which no branch changes inside a cell.
        inside: values of names over the cells: intervals, or constants.
        centre: the same in the middle of each cell.
        share: width of each cell as a share of the range.
        peak: the greatest size of the expression in any cell of a machine.

    >>> from flywheel.numerics.expressions import parse
    >>> lo, hi = np.array([[0.0], [1.0]]), np.array([[1.0], [3.0]])
    >>> of = lambda k: ({"phi": Interval(lo, hi), "k": k}, {"phi": 0.5 * (lo + hi), "k": k}, (hi - lo) / 3.0)
    >>> narrow(parse("sin(k*phi)", frozenset("k")), *of(np.array([1.0, 2.0])), np.ones(2)).tolist()
    [[True, True], [True, False]]

    """
    shape = np.broadcast_shapes(share.shape, peak.shape)
    with np.errstate(all="ignore"):
        cells = _examined(inside, centre, np.broadcast_to(share, shape))
        return np.asarray(~_too_wide(expression.tree, cells, np.broadcast_to(_NEGLIGIBLE * peak, shape), {}))


def _refusal(
    expression: Expression, cells: _TrialCells, at: int, near: float, middle: Mapping[str, Any], finest: bool
) -> SwitchingError:
    """Reason why no cells within the limits resolve an expression, with the part for which one of them is too wide."""
    node = next(node for node, mask in cells.wide if mask[at])
    part = expression.part(node)
    infinite = expression.undefined(middle, middle)
    if finest and not infinite:
        if node.op == "tan":
            infinite = f"{part}: infinite, the tangent of a right angle"
        below = [arg for sign, arg in zip(node.signs, node.args, strict=True) if sign == "/"] if node.op == "product" else []
        for arg in node.args[:1] if node.op == "**" else below:
            u = cells.factor(arg)
            if not infinite and u.mignitude[at] <= u.width[at]:
                infinite = f"{part}: a division by {expression.part(arg)}, which is 0"
    if infinite:
        return SwitchingError(f"a value that is not finite near phi = {{near}} ({infinite})", near)
    if finest:
        text = f"{expression.excerpt}: too steep near phi = {{near}} for the rounding of the angle ({part})"
        return SwitchingError(text, near)
    which = "" if node == expression.tree else f" {part}"
    text = (
        f"{expression.excerpt}:{which} varies too fast for {RESOLUTION_CAP} cells to follow it (first near phi = {{near}})"
    )
    return SwitchingError(text, near)


def _too_wide(node: Node, cells: _TrialCells, tolerance: Array, powers: Powers) -> Mask:
    """Cells that are too wide for a node or anything inside it; only branches that are taken count.

    The node, divided by an exponential factor (its powers), may have an error of the tolerance in every cell: infinite where
    the node has no effect.
    """
    if node.op in expressions.BOOLEAN or node.op == "sign" or not (tolerance < np.inf).any():
        return np.zeros(tolerance.shape, dtype=bool)
    if node.op in ("if", "min", "max"):
        *test, first, second = node.args
        if test:
            chosen = expressions.truth(test[0], cells.middle)
        else:
            left, right = (plain(expressions.value(arg, cells.middle)) for arg in node.args)
            chosen = left <= right if node.op == "min" else left >= right
        return _too_wide(first, cells, np.where(chosen, tolerance, np.inf), powers) | _too_wide(
            second, cells, np.where(chosen, np.inf, tolerance), powers
        )
    if node.op in ("neg", "abs"):
        return _too_wide(node.args[0], cells, tolerance, powers)
    u = cells.scaled(node)
    rest = u / Scaled(1.0, powers, NAMESPACE)
    whole = cells.bounds_of(rest.plain)
    live = np.asarray((tolerance < np.inf) & ~(whole.width <= tolerance))
    if not live.any():
        return live
    wide = np.asarray(live & ((cells.bounds_of(rest.exponent).width > _EXPONENT) | _unfollowed(node, cells)))
    if wide.any():
        cells.wide.append((node, wide))
    tolerance = np.where(live, tolerance, np.inf)
    if node.op == "exp":
        return wide | _too_wide(node.args[0], cells, _share(tolerance, whole.magnitude), {})
    growth = cells.bounds_of(NAMESPACE.exp(interval(rest.exponent))).magnitude if rest.powers else 1.0
    for arg, inner, kept in _of_arguments(node, cells, u, _share(tolerance, growth)):
        wide = wide | _too_wide(arg, cells, inner, kept)
    return wide


def _share(tolerance: Array, steepness: Any) -> Array:
    """The error allowed in an argument whose function rises by so much at most; 0 if that is not known."""
    shared = tolerance / steepness
    return np.asarray(np.where(np.isnan(shared), np.where(tolerance == np.inf, np.inf, 0.0), shared))


def _of_arguments(node: Node, cells: _TrialCells, u: Scaled, tolerance: Array) -> list[tuple[Node, Array, Powers]]:
    """Each argument of a node, its allowed error, and the exponential factor that divides it."""
    if node.op == "sum":
        return [(arg, tolerance, u.powers) for arg in node.args]
    if not node.args:
        return []
    scaled = [cells.scaled(arg) for arg in (node.args if node.op == "product" else node.args[:1])]
    arguments: list[tuple[Node, Array, Powers]] = []
    if node.op == "product":
        factors = [cells.bounds_of(one.factor) for one in scaled]
        sizes = [v if sign == "*" else NAMESPACE.divide(1.0, v) for sign, v in zip(node.signs, factors, strict=True)]
        for k, (sign, arg) in enumerate(zip(node.signs, node.args, strict=True)):
            steepness: Any = np.ones(tolerance.shape)
            for j, size in enumerate(sizes):
                steepness = steepness * (size.magnitude if j != k else 1.0)
            steepness = steepness if sign == "*" else steepness * sizes[k].magnitude ** 2
            arguments.append((arg, _share(tolerance, steepness), scaled[k].powers))
        return arguments
    arg, powers, v = node.args[0], scaled[0].powers, cells.bounds_of(scaled[0].factor)
    if node.op == "log":
        arguments = [(tree, _share(tolerance, np.abs(c)), {}) for tree, (_, c) in powers.items() if isinstance(tree, Node)]
        return [(arg, _share(tolerance, 1.0 / v.mignitude), powers), *arguments]
    order = 0.5 if node.op == "sqrt" else node.args[1].number if node.op == "**" and node.args[1].op == "number" else None
    if order is not None:
        steepness = abs(order) * np.maximum(v.magnitude ** (order - 1), v.mignitude ** (order - 1))
        return [(arg, _share(tolerance, steepness), powers)]
    if node.op in ("sin", "cos", "atan"):
        return [(arg, tolerance, {})]
    unknown = np.where(tolerance == np.inf, np.inf, 0.0)
    return [(arg, unknown, {}) for arg in node.args]


def _unfollowed(node: Node, cells: _TrialCells) -> Mask:
    """Cells in which the nodes do not follow a function, by the bounds of its arguments."""
    none = np.zeros(cells.share.shape, bool)
    if node.op == "product":
        below = [cells.factor(arg) for sign, arg in zip(node.signs, node.args, strict=True) if sign == "/"]
        return np.asarray(np.any([none, *(_ratio(u) > _POLE for u in below)], axis=0))
    if node.op == "**":
        return _unfollowed_power(node, cells)
    if node.op in ("sqrt", "log"):
        return _branching(node.args[0], cells.factor(node.args[0]), 0.5 if node.op == "sqrt" else 0.0, cells)
    if node.op == "atan2":
        y, x = (cells.enclosure(arg) for arg in node.args)
        near = np.maximum(y.width, x.width) > 1.5 * np.hypot(y.mignitude, x.mignitude)
        return np.asarray(near & (cells.share > 2 * FINEST_CELL))
    if node.op not in ("sin", "cos", "tan", "asin", "acos", "atan"):
        return none
    u = cells.enclosure(node.args[0])
    if node.op == "tan":  # its poles are the zeros of the cosine
        return np.asarray((u.width > 1.0) | (_ratio(NAMESPACE.cos(u)) > _POLE))
    if node.op in ("asin", "acos"):
        return _branching(node.args[0], 1.0 - u, 0.5, cells) | _branching(node.args[0], 1.0 + u, 0.5, cells)
    return np.asarray(u.width > (1.5 * np.hypot(1.0, u.mignitude) if node.op == "atan" else _PHASE))


def _unfollowed_power(node: Node, cells: _TrialCells) -> Mask:
    base, exponent = node.args
    none = np.zeros(cells.share.shape, bool)
    if expressions.grows(node):
        return none
    u = cells.factor(base)
    if exponent.op != "number":
        steep = (cells.enclosure(exponent) * NAMESPACE.log(u)).width > _EXPONENT
        return np.asarray(steep | _branching(base, u, 0.0, cells))
    number = exponent.number
    if number < 0:
        return np.asarray(_ratio(u) > min(_POLE, np.exp(12.0 / -number)))
    if number % 1:
        return _branching(base, u, number, cells)
    # a high power is as steep as an exponential of n log u
    return np.asarray(_ratio(u) > np.exp(12.0 / number)) if number > _TAME_POWER else none


def _ratio(u: Interval) -> Array:
    """Greatest over least distance from zero; infinite where zero is inside."""
    return np.asarray(np.where(u.mignitude > 0, u.magnitude / u.mignitude, np.inf))


def _branching(arg: Node, u: Interval, order: float, cells: _TrialCells) -> Mask:
    """Near a branch point u^order the cells shrink with their distance, until the rest is negligible.

    Nor do they shrink where the bounds of u are as wide as rounding alone makes them in the middle of a cell.
    """
    least = 2 * FINEST_CELL if order <= 0.0 else _ROOTED
    near = np.asarray((_ratio(u) > _BRANCH) & (cells.share > max(1e-16 ** (1 / (1 + order)), least)))
    if not near.any() or cells.bounds.anchor is None:
        return near
    middle = expressions.value(arg, cells.bounds.anchor)
    rounding = interval(middle.factor if isinstance(middle, Scaled) else middle).width
    return np.asarray(near & (u.width > 4 * rounding))
