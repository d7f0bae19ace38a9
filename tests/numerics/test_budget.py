import tracemalloc

import numpy as np
import pytest

import flywheel
from flywheel.machine.dynamics import Moments
from flywheel.machine.machine import Effort
from flywheel.numerics import cells
from flywheel.numerics.budget import Cost, count, counted, metered
from tests import regimes, scenes
from tests.limits import sample


def test_laps_add_up_to_the_whole():
    with metered() as meter:
        count(4)
        first = meter.lap()
        count(3)
        second = meter.lap()
    assert (first.evaluations, second.evaluations, meter.cost.evaluations) == (4, 3, 7)
    assert 0.0 < first.seconds + second.seconds <= meter.cost.seconds


def test_stages_are_told_by_name():
    cost = Cost(3, 0.5, {"figures": Cost(1, 0.25)})
    assert cost.as_dict() == {"evaluations": 3, "seconds": 0.5, "figures": {"evaluations": 1, "seconds": 0.25}}


@pytest.mark.parametrize("level", ["normal", "confirm"])
def test_a_sizing_tells_what_it_cost(level):
    scene = flywheel.load(scenes.press())
    with counted() as tally:
        cost = flywheel.size(scene, accuracy=level).cost
    figures, simulation = cost.stages["figures"], cost.stages["simulation"]
    assert cost.evaluations == tally.evaluations == figures.evaluations + simulation.evaluations
    assert figures.seconds + simulation.seconds <= cost.seconds
    assert (simulation.evaluations > 0) == (level == "confirm")
    assert level == "confirm" or flywheel.size(scene, accuracy=level).cost.evaluations == cost.evaluations


def test_cells_are_counted_once_where_loads_depend_on_position_alone():
    sizing = flywheel.size(flywheel.load(scenes.press()), accuracy="normal")
    assert sizing.cycle.mesh.edges.size == sizing.machine.mesh.size  # nothing was halved
    assert sizing.cost.evaluations == sizing.cycle.mesh.phi.size


def test_torques_at_other_speeds_count_again():
    machine = flywheel.Machine(flywheel.load(regimes.scene("section-c", inertia=2)))
    mesh = cells.cells(machine.mesh)
    with counted() as tally:
        moments = Moments(machine, mesh, local=True)
    walked = tally.evaluations
    assert walked == moments.mesh.phi.size
    with counted() as tally:
        moments.rate(np.full(moments.mesh.phi.shape, 4.0), 0.0, 0.0)
    assert tally.evaluations == walked


def test_a_diagram_of_areas_costs_no_evaluation():
    areas = {"areas": {"values": [100, -100], "scale": "1 J"}, "regime": {"speed": "60 rpm"}}
    sizing = flywheel.size(flywheel.load(areas | {"flywheel": {"irregularity": 0.02}}))
    assert sizing.cost.evaluations == 0
    assert sizing.cost.seconds > 0.0


def test_the_motion_is_a_stage_of_its_own_where_torques_depend_on_speed():
    cost = flywheel.size(flywheel.load(regimes.scene("pump", inertia=5)), accuracy="normal").cost
    motion = cost.as_dict()["figures"]["motion"]
    assert 0 < motion["evaluations"] < cost.evaluations


def windows(count, **load):
    """A press whose slider is pushed in so many windows, three fifths of the turn."""
    width = 360 / count
    places = [{"from": f"{k * width} deg", "to": f"{(k + 0.6) * width} deg"} for k in range(count)]
    return scenes.press(load=[{"on": "slider"} | place | load for place in places])


@pytest.mark.parametrize(
    "load", sample([{"force": "-1 kN", "while": "v > 0"}, {"force": "-1 kN"}, {"force": "-1000 - 9*v"}], 3)
)
def test_stepping_asks_only_the_loads_that_act(load, monkeypatch):
    asked = []
    law = Effort.__call__
    monkeypatch.setattr(Effort, "__call__", lambda self, here, anchor: asked.append(here.q) or law(self, here, anchor))
    cost = flywheel.size(flywheel.load(windows(5, **load)), 1e-4).cost
    assert sum(isinstance(q, float) for q in asked) < 3 * cost.evaluations  # a load, the drive, and what searches look at


def test_a_long_table_takes_memory_for_its_rows_and_no_grids():
    rows = 4_000
    angle = np.linspace(0.0, 2 * np.pi, rows)
    table = {"angle": angle.tolist(), "value": (-9 - np.sin(angle)).tolist()}
    scene = flywheel.load(scenes.press(load=[{"on": "crank", "table": table}]))
    tracemalloc.start()
    flywheel.size(scene, accuracy="normal")
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert most < 6_000 * rows


def test_designs_whose_dead_centres_are_known_are_searched_for_none():
    load = [{"on": "slider", "force": "-800*sign(v)"}]
    with counted() as tally:
        machine = flywheel.Machine(flywheel.load(scenes.press(load=load)))
    assert tally.evaluations == 0
    assert machine.breakpoints.tolist() == [0.0, np.pi, 2 * np.pi]
