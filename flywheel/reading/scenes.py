"""From a scene's text to a checked `Scene`, or to every fault in it at once; and remarks on improbable numbers."""

from __future__ import annotations

import keyword
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial
from itertools import accumulate, chain
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np

from flywheel.components.wheel_stresses import EXACT, GREATEST, WHEEL_SHAPES, WheelAsked, material
from flywheel.components.wheels import request_faults
from flywheel.mechanisms import KINDS
from flywheel.numerics.expressions import RESERVED
from flywheel.numerics.faults import Fault, Remark, SceneError, nearest, quote, show, suggestion
from flywheel.numerics.jets import cos, is_recorded
from flywheel.numerics.units import (
    QuantityError,
    Unit,
    middle_of,
    parse_range,
    parse_unit,
    plain_number,
    quantity_text,
    split_quantity,
    split_range,
)
from flywheel.reading.fields import (
    Faults,
    Fields,
    Item,
    Places,
    SceneQuantity,
    Setting,
    as_table,
    check_name,
    child,
    items,
    read_fields,
    read_item,
    whole,
)
from flywheel.reading.loads import (
    Drive,
    read_drive,
    read_elements,
    read_single_stroke,
)
from flywheel.reading.mechanisms import read_mechanisms, read_stroke
from flywheel.reading.motors import phases, read_duty
from flywheel.reading.schema import AREAS_EXCLUDE, LIMITS, MACHINE, MATERIAL_KEYS, MECHANISM, SECTIONS, TOP, TURN, WHEEL_KEYS
from flywheel.reading.tables import is_utf16
from flywheel.scene.scene import Areas, Inertia, Scene, Stroke, Transmission

if TYPE_CHECKING:
    from flywheel.scene.linkage import Linkage

T = TypeVar("T")

# Remarks on good numbers that are hardly those that were meant: each is held against a limit of the trade, none is refused.

_THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2}\.000")
_NO_QUANTITIES = ("title", "source", "name", "file")
_LONGEST = 20.0  # m
_FASTEST = 400.0  # m/s: steel discs burst about there
_FASTEST_SHAFT = 1e5 * math.pi / 30
_MOST_UNEVEN = 0.5
_LARGEST_SLIP = 0.1  # of belts: 1 to 3 % is usual
_LEAST_EFFICIENCY = 0.4  # of a mesh: a self-locking worm gear
_STEEL = 7850.0  # kg/m³
_LINK, _ANY = 10.0, 1e4  # cubes of steel, as long as the body, or as the longest part of its mechanism
_GYRATION = 3.0  # lengths of a body
_RPM = 30 / math.pi
_STROKE_BY_STROKE = {"single_stroke", "brake", "shafts"}  # tables of a machine with a clutch, which stands in a shaft's
_WORK_ROUNDING = 1e-9


def of_texts(raw: object, path: str = "") -> Iterator[Remark]:
    """Quantities whose three decimals are all zero: 40.000 is forty here, and forty thousand in Spain or Germany."""
    if isinstance(raw, str) and (parts := split_quantity(raw)) and _THOUSANDS.fullmatch(parts[0]):
        number, unit = parts[0].partition(".")[0], f" {parts[1]}" if parts[1] else ""
        yield Remark(path, f"{quote(raw)} is {number}{unit}", f'write "{number}000{unit}" if thousands are meant')
    elif isinstance(raw, Mapping):
        for key, value in raw.items():
            if key not in _NO_QUANTITIES:
                yield from of_texts(value, child(path, str(key)))
    elif isinstance(raw, (list, tuple)):
        for i, value in enumerate(raw):
            yield from of_texts(value, f"{path}[{i}]")


def of_quantity(quantity: SceneQuantity, path: str) -> Iterator[Remark]:
    """A quantity that is out of proportion, because its unit is missing or wrong."""
    value, number, dimension, many_turns = quantity
    bare = plain_number(value)
    if (parts := split_range(value)) is not None:
        advice = "--accuracy proof gives the range of every figure"
        yield Remark(path, f"figures hold for {parts[0]}, the middle of a range", advice)
    if dimension == "speed" and bare is not None and bare >= 30 and bare.is_integer():
        defect = f"{bare:.10g} without a unit is in rad/s, {number * _RPM:.4g} rpm"
        yield Remark(path, defect, f'write "{bare:.10g} rpm" if turns a minute are meant')
    if dimension == "length" and abs(number) > _LONGEST:
        advice = "check its unit" if bare is None else f'write "{bare:.10g} mm" if millimetres are meant'
        yield Remark(path, f"{number:.6g} m", advice)
    if many_turns and bare and bare % 90 == 0:
        defect = f"{bare:.10g} without a unit is in rad, {number / math.tau:.4g} turns"
        yield Remark(path, defect, f'write "{bare:.10g} deg" if degrees are meant')


