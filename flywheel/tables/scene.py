"""Input summary, part by part in the units of the trade; and what in it decides how a sizing was solved."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from flywheel.language import message, number
from flywheel.language import text as _
from flywheel.machine.loads import moving_switches
from flywheel.machine.machine import Machine
from flywheel.mechanisms import KINDS
from flywheel.numerics.expressions import Expression
from flywheel.numerics.units import columns, figure
from flywheel.scene.accuracy import CONFIRM
from flywheel.scene.linkage import Linkage, offered
from flywheel.scene.scene import Body, Law, Load, Mechanism, Scene, Table, Transmission
from flywheel.sizing.results import Sizing
from flywheel.sizing.sizing import size
from flywheel.tables.rows import DEGREES, SI, TradeUnits, page, sentences, wrapped

_MOST_ROWS = 6  # rows of one kind
_DIGITS = 6


class Part(NamedTuple):
    """A part of the machine: its kind, the label of its row, where it acts or what it is, its figures; its phase or "".

    `phase` (an angle as text) is that of a mechanism, so that cylinders of one engine can be told together.
    """

    kind: str
    label: str
    head: str
    told: str
    phase: str = ""

    @property
    def row(self) -> str:
        """Text beside the label."""
        at = ", " + _("phase {angle}", angle=self.phase) if self.phase else ""
        return f"{self.head}{at}: {self.told}" if self.head else self.told


def scene_rows(scene: Scene) -> list[str]:
    """Input summary, a row for each part of the machine; the first few of a kind, and the number of the others."""
    rows: list[tuple[str, str]] = []
    count: dict[str, int] = {}
    for part in parts(scene):
        count[part.kind] = count.get(part.kind, 0) + 1
        if count[part.kind] <= _MOST_ROWS:
            rows.append((part.label, part.row))
        elif count[part.kind] == _MOST_ROWS + 1:
            more = sum(other.kind == part.kind for other in parts(scene)) - _MOST_ROWS
            rows.append(("", _("and {n} more", n=more)))
    width = max((len(name) for name, _row in rows), default=0)
    lines = [_("Input summary")] if rows else []
    for name, told in rows:
        head = f"  {name.ljust(width)}  "
        lines += wrapped(told, " " * len(head), head)
    return lines


def parts(scene: Scene, units: TradeUnits = SI) -> Iterator[Part]:
    """The parts of the machine in the order of the scene's kinds, and how it runs."""
    if scene.areas is not None:
        values = ", ".join(number(figure(value, most=_DIGITS)) for value in scene.areas.values[: 2 * _MOST_ROWS])
        more = f"... ({len(scene.areas.values)})" if len(scene.areas.values) > 2 * _MOST_ROWS else ""
        told = _("{values}, times {scale}", values=values + more, scale=units.read(scene.areas.scale, "energy"))
        yield Part("areas", _("areas"), "", told)
    for m in scene.mechanisms:
        yield _mechanism(m, units)
    for name, ratio in scene.shafts.items():
        if name not in ("crank", "slide"):
            yield Part("shaft", _("shaft {name}", name=name), "", _shaft(name, ratio, scene, units))
    for i in scene.inertias:
        value = _mass(i.value, _turns(i.on, scene), units)
        yield Part("inertia", _("inertia"), "", _("{value} on {place}", value=value, place=i.on))
    for load in scene.loads:
        if load.drag and load.on in scene.transmissions:
            continue  # told with its shaft
        yield Part("load", _("load"), _on(load.on), _load(load, scene, units))
    for s in scene.springs:
        kind = "angular_stiffness" if _turns(s.on, scene) else "stiffness"
        yield Part("spring", _("spring"), _on(s.on), str(units.read(s.stiffness, kind)))
    for d in scene.dampers:
        kind = "angular_damping" if _turns(d.on, scene) else "damping"
        yield Part("damper", _("damper"), _on(d.on), str(units.read(d.coefficient, kind)))
    if scene.drive is not None:
        yield Part("drive", _("drive"), _on(scene.drive.on), _load(scene.drive, scene, units))
    yield Part("runs", _("runs"), "", ", ".join([*running(scene, units), *_flywheel(scene, units)]))


