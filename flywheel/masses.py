"""Point masses in place of a rigid body: with its mass and centre (static), with its inertia too (complete).

Places are coordinates (m) from the body's centre of mass, one row a point: (n, 1) on a line, (n, 2) in the plane of motion,
(n, 3) in space. Each condition is linear in the masses, so that as many points as conditions decide them. With more points
the masses of the others are free: n - 3 of n points on a line, n - 4 in the plane, n - 10 in space.

| | conditions | static | complete | no answer if the points lie |
| --- | --- | --- | --- | --- |
| line | 1, x, x² | 2 | 3 | at one place |
| plane | 1, x, y, x² + y² | 3 | 4 | static: on a line; complete: on a line or a circle |
| space | 1, x, y, z, x², y², z², yz, xz, xy | 4 | 10 | static: in a plane; complete: on a surface of second degree |
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.numerics.faults import NOT_NEGATIVE, POSITIVE, Fault, SceneError, array, brief, number_faults, refuse, require

__all__ = [
    "Equivalent", "Residual", "compare", "conjugate", "correction_couple", "equivalent_masses", "four_masses",
    "ten_masses", "three_masses", "two_masses",
]  # fmt: skip

Array = NDArray[np.float64]

_STATIC = {2: 1, 3: 2, 4: 3}  # points -> dimensions in which they give mass and centre
_COMPLETE = {3: 1, 4: 2, 10: 3}  # and inertia
_FLAT = 1e-12  # ratio of singular values below which points count as lying on the surface that leaves the masses open
_EXACT = 1e-9  # of a body's scale: residuals of a complete set are rounding
_SURFACES = {
    (2, 1): "two points at one place",
    (3, 1): "points of which two lie at one place",
    (3, 2): "three points on one line",
    (4, 2): "four points on one line or circle",
    (4, 3): "four points in one plane",
    (10, 3): "ten points on one surface of second degree",
}


class Residual(NamedTuple):
    """Excess of a set of point masses: mass (kg), place of its centre (m), moment of inertia (kg m²).

    `inertia` is a number on a line and in the plane, about the body's centre; in space the tensor, shape (3, 3).
    """

    mass: float
    centre: Array
    inertia: Array


class Equivalent(NamedTuple):
    """Point masses (kg), shape (n,), at `places` (m from the centre of mass), shape (n, dimensions).

    `residual` is the check against the body, `complete` whether inertia agrees with it too; `messages` say which masses are
    negative, and by how much inertia differs if the equivalence is only static.
    """

    masses: Array
    places: Array
    residual: Residual
    complete: bool
    messages: tuple[str, ...]


def two_masses(mass: float, inertia: float, r_a: float, r_b: float | None = None) -> Equivalent:
    """Two masses on a line through the centre, at -r_a and r_b: m_A = m r_b/(r_a + r_b), m_B = m r_a/(r_a + r_b).

    Their inertia is m r_a r_b. So the set is complete only where r_a r_b = k² = I/m: B is then A's centre of percussion.
    Two masses at other places are only static: their inertia is too large by m (r_a r_b - k²), which `residual` contains,
    `messages` report, and `correction_couple` corrects.

    Args:
        mass: m, kg.
        inertia: I about the centre of mass, kg m².
        r_a: from the centre to A, m, positive on A's side.
        r_b: from the centre to B, m, positive on the other side; k²/r_a, for a complete set, if None.

    Raises:
        SceneError: if the places coincide, or no body has this mass and inertia.

    Valid for plane motion, of a body whose centre lies on the line. Source: the course's equivalent masses (5a).

    >>> rod = two_masses(3.0, 0.25, 0.5, 0.5)  # a uniform rod of 1 m, its ends
    >>> rod.masses.tolist(), float(rod.residual.inertia), rod.complete
    ([1.5, 1.5], 0.5, False)
    >>> two_masses(3.0, 0.25, 0.5).complete
    True

    """
    if r_b is None:
        r_b = conjugate(mass, inertia, r_a)
    _check_line(mass, inertia, r_a, r_b)
    return equivalent_masses(mass, inertia, [[-r_a], [r_b]])


def conjugate(mass: float, inertia: float, r_a: float) -> float:
    """Distance r_b = I/(m r_a) (m) at which a second mass makes two complete: the centre of percussion for A.

    Args:
        mass: m, kg.
        inertia: I about the centre of mass, kg m².
        r_a: from the centre to A, m.

    Raises:
        SceneError: if A is the centre itself, or no body has this mass and inertia.

    Source: the course's equivalent masses (5a), with m_G = 0.

    >>> conjugate(3.0, 0.25, 0.5)  # a uniform rod of 1 m held at one end: 2/3 of its length from there
    0.16666666666666666

    """
    _check_line(mass, inertia, r_a, 0.0)
    if r_a == 0.0:
        raise SceneError([Fault("r_a", f"{r_a:g} m", "a place away from the centre of mass")])
    return inertia / (mass * r_a)


def three_masses(mass: float, inertia: float, r_a: float, r_b: float) -> Equivalent:
    """Three masses on a line, at -r_a, r_b and in the centre: always complete.

    m_A = I/(r_a l), m_B = I/(r_b l), m_G = m - I/(r_a r_b), with l = r_a + r_b. m_G is 0 if r_a r_b = I/m, negative where
    it is less.

    Args:
        mass: m, kg.
        inertia: I about the centre of mass, kg m².
        r_a: from the centre to A, m, positive on A's side.
        r_b: from the centre to B, m, positive on the other side.

    Raises:
        SceneError: if two places coincide, or no body has this mass and inertia.

    Valid for plane motion, of a body whose centre lies on the line. Source: the course's equivalent masses (5a).

    >>> three_masses(3.0, 0.25, 0.5, 0.5).masses.tolist()  # a uniform rod: 1/6, 1/6, 2/3
    [0.5, 0.5, 2.0]

    """
    _check_line(mass, inertia, r_a, r_b)
    return equivalent_masses(mass, inertia, [[-r_a], [r_b], [0.0]])


def four_masses(mass: float, inertia: float, places: ArrayLike) -> Equivalent:
    """Four masses in the plane of motion, the fourth in the centre unless four places are given: complete.

    sum m_i = m, sum m_i x_i = sum m_i y_i = 0, sum m_i (x_i² + y_i²) = I.

    Args:
        mass: m, kg.
        inertia: I about the centre of mass, perpendicular to the plane, kg m².
        places: x, y (m) from the centre, shape (3, 2) or (4, 2).

    Raises:
        SceneError: if the points lie on one circle or line, or no body has this mass and inertia.

    Source: the course's equivalent masses (5b).

    >>> four_masses(7.0, 0.28, [[0.2, 0.0], [-0.1, 0.2], [-0.1, -0.2]]).masses.round(9).tolist()
    [2.0, 2.0, 2.0, 1.0]

    """
    positions = array("places", places)
    if positions.shape == (3, 2):
        positions = np.vstack((positions, np.zeros(2)))
    if positions.shape != (4, 2):
        raise SceneError([Fault("places", f"an array of shape {positions.shape}", "three or four rows of x, y")])
    return equivalent_masses(mass, inertia, positions)


def ten_masses(mass: float, tensor: ArrayLike, places: ArrayLike | None = None) -> Equivalent:
    """Ten masses in space: complete.

    Ten conditions (mass, three first moments, six second moments S) need ten points on which no polynomial of second
    degree vanishes. Where none are given: the centre; a pair ± a_i on each axis, a_i = sqrt(3 S_ii/m); and one point in
    each plane of two axes, (a_i, ± a_j), on the side where its mass |S_ij|/(a_i a_j) is positive. The products of inertia
    decide those three alone, the pairs then follow from first and second moments, the centre has the rest. On principal
    axes the three and the centre have no mass: six masses of m/6 remain.

    Args:
        mass: m, kg.
        tensor: inertia tensor about the centre of mass, kg m², shape (3, 3), with -sum m x y off the diagonal. (The course's
            C_x, C_y, C_z are the products without that sign.)
        places: x, y, z (m) from the centre, shape (10, 3).

    Raises:
        SceneError: if the points lie on one surface of second degree, or no body has this tensor.

    Source: the course's equivalent masses (5c), which leaves the points open; the choice is this library's own.

    >>> ten_masses(6.0, np.diag([0.5, 0.4, 0.3])).masses[1:7].round(12).tolist()
    [1.0, 1.0, 1.0, 1.0, 1.0, 1.0]

    """
    _check_body(mass, tensor, 3)
    return equivalent_masses(mass, tensor, _ten_places(mass, np.asarray(tensor, float)) if places is None else places)


def equivalent_masses(
    mass: float, inertia: ArrayLike, places: ArrayLike, chosen: Mapping[int, float] | None = None
) -> Equivalent:
    """Masses at n given places, some of them chosen; the number of the others makes the set static or complete.

    sum m_i = m, sum m_i p_i = 0 and the sums of second powers are the body's; the shares of the chosen masses go to the
    right-hand side. Unknown masses: 2 on a line, 3 in a plane, 4 in space (static), or 3, 4 and 10 (complete).

    Args:
        mass: of the body, kg.
        inertia: about the centre of mass, kg m²; in space the tensor, shape (3, 3).
        places: (m) from the centre, shape (n, dimensions).
        chosen: masses (kg) by the number of their point, from 0: n - 3, n - 4 or n - 10 of them for a complete set.

    Raises:
        SceneError: if the number of points without a chosen mass decides no masses, these points lie on the surface that
            leaves them open (see the module), or no body has this mass and inertia.

    Source: the course's equivalent masses (5a), n points on a line; plane and space by the same argument.

    >>> equivalent_masses(2.0, 0.1, [[0.3, 0.0], [-0.1, 0.2], [-0.1, -0.2]]).complete
    False
    >>> rod = equivalent_masses(3.0, 0.25, [[-0.5], [-0.25], [0.0], [0.25], [0.5]], {1: 0.8, 3: 0.8})
    >>> rod.masses.round(12).tolist(), rod.complete
    ([0.3, 0.8, 0.8, 0.8, 0.3], True)

    """
    points = array("places", places)
    if points.ndim != 2 or points.shape[1] not in (1, 2, 3):
        expected = "one row a point, of 1 to 3 coordinates"
        raise SceneError([Fault("places", f"an array of shape {points.shape}", expected)])
    dimensions = points.shape[1]
    fixed = _checked_choice(chosen, points)
    free = np.array([k for k in range(len(points)) if k not in fixed], dtype=np.intp)
    _check_body(mass, inertia, dimensions)
    complete = _COMPLETE.get(len(free)) == dimensions
    reach = float(np.abs(points).max()) or 1.0
    # the conditions, one a row, on unit masses at the points, one a column
    x = (points / reach).T
    rows = [np.ones(x.shape[1]), *x]
    if complete and len(x) == 3:
        rows += [*x**2, x[1] * x[2], x[0] * x[2], x[0] * x[1]]
    elif complete:
        rows.append((x**2).sum(axis=0))
    powers = np.array(rows)
    sizes = np.linalg.svd(powers[:, free], compute_uv=False)
    if sizes[-1] <= _FLAT * sizes[0]:
        defect = _SURFACES[len(free), dimensions] + (" to be found" if fixed else "")
        advice = "they leave the masses open: move one"
        if dimensions == 2 and np.linalg.svd(points, compute_uv=False)[-1] <= _FLAT * reach:
            advice += "; points in line with the centre are given by one number each, shape (n, 1)"
        raise SceneError([Fault("places", defect, "points in general position", advice)])
    targets = np.zeros(len(free))
    targets[0] = mass
    if complete:
        targets[dimensions + 1 :] = _second_moments(np.asarray(inertia, dtype=float), dimensions) / reach**2
    masses = np.zeros(len(points))
    masses[list(fixed)] = list(fixed.values())
    masses[free] = np.linalg.solve(powers[:, free], targets - powers @ masses)
    masses[free] += np.linalg.solve(powers[:, free], targets - powers @ masses)
    return _judged(masses, points, mass, inertia)


def compare(masses: ArrayLike, places: ArrayLike, mass: float, inertia: ArrayLike) -> Residual:
    """The excess of point masses over a body in mass, centre and inertia, by the sums themselves.

    Args:
        masses: kg, shape (n,).
        places: (m) from the body's centre of mass, shape (n, dimensions).
        mass: of the body, kg.
        inertia: of the body about its centre of mass, kg m²; in space the tensor, shape (3, 3).

    The centre is sum m_i p_i/m with the body's mass, so that it is finite for any masses.

    >>> compare([1.5, 1.5], [[-0.5], [0.5]], 3.0, 0.25)
    Residual(mass=0.0, centre=array([0.]), inertia=array(0.5))

    """
    m, points = array("masses", masses), array("places", places)
    if m.ndim != 1 or points.ndim != 2 or len(points) != len(m):
        raise SceneError([Fault("places", f"an array of shape {points.shape}", f"one row a mass, {m.size} in all")])
    _check_body(mass, inertia, points.shape[1])
    squares = m @ (points**2).sum(axis=1)
    if points.shape[1] == 3:
        squares = squares * np.eye(3) - (points.T * m) @ points
    return Residual(float(m.sum() - mass), m @ points / mass, np.asarray(squares - np.asarray(inertia, dtype=float)))


def correction_couple(residual: Residual, alpha: ArrayLike, omega: ArrayLike = 0.0) -> Array:
    """Couple (N m) to add to the inertia forces of point masses, so that they have the body's own moment.

    In the plane dI alpha; in space dI alpha + omega x (dI omega); dI is the excess inertia of the masses (kg m²).

    Args:
        residual: that of the masses.
        alpha: angular acceleration, rad/s²: any shape in the plane, (3,) in space.
        omega: angular velocity, rad/s; needed only in space, shape (3,).

    Source: T = I alpha of body and masses, subtracted; d'Alembert's couples are opposite to both.

    >>> float(correction_couple(two_masses(3.0, 0.25, 0.5, 0.5).residual, 4.0))
    2.0

    """
    require("residual", residual, Residual, "a Residual")
    turning = array("alpha", alpha)
    if residual.inertia.ndim == 0:
        return np.asarray(residual.inertia * turning)
    spin = np.broadcast_to(array("omega", omega), (3,))
    return np.asarray(residual.inertia @ turning + np.cross(spin, residual.inertia @ spin))


def _ten_places(mass: float, tensor: Array) -> Array:
    """The centre, a pair on each axis, a point in each plane of two axes (see `ten_masses`)."""
    moments = _second_moments(tensor, 3)
    reach = np.sqrt(3.0 * np.maximum(moments[:3], 0.0) / mass)
    longest = float(reach.max()) or 1.0
    a, b, c = np.where(reach > 1e-3 * longest, reach, longest)  # a flat body has no reach of its own across
    yz, xz, xy = np.where(moments[3:] < 0.0, -1.0, 1.0)
    pairs = [sign * axis for axis in np.diag([a, b, c]) for sign in (1.0, -1.0)]
    return np.array([np.zeros(3), *pairs, [0.0, b, yz * c], [a, 0.0, xz * c], [a, xy * b, 0.0]])


def _second_moments(inertia: Array, dimensions: int) -> Array:
    """Sums of m times the second powers (kg m²): in space x², y², z², yz, xz, xy."""
    if dimensions < 3:
        return inertia.reshape(1)
    planar = 0.5 * np.trace(inertia) - np.diag(inertia)
    return np.array([*planar, -inertia[1, 2], -inertia[0, 2], -inertia[0, 1]])


def _judged(masses: Array, points: Array, mass: float, inertia: ArrayLike) -> Equivalent:
    """The set with its residual and messages."""
    residual = compare(masses, points, mass, inertia)
    negative = np.flatnonzero(masses < -_EXACT * mass)
    messages = [
        f"mass {k + 1} is negative ({masses[k]:.6g} kg): right in the equations of motion, but nothing to build"
        for k in negative
    ]
    excess = float(residual.inertia.flat[np.abs(residual.inertia).argmax()])
    complete = abs(excess) <= _EXACT * float(np.abs(masses) @ (points**2).sum(axis=1) + np.abs(inertia).max())
    if not complete:
        how = "out by" if residual.inertia.ndim else "too great by" if excess > 0.0 else "too small by"
        text = f"static equivalence only: the inertia is {how} {abs(excess):.6g} kg m²; add the correction couple"
        messages.append(text)
    return Equivalent(masses, points, residual, complete, tuple(messages))


def _checked_choice(chosen: Mapping[int, float] | None, points: Array) -> dict[int, float]:
    """Chosen masses by point; SceneError where the rest is not as many points as decide the masses."""
    fixed: Mapping[Any, float] = {} if chosen is None else chosen
    require("chosen", fixed, Mapping, "masses (kg) by the number of their point, from 0")
    count, dimensions = points.shape
    faults = []
    for k, value in fixed.items():
        if isinstance(k, bool) or not isinstance(k, (int, np.integer)) or not 0 <= k < count:
            faults.append(Fault("chosen", f"point {brief(k)}", f"one from 0 to {count - 1}"))
        faults += number_faults(f"chosen[{k}]", value, unit="kg")
    refuse(faults)
    left = count - len(fixed)
    if dimensions in (_STATIC.get(left), _COMPLETE.get(left)):
        return {int(k): float(value) for k, value in fixed.items()}
    if not fixed and count <= max(k for k, d in _COMPLETE.items() if d == dimensions):
        expected = "2 or 3 points on a line, 3 or 4 in a plane, 4 or 10 in space, one a row"
        raise SceneError([Fault("places", f"an array of shape {points.shape}", expected)])
    static, complete = (next(k for k, d in table.items() if d == dimensions) for table in (_STATIC, _COMPLETE))
    defect = f"{len(fixed)} masses for {count} points"
    expected = f"{max(count - complete, 0)} of them, or {max(count - static, 0)} for a static set"
    advice = f"the conditions decide {complete} masses, or {static} without the inertia"
    raise SceneError([Fault("chosen", defect, expected, advice)])


def _check_body(mass: float, inertia: ArrayLike, dimensions: int) -> None:
    faults = number_faults("mass", mass, POSITIVE, "kg")
    if dimensions < 3:
        number = inertia.item() if isinstance(inertia, np.ndarray) and inertia.ndim == 0 else inertia
        faults += number_faults("inertia", number, NOT_NEGATIVE, "kg m²")
    refuse(faults)
    if dimensions == 3 and (fault := _tensor_fault(array("inertia", inertia))) is not None:
        raise SceneError([fault])


def _check_line(mass: float, inertia: float, r_a: float, r_b: float) -> None:
    """A body and two places on a line."""
    _check_body(mass, inertia, 1)
    refuse([*number_faults("r_a", r_a, unit="m"), *number_faults("r_b", r_b, unit="m")])


def _tensor_fault(tensor: Array) -> Fault | None:
    """A tensor belongs to a body if it is symmetric and no principal moment is above the sum of the other two."""
    if tensor.shape != (3, 3):
        return Fault("inertia", f"an array of shape {tensor.shape}", "a tensor of shape (3, 3), kg m²")
    scale = float(np.abs(tensor).max())
    if np.abs(tensor - tensor.T).max() > _EXACT * scale:
        return Fault("inertia", "a tensor that is not symmetric", "a symmetric one")
    low, middle, high = np.linalg.eigvalsh(tensor)
    if high - low - middle > _EXACT * scale:
        defect = f"principal moments {low:.6g}, {middle:.6g}, {high:.6g} kg m²"
        return Fault("inertia", defect, "none above the sum of the other two", "check the products' signs")
    return None
