"""Linkages with masses, for the routes: those of the position tests made heavy, and some with joints of other kinds."""

from __future__ import annotations

from dataclasses import replace
from math import asin, cos, pi, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from flywheel.mechanisms.linkages.multibody import LinkageActions, LinkageModel, Wrench, coordinates
from flywheel.mechanisms.linkages.positions import solve_over
from flywheel.scene.linkage import FIXED, FRAME, SLIDE, Joint, Link, Linkage, Point
from tests.linkages.linkages import CASES, ground, pin, slider_crank

Array = NDArray[np.float64]
O = Point("O")  # noqa: E741


def heavy(linkage: Linkage) -> Linkage:
    """The linkage with a mass, an inertia and a centre off its line for every body."""
    links = [
        link._replace(mass=1.0 + 0.7 * k, inertia=0.01 + 0.02 * k, com=(0.05 + 0.01 * k, 0.02 - 0.01 * k))
        for k, link in enumerate(linkage.links)
    ]
    return replace(linkage, links=tuple(links))


def with_flag() -> Linkage:
    """A slider-crank whose rod carries a plate fixed to it at an angle."""
    base = slider_crank()
    plate, rod = Link("plate", (O, Point("P", 0.1, 0.05))), base.link("rod")
    joint = Joint("weld", FIXED, "rod", "plate", rod.point("E"), plate.point("P"), angle=0.6)
    return replace(base, links=(*base.links, plate), joints=(*base.joints, joint))


def engine() -> Linkage:
    """A slider-crank driven by its slider."""
    base = slider_crank()
    links = (base.links[0]._replace(guess=1.2), base.links[1]._replace(guess=-0.25), base.links[2])
    return replace(base, links=links, driver="guide", start=0.325)


def double_guided() -> Linkage:
    """A slider-crank whose slider is guided twice: one normal and one moment too many."""
    base = slider_crank()
    ram = base.links[2]._replace(points=(O, Point("T", 0.1)))
    joints = (*base.joints, Joint("second guide", SLIDE, FRAME, "slider", base.ground.point("G"), ram.point("T")))
    return replace(base, links=(*base.links[:2], ram), joints=joints)


def pendulum(length: float = 0.5) -> Linkage:
    """A point mass of 2 kg on a weightless arm."""
    arm = Link("arm", (O,), mass=2.0, com=(length, 0.0))
    return Linkage(ground(), (arm,), (pin("O", FRAME, "arm"),), "O")


MACHINES: dict[str, Linkage] = {
    **{name: heavy(linkage) for name, (linkage, _) in CASES.items()},
    "rigid joint": heavy(with_flag()),
    "driven by the slider": heavy(engine()),
}
STARTS = {name: 0.325 if name == "driven by the slider" else 1.1 for name in MACHINES}

R, L, OMEGA_SLOPE = 0.2, 0.6, 2.387  # m, m, N m s: the published slider-crank
THETA3 = 2 * pi - asin(1 / 3)


def published() -> Linkage:
    """The slider-crank of the paper on differential-algebraic equations: a2 = 0.2, a3 = 0.6 m, e = 0."""
    crank = Link("crank", (O, Point("E", R)), 12.0, 1.0)
    rod = Link("rod", (O, Point("E", L)), 6.0, 3.0, (0.3, 0.0), guess=THETA3)
    joints = (
        pin("pivot", FRAME, "crank"),
        pin("crank pin", "crank", "rod", crank.point("E")),
        pin("slider pin", "rod", "slider", rod.point("E")),
        Joint("guide", SLIDE, FRAME, "slider", O, O),
    )
    return Linkage(ground(), (crank, rod, Link("slider", (O,), 6.0)), joints, "pivot", start=pi / 2)


def motor(t: float, q: float, omega: float) -> float:
    """Its falling motor torque, N m."""
    return 10.0 - OMEGA_SLOPE * omega


GRAVITY = (0.0, -9.81)


def published_rates(t: float, y: Array) -> list[float]:
    """d(theta2, omega2)/dt of the published slider-crank, written out by hand: I* alpha + ½ dI*/dphi omega² = M*.

    Rod's angle b with l sin b = -r sin phi; b' = -r cos phi/(l cos b), b'' = (r sin phi/l + sin b b'²)/cos b.
    """
    phi, omega = y
    s, c = sin(phi), cos(phi)
    sb = -R * s / L
    cb = sqrt(1 - sb * sb)
    b1 = -R * c / (L * cb)
    b2 = (R * s / L + sb * b1 * b1) / cb
    x1, y1 = -R * s - 0.3 * sb * b1, R * c + 0.3 * cb * b1
    x2, y2 = -R * c - 0.3 * (cb * b1**2 + sb * b2), -R * s + 0.3 * (cb * b2 - sb * b1**2)
    u1, u2 = -R * s - L * sb * b1, -R * c - L * (cb * b1**2 + sb * b2)
    inertia = 1.0 + 6.0 * (x1**2 + y1**2) + 3.0 * b1**2 + 6.0 * u1**2
    half = 6.0 * (x1 * x2 + y1 * y2) + 3.0 * b1 * b2 + 6.0 * u1 * u2
    return [omega, (motor(0.0, phi, omega) - 6.0 * 9.81 * y1 - half * omega**2) / inertia]


EXACT = {
    0.5: (2.3009822198155999566, 2.8303754015862116778),
    1.0: (4.2927502106887841886, 4.7646634585820911423),
    2.0: (8.0000102983657727338, 3.3277817606580480188),
    5.0: (20.270356836805975522, 3.2196739241052132796),
}
"""theta2 and omega2 at times (s), by Taylor series of the same equation at 30 digits."""


def prepared(name: str, actions: LinkageActions | None = None) -> tuple[LinkageModel, Array]:
    """A machine under loads of every kind, and a closed pose of it."""
    linkage = MACHINES[name]
    last = linkage.links[-1].name
    loads = (Wrench(last, (3.0, lambda t, q, qdot: -2.0 * qdot + t), 1.5, (0.04, -0.03)), Wrench(last, (0.0, 1.0)))
    result = model_at(
        linkage, STARTS[name], actions or LinkageActions((0.3, -9.81), lambda t, q, qdot: 4.0 - 0.2 * qdot, loads)
    )
    return result, result.start


def model_at(linkage: Linkage, q: float, actions: LinkageActions) -> LinkageModel:
    """A linkage with its pose at the driver's coordinate."""
    return LinkageModel(linkage, actions, coordinates(solve_over(linkage, (linkage.start, q)).poses(q)))