def of_scene(scene: Scene) -> Iterator[Remark]:
    """Remarks on numbers of a scene that are out of proportion."""
    if scene.irregularity is not None and scene.irregularity > _MOST_UNEVEN:
        eps = scene.irregularity
        defect = f"{eps:.4g} lets the speed swing by ±{50 * eps:.4g} %"
        yield Remark("flywheel.irregularity", defect, f'write "{eps:.4g} %" if percent is meant')
    if scene.speed is not None and scene.stroke is None:
        fastest = max(scene.shafts, key=lambda name: scene.shafts[name])
        speed = scene.speed * scene.shafts[fastest]
        if speed > _FASTEST_SHAFT:
            yield Remark("regime.speed", f"{fastest} turns at {speed * _RPM:.4g} rpm", "check its unit")
    for name, mesh in scene.transmissions.items():
        if mesh.slip > _LARGEST_SLIP:
            defect = f"{100 * mesh.slip:.4g} % of the speed is lost"
            yield Remark(f"shafts.{name}.slip", defect, "a belt slips by 1 to 3 %: check the number and its percent sign")
        if mesh.efficiency < _LEAST_EFFICIENCY:
            defect = f"{100 * (1 - mesh.efficiency):.4g} % of the power is lost"
            yield Remark(f"shafts.{name}.efficiency", defect, "a mesh passes 90 to 99 %, a worm gear 40 % or more: check it")
    for mechanism in scene.mechanisms:
        geometry = mechanism.geometry.items()
        lengths = {path.removesuffix(".length"): abs(m) for path, m in geometry if path.endswith("length")}
        crank = lengths.get("crank")
        if crank and scene.speed is not None and scene.stroke is None:
            pin, path = crank * scene.speed * scene.shafts[mechanism.shaft], f"{mechanism.path}.crank.length"
            if crank <= _LONGEST and pin > _FASTEST:
                yield Remark(path, f"the crank pin runs at {pin:.4g} m/s", "check length and speed")
        longest = max(lengths.values(), default=math.inf)
        for name, body in mechanism.bodies.items():
            path, length = f"{mechanism.path}.{name}", lengths.get(name)
            link = length is not None and name != "crank"
            heaviest = _STEEL * (_LINK * (length or 0.0) ** 3 if link else _ANY * longest**3)
            if body.mass > heaviest:
                long = f"{length or longest:.4g} m"
                where = f"on {long} between its pins" if link else f"where the longest part has {long}"
                yield Remark(f"{path}.mass", f"{body.mass:.6g} kg {where}", "check the units of both")
            if link and length and body.inertia > body.mass * (_GYRATION * length) ** 2 > 0.0:
                at = f"{math.sqrt(body.inertia / body.mass):.4g} m from the centre of {length:.4g} m"
                yield Remark(
                    f"{path}.inertia", f"{body.inertia:.6g} kg m^2, which puts {body.mass:.6g} kg at {at}", "check its unit"
                )


def of_rim(speed: float) -> Iterator[Remark]:
    """A flywheel whose rim (m/s) would burst."""
    if speed > _FASTEST:
        defect = f"its rim runs at {speed:.4g} m/s, where steel bursts"
        yield Remark("flywheel", defect, "make it smaller, or put it on a slower shaft")


def of_drive(work: float, fluctuation: float, balanced: bool) -> Iterator[Remark]:
    """A drive that brakes, by its `work` in a cycle (J) compared with the energy fluctuation."""
    if work < -_WORK_ROUNDING * fluctuation:
        defect = "it brakes, as the loads drive the machine"
        if balanced:
            defect = "it brakes, as the loads drive the machine: its balance is against the rotation"
        yield Remark("drive", defect, "right for an engine under its load, else check the signs of the loads")


# Scenes

LARGEST = 2**20
_DEEPEST_KEY = 32
_QUOTED = re.compile(
    r'''"""(?:[^\\]|\\.)*?(?:"""|\Z)|\'{3}.*?(?:\'{3}|\Z)|"(?:[^"\\\n]|\\.)*(?:"|$)|'[^'\n]*'?|\#[^\n]*''',
    re.DOTALL | re.MULTILINE,
)
"""Strings and comments, also those that are left open."""
_OPEN_AREAS = 0.05
"""Share of the swing by which areas may fail to add up to zero: what a planimeter is good for."""
_QUARTER = 1e-12


def load(source: str | Path | Mapping[str, Any]) -> Scene:
    r"""The scene in a TOML file (a path), in a TOML text, or in a mapping such as `tomllib` gives.

    A text of several lines is TOML; a single line is a path if it ends in `.toml` or holds no equals sign. The scene's
    `given_as`, and its faults, state the choice. CSV files are searched for beside the scene's file; a text or a mapping has
    none (see `parse_scene`, `build_scene`). Quantities of pint, or of a similar library, are accepted for every quantity.
    Raises SceneError.

    >>> scene = load('regime.speed = 10\nflywheel.inertia = "2 kg m^2"')
    >>> scene.inertia, scene.given_as
    (2.0, 'a TOML text')
    """
    description = "a dict" if isinstance(source, Mapping) else "a TOML text" if is_toml(source) else f"the file {source}"
    if not isinstance(source, (Mapping, str, PathLike)):
        description = f"a value of type {type(source).__name__}"
    try:
        if isinstance(source, Mapping):
            scene = build_scene(source)
        elif is_toml(source):
            scene = parse_scene(str(source))
        elif str(source).strip() and isinstance(source, (str, PathLike)):
            scene = read_scene(source)
        else:
            defect = "an empty text" if isinstance(source, str) else show(source)
            raise SceneError([Fault("scene", defect, "a dict, the path of a TOML file, or a TOML text")])
    except SceneError as error:
        error.add_note(f"taken for {description}")
        raise
    object.__setattr__(scene, "given_as", description)
    return scene


