"""A machine that one angle does not describe: its whole bond graph, followed in time."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bondgraph.elements import Element, Here, Law, Modulus, Motion
from bondgraph.graph import BondGraph
from bondgraph.laws import TIME, GraphError
from bondgraph.motion.dynamics import Dynamics
from bondgraph.motion.simulation import Run, simulate
from flywheel.machine.dynamics import circuit_of
from flywheel.machine.machine import Machine
from flywheel.numerics.faults import Fault, SceneError
from flywheel.regime.free_motion import SwitchingTimes

Array = NDArray[np.float64]


def followed(
    machine: Machine, start: tuple[float, float, float], until: float, inertia: float, balance: float, rtol: float
) -> Run:
    """The motion of the whole graph without twist at first, from crank angle (rad), speed (rad/s) and current (A)."""
    scene, (phi, omega, current) = machine.scene, start
    graph = compliant_graph(machine, balance, inertia)
    angles = [(d.name, scene.shafts[d.of]) for d in graph.displacements.values()]
    turning = [name for name in ("crank", *scene.compliances) if name in graph.elements]  # the others follow the crank
    _check_weighed(graph, turning)
    initial = {name: ratio * phi for name, ratio in angles} | {name: scene.shafts[name] * omega for name in turning}
    if circuit_of(scene) is not None:
        initial["drive.motor.armature"] = current
    breaks = {name: (ratio * machine.breakpoints[:-1], ratio * scene.cycle) for name, ratio in angles}
    if machine.depends_on_time:
        breaks[TIME] = (np.array(SwitchingTimes(machine, until).every()), until)
    try:
        return simulate(graph, until, initial=initial, rtol=rtol, breaks=breaks)
    except GraphError as error:
        expected, advice = "a motion that can be followed", "check inertias and stiffness"
        raise SceneError([Fault("simulation", str(error), expected, advice)]) from error


def _check_weighed(graph: BondGraph, shafts: Iterable[str]) -> None:
    """Both sides of a compliant shaft need inertia: without it a side has no speed of its own to start with."""
    states = Dynamics(graph).state.names
    light = [name for name in shafts if f"f_{name}" not in states]
    if light:
        expected = "inertia on both sides of a compliant shaft"
        raise SceneError(
            [Fault("inertia", f"nothing that weighs on {n}", expected, f'add [[inertia]] on = "{n}"') for n in light]
        )


@dataclass(frozen=True, eq=False)
class CompliantGraph(BondGraph):
    """The graph of a machine that is followed for many cycles; it is pickled as the machine and values that it is of."""

    origin: tuple[Machine, float, float] | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        assert self.origin is not None
        return compliant_graph, self.origin


def compliant_graph(machine: Machine, balance: float, inertia: float) -> CompliantGraph:
    """The machine's graph with values (SI) of its balance and flywheel.

    Its laws, which were written for one cycle of the crank, repeat with every cycle.
    """
    graph, scene = machine.with_values(balance, inertia), machine.scene

    def again(element: Element) -> Element:
        law = element.law
        if isinstance(law, Modulus | Law):
            period = scene.cycle * scene.shafts[law.motion.of]
            law = law._replace(motion=_repeating_motion(law.motion, period))
            if isinstance(law, Law):
                law = law._replace(effort=_repeating_effort(law, period), per_unknown=None)
        return element._replace(law=law)

    elements = {name: again(element) for name, element in graph.elements.items()}
    given = {one.name: getattr(graph, one.name) for one in fields(graph)} | {"elements": elements}
    return CompliantGraph(**given, origin=(machine, balance, inertia))


def _repeating_motion(motion: Motion, period: float) -> Motion:
    def position(q: Any, ns: Any, q_anchor: Any) -> Any:
        shift = np.floor(q_anchor / period) * period
        return motion.position(q - shift, ns, q_anchor - shift)

    return Motion(motion.of, position)


def _repeating_effort(law: Law, period: float) -> Any:
    def effort(here: Here, anchor: Here) -> Any:
        shift = np.floor(anchor.q / period) * period
        return law.effort(here._replace(q=here.q - shift), anchor._replace(q=anchor.q - shift))

    return effort
