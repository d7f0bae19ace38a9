"""The motion of everything in a machine as text, CSV and JSON."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flywheel.motions.driver import DRIVER
from flywheel.motions.kinematics import ANGLE, POINT, WAY, Curve, Extreme, Kinematics
from flywheel.motions.velocities import InstantCentres
from flywheel.numerics.units import columns, figure
from flywheel.tables import rows as written
from flywheel.tables import velocities
from flywheel.tables.rows import DEGREES, page, sentences, wrapped

Array = NDArray[np.float64]

_DIGITS = 6
_ROWS, _MANY = 12, 40  # lines of a table where no places are asked for, and positions up to which all are shown
_QUANTITIES = ("position", "velocity", "acceleration")
_MOST_NAMED = 6


def units(found: Kinematics, curve: Curve) -> tuple[str, str, str]:
    """Units of a curve's position, velocity and acceleration: per second, or per unit of the driver."""
    per = "s" if found.rate is not None else "m" if found.sliding else "rad"
    return curve.unit, f"{curve.unit}/{per}", f"{curve.unit}/{per}^2"


# -- text --------------------------------------------------------------------------------------------------------------


def text(found: Kinematics, *, listed: bool = False, tables: bool = True) -> str:
    """The motion for reading: a block for every curve, with its extremes and dead centres over the whole motion.

    listed: the positions were asked for: all are shown, and few of them in one table for all curves.
    tables: False leaves the tables of positions out.
    """
    resting = [name for name, curve in found.curves.items() if _rests(curve)]
    moving = [name for name in found.curves if name not in resting]
    heads = wrapped(f"{found.scene.title or 'Machine'}: motion {found.condition}", "")
    blocks = [[*heads, *sentences(found.remarks)]]
    if listed and found.q.size <= 3:
        blocks += [_at(found, k, moving) for k in range(found.q.size)]
    else:
        blocks += [_curve(found, name, listed, tables) for name in moving]
        if found.breakpoints.size:
            places = ", ".join(_place(found, at) for at in found.breakpoints[:_MOST_NAMED])
            more = f" and {found.breakpoints.size - _MOST_NAMED} more" if found.breakpoints.size > _MOST_NAMED else ""
            blocks.append(wrapped(f"something switches at {places}{more}", ""))
    if resting:
        where = "; ".join(f"{name} {_standing(found.curves[name])}" for name in resting)
        blocks.append(wrapped(f"at rest: {where}", ""))
    return page(blocks)


def _rests(curve: Curve) -> bool:
    """Whether a curve stands still, as far as its errors tell."""
    return all((np.abs(part) <= error).all() for part, error in zip(curve[4:6], curve.errors[1:], strict=True))


def _standing(curve: Curve) -> str:
    values, errors = np.atleast_2d(curve.position)[:, 0], np.atleast_2d(curve.errors[0])[:, 0]
    told = ", ".join(figure(value, error, _DIGITS) for value, error in zip(values, errors, strict=True))
    return f"({told}) m" if curve.kind == POINT else f"{told} {curve.unit}"


def _columns(found: Kinematics, curve: Curve) -> Iterator[tuple[str, Array, Array]]:
    """Heads, values and errors of a curve's figures for reading: of a point both components and the amounts."""
    names = zip(
        _QUANTITIES, units(found, curve), (curve.position, curve.velocity, curve.acceleration), curve.errors, strict=True
    )
    for name, unit, values, errors in names:
        if curve.kind != POINT:
            yield f"{name} [{unit}]", values, errors
            continue
        for axis, value, error in zip("xy", values, errors, strict=True):
            yield f"{axis if name == 'position' else f'{name[0]}_{axis}'} [{unit}]", value, error
        if name != "position":
            yield f"{name[0]} [{unit}]", np.hypot(*values), np.hypot(*errors)


def _curve(found: Kinematics, name: str, listed: bool, tables: bool) -> list[str]:
    """A curve's block: its table, its extremes, its dead centres."""
    curve = found.curves[name]
    lines = [_title(found, name)]
    if tables:
        count = found.q.size
        every = (
            np.arange(count)
            if listed or count <= _MANY
            else np.unique(np.linspace(0, count - 1, _ROWS + 1).round().astype(int))
        )
        heads = [head for head, _, _ in _axis(found)] + [head for head, _, _ in _columns(found, curve)]
        cells = [*_axis(found), *_columns(found, curve)]
        table = [[figure(value[k], error[k], _DIGITS) for _, value, error in cells] for k in every]
        lines += columns(table, heads)
    return [*lines, *_extremes(found, name), *_dead_centres(found, name)]


