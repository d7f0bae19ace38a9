"""Common quantities of the steps of a report: figures of a sizing by their symbols, and numbers within sentences."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import NamedTuple

import numpy as np

from flywheel.numerics import cells
from flywheel.numerics.cells import Array
from flywheel.regime import turning_moment
from flywheel.regime.turning_moment import Cycle
from flywheel.report import formulas
from flywheel.report.document import Figure
from flywheel.report.formulas import Quantity
from flywheel.sizing.findings import finding
from flywheel.sizing.results import Sizing

_NO_WORK = 1e-9  # of the work exchanged: what is no more than that does no work over the cycle


def number(value: float, digits: int = formulas.DIGITS) -> str:
    """A number within a sentence, with the decimal mark of the language in use."""
    return formulas.number_shown(Quantity("", value, "", digits)).text


def quantity(value: float, unit: str, digits: int = formulas.DIGITS) -> str:
    """A number with its unit within a sentence."""
    return formulas.number_shown(Quantity("", value, unit, digits)).text


class CyclePoint(NamedTuple):
    """Point of the cycle at one crank angle: phi (rad), W (J), I* (kg m²)."""

    phi: float
    work: float
    inertia: float


class Context:
    """A sizing with the common data of its steps: the quantities of its regime by their symbols.

    `cycle` is the one along the motion, `constant` that at the constant speed of the areas (the same where no torque
    depends on speed). `panel` draws a panel of the sizing's picture by its kind.
    """

    def __init__(self, sizing: Sizing, panel: Callable[[str], Figure]) -> None:
        self.sizing, self.panel = sizing, panel
        self.scene = sizing.scene
        self.cycle = sizing.cycle
        self.constant = sizing.constant or sizing.cycle
        self.ratio = sizing.scene.flywheel_ratio
        self.eps = sizing.scene.irregularity
        self.speed, self.epsilon = self.of("speed"), self.of("irregularity")
        self.turn = Quantity("Phi", sizing.scene.cycle, "rad")
        self.at_flywheel = Quantity("i_f", self.ratio)
        self.area_speed = self.speed if sizing.cyclic is None else self.of("constant_speed")

    def of(self, key: str) -> Quantity:
        """A figure of the sizing by its key, under its own symbol."""
        one = finding(key)
        return Quantity(one.symbol, one.of(self.sizing) or 0.0, one.unit)

    @property
    def otherwise(self) -> bool:
        """True if another limit than the irregularity decides the flywheel."""
        return self.sizing.binding not in (None, "irregularity")

    def at(self, phi: float, cycle: Cycle | None = None) -> CyclePoint:
        """W and I* at a crank angle, from the cycle itself."""
        cycle = cycle or self.cycle
        assert cycle is not None
        work, variation = cycle.at(*cycle.where(np.array([phi])))
        return CyclePoint(phi, float(work[0]), float(cycle.inertia_at_start + variation[0]))

    @cached_property
    def works(self) -> Mapping[str, float]:
        """The work (J) over the cycle along the motion of every contribution to M*, by its name."""
        machine, cycle = self.sizing.machine, self.cycle
        assert machine is not None
        assert cycle is not None
        found = {name: float(cells.integral(part, cycle.mesh.half).sum()) for name, part in moments(self.sizing).items()}
        least = _NO_WORK * cycle.exchanged  # a weight that comes back does no work
        return {name: work if abs(work) > least else 0.0 for name, work in found.items()}


def moments(sizing: Sizing) -> dict[str, Array]:
    """Contributions to M* (N m) at the nodes of the cycle along the motion, by name."""
    machine, cycle = sizing.machine, sizing.cycle
    assert machine is not None
    assert cycle is not None
    mesh, omega = cycle.mesh, None
    if machine.depends_on_speed:
        omega = np.full(mesh.phi.shape, sizing.speed)
        if sizing.run is not None:
            omega = turning_moment.speed_over_cycle(cycle, sizing.speed, sizing.run, mesh.phi)
    found = machine.reduction.moments(mesh.phi, mesh.anchor, cycle.balance or 0.0, speed=omega)
    return {name: np.asarray(part + np.zeros_like(mesh.phi)) for name, part in found.items()}
