"""Times at which laws switch: found beforehand by interval bounds, as far as time alone decides."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flywheel.chain import Chain
from flywheel.faults import Fault, SceneError
from flywheel.formulas.expressions import Expression
from flywheel.formulas.trees import Node
from flywheel.loads import Effort

Array = NDArray[np.float64]

_WINDOW = 100.0  # turns at the machine's pace: how far ahead switches are looked for where no end is known


class SwitchingTimes:
    """The times (s) at which expressions of `t` and parameters change their branch, up to an end that may be infinite.

    `after(t)` gives the next of them, or the end of what was looked through; time stepping starts afresh there.
    """

    def __init__(self, machine: Chain, until: float) -> None:
        self.until = until
        self._laws = list(_laws(machine))
        self._window = until if np.isfinite(until) else _WINDOW * machine.scene.cycle / machine.pace
        self._seen = 0.0
        self._times: list[float] = []

    def every(self) -> list[float]:
        """All of them, before an end that is finite."""
        found = [self.after(0.0)]
        while found[-1] < self.until:
            found.append(self.after(found[-1]))
        return found[:-1]

    def after(self, t: float) -> float:
        """The first time past t to stop at."""
        if not self._laws:
            return self.until
        while not (later := [time for time in self._times if time > t]):
            end = self._seen + self._window
            self._times = [time for effort, law in self._laws for time in _roots(effort, law, self._seen, end)]
            self._times = sorted({*self._times, end})
            self._seen = end
        return min(later[0], self.until)


def _laws(machine: Chain) -> Iterator[tuple[Effort, Expression]]:
    """What decides branches by time alone, written in `phi` for `t`, so that bounds over phi serve."""
    for effort in machine.efforts:
        law = effort.load.law
        if isinstance(law, Expression) and effort.uses_time:
            for part in (*law.switches(), *law.branch_points()):
                if "t" in part.names and part.names <= {"t", *effort.constants}:
                    sign = Node("sign", (_renamed(part.tree),))
                    yield effort, Expression(part.text, sign)


def _renamed(node: Node) -> Node:
    name = "phi" if node.name == "t" else node.name
    return node._replace(name=name, args=tuple(_renamed(arg) for arg in node.args))


def _roots(effort: Effort, law: Expression, start: float, end: float) -> list[float]:
    from flywheel.formulas.intervals import Interval
    from flywheel.formulas.jets import Jet
    from flywheel.formulas.switching import SwitchingError, breakpoints

    def cells(lo: Array, hi: Array, anchor: Array) -> Mapping[str, Any]:
        return {**effort.constants, "phi": Jet(Interval(lo, hi), 1.0)}

    def values(times: Array, anchor: Array) -> Mapping[str, Any]:
        return {**effort.constants, "phi": times}

    try:
        return breakpoints(law, start, end, cells, values)
    except SwitchingError as error:
        found = f"{law.text}, which switches too often to be followed to {end:.6g} s"
        raise SceneError([Fault(effort.path, found, "an expression that can be followed", "a shorter time")]) from error