def _on(place: str) -> str:
    return _("on {place}", place=place)


def _turns(place: str, scene: Scene) -> bool:
    """Tests whether a shaft or a port rotates."""
    if place in scene.shafts:
        return place != "slide"
    name, _dot, port = place.rpartition(".")
    mechanism = next(m for m in scene.mechanisms if m.name == name)
    if mechanism.linkage is not None:
        return offered(mechanism.linkage, [point.name for point in mechanism.points])[port]
    if mechanism.outputs:
        return next(output.rotating for output in mechanism.outputs if output.name == port)
    return next(known.rotating for known in KINDS[mechanism.type].ports if known.name == port)


def _mechanism(mechanism: Mechanism, units: TradeUnits) -> Part:
    label = _("mechanism") if mechanism.name == mechanism.type else mechanism.name
    head = mechanism.type + ("" if mechanism.shaft in ("crank", "slide") else " " + _on(mechanism.shaft))
    phase = str(units.read(mechanism.phase, "angle")) if mechanism.phase and mechanism.stroke is None else ""
    if mechanism.linkage is not None:
        return Part("mechanism", label, head, "; ".join(_links(mechanism.linkage, units)), phase)
    outputs = [f"{o.name} {_mass(o.inertia, o.rotating, units)}" if o.inertia else o.name for o in mechanism.outputs]
    told = "; ".join([*_parts(mechanism.geometry, mechanism.bodies, units), *outputs])
    return Part("mechanism", label, head, told, phase)


def _parts(geometry: Mapping[str, float], bodies: Mapping[str, Body], units: TradeUnits) -> Iterator[str]:
    """Lengths, angles and masses of a mechanism, part by part."""
    owners = dict.fromkeys([*(path.partition(".")[0] for path in geometry), *bodies])
    for part in owners:
        sizes = []
        for path, value in geometry.items():
            owner, _dot, key = path.partition(".")
            if owner == part and (value or key == "length"):
                size = str(units.read(value, "angle" if key in ("angle", "direction") else "length"))
                sizes.append(size if key == "length" else f"{key.replace('_', ' ')} {size}")
        sizes += _masses(bodies.get(part, Body()), units)
        if sizes:
            yield f"{part.replace('_', ' ')} {', '.join(sizes)}"


def _links(linkage: Linkage, units: TradeUnits) -> Iterator[str]:
    """The bodies of a linkage: how far their points lie apart at most, and what they weigh."""
    for link in linkage.links:
        spans = [((a.x - b.x) ** 2 + (a.y - b.y) ** 2) ** 0.5 for a in link.points for b in link.points]
        sizes = [str(units.read(max(spans), "length"))] if spans and max(spans) > 0.0 else []
        sizes += _masses(Body(mass=link.mass, inertia=link.inertia), units)
        yield f"{link.name} {', '.join(sizes)}".strip()


def _shaft(name: str, ratio: float, scene: Scene, units: TradeUnits) -> str:
    """Speed ratio of a shaft, and the losses of its mesh or belt."""
    turns = _("{n} turns to one of the crank", n=number(figure(ratio, most=_DIGITS)))
    mesh = scene.transmissions.get(name, Transmission(ratio=ratio, efficiency=scene.efficiencies.get(name, 1.0)))
    on = _("the crank") if mesh.on == "crank" else mesh.on
    near = _("{n} to one of {shaft}", n=number(figure(mesh.ratio, most=_DIGITS)), shaft=on)
    apart = mesh.on != "crank" or mesh.slip > 0.0  # the mesh has a ratio of its own
    words = [f"{near} ({turns})" if apart else turns]
    if mesh.slip:
        words.append(_("slip {n} %", n=number(figure(100 * mesh.slip, most=_DIGITS))))
    if mesh.efficiency != 1.0:
        words.append(_("efficiency {n} %", n=number(figure(100 * mesh.efficiency, most=_DIGITS))))
    if mesh.drag:
        words.append(_("drag {value}", value=units.read(mesh.drag, "torque")))
    if name in scene.compliances:
        words.append(_("stiffness {value}", value=units.read(scene.compliances[name].stiffness, "angular_stiffness")))
    return ", ".join(words)


