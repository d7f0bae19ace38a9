"""What a colleague would ask about a scene that can be read: good numbers that are hardly those that were meant.

Each rule holds a number against one limit of the trade; nothing is refused for it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping

from flywheel.advice import quote
from flywheel.faults import Remark
from flywheel.reading.fields import Quantity, child, items
from flywheel.scene import Mechanism, Scene
from flywheel.units import plain_number, split_quantity

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
