"""The scene: a user's input, checked and in SI, as plain immutable data that can be pickled.

Nothing here computes. `flywheel.reading.scenes` fills these from TOML; `flywheel.machine` turns them into a bond graph.
Places are canonical names: a shaft (`crank`), or a mechanism's port (`press.slider`).

Also the levels of accuracy, and the keys of the tables of a scene with the words that describe each in the format.
"""

from __future__ import annotations

import copyreg
import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.numerics import notebook
from flywheel.numerics.expressions import Expression
from flywheel.numerics.faults import Fault, Remark, SceneError, show, suggestion
from flywheel.numerics.jets import is_recorded
from flywheel.numerics.units import Unit

if TYPE_CHECKING:
    from flywheel.components.motors import Motor
    from flywheel.components.wheel_stresses import WheelAsked
    from flywheel.scene.linkage import Linkage

__all__ = [
    "ANY", "AUDIT", "BODY", "CONFIRM", "DEFAULT_RTOL", "LEVELS", "MASS", "NORMAL", "NOT_NEGATIVE", "OWN_INERTIA", "POINT",
    "POSITIVE", "PROOF", "RTOL", "TURN", "Areas", "ArrayRecord", "Body", "Brake", "Clutch", "Damper", "Frozen", "Inertia",
    "Key", "Law", "Load", "Mechanism", "Output", "Phase", "PointPort", "Range", "Scene", "SceneSource", "SingleStroke",
    "Spring", "Stroke", "Table", "Transmission", "frozen", "left_out", "length", "level", "read_only", "rtol_faults",
]  # fmt: skip


NORMAL, CONFIRM, AUDIT, PROOF = ("normal", "confirm", "audit", "proof")
"""The exact figures; these and periodic collocation; these and time stepping; these and proven intervals of them."""
LEVELS = ("fast", NORMAL, CONFIRM, AUDIT, PROOF)
"""The names that are accepted: "fast" is another name of "normal", as exact figures take no longer than bounds of them."""
RTOL = (1e-14, 0.1)
"""The least and the greatest relative error that may be asked of figures."""
DEFAULT_RTOL = 1e-9
"""The relative error asked of figures where a scene names none."""


def rtol_faults(rtol: float) -> list[Fault]:
    """Faults of a required relative error; empty if it is valid.

    >>> print(*rtol_faults(1.0), *rtol_faults(1e-9))
    rtol: found 1.0, expected a number from 1e-14 to 0.1
    """
    low, high = RTOL
    return [] if low <= rtol <= high else [Fault("rtol", f"{rtol}", f"a number from {low:g} to {high:g}")]


def level(accuracy: str | None = None, simulate: bool | None = None) -> str:
    """The level by its name, or by whether to simulate: True means `audit`, False `normal`, None `audit`.

    "fast" is "normal".

    Raises:
        ValueError: for another name, or if the two contradict each other.

    >>> level(), level(simulate=False), level("confirm"), level("fast")
    ('audit', 'normal', 'confirm', 'normal')

    """
    meant = None if simulate is None else AUDIT if simulate else NORMAL
    if accuracy is None:
        return meant or AUDIT
    if accuracy not in LEVELS:
        raise ValueError(f"accuracy: found {accuracy!r}, expected one of {', '.join(LEVELS)}")
    name = NORMAL if accuracy == "fast" else accuracy
    if meant is not None and meant != name:
        raise ValueError(f"simulate={simulate} means accuracy {meant!r}, and contradicts {accuracy!r}: give one of the two")
    return name


def left_out(route: str | None, *, moves: bool) -> tuple[str, ...]:
    """Parts of a sizing that were left out, by the route of its confirmation; empty unless a motion (`moves`) is confirmed.

    >>> left_out("time", moves=True), len(left_out(None, moves=True))
    ((), 1)
    """
    if route == "collocation":
        return ("the time simulation, which confirms the figures on a route of its own",)
    return ("a confirmation of the figures by a second route",) if route != "time" and moves else ()


TURN = 2 * np.pi


def read_only(mapping: Mapping[Any, Any]) -> MappingProxyType[Any, Any]:
    """A read-only copy of a mapping."""
    return MappingProxyType(dict(mapping))


