"""The power audit: silent on what is right, and not on what is wrong by little."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bondgraph import Builder, C, GraphError, I, R, Se, Sf, simulate
from bondgraph.motion import dynamics as walking


def driven_press():
    """A motor without inductance on a crank, through a shaft that twists, and a ram behind a modulated transformer."""
    b = Builder().one("coil", "electric").one("rotor", "rotation").one("crank", "rotation", displacement="theta")
    b.one("ram", "translation").on("coil", Se("V", 12.0), R("Ra", 0.5)).gyrate("coil", "rotor", 0.4)
    b.on("rotor", I("J", 0.02), R("b", 0.01)).between("rotor", "crank", C("k", stiffness=80.0), R("c", 0.2))
    b.transform("crank", "ram", lambda theta: 0.1 * np.sin(theta)).on("crank", I("Jc", 0.05))
    return b.on("ram", I("m", 3.0), Se("F", -20.0), R("friction", lambda f: f * np.abs(f))).build()


def test_power_and_energy_add_up():
    run = simulate(driven_press(), 0.3, rtol=1e-9, tolerance=1e-8)
    assert run.audit.power < 1e-13
    assert run.audit.energy < 1e-10
    audit = run.audit
    assert_allclose(audit.stored - audit.stored[0] + audit.dissipated, audit.supplied, atol=1e-9 * audit.supplied.max())
    assert np.all(np.diff(audit.dissipated) >= 0.0)


def test_energies_of_a_charged_capacitor():
    run = simulate(Builder().one("a").on("a", Se("E", 10.0), R("r", 2.0), C("c", 0.1)).build(), 1.0, rtol=1e-10)
    charge = 1.0 - np.exp(-5.0)
    assert_allclose(run.audit.stored[-1], 0.5 * charge**2 / 0.1, rtol=1e-9)
    assert_allclose(run.audit.supplied[-1], 10.0 * charge, rtol=1e-9)
    assert_allclose(run.audit.dissipated[-1], 2.0 * 25.0 * (1 - np.exp(-10.0)) / 10.0, rtol=1e-9)


def sabotaged(monkeypatch, name, wrong):
    right = getattr(walking.Walk, name)
    monkeypatch.setattr(walking.Walk, name, lambda self, *args: wrong(right(self, *args)))


def test_accelerations_off_by_a_millionth_are_found(monkeypatch):
    sabotaged(monkeypatch, "_accelerations", lambda found: ([a * (1 + 1e-6) for a in found[0]], found[1]))
    with pytest.raises(GraphError, match=r"power audit: .* of the greatest power, 1e-08 allowed"):
        simulate(driven_press(), 0.3, rtol=1e-9, tolerance=1e-8)


def test_a_modulus_that_differs_for_efforts_is_found(monkeypatch):
    right = walking.Walk.mass_and_force

    def wrong(self):
        gains, ram = self.gain, self.form.variable("ram")
        self.gain = [{k: (1 + 1e-6) * g for k, g in own.items()} if v == ram else own for v, own in enumerate(gains)]
        found = right(self)
        self.gain = gains
        return found

    monkeypatch.setattr(walking.Walk, "mass_and_force", wrong)
    run = simulate(driven_press(), 0.3, rtol=1e-9)
    assert 1e-9 < run.audit.power < 1e-5
    assert run.audit.power_at in ("crank->ram", "crank", "ram")


def test_a_gain_that_differs_from_the_flows_is_found(monkeypatch):
    sabotaged(monkeypatch, "_bias", lambda bias: [0.999 * rate for rate in bias])
    assert simulate(driven_press(), 0.3, rtol=1e-9).audit.power < 1e-13  # an inertia's effort is its own flow's rate...
    assert simulate(driven_press(), 0.3, rtol=1e-9).audit.energy > 1e-8  # ...but that is no longer the flow's


def test_a_resistor_that_differs_in_the_run_is_found(monkeypatch):
    run = simulate(driven_press(), 0.3, rtol=1e-9)
    right = walking.Walk._resistor
    monkeypatch.setattr(walking.Walk, "_resistor", lambda self, port: tuple(1.001 * v for v in right(self, port)))
    assert run.audit.energy > 1e-6


def test_springs_with_laws_of_their_own_are_in_the_energy():
    b = Builder().one("m", displacement="x").on("m", I("M", 1.0), C("k", lambda q: q + q**3))
    run = simulate(b.build(), 3.0, initial={"k": 1.0}, rtol=1e-9)
    assert run.audit.energy < 1e-9
    assert run.audit.power < 1e-13


@pytest.mark.parametrize("bits", [0.0, 1.0])
def test_where_nothing_is_exchanged_nothing_is_amiss(bits):
    b = Builder().one("a").zero("z").one("b").on("a", I("J", 1.0)).on("b", I("K", 1.0)).transform("a", "b", 3.0)
    b.bond("a", "z").on("z", R("r", 1.0)).bond("b", "z")
    run = simulate(b.on("b", Sf("w", bits)).build(), 1.0)
    assert run.audit.power < 1e-13


def test_a_graph_without_a_state_is_audited_too():
    run = simulate(Builder().one("a").on("a", Se("E", 6.0), R("r", 3.0)).build(), 2.0)
    assert_allclose(run.audit.dissipated[-1], 24.0, rtol=1e-12)
    assert_allclose(run.audit.supplied[-1], 24.0, rtol=1e-12)
