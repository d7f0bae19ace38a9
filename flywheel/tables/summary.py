"""Summary of a sizing: plain data that the live page and the report also take, and its text of 80 columns.

Every block is a function of the sizing. Its words are marked for translation, and its figures are in customary
units, to five digits or as many as their errors leave. `flywheel size` prints this; `--full` prints every figure.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from math import atan2, degrees, hypot, isnan
from textwrap import wrap
from typing import TYPE_CHECKING, Any, NamedTuple

from flywheel.components.energy import Energy, ServoLoad
from flywheel.components.gear_trains import gd2
from flywheel.components.wheels import ROUNDING
from flywheel.language import message, number
from flywheel.language import text as _
from flywheel.numerics.cells import TIE
from flywheel.numerics.units import columns, figure
from flywheel.scene.scene import Scene
from flywheel.sizing.findings import KINDS, SUMMARY, Finding, finding, rows_of
from flywheel.sizing.power_flow import can_lose
from flywheel.sizing.results import Sizing
from flywheel.tables import power
from flywheel.tables.rows import (
    DEGREES,
    NOTHING,
    RPM,
    SI,
    SYSTEMS,
    US,
    Row,
    TradeUnits,
    Written,
    few_digits,
    five_digits,
    place,
    printable,
)
from flywheel.tables.scene import SceneLine, parts, running
from flywheel.tables.sizing import CONCLUSIVE, Candidate, candidates, inertia_cell, limit_names, remarks, settles, speed_band

if TYPE_CHECKING:
    from flywheel.components.motors import Motor
    from flywheel.sizing.results import Synchronism

__all__ = ["BLOCKS", "WIDTH", "Block", "lines_of", "machine_block", "material_name", "stress_place", "summary", "text"]

WIDTH = 80
_LINES, _MOST = 24, 26  # lines of the summary, and with the parts that have no shorter form
_LEAST = 6  # least lines for the machine, however long the rest is
_SAME_FLYWHEEL = 5e-6  # share below which two flywheels are the same to five digits
_RISKY = 0.05  # share by which a flywheel too small is a danger, not an inaccuracy
_MILLION = 1e-6


class Block(NamedTuple):
    """A part of the summary: rows, or a table under a header, then sentences. `name` is the same in every language."""

    name: str
    title: str = ""
    rows: tuple[Row, ...] = ()
    header: tuple[str, ...] = ()
    table: tuple[tuple[str, ...], ...] = ()
    sentences: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """The block for JSON: rows as mappings, all as text in the language in use."""
        return {
            **self._asdict(),
            "rows": [row._asdict() for row in self.rows],
            "header": list(self.header),
            "table": [list(cells) for cells in self.table],
            "sentences": list(self.sentences),
        }


def summary(sizing: Sizing, units: str = "si", *, motions: bool = True) -> tuple[Block, ...]:
    """The summary, in the language in use; empty blocks are left out.

    Args:
        sizing: result of `flywheel.size`.
        units: "si", or "us" for WR² in lb ft², hp, psi...
        motions: False during a drag: the irregularity with the approximate flywheels is left out.

    >>> import flywheel
    >>> scene = flywheel.load({"areas": {"values": [100, -100], "scale": "1 J"}, "regime": {"speed": "60 rpm"},
    ...                        "flywheel": {"irregularity": 0.02}})
    >>> [block.name for block in summary(flywheel.size(scene))]
    ['title', 'machine', 'flywheel', 'drive', 'run']

    """
    system = SYSTEMS[units]
    blocks = (block(sizing, system) if block is not _flywheel else _flywheel(sizing, system, motions) for block in BLOCKS)
    return tuple(block for block in blocks if any(block[1:]))


# -- the machine -----------------------------------------------------------------------------------------------------


def _title(sizing: Sizing, units: TradeUnits) -> Block:
    return Block("title", printable(sizing.scene.title or "").strip() or _("Input summary"))


def _machine(sizing: Sizing, units: TradeUnits) -> Block:
    return machine_block(sizing.scene, units)


def machine_block(scene: Scene, units: TradeUnits) -> Block:
    """Input summary: equal parts in one row."""
    rows = []
    for alike in _alike(part for part in parts(scene, units) if part.kind != "runs"):
        first = alike[0]
        if first.kind == "mechanism":
            angles = ", ".join(part.phase or "0" for part in alike) if any(part.phase for part in alike) else ""
            text = f"{first.head}{' ' + _('at {angles}', angles=angles) if angles else ''}: {first.text}"
            names = ", ".join(part.label for part in alike)
            rows.append(Row(names, text) if len(alike) == 1 else Row(_("mechanisms"), f"{names}: {text}"))
        else:
            heads = ", ".join(part.head for part in alike if part.head)
            rows.append(Row(first.label, f"{heads}: {first.text}" if heads else first.text))
    if scene.gravity is not None and any(scene.gravity):
        x, y = scene.gravity
        size, angle = units.read(hypot(x, y), "acceleration"), number(figure(atan2(y, x) * DEGREES, most=6))
        rows.append(Row(_("gravity"), _("{size} at {angle} deg, on every body with mass", size=size, angle=angle)))
    return Block("machine", rows=(*rows, Row(_("runs"), ", ".join(running(scene, units)))))


def _alike(lines: Iterable[SceneLine]) -> Iterator[list[SceneLine]]:
    """Parts of a kind with equal data, such as the cylinders of an engine."""
    groups: dict[tuple[str, ...], list[SceneLine]] = {}
    for k, part in enumerate(lines):
        own = (str(k),) if part.kind in ("shaft", "areas", "inertia") else ()
        what = (part.head,) if part.kind == "mechanism" else ()
        groups.setdefault((part.kind, part.text, *what, *own), []).append(part)
    yield from groups.values()


# -- the flywheel ----------------------------------------------------------------------------------------------------


def _shaft(sizing: Sizing) -> str:
    on, ratio = sizing.flywheel.on, sizing.scene.flywheel_ratio
    if on == "crank":
        return _("the crank")
    return _("shaft {name} ({n} × the crank's speed)", name=on, n=number(figure(ratio, most=6)))


def _flywheel(sizing: Sizing, units: TradeUnits, motions: bool = True) -> Block:
    """The exact flywheel and the approximate ones with their errors; or the irregularity with a given one."""
    scene, us = sizing.scene, units.name == "us"
    if scene.inertia is not None:
        return _analysis(sizing, units)
    eps, inertia_of = scene.irregularity or 0.0, lambda value, error: units.of(value, "inertia", error)
    of = {"shaft": _shaft(sizing), "eps": number(figure(eps, most=6)), "percent": number(figure(50 * eps, most=6))}
    inertia = units.unit("inertia")
    header = ("", f"WR², {inertia}" if us else _("inertia, {unit}", unit=inertia), *(() if us else (f"GD², {inertia}",)))
    header += (_("error"), _("irregularity"))
    rows = candidates(sizing, motions)
    names = {
        "exact": _("exact (Wittenbauer)"),
        "approximate": _("accumulated areas"),
        "inertia_torque_flywheel": _("inertia torque"),
    }
    table = []
    for one in rows:
        off, gives = _off(one), _gives(one)
        figures = [inertia_cell(one, inertia_of, times) for times in ((1.0,) if us else (1.0, gd2(1.0)))]
        table.append((names[one.key], *figures, off, gives))
    title = _("Flywheel on {shaft} for irregularity {eps} (±{percent} %)", **of)
    notes = tuple(_shortcuts(sizing, rows))
    if sizing.limits:
        title = _("Flywheel on {shaft}: the smallest that keeps its limits", shaft=of["shaft"])
        if sizing.binding != "irregularity":  # which alone the approximate ones are for
            table, notes = table[:1], ()
    if not any(cells[-2] for cells in table):
        header, table = _without(header, -2), [_without(cells, -2) for cells in table]
    return Block("flywheel", title, header=header, table=tuple(table), sentences=notes)


def _limits(sizing: Sizing, units: TradeUnits) -> Block:
    """Limits that the flywheel keeps together: required and reached values, and the flywheel that each alone needs."""
    if not sizing.limits:
        return Block("limits")
    names, table = limit_names(), []
    for name, limit in sizing.limits.items():
        error = limit.reached_error * limit.reached
        if name == "irregularity":
            limit_value, reached = number(figure(limit.requirement, most=6)), five_digits(limit.reached, error)
        else:
            limit_value, reached = (
                f"{few_digits(100 * limit.requirement, 4)} %",
                f"{five_digits(100 * limit.reached, 100 * error)} %",
            )
        table.append(
            (names[name], limit_value, reached, str(units.written(limit.alone, "inertia", limit.alone_error * limit.alone)))
        )
    header = (_("limit"), _("asked"), _("reached"), _("alone it needs"))
    note = _("None binds: the machine's own inertia keeps them.")
    if sizing.binding is not None:
        note = _("What binds: {limit}.", limit=names[sizing.binding])
    return Block("limits", header=header, table=tuple(table), sentences=(note,))


def _without(cells: tuple[str, ...], place: int) -> tuple[str, ...]:
    place %= len(cells)
    return cells[:place] + cells[place + 1 :]


def _off(one: Candidate) -> str:
    if one.off is None:
        return ""
    percent = few_digits(100 * one.off, 3, 100 * one.off_error)
    return f"{'+' if one.off > 0 and percent != '0' else ''}{percent} %"


def _gives(one: Candidate) -> str:
    if one.gives is None:
        return _("it stops")
    eps, error = one.gives
    if isnan(eps):
        return "…"
    return five_digits(eps, max(error, NOTHING if eps <= NOTHING else 0.0))


def _analysis(sizing: Sizing, units: TradeUnits) -> Block:
    """The figures of a flywheel that was given."""
    scene, motion = sizing.scene, sizing.simulation
    assert scene.inertia is not None
    rows = []
    if motion is not None:
        error = (sizing.error.simulation or 0.0) * motion.irregularity
        gives = _gives(Candidate("", "", 0.0, 0.0, None, 0.0, (motion.irregularity, error), None))
        varies = motion.irregularity > max(error, NOTHING)
        rows.append(
            Row(_("irregularity"), gives, "", f"±{five_digits(50 * motion.irregularity, 50 * error, 4)} %" if varies else "")
        )
    if units.name == "us":
        rows.append(Row(_("inertia"), *units.written(scene.inertia, "inertia")))
    else:
        rows.append(Row("GD²", *units.written(gd2(scene.inertia), "inertia")))
    value = units.read(scene.inertia, "inertia", 5)
    return Block("flywheel", _("Given flywheel of {inertia} on {shaft}", inertia=value, shaft=_shaft(sizing)), tuple(rows))


def _shortcuts(sizing: Sizing, rows: list[Candidate]) -> Iterator[str]:
    """Errors of the approximate flywheels, and their sides."""
    wheel, run = sizing.flywheel, sizing.run
    if sizing.scene.areas is not None:
        yield _("A diagram does not contain the machine's own inertia: the figure is the total required.")
        return
    if wheel.needed is False:
        if run is None:
            yield _("No flywheel is needed: the machine's torques alone keep the irregularity.")
        else:
            eps = five_digits(run.irregularity, run.error * run.irregularity)
            yield _("No flywheel is needed: the machine's own inertia suffices and gives {eps}.", eps=eps)
        too_large = [one for one in rows if one.key != "exact" and one.inertia > one.error]
        if too_large:
            yield _("The approximate methods give a flywheel although none is needed.")
        return
    if rows[0].only_bound:
        yield _("This flywheel keeps the irregularity. Whether a lighter one does is unknown.")
    shortcuts = [one for one in rows if one.off is not None]
    if not shortcuts:
        return
    if all(abs(one.off or 0.0) <= max(_SAME_FLYWHEEL, one.off_error) for one in shortcuts):
        yield _("Both approximate methods agree with the exact one here.")
        return
    areas, torque = (_shortcut(one, sizing) for one in shortcuts)
    yield _("Areas {areas}, inertia torque {torque}.", areas=areas, torque=torque)


def _shortcut(one: Candidate, sizing: Sizing) -> str:
    """Error of an approximate flywheel relative to the exact one; a flywheel too small is dangerous."""
    exact, off = sizing.flywheel.exact or 0.0, one.off or 0.0
    if one.gives is None:
        return _("too small: the machine would stop (DANGER)")
    if one.inertia <= 0.0:
        return _("give none (DANGER)")
    if abs(off) <= max(_SAME_FLYWHEEL, one.off_error):
        return _("agrees")
    if off > 0.0:
        return _("{much} too large (safe)", much=_times(one.inertia / exact) if off > 0.5 else _percent(off))
    much = _times(exact / one.inertia) if exact > 1.5 * one.inertia else _percent(-off)
    return _("{much} too small (DANGER)", much=much) if off < -_RISKY else _("{much} too small (unsafe)", much=much)


def _times(factor: float) -> str:
    return _("{n} times", n=number(f"{factor:.0f}" if factor >= 100 else figure(factor, 0.0, 2)))


def _percent(share: float) -> str:
    return f"{few_digits(100 * share, 3)} %"


def _wheel(sizing: Sizing, units: TradeUnits) -> Block:
    """The wheel to be built: shape, size, mass, the greatest stress, and the irregularity with it."""
    built = sizing.built
    if built is None:
        return Block("wheel")
    wheel = built.wheel
    across, width = (units.written(size, "length") for size in (2 * wheel.body.outer, wheel.body.width))
    size = f"Ø {across} × {width}" if across.unit != width.unit else f"Ø {across.value} × {width}"
    if wheel.shape != "disc":
        size += ", " + _("rim {size} thick", size=units.written(wheel.body.thickness, "length"))
    shape = {"disc": _("disc"), "rim": _("rim"), "arms": _("rim on arms")}[wheel.shape]
    mass = units.written(wheel.mass, "mass")
    rows = [Row(_("wheel"), f"{shape}, {material_name(wheel.material.name)}, {size}, {mass}")]
    if wheel.stresses:
        allowable, words = wheel.material.allowable, [stress_place(wheel.place)]
        if allowable is not None:
            limit = {"allowable": units.read(allowable, "stress", 4).value}
            fits = wheel.greatest_stress <= allowable * (1 + ROUNDING)
            words.append(_("allowable {allowable}", **limit) if fits else _("TOO HIGH, allowable {allowable}", **limit))
        if wheel.safety is not None:
            words.append(_("safety {n}", n=few_digits(wheel.safety, 2)))
        rows.append(Row(_("stress"), *units.written(wheel.greatest_stress, "stress"), ", ".join(words)))
    note = ""
    if built.irregularity is not None:
        eps = five_digits(built.irregularity, built.error * built.irregularity)
        inertia = units.written(wheel.inertia, "inertia")
        note = _("as built {inertia}, irregularity {eps}", inertia=inertia, eps=eps)
    rows.append(Row(_("rim speed"), *units.written(wheel.rim_speed, "velocity"), note))
    return Block("wheel", rows=tuple(rows))


def material_name(name: str) -> str:
    """The name of one of the usual metals, or of the user's own material."""
    names = {
        "grey cast iron": _("grey cast iron"),
        "ductile iron": _("ductile iron"),
        "cast steel": _("cast steel"),
        "carbon steel": _("carbon steel"),
        "alloy steel": _("alloy steel"),
        "aluminium": _("aluminium"),
        "own material": _("own material"),
    }
    return names.get(name, name)


