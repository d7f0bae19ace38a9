"""What the drawings of the page are made from: plain lists of finite numbers in SI, each panel's own, on one axis.

Positions of the driver ascend over the cycle or the stroke; where something jumps one stands twice, for the value before
and the one behind. While a hand moves there are fewer of them, with seven digits; at rest more, with all digits.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import floor, log10
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flywheel.language import text as _
from flywheel.machine.machine import Machine
from flywheel.mechanisms.families import has_joints
from flywheel.mechanisms.linkages.positions import Track
from flywheel.motions import driver as courses
from flywheel.motions.driver import Driver
from flywheel.motions.joint_forces import JointForces, joint_forces, regime_forces, regime_motion
from flywheel.motions.kinematics import POINT, Moving
from flywheel.numerics.faults import Fault, SceneError
from flywheel.numerics.units import figure
from flywheel.pictures import samples, sketch
from flywheel.pictures.samples import Samples
from flywheel.regime import turning_moment
from flywheel.scene.linkage import FRAME, PIN, SLIDE
from flywheel.scene.scene import Scene
from flywheel.sizing.results import Sizing
from flywheel.sizing.sizing import size
from flywheel.tables import answers
from flywheel.tables.flywheels import candidates
from flywheel.tables.power_flow import places, stream_name

Array = NDArray[np.float64]

PANELS = ("mechanism", "moment", "inertia", "wittenbauer", "speed", "power_flow", "reactions", "motion")
QUANTITIES = ("position", "velocity", "acceleration", "reaction")
_MOVING, _RESTING = 181, 361  # positions, evenly
_MOST_JUMPS = 40  # breakpoints of a machine that all get both sides; of more, those at which M* jumps
_BESIDE = 1e-9  # of the cycle: how near to a jump its two sides are looked at
_JUMP = 1e-6  # of the greatest M*: what a jump is at least
_NARROW = 0.15  # of the distance of positions: half the width of a cell whose own ones are looked at
_DIGITS = 7
_NOTHING = 1e-12  # of the largest force: less is rounding
_CONSTANT = 1e-9  # of I*: less is no variation


class Axis(NamedTuple):
    """Positions of the driver (rad or m): as they are shown, and as they are looked at, beside a jump."""

    shown: Array
    taken: Array


class Part(NamedTuple):
    """What all panels are made from; `samples` are those of the cycle that the areas are of, where there is one."""

    scene: Scene
    machine: Machine | None
    sizing: Sizing | None
    axis: Axis
    view: Mapping[str, Any]
    rest: bool
    samples: Samples | None = None


def answer(
    subject: Scene | Machine | Sizing, view: Mapping[str, Any] | None = None, *, rest: bool = True, units: str = "si"
) -> dict[str, Any]:
    """The data of all drawings of a scene, or of the panels that the view names.

    Args:
        subject: a scene, its machine, or its sizing where that is known already.
        view: `panels`, the ids of those wanted (all of `PANELS` if missing); of the motion `kind`, one of `QUANTITIES`, and
            `of`, what it is of; `mechanism`, whose reactions are wanted; names that there are not give the first there is.
        rest: False while a hand moves: nothing is stepped in time.
        units: of the page of answers, "si" or "us".

    Raises:
        SceneError: for a scene of which nothing can be drawn.

    Returns a mapping for JSON. `faults` are those of a scene that cannot be sized but moved; `why` tells, by panel, why it
    is not there; `later` are the panels that were not asked for.

    """
    view = {} if view is None else view
    sizing, machine, faults = _found(subject, rest)
    scene = sizing.scene if sizing is not None else machine.scene if machine is not None else _scene_of(subject)
    wanted = [panel for panel in PANELS if panel in view.get("panels", PANELS)]
    digits = None if rest else _DIGITS
    found: dict[str, Any] = {}
    why: dict[str, str] = {}
    with np.errstate(all="ignore"):
        axis = _axis(scene, machine, sizing, rest)
        curves = _samples(machine, sizing, axis) if {"moment", "wittenbauer"} & set(wanted) else None
        part = Part(scene, machine, sizing, axis, view, rest, curves)
        reacts = "reactions" in wanted or view.get("kind") == QUANTITIES[3]
        forces = _forces(part) if reacts else ""
        for panel in wanted:
            try:
                made = _MAKERS[panel](part, forces)
            except SceneError as error:
                made = str(error)
            if isinstance(made, str):
                why[panel] = made
            else:
                found[panel] = made
    return {
        "title": scene.title or "",
        "cycle": scene.cycle,
        "driver": _driver(scene),
        "phi": _plain(axis.shown, digits) if scene.areas is None else [],
        "numbers": _numbers(sizing, units, rest),
        "figures": list(found),
        "views": _views(found.get("motion")),
        "why": why,
        "later": [panel for panel in PANELS if panel not in wanted],
        "faults": faults,
        **{panel: _finite(made, digits) for panel, made in found.items()},
    }


def _found(subject: Scene | Machine | Sizing, rest: bool) -> tuple[Sizing | None, Machine | None, list[Fault]]:
    """The sizing and the machine of a scene; the faults of one that cannot be sized, but has a mechanism that moves."""
    if isinstance(subject, Sizing):
        return subject, subject.machine, []
    scene = _scene_of(subject)
    if scene.areas is not None:
        return size(scene, simulate=rest), None, []
    machine = subject if isinstance(subject, Machine) else Machine(scene)
    if scene.stroke is not None or not (scene.has_flywheel and scene.has_speed):
        return None, machine, []
    try:
        sizing = size(machine, simulate=rest)
    except SceneError as error:
        return None, machine, list(error.faults)
    return sizing, sizing.machine or machine, []


def _scene_of(subject: Scene | Machine | Sizing) -> Scene:
    return subject if isinstance(subject, Scene) else subject.scene


def _numbers(sizing: Sizing | None, units: str, rest: bool) -> list[Any]:
    """The page of answers, as rows; while a hand moves without what a second route says, as none has been taken yet."""
    if sizing is None:
        return []
    blocks = answers.answers(sizing, units, motions=rest)
    return [(block if rest or block.name != "run" else block._replace(sentences=())).as_dict() for block in blocks]


def _views(motion: dict[str, Any] | None) -> dict[str, Any] | None:
    """What of the motion may be chosen, and what is."""
    if motion is None:
        return None
    of = [{"id": name, "label": name} for name in motion.pop("choices")]
    kinds = QUANTITIES if motion.pop("reacts") else QUANTITIES[:3]
    return {"kinds": list(kinds), "of": of, "chosen": {"kind": motion["quantity"], "of": motion["of"]}}


# -- plain numbers -----------------------------------------------------------------------------------------------------


def _plain(values: ArrayLike, digits: int | None) -> list[Any]:
    """Numbers for JSON; what is not finite is null. `digits` are those of the largest; all of them if None."""
    array = np.asarray(values, dtype=float)
    bad = ~np.isfinite(array)
    if digits is not None and array.size:
        largest = float(np.abs(array[~bad]).max(initial=0.0))
        if largest > 0.0:
            array = array.round(min(max(digits - 1 - floor(log10(largest)), -300), 300))
    if not bad.any():
        found: list[Any] = array.tolist()
        return found
    return [None if missing else value for value, missing in zip(array.tolist(), bad.tolist(), strict=True)]


def _finite(value: Any, digits: int | None) -> Any:
    """The same with every array as a list, and every number finite or null."""
    if isinstance(value, np.ndarray):
        return _plain(value, digits) if value.ndim == 1 else [_plain(row, digits) for row in value]
    if isinstance(value, Mapping):
        return {key: _finite(inner, digits) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(inner, digits) for inner in value]
    if isinstance(value, float):
        return float(value) if np.isfinite(value) else None
    return value


# -- the axis ----------------------------------------------------------------------------------------------------------


def _driver(scene: Scene) -> dict[str, Any]:
    """What the driver does: turns through a cycle, or goes from one end of a stroke to the other, in rad or m."""
    sliding = scene.reduction_element == "slide"
    return {
        "kind": "length" if sliding else "angle",
        "sliding": sliding,
        "stroke": scene.stroke is not None,
        "from": scene.origin,
        "to": scene.origin + scene.cycle,
        "backwards": scene.stroke is not None and scene.stroke.speed is not None and scene.stroke.speed < 0.0,
    }


def _axis(scene: Scene, machine: Machine | None, sizing: Sizing | None, rest: bool) -> Axis:
    """Positions over the cycle or the stroke: even ones, narrow features, both sides of jumps, and the places of figures."""
    cycle, count = scene.cycle, _RESTING if rest else _MOVING
    even = np.linspace(0.0, cycle, count)
    if machine is None or scene.areas is not None:
        return Axis(even, even)
    beside = _BESIDE * cycle
    edges = np.asarray(machine.breakpoints)
    jumps = edges if edges.size <= _MOST_JUMPS else np.array([])
    more = [np.array([]), edges if edges.size <= count else np.array([])]
    if sizing is not None and sizing.cycle is not None:
        for each in filter(None, (sizing.cycle, sizing.constant)):
            jumps = np.concatenate((jumps, _moment_jumps(each)))
            more.append(_narrow(each, cycle / count))
        places = [sizing.angle_speed_max, sizing.angle_speed_min, *(area.end for area in sizing.areas[:count])]
        more.append(np.array([place for place in places if place is not None]))
    jumps = np.unique(jumps[(jumps > beside) & (jumps < cycle - beside)])
    single = np.unique(np.concatenate((even[1:-1], *more)))
    single = single[(single > beside) & (single < cycle - beside)]
    if jumps.size:
        single = single[np.abs(single[:, None] - jumps).min(axis=1) > 2 * beside]
    ends, taken_ends = np.array([0.0, cycle]), np.array([0.0, cycle * (1.0 - _BESIDE)])
    if scene.stroke is not None:
        taken_ends = ends
    shown = np.concatenate((ends, single, jumps, jumps))
    taken = np.concatenate((taken_ends, single, jumps - beside, jumps + beside))
    order = np.argsort(taken, kind="stable")
    return Axis(scene.origin + shown[order], scene.origin + taken[order])


def _moment_jumps(cycle: turning_moment.Cycle) -> Array:
    """Where M* jumps within a cycle (rad)."""
    series = cycle.series[0]
    left, right = series.sum(axis=-1), (series * (-1.0) ** np.arange(series.shape[-1])).sum(axis=-1)
    apart = np.abs(right[1:] - left[:-1])
    return np.asarray(cycle.mesh.edges[1:-1][apart > _JUMP * np.abs(series).sum(axis=-1).max()])


def _narrow(cycle: turning_moment.Cycle, width: float) -> Array:
    """Angles (rad) within cells far narrower than a width: of those in one such width the greatest and least M*."""
    mesh = cycle.mesh
    fine = mesh.half[:, 0] < _NARROW * width
    phi = mesh.phi[fine].ravel()
    if not phi.size:
        return phi
    cell, t = cycle.where(phi)
    moment = (cycle.series[0, cell] * np.cos(np.arccos(t)[:, None] * np.arange(cycle.series.shape[-1]))).sum(axis=-1)
    place = np.floor(phi / width)
    orders = np.lexsort((moment, place)), np.lexsort((-moment, place))
    kept = [phi[order[np.append(True, np.diff(place[order]) > 0.0)]] for order in orders]
    return np.unique(np.concatenate(kept))


# -- mechanism ---------------------------------------------------------------------------------------------------------

_FEW = {"pin": 4, "dot": 4, "plate": 2, "bar": 2, "rail": 2, "wheel": 2}  # of the points of an outline, one in so many


def _mechanism(part: Part, forces: JointForces | str) -> dict[str, Any] | str:
    """Bodies as they move, figures on them, points whose paths are drawn; discs where there are no bodies."""
    scene = part.scene
    if scene.areas is not None:
        return _("A diagram of areas tells nothing of the mechanism.")
    drawn = [mechanism for mechanism in scene.mechanisms if has_joints(mechanism)]
    others = [mechanism.name for mechanism in scene.mechanisms if mechanism not in drawn]
    views = [_one_mechanism(view, part.axis.taken) for view in _views_of(scene)] if drawn else [_discs(scene, part.axis)]
    return {"views": views, "without": others}


_kept: list[tuple[Any, tuple[sketch.View, ...]]] = []
"""The mechanisms that were drawn last: a load or a speed that changes leaves their figures as they are."""


def _views_of(scene: Scene) -> tuple[sketch.View, ...]:
    """The mechanisms of a scene with their figures, those of the last scene where they are the same."""
    shape = scene.mechanisms, scene.stroke, dict(scene.shafts)
    if _kept and _kept[0][0] == shape:
        return _kept[0][1]
    found = sketch.views(scene)
    _kept[:] = [(shape, found)]
    return found


def _one_mechanism(view: sketch.View, q: Array) -> dict[str, Any]:
    poses, made, linkage = view.poses(q), view.sketch, view.solution.linkage
    known = sketch.places(linkage)
    shapes = [
        {
            "kind": shape.kind,
            "body": shape.body,
            "at": _place(shape.at),
            "turns": shape.turns_with,
            "outline": shape.outline[:, :: _FEW.get(shape.kind, 1)],
        }
        for shape in made.shapes
    ]
    bodies = {}
    for k, name in enumerate(linkage.names):
        if name != FRAME:
            x, y, turn = poses.value[k]
            bodies[name] = {"x": x, "y": y, "turn": np.unwrap(turn)}
    return {
        "name": view.mechanism.name,
        "bodies": bodies,
        "shapes": shapes,
        "traces": [{"name": trace.name, "at": _place(known[trace.name])} for trace in made.traces],
        "labels": [{"text": label.text, "body": label.body, "at": _place(label.at)} for label in made.labels],
        "centres": [{"body": link.name, "at": _place((link.name, link.com))} for link in linkage.links if link.mass],
        "unit": made.unit,
        "size": made.size,
        "driver": _driven_body(linkage.joint(linkage.driver)),
    }


def _driven_body(joint: Any) -> str:
    return str(joint.first if joint.second == FRAME else joint.second)


def _place(place: tuple[str, Any]) -> list[Any]:
    body, (x, y, *_rest) = place
    return [body, float(x), float(y)]


def _discs(scene: Scene, axis: Axis) -> dict[str, Any]:
    """A rotor: a disc with a mark for each shaft, beside one another."""
    bodies, shapes, labels = {}, [], []
    disc = 2.0 * sketch.circle(1.0)[:, ::2]
    for k, (name, ratio) in enumerate(scene.shafts.items()):
        still = np.full(axis.taken.size, 5.0 * k)
        bodies[name] = {"x": still, "y": 0.0 * still, "turn": ratio * axis.taken}
        for kind, outline in (("plate", disc), ("mark", np.array([[0.0, 2.0], [0.0, 0.0]])), ("pin", 0.1 * disc)):
            shapes.append({"kind": kind, "body": name, "at": [name, 0.0, 0.0], "turns": name, "outline": outline})
        labels.append({"text": name, "body": name, "at": [name, 0.0, 0.0]})
    found = {"name": "", "bodies": bodies, "shapes": shapes, "traces": [], "labels": labels, "centres": []}
    return found | {"unit": 0.2, "size": 5.0 * len(bodies), "driver": next(iter(bodies)), "schematic": True}


# -- turning moment, reduced inertia, Wittenbauer, speed ---------------------------------------------------------------


def _no_cycle(part: Part) -> str:
    """Why there is no steady cycle."""
    scene = part.scene
    if scene.stroke is not None:
        return _("The driver goes one way, from one end of its stroke to the other: there is no cycle, and no flywheel.")
    if not scene.has_flywheel:
        return _("The scene has no flywheel: add the table flywheel, with irregularity or inertia.")
    if not scene.has_speed:
        return _("The scene has no speed: add regime.speed.")
    return _("The machine does not run as the scene says: see the faults.")


def _samples(machine: Machine | None, sizing: Sizing | None, axis: Axis) -> Samples | None:
    """The cycle that the areas are of, on the axis: that at a constant speed, where torques depend on speed."""
    if sizing is None or sizing.cycle is None or machine is None:
        return None
    if sizing.cyclic is None or sizing.constant is None:
        return samples.samples_at(machine, sizing.cycle, axis.taken)
    return samples.samples_at(machine, sizing.constant, axis.taken, sizing.cyclic.constant_speed)


def _moment(part: Part, forces: JointForces | str) -> dict[str, Any] | str:
    """M* with what drives and what resists, its areas, and W."""
    sizing = part.sizing
    if sizing is None:
        return _no_cycle(part)
    areas = [
        {"from": area.start, "to": area.end, "work": area.work, "accumulated": area.accumulated} for area in sizing.areas
    ]
    sums = [0.0, *(area.accumulated for area in sizing.areas)]
    ends = [0.0, *(area.end for area in sizing.areas)]
    found: dict[str, Any] = {"areas": areas, "fluctuation": sizing.energy_fluctuation}
    for name, value in (("greatest", sizing.accumulated_max), ("least", sizing.accumulated_min)):
        k = int(np.abs(np.array(sums) - value).argmin())
        found[name] = {"value": value, "at": ends[k], "crossing": k}
    record = part.samples
    if record is None:
        return found | {"diagram": True}
    if not record.moment.any():
        return _("No torque or force acts on the machine: M* is zero over the whole cycle.")
    found |= {"net": record.moment, "driving": record.driving, "resisting": record.moment - record.driving}
    found |= {"work": record.work, "constant_speed": sizing.constant_speed, "balance": _balance(sizing)}
    if sizing.constant is not None and sizing.cycle is not None and part.machine is not None:
        found["along"] = samples.samples_at(part.machine, sizing.cycle, part.axis.taken).moment
    return found


def _balance(sizing: Sizing) -> dict[str, Any] | None:
    """The balance and its value where the areas are taken."""
    cycle = sizing.constant or sizing.cycle
    if sizing.balance is None or cycle is None or cycle.balance is None:
        return None
    return {"name": sizing.balance.name, "value": cycle.balance, "unit": sizing.balance_unit or ""}


def _inertia(part: Part, forces: JointForces | str) -> dict[str, Any] | str:
    """I* body by body."""
    if part.scene.areas is not None:
        return _("A diagram of areas gives no reduced inertia: all of it counts as flywheel.")
    if part.machine is None:
        return _no_cycle(part)
    own = part.axis.taken - part.scene.origin
    chain = part.machine.kinematics
    parts = chain.inertias(chain.flows(own, part.machine.anchors(own)))
    found = {name: np.broadcast_to(values, own.shape) for name, values in parts.items() if np.any(values)}
    if not found:
        return _("No body of the machine has mass or inertia: I* = 0.")
    shown = samples.most(found)
    total = np.sum(list(found.values()), axis=0)
    extent = part.sizing.reduced_inertia if part.sizing is not None else None
    least, greatest, mean = extent or (float(total.min()), float(total.max()), None)
    return {
        "bodies": [{"name": name, "values": values} for name, values in shown.items()],
        "total": total,
        "least": least,
        "greatest": greatest,
        "mean": mean,
        "unit": "kg" if part.scene.reduction_element == "slide" else "kg m²",
    }


def _wittenbauer(part: Part, forces: JointForces | str) -> dict[str, Any] | str:
    """The loop W(I*), its tangents as energies (J), MN and P."""
    sizing, record = part.sizing, part.samples
    if part.scene.areas is not None:
        return _("The loop needs the reduced inertia of a machine; a diagram of areas gives none.")
    if sizing is None or sizing.cycle is None or record is None or part.machine is None:
        return _no_cycle(part)
    if sizing.run is None:
        return _("Nothing acts on the machine, or nothing in it has inertia: its speed never changes.")
    extent = sizing.reduced_inertia
    assert extent is not None
    if extent.greatest - extent.least <= _CONSTANT * extent.greatest:
        value = figure(extent.greatest, most=5)
        return _(
            "I* is constant, {value} kg m²: the loop is a vertical line, and the flywheel follows from the areas alone.",
            value=value,
        )
    run = sizing.run
    cycle, speed = run.cycle or sizing.cycle, run.speed or sizing.speed
    along = samples.samples_at(part.machine, cycle, part.axis.taken) if sizing.constant is not None else record
    loop = samples.loop(cycle, along, speed, run)
    joule = 0.5 * speed**2
    tangents = [
        {
            "slope": joule * slope,
            "intercept": joule * intercept,
            "contact": [contact[0], joule * contact[1]],
            "angle": angle,
            "tangent": slope,
            "inclination": float(np.degrees(np.arctan(slope))),
            "speed": limit,
        }
        for slope, intercept, contact, angle, limit in (
            (loop.slope_fast, loop.intercept_fast, loop.contact_fast, loop.angle_fast, run.speed_max),
            (loop.slope_slow, loop.intercept_slow, loop.contact_slow, loop.angle_slow, run.speed_min),
        )
    ]
    return {
        "inertia": along.inertia,
        "energy": along.work,
        "joule": joule,
        "tangents": tangents,
        "mn": joule * (loop.intercept_fast - loop.intercept_slow),
        "pole": [loop.far_point[0], joule * loop.far_point[1]],
        "flywheel": run.inertia,
        "irregularity": run.irregularity,
    }


def _speed(part: Part, forces: JointForces | str) -> dict[str, Any] | str:
    """The speed over the cycle with the flywheel given or sized; at rest beside those with the approximate ones."""
    sizing = part.sizing
    if sizing is None:
        return _no_cycle(part)
    eps, mean = sizing.scene.irregularity, sizing.speed
    found: dict[str, Any] = {
        "mean": mean,
        "band": None if eps is None else [mean * (1 - eps / 2), mean * (1 + eps / 2)],
        "asked": eps if sizing.approximated else None,
        "on": sizing.scene.flywheel_on,
        "confirmed": _confirmed(sizing),
    }
    if sizing.cycle is None:
        return found | _crossings(sizing)
    if sizing.run is None:
        return _("Nothing acts on the machine, or nothing in it has inertia: its speed never changes.")
    q = part.axis.taken
    first = "given" if sizing.scene.inertia is not None else "exact"
    runs = [(first, sizing.inertia or 0.0, sizing.run)]
    if part.rest and first == "exact":
        others = [(c.key, c.inertia, c.motion) for c in candidates(sizing) if c.key != "exact"]
        runs += [(key, inertia, run) for key, inertia, run in others if run is not None and inertia]
        found["stops"] = [key for key, _inertia, run in others if run is None]
    found["traces"] = [
        {
            "key": key,
            "inertia": inertia,
            "irregularity": run.irregularity,
            "values": turning_moment.speed_over_cycle(sizing.cycle, mean, run, q),
        }
        for key, inertia, run in runs
    ]
    run = sizing.run
    found["greatest"] = {"value": run.speed_max, "at": run.angle_speed_max}
    found["least"] = {"value": run.speed_min, "at": run.angle_speed_min}
    return found


def _crossings(sizing: Sizing) -> dict[str, Any]:
    """The speeds at the crossings of a diagram of areas."""
    inertia = sizing.inertia or 0.0
    sums = np.array([0.0, *(area.accumulated for area in sizing.areas)])
    eps = sizing.simulation.irregularity if sizing.simulation is not None else sizing.scene.irregularity or 0.0
    if not inertia:
        return {"diagram": True, "crossings": np.full(sums.size, sizing.speed), "inertia": 0.0, "irregularity": 0.0}
    on_crank = inertia * sizing.scene.flywheel_ratio**2
    speeds = samples.crossing_speeds(sums, sizing.speed * (1 - eps / 2), on_crank)
    return {"diagram": True, "crossings": speeds, "inertia": inertia, "irregularity": eps}


def _confirmed(sizing: Sizing) -> dict[str, Any] | None:
    """What confirmed the irregularity, and by how much it is off."""
    found = sizing.simulation
    if found is None:
        return None
    return {"irregularity": found.irregularity, "route": found.route, "error": sizing.error.simulation}


# -- power flow --------------------------------------------------------------------------------------------------------


def _power_flow(part: Part, forces: JointForces | str) -> dict[str, Any] | str:
    """Every stream of power with its mean and its course over the cycle, in W."""
    if part.scene.areas is not None:
        return _("A diagram of areas tells nothing of where power goes.")
    flow = None if part.sizing is None else part.sizing.power_flow
    if flow is None:
        return _no_cycle(part)
    powers = flow.along(np.clip(part.axis.taken, 0.0, part.scene.cycle))
    streams = [
        {
            "from": stream.source,
            "to": stream.target,
            "kind": stream.kind,
            "label": stream_name(stream, flow),
            "lost": stream.lost,
            "mean": stream.mean,
            "greatest": stream.greatest,
            "least": stream.least,
            "powers": power,
        }
        for stream, power in zip(flow.streams, powers, strict=True)
    ]
    if not any(stream["mean"] or stream["greatest"] or stream["least"] for stream in streams):
        return _("Nothing acts on the machine: no power flows.")
    totals = {"input": flow.input, "output": flow.output, "losses": flow.losses, "efficiency": flow.efficiency}
    return {"streams": streams, "places": places(flow), **totals}


# -- reactions ---------------------------------------------------------------------------------------------------------


def _forces(part: Part) -> JointForces | str:
    """The forces in the joints of the mechanism that is looked at, or why there are none."""
    scene, machine, sizing = part.scene, part.machine, part.sizing
    drawn = [mechanism.name for mechanism in scene.mechanisms if has_joints(mechanism)]
    if machine is None or not drawn:
        return _("The machine has no joints whose reactions could be told.")
    asked = part.view.get("mechanism")
    names = drawn if part.view.get("kind") == QUANTITIES[3] else [asked if asked in drawn else drawn[0]]
    try:
        if sizing is not None:
            return regime_forces(sizing, part.axis.taken, names)
        if len(drawn) < len(scene.mechanisms):
            return _("The reactions need a flywheel and a speed where a law moves with the linkages.")
        try:
            return joint_forces(machine, part.axis.taken)
        except SceneError:
            return joint_forces(machine, part.axis.taken, inertia=False)
    except SceneError as error:
        return str(error)


def _reactions(part: Part, forces: JointForces | str) -> dict[str, Any] | str:
    """The force in every joint of a mechanism, and its driving action."""
    if isinstance(forces, str):
        return forces
    name = _mechanism_seen(part, forces)
    found = forces.mechanisms[name]
    linkage, shown = found.poses.linkage, part.axis.shown
    joints = []
    known = _without_noise(found.forces)
    if not forces.inertia and not any(map(np.any, known.values())):
        return _("No speed is given, and so no inertia force; nothing else acts on the joints: add regime.speed.")
    for joint, force in known.items():
        kind, first, second = _joint_kind(linkage, joint)
        size_ = np.hypot(*force)
        one: dict[str, Any] = {"name": joint, "kind": kind, "first": first, "second": second, "x": force[0], "y": force[1]}
        one["largest"] = _peak(shown, size_, 1.0)
        parts = found.components.get(joint, {})
        if kind == SLIDE and "normal" in parts:
            one["normal"] = parts["normal"] if np.any(force) else np.zeros_like(size_)
        joints.append(one)
    driving = []
    for joint, action in found.actions.items():
        unit = "N m" if linkage.joint(joint).kind == PIN else "N"
        driving.append({"name": joint, "unit": unit, "values": action, **_extremes(shown, action)})
    drawn = [mechanism.name for mechanism in part.scene.mechanisms if has_joints(mechanism)]
    told = {"mechanism": name, "mechanisms": drawn, "without_inertia": not forces.inertia}
    return told | {"joints": joints, "driving": driving}


def _without_noise(forces: Mapping[str, Array]) -> dict[str, Array]:
    """Forces with those as zero that are no more than the rounding of the others."""
    largest = max((float(np.nanmax(np.abs(force), initial=0.0)) for force in forces.values()), default=0.0)
    level = _NOTHING * largest
    return {
        name: np.zeros_like(force) if np.all(np.abs(force) <= level) else np.asarray(force) for name, force in forces.items()
    }


def _mechanism_seen(part: Part, forces: JointForces) -> str:
    asked = part.view.get("mechanism")
    return str(asked) if asked in forces.mechanisms else next(iter(forces.mechanisms))


def _joint_kind(linkage: Any, name: str) -> tuple[str, str, str]:
    """Kind and bodies of a joint, or of a coupling."""
    for joint in linkage.joints:
        if joint.name == name:
            return joint.kind, joint.first, joint.second
    return "coupling", "", ""


def _peak(shown: Array, values: Array, sense: float) -> dict[str, Any] | None:
    """Where a curve is greatest (sense 1) or least: the top of a parabola through three samples, or a sample at a jump."""
    signed = np.where(np.isfinite(values), sense * values, -np.inf)
    k = int(signed.argmax())
    if not np.isfinite(signed[k]):
        return None
    at, value = float(shown[k]), float(signed[k])
    if 0 < k < shown.size - 1 and np.isfinite(signed[k - 1 : k + 2]).all():
        (a, b, c), (u, v, w) = shown[k - 1 : k + 2], signed[k - 1 : k + 2]
        if a < b < c:
            left, right = (v - u) / (b - a), (w - v) / (c - b)
            bend = (right - left) / (c - a)
            if bend < 0.0:
                top = 0.5 * (a + b) - 0.5 * left / bend
                if a < top < c:
                    at, value = float(top), float(v + left * (top - b) + bend * (top - a) * (top - b))
    return {"value": sense * value, "at": at}


def _extremes(shown: Array, values: Array) -> dict[str, Any]:
    return {"least": _peak(shown, values, -1.0), "greatest": _peak(shown, values, 1.0)}


# -- motion ------------------------------------------------------------------------------------------------------------


def _motion(part: Part, forces: JointForces | str) -> dict[str, Any] | str:
    """Position, velocity or acceleration of what is asked for, or the reaction of a joint, against the driver."""
    scene = part.scene
    if scene.areas is not None:
        return _("A diagram of areas tells nothing of what moves.")
    moving = Moving(scene)
    driver, condition = _driver_motion(part, forces)
    found = moving.places(part.axis.taken)[0]
    joints = {} if isinstance(forces, str) else _joints(forces)
    asked, kinds = part.view.get("kind"), QUANTITIES if joints else QUANTITIES[:3]
    reacts = bool(joints) or (not forces and any(map(has_joints, scene.mechanisms)))
    quantity = asked if asked in kinds else QUANTITIES[1]
    known = list(joints) if quantity == QUANTITIES[3] else list(found)
    if not known:
        return _("Nothing moves.")
    of = str(part.view.get("of"))
    of = of if of in known else _first(known)
    result: dict[str, Any] = {"of": of, "quantity": quantity, "choices": known, "reacts": reacts, "condition": condition}
    if quantity == QUANTITIES[3] and not isinstance(forces, str):
        force = joints[of]
        condition["without_inertia"] = not forces.inertia
        rows = {"x": force[0], "y": force[1], "amount": np.hypot(*force)}
        unit = "N"
    else:
        order = QUANTITIES.index(quantity)
        values = _derivative(found[of].track, driver, order)
        kind = found[of].kind
        rows = {"": values}
        if kind == POINT:
            rows = {"x": values[0], "y": values[1]} | ({"amount": np.hypot(*values)} if order else {})
        length = "rad" if kind == "angle" else "m"
        unit = _unit(length, order, driver, scene)
        result["kind"] = kind
    shown = part.axis.shown
    curves = [{"part": name, "values": values, **_extremes(shown, values)} for name, values in rows.items()]
    return result | {"unit": unit, "curves": curves}


def _derivative(track: Track, driver: Driver, order: int) -> Array:
    """The place itself, its velocity g q̇ or its acceleration g q̈ + g' q̇²; g or g' where the driver has no speed."""
    if driver.rate is None or driver.acceleration is None or not order:
        return track[order]
    return track.rate * driver.rate if order == 1 else track.rate * driver.acceleration + track.slope * driver.rate**2


def _unit(length: str, order: int, driver: Driver, scene: Scene) -> str:
    """The unit of a derivative of an angle or a length: by time, or by the driver's coordinate."""
    if not order:
        return length
    if driver.rate is not None:
        return f"{length}/s" + "²" * (order == 2)
    if scene.reduction_element == "slide":
        return {("m", 1): "1", ("m", 2): "1/m", ("rad", 1): "rad/m", ("rad", 2): "rad/m²"}[length, order]
    return f"{length}/rad" + "²" * (order == 2)


