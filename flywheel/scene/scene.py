"""The scene: what a user asks, checked and in SI, as plain frozen data.

Nothing here computes. `flywheel.reading.scenes` fills these from TOML; `flywheel.machine` turns them into a bond graph.
Places are canonical names: a shaft (`crank`), or a mechanism's port (`press.slider`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.components.motors import Motor
from flywheel.components.wheels import WheelAsked
from flywheel.numerics.expressions import Expression
from flywheel.numerics.faults import Remark
from flywheel.numerics.units import Unit
from flywheel.scene.linkage import Linkage

TURN = 2 * np.pi


class Body(NamedTuple):
    """A rigid body: mass (kg), inertia about its centre of mass (kg m²), centre of mass from the first pin (m, rad)."""

    mass: float = 0.0
    inertia: float = 0.0
    com: float = 0.0
    com_angle: float = 0.0


class Table(NamedTuple):
    """Numbers against angle: `angle` ascends (rad; two equal ones are a jump), `value` is SI."""

    angle: NDArray[np.float64]
    value: NDArray[np.float64]
    interpolation: str = "linear"  # linear, pchip, step; a law's table is always a periodic cubic spline


Law = float | Expression | Table


class Output(NamedTuple):
    """One output of a `law` mechanism: its position (m or rad) as a function of the mechanism's angle."""

    name: str
    rotating: bool
    law: Expression | Table
    inertia: float  # mass (kg) of an `x`, inertia (kg m²) of a `theta`


class PointPort(NamedTuple):
    """A port of a `linkage` where a point of a body moves along a fixed direction (rad from +x)."""

    name: str
    body: str
    point: str
    direction: float = 0.0


@dataclass(frozen=True)
class Mechanism:
    """One mechanism: its own crank angle is psi = ratio phi + phase, ratio being that of its shaft.

    `geometry` holds lengths (m) and angles (rad) by their path in the scene (`crank.length`, `slider.offset`,
    `yoke.direction`), and `assembly` (`open`, `crossed`) for a four-bar. `period` (rad of psi) is the span after which
    the laws of a `law` mechanism repeat; `travel` (rad of psi) is how far the crank turns in a cycle. `linkage` is what a
    mechanism of type `linkage` consists of, `points` its ports at points of bodies. `stroke` is set where the driver goes
    one way from one end to another (rad or m of psi), instead of turning in cycles.
    """

    type: str
    name: str
    shaft: str = "crank"
    phase: float = 0.0
    geometry: Mapping[str, float] = field(default_factory=dict)
    assembly: str = "open"
    bodies: Mapping[str, Body] = field(default_factory=dict)
    outputs: tuple[Output, ...] = ()
    period: float = TURN
    travel: float = TURN
    linkage: Linkage | None = None
    points: tuple[PointPort, ...] = ()
    stroke: tuple[float, float] | None = None
    path: str = "mechanism"  # where it stands in the scene, for messages: `mechanism`, `mechanism[1]`


class Load(NamedTuple):
    """A force or torque on a place, positive along its positive sense.

    Active for `start` <= angle < `end` (wrapping within `every`; None: always) and, with `sense` ±1, only while the
    place moves that way at positive crank speed. `every` (rad) is the period of window, table and `phi`. The angle is the
    mechanism's own on a port, the crank's on a shaft. `law` is None for the torque that is the scene's balance. On a stroke
    a load acts `once`: the angle is the driver's coordinate (m where it slides), and nothing repeats.
    """

    on: str
    law: Law | None
    every: float
    start: float | None = None
    end: float | None = None
    sense: int = 0
    path: str = "load"
    once: bool = False
    model: str = ""  # what a load of a known kind is, for reports: "press: 24.7 kJ over 15 mm"
    piston: float | None = None  # area (m²) on which a gas presses, where the force is that of one


class Spring(NamedTuple):
    """A spring from a place to the frame: effort -stiffness (x - rest)."""

    on: str
    stiffness: float
    rest: float = 0.0
    path: str = "spring"


