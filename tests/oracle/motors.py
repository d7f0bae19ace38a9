"""Motors from their data: torque at a speed as an expression of omega, or with states of their own."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq

from tests.oracle.drive_lines import value


class Motor(NamedTuple):
    """A motor with states: its torque and their rates over speed, states and time, and their sizes.

    `steady` are the states that stay at a constant speed; `unfed` those of one that is switched on at rest, or, at a speed
    above 0, runs there steadily.
    """

    count: int
    torque: Callable[[float, Sequence[float], float], float]
    rates: Callable[[float, Sequence[float], float], list[float]]
    sizes: tuple[float, ...]
    steady: Callable[[float], list[float]]

    def unfed(self, omega: float) -> list[float]:
        """States at a start with a speed (rad/s, of its shaft)."""
        return self.steady(omega) if omega else [0.0] * self.count


def hertz(raw: Any) -> float:
    """A frequency."""
    return float(str(raw).removesuffix("Hz"))


def volts(raw: Any) -> float:
    """A number whose unit is written in full."""
    return float(str(raw).split()[0])


def motor(row: dict[str, Any]) -> str | Motor:
    """The motor of a scene's table."""
    result = KINDS[row["type"]](row)
    if "start" in row and isinstance(result, str):
        return started(row, result)
    return result


def constant(row: dict[str, Any]) -> str:
    """The same torque at any speed."""
    return repr(value(row["torque"]))


def line(row: dict[str, Any]) -> str:
    """T0 - c omega by two of its points."""
    if "no_load_speed" in row and "starting_torque" not in row:
        idle, speed = value(row["no_load_speed"]), value(row["speed"])
        torque = value(row["torque"]) if "torque" in row else value(row["power"]) / speed
        slope = torque / (idle - speed)
        return f"{slope * idle!r} - {slope!r}*omega"
    start = value(row["starting_torque"])
    slope = value(row["slope"]) if "slope" in row else start / value(row["no_load_speed"])
    return f"{start!r} - {slope!r}*omega"


def table(row: dict[str, Any]) -> str:
    """Straight between the rows, and straight on beyond them."""
    x, y = row["speed"], row["torque"]
    text = ""
    for k in range(len(x) - 1):
        slope = (y[k + 1] - y[k]) / (x[k + 1] - x[k])
        text += f"({y[k]!r} + {slope!r}*(omega - {x[k]!r}))"
        text += f" if omega < {x[k + 1]!r} else " if k < len(x) - 2 else ""
    return text


def kloss(row: dict[str, Any]) -> str:
    """Kloss's curve; with the locked rotor's torque what it misses there, faded out up to breakdown."""
    if row.get("electrical") == "two-axis":
        return circuit_torque(row)
    speed, most = value(row["speed"]), float(row["breakdown_ratio"])
    rated, sync = value(row["power"]) / speed, 4 * math.pi * hertz(row["frequency"]) / row["poles"]
    steep = (1 - speed / sync) * (most + math.sqrt(most * most - 1))
    fed = inverter(row)
    field, flux = (sync, 1.0) if fed is None else fed[:2]
    s = f"({field / sync!r} - omega/{sync!r})"
    text = f"{2 * most * rated * steep!r}*{s}/({s}**2 + {steep**2!r})"
    if "starting_torque" in row:
        missed = value(row["starting_torque"]) * rated - 2 * most * rated * steep / (1 + steep * steep)
        x = f"min(1, max(0, ({s} - {steep!r})/{1 - steep!r}))"  # backwards it misses as much as at rest
        text += f" + {missed!r}*{x}**2*(3 - 2*{x})"
    if fed is None:
        return text
    text, limit, ub = f"{flux**2!r}*({text})", fed[3], steep * sync
    if limit is None:
        return text
    corner = ub
    if limit < flux**2 * most * rated:
        share = limit / (flux**2 * most * rated)
        corner = ub * (1 - math.sqrt(1 - share**2)) / share
    top = 2 * most * rated * ub
    driven, braked = (
        f"min({limit!r}, {top!r}*{u}/({u}**2 + {ub**2!r})*min(1, {fed[2]!r}/max(1e-9, omega {sign} {u}))**2)"
        for sign, u in (("+", f"min({ub!r}, {field!r} - omega)"), ("-", f"min({ub!r}, omega - {field!r})"))
    )
    return f"({driven} if omega < {field - corner!r} else {text} if omega < {field + corner!r} else -{braked})"


