"""What a walk looks up."""

import numpy as np
import pytest

from bondgraph import Builder, C, I, Law, Modulus, Motion, R, Se, Sf
from bondgraph.motion.dynamics import tables
from bondgraph.motion.formulation import Formulation


def found(builder):
    return tables(Formulation(builder.build()), {})


def test_displacements_belong_to_flows_and_1_junctions_to_displacements():
    b = Builder().one("crank", displacement="theta").one("ram").on("crank", I("J", 2.0)).on("ram", I("m", 1.0))
    b.displacement("phi", "crank", 0.5)
    table = found(b.transform("crank", "ram", lambda theta: np.sin(theta), name="T"))
    assert table.owner_of == dict.fromkeys(("theta", "phi"), table.form.variable("crank"))
    assert table.displacement_of == {"crank": "theta"}  # the one that was declared first
    assert [name for _, name in table.moduli] == ["T"]
    assert [inertia for inertia, _ in table.inertias] == [2.0, 1.0]


def test_motions_are_anchored_once_each():
    motion = Motion("crank")
    b = Builder().one("crank").one("ram").on("crank", I("J", 2.0), Se("M", Law(lambda here, anchor: here.q, motion)))
    table = found(b.transform("crank", "ram", Modulus(np.sin, np.cos, motion)).on("ram", I("m", 1.0)))
    assert table.anchored == ("crank",)
    assert table.displacement_of == {"crank": "crank"}


def test_each_bond_of_a_gyrator_has_the_flow_at_its_other_side():
    table = found(Builder().one("a").one("b").on("a", I("L", 1.0)).on("b", I("J", 1.0)).gyrate("a", "b", 2.0, name="G"))
    into, out = table.form.graph.ends("G")
    assert table.partner == {into.number: table.form.variable("b"), out.number: table.form.variable("a")}


def test_a_spring_whose_law_a_motion_gives_is_no_state():
    law = Law(lambda here, anchor: here.q, Motion("a"))
    table = found(Builder().one("a").on("a", I("m", 1.0), C("k", 1.0), C("cam", law), Sf("v", 1.0)))
    assert [port.element.name for port in table.springs] == ["k"]
    assert [element.name for element in table.imposed] == ["v"]
    assert [table.form.ports[k].element.name for k in table.acting] == ["k", "cam"]


@pytest.mark.parametrize(("law", "iterated"), [(2.0, False), (lambda t: 1.0 + t, False), (lambda f: f**3, True)])
def test_flows_without_inertia_are_iterated_where_a_resistors_law_is_a_curve(law, iterated):
    table = found(Builder().one("pipe").on("pipe", Se("p", 1.0), R("r", law)))
    assert table.iterated == iterated
    assert table.loose == "pipe"
    assert not found(Builder().one("pipe").on("pipe", I("m", 1.0), R("r", law))).iterated
