"""Courses: the machine reduced to its driver over the driver, and a motion that was followed over time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from textwrap import wrap

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from flywheel.language import message
from flywheel.language import text as _
from flywheel.machine.machine import Machine
from flywheel.machine.reactions import close_positions
from flywheel.motions.curves import ANGLE
from flywheel.motions.kinematics import motion
from flywheel.motions.motion import Samples, Transient, sampled
from flywheel.pictures import figures, noun, written
from flywheel.pictures.figures import BLACK, BLUE, BODIES, GREEN, GREY, ORANGE, PURPLE, VERMILLION
from flywheel.pictures.kinematics import axis_of, broken, draw_panel, legend, shown, ticks
from flywheel.regime import constant_speed
from flywheel.regime.state import MachineState, at_speed, conditions, reduce
from flywheel.scene.scene import Scene
from flywheel.tables.rows import RPM
from flywheel.tables.scene import part_name

Array = NDArray[np.float64]

# -- the reduced machine ------------------------------------------------------------------
_POINTS = 721
_SHARES = np.arange(1, 16) / 16  # of the way between two landmarks
_MOST_PARTS = 8  # parts that are drawn; of more, the largest and the sum of the others
_JUMP, _CORNER, _DOZEN = 1e-6, 8.0, 12
_NO_PART = 1e-12  # of the largest: parts below it are none
_ROUNDED = 1e-14  # N m, N, kg m² or kg: rounding makes as much of nothing


def plot_reduction(scene: Scene, path: str | Path, *, of: Sequence[str] = (), speed: float | None = None) -> None:
    """Draws the machine of a scene, reduced to its driver, over its cycle or stroke: PNG, SVG or PDF.

    Args:
        scene: any with a machine.
        path: where the picture goes; the same scene gives the same file every time.
        of: bodies, slides, joints or points whose influence coefficients are drawn; those of bodies and slides if empty.
        speed: rad/s or m/s, at which what depends on it is taken; the scene's, or the machine's own, if None.

    Raises:
        SceneError: for a scene without a machine, a name that does not exist, a speed that nothing tells.
        ValueError: for any other file ending.

    """
    figures.save(draw_reduction(scene, of=of, speed=speed), path)


def draw_reduction(scene: Scene, *, of: Sequence[str] = (), speed: float | None = None) -> Figure:
    """The figure, not yet written anywhere."""
    machine = at_speed(scene, speed)
    marks = machine.landmarks
    fine = marks[:-1, None] + np.diff(marks)[:, None] * _SHARES  # a narrow feature lies between its own landmarks
    phi = np.unique(np.concatenate((close_positions(machine, _POINTS), machine.scene.origin + fine.ravel())))
    pace, balance = constant_speed.operating_point(machine, speed)
    state = reduce(machine, phi, balance=balance, speed=pace)
    gains = motion(machine.scene, of=of)
    curves, left_out = shown(list(gains.curves.values()))
    columns = [[curve for curve in curves if (curve.kind == ANGLE) == turning] for turning in (True, False)]
    columns = [column for column in columns if column and any(np.any(curve.velocity) for curve in column)]
    subtitle = message(conditions(machine, pace if machine.depends_on_speed else None))
    reduced = _("reduced to the slide") if scene.reduction_element == "slide" else _("reduced to the crank")
    title = ": ".join(part for part in (machine.scene.title or "", reduced) if part)
    made = figures.figure(9.6, 2.9 * (2 + len(columns)) + 0.6, "\n".join((title, *wrap(subtitle, 90))))
    panels = made.subplots(2 + len(columns), 1, sharex=True)
    scale, label = axis_of(gains)
    inner = switches(machine, phi, (state.moment, *state.moment_parts.values(), state.inertia, state.slope))
    sliding = gains.sliding
    names = ("m*, kg", "F*, N") if sliding else ("I*, kg m²", "M*, N m")
    _draw_parts(panels[0], machine, phi, state, state.inertia, state.inertia_parts, names[0], scale)
    _draw_parts(panels[1], machine, phi, state, state.moment, state.moment_parts, names[1], scale)
    for panel, column in zip(panels[2:], columns, strict=True):
        draw_panel(panel, gains, column, 1, scale)
        legend(panel, gains, column, beside=True)
    for panel in panels:
        for at in inner:
            panel.axvline(scale * at, color=GREY, lw=0.7, ls=":", zorder=1.2)
        ticks(panel, gains)
    if inner.size:
        panels[1].plot([], [], color=GREY, lw=0.9, ls=":", label=_("a load or a law switches"))
    if panels[1].get_legend_handles_labels()[1]:
        panels[1].legend(loc="center left", bbox_to_anchor=(1.01, 0.5), fontsize=8.5, frameon=False)
    further = " " + _("({number} more coefficients can be drawn by name)", number=left_out)
    panels[-1].set_xlabel(label + (further if left_out else ""))
    return made


def switches(machine: Machine, phi: Array, values: Iterable[Array]) -> Array:
    """Breakpoints (rad or m) at which a figure jumps or has a corner; of more than a dozen those at which one jumps."""
    edges = machine.scene.origin + machine.switches[1:-1]
    at = np.searchsorted(phi, edges)  # of three neighbours, before, at and beyond an edge, the middle one
    jumps, corners = np.zeros(edges.size, dtype=bool), np.zeros(edges.size, dtype=bool)
    for y in values if edges.size else ():
        size = float(np.abs(y).max())
        jumps |= np.abs(y[at] - y[at - 1]) > _JUMP * size
        steep = np.diff(y) / np.diff(phi)
        before, after = steep[np.maximum(at - 2, 0)], steep[np.minimum(at + 1, steep.size - 1)]
        bends = np.abs(before - steep[np.maximum(at - 3, 0)]) + np.abs(steep[np.minimum(at + 2, steep.size - 1)] - after)
        corners |= np.abs(after - before) > _CORNER * bends + _JUMP * size / float(np.ptp(phi))
    corners |= jumps
    return edges[corners if np.count_nonzero(corners) <= _DOZEN else jumps]


def _draw_parts(
    panel: Axes,
    machine: Machine,
    phi: Array,
    state: MachineState,
    total: Array,
    parts: Mapping[str, Array],
    label: str,
    scale: float,
) -> None:
    """The whole in black with its extremes in the legend, and what every body or load adds to it."""
    figures.name_axes(panel, "", "", label)
    edges = machine.scene.origin + machine.switches
    size = max((float(np.abs(part).max()) for part in parts.values()), default=0.0)
    if size <= _ROUNDED:
        symbol = label.partition(",")[0]
        why = _("{symbol} = 0: no load, weight or drive acts here.", symbol=symbol)
        if symbol in ("I*", "m*"):
            why = _("{symbol} = 0: nothing has mass or inertia.", symbol=symbol)
        panel.text(0.5, 0.5, why, ha="center", va="center", transform=panel.transAxes, color=GREY)
        panel.set_yticks([])
        return
    some = {name: part for name, part in parts.items() if float(np.abs(part).max()) > _NO_PART * size}
    if len(some) > _MOST_PARTS:
        largest = sorted(some, key=lambda name: -float(np.abs(some[name]).max()))[: _MOST_PARTS - 1]
        rest = [part for name, part in some.items() if name not in largest]
        some = {name: part for name, part in some.items() if name in largest} | {f"{len(rest)} others": np.sum(rest, axis=0)}
    alone = len(some) == 1 and all(np.array_equal(total, part) for part in some.values())
    for k, (name, part) in enumerate(() if alone else some.items()):
        x, y = broken(phi, part, edges)
        words = part_name(machine.scene, name)
        panel.plot(scale * x, y, color=BODIES[k % len(BODIES)], lw=1.3, label=words if words != name else noun(name))
    x, y = broken(phi, total, edges)
    symbol = label.partition(",")[0]
    least, most = (written(value, 4) for value in (float(total.min()), float(total.max())))
    whole = _("{symbol}, from {least} to {most}", symbol=symbol, least=least, most=most)
    panel.plot(scale * x, y, color=BLACK, lw=1.8, label=whole)
    panel.axhline(0.0, color=BLACK, lw=0.6, zorder=1.5)
    panel.margins(y=0.1)
    panel.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), fontsize=8.5, frameon=False)


# -- over time ------------------------------------------------------------------

_TIMES, _FEWEST, _MOST_WITHIN = 4000, 3, 200  # in all, and within a step of the motion


def plot_transient(transient: Transient, path: str | Path) -> None:
    """Draws a motion into a file: PNG, SVG or PDF, as its ending says; the same one every time.

    Raises ValueError for any other ending, OSError where the file cannot be written.
    """
    figures.save(draw_transient(transient), path)


def draw_transient(transient: Transient) -> Figure:
    """The figure with its panels, not yet written anywhere."""
    samples = drawn(transient)
    panels = [_draw_speed, _draw_torque, _draw_energy] + ([_draw_current] if samples.current is not None else [])
    made = figures.figure(10.0, 2.9 * len(panels), transient.scene.title or "")
    axes = made.subplots(len(panels), 1, sharex=True)
    for axis, panel in zip(axes, panels, strict=True):
        panel(axis, transient, samples)
        axis.grid(visible=True, color="#E5E5E5")
        axis.margins(x=0.01)
    words = message(transient.ended)
    axes[0].set_title("\n".join(wrap(words[0].upper() + words[1:], 100)), parse_math=False)
    axes[-1].set_xlabel(_("time, s"))
    return made


def drawn(transient: Transient) -> Samples:
    """The motion in every step, at both its ends and between, so that a jump stays a vertical line."""
    trail = transient.motion.trail
    assert trail is not None
    count = int(np.clip(_TIMES // len(trail.stretches), _FEWEST, _MOST_WITHIN))
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
    label = _("regime, mean over time: {speed} {unit}", speed=written(steady), unit="m/s" if sliding else "rad/s")
    axis.axhline(steady, color=GREY, lw=1.0, ls="--", label=label)
    if when is not None and when > 0.0:
        axis.plot(
            [when], [0.95 * steady], "o", color=VERMILLION, ms=6, label=_("95 % of it after {time} s", time=written(when, 4))
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