def is_toml(source: object) -> bool:
    """Tests whether a source is a TOML text and no path: several lines, or one that assigns and names no TOML file."""
    if not isinstance(source, str):
        return False
    return "\n" in source.strip() or ("=" in source and not source.rstrip().endswith(".toml"))


def load_linkage(source: str | Path | Mapping[str, Any]) -> Linkage:
    r"""The linkage of any number of drivers in a TOML file (a path), in a TOML text, or in a mapping.

    It holds `[mechanism]` of type `linkage` as a scene does, its `driver` and `start` being lists of as many pins and slides
    as there are degrees of freedom; besides that `title`, `source` and `[parameters]`. Drives and loads are arguments of the
    functions in `flywheel.freedoms`. Raises SceneError with every fault.

    >>> pendulum = {"bodies": {"rod": {"mass": "2 kg", "com": ["0.5 m", 0]}}, "driver": ["pivot"], "joints": [
    ...     {"name": "pivot", "type": "pin", "between": ["frame.origin", "rod.origin"]}]}
    >>> load_linkage({"mechanism": {"type": "linkage"} | pendulum}).drivers
    (Driver(joint='pivot', start=0.0),)
    """
    if isinstance(source, Mapping):
        return _linkage(source, None)
    if is_toml(source):
        return _parsed(str(source), "scene", partial(_linkage, folder=None))
    file = Path(source)
    return _parsed(file_text(file), file.name, partial(_linkage, folder=file.parent))


def _linkage(mapping: Mapping[str, Any], folder: Path | None) -> Linkage:
    """The linkage in a mapping; other contents are faults, because they would be ignored."""
    from flywheel.reading.mechanisms import read_linkage

    faults = Faults()
    raw = as_table(mapping, "linkage", faults) or {}
    read_fields({key.name: raw[key.name] for key in TOP if key.name in raw}, TOP, "", faults)
    names = (*(key.name for key in TOP), "parameters", "mechanism")
    for name in raw:
        if name in SECTIONS and name not in names:
            advice = "the calls of flywheel.freedoms take gravity, loads, springs and drives"
            faults.add(name, f"{name} together with a linkage of several drivers", "none", advice)
        elif name not in names:
            faults.unknown(name, name, names)
    parameters, _, unknowns = _parameters(raw.get("parameters"), faults)
    faults.extend(Fault(child("parameters", name), '"balance"', "a value") for name in unknowns)
    table, linkage = as_table(raw.get("mechanism", {}), "mechanism", faults), None
    if table is not None:
        kind, own = KINDS["linkage"], ("type", "name")
        keys = [key for key in MECHANISM.keys if key.name in own]
        keys += [key._replace(kind="list") if key.name in ("driver", "start") else key for key in kind.keys]
        keys = [key for key in keys if key.name != "ports"]
        fields = read_fields(table, keys, "mechanism", faults)
        if fields["type"] not in (None, kind.name):
            faults.add("mechanism.type", quote(fields["type"]), kind.name)
        setting = Setting(TURN, {}, parameters, frozenset(parameters), folder, faults)
        _, linkage, *_ = read_linkage(table, fields, "mechanism", setting, several=True)
    if faults or linkage is None:
        raise faults.error()
    return linkage


def read_scene(path: str | Path) -> Scene:
    """The scene in a TOML file; its CSV files lie beside it.

    Raises SceneError with every fault, also where the file cannot be read.
    """
    file = Path(path)
    return parse_scene(file_text(file), folder=file.parent, file=file)


def parse_scene(text: str, folder: str | Path | None = None, file: str | Path | None = None) -> Scene:
    """The scene in a TOML text. `folder` is where its CSV files lie; `file` is kept with the scene.

    >>> parse_scene("mechanism = {type = 'four-bra'}")
    Traceback (most recent call last):
        ...
    flywheel.numerics.faults.SceneError: mechanism.type (line 1): found type "four-bra", expected a known type; did you ...
    """
    import tomllib

    name = Path(file).name if file is not None else "scene"
    scene = _parsed(text, name, partial(build_scene, folder=folder, file=file))
    if not scene.remarks:
        return scene
    from flywheel.reading import toml_text

    clean = plain_lines(text)
    result = replace(scene, remarks=tuple(toml_text.placed(scene.remarks, clean, tomllib.loads(clean))))
    return result if scene.document is None else result.with_document(*scene.document)


