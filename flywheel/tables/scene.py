"""Input summary, part by part in customary units; and the entries that decide the method of a sizing."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

from flywheel.language import message, number
from flywheel.language import text as _
from flywheel.mechanisms import KINDS
from flywheel.numerics.expressions import Expression
from flywheel.numerics.units import figure
from flywheel.scene.linkage import Linkage, offered
from flywheel.scene.scene import (
    Body,
    Brake,
    Clutch,
    Damper,
    Law,
    Load,
    Mechanism,
    Scene,
    SingleStroke,
    Spring,
    Table,
    Transmission,
)
from flywheel.tables.rows import DEGREES, SI, TradeUnits, place, wrapped

_MOST_ROWS = 6  # rows of one kind
_DIGITS = 6


class SceneLine(NamedTuple):
    """A part of the machine: its kind, the label of its row, its place or type, its figures; its phase or "".

    `phase` (an angle as text) is that of a mechanism, so that cylinders of one engine share a row.
    """

    kind: str
    label: str
    head: str
    text: str
    phase: str = ""

    @property
    def row(self) -> str:
        """Text after the label."""
        at = ", " + _("phase {angle}", angle=self.phase) if self.phase else ""
        return f"{self.head}{at}: {self.text}" if self.head else self.text


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
    for name, text in rows:
        head = f"  {name.ljust(width)}  "
        lines += wrapped(text, " " * len(head), head)
    return lines


def parts(scene: Scene, units: TradeUnits = SI) -> Iterator[SceneLine]:
    """The parts of the machine in the order of the scene's kinds, and its operation."""
    if scene.areas is not None:
        values = ", ".join(number(figure(value, most=_DIGITS)) for value in scene.areas.values[: 2 * _MOST_ROWS])
        more = f"... ({len(scene.areas.values)})" if len(scene.areas.values) > 2 * _MOST_ROWS else ""
        text = _("{values}, times {scale}", values=values + more, scale=units.read(scene.areas.scale, "energy"))
        yield SceneLine("areas", _("areas"), "", text)
    for m in scene.mechanisms:
        yield _mechanism(m, units)
    for name, ratio in scene.shafts.items():
        if name not in ("crank", "slide"):
            # Speed ratio of a shaft, and the losses of its mesh or belt.
            turns = _("{n} turns to one of the crank", n=number(figure(ratio, most=_DIGITS)))
            mesh = scene.transmissions.get(name, Transmission(ratio=ratio))
            on = place(mesh.on, article=True)
            near = _("{n} to one of {shaft}", n=number(figure(mesh.ratio, most=_DIGITS)), shaft=on)
            apart = mesh.on != "crank" or mesh.slip > 0.0  # the mesh has a ratio of its own
            words = [f"{near} ({turns})" if apart else turns]
            if mesh.slip:
                words.append(_("slip {n} %", n=number(figure(100 * mesh.slip, most=_DIGITS))))
            if mesh.efficiency != 1.0:
                words.append(_("efficiency {n} %", n=number(figure(100 * mesh.efficiency, most=_DIGITS))))
            if mesh.drag:
                words.append(_("drag {value}", value=units.read(mesh.drag, "torque")))
            if mesh.stiffness is not None:
                words.append(_("stiffness {value}", value=units.read(mesh.stiffness, "angular_stiffness")))
            yield SceneLine("shaft", _("shaft {name}", name=name), "", ", ".join(words))
    for i in scene.inertias:
        value = _mass(i.value, _turns(i.on, scene), units)
        yield SceneLine("inertia", _("inertia"), "", _("{value} on {place}", value=value, place=place(i.on)))
    for load in scene.loads:
        if load.drag and load.on in scene.transmissions:
            continue  # listed with its shaft
        yield SceneLine("load", _("load"), _on(load.on), _load(load, scene, units))
    for s in scene.springs:
        kind = "angular_stiffness" if _turns(s.on, scene) else "stiffness"
        yield SceneLine("spring", _("spring"), _on(s.on), str(units.read(s.stiffness, kind)))
    for d in scene.dampers:
        kind = "angular_damping" if _turns(d.on, scene) else "damping"
        yield SceneLine("damper", _("damper"), _on(d.on), str(units.read(d.coefficient, kind)))
    if scene.drive is not None:
        yield SceneLine("drive", _("drive"), _on(scene.drive.on), _load(scene.drive, scene, units))
    if scene.single_stroke is not None:
        yield from _clutch_and_brake(scene.single_stroke, units)
    yield SceneLine("runs", _("runs"), "", ", ".join([*running(scene, units), *_flywheel(scene, units)]))


