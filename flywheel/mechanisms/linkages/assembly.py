"""Positions with the driver at one coordinate: degrees of freedom, locks and change points, choice of an assembly.

Degrees of freedom: the count of Gruebler (in space: Kutzbach), checked against the rank of the Jacobian at the position.

Where the Jacobian by the unknowns is singular, the driver does not determine the position. At a lock (a fold) the driver
reverses; at a change point two assemblies cross; a continuous family has one at every position of the driver, because
links have collapsed onto each other.

The loop equations have several solutions; guesses and sides choose one, never the iteration that
happens to converge. The search therefore finds all of them, from many starting points at once; if several fit, they are
refused.

Sources: for the count, K. J. Waldron, G. L. Kinzel, S. K. Agrawal, Kinematics, Dynamics and Design of Machinery, Wiley 2016,
chapter 1; for folds and crossings of solutions, W. J. F. Govaerts, Numerical Methods for Bifurcations of Dynamical
Equilibria, SIAM 2000, chapters 3 and 4.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import combinations
from math import degrees, pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.mechanisms.linkages.equations import Equations, Loops, solved
from flywheel.numerics.faults import Fault, SceneError
from flywheel.scene.linkage import FREEDOMS, PIN, SLIDE, SLOT, Linkage, Point

Array = NDArray[np.float64]

_ITERATIONS = 40
_NAMED = 6
_ONE = "one assembly over the whole range of the driver"
LEAVE = "leave this position out of `start` and of the driver's range"


# -- degrees of freedom ------------------------------------------------------------------------------------------------

_RANK = 1e-9  # of the greatest singular value


class Mobility(NamedTuple):
    """Freedom of a linkage at a position.

    gruebler: 3 (bodies) - constraints of joints and couplings; freedom: variables less the rank of their Jacobian;
    redundant: redundant constraints, as texts.
    """

    gruebler: int
    freedom: int
    redundant: tuple[str, ...]


def gruebler(linkage: Linkage) -> int:
    """Gruebler's degrees of freedom of a plane linkage: 3 n - sum(3 - f) - couplings, n moving bodies, f freedoms a joint.

    A pin or slide takes 2, a pin in a slot 1, a rigid joint 3, a gear pair, rolling pair or cam 1.

    >>> from flywheel.scene.linkage import Joint, Link, Linkage, Point
    >>> o = Point("o")
    >>> links = tuple(Link(name) for name in ("crank", "rod", "slider"))
    >>> pairs = (("frame", "crank"), ("crank", "rod"), ("rod", "slider"))
    >>> joints = tuple(Joint(f"{a}-{b}", "pin", a, b, o, o) for a, b in pairs)
    >>> slide = Joint("guide", "slide", "frame", "slider", o, o)
    >>> gruebler(Linkage(Link("frame"), links, (*joints, slide), "frame-crank"))
    1
    """
    joints = [FREEDOMS[joint.kind] for joint in linkage.joints]
    return kutzbach(1 + len(linkage.links), [*joints, *[2] * len(linkage.couplings)], order=3)


_JOINTS = {"R": 1, "P": 1, "H": 1, "C": 2, "U": 2, "S": 3, "E": 3}
_IN_PLANE = ("R", "P")
_MOST_BODIES = 1_000_000


def kutzbach(bodies: int, joints: Iterable[str | int], *, order: int = 6) -> int:
    """Kutzbach's degrees of freedom of any mechanism: d (n - 1) - sum(d - f).

    The count subtracts every constraint once. It is the true number if the constraints are independent, and otherwise less:
    Bennett's linkage and a plane four-bar counted in space have -2, and move. So it is a lower bound of the freedom of
    small motions. It includes freedoms that move no output, such as the turning of a rod between two spherical joints.

    Args:
        bodies: n, the number of bodies with the frame.
        joints: of each its letter or its number of freedoms f: R revolute, P prismatic, H helical 1; C cylindrical,
            U universal 2; S spherical, E planar 3. A joint of k bodies counts k - 1 times. In a plane: R and P.
        order: d, the freedoms of a free body: 6 in space, 3 in a plane or about a fixed point.

    Raises:
        SceneError: if `bodies` is below 1, `order` neither 6 nor 3, or a joint is unknown or has d or more freedoms.

    Source: K. J. Waldron, G. L. Kinzel, S. K. Agrawal, Kinematics, Dynamics and Design of Machinery, Wiley 2016, chapter 1.

    >>> kutzbach(4, "RSSR"), kutzbach(4, "RSSP"), kutzbach(14, 6 * "UPS"), kutzbach(4, "RRRR"), kutzbach(4, "RRRR", order=3)
    (2, 2, 6, -2, 1)

    """
    letters = _JOINTS if order == 6 else {name: _JOINTS[name] for name in _IN_PLANE}
    types = [letters.get(joint, joint) if isinstance(joint, str) else joint for joint in joints]
    faults = []
    if bodies not in range(1, _MOST_BODIES):
        faults.append(Fault("bodies", str(bodies), "a whole number, 1 or above: the frame counts"))
    if order not in (3, 6):
        faults.append(Fault("order", str(order), "6 in space, or 3 in a plane or about a fixed point"))
    else:
        expected = f"one of {', '.join(letters)}, or its number of freedoms from 0 to {order - 1}"
        faults += [Fault(f"joints[{k}]", str(f), expected) for k, f in enumerate(types) if f not in range(order)]
    if faults:
        raise SceneError(faults)
    return order * (bodies - 1) - sum(order - int(f) for f in types)


def mobility(loops: Loops, jacobian: Array) -> Mobility:
    """Mobility where the equations have this Jacobian, (equations, variables)."""
    rows = _independent(jacobian)

    def source(row: int) -> str:
        """The loop or the coupling that an equation stands for."""
        coupling = row - 2 * len(loops.closures)
        if coupling >= 0:
            couplings = [f"coupling {pair.name}" for pair in loops.linkage.couplings]
            return [*couplings, *(f"driver {name}" for name, _ in loops.linkage.drivers)][coupling]
        return f"loop {' - '.join(loops.paths[row // 2])}"

    redundant = [f"the rotation of {joint}, which other joints fix already" for joint in loops.doubled]
    repeated: dict[str, None] = {}
    for row in sorted(set(range(len(jacobian))) - set(rows)):
        shares = np.linalg.lstsq(jacobian[list(rows)].T, jacobian[row], rcond=None)[0]
        first, *others = dict.fromkeys(map(source, [row, *(rows[k] for k in np.flatnonzero(np.abs(shares) > 1e-6))]))
        repeated[f"{first} repeats {' and '.join(others) or 'the constraint that keeps its bodies parallel'}"] = None
    return Mobility(gruebler(loops.linkage), jacobian.shape[1] - len(rows), (*redundant, *repeated))


def _independent(jacobian: Array) -> tuple[int, ...]:
    """Rows that span a matrix: those with the greatest rest, one after another."""
    rest, rows = jacobian.copy(), []
    scale = float(np.sqrt((rest**2).sum(axis=1)).max(initial=0.0))
    for _ in range(min(jacobian.shape)):
        size = np.sqrt((rest**2).sum(axis=1))
        row = int(np.argmax(size))
        if size[row] <= _RANK * scale:
            break
        rows.append(row)
        along = rest[row] / size[row]
        rest = rest - np.outer(rest @ along, along)
    return tuple(sorted(rows))


def freedom_faults(loops: Loops, jacobian: Array) -> list[Fault]:
    """A fault if the driver's coordinate does not determine the position, or cannot change."""
    freedom = mobility(loops, jacobian)
    path, expected = f"{loops.linkage.path}.joints", "1 degree of freedom"
    rank = len(_independent(jacobian[:, 1:]))
    if rank < loops.unknowns:
        free = np.abs(np.linalg.svd(jacobian[:, 1:])[2][rank:]).max(axis=0)
        moving = [loops.names[k + 1] for k in np.argsort(-free) if free[k] > 0.1 * free.max()]
        few = ", ".join(moving[:4]) + (" and more" if len(moving) > 4 else "")
        what = f"{freedom.freedom} degrees of freedom (Gruebler {freedom.gruebler}): with the driver held, {few} may move"
        return [Fault(path, what, expected, "add a joint or a coupling, or take a body away")]
    if freedom.freedom == 0:
        what = f"0 degrees of freedom (Gruebler {freedom.gruebler}): the driver {loops.linkage.driver} cannot move"
        advice = "take a joint away" + (f": {'; '.join(freedom.redundant)}" if freedom.redundant else "")
        return [Fault(path, what, expected, advice)]
    return []


