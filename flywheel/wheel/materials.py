"""Materials of wheels: what a wheel's mass and stress need, and a small table."""

from __future__ import annotations

from typing import NamedTuple

from flywheel.arguments import POSITIVE, known, number_faults, refuse
from flywheel.faults import Fault

POISSON = 0.3
"""Poisson's ratio where a material names none: that of steel."""


class Material(NamedTuple):
    """What a wheel is made of.

    `density` in kg/m³; `allowable` stress in Pa, None where it is not to be judged; `strength` in Pa (tensile strength of a
    brittle material, yield strength of a ductile one), which the safety factor refers to where it is known; `poisson` of
    the lateral strain; `rim_speed` in m/s up to which rims of it usually run, None where there is no such custom.
    """

    name: str
    density: float
    allowable: float | None = None
    strength: float | None = None
    poisson: float = POISSON
    rim_speed: float | None = None
    about: str = ""

    @property
    def reference(self) -> float | None:
        """What a safety factor refers to, Pa: the strength, or the allowable stress where that alone is known."""
        return self.strength if self.strength is not None else self.allowable


def _metal(
    name: str, density: float, strength: float, factor: float, poisson: float, rim: float | None, about: str
) -> Material:
    return Material(name, density, strength / factor, strength, poisson, rim, about)


_IRON, _DUCTILE = 10.0, 4.0

MATERIALS = {
    material.name: material
    for material in (
        _metal("grey cast iron", 7200.0, 115e6, _IRON, 0.26, 30.0, "EN-GJL-200, as expected in a wall of 80 mm (EN 1561)"),
        _metal("ductile iron", 7100.0, 250e6, _DUCTILE, 0.275, None, "EN-GJS-400-15, proof stress (EN 1563)"),
        _metal("cast steel", 7800.0, 240e6, _DUCTILE, 0.3, 40.0, "GE240, proof stress (EN 10293)"),
        _metal(
            "carbon steel", 7850.0, 305e6, _DUCTILE, 0.3, 40.0, "C45 normalised, 16 to 100 mm, yield strength (EN 10083-2)"
        ),
        _metal(
            "alloy steel", 7850.0, 650e6, _DUCTILE, 0.3, None, "42CrMo4 tempered, 40 to 100 mm, yield strength (EN 10083-3)"
        ),
        _metal(
            "aluminium", 2700.0, 240e6, _DUCTILE, 0.33, None, "EN AW-6082-T6 plate, 12.5 to 100 mm, proof stress (EN 485-2)"
        ),
    )
}
"""Usual metals by name.

Strengths are least values of the standards. The allowable stress is a tenth of the tensile strength of grey iron (the
factor that Machinery's Handbook asks of cast wheels) and a quarter of the yield strength of ductile metals, which is this
table's own choice for a stress that comes and goes at every start. Rim speeds: Machinery's Handbook has 6000 ft/min for
cast iron; 40 m/s for steel is old custom, which stress outdates. Give values of your own where you have better ones.
"""


def material(
    name: str = "",
    density: float | None = None,
    allowable: float | None = None,
    strength: float | None = None,
    safety: float | None = None,
    poisson: float | None = None,
) -> Material:
    """A material of the table, of own values, or of the table with own values in place of some.

    Args:
        name: of the table; empty for a material of own values, which needs a density.
        density: kg/m³.
        allowable: allowable stress, Pa.
        strength: Pa, which the safety factor refers to.
        safety: factor asked for: the allowable stress is strength over it.
        poisson: Poisson's ratio, 0 to 0.5.

    Raises:
        SceneError: if the name is unknown, a number is out of range, the density is missing, or the allowable stress is
            given twice (as such, and as a safety factor).

    >>> material("carbon steel").allowable, material("carbon steel", safety=5.0).allowable
    (76250000.0, 61000000.0)
    >>> material(density=7200.0, allowable=7.5e6).poisson
    0.3

    """
    given = {"density": density, "allowable_stress": allowable, "strength": strength, "safety": safety}
    faults = [fault for key, value in given.items() if value is not None for fault in number_faults(key, value, POSITIVE)]
    if poisson is not None and (number_faults("poisson", poisson) or not 0.0 <= poisson <= 0.5):
        faults.append(Fault("poisson", f"{poisson}", "a number from 0 to 0.5"))
    refuse(faults)
    base = known("material", name, MATERIALS) if name else Material("own material", density or 0.0)
    if density is None and not name:
        faults.append(Fault("material", "neither material nor density", "one of them", f"known: {', '.join(MATERIALS)}"))
    if safety is not None:
        faults += _safety_faults(allowable, strength or base.strength)
    refuse(faults)
    strength = strength if strength is not None else base.strength
    return base._replace(
        density=base.density if density is None else density,
        allowable=_allowable(base, allowable, strength, safety),
        strength=strength,
        poisson=base.poisson if poisson is None else poisson,
    )


def _safety_faults(allowable: float | None, strength: float | None) -> list[Fault]:
    """A safety factor needs a strength, and leaves no allowable stress to be given."""
    if allowable is not None:
        return [
            Fault("safety", "safety and allowable_stress", "one of them", "the allowable stress is strength over safety")
        ]
    if strength is None:
        return [Fault("safety", "a safety factor without a strength", "a strength beside it")]
    return []


def _allowable(base: Material, allowable: float | None, strength: float | None, safety: float | None) -> float | None:
    """The allowable stress: as given, or from the strength by the factor asked for or usual for that material."""
    if allowable is not None:
        return allowable
    if strength is None:
        return None
    if safety is not None:
        return strength / safety
    if base.allowable is not None and base.strength is not None:
        return strength * base.allowable / base.strength
    return None