def _driver_motion(part: Part, forces: JointForces | str) -> tuple[Driver, dict[str, Any]]:
    """How the driver moves: as the forces say; by the steady regime; at the scene's speed; or per unit."""
    scene, q = part.scene, part.axis.taken
    if part.sizing is not None and part.machine is not None:
        motion = regime_motion(part.sizing, q) if isinstance(forces, str) else forces.motion
        return Driver(q, None, motion.omega, motion.alpha), {"kind": "steady", "speed": part.sizing.speed}
    speed = scene.speed if scene.stroke is None else scene.stroke.speed
    if speed:
        course = courses.constant_speed(scene, "scene", courses.DRIVER)
        acceleration = 0.0 if scene.stroke is None else scene.stroke.acceleration
        return course.at(q), {"kind": "constant", "speed": speed, "acceleration": acceleration}
    return Driver(q), {"kind": "unit", "speed": None}


def _joints(forces: JointForces) -> dict[str, Array]:
    """The whole force of every joint (2, n), by its name; of several mechanisms with the mechanism's before it."""
    several = len(forces.mechanisms) > 1
    return {
        f"{mechanism}.{joint}" if several else joint: force
        for mechanism, found in forces.mechanisms.items()
        for joint, force in _without_noise(found.forces).items()
    }


def _first(known: Iterable[str]) -> str:
    """What is shown where nothing is asked for: a body that slides or a port of the mechanism, else the last but points."""
    names = list(known)
    ports = [name for name in names if name.rpartition(".")[2] in ("guide", "slider", "ram", "platen", "yoke", "rocker")]
    bodies = [name for name in names if "." not in name]
    return (ports or bodies[::-1] or names)[0]


_MAKERS = {
    "mechanism": _mechanism,
    "moment": _moment,
    "inertia": _inertia,
    "wittenbauer": _wittenbauer,
    "speed": _speed,
    "power_flow": _power_flow,
    "reactions": _reactions,
    "motion": _motion,
}
