"""The machine as it was read, in the units of the trade."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

from flywheel.mechanisms import KINDS
from flywheel.numerics.expressions import Expression
from flywheel.numerics.units import figure
from flywheel.scene.linkage import Linkage, offered
from flywheel.scene.scene import Body, Law, Load, Mechanism, Scene, Table
from flywheel.tables.rows import DEGREES, RPM, wrapped

_MOST = 6  # rows of one kind
_DIGITS = 6


def scene_rows(scene: Scene) -> list[str]:
    """What the program understood, a row for each part of the machine."""
    rows = list(_rows(scene))
    width = max((len(name) for name, _ in rows), default=0)
    lines = ["The machine as it was read"] if rows else []
    for name, told in rows:
        head = f"  {name.ljust(width)}  "
        lines += wrapped(told, " " * len(head), head)
    return lines


def _rows(scene: Scene) -> Iterator[tuple[str, str]]:
    if scene.areas is not None:
        values = ", ".join(figure(value, most=_DIGITS) for value in scene.areas.values[: 2 * _MOST])
        more = f"... ({len(scene.areas.values)})" if len(scene.areas.values) > 2 * _MOST else ""
        yield "areas", f"{values}{more}, times {figure(scene.areas.scale, most=_DIGITS)} J"
    yield from _few(("mechanism" if m.name == m.type else m.name, _mechanism(m)) for m in scene.mechanisms)
    shafts = [(name, ratio) for name, ratio in scene.shafts.items() if name not in ("crank", "slide")]
    yield from _few((f"shaft {name}", _shaft(name, ratio, scene)) for name, ratio in shafts)
    yield from _few(("inertia", f"{_mass(i.value, _turns(i.on, scene))} on {i.on}") for i in scene.inertias)
    yield from _few(("load", f"on {load.on}: {_load(load, scene)}") for load in scene.loads)
    yield from _few(("spring", f"on {s.on}: {_per(s.stiffness, _turns(s.on, scene), '')}") for s in scene.springs)
    yield from _few(("damper", f"on {d.on}: {_per(d.coefficient, _turns(d.on, scene), ' s')}") for d in scene.dampers)
    if scene.drive is not None:
        yield "drive", f"on {scene.drive.on}: {_load(scene.drive, scene)}"
    yield "runs", _regime(scene)


def _few(rows: Iterable[tuple[str, str]]) -> Iterator[tuple[str, str]]:
    """The first rows of a kind, and how many more there are."""
    found = list(rows)
    yield from found[:_MOST]
    if len(found) > _MOST:
        yield "", f"and {len(found) - _MOST} more"


def _turns(place: str, scene: Scene) -> bool:
    """Whether a shaft or a port rotates."""
    if place in scene.shafts:
        return place != "slide"
    name, _, port = place.rpartition(".")
    mechanism = next(m for m in scene.mechanisms if m.name == name)
    if mechanism.linkage is not None:
        return offered(mechanism.linkage, [point.name for point in mechanism.points])[port]
    if mechanism.outputs:
        return next(output.rotating for output in mechanism.outputs if output.name == port)
    return next(known.rotating for known in KINDS[mechanism.type].ports if known.name == port)


def _mechanism(mechanism: Mechanism) -> str:
    head = mechanism.type + ("" if mechanism.shaft in ("crank", "slide") else f" on {mechanism.shaft}")
    if mechanism.phase and mechanism.stroke is None:
        head += f", phase {_angle(mechanism.phase)}"
    if mechanism.linkage is not None:
        return f"{head}: {'; '.join(_links(mechanism.linkage))}"
    outputs = [f"{o.name} {_mass(o.inertia, o.rotating)}" if o.inertia else o.name for o in mechanism.outputs]
    return f"{head}: {'; '.join([*_parts(mechanism.geometry, mechanism.bodies), *outputs])}"


def _parts(geometry: Mapping[str, float], bodies: Mapping[str, Body]) -> Iterator[str]:
    """Lengths, angles and masses of a mechanism, part by part."""
    parts = dict.fromkeys([*(path.partition(".")[0] for path in geometry), *bodies])
    for part in parts:
        sizes = []
        for path, value in geometry.items():
            owner, _, key = path.partition(".")
            if owner == part and (value or key == "length"):
                size = _angle(value) if key in ("angle", "direction") else _length(value)
                sizes.append(size if key == "length" else f"{key.replace('_', ' ')} {size}")
        body = bodies.get(part, Body())
        sizes += [_mass(body.mass, False)] * (body.mass != 0.0) + [_mass(body.inertia, True)] * (body.inertia != 0.0)
        if sizes:
            yield f"{part.replace('_', ' ')} {', '.join(sizes)}"


def _links(linkage: Linkage) -> Iterator[str]:
    """The bodies of a linkage: how far their points lie apart at most, and what they weigh."""
    for link in linkage.links:
        spans = [((a.x - b.x) ** 2 + (a.y - b.y) ** 2) ** 0.5 for a in link.points for b in link.points]
        sizes = [_length(max(spans))] if spans and max(spans) > 0.0 else []
        sizes += [_mass(link.mass, False)] * (link.mass != 0.0) + [_mass(link.inertia, True)] * (link.inertia != 0.0)
        yield f"{link.name} {', '.join(sizes)}".strip()


def _shaft(name: str, ratio: float, scene: Scene) -> str:
    words = [f"{figure(ratio, most=_DIGITS)} turns to one of the crank"]
    if name in scene.efficiencies:
        words.append(f"efficiency {figure(100 * scene.efficiencies[name], most=_DIGITS)} %")
    if name in scene.compliances:
        words.append(f"stiffness {figure(scene.compliances[name].stiffness, most=_DIGITS)} N m/rad")
    return ", ".join(words)


def _load(load: Load, scene: Scene) -> str:
    """A load's law, and when it acts."""
    unit = "N m" if _turns(load.on, scene) else "N"
    words = load.model or _law(load.law, unit)
    if load.start is not None and load.end is not None:
        place = _length if load.once and scene.reduction_element == "slide" else _angle
        words += f" from {place(load.start)} to {place(load.end)}"
    if load.sense:
        words += f" while v {'>' if load.sense > 0 else '<'} 0"
    return words


