"""All ways to assemble a linkage with its driver at the start, and the choice among them.

The loop equations have several solutions; which one is meant is for guesses and sides to say, never for the iteration that
happens to converge. So all are looked for, from many starting points at once, and what cannot be told apart is refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees, pi

import numpy as np
from numpy.typing import NDArray

from flywheel.faults import Fault, SceneError
from flywheel.linkage.description import SLIDE, SLOT, Linkage, Side
from flywheel.linkage.equations import Equations
from flywheel.linkage.loops import Loops
from flywheel.linkage.mobility import faults, gruebler
from flywheel.linkage.newton import solved

Array = NDArray[np.float64]

_STARTS = 96  # for every unknown
_MOST_STARTS = 3000
_ITERATIONS = 40
_STRIDE = 1.0  # rad, or units: the longest Newton step from a guess
_SAME = 1e-6
_CLOSED = 1e-11
_SINGULAR = 1e-5  # of the greatest singular value: nearer to a lock, the start itself is found too badly
_CLEARER = 0.7  # the nearest assembly must be nearer to the guess than this share of the next one's distance
_FITS = 0.3
_ROUGH = 0.1  # rad, or units: guesses are never better than this
_LISTED = 8
_LONGEST = 240  # characters of all that are listed: a fault is a single line
_NAMED = 6
_TURNS = 4.0  # to each side, of angles that a coupling ties: each turn may be another assembly
_TRIED = 200


def assembled(equations: Equations) -> Array:
    """The variables z of the assembly that the linkage asks for, shape (variables,).

    Raises:
        SceneError: where it cannot be assembled, or guesses and sides leave more than one assembly.

    """
    loops = equations.loops
    found = assemblies(equations)
    if not len(found):
        raise SceneError([_impossible(equations)])
    wrong = [_wrong(equations, z) for z in found[:_LISTED]]
    if all(wrong):
        raise SceneError(wrong[0])
    chosen = _chosen(loops, found)
    if faults := _wrong(equations, chosen):
        raise SceneError(faults)
    return chosen


def _wrong(equations: Equations, z: Array) -> list[Fault]:
    """Faults of an assembly that the driver's coordinate does not settle, or that cannot move."""
    loops = equations.loops
    jacobian = equations.jacobian(z[None], equations.bases(z[None]))[0]
    found = faults(loops, jacobian)
    near = loops.unknowns and np.linalg.matrix_rank(jacobian[:, 1:], rtol=_SINGULAR) < loops.unknowns
    held = found and gruebler(loops.linkage) < 1  # a joint too many is the likelier cause
    if (found or near) and not held and not _loose_everywhere(equations):
        what = f"an assembly that locks or branches {_where(loops)} ({described(loops, z)})"
        advice = "choose another `start`, and a range of the driver that leaves this position out"
        return [Fault(loops.linkage.path, what, "a position that the driver settles", advice)]
    return found


def _loose_everywhere(equations: Equations) -> bool:
    """Whether the unknowns are not settled at positions at random either: that is no matter of a special position."""
    loops = equations.loops
    if loops.equations < loops.unknowns:
        return True
    z = _starts(loops)[1::7][:8]
    z[:, 1:] += 0.1234 * np.arange(1, loops.unknowns + 1)
    jacobian = equations.jacobian(z, equations.bases(z))[:, :, 1:]
    return bool((np.linalg.matrix_rank(jacobian, rtol=1e-9) < loops.unknowns).all())


def assemblies(equations: Equations) -> Array:
    """Every assembly that was found with the driver at its start, shape (assemblies, variables).

    Angles lie from -pi to pi, but for those that a coupling ties: its relation holds for the turns that they have made.

    Newton-Raphson with bounded steps runs from evenly scattered points and from the guesses; a solution that all
    of them miss would stay unknown, which is why there are many.
    """
    z, square = _starts(equations.loops), _is_square(equations)
    done = []
    for _ in range(_ITERATIONS):
        move, gap = _step(equations, z, square)
        z[:, 1:] += move
        closed = (np.abs(move).max(axis=1, initial=0.0) < _CLOSED) & (gap < _CLOSED)
        done.append(z[closed])
        z = z[~closed & np.isfinite(z).all(axis=1)]
        if not len(z):
            break
    closed_z = np.concatenate([*done, z[_step(equations, z, square)[1] < _CLOSED]] if len(z) else done)
    return _distinct(equations.loops, closed_z[:_MOST_STARTS])