def inverter(row: dict[str, Any]) -> tuple[float, float, float, float | None] | None:
    """Speed of the field, flux, speed from which that falls, and greatest torque of an induction motor on an inverter."""
    if "inverter" not in row:
        return None
    own, mains = row["inverter"], hertz(row["frequency"])
    weak, pairs = hertz(own.get("field_weakening_from", row["frequency"])), row["poles"] / 2
    f, limit = hertz(own["frequency"]), own.get("torque_limit")
    most = None if limit is None else value(limit) * value(row["power"]) / value(row["speed"])
    assert mains > 0
    return 2 * math.pi * f / pairs, min(1.0, weak / f), 2 * math.pi * weak / pairs, most


def slip_heat(row: dict[str, Any]) -> Callable[[float, float], float]:
    """Heat (W) in the rotor of an induction motor over its torque and speed: torque times slip speed."""
    sync, fed = 4 * math.pi * hertz(row["frequency"]) / row["poles"], inverter(row)
    if fed is None:
        return lambda torque, speed: torque * (sync - speed)
    speed, most = value(row["speed"]), float(row["breakdown_ratio"])
    top = most * value(row["power"]) / speed
    ub = (sync - speed) * (most + math.sqrt(most * most - 1))

    def heat(torque: float, omega: float) -> float:
        way = math.copysign(1.0, torque)

        def lacking(u: float) -> float:
            weak = min(1.0, fed[2] / max(omega + way * u, 1e-9))
            return weak**2 * 2 * top * u * ub / (u * u + ub * ub) - abs(torque)

        slip = way * (fed[0] - omega)
        gap = lacking(slip)
        if fed[3] is not None and abs(gap) > 1e-7 * top:  # held by its limit, at another frequency
            most_slip = min(ub, slip)
            slip = brentq(lacking, 0.0, most_slip, xtol=1e-13) if lacking(most_slip) > 1e-9 * top else most_slip
        elif (
            fed[3] is not None and (rise := lacking(slip + 1e-5 * ub) - gap) > 1e-6 * top
        ):  # or just so, where the limit begins
            slip -= gap / rise * 1e-5 * ub
        return abs(torque) * slip

    return heat


def rated(row: dict[str, Any]) -> tuple[float, float]:
    """Rated torque (N m) and heat of the rotor (W): with a weakened field the torque that has the same heat."""
    speed, most = value(row["speed"]), float(row["breakdown_ratio"])
    torque, slip = value(row["power"]) / speed, 4 * math.pi * hertz(row["frequency"]) / row["poles"] - speed
    heat, fed, ub = torque * slip, inverter(row), slip * (most + math.sqrt(most * most - 1))
    if fed is not None and fed[1] < 1:
        top = 2 * fed[1] ** 2 * most * torque * ub
        torque = heat / brentq(lambda u: top * u * u / (u * u + ub * ub) - heat, 0.0, ub)
    return torque, heat


