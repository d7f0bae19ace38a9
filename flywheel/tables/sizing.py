"""A sizing as a table of every figure, in the order in which a lecturer or designer reads it, and as JSON.

To add a block, find its place in `BLOCKS`: each is a function of the sizing that returns its lines, title first. A figure is
written with `figure(value, error)`, which gives it the digits that its error leaves. The flywheels (`candidates`, absolute
errors) are shared by the summary and the pictures.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from math import log, log1p, nan, pi
from typing import Any, NamedTuple

from flywheel.components.gear_trains import OnShaft, gd2
from flywheel.components.wheels import ROUNDING, Wheel
from flywheel.language import text as _
from flywheel.machine.equation import NoMotionError
from flywheel.numerics import cells
from flywheel.numerics.faults import Remark
from flywheel.numerics.units import columns, figure, short
from flywheel.reading.scenes import of_drive, of_rim
from flywheel.regime import turning_moment
from flywheel.regime.turning_moment import Run
from flywheel.scene.scene import AUDIT, CONFIRM, NORMAL, PROOF
from flywheel.sizing.findings import work_error
from flywheel.sizing.power_flow import can_lose
from flywheel.sizing.results import Sizing, Stability
from flywheel.tables import power
from flywheel.tables.rows import (
    DEGREES,
    NOTHING,
    RPM,
    WIDTH,
    Row,
    block,
    encoded,
    irregularity,
    irregularity_in_words,
    or_unknown,
    paragraphs,
    percent_and_steadiness,
    rpm,
    sentences,
    wrapped,
)
from flywheel.tables.scene import scene_rows

_FAR_OFF = 1.5  # a factor between approximate and exact that deserves a sentence
_DIGITS = 6


# -- figures and their absolute errors -------------------------------------------------------------------------------


def inertia_error(sizing: Sizing, name: str = "exact") -> float:
    """Absolute error (kg m², at its own shaft) of a figure of the flywheel: estimates are relative to the larger scale."""
    wheel, error = sizing.flywheel, sizing.error
    scale = max(wheel.exact or 0.0, wheel.approximate_total or 0.0)
    return (getattr(error, name) or 0.0) * max(scale, getattr(wheel, name) or 0.0)


class Candidate(NamedTuple):
    """One flywheel (kg m² at its own shaft): its relative difference from the exact one, and the resulting irregularity.

    `gives` is (irregularity, its absolute error), (0, 0) if nothing acts, or None if the machine would stop in
    the cycle; `motion` is the run that gave it, None for a diagram of areas. `only_bound` says that this flywheel keeps the
    irregularity, and that it is unknown whether a lighter one does.
    """

    key: str
    name: str
    inertia: float
    error: float
    off: float | None
    off_error: float
    gives: tuple[float, float] | None
    motion: Run | None
    only_bound: bool = False


_CANDIDATES = {
    "exact": ("exact (Wittenbauer)", "exact"),
    "approximate": ("accumulated areas", "by the areas"),
    "inertia_torque_flywheel": ("inertia torque", "by the torque"),
}
"""The keys of the figures, each with its name in tables and in sentences."""


def candidates(sizing: Sizing, motions: bool = True) -> list[Candidate]:
    """The exact flywheel and the approximate ones; for a diagram of areas, where they are equal, only one.

    Without `motions` the irregularity with the approximate ones is not computed and is NaN.
    """
    wheel = sizing.flywheel
    exact, exact_error = wheel.exact or 0.0, inertia_error(sizing)
    if sizing.scene.areas is not None:
        target = (sizing.scene.irregularity or 0.0, 0.0)
        return [Candidate("approximate", "accumulated areas", exact, exact_error, None, 0.0, target, None)]
    rows = []
    for key, (name, _label) in _CANDIDATES.items() if sizing.approximated else (("exact", _CANDIDATES["exact"]),):
        inertia, error = getattr(wheel, key) or 0.0, inertia_error(sizing, key)
        off = inertia / exact - 1 if exact > exact_error and key != "exact" else None
        off_error = 2 * (error + exact_error) / exact if exact > 0.0 else 0.0
        looked = motions or key == "exact"
        motion = _motion_with(sizing, inertia) if looked else None
        confirmed, simulated = sizing.simulation, None
        if confirmed is not None:
            own = {"exact": confirmed.irregularity, "approximate": confirmed.irregularity_approximate}
            simulated = own.get(key)
        gives: tuple[float, float] | None = None if looked else (nan, 0.0)
        if simulated is not None:
            gives = simulated, (sizing.error.simulation or 0.0) * simulated
        elif motion is not None:
            gives = motion.irregularity, motion.error * motion.irregularity
        elif looked and sizing.run is None and sizing.energy_fluctuation <= work_error(sizing):
            gives = 0.0, 0.0  # nothing acts; else the machine would stop
        run, eps = sizing.run, sizing.scene.irregularity or 0.0
        only_bound = key == "exact" and error >= inertia and run is not None and run.irregularity < eps
        rows.append(Candidate(key, name, inertia, error, off, off_error, gives, motion, only_bound))
    return rows


def inertia_cell(one: Candidate, written: Callable[[float, float], str], times: float = 1.0) -> str:
    """The inertia, or a multiple of it, by `written` with its error; a question mark if no digit is certain."""
    if one.only_bound:
        return f"≤ {written(times * one.inertia, 0.0)}"
    return "?" if 0.0 < one.inertia <= one.error else written(times * one.inertia, times * one.error)


def _motion_with(sizing: Sizing, inertia: float) -> Run | None:
    """Steady motion with a flywheel (kg m² at its own shaft); None if the machine would stop within the cycle."""
    if sizing.cycle is None:
        return None
    on_crank = inertia * sizing.scene.flywheel_ratio**2
    if (
        sizing.run is not None and abs(on_crank - sizing.run.inertia) <= ROUNDING * on_crank
    ):  # divided by the ratio, and multiplied
        return sizing.run
    try:
        if sizing.machine is None or not sizing.machine.sets_its_speed:
            return turning_moment.run(sizing.cycle, sizing.speed, on_crank)
        from flywheel.sizing.speed_dependent import run_with

        constant, stored = sizing.constant or sizing.cycle, sizing.run is not None
        return run_with(sizing.machine, constant, sizing.speed, on_crank, sizing.rtol, stored=stored)
    except NoMotionError:
        return None


# -- the first block -------------------------------------------------------------------------------------------------


def flywheel(sizing: Sizing) -> list[str]:
    """The candidates of a sizing with proven bounds and verdicts; the figures of a given flywheel."""
    scene, at = sizing.scene, f"crank at {rpm(sizing.speed)}"
    on, ratio = sizing.flywheel.on, scene.flywheel_ratio
    shaft = "the crank" if on == "crank" else f"shaft {on} ({figure(ratio)} turns to one of the crank)"
    if scene.inertia is not None:
        lines = wrapped(f"Given flywheel of {figure(scene.inertia)} kg m² on {shaft}, {at}", "")
        motion = sizing.simulation
        if motion is None:
            return lines
        error = (sizing.error.simulation or 0.0) * motion.irregularity
        deviation, steadiness = percent_and_steadiness(motion.irregularity, error, 10)
        rows = [
            Row("irregularity", irregularity(motion.irregularity, error)),
            Row("as ± %", deviation),
            Row("steadiness", steadiness),
            Row("GD² of the flywheel", figure(gd2(scene.inertia)), "kg m²"),
        ]
        return lines + columns(rows)
    if scene.limits:
        head = wrapped(f"Flywheel on {shaft} for the limits below, {at}", "")
    else:
        head = wrapped(f"Flywheel on {shaft} for irregularity {irregularity_in_words(scene.irregularity or 0.0)}, {at}", "")
    header = ("", "inertia, kg m²", "error", "irregularity it gives", "as ± %", "steadiness")
    wheels = candidates(sizing)
    cells = [_cells(candidate) for candidate in wheels]
    table = columns(cells, header)
    if max(map(len, table)) > WIDTH:
        table = columns(cells, header, gap=" ", indent=" ")
    return head + table + sentences([*_proven(sizing), *_in_gd2(sizing, wheels), *_verdicts(sizing)])


def limits(sizing: Sizing) -> list[str]:
    """The limits of the flywheel: the used share of each, and the one that decides."""
    if not sizing.limits:
        return []
    header, names = ("", "asked", "with it", "of the limit", "alone it needs, kg m²", ""), limit_names()
    rows = []
    for name, limit in sizing.limits.items():
        error = 100 * limit.reached_error * limit.reached
        used = figure(100 * limit.reached / limit.requirement, error / limit.requirement, 5)
        shares = (figure(100 * limit.requirement, most=6), figure(100 * limit.reached, error, _DIGITS), used)
        alone = figure(limit.alone, limit.alone_error * limit.alone, _DIGITS) if limit.alone > 0.0 else "none"
        binds = "binds" if name == sizing.binding else ""
        rows.append((names[name], *(f"{share} %" for share in shares), alone, binds))
    lines = []
    if sizing.binding is None:
        lines.append("The machine's own inertia keeps all of them: none binds.")
    if sizing.scene.irregularity is not None and not sizing.approximated:
        lines.append("Approximate flywheels take only the irregularity into account, and are left out.")
    return ["Limits", *columns(rows, header), *sentences(lines)]


def _cells(candidate: Candidate) -> tuple[str, ...]:
    inertia = inertia_cell(candidate, figure)
    off = "" if candidate.off is None else f"{figure(100 * candidate.off, 100 * candidate.off_error, 4)} %"
    if candidate.off is not None and candidate.off > 0 and off != "0 %":
        off = "+" + off
    if candidate.gives is None:
        return candidate.name, inertia, off, "no steady motion", "", ""
    eps, error = candidate.gives
    gives = or_unknown(eps, error) if eps > NOTHING else "0"
    return candidate.name, inertia, off, gives, *percent_and_steadiness(eps, error, 6)


def _proven(sizing: Sizing) -> Iterator[str]:
    """Proven bounds of the exact flywheel."""
    wheel = sizing.flywheel
    if wheel.proven_bounds is None or wheel.proven_bounds_torque is None or not wheel.needed:
        return
    areas, torque = (
        " and ".join(figure(max(bound, 0.0), error, 7) for bound in pair)
        for pair, error in (
            (wheel.proven_bounds, inertia_error(sizing, "approximate")),
            (wheel.proven_bounds_torque, inertia_error(sizing, "inertia_torque")),
        )
    )
    yield f"Proven bounds: exact between {areas} by the areas, {torque} by the torque."


def _in_gd2(sizing: Sizing, rows: list[Candidate]) -> Iterator[str]:
    """The inertias as GD², and the totals of the approximate ones."""
    if any(candidate.inertia > 0.0 for candidate in rows):
        each = [f"{inertia_cell(c, partial(figure, most=_DIGITS), gd2(1.0))} {_CANDIDATES[c.key][1]}" for c in rows]
        yield f"GD² = 4 J: {', '.join(each)}, kg m²."
    wheel = sizing.flywheel
    if len(rows) > 1 and wheel.approximate_total and wheel.inertia_torque:
        areas = or_unknown(wheel.approximate_total, inertia_error(sizing, "approximate"), _DIGITS)
        torque = or_unknown(wheel.inertia_torque, inertia_error(sizing, "inertia_torque"), _DIGITS)
        yield f"With the machine's own least inertia, as totals: {areas} by the areas, {torque} by the torque."


def _verdicts(sizing: Sizing) -> Iterator[str]:
    """Sentences that interpret the figures above."""
    wheel, run = sizing.flywheel, sizing.run
    if sizing.scene.areas is not None:
        yield "A diagram of areas does not contain the machine's own inertia: the figure is the total inertia needed."
        return
    if wheel.needed is False:
        none = "No flywheel is needed"
        if run is not None:
            eps = irregularity_in_words(run.irregularity, run.error * run.irregularity)
            yield f"{none}: the machine's own inertia suffices and gives an irregularity of {eps}."
        elif sizing.energy_fluctuation > 0.0:
            yield f"{none}: the machine has no inertia, and its torques alone hold its speed as evenly as asked."
        else:
            yield f"{none}: nothing acts on the machine that could change its speed."
        return
    if not sizing.approximated or inertia_error(sizing) >= (wheel.exact or 0.0):
        return
    exact, approximate = wheel.exact or 0.0, wheel.approximate or 0.0
    if sizing.cyclic is not None:
        why = "it leaves out the machine's own varying inertia, and takes torques at a constant speed."
    else:
        why = "at this speed the varying inertia of the machine itself dominates."
    if approximate == 0.0:
        yield f"The accumulated areas give no flywheel at all, and are wrong: {why}"
    elif exact > _FAR_OFF * approximate:
        yield f"The approximate flywheel is {_times(exact / approximate)} times too small: {why}"
    elif approximate > _FAR_OFF * exact:
        yield f"The approximate flywheel is {_times(approximate / exact)} times larger than needed: {why}"


def _times(factor: float) -> str:
    return f"{factor:.0f}" if factor >= 100 else figure(factor, 0.0, 2)


# -- the wheel as built ----------------------------------------------------------------------------------------------

_COMPARED = {
    "disc": "the lightest disc instead",
    "rim": "the lightest rim instead",
    "arms": "the lightest rim on arms instead",
}


def wheel(sizing: Sizing) -> list[str]:
    """The wheel to be built, and the machine's irregularity with it."""
    built, scene = sizing.built, sizing.scene
    if built is None:
        return []
    rows = wheel_rows(built.wheel)
    if built.irregularity is not None:
        rows.append(Row("irregularity with it", irregularity(built.irregularity, built.error * built.irregularity)))
    if built.torque is not None:
        has_torque = scene.wheel is None or scene.wheel.torque is not None
        whence = "" if has_torque else ", inertia times the greatest acceleration"
        rows.append(Row("torque that bends the arms", figure(built.torque, most=6), f"N m{whence}"))
    lines = block("The wheel", rows)
    made_for, which = (sizing.flywheel.exact, "exact") if scene.inertia is None else (scene.inertia, "given")
    if made_for and built.wheel.inertia > made_for * (1 + cells.TIE):
        lines += wrapped(
            f"Rounded up: it has {figure(built.wheel.inertia, most=7)} kg m² for {figure(made_for, most=7)}. This block and "
            f"the flywheels on every shaft are as built; all other figures are those of the {which} inertia."
        )
    return lines


