"""Shafts geared to one another, with losses in the meshes; the same flywheel compared on every shaft.

Speeds, torques and accelerations count positive in each shaft's own rotation, so that every ratio is above 0. Shafts and
stages form a tree. A mesh loses a share 1 - eta of the power through it, in either direction: with tau the torque that the
far side of a stage needs (its inertia times its acceleration, less its torques), the torque on the near side is r tau/eta if
it drives and r tau eta if it is driven, with r the far speed over the near one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from flywheel.numerics.faults import (
    ANY,
    NOT_NEGATIVE,
    POSITIVE,
    Fault,
    SceneError,
    entry,
    name_faults,
    number_faults,
    refuse,
)


class Shaft(NamedTuple):
    """Inertia of a shaft (kg m²), torque on it (N m), and friction (N m) against its motion."""

    inertia: float
    torque: float = 0.0
    friction: float = 0.0


class Stage(NamedTuple):
    """A gear or belt stage: `ratio` is the speed of `driven` over that of `driving`; either of them may drive."""

    driving: str
    driven: str
    ratio: float
    efficiency: float = 1.0


class Mesh(NamedTuple):
    """Torques of a stage: taken from its driving shaft and given to its driven one (N m).

    `forward` is true if power goes from driving to driven; `lost` times the driving shaft's speed is the power lost.
    """

    driving: str
    driven: str
    torque_in: float
    torque_out: float
    forward: bool
    lost: float


class Running(NamedTuple):
    """A train in motion, or about to move: `direction` is 1 or -1, or 0 if it stays at rest.

    `accelerations` of every shaft (rad/s²); `inertia` and `moment` reduced to the shaft `on`, with losses in the present
    direction of power (kg m², N m); `torque` that must also act on it (N m): inertia * acceleration = moment + torque.
    `meshes` are empty if the train stays at rest, because its losses are then undetermined.
    """

    on: str
    direction: int
    accelerations: Mapping[str, float]
    inertia: float
    moment: float
    torque: float
    meshes: tuple[Mesh, ...]


def with_rope(shaft: Shaft, mass: float, radius: float, pull: float) -> Shaft:
    """A shaft with a rope on a drum: inertia + m r², torque + F r.

    Args:
        shaft: without the rope.
        mass: m on the rope, kg.
        radius: r of the drum, m.
        pull: F in the direction of the drum's rotation, N: m g where the mass sinks, -m g where it is lifted.

    Raises:
        SceneError: if a number is out of range.

    Valid for a rope that stays taut and does not slip or stretch. Source: Khurmi and Gupta, example 3.13.

    >>> with_rope(Shaft(100.0), 75.0, 0.3, 75.0 * 9.81)
    Shaft(inertia=106.75, torque=220.725, friction=0.0)

    """
    faults = number_faults("mass", mass, NOT_NEGATIVE, "kg") + number_faults("radius", radius, POSITIVE, "m")
    refuse(faults + number_faults("pull", pull, unit="N"))
    return shaft._replace(inertia=shaft.inertia + mass * radius**2, torque=shaft.torque + pull * radius)


def geared_acceleration(
    shafts: Mapping[str, Shaft], stages: Sequence[Stage], on: str | None = None, direction: int = 1
) -> Running:
    """Acceleration of geared shafts under given torques, with losses in every mesh in the direction of its power.

    The additional moment needed on the shaft `on`, R(alpha) = I alpha - T + sum of its stages' torques, is linear between
    the accelerations at which a mesh is without load, convex (concave when turning backwards) and rising: Newton's
    method ends after finitely many steps at its one root, which is exact except for rounding.

    Args:
        shafts: by name.
        stages: that join them to a tree.
        on: the shaft of reduction; the first if None.
        direction: 1 or -1 as the shafts turn; 0 at rest: they then start in the direction in which torques overcome friction
            and losses, or stay.

    Raises:
        SceneError: if the shafts are no tree, have no inertia, or a number is out of range.

    Valid for efficiencies that are equal in both directions and independent of load and speed.
    Source: Khurmi and Gupta, Theory of Machines, section 3.19 and example 3.13; Bevan, chapter 2, example 10.

    >>> drum = with_rope(Shaft(100.0), 75.0, 0.3, 75.0 * 9.81)
    >>> stages = [Stage("drum", "rotor", 6.0, 0.9)]
    >>> running = geared_acceleration({"drum": drum, "rotor": Shaft(5.0)}, stages)
    >>> round(running.accelerations["drum"] * 0.3, 9), running.meshes[0].forward  # m/s², printed 0.216
    (0.215867971, True)

    """
    train = _GearTrain(shafts, stages, on)
    if direction not in (1, -1, 0):
        raise SceneError([Fault("direction", f"{direction!r}", "1, -1 or 0")])
    if direction:
        return train.free(direction)
    for sense in (1, -1):
        running = train.free(sense)
        if running.accelerations[running.on] * sense > 0.0:
            return running
    still = _GearTrain(shafts, [stage._replace(efficiency=1.0) for stage in stages], train.root).at(0.0, 1)
    return Running(train.root, 0, dict.fromkeys(train.order, 0.0), still.inertia, 0.0, 0.0, ())


def geared_torque(
    shafts: Mapping[str, Shaft], stages: Sequence[Stage], on: str, acceleration: float, direction: int = 1
) -> Running:
    """Torque on a shaft for a given acceleration: T = I alpha - M, reduced to it, with losses in the direction of power.

    Args:
        shafts: by name; without the motor's torque.
        stages: that join them to a tree.
        on: the motor's shaft.
        acceleration: of that shaft, rad/s².
        direction: 1 or -1 as the shafts turn.

    Raises:
        SceneError: if the shafts are no tree, or a number is out of range.

    Valid as `geared_acceleration`. Source: Khurmi and Gupta, example 3.18 (mine hoist).

    >>> stages = [Stage("motor", "drum", 0.1, 0.8)]
    >>> hoist = {"motor": Shaft(0.5), "drum": with_rope(Shaft(20.0), 100.0, 0.4, -981.0)}
    >>> round(geared_torque(hoist, stages, "motor", 0.0).torque, 9)  # lifting evenly: 39.24/0.8
    49.05
    >>> round(geared_torque(hoist, stages, "motor", 0.0, -1).torque, 9)  # lowering: 39.24 * 0.8
    31.392

    """
    train = _GearTrain(shafts, stages, on)
    refuse(number_faults("acceleration", acceleration, ANY, "rad/s²"))
    if direction not in (1, -1):
        raise SceneError([Fault("direction", f"{direction!r}", "1 or -1")])
    return train.at(acceleration, direction)


class _GearTrain:
    """A tree of shafts, ordered from its root outwards."""

    def __init__(self, shafts: Mapping[str, Shaft], stages: Sequence[Stage], on: str | None) -> None:
        _check_train(shafts, stages)
        self.root = next(iter(shafts)) if on is None else on
        entry("on", self.root, shafts)
        self.shafts, self.stages = shafts, stages
        # every shaft but the root once, after the one that it hangs on: both, the ratio between them, and their stage
        self.branches: list[tuple[str, str, float, Stage]] = []
        self.gains = {self.root: 1.0}
        left = list(stages)
        for near in (reached := [self.root]):
            for stage in [stage for stage in left if near in (stage.driving, stage.driven)]:
                left.remove(stage)
                outward = stage.driving == near
                far = stage.driven if outward else stage.driving
                if far not in reached:
                    reached.append(far)
                    ratio = stage.ratio if outward else 1.0 / stage.ratio
                    self.branches.append((far, near, ratio, stage))
                    self.gains[far] = self.gains[near] * ratio
        self.order = [name for name in shafts if name in self.gains]
        if apart := [name for name in shafts if name not in self.gains]:
            raise SceneError([Fault("stages", f"no stage to {', '.join(apart)}", "stages that join all shafts")])
        if len(stages) >= len(shafts):
            defect, expected = f"{len(stages)} stages between {len(shafts)} shafts", "one stage fewer than shafts"
            raise SceneError([Fault("stages", defect, expected, "a closed loop shares its load by stiffness")])

    def free(self, direction: int) -> Running:
        """The motion under the shafts' own torques."""
        if not any(shaft.inertia > 0.0 for shaft in self.shafts.values()):
            raise SceneError([Fault("shafts", "shafts without inertia", "an inertia above 0 on one of them")])
        alpha, seen = 0.0, set()
        while True:
            running = self.at(alpha, direction)
            forward = tuple(mesh.forward for mesh in running.meshes)
            if forward in seen:  # a linear piece that was solved already: alpha is its root
                return running._replace(torque=0.0)
            seen.add(forward)
            alpha = running.moment / running.inertia

    def at(self, alpha: float, direction: int) -> Running:
        """The motion with the root at an acceleration, and the torque that it needs."""
        numbers = {
            name: shaft.inertia * self.gains[name] * alpha - shaft.torque + direction * shaft.friction
            for name, shaft in self.shafts.items()
        }
        slopes = {name: shaft.inertia * self.gains[name] for name, shaft in self.shafts.items()}
        meshes = {}
        for far, near, ratio, stage in reversed(self.branches):
            tau = numbers[far]
            outward = tau * direction >= 0.0
            felt = ratio * (1.0 / stage.efficiency if outward else stage.efficiency)
            numbers[near] += felt * tau
            slopes[near] += felt * slopes[far]
            taken, delivered, forward = felt * tau, tau, outward
            if stage.driving != near:  # the root is on the driven side
                taken, delivered, forward = -tau, -felt * tau, not outward
            meshes[stage] = Mesh(stage.driving, stage.driven, taken, delivered, forward, taken - stage.ratio * delivered)
        torque, inertia = numbers[self.root], slopes[self.root]
        accelerations = {name: self.gains[name] * alpha for name in self.order}
        ordered = tuple(meshes[stage] for stage in self.stages)
        return Running(self.root, direction, accelerations, inertia, inertia * alpha - torque, torque, ordered)


