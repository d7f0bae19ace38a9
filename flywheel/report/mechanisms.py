"""From the mechanism to I* and M*: every step of a report that leads to the reduced machine.

At one crank angle, the same throughout, all steps are calculated by hand; tables and figures show the whole cycle. The
numbers are those of the library, the formulas those of the books: each step shows that the two agree.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import partial

import numpy as np

from bondgraph.numerics import root
from flywheel.language import number as localized
from flywheel.language import text as _
from flywheel.machine.machine import Machine
from flywheel.numerics.cells import Array
from flywheel.regime.state import reduce
from flywheel.report.document import Cell, Figure, Formula, Note, Part, Section, Step, Table
from flywheel.report.formulas import Quantity, index
from flywheel.report.positions import unit_text
from flywheel.report.reduction import (
    StepsAt,
    grid,
    head_of,
    inertia,
    moment,
    rows_of,
    split,
    unit_head,
    where_text,
)
from flywheel.scene.scene import Mechanism, Scene, Transmission
from flywheel.sizing.results import Sizing


def sections(
    source: Sizing | Machine | Scene,
    phi: float | None = None,
    *,
    extremes: tuple[Part, ...] | None = None,
    moment_drawn: bool = True,
) -> tuple[Section, ...]:
    """All steps from the mechanism to I* and M*; none for a scene of areas, which has no machine.

    phi: the position (rad, or m if the driver slides) of all steps; if None, the one at which most loads act.
    extremes: the least, mean and greatest I* with its picture, if known; computed here if None.
    moment_drawn: true to draw M* load by load; the turning moment with its areas shows it too.
    """
    scene = source if isinstance(source, Scene) else source.scene
    if scene.areas is not None:
        return ()
    machine = source if isinstance(source, Machine) else source.machine if isinstance(source, Sizing) else None
    at = StepsAt(machine or scene, phi)
    parts = [_mechanism(at), _graph(at), *_kinematics(at), inertia(at, extremes), moment(at, moment_drawn)]
    return tuple(section for section in parts if section.parts)


# -- the mechanism and its data ----------------------------------------------------------------------------------------


def _mechanism(at: StepsAt) -> Section:
    """The mechanism drawn with its dimensions, its data, and the position of all steps."""
    parts: list[Part] = []
    if at.scene.mechanisms:
        parts += _pictures(at)
    for group in at.groups:
        parts += list(_scene_data(at, group))
    if len(at.scene.shafts) > 1:
        parts.append(_shafts(at.scene))
    if at.scene.parameters or at.scene.unknown not in (None, "drive"):
        parts.append(_parameters(at))
    if at.scene.gravity is not None:
        gx, gy = at.scene.gravity
        rows = ((_("along +x"), Quantity("g_x", gx, "m/s²")), (_("along +y"), Quantity("g_y", gy, "m/s²")))
        parts.append(Table(_("Gravity"), (_("direction"), _("acceleration")), rows))
    where = _("Crank angle for all steps, because most loads act there")
    if at.scene.stroke is not None:
        where = _("Position of the driver for all steps, because most loads act there")
    prime = _(
        "A prime is the derivative by {by}: the influence coefficient g of a place is its prime, g′ the next one.",
        by="x" if at.sliding else "φ",
    )
    parts.append(Step(where, result=Quantity(at.symbol, at.phi, "m" if at.sliding else "°"), note=prime))
    return Section(_("The mechanism"), tuple(parts))


def _shafts(scene: Scene) -> Table:
    """Every shaft except the crank: its mesh, the losses there, and its speed over the crank's."""
    meshes = {name: scene.transmissions.get(name, Transmission(ratio=i)) for name, i in scene.shafts.items()}
    meshes.pop(scene.reduction_element)
    columns: dict[str, list[Cell]] = {_("shaft"): list(meshes)}
    if any(mesh.on != scene.reduction_element or mesh.slip for mesh in meshes.values()):
        columns[_("meshes with")] = [mesh.on for mesh in meshes.values()]
        columns[_("ratio to it")] = [Quantity("", mesh.ratio) for mesh in meshes.values()]
    columns[_("speed ratio i")] = [Quantity(f"i_{index(name)}", scene.shafts[name]) for name in meshes]
    columns[_("efficiency")] = [Quantity("", mesh.efficiency) for mesh in meshes.values()]
    if any(mesh.slip for mesh in meshes.values()):
        columns[_("slip")] = [Quantity("", mesh.slip, "%") for mesh in meshes.values()]
    if any(mesh.drag for mesh in meshes.values()):
        columns[_("drag")] = [Quantity("", mesh.drag, "N m") for mesh in meshes.values()]
    rows = tuple(zip(*columns.values(), strict=True))
    if len(columns) == 3:
        return Table(_("Shafts, which mesh with the crank"), tuple(columns), rows)
    return Table(_("Shafts, with speed ratios i to the crank"), tuple(columns), rows)


