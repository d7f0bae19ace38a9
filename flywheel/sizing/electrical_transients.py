"""What the fluxes of a two-axis induction motor make of its figures, and of those that its static curve would give.

The static curve is that of the same circuit with fluxes that follow the speed at once. Whether that is good enough is
measured: the machine is analysed with it, too, and the figures stand side by side.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bondgraph.records import NamedTuple
from flywheel.numerics import cells
from flywheel.numerics.cells import ROUNDING, Array, Cells
from flywheel.numerics.faults import SceneError
from flywheel.regime.turning_moment import Run

if TYPE_CHECKING:
    from flywheel.components.motors import TwoAxisInduction
    from flywheel.sizing.results import MotorShaft, Sizing

MATTERS = 0.01
"""Share by which a figure must differ from that of the static curve for the page to say that the fluxes matter."""


def states_on(run: Run, mesh: Cells) -> tuple[Array, ...]:
    """A motor's own states along the motion, at the nodes of another mesh."""
    if run.along is None or run.cycle is None:
        return ()
    cell, t = cells.located(run.cycle.mesh, mesh.phi.ravel())
    return tuple(cells.value(cells.fit(row)[cell], t).reshape(mesh.phi.shape) for row in run.along)


def heats_by_fluxes(motor: TwoAxisInduction, shaft: MotorShaft) -> dict[str, Any]:
    """Line current and heats of rotor and stator by the fluxes, on the mean over time, with relative errors.

    What the fluxes are off, by at most e each, makes 2 sqrt(3/2 r Q) k e of a heat Q, with k e the error of a current.
    """
    circuit, run = motor.circuit, shaft.run
    assert circuit is not None

    def of_rotor(mesh: Cells, omega: Array) -> tuple[Array, Array]:
        return np.asarray(circuit.rotor_heat(states_on(run, mesh))), np.zeros_like(omega)

    def of_stator(mesh: Cells, omega: Array) -> tuple[Array, Array]:
        return np.asarray(circuit.stator_heat(states_on(run, mesh))), np.zeros_like(omega)

    off = 2.0 * (max(run.states_error, default=0.0) + 8 * ROUNDING * circuit.scales[0])
    by_flux = (circuit.of_rotor + circuit.of_shared, circuit.of_stator + circuit.of_shared)
    found, errors = dict[str, Any](), dict[str, float]()
    rows = zip((of_rotor, of_stator), (circuit.rotor_resistance, circuit.stator_resistance), by_flux, strict=True)
    for name, (heat, resistance, gain) in zip(("rotor_heat", "stator_heat"), rows, strict=True):
        mean, error, mesh = shaft.mean_over_time(heat)
        own = 2.0 * float(np.sqrt(1.5 * resistance * mean)) * gain * off
        found[name], errors[name] = mean, (error + own) / max(mean, 1e-300)
    rated = float(motor.rotor_heat(motor.speed))
    found["rotor_heat_share"] = found["rotor_heat"] / rated
    errors["rotor_heat_share"] = errors["rotor_heat"] + 8 * ROUNDING / motor.rated_slip
    current = cells.fit(np.asarray(circuit.current(0.0, states_on(run, mesh))))
    found["current_rms"] = float(np.sqrt(found["stator_heat"] / (3.0 * circuit.stator_resistance)))
    found["current_peak"] = cells.greatest(current)
    errors["current_rms"] = errors["stator_heat"]
    errors["current_peak"] = (float(cells.tails(current).max()) + by_flux[1] * off) / max(found["current_peak"], 1e-300)
    return {**found, "errors": errors}


class Beside(NamedTuple):
    """A figure by the fluxes, and by the static curve of the same circuit."""

    two_axis: float
    static: float

    @property
    def difference(self) -> float:
        """By which share the first differs from the second."""
        return self.two_axis / self.static - 1.0 if self.static else 0.0


class ElectricalTransients(NamedTuple):
    """Figures with the fluxes as states beside those of the static curve, with the same flywheel.

    `greatest_torque` is the motor's (N m, on its shaft), `rotor_heat` the mean over time (W).
    """

    irregularity: Beside
    greatest_torque: Beside
    rotor_heat: Beside

    @property
    def matters(self) -> bool:
        """Whether a figure differs by more than a hundredth."""
        return any(abs(one.difference) > MATTERS for one in self)

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {name: {**one._asdict(), "difference": one.difference} for name, one in self._asdict().items()}


def electrical_transients(sizing: Sizing) -> ElectricalTransients | None:
    """The same machine and flywheel with the static curve, side by side; None for other motors, and without a motion."""
    from flywheel.components.motors import TwoAxisInduction  # only machines with a motor pay for it
    from flywheel.sizing.sizing import size

    scene, run, motor = sizing.scene, sizing.run, sizing.scene.motor
    if not isinstance(motor, TwoAxisInduction) or motor.circuit is None or run is None or scene.drive is None:
        return None
    given = run.inertia / scene.flywheel_ratio**2
    try:
        other = size(replace(scene, motor=motor.static, irregularity=None, inertia=given, limits={}), simulate=False)
    except SceneError:
        return None
    if other.run is None or other.energy is None or sizing.energy is None:
        return None
    ratio = scene.shafts[scene.drive.on]
    torques = [cells.greatest(cells.fit(one.drive)) / ratio if one.drive is not None else 0.0 for one in (run, other.run)]
    return ElectricalTransients(
        Beside(run.irregularity, other.run.irregularity),
        Beside(*torques),
        Beside(sizing.energy.rotor_heat or 0.0, other.energy.rotor_heat or 0.0),
    )