def stress_place(place: str) -> str:
    """The place of the greatest stress in a wheel, by the names of its formulas."""
    places = {
        "inside of the rim": _("inside of the rim"),
        "centre": _("centre"),
        "edge of the bore": _("edge of the bore"),
        "rim": _("rim"),
        "rim at the arms": _("rim at the arms"),
        "rim between the arms": _("rim between the arms"),
        "arms at the hub": _("arms at the hub"),
        "arms at the rim": _("arms at the rim"),
    }
    return places.get(place, place)


# -- torque, power, the motor ----------------------------------------------------------------------------------------


def _drive(sizing: Sizing, units: TradeUnits) -> Block:
    """The balance, power with the flywheel and without it, the motor with its load and heat."""
    scene, fluctuation = sizing.scene, finding("energy_fluctuation")
    rows = [*_balance(sizing, units)]
    energy, motor, engine = sizing.energy, scene.motor, sizing.engine
    if energy is not None:
        over_time = _("at {speed} over time", speed=units.read(scene.cycle / energy.period, "speed", 5))
        note = ", ".join(filter(None, (_or_horses(energy.mean_power, units), over_time)))
        rows.append(_power(_("mean power"), energy.mean_power, note, units))
        alone = _("without a flywheel {power}", power=units.written(abs(energy.peak_power_alone), "power"))
        rows.append(_power(_("peak power"), energy.peak_power, alone, units))
    if engine is not None:
        of_extremes = _("at {speed}, mean of extremes", speed=units.read(sizing.speed, "speed", 5))
        note = ", ".join(filter(None, (_or_horses(engine.indicated_power, units), of_extremes)))
        rows.append(_power(_("indicated power"), engine.indicated_power, note, units))
    share = sizing.coefficient_of_energy
    note = "" if share is None else _("{share} of the drive's work", share=five_digits(share, fluctuation.error(sizing), 4))
    rows.append(_row(fluctuation, sizing, units, note))
    rows += [_row(one, sizing, units) for one, _value in rows_of(SUMMARY, sizing)]
    lines: list[str] = []
    if motor is not None and energy is not None:
        rows += _motor(sizing, motor, energy, units)
        lines += power.warnings(sizing, motor, units)
    if can_lose(scene) and sizing.power_flow is not None:
        lines += filter(None, [power.sentence(sizing.power_flow, units)])
    return Block("drive", rows=tuple(rows), sentences=tuple(lines))


