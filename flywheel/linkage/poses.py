"""Where every body of a linkage stands, and its influence coefficients."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.arguments import known, shown
from flywheel.faults import Fault, SceneError
from flywheel.linkage.description import Linkage, Point

Array = NDArray[np.float64]


class Track(NamedTuple):
    """Positions of a point or a joint's coordinate, with first and second derivative by the driver's coordinate."""

    value: Array
    rate: Array
    slope: Array


class Poses(NamedTuple):
    """Poses of every body of `linkage.names` (the frame first) at coordinates `q` of the driver, shape (n,).

    value, rate, slope: shape (bodies, 3, n): x, y (m) of the origin of the body's own frame and its angle (rad), then
    their first and second derivatives by q (the influence coefficients g and g').
    """

    linkage: Linkage
    q: Array
    value: Array
    rate: Array
    slope: Array

    def angle(self, body: str) -> Track:
        """A body's angle, g, g'; SceneError for a body that there is not."""
        k = self._index(body)
        return Track(self.value[k, 2], self.rate[k, 2], self.slope[k, 2])

    def point(self, body: str, at: Point | tuple[float, float]) -> Track:
        """A point of a body (in the body's frame, m), as arrays of shape (2, n).

        p = o + R(theta) a;  p' = o' + theta' R a_perp;  p'' = o'' + theta'' R a_perp - theta'² R a.
        """
        if isinstance(at, str) or np.size(at) < 2:
            raise SceneError([Fault("at", shown(at), "a Point, or a place (x, y) in m")])
        a, b = at[-2:]
        k = self._index(body)
        x, y, theta = self.value[k]
        c, s = np.cos(theta), np.sin(theta)
        arm = np.stack((a * c - b * s, a * s + b * c))
        across = np.stack((-arm[1], arm[0]))
        turn, turning = self.rate[k, 2], self.slope[k, 2]
        return Track(
            np.stack((x, y)) + arm,
            self.rate[k, :2] + turn * across,
            self.slope[k, :2] + turning * across - turn**2 * arm,
        )

    def centre(self, body: str) -> Track:
        """A body's centre of mass."""
        k = self._index(body)
        return self.point(body, self.linkage.links[k - 1].com if k else self.linkage.ground.com)

    def _index(self, body: str) -> int:
        return known("body", body, {name: k for k, name in enumerate(self.linkage.names)})
