"""Textbook machines: states, causality, rates in numbers and in symbols, each derived by Kirchhoff, Newton or Lagrange."""

import numpy as np
import pytest
import sympy
from numpy.testing import assert_allclose

from bondgraph import (
    RS,
    Builder,
    C,
    Dynamics,
    I,
    R,
    Se,
    Sf,
    causality,
    linearize,
    motion_equation,
    simulate,
    state_equations,
)


def agrees(graph, by_hand, names, derivative=()):
    """States, followers, and rates at several states by both routes; `by_hand(t, *state)` gives them in the same order."""
    result = causality(graph)
    assert not result.conflicts
    assert result.derivative == derivative
    dynamics = Dynamics(graph)
    assert dynamics.names == names
    formulas = state_equations(graph).numeric()
    for t, state in ((0.3, 1.0 + 0.3 * np.arange(len(names))), (1.1, np.cos(1.0 + np.arange(len(names))))):
        expected = by_hand(t, *state)
        assert_allclose(dynamics.rates(t, *state), expected, rtol=1e-12, atol=1e-12)
        assert_allclose(formulas(t, state), expected, rtol=1e-12, atol=1e-12)


def test_a_dc_motor_drives_its_load_by_a_compliant_shaft():
    """L i' = U - R i - k w, J w' = k i - b w - M, M/c the twist, N v' = M - d v."""
    b = Builder().one("coil", "electric").one("rotor", "rotation").one("load", "rotation").zero("shaft", "rotation")
    b.on("coil", Se("U", 24.0), R("Ra", 1.5), I("L", 0.02)).gyrate("coil", "rotor", 0.6, name="k")
    b.on("rotor", I("J", 0.3), R("b", 0.05)).bond("rotor", "shaft").bond("shaft", "load")
    graph = b.on("load", I("N", 2.0), R("d", 0.4)).on("shaft", C("c", stiffness=400.0)).build()

    def rates(t, flux, rotor, load, twist):
        i, w, v, moment = flux / 0.02, rotor / 0.3, load / 2.0, 400.0 * twist
        return [24.0 - 1.5 * i - 0.6 * w, 0.6 * i - 0.05 * w - moment, moment - 0.4 * v, w - v]

    agrees(graph, rates, ("p_L", "p_J", "p_N", "q_c"))
    gain = linearize(graph, at={}, outputs=["f_load"]).transfer("U", "f_load")
    assert_allclose(np.polyval(gain[0], 0) / np.polyval(gain[1], 0), 0.6 / (1.5 * 0.45 + 0.36), rtol=1e-9)


def test_a_series_motor_has_the_torque_of_its_current_squared():
    """L i' = U - R i - k i w, J w' = k i^2 - b w^2: the gyrator's modulus reads the current, and power goes through."""
    b = Builder().one("arm", "electric").one("rot", "rotation").on("arm", Se("U", 100.0), R("Ra", 2.0), I("L", 0.1))
    b.gyrate("arm", "rot", lambda f_arm: 0.05 * f_arm, name="k").on(
        "rot", I("J", 0.4), R("fan", lambda f: 0.01 * f * abs(f))
    )

    def rates(t, flux, momentum):
        i, w = flux / 0.1, momentum / 0.4
        return [100.0 - 2.0 * i - 0.05 * i * w, 0.05 * i**2 - 0.01 * w * abs(w)]

    agrees(b.build(), rates, ("p_L", "p_J"))
    assert simulate(b.build(), 1.0).audit.energy < 1e-9


def test_a_quarter_car_on_a_road():
    """m1 z1'' = kt (r - z1) - k (z1 - z2) - c (z1' - z2'), m2 z2'' = k (z1 - z2) + c (z1' - z2')."""
    b = Builder().one("road", "translation").one("wheel", "translation").one("body", "translation")
    b.on("road", Sf("v", lambda t: 0.3 * np.cos(5.0 * t))).on("wheel", I("m1", 40.0)).on("body", I("m2", 300.0))
    b.between("road", "wheel", C("kt", stiffness=2e5)).between("wheel", "body", C("k", stiffness=2e4), R("c", 1500.0))

    def rates(t, p1, p2, tyre, spring):
        v1, v2 = p1 / 40.0, p2 / 300.0
        strut = 2e4 * spring + 1500.0 * (v1 - v2)
        return [2e5 * tyre - strut, strut, 0.3 * np.cos(5.0 * t) - v1, v1 - v2]

    agrees(b.build(), rates, ("p_m1", "p_m2", "q_kt", "q_k"))


