"""Choices that a form offers for a scene, valid or not: shafts, ports, points and joints by name, initial values."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from flywheel.mechanisms import KINDS
from flywheel.numerics.units import DIMENSIONS
from flywheel.reading.fields import child
from flywheel.reading.mechanisms import driver_slides
from flywheel.reading.motors import TABLES
from flywheel.reading.toml_edits import literal
from flywheel.scene.scene import Key


class ScenePlaces(NamedTuple):
    """The places of a scene, as far as they are known without a full reading.

    `ports` tells of each, by the names of its mechanism and its own with a dot between them, whether it rotates.
    """

    shafts: tuple[str, ...]
    ports: tuple[tuple[str, bool], ...]
    points: tuple[str, ...]
    joints: tuple[str, ...]
    drivers: tuple[str, ...]
    sliding: bool
    meshes: tuple[tuple[str, str], ...] = ()
    """Shafts, each with the shaft that it meshes with, if the scene names it."""

    def near(self, path: str) -> tuple[str, ...]:
        """Shafts that the table at `path` may name; a shaft must not name one that depends on it (a circle).

        >>> chain = {"wheel": {}, "motor": {"on": "wheel"}, "fan": {}}
        >>> places_of({"shafts": chain}).near("shafts.wheel")
        ('crank', 'fan')
        """
        beyond = {name for name in self.shafts if child("shafts", name) == path}
        for _link in self.meshes if beyond else ():
            beyond |= {name for name, on in self.meshes if on in beyond}
        return tuple(name for name in self.shafts if name not in beyond)

    def all(self, present: object) -> tuple[str, ...]:
        """Shafts and ports, each by its bare name if that is unique, or as it is written."""
        full = {name: name.partition(".")[2] for name, _rotating in self.ports}
        many = Counter(full[name] for name, _rotating in self.ports)
        names = [name if name == present or many[bare] > 1 or bare in self.shafts else bare for name, bare in full.items()]
        return (*self.shafts, *names)

    def rotates(self, name: object) -> bool | None:
        """Tests whether a place rotates; None if there is no such place."""
        if name in self.shafts:
            return not self.sliding
        kinds = {rotating for port, rotating in self.ports if name in (port, port.partition(".")[2])}
        return kinds.pop() if len(kinds) == 1 else None

    def begun(self, section: str) -> str:
        """An initial table or parameter as TOML, with little effect."""
        slides = next((k for k, (_name, rotating) in enumerate(self.ports) if not rotating), None)
        on = self.shafts[0] if slides is None else self.all(None)[len(self.shafts) + slides]
        rotating = self.rotates(on) is not False
        ends = {"from": "0 mm", "to": "50 mm"} if self.sliding else {"from": "0 deg", "to": "90 deg"}
        lengths = {"crank": {"length": "80 mm"}, "rod": {"length": "300 mm"}}
        begun: dict[str, object] = {
            "parameters": 1,
            "shafts": {"ratio": 2},
            "mechanism": {"type": "slider-crank", **lengths},
            "inertia": {"on": on, "value": "1 kg m^2" if rotating else "1 kg"},
            "load": {"on": on} | ({"torque": "0 N m"} if rotating else {"force": "0 N"}),
            "spring": {"on": on, "stiffness": "10 N m/rad" if rotating else "1 kN/m"},
            "damper": {"on": on, "coefficient": "0.1 N m s/rad" if rotating else "10 N s/m"},
            "gravity": {"direction": "-90 deg"},
            "drive": {"force": "100 N"} if self.sliding else {"torque": "balance"},
            "regime": {"speed": "60 rpm"},
            "flywheel": {"irregularity": "5 %"},
            "duty": {"duration": "60 s"},
            "brake": {"torque": "100 N m", "engage": "330 deg"},
            "single_stroke": {"rate": "10 1/min"},
            "stroke": ends,
            "areas": {"values": [1, -1], "scale": "100 J"},
            "accuracy": {"rtol": 1e-9},
        }
        return literal(begun[section])

    def begun_key(self, path: str, key: Key, dimension: str | None, table: Mapping[str, Any]) -> tuple[str, str]:
        """The initial value of a key, as it is typed into its field, and the field's kind."""
        if key.kind == "model":
            rotating = self.rotates(table.get("on"))
            begun = {"type": "constant"} | ({"torque": "1 N m"} if rotating is not False else {"force": "1 N"})
            if path.startswith("drive"):
                begun = {"type": "constant", "torque": "40 N m"}
            return literal(begun), "table"
        if key.name == "limits":
            return literal({"irregularity": "5 %"}), "table"
        if key.name == "clutch":
            return literal({"torque": "100 N m", "disengage": "300 deg"}), "table"
        if key.name in TABLES:
            return literal(dict(TABLES[key.name].begin)), "table"
        if key.kind in ("table", "position"):
            if key.kind == "position":
                return "0.01*sin(phi)", "expression"
            return literal({"angle": [0, 360], "value": [0, 0], "angle_unit": "deg"}), "table"
        if key.kind == "law":
            return ("0 N m" if key.name == "torque" else "0 N"), "expression"
        if dimension is not None:
            return example_of(key, dimension) or "", "number" if dimension == "number" else "quantity"
        if key.kind == "flag":
            return "true", "boolean"
        if key.choices:
            return str(key.choices[0] if key.default is None else key.default), "choice"
        if key.kind in ("numbers", "list"):
            return {"com": "0, 0", "teeth": "20, 40"}.get(key.name, "0, 0"), "list"
        if key.name == "on" or key.name == "shaft":
            return self.shafts[0], "choice"
        if key.name == "contact":
            return (self.points or ("",))[-1], "choice"
        return "" if key.default is None else str(key.default), "text"