def _parsed(text: str, name: str, build: Callable[[Mapping[str, Any]], T]) -> T:
    """Builds a record from a TOML text, and adds its line to every fault."""
    import tomllib

    if len(text) > LARGEST:
        raise SceneError([Fault(name, f"{len(text)} characters", f"at most {LARGEST}")])
    if _deepest_key(text) > _DEEPEST_KEY:
        raise SceneError([Fault(name, f"a key of more than {_DEEPEST_KEY} parts", "a scene in TOML")])
    text = plain_lines(text)
    try:
        mapping = tomllib.loads(text)
    except (RecursionError, MemoryError):
        raise SceneError([Fault(name, "tables or lists nested too deeply", "a scene in TOML")]) from None
    except ValueError as error:
        from flywheel.reading import toml_text  # only faulty scenes need it

        raise SceneError(toml_text.troubles(text, name, str(error))) from None
    try:
        return build(mapping)
    except SceneError as error:
        from flywheel.reading import toml_text

        raise SceneError(toml_text.placed(error.faults, text, mapping)) from None


def placed(faults: Iterable[Fault], file: Path) -> list[Fault]:
    """Faults of the machine in a file, each with its line; unchanged where that is unknown."""
    located = list(faults)
    if all(fault.line is not None for fault in located):
        return located
    try:
        return placed_in(located, plain_lines(file_text(file)))
    except SceneError:
        return located


def _deepest_key(text: str) -> int:
    """The greatest number of dots in a possible key, because the time of `tomllib` grows with its square."""
    bare = _QUOTED.sub("s", text).translate({ord(" "): None, ord("\t"): None})
    return max(token.count(".") for token in re.split(r"[\n,=\[\]{}]", bare))


def placed_in(faults: Iterable[Fault], text: str) -> list[Fault]:
    """Faults of the machine in a text, each with its line; unchanged where that is unknown."""
    import tomllib

    from flywheel.reading import toml_text

    placed = list(faults)
    if all(fault.line is not None for fault in placed) or _deepest_key(text) > _DEEPEST_KEY:
        return placed
    try:
        return toml_text.placed(placed, text, tomllib.loads(text))
    except (ValueError, RecursionError, MemoryError):
        return placed


def plain_lines(text: str) -> str:
    """The text with line ends as TOML has them, without the mark that some editors put at its beginning."""
    text = text.removeprefix("\ufeff").replace("\r\n", "\n")
    return text if "\n" in text else text.replace("\r", "\n")


@np.errstate(all="ignore")  # what is not finite is reported as a fault, with its place
def build_scene(mapping: Mapping[str, Any], folder: str | Path | None = None, file: str | Path | None = None) -> Scene:
    """The scene in a mapping such as `tomllib` gives; numbers, lists and arrays of NumPy are accepted too.

    >>> scene = build_scene({"regime": {"speed": "60 rpm"}, "flywheel": {"irregularity": "4 %"}})
    >>> scene.speed == 2 * math.pi, scene.irregularity
    (True, 0.04)
    """
    faults = Faults()
    raw = as_table(_plain(mapping), "scene", faults)
    if raw is None:
        raise faults.error()
    scene = _scene(raw, None if folder is None else Path(folder), faults)
    duty = read_duty(raw, faults) if "duty" in raw else []
    if faults or scene is None:
        raise faults.error()
    scene = scene if file is None else replace(scene, file=Path(file))
    document = raw, partial(build_scene, folder=folder, file=file), faults.quantities
    result = scene.with_document(*document)
    if not duty:
        return result
    result = replace(result, duty=phases(result, duty, faults)).with_document(*document)
    if faults:
        raise faults.error()
    return result


def file_text(file: Path) -> str:
    """The text of a scene's file, which must be a plain file of limited size."""
    name, what, advice, content = quote(file.name or str(file))[1:-1], "", "", b""
    try:
        if file.is_file():
            with file.open("rb") as stream:
                content = stream.read(LARGEST + 1)
        elif file.is_dir():
            what = "a folder"
        elif file.exists():
            what = "a pipe" if file.is_fifo() else "a socket" if file.is_socket() else "a device"
        elif file.is_symlink():
            what = "a broken link"
        elif file.parent.is_dir():
            what = "no such file"
            near = nearest(file.name, [other.name for other in file.parent.glob("*.toml")])
            text = "" if file.suffix == ".toml" else "a TOML text has several lines, or an equals sign"
            advice = f"did you mean {quote(near)}?" if near else text
        else:
            folder = quote(file.parent.name)
            missing = f"{folder} is no folder" if file.parent.exists() else f"there is no folder {folder}"
            what = f"no such file, for {missing}"
    except OSError as error:
        what = f"a file that cannot be read ({error.strerror})"
    except ValueError:
        what = "a name that no file can have"
    if what:
        raise SceneError([Fault(name, what, "a scene in a TOML file", advice)])
    if len(content) > LARGEST:
        raise SceneError([Fault(name, "a file of more than 1 MiB", "a scene", "put long tables into a CSV file")])
    if is_utf16(content):
        advice = 'save the file as UTF-8: most editors ask for the encoding at "Save as"'
        raise SceneError([Fault(name, "a text in UTF-16", "text in UTF-8", advice)])
    if b"\0" in content:
        raise SceneError([Fault(name, "a file that is not text", "a scene in a TOML file")])
    try:
        return content.removeprefix(b"\xef\xbb\xbf").decode()
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        defect = f"bytes in line {line} that are not UTF-8"
        raise SceneError([Fault(name, defect, "text in UTF-8", "save the file as UTF-8")]) from None


