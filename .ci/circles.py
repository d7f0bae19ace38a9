"""Circles of imports among the modules of flywheel and bondgraph: imports in functions and those for types alone count.

Packages (`__init__.py`) are left out: they give names of their modules to the outside. Exit status 1 where a circle is.
"""

import ast
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).parent.parent


def imports() -> dict[str, set[str]]:
    """The modules that each module imports, anywhere in its text."""
    files = {
        ".".join(file.relative_to(ROOT).with_suffix("").parts): file
        for package in ("flywheel", "bondgraph")
        for file in (ROOT / package).rglob("*.py")
        if file.name != "__init__.py"
    }
    graph: dict[str, set[str]] = {}
    for module, file in files.items():
        named: set[str] = set()
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                named |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module:  # relative imports are not used here
                named |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
        graph[module] = {name for name in named if name in files and name != module}
    return graph


def circles(graph: dict[str, set[str]]) -> list[list[str]]:
    """One circle after the other, each opened at its last arrow before the next is looked for."""
    graph, found = {module: set(to) for module, to in graph.items()}, []
    while True:
        try:
            TopologicalSorter(graph).prepare()
        except CycleError as error:
            circle = error.args[1][::-1]  # each imports the next
            found.append(circle)
            graph[circle[-2]].discard(circle[-1])
        else:
            return found


if __name__ == "__main__":
    forbidden = circles(imports())
    for circle in forbidden:
        print("circle of imports: " + " -> ".join(circle))
    sys.exit(bool(forbidden))
