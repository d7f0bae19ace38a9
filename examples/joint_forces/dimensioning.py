"""Iterated dimensioning of a four-bar: sections from reactions, masses from sections, reactions again, until they agree.

    python examples/joint_forces/dimensioning.py

The course's inverse dynamics problem: the reactions decide how thick the bars must be, but through their masses and
inertias the bars decide the reactions. Starting from bars without mass (the quasi-static analysis), every round finds the
forces over a turn at constant speed, the normal force N and the bending moment M in 41 sections of each bar, and the side b
of the square section whose greatest stress

    sigma = |N|/b² + 6 |M|/b³

is the allowable one, unless the bar would buckle between its pins: Euler's load pi² E b⁴/(12 l²) is to be three times the
greatest thrust. It stops when no mass changes by more than a millionth.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from flywheel.mechanisms.linkages.equations import Poses
from flywheel.mechanisms.linkages.positions import solve
from flywheel.mechanisms.linkages.reactions import Reactions, reactions_at
from flywheel.mechanisms.linkages.statics import Torque
from flywheel.numerics.units import columns
from flywheel.scene.linkage import Joint, Link, Linkage, Point

DENSITY, ALLOWABLE = 7850.0, 60e6  # kg/m³, Pa: steel, with the safety that fatigue asks for
MODULUS, SAFETY = 210e9, 3.0  # Pa; of Euler's load over the greatest thrust
SPEED, LOAD, GRAVITY = 60.0, 120.0, (0.0, -9.81)  # rad/s, N m against the rocker's motion, m/s²
LENGTHS = {"crank": 0.12, "coupler": 0.40, "rocker": 0.30}  # m
GROUND = 0.42
ENDS = {"crank": (("crank_pin", -1.0),), "coupler": (("coupler_pin", -1.0),), "rocker": (("coupler_pin", 1.0),)}
"""The joint at the far end of each bar, and the sign of what it does to the bar."""

TURN = np.linspace(0.0, 2 * np.pi, 181)
SHARES = np.linspace(0.0, 1.0, 41)
TOLERANCE, MOST = 1e-6, 50


class Round(NamedTuple):
    """One round: side of each bar's section (m) and its mass (kg), and the forces that it had while they were found."""

    sides: Mapping[str, float]
    masses: Mapping[str, float]
    forces: Reactions


def machine(sides: Mapping[str, float]) -> Linkage:
    """The four-bar with square steel bars of these sides (m); a side of 0 leaves a bar without mass."""
    origin = Point("o")
    guesses = {"crank": None, "coupler": 0.8, "rocker": 1.6}
    bars = {}
    for name, length in LENGTHS.items():
        mass = DENSITY * sides[name] ** 2 * length
        points = (origin, Point("end", length))
        bars[name] = Link(name, points, mass, mass * length**2 / 12, (length / 2, 0.0), guesses[name])
    crank, coupler, rocker = bars.values()
    far = Point("far", GROUND)
    joints = (
        Joint("pivot", "pin", "frame", "crank", origin, origin),
        Joint("crank_pin", "pin", "crank", "coupler", crank.point("end"), origin),
        Joint("coupler_pin", "pin", "coupler", "rocker", coupler.point("end"), rocker.point("end")),
        Joint("rocker_pivot", "pin", "frame", "rocker", far, origin),
    )
    return Linkage(Link("frame", (origin, far)), (crank, coupler, rocker), joints, "pivot")


def strained(found: Reactions, name: str, per_length: float) -> tuple[np.ndarray, np.ndarray]:
    """Normal force (N) and bending moment (N m) in all sections of a bar at all angles, shape (sections, angles).

    A section carries what acts beyond it: the pin at the bar's end, and for every metre of the bar its weight and inertia,
    per_length (g - a). The acceleration changes linearly along the bar, so that Gauss's three points are exact.
    """
    length, poses = LENGTHS[name], found.poses
    axis = np.exp(1j * poses.angle(name).value)
    nodes, weights = np.polynomial.legendre.leggauss(3)
    end = sum(sign * (found.forces[joint][0] + 1j * found.forces[joint][1]) for joint, sign in ENDS[name]) / axis
    normal, moment = [], []
    for start in SHARES * length:
        force, turn = end, end.imag * (length - start)
        for node, weight in zip(nodes, weights, strict=True):
            place = start + (length - start) * (1 + node) / 2
            track = poses.point(name, (place, 0.0))
            pull = complex(*GRAVITY) - (track.slope[0] + 1j * track.slope[1]) * SPEED**2
            part = per_length * weight * (length - start) / 2 * pull / axis
            force, turn = force + part, turn + part.imag * (place - start)
        normal.append(force.real)
        moment.append(turn)
    return np.array(normal), np.array(moment)


