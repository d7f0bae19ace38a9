"""A wheel for an inertia: the one that is asked for, or the lightest one."""

from __future__ import annotations

from dataclasses import replace

from flywheel.arguments import POSITIVE, number_faults, refuse, require
from flywheel.faults import Fault, SceneError
from flywheel.wheel.asked import ARMS, DISC, LIGHTEST, RIM, WheelAsked, asked_faults
from flywheel.wheel.result import Wheel, wheel_of
from flywheel.wheel.rounding import rounded, rounded_up
from flywheel.wheel.sizing import Need, solved


def choose(needed: float, speed: float, asked: WheelAsked) -> Wheel:
    """The wheel of a given inertia, its free dimension found, rounded up where that is asked.

    Args:
        needed: inertia of the wheel, kg m².
        speed: for stresses and rim speeds, rad/s: the greatest of its shaft (or the mean, as `asked.at` has it).
        asked: shape, material, and the dimensions that are known.

    Raises:
        SceneError: if the dimensions are too few or too many, or no such wheel has that inertia or bears that speed.

    Source: inertia and stress as in `flywheel.wheel.bodies`; the solution is exact to rounding.

    >>> from math import pi
    >>> from flywheel.wheel.materials import material
    >>> iron = material(density=8150.0, allowable=7.5e6)  # Khurmi, example 16.17: width 4 times the thickness
    >>> rim = WheelAsked("rim", iron, method="thin", width_to_thickness=4.0)
    >>> wheel = choose(2321.2034083626872, 100 * pi / 30, rim)
    >>> round(2 * wheel.body.mean, 9), round(wheel.body.thickness, 9), round(wheel.body.width, 9)
    (5.793662667, 0.021591015, 0.086364058)

    """
    need = _checked(needed, speed, asked)
    if asked.shape == LIGHTEST:
        return least_mass(needed, speed, asked)
    return _made(need)


def least_mass(needed: float, speed: float, asked: WheelAsked) -> Wheel:
    """The lightest wheel within a radius, under the allowable stress: the best disc against the best rim.

    At a given inertia a wheel of one shape is the lighter the larger it is, m = 2 I/(R² + r²): the best one of each shape
    has the greatest radius, or the greatest that its stress allows. A thin rim wins where the radius limits it, m = I/R²
    against 2 I/R² of a solid disc. A solid disc bears sqrt(8/(3 + nu)) times the speed, so that it wins where stress limits
    both, m = (3 + nu)/4 rho w² I/sigma against rho w² I/sigma: from (w R)² = 2 sigma/rho on. With a hub given, the disc has
    its bore, and the rim its arms.

    Args:
        needed: inertia of the wheel, kg m².
        speed: for the stresses, rad/s.
        asked: material and `max_radius`; of the rim's section width, thickness or their ratio, 2 without; bore or hub for a
            disc with a hole and a rim with arms. Its shape is not looked at.

    Raises:
        SceneError: as `choose`, where neither shape can be made.

    Source: the limits of each shape, by its own formulas.

    >>> from flywheel.wheel.materials import material
    >>> wheel = least_mass(20.0, 50.0, WheelAsked("lightest", material("grey cast iron"), max_radius=0.5))
    >>> wheel.shape, round(wheel.mass, 2), round(wheel.compared["disc"], 2)
    ('rim', 87.52, 160.0)

    """
    need = _checked(needed, speed, asked._replace(shape=LIGHTEST) if isinstance(asked, WheelAsked) else asked)
    wheels: list[Wheel] = []
    faults: list[Fault] = []
    for one in map(need.of, _candidates(need.asked)):
        try:
            wheels.append(_made(one))
        except SceneError as error:
            faults += error.faults
    if not wheels:
        raise SceneError(faults)
    best = min(wheels, key=lambda wheel: wheel.mass)
    return replace(best, compared={wheel.shape: wheel.mass for wheel in wheels})


def _checked(needed: float, speed: float, asked: WheelAsked) -> Need:
    """What is asked, once nothing is wrong with it; the inertia rounded up to its step."""
    require("asked", asked, WheelAsked, "a WheelAsked")
    faults = [*number_faults("needed", needed, POSITIVE, "kg m²"), *number_faults("speed", speed, POSITIVE, "rad/s")]
    refuse([*faults, *asked_faults(asked)])
    return Need(asked, needed if asked.step is None else rounded_up(needed, asked.step), speed)


def _made(need: Need) -> Wheel:
    return wheel_of(need.asked, rounded(need, solved(need)), need.speed, need.inertia)


def _candidates(asked: WheelAsked) -> tuple[WheelAsked, WheelAsked]:
    """The disc and the rim that stand against one another."""
    disc = WheelAsked(DISC, asked.material, max_radius=asked.max_radius, bore=asked.bore, path=asked.path)
    armed = asked.bore is not None or asked.hub_diameter is not None
    return disc._replace(size_step=asked.size_step), asked._replace(shape=ARMS if armed else RIM)
