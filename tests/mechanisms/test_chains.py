"""Every family's chain against positions that are derived and differentiated without it, at 30 digits."""

from __future__ import annotations

from math import pi, tau
from typing import Any

import numpy as np
import pytest
import sympy
from mpmath import mp

from flywheel.mechanisms.families import build
from flywheel.numerics.intervals import NAMESPACE, Interval
from flywheel.scene.scene import Body, Mechanism
from tests.limits import sample
from tests.mechanisms.chains import STRAIGHT, exactly, four_bar, places, shaper, slider, walked, yoke

CHAINS = {
    "yoke up": yoke(pi / 2),
    "slider": slider(0.1, 0.3),
    "slider, straight rod": slider(0.1, 0.3, 0.02, STRAIGHT),
    "slider, rod's mass at the pin": slider(0.1, 0.3, -0.1, Body(3.0, 0.2)),
    "slider, offset up, near lock": slider(0.5, 1.0, 0.499999),
    "slider, offset down, near lock": slider(0.9, 1.0, -0.0999),
    "crank-rocker": four_bar(4.0, 1.0, 3.0, 3.5),
    "crank-rocker, crossed": four_bar(4.0, 1.0, 3.0, 3.5, "crossed"),
    "crank-rocker near 180": four_bar(4.0, 1.0, 2.000001, 3.0),
    "crank-rocker near 0, crossed": four_bar(4.0, 1.0, 5.999999, 3.0, "crossed"),
    "drag-link": four_bar(1.0, 2.0, 2.5, 2.2),
    "drag-link, crossed": four_bar(1.0, 2.0, 2.5, 2.2, "crossed"),
    "drag-link near 0": four_bar(1.0, 2.0, 1.000001, 2.0),
    "shaper": shaper(0.1, 0.4),
    "whitworth": shaper(0.4, 0.1),
    "shaper near lock": shaper(0.4, 0.400001),
    "whitworth near lock": shaper(0.400001, 0.4),
}
chains = pytest.mark.parametrize("mechanism", CHAINS.values(), ids=CHAINS.keys())
CLEAR = {name: mechanism for name, mechanism in CHAINS.items() if "near" not in name}
clear = pytest.mark.parametrize("mechanism", CLEAR.values(), ids=CLEAR.keys())

# a yoke, and of the others the hard ones: close to a lock, or on both sides of a dead centre
HARD = [
    name for name in CHAINS if "near" in name or name in ("yoke up", "slider, straight rod", "drag-link, crossed", "shaper")
]


@pytest.fixture(autouse=True)
def _thirty_digits() -> Any:
    with mp.workdps(40):
        yield


def hard_angles(breakpoints: tuple[float, ...]) -> np.ndarray:
    """Dead centres, locks and breakpoints, on them and beside them, and angles of several turns."""
    centres = np.array([0.0, pi / 2, pi, -pi / 2, *breakpoints])
    beside = [centres + step for step in (0.0, 1e-12, -1e-7)]
    return np.concatenate([*beside, np.linspace(-9.0, 11.0, 7)])


def component(known: dict[str, Any], name: str) -> Any:
    """Displacement along a velocity: a coordinate, or an angle; None for a tangential speed."""
    place, _, axis = name.rpartition(".")
    place = "rocker_pin" if place == "rocker.pin" else place
    if axis in ("x", "y"):
        return None if place not in known else (known[place].real if axis == "x" else known[place].imag)
    return known.get(name) if name != "crank.pin" and not name.endswith(".com") else None


@pytest.mark.parametrize("mechanism", sample([pytest.param(m, id=name) for name, m in CLEAR.items()], 2))
def test_motion_energy_and_weight_are_those_of_the_bodies(mechanism: Mechanism) -> None:
    mechanism = exactly(mechanism)
    family, pull = build(mechanism), mp.mpc(0.6, -9.7)
    rides = {"scotch-yoke": {"block": "crank"}, "crank-shaper": {"block": "rocker"}}.get(mechanism.type, {})
    turns_with = {body: body for body in ("crank", "rod", "coupler", "rocker")} | rides
    along = {"yoke": mp.expj(mechanism.geometry.get("yoke.direction", 0)), "ram": 1j}
    for psi in map(mp.mpf, (0.3, 3.1417)):
        gains = walked(family, psi, mp)
        for name, (gain, slope) in gains.items():
            if component(places(mechanism, psi), name) is None:
                continue
            expected = mp.taylor(lambda at, name=name: component(places(mechanism, at), name), psi, 2)
            assert abs(gain - expected[1]) <= 1e-18 * (1 + abs(expected[1])), name
            assert abs(slope - 2 * expected[2]) <= 1e-14 * (1 + abs(expected[2])), name
        energy = mp.mpf(0)
        for name, body in mechanism.bodies.items():
            spot = f"{name}.com" if f"{name}.com" in places(mechanism, psi) else name
            speed = mp.diff(lambda at, spot=spot: places(mechanism, at)[spot], psi)
            spin = mp.diff(lambda at, name=name: places(mechanism, at).get(turns_with.get(name, ""), 0), psi)
            energy += body.mass * abs(speed) ** 2 + body.inertia * spin**2
            velocity = speed if isinstance(places(mechanism, psi)[spot], mp.mpc) else speed * along.get(name, 1)
            own = [weight for weight in family.weights if weight.body == name]
            found = sum(w.mass * (mp.conj(pull) * mp.expj(w.direction)).real * gains[w.velocity][0] for w in own)
            assert abs(found - body.mass * (mp.conj(pull) * velocity).real) <= 1e-14 * body.mass
        assert abs(sum(mass.value * gains[mass.velocity][0] ** 2 for mass in family.masses) - energy) <= 1e-18 * energy


