"""From a scene's text to a checked `Scene`, or to every fault in it at once; and remarks on numbers that look unmeant."""

from __future__ import annotations

import keyword
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial
from itertools import accumulate, chain
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from flywheel.components.wheel_stresses import material
from flywheel.components.wheels import EXACT, GREATEST, WHEEL_SHAPES, WheelAsked, asked_faults
from flywheel.numerics.expressions import RESERVED
from flywheel.numerics.faults import Fault, Remark, SceneError, quote
from flywheel.numerics.units import QuantityError, Unit, parse_quantity, parse_unit, plain_number, split_quantity
from flywheel.reading.fields import (
    Faults,
    Fields,
    Item,
    Places,
    Quantity,
    Setting,
    as_table,
    check_name,
    child,
    items,
    read_fields,
    read_item,
    whole,
)
from flywheel.reading.loads import read_dampers, read_drive, read_inertias, read_loads, read_springs
from flywheel.reading.mechanisms import check_known, check_shafts, read_mechanisms, read_stroke
from flywheel.reading.schema import AREAS_EXCLUDE, MATERIAL_KEYS, SECTIONS, TOP, TURN, WHEEL_KEYS
from flywheel.reading.tables import is_utf16
from flywheel.scene.scene import Areas, Compliance, Mechanism, Scene, Stroke

PATH = "flywheel"
_ARGUMENTS = {"material": "name", "allowable_stress": "allowable"}


def read_wheel(item: Item) -> WheelAsked | None:
    """The wheel that `[flywheel]` asks for; None where it asks for none, or after noting faults."""
    fields, faults, written = item.fields, item.faults, item.given(*(key.name for key in WHEEL_KEYS))
    if not written or any(fields[name] is None for name in written) or item.raw.keys() - fields.keys():  # noted already
        return None
    if fields["shape"] is None:
        item.add("shape", "nothing", f"a shape ({', '.join(WHEEL_SHAPES)}) beside {written[0]}")
        return None
    given = {_ARGUMENTS.get(name, name): fields[name] for name in written}
    own = {name: given.pop(name) for name in [_ARGUMENTS.get(key.name, key.name) for key in MATERIAL_KEYS] if name in given}
    try:
        asked = WheelAsked(**{"method": EXACT, "at": GREATEST, **given, "material": material(**own), "path": PATH})
    except SceneError as error:
        faults.extend(fault._replace(path=f"{PATH}.{fault.path}") for fault in error.faults)
        return None
    wrong = asked_faults(asked)
    faults.extend(wrong)
    return None if wrong else asked


# -- remarks -----------------------------------------------------------------------------------------------------------
# Good numbers that are hardly those that were meant: each is held against one limit of the trade, none is refused.

_THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2}\.000")
_NO_QUANTITIES = ("title", "source", "name", "file")
_LONGEST = 20.0  # m
_FASTEST = 400.0  # m/s: steel discs burst about there
_FASTEST_SHAFT = 1e5 * math.pi / 30
_MOST_UNEVEN = 0.5
_STEEL = 7850.0  # kg/m³
_LINK, _ANY = 10.0, 1e4  # cubes of steel, as long as the body, or as the longest part of its mechanism
_GYRATION = 3.0  # lengths of a body
_RPM = 30 / math.pi
_ROUNDING = 1e-9


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
        for i, value in enumerate(items(raw) or ()):
            yield from of_texts(value, f"{path}[{i}]")


