"""A machine whose numbers are recorded: the angles at which it breaks follow with them, as closed forms or by Newton's method.

Where a plain machine proves by bounds at which angles a law switches or a place turns back, the recorded one starts from those
angles of its plain twin, the machine at the values that its numbers have now, and follows each with a fixed number of Newton's
steps. That the last one is next to nothing is a guard; so are the order of all angles and every decision at them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.recording import NAMESPACE, LOST, Recorded, Recorder
from flywheel.machine.machine import Effort, Machine
from flywheel.numerics.expressions import Expression
from flywheel.numerics.jets import Jet, jet_namespace
from flywheel.scene.scene import Scene

Array = NDArray[Any]

_STEPS = 8  # of Newton's method, from the twin's angle
_SETTLED = 1e-12  # of the cycle: the last step, at most
_AT = 1e-6  # of the cycle: how far a zero by a step of Newton's method may lie from an angle that is one
_JETS = jet_namespace(NAMESPACE)


class UnrecordedError(ValueError):
    """Why a machine cannot be followed with recorded numbers, in words."""


class RecordedMachine(Machine):
    """A machine from a scene with recorded numbers, beside the plain `twin` from the scene with their values."""

    def __init__(self, scene: Scene, twin: Machine) -> None:
        self.twin = twin
        super().__init__(scene)

    @cached_property
    def landmarks(self) -> Array:
        """The breakpoints, and what closes in on narrow features, at the same share of its smooth piece as in the twin."""
        own, plain = self.breakpoints, self.twin.breakpoints
        if own.size != plain.size:
            raise UnrecordedError("breakpoints that meet within rounding")
        inner = self.twin.landmarks[~np.isin(self.twin.landmarks, plain)]
        piece = np.searchsorted(plain, inner) - 1
        share = (inner - plain[piece]) / (plain[piece + 1] - plain[piece])
        between = own[piece] + share * (own[piece + 1] - own[piece])
        order = np.argsort(np.concatenate((plain, inner)))
        return np.concatenate((own, between))[order]

    def deciders(self, effort: Effort) -> list[Expression]:
        """The parts of a load's law at whose zeros a branch of it changes."""
        law = effort.load.law
        if not isinstance(law, Expression):
            return []
        return [part for part in (*law.switches(), *law.branch_points()) if not (part.uses_speed or part.uses_time)]

    def decided(self, effort: Effort, part: Expression, phi: Any, anchor: Any) -> Jet:
        """The value of such a part, and its slope, at a crank angle; its own branches are decided at the anchor."""
        names = self._names(effort)
        values, there = names(phi, anchor, NAMESPACE), names(anchor, anchor, np)
        found = part.evaluate(values, _JETS, there)
        return found if isinstance(found, Jet) else Jet(found, 0.0)

    def _switch_angles(self, known: Array) -> Iterator[tuple[str, float]]:
        efforts = {effort.path: effort for effort in self.efforts}
        parts = {path: self.deciders(effort) for path, effort in efforts.items()}
        for path, angle in self.twin._switch_angles(self.twin._unswitched):

            def value(part: Expression, phi: Any, path: str = path, angle: float = angle) -> tuple[Any, Any]:
                found = self.decided(efforts[path], part, phi, angle)
                return found.value, found.first

            yield path, self._followed(angle, [lambda phi, part=part: value(part, phi) for part in parts[path]])

    def _dead_centres(self, place: str, smooth: Array) -> Array:
        senses = self.twin._senses(place)
        variable = self.kinematics.variable[self.places[place].junction]

        def flow(phi: Any) -> tuple[Any, Any]:
            flows = self.kinematics.flows(phi, angle, NAMESPACE)
            return flows.gain[variable], flows.slope[variable]

        found = []
        for angle in senses.dead_centres.tolist():
            found.append(self._followed(angle, [flow]))
        return np.array(found)

    def _followed(self, angle: float, functions: list[Callable[[Any], tuple[Any, Any]]]) -> Any:
        """The zero of the one of some functions that has one at an angle now, by Newton's method from there."""
        near = _AT * self.scene.cycle
        for function in functions:
            value, slope = function(angle)
            now, steep = plain(value), plain(slope)
            if steep == 0.0 or not abs(now) <= near * abs(steep):
                continue
            if not isinstance(value, Recorded):
                return angle
            phi: Any = angle
            for _ in range(_STEPS):
                value, slope = function(phi)
                step = value / slope
                phi = phi - step
            if abs(step) <= _SETTLED * self.scene.cycle:
                return phi
        raise UnrecordedError("an angle at which a law touches a switch, or a place stands still")


def plain(number: Any) -> float:
    """The present value of a number, recorded or not."""
    return float(number.value if isinstance(number, Recorded) else number)
