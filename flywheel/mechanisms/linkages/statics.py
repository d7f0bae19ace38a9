"""Newton's and Euler's equations of every body as one linear system a position: sum F = m a_G, sum M_G = J alpha.

Unknowns are the driving actions and the components of every joint's reaction, as unit actions of its first body on its
second. There are three equations a moving body; a mechanism whose driver moves it without locking makes them independent,
so that forces can always be found, however many components there are. With more unknowns than equations (redundant
constraints) those that the equations leave open are named.

| joint | components | size that friction follows | Coulomb's friction |
| --- | --- | --- | --- |
| pin | x, y in the frame's axes (N) | resultant R of x and y | couple r R mu/sqrt(1 + mu²) (N m): the friction circle |
| slide | normal (N) at second's point, a quarter turn from the guide's way; moment (N m) | normal N | mu N along the guide |
| slide with a shoe of length L | the same | normals N/2 ± M/L at its two ends | mu (front + rear) |
| pin-in-slot | normal (N) | normal N | mu N along the slot |
| fixed | x, y (N), moment (N m) | | |
| gear, rolling | tangential (N) at the pitch point; radial = tangential tan(pressure angle), which parts the wheels | | |
| cam | normal (N), away from the cam's axis | normal N | mu N along the surface, at the contact point |

Friction opposes the motion of second on first; where that rests or turns back there is none: at rest it is not determined.
Without friction the reactions are x0; unit passive actions add a response G, so that

    x = x0 + G (f * s(x)),   s_j(x) = |B_j x|

with s_j the size of the reaction that passive action j follows, f_j its factor. s is homogeneous of degree one,
s = s'(x) x, so that Newton's step needs the sizes y = s alone: (1 - s' G f) y = s' x0.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.mechanisms.linkages.equations import solved
from flywheel.mechanisms.linkages.positions import Poses
from flywheel.mechanisms.linkages.wrenches import Pair, centres, contact, effort_pair, guide, index, joint_rate, perp
from flywheel.numerics.faults import Fault, SceneError
from flywheel.scene.linkage import CAM, FIXED, PIN, SLIDE, Coupling, Joint

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

FORCE, COUPLE = "N", "N m"
DRIVE, RADIAL, FRICTION = "drive", "radial", "friction"

OPEN = 1e-7
"""Share of the null space from which a component counts as open."""

_LOCKED = 1e-13  # of the largest singular value: below it the equations depend on one another
_STILL = 1e-12  # share of the largest rate below which a rate is rounding, and the joint at rest
_LIMIT = 30
_CLOSE = 1e-12  # share of the largest size left over where the iteration stops
_TOLERATED = 1e-11  # and where it still counts as converged: rounding
_STAGES = np.linspace(0.1, 1.0, 10)  # in which friction is raised where Newton's iteration alone fails


# -- components and passive actions -----------------------------------------------------------------------------------


class Component(NamedTuple):
    """A component of a reaction: the joint's or coupling's name, its own, its unit, and the pair that a unit of it is."""

    joint: str
    name: str
    unit: str
    pair: Pair


class Passive(NamedTuple):
    """An action `factor` times the size of a reaction: friction, or what a tooth's inclined flank adds.

    The size is the root of the sum of squares of `forms`, each a weighted sum of the joint's components by name.
    `factor` has shape (n,) and unit 1, or m for a couple.
    """

    joint: str
    name: str
    unit: str
    pair: Pair
    factor: Array
    forms: tuple[Mapping[str, float], ...]


class Unknowns(NamedTuple):
    """All components of a linkage's reactions, driving actions last, and the passive actions that follow them."""

    components: tuple[Component, ...]
    passives: tuple[Passive, ...]


