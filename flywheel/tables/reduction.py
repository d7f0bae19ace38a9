"""The machine itself: reduced to its driver over a cycle or along a stroke, its bond graph, and the forces in its joints."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import chain, groupby
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import bondgraph
from bondgraph import BondGraph, GraphError
from flywheel.language import text as _
from flywheel.machine.machine import FLYWHEEL, FRICTION, SPEED, Machine, explanations, graph_with_flywheel
from flywheel.mechanisms.families import has_joints
from flywheel.mechanisms.linkage import linkage_of
from flywheel.mechanisms.linkages.reactions import Reactions
from flywheel.mechanisms.linkages.statics import DRIVE
from flywheel.motions.curves import POINT, MotionCurve
from flywheel.motions.joint_forces import DRIVING, CurveAxis, ForceCurve, JointForces, axis, figures_of, force_curves
from flywheel.motions.kinematics import motion
from flywheel.motions.kinetic_energy import stored_energy
from flywheel.motions.motion import DRIVER, TIME
from flywheel.numerics.faults import Fault, SceneError
from flywheel.numerics.units import columns, figure
from flywheel.regime import constant_speed
from flywheel.regime.joint_friction import machine_of
from flywheel.regime.state import (
    MachineState,
    Passage,
    along,
    at_speed,
    conditions,
    passage_errors,
    reduce,
    state_errors,
)
from flywheel.scene.scene import Scene, Stroke
from flywheel.tables.rows import csv, encoded

Array = NDArray[np.float64]

_SLIDING = {
    "phi": "x",
    "inertia": "reduced_mass",
    "slope": "reduced_mass_slope",
    "moment": "reduced_force",
    "inertia_parts": "mass_parts",
    "moment_parts": "force_parts",
    "driving": "driving_force",
}
"""Keys of JSON where the driver slides, by the names of the quantities where it turns."""
_TURNING_HEADS = ("phi [rad]", "I* [kg m^2]", "dI*/dphi [kg m^2]", "M* [N m]", "M_drive [N m]")
_SLIDING_HEADS = ("x [m]", "m* [kg]", "dm*/dx [kg/m]", "F* [N]", "F_drive [N]")


def reduced(
    scene: Scene,
    angles: Sequence[float] = (),
    points: int = 360,
    *,
    speed: float | None = None,
    as_json: bool = False,
) -> tuple[str, str]:
    """The machine reduced to its crank, as CSV or JSON, at given crank angles (rad), and a sentence on its conditions.

    That sentence is empty if all loads depend on position alone.

    Without angles, points are evenly spaced over the cycle, from 0 and without its end. On a stroke they are the
    driver's coordinates (rad, or m if it slides), spaced from one end to the other. `speed` (rad/s or m/s) is the speed
    for loads that depend on it, and on a stroke for the driving action, in place of the scene's; a stroke that has
    none has no driving action, velocities and accelerations either. Raises SceneError for a scene of areas, which has no
    machine, and if loads depend on an unknown speed.
    """
    machine = at_speed(scene, speed)
    stroke = machine.scene.stroke
    if stroke is not None:
        q = np.array(angles) if angles else np.linspace(stroke.start, stroke.end, points)
        passage = None if stroke.speed is None else along(machine, q)
        state = reduce(machine, q) if passage is None else passage.state
        write = (machine, stroke, state, passage)
        return encoded(_stroke_data(*write)) if as_json else csv(_stroke_columns(*write)), conditions(machine, stroke.speed)
    phi = np.array(angles, dtype=float) if angles else np.arange(points, dtype=float) * (scene.cycle / points)
    at, value = constant_speed.operating_point(machine, speed)
    state = reduce(machine, phi, balance=value, speed=at)
    at = at if machine.depends_on_speed else None
    if as_json:
        off = constant_speed.operating_point_errors(machine, at, fixed=speed is not None)
        unknown, bodies, energy = machine.scene.unknown, _bodies(machine, phi), stored_energy(machine, phi)
        off_speed, off_balance = off
        text = encoded(
            {
                "title": machine.scene.title,
                "reduction": "crank",
                "cycle": machine.scene.cycle,
                "balance": None if unknown is None else {"name": unknown, "value": value},
                "speed": at,
                **state._asdict(),
                "phi": phi,
                "positions": _by_axis(bodies, lambda curve: curve.position),
                "potential_energy": energy.potential,
                "errors": {
                    "potential_energy": {name: energy.errors[name] for name in energy.potential},
                    "positions": _by_axis(bodies, lambda curve: curve.errors[0]),
                    "balance": None if unknown is None else abs(value) * off_balance,
                    "speed": None if at is None else at * off_speed,
                    **state_errors(machine, state, balance=0.0 if unknown is None else value, speed=at),
                },
            }
        )
    else:
        text = csv(chain(_columns(machine, phi, state), _position_columns(machine, phi, _bodies(machine, phi))))
    return text, conditions(machine, at)


def _translates(machine: Machine, name: str) -> bool:
    element = machine.kinematics.graph.elements.get(name)
    return element is None or element.domain == "translation"  # parts of a point's acceleration are no elements


def _bodies(machine: Machine, phi: Array) -> dict[str, MotionCurve]:
    """Angles of shafts and bodies, ways of slides and ports, centres of mass, per unit of the driver, by full names."""
    record = motion(machine.scene, at=phi)
    ports = {own: name for name, own in record.other_names.items() if name in machine.places}
    mechanisms = [mechanism.name for mechanism in machine.scene.mechanisms]
    bodies = {}
    for own, curve in record.curves.items():
        whole = own in machine.scene.shafts or own == machine.scene.reduction_element or len(mechanisms) > 1
        if own.endswith(".com") or (curve.kind != POINT and not own.endswith(".angle")):
            bodies[ports.get(own, own if whole else f"{mechanisms[0]}.{own}")] = curve
    return bodies


def _by_axis(bodies: Mapping[str, MotionCurve], figure: Callable[[MotionCurve], Array]) -> dict[str, Array]:
    """A figure of every curve; of points one along x and one along y: `NAME.x` and `NAME.y`."""
    by_axis: dict[str, Array] = {}
    for name, curve in bodies.items():
        values = figure(curve)
        by_axis |= {f"{name}.x": values[0], f"{name}.y": values[1]} if curve.kind == POINT else {name: values}
    return by_axis


def _position_columns(machine: Machine, phi: Array, bodies: Mapping[str, MotionCurve]) -> Iterator[tuple[str, Array]]:
    """Positions, and the energies of springs and weights there."""
    units = _by_axis(bodies, lambda curve: curve.position)
    for name, values in units.items():
        yield f"position {name} [{bodies[name].unit if name in bodies else 'm'}]", values
    for name, energy in stored_energy(machine, phi).potential.items():
        yield f"energy {name} [J]", energy


# -- over a cycle ----------------------------------------------------------------------------------------------------


def _columns(machine: Machine, phi: Array, state: MachineState) -> Iterator[tuple[str, Array]]:
    """Every column with the name that heads it; units in brackets, g and dg/dphi per radian of the crank."""
    yield "phi [rad]", phi
    yield "phi [deg]", np.degrees(phi)
    yield from zip(_TURNING_HEADS[1:4], (state.inertia, state.slope, state.moment), strict=True)
    for title, gains in (("g", state.gains), ("dg/dphi", state.gain_slopes)):
        for name, values in gains.items():
            yield f"{title} {name} [{'m' if _translates(machine, name) else '1'}]", values


# -- along a stroke --------------------------------------------------------------------------------------------------


def _stroke_data(machine: Machine, stroke: Stroke, state: MachineState, passage: Passage | None) -> dict[str, Any]:
    """JSON that `flywheel reduce --json` prints for a stroke, SI; without a speed it has no velocities and accelerations."""
    names = _SLIDING if stroke.sliding else {"driving": "driving_torque"}
    figures = {**state._asdict(), "driving": passage and passage.driving}
    bodies, energy = _bodies(machine, state.phi), stored_energy(machine, state.phi)
    rates: dict[str, Any] = dict.fromkeys(("velocities", "accelerations"))
    if passage is None:
        errors = {**state_errors(machine, state), "driving": None, **rates}
    else:
        errors = passage_errors(machine, passage)
        (speeds, off_speeds), (accelerations, off_accelerations) = _centres(bodies, stroke)
        rates = {"velocities": {**speeds, **passage.velocities}, "accelerations": {**accelerations, **passage.accelerations}}
        errors["velocities"] = off_speeds | errors["velocities"]
        errors["accelerations"] = off_accelerations | errors["accelerations"]
    return {
        "title": machine.scene.title,
        "reduction": stroke.element,
        "cycle": None,
        "balance": None,
        "stroke": {
            "from": stroke.start,
            "to": stroke.end,
            "speed": stroke.speed,
            "acceleration": stroke.acceleration,
        },
        **{names.get(name, name): figure for name, figure in figures.items()},
        **rates,
        "positions": _by_axis(bodies, lambda curve: curve.position),
        "potential_energy": energy.potential,
        "errors": {
            "potential_energy": {name: energy.errors[name] for name in energy.potential},
            **{names.get(name, name): error for name, error in errors.items()},
            "positions": _by_axis(bodies, lambda curve: curve.errors[0]),
        },
    }


def _centres(bodies: Mapping[str, MotionCurve], stroke: Stroke) -> tuple[tuple[dict[str, Array], dict[str, Array]], ...]:
    """Velocities, then accelerations of centres of mass along x and y, each with its estimated errors."""
    v, a = stroke.speed or 0.0, stroke.acceleration
    centres = {name: curve for name, curve in bodies.items() if curve.kind == POINT}

    def both(
        figure: Callable[[MotionCurve], Array], error: Callable[[MotionCurve], Array]
    ) -> tuple[dict[str, Array], dict[str, Array]]:
        return _by_axis(centres, figure), _by_axis(centres, error)

    return (
        both(lambda c: c.velocity * v, lambda c: c.errors[1] * abs(v)),
        both(lambda c: c.velocity * a + c.acceleration * v**2, lambda c: c.errors[1] * abs(a) + c.errors[2] * v**2),
    )


def _stroke_columns(
    machine: Machine, stroke: Stroke, state: MachineState, passage: Passage | None
) -> Iterator[tuple[str, Array]]:
    """Every column of the CSV with the name that heads it, its unit in brackets; without a speed fewer of them."""
    sliding = stroke.sliding
    figures = [state.phi, state.inertia, state.slope, state.moment, *([] if passage is None else [passage.driving])]
    yield from zip(_SLIDING_HEADS if sliding else _TURNING_HEADS, figures, strict=False)
    if not sliding:
        yield "phi [deg]", np.degrees(state.phi)
    families = {
        "g": (state.gains, ("1", "1/m") if sliding else ("m", "1")),
        "dg/dx" if sliding else "dg/dphi": (state.gain_slopes, ("1/m", "1/m^2") if sliding else ("m", "1")),
    }
    if passage is not None:
        families |= {"v": (passage.velocities, ("m/s", "rad/s")), "a": (passage.accelerations, ("m/s^2", "rad/s^2"))}
    for title, (values, units) in families.items():
        for name, array in values.items():
            yield f"{title} {name} [{units[not _translates(machine, name)]}]", array
    bodies = _bodies(machine, state.phi)
    if passage is not None:
        (speeds, _), (accelerations, _) = _centres(bodies, stroke)
        yield from ((f"v {name} [m/s]", array) for name, array in speeds.items() if name not in passage.velocities)
        yield from (
            (f"a {name} [m/s^2]", array) for name, array in accelerations.items() if name not in passage.accelerations
        )
    yield from _position_columns(machine, state.phi, bodies)


# -- the bond graph ----------------------------------------------------------------------------------------------------


def machine_graph(loaded: Scene, *, simplified: bool = False) -> tuple[BondGraph, tuple[str, ...]]:
    """The graph of the machine in a scene with its flywheel; its omissions and the steps of simplification."""
    if loaded.areas is not None:
        raise SceneError([Fault("areas", "areas without a mechanism", "a machine, to draw its bond graph")])
    graph, left_out = graph_with_flywheel(machine_of(loaded))
    if not simplified:
        return graph, (*left_out, "") if left_out else ()
    simple = bondgraph.simplify(graph, keep=(loaded.reduction_element,))
    return simple.graph, (*left_out, *(str(action) for action in simple.log), "")


def graph_table(graph: BondGraph, form: str) -> str:
    """The table of bonds as text, markdown or latex."""
    with _explained():
        made = bondgraph.table(graph)
    return made.markdown() if form == "markdown" else made.latex() if form == "latex" else made.text()


def draw_graph(graph: BondGraph, path: Path, scene: Path, rows: Sequence[MapRow] = ()) -> None:
    """The picture of a graph, in the file format of the path; with rows of a map, each part in its own colour."""
    parts: dict[str, list[str]] = {}
    for row in rows:
        if row.group != "-":
            parts.setdefault(row.group or row.part, []).append(row.element)
    with _explained():
        bondgraph.draw(graph, path, title=scene.stem, parts=parts, words=explanations())


class MapRow(NamedTuple):
    """An element of a graph and its meaning.

    part: body, joint, shaft or other part of the scene; element: its name in the graph; meaning: in words. `group`: the
    group of the part in a picture, which has all joints of a mechanism in one; "-": none, the element has a separate row.
    """

    part: str
    element: str
    meaning: str
    group: str = ""


def graph_map(graph: BondGraph, scene: Scene) -> tuple[MapRow, ...]:
    """Returns the map from a machine to its bond graph, in the language in use: an element a row, in the order of the scene.

    A junction is the velocity of a shaft, a body or a point of it. A transformer from one body to another stands for the
    joints by which it moves the other one; it has a row for each. One inside a body is a lever arm of the body.
    """
    rows: list[MapRow] = []
    joints = {m.name: linkage_of(m).joints for m in scene.mechanisms if has_joints(m)}

    def owner(name: str) -> tuple[str, str, str]:
        """The mechanism of a velocity, its body or shaft, and the point of the body."""
        base = name.removesuffix(".rate").removesuffix(".sum").removesuffix(".gear").removesuffix(".twist")
        of = next((m.name for m in scene.mechanisms if base.startswith(f"{m.name}.")), "")
        body, _dot, point = base.removeprefix(f"{of}.").partition(".") if of else (base, "", "")
        return of, body, point

    for name, element in graph.elements.items():
        source, arrow, target = name.rpartition("->")
        mechanism, body, point = owner(target)
        part = f"{mechanism}.{body}" if mechanism else body if body == "slide" else _("shaft {name}", name=body)
        what, _on, place = element.part.partition(" on ")
        if element.part:
            special_names = {FLYWHEEL: _("flywheel"), FRICTION: _("friction in joints"), SPEED: _("imposed speed")}
            if element.part in special_names:
                rows.append(MapRow(special_names[element.part], name, special_names[element.part]))
            elif element.part.startswith(("weight of ", "twist of ")):
                what, _of, of = element.part.partition(" of ")
                part = of if what == "weight" else _("shaft {name}", name=of)
                twist = _("torsional stiffness") if element.kind == "C" else _("torsional damping")
                rows.append(MapRow(part, name, _("weight") if what == "weight" else twist))
            elif element.kind == "I" and not place:
                mass = name.rpartition(".")[2].startswith("m_")
                rows.append(MapRow(element.part, name, _("mass") if mass else _("moment of inertia")))
            else:
                path = name if what == "inertia" else what
                meanings = {
                    "load": _("load on {place}", place=place),
                    "spring": _("spring on {place}", place=place),
                    "damper": _("damper on {place}", place=place),
                    "inertia": _("inertia on {shaft}", shaft=place),
                }
                driving = _("drag") if path.endswith(".drag") else _("driving action")
                shaft = _("shaft {name}", name=path.split(".")[1]) if path.startswith("shafts.") else path
                rows.append(MapRow(shaft, name, meanings.get(what.partition("[")[0], driving)))
        elif element.kind == "TF" and arrow:
            other, carrier, _point = owner(source)
            if not mechanism:
                rows.append(MapRow(part, name, _("transmission from {place}", place=carrier)))
            elif carrier == body:
                rows.append(MapRow(part, name, _("lever arm")))
            else:
                every = joints.get(mechanism, ())
                between = [j.name for j in every if {j.first, j.second} == {carrier, body}] if other or point else []
                names = between or [j.name for j in every if body in (j.first, j.second)]
                if not names:
                    rows.append(MapRow(part, name, _("law of motion, driven by {place}", place=carrier)))
                for joint in names:
                    rest = ", ".join(one for one in names if one != joint)
                    words = _("moves {body} by {place}", body=body, place=carrier)
                    words += _(", together with {joints}", joints=rest) if rest else ""
                    group = _("joints of {mechanism}", mechanism=mechanism)
                    rows.append(MapRow(_("joint {name}", name=f"{mechanism}.{joint}"), name, words, group))
        elif element.kind == "0":
            rows.append(MapRow(part, name, _("twist") if name.endswith(".twist") else _("sum of velocities")))
        else:
            own, _dot, axis = point.rpartition(".")
            turning = _("angular velocity") if element.domain == "rotation" else _("velocity")
            words = turning
            if axis in ("x", "y") and own:
                centre = _("velocity of the centre of mass along {axis}", axis=axis)
                words = centre if own == "com" else _("velocity of {point} along {axis}", point=own, axis=axis)
            elif point:
                words = _("velocity of {point}", point=point)
            rows.append(MapRow(part, name, words))
    for m in scene.mechanisms:  # joints to the frame whose freedom the junction of the driver is
        for one in joints.get(m.name, ()):
            part = _("joint {name}", name=f"{m.name}.{one.name}")
            if m.shaft in graph.elements and all(row.part != part for row in rows):
                rows.append(MapRow(part, m.shaft, _("leaves {body} its motion", body=one.second), "-"))
    order = list(dict.fromkeys(row.part for row in rows))
    return tuple(sorted(rows, key=lambda row: order.index(row.part)))


def map_table(graph: BondGraph, rows: Sequence[MapRow], form: str) -> str:
    """The map as text or markdown: part, element, its bonds and its meaning; a part is named once."""
    cells = []
    for before, row in zip([None, *rows], rows, strict=False):
        bonds = ", ".join(str(bond.number) for bond in graph.at(row.element))
        part = "" if before is not None and before.part == row.part else row.part
        cells.append((part, graph.title(row.element), bonds, row.meaning))
    header = (_("part of the machine"), _("element"), _("bonds"), _("meaning"))
    if form == "markdown":
        return "\n".join(f"| {' | '.join(line)} |" for line in (header, ("---",) * 4, *cells))
    widths = [max(map(len, column)) for column in zip(header, *cells, strict=True)]
    lines = ("  ".join(c.ljust(w) for c, w in zip(line, widths, strict=True)).rstrip() for line in (header, *cells))
    return "\n".join(lines)


@contextmanager
def _explained() -> Iterator[None]:
    """Faults of the scene whose graph cannot be printed or drawn, such as a machine without inertia."""
    try:
        yield
    except GraphError as error:
        expected, advice = "a graph whose causality is complete", "give the machine inertia or a flywheel"
        raise SceneError([Fault("graph", line, expected, advice) for line in str(error).splitlines()]) from error


# -- forces in the joints -------------------------------------------------------------------------------------------------


_UNBALANCED = 1e-9  # relative residual of the equations above which it is printed


def forces_text(scene: Scene, forces: JointForces, dense: JointForces | None = None) -> str:
    """Tables as text: every joint's components over the crank angle in deg, or the slide's position in m.

    dense: the same at more positions, over which the largest forces are then taken.
    """
    heading = f"forces in the joints, by the position of the {scene.reduction_element}"
    blocks = [f"{scene.title or 'Machine'}: {heading}"]
    closer = cleared(dense).mechanisms if dense else {}
    for name, reactions in cleared(forces, dense).mechanisms.items():
        more = _by_position(scene, dense, closer[name]) if dense else None
        title = f"{name}: what the first body of each joint does to its second"
        table = _by_position(scene, forces, reactions).table(more).rstrip("\n")
        blocks += [f"{title}\n{'=' * len(title)}", table, *_notes(reactions)]
    return "\n\n".join([*blocks, *forces.messages]) + "\n"


def _by_position(scene: Scene, forces: JointForces, reactions: Reactions) -> Reactions:
    """The same figures over the machine's position, not the mechanism's own."""
    sliding = scene.reduction_element == "slide"
    at = forces.motion.phi if sliding else np.degrees(forces.motion.phi)
    return reactions._replace(poses=reactions.poses._replace(q=at), coordinate=("x", "m") if sliding else ("phi", "deg"))


def forces_messages(scene: Scene, forces: JointForces) -> tuple[str, ...]:
    """Messages on forces: on their motion, then on positions with a lifted cam or locking friction."""
    every = forces.mechanisms.values()
    return (*forces.messages, *(line for reactions in every for line in _by_position(scene, forces, reactions).findings()))


def curves_text(
    scene: Scene,
    forces: JointForces,
    dense: JointForces | None,
    over: str,
    of: Sequence[str] = (),
    components: Sequence[str] = (),
) -> str:
    """A table of curves for every joint over the driver or the time, and the least and greatest value of every curve.

    dense: the same at more positions, over which the latter are then taken. of, components: as in `force_curves`.
    """
    chosen = force_curves(cleared(forces, dense), of, components)
    closer = cleared(dense or forces)
    axes = [axis(forces, over)[:3]]
    if forces.motion.time is not None:
        axes.append(axis(forces, DRIVER if over == TIME else TIME)[:3])
    blocks = [f"{scene.title or 'Machine'}: forces in the joints, {forces.condition}"]
    for joint, mine in groupby(chosen, lambda curve: curve.name.removesuffix(f".{curve.component}")):
        names, units, values = zip(*axes, *((c.component, c.unit, c.values) for c in mine), strict=True)
        table = [["none" if np.isnan(v) else f"{float(v):.6g}" for v in row] for row in zip(*values, strict=True)]
        heads = [f"{name} ({unit})" for name, unit in zip(names, units, strict=True)]
        blocks.append("\n".join((joint, *columns(table, heads))))
    where = axis(closer, over)
    extents = [row for curve in force_curves(closer, of, components) if (row := _extent(curve, where))]
    title = "least and greatest" if dense else "least and greatest of these positions"
    blocks.append("\n".join((title, *columns(extents))))
    notes = [note for reactions in forces.mechanisms.values() for note in _notes(reactions)]
    return "\n\n".join([*blocks, *notes, *forces_messages(scene, forces)]) + "\n"


def _extent(curve: ForceCurve, where: CurveAxis) -> list[str]:
    """A curve's least and greatest value, and their positions."""
    if np.isnan(curve.values).all():
        return []
    name, unit, at, _ = where
    low, high = int(np.nanargmin(curve.values)), int(np.nanargmax(curve.values))
    cells = [
        f"{figure(float(curve.values[k]), most=7)} {curve.unit} at {name} = {float(at[k]):.6g} {unit}" for k in (low, high)
    ]
    return [curve.name, *cells]


