"""Display of scenes, machines and results in notebooks: HTML of tables and small curves, without matplotlib; and pictures.

`html` finds the function for a type by its name in `_WRITERS`. Nothing here computes: results are only displayed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flywheel.numerics.units import figure
from flywheel.tables.designs import sweep_text
from flywheel.tables.rows import DEGREES, RPM
from flywheel.tables.scene import parts

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from flywheel.designs.sweep_results import Sweep
    from flywheel.machine.machine import Machine
    from flywheel.motions.joint_forces import JointForces
    from flywheel.motions.kinematics import Kinematics
    from flywheel.motions.motion import Motion, Transient
    from flywheel.motions.single_stroke import SingleStroke
    from flywheel.regime.state import MachineState
    from flywheel.scene.scene import Scene
    from flywheel.sizing.results import PowerFlow, Sizing, Sizings
    from flywheel.study.tradeoff import Tradeoff

__all__ = ["Curve", "curves", "html", "picture", "power_picture", "save_picture", "sweep_text", "table"]

Array = NDArray[np.float64]

_MOST_ROWS = 24  # rows of a table
_POINTS = 400  # of a curve
_WIDTH, _HEIGHT, _LEFT, _BELOW = 440.0, 170.0, 64.0, 34.0
_STYLE = (
    "<style scoped>.flywheel{font:14px/1.45 system-ui,sans-serif;max-width:60em}.flywheel table{border-collapse:collapse;"
    "margin:.3em 0 .6em}.flywheel td,.flywheel th{text-align:left;padding:.1em .7em;border-bottom:1px solid #8886;"
    "vertical-align:top;font-weight:normal}.flywheel th{font-style:italic}.flywheel .n{text-align:right;"
    "font-variant-numeric:tabular-nums}.flywheel svg{max-width:100%;height:auto;color:inherit}</style>"
)


def html(thing: object) -> str | None:
    """The HTML of a scene, machine or result; None for anything else."""
    writer = next((_WRITERS[kind.__name__] for kind in type(thing).__mro__ if kind.__name__ in _WRITERS), None)
    return None if writer is None else f'<div class="flywheel">{_STYLE}{"".join(writer(thing))}</div>'


# -- tables and curves ---------------------------------------------------------------------------------------------


def table(rows: Iterable[Sequence[str]], header: Sequence[str] = ()) -> str:
    """Rows as an HTML table, numbers to the right; the first few of many, and the number of the others."""
    listed_rows = list(rows)
    lines = ["".join(f'<th scope="col"{_side(title)}>{escape(title)}</th>' for title in header)] if header else []
    for row in listed_rows[:_MOST_ROWS]:
        first, *rest = row
        cells = "".join(f"<td{_side(cell)}>{escape(cell)}</td>" for cell in rest)
        lines.append(f'<th scope="row">{escape(first)}</th>{cells}')
    if len(listed_rows) > _MOST_ROWS:
        lines.append(f'<th scope="row">and {len(listed_rows) - _MOST_ROWS} more</th>')
    return f"<table>{''.join(f'<tr>{line}</tr>' for line in lines)}</table>" if lines else ""


def _side(cell: str) -> str:
    return ' class="n"' if cell[:1].isdigit() or cell[:1] in "+-−" else ""


class Curve(NamedTuple):
    """A curve of a small picture: its name, its values, the colour it is drawn in."""

    name: str
    values: Array
    colour: str = "#0072b2"


def curves(x: Array, curve_list: Sequence[Curve], across: str, up: str) -> str:
    """Curves over one axis as SVG, with the ends of both axes as numbers."""
    kept = np.unique(np.linspace(0, x.size - 1, min(x.size, _POINTS)).astype(int))
    values = [curve.values[kept] for curve in curve_list]
    x = x[kept]
    low, high = min(float(v.min()) for v in values), max(float(v.max()) for v in values)
    if not (np.isfinite([low, high]).all() and x[-1] > x[0]):
        return ""
    low, high = (min(low, 0.0), max(high, 0.0)) if low * high <= 0.0 or high < 4 * (high - low) else (low, high)
    span = high - low or abs(high) or 1.0
    across_of = (x - x[0]) / (x[-1] - x[0]) * (_WIDTH - _LEFT - 8) + _LEFT

    def line(v: Array) -> str:
        points = zip(across_of, _HEIGHT - _BELOW - (v - low) / span * (_HEIGHT - _BELOW - 20), strict=True)
        return " ".join(f"{a:.1f},{b:.1f}" for a, b in points)

    texts = [
        (_LEFT - 4, 24, "end", figure(high, most=4)),
        (_LEFT - 4, _HEIGHT - _BELOW, "end", figure(low, most=4)),
        (_LEFT, _HEIGHT - _BELOW + 14, "start", figure(float(x[0]), most=4)),
        (_WIDTH - 8, _HEIGHT - _BELOW + 14, "end", figure(float(x[-1]), most=4)),
        ((_WIDTH + _LEFT) / 2, _HEIGHT - 6, "middle", across),
        (_LEFT, 12, "start", f"{', '.join(curve.name for curve in curve_list)}, {up}"),
    ]
    drawn = [
        f'<polyline fill="none" stroke="{curve.colour}" stroke-width="1.6" points="{line(v)}"/>'
        for curve, v in zip(curve_list, values, strict=True)
    ]
    frame = f"M{_LEFT:g} 18V{_HEIGHT - _BELOW:g}H{_WIDTH - 8:g}"
    if low < 0.0 < high:
        zero = _HEIGHT - _BELOW + low / span * (_HEIGHT - _BELOW - 20)
        frame += f"M{_LEFT:g} {zero:.1f}H{_WIDTH - 8:g}"
    said = escape(f"{', '.join(curve.name for curve in curve_list)} over {across}")
    words = "".join(f'<text x="{a:g}" y="{b:g}" text-anchor="{side}">{escape(t)}</text>' for a, b, side, t in texts)
    return (
        f'<svg role="img" aria-label="{said}" width="{_WIDTH:g}" height="{_HEIGHT:g}" viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" '
        f'font-size="11" fill="currentColor"><path d="{frame}" fill="none" stroke="currentColor" stroke-opacity=".5"/>'
        f"{''.join(drawn)}{words}</svg>"
    )


def _number(value: float | None, most: int = 5) -> str:
    return "" if value is None else figure(value, most=most)


# -- what is shown -------------------------------------------------------------------------------------------------


def _sizing(sizing: Sizing) -> Iterator[str]:
    """The summary, and the turning moment with its work over the cycle."""
    from flywheel.pictures.forms import part_of
    from flywheel.tables.summary import summary

    for block in summary(sizing):
        if block.title:
            yield f"<p><strong>{escape(block.title)}</strong></p>"
        if block.table:
            yield table(block.table, block.header)
        yield table((row.label, " ".join(filter(None, (row.value, row.unit))), row.note) for row in block.rows)
        for sentence in block.sentences:
            yield f"<p>{escape(sentence)}</p>"
    machine, cycle = sizing.machine, sizing.constant or sizing.cycle
    if machine is None or cycle is None or cycle.mesh.phi.shape[0] > _POINTS:
        return
    samples = part_of(sizing.scene, machine, sizing, _POINTS).samples
    assert samples is not None
    phi = samples.phi * DEGREES
    yield curves(phi, [Curve("turning moment M*", samples.moment)], "crank angle, deg", "N m")
    yield curves(phi, [Curve("its work W", samples.work, "#d55e00")], "crank angle, deg", "J")


def _sizings(sizings: Sizings) -> Iterator[str]:
    """Differences between sizings, a row each."""
    figures = sizings.figures
    names = [name for name in sizings.columns if name != "title"]
    titled = len({row["title"] for row in figures}) > 1
    header = ("", *names)
    rows = [
        (str((row["title"] if titled else None) or k), *(_cell(row.get(name)) for name in names))
        for k, row in enumerate(figures)
    ]
    yield table(rows, header)


def _cell(value: object) -> str:
    return _number(value) if isinstance(value, float) else "" if value is None else str(value)


def _scene(scene: Scene) -> Iterator[str]:
    """The quantities of a scene as they were read, and the remarks on them."""
    if scene.title:
        yield f"<p><strong>{escape(scene.title)}</strong></p>"
    yield table((part.label, part.row) for part in parts(scene))
    for remark in scene.remarks:
        yield f"<p>Remark: {escape(str(remark))}</p>"


def _machine(machine: Machine) -> Iterator[str]:
    yield from _scene(machine.scene)
    bonds, breaks = len(machine.graph.bonds), len(machine.breakpoints)
    yield f"<p>Its bond graph has {bonds} bonds (<code>.graph</code>); loads and bodies break at {breaks} angles.</p>"


def _state(state: MachineState) -> Iterator[str]:
    """I*, its slope and M* at every angle, and as curves if there are many."""
    columns = [np.atleast_1d(column) for column in (state.phi, state.inertia, state.slope, state.moment)]
    phi, inertia, slope, moment = columns
    rows = zip(phi, inertia, slope, moment, strict=True)
    yield table((tuple(_number(float(v)) for v in row) for row in rows), ("phi, rad", "I*, kg m²", "dI*/dphi", "M*, N m"))
    if phi.size > 8 and (np.diff(phi) >= 0.0).all():
        yield curves(phi, [Curve("I*", inertia, "#009e73")], "phi, rad", "kg m²")
        yield curves(phi, [Curve("M*", moment)], "phi, rad", "N m")


def _motion(motion: Motion) -> Iterator[str]:
    yield f"<p>{escape(repr(motion))}</p>"
    yield curves(motion.t, [Curve("speed", motion.omega)], "t, s", "rad/s")


def _transient(run: Transient) -> Iterator[str]:
    """End of a motion, its peaks and energy, and the speed over time."""
    sliding = run.scene.reduction_element == "slide"
    speed, scale = ("m/s", 1.0) if sliding else ("rpm", RPM)
    rows = [
        ("ended", run.ended, ""),
        ("time", f"{_number(run.time)} s", ""),
        ("way", f"{_number(run.way)} m" if sliding else f"{_number(run.turns)} turns", ""),
        ("speed at the end", f"{_number(run.omega * scale)} {speed}", ""),
    ]
    if run.time_to_regime is not None:
        rows.append(
            (
                "95 % of the regime",
                f"{_number(run.time_to_regime)} s",
                f"{_number((run.regime_speed or 0.0) * scale)} {speed}",
            )
        )
    units = {"speed": speed, "torque": "N" if sliding else "N m", "power": "W", "current": "A"}
    for name, peak in run.peaks._asdict().items():
        if peak is not None:
            value = peak.value * (scale if name == "speed" else 1.0)
            rows.append((f"greatest {name}", f"{_number(value)} {units[name]}", f"at {_number(peak.time)} s"))
    rows.append(("work of the drive", f"{_number(run.energy.drive)} J", ""))
    yield table(rows)
    yield from (f"<p>Note: {escape(message)}</p>" for message in run.messages)
    yield curves(run.motion.t, [Curve("speed", run.motion.omega * scale)], "t, s", speed)


def _kinematics(motion: Kinematics) -> Iterator[str]:
    """Names of the curves, and the range of each position."""
    yield f"<p>{escape(repr(motion))}</p>"
    rows = []
    for name, curve in motion.curves.items():
        pairs = zip(("x", "y"), np.atleast_2d(curve.position), np.atleast_2d(curve.errors[0]), strict=False)
        for component, values, errors in pairs:
            part, off = name if curve.position.ndim == 1 else f"{name} {component}", float(errors.max())
            ends = (figure(float(end), off, 5) for end in (values.min(), values.max()))
            rows.append((part, *ends, curve.unit))
    yield table(rows, ("position", "least", "greatest", ""))
    yield from (f"<p>Note: {escape(message)}</p>" for message in motion.messages)


def _forces(forces: JointForces) -> Iterator[str]:
    """The range of every component over the positions of the result."""
    from flywheel.motions.joint_forces import force_curves

    yield f"<p>{escape(repr(forces))}</p>"
    rows = []
    for curve in force_curves(forces):
        finite = curve.values[np.isfinite(curve.values)]
        ends = (_number(float(finite.min())), _number(float(finite.max()))) if finite.size else ("not determined", "")
        rows.append((curve.name, *ends, curve.unit))
    yield table(rows, ("at these positions", "least", "greatest", ""))
    yield from (f"<p>Note: {escape(message)}</p>" for message in forces.messages)


def _tradeoff(comparison: Tradeoff) -> Iterator[str]:
    from flywheel.study.tradeoff import duration

    yield f"<p>{escape(comparison.sentence)}</p>"
    rows = (
        (row.name, "" if row.error is None else f"{row.error:.1e}", "" if row.seconds is None else duration(row.seconds))
        for row in comparison.rows
    )
    yield table(rows, ("method", "relative error", "time"))


def _sweep(sweep: Sweep) -> Iterator[str]:
    """Text of the terminal."""
    yield f"<pre>{escape(sweep.table())}</pre>"


_WRITERS: dict[str, Callable[[Any], Iterator[str]]] = {  # by the names of types: to look at a scene imports no results
    "Sizing": _sizing,
    "Sizings": _sizings,
    "Scene": _scene,
    "Machine": _machine,
    "MachineState": _state,
    "Motion": _motion,
    "Transient": _transient,
    "Kinematics": _kinematics,
    "JointForces": _forces,
    "Tradeoff": _tradeoff,
    "Sweep": _sweep,
}


def picture(result: Sizing | SingleStroke) -> Figure:
    """The picture of `flywheel size --plot` as a figure of matplotlib."""
    from flywheel.pictures.sizing import draw

    return draw(result)


def power_picture(flow: PowerFlow, at: float | None = None) -> Figure:
    """The picture of `flywheel power --plot` as a figure of matplotlib, at a crank angle (rad) or over the mean."""
    from flywheel.pictures.power_flow import draw

    return draw(flow, at)


def save_picture(result: Sizing | SingleStroke | Sweep | PowerFlow, path: str | Path, at: float | None = None) -> None:
    """The picture of a result, written into a file: PNG, SVG or PDF, by its ending; of a power flow `at` an angle."""
    from flywheel.motions.single_stroke import SingleStroke
    from flywheel.sizing.results import PowerFlow, Sizing

    if isinstance(result, Sizing | SingleStroke):
        from flywheel.pictures.sizing import plot

        plot(result, path)
    elif isinstance(result, PowerFlow):
        from flywheel.pictures import power_flow

        power_flow.plot(result, path, at=at)
    else:
        from flywheel.pictures.designs import plot_sweep

        plot_sweep(result, path)
