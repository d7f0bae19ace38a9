"""What the tests of the families share: a walk along the chain, and positions derived without it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest
from mpmath import mp

from flywheel.mechanisms.families import Family, Ratio
from flywheel.scene.scene import Body, Mechanism


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


def from_pivot(pivot: Any, angle: Any, body: Body) -> Any:
    """Centre of mass, as a complex number, of a body whose first pin is at `pivot`."""
    return pivot + body.com * mp.expj(angle + body.com_angle)


def yoke_places(geometry: Mapping[str, float], psi: Any, bodies: Mapping[str, Body], open_: bool) -> dict[str, Any]:
    direction = geometry["yoke.direction"]
    pin = geometry["crank.length"] * mp.expj(psi)
    return {"yoke": (pin * mp.expj(-direction)).real, "block": pin}


def slider_places(geometry: Mapping[str, float], psi: Any, bodies: Mapping[str, Body], open_: bool) -> dict[str, Any]:
    rod, offset = mp.mpf(geometry["rod.length"]), mp.mpf(geometry["slider.offset"])
    pin = geometry["crank.length"] * mp.expj(psi)
    slider = pin.real + mp.sqrt(rod**2 - (pin.imag - offset) ** 2)
    angle = mp.arg(mp.mpc(slider, offset) - pin)
    return {"slider": slider, "rod": angle, "rod.com": from_pivot(pin, angle, bodies.get("rod", Body()))}


def four_bar_places(geometry: Mapping[str, float], psi: Any, bodies: Mapping[str, Body], open_: bool) -> dict[str, Any]:
    ground, coupler, rocker = (mp.mpf(geometry[f"{bar}.length"]) for bar in ("ground", "coupler", "rocker"))
    pin = geometry["crank.length"] * mp.expj(psi)
    across = ground - pin
    corner = mp.acos((abs(across) ** 2 + coupler**2 - rocker**2) / (2 * abs(across) * coupler))
    joint = pin + coupler * across / abs(across) * mp.expj(corner if open_ else -corner)
    angles = {"coupler": mp.arg(joint - pin), "rocker": mp.arg(joint - ground)}
    return {
        **angles,
        "coupler.com": from_pivot(pin, angles["coupler"], bodies.get("coupler", Body())),
        "rocker.com": from_pivot(ground, angles["rocker"], bodies.get("rocker", Body())),
    }


def shaper_places(geometry: Mapping[str, float], psi: Any, bodies: Mapping[str, Body], open_: bool) -> dict[str, Any]:
    pin = geometry["frame.length"] + geometry["crank.length"] * mp.expj(psi)
    angle = mp.arg(pin)
    end = geometry["rocker.length"] * mp.expj(angle)
    com = from_pivot(0, angle, bodies.get("rocker", Body()))
    return {"rocker": angle, "ram": end.imag, "block": pin, "rocker_pin": end, "rocker.com": com}


PLACES: Mapping[str, Callable[..., dict[str, Any]]] = {
    "scotch-yoke": yoke_places,
    "slider-crank": slider_places,
    "four-bar": four_bar_places,
    "crank-shaper": shaper_places,
}


@pytest.fixture
def walk() -> Callable[..., dict[str, tuple[Any, Any]]]:
    return walked


@pytest.fixture
def places() -> Callable[[Mechanism, Any], dict[str, Any]]:
    """Angles and displacements by name, and points as complex numbers, without the toolkit's formulas."""

    def found(mechanism: Mechanism, psi: Any) -> dict[str, Any]:
        bodies = mechanism.bodies
        known = PLACES[mechanism.type](mechanism.geometry, psi, bodies, mechanism.assembly == "open")
        pin = mechanism.geometry["crank.length"] * mp.expj(psi)
        return {"crank.pin": pin, "crank.com": from_pivot(0, psi, bodies.get("crank", Body())), "crank": psi, **known}

    return found