def test_a_hydraulic_servo():
    """A valve's flow K x sqrt(ps - p) fills the cylinder; m v' = A p - d v, V/E p' = q - A v."""
    b = Builder().signal("x").one("supply", "hydraulic").zero("chamber", "hydraulic").one("piston", "translation")
    valve = R("valve", lambda e, x: 2e-4 * x * np.sqrt(np.abs(e)) * np.sign(e))
    b.on("supply", Se("ps", 1e6), valve).bond("supply", "chamber").on("chamber", C("oil", 1e-9))
    b.transform("piston", "chamber", -0.01, name="A").on("piston", I("m", 5.0), R("d", 100.0))
    graph = b.build()
    dynamics, x, pressure, speed = Dynamics(graph, {"x": 0.5}), 0.5, 4e5, 0.7
    assert dynamics.names == ("q_oil", "p_m")
    expected = [2e-4 * x * np.sqrt(1e6 - pressure) - 0.01 * speed, 0.01 * pressure - 100.0 * speed]
    assert_allclose(dynamics.rates(0.0, pressure * 1e-9, 5.0 * speed), expected, rtol=1e-12)
    assert_allclose(state_equations(graph).numeric({"x": 0.5})(0.0, [pressure * 1e-9, 5.0 * speed]), expected, rtol=1e-12)
    assert simulate(graph, 0.05, signals={"x": 0.5}).audit.energy < 1e-9


def test_a_gear_train_is_one_inertia():
    """(J1 + n1^2 J2 + (n1 n2)^2 J3) w' = M - n1 n2 load."""
    b = (
        Builder()
        .one("first", "rotation")
        .one("second", "rotation")
        .one("third", "rotation")
        .on("first", I("J1", 1.0), Se("M", 3.0))
    )
    b.transform("first", "second", -0.5, name="n1").transform("second", "third", -0.2, name="n2")
    b.on("second", I("J2", 4.0)).on("third", I("J3", 50.0), Se("load", -8.0))
    whole = 1.0 + 0.25 * 4.0 + 0.01 * 50.0
    agrees(b.build(), lambda t, p: [(3.0 - 0.1 * 8.0) / whole], ("p_J1",), ("J2", "J3"))
    J1, J2, J3, n1, n2 = sympy.symbols("J1 J2 J3 n1 n2")
    inertia = motion_equation(b.build()).inertia
    assert sympy.expand(inertia - (J1 + n1**2 * J2 + n1**2 * n2**2 * J3)) == 0


def test_a_loudspeaker():
    """L i' = u - R i - Bl v, m v' = Bl i - k x - d v - S p, with p = z S v of the air that it radiates into."""
    b = Builder().one("coil", "electric").one("cone", "translation").one("air", "hydraulic")
    b.on("coil", Se("u", lambda t: 2.0 * np.sin(100.0 * t)), R("Re", 6.0), I("L", 5e-4)).gyrate(
        "coil", "cone", 7.0, name="Bl"
    )
    b.on("cone", I("m", 0.02), C("k", stiffness=1500.0), R("d", 1.2)).transform("cone", "air", 0.02, name="S").on(
        "air", R("z", 1000.0)
    )

    def rates(t, flux, p, x):
        i, v = flux / 5e-4, p / 0.02
        return [2.0 * np.sin(100.0 * t) - 6.0 * i - 7.0 * v, 7.0 * i - 1500.0 * x - 1.2 * v - 0.02**2 * 1000.0 * v, v]

    agrees(b.build(), rates, ("p_L", "p_m", "q_k"))


def test_eulers_body_keeps_its_energy_and_its_angular_momentum():
    """p' = p x w, p = J w: three gyrators of the third momentum in a ring."""
    b = Builder().one("x", "rotation").one("y", "rotation").one("z", "rotation")
    b.on("x", I("Jx", 1.0)).on("y", I("Jy", 2.0)).on("z", I("Jz", 3.0))
    b.gyrate("x", "y", lambda p_Jz: p_Jz, name="gz").gyrate("y", "z", lambda p_Jx: p_Jx, name="gx")
    graph = b.gyrate("z", "x", lambda p_Jy: p_Jy, name="gy").build()
    inertia = np.array([1.0, 2.0, 3.0])

    def rates(t, *momentum):
        return np.cross(np.array(momentum), np.array(momentum) / inertia)

    agrees(graph, rates, ("p_Jx", "p_Jy", "p_Jz"))
    run = simulate(graph, 20.0, initial={"p_Jx": 0.01, "p_Jy": 2.0, "p_Jz": 0.02}, rtol=1e-10)
    assert_allclose((run.ends**2).sum(axis=1), 0.01**2 + 4.0 + 0.02**2, rtol=1e-9)
    assert run.audit.energy < 1e-9