def of_quantity(quantity: Quantity, path: str) -> Iterator[Remark]:
    """A quantity that is out of proportion as it stands, for its unit was left out or is another."""
    value, number, dimension, many_turns = quantity
    bare = plain_number(value)
    if dimension == "speed" and bare is not None and bare >= 30 and bare.is_integer():
        found = f"{bare:.10g} without a unit is in rad/s, {number * _RPM:.4g} rpm"
        yield Remark(path, found, f'write "{bare:.10g} rpm" if turns a minute are meant')
    if dimension == "length" and abs(number) > _LONGEST:
        advice = "check its unit" if bare is None else f'write "{bare:.10g} mm" if millimetres are meant'
        yield Remark(path, f"{number:.6g} m", advice)
    if many_turns and bare and bare % 90 == 0:
        found = f"{bare:.10g} without a unit is in rad, {number / math.tau:.4g} turns"
        yield Remark(path, found, f'write "{bare:.10g} deg" if degrees are meant')


def of_scene(scene: Scene) -> Iterator[Remark]:
    """What is out of proportion between the numbers of a scene."""
    if scene.irregularity is not None and scene.irregularity > _MOST_UNEVEN:
        eps = scene.irregularity
        found = f"{eps:.4g} lets the speed swing by ±{50 * eps:.4g} %"
        yield Remark("flywheel.irregularity", found, f'write "{eps:.4g} %" if per cent are meant')
    if scene.speed is not None and scene.stroke is None:
        fastest = max(scene.shafts, key=lambda name: scene.shafts[name])
        speed = scene.speed * scene.shafts[fastest]
        if speed > _FASTEST_SHAFT:
            yield Remark("regime.speed", f"{fastest} turns at {speed * _RPM:.4g} rpm", "check its unit")
    for mechanism in scene.mechanisms:
        yield from _of_mechanism(mechanism, scene)


def _of_mechanism(mechanism: Mechanism, scene: Scene) -> Iterator[Remark]:
    """Lengths, masses and speeds of a mechanism that do not go together."""
    lengths = {path.removesuffix(".length"): abs(m) for path, m in mechanism.geometry.items() if path.endswith("length")}
    crank = lengths.get("crank")
    if crank and scene.speed is not None and scene.stroke is None:
        pin = crank * scene.speed * scene.shafts[mechanism.shaft]
        if crank <= _LONGEST and pin > _FASTEST:
            yield Remark(f"{mechanism.path}.crank.length", f"the crank pin runs at {pin:.4g} m/s", "check length and speed")
    longest = max(lengths.values(), default=math.inf)
    for name, body in mechanism.bodies.items():
        path, length = f"{mechanism.path}.{name}", lengths.get(name)
        link = length is not None and name != "crank"
        heaviest = _STEEL * (_LINK * (length or 0.0) ** 3 if link else _ANY * longest**3)
        if body.mass > heaviest:
            long = f"{length or longest:.4g} m"
            found = f"{body.mass:.6g} kg " + (
                f"on {long} between its pins" if link else f"where the longest part has {long}"
            )
            yield Remark(f"{path}.mass", found, "check the units of both")
        if link and length and body.inertia > body.mass * (_GYRATION * length) ** 2 > 0.0:
            radius = math.sqrt(body.inertia / body.mass)
            found = f"{body.inertia:.6g} kg m^2 puts {body.mass:.6g} kg at {radius:.4g} m from the centre of {length:.4g} m"
            yield Remark(f"{path}.inertia", found, "check its unit")


def of_rim(speed: float) -> Iterator[Remark]:
    """A flywheel whose rim (m/s) would burst."""
    if speed > _FASTEST:
        found = f"its rim runs at {speed:.4g} m/s, where steel bursts"
        yield Remark("flywheel", found, "make it smaller, or put it on a slower shaft")


def of_drive(work: float, fluctuation: float, balanced: bool) -> Iterator[Remark]:
    """A drive that brakes, as its `work` in a cycle (J) beside the energy fluctuation shows."""
    if work < -_ROUNDING * fluctuation:
        found = "it brakes, as the loads drive the machine" + (": its balance is against the rotation" if balanced else "")
        yield Remark("drive", found, "right for an engine under its load, else check the signs of the loads")


