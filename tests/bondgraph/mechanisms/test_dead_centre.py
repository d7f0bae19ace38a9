"""What dividing by the modulus does at a dead centre, and that the crank's side does without."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bondgraph import GraphError
from bondgraph.case_study import HARMONIC, STEADY, Loads, divided_by_modulus, printed_programme


def test_without_torque_the_printed_modulus_stops_at_the_first_dead_centre():
    found = divided_by_modulus(steps=(1e-2, 1e-3))
    assert_allclose(found.errors("|T|"), [1.12, 1.10], atol=0.01)
    assert_allclose([p.reached for p in found.passages if p.scheme == "|T|"], np.pi, atol=0.01)
    assert_allclose([p.reached for p in found.passages if p.scheme == "T, floor"], np.pi, atol=0.01)
    assert found.reached == pytest.approx(9.1352, abs=1e-4)


def test_with_torque_it_runs_away_at_every_step():
    found = divided_by_modulus(loads=Loads(torque=1.0), steps=(1e-2, 1e-3))
    assert found.errors("|T|") == (np.inf, np.inf)
    assert min(found.errors("T")) > 10.0
    assert min(found.errors("T, floor")) > 5.0


@pytest.mark.parametrize("loads", [Loads(), Loads(1.0), Loads(1.0, 0.5, 0.2)])
def test_crank_side_is_of_first_order(loads):
    coarse, fine = divided_by_modulus(loads=loads, steps=(4e-3, 2e-3), until=4.0).errors("crank side")
    assert coarse / fine == pytest.approx(2.0, rel=0.1)


def test_dead_centre_from_the_start():
    found = divided_by_modulus(start=(0.0, 1.0), steps=(1e-2,), until=1.0)
    assert found.errors("|T|") == (np.inf,)
    assert found.errors("crank side")[0] < 0.1


def test_printed_programme_tends_to_another_curve():
    steps = (1e-2, 1e-3)
    assert_allclose(printed_programme(None, HARMONIC, steps=steps), 1.32, atol=0.01)
    assert_allclose(printed_programme(None, STEADY, steps=steps), 5.616, atol=0.001)
    assert_allclose(printed_programme(None, HARMONIC, steps=steps, torque="needed"), 1.31, atol=0.02)


def test_printed_programme_on_a_dead_centre():
    (error,) = printed_programme(until=2 * np.pi, steps=(2 * np.pi / 1000,))
    assert error > 1e9


def test_schemes_that_are_not_there():
    with pytest.raises(GraphError, match="no scheme 'x': there are"):
        divided_by_modulus(steps=(0.1,)).errors("x")


def test_arguments_that_mean_nothing():
    with pytest.raises(GraphError, match="torque: found 'some'"):
        printed_programme(torque="some")
    with pytest.raises(GraphError, match=r"steps: found 0\.0"):
        divided_by_modulus(steps=(0.1, 0.0))
    with pytest.raises(GraphError, match="floor: found -1"):
        divided_by_modulus(floor=-1.0)
