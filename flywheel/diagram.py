"""The bond graph of a scene, as a table of its bonds and as a picture."""

from __future__ import annotations

from pathlib import Path

import bondgraph
from bondgraph import BondGraph, GraphError
from flywheel.faults import Fault, SceneError
from flywheel.machine import Machine
from flywheel.reading import load


def machine_graph(scene: Path, *, simplified: bool = False) -> tuple[BondGraph, tuple[str, ...]]:
    """The graph of the machine in a scene's file, and what simplifying did to it, a line each."""
    loaded = load(scene)
    if loaded.areas is not None:
        raise SceneError([Fault("areas", "areas without a mechanism", "a machine, to draw its bond graph")])
    graph = Machine(loaded).graph
    if not simplified:
        return graph, ()
    found = bondgraph.simplify(graph, keep=("crank",))
    return found.graph, (*(str(action) for action in found.log), "")


def table(graph: BondGraph, form: str) -> str:
    """The table of bonds as text, markdown or latex."""
    made = bondgraph.table(graph)
    return {"text": made.text, "markdown": made.markdown, "latex": made.latex}[form]()


def draw(graph: BondGraph, path: Path, scene: Path) -> None:
    """The picture of a graph, in the file format of the path."""
    try:
        bondgraph.draw(graph, path, title=scene.stem)
    except GraphError as error:
        raise SceneError([Fault("graph", "a graph that cannot be drawn", "fewer parts", str(error))]) from error