def stress(normal: np.ndarray, moment: np.ndarray, side: float) -> float:
    """Greatest stress (Pa) in a square bar: |N|/b² + 6 |M|/b³."""
    return float((np.abs(normal) / side**2 + 6 * np.abs(moment) / side**3).max())


def thrust(normal: np.ndarray, side: float, length: float) -> float:
    """Greatest thrust over the one allowed by Euler's load of a square bar between pins, pi² E b⁴/(12 l²)."""
    return float(max(0.0, -normal.min())) * SAFETY * 12 * length**2 / (np.pi**2 * MODULUS * side**4)


def side_for(normal: np.ndarray, moment: np.ndarray, length: float) -> float:
    """Side (m) of the thinnest square section that bears the stress and does not buckle, by halving."""
    low, high = 1e-5, 1.0
    while high - low > 1e-12:
        side = 0.5 * (low + high)
        weak = stress(normal, moment, side) > ALLOWABLE or thrust(normal, side, length) > 1
        low, high = (side, high) if weak else (low, side)
    return high


def analysed(sides: Mapping[str, float]) -> Reactions:
    """All forces over a turn at constant speed against the load on the rocker."""
    poses = solve(machine(sides), 0.0, 2 * np.pi).poses(TURN)
    return reactions_at(poses, SPEED, gravity=GRAVITY, loads=[Torque("rocker", against(poses))])


def against(poses: Poses) -> np.ndarray:
    """The load (N m) on the rocker at all angles."""
    return -LOAD * np.sign(poses.angle("rocker").rate)


def dimensioned(sides: Mapping[str, float]) -> list[Round]:
    """Rounds from these sides on, until no mass changes by more than the tolerance."""
    rounds: list[Round] = []
    for _ in range(MOST):
        found = analysed(sides)
        new = {name: side_for(*strained(found, name, DENSITY * sides[name] ** 2), LENGTHS[name]) for name in LENGTHS}
        rounds.append(Round(new, {name: DENSITY * new[name] ** 2 * LENGTHS[name] for name in LENGTHS}, found))
        if max(abs(new[name] ** 2 - sides[name] ** 2) / new[name] ** 2 for name in LENGTHS) < TOLERANCE:
            return rounds
        sides = new
    raise SystemExit(f"after {MOST} rounds the masses still change: at this speed the bars cannot carry themselves")


def report(rounds: list[Round]) -> str:
    """A line for every round."""
    header = ["round", *(f"{name} (mm, kg)" for name in LENGTHS), "crank pin (N)", "rocker pivot (N)", "torque (N m)"]
    rows = []
    for k, (sides, masses, forces) in enumerate(rounds, 1):
        sizes = [f"{1000 * sides[name]:.4f}, {masses[name]:.5f}" for name in LENGTHS]
        pins = [f"{forces.resultant(joint).max():.3f}" for joint in ("crank_pin", "rocker_pivot")]
        rows.append([str(k), *sizes, *pins, f"{np.abs(forces.action).max():.4f}"])
    return "\n".join(columns(rows, header))


if __name__ == "__main__":
    rounds = dimensioned(dict.fromkeys(LENGTHS, 0.0))
    print("Side of the square section and mass of each bar, and the greatest forces that led to them:")
    print(report(rounds))
    last = rounds[-1]
    final = analysed(last.sides)
    for name, side in last.sides.items():
        normal, moment = strained(final, name, DENSITY * side**2)
        reached, pushed = stress(normal, moment, side) / ALLOWABLE, thrust(normal, side, LENGTHS[name])
        print(
            f"{name}: {1000 * side:.3f} mm, {100 * reached:.2f} % of the stress, {100 * pushed:.2f} % of the thrust allowed"
        )
    growth = final.resultant("crank_pin").max() / rounds[0].forces.resultant("crank_pin").max()
    print(f"Without inertia and weight the crank pin would have been designed for {100 / growth:.1f} % of its force.")
