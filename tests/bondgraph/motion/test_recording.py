"""Recordings compute what was recorded."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from bondgraph import function
from bondgraph.laws import Dual
from bondgraph.motion.algebra import Recorder


def recorded(given, count):
    recorder = Recorder()
    return recorder.function(given(*recorder.inputs(count)))


def test_arithmetic_and_functions_are_taken_down():
    def given(x, y):
        return [
            x * y - 1.0,
            np.sin(x) / (2.0 + y),
            -x + y**2,
            abs(x),
            np.hypot(x, y),
            np.arctan2(y, x),
            np.sign(x),
            np.square(y),
        ]

    compiled = recorded(given, 2)
    for x, y in ((0.3, 1.2), (-2.0, 0.5)):
        assert_allclose(compiled(x, y), [float(v) for v in given(x, y)], rtol=1e-15)


@pytest.mark.parametrize("value", [np.float64(-2.0), -2.0, 0.0, 3.0])
def test_sign_takes_numpys_numbers_too(value):
    assert recorded(lambda x: [np.sign(x)], 1)(value) == (np.sign(value),)


def test_zeros_and_ones_leave_no_code():
    recorder = Recorder()
    (x,) = recorder.inputs(1)
    assert x * 1.0 is x
    assert x + 0.0 is x
    assert isinstance(0.0 * x, float)
    assert 0.0 * x == 0.0
    assert x / 1.0 is x


def test_an_operation_that_comes_twice_is_done_once():
    recorder = Recorder()
    x, y = recorder.inputs(2)
    assert (x * y).name == (x * y).name


def test_what_branches_stays_a_call():
    def branching(x):
        return 2.0 * x if x > 0.0 else -x

    recorder = Recorder()
    (x,) = recorder.inputs(1)
    compiled = recorder.function([recorder.through(branching, [x], 0), recorder.through(math.floor, [x], 0)])
    assert compiled(1.5) == (3.0, 1)
    assert compiled(-1.5) == (1.5, -2)


def test_slopes_with_respect_to_each_of_several_arguments_are_recorded():
    law = function(lambda a, b: a * np.sin(b) + a / b - np.hypot(a, b) + (2.0 - a) ** 3)
    recorder = Recorder()
    x, y = recorder.inputs(2)
    value, slopes = law.partials(x, y)
    assert not any(isinstance(found, Dual) for found in (value, *slopes))
    expected, exact = law.partials(0.7, 1.3)
    assert_allclose(recorder.function([value, *slopes])(0.7, 1.3), [expected, *exact], rtol=1e-15)


def test_names_are_no_code():
    recorder = Recorder()
    (x,) = recorder.inputs(1)
    called = []
    recorder.function([recorder.call(called.append, (x,), 0)])("); raise SystemExit")
    assert called == ["); raise SystemExit"]
