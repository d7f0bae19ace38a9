"""Speeds of a report: asked and taken, greatest and least; and how a motion whose torques depend on speed holds itself."""

from __future__ import annotations

from collections.abc import Iterable
from math import log, log1p

from flywheel.results import Cyclic, Sizing
from flywheel.writing import outcome
from flywheel.writing.digits import columns, figure, short
from flywheel.writing.rows import DEGREES, RPM, Row, block, sentences

_LEFT = 0.01  # of a change, when it counts as gone
_NEAR_ONE = 0.01  # of a multiplier to 1: the difference then says more
_NOTHING = 1e-12  # of a damping that rounding makes
_ALIKE = 1e-9  # a multiplier, and 1 less the damping, of a motor with a current too: theirs may turn


def speeds(sizing: Sizing) -> list[str]:
    """The speeds of the crank, and of the flywheel's shaft."""
    found, scene = outcome.speeds(sizing), sizing.scene
    if found is None:
        return []
    rows = [
        *_asked(sizing),
        _cells("mean of extremes", sizing.speed, 0.0),
        _cells("greatest", found.greatest, found.error, sizing.angle_speed_max),
        _cells("least", found.least, found.error, sizing.angle_speed_min),
    ]
    if sizing.simulation is not None and sizing.simulation.speed_time_mean is not None:
        rows.append(_cells("mean over time", sizing.simulation.speed_time_mean, found.error))
    if scene.flywheel_on != "crank":
        rows.append(_cells(f"mean, shaft {scene.flywheel_on}", sizing.speed * scene.flywheel_ratio, 0.0))
    header = ("", "rpm", "rad/s", "at, deg")
    keep = slice(4 if sizing.angle_speed_max is not None else 3)
    return ["Speed of the crank", *columns([row[keep] for row in rows], header[keep])]


def _asked(sizing: Sizing) -> Iterable[tuple[str, ...]]:
    """The speed asked for, where the machine takes one of its own."""
    if sizing.cyclic is not None and sizing.scene.unknown is None and sizing.scene.speed is not None:
        yield _cells("asked for", sizing.scene.speed, 0.0)


def _cells(name: str, speed: float, error: float, angle: float | None = None) -> tuple[str, ...]:
    at = "" if angle is None else figure(angle * DEGREES, 1e-9, 7)
    return name, figure(speed * RPM, error * RPM), figure(speed, error), at


def holding(sizing: Sizing) -> list[str]:
    """The cycle multiplier in words, and the constant speed that the approximate figures hold for."""
    cyclic = sizing.cyclic
    if cyclic is None:
        return []
    lines = block("How the motion holds itself", [*_multiplier(cyclic), *_settling(sizing, cyclic)])
    speed = cyclic.constant_speed
    at = f"{figure(speed, 0.0, 7)} rad/s ({figure(speed * RPM, 0.0, 7)} rpm)"
    return lines + sentences([f"Areas and approximate figures take the torques at a constant {at}."])


def _multiplier(cyclic: Cyclic) -> Iterable[Row]:
    value = figure(cyclic.multiplier, 0.0, 6)
    yield Row("cycle multiplier", value, "what a cycle leaves of a small change of speed")
    if _NOTHING < abs(cyclic.damping) < _NEAR_ONE:
        yield Row("1 - multiplier", short(cyclic.damping))


def _settling(sizing: Sizing, cyclic: Cyclic) -> Iterable[Row]:
    """How long a change takes to go, or why it does not."""
    if cyclic.damping < -_NOTHING or cyclic.multiplier > 1.0 + _ALIKE:
        yield Row("settles", "no", "a change grows from cycle to cycle")
    elif cyclic.damping <= _NOTHING:
        yield Row("settles", "no", "no torque brings a change of speed back")
    else:
        cycles = settling_cycles(cyclic)
        lasts = sizing.scene.cycle / sizing.speed
        yield Row("settles to 1 % in", figure(cycles, 0.0, 3), f"cycles, {figure(cycles * lasts, 0.0, 3)} s")


def settling_cycles(cyclic: Cyclic) -> float:
    """Cycles after which a hundredth of a small change is left: ln 0.01/ln multiplier, below 1 where it goes faster.

    >>> round(settling_cycles(Cyclic(0.5, 0.5, 3, 0.0, 1.0)), 6)
    6.643856
    """
    if cyclic.multiplier < _LEFT**100:  # nothing is left that a number could show
        return 0.0
    near = cyclic.damping < 0.5 and abs(1.0 - cyclic.damping - cyclic.multiplier) < _ALIKE  # its digits are in damping
    return log(_LEFT) / (log1p(-cyclic.damping) if near else log(cyclic.multiplier))
