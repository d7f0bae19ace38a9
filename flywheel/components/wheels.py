"""A wheel for an inertia: its requirements, its body with masses and stresses, its free dimension, the lightest one.

Of a rim two dimensions must be known, the inertia gives the third: a radius and one of width, thickness and their ratio,
or two of these. Of a disc one must be known. Where no radius is given, it is the greatest that the stress allows.
Dimensions are then rounded to multiples of a step if required, so that the inertia is not below the required one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from math import ceil, floor, inf, nextafter, pi
from typing import Any, NamedTuple

from bondgraph.numerics import threshold
from flywheel.components.wheel_stresses import (
    ARM_SHARE,
    ARMS,
    ASPECT,
    COUNT,
    DISC,
    FEWEST,
    LIGHTEST,
    METHODS,
    MOST,
    RATIO,
    RIM,
    SPEEDS,
    WHEEL_SHAPES,
    Arms,
    Material,
    WheelAsked,
    annulus_inertia,
    annulus_mass,
    arm_bending,
    arm_pull,
    greatest_disc_stress,
    hoop_stress,
    rim_on_arms,
)
from flywheel.numerics.faults import POSITIVE, Fault, SceneError, fits, number_faults, refuse, require

RADII = ("outer_radius", "mean_radius", "rim_speed", "max_radius")
SECTION = ("width_to_thickness", "width", "thickness")
_HUB = ("bore", "hub_diameter")
_ARMED = ("arms", "arm_share", "arm_width", "arm_thickness", "hub_length", "torque")
_RIM = (*RADII, *SECTION)
_USED = {
    DISC: ("outer_radius", "rim_speed", "max_radius", "width", "bore"),
    RIM: (*_RIM, "rim_share"),
    ARMS: (*_RIM, *_HUB, *_ARMED),
    LIGHTEST: ("max_radius", *SECTION, *_HUB, "arms", "arm_share", "hub_length", "torque"),
}
_STEPS = ("step", "size_step")
_NUMBERS = tuple(dict.fromkeys((*_RIM, "rim_share", *_HUB, *_ARMED, *_STEPS)))
_INSTEAD = {
    (DISC, "thickness"): "along its axis, a disc has a width",
    (DISC, "mean_radius"): "give outer_radius",
    (LIGHTEST, "outer_radius"): "give max_radius",
}
_WORDS = {DISC: "a disc", RIM: "a rim without arms", ARMS: "a rim with arms", LIGHTEST: "the lightest wheel"}


def request_faults(request: WheelAsked) -> list[Fault]:
    """All faults of a request: names, numbers, too few dimensions or too many."""
    if faults := _value_faults(request):
        return faults
    shape, used = request.shape, (*_USED[request.shape], *_STEPS)
    valid = f"one of {', '.join(_USED[shape])}"
    unused = [
        Fault(request.at_key(name), f"{name} of {_WORDS[shape]}", valid, _INSTEAD.get((shape, name), ""))
        for name in request.present(_NUMBERS)
        if name not in used
    ]
    return unused or _dimension_faults(request)


def _value_faults(request: WheelAsked) -> list[Fault]:
    """Unknown names, else numbers out of their range: above 0, a bore may be 0, a share at most 1, arms whole."""
    faults = []
    for name, names in (("shape", WHEEL_SHAPES), ("method", METHODS), ("at", SPEEDS)):
        if getattr(request, name) not in names:
            faults.append(Fault(request.at_key(name), f'"{getattr(request, name)}"', f"one of {', '.join(names)}"))
    if not isinstance(request.material, Material):
        faults.append(
            Fault(request.at_key("material"), f"{request.material}", "a Material, such as material('carbon steel')")
        )
    if faults:
        return faults
    for name in request.present(_NUMBERS):
        value, zero = getattr(request, name), name in ("bore", "torque")
        if not fits(value) or value < 0.0 or (value == 0.0 and not zero):
            faults.append(Fault(request.at_key(name), f"{value}", f"a number {'at least' if zero else 'above'} 0"))
        elif name == "rim_share" and value > 1.0:
            faults.append(Fault(request.at_key(name), f"{value:g}", "a share above 0 and at most 1"))
        elif name == "arms" and (value != int(value) or not FEWEST <= value <= MOST):
            faults.append(Fault(request.at_key(name), f"{value:g}", f"a whole number from {FEWEST} to {MOST}"))
    return faults


def _dimension_faults(request: WheelAsked) -> list[Fault]:
    """Too few dimensions or too many, an unlimited radius; arms without a hub, or with sections given twice."""
    faults, path = [], request.path or "wheel"
    radii, section = request.present(RADII), request.present(SECTION)
    if request.shape == DISC:
        names = ("outer_radius", "rim_speed", "max_radius", "width")
        dimensions = request.present(names)
        if len(dimensions) != 1:
            defect = " and ".join(dimensions) if dimensions else f"none of {', '.join(names)}"
            faults.append(Fault(path, defect, f"exactly one of {', '.join(names)}", "the inertia decides the other"))
    elif request.shape == LIGHTEST and request.max_radius is None:
        faults.append(Fault(request.at_key("max_radius"), "nothing", "a radius that the wheel must not exceed"))
    elif not radii and not section:
        faults.append(Fault(path, f"none of {', '.join(_RIM)}", "one of them, or one radius and one of the section"))
    elif len(radii) > 1 or len(section) > (1 if radii else 2):
        defect = " and ".join(radii + section)
        faults.append(Fault(path, defect, "one radius and one of the section, or two of the section"))
    if not faults:
        fixed = request.present(("outer_radius", "mean_radius", "rim_speed"))
        free = request.width is None if request.shape == DISC else len(section) < 2
        if (request.shape == LIGHTEST or (not fixed and free)) and request.material.allowable is None:
            expected = "a material, or a stress, that limits the size of the wheel"
            faults.append(Fault(request.at_key("allowable_stress"), "nothing", expected))
        if request.thin and request.shape == DISC:
            faults.append(Fault(request.at_key("method"), '"thin" for a disc', '"exact"', "a thin rim is not a disc"))
    armed = request.shape == ARMS or (request.shape == LIGHTEST and request.present(_ARMED))
    if armed and not request.present(_HUB):
        faults.append(Fault(request.at_key("bore"), "nothing", "bore or hub_diameter", "the arms stand on the hub"))
    if request.bore is not None and request.hub_diameter is not None and request.hub_diameter <= request.bore:
        defect = f"{request.hub_diameter:g} m with a bore of {request.bore:g} m"
        faults.append(Fault(request.at_key("hub_diameter"), defect, "a diameter above the bore"))
    if request.arm_share is not None and request.present(("arm_width", "arm_thickness")):
        faults.append(Fault(request.at_key("arm_share"), "arm_share together with the arms' axes", "one or the other"))
    if request.arm_thickness is not None and request.arm_width is None:
        faults.append(Fault(request.at_key("arm_thickness"), "arm_thickness alone", "arm_width with it"))
    return faults


class Hub(NamedTuple):
    """A hub: its bore, its diameter, its length along the axis (m)."""

    bore: float
    diameter: float
    length: float


class Part(NamedTuple):
    """A part of a wheel: mass (kg; None if only its inertia is known) and inertia about the axis (kg m²)."""

    name: str
    mass: float | None
    inertia: float


class Body(NamedTuple):
    """Dimensions of a wheel (m): outer and inner radius, radial thickness and axial width of its rim or disc; arms, hub.

    `thin`: the rim's inertia and stress are those of a ring at its mean radius. `share`: the rim's share of the inertia.
    """

    shape: str
    outer: float
    inner: float
    thickness: float
    width: float
    thin: bool = False
    share: float = 1.0
    arms: Arms | None = None
    hub: Hub | None = None

    @property
    def mean(self) -> float:
        """The mean radius of the rim, m."""
        return self.outer - self.thickness / 2

    @property
    def running(self) -> float:
        """The radius (m) whose speed is the wheel's rim speed: the outer one, the mean one of a thin rim."""
        return self.mean if self.thin else self.outer

    @property
    def section(self) -> float:
        """Area of the rim's section, m²."""
        return self.thickness * self.width


