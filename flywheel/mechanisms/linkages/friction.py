"""Coulomb's friction in the joints of a linkage: its law, the iteration with the reactions that it follows, its moment.

| joint | size that friction follows | friction |
| --- | --- | --- |
| pin | resultant R of x and y | couple r R mu/sqrt(1 + mu²) (N m): the friction circle |
| slide | normal N | force mu N along the guide |
| slide with a shoe of length L | front and rear normals N/2 ± M/L at its two ends | mu (front + rear) |
| pin-in-slot | normal N | mu N along the slot |
| cam | normal N | mu N along the surface, at the contact point |

It opposes the motion of second on first; where that rests or turns back there is none: at rest it is not determined.
Without friction the reactions are x0; unit passive actions add a response G, so that

    x = x0 + G (f * s(x)),   s_j(x) = |B_j x|

with s_j the size of the reaction that passive action j follows, f_j its factor. s is homogeneous of degree one,
s = s'(x) x, so that Newton's step needs the sizes y = s alone: (1 - s' G f) y = s' x0.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.numerics.faults import Fault, SceneError
from flywheel.scene.linkage import FIXED, PIN, SLIDE, Joint

if TYPE_CHECKING:
    from flywheel.mechanisms.linkages.positions import Track
    from flywheel.mechanisms.linkages.wrenches import Pair

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

FORCE, COUPLE = "N", "N m"
FRICTION = "friction"

_STILL = 1e-12  # share of the largest rate below which a rate is rounding, and the joint at rest
_LIMIT = 30
_CLOSE = 1e-12  # share of the largest size left over where the iteration stops
_TOLERATED = 1e-11  # and where it still counts as converged: rounding
_STAGES = np.linspace(0.1, 1.0, 10)  # in which friction is raised where Newton's iteration alone fails


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


def sense(rate: Array, rates: Array, forward: Array) -> Array:
    """Sign (n,) of a joint's speed: of its rate by the driver's coordinate times that of the driver's speed, `forward`.

    0 where the rate is rounding beside the largest of `rates`, those of its kind.
    """
    return np.where(np.abs(rate) > _STILL * np.abs(rates).max(initial=0.0), np.sign(rate), 0.0) * forward


def ends(joint: Joint) -> dict[str, Mapping[str, float]]:
    """The two normals of a slide's shoe by its normal and moment: N = front + rear, M = (front - rear) L/2."""
    if joint.kind != SLIDE or not joint.length:
        return {}
    lever = 1.0 / joint.length
    return {"front": {"normal": 0.5, "moment": lever}, "rear": {"normal": 0.5, "moment": -lever}}


def of_joint(path: str, joint: Joint, pair: Pair, sliding: Array) -> list[Passive]:
    """Coulomb's friction of a joint, from the pair of a unit effort along its coordinate and the sense of its motion (n,).

    A pin of radius r: a couple r R sin(atan mu) = r R mu/sqrt(1 + mu²). Others: mu N, for each end of a shoe with a length.

    Raises:
        SceneError: for a fixed joint with friction, and for a pin without radius.

    """
    if joint.kind == FIXED:
        raise SceneError([Fault(f"{path}.friction", f"{joint.friction:.9g}", "none", "a fixed joint does not slide")])
    if joint.kind == PIN and not joint.radius > 0:
        raise SceneError([Fault(f"{path}.radius", f"{joint.radius:.9g} m", "the radius of a pin that has friction")])
    if joint.kind == PIN:
        circle = joint.radius * joint.friction / float(np.hypot(1.0, joint.friction))
        return [Passive(joint.name, FRICTION, COUPLE, pair, -circle * sliding, ({"x": 1.0}, {"y": 1.0}))]
    sizes = ends(joint).values() or ({"normal": 1.0},)
    return [Passive(joint.name, FRICTION, FORCE, pair, -joint.friction * sliding, (size,)) for size in sizes]


class Settled(NamedTuple):
    """Sizes that passive actions follow, shape (n, passives), and how the iteration went.

    iterations: Newton steps of the slowest position; gap: what is left of s(x) - y, as a share of the largest size, (n,);
    converged: False where no solution grows out of the one without friction, (n,): the mechanism locks itself.
    """

    sizes: Array
    iterations: int
    gap: Array
    converged: Flags