# -- scenes ------------------------------------------------------------------------------------------------------------

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

    A text is a path if it ends in `.toml` or holds neither a line's end nor an equals sign. CSV files are looked for
    beside the scene's file; a text or a mapping has none (see `parse_scene`, `build_scene`). Raises SceneError.

    >>> load('regime.speed = 10\nflywheel.inertia = "2 kg m^2"').inertia
    2.0
    """
    if isinstance(source, Mapping):
        return build_scene(source)
    if isinstance(source, str) and not source.endswith(".toml") and ("\n" in source or "=" in source):
        return parse_scene(source)
    return read_scene(source)


def read_scene(path: str | Path) -> Scene:
    """The scene in a TOML file; its CSV files lie beside it.

    Raises SceneError with every fault, also where the file cannot be read.
    """
    file = Path(path)
    return parse_scene(_content(file), folder=file.parent, file=file)


def parse_scene(text: str, folder: str | Path | None = None, file: str | Path | None = None) -> Scene:
    """The scene in a TOML text. `folder` is where its CSV files lie; `file` is kept with the scene.

    >>> parse_scene('regime.speed = "210 rpm"')
    Traceback (most recent call last):
        ...
    flywheel.numerics.faults.SceneError: flywheel: found nothing, expected a table with irregularity or inertia
    """
    import tomllib

    name = Path(file).name if file is not None else "scene"
    if len(text) > LARGEST:
        raise SceneError([Fault(name, f"{len(text)} characters", f"at most {LARGEST}")])
    if _deepest_key(text) > _DEEPEST_KEY:
        raise SceneError([Fault(name, f"a key of more than {_DEEPEST_KEY} parts", "a scene in TOML")])
    text = _lines(text)
    try:
        mapping = tomllib.loads(text)
    except (RecursionError, MemoryError):
        raise SceneError([Fault(name, "tables or lists nested too deeply", "a scene in TOML")]) from None
    except ValueError as error:
        from flywheel.reading import toml_text  # only faulty scenes pay for it

        raise SceneError(toml_text.troubles(text, name, str(error))) from None
    try:
        scene = build_scene(mapping, folder, file)
        return scene if not scene.remarks else _with_lines(scene, text, mapping)
    except SceneError as error:
        from flywheel.reading import toml_text

        raise SceneError(toml_text.placed(error.faults, text, mapping)) from None


def placed(faults: Iterable[Fault], file: Path) -> list[Fault]:
    """Faults of the machine in a file, each with the line that it comes from; as they are where that is not known."""
    import tomllib

    from flywheel.reading import toml_text

    found = list(faults)
    if all(fault.line is not None for fault in found):
        return found
    try:
        text = _lines(_content(file))
        return toml_text.placed(found, text, tomllib.loads(text))
    except (ValueError, RecursionError, MemoryError):
        return found


def _lines(text: str) -> str:
    """The text with line ends as TOML has them, without the mark that some editors put at its beginning."""
    text = text.removeprefix("\ufeff").replace("\r\n", "\n")
    return text if "\n" in text else text.replace("\r", "\n")


def _deepest_key(text: str) -> int:
    """How many dots the longest dotted key has: the parser's time grows with their square."""
    bare = _QUOTED.sub("s", text).translate({ord(" "): None, ord("\t"): None})
    return max(token.count(".") for token in re.split(r"[\n,=\[\]{}]", bare))


@np.errstate(all="ignore")  # what is not finite is reported as a fault, with its place
def build_scene(mapping: Mapping[str, Any], folder: str | Path | None = None, file: str | Path | None = None) -> Scene:
    """The scene in a mapping such as `tomllib` gives; numbers, lists and arrays of NumPy will do as well.

    >>> scene = build_scene({"regime": {"speed": "60 rpm"}, "flywheel": {"irregularity": "4 %"}})
    >>> scene.speed == 2 * math.pi, scene.irregularity
    (True, 0.04)
    """
    faults = Faults()
    raw = as_table(mapping, "scene", faults)
    if raw is not None and not raw:
        faults.add("scene", "nothing", "at least [regime] and [flywheel]")
    if not raw or faults:
        raise SceneError(faults)
    scene = _scene(raw, None if folder is None else Path(folder), faults)
    if faults or scene is None:
        raise SceneError(faults)
    scene = scene if file is None else replace(scene, file=Path(file))
    return scene.with_document(raw, partial(build_scene, folder=folder, file=file))


