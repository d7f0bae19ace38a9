"""Named mechanisms for tests, a walk along their chains, and positions derived without them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from mpmath import mp

from flywheel.mechanisms.families import Family, Ratio
from flywheel.scene.scene import Body, Mechanism

ROD = Body(3.0, 0.2, 0.4, 0.3)
STRAIGHT = Body(2.0, 0.1, 0.25)
CRANK = Body(5.0, 0.7, 0.06, -0.8)
CLAMP = ("frame.height", "bell_crank.drive_length", "coupler.length", "bell_crank.clamp_length", "rod.length")
CLAMP_BODIES = {
    "block": Body(33.2930),
    "bell_crank": Body(16.1475, 0.1195, 0.11, 0.2),
    "coupler": Body(1.3051, 0.0022, 0.0475, -0.3),
    "rod": Body(16.7364, 0.1699, 0.13),
    "platen": Body(298.4963),
}


def yoke(direction: float) -> Mechanism:
    bodies = {"crank": CRANK, "block": Body(1.5), "yoke": Body(20.0)}
    return Mechanism("scotch-yoke", "m", geometry={"crank.length": 0.5, "yoke.direction": direction}, bodies=bodies)


def slider(crank: float, rod: float, offset: float = 0.0, body: Body = ROD) -> Mechanism:
    geometry = {"crank.length": crank, "rod.length": rod, "slider.offset": offset}
    return Mechanism("slider-crank", "m", geometry=geometry, bodies={"crank": CRANK, "rod": body, "slider": Body(4.0)})


def four_bar(ground: float, crank: float, coupler: float, rocker: float, assembly: str = "open") -> Mechanism:
    lengths = {"ground": ground, "crank": crank, "coupler": coupler, "rocker": rocker}
    geometry = {f"{bar}.length": length for bar, length in lengths.items()}
    bodies = {"crank": CRANK, "coupler": ROD, "rocker": STRAIGHT}
    return Mechanism("four-bar", "m", geometry=geometry, assembly=assembly, bodies=bodies)


def shaper(crank: float, frame: float) -> Mechanism:
    geometry = {"crank.length": crank, "frame.length": frame, "rocker.length": 0.8}
    bodies = {"rocker": ROD, "block": Body(1.0, 0.05), "rocker_pin": Body(0.5), "ram": Body(9.0), "crank": CRANK}
    return Mechanism("crank-shaper", "m", geometry=geometry, bodies=bodies)


def clamp(
    height: float = 0.14,
    drive: float = 0.16763,
    coupler: float = 0.095,
    arm: float = 0.22,
    rod: float = 0.26,
    angle: float = 0.30199,
    stroke: tuple[float, float] | None = (-0.06, 0.19),
    assembly: str = "open",
) -> Mechanism:
    geometry = {**dict(zip(CLAMP, (height, drive, coupler, arm, rod), strict=True)), "bell_crank.angle": angle}
    return Mechanism("toggle-clamp", "m", geometry=geometry, stroke=stroke, assembly=assembly, bodies=CLAMP_BODIES)


def exactly(mechanism: Mechanism) -> Mechanism:
    """The same mechanism with its floats as mpmath's numbers, so that nothing is rounded to 16 digits."""
    geometry = {name: mp.mpf(value) for name, value in mechanism.geometry.items()}
    return replace(mechanism, geometry=geometry, bodies={k: Body(*map(mp.mpf, b)) for k, b in mechanism.bodies.items()})


def walked(family: Family, psi: Any, ns: Any = np) -> dict[str, tuple[Any, Any]]:
    """Gain of every velocity over the crank's, and the gain's slope, term by term along the chain."""
    position = family.position(psi, ns)
    gains: dict[str, tuple[Any, Any]] = {"crank": (1.0, 0.0)}
    for velocity in family.velocities:
        gain: Any = 0.0
        slope: Any = 0.0
        for source, ratio in velocity.terms:
            t, dt = (ratio.value(position), ratio.slope(position)) if isinstance(ratio, Ratio) else (ratio, 0.0)
            g, dg = gains[source]
            gain, slope = gain + t * g, slope + dt * g + t * dg
        gains[velocity.name] = gain, slope
    return gains


def places(mechanism: Mechanism, psi: Any) -> dict[str, Any]:
    """Angles and displacements by name, and points as complex numbers, without the toolkit's formulas."""
    length: Mapping[str, Any] = {name: mp.mpf(value) for name, value in mechanism.geometry.items()}
    pin = length["crank.length"] * mp.expj(psi)

    def centre(body: str, pivot: Any, angle: Any) -> Any:
        of = mechanism.bodies.get(body, Body())
        return pivot + of.com * mp.expj(angle + of.com_angle)

    result = {"crank.pin": pin, "crank.com": centre("crank", 0, psi), "crank": psi}
    if mechanism.type == "scotch-yoke":
        return result | {"yoke": (pin * mp.expj(-length["yoke.direction"])).real, "block": pin}
    if mechanism.type == "slider-crank":
        offset = length["slider.offset"]
        slide = pin.real + mp.sqrt(length["rod.length"] ** 2 - (pin.imag - offset) ** 2)
        angle = mp.arg(mp.mpc(slide, offset) - pin)
        return result | {"slider": slide, "rod": angle, "rod.com": centre("rod", pin, angle)}
    if mechanism.type == "crank-shaper":
        pin = length["frame.length"] + pin
        angle = mp.arg(pin)
        end = length["rocker.length"] * mp.expj(angle)
        com = centre("rocker", 0, angle)
        return result | {"rocker": angle, "ram": end.imag, "block": pin, "rocker_pin": end, "rocker.com": com}
    ground, coupler, rocker = (length[f"{bar}.length"] for bar in ("ground", "coupler", "rocker"))
    across = ground - pin
    corner = mp.acos((abs(across) ** 2 + coupler**2 - rocker**2) / (2 * abs(across) * coupler))
    joint = pin + coupler * across / abs(across) * mp.expj(corner if mechanism.assembly == "open" else -corner)
    angles = {"coupler": mp.arg(joint - pin), "rocker": mp.arg(joint - ground)}
    return (
        result
        | angles
        | {
            "coupler.com": centre("coupler", pin, angles["coupler"]),
            "rocker.com": centre("rocker", ground, angles["rocker"]),
        }
    )
