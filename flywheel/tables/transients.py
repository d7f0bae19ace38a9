"""A motion that was followed, for readers: a text with its energy balance, CSV and JSON of the motion itself."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flywheel.motions.kinetic_energy import StoredEnergy, stored_energy
from flywheel.motions.transients import Peak, Samples, Transient, estimates, of_samples, sampled
from flywheel.motions.transients import evenly as instants
from flywheel.numerics.units import columns, figure, short
from flywheel.tables import rows as written
from flywheel.tables.rows import DEGREES, RPM, page, sentences, wrapped

Array = NDArray[np.float64]


def evenly(transient: Transient, points: int, breaks: bool = False) -> Samples:
    """The motion at so many times, evenly from its start to its end; on a stroke in the driver's own coordinate.

    With `breaks` also where laws switch, at the same time once for each side.
    """
    trail = transient.motion.trail
    assert trail is not None
    found = sampled(trail, *instants(trail, points, breaks))
    return found._replace(phi=found.phi + transient.scene.origin)


def text(transient: Transient) -> str:
    """What a designer asks of a motion, at most 100 columns wide."""
    parts = (_headline(transient), _figures(transient), _energy(transient), _motor_start(transient))
    return page((*parts, sentences(transient.messages, "")))


def _sliding(transient: Transient) -> bool:
    return transient.scene.reduction_element == "slide"


def _speed(transient: Transient, value: float) -> str:
    if _sliding(transient):
        return f"{figure(value, most=7)} m/s"
    return f"{figure(value, most=7)} rad/s ({figure(value * RPM, most=7)} rpm)"


def _place(transient: Transient, phi: float) -> str:
    return f"{figure(phi, most=7)} m" if _sliding(transient) else f"{figure(phi * DEGREES, most=7)} deg"


def _headline(transient: Transient) -> list[str]:
    title = wrapped(transient.scene.title, "") if transient.scene.title else []
    motion = transient.motion
    start = f"From {_place(transient, float(motion.phi[0]))}, {_speed(transient, float(motion.omega[0]))}"
    return [*title, *wrapped(f"{start}: {transient.ended}.", "")]


def _figures(transient: Transient) -> list[str]:
    way = f"{figure(transient.way, most=7)} m" if _sliding(transient) else f"{figure(transient.turns, most=7)} turns"
    rows = [
        ("time", f"{figure(transient.time, most=7)} s"),
        ("way", way),
        ("speed at the end", _speed(transient, transient.omega)),
    ]
    if transient.regime_speed is not None:
        rows.append(("regime, mean speed over time", _speed(transient, transient.regime_speed)))
        when = transient.time_to_regime
        slows = float(transient.motion.omega[0]) > 0.0 and transient.peaks.speed.time == 0.0
        if when != 0.0 and not slows:
            rows.append(("first at 95 % of it", "not reached" if when is None else f"after {figure(when, most=7)} s"))
    rows += _peaks(transient)
    rows.append(("flywheel", f"{figure(transient.inertia, most=7)} kg m^2 on {transient.scene.flywheel_on}"))
    rows.append(("estimated error", f"{short(transient.error)} of speed and way (asked {short(transient.rtol)})"))
    if transient.scene.stroke is not None or not (transient.inertia or transient.scene.has_flywheel):
        rows = [row for row in rows if row[0] != "flywheel"]
    width = max(len(name) for name, _ in rows)
    return [f"  {name.ljust(width)}  {value}" for name, value in rows]


def _peaks(transient: Transient) -> list[tuple[str, str]]:
    peaks, torque = transient.peaks, "N" if _sliding(transient) else "N m"
    rows = [("greatest speed", f"{_speed(transient, peaks.speed.value)}{_when(peaks.speed)}")]
    force = "force" if torque == "N" else "torque"
    others = (
        (f"greatest {force} of the drive", peaks.torque, torque),
        ("greatest power of the drive", peaks.power, "W"),
        ("greatest current", peaks.current, "A"),
    )
    rows += [(name, f"{figure(top.value, most=7)} {unit}{_when(top)}") for name, top, unit in others if top is not None]
    return rows


def _when(top: Peak) -> str:
    return f" after {figure(top.time, most=5)} s" if top.time > 0.0 else ""


def _energy(transient: Transient) -> list[str]:
    """Work of everything, and what it has become."""
    energy = transient.energy
    given = [("drive", energy.drive)] if transient.scene.drive is not None else []
    rows = [*given, *energy.works.items()]
    if energy.meshes:
        rows.append(("losses in meshes", -energy.meshes))
    scale = max((abs(value) for _, value in rows), default=0.0)
    cells = [(name, figure(value, 1e-9 * scale, 7), "J") for name, value in rows]
    cells.append(("= kinetic energy gained", figure(energy.kinetic_gained, 1e-9 * scale, 7), "J"))
    lines = ["Energy: work of", *columns(cells), f"  closes to {short(energy.residual)} of the largest energy"]
    for where, heat in (("armature", energy.copper), ("rotor", energy.rotor_heat)):
        if heat is not None:
            lines.append(f"  heat in the motor's {where}, beside it: {figure(heat, most=7)} J")
    return lines


def _motor_start(transient: Transient) -> list[str]:
    """What the start does to its motor, beside what it bears; nothing of a motor of whose current nothing is known."""
    found = transient.start_heat
    if found is None or (found.current_squared is None and not found.times):
        return []
    rows = [("switched", " and ".join(f"after {figure(time, most=5)} s" for time in found.times))] if found.times else []
    rows.append(
        ("lasts", f"{figure(found.time, most=5)} s" + ("" if found.over else ", and is not over: below the rated speed"))
    )
    heats = (("winding of rotor or armature", found.winding), ("resistors", found.added or None), ("stator", found.stator))
    rows += [(f"heat, {where}", f"{figure(heat, most=5)} J") for where, heat in heats if heat is not None]
    if found.current_squared is not None:
        rows.append(("integral of (I/I_n)^2", f"{figure(found.current_squared, most=5)} s"))
    states = (
        ("warm", found.allowed, found.share, found.starts),
        ("cold", found.allowed_cold, found.share_cold, found.starts_cold),
    )
    for state, allowed, share, starts in states:
        if allowed is not None and share is not None:
            told = f"{figure(100 * share, most=4)} % of the {figure(allowed, most=5)} s that the motor bears"
            many = "not one such start" if not starts else f"{starts} such start{'' if starts == 1 else 's'} in turn"
            rows.append((state, f"{told}: {many}"))
    width = max(len(name) for name, _ in rows)
    return [f"Start of the motor: {found.title}", *(f"  {name.ljust(width)}  {value}" for name, value in rows)]


def table(transient: Transient, points: int, breaks: bool = False) -> Iterator[tuple[str, Array]]:
    """Every column of the CSV with the name that heads it, its unit in brackets."""
    found, sliding = evenly(transient, points, breaks), _sliding(transient)
    names = (
        ("x [m]", "v [m/s]", "a [m/s^2]", "F* after losses [N]")
        if sliding
        else ("phi [rad]", "omega [rad/s]", "alpha [rad/s^2]", "M* after losses [N m]")
    )
    yield "t [s]", found.t
    yield from zip(names, (found.phi, found.omega, found.acceleration, found.moment), strict=True)
    yield "drive [N]" if sliding else "drive torque [N m]", found.drive
    yield "drive power [W]", found.power
    yield "mesh losses [W]", found.loss
    yield "kinetic energy [J]", found.kinetic
    held = _stores(transient, found)
    for kind, stores in (("kinetic", held.kinetic), ("potential", held.potential)) if held is not None else ():
        yield from ((f"{kind} energy {name} [J]", energy) for name, energy in stores.items())
    if found.current is not None:
        yield "current [A]", found.current
    circuit = transient.scene.motor.circuit if transient.scene.motor is not None else None
    for name, unit, _ in () if circuit is None else circuit.names:
        if found.states is not None and name != "current":
            yield f"{name.replace('_', ' ')} [{unit}]", found.states[name]


def _stores(transient: Transient, found: Samples, off: float = 0.0) -> StoredEnergy | None:
    """What bodies, springs and weights hold along a motion; None where shafts twist, so that one angle does not tell.

    off: by how many of its errors position and speed are taken aside.
    """
    scene, motion, stroke = transient.scene, transient.motion, transient.scene.stroke
    if scene.compliances:
        return None
    way = max(float(np.ptp(motion.phi)), scene.cycle / (2 * np.pi))
    phi = found.phi + off * motion.error * way
    phi = phi if stroke is None else np.clip(phi, stroke.start, stroke.end)
    omega = found.omega + off * motion.error * float(np.abs(motion.omega).max())
    return stored_energy(scene, phi, omega, flywheel=transient.inertia or 0.0)


def _stored(transient: Transient, samples: Samples) -> tuple[dict[str, Any] | None, dict[str, Any] | None]:
    """What the stores hold, and estimated errors: their own, and what those of the motion make of it to either side."""
    held, *beside = (_stores(transient, samples, off) for off in (0.0, 1.0, -1.0))
    if held is None:
        return None, None
    found: dict[str, Any] = {"kinetic": held.kinetic, "potential": held.potential}
    errors = {
        kind: {
            name: held.errors[name] + np.max([np.abs(getattr(other, kind)[name] - value) for other in beside], axis=0)
            for name, value in values.items()
        }
        for kind, values in found.items()
    }
    return found, errors


def csv(transient: Transient, points: int, breaks: bool = False) -> str:
    """The motion at so many times (see `evenly`) as CSV, SI throughout."""
    return written.csv(table(transient, points, breaks))


def json(transient: Transient, points: int, breaks: bool = False) -> str:
    """Everything of a motion, with the motion itself at so many times (see `evenly`), as JSON, SI throughout."""
    errors = {**estimates(transient), "samples": of_samples(transient, points)}
    samples = evenly(transient, points, breaks)
    stores, errors["stores"] = _stored(transient, samples)
    columns = {name: column for name, column in samples._asdict().items() if name != "states"} | (samples.states or {})
    data = {**transient.as_dict(), "errors": errors, "samples": columns, "stores": stores}
    return written.encoded(data, indent=2)