def cleared(forces: JointForces, dense: JointForces | None = None) -> JointForces:
    """Forces for text, with 0 for rounding compared with the machine's largest force, also among those of `dense`."""
    scales = [reactions.scales() for reactions in (dense or forces).mechanisms.values()]
    largest = max(force for force, _ in scales), max(moment for _, moment in scales)
    return forces._replace(mechanisms={name: reactions.cleared(largest) for name, reactions in forces.mechanisms.items()})


def _notes(reactions: Reactions) -> Iterator[str]:
    friction = reactions.friction
    if friction.iterations and reactions.poses.linkage.rubs:
        worst = float(np.nanmax(friction.gap)) if np.isfinite(friction.gap).any() else np.nan
        share = float(np.nanmean(friction.moment))
        unit = "N" if reactions.poses.linkage.sliding else "N m"
        yield (
            f"friction: iterations {friction.iterations} at most, last relative change {worst:.1e}; "
            f"its share of the moment is {share:.6g} {unit} on the average"
        )
    residual = float(np.nanmax(reactions.residual, initial=0.0))
    if residual > _UNBALANCED:
        yield f"equilibrium is met to {residual:.1e} of the largest load"


def forces_csv(
    scene: Scene, forces: JointForces, over: str | None = None, of: Sequence[str] = (), components: Sequence[str] = ()
) -> str:
    """One row for every position: the machine's motion, then every component of every joint; SI.

    over: "driver" or "time", for a motion with its time. of, components: the selected ones, as in `force_curves`.
    """
    sliding, motion = scene.reduction_element == "slide", forces.motion
    heads = ("x [m]", "v [m/s]", "a [m/s^2]") if sliding else ("phi [rad]", "omega [rad/s]", "alpha [rad/s^2]")
    moved: list[tuple[str, Array]] = list(zip(heads, (motion.phi, motion.omega, motion.alpha), strict=True))
    if over is not None and motion.time is not None:
        moved.insert(0 if over == TIME else 3, ("t [s]", motion.time))

    def columns() -> Iterator[tuple[str, Array]]:
        yield from moved
        if of or components:
            for curve in force_curves(forces, of, components):
                part = DRIVE if curve.component == DRIVING else curve.component
                yield f"{curve.mechanism}.{curve.joint}.{part} [{curve.unit}]", curve.values
            return
        for name, reactions in forces.mechanisms.items():
            for part, unit, values in list(reactions.columns())[1:]:
                yield f"{name}.{part} [{unit}]", values

    return csv(columns())


