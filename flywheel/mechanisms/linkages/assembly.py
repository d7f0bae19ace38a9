"""All ways to assemble a linkage with its driver at the start, and the choice among them.

The loop equations have several solutions; which one is meant is for guesses and sides to say, never for the iteration that
happens to converge. So all are looked for, from many starting points at once, and what cannot be told apart is refused.
"""

from __future__ import annotations

from math import degrees, pi

import numpy as np
from numpy.typing import NDArray

from flywheel.mechanisms.linkages.equations import Equations, Loops, faults, gruebler, solved
from flywheel.mechanisms.linkages.singular import SINGULAR, described, family, in_families, met, places, singular_values
from flywheel.numerics.faults import Fault, SceneError
from flywheel.scene.linkage import SLIDE, SLOT, Linkage

Array = NDArray[np.float64]

_STARTS = 96  # for every unknown
_MOST_STARTS = 3000
_ITERATIONS = 40
_STRIDE = 1.0  # rad, or units: the longest Newton step from a guess
_SAME = 1e-6
_CLOSED = 1e-11
_CLEARER = 0.7  # the nearest assembly must be nearer to the guess than this share of the next one's distance
_FITS = 0.3
_BLURRED = 1e-3  # rad, or units: double roots nearer than this are one
_ROUGH = 0.1  # rad, or units: guesses are never better than this
_LISTED = 8
_LONGEST = 240  # characters of all that are listed: a fault is a single line
_NAMED = 6
_TURNS = 4.0  # to each side, of angles that a coupling ties: each turn may be another assembly
_TRIED = 200


def assembled(equations: Equations) -> Array:
    """The variables z of the assembly that the linkage asks for, shape (variables,).

    Sides and guesses choose first, among the assemblies that stand alone; what they choose is judged then. Links that
    collapse onto each other have a continuous family of assemblies besides, in which some bodies turn freely: none of
    those can be meant, unless the guesses say so.

    Raises:
        SceneError: where it cannot be assembled, guesses and sides leave more than one assembly, or the one that they
            choose locks, branches or is one of a continuous family.

    """
    loops = equations.loops
    found = assemblies(equations)
    if not len(found):
        raise SceneError([_impossible(equations)])
    if loops.unknowns and _loose_everywhere(equations):
        raise SceneError(_wrong(equations, found[0]))
    alone, members = _parted(equations, found)
    fitting, members = (part[_on_sides(equations, part)] for part in (alone, members))
    if not len(fitting) and not len(members):
        raise SceneError([_fault(loops, "assembly", "sides that no assembly fits", found, "one that does")])
    guesses = _guesses(loops)
    member = members[0] if not len(fitting) else _guessed_member(loops, fitting, members, guesses)
    if member is not None:
        raise SceneError([_family_fault(equations, member, fitting if len(fitting) else alone)])
    nearest = fitting[np.argmin(_distances(loops, fitting, guesses))]
    if not _runs(equations, fitting).any():
        raise SceneError(_wrong(equations, nearest))
    chosen = _chosen(loops, fitting, guesses)
    if faults := _wrong(equations, chosen):
        raise SceneError(faults)
    return chosen


def _runs(equations: Equations, z: Array) -> NDArray[np.bool_]:
    """Which positions the driver settles, and can leave."""
    if not equations.loops.unknowns:
        return np.ones(len(z), dtype=bool)
    jacobian = equations.jacobian(z, equations.bases(z))
    settled = np.linalg.matrix_rank(jacobian[:, :, 1:], rtol=SINGULAR) == equations.loops.unknowns
    return np.asarray(settled & (np.linalg.matrix_rank(jacobian, rtol=1e-9) == equations.loops.unknowns))


def _parted(equations: Equations, found: Array) -> tuple[Array, Array]:
    """Assemblies that stand alone, a double root once, and members of continuous families."""
    if not equations.loops.unknowns:
        return found, found[:0]
    values, _ = singular_values(equations, found)
    singular = values[:, -1] <= SINGULAR * values[:, 0]
    member = np.zeros(len(found), dtype=bool)
    member[singular] = in_families(equations, found[singular])
    alone = list(found[~singular])
    for z in found[singular & ~member]:  # found to the root of rounding, and so more than once
        if all(np.abs(_apart(equations.loops, z, other)).max() > _BLURRED for other in alone):
            alone.append(z)
    return np.array(alone).reshape(-1, found.shape[1]), found[member]