def _check_train(shafts: Mapping[str, Shaft], stages: Sequence[Stage]) -> None:
    """Refuses numbers out of range and names that are no shafts."""
    faults = [] if shafts else [Fault("shafts", "nothing", "at least one shaft")]
    for name, shaft in shafts.items():
        faults += number_faults(f"{name}.inertia", shaft.inertia, NOT_NEGATIVE, "kg m²")
        faults += number_faults(f"{name}.torque", shaft.torque, ANY, "N m")
        faults += number_faults(f"{name}.friction", shaft.friction, NOT_NEGATIVE, "N m")
    for k, stage in enumerate(stages):
        faults += name_faults(f"stages[{k}].driving", stage.driving, shafts)
        faults += name_faults(f"stages[{k}].driven", stage.driven, shafts)
        faults += number_faults(f"stages[{k}].ratio", stage.ratio, POSITIVE)
        own = number_faults(f"stages[{k}].efficiency", stage.efficiency, POSITIVE)
        if not own and stage.efficiency > 1:
            own = [Fault(f"stages[{k}].efficiency", f"{stage.efficiency:g}", "above 0 and at most 1")]
        faults += own
    refuse(faults)


def gd2(inertia: float) -> float:
    """GD² (kg m²) of an inertia: 4 J, the mass times the square of the diameter of gyration.

    Args:
        inertia: J, kg m².

    Raises:
        SceneError: if the inertia is below 0.

    In the old form, a weight times that square, it has the same number in kgf m².
    Source: G D² = 4 g J in the technical system, with G in kgf and g = 9.80665 m/s².

    >>> gd2(12.0)
    48.0

    """
    refuse(number_faults("inertia", inertia, NOT_NEGATIVE, "kg m²"))
    return 4.0 * inertia