def _load(load: Load, scene: Scene, units: TradeUnits) -> str:
    """A load's law, and when it acts."""
    words = message(load.model) or _law(load.law, _turns(load.on, scene), units)
    if load.model and load.factor != 1.0:
        words += ", " + _("{n} times", n=number(figure(load.factor, most=_DIGITS)))
    if load.start is not None and load.end is not None:
        kind = "length" if load.once and scene.reduction_element == "slide" else "angle"
        start, end = (units.read(place, kind) for place in (load.start, load.end))
        words += " " + _("from {start} to {end}", start=start, end=end)
    if load.sense:
        words += " " + _("while {condition}", condition=f"v {'>' if load.sense > 0 else '<'} 0")
    return words


def _law(law: Law | None, turns: bool, units: TradeUnits) -> str:
    """A force or torque; expressions are SI as they were written."""
    kind = "torque" if turns else "force"
    if law is None:
        return _("balance, a constant torque") if turns else _("balance, a constant force")
    if isinstance(law, Expression):
        return f"{law.shown} {'N m' if turns else 'N'}"
    if isinstance(law, Table):
        least, greatest = (units.read(float(value), kind) for value in (law.value.min(), law.value.max()))
        return _("{n} rows, {least} to {greatest}", n=law.angle.size, least=least, greatest=greatest)
    return str(units.read(law, kind))


def running(scene: Scene, units: TradeUnits = SI) -> list[str]:
    """Operation without the flywheel: speed and cycle, or stroke."""
    if scene.stroke is not None:
        start, end = (
            units.read(place, "length" if scene.stroke.sliding else "angle")
            for place in (scene.stroke.start, scene.stroke.end)
        )
        ends = _("from {start} to {end}", start=start, end=end)
        if scene.stroke.speed is None:
            return [ends]
        speed = units.read(scene.stroke.speed, "velocity" if scene.stroke.sliding else "angular_speed")
        return [_("{ends} at {speed}", ends=ends, speed=speed)]
    if scene.speed is not None:
        words = [_("crank at {speed}", speed=units.read(scene.speed, "speed", 4))]
    else:
        words = [_("crank at its own speed") if scene.depends_on_speed else _("crank at no given speed")]
    if scene.areas is None and abs(scene.cycle * DEGREES - 360) > 1e-6:
        words.append(_("cycle {angle}", angle=units.read(scene.cycle, "angle")))
    return words


def _flywheel(scene: Scene, units: TradeUnits) -> Iterator[str]:
    """Requirements of the flywheel, or the flywheel given."""
    if scene.stroke is None and scene.limits:
        yield _("flywheel on {place} for its limits", place=scene.flywheel_on)
    elif scene.stroke is None and scene.irregularity is not None:
        eps = number(figure(scene.irregularity, most=_DIGITS))
        yield _("flywheel on {place} for irregularity {eps}", place=scene.flywheel_on, eps=eps)
    if scene.stroke is None and scene.inertia is not None:
        yield _("flywheel of {inertia} on {place}", inertia=units.read(scene.inertia, "inertia"), place=scene.flywheel_on)


# -- figures ---------------------------------------------------------------------------------------------------------


def _masses(body: Body, units: TradeUnits) -> list[str]:
    """Mass and inertia of a body, as far as it has them."""
    return [_mass(value, turns, units) for value, turns in ((body.mass, False), (body.inertia, True)) if value != 0.0]


def _mass(value: float, turns: bool, units: TradeUnits) -> str:
    return str(units.read(value, "inertia" if turns else "mass"))


# -- what a sizing did, and why -------------------------------------------------------------------------------------------


_ELSEWHERE = "flywheel tradeoff measures what other methods and tolerances cost on this scene."


