"""Motions as text, CSV and JSON: positions, velocities and accelerations, instant centres, and motions in time."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flywheel.motions.curves import ANGLE, POINT, WAY, MotionCurve
from flywheel.motions.driver import DRIVER
from flywheel.motions.kinematics import CurveExtreme, Kinematics
from flywheel.motions.kinetic_energy import StoredEnergy, stored_energy
from flywheel.motions.motion import Peak, Samples, Transient, sampled, scales_of
from flywheel.motions.motion import evenly as instants
from flywheel.motions.transients import estimates, of_samples
from flywheel.motions.velocities import ANYWHERE, FINITE, INFINITE, Centres, InstantCentre, InstantCentres
from flywheel.numerics.units import columns, figure, short
from flywheel.tables.rows import DEGREES, RPM, csv, encoded, paragraphs, sentences, wrapped

Array = NDArray[np.float64]

_DIGITS, _FEW_DIGITS = 6, 4
_ROWS, _MANY = 12, 40  # lines of a table where no places are asked for, and positions up to which all are shown
_QUANTITIES = ("position", "velocity", "acceleration")
_MOST_NAMED = 6
_MOST_PORTS = 6  # in the overview of a motion, which is to fit a screen


def units(motion: Kinematics, curve: MotionCurve) -> tuple[str, str, str]:
    """Units of a curve's position, velocity and acceleration: per second, or per unit of the driver."""
    per = "s" if motion.rate is not None else "m" if motion.sliding else "rad"
    return curve.unit, f"{curve.unit}/{per}", f"{curve.unit}/{per}^2"


# -- text --------------------------------------------------------------------------------------------------------------


def motion_text(motion: Kinematics, *, listed: bool = False, tables: bool = True, full: bool = True) -> str:
    """The motion as text: a block for every curve, with its extremes and dead centres over the whole motion.

    listed: true for chosen positions: all are shown, and few of them in one table for all curves.
    tables: False leaves the tables of positions out.
    full: False gives one table with the extremes of the ports instead.
    """
    resting = [
        name
        for name, curve in motion.curves.items()
        if all((np.abs(part) <= error).all() for part, error in zip(curve[4:6], curve.errors[1:], strict=True))
    ]
    moving = [name for name in motion.curves if name not in resting]
    heads = wrapped(f"{motion.scene.title or 'Machine'}: motion {motion.condition}", "")
    blocks = [[*heads, *sentences(motion.remarks)]]
    if listed and motion.q.size <= 3:
        blocks += [_at(motion, k, moving) for k in range(motion.q.size)]
    else:
        ports = [] if full else [name for name in motion.ports if name in moving] or moving
        blocks += [_overview(motion, ports)] if ports else [_curve(motion, name, listed, tables) for name in moving]
        if motion.breakpoints.size:
            places = ", ".join(_place(motion, at) for at in motion.breakpoints[:_MOST_NAMED])
            more = f" and {motion.breakpoints.size - _MOST_NAMED} more" if motion.breakpoints.size > _MOST_NAMED else ""
            blocks.append(wrapped(f"something switches at {places}{more}", ""))
    if resting and full:
        where = "; ".join(f"{name} {_standing(motion.curves[name])}" for name in resting)
        blocks.append(wrapped(f"at rest: {where}", ""))
    return paragraphs(blocks)


def _standing(curve: MotionCurve) -> str:
    values, errors = np.atleast_2d(curve.position)[:, 0], np.atleast_2d(curve.errors[0])[:, 0]
    numerals = ", ".join(figure(value, error, _DIGITS) for value, error in zip(values, errors, strict=True))
    return f"({numerals}) m" if curve.kind == POINT else f"{numerals} {_with_degrees(curve.unit, values[0], errors[0])}"


def _with_degrees(unit: str, value: float, error: float, digits: int = _DIGITS) -> str:
    """The unit of a value; of an angle in rad with its degrees behind it."""
    return f"{unit} ({figure(value * DEGREES, error * DEGREES, digits)} deg)" if unit == "rad" else unit