def wheel_rows(wheel: Wheel) -> list[Row]:
    """All figures of a wheel: dimensions in mm, stresses in MPa.

    >>> from flywheel.wheel import WheelAsked, choose
    >>> from flywheel.components.wheel_stresses import material
    >>> wheel = choose(10.0, 100.0, WheelAsked("disc", material("carbon steel"), outer_radius=0.3))
    >>> [row[:3] for row in wheel_rows(wheel)[:3]]
    [('shape', 'disc', ''), ('material', 'carbon steel', ''), ('outer radius', '300', 'mm')]
    """
    body, allowable = wheel.body, wheel.material.allowable
    rows = [
        Row("shape", f"{wheel.shape}, taken as thin" if body.thin else wheel.shape),
        Row("material", wheel.material.name),
        _size("outer radius", body.outer),
    ]
    if wheel.shape != "disc":
        rows += [_size("mean radius", body.mean), _size("thickness", body.thickness)]
    rows.append(_size("width", body.width))
    if wheel.shape == "disc" and body.inner > 0.0:
        rows.append(_size("bore", 2 * body.inner))
    if body.arms is not None:
        arms = body.arms
        rows += [Row("arms", str(arms.number)), _size("arm width", arms.width), _size("arm thickness", arms.thickness)]
    if body.hub is not None:
        hub = body.hub
        rows += [_size("bore", hub.bore), _size("hub diameter", hub.diameter), _size("hub length", hub.length)]
    rows += [
        _quantity("mass", wheel.mass, "kg"),
        Row("inertia", figure(wheel.inertia), "kg m²"),
        Row("GD²", figure(gd2(wheel.inertia)), "kg m²"),
    ]
    if len(wheel.parts) > 1:
        rows += [_quantity(f"mass, {part.name}", part.mass, "kg") for part in wheel.parts if part.mass is not None]
        rows += [_quantity(f"inertia, {part.name}", part.inertia, "kg m²") for part in wheel.parts]
    rows.append(_quantity("rim speed", wheel.rim_speed, "m/s"))
    for place, stress in wheel.stresses.items():
        fits = allowable is None or stress <= allowable * (1 + ROUNDING)
        rows.append(_quantity(f"stress, {place}", stress / 1e6, "MPa" if fits else "MPa, above the allowable"))
    if allowable is not None:
        rows.append(_quantity("allowable stress", allowable / 1e6, "MPa"))
    if wheel.safety is not None:
        against = "strength" if wheel.material.strength is not None else "allowable stress"
        rows.append(_quantity(f"safety factor, by {against}", wheel.safety, ""))
    others = {shape: mass for shape, mass in wheel.compared.items() if shape != wheel.shape}
    return [*rows, *(_quantity(_COMPARED[shape], mass, "kg") for shape, mass in others.items())]