def _clutch_and_brake(plan: SingleStroke, units: TradeUnits) -> Iterator[SceneLine]:
    """Torque, angle and times of both."""
    clutch, brake = plan.clutch, plan.brake
    words = {"torque": units.read(clutch.torque, "torque"), "angle": units.read(clutch.disengage, "angle")}
    texts = [_("{torque}, released at {angle}", **words)]
    if clutch.static_torque != clutch.torque:
        texts.append(_("holds {torque}", torque=units.read(clutch.static_torque, "torque")))
    yield SceneLine("clutch", _("clutch"), _on(clutch.on), ", ".join([*texts, *_ramps(clutch, units)]))
    words = {"torque": units.read(brake.torque, "torque"), "angle": units.read(brake.engage, "angle")}
    texts = [_("{torque}, applied at {angle}", **words)]
    if brake.reverse_torque != brake.torque:
        texts.append(_("{torque} against a rotation backwards", torque=units.read(brake.reverse_torque, "torque")))
    yield SceneLine("brake", _("brake"), _on(brake.on), ", ".join([*texts, *_ramps(brake, units)]))


def _ramps(part: Clutch | Brake, units: TradeUnits) -> Iterator[str]:
    """Times of a clutch or brake, and its limits of heat."""
    hold = part.hold if isinstance(part, Clutch) else 0.0
    times = (
        (part.rise, _("builds up in {time} ms")),
        (hold, _("holds for {time} ms")),
        (part.fall, _("vanishes in {time} ms")),
    )
    for seconds, words in times:
        if seconds:
            yield words.format(time=number(figure(1e3 * seconds, most=_DIGITS)))
    for heat, words in (
        (part.heat_per_stroke, _("permits {heat} a stroke")),
        (part.heat_per_hour, _("permits {heat} an hour")),
    ):
        if heat is not None:
            yield words.format(heat=units.read(heat, "energy"))


def load_number(scene: Scene, part: str) -> int:
    """Returns the number of a load, spring or damper in the scene, from 1, counted through."""
    items: list[Load | Spring | Damper] = [*(load for load in scene.loads if not load.drag), *scene.springs, *scene.dampers]
    return next((k for k, item in enumerate(items, start=1) if part == f"{item.path} on {item.on}"), 0)


def part_name(scene: Scene, part: str) -> str:
    """Returns the name of a part of I* or M* in the language in use."""
    if part.startswith("weight of "):
        return _("weight of {body}", body=part.removeprefix("weight of "))
    if part.startswith("inertia on "):
        return _("inertia on {place}", place=place(part.removeprefix("inertia on ")))
    if (drag := next((load.on for load in scene.loads if load.drag and load.path == part), None)) is not None:
        return _("drag on {place}", place=place(drag))
    if n := load_number(scene, part):
        kind = _("spring") if part.startswith("spring") else _("damper") if part.startswith("damper") else _("load")
        return _("{kind} {n} on {place}", kind=kind, n=n, place=place(part.partition(" on ")[2]))
    return _("drive") if part == "drive" else _("friction in joints") if part == "friction in joints" else part


def _on(name: str) -> str:
    return _("on {place}", place=place(name))


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
    return next(own.rotating for own in KINDS[mechanism.type].ports if own.name == port)


