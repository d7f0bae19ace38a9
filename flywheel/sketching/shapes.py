"""Figures that move with the bodies of a linkage."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.linkage.poses import Poses

Array = NDArray[np.float64]
Place = tuple[str, tuple[float, float]]
"""A point of a body: its name, and x, y in its own frame (m)."""

CLOSED = frozenset({"bar", "rail", "plate", "block", "fixed block", "slot", "wheel", "cam", "support", "pin", "dot", "weld"})
"""Kinds of figures whose outline closes."""


class Shape(NamedTuple):
    """A figure that stays on a place of a body and turns with a body: `outline` (2, m) is given about that place.

    kind: one of `CLOSED`, or mark, track, ground, arrow. `body` is whose it is.
    """

    kind: str
    body: str
    outline: Array
    at: Place
    turns_with: str


def placed(shape: Shape, poses: Poses) -> Array:
    """The outline in the plane (m) at every pose, shape (2, m, n): p = o + R(theta) a."""
    at = poses.point(*shape.at).value
    theta = poses.angle(shape.turns_with).value
    c, s = np.cos(theta), np.sin(theta)
    x, y = shape.outline[:, :, None]
    return np.stack((at[0] + x * c - y * s, at[1] + x * s + y * c))
