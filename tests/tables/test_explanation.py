"""The explanation of a sizing, statement by statement, against the scene and the run."""

from __future__ import annotations

from pathlib import Path

import pytest

import flywheel
from flywheel.tables.explanation import explanation
from tests import regimes, scenes
from tests.references.test_references import FOLDER

EXAMPLES = Path(flywheel.__file__).parents[1] / "examples"


def explain(scene, accuracy="normal", rtol=None):
    return flywheel.explain(flywheel.load(scene), rtol, accuracy=accuracy)


def said(explanation, part):
    return any(part in row for row in (*explanation.not_modelled, *explanation.forced, *explanation.because))


def test_loads_of_position_are_named_with_the_closed_form():
    found = explain(scenes.press(spring=[{"on": "press.slider", "stiffness": 100, "rest": "0.3 m"}]))
    assert "Wittenbauer's closed form" in found.formulation
    assert "6 cells of 21 nodes" in found.formulation
    assert found.because == ("on position alone: load[0].force, drive.torque (balance), spring[0], gravity",)
    assert not said(found, "springs")
    assert said(found, "dampers")
    assert said(found, "2 breakpoints inside the cycle, from load[0].force 2")
    assert said(found, "6 cells at first, which sufficed")


def test_a_damper_and_a_law_of_speed_ask_for_collocation():
    found = explain(regimes.scene("pump", irregularity=0.05))
    assert "periodic collocation" in found.formulation
    assert f"{found.sizing.cyclic.steps} Newton steps" in found.formulation
    assert found.because[0] == "on speed: load[1].torque, damper[0]"
    assert found.because[1] == "on position alone: load[0].force, drive.torque (balance)"
    assert not said(found, "Newton's method for the motion")


def test_losses_and_currents_are_named_by_their_paths():
    assert "shafts.motor.efficiency" in explain(regimes.scene("geared-loss", inertia=0.05)).because[1]
    found = explain(regimes.scene("dc-inductance", inertia=0.1))
    assert found.because[-1] == "on a current of its own: drive.motor.inductance"
    assert not said(found, "current as a state of its own")
    plain = dict(regimes.DC["drive"]["motor"])
    del plain["inductance"]
    quick = regimes.scene("dc-inductance", inertia=0.1) | {"drive": {"on": "motor", "motor": plain}}
    assert said(explain(quick), "what delays the motor's torque, such as its current: it follows the speed at once")


@pytest.mark.slow
def test_laws_that_switch_at_a_speed_are_named():
    assert said(explain(regimes.scene("governor", inertia=0.5)), "switch at a speed, where the motion itself cuts")


def test_bodies_without_mass_are_named_and_are_not_in_the_graph():
    found = explain(scenes.yoke())
    assert said(found, "bodies without mass or inertia: scotch-yoke.crank, scotch-yoke.block")
    heavy = explain(
        scenes.yoke(
            mechanism={
                "type": "scotch-yoke",
                "crank": {"length": 0.5, "inertia": 1},
                "yoke": {"mass": 20},
                "block": {"mass": 1},
            }
        )
    )
    assert not said(heavy, "bodies without")
    parts = {element.part for element in found.sizing.machine.graph.elements.values() if element.kind == "I"}
    assert parts == {"scotch-yoke.yoke"}


def test_a_constant_inertia_makes_the_areas_exact_and_that_is_said():
    found = explain(scenes.rotor(inertia=[{"on": "crank", "value": 2}]))
    assert said(found, "a varying inertia: I* is 2 kg m²")
    assert said(found, "with a constant I* there is none")
    wheel = found.sizing.flywheel
    assert wheel.exact == pytest.approx(wheel.approximate, rel=1e-12)
    assert not said(explain(scenes.press()), "a varying inertia")
    assert said(explain(scenes.rotor()), "it has none")


def test_halved_cells_are_told_with_the_narrowest():
    found = explain(FOLDER / "scenes" / "shaper-near-change.toml", rtol=1e-12)
    edges = found.sizing.cycle.mesh.edges
    first = found.sizing.machine.mesh.size
    assert edges.size > first
    assert said(found, f"{first - 1} cells at first, {edges.size - first} more")
    assert said(found, "the narrowest cell goes from")