def _with_lines(scene: Scene, text: str, mapping: Mapping[str, Any]) -> Scene:
    """The scene whose remarks tell the lines on which they are due."""
    from flywheel.reading import toml_text

    found = replace(scene, remarks=tuple(toml_text.placed(scene.remarks, text, mapping)))
    return found if scene.document is None else found.with_document(*scene.document)


def _content(file: Path) -> str:
    """The text of a scene's file, which must be a plain one of bearable size."""
    name = quote(file.name or str(file))[1:-1]
    content, fault = _bytes(file)
    if fault:
        raise SceneError([Fault(name, fault, "a scene in a TOML file")])
    if len(content) > LARGEST:
        raise SceneError([Fault(name, "a file of more than 1 MiB", "a scene", "put long tables into a CSV file")])
    if is_utf16(content):
        advice = 'save the file as UTF-8: most editors ask for the encoding at "Save as"'
        raise SceneError([Fault(name, "a text in UTF-16", "text in UTF-8", advice)])
    if b"\0" in content:
        raise SceneError([Fault(name, "a file that is no text", "a scene in a TOML file")])
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        found = f"bytes in line {line} that are not UTF-8"
        raise SceneError([Fault(name, found, "text in UTF-8", "save the file as UTF-8")]) from None


def _no_file(file: Path) -> str:
    """What is there where a plain file was expected."""
    if file.is_dir():
        return "a folder"
    if file.exists():
        return "a pipe" if file.is_fifo() else "a socket" if file.is_socket() else "a device"
    if file.is_symlink():
        return "a link that leads nowhere"
    if file.parent.is_dir():
        return "no such file"
    folder = quote(file.parent.name)
    return f"no such file, for {f'{folder} is no folder' if file.parent.exists() else f'there is no folder {folder}'}"


def _bytes(file: Path) -> tuple[bytes, str]:
    """The beginning of a plain file, or what was found instead of one."""
    try:
        if not file.is_file():
            return b"", _no_file(file)
        with file.open("rb") as stream:
            return stream.read(LARGEST + 1), ""
    except OSError as error:
        return b"", f"a file that cannot be read ({error.strerror})"
    except ValueError:
        return b"", "a name that no file can have"