def _row(one: Finding, sizing: Sizing, units: TradeUnits, note: str = "") -> Row:
    """A figure as a line of the summary, in customary units."""
    value, error = float(one.of(sizing)), one.error(sizing)
    written = (
        units.written(value, KINDS[one.unit], error) if one.unit in KINDS else Written(five_digits(value, error), one.unit)
    )
    return Row(one.name, *written, note)


def _balance(sizing: Sizing, units: TradeUnits) -> Iterator[Row]:
    balance, scene = sizing.balance, sizing.scene
    if balance is None:
        return
    error = power.balance_error(sizing)
    if balance.name == "drive" and scene.drive is not None:
        note = _("on {place} (the balance)", place=place(scene.drive.on, article=True))
        if balance.value < -error:
            note += ", " + _("it brakes")
        yield Row(_("drive torque"), *units.written(balance.value, "torque", error), note)
        return
    kind = {"N": "force", "N m": "torque"}.get(sizing.balance_unit or "")
    if kind is None:
        value = five_digits(balance.value, error)
        yield Row(balance.name, value, sizing.balance_unit or _("in the units of its expression"), _("(the balance)"))
    else:
        yield Row(balance.name, *units.written(balance.value, kind, error), _("(the balance)"))


def _or_horses(value: float, units: TradeUnits) -> str:
    return "" if units.name == "us" else f"= {US.written(value, 'power')}"