def forces_json(
    scene: Scene, forces: JointForces, errors: Mapping[str, Any], of: Sequence[str] = (), components: Sequence[str] = ()
) -> str:
    """All figures as JSON, SI; null if redundant constraints leave one undetermined, or friction locks.

    errors: those of the forces, by mechanism (`joint_errors`). of, components: the selected ones, as in `force_curves`.
    """
    motion, off = forces.motion, forces.errors
    shape = motion.phi.shape
    of_motion: dict[str, Any] = {name: np.broadcast_to(getattr(off, name), shape) for name in ("phi", "omega", "alpha")}
    of_motion["t"] = None if motion.time is None else np.broadcast_to(off.time, shape)
    curves = force_curves(forces, of, components)
    selection = {(c.mechanism, c.joint, c.component) for c in curves} if of or components else None
    data: dict[str, Any] = {
        "title": scene.title,
        "reduction": scene.reduction_element,
        "condition": forces.condition,
        "t": motion.time,
        "phi": motion.phi,
        "omega": motion.omega,
        "alpha": motion.alpha,
        "mechanisms": {name: _only(name, _as_dict(reactions), selection) for name, reactions in forces.mechanisms.items()},
        "errors": {
            **of_motion,
            "mechanisms": {name: _only(name, reactions, selection) for name, reactions in errors.items()},
        },
        "messages": list(forces_messages(scene, forces)),
    }
    return encoded(data, indent=2)


def _only(mechanism: str, figures: dict[str, Any], selection: set[tuple[str, str, str]] | None) -> dict[str, Any]:
    """Figures of the selected joints and components: mechanism, joint, component; all if None."""
    if selection is None:
        return figures
    mine = {(joint, part) for name, joint, part in selection if name == mechanism}
    joints = {}
    for joint, parts in figures["joints"].items():
        kept = {part: value for part, value in parts.items() if (joint, part) in mine}
        if kept:
            joints[joint] = kept | ({"units": parts["units"]} if "units" in parts else {})
    driving = {name: value for name, value in figures["driving"].items() if (name, "driving") in mine}
    return figures | {"driving": driving, "joints": joints}


def _as_dict(reactions: Reactions) -> dict[str, Any]:
    figures = figures_of(reactions)
    friction = reactions.friction
    return {
        "driving": figures["driving"],
        "joints": {name: {**parts, "units": dict(reactions.units[name])} for name, parts in figures["joints"].items()},
        "largest": {e.joint: {"force": e.force, "at": e.at} for e in reactions.extremes()},
        "undetermined": reactions.undetermined,
        "friction": {"moment": friction.moment, "iterations": friction.iterations, "converged": friction.converged},
        "residual": reactions.residual,
    }