def _scene(raw: Mapping[str, Any], folder: Path | None, faults: Faults) -> Scene | None:
    """Every part of the scene in turn; None where a fault stops it from being put together."""
    known = {key.name for key in TOP}
    for name in raw:
        if name not in known and name not in SECTIONS:
            faults.unknown(child("", name), name, (*known, *SECTIONS), "key or table")
    top = read_fields({name: raw[name] for name in known if name in raw}, TOP, "", faults)
    stroke = read_stroke(raw, faults)
    shafts, compliances, efficiencies = _shafts(raw.get("shafts"), stroke, faults)
    parameters, unknowns = _parameters(raw.get("parameters"), faults)
    if stroke is None:
        regime = _section(raw, "regime", faults)
        turns = None if regime["cycle"] is None else whole(regime["cycle"] / TURN)
        cycle: float | None = turns * TURN if turns else regime["cycle"]
        faults.longest = math.inf if cycle is None else max(TURN, cycle)
    else:  # its span stands for the cycle, its numbers are NaN where they could not be read
        good = math.isfinite(stroke.span)
        regime = {"on": stroke.element, "speed": stroke.speed if good else None}
        cycle = stroke.span if good else None
        ends = 0.0 if stroke.sliding else max(abs(stroke.start), abs(stroke.end))
        faults.longest = max(TURN, ends) if good else math.inf
    setting = Setting(cycle, shafts, parameters, frozenset((*parameters, *unknowns)), folder, faults, stroke)
    mechanisms, places = read_mechanisms(raw.get("mechanism"), setting)
    drive = read_drive(raw.get("drive"), places, setting)
    machine: dict[str, Any] = {
        "mechanisms": mechanisms,
        "inertias": read_inertias(raw.get("inertia"), places, setting) + drive.rotor,
        "loads": read_loads(raw.get("load"), places, setting),
        "springs": read_springs(raw.get("spring"), places, setting),
        "dampers": read_dampers(raw.get("damper"), places, setting),
        "drive": drive.load,
        "motor": drive.motor,
        "unknown": _unknown(unknowns, drive.balance, raw, faults),
    }
    if stroke is not None:
        check_known([*["drive"] * drive.balance, *unknowns], stroke, faults)
    shaft, speed = places.shaft(regime["on"], "regime.on", faults), regime["speed"]
    asked = _flywheel(raw, places, faults) if stroke is None else {"flywheel_on": stroke.element}
    accuracy = _section(raw, "accuracy", faults)
    gravity, areas = _gravity(raw, faults), _areas(raw, faults)
    if speed is None and not faults:
        _check_own_speed(machine, areas is not None, faults)
    if faults or cycle is None:
        return None
    scene = Scene(
        **top,
        speed=None if speed is None else speed / shafts[shaft],
        cycle=cycle,
        stroke=stroke,
        shafts=shafts,
        compliances=compliances,
        efficiencies=efficiencies,
        parameters=parameters,
        units=_units(raw.get("parameters")),
        gravity=gravity,
        areas=areas,
        **machine,
        **asked,
        rtol=accuracy["rtol"],
        closure=accuracy["rtol"] if accuracy["closure"] is None else accuracy["closure"],
    )
    quantities = (of_quantity(found, path) for path, found in faults.quantities.items())
    return replace(scene, remarks=(*of_texts(raw), *chain.from_iterable(quantities), *of_scene(scene)))


def _section(raw: Mapping[str, Any], name: str, faults: Faults) -> Fields:
    """The values of a table that stands alone; one that is missing has its defaults, or faults for what it requires."""
    table = as_table(raw.get(name, {}), name, faults)
    keys = SECTIONS[name].keys
    return {key.name: None for key in keys} if table is None else read_fields(table, keys, name, faults)


def _shafts(raw: object, stroke: Stroke | None, faults: Faults) -> _Gears:
    """Shafts geared to the crank, which comes first; a shaft whose ratio is at fault can still be named.

    Along a stroke there is only the reduction element.
    """
    gears = _Gears({"crank": 1.0}, {}, {})
    for name, item in ((None if raw is None else as_table(raw, "shafts", faults)) or {}).items():
        path = child("shafts", name)
        check_name(name, path, faults)
        table = as_table(item, path, faults)
        fields = {} if table is None else read_fields(table, SECTIONS["shafts"].keys, path, faults)
        ratio = fields.get("ratio")
        if name == "crank" and ratio not in (None, 1.0):
            faults.add(f"{path}.ratio", f"{ratio:g}", "1: all ratios are taken to the crank")
        gears.ratios[name] = 1.0 if ratio is None or name == "crank" else ratio
        gears.compliances.update(_compliance(name, fields, "stiffness" in (table or {}), path, faults))
        gears.efficiencies.update(_efficiency(name, fields, path, faults))
    if stroke is None:
        return gears
    check_shafts([name for name in gears.ratios if name != "crank"], gears.compliances, stroke.sliding, faults)
    return _Gears({"slide": 1.0} if stroke.sliding else gears.ratios, {}, {})


class _Gears(NamedTuple):
    """Shafts by name: speed over that of the reduction element, which comes first; which twist; whose meshes have losses."""

    ratios: dict[str, float]
    compliances: dict[str, Compliance]
    efficiencies: dict[str, float]