def _quantity(name: str, value: float, unit: str) -> Row:
    return Row(name, figure(value, most=_DIGITS), unit)


def _size(name: str, length: float) -> Row:
    return _quantity(name, length * 1e3, "mm")


# -- every shaft -----------------------------------------------------------------------------------------------------


def every_shaft(sizing: Sizing) -> list[str]:
    """The same flywheel on every shaft, if there are several."""
    if len(sizing.shafts) < 2 or sizing.flywheel.needed is False:
        return []
    lines = ["The same flywheel on every shaft", *shafts_table(sizing.shafts, _DIGITS)]
    if sizing.built is not None:
        lines += wrapped("Inertias and masses are those of the wheel above as built, made wider or narrower at its radii.")
    if sizing.scene.efficiencies:
        lines += wrapped("Each stores the same energy; losses in meshes may make the speed vary a little more or less.")
    return lines


def shafts_table(rows: Sequence[OnShaft], digits: int = 6) -> list[str]:
    """One line per shaft under a header; radius, mass and rim speed if known.

    >>> from flywheel.components.gear_trains import on_every_shaft
    >>> shafts = on_every_shaft(8.0, {"crank": 1.0, "motor": 2.0}, pi, radius=0.5)
    >>> for line in shafts_table(shafts):
    ...     print(line)
      shaft  speed, rpm  inertia, kg m²  GD², kg m²  radius, m  mass, kg  rim speed, m/s
      crank          30               8          32        0.5        32         1.5708
      motor          60               2           8        0.5         8         3.14159

    """
    rims = any(row.radius is not None for row in rows)
    cells = []
    for row in rows:
        values = [row.speed * 30 / pi, row.inertia, row.gd2, *([row.radius, row.mass, row.rim_speed] if rims else [])]
        cells.append([row.shaft, *("" if value is None else figure(value, 0.0, digits) for value in values)])
    header = ("shaft", "speed, rpm", "inertia, kg m²", "GD², kg m²")
    return columns(cells, (*header, "radius, m", "mass, kg", "rim speed, m/s") if rims else header)


