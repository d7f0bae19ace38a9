"""A sizing as a table of plain text, in the order in which a lecturer or designer reads it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

from flywheel.results import Sizing
from flywheel.writing import outcome
from flywheel.writing.digits import columns, figure, short

WIDTH = 100
_RPM = 9.549296585513721  # rad/s -> rev/min
_DEG = 57.29577951308232
_HORSEPOWER = 745.6998715822702  # W: 550 ft lbf/s
_METRIC_HORSEPOWER = 735.49875  # W: 75 kgf m/s
_FAR_OFF = 1.5  # a factor between approximate and exact that deserves a sentence


def text(sizing: Sizing) -> str:
    """The whole report, at most 100 columns wide, without colours; every figure to the digits that its error leaves.

    >>> import flywheel
    >>> scene = flywheel.load({"areas": {"values": [100, -100], "scale": "1 J"}, "regime": {"speed": "60 rpm"},
    ...                        "flywheel": {"irregularity": 0.02}})
    >>> print(text(flywheel.size(scene)).splitlines()[0])
    Flywheel on the crank for irregularity 0.02 (±1 %, steadiness 50), crank at 60 rpm
    """
    blocks = [block(sizing) for block in _BLOCKS]
    return "\n\n".join("\n".join(lines) for lines in blocks if lines) + "\n"


def irregularity_in_words(eps: float, error: float = 0.0) -> str:
    """An irregularity as its reader may know it: 0.04 (±2 %, steadiness 25)."""
    swing, steadiness = _percent_and_steadiness(eps, error, 6)
    return f"{figure(eps, error)} ({swing} %, steadiness {steadiness})"


def _percent_and_steadiness(eps: float, error: float, most: int) -> tuple[str, str]:
    if eps <= error:
        return ("±0", "without limit") if eps == 0.0 else ("?", "?")
    return f"±{figure(50 * eps, 50 * error, most)}", figure(1 / eps, error / eps**2, most)


def headline(sizing: Sizing) -> str:
    """The result in a line, below the scene's title (cut where it is too long for a picture's heading)."""
    scene, wheel = sizing.scene, sizing.flywheel
    speed = f"crank at {figure(sizing.speed * _RPM, 0.0, 6)} rpm"
    asked = f"irregularity {figure(scene.irregularity or 0.0)}"
    if scene.inertia is not None:
        eps = sizing.simulation and figure(sizing.simulation.irregularity, 0.0, 5)
        what = f"given flywheel {figure(scene.inertia, 0.0, 6)} kg m² on {wheel.on}, {speed}: irregularity {eps}"
    elif wheel.needed is False:
        what = f"no flywheel needed for {asked}, {speed}"
    else:
        inertia = figure(wheel.exact or 0.0, outcome.inertia_errors(sizing).exact, 6)
        what = f"flywheel {inertia} kg m² on {wheel.on} for {asked}, {speed}"
    title = " ".join(_printable(scene.title or "").split())
    title = title if len(title) <= WIDTH else title[: WIDTH - 1] + "…"
    return f"{title}\n{what}" if title else what


def _printable(text: str) -> str:
    return "".join(c if c.isprintable() else " " for c in text)


class Row(NamedTuple):
    """A line of a block: what it is, the figure, its unit and what goes with it."""

    name: str
    value: str
    unit: str = ""


def _block(title: str, rows: Iterable[Row]) -> list[str]:
    lines = columns(rows)
    return [title, *lines] if lines else []


def _title(sizing: Sizing) -> list[str]:
    scene = sizing.scene
    lines = _wrapped(scene.title, "") if scene.title else []
    return lines + (_wrapped(f"Source: {scene.source}", "") if scene.source else [])


def _wrapped(sentence: str, indent: str = "  ") -> list[str]:
    from textwrap import wrap

    return wrap(_printable(sentence), WIDTH, initial_indent=indent, subsequent_indent=indent)


# -- the flywheel ----------------------------------------------------------------------------------------------------


def _flywheel(sizing: Sizing) -> list[str]:
    return _sized(sizing) if sizing.scene.inertia is None else _analysed(sizing)


def _where(sizing: Sizing) -> str:
    """The flywheel's shaft."""
    on, ratio = sizing.flywheel.on, sizing.scene.flywheel_ratio
    return "the crank" if on == "crank" else f"shaft {on} ({figure(ratio)} turns to one of the crank)"


