import numpy as np
import pytest
from numpy.testing import assert_allclose

from bondgraph.elements import Here
from flywheel.formulas.expressions import parse
from flywheel.loads import Effort, Pieces, Place, Senses, crank_angles, spring_effort
from flywheel.scene import Load, Spring, Table

TURN = 2 * np.pi
SHAFT = Place("crank", lambda here: here.q)


def at(q):
    return Here(np.asarray(q, dtype=float), None, np)


def value(effort, q, anchor=None):
    return effort(at(q), at(q if anchor is None else anchor))


def table(interpolation):
    angle, values = np.array([0.0, 1.0, 1.0, 3.0]), np.array([0.0, 2.0, 5.0, 1.0])
    return Pieces(Table(angle, values, interpolation))


def test_linear_tables_interpolate_and_jump():
    pieces = table("linear")
    assert_allclose(pieces(np.array([0.5, 2.0]), np.array([0.5, 2.0])), [1.0, 3.0])
    assert pieces(np.array(1.0), np.array(0.9)) == 2.0  # the piece of the anchor counts
    assert pieces(np.array(1.0), np.array(1.1)) == 5.0
    assert pieces.knots.tolist() == [0.0, 1.0, 3.0]


def test_step_tables_hold_their_value():
    assert_allclose(table("step")(np.array([0.7, 2.9]), np.array([0.7, 2.9])), [0.0, 5.0])


def test_pchip_tables_do_not_overshoot_and_mix_with_short_runs():
    angle = np.array([0.0, 1.0, 1.0, 2.0, 3.0, 4.0])
    pieces = Pieces(Table(angle, np.array([0.0, 2.0, 0.0, 1.0, 1.0, 3.0]), "pchip"))
    inside = np.linspace(2.0, 3.0, 9)[1:-1]
    assert_allclose(pieces(inside, inside), 1.0)
    assert_allclose(pieces(np.array(0.5), np.array(0.5)), 1.0)


def test_windows_are_half_open_by_the_piece_and_wrap():
    window = Effort(Load("crank", 7.0, TURN, 5.0, 1.0), SHAFT, {})
    assert_allclose(value(window, [0.5, 2.0, 5.5]), [7.0, 0.0, 7.0])
    assert_allclose(value(window, [1.0, 1.0], [0.9, 1.1]), [7.0, 0.0])


def test_every_repeats_window_and_phi():
    effort = Effort(Load("crank", parse("phi"), 1.0, 0.0, 0.5), SHAFT, {})
    assert_allclose(value(effort, [0.25, 0.75, 2.25, 3.25]), [0.25, 0.0, 0.25, 0.25], atol=1e-15)


def test_senses_gate_a_load_with_its_window():
    senses = Senses(np.array([np.pi]), np.array([1.0, -1.0]))
    effort = Effort(Load("crank", 3.0, TURN, 1.0, 5.0, sense=-1), SHAFT, {}, senses=senses)
    assert_allclose(value(effort, [0.5, 2.0, 4.0, 6.0]), [0.0, 0.0, 3.0, 0.0])


def test_ports_see_their_mechanisms_own_angle():
    place = Place("m.slider", lambda here: here.q, rate=2.0, phase=0.5)
    effort = Effort(Load("m.slider", parse("phi"), TURN), place, {})
    assert value(effort, 1.0) == pytest.approx(1.5)  # q is already the shaft's angle


def test_the_unknown_is_kept_apart_from_the_rest():
    effort = Effort(Load("crank", parse("3 + 2*p*sin(phi)", frozenset("p")), TURN), SHAFT, {}, "p")
    assert effort.depends_on_unknown
    assert value(effort, 1.0) == 3.0
    assert effort.per_unknown(at(1.0), at(1.0)) == pytest.approx(2 * np.sin(1.0))
    drive = Effort(Load("crank", None, TURN), SHAFT, {}, "drive")
    assert (value(drive, 1.0), drive.per_unknown(at(1.0), at(1.0))) == (0.0, 1.0)


def test_tables_may_start_below_zero():
    angle = np.array([-1.0, 0.0, 1.0])
    effort = Effort(Load("crank", Table(angle, np.array([1.0, 2.0, 5.0])), TURN, TURN - 1.0, 1.0), SHAFT, {})
    assert_allclose(value(effort, [0.5, TURN - 0.5, 3.0]), [3.5, 1.5, 0.0])


def test_springs_take_up_what_stretches_them():
    effort = spring_effort(Spring("crank", 10.0, 0.5), SHAFT)
    assert effort(at(0.75), at(0.75)) == pytest.approx(2.5)


def test_crank_angles_of_a_local_angle():
    place = Place("m.slider", lambda here: here.q, rate=2.0, phase=1.0)
    found = crank_angles(0.5, TURN, place, TURN)
    assert_allclose((2 * found + 1.0) % TURN, 0.5)
    assert found.size == 2
    assert crank_angles(0.0, TURN, SHAFT, 2 * TURN).tolist() == [0.0, TURN]