def _efficiency(name: str, fields: Fields, path: str, faults: Faults) -> dict[str, float]:
    """The efficiency of a shaft's mesh with the crank, where it loses anything."""
    efficiency = fields.get("efficiency")
    if efficiency is None or efficiency == 1.0:
        return {}
    if name == "crank":
        faults.add(
            f"{path}.efficiency", f"{efficiency:g}", "none on the crank", "losses arise where another shaft meshes with it"
        )
    elif fields.get("stiffness") is not None:
        faults.add(
            f"{path}.efficiency", f"{efficiency:g} on a compliant shaft", "one of the two", "put the losses on another shaft"
        )
    return {name: efficiency}


def _compliance(name: str, fields: Fields, tried: bool, path: str, faults: Faults) -> dict[str, Compliance]:
    """What makes a shaft compliant; `tried`: a stiffness was given, if perhaps a faulty one."""
    stiffness, damping = fields.get("stiffness"), fields.get("damping")
    if stiffness is None and damping is None:
        return {}
    if name == "crank":
        faults.add(path, "a compliant crank", "a shaft that joins it through its compliance", "name the far side as a shaft")
    if stiffness is None:
        if not tried:
            faults.add(f"{path}.damping", f"{damping:g}", "a stiffness beside it", "give stiffness, in N m/rad")
        return {}
    return {name: Compliance(stiffness, damping or 0.0)}


def _parameters(raw: object, faults: Faults) -> tuple[dict[str, float], list[str]]:
    """Parameters that have a value (SI; NaN for a faulty one, which can still be named), and those that are the balance."""
    values: dict[str, float] = {}
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
                values[name] = parse_quantity(value, None)
            except QuantityError as error:
                values[name] = math.nan
                faults.add(path, error.found, error.expected + ', or "balance"', error.advice)
    return values, unknowns


def _units(raw: object) -> dict[str, Unit]:
    """The units in which parameters are given; a number alone has none, or one that the scene keeps to itself."""
    texts = {name: value for name, value in (raw.items() if isinstance(raw, Mapping) else ()) if isinstance(value, str)}
    found = {}
    for name, text in texts.items():
        parts = split_quantity(text)
        if parts is not None and parts[1]:
            with suppress(QuantityError):
                found[name] = Unit(1, 1, *parse_unit(parts[1], None)[2:])  # the value is in SI by now
    return found


def _unknown(parameters: list[str], driven: bool, raw: Mapping[str, Any], faults: Faults) -> str | None:
    """The name of the scene's one balance, if it has one; a parameter that is the balance must be used."""
    unknowns = [*(["drive"] if driven else []), *parameters]
    for name in unknowns[1:]:
        path = child("parameters", name)
        faults.add(path, '"balance"', "one balance at most", f"another one is {unknowns[0]}")
    for name in parameters:
        if name == "drive":
            faults.add("parameters.drive", '"balance"', "another name", "drive is that of the drive's torque")
        if not _mentioned(name, raw):
            faults.add(child("parameters", name), '"balance" that nothing uses', "a load or drive that depends on it")
    return unknowns[0] if unknowns else None


def _mentioned(name: str, raw: Mapping[str, Any]) -> bool:
    """Whether a load or the drive, faulty or not, mentions a parameter."""
    lists = [raw.get("load"), [raw.get("drive")]]
    tables = [table for found in lists for table in items(found) or [] if isinstance(table, Mapping)]
    texts = [table.get(key) for table in tables for key in ("force", "torque")]
    return any(isinstance(text, str) and re.search(rf"\b{re.escape(name)}\b", text) for text in texts)