# -- singular positions ------------------------------------------------------------------------------------------------

_SINGULAR = 1e-5  # of the greatest singular value: nearer to a lock, the position itself is found too badly
_FAR = 0.3  # rad, or units: farther from where it began, no iteration is followed
_SETTLED = 1e-11
_TOUCHES = 1e-11  # a singular position closes within this; one that is only nearly reached does not
_ALONG = 0.05  # rad, or units: distance along a null vector at which another member of a family is sought
_MEETS = 1e-8  # residual there: that of a double root is some 1e-3
_SMALL = 1e-6  # of the largest rate, length or singular value: nothing
_TAKES_PART = 0.05
_FLAT = 1e-7  # of the longest bar: tolerance of bars in line, or of equal length
_PARALLELOGRAM, _KITE = "a parallelogram", "a kite"
_CHANGE_POINT = "a four-bar whose shortest and longest bars are together as long as the others"


def _singular_values(equations: Equations, z: Array) -> tuple[Array, Array]:
    """Singular values of the Jacobian by the unknowns, and its right vectors, at positions z (n, variables)."""
    jacobian = equations.jacobian(z, equations.bases(z))[:, :, 1:]
    _, values, rows = np.linalg.svd(jacobian)
    full = np.zeros((len(z), jacobian.shape[2]))
    full[:, : values.shape[1]] = values
    return full, rows


def _in_families(equations: Equations, z: Array) -> NDArray[np.bool_]:
    """Mask of the assemblies (n, variables) that are members of a continuous family.

    Where the Jacobian has a null vector v, the plane v · (x - z) = 0.05 holds another solution close by if the assembly is
    one of a family; at a lock or a change point the equations have a residual there of the order of that distance squared.
    """
    values, rows = _singular_values(equations, z)
    free = values <= _SINGULAR * values[:, :1]
    member = np.zeros(len(z), dtype=bool)
    for k in range(z.shape[1] - 1):
        singular = np.flatnonzero(free[:, k] & ~member)
        if not singular.size:
            continue
        here, v = z[singular], rows[singular, k]
        moved = here.copy()
        moved[:, 1:] += _ALONG * v
        for _ in range(_ITERATIONS):
            bases = equations.bases(moved)
            off = ((moved - here)[:, 1:] * v).sum(axis=1) - _ALONG
            gap = np.concatenate((equations.residual(moved, bases), off[:, None]), axis=1)
            matrix = np.concatenate((equations.jacobian(moved, bases)[:, :, 1:], v[:, None, :]), axis=1)
            moved[:, 1:] -= np.einsum("nij,nj->ni", np.linalg.pinv(matrix, rcond=1e-10), gap).clip(-_ALONG, _ALONG)
        near = np.abs(moved - here).max(axis=1) < 10.0 * _ALONG
        member[singular] = near & (np.abs(gap).max(axis=1) < _MEETS)
    return member