class OnShaft(NamedTuple):
    """The same flywheel on one shaft: speed `ratio` to the crank's and `speed` (rad/s), `inertia` and `gd2` (kg m²).

    As a thin rim or as a wheel: `radius` (m), `mass` (kg), `rim_speed` (m/s) there; None if none is known.
    """

    shaft: str
    ratio: float
    speed: float
    inertia: float
    gd2: float
    radius: float | None
    mass: float | None
    rim_speed: float | None

    @property
    def energy(self) -> float:
        """Kinetic energy, J: the same on every shaft."""
        return self.inertia * self.speed**2 / 2

    def as_dict(self) -> dict[str, Any]:
        """All figures for JSON, SI, with the kinetic energy."""
        return {**self._asdict(), "energy": self.energy}


def on_every_shaft(
    inertia: float,
    ratios: Mapping[str, float],
    speed: float,
    *,
    on: str = "crank",
    radius: float | None = None,
    rim_speed: float | None = None,
) -> tuple[OnShaft, ...]:
    """The equivalent flywheels on each shaft: J_s = J (r_on/r_s)², GD² = 4 J_s.

    For a thin rim of one radius R: m = J_s/R², and the rim runs at R w_s: on a faster shaft less mass at more rim speed.
    For a thin rim at one rim speed v: R = v/w_s and m = J_s w_s²/v², which is 2 E/v²: the same mass on every shaft.

    Args:
        inertia: J on the shaft `on`, kg m².
        ratios: speed of each shaft over the crank's.
        speed: of the crank, rad/s.
        on: the shaft where the inertia is known.
        radius: R of the rim, m.
        rim_speed: v of the rim, m/s; at most one of the two.

    Raises:
        SceneError: if the shaft is not known, both radius and rim speed are given, or a number is out of range.

    Valid where the shafts are geared without slip. Source: equal kinetic energy; the course's March 2010 exam, whose
    flywheel is a quarter on a shaft that turns twice as fast.

    >>> first, second = on_every_shaft(10.256, {"crank": 1.0, "motor": 2.0}, 22.0, rim_speed=11.0)
    >>> second.inertia, second.gd2, first.mass == second.mass, first.radius, second.radius
    (2.564, 10.256, True, 0.5, 0.25)

    """
    faults = number_faults("inertia", inertia, NOT_NEGATIVE, "kg m²") + number_faults("speed", speed, POSITIVE, "rad/s")
    for name, ratio in ratios.items():
        faults += number_faults(f"ratios.{name}", ratio, POSITIVE)
    sizes = {"radius": (radius, "m"), "rim_speed": (rim_speed, "m/s")}
    complete = {name: pair for name, pair in sizes.items() if pair[0] is not None}
    faults += [f for name, (value, unit) in complete.items() for f in number_faults(name, value, POSITIVE, unit)]
    if len(complete) > 1:
        faults.append(Fault("radius", "radius and rim_speed", "one of the two at most"))
    refuse([*faults, *name_faults("on", on, ratios)])
    shafts = []
    for name, ratio in ratios.items():
        own, turning = inertia * (ratios[on] / ratio) ** 2, ratio * speed
        rim = rim_speed / turning if rim_speed is not None else radius
        mass, rim_velocity = (None, None) if rim is None else (own / rim**2, rim * turning)
        shafts.append(OnShaft(name, ratio, turning, own, gd2(own), rim, mass, rim_velocity))
    return tuple(shafts)