def ring(request: WheelAsked, outer: float, thickness: float, width: float) -> Body:
    """The body of a required wheel, of a given outer radius, radial thickness and width (m)."""
    inner = request.hub_radius if request.shape == DISC else outer - thickness
    body = Body(request.shape, outer, inner, thickness, width, request.thin, request.rim_share or 1.0)
    if request.shape != ARMS:
        return body
    bore, diameter = request.bore or 0.0, 2 * request.hub_radius
    hub = Hub(bore, diameter, width if request.hub_length is None else request.hub_length)
    count = int(request.arms or COUNT)
    if request.arm_width is not None:
        across = ASPECT * request.arm_width if request.arm_thickness is None else request.arm_thickness
        return body._replace(arms=Arms(count, request.arm_width, across), hub=hub)
    axis = (4 * (request.arm_share or ARM_SHARE) * body.section / (pi * ASPECT)) ** 0.5
    return body._replace(arms=Arms(count, axis, ASPECT * axis), hub=hub)


def parts(body: Body, density: float) -> tuple[Part, ...]:
    """Mass and inertia, part by part, of a body of a density (kg/m³).

    The rim is an annulus, I = m (R² + r²)/2, a thin one m R² at its mean radius; the hub is an annulus; an arm is a straight
    bar of constant section from hub to rim, I = rho A1 (r³ - r_h³)/3 + m w²/16. Their ends are assumed to be flat.
    """
    if body.shape == DISC:
        mass = annulus_mass(body.outer, body.inner, body.width, density)
    else:
        mass = 2 * pi * density * body.section * body.mean
    inertia = mass * body.mean**2 if body.thin else mass * (body.outer**2 + body.inner**2) / 2
    main = Part("disc" if body.shape == DISC else "rim", mass, inertia)
    if body.share < 1.0:
        return main, Part("hub and arms", None, inertia * (1 / body.share - 1))
    if body.arms is None or body.hub is None:
        return (main,)
    arms, hub, root = body.arms, body.hub, body.hub.diameter / 2
    bar = density * arms.area * (body.inner - root)
    turning = density * arms.area * (body.inner**3 - root**3) / 3 + bar * arms.width**2 / 16
    sizes = root, hub.bore / 2, hub.length, density
    around = Part("hub", annulus_mass(*sizes), annulus_inertia(*sizes))
    return main, Part("arms", arms.number * bar, arms.number * turning), around


