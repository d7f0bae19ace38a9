"""The ends of a port's stroke: how far it goes, and at which angles of its mechanism it turns back."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel import mechanisms
from flywheel.faults import Fault, SceneError
from flywheel.formulas.intervals import NAMESPACE as INTERVALS
from flywheel.formulas.intervals import Interval
from flywheel.formulas.switching import SwitchingError, roots
from flywheel.mechanisms.base import Family, Ratio
from flywheel.scene import Mechanism

Array = NDArray[np.float64]

_FLAT = 1e-12  # of a stroke: what rounding may take back


class Ends(NamedTuple):
    """A port's stroke: every place where it may turn back, as coordinate psi of its mechanism and displacement x.

    Between neighbours it moves one way. psi is the mechanism's own crank angle (rad; m where the driver slides), x is in m
    or rad. `period` (rad) is that after which the rows repeat, None on a one-way stroke; `displacement` gives x at any psi.
    """

    psi: Array
    x: Array
    period: float | None
    displacement: Callable[[Array], Array]

    @property
    def low(self) -> float:
        """The least displacement."""
        return float(self.x.min())

    @property
    def high(self) -> float:
        """The greatest displacement."""
        return float(self.x.max())

    def before(self, high: bool, angle: float) -> float | None:
        """Distance (m or rad) that the port covers on the last `angle` (rad of psi) before its high or its low end.

        None where it does not move towards that end all along. An end that is reached several times counts where it is
        reached first.

        >>> yoke = Mechanism("scotch-yoke", "yoke", geometry={"crank.length": 0.1})
        >>> round(ends_of(yoke, "yoke").before(True, np.pi / 3), 12)
        0.05
        """
        psi, x = self.psi, self.x
        last = float(psi[np.argmax(x) if high else np.argmin(x)])
        first = last - angle
        if self.period is not None:
            psi, x = np.concatenate((psi[:-1] - self.period, psi)), np.concatenate((x[:-1], x))
        if first < psi[0]:
            return None
        passed = x[(psi > first) & (psi <= last)]
        way = np.diff([*self.displacement(np.array([first])), *passed]) * (1.0 if high else -1.0)
        return float(way.sum()) if (way >= -_FLAT * (self.high - self.low)).all() else None


def stroke_of(mechanism: Mechanism, port: str, parameters: Mapping[str, float] | None = None) -> tuple[float, float]:
    """Least and greatest displacement of a port over the mechanism's travel, to rounding.

    Args:
        mechanism: with the lengths that let it turn.
        port: name of one of its ports.
        parameters: SI values of names in a law's expressions.

    Raises:
        SceneError: for a mechanism that locks, or a port that stands still too long to be followed.

    >>> crank = Mechanism("slider-crank", "press", geometry={"crank.length": 0.1, "rod.length": 0.4})
    >>> [round(x, 12) for x in stroke_of(crank, "slider")]
    [0.3, 0.5]

    """
    ends = ends_of(mechanism, port, parameters)
    return ends.low, ends.high


def ends_of(mechanism: Mechanism, port: str, parameters: Mapping[str, float] | None = None) -> Ends:
    """Every place where a port may turn back: roots of dx/dpsi = 0 by interval bounds, and kinks.

    Arguments and errors are those of `stroke_of`.
    """
    family = mechanisms.build(mechanism, parameters or {})
    edges, period = _span(mechanism, family)
    try:
        inner = [root for a, b in pairwise(edges) for root in _stops(family, port, a, b)]
    except SwitchingError:
        found = f"{mechanism.name}.{port}, whose velocity changes sign too often to follow, as if it stood still"
        raise SceneError([Fault(mechanism.path, found, "a port that moves")]) from None
    psi, displacement = np.array(sorted({*edges, *inner})), partial(_displacement, family, port)
    return Ends(psi, displacement(psi), period, displacement)


def _displacement(family: Family, port: str, psi: Array) -> Array:
    """Displacement of a port (m or rad) at coordinates psi, shape (n,)."""
    x = np.asarray(family.ports[port].position(family.position(psi, np)), dtype=float)
    return np.broadcast_to(x, psi.shape)


def _span(mechanism: Mechanism, family: Family) -> tuple[list[float], float | None]:
    """Edges between which a mechanism's positions are smooth, over its stroke or until it repeats."""
    if mechanism.stroke is not None:
        first, last = mechanism.stroke
        return sorted({first, last, *(edge for edge in family.breakpoints if first < edge < last)}), None
    span = mechanism.travel if mechanism.type == "linkage" else mechanism.period
    turns = range(max(round(span / mechanism.period), 1))
    edges = {edge + turn * mechanism.period for edge in family.breakpoints for turn in turns}
    return sorted({0.0, span, *(edge for edge in edges if 0.0 < edge < span)}), span


def _stops(family: Family, port: str, a: float, b: float) -> list[float]:
    """Roots of a port's velocity ratio inside one smooth piece."""
    velocity, anchor = family.ports[port].velocity, 0.5 * (a + b)

    def enclose(lo: Array, hi: Array) -> tuple[Any, Any]:
        return _flow(family, velocity, family.position(Interval(lo, hi), INTERVALS, anchor + 0 * lo))

    def value(psi: Array) -> Any:
        return _flow(family, velocity, family.position(psi, np, anchor + 0 * psi))[0] + 0 * psi

    return roots(enclose, value, a, b)


def _flow(family: Family, velocity: str, position: Any) -> tuple[Any, Any]:
    """Ratio of a velocity to the crank's, and its slope by psi: the chain of transformers walked back to the crank."""
    if velocity == "crank":
        return 1.0, 0.0
    gain: Any = 0.0
    slope: Any = 0.0
    for term in next(item for item in family.velocities if item.name == velocity).terms:
        of, bend = _flow(family, term.source, position)
        ratio = term.ratio
        value, change = (ratio.value(position), ratio.slope(position)) if isinstance(ratio, Ratio) else (ratio, 0.0)
        gain, slope = gain + of * value, slope + bend * value + of * change
    return gain, slope