def _overview(motion: Kinematics, names: list[str]) -> list[str]:
    """Extremes of some curves in one table, and the options for the others."""
    listed = names[:_MOST_PORTS]
    rows = [
        (_label(motion, name) if not k else "", *row)
        for name in listed
        for k, row in enumerate(_least_and_greatest(motion, name, _FEW_DIGITS))
    ]
    unlisted = len(names) - len(listed)
    more = f"{unlisted} more port{'s' * (unlisted > 1)}, and all" if unlisted else "all"
    return [
        *columns(rows, ("", "", "least", "greatest")),
        *wrapped(
            f"{more} {len(motion.curves)} bodies, joints and points with --full; "
            f"tables with --of {_label(motion, listed[0])}",
            "",
        ),
    ]


def _label(motion: Kinematics, name: str) -> str:
    """The name of a curve; of a slide the body that it guides."""
    return next((other for other, of in motion.other_names.items() if of == name and "." not in other), name)


def _columns(motion: Kinematics, curve: MotionCurve) -> Iterator[tuple[str, Array, Array]]:
    """Heads, values and errors of a curve's figures as text: of a point both components and the amounts."""
    names = zip(
        _QUANTITIES, units(motion, curve), (curve.position, curve.velocity, curve.acceleration), curve.errors, strict=True
    )
    for name, unit, values, errors in names:
        if curve.kind != POINT:
            yield f"{name} [{unit}]", values, errors
            if unit == "rad":
                yield f"{name} [deg]", values * DEGREES, errors * DEGREES
            continue
        for axis, value, error in zip("xy", values, errors, strict=True):
            yield f"{axis if name == 'position' else f'{name[0]}_{axis}'} [{unit}]", value, error
        if name != "position":
            yield f"{name[0]} [{unit}]", np.hypot(*values), np.hypot(*errors)


def _curve(motion: Kinematics, name: str, listed: bool, tables: bool) -> list[str]:
    """A curve's block: its table, its extremes, its dead centres."""
    curve = motion.curves[name]
    # title of a curve, with the name of the body that a slide guides
    body = _label(motion, name)
    kind = {ANGLE: "angle", POINT: "place", WAY: "displacement"}[motion.curves[name].kind]
    lines = [f"{name}: {kind}{f' of {body}' if body != name else ''}"]
    if tables:
        count = motion.q.size
        every = (
            np.arange(count)
            if listed or count <= _MANY
            else np.unique(np.linspace(0, count - 1, _ROWS + 1).round().astype(int))
        )
        heads = [head for head, _, _ in _axis(motion)] + [head for head, _, _ in _columns(motion, curve)]
        cells = [*_axis(motion), *_columns(motion, curve)]
        table = [[figure(value[k], error[k], _DIGITS) for _, value, error in cells] for k in every]
        lines += columns(table, heads)
    return [*lines, *(columns(_least_and_greatest(motion, name), ("", "least", "greatest"))), *_dead_centres(motion, name)]


def _axis(motion: Kinematics) -> Iterator[tuple[str, Array, Array]]:
    """The columns of the axis: time if it is the axis, and the driver's coordinate."""
    q = (
        ("x [m]", motion.q, motion.errors["q"])
        if motion.sliding
        else ("phi [deg]", motion.q * DEGREES, motion.errors["q"] * DEGREES)
    )
    if motion.t is None:
        yield q
    elif motion.over == DRIVER:
        yield from (q, ("t [s]", motion.t, motion.errors["t"]))
    else:
        yield from (("t [s]", motion.t, motion.errors["t"]), q)


def _place(motion: Kinematics, at: float, error: float = 0.0, digits: int = _DIGITS) -> str:
    """A place on the axis."""
    if motion.over != DRIVER:
        return f"{figure(at, error, digits)} s"
    if motion.sliding:
        return f"{figure(at, error, digits)} m"
    return f"{figure(at * DEGREES, error * DEGREES, digits)} deg"


