"""What is told of a motion that was followed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from flywheel.scene import TURN, Scene
from flywheel.simulation import Motion
from flywheel.transients.looking import Peak


class Energy(NamedTuple):
    """Where the energy of a motion came from and went (J): works of drive and loads, heat, and kinetic energy gained.

    `works` are by part, those of dampers and friction below 0; `meshes` is what meshes lost. What drive, loads and meshes
    leave is the kinetic energy gained, but for `residual`, a share of the largest of them or of the greatest kinetic energy.
    `copper` is the heat in a DC motor's armature, `rotor_heat` that in an induction motor's rotor, torque times slip speed.
    Neither is part of that balance: the drive's work is what its shaft gives.
    """

    drive: float
    works: dict[str, float]
    meshes: float
    kinetic_gained: float
    residual: float
    copper: float | None
    rotor_heat: float | None = None


class Peaks(NamedTuple):
    """Greatest speed of the crank (rad/s), torque of the drive (N m, at its shaft), its power (W), a motor's current (A)."""

    speed: Peak
    torque: Peak | None
    power: Peak | None
    current: Peak | None


@dataclass(frozen=True, repr=False)
class Transient:
    """A machine followed from a start to an end.

    `ended` says in words how, `reason` in one: `time`, `way`, `speed`, `share`, `regime`, `stop`, `stall` (its drive pushes,
    and is too weak), `creep` (it slows down for ever), `limit` (what was asked for does not come), `stroke`.
    `time` (s), `phi` (rad) and `omega` (rad/s) are those of the end; `way` (rad) is how far it went, `turns` the same in
    turns. On a stroke whose driver slides, m.

    `regime_speed` is the mean over time of the steady cycle that the machine has with its drive (rad/s), None where there is
    none; `time_to_regime` the first time (s) at which the crank is as fast as 95 % of that. `inertia` is the flywheel's, at
    its own shaft (kg m²). `given_errors` are those of inertia, balance and regime speed, in their units.
    """

    scene: Scene
    motion: Motion
    ended: str
    reason: str
    inertia: float
    balance: float
    regime_speed: float | None
    time_to_regime: float | None
    peaks: Peaks
    energy: Energy
    rtol: float
    messages: tuple[str, ...] = ()
    given_errors: Mapping[str, float | None] = field(default_factory=dict)

    def __repr__(self) -> str:
        """How it ended, instead of the motion."""
        figures = f"time={self.time:.6g}, turns={self.turns:.6g}, omega={self.omega:.6g}"
        return f"Transient({self.reason}: {self.ended}; {figures})"

    @property
    def time(self) -> float:
        """When it ended, s."""
        return float(self.motion.t[-1])

    @property
    def phi(self) -> float:
        """Where it ended, rad."""
        return float(self.motion.phi[-1])

    @property
    def omega(self) -> float:
        """The speed at the end, rad/s: 0 of a machine that stopped, whose motion ends there to rounding."""
        return 0.0 if self.reason in ("stop", "stall") else float(self.motion.omega[-1])

    @property
    def way(self) -> float:
        """How far it went, rad."""
        return float(self.motion.phi[-1] - self.motion.phi[0])

    @property
    def turns(self) -> float:
        """How far it went, in turns of the crank."""
        return self.way / TURN

    @property
    def error(self) -> float:
        """Estimated error of position and speed, relative to the way gone and to the greatest speed."""
        return self.motion.error

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON, SI throughout."""
        return {
            "title": self.scene.title,
            "reduction": self.scene.reduction_element,
            "reason": self.reason,
            "ended": self.ended,
            "start": {"phi": float(self.motion.phi[0]), "omega": float(self.motion.omega[0])},
            "end": {"t": self.time, "phi": self.phi, "omega": self.omega},
            "way": self.way,
            "turns": self.turns,
            "flywheel": {"on": self.scene.flywheel_on, "inertia": self.inertia},
            "balance": self.scene.unknown and {"name": self.scene.unknown, "value": self.balance},
            "regime_speed": self.regime_speed,
            "time_to_95_percent": self.time_to_regime,
            "peaks": {name: found and found._asdict() for name, found in self.peaks._asdict().items()},
            "energy": self.energy._asdict(),
            "error": self.error,
            "energy_residual": self.motion.energy_residual,
            "drift": self.motion.drift,
            "rtol": self.rtol,
            "messages": list(self.messages),
        }