def _power(label: str, value: float, note: str, units: TradeUnits) -> Row:
    brakes = _("it brakes") if value < 0.0 else ""
    return Row(label, *units.written(value, "power"), ", ".join(filter(None, (note, brakes))))


def _motor(sizing: Sizing, motor: Motor, energy: Energy, units: TradeUnits) -> Iterator[Row]:
    """A motor's load compared with its rated point, and its heat."""
    title, rated = message(motor.title), motor.rated
    if rated is None:
        yield Row(_("motor"), title, "", _("without a rated point"))
    else:
        shares = [few_digits(100 * part / rated.power, 3) for part in (energy.mean_power, energy.peak_power)]
        speed = f"{few_digits(rated.speed / SI.scales['speed'][0].size, 5)} rpm"
        name = _("{motor}, {power} at {speed}", motor=title, power=units.read(rated.power, "power", 4), speed=speed)
        yield Row(_("motor"), name, "", _("mean {mean} %, peak {peak} % of rated power", mean=shares[0], peak=shares[1]))
    if (rise := sizing.temperature) is not None:
        stands = _("within") if rise.within else _("TOO HOT")
        allowed = _("{limit} K allowed, {stands}", limit=f"{rise.limit:g}", stands=stands)
        yield Row(_("rise of the windings"), few_digits(rise.greatest, 4), "K", allowed)
    if sizing.servo is not None:
        yield from servo_rows(sizing.servo, units)
    heat = power.heat_of(sizing, motor, energy)
    if sizing.duty is not None and heat is not None:
        return  # what it bears is listed for all phases together
    if heat is None:
        unknown = _("unknown: torque against speed alone does not give its losses")
        overloaded = rated is not None and energy.mean_power > rated.power * (1 + TIE)
        if overloaded:
            unknown += "; " + _("TOO MUCH: the mean power is more than the rated one")
        if sizing.synchronism is not None:
            yield from _in_step(sizing.synchronism)
        elif not motor.governed:
            yield Row(_("motor's heat"), unknown)
        return
    if energy.stator_heat is None or energy.stator_heat_share is None:
        yield Row(_("motor's heat"), *_watts(heat.heat), _heat_beside(heat, energy))
    else:
        yield Row(_("rotor's heat"), *_watts(heat.heat), _heat_beside(heat, energy))
        stands = _("within") if energy.stator_heat_share <= 1.0 + TIE else _("TOO HOT")
        beside = _("{share} % of that at its rating", share=few_digits(100 * energy.stator_heat_share, 3))
        yield Row(_("stator's heat"), *_watts(energy.stator_heat), f"{beside}, {stands}")
    if (fed := sizing.inverter) is not None:
        most, least = (units.read(one, "power", 4) for one in (fed.power_greatest, fed.power_least))
        span = _("from {least} to {greatest}", least=least, greatest=most)
        yield Row(_("power of the inverter"), *units.written(fed.power, "power"), span)
    if energy.current_rms is not None and energy.current_peak is not None:
        limit, note = motor.rated_current, ""
        if limit is not None:
            rms, peak = (few_digits(100 * abs(one) / limit, 3) for one in (energy.current_rms, energy.current_peak))
            rated_current = few_digits(limit, 4)
            note = _("{rms} % of the rated {rated} A, peak {peak} %", rms=rms, rated=rated_current, peak=peak)
        yield Row(_("motor's current"), few_digits(energy.current_rms, 4), "A", note)


