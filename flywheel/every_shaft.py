"""The same flywheel compared on every shaft of a machine: inertia, GD², mass and rim speed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from flywheel.arguments import NOT_NEGATIVE, POSITIVE, name_faults, number_faults, refuse
from flywheel.faults import Fault


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

    As a thin rim or as a wheel: `radius` (m), `mass` (kg), `rim_speed` (m/s) there; None where none is known.
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
        """Everything for JSON, SI, with the kinetic energy."""
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
    """The flywheels that do the same on each shaft: J_s = J (r_on/r_s)², GD² = 4 J_s.

    As a thin rim of one radius R: m = J_s/R², and the rim runs at R w_s: on a faster shaft less mass at more rim speed.
    As a thin rim at one rim speed v: R = v/w_s and m = J_s w_s²/v², which is 2 E/v²: the same mass on every shaft.

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
    given = {name: pair for name, pair in sizes.items() if pair[0] is not None}
    faults += [f for name, (value, unit) in given.items() for f in number_faults(name, value, POSITIVE, unit)]
    if len(given) > 1:
        faults.append(Fault("radius", "radius and rim_speed", "one of the two at most"))
    refuse([*faults, *name_faults("on", on, ratios)])
    rows = ((name, ratio, inertia * (ratios[on] / ratio) ** 2) for name, ratio in ratios.items())
    return tuple(_on_shaft(name, ratio, ratio * speed, own, radius, rim_speed) for name, ratio, own in rows)


def _on_shaft(
    name: str, ratio: float, speed: float, inertia: float, radius: float | None, rim_speed: float | None
) -> OnShaft:
    """A flywheel on one shaft, as a rim where its radius or its speed is known."""
    if rim_speed is not None:
        radius = rim_speed / speed
    if radius is None:
        return OnShaft(name, ratio, speed, inertia, gd2(inertia), None, None, None)
    return OnShaft(name, ratio, speed, inertia, gd2(inertia), radius, inertia / radius**2, radius * speed)