def _family(equations: Equations, z: Array) -> str:
    """Names the bodies free to move in a member of a continuous family, and the pins that coincide there."""
    loops = equations.loops
    values, rows = _singular_values(equations, z[None])
    moving = _named(loops, sorted(_movers(np.abs(rows[0, values[0] <= _SINGULAR * values[0, 0]]).max(axis=0))))
    free = f"{_and(moving)} can move freely with the driver held"
    pins = [j for j in loops.linkage.joints if j.kind == PIN and {j.first, j.second} & set(moving)]
    at, ends = _pins(equations, z), {j.name: {(j.first, j.first_at[1:]), (j.second, j.second_at[1:])} for j in pins}
    for a, b in combinations(ends, 2):
        if abs(at[a] - at[b]) < _SMALL * loops.unit and not ends[a] & ends[b]:
            return f"{free} while the pins {a} and {b} lie on each other"
    return free


def singular_fault(equations: Equations, z: Array, low: float, high: float, rate: Array | None = None) -> Fault | None:
    """The lock or change point near z, where the driver stands from low to high (scaled); None if there is none.

    rate: the motion of the followed assembly, if there is one.
    """
    scale = equations.loops.unit if equations.loops.linkage.sliding else 1.0
    point = _change_point(equations, z)
    if point is not None and low <= point[0] <= high:
        return _branch(equations, point, rate)._replace(locks=(float(point[0]) * scale,))
    point = _fold(equations, z)
    if point is None or not low <= point[0] <= high:
        return None
    return _lock(equations, point)._replace(locks=(float(point[0]) * scale,))


def _fold(equations: Equations, z: Array) -> Array | None:
    """The position near z where F = 0 and J v = 0 with |v| = 1, by Newton on all of z and v; None if there is none near."""
    size, rows = equations.loops.unknowns, equations.loops.equations

    def system(guess: Array, v: Array) -> tuple[Array, Array]:
        residual, jacobian, hessians = _expanded(equations, guess)
        matrix = np.zeros((2 * rows + 1, 2 * size + 1))
        matrix[:rows, : size + 1] = jacobian
        matrix[rows : 2 * rows, : size + 1] = np.einsum("kij,j->ki", hessians[:, :, 1:], v)
        matrix[rows : 2 * rows, size + 1 :] = jacobian[:, 1:]
        matrix[-1, size + 1 :] = v
        return matrix, np.concatenate((residual, jacobian[:, 1:] @ v, [0.5 * (v @ v - 1.0)]))

    root = _newton(system, z, _singular_values(equations, z[None])[1][0, -1], 1e-14)
    return root[0] if root is not None and np.abs(root[2][:-1]).max() < _TOUCHES else None


def _change_point(equations: Equations, z: Array) -> Array | None:
    """The position near z where two assemblies cross: F = 0 and w J = 0 by all variables, w · w0 = 1; None if none is near.

    F + mu w0 = 0 makes Newton's system on (z, w, mu) regular where that for a fold is not. A linkage with more equations
    than unknowns has w J = 0 everywhere.
    """
    size = equations.loops.unknowns
    if equations.loops.equations != size:
        return None
    first = np.linalg.svd(_expanded(equations, z)[1])[0][:, -1]

    def system(guess: Array, rest: Array) -> tuple[Array, Array]:
        w, mu = rest[:-1], rest[-1]
        residual, jacobian, hessians = _expanded(equations, guess)
        matrix = np.zeros((2 * size + 2, 2 * size + 2))
        matrix[:size, : size + 1], matrix[:size, -1] = jacobian, first
        matrix[size:-1, : size + 1] = np.einsum("k,kij->ij", w, hessians)
        matrix[size:-1, size + 1 : -1] = jacobian.T
        matrix[-1, size + 1 : -1] = first
        return matrix, np.concatenate((residual + mu * first, w @ jacobian, [w @ first - 1.0]))

    root = _newton(system, z, np.append(first, 0.0), 1e-10)
    return root[0] if root is not None and max(abs(root[1][-1]), np.abs(root[2]).max()) < _TOUCHES else None


def _newton(
    system: Callable[[Array, Array], tuple[Array, Array]], z: Array, rest: Array, rcond: float
) -> tuple[Array, Array, Array] | None:
    """Root (z, rest) of a system of matrix and right side near z, and its last right side; None if there is none near."""
    guess, size = np.concatenate((z, rest)), z.size
    for _ in range(_ITERATIONS):
        matrix, right = system(guess[:size], guess[size:])
        move = -np.linalg.lstsq(matrix, right, rcond=rcond)[0]
        guess = guess + move
        if not np.isfinite(guess[:size]).all() or np.abs(guess[:size] - z).max() > _FAR:
            return None
        if np.abs(move).max() < _SETTLED:
            return guess[:size], guess[size:], right
    return None


def _expanded(equations: Equations, z: Array) -> tuple[Array, Array, Array]:
    """Residual, Jacobian and second derivatives (equations, variables, variables) at one position, these by polarisation."""
    table, size = z[None], z.size
    units = np.eye(size)
    pairs = np.concatenate([(units[:, None] + sign * units).reshape(-1, size) for sign in (1.0, -1.0)])
    bent = equations.bending(equations.bases(np.broadcast_to(z, pairs.shape)), pairs).reshape(2, size, size, -1)
    bases = equations.bases(table)
    hessians = (0.25 * (bent[0] - bent[1])).transpose(2, 0, 1)
    return equations.residual(table, bases)[0], equations.jacobian(table, bases)[0], np.asarray(hessians)


def _lock(equations: Equations, z: Array) -> Fault:
    """Fault of a lock: the assemblies that meet there, or redundant joints that hold the linkage to second order only."""
    loops, jacobian = equations.loops, _expanded(equations, z)[1]
    path = loops.linkage.path
    left, _, right = np.linalg.svd(jacobian[:, 1:])
    where = standing(equations, float(z[0]))
    moving = _described(loops, z, _movers(right[-1]))
    if np.abs(left[:, loops.unknowns - 1 :].T @ jacobian[:, 0]).max() > _SMALL * np.abs(jacobian[:, 0]).max():
        advice = f"two assemblies meet there, {moving} may go either way"
        return Fault(path, f"a linkage that locks with the {where}", _ONE, advice)
    if loops.equations > loops.unknowns:
        what = f"a linkage that its joints do not determine (a change point) with the {where}"
        advice = f"even with its redundant joints {moving} give way: move one out of line, or add a gear pair"
        return Fault(path, what, _ONE, f"in line as they are there, {advice}")
    what = f"a linkage that branches (a change point) with the {where}"
    return Fault(path, what, _ONE, f"several assemblies meet there, {moving} may go either way; {LEAVE}")