def inertia(body: Body, density: float) -> float:
    """Inertia of the whole wheel, kg m²."""
    return sum(part.inertia for part in parts(body, density))


def stress(body: Body, material: Material, speed: float, torque: float | None = None) -> dict[str, float]:
    """The greatest stresses (Pa) by place, of a body that runs at a speed (rad/s), with a torque (N m) from hub to rim.

    A disc by `greatest_disc_stress`; a rim alone as an annulus, or as a thin ring by `hoop_stress`; a rim on arms by
    `rim_on_arms`. At the hub the arms carry the rim's pull, their own by `arm_pull`, and bending by the torque. Keys, shrink
    fits, castings' own stresses, and the hub are left out.

    >>> from flywheel.components.wheel_stresses import material
    >>> stress(Body("rim", 1.05, 0.95, 0.1, 0.2, thin=True), material(density=7200.0), 25.0)
    {'rim': 4500000.0}
    """
    if body.arms is not None and body.hub is not None:
        arms, root, density = body.arms, body.hub.diameter / 2, material.density
        numbers = density, speed * body.mean, arms.number, body.mean, body.thickness, body.section / arms.area
        in_arms, at_arms, between = rim_on_arms(*numbers)
        bending = arm_bending(torque or 0.0, arms.number, body.mean, root, arms.modulus)
        return {
            "rim at the arms": at_arms,
            "rim between the arms": between,
            "arms at the rim": in_arms,
            "arms at the hub": in_arms + arm_pull(density, speed, body.inner, root) + bending,
        }
    if body.thin:
        return {"rim": hoop_stress(speed * body.mean, material.density)}
    greatest = greatest_disc_stress(body.outer, body.inner, material.density, speed, material.poisson)
    place = "inside of the rim" if body.shape != DISC else "centre" if body.inner <= 0.0 else "edge of the bore"
    return {place: greatest}