def unknowns(poses: Poses, drivers: Iterable[str], forward: Array, friction: bool) -> Unknowns:
    """The components of all joints and couplings, and the driving action of every joint in `drivers`.

    forward: sign of the driver's speed, (n,); where it is 0 nothing slides and there is no friction.
    """
    linkage = poses.linkage
    names = [*(joint.name for joint in linkage.joints), *(coupling.name for coupling in linkage.couplings)]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        doubled = "two joints or couplings of that name"
        raise SceneError([Fault(f"{linkage.path}.{name}", doubled, "one") for name in twice])

    def sense(joint: Joint) -> Array:
        """Sign (n,) of a joint's speed; 0 where its rate is rounding beside the largest of its kind."""
        rates = poses.rate[:, 2:] if joint.kind == PIN else poses.rate[:, :2]
        rate = joint_rate(poses, joint)
        return np.where(np.abs(rate) > _STILL * np.abs(rates).max(initial=0.0), np.sign(rate), 0.0) * forward

    components: list[Component] = []
    passives: list[Passive] = []
    for joint in linkage.joints:
        components += _of_joint(poses, joint)
        if friction and joint.friction:
            passives += _friction(f"{linkage.path}.joints.{joint.name}", joint, effort_pair(poses, joint), sense(joint))
    for coupling in linkage.couplings:
        sliding = sense(linkage.joint(coupling.first)) if friction and coupling.friction else None
        found, more = _of_coupling(poses, coupling, sliding)
        components.append(found)
        passives += more
    driven = [linkage.joint(name) for name in drivers]
    components += [Component(j.name, DRIVE, COUPLE if j.kind == PIN else FORCE, effort_pair(poses, j)) for j in driven]
    return Unknowns(tuple(components), tuple(passives))


def _of_joint(poses: Poses, joint: Joint) -> list[Component]:
    """The components of a joint's reaction."""
    place = poses.point(joint.second, joint.second_at).value
    still, unit = np.zeros_like(place), np.ones(place.shape[1])
    bodies = index(poses, joint.first), index(poses, joint.second)
    moment = Component(joint.name, "moment", COUPLE, Pair(*bodies, still, place, unit))
    if joint.kind in (PIN, FIXED):
        axes = (("x", np.stack((unit, still[0]))), ("y", np.stack((still[0], unit))))
        pins = [Component(joint.name, name, FORCE, Pair(*bodies, axis, place, still[0])) for name, axis in axes]
        return pins if joint.kind == PIN else [*pins, moment]
    normal = Component(joint.name, "normal", FORCE, Pair(*bodies, perp(guide(poses, joint)), place, still[0]))
    return [normal, moment] if joint.kind == SLIDE else [normal]


def _friction(path: str, joint: Joint, pair: Pair, sliding: Array) -> list[Passive]:
    """Coulomb's friction of a joint, from the pair of a unit effort along its coordinate and the sense of its motion (n,).

    Raises:
        SceneError: for a fixed joint with friction, and for a pin without radius.

    """
    if joint.kind == FIXED:
        raise SceneError([Fault(f"{path}.friction", f"{joint.friction:.9g}", "none", "a fixed joint does not slide")])
    if joint.kind == PIN and not joint.radius > 0:
        raise SceneError([Fault(f"{path}.radius", f"{joint.radius:.9g} m", "the radius of a pin that has friction")])
    action = COUPLE if joint.kind == PIN else FORCE
    return [Passive(joint.name, FRICTION, action, pair, -size * sliding, sizes) for size, sizes in coulomb(joint)]


def coulomb(joint: Joint) -> list[tuple[float, tuple[Mapping[str, float], ...]]]:
    """Coulomb's friction of a joint: its size by that of the reaction it follows, and that reaction's components.

    A pin of radius r: a couple r R sin(atan mu) = r R mu/sqrt(1 + mu²). Others: mu N, for each end of a shoe with a length.

    >>> coulomb(Joint("guide", SLIDE, "frame", "ram", "O", "P", friction=0.1))
    [(0.1, ({'normal': 1.0},))]
    """
    if joint.kind == PIN:
        return [(joint.radius * joint.friction / float(np.hypot(1.0, joint.friction)), ({"x": 1.0}, {"y": 1.0}))]
    return [(joint.friction, (size,)) for size in shoe_ends(joint).values() or ({"normal": 1.0},)]


def shoe_ends(joint: Joint) -> dict[str, Mapping[str, float]]:
    """The two normals of a slide's shoe by its normal and moment: N = front + rear, M = (front - rear) L/2."""
    if joint.kind != SLIDE or not joint.length:
        return {}
    lever = 1.0 / joint.length
    return {"front": {"normal": 0.5, "moment": lever}, "rear": {"normal": 0.5, "moment": -lever}}


