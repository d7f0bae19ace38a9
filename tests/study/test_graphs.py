"""A cycle of the whole bond graph is that of the reduced machine."""

import pytest

import flywheel
from flywheel.machine.machine import Machine
from flywheel.study import steppers
from flywheel.study.steppers import Trial
from tests.scenes import yoke

MACHINE = Machine(flywheel.load(yoke()))
TRIAL = Trial(inertia=300.0, balance=318.0, speed=6.3, states=(), period=1.0)


def same(found, true):
    return found._replace(states=0.0) == pytest.approx(true._replace(states=0.0), rel=1e-6)


def test_it_agrees_to_its_tolerance():
    true = steppers.adaptive(MACHINE, "DOP853", 1e-12, True)(TRIAL)
    assert same(steppers.by_bond_graph(MACHINE, 1e-6)(TRIAL), true)


def test_it_goes_on_until_the_cycle_is_over():
    true = steppers.adaptive(MACHINE, "DOP853", 1e-12, True)(TRIAL)
    assert same(steppers.by_bond_graph(MACHINE, 1e-6)(TRIAL._replace(period=0.9)), true)