def test_breakpoints_are_told_by_where_they_come_from():
    assert said(explain(scenes.shaper()), "2 breakpoints inside the cycle, from load[0].force 2")  # its ram turns back
    found = explain(FOLDER / "scenes" / "near-lock-offset.toml")
    machine = found.sizing.machine
    inside = machine.breakpoints.size - 2
    assert machine.broken_by["slider-crank"] == 7  # where the rod nearly stands across
    assert all(0 < count <= inside for count in machine.broken_by.values())
    assert sum(machine.broken_by.values()) >= inside
    assert said(found, f"{inside} breakpoints inside the cycle, from slider-crank 7, load[0].force")


@pytest.mark.parametrize(
    ("level", "part"),
    [("normal", "not found a second time"), ("confirm", "other cells"), ("audit", "stepped in time")],
)
def test_each_level_tells_its_own_motion(level, part):
    found = explain(scenes.yoke(), level, 1e-4)
    assert part in found.motion
    assert said(found, "time stepping") == (level != "audit")
    simulation = found.sizing.cost.stages["simulation"].evaluations
    assert (f"with {simulation} evaluations" in found.motion) == (level in ("confirm", "audit"))


@pytest.mark.parametrize("level", ["confirm", "audit"])
def test_both_cycles_of_a_sizing_are_told(level):
    both = "one cycle with the exact flywheel and one with the approximate one, with"
    assert both in explain(scenes.yoke(), level, 1e-4).motion
    wheel = {"inertia": 400}
    assert "one cycle, with" in explain(scenes.yoke(flywheel=wheel), level, 1e-4).motion


def test_the_motion_of_an_analysis_is_the_one_that_gave_its_figures():
    assert "closed form" in explain(scenes.yoke(flywheel={"inertia": 400})).motion
    found = explain(regimes.scene("pump", inertia=5))
    assert found.sizing.simulation.route == "quadrature"
    assert found.motion.startswith("that of the collocation on the cells of the figures")


@pytest.mark.slow
def test_implicit_steps_are_told():
    linkage = flywheel.explain(flywheel.load(EXAMPLES / "linkages" / "six_bar.toml"), 1e-4)
    assert linkage.motion.startswith("stepped in time, implicitly, as a linkage")
    assert "implicitly" not in explain(scenes.yoke(), "audit", 1e-4).motion


def test_the_cost_is_told_as_measured():
    found = explain(scenes.yoke(), "confirm", 1e-4)
    cost, text = found.sizing.cost, found.text()
    assert found.as_dict()["cost"] == cost.as_dict()
    told = [line.split() for line in text[text.index("What it cost") :].splitlines()]
    assert ["the", "whole", str(cost.evaluations)] in [row[:3] for row in told]
    assert [row[:2] for row in told[3:5]] == [[name, str(stage.evaluations)] for name, stage in cost.stages.items()]
    assert "flywheel tradeoff measures it" in text


def test_a_diagram_of_areas_has_little_to_explain():
    areas = {"areas": {"values": [100, -100], "scale": "1 J"}, "regime": {"speed": "60 rpm"}}
    found = explain(areas | {"flywheel": {"irregularity": 0.02}})
    assert "diagram" in found.formulation
    assert found.because == ("the scene gives the areas themselves: areas.values",)
    assert found.forced == ()
    assert found.sizing.cost.evaluations == 0
    assert "What takes more" not in found.text()


def test_the_blocks_of_an_explanation():
    told = explain(scenes.yoke()).text()
    titles = [line for line in told.splitlines() if line and not line.startswith(" ")]
    assert titles == [
        "How it was worked out (normal)",
        "What the torques depend on",
        "Not modelled, as this scene or this level does not need it",
        "What takes more than a smooth machine would",
        "What it cost, loading of libraries left out",
    ]
    assert told.endswith("\n")


def test_an_explanation_of_a_sizing_at_hand_runs_nothing_again():
    sizing = flywheel.size(flywheel.load(scenes.yoke()), accuracy="normal")
    assert explanation(sizing).sizing is sizing