copyreg.pickle(MappingProxyType, lambda view: (read_only, (dict(view),)))  # Python itself pickles none


class ArrayRecord:
    """Base of records of arrays: read-only copies, and equality by values."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if isinstance(value, np.ndarray):
                kept = value.copy()
                kept.flags.writeable = False
                object.__setattr__(self, name, kept)

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        return all(map(np.array_equal, vars(self).values(), vars(other).values()))

    __hash__ = None  # type: ignore[assignment]

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), tuple(vars(self).values())


class Frozen:
    """A record whose dictionaries are read-only copies of those given."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if isinstance(value, dict):
                object.__setattr__(self, name, read_only(value))


class Body(NamedTuple):
    """A rigid body: mass (kg), inertia about its centre of mass (kg m²), centre of mass from the first pin (m, rad)."""

    mass: float = 0.0
    inertia: float = 0.0
    com: float = 0.0
    com_angle: float = 0.0


@dataclass(frozen=True, eq=False)
class Table(ArrayRecord):
    """Numbers against angle: `angle` ascends (rad; two equal ones are a jump), `value` is SI.

    `written` are the same as texts of quantities, shape (2, rows); empty for a table that was not read.
    """

    angle: NDArray[np.float64]
    value: NDArray[np.float64]
    interpolation: str = "linear"  # linear, pchip, step; a law's table is always a periodic cubic spline
    written: NDArray[np.str_] = field(default_factory=lambda: np.empty((2, 0), dtype=np.str_))


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
class Mechanism(Frozen):
    """One mechanism: its own crank angle is psi = ratio phi + phase, ratio being that of its shaft.

    `geometry` holds lengths (m) and angles (rad) by their path in the scene (`crank.length`, `slider.offset`,
    `yoke.direction`), and `assembly` (`open`, `crossed`) for a four-bar. `period` (rad of psi) is the span after which
    the laws of a `law` mechanism repeat; `travel` (rad of psi) is the turn of the crank in a cycle. `linkage` is the linkage
    of a mechanism of type `linkage`, `points` its ports at points of bodies. `stroke` is set if the driver moves one way
    from one end to another (rad or m of psi), instead of turning in cycles.
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

    def unweighed(self) -> Mechanism:
        """The same without masses, on which no position depends."""
        outputs = tuple(output._replace(inertia=0.0) for output in self.outputs)
        linkage = None if self.linkage is None else self.linkage.unweighed()
        return replace(self, bodies={}, outputs=outputs, linkage=linkage)


Quantity = tuple[str, float, str]
"""A quantity in a text: as it is written there, its SI value, its dimension."""


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
    model: str = ""  # what a load of a known kind is, for reports: "press: 500 J a stroke, constant, over 0.015 m..."
    quantities: tuple[Quantity, ...] = ()  # those in that text, in its order
    piston: float | None = None  # area (m²) on which a gas presses, where the force is that of one
    factor: float = 1.0  # by which the law was multiplied
    drag: bool = False  # dry friction of a shaft's own bearings: the law's size turns round with the shaft


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


class Transmission(NamedTuple):
    """Transmission between a shaft and the one with which it meshes: a gear, a belt or a chain.

    `ratio` is that of teeth or pulleys, speed of the shaft over that of `on`, without slip. `efficiency` and 1 - `slip` are
    the shares of the power that pass, in either direction. `drag` (N m) is the constant torque against the rotation of the
    shaft itself. `drives`: the scene's drive sits on the shaft or beyond it, so that the other side is the one that slips.
    A compliant shaft has a `stiffness` (N m/rad; None: rigid) and `damping` (N m s/rad) between it and its gear, at itself.
    """

    on: str = "crank"
    ratio: float = 1.0
    efficiency: float = 1.0
    slip: float = 0.0
    drag: float = 0.0
    drives: bool = False
    stiffness: float | None = None
    damping: float = 0.0

    @property
    def gear(self) -> float:
        """Speed of the shaft over that of `on`, slip included: the driven side is slower by the slip.

        >>> Transmission(ratio=2.0, slip=0.02).gear, Transmission(ratio=2.0, slip=0.5, drives=True).gear
        (1.96, 4.0)
        """
        return self.ratio / (1.0 - self.slip) if self.drives else self.ratio * (1.0 - self.slip)

    @property
    def share(self) -> float:
        """Share of the power that passes, after mesh and slip."""
        return self.efficiency * (1.0 - self.slip)


class Areas(NamedTuple):
    """Areas between the crossings of a turning-moment diagram, with the work (J) of one unit."""

    values: tuple[float, ...]
    scale: float


class Stroke(NamedTuple):
    """A one-way motion of the driver from `start` to `end` (m, or rad where it turns), with its speed and acceleration.

    `speed` is None if none is given. `sliding` is true if the reduction element
    slides (`slide`, in m) or turns (`crank`, in rad).
    """

    start: float
    end: float
    speed: float | None = None
    acceleration: float = 0.0
    sliding: bool = True

    @property
    def element(self) -> str:
        """The reduction element: `slide` where the driver slides, `crank` where it turns."""
        return "slide" if self.sliding else "crank"

    @property
    def span(self) -> float:
        """Travel of the driver, m or rad."""
        return self.end - self.start


class Clutch(NamedTuple):
    """A friction clutch in the mesh of a shaft with the one nearer to the crank; torques (N m) and heats (J) at that shaft.

    `torque` is passed while it slips, `static_torque` at most while it does not. `rise` (s) is the time in which both
    build up evenly. After `disengage` (crank angle, rad), where it is released, they last for the time `hold` and then
    vanish evenly in the time `fall`.
    """

    on: str
    torque: float
    disengage: float
    static_torque: float
    rise: float = 0.0
    fall: float = 0.0
    heat_per_stroke: float | None = None
    heat_per_hour: float | None = None
    hold: float = 0.0


class Brake(NamedTuple):
    """A brake on a shaft that stops with the crank: torque (N m) at it, applied at a crank angle `engage` (rad).

    `reverse_torque` (N m) is that against a rotation backwards, which differs for a band brake. `rise` (s) is the time in
    which its torque builds up evenly, `fall` that in which it vanishes when a stroke begins.
    """

    on: str
    torque: float
    reverse_torque: float
    engage: float
    rise: float = 0.0
    fall: float = 0.0
    heat_per_stroke: float | None = None
    heat_per_hour: float | None = None


class SingleStroke(NamedTuple):
    """A machine that works stroke by stroke: its clutch drives the crank, its brake stops it near `stop_at` (rad).

    One of `rate` (strokes per second) and `idle` (s, from standstill to the next engagement) is set. `continuous` strokes
    follow one another before the crank is stopped. For the safety distance of ISO 13855: the `approach` speed of a hand
    (m/s), the `response` time (s) of the detector, and the `intrusion` distance (m) before detection. `inch` (s) is the time
    for which a touch engages the clutch when the press is set up.
    """

    clutch: Clutch
    brake: Brake
    rate: float | None = None
    idle: float | None = None
    stop_at: float = 0.0
    continuous: int = 1
    approach: float | None = None
    response: float = 0.0
    intrusion: float = 0.0
    inch: float | None = None


ELECTRIC_BRAKING = {"none": 0, "direct-current": 1, "reversal": 3}
"""Starts whose heat a motor has about as often while it brakes: by a direct current, or by reversal of its field."""


class Phase(NamedTuple):
    """A phase of a duty: its machine, None at rest with the motor off, and its length.

    One of `duration` (s) and `cycles` (of the machine) is set. `starts` is the number of starts from rest within the phase,
    each with the `braking` after it, which counts as so many more;
    `cooling` is the share of its time that counts for the motor's cooling at rest; `loaded` is False for a phase without
    loads.
    """

    name: str
    scene: Scene | None
    duration: float | None = None
    cycles: float | None = None
    starts: int = 0
    cooling: float = 1.0
    loaded: bool = True
    braking: int = 0
    path: str = "duty[0]"


class SceneSource(NamedTuple):
    """Source of a scene: the tables of its TOML text, and the reader of a scene from such tables.

    `quantities` are the numbers that were read, by their paths as faults write them, each with its dimension.
    """

    tables: Mapping[str, Any]
    read: Callable[[Mapping[str, Any]], Scene]
    quantities: Mapping[str, Any]


@dataclass(frozen=True)
class Scene(Frozen):
    """One machine and its requirements. Speeds in rad/s, angles in rad, everything SI.

    `speed` is the mean of the greatest and least speed *of the crank* (converted if the scene names another shaft); None
    if none is given: the machine's own steady speed, if it has one, is then computed.
    `unknown` is the name of the balance: "drive", a parameter's name, or None.
    One of `irregularity` (size the flywheel) and `inertia` (analyse the given one, at its own shaft) is set, or neither
    where the scene has no flywheel: such a machine can be moved and drawn, reduced and followed, but not sized. Where the
    flywheel is sized for `limits`, by their names in `[flywheel.limits]`, `irregularity` is the one among them, or None.
    """

    speed: float | None = None
    irregularity: float | None = None
    inertia: float | None = None
    limits: Mapping[str, float] = field(default_factory=dict)
    flywheel_on: str = "crank"
    title: str | None = None
    source: str | None = None
    cycle: float = TURN
    shafts: Mapping[str, float] = field(default_factory=lambda: {"crank": 1.0})
    transmissions: Mapping[str, Transmission] = field(default_factory=dict)  # of all shafts but the crank, nearer ones first
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
    single_stroke: SingleStroke | None = None  # by clutch and brake, in place of steady running
    duty: tuple[Phase, ...] = ()  # the phases of the machine, for ever
    wheel: WheelAsked | None = None  # what the flywheel is made of and how large, where that is to be found
    rtol: float = DEFAULT_RTOL
    closure: float = 1e-9
    file: Path | None = None
    remarks: tuple[Remark, ...] = field(default=(), compare=False)  # on numbers that are hardly those that were meant
    given_as: str = field(default="", compare=False)  # what it was read from, in words: "the file press.toml"
    document: SceneSource | None = field(default=None, init=False, compare=False, repr=False)  # dataclasses.replace drops it

    def __repr__(self) -> str:
        """Short description, instead of every record."""
        kinds = [m.type for m in self.mechanisms] or (["areas"] if self.areas is not None else ["rotor"])
        counts = f"{len(self.loads)} load{'' if len(self.loads) == 1 else 's'}"
        source = f", from {self.given_as}" if self.given_as else ""
        return f"Scene({notebook.quoted(self.title)}{', '.join(dict.fromkeys(kinds))}, {counts}{source})"

    _repr_html_ = notebook.html

    def with_document(
        self, tables: Mapping[str, Any], read: Callable[[Mapping[str, Any]], Scene], quantities: Mapping[str, Any]
    ) -> Scene:
        """The same scene, with its source tables, their reader, and the numbers in them."""
        object.__setattr__(self, "document", SceneSource(frozen(tables), read, read_only(quantities)))
        return self

    def with_(self, changes: Mapping[str, Any]) -> Scene:
        """The scene with other values at some places of its text, read and checked as a whole again.

        Args:
            changes: values as a scene's file has them, by paths: keys joined by dots, in arrays the place counted from 0
                (`load.0.force`, or `load[0].force` as faults write it). Missing tables are added, the index after an array's
                last appends to it, and None removes a key or an array's item.

        Raises:
            SceneError: every fault of the changed scene; an index that an array does not have; a missing key to remove; a
                scene that was not read but made by `dataclasses.replace`.

        >>> import flywheel
        >>> crank = {"type": "slider-crank", "crank": {"length": "80 mm"}, "rod": {"length": "300 mm"}}
        >>> scene = flywheel.load({"mechanism": crank, "load": [{"on": "slider", "force": "-40 kN"}],
        ...                        "regime": {"speed": "60 rpm"}, "flywheel": {"inertia": "2 kg m^2"}})
        >>> other = scene.with_({"mechanism.crank.length": "90 mm", "load.0.force": "-38 kN", "title": "Press"})
        >>> other.mechanisms[0].geometry["crank.length"], other.loads[0].law, other.title, scene.loads[0].law
        (0.09, -38000.0, 'Press', -40000.0)
        >>> scene.with_({"regime.sped": "90 rpm"})
        Traceback (most recent call last):
        flywheel.numerics.faults.SceneError: regime.sped: found key "sped", expected a known key; did you mean "speed"?

        """
        if self.document is None:
            advice = "change the scene that it was made from"
            raise SceneError([Fault("scene", "one made by dataclasses.replace", "one that was read", advice)])
        if not isinstance(changes, Mapping):
            raise SceneError([Fault("changes", show(changes), "a mapping from paths to values")])
        tables: dict[str, Any] = _thawed(self.document.tables)
        faults = [fault for path, value in changes.items() if (fault := _put(tables, path, value)) is not None]
        if faults:
            raise SceneError(faults)
        other = self.document.read(tables)
        object.__setattr__(other, "given_as", f"changes of {self.given_as}" if self.given_as else "")
        return other

    @property
    def reduction_element(self) -> str:
        """Element to which the machine is reduced: the shaft `crank`, or on a stroke the `slide` that drives."""
        return "crank" if self.stroke is None else self.stroke.element

    @property
    def sliding(self) -> bool:
        """True if the driver slides, so that its coordinate is a position (m) and not an angle."""
        return self.stroke is not None and self.stroke.sliding

    @property
    def origin(self) -> float:
        """The coordinate (rad or m) at which the machine's own, from 0 to the cycle, begins: not 0 on a stroke."""
        return 0.0 if self.stroke is None else self.stroke.start

    @property
    def has_flywheel(self) -> bool:
        """True if a flywheel is given, or to be sized."""
        return self.irregularity is not None or self.inertia is not None or bool(self.limits)

    def with_flywheel(self, inertia: float) -> Scene:
        """The scene with a given flywheel (kg m² at its own shaft), in place of its requirements."""
        return replace(self, irregularity=None, limits={}, inertia=inertia)

    @property
    def depends_on_speed(self) -> bool:
        """True if a damper, or the law of a load or of the drive, depends on speed."""
        laws = [load.law for load in (*self.loads, *([] if self.drive is None else [self.drive]))]
        return bool(self.dampers) or any(isinstance(law, Expression) and law.uses_speed for law in laws)

    @property
    def has_speed(self) -> bool:
        """True if the speed of steady running is fixed: given, or set by torques or mesh losses that depend on it.

        Meshes also lose a share of inertia torques, which grow with the speed; that decides if all torques are known.
        """
        lossy = self.unknown is None and any(share < 1.0 for share in self.efficiencies.values())
        return self.speed is not None or self.depends_on_speed or lossy

    @cached_property
    def rubs(self) -> bool:
        """True if any joint of a linkage has friction."""
        return any(mechanism.linkage is not None and mechanism.linkage.rubs for mechanism in self.mechanisms)

    @cached_property
    def compliances(self) -> dict[str, Transmission]:
        """The transmissions of the shafts that twist."""
        return {name: one for name, one in self.transmissions.items() if one.stiffness is not None}

    @cached_property
    def efficiencies(self) -> dict[str, float]:
        """The share of the power that passes a shaft's mesh, slip included, if it is below 1."""
        meshes = self.transmissions.items()
        return {name: one.share for name, one in meshes if not (one.efficiency == 1.0 and one.slip == 0.0)}

    def with_rigid_shafts(self) -> Scene:
        """The scene without compliances of shafts."""
        rigid = {name: one._replace(stiffness=None, damping=0.0) for name, one in self.transmissions.items()}
        return replace(self, transmissions=rigid)

    def near(self, shaft: str) -> str:
        """The shaft that a shaft meshes with; the reduction element for that element itself."""
        return self.transmissions[shaft].on if shaft in self.transmissions else self.reduction_element

    def inwards(self, shaft: str) -> Iterator[str]:
        """A shaft, then those between it and the crank, the crank last."""
        while shaft != self.reduction_element:
            yield shaft
            shaft = self.near(shaft)
        yield shaft

    @property
    def flywheel_ratio(self) -> float:
        """Speed of the flywheel's shaft over the crank's."""
        return self.shafts[self.flywheel_on]


