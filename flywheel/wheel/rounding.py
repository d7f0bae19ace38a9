"""Dimensions put on multiples of a step, so that a wheel's inertia is not below what is needed."""

from __future__ import annotations

from math import ceil, floor

from flywheel.wheel.asked import DISC, WheelAsked
from flywheel.wheel.bodies import Body, ring
from flywheel.wheel.sizing import Need, known_radius, section_asked, solved

_EXACT = 1e-9  # of a step: what lies that near a multiple of it is that multiple


def rounded(need: Need, body: Body) -> Body:
    """The body on multiples of the step asked for, if any, with at least the inertia needed.

    What is given stays. A radius that speed or stress limits goes down, until the stress is allowed again; thickness, arms
    and at last width go up.
    """
    asked, step = need.asked, need.asked.size_step
    if step is None:
        return body
    if section_asked(asked) is not None:
        return _stepped_radius(asked, body, step)
    found = _stepped_section(need.of(_with_radius(asked, body, step)), step)
    while known_radius(need) is None and not need.allowed(found):
        body = body._replace(outer=body.outer - step)
        found = _stepped_section(need.of(_with_radius(asked, body, step)), step)
    return found


def rounded_up(value: float, step: float) -> float:
    """The least multiple of a step that is not below a value.

    >>> rounded_up(2321.2, 10.0), rounded_up(0.35, 0.05), rounded_up(0.3500001, 0.05)
    (2330.0, 0.35, 0.4)
    """
    return _multiple(ceil(value / step - _EXACT), step)


def rounded_down(value: float, step: float) -> float:
    """The greatest multiple of a step that is not above a value.

    >>> rounded_down(0.3539, 0.005)
    0.35
    """
    return _multiple(floor(value / step + _EXACT), step)


def _multiple(count: int, step: float) -> float:
    """A multiple of a step, without the last digits that binary fractions leave: 7 times 0.05 is 0.35."""
    return float(f"{count * step:.15g}")


def _stepped_radius(asked: WheelAsked, body: Body, step: float) -> Body:
    """Radius up, the section being given."""
    outer = rounded_up(body.outer, step)
    return ring(asked, outer, outer - body.inner if asked.shape == DISC else body.thickness, body.width)


def _stepped_section(need: Need, step: float) -> Body:
    """Thickness, arms and width up, the radius being given."""
    asked, body = need.asked, solved(need)
    if asked.shape != DISC:
        asked = _with_section(asked, body, step)
        if asked.width is not None:  # it was given: thickness went up instead
            return _of_section(need.of(asked), asked.width)
        body = solved(need.of(asked))
    return ring(asked, body.outer, body.thickness, rounded_up(body.width, step))


def _with_radius(asked: WheelAsked, body: Body, step: float) -> WheelAsked:
    """What is asked with a radius that is on a step, or as it was given."""
    if asked.outer_radius is not None or asked.mean_radius is not None:
        return asked
    free = asked._replace(rim_speed=None, max_radius=None)
    if asked.thin:
        return free._replace(mean_radius=rounded_down(body.mean, step))
    return free._replace(outer_radius=rounded_down(body.outer, step))


def _with_section(asked: WheelAsked, body: Body, step: float) -> WheelAsked:
    """What is asked with a thickness and arms that are on a step, or as they were given."""
    if body.arms is not None:
        arms = rounded_up(body.arms.width, step), rounded_up(body.arms.thickness, step)
        asked = asked._replace(arm_share=None, arm_width=arms[0], arm_thickness=arms[1])
    if asked.thickness is not None:
        return asked
    return asked._replace(thickness=rounded_up(body.thickness, step), width_to_thickness=None)


def _of_section(need: Need, width: float) -> Body:
    """The body of a radius, thickness and width that are all decided."""
    radius, thickness = known_radius(need), need.asked.thickness
    assert radius is not None
    assert thickness is not None
    return ring(need.asked, radius.outer(thickness), thickness, width)
