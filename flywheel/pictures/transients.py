"""Pictures of a motion that was followed: speed, torques and energy over time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from flywheel.language import text as _
from flywheel.motions.transients import Samples, Transient, sampled
from flywheel.pictures.figures import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILLION, figure, save, told
from flywheel.tables.rows import RPM

_POINTS, _FEWEST, _MOST = 4000, 3, 200  # in all, and within a step of the motion


def plot(transient: Transient, path: str | Path) -> None:
    """Draw a motion into a file: PNG, SVG or PDF, as its ending says; the same one every time.

    Raises ValueError for any other ending, OSError where the file cannot be written.
    """
    save(draw(transient), path)


def draw(transient: Transient) -> Figure:
    """The figure with its panels, not yet written anywhere."""
    samples = drawn(transient)
    panels = [_draw_speed, _draw_torque, _draw_energy] + ([_draw_current] if samples.current is not None else [])
    made = figure(10.0, 2.9 * len(panels), transient.scene.title or "")
    axes = made.subplots(len(panels), 1, sharex=True)
    for axis, panel in zip(axes, panels, strict=True):
        panel(axis, transient, samples)
        axis.grid(visible=True, color="#E5E5E5")
        axis.margins(x=0.01)
    words = transient.ended[0].upper() + transient.ended[1:]
    axes[0].set_title(f"{words}", parse_math=False)
    axes[-1].set_xlabel(_("time, s"))
    return made


def drawn(transient: Transient) -> Samples:
    """The motion in every step, at both its ends and between, so that a jump stays a vertical line."""
    trail = transient.motion.trail
    assert trail is not None
    count = int(np.clip(_POINTS // len(trail.stretches), _FEWEST, _MOST))
    return sampled(trail, *trail.within(np.arange(1, count + 1) / (count + 1)))


def _draw_speed(axis: Axes, transient: Transient, samples: Samples) -> None:
    sliding = transient.scene.reduction_element == "slide"
    axis.plot(samples.t, samples.omega, color=BLUE, lw=1.6)
    axis.set_ylabel(_("speed, m/s") if sliding else _("crank speed, rad/s"))
    if not sliding:
        there_and_back = (lambda speed: np.multiply(speed, RPM), lambda turns: np.divide(turns, RPM))
        axis.secondary_yaxis("right", functions=there_and_back).set_ylabel(_("crank speed, rpm"))
    steady, when = transient.regime_speed, transient.time_to_regime
    if steady is None:
        return
    label = _("regime, mean over time: {speed} {unit}", speed=told(steady), unit="m/s" if sliding else "rad/s")
    axis.axhline(steady, color=GREY, lw=1.0, ls="--", label=label)
    if when is not None and when > 0.0:
        axis.plot(
            [when], [0.95 * steady], "o", color=VERMILLION, ms=6, label=_("95 % of it after {time} s", time=told(when, 4))
        )
    axis.legend(loc="best", fontsize=9)


def _draw_torque(axis: Axes, transient: Transient, samples: Samples) -> None:
    sliding = transient.scene.reduction_element == "slide"
    ratio = 1.0 if transient.scene.drive is None else transient.scene.shafts.get(transient.scene.drive.on, 1.0)
    name = _("F* on the driver") if sliding else _("M* on the crank")
    name += ", " + _("after losses") if np.any(samples.loss) else ""
    axis.plot(samples.t, samples.moment, color=BLACK, lw=1.0, label=name)
    if transient.scene.drive is not None:
        drive = _("drive") if ratio == 1.0 else _("drive, on the crank")
        axis.plot(samples.t, samples.drive * ratio, color=ORANGE, ls="--", lw=1.6, label=drive)
    axis.axhline(0.0, color=GREY, lw=0.8)
    axis.set_ylabel(_("force, N") if sliding else _("torque, N m"))
    axis.legend(loc="best", fontsize=9)


def _draw_energy(axis: Axes, transient: Transient, samples: Samples) -> None:
    axis.plot(samples.t, samples.kinetic, color=GREEN, lw=1.6)
    axis.set_ylabel(_("kinetic energy, J"))


def _draw_current(axis: Axes, transient: Transient, samples: Samples) -> None:
    assert samples.current is not None
    axis.plot(samples.t, samples.current, color=PURPLE, lw=1.4)
    axis.set_ylabel(_("current, A"))
