"""The machine itself: reduced to its driver over a cycle or along a stroke, as CSV or JSON; and its bond graph."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import bondgraph
from bondgraph import BondGraph, GraphError, I
from flywheel.machine.machine import FLYWHEEL, Machine
from flywheel.numerics.faults import Fault, SceneError
from flywheel.reading.scenes import load
from flywheel.regime import constant_speed
from flywheel.regime.joint_friction import machine_of
from flywheel.regime.state import MachineState, Passage, along, passage_errors, reduce, state_errors
from flywheel.report.rows import csv, encoded
from flywheel.scene.scene import Scene, Stroke

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


def reduced(scene: Scene, angles: Sequence[float] = (), points: int = 360, *, as_json: bool = False) -> tuple[str, str]:
    """The machine reduced to its crank, as CSV or JSON, at given crank angles (rad); and what it holds for, in a sentence.

    That sentence is empty where everything depends on position alone.

    Without angles, so many points are spread evenly over the cycle, from 0 and without its end. On a stroke they are the
    driver's coordinates (rad, or m where it slides), spread from one end of it to the other. Raises SceneError for a scene
    of areas, which has no machine.
    """
    if scene.areas is not None:
        advice = "give mechanism, inertia or load instead"
        raise SceneError([Fault("areas", "a diagram of areas", "a machine to reduce", advice)])
    machine, stroke = machine_of(scene), scene.stroke
    if stroke is not None:
        passage = along(machine, np.array(angles) if angles else np.linspace(stroke.start, stroke.end, points))
        text = encoded(_stroke_data(machine, stroke, passage)) if as_json else csv(_stroke_columns(machine, stroke, passage))
        return text, _conditions(machine, stroke.speed)
    phi = np.array(angles, dtype=float) if angles else np.arange(points, dtype=float) * (scene.cycle / points)
    speed, value = constant_speed.operating_point(machine)
    state = reduce(machine, phi, balance=value, speed=speed)
    speed = speed if machine.depends_on_speed else None
    text = encoded(_data(machine, phi, state, value, speed)) if as_json else csv(_columns(machine, phi, state))
    return text, _conditions(machine, speed)


def _conditions(machine: Machine, speed: float | None) -> str:
    """What M* holds for: the speed and the time at which loads were taken, and the losses that it leaves out."""
    sliding = machine.scene.reduction_element == "slide"
    found = []
    if machine.depends_on_speed and speed is not None:
        found.append(f"what depends on speed is taken at a constant {speed:.9g} {'m/s' if sliding else 'rad/s'}")
    if machine.depends_on_time:
        found.append("what depends on time is taken at t = 0")
    if any(efficiency < 1.0 for efficiency in machine.scene.efficiencies.values()):
        found.append("losses in meshes are left out")
    return f"of {'F*' if sliding else 'M*'}: {'; '.join(found)}" if found else ""


def _translates(machine: Machine, name: str) -> bool:
    return machine.kinematics.graph.elements[name].domain == "translation"


# -- over a cycle ----------------------------------------------------------------------------------------------------


def _data(machine: Machine, phi: Array, state: MachineState, balance: float, speed: float | None) -> dict[str, Any]:
    """What `flywheel reduce --json` prints, SI throughout; `balance` is the value of the scene's unknown."""
    unknown = machine.scene.unknown
    off_speed, off_balance = constant_speed.operating_point_errors(machine, speed)
    return {
        "title": machine.scene.title,
        "reduction": "crank",
        "cycle": machine.scene.cycle,
        "balance": None if unknown is None else {"name": unknown, "value": balance},
        "speed": speed,
        **state._asdict(),
        "phi": phi,
        "errors": {
            "balance": None if unknown is None else abs(balance) * off_balance,
            "speed": None if speed is None else speed * off_speed,
            **state_errors(machine, state, balance=0.0 if unknown is None else balance, speed=speed),
        },
    }


def _columns(machine: Machine, phi: Array, state: MachineState) -> Iterator[tuple[str, Array]]:
    """Every column with the name that heads it; units in brackets, g and dg/dphi per radian of the crank."""
    yield "phi [rad]", phi
    yield "phi [deg]", np.degrees(phi)
    yield from zip(_TURNING_HEADS[1:4], (state.inertia, state.slope, state.moment), strict=True)
    for title, gains in (("g", state.gains), ("dg/dphi", state.gain_slopes)):
        for name, values in gains.items():
            yield f"{title} {name} [{'m' if _translates(machine, name) else '1'}]", values