def servo_rows(load: ServoLoad, units: TradeUnits) -> Iterator[Row]:
    """The rms point and the peak point of a servo drive beside its curves, and its ratio of inertias."""
    share = few_digits(100 * load.continuous_share, 3)
    at = f"{few_digits(load.mean_speed * RPM, 5)} rpm"
    note = _("at a mean of {speed}, {share} % of the continuous curve", speed=at, share=share)
    yield Row(_("rms torque"), *units.written(load.rms_torque, "torque"), note)
    share, at = few_digits(100 * load.peak_share, 3), f"{few_digits(load.peak_speed * RPM, 5)} rpm"
    note = _("at {speed}, {share} % of the peak curve", speed=at, share=share)
    note += ", " + _("ITS LIMIT") if load.at_peak else ""
    yield Row(_("greatest torque"), *units.written(load.peak_torque, "torque"), note)
    if load.inertia_ratio is not None:
        yield Row(_("inertia ratio"), few_digits(load.inertia_ratio, 4), "", _("of what it moves to its rotor"))


def _in_step(synchronism: Synchronism) -> Iterator[Row]:
    """The load angle of a synchronous motor, and the natural frequency of its swing."""
    mean, least, greatest, limit = (
        few_digits(degrees(angle), 3)
        for angle in (
            synchronism.load_angle,
            synchronism.load_angle_least,
            synchronism.load_angle_greatest,
            synchronism.pull_out_angle,
        )
    )
    span = _("from {least} to {greatest}, pull-out at {limit}", least=least, greatest=greatest, limit=limit)
    yield Row(_("load angle"), mean, "deg", span)
    damping = _("damping ratio {ratio}", ratio=few_digits(synchronism.damping_ratio, 3))
    yield Row(_("frequency of its swing"), few_digits(synchronism.natural_frequency, 4), "Hz", damping)