@pytest.mark.parametrize("mechanism", [pytest.param(CHAINS[name], id=name) for name in HARD])
def test_floats_keep_their_digits(mechanism: Mechanism) -> None:
    family = build(mechanism)
    angles = hard_angles(family.breakpoints[:: max(len(family.breakpoints) // 6, 1)])
    found, true = walked(family, angles), build(exactly(mechanism))
    scale = {v.name: 1.0 if v.rotating else float(mechanism.geometry["crank.length"]) for v in family.velocities}
    for i, psi in enumerate(angles):
        exact = walked(true, mp.mpf(psi), mp)
        for name, unit in scale.items():
            for k in (0, 1):
                value = np.broadcast_to(found[name][k], angles.shape)[i]
                assert abs(value - exact[name][k]) <= 1e-12 * max(abs(exact[name][k]), unit), (name, k, psi)


@chains
def test_ports_are_continuous_and_return_as_they_say_and_bounds_hold_over_whole_cells(mechanism: Mechanism) -> None:
    family = build(mechanism)
    psi = np.unique(np.concatenate([np.linspace(-tau, 2 * tau, 4001), hard_angles(family.breakpoints)]))
    steepest = {name: np.max(np.abs(gain)) for name, (gain, _) in walked(family, psi).items()}
    position, start = family.position(psi, np), family.position(np.array([0.0, tau]), np)
    edges = np.unique([*np.linspace(0.0, tau, 41), *family.breakpoints])
    lo, hi = edges[:-1], edges[1:]
    cells, sampled = family.position(Interval(lo, hi), NAMESPACE), lo + np.linspace(0.0, 1.0, 9)[:, None] * (hi - lo)
    for port in family.ports.values():
        path, (first, last) = port.position(position), port.position(start)
        assert np.all(np.abs(np.diff(path)) <= 1.5 * steepest[port.velocity] * np.diff(psi) + 1e-9)
        assert -pi < first <= pi
        assert last - first == pytest.approx(0.0 if port.returns else tau, abs=1e-12)
        bounds, values = port.position(cells), port.position(family.position(sampled, np))
        assert np.all((bounds.lo <= values + 1e-12) & (values - 1e-12 <= bounds.hi))
        assert np.all(bounds.hi - bounds.lo < 7.0)


@pytest.mark.parametrize("name", ["yoke up", "slider, straight rod", "crank-rocker, crossed", "shaper"])
def test_symbols_pass_through(name: str) -> None:
    family, psi = build(CHAINS[name]), sympy.Symbol("psi", real=True)
    for port in family.ports.values():
        if port.velocity == "ram":
            continue  # its ratio is the rocker's, not the crank's
        position = family.position(psi, sympy)
        gain = getattr(position, f"{port.velocity}_rate")
        difference = sympy.diff(port.position(position), psi) - gain
        assert abs(difference.subs(psi, 0.8).evalf()) < 1e-12


def test_bodies_without_mass_leave_no_trace() -> None:
    family = build(Mechanism("slider-crank", "m", geometry={"crank.length": 0.1, "rod.length": 0.3}))
    assert family.masses == family.weights == ()
    names = [v.name for v in family.velocities if v.name.startswith("crank")]
    assert names == ["crank.pin", "crank.pin.x", "crank.pin.y"]


def test_an_unknown_type_is_refused_with_its_place() -> None:
    with pytest.raises(ValueError, match=r"mechanism\[2\].type: found 'gearbox'"):
        build(Mechanism("gearbox", "m", path="mechanism[2]"))