def _scene_data(at: StepsAt, group: Sequence[Mechanism]) -> Iterator[Part]:
    """The data of a mechanism as the scene gives them, with the symbols that they have in the formulas."""
    mechanism = group[0]
    made = at.sheets[mechanism.name]
    rows: list[tuple[Cell, ...]] = []
    keys = {key: symbol for symbol, key in made.keys.items()}
    for key, value in mechanism.geometry.items():
        symbol = keys.get(key)
        if symbol is not None:
            rows.append((f"{mechanism.name}.{key}", Formula(symbol), made.values[symbol]._replace(value=value)))
    bodies = mechanism.bodies if mechanism.linkage is None else {}
    for name, quantities in bodies.items():
        for key, head, value, unit in (
            ("mass", "m", quantities.mass, "kg"),
            ("inertia", "J", quantities.inertia, "kg m²"),
            ("com", "s", quantities.com, "m"),
            ("com_angle", "alpha", quantities.com_angle, "°"),
        ):
            if value:
                symbol = f"{head}_{index(name)}"
                rows.append((f"{mechanism.name}.{name}.{key}", Formula(symbol), Quantity(symbol, value, unit)))
    for output in mechanism.outputs:
        if output.inertia:
            symbol = f"{'J' if output.rotating else 'm'}_{index(output.name)}"
            unit = "kg m²" if output.rotating else "kg"
            rows.append((f"{mechanism.name}.{output.name}", Formula(symbol), Quantity(symbol, output.inertia, unit)))
    if mechanism.linkage is not None:
        for link in mechanism.linkage.links:
            for head, value, unit in (("m", link.mass, "kg"), ("J", link.inertia, "kg m²")):
                if value:
                    symbol = f"{head}_{index(link.name)}"
                    key = "mass" if head == "m" else "inertia"
                    rows.append((f"{mechanism.name}.{link.name}.{key}", Formula(symbol), Quantity(symbol, value, unit)))
    if made.driver == "psi":
        rows.append((_("phase"), Formula("psi_0"), made.values["psi_0"]))
        if made.rate != 1.0:
            rows.append((_("turns for each of the crank's"), Formula("i"), made.values["i"]))
    if rows:
        yield Table(_("Given for {name}", name=mechanism.name), (_("in the scene"), _("symbol"), _("value")), tuple(rows))
    if len(group) > 1:
        others = ", ".join(f"{m.name} (ψ = φ + {localized(f'{np.degrees(m.phase):.6g}')}°)" for m in group[1:])
        yield Note(
            _("Equal mechanisms, with the same formulas at their own angles: {others}. The tables list them.", others=others)
        )


def _parameters(at: StepsAt) -> Table:
    values = dict(at.scene.parameters)
    rows = []
    for name, value in values.items():
        unit = at.scene.units.get(name)
        rows.append((name, Quantity(name, value, unit_text(unit))))
    if at.scene.unknown not in (None, "drive"):
        rows.append(
            (_("{name}, by the balance of the cycle", name=at.scene.unknown), Quantity(at.scene.unknown or "", at.balance))
        )
    return Table(_("Parameters, in SI units"), (_("name"), _("value")), tuple(rows))


def _pictures(at: StepsAt) -> Iterator[Part]:
    from flywheel.mechanisms.families import has_joints

    if not any(has_joints(mechanism) for mechanism in at.scene.mechanisms):
        names = ", ".join(mechanism.name for mechanism in at.scene.mechanisms)
        yield Note(_("{names}: given by its motion alone, without bodies to draw.", names=names))
        return
    from flywheel.pictures import dimensions

    for name, svg, listed in dimensions.drawn(at.scene, at.phi):
        caption = _("Drawn at {where}, to scale. {listed}", where=where_text(at, at.phi), listed=listed)
        yield Figure(svg, _("{name} with its dimensions", name=name), caption)


# -- the bond graph ----------------------------------------------------------------------------------------------------


def _graph(at: StepsAt) -> Section:
    from flywheel.pictures import dimensions

    svg = partial(dimensions.bond_graph, at.machine, tuple(at.sheets))
    how = _(
        "Each half arrow is a bond that carries power, with the stroke at the end that receives the effort. A 1 stands for "
        "one velocity, a TF or MTF for a ratio of velocities, constant or dependent on position. Every velocity follows "
        "from the crank along the arrows as a product of ratios, and every force acts on the crank through the same "
        "ratios. Therefore I* has g² and M* has g."
    )
    alone = [group[0].name for group in at.groups if len(group) > 1]
    caption = _(
        "Drawn with {names} alone; equal mechanisms are connected to their shafts in the same way.", names=", ".join(alone)
    )
    about = _("Half arrows, causal strokes and bond numbers; the table has the ratios.") + (f" {caption}" if alone else "")
    parts: list[Part] = [Note(how), Figure(svg, _("Bond graph of the machine"), about)]
    ratios = list(_ratios(at))
    if ratios:
        where = where_text(at, at.phi)
        head = (_("from"), _("to"), _("ratio T"))
        parts.append(Table(_("Ratios of its transformers at {where}", where=where), head, tuple(ratios)))
    return Section(_("The bond graph"), tuple(parts))