def _plain(raw: Any, depth: int = 0) -> Any:
    """A mapping with the quantities of other libraries as texts; the same object if there are none."""
    if depth > _DEEPEST_KEY:
        return raw
    if isinstance(raw, Mapping):
        items = {key: _plain(value, depth + 1) for key, value in raw.items()}
        return items if any(items[key] is not value for key, value in raw.items()) else raw
    if isinstance(raw, (list, tuple)):
        values = [_plain(value, depth + 1) for value in raw]
        return values if any(one is not other for one, other in zip(values, raw, strict=True)) else raw
    is_quantity = all(hasattr(raw, name) for name in ("to_base_units", "magnitude", "units"))  # such as pint's
    return quantity_text(raw) if is_quantity else raw


def _scene(raw: Mapping[str, Any], folder: Path | None, faults: Faults) -> Scene | None:
    """All parts of the scene, one after another; None if a fault prevents its construction."""
    names = {key.name for key in TOP}
    for name in raw:
        if name not in names and name not in SECTIONS:
            faults.unknown(child("", name), name, (*names, *SECTIONS), "key or table")
    if not faults and not any(name in raw for name in MACHINE):
        faults.add("scene", "no machine" if raw else "nothing", "a machine", f"one of {', '.join(MACHINE)} at least")
    top = read_fields({name: raw[name] for name in names if name in raw}, TOP, "", faults)
    stroke = read_stroke(raw, faults)
    train = _shafts(raw.get("shafts"), raw.get("drive"), stroke, faults)
    shafts = train.speeds
    parameters, units, unknowns = _parameters(raw.get("parameters"), faults)
    if stroke is None:
        regime = _section(raw, "regime", faults)
        turns = None if regime["cycle"] is None else whole(regime["cycle"] / TURN)
        cycle: float | None = turns * TURN if turns else regime["cycle"]
        faults.longest = math.inf if cycle is None else max(TURN, cycle)
    else:  # its span stands for the cycle, its numbers are NaN if they could not be read
        good = math.isfinite(stroke.span)
        regime = {"on": stroke.element, "speed": stroke.speed if good else None}
        cycle = stroke.span if good else None
        ends = 0.0 if stroke.sliding else max(abs(stroke.start), abs(stroke.end))
        faults.longest = max(TURN, ends) if good else math.inf
    setting = Setting(cycle, shafts, parameters, frozenset((*parameters, *unknowns)), folder, faults, stroke)
    mechanisms, places = read_mechanisms(raw.get("mechanism"), setting)
    drive = read_drive(raw.get("drive"), places, setting)
    machine = read_elements(raw, places, train.shaft_drag, setting)
    if drive.load is not None and drive.motor is not None and drive.motor.inertia:
        machine["inertias"] += (Inertia(drive.load.on, drive.motor.inertia, "drive.motor.inertia"),)
    single_stroke = read_single_stroke(raw, places, setting) if raw.keys() & _STROKE_BY_STROKE else None
    if unknowns:
        _check_balances(unknowns, drive.balance, raw, faults)
    if stroke is not None and (unknowns or drive.balance):
        advice = "a one-way stroke has no cycle to balance; flywheel reduce gives the driving action that it needs"
        driven = "drive.force" if stroke.sliding else "drive.torque"
        parts = [driven if name == "drive" else child("parameters", name) for name in unknowns]
        for path in (*[driven] * drive.balance, *parts):
            faults.add(path, '"balance"', "a value", advice)
    shaft, speed = places.shaft(regime["on"], "regime.on", faults), regime["speed"]
    requirements = _flywheel(raw, places, drive, faults) if stroke is None else {"flywheel_on": stroke.element}
    accuracy = _section(raw, "accuracy", faults)
    gravity = None
    if "gravity" in raw:  # along x and y
        g, direction = _section(raw, "gravity", faults).values()
        if g is not None and direction is not None:
            gravity = (g * _cosine(direction), g * _cosine(direction - math.pi / 2))
    areas = _areas(raw, faults) if "areas" in raw else None
    if faults or cycle is None:
        return None
    scene = Scene(
        **top,
        speed=None if speed is None else speed / shafts[shaft],
        cycle=cycle,
        stroke=stroke,
        shafts=shafts,
        transmissions=train.transmissions,
        parameters=parameters,
        units=units,
        gravity=gravity,
        areas=areas,
        mechanisms=mechanisms,
        drive=drive.load,
        motor=drive.motor,
        unknown="drive" if drive.balance else unknowns[0] if unknowns else None,
        single_stroke=single_stroke,
        **machine,
        **requirements,
        rtol=accuracy["rtol"],
        closure=accuracy["rtol"] if accuracy["closure"] is None else accuracy["closure"],
    )
    if any(is_recorded(quantity.value) for quantity in faults.quantities.values()):
        return scene  # whose numbers stand for those of many designs
    quantities = (of_quantity(quantity, path) for path, quantity in faults.quantities.items())
    return replace(scene, remarks=(*of_texts(raw), *chain.from_iterable(quantities), *of_scene(scene)))