def circuit_torque(row: dict[str, Any]) -> Any:
    """Fluxes of stator and rotor in the frame that turns with the field."""
    pairs, we = row["poles"] / 2, 2 * math.pi * hertz(row["frequency"])
    voltage, mains = volts(row["voltage"]) * math.sqrt(2 / 3), we
    if "inverter" in row:  # at once at its frequency
        fed = row["inverter"]
        we = 2 * math.pi * hertz(fed["frequency"])
        voltage *= min(we, 2 * math.pi * hertz(fed.get("field_weakening_from", row["frequency"]))) / mains
    names = ("stator_resistance", "stator_reactance", "magnetizing_reactance", "rotor_resistance", "rotor_reactance")
    rs, xs, xm, rr, xr = (volts(row[name]) for name in names)
    ls, lm, lr = (xs + xm) / mains, xm / mains, (xr + xm) / mains
    det = ls * lr - lm * lm

    def currents(y: Sequence[float]) -> tuple[float, float, float, float]:
        sq, sd, rq, rd = y
        return (lr * sq - lm * rq) / det, (lr * sd - lm * rd) / det, (ls * rq - lm * sq) / det, (ls * rd - lm * sd) / det

    def torque(omega: float, y: Sequence[float], t: float) -> float:
        iq, id_, _, _ = currents(y)
        return 1.5 * pairs * (y[1] * iq - y[0] * id_)

    def rates(omega: float, y: Sequence[float], t: float) -> list[float]:
        iq, id_, jq, jd = currents(y)
        slip = we - pairs * omega
        return [voltage - rs * iq - we * y[1], -rs * id_ + we * y[0], -rr * jq - slip * y[3], -rr * jd + slip * y[2]]

    def steady(omega: float) -> list[float]:
        matrix = np.array(
            [
                [r - z for r, z in zip(rates(omega, row, 0.0), rates(omega, [0.0] * 4, 0.0), strict=True)]
                for row in np.eye(4).tolist()
            ]
        ).T
        return np.linalg.solve(matrix, [-voltage, 0.0, 0.0, 0.0]).tolist()  # type: ignore[no-any-return]

    return Motor(4, torque, rates, (voltage / we,) * 4, steady)


def dc(row: dict[str, Any]) -> str | Motor:
    """U = R i + k omega + L di/dt, T = k i - b omega, by constants or by the name plate."""
    u = volts(row["voltage"])
    if "resistance" in row:
        r, k, b = volts(row["resistance"]), volts(row["constant"]), value(row.get("friction"))
    else:
        power, omega = value(row["power"]), value(row["speed"])
        i = volts(row["current"]) if "current" in row else power / (value(row["efficiency"]) * u)
        share, lost = value(row.get("armature_share"), 0.5), u * i - power
        r = share * lost / i**2
        k, b = (u - r * i) / omega, (1 - share) * lost / omega**2
    inductance = volts(row.get("inductance", 0))
    if not inductance:
        return f"{k / r!r}*({u!r} - {k!r}*omega) - {b!r}*omega"

    def torque(omega: float, y: Sequence[float], t: float) -> float:
        return k * y[0] - b * omega

    def rates(omega: float, y: Sequence[float], t: float) -> list[float]:
        return [(u - r * y[0] - k * omega) / inductance]

    return Motor(1, torque, rates, (u / r,), lambda omega: [(u - k * omega) / r])


def synchronous(row: dict[str, Any]) -> Motor:
    """T = Tp sin d + Tr sin 2d + c u, dd/dt = p u, u the slip speed."""
    pairs = row["poles"] / 2
    sync = 2 * math.pi * hertz(row["frequency"]) / pairs
    rated, salient = value(row["power"]) / sync, float(row.get("saliency", 0.0))
    cosine = (-1 + math.sqrt(1 + 32 * salient**2)) / (8 * salient) if salient else 0.0
    top = math.sqrt(1 - cosine**2)
    tp = row["pull_out_ratio"] * rated / (top + 2 * salient * top * cosine)
    c = value(row["damping"]) if "damping" in row else rated / (value(row["asynchronous_slip"]) * sync)
    most = row.get("asynchronous_ratio")
    if most is not None and "damping" not in row:  # rated torque at that slip, on the side of it that rises
        c *= 2 * most**2 * (1 - math.sqrt(1 - 1 / most**2))

    def torque(omega: float, y: Sequence[float], t: float) -> float:
        u = sync - omega
        winding = c * u if most is None else c * u / (1 + (c * u / (2 * most * rated)) ** 2)
        return tp * (math.sin(y[0]) + salient * math.sin(2 * y[0])) + winding

    if "field_at" not in row:
        return Motor(1, torque, lambda omega, y, t: [pairs * (sync - omega)], (1.0,), lambda omega: [0.0])
    first, lag = value(row["field_at"]), value(row["field_time"])

    def target(omega: float) -> float:
        x = min(1.0, max(0.0, (omega - first) / (0.01 * sync)))
        return x**3 * (10 - 15 * x + 6 * x * x)  # the rise whose first two derivatives are nothing at its ends

    def pulled(omega: float, y: Sequence[float], t: float) -> float:
        return torque(omega, (0.0,), t) + y[1] * tp * math.sin(y[0])

    def given(omega: float, y: Sequence[float], t: float) -> list[float]:
        return [pairs * (sync - omega), (target(omega) - y[1]) / lag]

    return Motor(2, pulled, given, (1.0, 1.0), lambda omega: [0.0, target(omega)])