def _rpm(sizing: Sizing) -> str:
    return f"{figure(sizing.speed * _RPM)} rpm"


def _sized(sizing: Sizing) -> list[str]:
    asked = irregularity_in_words(sizing.scene.irregularity or 0.0)
    head = _wrapped(f"Flywheel on {_where(sizing)} for irregularity {asked}, crank at {_rpm(sizing)}", "")
    header = ("", "inertia, kg m²", "off by", "irregularity it gives", "as ± %", "steadiness")
    table = columns([_candidate_cells(c) for c in outcome.candidates(sizing)], header)
    return head + table + _bracket(sizing) + [line for s in _verdicts(sizing) for line in _wrapped(s)]


def _candidate_cells(candidate: outcome.Candidate) -> tuple[str, ...]:
    inertia = _or_unknown(candidate.inertia, candidate.error)
    off = "" if candidate.off is None else f"{figure(100 * candidate.off, 100 * candidate.off_error, 4)} %"
    if candidate.off is not None and candidate.off > 0 and off != "0 %":
        off = "+" + off
    if candidate.gives is None:
        return candidate.name, inertia, off, "no steady motion", "", ""
    eps, error = candidate.gives
    return candidate.name, inertia, off, _or_unknown(eps, error), *_percent_and_steadiness(eps, error, 6)


def _or_unknown(value: float, error: float) -> str:
    """A figure, or a question mark where its error leaves nothing of it."""
    return "?" if 0.0 < value <= error else figure(value, error)


def _bracket(sizing: Sizing) -> list[str]:
    """Proven bounds of the exact flywheel."""
    wheel = sizing.flywheel
    if wheel.bracket is None or wheel.torque_bracket is None or not wheel.needed:
        return []
    errors = outcome.inertia_errors(sizing)
    areas, torque = _bounds(wheel.bracket, errors.approximate), _bounds(wheel.torque_bracket, errors.inertia_torque)
    return _wrapped(f"Proven: exact between {areas} by the areas, {torque} by the torque.")


def _bounds(pair: tuple[float, float], error: float) -> str:
    low, high = (figure(max(bound, 0.0), error, 7) for bound in pair)
    return f"{low} and {high}"


def _verdicts(sizing: Sizing) -> Iterable[str]:
    """In words, what the figures above mean."""
    wheel = sizing.flywheel
    if sizing.scene.areas is not None:
        yield "A diagram of areas tells nothing of the machine's own inertia: the figure is the total inertia needed."
        return
    if wheel.needed is False:
        yield from _without_wheel(sizing)
        return
    exact, approximate = wheel.exact or 0.0, wheel.approximate or 0.0
    dominates = "at this speed the varying inertia of the machine itself dominates."
    if approximate == 0.0:
        yield f"The accumulated areas ask for no flywheel at all, and are wrong: {dominates}"
    elif exact > _FAR_OFF * approximate:
        yield f"The approximate flywheel is {_times(exact / approximate)} times too small: {dominates}"
    elif approximate > _FAR_OFF * exact:
        yield f"The approximate flywheel is {_times(approximate / exact)} times larger than needed: {dominates}"


def _times(factor: float) -> str:
    return f"{factor:.0f}" if factor >= 100 else figure(factor, 0.0, 2)


def _without_wheel(sizing: Sizing) -> Iterable[str]:
    if sizing.run is None:
        yield "No flywheel is needed: nothing acts on the machine that could change its speed."
        return
    eps = irregularity_in_words(sizing.run.irregularity, sizing.run.error * sizing.run.irregularity)
    yield f"No flywheel is needed: the machine's own inertia suffices and gives an irregularity of {eps}."


def _analysed(sizing: Sizing) -> list[str]:
    inertia = figure(sizing.scene.inertia or 0.0)
    lines = _wrapped(f"Given flywheel of {inertia} kg m² on {_where(sizing)}, crank at {_rpm(sizing)}", "")
    motion = sizing.simulation
    if motion is None:
        return lines
    error = (sizing.error.simulation or 0.0) * motion.irregularity
    swing, steadiness = _percent_and_steadiness(motion.irregularity, error, 10)
    rows = [
        Row("irregularity", figure(motion.irregularity, error)),
        Row("as ± %", swing),
        Row("steadiness", steadiness),
    ]
    return lines + columns(rows)