def _branch(equations: Equations, z: Array, rate: Array | None) -> Fault:
    """Fault of a change point: the assemblies that cross, the motion along each, and remedies."""
    loops = equations.loops
    ways = _ways(equations, z)
    kind, bodies = _change_point_four_bar(loops.linkage, _pins(equations, z)) or ("a linkage", ())
    names = ["", ""]
    mend = f"fix one of them by another joint or a coupling, change a length, or {LEAVE}"
    if kind == _PARALLELOGRAM:
        forms = [loops.angles[loops.linkage.names.index(body)] for body in bodies]

        def called(way: Array) -> str:
            """Names the four-bar: a parallelogram if opposite bars turn alike along a motion of the variables."""
            a, b, c, d = (float(form.weights @ way) for form in forms)
            alike = max(abs(a - c), abs(b - d)) < _SMALL * max(map(abs, (a, b, c, d)))
            return _PARALLELOGRAM if alike else f"an anti{_PARALLELOGRAM.removeprefix('a ')}"

        mend = f"a gear pair, or a third crank as long as the two, keeps it a parallelogram; or {LEAVE}"
        kind = _PARALLELOGRAM if rate is None or not ways else called(rate)
        names = [f"{called(way)}: " for way in ways]
    ring = f" ({', '.join(sorted(bodies))})" if bodies else ""
    where = standing(equations, float(z[0]))
    what = f"{kind}{ring} that branches (a change point) with the {where}"
    if not ways:
        free = _described(loops, z, _movers(_singular_values(equations, z[None])[1][0, -1]))
        advice = f"several assemblies meet there, {free} may go either way"
    else:
        first, second = sorted(name + _onward(loops, way, ways) for name, way in zip(names, ways, strict=True))
        advice = f"two assemblies meet there ({first}; or {second})"
    return Fault(loops.linkage.path, what, _ONE, f"{advice}; {mend}")


def _change_point_four_bar(linkage: Linkage, pins: Mapping[str, complex]) -> tuple[str, tuple[str, ...]] | None:
    """Name of four bars that lie in line in a ring of pins, as Grashof's s + l = p + q allows, and their bodies.

    pins: position of each pin by its name, m.
    """
    ends: dict[str, list[tuple[str, str]]] = {}
    for joint in linkage.joints:
        if joint.name in pins:
            ends.setdefault(joint.first, []).append((joint.second, joint.name))
            ends.setdefault(joint.second, []).append((joint.first, joint.name))
    rings = (
        ((one, two, three, four), (a, b, c, next(d for body, d in ends[four] if body == one)))
        for one in ends
        for two, a in ends[one]
        for three, b in ends[two]
        for four, c in ends[three]
        if len({one, two, three, four}) == 4 and any(body == one for body, _ in ends[four])
    )
    for bodies, names in rings:  # pin k joins body k to the next
        corners = np.array([pins[name] for name in names])
        bars = np.roll(corners, 1) - corners  # of the bodies in their order
        sides, line = np.abs(bars), bars[np.argmax(np.abs(bars))]
        longest, ordered = float(sides.max()), np.sort(sides)
        flat = np.abs((bars * np.conj(line)).imag).max() <= _FLAT * longest**2
        if not flat or ordered[0] <= _FLAT * longest or abs(ordered @ [1.0, -1.0, -1.0, 1.0]) > _FLAT * longest:
            continue
        alike = np.abs(sides[:, None] - sides) <= _FLAT * longest
        if alike[0, 2] and alike[1, 3]:
            return _PARALLELOGRAM, bodies
        kite = (alike[0, 1] and alike[2, 3]) or (alike[0, 3] and alike[1, 2])
        return _KITE if kite else _CHANGE_POINT, bodies
    return None


def _ways(equations: Equations, z: Array) -> list[Array]:
    """Directions t in which two assemblies leave where they cross, J t = 0 and w t H t = 0; none if more of them meet."""
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


def _onward(loops: Loops, way: Array, ways: list[Array]) -> str:
    """Describes one of two motions: the rates in which they differ, or the bodies that move while the driver rests."""
    one, other = (way / way[0] if abs(way[0]) > _SMALL * np.abs(way).max() else way for way in ways)
    unlike = [k for k in range(1, way.size) if abs(one[k] - other[k]) > _SMALL]
    if abs(way[0]) <= _SMALL * np.abs(way).max():
        return f"{_and(_named(loops, [k for k in unlike if abs(way[k]) > _SMALL]))} can move freely while the driver rests"
    parts = []
    for k in unlike[:_NAMED]:
        kind, _, what = loops.names[k].partition(" of ")
        turns = loops.angles[loops.linkage.names.index(what)].weights if kind == "angle" else np.eye(way.size)[k]
        size = (1.0 if kind == "angle" else loops.unit) / (
            loops.unit if loops.linkage.sliding and loops.way is None else 1.0
        )
        rate = round(float(turns @ way / way[0]) * size, 9) + 0.0
        parts.append(f"{what} {rate:.4g} {'rad' if kind == 'angle' else 'm'}")
    if loops.way is not None:
        return f"{', '.join(parts)} over the range of the drivers"
    return f"{', '.join(parts)} per {'m' if loops.linkage.sliding else 'rad'} of the driver"


# -- positions in words ------------------------------------------------------------------------------------------------


def _movers(free: Array) -> list[int]:
    """Variables, the greatest movers first, that take part in a motion of the unknowns."""
    size = np.abs(free)
    return [int(k) + 1 for k in np.argsort(-size, kind="stable") if size[k] > _TAKES_PART * size.max()]


