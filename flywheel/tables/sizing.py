"""A sizing as a page of plain text, in the order in which a lecturer or designer reads it, and as JSON.

To add a line, find its block in `BLOCKS`: each is a function of the sizing that returns its lines, title first. A figure is
written with `figure(value, error)`, which gives it the digits that its error leaves.
"""

from __future__ import annotations

from collections.abc import Callable
from math import log, log1p
from typing import TYPE_CHECKING

from bondgraph.records import NamedTuple
from flywheel.numerics.faults import Remark
from flywheel.numerics.units import columns, figure, short
from flywheel.reading.scenes import of_drive, of_rim
from flywheel.scene.accuracy import AUDIT, CONFIRM, NORMAL
from flywheel.sizing.power_flow import can_lose
from flywheel.sizing.results import Cyclic, Sizing
from flywheel.tables import flywheels, power, power_flow
from flywheel.tables.flywheels import inertia_errors, limit_names, work_error
from flywheel.tables.rows import (
    DEGREES,
    RPM,
    WIDTH,
    Row,
    block,
    encoded,
    irregularity,
    page,
    printable,
    sentences,
    wrapped,
)
from flywheel.tables.scene import scene_rows

if TYPE_CHECKING:
    from flywheel.tables.explanation import Explanation

CONCLUSIVE = 0.01  # relative error of a simulation that confirms something


def text(sizing: Sizing) -> str:
    r"""The whole page, at most 100 columns wide, without colours; every figure to the digits that its error leaves.

    >>> import flywheel
    >>> scene = flywheel.load({"areas": {"values": [100, -100], "scale": "1 J"}, "regime": {"speed": "60 rpm"},
    ...                        "flywheel": {"irregularity": 0.02}})
    >>> print(*text(flywheel.size(scene)).splitlines()[:5], sep="\n")
    The machine as it was read
      areas  100, -100, times 1 J
      runs   crank at 60 rpm, flywheel on crank for irregularity 0.02
    <BLANKLINE>
    Flywheel on the crank for irregularity 0.02 (±1 %, steadiness 50), crank at 60 rpm
    """
    return page(lines(sizing) for lines in BLOCKS)


def json(sizing: Sizing, explanation: Explanation | None = None) -> str:
    """What `flywheel size --json` prints: the sizing, SI throughout, and its explanation if there is one."""
    told = {} if explanation is None else {"explanation": explanation.as_dict()}
    return encoded({**sizing.as_dict(), **told}, indent=2)


def headline(sizing: Sizing) -> str:
    """The result in a line, below the scene's title (cut where it is too long for a picture's heading)."""
    scene, wheel = sizing.scene, sizing.flywheel
    speed = f"crank at {figure(sizing.speed * RPM, 0.0, 6)} rpm"
    asked = f"irregularity {figure(scene.irregularity or 0.0)}"
    if scene.limits:
        asked = "its limits" if sizing.binding is None else f"its limits, {limit_names()[sizing.binding]} binding"
    if scene.inertia is not None:
        eps = sizing.simulation and figure(sizing.simulation.irregularity, 0.0, 5)
        what = f"given flywheel {figure(scene.inertia, 0.0, 6)} kg m² on {wheel.on}, {speed}: irregularity {eps}"
    elif wheel.needed is False:
        what = f"no flywheel needed for {asked}, {speed}"
    else:
        inertia = figure(wheel.exact or 0.0, inertia_errors(sizing).exact, 6)
        what = f"flywheel {inertia} kg m² on {wheel.on} for {asked}, {speed}"
    title = " ".join(printable(scene.title or "").split())
    title = title if len(title) <= WIDTH else title[: WIDTH - 1] + "…"
    return f"{title}\n{what}" if title else what


def remarks(sizing: Sizing) -> tuple[Remark, ...]:
    """The remarks on a scene, and on what its sizing shows: what is out of proportion."""
    found = list(sizing.scene.remarks)
    if sizing.built is not None:
        found += of_rim(sizing.built.wheel.rim_speed)
    if sizing.drive_work is not None:
        found += of_drive(sizing.drive_work, sizing.energy_fluctuation, sizing.balance is not None)
    return tuple(found)