def settle(free: Array, response: Array, factor: Array, forms: Array) -> Settled:
    """Sizes y with x = free + response (factor y) and y = |forms x|.

    Args:
        free: reactions without passive actions, (n, m).
        response: what a unit of each passive action adds to them, (n, m, p).
        factor: of each passive action, (n, p).
        forms: the linear forms whose root of squares is the size, (p, 2, m).

    A solution is taken only where det(1 - s' G f) > 0, as on the branch that starts at 1 without friction: past its root
    friction would have to push.

    A shoe of 0.1 m, tilted by a load of 10 N that is out of line by 0.02 m, with mu = 0.2: F = 10 + 2 mu F 0.02/0.1.

    >>> found = settle(np.array([[10.0]]), np.ones((1, 1, 1)), np.array([[0.08]]), np.array([[[1.0], [0.0]]]))
    >>> found.sizes.round(9).tolist(), found.converged.tolist()
    ([[10.869565217]], [True])

    """
    count, passives = factor.shape
    settled = Settled(np.zeros((count, passives)), 0, np.zeros(count), np.ones(count, dtype=bool))
    if not passives:
        return settled
    found = _newton(free, response * factor[:, None, :], forms, _sizes(free, forms))
    wrong = ~found.converged
    if not wrong.any():
        return found
    start, steps = _sizes(free[wrong], forms), found.iterations
    for share in _STAGES:
        again = _newton(free[wrong], response[wrong] * (share * factor[wrong])[:, None, :], forms, start)
        start, steps = np.where(again.converged[:, None], again.sizes, start), steps + again.iterations
    for whole, part in zip(
        (found.sizes, found.gap, found.converged), (again.sizes, again.gap, again.converged), strict=True
    ):
        whole[wrong] = part
    return found._replace(iterations=steps)


def _newton(free: Array, pull: Array, forms: Array, start: Array) -> Settled:
    """Newton's iteration from sizes `start`, `pull` being response times factor."""
    sizes, steps = start, 0
    gap, determinant = np.full(len(free), np.inf), np.ones(len(free))
    while steps < _LIMIT and np.any(gap > _CLOSE):
        steps += 1
        x = free + np.einsum("nmp,np->nm", pull, sizes)
        slopes = _slopes(x, forms)
        matrix = np.eye(sizes.shape[1]) - slopes @ pull
        determinant = np.linalg.det(matrix)
        singular = np.abs(determinant) < 1e-14
        matrix[singular] = np.eye(sizes.shape[1])
        sizes = np.linalg.solve(matrix, np.einsum("npm,nm->np", slopes, free)[..., None])[..., 0]
        scale = np.maximum(np.abs(sizes).max(axis=1), _sizes(free, forms).max(axis=1))
        left = np.abs(_sizes(free + np.einsum("nmp,np->nm", pull, sizes), forms) - sizes).max(axis=1)
        gap = np.divide(left, scale, out=np.zeros_like(left), where=scale > 0)
    return Settled(sizes, steps, gap, (gap <= _TOLERATED) & (determinant > 1e-14))


def _sizes(x: Array, forms: Array) -> Array:
    """|B_j x|, shape (n, p)."""
    return np.asarray(np.hypot(*np.einsum("pkm,nm->knp", forms, x)))


def _slopes(x: Array, forms: Array) -> Array:
    """Derivatives of the sizes by x, shape (n, p, m); 0 where a size is 0."""
    parts = np.einsum("pkm,nm->npk", forms, x)
    size = np.linalg.norm(parts, axis=2, keepdims=True)
    unit = np.divide(parts, size, out=np.zeros_like(parts), where=size > 0)
    return np.asarray(np.einsum("npk,pkm->npm", unit, forms))


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


def cost(passives: Iterable[Passive], amounts: Array, settled: Settled, middle: Track) -> Friction:
    """Friction's power by unit speed of the driver, and how the iteration went.

    amounts: of the passive actions, (passives, n); middle: centres of mass of all bodies.
    """
    moment, lever = np.zeros(len(settled.gap)), np.zeros(len(settled.gap))
    for passive, amount in zip(passives, amounts, strict=True):
        if passive.name == FRICTION:
            way = np.einsum("bin,bin->n", passive.pair.on_bodies(middle.value), middle.rate)
            moment, lever = moment + amount * way, lever + np.abs(passive.factor * way)
    return Friction(moment, settled.iterations, settled.gap, settled.converged, lever)