def _named(loops: Loops, variables: Sequence[int]) -> list[str]:
    return [loops.names[k].partition(" of ")[2] for k in variables]


def _and(names: Sequence[str]) -> str:
    few = [*names[:_NAMED], f"{len(names) - _NAMED} more"] if len(names) > _NAMED else list(names)
    return " and ".join(filter(None, [", ".join(few[:-1]), few[-1]]))


def place(equations: Equations, driver: float) -> str:
    """Position of the driver, in its own unit."""
    return _place(equations.loops, driver, equations.loops.linkage.sliding)


def _place(loops: Loops, driver: float, sliding: bool) -> str:
    if sliding:
        return f"{round(driver, 12) * loops.unit + 0.0:.9g} m"
    return f"{round(degrees(driver), 9) + 0.0:.9g} deg"


def standing(equations: Equations, driver: float) -> str:
    """The driver and its position; of several all, by the share of their travel.

    >>> from flywheel.mechanisms.linkages.equations import loops
    >>> from flywheel.scene.linkage import Joint, Link
    >>> o, pivot = Point("o"), Joint("pivot", "pin", "frame", "crank", Point("o"), Point("o"))
    >>> standing(Equations(loops(Linkage(Link("frame", (o,)), (Link("crank", (o,)),), (pivot,), "pivot"))), 0.5)
    'driver pivot at 28.6478898 deg'
    """
    loops = equations.loops
    if loops.way is None:
        return f"driver {loops.linkage.driver} at {place(equations, driver)}"
    low, high = loops.way
    names = [name for name, _ in loops.linkage.drivers]
    sliding = [loops.linkage.joint(name).kind == SLIDE for name in names]
    stands = zip(names, (low + driver * (high - low)).tolist(), sliding, strict=True)
    return f"drivers {_and([f'{name} at {_place(loops, at, slides)}' for name, at, slides in stands])}"


def _described(loops: Loops, z: Array, variables: Sequence[int] = ()) -> str:
    """An assembly in words: angles of the bodies in degrees, displacements in m; only some of the variables if given.

    Bodies that keep a common angle are named once, by the first of them.
    """
    parts = []
    for k in variables or range(1, len(loops.names)):
        kind, _, what = loops.names[k].partition(" of ")
        if kind == "angle":
            form = loops.angles[loops.linkage.names.index(what)]
            parts.append(f"{what} {round(degrees(float(form.at(z))), 9) % 360 % 360:.4g} deg")
        else:
            parts.append(f"{what} {round(z[k], 12) * loops.unit + 0.0:.4g} m")
    return ", ".join(parts[:_NAMED]) + (f" and {len(parts) - _NAMED} more" if len(parts) > _NAMED else "")


def _pins(equations: Equations, z: Array) -> dict[str, complex]:
    """Position of every pin, m."""
    unit, pins = equations.loops.unit, [joint for joint in equations.loops.linkage.joints if joint.kind == PIN]
    return {pin.name: unit * complex(_places(equations, z[None], pin.second, pin.second_at)[0]) for pin in pins}


def _places(equations: Equations, z: Array, body: str, at: Point) -> NDArray[np.complex128]:
    """Places of a body's point (units) at positions z, as complex numbers."""
    loops = equations.loops
    k = loops.linkage.names.index(body)
    origin = equations.bases(z).whole @ loops.origins[k]
    return np.asarray(origin + complex(at.x, at.y) / loops.unit * np.exp(1j * loops.angles[k].at(z)))


# -- assemblies --------------------------------------------------------------------------------------------------------

_STARTS = 96  # for every unknown
_MOST_STARTS = 3000
_STRIDE = 1.0  # rad, or units: the longest Newton step from a guess
_SAME_ASSEMBLY = 1e-6
_CLOSED = 1e-11
_CLEARER = 0.7  # the nearest assembly must be nearer to the guess than this share of the next one's distance
_FITS = 0.3
_BLURRED = 1e-3  # rad, or units: double roots nearer than this are one
_ROUGH = 0.1  # rad, or units: guesses are never better than this
_LISTED = 8
_LONGEST = 240  # characters of all that are listed: a fault is a single line
_TURNS = 4.0  # to each side, of angles that a coupling ties: each turn may be another assembly
_TRIED = 200
_REFINED = 8


def assembled(equations: Equations) -> Array:
    """The variables z of the chosen assembly, shape (variables,).

    Sides and guesses choose first, among the isolated assemblies; their choice is then checked. Links that
    collapse onto each other also have a continuous family of assemblies, in which some bodies turn freely: none of
    those is chosen, unless the guesses select it.

    Raises:
        SceneError: if it cannot be assembled, guesses and sides leave more than one assembly, or the one that they
            choose locks, branches or is one of a continuous family.

    """
    loops = equations.loops
    solutions = assemblies(equations)
    if not len(solutions):
        raise SceneError([_open_fault(equations)])
    if not loops.unknowns:
        isolated, family = solutions, solutions[:0]
    elif loose_everywhere(equations):
        raise SceneError(_position_faults(equations, solutions[0]))
    else:
        isolated, family = _isolated(equations, solutions)
    fitting, members = (part[_on_sides(equations, part)] for part in (isolated, family))
    if not len(fitting) and not len(members):
        raise SceneError([_fault(loops, "assembly", "sides that no assembly fits", solutions, "one that does")])
    guesses = _guesses(loops)
    member = None if len(fitting) else members[0]
    if len(fitting) and len(members) and len(guesses) > 1:  # members are many: they must fit the guesses far better
        gaps = _distances(loops, members, guesses)
        if gaps.min() < _FITS * max(_distances(loops, fitting, guesses).min() - _ROUGH, 0.0):
            member = members[int(np.argmin(gaps))]
    if member is not None:
        expected = "one assembly that the driver settles"
        what, others = f"a continuous family of assemblies, as {_family(equations, member)},", isolated
        if len(fitting):
            others = fitting
        if len(others):
            raise SceneError([_fault(loops, "", what, others, f"{expected}, by guesses and sides")])
        advice = "choose another `start`, or change a length"
        raise SceneError([Fault(loops.linkage.path, f"{what} {_where(loops)}", expected, advice)])
    if loops.unknowns:  # which the driver settles, and can leave
        jacobian = equations.jacobian(fitting, equations.bases(fitting))
        settled = np.linalg.matrix_rank(jacobian[:, :, 1:], rtol=_SINGULAR) == loops.unknowns
        if not (settled & (np.linalg.matrix_rank(jacobian, rtol=1e-9) == loops.unknowns)).any():
            nearest = fitting[np.argmin(_distances(loops, fitting, guesses))]
            raise SceneError(_position_faults(equations, nearest))
    chosen = _chosen(loops, fitting, guesses)
    if faults := _position_faults(equations, chosen):
        raise SceneError(faults)
    ruled_out = guesses and len(fitting) < len(isolated)  # guesses may fit an assembly that the sides rule out
    if ruled_out and (names := _contrary(loops, isolated, chosen, guesses)):
        what = f"guesses for another assembly than that of the sides ({names}),"
        raise SceneError([_fault(loops, "assembly", what, isolated, "guesses and sides of one")])
    return chosen