def limit_names() -> dict[str, str]:
    """Names of the quantities that `[flywheel.limits]` may limit together."""
    return {
        "irregularity": _("irregularity"),
        "motor_torque": _("greatest torque of the motor"),
        "motor_rms": _("rms torque of the motor"),
        "motor_heat": _("heat of the motor"),
        "current_pulsation": _("pulsation of the motor's current"),
    }


# -- the whole table ------------------------------------------------------------------------------------------------------


CONCLUSIVE = 0.01  # greatest relative error of a simulation that confirms


def text(sizing: Sizing) -> str:
    r"""The full listing, at most 100 columns wide, without colours; every figure to the digits that its error leaves.

    >>> import flywheel
    >>> scene = flywheel.load({"areas": {"values": [100, -100], "scale": "1 J"}, "regime": {"speed": "60 rpm"},
    ...                        "flywheel": {"irregularity": 0.02}})
    >>> print(*text(flywheel.size(scene)).splitlines()[:5], sep="\n")
    Input summary
      areas  100, -100, times 1 J
      runs   crank at 60 rpm, flywheel on crank for irregularity 0.02
    <BLANKLINE>
    Flywheel on the crank for irregularity 0.02 (±1 %, steadiness 50), crank at 60 rpm
    """
    return paragraphs(lines(sizing) for lines in BLOCKS)