def _ratios(at: StepsAt) -> Iterator[tuple[Cell, ...]]:
    """The local ratios of the graph's transformers, of mechanisms that are explained."""
    for made in at.sheets.values():
        needed = set(at.machine.graph.elements)
        for velocity in made.family.velocities:
            if f"{made.mechanism.name}.{velocity.name}" not in needed:
                continue
            for source, ratio in velocity.terms:
                value = ratio if isinstance(ratio, float | int) else float(np.asarray(ratio.value(made.position)))
                name = made.mechanism.shaft if source == "crank" else f"{made.mechanism.name}.{source}"
                yield name, f"{made.mechanism.name}.{velocity.name}", Quantity("", float(value))


# -- positions and influence coefficients ------------------------------------------------------------------------------


def _kinematics(at: StepsAt) -> Iterator[Section]:
    for group in at.groups:
        made = at.sheets[group[0].name]
        parts: list[Part] = list(made.parts())
        table = list(_by_graph(at, group[0]))
        parts += table
        parts += list(_over_cycle(at, group))
        yield Section(_("Positions and influence coefficients of {name}", name=group[0].name), tuple(parts))


def _by_graph(at: StepsAt, mechanism: Mechanism) -> Iterator[Part]:
    """Coefficients by the bond graph's chain of ratios, if no formula is shown above."""
    rows: list[tuple[Cell, ...]] = []
    for junction in dict.fromkeys(element.junction for element in at.elements):
        if junction.partition(".")[0] == mechanism.name and at.tabulated(junction):
            (value,) = at.gain(junction)[1]
            slope = Quantity(f"g_prime_{index(junction)}", float(at.state.gain_slopes[junction][0]), at.unit_of(junction, 1))
            rows.append((junction, value, slope))
    if rows:
        head = (_("velocity of"), _("g"), _("g′"))
        yield Table(
            _("Influence coefficients at {where}, by the ratios of the graph", where=where_text(at, at.phi)),
            head,
            tuple(rows),
        )


def _over_cycle(at: StepsAt, group: Sequence[Mechanism]) -> Iterator[Part]:
    """Places and coefficients of the ports over the cycle, with the extreme positions."""
    mechanism = group[0]
    family = at.machine.family(mechanism)
    ports = [name for name in family.ports if f"{mechanism.name}.{name}" in at.machine.places]
    phi = _with_extremes(at, [f"{mechanism.name}.{family.ports[name].velocity}" for name in ports])
    state = reduce(at.machine, phi, balance=at.balance, speed=at.speed)
    rate = at.scene.shafts[mechanism.shaft] if mechanism.stroke is None else 1.0
    psi = rate * phi + (mechanism.phase if mechanism.stroke is None else 0.0)
    with np.errstate(all="ignore"):
        position = family.position(psi, np)
    for some in split(ports, 2):
        head, columns = [head_of(at)], []
        for name in some:
            junction = f"{mechanism.name}.{family.ports[name].velocity}"
            line = at.translates(junction)
            place = np.asarray(family.ports[name].position(position), dtype=float) + 0.0 * phi
            head += [
                f"{name}, {'mm' if line else '°'}",
                unit_head("g", at.unit_of(junction)),
                unit_head("g′", at.unit_of(junction, 1)),
            ]
            columns += [1000.0 * place if line else np.degrees(place), state.gains[junction], state.gain_slopes[junction]]
        rows = rows_of(at, phi, columns)
        caption = _("Over the cycle, with the extreme positions") if at.scene.stroke is None else _("Along the stroke")
        yield Table(f"{mechanism.name}. {caption}", tuple(head), rows)


def _with_extremes(at: StepsAt, junctions: Iterable[str]) -> Array:
    """The grid with the positions at which a velocity changes its sign."""
    phi = grid(at)
    fine = (
        np.linspace(phi[0], phi[0] + at.scene.cycle, 1441)[:-1]
        if at.scene.stroke is None
        else np.linspace(phi[0], phi[-1], 721)
    )
    state = reduce(at.machine, fine, balance=at.balance, speed=at.speed)
    extremes_so_far: list[float] = []
    for junction in junctions:
        signs = np.sign(state.gains[junction])

        def gain(q: float, junction: str = junction) -> float:
            return float(reduce(at.machine, [q], balance=at.balance, speed=at.speed).gains[junction][0])

        extremes_so_far += [
            root(gain, float(fine[k]), float(fine[k + 1])) for k in np.flatnonzero(signs[1:] * signs[:-1] < 0)
        ]
    every = np.sort(np.concatenate((phi, extremes_so_far)))
    return every[np.diff(every, prepend=-np.inf) > 1e-7]