def _contrary(loops: Loops, z: Array, near: Array, guesses: dict[int, float]) -> str:
    """Names of guesses as far from an assembly as assemblies z are from one another, though another assembly fits them."""
    columns, gaps = sorted(guesses), np.abs(_gaps(loops, z, guesses))
    spread = np.max([np.abs(_apart(loops, z, other)).max(axis=0) for other in z], axis=0)[[k - 1 for k in columns]]
    gap = np.abs(_gaps(loops, near[None], guesses))[0]
    contrary = (gap > np.maximum(_CLEARER * spread, _ROUGH)) & (gaps.min(axis=0) < _FITS * gap)
    return ", ".join(loops.names[k] for k, wrong in zip(columns, contrary, strict=True) if wrong)


def _isolated(equations: Equations, solutions: Array) -> tuple[Array, Array]:
    """Isolated assemblies, a double root once, and members of continuous families."""
    values, _ = _singular_values(equations, solutions)
    singular = values[:, -1] <= _SINGULAR * values[:, 0]
    member = np.zeros(len(solutions), dtype=bool)
    member[singular] = _in_families(equations, solutions[singular])
    alone = list(solutions[~singular])
    for z in solutions[singular & ~member]:  # found to the root of rounding, and so more than once
        if all(np.abs(_apart(equations.loops, z, other)).max() > _BLURRED for other in alone):
            alone.append(z)
    return np.array(alone).reshape(-1, solutions.shape[1]), solutions[member]


def _position_faults(equations: Equations, z: Array) -> list[Fault]:
    """Faults of an assembly that the driver's coordinate does not determine, or that cannot move."""
    loops = equations.loops
    jacobian = equations.jacobian(z[None], equations.bases(z[None]))[0]
    faults = freedom_faults(loops, jacobian)
    near = loops.unknowns and np.linalg.matrix_rank(jacobian[:, 1:], rtol=_SINGULAR) < loops.unknowns
    if not (faults or near) or loose_everywhere(equations):
        return faults
    if near and (fault := singular_fault(equations, z, float(z[0]) - _BLURRED, float(z[0]) + _BLURRED)):
        return [fault]
    if faults and gruebler(loops.linkage) < 1:  # a joint too many is the likelier cause
        return faults
    what = f"an assembly that locks or branches {_where(loops)} ({_described(loops, z)})"
    advice = "choose another `start`, and a range of the driver that leaves this position out"
    return [Fault(loops.linkage.path, what, "a position that the driver settles", advice)]


def loose_everywhere(equations: Equations) -> bool:
    """Tests whether the unknowns are undetermined at random positions too, not at special positions alone."""
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
    """Every assembly found with the driver at its start, shape (assemblies, variables).

    Angles lie from -pi to pi, except for those that a coupling ties: its relation holds for the turns that they have made.

    Newton-Raphson with bounded steps runs from evenly scattered points and from the guesses; a solution that all of them
    miss is not found, so there are many.
    """
    loops = equations.loops
    z, square = _starts(loops), loops.equations == loops.unknowns and not loose_everywhere(equations)
    done = []
    for _ in range(_ITERATIONS):
        move, gap = _step(equations, z, square)
        z[:, 1:] += move
        closed = (np.abs(move).max(axis=1, initial=0.0) < _CLOSED) & (gap < _CLOSED)
        done.append(z[closed])
        z = z[~closed & np.isfinite(z).all(axis=1)]
        if not len(z):
            break
    else:
        done.append(z[_step(equations, z, square)[1] < _CLOSED])
    z = np.concatenate(done)[:_MOST_STARTS]  # of equal ones those with the fewest turns go first
    z = z[np.argsort(_turns(loops, z), kind="stable")]
    free = np.flatnonzero(np.concatenate(([False], _angular(loops))) & ~_tied(loops))
    z[:, free] = -((pi - z[:, free]) % (2 * pi) - pi)
    marks = np.where(_angular(loops), np.sin(z[:, 1:] + np.arange(loops.unknowns)), z[:, 1:]).sum(axis=1)
    order = np.argsort(marks, kind="stable")  # equal ones have equal marks
    groups = np.split(order, 1 + np.flatnonzero(np.diff(marks[order]) > loops.unknowns * _SAME_ASSEMBLY))
    kept: list[Array] = []
    for near in (z[np.sort(group)] for group in groups):
        while len(near):
            kept.append(near[0])
            near = near[np.abs(_apart(loops, near, near[0])).max(axis=1, initial=0.0) >= _SAME_ASSEMBLY]
    solutions = np.array(kept).reshape(-1, len(loops.names))
    return solutions[np.lexsort(np.round(solutions, 6).T[::-1])]