def _duty(sizing: Sizing, units: TradeUnits) -> Block:
    """Load of the motor over a duty, and the phase that decides the flywheel."""
    load, motor = sizing.duty, sizing.scene.motor
    if load is None:
        return Block("duty")
    loaded = few_digits(100 * load.cyclic_duration_factor, 3)
    text = _(
        "{n} phases in {time} s, loaded for {percent} %",
        n=len(load.phases),
        time=few_digits(load.period, 4),
        percent=loaded,
    )
    hardest = _("phase that determines the flywheel: {phase}", phase=printable(load.governing))
    rows = [Row(_("duty"), text if load.type is None else f"{load.type}, {text}", "", hardest)]
    if load.rms_torque is not None:
        rated = load.rms_torque_share
        note = "" if rated is None else _("{share} % of the rated one", share=few_digits(100 * rated, 3))
        rows.append(Row(_("rms torque over it"), *units.written(load.rms_torque, "torque"), note))
    if load.heat is not None and motor is not None:
        share, note = load.heat_share, _("its limit is unknown without a rated point")
        if share is not None:
            verdict = _("TOO HOT: choose a larger motor") if share > 1.0 + TIE else _("within")
            note = f"{_('{share} % of that at its rating', share=few_digits(100 * share, 3))}, {verdict}"
        rows.append(Row(_("heat over it"), *_watts(load.heat), note))
    return Block("duty", rows=tuple(rows))


def _watts(heat: float) -> Written:
    """A heat, which is in watts everywhere."""
    return SI.written(heat, "power")


def _heat_beside(heat: power.Heat, energy: Energy) -> str:
    """A heat compared with that at the rated point, and a verdict."""
    if heat.share is None or heat.rated is None or heat.even is None:
        return _("its limit is unknown without a rated point")
    beside = _("{share} % of that at its rating", share=few_digits(100 * heat.share, 3))
    if not heat.too_hot:
        words = f"{beside}, {_('within')}"
        return words + ("; " + _("above the mean for a while in so long a cycle") if power.is_long(energy) else "")
    mend = _("choose a larger motor") if heat.even > heat.rated else _("choose a larger motor, or more flywheel")
    return f"{beside}, {_('TOO HOT')}: {mend}"


# -- speed, confirmation ---------------------------------------------------------------------------------------------


def _run(sizing: Sizing, units: TradeUnits) -> Block:
    """The range of speed, and the result of its confirmation."""
    band, scene = speed_band(sizing), sizing.scene
    rows = []
    if band is not None:
        greatest, least = (units.written(speed, "speed", band[2]) for speed in band[:2])
        text = _("{least} to {greatest}", least=least.value, greatest=greatest.value)
        rows.append(Row(_("speed of the crank"), text, greatest.unit, _where(sizing)))
    other = scene.flywheel_on != "crank"
    if other or scene.speed is None or abs(sizing.speed / scene.speed - 1.0) > _SAME_FLYWHEEL:
        there = units.written(sizing.speed * scene.flywheel_ratio, "speed")
        note = _("{speed} on {shaft}", speed=there, shaft=scene.flywheel_on) if other else ""
        rows.append(Row(_("mean of both"), *units.written(sizing.speed, "speed"), note))
    if sizing.cyclic is not None and not settles(sizing.cyclic):
        rows.append(Row(_("settles"), _("NO: a change of speed does not decay")))
    return Block("run", rows=tuple(rows), sentences=tuple(_confirmed(sizing)))


def _where(sizing: Sizing) -> str:
    """The angles of the crank at which the speed is least and greatest."""
    if sizing.angle_speed_min is None or sizing.angle_speed_max is None:
        return ""
    places = (f"{number(f'{angle * DEGREES:.1f}')}°" for angle in (sizing.angle_speed_min, sizing.angle_speed_max))
    least, greatest = places
    return _("least at {least}, greatest at {greatest}", least=least, greatest=greatest)


