import numpy as np
import pytest

from bondgraph import GY, TF, C, GraphError, I, R, Se
from bondgraph.simplification.procedure import procedure

CRANK, ROD = 1.0, 2.0


def ratio(theta):
    """Velocity of the slider per angular velocity of the crank (thesis, eq. 40)."""
    share = CRANK / ROD
    return CRANK * (share / 2 * np.sin(2 * theta) / np.sqrt(1 - (share * np.sin(theta)) ** 2) + np.sin(theta))


def slider_crank(**options):
    """The thesis' slider-crank, figures 19 to 29: torque, friction and force act against the ground."""
    return procedure(
        velocities={"crank": "rotation", "slider": "translation", "bearing": "rotation", "ground": "translation"},
        zero=("bearing", "ground"),
        elements=[
            (Se("M", 3.0), "crank", "bearing"),
            (I("J", 2.0), "crank"),
            (I("m", 4.0), "slider"),
            (R("B", 0.5), "slider", "ground"),
            (Se("F", -7.0), "slider", "ground"),
        ],
        transducers=[(TF("T", ratio), "crank", "slider")],
        displacements={"theta": "crank"},
        **options,
    )


def ends(graph):
    return {(graph.symbol(b.tail), b.tail, graph.symbol(b.head), b.head) for b in graph.bonds}


def test_the_slider_crank_of_the_thesis_ends_with_its_seven_bonds():
    graph = slider_crank().graph
    assert [b.number for b in graph.bonds] == [1, 2, 3, 4, 5, 6, 7]
    assert ends(graph) == {
        ("Se", "M", "1", "crank"),
        ("1", "crank", "I", "J"),
        ("1", "crank", "MTF", "T"),
        ("MTF", "T", "1", "slider"),
        ("1", "slider", "I", "m"),
        ("1", "slider", "R", "B"),
        ("Se", "F", "1", "slider"),
    }


def test_each_step_of_the_thesis_leaves_what_its_figure_shows():
    steps = slider_crank().steps
    assert [s.number for s in steps] == [1, 2, 3, 4, 5, 6, 7]
    assert [s.graph is None for s in steps] == [True] * 3 + [False] * 4
    assert steps[0].what[2] == "1:bearing (rotation) = 0"
    assert len(steps[3].graph.bonds) == 13  # figure 25: three 0-junctions of three bonds, two inertias, the transformer
    assert len(steps[4].graph.bonds) == 10  # figure 26: the ground is gone
    assert set(steps[4].graph.elements) >= {"crank-bearing.M", "slider-ground.B", "slider-ground.F"}
    assert len(steps[5].graph.of_kind("0")) == 0  # figures 27 and 28: 0-junctions with one bond in and one out go
    assert steps[6].graph is steps[5].graph


def test_causality_is_the_thesis_one():
    found = slider_crank().causality
    assert found.integral == ("J",)
    assert found.derivative == ("m",)


def test_printed_it_says_what_every_step_did():
    text = str(slider_crank())
    for line in (
        "3 transformers and gyrators\n    MTF:T between 1:crank and 1:slider",
        "R:B = 0.5 on 0:slider-ground.B between 1:slider and 1:ground",
        "1:ground dropped; 1:ground does not move",
        "all rules: from 10 bonds to 7; numbered anew",
        "derivative: m",
    ):
        assert line in text


def test_power_directions_make_a_force_push_the_first_velocity_and_pull_the_second():
    drawn = procedure(
        {"a": "translation", "b": "translation"},
        [(I("ma", 1.0), "a"), (I("mb", 2.0), "b"), (Se("F", 3.0), "a", "b"), (C("k", 0.1), "a", "b")],
    )
    directed = {(b.tail, b.head) for b in drawn.steps[3].graph.bonds}
    assert {("F", "a-b.F"), ("a-b.F", "a"), ("b", "a-b.F")} <= directed
    assert {("a-b.k", "k"), ("a", "a-b.k"), ("a-b.k", "b")} <= directed


def test_parallel_spring_and_damper_end_on_one_junction():
    drawn = procedure(
        {"a": "translation", "b": "translation"},
        [(I("ma", 1.0), "a"), (I("mb", 2.0), "b"), (R("B", 3.0), "a", "b"), (C("k", 0.1), "a", "b"), (Se("F", 1.0), "a")],
    )
    graph = drawn.graph
    assert graph.bond_of("B").other("B") == graph.bond_of("k").other("k")
    assert "double difference" in str(drawn.steps[5])


def test_a_gyrator_joins_two_domains():
    drawn = procedure(
        {"armature": "electric", "shaft": "rotation"},
        [(Se("U", 12.0), "armature"), (R("Ra", 0.3), "armature"), (I("J", 0.01), "shaft"), (R("B", 0.1), "shaft")],
        [(GY("k", 0.05), "armature", "shaft")],
    )
    assert len(drawn.graph.bonds) == 6
    assert "GY:k = 0.05 between 1:armature and 1:shaft" in str(drawn)


def test_what_is_to_be_kept_is_kept():
    kept = procedure(
        {"motor": "rotation", "shaft": "rotation"},
        [(Se("M", 1.0), "motor"), (I("J", 1.0), "shaft"), (R("B", 1.0), "shaft")],
        [(TF("T", 2.0), "motor", "shaft")],
        displacements={"phi": ("shaft", 0.5)},
        keep=["motor"],
    )
    assert {"motor", "shaft"} <= set(kept.graph.elements)
    assert kept.graph.displacements["phi"].initial == 0.5


def test_everything_that_does_not_fit_is_reported_at_once():
    with pytest.raises(GraphError) as caught:
        procedure(
            {"a": "translation", "idle": "translation"},
            [(I("m", 1.0), "a"), (I("m", 2.0), "nowhere"), (TF("T", 1.0), "a"), (R("B", 1.0), "a", "a")],
            [(GY("G", 1.0), "a", "elsewhere")],
            zero=["ground"],
            displacements={"x": "slider"},
        )
    assert str(caught.value).splitlines() == [
        "two of the velocities and elements are named 'm'",
        "I:m: no velocity 'nowhere'",
        "TF:T: found a TF, expected one of C, I, R, Se, Sf",
        "R:B: found velocities a, a, expected 1 or 2 different ones",
        "GY:G: no velocity 'elsewhere'",
        "zero velocity 'ground': no such velocity",
        "displacement 'x': no velocity 'slider'",
        "velocity 'idle': nothing is on it, leave it out",
    ]


def test_velocities_of_two_domains_need_a_transducer():
    with pytest.raises(GraphError, match="without a transducer"):
        procedure({"a": "rotation", "b": "translation"}, [(I("J", 1.0), "a"), (R("B", 1.0), "a", "b")])
