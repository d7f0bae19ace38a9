"""What the page asks to be computed: the form of a text, its faults, the figures; and the worked report."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from flywheel import language
from flywheel.numerics.faults import Fault, Remark, SceneError
from flywheel.page import data
from flywheel.page.edits import MOST_EDITS, Draft
from flywheel.page.form import as_groups
from flywheel.reading.scenes import parse_scene, placed_in, plain_lines
from flywheel.scene.scene import Scene


def answer(request: Mapping[str, Any]) -> bytes:
    """Form, faults, remarks and figures of a text after its edits, as JSON."""
    begin = perf_counter()
    with language.use(spoken(request)), np.errstate(all="ignore"):
        draft = edited(plain_lines(request["text"]), request.get("edits"))
        text = draft.outline.text
        faults, remarks = list(draft.faults), list[Remark]()
        figures: dict[str, Any] | None = None
        try:
            scene = scene_of(text, request)
            remarks = list(scene.remarks)
            figures = data.answer(
                scene,
                request["view"] if isinstance(request.get("view"), dict) else {},
                rest=request.get("rest") is True,
                units="us" if request.get("units") == "us" else "si",
            )
            faults += placed_in(figures.pop("faults"), text)
        except SceneError as error:
            faults += placed_in(error.faults, text)
        told = {
            "text": text,
            "form": as_groups(draft.form, draft.outline, faults),
            "faults": [as_fault(fault) for fault in faults],
            "remarks": [as_remark(remark) for remark in remarks],
            "answer": figures,
            "milliseconds": round(1e3 * (perf_counter() - begin), 3),
        }
    return json.dumps(told, allow_nan=False, separators=(",", ":")).encode()


def edited(text: str, edits: object) -> Draft:
    """The text after the edits of a form: `path` with a `value`, with a `unit` to convert to, or with null to take away."""
    draft = Draft(text, _known.get((text, language.current())))
    for edit in edits[:MOST_EDITS] if isinstance(edits, list) else ():
        path, value, unit = (edit.get(key) for key in ("path", "value", "unit")) if isinstance(edit, dict) else (None,) * 3
        if isinstance(path, str) and (value is None or isinstance(value, str)) and (unit is None or isinstance(unit, str)):
            draft.edit(path, value, unit)
    _known.clear()
    _known[draft.outline.text, language.current()] = draft
    return draft


_known: dict[tuple[str, str], Draft] = {}
"""The last text and the language of its form, which the next request changes at one place."""


def scene_of(text: str, request: Mapping[str, Any]) -> Scene:
    """The scene of a text, whose CSV files lie in the request's folder."""
    folder = Path(request["folder"])
    return parse_scene(text, folder=folder, file=folder / request["name"])


def spoken(request: Mapping[str, Any]) -> str:
    """The language that is asked for; English where there is no such language."""
    asked = request.get("language", "en")
    return asked if asked in language.LANGUAGES else "en"


def report(request: Mapping[str, Any]) -> bytes:
    """The worked report as the bytes of its file; a JSON object with the reason where there is none."""
    from flywheel.report import files
    from flywheel.report.contents import html

    text = plain_lines(request["text"])
    with language.use(spoken(request)):
        try:
            units = "us" if request.get("units") == "us" else "si"
            written = html(scene_of(text, request), units=units, page=request["pages"])
            return files.pdf(written) if request["format"] == "pdf" else written.encode()
        except SceneError as error:
            faults = placed_in(error.faults, text)
            told = {"message": "; ".join(map(str, faults)), "faults": [as_fault(fault) for fault in faults]}
        except files.PrintError as error:
            told = {"message": str(error), "faults": []}
    return json.dumps(told).encode()


def as_fault(fault: Fault) -> dict[str, Any]:
    """A fault as the page shows it, at its line and beside its field, in the language in use."""
    words = {part: language.message(getattr(fault, part), numbers=False) for part in ("found", "expected", "advice")}
    return {"path": fault.path, "line": fault.line, "column": fault.column, **words, "message": fault.sentence}


def as_remark(remark: Remark) -> dict[str, Any]:
    """A remark alike."""
    words = {part: language.message(getattr(remark, part)) for part in ("found", "advice")}
    return {"path": remark.path, "line": remark.line, **words, "message": remark.sentence}


CALLS: dict[str, Callable[[Mapping[str, Any]], bytes]] = {"answer": answer, "report": report}
