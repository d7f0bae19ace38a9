"""Degrees of freedom: Gruebler's count, checked against the rank of the Jacobian where the linkage stands.

Source: K. J. Waldron, G. L. Kinzel, S. K. Agrawal, Kinematics, Dynamics and Design of Machinery, Wiley 2016, chapter 1.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.faults import Fault
from flywheel.linkage.description import FREEDOMS, Linkage
from flywheel.linkage.loops import Loops

Array = NDArray[np.float64]

_RANK = 1e-9  # of the greatest singular value


class Mobility(NamedTuple):
    """Freedom of a linkage at a position.

    gruebler: 3 (bodies) - sum of what joints and couplings take away; freedom: variables less the rank of their Jacobian;
    redundant: what holds the linkage more often than needed, as texts.
    """

    gruebler: int
    freedom: int
    redundant: tuple[str, ...]


def gruebler(linkage: Linkage) -> int:
    """Gruebler's degrees of freedom of a plane linkage: 3 n - sum(3 - f) - couplings, n moving bodies, f freedoms a joint.

    A pin or slide takes 2, a pin in a slot 1, a rigid joint 3, a gear pair, rolling pair or cam 1.

    >>> from flywheel.linkage.description import Joint, Link, Linkage, Point
    >>> o = Point("o")
    >>> links = tuple(Link(name) for name in ("crank", "rod", "slider"))
    >>> pairs = (("frame", "crank"), ("crank", "rod"), ("rod", "slider"))
    >>> joints = tuple(Joint(f"{a}-{b}", "pin", a, b, o, o) for a, b in pairs)
    >>> slide = Joint("guide", "slide", "frame", "slider", o, o)
    >>> gruebler(Linkage(Link("frame"), links, (*joints, slide), "frame-crank"))
    1
    """
    taken = sum(3 - FREEDOMS[joint.kind] for joint in linkage.joints)
    return 3 * len(linkage.links) - taken - len(linkage.couplings)


def mobility(loops: Loops, jacobian: Array) -> Mobility:
    """Mobility where the equations have this Jacobian, (equations, variables)."""
    equations, variables = jacobian.shape
    rank, rows = _independent(jacobian)
    redundant = [f"the turning of {joint}, which other joints hold already" for joint in loops.doubled]
    if rank < equations:
        redundant += _repeated(loops, jacobian, rows)
    return Mobility(gruebler(loops.linkage), variables - rank, tuple(redundant))


def _independent(jacobian: Array) -> tuple[int, tuple[int, ...]]:
    """Rank, and rows that span it: those with the greatest rest, one after another."""
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
    return len(rows), tuple(sorted(rows))


def _repeated(loops: Loops, jacobian: Array, rows: tuple[int, ...]) -> list[str]:
    """For every equation that follows from the others, the loops that say the same."""
    found: list[str] = []
    basis = jacobian[list(rows)]
    for row in sorted(set(range(len(jacobian))) - set(rows)):
        shares = np.linalg.lstsq(basis.T, jacobian[row], rcond=None)[0]
        others = [rows[k] for k in np.flatnonzero(np.abs(shares) > 1e-6)]
        names = dict.fromkeys([_of(loops, row), *(_of(loops, k) for k in others)])
        found.append(" repeats ".join([next(iter(names)), " and ".join(list(names)[1:]) or "itself"]))
    return list(dict.fromkeys(found))


def _of(loops: Loops, row: int) -> str:
    """What an equation stands for: the loop or the coupling."""
    closures = 2 * len(loops.closures)
    if row >= closures:
        return f"coupling {loops.linkage.couplings[row - closures].name}"
    return f"loop {' - '.join(loops.paths[row // 2])}"


def faults(loops: Loops, jacobian: Array) -> list[Fault]:
    """A fault where the driver's coordinate does not settle the position, or cannot change at all."""
    found = mobility(loops, jacobian)
    path = f"{loops.linkage.path}.joints"
    held = len(_independent(jacobian[:, 1:])[1])
    if held < loops.unknowns:
        return [_loose(loops, jacobian, found, path)]
    if found.freedom == 0:
        what = f"0 degrees of freedom (Gruebler {found.gruebler}): the driver {loops.linkage.driver} cannot move"
        advice = "take a joint away" + (f": {'; '.join(found.redundant)}" if found.redundant else "")
        return [Fault(path, what, "1 degree of freedom", advice)]
    return []


def _loose(loops: Loops, jacobian: Array, found: Mobility, path: str) -> Fault:
    """What can still move while the driver stands."""
    held = len(_independent(jacobian[:, 1:])[1])
    free = np.abs(np.linalg.svd(jacobian[:, 1:])[2][held:]).max(axis=0)
    moving = [loops.names[k + 1] for k in np.argsort(-free) if free[k] > 0.1 * free.max()]
    what = f"{found.freedom} degrees of freedom (Gruebler {found.gruebler}): with the driver held, {_few(moving)} may move"
    return Fault(path, what, "1 degree of freedom", "add a joint or a coupling, or take a body away")


def _few(names: list[str]) -> str:
    return ", ".join(names[:4]) + (" and more" if len(names) > 4 else "")
