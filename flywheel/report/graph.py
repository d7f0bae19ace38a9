"""The bond graph of a scene, as a table of its bonds and as a picture."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import bondgraph
from bondgraph import BondGraph, GraphError, I
from flywheel.machine.machine import FLYWHEEL, Machine
from flywheel.numerics.faults import Fault, SceneError
from flywheel.reading.scenes import load
from flywheel.regime.joint_friction import machine_of


def machine_graph(scene: Path, *, simplified: bool = False) -> tuple[BondGraph, tuple[str, ...]]:
    """The graph of the machine in a scene's file with its flywheel; what it leaves out and what simplifying did."""
    loaded = load(scene)
    if loaded.areas is not None:
        raise SceneError([Fault("areas", "areas without a mechanism", "a machine, to draw its bond graph")])
    machine = machine_of(loaded)
    graph = _with_flywheel(machine) if loaded.stroke is None else machine.graph
    left_out = tuple(
        f"shafts.{name}: losses in its mesh (efficiency {efficiency:g}) are no element of the graph"
        for name, efficiency in loaded.efficiencies.items()
        if efficiency < 1.0
    )
    if not simplified:
        return graph, (*left_out, "") if left_out else ()
    found = bondgraph.simplify(graph, keep=(loaded.reduction_element,))
    return found.graph, (*left_out, *(str(action) for action in found.log), "")


def _with_flywheel(machine: Machine) -> BondGraph:
    inertia = machine.scene.inertia
    graph = machine.with_values(0.0, 1.0 if inertia is None else inertia)
    return _with_open_flywheel(graph) if inertia is None else graph


def _with_open_flywheel(graph: BondGraph) -> BondGraph:
    """The flywheel's inertia as a parameter without a value: sizing finds it."""
    name = next(element.name for element in graph.elements.values() if element.part == FLYWHEEL)
    wheel = I(name, lambda J_flywheel: J_flywheel, part=FLYWHEEL)
    return replace(graph, elements={**graph.elements, name: wheel}, parameters={"J_flywheel": None})


def table(graph: BondGraph, form: str) -> str:
    """The table of bonds as text, markdown or latex."""
    with _explained():
        made = bondgraph.table(graph)
    return made.markdown() if form == "markdown" else made.latex() if form == "latex" else made.text()


def draw(graph: BondGraph, path: Path, scene: Path) -> None:
    """The picture of a graph, in the file format of the path."""
    with _explained():
        bondgraph.draw(graph, path, title=scene.stem)


@contextmanager
def _explained() -> Iterator[None]:
    """A graph that cannot be told or drawn, as faults of the scene: of a machine without any inertia, say."""
    try:
        yield
    except GraphError as error:
        expected, advice = "a graph whose bonds decide each other", "give the machine inertia or a flywheel"
        raise SceneError([Fault("graph", line, expected, advice) for line in str(error).splitlines()]) from error