def _guessed_member(loops: Loops, alone: Array, family: Array, guesses: dict[int, float]) -> Array | None:
    """The member of a family that guesses mean: they are many, and fit it far better than any assembly that stands alone."""
    if not len(family) or len(guesses) < 2:
        return None
    gaps = _distances(loops, family, guesses)
    near = int(np.argmin(gaps))
    return family[near] if gaps[near] < _FITS * max(_distances(loops, alone, guesses).min() - _ROUGH, 0.0) else None


def _wrong(equations: Equations, z: Array) -> list[Fault]:
    """Faults of an assembly that the driver's coordinate does not settle, or that cannot move."""
    loops = equations.loops
    jacobian = equations.jacobian(z[None], equations.bases(z[None]))[0]
    found = faults(loops, jacobian)
    near = loops.unknowns and np.linalg.matrix_rank(jacobian[:, 1:], rtol=SINGULAR) < loops.unknowns
    held = found and gruebler(loops.linkage) < 1  # a joint too many is the likelier cause
    if not (found or near) or _loose_everywhere(equations):
        return found
    if fault := met(equations, z, float(z[0]) - _BLURRED, float(z[0]) + _BLURRED) if near else None:
        return [fault]
    if not held:
        what = f"an assembly that locks or branches {_where(loops)} ({described(loops, z)})"
        advice = "choose another `start`, and a range of the driver that leaves this position out"
        return [Fault(loops.linkage.path, what, "a position that the driver settles", advice)]
    return found


def _loose_everywhere(equations: Equations) -> bool:
    """Whether the unknowns are not settled at positions at random either: that is no matter of a special position."""
    loops = equations.loops
    if loops.equations < loops.unknowns:
        return True
    if loops.unknowns == 0:  # a pendulum: nothing is to be settled
        return False
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
    z, square = (
        _starts(equations.loops),
        (equations.loops.equations == equations.loops.unknowns and not _loose_everywhere(equations)),
    )
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


def _chosen(loops: Loops, fitting: Array, guesses: dict[int, float]) -> Array:
    """The one assembly that guesses leave; its free angles within half a turn of them."""
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


def _gaps(loops: Loops, z: Array, guesses: dict[int, float]) -> Array:
    """How far assemblies are from each guess, shape (assemblies, guesses)."""
    columns = sorted(guesses)
    target = np.zeros(len(loops.names))
    target[columns] = [guesses[k] for k in columns]
    return np.asarray(_apart(loops, z, target)[:, [k - 1 for k in columns]])


def _distances(loops: Loops, z: Array, guesses: dict[int, float]) -> Array:
    return np.asarray(np.sqrt((_gaps(loops, z, guesses) ** 2).sum(axis=1)))


def _nearest(loops: Loops, fitting: Array, guesses: dict[int, float]) -> Array:
    """The assembly clearly nearest to the guesses, or all of those that are about as near."""
    if len(fitting) == 1 or not guesses:
        return fitting
    columns, gaps = sorted(guesses), _gaps(loops, fitting, guesses)
    distance = _distances(loops, fitting, guesses)
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


def _on_sides(equations: Equations, z: Array) -> NDArray[np.bool_]:
    """Which positions have every point on the side of its line that is asked for."""
    linkage, fits = equations.loops.linkage, np.ones(len(z), dtype=bool)
    for side in linkage.sides:
        ends = [(body, linkage.link(body).point(name)) for body, name in (side.point, side.start, side.end)]
        point, start, end = (places(equations, z, *where) for where in ends)
        fits &= ((end - start).conjugate() * (point - start)).imag * side.sense > 0.0
    return fits


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


def _family_fault(equations: Equations, z: Array, alone: Array) -> Fault:
    """What a member of a continuous family is, and which assemblies there are beside it."""
    loops, expected = equations.loops, "one assembly that the driver settles"
    what = f"a continuous family of assemblies, as {family(equations, z)},"
    if len(alone):
        return _fault(loops, "", what, alone, f"{expected}, by guesses and sides")
    advice = "choose another `start`, or change a length"
    return Fault(loops.linkage.path, f"{what} {_where(loops)}", expected, advice)


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