# -- along a stroke --------------------------------------------------------------------------------------------------


def _stroke_data(machine: Machine, stroke: Stroke, passage: Passage) -> dict[str, Any]:
    """What `flywheel reduce --json` prints for a scene with a stroke, SI throughout."""
    names = _SLIDING if stroke.sliding else {"driving": "driving_torque"}
    figures = {**passage.state._asdict(), "driving": passage.driving}
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
        "velocities": passage.velocities,
        "accelerations": passage.accelerations,
        "errors": {names.get(name, name): error for name, error in passage_errors(machine, passage).items()},
    }


def _stroke_columns(machine: Machine, stroke: Stroke, passage: Passage) -> Iterator[tuple[str, Array]]:
    """Every column of the CSV with the name that heads it, its unit in brackets."""
    state, sliding = passage.state, stroke.sliding
    figures = (state.phi, state.inertia, state.slope, state.moment, passage.driving)
    yield from zip(_SLIDING_HEADS if sliding else _TURNING_HEADS, figures, strict=True)
    if not sliding:
        yield "phi [deg]", np.degrees(state.phi)
    families = {
        "g": (state.gains, ("1", "1/m") if sliding else ("m", "1")),
        "dg/dx" if sliding else "dg/dphi": (state.gain_slopes, ("1/m", "1/m^2") if sliding else ("m", "1")),
        "v": (passage.velocities, ("m/s", "rad/s")),
        "a": (passage.accelerations, ("m/s^2", "rad/s^2")),
    }
    for title, (values, units) in families.items():
        for name, array in values.items():
            yield f"{title} {name} [{units[not _translates(machine, name)]}]", array


# -- the bond graph ----------------------------------------------------------------------------------------------------


def machine_graph(scene: Path, *, simplified: bool = False) -> tuple[BondGraph, tuple[str, ...]]:
    """The graph of the machine in a scene's file with its flywheel; what it leaves out and what simplifying did."""
    loaded = load(scene)
    if loaded.areas is not None:
        raise SceneError([Fault("areas", "areas without a mechanism", "a machine, to draw its bond graph")])
    machine = machine_of(loaded)
    graph = machine.graph
    if loaded.stroke is None:  # a flywheel that sizing finds is a parameter without a value
        graph = machine.with_values(0.0, 1.0 if loaded.inertia is None else loaded.inertia)
        if loaded.inertia is None:
            name = next(element.name for element in graph.elements.values() if element.part == FLYWHEEL)
            wheel = I(name, lambda J_flywheel: J_flywheel, part=FLYWHEEL)
            graph = replace(graph, elements={**graph.elements, name: wheel}, parameters={"J_flywheel": None})
    left_out = tuple(
        f"shafts.{name}: losses in its mesh (efficiency {efficiency:g}) are no element of the graph"
        for name, efficiency in loaded.efficiencies.items()
        if efficiency < 1.0
    )
    if not simplified:
        return graph, (*left_out, "") if left_out else ()
    found = bondgraph.simplify(graph, keep=(loaded.reduction_element,))
    return found.graph, (*left_out, *(str(action) for action in found.log), "")


def graph_table(graph: BondGraph, form: str) -> str:
    """The table of bonds as text, markdown or latex."""
    with _explained():
        made = bondgraph.table(graph)
    return made.markdown() if form == "markdown" else made.latex() if form == "latex" else made.text()


def draw_graph(graph: BondGraph, path: Path, scene: Path) -> None:
    """The picture of a graph, in the file format of the path."""
    with _explained():
        bondgraph.draw(graph, path, title=scene.stem)


@contextmanager
def _explained() -> Iterator[None]:
    """A graph that cannot be told or drawn, as faults of the scene: of a machine without any inertia, say."""
    try:
        yield
    except GraphError as error:
        expected, advice = "a graph whose bonds decide each other", "give the machine inertia or a flywheel"
        raise SceneError([Fault("graph", line, expected, advice) for line in str(error).splitlines()]) from error