def _proven() -> dict[str, tuple[str, str]]:
    """The figures of whose proofs the summary shows the first available one, with name and unit."""
    return {
        "flywheel.exact": (_("exact flywheel"), "kg m²"),
        "simulation.irregularity": (_("irregularity"), ""),
        "energy_fluctuation": (_("energy fluctuation"), "J"),
    }


def _confirmed(sizing: Sizing) -> Iterator[str]:
    """Sentences on the confirmation of the irregularity, its accuracy, and a required accuracy that was not reached."""
    motion, error = sizing.simulation, sizing.error.simulation or 0.0
    if sizing.scene.areas is not None:
        yield _("A diagram has no motion to confirm it.")
    elif motion is None or motion.route in ("quadrature", "areas"):
        if sizing.left_out:
            yield _("NOT confirmed at accuracy {level}: audit adds a second method.", level=sizing.accuracy)
        else:
            yield _("NOT confirmed by a second method.")
    elif error >= CONCLUSIVE:
        eps = five_digits(motion.irregularity, error * motion.irregularity)
        yield _("NOT confirmed: a second method gives {eps}, too uncertain to confirm the figures.", eps=eps)
    else:
        values = {"eps": five_digits(motion.irregularity, error * motion.irregularity), "parts": _parts_of(error)}
        if motion.route == "time":
            yield _("Confirmed by time simulation: {eps}, to {parts}.", **values)
        else:
            yield _("Confirmed by periodic collocation: {eps}, to {parts}.", **values)
    if (proof := sizing.proof) is not None:
        if proof.reason:
            yield _("NOT proven: {reason}.", reason=message(proof.reason))
        else:
            name, unit, low, high = next((*each, *proof.figures[k]) for k, each in _proven().items() if k in proof.figures)
            count = len(proof.figures)
            if proof.ranges:
                yield _(
                    "Proven for all numbers in their ranges: {n} figures; {name} from {least} to {most}. "
                    "The model itself is not proven.",
                    n=count,
                    name=name,
                    least=number(str(Context(6, ROUND_FLOOR).create_decimal_from_float(low))),
                    most=f"{number(str(Context(6, ROUND_CEILING).create_decimal_from_float(high)))} {unit}".strip(),
                )
            else:
                yield _(
                    "Proven for the numbers as written: {n} figures, to {width} of their size. "
                    "The model itself is not proven.",
                    n=count,
                    width=few_digits((high - low) / max(abs(high), 1e-300), 2),
                )
    if sizing.reached:
        return
    worst = max(filter(None, sizing.error[:6]), default=0.0)
    if worst < _MILLION:
        yield _("The required accuracy was NOT reached, but the error of every figure is below 1 part in a million.")
    elif worst < 1.0:
        yield _("The required accuracy was NOT reached: the error of a figure may be up to {parts}.", parts=_parts_of(worst))
    else:
        yield _("The required accuracy was NOT reached: the error of a figure may exceed its own size.")


def _parts_of(error: float) -> str:
    """A relative error in words.

    >>> _parts_of(2e-13), _parts_of(3e-4), _parts_of(0.02)
    ('better than 1 part in a million', '1 part in 3300', '2 %')
    """
    if error < _MILLION:
        return _("better than 1 part in a million")
    if error < 1e-3:
        return _("1 part in {n}", n=f"{float(f'{1 / error:.2g}'):.0f}")
    return f"{few_digits(100 * error, 2)} %"


def _notes(sizing: Sizing, units: TradeUnits) -> Block:
    """Remarks on the scene, and important messages."""
    notes = [_("Remark: {remark}", remark=remark) for remark in remarks(sizing)]
    notes += [_("Note: {note}", note=message(line)) for line in sizing.messages]
    return Block("notes", sentences=tuple(notes))


BLOCKS: tuple[Callable[[Sizing, TradeUnits], Block], ...] = (
    _title,
    _machine,
    _flywheel,
    _limits,
    _wheel,
    _drive,
    _duty,
    _run,
    _notes,
)
"""The blocks of the summary in their order; an empty one is left out."""


# -- as text ---------------------------------------------------------------------------------------------------------


def text(sizing: Sizing, units: str = "si") -> str:
    """The summary in 80 columns, in about 24 lines; of a long machine the parts left out are counted.

    Args:
        sizing: result of `flywheel.size`.
        units: "si" or "us".

    """
    blocks = summary(sizing, units)
    lines = lines_of(blocks)
    for long, short in _shorter(sizing, units):
        if len(lines) <= _MOST:
            break
        blocks = tuple(
            block._replace(
                rows=tuple(row for row in block.rows if short or row.label != long),
                sentences=tuple(short if sentence == long else sentence for sentence in block.sentences),
            )
            for block in blocks
        )
        lines = lines_of(blocks)
    if len(lines) > _MOST:
        lines = lines_of(blocks, max(_LEAST - len(lines) + _MOST, 1))
    return "\n".join(lines) + "\n"


