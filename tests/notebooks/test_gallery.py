"""The gallery notebook runs from top to bottom, and what its cells end with can be shown."""

import ast
import json
from pathlib import Path

import pytest

GALLERY = Path(__file__).parents[2] / "examples" / "notebooks" / "gallery.ipynb"
NOTEBOOK = json.loads(GALLERY.read_text(encoding="utf-8"))
CELLS = ["".join(cell["source"]) for cell in NOTEBOOK["cells"] if cell["cell_type"] == "code"]


def shown(source, names):
    """Last value of a cell, as a notebook would take it."""
    tree = ast.parse(source)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, str(GALLERY), "exec"), names)
    return None if last is None else eval(compile(ast.Expression(last.value), str(GALLERY), "eval"), names)


@pytest.mark.slow
def test_every_cell_runs_and_shows_something():
    names: dict[str, object] = {}
    result = [shown(cell, names) for cell in CELLS]
    pages = [thing._repr_html_() for thing in result if hasattr(thing, "_repr_html_")]
    assert len(pages) == 7
    assert all(page and "<table" in page for page in pages)
    assert "<svg" in result[-1]._repr_svg_()


@pytest.mark.slow
def test_jupyter_executes_the_notebook():
    nbclient = pytest.importorskip("nbclient")
    nbformat = pytest.importorskip("nbformat")
    pytest.importorskip("ipykernel")
    notebook = nbformat.read(GALLERY, as_version=4)
    nbclient.NotebookClient(notebook, timeout=300, kernel_name="python3").execute()
    outputs = [out for cell in notebook.cells if cell.cell_type == "code" for out in cell.outputs]
    kinds = [set(out["data"]) for out in outputs if "data" in out]
    assert sum("text/html" in kind for kind in kinds) == 7
    assert sum("image/svg+xml" in kind for kind in kinds) == 1


def test_the_notebook_is_stored_without_outputs():
    assert all(not cell["outputs"] for cell in NOTEBOOK["cells"] if cell["cell_type"] == "code")