def _flywheel(raw: Mapping[str, Any], places: Places, faults: Faults) -> dict[str, Any]:
    """Where the flywheel sits, and the one figure that is given."""
    if "flywheel" not in raw:
        faults.add("flywheel", "nothing", "a table with irregularity or inertia")
        return {}
    table, section = as_table(raw["flywheel"], "flywheel", faults), SECTIONS["flywheel"]
    if table is None:
        return {}
    item = read_item(table, section._replace(keys=(*section.keys, *WHEEL_KEYS)), "flywheel", faults)
    fields = item.fields
    on, wheel = places.shaft(fields["on"], "flywheel.on", faults), read_wheel(item)
    inertia = fields["inertia"] if fields["gd2"] is None else fields["gd2"]
    return {"flywheel_on": on, "irregularity": fields["irregularity"], "inertia": inertia, "wheel": wheel}


def _check_own_speed(machine: Mapping[str, Any], areas: bool, faults: Faults) -> None:
    """A scene without a speed needs torques that depend on it, and nothing else that is unknown."""
    loads = [*machine["loads"], *([machine["drive"]] if machine["drive"] is not None else [])]
    depends = bool(machine["dampers"]) or any(getattr(load.law, "uses_speed", False) for load in loads)
    expected = 'a speed such as "210 rpm" or a bare number in rad/s'
    if areas or not depends:
        faults.add("regime.speed", "nothing", expected, "" if areas else "or torques that depend on speed, which fix it")
    elif machine["unknown"] is not None:
        faults.add("regime.speed", 'nothing, with a "balance"', expected, "one of the two must be known")


def _gravity(raw: Mapping[str, Any], faults: Faults) -> tuple[float, float] | None:
    """The acceleration of free fall along x and y."""
    if "gravity" not in raw:
        return None
    fields = _section(raw, "gravity", faults)
    g, direction = fields["g"], fields["direction"]
    return None if g is None or direction is None else (g * _cosine(direction), g * _cosine(direction - math.pi / 2))


def _cosine(angle: float) -> float:
    """Cosine, exact at multiples of a right angle."""
    quarters = angle / (math.pi / 2)
    if abs(quarters - round(quarters)) <= _QUARTER:
        return (1.0, 0.0, -1.0, 0.0)[round(quarters) % 4]
    return math.cos(angle)


def _areas(raw: Mapping[str, Any], faults: Faults) -> Areas | None:
    """Areas of a turning-moment diagram, in place of a machine."""
    if "areas" not in raw:
        return None
    for name in AREAS_EXCLUDE:
        if name in raw:
            faults.add(name, f"{name} beside [areas]", "none", "the areas stand for mechanism, loads and drive")
    if isinstance(raw.get("regime"), Mapping) and "cycle" in raw["regime"]:
        faults.add("regime.cycle", "a cycle beside [areas]", "none", "a diagram's areas have no angles")
    fields = _section(raw, "areas", faults)
    values = fields["values"]
    if values is None or not _closes(values, faults) or fields["scale"] is None:
        return None
    return Areas(tuple(values), fields["scale"])


def _closes(values: list[float], faults: Faults) -> bool:
    """Whether there are areas enough, and they add up to zero as nearly as can be asked of a diagram."""
    if len(values) < 2:
        faults.add("areas.values", f"{len(values)} areas", "at least 2")
        return False
    sums = [0.0, *accumulate(values)]
    swing = max(sums) - min(sums)
    if abs(sums[-1]) <= _OPEN_AREAS * swing:
        return True
    found = f"a sum of {sums[-1]:.6g} with a swing of {swing:.6g}"
    faults.add("areas.values", found, f"a sum of zero, within {_OPEN_AREAS:.0%} of the swing")
    return False


def input_files(file: Path) -> list[Path]:
    """A scene's file, and every file that it names."""
    import tomllib

    found = [file]

    def collect(value: Any) -> None:
        for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
            if key == "file" and isinstance(inner, str):
                found.append(file.parent / inner)
            elif isinstance(inner, dict | list):
                collect(inner)

    with suppress(SceneError, ValueError, RecursionError):  # such a scene is refused when it is read
        collect(tomllib.loads(_content(file).replace("\r\n", "\n")))
    return found
