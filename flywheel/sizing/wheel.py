"""The wheel that a sizing asks to be built: chosen for its inertia and speed, and what it does to the machine as built."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flywheel.components.wheels import ARMS, LIGHTEST, MEAN, WheelAsked, choose
from flywheel.numerics import cells
from flywheel.regime import steady_motion
from flywheel.regime.results import Built, Sizing
from flywheel.regime.steady_motion import NoMotionError, Run

Array = NDArray[np.float64]


def with_wheel(sizing: Sizing) -> Sizing:
    """The sizing with the wheel that its scene asks for, and the irregularity that this wheel gives as it is built.

    The wheel carries the exact inertia (or the given one), at the greatest speed of its shaft unless the scene says the
    mean. Where no torque is given for its arms, they pass on what accelerates it: J times the greatest acceleration.
    """
    scene = sizing.scene
    asked, needed = scene.wheel, scene.inertia if scene.inertia is not None else sizing.flywheel.exact
    if asked is None:
        return sizing
    if not needed:
        return replace(sizing, messages=(*sizing.messages, "no wheel is chosen, as no flywheel is needed"))
    ratio, (mean, greatest) = scene.flywheel_ratio, _speeds(sizing)
    asked = _with_torque(asked, sizing, needed)
    wheel = choose(needed, ratio * (mean if asked.at == MEAN else greatest), asked)
    irregularity, error = _as_built(sizing, wheel.inertia)
    built = Built(wheel, irregularity, error, None if wheel.body.arms is None else asked.torque)
    return replace(sizing, built=built, messages=(*sizing.messages, *wheel.warnings))


def _speeds(sizing: Sizing) -> tuple[float, float]:
    """Mean of extremes and greatest speed of the crank (rad/s)."""
    if sizing.run is not None:
        return sizing.speed, sizing.run.speed_max
    eps = sizing.simulation.irregularity if sizing.simulation is not None else sizing.scene.irregularity or 0.0
    return sizing.speed, sizing.speed * (1 + eps / 2)


def _with_torque(asked: WheelAsked, sizing: Sizing, inertia: float) -> WheelAsked:
    """What is asked, with the greatest torque between hub and rim (N m)."""
    hub = asked.bore is not None or asked.hub_diameter is not None
    armed = asked.shape == ARMS or (asked.shape == LIGHTEST and hub)
    if not armed or asked.torque is not None or sizing.run is None or sizing.cycle is None:
        return asked
    return asked._replace(torque=inertia * sizing.scene.flywheel_ratio * _greatest_acceleration(sizing, sizing.run))


def _greatest_acceleration(sizing: Sizing, run: Run) -> float:
    """The greatest |alpha| of the crank over the cycle (rad/s²), from (M* - ½ omega² dI*/dphi)/(J + I*)."""
    cycle = run.cycle or sizing.cycle
    assert cycle is not None
    mesh = cycle.mesh
    omega = steady_motion.speed_over_cycle(cycle, sizing.speed, run, mesh.phi.ravel()).reshape(mesh.phi.shape)
    moment, slope, inertia = cycle.series @ cells.basis(cells.NODES, cells.ORDER).T
    series = cells.fit((moment - 0.5 * slope * omega**2) / (run.inertia + inertia))
    return max(cells.greatest(series), cells.greatest(-series))


def _as_built(sizing: Sizing, inertia: float) -> tuple[float | None, float]:
    """The irregularity with a wheel of some inertia (kg m², at its own shaft), and its relative error."""
    scene = sizing.scene
    on_crank = inertia * scene.flywheel_ratio**2
    if sizing.cycle is None:
        return sizing.energy_fluctuation / (on_crank * sizing.speed**2), sizing.error.work or 0.0
    try:
        motion = _motion(sizing, on_crank)
    except NoMotionError:
        return None, 0.0
    return motion.irregularity, motion.error


def _motion(sizing: Sizing, on_crank: float) -> Run:
    assert sizing.cycle is not None
    if sizing.cyclic is None:
        return steady_motion.run(sizing.cycle, sizing.speed, on_crank)
    from flywheel.sizing.speed_dependent import with_flywheel  # only machines that set their own speed pay for it

    return with_flywheel(sizing, on_crank).run