def least(holds: Callable[[float], bool], low: float, high: float = inf) -> float | None:
    """The least float above low from which a condition holds; None if it does not hold up to high.

    Without an upper end it is searched for by doubling, up to 2^400 mm.

    >>> least(lambda x: x * x >= 2.0, 0.0, 2.0), least(lambda x: x >= 3.0, 1.0), least(lambda x: False, 1.0)
    (1.4142135623730951, 3.0, None)
    """
    ends = (low + 1e-3 * 2.0**k for k in range(400)) if high == inf else iter((high,))
    end = next((end for end in ends if holds(end)), None)
    if end is None:
        return None
    return threshold(holds, low, end)


class Radius(NamedTuple):
    """A known radius, m: the outer one, or the mean one of a rim."""

    value: float
    mean: bool = False

    def outer(self, thickness: float) -> float:
        """The outer radius of a rim of a thickness, m."""
        return self.value + thickness / 2 if self.mean else self.value


class Need(NamedTuple):
    """A wheel to be made: its requirements, its inertia (kg m²), its speed (rad/s)."""

    request: WheelAsked
    inertia: float
    speed: float

    def of(self, request: WheelAsked) -> Need:
        """The need for another `request`."""
        return self._replace(request=request)

    def enough(self, body: Body) -> bool:
        """Tests whether a body has the inertia."""
        return inertia(body, self.request.material.density) >= self.inertia

    def allowed(self, body: Body) -> bool:
        """Tests whether a body withstands the speed."""
        allowable = self.request.material.allowable
        stresses = stress(body, self.request.material, self.speed, self.request.torque)
        return allowable is None or max(stresses.values()) <= allowable

    @property
    def radius(self) -> Radius | None:
        """The radius, where it is given or follows from the rim's speed."""
        request = self.request
        if request.rim_speed is not None:
            return Radius(request.rim_speed / self.speed, mean=request.thin)
        if request.mean_radius is not None:
            return Radius(request.mean_radius, mean=True)
        return None if request.outer_radius is None else Radius(request.outer_radius)

    @property
    def section(self) -> tuple[float, float] | None:
        """Thickness and width of a rim, (0, width) of a disc, where both are known; the inertia then gives the radius."""
        ratio, width, thickness = self.request.width_to_thickness, self.request.width, self.request.thickness
        if self.request.shape == DISC:
            return None if width is None else (0.0, width)
        if thickness is not None and width is None and ratio is not None:
            width = ratio * thickness
        elif width is not None and thickness is None and ratio is not None:
            thickness = width / ratio
        return None if width is None or thickness is None else (thickness, width)


_BOUNDLESS = Fault("needed", "an inertia too large for any wheel", "one that a wheel can have")


def solved(need: Need) -> Body:
    """The body whose inertia is just enough, with its radius, its section, or both as unknowns."""
    request, radius = need.request, need.radius
    if need.section is not None:
        thickness, width = need.section

        def of_radius(outer: float) -> Body:
            return ring(request, outer, outer - request.hub_radius if request.shape == DISC else thickness, width)

        outer = least(lambda outer: need.enough(of_radius(outer)), request.hub_radius + thickness)
        if outer is None:
            raise SceneError([_BOUNDLESS])
        return of_radius(outer)
    body = _largest(need) if radius is None else _by_section(need, radius)
    if body is not None:
        return body
    name = {DISC: "a disc", RIM: "a rim", ARMS: "a wheel with arms"}[request.shape]
    expected = f"one that can have {need.inertia:.6g} kg m^2"
    if radius is not None:
        key = next(key for key in ("rim_speed", "mean_radius", "outer_radius") if getattr(request, key) is not None)
        defect = f"{name} of {'mean ' * radius.mean}radius {radius.value:.6g} m"
        raise SceneError([Fault(request.at_key(key), defect, expected, "enlarge the radius, or make it wider")])
    if request.material.allowable is not None and request.max_radius is None:
        defect = f"{name} under {request.material.allowable / 1e6:.6g} MPa at {need.speed:.6g} rad/s"
        raise SceneError([Fault(request.at_key("shape"), defect, expected, "take a stronger material, or make it wider")])
    defect = f"{name} of at most {request.max_radius:.6g} m under the allowable stress"
    advice = "enlarge the radius, make it wider, or take a stronger material"
    raise SceneError([Fault(request.at_key("max_radius"), defect, expected, advice)])