def json(sizing: Sizing, explanation: Mapping[str, Any] | None = None) -> str:
    """JSON that `flywheel size --json` prints: the sizing, SI throughout, and its explanation if there is one."""
    extra = {} if explanation is None else {"explanation": explanation}
    return encoded({**sizing.as_dict(), **extra}, indent=2)


def remarks(sizing: Sizing) -> tuple[Remark, ...]:
    """The remarks on a scene and on its sizing: numbers out of proportion."""
    lines = list(sizing.scene.remarks)
    if sizing.built is not None:
        lines += of_rim(sizing.built.wheel.rim_speed)
    if sizing.drive_work is not None:
        lines += of_drive(sizing.drive_work, sizing.energy_fluctuation, sizing.balance is not None)
    return tuple(lines)


def _power_flow(sizing: Sizing) -> list[str]:
    """Power flow of a machine with possible losses: a table that sums to the input."""
    flow = sizing.power_flow if can_lose(sizing.scene) else None
    return [] if flow is None else power.balance(flow)


def _shafts(sizing: Sizing) -> list[str]:
    """Torque and power through the mesh of every shaft, in the same machines."""
    flow = sizing.power_flow if can_lose(sizing.scene) else None
    return [] if flow is None else power.shafts(flow)


def _title(sizing: Sizing) -> list[str]:
    scene = sizing.scene
    return sentences([*filter(None, [scene.title]), *([f"Source: {scene.source}"] if scene.source else [])], "")


