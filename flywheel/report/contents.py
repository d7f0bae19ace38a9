"""The worked report of a scene, from its title to its references, as HTML or PDF."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import nullcontext
from typing import Any

from flywheel import language as languages
from flywheel.language import text as _
from flywheel.machine.machine import Machine
from flywheel.numerics.faults import SceneError
from flywheel.numerics.units import QuantityError, parse_quantity
from flywheel.report import document as documents
from flywheel.report import drive, regime, sheet, solutions, train, wheel
from flywheel.report.document import Cell, Document, Listing, Note, Part, Section, Table
from flywheel.report.regime import Known
from flywheel.report.solutions import Solution
from flywheel.scene.scene import Scene
from flywheel.sizing.results import Sizing
from flywheel.sizing.sizing import size
from flywheel.tables.sizing import remarks

Given = Sizing | Machine | Scene
"""What a report is of."""

PAGES = ("all", "summary")
"""How much of a report there is: all of it, or its first page."""

_MOST_ROWS = 400  # of a scene's table


def html(
    given: Given,
    *,
    language: str | None = None,
    units: str = "si",
    printed: Solution | None = None,
    page: str = PAGES[0],
) -> str:
    """The report of a sizing, or of a scene, which is then sized, as one HTML file.

    Args:
        given: a sizing; or a machine or a scene. One without a flywheel, or that goes one way, gives what it has.
        language: "en" or "es"; the language in use if None.
        units: "si", or "us": results in US customary units beside.
        printed: a printed solution to be set beside ours, as `flywheel.report.solutions.solution` reads it.
        page: "all", or "summary" for the first page alone, which a designer signs.

    Raises:
        SceneError: if the machine cannot run as its scene says.
        ValueError: for another language, other units, another page.

    """
    if page not in PAGES:
        raise ValueError(f"found the page {page!r}, expected all or summary")
    if units not in ("si", "us"):
        raise ValueError(f"found the units {units!r}, expected si or us")
    with nullcontext() if language is None else languages.use(language):
        return documents.html(worked(given, customary=units == "us", printed=printed, page=page))


def worked(given: Given, *, customary: bool = False, printed: Solution | None = None, page: str = PAGES[0]) -> Document:
    """The report as a document, in the language in use; a machine without a flywheel has no summary."""
    scene = given if isinstance(given, Scene) else given.scene
    found = given if isinstance(given, Sizing) else sized(given)
    sizing = found if isinstance(found, Sizing) else None
    alone = page == "summary" and sizing is not None
    parts = () if alone else tuple(_parts(scene, sizing, given, printed))
    title = " ".join((scene.title or _("Machine")).split())
    first = "" if sizing is None else sheet.sheet(sizing, customary)
    return Document(title, _subtitle(scene, sizing, alone), parts, customary, first, sheet.STYLE if first else "")


def sized(given: Machine | Scene, rtol: float | None = None, accuracy: str | None = None) -> Sizing | Machine | Scene:
    """The sizing of a machine, or the machine as it is where it lacks what a flywheel needs."""
    scene = given if isinstance(given, Scene) else given.scene
    return given if _missing(scene) else size(given, rtol, accuracy=accuracy)


def _missing(scene: Scene) -> str:
    """Why there can be no steady regime with a flywheel; nothing where there can."""
    if scene.stroke is not None:
        return _("The machine goes one way, from one end of its stroke to the other: it has no cycle, and so no flywheel.")
    if not scene.has_flywheel:
        return _("The scene has no [flywheel], neither an irregularity to size it for nor an inertia.")
    if not scene.has_speed:
        return _("The scene gives no speed, and nothing in it sets one.")
    return ""


def _subtitle(scene: Scene, sizing: Sizing | None, alone: bool) -> str:
    """What the report says, or that it is the first page alone."""
    if sizing is None:
        return _("Worked report")
    speed = regime.quantity(sizing.speed, "rpm", 5)
    if alone:
        return _("Data sheet of the drive, crank at {speed}", speed=speed)
    on = sizing.flywheel.on
    if scene.inertia is not None:
        given = regime.quantity(scene.inertia, "kg m²", 5)
        return _("Worked report: the given flywheel of {given} on {on}, crank at {speed}", given=given, on=on, speed=speed)
    if sizing.limits:
        exact = regime.quantity(sizing.flywheel.exact or 0.0, "kg m²", 5)
        told = _("Worked report: the smallest flywheel that keeps its limits, {exact} on {on}", exact=exact, on=on)
        return told + _(", crank at {speed}", speed=speed)
    eps = regime.number(scene.irregularity or 0.0)
    if sizing.flywheel.needed is False:
        return _("Worked report: no flywheel is needed for irregularity {eps}, crank at {speed}", eps=eps, speed=speed)
    exact = regime.quantity(sizing.flywheel.exact or 0.0, "kg m²", 5)
    return _(
        "Worked report: flywheel of {exact} on {on} for irregularity {eps}, crank at {speed}",
        exact=exact,
        on=on,
        eps=eps,
        speed=speed,
    )


def _parts(scene: Scene, sizing: Sizing | None, given: Given, printed: Solution | None) -> Iterator[Part]:
    """The sections in their order."""
    yield _scene(scene, [str(remark) for remark in (scene.remarks if sizing is None else remarks(sizing))])
    known = None if sizing is None else Known(sizing)
    yield from _mechanisms(known, given)
    sources = [scene.source] if scene.source else []
    if sizing is None or known is None:
        why = _("{why} So there are no steps of a steady regime.", why=_missing(scene))
        yield Section(_("What is left out"), (Note(why, "left out"),))
        yield regime.references(None, sources)
        return
    order = (
        regime.asked,
        drive.motor,
        regime.balance,
        drive.engine,
        regime.areas,
        regime.approximate,
        regime.inertia_torque,
        regime.exact,
        drive.limits,
        wheel.every_shaft,
        regime.speeds,
        drive.power,
        train.train,
        drive.duty,
        regime.holding,
        wheel.wheel,
        regime.check,
    )
    for section in order:
        if (made := section(known)) is not None:
            yield made
    if printed is not None:
        yield solutions.section(sizing, printed)
    yield regime.accuracy(known, [str(remark) for remark in remarks(sizing)])
    yield regime.references(known, sources)


def _mechanisms(known: Known | None, given: Given) -> Iterator[Section]:
    """Mechanism, bond graph, positions and coefficients, I* and M*: drawn where the steps of the regime do not."""
    try:
        from flywheel.report import mechanisms  # type: ignore[attr-defined, unused-ignore]
    except ImportError:
        return
    if known is None:
        yield from mechanisms.sections(given)
    else:
        extremes = tuple(regime.inertia_extremes(known))
        yield from mechanisms.sections(known.sizing, extremes=extremes, moment_drawn=not known.sizing.areas)


# -- the scene --------------------------------------------------------------------------------------------------------


def _scene(scene: Scene, told: list[str]) -> Section:
    """The scene as a table of its values in SI, as text, and what is out of proportion in it."""
    parts: list[Part] = []
    rows = [] if scene.document is None else list(_values(scene.document.tables, ""))
    if rows:
        head = (_("place in the scene"), _("as given"), _("in SI"))
        parts.append(Table(_("The scene: what was given"), head, tuple(rows[:_MOST_ROWS])))
    if len(rows) > _MOST_ROWS:
        parts.append(Note(_("{n} further values are not shown.", n=len(rows) - _MOST_ROWS), "left out"))
    if scene.file is not None and scene.file.is_file():
        text = scene.file.read_text("utf-8").strip("\n")
        parts.append(Listing(text, _("The scene as text, {name}", name=scene.file.name)))
    parts += [Note(_("Remark: {text}", text=text), "remark") for text in told]
    return Section(_("Scene"), tuple(parts))


def _values(value: Any, path: str) -> Iterator[tuple[Cell, ...]]:
    """The values of a scene's tables by their paths, in the order in which they stand."""
    if isinstance(value, Mapping):
        for key, inner in value.items():
            if not path and key in ("title", "source"):
                continue
            yield from _values(inner, f"{path}.{key}" if path else str(key))
    elif isinstance(value, list | tuple) and any(isinstance(inner, Mapping) for inner in value):
        for k, inner in enumerate(value):
            yield from _values(inner, f"{path}[{k}]")
    elif isinstance(value, list | tuple):
        shown = ", ".join(str(inner) for inner in value[:12]) + (", …" if len(value) > 12 else "")
        yield path, shown, ""
    else:
        yield path, str(value).lower() if isinstance(value, bool) else str(value), _in_si(value)


def _in_si(value: Any) -> str:
    """A quantity in SI; nothing for what is none, or is so already."""
    if not isinstance(value, str):
        return ""
    from flywheel.numerics.units import DIMENSIONS, parse_unit, split_quantity

    parts = split_quantity(value)
    if parts is None or not parts[1]:
        return ""
    try:
        unit, found = parse_unit(parts[1], None), parse_quantity(value, None)
    except (QuantityError, SceneError):
        return ""
    for dimension in DIMENSIONS.values():
        if dimension.powers == unit.powers and unit.angle in dimension.angles and dimension.name != "moment of weight":
            si = dimension.si.replace("^2", "²").replace("^3", "³")
            return regime.quantity(found, si) if si else regime.number(found)
    return ""
