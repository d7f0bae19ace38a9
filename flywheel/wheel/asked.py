"""What is asked of a wheel: its shape, material and dimensions as far as they are given, and whether they go together."""

from __future__ import annotations

from typing import NamedTuple

from flywheel.arguments import fits
from flywheel.faults import Fault
from flywheel.wheel.arms import FEWEST, MOST
from flywheel.wheel.materials import Material

DISC, RIM, ARMS, LIGHTEST = "disc", "rim", "arms", "lightest"
SHAPES = (DISC, RIM, ARMS, LIGHTEST)
EXACT, THIN = "exact", "thin"
METHODS = (EXACT, THIN)
GREATEST, MEAN = "greatest", "mean"
SPEEDS = (GREATEST, MEAN)

RATIO, COUNT, ARM_SHARE, ASPECT, HUB_RATIO = 2.0, 6, 0.25, 0.5, 2.0
"""Usual proportions, for what is not given: width to thickness of a rim; number of arms; section of an arm over that of
the rim; axes of an arm's section; diameter of a hub over its bore.

Source: Khurmi and Gupta, Machine Design, chapter 22 (rim twice as wide as thick, hub twice the shaft, arms half as thick as
wide); Jindal, Machine Design, example 19-1 (6 arms of a quarter of the rim's section).
"""


class WheelAsked(NamedTuple):
    """A wheel as far as it is decided, SI. What is None is to be found, or has a usual proportion (see the module).

    `method` is `exact` (an annulus), or `thin` (a rim at its mean radius). `at` tells which speed of the shaft whoever sizes
    the wheel is to take: the greatest or the mean. `rim_speed` is that of the outer radius, for a thin rim of the mean one.
    `rim_share` is the share of the inertia that the rim has, where hub and arms are not modelled. `torque` is the greatest
    one between hub and rim. `step` and `size_step` are what inertia and dimensions are rounded up to. `path` is where all
    this stands in a scene, for messages.
    """

    shape: str
    material: Material
    method: str = EXACT
    at: str = GREATEST
    outer_radius: float | None = None
    mean_radius: float | None = None
    max_radius: float | None = None
    rim_speed: float | None = None
    width: float | None = None
    thickness: float | None = None
    width_to_thickness: float | None = None
    rim_share: float | None = None
    arms: int | None = None
    arm_share: float | None = None
    arm_width: float | None = None
    arm_thickness: float | None = None
    bore: float | None = None
    hub_diameter: float | None = None
    hub_length: float | None = None
    torque: float | None = None
    step: float | None = None
    size_step: float | None = None
    path: str = ""

    @property
    def thin(self) -> bool:
        """Whether the rim is taken to run at its mean radius."""
        return self.method == THIN

    @property
    def hub_radius(self) -> float:
        """Radius of the hub, m; of the bore in a disc; 0 without either."""
        bore = self.bore or 0.0
        if self.shape == DISC:
            return bore / 2
        return (HUB_RATIO * bore if self.hub_diameter is None else self.hub_diameter) / 2

    def given(self, names: tuple[str, ...]) -> list[str]:
        """Those of some quantities that are given."""
        return [name for name in names if getattr(self, name) is not None]

    def at_key(self, name: str) -> str:
        """Path of one quantity, for a fault."""
        return f"{self.path}.{name}" if self.path else name


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


def asked_faults(asked: WheelAsked) -> list[Fault]:
    """Everything that is wrong with what is asked: names, numbers, too few dimensions or too many."""
    faults = _name_faults(asked) or _number_faults(asked)
    if faults:
        return faults
    used = (*_USED[asked.shape], *_STEPS)
    unused = [_unused(asked, name) for name in asked.given(_NUMBERS) if name not in used]
    return unused or [*(_shape_faults(asked) or _radius_faults(asked)), *_hub_faults(asked)]


def _name_faults(asked: WheelAsked) -> list[Fault]:
    faults = []
    for name, known in (("shape", SHAPES), ("method", METHODS), ("at", SPEEDS)):
        if getattr(asked, name) not in known:
            faults.append(Fault(asked.at_key(name), f'"{getattr(asked, name)}"', f"one of {', '.join(known)}"))
    if not isinstance(asked.material, Material):
        faults.append(Fault(asked.at_key("material"), f"{asked.material}", "a Material, such as material('carbon steel')"))
    return faults