def _section(raw: Mapping[str, Any], name: str, faults: Faults) -> Fields:
    """The values of a single table; a missing one has its defaults, or faults for required keys."""
    table = as_table(raw.get(name, {}), name, faults)
    keys = SECTIONS[name].keys
    return {key.name: None for key in keys} if table is None else read_fields(table, keys, name, faults)


class Shafts(NamedTuple):
    """The shafts of a scene: speeds over that of the reduction element, which comes first, and their connections.

    `shaft_drag` are the torques (N m) against the rotation of shafts, where they have any.
    """

    speeds: dict[str, float]
    transmissions: dict[str, Transmission]
    shaft_drag: dict[str, float]


def _shafts(raw: object, drive: object, stroke: Stroke | None, faults: Faults) -> Shafts:
    """The tree of shafts; `drive` is the scene's, whose place decides which side of a slipping belt runs slower.

    A shaft whose ratio is at fault can still be named. Along a stroke there is only the reduction element.
    """
    shafts = Shafts({"crank": 1.0}, {}, {})
    tables = (None if raw is None else as_table(raw, "shafts", faults)) or {}
    for name, item in tables.items():
        path = child("shafts", name)
        check_name(name, path, faults)
        table = as_table(item, path, faults)
        _shaft(shafts, name, {} if table is None else table, table is not None, path, faults)
    if not shafts.transmissions and (stroke is None or not stroke.sliding):
        return shafts
    if stroke is None:
        return _tree(shafts, drive, faults)
    for name, one in shafts.transmissions.items():
        path = child("shafts", name)
        if stroke.sliding:
            faults.add(path, "a shaft together with a driver that slides", "none", "nothing can be geared to it")
        elif one.stiffness is not None:
            faults.add(path, "a compliant shaft together with [stroke]", "a rigid one", "leave stiffness out")
        elif not (one.efficiency == 1.0 and one.slip == 0.0):
            faults.add(path, "a mesh with losses together with [stroke]", "one without", "leave efficiency and slip out")
    if stroke.sliding:
        return Shafts({"slide": 1.0}, {}, {})
    return _tree(shafts, drive, faults)


def _shaft(shafts: Shafts, name: str, table: Mapping[str, Any], there: bool, path: str, faults: Faults) -> None:
    """One shaft's table, added to those that were read."""
    crank = name == "crank"
    keys = [key._replace(required=key.required and not crank) for key in SECTIONS["shafts"].keys]
    fields: Fields = read_fields(table, keys, path, faults) if there else {key.name: key.default for key in keys}
    ratio, stiffness, damping, efficiency, slip = map(fields.get, ("ratio", "stiffness", "damping", "efficiency", "slip"))
    drag = fields["drag"]
    if not (drag is None or drag == 0.0):
        shafts.shaft_drag[name] = drag
    if crank:
        _check_crank(table, fields, path, faults)
        return
    on = fields["on"] if isinstance(fields["on"], str) else "crank"
    values = (1.0 if ratio is None else ratio, 1.0 if efficiency is None else efficiency, slip or 0.0, drag or 0.0)
    shafts.transmissions[name] = Transmission(on, *values, stiffness=stiffness, damping=damping or 0.0)
    if stiffness is None and damping is not None and "stiffness" not in table:
        faults.add(f"{path}.damping", f"{damping:g}", "a stiffness with it", "give stiffness, in N m/rad")
    if stiffness is not None:
        for key, value, none in (("efficiency", efficiency, 1.0), ("slip", slip, 0.0)):
            if value not in (None, none):
                defect = f"{value:g} on a compliant shaft"
                faults.add(f"{path}.{key}", defect, "one of the two", "put the losses on another shaft")


def _check_crank(table: Mapping[str, Any], fields: Fields, path: str, faults: Faults) -> None:
    """Notes keys that do not apply to the crank, which has no mesh."""
    ratio, efficiency = fields["ratio"], fields["efficiency"]
    if ratio not in (None, 1.0):
        faults.add(f"{path}.ratio", f"{ratio:g}", "1: all ratios are taken to the crank")
    if "on" in table:
        faults.add(
            f"{path}.on",
            show(table["on"]),
            "none: the other shafts are connected to the crank",
            "write on at the other shafts",
        )
    if (fields["stiffness"], fields["damping"]) != (None, None):
        advice = "name the far side as a shaft"
        faults.add(path, "a compliant crank", "a shaft that joins it through its compliance", advice)
    if efficiency not in (None, 1.0):
        advice = "losses arise where another shaft meshes with it"
        faults.add(f"{path}.efficiency", f"{efficiency:g}", "none on the crank", advice)
    if fields["slip"] not in (None, 0.0):
        advice = "slip is that of another shaft's belt"
        faults.add(f"{path}.slip", f"{fields['slip']:g}", "none on the crank", advice)