def _title(found: Kinematics, name: str) -> str:
    """What a curve is of, with the name of the body that a slide guides."""
    bodies = [other for other, of in found.other_names.items() if of == name and "." not in other]
    kind = {ANGLE: "angle", POINT: "place", WAY: "displacement"}[found.curves[name].kind]
    return f"{name}: {kind}{f' of {bodies[0]}' if bodies else ''}"


def _axis(found: Kinematics) -> Iterator[tuple[str, Array, Array]]:
    """The columns of the axis: time where there is one and it leads, and the driver's coordinate."""
    q = (
        ("x [m]", found.q, found.errors["q"])
        if found.sliding
        else ("phi [deg]", found.q * DEGREES, found.errors["q"] * DEGREES)
    )
    if found.t is None:
        yield q
    elif found.over == DRIVER:
        yield from (q, ("t [s]", found.t, found.errors["t"]))
    else:
        yield from (("t [s]", found.t, found.errors["t"]), q)


def _place(found: Kinematics, at: float, error: float = 0.0) -> str:
    """A place on the axis."""
    if found.over != DRIVER:
        return f"{figure(at, error, _DIGITS)} s"
    if found.sliding:
        return f"{figure(at, error, _DIGITS)} m"
    return f"{figure(at * DEGREES, error * DEGREES, _DIGITS)} deg"


def _extremes(found: Kinematics, name: str) -> list[str]:
    """Least and greatest figures of a curve, with where they are; one where they are the same."""
    unit_of = dict(zip(_QUANTITIES, units(found, found.curves[name]), strict=True))
    pairs: dict[str, list[Extreme]] = {}
    for extreme in found.extremes[name]:
        pairs.setdefault(" ".join(filter(None, (extreme.quantity, extreme.component))), []).append(extreme)
    table = []
    for what, (least, greatest) in pairs.items():
        unit = unit_of[least.quantity]
        told = [
            f"{figure(one.value, one.error, _DIGITS)} {unit} at {_place(found, one.at, one.at_error)}"
            for one in (least, greatest)
        ]
        if greatest.value - least.value <= greatest.error + least.error:
            if max(abs(least.value), abs(greatest.value)) <= greatest.error + least.error:
                continue
            told = [f"{figure(greatest.value, greatest.error, _DIGITS)} {unit} throughout", ""]
        elif least.component == "total":
            told[0] = ""
        table.append((what, *told))
    return columns(table, ("", "least", "greatest"))


def _dead_centres(found: Kinematics, name: str) -> list[str]:
    places, errors = found.dead_centres[name], found.dead_centre_errors[name]
    if not places.size:
        return []
    shown = [_place(found, at, error) for at, error in zip(places[:_MOST_NAMED], errors, strict=False)]
    more = f" and {places.size - _MOST_NAMED} more" if places.size > _MOST_NAMED else ""
    return wrapped(f"velocity passes zero at {', '.join(shown)}{more}")


def _at(found: Kinematics, k: int, names: list[str]) -> list[str]:
    """Everything at one position: a line for an angle and a slide, two for a point."""
    where = ", ".join(
        f"{head.split(' ')[0]} = {figure(value[k], error[k], 10)} {head.split('[')[1][:-1]}"
        for head, value, error in _axis(found)
    )
    table = []
    for name in names:
        curve = found.curves[name]
        parts = ("",) if curve.kind != POINT else ("x", "y", "total")
        for part in parts:
            cells = [f"{name} {part}".strip()]
            for quantity, unit, values, errors in zip(
                _QUANTITIES,
                units(found, curve),
                (curve.position, curve.velocity, curve.acceleration),
                curve.errors,
                strict=True,
            ):
                value, error = (_part(array, part)[k] for array in (values, errors))
                cells += ["", ""] if part == "total" and quantity == "position" else [figure(value, error, _DIGITS), unit]
            table.append(cells)
    return [where, *columns(table, ("", "position", "", "velocity", "", "acceleration", ""))]


def _part(array: Array, part: str) -> Array:
    return array if not part else np.asarray(np.hypot(*array)) if part == "total" else array["xy".index(part)]


# -- CSV ---------------------------------------------------------------------------------------------------------------