def _is_square(equations: Equations) -> bool:
    return equations.loops.equations == equations.loops.unknowns and not _loose_everywhere(equations)


def _step(equations: Equations, z: Array, square: bool) -> tuple[Array, Array]:
    """One bounded Gauss-Newton step from many points, and their largest residuals."""
    bases = equations.bases(z)
    gap = equations.residual(z, bases)
    jacobian = equations.jacobian(z, bases)[:, :, 1:]
    if square:
        move = solved(jacobian, -gap)
        lost = ~np.isfinite(move).all(axis=1)
        move[lost] = 0.3
    else:
        move = np.einsum("nij,nj->ni", np.linalg.pinv(jacobian, rcond=1e-10), -gap)
    longest = np.abs(move[:, _in_loops(equations.loops)]).max(axis=1, initial=0.0)
    return move * np.minimum(1.0, _STRIDE / np.maximum(longest, 1e-300))[:, None], np.abs(gap).max(axis=1, initial=0.0)


def _in_loops(loops: Loops) -> NDArray[np.bool_]:
    """Which unknowns the loops depend on; the others follow from couplings alone, however far."""
    used = np.any(np.abs(loops.closures) > 0.0, axis=0)
    turned = np.any(loops.turns[used] != 0.0, axis=0)
    turned[loops.slides[used & (loops.slides >= 0)]] = True
    return np.asarray(turned[1:])


