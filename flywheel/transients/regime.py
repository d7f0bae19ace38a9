"""The steady regime as transients need it: its mean speed, the speed at any angle, and the time along the cycle."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel import piecewise, steady
from flywheel.faults import Fault, SceneError
from flywheel.machine import Machine
from flywheel.results import Sizing
from flywheel.sizing import size

Array = NDArray[np.float64]


class Regime(NamedTuple):
    """A steady cycle: its mean speed over time (rad/s), its period (s), and the analysis that it comes from."""

    speed: float
    period: float
    sizing: Sizing


def regime_of(machine: Machine, inertia: float) -> Regime:
    """The steady regime of a machine with a flywheel of some inertia (kg m² at its own shaft).

    Raises SceneError where there is none.
    """
    scene = replace(machine.scene, inertia=inertia, irregularity=None)
    sizing = size(scene, simulate=False)
    found = sizing.simulation
    if found is None or found.period is None or found.speed_time_mean is None:
        raise SceneError([Fault("regime", "a machine whose steady motion has no period", "one that has inertia")])
    return Regime(found.speed_time_mean, found.period, sizing)


def speed_at(sizing: Sizing, phi: ArrayLike) -> Array:
    """Crank speed (rad/s) of the steady cycle at crank angles phi (rad)."""
    cycle, run = sizing.cycle, sizing.run
    if cycle is None or run is None:
        raise SceneError([Fault("regime", "a sizing without a steady motion", "a machine that has inertia")])
    return steady.speed_over_cycle(cycle, sizing.speed, run, np.asarray(phi, dtype=float) % sizing.scene.cycle)


def time_along(sizing: Sizing, phi: ArrayLike) -> Array:
    """Time (s) since phi = 0 along the steady cycle: t = integral of dphi/omega from 0 to phi.

    Args:
        sizing: of a scene, with its steady motion.
        phi: crank angles, rad, any shape; beyond a cycle, whole periods are added.

    Raises:
        SceneError: for a sizing that has no steady motion.

    Quadrature on the cells of the sizing, with 1/omega as a Chebyshev series on each, halved where that is not enough.
    Source: the course's time along the cycle, t = t0 + integral of dphi/omega.

    >>> import flywheel
    >>> scene = flywheel.load({"load": [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}],
    ...                        "drive": {"torque": "balance"}, "regime": {"speed": 10}, "flywheel": {"inertia": 50}})
    >>> sizing = flywheel.size(scene, simulate=False)
    >>> half = float(time_along(sizing, np.pi))  # a speed that falls evenly: from w + d to w - d, and back
    >>> abs(half / sizing.simulation.period - 0.5) < 1e-12
    True

    """
    angles = np.asarray(phi, dtype=float)
    speed_at(sizing, 0.0)
    assert sizing.cycle is not None
    turns = np.floor(angles / sizing.scene.cycle)
    mesh = piecewise.cells(_fine_edges(sizing))
    series = piecewise.fit(1.0 / speed_at(sizing, mesh.phi))
    rising = piecewise.antiderivative(series, mesh.half)
    start = piecewise.accumulated(rising)
    within = angles - turns * sizing.scene.cycle
    cell, t = piecewise.located(mesh, within)
    local = (rising[cell] * piecewise.basis(t)).sum(axis=-1)
    return np.asarray(turns * start[-1] + start[cell] + local)


def _fine_edges(sizing: Sizing) -> Array:
    """Cells on which 1/omega is a polynomial, to what the sizing asks."""
    assert sizing.cycle is not None
    edges = sizing.cycle.mesh.edges
    for _ in range(20):
        mesh = piecewise.cells(edges)
        pace = 1.0 / speed_at(sizing, mesh.phi)
        shares = piecewise.tails(piecewise.fit(pace)) * mesh.half[:, 0] / float(piecewise.integral(pace, mesh.half).sum())
        chosen = shares > 0.1 * sizing.rtol / shares.size
        if not chosen.any():
            break
        edges = piecewise.bisected(edges, chosen)
    return edges
