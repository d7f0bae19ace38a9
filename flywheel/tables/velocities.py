"""Instant centres of a scene's mechanisms, and velocities by them, as text, columns and data."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flywheel.mechanisms.linkages.instant_centres import ANYWHERE, FINITE, INFINITE, InstantCentre
from flywheel.motions.velocities import Centres, InstantCentres
from flywheel.numerics.units import columns, figure, short
from flywheel.tables.rows import DEGREES, page

Array = NDArray[np.float64]

_DIGITS, _PLACES = 6, 12


def text(found: InstantCentres) -> str:
    """For every position the centres, with their errors, and the velocities of all points by them and by coefficients."""
    blocks: list[list[str]] = []
    for k in range(found.q.size):
        for name, centres in found.mechanisms.items():
            title = f"{name}: instant centres at {_position(found, k)}"
            blocks.append([title, *_listed(centres, k)])
            blocks.append(
                [f"velocities by them, and by influence coefficients, {_unit(found)}", *_velocities(found, centres, k)]
            )
    return page(blocks)


def _position(found: InstantCentres, k: int) -> str:
    if found.scene.reduction_element == "slide":
        return f"x = {figure(1000 * float(found.q[k]), 0.0, _PLACES)} mm"
    return f"phi = {figure(DEGREES * float(found.q[k]), 1e-12, _PLACES)} deg"


def _unit(found: InstantCentres) -> str:
    if found.speed is not None:
        return "m/s"
    return "per unit of the driver, 1" if found.scene.reduction_element == "slide" else "m/rad"


def _listed(centres: Centres, k: int) -> list[str]:
    """A line for every two bodies: where their centre is, or along which direction, or that they do not move apart."""
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
    return columns(rows, ("bodies", "x", "y", "", "error", ""))


def _velocities(found: InstantCentres, centres: Centres, k: int) -> list[str]:
    """A line for every point that moves: x and y by the centre, by coefficients, and how far they are apart."""
    rows = []
    for point in centres.velocities:
        error = float(point.error[k])
        by_centre, by_coefficients = point.by_centre[:, k], point.by_coefficients[:, k]
        if max(np.hypot(*by_centre), np.hypot(*by_coefficients)) <= error:
            continue
        told = (figure(float(value), error, _DIGITS) for value in (*by_centre, *by_coefficients))
        rows.append((point.name, *told, short(float(np.hypot(*(by_centre - by_coefficients)))), short(error)))
    heads = ("point", "x by centre", "y by centre", "x by g", "y by g", "apart", "error")
    return columns(rows, heads) or ["  everything stands still"]


def table(found: InstantCentres) -> Iterator[tuple[str, Array]]:
    """Columns of a CSV: x, y, direction, rate and error of every centre, velocities of every point by its body's centre."""
    unit = "m/s" if found.speed is not None else "1" if found.scene.reduction_element == "slide" else "m"
    for name, centres in found.mechanisms.items():
        prefix = "" if len(found.mechanisms) == 1 else f"{name}."
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


def data(found: InstantCentres) -> dict[str, Any]:
    """The same for JSON, SI: by mechanism a list of centres and a list of velocities, with their errors."""
    return {
        name: {
            "centres": [_as_dict(centre, centres.rate) for centre in centres.centres.values()],
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
        for name, centres in found.mechanisms.items()
    }


def _as_dict(centre: InstantCentre, rate: Array) -> dict[str, Any]:
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