def _mechanism(mechanism: Mechanism, units: TradeUnits) -> SceneLine:
    label = _("mechanism") if mechanism.name == mechanism.type else mechanism.name
    head = mechanism.type + ("" if mechanism.shaft in ("crank", "slide") else " " + _on(mechanism.shaft))
    phase = str(units.read(mechanism.phase, "angle")) if mechanism.phase and mechanism.stroke is None else ""
    if mechanism.linkage is not None:
        return SceneLine("mechanism", label, head, "; ".join(_links(mechanism.linkage, units)), phase)
    outputs = [f"{o.name} {_mass(o.inertia, o.rotating, units)}" if o.inertia else o.name for o in mechanism.outputs]
    text = "; ".join([*_parts(mechanism.geometry, mechanism.bodies, units), *outputs])
    return SceneLine("mechanism", label, head, text, phase)


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
    """The bodies of a linkage: the greatest distance of their points, and their masses."""
    for link in linkage.links:
        spans = [((a.x - b.x) ** 2 + (a.y - b.y) ** 2) ** 0.5 for a in link.points for b in link.points]
        sizes = [str(units.read(max(spans), "length"))] if spans and max(spans) > 0.0 else []
        sizes += _masses(Body(mass=link.mass, inertia=link.inertia), units)
        yield f"{link.name} {', '.join(sizes)}".strip()


def _load(load: Load, scene: Scene, units: TradeUnits) -> str:
    """A load's law, and its window."""
    words, rest = "", message(load.model) or _law(load.law, _turns(load.on, scene), units)
    for written, value, dimension in () if units is SI else load.quantities:  # in the order of the sentence
        before, _si, rest = rest.partition(number(written))
        words += f"{before}{units.read(value, dimension)}"
    words += rest
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
        return f"{law.excerpt} {'N m' if turns else 'N'}"
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
    if scene.single_stroke is not None:
        return list(_strokes(scene.single_stroke, units))
    if scene.speed is not None:
        words = [_("crank at {speed}", speed=units.read(scene.speed, "speed", 4))]
    else:
        words = [_("crank at its own speed") if scene.depends_on_speed else _("crank at no given speed")]
    if scene.areas is None and abs(scene.cycle * DEGREES - 360) > 1e-6:
        words.append(_("cycle {angle}", angle=units.read(scene.cycle, "angle")))
    return words


def _strokes(plan: SingleStroke, units: TradeUnits) -> Iterator[str]:
    """Texts on the sequence of strokes."""
    if plan.rate is not None:
        yield _("{rate} strokes a minute", rate=number(figure(60.0 * plan.rate, most=_DIGITS)))
    if plan.idle is not None:
        yield _("{time} s at rest between strokes", time=number(figure(plan.idle, most=_DIGITS)))
    if plan.continuous > 1:
        yield _("{n} in a row", n=plan.continuous)
    yield _("stops at {angle}", angle=units.read(plan.stop_at, "angle"))


def _flywheel(scene: Scene, units: TradeUnits) -> Iterator[str]:
    """Requirements of the flywheel, or the flywheel given."""
    on = place(scene.flywheel_on)
    if scene.stroke is None and scene.limits:
        yield _("flywheel on {place} for its limits", place=on)
    elif scene.stroke is None and scene.irregularity is not None:
        eps = number(figure(scene.irregularity, most=_DIGITS))
        yield _("flywheel on {place} for irregularity {eps}", place=on, eps=eps)
    if scene.stroke is None and scene.inertia is not None:
        yield _("flywheel of {inertia} on {place}", inertia=units.read(scene.inertia, "inertia"), place=on)


# -- figures ---------------------------------------------------------------------------------------------------------


def _masses(body: Body, units: TradeUnits) -> list[str]:
    """Mass and inertia of a body, if it has them."""
    return [_mass(value, turns, units) for value, turns in ((body.mass, False), (body.inertia, True)) if value != 0.0]


def _mass(value: float, turns: bool, units: TradeUnits) -> str:
    return str(units.read(value, "inertia" if turns else "mass"))