def _number_faults(asked: WheelAsked) -> list[Fault]:
    """Numbers out of their range: all above 0, a bore may be 0, a share is at most 1, arms are whole."""
    faults = []
    for name in asked.given(_NUMBERS):
        value = getattr(asked, name)
        zero = name in ("bore", "torque")
        if not fits(value) or value < 0.0 or (value == 0.0 and not zero):
            faults.append(Fault(asked.at_key(name), f"{value}", f"a number {'at least' if zero else 'above'} 0"))
        elif name == "rim_share" and value > 1.0:
            faults.append(Fault(asked.at_key(name), f"{value:g}", "a share above 0 and at most 1"))
        elif name == "arms" and (value != int(value) or not FEWEST <= value <= MOST):
            faults.append(Fault(asked.at_key(name), f"{value:g}", f"a whole number from {FEWEST} to {MOST}"))
    return faults


def _unused(asked: WheelAsked, name: str) -> Fault:
    found, valid = f"{name} of {_WORDS[asked.shape]}", f"one of {', '.join(_USED[asked.shape])}"
    return Fault(asked.at_key(name), found, valid, _INSTEAD.get((asked.shape, name), ""))


def _shape_faults(asked: WheelAsked) -> list[Fault]:
    """Too few dimensions, or too many."""
    if asked.shape == DISC:
        return _exactly_one(asked, ("outer_radius", "rim_speed", "max_radius", "width"))
    if asked.shape == LIGHTEST and asked.max_radius is None:
        return [Fault(asked.at_key("max_radius"), "nothing", "a radius that the wheel must not exceed")]
    radii, section = asked.given(RADII), asked.given(SECTION)
    most = 1 if radii else 2
    if not radii and not section:
        return [
            Fault(asked.path or "wheel", f"none of {', '.join(_RIM)}", "one of them, or one radius and one of the section")
        ]
    if len(radii) > 1 or len(section) > most:
        found = " and ".join(radii + section)
        return [Fault(asked.path or "wheel", found, "one radius and one of the section, or two of the section")]
    return []


def _exactly_one(asked: WheelAsked, names: tuple[str, ...]) -> list[Fault]:
    given = asked.given(names)
    if len(given) == 1:
        return []
    found = " and ".join(given) if given else f"none of {', '.join(names)}"
    return [Fault(asked.path or "wheel", found, f"exactly one of {', '.join(names)}", "the inertia decides the other")]


def _radius_faults(asked: WheelAsked) -> list[Fault]:
    """Where stress decides the radius, the material must say how much is allowed; a disc is no thin rim."""
    faults = []
    fixed = asked.given(("outer_radius", "mean_radius", "rim_speed"))
    free = asked.width is None if asked.shape == DISC else len(asked.given(SECTION)) < 2
    if (asked.shape == LIGHTEST or (not fixed and free)) and asked.material.allowable is None:
        expected = "a material, or a stress, that tells how large the wheel may be"
        faults.append(Fault(asked.at_key("allowable_stress"), "nothing", expected))
    if asked.thin and asked.shape == DISC:
        faults.append(Fault(asked.at_key("method"), '"thin" for a disc', '"exact"', "a thin rim is not a disc"))
    return faults


def _hub_faults(asked: WheelAsked) -> list[Fault]:
    """Arms need a hub; one that holds its bore; arms have a share of the rim's section, or axes of their own."""
    faults = []
    armed = asked.shape == ARMS or (asked.shape == LIGHTEST and asked.given(_ARMED))
    if armed and not asked.given(_HUB):
        faults.append(Fault(asked.at_key("bore"), "nothing", "bore or hub_diameter", "the arms stand on the hub"))
    if asked.bore is not None and asked.hub_diameter is not None and asked.hub_diameter <= asked.bore:
        found = f"{asked.hub_diameter:g} m with a bore of {asked.bore:g} m"
        faults.append(Fault(asked.at_key("hub_diameter"), found, "a diameter above the bore"))
    if asked.arm_share is not None and asked.given(("arm_width", "arm_thickness")):
        faults.append(Fault(asked.at_key("arm_share"), "arm_share beside the arms' axes", "one or the other"))
    if asked.arm_thickness is not None and asked.arm_width is None:
        faults.append(Fault(asked.at_key("arm_thickness"), "arm_thickness alone", "arm_width beside it"))
    return faults