def _law(law: Law | None, unit: str) -> str:
    if law is None:
        return f"balance, a constant {'torque' if unit == 'N m' else 'force'}"
    if isinstance(law, Expression):
        return f"{law.shown} {unit}"
    if isinstance(law, Table):
        return f"{law.angle.size} rows, {_force(float(law.value.min()), unit)} to {_force(float(law.value.max()), unit)}"
    return _force(law, unit)


def _regime(scene: Scene) -> str:
    if scene.stroke is not None:
        place, unit = (_length, "m/s") if scene.stroke.sliding else (_angle, "rad/s")
        ends = f"from {place(scene.stroke.start)} to {place(scene.stroke.end)}"
        return ends if scene.stroke.speed is None else f"{ends} at {figure(scene.stroke.speed, most=_DIGITS)} {unit}"
    own = "crank at its own speed" if scene.depends_on_speed else "crank at no given speed"
    words = [own if scene.speed is None else f"crank at {figure(scene.speed * RPM, most=4)} rpm"]
    if scene.areas is None and abs(scene.cycle * DEGREES - 360) > 1e-6:
        words.append(f"cycle {_angle(scene.cycle)}")
    if scene.irregularity is not None:
        words.append(f"flywheel on {scene.flywheel_on} for irregularity {figure(scene.irregularity, most=_DIGITS)}")
    if scene.inertia is not None:
        words.append(f"flywheel of {_mass(scene.inertia, True)} on {scene.flywheel_on}")
    return ", ".join(words)


# -- figures ---------------------------------------------------------------------------------------------------------


def _length(value: float) -> str:
    """A length in mm below a metre, in m above.

    >>> _length(0.48), _length(80.0)
    ('480 mm', '80 m')
    """
    return f"{figure(value, most=_DIGITS)} m" if abs(value) >= 1.0 else f"{figure(1000 * value, most=_DIGITS)} mm"


def _angle(value: float) -> str:
    return f"{figure(value * DEGREES, most=_DIGITS)} deg"


def _mass(value: float, turns: bool) -> str:
    return f"{figure(value, most=_DIGITS)} {'kg m²' if turns else 'kg'}"


def _force(value: float, unit: str) -> str:
    """A force or torque, from ten thousand on in kN or kN m.

    >>> _force(-40.0, "N"), _force(40_000.0, "N m")
    ('-40 N', '40 kN m')
    """
    return f"{figure(value / 1000, most=_DIGITS)} k{unit}" if abs(value) >= 1e4 else f"{figure(value, most=_DIGITS)} {unit}"


def _per(value: float, turns: bool, time: str) -> str:
    """A stiffness, or with a time a damping."""
    return f"{figure(value, most=_DIGITS)} {f'N m{time}/rad' if turns else f'N{time}/m'}"