def _power_flow(sizing: Sizing) -> list[str]:
    """Where the power goes, in a machine that can lose some of it: a table that sums to the input."""
    flow = sizing.power_flow if can_lose(sizing.scene) else None
    return [] if flow is None else power_flow.balance(flow)


def _shafts(sizing: Sizing) -> list[str]:
    """What the mesh of every shaft carries, in the same machines."""
    flow = sizing.power_flow if can_lose(sizing.scene) else None
    return [] if flow is None else power_flow.shafts(flow)


def _title(sizing: Sizing) -> list[str]:
    scene = sizing.scene
    return sentences([*filter(None, [scene.title]), *([f"Source: {scene.source}"] if scene.source else [])], "")


def _scene(sizing: Sizing) -> list[str]:
    """The machine as it was read, and what is out of proportion in it."""
    return [*scene_rows(sizing.scene), *sentences((f"Remark: {remark}" for remark in remarks(sizing)), "")]


# -- speeds ----------------------------------------------------------------------------------------------------------


class SpeedBand(NamedTuple):
    """The greatest and the least speed of the crank (rad/s), and their error."""

    greatest: float
    least: float
    error: float


def speed_band(sizing: Sizing) -> SpeedBand | None:
    """The speeds of the crank as simulated, or else those of the periodic motion; None where there is no motion."""
    confirmed, motion = sizing.simulation, sizing.run
    if confirmed is not None and confirmed.speed_max is not None and confirmed.speed_min is not None:
        off = (sizing.error.simulation or 0.0) * confirmed.irregularity * sizing.speed
        return SpeedBand(confirmed.speed_max, confirmed.speed_min, off)
    if motion is None:
        return None
    return SpeedBand(motion.speed_max, motion.speed_min, motion.error * motion.irregularity * sizing.speed)


def _speeds(sizing: Sizing) -> list[str]:
    """The speeds of the crank and of the flywheel's shaft."""
    scene, confirmed, band = sizing.scene, sizing.simulation, speed_band(sizing)
    if band is None:
        return []
    rows: list[tuple[str, float, float, float | None]] = []
    if sizing.cyclic is not None and scene.unknown is None and scene.speed is not None:  # it takes a speed of its own
        rows.append(("asked for", scene.speed, 0.0, None))
    rows += [
        ("mean of extremes", sizing.speed, 0.0, None),
        ("greatest", band.greatest, band.error, sizing.angle_speed_max),
        ("least", band.least, band.error, sizing.angle_speed_min),
    ]
    if confirmed is not None and confirmed.speed_time_mean is not None:
        rows.append(("mean over time", confirmed.speed_time_mean, band.error, None))
    if scene.flywheel_on != "crank":
        rows.append((f"mean, shaft {scene.flywheel_on}", sizing.speed * scene.flywheel_ratio, 0.0, None))
    cells = []
    for name, speed, error, angle in rows:
        at = "" if angle is None else figure(angle * DEGREES, 1e-9, 7)
        cells.append((name, figure(speed * RPM, error * RPM), figure(speed, error), at))
    keep = slice(4 if sizing.angle_speed_max is not None else 3)
    return ["Speed of the crank", *columns([row[keep] for row in cells], ("", "rpm", "rad/s", "at, deg")[keep])]


# -- how a motion whose torques depend on speed holds itself ---------------------------------------------------------

_LEFT = 0.01  # of a change, when it counts as gone
_NEAR_ONE = 0.01  # of a multiplier to 1: the difference then says more
_NOTHING = 1e-12  # of a damping that rounding makes
_ALIKE = 1e-9  # a multiplier, and 1 less the damping, of a motor with a current too: theirs may turn


