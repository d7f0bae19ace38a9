"""Singular positions of a linkage: locks, change points and continuous families of assemblies, found and put in words.

Where the Jacobian by the unknowns is singular, the driver does not settle the position. At a lock (a fold) the driver turns
back; at a change point two assemblies cross; a continuous family has one at every position of the driver, because links have
collapsed onto each other.

Source: for folds and crossings of solutions, W. J. F. Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria,
SIAM 2000, chapters 3 and 4.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from math import degrees

import numpy as np
from numpy.typing import NDArray

from flywheel.mechanisms.linkages.equations import PARALLELOGRAM, Equations, Loops, change_point_four_bar
from flywheel.numerics.faults import Fault
from flywheel.scene.linkage import PIN, Point

Array = NDArray[np.float64]

SINGULAR = 1e-5  # of the greatest singular value: nearer to a lock, the position itself is found too badly
_ITERATIONS = 40
_FAR = 0.3  # rad, or units: farther from where it began, no iteration is followed
_SETTLED = 1e-11
_TOUCHES = 1e-11  # a singular position closes within this; one that is only nearly reached does not
_ALONG = 0.05  # rad, or units: how far along a null vector another member of a family is looked for
_MEETS = 1e-8  # residual there: that of a double root is some 1e-3
_SMALL = 1e-6  # of the largest rate, length or singular value: nothing
_TAKES_PART = 0.05
_NAMED = 6

_ONE = "one assembly over the whole range of the driver"
_LEAVE = "leave this position out of `start` and of the driver's range"


def singular_values(equations: Equations, z: Array) -> tuple[Array, Array]:
    """Singular values of the Jacobian by the unknowns, and its right vectors, at positions z (n, variables)."""
    jacobian = equations.jacobian(z, equations.bases(z))[:, :, 1:]
    _, values, rows = np.linalg.svd(jacobian)
    full = np.zeros((len(z), jacobian.shape[2]))
    full[:, : values.shape[1]] = values
    return full, rows


def in_families(equations: Equations, z: Array) -> NDArray[np.bool_]:
    """Which assemblies (n, variables) are members of a continuous family.

    Where the Jacobian has a null vector v, the plane v · (x - z) = 0.05 holds another solution close by if the assembly is
    one of a family; at a lock or a change point the equations stay open there by the order of that distance squared.
    """
    values, rows = singular_values(equations, z)
    free = values <= SINGULAR * values[:, :1]
    member = np.zeros(len(z), dtype=bool)
    for k in range(z.shape[1] - 1):
        asked = np.flatnonzero(free[:, k] & ~member)
        if asked.size:
            member[asked] = _continues(equations, z[asked], rows[asked, k])
    return member


def _continues(equations: Equations, z: Array, v: Array) -> NDArray[np.bool_]:
    """Whether another assembly lies on the plane across v at the distance 0.05 from each of z, near by."""
    moved = z.copy()
    moved[:, 1:] += _ALONG * v
    for _ in range(_ITERATIONS):
        bases = equations.bases(moved)
        off = ((moved - z)[:, 1:] * v).sum(axis=1) - _ALONG
        gap = np.concatenate((equations.residual(moved, bases), off[:, None]), axis=1)
        matrix = np.concatenate((equations.jacobian(moved, bases)[:, :, 1:], v[:, None, :]), axis=1)
        moved[:, 1:] -= np.einsum("nij,nj->ni", np.linalg.pinv(matrix, rcond=1e-10), gap).clip(-_ALONG, _ALONG)
    near = np.abs(moved - z).max(axis=1) < 10.0 * _ALONG
    return np.asarray(near & (np.abs(gap).max(axis=1) < _MEETS))


def family(equations: Equations, z: Array) -> str:
    """What moves freely in a member of a continuous family, and which pins lie on each other there."""
    loops = equations.loops
    values, rows = singular_values(equations, z[None])
    moving = _named(loops, sorted(_movers(np.abs(rows[0, values[0] <= SINGULAR * values[0, 0]]).max(axis=0))))
    free = f"{_and(moving)} can move freely with the driver held"
    pins = [j for j in loops.linkage.joints if j.kind == PIN and {j.first, j.second} & set(moving)]
    at, ends = _pins(equations, z), {j.name: {(j.first, j.first_at[1:]), (j.second, j.second_at[1:])} for j in pins}
    for a, b in combinations(ends, 2):
        if abs(at[a] - at[b]) < _SMALL * loops.unit and not ends[a] & ends[b]:
            return f"{free} while the pins {a} and {b} lie on each other"
    return free


def met(equations: Equations, z: Array, low: float, high: float, rate: Array | None = None) -> Fault | None:
    """What is met at a singular position near z, where the driver stands from low to high (scaled); None if there is none.

    rate: how the assembly moves that is followed, where one is.
    """
    found = _change_point(equations, z)
    if found is not None and low <= found[0] <= high:
        return _branch(equations, found, rate)
    found = _fold(equations, z)
    return None if found is None or not low <= found[0] <= high else _lock(equations, found)


def _fold(equations: Equations, z: Array) -> Array | None:
    """The position near z where F = 0 and J v = 0 with |v| = 1, by Newton on all of z and v; None if there is none near."""
    size, rows = equations.loops.unknowns, equations.loops.equations
    v = singular_values(equations, z[None])[1][0, -1]
    guess = z.copy()
    for _ in range(_ITERATIONS):
        residual, jacobian, hessians = _expanded(equations, guess)
        matrix = np.zeros((2 * rows + 1, 2 * size + 1))
        matrix[:rows, : size + 1] = jacobian
        matrix[rows : 2 * rows, : size + 1] = np.einsum("kij,j->ki", hessians[:, :, 1:], v)
        matrix[rows : 2 * rows, size + 1 :] = jacobian[:, 1:]
        matrix[-1, size + 1 :] = v
        right = np.concatenate((residual, jacobian[:, 1:] @ v, [0.5 * (v @ v - 1.0)]))
        move = -np.linalg.lstsq(matrix, right, rcond=1e-14)[0]
        guess, v = guess + move[: size + 1], v + move[size + 1 :]
        if not np.isfinite(guess).all() or np.abs(guess - z).max() > _FAR:
            return None
        if np.abs(move).max() < _SETTLED:
            return np.asarray(guess) if np.abs(right[:-1]).max() < _TOUCHES else None
    return None


def _change_point(equations: Equations, z: Array) -> Array | None:
    """The position near z where two assemblies cross: F = 0 and w J = 0 by all variables, w · w0 = 1; None if none is near.

    F + mu w0 = 0 makes Newton's system on (z, w, mu) regular where that for a fold is not. A linkage with more equations
    than unknowns has w J = 0 everywhere.
    """
    size = equations.loops.unknowns
    if equations.loops.equations != size:
        return None
    first = np.linalg.svd(_expanded(equations, z)[1])[0][:, -1]
    guess, w, mu = z.copy(), first, 0.0
    for _ in range(_ITERATIONS):
        residual, jacobian, hessians = _expanded(equations, guess)
        matrix = np.zeros((2 * size + 2, 2 * size + 2))
        matrix[:size, : size + 1], matrix[:size, -1] = jacobian, first
        matrix[size:-1, : size + 1] = np.einsum("k,kij->ij", w, hessians)
        matrix[size:-1, size + 1 : -1] = jacobian.T
        matrix[-1, size + 1 : -1] = first
        right = np.concatenate((residual + mu * first, w @ jacobian, [w @ first - 1.0]))
        move = -np.linalg.lstsq(matrix, right, rcond=1e-10)[0]
        guess, w, mu = guess + move[: size + 1], w + move[size + 1 : -1], mu + float(move[-1])
        if not np.isfinite(guess).all() or np.abs(guess - z).max() > _FAR:
            return None
        if np.abs(move).max() < _SETTLED:
            return np.asarray(guess) if max(abs(mu), float(np.abs(right).max())) < _TOUCHES else None
    return None


def _expanded(equations: Equations, z: Array) -> tuple[Array, Array, Array]:
    """Residual, Jacobian and second derivatives (equations, variables, variables) at one position, these by polarisation."""
    table, size = z[None], z.size
    units = np.eye(size)
    pairs = np.concatenate([(units[:, None] + sign * units).reshape(-1, size) for sign in (1.0, -1.0)])
    repeated = np.broadcast_to(z, pairs.shape)
    bent = equations.bending(repeated, equations.bases(repeated), pairs).reshape(2, size, size, -1)
    bases = equations.bases(table)
    hessians = (0.25 * (bent[0] - bent[1])).transpose(2, 0, 1)
    return equations.residual(table, bases)[0], equations.jacobian(table, bases)[0], np.asarray(hessians)


def _lock(equations: Equations, found: Array) -> Fault:
    """What meets at a lock; or what a linkage with joints to spare is held by to the second order only."""
    loops, jacobian = equations.loops, _expanded(equations, found)[1]
    left, _, right = np.linalg.svd(jacobian[:, 1:])
    where, moving = _at(equations, found), described(loops, found, _movers(right[-1]))
    if np.abs(left[:, loops.unknowns - 1 :].T @ jacobian[:, 0]).max() > _SMALL * np.abs(jacobian[:, 0]).max():
        advice = f"two assemblies meet there, {moving} may go either way"
        return Fault(loops.linkage.path, f"a linkage that locks with the {where}", _ONE, advice)
    if loops.equations > loops.unknowns:
        what = f"a linkage that its joints hold too loosely (a change point) with the {where}"
        advice = (
            f"in line as they are there, even those to spare let {moving} give way: put one out of line, or add a gear pair"
        )
        return Fault(loops.linkage.path, what, _ONE, advice)
    what = f"a linkage that branches (a change point) with the {where}"
    return Fault(loops.linkage.path, what, _ONE, f"several assemblies meet there, {moving} may go either way; {_LEAVE}")


def _branch(equations: Equations, found: Array, rate: Array | None) -> Fault:
    """Which assemblies cross at a change point, how each goes on, and what carries a linkage through it."""
    loops, path = equations.loops, equations.loops.linkage.path
    ways = _ways(equations, found)
    bars = change_point_four_bar(loops.linkage, _pins(equations, found))
    kind, names = "a linkage", ["", ""]
    mend = f"hold it to one of them by another joint or a coupling, change a length, or {_LEAVE}"
    if bars is not None:
        kind = bars.kind
    if bars is not None and kind == PARALLELOGRAM:
        mend = f"a gear pair, or a third crank as long as the two, keeps it a parallelogram; or {_LEAVE}"
        called = {True: PARALLELOGRAM, False: f"an anti{PARALLELOGRAM.removeprefix('a ')}"}
        kind = called[rate is None or not ways or _translates(loops, rate, bars.bodies)]
        names = [f"{called[_translates(loops, way, bars.bodies)]}: " for way in ways]
    ring = "" if bars is None else f" ({', '.join(sorted(bars.bodies))})"
    what = f"{kind}{ring} that branches (a change point) with the {_at(equations, found)}"
    if not ways:
        free = described(loops, found, _movers(singular_values(equations, found[None])[1][0, -1]))
        return Fault(path, what, _ONE, f"several assemblies meet there, {free} may go either way; {mend}")
    first, second = sorted(name + _onward(loops, way, ways) for name, way in zip(names, ways, strict=True))
    return Fault(path, what, _ONE, f"two assemblies meet there ({first}; or {second}); {mend}")


def _ways(equations: Equations, z: Array) -> list[Array]:
    """Directions t in which two assemblies leave where they cross, J t = 0 and w t H t = 0; none where more of them meet."""
    _, jacobian, hessians = _expanded(equations, z)
    left, values, right = np.linalg.svd(jacobian)
    if values[-2:-1].min(initial=values[0]) <= _SMALL * values[0]:
        return []
    kernel = right[len(values) - 1 :]
    (low, high), axes = np.linalg.eigh(kernel @ np.einsum("k,kij->ij", left[:, -1], hessians) @ kernel.T)
    if not low < 0.0 < high:
        return []
    shares = np.sqrt([high, -low])  # low a² + high b² = 0
    return [np.asarray((axes @ (shares * [1.0, sign])) @ kernel) for sign in (1.0, -1.0)]


def _translates(loops: Loops, way: Array, bodies: tuple[str, ...]) -> bool:
    """Whether opposite bars of a ring of four turn alike along a motion of the variables."""
    rates = [float(loops.angles[loops.linkage.names.index(body)].weights @ way) for body in bodies]
    return max(abs(rates[0] - rates[2]), abs(rates[1] - rates[3])) < _SMALL * max(map(abs, rates))


def _onward(loops: Loops, way: Array, ways: list[Array]) -> str:
    """How one of two motions goes on: the rates of what they move unlike, or what moves while the driver rests."""
    paces = [one / one[0] if abs(one[0]) > _SMALL * np.abs(one).max() else one for one in ways]
    unlike = [k for k in range(1, way.size) if abs(paces[0][k] - paces[1][k]) > _SMALL]
    if abs(way[0]) <= _SMALL * np.abs(way).max():
        moving = [k for k in unlike if abs(way[k]) > _SMALL]
        return f"{_and(_named(loops, moving))} can move freely while the driver rests"
    parts = []
    for k in unlike[:_NAMED]:
        kind, _, what = loops.names[k].partition(" of ")
        turns = loops.angles[loops.linkage.names.index(what)].weights if kind == "angle" else np.eye(way.size)[k]
        size = (1.0 if kind == "angle" else loops.unit) / (loops.unit if loops.linkage.sliding else 1.0)
        rate = round(float(turns @ way / way[0]) * size, 9) + 0.0
        parts.append(f"{what} {rate:.4g} {'rad' if kind == 'angle' else 'm'}")
    return f"{', '.join(parts)} per {'m' if loops.linkage.sliding else 'rad'} of the driver"


def _movers(free: Array) -> list[int]:
    """Variables, the greatest movers first, that take part in a motion of the unknowns."""
    size = np.abs(free)
    return [int(k) + 1 for k in np.argsort(-size, kind="stable") if size[k] > _TAKES_PART * size.max()]


def _named(loops: Loops, variables: Sequence[int]) -> list[str]:
    return [loops.names[k].partition(" of ")[2] for k in variables]


def _and(names: Sequence[str]) -> str:
    few = [*names[:_NAMED], f"{len(names) - _NAMED} more"] if len(names) > _NAMED else list(names)
    return " and ".join(filter(None, [", ".join(few[:-1]), few[-1]]))


def _at(equations: Equations, z: Array) -> str:
    return f"driver {equations.loops.linkage.driver} at {place(equations, float(z[0]))}"


def place(equations: Equations, driver: float) -> str:
    """Where the driver stands, in its own unit."""
    linkage = equations.loops.linkage
    if linkage.sliding:
        return f"{round(driver, 12) * equations.loops.unit + 0.0:.9g} m"
    return f"{round(degrees(driver), 9) + 0.0:.9g} deg"


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


def _pins(equations: Equations, z: Array) -> dict[str, complex]:
    """Where every pin stands, m."""
    unit, pins = equations.loops.unit, [joint for joint in equations.loops.linkage.joints if joint.kind == PIN]
    return {pin.name: unit * complex(places(equations, z[None], pin.second, pin.second_at)[0]) for pin in pins}


def places(equations: Equations, z: Array, body: str, at: Point) -> NDArray[np.complex128]:
    """Places of a body's point (units) at positions z, as complex numbers."""
    loops = equations.loops
    k = loops.linkage.names.index(body)
    form = loops.angles[k]
    origin = equations.bases(z).whole @ loops.origins[k]
    return np.asarray(origin + complex(at.x, at.y) / loops.unit * np.exp(1j * (z @ form.weights + form.constant)))
