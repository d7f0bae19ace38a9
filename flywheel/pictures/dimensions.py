"""Pictures of the worked report: a mechanism with its dimensions, its bond graph, and shares of I* and M* over the cycle.

All are SVG with text as text. Lengths, angles and masses stand beside the measured parts, at one position.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from io import StringIO
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

import bondgraph
from flywheel.language import number as localized
from flywheel.language import text as _
from flywheel.machine.machine import Machine, explanations, graph_with_flywheel
from flywheel.mechanisms import KINDS
from flywheel.mechanisms.linkages.equations import Poses
from flywheel.numerics.units import figure as number
from flywheel.pictures import figures, sketch
from flywheel.pictures.figures import BLACK, BODIES, GREY
from flywheel.pictures.mechanisms import colours, draw_bodies, write_names
from flywheel.pictures.sketch import CLOSED, View, placed
from flywheel.scene.linkage import FRAME, PIN, SLIDE, SLOT, Linkage
from flywheel.scene.scene import Mechanism, Scene
from flywheel.tables.rows import largest_parts

Array = NDArray[np.float64]

_WIDTH, _TALLEST = 7.4, 7.6  # inches
_OFFSETS = (4.0, -4.0, 7.5, -7.5, 11.0, -11.0)  # of a dimension line from what it measures, in pins' radii
_SHORT = 1e-3  # of the mechanism's size: distances below it are none
_MOST_DIMENSIONS = 18  # dimensions in one picture


def drawn(scene: Scene, phi: float) -> Iterator[tuple[str, str, str]]:
    """Every mechanism that has bodies, equal ones once: its name, its picture as SVG, and the parts not drawn."""
    seen = []
    for view in sketch.views(scene):
        alike = (view.mechanism.type, str(view.mechanism.geometry), str(view.mechanism.bodies), view.mechanism.linkage)
        if alike in seen:
            continue
        seen.append(alike)
        made, left = _drawing(scene, view, phi)
        yield view.mechanism.name, svg(made), left


def svg(made: Figure) -> str:
    """A figure as SVG whose texts are texts."""
    into = StringIO()
    with rc_context({**figures.STYLE, "svg.fonttype": "none"}):
        made.savefig(into, format="svg", metadata={"Date": None})
    return into.getvalue()


def _drawing(scene: Scene, view: View, phi: float) -> tuple[Figure, str]:
    """One mechanism at a position, with dimension lines, masses, angle, sense and gravity; and the parts left out."""
    poses, spare = view.poses(phi), 9.0 * view.sketch.unit  # room for dimension lines
    outline = _outline(view, poses)
    box = np.stack((np.nanmin(outline, axis=1) - spare, np.nanmax(outline, axis=1) + spare), axis=1)
    size = np.ptp(box, axis=1)
    height = min(max(_WIDTH * float(size[1] / size[0]), 2.4), _TALLEST)
    made = figures.figure(_WIDTH, height, "")
    panel = made.subplots()
    panel.set_axis_off()
    panel.set_aspect("equal")
    panel.set_xlim(*box[0])
    panel.set_ylim(*box[1])
    metres = np.array([[0.0, 2.0], [0.0, 2.0]])  # a box from which no mm are taken
    draw_bodies(panel, view, poses, metres)
    dimensions = list(_dimensions(view, poses))
    left = dimensions[_MOST_DIMENSIONS:]
    names: list[tuple[str, str, tuple[float, float]]] = []
    lines: list[Array] = [_outline(view, poses)]
    for start, end, text in dimensions[:_MOST_DIMENSIONS]:
        line, spot = _dimension_line(panel, view, start, end, lines)
        lines.append(line)
        names.append((text, BLACK, spot))
    names += _masses(panel, view, poses)
    names += _angle(panel, scene, view, poses, phi, lines)
    _gravity(panel, scene, view, box)
    figures.lay_out(made)
    write_names(panel, view, poses, 1.0, names, lines[1:])
    note = _("Not drawn for lack of room: {listed}.", listed=", ".join(text for _, _, text in left)) if left else ""
    return made, note


def _outline(view: View, poses: Poses) -> Array:
    """Points along everything drawn of the bodies, (2, m)."""
    points = []
    for shape in view.sketch.shapes:
        outline = placed(shape, poses)[:, :, 0]
        points.append(np.concatenate((outline, outline[:, :1]), axis=1) if shape.kind in CLOSED else outline)
        points.append(np.full((2, 1), np.nan))
    return np.concatenate(points, axis=1)


# -- what is measured --------------------------------------------------------------------------------------------------


def _dimensions(view: View, poses: Poses) -> Iterator[tuple[Array, Array, str]]:
    """Distances between the joints of every body, from its origin if a joint is there; the frame's last.

    Each with its two ends (m) and its text.
    """
    linkage, mechanism = view.solution.linkage, view.mechanism
    least = _SHORT * view.sketch.size
    for body in (*linkage.names[1:], FRAME):
        nodes = sorted(_nodes(linkage, body), key=lambda node: node != (0.0, 0.0))
        for node in nodes[1:]:
            ends = [poses.point(body, place).value[:, 0] for place in (nodes[0], node)]
            length = float(np.hypot(*(ends[1] - ends[0])))
            if length > least:
                symbol = _symbol(mechanism, body, length)
                yield ends[0], ends[1], (f"{symbol} = " if symbol else "") + length_text(length)
    driver = linkage.joint(linkage.driver)
    if driver.kind == SLIDE:
        ends = [
            poses.point(driver.first, driver.first_at).value[:, 0],
            poses.point(driver.second, driver.second_at).value[:, 0],
        ]
        way = float(poses.q[0])
        if abs(way) > least:
            yield ends[0], ends[1], f"x = {length_text(way)}"
    kind = KINDS[mechanism.type]
    for key in kind.heights:
        if height := mechanism.geometry.get(key, 0.0):
            body = key.partition(".")[0]
            x = 0.0 if body == FRAME else float(poses.point(body, (0.0, 0.0)).value[0, 0]) + 6 * view.sketch.unit
            text = f"{_written(kind.symbols[key])} = {length_text(height)}"
            yield np.array([x, 0.0]), np.array([x, height]), text


def _symbol(mechanism: Mechanism, body: str, length: float) -> str:
    """The symbol of a distance between two joints of a body, where the scene gives it as a length."""
    kind = KINDS[mechanism.type]
    keys = {f"{part.name}.{key.name}" for part in kind.parts for key in part.geometry if key.kind == "length"}
    for key, symbol in kind.symbols.items():
        owner = key.partition(".")[0].replace("ground", FRAME)
        measured = key in keys and key not in kind.heights and owner == body
        if measured and abs(mechanism.geometry[key] - length) < 1e-9 * length:
            return _written(symbol)
    return ""


def _written(symbol: str) -> str:
    """A symbol with its number as an index: a_2 is a₂."""
    return symbol.replace("_", "").translate(str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉"))


def _nodes(linkage: Linkage, body: str) -> list[tuple[float, float]]:
    """Places of a body's joints in its own frame, each once, in the order of the joints."""
    nodes: dict[tuple[float, float], None] = {}
    for joint in linkage.joints:
        if joint.first == body and joint.kind not in (SLIDE, SLOT):
            nodes[joint.first_at.x, joint.first_at.y] = None
        if joint.second == body and (joint.kind == PIN or body != FRAME):
            nodes[joint.second_at.x, joint.second_at.y] = None
    return list(nodes)


