"""Lengths of a toggle clamp, and where in its stroke it locks or comes so near to it that cells must be short."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import chain
from math import asin, cos, hypot, inf, pi, sin, sqrt
from typing import NamedTuple

from flywheel.faults import Fault
from flywheel.mechanisms.limits import TOUCH, above_one, exceeds, graded
from flywheel.scene import Mechanism

Stroke = tuple[float, float]


class Bars(NamedTuple):
    """Lengths (m), angle (rad) and assembly of a toggle clamp.

    `side` is +1 where the coupler's pin on the bell crank lies left of the line from pivot to block, -1 right. `ahead`
    is +1 where the platen lies ahead of the rod's pin on the bell crank, -1 behind.
    """

    height: float
    drive: float
    clamp: float
    angle: float
    coupler: float
    rod: float
    side: int
    ahead: int


def bars(mechanism: Mechanism) -> Bars:
    """Lengths, angle and assembly of a toggle clamp."""
    geometry, assembly = mechanism.geometry, mechanism.assembly
    return Bars(
        geometry["frame.height"],
        geometry["bell_crank.drive_length"],
        geometry["bell_crank.clamp_length"],
        geometry["bell_crank.angle"],
        geometry["coupler.length"],
        geometry["rod.length"],
        -1 if assembly.startswith("crossed") else 1,
        -1 if assembly.endswith("-behind") else 1,
    )


def rounded(mechanism: Mechanism) -> Bars:
    """The same as floats, which limits are found with whatever the numbers of the geometry."""
    return bars(replace(mechanism, geometry={name: float(value) for name, value in mechanism.geometry.items()}))


def _folds(lengths: Bars) -> list[float]:
    """Displacements (m) at which drive arm and coupler lie on one line, folded or stretched."""
    a1, a2, a3 = lengths.height, lengths.drive, lengths.coupler
    reaches = [sqrt(max(0.0, (D - a1) * (D + a1))) for D in (abs(a2 - a3), a2 + a3) if not exceeds(a1, D)]
    return sorted({sign * reach for reach in reaches for sign in (1, -1)})


def _crossings(lengths: Bars) -> Iterator[tuple[float, float]]:
    """Where the rod stands across the platen's line, or most nearly so if a6 > a5: displacement (m) and d(theta2)/dpsi."""
    a1, a2, a5, alpha, a3, a6, side, _ = lengths
    steep = asin(min(1.0, a6 / a5))
    for theta5 in (steep, -steep, pi - steep, steep - pi)[: 4 if a6 < a5 else 2]:
        along, rise = a2 * cos(theta5 - alpha - pi), a1 - a2 * sin(theta5 - alpha - pi)
        if abs(rise) > a3:
            continue
        for run in (sqrt((a3 - rise) * (a3 + rise)), -sqrt((a3 - rise) * (a3 + rise))):
            area = along * rise - (a1 - rise) * run  # of drive arm and coupler, doubled; its sign is the assembly's
            if side * area < 0:
                yield -(along + run), -run / area


def breakpoints(lengths: Bars, stroke: Stroke | None) -> tuple[float, ...]:
    """Displacements (m) inside the stroke where cells shorten, because a lock is near its ends or hovers above it."""
    if stroke is None:
        return ()
    start, end = sorted(stroke)
    a1, uneven = lengths.height, abs(lengths.drive - lengths.coupler)
    near = [(psi, 0.0) for psi in _folds(lengths)]
    near += [(0.0, sqrt((a1 - uneven) * (a1 + uneven)))] if a1 > uneven else []
    upright = above_one(lengths.rod / lengths.clamp)
    near += [(psi, upright / abs(rate) if rate else inf) for psi, rate in _crossings(lengths)]
    spots = chain(*(graded(psi, _distance(psi, above, start, end), end - start) for psi, above in near))
    return tuple(sorted({psi for psi in spots if start < psi < end}))


def _distance(psi: float, above: float, start: float, end: float) -> float:
    """Distance (m) of a singularity from the stroke: `above` it, or beyond an end."""
    return hypot(max(start - psi, psi - end, 0.0), above)


def coupler_faults(lengths: Bars, stroke: Stroke, path: str) -> list[Fault]:
    """Drive arm and coupler must reach the block, and not lie on one line, all along the stroke."""
    start, end = sorted(stroke)
    height, drive, coupler = lengths.height, lengths.drive, lengths.coupler
    far, near = hypot(height, max(-start, end)), hypot(height, max(start, -end, 0.0))
    if exceeds(drive + coupler, far) and exceeds(near + min(drive, coupler), max(drive, coupler)):
        return []
    places = _within(_folds(lengths), start, end)
    least, most = max(far - drive, drive - near), drive + near
    if exceeds(most, least):
        return [_lock(f"{path}.coupler.length", coupler, f"between {least:.9g} and {most:.9g} m", places)]
    return [_lock(f"{path}.bell_crank.drive_length", drive, f"more than {(far - near) / 2:.9g} m", places)]


def rod_faults(lengths: Bars, stroke: Stroke, path: str, height: float) -> list[Fault]:
    """A rod longer than the clamp arm always reaches; another locks where it stands across.

    `height` (m) is that of the rod's pin above the platen's line at the lower end of the stroke.
    """
    if exceeds(lengths.rod, lengths.clamp):
        return []
    places = _within((psi for psi, _ in _crossings(lengths)), *sorted(stroke))
    if not places and exceeds(lengths.rod, abs(height)):
        return []
    expected = f"a rod longer than bell_crank.clamp_length = {lengths.clamp:.9g} m"
    return [_lock(f"{path}.rod.length", lengths.rod, expected, places)]


def _within(places: Iterable[float], start: float, end: float) -> list[float]:
    """The displacements (m) that lie in the stroke, ends included, ascending."""
    slack = TOUCH * max(abs(start), abs(end))
    return sorted(psi for psi in places if start - slack <= psi <= end + slack)


def _lock(path: str, length: float, expected: str, places: list[float]) -> Fault:
    """The fault of a length (m) with which the clamp locks, naming the displacements (m) where it does."""
    listed = " and ".join(f"{psi:.6g}" for psi in places)
    where = f"the clamp locks where its block is at {listed} m" if listed else "it closes nowhere in the stroke"
    return Fault(path, f"{length:.9g} m", expected, where)