def servo(row: dict[str, Any]) -> str:
    """A speed controller within the peak curve: flat up to a corner, then straight down to zero."""
    point = value(row["torque"]) if "torque" in row else value(row["power"]) / value(row["speed"])
    request, top, corner, last = (value(row[key]) for key in ("set_speed", "peak_torque", "corner_speed", "maximum_speed"))
    gain = point / (value(row.get("droop", 0.01)) * request)
    curve = f"({top!r} if abs(omega) < {corner!r} else max(0, {top!r}*({last!r} - abs(omega))/{last - corner!r}))"
    wanted = f"{gain!r}*({request!r} - omega)"
    return f"({wanted} if abs({wanted}) < {curve} else {curve}*sign({request!r} - omega))"


def hydraulic(row: dict[str, Any]) -> str:
    """A pump of constant flow and a relief valve."""
    d, flow, p = (value(row[key]) for key in ("displacement", "flow", "pressure"))
    volume, mechanical, rise = (
        value(row["volumetric_efficiency"]),
        value(row["mechanical_efficiency"]),
        value(row.get("override")),
    )
    d /= 2 * math.pi
    idle = flow / d
    knee = volume * idle
    leak = f"{mechanical * d * p / (idle - knee)!r}*({idle!r} - omega)"
    valve = f"{mechanical * d * p / (1 + rise * (1 - volume))!r}*(1 + {rise!r}*(1 - omega/{idle!r}))"
    brake = f"max({-d * p / mechanical!r}, {d * p / mechanical / (idle - knee)!r}*({idle!r} - omega))"
    return f"{valve} if omega < {knee!r} else {leak} if omega < {idle!r} else {brake}"


def engine(row: dict[str, Any]) -> str:
    """Full load up to rated speed, a straight line down to no load, and on to the unfired engine's braking."""
    speed, droop, brake = value(row["speed"]), value(row["droop"]), value(row.get("braking_torque"))
    full = row.get("full_load")
    if full is None:
        top = value(row["torque"]) if "torque" in row else value(row["power"]) / speed
        text, rated = repr(top), top
    else:
        text = table(full)
        rated = next(
            y0 + (y1 - y0) * (speed - x0) / (x1 - x0)
            for x0, x1, y0, y1 in zip(full["speed"], full["speed"][1:], full["torque"], full["torque"][1:], strict=False)
            if x0 <= speed <= x1
        )
    return (
        f"({text}) if omega < {speed!r} else max({-brake!r}, {rated / (droop * speed)!r}*({speed * (1 + droop)!r} - omega))"
    )


def started(row: dict[str, Any], own: str) -> str:
    """Connections that end by time: star-delta, a transformer, a soft start's ramp."""
    start = row["start"]
    if start["type"] == "star-delta":
        share = "1/3"
    elif start["type"] == "transformer":
        share = repr(value(start["voltage"]) ** 2)
    elif start["type"] == "soft":
        low, ramp = value(start["voltage"]), value(start["ramp"])
        return f"({own})*({low!r} + {1 - low!r}*min(t/{ramp!r}, 1))**2"
    else:
        raise ValueError(start["type"])
    return f"({own})*({share} if t < {value(start['until'])!r} else 1)"


KINDS: dict[str, Callable[[dict[str, Any]], Any]] = {
    "constant": constant, "line": line, "table": table, "induction": kloss, "dc": dc, "synchronous": synchronous,
    "servo": servo, "hydraulic": hydraulic, "engine": engine,
}  # fmt: skip