def csv(found: Kinematics, centres: InstantCentres | None = None) -> str:
    """One row for every position: the driver's motion, then position, velocity and acceleration of every curve; SI.

    centres: instant centres at the same positions, whose columns follow.
    """
    return written.csv(chain(_table(found), () if centres is None else velocities.table(centres)))


def _table(found: Kinematics) -> Iterator[tuple[str, Array]]:
    heads = ("x [m]", "v [m/s]", "a [m/s^2]") if found.sliding else ("phi [rad]", "omega [rad/s]", "alpha [rad/s^2]")
    if found.t is not None:
        yield "t [s]", found.t
    for head, values in zip(heads, (found.q, found.rate, found.acceleration), strict=True):
        if values is not None:
            yield head, values
    names = _QUANTITIES if found.rate is not None else ("position", "g", "g'")
    for title, curve in found.curves.items():
        for name, unit, values in zip(names, units(found, curve), curve[3:6], strict=True):
            if curve.kind != POINT:
                yield f"{title} {name} [{unit}]", values
                continue
            for axis, component in zip("xy", values, strict=True):
                yield f"{title} {name} {axis} [{unit}]", component
        if curve.kind == POINT:
            unit = units(found, curve)[2]
            yield f"{title} {names[1]} total [{units(found, curve)[1]}]", curve.speed
            yield f"{title} {names[2]} total [{unit}]", curve.total
            yield f"{title} {names[2]} tangential [{unit}]", curve.tangential
            yield f"{title} {names[2]} normal [{unit}]", curve.normal


# -- JSON --------------------------------------------------------------------------------------------------------------


def json(found: Kinematics, centres: InstantCentres | None = None) -> str:
    """All figures and their estimated errors as JSON, SI; null where a point stands still and has no direction."""
    data: dict[str, Any] = {
        "title": found.scene.title,
        "reduction": found.scene.reduction_element,
        "condition": found.condition,
        "over": found.over,
        "messages": list(found.remarks),
        "t": found.t,
        "q": found.q,
        "rate": found.rate,
        "acceleration": found.acceleration,
        "breakpoints": found.breakpoints,
        "curves": {name: _as_dict(found, curve) for name, curve in found.curves.items()},
        "errors": {
            **{name: None if getattr(found, name) is None else error for name, error in found.errors.items()},
            "breakpoints": found.breakpoint_errors,
            "curves": {name: _errors(found, curve) for name, curve in found.curves.items()},
        },
    }
    if centres is not None:
        data["instant_centres"] = velocities.data(centres)
    return written.encoded(data, indent=2)


def _axes(array: Array) -> Any:
    return array if array.ndim == 1 else {"x": array[0], "y": array[1]}


def _as_dict(found: Kinematics, curve: Curve) -> dict[str, Any]:
    data: dict[str, Any] = {
        "kind": curve.kind,
        "units": dict(zip(_QUANTITIES, units(found, curve), strict=True)),
        **{name: _axes(part) for name, part in zip(_QUANTITIES, curve[3:6], strict=True)},
        "acceleration_parts": {name: _axes(part) for name, part in zip(_PARTS, curve.parts, strict=True)},
    }
    if curve.kind == POINT:
        data |= {"velocity_total": curve.speed, "acceleration_total": curve.total}
        data |= {"tangential": curve.tangential, "normal": curve.normal}
    data["dead_centres"] = found.dead_centres[curve.name]
    data["extremes"] = [_extreme(extreme) for extreme in found.extremes[curve.name]]
    return data


_PARTS = ("driver_acceleration", "driver_speed")


def _extreme(extreme: Extreme) -> dict[str, Any]:
    named = extreme._asdict()
    return {name: named[name] for name in ("quantity", "component", "which", "value", "at")}


def _errors(found: Kinematics, curve: Curve) -> dict[str, Any]:
    of_velocity, of_acceleration = curve.errors[1:]
    data: dict[str, Any] = {
        **{name: _axes(part) for name, part in zip(_QUANTITIES, curve.errors, strict=True)},
        "acceleration_parts": dict.fromkeys(_PARTS, _axes(of_acceleration)),
    }
    if curve.kind == POINT:
        totals = np.hypot(*of_velocity), np.hypot(*of_acceleration)
        data |= {"velocity_total": totals[0], "acceleration_total": totals[1]}
        data |= dict.fromkeys(("tangential", "normal"), curve.direction_error)
    data["dead_centres"] = found.dead_centre_errors[curve.name]
    data["extremes"] = [{"value": extreme.error, "at": extreme.at_error} for extreme in found.extremes[curve.name]]
    return data
