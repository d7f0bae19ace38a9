"""A wheel's body: its dimensions, the mass and inertia of its parts, the stresses in them."""

from __future__ import annotations

from math import pi
from typing import NamedTuple

from flywheel.wheel.arms import Arms, arm_bending, rim_on_arms
from flywheel.wheel.asked import ARM_SHARE, ARMS, ASPECT, COUNT, DISC, WheelAsked
from flywheel.wheel.discs import annulus_inertia, annulus_mass, greatest_disc_stress
from flywheel.wheel.materials import Material
from flywheel.wheel.rims import hoop_stress


class Hub(NamedTuple):
    """A hub: its bore, its diameter, its length along the axis (m)."""

    bore: float
    diameter: float
    length: float


class Part(NamedTuple):
    """A part of a wheel: mass (kg; None where only its inertia is known) and inertia about the axis (kg m²)."""

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


def ring(asked: WheelAsked, outer: float, thickness: float, width: float) -> Body:
    """The body of a wheel as asked, of a given outer radius, radial thickness and width (m)."""
    inner = asked.hub_radius if asked.shape == DISC else outer - thickness
    body = Body(asked.shape, outer, inner, thickness, width, asked.thin, asked.rim_share or 1.0)
    if asked.shape != ARMS:
        return body
    bore, diameter = asked.bore or 0.0, 2 * asked.hub_radius
    hub = Hub(bore, diameter, width if asked.hub_length is None else asked.hub_length)
    return body._replace(arms=_arms(asked, body.section), hub=hub)


def _arms(asked: WheelAsked, section: float) -> Arms:
    """The arms as asked: of axes of their own, or of a share of the rim's section."""
    count = int(asked.arms or COUNT)
    if asked.arm_width is not None:
        across = ASPECT * asked.arm_width if asked.arm_thickness is None else asked.arm_thickness
        return Arms(count, asked.arm_width, across)
    area = (asked.arm_share or ARM_SHARE) * section
    width = (4 * area / (pi * ASPECT)) ** 0.5
    return Arms(count, width, ASPECT * width)


def parts(body: Body, density: float) -> tuple[Part, ...]:
    """Mass and inertia, part by part, of a body of a density (kg/m³).

    The rim is an annulus, I = m (R² + r²)/2, a thin one m R² at its mean radius; the hub is an annulus; an arm is a straight
    bar of constant section from hub to rim, I = rho A1 (r³ - r_h³)/3 + m w²/16. Their ends are taken as flat.
    """
    mass = 2 * pi * density * body.section * body.mean if body.shape != DISC else _annulus(body, density)
    inertia = mass * body.mean**2 if body.thin else mass * (body.outer**2 + body.inner**2) / 2
    main = Part("disc" if body.shape == DISC else "rim", mass, inertia)
    if body.share < 1.0:
        return main, Part("hub and arms", None, inertia * (1 / body.share - 1))
    if body.arms is None or body.hub is None:
        return (main,)
    return main, _arms_part(body.arms, body.hub, body.inner, density), _hub_part(body.hub, density)


def _annulus(body: Body, density: float) -> float:
    return annulus_mass(body.outer, body.inner, body.width, density)


def _arms_part(arms: Arms, hub: Hub, inner: float, density: float) -> Part:
    root = hub.diameter / 2
    mass = density * arms.area * (inner - root)
    inertia = density * arms.area * (inner**3 - root**3) / 3 + mass * arms.width**2 / 16
    return Part("arms", arms.number * mass, arms.number * inertia)


def _hub_part(hub: Hub, density: float) -> Part:
    sizes = hub.diameter / 2, hub.bore / 2, hub.length, density
    return Part("hub", annulus_mass(*sizes), annulus_inertia(*sizes))


def inertia(body: Body, density: float) -> float:
    """Inertia of the whole wheel, kg m²."""
    return sum(part.inertia for part in parts(body, density))


def stress(body: Body, material: Material, speed: float, torque: float | None = None) -> dict[str, float]:
    """The greatest stresses (Pa) by place, of a body that runs at a speed (rad/s), with a torque (N m) from hub to rim.

    A disc by `greatest_disc_stress`; a rim alone as an annulus, or as a thin ring by `hoop_stress`; a rim on arms by
    `rim_on_arms`. At the hub the arms bear the rim's pull, their own, rho w² (r² - r_h²)/2, and bending by the torque. Keys,
    shrink fits, castings' own stresses, and the hub are left out.

    >>> from flywheel.wheel.materials import material
    >>> stress(Body("rim", 1.05, 0.95, 0.1, 0.2, thin=True), material(density=7200.0), 25.0)
    {'rim': 4500000.0}
    """
    if body.arms is not None and body.hub is not None:
        return _armed_stress(body, body.arms, body.hub, material.density, speed, torque or 0.0)
    if body.thin:
        return {"rim": hoop_stress(speed * body.mean, material.density)}
    greatest = greatest_disc_stress(body.outer, body.inner, material.density, speed, material.poisson)
    place = "inside of the rim" if body.shape != DISC else "centre" if body.inner <= 0.0 else "edge of the bore"
    return {place: greatest}


def _armed_stress(body: Body, arms: Arms, hub: Hub, density: float, speed: float, torque: float) -> dict[str, float]:
    root = hub.diameter / 2
    rim = rim_on_arms(density, speed * body.mean, arms.number, body.mean, body.thickness, body.section / arms.area)
    own = density * speed**2 * (body.inner**2 - root**2) / 2
    bending = arm_bending(torque, arms.number, body.mean, root, arms.modulus)
    return {
        "rim at the arms": rim.rim_at_arm,
        "rim between the arms": rim.rim_between,
        "arms at the rim": rim.arm,
        "arms at the hub": rim.arm + own + bending,
    }