def frozen(value: Any) -> Any:
    """Tables, lists and arrays as read-only copies, to their leaves: mappings and tuples."""
    if isinstance(value, Mapping):
        return read_only({key: frozen(inner) for key, inner in value.items()})
    if isinstance(value, np.ndarray):
        return frozen(value.tolist())
    return tuple(map(frozen, value)) if isinstance(value, (list, tuple)) else value


def _thawed(value: Any) -> Any:
    """Writable copies of the results of `frozen`."""
    if isinstance(value, Mapping):
        return {key: _thawed(inner) for key, inner in value.items()}
    return list(map(_thawed, value)) if isinstance(value, tuple) else value


def _put(tables: dict[str, Any], path: object, value: Any) -> Fault | None:
    """Puts a value into nested tables and lists at a path, or removes what is there if it is None; or the fault."""
    if not isinstance(path, str):
        return Fault("changes", show(path), "a path such as mechanism.crank.length")
    place: Any = tables
    keys = re.sub(r"\[(\d+)\]", r".\1", path).split(".")
    for count, key in enumerate(keys, 1):
        at = ".".join(keys[:count])
        index: Any = key
        if isinstance(place, list):
            if not (key.isdecimal() and int(key) <= len(place)):
                return Fault(at, show(key), f"a place from 0 to {len(place)}", f"{'.'.join(keys[: count - 1])} is an array")
            index = int(key)
        elif not isinstance(place, dict):
            return Fault(at, show(place), "a table")
        missing = index == len(place) if isinstance(place, list) else index not in place
        if value is None and missing:
            names = [str(name) for name in (range(len(place)) if isinstance(place, list) else place)]
            return Fault(at, "nothing to take out", "a key that is there", suggestion(key, names))
        if count == len(keys) and value is None:
            del place[index]
        elif count == len(keys) and isinstance(place, list) and missing:
            place.append(value)
        elif count == len(keys):
            place[index] = value
        elif missing and isinstance(place, list):
            place.append({})
        elif missing:
            place[index] = {}
        if count < len(keys):
            place = place[index]
    return None


