"""Torque motor of an electrohydraulic valve: a word bond graph, the bond graph that it stands for, its modes and motion.

    python torque_motor.py [figure.png]

An amplifier drives the coils of a torque motor. Its armature moves a flapper between two nozzles; the difference of the
nozzles' pressures moves the spool, and a spring from spool to armature brings the flapper back to its middle. Prints the
words, the bonds of the expanded graph, its modes, and the spool's place beside that of the static equations solved by hand.
With a file name, draws the words into it and the bond graph into one beside it (figure_graph.png).
"""

from __future__ import annotations

import sys
from math import pi
from pathlib import Path

import numpy as np

from bondgraph import Builder, C, I, Part, R, Se, Sf, WordGraph, draw, linearize, simulate

VOLTAGE, RESISTANCE, INDUCTANCE = 4.0, 200.0, 0.1  # V, ohm, H
TORQUE, ARMATURE, FLEXURE, DAMPING = 2.0, 5e-7, 10.0, 9e-4  # N m/A; kg m², N m/rad without the magnets, N m s/rad
FLAPPER, NOZZLE = 0.009, 1.5e-7  # m from pivot to nozzles, m² of a nozzle
FLOW, LEAK, OIL = 0.1, 5e10, 3e-16  # m²/s of flow a metre of the flapper, Pa s/m³, m³/Pa
SPOOL, AREA, DRAG, FORCES = 0.02, 5e-5, 10.0, 1e4  # kg, m², N s/m, N/m of the flow forces
BALL, FEEDBACK = 0.025, 2700.0  # m from pivot to the spring's ball, N/m
SLOWEST = 0.1  # rad/s


def amplifier() -> Part:
    """Returns the source of the voltage with the coils' resistance."""
    return Builder().one("out", "electric").on("out", Se("u", VOLTAGE), R("coils", RESISTANCE)).part("out")


def torque_motor() -> Part:
    """Returns coils and magnets: current to torque, and the coils' inductance."""
    b = Builder().one("coils", "electric").on("coils", I("L", INDUCTANCE)).one("shaft", "rotation")
    return b.gyrate("coils", "shaft", TORQUE, name="k").part(electric="coils", torque="shaft")


def armature() -> Part:
    """Returns armature and flexure tube, whose stiffness counts less that of the magnets, with flapper and ball."""
    b = Builder().one("turning", "rotation", displacement="theta")
    b.on("turning", I("J", ARMATURE), C("flexure", 1.0 / FLEXURE), R("damping", DAMPING))
    b.one("flapper", "translation").transform("turning", "flapper", FLAPPER)
    b.one("ball", "translation").transform("turning", "ball", BALL)
    return b.part("flapper", "ball", torque="turning")


def nozzles() -> Part:
    """Returns the first stage: the flapper's place sets the flow into the chambers, whose pressure acts on it too."""
    b = Builder().one("flapper", "translation", displacement="x").zero("chamber", "hydraulic")
    b.on("chamber", Sf("nozzles", lambda x: FLOW * x), R("leak", LEAK), C("oil", OIL))
    return b.transform("flapper", "chamber", NOZZLE).part("flapper", load="chamber")


def spool() -> Part:
    """Returns the spool between the chambers, and where the feedback spring holds it."""
    b = Builder().zero("ends", "hydraulic").one("moving", "translation", displacement="x")
    b.transform("moving", "ends", AREA)
    b.on("moving", I("m", SPOOL), R("drag", DRAG), C("forces", 1.0 / FORCES))
    return b.part(pressure="ends", feedback="moving")


def feedback() -> Part:
    """Returns the spring between ball and spool."""
    return (
        Builder().zero("spring", "translation").on("spring", C("k", 1.0 / FEEDBACK)).one("ball", "translation")
        .one("spool", "translation").bond("ball", "spring").bond("spring", "spool").part("ball", "spool")
    )  # fmt: skip


def valve() -> WordGraph:
    """Returns the valve in words."""
    words = {
        "amplifier": amplifier(),
        "torque motor": torque_motor(),
        "armature": armature(),
        "nozzles": nozzles(),
        "spool": spool(),
        "feedback spring": feedback(),
    }
    bonds = [
        ("amplifier.out", "torque motor.electric"),
        ("torque motor.torque", "armature.torque"),
        ("armature.flapper", "nozzles.flapper"),
        ("nozzles.load", "spool.pressure"),
        ("armature.ball", "feedback spring.ball"),
        ("feedback spring.spool", "spool.feedback"),
    ]
    return WordGraph(words, bonds)


def at_rest() -> float:
    """Returns the spool's place (m) at rest, by the static equations of armature, chambers and spool."""
    # unknown: the armature's angle, the pressure, the spool's place
    matrix = [
        [FLEXURE + FEEDBACK * BALL**2, FLAPPER * NOZZLE, -FEEDBACK * BALL],
        [FLOW * FLAPPER, -1.0 / LEAK, 0.0],
        [FEEDBACK * BALL, -AREA, -(FORCES + FEEDBACK)],
    ]
    return float(np.linalg.solve(matrix, [TORQUE * VOLTAGE / RESISTANCE, 0.0, 0.0])[2])


def main(path: str | None = None) -> None:
    """Print words, graph, modes and motion; draw words and graph if the name of a picture is given."""
    system = valve()
    graph = system.expand()
    print(system, graph, "modes:", sep="\n\n")
    modes = [mode for mode in linearize(graph, at={}).modes if mode.frequency > SLOWEST]  # the rest: lengths that are kept
    for line in dict.fromkeys(f"  {mode.frequency / (2.0 * pi):9.2f} Hz, damping {mode.damping:.3f}" for mode in modes):
        print(line)
    found = float(simulate(graph, 0.1, rtol=1e-8, method="Radau").displacement("spool.x")[-1])
    print(f"spool after 0.1 s: {1e3 * found:.6f} mm; at rest by hand: {1e3 * at_rest():.6f} mm")
    if path is not None:
        draw(system, path, title="Torque motor of an electrohydraulic valve")
        beside = Path(path).with_stem(f"{Path(path).stem}_graph")
        draw(graph, beside, title="The same, expanded")
        print(f"drawn: {path} and {beside.name}")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else None)