def _scene(sizing: Sizing) -> list[str]:
    """Input summary, and remarks on its numbers."""
    return [*scene_rows(sizing.scene), *sentences((f"Remark: {remark}" for remark in remarks(sizing)), "")]


# -- speeds ----------------------------------------------------------------------------------------------------------


def speed_band(sizing: Sizing) -> tuple[float, float, float] | None:
    """The greatest and the least speed of the crank (rad/s), and their error; None without a motion.

    They are the simulated ones, or else those of the periodic motion.
    """
    confirmed, motion = sizing.simulation, sizing.run
    if confirmed is not None:
        off = (sizing.error.extreme_speeds or 0.0) * confirmed.speed_max
        return confirmed.speed_max, confirmed.speed_min, off
    if motion is None:
        return None
    return motion.speed_max, motion.speed_min, motion.error * motion.irregularity * sizing.speed


def _speeds(sizing: Sizing) -> list[str]:
    """The speeds of the crank and of the flywheel's shaft."""
    scene, confirmed, band = sizing.scene, sizing.simulation, speed_band(sizing)
    if band is None:
        return []
    greatest, least, off = band
    rows: list[tuple[str, float, float, float | None]] = []
    if sizing.cyclic is not None and scene.unknown is None and scene.speed is not None:  # it takes a speed of its own
        rows.append(("asked for", scene.speed, 0.0, None))
    rows += [
        ("mean of extremes", sizing.speed, 0.0, None),
        ("greatest", greatest, off, sizing.angle_speed_max),
        ("least", least, off, sizing.angle_speed_min),
    ]
    if confirmed is not None and confirmed.speed_time_mean is not None:
        mean = confirmed.speed_time_mean
        rows.append(("mean over time", mean, (sizing.error.period or 0.0) * mean, None))
    if scene.flywheel_on != "crank":
        rows.append((f"mean, shaft {scene.flywheel_on}", sizing.speed * scene.flywheel_ratio, 0.0, None))
    cells = []
    for name, speed, error, angle in rows:
        at = "" if angle is None else figure(angle * DEGREES, 1e-9, 7)
        cells.append((name, figure(speed * RPM, error * RPM), figure(speed, error), at))
    keep = slice(4 if sizing.angle_speed_max is not None else 3)
    return ["Speed of the crank", *columns([row[keep] for row in cells], ("", "rpm", "rad/s", "at, deg")[keep])]