def _least_and_greatest(motion: Kinematics, name: str, digits: int = _DIGITS) -> list[tuple[str, str, str]]:
    """Quantity, least and greatest figure of a curve with their positions; one figure if they are equal."""
    unit_of = dict(zip(_QUANTITIES, units(motion, motion.curves[name]), strict=True))
    pairs: dict[str, list[CurveExtreme]] = {}
    for extreme in motion.extremes[name]:
        pairs.setdefault(" ".join(filter(None, (extreme.quantity, extreme.component))), []).append(extreme)
    table = []
    for what, (least, greatest) in pairs.items():
        unit = unit_of[least.quantity]
        rows = [
            f"{figure(one.value, one.error, digits)} {_with_degrees(unit, one.value, one.error, digits)}"
            f" at {_place(motion, one.at, one.at_error, digits)}"
            for one in (least, greatest)
        ]
        if greatest.value - least.value <= greatest.error + least.error:
            if max(abs(least.value), abs(greatest.value)) <= greatest.error + least.error:
                continue
            value, error = greatest.value, greatest.error
            rows = [f"{figure(value, error, digits)} {_with_degrees(unit, value, error, digits)} throughout", ""]
        elif least.component == "total":
            rows[0] = ""
        table.append((what, rows[0], rows[1]))
    return table


def _dead_centres(motion: Kinematics, name: str) -> list[str]:
    places, errors = motion.dead_centres[name], motion.dead_centre_errors[name]
    if not places.size:
        return []
    places_named = [_place(motion, at, error) for at, error in zip(places[:_MOST_NAMED], errors, strict=False)]
    more = f" and {places.size - _MOST_NAMED} more" if places.size > _MOST_NAMED else ""
    return wrapped(f"velocity passes zero at {', '.join(places_named)}{more}")


def _at(motion: Kinematics, k: int, names: list[str]) -> list[str]:
    """All figures at one position: a line for an angle and a slide, two for a point."""
    where = ", ".join(
        f"{head.split(' ')[0]} = {figure(value[k], error[k], 10)} {head.split('[')[1][:-1]}"
        for head, value, error in _axis(motion)
    )
    table = []
    for name in names:
        curve = motion.curves[name]
        parts = ("",) if curve.kind != POINT else ("x", "y", "total")
        for part in parts:
            cells = [f"{name} {part}".strip()]
            for quantity, unit, values, errors in zip(
                _QUANTITIES,
                units(motion, curve),
                (curve.position, curve.velocity, curve.acceleration),
                curve.errors,
                strict=True,
            ):
                value, error = (
                    (array if not part else np.asarray(np.hypot(*array)) if part == "total" else array["xy".index(part)])[k]
                    for array in (values, errors)
                )
                texts = [figure(value, error, _DIGITS), _with_degrees(unit, value, error)]
                cells += ["", ""] if part == "total" and quantity == "position" else texts
            table.append(cells)
    return [where, *columns(table, ("", "position", "", "velocity", "", "acceleration", ""))]


# -- CSV ---------------------------------------------------------------------------------------------------------------


def motion_csv(motion: Kinematics, centres: InstantCentres | None = None) -> str:
    """One row for every position: the driver's motion, then position, velocity and acceleration of every curve; SI.

    centres: instant centres at the same positions, whose columns follow.
    """
    return csv(chain(_table(motion), () if centres is None else velocities_table(centres)))


def _table(motion: Kinematics) -> Iterator[tuple[str, Array]]:
    heads = ("x [m]", "v [m/s]", "a [m/s^2]") if motion.sliding else ("phi [rad]", "omega [rad/s]", "alpha [rad/s^2]")
    if motion.t is not None:
        yield "t [s]", motion.t
    for head, values in zip(heads, (motion.q, motion.rate, motion.acceleration), strict=True):
        if values is not None:
            yield head, values
    names = _QUANTITIES if motion.rate is not None else ("position", "g", "g'")
    for title, curve in motion.curves.items():
        for name, unit, values in zip(names, units(motion, curve), curve[3:6], strict=True):
            if curve.kind != POINT:
                yield f"{title} {name} [{unit}]", values
                continue
            for axis, component in zip("xy", values, strict=True):
                yield f"{title} {name} {axis} [{unit}]", component
        if curve.kind == POINT:
            unit = units(motion, curve)[2]
            yield f"{title} {names[1]} total [{units(motion, curve)[1]}]", curve.speed
            yield f"{title} {names[2]} total [{unit}]", curve.total
            yield f"{title} {names[2]} tangential [{unit}]", curve.tangential
            yield f"{title} {names[2]} normal [{unit}]", curve.normal


# -- JSON --------------------------------------------------------------------------------------------------------------