def _holding(sizing: Sizing) -> list[str]:
    """The cycle multiplier in words, and the constant speed that the approximate figures hold for."""
    cyclic = sizing.cyclic
    if cyclic is None:
        return []
    change = "what a cycle leaves of a small change of speed"
    rows = [Row("cycle multiplier", figure(cyclic.multiplier, 0.0, 6), change)]
    if _NOTHING < abs(cyclic.damping) < _NEAR_ONE:
        rows.append(Row("1 - multiplier", short(cyclic.damping)))
    if grows(cyclic):
        rows.append(Row("settles", "no", "a change grows from cycle to cycle"))
    elif not settles(cyclic):
        rows.append(Row("settles", "no", "no torque brings a change of speed back"))
    else:
        cycles = settling_cycles(cyclic)
        lasts = cycles * (sizing.scene.cycle / sizing.speed)
        rows.append(Row("settles to 1 % in", figure(cycles, 0.0, 3), f"cycles, {figure(lasts, 0.0, 3)} s"))
    speed = cyclic.constant_speed
    at = f"{figure(speed, 0.0, 7)} rad/s ({figure(speed * RPM, 0.0, 7)} rpm)"
    told = [f"Areas and approximate figures take the torques at a constant {at}."]
    return block("How the motion holds itself", rows) + sentences(told)


def grows(cyclic: Cyclic) -> bool:
    """Whether a small change of speed grows from cycle to cycle."""
    return cyclic.damping < -_NOTHING or cyclic.multiplier > 1.0 + _ALIKE


def settles(cyclic: Cyclic) -> bool:
    """Whether a small change of speed fades."""
    return not grows(cyclic) and cyclic.damping > _NOTHING


def settling_cycles(cyclic: Cyclic) -> float:
    """Cycles after which a hundredth of a small change is left: ln 0.01/ln multiplier, below 1 where it goes faster.

    >>> round(settling_cycles(Cyclic(0.5, 0.5, 3, 0.0, 1.0)), 6)
    6.643856
    """
    if cyclic.multiplier < _LEFT**100:  # nothing is left that a number could show
        return 0.0
    near = cyclic.damping < 0.5 and abs(1.0 - cyclic.damping - cyclic.multiplier) < _ALIKE  # its digits are in damping
    return log(_LEFT) / (log1p(-cyclic.damping) if near else log(cyclic.multiplier))


# -- inertia, areas, simulation --------------------------------------------------------------------------------------


def _inertia(sizing: Sizing) -> list[str]:
    inertia = sizing.reduced_inertia
    if inertia is None or sizing.cycle is None:
        return []
    figures = {"least": inertia.least, "mean over phi": inertia.mean, "greatest": inertia.greatest}
    error = sizing.cycle.errors.inertia
    rows = [Row(name, figure(value, error), "kg m²") for name, value in figures.items()]
    return block("Reduced inertia I* at the crank, without the flywheel", rows)


def _areas(sizing: Sizing) -> list[str]:
    if not sizing.areas:
        return []
    residue = 0.0 if sizing.constant is None else abs(sizing.constant.net)  # of a constant speed found as a root
    work, error = work_error(sizing) + 2 * residue, (sizing.error.angles or 0.0) * DEGREES

    def mark(accumulated: float) -> str:
        marks = (("greatest", sizing.accumulated_max), ("least", sizing.accumulated_min))
        return " and ".join(name for name, extreme in marks if abs(accumulated - extreme) <= 2 * work)

    sums: list[tuple[str, ...]] = [("", "", "", "", "S0", "0", mark(0.0))]
    for k, area in enumerate(sizing.areas, 1):
        ends = ["" if angle is None else figure(angle * DEGREES, error, 8) for angle in (area.start, area.end)]
        accumulated = figure(area.accumulated, work), mark(area.accumulated)
        sums.append((f"A{k}", *ends, figure(area.work, 2 * work), f"S{k}", *accumulated))
    header = ("", "from, deg", "to, deg", "work, J", "", "sum, J", "")
    keep = range(7) if any(area.start is not None for area in sizing.areas) else (0, 3, 4, 5, 6)
    at = "" if sizing.cyclic is None else " at constant speed"
    title = f"Areas of the turning moment{at}, and their accumulated sums"
    return [title, *columns([[row[k] for k in keep] for row in sums], [header[k] for k in keep])]