# -- how a motion whose torques depend on speed holds itself ---------------------------------------------------------

_LEFT = 0.01  # fraction of a change at which it counts as gone
_NEAR_ONE = 0.01  # of a multiplier to 1: the difference then says more
_DAMPING_ROUNDING = 1e-12  # of a damping that rounding makes
_ALIKE = 1e-9  # a multiplier, and 1 less the damping, of a motor with a current too: theirs may turn


def _holding(sizing: Sizing) -> list[str]:
    """The cycle multiplier in words, and the constant speed of the approximate figures."""
    cyclic = sizing.cyclic
    if cyclic is None:
        return []
    change = "fraction of a small change of speed left after a cycle"
    rows = [Row("cycle multiplier", figure(cyclic.multiplier, 0.0, 6), change)]
    if _DAMPING_ROUNDING < abs(cyclic.damping) < _NEAR_ONE:
        rows.append(Row("1 - multiplier", short(cyclic.damping)))
    if grows(cyclic):
        rows.append(Row("settles", "no", "a change grows from cycle to cycle"))
    elif not settles(cyclic):
        rows.append(Row("settles", "no", "no torque corrects a change of speed"))
    else:
        cycles = settling_cycles(cyclic)
        lasts = cycles * (sizing.scene.cycle / sizing.speed)
        rows.append(Row("settles to 1 % in", figure(cycles, 0.0, 3), f"cycles, {figure(lasts, 0.0, 3)} s"))
    speed = cyclic.constant_speed
    at = f"{figure(speed, 0.0, 7)} rad/s ({figure(speed * RPM, 0.0, 7)} rpm)"
    lines = [f"Areas and approximate figures take the torques at a constant {at}."]
    return block("Stability of the motion", rows) + sentences(lines)


def grows(cyclic: Stability) -> bool:
    """Tests whether a small change of speed grows from cycle to cycle."""
    return cyclic.damping < -_DAMPING_ROUNDING or cyclic.multiplier > 1.0 + _ALIKE


def settles(cyclic: Stability) -> bool:
    """Tests whether a small change of speed decays."""
    return not grows(cyclic) and cyclic.damping > _DAMPING_ROUNDING