def motion_json(motion: Kinematics, centres: InstantCentres | None = None) -> str:
    """All figures and their estimated errors as JSON, SI; null where a point stands still and has no direction."""
    data: dict[str, Any] = {
        "title": motion.scene.title,
        "reduction": motion.scene.reduction_element,
        "condition": motion.condition,
        "over": motion.over,
        "messages": list(motion.remarks),
        "t": motion.t,
        "q": motion.q,
        "rate": motion.rate,
        "acceleration": motion.acceleration,
        "breakpoints": motion.breakpoints,
        "curves": {name: _as_dict(motion, curve) for name, curve in motion.curves.items()},
        "errors": {
            **{name: None if getattr(motion, name) is None else error for name, error in motion.errors.items()},
            "breakpoints": motion.breakpoint_errors,
            "curves": {name: _errors(motion, curve) for name, curve in motion.curves.items()},
        },
    }
    if centres is not None:
        data["instant_centres"] = velocities_data(centres)
    return encoded(data, indent=2)


def _axes(array: Array) -> Any:
    return array if array.ndim == 1 else {"x": array[0], "y": array[1]}


def _as_dict(motion: Kinematics, curve: MotionCurve) -> dict[str, Any]:
    data: dict[str, Any] = {
        "kind": curve.kind,
        "units": dict(zip(_QUANTITIES, units(motion, curve), strict=True)),
        **{name: _axes(part) for name, part in zip(_QUANTITIES, curve[3:6], strict=True)},
        "acceleration_parts": {name: _axes(part) for name, part in zip(_PARTS, curve.parts, strict=True)},
    }
    if curve.kind == POINT:
        data |= {"velocity_total": curve.speed, "acceleration_total": curve.total}
        data |= {"tangential": curve.tangential, "normal": curve.normal}
    data["dead_centres"] = motion.dead_centres[curve.name]
    data["extremes"] = [
        dict(zip(CurveExtreme._fields[:5], extreme[:5], strict=True)) for extreme in motion.extremes[curve.name]
    ]
    return data


_PARTS = ("driver_acceleration", "driver_speed")


def _errors(motion: Kinematics, curve: MotionCurve) -> dict[str, Any]:
    of_velocity, of_acceleration = curve.errors[1:]
    data: dict[str, Any] = {
        **{name: _axes(part) for name, part in zip(_QUANTITIES, curve.errors, strict=True)},
        "acceleration_parts": dict.fromkeys(_PARTS, _axes(of_acceleration)),
    }
    if curve.kind == POINT:
        totals = np.hypot(*of_velocity), np.hypot(*of_acceleration)
        data |= {"velocity_total": totals[0], "acceleration_total": totals[1]}
        data |= dict.fromkeys(("tangential", "normal"), curve.direction_error)
    data["dead_centres"] = motion.dead_centre_errors[curve.name]
    data["extremes"] = [{"value": extreme.error, "at": extreme.at_error} for extreme in motion.extremes[curve.name]]
    return data


# -- instant centres ------------------------------------------------------------------------------------------------------


_PLACES = 12


def velocities_text(instant: InstantCentres) -> str:
    """The centres at every position with their errors, and the velocities of all points by centres and by coefficients."""
    blocks: list[list[str]] = []
    unit = "per unit of the driver, 1" if instant.scene.sliding else "m/rad"
    unit = unit if instant.speed is None else "m/s"
    for k in range(instant.q.size):
        for name, centres in instant.mechanisms.items():
            q = float(instant.q[k])
            at = f"phi = {figure(DEGREES * q, 1e-12, _PLACES)} deg"
            if instant.scene.sliding:
                at = f"x = {figure(1000 * q, 0.0, _PLACES)} mm"
            # a line for every two bodies: where their centre is, or along which direction, or that they do not move apart
            rows = []
            for centre in centres.centres.values():
                names = f"{centre.first} - {centre.second}"
                error = float(centre.error[k])
                kind, lasting = centre.kind[k], "always" if centre.permanent else ""
                if kind == FINITE:
                    x, y = (figure(float(value), error, _DIGITS) for value in centre.place[:, k])
                    rows.append((names, x, y, "m", f"± {short(error)} m", lasting))
                elif kind == INFINITE:
                    along = figure(DEGREES * float(centre.direction[k]), DEGREES * error, _DIGITS)
                    rows.append((names, "at infinity", f"along {along}", "deg", f"± {short(DEGREES * error)} deg", lasting))
                else:
                    rows.append((names, str(kind), "", "", "", lasting))
            blocks.append([f"{name}: instant centres at {at}", *columns(rows, ("bodies", "x", "y", "", "error", ""))])
            title = f"velocities by them, and by influence coefficients, {unit}"
            blocks.append([title, *_velocities(instant, centres, k)])
    return paragraphs(blocks)