def _by_section(need: Need, radius: Radius) -> Body | None:
    """The body of a known radius with its section as unknown. None if even the heaviest has too little inertia."""
    request = need.request
    room = (radius.value - request.hub_radius) * (2.0 if radius.mean else 1.0)

    def body(unknown: float) -> Body:
        """The body of a rim for a value of its thickness or, if that is known, of its width."""
        if request.shape == DISC:
            thickness, width = room, unknown
        elif request.thickness is not None:
            thickness, width = request.thickness, unknown
        else:
            width = (request.width_to_thickness or RATIO) * unknown if request.width is None else request.width
            thickness = unknown
        return ring(request, radius.outer(thickness), thickness, width)

    if room <= 0.0 or (request.thickness is not None and request.thickness > room):
        return None
    by_width = request.shape == DISC or request.thickness is not None
    unknown = least(lambda unknown: need.enough(body(unknown)), 0.0, inf if by_width else room)
    if unknown is None and by_width:
        raise SceneError([_BOUNDLESS])
    return None if unknown is None else body(unknown)


def _largest(need: Need) -> Body | None:
    """The body of the greatest radius within the limit that the stress allows; None if there is none."""
    limit = inf if need.request.max_radius is None else need.request.max_radius

    def too_large(outer: float) -> bool:
        made = _by_section(need, Radius(outer))
        return made is not None and not need.allowed(made)

    first = least(too_large, 0.0, limit)
    if first is None and limit == inf:
        raise SceneError(
            [Fault("speed", f"{need.speed:g} rad/s", "a speed at which the wheel is stressed, or a given radius")]
        )
    return _by_section(need, Radius(limit if first is None else nextafter(first, 0.0)))


_THICK = 0.2  # thickness over mean radius from which a thin rim is off by 1 % of its inertia, 20 % of its bore stress
ROUNDING = 1e-9  # of an allowable value: tolerance


