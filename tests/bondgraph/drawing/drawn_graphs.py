"""The graphs that the drawing is tested on: the sources' own and what harder machines add."""

import numpy as np

from bondgraph import Builder, C, I, R, Se, Sf


def condensed():
    b = Builder().one("crank", "rotation", displacement="theta").one("slider", "translation")
    b.on("crank", Se("M", 3.0), I("J", 2.0)).transform("crank", "slider", lambda theta: -0.5 * np.sin(theta), name="T")
    return b.on("slider", I("m", 4.0), R("B", 1.0), Se("F", 2.0)).build()


def generic():
    b = Builder().one("a", "rotation", displacement="theta").one("b", "translation")
    b.on("a", Se("M_A", 3.0), I("J_A", 2.0), R("R_A", 1.0), C("C_A", 1.0))
    b.transform("a", "b", lambda theta: -0.5 * np.sin(theta), name="T")
    return b.on("b", I("m_B", 4.0), R("R_B", 1.0), C("C_B", 1.0), Se("F_B", 2.0)).build()


def motor():
    b = Builder().one("armature", "electric").one("rotor", "rotation").one("crank", "rotation", displacement="theta")
    b.on("armature", Se("u", 24.0), I("L", 0.01), R("Ra", 1.0)).gyrate("armature", "rotor", 0.05, name="k")
    b.on("rotor", I("Jm", 1e-3), R("b", 1e-3)).between("rotor", "crank", C("shaft", 1e-3), R("damping", 0.1))
    b.on("crank", I("J", 2.0)).one("slider", "translation")
    b.transform("crank", "slider", lambda theta: -0.5 * np.sin(theta), name="T")
    return b.on("slider", I("m", 4.0), R("B", 1.0), Se("F", 2.0)).build()


def rosenberg():
    """Two planar bodies pinned together, in the manner of Rosenberg: 36 bonds in two big loops."""
    b = Builder().one("omega1", "rotation", displacement="theta").one("omega2", "rotation", displacement="phi")
    for k in "12":
        b.on(f"omega{k}", I(f"J{k}", 1.0))
        for axis in "xy":
            b.one(f"v{axis}{k}", "translation").on(f"v{axis}{k}", I(f"m_{k}{axis}", 1.0))
    for axis in "xy":
        body(b, axis)
    b.on("omega1", Se("M", 1.0)).on("cy", Sf("guide", 0.0)).one("slider", "translation").bond("cx", "slider")
    return b.on("slider", I("ms", 1.0), R("B", 1.0), Se("F", 1.0)).build()


def body(b, axis):
    for zero in "pgc":
        b.zero(f"{zero}{axis}", "translation")
    b.transform("omega1", f"v{axis}1", lambda theta: np.sin(theta), name=f"T1{axis}").bond(f"v{axis}1", f"p{axis}")
    b.transform("omega1", f"p{axis}", lambda theta: np.sin(theta), name=f"T2{axis}").bond(f"p{axis}", f"g{axis}")
    b.transform("omega2", f"g{axis}", lambda phi: np.sin(phi), name=f"T3{axis}").bond(f"g{axis}", f"v{axis}2")
    b.transform("omega2", f"c{axis}", lambda phi: np.sin(phi), name=f"T4{axis}").bond(f"v{axis}2", f"c{axis}")


def hub(spokes=6):
    """A shaft that many rods hang on, with names as scenes give them."""
    b = Builder().one("crank", "rotation").on("crank", I("inertia[0]", 1.0), Se("drive.torque", 1.0))
    for k in range(spokes):
        b.transform("crank", f"cylinder{k}.rod.com.x", 2.0).one(f"cylinder{k}.rod.com.x", "translation")
        b.on(f"cylinder{k}.rod.com.x", I(f"cylinder{k}.mass[0]", 1.0))
    return b.build()


GRAPHS = {graph.__name__: graph for graph in (condensed, generic, motor, rosenberg, hub)}