def _of_coupling(poses: Poses, coupling: Coupling, sliding: Array | None) -> tuple[Component, list[Passive]]:
    """The force between the two bodies of a coupling, and what its friction (if it slides) or its pressure angle adds."""
    touch = contact(poses, coupling)
    still = np.zeros(poses.q.shape)
    push = Pair(touch.first, touch.second, touch.push, touch.at, still)
    side = Pair(touch.first, touch.second, touch.aside, touch.at, still)
    if coupling.kind == CAM:
        normal = Component(coupling.name, "normal", FORCE, push)
        if sliding is None:
            return normal, []
        return normal, [Passive(coupling.name, FRICTION, FORCE, side, -coupling.friction * sliding, ({"normal": 1.0},))]
    if coupling.friction:
        path = f"{poses.linkage.path}.couplings.{coupling.name}.friction"
        raise SceneError([Fault(path, f"{coupling.friction:.9g}", "none", "at the pitch point nothing slides")])
    slant = np.full(poses.q.shape, np.tan(abs(coupling.pressure_angle)))
    inclined = Passive(coupling.name, RADIAL, FORCE, side, slant, ({"tangential": 1.0},))
    return Component(coupling.name, "tangential", FORCE, push), [inclined] if coupling.pressure_angle else []


# -- the system of equations ------------------------------------------------------------------------------------------


class Sizes(NamedTuple):
    """Sizes that passive actions follow, shape (n, passives), and how the iteration went.

    iterations: Newton steps of the slowest position; gap: what is left of s(x) - y, as a share of the largest size, (n,);
    converged: False where no solution grows out of the one without friction, (n,): the mechanism locks itself.
    """

    sizes: Array
    iterations: int
    gap: Array
    converged: Flags


class Balance(NamedTuple):
    """Components in the order of the unknowns, (components, n): NaN where friction locks, one of many values where open.

    amounts: what the passive actions come to, (passives, n); others: wrenches of all that is no reaction, passive actions
    included, (bodies, 3, n); loose: which components are open, (components, n); open: an orthonormal basis of what can be
    added to the components without a load, (n, components, redundant); residual: of the equations as a share of
    the largest load, (n,).
    """

    values: Array
    amounts: Array
    others: Array
    loose: Flags
    open: Array
    sizes: Sizes
    residual: Array


class Response(NamedTuple):
    """What the unknowns answer to k loads and to a unit of every passive action, at n positions.

    values: shape (n, components, k + passives); loose, open: which components are open, and what can be added to them
    (see `Balance`); matrix: of the equations, (n, 3 bodies, components); scales: of its rows, by which all are forces.
    """

    values: Array
    loose: Flags
    open: Array
    matrix: Array
    scales: Array


