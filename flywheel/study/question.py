"""The one figure that all methods are asked for: the flywheel of a sizing, or the irregularity of an analysis."""

from __future__ import annotations

from typing import NamedTuple

from flywheel.machine.machine import Machine
from flywheel.sizing.results import Sizing

_NOTHING = 1e-13  # of the work exchanged: a fluctuation that is none


class Question(NamedTuple):
    """What a scene asks: a flywheel (kg m², on its own shaft), or with a given flywheel the irregularity.

    `scale` is what errors are relative to where the figure itself is smaller: energy_fluctuation/(eps w²) for a flywheel.
    """

    machine: Machine
    sized: bool
    scale: float

    @property
    def figure(self) -> str:
        """The figure's name."""
        return "exact flywheel" if self.sized else "irregularity"

    @property
    def unit(self) -> str:
        """Its unit."""
        return "kg m²" if self.sized else ""

    @property
    def crank(self) -> float:
        """What an inertia on the flywheel's shaft is multiplied with to stand on the crank."""
        return self.machine.scene.flywheel_ratio**2

    def error(self, found: float, true: float) -> float:
        """The relative error of an answer."""
        return abs(found - true) / max(abs(true), self.scale, 1e-300)


def question(machine: Machine, sizing: Sizing) -> Question:
    """The question of a machine's scene, of which a sizing is known."""
    scene = machine.scene
    if scene.irregularity is None:
        return Question(machine, False, 0.0)
    scale, cycle = sizing.flywheel.approximate_total or 0.0, sizing.constant or sizing.cycle
    if cycle is not None and sizing.reduced_inertia is not None:
        unit = scene.irregularity * sizing.speed**2 * scene.flywheel_ratio**2
        at_hand = max(cycle.exchanged / max(unit, 1e-300), sizing.reduced_inertia.greatest / scene.flywheel_ratio**2)
        scale = scale if scale > _NOTHING * at_hand else at_hand  # of a fluctuation that is rounding, what is at hand
    return Question(machine, True, scale)


def answer(sizing: Sizing) -> float:
    """What a sizing or an analysis says to the question: its exact flywheel, or its irregularity."""
    if sizing.scene.irregularity is not None:
        assert sizing.flywheel.exact is not None
        return sizing.flywheel.exact
    if sizing.simulation is not None:
        return sizing.simulation.irregularity
    return 0.0 if sizing.run is None else sizing.run.irregularity