# -- torque, power, energy ------------------------------------------------------------------------------------------


def _energy(sizing: Sizing) -> list[str]:
    work = outcome.work_error(sizing)
    rows = [*_balance(sizing), *_power(sizing)]
    rows.append(Row("energy fluctuation", figure(sizing.energy_fluctuation, 2 * work), "J"))
    if sizing.coefficient_of_energy is not None:
        error = 2 * work / abs(sizing.drive_work or 1.0)
        rows.append(Row("coefficient of energy", figure(sizing.coefficient_of_energy, error), "of the drive's work"))
    elif sizing.scene.drive is None and sizing.scene.areas is None:
        rows.append(Row("power", "none", "(no drive in the scene)"))
    return _block("Torque, power, energy", rows)


def _balance(sizing: Sizing) -> Iterable[Row]:
    balance, scene = sizing.balance, sizing.scene
    if balance is None:
        return
    value = figure(balance.value, outcome.balance_error(sizing))
    if balance.name == "drive" and scene.drive is not None:
        yield Row("torque of the drive (balance)", value, f"N m on {scene.drive.on}")
    else:
        yield Row(f"{balance.name} (balance)", value, "SI")


def _power(sizing: Sizing) -> Iterable[Row]:
    power, work = sizing.power, sizing.drive_work
    if power is None or work is None:
        return
    error = outcome.work_error(sizing) * sizing.speed / sizing.scene.cycle
    scale, unit = (1e3, "kW") if abs(power) >= 1e3 else (1.0, "W")
    horses = " = ".join(
        f"{figure(power / size, error / size, 5)} {name}"
        for size, name in ((_HORSEPOWER, "hp"), (_METRIC_HORSEPOWER, "metric hp"))
    )
    name = "power of the drive" if power >= -error else "power of the drive (it brakes)"
    yield Row(name, figure(power / scale, error / scale), f"{unit} = {horses}")
    yield Row("work of the drive in a cycle", figure(work, outcome.work_error(sizing)), "J")


# -- speeds and inertia ---------------------------------------------------------------------------------------------


def _speeds(sizing: Sizing) -> list[str]:
    found, scene = outcome.speeds(sizing), sizing.scene
    if found is None:
        return []
    rows = [
        _speed_cells("mean of extremes", sizing.speed, 0.0),
        _speed_cells("greatest", found.greatest, found.error, sizing.angle_speed_max),
        _speed_cells("least", found.least, found.error, sizing.angle_speed_min),
    ]
    if sizing.simulation is not None and sizing.simulation.speed_time_mean is not None:
        rows.append(_speed_cells("mean over time", sizing.simulation.speed_time_mean, found.error))
    if scene.flywheel_on != "crank":
        rows.append(_speed_cells(f"mean, shaft {scene.flywheel_on}", sizing.speed * scene.flywheel_ratio, 0.0))
    header = ("", "rpm", "rad/s", "at, deg")
    keep = slice(4 if sizing.angle_speed_max is not None else 3)
    return ["Speed of the crank", *columns([row[keep] for row in rows], header[keep])]


def _speed_cells(name: str, speed: float, error: float, angle: float | None = None) -> tuple[str, ...]:
    at = "" if angle is None else figure(angle * _DEG, 1e-9, 7)
    return name, figure(speed * _RPM, error * _RPM), figure(speed, error), at


def _inertia(sizing: Sizing) -> list[str]:
    inertia = sizing.reduced_inertia
    if inertia is None or sizing.cycle is None:
        return []
    error = sizing.cycle.errors.inertia
    rows = [
        Row(name, figure(value, error), "kg m²")
        for name, value in (
            ("least", inertia.least),
            ("mean over phi", inertia.mean),
            ("greatest", inertia.greatest),
        )
    ]
    return _block("Reduced inertia I* at the crank, without the flywheel", rows)


# -- areas ----------------------------------------------------------------------------------------------------------