def length_text(length: float) -> str:
    """A length as designers write it: mm, or m from 10 m on."""
    by, unit = (1.0, "m") if abs(length) >= 10.0 else (1000.0, "mm")
    return localized(number(by * length, 0.0, 5)).replace("-", "−") + f" {unit}"


# -- how it is drawn ---------------------------------------------------------------------------------------------------


def _dimension_line(
    panel: Axes, view: View, start: Array, end: Array, lines: list[Array]
) -> tuple[Array, tuple[float, float]]:
    """A line with arrows beside the measured length, on the side with room; and the place of its text."""
    unit = view.sketch.unit
    way = (end - start) / np.hypot(*(end - start))
    across = np.array([-way[1], way[0]])
    points = np.concatenate(lines, axis=1)
    points = points[:, np.isfinite(points).all(axis=0)]

    def clash(offset: float) -> float:
        middle = 0.5 * (start + end) + offset * unit * across
        length = 0.5 * float(np.hypot(*(end - start)))
        relative = points - middle[:, None]
        along, aside = np.abs(way @ relative), np.abs(across @ relative)
        return float(((along < length + unit) & (aside < 2.2 * unit)).sum()) + 2.0 * abs(offset)

    offset = min(_OFFSETS, key=clash) * unit
    a, b = start + offset * across, end + offset * across
    for base, tip in ((start, a), (end, b)):
        over = tip + np.sign(offset) * unit * across
        panel.plot([base[0], over[0]], [base[1], over[1]], color=GREY, lw=0.6, zorder=4.2)
    arrows = {"arrowstyle": "<->", "color": GREY, "lw": 0.8, "shrinkA": 0.0, "shrinkB": 0.0, "mutation_scale": 9.0}
    panel.annotate("", xy=tuple(b), xytext=tuple(a), arrowprops=arrows, zorder=4.3)
    line = np.stack([a + share * (b - a) for share in np.linspace(0.0, 1.0, 25)], axis=1)
    middle = 0.5 * (a + b)
    return line, (float(middle[0]), float(middle[1]))