@dataclass(frozen=True)
class Wheel:
    """A wheel with all its dimensions (see `Body`), at a speed (rad/s).

    `needed` is the inertia that it was made for (kg m²), rounded up if required; `stresses` are the greatest by
    place (Pa); `compared` holds the masses (kg) of the lightest wheel of each shape, if the lightest was required.
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
        """Inertia of the whole wheel, kg m²: at least the needed one, more if dimensions were rounded up."""
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
        """The place of the greatest stress."""
        return max(self.stresses, key=lambda name: self.stresses[name])

    @property
    def greatest_stress(self) -> float:
        """The greatest stress anywhere in the wheel, Pa."""
        return max(self.stresses.values())

    @property
    def safety(self) -> float | None:
        """Safety factor: strength (the allowable stress if only that is known) over the greatest stress."""
        reference = self.material.reference
        return None if reference is None else reference / self.greatest_stress

    @property
    def utilisation(self) -> float | None:
        """The greatest stress over the allowable one."""
        return None if self.material.allowable is None else self.greatest_stress / self.material.allowable

    def as_dict(self) -> dict[str, Any]:
        """All figures for JSON, SI throughout; null for figures that a shape does not have."""
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


def wheel_of(request: WheelAsked, body: Body, speed: float, needed: float | None = None) -> Wheel:
    """A wheel of known dimensions at a speed (rad/s): masses, stresses and warnings.

    Args:
        request: material and torque; `body` overrides its dimensions.
        body: all dimensions.
        speed: of the wheel, for its stresses, rad/s.
        needed: inertia that it must have (kg m²); its own if None.

    >>> from flywheel.components.wheel_stresses import material
    >>> wheel = wheel_of(WheelAsked("disc", material("carbon steel")), Body("disc", 0.3, 0.0, 0.3, 0.05), 100.0)
    >>> round(wheel.mass, 3), round(wheel.inertia, 4), round(wheel.safety, 1)
    (110.977, 4.994, 104.7)

    """
    made = parts(body, request.material.density)
    inertia = sum(part.inertia for part in made)
    stresses = stress(body, request.material, speed, request.torque)
    wheel = Wheel(body, request.material, speed, inertia if needed is None else needed, made, stresses)
    return replace(wheel, warnings=tuple(_warnings(request, wheel)))


def _warnings(request: WheelAsked, wheel: Wheel) -> list[str]:
    """Warnings about the wheel, one sentence each."""
    body, usual, allowable = wheel.body, wheel.material.rim_speed, wheel.material.allowable
    warnings = []
    if usual is not None and wheel.rim_speed > usual * (1 + ROUNDING):
        warnings.append(
            f"the rim runs at {wheel.rim_speed:.4g} m/s; {wheel.material.name} usually stays below {usual:g} m/s"
        )
    if allowable is not None and wheel.greatest_stress > allowable * (1 + ROUNDING):
        stressed = f"the stress of {wheel.greatest_stress / 1e6:.4g} MPa ({wheel.place})"
        remedy = "take a smaller radius, another material, or shape lightest with a max_radius"
        if wheel.place.startswith("arms"):
            remedy = "enlarge arm_share or hub_diameter, or take another material"
        warnings.append(f"{stressed} is above the allowable {allowable / 1e6:.4g} MPa: {remedy}")
    if body.width > 2 * body.outer:
        warnings.append(
            f"the {body.width:.4g} m of its width are more than its diameter: the formulas are those of thin discs"
        )
    if body.thin and body.thickness > _THICK * body.mean:
        share = body.thickness / body.mean
        warnings.append(f"the rim is taken as thin, but it is {share:.0%} of its mean radius thick: take the exact method")
    if body.share < 1.0:
        warnings.append(
            f"hub and arms are taken to have {1 - body.share:.4g} of the inertia; the mass is that of the rim alone"
        )
    if body.arms is not None and request.torque is None:
        warnings.append("no torque between hub and rim is given: the arms' bending by it is left out")
    return warnings


_EXACT = 1e-9  # of a step: tolerance of a multiple of it


def rounded(need: Need, body: Body) -> Body:
    """The body on multiples of the required step, if any, with at least the inertia needed.

    Given dimensions stay. A radius limited by speed or stress is rounded down until the stress is allowable; thickness, arms
    and finally width are rounded up.
    """
    request, step = need.request, need.request.size_step
    if step is None:
        return body
    if need.section is not None:
        outer = rounded_up(body.outer, step)
        return ring(request, outer, outer - body.inner if request.shape == DISC else body.thickness, body.width)
    wheel = _stepped_section(need.of(_with_radius(request, body, step)), step)
    while need.radius is None and not need.allowed(wheel):
        body = body._replace(outer=body.outer - step)
        wheel = _stepped_section(need.of(_with_radius(request, body, step)), step)
    return wheel


def rounded_up(value: float, step: float) -> float:
    """The least multiple of a step that is not below a value.

    >>> rounded_up(2321.2, 10.0), rounded_up(0.35, 0.05), rounded_up(0.3500001, 0.05)
    (2330.0, 0.35, 0.4)
    """
    return float(f"{ceil(value / step - _EXACT) * step:.15g}")  # 7 times 0.05 is 0.35, except for its last binary digits


def rounded_down(value: float, step: float) -> float:
    """The greatest multiple of a step that is not above a value.

    >>> rounded_down(0.3539, 0.005)
    0.35
    """
    return float(f"{floor(value / step + _EXACT) * step:.15g}")


def _stepped_section(need: Need, step: float) -> Body:
    """Thickness, arms and width rounded up unless given, at a given radius."""
    request, body = need.request, solved(need)
    if request.shape != DISC:
        if body.arms is not None:
            arms = rounded_up(body.arms.width, step), rounded_up(body.arms.thickness, step)
            request = request._replace(arm_share=None, arm_width=arms[0], arm_thickness=arms[1])
        thickness = request.thickness
        if thickness is None:
            thickness = rounded_up(body.thickness, step)
            request = request._replace(thickness=thickness, width_to_thickness=None)
        radius = need.radius
        if request.width is not None and radius is not None:  # it was given: thickness went up instead
            return ring(request, radius.outer(thickness), thickness, request.width)
        body = solved(need.of(request))
    return ring(request, body.outer, body.thickness, rounded_up(body.width, step))


def _with_radius(request: WheelAsked, body: Body, step: float) -> WheelAsked:
    """The request with a radius on a step, or unchanged if given."""
    if request.outer_radius is not None or request.mean_radius is not None:
        return request
    free = request._replace(rim_speed=None, max_radius=None)
    if request.thin:
        return free._replace(mean_radius=rounded_down(body.mean, step))
    return free._replace(outer_radius=rounded_down(body.outer, step))


def choose(needed: float, speed: float, request: WheelAsked) -> Wheel:
    """The wheel of a given inertia, with its free dimension, rounded up if required.

    Args:
        needed: inertia of the wheel, kg m².
        speed: for stresses and rim speeds, rad/s: the greatest of its shaft (or the mean, by `asked.at`).
        request: shape, material, and the dimensions that are known.

    Raises:
        SceneError: if the dimensions are too few or too many, or no such wheel has that inertia or withstands that speed.

    Source: inertia and stress as in `flywheel.wheel`; the solution is exact to rounding.

    >>> from math import pi
    >>> from flywheel.components.wheel_stresses import material
    >>> iron = material(density=8150.0, allowable=7.5e6)  # Khurmi, example 16.17: width 4 times the thickness
    >>> rim = WheelAsked("rim", iron, method="thin", width_to_thickness=4.0)
    >>> wheel = choose(2321.2034083626872, 100 * pi / 30, rim)
    >>> round(2 * wheel.body.mean, 9), round(wheel.body.thickness, 9), round(wheel.body.width, 9)
    (5.793662667, 0.021591015, 0.086364058)

    """
    need = _checked(needed, speed, request)
    if request.shape == LIGHTEST:
        return least_mass(needed, speed, request)
    return _made(need)


def least_mass(needed: float, speed: float, request: WheelAsked) -> Wheel:
    """The lightest wheel within a radius, under the allowable stress: the best disc against the best rim.

    At a given inertia a wheel of one shape is the lighter the larger it is, m = 2 I/(R² + r²): the best one of each shape
    has the greatest radius, or the greatest that its stress allows. A thin rim is lighter if the radius is the limit, m =
    I/R² against 2 I/R² of a solid disc. A solid disc withstands sqrt(8/(3 + nu)) times the speed, so that it is lighter if
    stress limits both, m = (3 + nu)/4 rho w² I/sigma against rho w² I/sigma: from (w R)² = 2 sigma/rho on. With a hub given,
    the disc has its bore, and the rim its arms.

    Args:
        needed: inertia of the wheel, kg m².
        speed: for the stresses, rad/s.
        request: material and `max_radius`; of the rim's section width, thickness or their ratio, 2 without; bore or hub for
            a disc with a hole and a rim with arms. Its shape is ignored.

    Raises:
        SceneError: as `choose`, where neither shape can be made.

    Source: the limits of each shape, by its own formulas.

    >>> from flywheel.components.wheel_stresses import material
    >>> wheel = least_mass(20.0, 50.0, WheelAsked("lightest", material("grey cast iron"), max_radius=0.5))
    >>> wheel.shape, round(wheel.mass, 2), round(wheel.compared["disc"], 2)
    ('rim', 87.52, 160.0)

    """
    need = _checked(needed, speed, request._replace(shape=LIGHTEST) if isinstance(request, WheelAsked) else request)
    wheels: list[Wheel] = []
    faults: list[Fault] = []
    request = need.request
    disc = WheelAsked(DISC, request.material, max_radius=request.max_radius, bore=request.bore, path=request.path)
    armed = request.bore is not None or request.hub_diameter is not None
    for one in (disc._replace(size_step=request.size_step), request._replace(shape=ARMS if armed else RIM)):
        try:
            wheels.append(_made(need.of(one)))
        except SceneError as error:
            faults += error.faults
    if not wheels:
        raise SceneError(faults)
    best = min(wheels, key=lambda wheel: wheel.mass)
    return replace(best, compared={wheel.shape: wheel.mass for wheel in wheels})


def _checked(needed: float, speed: float, request: WheelAsked) -> Need:
    """The request after its checks; the inertia is rounded up to its step."""
    require("request", request, WheelAsked, "a WheelAsked")
    faults = [*number_faults("needed", needed, POSITIVE, "kg m²"), *number_faults("speed", speed, POSITIVE, "rad/s")]
    refuse([*faults, *request_faults(request)])
    return Need(request, needed if request.step is None else rounded_up(needed, request.step), speed)


def _made(need: Need) -> Wheel:
    return wheel_of(need.request, rounded(need, solved(need)), need.speed, need.inertia)
