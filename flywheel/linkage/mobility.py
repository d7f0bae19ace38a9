"""Degrees of freedom: Gruebler's count, checked against the rank of the Jacobian where the linkage stands.

Source: K. J. Waldron, G. L. Kinzel, S. K. Agrawal, Kinematics, Dynamics and Design of Machinery, Wiley 2016, chapter 1.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.faults import Fault
from flywheel.linkage.description import FREEDOMS, PIN, Linkage
from flywheel.linkage.loops import Loops

Array = NDArray[np.float64]

_RANK = 1e-9  # of the greatest singular value
_FLAT = 1e-7  # of the longest bar: how nearly bars must be in line, or alike
PARALLELOGRAM, KITE = "a parallelogram", "a kite"
CHANGE_POINT = "a four-bar whose shortest and longest bars are together as long as the others"


class FourBar(NamedTuple):
    """Four bars in a ring: what they are called, and their bodies in order."""

    kind: str
    bodies: tuple[str, ...]


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


def change_point_four_bar(linkage: Linkage, pins: Mapping[str, complex]) -> FourBar | None:
    """Four bars pinned in a ring that lie in line, where Grashof's lengths s + l = p + q let them; None if there are none.

    Args:
        linkage: whose pins are looked at.
        pins: where each pin stands, by its name, m.

    """
    at = {joint.name: pins[joint.name] for joint in linkage.joints if joint.kind == PIN}
    ends: dict[str, list[tuple[str, str]]] = {}
    for joint in linkage.joints:
        if joint.name in at:
            ends.setdefault(joint.first, []).append((joint.second, joint.name))
            ends.setdefault(joint.second, []).append((joint.first, joint.name))
    for start in ends:
        for bodies, names in _rings(ends, start):
            corners = np.array([at[name] for name in names])
            bars = np.roll(corners, 1) - corners  # of the bodies in their order
            sides, line = np.abs(bars), bars[np.argmax(np.abs(bars))]
            longest, ordered = float(sides.max()), np.sort(sides)
            flat = np.abs((bars * np.conj(line)).imag).max() <= _FLAT * longest**2
            if flat and ordered[0] > _FLAT * longest and abs(ordered @ [1.0, -1.0, -1.0, 1.0]) <= _FLAT * longest:
                return FourBar(_kind(sides), bodies)
    return None


def _rings(ends: Mapping[str, list[tuple[str, str]]], first: str) -> Iterator[tuple[tuple[str, ...], tuple[str, ...]]]:
    """Rings of four bodies that begin with one, and their pins: pin k joins body k to the next."""
    for second, a in ends[first]:
        for third, b in ends[second]:
            for fourth, c in ends[third]:
                closing = [d for body, d in ends[fourth] if body == first]
                if len({first, second, third, fourth}) == 4 and closing:
                    yield (first, second, third, fourth), (a, b, c, closing[0])


def _kind(sides: Array) -> str:
    """What a four-bar whose bars are that long, in order, is called."""
    gaps = np.abs(sides[:, None] - sides) <= _FLAT * sides.max()
    if gaps[0, 2] and gaps[1, 3]:
        return PARALLELOGRAM
    if (gaps[0, 1] and gaps[2, 3]) or (gaps[0, 3] and gaps[1, 2]):
        return KITE
    return CHANGE_POINT


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
        found.append(
            " repeats ".join([next(iter(names)), " and ".join(list(names)[1:]) or "what keeps its bodies parallel"])
        )
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