def _velocities(instant: InstantCentres, centres: Centres, k: int) -> list[str]:
    """A line for every point that moves: x and y by the centre, by coefficients, and their difference."""
    rows = []
    for point in centres.velocities:
        error = float(point.error[k])
        by_centre, by_coefficients = point.by_centre[:, k], point.by_coefficients[:, k]
        if max(np.hypot(*by_centre), np.hypot(*by_coefficients)) <= error:
            continue
        numerals = (figure(float(value), error, _DIGITS) for value in (*by_centre, *by_coefficients))
        rows.append((point.name, *numerals, short(float(np.hypot(*(by_centre - by_coefficients)))), short(error)))
    heads = ("point", "x by centre", "y by centre", "x by g", "y by g", "apart", "error")
    return columns(rows, heads) or ["  everything stands still"]


def velocities_table(instant: InstantCentres) -> Iterator[tuple[str, Array]]:
    """Columns of a CSV: x, y, direction, rate and error of every centre, velocities of every point by its body's centre."""
    unit = "m/s" if instant.speed is not None else "1" if instant.scene.sliding else "m"
    for name, centres in instant.mechanisms.items():
        prefix = "" if len(instant.mechanisms) == 1 else f"{name}."
        for centre in centres.centres.values():
            title = f"P({prefix}{centre.first} {prefix}{centre.second})"
            yield f"{title} x [m]", centre.place[0]
            yield f"{title} y [m]", centre.place[1]
            yield f"{title} direction [rad]", centre.direction
            finite = centre.kind == FINITE
            yield f"{title} error [m]", np.where(finite, centre.error, np.nan)
            yield f"{title} direction error [rad]", np.where(finite, np.nan, centre.error)
        for point in centres.velocities:
            for axis, values in zip("xy", point.by_centre, strict=True):
                yield f"{prefix}{point.name} velocity by centre {axis} [{unit}]", values


def velocities_data(centres: InstantCentres) -> dict[str, Any]:
    """The same for JSON, SI: by mechanism a list of centres and a list of velocities, with their errors."""
    return {
        name: {
            "centres": [_centre_dict(centre, centres.rate) for centre in centres.centres.values()],
            "velocities": [
                {
                    "point": point.name,
                    "body": point.body,
                    "by_centre": {"x": point.by_centre[0], "y": point.by_centre[1]},
                    "by_coefficients": {"x": point.by_coefficients[0], "y": point.by_coefficients[1]},
                    "error": point.error,
                }
                for point in centres.velocities
            ],
        }
        for name, centres in centres.mechanisms.items()
    }


def _centre_dict(centre: InstantCentre, rate: Array) -> dict[str, Any]:
    finite, moving = centre.kind == FINITE, centre.kind != ANYWHERE
    return {
        "bodies": [centre.first, centre.second],
        "permanent": centre.permanent,
        "kind": centre.kind,
        "x": centre.place[0],
        "y": centre.place[1],
        "direction": centre.direction,
        "relative_rate": centre.rate * rate,
        "error": np.where(finite, centre.error, np.nan),
        "direction_error": np.where(moving & ~finite, centre.error, np.nan),
    }


# -- motions in time ------------------------------------------------------------------------------------------------------


def evenly(transient: Transient, points: int, breaks: bool = False) -> Samples:
    """The motion at evenly spaced times from its start to its end; on a stroke in the driver's own coordinate.

    With `breaks` also at the switches of laws, once for each side.
    """
    trail = transient.motion.trail
    assert trail is not None
    samples = sampled(trail, *instants(trail, points, breaks))
    return samples._replace(phi=samples.phi + transient.scene.origin)


