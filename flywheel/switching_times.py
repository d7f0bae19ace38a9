"""Times at which laws switch, or vary too fast for a step: found beforehand by interval bounds, as far as time decides."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flywheel.chain import Chain
from flywheel.faults import Fault, SceneError
from flywheel.formulas.expressions import Expression
from flywheel.formulas.trees import Node, written
from flywheel.loads import Effort

Array = NDArray[np.float64]

_WINDOW = 100.0  # turns at the machine's pace: how far ahead switches are looked for where no end is known


class SwitchingTimes:
    """The times (s) at which expressions of `t` and parameters change their branch, up to an end that may be infinite.

    Where one is steep, as a short pulse is, there are more, so close that no step passes it without seeing it.
    `after(t)` gives the next of them, or the end of what was looked through; time stepping starts afresh there.
    """

    def __init__(self, machine: Chain, until: float) -> None:
        self.until = until
        self._laws, self._smooth = list(_laws(machine)), list(_smooth(machine))
        self._window = min(until, _WINDOW * machine.scene.cycle / machine.pace)
        self._seen = 0.0
        self._times: list[float] = []

    def every(self) -> list[float]:
        """All of them, before an end that is finite; looked for in one go, so that no window's end is among them."""
        self._window = self.until
        found = [self.after(0.0)]
        while found[-1] < self.until:
            found.append(self.after(found[-1]))
        return found[:-1]

    def after(self, t: float) -> float:
        """The first time past t to stop at."""
        if not (self._laws or self._smooth):
            return self.until
        while not (later := [time for time in self._times if time > t]):
            end = self._seen + self._window
            roots = {time for effort, law in self._laws for time in _roots(effort, law, self._seen, end)}
            edges = np.array(sorted({self._seen, *roots, end}))
            steep = {time for effort, law in self._smooth for time in _steep(effort, law, edges)}
            self._times = sorted({*roots, *steep, end})
            self._seen = end
        return min(later[0], self.until)


def _laws(machine: Chain) -> Iterator[tuple[Effort, Expression]]:
    """What decides branches by time alone, written in `phi` for `t`, so that bounds over phi serve."""
    for effort in machine.efforts:
        law = effort.load.law
        if isinstance(law, Expression) and effort.uses_time:
            for part in (*law.switches(), *law.branch_points()):
                if effort.is_timed(part):
                    sign = Node("sign", (_renamed(part.tree),))
                    yield effort, Expression(part.text, sign)


def _smooth(machine: Chain) -> Iterator[tuple[Effort, Expression]]:
    """The largest parts of laws that depend on time alone, written in `phi` for `t`."""
    for effort in machine.efforts:
        law = effort.load.law
        if isinstance(law, Expression) and effort.uses_time:
            yield from ((effort, Expression(part.text, _renamed(part.tree))) for part in _timed(effort, law.tree))


def _timed(effort: Effort, node: Node) -> Iterator[Expression]:
    part = Expression(written(node), node)
    if node.args and effort.is_timed(part):
        yield part
    elif "t" in part.names:
        for arg in node.args:
            yield from _timed(effort, arg)


def _renamed(node: Node) -> Node:
    name = "phi" if node.name == "t" else node.name
    return node._replace(name=name, args=tuple(_renamed(arg) for arg in node.args))


def _roots(effort: Effort, law: Expression, start: float, end: float) -> list[float]:
    from flywheel.formulas.switching import SwitchingError, breakpoints

    try:
        return breakpoints(law, start, end, *_environment(effort))
    except SwitchingError as error:
        raise _unfollowed(effort, error, end) from error


def _steep(effort: Effort, law: Expression, edges: Array) -> list[float]:
    """Times between the edges, none of which a switch lies between, that a step is not to pass."""
    from flywheel.formulas.resolution import resolved
    from flywheel.formulas.switching import SwitchingError

    try:
        return [float(time) for time in resolved(law, edges[:-1], edges[1:], *_environment(effort))]
    except SwitchingError as error:
        raise _unfollowed(effort, error, float(edges[-1])) from error


def _environment(effort: Effort) -> tuple[Any, Any]:
    """Bounds over cells of time, and values at times."""
    from flywheel.formulas.intervals import Interval
    from flywheel.formulas.jets import Jet

    def cells(lo: Array, hi: Array, anchor: Array) -> Mapping[str, Any]:
        return {**effort.constants, "phi": Jet(Interval(lo, hi), 1.0)}

    def values(times: Array, anchor: Array) -> Mapping[str, Any]:
        return {**effort.constants, "phi": times}

    return cells, values


def _unfollowed(effort: Effort, error: Exception, end: float) -> SceneError:
    """What keeps a law from being followed, with its variable named as in the scene."""
    found = re.sub(r"\bphi\b", "t", str(error))
    return SceneError([Fault(effort.path, found, f"an expression that can be followed to {end:.6g} s", "a shorter time")])