@dataclass(frozen=True)
class Explanation:
    """Explanation of a sizing's method.

    `formulation` is what was solved, and `because` which entries of the scene made it so; `motion` says how the motion
    over the cycle was found. `not_modelled` is what the scene does not need, `forced` what it has that takes more. What
    its level left out, and what it cost, the sizing itself tells.
    """

    sizing: Sizing
    formulation: str
    because: tuple[str, ...]
    motion: str
    not_modelled: tuple[str, ...]
    forced: tuple[str, ...]

    def as_dict(self) -> dict[str, Any]:
        """Data that `--explain --json` prints under "explanation"."""
        return {
            "accuracy": self.sizing.accuracy,
            "formulation": self.formulation,
            "because": list(self.because),
            "motion": self.motion,
            "not_modelled": list(self.not_modelled),
            "forced": list(self.forced),
            "left_out": list(self.sizing.left_out),
            "cost": self.sizing.cost.as_dict(),
        }

    def text(self) -> str:
        """The same in plain text, at most 100 columns wide."""
        cost = self.sizing.cost
        parts = {"the whole": cost, **cost.stages}
        rows = [(name, str(part.evaluations), figure(part.seconds, 0.0, 2)) for name, part in parts.items()]
        costs = columns(rows, ("", "evaluations", "s"))
        blocks = {
            f"Method of solution ({self.sizing.accuracy})": _items(
                (f"figures: {self.formulation}", f"motion: {self.motion}")
            ),
            "What the torques depend on": _items(self.because),
            "Not modelled, as this scene or this level does not need it": _items(self.not_modelled),
            "Additional work beyond that of a smooth machine": _items(self.forced),
            "Cost, without the loading of libraries": [*costs, *sentences([_ELSEWHERE])],
        }
        return page((title, *lines) for title, lines in blocks.items() if lines)


def explain(
    machine: Machine | Scene, rtol: float | None = None, *, simulate: bool | None = None, accuracy: str | None = None
) -> Explanation:
    """Sizes a machine as `flywheel.size` does, and explains the method of solution.

    Args:
        machine: a `Machine`, or a `Scene`.
        rtol: relative accuracy asked of every figure; the scene's own if None.
        simulate: whether to confirm by time stepping.
        accuracy: the level of accuracy; "audit" if None.

    Raises:
        SceneError: as `flywheel.size` does.
        ValueError: for a level that does not exist, or contradicts `simulate`.

    >>> import flywheel
    >>> scene = flywheel.load({"load": [{"on": "crank", "torque": "-100 N m", "from": 0, "to": "180 deg"}],
    ...                        "drive": {"torque": "balance"}, "regime": {"speed": "300 rpm"},
    ...                        "flywheel": {"irregularity": 0.01}})
    >>> explain(scene, accuracy="normal").because
    ('on position alone: load[0].torque, drive.torque (balance)',)

    """
    return explanation(size(machine, rtol, simulate=simulate, accuracy=accuracy))


def explanation(sizing: Sizing) -> Explanation:
    """The explanation of a sizing that was made already."""
    return Explanation(
        sizing=sizing,
        formulation=_formulation(sizing),
        because=tuple(_because(sizing)),
        motion=_motion(sizing),
        not_modelled=tuple(_not_modelled(sizing)),
        forced=tuple(_forced(sizing)),
    )


def _items(rows: Iterable[str]) -> list[str]:
    return [line for row in rows for line in wrapped(row, "    ", "  - ")]


