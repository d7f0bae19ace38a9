"""The level `confirm`: the motion by collocation on cells of its own, against 30-digit references, with an honest error."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import flywheel
from flywheel.machine.machine import Machine
from flywheel.regime import wittenbauer
from flywheel.sizing.confirmation import by_collocation, on_thirds
from flywheel.sizing.results import Regime
from tests import regimes, scenes
from tests.limits import sample
from tests.references.test_references import FOLDER, REFERENCES, error

MACHINES = [name for name, true in REFERENCES.items() if true.get("simulation") and "balance" in true]
FIGURES = ("irregularity", "irregularity_approximate", "speed_max", "speed_min", "speed_time_mean", "period")


def confirm(scene, **options):
    return flywheel.size(flywheel.load(scene), accuracy="confirm", **options)


@pytest.mark.parametrize("name", sample(MACHINES, 7))
def test_the_motion_is_that_of_the_references_within_its_estimate(name):
    true, sizing = REFERENCES[name]["simulation"], confirm(FOLDER / "scenes" / f"{name}.toml")
    found, allowed = sizing.simulation, sizing.error.simulation
    assert found.route == "collocation"
    assert 0.0 < allowed <= sizing.rtol
    for key in FIGURES:
        if key in true and true[key] is not None:
            assert error(getattr(found, key), true[key]) <= allowed + 4e-16, key
    assert abs(found.closure) < 1e-12


@pytest.mark.parametrize("rtol", [1e-3, 1e-12])
@pytest.mark.parametrize("name", sample(["press", "drag-link", "rotor-wide-eps"], 2))
def test_the_estimate_bounds_the_true_error_at_other_accuracies(name, rtol):
    true, sizing = REFERENCES[name]["simulation"], confirm(FOLDER / "scenes" / f"{name}.toml", rtol=rtol)
    assert error(sizing.simulation.irregularity, true["irregularity"]) <= sizing.error.simulation + 4e-16
    assert sizing.error.simulation <= max(rtol, 5e-11)


@pytest.mark.parametrize("name", sample(["section-c", "pump", "kloss-press", "geared-loss", "dc-inductance", "governor"], 6))
def test_torques_that_depend_on_speed_are_solved_for_again(name):
    case = regimes.CASES[name]
    eps = case.irregularities[0]
    sizing = confirm(regimes.scene(name, irregularity=eps))
    assert sizing.simulation.route == "collocation"
    assert abs(sizing.simulation.irregularity / eps - 1) <= sizing.error.simulation <= 1e-9
    given = case.inertias[-1]
    true = regimes.figures(name)["analysis"][str(given)]
    found = confirm(regimes.scene(name, inertia=given))
    assert error(found.simulation.irregularity, true["irregularity"]) <= found.error.simulation <= 1e-9
    assert error(found.simulation.period, true["period"]) <= found.error.simulation
    audit = flywheel.size(found.scene).simulation
    assert found.simulation.period == pytest.approx(audit.period, rel=1e-9)


def halved_cells(edges):
    """All cells, to nine decimals, that halving up to five times may lead to."""
    found = set()
    for _ in range(6):
        found |= set(pairwise(np.round(edges, 9).tolist()))
        edges = np.sort(np.concatenate((edges, 0.5 * (edges[1:] + edges[:-1]))))
    return found


def test_no_cell_is_one_of_the_figures_however_often_either_are_halved():
    for make in scenes.ALL.values():
        machine = Machine(flywheel.load(make()))
        own = on_thirds(machine).mesh
        assert not halved_cells(machine.mesh) & halved_cells(own)
        assert (np.diff(own) > 0.0).all()
        assert np.isin(machine.landmarks, own).all()


def test_a_flywheel_that_the_closed_form_got_wrong_is_found_out():
    machine = Machine(flywheel.load(scenes.press()))
    figures, run = wittenbauer.resolved_figures(machine, 1e-9)
    wrong = run._replace(inertia=1.01 * run.inertia)
    found = by_collocation(Regime(machine, 1e-9, figures, run, wrong, figures.cycle, figures.speed), None)
    assert 0.005 < found.error < 0.02
    assert found.motion.irregularity < 0.0499


def test_what_takes_too_long_is_told_by_quadrature(monkeypatch):
    monkeypatch.setattr("flywheel.sizing.confirmation._MOST_WORK", 100)
    sizing = confirm(scenes.press())
    assert sizing.simulation.route == "quadrature"
    assert any("takes too long to find" in message for message in sizing.messages)
    assert "confirmation" in sizing.left_out[0]


def test_what_a_cycle_leaves_over_shows_in_the_closure():
    """Work that closes only as far as `accuracy.closure` allows: the speed drifts by as much over the cycle."""
    open_ = scenes.rotor(drive={"torque": "49.99 N m"}, accuracy={"closure": 0.01}, flywheel={"inertia": 20})
    sizing = confirm(open_)
    cycle, found = sizing.cycle, sizing.simulation
    start = float(sizing.speed**2 * 20 / 2)
    assert found.route == "collocation"
    assert cycle.net == pytest.approx(-0.01 * 2 * np.pi, rel=1e-9)
    assert found.closure == pytest.approx(cycle.net / (2 * start), rel=0.02)
    assert found.irregularity == pytest.approx(flywheel.size(sizing.scene).simulation.irregularity, rel=1e-9)


def test_a_machine_without_inertia_has_nothing_to_solve_for():
    still = {"drive": {"torque": "balance"}, "regime": {"speed": 1}, "flywheel": {"irregularity": 0.1}}
    sizing = confirm(still)
    assert sizing.simulation is None
    assert any("no inertia" in message for message in sizing.messages)
