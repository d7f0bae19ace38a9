"""A wheel as rows of a report."""

from __future__ import annotations

from flywheel.every_shaft import gd2
from flywheel.wheel.result import ROUNDING, Wheel
from flywheel.writing.digits import figure

Row = tuple[str, str, str]

_MEGA = 1e6
_DIGITS = 6


def rows(wheel: Wheel) -> list[Row]:
    """Name, value and unit of everything about a wheel: dimensions in mm, stresses in MPa.

    >>> from flywheel.wheel import WheelAsked, choose, material
    >>> wheel = choose(10.0, 100.0, WheelAsked("disc", material("carbon steel"), outer_radius=0.3))
    >>> rows(wheel)[:3]
    [('shape', 'disc', ''), ('material', 'carbon steel', ''), ('outer radius', '300', 'mm')]
    """
    return [
        ("shape", _shape(wheel), ""),
        ("material", wheel.material.name, ""),
        *_dimensions(wheel),
        *_masses(wheel),
        ("rim speed", _number(wheel.rim_speed), "m/s"),
        *((f"stress, {place}", _number(value / _MEGA), _mega(wheel, value)) for place, value in wheel.stresses.items()),
        *_judgement(wheel),
    ]


def _shape(wheel: Wheel) -> str:
    return f"{wheel.shape}, taken as thin" if wheel.body.thin else wheel.shape


_COMPARED = {
    "disc": "the lightest disc instead",
    "rim": "the lightest rim instead",
    "arms": "the lightest rim on arms instead",
}


def _mega(wheel: Wheel, stress: float) -> str:
    """The unit of a stress, with a mark where it is too much."""
    allowable = wheel.material.allowable
    return "MPa" if allowable is None or stress <= allowable * (1 + ROUNDING) else "MPa, above the allowable"


def _number(value: float) -> str:
    return figure(value, most=_DIGITS)


def _size(name: str, value: float) -> Row:
    return name, _number(value * 1e3), "mm"


def _dimensions(wheel: Wheel) -> list[Row]:
    """Every dimension that the shape has."""
    body, found = wheel.body, [_size("outer radius", wheel.body.outer)]
    if wheel.shape != "disc":
        found += [_size("mean radius", body.mean), _size("thickness", body.thickness)]
    found.append(_size("width", body.width))
    if wheel.shape == "disc" and body.inner > 0.0:
        found.append(_size("bore", 2 * body.inner))
    if body.arms is not None:
        sizes = _size("arm width", body.arms.width), _size("arm thickness", body.arms.thickness)
        found += [("arms", str(body.arms.number), ""), *sizes]
    if body.hub is not None:
        found += [
            _size("bore", body.hub.bore),
            _size("hub diameter", body.hub.diameter),
            _size("hub length", body.hub.length),
        ]
    return found


def _masses(wheel: Wheel) -> list[Row]:
    """Mass and inertia, of the parts too where there are several."""
    found: list[Row] = [("mass", _number(wheel.mass), "kg"), ("inertia", figure(wheel.inertia), "kg m²")]
    found.append(("GD²", figure(gd2(wheel.inertia)), "kg m²"))
    if len(wheel.parts) > 1:
        found += [(f"mass, {part.name}", _number(part.mass), "kg") for part in wheel.parts if part.mass is not None]
        found += [(f"inertia, {part.name}", _number(part.inertia), "kg m²") for part in wheel.parts]
    return found


def _judgement(wheel: Wheel) -> list[Row]:
    """Safety, and the other shapes where the lightest one was asked for."""
    found: list[Row] = []
    if wheel.material.allowable is not None:
        found.append(("allowable stress", _number(wheel.material.allowable / _MEGA), "MPa"))
    if wheel.safety is not None:
        against = "strength" if wheel.material.strength is not None else "allowable stress"
        found.append((f"safety factor, by {against}", _number(wheel.safety), ""))
    others = {shape: mass for shape, mass in wheel.compared.items() if shape != wheel.shape}
    return [*found, *((_COMPARED[shape], _number(mass), "kg") for shape, mass in others.items())]