def transient_text(transient: Transient) -> str:
    """Summary of a motion, at most 100 columns wide."""
    motion = transient.motion
    phi, speed = float(motion.phi[0]), _speed(transient, float(motion.omega[0]))
    at = f"{figure(phi, most=7)} m" if transient.scene.sliding else f"{figure(phi * DEGREES, most=7)} deg"
    title = wrapped(transient.scene.title, "") if transient.scene.title else []
    headline = [*title, *wrapped(f"From {at}, {speed}: {transient.ended}.", "")]
    # Work of every load, and the balance of energy.
    energy = transient.energy
    entries = [("drive", energy.drive)] if transient.scene.drive is not None else []
    rows = [*entries, *energy.works.items()]
    if energy.meshes:
        rows.append(("losses in meshes", -energy.meshes))
    scale = max((abs(value) for _, value in rows), default=0.0)
    cells = [(name, figure(value, 1e-9 * scale, 7), "J") for name, value in rows]
    cells.append(("= kinetic energy gained", figure(energy.kinetic_gained, 1e-9 * scale, 7), "J"))
    lines = ["Energy: work of", *columns(cells), f"  closes to {short(energy.residual)} of the largest energy"]
    for where, heat in (("armature", energy.copper), ("rotor", energy.rotor_heat)):
        if heat is not None:
            lines.append(f"  heat in the motor's {where}, beside it: {figure(heat, most=7)} J")
    parts = (headline, _figures(transient), lines, _motor_start(transient))
    return paragraphs((*parts, sentences(transient.messages, "")))


def _speed(transient: Transient, value: float) -> str:
    if transient.scene.sliding:
        return f"{figure(value, most=7)} m/s"
    return f"{figure(value, most=7)} rad/s ({figure(value * RPM, most=7)} rpm)"


