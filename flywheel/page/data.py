"""Data of the drawings of the live page: plain lists of finite numbers in SI, each panel's own, on one axis.

Diagrams are those of `flywheel.pictures.diagrams`; the mechanism with its moving bodies is made here. While a slider is
dragged there are fewer positions of the driver, with seven digits; otherwise more, with all digits.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import floor, log10
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.language import text as _
from flywheel.machine.machine import Machine
from flywheel.mechanisms.families import has_joints
from flywheel.motions.single_stroke import SingleStroke, single_stroke
from flywheel.numerics.faults import Fault, SceneError
from flywheel.pictures import diagrams, forms, sketch
from flywheel.pictures.diagrams import DIAGRAMS, QUANTITIES
from flywheel.pictures.forms import MOVING, RESTING, Axis, Diagram, part_of
from flywheel.scene.linkage import FRAME
from flywheel.scene.scene import Mechanism, Scene
from flywheel.sizing.results import Sizing
from flywheel.sizing.sizing import size
from flywheel.tables.strokes import blocks
from flywheel.tables.summary import summary

Array = NDArray[np.float64]
Subject = Scene | Machine | Sizing | SingleStroke

_MECHANISM = "mechanism"  # the panel that is no diagram
_DIGITS = 7  # of numbers while a hand moves
_QUICK = 1e-4  # relative accuracy of a stroke while a hand moves


def answer(
    subject: Subject, view: Mapping[str, Any] | None = None, *, rest: bool = True, units: str = "si"
) -> dict[str, Any]:
    """The data of all drawings of a scene, or of the panels that the view names.

    Args:
        subject: a scene, its machine, or its sizing or its stroke if there is one already.
        view: `panels`, the ids of the panels to draw (default: all that suit the scene); of the motion `kind`, one of
            `QUANTITIES`, and `of`, a body or joint; `mechanism`, whose reactions are drawn; for an unknown name the first
            one.
        rest: False while a slider is dragged: no confirmation in time.
        units: of the results, "si" or "us".

    Raises:
        SceneError: for a scene of which nothing can be drawn.

    Returns a mapping for JSON. `faults` are those of a scene that moves but cannot be sized; `why` has the reason for each
    missing panel; `later` are the panels that were not requested.

    """
    view = {} if view is None else view
    scene = _scene_of(subject)
    stroke, sizing, machine, faults = None, None, None, list[Fault]()
    panels_there = (_MECHANISM, *(key for key, kind in DIAGRAMS.items() if kind.suits(scene)))
    if scene.single_stroke is None:
        sizing, machine, faults = _sized(subject, rest)
    else:
        try:
            stroke = subject if isinstance(subject, SingleStroke) else _stroke(scene, rest)
        except SceneError as error:
            faults = list(error.faults)
    names = [panel for panel in panels_there if panel in view.get("panels", panels_there)]
    digits = None if rest else _DIGITS
    panels: dict[str, Any] = {}
    why: dict[str, str] = {}
    with np.errstate(all="ignore"):
        count = RESTING if rest else MOVING
        if stroke is not None:
            part = forms.part_of_stroke(stroke, count, view, rest=rest)
        else:
            part = part_of(scene, machine, sizing, count, view, rest=rest)
        forces = diagrams.forces_of(part) if "reactions" in names or view.get("kind") == QUANTITIES[3] else ""
        for panel in names:
            made = _mechanism(scene, part.axis) if panel == _MECHANISM else diagrams.made(part, panel, forces)
            if isinstance(made, str):
                why[panel] = made
            else:
                panels[panel] = _finite(made.as_dict() if isinstance(made, Diagram) else made, digits)
    return {
        "title": scene.title or "",
        "cycle": scene.cycle,
        "driver": _driver(scene, None if stroke is None else stroke.phases.period),
        "phi": _plain(part.axis.values, digits) if scene.areas is None else [],
        "numbers": _numbers(sizing, units, rest) if stroke is None else [each.as_dict() for each in blocks(stroke, units)],
        "figures": list(panels),
        "titles": {_MECHANISM: _("Mechanism")} | {panel: kind.title() for panel, kind in DIAGRAMS.items()},
        "views": _views(panels.get("motion")),
        "why": why,
        "later": [panel for panel in panels_there if panel not in names],
        "faults": faults,
        **panels,
    }


_last_stroke: list[SingleStroke] = []
"""The stroke that was found last: the next one while a hand moves is looked for beside it."""


def _stroke(scene: Scene, rest: bool) -> SingleStroke:
    """The stroke of a machine with clutch and brake; during a drag less accurate, without the greatest rate."""
    near = None if rest or not _last_stroke else _last_stroke[0]
    try:
        stroke = single_stroke(scene, None if rest else _QUICK, rates=rest, near=near)
    except SceneError:
        _last_stroke.clear()
        if near is None:
            raise
        stroke = single_stroke(scene, _QUICK, rates=False)
    _last_stroke[:] = [stroke]
    return stroke


def _sized(subject: Subject, rest: bool) -> tuple[Sizing | None, Machine | None, list[Fault]]:
    """The sizing and the machine of a scene; the faults of one that cannot be sized, but has a mechanism that moves."""
    if isinstance(subject, Sizing):
        return subject, subject.machine, []
    scene = _scene_of(subject)
    if scene.areas is not None:
        return size(scene, simulate=rest), None, []
    machine = subject if isinstance(subject, Machine) else Machine(scene)
    if scene.stroke is not None or not (scene.has_flywheel and scene.has_speed):
        return None, machine, []
    try:
        sizing = size(machine, simulate=rest)
    except SceneError as error:
        return None, machine, list(error.faults)
    return sizing, sizing.machine or machine, []


def _scene_of(subject: Subject) -> Scene:
    return subject if isinstance(subject, Scene) else subject.scene


def _numbers(sizing: Sizing | None, units: str, rest: bool) -> list[Any]:
    """The results as rows; during a drag without a confirmation, because none has been computed yet."""
    if sizing is None:
        return []
    blocks = summary(sizing, units, motions=rest)
    return [(block if rest or block.name != "run" else block._replace(sentences=())).as_dict() for block in blocks]


def _views(motion: dict[str, Any] | None) -> dict[str, Any] | None:
    """Views of the motion to choose from, and the chosen one."""
    if motion is None:
        return None
    of = [{"id": name, "label": name} for name in motion.pop("choices")]
    kinds = QUANTITIES if motion.pop("reacts") else QUANTITIES[:3]
    return {"kinds": list(kinds), "of": of, "chosen": {"kind": motion["quantity"], "of": motion["of"]}}


def _driver(scene: Scene, period: float | None) -> dict[str, Any]:
    """The horizontal axis of diagrams: a cycle or a stroke of the driver, in rad or m; stroke by stroke a period, in s."""
    if period is not None:
        return {"kind": "time", "stroke": False, "from": 0.0, "to": period, "backwards": False}
    return {
        "kind": "length" if scene.reduction_element == "slide" else "angle",
        "stroke": scene.stroke is not None,
        "from": scene.origin,
        "to": scene.origin + scene.cycle,
        "backwards": scene.stroke is not None and scene.stroke.speed is not None and scene.stroke.speed < 0.0,
    }


# -- plain numbers -----------------------------------------------------------------------------------------------------


def _plain(values: ArrayLike, digits: int | None) -> list[Any]:
    """Numbers for JSON; one that is not finite is null. `digits` are those of the largest number; all digits if None."""
    array = np.asarray(values, dtype=float)
    bad = ~np.isfinite(array)
    if digits is not None and array.size:
        largest = float(np.abs(array[~bad]).max(initial=0.0))
        if largest > 0.0:
            array = array.round(min(max(digits - 1 - floor(log10(largest)), -300), 300))
    if not bad.any():
        return list(array.tolist())
    return [None if missing else value for value, missing in zip(array.tolist(), bad.tolist(), strict=True)]


def _finite(value: Any, digits: int | None) -> Any:
    """The same with every array as a list, and every number finite or null."""
    if isinstance(value, np.ndarray):
        return _plain(value, digits) if value.ndim == 1 else [_plain(row, digits) for row in value]
    if isinstance(value, Mapping):
        return {key: _finite(inner, digits) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(inner, digits) for inner in value]
    if isinstance(value, float):
        return float(value) if np.isfinite(value) else None
    return value


# -- mechanism ---------------------------------------------------------------------------------------------------------

_ONE_POINT_IN = {"pin": 4, "dot": 4, "plate": 2, "bar": 2, "rail": 2, "wheel": 2}  # of the points of an outline


def _mechanism(scene: Scene, axis: Axis) -> dict[str, Any] | str:
    """Moving bodies, their outlines, points whose paths are drawn; discs if there are no bodies."""
    if scene.areas is not None:
        return _("A diagram of areas does not describe the mechanism.")
    drawn = [mechanism for mechanism in scene.mechanisms if has_joints(mechanism)]
    others = [mechanism.name for mechanism in scene.mechanisms if mechanism not in drawn]
    try:
        views = [_one_mechanism(view, axis.taken) for view in _views_of(scene)] if drawn else [_discs(scene, axis)]
    except SceneError as error:
        return str(error)
    return {"views": views, "without": others}


_last_views: list[tuple[Any, tuple[sketch.View, ...]]] = []
"""The mechanisms drawn last: a change of a mass, a load or a speed leaves their figures unchanged."""


def _views_of(scene: Scene) -> tuple[sketch.View, ...]:
    """The mechanisms of a scene with their figures; unchanged mechanisms keep those of the last scene."""
    shape = [_alike(mechanism) for mechanism in scene.mechanisms], scene.stroke, dict(scene.shafts)
    if _last_views and _last_views[0][0] == shape:
        return _last_views[0][1]
    _last_views[:] = [(shape, sketch.views(scene))]
    return _last_views[0][1]


def _alike(mechanism: Mechanism) -> Mechanism:
    """A mechanism with masses of 1 kg: a drawing shows the centres of bodies that have any."""
    bodies = {name: body._replace(mass=float(body.mass > 0.0), inertia=0.0) for name, body in mechanism.bodies.items()}
    linkage = mechanism.linkage
    if linkage is not None:
        links = tuple(link._replace(mass=float(link.mass > 0.0), inertia=0.0) for link in linkage.links)
        linkage = replace(linkage, links=links)
    return replace(mechanism, bodies=bodies, linkage=linkage)


def _one_mechanism(view: sketch.View, q: Array) -> dict[str, Any]:
    poses, made, linkage = view.poses(q), view.sketch, view.solution.linkage
    positions, driver = sketch.places(linkage), linkage.joint(linkage.driver)
    shapes = [
        {
            "kind": shape.kind,
            "body": shape.body,
            "at": _place(shape.at),
            "turns": shape.turns_with,
            "outline": shape.outline[:, :: _ONE_POINT_IN.get(shape.kind, 1)],
        }
        for shape in made.shapes
    ]
    bodies = {}
    for k, name in enumerate(linkage.names):
        if name != FRAME:
            x, y, turn = poses.value[k]
            bodies[name] = {"x": x, "y": y, "turn": np.unwrap(turn)}
    return {
        "name": view.mechanism.name,
        "bodies": bodies,
        "shapes": shapes,
        "traces": [{"name": trace.name, "at": _place(positions[trace.name])} for trace in made.traces],
        "labels": [{"text": label.text, "body": label.body, "at": _place(label.at)} for label in made.labels],
        "centres": [{"body": link.name, "at": _place((link.name, link.com))} for link in linkage.links if link.mass],
        "box": view.box,
        "driver": driver.first if driver.second == FRAME else driver.second,
    }


def _place(place: tuple[str, Any]) -> list[Any]:
    body, (x, y, *_rest) = place
    return [body, float(x), float(y)]


def _discs(scene: Scene, axis: Axis) -> dict[str, Any]:
    """A rotor: a disc with a mark for each shaft, beside one another."""
    bodies, shapes, labels = {}, [], []
    disc = 2.0 * sketch.circle(1.0)[:, ::2]
    for k, (name, ratio) in enumerate(scene.shafts.items()):
        still = np.full(axis.taken.size, 5.0 * k)
        bodies[name] = {"x": still, "y": 0.0 * still, "turn": ratio * axis.taken}
        for kind, outline in (("plate", disc), ("mark", np.array([[0.0, 2.0], [0.0, 0.0]])), ("pin", 0.1 * disc)):
            shapes.append({"kind": kind, "body": name, "at": [name, 0.0, 0.0], "turns": name, "outline": outline})
        labels.append({"text": name, "body": name, "at": [name, 0.0, 0.0]})
    discs = {"name": "", "bodies": bodies, "shapes": shapes, "traces": [], "labels": labels, "centres": []}
    box = [[-2.0, 5.0 * len(bodies) - 3.0], [-2.0, 2.0]]
    return discs | {"box": box, "driver": next(iter(bodies)), "schematic": True}
