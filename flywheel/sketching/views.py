"""The mechanisms of a scene as linkages that move with the machine's coordinate, for pictures of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.advice import nearest
from flywheel.faults import Fault, SceneError
from flywheel.linkage.poses import Poses
from flywheel.linkage.solution import Solution, solve
from flywheel.scene import TURN, Mechanism, Scene
from flywheel.sketching.sketch import Sketch, places, sketch

Array = NDArray[np.float64]

_POINTS = 361  # of a path
_TURNED, _SLID = (1 / 6, 0.0, 1 / 3, 1 / 2, 2 / 3, 5 / 6), (0.5, 0.0, 0.25, 0.75, 1.0)  # of a turn, of a stroke


@dataclass(frozen=True)
class View:
    """One mechanism, and how its own angle follows the coordinate q of the machine: psi = ratio q + phase."""

    mechanism: Mechanism
    solution: Solution
    ratio: float = 1.0
    phase: float = 0.0
    points: tuple[str, ...] | None = None

    def poses(self, q: ArrayLike) -> Poses:
        """Poses at coordinates q of the machine (rad, or m on a sliding stroke)."""
        low, high = self.solution.low, self.solution.high
        psi = self.ratio * np.atleast_1d(np.asarray(q, dtype=float)) + self.phase
        turning = self.mechanism.stroke is None
        return self.solution.poses(low + (psi - low) % (high - low) if turning else np.clip(psi, low, high))

    @cached_property
    def cycle(self) -> Poses:
        """Poses all over the motion, evenly spread, both ends included."""
        return self.solution.poses(np.linspace(self.solution.low, self.solution.high, _POINTS))

    @cached_property
    def sketch(self) -> Sketch:
        """The figures of the mechanism, with the paths of the points asked for."""
        return sketch(self.cycle, self.points)


def views(scene: Scene, points: Sequence[str] = ()) -> tuple[View, ...]:
    """Every mechanism of a scene but its laws, which have no bodies to draw.

    `points` are the names of joints or points whose paths are wanted, all if none is given.
    A name is that of a joint (`B`), a point of a body (`rod.P`), or a point's own name where only one has it; with several
    mechanisms the name of the mechanism may stand before it (`press.rod.P`).

    Raises:
        SceneError: for a scene without mechanism, a mechanism that is no linkage or cannot move, a point that nobody knows.

    """
    if not scene.mechanisms:
        found = "a diagram of areas" if scene.areas is not None else "a scene without any"
        raise SceneError([Fault("mechanism", found, "a mechanism to draw")])
    laws = laws_of(scene)
    if len(laws) == len(scene.mechanisms):
        wanted, advice = "a mechanism with bodies, to draw", "write it as a linkage"
        raise SceneError([Fault(f"{law.path}.type", '"law", which has no bodies', wanted, advice) for law in laws])
    found_views = [_view(scene, mechanism) for mechanism in scene.mechanisms if mechanism.type != "law"]
    if not points:
        return tuple(found_views)
    chosen: list[list[str]] = [[] for _ in found_views]
    faults = []
    for name in points:
        matches = [(k, match) for k, view in enumerate(found_views) for match in _matches(view, name)]
        if not matches:
            faults.append(_unknown(name, found_views))
        for k, match in matches:
            chosen[k].append(match)
    if faults:
        raise SceneError(faults)
    return tuple(_with_points(view, names) for view, names in zip(found_views, chosen, strict=True))


def laws_of(scene: Scene) -> list[Mechanism]:
    """The mechanisms that have no bodies and so no picture."""
    return [mechanism for mechanism in scene.mechanisms if mechanism.type == "law"]


def headline(scene: Scene) -> str:
    """The title of a picture: the scene's, or its file's name; what could not be drawn is named."""
    title = scene.title or (scene.file.stem if scene.file is not None else "")
    laws = ", ".join(mechanism.name for mechanism in laws_of(scene))
    return f"{title} (not drawn: {laws}, a law without bodies)".strip() if laws else title


def positions(scene: Scene) -> tuple[float, ...]:
    """Where mechanisms are drawn if nothing is asked: a handful over a turn or a stroke (rad or m), the main one first."""
    if scene.stroke is not None:
        return tuple(scene.stroke.start + share * scene.stroke.span for share in _SLID)
    turn = min(TURN / scene.shafts[mechanism.shaft] for mechanism in scene.mechanisms)
    return tuple(share * min(turn, scene.cycle) for share in _TURNED)


def checked(scene: Scene, at: Iterable[float]) -> tuple[float, ...]:
    """Coordinates that were asked for; a SceneError for one that is not finite or, on a stroke, lies beyond its ends."""
    given = tuple(map(float, at))
    stroke = scene.stroke
    for q in given:
        if not np.isfinite(q):
            raise SceneError([Fault("at", f"{q}", "positions that are finite")])
        if stroke is not None and not stroke.start - 1e-9 * stroke.span <= q <= stroke.end + 1e-9 * stroke.span:
            ends = f"a position from {told(scene, stroke.start)} to {told(scene, stroke.end)}"
            raise SceneError([Fault("at", told(scene, q), ends, "the stroke ends there")])
    return given


def told(scene: Scene, q: float) -> str:
    """A coordinate of the machine as a designer reads it: in degrees, or in mm where it slides."""
    sliding = scene.stroke is not None and scene.stroke.sliding
    return (f"{1000 * q:.6g} mm" if sliding else f"{np.degrees(q):.6g}°").replace("-", "−")


def _view(scene: Scene, mechanism: Mechanism) -> View:
    from flywheel.linkage.named import linkage_of  # only named types need it

    linkage = mechanism.linkage if mechanism.linkage is not None else linkage_of(mechanism)
    if scene.stroke is not None:
        return View(mechanism, solve(linkage, scene.stroke.start, scene.stroke.end))
    span = mechanism.travel if mechanism.linkage is not None else TURN
    solution = solve(linkage, mechanism.phase, mechanism.phase + span)
    return View(mechanism, solution, scene.shafts[mechanism.shaft], mechanism.phase)


def _with_points(view: View, names: Sequence[str]) -> View:
    return View(view.mechanism, view.solution, view.ratio, view.phase, tuple(names))


def _matches(view: View, name: str) -> list[str]:
    """The places of a mechanism that a name means: one, or none where it is unknown or could be several."""
    known = places(view.solution.linkage)
    inner = name.removeprefix(f"{view.mechanism.name}.")
    for wanted in (name, inner):
        if wanted in known:
            return [wanted]
    same = [place for place in known if place.rpartition(".")[2] == inner]
    return same if len(same) == 1 else []


def _unknown(name: str, found: Sequence[View]) -> Fault:
    known = [place for view in found for place in places(view.solution.linkage)]
    near = nearest(name, known)
    advice = f"did you mean {near!r}?" if near else ""
    return Fault("points", repr(name), "one of " + ", ".join(dict.fromkeys(known)), advice)