def _shorter(sizing: Sizing, units: str) -> Iterator[tuple[str, str]]:
    """Parts that a long summary leaves to `--full`, minor ones first: a sentence with its short form, or a row's label."""
    flow = sizing.power_flow
    if flow is not None:
        yield tuple(power.sentence(flow, SYSTEMS[units], losses=with_losses) or "" for with_losses in (True, False))  # type: ignore[misc]
    yield finding("energy_fluctuation").name, ""
    if "motor_heat" in sizing.limits:  # whose figure stands among the limits
        yield _("rotor's heat"), ""
        yield _("stator's heat"), ""
    yield _("peak power"), ""
    if sizing.scene.flywheel_on == "crank":
        yield _("mean of both"), ""


def lines_of(blocks: Sequence[Block], least: int = _LEAST) -> list[str]:
    """The lines of all blocks; the machine gets the remaining lines, but at least a minimum."""
    labels = [len(row.label) for block in blocks for row in block.rows if block.name != "machine"]
    width = max([_LABELS, *labels])
    others = [_lines(block, width) for block in blocks if block.name != "machine"]
    taken = sum(map(len, others)) + len(_GAPS & {block.name for block in blocks})
    machine = next(_machine_lines(block, max(least, _LINES - taken)) for block in blocks if block.name == "machine")
    lines: list[str] = []
    for block in blocks:
        if lines and block.name in _GAPS:
            lines.append("")
        lines += machine if block.name == "machine" else _lines(block, width)
    return lines


_GAPS = {"parts", "flywheel", "stroke", "clutch", "drive", "shares", "formulas"}  # blocks with an empty line before them
_LABELS, _FIGURES = 18, 12  # columns of labels, at least, and of figures with their units


def _lines(block: Block, width: int) -> list[str]:
    """A block as lines of the summary, its labels in a column of a given width."""
    lines = _wrapped(block.title, "", "") if block.title else []
    if block.table:
        table = columns(block.table, block.header)
        lines += table if max(map(len, table)) <= WIDTH else columns(block.table, block.header, gap=" ", indent=" ")
    for row in block.rows:
        value = " ".join(filter(None, (row.value, row.unit)))
        text = (
            f"{value.ljust(_FIGURES)}  {row.note}" if len(value) <= _FIGURES else ", ".join(filter(None, (value, row.note)))
        )
        lines += _wrapped(text.rstrip(), f"  {row.label.ljust(width)}  ", " " * (width + 4))
    indent = "" if block.name == "notes" else "  "
    for sentence in block.sentences:
        lines += _wrapped(sentence, indent, indent)
    return lines


_UNITS = {scale.name for system in SYSTEMS.values() for scales in system.scales.values() for scale in scales} | {"%", "J"}
_QUANTITY = re.compile(rf"(?<=\d) ({'|'.join(map(re.escape, sorted(_UNITS, key=len, reverse=True)))})(?![\w²])")


def _wrapped(text: str, first: str, rest: str) -> list[str]:
    """Lines of a text in which a number stays with its unit."""
    unbroken = _QUANTITY.sub(lambda unit: unit[0].replace(" ", "\xa0"), printable(text))
    lines = wrap(unbroken, WIDTH, initial_indent=first, subsequent_indent=rest, drop_whitespace=True)
    return [line.replace("\xa0", " ") for line in lines]


def _machine_lines(block: Block, most: int) -> list[str]:
    """The parts of the machine in a limited number of lines; those left out are counted."""
    width = min(max(len(row.label) for row in block.rows), _LABELS)

    def in_lines(row: Row, most: int = 1000) -> list[str]:
        """A row in a limited number of lines; the pieces left out are counted."""
        pieces = row.value.split("; ")
        for count in range(len(pieces), 0, -1):
            rest = [_("and {n} more", n=len(pieces) - count)] if count < len(pieces) else []
            lines = _wrapped("; ".join([*pieces[:count], *rest]), f"  {row.label.ljust(width)}  ", " " * (width + 4))
            if len(lines) <= most:
                break
        return lines

    for longest in (1000, 2, 1):
        texts = [in_lines(row, longest) for row in block.rows]
        if sum(map(len, texts)) <= most:
            return [line for lines in texts for line in lines]
    count = len(block.rows) - 1
    while count:
        lines_taken = [line for lines in texts[:count] for line in lines]
        # rows that found no place, by their labels
        rows = block.rows[count:-1]
        labels = Counter(row.label for row in rows)
        names = ", ".join(label if n == 1 else f"{n} × {label}" for label, n in labels.items())
        rest = _wrapped(_("and {names}: see --full", names=names), "  ", "  ")
        if len(lines_taken) + len(rest) + len(texts[-1]) <= most:
            break
        count -= 1
    return [*lines_taken, *rest, *texts[-1]]