def _tree(shafts: Shafts, drive: object, faults: Faults) -> Shafts:
    """The shafts with the nearer ones first, with their speeds over the crank's, and which of them drive.

    Notes shafts on one that does not exist, and those in a circle, once for each circle.
    """
    left, ordered = dict(shafts.transmissions), dict[str, Transmission]()
    for name, one in left.items():
        if one.on != "crank" and one.on not in left:
            path = f"{child('shafts', name)}.on"
            faults.add(path, quote(one.on), "a shaft", suggestion(one.on, ["crank", *(n for n in left if n != name)]))
            left[name] = one._replace(on="crank")
    while ring := [name for name, one in left.items() if one.on == "crank" or one.on in ordered]:
        ordered |= {name: left.pop(name) for name in ring}
    while left:  # every one of them hangs on another: going inwards ends in a circle
        passed, name = list[str](), next(iter(left))
        while name not in passed:
            passed.append(name)
            name = left[name].on
        circle = passed[passed.index(name) :]
        for again in passed:
            if again in circle or left[again].on not in left:
                left.pop(again)
                ordered[again] = Transmission()
        if len(circle) == 1:
            defect = f"{quote(name)}, the shaft itself"
        else:
            defect = f"a circle of shafts, {' -> '.join((*circle, name))}"
        faults.add(f"{child('shafts', name)}.on", defect, "shafts that lead to the crank", "put one of them on the crank")
        for far in [far for far, one in left.items() if one.on in ordered]:
            ordered[far] = left.pop(far)._replace(on="crank")
    driven = drive.get("on") if isinstance(drive, Mapping) else None
    while isinstance(driven, str) and driven in ordered:
        ordered[driven] = ordered[driven]._replace(drives=True)
        driven = ordered[driven].on
    speeds = {"crank": 1.0}
    for name, one in ordered.items():
        speeds[name] = one.gear * speeds.get(one.on, 1.0) if name in shafts.transmissions else 1.0
    return Shafts(speeds, ordered, shafts.shaft_drag)


def _parameters(raw: object, faults: Faults) -> tuple[dict[str, float], dict[str, Unit], list[str]]:
    """Parameters that have a value (SI; NaN for a faulty one, which can still be named), their units, and the balances.

    A number alone has no unit, or an unknown one.
    """
    values: dict[str, float] = {}
    units: dict[str, Unit] = {}
    unknowns: list[str] = []
    for name, value in ((None if raw is None else as_table(raw, "parameters", faults)) or {}).items():
        path = child("parameters", name)
        if not (name.isascii() and name.isidentifier()) or keyword.iskeyword(name):
            faults.add(path, quote(name), "a name of letters, digits and _")
        elif name in RESERVED:
            faults.add(path, quote(name), "another name", "expressions have a meaning for this one")
        elif isinstance(value, str) and value == "balance":
            unknowns.append(name)
        else:
            try:
                values[name] = parse_range(value, None)
            except QuantityError as error:
                values[name] = math.nan
                faults.add(path, error.defect, error.expected + ', or "balance"', error.advice)
                continue
            faults.quantities[path] = SceneQuantity(value, values[name], "number", False)
            parts = split_quantity(middle) if isinstance(middle := middle_of(value), str) else None
            if parts is not None and parts[1]:
                with suppress(QuantityError):
                    units[name] = Unit(1, 1, *parse_unit(parts[1], None)[2:])  # the value is in SI by now
    return values, units, unknowns


def _check_balances(parameters: list[str], driven: bool, raw: Mapping[str, Any], faults: Faults) -> None:
    """A scene has one balance at most, the drive's or that of a parameter, which must be used."""
    first = "drive" if driven else parameters[0]
    for name in parameters if driven else parameters[1:]:
        faults.add(child("parameters", name), '"balance"', "one balance at most", f"another one is {first}")
    for name in parameters:
        if name == "drive":
            faults.add("parameters.drive", '"balance"', "another name", "drive is that of the drive's torque")
        parts = [*(items(raw.get("load")) or []), raw.get("drive")]
        texts = [part.get(key) for part in parts if isinstance(part, Mapping) for key in ("force", "torque")]
        if not any(isinstance(text, str) and re.search(rf"\b{re.escape(name)}\b", text) for text in texts):
            faults.add(child("parameters", name), '"balance" that nothing uses', "a load or drive that depends on it")


def _flywheel(raw: Mapping[str, Any], places: Places, drive: Drive, faults: Faults) -> dict[str, Any]:
    """Shaft of the flywheel, and the one figure given, or the limits that it must keep."""
    if "flywheel" not in raw:
        return {}
    table, section = as_table(raw["flywheel"], "flywheel", faults), SECTIONS["flywheel"]
    if table is None:
        return {}
    item = read_item(table, section._replace(keys=(*section.keys, *WHEEL_KEYS)), "flywheel", faults)
    fields, wheel = item.fields, None
    on = places.shaft(fields["on"], "flywheel.on", faults)
    inertia = fields["inertia"] if fields["gd2"] is None else fields["gd2"]
    written = [key.name for key in WHEEL_KEYS if key.name in table]
    if written and all(fields[name] is not None for name in written) and not table.keys() - fields.keys():
        wheel = _wheel(item, written)
    requirements = {"flywheel_on": on, "irregularity": fields["irregularity"], "inertia": inertia, "wheel": wheel}
    if "limits" not in table:
        return requirements
    limits = _limits(fields["limits"], raw, drive, faults)
    return {**requirements, "limits": limits, "irregularity": limits.get("irregularity", fields["irregularity"])}