def _step(equations: Equations, z: Array, square: bool, driver: bool = False) -> tuple[Array, Array]:
    """One bounded Gauss-Newton step from many points, of the driver too on request; their largest residuals."""
    loops, bases = equations.loops, equations.bases(z)
    gap = equations.residual(z, bases)
    first = 0 if driver else 1
    jacobian = equations.jacobian(z, bases)[:, :, first:]
    if square:
        move = solved(jacobian, -gap)
        move[~np.isfinite(move).all(axis=1)] = 0.3
    else:
        move = np.einsum("nij,nj->ni", np.linalg.pinv(jacobian, rcond=1e-10), -gap)
    used = np.any(np.abs(loops.closures) > 0.0, axis=0)
    in_loops = np.any(loops.turns[used] != 0.0, axis=0)  # the others follow from couplings alone, however far
    in_loops[loops.slides[used & (loops.slides >= 0)]] = True
    longest = np.abs(move[:, in_loops[first:]]).max(axis=1, initial=0.0)
    return move * np.minimum(1.0, _STRIDE / np.maximum(longest, 1e-300))[:, None], np.abs(gap).max(axis=1, initial=0.0)


def _starts(loops: Loops) -> Array:
    """Points scattered evenly over angles and displacements, the guesses first.

    They are a Kronecker sequence by powers of the root of x^(d+1) = x + 1 (M. Roberts, 2018).
    """
    count = min(_STARTS * loops.unknowns, _MOST_STARTS) if loops.unknowns else 1
    wide = float(np.abs(loops.closures).sum(axis=1).max(initial=1.0))
    root = 1.5
    for _ in range(60):
        root = (1.0 + root) ** (1.0 / (max(loops.unknowns, 1) + 1))
    share = (0.5 + np.arange(count)[:, None] * root ** -np.arange(1.0, loops.unknowns + 1.0)) % 1.0
    z = np.empty((count, loops.unknowns + 1))
    z[:, 0] = loops.start
    reach = np.where(_angular(loops), np.where(_tied(loops)[1:], _TURNS * pi, pi), wide)
    z[:, 1:] = reach * (2.0 * share - 1.0)
    guesses, guessed = _guesses(loops), z[: max(count // 4, 1)]
    for table, guess_values in ((z, ()), (guessed, tuple(guesses))):
        guessed[:, list(guesses)] = list(guesses.values())
        # onto every gear and rolling pair, by the variable that has to turn most, and is not given: a pinion may have to
        # turn many times for its rack's travel, and no bounded step would take it there
        for relation in loops.relations:
            if relation.lift is not None:
                continue
            line = relation.second.weights - relation.ratio * relation.first.weights
            rest = relation.second.constant - relation.ratio * relation.first.constant - relation.phase
            tied = [int(k) for k in np.flatnonzero(line[1:]) + 1]
            moved = [k for k in tied if k not in guess_values] or tied
            if moved:
                k = min(moved, key=lambda column: abs(float(line[column])))
                table[:, k] -= (table @ line + rest) / line[k]
    return z


def _guesses(loops: Loops) -> dict[int, float]:
    """Guessed values by the number of the variable; a body that is no variable of its own has its leader's angle guessed."""
    guesses: dict[int, float] = {}
    for body, form in zip(loops.linkage.names, loops.angles, strict=True):
        guess = loops.linkage.link(body).guess
        turning = np.flatnonzero(form.weights[1:])
        if guess is not None and turning.size == 1:
            guesses[int(turning[0]) + 1] = guess - (form.constant + form.weights[0] * loops.start)
    for joint in loops.linkage.joints:
        name = f"slide of {joint.name}"
        if joint.guess is not None and joint.kind in (SLIDE, SLOT) and name in loops.names:
            guesses[loops.names.index(name)] = joint.guess / loops.unit
    return guesses


def _angular(loops: Loops) -> NDArray[np.bool_]:
    """Mask of the unknowns that are angles."""
    return np.array([name.startswith("angle") for name in loops.names[1:]], dtype=bool)


def _tied(loops: Loops) -> NDArray[np.bool_]:
    """Mask of the variables in couplings: one more turn of one of them would break its relation."""
    weights = [np.abs(form.weights) for r in loops.relations for form in (r.first, r.second)]
    return np.asarray(np.sum([np.zeros(len(loops.names)), *weights], axis=0) > 0.0)


def _turns(loops: Loops, z: Array) -> Array:
    """The largest angle (rad) that a coupled joint other than the driver has turned through, of positions (n, variables)."""
    sizes = [np.abs(r.first.at(z)) for r in loops.relations if np.any(r.first.weights[1:])]
    return np.asarray(np.max(sizes, axis=0)) if sizes else np.zeros(len(z))


def _apart(loops: Loops, a: Array, b: Array) -> Array:
    """Differences of the unknowns of positions, angles by the shorter way."""
    gap = (a - b)[..., 1:]
    return np.where(_angular(loops), (gap + pi) % (2 * pi) - pi, gap)


def _chosen(loops: Loops, fitting: Array, guesses: dict[int, float]) -> Array:
    """The assembly that is clearly the nearest to the guesses; its free angles within half a turn of them.

    Where a coupling gives several by the turns of the joints that it ties, those within half a turn go first.
    """
    near = _nearest(loops, fitting, guesses)
    few = near[_turns(loops, near) < pi + _SAME_ASSEMBLY]
    if len(near) > 1 and len(few):
        near = _nearest(loops, few, guesses)
    if len(near) > 1 and guesses:
        what = "guesses that fit several assemblies"
        raise SceneError([_fault(loops, "", what, near, "guesses nearer to one of them")])
    if len(near) > 1:
        raise SceneError([_fault(loops, "", f"{len(near)} assemblies that fit", near, "a guess or side for one")])
    chosen = np.array(near[0])
    for column, guess in guesses.items():
        if loops.names[column].startswith("angle") and not _tied(loops)[column]:
            chosen[column] += 2 * pi * round((guess - chosen[column]) / (2 * pi))
    return chosen


def _nearest(loops: Loops, fitting: Array, guesses: dict[int, float]) -> Array:
    """The assembly clearly nearest to the guesses, or all of those that are about as near."""
    if len(fitting) == 1 or not guesses:
        return fitting
    distance = _distances(loops, fitting, guesses)
    near = int(np.argmin(distance))
    if names := _contrary(loops, fitting, fitting[near], guesses):
        what = f"guesses for another assembly than the rest ({names}),"
        raise SceneError([_fault(loops, "", what, fitting, "guesses of one")])
    return np.asarray(fitting[distance <= distance[near] / _CLEARER])


def _gaps(loops: Loops, z: Array, guesses: dict[int, float]) -> Array:
    """Distances of assemblies from each guess, shape (assemblies, guesses)."""
    columns = sorted(guesses)
    target = np.zeros(len(loops.names))
    target[columns] = [guesses[k] for k in columns]
    return np.asarray(_apart(loops, z, target)[:, [k - 1 for k in columns]])


def _distances(loops: Loops, z: Array, guesses: dict[int, float]) -> Array:
    return np.asarray(np.sqrt((_gaps(loops, z, guesses) ** 2).sum(axis=1)))


def _on_sides(equations: Equations, z: Array) -> NDArray[np.bool_]:
    """Mask of the positions that have every point on the required side of its line."""
    linkage, fits = equations.loops.linkage, np.ones(len(z), dtype=bool)
    for side in linkage.sides:
        ends = [(body, linkage.link(body).point(name)) for body, name in (side.point, side.start, side.end)]
        point, start, end = (_places(equations, z, *where) for where in ends)
        fits &= ((end - start).conjugate() * (point - start)).imag * side.sense > 0.0
    return fits


def _where(loops: Loops) -> str:
    linkage = loops.linkage
    sliding = {joint.name: joint.kind == SLIDE for joint in linkage.joints}
    each = [(name, f"{at:.6g} m" if sliding[name] else f"{degrees(at):.6g} deg") for name, at in linkage.drivers]
    return "with " + _and([f"{name} at {value}" for name, value in each])


def _fault(loops: Loops, key: str, what: str, solutions: Array, expected: str) -> Fault:
    """A fault that lists assemblies, as many as fit on its line."""
    texts = [f"({_described(loops, z)})" for z in solutions[:_LISTED]]
    few = max(int(np.searchsorted(np.cumsum([len(text) for text in texts]), _LONGEST)), 1)
    more = f" and {len(solutions) - few} more" if len(solutions) > few else ""
    path = f"{loops.linkage.path}.{key}" if key else loops.linkage.path
    return Fault(path, f"{what} {_where(loops)}", expected, f"there are {'; '.join(texts[:few])}{more}")


def _open_fault(equations: Equations) -> Fault:
    """Fault of bodies that do not meet: the loops that stay open at their nearest approach, and redundant joints."""
    loops = equations.loops
    one = len(loops.linkage.drivers) == 1
    z, closes = _nearest_to_closing(equations, driver=one)
    if one and closes:
        z = _nearest_to_closing(equations, driver=False)[0]
    gaps = np.abs(equations.bases(z[None]).whole[0] @ loops.closures.T)
    reasons = [
        f"the loop {' - '.join(path)} stays open by {gap * loops.unit:.3g} m"
        for path, gap in zip(loops.paths, gaps, strict=True)
        if gap > _SAME_ASSEMBLY
    ][:_NAMED]
    if (count := gruebler(loops.linkage)) < 1:
        reasons.append(f"Gruebler's count is {count} degrees of freedom, so that a joint may be too many")
    why = "; ".join(reasons) or "their couplings contradict each other"
    if one and not closes:
        where = f"at any {'position' if loops.linkage.sliding else 'angle'} of {loops.linkage.driver}"
        nearest = z[0] if loops.linkage.sliding else round(degrees(z[0]), 2) % 360.0 * pi / 180.0
        why = f"nearest with {loops.linkage.driver} at {place(equations, float(nearest))}: {why}"
        return Fault(loops.linkage.path, f"bodies that cannot be assembled {where}", "loops that close", why)
    defect = f"bodies that cannot be assembled {_where(loops)}"
    return Fault(loops.linkage.path, defect, "loops that close", f"{why}; change a length, or `start`")


def _nearest_to_closing(equations: Equations, driver: bool) -> tuple[Array, bool]:
    """The position where loops are nearest to closing, and whether they close there.

    The sum of the squares of all gaps is least there. Gauss-Newton steps of all variables but the driver, or of the driver
    too, lead near it. They stall where bodies come into line, so that quasi-Newton steps (BFGS) end the search.
    """
    from scipy.optimize import minimize

    loops, first = equations.loops, 0 if driver else 1
    z = _starts(loops)[:_TRIED]
    if driver:
        z[:, 0] += 2 * pi * np.arange(len(z)) / len(z)
    for _ in range(_ITERATIONS):
        z[:, first:] += _step(equations, z, square=False, driver=driver)[0]
    squares = (equations.residual(z, equations.bases(z)) ** 2).sum(axis=1)
    order = np.argsort(squares)[:_REFINED]  # NaN last

    def measure(free: Array, begin: Array) -> tuple[float, Array]:
        """Half the sum of squares with its gradient."""
        table = np.concatenate((begin[:first], free))[None]
        bases = equations.bases(table)
        gap = equations.residual(table, bases)[0]
        return 0.5 * float(gap @ gap), gap @ equations.jacobian(table, bases)[0, :, first:]

    ends = [(minimize(measure, z[k, first:], args=(z[k],), jac=True, options={"gtol": 1e-12}), z[k]) for k in order]
    best, begin = min(ends, key=lambda end: float(end[0].fun))
    return np.concatenate((begin[:first], best.x)), bool(best.fun < 0.5 * _SAME_ASSEMBLY**2)
