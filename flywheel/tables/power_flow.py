"""The power flow of a sizing in words: what each stream is called, the table that sums to the input, the sentence on it."""

from __future__ import annotations

from collections.abc import Sequence

from bondgraph.records import NamedTuple
from flywheel.language import number
from flywheel.language import text as _
from flywheel.numerics.units import columns, figure
from flywheel.sizing.power_flow import PowerFlow, Stream
from flywheel.tables.rows import DEGREES, RPM, encoded, page, sentences
from flywheel.tables.trade_units import SI, TradeUnits, few_digits

_MOST_TOLD, _LONGEST = 3, 90  # losses in a sentence, and their letters
_TINY = 5e-5  # of the input: a loss that no sentence names
_DIGITS = 6


class Entry(NamedTuple):
    """A stream with its name and its power (W): on the mean, or at the angle that was asked for."""

    stream: Stream
    label: str
    power: float


def entries(flow: PowerFlow, at: float | None = None) -> tuple[Entry, ...]:
    """Every stream with its name in the language in use, and its power (W) on the mean or at a crank angle (rad)."""
    found = []
    for stream, power in zip(flow.streams, [s.mean for s in flow.streams] if at is None else flow.at(at), strict=True):
        tiny = flow.error * max(abs(stream.greatest), abs(stream.least), flow.scale)
        found.append(Entry(stream, stream_name(stream, flow), power if abs(power) > tiny else 0.0))
    return tuple(found)


def places(flow: PowerFlow) -> dict[str, str]:
    """The names of the shafts, the drive and the mains of a power flow, by their places.

    >>> import flywheel
    >>> scene = {"load": [{"on": "crank", "torque": "-9 N m", "from": 0, "to": 3}], "drive": {"torque": "balance"},
    ...          "regime": {"speed": 10}, "flywheel": {"irregularity": 0.02}}
    >>> flow = flywheel.power_flow(flywheel.size(flywheel.load(scene), simulate=False))
    >>> places(flow), [stream_name(stream, flow) for stream in flow.streams]
    ({'mains': 'mains', 'drive': 'drive', 'shafts.crank': 'crank'}, ['drive', 'load on crank', 'flywheel'])
    """
    drive = _("drive") if flow.scene.motor is None else _("motor")
    known = any(stream.kind in ("stator", "copper") for stream in flow.streams)
    mains = _("mains") if known or flow.scene.motor is None else _("air gap of the motor")
    return {"mains": mains, "drive": drive} | {f"shafts.{name}": shaft_name(name) for name in flow.scene.shafts}


def shaft_name(name: str) -> str:
    """A shaft by its name; the crank is the crank."""
    return place(name) if name == "crank" else _("shaft {name}", name=name)


def place(name: str) -> str:
    """A shaft or port in the fewest words."""
    return _("crank") if name == "crank" else name


def stream_name(stream: Stream, flow: PowerFlow) -> str:
    """What a stream of power is, in a few words: "belt motor–wheel", "load on slider (2)" where there are more of them."""
    name = _name(stream, flow)
    alike = [other for other in flow.streams if _name(other, flow) == name]
    return name if len(alike) == 1 else f"{name} ({alike.index(stream) + 1})"


def _name(stream: Stream, flow: PowerFlow) -> str:
    """The same without a number."""
    scene, on = flow.scene, place(stream.on)
    if len(scene.mechanisms) == 1 and stream.on not in scene.shafts:
        on = stream.on.removeprefix(f"{scene.mechanisms[0].name}.")
    if stream.kind in ("input", "drive"):
        return places(flow)["mains" if stream.kind == "input" else "drive"]
    if stream.kind in ("mesh", "slip", "shaft"):
        row = next(row for row in flow.shafts if row.shaft == stream.on)
        pair = "–".join(map(place, (row.shaft, row.on or "crank")))
        belt = any(other.kind == "slip" and other.on == stream.on for other in flow.streams)
        words = {"slip": _("slip of belt {shafts}"), "shaft": _("through {shafts}")}
        return words.get(stream.kind, _("belt {shafts}") if belt else _("mesh {shafts}")).format(shafts=pair)
    if stream.kind == "load":
        model = next((load.model for load in scene.loads if load.path == stream.name), "").partition(":")[0]
        return _("{what} on {place}", what=_model(model), place=on)
    if stream.kind == "stored":
        return _stored(stream, on)
    words = {
        "copper": _("windings of the motor"),
        "stator": _("stator of the motor"),
        "rotor": _("rotor of the motor"),
        "iron": _("iron and friction of the motor"),
        "windage": _("friction and fan of the motor"),
        "drag": _("drag on {place}", place=on),
        "damper": _("damper on {place}", place=on),
        "friction": _("friction in joints"),
        "resistance": _("losses on {place}", place=on),
    }
    return words.get(stream.kind, stream.kind)