def _counted(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


def _formulation(sizing: Sizing) -> str:
    """Problem solved for the figures."""
    machine, cycle = sizing.machine, sizing.cycle
    if machine is None or cycle is None:
        return "sums of the areas of a diagram: no machine, no position, no cell"
    cells = f"{_counted(cycle.mesh.edges.size - 1, 'cell')} of {cycle.mesh.phi.shape[1]} nodes"
    if sizing.cyclic is not None:
        steps = f"{_counted(sizing.cyclic.steps, 'Newton step')} on the last ones"
        return f"periodic collocation of the kinetic energy, E'(phi) = M*(phi, omega), on {cells}, {steps}"
    if machine.sets_its_speed:
        return f"quadrature on {cells} at a constant speed: nothing varies, so there is no motion to solve for"
    closed = (
        "Wittenbauer's closed form" if sizing.scene.inertia is None else "the speed from the energy, whose level is found"
    )
    return f"quadrature of M* and dI*/dphi on {cells}, and {closed}, without time stepping"


def _because(sizing: Sizing) -> Iterator[str]:
    """Dependence of the torques, each by its path in the scene."""
    machine, scene = sizing.machine, sizing.scene
    if machine is None:
        yield "the scene gives the areas themselves: areas.values"
        return
    named = [(f"{effort.path}{' (balance)' if effort.depends_on_unknown else ''}", effort) for effort in machine.efforts]
    moving = [*(name for name, effort in named if effort.uses_speed), *(damper.path for damper in scene.dampers)]
    still = [name for name, effort in named if not effort.uses_speed]
    still += [spring.path for spring in scene.springs] + (["gravity"] if _weights(machine) else [])
    meshes = [(stage.shaft, scene.transmissions.get(stage.shaft, Transmission())) for stage in machine.stages]
    lossy = [f"shafts.{name}.efficiency" for name, mesh in meshes if mesh.efficiency < 1.0]
    lossy += [f"shafts.{name}.slip" for name, mesh in meshes if mesh.slip > 0.0]
    if moving:
        yield f"on speed: {', '.join(moving)}"
    if still:
        yield f"on position alone: {', '.join(still)}"
    if lossy:
        yield f"on acceleration, as mesh losses change direction: {', '.join(lossy)}"
    if _circuit(machine):
        yield "on a current of its own: drive.motor.inductance"
    if not (moving or still or lossy):
        yield "nothing acts: only the inertia of the machine varies"


def _motion(sizing: Sizing) -> str:
    """Method for the motion over the cycle, the second one for each of the flywheels, and its cost."""
    machine, confirmed = sizing.machine, sizing.simulation
    if machine is None:
        return "not found"
    if confirmed is None:
        return "the one of the figures; not found a second time" if sizing.run is not None else "none: nothing stores energy"
    if confirmed.route not in ("time", "collocation"):
        found = "that of the collocation" if sizing.cyclic is not None else "from the energy, in closed form,"
        return f"{found} on the cells of the figures; time by quadrature; no time stepping"
    evaluations = _counted(sizing.cost.stages["simulation"].evaluations, "evaluation")
    cycles = "one cycle"
    if sizing.flywheel.approximate is not None:
        lost = confirmed.irregularity_approximate is None
        second = " (none was found with the approximate one)" if lost else " and one with the approximate one"
        cycles = f"one cycle with the exact flywheel{second}"
    if confirmed.route == "collocation":
        return f"found again by periodic collocation on other cells, {cycles}, with {evaluations}, and compared"
    from flywheel.regime.free_motion import stiffness

    implicitly = {0.0: ", implicitly, as a linkage is solved at many positions at once,", float("inf"): ""}
    steps = f"in time{implicitly.get(stiffness(machine), ', implicitly where it is stiff,')}"
    return f"stepped {steps} through {cycles}, with {evaluations}, and compared with the figures"


def _elements(machine: Machine, *kinds: str) -> list[Any]:
    return [element for element in machine.graph.elements.values() if element.kind in kinds]


def _weights(machine: Machine) -> bool:
    return any((element.part or "").startswith("weight of") for element in _elements(machine, "Se"))


def _circuit(machine: Machine) -> bool:
    return getattr(machine.scene.motor, "inductance", 0.0) > 0.0


def _not_modelled(sizing: Sizing) -> Iterator[str]:
    """Effects that the scene does not need, and that were not modelled."""
    machine = sizing.machine
    if machine is None:
        yield "the machine: areas do not give its inertia, its speeds over time or its drive"
        return
    heavy = {element.part for element in _elements(machine, "I") if element.law}
    bodies = [f"{mechanism.name}.{body}" for mechanism in machine.scene.mechanisms for body in _bodies(mechanism)]
    massless = [body for body in bodies if body not in heavy]
    if massless:
        yield f"bodies without mass or inertia: {', '.join(massless)}"
    if machine.omitted:
        yield f"velocities on which nothing depends: {', '.join(machine.omitted)}"
    cycle, inertia = sizing.constant or sizing.cycle, sizing.reduced_inertia
    if cycle is not None and inertia is not None and inertia.greatest - inertia.least <= 4 * cycle.errors.variation:
        if inertia.greatest <= cycle.errors.inertia:
            yield "inertia of the machine itself: it has none"
        else:
            yield f"a varying inertia: I* is {inertia.mean:.6g} kg m² at every angle"
        if sizing.cyclic is None and not machine.sets_its_speed:
            yield "a difference between the exact flywheel and the one by the areas: it vanishes with a constant I*"
    lacking = [
        *([] if _weights(machine) else ["weights"]),
        *([] if _elements(machine, "C") else ["springs"]),
        *([] if _elements(machine, "R") else ["dampers"]),
        *([] if any(stage.efficiency < 1.0 for stage in machine.stages) else ["losses in meshes"]),
        *([] if machine.friction is not None else ["friction in joints"]),
    ]
    if lacking:
        yield f"elements absent from the machine: {', '.join(lacking)}"
    if machine.scene.motor is not None and not _circuit(machine):
        yield "what delays the motor's torque, such as its current: it follows the speed at once"
    collocated = sizing.accuracy == CONFIRM and sizing.run is not None
    if not (machine.sets_its_speed or collocated):
        yield "torques at other speeds, and so Newton's method for the motion: none depends on speed"
    if sizing.simulation is None or sizing.simulation.route != "time":
        yield "time stepping"
    if machine.friction is None:
        yield "forces in the joints: nothing here depends on them (flywheel reactions gives them)"


def _bodies(mechanism: Mechanism) -> list[str]:
    """The names of what may have mass in a mechanism."""
    if mechanism.linkage is not None:
        return [link.name for link in mechanism.linkage.links]
    if mechanism.outputs:
        return [output.name for output in mechanism.outputs]
    return [part.name for part in KINDS[mechanism.type].parts if part.body]


def _forced(sizing: Sizing) -> Iterator[str]:
    """Features of the scene that need more work than a smooth machine."""
    machine, cycle = sizing.machine, sizing.cycle
    if machine is None or cycle is None:
        return
    broken = machine.breakpoints.size - 2
    if broken:
        sources = ", ".join(f"{name} {count}" for name, count in machine.broken_by.items())
        yield f"{_counted(broken, 'breakpoint')} inside the cycle, from {sources}"
    narrow = machine.landmarks.size - machine.breakpoints.size
    if narrow:
        yield f"{_counted(narrow, 'more edge')} around narrow features of expressions"
    edges, first = cycle.mesh.edges, machine.mesh.size - 1
    more = edges.size - 1 - first
    rest = f"{more} more where {'they' if first != 1 else 'it'} did not resolve it" if more > 0 else "which sufficed"
    yield f"{_counted(first, 'cell')} at first, {rest}"
    if more > 0:
        k = int((edges[1:] - edges[:-1]).argmin())
        low, high = ((edge + machine.scene.origin) * DEGREES for edge in edges[k : k + 2])
        yield f"the narrowest cell goes from {low:.6g} to {high:.6g} deg"
    solved = [mechanism.name for mechanism in machine.scene.mechanisms if mechanism.linkage is not None]
    if solved:
        yield f"positions by Newton-Raphson: {', '.join(solved)}"
    if machine.friction is not None:
        rounds = "beforehand"
        if sizing.friction is not None:
            rounds = f"in {_counted(sizing.friction.rounds, 'round')} with the motion that it follows"
        yield f"friction in joints, whose moment was found by kinetostatics {rounds}"
    switching = [
        effort.path
        for effort in machine.efforts
        if effort.uses_speed and moving_switches(effort.load.law)  # type: ignore[arg-type]
    ]
    if switching:
        yield f"laws that switch at a speed, where the motion itself divides the cells: {', '.join(switching)}"
    if sizing.accuracy == CONFIRM and sizing.run is not None:
        yield "separate cells for the confirmation"
