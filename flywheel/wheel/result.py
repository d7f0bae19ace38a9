"""A wheel that has been chosen: dimensions, masses, stresses, and what must be said about them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from flywheel.wheel.asked import WheelAsked
from flywheel.wheel.bodies import Body, Part, parts, stress
from flywheel.wheel.materials import Material

_THICK = 0.2  # thickness over mean radius from which a thin rim is off by 1 % of its inertia, 20 % of its bore stress
ROUNDING = 1e-9  # of an allowable value: what passes it by no more is within it


@dataclass(frozen=True)
class Wheel:
    """A wheel with all its dimensions (see `Body`), at a speed (rad/s).

    `needed` is the inertia that it was made for (kg m²), rounded up where that was asked; `stresses` are the greatest by
    place (Pa); `compared` holds the masses (kg) of the lightest wheel of each shape, where the lightest was asked for.
    """

    body: Body
    material: Material
    speed: float
    needed: float
    parts: tuple[Part, ...]
    stresses: Mapping[str, float]
    warnings: tuple[str, ...] = ()
    compared: Mapping[str, float] = field(default_factory=dict)

    @property
    def shape(self) -> str:
        """`disc`, `rim` or `arms`."""
        return self.body.shape

    @property
    def inertia(self) -> float:
        """Inertia of the whole wheel, kg m²: at least what is needed, more where dimensions were rounded up."""
        return sum(part.inertia for part in self.parts)

    @property
    def mass(self) -> float:
        """Mass of the parts whose mass is known, kg."""
        return sum(part.mass for part in self.parts if part.mass is not None)

    @property
    def rim_speed(self) -> float:
        """Speed of the outer radius, of the mean radius of a thin rim, m/s."""
        return self.speed * self.body.running

    @property
    def place(self) -> str:
        """Where the stress is greatest."""
        return max(self.stresses, key=lambda name: self.stresses[name])

    @property
    def greatest_stress(self) -> float:
        """The greatest stress anywhere in the wheel, Pa."""
        return max(self.stresses.values())

    @property
    def safety(self) -> float | None:
        """Safety factor: strength (the allowable stress where that alone is known) over the greatest stress."""
        reference = self.material.reference
        return None if reference is None else reference / self.greatest_stress

    @property
    def utilisation(self) -> float | None:
        """The greatest stress over the allowable one."""
        return None if self.material.allowable is None else self.greatest_stress / self.material.allowable

    def as_dict(self) -> dict[str, Any]:
        """Everything for JSON, SI throughout; what a shape does not have is null."""
        body, hub, arms = self.body, self.body.hub, self.body.arms
        return {
            "shape": self.shape,
            "method": "thin" if body.thin else "exact",
            "material": {key: value for key, value in self.material._asdict().items() if key != "about"},
            "needed": self.needed,
            "inertia": self.inertia,
            "mass": self.mass,
            "outer_radius": body.outer,
            "inner_radius": body.inner,
            "mean_radius": body.mean,
            "width": body.width,
            "thickness": body.thickness,
            "arms": None if arms is None else arms._asdict(),
            "hub": None if hub is None else hub._asdict(),
            "parts": [part._asdict() for part in self.parts],
            "speed": self.speed,
            "rim_speed": self.rim_speed,
            "stresses": dict(self.stresses),
            "greatest_stress": self.greatest_stress,
            "safety": self.safety,
            "compared": dict(self.compared) or None,
            "warnings": list(self.warnings),
        }


def wheel_of(asked: WheelAsked, body: Body, speed: float, needed: float | None = None) -> Wheel:
    """A wheel of known dimensions at a speed (rad/s): masses, stresses and warnings.

    Args:
        asked: material and torque; whatever else it holds, `body` goes.
        body: all dimensions.
        speed: of the wheel, at which stresses are wanted, rad/s.
        needed: inertia that it must have (kg m²); its own if None.

    >>> from flywheel.wheel.materials import material
    >>> found = wheel_of(WheelAsked("disc", material("carbon steel")), Body("disc", 0.3, 0.0, 0.3, 0.05), 100.0)
    >>> round(found.mass, 3), round(found.inertia, 4), round(found.safety, 1)
    (110.977, 4.994, 104.7)

    """
    made = parts(body, asked.material.density)
    inertia = sum(part.inertia for part in made)
    found = stress(body, asked.material, speed, asked.torque)
    wheel = Wheel(body, asked.material, speed, inertia if needed is None else needed, made, found)
    return replace(wheel, warnings=tuple(_warnings(asked, wheel)))


def _warnings(asked: WheelAsked, wheel: Wheel) -> list[str]:
    """What a designer should know of the wheel, one sentence each."""
    body, usual, allowable = wheel.body, wheel.material.rim_speed, wheel.material.allowable
    found = []
    if usual is not None and wheel.rim_speed > usual * (1 + ROUNDING):
        found.append(f"the rim runs at {wheel.rim_speed:.4g} m/s; {wheel.material.name} usually stays below {usual:g} m/s")
    if allowable is not None and wheel.greatest_stress > allowable * (1 + ROUNDING):
        stressed = f"the stress of {wheel.greatest_stress / 1e6:.4g} MPa ({wheel.place})"
        found.append(f"{stressed} is above the allowable {allowable / 1e6:.4g} MPa: {_remedy(wheel)}")
    if body.width > 2 * body.outer:
        found.append(f"the {body.width:.4g} m of its width are more than its diameter: the formulas are those of thin discs")
    if body.thin and body.thickness > _THICK * body.mean:
        share = body.thickness / body.mean
        found.append(f"the rim is taken as thin, but it is {share:.0%} of its mean radius thick: take the exact method")
    if body.share < 1.0:
        found.append(
            f"hub and arms are taken to have {1 - body.share:.4g} of the inertia; the mass is that of the rim alone"
        )
    if body.arms is not None and asked.torque is None:
        found.append("no torque between hub and rim is given: the arms' bending by it is left out")
    return found


def _remedy(wheel: Wheel) -> str:
    """What to change in a wheel that is stressed too much."""
    if wheel.place.startswith("arms"):
        return "enlarge arm_share or hub_diameter, or take another material"
    return "take a smaller radius, another material, or shape lightest with a max_radius"