_TINIEST = 1e-50  # least positive number: squares and products of smaller ones leave the floating-point range


class Range(NamedTuple):
    """The values a key may take, from `low` to `high`; an end may be left out of the range."""

    low: float = -math.inf
    high: float = math.inf
    low_open: bool = False
    high_open: bool = False

    def __contains__(self, value: object) -> bool:
        if not isinstance(value, (int, float)) and not is_recorded(value):
            return False
        if self.low_open and self.low == 0.0 and value < _TINIEST:
            return False
        above = value > self.low if self.low_open else value >= self.low
        return above and (value < self.high if self.high_open else value <= self.high)

    def __str__(self) -> str:
        low = f"{'above' if self.low_open else 'at least'} {self.low:g}" if self.low > -math.inf else ""
        high = f"{'below' if self.high_open else 'at most'} {self.high:g}" if self.high < math.inf else ""
        return " and ".join(filter(None, (low, high))) or "any"


ANY = Range()
POSITIVE = Range(0.0, low_open=True)
NOT_NEGATIVE = Range(0.0)


class Key(NamedTuple):
    """One key of a table.

    kind: a dimension of `flywheel.numerics.units.DIMENSIONS`; two of them for a place that translates and one that rotates
    ("mass | inertia"); or "text", "name", "choice", "law" (quantity or expression), "position" (expression or table),
    "table", "numbers", "index", "unit", "tables" (a table of named tables), "list" (of tables, names or lengths), "flag",
    "model" (a table whose keys depend on its type), "changes" (values by paths of the scene).
    default: SI, or None if there is none. missing: advice if a required key is missing. example: of a value, if that of its
    dimension does not fit. many_turns: an angle that may be any number of turns even without a unit.
    """

    name: str
    kind: str
    about: str
    default: float | str | None = None
    range: Range = ANY
    required: bool = False
    choices: tuple[str, ...] = ()
    missing: str = ""
    example: str = ""
    many_turns: bool = False


def length(about: str, name: str = "length") -> Key:
    """A required length above 0."""
    return Key(name, "length", about, required=True, range=POSITIVE)


MASS = Key("mass", "mass", "mass of the body", 0.0, NOT_NEGATIVE)
OWN_INERTIA = Key("inertia", "inertia", "inertia about its own centre of mass", 0.0, NOT_NEGATIVE)
POINT = (MASS,)
BODY = (
    MASS,
    OWN_INERTIA,
    Key("com", "length", "distance of the centre of mass from the first pin, towards the other pin", 0.0),
    Key("com_angle", "angle", "angle of that distance from the line of the pins, counter-clockwise", 0.0),
)
