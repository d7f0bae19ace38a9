import numpy as np
import pytest
from numpy.testing import assert_allclose

from bondgraph.elements import Here
from flywheel.machine.machine import Effort, Pieces, Place, Senses, crank_angles, spring_effort
from flywheel.numerics.expressions import parse
from flywheel.numerics.jets import Jet
from flywheel.scene.scene import Load, Spring, Table

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


# -- speed and time ------------------------------------------------------------------------------------------------------

PORT = Place("m.slider", lambda here: here.q, rate=2.0, rotating=False)
WHEEL = Place("motor", lambda here: here.q, shaft=True)


def moving(q, speed, flow, time=0.0):
    return at(q)._replace(speed=speed, flow=flow, time=time)


def test_a_shaft_has_its_own_speed_and_a_port_that_of_the_shaft_that_drives_it():
    here = moving(1.0, 5.0, 20.0)
    for place, omega in ((WHEEL, 20.0), (PORT, 5.0)):
        effort = Effort(Load(place.junction, parse("100*omega + v"), TURN), place, {})
        assert effort(here, here) == pytest.approx(100 * omega + 20)
        assert (effort.uses_speed, effort.uses_time) == (True, False)


def test_time_and_parameters_in_one_law():
    effort = Effort(Load("crank", parse("k*t*omega + phi", frozenset("k")), TURN), SHAFT, {"k": 3.0})
    here = moving(1.0, 5.0, 5.0, 7.0)
    assert effort.uses_time
    assert effort(here, here) == pytest.approx(3 * 7 * 5 + 1)


@pytest.mark.parametrize("law", ["sign(v)", "3 if v > 0 else 5", "x*(v < 0)"])
def test_the_sign_of_a_velocity_is_no_speed(law):
    effort = Effort(Load("crank", parse(law), TURN), SHAFT, {}, senses=Senses(np.array([np.pi]), np.array([1.0, -1.0])))
    assert not effort.uses_speed
    assert not effort.uses_time


def test_branches_that_depend_on_speed_are_decided_at_the_anchor():
    effort = Effort(Load("crank", parse("min(40, 4*(110 - omega))"), TURN), SHAFT, {})
    slow, fast = moving(0.0, 90.0, 90.0), moving(0.0, 105.0, 105.0)
    assert effort(fast, fast) == pytest.approx(20.0)
    assert effort(slow, slow) == pytest.approx(40.0)
    assert effort(fast, slow) == pytest.approx(40.0)
    assert effort(slow, fast) == pytest.approx(80.0)


def test_what_decides_branches_has_the_sign_of_their_sides():
    """|v| - 7, on the anchor's side of v = 0; v itself turns with the position, or with the machine: its driving speed."""
    effort = Effort(Load("m.slider", parse("-8*max(0, abs(v) - 7)*sign(v) - (phi > 2)"), TURN), PORT, {})
    here, anchor = moving(np.ones(4), 5.0, np.array([-9.0, -3.0, 3.0, 9.0])), moving(1.0, 5.0, 9.0)
    own, past = effort.speed_switches(here, anchor)
    assert own == 5.0
    assert_allclose(past, [-16, -10, -4, 2])
    _, past = effort.speed_switches(here, moving(1.0, 5.0, -9.0))
    assert_allclose(past, [2, -4, -10, -16])
    assert not Effort(Load("crank", 3.0, TURN), SHAFT, {}).speed_switches(anchor, anchor)
    assert not Effort(Load("crank", parse("-omega"), TURN), SHAFT, {}).speed_switches(anchor, anchor)


def test_slopes_by_speed_come_from_jets():
    effort = Effort(Load("m.slider", parse("-2*v*abs(v) + sin(phi)*omega"), TURN), PORT, {})
    omega = np.array([1.0, 4.0])
    jet = Jet(omega, 1.0)
    here = moving(1.0, jet, 3.0 * jet)
    found = effort(here, moving(1.0, omega, 3.0 * omega))
    assert_allclose(found.value, -18 * omega**2 + np.sin(1.0) * omega)
    assert_allclose(found.first, -36 * omega + np.sin(1.0))


def test_a_balance_may_be_the_factor_of_a_speed():
    effort = Effort(Load("crank", parse("3 - c*omega", frozenset("c")), TURN), SHAFT, {}, "c")
    here = moving(1.0, 5.0, 5.0)
    assert (effort(here, here), effort.per_unknown(here, here)) == (3.0, -5.0)


def test_windows_hold_for_moving_laws_too():
    effort = Effort(Load("crank", parse("-omega"), TURN, 1.0, 2.0), SHAFT, {})
    inside, outside = moving(1.5, 5.0, 5.0), moving(2.5, 5.0, 5.0)
    assert (effort(inside, inside), effort(outside, outside)) == (-5.0, 0.0)


def test_models_and_motors_have_their_own_path():
    assert Effort(Load("crank", parse("-omega"), TURN, path="load[1]", model="fan"), SHAFT, {}).path == "load[1].model"
    assert Effort(Load("crank", parse("-omega"), TURN, path="drive", model="line"), SHAFT, {}).path == "drive.motor"