def _limits(written: object, raw: Mapping[str, Any], drive: Drive, faults: Faults) -> dict[str, float]:
    """The limits that a flywheel shall keep; those of a motor require its rated figures."""
    path = LIMITS.name
    table = as_table(written, path, faults)
    if table is None:
        return {}
    fields = read_fields(table, LIMITS.keys, path, faults)
    if not table:
        faults.add(path, "no limit", f"one at least of {', '.join(fields)}")
    motor, driven = drive.motor, raw.get("drive")
    faulty = motor is None and isinstance(driven, Mapping) and "motor" in driven  # noted when it was read
    for name in () if faulty else (name for name in table if name in fields and name != "irregularity"):
        if motor is None:
            advice = 'give [drive] a motor with a rated point, such as motor = {type = "induction", ...}'
            faults.add(f"{path}.{name}", f"{name} without a motor", "a motor that it is a limit of", advice)
        elif motor.rated is None:
            advice = "give its speed with power or torque, or another type of motor"
            faults.add(f"{path}.{name}", f"a {motor.title} without a rated point", "a motor with a name plate", advice)
        elif name == "motor_heat" and motor.heated is None:
            advice = "limit motor_rms, or give the motor as induction or dc"
            faults.add(f"{path}.{name}", f"a {motor.title}, whose losses are not known", "one that does", advice)
        elif name == "current_pulsation" and motor.rated_current is None and motor.current_share(0.0) is None:
            advice = "limit motor_torque, or give the motor as induction or dc"
            faults.add(f"{path}.{name}", f"a {motor.title}, whose current is not known", "a motor with a current", advice)
    return {name: value for name, value in fields.items() if value is not None}


def _wheel(item: Item, written: list[str]) -> WheelAsked | None:
    """The wheel that some keys of `[flywheel]` describe; None after noting faults."""
    if item.fields["shape"] is None:
        item.add("shape", "nothing", f"a shape ({', '.join(WHEEL_SHAPES)}) with {written[0]}")
        return None
    names = {"material": "name", "allowable_stress": "allowable"}  # of arguments, where keys are called otherwise
    own = {names.get(key.name, key.name): item.fields[key.name] for key in MATERIAL_KEYS if key.name in written}
    fields = {name: item.fields[name] for name in written if name not in (key.name for key in MATERIAL_KEYS)}
    with item.faults.placed(item.path):
        requirements = WheelAsked(
            **{"method": EXACT, "at": GREATEST, **fields, "material": material(**own), "path": item.path}
        )
        wrong = request_faults(requirements)
        item.faults.extend(wrong)
        return None if wrong else requirements
    return None


def _cosine(angle: float) -> float:
    """Cosine, exact at multiples of a right angle."""
    quarters = angle / (math.pi / 2)
    if abs(quarters - round(quarters)) <= _QUARTER:
        return (1.0, 0.0, -1.0, 0.0)[round(quarters) % 4]
    return cos(angle)


def _areas(raw: Mapping[str, Any], faults: Faults) -> Areas | None:
    """Areas of a turning-moment diagram, in place of a machine."""
    for name in AREAS_EXCLUDE:
        if name in raw:
            faults.add(name, f"{name} together with [areas]", "none", "the areas stand for mechanism, loads and drive")
    if isinstance(raw.get("regime"), Mapping) and "cycle" in raw["regime"]:
        faults.add("regime.cycle", "a cycle together with [areas]", "none", "a diagram's areas have no angles")
    fields = _section(raw, "areas", faults)
    values = fields["values"]
    if values is None:
        return None
    sums = [0.0, *accumulate(values)]
    swing = max(sums) - min(sums)
    if len(values) < 2:
        faults.add("areas.values", f"{len(values)} values", "at least 2")
    elif abs(sums[-1]) > _OPEN_AREAS * swing:
        defect = f"a sum of {sums[-1]:.6g} with a swing of {swing:.6g}"
        faults.add("areas.values", defect, f"a sum of zero, within {_OPEN_AREAS:.0%} of the swing")
    return None if fields["scale"] is None else Areas(tuple(values), fields["scale"])


def input_files(file: Path) -> list[Path]:
    """A scene's file, and every file that it names."""
    import tomllib

    files = [file]

    def collect(value: Any) -> None:
        for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
            if key == "file" and isinstance(inner, str):
                files.append(file.parent / inner)
            elif isinstance(inner, dict | list):
                collect(inner)

    with suppress(SceneError, ValueError, RecursionError):  # such a scene is refused when it is read
        collect(tomllib.loads(file_text(file).replace("\r\n", "\n")))
    return files
