"""What the streams and places of a power flow are called, in the language in use."""

from __future__ import annotations

from flywheel.language import text as _
from flywheel.sizing.power_flow import PowerFlow, Stream


def places(flow: PowerFlow) -> dict[str, str]:
    """The names of the shafts, the drive and the mains of a power flow, by their places.

    >>> import flywheel
    >>> scene = {"load": [{"on": "crank", "torque": "-9 N m", "from": 0, "to": 3}], "drive": {"torque": "balance"},
    ...          "regime": {"speed": 10}, "flywheel": {"irregularity": 0.02}}
    >>> flow = flywheel.power_flow(flywheel.size(flywheel.load(scene), simulate=False))
    >>> places(flow), [stream_name(stream, flow) for stream in flow.streams]
    ({'mains': 'mains', 'drive': 'drive', 'shafts.crank': 'crank'}, ['drive', 'load[0] (crank)', 'flywheel'])
    """
    drive = _("drive") if flow.scene.motor is None else _("motor")
    return {"mains": _("mains"), "drive": drive} | {f"shafts.{name}": shaft_name(name) for name in flow.scene.shafts}


def shaft_name(name: str) -> str:
    """A shaft by its name; the crank is the crank."""
    return _("crank") if name == "crank" else _("shaft {name}", name=name)


def stream_name(stream: Stream, flow: PowerFlow) -> str:
    """What a stream of power is, in a few words."""
    name, on = stream.name, stream.on
    if stream.kind in ("input", "drive"):
        return places(flow)["mains" if stream.kind == "input" else "drive"]
    of_kind = {
        "copper": _("windings of the motor"),
        "rotor": _("rotor of the motor"),
        "stator": _("stator of the motor"),
        "windage": _("friction and fan of the motor"),
        "shaft": _("to {place}", place=places(flow).get(stream.target, stream.target)),
        "mesh": _("mesh of {shaft}", shaft=shaft_name(on)),
        "slip": _("slip at {shaft}", shaft=shaft_name(on)),
        "drag": _("drag of {shaft}", shaft=shaft_name(on)),
        "damper": _("damper on {place}", place=shaft_name(on) if on in flow.scene.shafts else on),
        "friction": _("friction in joints"),
        "resistance": _("resistance on {place}", place=shaft_name(on) if on in flow.scene.shafts else on),
    }
    if stream.kind in of_kind:
        return of_kind[stream.kind]
    if stream.kind == "stored":
        end = name.rsplit(".", 1)[-1]
        of_store = {"flywheel": _("flywheel"), "gravity": _("weights"), "inductance": _("inductance of the motor")}
        of_store |= {"inertia": _("inertia of {shaft}", shaft=shaft_name(on)), "masses": _("moving masses")}
        return of_store.get(end, _("spring on {place}", place=on) if name.startswith("spring") else name)
    return f"{name} ({on})" if stream.kind == "load" and on else name