def _areas(sizing: Sizing) -> list[str]:
    if not sizing.areas:
        return []
    sums: list[tuple[str, ...]] = [("", "", "", "", "S0", "0", _mark(sizing, 0.0))]
    angles = any(area.start is not None for area in sizing.areas)
    work = outcome.work_error(sizing)
    for k, area in enumerate(sizing.areas, 1):
        where = _angle_cells(sizing, area.start, area.end)
        accumulated = figure(area.accumulated, work)
        cells = (
            f"A{k}",
            *where,
            figure(area.work, 2 * work),
            f"S{k}",
            accumulated,
            _mark(sizing, area.accumulated),
        )
        sums.append(cells)
    header = ("", "from, deg", "to, deg", "work, J", "", "sum, J", "")
    keep = range(7) if angles else (0, 3, 4, 5, 6)
    title = "Areas of the turning moment, and their accumulated sums"
    return [title, *columns([[row[k] for k in keep] for row in sums], [header[k] for k in keep])]


def _angle_cells(sizing: Sizing, *angles: float | None) -> list[str]:
    error = (sizing.error.angles or 0.0) * _DEG
    return ["" if angle is None else figure(angle * _DEG, error, 8) for angle in angles]


def _mark(sizing: Sizing, accumulated: float) -> str:
    near = 2 * outcome.work_error(sizing)
    marks = (("greatest", sizing.accumulated_max), ("least", sizing.accumulated_min))
    return " and ".join(name for name, extreme in marks if abs(accumulated - extreme) <= near)


# -- simulation, errors, messages -----------------------------------------------------------------------------------


_CONCLUSIVE = 0.01  # relative error of a simulation that confirms something
_ROUTES = {
    "time": "Confirmed by time simulation, on a route of its own",
    "quadrature": "Motion over a cycle, by quadrature (no time simulation)",
    "areas": "",
}


def _simulation(sizing: Sizing) -> list[str]:
    motion, relative = sizing.simulation, sizing.error.simulation or 0.0
    if motion is None or motion.route == "areas":
        return []
    error = relative * motion.irregularity
    rows = [Row("irregularity", figure(motion.irregularity, error), _against(sizing))]
    if motion.period is not None:
        doubt = sizing.error.period if sizing.error.period is not None else error
        rows.append(Row("period of a cycle", figure(motion.period, doubt * motion.period), "s"))
    if motion.closure is not None:
        rows.append(Row("closure", short(motion.closure), "omega at the end / omega at the start - 1"))
    title = _ROUTES.get(motion.route, "Motion over a cycle")
    return _block(title if relative < _CONCLUSIVE else "Motion over a cycle, too uncertain to confirm anything", rows)


def _against(sizing: Sizing) -> str:
    asked, needed = sizing.scene.irregularity, sizing.flywheel.needed
    if asked is None:
        return ""
    return f"(asked {figure(asked)})" if needed else f"(asked at most {figure(asked)})"


_ERRORS = (
    ("exact", "exact inertia"),
    ("approximate", "approximate inertia"),
    ("work", "work"),
    ("simulation", "simulated irregularity"),
)


def _errors(sizing: Sizing) -> list[str]:
    found = [f"{title} {short(error)}" for name, title in _ERRORS if (error := getattr(sizing.error, name)) is not None]
    if not found:
        return []
    state = "reached" if sizing.reached else "NOT reached"
    sentence = f"Estimated relative errors: {', '.join(found)}; {short(sizing.rtol)} asked, {state}."
    lines = _wrapped(sentence, "")
    if sizing.closure and sizing.scene.unknown is None:
        share = "swing" if sizing.scene.areas is not None else "work exchanged"
        lines += _wrapped(f"The work of a cycle closes to {short(sizing.closure)} of the {share}.", "")
    return lines


def _notes(sizing: Sizing) -> list[str]:
    notes = list(sizing.messages)
    machine = sizing.machine
    if machine is not None:
        loose = {*machine.omitted} - {sizing.scene.flywheel_on}
        idle = [name for name, place in machine.places.items() if place.junction in loose]
        if idle:
            notes.append(f"left out, as nothing hangs on it: {', '.join(idle)}")
    return [line for note in notes for line in _wrapped(f"Note: {note}", "")]


_BLOCKS: tuple[Callable[[Sizing], list[str]], ...] = (
    _title,
    _flywheel,
    _energy,
    _speeds,
    _inertia,
    _areas,
    _simulation,
    _errors,
    _notes,
)
