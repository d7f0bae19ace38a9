"""A sizing as a table of plain text, in the order in which a lecturer or designer reads it."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from flywheel.numerics.units import columns, figure, short
from flywheel.regime.results import Built, Sizing
from flywheel.report import as_read, figures
from flywheel.report import rows as outcome
from flywheel.report.rows import DEGREES, RPM, WIDTH, Row, block, irregularity, printable, sentences, wrapped
from flywheel.scene.accuracy import AUDIT, CONFIRM, NORMAL


def text(sizing: Sizing) -> str:
    r"""The whole report, at most 100 columns wide, without colours; every figure to the digits that its error leaves.

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
    blocks = [made(sizing) for made in _BLOCKS]
    return "\n\n".join("\n".join(lines) for lines in blocks if lines) + "\n"


def headline(sizing: Sizing) -> str:
    """The result in a line, below the scene's title (cut where it is too long for a picture's heading)."""
    scene, wheel = sizing.scene, sizing.flywheel
    speed = f"crank at {figure(sizing.speed * RPM, 0.0, 6)} rpm"
    asked = f"irregularity {figure(scene.irregularity or 0.0)}"
    if scene.inertia is not None:
        eps = sizing.simulation and figure(sizing.simulation.irregularity, 0.0, 5)
        what = f"given flywheel {figure(scene.inertia, 0.0, 6)} kg m² on {wheel.on}, {speed}: irregularity {eps}"
    elif wheel.needed is False:
        what = f"no flywheel needed for {asked}, {speed}"
    else:
        inertia = figure(wheel.exact or 0.0, outcome.inertia_errors(sizing).exact, 6)
        what = f"flywheel {inertia} kg m² on {wheel.on} for {asked}, {speed}"
    title = " ".join(printable(scene.title or "").split())
    title = title if len(title) <= WIDTH else title[: WIDTH - 1] + "…"
    return f"{title}\n{what}" if title else what


def _title(sizing: Sizing) -> list[str]:
    scene = sizing.scene
    lines = wrapped(scene.title, "") if scene.title else []
    return lines + (wrapped(f"Source: {scene.source}", "") if scene.source else [])


def _wheel(sizing: Sizing) -> list[str]:
    """The wheel to be built, and what the machine does with it."""
    built = sizing.built
    if built is None:
        return []
    from flywheel.report.figures import rows  # only wheels that are built pay for it

    with_it = [] if built.irregularity is None else [_irregularity_with(built.irregularity, built.error)]
    if built.torque is not None:
        with_it.append(Row("torque that bends the arms", figure(built.torque, most=6), f"N m{_whence(sizing)}"))
    return block("The wheel", [*(Row(*row) for row in rows(built.wheel)), *with_it]) + sentences(_as_built(sizing, built))


def _whence(sizing: Sizing) -> str:
    """Where that torque comes from, if not from the scene."""
    asked = sizing.scene.wheel
    return "" if asked is None or asked.torque is not None else ", inertia times the greatest acceleration"


def _as_built(sizing: Sizing, built: Built) -> Iterable[str]:
    """Which figures are those of the wheel, and which those of the inertia that it was made for."""
    given = sizing.scene.inertia
    made_for, which = (sizing.flywheel.exact, "exact") if given is None else (given, "given")
    if made_for and built.wheel.inertia > made_for * (1 + _SAME):
        yield (
            f"Rounded up: it has {figure(built.wheel.inertia, most=7)} kg m² for {figure(made_for, most=7)}. This block and "
            f"the flywheels on every shaft are as built; all other figures are those of the {which} inertia."
        )


def _irregularity_with(eps: float, error: float) -> Row:
    return Row("irregularity with it", irregularity(eps, error * eps))


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
    return block("Reduced inertia I* at the crank, without the flywheel", rows)


# -- areas ----------------------------------------------------------------------------------------------------------