def _masses(panel: Axes, view: View, poses: Poses) -> list[tuple[str, str, tuple[float, float]]]:
    """A quartered circle at every centre of mass, with the body's mass."""
    linkage, ink, names = view.solution.linkage, colours(view), []
    bodies = view.mechanism.bodies
    for body in linkage.names[1:]:
        link = linkage.link(body)
        mass = link.mass or (bodies[body].mass if body in bodies else 0.0)
        if not mass:
            continue
        x, y = poses.centre(body).value[:, 0]
        radius = 1.25 * view.sketch.unit
        for quarter in range(4):
            angle = np.linspace(0.5 * np.pi * quarter, 0.5 * np.pi * (quarter + 1), 12)
            outline = np.stack((x + radius * np.cos(angle), y + radius * np.sin(angle)), axis=1)
            outline = np.concatenate((outline, [[x, y]]))
            face = "white" if quarter % 2 else BLACK
            panel.fill(outline[:, 0], outline[:, 1], facecolor=face, edgecolor=BLACK, lw=0.7, zorder=5.0)
        names.append(
            (_("{body}: {mass} kg", body=body, mass=localized(number(mass, 0.0, 5))), ink[body], (float(x), float(y)))
        )
    return names


def _angle(
    panel: Axes, scene: Scene, view: View, poses: Poses, phi: float, lines: list[Array]
) -> list[tuple[str, str, tuple[float, float]]]:
    """The crank's angle from +x as an arc with an arrow in its sense; for a slide its displacement from zero."""
    linkage = view.solution.linkage
    joint = linkage.joint(linkage.driver)
    if joint.kind != PIN or FRAME not in (joint.first, joint.second):
        return []
    centre = poses.point(joint.first, joint.first_at).value[:, 0]
    psi = view.ratio * phi + view.phase
    nodes = _nodes(linkage, joint.second if joint.first == FRAME else joint.first)
    reach = max((float(np.hypot(*node)) for node in nodes), default=0.0)
    radius = max(0.55 * reach, 5.0 * view.sketch.unit)
    turn = float(psi % (2 * np.pi))
    angle = np.linspace(0.0, turn, 60)
    arc = centre[:, None] + radius * np.stack((np.cos(angle), np.sin(angle)))
    panel.plot([centre[0], centre[0] + 1.5 * radius], [centre[1], centre[1]], color=GREY, lw=0.7, ls="-.", zorder=2.0)
    panel.plot(arc[0], arc[1], color=GREY, lw=0.9, zorder=4.1)
    if turn > 0.05:
        arrow = {"arrowstyle": "->", "color": GREY, "lw": 0.9, "shrinkA": 0.0, "shrinkB": 0.0}
        panel.annotate("", xy=tuple(arc[:, -1]), xytext=tuple(arc[:, -4]), arrowprops=arrow, zorder=4.1)
    lines.append(arc)
    symbol = "φ" if view.ratio == 1.0 and not view.phase else "ψ"
    middle = arc[:, arc.shape[1] // 2]
    text = f"{symbol} = {localized(number(np.degrees(psi), 0.0, 5))}°".replace("-", "−")
    return [(text, GREY, (float(middle[0]), float(middle[1])))]


def _gravity(panel: Axes, scene: Scene, view: View, box: Array) -> None:
    """An arrow in a corner, along which weights act."""
    if scene.gravity is None:
        return
    pull = np.array(scene.gravity)
    size = float(np.hypot(*pull))
    if not size:
        return
    way = 6.0 * view.sketch.unit * pull / size
    start = np.array([box[0, 0] + 7.0 * view.sketch.unit, box[1, 1] - 7.0 * view.sketch.unit]) - 0.5 * way
    arrow = {"arrowstyle": "-|>", "color": BLACK, "lw": 1.2, "shrinkA": 0.0, "shrinkB": 0.0}
    panel.annotate("", xy=tuple(start + way), xytext=tuple(start), arrowprops=arrow)
    across = 2.0 * view.sketch.unit * np.array([-pull[1], pull[0]]) / size
    spot = start + 0.5 * way + across
    panel.text(float(spot[0]), float(spot[1]), "g", fontsize=9.0, ha="center", va="center")


# -- the bond graph, and shares over the cycle -------------------------------------------------------------------------


def bond_graph(machine: Machine, only: Collection[str] = ()) -> str:
    """The machine's bond graph with half arrows, causal strokes and numbers, as SVG; of some mechanisms alone, by name."""
    scene = machine.scene
    if only and len(only) < len(scene.mechanisms):

        def kept(item: Any) -> bool:
            return "." not in item.on or item.on.partition(".")[0] in only

        kinds = ("loads", "springs", "dampers", "inertias")
        some: dict[str, Any] = {kind: tuple(filter(kept, getattr(scene, kind))) for kind in kinds}
        mechanisms = tuple(mechanism for mechanism in scene.mechanisms if mechanism.name in only)
        machine = Machine(replace(scene, mechanisms=mechanisms, **some))
    graph, _left_out = graph_with_flywheel(machine)
    drawn_graph = svg(bondgraph.draw(graph, words=explanations()))
    return re.sub(r"(>[^<]*)\bflywheel\b(?=[^<]*</t)", rf"\g<1>{_('flywheel')}", drawn_graph)


def shares(machine: Machine, q: Array, total: Array, parts: Mapping[str, Array], label: str, sliding: bool) -> str:
    """Shares of every body or load in colour, and their sum in black, over the driver's coordinate; as SVG.

    At equal neighbours of q the curves jump.
    """
    made = figures.figure(_WIDTH, 3.2, "")
    panel = made.subplots()
    x = 1000.0 * q if sliding else np.degrees(q)
    figures.name_axes(panel, "", _("position x of the driver, mm") if sliding else _("crank angle φ, °"), label)
    some = {name: part + 0.0 * q for name, part in parts.items() if np.any(part)}
    for k, (name, part) in enumerate(largest_parts(some, _("others")).items()):
        _line(panel, x, part, color=BODIES[k % len(BODIES)], lw=1.3, label=name)
    _line(panel, x, total, color=BLACK, lw=1.9, label=label.partition(",")[0])
    panel.axhline(0.0, color=BLACK, lw=0.6, zorder=1.5)
    panel.set_xlim(float(x.min()), float(x.max()))
    if not sliding:
        whole = float(x.max() - x.min())
        panel.set_xticks(np.arange(0.0, whole + 1.0, 30.0 if whole < 400.0 else 60.0 if whole < 800 else 180.0))
    panel.legend(loc="upper center", bbox_to_anchor=(0.5, -0.2), ncols=3, fontsize=8.5, frameon=False)
    return svg(made)


def _line(panel: Axes, x: Array, y: Array, **style: Any) -> None:
    """A curve with gaps where it jumps, and a thin vertical line there."""
    jump = (np.diff(x) == 0.0) & (np.abs(np.diff(y)) > 1e-9 * max(float(np.abs(y).max()), 1e-300))
    cuts = np.flatnonzero(jump) + 1
    panel.plot(np.insert(x, cuts, np.nan), np.insert(y, cuts, np.nan), **style)
    for k in cuts:
        panel.plot([x[k], x[k]], [y[k - 1], y[k]], color=style["color"], lw=0.7, ls=":")
