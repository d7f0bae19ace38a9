"""The same flywheel on every shaft, as the rows of a table."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi

from flywheel.every_shaft import OnShaft
from flywheel.writing.digits import columns, figure

_HEAD = ("shaft", "speed, rpm", "inertia, kg m²", "GD², kg m²")
_RIM = ("radius, m", "mass, kg", "rim speed, m/s")


def table(rows: Sequence[OnShaft], digits: int = 6) -> list[str]:
    """One line a shaft under a header; radius, mass and rim speed where they are known.

    >>> from flywheel.every_shaft import on_every_shaft
    >>> shafts = on_every_shaft(8.0, {"crank": 1.0, "motor": 2.0}, pi, radius=0.5)
    >>> for line in table(shafts):
    ...     print(line)
      shaft  speed, rpm  inertia, kg m²  GD², kg m²  radius, m  mass, kg  rim speed, m/s
      crank          30               8          32        0.5        32         1.5708
      motor          60               2           8        0.5         8         3.14159

    """
    rims = any(row.radius is not None for row in rows)
    lines = [_cells(row, rims, digits) for row in rows]
    return columns(lines, _HEAD + _RIM if rims else _HEAD)


def _cells(row: OnShaft, rims: bool, digits: int) -> list[str]:
    known = [row.speed * 30 / pi, row.inertia, row.gd2]
    rim = [row.radius, row.mass, row.rim_speed] if rims else []
    return [row.shaft, *("" if value is None else figure(value, 0.0, digits) for value in (*known, *rim))]