def _areas(sizing: Sizing) -> list[str]:
    if not sizing.areas:
        return []
    sums: list[tuple[str, ...]] = [("", "", "", "", "S0", "0", _mark(sizing, 0.0))]
    angles = any(area.start is not None for area in sizing.areas)
    work = outcome.area_error(sizing)
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
    at = "" if sizing.cyclic is None else " at constant speed"
    title = f"Areas of the turning moment{at}, and their accumulated sums"
    return [title, *columns([[row[k] for k in keep] for row in sums], [header[k] for k in keep])]


def _angle_cells(sizing: Sizing, *angles: float | None) -> list[str]:
    error = (sizing.error.angles or 0.0) * DEGREES
    return ["" if angle is None else figure(angle * DEGREES, error, 8) for angle in angles]


def _mark(sizing: Sizing, accumulated: float) -> str:
    near = 2 * outcome.area_error(sizing)
    marks = (("greatest", sizing.accumulated_max), ("least", sizing.accumulated_min))
    return " and ".join(name for name, extreme in marks if abs(accumulated - extreme) <= near)


# -- simulation, errors, messages -----------------------------------------------------------------------------------


_SAME = 1e-9  # share by which a wheel's inertia may pass the one it is made for, and still be that one
_CONCLUSIVE = 0.01  # relative error of a simulation that confirms something
_ROUTES = {
    "time": "Confirmed by time simulation, on a route of its own",
    "collocation": "Confirmed by periodic collocation, on cells of its own",
    "quadrature": "Motion over a cycle, by quadrature (no time simulation)",
    "areas": "",
}


def _simulation(sizing: Sizing) -> list[str]:
    motion, relative = sizing.simulation, sizing.error.simulation or 0.0
    if motion is None or motion.route == "areas":
        return []
    error = relative * motion.irregularity
    rows = [Row("irregularity", irregularity(motion.irregularity, error), _against(sizing))]
    if motion.period is not None:
        doubt = sizing.error.period if sizing.error.period is not None else error
        rows.append(Row("period of a cycle", figure(motion.period, doubt * motion.period), "s"))
    if motion.closure is not None:
        rows.append(Row("closure", short(motion.closure), "omega at the end / omega at the start - 1"))
    title = _ROUTES.get(motion.route, "Motion over a cycle")
    return block(title if relative < _CONCLUSIVE else "Motion over a cycle, too uncertain to confirm anything", rows)


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
    titles = dict(_ERRORS)
    if sizing.scene.areas is not None:  # which know of no other inertia than the areas'
        del titles["exact"]
    found = [
        f"{title} {short(error)}" for name, title in titles.items() if (error := getattr(sizing.error, name)) is not None
    ]
    if not found:
        return []
    state = "reached" if sizing.reached else "NOT reached"
    sentence = f"Estimated relative errors: {', '.join(found)}; {short(sizing.rtol)} asked, {state}."
    lines = wrapped(sentence, "")
    if sizing.closure and sizing.scene.unknown is None:
        share = "swing" if sizing.scene.areas is not None else "work exchanged"
        lines += wrapped(f"The work of a cycle closes to {short(sizing.closure)} of the {share}.", "")
    return lines


def _notes(sizing: Sizing) -> list[str]:
    notes = list(sizing.messages)
    machine = sizing.machine
    if machine is not None:
        loose = {*machine.omitted} - {sizing.scene.flywheel_on}
        idle = [name for name, place in machine.places.items() if place.junction in loose]
        if idle:
            notes.append(f"left out, as nothing hangs on it: {', '.join(idle)}")
    return [line for note in notes for line in wrapped(f"Note: {note}", "")]


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


def _as_read(sizing: Sizing) -> list[str]:
    """The machine as it was read, and what is out of proportion in it."""
    return [*as_read.page(sizing.scene), *as_read.told(as_read.remarks(sizing))]


_BLOCKS: tuple[Callable[[Sizing], list[str]], ...] = (
    _title,
    _as_read,
    figures.flywheel,
    _wheel,
    figures.every_shaft,
    figures.torque_and_work,
    figures.with_and_without,
    figures.speeds,
    figures.holding,
    _inertia,
    _areas,
    _simulation,
    _errors,
    _notes,
    _left_out,
)