def _starts(loops: Loops) -> Array:
    """Points scattered evenly over angles and displacements (a Kronecker sequence), the guesses first."""
    count = min(_STARTS * max(loops.unknowns, 1), _MOST_STARTS) if loops.unknowns else 1
    wide = float(np.abs(loops.closures).sum(axis=1).max(initial=1.0))
    root = _generalised_golden(max(loops.unknowns, 1))
    share = (0.5 + np.arange(count)[:, None] * root ** -np.arange(1.0, loops.unknowns + 1.0)) % 1.0
    z = np.empty((count, loops.unknowns + 1))
    z[:, 0] = start(loops)
    tied = _tied(loops)
    for k, name in enumerate(loops.names[1:]):
        reach = _TURNS * pi if tied[k + 1] else pi
        z[:, k + 1] = (reach if name.startswith("angle") else wide) * (2.0 * share[:, k] - 1.0)
    guesses, guessed = _guesses(loops), z[: max(count // 4, 1)]
    for column, value in guesses.items():
        guessed[:, column] = value
    _relate(loops, z, ())
    for column, value in guesses.items():
        guessed[:, column] = value
    _relate(loops, guessed, tuple(guesses))
    return z


def _relate(loops: Loops, z: Array, given: tuple[int, ...]) -> None:
    """Put starting points onto every gear and rolling pair, by the variable that has to turn most, and is not given.

    A pinion may have to turn many times for its rack's travel, and no bounded step would take it there.
    """
    for relation in loops.relations:
        if relation.lift is not None:
            continue
        line = relation.second.weights - relation.ratio * relation.first.weights
        rest = relation.second.constant - relation.ratio * relation.first.constant - relation.phase
        tied = [int(k) for k in np.flatnonzero(line[1:]) + 1]
        moved = [k for k in tied if k not in given] or tied
        if moved:
            k = min(moved, key=lambda column: abs(float(line[column])))
            z[:, k] -= (z @ line + rest) / line[k]


def _generalised_golden(dimension: int) -> float:
    """Root of x^(d+1) = x + 1: its powers scatter points evenly (M. Roberts, 2018)."""
    x = 1.5
    for _ in range(60):
        x = (1.0 + x) ** (1.0 / (dimension + 1))
    return x


def start(loops: Loops) -> float:
    """The driver's coordinate at which the linkage is assembled, scaled."""
    linkage = loops.linkage
    return linkage.start / loops.unit if linkage.sliding else linkage.start


def _guesses(loops: Loops) -> dict[int, float]:
    """Guessed values by the number of the variable; a body that is no variable of its own has its leader's angle guessed."""
    found: dict[int, float] = {}
    for body, form in zip(loops.linkage.names, loops.angles, strict=True):
        guess = loops.linkage.link(body).guess
        turning = np.flatnonzero(form.weights[1:])
        if guess is not None and turning.size == 1:
            rest = form.constant + form.weights[0] * start(loops)
            found[int(turning[0]) + 1] = guess - rest
    for joint in loops.linkage.joints:
        name = f"slide of {joint.name}"
        if joint.guess is not None and joint.kind in (SLIDE, SLOT) and name in loops.names:
            found[loops.names.index(name)] = joint.guess / loops.unit
    return found


def _angular(loops: Loops) -> Array:
    return np.array([name.startswith("angle") for name in loops.names[1:]], dtype=bool)


def _tied(loops: Loops) -> NDArray[np.bool_]:
    """Which variables take part in a coupling: a turn more of one of them would break its relation."""
    weights = [np.abs(form.weights) for r in loops.relations for form in (r.first, r.second)]
    return np.asarray(np.sum([np.zeros(len(loops.names)), *weights], axis=0) > 0.0)


def _turns(loops: Loops, z: Array) -> Array:
    """The largest angle (rad) that a coupled joint other than the driver has turned through, of positions (n, variables)."""
    firsts = [r.first for r in loops.relations if np.any(r.first.weights[1:])]
    sizes = [np.abs(z @ form.weights + form.constant) for form in firsts]
    return np.asarray(np.max(sizes, axis=0)) if sizes else np.zeros(len(z))


def _distinct(loops: Loops, z: Array) -> Array:
    """Solutions that differ as positions, in the order of their variables; of equal ones that with the fewest turns."""
    if not len(z):
        return z
    z = z[np.argsort(_turns(loops, z), kind="stable")]
    free = np.flatnonzero(np.concatenate(([False], _angular(loops))) & ~_tied(loops))
    z[:, free] = -((pi - z[:, free]) % (2 * pi) - pi)
    kept: list[Array] = []
    while len(z):
        kept.append(z[0])
        z = z[np.abs(_apart(loops, z, z[0])).max(axis=1, initial=0.0) >= _SAME]
    found = np.array(kept)
    return found[np.lexsort(np.round(found, 6).T[::-1])]


def _apart(loops: Loops, a: Array, b: Array) -> Array:
    """Differences of the unknowns of positions, angles by the shorter way."""
    gap = (a - b)[..., 1:]
    return np.where(_angular(loops), (gap + pi) % (2 * pi) - pi, gap)


def _chosen(loops: Loops, found: Array) -> Array:
    """The one assembly that sides and guesses leave; its free angles within half a turn of their guesses."""
    fitting = found[[all(_on_side(loops, z, side) for side in loops.linkage.sides) for z in found]]
    if not len(fitting):
        raise SceneError([_fault(loops, "assembly", "sides that no assembly fits", found, "one that does")])
    guesses = _guesses(loops)
    chosen = _only(loops, fitting, guesses)
    for column, guess in guesses.items():
        if loops.names[column].startswith("angle") and not _tied(loops)[column]:
            chosen[column] += 2 * pi * round((guess - chosen[column]) / (2 * pi))
    return chosen


def _only(loops: Loops, fitting: Array, guesses: dict[int, float]) -> Array:
    """The assembly nearest to the guesses, if one is clearly the nearest.

    Where a coupling gives several by the turns of the joints that it ties, those within half a turn go first.
    """
    near = _nearest(loops, fitting, guesses)
    if len(near) > 1:
        few = near[_turns(loops, near) < pi + _SAME]
        near = _nearest(loops, few, guesses) if len(few) else near
    if len(near) == 1:
        return np.array(near[0])
    if not guesses:
        raise SceneError([_fault(loops, "", f"{len(near)} assemblies that fit", near, "a guess or side for one")])
    what = "guesses that do not tell the assemblies apart"
    raise SceneError([_fault(loops, "", what, near, "guesses nearer to one of them")])


def _nearest(loops: Loops, fitting: Array, guesses: dict[int, float]) -> Array:
    """The assembly clearly nearest to the guesses, or all of those that are about as near."""
    if len(fitting) == 1 or not guesses:
        return fitting
    target, columns = fitting[0].copy(), sorted(guesses)
    target[columns] = [guesses[k] for k in columns]
    gaps = np.array([_apart(loops, z, target)[[k - 1 for k in columns]] for z in fitting])
    distance = np.sqrt((gaps**2).sum(axis=1))
    near = int(np.argmin(distance))
    if contrary := _contradicted(loops, fitting, gaps, near):
        names = ", ".join(loops.names[columns[k]] for k in contrary)
        what = f"guesses that contradict each other, as {names} fits another assembly than the rest,"
        raise SceneError([_fault(loops, "", what, fitting, "guesses of one")])
    return np.asarray(fitting[distance <= distance[near] / _CLEARER])


def _contradicted(loops: Loops, fitting: Array, gaps: Array, near: int) -> list[int]:
    """Guesses, by position, that the nearest assembly is as far from as assemblies lie apart, while another one fits."""
    spread = np.max([np.abs(_apart(loops, fitting, z)).max(axis=0) for z in fitting], axis=0)
    columns = [k - 1 for k in sorted(_guesses(loops))]
    off, best = np.abs(gaps[near]), np.abs(gaps).min(axis=0)
    return np.flatnonzero((off > np.maximum(_CLEARER * spread[columns], _ROUGH)) & (best < _FITS * off)).tolist()


def _on_side(loops: Loops, z: Array, side: Side) -> bool:
    """Whether a point lies on the asked side of a line."""
    at = [_place(loops, z, *where) for where in (side.point, side.start, side.end)]
    line, reach = at[2] - at[1], at[0] - at[1]
    return bool((line.conjugate() * reach).imag * side.sense > 0.0)


def _place(loops: Loops, z: Array, body: str, point: str) -> complex:
    equations = Equations(loops)
    nothing = np.zeros((1, z.size))
    k = loops.linkage.names.index(body)
    origin = complex(equations.origins(equations.bases(z[None]), nothing, nothing)[0][0, k])
    at = loops.linkage.link(body).point(point)
    angle = float(z @ loops.angles[k].weights + loops.angles[k].constant)
    return origin + complex(at.x, at.y) / loops.unit * complex(np.exp(1j * angle))


def described(loops: Loops, z: Array, variables: Sequence[int] = ()) -> str:
    """An assembly in words: angles of the bodies in degrees, displacements in m; only some of the variables if told.

    Bodies that keep a common angle are named once, by the first of them.
    """
    parts = []
    for k in variables or range(1, len(loops.names)):
        value, name = z[k], loops.names[k]
        kind, _, what = name.partition(" of ")
        if kind == "angle":
            form = loops.angles[loops.linkage.names.index(what)]
            angle = round(degrees(float(z @ form.weights + form.constant)), 9) % 360 % 360
            parts.append(f"{what} {angle:.4g} deg")
        else:
            parts.append(f"{what} {round(value, 12) * loops.unit + 0.0:.4g} m")
    return ", ".join(parts[:_NAMED]) + (f" and {len(parts) - _NAMED} more" if len(parts) > _NAMED else "")


def _where(loops: Loops) -> str:
    linkage: Linkage = loops.linkage
    value = f"{linkage.start:.6g} m" if linkage.sliding else f"{degrees(linkage.start):.6g} deg"
    return f"with {linkage.driver} at {value}"


def _fault(loops: Loops, key: str, what: str, found: Array, expected: str) -> Fault:
    texts = [f"({described(loops, z)})" for z in found[:_LISTED]]
    lengths = np.cumsum([len(text) for text in texts])
    few = max(int(np.searchsorted(lengths, _LONGEST)), 1)
    listed = "; ".join(texts[:few])
    more = f" and {len(found) - few} more" if len(found) > few else ""
    path = f"{loops.linkage.path}.{key}" if key else loops.linkage.path
    return Fault(path, f"{what} {_where(loops)}", expected, f"there are {listed}{more}")


def _impossible(equations: Equations) -> Fault:
    """What keeps the bodies apart: the loops that stay open where they are nearest to closing, and joints too many."""
    loops = equations.loops
    gaps = _nearest_gaps(equations)
    open_loops = [
        f"the loop {' - '.join(path)} stays open by {gap * loops.unit:.3g} m"
        for path, gap in zip(loops.paths, gaps, strict=True)
        if gap > _SAME
    ]
    count = gruebler(loops.linkage)
    surplus = [f"Gruebler's count is {count} degrees of freedom, so that a joint may be too many"] if count < 1 else []
    found = f"bodies that cannot be assembled {_where(loops)}"
    told = "; ".join([*open_loops[:_NAMED], *surplus]) or "their couplings contradict each other"
    return Fault(loops.linkage.path, found, "loops that close", f"{told}; change a length, or `start`")


def _nearest_gaps(equations: Equations) -> Array:
    """How far every loop stays open where all of them together are nearest to closing."""
    z = _starts(equations.loops)[:_TRIED]
    for _ in range(_ITERATIONS):
        z[:, 1:] += _step(equations, z, square=False)[0]
    bases = equations.bases(z)
    total = (equations.residual(z, bases) ** 2).sum(axis=1)
    best = int(np.nanargmin(total))
    return np.asarray(np.abs(bases.whole[best] @ equations.loops.closures.T))