def _model(name: str) -> str:
    """What a load of a known kind is; without a model a load."""
    models = {
        "constant": _("resistance"),
        "fan": _("fan"),
        "pump": _("pump"),
        "belt": _("belt"),
        "press": _("press"),
        "punch": _("punch"),
        "indicator": _("gas"),
        "compressor": _("compressor"),
    }
    return models.get(name, _("load"))


def _stored(stream: Stream, on: str) -> str:
    """What takes power up and gives it back."""
    known = {
        "flywheel": _("flywheel"),
        "gravity": _("weights on {place}", place=on),
        "inductance": _("inductance of the motor"),
        "field": _("field of the motor"),
        "inertia": _("inertia on {shaft}", shaft=on),
        "masses": _("masses on {shaft}", shaft=on),
    }
    return known.get(stream.name.rsplit(".", 1)[-1], _("spring on {place}", place=on))


def given(flow: PowerFlow, found: Sequence[Entry]) -> float:
    """What comes in from outside, and is given back by stores (W): the whole that shares are taken of."""
    return sum(abs(entry.power) for entry in found if gives(flow, entry))


def gives(flow: PowerFlow, entry: Entry) -> bool:
    """Whether a stream gives at that time what others take: from outside, or out of a store."""
    kind, power = entry.stream.kind, entry.power
    if kind == "stored":
        return power < 0.0
    if kind == "drive" and any(stream.kind == "input" for stream in flow.streams):
        return False
    outside = entry.stream.source in ("mains", "drive") or (kind == "load" and entry.stream.source == entry.stream.name)
    return kind in ("input", "drive", "load") and (power > 0.0 if outside else power < 0.0)


# -- the table -----------------------------------------------------------------------------------------------------------


def text(flow: PowerFlow, at: float | None = None) -> str:
    """What `flywheel power` prints: the balance, every stream, every shaft."""
    title = [flow.scene.title] if flow.scene.title else []
    return page((sentences(title, ""), balance(flow, at), shafts(flow)))


def json(flow: PowerFlow, at: float | None = None) -> str:
    """What `flywheel power --json` prints, SI throughout."""
    return encoded({"title": flow.scene.title, **flow.as_dict(at), "error": flow.error}, indent=2)