_ROUTES = {
    "time": "Confirmed by time simulation, on a route of its own",
    "collocation": "Confirmed by periodic collocation, on cells of its own",
    "quadrature": "Motion over a cycle, by quadrature (no time simulation)",
}


def _simulation(sizing: Sizing) -> list[str]:
    motion, relative, asked = sizing.simulation, sizing.error.simulation or 0.0, sizing.scene.irregularity
    if motion is None or motion.route == "areas":
        return []
    error = relative * motion.irregularity
    beside = "" if asked is None else f"(asked {'' if sizing.flywheel.needed else 'at most '}{figure(asked)})"
    rows = [Row("irregularity", irregularity(motion.irregularity, error), beside)]
    if motion.period is not None:
        own = sizing.error.period if sizing.error.period is not None else error
        rows.append(Row("period of a cycle", figure(motion.period, own * motion.period), "s"))
    title = _ROUTES.get(motion.route, "Motion over a cycle")
    return block(title if relative < CONCLUSIVE else "Motion over a cycle, too uncertain to confirm anything", rows)


# -- errors, messages ------------------------------------------------------------------------------------------------


def _errors(sizing: Sizing) -> list[str]:
    titles = {
        "exact": "exact inertia",
        "approximate": "approximate inertia",
        "work": "work",
        "simulation": "simulated irregularity",
    }
    diagram = sizing.scene.areas is not None  # which knows of no other inertia than the areas'
    errors = {title: getattr(sizing.error, name) for name, title in titles.items() if not (diagram and name == "exact")}
    known = [f"{title} {short(error)}" for title, error in errors.items() if error is not None]
    if not known:
        return []
    state = "reached" if sizing.reached else "NOT reached"
    told = [f"Estimated relative errors: {', '.join(known)}; {short(sizing.rtol)} asked, {state}."]
    motion = sizing.simulation
    if motion is not None and motion.closure is not None and motion.route != "areas":
        told.append(f"The motion closes to {short(motion.closure)}: omega at the end over omega at the start, less 1.")
    if sizing.closure and sizing.scene.unknown is None:
        share = "swing" if diagram else "work exchanged"
        told.append(f"The work of a cycle closes to {short(sizing.closure)} of the {share}.")
    return sentences(told, "")


def _notes(sizing: Sizing) -> list[str]:
    """Messages, and the places of the machine that were left out of its graph."""
    notes, machine = list(sizing.messages), sizing.machine
    if machine is not None:
        loose = {*machine.omitted} - {sizing.scene.flywheel_on}
        idle = [name for name, place in machine.places.items() if place.junction in loose]
        if idle:
            notes.append(f"left out, as nothing hangs on it: {', '.join(idle)}")
    return sentences((f"Note: {note}" for note in notes), "")


_FURTHER = {
    NORMAL: "--accuracy confirm or audit confirms them.",
    CONFIRM: "--accuracy audit steps the motion in time.",
    AUDIT: "",
}


def _left_out(sizing: Sizing) -> list[str]:
    """What the level of accuracy leaves out, and which one has it."""
    level = sizing.accuracy
    if sizing.scene.areas is not None:
        return wrapped("A diagram of areas is worked out whole at every level of accuracy.", "")
    if not sizing.left_out:
        return wrapped(f"Nothing was left out at this level of accuracy ({level}).", "")
    return wrapped(f"Left out at this level of accuracy ({level}): {'; '.join(sizing.left_out)}. {_FURTHER[level]}", "")


BLOCKS: tuple[Callable[[Sizing], list[str]], ...] = (
    _title,
    _scene,
    flywheels.flywheel,
    flywheels.limits,
    flywheels.wheel,
    flywheels.every_shaft,
    power.torque_and_work,
    power.with_and_without,
    power.duty,
    _power_flow,
    _shafts,
    _speeds,
    _holding,
    _inertia,
    _areas,
    _simulation,
    _errors,
    _notes,
    _left_out,
)
"""The blocks of the page in their order; one without lines is left out."""