def example_of(key: Key, dimension: str | None = None) -> str | None:
    """The default of a quantity, or the example of its dimension; None of a key that is no quantity."""
    dimension = key.kind.split(" | ")[0] if dimension is None else dimension
    if dimension not in DIMENSIONS:
        return None
    if isinstance(key.default, (int, float)):
        for unit, size in _ROUND.get(dimension, ()):
            if abs(round(key.default / size, 9) - key.default / size) < 1e-12:
                return f"{round(key.default / size, 9):.10g} {unit}".strip()
        return f"{key.default:.10g} {DIMENSIONS[dimension].si}".strip()
    example = key.example or DIMENSIONS[dimension].example
    return example if dimension != "number" or key.range.low <= 0.04 else f"{max(key.range.low, 1.0):g}"


_ROUND = {"length": (("mm", 1e-3),), "angle": (("deg", 3.141592653589793 / 180),)}


def places_of(raw: Mapping[str, Any]) -> ScenePlaces:
    """The places of a scene's tables, valid or not.

    >>> places = places_of({"shafts": {"pinion": {"ratio": 5}}, "mechanism": {"type": "slider-crank", "name": "press"}})
    >>> places.all("press.slider")
    ('crank', 'pinion', 'press.slider', 'rod')
    """
    named = raw.get("shafts")
    sliding = driver_slides(raw) is True
    shafts = dict.fromkeys(("slide",) if sliding else ("crank", *(named if isinstance(named, Mapping) else ())))
    ports: list[tuple[str, bool]] = []
    points: dict[str, None] = {}
    joints: dict[str, None] = {}
    drivers: dict[str, None] = {}
    mechanism = raw.get("mechanism")
    for table in [mechanism] if isinstance(mechanism, Mapping) else _tables(mechanism):
        kind, name = table.get("type"), table.get("name")
        if not isinstance(kind, str) or kind not in KINDS:
            continue
        name = name if isinstance(name, str) else kind
        ports += [(f"{name}.{port.name}", port.rotating) for port in KINDS[kind].ports]
        if kind == "law":
            outputs = _table(table.get("outputs"))
            ports += [(f"{name}.{key}", "theta" in _table(output)) for key, output in outputs.items()]
        elif kind == "linkage":
            ports += [(f"{name}.{port}", rotating) for port, rotating in _linkage_ports(table)]
            for body, of in _table(table.get("bodies")).items():
                points |= dict.fromkeys(f"{body}.{point}" for point in ("origin", *_table(_table(of).get("points"))))
            if points and "frame.origin" not in points:
                points = {"frame.origin": None} | points
            for joint in _tables(table.get("joints")):
                if isinstance(joint.get("name"), str):
                    joints[joint["name"]] = None
                    if joint.get("type") in ("pin", "slide"):
                        drivers[joint["name"]] = None
    meshes = [(str(shaft), of["on"]) for shaft, of in _table(named).items() if isinstance(_table(of).get("on"), str)]
    return ScenePlaces(tuple(shafts), tuple(ports), tuple(points), tuple(joints), tuple(drivers), sliding, tuple(meshes))


def _linkage_ports(table: Mapping[str, Any]) -> Iterator[tuple[str, bool]]:
    """Ports of a linkage, and whether they rotate: slides except the driver, points along a direction, bodies that turn."""
    driver = table.get("driver")
    joints = _tables(table.get("joints"))
    for joint in joints:
        if joint.get("type") in ("slide", "pin-in-slot") and isinstance(joint.get("name"), str) and joint["name"] != driver:
            yield joint["name"], False
    for port in _table(table.get("ports")):
        yield port, False
    straight = {body for joint in joints if joint.get("type") == "slide" for body in _bodies(joint)}
    driven = {body for joint in joints if joint.get("name") == driver for body in _bodies(joint)}
    for body in _table(table.get("bodies")):
        if body != "frame" and body not in straight | driven:  # it may turn
            yield body, True


def _bodies(joint: Mapping[str, Any]) -> list[str]:
    between = joint.get("between")
    return [point.partition(".")[0] for point in between if isinstance(point, str)] if isinstance(between, list) else []


def _table(raw: object) -> Mapping[str, Any]:
    return raw if isinstance(raw, Mapping) else {}


def _tables(raw: object) -> list[Mapping[str, Any]]:
    return [item for item in raw if isinstance(item, Mapping)] if isinstance(raw, list) else []
