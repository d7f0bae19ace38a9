"""A machine with recorded numbers: the angles at which it breaks follow with them, by closed forms or by Newton's method.

Where a plain machine proves by bounds at which angles a law switches or a place turns back, the recorded one starts from
those angles of its plain twin, the machine at the values that its numbers have now, and follows each by a fixed number of
Newton's steps. That the last step is next to nothing is a guard; so are the order of all angles, and every decision there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.recording import NAMESPACE, Recorded
from flywheel.machine.machine import Effort, Machine
from flywheel.numerics.expressions import Expression
from flywheel.numerics.jets import Jet, jet_namespace
from flywheel.scene.scene import Scene

Array = NDArray[Any]
Function = Callable[[Any], tuple[Any, Any]]
"""A value and its slope at a crank angle."""

_STEPS = 8  # of Newton's method, from the twin's angle
_SETTLED = 1e-12  # of the cycle: the last step, at most
_NEAR = 1e-6  # of the cycle: how far off a step of Newton's method may see the zero that an angle is
_JETS = jet_namespace(NAMESPACE)


class UnrecordedError(ValueError):
    """Why a machine cannot be followed with recorded numbers, in words."""


class RecordedMachine(Machine):
    """A machine from a scene with recorded numbers, beside its plain `twin` from the scene with their values."""

    def __init__(self, scene: Scene, twin: Machine) -> None:
        self.twin = twin
        super().__init__(scene)

    @cached_property
    def landmarks(self) -> Array:
        """The breakpoints, and what closes in on narrow features, at the same share of its smooth piece as in the twin."""
        own, plain = self.breakpoints, self.twin.breakpoints
        if own.size != plain.size:
            raise UnrecordedError("angles at which loads break meet within rounding")
        inner = self.twin.landmarks[~np.isin(self.twin.landmarks, plain)]
        piece = np.searchsorted(plain, inner) - 1
        share = (inner - plain[piece]) / (plain[piece + 1] - plain[piece])
        between = own[piece] + share * (own[piece + 1] - own[piece])
        return np.concatenate((own, between))[np.argsort(np.concatenate((plain, inner)))]

    def decided(self, effort: Effort, part: Expression, phi: Any, anchor: Any) -> Jet:
        """The value, and its slope, of what decides a branch of a load's law; its own branches are decided at the anchor."""
        names = self._names(effort)
        found = part.evaluate(names(phi, anchor, NAMESPACE), _JETS, names(anchor, anchor, np))
        return found if isinstance(found, Jet) else Jet(found, 0.0)

    def named(self, effort: Effort, phi: Any, anchor: Any) -> dict[str, Any]:
        """What the names of a load's expression stand for at a crank angle."""
        law = effort.load.law
        if not isinstance(law, Expression):
            return {}
        found = self._names(effort)(phi, anchor, NAMESPACE)
        return {name: value.value if isinstance(value, Jet) else value for name, value in found.items() if name in law.names}

    def _switch_angles(self, known: Array) -> Iterator[tuple[str, float]]:
        efforts = {effort.path: effort for effort in self.efforts}

        def decider(path: str, part: Expression, anchor: float, phi: Any) -> tuple[Any, Any]:
            found = self.decided(efforts[path], part, phi, anchor)
            return found.value, found.first

        for path, angle in self.twin._switch_angles(self.twin._unswitched):
            parts = deciders(efforts[path])
            yield path, self._followed(angle, [partial(decider, path, part, angle) for part in parts])

    def _dead_centres(self, place: str, smooth: Array) -> Array:
        variable = self.kinematics.variable[self.places[place].junction]

        def flow(anchor: float, phi: Any) -> tuple[Any, Any]:
            flows = self.kinematics.flows(phi, anchor, NAMESPACE)
            return flows.gain[variable], flows.slope[variable]

        angles = self.twin._senses(place).dead_centres.tolist()
        return np.array([self._followed(angle, [partial(flow, angle)]) for angle in angles])

    def _followed(self, angle: float, functions: list[Function]) -> Any:
        """The zero that one of some functions has at an angle now, by Newton's method from there."""
        near, found = _NEAR * self.scene.cycle, [function(angle) for function in functions]
        if not any(isinstance(value, Recorded) for value, _ in found):
            return angle
        for function, (value, slope) in zip(functions, found, strict=True):
            now, steep = abs(plain(value)), abs(plain(slope))
            if steep == 0.0 or not now <= near * steep:
                continue
            if not isinstance(value, Recorded):
                return angle
            phi: Any = angle
            step: Any = 0.0
            for _ in range(_STEPS):
                value, slope = function(phi)
                step = value / slope
                phi = phi - step
            settled = _SETTLED * self.scene.cycle
            if -settled <= step <= settled:
                return phi
        raise UnrecordedError("an angle at which a law only touches its switch, or a place only stands still")


def deciders(effort: Effort) -> list[Expression]:
    """The parts of a load's law at whose zeros a branch of it changes, as far as position decides it."""
    law = effort.load.law
    if not isinstance(law, Expression):
        return []
    return [part for part in (*law.switches(), *law.branch_points()) if not (part.uses_speed or part.uses_time)]


def plain(number: Any) -> float:
    """The present value of a number, recorded or not."""
    return float(number.value if isinstance(number, Recorded) else number)