def _figures(transient: Transient) -> list[str]:
    way = f"{figure(transient.way, most=7)} m" if transient.scene.sliding else f"{figure(transient.turns, most=7)} turns"
    rows = [
        ("time", f"{figure(transient.time, most=7)} s"),
        ("travel", way),
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
    rows.append(("estimated error", f"{short(transient.error)} of speed and travel (required {short(transient.rtol)})"))
    if transient.scene.stroke is not None or not (transient.inertia or transient.scene.has_flywheel):
        rows = [row for row in rows if row[0] != "flywheel"]
    width = max(len(name) for name, _ in rows)
    return [f"  {name.ljust(width)}  {value}" for name, value in rows]


def _peaks(transient: Transient) -> list[tuple[str, str]]:
    peaks, torque = transient.peaks, "N" if transient.scene.sliding else "N m"
    rows = [("greatest speed", f"{_speed(transient, peaks.speed.value)}{_when(peaks.speed)}")]
    force = "force" if torque == "N" else "torque"
    off = transient.setting_errors["balance"] or 0.0 if transient.scene.unknown == "drive" else 0.0
    others = (
        (f"greatest {force} of the drive", peaks.torque, torque, off),
        ("greatest power of the drive", peaks.power, "W", off * peaks.speed.value),
        ("greatest current", peaks.current, "A", 0.0),
    )
    for name, top, unit, error in others:
        if top is not None:
            rows.append((name, f"{figure(top.value, error, 7)} {unit}{_when(top, error)}"))
    return rows


def _when(top: Peak, error: float = 0.0) -> str:
    """The time of a peak, without that of one at the start or of one that is 0 within its error."""
    return f" after {figure(top.time, most=5)} s" if top.time > 0.0 and abs(top.value) > error else ""


def _motor_start(transient: Transient) -> list[str]:
    """Effect of the start on its motor, with the allowable values; empty if no current is known."""
    heat = transient.start_heat
    if heat is None or (heat.current_squared is None and not heat.times):
        return []
    rows = [("switched", " and ".join(f"after {figure(time, most=5)} s" for time in heat.times))] if heat.times else []
    rows.append(
        ("lasts", f"{figure(heat.time, most=5)} s" + ("" if heat.over else ", and is unfinished: below the rated speed"))
    )
    heats = (("winding of rotor or armature", heat.winding), ("resistors", heat.added or None), ("stator", heat.stator))
    rows += [(f"heat, {where}", f"{figure(heat, most=5)} J") for where, heat in heats if heat is not None]
    if heat.rise is not None:
        rows.append(("rise of the windings", f"{figure(heat.rise, most=4)} K from the cold motor"))
    if heat.current_squared is not None:
        rows.append(("integral of (I/I_n)^2", f"{figure(heat.current_squared, most=5)} s"))
    states = (
        ("warm", heat.allowed, heat.share, heat.starts),
        ("cold", heat.allowed_cold, heat.share_cold, heat.starts_cold),
    )
    for state, allowed, share, starts in states:
        if allowed is not None and share is not None:
            note = f"{figure(100 * share, most=4)} % of the {figure(allowed, most=5)} s that the motor bears"
            many = (
                "not even one such start" if not starts else f"{starts} such start{'' if starts == 1 else 's'} in succession"
            )
            rows.append((state, f"{note}: {many}"))
    width = max(len(name) for name, _ in rows)
    return [f"Start of the motor: {heat.title}", *(f"  {name.ljust(width)}  {value}" for name, value in rows)]


def transient_table(transient: Transient, points: int, breaks: bool = False) -> Iterator[tuple[str, Array]]:
    """Every column of the CSV with the name that heads it, its unit in brackets."""
    samples, sliding = evenly(transient, points, breaks), transient.scene.sliding
    names = (
        ("x [m]", "v [m/s]", "a [m/s^2]", "F* after losses [N]")
        if sliding
        else ("phi [rad]", "omega [rad/s]", "alpha [rad/s^2]", "M* after losses [N m]")
    )
    yield "t [s]", samples.t
    yield from zip(names, (samples.phi, samples.omega, samples.acceleration, samples.moment), strict=True)
    yield "drive [N]" if sliding else "drive torque [N m]", samples.drive
    yield "drive power [W]", samples.power
    yield "mesh losses [W]", samples.loss
    yield "kinetic energy [J]", samples.kinetic
    energies = _stores(transient, samples)
    for kind, stores in (("kinetic", energies.kinetic), ("potential", energies.potential)) if energies is not None else ():
        yield from ((f"{kind} energy {name} [J]", energy) for name, energy in stores.items())
    if samples.current is not None:
        yield "current [A]", samples.current
    circuit = transient.scene.motor.circuit if transient.scene.motor is not None else None
    for name, unit, *_place in () if circuit is None else circuit.names:
        if samples.states is not None and name != "current":
            yield f"{name.replace('_', ' ')} [{unit}]", samples.states[name]


def _stores(transient: Transient, samples: Samples, off: float = 0.0) -> StoredEnergy | None:
    """Energy of bodies, springs and weights along a motion; None if shafts twist, so that one angle is not enough.

    off: shift of position and speed, in multiples of their errors.
    """
    scene, motion, stroke = transient.scene, transient.motion, transient.scene.stroke
    if scene.compliances:
        return None
    way, fastest = scales_of(motion.phi, motion.omega, scene)
    phi = samples.phi + off * motion.error * way
    phi = phi if stroke is None else np.clip(phi, stroke.start, stroke.end)
    omega = samples.omega + off * motion.error * fastest
    return stored_energy(scene, phi, omega, flywheel=transient.inertia or 0.0)


def _stored(transient: Transient, samples: Samples) -> tuple[dict[str, Any] | None, dict[str, Any] | None]:
    """Stored energies, and estimated errors: their own, and the changes by the motion's errors to either side."""
    stores, *beside = (_stores(transient, samples, off) for off in (0.0, 1.0, -1.0))
    if stores is None:
        return None, None
    energies: dict[str, Any] = {"kinetic": stores.kinetic, "potential": stores.potential}
    errors = {
        kind: {
            name: stores.errors[name] + np.max([np.abs(getattr(other, kind)[name] - value) for other in beside], axis=0)
            for name, value in values.items()
        }
        for kind, values in energies.items()
    }
    return energies, errors


def transient_csv(transient: Transient, points: int, breaks: bool = False) -> str:
    """The motion at a number of times (see `evenly`) as CSV, SI throughout."""
    return csv(transient_table(transient, points, breaks))


def transient_json(transient: Transient, points: int, breaks: bool = False) -> str:
    """All figures of a motion as JSON, SI throughout, with the motion at `points` times (see `evenly`)."""
    errors = {**estimates(transient), "samples": of_samples(transient, points)}
    samples = evenly(transient, points, breaks)
    stores, errors["stores"] = _stored(transient, samples)
    columns = {name: column for name, column in samples._asdict().items() if name != "states"} | (samples.states or {})
    data = {**transient.as_dict(), "errors": errors, "samples": columns, "stores": stores}
    return encoded(data, indent=2)