def test_a_crank_between_springs_on_both_sides():
    """T = (J + m s'^2) w^2/2, V = k1 phi^2/2 + k2 s^2/2 with s = r sin phi: Lagrange's equation."""
    phi, w, k1, k2, J, m, r = sympy.symbols("phi w k1 k2 J m r")
    s = r * sympy.sin(phi)
    inertia = J + m * s.diff(phi) ** 2
    momentum_rate = (-inertia.diff(phi) * w**2 / 2 - (k1 * phi**2 / 2 + k2 * s**2 / 2).diff(phi)) / inertia
    numbers = {k1: 3.0, k2: 80.0, J: 0.2, m: 1.5, r: 0.4}
    acceleration = sympy.lambdify((phi, w), momentum_rate.subs(numbers))
    b = Builder().one("crank", "rotation", displacement="phi").one("slide", "translation")
    b.on("crank", I("J", 0.2), C("c1", stiffness=3.0)).on("slide", I("m", 1.5), C("c2", stiffness=80.0))
    graph = b.transform("crank", "slide", lambda phi: 0.4 * np.cos(phi), name="T").build()
    agrees(
        graph,
        lambda t, p, q1, q2, phi: [0.2 * lagrange(p, q1, q2, phi), p / 0.2, 0.4 * np.cos(phi) * p / 0.2, p / 0.2],
        ("p_J", "q_c1", "q_c2", "phi"),
        ("m",),
    )
    dynamics = Dynamics(graph)
    assert_allclose(dynamics.rates(0.0, 0.2 * 1.3, 0.7, 0.4 * np.sin(0.7), 0.7)[0] / 0.2, acceleration(0.7, 1.3), rtol=1e-12)
    run = simulate(graph, 5.0, initial={"crank": 2.0})
    assert_allclose(run.states()["q_c2"], 0.4 * np.sin(run.states()["phi"]), atol=1e-8)
    assert run.audit.energy < 1e-9


def lagrange(p, q1, q2, phi):
    """The acceleration of the crank, its springs' displacements as states of their own."""
    slope, w = 0.4 * np.cos(phi), p / 0.2
    bend = -0.4 * np.sin(phi)
    return (-3.0 * q1 - slope * 80.0 * q2 - 1.5 * slope * bend * w**2) / (0.2 + 1.5 * slope**2)


@pytest.mark.parametrize("last", [4.0, 6.0])
def test_a_wheatstone_bridge_by_kirchhoff(last):
    """Nodal voltages with a coil across: balanced at R1 R4 = R2 R3, when its current only decays."""
    b = Builder().zero("top", "electric").zero("left", "electric").zero("right", "electric").one("feed", "electric")
    b.on("feed", Se("u", 10.0), R("ri", 0.5)).bond("feed", "top").on("left", R("R2", 2.0)).on("right", R("R4", last))
    for side, ohm in (("left", 1.0), ("right", 2.0)):
        b.one(f"top.{side}").bond("top", f"top.{side}").bond(f"top.{side}", side).on(f"top.{side}", R(f"R_{side}", ohm))
    b.one("coil", "electric").bond("left", "coil").bond("coil", "right").on("coil", I("L", 0.1), R("rc", 0.3))

    def rates(t, flux):
        i = flux / 0.1
        nodes = [[1 / 0.5 + 1 / 1.0 + 1 / 2.0, -1.0, -0.5], [-1.0, 1.0 + 0.5, 0.0], [-0.5, 0.0, 0.5 + 1 / last]]
        _, left, right = np.linalg.solve(nodes, [10.0 / 0.5, -i, i])
        return [left - right - 0.3 * i]

    agrees(b.build(), rates, ("p_L",))
    assert (abs(rates(0.0, 0.0)[0]) < 1e-12) == (last == 4.0)


def test_a_brake_heats_its_drum_by_entropy():
    """T = 300 exp(S/C): J w' = -b w, C T' = b w^2, and what the wheel loses the drum has."""
    b = (
        Builder()
        .one("wheel", "rotation")
        .zero("drum", "thermal")
        .on("wheel", I("J", 2.0), RS("rub", 0.5))
        .bond("rub", "drum")
    )
    graph = b.on("drum", C("Cd", lambda q: 300.0 * np.exp(q / 40.0))).build()
    run = simulate(graph, 30.0, initial={"wheel": 50.0}, rtol=1e-10)
    speed = 50.0 * np.exp(-30.0 * 0.5 / 2.0)
    assert_allclose(run.flow("wheel", 30.0), speed, rtol=1e-8)
    assert_allclose(run.effort(graph.bond_of("Cd").number, 30.0), 300.0 + (2500.0 - speed**2) / 40.0, rtol=1e-9)
    assert run.audit.energy < 1e-9