class Damper(NamedTuple):
    """A damper from a place to the frame: effort -coefficient v."""

    on: str
    coefficient: float
    path: str = "damper"


class Inertia(NamedTuple):
    """A mass (kg) or inertia (kg m²) fixed on a place; it has no weight."""

    on: str
    value: float
    path: str = "inertia"


class Compliance(NamedTuple):
    """What joins a compliant shaft to the crank's gear: stiffness (N m/rad) and damping (N m s/rad), at the shaft itself."""

    stiffness: float
    damping: float = 0.0


class Areas(NamedTuple):
    """Areas between the crossings of a turning-moment diagram, with the work (J) that one unit stands for."""

    values: tuple[float, ...]
    scale: float


class Stroke(NamedTuple):
    """A one-way motion of the driver from `start` to `end` (m, or rad where it turns), with its speed and acceleration.

    `sliding` tells whether the reduction element slides (`slide`, in m) or turns (`crank`, in rad).
    """

    start: float
    end: float
    speed: float
    acceleration: float = 0.0
    sliding: bool = True

    @property
    def element(self) -> str:
        """The reduction element: `slide` where the driver slides, `crank` where it turns."""
        return "slide" if self.sliding else "crank"

    @property
    def span(self) -> float:
        """How far the driver goes, m or rad."""
        return self.end - self.start


@dataclass(frozen=True)
class Scene:
    """One machine and what is asked of it. Speeds in rad/s, angles in rad, everything SI.

    `speed` is the mean of the greatest and least speed *of the crank* (converted if the scene names another shaft); None
    where the machine's own steady speed is to be found.
    `unknown` is the name of the balance: "drive", a parameter's name, or None.
    Exactly one of `irregularity` (size the flywheel) and `inertia` (analyse the given one, at its own shaft) is set.
    """

    speed: float | None
    irregularity: float | None = None
    inertia: float | None = None
    flywheel_on: str = "crank"
    title: str | None = None
    source: str | None = None
    cycle: float = TURN
    shafts: Mapping[str, float] = field(default_factory=lambda: {"crank": 1.0})
    compliances: Mapping[str, Compliance] = field(default_factory=dict)  # of the shafts that twist
    efficiencies: Mapping[str, float] = field(default_factory=dict)  # of the shafts whose mesh with the crank has losses
    parameters: Mapping[str, float] = field(default_factory=dict)
    units: Mapping[str, Unit] = field(default_factory=dict)  # of the parameters that are given with one
    unknown: str | None = None
    mechanisms: tuple[Mechanism, ...] = ()
    inertias: tuple[Inertia, ...] = ()
    loads: tuple[Load, ...] = ()
    springs: tuple[Spring, ...] = ()
    dampers: tuple[Damper, ...] = ()
    gravity: tuple[float, float] | None = None  # acceleration along x and y, m/s²
    drive: Load | None = None  # law None when its torque is the balance
    motor: Motor | None = None  # what the drive's law comes from, where it is a motor
    areas: Areas | None = None
    stroke: Stroke | None = None  # in place of cycle, speed and flywheel
    wheel: WheelAsked | None = None  # what the flywheel is made of and how large, where that is to be found
    rtol: float = 1e-9
    closure: float = 1e-9
    file: Path | None = None
    remarks: tuple[Remark, ...] = field(default=(), compare=False)  # on numbers that are hardly those that were meant

    @property
    def reduction_element(self) -> str:
        """What everything is reduced to: the shaft `crank`, or on a stroke the `slide` that drives."""
        return "crank" if self.stroke is None else self.stroke.element

    @property
    def origin(self) -> float:
        """The coordinate (rad or m) at which the machine's own, from 0 to the cycle, begins: not 0 on a stroke."""
        return 0.0 if self.stroke is None else self.stroke.start

    @property
    def rubs(self) -> bool:
        """Whether any joint of a linkage has friction."""
        return any(mechanism.linkage is not None and mechanism.linkage.rubs for mechanism in self.mechanisms)

    @property
    def flywheel_ratio(self) -> float:
        """Speed of the flywheel's shaft over the crank's."""
        return self.shafts[self.flywheel_on]