def settling_cycles(cyclic: Stability) -> float:
    """Cycles after which a hundredth of a small change remains: ln 0.01/ln multiplier, below 1 if it decays faster.

    >>> round(settling_cycles(Stability(0.5, 0.5, 3, 0.0, 1.0)), 6)
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
    figures = {"min": inertia.min, "mean over phi": inertia.mean, "max": inertia.max}
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
    "time": "Confirmed by time simulation, an independent route",
    "collocation": "Confirmed by periodic collocation, on separate cells",
    "quadrature": "Motion over a cycle, by quadrature (no time simulation)",
}


def _simulation(sizing: Sizing) -> list[str]:
    motion, relative, requirement = sizing.simulation, sizing.error.simulation or 0.0, sizing.scene.irregularity
    if motion is None or motion.route == "areas":
        return []
    error = relative * motion.irregularity
    beside = "" if requirement is None else f"(asked {'' if sizing.flywheel.needed else 'at most '}{figure(requirement)})"
    rows = [Row("irregularity", irregularity(motion.irregularity, error), beside)]
    if motion.period is not None:
        own = sizing.error.period if sizing.error.period is not None else error
        rows.append(Row("period of a cycle", figure(motion.period, own * motion.period), "s"))
    title = _ROUTES.get(motion.route, "Motion over a cycle")
    return block(title if relative < CONCLUSIVE else "Motion over a cycle, too uncertain to confirm the figures", rows)


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
    parts = [f"{title} {short(error)}" for title, error in errors.items() if error is not None]
    if not parts:
        return []
    state = "reached" if sizing.reached else "NOT reached"
    lines = [f"Estimated relative errors: {', '.join(parts)}; {short(sizing.rtol)} asked, {state}."]
    motion = sizing.simulation
    if motion is not None and motion.closure is not None and motion.route != "areas":
        lines.append(f"The motion closes to {short(motion.closure)}: omega at the end over omega at the start, less 1.")
    if sizing.closure and sizing.scene.unknown is None:
        share = "swing" if diagram else "work exchanged"
        lines.append(f"The work of a cycle closes to {short(sizing.closure)} of the {share}.")
    return sentences(lines, "")


def _notes(sizing: Sizing) -> list[str]:
    """Messages, and the parts of the machine that were left out of its graph."""
    notes, machine = list(sizing.messages), sizing.machine
    if machine is not None:
        loose = {*machine.omitted} - {sizing.scene.flywheel_on}
        idle = [name for name, place in machine.places.items() if place.junction in loose]
        if idle:
            notes.append(f"left out, as nothing depends on it: {', '.join(idle)}")
    return sentences((f"Note: {note}" for note in notes), "")


def _proof(sizing: Sizing) -> list[str]:
    """Proven intervals of the figures, and a statement of the proof; empty at other levels than proof."""
    proof = sizing.proof
    if proof is None:
        return []
    if proof.reason:
        return wrapped(f"Nothing is proven: {proof.reason}.", "")
    rows = [f"  {name:<33} {low!r:>23} to {high!r:>23}" for name, (low, high) in proof.figures.items()]
    return ["Proven intervals (SI)", *rows, *wrapped(f"{proof.statement}.", "")]


_FURTHER = {
    NORMAL: "--accuracy confirm or audit confirms them.",
    CONFIRM: "--accuracy audit steps the motion in time.",
    AUDIT: "",
    PROOF: "--accuracy confirm or audit confirms them.",
}


def _left_out(sizing: Sizing) -> list[str]:
    """Sentence on the omissions of the level of accuracy, and the level that includes them."""
    level = sizing.accuracy
    if sizing.scene.areas is not None:
        return wrapped("A diagram of areas is solved completely at every level of accuracy.", "")
    if not sizing.left_out:
        return wrapped(f"Nothing was left out at this level of accuracy ({level}).", "")
    return wrapped(f"Left out at this level of accuracy ({level}): {'; '.join(sizing.left_out)}. {_FURTHER[level]}", "")


BLOCKS: tuple[Callable[[Sizing], list[str]], ...] = (
    _title,
    _scene,
    flywheel,
    limits,
    wheel,
    every_shaft,
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
    _proof,
    _notes,
    _left_out,
)
"""The blocks of the full listing in their order; one without lines is left out."""
