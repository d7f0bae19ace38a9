"""A wheel for an inertia: its free dimensions found.

Of a rim two dimensions must be known, the inertia gives the third: a radius and one of width, thickness and their ratio, or
two of these. Of a disc one must be known. Where no radius is given, it is the greatest that the stress allows.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf, nextafter
from typing import NamedTuple

from flywheel.faults import Fault, SceneError
from flywheel.wheel.asked import ARMS, DISC, RATIO, RIM, WheelAsked
from flywheel.wheel.bodies import Body, inertia, ring, stress
from flywheel.wheel.roots import doubled_until, first_true


class Radius(NamedTuple):
    """A known radius, m: the outer one, or the mean one of a rim."""

    value: float
    mean: bool = False

    def outer(self, thickness: float) -> float:
        """The outer radius of a rim of a thickness, m."""
        return self.value + thickness / 2 if self.mean else self.value


class Need(NamedTuple):
    """A wheel to be made: what is asked, the inertia it must have (kg m²), its speed (rad/s)."""

    asked: WheelAsked
    inertia: float
    speed: float

    def of(self, asked: WheelAsked) -> Need:
        """The same need, other things being asked."""
        return self._replace(asked=asked)

    def enough(self, body: Body) -> bool:
        """Whether a body has the inertia."""
        return inertia(body, self.asked.material.density) >= self.inertia

    def allowed(self, body: Body) -> bool:
        """Whether a body bears the speed."""
        allowable = self.asked.material.allowable
        found = stress(body, self.asked.material, self.speed, self.asked.torque)
        return allowable is None or max(found.values()) <= allowable


def solved(need: Need) -> Body:
    """The body whose inertia is just enough."""
    asked = need.asked
    section = section_asked(asked)
    if section is not None:
        return _by_radius(need, section)
    radius = known_radius(need)
    body = _largest(need) if radius is None else _by_section(need, radius)
    if body is None:
        raise SceneError([_too_small(need, radius)])
    return body


def section_asked(asked: WheelAsked) -> tuple[float, float] | None:
    """Thickness and width of a rim, (0, width) of a disc, where both are known; the inertia then gives the radius."""
    ratio, width, thickness = asked.width_to_thickness, asked.width, asked.thickness
    if asked.shape == DISC:
        return None if width is None else (0.0, width)
    if thickness is not None and width is None and ratio is not None:
        width = ratio * thickness
    elif width is not None and thickness is None and ratio is not None:
        thickness = width / ratio
    return None if width is None or thickness is None else (thickness, width)


def _by_radius(need: Need, section: tuple[float, float]) -> Body:
    """The body of a known section; its radius is found."""
    asked, (thickness, width) = need.asked, section

    def body(outer: float) -> Body:
        return ring(asked, outer, outer - asked.hub_radius if asked.shape == DISC else thickness, width)

    least = asked.hub_radius + thickness
    outer = _reached(lambda radius: need.enough(body(radius)), least)
    return body(outer)


def known_radius(need: Need) -> Radius | None:
    """The radius, where it is given or follows from the rim's speed."""
    asked = need.asked
    if asked.rim_speed is not None:
        return Radius(asked.rim_speed / need.speed, mean=asked.thin)
    if asked.mean_radius is not None:
        return Radius(asked.mean_radius, mean=True)
    return None if asked.outer_radius is None else Radius(asked.outer_radius)


def _by_section(need: Need, radius: Radius) -> Body | None:
    """The body of a known radius; its section is found. None where even the stoutest has too little inertia."""
    asked = need.asked
    room = (radius.value - asked.hub_radius) * (2.0 if radius.mean else 1.0)

    def body(unknown: float) -> Body:
        thickness, width = _sides(asked, unknown, room)
        return ring(asked, radius.outer(thickness), thickness, width)

    def enough(unknown: float) -> bool:
        return need.enough(body(unknown))

    if room <= 0.0 or (asked.thickness is not None and asked.thickness > room):
        return None
    if asked.shape == DISC or asked.thickness is not None:
        return body(_reached(enough, 0.0))
    return body(first_true(enough, 0.0, room)) if enough(room) else None


def _sides(asked: WheelAsked, unknown: float, room: float) -> tuple[float, float]:
    """Thickness and width, one of them (the thickness, unless that is known) the unknown."""
    if asked.shape == DISC:
        return room, unknown
    if asked.thickness is not None:
        return asked.thickness, unknown
    if asked.width is not None:
        return unknown, asked.width
    return unknown, (asked.width_to_thickness or RATIO) * unknown


def _reached(enough: Callable[[float], bool], least: float) -> float:
    """The least value above `least` that is enough: it is sought by doubling, then by halving."""
    high = doubled_until(lambda excess: enough(least + excess), 1e-3)
    if high is None:
        raise SceneError([Fault("needed", "an inertia beyond all bounds", "one that a wheel can have")])
    return first_true(enough, least, least + high)


def _largest(need: Need) -> Body | None:
    """The body of the greatest radius within the limit that the stress allows; None where no radius will do."""
    limit = inf if need.asked.max_radius is None else need.asked.max_radius

    def too_large(outer: float) -> bool:
        made = _by_section(need, Radius(outer))
        return made is not None and not need.allowed(made)

    if limit < inf and not too_large(limit):
        return _by_section(need, Radius(limit))
    high = doubled_until(too_large, 1e-3) if limit == inf else limit
    if high is None:
        raise SceneError([Fault("speed", f"{need.speed:g} rad/s", "a speed that stresses the wheel, or a radius given")])
    return _by_section(need, Radius(nextafter(first_true(too_large, 0.0, high), 0.0)))


def _too_small(need: Need, radius: Radius | None) -> Fault:
    """Why no wheel of that shape will do."""
    asked, name = need.asked, {DISC: "a disc", RIM: "a rim", ARMS: "a wheel with arms"}[need.asked.shape]
    expected = f"one that can have {need.inertia:.6g} kg m^2"
    if radius is not None:
        key = next(key for key in ("rim_speed", "mean_radius", "outer_radius") if getattr(asked, key) is not None)
        found = f"{name} of {'mean ' * radius.mean}radius {radius.value:.6g} m"
        return Fault(asked.at_key(key), found, expected, "enlarge the radius, or make it wider")
    if asked.material.allowable is not None and asked.max_radius is None:
        found = f"{name} under {asked.material.allowable / 1e6:.6g} MPa at {need.speed:.6g} rad/s"
        return Fault(asked.at_key("shape"), found, expected, "take a stronger material, or make it wider")
    found = f"{name} of at most {asked.max_radius:.6g} m under the allowable stress"
    return Fault(
        asked.at_key("max_radius"), found, expected, "enlarge the radius, make it wider, or take a stronger material"
    )