def response(poses: Poses, unknowns: Unknowns, loads: Array) -> Response:
    """Reactions and driving actions under each of k loads alone, wrenches (k, bodies, 3, n), then under passive actions.

    Equations of moments are divided by a length and unknown couples multiplied by it, so that all are forces.

    Raises:
        SceneError: for freedoms that nothing drives, and for a position where the driver has no hold on the others.

    """
    count, path = poses.q.size, poses.linkage.path
    middle = centres(poses).value
    matrix, passive = _columns(unknowns.components, middle), _columns(unknowns.passives, middle)
    right = loads[:, 1:].reshape(len(loads), -1, count).transpose(2, 1, 0)
    rows, columns = matrix.shape[1:]
    if rows > columns:
        found = f"{rows - columns} freedom(s) that nothing drives"
        raise SceneError([Fault(path, found, "as many driven joints as degrees of freedom")])
    couples = np.array([component.unit == COUPLE for component in unknowns.components])
    length = float(np.abs(matrix[:, 2::3][:, :, ~couples]).max(initial=0.0)) or 1.0
    row_scales, column_scales = np.tile((1.0, 1.0, length), rows // 3), np.where(couples, length, 1.0)
    scaled = matrix * column_scales / row_scales[:, None]
    wanted = -np.concatenate((right, passive), axis=2) / row_scales[:, None]
    if rows == columns:
        values, space = solved(scaled, wanted), np.zeros((count, columns, 0))
    else:  # unknowns of least norm, and the matrix's null space
        u, s, vh = np.linalg.svd(scaled)
        s = np.where(s > _LOCKED * s[:, :1], s, np.nan)
        values = vh[:, :rows].transpose(0, 2, 1) @ ((u.transpose(0, 2, 1) @ wanted) / s[..., None])
        space = vh[:, rows:].transpose(0, 2, 1)
    wrong = ~np.isfinite(values).all(axis=(1, 2))
    if wrong.any():
        at = f"{float(poses.q[np.argmax(wrong)]):.9g} {'m' if poses.linkage.sliding else 'rad'}"
        found = f"forces without limit where {poses.linkage.driver} stands at {at}"
        raise SceneError([Fault(path, found, "a position where the driver moves everything")])
    loose = np.linalg.norm(space, axis=2) > OPEN
    return Response(values * column_scales[:, None], loose, space, matrix, row_scales)


def balance(poses: Poses, unknowns: Unknowns, loads: Array) -> Balance:
    """All reactions and driving actions under `loads`, wrenches (bodies, 3, n) with the inertia forces among them."""
    count, passives = poses.q.size, unknowns.passives
    found = response(poses, unknowns, loads[None])
    free, pull = found.values[..., 0], found.values[..., 1:]
    factors = np.stack([one.factor for one in passives], axis=1) if passives else np.zeros((count, 0))
    sizes = friction_sizes(free, pull, factors, size_forms(poses, unknowns, found.loose))
    amounts = factors * sizes.sizes
    values = free + np.einsum("nmp,np->nm", pull, amounts)
    passive = _columns(passives, centres(poses).value)
    total = loads[1:].reshape(-1, count).T + np.einsum("nrp,np->nr", passive, amounts)
    left = np.abs((np.einsum("nrm,nm->nr", found.matrix, values) + total) / found.scales).max(axis=1)
    largest = np.abs(total / found.scales).max(axis=1)
    residual = np.divide(left, largest, out=np.zeros_like(left), where=largest > 0)
    others = np.concatenate((np.zeros((1, *loads.shape[1:])), total.T.reshape(-1, 3, count)))
    values = np.where(sizes.converged[:, None], values, np.nan)
    return Balance(values.T, amounts.T, others, found.loose.T, found.open, sizes, residual)


def _columns(parts: tuple[Component, ...] | tuple[Passive, ...], middle: Array) -> Array:
    """Wrenches of unit actions on the moving bodies, shape (n, 3 bodies, parts)."""
    found = [part.pair.on_bodies(middle)[1:].reshape(-1, middle.shape[2]) for part in parts]
    empty = np.zeros((middle.shape[2], 3 * (len(middle) - 1), 0))
    return np.stack(found).transpose(2, 1, 0) if found else empty


def size_forms(poses: Poses, unknowns: Unknowns, loose: Flags) -> Array:
    """Linear forms of the sizes that passive actions follow, (passives, 2, components); none may follow an open one."""
    index = {(c.joint, c.name): k for k, c in enumerate(unknowns.components)}
    forms = np.zeros((len(unknowns.passives), 2, len(unknowns.components)))
    faults = []
    for j, passive in enumerate(unknowns.passives):
        for k, form in enumerate(passive.forms):
            for name, weight in form.items():
                at = index[passive.joint, name]
                forms[j, k, at] = weight
                if loose[:, at].any() and np.any(passive.factor):
                    found = f"{passive.name} that follows the {name}, which redundant constraints leave open"
                    advice = "take the friction away, or the constraint that is one too many"
                    path = f"{poses.linkage.path}.{passive.joint}"
                    faults.append(Fault(path, found, "a force that the equations determine", advice))
    if faults:
        raise SceneError(dict.fromkeys(faults))
    return forms


# -- friction ---------------------------------------------------------------------------------------------------------


def friction_sizes(free: Array, response: Array, factor: Array, forms: Array) -> Sizes:
    """Sizes y with x = free + response (factor y) and y = |forms x|.

    Args:
        free: reactions without passive actions, (n, m).
        response: what a unit of each passive action adds to them, (n, m, p).
        factor: of each passive action, (n, p).
        forms: the linear forms whose root of squares is the size, (p, 2, m).

    A solution is taken only where det(1 - s' G f) > 0, as on the branch that starts at 1 without friction: past its root
    friction would have to push.

    A shoe of 0.1 m, tilted by a load of 10 N that is out of line by 0.02 m, with mu = 0.2: F = 10 + 2 mu F 0.02/0.1.

    >>> found = friction_sizes(np.array([[10.0]]), np.ones((1, 1, 1)), np.array([[0.08]]), np.array([[[1.0], [0.0]]]))
    >>> found.sizes.round(9).tolist(), found.converged.tolist()
    ([[10.869565217]], [True])

    """
    count, passives = factor.shape
    if not passives:
        return Sizes(np.zeros((count, 0)), 0, np.zeros(count), np.ones(count, dtype=bool))
    found = _newton(free, response * factor[:, None, :], forms, _sizes(free, forms))
    wrong = ~found.converged
    if not wrong.any():
        return found
    start, steps = _sizes(free[wrong], forms), found.iterations
    for share in _STAGES:
        again = _newton(free[wrong], response[wrong] * (share * factor[wrong])[:, None, :], forms, start)
        start, steps = np.where(again.converged[:, None], again.sizes, start), steps + again.iterations
    found.sizes[wrong], found.gap[wrong], found.converged[wrong] = again.sizes, again.gap, again.converged
    return found._replace(iterations=steps)


def _newton(free: Array, pull: Array, forms: Array, start: Array) -> Sizes:
    """Newton's iteration from sizes `start`, `pull` being response times factor."""
    sizes, steps, unit = start, 0, np.eye(start.shape[1])
    gap, determinant = np.full(len(free), np.inf), np.ones(len(free))
    while steps < _LIMIT and np.any(gap > _CLOSE):
        steps += 1
        parts = np.einsum("pkm,nm->npk", forms, free + np.einsum("nmp,np->nm", pull, sizes))
        size = np.linalg.norm(parts, axis=2, keepdims=True)
        along = np.divide(parts, size, out=np.zeros_like(parts), where=size > 0)
        slopes = np.einsum("npk,pkm->npm", along, forms)  # of the sizes by x; 0 where a size is 0
        matrix = unit - slopes @ pull
        determinant = np.linalg.det(matrix)
        matrix[np.abs(determinant) < 1e-14] = unit
        sizes = np.linalg.solve(matrix, np.einsum("npm,nm->np", slopes, free)[..., None])[..., 0]
        scale = np.maximum(np.abs(sizes).max(axis=1), _sizes(free, forms).max(axis=1))
        left = np.abs(_sizes(free + np.einsum("nmp,np->nm", pull, sizes), forms) - sizes).max(axis=1)
        gap = np.divide(left, scale, out=np.zeros_like(left), where=scale > 0)
    return Sizes(sizes, steps, gap, (gap <= _TOLERATED) & (determinant > 1e-14))


def _sizes(x: Array, forms: Array) -> Array:
    """|B_j x|, shape (n, p)."""
    return np.asarray(np.hypot(*np.einsum("pkm,nm->knp", forms, x)))


class Friction(NamedTuple):
    """How friction was found, and what it costs.

    moment: its share of the reduced moment M* (N m; N where the driver slides): the driving action grows by -moment.
    iterations: Newton steps of the slowest position, 0 where nothing had to be iterated; gap: relative change that the
    last one left, (n,); converged: False where friction locks the mechanism, (n,): nothing is reported there.
    lever: what the moment comes to at most if every joint is pressed with 1 N, (n,), in m (1 where the driver slides).
    """

    moment: Array
    iterations: int
    gap: Array
    converged: Flags
    lever: Array


def friction_power(poses: Poses, passives: Iterable[Passive], amounts: Array, sizes: Sizes) -> Friction:
    """Friction's power by unit speed of the driver, and how the iteration went; amounts of the passive actions, (p, n)."""
    middle = centres(poses)
    moment, lever = np.zeros(len(sizes.gap)), np.zeros(len(sizes.gap))
    for passive, amount in zip(passives, amounts, strict=True):
        if passive.name == FRICTION:
            way = np.einsum("bin,bin->n", passive.pair.on_bodies(middle.value), middle.rate)
            moment, lever = moment + amount * way, lever + np.abs(passive.factor * way)
    return Friction(moment, sizes.iterations, sizes.gap, sizes.converged, lever)
