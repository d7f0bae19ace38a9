"""What goes with a bond that has no power, and what holds what stays."""

import numpy as np
import pytest

from bondgraph import Builder, C, GraphError, I, One, R, Se, Sf, Zero
from bondgraph.simplification.rules import (
    drop_dangling,
    drop_zero_sources,
    drop_zero_velocity,
    simplify,
)
from tests.bondgraph.simplification.rows import LOAD, line, listed


@pytest.mark.parametrize("row", [["1:a", "1:x"], ["1:a", "0:z", "1:x"], ["1:a", "1:y", "0:z", "1:x"]])
def test_dangling_1_junctions_go_with_the_junctions_that_lead_to_them(row):
    found = drop_dangling(line(*row, elements=LOAD).build(loose=True)).graph
    assert set(found.elements) >= {"a", "M", "J"}
    assert not set(found.elements) & {"x", "z"}


def test_a_dangling_0_junction_stops_the_1_junction_that_it_hangs_on():
    b = line("1:a", "0:z", "1:b", elements={**LOAD, "b": [I("m", 1.0)], "z": [R("B", 1.0)]}).zero("x").bond("b", "x")
    found = drop_dangling(b.build(loose=True))
    assert found.log[0].what == "1:b, I:m, 0:x dropped"
    assert listed(found.graph)[-1] == "0:z -> R:B = 1"


def test_a_dangling_1_junction_takes_the_power_of_all_that_shares_its_zero_effort():
    b = line("1:a", "0:z", "1:x", elements={**LOAD, "z": [C("k", 0.1), R("B", 0.5)]})
    found = drop_dangling(b.build(loose=True))
    assert listed(found.graph) == ["Se:M = 3 -> 1:a", "1:a -> I:J = 2"]
    assert found.log[0].what == "0:z, 1:x, C:k, R:B dropped"
    assert found.log[0].bonds == (1, 2, 5, 6)


def test_a_dangling_1_junction_that_contradicts_a_source_is_an_error_that_names_it():
    b = line("1:a", "0:z", "1:x", elements={**LOAD, "z": [Se("F", 3.0)]})
    with pytest.raises(GraphError, match="bond 5: Se:F = 3 sets an effort that the rest keeps at 0"):
        drop_dangling(b.build(loose=True))


def slider(driven):
    """A slider that nothing hangs on, driven through an MTF from the crank, or driving it."""
    b = line("1:a", elements=LOAD).one("x").displacement("q", "a")
    return b.transform(*(("a", "x") if driven else ("x", "a")), lambda q: np.sin(q), name="T").build(loose=True)


def test_a_modulated_transformer_goes_only_in_the_direction_in_which_its_zeros_do_not_matter():
    assert set(drop_dangling(slider(True)).graph.elements) == {"a", "M", "J"}
    assert drop_dangling(slider(False)).log == ()  # where sin q = 0, x takes any effort and a stands still


@pytest.mark.parametrize(
    ("junction", "source", "left"),
    [
        (One, Se, {"j", "p", "q", "other", "r"}),  # no term in the sum of efforts
        (Zero, Sf, {"j", "p", "q", "other", "r"}),  # no term in the sum of flows
        (Zero, Se, {"other", "r"}),  # no effort at j: nothing on it has power
        (One, Sf, {"other", "r"}),  # no flow at j
    ],
)
def test_a_zero_source_is_no_term_or_takes_its_junction_with_it(junction, source, left):
    b = Builder()
    other = Zero if junction is One else One
    b.add(junction("j"))
    b.add(other("other"))
    b.on("j", source("s", 0.0), I("p", 1.0), R("q", 2.0)).bond("j", "other").port("other", R("r", 1.0))
    assert set(drop_zero_sources(b.build()).graph.elements) == left


def test_ground_goes_with_all_that_hangs_on_it():
    b = line("1:a", elements=LOAD).one("ground").on("ground", I("earth", 6e24), R("soil", 1.0))
    found = drop_zero_velocity(b.between("a", "ground", R("B", 0.5)).build(), ["ground"])
    assert listed(found.graph)[-1] == "0:a-ground -> R:B = 0.5"
    assert found.log[0].what == "1:ground, I:earth, R:soil dropped"
    assert listed(simplify(found.graph).graph) == ["Se:M = 3 -> 1:a", "1:a -> I:J = 2", "1:a -> R:B = 0.5"]


def test_ground_stays_where_a_displacement_is_measured_or_the_graph_would_fall_apart():
    b = Builder().one("g").one("a").one("b").on("a", I("ma", 1.0)).on("b", I("mb", 1.0))
    graph = b.between("a", "g", C("ka", 1.0)).between("b", "g", C("kb", 1.0)).build()
    held = drop_zero_velocity(graph, ["g"]).graph
    assert held.elements["g.zero"].law == 0.0
    measured = Builder().one("g", displacement="x").one("a").on("a", I("m", 1.0)).between("a", "g", C("k", 1.0)).build()
    assert "g.zero" in drop_zero_velocity(measured, ["g"]).graph.elements


def test_ground_beyond_a_modulated_transformer_is_held_by_a_source():
    b = line("1:a", elements=LOAD).displacement("q", "a").one("g").transform("a", "g", lambda q: np.cos(q), name="T")
    found = drop_zero_velocity(b.on("g", I("m", 1.0)).build(), ["g"])
    assert listed(found.graph)[2:] == ["1:a -> MTF:T", "MTF:T -> 1:g", "Sf:g.zero = 0 -> 1:g"]


def test_a_graph_of_zeros_alone_is_an_error():
    with pytest.raises(GraphError, match="nothing is left without Se:s"):
        simplify(line("1:a", "1:b", elements={"a": [Se("s", 0.0)]}).build(loose=True))
