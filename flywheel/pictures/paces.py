"""How a machine goes through its motion: where it stands at which time, and the curve of speed that goes with it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel import steady
from flywheel.faults import Fault, SceneError
from flywheel.linkage.description import FRAME, SLIDE
from flywheel.results import Sizing
from flywheel.scene import Scene
from flywheel.sizing import size
from flywheel.sketching.views import View
from flywheel.writing.digits import figure as number

Array = NDArray[np.float64]

_POINTS = 1441
_RPM = 30 / np.pi
_FLAT = 2e-3  # of the mean speed: a swing below it is drawn about the mean


class Pace(NamedTuple):
    """Coordinates (rad or m) in the order in which they are passed, the times (s) from the first, and a curve over them.

    `closed` tells whether the motion ends where it began.
    """

    q: Array
    time: Array
    curve: Array
    title: str
    label: str
    closed: bool

    def evenly(self, count: int) -> tuple[Array, Array, Array]:
        """Times (s) spread evenly over the motion, with coordinate and curve there; both ends unless it is closed."""
        t = self.time[-1] * np.linspace(0.0, 1.0, count, endpoint=not self.closed)
        return t, np.interp(t, self.time, self.q), np.interp(t, self.time, self.curve)


def pace(scene: Scene, view: View) -> Pace:
    """The pace of a scene's machine: its steady cycle with the flywheel given or sized, or its stroke at the speed given.

    Raises:
        SceneError: where the machine does not run as the scene says, or stands still.

    """
    return _of_cycle(size(scene, simulate=False)) if scene.stroke is None else _of_stroke(scene, view)


def _of_cycle(sizing: Sizing) -> Pace:
    phi = np.linspace(0.0, sizing.scene.cycle, _POINTS)
    omega = np.full_like(phi, sizing.speed)
    if sizing.run is not None and sizing.cycle is not None:
        omega = steady.speed_over_cycle(sizing.cycle, sizing.speed, sizing.run, phi)
    rpm, mean = _RPM * omega, _RPM * sizing.speed
    flat = np.ptp(rpm) < _FLAT * mean
    label = f"crank speed − {number(mean, 0.0, 6)} rpm, rpm" if flat else "crank speed, rpm"
    return Pace(phi, _elapsed(phi, omega), rpm - mean * flat, _wheel(sizing), label, True)


def _elapsed(q: Array, speed: Array) -> Array:
    """Time (s) from the first coordinate to each, by the trapezoidal rule on 1/speed."""
    slowness = 1.0 / np.abs(speed)
    return np.concatenate(([0.0], np.cumsum(0.5 * (slowness[1:] + slowness[:-1]) * np.abs(np.diff(q)))))


def _wheel(sizing: Sizing) -> str:
    given = sizing.scene.inertia
    inertia = sizing.flywheel.exact if given is None else given
    on = "" if sizing.scene.flywheel_on == "crank" else f" on {sizing.scene.flywheel_on}"
    eps = "" if sizing.run is None else f", ε = {number(sizing.run.irregularity, 0.0, 4)}"
    return f"Speed over the cycle{eps}\nwith a flywheel of {number(inertia or 0.0, 0.0, 5)} kg m²{on}"


def _of_stroke(scene: Scene, view: View) -> Pace:
    """The stroke at its constant speed, with the velocity of the first slide that is driven, or of the last body."""
    assert scene.stroke is not None
    stroke = scene.stroke
    if stroke.speed == 0.0:
        raise SceneError([Fault("stroke.speed", "0", "a speed at which the stroke comes to an end")])
    ends = (stroke.start, stroke.end) if stroke.speed > 0.0 else (stroke.end, stroke.start)
    q = np.linspace(*ends, _POINTS)
    poses, linkage = view.poses(q), view.solution.linkage
    slides = [j for j in linkage.joints if j.kind == SLIDE and j.name != linkage.driver and FRAME in (j.first, j.second)]
    if slides:
        name = slides[0].second if slides[0].first == FRAME else slides[0].first
        curve, label = stroke.speed * view.solution.coordinate(slides[0].name, poses).rate, f"velocity of {name}, m/s"
    else:
        name = linkage.names[-1]
        curve, label = stroke.speed * poses.angle(name).rate, f"angular velocity of {name}, rad/s"
    time = np.abs(q - q[0]) / abs(stroke.speed)
    unit = "m/s" if stroke.sliding else "rad/s"
    return Pace(q, time, curve, f"Stroke at {number(stroke.speed, 0.0, 5)} {unit}", label, False)