def balance(flow: PowerFlow, at: float | None = None) -> list[str]:
    """The balance of the mean, stream by stream: what comes in, what is lost, what arrives; then what is only stored."""
    now = None if at is None else {entry.stream.name + entry.stream.kind: entry.power for entry in entries(flow, at)}
    mean = entries(flow)
    whole = given(flow, mean)
    header = [_("power, W"), _("mean"), _("share, %"), _("least"), _("greatest")]
    if at is not None:
        header.append(_("at {angle}°", angle=number(figure(at * DEGREES, most=_DIGITS))))

    def row(entry: Entry, name: str) -> tuple[str, ...]:
        stream = entry.stream
        cells = [_watts(flow, stream.mean), _share(stream.mean, whole)]
        cells += [_watts(flow, stream.least), _watts(flow, stream.greatest)]
        return (name, *cells, *([] if now is None else [_watts(flow, now[stream.name + stream.kind])]))

    ends: dict[str, list[Entry]] = {"input": [], "lost": [], "output": []}
    for entry in mean:
        if entry.stream.lost:
            ends["lost"].append(entry)
        elif entry.stream.kind in ("input", "load") or (entry.stream.kind == "drive" and not _electric(flow)):
            ends["input" if gives(flow, entry) else "output"].append(entry)
    rows: list[tuple[str, ...]] = []
    sums = {"input": flow.input, "lost": flow.losses, "output": flow.output}
    titles = {"input": _("comes in"), "lost": _("is lost"), "output": _("arrives")}
    blank = ("",) * (len(header) - 3)
    for key, found in ends.items():
        if found:
            rows.append((titles[key], _watts(flow, sums[key]), _share(sums[key], whole), *blank))
            rows += [row(entry, f"  {entry.label}") for entry in found]
    rows.append((_("lost and arrived"), _watts(flow, flow.losses + flow.output),
                 _share(flow.losses + flow.output, whole), *blank))  # fmt: skip
    stored = [entry for entry in mean if entry.stream.kind == "stored"]
    if stored:
        rows.append((_("stored and given back"), *("",) * (len(header) - 1)))
        rows += [row(entry, f"  {entry.label}") for entry in stored]
    period = number(figure(flow.period, flow.error * flow.period, _DIGITS))
    return [_("Power flow over a cycle of {period} s", period=period), *columns(rows, header)]


def _electric(flow: PowerFlow) -> bool:
    return any(stream.kind == "input" for stream in flow.streams)


def shafts(flow: PowerFlow) -> list[str]:
    """Every shaft: its speed, and what its mesh carries on its own side."""
    header = [_("shaft"), "rpm", _("power to"), _("mean, W"), _("greatest, W"), _("rms, W")]
    header += [_("mean, N m"), _("greatest, N m"), _("rms, N m")]
    rows = []
    for one in flow.shafts:
        powers = one.power_mean, one.power_greatest, one.power_rms
        torques = one.torque_mean, one.torque_greatest, one.torque_rms
        figures = ["" if value is None else _watts(flow, value) for value in (*powers, *torques)]
        to = "" if one.to is None else place(one.to)
        rows.append((place(one.shaft), number(figure(one.speed * RPM, 0.0, _DIGITS)), to, *figures))
    if len(rows) < 2:
        return []
    told = _("Shafts: mean speed, and power and torque through the mesh, on its own side")
    return [told, *columns(rows, header)]


def _watts(flow: PowerFlow, value: float) -> str:
    return number(figure(value, flow.error * max(abs(value), 1e-9 * flow.scale), _DIGITS))


def _share(value: float, whole: float) -> str:
    return number(figure(100 * value / whole, 0.0, 4)) if whole > 0.0 else ""


# -- the sentence ----------------------------------------------------------------------------------------------------


def sentence(flow: PowerFlow, units: TradeUnits = SI, *, losses: bool = True) -> str | None:
    """How much arrives, and the greatest losses: "92.4 % of 7.31 kW arrive at the loads; lost: belt motor–wheel 290 W."."""
    if not flow.losses > _TINY * flow.input:
        return None
    lost = sorted((entry for entry in entries(flow) if entry.stream.lost), key=lambda entry: -entry.power)
    lost = [entry for entry in lost if entry.power > _TINY * flow.input]
    parts = [f"{entry.label} {units.read(entry.power, 'power', 3)}" for entry in lost]
    kept = len(parts)
    while kept > 1 and (kept > _MOST_TOLD or len(", ".join(parts[:kept])) > _LONGEST):
        kept -= 1
    if kept < len(parts):
        rest = units.read(sum(entry.power for entry in lost[kept:]), "power", 3)
        parts[kept:] = [_("{n} more {power}", n=len(parts) - kept, power=rest)]
    whole = units.read(flow.input, "power", 3)
    if flow.output <= _TINY * flow.input:
        return _("All of {power} is lost: {losses}.", power=whole, losses=", ".join(parts))
    told = {"share": few_digits(100 * flow.output / flow.input, 3), "power": whole, "losses": ", ".join(parts)}
    if not losses:
        return _("{share} % of {power} arrive at the loads.", **told)
    return _("{share} % of {power} arrive at the loads; lost: {losses}.", **told)
